use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use analysis::allan::{Estimate, Fit, Term};
use analysis::rest::{Chunk, Rest};
use anyhow::{Context, Result, ensure};
use files::output;
use signals::recording::{self, Between, Columns, Signal, Wanted};
use signals::table::Table;

use crate::terminal;

const DEFAULT_GYRO: &str = "dist/gyro";

/// Estimates the noise of a gyro from a recording at rest by its Allan deviation.
///
/// The command also tests whether the noise is normal, white and stationary by quantiles, autocorrelation and statistics
/// of parts of the recording. It writes the tables and figures of these tests.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    hubslosh gyro --recording rest.csv --columns time=t:ms,omega=gyro_z:deg/s --out dist/our_gyro\n  \
    hubslosh run --profile zero:duration=21600 --set imu.enabled=true --set init.slosh_angle=0 --step 0.02 \
    --out rest.parquet\n  \
    hubslosh gyro --recording rest.parquet --columns omega=omega_imu")]
pub struct GyroArgs {
    /// Recording of a gyro at rest: text in columns or Parquet; also .mat, HDF5, TDMS, MDF4 and .xlsx if the Python
    /// package is installed.
    #[arg(long, value_name = "FILE")]
    recording: PathBuf,
    /// Columns of the recording that contain the signals time and omega, with units, such as
    /// time=t:ms,omega=gyro_z:deg/s. A signal that is not named here is read from the column that has the name of the
    /// signal.
    #[arg(long, value_name = "SIGNAL=COLUMN[:UNIT],…", default_value_t, hide_default_value = true)]
    columns: Columns,
    /// Sampling rate of a recording without times, Hz.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Length of the parts into which the recording is divided, to test whether the noise changes with time, s.
    /// Rubaga's thesis uses 15 min.
    #[arg(long, value_name = "SECONDS", default_value_t = 900.0)]
    chunk: f64,
    /// File for a report on the recording, .html.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Directory for the tables and pictures.
    #[arg(long, value_name = "DIRECTORY", default_value = DEFAULT_GYRO)]
    out: PathBuf,
}

impl GyroArgs {
    pub fn run(self) -> Result<()> {
        let columns = self.columns.clone().with_rate(self.rate)?;
        let rest = analyse_recording(&self.recording, &columns, Some(self.chunk))?;
        output::directory(&self.out)?;
        for (name, table) in tables(&rest) {
            table.write(&self.out.join(name), &BTreeMap::new())?;
        }
        for (name, picture) in report::gyro::rest_charts(&rest) {
            output::write(&self.out.join(name), picture.file().as_bytes())?;
        }
        let rows = rows(&rest);
        for (name, value) in &rows {
            println!("{name:34}{value}");
        }
        if let Some(path) = &self.report {
            let page = report::gyro::page(&rows, &rest);
            output::write(path, page.as_bytes())?;
            done!("{}", path.display());
        }
        done!("{}", self.out.display());
        Ok(())
    }
}

/// Longest lag of the autocorrelation, s.
const LAG: f64 = 10.0;
const CHUNK: f64 = 900.0;
const CHUNKS: f64 = 8.0;
const LEAST_CHUNKS: f64 = 3.0;

/// Analyses the signal omega of a recording of a gyro at rest in parts of `chunk` seconds. If no length is given, the
/// parts have 900 s, or an eighth of a shorter recording.
pub fn analyse_recording(path: &Path, columns: &Columns, chunk: Option<f64>) -> Result<Rest> {
    let signals = [Signal { name: "omega", required: true, between: Between::Line, unit: None }];
    let mut say = |line: String| terminal::note(line);
    let table = recording::read(path, &Wanted { signals: &signals, columns }, &mut say)?;
    let path = path.display();
    let (step, table) = recording::even(table, &mut say)
        .with_context(|| format!("the recording {path} cannot be used"))?;
    let omega = table.column("omega").unwrap_or_default();
    let seconds = step * omega.len() as f64;
    match chunk {
        Some(chunk) => ensure!(
            chunk > 0.0 && seconds > LEAST_CHUNKS * chunk && chunk > 10.0 * step,
            "{path}: the recording lasts {seconds:.0} s, in chunks of {chunk} s (allowed: at least {LEAST_CHUNKS} chunks of at \
             least 10 rows; --chunk SECONDS sets their length)"
        ),
        None => ensure!(
            seconds > 20.0 * LAG,
            "{path}: the recording lasts {seconds:.0} s (allowed: at least {:.0} s)",
            20.0 * LAG
        ),
    }
    ensure!(
        omega.iter().any(|w| *w != omega[0]),
        "{path}: omega is constant, {} rad/s: the gyro is off, or its resolution is coarser than its noise",
        omega[0]
    );
    Ok(Rest::analyse(step, omega, chunk.unwrap_or(CHUNK.min(seconds / CHUNKS)), LAG))
}

fn tables(rest: &Rest) -> [(&'static str, Table); 4] {
    let tau: Vec<f64> = rest.allan.iter().map(|point| point.tau).collect();
    let estimated = rest.noise.as_ref().map(|fit| {
        let deviation = tau.iter().map(|tau| fit.noise.variance(*tau).sqrt());
        ("estimated", deviation.collect())
    });
    let deviation = rest.allan.iter().map(|point| point.variance.sqrt()).collect();
    let allan = [("tau_s", tau), ("deviation", deviation)].into_iter().chain(estimated);
    let (normal, reading) = rest.quantiles.iter().copied().unzip();
    let lags = (0..rest.autocorrelation.len()).map(|k| k as f64 * rest.step).collect();
    let correlation = rest.autocorrelation.clone();
    let of = |value: &dyn Fn(&Chunk) -> f64| rest.chunks.iter().map(value).collect();
    let chunks = [
        ("from_s", of(&|chunk| chunk.from)),
        ("mean", of(&|chunk| chunk.mean)),
        ("variance", of(&|chunk| chunk.variance)),
        ("kolmogorov", of(&|chunk| chunk.kolmogorov)),
        ("kolmogorov_between_levels", of(&|chunk| chunk.between_levels)),
        ("qnr", of(&|chunk| 12.0 * chunk.variance / rest.quantum.powi(2))),
    ];
    [
        ("allan.csv", Table::of(allan)),
        ("quantiles.csv", Table::of([("normal", normal), ("reading", reading)])),
        ("autocorrelation.csv", Table::of([("lag_s", lags), ("autocorrelation", correlation)])),
        ("chunks.csv", Table::of(chunks)),
    ]
}

/// Lists the noise parameters of a recording with their confidence intervals, and a sentence that
/// states if the model fits the Allan deviation. Each row is a pair of a name and a text.
pub fn noise_rows(fit: &Fit) -> Vec<(&'static str, String)> {
    let stated = |Estimate { value, low, high, .. }: &Estimate, unit: &str| match (*low, *high) {
        (low, high) if low.is_nan() || high.is_nan() => {
            format!(
                "{value:.4e} {unit}, its significance could not be tested: no interval is given"
            )
        }
        (0.0, f64::INFINITY) => {
            format!("{value:.4e} {unit}, the recording is too short for an interval")
        }
        (0.0, high) => format!("{value:.4e} {unit}, not significant (95 %: below {high:.3e})"),
        (low, f64::INFINITY) => format!("{value:.4e} {unit} (95 %: above {low:.3e})"),
        (low, high) => format!("{value:.4e} {unit} (95 %: {low:.3e} to {high:.3e})"),
    };
    let mut rows = Vec::new();
    for (term, found) in &fit.terms {
        let (name, unit) = match term {
            Term::White => ("angle random walk N", "rad/s/sqrt(Hz)"),
            Term::Flicker => ("bias instability B", "rad/s"),
            Term::Walk => ("rate random walk K", "rad/s/sqrt(s)"),
            Term::Ramp => ("rate ramp R", "rad/s2"),
            Term::Markov => ("Gauss-Markov bias B", "rad/s"),
        };
        rows.push((name, stated(found, unit)));
    }
    if let Some(time) = &fit.bias_time {
        rows.push(("Gauss-Markov bias time", stated(time, "s")));
    }
    let (chi_squared, degrees) = fit.chi_squared;
    let chi_squared = format!("chi-squared {chi_squared:.1}, {degrees} degrees of freedom");
    let verdict = match fit.fits {
        true => format!(
            "the terms above describe the Allan deviation from {:.3} s on ({chi_squared})",
            fit.from
        ),
        false => format!(
            "does not fit: at {:.3} s the Allan deviation is {:.0} % {} the sum of the terms ({chi_squared}); a Gauss-Markov bias, a \
             ramp or a filter do not explain it. Possible causes: changes of temperature, vibration, steps of the bias",
            fit.worst.tau,
            100.0 * (fit.worst.ratio - 1.0).abs(),
            if fit.worst.ratio > 1.0 { "above" } else { "below" }
        ),
    };
    rows.push(("fit of the Allan deviation", verdict));
    rows
}

fn rows(rest: &Rest) -> Vec<(String, String)> {
    let hours = rest.count as f64 * rest.step / 3600.0;
    let chunks = rest.chunks.len();
    let mut rows = Vec::new();
    let mut row = |name: &str, value: String| rows.push((name.to_string(), value));
    row("length", format!("{} samples in {hours:.2} h", rest.count));
    row("mean (bias)", format!("{:.4e} rad/s", rest.mean));
    row("trend", format!("{:.4e} rad/s per hour", rest.trend * 3600.0));
    row("standard deviation without trend", format!("{:.4e} rad/s", rest.deviation));
    row("smallest change of a reading", format!("{:.4e} rad/s", rest.quantum));
    row(
        "noise over quantisation (QNR)",
        format!("{:.1} (variance over Δ²/12, Δ the smallest change)", rest.quantisation_ratio()),
    );
    if let Some(fit) = &rest.noise {
        noise_rows(fit).into_iter().for_each(|(name, value)| row(name, value));
    }
    row(
        "skewness, excess kurtosis",
        format!("{:.3}, {:.3} (normal: 0, 0)", rest.skewness, rest.kurtosis),
    );
    let [read, between] = rest.not_normal();
    row(
        "Kolmogorov and Smirnov's test",
        format!(
            "{read} of {chunks} chunks are not normal, {between} if quantisation is taken into account (expected by chance: \
             {:.1})",
            0.05 * chunks as f64
        ),
    );
    row(
        "autocorrelation outside ±1.96/√n",
        format!("{:.1} % of the lags up to {LAG} s (white: 5 %)", 100.0 * rest.outside()),
    );
    let [means, variances] = rest.scatter(rest.chunk_length());
    row(
        "scatter of the chunks",
        format!(
            "{means:.2} of the means, {variances:.2} of the variances, {chunks} chunks of {:.0} s (white, steady: 1, 1)",
            rest.chunk_length() as f64 * rest.step
        ),
    );
    rows
}

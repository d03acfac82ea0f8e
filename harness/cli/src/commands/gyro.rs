use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use analysis::allan::{Estimate, Fit, Term};
use analysis::rest::{Chunk, Rest};
use anyhow::{Result, ensure};
use experiments::gyro::Recording;
use files::output;
use signals::recording::{self, Between, Columns, Signal, Wanted};
use signals::table::Table;

use super::{DEFAULT_FMU, open, setting};
use crate::{progress, terminal};

const DEFAULT_GYRO: &str = "dist/gyro";

/// Simulates the gyro at rest for hours and compares its Allan deviation with the specified noise; or analyses a
/// recording of a real gyro at rest.
///
/// The command writes allan.csv and allan.svg. With --recording it estimates the noise of a real gyro, and tests whether
/// this noise is normal, white and stationary by quantiles, autocorrelation and statistics of parts of the recording.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh gyro\n  \
    hubslosh gyro --set imu.arw=1e-4 --set imu.bias_time=300 --hours 12 --out dist/other_gyro\n  \
    hubslosh gyro --recording rest.csv --columns time=t:ms,omega=gyro_z:deg/s --out dist/our_gyro")]
pub struct GyroArgs {
    /// Recording of a gyro at rest: text in columns, Parquet or another kind of recording.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["hours", "records", "settings", "fmu"])]
    recording: Option<PathBuf>,
    /// Columns of the recording that contain the signals time and omega, with units, such as
    /// time=t:ms,omega=gyro_z:deg/s.
    #[arg(
        long,
        value_name = "SIGNAL=COLUMN[:UNIT],…",
        default_value_t,
        hide_default_value = true,
        requires = "recording"
    )]
    columns: Columns,
    /// Sampling rate of a recording without times, Hz.
    #[arg(long, value_name = "HZ", requires = "recording")]
    rate: Option<f64>,
    /// Length of the parts into which the recording is divided, to test whether the noise changes with time, s.
    /// Rubaga's thesis uses 15 min.
    #[arg(long, value_name = "SECONDS", default_value_t = 900.0, requires = "recording")]
    chunk: f64,
    /// File for a report on the recording, .html.
    #[arg(long, value_name = "FILE", requires = "recording")]
    report: Option<PathBuf>,
    /// Length of each simulated record, h.
    #[arg(long, value_name = "HOURS", default_value_t = 6.0)]
    hours: f64,
    /// Number of simulated records, which differ in the seed of their noise (imu.seed is 1, 2, …).
    #[arg(long, value_name = "NUMBER", default_value_t = 8)]
    records: usize,
    /// Sets a parameter by its name in the FMU, such as imu.arw=1e-4.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// FMU: a file, or the name of an FMU of this project (`hubslosh fmus` lists them).
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    pub fmu: PathBuf,
    /// Prints the noise that was estimated from the simulated gyro as JSON.
    #[arg(long, conflicts_with = "recording")]
    json: bool,
    /// Directory for the tables and pictures.
    #[arg(long, value_name = "DIRECTORY", default_value = DEFAULT_GYRO)]
    out: PathBuf,
}

impl GyroArgs {
    pub fn needs_fmu(&self) -> bool {
        self.recording.is_none()
    }

    pub fn run(self) -> Result<()> {
        if let Some(path) = &self.recording {
            return self.analyse_recording(path);
        }
        let recording =
            Recording { settings: self.settings, hours: self.hours, records: self.records };
        let bar = progress::steps_bar()?;
        let found =
            recording.characterise(&open(&self.fmu)?, &|news| progress::show(&bar, news))?;
        bar.finish_and_clear();
        output::directory(&self.out)?;
        let [table, picture] = ["allan.csv", "allan.svg"].map(|name| self.out.join(name));
        found.table().write(&table, &BTreeMap::new())?;
        output::write(&picture, report::gyro::allan_deviations(&found).as_bytes())?;
        match self.json {
            true => terminal::print_json(&found.json())?,
            false => print!("{}", found.text()),
        }
        done!("{}\n{}", table.display(), picture.display());
        Ok(())
    }
}

const LAG: f64 = 10.0;
const LEAST_CHUNKS: f64 = 3.0;

impl GyroArgs {
    fn analyse_recording(&self, path: &Path) -> Result<()> {
        let signals =
            [Signal { name: "omega", required: true, between: Between::Line, unit: None }];
        let columns = self.columns.clone().with_rate(self.rate)?;
        let wanted = Wanted { signals: &signals, columns: &columns };
        let mut say = |line: String| terminal::note(line);
        let table = recording::read(path, &wanted, &mut say)?;
        let (step, table) = recording::even(table, &mut say)?;
        let omega = table.column("omega").unwrap_or_default();
        let seconds = step * omega.len() as f64;
        ensure!(
            self.chunk > 0.0 && seconds > LEAST_CHUNKS * self.chunk && self.chunk > 10.0 * step,
            "{}: the recording lasts {seconds:.0} s, in chunks of {} s (allowed: at least {LEAST_CHUNKS} chunks of at least 10 rows; \
             --chunk SECONDS sets their length)",
            path.display(),
            self.chunk
        );
        ensure!(
            omega.iter().any(|w| *w != omega[0]),
            "{}: omega is constant, {} rad/s: the gyro is off, or its resolution is coarser than its noise",
            path.display(),
            omega[0]
        );
        let rest = Rest::analyse(step, omega, self.chunk, LAG);
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

//! `hubslosh identify`.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail, ensure};
use host::fmu::Fmu;
use identify::fit::bench::options::Options;
use identify::input::reading::{self, Source};
use identify::input::recording::Recording;
use identify::input::tolerance::Tolerances;
use identify::methods::acceleration::{self, Acceleration, Weights};
use identify::methods::free_decay::FreeDecay;
use identify::methods::frequency::Frequency;
use identify::methods::output_error::OutputError;
use identify::methods::{Method, Task};
use identify::model::bench::nominal::{self, Nominal};
use identify::model::bench::simulate::Intersample;
use identify::model::bench::unknown::Unknown;
use identify::words::identified::Identified;
use names::hubslosh::fluid;
use signals::recording::Columns;

use super::any_fmu::{AnyFmuArgs, PointsArgs, Told};
use super::estimates::{Out, print_estimates};
use super::force_record::ForceRecordArgs;
use super::{DEFAULT_FMU, open, setting};
use crate::terminal;

/// Finds the FMU's parameters from recordings of a bench, and how sure they are.
///
/// Recordings have the columns time (s), tau_cmd (N·m) and omega (rad/s), and optionally theta (rad) of an
/// encoder, g_axial (m/s²), wheel_speed, omega_x and omega_y (rad/s); --columns takes other names and units.
/// Several are fitted together. A free decay has no torque.
///
/// With --free it fits any FMU: what is free, which inputs the recordings drive and which outputs they have is named. With --tank it
/// fits the mechanical model of a tank to records of force, moment and motion.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh identify sweep.parquet --out result.json\n  \
    hubslosh identify up.csv down.csv --validate noise.csv --model linear,planar,spherical \\\n      \
    --set tank.d=0.163 --out result.json\n  \
    hubslosh identify empty.csv --method acceleration --weights run --out friction.json\n  \
    hubslosh identify multisine.csv --method frequency --out poles.json\n  \
    hubslosh identify bench.csv --columns time=t,tau_cmd=T_cmd:mNm,omega=gyro_z:deg/s --out result.json\n  \
    hubslosh identify decay.csv --method free-decay --columns wave_height=probe:mm --out decay.json\n  \
    hubslosh identify a.csv b.csv --fmu VanDerPol.fmu --free mu=1:0.1:5,x0@each=1:-3:3 --outputs x0,x1 \\\n      \
    --exchange --out result.json --report result.html")]
pub struct IdentifyArgs {
    /// Recordings: text in columns or Parquet; .mat, HDF5, TDMS, MDF4, .xlsx by the Python package.
    #[arg(value_name = "DATA", required = true)]
    data: Vec<PathBuf>,
    /// Identification method. `output-error` fits all of the FMU's parameters in the time domain. `acceleration` fits friction
    /// and inertia without a simulation, for a bench whose liquid does not move. `frequency` fits three poles and two zeros.
    /// `free-decay` finds frequency and damping over the amplitude, from records without torque.
    #[arg(conflicts_with = "fit", long, value_name = "NAME", default_value = "output-error")]
    method: MethodName,
    /// Weights of the rows, of --method acceleration.
    #[arg(conflicts_with = "fit", long, value_name = "NAME", default_value = "uniform")]
    weights: Weighting,
    /// Bounds of an unknown, of --method acceleration.
    #[arg(conflicts_with = "fit", long = "bound", value_name = "NAME=LOW:HIGH", value_parser = bound)]
    bounds: Vec<(String, f64, f64)>,
    /// Harmonics of the angle in the friction, 0 to 2, of --method acceleration.
    #[arg(conflicts_with = "fit", long, value_name = "NUMBER", default_value_t = 0)]
    harmonics: usize,
    /// Slosh models to try.
    #[arg(
        conflicts_with = "fit",
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        default_value = "frozen,linear,planar,spherical",
        value_parser = ["frozen", "linear", "planar", "spherical"]
    )]
    model: Vec<String>,
    /// Friction laws to try, the first with all slosh models, the others with the one that is chosen.
    #[arg(
        conflicts_with = "fit",
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        default_value = "stribeck",
        value_parser = ["none", "viscous", "stribeck_smooth", "stribeck", "lugre"]
    )]
    friction: Vec<String>,
    /// Prior of a parameter: value and standard deviation.
    #[arg(conflicts_with = "fit", long, value_name = "NAME=VALUE:STD", value_parser = known)]
    known: Vec<(String, f64, f64)>,
    /// Sets what is known of the bench by its FMU name; it is then not estimated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Starts from this value instead of one found in the data, of --method output-error and acceleration (there besides those
    /// found in the data).
    #[arg(conflicts_with = "fit", long = "start", value_name = "NAME=VALUE", value_parser = start_value)]
    starts: Vec<(String, f64)>,
    /// Repeats the fit from so many starts of each parameter, one at a time from a tenth to ten times its estimate, and reports how many
    /// end at the same minimum, of --method output-error (the tank's parameters) and acceleration.
    #[arg(conflicts_with = "fit", long, value_name = "NUMBER", default_value_t = 0)]
    start_study: usize,
    /// Takes the measurement as perfect: no delay, gyro bias or friction asymmetry is estimated.
    #[arg(conflicts_with = "fit", long)]
    perfect: bool,
    /// Also estimates the time constant with which the actuator lags its command.
    #[arg(conflicts_with = "fit", long)]
    actuator_lag: bool,
    /// Also estimates the time constant of a low-pass filter in the gyro.
    #[arg(conflicts_with = "fit", long)]
    gyro_lag: bool,
    /// Also estimates the relative change of the friction over a recording.
    #[arg(conflicts_with = "fit", long)]
    friction_drift: bool,
    /// Also estimates the damping by waves that break, slosh.zeta_breaking and slosh.breaking_steepness, of --method output-error.
    /// If the fit does not reach such waves, the verdict says so.
    #[arg(conflicts_with = "fit", long)]
    breaking: bool,
    /// Standard deviation of the gyro's scale about 1; 0: exactly 1.
    #[arg(conflicts_with = "fit", long, value_name = "NUMBER", default_value_t = 0.01)]
    gyro_scale: f64,
    /// Intersample behaviour of the torque: linear (first-order hold), held (zero-order hold, a sampled controller's) or
    /// smooth (band-limited, a sampled recording of a smooth torque). Else what fits best is taken.
    #[arg(conflicts_with = "fit", long, value_name = "HOW", value_parser = ["linear", "held", "smooth"])]
    torque: Option<String>,
    /// The rate's time stamps may be early: takes a delay below zero as it comes. Else it is a sign that something is wrong.
    #[arg(conflicts_with = "fit", long)]
    acausal: bool,
    /// Columns of the recordings for the signals, with units: time, tau_cmd, omega, theta, g_axial, wheel_speed, omega_x,
    /// omega_y; of a free decay wave_height, force, theta or omega. With --free the signals are inputs and outputs of the FMU.
    #[arg(
        long,
        value_name = "SIGNAL=COLUMN[:UNIT],…",
        default_value = "",
        hide_default_value = true
    )]
    columns: String,
    /// Sampling rate of a file without a time column, rows per second.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Fits an empty tank: no slosh model, all inertia belongs to the hub.
    #[arg(conflicts_with = "fit", long)]
    empty: bool,
    /// Uses the rows between two times alone.
    #[arg(
        conflicts_with = "fit",
        long,
        value_name = "S,S",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    trim: Vec<f64>,
    /// A recording that is simulated with the result, not fitted.
    #[arg(conflicts_with = "fit", long, value_name = "DATA")]
    validate: Vec<PathBuf>,
    /// Also prints each attempt of the search: its start, window and free unknowns, and why it was made, accepted or
    /// refused.
    #[arg(long)]
    verbose: bool,
    /// The FMU: a file, or the name of one of this project.
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
    /// Print the result as JSON too, in place of tables and verdict.
    #[arg(long)]
    json: bool,
    /// File for the result, .json.
    #[arg(long, value_name = "FILE", required_unless_present = "messages")]
    out: Option<PathBuf>,
    /// File for a report, .html.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    any: AnyFmuArgs,
    #[command(flatten)]
    points: PointsArgs,
    #[command(flatten)]
    force_record: ForceRecordArgs,
}

/// The methods, one file each in `harness/identify/src/methods`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum MethodName {
    OutputError,
    Acceleration,
    Frequency,
    FreeDecay,
    /// Removed; the error names what replaces it.
    #[value(hide = true)]
    Multisine,
    /// Removed; the error names what replaces it.
    #[value(hide = true)]
    BlackBox,
}

/// Weights of the rows.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Weighting {
    Uniform,
    Time,
    Run,
    RunTime,
}

impl From<Weighting> for Weights {
    fn from(weighting: Weighting) -> Self {
        match weighting {
            Weighting::Uniform => Weights::Uniform,
            Weighting::Time => Weights::Time,
            Weighting::Run => Weights::Run,
            Weighting::RunTime => Weights::RunTime,
        }
    }
}

fn bound(text: &str) -> Result<(String, f64, f64)> {
    let (name, value) = setting(text)?;
    let ends = value.split_once(':').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    let Some((low, high)) = ends else {
        bail!("{name} must be LOW:HIGH, two numbers, not {value}")
    };
    Ok((name, low, high))
}

fn start_value(text: &str) -> Result<(String, f64)> {
    let (name, value) = setting(text)?;
    let value: f64 = value.parse()?;
    ensure!(value.is_finite(), "{name} must be a finite number, not {value}");
    Ok((name, value))
}

fn known(text: &str) -> Result<(String, f64, f64)> {
    let (name, value) = setting(text)?;
    let parts = value.split_once(':').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    let Some((mean, deviation)) = parts else {
        bail!("{name} must be VALUE:STD, two numbers, not {value}")
    };
    ensure!(
        f64::is_finite(mean) && mean > 0.0 && f64::is_finite(deviation) && deviation > 0.0,
        "{name}: value and standard deviation must be positive numbers"
    );
    Ok((name, mean, deviation))
}

impl IdentifyArgs {
    /// Returns the FMU that the method simulates, if it simulates one.
    pub fn fmu(&self) -> Option<&Path> {
        self.needs_fmu().then(|| self.force_record.fmu(&self.fmu))
    }

    fn needs_fmu(&self) -> bool {
        match self.method {
            MethodName::OutputError => OutputError::NEEDS.fmu,
            MethodName::Acceleration => Acceleration::NEEDS.fmu,
            MethodName::Frequency => Frequency::NEEDS.fmu,
            MethodName::FreeDecay | MethodName::Multisine | MethodName::BlackBox => false,
        }
    }

    /// Runs the command.
    pub fn run(mut self) -> Result<()> {
        if !self.any.is_asked() && !self.force_record.is_asked() {
            self.tolerances()?;
            self.settings = nominal::with_damping(self.settings);
        }
        if self.empty {
            // the least that the FMU takes: 2e-9 kg in the bench's tank
            self.settings.push((fluid::RHO.into(), "1e-6".into()));
            self.model = vec!["frozen".into()];
        }
        for (path, ending) in [(&self.out, "json"), (&self.report, "html")] {
            let Some(path) = path else { continue };
            let is_named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
            ensure!(is_named, "{}: the name must end in .{ending}", path.display());
        }
        ensure!(
            (0.0..1.0).contains(&self.gyro_scale),
            "--gyro-scale must be from 0 to 1, not {}",
            self.gyro_scale
        );
        // before a search that may take minutes
        for path in [&self.out, &self.report].into_iter().flatten() {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            let there = folder.is_none_or(Path::is_dir);
            ensure!(there, "{} cannot be written: there is no such directory", path.display());
        }
        ensure!(
            self.bounds.is_empty() || self.method == MethodName::Acceleration,
            "--bound is for --method acceleration alone"
        );
        let searches = matches!(self.method, MethodName::OutputError | MethodName::Acceleration);
        ensure!(
            self.starts.is_empty() || searches,
            "--start is for --method output-error and acceleration alone: the other methods need none"
        );
        ensure!(
            self.start_study == 0 || searches,
            "--start-study is for --method output-error and acceleration alone: the other methods need no start"
        );
        for (name, value) in &self.starts {
            ensure!(
                *value > 0.0 || self.method == MethodName::Acceleration,
                "--start {name}={value}: must be a positive number"
            );
        }
        let trim = match self.trim[..] {
            [] => None,
            [from, to] if from < to => Some((from, to)),
            _ => bail!("--trim needs two times, the first less than the second, s"),
        };
        if self.any.is_asked() || self.force_record.is_asked() {
            let told = Told {
                data: &self.data,
                settings: &self.settings,
                columns: &self.columns,
                rate: self.rate,
                fmu: self.force_record.fmu(&self.fmu),
                json: self.json,
            };
            return match self.force_record.is_asked() {
                true => self.force_record.identify(&self.any, &told, &self.outputs()),
                false => self.any.identify(&told, &self.points, &self.outputs()),
            };
        }
        match self.method {
            MethodName::OutputError => self.answer(OutputError { options: self.options()? }, trim),
            MethodName::Acceleration => {
                let options = acceleration::Options {
                    weights: self.weights.into(),
                    bounds: self.bounds.clone(),
                    starts: self.starts.clone(),
                    harmonics: self.harmonics,
                    settings: self.settings.clone(),
                    held: self.intersample() == Some(Intersample::ZeroOrderHold),
                    torque_scale: self.tolerances()?.torque,
                    gyro_scale: self.gyro_scale,
                    start_study: self.start_study,
                };
                self.answer(Acceleration { options }, trim)
            }
            MethodName::Frequency => {
                let intersample = self.intersample().unwrap_or(Intersample::FirstOrderHold);
                let frequency = Frequency {
                    settings: self.settings.clone(),
                    intersample,
                    tolerances: self.tolerances()?,
                    gyro_scale: self.gyro_scale,
                };
                self.answer(frequency, trim)
            }
            MethodName::FreeDecay => self.decay(trim),
            MethodName::Multisine => bail!(
                "--method multisine was removed: book/other_methods.md, 'Noise or nonlinearity?', has the estimate in Python"
            ),
            MethodName::BlackBox => bail!(
                "--method black-box was removed: book/other_methods.md, 'ARX and ARMAX', has the fits in Python; \
                 --method output-error fits parameters with a physical meaning"
            ),
        }
    }

    /// Tolerances of the bench.
    fn tolerances(&self) -> Result<Tolerances> {
        self.any.tolerances.iter().try_fold(Tolerances::default(), |all, text| all.with(text))
    }

    /// Options with the names of the FMU.
    fn options(&self) -> Result<Options> {
        Ok(Options {
            intersample: self.intersample(),
            acausal: self.acausal,
            models: self.model.clone(),
            friction: self.friction.clone(),
            known: self.known.clone(),
            settings: self.settings.clone(),
            starts: self.starts.clone(),
            sensor_errors: !self.perfect,
            effects: [
                (self.actuator_lag, Unknown::actuator_lag()),
                (self.gyro_lag, Unknown::gyro_lag()),
                (self.friction_drift, Unknown::friction_drift()),
            ]
            .into_iter()
            .filter_map(|(is_asked, unknown)| is_asked.then_some(unknown))
            .collect(),
            breaking: self.breaking,
            gyro_scale: self.gyro_scale,
            start_study: self.start_study,
            tolerances: self.tolerances()?,
            validation: Vec::new(),
        })
    }

    /// Intersample behaviour of the torque, if it is given.
    fn intersample(&self) -> Option<Intersample> {
        self.torque.as_deref().map(|how| match how {
            "held" => Intersample::ZeroOrderHold,
            "smooth" => Intersample::BandLimited,
            _ => Intersample::FirstOrderHold,
        })
    }

    /// Reads and identifies.
    fn answer<M: Method>(&self, method: M, trim: Option<(f64, f64)>) -> Result<()> {
        ensure!(
            self.validate.is_empty() || M::NEEDS.validation,
            "--validate is for --method output-error alone"
        );
        let fmu = if M::NEEDS.fmu { Some(open(&self.fmu)?) } else { None };
        let nominal = fmu.as_ref().map(|fmu| self.options()?.nominal(fmu)).transpose()?;
        let coarsest = nominal.as_ref().map_or(f64::INFINITY, Nominal::coarsest);
        let mut notes = Vec::new();
        if let Some(fmu) = &fmu {
            for warning in nominal::warnings(fmu, &self.settings)? {
                terminal::warn(&warning);
                notes.push(format!("the FMU warns: {warning}"));
            }
        }
        let source = self.source(trim)?;
        let mut read = |paths: &[PathBuf]| -> Result<Vec<Recording>> {
            let mut all = Vec::new();
            for path in paths {
                all.extend(reading::read(path, &source, coarsest, &mut |line| {
                    terminal::note(&line);
                    notes.push(line);
                })?);
            }
            Ok(all)
        };
        let (recordings, validation) = (read(&self.data)?, read(&self.validate)?);
        self.find(method, fmu, &recordings, &validation, notes)
    }

    /// Options for reading the recordings.
    fn source(&self, trim: Option<(f64, f64)>) -> Result<Source> {
        let columns: Columns = self.columns.parse()?;
        Ok(Source { columns: columns.with_rate(self.rate)?, trim })
    }

    /// Reads free decays, which are of one signal, and identifies.
    fn decay(&self, trim: Option<(f64, f64)>) -> Result<()> {
        ensure!(self.validate.is_empty(), "--validate is not for --method free-decay");
        let (source, mut notes) = (self.source(trim)?, Vec::new());
        let (mut signals, mut recordings) = (Vec::new(), Vec::new());
        for path in &self.data {
            let (signal, recording) = reading::read_decay(path, &source, &mut |line| {
                terminal::note(&line);
                notes.push(line);
            })?;
            signals.push(signal);
            recordings.push(recording);
        }
        let signal = signals[0];
        ensure!(
            signals.iter().all(|other| *other == signal),
            "the recordings are of different signals: {}",
            signals.join(", ")
        );
        let clock = self.tolerances()?.clock;
        self.find(FreeDecay { signal, clock }, None, &recordings, &[], notes)
    }

    /// Identifies, writes and prints.
    fn find<M: Method>(
        &self,
        method: M,
        fmu: Option<Fmu>,
        recordings: &[Recording],
        validation: &[Recording],
        notes: Vec<String>,
    ) -> Result<()> {
        let task = Task { fmu: fmu.as_ref(), recordings, validation };
        let out = self.outputs();
        let mut found = out.search(|news| method.identify(&task, news))?;
        found.done.splice(0..0, notes);
        let is_trusted = found.fits != Some(false) && found.converged;
        out.give(&found.json()?, is_trusted, || self.tell::<M>(&found), || M::page(&found))
    }

    /// Files and form of the results.
    fn outputs(&self) -> Out<'_> {
        let (result, report) = (self.out.as_deref(), self.report.as_deref());
        Out { result, report, json: self.json, verbose: self.verbose }
    }

    /// Prints tables and verdict.
    fn tell<M: Method>(&self, found: &Identified<M::Details>) {
        if !(found.parameters.is_empty() && found.measurement.is_empty()) {
            print_estimates(&[&found.parameters, &found.measurement]);
        }
        for line in M::lines(found).iter().chain(&found.verdict) {
            println!("{line}");
        }
    }
}

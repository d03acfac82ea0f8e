//! `hubslosh identify`: estimates parameters from recordings, with their uncertainties.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use host::fmu::Fmu;
use identify::bench::identification::Identification;
use identify::bench::nominal::{self, Nominal};
use identify::bench::options::Options;
use identify::bench::system::Target;
use identify::engine::Hold;
use identify::input::reading::{self, Source};
use identify::input::recording::Recording;
use identify::input::tolerance::{self, Tolerances};
use identify::methods::{free_decay, friction, output_error};
use identify::news::News;
use signals::recording::Columns;

use super::any_fmu::{AnyFmuArgs, PointsArgs, Request};
use super::estimates::Out;
use super::{DEFAULT_FMU, open, setting};
use crate::terminal;

/// Estimates parameters of an FMU from recordings, with their uncertainties.
///
/// If the kind of recording is omitted, `identify DATA` means `identify bench DATA`, or `identify fmu DATA` if --free
/// is given.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh identify sweep.parquet --out result.json\n  \
    hubslosh identify up.csv down.csv --validate noise.csv --model linear,planar,spherical \
    --set tank.d=0.163 --out result.json\n  \
    hubslosh identify bench.mat --columns time=t,tau_cmd=T_cmd:mNm,omega=gyro_z:deg/s --out result.json\n  \
    hubslosh identify friction ramp.csv step.csv sweep.csv --out friction.json\n  \
    hubslosh identify decay decay.csv --columns wave_height=probe:mm --out decay.json\n  \
    hubslosh identify a.csv b.csv --fmu VanDerPol.fmu --free mu=1:0.1:5,x0@each=1:-3:3 --outputs x0,x1 \
    --solver host --out result.json --report result.html")]
pub struct IdentifyArgs {
    #[command(subcommand)]
    kind: Kind,
}

const BENCH: &str = "Example:\n  hubslosh identify bench up.csv down.csv --validate noise.csv --set tank.d=0.163 --out result.json";
const FMU: &str = "Example:\n  hubslosh identify fmu a.csv b.csv --fmu VanDerPol.fmu --free mu=1:0.1:5,x0@each=1:-3:3 \
    --outputs x0,x1 --solver host --out result.json";
const DECAY: &str =
    "Example:\n  hubslosh identify decay decay.csv --columns wave_height=probe:mm --out decay.json";
const FRICTION: &str =
    "Example:\n  hubslosh identify friction ramp.csv step.csv sweep.csv --out friction.json";

#[derive(clap::Subcommand)]
enum Kind {
    /// Fits tank, hub, bearing and sensors of the slosh bench to torque and rate.
    ///
    /// Recordings have the columns time (s), tau_cmd (N·m) and omega (rad/s), and optionally theta (rad) of an encoder,
    /// g_axial (m/s²), wheel_speed, omega_x and omega_y (rad/s); --columns names other columns and units. Several
    /// recordings are fitted together.
    #[command(after_help = BENCH)]
    Bench(Box<BenchArgs>),
    /// Fits parameters and start values of any FMU to its recorded inputs and outputs.
    ///
    /// The option --free names the parameters and start values to fit.
    #[command(after_help = FMU)]
    Fmu(Box<FmuArgs>),
    /// Estimates frequency and damping ratio, and their change with the amplitude, from a free decay (a recording
    /// without torque).
    #[command(after_help = DECAY)]
    Decay(Box<DecayArgs>),
    /// Fits friction and inertia of the bench to recordings in which no liquid moves, such as ramps, steps and sweeps
    /// with an empty tank.
    ///
    /// The command assumes that the tank is empty, unless --set tank.h=… gives the height of the liquid.
    #[command(after_help = FRICTION)]
    Friction(Box<FrictionArgs>),
}

#[derive(clap::Args)]
struct DataArgs {
    /// Recordings: text in columns or Parquet; also .mat, HDF5, TDMS, MDF4 and .xlsx if the Python package is installed.
    #[arg(value_name = "DATA", required = true)]
    data: Vec<PathBuf>,
    /// Columns of the recordings that contain the signals, with units. For example, time=t:ms,omega=gyro_z:deg/s
    /// reads the time from the column t in ms, and the rate from the column gyro_z in deg/s. A signal that is not
    /// named here is read from the column that has the name of the signal. rate=HZ is the sampling rate of a
    /// recording without times.
    ///
    /// The signals are:
    ///
    /// - bench and friction: time, tau_cmd, omega, theta, g_axial, wheel_speed, omega_x and omega_y
    ///
    /// - decay: time, wave_height, force, theta and omega
    ///
    /// - fmu: time, and the inputs and outputs of the FMU
    #[arg(
        long,
        value_name = "SIGNAL=COLUMN[:UNIT],…",
        default_value = "",
        hide_default_value = true
    )]
    columns: String,
    /// File for the result, .json.
    #[arg(long, value_name = "FILE", required_unless_present = "messages")]
    out: Option<PathBuf>,
    /// File for a report, .html.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

#[derive(clap::Args)]
struct KnownArgs {
    /// Sets a known parameter of the bench by its name in the FMU. A parameter that is set is not estimated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Uncertainty (relative standard deviation) of values that are taken as known. It widens the 95 % intervals of the
    /// estimates; 0 means exact.
    ///
    /// The values are:
    ///
    /// - torque: ratio of the acting torque to the recorded torque [default: 1%]
    ///
    /// - clock: rate of the recorder's clock [default: 0.01%]
    ///
    /// - g_axial: acceleration along the axis [default: 0.1%]
    ///
    /// - tank.r: distance of the tank from the axis [default: 0.4%]
    ///
    /// - fluid.rho: density of the liquid [default: 0.3%]
    ///
    /// - gyro_scale: scale factor of the gyro [default: 1%]
    #[arg(long = "tolerance", value_name = "NAME=SIZE,…")]
    tolerances: Vec<String>,
    /// Initial guess from which the search for a parameter starts; without it the guess is computed from the data. STD,
    /// if given, is the standard deviation of prior knowledge about the value.
    #[arg(long = "start", value_name = "NAME=VALUE[:STD]", value_parser = parse_start)]
    starts: Vec<(String, f64, Option<f64>)>,
    /// Intersample behaviour of the torque [default: the behaviour that fits best].
    #[arg(long, value_name = "HOW", value_parser = terminal::values_with_help([
        ("linear", "Straight lines between the samples (first-order hold)"),
        ("held", "Each sample is held until the next (zero-order hold), as by a sampled controller"),
        ("smooth", "Band-limited, as in a sampled recording of a smooth torque"),
    ]))]
    torque: Option<String>,
    /// Uses only the rows between these two times, s.
    #[arg(long, value_name = "S,S", value_delimiter = ',', allow_hyphen_values = true)]
    trim: Vec<f64>,
    /// Recording for validation: the fitted model simulates it, but it is not used for the fit.
    #[arg(long, value_name = "DATA")]
    validate: Vec<PathBuf>,
    /// FMU: a file, or the name of an FMU of this project (`hubslosh fmus` lists them).
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
}

#[derive(clap::Args)]
pub struct BenchArgs {
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    known: KnownArgs,
    /// Slosh models to try. The command chooses the model that fits best.
    #[arg(
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        default_value = "frozen,linear,planar,spherical",
        value_parser = terminal::values_with_help([
            ("frozen", "The whole liquid is rigid"),
            ("linear", "Linear planar pendulums"),
            ("planar", "Nonlinear planar pendulums"),
            ("spherical", "Spherical pendulums, which can rotate (rotary slosh)"),
        ])
    )]
    model: Vec<String>,
    /// Friction laws to try. The first law is combined with every slosh model; the other laws are then tried with the
    /// slosh model that fits best.
    #[arg(
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        default_value = "stribeck",
        value_parser = terminal::values_with_help([
            ("none", "Bearing without friction"),
            ("viscous", "Friction proportional to the rate"),
            ("stribeck_smooth", "Stribeck curve with a smoothed sign: the hub creeps and never sticks"),
            ("stribeck", "Stribeck curve as a set-valued law: the hub can stick"),
            ("lugre", "LuGre model: bristles that deflect before they slide"),
        ])
    )]
    friction: Vec<String>,
    /// Effects to estimate in addition to delay, gyro bias and friction asymmetry, which are estimated by default.
    #[arg(
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        value_parser = terminal::values_with_help([
            ("actuator_lag", "Time constant of the actuator"),
            ("gyro_lag", "Time constant of a filter in the gyro"),
            ("friction_drift", "Relative change of the friction over a recording"),
            ("breaking", "Damping by breaking waves (slosh.zeta_breaking and slosh.breaking_steepness)"),
            ("early_rate", "The delay of the rate may be negative, because its time stamps may be too early"),
            ("none", "Delay, gyro bias and friction asymmetry are not estimated"),
        ])
    )]
    also: Vec<String>,
}

#[derive(clap::Args)]
pub struct FrictionArgs {
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    known: KnownArgs,
}

#[derive(clap::Args)]
pub struct DecayArgs {
    #[command(flatten)]
    data: DataArgs,
    /// Relative standard deviation of the rate of the recorder's clock. It widens the 95 % interval of the frequency.
    #[arg(long = "tolerance", value_name = "clock=SIZE")]
    tolerances: Vec<String>,
    /// Uses only the rows between these two times, s.
    #[arg(long, value_name = "S,S", value_delimiter = ',', allow_hyphen_values = true)]
    trim: Vec<f64>,
}

#[derive(clap::Args)]
pub struct FmuArgs {
    #[command(flatten)]
    data: DataArgs,
    /// Sets a known value of the FMU for all recordings, or with NAME@RECORDING=VALUE for one recording only.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// FMU: a file, or the name of an FMU of this project (`hubslosh fmus` lists them).
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
    #[command(flatten)]
    any: AnyFmuArgs,
    #[command(flatten)]
    points: PointsArgs,
}

/// Removed options, and removed values of `--method`, of older versions, each with its replacement.
const REMOVED: &str = include_str!("removed.txt");

/// Adds the kind of recording to a command line `identify DATA`, which names no kind: `fmu` if
/// `--free` is given, otherwise `bench`. Other command lines are returned unchanged.
///
/// # Errors
///
/// If the command line has a removed option; the message names its replacement.
pub fn with_kind(mut arguments: Vec<OsString>) -> Result<Vec<OsString>> {
    const KINDS: [&str; 7] = ["bench", "fmu", "decay", "friction", "help", "--help", "-h"];
    const FLAGS: [&str; 4] = ["--messages", "--quiet", "-q", "--strict"];
    let Some(place) = arguments.iter().position(|argument| argument == "identify") else {
        return Ok(arguments);
    };
    // Only options of the program may come before the command; otherwise the word `identify` is no command.
    let is_value = |k: usize| arguments[k - 1].to_string_lossy().starts_with("--");
    let before = (1..place).all(|k| arguments[k].to_string_lossy().starts_with('-') || is_value(k));
    if !before {
        return Ok(arguments);
    }
    let own: Vec<String> =
        arguments[place + 1..].iter().map(|a| a.to_string_lossy().into_owned()).collect();
    let own: Vec<&str> = own.iter().map(String::as_str).collect();
    for (k, argument) in own.iter().enumerate() {
        let (option, value) = argument.split_once('=').unwrap_or((argument, ""));
        let instead = |removed: &str| {
            let mut all = REMOVED.lines().filter_map(|line| line.split_once(" = "));
            all.find(|(name, _)| *name == removed).map(|(_, instead)| instead)
        };
        if option == "--method" {
            let next = own.get(k + 1).copied().unwrap_or("");
            let name = if value.is_empty() { next } else { value };
            let instead = instead(name).unwrap_or("identify bench, fmu, decay or friction");
            bail!("--method {name} was removed (use instead: {instead})");
        }
        if let Some(instead) = instead(option).filter(|_| option.starts_with("--")) {
            bail!("{option} was removed (use instead: {instead})");
        }
    }
    // Flags of the program may stand between the command and the kind; they are moved behind the kind.
    let Some(k) = own.iter().position(|word| !FLAGS.contains(word)) else { return Ok(arguments) };
    let kind = match KINDS.contains(&own[k]) {
        true => arguments.remove(place + 1 + k),
        false if own.iter().any(|a| *a == "--free" || a.starts_with("--free=")) => "fmu".into(),
        false => "bench".into(),
    };
    arguments.insert(place + 1, kind);
    Ok(arguments)
}

/// A fit of the bench, for example [`output_error::identify`].
type Identify = fn(&Fmu, &[Recording], &Options, &mut dyn FnMut(&News)) -> Result<Identification>;

fn parse_start(text: &str) -> Result<(String, f64, Option<f64>)> {
    let (name, numbers) = setting(text)?;
    let number = |text: &str| text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    let (value, std) = match numbers.split_once(':') {
        Some((value, std)) => (number(value), Some(number(std))),
        None => (number(&numbers), None),
    };
    match (value, std) {
        (Some(value), None) => Ok((name, value, None)),
        (Some(value), Some(Some(std))) => Ok((name, value, Some(std))),
        _ => bail!("{name} must be VALUE or VALUE:STD, positive numbers, not {numbers}"),
    }
}

fn tolerances(texts: &[String]) -> Result<(Tolerances, f64)> {
    let (mut all, mut scale) = (Tolerances::default(), Options::default().gyro_scale);
    for item in texts.iter().flat_map(|text| text.split(',')) {
        match item.trim().strip_prefix("gyro_scale=") {
            Some(value) => {
                let found = tolerance::part("gyro_scale", value)?;
                scale = found.with_context(|| format!("gyro_scale: {value} is not a number"))?;
            }
            None => all = all.with(item)?,
        }
    }
    Ok((all, scale))
}

fn trim(times: &[f64]) -> Result<Option<(f64, f64)>> {
    match times {
        [] => Ok(None),
        [from, to] if from < to => Ok(Some((*from, *to))),
        _ => bail!("--trim needs two times, the first less than the second, s"),
    }
}

impl IdentifyArgs {
    pub fn fmu(&self) -> Option<&Path> {
        match &self.kind {
            Kind::Bench(args) => Some(&args.known.fmu),
            Kind::Friction(args) => Some(&args.known.fmu),
            Kind::Fmu(args) => Some(&args.fmu),
            Kind::Decay(_) => None,
        }
    }

    pub fn run(self) -> Result<()> {
        match self.kind {
            Kind::Bench(args) => args.run(),
            Kind::Fmu(args) => args.run(),
            Kind::Decay(args) => args.run(),
            Kind::Friction(args) => args.run(),
        }
    }
}

impl FmuArgs {
    fn run(&self) -> Result<()> {
        self.data.check()?;
        let DataArgs { data, .. } = &self.data;
        let (columns, rate) = self.data.columns()?;
        let (settings, fmu) = (&self.settings, &self.fmu);
        let told = Request { data, settings, columns: &columns, rate, fmu, json: false };
        self.any.identify(&told, &self.points, &self.data.outputs())
    }
}

impl BenchArgs {
    fn has(&self, name: &str) -> bool {
        self.also.iter().any(|other| other == name)
    }

    fn run(&self) -> Result<()> {
        let options = Options {
            acausal: self.has("early_rate"),
            models: self.model.clone(),
            friction: self.friction.clone(),
            sensor_errors: !self.has("none"),
            effects: [
                ("actuator_lag", Target::ActuatorLag),
                ("gyro_lag", Target::GyroLag),
                ("friction_drift", Target::FrictionDrift),
            ]
            .into_iter()
            .filter_map(|(name, effect)| self.has(name).then_some(effect))
            .collect(),
            breaking: self.has("breaking"),
            ..self.known.options()?
        };
        self.known.identify_and_print(output_error::identify, options, &self.data)
    }
}

impl FrictionArgs {
    fn run(&self) -> Result<()> {
        self.known.identify_and_print(friction::identify, self.known.options()?, &self.data)
    }
}

impl DecayArgs {
    fn run(&self) -> Result<()> {
        self.data.check()?;
        let source = self.data.source(trim(&self.trim)?)?;
        let clock = tolerances(&self.tolerances)?.0.clock;
        let (mut signals, mut recordings, mut notes) = (Vec::new(), Vec::new(), Vec::new());
        for path in &self.data.data {
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
            "the recordings have different signals: {} (allowed: one signal in all recordings of a fit)",
            signals.join(", ")
        );
        let found = self
            .data
            .outputs()
            .search(|news| free_decay::identify(signal, clock, &recordings, news))?;
        self.data.outputs().finish(found, notes)
    }
}

impl KnownArgs {
    fn options(&self) -> Result<Options> {
        let (tolerances, gyro_scale) = tolerances(&self.tolerances)?;
        let (known, starts): (Vec<_>, Vec<_>) =
            self.starts.iter().cloned().partition(|(_, _, std)| std.is_some());
        let known = known.into_iter().filter_map(|(name, value, std)| Some((name, value, std?)));
        let starts = starts.into_iter().map(|(name, value, _)| (name, value));
        let intersample = self.torque.as_deref().map(|how| match how {
            "held" => Hold::ZeroOrderHold,
            "smooth" => Hold::BandLimited,
            _ => Hold::FirstOrderHold,
        });
        Ok(Options {
            intersample,
            known: known.collect(),
            settings: nominal::with_damping(self.settings.clone()),
            starts: starts.collect(),
            gyro_scale,
            tolerances,
            ..Options::default()
        })
    }

    fn identify_and_print(
        &self,
        identify: Identify,
        options: Options,
        data: &DataArgs,
    ) -> Result<()> {
        data.check()?;
        let source = data.source(trim(&self.trim)?)?;
        let fmu: Fmu = open(&self.fmu)?;
        let coarsest = options.nominal(&fmu).map(|nominal: Nominal| nominal.coarsest())?;
        let mut notes = Vec::new();
        for warning in nominal::warnings(&fmu, &options.settings)? {
            terminal::warn(&warning);
            notes.push(format!("the FMU warns: {warning}"));
        }
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
        let recordings = read(&data.data)?;
        let options = Options { validation: read(&self.validate)?, ..options };
        let found = data.outputs().search(|news| identify(&fmu, &recordings, &options, news))?;
        data.outputs().finish(found, notes)
    }
}

impl DataArgs {
    /// Splits the value of `--columns` into the names of columns and the sampling rate, which is
    /// given as `rate=HZ`.
    fn columns(&self) -> Result<(String, Option<f64>)> {
        let (mut columns, mut rate) = (Vec::new(), None);
        for item in self.columns.split(',') {
            match item.trim().strip_prefix("rate=") {
                Some(number) => {
                    let number = number.parse();
                    rate = Some(number.with_context(|| {
                        format!("--columns {item}: the rate must be a number, Hz")
                    })?);
                }
                None => columns.push(item),
            }
        }
        Ok((columns.join(","), rate))
    }

    fn check(&self) -> Result<()> {
        for (path, ending) in [(&self.out, "json"), (&self.report, "html")] {
            let Some(path) = path else { continue };
            let is_named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
            ensure!(is_named, "{}: the name must end in .{ending}", path.display());
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            let there = folder.is_none_or(Path::is_dir);
            ensure!(there, "{} cannot be written: there is no such directory", path.display());
        }
        Ok(())
    }

    fn source(&self, trim: Option<(f64, f64)>) -> Result<Source> {
        let (columns, rate) = self.columns()?;
        let columns: Columns = columns.parse()?;
        Ok(Source { columns: columns.with_rate(rate)?, trim })
    }

    fn outputs(&self) -> Out<'_> {
        let (result, report) = (self.out.as_deref(), self.report.as_deref());
        Out { result, report }
    }
}

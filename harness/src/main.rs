//! The command line `hubslosh`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, Parser, Subcommand};
use hubslosh::campaign::Campaign;
use hubslosh::check::command::{CheckArgs, CheckCallsArgs};
use hubslosh::example;
use hubslosh::fmi2::Fmu;
use hubslosh::gyro::Recording;
use hubslosh::pack;
use hubslosh::plan::{self, Plan};
use hubslosh::profile::{self, Torque, Written};
use hubslosh::release;
use hubslosh::report;
use hubslosh::run::Run;
use hubslosh::scaling::{self, Flight, Liquid};
use hubslosh::table;
use indicatif::{ProgressBar, ProgressStyle};

/// Packs the HubSlosh FMU, drives it and reports.
///
/// Without a subcommand: packs dist/HubSlosh.fmu, drives it through the thesis campaign and
/// leaves dist/campaign/report.html and features.csv.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Pack(PackArgs),
    Run(RunArgs),
    Torque(TorqueArgs),
    Campaign(CampaignArgs),
    Check(CheckArgs),
    /// The calls of one rule of `check`, in a process of their own.
    #[command(hide = true)]
    CheckCalls(CheckCallsArgs),
    Scale(ScaleArgs),
    Gyro(GyroArgs),
    /// Writes the example that travels with the FMU (modelDescription/HubSlosh/extra): torque and answer.
    Example {
        /// The FMU that answers.
        #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
        fmu: PathBuf,
    },
    /// Builds and checks the release for all platforms: the FMU, its hash, its bill of materials.
    #[command(after_help = "Example:\n  hubslosh release\n\n\
        On a Debian machine harness/platforms/setup gets what building for all platforms takes.")]
    Release {
        /// Directory for the release's files.
        #[arg(long, value_name = "DIRECTORY", default_value = DEFAULT_RELEASE)]
        out: PathBuf,
    },
}

/// Builds the FMU's binary and packs it.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  hubslosh pack --out dist/HubSlosh.fmu\n  hubslosh pack --all-platforms"
)]
struct PackArgs {
    /// Where to put the FMU.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    out: PathBuf,
    /// For Linux, Windows and macOS instead of this machine's platform; on a Debian machine
    /// harness/platforms/setup gets what that takes.
    #[arg(long)]
    all_platforms: bool,
}

/// Makes one run: a torque history in, signals out.
#[derive(Args)]
#[command(after_help = run_help())]
struct RunArgs {
    /// Torque profile, name:key=value,…
    #[arg(
        long,
        value_name = "PROFILE",
        conflicts_with = "input",
        required_unless_present = "input"
    )]
    profile: Option<String>,
    /// Torque history with the columns time (s) and tau_cmd (N.m), .csv or .parquet.
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    /// Sets a parameter or an input by its FMU name; enumerations by name or number.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Communication step, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.02)]
    step: f64,
    /// Stop time, s [default: the end of the torque history].
    #[arg(long, value_name = "SECONDS")]
    stop: Option<f64>,
    /// Relative tolerance of the FMU's solver [default: the FMU's own].
    #[arg(long, value_name = "NUMBER")]
    tolerance: Option<f64>,
    /// Hold the torque between rows and over each step, instead of joining by lines.
    #[arg(long)]
    hold: bool,
    /// Variables to record beside time and tau_cmd.
    #[arg(
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        default_value = "omega,omega_imu,slosh_angle,slosh_angle_radial"
    )]
    columns: Vec<String>,
    /// The FMU.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
    /// Where to put the signals, .csv or .parquet.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Writes a profile's torque alone: time (s), tau_cmd (N.m), and tau_slope (N.m/s), which is the
/// torque's derivative until the next row.
///
/// Given value and slope at every row the FMU sees what `hubslosh run` shows it, jumps included;
/// time and tau_cmd alone are a torque history for --input, for a bench or Simulink.
#[derive(Args)]
#[command(after_help = torque_help())]
struct TorqueArgs {
    /// Torque profile, name:key=value,…
    #[arg(long, value_name = "PROFILE")]
    profile: String,
    /// Time between rows, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.02)]
    step: f64,
    /// Time of the last row, s [default: the end of the profile].
    #[arg(long, value_name = "SECONDS")]
    stop: Option<f64>,
    /// Where to put the torque, .csv or .parquet.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Drives the FMU through a plan's runs, or the thesis's sweeps at several fills and amplitudes,
/// and reports.
///
/// Runs that are there already (same FMU, parameters and profile) are not done again.
#[derive(Args)]
#[command(after_help = campaign_help())]
struct CampaignArgs {
    /// Plan: a TOML file, or the name of a built-in plan (below).
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with_all = ["model", "fills", "amplitudes", "sweep", "settings", "tolerance"]
    )]
    plan: Option<String>,
    /// Print the runs as JSON for another program to make, and make none.
    #[arg(long)]
    list: bool,
    /// Slosh models, by name.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "linear")]
    model: Vec<String>,
    /// Fills, m.
    #[arg(long, value_name = "M,…", value_delimiter = ',', default_values_t = plan::FILLS)]
    fills: Vec<f64>,
    /// Torque amplitudes, N.m.
    #[arg(long, value_name = "NM,…", value_delimiter = ',', default_values_t = plan::AMPLITUDES)]
    amplitudes: Vec<f64>,
    /// How the frequency grows from 1.25 to 3.5 Hz in 2700 s.
    #[arg(long, value_enum, default_value = "exponential")]
    sweep: Sweep,
    /// Sets a parameter or an input by its FMU name; enumerations by name or number.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Relative tolerance of the FMU's solver [default: the FMU's own].
    #[arg(long, value_name = "NUMBER")]
    tolerance: Option<f64>,
    /// Do runs again that are there already.
    #[arg(long)]
    force: bool,
    /// The FMU.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
    /// Directory for runs, tables and report.html [default: dist/campaign, or dist/ and the plan's
    /// name].
    #[arg(long, value_name = "DIRECTORY")]
    out: Option<PathBuf>,
}

/// How the frequency of `campaign`'s sweep grows.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Sweep {
    /// Exponentially.
    Exponential,
    /// Evenly.
    Linear,
}

/// Says which tank in flight a bench stands for: Bond numbers, Froude's factors.
#[derive(Args)]
#[command(after_help = "Examples:\n  hubslosh scale thesis\n  \
    hubslosh scale bond --flight-radius 2.0425 --flight-density 1141 --flight-tension 0.0132\n  \
    hubslosh scale rotation --alpha 2.21 --flight-alpha 0.005\n  \
    hubslosh scale froude --lambda 25 --density-ratio 1.14")]
struct ScaleArgs {
    #[command(subcommand)]
    what: Scale,
}

#[derive(Subcommand)]
enum Scale {
    /// The figures of the thesis's 7.2, printed and computed.
    Thesis,
    /// Bond number of an acceleration, and the tank in flight that has the same.
    Bond {
        /// Density of the bench's liquid, kg/m3.
        #[arg(long, default_value_t = scaling::WATER.density)]
        density: f64,
        /// Its surface tension, N/m.
        #[arg(long, default_value_t = scaling::WATER.tension)]
        tension: f64,
        /// Acceleration along the tank's axis, m/s2.
        #[arg(long, default_value_t = 9.81)]
        acceleration: f64,
        /// Radius of the bench's tank, m.
        #[arg(long, default_value_t = scaling::BENCH.0)]
        radius: f64,
        /// Density of the liquid in flight, kg/m3 [default: the bench's].
        #[arg(long)]
        flight_density: Option<f64>,
        /// Surface tension of the liquid in flight, N/m [default: the bench's].
        #[arg(long)]
        flight_tension: Option<f64>,
        /// Radius of the tank in flight, m: gives its acceleration.
        #[arg(long, conflicts_with = "flight_acceleration")]
        flight_radius: Option<f64>,
        /// Acceleration in flight, m/s2: gives the tank's radius.
        #[arg(long)]
        flight_acceleration: Option<f64>,
    },
    /// Bond numbers of a rotation, and the tanks that have the same at another one.
    Rotation {
        /// Density of the liquid, kg/m3.
        #[arg(long, default_value_t = scaling::ROUND_WATER.density)]
        density: f64,
        /// Its surface tension, N/m.
        #[arg(long, default_value_t = scaling::ROUND_WATER.tension)]
        tension: f64,
        /// Radius of the bench's tank, m.
        #[arg(long, default_value_t = scaling::BENCH.0)]
        radius: f64,
        /// Distance of the tank from the axis, m.
        #[arg(long, default_value_t = scaling::BENCH.1)]
        arm: f64,
        /// Largest angular acceleration on the bench, rad/s2.
        #[arg(long)]
        alpha: f64,
        /// Largest angular rate on the bench, rad/s.
        #[arg(long)]
        omega: Option<f64>,
        /// Angular acceleration in flight, rad/s2.
        #[arg(long, default_value_t = 0.005)]
        flight_alpha: f64,
    },
    /// What multiplies a model's figures to give the full size's.
    Froude {
        /// Length of the full size over the model's.
        #[arg(long)]
        lambda: f64,
        /// Density of the full size's liquid over the model's.
        #[arg(long, default_value_t = 1.0)]
        density_ratio: f64,
        /// Acceleration of the full size over the model's.
        #[arg(long, default_value_t = 1.0)]
        gravity_ratio: f64,
    },
}

/// Records the gyro for hours at rest and compares the noise that its Allan deviation shows with
/// the noise put in. Leaves allan.csv and allan.svg.
#[derive(Args)]
#[command(after_help = "Examples:\n  hubslosh gyro\n  \
    hubslosh gyro --set imu.arw=1e-4 --set imu.bias_time=300 --hours 12 --out dist/other_gyro")]
struct GyroArgs {
    /// Length of each record, h.
    #[arg(long, value_name = "HOURS", default_value_t = 6.0)]
    hours: f64,
    /// Number of records; their imu.seed counts from 1.
    #[arg(long, value_name = "NUMBER", default_value_t = 8)]
    records: usize,
    /// Sets a parameter by its FMU name.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// The FMU.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
    /// Directory for allan.csv and allan.svg.
    #[arg(long, value_name = "DIRECTORY", default_value = DEFAULT_GYRO)]
    out: PathBuf,
}

const DEFAULT_FMU: &str = "dist/HubSlosh.fmu";
const DEFAULT_RELEASE: &str = "dist/release";
const DEFAULT_CAMPAIGN: &str = "dist/campaign";
const DEFAULT_GYRO: &str = "dist/gyro";

fn run_help() -> String {
    format!(
        "Profiles, with their defaults (torque in N.m, frequencies in Hz, times in s):\n{}\n\
         Examples:\n  hubslosh run --profile exp-sweep:amplitude=0.1 --out sweep.parquet\n  \
         hubslosh run --profile sine:amplitude=0.05,frequency=2.344 --set friction.model=none \\\n      \
         --set tank.h=0.05 --step 0.005 --columns theta,omega,slosh_angle --out dwell.csv\n  \
         hubslosh run --input torque.csv --out answer.csv",
        profile::help()
    )
}

fn torque_help() -> String {
    format!(
        "Profiles, with their defaults (torque in N.m, frequencies in Hz, times in s):\n{}\n\
         Example:\n  hubslosh torque --profile bang-stop-bang:amplitude=0.2,bang=2 --step 0.02 --out torque.csv",
        profile::help()
    )
}

fn campaign_help() -> String {
    let mut plans = String::new();
    for (name, text) in plan::BUILT_IN {
        let title = Plan::parse(text).map(|plan| plan.title).unwrap_or_default();
        plans.push_str(&format!("  {name:18} {title}\n"));
    }
    format!(
        "Built-in plans:\n{plans}\n\
         Examples:\n  hubslosh campaign\n  \
         hubslosh campaign --plan thesis_models\n  \
         hubslosh campaign --plan mine.toml --out dist/mine\n  \
         hubslosh campaign --fills 0.05,0.1 --amplitudes 0.1 --set friction.model=viscous --out dist/viscous"
    )
}

fn setting(text: &str) -> Result<(String, String)> {
    let (name, value) = text
        .split_once('=')
        .with_context(|| format!("\"{text}\" is not of the form name=value"))?;
    Ok((name.trim().into(), value.trim().into()))
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Some(Command::Pack(args)) if args.all_platforms => pack_all(&args.out),
        Some(Command::Pack(args)) => pack(&args.out),
        Some(Command::Run(args)) => run(args),
        Some(Command::Torque(args)) => torque(&args),
        Some(Command::Campaign(args)) => campaign_of(&args),
        Some(Command::Scale(args)) => scale(args.what),
        Some(Command::Gyro(args)) => gyro(args),
        Some(Command::Example { fmu }) => example(&fmu),
        Some(Command::Release { out }) => release(&out),
        Some(Command::Check(args)) => args.run(),
        Some(Command::CheckCalls(args)) => args.run(),
        None => everything(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn scale(what: Scale) -> Result<()> {
    let text = match what {
        Scale::Thesis => scaling::thesis_text(),
        Scale::Bond {
            density,
            tension,
            acceleration,
            radius,
            flight_density,
            flight_tension,
            flight_radius,
            flight_acceleration,
        } => {
            let bench = Liquid { density, tension };
            let liquid = Liquid {
                density: flight_density.unwrap_or(density),
                tension: flight_tension.unwrap_or(tension),
            };
            let flight =
                flight_radius.map(Flight::Radius).or(flight_acceleration.map(Flight::Acceleration));
            scaling::bond_text(bench, (acceleration, radius), liquid, flight)?
        }
        Scale::Rotation { density, tension, radius, arm, alpha, omega, flight_alpha } => {
            let liquid = Liquid { density, tension };
            scaling::rotation_text(liquid, (radius, arm), (alpha, omega), flight_alpha)?
        }
        Scale::Froude { lambda, density_ratio, gravity_ratio } => {
            scaling::froude_text(lambda, density_ratio, gravity_ratio)?
        }
    };
    print!("{text}");
    Ok(())
}

fn gyro(args: GyroArgs) -> Result<()> {
    let recording = Recording { settings: args.settings, hours: args.hours, records: args.records };
    let found = recording.characterise(&Fmu::open(&args.fmu)?)?;
    found.write(&args.out)?;
    print!("{}", found.text());
    println!("{}\n{}", args.out.join("allan.csv").display(), args.out.join("allan.svg").display());
    Ok(())
}

/// What `cargo run --release` does.
fn everything() -> Result<()> {
    pack(Path::new(DEFAULT_FMU))?;
    let campaign =
        Campaign { plan: Plan::read("thesis")?, force: false, out: DEFAULT_CAMPAIGN.into() };
    drive(&Fmu::open(DEFAULT_FMU)?, &campaign)
}

fn pack(out: &Path) -> Result<()> {
    pack::pack(out)?;
    println!("packed {}", out.display());
    Ok(())
}

fn pack_all(out: &Path) -> Result<()> {
    for built in pack::pack_all(out)? {
        println!("{}: {}", built.folder, built.binary);
    }
    println!("packed {} ({} bytes)", out.display(), out.metadata()?.len());
    Ok(())
}

fn example(fmu: &Path) -> Result<()> {
    let folder = example::folder();
    example::write(&Fmu::open(fmu)?, &folder)?;
    println!("wrote {}", folder.display());
    Ok(())
}

fn release(out: &Path) -> Result<()> {
    for path in release::write(out)? {
        println!("{} ({} bytes)", path.display(), path.metadata()?.len());
    }
    Ok(())
}

fn run(args: RunArgs) -> Result<()> {
    table::check_ending(&args.out)?;
    let torque = match (&args.profile, &args.input) {
        (Some(profile), _) => profile.parse::<Written>()?.torque()?,
        (None, Some(path)) => Torque::read(path, args.hold)?,
        (None, None) => bail!("a run needs --profile or --input"),
    };
    let run = Run {
        settings: args.settings,
        stop: args.stop.unwrap_or(torque.span().1),
        torque,
        step: args.step,
        tolerance: args.tolerance,
        hold: args.hold,
    };
    let fmu = Fmu::open(&args.fmu)?;
    let mut instance = run.initialise(&fmu)?;
    let columns: Vec<&str> = args.columns.iter().map(String::as_str).collect();
    let bar = ProgressBar::new(run.steps() as u64).with_style(ProgressStyle::with_template(
        "{bar:40} {percent:>3} %  {elapsed} gone, {eta} to go",
    )?);
    let table = run.drive(&mut instance, &columns, |steps| bar.inc(steps))?;
    bar.finish_and_clear();
    let notes = BTreeMap::from([
        ("fmu".into(), fmu.hash().into()),
        ("guid".into(), fmu.description().guid.clone()),
        ("version".into(), fmu.description().version.clone()),
    ]);
    table.write(&args.out, &notes)?;
    println!("{} rows in {}", table.rows(), args.out.display());
    Ok(())
}

fn torque(args: &TorqueArgs) -> Result<()> {
    table::check_ending(&args.out)?;
    let torque = args.profile.parse::<Written>()?.torque()?;
    let run = Run {
        settings: Vec::new(),
        stop: args.stop.unwrap_or(torque.span().1),
        torque,
        step: args.step,
        tolerance: None,
        hold: false,
    };
    run.check()?;
    let table = run.torque_table();
    table.write(&args.out, &BTreeMap::from([("profile".into(), args.profile.clone())]))?;
    println!("{} rows in {}", table.rows(), args.out.display());
    Ok(())
}

impl CampaignArgs {
    /// The plan that the flags without `--plan` stand for.
    fn flags_as_plan(&self) -> Result<Plan> {
        for (name, _) in &self.settings {
            ensure!(
                !["slosh.model", "tank.h", "tau_cmd"].contains(&name.as_str()),
                "{name} is what the campaign varies; use --model, --fills, --amplitudes"
            );
        }
        let kind = match self.sweep {
            Sweep::Exponential => "exp-sweep",
            Sweep::Linear => "lin-sweep",
        };
        let mut table = toml::Table::new();
        table.insert("title".into(), "Sweeps at several fills and amplitudes".into());
        table.insert("profile".into(), format!("{kind}:f0=1.25,f1=3.5,duration=2700").into());
        if let Some(tolerance) = self.tolerance {
            table.insert("tolerance".into(), tolerance.into());
        }
        let settings =
            self.settings.iter().map(|(name, value)| (name.clone(), value.as_str().into()));
        table.insert("set".into(), settings.collect::<toml::Table>().into());
        let vary = [
            ("slosh.model", toml::Value::from(self.model.clone())),
            ("tank.h", self.fills.clone().into()),
            ("profile.amplitude", self.amplitudes.clone().into()),
        ];
        let vary = vary.into_iter().map(|(name, values)| (name.to_string(), values));
        table.insert("vary".into(), vary.collect::<toml::Table>().into());
        Plan::parse(&toml::to_string(&table)?)
    }
}

fn campaign_of(args: &CampaignArgs) -> Result<()> {
    let (plan, out) = match &args.plan {
        Some(file) => {
            let stem = Path::new(file).file_stem().unwrap_or_default();
            (Plan::read(file)?, Path::new("dist").join(stem))
        }
        None => (args.flags_as_plan()?, DEFAULT_CAMPAIGN.into()),
    };
    let out = args.out.clone().unwrap_or(out);
    let campaign = Campaign { plan, force: args.force, out };
    let fmu = Fmu::open(&args.fmu)?;
    if args.list {
        println!("{:#}", campaign.list(&fmu)?);
        return Ok(());
    }
    drive(&fmu, &campaign)
}

fn drive(fmu: &Fmu, campaign: &Campaign) -> Result<()> {
    let results = campaign.execute(fmu)?;
    campaign.write_tables(fmu, &results)?;
    let page = campaign.out.join("report.html");
    report::write(&page, campaign, fmu, &results)?;
    let reused = results.outcomes.iter().filter(|o| o.reused).count();
    println!(
        "{} runs made, {reused} were there already\nfeatures: {}\nruns:     {}\nreport:   {}",
        results.outcomes.len() - reused,
        campaign.out.join("features.csv").display(),
        campaign.out.join("runs.csv").display(),
        page.display(),
    );
    for failure in &results.failures {
        eprintln!("{} failed: {}", failure.case.name, failure.reason);
    }
    if !results.failures.is_empty() {
        bail!("{} of the campaign's runs failed", results.failures.len());
    }
    Ok(())
}

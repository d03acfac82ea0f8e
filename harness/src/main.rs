//! The command line `hubslosh`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args, Parser, Subcommand};
use hubslosh::campaign::{self, Plan, Sweep};
use hubslosh::fmi2::Fmu;
use hubslosh::pack;
use hubslosh::profile::{self, Profile, Torque};
use hubslosh::report;
use hubslosh::run::Run;
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
    Campaign(CampaignArgs),
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
    profile: Option<Profile>,
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

/// Drives the FMU through the thesis's sweeps at several fills and amplitudes, and reports.
///
/// Runs that are there already (same FMU, parameters and profile) are not done again.
#[derive(Args)]
#[command(after_help = "Examples:\n  hubslosh campaign\n  \
    hubslosh campaign --fills 0.05,0.1 --amplitudes 0.1 --set friction.model=viscous --out dist/viscous")]
struct CampaignArgs {
    /// Slosh models, by name.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "linear")]
    model: Vec<String>,
    /// Fills, m.
    #[arg(long, value_name = "M,…", value_delimiter = ',', default_values_t = campaign::FILLS)]
    fills: Vec<f64>,
    /// Torque amplitudes, N.m.
    #[arg(long, value_name = "NM,…", value_delimiter = ',', default_values_t = campaign::AMPLITUDES)]
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
    /// Directory for runs, features.csv and report.html.
    #[arg(long, value_name = "DIRECTORY", default_value = DEFAULT_CAMPAIGN)]
    out: PathBuf,
}

const DEFAULT_FMU: &str = "dist/HubSlosh.fmu";
const DEFAULT_CAMPAIGN: &str = "dist/campaign";

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
        Some(Command::Campaign(args)) => campaign(&args.fmu, args.plan()),
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

/// What `cargo run --release` does.
fn everything() -> Result<()> {
    pack(Path::new(DEFAULT_FMU))?;
    campaign(Path::new(DEFAULT_FMU), Plan::thesis(Path::new(DEFAULT_CAMPAIGN)))
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

fn run(args: RunArgs) -> Result<()> {
    table::check_ending(&args.out)?;
    let torque = match (args.profile, &args.input) {
        (Some(profile), _) => Torque::Profile(profile),
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

impl CampaignArgs {
    fn plan(&self) -> Plan {
        Plan {
            models: self.model.clone(),
            fills: self.fills.clone(),
            amplitudes: self.amplitudes.clone(),
            sweep: self.sweep,
            settings: self.settings.clone(),
            tolerance: self.tolerance,
            force: self.force,
            out: self.out.clone(),
        }
    }
}

fn campaign(fmu: &Path, plan: Plan) -> Result<()> {
    let fmu = Fmu::open(fmu)?;
    let results = plan.execute(&fmu)?;
    campaign::write_features(&results.outcomes, &plan.out)?;
    let page = plan.out.join("report.html");
    report::write(&page, &plan, &fmu, &results)?;
    let reused = results.outcomes.iter().filter(|o| o.reused).count();
    println!(
        "{} runs made, {reused} were there already\nfeatures: {}\nreport:   {}",
        results.outcomes.len() - reused,
        plan.out.join("features.csv").display(),
        page.display(),
    );
    for failure in &results.failures {
        eprintln!("{} failed: {}", failure.case.name(), failure.reason);
    }
    if !results.failures.is_empty() {
        bail!("{} of the campaign's runs failed", results.failures.len());
    }
    Ok(())
}

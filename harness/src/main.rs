//! The command line `hubslosh`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args, Parser, Subcommand};
use hubslosh::fmi2::Fmu;
use hubslosh::pack;
use hubslosh::profile::{self, Profile, Torque};
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
}

/// Builds the FMU's binary and packs it.
#[derive(Args)]
#[command(after_help = "Example:\n  hubslosh pack --out dist/HubSlosh.fmu")]
struct PackArgs {
    /// Where to put the FMU.
    #[arg(long, value_name = "FILE", default_value = "dist/HubSlosh.fmu")]
    out: PathBuf,
}

/// Makes one run: a torque history in, signals out.
#[derive(Args)]
#[command(after_help = run_help())]
struct RunArgs {
    /// Torque profile, name:key=value,…
    #[arg(long, value_name = "PROFILE", conflicts_with = "input", required_unless_present = "input")]
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
    #[arg(long, value_name = "FILE", default_value = "dist/HubSlosh.fmu")]
    fmu: PathBuf,
    /// Where to put the signals, .csv or .parquet.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

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
    let (name, value) =
        text.split_once('=').with_context(|| format!("\"{text}\" is not of the form name=value"))?;
    Ok((name.trim().into(), value.trim().into()))
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Some(Command::Pack(args)) => pack(&args.out),
        Some(Command::Run(args)) => run(args),
        None => bail_todo(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn bail_todo() -> Result<()> {
    bail!("not yet")
}

fn pack(out: &Path) -> Result<()> {
    pack::pack(out)?;
    println!("packed {}", out.display());
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

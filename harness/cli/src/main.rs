//! The command line `hubslosh`.

mod commands;
mod progress;

use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use bench::campaign::Campaign;
use bench::plan::Plan;
use clap::{Parser, Subcommand};
use commands::*;
use host::fmi2::Fmu;

/// Packs FMUs, checks them, simulates campaigns and reports.
///
/// Without a subcommand: packs dist/HubSlosh.fmu, simulates the 22 sine sweeps of Rubaga's thesis
/// and leaves dist/campaign/report.html and features.csv.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Pack(pack::PackArgs),
    Run(run::RunArgs),
    Torque(torque::TorqueArgs),
    Campaign(campaign::CampaignArgs),
    Check(check::CheckArgs),
    /// The calls of one rule of `check`, in a process of their own.
    #[command(hide = true)]
    CheckCalls(check::CheckCallsArgs),
    Scale(scale::ScaleArgs),
    Tank(tank::TankArgs),
    Gyro(gyro::GyroArgs),
    Example(example::ExampleArgs),
    Identify(identify::IdentifyArgs),
    Design(design::DesignArgs),
    Release(release::ReleaseArgs),
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Some(Command::Pack(args)) => args.run(),
        Some(Command::Run(args)) => args.run(),
        Some(Command::Torque(args)) => args.run(),
        Some(Command::Campaign(args)) => args.run(),
        Some(Command::Check(args)) => args.run(),
        Some(Command::CheckCalls(args)) => args.run(),
        Some(Command::Scale(args)) => args.run(),
        Some(Command::Tank(args)) => args.run(),
        Some(Command::Gyro(args)) => args.run(),
        Some(Command::Example(args)) => args.run(),
        Some(Command::Identify(args)) => args.run(),
        Some(Command::Design(args)) => args.run(),
        Some(Command::Release(args)) => args.run(),
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
    pack::native(::pack::HUBSLOSH, Path::new(DEFAULT_FMU))?;
    let campaign =
        Campaign { plan: Plan::read("thesis")?, force: false, out: DEFAULT_CAMPAIGN.into() };
    campaign::drive(&Fmu::open(DEFAULT_FMU)?, &campaign)
}

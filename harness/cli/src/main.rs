//! The command line `hubslosh`.

/// `println!` of the standard library panics when its reader is gone (`hubslosh variables | head`);
/// this one ends the program.
macro_rules! println {
    () => { crate::say("\n".into()) };
    ($($arguments:tt)*) => { crate::say(format!("{}\n", format_args!($($arguments)*))) };
}

/// The same of `print!`.
macro_rules! print {
    ($($arguments:tt)*) => { crate::say(format!($($arguments)*)) };
}

mod commands;
mod progress;
mod set_file;

use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use bench::campaign::Campaign;
use bench::plan::Plan;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use commands::*;
use host::fmi2::Fmu;

/// Packs FMUs, checks them, simulates campaigns and reports.
///
/// Without a subcommand: packs dist/HubSlosh.fmu, simulates the 22 sine sweeps of Rubaga's thesis
/// with a linear and a spherical liquid and leaves dist/campaign/report.html and features.csv.
#[derive(Parser)]
#[command(version, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

/// What the program's exit code says.
const EXIT_CODES: &str = "Exit codes:\n  \
    0  done, or the reader of its output has closed the pipe\n  \
    1  it failed; stderr says what was wrong, where, and what is allowed (of check: errors were \
    found)\n  \
    2  the command line was not understood";

#[derive(Subcommand)]
enum Command {
    Pack(pack::PackArgs),
    Run(run::RunArgs),
    Variables(variables::VariablesArgs),
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
    Completions(completions::CompletionsArgs),
    Book(book::BookArgs),
}

/// The command line, in which `--fill -1` is a value, to be refused with what is allowed.
fn command_line() -> clap::Command {
    fn with_negative_numbers(command: clap::Command) -> clap::Command {
        let of = |arg: clap::Arg| match arg.get_action().takes_values() {
            true => arg.allow_negative_numbers(true),
            false => arg,
        };
        command.mut_args(of).mut_subcommands(with_negative_numbers)
    }
    with_negative_numbers(Cli::command())
}

/// Has SIGINT and SIGTERM remove what is temporary before they end the program. SIGHUP stays as it
/// was, for nohup.
#[cfg(unix)]
fn clean_up_on_signals() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            host::temporary::remove_all();
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    });
}

fn main() -> ExitCode {
    #[cfg(unix)]
    clean_up_on_signals();
    let cli = Cli::from_arg_matches(&command_line().get_matches()).unwrap_or_else(|e| e.exit());
    let done = match cli.command {
        Some(Command::Pack(args)) => args.run(),
        Some(Command::Run(args)) => args.run(),
        Some(Command::Variables(args)) => args.run(),
        Some(Command::Completions(args)) => args.run(),
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
        Some(Command::Book(args)) => args.run(),
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

/// Prints a text to stdout.
fn say(text: String) {
    if let Err(error) = quiet_if_closed(std::io::stdout().write_all(text.as_bytes())) {
        eprintln!("error: could not write to stdout: {error}");
        std::process::exit(1);
    }
}

/// Ends the program, as done, if what was written to has no reader any more.
fn quiet_if_closed<T, E: Into<anyhow::Error>>(written: Result<T, E>) -> Result<T> {
    written.map_err(|error| {
        let error = error.into();
        let io = error.downcast_ref::<std::io::Error>();
        if io.is_some_and(|io| io.kind() == ErrorKind::BrokenPipe) {
            std::process::exit(0);
        }
        error
    })
}

/// What `cargo run --release` does.
fn everything() -> Result<()> {
    pack::native(::pack::HUBSLOSH, Path::new(DEFAULT_FMU))?;
    let plan = Plan::read("thesis")?;
    let out = DEFAULT_CAMPAIGN.into();
    let campaign = Campaign { plan, force: false, jobs: 0, compare: None, out };
    campaign::drive(&Fmu::open(DEFAULT_FMU)?, &campaign, campaign.take()?)
}

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

/// `eprintln!` of the standard library writes to where a guarded FMU does.
macro_rules! eprintln {
    ($($arguments:tt)*) => { crate::complain(format!("{}\n", format_args!($($arguments)*))) };
}

mod commands;
mod progress;
mod set_file;

use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use commands::*;
use experiments::campaign::Campaign;
use experiments::plan::Plan;
use host::guard::{self, Cause, Limits, Output};

/// Packs FMUs, checks them, simulates campaigns and reports.
///
/// Without a subcommand: packs dist/HubSlosh.fmu, simulates the 22 sine sweeps of Rubaga's thesis
/// with a linear and a spherical liquid and leaves dist/campaign/report.html and features.csv.
#[derive(Parser)]
#[command(version, after_help = EXIT_CODES)]
struct Cli {
    /// Time that one call of an FMU may take, s (of check: see its --limit).
    #[arg(long, global = true, hide_short_help = true, value_name = "SECONDS", default_value_t = guard::CALL.as_secs_f64())]
    call_limit: f64,
    /// Memory that an FMU may take in run and campaign, MiB.
    #[arg(long, global = true, hide_short_help = true, value_name = "MIB", default_value_t = guard::MEMORY >> 20)]
    memory: u64,
    /// How a process that runs FMUs is started.
    #[arg(long, hide = true)]
    guarded: Option<String>,
    #[command(subcommand)]
    command: Option<Command>,
}

impl Cli {
    /// Whether memory and files of the command are limited.
    fn has_memory_limit(&self) -> bool {
        matches!(self.command, None | Some(Command::Run(_) | Command::Campaign(_)))
    }

    /// Whether the command loads an FMU into its own process.
    fn loads(&self) -> bool {
        use Command::*;
        let of = |command: &Command| {
            matches!(command, Run(_) | Campaign(_) | Gyro(_) | Example(_) | Identify(_) | Design(_))
        };
        self.command.as_ref().is_none_or(of)
    }

    /// What the process that does it may take.
    fn limits(&self) -> Result<Limits> {
        let call = Duration::try_from_secs_f64(self.call_limit).ok().filter(|time| !time.is_zero());
        let call =
            call.with_context(|| format!("--call-limit {} (allowed: above 0 s)", self.call_limit))?;
        let (memory, file) = match self.has_memory_limit() {
            true => (self.memory.saturating_mul(1 << 20), guard::FILE),
            // fits and records take what they need
            false => (1 << 40, 1 << 40),
        };
        Ok(Limits { call, total: None, memory, file })
    }
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

/// Has SIGINT and SIGTERM end guarded processes and remove what is temporary before they end the program. SIGHUP stays as it
/// was, for nohup.
#[cfg(unix)]
fn clean_up_on_signals() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            guard::end_all();
            host::temporary::remove_all();
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    });
}

fn main() -> ExitCode {
    #[cfg(unix)]
    clean_up_on_signals();
    let cli = Cli::from_arg_matches(&command_line().get_matches()).unwrap_or_else(|e| e.exit());
    let code = match (&cli.guarded, cli.loads()) {
        (None, true) => guarded(&cli),
        (Some(spec), _) => guard::enter(spec).map(|()| carry_out(cli)),
        (None, false) => Ok(carry_out(cli)),
    };
    let code = code.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        1
    });
    guard::done(code);
    code.into()
}

/// Has a guarded process carry the command out.
fn guarded(cli: &Cli) -> Result<u8> {
    if cli.command.is_none() {
        pack::native(::pack::HUBSLOSH, Path::new(DEFAULT_FMU))?;
    }
    let limits = cli.limits()?;
    let program = std::env::current_exe().context("this program cannot find itself")?;
    let outcome = guard::run(&program, std::env::args_os().skip(1), &limits, Output::Shown)?;
    match outcome.cause {
        Cause::Done(code) => Ok(code),
        Cause::Ended(status) => {
            let last = outcome.last_line().map(|line| format!("; it printed {line:?}"));
            let within = match cli.has_memory_limit() {
                true => {
                    let files = guard::FILE >> 20;
                    format!(", in {} MiB of memory and files of {files} MiB", cli.memory)
                }
                false => String::new(),
            };
            bail!(
                "the FMU has ended the process that ran it ({status}{}), before the command was done \
                 (allowed: every call returns{within})",
                last.unwrap_or_default()
            )
        }
        Cause::EndlessCall | Cause::TooLong => bail!(
            "a call of the FMU has not returned within {} s (--call-limit gives more time)",
            cli.call_limit
        ),
        Cause::Flood => {
            bail!("the FMU has printed more than {} GiB (allowed: less)", guard::FLOOD_SHOWN >> 30)
        }
    }
}

/// Carries the command out in this process and returns the exit code.
fn carry_out(cli: Cli) -> u8 {
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
        Ok(()) => 0,
        Err(error) => {
            eprintln!("error: {error:#}");
            1
        }
    }
}

/// Prints a text to stdout.
fn say(text: String) {
    if let Err(error) = quiet_if_closed(stdout().write_all(text.as_bytes())) {
        eprintln!("error: could not write to stdout: {error}");
        exit(1);
    }
}

/// stdout, out of the reach of a guarded FMU.
fn stdout() -> Box<dyn Write> {
    match guard::streams() {
        Some((stdout, _)) => Box::new(stdout),
        None => Box::new(std::io::stdout().lock()),
    }
}

/// Prints a text to stderr.
fn complain(text: String) {
    // who has closed it does not want to know
    let _ = match guard::streams() {
        Some((_, mut stderr)) => stderr.write_all(text.as_bytes()),
        None => std::io::stderr().write_all(text.as_bytes()),
    };
}

/// Ends the program on purpose.
fn exit(code: u8) -> ! {
    guard::done(code);
    std::process::exit(code.into())
}

/// Ends the program, as done, if what was written to has no reader any more.
fn quiet_if_closed<T, E: Into<anyhow::Error>>(written: Result<T, E>) -> Result<T> {
    written.map_err(|error| {
        let error = error.into();
        let io = error.downcast_ref::<std::io::Error>();
        if io.is_some_and(|io| io.kind() == ErrorKind::BrokenPipe) {
            exit(0);
        }
        error
    })
}

/// What `cargo run --release` does with the FMU that it has packed.
fn everything() -> Result<()> {
    let plan = Plan::read("thesis")?;
    let out = DEFAULT_CAMPAIGN.into();
    let campaign = Campaign { plan, force: false, jobs: 0, compare: None, out };
    campaign::drive(&open(Path::new(DEFAULT_FMU))?, &campaign, campaign.take()?)
}

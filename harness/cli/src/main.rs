//! The command line `hubslosh`.

/// Prints a line to stdout. If the reader of stdout has closed the pipe (as in `hubslosh variables
/// | head`), the program ends without an error, whereas the macro of the standard library would
/// panic.
macro_rules! println {
    () => { crate::terminal::print("\n".into()) };
    ($($arguments:tt)*) => { crate::terminal::print(format!("{}\n", format_args!($($arguments)*))) };
}

macro_rules! print {
    ($($arguments:tt)*) => { crate::terminal::print(format!($($arguments)*)) };
}

/// Prints a line that tells the user what was done, for example which file was written. It is not a
/// result, so that `--quiet` suppresses it.
macro_rules! done {
    ($($arguments:tt)*) => {
        crate::terminal::done(format_args!($($arguments)*))
    };
}

mod commands;
mod fmu;
mod outputs;
mod progress;
mod set_file;
mod terminal;

use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use commands::*;
use experiments::campaign::Campaign;
use experiments::plan::Plan;
use files::bug;
use host::guard::{self, Cause, Limits, Output};
use terminal::{GLOBAL, Terminal};

/// Simulates propellant slosh by FMUs, identifies their parameters from recordings, and packs and checks FMUs.
///
/// In the project's source, `cargo run --release` without a subcommand packs dist/HubSlosh.fmu, simulates the 22 sine
/// sweeps of Rubaga's thesis with the slosh models `linear` and `spherical`, and writes dist/campaign/report.html and
/// features.csv.
#[derive(Parser)]
#[command(version, after_help = EXIT_CODES)]
struct Cli {
    /// Longest time that one call of an FMU may take, s. The command `check` has --limit instead.
    #[arg(long, global = true, help_heading = GLOBAL, hide_short_help = true, value_name = "SECONDS", default_value_t = guard::CALL.as_secs_f64())]
    call_limit: f64,
    /// Memory that an FMU may use in the commands run, campaign and analyse, MiB.
    #[arg(long, global = true, help_heading = GLOBAL, hide_short_help = true, value_name = "MIB", default_value_t = guard::MEMORY >> 20)]
    memory: u64,
    /// Parses the command line and does nothing else; for tests of the examples in help and book.
    #[arg(long, hide = true)]
    parse_only: bool,
    /// Internal: runs FMUs for another process.
    #[arg(long, hide = true)]
    guarded: bool,
    #[command(flatten)]
    terminal: Terminal,
    #[command(subcommand)]
    command: Option<Command>,
}

impl Cli {
    /// Returns the FMU that the command loads into its own process, as the command line names it, or
    /// `None` for a command that loads no FMU there.
    fn fmu(&self) -> Option<&Path> {
        use Command::*;
        match self.command.as_ref()? {
            Run(args) => Some(&args.fmu),
            Campaign(args) => Some(&args.runs.fmu),
            Analyse(args) => Some(&args.runs.fmu),
            Example(args) => Some(&args.fmu),
            Identify(args) => args.fmu(),
            Design(args) => Some(&args.fmu),
            _ => None,
        }
    }

    /// Returns `true` if memory and files of the command are limited. This is so for commands that
    /// do little else than simulate FMUs.
    fn has_memory_limit(&self) -> bool {
        matches!(
            self.command,
            None | Some(Command::Run(_) | Command::Campaign(_) | Command::Analyse(_))
        )
    }

    fn limits(&self) -> Result<Limits> {
        let call = Duration::try_from_secs_f64(self.call_limit).ok().filter(|time| !time.is_zero());
        let call =
            call.with_context(|| format!("--call-limit {} (allowed: above 0 s)", self.call_limit))?;
        let (memory, file) = match self.has_memory_limit() {
            true => (self.memory.saturating_mul(1 << 20), guard::FILE),
            // Fits and Allan deviations of long recordings may need more.
            false => (1 << 40, 1 << 40),
        };
        Ok(Limits { call, total: None, memory, file })
    }
}

const EXIT_CODES: &str = "Exit codes:\n  \
    0  done, or the reader of its output has closed the pipe\n  \
    1  an error, which stderr explains; of check: the FMU has errors; with --strict: there was a warning\n  \
    2  the command line was not understood; of check: no selected rule could be checked";

#[derive(Subcommand)]
enum Command {
    Pack(pack::PackArgs),
    Run(run::RunArgs),
    View(view::ViewArgs),
    Variables(variables::VariablesArgs),
    Torque(torque::TorqueArgs),
    Campaign(campaign::CampaignArgs),
    Analyse(analyse::AnalyseArgs),
    Check(check::CheckArgs),
    /// Internal: makes the calls of one rule of `check` in a separate process.
    #[command(hide = true)]
    CheckCalls(check::CheckCallsArgs),
    Scale(scale::ScaleArgs),
    Tank(tank::TankArgs),
    Gyro(gyro::GyroArgs),
    Example(example::ExampleArgs),
    Examples(examples::ExamplesArgs),
    Fmus(fmus::FmusArgs),
    Identify(Box<identify::IdentifyArgs>),
    Design(Box<design::DesignArgs>),
    Review(review::ReviewArgs),
    Release(release::ReleaseArgs),
    Completions(completions::CompletionsArgs),
    Book(book::BookArgs),
}

/// Returns the parser of the command line. It accepts negative numbers as values, for example in
/// `--fill -1`, so that the error message can state the allowed range.
fn command_line() -> clap::Command {
    fn with_negative_numbers(command: clap::Command) -> clap::Command {
        let of = |arg: clap::Arg| match arg.get_action().takes_values() {
            true => arg.allow_negative_numbers(true),
            false => arg,
        };
        command.mut_args(of).mut_subcommands(with_negative_numbers)
    }
    with_negative_numbers(Cli::command()).color(terminal::color_of_arguments())
}

/// Lets SIGINT and SIGTERM end the guarded processes and remove temporary files before they end
/// this program. SIGHUP is left alone, so that nohup works.
#[cfg(unix)]
fn clean_up_on_signals() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else { return };
    guard::spawn(move || {
        for signal in signals.forever() {
            guard::end_all();
            files::temporary::remove_all();
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    });
}

fn main() -> ExitCode {
    #[cfg(unix)]
    clean_up_on_signals();
    bug::keep_panics();
    let mut command = command_line();
    let arguments = identify::with_kind(std::env::args_os().collect()).unwrap_or_else(|error| {
        terminal::error(format_args!("{error:#}"));
        std::process::exit(2)
    });
    let matches = command.try_get_matches_from_mut(arguments).unwrap_or_else(|e| e.exit());
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|e| e.exit());
    cli.terminal.set();
    let work = || {
        outputs::check(&command, &matches)?;
        if cli.parse_only {
            return Ok(0);
        }
        if cli.command.is_none() && !is_run_by_cargo() {
            print!("{}", command.render_help());
            return Ok(0);
        }
        match (cli.guarded, cli.command.is_none() || cli.fmu().is_some()) {
            (false, true) => guarded(&cli),
            (true, _) => guard::enter().map(|()| run_command(cli)),
            (false, false) => Ok(run_command(cli)),
        }
    };
    let code = match bug::catch_panic(work) {
        Ok(code) => code,
        Err(panic) => {
            let report = bug::report(&panic.0);
            if guard::panics(&report) {
                return ExitCode::FAILURE; // the parent of this guarded process prints the report
            }
            Err(anyhow!(report))
        }
    };
    let code = code.unwrap_or_else(|error| {
        terminal::error(format_args!("{error:#}"));
        1
    });
    guard::done(code);
    code.into()
}

fn is_run_by_cargo() -> bool {
    std::env::var_os("CARGO_MANIFEST_DIR").is_some()
}

fn guarded(cli: &Cli) -> Result<u8> {
    // The FMU is built before the guard starts, because the guard's limits are not meant for a compiler.
    match cli.fmu() {
        Some(name) => drop(fmu::find(name)?),
        None if fmu::find_installed("HubSlosh.fmu").is_none() && ::pack::has_source() => {
            pack::native(::pack::HUBSLOSH, ::pack::Fmi::V2, Path::new("dist/HubSlosh.fmu"))?;
        }
        None => drop(fmu::find(Path::new(DEFAULT_FMU))?),
    }
    let limits = cli.limits()?;
    let program = std::env::current_exe().context("the path of this program cannot be found")?;
    let arguments = [guard::OPTION.into()].into_iter().chain(std::env::args_os().skip(1));
    let outcome = guard::run(&program, arguments, &limits, Output::Shown, |_| {})?;
    match outcome.cause {
        Cause::Done(code) => Ok(code),
        Cause::Ended(status) => {
            let last = outcome.last_line().map(|line| format!("; it printed {line:?}"));
            let within = match cli.has_memory_limit() {
                true => {
                    let files = guard::FILE >> 20;
                    format!(
                        ", uses at most {} MiB of memory and writes files of at most {files} MiB",
                        cli.memory
                    )
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
        Cause::Hoard => bail!(
            "the temporary files or the shared memory of the FMU take more than {} MiB (--memory \
             gives more)",
            limits.memory >> 20
        ),
        Cause::Interfered => bail!(
            "the FMU has written to, or has closed, the pipe between hubslosh and the process that runs the FMU (allowed: only files and connections that the FMU itself has opened)"
        ),
        Cause::Panicked(report) => bail!(report),
        Cause::Flood => {
            bail!("the FMU has printed more than {} GiB (allowed: less)", guard::FLOOD_SHOWN >> 30)
        }
    }
}

fn run_command(cli: Cli) -> u8 {
    macro_rules! run {
        ($($command:ident)*) => {
            match cli.command {
                $(Some(Command::$command(args)) => args.run(),)*
                Some(Command::Completions(args)) => args.run(Cli::command()),
                None => run_default_job(),
            }
        };
    }
    let done = run!(Pack Run View Variables Torque Campaign Analyse Check CheckCalls Scale Tank Gyro Example Examples Fmus
        Identify Design Review Release Book);
    match done {
        Ok(()) => terminal::code(),
        Err(error) => {
            terminal::error(format_args!("{error:#}"));
            if error.is::<check::Unchecked>() { 2 } else { 1 }
        }
    }
}

fn run_default_job() -> Result<()> {
    let plan = Plan::read("thesis")?;
    let out = DEFAULT_CAMPAIGN.into();
    let campaign = Campaign { plan, force: false, jobs: 0, out };
    campaign::drive(&open(Path::new(DEFAULT_FMU))?, &campaign, campaign.take()?, Vec::new())
}

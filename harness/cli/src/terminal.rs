//! Output of the command: results to stdout, everything else to stderr.

use std::io::{ErrorKind, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use anstream::AutoStream;
use anyhow::Result;
use clap::ColorChoice;
use clap::builder::styling::{AnsiColor, Effects, Style, Styles};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use files::input;
use host::guard;

pub const GLOBAL: &str = "Global options";

#[derive(Clone, Copy, Default, clap::Args)]
#[group(skip)]
pub struct Terminal {
    /// Prints only results, warnings and errors: no progress, and no lines about files that were written.
    #[arg(long, short, global = true, help_heading = GLOBAL)]
    quiet: bool,
    /// Exits with code 1 if there was a warning.
    #[arg(long, global = true, help_heading = GLOBAL)]
    strict: bool,
    /// Decides when messages have colours.
    #[arg(
        long,
        global = true,
        help_heading = GLOBAL,
        value_name = "WHEN",
        default_value = "auto",
        value_parser = color_parser()
    )]
    color: ColorChoice,
    /// Internal: prints progress and results as JSON text sequences (RFC 7464), for the Python package.
    #[arg(long, global = true, hide = true)]
    messages: bool,
}

fn color_parser() -> impl TypedValueParser<Value = ColorChoice> {
    let values = values_with_help([
        ("auto", "On a terminal, unless the environment variable NO_COLOR is set"),
        ("always", "Also in files and pipes"),
        ("never", "Not at all"),
    ]);
    PossibleValuesParser::new(values).try_map(|when: String| when.parse::<ColorChoice>())
}

static TERMINAL: OnceLock<Terminal> = OnceLock::new();
static WARNINGS: AtomicUsize = AtomicUsize::new(0);
static JSON: AtomicBool = AtomicBool::new(false);

impl Terminal {
    pub fn set(self) {
        TERMINAL.get_or_init(|| self);
    }
}

fn terminal() -> Terminal {
    TERMINAL.get().copied().unwrap_or_default()
}

pub fn is_quiet() -> bool {
    terminal().quiet
}

/// Returns `true` if the program that started this one reads messages. The Python package asks for
/// messages by the option `--messages`.
pub fn has_reader() -> bool {
    terminal().messages
}

/// Sends the message `name` to the program that started this one. `value` is JSON and may have
/// several lines.
pub fn message(name: &str, value: &str) {
    // Line breaks inside a string are escaped, so that all line breaks are layout and can be removed.
    let value: String = value.lines().map(str::trim).collect();
    print(format!("\u{1e}{{{name:?}:{value}}}\n"));
}

/// Finds the value of `--color` in the arguments before the command line is parsed, because
/// messages about a wrong command line must have the right colours, too.
pub fn color_of_arguments() -> ColorChoice {
    let arguments: Vec<_> = std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
    let flags = arguments.iter().take_while(|argument| *argument != "--");
    let value =
        flags.enumerate().find_map(|(i, argument)| match argument.strip_prefix("--color")? {
            "" => arguments.get(i + 1).map(String::as_str),
            value => value.strip_prefix('='),
        });
    value.and_then(|value| value.parse().ok()).unwrap_or_default()
}

pub fn error(text: impl std::fmt::Display) {
    let text = input::without_error_numbers(&text.to_string());
    print_to_stderr(format!("{} {text}\n", with_style("error:", *Styles::styled().get_error())));
}

/// Prints a warning to stderr. With the option `--strict` a warning makes the exit code 1.
pub fn warn(text: impl std::fmt::Display) {
    WARNINGS.fetch_add(1, Ordering::Relaxed);
    let style = AnsiColor::Yellow.on_default().effects(Effects::BOLD);
    print_to_stderr(format!("{} {text}\n", with_style("warning:", style)));
}

/// Prints a line about progress to stderr, unless the option `--quiet` is given.
pub fn note(text: impl std::fmt::Display) {
    if !is_quiet() {
        print_to_stderr(format!("{text}\n"));
    }
}

/// Returns the exit code of a command that has done its work: 0, or 1 if there were warnings and
/// `--strict` makes them errors.
pub fn code() -> u8 {
    match WARNINGS.load(Ordering::Relaxed) {
        0 => 0,
        _ if !terminal().strict => 0,
        1 => report_failure("there was a warning, which --strict makes an error"),
        n => report_failure(&format!("there were {n} warnings, which --strict makes an error")),
    }
}

fn report_failure(why: &str) -> u8 {
    error(why);
    1
}

fn with_style(word: &str, style: Style) -> String {
    if choice() != anstream::ColorChoice::Never {
        format!("{style}{word}{style:#}")
    } else {
        word.into()
    }
}

/// Decides if messages have colours. In a guarded process this depends on the stderr of the program
/// that started the process, because its own stderr is a pipe.
fn choice() -> anstream::ColorChoice {
    let auto = || match guard::streams() {
        Some((_, stderr)) => AutoStream::choice(stderr),
        None => AutoStream::choice(&std::io::stderr()),
    };
    match terminal().color {
        ColorChoice::Always => anstream::ColorChoice::Always,
        ColorChoice::Never => anstream::ColorChoice::Never,
        ColorChoice::Auto => auto(),
    }
}

pub fn print(text: String) {
    if let Err(error) = quiet_if_closed(stdout().write_all(text.as_bytes())) {
        self::error(format_args!("could not write to stdout: {error}"));
        exit(1);
    }
}

/// Prints a value as JSON to stdout. Later calls of [`done`] write to stderr, so that stdout
/// contains only the JSON.
pub fn print_json(value: &impl serde::Serialize) -> Result<()> {
    print_text_as_json(serde_json::to_string_pretty(value)? + "\n");
    Ok(())
}

pub fn print_text_as_json(text: String) {
    JSON.store(true, Ordering::Relaxed);
    print(text);
}

/// Prints a line that names a written file, unless `--quiet` is given. It goes to stdout, or to
/// stderr if JSON was printed to stdout.
pub fn done(text: std::fmt::Arguments) {
    match JSON.load(Ordering::Relaxed) {
        _ if is_quiet() => {}
        true => eprintln!("{text}"),
        false => println!("{text}"),
    }
}

/// Returns the original stdout of the program, to which an FMU in a guarded process cannot write.
pub fn stdout() -> Box<dyn Write> {
    match guard::streams() {
        Some((stdout, _)) => Box::new(stdout),
        None => Box::new(std::io::stdout().lock()),
    }
}

/// Prints a text to stderr. A guarded process prints to the original stderr, which the FMU cannot
/// reach.
fn print_to_stderr(text: String) {
    // A closed stderr means that nobody wants to read the messages.
    let _ = match guard::streams() {
        Some((_, mut stderr)) => stderr.write_all(text.as_bytes()),
        None => AutoStream::new(std::io::stderr(), choice()).write_all(text.as_bytes()),
    };
}

/// Ends the program with the exit code `code`. The parent of a guarded process is informed before,
/// so that it does not report a crash.
fn exit(code: u8) -> ! {
    guard::done(code);
    std::process::exit(code.into())
}

/// Ends the program with exit code 0 if `written` failed because the reader of the output has
/// closed the pipe, as in `hubslosh variables
/// | head`. Any other error is returned.
pub fn quiet_if_closed<T, E: Into<anyhow::Error>>(written: Result<T, E>) -> Result<T> {
    written.map_err(|error| {
        let error = error.into();
        let io = error.downcast_ref::<std::io::Error>();
        if io.is_some_and(|io| io.kind() == ErrorKind::BrokenPipe) {
            exit(0);
        }
        error
    })
}

/// Returns the values of an option for its parser. `all` are pairs of a value and its meaning, which the help lists.
pub fn values_with_help<const N: usize>(
    all: [(&'static str, &'static str); N],
) -> [PossibleValue; N] {
    all.map(|(value, meaning)| PossibleValue::new(value).help(meaning))
}

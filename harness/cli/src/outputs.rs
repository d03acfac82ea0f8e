//! Ensures, for every command and before it reads or writes anything, that its outputs do not overwrite inputs.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::ArgMatches;
use clap::parser::ValueSource;
use files::input;
use files::output::{self, Destination};

/// Options whose values are files or directories that a command writes: name of the command, name
/// of the option, and the endings of the files that are written. All other values that name a file
/// are inputs.
const OUTPUTS: [(&str, &str, &[&str]); 22] = [
    ("analyse", "out", &[]),
    ("book", "out", &[]),
    ("campaign", "out", &[]),
    ("check", "json", &["json"]),
    ("check", "junit", &["xml"]),
    ("check", "sarif", &["sarif", "json"]),
    ("design", "out", &["csv", "parquet"]),
    ("examples", "copy", &[]),
    ("gyro", "out", &[]),
    ("gyro", "report", &["html"]),
    ("identify", "out", &["json"]),
    ("identify", "report", &["html"]),
    ("pack", "out", &["fmu"]),
    ("release", "out", &[]),
    ("release", "wheels", &[]),
    ("review", "out", &["html"]),
    ("run", "out", &["csv", "parquet"]),
    ("tank", "out", &["json", "csv"]),
    ("tank", "parameters", &["toml", "ssv"]),
    ("tank", "picture", &["svg"]),
    ("torque", "out", &["csv", "parquet"]),
    ("view", "out", &["html"]),
];

const INPUTS: [&str; 9] = ["fmu", "toml", "ssv", "csv", "tsv", "parquet", "mat", "json", "svg"];

/// Protects the inputs that the command line names from being overwritten, and checks the outputs.
/// An output is refused if it would replace such an input or any existing file with an ending that
/// is usual for inputs, or if two outputs are the same file.
///
/// # Errors
///
/// If an output is refused; the message names the option and its value.
pub fn check(command: &clap::Command, matches: &ArgMatches) -> Result<()> {
    let Some((name, matches)) = matches.subcommand() else { return Ok(()) };
    let Some(command) = command.find_subcommand(name) else { return Ok(()) };
    // `identify` has subcommands, which share its entries in the list of outputs.
    let (command, matches) = match matches.subcommand() {
        Some((kind, matches)) => (command.find_subcommand(kind).unwrap_or(command), matches),
        None => (command, matches),
    };
    let mut outputs: Vec<(&str, PathBuf, &[&str])> = Vec::new();
    for argument in command.get_arguments() {
        let option = argument.get_id().as_str();
        let output = OUTPUTS.iter().find(|(of, id, _)| *of == name && *id == option);
        if output.is_none() && matches.value_source(option) != Some(ValueSource::CommandLine) {
            continue;
        }
        for value in matches.try_get_raw(option).ok().flatten().into_iter().flatten() {
            match output {
                Some((_, _, endings)) if value != "-" && !value.is_empty() => {
                    outputs.push((option, value.into(), endings));
                }
                Some(_) => {}
                None => files_in(value).iter().for_each(|path| protect(path)),
            }
        }
    }
    for (k, (option, path, endings)) in outputs.iter().enumerate() {
        input::check_replaceable(path).map_err(|error| error.context(format!("--{option}")))?;
        let ending = path.extension().and_then(OsStr::to_str).map(str::to_lowercase);
        let ending = ending.unwrap_or_default();
        let is_input = INPUTS.contains(&&*ending) && !endings.contains(&&*ending);
        ensure!(
            !(is_input && path.is_file()),
            "--{option} would replace {}, an existing .{ending} file, which is probably an input (allowed: {}, \
             or a file that does not exist yet)",
            path.display(),
            if endings.is_empty() {
                "a name without such an ending".into()
            } else {
                format!("a name that ends in .{}", endings.join(" or ."))
            }
        );
        let file = place(path);
        let other =
            outputs[..k].iter().find(|(_, other, _)| file.is_some() && place(other) == file);
        if let Some((other, _, _)) = other {
            anyhow::bail!(
                "{} is the file of two outputs (--{other}, --{option}); give a different file for each",
                path.display()
            );
        }
    }
    Ok(())
}

/// Protects the file `path` from being overwritten. For a plan or a tank, the recordings, torques
/// and drawings that it names are protected, too.
fn protect(path: &Path) {
    input::protect(path);
    if path.extension().is_none_or(|ending| ending != "toml") || !path.is_file() {
        return;
    }
    // If the file cannot be read, nothing is protected here, and the command itself reports what is wrong.
    let read = input::text(path).ok().and_then(|text| text.parse::<toml::Table>().ok());
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut values: Vec<toml::Value> = read.into_iter().map(toml::Value::Table).collect();
    while let Some(value) = values.pop() {
        match value {
            toml::Value::Table(inside) => values.extend(inside.into_iter().map(|(_, value)| value)),
            toml::Value::Array(inside) => values.extend(inside),
            toml::Value::String(text) => {
                for named in files_in(OsStr::new(&text)) {
                    input::protect(&named);
                    input::protect(&folder.join(named));
                }
            }
            _ => {}
        }
    }
}

/// Lists the paths that the value of an option may name: the value itself, and the text after each
/// colon or equals sign, as in `2:fuel.toml` and `file:path=torque.csv,hold=true`.
fn files_in(value: &OsStr) -> Vec<PathBuf> {
    let mut paths = vec![PathBuf::from(value)];
    let text = value.to_str().unwrap_or_default();
    for (at, _) in text.match_indices([':', '=']) {
        let rest = &text[at + 1..];
        paths.push(rest.into());
        paths.extend(rest.split(',').next().map(PathBuf::from));
    }
    paths
}

/// Returns the file to which `path` leads after its links are followed; the file need not exist.
/// The result is `None` for a device or a pipe, to which several outputs may be written.
fn place(path: &Path) -> Option<PathBuf> {
    let Ok(Destination::File(file)) = output::destination(path) else { return None };
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    match (folder.unwrap_or(Path::new(".")).canonicalize(), file.file_name()) {
        (Ok(folder), Some(name)) => Some(folder.join(name)),
        _ => Some(file),
    }
}

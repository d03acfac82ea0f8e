use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use HubSlosh::table::TABLE;
use runtime::variable::Kind;

/// Returns the numbers of the items of the enumeration variable `name` of HubSlosh.
///
/// # Panics
/// If there is no such variable, or if it is not an enumeration.
pub fn items(name: &str) -> std::ops::RangeInclusive<i32> {
    let variable = TABLE.variables.iter().find(|v| v.name == name);
    match variable.map(|v| v.kind) {
        Some(Kind::Enumeration(of)) => 1..=of.items.len() as i32,
        _ => panic!("{name} is not an enumeration"),
    }
}

/// Runs a command that must succeed, and returns its output.
///
/// # Panics
/// If the command fails; the message contains `sentence` and the output.
pub fn run(command: &mut Command, sentence: &str) -> String {
    let why = match command.output() {
        Err(error) => error.to_string(),
        Ok(Output { status, stdout, stderr }) => {
            let out = String::from_utf8_lossy(&stdout).into_owned();
            if status.success() {
                return out;
            }
            out + &String::from_utf8_lossy(&stderr)
        }
    };
    panic!("{why}\n{sentence}\n(the command: {command:?})");
}

/// Returns Cargo's target directory.
///
/// # Panics
/// If the FMU from whose path it is derived cannot be packed.
pub fn target() -> &'static Path {
    pack::packed_for_tests().ancestors().nth(2).expect("<target>/test-fmu/HubSlosh.fmu")
}

/// Returns the Python interpreter of the tests' virtual environment, which contains the compiled half of the package. The
/// environment is created if necessary.
///
/// # Panics
/// If the environment cannot be created.
pub fn python() -> &'static Path {
    static PYTHON: LazyLock<PathBuf> = LazyLock::new(|| {
        pack::build_native(true).expect("the compiled half of the Python package");
        let scripts = pack::root().join("harness").join("python");
        let first = if cfg!(windows) { "python" } else { "python3" };
        let path = run(
            Command::new(first)
                .arg(scripts.join("environment.py"))
                .arg(target().join("python").join("tests"))
                .arg(scripts.join("requirements.txt")),
            "the tests in Python need Python 3.11 or newer with its module venv, and the network once",
        );
        PathBuf::from(path.trim())
    });
    &PYTHON
}

/// Returns the binary `hubslosh` of the profile with which this test was built.
pub fn harness() -> &'static Path {
    static HARNESS: LazyLock<PathBuf> = LazyLock::new(|| binary("hubslosh", &[]));
    &HARNESS
}

/// Builds a binary of the workspace in the profile with which this test was built, and returns its path. `of` are further
/// arguments for Cargo: `--workspace` if the binary is not in a default member. `-p` is not used, because with the features
/// of only one package Cargo would compile most of it again.
///
/// # Panics
/// If the binary does not compile.
pub fn binary(name: &str, of: &[&str]) -> PathBuf {
    let mut build = Command::new(env!("CARGO"));
    build.current_dir(pack::root()).args(["build", "--quiet", "--bin", name]).args(of);
    let profile = if cfg!(debug_assertions) { "debug" } else { "release" };
    if profile == "release" {
        build.arg("--release");
    }
    run(&mut build, "a binary of the workspace did not build");
    target().join(profile).join(name).with_extension(std::env::consts::EXE_EXTENSION)
}

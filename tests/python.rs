//! The FMU in Python's hands: runs the tests of `harness/python` with pytest,
//! in a virtual environment of their own in the target directory.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hubslosh::pack;

/// The output of a command that must succeed.
///
/// # Panics
/// If it does not, with what it said and `sentence`.
fn run(command: &mut Command, sentence: &str) -> String {
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

/// The interpreter of the virtual environment, made if need be.
fn python(target: &Path, scripts: &Path) -> PathBuf {
    let first = if cfg!(windows) { "python" } else { "python3" };
    let path = run(
        Command::new(first)
            .arg(scripts.join("environment.py"))
            .arg(target.join("python").join("tests"))
            .arg(scripts.join("requirements.txt")),
        "the tests in Python need Python 3.11 or newer with its module venv, and the network once",
    );
    PathBuf::from(path.trim())
}

/// The harness's binary, of the profile that this test was built with; it is
/// another package's, so Cargo does not say where it is.
fn binary(target: &Path) -> PathBuf {
    let mut build = Command::new(env!("CARGO"));
    build.current_dir(pack::root()).args(["build", "--quiet", "--bin", "hubslosh"]);
    let profile = if cfg!(debug_assertions) { "debug" } else { "release" };
    if profile == "release" {
        build.arg("--release");
    }
    run(&mut build, "the binary hubslosh did not build");
    target.join(profile).join("hubslosh").with_extension(std::env::consts::EXE_EXTENSION)
}

#[test]
fn fmpy_drives_the_fmu_as_the_harness_does() {
    let fmu = pack::packed_for_tests();
    let target = fmu.ancestors().nth(2).expect("<target>/test-fmu/HubSlosh.fmu");
    let scripts = pack::root().join("harness").join("python");
    let said = run(
        Command::new(python(target, &scripts))
            .args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider"])
            .args([Path::new("--fmu"), fmu])
            .args([Path::new("--hubslosh"), &binary(target)])
            .arg(&scripts)
            // the source tree stays as it is
            .env("PYTHONDONTWRITEBYTECODE", "1"),
        "the tests in Python failed",
    );
    // pytest's last line, "61 passed in 20.07s"
    let last = said.trim_end().lines().last().unwrap_or_default();
    let left_out = ["skipped", "deselected", "xfailed"].iter().any(|word| last.contains(word));
    assert!(last.contains(" passed") && !left_out, "pytest did not run every test:\n{said}");
    println!("{last}");
}

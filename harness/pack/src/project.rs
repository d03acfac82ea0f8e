//! The project as Cargo builds it: where its source is, and how an FMU's binary is made from it.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use cargo_metadata::camino::Utf8PathBuf;
use cargo_metadata::{Message, TargetKind};

/// The project's root: the current folder, for a program that others have built.
#[cfg(feature = "shipped")]
pub fn root() -> PathBuf {
    std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."))
}

/// The project's root: two folders above this crate when it was compiled.
#[cfg(not(feature = "shipped"))]
pub fn root() -> PathBuf {
    let crate_root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    crate_root.ancestors().nth(2).unwrap_or(crate_root).to_path_buf()
}

/// Returns true if the project's source is present.
pub fn has_source() -> bool {
    root().join("Cargo.toml").is_file()
}

/// Fails unless the project's source is there, which `what` is made from.
pub fn needs_source(what: &str) -> Result<()> {
    ensure!(
        has_source(),
        "{what} is made from the project's source, which is not in the folder {}",
        root().display()
    );
    Ok(())
}

/// Cargo profile that binaries of FMUs are built with.
const PROFILE: &str = "fmu";

/// Builds the cdylib of a package of this workspace, as an FMU's binary for the platform this
/// program runs on, and returns where Cargo put it. `quiet`: without Cargo's progress.
///
/// # Errors
/// If there is no source or no Cargo, or if it does not compile.
pub fn build(package: &str, quiet: bool) -> Result<PathBuf> {
    let mut command = cargo();
    command.arg("rustc");
    arguments(&mut command, package);
    cargo_build(command, quiet)
}

/// Cargo, the one that runs this program if there is one.
pub(crate) fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Arguments of `cargo rustc` for the FMU's binary. `cargo build` would make the rlib in the same
/// call, and then leave out the link-time optimisation without a word: 70 % more code.
///
/// The compiler may do two numbers at once where that saves much, as with vectors. Where it saves little, it costs time: a pair
/// is loaded just after its halves were stored one by one, and the processor waits. The linear model's step takes a fifth longer.
///
/// What follows goes to the compiler.
pub(crate) fn arguments(command: &mut Command, package: &str) {
    command.args(["--profile", PROFILE, "--package", package, "--lib", "--crate-type", "cdylib"]);
    command.args(["--message-format", "json-render-diagnostics"]);
    command.args(["--", "-Cllvm-args=-slp-threshold=10"]);
}

/// Arguments of `cargo rustc` for the command `hubslosh` as others get it. What follows goes to the
/// compiler.
pub(crate) fn program_arguments(command: &mut Command) {
    command.args(["--release", "--package", "hubslosh", "--bin", "hubslosh"]);
    command.args(["--features", "shipped", "--message-format", "json-render-diagnostics"]);
    command.args(["--", "-Cstrip=symbols"]);
}

/// Cargo package of the compiled half of the Python package.
pub(crate) const NATIVE: &str = "hubslosh-native";

/// Arguments of `cargo rustc` for the compiled half of the Python package. What follows goes to the compiler.
pub(crate) fn native_arguments(command: &mut Command) {
    command.args(["--release", "--package", NATIVE, "--lib", "--crate-type", "cdylib"]);
    command.args(["--message-format", "json-render-diagnostics", "--", "-Cstrip=symbols"]);
}

/// Builds the compiled half of the Python package for the platform this program runs on, and returns where Cargo put it:
/// where the package finds it in the source tree.
///
/// # Errors
/// As [`build`].
pub fn build_native(quiet: bool) -> Result<PathBuf> {
    let mut command = cargo();
    command.args(["rustc", "--locked"]);
    native_arguments(&mut command);
    cargo_build(command, quiet)
}

/// Runs Cargo and returns where it put the binary; Cargo's own progress goes to stderr.
pub(crate) fn cargo_build(mut command: Command, quiet: bool) -> Result<PathBuf> {
    let root = root();
    needs_source("an FMU's binary")?;
    command.current_dir(&root);
    if quiet {
        command.env("CARGO_TERM_QUIET", "true");
    }
    let built = command
        .stderr(Stdio::inherit())
        .output()
        .context("cargo cannot be run; building the FMU needs Rust")?;
    if !built.status.success() {
        bail!("it did not build");
    }
    Message::parse_stream(&built.stdout[..])
        .filter_map(|message| match message {
            Ok(Message::CompilerArtifact(artifact)) => Some(artifact),
            _ => None,
        })
        .filter_map(|artifact| {
            let library = artifact.target.kind.contains(&TargetKind::CDyLib);
            let mut files = artifact.filenames.into_iter();
            let of = |name: &Utf8PathBuf| matches!(name.extension(), Some("so" | "dll" | "dylib"));
            artifact.executable.or_else(|| files.find(of).filter(|_| library))
        })
        .last()
        .map(PathBuf::from)
        .context("cargo built a binary but does not say where it is")
}

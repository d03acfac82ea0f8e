//! The project as Cargo builds it: where its source is, and how an FMU's binary is made from it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use cargo_metadata::{Message, TargetKind};

/// The project's root: two folders above this crate when it was compiled.
pub fn root() -> PathBuf {
    let crate_root = Path::new(env!("CARGO_MANIFEST_DIR"));
    crate_root.ancestors().nth(2).unwrap_or(crate_root).to_path_buf()
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
/// The compiler may do two numbers at once where that saves much, as with vectors. Where it saves
/// little it costs: a pair is loaded just after its halves were stored one by one, and the
/// processor waits; the linear model's step takes a fifth longer.
///
/// What follows goes to the compiler.
pub(crate) fn arguments(command: &mut Command, package: &str) {
    command.args(["--profile", PROFILE, "--package", package, "--lib", "--crate-type", "cdylib"]);
    command.args(["--message-format", "json-render-diagnostics"]);
    command.args(["--", "-Cllvm-args=-slp-threshold=10"]);
}

/// Runs Cargo and returns where it put the binary; Cargo's own progress goes to stderr.
pub(crate) fn cargo_build(mut command: Command, quiet: bool) -> Result<PathBuf> {
    let root = root();
    if !root.join("Cargo.toml").exists() {
        bail!("the project's source is no longer at {}; the FMU cannot be built", root.display());
    }
    command.current_dir(&root);
    if quiet {
        command.env("CARGO_TERM_QUIET", "true");
    }
    let built = command
        .stderr(Stdio::inherit())
        .output()
        .context("cargo cannot be run; building the FMU needs Rust")?;
    if !built.status.success() {
        bail!("the FMU's binary did not build");
    }
    Message::parse_stream(&built.stdout[..])
        .filter_map(|message| match message {
            Ok(Message::CompilerArtifact(artifact)) => Some(artifact),
            _ => None,
        })
        .filter(|artifact| artifact.target.kind.contains(&TargetKind::CDyLib))
        .flat_map(|artifact| artifact.filenames)
        .find(|name| matches!(name.extension(), Some("so" | "dll" | "dylib")))
        .map(PathBuf::from)
        .context("cargo built the FMU but does not say where its binary is")
}

//! The project's source and the builds of its binaries by Cargo.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use cargo_metadata::camino::Utf8PathBuf;
use cargo_metadata::{Message, TargetKind};

/// Returns the root of the project's source: the current folder. The distributed program does not
/// know another place, because it was built on another machine.
#[cfg(feature = "shipped")]
pub fn root() -> PathBuf {
    std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."))
}

/// Returns the root of the project's source: two folders above this crate at the time of
/// compilation.
#[cfg(not(feature = "shipped"))]
pub fn root() -> PathBuf {
    let crate_root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    crate_root.ancestors().nth(2).unwrap_or(crate_root).to_path_buf()
}

pub fn has_source() -> bool {
    root().join("Cargo.toml").is_file()
}

/// Returns an error if the project's source is missing. `what` names the product that is built from
/// it, for the message.
pub fn needs_source(what: &str) -> Result<()> {
    ensure!(
        has_source(),
        "{what} is made from the project's source, which is not in the folder {}; start the command in the folder of the source",
        root().display()
    );
    Ok(())
}

const PROFILE: &str = "fmu";

/// Builds the library (cdylib) of the crate `package` of this workspace for the platform on which
/// this program runs, with the Cargo profile for FMUs. Returns the path of the library. `quiet`
/// suppresses Cargo's progress.
///
/// # Errors
///
/// If source or Cargo are missing, or the package does not compile.
pub fn build(package: &str, quiet: bool) -> Result<PathBuf> {
    let mut command = cargo();
    command.arg("rustc");
    arguments(&mut command, package);
    last(cargo_build(command, quiet)?)
}

/// Returns a command that runs Cargo. If this program was started by Cargo, the command is the same
/// Cargo, so that toolchains are not mixed.
pub(crate) fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Adds the arguments of `cargo rustc` for the binary of the FMU in the crate `package`. Arguments
/// that follow go to the compiler. `cargo build` would also build the rlib in the same call and
/// then silently omit the link-time optimisation, which would give 70 % more code.
///
/// The compiler may process two numbers at once (SLP vectorisation) only where this saves much, as
/// for vectors. Otherwise it costs time, because the processor waits when a pair is loaded directly
/// after its halves were stored separately: a step of the linear model would take a fifth longer.
pub(crate) fn arguments(command: &mut Command, package: &str) {
    command.args(["--profile", PROFILE, "--package", package, "--lib", "--crate-type", "cdylib"]);
    command.args(["--message-format", "json-render-diagnostics"]);
    command.args(["--", "-Cllvm-args=-slp-threshold=10"]);
}

/// Adds options with which Cargo optimises for size those packages that the profile `release` does
/// not optimise. The profile leaves them out so that `cargo run` compiles faster, but a distributed
/// program should be small.
fn optimise_for_size(command: &mut Command) -> Result<()> {
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).context("Cargo.toml")?;
    let manifest: toml::Table = manifest.parse().context("Cargo.toml cannot be understood")?;
    let profile = manifest.get("profile").and_then(|profiles| profiles.get("release"));
    let packages = profile.and_then(|profile| profile.get("package")?.as_table());
    let packages = packages.context("Cargo.toml has no [profile.release.package]")?;
    let is_optimised = |settings: &toml::Value| settings.get("opt-level") != Some(&0.into());
    for (package, _) in packages.iter().filter(|(_, settings)| !is_optimised(settings)) {
        command.arg("--config").arg(format!("profile.release.package.{package}.opt-level = \"s\""));
    }
    Ok(())
}

pub(crate) const NATIVE: &str = "hubslosh-native";

/// Adds the arguments of `cargo build` for the distributed command `hubslosh` and the library of the
/// Python package. One call builds both, because two calls would compile the crates that both need
/// twice, with different features.
pub(crate) fn harness_arguments(command: &mut Command) -> Result<()> {
    command.args(["--release", "--package", "hubslosh", "--bin", "hubslosh"]);
    command.args(["--package", NATIVE, "--lib", "--features", "hubslosh/shipped"]);
    command.args(["--message-format", "json-render-diagnostics"]);
    command.args(["--config", "profile.release.package.hubslosh.strip = \"symbols\""]);
    optimise_for_size(command)
}

/// Builds the library of the Python package for the platform on which this program runs. Returns
/// its path, at which the package finds it in the source tree.
///
/// It is built with the features of the whole program, because with the features of only one
/// package Cargo would compile `host`, `signals`, `parquet` and 16 other crates a second time.
///
/// # Errors
///
/// If source or Cargo are missing, or the package does not compile.
pub fn build_native(quiet: bool) -> Result<PathBuf> {
    let mut command = cargo();
    command.args(["build", "--locked", "--release", "--lib", "--package", "hubslosh"]);
    command.args(["--package", NATIVE, "--message-format", "json-render-diagnostics"]);
    last(cargo_build(command, quiet)?)
}

/// Returns the path of the binary that Cargo built last: dependencies are built first.
pub(crate) fn last(mut built: Vec<(String, PathBuf)>) -> Result<PathBuf> {
    let (_, path) = built.pop().context("cargo built a binary but does not say where it is")?;
    Ok(path)
}

/// Runs a command that calls Cargo. Returns the name of the target and the path of each program and
/// shared library that it built.
pub(crate) fn cargo_build(mut command: Command, quiet: bool) -> Result<Vec<(String, PathBuf)>> {
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
        bail!("cargo could not build the package");
    }
    let artifacts = Message::parse_stream(&built.stdout[..]).filter_map(|message| match message {
        Ok(Message::CompilerArtifact(artifact)) => Some(artifact),
        _ => None,
    });
    let binaries = artifacts.filter_map(|artifact| {
        let library = artifact.target.kind.contains(&TargetKind::CDyLib);
        let mut files = artifact.filenames.into_iter();
        let of = |name: &Utf8PathBuf| matches!(name.extension(), Some("so" | "dll" | "dylib"));
        let path = artifact.executable.or_else(|| files.find(of).filter(|_| library))?;
        Some((artifact.target.name, PathBuf::from(path)))
    });
    Ok(binaries.collect())
}

//! Builds the FMU's binary and packs it, with all that should travel with it, into a `.fmu`
//! (FMI 2.0, section 2.3).

use std::collections::BTreeSet;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use anyhow::{Context, Result, bail};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::components;
use crate::description::ModelDescription;
use crate::documentation;
use crate::example;
use crate::fmi2::PLATFORM;
use crate::output;
use crate::platforms::{self, Built};

/// Cargo package of the FMU's binary.
pub(crate) const PACKAGE: &str = "hubslosh-fmu";
/// Cargo profile it is built with.
const PROFILE: &str = "fmu";
/// Folder below the FMU's `extra`: the model's name, where FMI asks for a domain turned round.
/// The project has no domain, and another's is not to be taken.
pub const EXTRA: &str = "extra/HubSlosh";
/// The software bill of materials in the FMU.
pub const BILL: &str = "extra/HubSlosh/HubSlosh.cdx.json";

/// The project's root: the folder above this crate when it was compiled.
pub fn root() -> PathBuf {
    let crate_root = Path::new(env!("CARGO_MANIFEST_DIR"));
    crate_root.parent().unwrap_or(crate_root).to_path_buf()
}

/// Builds the FMU's binary and packs it to `out`.
pub fn pack(out: &Path) -> Result<()> {
    archive(&[native(&build(false)?)?], out)
}

/// Builds the FMU's binaries for all platforms and packs them to `out`.
pub fn pack_all(out: &Path) -> Result<Vec<Built>> {
    let all = platforms::build()?;
    let binaries: Vec<_> = all
        .iter()
        .map(|b| Packed { folder: b.folder, ending: b.ending, bytes: b.bytes.clone() })
        .collect();
    archive(&binaries, out)?;
    Ok(all)
}

/// A binary to be packed.
pub struct Packed {
    /// Folder under `binaries/`.
    pub folder: &'static str,
    /// Ending of its name there.
    pub ending: &'static str,
    /// The file.
    pub bytes: Vec<u8>,
}

impl Packed {
    /// Its name in the FMU of a model.
    pub fn name(&self, model: &str) -> String {
        format!("binaries/{}/{model}{}", self.folder, self.ending)
    }
}

/// A binary for the platform this program runs on.
fn native(binary: &Path) -> Result<Packed> {
    let bytes =
        std::fs::read(binary).with_context(|| format!("{} cannot be read", binary.display()))?;
    Ok(Packed { folder: PLATFORM, ending: std::env::consts::DLL_SUFFIX, bytes })
}

/// The packed FMU for tests: built and packed once per process to `test-fmu/HubSlosh.fmu` in the
/// target directory. Processes do not disturb each other: each renames its own whole file there,
/// and all of them hold the same bytes.
///
/// # Panics
/// If it cannot be built.
pub fn packed_for_tests() -> &'static Path {
    static PACKED: OnceLock<PathBuf> = OnceLock::new();
    PACKED.get_or_init(|| {
        let packed = build(true).and_then(|binary| {
            // <target>/<profile>/<binary>
            let target = binary.ancestors().nth(2).context("no target directory")?;
            let out = target.join("test-fmu").join("HubSlosh.fmu");
            archive(&[native(&binary)?], &out)?;
            Ok(out)
        });
        packed
            .unwrap_or_else(|error| panic!("the FMU for the tests could not be packed: {error:#}"))
    })
}

/// Builds for the platform this program runs on and returns where Cargo put the binary.
fn build(quiet: bool) -> Result<PathBuf> {
    let mut command = cargo();
    command.arg("rustc");
    arguments(&mut command);
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
pub(crate) fn arguments(command: &mut Command) {
    command.args(["--profile", PROFILE, "--package", PACKAGE, "--lib", "--crate-type", "cdylib"]);
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
    String::from_utf8_lossy(&built.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|message| message["reason"] == "compiler-artifact")
        .filter(|message| message["target"]["kind"][0] == "cdylib")
        .flat_map(|message| message["filenames"].as_array().cloned().unwrap_or_default())
        .filter_map(|name| name.as_str().map(PathBuf::from))
        .find(|name| {
            let ending = name.extension().unwrap_or_default();
            ["so", "dll", "dylib"].iter().any(|library| ending == *library)
        })
        .context("cargo built the FMU but does not say where its binary is")
}

/// Packs binaries; the file appears whole or not at all.
fn archive(binaries: &[Packed], out: &Path) -> Result<()> {
    let files = files(binaries)?;
    if let Some(parent) = out.parent().filter(|parent| !parent.as_os_str().is_empty()) {
        output::directory(parent)?;
    }
    output::atomically(out, |file| zip(file, &files))
        .with_context(|| format!("{} was not packed", out.display()))
}

/// What is in the FMU, in the order of the archive; modelDescription.xml first, as some hosts
/// expect.
fn files(binaries: &[Packed]) -> Result<Vec<(String, Vec<u8>)>> {
    let root = root();
    let source = root.join("modelDescription").join("HubSlosh");
    let read = |path: PathBuf| {
        std::fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))
    };
    let xml = read(source.join("modelDescription.xml"))?;
    let description = ModelDescription::from_xml(&String::from_utf8_lossy(&xml))?;
    let identifier = description
        .co_simulation
        .as_ref()
        .map(|c| c.model_identifier.clone())
        .context("modelDescription.xml offers no co-simulation")?;
    let icon = read(source.join("terminalsAndIcons").join("icon.png"))?;
    let mut files =
        vec![("modelDescription.xml".to_string(), xml), ("model.png".to_string(), icon.clone())];
    for binary in binaries {
        files.push((binary.name(&identifier), binary.bytes.clone()));
    }

    let title = format!("{} {}", description.model_name, description.version);
    let pages = documentation::render(&source.join("documentation"), &title)?;
    files.push(("documentation/index.html".into(), pages.page.into_bytes()));
    for (name, figure) in pages.figures {
        files.push((format!("documentation/{name}"), figure));
    }

    let components = components::linked(binaries)?;
    let note = components::licence_note(&description, &components);
    files.push(("documentation/licenses/license.txt".into(), note.into_bytes()));
    let texts: BTreeSet<_> = components.iter().flat_map(|component| &component.texts).collect();
    for text in texts {
        let own = components::OWN_TEXTS.contains(&text.as_str());
        let folder = if own { root.clone() } else { root.join("modelDescription/licenses") };
        files.push((format!("documentation/licenses/{text}"), read(folder.join(text))?));
    }

    files.push(("terminalsAndIcons/icon.png".into(), icon));
    for name in ["terminalsAndIcons/icon.svg", "terminalsAndIcons/terminalsAndIcons.xml"] {
        files.push((name.into(), read(source.join(name))?));
    }
    for name in example::FILES {
        files.push((format!("{EXTRA}/{name}"), read(source.join(EXTRA).join(name))?));
    }
    let bill = components::bill(&description, binaries, &components);
    files.push((BILL.into(), bill.into_bytes()));
    Ok(files)
}

/// Same files, same bytes: order, times and attributes are fixed.
fn zip(out: &mut (impl Write + Seek), files: &[(String, Vec<u8>)]) -> Result<()> {
    let mut archive = ZipWriter::new(out);
    for (name, bytes) in files {
        let mode = if name.starts_with("binaries/") { 0o755 } else { 0o644 };
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(9)) // the release must stay below 2 MB
            .last_modified_time(DateTime::default()) // 1980-01-01, the oldest a zip can say
            .unix_permissions(mode);
        archive.start_file(name.as_str(), options)?;
        archive.write_all(bytes)?;
    }
    archive.finish()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn the_same_files_give_the_same_bytes_in_the_given_order() {
        let files =
            [("b.txt".to_string(), b"two".to_vec()), ("binaries/a".to_string(), vec![0; 9999])];
        let packed = || {
            let mut out = Cursor::new(Vec::new());
            zip(&mut out, &files).unwrap();
            out.into_inner()
        };
        assert_eq!(packed(), packed());
        let archive = zip::ZipArchive::new(Cursor::new(packed())).unwrap();
        let names: Vec<_> = archive.file_names().flatten().map(|n| n.into_owned()).collect();
        assert_eq!(names, ["b.txt", "binaries/a"]);
    }
}

//! Builds the FMU's binary and packs it, with its description, its
//! documentation and its licences, into a `.fmu` (FMI 2.0, section 2.3).

use std::fmt::Write as _;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use anyhow::{Context, Result, bail};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::description::ModelDescription;
use crate::fmi2::PLATFORM;
use crate::html::escape;
use crate::output;
use crate::platforms::{self, Built};

/// Cargo package of the FMU's binary.
const PACKAGE: &str = "hubslosh-fmu";
/// Cargo profile it is built with.
const PROFILE: &str = "fmu";
/// Licence texts at the project's root that travel with the FMU.
const LICENCES: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];

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
    let binaries: Vec<_> = all.iter().map(|b| (b.folder, b.ending, b.bytes.clone())).collect();
    archive(&binaries, out)?;
    Ok(all)
}

/// A binary with its folder under `binaries/` and the ending of its name there.
type Packed = (&'static str, &'static str, Vec<u8>);

/// A binary for the platform this program runs on.
fn native(binary: &Path) -> Result<Packed> {
    let bytes =
        std::fs::read(binary).with_context(|| format!("{} cannot be read", binary.display()))?;
    Ok((PLATFORM, std::env::consts::DLL_SUFFIX, bytes))
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
pub(crate) fn arguments(command: &mut Command) {
    command.args(["--profile", PROFILE, "--package", PACKAGE, "--lib", "--crate-type", "cdylib"]);
    command.args(["--message-format", "json-render-diagnostics"]);
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
    let root = root();
    let read = |path: PathBuf| {
        std::fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))
    };
    let xml = read(root.join("modelDescription").join("modelDescription.xml"))?;
    let description = ModelDescription::from_xml(&String::from_utf8_lossy(&xml))?;
    let identifier = description
        .co_simulation
        .as_ref()
        .map(|c| c.model_identifier.clone())
        .context("modelDescription.xml offers no co-simulation")?;
    // the order of the archive; modelDescription.xml first, as some hosts expect
    let mut files = vec![("modelDescription.xml".to_string(), xml)];
    for (folder, ending, bytes) in binaries {
        files.push((format!("binaries/{folder}/{identifier}{ending}"), bytes.clone()));
    }
    files.push(("documentation/index.html".to_string(), documentation(&description).into_bytes()));
    for licence in LICENCES {
        files.push((format!("documentation/licenses/{licence}"), read(root.join(licence))?));
    }
    if let Some(parent) = out.parent().filter(|parent| !parent.as_os_str().is_empty()) {
        output::directory(parent)?;
    }
    output::atomically(out, |file| zip(file, &files))
        .with_context(|| format!("{} was not packed", out.display()))
}

/// Same files, same bytes: order, times and attributes are fixed.
fn zip(out: &mut (impl Write + Seek), files: &[(String, Vec<u8>)]) -> Result<()> {
    let mut archive = ZipWriter::new(out);
    for (name, bytes) in files {
        let mode = if name.starts_with("binaries/") { 0o755 } else { 0o644 };
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .last_modified_time(DateTime::default()) // 1980-01-01, the oldest a zip can say
            .unix_permissions(mode);
        archive.start_file(name.as_str(), options)?;
        archive.write_all(bytes)?;
    }
    archive.finish()?;
    Ok(())
}

/// `documentation/index.html`: what the model is and a table of its variables, made from the
/// model description so that the two cannot drift apart.
fn documentation(description: &ModelDescription) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<title>{name}</title>\n<style>\
         :root{{color-scheme:light dark}}body{{font:15px/1.5 system-ui,sans-serif;max-width:70em;margin:2em auto;padding:0 1em}}\
         table{{border-collapse:collapse;width:100%}}th,td{{text-align:left;padding:.25em .6em;border-bottom:1px solid #8884;vertical-align:top}}\
         code{{white-space:nowrap}}</style></head><body>\n<h1>{name} {version}</h1>\n<p>{text}</p>\n\
         <p>FMI {fmi} co-simulation. A spacecraft hub turns by the angle <code>theta</code> about a vertical axis; a tank \
         stands at the distance <code>tank.r</code> from it. Angles and torques are positive counter-clockwise seen from above; \
         <code>slosh_angle</code> is positive when the liquid is displaced towards +<code>theta</code>, \
         <code>slosh_angle_radial</code> when it is displaced outwards. All values are exchanged in the units given here.</p>\n\
         <p><code>tau_cmd</code> is held over a communication step unless the host sets its first derivative \
         (fmi2SetRealInputDerivatives), which makes it linear over the step. Any communication step size gives the same motion \
         within the tolerance for the same torque.</p>\n",
        name = escape(&description.model_name),
        version = escape(&description.version),
        text = escape(&description.description),
        fmi = escape(&description.fmi_version),
    );
    for (causality, title) in [
        ("input", "Inputs"),
        ("output", "Outputs"),
        ("parameter", "Parameters"),
        ("calculatedParameter", "Calculated parameters"),
        ("local", "Local variables"),
    ] {
        let variables: Vec<_> =
            description.variables.list.iter().filter(|v| v.causality == causality).collect();
        if variables.is_empty() {
            continue;
        }
        let _ = writeln!(
            page,
            "<h2>{title}</h2>\n<table><tr><th>Name</th><th>Unit</th><th>Start</th><th>Meaning</th></tr>"
        );
        for variable in variables {
            let attributes = variable.attributes();
            let start = attributes.start.as_deref().unwrap_or("");
            let items = description.items(variable);
            let named = items.iter().find(|i| i.value.to_string() == start);
            let mut meaning = escape(&variable.description);
            if !items.is_empty() {
                let all: Vec<_> =
                    items.iter().map(|i| format!("{} = {}", i.value, i.name)).collect();
                let _ = write!(meaning, " <small>({})</small>", escape(&all.join(", ")));
            }
            let _ = writeln!(
                page,
                "<tr><td><code>{}</code></td><td>{}</td><td>{}</td><td>{meaning}</td></tr>",
                escape(&variable.name),
                escape(attributes.unit.as_deref().unwrap_or("")),
                escape(named.map_or(start, |i| &i.name)),
            );
        }
        page.push_str("</table>\n");
    }
    page.push_str("</body></html>\n");
    page
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

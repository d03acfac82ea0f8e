//! Builds the FMU's binary and packs it, with all that should travel with it, into a `.fmu`
//! (FMI 2.0, section 2.3).

pub mod components;
pub mod documentation;
pub mod platforms;
mod project;
pub mod release;

use std::collections::BTreeSet;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::{Context, Result};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use host::description::ModelDescription;
use host::fmi2::PLATFORM;
use host::output;

pub use crate::components::Packed;
pub use crate::platforms::Built;
use crate::project::build;
pub use crate::project::root;

/// Folder below the FMU's `extra`: the model's name, where FMI asks for a domain turned round.
/// The project has no domain, and another's is not to be taken.
pub const EXTRA: &str = "extra/HubSlosh";
/// The software bill of materials in the FMU.
pub const BILL: &str = "extra/HubSlosh/HubSlosh.cdx.json";

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
    for name in names(&source.join(EXTRA))? {
        files.push((format!("{EXTRA}/{name}"), read(source.join(EXTRA).join(&name))?));
    }
    let bill = components::bill(&description, binaries, &components);
    files.push((BILL.into(), bill.into_bytes()));
    Ok(files)
}

/// Names of the files in a folder, sorted.
fn names(folder: &Path) -> Result<Vec<String>> {
    let cannot = || format!("{} cannot be read", folder.display());
    let entries: Vec<_> = folder.read_dir().with_context(cannot)?.collect::<Result<_, _>>()?;
    let names = entries.iter().map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.collect();
    names.sort();
    Ok(names)
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

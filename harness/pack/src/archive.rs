//! Writes the `.fmu` as a zip archive (FMI 2.0, section 2.3). Equal files give byte-identical archives.

use std::io::{Seek, Write};
use std::path::Path;

use anyhow::{Context, Result};
use files::output;
use host::binary;
use host::fmi2::PLATFORM;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::fmi::Fmi;

/// Files of an archive in their order: name and content of each. modelDescription.xml comes first,
/// because some hosts expect it there.
pub type Files = Vec<(String, Vec<u8>)>;

pub struct Packed {
    pub folder: &'static str,
    pub ending: &'static str,
    pub bytes: Vec<u8>,
}

impl Packed {
    pub fn native(binary: &Path) -> Result<Packed> {
        let bytes = read(binary)?;
        Ok(Packed { folder: PLATFORM, ending: std::env::consts::DLL_SUFFIX, bytes })
    }

    pub fn name(&self, identifier: &str) -> String {
        format!("binaries/{}/{identifier}{}", self.folder, self.ending)
    }

    /// Returns the paths of this binary in an FMU of the version `fmi`, each with its bytes.
    /// `identifier` is the modelIdentifier. A folder for one processor gets only the part of a
    /// universal binary for this processor.
    pub fn files(&self, identifier: &str, fmi: Fmi) -> impl Iterator<Item = (String, &[u8])> {
        fmi.folders(self.folder).iter().map(move |folder| {
            let bytes = match folder.strip_suffix("-darwin") {
                Some("aarch64") => binary::part(&self.bytes, "arm64"),
                Some(processor) => binary::part(&self.bytes, processor),
                None => &self.bytes,
            };
            (format!("binaries/{folder}/{identifier}{}", self.ending), bytes)
        })
    }
}

/// Packs an FMU for this platform to `out`. `xml` is its modelDescription.xml, `binary` the path of
/// its library, and `identifier` the modelIdentifier. Every file below the folder `extra` is packed
/// under its path relative to this folder, for example `resources/a.txt`.
///
/// # Errors
///
/// If a file cannot be read or written.
pub fn plain(
    xml: &str,
    binary: &Path,
    identifier: &str,
    extra: Option<&Path>,
    out: &Path,
) -> Result<()> {
    let binary = Packed::native(binary)?;
    let mut files = vec![
        ("modelDescription.xml".to_string(), xml.as_bytes().to_vec()),
        (binary.name(identifier), binary.bytes),
    ];
    if let Some(folder) = extra {
        files.extend(below(folder)?);
    }
    write(&files, out)
}

pub fn zipped(files: &[(String, Vec<u8>)]) -> Result<Vec<u8>> {
    let mut out = std::io::Cursor::new(Vec::new());
    zip(&mut out, files)?;
    Ok(out.into_inner())
}

/// Packs files into the archive `out`, which is either written completely or not at all.
pub fn write(files: &Files, out: &Path) -> Result<()> {
    if let Some(parent) = out.parent().filter(|parent| !parent.as_os_str().is_empty()) {
        output::directory(parent)?;
    }
    output::atomically(out, |file| zip(file, files))
        .with_context(|| format!("{} was not packed", out.display()))
}

pub fn below(folder: &Path) -> Result<Files> {
    let mut entries: Vec<_> = folder
        .read_dir()
        .and_then(|entries| entries.collect::<Result<Vec<_>, _>>())
        .with_context(|| format!("{} cannot be read", folder.display()))?;
    entries.sort_by_key(|entry| entry.file_name());
    let mut files = Files::new();
    for entry in entries {
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            let inner = below(&entry.path())?;
            files
                .extend(inner.into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)));
        } else {
            files.push((name, read(&entry.path())?));
        }
    }
    Ok(files)
}

pub fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| format!("{} cannot be read", path.display()))
}

/// Writes a zip archive of `files` to `out`. The order of the files, their times and their
/// attributes are fixed, so that equal files give equal archives.
fn zip(out: &mut (impl Write + Seek), files: &[(String, Vec<u8>)]) -> Result<()> {
    let mut archive = ZipWriter::new(out);
    for (name, bytes) in files {
        // The binaries of an FMU and the command in a wheel are executable.
        let program = name.starts_with("binaries/") || name.contains(".data/scripts/");
        let mode = if program { 0o755 } else { 0o644 };
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(9)) // the highest of deflate
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
    fn packing_equal_files_gives_identical_archives_with_the_files_in_the_given_order() {
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

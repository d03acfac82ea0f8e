//! Makes the files of a release: each FMU for all platforms, of every kind ([`Fmi::ALL`]), with its SBOM and the
//! report of its check; then the wheels' SBOM and the wheel for Linux. [`MANIFEST`] lists the SHA-256 of all files of
//! the release, [`PRESENT`] the SHA-256 of the files that are in the folder.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use files::output::{self, sha256};

use crate::metadata::{PACKAGE, VERSION};
use crate::platforms::{Built, PLATFORMS};
use crate::{Fmi, Model, pack_built, platforms, wheel};

/// Name of the list of the files that the release folder contains, with their SHA-256, in the
/// format of `sha256sum --check`.
pub const PRESENT: &str = "SHA256SUMS";

/// Name of the list of files of all releases, with their SHA-256. It contains the files in
/// [`PRESENT`], files of older versions, and wheels that are published, but not kept in the folder.
pub const MANIFEST: &str = "SHA256SUMS.all";

/// Largest wheel for Linux that is kept in the folder of the release, bytes. The size is limited
/// because the wheel stays in the project's history forever. The present wheel has 17.0 MB: 6.6 MB
/// for the command, 7.7 MB for the nine FMUs and 2.3 MB for the library of the package. The two
/// FMUs 3.0 of a model repeat the binary of its FMU 2.0, because a zip archive cannot share it.
pub const LARGEST_WHEEL: u64 = 20_000_000;

pub fn read(fmu: &Path, name: &str) -> Result<Vec<u8>> {
    let cannot = || format!("{name} in {} cannot be read", fmu.display());
    let file = std::fs::File::open(fmu).with_context(cannot)?;
    let mut archive = zip::ZipArchive::new(file).with_context(cannot)?;
    let mut bytes = Vec::new();
    archive.by_name(name).with_context(cannot)?.read_to_end(&mut bytes).with_context(cannot)?;
    Ok(bytes)
}

/// Returns the path of an FMU of the present version in `folder`: `NAME-VERSION.fmu`, for FMI 3.0
/// `NAME-VERSION-fmi3.fmu` and `NAME-VERSION-fmi3-arrays.fmu`.
pub fn path(model: &Model, fmi: Fmi, folder: &Path) -> PathBuf {
    fmi.path(folder, &format!("{}-{}", model.name, env!("CARGO_PKG_VERSION")))
}

/// Builds an FMU for all platforms, checks it with `check`, and writes its files to `folder`. For
/// each version of FMI these are the FMU, its SBOM (`.cdx.json`) and the report (`.check.txt`) that
/// `check` returns. Also updates [`MANIFEST`], removes the files of older versions, and returns the
/// paths of the written files. If `check` refuses the FMU of one version, nothing is written.
pub fn write(
    model: &Model,
    folder: &Path,
    check: impl Fn(&Path) -> Result<String>,
) -> Result<Vec<PathBuf>> {
    let all = platforms::build(&PLATFORMS.each_ref(), model)?;
    for built in &all {
        eprintln!("{}: {}", built.folder, built.binary);
    }
    let mut files = Vec::new();
    for fmi in Fmi::ALL {
        let fmu = path(model, fmi, folder);
        for (ending, bytes) in version_files(model, fmi, &all, &check)? {
            files.push((file_name(&fmu.with_extension(ending)), bytes));
        }
    }
    record(folder, model.name, &files, &[])
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns `true` if `file` belongs to this version of the product `name`: its name is
/// `NAME-VERSION` followed by `-` or `.`.
fn belongs_to(file: &str, name: &str, version: &str) -> bool {
    let rest = file.strip_prefix(name).and_then(|rest| rest.strip_prefix('-'));
    rest.and_then(|rest| rest.strip_prefix(version))
        .is_some_and(|rest| rest.starts_with(['-', '.']))
}

/// Writes `files` of the present version of the product `name` to `folder`. Also updates the
/// entries of this version in [`MANIFEST`], with these files and with `elsewhere`, the names and
/// SHA-256 of files that the folder does not keep. Removes files of `name` that are no longer kept,
/// and returns the paths of the written files.
///
/// # Errors
///
/// If a file cannot be read or written. Files are removed last.
fn record(
    folder: &Path,
    name: &str,
    files: &[(String, Vec<u8>)],
    elsewhere: &[(String, String)],
) -> Result<Vec<PathBuf>> {
    output::directory(folder)?;
    let manifest = folder.join(MANIFEST);
    let cannot = || format!("{} cannot be read", manifest.display());
    let old = match manifest.exists() {
        true => std::fs::read_to_string(&manifest).with_context(cannot)?,
        false => String::new(),
    };
    let listed = |line: &str| line.split_once("  ").map(|(_, file)| file.to_string());
    let is_own = |file: &String| file.strip_prefix(name).is_some_and(|rest| rest.starts_with('-'));
    let mut lines: Vec<String> = old.lines().map(String::from).collect();
    lines.retain(|line| !listed(line).is_some_and(|file| belongs_to(&file, name, VERSION)));
    let mut new: Vec<String> =
        files.iter().map(|(file, bytes)| format!("{}  {file}", sha256(bytes))).collect();
    new.extend(elsewhere.iter().map(|(file, hash)| format!("{hash}  {file}")));
    let own = lines.iter().rposition(|line| listed(line).is_some_and(|file| is_own(&file)));
    let place = own.map_or(lines.len(), |last| last + 1);
    lines.splice(place..place, new);
    let mut written = Vec::new();
    for (file, bytes) in files {
        let path = folder.join(file);
        output::write(&path, bytes)?;
        written.push(path);
    }
    output::write(&manifest, (lines.join("\n") + "\n").as_bytes())?;
    for file in old.lines().filter_map(listed).filter(is_own) {
        let path = folder.join(&file);
        if !files.iter().any(|(kept, _)| *kept == file) && path.is_file() {
            let cannot = || format!("{} cannot be removed", path.display());
            std::fs::remove_file(&path).with_context(cannot)?;
        }
    }
    let is_there = |line: &&String| listed(line).is_some_and(|file| folder.join(file).is_file());
    let present: Vec<&str> = lines.iter().filter(is_there).map(String::as_str).collect();
    let list = folder.join(PRESENT);
    output::write(&list, (present.join("\n") + "\n").as_bytes())?;
    written.extend([manifest, list]);
    Ok(written)
}

fn version_files(
    model: &Model,
    fmi: Fmi,
    all: &[Built],
    check: impl Fn(&Path) -> Result<String>,
) -> Result<[(&'static str, Vec<u8>); 3]> {
    let made = tempfile::tempdir().context("no temporary folder can be made")?;
    let fmu = path(model, fmi, made.path());
    pack_built(model, fmi, all, &fmu)?;
    let bytes = std::fs::read(&fmu).with_context(|| format!("{} cannot be read", fmu.display()))?;
    let report = check(&fmu)?;
    let sbom = read(&fmu, &model.sbom())?;
    Ok([("fmu", bytes), ("cdx.json", sbom), ("check.txt", report.into_bytes())])
}

/// Builds the wheels of all platforms in the folder `made` and lists them in [`MANIFEST`] of
/// `folder`. To `folder` it writes their SBOM, and the wheel for Linux on x86-64 unless it is
/// larger than [`LARGEST_WHEEL`]. It removes the wheel of an older version, and returns the paths
/// of the files in `folder`.
pub fn write_wheels(made: &Path, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut wheels = wheel::write_for(&PLATFORMS.each_ref(), made)?;
    wheels.sort();
    let (mut kept, mut elsewhere, mut sboms) = (Vec::new(), Vec::new(), Vec::new());
    for path in &wheels {
        let bytes =
            std::fs::read(path).with_context(|| format!("{} cannot be read", path.display()))?;
        let name = file_name(path);
        sboms.push(read(path, &wheel::sbom_name())?);
        let is_kept = name.contains("manylinux") && name.contains("x86_64");
        if is_kept && bytes.len() as u64 <= LARGEST_WHEEL {
            kept.push((name, bytes));
            continue;
        }
        if is_kept {
            eprintln!(
                "{} has {} bytes and is not kept in {} (allowed: at most {LARGEST_WHEEL} bytes)",
                path.display(),
                bytes.len(),
                folder.display()
            );
        }
        elsewhere.push((name, sha256(&bytes)));
    }
    for (path, sbom) in wheels.iter().zip(sboms) {
        kept.push((format!("{}.cdx.json", file_name(path)), sbom));
    }
    record(folder, PACKAGE, &kept, &elsewhere)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_release_replaces_the_files_of_the_previous_release_and_keeps_their_hashes() {
        let folder = tempfile::tempdir().unwrap();
        let there = |name: &str| folder.path().join(name).exists();
        let old =
            "1  A-0.0.1.fmu\n2  A-0.0.1.check.txt\n3  AB-0.0.1.fmu\n4  hubslosh-0.0.1-a.whl\n";
        std::fs::write(folder.path().join(MANIFEST), old).unwrap();
        for name in ["A-0.0.1.fmu", "A-0.0.1.check.txt", "AB-0.0.1.fmu", "A-notes.txt"] {
            std::fs::write(folder.path().join(name), "old").unwrap();
        }
        let fmu = |ending: &str, text: &str| (format!("A-{VERSION}{ending}"), text.into());
        let elsewhere = [(format!("A-{VERSION}-b.whl"), "5".to_string())];
        record(folder.path(), "A", &[fmu(".fmu", "1"), fmu("-fmi3.fmu", "1")], &elsewhere).unwrap();
        // the same version again, without one of the files
        record(folder.path(), "A", &[fmu(".fmu", "2")], &elsewhere).unwrap();
        assert!(!there("A-0.0.1.fmu") && !there("A-0.0.1.check.txt"));
        assert!(there("AB-0.0.1.fmu") && there("A-notes.txt"));
        assert!(there(&format!("A-{VERSION}.fmu")) && !there(&format!("A-{VERSION}-fmi3.fmu")));
        let list = std::fs::read_to_string(folder.path().join(MANIFEST)).unwrap();
        let hash = sha256(b"2");
        let wanted = format!(
            "1  A-0.0.1.fmu\n2  A-0.0.1.check.txt\n{hash}  A-{VERSION}.fmu\n5  A-{VERSION}-b.whl\n3  AB-0.0.1.fmu\n4  \
             hubslosh-0.0.1-a.whl\n"
        );
        assert_eq!(list, wanted);
        let present = std::fs::read_to_string(folder.path().join(PRESENT)).unwrap();
        assert_eq!(present, format!("{hash}  A-{VERSION}.fmu\n3  AB-0.0.1.fmu\n"));
    }
}

//! A release to take away: the FMU for all platforms in both versions of FMI, its hash, its SBOM and the
//! report of its check; the wheels' hashes, and that for Linux itself.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use host::output::{self, sha256};

use crate::metadata::{PACKAGE, VERSION};
use crate::platforms::{Built, PLATFORMS};
use crate::{Fmi, Model, pack_built, platforms, wheel};

/// Bytes up to which the wheel for Linux is in the release, for it lies in the project's history forever. Of 13 MB the command has 8,
/// the FMUs of both versions of FMI 5.
pub const LARGEST_WHEEL: u64 = 14_000_000;

/// One file of an FMU.
pub fn read(fmu: &Path, name: &str) -> Result<Vec<u8>> {
    let cannot = || format!("{name} in {} cannot be read", fmu.display());
    let file = std::fs::File::open(fmu).with_context(cannot)?;
    let mut archive = zip::ZipArchive::new(file).with_context(cannot)?;
    let mut bytes = Vec::new();
    archive.by_name(name).with_context(cannot)?.read_to_end(&mut bytes).with_context(cannot)?;
    Ok(bytes)
}

/// Where the release of the present version of an FMU is, in `folder`: `NAME-VERSION.fmu`, of FMI 3.0
/// `NAME-VERSION-fmi3.fmu`.
pub fn path(model: &Model, fmi: Fmi, folder: &Path) -> PathBuf {
    fmi.path(folder, &format!("{}-{}", model.name, env!("CARGO_PKG_VERSION")))
}

/// Builds for all platforms, checks, and writes the release's files to `folder`, for each version of FMI: the FMU,
/// `.sha256`, as `sha256sum --check` reads it, `.cdx.json`, and the report of the check, which
/// `check` returns. Returns what was written. If `check` refuses the FMU of one version, neither is released.
pub fn write(
    model: &Model,
    folder: &Path,
    check: impl Fn(&Path) -> Result<String>,
) -> Result<Vec<PathBuf>> {
    let all = platforms::build(model)?;
    for built in &all {
        eprintln!("{}: {}", built.folder, built.binary);
    }
    let mut files = Vec::new();
    for fmi in Fmi::RELEASED {
        let fmu = path(model, fmi, folder);
        for (ending, bytes) in of_version(model, fmi, &all, &check)? {
            files.push((fmu.with_extension(ending), bytes));
        }
    }
    output::directory(folder)?;
    for (path, bytes) in &files {
        output::atomically(path, |file| Ok(file.write_all(bytes)?))?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

/// The release's files of one version of FMI: endings of their names, and bytes.
fn of_version(
    model: &Model,
    fmi: Fmi,
    all: &[Built],
    check: impl Fn(&Path) -> Result<String>,
) -> Result<[(&'static str, Vec<u8>); 4]> {
    let made = tempfile::tempdir().context("there is no place for temporary files")?;
    let fmu = path(model, fmi, made.path());
    pack_built(model, fmi, all, &fmu)?;
    let bytes = std::fs::read(&fmu).with_context(|| format!("{} cannot be read", fmu.display()))?;
    let name = fmu.file_name().unwrap_or_default().to_string_lossy();
    let hash = format!("{}  {name}\n", sha256(&bytes));
    let report = check(&fmu)?;
    let sbom = read(&fmu, &model.sbom())?;
    Ok([
        ("fmu", bytes),
        ("fmu.sha256", hash.into_bytes()),
        ("cdx.json", sbom),
        ("check.txt", report.into_bytes()),
    ])
}

/// Where the hashes of the present version's wheels are, in `folder`, as `sha256sum --check` reads them.
pub fn wheel_hashes(folder: &Path) -> PathBuf {
    folder.join(format!("{PACKAGE}-{VERSION}.sha256"))
}

/// Builds the wheels of all platforms to `made`, and writes their hashes to `folder`, with the wheel
/// for Linux on x86-64 if it is not larger than [`LARGEST_WHEEL`]; an older version's wheel is removed. Returns
/// what was written there.
pub fn write_wheels(made: &Path, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut wheels = wheel::write_for(&PLATFORMS.each_ref(), made)?;
    wheels.sort();
    let mut hashes = String::new();
    let mut linux = None;
    for path in &wheels {
        let bytes =
            std::fs::read(path).with_context(|| format!("{} cannot be read", path.display()))?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        hashes += &format!("{}  {name}\n", sha256(&bytes));
        if name.contains("manylinux") && name.contains("x86_64") {
            linux = Some((folder.join(&*name), bytes));
        }
    }
    output::directory(folder)?;
    for entry in folder.read_dir()?.flatten() {
        if entry.path().extension().is_some_and(|ending| ending == "whl") {
            std::fs::remove_file(entry.path())?;
        }
    }
    let mut written = vec![wheel_hashes(folder)];
    output::atomically(&written[0], |file| Ok(file.write_all(hashes.as_bytes())?))?;
    if let Some((path, bytes)) = linux {
        if bytes.len() as u64 <= LARGEST_WHEEL {
            output::atomically(&path, |file| Ok(file.write_all(&bytes)?))?;
            written.push(path);
        } else {
            eprintln!(
                "{} has {} bytes and is not kept in {} (allowed: {LARGEST_WHEEL})",
                path.display(),
                bytes.len(),
                folder.display()
            );
        }
    }
    Ok(written)
}

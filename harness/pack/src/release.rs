//! A release to take away: the FMU for all platforms, its hash, its SBOM and the
//! report of its check.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use host::output::{self, sha256};

use crate::{Model, pack_all};

/// One file of an FMU.
pub fn read(fmu: &Path, name: &str) -> Result<Vec<u8>> {
    let cannot = || format!("{name} in {} cannot be read", fmu.display());
    let file = std::fs::File::open(fmu).with_context(cannot)?;
    let mut archive = zip::ZipArchive::new(file).with_context(cannot)?;
    let mut bytes = Vec::new();
    archive.by_name(name).with_context(cannot)?.read_to_end(&mut bytes).with_context(cannot)?;
    Ok(bytes)
}

/// Where the release of the present version of an FMU is, in `folder`.
pub fn path(model: &Model, folder: &Path) -> PathBuf {
    folder.join(format!("{}-{}.fmu", model.name, env!("CARGO_PKG_VERSION")))
}

/// Builds for all platforms, checks, and writes the release's files to `folder`: the FMU,
/// `.sha256`, as `sha256sum --check` reads it, `.cdx.json`, and the report of the check, which
/// `check` returns. Returns what was written; an FMU that `check` refuses is not released.
pub fn write(
    model: &Model,
    folder: &Path,
    check: impl FnOnce(&Path) -> Result<String>,
) -> Result<Vec<PathBuf>> {
    let made = tempfile::tempdir().context("there is no place for temporary files")?;
    let fmu = path(model, made.path());
    for built in pack_all(model, &fmu)? {
        eprintln!("{}: {}", built.folder, built.binary);
    }
    let bytes = std::fs::read(&fmu).with_context(|| format!("{} cannot be read", fmu.display()))?;
    let name = fmu.file_name().unwrap_or_default().to_string_lossy();
    let hash = format!("{}  {name}\n", sha256(&bytes));
    let report = check(&fmu)?;
    let sbom = read(&fmu, &model.sbom())?;
    let files = [
        ("fmu", bytes),
        ("fmu.sha256", hash.into_bytes()),
        ("cdx.json", sbom),
        ("check.txt", report.into_bytes()),
    ];
    output::directory(folder)?;
    let mut written = Vec::new();
    for (ending, bytes) in files {
        let path = path(model, folder).with_extension(ending);
        output::atomically(&path, |file| Ok(file.write_all(&bytes)?))?;
        written.push(path);
    }
    Ok(written)
}

//! A release to take away: the FMU for all platforms, its hash and its bill of materials.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::components;
use crate::pack;

/// One file of an FMU.
pub fn read(fmu: &Path, name: &str) -> Result<Vec<u8>> {
    let cannot = || format!("{name} in {} cannot be read", fmu.display());
    let file = std::fs::File::open(fmu).with_context(cannot)?;
    let mut archive = zip::ZipArchive::new(file).with_context(cannot)?;
    let mut bytes = Vec::new();
    archive.by_name(name).with_context(cannot)?.read_to_end(&mut bytes).with_context(cannot)?;
    Ok(bytes)
}

/// Where the release of the present version is, in `folder`.
pub fn path(folder: &Path) -> PathBuf {
    folder.join(format!("HubSlosh-{}.fmu", env!("CARGO_PKG_VERSION")))
}

/// Builds for all platforms and writes the release's files to `folder`: the FMU, `.sha256`, as
/// `sha256sum --check` reads it, and `.cdx.json`. Returns what was written.
pub fn write(folder: &Path) -> Result<Vec<PathBuf>> {
    let fmu = path(folder);
    for built in pack::pack_all(&fmu)? {
        eprintln!("{}: {}", built.folder, built.binary);
    }
    let bytes = std::fs::read(&fmu).with_context(|| format!("{} cannot be read", fmu.display()))?;
    let name = fmu.file_name().unwrap_or_default().to_string_lossy();
    let hash = format!("{}  {name}\n", components::sha256(&bytes));
    let beside = [
        (fmu.with_extension("fmu.sha256"), hash.into_bytes()),
        (fmu.with_extension("cdx.json"), read(&fmu, pack::BILL)?),
    ];
    let mut written = vec![fmu];
    for (path, bytes) in beside {
        std::fs::write(&path, bytes)
            .with_context(|| format!("{} was not written", path.display()))?;
        written.push(path);
    }
    Ok(written)
}

//! Packs FMUs that have only part of the variables and the same binary; see [`host::part`].

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use host::archive::{Archive, DESCRIPTION};
use host::part::{Limit, START_VALUES, describe};

use crate::archive::{self, Files};

/// Writes an FMU to `out` that has only those variables of `fmu` that are within `limits`, for
/// example the variables of one tank. Its binary is the binary of `fmu`. `starts` has start values
/// by name that replace the start values in the description.
///
/// # Errors
///
/// Errors of [`describe`], and if the FMU cannot be read or `out` cannot be written.
pub fn pack(
    fmu: &Path,
    limits: &[Limit],
    starts: &BTreeMap<String, String>,
    out: &Path,
) -> Result<()> {
    let whole = Archive::open(fmu)?;
    whole.check()?;
    let mut files = Files::new();
    for entry in whole.entries.iter().filter(|entry| !entry.is_folder()) {
        files.push((entry.name.clone(), whole.content(entry)?));
    }
    let description = files.iter_mut().find(|(name, _)| name == DESCRIPTION);
    let (_, xml) = description.with_context(|| format!("{} has no description", fmu.display()))?;
    let part = describe(&String::from_utf8_lossy(xml), limits, starts)
        .with_context(|| fmu.display().to_string())?;
    *xml = part.xml.into_bytes();
    files.extend(part.start_values.map(|text| (START_VALUES.to_string(), text.into_bytes())));
    archive::write(&files, out)
}

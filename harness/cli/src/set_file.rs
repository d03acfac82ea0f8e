//! Reads a file of parameters as settings of an FMU.

use std::path::Path;

use anyhow::{Context, Result};
use host::description::ModelDescription;
use host::parameter_set::ParameterSet;

/// Function that returns the description of the FMU for which a file of parameters is meant. Values
/// of the file are converted to the units in this description.
pub type Describe<'a> = &'a dyn Fn() -> Result<ModelDescription>;

/// Reads names and values from a file of parameters, in the order of the file. Numbers are
/// converted to the units of the FMU.
///
/// # Errors
///
/// If the file or the description cannot be read, or a unit does not belong to its variable.
pub fn read(path: &Path, description: Describe) -> Result<Vec<(String, String)>> {
    let found = ParameterSet::read(path)?;
    for warning in found.warnings {
        crate::terminal::warn(warning);
    }
    let description = description()?;
    found
        .parameters
        .into_iter()
        .map(|parameter| Ok((parameter.name.clone(), parameter.text(&description)?)))
        .collect::<Result<_>>()
        .with_context(|| path.display().to_string())
}

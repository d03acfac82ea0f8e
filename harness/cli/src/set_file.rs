//! Parameters of a file as settings of an FMU.

use std::path::Path;

use anyhow::{Context, Result};
use host::description::ModelDescription;
use host::parameter_set::ParameterSet;

/// Reads the description of the FMU that the parameters are for: units are converted to its own.
pub type Describe<'a> = &'a dyn Fn() -> Result<ModelDescription>;

/// Returns names and values of a file in its order; numbers in the units of the FMU.
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

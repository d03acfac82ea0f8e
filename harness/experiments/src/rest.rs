//! Runs that begin at rest.

use anyhow::Result;
use host::description::ModelDescription;
use host::fmu::{Fmu, Instance};
use names::hubslosh;

/// Parameters by which HubSlosh moves if nobody sets anything, for the first plot of any host; 0 is at rest. Other FMUs have
/// none.
pub fn moving_starts(description: &ModelDescription) -> Vec<String> {
    match description.model_name.as_str() {
        "HubSlosh" => vec![hubslosh::init::SLOSH_ANGLE.into()],
        _ => Vec::new(),
    }
}

/// Makes an instance in which all [`moving_starts`] are 0, so that only what is set moves it.
///
/// # Errors
/// If the FMU refuses a call.
pub fn instantiate<'fmu>(fmu: &'fmu Fmu, name: &str) -> Result<Instance<'fmu>> {
    let mut instance = fmu.instantiate(name)?;
    for start in moving_starts(fmu.description()) {
        instance.set(&start, "0")?;
    }
    Ok(instance)
}

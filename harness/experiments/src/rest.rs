use anyhow::Result;
use host::description::ModelDescription;
use host::fmu::{Fmu, Instance};
use names::hubslosh;

/// Returns the names of the parameters whose start values are not at rest, so that an FMU moves without any
/// setting. HubSlosh begins with the liquid displaced, so that a first plot in any host shows a motion; if
/// these parameters are 0, HubSlosh begins at rest.
pub fn moving_starts(description: &ModelDescription) -> Vec<String> {
    match description.model_name.as_str() {
        "HubSlosh" => vec![hubslosh::init::SLOSH_ANGLE.into()],
        _ => Vec::new(),
    }
}

/// Creates an instance in which all [`moving_starts`] are 0, so that it moves only because of the settings.
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

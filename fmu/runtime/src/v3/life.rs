#![allow(unsafe_code)]

use std::panic::catch_unwind;
use std::path::Path;
use std::ptr;
use std::sync::Arc;

use super::arrays::{self, Arrays};
use super::calls::*;
use super::elements::expand;
use super::host::Host;
use super::references::has_intermediate_update;
use super::types::*;
use crate::c_abi::{self, Log, Logger, array, c_string, new_component, text};
use crate::call::{CType, Call, Events, Fault, Interface, Severity};
use crate::extent::Extent;
use crate::instance::Instance;
use crate::model::Model;
use crate::table::Layout;
use crate::version::Version;

/// Returns a logger that calls the host's logger. Each '#' in a message is doubled, because in FMI 3.0 a single '#' begins a
/// reference to a variable.
fn logger(environment: fmi3InstanceEnvironment, logger: fmi3LogMessageCallback) -> Option<Logger> {
    let logger = logger?;
    Some(Box::new(move |status, category, message| unsafe {
        let message = match message.to_str() {
            Ok(text) if text.contains('#') => c_string(&text.replace('#', "##")),
            _ => message.to_owned(),
        };
        logger(environment, status, category.as_ptr(), message.as_ptr());
    }))
}

pub(super) unsafe fn instantiate<M: Model>(
    function: &str,
    (name, token, resources): (fmi3String, fmi3String, fmi3String),
    (environment, log_message): (fmi3InstanceEnvironment, fmi3LogMessageCallback),
    make: impl FnOnce(Option<&Arrays>) -> Result<(Instance<M, Fmi3>, Host<M>), String>,
) -> fmi3Instance {
    c_abi::silence_panics();
    let made = catch_unwind(std::panic::AssertUnwindSafe(|| unsafe {
        let log = Log::new(logger(environment, log_message));
        let made = check_token::<M>(text(name), text(token)).and_then(|(layout, mut extent)| {
            if let Some(extent) = &mut extent {
                extent.read_starts::<M>(text(resources).as_deref().map(Path::new))?;
            }
            let arrays = arrays::for_layout::<M>(layout, &M::table().starts());
            let (mut instance, mut host) = make(arrays.as_deref())?;
            instance.layout = layout;
            instance = instance.with_extent(extent.map(Arc::new));
            host.arrays = arrays;
            Ok((instance, host))
        });
        match made {
            Ok((instance, host)) => new_component(instance, log, host),
            Err(why) => {
                let text = format!("{function}: {why}");
                log.report(&Fault { severity: Severity::Error, text });
                ptr::null_mut()
            }
        }
    }));
    made.unwrap_or(ptr::null_mut())
}

/// Returns two properties of the model description to which the host's instantiationToken belongs: the layout of its
/// variables (scalars or arrays), and the part of the variables that it contains (`None` for all).
///
/// # Errors
/// If the token or the instance's name is not accepted.
fn check_token<M: Model>(
    name: Option<String>,
    token: Option<String>,
) -> Result<(Layout, Option<Extent>), String> {
    let [scalars, with_arrays] = Layout::ALL.map(|layout| M::table().token(layout));
    if name.is_none_or(|name| name.trim().is_empty()) {
        return Err("instanceName is NULL or empty".into());
    }
    let expected = || format!("expected {scalars}, or {with_arrays} with arrays");
    match token {
        None => Err(format!("instantiationToken is NULL; {}", expected())),
        Some(token) if token == scalars => Ok((Layout::Scalars, None)),
        Some(token) if token == with_arrays => Ok((Layout::Arrays, None)),
        Some(token) => match Extent::from_token::<M>(&token, scalars) {
            Some(extent) => Ok((Layout::Scalars, Some(extent))),
            None => Err(format!(
                "instantiationToken is {token}; {}: model description and binary do not belong together",
                expected()
            )),
        },
    }
}

pub(super) struct Stepping {
    pub(super) event_mode: bool,
    pub(super) early_return: bool,
    pub(super) environment: fmi3InstanceEnvironment,
    pub(super) update: fmi3IntermediateUpdateCallback,
}

/// Creates an instance for Co-Simulation. `variables` points to the `count` value references of the variables that the host
/// reads or sets within steps (requiredIntermediateVariables).
///
/// # Errors
/// If one of these variables cannot be read or set within a step.
pub(super) unsafe fn co_simulation<M: Model>(
    arrays: Option<&Arrays>,
    with: Stepping,
    (variables, count): (*const fmi3ValueReference, usize),
) -> Result<(Instance<M, Fmi3>, Host<M>), String> {
    const NAME: &str = "requiredIntermediateVariables";
    let call = &Call::new("fmi3InstantiateCoSimulation", 0);
    let required = unsafe { array(call, NAME, variables, count) }.map_err(|fault| fault.text)?;
    let scalars = match arrays {
        None => required.to_vec(),
        Some(arrays) => expand::<M>(arrays, Fmi3::DIRECTIONAL_DERIVATIVE, required)
            .map_err(|fault| fault.text)?,
    };
    for reference in &scalars {
        let scalar = Fmi3::scalar::<M>(*reference, Some(CType::Real))?;
        if !has_intermediate_update(scalar.variable) {
            return Err(format!(
                "{} is among {NAME} (allowed: variables with intermediateUpdate, which are continuous inputs \
                 and outputs)",
                scalar.name()
            ));
        }
    }
    let events = if with.event_mode { Events::Reported } else { Events::InStep };
    let host = Host {
        intermediate_update: with.update,
        early_return_allowed: with.early_return,
        set: Vec::with_capacity(scalars.len()),
        required: scalars,
        required_variables: required.to_vec(),
        ..Host::new(with.environment)
    };
    Ok((Instance::with_events(Interface::CoSimulation, events), host))
}

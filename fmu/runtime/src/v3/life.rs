//! Instances of FMI 3.0: instantiation, changes of mode, events, and their end.

// The standard documents these names.
#![allow(missing_docs)]
#![allow(unsafe_code)]

use std::panic::catch_unwind;
use std::path::Path;
use std::ptr;
use std::sync::Arc;

use super::arrays::{self, Arrays};
use super::calls::*;
use super::elements::{expand, resize};
use super::host::Host;
use super::references::has_intermediate_update;
use super::types::*;
use crate::c_abi::{
    self, Log, Logger, array, c_string, free_component, new_component, null, on, on_allowed,
    on_start, place, text,
};
use crate::call::{CType, Call, Events, Fault, InstanceState, Interface, Severity};
use crate::extent::Extent;
use crate::instance::Instance;
use crate::log::Filter;
use crate::model::Model;
use crate::table::Layout;
use crate::version::Version;

/// Returns the version of FMI, "3.0".
pub fn fmi3GetVersion() -> fmi3String {
    c"3.0".as_ptr()
}

/// Selects what is logged. Failures are always logged.
pub unsafe fn fmi3SetDebugLogging<M: Model>(
    instance: fmi3Instance,
    loggingOn: fmi3Boolean,
    nCategories: usize,
    categories: *const fmi3String,
) -> fmi3Status {
    let call = &SET_DEBUG_LOGGING;
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
            let mut names = Vec::new();
            for category in array(call, "categories", categories, nCategories)? {
                names.push(text(*category).ok_or_else(|| null(call, "categories[]"))?);
            }
            let filter =
                Filter::from_categories(&names, M::table()).map_err(|why| call.error(why))?;
            component.log.filter =
                if loggingOn == 0 { Filter::ERRORS } else { filter.with_errors() };
            Ok(())
        })
    }
}

/// Wraps the host's logger. The character '#' begins a reference to a variable in a message, so that it is
/// doubled.
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

/// Creates an instance by `make`. On failure it returns NULL and logs the reason.
unsafe fn instantiate<M: Model>(
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

/// Returns the layout of the variables in the model description with this token, scalars or arrays, and the
/// part of the variables that it contains.
///
/// # Errors
///
/// If the token or the instance's name is not acceptable.
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

pub unsafe fn fmi3InstantiateModelExchange<M: Model>(
    instanceName: fmi3String,
    instantiationToken: fmi3String,
    resourcePath: fmi3String,
    _visible: fmi3Boolean,
    _loggingOn: fmi3Boolean,
    instanceEnvironment: fmi3InstanceEnvironment,
    logMessage: fmi3LogMessageCallback,
) -> fmi3Instance {
    unsafe {
        instantiate::<M>(
            "fmi3InstantiateModelExchange",
            (instanceName, instantiationToken, resourcePath),
            (instanceEnvironment, logMessage),
            |_| {
                let instance = Instance::new(Interface::ModelExchange);
                Ok((instance, Host::new(instanceEnvironment)))
            },
        )
    }
}

pub unsafe fn fmi3InstantiateCoSimulation<M: Model>(
    instanceName: fmi3String,
    instantiationToken: fmi3String,
    resourcePath: fmi3String,
    _visible: fmi3Boolean,
    _loggingOn: fmi3Boolean,
    eventModeUsed: fmi3Boolean,
    earlyReturnAllowed: fmi3Boolean,
    requiredIntermediateVariables: *const fmi3ValueReference,
    nRequiredIntermediateVariables: usize,
    instanceEnvironment: fmi3InstanceEnvironment,
    logMessage: fmi3LogMessageCallback,
    intermediateUpdate: fmi3IntermediateUpdateCallback,
) -> fmi3Instance {
    let function = "fmi3InstantiateCoSimulation";
    unsafe {
        instantiate::<M>(
            function,
            (instanceName, instantiationToken, resourcePath),
            (instanceEnvironment, logMessage),
            |arrays| {
                let call = &Call::new("fmi3InstantiateCoSimulation", 0);
                let required = array(
                    call,
                    "requiredIntermediateVariables",
                    requiredIntermediateVariables,
                    nRequiredIntermediateVariables,
                )
                .map_err(|fault| fault.text)?;
                let scalars = match arrays {
                    None => required.to_vec(),
                    Some(arrays) => {
                        let all = expand::<M>(arrays, Fmi3::DIRECTIONAL_DERIVATIVE, required);
                        all.map_err(|fault| fault.text)?
                    }
                };
                for reference in &scalars {
                    let scalar = Fmi3::scalar::<M>(*reference, Some(CType::Real))?;
                    if !has_intermediate_update(scalar.variable) {
                        return Err(format!(
                            "{} is among requiredIntermediateVariables (allowed: variables with intermediateUpdate, which are \
                             continuous inputs and outputs)",
                            scalar.name()
                        ));
                    }
                }
                let events = if eventModeUsed != 0 { Events::Reported } else { Events::InStep };
                let host = Host {
                    intermediate_update: intermediateUpdate,
                    early_return_allowed: earlyReturnAllowed != 0,
                    set: Vec::with_capacity(scalars.len()),
                    required: scalars,
                    required_variables: required.to_vec(),
                    ..Host::new(instanceEnvironment)
                };
                Ok((Instance::with_events(Interface::CoSimulation, events), host))
            },
        )
    }
}

/// Returns NULL, because there is no Scheduled Execution.
pub unsafe fn fmi3InstantiateScheduledExecution<M: Model>(
    instanceName: fmi3String,
    instantiationToken: fmi3String,
    resourcePath: fmi3String,
    _visible: fmi3Boolean,
    _loggingOn: fmi3Boolean,
    instanceEnvironment: fmi3InstanceEnvironment,
    logMessage: fmi3LogMessageCallback,
    _clockUpdate: fmi3ClockUpdateCallback,
    _lockPreemption: fmi3LockPreemptionCallback,
    _unlockPreemption: fmi3UnlockPreemptionCallback,
) -> fmi3Instance {
    unsafe {
        instantiate::<M>(
            "fmi3InstantiateScheduledExecution",
            (instanceName, instantiationToken, resourcePath),
            (instanceEnvironment, logMessage),
            |_| Err("this FMU has Model Exchange and Co-Simulation, no Scheduled Execution".into()),
        )
    }
}

pub unsafe fn fmi3FreeInstance<M: Model>(instance: fmi3Instance) {
    unsafe { free_component::<M, Fmi3>(instance) }
}

/// Sets times and tolerance and enters initialization mode, from which on all variables can be read.
pub unsafe fn fmi3EnterInitializationMode<M: Model>(
    instance: fmi3Instance,
    toleranceDefined: fmi3Boolean,
    tolerance: fmi3Float64,
    startTime: fmi3Float64,
    stopTimeDefined: fmi3Boolean,
    stopTime: fmi3Float64,
) -> fmi3Status {
    let tolerance = (toleranceDefined != 0).then_some(tolerance);
    let stop = (stopTimeDefined != 0).then_some(stopTime);
    unsafe {
        on::<M, Fmi3>(instance, Fmi3::ENTER_INITIALIZATION, |component| {
            component.instance.setup_experiment(tolerance, startTime, stop)?;
            component.instance.enter_initialization_mode()
        })
    }
}

/// Leaves initialization mode: parameters are fixed from here on, and event mode or steps follow.
pub unsafe fn fmi3ExitInitializationMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on_start::<M, Fmi3>(instance, Fmi3::EXIT_INITIALIZATION, |component| {
            component.instance.exit_initialization_mode()
        })
    }
}

pub unsafe fn fmi3EnterEventMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, Fmi3::ENTER_EVENT, |component| {
            component.instance.enter_event_mode()
        })
    }
}

pub unsafe fn fmi3Terminate<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe { on::<M, Fmi3>(instance, Fmi3::TERMINATE, |component| component.instance.terminate()) }
}

pub unsafe fn fmi3Reset<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, Fmi3::RESET, |component| {
            component.instance.reset()?;
            resize(component);
            Ok(())
        })
    }
}

/// Enters configuration mode, in which structural parameters can be set.
pub unsafe fn fmi3EnterConfigurationMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, &ENTER_CONFIGURATION, |component| {
            component.instance.configure(&ENTER_CONFIGURATION, InstanceState::Configuration)
        })
    }
}

/// Leaves configuration mode; the arrays have their new sizes from here on.
pub unsafe fn fmi3ExitConfigurationMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, &EXIT_CONFIGURATION, |component| {
            component.instance.configure(&EXIT_CONFIGURATION, InstanceState::Instantiated)
        })
    }
}

/// Does nothing, because fmi3UpdateDiscreteStates evaluates everything.
pub unsafe fn fmi3EvaluateDiscreteStates<M: Model>(instance: fmi3Instance) -> fmi3Status {
    let call = &EVALUATE_DISCRETE_STATES;
    unsafe { on::<M, Fmi3>(instance, call, |component| component.instance.check(call).map(|_| ())) }
}

/// Handles the events that are due, and tells the host whether another one follows at once and when the next
/// time event is.
pub unsafe fn fmi3UpdateDiscreteStates<M: Model>(
    instance: fmi3Instance,
    discreteStatesNeedUpdate: *mut fmi3Boolean,
    terminateSimulation: *mut fmi3Boolean,
    nominalsOfContinuousStatesChanged: *mut fmi3Boolean,
    valuesOfContinuousStatesChanged: *mut fmi3Boolean,
    nextEventTimeDefined: *mut fmi3Boolean,
    nextEventTime: *mut fmi3Float64,
) -> fmi3Status {
    let call = Fmi3::NEW_DISCRETE_STATES;
    unsafe {
        on_allowed::<M, Fmi3>(instance, call, |component| {
            let need_update = place(call, "discreteStatesNeedUpdate", discreteStatesNeedUpdate)?;
            let terminate = place(call, "terminateSimulation", terminateSimulation)?;
            let nominals_changed = place(
                call,
                "nominalsOfContinuousStatesChanged",
                nominalsOfContinuousStatesChanged,
            )?;
            let values_changed =
                place(call, "valuesOfContinuousStatesChanged", valuesOfContinuousStatesChanged)?;
            let defined = place(call, "nextEventTimeDefined", nextEventTimeDefined)?;
            let next = place(call, "nextEventTime", nextEventTime)?;
            let before = component.instance.event_count();
            let info = component.instance.new_discrete_states()?;
            (*need_update, *terminate, *nominals_changed) = (0, 0, 0);
            *values_changed = info.states_changed.into();
            *defined = info.next_time.is_some().into();
            *next = info.next_time.unwrap_or(0.0);
            component.log.report_event(call, before, &component.instance);
            Ok(())
        })
    }
}

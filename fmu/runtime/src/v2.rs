//! The C interface of FMI 2.0 for Model Exchange and Co-Simulation: 44 functions with their names, signatures and constants.
//! The FMI standard documents them; the comments here describe only properties of this implementation.
//!
//! Every function is generic in the model; `export_fmi2!` exports them for one model under their names. Their effects are
//! implemented in [`crate::instance`] and [`crate::snapshot`], the common part of the C interface in `crate::c_abi`.

// The standard documents these names.
#![allow(missing_docs)]
#![allow(unsafe_code)]
// The names are the standard's.
#![allow(non_camel_case_types, non_upper_case_globals, non_snake_case)]
// The safety contract of every function is that of the FMI 2.0 standard: a component comes from fmi2Instantiate and is not
// yet freed, arrays have the given lengths, and strings end with NUL.
#![allow(clippy::missing_safety_doc, clippy::too_many_arguments)]

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::panic::catch_unwind;
use std::ptr;
use std::sync::Arc;

use crate::c_abi::{
    self, Log, Logger, array, array_mut, c_functions, c_string, completed_step, deserialize, fill,
    filter, free_component, free_state, new_component, perform, perform_if_allowed, perform_start,
    place, save_state, saved_state, serialize, serialized_size, text,
};
use crate::call::states::*;
use crate::call::{CType, Call, Events, Fault, InstanceState, Interface, Severity, cs, me, typed};
use crate::extent::{Extent, folder_of_uri};
use crate::instance::Instance;
use crate::log::Filter;
use crate::model::Model;
use crate::table::{Layout, Scalar};
use crate::variable::Value;
use crate::version::Version;

pub type fmi2Component = *mut c_void;
pub type fmi2ComponentEnvironment = *mut c_void;
pub type fmi2FMUstate = *mut c_void;
pub type fmi2ValueReference = c_uint;
pub type fmi2Real = f64;
pub type fmi2Integer = c_int;
/// 0 is false, any other value is true.
pub type fmi2Boolean = c_int;
pub type fmi2Char = c_char;
pub type fmi2String = *const fmi2Char;
pub type fmi2Byte = c_char;

pub type fmi2Status = c_abi::Status;
pub const fmi2OK: fmi2Status = c_abi::OK;
pub const fmi2Warning: fmi2Status = c_abi::WARNING;
pub const fmi2Discard: fmi2Status = c_abi::DISCARD;
pub const fmi2Error: fmi2Status = c_abi::ERROR;
pub const fmi2Fatal: fmi2Status = c_abi::FATAL;
pub const fmi2Pending: fmi2Status = 5;

pub type fmi2Type = c_int;
pub const fmi2ModelExchange: fmi2Type = 0;
pub const fmi2CoSimulation: fmi2Type = 1;

pub type fmi2StatusKind = c_int;
pub const fmi2DoStepStatus: fmi2StatusKind = 0;
pub const fmi2PendingStatus: fmi2StatusKind = 1;
pub const fmi2LastSuccessfulTime: fmi2StatusKind = 2;
pub const fmi2Terminated: fmi2StatusKind = 3;

/// The host's logger, which formats its message as printf does.
pub type fmi2CallbackLogger = Option<
    unsafe extern "C" fn(
        environment: fmi2ComponentEnvironment,
        instance_name: fmi2String,
        status: fmi2Status,
        category: fmi2String,
        message: fmi2String,
        ...
    ),
>;

/// Callbacks of the host. Each of them may be NULL, and the FMU uses only the logger.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct fmi2CallbackFunctions {
    pub logger: fmi2CallbackLogger,
    pub allocateMemory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    pub freeMemory: Option<unsafe extern "C" fn(*mut c_void)>,
    pub stepFinished: Option<unsafe extern "C" fn(fmi2ComponentEnvironment, fmi2Status)>,
    pub componentEnvironment: fmi2ComponentEnvironment,
}

// ---- Functions, and the states in which each may be called ----

#[allow(missing_docs)]
#[rustfmt::skip]
mod list {
    use super::*;
    pub static SET_DEBUG_LOGGING:   Call = Call::new("fmi2SetDebugLogging", ANY);
    // Parameters and inputs can be read from the start; all other variables have values from initialization mode on. When a
    // variable can be set depends on its causality.
    pub static GET_REAL:            Call = typed(CType::Real, "fmi2GetReal", ANY);
    pub static GET_INTEGER:         Call = typed(CType::Integer, "fmi2GetInteger", ANY);
    pub static GET_BOOLEAN:         Call = typed(CType::Boolean, "fmi2GetBoolean", ANY);
    pub static GET_STRING:          Call = typed(CType::String, "fmi2GetString", ANY);
    pub static SET_REAL:            Call = typed(CType::Real, "fmi2SetReal", I | M | S | E | C);
    pub static SET_INTEGER:         Call = typed(CType::Integer, "fmi2SetInteger", I | M | S | E | C);
    pub static SET_BOOLEAN:         Call = typed(CType::Boolean, "fmi2SetBoolean", I | M | S | E | C);
    pub static SET_STRING:          Call = typed(CType::String, "fmi2SetString", I | M | S | E | C);
    pub static GET_STATE:           Call = Call::new("fmi2GetFMUstate", ANY);
    pub static FREE_STATE:          Call = Call::new("fmi2FreeFMUstate", ANY | FATAL);
    pub static SERIALIZED_SIZE:     Call = Call::new("fmi2SerializedFMUstateSize", ANY);
    pub static SERIALIZE:           Call = Call::new("fmi2SerializeFMUstate", ANY);
    pub static DESERIALIZE:         Call = Call::new("fmi2DeSerializeFMUstate", ANY);
    pub static CANCEL_STEP:         Call = cs(Call::new("fmi2CancelStep", S));
    pub static GET_STATUS:          Call = cs(Call::new("fmi2GetStatus", ANY));
    pub static GET_REAL_STATUS:     Call = cs(Call::new("fmi2GetRealStatus", ANY));
    pub static GET_INTEGER_STATUS:  Call = cs(Call::new("fmi2GetIntegerStatus", ANY));
    pub static GET_BOOLEAN_STATUS:  Call = cs(Call::new("fmi2GetBooleanStatus", ANY));
    pub static GET_STRING_STATUS:   Call = cs(Call::new("fmi2GetStringStatus", ANY));
}
pub use list::*;

#[derive(Clone, Copy, Debug)]
pub struct Fmi2;

#[rustfmt::skip]
impl Version for Fmi2 {
    const PREFIX: &'static str = "fmi2";

    type Host<M: Model> = ();

    const AFTER_ERROR: Option<InstanceState> = None;
    const OUT_OF_RANGE: Severity = Severity::Error;
    const FIRST_EVENT: InstanceState = InstanceState::Initialized;
    const SETS_STATES: bool = false;

    const SETUP_EXPERIMENT:       &'static Call = &Call::new("fmi2SetupExperiment", I);
    const ENTER_INITIALIZATION:   &'static Call = &Call::new("fmi2EnterInitializationMode", I);
    const EXIT_INITIALIZATION:    &'static Call = &Call::new("fmi2ExitInitializationMode", M);
    const TERMINATE:              &'static Call = &Call::new("fmi2Terminate", S | E | C | F);
    const RESET:                  &'static Call = &Call::new("fmi2Reset", ANY);
    const SET_STATE:              &'static Call = &Call::new("fmi2SetFMUstate", ANY);
    const DIRECTIONAL_DERIVATIVE: &'static Call = &typed(CType::Real, "fmi2GetDirectionalDerivative", M | RUN);

    const SET_INPUT_DERIVATIVES:  &'static Call = &cs(typed(CType::Real, "fmi2SetRealInputDerivatives", I | M | S));
    const GET_OUTPUT_DERIVATIVES: &'static Call = &cs(typed(CType::Real, "fmi2GetRealOutputDerivatives", RUN));
    const DO_STEP:                &'static Call = &cs(Call::new("fmi2DoStep", S));

    // The standard allows this only in continuous-time mode, but OpenModelica up to 1.27 also calls it in
    // the event mode after initialization.
    const ENTER_EVENT:            &'static Call = &me(Call::new("fmi2EnterEventMode", E | C));
    const NEW_DISCRETE_STATES:    &'static Call = &me(Call::new("fmi2NewDiscreteStates", E));
    const ENTER_CONTINUOUS_TIME:  &'static Call = &me(Call::new("fmi2EnterContinuousTimeMode", E));
    const COMPLETED_STEP:         &'static Call = &me(Call::new("fmi2CompletedIntegratorStep", C));
    const SET_TIME:               &'static Call = &me(Call::new("fmi2SetTime", E | C));
    // As `ENTER_EVENT`, because OpenModelica also calls this function in the event mode after initialization.
    const SET_CONTINUOUS_STATES:  &'static Call = &me(Call::new("fmi2SetContinuousStates", E | C));
    const GET_DERIVATIVES:        &'static Call = &me(Call::new("fmi2GetDerivatives", M | E | C | T | F));
    const GET_EVENT_INDICATORS:   &'static Call = &me(Call::new("fmi2GetEventIndicators", M | E | C | T | F));
    const GET_CONTINUOUS_STATES:  &'static Call = &me(Call::new("fmi2GetContinuousStates", M | E | C | T | F));
    const GET_NOMINALS:           &'static Call = &me(Call::new("fmi2GetNominalsOfContinuousStates", ANY));

    fn token<M: Model>(_: Layout) -> &'static str {
        M::table().guid()
    }

    fn events(interface: Interface) -> Events {
        match interface {
            Interface::ModelExchange => Events::ByHost,
            Interface::CoSimulation => Events::InStep,
        }
    }

    fn reference<M: Model>(scalar: &Scalar<M>) -> u32 {
        scalar.index
    }

    #[inline]
    fn scalar<M: Model>(reference: u32, c_type: Option<CType>) -> Result<&'static Scalar<M>, String> {
        match M::table().scalars.get(reference as usize) {
            Some(scalar) if c_type == Some(scalar.c_type) => Ok(scalar),
            other => Err(wrong_reference(reference, other)),
        }
    }
}

#[cold]
fn wrong_reference<M: Model>(reference: u32, found: Option<&Scalar<M>>) -> String {
    match found {
        Some(scalar) => format!(
            "{} (value reference {reference}) is of type {:?}",
            scalar.name(),
            scalar.c_type
        ),
        None => format!(
            "no variable has the value reference {reference}; the last one is {}",
            M::table().scalars.len() - 1
        ),
    }
}

/// Result of fmi2NewDiscreteStates: what the handled events have changed, and when the next time event is.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct fmi2EventInfo {
    pub newDiscreteStatesNeeded: fmi2Boolean,
    pub terminateSimulation: fmi2Boolean,
    pub nominalsOfContinuousStatesChanged: fmi2Boolean,
    pub valuesOfContinuousStatesChanged: fmi2Boolean,
    pub nextEventTimeDefined: fmi2Boolean,
    pub nextEventTime: fmi2Real,
}

// ---- What the functions do ----

unsafe fn instantiate<M: Model>(
    (name, kind): (fmi2String, fmi2Type),
    (guid, resources): (fmi2String, fmi2String),
    functions: *const fmi2CallbackFunctions,
) -> fmi2Component {
    if functions.is_null() {
        return ptr::null_mut();
    }
    c_abi::silence_panics();
    let made = catch_unwind(|| unsafe {
        let name = text(name);
        let log = Log::new(logger(&*functions, name.as_deref()));
        match interface::<M>(name, kind, text(guid), text(resources)) {
            Ok((interface, extent)) => {
                let instance = Instance::<M, Fmi2>::new(interface).with_extent(extent);
                new_component(instance, log, ())
            }
            Err(why) => {
                let text = format!("fmi2Instantiate: {why}");
                log.report(&Fault { severity: Severity::Error, text });
                ptr::null_mut()
            }
        }
    });
    made.unwrap_or(ptr::null_mut())
}

/// Returns a logger that calls the host's logger. The struct `functions` need not exist after fmi2Instantiate has returned,
/// because its contents are copied.
fn logger(functions: &fmi2CallbackFunctions, instance_name: Option<&str>) -> Option<Logger> {
    let logger = functions.logger?;
    let environment = functions.componentEnvironment;
    let name = c_string(instance_name.unwrap_or(""));
    // The message is passed as an argument and not as the format, because it may contain a percent sign.
    Some(Box::new(move |status, category, message| unsafe {
        let (category, message) = (category.as_ptr(), message.as_ptr());
        logger(environment, name.as_ptr(), status, category, c"%s".as_ptr(), message);
    }))
}

/// Checks the arguments of fmi2Instantiate. Returns the interface of the requested instance, and the part of the variables
/// that the model description with this GUID contains (`None` for all).
///
/// # Errors
/// The reason why the instance cannot be created.
fn interface<M: Model>(
    name: Option<String>,
    kind: fmi2Type,
    guid: Option<String>,
    resources: Option<String>,
) -> Result<(Interface, Option<Arc<Extent>>), String> {
    let expected = M::table().guid();
    if name.is_none_or(|name| name.trim().is_empty()) {
        return Err("instanceName is NULL or empty".into());
    }
    let interface = match kind {
        fmi2ModelExchange => Interface::ModelExchange,
        fmi2CoSimulation => Interface::CoSimulation,
        _ => return Err(format!("fmuType = {kind} (allowed: 0 Model Exchange, 1 Co-Simulation)")),
    };
    match guid {
        None => Err(format!("fmuGUID is NULL; expected {expected}")),
        Some(guid) if guid == expected => Ok((interface, None)),
        Some(guid) => {
            let Some(mut extent) = Extent::from_token::<M>(&guid, expected) else {
                return Err(format!(
                    "fmuGUID is {guid}; expected {expected}: model description and binary do not belong together"
                ));
            };
            let folder = resources.as_deref().and_then(folder_of_uri);
            extent.read_starts::<M>(folder.as_deref())?;
            Ok((interface, Some(Arc::new(extent))))
        }
    }
}

#[inline]
unsafe fn get<M: Model, T>(
    c: fmi2Component,
    call: &'static Call,
    (vr, nvr, value): (*const fmi2ValueReference, usize, *mut T),
    as_c: impl Fn(Value) -> Option<T>,
) -> fmi2Status {
    unsafe {
        perform_if_allowed::<M, Fmi2>(c, call, |component| {
            let references = array(call, "vr", vr, nvr)?;
            let places = array_mut(call, "value", value, nvr)?;
            for (reference, place) in references.iter().zip(places) {
                let value = as_c(component.instance.value(call, *reference)?);
                *place = value.ok_or_else(|| call.error("wrong type"))?;
            }
            Ok(())
        })
    }
}

#[inline]
unsafe fn set<M: Model, T: Copy>(
    c: fmi2Component,
    call: &'static Call,
    (vr, nvr, value): (*const fmi2ValueReference, usize, *const T),
    from_c: impl Fn(T) -> Value,
) -> fmi2Status {
    unsafe {
        perform_if_allowed::<M, Fmi2>(c, call, |component| {
            let references = array(call, "vr", vr, nvr)?;
            let values = array(call, "value", value, nvr)?;
            component.instance.set(call, references, |n| from_c(values[n]))
        })
    }
}

/// Writes a property of the last step, such as the time of its end, to the host's variable `value`. `known` returns the
/// property of the requested `kind`; if it returns `None`, the call is discarded.
unsafe fn write_step_status<M: Model, T>(
    c: fmi2Component,
    call: &'static Call,
    kind: fmi2StatusKind,
    value: *mut T,
    known: impl FnOnce(&Instance<M, Fmi2>) -> Option<T>,
) -> fmi2Status {
    unsafe {
        perform_if_allowed::<M, Fmi2>(c, call, |component| {
            let place = place(call, "value", value)?;
            let value = known(&component.instance);
            *place = value
                .ok_or_else(|| call.discard(format_args!("status kind {kind} has no value")))?;
            Ok(())
        })
    }
}

// ---- The functions ----

c_functions! { $ export_fmi2, v2;

fn fmi2GetTypesPlatform() -> fmi2String = c"default".as_ptr();
fn fmi2GetVersion() -> fmi2String = c"2.0".as_ptr();

/// Selects the messages that are logged. If `loggingOn` is false, nothing is logged; if it is true and no categories are
/// given, everything is logged.
fn fmi2SetDebugLogging(c: fmi2Component, loggingOn: fmi2Boolean, nCategories: usize, categories: *const fmi2String) -> fmi2Status =
    perform_if_allowed::<M, Fmi2>(c, &SET_DEBUG_LOGGING, |component| {
        component.log.filter = match loggingOn {
            0 => Filter::NONE,
            _ => filter::<M>(&SET_DEBUG_LOGGING, categories, nCategories)?,
        };
        Ok(())
    });

/// Creates an instance. `functions` need not exist after this call; `loggingOn` has no effect.
fn fmi2Instantiate(instanceName: fmi2String, fmuType: fmi2Type, fmuGUID: fmi2String, fmuResourceLocation: fmi2String, functions: *const fmi2CallbackFunctions, _visible: fmi2Boolean, _loggingOn: fmi2Boolean) -> fmi2Component =
    instantiate::<M>((instanceName, fmuType), (fmuGUID, fmuResourceLocation), functions);

fn fmi2FreeInstance(c: fmi2Component) = free_component::<M, Fmi2>(c);

fn fmi2SetupExperiment(c: fmi2Component, toleranceDefined: fmi2Boolean, tolerance: fmi2Real, startTime: fmi2Real, stopTimeDefined: fmi2Boolean, stopTime: fmi2Real) -> fmi2Status = {
    let tolerance = (toleranceDefined != 0).then_some(tolerance);
    let stop = (stopTimeDefined != 0).then_some(stopTime);
    perform::<M, Fmi2>(c, Fmi2::SETUP_EXPERIMENT, |component| {
        component.instance.setup_experiment(tolerance, startTime, stop)
    })
};

fn fmi2EnterInitializationMode(c: fmi2Component) -> fmi2Status =
    perform::<M, Fmi2>(c, Fmi2::ENTER_INITIALIZATION, |component| component.instance.enter_initialization_mode());

/// Leaves initialization mode. In Co-Simulation, parameters are fixed from here on; in Model Exchange, from the next call
/// that continues the simulation.
fn fmi2ExitInitializationMode(c: fmi2Component) -> fmi2Status =
    perform_start::<M, Fmi2>(c, Fmi2::EXIT_INITIALIZATION, |component| component.instance.exit_initialization_mode());

fn fmi2Terminate(c: fmi2Component) -> fmi2Status =
    perform_start::<M, Fmi2>(c, Fmi2::TERMINATE, |component| component.instance.terminate());

fn fmi2Reset(c: fmi2Component) -> fmi2Status =
    perform::<M, Fmi2>(c, Fmi2::RESET, |component| component.instance.reset());

// ---- Values ----

fn fmi2GetReal(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut fmi2Real) -> fmi2Status =
    get::<M, _>(c, &GET_REAL, (vr, nvr, value), Value::real);
fn fmi2GetInteger(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut fmi2Integer) -> fmi2Status =
    get::<M, _>(c, &GET_INTEGER, (vr, nvr, value), Value::integer);
fn fmi2GetBoolean(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut fmi2Boolean) -> fmi2Status =
    get::<M, _>(c, &GET_BOOLEAN, (vr, nvr, value), |value| value.boolean().map(i32::from));
fn fmi2GetString(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut fmi2String) -> fmi2Status =
    get::<M, _>(c, &GET_STRING, (vr, nvr, value), |_| None);
fn fmi2SetReal(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const fmi2Real) -> fmi2Status =
    set::<M, _>(c, &SET_REAL, (vr, nvr, value), Value::Real);
fn fmi2SetInteger(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const fmi2Integer) -> fmi2Status =
    set::<M, _>(c, &SET_INTEGER, (vr, nvr, value), Value::Integer);
fn fmi2SetBoolean(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const fmi2Boolean) -> fmi2Status =
    set::<M, _>(c, &SET_BOOLEAN, (vr, nvr, value), |b| Value::Boolean(b != 0));
/// Refuses every value reference, because no variable is a string. The values are never read.
fn fmi2SetString(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const fmi2String) -> fmi2Status =
    set::<M, _>(c, &SET_STRING, (vr, nvr, value), |_| Value::Boolean(false));

fn fmi2GetDirectionalDerivative(c: fmi2Component, vUnknown_ref: *const fmi2ValueReference, nUnknown: usize, vKnown_ref: *const fmi2ValueReference, nKnown: usize, dvKnown: *const fmi2Real, dvUnknown: *mut fmi2Real) -> fmi2Status = {
    let call = Fmi2::DIRECTIONAL_DERIVATIVE;
    perform_if_allowed::<M, Fmi2>(c, call, |component| {
        let unknowns = array(call, "vUnknown_ref", vUnknown_ref, nUnknown)?;
        let knowns = array(call, "vKnown_ref", vKnown_ref, nKnown)?;
        let direction = array(call, "dvKnown", dvKnown, nKnown)?;
        let answers = array_mut(call, "dvUnknown", dvUnknown, nUnknown)?;
        component.instance.directional_derivative(unknowns, knowns, direction, answers)
    })
};

// ---- Saved states ----

fn fmi2GetFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> fmi2Status =
    perform_if_allowed::<M, Fmi2>(c, &GET_STATE, |component| save_state(&GET_STATE, "FMUstate", FMUstate, &component.instance));
fn fmi2SetFMUstate(c: fmi2Component, FMUstate: fmi2FMUstate) -> fmi2Status =
    perform_if_allowed::<M, Fmi2>(c, Fmi2::SET_STATE, |component| {
        component.instance.restore(saved_state(Fmi2::SET_STATE, "FMUstate", FMUstate)?)
    });
fn fmi2FreeFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> fmi2Status =
    perform::<M, Fmi2>(c, &FREE_STATE, |_| free_state::<M, Fmi2>(&FREE_STATE, "FMUstate", FMUstate));
fn fmi2SerializedFMUstateSize(c: fmi2Component, FMUstate: fmi2FMUstate, size: *mut usize) -> fmi2Status =
    serialized_size::<M, Fmi2>(c, &SERIALIZED_SIZE, ("FMUstate", FMUstate), size);
fn fmi2SerializeFMUstate(c: fmi2Component, FMUstate: fmi2FMUstate, serializedState: *mut fmi2Byte, size: usize) -> fmi2Status =
    serialize::<M, Fmi2>(c, &SERIALIZE, ("FMUstate", FMUstate), (serializedState.cast(), size));
fn fmi2DeSerializeFMUstate(c: fmi2Component, serializedState: *const fmi2Byte, size: usize, FMUstate: *mut fmi2FMUstate) -> fmi2Status =
    deserialize::<M, Fmi2>(c, &DESERIALIZE, (serializedState.cast(), size), ("FMUstate", FMUstate));

// ---- Model Exchange ----

fn fmi2EnterEventMode(c: fmi2Component) -> fmi2Status =
    perform_start::<M, Fmi2>(c, Fmi2::ENTER_EVENT, |component| component.instance.enter_event_mode());

fn fmi2NewDiscreteStates(c: fmi2Component, eventInfo: *mut fmi2EventInfo) -> fmi2Status = {
    let call = Fmi2::NEW_DISCRETE_STATES;
    perform_start::<M, Fmi2>(c, call, |component| {
        component.instance.check(call)?;
        let place = place(call, "eventInfo", eventInfo)?;
        let before = component.instance.event_count();
        let info = component.instance.new_discrete_states()?;
        *place = fmi2EventInfo {
            valuesOfContinuousStatesChanged: info.states_changed.into(),
            nextEventTimeDefined: info.next_time.is_some().into(),
            nextEventTime: info.next_time.unwrap_or(0.0),
            ..fmi2EventInfo::default()
        };
        component.log.report_event(call, before, &component.instance);
        Ok(())
    })
};

fn fmi2EnterContinuousTimeMode(c: fmi2Component) -> fmi2Status =
    perform_start::<M, Fmi2>(c, Fmi2::ENTER_CONTINUOUS_TIME, |component| component.instance.enter_continuous_time_mode());

/// Handles the host's message that its integrator has completed a step. `noSetFMUStatePriorToCurrentPoint` has no effect,
/// because the FMU stores no past states.
fn fmi2CompletedIntegratorStep(c: fmi2Component, _noSetFMUStatePriorToCurrentPoint: fmi2Boolean, enterEventMode: *mut fmi2Boolean, terminateSimulation: *mut fmi2Boolean) -> fmi2Status =
    completed_step::<M, Fmi2, _>(c, enterEventMode, terminateSimulation);

fn fmi2SetTime(c: fmi2Component, time: fmi2Real) -> fmi2Status =
    perform_start::<M, Fmi2>(c, Fmi2::SET_TIME, |component| component.instance.set_time(time));

fn fmi2SetContinuousStates(c: fmi2Component, x: *const fmi2Real, nx: usize) -> fmi2Status = {
    let call = Fmi2::SET_CONTINUOUS_STATES;
    perform_start::<M, Fmi2>(c, call, |component| {
        component.instance.check(call)?;
        component.instance.set_continuous_states(array(call, "x", x, nx)?)
    })
};

fn fmi2GetDerivatives(c: fmi2Component, derivatives: *mut fmi2Real, nx: usize) -> fmi2Status =
    fill::<M, Fmi2>(c, Fmi2::GET_DERIVATIVES, ("derivatives", derivatives, nx), Instance::derivatives);
fn fmi2GetEventIndicators(c: fmi2Component, eventIndicators: *mut fmi2Real, ni: usize) -> fmi2Status =
    fill::<M, Fmi2>(c, Fmi2::GET_EVENT_INDICATORS, ("eventIndicators", eventIndicators, ni), Instance::event_indicators);
fn fmi2GetContinuousStates(c: fmi2Component, x: *mut fmi2Real, nx: usize) -> fmi2Status =
    fill::<M, Fmi2>(c, Fmi2::GET_CONTINUOUS_STATES, ("x", x, nx), Instance::continuous_states);
fn fmi2GetNominalsOfContinuousStates(c: fmi2Component, x_nominal: *mut fmi2Real, nx: usize) -> fmi2Status =
    fill::<M, Fmi2>(c, Fmi2::GET_NOMINALS, ("x_nominal", x_nominal, nx), |instance, x| instance.nominals(x));

// ---- Co-Simulation ----

fn fmi2SetRealInputDerivatives(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, order: *const fmi2Integer, value: *const fmi2Real) -> fmi2Status = {
    let call = Fmi2::SET_INPUT_DERIVATIVES;
    perform_if_allowed::<M, Fmi2>(c, call, |component| {
        let references = array(call, "vr", vr, nvr)?;
        let orders = array(call, "order", order, nvr)?;
        component.instance.set_input_derivatives(references, orders, array(call, "value", value, nvr)?)
    })
};

/// Computes the time derivatives of outputs at the end of the last step. All orders must be 1.
fn fmi2GetRealOutputDerivatives(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, order: *const fmi2Integer, value: *mut fmi2Real) -> fmi2Status = {
    let call = Fmi2::GET_OUTPUT_DERIVATIVES;
    perform_if_allowed::<M, Fmi2>(c, call, |component| {
        let references = array(call, "vr", vr, nvr)?;
        let orders = array(call, "order", order, nvr)?;
        component.instance.output_derivatives(references, orders, array_mut(call, "value", value, nvr)?)
    })
};

fn fmi2DoStep(c: fmi2Component, currentCommunicationPoint: fmi2Real, communicationStepSize: fmi2Real, _noSetFMUStatePriorToCurrentPoint: fmi2Boolean) -> fmi2Status = {
    let call = Fmi2::DO_STEP;
    perform::<M, Fmi2>(c, call, |component| {
        let before = component.instance.event_count();
        component.instance.do_step(currentCommunicationPoint, communicationStepSize)?;
        component.log.report_event(call, before, &component.instance);
        component.log.report_step_warning(&component.instance);
        Ok(())
    })
};

/// Refuses the call, because fmi2DoStep returns only when the step is complete, so that no step can be cancelled.
fn fmi2CancelStep(c: fmi2Component) -> fmi2Status =
    perform_if_allowed::<M, Fmi2>(c, &CANCEL_STEP, |_| {
        Err(CANCEL_STEP.error("no step is running: fmi2DoStep returns when the step is done"))
    });

fn fmi2GetStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Status) -> fmi2Status =
    write_step_status::<M, _>(c, &GET_STATUS, s, value, |instance| {
        let ended = if instance.state() == InstanceState::Failed { fmi2Error } else { fmi2OK };
        (s == fmi2DoStepStatus).then_some(ended)
    });
fn fmi2GetRealStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Real) -> fmi2Status =
    write_step_status::<M, _>(c, &GET_REAL_STATUS, s, value, |instance| {
        (s == fmi2LastSuccessfulTime).then_some(instance.time())
    });
/// Discards the call, because no property of the last step is an integer.
fn fmi2GetIntegerStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Integer) -> fmi2Status =
    write_step_status::<M, _>(c, &GET_INTEGER_STATUS, s, value, |_| None);
/// Returns false for fmi2Terminated, because the FMU never ends the simulation by itself.
fn fmi2GetBooleanStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Boolean) -> fmi2Status =
    write_step_status::<M, _>(c, &GET_BOOLEAN_STATUS, s, value, |_| (s == fmi2Terminated).then_some(0));
/// Discards the call, because no step is ever pending.
fn fmi2GetStringStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2String) -> fmi2Status =
    write_step_status::<M, _>(c, &GET_STRING_STATUS, s, value, |_| None);

}

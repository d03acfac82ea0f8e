//! The C interface of FMI 2.0 for Model Exchange and Co-Simulation: 44 functions with their names, signatures
//! and constants. The standard documents them; comments here describe only what is particular to this
//! implementation.
//!
//! Every function is generic in the model; [`crate::export_fmi2`] exports them for one model under their
//! names. Their effects are implemented in [`crate::instance`] and [`crate::snapshot`], the common part of
//! the C interface in [`crate::c_abi`].

// The standard documents these names.
#![allow(missing_docs)]
#![allow(unsafe_code)]
// The names are the standard's.
#![allow(non_camel_case_types, non_upper_case_globals, non_snake_case)]
// The safety contract of every function is the FMI 2.0 standard's: a component
// comes from fmi2Instantiate and is not yet freed, arrays have the lengths given,
// strings end with NUL.
#![allow(clippy::missing_safety_doc)]

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::panic::catch_unwind;
use std::ptr;
use std::sync::Arc;

use crate::c_abi::{
    self, Log, Logger, array, array_mut, c_string, deserialize, free_component, free_state,
    new_component, null, on, on_allowed, on_start, place, save_state, saved_state, serialize, text,
};
use crate::call::states::*;
use crate::call::{CType, Call, Events, Fault, InstanceState, Interface, Severity};
use crate::extent::{Extent, folder_of_uri};
use crate::instance::Instance;
use crate::log::Filter;
use crate::model::Model;
use crate::snapshot;
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

/// The host's logger, which formats the message like printf.
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

/// Callbacks of the host. Only the logger is used; each may be NULL.
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

// ---- Which functions there are, and when each may be called ----

const fn typed(c_type: CType, name: &'static str, allowed: u16) -> Call {
    Call::new(name, allowed).with_type(c_type)
}

/// Restricts a call to Co-Simulation.
const fn cs(call: Call) -> Call {
    call.only_in(Interface::CoSimulation)
}

/// Restricts a call to Model Exchange.
const fn me(call: Call) -> Call {
    call.only_in(Interface::ModelExchange)
}

/// Functions of FMI 2.0 with the instance states that allow them, as far as they are not in [`Version`].
#[allow(missing_docs)]
#[rustfmt::skip]
mod list {
    use super::*;
    pub static SET_DEBUG_LOGGING:   Call = Call::new("fmi2SetDebugLogging", ANY);
    // Parameters and inputs can be read from the start; all other variables have values from initialization
    // mode on. When a variable can be set depends on the variable.
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

/// FMI 2.0.
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
    // As for `ENTER_EVENT`.
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

// ---- Inquiry, life and death ----

/// Returns "default": the C types of this file.
pub fn fmi2GetTypesPlatform() -> fmi2String {
    c"default".as_ptr()
}

pub fn fmi2GetVersion() -> fmi2String {
    c"2.0".as_ptr()
}

pub unsafe fn fmi2SetDebugLogging<M: Model>(
    c: fmi2Component,
    loggingOn: fmi2Boolean,
    nCategories: usize,
    categories: *const fmi2String,
) -> fmi2Status {
    let call = &SET_DEBUG_LOGGING;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            if loggingOn == 0 {
                component.log.filter = Filter::NONE;
                return Ok(());
            }
            let mut names = Vec::new();
            for category in array(call, "categories", categories, nCategories)? {
                names.push(text(*category).ok_or_else(|| null(call, "categories[]"))?);
            }
            component.log.filter =
                Filter::from_categories(&names, M::table()).map_err(|why| call.error(why))?;
            Ok(())
        })
    }
}

pub unsafe fn fmi2Instantiate<M: Model>(
    instanceName: fmi2String,
    fmuType: fmi2Type,
    fmuGUID: fmi2String,
    fmuResourceLocation: fmi2String,
    functions: *const fmi2CallbackFunctions,
    _visible: fmi2Boolean,
    _loggingOn: fmi2Boolean,
) -> fmi2Component {
    if functions.is_null() {
        return ptr::null_mut();
    }
    c_abi::silence_panics();
    let made = catch_unwind(|| unsafe {
        let name = text(instanceName);
        let log = Log::new(logger(&*functions, name.as_deref()));
        match interface::<M>(name, fmuType, text(fmuGUID), text(fmuResourceLocation)) {
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

/// Wraps the host's logger. The struct of callbacks need not exist after fmi2Instantiate has returned.
fn logger(functions: &fmi2CallbackFunctions, instance_name: Option<&str>) -> Option<Logger> {
    let logger = functions.logger?;
    let environment = functions.componentEnvironment;
    let name = c_string(instance_name.unwrap_or(""));
    // The text is passed as an argument and not as the format, because it may contain a percent sign.
    Some(Box::new(move |status, category, message| unsafe {
        let (category, message) = (category.as_ptr(), message.as_ptr());
        logger(environment, name.as_ptr(), status, category, c"%s".as_ptr(), message);
    }))
}

/// Returns the interface of the requested instance and the part of the variables that the host knows.
///
/// # Errors
///
/// If the instance cannot be created; the text is the reason.
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

pub unsafe fn fmi2FreeInstance<M: Model>(c: fmi2Component) {
    unsafe { free_component::<M, Fmi2>(c) }
}

pub unsafe fn fmi2SetupExperiment<M: Model>(
    c: fmi2Component,
    toleranceDefined: fmi2Boolean,
    tolerance: fmi2Real,
    startTime: fmi2Real,
    stopTimeDefined: fmi2Boolean,
    stopTime: fmi2Real,
) -> fmi2Status {
    let tolerance = (toleranceDefined != 0).then_some(tolerance);
    let stop = (stopTimeDefined != 0).then_some(stopTime);
    unsafe {
        on::<M, Fmi2>(c, Fmi2::SETUP_EXPERIMENT, |component| {
            component.instance.setup_experiment(tolerance, startTime, stop)
        })
    }
}

/// Enters initialization mode, from which on all variables can be read.
pub unsafe fn fmi2EnterInitializationMode<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe {
        on::<M, Fmi2>(c, Fmi2::ENTER_INITIALIZATION, |component| {
            component.instance.enter_initialization_mode()
        })
    }
}

/// Leaves initialization mode: parameters are fixed from here on (in Model Exchange from the next call that
/// continues the simulation), and steps are allowed.
pub unsafe fn fmi2ExitInitializationMode<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe {
        on_start::<M, Fmi2>(c, Fmi2::EXIT_INITIALIZATION, |component| {
            component.instance.exit_initialization_mode()
        })
    }
}

pub unsafe fn fmi2Terminate<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe { on_start::<M, Fmi2>(c, Fmi2::TERMINATE, |component| component.instance.terminate()) }
}

pub unsafe fn fmi2Reset<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe { on::<M, Fmi2>(c, Fmi2::RESET, |component| component.instance.reset()) }
}

// ---- Values ----

/// Reads the variables of all references and converts each value to its C type by `as_c`.
#[inline]
unsafe fn get<M: Model, T>(
    c: fmi2Component,
    call: &'static Call,
    (vr, nvr, value): (*const fmi2ValueReference, usize, *mut T),
    as_c: impl Fn(Value) -> Option<T>,
) -> fmi2Status {
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
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

/// Sets the variables of all references; each value is converted from its C type by `from_c`.
#[inline]
unsafe fn set<M: Model, T: Copy>(
    c: fmi2Component,
    call: &'static Call,
    (vr, nvr, value): (*const fmi2ValueReference, usize, *const T),
    from_c: impl Fn(T) -> Value,
) -> fmi2Status {
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            let references = array(call, "vr", vr, nvr)?;
            let values = array(call, "value", value, nvr)?;
            component.instance.set(call, references, |n| from_c(values[n]))
        })
    }
}

/// Defines functions that read or set variables of one type by `$access`, with a conversion to or from the C
/// type.
macro_rules! accessors {
    ($($(#[$doc:meta])* $name:ident($value:ty): $access:ident, $call:expr, $convert:expr;)*) => {$(
        $(#[$doc])*
        pub unsafe fn $name<M: Model>(
            c: fmi2Component,
            vr: *const fmi2ValueReference,
            nvr: usize,
            value: $value,
        ) -> fmi2Status {
            unsafe { $access::<M, _>(c, $call, (vr, nvr, value), $convert) }
        }
    )*};
}

accessors! {
    fmi2GetReal(*mut fmi2Real): get, &GET_REAL, Value::real;
    fmi2GetInteger(*mut fmi2Integer): get, &GET_INTEGER, Value::integer;
    /// Reads Booleans as 0 or 1.
    fmi2GetBoolean(*mut fmi2Boolean): get, &GET_BOOLEAN, |value| value.boolean().map(i32::from);
    fmi2GetString(*mut fmi2String): get, &GET_STRING, |_| None;
    fmi2SetReal(*const fmi2Real): set, &SET_REAL, Value::Real;
    fmi2SetInteger(*const fmi2Integer): set, &SET_INTEGER, Value::Integer;
    /// Sets Booleans; every value except 0 is true.
    fmi2SetBoolean(*const fmi2Boolean): set, &SET_BOOLEAN, |b| Value::Boolean(b != 0);
    /// Refuses every reference, because there are no strings; the values are never read.
    fmi2SetString(*const fmi2String): set, &SET_STRING, |_| Value::Boolean(false);
}

// ---- Saved states ----

/// Saves the state into the existing handle, or into a new one if it is NULL.
pub unsafe fn fmi2GetFMUstate<M: Model>(
    c: fmi2Component,
    FMUstate: *mut fmi2FMUstate,
) -> fmi2Status {
    let call = &GET_STATE;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            save_state(call, "FMUstate", FMUstate, &component.instance)
        })
    }
}

/// Restores a saved state of this or another instance, in any instance state.
pub unsafe fn fmi2SetFMUstate<M: Model>(c: fmi2Component, FMUstate: fmi2FMUstate) -> fmi2Status {
    let call = Fmi2::SET_STATE;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            component.instance.restore(saved_state(call, "FMUstate", FMUstate)?)
        })
    }
}

/// Frees a saved state and sets the handle to NULL; NULL is allowed.
pub unsafe fn fmi2FreeFMUstate<M: Model>(
    c: fmi2Component,
    FMUstate: *mut fmi2FMUstate,
) -> fmi2Status {
    let call = &FREE_STATE;
    unsafe { on::<M, Fmi2>(c, call, |_| free_state::<M, Fmi2>(call, "FMUstate", FMUstate)) }
}

pub unsafe fn fmi2SerializedFMUstateSize<M: Model>(
    c: fmi2Component,
    FMUstate: fmi2FMUstate,
    size: *mut usize,
) -> fmi2Status {
    let call = &SERIALIZED_SIZE;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |_| {
            saved_state::<M, Fmi2>(call, "FMUstate", FMUstate)?;
            *place(call, "size", size)? = snapshot::size::<M>();
            Ok(())
        })
    }
}

pub unsafe fn fmi2SerializeFMUstate<M: Model>(
    c: fmi2Component,
    FMUstate: fmi2FMUstate,
    serializedState: *mut fmi2Byte,
    size: usize,
) -> fmi2Status {
    let call = &SERIALIZE;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |_| {
            let saved = saved_state::<M, Fmi2>(call, "FMUstate", FMUstate)?;
            serialize(call, saved, serializedState.cast(), size)
        })
    }
}

pub unsafe fn fmi2DeSerializeFMUstate<M: Model>(
    c: fmi2Component,
    serializedState: *const fmi2Byte,
    size: usize,
    FMUstate: *mut fmi2FMUstate,
) -> fmi2Status {
    let call = &DESERIALIZE;
    let bytes = (serializedState.cast(), size);
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            deserialize(call, &component.instance, bytes, ("FMUstate", FMUstate))
        })
    }
}

/// Computes the derivative of the unknowns in a direction of the knowns.
pub unsafe fn fmi2GetDirectionalDerivative<M: Model>(
    c: fmi2Component,
    vUnknown_ref: *const fmi2ValueReference,
    nUnknown: usize,
    vKnown_ref: *const fmi2ValueReference,
    nKnown: usize,
    dvKnown: *const fmi2Real,
    dvUnknown: *mut fmi2Real,
) -> fmi2Status {
    let call = Fmi2::DIRECTIONAL_DERIVATIVE;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            let unknowns = array(call, "vUnknown_ref", vUnknown_ref, nUnknown)?;
            let knowns = array(call, "vKnown_ref", vKnown_ref, nKnown)?;
            let direction = array(call, "dvKnown", dvKnown, nKnown)?;
            let answers = array_mut(call, "dvUnknown", dvUnknown, nUnknown)?;
            component.instance.directional_derivative(unknowns, knowns, direction, answers)
        })
    }
}

// ---- Model Exchange ----

/// Result of fmi2NewDiscreteStates.
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

pub unsafe fn fmi2EnterEventMode<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe {
        on_start::<M, Fmi2>(c, Fmi2::ENTER_EVENT, |component| component.instance.enter_event_mode())
    }
}

/// Handles the events that are due, and tells the host whether another one follows at once and when the next
/// time event is.
pub unsafe fn fmi2NewDiscreteStates<M: Model>(
    c: fmi2Component,
    eventInfo: *mut fmi2EventInfo,
) -> fmi2Status {
    let call = Fmi2::NEW_DISCRETE_STATES;
    unsafe {
        on_start::<M, Fmi2>(c, call, |component| {
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
    }
}

pub unsafe fn fmi2EnterContinuousTimeMode<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe {
        on_start::<M, Fmi2>(c, Fmi2::ENTER_CONTINUOUS_TIME, |component| {
            component.instance.enter_continuous_time_mode()
        })
    }
}

/// Accepts a step of the host's integrator. The FMU keeps no past, so `noSetFMUStatePriorToCurrentPoint` has
/// no effect.
pub unsafe fn fmi2CompletedIntegratorStep<M: Model>(
    c: fmi2Component,
    _noSetFMUStatePriorToCurrentPoint: fmi2Boolean,
    enterEventMode: *mut fmi2Boolean,
    terminateSimulation: *mut fmi2Boolean,
) -> fmi2Status {
    let call = Fmi2::COMPLETED_STEP;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            let enter = place(call, "enterEventMode", enterEventMode)?;
            let terminate = place(call, "terminateSimulation", terminateSimulation)?;
            *enter = component.instance.completed_integrator_step()?.into();
            *terminate = 0;
            component.log.report_step_warning(&component.instance);
            Ok(())
        })
    }
}

pub unsafe fn fmi2SetTime<M: Model>(c: fmi2Component, time: fmi2Real) -> fmi2Status {
    unsafe { on_start::<M, Fmi2>(c, Fmi2::SET_TIME, |component| component.instance.set_time(time)) }
}

/// Sets the continuous states that the host has integrated.
pub unsafe fn fmi2SetContinuousStates<M: Model>(
    c: fmi2Component,
    x: *const fmi2Real,
    nx: usize,
) -> fmi2Status {
    let call = Fmi2::SET_CONTINUOUS_STATES;
    unsafe {
        on_start::<M, Fmi2>(c, call, |component| {
            component.instance.check(call)?;
            component.instance.set_continuous_states(array(call, "x", x, nx)?)
        })
    }
}

/// Fills an array of the host by `body`.
unsafe fn fill<M: Model>(
    c: fmi2Component,
    call: &'static Call,
    (name, pointer, length): (&str, *mut fmi2Real, usize),
    body: impl FnOnce(&mut Instance<M, Fmi2>, &mut [fmi2Real]) -> Result<(), Fault>,
) -> fmi2Status {
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            body(&mut component.instance, array_mut(call, name, pointer, length)?)
        })
    }
}

/// Computes the derivatives of the states, in the order of the model description.
pub unsafe fn fmi2GetDerivatives<M: Model>(
    c: fmi2Component,
    derivatives: *mut fmi2Real,
    nx: usize,
) -> fmi2Status {
    let into = ("derivatives", derivatives, nx);
    unsafe { fill::<M>(c, Fmi2::GET_DERIVATIVES, into, Instance::derivatives) }
}

/// Computes the event indicators, which change sign at events.
pub unsafe fn fmi2GetEventIndicators<M: Model>(
    c: fmi2Component,
    eventIndicators: *mut fmi2Real,
    ni: usize,
) -> fmi2Status {
    let into = ("eventIndicators", eventIndicators, ni);
    unsafe { fill::<M>(c, Fmi2::GET_EVENT_INDICATORS, into, Instance::event_indicators) }
}

/// Reads the states, in the order of the model description.
pub unsafe fn fmi2GetContinuousStates<M: Model>(
    c: fmi2Component,
    x: *mut fmi2Real,
    nx: usize,
) -> fmi2Status {
    unsafe { fill::<M>(c, Fmi2::GET_CONTINUOUS_STATES, ("x", x, nx), Instance::continuous_states) }
}

pub unsafe fn fmi2GetNominalsOfContinuousStates<M: Model>(
    c: fmi2Component,
    x_nominal: *mut fmi2Real,
    nx: usize,
) -> fmi2Status {
    let into = ("x_nominal", x_nominal, nx);
    unsafe { fill::<M>(c, Fmi2::GET_NOMINALS, into, |instance, x| instance.nominals(x)) }
}

// ---- Co-Simulation ----

/// Sets the slopes of inputs for the next step.
pub unsafe fn fmi2SetRealInputDerivatives<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    order: *const fmi2Integer,
    value: *const fmi2Real,
) -> fmi2Status {
    let call = Fmi2::SET_INPUT_DERIVATIVES;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            let references = array(call, "vr", vr, nvr)?;
            let orders = array(call, "order", order, nvr)?;
            let values = array(call, "value", value, nvr)?;
            component.instance.set_input_derivatives(references, orders, values)
        })
    }
}

/// Computes the time derivatives of outputs at the end of the last step, for hosts that extrapolate; only
/// order 1 is supported.
pub unsafe fn fmi2GetRealOutputDerivatives<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    order: *const fmi2Integer,
    value: *mut fmi2Real,
) -> fmi2Status {
    let call = Fmi2::GET_OUTPUT_DERIVATIVES;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            let references = array(call, "vr", vr, nvr)?;
            let orders = array(call, "order", order, nvr)?;
            let places = array_mut(call, "value", value, nvr)?;
            component.instance.output_derivatives(references, orders, places)
        })
    }
}

/// Makes one step. The FMU keeps no past, so `noSetFMUStatePriorToCurrentPoint` has no effect.
pub unsafe fn fmi2DoStep<M: Model>(
    c: fmi2Component,
    currentCommunicationPoint: fmi2Real,
    communicationStepSize: fmi2Real,
    _noSetFMUStatePriorToCurrentPoint: fmi2Boolean,
) -> fmi2Status {
    let call = Fmi2::DO_STEP;
    unsafe {
        on::<M, Fmi2>(c, call, |component| {
            let before = component.instance.event_count();
            component.instance.do_step(currentCommunicationPoint, communicationStepSize)?;
            component.log.report_event(call, before, &component.instance);
            component.log.report_step_warning(&component.instance);
            Ok(())
        })
    }
}

/// Refuses the call, because steps are never asynchronous.
pub unsafe fn fmi2CancelStep<M: Model>(c: fmi2Component) -> fmi2Status {
    let call = &CANCEL_STEP;
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |_| {
            Err(call.error("no step is running: fmi2DoStep returns when the step is done"))
        })
    }
}

/// Returns a property of the last step, or discards the call if `known` has no value for this kind.
unsafe fn write_step_status<M: Model, T>(
    c: fmi2Component,
    call: &'static Call,
    kind: fmi2StatusKind,
    value: *mut T,
    known: impl FnOnce(&Instance<M, Fmi2>) -> Option<T>,
) -> fmi2Status {
    unsafe {
        on_allowed::<M, Fmi2>(c, call, |component| {
            let place = place(call, "value", value)?;
            let value = known(&component.instance);
            *place = value
                .ok_or_else(|| call.discard(format_args!("status kind {kind} has no value")))?;
            Ok(())
        })
    }
}

/// Returns the status of the last step.
pub unsafe fn fmi2GetStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2Status,
) -> fmi2Status {
    let known = |instance: &Instance<M, Fmi2>| {
        let ended = if instance.state() == InstanceState::Failed { fmi2Error } else { fmi2OK };
        (s == fmi2DoStepStatus).then_some(ended)
    };
    unsafe { write_step_status::<M, _>(c, &GET_STATUS, s, value, known) }
}

/// Returns the time that the last step reached.
pub unsafe fn fmi2GetRealStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2Real,
) -> fmi2Status {
    let known =
        |instance: &Instance<M, Fmi2>| (s == fmi2LastSuccessfulTime).then_some(instance.time());
    unsafe { write_step_status::<M, _>(c, &GET_REAL_STATUS, s, value, known) }
}

/// Discards the call, because no property of the last step is an integer.
pub unsafe fn fmi2GetIntegerStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2Integer,
) -> fmi2Status {
    unsafe { write_step_status::<M, _>(c, &GET_INTEGER_STATUS, s, value, |_| None) }
}

/// Returns false for fmi2Terminated, because the FMU never ends the simulation by itself.
pub unsafe fn fmi2GetBooleanStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2Boolean,
) -> fmi2Status {
    let known = |_: &Instance<M, Fmi2>| (s == fmi2Terminated).then_some(0);
    unsafe { write_step_status::<M, _>(c, &GET_BOOLEAN_STATUS, s, value, known) }
}

/// Discards the call, because no step is ever pending.
pub unsafe fn fmi2GetStringStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2String,
) -> fmi2Status {
    unsafe { write_step_status::<M, _>(c, &GET_STRING_STATUS, s, value, |_| None) }
}

/// Exports the functions of FMI 2.0 for a model, under their C names and as Rust functions of the module in
/// which the macro is used. It is a macro because each FMU must define these symbols itself.
#[macro_export]
macro_rules! export_fmi2 {
    ($model:ty) => {
        $crate::export_fmi2! { $model;
            fn fmi2SetDebugLogging(c: fmi2Component, loggingOn: fmi2Boolean, nCategories: usize, categories: *const fmi2String) -> fmi2Status;
            fn fmi2Instantiate(instanceName: fmi2String, fmuType: fmi2Type, fmuGUID: fmi2String, fmuResourceLocation: fmi2String, functions: *const fmi2CallbackFunctions, visible: fmi2Boolean, loggingOn: fmi2Boolean) -> fmi2Component;
            fn fmi2FreeInstance(c: fmi2Component);
            fn fmi2SetupExperiment(c: fmi2Component, toleranceDefined: fmi2Boolean, tolerance: fmi2Real, startTime: fmi2Real, stopTimeDefined: fmi2Boolean, stopTime: fmi2Real) -> fmi2Status;
            fn fmi2EnterInitializationMode(c: fmi2Component) -> fmi2Status;
            fn fmi2ExitInitializationMode(c: fmi2Component) -> fmi2Status;
            fn fmi2Terminate(c: fmi2Component) -> fmi2Status;
            fn fmi2Reset(c: fmi2Component) -> fmi2Status;
            fn fmi2GetReal(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut fmi2Real) -> fmi2Status;
            fn fmi2GetInteger(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut fmi2Integer) -> fmi2Status;
            fn fmi2GetBoolean(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut fmi2Boolean) -> fmi2Status;
            fn fmi2GetString(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut fmi2String) -> fmi2Status;
            fn fmi2SetReal(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const fmi2Real) -> fmi2Status;
            fn fmi2SetInteger(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const fmi2Integer) -> fmi2Status;
            fn fmi2SetBoolean(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const fmi2Boolean) -> fmi2Status;
            fn fmi2SetString(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const fmi2String) -> fmi2Status;
            fn fmi2GetFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> fmi2Status;
            fn fmi2SetFMUstate(c: fmi2Component, FMUstate: fmi2FMUstate) -> fmi2Status;
            fn fmi2FreeFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> fmi2Status;
            fn fmi2SerializedFMUstateSize(c: fmi2Component, FMUstate: fmi2FMUstate, size: *mut usize) -> fmi2Status;
            fn fmi2SerializeFMUstate(c: fmi2Component, FMUstate: fmi2FMUstate, serializedState: *mut fmi2Byte, size: usize) -> fmi2Status;
            fn fmi2DeSerializeFMUstate(c: fmi2Component, serializedState: *const fmi2Byte, size: usize, FMUstate: *mut fmi2FMUstate) -> fmi2Status;
            fn fmi2GetDirectionalDerivative(c: fmi2Component, vUnknown_ref: *const fmi2ValueReference, nUnknown: usize, vKnown_ref: *const fmi2ValueReference, nKnown: usize, dvKnown: *const fmi2Real, dvUnknown: *mut fmi2Real) -> fmi2Status;
            fn fmi2EnterEventMode(c: fmi2Component) -> fmi2Status;
            fn fmi2NewDiscreteStates(c: fmi2Component, eventInfo: *mut fmi2EventInfo) -> fmi2Status;
            fn fmi2EnterContinuousTimeMode(c: fmi2Component) -> fmi2Status;
            fn fmi2CompletedIntegratorStep(c: fmi2Component, noSetFMUStatePriorToCurrentPoint: fmi2Boolean, enterEventMode: *mut fmi2Boolean, terminateSimulation: *mut fmi2Boolean) -> fmi2Status;
            fn fmi2SetTime(c: fmi2Component, time: fmi2Real) -> fmi2Status;
            fn fmi2SetContinuousStates(c: fmi2Component, x: *const fmi2Real, nx: usize) -> fmi2Status;
            fn fmi2GetDerivatives(c: fmi2Component, derivatives: *mut fmi2Real, nx: usize) -> fmi2Status;
            fn fmi2GetEventIndicators(c: fmi2Component, eventIndicators: *mut fmi2Real, ni: usize) -> fmi2Status;
            fn fmi2GetContinuousStates(c: fmi2Component, x: *mut fmi2Real, nx: usize) -> fmi2Status;
            fn fmi2GetNominalsOfContinuousStates(c: fmi2Component, x_nominal: *mut fmi2Real, nx: usize) -> fmi2Status;
            fn fmi2SetRealInputDerivatives(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, order: *const fmi2Integer, value: *const fmi2Real) -> fmi2Status;
            fn fmi2GetRealOutputDerivatives(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, order: *const fmi2Integer, value: *mut fmi2Real) -> fmi2Status;
            fn fmi2DoStep(c: fmi2Component, currentCommunicationPoint: fmi2Real, communicationStepSize: fmi2Real, noSetFMUStatePriorToCurrentPoint: fmi2Boolean) -> fmi2Status;
            fn fmi2CancelStep(c: fmi2Component) -> fmi2Status;
            fn fmi2GetStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Status) -> fmi2Status;
            fn fmi2GetRealStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Real) -> fmi2Status;
            fn fmi2GetIntegerStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Integer) -> fmi2Status;
            fn fmi2GetBooleanStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Boolean) -> fmi2Status;
            fn fmi2GetStringStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2String) -> fmi2Status;
        }
        #[allow(missing_docs, non_snake_case)]
        #[unsafe(no_mangle)]
        pub extern "C" fn fmi2GetTypesPlatform() -> $crate::v2::fmi2String {
            $crate::v2::fmi2GetTypesPlatform()
        }
        #[allow(missing_docs, non_snake_case)]
        #[unsafe(no_mangle)]
        pub extern "C" fn fmi2GetVersion() -> $crate::v2::fmi2String {
            $crate::v2::fmi2GetVersion()
        }
    };
    ($model:ty; $(fn $name:ident($($argument:ident: $type:ty),*) $(-> $status:ty)?;)*) => {
        $(
            #[allow(missing_docs, non_snake_case, unsafe_code, clippy::missing_safety_doc)]
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $name($($argument: $type),*) $(-> $status)? {
                unsafe { $crate::v2::$name::<$model>($($argument),*) }
            }
        )*
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spring::Spring;

    #[test]
    fn the_version_is_2_0_on_the_default_platform() {
        let said = [fmi2GetVersion(), fmi2GetTypesPlatform()].map(|said| unsafe { text(said) });
        assert_eq!(said, [Some("2.0".into()), Some("default".into())]);
    }

    /// An instance without a logger.
    fn instantiate() -> fmi2Component {
        let callbacks = fmi2CallbackFunctions {
            logger: None,
            allocateMemory: None,
            freeMemory: None,
            stepFinished: None,
            componentEnvironment: ptr::null_mut(),
        };
        let guid = c_string(Spring::table().guid());
        let made = unsafe {
            let name = c"one".as_ptr();
            fmi2Instantiate::<Spring>(
                name,
                fmi2CoSimulation,
                guid.as_ptr(),
                ptr::null(),
                &callbacks,
                0,
                0,
            )
        };
        assert!(!made.is_null());
        made
    }

    #[test]
    fn panic_is_fatal_then_and_later_and_freeing_still_works() {
        let c = instantiate();
        let mut state = ptr::null_mut();
        unsafe {
            assert_eq!(fmi2GetFMUstate::<Spring>(c, &mut state), fmi2OK);
            assert_eq!(
                on::<Spring, Fmi2>(c, Fmi2::DO_STEP, |_| panic!("this is a test")),
                fmi2Fatal
            );
            assert_eq!(fmi2Reset::<Spring>(c), fmi2Fatal);
            assert_eq!(fmi2GetReal::<Spring>(c, ptr::null(), 0, ptr::null_mut()), fmi2Fatal);
            assert_eq!(fmi2GetFMUstate::<Spring>(c, &mut state), fmi2Fatal);
            assert_eq!(fmi2SetFMUstate::<Spring>(c, state), fmi2Fatal);
            assert_eq!(fmi2GetStatus::<Spring>(c, fmi2DoStepStatus, &mut 0), fmi2Fatal);
            assert_eq!(fmi2FreeFMUstate::<Spring>(c, &mut state), fmi2OK);
            assert!(state.is_null());
            fmi2FreeInstance::<Spring>(c);
        }
    }

    #[test]
    fn handles_that_are_no_instance_are_an_error() {
        let mut other = [0u64; 64];
        for handle in [ptr::null_mut(), other.as_mut_ptr().cast()] {
            unsafe {
                assert_eq!(fmi2Reset::<Spring>(handle), fmi2Error);
                assert_eq!(fmi2DoStep::<Spring>(handle, 0.0, 1.0, 0), fmi2Error);
                fmi2FreeInstance::<Spring>(handle);
            }
        }
    }

    #[test]
    fn null_is_fine_for_nothing_and_an_error_otherwise() {
        let c = instantiate();
        unsafe {
            assert_eq!(fmi2SetReal::<Spring>(c, ptr::null(), 0, ptr::null()), fmi2OK);
            assert_eq!(fmi2GetString::<Spring>(c, ptr::null(), 0, ptr::null_mut()), fmi2OK);
            assert_eq!(fmi2SetReal::<Spring>(c, ptr::null(), 1, ptr::null()), fmi2Error);
            assert_eq!(fmi2SetReal::<Spring>(c, &0, 1, ptr::null()), fmi2Error);
            assert_eq!(fmi2GetReal::<Spring>(c, &0, 1, ptr::null_mut()), fmi2Error);
            assert_eq!(fmi2SetDebugLogging::<Spring>(c, 1, 0, ptr::null()), fmi2OK);
            assert_eq!(fmi2SetDebugLogging::<Spring>(c, 1, 1, ptr::null()), fmi2Error);
            assert_eq!(fmi2SetDebugLogging::<Spring>(c, 1, 1, &ptr::null()), fmi2Error);
            assert_eq!(fmi2GetFMUstate::<Spring>(c, ptr::null_mut()), fmi2Error);
            assert_eq!(fmi2SetFMUstate::<Spring>(c, ptr::null_mut()), fmi2Error);
            assert_eq!(fmi2FreeFMUstate::<Spring>(c, ptr::null_mut()), fmi2OK);
            assert_eq!(fmi2FreeFMUstate::<Spring>(c, &mut ptr::null_mut()), fmi2OK);
            assert_eq!(
                fmi2DeSerializeFMUstate::<Spring>(c, ptr::null(), 8, &mut ptr::null_mut()),
                fmi2Error
            );
            assert_eq!(
                fmi2GetRealStatus::<Spring>(c, fmi2LastSuccessfulTime, ptr::null_mut()),
                fmi2Error
            );
            fmi2FreeInstance::<Spring>(c);
        }
    }

    #[test]
    fn handle_of_a_saved_state_is_reused() {
        let c = instantiate();
        let mut state = ptr::null_mut();
        unsafe {
            assert_eq!(fmi2GetFMUstate::<Spring>(c, &mut state), fmi2OK);
            let first = state;
            assert_eq!(fmi2GetFMUstate::<Spring>(c, &mut state), fmi2OK);
            assert_eq!(state, first);
            // The same bytes fit only if there is room for all of them.
            let mut size = 0;
            assert_eq!(fmi2SerializedFMUstateSize::<Spring>(c, state, &mut size), fmi2OK);
            let mut bytes = vec![0; size];
            assert_eq!(
                fmi2SerializeFMUstate::<Spring>(c, state, bytes.as_mut_ptr(), size - 1),
                fmi2Error
            );
            assert_eq!(fmi2SerializeFMUstate::<Spring>(c, state, bytes.as_mut_ptr(), size), fmi2OK);
            // The handle need not be set.
            let mut another: fmi2FMUstate = ptr::without_provenance_mut(0xdead_beef);
            assert_eq!(
                fmi2DeSerializeFMUstate::<Spring>(c, bytes.as_ptr(), size, &mut another),
                fmi2OK
            );
            assert_eq!(fmi2SetFMUstate::<Spring>(c, another), fmi2OK);
            assert_eq!(fmi2FreeFMUstate::<Spring>(c, &mut another), fmi2OK);
            assert_eq!(fmi2FreeFMUstate::<Spring>(c, &mut state), fmi2OK);
            fmi2FreeInstance::<Spring>(c);
        }
    }

    #[test]
    fn questions_without_an_answer_are_discarded() {
        let c = instantiate();
        unsafe {
            assert_eq!(fmi2GetRealStatus::<Spring>(c, fmi2Terminated, &mut 0.0), fmi2Discard);
            assert_eq!(fmi2GetIntegerStatus::<Spring>(c, fmi2DoStepStatus, &mut 0), fmi2Discard);
            assert_eq!(
                fmi2GetStringStatus::<Spring>(c, fmi2PendingStatus, &mut ptr::null()),
                fmi2Discard
            );
            let mut terminated = 1;
            assert_eq!(fmi2GetBooleanStatus::<Spring>(c, fmi2Terminated, &mut terminated), fmi2OK);
            assert_eq!(terminated, 0);
            fmi2FreeInstance::<Spring>(c);
        }
    }

    #[test]
    fn instance_is_refused_without_name_or_guid_and_of_an_unknown_type() {
        let guid = Some(Spring::table().guid().to_string());
        let name = Some("one".to_string());
        let made = |name, kind, guid| {
            interface::<Spring>(name, kind, guid, None).map(|(interface, _)| interface)
        };
        assert_eq!(made(name.clone(), 0, guid.clone()), Ok(Interface::ModelExchange));
        assert_eq!(made(name.clone(), 1, guid.clone()), Ok(Interface::CoSimulation));
        assert!(made(None, fmi2CoSimulation, guid.clone()).is_err());
        assert!(made(Some(" ".into()), fmi2CoSimulation, guid.clone()).is_err());
        assert!(made(name.clone(), 7, guid).unwrap_err().contains('7'));
        assert!(made(name.clone(), fmi2CoSimulation, None).unwrap_err().contains("NULL"));
        let wrong = made(name, fmi2CoSimulation, Some("{0}".into())).unwrap_err();
        assert!(wrong.contains("{0}") && wrong.contains(Spring::table().guid()));
    }
}

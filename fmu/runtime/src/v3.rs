//! FMI 3.0, Model Exchange and Co-Simulation: 75 functions, their names, signatures and numbers.
//!
//! Every function is generic in the model; [`crate::export_fmi3`] exports them for one model under
//! their names. What the functions mean is in [`crate::instance`] and [`crate::snapshot`], what C
//! asks for in any version in [`crate::c_abi`].
//!
//! A value reference is a scalar's place among the variables, counted from 1. Behind the table's follow the
//! independent variable and the event indicators, which FMI 2.0 has no variables for. There are no clocks and no binary
//! variables: functions for these answer as the standard asks of an FMU that has none.
//!
//! A host that has read the description with arrays, known by its token, counts the table's entries instead, and means
//! all scalars of an array by its reference ([`arrays`]).

#![allow(unsafe_code)]
// The names are the standard's.
#![allow(non_camel_case_types, non_upper_case_globals, non_snake_case)]
// The safety contract of every function is the FMI 3.0 standard's: an instance comes from one of the functions that
// make one and is not yet freed, arrays have the lengths given, strings end with NUL.
#![allow(clippy::missing_safety_doc, clippy::too_many_arguments)]

use std::borrow::Cow;
use std::cmp::Ordering::{Equal, Greater};
use std::ffi::{c_char, c_int, c_void};
use std::panic::catch_unwind;
use std::ptr;

use self::arrays::Arrays;
use crate::c_abi::{
    self, Component, Log, Logger, array, array_mut, c_string, free_component, free_state,
    new_component, new_state, null, on, on_start, place, saved_state, text,
};
use crate::call::states::*;
use crate::call::{CType, Call, Events, Fault, InstanceState, Interface, Severity};
use crate::instance::{Instance, StepInfo};
use crate::log::Filter;
use crate::model::Model;
use crate::snapshot;
use crate::table::{Layout, Scalar};
use crate::variable::{
    Access, Causality, Dimension, Kind, Value, Variable, is_finite, text as number,
};
use crate::version::Version;

pub mod arrays;

/// An instance, opaque to the host.
pub type fmi3Instance = *mut c_void;
/// The host's own pointer, handed back to it.
pub type fmi3InstanceEnvironment = *mut c_void;
/// A saved state, opaque to the host.
pub type fmi3FMUState = *mut c_void;
/// The number of a variable.
pub type fmi3ValueReference = u32;
/// A real number.
pub type fmi3Float64 = f64;
/// A short real number.
pub type fmi3Float32 = f32;
/// An integer.
pub type fmi3Int32 = i32;
/// The number of an enumeration's item.
pub type fmi3Int64 = i64;
/// An unsigned integer.
pub type fmi3UInt64 = u64;
/// C's bool, one byte: 0 is false, everything else true. As a Rust bool, other bytes than 0 and 1 would be
/// undefined behaviour.
pub type fmi3Boolean = u8;
/// Text that ends with NUL.
pub type fmi3String = *const c_char;
/// A byte of a saved state, or of a binary variable.
pub type fmi3Byte = u8;
/// The bytes of a binary variable.
pub type fmi3Binary = *const fmi3Byte;
/// True if a clock ticks.
pub type fmi3Clock = bool;

/// Return value of a call.
pub type fmi3Status = c_abi::Status;
/// All is well.
pub const fmi3OK: fmi3Status = c_abi::OK;
/// Never returned.
pub const fmi3Warning: fmi3Status = c_abi::WARNING;
/// The call has no answer, or a value was out of its range; the instance is as before.
pub const fmi3Discard: fmi3Status = c_abi::DISCARD;
/// The call was refused or failed; the simulation is terminated.
pub const fmi3Error: fmi3Status = c_abi::ERROR;
/// The instance is unusable.
pub const fmi3Fatal: fmi3Status = c_abi::FATAL;

/// Kind of the dependency of an unknown on a known.
pub type fmi3DependencyKind = c_int;
/// Nothing particular.
pub const fmi3Dependent: fmi3DependencyKind = 1;

/// Qualifier of a clock's interval.
pub type fmi3IntervalQualifier = c_int;

/// The host's logger.
pub type fmi3LogMessageCallback = Option<
    unsafe extern "C" fn(
        environment: fmi3InstanceEnvironment,
        status: fmi3Status,
        category: fmi3String,
        message: fmi3String,
    ),
>;

/// Callback of the host within a step.
pub type fmi3IntermediateUpdateCallback = Option<
    unsafe extern "C" fn(
        environment: fmi3InstanceEnvironment,
        intermediateUpdateTime: fmi3Float64,
        intermediateVariableSetRequested: fmi3Boolean,
        intermediateVariableGetAllowed: fmi3Boolean,
        intermediateStepFinished: fmi3Boolean,
        canReturnEarly: fmi3Boolean,
        earlyReturnRequested: *mut fmi3Boolean,
        earlyReturnTime: *mut fmi3Float64,
    ),
>;

/// Callback of Scheduled Execution.
pub type fmi3ClockUpdateCallback =
    Option<unsafe extern "C" fn(environment: fmi3InstanceEnvironment)>;
/// Callback of Scheduled Execution.
pub type fmi3LockPreemptionCallback = Option<unsafe extern "C" fn()>;
/// Callback of Scheduled Execution.
pub type fmi3UnlockPreemptionCallback = Option<unsafe extern "C" fn()>;

// ---- Which functions there are, and when each may be called ----

const fn both(name: &'static str, allowed: u16) -> Call {
    Call::new(name, allowed)
}

const fn of(c_type: CType, name: &'static str, allowed: u16) -> Call {
    Call::new(name, allowed).of(c_type)
}

/// Restricts a call to Co-Simulation.
const fn cs(call: Call) -> Call {
    call.only_in(Interface::CoSimulation)
}

/// Restricts a call to Model Exchange.
const fn me(call: Call) -> Call {
    call.only_in(Interface::ModelExchange)
}

/// In which states values are got and set.
const GET: u16 = ANY;
const SET: u16 = I | M | S | E | C;

/// The functions that one operation of an instance has several of, and those that are the C interface's own.
#[allow(missing_docs)]
#[rustfmt::skip]
mod list {
    use super::*;
    pub static SET_DEBUG_LOGGING:   Call = both("fmi3SetDebugLogging", ANY | CONFIGURATION);
    pub static GET_FLOAT64:         Call = of(CType::Real, "fmi3GetFloat64", GET | INTERMEDIATE);
    pub static GET_INT32:           Call = of(CType::Integer, "fmi3GetInt32", GET);
    pub static GET_INT64:           Call = of(CType::Enumeration, "fmi3GetInt64", GET);
    pub static GET_BOOLEAN:         Call = of(CType::Boolean, "fmi3GetBoolean", GET);
    pub static SET_FLOAT64:         Call = of(CType::Real, "fmi3SetFloat64", SET | INTERMEDIATE);
    pub static SET_INT32:           Call = of(CType::Integer, "fmi3SetInt32", SET);
    pub static SET_INT64:           Call = of(CType::Enumeration, "fmi3SetInt64", SET);
    pub static SET_BOOLEAN:         Call = of(CType::Boolean, "fmi3SetBoolean", SET);
    pub static GET_UINT64:          Call = of(CType::Size, "fmi3GetUInt64", GET | CONFIGURATION);
    pub static SET_UINT64:          Call = of(CType::Size, "fmi3SetUInt64", SET | CONFIGURATION);
    // The same where there is a structural parameter, which is an integer in the table.
    pub static GET_SIZE:            Call = of(CType::Integer, "fmi3GetUInt64", GET | CONFIGURATION);
    pub static SET_SIZE:            Call = of(CType::Integer, "fmi3SetUInt64", CONFIGURATION);
    pub static NUMBER_OF_DEPENDENCIES: Call = of(CType::Real, "fmi3GetNumberOfVariableDependencies", ANY);
    pub static DEPENDENCIES:        Call = of(CType::Real, "fmi3GetVariableDependencies", ANY);
    pub static GET_STATE:           Call = both("fmi3GetFMUState", ANY);
    pub static FREE_STATE:          Call = both("fmi3FreeFMUState", ANY | CONFIGURATION | FATAL);
    pub static SERIALIZED_SIZE:     Call = both("fmi3SerializedFMUStateSize", ANY);
    pub static SERIALIZE:           Call = both("fmi3SerializeFMUState", ANY);
    pub static DESERIALIZE:         Call = both("fmi3DeserializeFMUState", ANY);
    pub static ADJOINT_DERIVATIVE:  Call = both("fmi3GetAdjointDerivative", M | RUN);
    pub static ENTER_CONFIGURATION: Call = both("fmi3EnterConfigurationMode", I);
    pub static EXIT_CONFIGURATION:  Call = both("fmi3ExitConfigurationMode", CONFIGURATION);
    pub static EVALUATE_DISCRETE_STATES: Call = both("fmi3EvaluateDiscreteStates", M | E);
    // The standard has the two numbers in fewer states; fmusim 0.8 asks in continuous-time mode.
    pub static NUMBER_OF_INDICATORS: Call = me(both("fmi3GetNumberOfEventIndicators", ANY | CONFIGURATION));
    pub static NUMBER_OF_STATES:    Call = me(both("fmi3GetNumberOfContinuousStates", ANY | CONFIGURATION));
    pub static ENTER_STEP:          Call = cs(both("fmi3EnterStepMode", E));
}
pub use list::*;

/// FMI 3.0
#[derive(Clone, Copy, Debug)]
pub struct Fmi3;

#[rustfmt::skip]
impl Version for Fmi3 {
    const PREFIX: &'static str = "fmi3";

    type Host<M: Model> = Host<M>;

    const AFTER_ERROR: Option<InstanceState> = Some(InstanceState::Terminated);
    const OUT_OF_RANGE: Severity = Severity::Discard;
    const FIRST_EVENT: InstanceState = InstanceState::Event;
    const SETS_STATES: bool = true;

    // There is no such function: what it tells is told with initialization.
    const SETUP_EXPERIMENT:       &'static Call = &both("fmi3EnterInitializationMode", I);
    const ENTER_INITIALIZATION:   &'static Call = &both("fmi3EnterInitializationMode", I);
    const EXIT_INITIALIZATION:    &'static Call = &both("fmi3ExitInitializationMode", M);
    const TERMINATE:              &'static Call = &both("fmi3Terminate", S | E | C);
    const RESET:                  &'static Call = &both("fmi3Reset", ANY | CONFIGURATION);
    const SET_STATE:              &'static Call = &both("fmi3SetFMUState", ANY);
    const DIRECTIONAL_DERIVATIVE: &'static Call = &of(CType::Real, "fmi3GetDirectionalDerivative", M | RUN);

    // Inputs have slopes by intermediate update.
    const SET_INPUT_DERIVATIVES:  &'static Call = &cs(of(CType::Real, "fmi3SetFloat64", INTERMEDIATE));
    const GET_OUTPUT_DERIVATIVES: &'static Call = &cs(of(CType::Real, "fmi3GetOutputDerivatives", S | T | INTERMEDIATE));
    const DO_STEP:                &'static Call = &cs(both("fmi3DoStep", S));

    const ENTER_EVENT:            &'static Call = &both("fmi3EnterEventMode", S | C);
    const NEW_DISCRETE_STATES:    &'static Call = &both("fmi3UpdateDiscreteStates", E);
    const ENTER_CONTINUOUS_TIME:  &'static Call = &me(both("fmi3EnterContinuousTimeMode", E));
    const COMPLETED_STEP:         &'static Call = &me(both("fmi3CompletedIntegratorStep", C));
    const SET_TIME:               &'static Call = &me(both("fmi3SetTime", C));
    const SET_CONTINUOUS_STATES:  &'static Call = &me(both("fmi3SetContinuousStates", C));
    const GET_DERIVATIVES:        &'static Call = &me(both("fmi3GetContinuousStateDerivatives", M | E | C | T));
    const GET_EVENT_INDICATORS:   &'static Call = &me(both("fmi3GetEventIndicators", M | E | C | T));
    const GET_CONTINUOUS_STATES:  &'static Call = &me(both("fmi3GetContinuousStates", M | E | C | T));
    const GET_NOMINALS:           &'static Call = &me(both("fmi3GetNominalsOfContinuousStates", ANY));

    fn token<M: Model>(layout: Layout) -> &'static str {
        M::table().token(layout)
    }

    fn events(interface: Interface) -> Events {
        match interface {
            Interface::ModelExchange => Events::ByHost,
            Interface::CoSimulation => Events::InStep,
        }
    }

    fn allows(interface: Interface, events: Events) -> bool {
        let reported = interface == Interface::CoSimulation && events == Events::Reported;
        reported || events == Self::events(interface)
    }

    fn reference<M: Model>(scalar: &Scalar<M>) -> u32 {
        scalar.index + 1
    }

    #[inline]
    fn scalar<M: Model>(reference: u32, c_type: Option<CType>) -> Result<&'static Scalar<M>, String> {
        match M::table().scalars.get(reference.wrapping_sub(1) as usize) {
            Some(scalar) if c_type == Some(type_of(scalar)) => Ok(scalar),
            other => Err(wrong_reference(reference, other, c_type)),
        }
    }
}

/// The C type in which FMI 3.0 passes a scalar.
#[inline]
pub(crate) fn type_of<M: Model>(scalar: &Scalar<M>) -> CType {
    match scalar.c_type {
        CType::Integer if matches!(scalar.variable.kind, Kind::Enumeration(_)) => {
            CType::Enumeration
        }
        other => other,
    }
}

/// Name of a type in FMI 3.0.
fn type_name(c_type: CType) -> &'static str {
    match c_type {
        CType::Real => "Float64",
        CType::Integer => "Int32",
        CType::Enumeration => "Enumeration (Int64)",
        CType::Size => "UInt64",
        CType::Boolean => "Boolean",
        CType::String => "String",
    }
}

#[cold]
fn wrong_reference<M: Model>(
    reference: u32,
    found: Option<&Scalar<M>>,
    wanted: Option<CType>,
) -> String {
    match found {
        Some(scalar) => {
            let is = type_name(type_of(scalar));
            format!("{} (value reference {reference}) is of type {is}", scalar.name())
        }
        None if extra::<M>(reference).is_some() => {
            let name = extra_name::<M>(reference).unwrap_or_default();
            match wanted {
                Some(CType::Real) => {
                    format!("{name} (value reference {reference}) can only be read")
                }
                _ => format!("{name} (value reference {reference}) is of type Float64"),
            }
        }
        None => format!(
            "no variable has the value reference {reference} (allowed: 1 to {})",
            M::table().scalars.len() + 1 + M::table().about.event_indicators
        ),
    }
}

// ---- Variables that FMI 2.0 has no need of ----

/// A variable behind those of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extra {
    /// The independent variable.
    Time,
    /// An event indicator.
    Indicator(usize),
}

/// The extra variable of a value reference.
#[inline]
fn extra<M: Model>(reference: u32) -> Option<Extra> {
    let beyond = (reference as usize).checked_sub(M::table().scalars.len() + 1)?;
    match beyond.checked_sub(1) {
        None => Some(Extra::Time),
        Some(n) => (n < M::table().about.event_indicators).then_some(Extra::Indicator(n)),
    }
}

/// The names of the extra variables, in the order of their value references.
pub fn extra_names<M: Model>() -> Vec<String> {
    let indicators = 1..=M::table().about.event_indicators;
    let indicators = indicators.map(|n| format!("event_indicator[{n}]"));
    std::iter::once("time".to_string()).chain(indicators).collect()
}

/// The value reference of the independent variable, which the first indicator's follows.
pub fn time_reference<M: Model>() -> u32 {
    M::table().scalars.len() as u32 + 1
}

fn extra_name<M: Model>(reference: u32) -> Option<String> {
    let place = reference.checked_sub(time_reference::<M>())?;
    extra_names::<M>().into_iter().nth(place as usize)
}

// ---- The host ----

/// Data that an instance of FMI 3.0 keeps about its host.
pub struct Host<M: Model> {
    environment: fmi3InstanceEnvironment,
    intermediate_update: fmi3IntermediateUpdateCallback,
    early_return_allowed: bool,
    /// The variables that the host wants within steps.
    required: Vec<fmi3ValueReference>,
    /// Present phase of an intermediate update.
    phase: Phase,
    /// The inputs at the end of the piece that comes, as far as they are set.
    ends: M::Inputs,
    /// Inputs that are set.
    set: Vec<fmi3ValueReference>,
    /// Room for event indicators.
    indicators: Vec<f64>,
    /// The scalars behind the variables that it knows, if these are not the scalars.
    arrays: Option<Box<Arrays>>,
    /// The variables that it wants within steps, as it knows them.
    required_variables: Vec<fmi3ValueReference>,
}

/// Phases of an intermediate update, by the calls that a host may make.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Set,
    Get,
}

impl<M: Model> Host<M> {
    fn new(environment: fmi3InstanceEnvironment) -> Host<M> {
        Host {
            environment,
            intermediate_update: None,
            early_return_allowed: false,
            required: Vec::new(),
            phase: Phase::Get,
            ends: M::Inputs::default(),
            set: Vec::new(),
            indicators: vec![0.0; M::table().about.event_indicators],
            arrays: None,
            required_variables: Vec::new(),
        }
    }
}

/// Returns true if hosts may get or set a variable within a step; an input that follows others has no end value of its own.
pub fn has_intermediate_update<M: Model>(variable: &Variable<M>) -> bool {
    matches!(variable.causality, Causality::Input | Causality::Output)
        && variable.c_type() == CType::Real
        && !variable.follows_inputs
}

// ---- Inquiry, life and death ----

/// "3.0"
pub fn fmi3GetVersion() -> fmi3String {
    c"3.0".as_ptr()
}

/// Chooses what is logged; why calls fail is logged always.
pub unsafe fn fmi3SetDebugLogging<M: Model>(
    instance: fmi3Instance,
    loggingOn: fmi3Boolean,
    nCategories: usize,
    categories: *const fmi3String,
) -> fmi3Status {
    let call = &SET_DEBUG_LOGGING;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let mut names = Vec::new();
            for category in array(call, "categories", categories, nCategories)? {
                names.push(text(*category).ok_or_else(|| null(call, "categories[]"))?);
            }
            let filter = Filter::of(&names, M::table()).map_err(|why| call.error(why))?;
            component.log.filter =
                if loggingOn == 0 { Filter::ERRORS } else { filter.with_errors() };
            Ok(())
        })
    }
}

/// The host's logger. In a message '#' begins a reference to a variable, unless there are two.
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

/// Makes an instance. NULL on failure, and the logger is told why.
unsafe fn instantiate<M: Model>(
    function: &str,
    (name, token): (fmi3String, fmi3String),
    (environment, log_message): (fmi3InstanceEnvironment, fmi3LogMessageCallback),
    make: impl FnOnce(Option<&Arrays>) -> Result<(Instance<M, Fmi3>, Host<M>), String>,
) -> fmi3Instance {
    c_abi::silence_panics();
    let made = catch_unwind(std::panic::AssertUnwindSafe(|| unsafe {
        let log = Log::new(logger(environment, log_message));
        let made = check_token::<M>(text(name), text(token)).and_then(|layout| {
            let arrays = arrays::for_layout::<M>(layout, &M::table().starts());
            let (mut instance, mut host) = make(arrays.as_deref())?;
            instance.layout = layout;
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

/// What the variables are in the model description of this token, or why there can be no instance of this name, for
/// this model description.
fn check_token<M: Model>(name: Option<String>, token: Option<String>) -> Result<Layout, String> {
    let [scalars, with_arrays] = Layout::ALL.map(|layout| M::table().token(layout));
    if name.is_none_or(|name| name.trim().is_empty()) {
        return Err("instanceName is NULL or empty".into());
    }
    let expected = || format!("expected {scalars}, or {with_arrays} with arrays");
    match token {
        None => Err(format!("instantiationToken is NULL; {}", expected())),
        Some(token) if token == scalars => Ok(Layout::Scalars),
        Some(token) if token == with_arrays => Ok(Layout::Arrays),
        Some(token) => Err(format!(
            "instantiationToken is {token}; {}: model description and binary do not belong together",
            expected()
        )),
    }
}

/// An instance whose host integrates.
pub unsafe fn fmi3InstantiateModelExchange<M: Model>(
    instanceName: fmi3String,
    instantiationToken: fmi3String,
    _resourcePath: fmi3String,
    _visible: fmi3Boolean,
    _loggingOn: fmi3Boolean,
    instanceEnvironment: fmi3InstanceEnvironment,
    logMessage: fmi3LogMessageCallback,
) -> fmi3Instance {
    unsafe {
        instantiate::<M>(
            "fmi3InstantiateModelExchange",
            (instanceName, instantiationToken),
            (instanceEnvironment, logMessage),
            |_| {
                let instance = Instance::new(Interface::ModelExchange);
                Ok((instance, Host::new(instanceEnvironment)))
            },
        )
    }
}

/// An instance that integrates itself.
pub unsafe fn fmi3InstantiateCoSimulation<M: Model>(
    instanceName: fmi3String,
    instantiationToken: fmi3String,
    _resourcePath: fmi3String,
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
            (instanceName, instantiationToken),
            (instanceEnvironment, logMessage),
            |arrays| {
                let call = &both("fmi3InstantiateCoSimulation", 0);
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

/// There is no Scheduled Execution.
pub unsafe fn fmi3InstantiateScheduledExecution<M: Model>(
    instanceName: fmi3String,
    instantiationToken: fmi3String,
    _resourcePath: fmi3String,
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
            (instanceName, instantiationToken),
            (instanceEnvironment, logMessage),
            |_| Err("this FMU has Model Exchange and Co-Simulation, no Scheduled Execution".into()),
        )
    }
}

/// Frees an instance; NULL is fine.
pub unsafe fn fmi3FreeInstance<M: Model>(instance: fmi3Instance) {
    unsafe { free_component::<M, Fmi3>(instance) }
}

/// Tells times and tolerance; from here on all variables can be read.
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

/// From here on parameters are fixed, and events are handled or steps made.
pub unsafe fn fmi3ExitInitializationMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on_start::<M, Fmi3>(instance, Fmi3::EXIT_INITIALIZATION, |component| {
            component.instance.exit_initialization_mode()
        })
    }
}

/// At an event.
pub unsafe fn fmi3EnterEventMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, Fmi3::ENTER_EVENT, |component| {
            component.instance.enter_event_mode()
        })
    }
}

/// Ends the simulation; values can still be read.
pub unsafe fn fmi3Terminate<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe { on::<M, Fmi3>(instance, Fmi3::TERMINATE, |component| component.instance.terminate()) }
}

/// Resets the instance to its state after instantiation.
pub unsafe fn fmi3Reset<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, Fmi3::RESET, |component| {
            component.instance.reset()?;
            resize(component);
            Ok(())
        })
    }
}

// ---- Arrays ----

/// The scalars behind value references of the host's.
fn scalars_of<'a, M: Model>(
    component: &Component<M, Fmi3>,
    call: &Call,
    references: &'a [fmi3ValueReference],
) -> Result<Cow<'a, [u32]>, Fault> {
    match &component.host.arrays {
        None => Ok(Cow::Borrowed(references)),
        Some(arrays) => expand::<M>(arrays, call, references).map(Cow::Owned),
    }
}

/// The scalars behind variables, if they pass in the C type that the call is for.
fn expand<M: Model>(
    arrays: &Arrays,
    call: &Call,
    references: &[fmi3ValueReference],
) -> Result<Vec<u32>, Fault> {
    let mut scalars = Vec::with_capacity(references.len());
    for reference in references {
        match arrays.of(*reference) {
            Some(all) if call.c_type.is_none_or(|t| t == arrays.c_type(*reference)) => {
                scalars.extend_from_slice(all);
            }
            _ => return Err(call.error(wrong_variable::<M>(arrays, *reference))),
        }
    }
    Ok(scalars)
}

#[cold]
fn wrong_variable<M: Model>(arrays: &Arrays, reference: u32) -> String {
    match arrays::name::<M>(reference) {
        Some(name) => {
            let is = type_name(arrays.c_type(reference));
            format!("{name} (value reference {reference}) is of type {is}")
        }
        None => format!(
            "no variable has the value reference {reference} (allowed: 1 to {})",
            arrays.len()
        ),
    }
}

/// There is a value for each element.
fn check_elements<M: Model>(
    component: &Component<M, Fmi3>,
    call: &Call,
    references: &[fmi3ValueReference],
    expected: usize,
    values: usize,
) -> Result<(), Fault> {
    if values == expected {
        return Ok(());
    }
    /// Largest number of variables that a message names.
    const NAMED: usize = 4;
    let mut shapes: Vec<_> = references
        .iter()
        .take(NAMED)
        .map(|reference| arrays::shape::<M>(*reference, &component.instance.parameters))
        .collect();
    if references.len() > NAMED {
        shapes.push("…".into());
    }
    Err(call.error(format_args!(
        "nValues = {values} (allowed: {expected}, by rows: {})",
        shapes.join(", ")
    )))
}

/// Resizes the host's arrays after a change of structural parameters.
fn resize<M: Model>(component: &mut Component<M, Fmi3>) {
    let Component { instance, host, .. } = component;
    if let Some(arrays) = &mut host.arrays {
        **arrays = Arrays::new::<M>(&instance.parameters);
        let all = host.required_variables.iter().filter_map(|reference| arrays.of(*reference));
        host.required = all.flatten().copied().collect();
        host.set = Vec::with_capacity(host.required.len());
    }
}

/// Structural parameters were others before: what they size has its start values from here on. A host that had set others is
/// told.
fn start_resized<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    scalars: &[u32],
    before: &[Value],
) {
    let after = &component.instance.parameters;
    let changed: Vec<_> = scalars
        .iter()
        .filter_map(|reference| M::table().scalars.get(*reference as usize - 1))
        .filter(|scalar| before.get(scalar.slot) != after.get(scalar.slot))
        .map(|scalar| scalar.variable.name)
        .collect();
    let is_resized = |d: &Dimension| matches!(d, Dimension::Sized(by, _) if changed.contains(by));
    let lost = component.instance.restart(|variable| variable.shape.iter().any(is_resized));
    resize(component);
    if !lost.is_empty() {
        component.log.report_effect(call, || {
            let names: Vec<_> = lost.iter().map(|variable| variable.array_name()).collect();
            let sizes = changed.join(", ");
            format!("{sizes} changed, what was set before is lost of {}", names.join(", "))
        });
    }
}

// ---- Values ----

/// There is a value for each reference: all variables are scalars.
#[inline]
fn check_count(call: &Call, references: usize, values: usize) -> Result<(), Fault> {
    if references == values {
        return Ok(());
    }
    Err(call.error(format_args!(
        "nValues = {values} (allowed: {references}, one for each value reference)"
    )))
}

/// The values of all references, each turned into its C type by `as_c`.
#[inline]
unsafe fn get<M: Model, T>(
    instance: fmi3Instance,
    call: &'static Call,
    (references, count): (*const fmi3ValueReference, usize),
    (values, value_count): (*mut T, usize),
    as_c: impl Fn(Value) -> Option<T>,
) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let references = array(call, "valueReferences", references, count)?;
            if component.host.arrays.is_some() {
                let found = array_values(component, call, references, value_count)?;
                let places = array_mut(call, "values", values, value_count)?;
                for (value, place) in found.into_iter().zip(places) {
                    *place = as_c(value).ok_or_else(|| call.error("wrong type"))?;
                }
                return Ok(());
            }
            check_count(call, count, value_count)?;
            let places = array_mut(call, "values", values, value_count)?;
            for (reference, place) in references.iter().zip(places) {
                let value = as_c(value(component, call, *reference)?);
                *place = value.ok_or_else(|| call.error("wrong type"))?;
            }
            Ok(())
        })
    }
}

/// The values of all elements of arrays, `count` of them.
#[cold]
fn array_values<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    references: &[fmi3ValueReference],
    count: usize,
) -> Result<Vec<Value>, Fault> {
    let scalars = scalars_of(component, call, references)?;
    check_elements(component, call, references, scalars.len(), count)?;
    let call = if call.c_type == Some(CType::Size) { &GET_SIZE } else { call };
    scalars.iter().map(|reference| value(component, call, *reference)).collect()
}

#[inline(always)]
fn value<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    reference: u32,
) -> Result<Value, Fault> {
    if reference as usize > M::table().scalars.len() {
        return extra_value(component, call, reference);
    }
    if component.instance.state() == InstanceState::Intermediate {
        check_intermediate(component, call, reference, Phase::Get)?;
    }
    component.instance.value(call, reference)
}

#[cold]
fn extra_value<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    reference: u32,
) -> Result<Value, Fault> {
    let Component { instance, host, .. } = component;
    match extra::<M>(reference).filter(|_| call.c_type == Some(CType::Real)) {
        Some(Extra::Time) => Ok(Value::Real(instance.time())),
        Some(Extra::Indicator(n)) => {
            instance.indicators_for(call, &mut host.indicators)?;
            Ok(Value::Real(host.indicators[n]))
        }
        None => Err(call.error(wrong_reference::<M>(reference, None, call.c_type))),
    }
}

/// Within a step hosts may get and set what they said before, when it is the time for it.
#[cold]
fn check_intermediate<M: Model>(
    component: &Component<M, Fmi3>,
    call: &Call,
    reference: u32,
    phase: Phase,
) -> Result<(), Fault> {
    let host = &component.host;
    if host.phase != phase {
        let (now, then) = match host.phase {
            Phase::Set => ("set", "intermediateVariableSetRequested"),
            Phase::Get => ("got", "intermediateVariableGetAllowed"),
        };
        return Err(call.error(format_args!(
            "within this intermediate update variables can only be {now}: {then} alone is true"
        )));
    }
    let name = || Fmi3::scalar::<M>(reference, call.c_type).map_or_else(|why| why, Scalar::name);
    if !host.required.contains(&reference) {
        return Err(call.error(format_args!(
            "{} is not among the requiredIntermediateVariables of this instance",
            name()
        )));
    }
    Ok(())
}

/// Sets all references, each from its C type by `from_c`, or says why one can't be.
#[inline]
unsafe fn set<M: Model, T: Copy>(
    instance: fmi3Instance,
    call: &'static Call,
    (references, count): (*const fmi3ValueReference, usize),
    (values, value_count): (*const T, usize),
    from_c: impl Fn(T) -> Value,
) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let references = array(call, "valueReferences", references, count)?;
            if component.host.arrays.is_some() {
                let values = array(call, "values", values, value_count)?;
                let values: Vec<_> = values.iter().map(|value| from_c(*value)).collect();
                return set_arrays(component, call, references, &values);
            }
            check_count(call, count, value_count)?;
            let values = array(call, "values", values, value_count)?;
            if component.instance.state() == InstanceState::Intermediate {
                return set_ends(component, call, references, |n| from_c(values[n]));
            }
            component.instance.set(call, references, |n| from_c(values[n]))
        })
    }
}

/// Sets all elements of arrays.
#[cold]
fn set_arrays<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &'static Call,
    references: &[fmi3ValueReference],
    values: &[Value],
) -> Result<(), Fault> {
    let scalars = scalars_of(component, call, references)?;
    check_elements(component, call, references, scalars.len(), values.len())?;
    let value = |n: usize| values[n];
    if component.instance.state() == InstanceState::Intermediate {
        return set_ends(component, call, &scalars, value);
    }
    let before = (call.c_type == Some(CType::Size)).then(|| component.instance.parameters.clone());
    let call = if before.is_some() { &SET_SIZE } else { call };
    component.instance.set(call, &scalars, value)?;
    if let Some(before) = before {
        start_resized(component, call, &scalars, &before);
    }
    Ok(())
}

/// Within a step: what inputs are at the end of the piece that comes.
#[cold]
fn set_ends<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    references: &[fmi3ValueReference],
    value: impl Fn(usize) -> Value,
) -> Result<(), Fault> {
    for (n, reference) in references.iter().enumerate() {
        let scalar = Fmi3::scalar::<M>(*reference, call.c_type).map_err(|why| call.error(why))?;
        check_intermediate(component, call, *reference, Phase::Set)?;
        if !matches!(scalar.access, Access::Input(_)) {
            let name = scalar.name();
            return Err(call.error(format_args!("{name} is computed; only inputs can be set")));
        }
        if let Some(problem) = scalar.problem(value(n)) {
            return Err(call.discard(problem));
        }
    }
    let host = &mut component.host;
    for (n, reference) in references.iter().enumerate() {
        let scalar = Fmi3::scalar::<M>(*reference, call.c_type).map_err(|why| call.error(why))?;
        if let (Access::Input(ramp), Value::Real(x)) = (scalar.access, value(n)) {
            *ramp(&mut host.ends, scalar.element)[0] = x;
        }
        if !host.set.contains(reference) {
            host.set.push(*reference);
        }
    }
    Ok(())
}

/// Reads reals.
pub unsafe fn fmi3GetFloat64<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *mut fmi3Float64,
    nValues: usize,
) -> fmi3Status {
    let as_c = |value| match value {
        Value::Real(x) => Some(x),
        _ => None,
    };
    let (references, values) = ((valueReferences, nValueReferences), (values, nValues));
    unsafe { get::<M, _>(instance, &GET_FLOAT64, references, values, as_c) }
}

/// Reads integers.
pub unsafe fn fmi3GetInt32<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *mut fmi3Int32,
    nValues: usize,
) -> fmi3Status {
    let as_c = |value| match value {
        Value::Integer(n) => Some(n),
        _ => None,
    };
    let (references, values) = ((valueReferences, nValueReferences), (values, nValues));
    unsafe { get::<M, _>(instance, &GET_INT32, references, values, as_c) }
}

/// Reads enumerations.
pub unsafe fn fmi3GetInt64<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *mut fmi3Int64,
    nValues: usize,
) -> fmi3Status {
    let as_c = |value| match value {
        Value::Integer(n) => Some(n.into()),
        _ => None,
    };
    let (references, values) = ((valueReferences, nValueReferences), (values, nValues));
    unsafe { get::<M, _>(instance, &GET_INT64, references, values, as_c) }
}

/// Reads Booleans: 0 or 1.
pub unsafe fn fmi3GetBoolean<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *mut fmi3Boolean,
    nValues: usize,
) -> fmi3Status {
    let as_c = |value| match value {
        Value::Boolean(b) => Some(b.into()),
        _ => None,
    };
    let (references, values) = ((valueReferences, nValueReferences), (values, nValues));
    unsafe { get::<M, _>(instance, &GET_BOOLEAN, references, values, as_c) }
}

/// Sets reals.
pub unsafe fn fmi3SetFloat64<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *const fmi3Float64,
    nValues: usize,
) -> fmi3Status {
    let (references, values) = ((valueReferences, nValueReferences), (values, nValues));
    unsafe { set::<M, _>(instance, &SET_FLOAT64, references, values, Value::Real) }
}

/// Sets integers.
pub unsafe fn fmi3SetInt32<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *const fmi3Int32,
    nValues: usize,
) -> fmi3Status {
    let (references, values) = ((valueReferences, nValueReferences), (values, nValues));
    unsafe { set::<M, _>(instance, &SET_INT32, references, values, Value::Integer) }
}

/// Sets enumerations.
pub unsafe fn fmi3SetInt64<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *const fmi3Int64,
    nValues: usize,
) -> fmi3Status {
    // 0 is no item of any enumeration.
    let from_c = |n| Value::Integer(i32::try_from(n).unwrap_or(0));
    let (references, values) = ((valueReferences, nValueReferences), (values, nValues));
    unsafe { set::<M, _>(instance, &SET_INT64, references, values, from_c) }
}

/// Sets Booleans: everything but 0 is true.
pub unsafe fn fmi3SetBoolean<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *const fmi3Boolean,
    nValues: usize,
) -> fmi3Status {
    let (references, values) = ((valueReferences, nValueReferences), (values, nValues));
    unsafe { set::<M, _>(instance, &SET_BOOLEAN, references, values, |b| Value::Boolean(b != 0)) }
}

/// Gets or sets variables of a type that no variable has: fine when there are none.
fn of_no_variable<M: Model>(
    component: &Component<M, Fmi3>,
    call: &Call,
    references: &[fmi3ValueReference],
    value_count: usize,
) -> Result<(), Fault> {
    match references.first() {
        Some(reference) => Err(call.error(match &component.host.arrays {
            Some(arrays) => wrong_variable::<M>(arrays, *reference),
            None => {
                let scalar = M::table().scalars.get(reference.wrapping_sub(1) as usize);
                wrong_reference::<M>(*reference, scalar, call.c_type)
            }
        })),
        None => check_count(call, 0, value_count),
    }
}

/// The same as a call.
unsafe fn call_of_no_variable<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (references, count): (*const fmi3ValueReference, usize),
    value_count: usize,
) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let references = array(call, "valueReferences", references, count)?;
            of_no_variable(component, call, references, value_count)
        })
    }
}

/// Reads structural parameters, which there are with arrays.
pub unsafe fn fmi3GetUInt64<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *mut fmi3UInt64,
    nValues: usize,
) -> fmi3Status {
    let call = &GET_UINT64;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let references = array(call, "valueReferences", valueReferences, nValueReferences)?;
            if component.host.arrays.is_none() {
                return of_no_variable(component, call, references, nValues);
            }
            let found = array_values(component, call, references, nValues)?;
            let places = array_mut(call, "values", values, nValues)?;
            for (value, place) in found.into_iter().zip(places) {
                *place = match value {
                    Value::Integer(n) => u64::try_from(n).unwrap_or(0),
                    _ => return Err(call.error("wrong type")),
                };
            }
            Ok(())
        })
    }
}

/// Sets structural parameters, which there are with arrays.
pub unsafe fn fmi3SetUInt64<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    values: *const fmi3UInt64,
    nValues: usize,
) -> fmi3Status {
    let call = &SET_UINT64;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let references = array(call, "valueReferences", valueReferences, nValueReferences)?;
            if component.host.arrays.is_none() {
                return of_no_variable(component, call, references, nValues);
            }
            // More than the largest integer is more than any size may be.
            let size = |n: &u64| Value::Integer(i32::try_from(*n).unwrap_or(i32::MAX));
            let values = array(call, "values", values, nValues)?;
            let values: Vec<_> = values.iter().map(size).collect();
            set_arrays(component, call, references, &values)
        })
    }
}

/// Functions for types that no variable has.
macro_rules! of_no_variable {
    ($($name:ident($value:ty), $allowed:expr;)*) => {$(
        /// No variable is of this type.
        pub unsafe fn $name<M: Model>(
            instance: fmi3Instance,
            valueReferences: *const fmi3ValueReference,
            nValueReferences: usize,
            _values: $value,
            nValues: usize,
        ) -> fmi3Status {
            static CALL: Call = both(stringify!($name), $allowed);
            let references = (valueReferences, nValueReferences);
            unsafe { call_of_no_variable::<M>(instance, &CALL, references, nValues) }
        }
    )*};
}

of_no_variable! {
    fmi3GetFloat32(*mut fmi3Float32), GET;
    fmi3GetInt8(*mut i8), GET;
    fmi3GetUInt8(*mut u8), GET;
    fmi3GetInt16(*mut i16), GET;
    fmi3GetUInt16(*mut u16), GET;
    fmi3GetUInt32(*mut u32), GET;
    fmi3GetString(*mut fmi3String), GET;
    fmi3SetFloat32(*const fmi3Float32), SET;
    fmi3SetInt8(*const i8), SET;
    fmi3SetUInt8(*const u8), SET;
    fmi3SetInt16(*const i16), SET;
    fmi3SetUInt16(*const u16), SET;
    fmi3SetUInt32(*const u32), SET;
    fmi3SetString(*const fmi3String), SET;
}

/// No variable is binary.
pub unsafe fn fmi3GetBinary<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    _valueSizes: *mut usize,
    _values: *mut fmi3Binary,
    nValues: usize,
) -> fmi3Status {
    static CALL: Call = both("fmi3GetBinary", GET);
    unsafe {
        call_of_no_variable::<M>(instance, &CALL, (valueReferences, nValueReferences), nValues)
    }
}

/// No variable is binary.
pub unsafe fn fmi3SetBinary<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    _valueSizes: *const usize,
    _values: *const fmi3Binary,
    nValues: usize,
) -> fmi3Status {
    static CALL: Call = both("fmi3SetBinary", SET);
    unsafe {
        call_of_no_variable::<M>(instance, &CALL, (valueReferences, nValueReferences), nValues)
    }
}

/// Functions for clocks, of which there are none.
macro_rules! of_no_clock {
    ($($name:ident($($argument:ident: $type:ty),*);)*) => {$(
        /// There are no clocks.
        pub unsafe fn $name<M: Model>(
            instance: fmi3Instance,
            valueReferences: *const fmi3ValueReference,
            nValueReferences: usize,
            $($argument: $type),*
        ) -> fmi3Status {
            static CALL: Call = both(stringify!($name), ANY);
            let _ = ($($argument,)*);
            let references = (valueReferences, nValueReferences);
            unsafe { call_of_no_variable::<M>(instance, &CALL, references, nValueReferences) }
        }
    )*};
}

of_no_clock! {
    fmi3GetClock(values: *mut fmi3Clock);
    fmi3SetClock(values: *const fmi3Clock);
    fmi3GetIntervalDecimal(intervals: *mut fmi3Float64, qualifiers: *mut fmi3IntervalQualifier);
    fmi3GetIntervalFraction(counters: *mut fmi3UInt64, resolutions: *mut fmi3UInt64, qualifiers: *mut fmi3IntervalQualifier);
    fmi3GetShiftDecimal(shifts: *mut fmi3Float64);
    fmi3GetShiftFraction(counters: *mut fmi3UInt64, resolutions: *mut fmi3UInt64);
    fmi3SetIntervalDecimal(intervals: *const fmi3Float64);
    fmi3SetIntervalFraction(counters: *const fmi3UInt64, resolutions: *const fmi3UInt64);
    fmi3SetShiftDecimal(shifts: *const fmi3Float64);
    fmi3SetShiftFraction(counters: *const fmi3UInt64, resolutions: *const fmi3UInt64);
}

/// There are no model partitions.
pub unsafe fn fmi3ActivateModelPartition<M: Model>(
    instance: fmi3Instance,
    _clockReference: fmi3ValueReference,
    _activationTime: fmi3Float64,
) -> fmi3Status {
    static CALL: Call = both("fmi3ActivateModelPartition", ANY);
    unsafe {
        on::<M, Fmi3>(instance, &CALL, |component| {
            component.instance.check(&CALL)?;
            Err(CALL.error("this FMU has no Scheduled Execution"))
        })
    }
}

// ---- Dependencies ----

/// Dependency of one element of a variable on an element of another.
struct Dependency {
    element: usize,
    independent: fmi3ValueReference,
    independent_element: usize,
}

/// Dependencies of a variable.
fn dependencies<M: Model>(
    component: &mut Component<M, Fmi3>,
    call: &Call,
    reference: u32,
) -> Result<Vec<Dependency>, Fault> {
    let Component { instance, host, .. } = component;
    let scalars = match &host.arrays {
        None => std::slice::from_ref(&reference),
        Some(arrays) => arrays
            .of(reference)
            .ok_or_else(|| call.error(wrong_variable::<M>(arrays, reference)))?,
    };
    let mut all = Vec::new();
    for (scalar, element) in scalars.iter().zip(1..) {
        let found = M::table().scalars.get(scalar.wrapping_sub(1) as usize);
        let wrong = || call.error(wrong_reference::<M>(*scalar, found, None));
        let scalar = found.ok_or_else(wrong)?;
        if matches!(scalar.variable.causality, Causality::Input | Causality::Parameter) {
            let name = scalar.name();
            return Err(
                call.error(format_args!("{name} is set by the host and depends on nothing"))
            );
        }
        for known in instance.dependencies(call, scalar)? {
            let place = match &host.arrays {
                None => Some((known, 1)),
                Some(arrays) => arrays.place(known),
            };
            let of = |(independent, independent_element)| Dependency {
                element,
                independent,
                independent_element,
            };
            all.extend(place.map(of));
        }
    }
    Ok(all)
}

/// Number of dependencies of a variable.
pub unsafe fn fmi3GetNumberOfVariableDependencies<M: Model>(
    instance: fmi3Instance,
    valueReference: fmi3ValueReference,
    nDependencies: *mut usize,
) -> fmi3Status {
    let call = &NUMBER_OF_DEPENDENCIES;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let count = place(call, "nDependencies", nDependencies)?;
            *count = dependencies(component, call, valueReference)?.len();
            Ok(())
        })
    }
}

/// Dependencies of a variable: initial ones before the end of initialization mode, then the present ones.
pub unsafe fn fmi3GetVariableDependencies<M: Model>(
    instance: fmi3Instance,
    dependent: fmi3ValueReference,
    elementIndicesOfDependent: *mut usize,
    independents: *mut fmi3ValueReference,
    elementIndicesOfIndependents: *mut usize,
    dependencyKinds: *mut fmi3DependencyKind,
    nDependencies: usize,
) -> fmi3Status {
    let call = &DEPENDENCIES;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let all = dependencies(component, call, dependent)?;
            if all.len() != nDependencies {
                return Err(call.error(format_args!(
                    "nDependencies = {nDependencies} (allowed: {})",
                    all.len()
                )));
            }
            let n = nDependencies;
            let elements =
                array_mut(call, "elementIndicesOfDependent", elementIndicesOfDependent, n)?;
            let independents = array_mut(call, "independents", independents, n)?;
            let independent_elements =
                array_mut(call, "elementIndicesOfIndependents", elementIndicesOfIndependents, n)?;
            for (n, dependency) in all.iter().enumerate() {
                elements[n] = dependency.element;
                independents[n] = dependency.independent;
                independent_elements[n] = dependency.independent_element;
            }
            array_mut(call, "dependencyKinds", dependencyKinds, n)?.fill(fmi3Dependent);
            Ok(())
        })
    }
}

// ---- Saved states ----

/// Saves the state, into the handle that is there or into a new one.
pub unsafe fn fmi3GetFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: *mut fmi3FMUState,
) -> fmi3Status {
    let call = &GET_STATE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let handle = place(call, "FMUState", FMUState)?;
            if handle.is_null() {
                *handle = new_state(component.instance.clone());
            } else {
                saved_state(call, "FMUState", *handle)?.clone_from(&component.instance);
            }
            Ok(())
        })
    }
}

/// Takes a saved state, this instance's or another's, in any instance state.
pub unsafe fn fmi3SetFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
) -> fmi3Status {
    let call = Fmi3::SET_STATE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            component.instance.restore(saved_state(call, "FMUState", FMUState)?)?;
            resize(component);
            Ok(())
        })
    }
}

/// Frees a saved state and clears the handle; NULL is fine.
pub unsafe fn fmi3FreeFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: *mut fmi3FMUState,
) -> fmi3Status {
    let call = &FREE_STATE;
    unsafe { on::<M, Fmi3>(instance, call, |_| free_state::<M, Fmi3>(call, "FMUState", FMUState)) }
}

/// Returns the size of a saved state in bytes.
pub unsafe fn fmi3SerializedFMUStateSize<M: Model>(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
    size: *mut usize,
) -> fmi3Status {
    let call = &SERIALIZED_SIZE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            saved_state::<M, Fmi3>(call, "FMUState", FMUState)?;
            *place(call, "size", size)? = snapshot::size::<M>();
            Ok(())
        })
    }
}

/// Writes a saved state to the host's bytes.
pub unsafe fn fmi3SerializeFMUState<M: Model>(
    instance: fmi3Instance,
    FMUState: fmi3FMUState,
    serializedState: *mut fmi3Byte,
    size: usize,
) -> fmi3Status {
    let call = &SERIALIZE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let bytes = snapshot::to_bytes(saved_state::<M, Fmi3>(call, "FMUState", FMUState)?);
            if size < bytes.len() {
                return Err(call.error(format_args!(
                    "size is {size}; a saved state takes {} bytes",
                    bytes.len()
                )));
            }
            let room = array_mut(call, "serializedState", serializedState, size)?;
            room[..bytes.len()].copy_from_slice(&bytes);
            Ok(())
        })
    }
}

/// Makes a saved state from bytes. The handle is written, never read: the host need not have set it.
pub unsafe fn fmi3DeserializeFMUState<M: Model>(
    instance: fmi3Instance,
    serializedState: *const fmi3Byte,
    size: usize,
    FMUState: *mut fmi3FMUState,
) -> fmi3Status {
    let call = &DESERIALIZE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            if FMUState.is_null() {
                return Err(null(call, "FMUState"));
            }
            let bytes = array(call, "serializedState", serializedState, size)?;
            let saved = snapshot::from_bytes::<M, Fmi3>(bytes).map_err(|why| call.error(why))?;
            component.instance.check_layout(call, &saved)?;
            ptr::write(FMUState, new_state(saved));
            Ok(())
        })
    }
}

// ---- Derivatives ----

/// Refuses a derivative with a wrong number of scalars.
fn check_numbers(call: &Call, name: &str, given: usize, expected: usize) -> Result<(), Fault> {
    if given == expected {
        return Ok(());
    }
    Err(call.error(format_args!("{name} = {given} (allowed: {expected})")))
}

/// Derivative of the unknowns along a direction of the knowns.
pub unsafe fn fmi3GetDirectionalDerivative<M: Model>(
    instance: fmi3Instance,
    unknowns: *const fmi3ValueReference,
    nUnknowns: usize,
    knowns: *const fmi3ValueReference,
    nKnowns: usize,
    seed: *const fmi3Float64,
    nSeed: usize,
    sensitivity: *mut fmi3Float64,
    nSensitivity: usize,
) -> fmi3Status {
    let call = Fmi3::DIRECTIONAL_DERIVATIVE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let unknowns = array(call, "unknowns", unknowns, nUnknowns)?;
            let unknowns = scalars_of(component, call, unknowns)?;
            let knowns = array(call, "knowns", knowns, nKnowns)?;
            let knowns = scalars_of(component, call, knowns)?;
            check_numbers(call, "nSeed", nSeed, knowns.len())?;
            check_numbers(call, "nSensitivity", nSensitivity, unknowns.len())?;
            let seed = array(call, "seed", seed, nSeed)?;
            let answers = array_mut(call, "sensitivity", sensitivity, nSensitivity)?;
            // the independent variable, on which nothing depends but by states and inputs, is left out of the knowns
            let time = time_reference::<M>();
            if !knowns.contains(&time) {
                return component
                    .instance
                    .directional_derivative(&unknowns, &knowns, seed, answers);
            }
            let others = knowns.iter().zip(seed).filter(|(known, _)| **known != time);
            let (knowns, seed): (Vec<u32>, Vec<f64>) = others.unzip();
            component.instance.directional_derivative(&unknowns, &knowns, &seed, answers)
        })
    }
}

/// Derivative of a weighted sum of the unknowns by each known: column by column, each a directional derivative.
pub unsafe fn fmi3GetAdjointDerivative<M: Model>(
    instance: fmi3Instance,
    unknowns: *const fmi3ValueReference,
    nUnknowns: usize,
    knowns: *const fmi3ValueReference,
    nKnowns: usize,
    seed: *const fmi3Float64,
    nSeed: usize,
    sensitivity: *mut fmi3Float64,
    nSensitivity: usize,
) -> fmi3Status {
    let call = &ADJOINT_DERIVATIVE;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let unknowns = array(call, "unknowns", unknowns, nUnknowns)?;
            let unknowns = scalars_of(component, call, unknowns)?;
            let knowns = array(call, "knowns", knowns, nKnowns)?;
            let knowns = scalars_of(component, call, knowns)?;
            check_numbers(call, "nSeed", nSeed, unknowns.len())?;
            check_numbers(call, "nSensitivity", nSensitivity, knowns.len())?;
            let seed = array(call, "seed", seed, nSeed)?;
            for weight in seed {
                if !is_finite(*weight) {
                    let weight = number(*weight);
                    return Err(
                        call.error(format_args!("seed[] = {weight} (allowed: any finite number)"))
                    );
                }
            }
            let answers = array_mut(call, "sensitivity", sensitivity, nSensitivity)?;
            let mut column = vec![0.0; unknowns.len()];
            for (known, answer) in knowns.iter().zip(answers) {
                *answer = 0.0;
                if *known == time_reference::<M>() {
                    continue;
                }
                let (known, one) = (std::slice::from_ref(known), &[1.0]);
                component.instance.directional_derivative(&unknowns, known, one, &mut column)?;
                *answer = seed.iter().zip(&column).map(|(weight, d)| weight * d).sum();
            }
            Ok(())
        })
    }
}

// ---- Configuration ----

/// From here on structural parameters can be set, if there are any.
pub unsafe fn fmi3EnterConfigurationMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, &ENTER_CONFIGURATION, |component| {
            component.instance.configure(&ENTER_CONFIGURATION, InstanceState::Configuration)
        })
    }
}

/// Back to where it came from.
pub unsafe fn fmi3ExitConfigurationMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, &EXIT_CONFIGURATION, |component| {
            component.instance.configure(&EXIT_CONFIGURATION, InstanceState::Instantiated)
        })
    }
}

// ---- Events ----

/// Nothing is left to be evaluated: fmi3UpdateDiscreteStates does all.
pub unsafe fn fmi3EvaluateDiscreteStates<M: Model>(instance: fmi3Instance) -> fmi3Status {
    let call = &EVALUATE_DISCRETE_STATES;
    unsafe { on::<M, Fmi3>(instance, call, |component| component.instance.check(call).map(|_| ())) }
}

/// Does what is due at the event.
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
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
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

// ---- Model Exchange ----

/// Between events.
pub unsafe fn fmi3EnterContinuousTimeMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, Fmi3::ENTER_CONTINUOUS_TIME, |component| {
            component.instance.enter_continuous_time_mode()
        })
    }
}

/// The host has made a step and will not go back behind it. No past is kept, so
/// `noSetFMUStatePriorToCurrentPoint` changes nothing.
pub unsafe fn fmi3CompletedIntegratorStep<M: Model>(
    instance: fmi3Instance,
    _noSetFMUStatePriorToCurrentPoint: fmi3Boolean,
    enterEventMode: *mut fmi3Boolean,
    terminateSimulation: *mut fmi3Boolean,
) -> fmi3Status {
    let call = Fmi3::COMPLETED_STEP;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let enter = place(call, "enterEventMode", enterEventMode)?;
            let terminate = place(call, "terminateSimulation", terminateSimulation)?;
            *enter = component.instance.completed_integrator_step()?.into();
            *terminate = 0;
            component.log.report_step_warning(&component.instance);
            Ok(())
        })
    }
}

/// The present time.
pub unsafe fn fmi3SetTime<M: Model>(instance: fmi3Instance, time: fmi3Float64) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, Fmi3::SET_TIME, |component| component.instance.set_time(time))
    }
}

/// The states as the host has integrated them.
pub unsafe fn fmi3SetContinuousStates<M: Model>(
    instance: fmi3Instance,
    continuousStates: *const fmi3Float64,
    nContinuousStates: usize,
) -> fmi3Status {
    let call = Fmi3::SET_CONTINUOUS_STATES;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let states = array(call, "continuousStates", continuousStates, nContinuousStates)?;
            let Component { instance, host, .. } = component;
            let Some(arrays) = &host.arrays else { return instance.set_continuous_states(states) };
            check_numbers(call, "nx", states.len(), arrays.states().len())?;
            let mut all = vec![0.0; M::table().derivatives().len()];
            instance.continuous_states(&mut all)?;
            for (place, x) in arrays.states().iter().zip(states) {
                all[*place] = *x;
            }
            instance.set_continuous_states(&all)
        })
    }
}

/// Fills the host's array with something of each state by `body`, which knows the most that there can be.
unsafe fn fill_states<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (name, pointer, length): (&str, *mut fmi3Float64, usize),
    body: impl FnOnce(&mut Instance<M, Fmi3>, &mut [fmi3Float64]) -> Result<(), Fault>,
) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let room = array_mut(call, name, pointer, length)?;
            let Component { instance, host, .. } = component;
            let Some(arrays) = &host.arrays else { return body(instance, room) };
            check_numbers(call, "nx", room.len(), arrays.states().len())?;
            let mut all = vec![0.0; M::table().derivatives().len()];
            body(instance, &mut all)?;
            for (place, x) in arrays.states().iter().zip(room) {
                *x = all[*place];
            }
            Ok(())
        })
    }
}

/// Fills the host's array by `body`.
unsafe fn fill<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (name, pointer, length): (&str, *mut fmi3Float64, usize),
    body: impl FnOnce(&mut Instance<M, Fmi3>, &mut [fmi3Float64]) -> Result<(), Fault>,
) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            body(&mut component.instance, array_mut(call, name, pointer, length)?)
        })
    }
}

/// The derivatives of the states, in the order of the model description.
pub unsafe fn fmi3GetContinuousStateDerivatives<M: Model>(
    instance: fmi3Instance,
    derivatives: *mut fmi3Float64,
    nContinuousStates: usize,
) -> fmi3Status {
    let into = ("derivatives", derivatives, nContinuousStates);
    unsafe { fill_states::<M>(instance, Fmi3::GET_DERIVATIVES, into, Instance::derivatives) }
}

/// Functions that cross zero at events.
pub unsafe fn fmi3GetEventIndicators<M: Model>(
    instance: fmi3Instance,
    eventIndicators: *mut fmi3Float64,
    nEventIndicators: usize,
) -> fmi3Status {
    let into = ("eventIndicators", eventIndicators, nEventIndicators);
    unsafe { fill::<M>(instance, Fmi3::GET_EVENT_INDICATORS, into, Instance::event_indicators) }
}

/// The states, in the order of the model description.
pub unsafe fn fmi3GetContinuousStates<M: Model>(
    instance: fmi3Instance,
    continuousStates: *mut fmi3Float64,
    nContinuousStates: usize,
) -> fmi3Status {
    let into = ("continuousStates", continuousStates, nContinuousStates);
    unsafe {
        fill_states::<M>(instance, Fmi3::GET_CONTINUOUS_STATES, into, Instance::continuous_states)
    }
}

/// The states' orders of magnitude.
pub unsafe fn fmi3GetNominalsOfContinuousStates<M: Model>(
    instance: fmi3Instance,
    nominals: *mut fmi3Float64,
    nContinuousStates: usize,
) -> fmi3Status {
    let into = ("nominals", nominals, nContinuousStates);
    unsafe {
        fill_states::<M>(instance, Fmi3::GET_NOMINALS, into, |instance, x| instance.nominals(x))
    }
}

unsafe fn tell<M: Model>(
    instance: fmi3Instance,
    call: &'static Call,
    (name, pointer): (&str, *mut usize),
    count: impl FnOnce(&Host<M>) -> usize,
) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            *place(call, name, pointer)? = count(&component.host);
            Ok(())
        })
    }
}

/// Returns the number of event indicators.
pub unsafe fn fmi3GetNumberOfEventIndicators<M: Model>(
    instance: fmi3Instance,
    nEventIndicators: *mut usize,
) -> fmi3Status {
    let into = ("nEventIndicators", nEventIndicators);
    let count = |_: &Host<M>| M::table().about.event_indicators;
    unsafe { tell::<M>(instance, &NUMBER_OF_INDICATORS, into, count) }
}

/// Returns the number of continuous states.
pub unsafe fn fmi3GetNumberOfContinuousStates<M: Model>(
    instance: fmi3Instance,
    nContinuousStates: *mut usize,
) -> fmi3Status {
    let into = ("nContinuousStates", nContinuousStates);
    let count = |host: &Host<M>| match &host.arrays {
        None => M::table().derivatives().len(),
        Some(arrays) => arrays.states().len(),
    };
    unsafe { tell::<M>(instance, &NUMBER_OF_STATES, into, count) }
}

// ---- Co-Simulation ----

/// Steps follow.
pub unsafe fn fmi3EnterStepMode<M: Model>(instance: fmi3Instance) -> fmi3Status {
    unsafe {
        on::<M, Fmi3>(instance, &ENTER_STEP, |component| {
            component.instance.enter_step_mode(&ENTER_STEP)
        })
    }
}

/// The derivatives of some outputs.
pub unsafe fn fmi3GetOutputDerivatives<M: Model>(
    instance: fmi3Instance,
    valueReferences: *const fmi3ValueReference,
    nValueReferences: usize,
    orders: *const fmi3Int32,
    values: *mut fmi3Float64,
    nValues: usize,
) -> fmi3Status {
    let call = Fmi3::GET_OUTPUT_DERIVATIVES;
    unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            component.instance.check(call)?;
            let references = array(call, "valueReferences", valueReferences, nValueReferences)?;
            let orders = array(call, "orders", orders, nValueReferences)?;
            let (mut scalars, mut orders) = (Cow::Borrowed(references), Cow::Borrowed(orders));
            match &component.host.arrays {
                None => check_count(call, nValueReferences, nValues)?,
                Some(arrays) => {
                    let each = references.iter().zip(orders.iter());
                    let each = each
                        .flat_map(|(r, order)| vec![*order; arrays.of(*r).map_or(0, <[u32]>::len)]);
                    let each: Vec<i32> = each.collect();
                    scalars = Cow::Owned(expand::<M>(arrays, call, references)?);
                    orders = Cow::Owned(each);
                    check_elements(component, call, references, scalars.len(), nValues)?;
                }
            }
            let places = array_mut(call, "values", values, nValues)?;
            if component.instance.state() == InstanceState::Intermediate {
                for reference in scalars.iter() {
                    check_intermediate(component, call, *reference, Phase::Get)?;
                }
            }
            component.instance.output_derivatives(&scalars, &orders, places)
        })
    }
}

/// Answer of the host to an intermediate update.
#[derive(Clone, Copy)]
struct Wish {
    /// To return early, at this time.
    early_return: Option<f64>,
}

/// Lets the host look into a step, at `time`. No reference into the instance lives meanwhile: the host calls back.
unsafe fn intermediate_update<M: Model>(
    instance: fmi3Instance,
    time: f64,
    phase: Phase,
) -> Result<Wish, fmi3Status> {
    let call = Fmi3::DO_STEP;
    let mut prepared = None;
    let status = unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            let host = &mut component.host;
            let Some(update) = host.intermediate_update else { return Ok(()) };
            (host.phase, host.ends) = (phase, M::Inputs::default());
            host.set.clear();
            prepared = Some((update, host.environment, host.early_return_allowed));
            component.instance.enter_intermediate();
            Ok(())
        })
    };
    if status != fmi3OK {
        return Err(status);
    }
    let Some((update, environment, can_return)) = prepared else {
        return Ok(Wish { early_return: None });
    };
    let sets = phase == Phase::Set;
    let (mut requested, mut at): (fmi3Boolean, fmi3Float64) = (0, time);
    unsafe {
        update(
            environment,
            time,
            sets.into(),
            (!sets).into(),
            (!sets).into(),
            can_return.into(),
            &mut requested,
            &mut at,
        );
    }
    let status = unsafe {
        on::<M, Fmi3>(instance, call, |component| component.instance.leave_intermediate(call))
    };
    if status != fmi3OK {
        return Err(status);
    }
    Ok(Wish { early_return: Some(at).filter(|_| requested != 0 && can_return) })
}

/// Targets of a step's results.
#[derive(Clone, Copy)]
struct Answers {
    event: *mut fmi3Boolean,
    terminate: *mut fmi3Boolean,
    early: *mut fmi3Boolean,
    last: *mut fmi3Float64,
}

impl Answers {
    /// Answers as they are before the step, as far as there is a place for them; or which place is missing.
    unsafe fn begin(&self, call: &Call, time: f64) -> Result<(), Fault> {
        let Answers { event, terminate, early, last } = *self;
        let flags = [
            ("eventHandlingNeeded", event),
            ("terminateSimulation", terminate),
            ("earlyReturn", early),
        ];
        for (_, flag) in flags {
            if let Some(flag) = unsafe { flag.as_mut() } {
                *flag = 0;
            }
        }
        if let Some(last) = unsafe { last.as_mut() } {
            *last = time;
        }
        let flag = flags.iter().find(|(_, flag)| flag.is_null()).map(|(name, _)| *name);
        match flag.or(last.is_null().then_some("lastSuccessfulTime")) {
            Some(name) => Err(null(call, name)),
            None => Ok(()),
        }
    }
}

/// One step. It may stop at an event where the host allows it; then, and where the host is told of events at its
/// end, something discrete waits for event mode. `noSetFMUStatePriorToCurrentPoint` changes nothing here: no past is
/// kept.
pub unsafe fn fmi3DoStep<M: Model>(
    instance: fmi3Instance,
    currentCommunicationPoint: fmi3Float64,
    communicationStepSize: fmi3Float64,
    _noSetFMUStatePriorToCurrentPoint: fmi3Boolean,
    eventHandlingNeeded: *mut fmi3Boolean,
    terminateSimulation: *mut fmi3Boolean,
    earlyReturn: *mut fmi3Boolean,
    lastSuccessfulTime: *mut fmi3Float64,
) -> fmi3Status {
    let (at, h) = (currentCommunicationPoint, communicationStepSize);
    let answers = Answers {
        event: eventHandlingNeeded,
        terminate: terminateSimulation,
        early: earlyReturn,
        last: lastSuccessfulTime,
    };
    let mut looks_in = false;
    let status = unsafe {
        on::<M, Fmi3>(instance, Fmi3::DO_STEP, |component| {
            answers.begin(Fmi3::DO_STEP, component.instance.time())?;
            component.instance.check(Fmi3::DO_STEP)?;
            looks_in = component.host.intermediate_update.is_some();
            if looks_in {
                return Ok(());
            }
            let (before, stops) =
                (component.instance.event_count(), component.host.early_return_allowed);
            let step = component.instance.step_to_event(at, h, stops)?;
            stepped(component, before, step, answers);
            Ok(())
        })
    };
    if status != fmi3OK || !looks_in {
        return status;
    }
    unsafe { step_looked_into::<M>(instance, at, h, answers) }
}

/// Writes results and messages after a step; `before` is the number of events before it.
#[inline(always)]
unsafe fn stepped<M: Model>(
    component: &mut Component<M, Fmi3>,
    before: i32,
    step: StepInfo,
    answers: Answers,
) {
    let Component { instance, log, .. } = component;
    unsafe {
        *answers.event = step.event.into();
        *answers.early |= fmi3Boolean::from(step.early);
        *answers.last = instance.time();
    }
    log.report_event(Fmi3::DO_STEP, before, instance);
    log.report_step_warning(instance);
}

/// A step of which the host is told where it begins, when it may set inputs for its end and wish to return earlier, and
/// where it has ended.
unsafe fn step_looked_into<M: Model>(
    instance: fmi3Instance,
    at: f64,
    mut h: f64,
    answers: Answers,
) -> fmi3Status {
    let (call, whole) = (Fmi3::DO_STEP, h);
    let checked = unsafe {
        on::<M, Fmi3>(instance, call, |component| component.instance.check_step(call, at, h))
    };
    if checked != fmi3OK {
        return checked;
    }
    let wish = match unsafe { intermediate_update::<M>(instance, at + h, Phase::Set) } {
        Ok(wish) => wish,
        Err(status) => return status,
    };
    let ramps = unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            let Component { instance, host, .. } = component;
            instance.ramp_to(call, &host.set, &host.ends, h)
        })
    };
    if ramps != fmi3OK {
        return ramps;
    }
    // Anywhere in the step; before it begins is at once, and so is NaN.
    if let Some(time) = wish
        .early_return
        .filter(|time| !matches!(time.partial_cmp(&(at + h)), Some(Greater | Equal)))
    {
        h = time - at;
        unsafe { *answers.early = 1 };
        let moves = h > 0.0;
        if !moves {
            let drop_ramps = |component: &mut Component<M, Fmi3>| {
                component.instance.drop_ramps();
                Ok(())
            };
            return unsafe { on::<M, Fmi3>(instance, call, drop_ramps) };
        }
    }
    let status = unsafe {
        on::<M, Fmi3>(instance, call, |component| {
            let Component { instance, host, .. } = component;
            let before = instance.event_count();
            let step = instance.step_to_event(at, h, host.early_return_allowed);
            match &step {
                Ok(step) if !step.early && h == whole => {
                    instance.end_ramps(&host.set, &host.ends);
                }
                Ok(_) => {}
                Err(_) => instance.drop_ramps(),
            }
            stepped(component, before, step?, answers);
            Ok(())
        })
    };
    if status != fmi3OK {
        return status;
    }
    let end = unsafe { *answers.last };
    match unsafe { intermediate_update::<M>(instance, end, Phase::Get) } {
        Ok(_) => fmi3OK,
        Err(status) => status,
    }
}

/// Exports the functions of FMI 3.0 for a model, under their names in C and as Rust functions of
/// the module where it stands. A macro, because each FMU has to define these symbols itself.
#[macro_export]
macro_rules! export_fmi3 {
    ($model:ty) => {
        $crate::export_fmi3! { $model;
            fn fmi3SetDebugLogging(instance: fmi3Instance, loggingOn: fmi3Boolean, nCategories: usize, categories: *const fmi3String) -> fmi3Status;
            fn fmi3InstantiateModelExchange(instanceName: fmi3String, instantiationToken: fmi3String, resourcePath: fmi3String, visible: fmi3Boolean, loggingOn: fmi3Boolean, instanceEnvironment: fmi3InstanceEnvironment, logMessage: fmi3LogMessageCallback) -> fmi3Instance;
            fn fmi3InstantiateCoSimulation(instanceName: fmi3String, instantiationToken: fmi3String, resourcePath: fmi3String, visible: fmi3Boolean, loggingOn: fmi3Boolean, eventModeUsed: fmi3Boolean, earlyReturnAllowed: fmi3Boolean, requiredIntermediateVariables: *const fmi3ValueReference, nRequiredIntermediateVariables: usize, instanceEnvironment: fmi3InstanceEnvironment, logMessage: fmi3LogMessageCallback, intermediateUpdate: fmi3IntermediateUpdateCallback) -> fmi3Instance;
            fn fmi3InstantiateScheduledExecution(instanceName: fmi3String, instantiationToken: fmi3String, resourcePath: fmi3String, visible: fmi3Boolean, loggingOn: fmi3Boolean, instanceEnvironment: fmi3InstanceEnvironment, logMessage: fmi3LogMessageCallback, clockUpdate: fmi3ClockUpdateCallback, lockPreemption: fmi3LockPreemptionCallback, unlockPreemption: fmi3UnlockPreemptionCallback) -> fmi3Instance;
            fn fmi3FreeInstance(instance: fmi3Instance);
            fn fmi3EnterInitializationMode(instance: fmi3Instance, toleranceDefined: fmi3Boolean, tolerance: fmi3Float64, startTime: fmi3Float64, stopTimeDefined: fmi3Boolean, stopTime: fmi3Float64) -> fmi3Status;
            fn fmi3ExitInitializationMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3EnterEventMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3Terminate(instance: fmi3Instance) -> fmi3Status;
            fn fmi3Reset(instance: fmi3Instance) -> fmi3Status;
            fn fmi3GetFloat32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Float32, nValues: usize) -> fmi3Status;
            fn fmi3GetFloat64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Float64, nValues: usize) -> fmi3Status;
            fn fmi3GetInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut i8, nValues: usize) -> fmi3Status;
            fn fmi3GetUInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut u8, nValues: usize) -> fmi3Status;
            fn fmi3GetInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut i16, nValues: usize) -> fmi3Status;
            fn fmi3GetUInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut u16, nValues: usize) -> fmi3Status;
            fn fmi3GetInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Int32, nValues: usize) -> fmi3Status;
            fn fmi3GetUInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut u32, nValues: usize) -> fmi3Status;
            fn fmi3GetInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Int64, nValues: usize) -> fmi3Status;
            fn fmi3GetUInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3UInt64, nValues: usize) -> fmi3Status;
            fn fmi3GetBoolean(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Boolean, nValues: usize) -> fmi3Status;
            fn fmi3GetString(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3String, nValues: usize) -> fmi3Status;
            fn fmi3GetBinary(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, valueSizes: *mut usize, values: *mut fmi3Binary, nValues: usize) -> fmi3Status;
            fn fmi3GetClock(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Clock) -> fmi3Status;
            fn fmi3SetFloat32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Float32, nValues: usize) -> fmi3Status;
            fn fmi3SetFloat64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Float64, nValues: usize) -> fmi3Status;
            fn fmi3SetInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const i8, nValues: usize) -> fmi3Status;
            fn fmi3SetUInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const u8, nValues: usize) -> fmi3Status;
            fn fmi3SetInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const i16, nValues: usize) -> fmi3Status;
            fn fmi3SetUInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const u16, nValues: usize) -> fmi3Status;
            fn fmi3SetInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Int32, nValues: usize) -> fmi3Status;
            fn fmi3SetUInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const u32, nValues: usize) -> fmi3Status;
            fn fmi3SetInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Int64, nValues: usize) -> fmi3Status;
            fn fmi3SetUInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3UInt64, nValues: usize) -> fmi3Status;
            fn fmi3SetBoolean(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Boolean, nValues: usize) -> fmi3Status;
            fn fmi3SetString(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3String, nValues: usize) -> fmi3Status;
            fn fmi3SetBinary(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, valueSizes: *const usize, values: *const fmi3Binary, nValues: usize) -> fmi3Status;
            fn fmi3SetClock(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Clock) -> fmi3Status;
            fn fmi3GetNumberOfVariableDependencies(instance: fmi3Instance, valueReference: fmi3ValueReference, nDependencies: *mut usize) -> fmi3Status;
            fn fmi3GetVariableDependencies(instance: fmi3Instance, dependent: fmi3ValueReference, elementIndicesOfDependent: *mut usize, independents: *mut fmi3ValueReference, elementIndicesOfIndependents: *mut usize, dependencyKinds: *mut fmi3DependencyKind, nDependencies: usize) -> fmi3Status;
            fn fmi3GetFMUState(instance: fmi3Instance, FMUState: *mut fmi3FMUState) -> fmi3Status;
            fn fmi3SetFMUState(instance: fmi3Instance, FMUState: fmi3FMUState) -> fmi3Status;
            fn fmi3FreeFMUState(instance: fmi3Instance, FMUState: *mut fmi3FMUState) -> fmi3Status;
            fn fmi3SerializedFMUStateSize(instance: fmi3Instance, FMUState: fmi3FMUState, size: *mut usize) -> fmi3Status;
            fn fmi3SerializeFMUState(instance: fmi3Instance, FMUState: fmi3FMUState, serializedState: *mut fmi3Byte, size: usize) -> fmi3Status;
            fn fmi3DeserializeFMUState(instance: fmi3Instance, serializedState: *const fmi3Byte, size: usize, FMUState: *mut fmi3FMUState) -> fmi3Status;
            fn fmi3GetDirectionalDerivative(instance: fmi3Instance, unknowns: *const fmi3ValueReference, nUnknowns: usize, knowns: *const fmi3ValueReference, nKnowns: usize, seed: *const fmi3Float64, nSeed: usize, sensitivity: *mut fmi3Float64, nSensitivity: usize) -> fmi3Status;
            fn fmi3GetAdjointDerivative(instance: fmi3Instance, unknowns: *const fmi3ValueReference, nUnknowns: usize, knowns: *const fmi3ValueReference, nKnowns: usize, seed: *const fmi3Float64, nSeed: usize, sensitivity: *mut fmi3Float64, nSensitivity: usize) -> fmi3Status;
            fn fmi3EnterConfigurationMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3ExitConfigurationMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3GetIntervalDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, intervals: *mut fmi3Float64, qualifiers: *mut fmi3IntervalQualifier) -> fmi3Status;
            fn fmi3GetIntervalFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, counters: *mut fmi3UInt64, resolutions: *mut fmi3UInt64, qualifiers: *mut fmi3IntervalQualifier) -> fmi3Status;
            fn fmi3GetShiftDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, shifts: *mut fmi3Float64) -> fmi3Status;
            fn fmi3GetShiftFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, counters: *mut fmi3UInt64, resolutions: *mut fmi3UInt64) -> fmi3Status;
            fn fmi3SetIntervalDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, intervals: *const fmi3Float64) -> fmi3Status;
            fn fmi3SetIntervalFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, counters: *const fmi3UInt64, resolutions: *const fmi3UInt64) -> fmi3Status;
            fn fmi3SetShiftDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, shifts: *const fmi3Float64) -> fmi3Status;
            fn fmi3SetShiftFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, counters: *const fmi3UInt64, resolutions: *const fmi3UInt64) -> fmi3Status;
            fn fmi3EvaluateDiscreteStates(instance: fmi3Instance) -> fmi3Status;
            fn fmi3UpdateDiscreteStates(instance: fmi3Instance, discreteStatesNeedUpdate: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean, nominalsOfContinuousStatesChanged: *mut fmi3Boolean, valuesOfContinuousStatesChanged: *mut fmi3Boolean, nextEventTimeDefined: *mut fmi3Boolean, nextEventTime: *mut fmi3Float64) -> fmi3Status;
            fn fmi3EnterContinuousTimeMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3CompletedIntegratorStep(instance: fmi3Instance, noSetFMUStatePriorToCurrentPoint: fmi3Boolean, enterEventMode: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean) -> fmi3Status;
            fn fmi3SetTime(instance: fmi3Instance, time: fmi3Float64) -> fmi3Status;
            fn fmi3SetContinuousStates(instance: fmi3Instance, continuousStates: *const fmi3Float64, nContinuousStates: usize) -> fmi3Status;
            fn fmi3GetContinuousStateDerivatives(instance: fmi3Instance, derivatives: *mut fmi3Float64, nContinuousStates: usize) -> fmi3Status;
            fn fmi3GetEventIndicators(instance: fmi3Instance, eventIndicators: *mut fmi3Float64, nEventIndicators: usize) -> fmi3Status;
            fn fmi3GetContinuousStates(instance: fmi3Instance, continuousStates: *mut fmi3Float64, nContinuousStates: usize) -> fmi3Status;
            fn fmi3GetNominalsOfContinuousStates(instance: fmi3Instance, nominals: *mut fmi3Float64, nContinuousStates: usize) -> fmi3Status;
            fn fmi3GetNumberOfEventIndicators(instance: fmi3Instance, nEventIndicators: *mut usize) -> fmi3Status;
            fn fmi3GetNumberOfContinuousStates(instance: fmi3Instance, nContinuousStates: *mut usize) -> fmi3Status;
            fn fmi3EnterStepMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3GetOutputDerivatives(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, orders: *const fmi3Int32, values: *mut fmi3Float64, nValues: usize) -> fmi3Status;
            fn fmi3DoStep(instance: fmi3Instance, currentCommunicationPoint: fmi3Float64, communicationStepSize: fmi3Float64, noSetFMUStatePriorToCurrentPoint: fmi3Boolean, eventHandlingNeeded: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean, earlyReturn: *mut fmi3Boolean, lastSuccessfulTime: *mut fmi3Float64) -> fmi3Status;
            fn fmi3ActivateModelPartition(instance: fmi3Instance, clockReference: fmi3ValueReference, activationTime: fmi3Float64) -> fmi3Status;
        }
        #[allow(missing_docs, non_snake_case)]
        #[unsafe(no_mangle)]
        pub extern "C" fn fmi3GetVersion() -> $crate::v3::fmi3String {
            $crate::v3::fmi3GetVersion()
        }
    };
    ($model:ty; $(fn $name:ident($($argument:ident: $type:ty),*) $(-> $status:ty)?;)*) => {
        $(
            #[allow(missing_docs, non_snake_case, unsafe_code, clippy::missing_safety_doc, clippy::too_many_arguments)]
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $name($($argument: $type),*) $(-> $status)? {
                unsafe { $crate::v3::$name::<$model>($($argument),*) }
            }
        )*
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spring::Spring;
    use crate::v2::{self, Fmi2};
    use std::sync::Mutex;

    fn token() -> std::ffi::CString {
        c_string(Spring::table().token(Layout::Scalars))
    }

    /// The value reference of a name.
    fn reference(name: &str) -> u32 {
        Spring::table().find(name).unwrap() + 1
    }

    /// Data of a test's host, behind its environment.
    #[derive(Default)]
    struct TestHost {
        instance: Option<usize>,
        lines: Vec<(fmi3Status, String, String)>,
        /// Times of intermediate updates, and whether inputs could be set then.
        updates: Vec<(f64, bool)>,
        /// The force that it sets at a piece's end.
        force: Option<f64>,
        /// Time at which the host requests an early return.
        wish: Option<f64>,
        statuses: Vec<fmi3Status>,
        x: f64,
    }

    unsafe extern "C" fn log(
        environment: *mut c_void,
        status: fmi3Status,
        category: fmi3String,
        message: fmi3String,
    ) {
        let host = unsafe { &*environment.cast::<Mutex<TestHost>>() };
        let line = unsafe { (status, text(category).unwrap(), text(message).unwrap()) };
        host.lock().unwrap().lines.push(line);
    }

    unsafe extern "C" fn update(
        environment: *mut c_void,
        time: f64,
        set: fmi3Boolean,
        get: fmi3Boolean,
        finished: fmi3Boolean,
        can_return: fmi3Boolean,
        requested: *mut fmi3Boolean,
        at: *mut f64,
    ) {
        let host = unsafe { &*environment.cast::<Mutex<TestHost>>() };
        let (instance, force, wish) = {
            let mut host = host.lock().unwrap();
            host.updates.push((time, set != 0));
            (host.instance.unwrap() as *mut c_void, host.force, host.wish)
        };
        assert_eq!((get, finished), (1 - set, 1 - set));
        unsafe {
            assert_eq!((*requested, *at), (0, time), "they come with values");
            let mut statuses = Vec::new();
            if set != 0
                && let Some(force) = force
            {
                let set = fmi3SetFloat64::<Spring>(instance, &reference("F"), 1, &force, 1);
                statuses.push(set);
                if can_return != 0
                    && let Some(wish) = wish
                {
                    (*requested, *at) = (1, wish);
                }
            }
            let mut x = 0.0;
            if get != 0 {
                statuses.push(fmi3GetFloat64::<Spring>(instance, &reference("x"), 1, &mut x, 1));
            }
            let mut host = host.lock().unwrap();
            host.x = x;
            host.statuses.append(&mut statuses);
        }
    }

    /// An instance in Step Mode, and its host.
    fn stepping(early_return: bool) -> (fmi3Instance, Box<Mutex<TestHost>>) {
        let host = Box::new(Mutex::new(TestHost::default()));
        let environment = ptr::from_ref(&*host).cast_mut().cast();
        let required = [reference("F"), reference("x")];
        let instance = unsafe {
            let instance = fmi3InstantiateCoSimulation::<Spring>(
                c"one".as_ptr(),
                token().as_ptr(),
                ptr::null(),
                0,
                1,
                0,
                early_return.into(),
                required.as_ptr(),
                required.len(),
                environment,
                Some(log),
                Some(update),
            );
            assert!(!instance.is_null(), "{:?}", host.lock().unwrap().lines);
            assert_eq!(
                fmi3EnterInitializationMode::<Spring>(instance, 0, f64::NAN, 0.0, 0, f64::NAN),
                fmi3OK
            );
            assert_eq!(fmi3ExitInitializationMode::<Spring>(instance), fmi3OK);
            instance
        };
        host.lock().unwrap().instance = Some(instance as usize);
        (instance, host)
    }

    /// A step, its status, whether it returned early, and the last successful time.
    fn step(instance: fmi3Instance, at: f64, h: f64) -> (fmi3Status, bool, f64) {
        let (mut event, mut terminate, mut early, mut last) = (7, 7, 7, f64::NAN);
        let status = unsafe {
            fmi3DoStep::<Spring>(
                instance,
                at,
                h,
                1,
                &mut event,
                &mut terminate,
                &mut early,
                &mut last,
            )
        };
        assert_eq!((event, terminate), (0, 0));
        (status, early == 1, last)
    }

    #[test]
    fn a_ramp_by_intermediate_update_is_the_input_derivative_of_fmi_2_to_the_last_bit() {
        let (instance, host) = stepping(false);
        let mut two = Instance::<Spring, Fmi2>::new(Interface::CoSimulation);
        two.enter_initialization_mode().unwrap();
        two.exit_initialization_mode().unwrap();
        let (force, x) = (reference("F") - 1, reference("x") - 1);
        let at_knot = |n: usize| 0.3 * (n as f64).sin();
        for n in 0..20 {
            let (at, h) = (n as f64 * 0.1, 0.1);
            host.lock().unwrap().force = Some(at_knot(n + 1));
            assert_eq!(step(instance, at, h), (fmi3OK, false, at + h));
            let slope = (at_knot(n + 1) - at_knot(n)) / h;
            two.set(&v2::SET_REAL, &[force], |_| Value::Real(at_knot(n))).unwrap();
            two.set_input_derivatives(&[force], &[1], &[slope]).unwrap();
            two.do_step(at, h).unwrap();
            let Value::Real(expected) = two.get(&v2::GET_REAL, x).unwrap() else { panic!() };
            let host = host.lock().unwrap();
            assert_eq!(host.x.to_bits(), expected.to_bits(), "step {n}");
            assert_eq!(host.updates[2 * n..], [(at + h, true), (at + h, false)]);
        }
        let mut force_now = 0.0;
        unsafe {
            fmi3GetFloat64::<Spring>(instance, &reference("F"), 1, &mut force_now, 1);
            assert_eq!(force_now, at_knot(20), "the ramp ends where the host put it");
            // Nothing set: held.
            host.lock().unwrap().force = None;
            assert_eq!(step(instance, 20.0 * 0.1, 0.1).0, fmi3OK);
            fmi3GetFloat64::<Spring>(instance, &reference("F"), 1, &mut force_now, 1);
            assert_eq!(force_now, at_knot(20));
            fmi3FreeInstance::<Spring>(instance);
        }
        assert!(host.lock().unwrap().statuses.iter().all(|status| *status == fmi3OK));
    }

    #[test]
    fn an_early_return_that_the_host_asks_for_is_where_it_wants_if_it_may() {
        let (instance, host) = stepping(true);
        host.lock().unwrap().force = Some(1.0);
        host.lock().unwrap().wish = Some(0.25);
        assert_eq!(step(instance, 0.0, 1.0), (fmi3OK, true, 0.25));
        // Before the step, or nowhere: at once.
        for wish in [0.1, f64::NAN] {
            host.lock().unwrap().wish = Some(wish);
            assert_eq!(step(instance, 0.25, 0.5), (fmi3OK, true, 0.25));
        }
        // Behind the end: not early.
        host.lock().unwrap().wish = Some(9.0);
        assert_eq!(step(instance, 0.25, 0.5), (fmi3OK, false, 0.75));
        unsafe { fmi3FreeInstance::<Spring>(instance) };
        let (instance, host) = stepping(false);
        host.lock().unwrap().force = Some(1.0);
        host.lock().unwrap().wish = Some(0.25);
        assert_eq!(step(instance, 0.0, 1.0), (fmi3OK, false, 1.0), "it may not");
        unsafe { fmi3FreeInstance::<Spring>(instance) };
    }

    /// The force is to run to 1 within the step; but the host wants to return at once, and sets nothing in the next one.
    #[test]
    fn after_an_early_return_at_once_inputs_are_held() {
        let (instance, host) = stepping(true);
        (host.lock().unwrap().force, host.lock().unwrap().wish) = (Some(1.0), Some(-1.0));
        assert_eq!(step(instance, 0.0, 0.5), (fmi3OK, true, 0.0));
        (host.lock().unwrap().force, host.lock().unwrap().wish) = (None, None);
        assert_eq!(step(instance, 0.0, 0.5), (fmi3OK, false, 0.5));
        let mut force = 9.0;
        unsafe {
            fmi3GetFloat64::<Spring>(instance, &reference("F"), 1, &mut force, 1);
            fmi3FreeInstance::<Spring>(instance);
        }
        assert_eq!(force, 0.0);
    }

    #[test]
    fn a_value_out_of_range_within_a_step_is_discarded_and_another_variable_is_an_error() {
        let (instance, host) = stepping(false);
        host.lock().unwrap().force = Some(f64::NAN);
        assert_eq!(step(instance, 0.0, 0.5), (fmi3OK, false, 0.5));
        assert_eq!(host.lock().unwrap().statuses, [fmi3Discard, fmi3OK]);
        unsafe {
            // Not required, and not the time for it: outside of a step all is as always.
            assert_eq!(fmi3SetFloat64::<Spring>(instance, &reference("F"), 1, &2.0, 1), fmi3OK);
            fmi3FreeInstance::<Spring>(instance);
        }
    }

    #[test]
    fn after_an_error_values_can_be_read_and_the_instance_reset() {
        let (instance, host) = stepping(false);
        unsafe {
            let mut x = 0.0;
            assert_eq!(fmi3GetFloat64::<Spring>(instance, &999, 1, &mut x, 1), fmi3Error);
            assert_eq!(step(instance, 0.0, 0.1).0, fmi3Error, "terminated");
            assert_eq!(fmi3GetFloat64::<Spring>(instance, &reference("x"), 1, &mut x, 1), fmi3OK);
            assert_eq!(fmi3Terminate::<Spring>(instance), fmi3Error);
            assert_eq!(fmi3Reset::<Spring>(instance), fmi3OK);
            assert_eq!(
                fmi3EnterInitializationMode::<Spring>(instance, 0, 0.0, 5.0, 0, 0.0),
                fmi3OK
            );
            fmi3FreeInstance::<Spring>(instance);
        }
        let lines = &host.lock().unwrap().lines;
        assert!(lines[0].2.contains("fmi3GetFloat64") && lines[0].2.contains("999"), "{lines:?}");
        assert!(lines.iter().all(|(_, category, _)| category == "logStatusError"), "{lines:?}");
    }

    #[test]
    fn counts_types_and_references_are_checked_before_anything_is_written() {
        for case in 0..6 {
            let (instance, host) = stepping(false);
            let references = [reference("x"), reference("v")];
            let mut room = [7.0; 3];
            let status = unsafe {
                match case {
                    0 => fmi3GetFloat64::<Spring>(
                        instance,
                        references.as_ptr(),
                        2,
                        room.as_mut_ptr(),
                        1,
                    ),
                    1 => fmi3GetFloat64::<Spring>(
                        instance,
                        references.as_ptr(),
                        2,
                        room.as_mut_ptr(),
                        3,
                    ),
                    2 => fmi3GetFloat64::<Spring>(instance, &0, 1, room.as_mut_ptr(), 1),
                    3 => fmi3GetInt32::<Spring>(instance, references.as_ptr(), 1, &mut 0, 1),
                    4 => fmi3GetFloat64::<Spring>(instance, ptr::null(), 1, room.as_mut_ptr(), 1),
                    _ => fmi3GetString::<Spring>(
                        instance,
                        references.as_ptr(),
                        1,
                        ptr::null_mut(),
                        1,
                    ),
                }
            };
            assert_eq!((status, room), (fmi3Error, [7.0; 3]), "{case}");
            let said = host.lock().unwrap().lines[0].2.clone();
            let part =
                ["allowed: 2", "allowed: 2", "reference 0", "Float64", "NULL", "Float64"][case];
            assert!(said.contains(part), "{said}");
            unsafe { fmi3FreeInstance::<Spring>(instance) };
        }
        // Nothing of a type that no variable has is fine, and so is nothing behind NULL.
        let (instance, _host) = stepping(false);
        unsafe {
            assert_eq!(
                fmi3GetUInt64::<Spring>(instance, ptr::null(), 0, ptr::null_mut(), 0),
                fmi3OK
            );
            assert_eq!(fmi3SetFloat64::<Spring>(instance, ptr::null(), 0, ptr::null(), 0), fmi3OK);
            assert_eq!(fmi3GetClock::<Spring>(instance, ptr::null(), 0, ptr::null_mut()), fmi3OK);
            fmi3FreeInstance::<Spring>(instance);
        }
    }

    #[test]
    fn time_is_a_variable_behind_the_table_s() {
        let (instance, _host) = stepping(false);
        let (mut time, reference) = (0.0, time_reference::<Spring>());
        step(instance, 0.0, 0.125);
        unsafe {
            assert_eq!(fmi3GetFloat64::<Spring>(instance, &reference, 1, &mut time, 1), fmi3OK);
            assert_eq!(time, 0.125);
            assert_eq!(fmi3SetFloat64::<Spring>(instance, &reference, 1, &time, 1), fmi3Error);
            fmi3FreeInstance::<Spring>(instance);
        }
    }

    #[test]
    fn no_instance_without_name_token_or_for_scheduled_execution() {
        let host = Mutex::new(TestHost::default());
        let environment = ptr::from_ref(&host).cast_mut().cast();
        let guid = c_string(Spring::table().guid());
        let (name, token) = (c"one".as_ptr(), token());
        let make = |name, token, logger: fmi3LogMessageCallback| unsafe {
            fmi3InstantiateModelExchange::<Spring>(
                name,
                token,
                ptr::null(),
                0,
                0,
                environment,
                logger,
            )
        };
        assert!(make(ptr::null(), token.as_ptr(), Some(log)).is_null());
        assert!(make(name, ptr::null(), Some(log)).is_null());
        assert!(make(name, guid.as_ptr(), Some(log)).is_null(), "the other version's");
        assert!(make(name, guid.as_ptr(), None).is_null());
        let scheduled = unsafe {
            fmi3InstantiateScheduledExecution::<Spring>(
                name,
                token.as_ptr(),
                ptr::null(),
                0,
                0,
                environment,
                Some(log),
                None,
                None,
                None,
            )
        };
        assert!(scheduled.is_null());
        let said = host.lock().unwrap().lines.iter().map(|line| line.2.clone()).collect::<Vec<_>>();
        for (said, part) in
            said.iter().zip(["instanceName", "NULL", "expected", "no Scheduled Execution"])
        {
            assert!(said.contains(part), "{said}");
        }
        assert_eq!(said.len(), 4);
        let made = make(name, token.as_ptr(), None);
        assert!(!made.is_null());
        unsafe { fmi3FreeInstance::<Spring>(made) };
    }

    #[test]
    fn a_number_sign_is_doubled_and_a_percent_sign_is_not() {
        let host = Mutex::new(TestHost::default());
        let environment = ptr::from_ref(&host).cast_mut().cast();
        unsafe {
            let made = fmi3InstantiateModelExchange::<Spring>(
                c"one".as_ptr(),
                c"#1 %s".as_ptr(),
                ptr::null(),
                0,
                0,
                environment,
                Some(log),
            );
            assert!(made.is_null());
        }
        let said = &host.lock().unwrap().lines[0].2;
        assert!(said.contains("##1 %s;"), "{said}");
    }

    #[test]
    fn the_version_is_3_0() {
        assert_eq!(unsafe { text(fmi3GetVersion()) }, Some("3.0".into()));
    }

    #[test]
    fn a_derivative_has_a_number_for_each_of_its_variables() {
        for (seed, sensitivity, said) in
            [(2, 2, "nSeed = 2 (allowed: 1)"), (1, 1, "nSensitivity = 1 (allowed: 2)")]
        {
            let (instance, host) = stepping(false);
            let (unknowns, known) = (["a", "der(v)"].map(reference), reference("F"));
            let (numbers, mut room) = ([1.0; 2], [7.0; 2]);
            let status = unsafe {
                fmi3GetDirectionalDerivative::<Spring>(
                    instance,
                    unknowns.as_ptr(),
                    2,
                    &known,
                    1,
                    numbers.as_ptr(),
                    seed,
                    room.as_mut_ptr(),
                    sensitivity,
                )
            };
            unsafe { fmi3FreeInstance::<Spring>(instance) };
            assert_eq!((status, room), (fmi3Error, [7.0; 2]));
            let lines = &host.lock().unwrap().lines;
            assert!(lines[0].2.contains(said), "{lines:?}");
        }
    }

    /// w.(J v) = (J^T w).v: both sum the same products, in another order.
    #[test]
    fn adjoint_derivatives_are_the_transposed_directional_ones() {
        let (instance, _host) = stepping(false);
        let unknowns = ["a", "der(x)", "der(v)"].map(reference);
        let knowns = [reference("F"), reference("x"), reference("v"), time_reference::<Spring>()];
        let (seed, weights) = ([0.3, -1.2, 0.7, 5.0], [0.9, 0.4, -2.0]);
        let (mut forward, mut adjoint) = ([0.0; 3], [0.0; 4]);
        unsafe {
            assert_eq!(
                fmi3GetDirectionalDerivative::<Spring>(
                    instance,
                    unknowns.as_ptr(),
                    3,
                    knowns.as_ptr(),
                    4,
                    seed.as_ptr(),
                    4,
                    forward.as_mut_ptr(),
                    3,
                ),
                fmi3OK
            );
            assert_eq!(
                fmi3GetAdjointDerivative::<Spring>(
                    instance,
                    unknowns.as_ptr(),
                    3,
                    knowns.as_ptr(),
                    4,
                    weights.as_ptr(),
                    3,
                    adjoint.as_mut_ptr(),
                    4,
                ),
                fmi3OK
            );
            fmi3FreeInstance::<Spring>(instance);
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (one, other) = (dot(&weights, &forward), dot(&adjoint, &seed));
        assert!((one - other).abs() <= 1e-13 * one.abs(), "{one} {other}");
        assert_eq!(adjoint[3], 0.0, "nothing depends on time but by states and inputs");
    }

    #[test]
    fn dependencies_are_those_of_the_start_until_it_is_over_and_then_those_declared() {
        let host = Mutex::new(TestHost::default());
        unsafe {
            let instance = model_exchange(&host);
            let of = |instance, name: &str| {
                let mut count = 99;
                let status = fmi3GetNumberOfVariableDependencies::<Spring>(
                    instance,
                    reference(name),
                    &mut count,
                );
                assert_eq!(status, fmi3OK, "{:?}", host.lock().unwrap().lines);
                let (mut elements, mut known) = (vec![9; count], vec![0; count]);
                let (mut known_elements, mut kinds) = (vec![9; count], vec![9; count]);
                let status = fmi3GetVariableDependencies::<Spring>(
                    instance,
                    reference(name),
                    elements.as_mut_ptr(),
                    known.as_mut_ptr(),
                    known_elements.as_mut_ptr(),
                    kinds.as_mut_ptr(),
                    count,
                );
                assert_eq!(status, fmi3OK);
                assert!(elements.iter().chain(&known_elements).all(|element| *element == 1));
                assert!(kinds.iter().all(|kind| *kind == fmi3Dependent));
                known
            };
            let mut expected = ["F", "x0", "m", "d", "k"].map(reference);
            expected.sort_unstable();
            let mut found = of(instance, "a");
            found.sort_unstable();
            assert_eq!(found, expected);
            fmi3EnterInitializationMode::<Spring>(instance, 0, 0.0, 0.0, 0, 0.0);
            fmi3ExitInitializationMode::<Spring>(instance);
            let mut found = of(instance, "a");
            found.sort_unstable();
            let mut expected = ["F", "x", "v"].map(reference);
            expected.sort_unstable();
            assert_eq!(found, expected);
            assert_eq!(of(instance, "der(x)"), [reference("v")]);
            assert_eq!(of(instance, "f"), []);
            fmi3FreeInstance::<Spring>(instance);
        }
    }

    /// An instance of Model Exchange that tells its messages to `host`.
    fn model_exchange(host: &Mutex<TestHost>) -> fmi3Instance {
        let environment = ptr::from_ref(host).cast_mut().cast();
        let (name, token) = (c"one".as_ptr(), token());
        unsafe {
            fmi3InstantiateModelExchange::<Spring>(
                name,
                token.as_ptr(),
                ptr::null(),
                0,
                0,
                environment,
                Some(log),
            )
        }
    }

    #[test]
    fn model_exchange_goes_through_its_modes_and_takes_single_states() {
        let host = Mutex::new(TestHost::default());
        unsafe {
            let instance = model_exchange(&host);
            assert_eq!(fmi3EnterConfigurationMode::<Spring>(instance), fmi3OK);
            assert_eq!(fmi3ExitConfigurationMode::<Spring>(instance), fmi3OK);
            let mut count = 0;
            assert_eq!(fmi3GetNumberOfContinuousStates::<Spring>(instance, &mut count), fmi3OK);
            assert_eq!(count, 2);
            assert_eq!(fmi3GetNumberOfEventIndicators::<Spring>(instance, &mut count), fmi3OK);
            assert_eq!(count, 0);
            fmi3EnterInitializationMode::<Spring>(instance, 0, 0.0, 1.0, 0, 0.0);
            assert_eq!(fmi3ExitInitializationMode::<Spring>(instance), fmi3OK);
            let mut b = [9; 5];
            let [b0, b1, b2, b3, b4] = &mut b;
            let mut next = 0.0;
            let status =
                fmi3UpdateDiscreteStates::<Spring>(instance, b0, b1, b2, b3, b4, &mut next);
            assert_eq!((status, b, next), (fmi3OK, [0; 5], 0.0));
            assert_eq!(fmi3EvaluateDiscreteStates::<Spring>(instance), fmi3OK);
            assert_eq!(fmi3EnterContinuousTimeMode::<Spring>(instance), fmi3OK);
            // A state by its reference; its derivative follows.
            let force = [0.25, 0.5];
            let references = ["x", "v"].map(reference);
            assert_eq!(
                fmi3SetFloat64::<Spring>(instance, references.as_ptr(), 2, force.as_ptr(), 2),
                fmi3OK
            );
            let mut x = [0.0; 2];
            assert_eq!(fmi3GetContinuousStates::<Spring>(instance, x.as_mut_ptr(), 2), fmi3OK);
            assert_eq!(x, force);
            assert_eq!(
                fmi3GetContinuousStateDerivatives::<Spring>(instance, x.as_mut_ptr(), 2),
                fmi3OK
            );
            assert_eq!(x[0], 0.5);
            assert_eq!(
                fmi3SetFloat64::<Spring>(instance, references.as_ptr(), 1, &f64::NAN, 1),
                fmi3Discard
            );
            // Back to the event, and no further.
            assert_eq!(fmi3SetTime::<Spring>(instance, 2.0), fmi3OK);
            assert_eq!(fmi3SetTime::<Spring>(instance, 1.0), fmi3OK);
            assert_eq!(fmi3SetTime::<Spring>(instance, 0.9), fmi3Error);
            fmi3FreeInstance::<Spring>(instance);
        }
    }

    #[test]
    fn within_steps_hosts_see_real_outputs_and_inputs_that_follow_no_others() {
        let vessels = crate::tests::vessels::TABLE.variables.iter();
        let seen = vessels.filter(|variable| has_intermediate_update(variable));
        let names: Vec<_> = seen.map(|variable| variable.name).collect();
        assert_eq!(names, ["level", "sum", "q", "w"]);
    }

    #[test]
    fn a_bool_may_be_any_byte() {
        assert_eq!(size_of::<fmi3Boolean>(), 1);
        let (instance, _host) = stepping(false);
        unsafe {
            assert_eq!(fmi3SetDebugLogging::<Spring>(instance, 0xFF, 0, ptr::null()), fmi3OK);
            fmi3FreeInstance::<Spring>(instance);
            fmi3FreeInstance::<Spring>(ptr::null_mut());
        }
    }

    #[test]
    fn times_come_with_initialization_and_those_that_are_not_defined_may_be_nan() {
        let host = Mutex::new(TestHost::default());
        unsafe {
            let instance = fmi3InstantiateCoSimulation::<Spring>(
                c"one".as_ptr(),
                token().as_ptr(),
                ptr::null(),
                0,
                0,
                0,
                0,
                ptr::null(),
                0,
                ptr::from_ref(&host).cast_mut().cast(),
                Some(log),
                None,
            );
            let begin = |tolerance, at, stop_defined, stop| {
                fmi3EnterInitializationMode::<Spring>(
                    instance,
                    0,
                    tolerance,
                    at,
                    stop_defined,
                    stop,
                )
            };
            assert_eq!(begin(f64::NAN, 2.0, 1, 1.0), fmi3Error, "it stops before it starts");
            assert_eq!(fmi3Reset::<Spring>(instance), fmi3OK);
            assert_eq!(begin(f64::NAN, 2.0, 1, 3.0), fmi3OK);
            assert_eq!(fmi3ExitInitializationMode::<Spring>(instance), fmi3OK);
            assert_eq!(step(instance, 2.0, 1.0), (fmi3OK, false, 3.0));
            assert_eq!(step(instance, 3.0, 0.1).0, fmi3Error, "past the stop time");
            assert_eq!(fmi3Reset::<Spring>(instance), fmi3OK);
            assert_eq!(begin(f64::NAN, -1.0, 0, f64::NAN), fmi3OK);
            assert_eq!(fmi3ExitInitializationMode::<Spring>(instance), fmi3OK);
            assert_eq!(step(instance, -1.0, 5.0), (fmi3OK, false, 4.0));
            fmi3FreeInstance::<Spring>(instance);
        }
    }

    /// fmusim 0.8 asks in continuous-time mode, where the standard's table has neither.
    #[test]
    fn fmusim_may_ask_for_the_numbers_of_states_and_indicators_in_continuous_time_mode() {
        let host = Mutex::new(TestHost::default());
        unsafe {
            let instance = model_exchange(&host);
            fmi3EnterInitializationMode::<Spring>(instance, 0, 0.0, 0.0, 0, 0.0);
            fmi3ExitInitializationMode::<Spring>(instance);
            assert_eq!(fmi3EnterContinuousTimeMode::<Spring>(instance), fmi3OK);
            let mut count = 9;
            assert_eq!(fmi3GetNumberOfContinuousStates::<Spring>(instance, &mut count), fmi3OK);
            assert_eq!(count, 2);
            assert_eq!(fmi3GetNumberOfEventIndicators::<Spring>(instance, &mut count), fmi3OK);
            assert_eq!(count, 0);
            fmi3FreeInstance::<Spring>(instance);
        }
    }
}

/// Tests with a host that knows arrays.
#[cfg(test)]
mod tests_of_arrays {
    use super::*;
    use crate::tests::trays::Trays;
    use std::sync::Mutex;

    type Lines = Mutex<Vec<String>>;

    unsafe extern "C" fn log(to: *mut c_void, _: fmi3Status, _: fmi3String, what: fmi3String) {
        let lines = unsafe { &*to.cast::<Lines>() };
        lines.lock().unwrap().push(unsafe { text(what) }.unwrap());
    }

    /// An instance for a host that knows arrays.
    fn made(lines: &Lines) -> fmi3Instance {
        let token = c_string(Trays::table().token(Layout::Arrays));
        let environment = std::ptr::from_ref(lines).cast_mut().cast();
        let (name, log) = (c"one".as_ptr(), Some(log as _));
        let instance = unsafe {
            fmi3InstantiateModelExchange::<Trays>(
                name,
                token.as_ptr(),
                std::ptr::null(),
                0,
                0,
                environment,
                log,
            )
        };
        assert!(!instance.is_null(), "{:?}", lines.lock().unwrap());
        instance
    }

    fn get<const N: usize>(instance: fmi3Instance, of: &[u32]) -> (fmi3Status, [f64; N]) {
        let mut values = [7.0; N];
        let (count, room) = (of.len(), values.as_mut_ptr());
        let status = unsafe { fmi3GetFloat64::<Trays>(instance, of.as_ptr(), count, room, N) };
        (status, values)
    }

    fn set(instance: fmi3Instance, of: u32, values: &[f64]) -> fmi3Status {
        unsafe { fmi3SetFloat64::<Trays>(instance, &of, 1, values.as_ptr(), values.len()) }
    }

    #[test]
    fn values_of_arrays_come_one_after_the_other_by_rows() {
        let lines = Lines::default();
        let instance = made(&lines);
        assert_eq!(get(instance, &[6, 7]), (fmi3OK, [0.0, 1.0, 2.0, 3.0, 10.0, 11.0, 13.0, 14.0]));
        assert_eq!(set(instance, 7, &[1.5, 2.5, 3.5, 4.5]), fmi3OK);
        assert_eq!(get(instance, &[8, 7]), (fmi3OK, [0.5, 1.5, 2.5, 3.5, 4.5]));
        assert_eq!(set(instance, 4, &[0.25, -0.5]), fmi3OK);
        unsafe {
            assert_eq!(fmi3EnterInitializationMode::<Trays>(instance, 0, 0.0, 3.0, 0, 0.0), fmi3OK);
        }
        assert_eq!(get(instance, &[1, 3, 9]), (fmi3OK, [1.0, 2.0, 0.25, -0.5, 3.0]));
        assert_eq!(get(instance, &[10]), (fmi3OK, [0.25, -0.5]));
        unsafe { fmi3FreeInstance::<Trays>(instance) };
        assert_eq!(*lines.lock().unwrap(), [""; 0]);
    }

    /// Messages name the error and the lengths of the arrays; of five and more the first four.
    #[test]
    fn wrong_counts_types_and_references_of_arrays_are_described() {
        let all = [6, 7, 8, 6, 8];
        for (case, said) in [
            "nValues = 3 (allowed: 4, by rows: w[2,2])",
            "nValues = 3 (allowed: 13, by rows: w[2,2], m[2,2], k, w[2,2])",
            "nValues = 3 (allowed: 14, by rows: w[2,2], m[2,2], k, w[2,2], …)",
            "no variable has the value reference 11 (allowed: 1 to 10)",
            "rows (value reference 5) is of type UInt64",
            "level (value reference 1) is of type Float64",
            "nValues = 5 (allowed: 4, by rows: m[2,2])",
        ]
        .into_iter()
        .enumerate()
        {
            let lines = Lines::default();
            let instance = made(&lines);
            let status = match case {
                0 => get::<3>(instance, &all[..1]).0,
                1 => get::<3>(instance, &all[..4]).0,
                2 => get::<3>(instance, &all).0,
                3 => get::<1>(instance, &[11]).0,
                4 => get::<1>(instance, &[5]).0,
                5 => unsafe { fmi3GetInt32::<Trays>(instance, &1, 1, &mut 0, 1) },
                _ => set(instance, 7, &[1.0; 5]),
            };
            unsafe { fmi3FreeInstance::<Trays>(instance) };
            let lines = lines.lock().unwrap();
            assert_eq!((status, lines.len()), (fmi3Error, 1), "{lines:?}");
            assert!(lines[0].ends_with(said), "{}\n{said}", lines[0]);
        }
    }

    /// Whatever another number of trays sizes has its start values; the rest, and all where the number is what it was, stays.
    #[test]
    fn another_size_starts_what_it_sizes_anew() {
        let lines = Lines::default();
        let instance = made(&lines);
        let rows = |n: u64| unsafe {
            assert_eq!(fmi3EnterConfigurationMode::<Trays>(instance), fmi3OK);
            assert_eq!(fmi3SetUInt64::<Trays>(instance, &5, 1, &n, 1), fmi3OK);
            assert_eq!(fmi3ExitConfigurationMode::<Trays>(instance), fmi3OK);
            let mut found = 0;
            assert_eq!(fmi3GetUInt64::<Trays>(instance, &5, 1, &mut found, 1), fmi3OK);
            assert_eq!(found, n);
        };
        let states = || unsafe {
            let mut count = 0;
            assert_eq!(fmi3GetNumberOfContinuousStates::<Trays>(instance, &mut count), fmi3OK);
            count
        };
        assert_eq!((set(instance, 7, &[1.5; 4]), set(instance, 8, &[9.0])), (fmi3OK, fmi3OK));
        rows(2);
        assert_eq!((get(instance, &[7, 8]), states()), ((fmi3OK, [1.5, 1.5, 1.5, 1.5, 9.0]), 2));
        rows(3);
        let all = [10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 9.0];
        assert_eq!((get(instance, &[7, 8]), states()), ((fmi3OK, all), 3));
        rows(1);
        assert_eq!((get(instance, &[7, 8]), states()), ((fmi3OK, [10.0, 13.0, 9.0]), 1));
        unsafe {
            // as new: two
            assert_eq!(fmi3Reset::<Trays>(instance), fmi3OK);
        }
        assert_eq!(
            (get(instance, &[7, 8]), states()),
            ((fmi3OK, [10.0, 11.0, 13.0, 14.0, 0.5]), 2)
        );
        unsafe { fmi3FreeInstance::<Trays>(instance) };
        // to three rows; to one nothing was set any more
        let told = "fmi3SetUInt64: rows changed, what was set before is lost of m";
        assert_eq!(*lines.lock().unwrap(), [told]);
    }

    /// Scalars 1 to 24 (k), time, two indicators: read alone, as Float64.
    #[test]
    fn behind_the_table_s_scalars_are_time_and_the_event_indicators() {
        let lines = Lines::default();
        let token = c_string(Trays::table().token(Layout::Scalars));
        let environment = std::ptr::from_ref(&lines).cast_mut().cast();
        let made = || unsafe {
            let (name, token, path) = (c"one".as_ptr(), token.as_ptr(), std::ptr::null());
            let instance = fmi3InstantiateModelExchange::<Trays>(
                name,
                token,
                path,
                0,
                0,
                environment,
                Some(log as _),
            );
            fmi3EnterInitializationMode::<Trays>(instance, 0, 0.0, 3.0, 0, 0.0);
            instance
        };
        let instance = made();
        assert_eq!(get(instance, &[24, 25, 26, 27]), (fmi3OK, [0.5, 3.0, 0.25, -0.5]));
        unsafe { fmi3FreeInstance::<Trays>(instance) };
        for (case, said) in [
            "no variable has the value reference 28 (allowed: 1 to 27)",
            "event_indicator[2] (value reference 27) can only be read",
            "event_indicator[1] (value reference 26) is of type Float64",
            "time (value reference 25) is of type Float64",
            "nValues = 2 (allowed: 1, one for each value reference)",
        ]
        .into_iter()
        .enumerate()
        {
            let instance = made();
            let status = match case {
                0 => get::<1>(instance, &[28]).0,
                1 => set(instance, 27, &[1.0]),
                2 => unsafe { fmi3GetInt32::<Trays>(instance, &26, 1, &mut 0, 1) },
                3 => unsafe { fmi3GetInt32::<Trays>(instance, &25, 1, &mut 0, 1) },
                _ => set(instance, 8, &[1.0; 2]),
            };
            unsafe { fmi3FreeInstance::<Trays>(instance) };
            let lines = std::mem::take(&mut *lines.lock().unwrap());
            assert_eq!((status, lines.len()), (fmi3Error, 1), "{lines:?}");
            assert!(lines[0].ends_with(said), "{}\n{said}", lines[0]);
        }
        let names = extra_names::<Trays>();
        assert_eq!(names, ["time", "event_indicator[1]", "event_indicator[2]"]);
        assert_eq!(time_reference::<Trays>(), 25);
    }

    /// Dependencies on elements: of a square on all levels and inputs of the trays that there are, though all are 0 and so
    /// are the derivatives; of a rate on its own input.
    #[test]
    fn elements_depend_on_elements_also_where_the_derivative_vanishes() {
        let lines = Lines::default();
        let instance = made(&lines);
        unsafe {
            fmi3EnterInitializationMode::<Trays>(instance, 0, 0.0, 0.0, 0, 0.0);
            assert_eq!(fmi3ExitInitializationMode::<Trays>(instance), fmi3OK);
            assert_eq!(fmi3EnterContinuousTimeMode::<Trays>(instance), fmi3OK);
            let x = [0.0; 2];
            assert_eq!(fmi3SetContinuousStates::<Trays>(instance, x.as_ptr(), 2), fmi3OK);
        }
        let of = |variable: u32| unsafe {
            let mut count = 99;
            let status =
                fmi3GetNumberOfVariableDependencies::<Trays>(instance, variable, &mut count);
            assert_eq!(status, fmi3OK, "{:?}", lines.lock().unwrap());
            let (mut own, mut known) = (vec![9; count], vec![0; count]);
            let (mut elements, mut kinds) = (vec![9; count], vec![9; count]);
            let status = fmi3GetVariableDependencies::<Trays>(
                instance,
                variable,
                own.as_mut_ptr(),
                known.as_mut_ptr(),
                elements.as_mut_ptr(),
                kinds.as_mut_ptr(),
                count,
            );
            assert_eq!(status, fmi3OK);
            let mut all: Vec<_> =
                own.iter().zip(&known).zip(&elements).map(|((a, b), c)| (*a, *b, *c)).collect();
            all.sort_unstable();
            all
        };
        assert_eq!(of(2), [(1, 1, 1), (1, 1, 2), (1, 4, 1), (1, 4, 2)]);
        assert_eq!(of(3), [(1, 4, 1), (2, 4, 2)]);
        unsafe { fmi3FreeInstance::<Trays>(instance) };
    }
}

//! The C interface of FMI 3.0 for Model Exchange and Co-Simulation: 75 functions with their names, signatures and constants.
//! The FMI standard documents them; the comments here describe only properties of this implementation.
//!
//! Every function is generic in the model; `export_fmi3!` exports them for one model under their names. Their effects are
//! implemented in [`crate::instance`] and [`crate::snapshot`], the common part of the C interface in `crate::c_abi`.
//!
//! The value reference of a scalar is its position among the variables, counted from 1. After the variables of the table
//! follow the independent variable and the event indicators, which are not variables in FMI 2.0. There are no clocks and no
//! binary variables; the functions for them return what the standard requires of an FMU without them.
//!
//! If the token shows that the host has read the description with arrays, value references count the entries of the table
//! instead. Each value reference then stands for all scalars of an array ([`arrays`]).

// The names are the standard's.
#![allow(non_camel_case_types, non_upper_case_globals, non_snake_case)]
// The safety contract of every function is that of the FMI 3.0 standard: an instance comes from one of the functions that
// create one and is not yet freed, arrays have the given lengths, and strings end with NUL.
#![allow(clippy::missing_safety_doc, clippy::too_many_arguments)]
// The standard documents the functions.
#![allow(missing_docs)]
#![allow(unsafe_code)]

pub mod arrays;
mod calls;
mod dependencies;
mod derivatives;
mod elements;
mod host;
mod life;
mod model_exchange;
mod references;
mod stepping;
mod types;
mod values;

pub use self::calls::*;
pub use self::host::*;
pub use self::references::*;
pub use self::types::*;

use self::dependencies::{dependencies, write_dependencies};
use self::derivatives::{adjoint_derivative, directional_derivative};
use self::elements::resize;
use self::life::{Stepping, co_simulation, instantiate};
use self::model_exchange::{fill_states, set_states, state_count, write_count};
use self::stepping::{Answers, do_step, output_derivatives};
use self::values::{access_no_variable, get, get_sizes, set, set_sizes};
use crate::c_abi::{
    c_functions, completed_step, deserialize, fill, filter, free_component, free_state, perform,
    perform_if_allowed, perform_start, place, save_state, saved_state, serialize, serialized_size,
};
use crate::call::states::*;
use crate::call::{Call, InstanceState, Interface};
use crate::instance::Instance;
use crate::log::Filter;
use crate::model::Model;
use crate::variable::Value;
use crate::version::Version;

c_functions! { $ export_fmi3, v3;

fn fmi3GetVersion() -> fmi3String = c"3.0".as_ptr();

// ---- Version, logging, creation and destruction of instances ----

/// Selects the messages that are logged. The reasons of failed calls are always logged.
fn fmi3SetDebugLogging(instance: fmi3Instance, loggingOn: fmi3Boolean, nCategories: usize, categories: *const fmi3String) -> fmi3Status =
    perform_if_allowed::<M, Fmi3>(instance, &SET_DEBUG_LOGGING, |component| {
        let filter = filter::<M>(&SET_DEBUG_LOGGING, categories, nCategories)?;
        component.log.filter = if loggingOn == 0 { Filter::ERRORS } else { filter.with_errors() };
        Ok(())
    });
fn fmi3InstantiateModelExchange(instanceName: fmi3String, instantiationToken: fmi3String, resourcePath: fmi3String, _visible: fmi3Boolean, _loggingOn: fmi3Boolean, instanceEnvironment: fmi3InstanceEnvironment, logMessage: fmi3LogMessageCallback) -> fmi3Instance = {
    let texts = (instanceName, instantiationToken, resourcePath);
    instantiate::<M>("fmi3InstantiateModelExchange", texts, (instanceEnvironment, logMessage), |_| {
        Ok((Instance::new(Interface::ModelExchange), Host::new(instanceEnvironment)))
    })
};
fn fmi3InstantiateCoSimulation(instanceName: fmi3String, instantiationToken: fmi3String, resourcePath: fmi3String, _visible: fmi3Boolean, _loggingOn: fmi3Boolean, eventModeUsed: fmi3Boolean, earlyReturnAllowed: fmi3Boolean, requiredIntermediateVariables: *const fmi3ValueReference, nRequiredIntermediateVariables: usize, instanceEnvironment: fmi3InstanceEnvironment, logMessage: fmi3LogMessageCallback, intermediateUpdate: fmi3IntermediateUpdateCallback) -> fmi3Instance = {
    let texts = (instanceName, instantiationToken, resourcePath);
    let with = Stepping {
        event_mode: eventModeUsed != 0,
        early_return: earlyReturnAllowed != 0,
        environment: instanceEnvironment,
        update: intermediateUpdate,
    };
    let required = (requiredIntermediateVariables, nRequiredIntermediateVariables);
    instantiate::<M>("fmi3InstantiateCoSimulation", texts, (instanceEnvironment, logMessage), |arrays| {
        co_simulation(arrays, with, required)
    })
};
/// Returns NULL, because the FMU does not support Scheduled Execution.
fn fmi3InstantiateScheduledExecution(instanceName: fmi3String, instantiationToken: fmi3String, resourcePath: fmi3String, _visible: fmi3Boolean, _loggingOn: fmi3Boolean, instanceEnvironment: fmi3InstanceEnvironment, logMessage: fmi3LogMessageCallback, _clockUpdate: fmi3ClockUpdateCallback, _lockPreemption: fmi3LockPreemptionCallback, _unlockPreemption: fmi3UnlockPreemptionCallback) -> fmi3Instance = {
    let texts = (instanceName, instantiationToken, resourcePath);
    instantiate::<M>("fmi3InstantiateScheduledExecution", texts, (instanceEnvironment, logMessage), |_| {
        Err("this FMU has Model Exchange and Co-Simulation, no Scheduled Execution".into())
    })
};
fn fmi3FreeInstance(instance: fmi3Instance) = free_component::<M, Fmi3>(instance);
fn fmi3EnterInitializationMode(instance: fmi3Instance, toleranceDefined: fmi3Boolean, tolerance: fmi3Float64, startTime: fmi3Float64, stopTimeDefined: fmi3Boolean, stopTime: fmi3Float64) -> fmi3Status = {
    let tolerance = (toleranceDefined != 0).then_some(tolerance);
    let stop = (stopTimeDefined != 0).then_some(stopTime);
    perform::<M, Fmi3>(instance, Fmi3::ENTER_INITIALIZATION, |component| {
        component.instance.setup_experiment(tolerance, startTime, stop)?;
        component.instance.enter_initialization_mode()
    })
};
fn fmi3ExitInitializationMode(instance: fmi3Instance) -> fmi3Status =
    perform_start::<M, Fmi3>(instance, Fmi3::EXIT_INITIALIZATION, |component| component.instance.exit_initialization_mode());
fn fmi3EnterEventMode(instance: fmi3Instance) -> fmi3Status =
    perform::<M, Fmi3>(instance, Fmi3::ENTER_EVENT, |component| component.instance.enter_event_mode());
fn fmi3Terminate(instance: fmi3Instance) -> fmi3Status =
    perform::<M, Fmi3>(instance, Fmi3::TERMINATE, |component| component.instance.terminate());
fn fmi3Reset(instance: fmi3Instance) -> fmi3Status =
    perform::<M, Fmi3>(instance, Fmi3::RESET, |component| {
        component.instance.reset()?;
        resize(component);
        Ok(())
    });

// ---- Values ----

fn fmi3GetFloat32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *mut fmi3Float32, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetFloat32", GET) }, (valueReferences, nValueReferences), nValues);
fn fmi3GetFloat64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Float64, nValues: usize) -> fmi3Status =
    get::<M, _>(instance, &GET_FLOAT64, (valueReferences, nValueReferences), (values, nValues), Value::real);
fn fmi3GetInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *mut i8, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetInt8", GET) }, (valueReferences, nValueReferences), nValues);
fn fmi3GetUInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *mut u8, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetUInt8", GET) }, (valueReferences, nValueReferences), nValues);
fn fmi3GetInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *mut i16, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetInt16", GET) }, (valueReferences, nValueReferences), nValues);
fn fmi3GetUInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *mut u16, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetUInt16", GET) }, (valueReferences, nValueReferences), nValues);
fn fmi3GetInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Int32, nValues: usize) -> fmi3Status =
    get::<M, _>(instance, &GET_INT32, (valueReferences, nValueReferences), (values, nValues), Value::integer);
fn fmi3GetUInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *mut u32, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetUInt32", GET) }, (valueReferences, nValueReferences), nValues);
fn fmi3GetInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Int64, nValues: usize) -> fmi3Status =
    get::<M, _>(instance, &GET_INT64, (valueReferences, nValueReferences), (values, nValues), |value| value.integer().map(i64::from));
fn fmi3GetUInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3UInt64, nValues: usize) -> fmi3Status =
    get_sizes::<M>(instance, (valueReferences, nValueReferences), (values, nValues));
fn fmi3GetBoolean(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *mut fmi3Boolean, nValues: usize) -> fmi3Status =
    get::<M, _>(instance, &GET_BOOLEAN, (valueReferences, nValueReferences), (values, nValues), |value| value.boolean().map(u8::from));
fn fmi3GetString(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *mut fmi3String, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetString", GET) }, (valueReferences, nValueReferences), nValues);
fn fmi3GetBinary(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _valueSizes: *mut usize, _values: *mut fmi3Binary, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetBinary", GET) }, (valueReferences, nValueReferences), nValues);
fn fmi3GetClock(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *mut fmi3Clock) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetClock", ANY) }, (valueReferences, nValueReferences), nValueReferences);
fn fmi3SetFloat32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *const fmi3Float32, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetFloat32", SET) }, (valueReferences, nValueReferences), nValues);
fn fmi3SetFloat64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Float64, nValues: usize) -> fmi3Status =
    set::<M, _>(instance, &SET_FLOAT64, (valueReferences, nValueReferences), (values, nValues), Value::Real);
fn fmi3SetInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *const i8, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetInt8", SET) }, (valueReferences, nValueReferences), nValues);
fn fmi3SetUInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *const u8, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetUInt8", SET) }, (valueReferences, nValueReferences), nValues);
fn fmi3SetInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *const i16, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetInt16", SET) }, (valueReferences, nValueReferences), nValues);
fn fmi3SetUInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *const u16, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetUInt16", SET) }, (valueReferences, nValueReferences), nValues);
fn fmi3SetInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Int32, nValues: usize) -> fmi3Status =
    set::<M, _>(instance, &SET_INT32, (valueReferences, nValueReferences), (values, nValues), Value::Integer);
fn fmi3SetUInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *const u32, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetUInt32", SET) }, (valueReferences, nValueReferences), nValues);
/// Sets enumerations. A value that does not fit into 32 bits is replaced by 0, which is not an item of any enumeration and
/// therefore refused.
fn fmi3SetInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Int64, nValues: usize) -> fmi3Status =
    set::<M, _>(instance, &SET_INT64, (valueReferences, nValueReferences), (values, nValues), |n| Value::Integer(i32::try_from(n).unwrap_or(0)));
fn fmi3SetUInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3UInt64, nValues: usize) -> fmi3Status =
    set_sizes::<M>(instance, (valueReferences, nValueReferences), (values, nValues));
fn fmi3SetBoolean(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, values: *const fmi3Boolean, nValues: usize) -> fmi3Status =
    set::<M, _>(instance, &SET_BOOLEAN, (valueReferences, nValueReferences), (values, nValues), |b| Value::Boolean(b != 0));
fn fmi3SetString(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *const fmi3String, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetString", SET) }, (valueReferences, nValueReferences), nValues);
fn fmi3SetBinary(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _valueSizes: *const usize, _values: *const fmi3Binary, nValues: usize) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetBinary", SET) }, (valueReferences, nValueReferences), nValues);
fn fmi3SetClock(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _values: *const fmi3Clock) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetClock", ANY) }, (valueReferences, nValueReferences), nValueReferences);

// ---- Dependencies, saved states, derivatives ----

fn fmi3GetNumberOfVariableDependencies(instance: fmi3Instance, valueReference: fmi3ValueReference, nDependencies: *mut usize) -> fmi3Status =
    write_count::<M>(instance, &NUMBER_OF_DEPENDENCIES, ("nDependencies", nDependencies), |component| {
        Ok(dependencies(component, &NUMBER_OF_DEPENDENCIES, valueReference)?.len())
    });
fn fmi3GetVariableDependencies(instance: fmi3Instance, dependent: fmi3ValueReference, elementIndicesOfDependent: *mut usize, independents: *mut fmi3ValueReference, elementIndicesOfIndependents: *mut usize, dependencyKinds: *mut fmi3DependencyKind, nDependencies: usize) -> fmi3Status = {
    let (to, from) = ((elementIndicesOfDependent, independents), (elementIndicesOfIndependents, dependencyKinds));
    write_dependencies::<M>(instance, dependent, to, from, nDependencies)
};
fn fmi3GetFMUState(instance: fmi3Instance, FMUState: *mut fmi3FMUState) -> fmi3Status =
    perform_if_allowed::<M, Fmi3>(instance, &GET_STATE, |component| save_state(&GET_STATE, "FMUState", FMUState, &component.instance));
fn fmi3SetFMUState(instance: fmi3Instance, FMUState: fmi3FMUState) -> fmi3Status =
    perform_if_allowed::<M, Fmi3>(instance, Fmi3::SET_STATE, |component| {
        component.instance.restore(saved_state(Fmi3::SET_STATE, "FMUState", FMUState)?)?;
        resize(component);
        Ok(())
    });
fn fmi3FreeFMUState(instance: fmi3Instance, FMUState: *mut fmi3FMUState) -> fmi3Status =
    perform::<M, Fmi3>(instance, &FREE_STATE, |_| free_state::<M, Fmi3>(&FREE_STATE, "FMUState", FMUState));
fn fmi3SerializedFMUStateSize(instance: fmi3Instance, FMUState: fmi3FMUState, size: *mut usize) -> fmi3Status =
    serialized_size::<M, Fmi3>(instance, &SERIALIZED_SIZE, ("FMUState", FMUState), size);
fn fmi3SerializeFMUState(instance: fmi3Instance, FMUState: fmi3FMUState, serializedState: *mut fmi3Byte, size: usize) -> fmi3Status =
    serialize::<M, Fmi3>(instance, &SERIALIZE, ("FMUState", FMUState), (serializedState, size));
fn fmi3DeserializeFMUState(instance: fmi3Instance, serializedState: *const fmi3Byte, size: usize, FMUState: *mut fmi3FMUState) -> fmi3Status =
    deserialize::<M, Fmi3>(instance, &DESERIALIZE, (serializedState, size), ("FMUState", FMUState));
fn fmi3GetDirectionalDerivative(instance: fmi3Instance, unknowns: *const fmi3ValueReference, nUnknowns: usize, knowns: *const fmi3ValueReference, nKnowns: usize, seed: *const fmi3Float64, nSeed: usize, sensitivity: *mut fmi3Float64, nSensitivity: usize) -> fmi3Status =
    directional_derivative::<M>(instance, (unknowns, nUnknowns), (knowns, nKnowns), (seed, nSeed), (sensitivity, nSensitivity));
fn fmi3GetAdjointDerivative(instance: fmi3Instance, unknowns: *const fmi3ValueReference, nUnknowns: usize, knowns: *const fmi3ValueReference, nKnowns: usize, seed: *const fmi3Float64, nSeed: usize, sensitivity: *mut fmi3Float64, nSensitivity: usize) -> fmi3Status =
    adjoint_derivative::<M>(instance, (unknowns, nUnknowns), (knowns, nKnowns), (seed, nSeed), (sensitivity, nSensitivity));

// ---- Configuration; clocks, of which there are none ----

fn fmi3EnterConfigurationMode(instance: fmi3Instance) -> fmi3Status =
    perform::<M, Fmi3>(instance, &ENTER_CONFIGURATION, |component| {
        component.instance.configure(&ENTER_CONFIGURATION, InstanceState::Configuration)
    });
fn fmi3ExitConfigurationMode(instance: fmi3Instance) -> fmi3Status =
    perform::<M, Fmi3>(instance, &EXIT_CONFIGURATION, |component| {
        component.instance.configure(&EXIT_CONFIGURATION, InstanceState::Instantiated)
    });
fn fmi3GetIntervalDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _intervals: *mut fmi3Float64, _qualifiers: *mut fmi3IntervalQualifier) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetIntervalDecimal", ANY) }, (valueReferences, nValueReferences), nValueReferences);
fn fmi3GetIntervalFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _counters: *mut fmi3UInt64, _resolutions: *mut fmi3UInt64, _qualifiers: *mut fmi3IntervalQualifier) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetIntervalFraction", ANY) }, (valueReferences, nValueReferences), nValueReferences);
fn fmi3GetShiftDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _shifts: *mut fmi3Float64) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetShiftDecimal", ANY) }, (valueReferences, nValueReferences), nValueReferences);
fn fmi3GetShiftFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _counters: *mut fmi3UInt64, _resolutions: *mut fmi3UInt64) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3GetShiftFraction", ANY) }, (valueReferences, nValueReferences), nValueReferences);
fn fmi3SetIntervalDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _intervals: *const fmi3Float64) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetIntervalDecimal", ANY) }, (valueReferences, nValueReferences), nValueReferences);
fn fmi3SetIntervalFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _counters: *const fmi3UInt64, _resolutions: *const fmi3UInt64) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetIntervalFraction", ANY) }, (valueReferences, nValueReferences), nValueReferences);
fn fmi3SetShiftDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _shifts: *const fmi3Float64) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetShiftDecimal", ANY) }, (valueReferences, nValueReferences), nValueReferences);
fn fmi3SetShiftFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, _counters: *const fmi3UInt64, _resolutions: *const fmi3UInt64) -> fmi3Status =
    access_no_variable::<M>(instance, const { &Call::new("fmi3SetShiftFraction", ANY) }, (valueReferences, nValueReferences), nValueReferences);

// ---- Events and Model Exchange ----

/// Does nothing, because fmi3UpdateDiscreteStates evaluates the discrete states.
fn fmi3EvaluateDiscreteStates(instance: fmi3Instance) -> fmi3Status =
    perform_if_allowed::<M, Fmi3>(instance, &EVALUATE_DISCRETE_STATES, |_| Ok(()));
fn fmi3UpdateDiscreteStates(instance: fmi3Instance, discreteStatesNeedUpdate: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean, nominalsOfContinuousStatesChanged: *mut fmi3Boolean, valuesOfContinuousStatesChanged: *mut fmi3Boolean, nextEventTimeDefined: *mut fmi3Boolean, nextEventTime: *mut fmi3Float64) -> fmi3Status = {
    let call = Fmi3::NEW_DISCRETE_STATES;
    perform_if_allowed::<M, Fmi3>(instance, call, |component| {
        let need_update = place(call, "discreteStatesNeedUpdate", discreteStatesNeedUpdate)?;
        let terminate = place(call, "terminateSimulation", terminateSimulation)?;
        let nominals_changed = place(call, "nominalsOfContinuousStatesChanged", nominalsOfContinuousStatesChanged)?;
        let values_changed = place(call, "valuesOfContinuousStatesChanged", valuesOfContinuousStatesChanged)?;
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
};
fn fmi3EnterContinuousTimeMode(instance: fmi3Instance) -> fmi3Status =
    perform::<M, Fmi3>(instance, Fmi3::ENTER_CONTINUOUS_TIME, |component| component.instance.enter_continuous_time_mode());
fn fmi3CompletedIntegratorStep(instance: fmi3Instance, _noSetFMUStatePriorToCurrentPoint: fmi3Boolean, enterEventMode: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean) -> fmi3Status =
    completed_step::<M, Fmi3, _>(instance, enterEventMode, terminateSimulation);
fn fmi3SetTime(instance: fmi3Instance, time: fmi3Float64) -> fmi3Status =
    perform::<M, Fmi3>(instance, Fmi3::SET_TIME, |component| component.instance.set_time(time));
fn fmi3SetContinuousStates(instance: fmi3Instance, continuousStates: *const fmi3Float64, nContinuousStates: usize) -> fmi3Status =
    set_states::<M>(instance, (continuousStates, nContinuousStates));
fn fmi3GetContinuousStateDerivatives(instance: fmi3Instance, derivatives: *mut fmi3Float64, nContinuousStates: usize) -> fmi3Status =
    fill_states::<M>(instance, Fmi3::GET_DERIVATIVES, ("derivatives", derivatives, nContinuousStates), Instance::derivatives);
fn fmi3GetEventIndicators(instance: fmi3Instance, eventIndicators: *mut fmi3Float64, nEventIndicators: usize) -> fmi3Status =
    fill::<M, Fmi3>(instance, Fmi3::GET_EVENT_INDICATORS, ("eventIndicators", eventIndicators, nEventIndicators), Instance::event_indicators);
fn fmi3GetContinuousStates(instance: fmi3Instance, continuousStates: *mut fmi3Float64, nContinuousStates: usize) -> fmi3Status =
    fill_states::<M>(instance, Fmi3::GET_CONTINUOUS_STATES, ("continuousStates", continuousStates, nContinuousStates), Instance::continuous_states);
fn fmi3GetNominalsOfContinuousStates(instance: fmi3Instance, nominals: *mut fmi3Float64, nContinuousStates: usize) -> fmi3Status =
    fill_states::<M>(instance, Fmi3::GET_NOMINALS, ("nominals", nominals, nContinuousStates), |instance, x| instance.nominals(x));
fn fmi3GetNumberOfEventIndicators(instance: fmi3Instance, nEventIndicators: *mut usize) -> fmi3Status =
    write_count::<M>(instance, &NUMBER_OF_INDICATORS, ("nEventIndicators", nEventIndicators), |component| {
        let all = M::table().about.event_indicators;
        Ok(component.instance.extent.as_ref().map_or(all, |extent| extent.indicators()))
    });
fn fmi3GetNumberOfContinuousStates(instance: fmi3Instance, nContinuousStates: *mut usize) -> fmi3Status =
    write_count::<M>(instance, &NUMBER_OF_STATES, ("nContinuousStates", nContinuousStates), |component| Ok(state_count(component)));

// ---- Co-Simulation ----

fn fmi3EnterStepMode(instance: fmi3Instance) -> fmi3Status =
    perform::<M, Fmi3>(instance, &ENTER_STEP, |component| component.instance.enter_step_mode(&ENTER_STEP));
fn fmi3GetOutputDerivatives(instance: fmi3Instance, valueReferences: *const fmi3ValueReference, nValueReferences: usize, orders: *const fmi3Int32, values: *mut fmi3Float64, nValues: usize) -> fmi3Status =
    output_derivatives::<M>(instance, (valueReferences, nValueReferences), orders, (values, nValues));
fn fmi3DoStep(instance: fmi3Instance, currentCommunicationPoint: fmi3Float64, communicationStepSize: fmi3Float64, _noSetFMUStatePriorToCurrentPoint: fmi3Boolean, eventHandlingNeeded: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean, earlyReturn: *mut fmi3Boolean, lastSuccessfulTime: *mut fmi3Float64) -> fmi3Status = {
    let step = (currentCommunicationPoint, communicationStepSize);
    let answers = Answers {
        event: eventHandlingNeeded,
        terminate: terminateSimulation,
        early: earlyReturn,
        last: lastSuccessfulTime,
    };
    do_step::<M>(instance, step, answers)
};
/// Refuses the call, because only Scheduled Execution has model partitions, and the FMU does not support it.
fn fmi3ActivateModelPartition(instance: fmi3Instance, _clockReference: fmi3ValueReference, _activationTime: fmi3Float64) -> fmi3Status = {
    const CALL: &Call = &Call::new("fmi3ActivateModelPartition", ANY);
    perform_if_allowed::<M, Fmi3>(instance, CALL, |_| Err(CALL.error("this FMU has no Scheduled Execution")))
};

}

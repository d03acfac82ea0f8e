//! The C interface of FMI 2.0, Model Exchange and Co-Simulation: 44 functions.
//!
//! Every function is generic in the model; [`crate::export_fmi2`] exports them for one model under
//! their names. Every function catches panics; one that happens poisons the instance and is
//! told to the logger. Pointers may be NULL wherever the standard does not
//! forbid it, and mostly where it does. What the functions mean is in
//! [`crate::instance`] and [`crate::snapshot`]; here is only how C says it.

#![allow(unsafe_code)]
// The names are the standard's.
#![allow(non_camel_case_types, non_upper_case_globals, non_snake_case)]
// The safety contract of every function is the FMI 2.0 standard's: a component
// comes from fmi2Instantiate and is not yet freed, arrays have the lengths given,
// strings end with NUL.
#![allow(clippy::missing_safety_doc)]

use std::any::Any;
use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;

use crate::instance::Instance;
use crate::log::{Filter, Topic, category};
use crate::model::Model;
use crate::operation::{
    self as op, Call, Fault, InstanceState, Interface, Operation, Severity, Version,
};
use crate::snapshot;
use crate::variable::Value;

/// An instance, opaque to the host.
pub type fmi2Component = *mut c_void;
/// The host's own pointer, handed back to it.
pub type fmi2ComponentEnvironment = *mut c_void;
/// A saved state, opaque to the host.
pub type fmi2FMUstate = *mut c_void;
/// The number of a variable.
pub type fmi2ValueReference = c_uint;
/// A real number.
pub type fmi2Real = f64;
/// An integer.
pub type fmi2Integer = c_int;
/// 0 is false, everything else true.
pub type fmi2Boolean = c_int;
/// A character.
pub type fmi2Char = c_char;
/// Text that ends with NUL.
pub type fmi2String = *const fmi2Char;
/// A byte of a saved state.
pub type fmi2Byte = c_char;

/// What a call returns.
pub type fmi2Status = c_int;
/// All is well.
pub const fmi2OK: fmi2Status = 0;
/// Never returned.
pub const fmi2Warning: fmi2Status = 1;
/// The question has no answer.
pub const fmi2Discard: fmi2Status = 2;
/// The call was refused or failed.
pub const fmi2Error: fmi2Status = 3;
/// The instance is unusable.
pub const fmi2Fatal: fmi2Status = 4;
/// Never returned.
pub const fmi2Pending: fmi2Status = 5;

/// What kind of FMU the host wants.
pub type fmi2Type = c_int;
/// Model Exchange.
pub const fmi2ModelExchange: fmi2Type = 0;
/// Co-Simulation.
pub const fmi2CoSimulation: fmi2Type = 1;

/// What the host asks of fmi2GetStatus and its kin.
pub type fmi2StatusKind = c_int;
/// The result of an asynchronous step.
pub const fmi2DoStepStatus: fmi2StatusKind = 0;
/// What an asynchronous step is busy with.
pub const fmi2PendingStatus: fmi2StatusKind = 1;
/// How far the last step came.
pub const fmi2LastSuccessfulTime: fmi2StatusKind = 2;
/// Whether the FMU wants to end the simulation.
pub const fmi2Terminated: fmi2StatusKind = 3;

/// The host's logger: printf with a few words before.
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

/// The host's functions. Only the logger is used; each may be NULL.
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

const FMI2: Version = Version::Fmi2;

/// Marks a live component, so that a wrong handle is an error and no crash.
const COMPONENT: u64 = 0x4875_6253_6c6f_7368;
/// Marks a live saved state.
const STATE: u64 = 0x5374_6174_6548_7562;

/// What a component handle points to.
#[repr(C)]
struct Component<M: Model> {
    mark: u64,
    instance: Instance<M>,
    log: Log,
}

/// What a state handle points to.
#[repr(C)]
struct SavedState<M: Model> {
    mark: u64,
    instance: Instance<M>,
}

/// The way to the host's logger.
struct Log {
    // Copied: the host's struct need not outlive fmi2Instantiate.
    callbacks: fmi2CallbackFunctions,
    instance_name: CString,
    filter: Filter,
    /// Whether the host was warned of how it drives the model: once is enough.
    step_warned: bool,
}

impl Log {
    fn report(&self, fault: &Fault) {
        let topic = Topic::Failure(fault.severity);
        if self.filter.wants(topic) {
            self.write(status(fault.severity), topic, &fault.text);
        }
    }

    #[cold]
    fn report_warnings<M: Model>(&self, instance: &Instance<M>) {
        if self.filter.wants(Topic::Warning) {
            for warning in instance.warnings() {
                self.write(fmi2Warning, Topic::Warning, &warning);
            }
        }
    }

    /// Tells of the last event, if there was one since `before` were counted and if somebody wants
    /// to know.
    #[inline(always)]
    fn report_event<M: Model>(
        &self,
        operation: &'static Operation,
        before: i32,
        now: &Instance<M>,
    ) {
        let events = now.event_count().wrapping_sub(before);
        if events != 0 && self.filter.wants(Topic::Event) {
            self.write_event(operation, events, &now.last_event());
        }
    }

    #[cold]
    fn write_event(&self, operation: &'static Operation, events: i32, last: &str) {
        let many = match events {
            1 => String::new(),
            n => format!(", the last of {n} events in this call"),
        };
        let name = operation.call(FMI2).name();
        self.write(fmi2OK, Topic::Event, &format!("{name}: {last}{many}"));
    }

    fn write(&self, status: fmi2Status, topic: Topic, text: &str) {
        let Some(logger) = self.callbacks.logger else { return };
        let category = c_string(category(topic));
        let message = c_string(text);
        // The text is an argument, not the format: it may contain a percent sign.
        unsafe {
            logger(
                self.callbacks.componentEnvironment,
                self.instance_name.as_ptr(),
                status,
                category.as_ptr(),
                c"%s".as_ptr(),
                message.as_ptr(),
            );
        }
    }
}

fn status(severity: Severity) -> fmi2Status {
    match severity {
        Severity::Discard => fmi2Discard,
        Severity::Error => fmi2Error,
        Severity::Fatal => fmi2Fatal,
    }
}

fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// The host's text: `None` for NULL.
unsafe fn text(string: fmi2String) -> Option<String> {
    if string.is_null() {
        return None;
    }
    Some(unsafe { CStr::from_ptr(string) }.to_string_lossy().into_owned())
}

/// The host's array; NULL is fine when it is empty.
unsafe fn array<'a, T>(
    call: &Call,
    name: &str,
    pointer: *const T,
    length: usize,
) -> Result<&'a [T], Fault> {
    if length == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() {
        return Err(null(call, name));
    }
    Ok(unsafe { std::slice::from_raw_parts(pointer, length) })
}

/// As [`array`], to write to.
unsafe fn array_mut<'a, T>(
    call: &Call,
    name: &str,
    pointer: *mut T,
    length: usize,
) -> Result<&'a mut [T], Fault> {
    if length == 0 {
        return Ok(&mut []);
    }
    if pointer.is_null() {
        return Err(null(call, name));
    }
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, length) })
}

/// A place of the host's to write one thing to.
unsafe fn place<'a, T>(call: &Call, name: &str, pointer: *mut T) -> Result<&'a mut T, Fault> {
    unsafe { pointer.as_mut() }.ok_or_else(|| null(call, name))
}

fn null(call: &Call, name: &str) -> Fault {
    call.error(format_args!("argument {name} is NULL"))
}

unsafe fn saved_state<'a, M: Model>(
    call: &Call,
    handle: fmi2FMUstate,
) -> Result<&'a mut SavedState<M>, Fault> {
    if handle.is_null() {
        return Err(null(call, "FMUstate"));
    }
    if !handle.cast::<SavedState<M>>().is_aligned()
        || unsafe { ptr::read(handle.cast::<u64>()) } != STATE
    {
        return Err(call.error("argument FMUstate is not a saved state of this FMU"));
    }
    Ok(unsafe { &mut *handle.cast::<SavedState<M>>() })
}

/// Does `body` on the component behind the handle: failures are logged and become
/// the status, a panic poisons the instance.
#[inline]
unsafe fn on<M: Model>(
    handle: fmi2Component,
    operation: &'static Operation,
    body: impl FnOnce(&mut Component<M>) -> Result<(), Fault>,
) -> fmi2Status {
    if handle.is_null()
        || !handle.cast::<Component<M>>().is_aligned()
        || unsafe { ptr::read(handle.cast::<u64>()) } != COMPONENT
    {
        return fmi2Error;
    }
    let component = unsafe { &mut *handle.cast::<Component<M>>() };
    let result = catch_unwind(AssertUnwindSafe(|| body(component)));
    let fault = match result {
        Ok(Ok(())) => return fmi2OK,
        Ok(Err(fault)) => fault,
        Err(payload) => {
            component.instance.poison();
            let text =
                format!("{} panicked: {}", operation.call(FMI2).name(), panic_text(&*payload));
            Fault { severity: Severity::Fatal, text }
        }
    };
    component.log.report(&fault);
    status(fault.severity)
}

/// As [`on`], for the calls with which the motion can begin: then warnings are logged, of the parameters and
/// inputs that it begins with.
unsafe fn on_start<M: Model>(
    handle: fmi2Component,
    operation: &'static Operation,
    body: impl FnOnce(&mut Component<M>) -> Result<(), Fault>,
) -> fmi2Status {
    let with_warnings = |component: &mut Component<M>| {
        let was_running = component.instance.is_running();
        body(component)?;
        if !was_running && component.instance.is_running() {
            component.log.report_warnings(&component.instance);
        }
        Ok(())
    };
    unsafe { on(handle, operation, with_warnings) }
}

fn panic_text(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no text")
}

/// Panics are told to the host's logger and printed nowhere. The hook belongs to
/// this library's own copy of std, not to the host.
fn silence_panics() {
    // In this crate's own tests std is the test runner's.
    #[cfg(not(test))]
    {
        static ONCE: std::sync::Once = std::sync::Once::new();
        ONCE.call_once(|| std::panic::set_hook(Box::new(|_| {})));
    }
}

// ---- Inquiry, life and death ----

/// "default": the C types above.
pub fn fmi2GetTypesPlatform() -> fmi2String {
    c"default".as_ptr()
}

/// "2.0"
pub fn fmi2GetVersion() -> fmi2String {
    c"2.0".as_ptr()
}

/// Chooses what is logged.
pub unsafe fn fmi2SetDebugLogging<M: Model>(
    c: fmi2Component,
    loggingOn: fmi2Boolean,
    nCategories: usize,
    categories: *const fmi2String,
) -> fmi2Status {
    let operation = &op::SET_DEBUG_LOGGING;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            if loggingOn == 0 {
                component.log.filter = Filter::NONE;
                return Ok(());
            }
            let mut names = Vec::new();
            for category in array(call, "categories", categories, nCategories)? {
                names.push(text(*category).ok_or_else(|| null(call, "categories[]"))?);
            }
            component.log.filter = Filter::of(&names, M::table()).map_err(|why| call.error(why))?;
            Ok(())
        })
    }
}

/// Makes an instance. NULL on failure, and the logger is told why.
pub unsafe fn fmi2Instantiate<M: Model>(
    instanceName: fmi2String,
    fmuType: fmi2Type,
    fmuGUID: fmi2String,
    _fmuResourceLocation: fmi2String,
    functions: *const fmi2CallbackFunctions,
    _visible: fmi2Boolean,
    _loggingOn: fmi2Boolean,
) -> fmi2Component {
    if functions.is_null() {
        return ptr::null_mut();
    }
    silence_panics();
    let made = catch_unwind(|| unsafe {
        let name = text(instanceName);
        let log = Log {
            callbacks: *functions,
            instance_name: c_string(name.as_deref().unwrap_or("")),
            filter: Filter::FAILURES,
            step_warned: false,
        };
        match interface::<M>(name, fmuType, text(fmuGUID)) {
            Ok(interface) => {
                let instance = Instance::<M>::new(FMI2, interface);
                Box::into_raw(Box::new(Component { mark: COMPONENT, instance, log })).cast()
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

/// What the instance is for, or why there can be none like this.
fn interface<M: Model>(
    name: Option<String>,
    kind: fmi2Type,
    guid: Option<String>,
) -> Result<Interface, String> {
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
        Some(guid) if guid != expected => Err(format!(
            "fmuGUID is {guid}; expected {expected}: model description and binary do not belong together"
        )),
        Some(_) => Ok(interface),
    }
}

/// Frees an instance; NULL is fine.
pub unsafe fn fmi2FreeInstance<M: Model>(c: fmi2Component) {
    unsafe {
        if c.is_null()
            || !c.cast::<Component<M>>().is_aligned()
            || ptr::read(c.cast::<u64>()) != COMPONENT
        {
            return;
        }
        // A later call with this handle should be an error as long as nobody
        // else got the memory.
        ptr::write_volatile(c.cast::<u64>(), 0);
        let _ = catch_unwind(|| drop(Box::from_raw(c.cast::<Component<M>>())));
    }
}

/// Tells times and tolerance.
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
        on::<M>(c, &op::SETUP_EXPERIMENT, |component| {
            component.instance.setup_experiment(tolerance, startTime, stop)
        })
    }
}

/// From here on all variables can be read.
pub unsafe fn fmi2EnterInitializationMode<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe {
        on::<M>(c, &op::ENTER_INITIALIZATION, |component| {
            component.instance.enter_initialization_mode()
        })
    }
}

/// From here on parameters are fixed (in Model Exchange from the next call that goes on), and
/// steps can be made.
pub unsafe fn fmi2ExitInitializationMode<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe {
        on_start::<M>(c, &op::EXIT_INITIALIZATION, |component| {
            component.instance.exit_initialization_mode()
        })
    }
}

/// Ends the simulation; values can still be read.
pub unsafe fn fmi2Terminate<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe { on_start::<M>(c, &op::TERMINATE, |component| component.instance.terminate()) }
}

/// As new.
pub unsafe fn fmi2Reset<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe { on::<M>(c, &op::RESET, |component| component.instance.reset()) }
}

// ---- Values ----

/// The values of all references, each turned into its C type by `as_c`.
#[inline]
unsafe fn get<M: Model, T>(
    c: fmi2Component,
    operation: &'static Operation,
    (vr, nvr, value): (*const fmi2ValueReference, usize, *mut T),
    as_c: impl Fn(Value) -> Option<T>,
) -> fmi2Status {
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
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

/// Sets all references, each from its C type by `from_c`.
#[inline]
unsafe fn set<M: Model, T: Copy>(
    c: fmi2Component,
    operation: &'static Operation,
    (vr, nvr, value): (*const fmi2ValueReference, usize, *const T),
    from_c: impl Fn(T) -> Value,
) -> fmi2Status {
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            let references = array(call, "vr", vr, nvr)?;
            let values = array(call, "value", value, nvr)?;
            component.instance.set(operation, references, |n| from_c(values[n]))
        })
    }
}

/// Reads reals.
pub unsafe fn fmi2GetReal<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    value: *mut fmi2Real,
) -> fmi2Status {
    let as_c = |value| match value {
        Value::Real(x) => Some(x),
        _ => None,
    };
    unsafe { get::<M, _>(c, &op::GET_REAL, (vr, nvr, value), as_c) }
}

/// Reads integers and enumerations.
pub unsafe fn fmi2GetInteger<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    value: *mut fmi2Integer,
) -> fmi2Status {
    let as_c = |value| match value {
        Value::Integer(n) => Some(n),
        _ => None,
    };
    unsafe { get::<M, _>(c, &op::GET_INTEGER, (vr, nvr, value), as_c) }
}

/// Reads Booleans: 0 or 1.
pub unsafe fn fmi2GetBoolean<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    value: *mut fmi2Boolean,
) -> fmi2Status {
    let as_c = |value| match value {
        Value::Boolean(b) => Some(fmi2Boolean::from(b)),
        _ => None,
    };
    unsafe { get::<M, _>(c, &op::GET_BOOLEAN, (vr, nvr, value), as_c) }
}

/// There are no strings.
pub unsafe fn fmi2GetString<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    value: *mut fmi2String,
) -> fmi2Status {
    unsafe { get::<M, _>(c, &op::GET_STRING, (vr, nvr, value), |_| None) }
}

/// Sets reals.
pub unsafe fn fmi2SetReal<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    value: *const fmi2Real,
) -> fmi2Status {
    unsafe { set::<M, _>(c, &op::SET_REAL, (vr, nvr, value), Value::Real) }
}

/// Sets integers and enumerations.
pub unsafe fn fmi2SetInteger<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    value: *const fmi2Integer,
) -> fmi2Status {
    unsafe { set::<M, _>(c, &op::SET_INTEGER, (vr, nvr, value), Value::Integer) }
}

/// Sets Booleans: everything but 0 is true.
pub unsafe fn fmi2SetBoolean<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    value: *const fmi2Boolean,
) -> fmi2Status {
    unsafe { set::<M, _>(c, &op::SET_BOOLEAN, (vr, nvr, value), |b| Value::Boolean(b != 0)) }
}

/// There are no strings.
pub unsafe fn fmi2SetString<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    value: *const fmi2String,
) -> fmi2Status {
    // No variable is a string, so the value is never looked at.
    unsafe { set::<M, _>(c, &op::SET_STRING, (vr, nvr, value), |_| Value::Boolean(false)) }
}

// ---- Saved states ----

/// Saves the state, into the handle that is there or into a new one.
pub unsafe fn fmi2GetFMUstate<M: Model>(
    c: fmi2Component,
    FMUstate: *mut fmi2FMUstate,
) -> fmi2Status {
    let operation = &op::GET_FMU_STATE;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            let handle = place(call, "FMUstate", FMUstate)?;
            if handle.is_null() {
                *handle = new_state(component.instance.clone());
            } else {
                saved_state(call, *handle)?.instance.clone_from(&component.instance);
            }
            Ok(())
        })
    }
}

fn new_state<M: Model>(instance: Instance<M>) -> fmi2FMUstate {
    Box::into_raw(Box::new(SavedState { mark: STATE, instance })).cast()
}

/// Takes a saved state, this instance's or another's, in any instance state.
pub unsafe fn fmi2SetFMUstate<M: Model>(c: fmi2Component, FMUstate: fmi2FMUstate) -> fmi2Status {
    let operation = &op::SET_FMU_STATE;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            component.instance.restore(&saved_state(call, FMUstate)?.instance)
        })
    }
}

/// Frees a saved state and clears the handle; NULL is fine. fmusim (0.0.39) gives the state itself in
/// place of the handle's address: known by its mark, which no address equals, it is freed too.
pub unsafe fn fmi2FreeFMUstate<M: Model>(
    c: fmi2Component,
    FMUstate: *mut fmi2FMUstate,
) -> fmi2Status {
    let operation = &op::FREE_FMU_STATE;
    unsafe {
        on::<M>(c, operation, |_| {
            if FMUstate.is_null() || (*FMUstate).is_null() {
                return Ok(());
            }
            let is_itself = ptr::read(FMUstate.cast::<u64>()) == STATE;
            let state = if is_itself { FMUstate.cast() } else { *FMUstate };
            saved_state::<M>(&operation.call(FMI2), state)?;
            // as in fmi2FreeInstance
            ptr::write_volatile(state.cast::<u64>(), 0);
            drop(Box::from_raw(state.cast::<SavedState<M>>()));
            if !is_itself {
                *FMUstate = ptr::null_mut();
            }
            Ok(())
        })
    }
}

/// How many bytes a saved state takes.
pub unsafe fn fmi2SerializedFMUstateSize<M: Model>(
    c: fmi2Component,
    FMUstate: fmi2FMUstate,
    size: *mut usize,
) -> fmi2Status {
    let operation = &op::SERIALIZED_SIZE;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            saved_state::<M>(call, FMUstate)?;
            *place(call, "size", size)? = snapshot::size::<M>();
            Ok(())
        })
    }
}

/// Writes a saved state to the host's bytes.
pub unsafe fn fmi2SerializeFMUstate<M: Model>(
    c: fmi2Component,
    FMUstate: fmi2FMUstate,
    serializedState: *mut fmi2Byte,
    size: usize,
) -> fmi2Status {
    let operation = &op::SERIALIZE;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            let bytes = snapshot::to_bytes(&saved_state::<M>(call, FMUstate)?.instance);
            if size < bytes.len() {
                return Err(call.error(format_args!(
                    "size is {size}; a saved state takes {} bytes",
                    bytes.len()
                )));
            }
            let room = array_mut(call, "serializedState", serializedState.cast::<u8>(), size)?;
            room[..bytes.len()].copy_from_slice(&bytes);
            Ok(())
        })
    }
}

/// Makes a saved state from bytes. The handle is written, never read: the host
/// need not have set it.
pub unsafe fn fmi2DeSerializeFMUstate<M: Model>(
    c: fmi2Component,
    serializedState: *const fmi2Byte,
    size: usize,
    FMUstate: *mut fmi2FMUstate,
) -> fmi2Status {
    let operation = &op::DESERIALIZE;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            if FMUstate.is_null() {
                return Err(null(call, "FMUstate"));
            }
            let bytes = array(call, "serializedState", serializedState.cast::<u8>(), size)?;
            let instance = snapshot::from_bytes::<M>(FMI2, bytes).map_err(|why| call.error(why))?;
            ptr::write(FMUstate, new_state(instance));
            Ok(())
        })
    }
}

/// What the unknowns do when the knowns go in a direction.
pub unsafe fn fmi2GetDirectionalDerivative<M: Model>(
    c: fmi2Component,
    vUnknown_ref: *const fmi2ValueReference,
    nUnknown: usize,
    vKnown_ref: *const fmi2ValueReference,
    nKnown: usize,
    dvKnown: *const fmi2Real,
    dvUnknown: *mut fmi2Real,
) -> fmi2Status {
    let operation = &op::DIRECTIONAL_DERIVATIVE;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            let unknowns = array(call, "vUnknown_ref", vUnknown_ref, nUnknown)?;
            let knowns = array(call, "vKnown_ref", vKnown_ref, nKnown)?;
            let direction = array(call, "dvKnown", dvKnown, nKnown)?;
            let answers = array_mut(call, "dvUnknown", dvUnknown, nUnknown)?;
            component.instance.directional_derivative(unknowns, knowns, direction, answers)
        })
    }
}

// ---- Model Exchange ----

/// What fmi2NewDiscreteStates tells.
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

/// At an event.
pub unsafe fn fmi2EnterEventMode<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe { on_start::<M>(c, &op::ENTER_EVENT, |component| component.instance.enter_event_mode()) }
}

/// Does what is due at the event.
pub unsafe fn fmi2NewDiscreteStates<M: Model>(
    c: fmi2Component,
    eventInfo: *mut fmi2EventInfo,
) -> fmi2Status {
    let operation = &op::NEW_DISCRETE_STATES;
    unsafe {
        on_start::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            let place = place(call, "eventInfo", eventInfo)?;
            let before = component.instance.event_count();
            let info = component.instance.new_discrete_states()?;
            *place = fmi2EventInfo {
                valuesOfContinuousStatesChanged: info.states_changed.into(),
                nextEventTimeDefined: info.next_time.is_some().into(),
                nextEventTime: info.next_time.unwrap_or(0.0),
                ..fmi2EventInfo::default()
            };
            component.log.report_event(operation, before, &component.instance);
            Ok(())
        })
    }
}

/// Between events.
pub unsafe fn fmi2EnterContinuousTimeMode<M: Model>(c: fmi2Component) -> fmi2Status {
    unsafe {
        on_start::<M>(c, &op::ENTER_CONTINUOUS_TIME, |component| {
            component.instance.enter_continuous_time_mode()
        })
    }
}

/// The host has made a step and will not go back behind it. No past is kept, so
/// `noSetFMUStatePriorToCurrentPoint` changes nothing.
pub unsafe fn fmi2CompletedIntegratorStep<M: Model>(
    c: fmi2Component,
    _noSetFMUStatePriorToCurrentPoint: fmi2Boolean,
    enterEventMode: *mut fmi2Boolean,
    terminateSimulation: *mut fmi2Boolean,
) -> fmi2Status {
    let operation = &op::COMPLETED_STEP;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            let enter = place(call, "enterEventMode", enterEventMode)?;
            let terminate = place(call, "terminateSimulation", terminateSimulation)?;
            *enter = component.instance.completed_integrator_step()?.into();
            *terminate = 0;
            if !component.log.step_warned
                && component.log.filter.wants(Topic::Warning)
                && let Some(warning) = component.instance.step_warning()
            {
                component.log.step_warned = true;
                component.log.write(fmi2Warning, Topic::Warning, warning);
            }
            Ok(())
        })
    }
}

/// The present time.
pub unsafe fn fmi2SetTime<M: Model>(c: fmi2Component, time: fmi2Real) -> fmi2Status {
    unsafe { on_start::<M>(c, &op::SET_TIME, |component| component.instance.set_time(time)) }
}

/// The states as the host has integrated them.
pub unsafe fn fmi2SetContinuousStates<M: Model>(
    c: fmi2Component,
    x: *const fmi2Real,
    nx: usize,
) -> fmi2Status {
    let operation = &op::SET_CONTINUOUS_STATES;
    unsafe {
        on_start::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            component.instance.set_continuous_states(array(call, "x", x, nx)?)
        })
    }
}

/// Fills the host's array by `body`.
unsafe fn fill<M: Model>(
    c: fmi2Component,
    operation: &'static Operation,
    (name, pointer, length): (&str, *mut fmi2Real, usize),
    body: impl FnOnce(&mut Instance<M>, &mut [fmi2Real]) -> Result<(), Fault>,
) -> fmi2Status {
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            body(&mut component.instance, array_mut(call, name, pointer, length)?)
        })
    }
}

/// The derivatives of the states, in the order of the model description.
pub unsafe fn fmi2GetDerivatives<M: Model>(
    c: fmi2Component,
    derivatives: *mut fmi2Real,
    nx: usize,
) -> fmi2Status {
    let into = ("derivatives", derivatives, nx);
    unsafe { fill::<M>(c, &op::GET_DERIVATIVES, into, Instance::derivatives) }
}

/// Functions that cross zero at events.
pub unsafe fn fmi2GetEventIndicators<M: Model>(
    c: fmi2Component,
    eventIndicators: *mut fmi2Real,
    ni: usize,
) -> fmi2Status {
    let into = ("eventIndicators", eventIndicators, ni);
    unsafe { fill::<M>(c, &op::GET_EVENT_INDICATORS, into, Instance::event_indicators) }
}

/// The states, in the order of the model description.
pub unsafe fn fmi2GetContinuousStates<M: Model>(
    c: fmi2Component,
    x: *mut fmi2Real,
    nx: usize,
) -> fmi2Status {
    unsafe { fill::<M>(c, &op::GET_CONTINUOUS_STATES, ("x", x, nx), Instance::continuous_states) }
}

/// The states' orders of magnitude.
pub unsafe fn fmi2GetNominalsOfContinuousStates<M: Model>(
    c: fmi2Component,
    x_nominal: *mut fmi2Real,
    nx: usize,
) -> fmi2Status {
    let into = ("x_nominal", x_nominal, nx);
    unsafe { fill::<M>(c, &op::GET_NOMINALS, into, |instance, x| instance.nominals(x)) }
}

// ---- Co-Simulation ----

/// The slopes of inputs over the next step.
pub unsafe fn fmi2SetRealInputDerivatives<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    order: *const fmi2Integer,
    value: *const fmi2Real,
) -> fmi2Status {
    let operation = &op::SET_INPUT_DERIVATIVES;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            let references = array(call, "vr", vr, nvr)?;
            let orders = array(call, "order", order, nvr)?;
            let values = array(call, "value", value, nvr)?;
            component.instance.set_input_derivatives(references, orders, values)
        })
    }
}

/// The derivatives of some outputs.
pub unsafe fn fmi2GetRealOutputDerivatives<M: Model>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    order: *const fmi2Integer,
    value: *mut fmi2Real,
) -> fmi2Status {
    let operation = &op::GET_OUTPUT_DERIVATIVES;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            let references = array(call, "vr", vr, nvr)?;
            let orders = array(call, "order", order, nvr)?;
            let places = array_mut(call, "value", value, nvr)?;
            component.instance.output_derivatives(references, orders, places)
        })
    }
}

/// One step. `noSetFMUStatePriorToCurrentPoint` changes nothing here: no past is
/// kept.
pub unsafe fn fmi2DoStep<M: Model>(
    c: fmi2Component,
    currentCommunicationPoint: fmi2Real,
    communicationStepSize: fmi2Real,
    _noSetFMUStatePriorToCurrentPoint: fmi2Boolean,
) -> fmi2Status {
    let operation = &op::DO_STEP;
    unsafe {
        on::<M>(c, operation, |component| {
            let before = component.instance.event_count();
            component.instance.do_step(currentCommunicationPoint, communicationStepSize)?;
            component.log.report_event(operation, before, &component.instance);
            Ok(())
        })
    }
}

/// Steps are never asynchronous, so there is nothing to cancel.
pub unsafe fn fmi2CancelStep<M: Model>(c: fmi2Component) -> fmi2Status {
    let operation = &op::CANCEL_STEP;
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            Err(call.error("no step is running: fmi2DoStep returns when the step is done"))
        })
    }
}

/// Answers a question about the last step, or discards it.
unsafe fn answer<M: Model, T>(
    c: fmi2Component,
    operation: &'static Operation,
    kind: fmi2StatusKind,
    value: *mut T,
    known: impl FnOnce(&Instance<M>) -> Option<T>,
) -> fmi2Status {
    unsafe {
        on::<M>(c, operation, |component| {
            let call = &component.instance.check(operation)?;
            let place = place(call, "value", value)?;
            let value = known(&component.instance);
            *place = value
                .ok_or_else(|| call.discard(format_args!("status kind {kind} has no value")))?;
            Ok(())
        })
    }
}

/// How the last step ended.
pub unsafe fn fmi2GetStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2Status,
) -> fmi2Status {
    let known = |instance: &Instance<M>| {
        let ended = if instance.state() == InstanceState::Failed { fmi2Error } else { fmi2OK };
        (s == fmi2DoStepStatus).then_some(ended)
    };
    unsafe { answer::<M, _>(c, &op::GET_STATUS, s, value, known) }
}

/// How far the last step came.
pub unsafe fn fmi2GetRealStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2Real,
) -> fmi2Status {
    let known = |instance: &Instance<M>| (s == fmi2LastSuccessfulTime).then_some(instance.time());
    unsafe { answer::<M, _>(c, &op::GET_REAL_STATUS, s, value, known) }
}

/// No integer says anything about the last step.
pub unsafe fn fmi2GetIntegerStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2Integer,
) -> fmi2Status {
    unsafe { answer::<M, _>(c, &op::GET_INTEGER_STATUS, s, value, |_| None) }
}

/// The FMU never ends the simulation by itself.
pub unsafe fn fmi2GetBooleanStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2Boolean,
) -> fmi2Status {
    let known = |_: &Instance<M>| (s == fmi2Terminated).then_some(0);
    unsafe { answer::<M, _>(c, &op::GET_BOOLEAN_STATUS, s, value, known) }
}

/// No step is ever pending.
pub unsafe fn fmi2GetStringStatus<M: Model>(
    c: fmi2Component,
    s: fmi2StatusKind,
    value: *mut fmi2String,
) -> fmi2Status {
    unsafe { answer::<M, _>(c, &op::GET_STRING_STATUS, s, value, |_| None) }
}

/// Exports the functions of FMI 2.0 for a model, under their names in C and as Rust functions of
/// the module where it stands. A macro, because each FMU has to define these symbols itself.
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
            assert_eq!(on::<Spring>(c, &op::DO_STEP, |_| panic!("this is a test")), fmi2Fatal);
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
        let made = |name, kind, guid| interface::<Spring>(name, kind, guid);
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

//! Common parts of the C interfaces of all FMI versions: status of a call, the host's logger, texts and arrays, handles of
//! instances and saved states. A panic does not leave the C interface; it makes the instance unusable.
//!
//! Pointers may be NULL wherever the FMI standard does not forbid it, and in most other places as well.

#![allow(unsafe_code)]
// The safety contract of every function is that of the FMI standard: a handle comes from this FMU and is not yet freed,
// arrays have the given lengths, and strings end with NUL.
#![allow(clippy::missing_safety_doc)]

use std::any::Any;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;

use crate::call::{Call, Fault, Severity};
use crate::instance::Instance;
use crate::log::{Filter, Topic, category};
use crate::model::Model;
use crate::snapshot;
use crate::version::Version;

// ---- Status and logger ----

pub type Status = c_int;
pub const OK: Status = 0;
/// Status with which warnings are sent to the host's log. No function returns it.
pub const WARNING: Status = 1;
/// The FMU could not compute the result of the call, and the instance is unchanged.
pub const DISCARD: Status = 2;
/// The call was not allowed in the present state, had invalid arguments, or its execution has failed.
pub const ERROR: Status = 3;
pub const FATAL: Status = 4;

fn status(severity: Severity) -> Status {
    match severity {
        Severity::Discard => DISCARD,
        Severity::Error => ERROR,
        Severity::Fatal => FATAL,
    }
}

/// The logging callback of the host, in a form that does not depend on the FMI version. The arguments are status, category
/// and message.
pub type Logger = Box<dyn Fn(Status, &CStr, &CStr)>;

#[allow(missing_docs)]
pub struct Log {
    logger: Option<Logger>,
    pub filter: Filter,
    step_warned: bool,
}

impl Log {
    pub fn new(logger: Option<Logger>) -> Log {
        Log { logger, filter: Filter::FAILURES, step_warned: false }
    }

    /// Writes the reason of a failed call to the host's log. The status and the log category follow from the severity of the
    /// fault.
    pub fn report(&self, fault: &Fault) {
        self.write(status(fault.severity), Topic::Failure(fault.severity), || fault.text.clone());
    }

    #[cold]
    pub fn report_warnings<M: Model, V: Version>(&self, instance: &Instance<M, V>) {
        if self.filter.wants(Topic::Warning) {
            for warning in instance.warnings() {
                self.write(WARNING, Topic::Warning, || warning);
            }
        }
    }

    /// Warns in the host's log that `call` had a side effect, which `effect` describes.
    #[cold]
    pub fn report_effect(&self, call: &Call, effect: impl FnOnce() -> String) {
        self.write(WARNING, Topic::Warning, || format!("{}: {}", call.name, effect()));
    }

    /// Writes the model's warning about the host's communication steps to the host's log, at most once per instance. Nothing
    /// is written if the model has no warning.
    pub fn report_step_warning<M: Model, V: Version>(&mut self, instance: &Instance<M, V>) {
        if !self.step_warned
            && self.filter.wants(Topic::Warning)
            && let Some(warning) = instance.step_warning()
        {
            self.step_warned = true;
            self.write(WARNING, Topic::Warning, || warning.into());
        }
    }

    /// Writes the model's last event to the host's log if events have occurred during the call. `before` is the number of
    /// events before the call, and `now` the instance after it.
    #[inline(always)]
    pub fn report_event<M: Model, V: Version>(
        &self,
        call: &Call,
        before: i32,
        now: &Instance<M, V>,
    ) {
        let events = now.event_count().wrapping_sub(before);
        if events != 0 {
            self.write_event(call, events, || now.last_event());
        }
    }

    #[cold]
    fn write_event(&self, call: &Call, events: i32, last: impl FnOnce() -> String) {
        self.write(OK, Topic::Event, || {
            let many = match events {
                1 => String::new(),
                n => format!(", the last of {n} events in this call"),
            };
            format!("{}: {}{many}", call.name, last())
        });
    }

    fn write(&self, status: Status, topic: Topic, message: impl FnOnce() -> String) {
        if let Some(logger) = &self.logger
            && self.filter.wants(topic)
        {
            logger(status, &c_string(category(topic)), &c_string(&message()));
        }
    }
}

// ---- Texts and arrays ----

/// Converts a text to a C string for the host. NUL characters become spaces, because they would end a C string.
pub fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

pub unsafe fn text(string: *const c_char) -> Option<String> {
    if string.is_null() {
        return None;
    }
    Some(unsafe { CStr::from_ptr(string) }.to_string_lossy().into_owned())
}

/// Borrows an array that the host passes as the argument `name`, for reading. The pointer may be NULL if the array is empty.
///
/// # Errors
/// If the pointer is NULL and the array is not empty; the message contains `name`.
pub unsafe fn array<'a, T>(
    call: &Call,
    name: &str,
    pointer: *const T,
    length: usize,
) -> Result<&'a [T], Fault> {
    if length == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() {
        return Err(null_argument(call, name));
    }
    Ok(unsafe { std::slice::from_raw_parts(pointer, length) })
}

/// Borrows an array that the host passes as the argument `name` and into which the function writes results.
///
/// # Errors
/// If the pointer is NULL and the array is not empty; the message contains `name`.
pub unsafe fn array_mut<'a, T>(
    call: &Call,
    name: &str,
    pointer: *mut T,
    length: usize,
) -> Result<&'a mut [T], Fault> {
    if length == 0 {
        return Ok(&mut []);
    }
    if pointer.is_null() {
        return Err(null_argument(call, name));
    }
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, length) })
}

/// Borrows a variable of the host into which the function writes a result. The host passes `pointer` to it as the argument
/// `name`.
///
/// # Errors
/// If `pointer` is NULL.
pub unsafe fn place<'a, T>(call: &Call, name: &str, pointer: *mut T) -> Result<&'a mut T, Fault> {
    unsafe { pointer.as_mut() }.ok_or_else(|| null_argument(call, name))
}

pub fn null_argument(call: &Call, name: &str) -> Fault {
    call.error(format_args!("argument {name} is NULL"))
}

// ---- Instances ----

/// Number from which [`mark`] computes the mark of a live component. Calls check the mark, so that a wrong handle gives an
/// error instead of a crash.
const COMPONENT: u64 = 0x4875_6253_6c6f_7368;

/// Returns the mark of a live object: the number in its first word, by which a call recognises that `handle` is valid.
/// `kind` distinguishes components from saved states.
///
/// The mark depends on the model, the FMI version and the loaded copy of the library, because it is computed from the
/// address of the variable table and a digit for the version. Handles of other FMUs, of the other FMI version or of a second
/// copy of the library are therefore recognised as wrong. No valid address has the upper 16 bits of a mark.
fn mark<M: Model, V: Version>(kind: u64, handle: *const c_void) -> u64 {
    let table = ptr::from_ref(M::table()).addr() as u64;
    // The digit is smaller than the alignment of the table, so that it does not overlap with the table's address.
    let version = V::PREFIX.bytes().last().unwrap_or_default() & 7;
    kind ^ table ^ u64::from(version) ^ handle.addr() as u64
}

/// Lowest address that an object can have on the platforms for which FMUs are built. Smaller handles are refused without
/// being read.
const LOWEST_ADDRESS: usize = 1024;

/// A live instance with its log. The handle that the host has points to it.
#[repr(C)]
#[allow(missing_docs)]
pub struct Component<M: Model, V: Version> {
    mark: u64,
    pub instance: Instance<M, V>,
    pub log: Log,
    /// Data about the host that only this version of FMI needs, for example callbacks.
    pub host: V::Host<M>,
}

pub fn new_component<M: Model, V: Version>(
    instance: Instance<M, V>,
    log: Log,
    host: V::Host<M>,
) -> *mut c_void {
    let mut component = Box::new(Component { mark: 0, instance, log, host });
    component.mark = mark::<M, V>(COMPONENT, ptr::from_ref(&*component).cast());
    Box::into_raw(component).cast()
}

/// Returns true if `handle` points to a live `T`, a component or a saved state, whose first field is its [`mark`]. `kind` is
/// the number from which marks of this type are computed.
unsafe fn is_live<T, M: Model, V: Version>(handle: *mut c_void, kind: u64) -> bool {
    handle.addr() >= LOWEST_ADDRESS
        && handle.cast::<T>().is_aligned()
        && unsafe { ptr::read(handle.cast::<u64>()) } == mark::<M, V>(kind, handle)
}

unsafe fn free<T>(handle: *mut c_void) {
    unsafe {
        // The mark is cleared, so that a later call with this handle gives an error until the memory is used again.
        ptr::write_volatile(handle.cast::<u64>(), 0);
        drop(Box::from_raw(handle.cast::<T>()));
    }
}

/// Frees the component behind the handle that the host passes to fmi2FreeInstance or fmi3FreeInstance. Any other handle is
/// ignored.
pub unsafe fn free_component<M: Model, V: Version>(handle: *mut c_void) {
    unsafe {
        if is_live::<Component<M, V>, M, V>(handle, COMPONENT) {
            let _ = catch_unwind(|| free::<Component<M, V>>(handle));
        }
    }
}

/// Runs `body` on the component behind a handle, and returns the status for the host. If `body` fails, the fault is logged
/// and determines the status. If `body` panics, the instance becomes unusable.
#[inline]
pub unsafe fn perform<M: Model, V: Version>(
    handle: *mut c_void,
    call: &'static Call,
    body: impl FnOnce(&mut Component<M, V>) -> Result<(), Fault>,
) -> Status {
    if !unsafe { is_live::<Component<M, V>, M, V>(handle, COMPONENT) } {
        return ERROR;
    }
    let component = unsafe { &mut *handle.cast::<Component<M, V>>() };
    let result = catch_unwind(AssertUnwindSafe(|| body(component)));
    let fault = match result {
        Ok(Ok(())) => return OK,
        Ok(Err(fault)) => fault,
        Err(payload) => {
            component.instance.poison();
            let text = format!("{} panicked: {}", call.name, panic_text(&*payload));
            Fault { severity: Severity::Fatal, text }
        }
    };
    if fault.severity == Severity::Error {
        component.instance.after_error();
    }
    component.log.report(&fault);
    status(fault.severity)
}

/// Runs `body` as [`perform`] does, but only if the state of the instance allows the call. Functions need this if they must
/// not read their arguments when the call is not allowed.
#[inline]
pub unsafe fn perform_if_allowed<M: Model, V: Version>(
    handle: *mut c_void,
    call: &'static Call,
    body: impl FnOnce(&mut Component<M, V>) -> Result<(), Fault>,
) -> Status {
    let if_allowed = |component: &mut Component<M, V>| {
        component.instance.check(call)?;
        body(component)
    };
    unsafe { perform(handle, call, if_allowed) }
}

/// Runs `body` as [`perform`] does. If the simulation starts with this call, the warnings about initial parameters and inputs
/// are logged afterwards.
pub unsafe fn perform_start<M: Model, V: Version>(
    handle: *mut c_void,
    call: &'static Call,
    body: impl FnOnce(&mut Component<M, V>) -> Result<(), Fault>,
) -> Status {
    let with_warnings = |component: &mut Component<M, V>| {
        let was_running = component.instance.is_running();
        body(component)?;
        if !was_running && component.instance.is_running() {
            component.log.report_warnings(&component.instance);
        }
        Ok(())
    };
    unsafe { perform(handle, call, with_warnings) }
}

fn panic_text(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no text")
}

/// Stops the standard library from printing panics to stderr, because the host's logger reports them. The panic hook belongs
/// to the copy of the standard library in this FMU, and not to the host.
pub fn silence_panics() {
    // The tests of this crate share the standard library of the test runner, whose panic messages are needed.
    #[cfg(not(test))]
    {
        static ONCE: std::sync::Once = std::sync::Once::new();
        ONCE.call_once(|| std::panic::set_hook(Box::new(|_| {})));
    }
}

// ---- Functions that both versions have ----

/// Returns the filter that passes only messages of the log categories `categories`, an array of `count` C strings, to the
/// host's log.
///
/// # Errors
/// If a category is unknown or NULL.
pub unsafe fn filter<M: Model>(
    call: &Call,
    categories: *const *const c_char,
    count: usize,
) -> Result<Filter, Fault> {
    let mut names = Vec::new();
    for category in unsafe { array(call, "categories", categories, count)? } {
        names.push(unsafe { text(*category) }.ok_or_else(|| null_argument(call, "categories[]"))?);
    }
    Filter::from_categories(&names, M::table()).map_err(|why| call.error(why))
}

/// Fills the array `pointer` of `length` numbers, which the host passes as the argument `name`, with the values that `body`
/// writes.
pub unsafe fn fill<M: Model, V: Version>(
    handle: *mut c_void,
    call: &'static Call,
    (name, pointer, length): (&str, *mut f64, usize),
    body: impl FnOnce(&mut Instance<M, V>, &mut [f64]) -> Result<(), Fault>,
) -> Status {
    unsafe {
        perform_if_allowed::<M, V>(handle, call, |component| {
            body(&mut component.instance, array_mut(call, name, pointer, length)?)
        })
    }
}

/// Handles the host's message that its integrator has completed a step. Sets the host's variable `enter_event_mode` to true
/// if an event must be handled now, and otherwise to false. The host's variable `terminate` is always set to false, because
/// the FMU never ends the simulation. `B` is the Boolean type of the FMI version.
pub unsafe fn completed_step<M: Model, V: Version, B: From<bool>>(
    handle: *mut c_void,
    enter_event_mode: *mut B,
    terminate: *mut B,
) -> Status {
    let call = V::COMPLETED_STEP;
    unsafe {
        perform_if_allowed::<M, V>(handle, call, |component| {
            let enter = place(call, "enterEventMode", enter_event_mode)?;
            let terminate = place(call, "terminateSimulation", terminate)?;
            *enter = component.instance.completed_integrator_step()?.into();
            *terminate = false.into();
            component.log.report_step_warning(&component.instance);
            Ok(())
        })
    }
}

/// Defines the C functions of one version of FMI. Each becomes a function that is generic in the model, and a macro
/// `$export` exports all of them for one model under their C names. This macro is necessary because each FMU must define
/// these symbols itself. The first token of the input must be `$`, because a macro cannot itself contain the `$` of the
/// macro that it defines.
macro_rules! c_functions {
    ($d:tt $export:ident, $version:ident; $(
        $(#[$doc:meta])*
        fn $name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)? = $body:expr;
    )*) => {
        $(
            $(#[$doc])*
            pub unsafe fn $name<M: Model>($($argument: $type),*) $(-> $result)? {
                #[allow(unused_unsafe)]
                unsafe { $body }
            }
        )*

        /// Exports the functions of this version of FMI for a model, under their C names and as Rust
        /// functions of the module in which the macro is used.
        #[macro_export]
        macro_rules! $export {
            ($d model:ty) => {
                $(
                    #[allow(missing_docs, non_snake_case, unsafe_code)]
                    #[allow(clippy::missing_safety_doc, clippy::too_many_arguments)]
                    #[unsafe(no_mangle)]
                    pub unsafe extern "C" fn $name($($argument: $type),*) $(-> $result)? {
                        unsafe { $crate::$version::$name::<$d model>($($argument),*) }
                    }
                )*
            };
        }
    };
}
pub(crate) use c_functions;

// ---- Saved states ----

const STATE: u64 = 0x5374_6174_6548_7562;

#[repr(C)]
struct SavedState<M: Model, V: Version> {
    mark: u64,
    instance: Instance<M, V>,
}

pub fn new_state<M: Model, V: Version>(instance: Instance<M, V>) -> *mut c_void {
    let mut state = Box::new(SavedState { mark: 0, instance });
    state.mark = mark::<M, V>(STATE, ptr::from_ref(&*state).cast());
    Box::into_raw(state).cast()
}

/// Returns the instance in the saved state behind a handle that the host passes as the argument `name`.
///
/// # Errors
/// If the handle is NULL or does not belong to a saved state of this FMU.
pub unsafe fn saved_state<'a, M: Model, V: Version>(
    call: &Call,
    name: &str,
    handle: *mut c_void,
) -> Result<&'a mut Instance<M, V>, Fault> {
    if handle.is_null() {
        return Err(null_argument(call, name));
    }
    if !unsafe { is_live::<SavedState<M, V>, M, V>(handle, STATE) } {
        return Err(call.error(format_args!("argument {name} is not a saved state of this FMU")));
    }
    Ok(unsafe { &mut (*handle.cast::<SavedState<M, V>>()).instance })
}

/// Saves an instance into the saved state to which `handle` points, or into a new saved state if the handle is NULL. `name`
/// is the argument's name for messages.
pub unsafe fn save_state<M: Model, V: Version>(
    call: &Call,
    name: &str,
    handle: *mut *mut c_void,
    instance: &Instance<M, V>,
) -> Result<(), Fault> {
    unsafe {
        let handle = place(call, name, handle)?;
        if handle.is_null() {
            *handle = new_state(instance.clone());
        } else {
            saved_state(call, name, *handle)?.clone_from(instance);
        }
    }
    Ok(())
}

pub unsafe fn serialized_size<M: Model, V: Version>(
    handle: *mut c_void,
    call: &'static Call,
    (name, saved): (&str, *mut c_void),
    size: *mut usize,
) -> Status {
    unsafe {
        perform_if_allowed::<M, V>(handle, call, |_| {
            saved_state::<M, V>(call, name, saved)?;
            *place(call, "size", size)? = snapshot::size::<M>();
            Ok(())
        })
    }
}

/// Writes a saved state as bytes into an array of the host, which has `size` bytes. `name` and `saved` are name and handle of
/// the saved state.
///
/// # Errors
/// If the array is too short.
pub unsafe fn serialize<M: Model, V: Version>(
    handle: *mut c_void,
    call: &'static Call,
    (name, saved): (&str, *mut c_void),
    (bytes, size): (*mut u8, usize),
) -> Status {
    unsafe {
        perform_if_allowed::<M, V>(handle, call, |_| {
            let saved = snapshot::to_bytes(saved_state::<M, V>(call, name, saved)?);
            let needed = saved.len();
            if size < needed {
                let why = format_args!("size is {size}; a saved state takes {needed} bytes");
                return Err(call.error(why));
            }
            array_mut(call, "serializedState", bytes, size)?[..needed].copy_from_slice(&saved);
            Ok(())
        })
    }
}

/// Restores a saved state from `size` bytes, which must come from an instance with the same variables, and writes its handle
/// to the host's variable `to`. This variable is only written and never read, because the host need not have initialised it.
pub unsafe fn deserialize<M: Model, V: Version>(
    handle: *mut c_void,
    call: &'static Call,
    (bytes, size): (*const u8, usize),
    (name, to): (&str, *mut *mut c_void),
) -> Status {
    unsafe {
        perform_if_allowed::<M, V>(handle, call, |component| {
            if to.is_null() {
                return Err(null_argument(call, name));
            }
            let bytes = array(call, "serializedState", bytes, size)?;
            let mut saved = snapshot::from_bytes::<M, V>(bytes).map_err(|why| call.error(why))?;
            component.instance.check_layout(call, &saved)?;
            saved.extent = component.instance.extent.clone(); // the bytes do not contain its start values
            ptr::write(to, new_state(saved));
            Ok(())
        })
    }
}

/// Frees a saved state and sets the host's handle to NULL. The handle may already be NULL.
///
/// fmusim (0.0.39) passes the saved state itself instead of the address of the handle. It is then recognised by its mark,
/// which cannot be an address, and is freed as well.
pub unsafe fn free_state<M: Model, V: Version>(
    call: &Call,
    name: &str,
    handle: *mut *mut c_void,
) -> Result<(), Fault> {
    unsafe {
        if handle.is_null() || (*handle).is_null() {
            return Ok(());
        }
        let is_itself = is_live::<SavedState<M, V>, M, V>(handle.cast(), STATE);
        let state = if is_itself { handle.cast() } else { *handle };
        saved_state::<M, V>(call, name, state)?;
        free::<SavedState<M, V>>(state);
        if !is_itself {
            *handle = ptr::null_mut();
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::call::Interface;
    use crate::spring::Spring;
    use crate::v2::Fmi2;
    use std::cell::RefCell;
    use std::rc::Rc;

    #[test]
    fn a_panic_within_a_call_is_a_fatal_error_and_its_text_is_reported() {
        let lines = Rc::new(RefCell::new(Vec::new()));
        let to = lines.clone();
        let log = Log::new(Some(Box::new(move |status, _, message| {
            to.borrow_mut().push((status, message.to_str().unwrap().to_string()));
        })));
        let c = new_component(Instance::<Spring, Fmi2>::new(Interface::CoSimulation), log, ());
        let number = 7;
        let all: [(&str, &dyn Fn()); 3] = [
            ("fmi2Reset panicked: a text", &|| panic!("a text")),
            ("fmi2Reset panicked: number 7", &|| panic!("number {number}")),
            ("fmi2Reset panicked: no text", &|| std::panic::panic_any(7)),
        ];
        for (says, panics) in all {
            let status = unsafe {
                perform::<Spring, Fmi2>(c, Fmi2::RESET, |_| {
                    panics();
                    Ok(())
                })
            };
            assert_eq!(status, FATAL);
            assert_eq!(lines.take(), [(FATAL, says.to_string())]);
        }
        unsafe { free_component::<Spring, Fmi2>(c) };
    }
}

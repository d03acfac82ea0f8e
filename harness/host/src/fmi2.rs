//! The part of the C interface that only FMI 2.0 has: its types, the functions whose types differ from FMI 3.0, and
//! calls for tests. The rest is in [`crate::c_abi::version`].
//!
//! Unsafe code of the harness is only in this file, `c_abi.rs`, `fmi3.rs` and `harness/native/src/instance.rs`
//! (`tests/architecture.rs` checks this).
#![allow(unsafe_code)]

use std::ffi::{c_char, c_int, c_void};
use std::path::Path;
use std::ptr::{null, null_mut};
use std::sync::Once;

use anyhow::Result;
use libloading::Library;

pub use crate::c_abi::version::FmuState;
use crate::c_abi::version::{
    self, Call, Common, Component, Exchange, Getter, Interface, Refs, Setter, Updated, Version,
};
use crate::c_abi::{self, Environment, Function, c_string, copy_text, functions, pointer};
pub use crate::c_abi::{CallError, Called, HostState, Message, Status};
use crate::description::{CType, Value};

pub mod guarded;

pub type Fmu = version::Fmu<Fmi2>;
pub type Instance<'fmu> = version::Instance<'fmu, Fmi2>;

pub const PLATFORM: &str = version::PLATFORM[0];

// ---------------------------------------------------------------- C types

unsafe extern "C" {
    fn hubslosh_logger(
        environment: *mut c_void,
        instance: *const c_char,
        status: c_int,
        category: *const c_char,
        format: *const c_char,
        ...
    );
    fn hubslosh_set_log_message(
        function: extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char),
    );
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

type Logger =
    unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...);

#[repr(C)]
pub(crate) struct CallbackFunctions {
    logger: Option<Logger>,
    allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    step_finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    environment: *mut c_void,
}

type Get<T> = unsafe extern "C" fn(Component, Refs, usize, *mut T) -> c_int;
type Set<T> = unsafe extern "C" fn(Component, Refs, usize, *const T) -> c_int;
type GetStatus<T> = unsafe extern "C" fn(Component, c_int, *mut T) -> c_int;

// Functions that every FMU 2.0 must export in addition to `Common`.
functions! { Functions:
    get_types_platform "fmi2GetTypesPlatform", unsafe extern "C" fn() -> *const c_char;
    instantiate "fmi2Instantiate", unsafe extern "C" fn(*const c_char, c_int, *const c_char, *const c_char, *const CallbackFunctions, c_int, c_int) -> Component;
    setup_experiment "fmi2SetupExperiment", unsafe extern "C" fn(Component, c_int, f64, f64, c_int, f64) -> c_int;
    enter_initialization_mode "fmi2EnterInitializationMode", Call;
    get_real "fmi2GetReal", Get<f64>;
    get_integer "fmi2GetInteger", Get<c_int>;
    get_boolean "fmi2GetBoolean", Get<c_int>;
    get_string "fmi2GetString", Get<*const c_char>;
    set_real "fmi2SetReal", Set<f64>;
    set_integer "fmi2SetInteger", Set<c_int>;
    set_boolean "fmi2SetBoolean", Set<c_int>;
    set_string "fmi2SetString", Set<*const c_char>;
    get_directional_derivative "fmi2GetDirectionalDerivative", unsafe extern "C" fn(Component, Refs, usize, Refs, usize, *const f64, *mut f64) -> c_int;
}

// Functions that an FMU for Co-Simulation must export in addition to `Common` and `Functions`.
functions! { StepFunctions:
    set_real_input_derivatives "fmi2SetRealInputDerivatives", unsafe extern "C" fn(Component, Refs, usize, *const c_int, *const f64) -> c_int;
    get_real_output_derivatives "fmi2GetRealOutputDerivatives", unsafe extern "C" fn(Component, Refs, usize, *const c_int, *mut f64) -> c_int;
    do_step "fmi2DoStep", unsafe extern "C" fn(Component, f64, f64, c_int) -> c_int;
    cancel_step "fmi2CancelStep", Call;
    get_status "fmi2GetStatus", GetStatus<c_int>;
    get_real_status "fmi2GetRealStatus", GetStatus<f64>;
    get_integer_status "fmi2GetIntegerStatus", GetStatus<c_int>;
    get_boolean_status "fmi2GetBooleanStatus", GetStatus<c_int>;
    get_string_status "fmi2GetStringStatus", GetStatus<*const c_char>;
}

// Functions that an FMU for Model Exchange must export in addition to `Exchange`.
functions! { EventFunctions:
    enter_event_mode "fmi2EnterEventMode", Call;
    new_discrete_states "fmi2NewDiscreteStates", unsafe extern "C" fn(Component, *mut EventInfo) -> c_int;
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EventInfo {
    pub new_discrete_states_needed: c_int,
    pub terminate_simulation: c_int,
    pub nominals_changed: c_int,
    pub values_changed: c_int,
    pub next_event_time_defined: c_int,
    pub next_event_time: f64,
}

// ---------------------------------------------------------------- the FMU

impl<T> Getter<T> for Get<T> {
    unsafe fn get(self, component: Component, references: &[u32], values: &mut [T]) -> c_int {
        assert_eq!(references.len(), values.len());
        // SAFETY: both slices have the length that is passed.
        unsafe { self(component, references.as_ptr(), references.len(), values.as_mut_ptr()) }
    }
}

impl<T> Setter<T> for Set<T> {
    unsafe fn set(self, component: Component, references: &[u32], values: &[T]) -> c_int {
        assert_eq!(references.len(), values.len());
        // SAFETY: both slices have the length that is passed.
        unsafe { self(component, references.as_ptr(), references.len(), values.as_ptr()) }
    }
}

pub struct Fmi2 {
    functions: Functions,
    stepping: Option<StepFunctions>,
    events: Option<EventFunctions>,
}

impl Version for Fmi2 {
    const NUMBER: usize = 0;
    type Boolean = c_int;
    type Kept = Given;

    fn required_functions(steps: bool, _: bool) -> Vec<&'static str> {
        let mut needed = Fmu::symbols();
        needed.extend(steps.then(Fmu::step_symbols).into_iter().flatten());
        needed
    }

    unsafe fn load(library: &Library) -> Result<Self, libloading::Error> {
        // SAFETY: the caller has the same obligations.
        unsafe {
            Ok(Fmi2 {
                functions: Functions::load(library, 0)?,
                stepping: StepFunctions::load(library, 0).ok(),
                events: EventFunctions::load(library, 0).ok(),
            })
        }
    }

    fn resources(directory: &Path) -> Option<String> {
        Some(file_uri(&directory.join("resources")))
    }

    fn instantiate<'fmu>(fmu: &'fmu Fmu, name: &str) -> Called<Instance<'fmu>> {
        fmu.instantiate_with(&fmu.instantiation(name))
    }

    fn initialize(
        instance: &mut Instance,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Called {
        instance.setup_experiment(tolerance, start, stop)?;
        instance.enter_initialization_mode()
    }

    fn configure(_: &mut Instance, _: bool) -> Called {
        Ok(()) // no structural parameters
    }

    fn step(instance: &mut Instance, time: f64, step: f64) -> Called {
        instance.do_step(time, step)
    }

    fn set_slopes(instance: &mut Instance, references: &[u32], slopes: &[f64]) -> Called {
        assert_eq!(references.len(), slopes.len());
        // Steps must not allocate memory, so that the references are set in groups of at most the length of `ones`.
        let ones = [1; 16];
        for (some, slopes) in references.chunks(ones.len()).zip(slopes.chunks(ones.len())) {
            instance.set_real_input_derivatives(some, &ones[..some.len()], slopes)?;
        }
        Ok(())
    }

    fn step_along(
        instance: &mut Instance,
        time: f64,
        step: f64,
        references: &[u32],
        _: &[f64],
        slopes: &[f64],
    ) -> Called {
        Fmi2::set_slopes(instance, references, slopes)?;
        instance.do_step(time, step)
    }

    fn enter_event_mode(instance: &mut Instance) -> Called {
        instance.call_plain(instance.events().enter_event_mode)
    }

    fn update(instance: &mut Instance) -> Called<Updated> {
        let info = instance.new_discrete_states()?;
        Ok(Updated {
            again: info.new_discrete_states_needed != 0,
            terminate: info.terminate_simulation != 0,
            next_event: (info.next_event_time_defined != 0).then_some(info.next_event_time),
        })
    }

    fn sizes(instance: &mut Instance) -> Called<(usize, usize)> {
        Ok(instance.fmu.description.sizes)
    }

    fn values(
        instance: &mut Instance,
        c_type: CType,
        reference: u32,
        _: usize,
    ) -> Called<Vec<Value>> {
        let reference = [reference];
        let functions = instance.functions();
        let mut number = [0];
        Ok(vec![match c_type {
            CType::Float64 => {
                let mut value = [f64::NAN];
                instance.read(functions.get_real, &reference, &mut value)?;
                Value::Real(value[0])
            }
            CType::Boolean => {
                instance.read(functions.get_boolean, &reference, &mut number)?;
                Value::Boolean(number[0] != 0)
            }
            CType::String => Value::String(instance.get_string(&reference)?.remove(0)),
            _ => {
                instance.read(functions.get_integer, &reference, &mut number)?;
                Value::Integer(number[0].into())
            }
        }])
    }

    fn set_values(instance: &mut Instance, _: CType, reference: u32, values: &[Value]) -> Called {
        let (reference, functions) = ([reference], instance.functions());
        values.iter().try_for_each(|value| match value {
            Value::Real(value) => instance.write(functions.set_real, &reference, &[*value]),
            // `ModelDescription::value` has checked that the value has 32 bits.
            Value::Integer(value) => {
                instance.write(functions.set_integer, &reference, &[*value as i32])
            }
            Value::Boolean(value) => {
                instance.write(functions.set_boolean, &reference, &[(*value).into()])
            }
            Value::String(value) => {
                instance.write_texts(functions.set_string, &reference, &[value])
            }
        })
    }

    fn reals(instance: &mut Instance, references: &[u32], values: &mut [f64]) -> Called {
        instance.read(instance.functions().get_real, references, values)
    }

    fn set_reals(instance: &mut Instance, references: &[u32], values: &[f64]) -> Called {
        instance.write(instance.functions().set_real, references, values)
    }
}

macro_rules! answers {
    ($table:expr, $component:expr; $($function:ident($($argument:expr),*)),* $(,)?) => {
        [$((
            $table.$function.name,
            Status::from(($table.$function.call)($component $(, $argument)*)),
        )),*]
    };
}

pub fn file_uri(folder: &Path) -> String {
    let path = folder.to_string_lossy().replace(std::path::MAIN_SEPARATOR, "/");
    let start = if path.starts_with('/') { "file://" } else { "file:///" };
    format!("{start}{}", percent_encoded(&path, b"/:"))
}

pub fn percent_encoded(text: &str, kept: &[u8]) -> String {
    let mut encoded = String::new();
    for byte in text.bytes() {
        match byte {
            _ if byte.is_ascii_alphanumeric()
                || b"-._~".contains(&byte)
                || kept.contains(&byte) =>
            {
                encoded.push(byte.into());
            }
            _ => encoded.push_str(&format!("%{byte:02X}")),
        }
    }
    encoded
}

impl Fmu {
    pub fn has_exchange(&self) -> bool {
        self.exchange.is_some() && self.own.events.is_some()
    }

    pub fn symbols() -> Vec<&'static str> {
        [Common::<c_int>::symbols(0), Functions::symbols(0)].concat()
    }

    pub fn step_symbols() -> Vec<&'static str> {
        StepFunctions::symbols(0)
    }

    pub fn exchange_symbols() -> Vec<&'static str> {
        [EventFunctions::symbols(0), Exchange::<c_int>::symbols(0)].concat()
    }

    pub fn types_platform(&self) -> String {
        // SAFETY: the function has no arguments and returns a constant string.
        unsafe { copy_text((self.own.functions.get_types_platform.call)()) }
    }

    /// Returns the arguments with which [`Fmu::instantiate`] calls fmi2Instantiate. Tests of wrong
    /// calls modify them and pass them to [`Fmu::instantiate_with`].
    pub fn instantiation<'a>(&'a self, name: &'a str) -> Instantiation<'a> {
        Instantiation {
            name: Some(name),
            kind: match self.interface {
                Interface::CoSimulation => CO_SIMULATION,
                Interface::ModelExchange => MODEL_EXCHANGE,
            },
            guid: Some(&self.description.guid),
            resources: self.resources.as_deref(),
            callbacks: Callbacks::Full,
            logging: true,
        }
    }

    /// Calls fmi2Instantiate with exactly the arguments `with`. Tests use it to pass wrong
    /// arguments.
    pub fn instantiate_with(&self, with: &Instantiation) -> Result<Instance<'_>, CallError> {
        let (name, guid, resources) =
            (c_string(with.name), c_string(with.guid), c_string(with.resources));
        static ONCE: Once = Once::new();
        // SAFETY: the function exists as long as the program.
        ONCE.call_once(|| unsafe { hubslosh_set_log_message(c_abi::log_message) });
        let environment = Environment::new();
        let full = matches!(with.callbacks, Callbacks::Full | Callbacks::Fleeting);
        let logs = full || with.callbacks == Callbacks::Logger;
        let callbacks = Box::into_raw(Box::new(CallbackFunctions {
            logger: logs.then_some(hubslosh_logger as Logger),
            allocate_memory: full.then_some(calloc),
            free_memory: full.then_some(free),
            step_finished: None,
            environment: if logs { environment.pointer() } else { null_mut() },
        }));
        let instantiate = self.own.functions.instantiate;
        self.create_instance(instantiate.name, environment, Given(callbacks), || {
            // SAFETY: strings and callbacks exist until the call has returned; the callbacks exist longer than the instance.
            let component = unsafe {
                (instantiate.call)(
                    pointer(&name),
                    with.kind,
                    pointer(&guid),
                    pointer(&resources),
                    if with.callbacks == Callbacks::Null { null() } else { callbacks },
                    0,
                    with.logging.into(),
                )
            };
            if with.callbacks == Callbacks::Fleeting {
                // SAFETY: the struct was created above, and nobody reads it any more.
                unsafe { callbacks.write_bytes(0, 1) };
            }
            component
        })
    }

    pub fn calls_with_null_instance(&self) -> Vec<(&'static str, Status)> {
        let c: Component = null_mut();
        let (mut i, mut x, mut n, mut s, mut t) = (0, 0.0, 0, null_mut(), null());
        let mut answers = Vec::new();
        // SAFETY: the FMU must refuse a NULL instance before it uses anything else. All other pointers are valid or
        // have the length 0. The same holds for the following calls.
        answers.extend(unsafe {
            answers! { self.common, c;
                set_debug_logging(0, 0, null()),
                exit_initialization_mode(),
                terminate(),
                reset(),
                get_fmu_state(&mut s),
                set_fmu_state(s),
                free_fmu_state(&mut s),
                serialized_fmu_state_size(s, &mut n),
                serialize_fmu_state(s, null_mut(), 0),
                deserialize_fmu_state(null(), 0, &mut s),
            }
        });
        // SAFETY: the same as in the call above.
        answers.extend(unsafe {
            answers! { self.own.functions, c;
                setup_experiment(0, 0.0, 0.0, 0, 0.0),
                enter_initialization_mode(),
                get_directional_derivative(null(), 0, null(), 0, null(), null_mut()),
            }
        });
        // SAFETY: the same as in the call above.
        answers.extend(unsafe { self.own.functions.nothing(c) });
        if let Some(f) = &self.own.stepping {
            // SAFETY: the same as in the call above.
            answers.extend(unsafe {
                answers! { f, c;
                    set_real_input_derivatives(null(), 0, null(), null()),
                    get_real_output_derivatives(null(), 0, null(), null_mut()),
                    do_step(0.0, 1.0, 0),
                    cancel_step(),
                    get_status(0, &mut i),
                    get_real_status(2, &mut x),
                    get_integer_status(0, &mut i),
                    get_boolean_status(3, &mut i),
                    get_string_status(1, &mut t),
                }
            });
        }
        let (Some(events), Some(f)) = (&self.own.events, &self.exchange) else { return answers };
        // SAFETY: the same as in the call above.
        answers.extend(unsafe {
            answers! { events, c; enter_event_mode(), new_discrete_states(null_mut()) }
        });
        // SAFETY: the same as in the call above.
        answers.extend(unsafe {
            answers! { f, c;
                enter_continuous_time_mode(),
                completed_integrator_step(0, null_mut(), null_mut()),
                set_time(0.0),
                set_continuous_states(null(), 0),
                get_derivatives(null_mut(), 0),
                get_event_indicators(null_mut(), 0),
                get_continuous_states(null_mut(), 0),
                get_nominals(null_mut(), 0),
            }
        });
        answers
    }
}

impl Functions {
    /// Calls the get and set functions of each type with zero variables and NULL pointers. Returns
    /// the status of each call.
    ///
    /// # Safety
    ///
    /// The component must be NULL or an instance of the FMU.
    unsafe fn nothing(&self, component: Component) -> [(&'static str, Status); 8] {
        // SAFETY: the FMU must check the number of variables before it uses a pointer.
        unsafe {
            answers! { self, component;
                get_real(null(), 0, null_mut()),
                get_integer(null(), 0, null_mut()),
                get_boolean(null(), 0, null_mut()),
                get_string(null(), 0, null_mut()),
                set_real(null(), 0, null()),
                set_integer(null(), 0, null()),
                set_boolean(null(), 0, null()),
                set_string(null(), 0, null()),
            }
        }
    }
}

/// Callbacks that were passed to an FMU. They must exist as long as the instance, and are freed
/// after the instance.
pub struct Given(*mut CallbackFunctions);

impl Drop for Given {
    fn drop(&mut self) {
        // SAFETY: the pointer comes from Box::into_raw, and only this call frees it.
        drop(unsafe { Box::from_raw(self.0) });
    }
}

pub const MODEL_EXCHANGE: i32 = 0;
pub const CO_SIMULATION: i32 = 1;

/// Value of fmi2StatusKind with which a host asks if the FMU requests the end of the simulation.
pub const TERMINATED: i32 = 3;

/// Arguments of fmi2Instantiate; `None` becomes a NULL pointer.
#[derive(Clone, Debug)]
pub struct Instantiation<'a> {
    pub name: Option<&'a str>,
    pub kind: i32,
    pub guid: Option<&'a str>,
    pub resources: Option<&'a str>,
    pub callbacks: Callbacks,
    pub logging: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Callbacks {
    Full,
    /// All callbacks, but the host overwrites the struct fmi2CallbackFunctions after
    /// fmi2Instantiate has returned, because FMI guarantees the struct only during this call. An
    /// FMU that uses it later fails the test.
    Fleeting,
    Logger,
    Empty,
    Null,
}

// ---------------------------------------------------------------- an instance

impl<'fmu> Instance<'fmu> {
    fn functions(&self) -> &'fmu Functions {
        &self.fmu.own.functions
    }

    fn stepping(&self) -> &'fmu StepFunctions {
        self.fmu.own.stepping.as_ref().expect("the FMU exports the functions of co-simulation")
    }

    fn events(&self) -> &'fmu EventFunctions {
        self.fmu.own.events.as_ref().expect("the FMU exports the functions of model exchange")
    }

    pub fn setup_experiment(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Called {
        let (relative, end) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
        // SAFETY: all arguments are plain values.
        self.call(self.functions().setup_experiment, |f, c| unsafe {
            f(c, tolerance.is_some().into(), relative, start, stop.is_some().into(), end)
        })
    }

    pub fn enter_initialization_mode(&mut self) -> Called {
        self.call_plain(self.functions().enter_initialization_mode)
    }

    pub fn cancel_step(&mut self) -> Called {
        self.call_plain(self.stepping().cancel_step)
    }

    /// Calls fmi2DoStep: simulates from `time` to `time + step`, s. The argument
    /// noSetFMUStatePriorToCurrentPoint is true, so that the FMU may discard earlier states.
    pub fn do_step(&mut self, time: f64, step: f64) -> Called {
        // SAFETY: all arguments are plain values, and the instance is alive.
        self.call(self.stepping().do_step, |f, c| unsafe { f(c, time, step, 1) })
    }

    pub fn new_discrete_states(&mut self) -> Called<EventInfo> {
        let mut info = EventInfo::default();
        // SAFETY: the pointer leads to a variable for the result.
        self.call(self.events().new_discrete_states, |f, c| unsafe { f(c, &mut info) })?;
        Ok(info)
    }

    // ------------------------------------------------ variables by reference

    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Called {
        self.read(self.functions().get_integer, references, values)
    }

    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Called {
        self.write(self.functions().set_integer, references, values)
    }

    /// Reads Booleans as C integers instead of `bool`, because an FMU may return other values than
    /// 0 and 1, which are not valid.
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Called {
        self.read(self.functions().get_boolean, references, values)
    }

    pub fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Called {
        self.write(self.functions().set_boolean, references, values)
    }

    pub fn get_string(&mut self, references: &[u32]) -> Called<Vec<String>> {
        self.read_texts(self.functions().get_string, references, references.len())
    }

    pub fn set_string(&mut self, references: &[u32], values: &[&str]) -> Called {
        self.write_texts(self.functions().set_string, references, values)
    }

    pub fn set_real_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Called {
        let n = references.len();
        assert!(n == orders.len() && n == values.len());
        // SAFETY: the slices have the length that is passed.
        self.call(self.stepping().set_real_input_derivatives, |f, c| unsafe {
            f(c, references.as_ptr(), n, orders.as_ptr(), values.as_ptr())
        })
    }

    pub fn get_real_output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Called {
        let n = references.len();
        assert!(n == orders.len() && n == values.len());
        // SAFETY: the slices have the length that is passed.
        self.call(self.stepping().get_real_output_derivatives, |f, c| unsafe {
            f(c, references.as_ptr(), n, orders.as_ptr(), values.as_mut_ptr())
        })
    }

    pub fn get_directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        change: &[f64],
    ) -> Called<Vec<f64>> {
        let (n, m) = (unknowns.len(), knowns.len());
        assert_eq!(m, change.len());
        let mut answer = vec![0.0; n];
        let (unknowns, knowns) = (unknowns.as_ptr(), knowns.as_ptr());
        // SAFETY: the slices have the lengths that are passed.
        self.call(self.functions().get_directional_derivative, |f, c| unsafe {
            f(c, unknowns, n, knowns, m, change.as_ptr(), answer.as_mut_ptr())
        })?;
        Ok(answer)
    }

    // ------------------------------------------------ status of an asynchronous step

    fn read_status<T>(
        &mut self,
        function: Function<GetStatus<T>>,
        kind: i32,
        mut value: T,
    ) -> Called<T> {
        // SAFETY: the pointer leads to a variable for the result.
        self.call(function, |f, c| unsafe { f(c, kind, &mut value) })?;
        Ok(value)
    }

    pub fn status(&mut self, kind: i32) -> Called<i32> {
        self.read_status(self.stepping().get_status, kind, 0)
    }

    pub fn real_status(&mut self, kind: i32) -> Called<f64> {
        self.read_status(self.stepping().get_real_status, kind, 0.0)
    }

    pub fn integer_status(&mut self, kind: i32) -> Called<i32> {
        self.read_status(self.stepping().get_integer_status, kind, 0)
    }

    pub fn boolean_status(&mut self, kind: i32) -> Called<bool> {
        Ok(self.read_status(self.stepping().get_boolean_status, kind, 0)? != 0)
    }

    pub fn string_status(&mut self, kind: i32) -> Called<String> {
        let text = self.read_status(self.stepping().get_string_status, kind, null())?;
        // SAFETY: the FMU has returned OK, so that the pointer leads to a terminated string of the FMU.
        Ok(unsafe { copy_text(text) })
    }

    // ------------------------------------------------ for tests of bad calls

    /// Calls fmi2GetReal for `count` variables with NULL pointers. An FMU must accept this for
    /// `count` = 0 and return an error for any other number.
    pub fn get_real_null(&mut self, count: usize) -> Called {
        // SAFETY: the call tests that the FMU checks the number before it uses a NULL pointer. The same holds for
        // the next four calls.
        self.call(self.functions().get_real, |f, c| unsafe { f(c, null(), count, null_mut()) })
    }

    pub fn set_real_null(&mut self, count: usize) -> Called {
        // SAFETY: the same as in `get_real_null`.
        self.call(self.functions().set_real, |f, c| unsafe { f(c, null(), count, null()) })
    }

    /// Calls the get and set functions of each type with zero variables and NULL pointers, and
    /// returns the status of each call. The FMU must accept these calls.
    pub fn calls_without_variables(&mut self) -> [(&'static str, Status); 8] {
        // SAFETY: the same as in `get_real_null`.
        unsafe { self.functions().nothing(self.component) }
    }

    pub fn set_string_null(&mut self, reference: u32) -> Called {
        let text = null::<c_char>();
        // SAFETY: the same as in `get_real_null`.
        self.call(self.functions().set_string, |f, c| unsafe { f(c, &reference, 1, &text) })
    }

    pub fn set_state_null(&mut self) -> Called {
        self.set_state(&FmuState(null_mut()))
    }

    /// Calls fmi2FreeFMUstate with the state itself instead of its address. The importer fmusim does
    /// this, so that an FMU should accept it.
    pub fn free_state_itself(&mut self, state: FmuState) -> Called {
        // SAFETY: the handle comes from this FMU and is not used after this call; it points to something larger than a
        // pointer.
        self.call(self.fmu.common.free_fmu_state, |f, c| unsafe { f(c, state.0.cast()) })
    }

    pub fn free_state_null(&mut self) -> Called {
        // SAFETY: the same as in `get_real_null`.
        self.call(self.fmu.common.free_fmu_state, |f, c| unsafe { f(c, null_mut()) })?;
        self.free_state(FmuState(null_mut()))
    }
}

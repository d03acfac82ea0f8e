//! The part of the C interface that only FMI 3.0 has: its types, the functions whose types differ from FMI 2.0, and
//! event mode, early return and intermediate update in Co-Simulation. The rest is in [`crate::c_abi::version`].
//! Functions that only Scheduled Execution needs are not declared.
#![allow(unsafe_code)]

use std::cell::Cell;
use std::collections::BTreeMap;
use std::ffi::{c_char, c_int, c_void};
use std::path::Path;
use std::ptr::{null, null_mut};

use anyhow::Result;
use libloading::Library;

use crate::c_abi::version::{
    self, Call, Common, Component, Exchange, Getter, Refs, Setter, Updated, Version,
};
pub use crate::c_abi::version::{FmuState, Interface};
use crate::c_abi::{
    self, CallError, Called, Environment, Function, Message, Status, c_string, functions,
    log_message, pointer,
};
use crate::causality::Causality;
use crate::description::{CType, Value};

pub type Fmu = version::Fmu<Fmi3>;
pub type Instance<'fmu> = version::Instance<'fmu, Fmi3>;

pub const PLATFORM: &str = version::PLATFORM[1];

// ---------------------------------------------------------------- C types

/// `fmi3Boolean`: a byte, because a value that is neither 0 nor 1 must not become a `bool`.
type Byte = u8;
type Get<T> = unsafe extern "C" fn(Component, Refs, usize, *mut T, usize) -> c_int;
type Set<T> = unsafe extern "C" fn(Component, Refs, usize, *const T, usize) -> c_int;
type Count = unsafe extern "C" fn(Component, *mut usize) -> c_int;
type LogMessage = extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);
type Derivative = unsafe extern "C" fn(
    Component,
    Refs,
    usize,
    Refs,
    usize,
    *const f64,
    usize,
    *mut f64,
    usize,
) -> c_int;
type Intermediate = extern "C" fn(*mut c_void, f64, Byte, Byte, Byte, Byte, *mut Byte, *mut f64);

// Functions of every FMU 3.0 that this host calls, in addition to `Common`. (An FMU must export all 75 functions;
// FMI 3.0.2, section 2.5.)
functions! { Functions:
    enter_initialization_mode "fmi3EnterInitializationMode", unsafe extern "C" fn(Component, Byte, f64, f64, Byte, f64) -> c_int;
    get_float32 "fmi3GetFloat32", Get<f32>;
    get_float64 "fmi3GetFloat64", Get<f64>;
    get_int8 "fmi3GetInt8", Get<i8>;
    get_uint8 "fmi3GetUInt8", Get<u8>;
    get_int16 "fmi3GetInt16", Get<i16>;
    get_uint16 "fmi3GetUInt16", Get<u16>;
    get_int32 "fmi3GetInt32", Get<i32>;
    get_uint32 "fmi3GetUInt32", Get<u32>;
    get_int64 "fmi3GetInt64", Get<i64>;
    get_uint64 "fmi3GetUInt64", Get<u64>;
    get_boolean "fmi3GetBoolean", Get<Byte>;
    get_string "fmi3GetString", Get<*const c_char>;
    set_float32 "fmi3SetFloat32", Set<f32>;
    set_float64 "fmi3SetFloat64", Set<f64>;
    set_int8 "fmi3SetInt8", Set<i8>;
    set_uint8 "fmi3SetUInt8", Set<u8>;
    set_int16 "fmi3SetInt16", Set<i16>;
    set_uint16 "fmi3SetUInt16", Set<u16>;
    set_int32 "fmi3SetInt32", Set<i32>;
    set_uint32 "fmi3SetUInt32", Set<u32>;
    set_int64 "fmi3SetInt64", Set<i64>;
    set_uint64 "fmi3SetUInt64", Set<u64>;
    set_boolean "fmi3SetBoolean", Set<Byte>;
    set_string "fmi3SetString", Set<*const c_char>;
    get_directional_derivative "fmi3GetDirectionalDerivative", Derivative;
    get_adjoint_derivative "fmi3GetAdjointDerivative", Derivative;
    number_of_dependencies "fmi3GetNumberOfVariableDependencies", unsafe extern "C" fn(Component, u32, *mut usize) -> c_int;
    dependencies "fmi3GetVariableDependencies", unsafe extern "C" fn(Component, u32, *mut usize, *mut u32, *mut usize, *mut c_int, usize) -> c_int;
    enter_configuration_mode "fmi3EnterConfigurationMode", Call;
    exit_configuration_mode "fmi3ExitConfigurationMode", Call;
    enter_event_mode "fmi3EnterEventMode", Call;
    update_discrete_states "fmi3UpdateDiscreteStates", unsafe extern "C" fn(Component, *mut Byte, *mut Byte, *mut Byte, *mut Byte, *mut Byte, *mut f64) -> c_int;
}

// Functions that this host calls in Co-Simulation, in addition to `Common` and `Functions`.
functions! { StepFunctions:
    instantiate "fmi3InstantiateCoSimulation", unsafe extern "C" fn(*const c_char, *const c_char, *const c_char, Byte, Byte, Byte, Byte, Refs, usize, *mut c_void, Option<LogMessage>, Option<Intermediate>) -> Component;
    enter_step_mode "fmi3EnterStepMode", Call;
    get_output_derivatives "fmi3GetOutputDerivatives", unsafe extern "C" fn(Component, Refs, usize, *const i32, *mut f64, usize) -> c_int;
    do_step "fmi3DoStep", unsafe extern "C" fn(Component, f64, f64, Byte, *mut Byte, *mut Byte, *mut Byte, *mut f64) -> c_int;
}

// Functions that this host calls for Model Exchange in addition to `Exchange`.
functions! { ExchangeFunctions:
    instantiate "fmi3InstantiateModelExchange", unsafe extern "C" fn(*const c_char, *const c_char, *const c_char, Byte, Byte, *mut c_void, Option<LogMessage>) -> Component;
    number_of_event_indicators "fmi3GetNumberOfEventIndicators", Count;
    number_of_continuous_states "fmi3GetNumberOfContinuousStates", Count;
}

const UNCALLED: [&str; 15] = [
    "fmi3InstantiateScheduledExecution",
    "fmi3GetBinary",
    "fmi3GetClock",
    "fmi3SetBinary",
    "fmi3SetClock",
    "fmi3GetIntervalDecimal",
    "fmi3GetIntervalFraction",
    "fmi3GetShiftDecimal",
    "fmi3GetShiftFraction",
    "fmi3SetIntervalDecimal",
    "fmi3SetIntervalFraction",
    "fmi3SetShiftDecimal",
    "fmi3SetShiftFraction",
    "fmi3EvaluateDiscreteStates",
    "fmi3ActivateModelPartition",
];

pub trait Exchanged: Copy + Default {
    #[doc(hidden)]
    #[allow(private_interfaces)]
    fn calls(functions: &Functions) -> (Function<Get<Self>>, Function<Set<Self>>);

    fn value(self) -> Value;

    fn from_value(value: &Value) -> Self;
}

macro_rules! exchanged {
    ($($type:ty, $get:ident $set:ident, $value:expr, $of:expr;)*) => {$(
        impl Exchanged for $type {
            #[allow(private_interfaces)]
            fn calls(functions: &Functions) -> (Function<Get<Self>>, Function<Set<Self>>) {
                (functions.$get, functions.$set)
            }
            fn value(self) -> Value {
                $value(self)
            }
            fn from_value(value: &Value) -> Self {
                $of(value) as $type
            }
        }
    )*};
}

fn as_real(value: &Value) -> f64 {
    if let Value::Real(x) = value { *x } else { f64::NAN }
}

fn as_integer(value: &Value) -> i64 {
    if let Value::Integer(n) = value { *n } else { 0 }
}

fn as_text(value: &Value) -> &str {
    if let Value::String(text) = value { text } else { "" }
}

fn integer(n: impl TryInto<i64>) -> Value {
    Value::Integer(n.try_into().unwrap_or(i64::MAX))
}

exchanged! {
    f32, get_float32 set_float32, |x: f32| Value::Real(x.into()), as_real;
    f64, get_float64 set_float64, Value::Real, as_real;
    i8, get_int8 set_int8, integer, as_integer;
    u8, get_uint8 set_uint8, integer, as_integer;
    i16, get_int16 set_int16, integer, as_integer;
    u16, get_uint16 set_uint16, integer, as_integer;
    i32, get_int32 set_int32, integer, as_integer;
    u32, get_uint32 set_uint32, integer, as_integer;
    i64, get_int64 set_int64, integer, as_integer;
    u64, get_uint64 set_uint64, integer, as_integer;
}

macro_rules! numbers {
    ($c_type:expr, $type:ident => $do:expr, $($others:tt)*) => {
        match $c_type {
            CType::Float32 => { type $type = f32; $do }
            CType::Float64 => { type $type = f64; $do }
            CType::Int8 => { type $type = i8; $do }
            CType::UInt8 => { type $type = u8; $do }
            CType::Int16 => { type $type = i16; $do }
            CType::UInt16 => { type $type = u16; $do }
            CType::Int32 => { type $type = i32; $do }
            CType::UInt32 => { type $type = u32; $do }
            CType::Int64 => { type $type = i64; $do }
            CType::UInt64 => { type $type = u64; $do }
            $($others)*
        }
    };
}

// ---------------------------------------------------------------- callbacks

pub struct Stepping {
    component: Cell<Component>,
    functions: *const Functions,
    /// Callback for points within the step. The pointer is valid during one call of fmi3DoStep, and
    /// otherwise NULL.
    within: Cell<*mut Within<'static>>,
    updates: Cell<usize>,
    line: Cell<Line>,
    environment: *mut c_void,
}

thread_local! {
    /// The instance whose fmi3DoStep runs on this thread, so that its callback finds the instance;
    /// otherwise NULL.
    static STEPPING: Cell<*const Stepping> = const { Cell::new(null()) };
}

type Within<'a> = dyn FnMut(&Update) -> Option<f64> + 'a;

#[allow(clippy::too_many_arguments)]
extern "C" fn intermediate_update(
    environment: *mut c_void,
    time: f64,
    set_requested: Byte,
    get_allowed: Byte,
    step_finished: Byte,
    can_return_early: Byte,
    early_return_requested: *mut Byte,
    early_return_time: *mut f64,
) {
    // SAFETY: the pointer is set only while fmi3DoStep runs on this thread. The pointer that the FMU passes back is
    // compared and never dereferenced.
    let stepping = unsafe { STEPPING.get().as_ref() };
    if stepping.is_none_or(|stepping| stepping.environment != environment) {
        c_abi::count_foreign_environment();
    }
    let answer = stepping.and_then(|stepping| {
        stepping.updates.set(stepping.updates.get() + 1);
        let update = Update {
            time,
            set_requested: set_requested != 0,
            get_allowed: get_allowed != 0,
            step_finished: step_finished != 0,
            can_return_early: can_return_early != 0,
            stepping,
        };
        let within = stepping.within.get();
        // SAFETY: this pointer, too, is set only while fmi3DoStep runs.
        if within.is_null() { None } else { unsafe { (*within)(&update) } }
    });
    // SAFETY: if the pointers are not NULL, they lead to two variables for the results.
    unsafe {
        if !early_return_requested.is_null() {
            *early_return_requested = answer.is_some().into();
        }
        if !early_return_time.is_null() {
            *early_return_time = answer.unwrap_or(time);
        }
    }
}

/// A point within a step at which the FMU has called intermediateUpdate (FMI 3.0.2, section 4.2.2).
pub struct Update<'a> {
    pub time: f64,
    pub set_requested: bool,
    pub get_allowed: bool,
    pub step_finished: bool,
    pub can_return_early: bool,
    stepping: &'a Stepping,
}

impl Update<'_> {
    pub fn set(&self, references: &[u32], values: &[f64]) -> Status {
        let n = references.len();
        // SAFETY: both slices have the lengths that are passed, and the FMU expects such calls within this callback.
        let status = unsafe {
            ((*self.stepping.functions).set_float64.call)(
                self.stepping.component.get(),
                references.as_ptr(),
                n,
                values.as_ptr(),
                values.len(),
            )
        };
        status.into()
    }

    pub fn get(&self, references: &[u32], values: &mut [f64]) -> Status {
        // SAFETY: the same as in `set`.
        let status = unsafe {
            ((*self.stepping.functions).get_float64.call)(
                self.stepping.component.get(),
                references.as_ptr(),
                references.len(),
                values.as_mut_ptr(),
                values.len(),
            )
        };
        status.into()
    }
}

// ---------------------------------------------------------------- the FMU

impl<T> Getter<T> for Get<T> {
    unsafe fn get(self, component: Component, references: &[u32], values: &mut [T]) -> c_int {
        let (n, count) = (references.len(), values.len());
        // SAFETY: both slices have the lengths that are passed.
        unsafe { self(component, references.as_ptr(), n, values.as_mut_ptr(), count) }
    }
}

impl<T> Setter<T> for Set<T> {
    unsafe fn set(self, component: Component, references: &[u32], values: &[T]) -> c_int {
        let (n, count) = (references.len(), values.len());
        // SAFETY: both slices have the lengths that are passed.
        unsafe { self(component, references.as_ptr(), n, values.as_ptr(), count) }
    }
}

pub struct Fmi3 {
    functions: Functions,
    stepping: Option<StepFunctions>,
    exchange: Option<ExchangeFunctions>,
}

impl Version for Fmi3 {
    const NUMBER: usize = 1;
    type Boolean = Byte;
    type Kept = Box<Stepping>;

    fn required_functions(steps: bool, exchanges: bool) -> Vec<&'static str> {
        let mut needed = [Common::<Byte>::symbols(1), Functions::symbols(0)].concat();
        if steps {
            needed.extend(StepFunctions::symbols(0));
        }
        if exchanges {
            needed.extend(Exchange::<Byte>::symbols(1));
            needed.extend(ExchangeFunctions::symbols(0));
        }
        needed
    }

    unsafe fn load(library: &Library) -> Result<Self, libloading::Error> {
        // SAFETY: the caller has the same obligations.
        unsafe {
            Ok(Fmi3 {
                functions: Functions::load(library, 0)?,
                stepping: StepFunctions::load(library, 0).ok(),
                exchange: ExchangeFunctions::load(library, 0).ok(),
            })
        }
    }

    /// Returns the path of the folder of resources with a separator at its end, as FMI 3.0.2
    /// requires (section 2.3.1), or `None` if the FMU has no such folder.
    fn resources(directory: &Path) -> Option<String> {
        let resources = directory.join("resources");
        let separator = std::path::MAIN_SEPARATOR;
        resources.is_dir().then(|| format!("{}{separator}", resources.display()))
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
        instance.enter_initialization_mode(tolerance, start, stop)
    }

    fn configure(instance: &mut Instance, enters: bool) -> Called {
        match enters {
            true => instance.enter_configuration_mode(),
            false => instance.exit_configuration_mode(),
        }
    }

    fn step(instance: &mut Instance, time: f64, step: f64) -> Called {
        let done = instance.do_step(time, step)?;
        require_whole_step(instance, done)
    }

    fn set_slopes(_: &mut Instance, _: &[u32], _: &[f64]) -> Called {
        Ok(()) // the FMU hears of them in intermediate update
    }

    fn step_along(
        instance: &mut Instance,
        time: f64,
        step: f64,
        references: &[u32],
        values: &[f64],
        slopes: &[f64],
    ) -> Called {
        let mut line = instance.kept.line.take();
        line.fill(instance, references, values)?;
        let mut refused = Status::Ok;
        let mut within = |update: &Update| {
            if update.set_requested && !line.moving.is_empty() {
                for (place, i) in &line.moving {
                    line.values[*place] = values[*i] + slopes[*i] * (update.time - time);
                }
                refused = refused.max(update.set(&line.references, &line.values));
            }
            None
        };
        let done = instance.do_step_with_updates(time, step, Some(&mut within))?;
        instance.kept.line.set(line);
        require_whole_step(instance, done)?;
        match refused {
            Status::Ok | Status::Warning => Ok(()),
            status => Err(CallError {
                call: instance.functions().set_float64.name,
                status,
                messages: instance.take_messages(),
            }),
        }
    }

    fn enter_event_mode(instance: &mut Instance) -> Called {
        instance.call_plain(instance.functions().enter_event_mode)
    }

    fn update(instance: &mut Instance) -> Called<Updated> {
        let info = instance.update_discrete_states()?;
        Ok(Updated {
            again: info.needs_update == 1,
            terminate: info.terminate == 1,
            next_event: (info.next_event_defined == 1).then_some(info.next_event_time),
        })
    }

    fn sizes(instance: &mut Instance) -> Called<(usize, usize)> {
        Ok((instance.number_of_states()?, instance.number_of_indicators()?))
    }

    fn values(
        instance: &mut Instance,
        c_type: CType,
        reference: u32,
        count: usize,
    ) -> Called<Vec<Value>> {
        let reference = [reference];
        Ok(numbers! { c_type, T => {
                let mut values = vec![T::default(); count];
                instance.get_numbers(&reference, &mut values)?;
                values.into_iter().map(T::value).collect()
            },
            CType::Boolean => {
                let mut values = vec![0; count];
                instance.get_boolean_bytes(&reference, &mut values)?;
                values.into_iter().map(|byte| Value::Boolean(byte != 0)).collect()
            }
            CType::String => {
                instance.read_texts(instance.functions().get_string, &reference, count)?.into_iter().map(Value::String).collect()
            }
            // Values of these types are not exchanged, because `ModelDescription::value` refuses them.
            CType::Binary | CType::Clock => Vec::new(),
        })
    }

    fn set_values(
        instance: &mut Instance,
        c_type: CType,
        reference: u32,
        values: &[Value],
    ) -> Called {
        let reference = [reference];
        numbers! { c_type, T => {
                instance.set_numbers(&reference, &values.iter().map(T::from_value).collect::<Vec<T>>())
            },
            CType::Boolean => {
                let byte = |value: &Value| u8::from(*value == Value::Boolean(true));
                instance.write(instance.functions().set_boolean, &reference, &values.iter().map(byte).collect::<Vec<u8>>())
            }
            CType::String => {
                instance.write_texts(instance.functions().set_string, &reference, &values.iter().map(as_text).collect::<Vec<&str>>())
            }
            CType::Binary | CType::Clock => Ok(()),
        }
    }

    fn reals(instance: &mut Instance, references: &[u32], values: &mut [f64]) -> Called {
        instance.get_numbers(references, values)
    }

    fn set_reals(instance: &mut Instance, references: &[u32], values: &[f64]) -> Called {
        instance.set_numbers(references, values)
    }
}

impl Fmu {
    pub fn symbols() -> Vec<&'static str> {
        let mut all = Fmi3::required_functions(true, true);
        all.extend(UNCALLED);
        all
    }

    /// Returns the arguments for an instance without event mode and early return. Tests of wrong
    /// calls modify them. If the FMU provides intermediate update, the arguments request all inputs
    /// that may be set within a step.
    pub fn instantiation<'a>(&'a self, name: &'a str) -> Instantiation<'a> {
        let stepping = self.description.co_simulation.as_ref();
        let updates = stepping.is_some_and(|cs| cs.can_interpolate_inputs);
        let mut required: Vec<u32> = self
            .description
            .variables
            .iter()
            .filter(|v| updates && v.intermediate && v.causality == Causality::Input)
            .map(|v| self.description.element(v.reference).map_or(v.reference, |e| e.array))
            .collect();
        required.dedup();
        Instantiation {
            name: Some(name),
            interface: self.interface,
            token: Some(&self.description.guid),
            resources: self.resources.as_deref(),
            logging: true,
            event_mode: false,
            early_return: false,
            intermediate_update: updates,
            required,
            logger: true,
        }
    }

    pub fn instantiate_with(&self, with: &Instantiation) -> Called<Instance<'_>> {
        let (name, token, resources) =
            (c_string(with.name), c_string(with.token), c_string(with.resources));
        let (name, token, resources) = (pointer(&name), pointer(&token), pointer(&resources));
        let environment = Environment::new();
        let host = environment.pointer();
        let stepping = Box::new(Stepping {
            environment: host,
            component: Cell::new(null_mut()),
            functions: &self.own.functions,
            within: Cell::new(null_mut::<Nobody>() as *mut Within<'static>),
            updates: Cell::new(0),
            line: Cell::default(),
        });
        let logger = with.logger.then_some(log_message as LogMessage);
        let (logging, required) = (with.logging.into(), &with.required);
        let instance = match with.interface {
            Interface::CoSimulation => {
                let stepping_functions = self.own.stepping.as_ref();
                let f = stepping_functions.expect("the functions of co-simulation").instantiate;
                let updates =
                    with.intermediate_update.then_some(intermediate_update as Intermediate);
                let first = if required.is_empty() { null() } else { required.as_ptr() };
                let (events, early) = (with.event_mode.into(), with.early_return.into());
                let n = required.len();
                // SAFETY: the strings exist until the call has returned, and the environment exists longer than the instance.
                self.create_instance(f.name, environment, stepping, || unsafe {
                    (f.call)(
                        name, token, resources, 0, logging, events, early, first, n, host, logger,
                        updates,
                    )
                })
            }
            Interface::ModelExchange => {
                let f = self.own.exchange.as_ref().expect("the functions of model exchange");
                let f = f.instantiate;
                // SAFETY: the same as in the call above.
                self.create_instance(f.name, environment, stepping, || unsafe {
                    (f.call)(name, token, resources, 0, logging, host, logger)
                })
            }
        }?;
        instance.kept.component.set(instance.component);
        Ok(instance)
    }
}

/// Type argument for a callback that is not passed, because `None` for an optional closure needs a
/// type.
type Nobody = fn(&Update) -> Option<f64>;

/// Arguments of fmi3InstantiateCoSimulation or fmi3InstantiateModelExchange; `None` becomes a NULL pointer.
#[derive(Clone, Debug)]
pub struct Instantiation<'a> {
    pub name: Option<&'a str>,
    pub interface: Interface,
    pub token: Option<&'a str>,
    pub resources: Option<&'a str>,
    pub logging: bool,
    pub event_mode: bool,
    pub early_return: bool,
    pub intermediate_update: bool,
    pub required: Vec<u32>,
    pub logger: bool,
}

// ---------------------------------------------------------------- an instance

/// Results of fmi3DoStep in addition to its status: the bytes as the FMU wrote them, or
/// [`UNWRITTEN`].
///
/// - `last_time`: lastSuccessfulTime, s; NaN if the FMU has not written it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub event: u8,
    pub terminate: u8,
    pub early_return: u8,
    pub last_time: f64,
}

/// Content of a result byte before the call. It is neither 0 nor 1, so that a result that the FMU
/// does not write is noticed.
pub const UNWRITTEN: u8 = 0xa5;

/// Results of fmi3UpdateDiscreteStates: the bytes as the FMU wrote them, or [`UNWRITTEN`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventInfo {
    pub needs_update: u8,
    pub terminate: u8,
    pub nominals_changed: u8,
    pub values_changed: u8,
    pub next_event_defined: u8,
    pub next_event_time: f64,
}

/// Dependency of one variable of the FMU, or of one of its elements, on another.
///
/// - `element`: element of the dependent variable, from 1; 0 means all elements.
/// - `independent_element`: element of the independent variable, from 1; 0 means all elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dependency {
    pub element: usize,
    pub independent: u32,
    pub independent_element: usize,
    pub kind: i32,
}

impl<'fmu> Instance<'fmu> {
    fn functions(&self) -> &'fmu Functions {
        &self.fmu.own.functions
    }

    fn stepping(&self) -> &'fmu StepFunctions {
        self.fmu.own.stepping.as_ref().expect("the FMU exports the functions of co-simulation")
    }

    pub fn updates(&self) -> usize {
        self.kept.updates.get()
    }

    pub fn enter_initialization_mode(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Called {
        let (relative, end) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
        // SAFETY: all arguments are plain values.
        self.call(self.functions().enter_initialization_mode, |f, c| unsafe {
            f(c, tolerance.is_some().into(), relative, start, stop.is_some().into(), end)
        })
    }

    pub fn enter_configuration_mode(&mut self) -> Called {
        self.call_plain(self.functions().enter_configuration_mode)
    }

    pub fn exit_configuration_mode(&mut self) -> Called {
        self.call_plain(self.functions().exit_configuration_mode)
    }

    pub fn enter_step_mode(&mut self) -> Called {
        self.call_plain(self.stepping().enter_step_mode)
    }

    pub fn update_discrete_states(&mut self) -> Called<EventInfo> {
        let mut bytes = [UNWRITTEN; 5];
        let mut next_event_time = f64::NAN;
        let [update, terminate, nominals, values, defined] = &mut bytes;
        // SAFETY: the pointers lead to six variables for the results.
        self.call(self.functions().update_discrete_states, |f, c| unsafe {
            f(c, update, terminate, nominals, values, defined, &mut next_event_time)
        })?;
        let [needs_update, terminate, nominals_changed, values_changed, next_event_defined] = bytes;
        Ok(EventInfo {
            needs_update,
            terminate,
            nominals_changed,
            values_changed,
            next_event_defined,
            next_event_time,
        })
    }

    /// Calls fmi3DoStep: simulates from `time` to `time + step`, s. The argument
    /// noSetFMUStatePriorToCurrentPoint is true, and no callback is passed for points within the
    /// step.
    pub fn do_step(&mut self, time: f64, step: f64) -> Called<Step> {
        self.do_step_with_updates(time, step, None)
    }

    pub fn do_step_with_updates(
        &mut self,
        time: f64,
        step: f64,
        within: Option<&mut Within<'_>>,
    ) -> Called<Step> {
        if let Some(within) = within {
            let within: *mut Within<'_> = within;
            // SAFETY: only the lifetime changes, and the pointer is reset before this function returns.
            let within =
                unsafe { std::mem::transmute::<*mut Within<'_>, *mut Within<'static>>(within) };
            self.kept.within.set(within);
        }
        let mut bytes = [UNWRITTEN; 3];
        let mut last_time = f64::NAN;
        let [event, terminate, early_return] = &mut bytes;
        let before = STEPPING.replace(&raw const *self.kept);
        // SAFETY: the pointers lead to four variables for the results.
        let called = self.call(self.stepping().do_step, |f, c| unsafe {
            f(c, time, step, 1, event, terminate, early_return, &mut last_time)
        });
        STEPPING.set(before);
        self.kept.within.set(null_mut::<Nobody>() as *mut Within<'static>);
        let [event, terminate, early_return] = bytes;
        called.map(|()| Step { event, terminate, early_return, last_time })
    }

    // ------------------------------------------------ variables by reference

    /// Calls the function fmi3Get… for the type `T`, for example fmi3GetFloat64. `values` must have
    /// room for all elements of all variables in `references`.
    pub fn get_numbers<T: Exchanged>(&mut self, references: &[u32], values: &mut [T]) -> Called {
        self.read(T::calls(self.functions()).0, references, values)
    }

    pub fn set_numbers<T: Exchanged>(&mut self, references: &[u32], values: &[T]) -> Called {
        self.write(T::calls(self.functions()).1, references, values)
    }

    /// Reads Booleans as bytes instead of `bool`, because an FMU may write other values than 0 and
    /// 1, which are not valid.
    pub fn get_boolean_bytes(&mut self, references: &[u32], values: &mut [u8]) -> Called {
        self.read(self.functions().get_boolean, references, values)
    }

    pub fn output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Called {
        let (n, count) = (references.len(), values.len());
        assert_eq!(n, orders.len());
        // SAFETY: the slices have the lengths that are passed.
        self.call(self.stepping().get_output_derivatives, |f, c| unsafe {
            f(c, references.as_ptr(), n, orders.as_ptr(), values.as_mut_ptr(), count)
        })
    }

    /// Calls fmi3GetDirectionalDerivative for the variables `unknowns` with respect to `knowns`.
    /// `seed` has one value for each element of the knowns; `count` is the number of elements of
    /// the unknowns and of the result.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        count: usize,
    ) -> Called<Vec<f64>> {
        let function = self.functions().get_directional_derivative;
        self.derivative(function, unknowns, knowns, seed, count)
    }

    /// Calls fmi3GetAdjointDerivative for the variables `unknowns` with respect to `knowns`. `seed`
    /// has one value for each element of the unknowns; `count` is the number of elements of the
    /// knowns and of the result.
    pub fn adjoint_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        count: usize,
    ) -> Called<Vec<f64>> {
        let function = self.functions().get_adjoint_derivative;
        self.derivative(function, unknowns, knowns, seed, count)
    }

    fn derivative(
        &mut self,
        function: Function<Derivative>,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        count: usize,
    ) -> Called<Vec<f64>> {
        let mut answer = vec![f64::NAN; count];
        let (n, m) = (unknowns.len(), knowns.len());
        let (unknowns, knowns) = (unknowns.as_ptr(), knowns.as_ptr());
        // SAFETY: the slices have the lengths that are passed.
        self.call(function, |f, c| unsafe {
            f(c, unknowns, n, knowns, m, seed.as_ptr(), seed.len(), answer.as_mut_ptr(), count)
        })?;
        Ok(answer)
    }

    pub fn dependencies(&mut self, reference: u32) -> Called<Vec<Dependency>> {
        let mut n = 0;
        self.call(self.functions().number_of_dependencies, |f, c| unsafe {
            f(c, reference, &mut n)
        })?;
        const MOST: usize = 1 << 20;
        let n = n.min(MOST);
        let (mut own, mut other) = (vec![0usize; n], vec![0usize; n]);
        let (mut independents, mut kinds) = (vec![0u32; n], vec![0 as c_int; n]);
        let (to, from) = (own.as_mut_ptr(), other.as_mut_ptr());
        // SAFETY: the four arrays have the length that is passed.
        self.call(self.functions().dependencies, |f, c| unsafe {
            f(c, reference, to, independents.as_mut_ptr(), from, kinds.as_mut_ptr(), n)
        })?;
        let one = |i: usize| Dependency {
            element: own[i],
            independent: independents[i],
            independent_element: other[i],
            kind: kinds[i],
        };
        Ok((0..n).map(one).collect())
    }

    // ------------------------------------------------ variables as the description has them

    pub fn free_state_null(&mut self) -> Called {
        self.free_state(FmuState(null_mut()))
    }

    // ------------------------------------------------ model exchange

    fn read_count(
        &self,
        function: impl FnOnce(&ExchangeFunctions) -> Function<Count>,
    ) -> Called<usize> {
        let exchange = self.fmu.own.exchange.as_ref();
        let function = function(exchange.expect("the FMU exports the functions of model exchange"));
        let mut count = 0;
        // SAFETY: the pointer leads to a variable for the result.
        self.call(function, |f, c| unsafe { f(c, &mut count) })?;
        Ok(count)
    }

    pub fn number_of_states(&mut self) -> Called<usize> {
        self.read_count(|f| f.number_of_continuous_states)
    }

    pub fn number_of_indicators(&mut self) -> Called<usize> {
        self.read_count(|f| f.number_of_event_indicators)
    }
}

/// The inputs that the host sets within a step because they change linearly, with their value
/// references and values. FMI sets arrays as a whole: if one element changes, `values` contains all
/// elements of the array.
#[derive(Default)]
struct Line {
    references: Vec<u32>,
    values: Vec<f64>,
    /// For each input that changes within the step: its position in `values`, and its position
    /// among the inputs of the step.
    moving: Vec<(usize, usize)>,
}

impl Line {
    /// Clears this list, and adds each input of `references` that the host may set within a step.
    /// `values` are the present values of `references`.
    fn fill(&mut self, instance: &mut Instance, references: &[u32], values: &[f64]) -> Called {
        let description = instance.fmu().description();
        self.references.clear();
        self.values.clear();
        self.moving.clear();
        let mut begins = BTreeMap::new();
        for (i, reference) in references.iter().enumerate() {
            if instance.fmu().taken.binary_search(reference).is_err() {
                continue;
            }
            let Some(element) = description.element(*reference) else {
                self.moving.push((self.values.len(), i));
                self.references.push(*reference);
                self.values.push(values[i]);
                continue;
            };
            let begin = match begins.get(&element.array) {
                Some(begin) => *begin,
                None => {
                    let length = description.array(element.array).map_or(0, |array| array.length);
                    let begin = self.values.len();
                    self.values.resize(begin + length, 0.0);
                    instance.get_numbers(&[element.array], &mut self.values[begin..])?;
                    self.references.push(element.array);
                    begins.insert(element.array, begin);
                    begin
                }
            };
            self.moving.push((begin + element.index, i));
        }
        Ok(())
    }
}

/// Returns an error if fmi3DoStep has not simulated the whole step, although the host had not
/// allowed early return. `done` is the result of fmi3DoStep.
fn require_whole_step(instance: &Instance, done: Step) -> Called {
    let time = done.last_time;
    let (status, mut messages, text) = if done.terminate == 1 {
        // FMI 2.0 reports this by the status fmi2Discard.
        let text = format!("it asks for the end of the simulation at t = {time} s");
        (Status::Discard, instance.take_messages(), text)
    } else if done.early_return == 1 {
        let text = format!(
            "it returns early, at t = {time} s, although the host does not allow early returns"
        );
        (Status::Error, Vec::new(), text)
    } else {
        return Ok(());
    };
    messages.push(Message { status, category: String::new(), text });
    Err(CallError { call: "fmi3DoStep", status, messages })
}

//! The FMI 3.0 C ABI, seen from the host: loads an unpacked FMU and turns its C functions into safe calls whose
//! errors carry the FMU's own words, for co-simulation with or without event mode, early return and intermediate
//! update, and for model exchange. What only scheduled execution needs is not here.
#![allow(unsafe_code)]

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::slice;

use anyhow::{Context, Result, bail};
use libloading::Library;

use crate::c_abi::{
    self, CallError, Called, Environment, Loaded, Message, Status, functions, log_message,
};
use crate::description::{CType, ModelDescription, Type, Value, Variable};
use crate::guard::Calls;
use crate::temporary;

/// Folder of the binaries for the platform this program was built for (FMI 3.0.2, section 2.5.1.4.1).
pub const PLATFORM: &str = if cfg!(target_os = "windows") {
    if cfg!(target_arch = "aarch64") {
        "aarch64-windows"
    } else if cfg!(target_pointer_width = "64") {
        "x86_64-windows"
    } else {
        "x86-windows"
    }
} else if cfg!(target_os = "macos") {
    if cfg!(target_arch = "aarch64") { "aarch64-darwin" } else { "x86_64-darwin" }
} else if cfg!(target_arch = "aarch64") {
    "aarch64-linux"
} else if cfg!(target_pointer_width = "64") {
    "x86_64-linux"
} else {
    "x86-linux"
};

// ---------------------------------------------------------------- C types

type Component = *mut c_void;
type State = *mut c_void;
type Refs = *const u32;
/// `fmi3Boolean`, a byte; one that is neither 0 nor 1 must not become a `bool`.
type Byte = u8;
type Call = unsafe extern "C" fn(Component) -> c_int;
type Get<T> = unsafe extern "C" fn(Component, Refs, usize, *mut T, usize) -> c_int;
type Set<T> = unsafe extern "C" fn(Component, Refs, usize, *const T, usize) -> c_int;
type GetVector = unsafe extern "C" fn(Component, *mut f64, usize) -> c_int;
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

// What of the functions every FMU has this host calls (FMI 3.0.2, section 2.5: all 75 are exported).
functions! { Functions:
    get_version "fmi3GetVersion" unsafe extern "C" fn() -> *const c_char;
    set_debug_logging "fmi3SetDebugLogging" unsafe extern "C" fn(Component, Byte, usize, *const *const c_char) -> c_int;
    free_instance "fmi3FreeInstance" unsafe extern "C" fn(Component);
    enter_initialization_mode "fmi3EnterInitializationMode" unsafe extern "C" fn(Component, Byte, f64, f64, Byte, f64) -> c_int;
    exit_initialization_mode "fmi3ExitInitializationMode" Call;
    terminate "fmi3Terminate" Call;
    reset "fmi3Reset" Call;
    get_float32 "fmi3GetFloat32" Get<f32>;
    get_float64 "fmi3GetFloat64" Get<f64>;
    get_int8 "fmi3GetInt8" Get<i8>;
    get_uint8 "fmi3GetUInt8" Get<u8>;
    get_int16 "fmi3GetInt16" Get<i16>;
    get_uint16 "fmi3GetUInt16" Get<u16>;
    get_int32 "fmi3GetInt32" Get<i32>;
    get_uint32 "fmi3GetUInt32" Get<u32>;
    get_int64 "fmi3GetInt64" Get<i64>;
    get_uint64 "fmi3GetUInt64" Get<u64>;
    get_boolean "fmi3GetBoolean" Get<Byte>;
    get_string "fmi3GetString" Get<*const c_char>;
    set_float32 "fmi3SetFloat32" Set<f32>;
    set_float64 "fmi3SetFloat64" Set<f64>;
    set_int8 "fmi3SetInt8" Set<i8>;
    set_uint8 "fmi3SetUInt8" Set<u8>;
    set_int16 "fmi3SetInt16" Set<i16>;
    set_uint16 "fmi3SetUInt16" Set<u16>;
    set_int32 "fmi3SetInt32" Set<i32>;
    set_uint32 "fmi3SetUInt32" Set<u32>;
    set_int64 "fmi3SetInt64" Set<i64>;
    set_uint64 "fmi3SetUInt64" Set<u64>;
    set_boolean "fmi3SetBoolean" Set<Byte>;
    set_string "fmi3SetString" Set<*const c_char>;
    get_fmu_state "fmi3GetFMUState" unsafe extern "C" fn(Component, *mut State) -> c_int;
    set_fmu_state "fmi3SetFMUState" unsafe extern "C" fn(Component, State) -> c_int;
    free_fmu_state "fmi3FreeFMUState" unsafe extern "C" fn(Component, *mut State) -> c_int;
    serialized_fmu_state_size "fmi3SerializedFMUStateSize" unsafe extern "C" fn(Component, State, *mut usize) -> c_int;
    serialize_fmu_state "fmi3SerializeFMUState" unsafe extern "C" fn(Component, State, *mut u8, usize) -> c_int;
    deserialize_fmu_state "fmi3DeserializeFMUState" unsafe extern "C" fn(Component, *const u8, usize, *mut State) -> c_int;
    get_directional_derivative "fmi3GetDirectionalDerivative" Derivative;
    get_adjoint_derivative "fmi3GetAdjointDerivative" Derivative;
    number_of_dependencies "fmi3GetNumberOfVariableDependencies" unsafe extern "C" fn(Component, u32, *mut usize) -> c_int;
    dependencies "fmi3GetVariableDependencies" unsafe extern "C" fn(Component, u32, *mut usize, *mut u32, *mut usize, *mut c_int, usize) -> c_int;
    enter_configuration_mode "fmi3EnterConfigurationMode" Call;
    exit_configuration_mode "fmi3ExitConfigurationMode" Call;
    enter_event_mode "fmi3EnterEventMode" Call;
    update_discrete_states "fmi3UpdateDiscreteStates" unsafe extern "C" fn(Component, *mut Byte, *mut Byte, *mut Byte, *mut Byte, *mut Byte, *mut f64) -> c_int;
}

// What a co-simulation FMU is called by besides.
functions! { StepFunctions:
    instantiate "fmi3InstantiateCoSimulation" unsafe extern "C" fn(*const c_char, *const c_char, *const c_char, Byte, Byte, Byte, Byte, Refs, usize, *mut c_void, Option<LogMessage>, Option<Intermediate>) -> Component;
    enter_step_mode "fmi3EnterStepMode" Call;
    get_output_derivatives "fmi3GetOutputDerivatives" unsafe extern "C" fn(Component, Refs, usize, *const i32, *mut f64, usize) -> c_int;
    do_step "fmi3DoStep" unsafe extern "C" fn(Component, f64, f64, Byte, *mut Byte, *mut Byte, *mut Byte, *mut f64) -> c_int;
}

// What a model exchange FMU is called by besides.
functions! { ExchangeFunctions:
    instantiate "fmi3InstantiateModelExchange" unsafe extern "C" fn(*const c_char, *const c_char, *const c_char, Byte, Byte, *mut c_void, Option<LogMessage>) -> Component;
    enter_continuous_time_mode "fmi3EnterContinuousTimeMode" Call;
    completed_integrator_step "fmi3CompletedIntegratorStep" unsafe extern "C" fn(Component, Byte, *mut Byte, *mut Byte) -> c_int;
    set_time "fmi3SetTime" unsafe extern "C" fn(Component, f64) -> c_int;
    set_continuous_states "fmi3SetContinuousStates" unsafe extern "C" fn(Component, *const f64, usize) -> c_int;
    get_derivatives "fmi3GetContinuousStateDerivatives" GetVector;
    get_event_indicators "fmi3GetEventIndicators" GetVector;
    get_continuous_states "fmi3GetContinuousStates" GetVector;
    get_nominals "fmi3GetNominalsOfContinuousStates" GetVector;
    number_of_event_indicators "fmi3GetNumberOfEventIndicators" Count;
    number_of_continuous_states "fmi3GetNumberOfContinuousStates" Count;
}

/// Names of the functions that an FMU exports and this host never calls.
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

/// A C type in which a variable's values are exchanged.
pub trait Exchanged: Copy + Default {
    /// Names of the functions that get and set.
    const CALLS: [&'static str; 2];
    #[doc(hidden)]
    #[allow(private_interfaces)]
    fn calls(functions: &Functions) -> (Get<Self>, Set<Self>);
}

macro_rules! exchanged {
    ($($type:ty, $get:ident $set:ident, $get_name:literal $set_name:literal;)*) => {$(
        impl Exchanged for $type {
            const CALLS: [&'static str; 2] = [$get_name, $set_name];
            #[allow(private_interfaces)]
            fn calls(functions: &Functions) -> (Get<Self>, Set<Self>) {
                (functions.$get, functions.$set)
            }
        }
    )*};
}

exchanged! {
    f32, get_float32 set_float32, "fmi3GetFloat32" "fmi3SetFloat32";
    f64, get_float64 set_float64, "fmi3GetFloat64" "fmi3SetFloat64";
    i8, get_int8 set_int8, "fmi3GetInt8" "fmi3SetInt8";
    u8, get_uint8 set_uint8, "fmi3GetUInt8" "fmi3SetUInt8";
    i16, get_int16 set_int16, "fmi3GetInt16" "fmi3SetInt16";
    u16, get_uint16 set_uint16, "fmi3GetUInt16" "fmi3SetUInt16";
    i32, get_int32 set_int32, "fmi3GetInt32" "fmi3SetInt32";
    u32, get_uint32 set_uint32, "fmi3GetUInt32" "fmi3SetUInt32";
    i64, get_int64 set_int64, "fmi3GetInt64" "fmi3SetInt64";
    u64, get_uint64 set_uint64, "fmi3GetUInt64" "fmi3SetUInt64";
}

// ---------------------------------------------------------------- callbacks

/// What happens within the steps of an instance.
struct Stepping {
    component: Cell<Component>,
    functions: *const Functions,
    /// Alive during one call of fmi3DoStep; NULL outside of it.
    within: Cell<*mut Within<'static>>,
    /// Calls of intermediateUpdate.
    updates: Cell<usize>,
    /// The pointer that the FMU hands back to intermediateUpdate.
    environment: *mut c_void,
}

thread_local! {
    /// The instance whose fmi3DoStep runs on this thread; NULL if none does.
    static STEPPING: Cell<*const Stepping> = const { Cell::new(null()) };
}

/// Hears of a point within a step, and says when to return early, if at all.
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
    // SAFETY: set for the duration of fmi3DoStep, which is on the stack now, on this thread. The pointer that the FMU
    // hands back is compared and never followed.
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
        // SAFETY: set for the duration of fmi3DoStep, too.
        if within.is_null() { None } else { unsafe { (*within)(&update) } }
    });
    // SAFETY: two places for the answers, if they are given.
    unsafe {
        if !early_return_requested.is_null() {
            *early_return_requested = answer.is_some().into();
        }
        if !early_return_time.is_null() {
            *early_return_time = answer.unwrap_or(time);
        }
    }
}

/// A point within a step, where the FMU has called intermediateUpdate (section 4.2.2).
pub struct Update<'a> {
    /// intermediateUpdateTime, s.
    pub time: f64,
    /// Inputs may be set.
    pub set_requested: bool,
    /// Variables may be read.
    pub get_allowed: bool,
    /// The solver has finished a step of its own.
    pub step_finished: bool,
    /// An early return may be asked for.
    pub can_return_early: bool,
    stepping: &'a Stepping,
}

impl Update<'_> {
    /// fmi3SetFloat64.
    pub fn set(&self, references: &[u32], values: &[f64]) -> Status {
        let n = references.len();
        // SAFETY: two slices of the lengths given; the FMU has called and expects such a call.
        let status = unsafe {
            ((*self.stepping.functions).set_float64)(
                self.stepping.component.get(),
                references.as_ptr(),
                n,
                values.as_ptr(),
                values.len(),
            )
        };
        status.into()
    }

    /// fmi3GetFloat64.
    pub fn get(&self, references: &[u32], values: &mut [f64]) -> Status {
        // SAFETY: as in set.
        let status = unsafe {
            ((*self.stepping.functions).get_float64)(
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

/// An FMU whose binary is loaded.
pub struct Fmu {
    description: ModelDescription,
    functions: Functions,
    stepping: Option<StepFunctions>,
    exchange: Option<ExchangeFunctions>,
    resources: Option<String>,
    hash: String,
    binary_hash: String,
    path: PathBuf,
    changed: Vec<&'static str>,
    /// All Reals are Float64 and scalar.
    is_plain: bool,
    /// References of those that are, in order.
    plain: Vec<u32>,
    /// Structural parameters that every instance of [`Fmu::instantiate`] begins with, by reference.
    structural: BTreeMap<u32, Value>,
    // dropped in this order: first the code, then the files
    library: Option<Library>,
    _directory: Option<temporary::Folder>,
}

impl Drop for Fmu {
    fn drop(&mut self) {
        let _calls = Calls::one();
        self.library = None;
    }
}

/// The interfaces that this host can drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interface {
    /// The FMU integrates.
    CoSimulation,
    /// The host integrates.
    ModelExchange,
}

impl Fmu {
    /// Loads the binary of an FMU that is unpacked in `directory`: that of Co-Simulation if there is one; errors
    /// speak of `path`. [`Fmu::hash`] is empty.
    pub fn load(directory: &Path, path: &Path) -> Result<Self> {
        Fmu::load_for(None, directory, path)
    }

    /// The same for one interface: the two may name different binaries.
    pub fn load_for(interface: Option<Interface>, directory: &Path, path: &Path) -> Result<Self> {
        let name = path.display();
        let text = std::fs::read_to_string(directory.join("modelDescription.xml"))
            .with_context(|| format!("modelDescription.xml in {name} cannot be read"))?;
        let description =
            ModelDescription::from_xml(&text).with_context(|| format!("{name} cannot be used"))?;
        drop(text);
        let stepping = description.co_simulation.as_ref().map(|i| &i.model_identifier);
        let exchange = description.model_exchange.as_ref().map(|i| &i.model_identifier);
        let identifier = match interface {
            None => stepping.or(exchange),
            Some(Interface::CoSimulation) => stepping,
            Some(Interface::ModelExchange) => exchange,
        };
        let identifier = identifier
            .with_context(|| format!("{name} offers neither co-simulation nor model exchange"))?;
        let Loaded { library, hash, changed, binary } =
            c_abi::load(directory, path, PLATFORM, identifier)?;
        let mut needed = Functions::SYMBOLS.to_vec();
        if stepping == Some(identifier) {
            needed.extend(StepFunctions::SYMBOLS);
        }
        if exchange == Some(identifier) {
            needed.extend(ExchangeFunctions::SYMBOLS);
        }
        let lacking = c_abi::lacking(&library, &needed);
        if !lacking.is_empty() {
            bail!("{binary} in {name} lacks {}", lacking.join(", "));
        }
        // SAFETY: the binary says it follows FMI 3.0, whose types are declared above; an FMU that offers one
        // interface may lack the other's functions, and nothing is wrong for this host.
        let (functions, stepping, exchange) = unsafe {
            (
                Functions::load(&library)
                    .with_context(|| format!("{binary} in {name} cannot be used"))?,
                StepFunctions::load(&library).ok(),
                ExchangeFunctions::load(&library).ok(),
            )
        };
        // with the separator at its end (section 2.3.1)
        let resources = directory.join("resources");
        let resources = resources
            .is_dir()
            .then(|| format!("{}{}", resources.display(), std::path::MAIN_SEPARATOR));
        let (is_plain, plain) = plain(&description);
        Ok(Fmu {
            is_plain,
            plain,
            structural: BTreeMap::new(),
            description,
            functions,
            stepping,
            exchange,
            resources,
            hash: String::new(),
            binary_hash: hash,
            path: path.to_path_buf(),
            changed,
            library: Some(library),
            _directory: None,
        })
    }

    /// The file it was opened from, whose hash is `hash`, and the folder in which it is unpacked.
    pub(crate) fn keep(&mut self, hash: String, directory: temporary::Folder) {
        self.hash = hash;
        self._directory = Some(directory);
    }

    /// Gives structural parameters other values than those that they start with: every instance of [`Fmu::instantiate`] sets
    /// them first, in configuration mode, and [`Fmu::description`] has the sizes that follow. Of arrays whose size has changed
    /// it has the start values that the FMU tells then. `text` is modelDescription.xml.
    ///
    /// # Errors
    /// If the FMU refuses one.
    pub(crate) fn configure(&mut self, text: &str, settings: &[(&str, &str)]) -> Result<()> {
        for (name, value) in settings {
            let variable = self.description.variable(name)?;
            let value = self.description.value(variable, value)?;
            let start = variable.attributes().start.as_deref().unwrap_or_default();
            // as declared: nothing is to be done
            match self.description.value(variable, start).is_ok_and(|start| start == value) {
                true => self.structural.remove(&variable.reference),
                false => self.structural.insert(variable.reference, value),
            };
        }
        // first: what is too large for the FMU may be too large for a description
        let mut instance = self.instantiate("sizes")?;
        let mut description = ModelDescription::from_xml_with(text, &self.structural)?;
        let mut starts = Vec::new();
        for (reference, array) in description.arrays().filter(|(_, array)| array.is_resized) {
            starts.push((reference, instance.values(array.c_type, reference, array.length)?));
        }
        drop(instance);
        for (array, values) in starts {
            description.set_starts(array, &values);
        }
        (self.is_plain, self.plain) = plain(&description);
        self.description = description;
        Ok(())
    }

    /// Model description of the FMU.
    pub fn description(&self) -> &ModelDescription {
        &self.description
    }

    /// SHA-256 of the `.fmu` file, in hexadecimal digits.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// SHA-256 of the binary that is loaded, in hexadecimal digits.
    pub fn binary_hash(&self) -> &str {
        &self.binary_hash
    }

    /// Returns true if these Reals can be exchanged in one call: all are Float64, none an element of an array.
    pub(crate) fn is_plain(&self, references: &[u32]) -> bool {
        self.is_plain || {
            let plain = |r: &u32| self.plain.binary_search(r).is_ok();
            references.iter().all(plain)
        }
    }

    /// Changes of the whole process by loading the binary, such as the rounding mode.
    pub fn changed(&self) -> &[&'static str] {
        &self.changed
    }

    /// The file it was opened from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the 75 functions that every FMU must export (section 2.5).
    pub fn symbols() -> Vec<&'static str> {
        let called = [Functions::SYMBOLS, StepFunctions::SYMBOLS, ExchangeFunctions::SYMBOLS];
        let called = called.into_iter().flatten().copied();
        called.chain(UNCALLED).collect()
    }

    /// Result of fmi3GetVersion.
    pub fn version(&self) -> String {
        // SAFETY: takes nothing, returns a constant string.
        unsafe { CStr::from_ptr((self.functions.get_version)()) }.to_string_lossy().into_owned()
    }

    /// The arguments of a plain instance, to be bent by tests of bad calls: no event mode, no early return, every
    /// input and output that may be exchanged within a step is required there if intermediate update is provided.
    pub fn instantiation<'a>(&'a self, name: &'a str) -> Instantiation<'a> {
        let stepping = self.description.co_simulation.as_ref();
        let updates = stepping.is_some_and(|cs| cs.can_interpolate_inputs);
        let mut required: Vec<u32> = self
            .description
            .variables
            .iter()
            .filter(|v| updates && v.intermediate && v.causality == "input")
            .map(|v| self.description.element(v.reference).map_or(v.reference, |e| e.array))
            .collect();
        required.dedup();
        Instantiation {
            name: Some(name),
            interface: match stepping {
                Some(_) => Interface::CoSimulation,
                None => Interface::ModelExchange,
            },
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

    /// A new co-simulation instance with logging on, in the sizes of the description.
    pub fn instantiate(&self, name: &str) -> Called<Instance<'_>> {
        let mut instance = self.instantiate_with(&self.instantiation(name))?;
        if !self.structural.is_empty() {
            instance.enter_configuration_mode()?;
            for (reference, value) in &self.structural {
                let of = |v: &&Variable| v.is_structural() && v.reference == *reference;
                if let Some(variable) = self.description.variables.iter().find(of) {
                    instance.set_values(variable.c_type(), *reference, slice::from_ref(value))?;
                }
            }
            instance.exit_configuration_mode()?;
        }
        Ok(instance)
    }

    /// Makes an instance with exactly these arguments.
    pub fn instantiate_with(&self, with: &Instantiation) -> Called<Instance<'_>> {
        let c_string = |text: Option<&str>| text.map(|t| CString::new(t).unwrap_or_default());
        let (name, token, resources) =
            (c_string(with.name), c_string(with.token), c_string(with.resources));
        let pointer = |text: &Option<CString>| text.as_ref().map_or(null(), |t| t.as_ptr());
        let environment = Environment::new();
        let stepping = Box::new(Stepping {
            environment: environment.pointer(),
            component: Cell::new(null_mut()),
            functions: &self.functions,
            within: Cell::new(null_mut::<Nobody>() as *mut Within<'static>),
            updates: Cell::new(0),
        });
        let logger = with.logger.then_some(log_message as LogMessage);
        let calls = Calls::one();
        environment.begin_call();
        let required = &with.required;
        // SAFETY: strings outlive the call, the environment the instance.
        let (call, component) = unsafe {
            match with.interface {
                Interface::CoSimulation => (
                    "fmi3InstantiateCoSimulation",
                    (self.stepping.as_ref().expect("the functions of co-simulation").instantiate)(
                        pointer(&name),
                        pointer(&token),
                        pointer(&resources),
                        0,
                        with.logging.into(),
                        with.event_mode.into(),
                        with.early_return.into(),
                        if required.is_empty() { null() } else { required.as_ptr() },
                        required.len(),
                        environment.pointer(),
                        logger,
                        with.intermediate_update.then_some(intermediate_update as Intermediate),
                    ),
                ),
                Interface::ModelExchange => (
                    "fmi3InstantiateModelExchange",
                    (self.exchange.as_ref().expect("the functions of model exchange").instantiate)(
                        pointer(&name),
                        pointer(&token),
                        pointer(&resources),
                        0,
                        with.logging.into(),
                        environment.pointer(),
                        logger,
                    ),
                ),
            }
        };
        calls.end();
        stepping.component.set(component);
        let instance = Instance {
            fmu: self,
            component,
            environment,
            stepping,
            warned: Cell::new(None),
            calls,
            arrays: RefCell::default(),
            one_thread: PhantomData,
        };
        if component.is_null() {
            let messages = instance.take_messages();
            return Err(CallError { call, status: Status::Error, messages });
        }
        Ok(instance)
    }

    /// For tests: fmi3FreeInstance(NULL), which does nothing.
    pub fn free_null_instance(&self) {
        // SAFETY: the standard allows NULL here (section 2.3.1).
        unsafe { (self.functions.free_instance)(null_mut()) }
    }
}

/// True if all Reals are scalar Float64, and the references of those that are, in order.
fn plain(description: &ModelDescription) -> (bool, Vec<u32>) {
    let reals = description.variables.iter().filter(|v| v.kind() == Type::Real);
    let (plain, others): (Vec<&Variable>, Vec<&Variable>) = reals
        .partition(|v| v.c_type() == CType::Float64 && description.element(v.reference).is_none());
    let mut plain: Vec<u32> = plain.iter().map(|v| v.reference).collect();
    plain.sort_unstable();
    (others.is_empty(), plain)
}

/// Somebody who hears of no point within a step: gives a NULL pointer its type.
type Nobody = fn(&Update) -> Option<f64>;

/// Arguments of fmi3InstantiateCoSimulation or fmi3InstantiateModelExchange; `None` becomes a NULL pointer.
#[derive(Clone, Debug)]
pub struct Instantiation<'a> {
    /// Instance name.
    pub name: Option<&'a str>,
    /// Interface type.
    pub interface: Interface,
    /// instantiationToken that the host expects.
    pub token: Option<&'a str>,
    /// Path of the unpacked resources folder.
    pub resources: Option<&'a str>,
    /// True if the FMU may log.
    pub logging: bool,
    /// eventModeUsed.
    pub event_mode: bool,
    /// earlyReturnAllowed.
    pub early_return: bool,
    /// True if the FMU gets the callback intermediateUpdate.
    pub intermediate_update: bool,
    /// requiredIntermediateVariables.
    pub required: Vec<u32>,
    /// True if the FMU gets the callback logMessage.
    pub logger: bool,
}

// ---------------------------------------------------------------- an instance

/// One instance of the FMU; freed when dropped. Belongs to the thread that made it.
pub struct Instance<'fmu> {
    fmu: &'fmu Fmu,
    component: Component,
    environment: Environment,
    stepping: Box<Stepping>,
    warned: Cell<Option<&'static str>>,
    calls: Calls,
    /// Values of the arrays of which elements were set, before they can be read.
    arrays: RefCell<BTreeMap<u32, Vec<Value>>>,
    one_thread: PhantomData<*mut ()>,
}

impl Drop for Instance<'_> {
    fn drop(&mut self) {
        if !self.component.is_null() {
            self.begin_call();
            // SAFETY: made by the FMU, freed here alone; the environment goes after it, because it may still log.
            unsafe { (self.fmu.functions.free_instance)(self.component) };
            self.calls.end();
        }
    }
}

/// A snapshot of an instance (`fmi3FMUState`). Must be given back with [`Instance::free_state`]; otherwise its
/// memory is lost.
pub struct FmuState(State);

/// Results of fmi3DoStep other than its status. Bytes as the FMU wrote them, or [`UNWRITTEN`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// eventHandlingNeeded.
    pub event: u8,
    /// terminateSimulation.
    pub terminate: u8,
    /// earlyReturn.
    pub early_return: u8,
    /// lastSuccessfulTime, s; NaN if it was not written.
    pub last_time: f64,
}

/// Value of a byte before the FMU writes to it: neither 0 nor 1.
pub const UNWRITTEN: u8 = 0xa5;

/// Results of fmi3UpdateDiscreteStates. Bytes as the FMU wrote them, or [`UNWRITTEN`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct EventInfo {
    pub needs_update: u8,
    pub terminate: u8,
    pub nominals_changed: u8,
    pub values_changed: u8,
    pub next_event_defined: u8,
    pub next_event_time: f64,
}

/// One dependency as fmi3GetVariableDependencies tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dependency {
    /// Element of the dependent, from 1; 0: all.
    pub element: usize,
    /// The independent.
    pub independent: u32,
    /// Element of the independent, from 1; 0: all.
    pub independent_element: usize,
    /// fmi3DependencyKind.
    pub kind: i32,
}

impl<'fmu> Instance<'fmu> {
    /// The FMU it is an instance of.
    pub fn fmu(&self) -> &'fmu Fmu {
        self.fmu
    }

    fn begin_call(&self) {
        self.environment.begin_call();
        self.calls.begin();
    }

    /// Everything logged since the last time somebody asked.
    pub fn take_messages(&self) -> Vec<Message> {
        self.environment.take()
    }

    /// Returns the FMU's warnings since the last call.
    pub fn take_warnings(&self) -> Vec<String> {
        let messages = self.take_messages().into_iter();
        let warnings = messages.filter(|message| message.status == Status::Warning);
        warnings.map(|message| message.text.trim().to_string()).collect()
    }

    /// Number of messages without a category (NULL).
    pub fn uncategorised(&self) -> usize {
        self.environment.uncategorised()
    }

    /// Number of calls of intermediateUpdate by the FMU.
    pub fn updates(&self) -> usize {
        self.stepping.updates.get()
    }

    /// The last call that returned fmi3Warning since somebody asked.
    pub fn take_warning(&self) -> Option<&'static str> {
        self.warned.take()
    }

    fn check(&self, call: &'static str, status: c_int) -> Called {
        self.calls.end();
        match Status::from(status) {
            Status::Ok => Ok(()),
            Status::Warning => {
                self.warned.set(Some(call));
                Ok(())
            }
            status => Err(CallError { call, status, messages: self.take_messages() }),
        }
    }

    fn functions(&self) -> &'fmu Functions {
        self.begin_call();
        &self.fmu.functions
    }

    fn stepping(&self) -> &'fmu StepFunctions {
        self.begin_call();
        self.fmu.stepping.as_ref().expect("the FMU exports the functions of co-simulation")
    }

    fn exchange(&self) -> &'fmu ExchangeFunctions {
        self.begin_call();
        self.fmu.exchange.as_ref().expect("the FMU exports the functions of model exchange")
    }

    /// A function that takes the instance alone.
    fn plain(&mut self, name: &'static str, function: Call) -> Called {
        self.begin_call();
        // SAFETY: plain call on a live instance.
        let status = unsafe { function(self.component) };
        self.check(name, status)
    }

    /// fmi3SetDebugLogging.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Called {
        let categories: Vec<CString> =
            categories.iter().map(|c| CString::new(*c).unwrap_or_default()).collect();
        let pointers: Vec<*const c_char> = categories.iter().map(|c| c.as_ptr()).collect();
        let start = if pointers.is_empty() { null() } else { pointers.as_ptr() };
        // SAFETY: pointers to strings that outlive the call.
        let status = unsafe {
            (self.functions().set_debug_logging)(self.component, on.into(), pointers.len(), start)
        };
        self.check("fmi3SetDebugLogging", status)
    }

    /// fmi3EnterInitializationMode: times in s; `tolerance` is relative.
    pub fn enter_initialization_mode(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Called {
        // SAFETY: plain values.
        let status = unsafe {
            (self.functions().enter_initialization_mode)(
                self.component,
                tolerance.is_some().into(),
                tolerance.unwrap_or(0.0),
                start,
                stop.is_some().into(),
                stop.unwrap_or(0.0),
            )
        };
        self.check("fmi3EnterInitializationMode", status)
    }

    /// fmi3ExitInitializationMode.
    pub fn exit_initialization_mode(&mut self) -> Called {
        self.plain("fmi3ExitInitializationMode", self.fmu.functions.exit_initialization_mode)
    }

    /// fmi3Terminate.
    pub fn terminate(&mut self) -> Called {
        self.plain("fmi3Terminate", self.fmu.functions.terminate)
    }

    /// fmi3Reset.
    pub fn reset(&mut self) -> Called {
        self.arrays.borrow_mut().clear();
        self.plain("fmi3Reset", self.fmu.functions.reset)
    }

    /// fmi3EnterConfigurationMode.
    pub fn enter_configuration_mode(&mut self) -> Called {
        self.plain("fmi3EnterConfigurationMode", self.fmu.functions.enter_configuration_mode)
    }

    /// fmi3ExitConfigurationMode.
    pub fn exit_configuration_mode(&mut self) -> Called {
        self.plain("fmi3ExitConfigurationMode", self.fmu.functions.exit_configuration_mode)
    }

    /// fmi3EnterEventMode.
    pub fn enter_event_mode(&mut self) -> Called {
        self.plain("fmi3EnterEventMode", self.fmu.functions.enter_event_mode)
    }

    /// fmi3EnterStepMode.
    pub fn enter_step_mode(&mut self) -> Called {
        let function = self.stepping().enter_step_mode;
        self.plain("fmi3EnterStepMode", function)
    }

    /// fmi3UpdateDiscreteStates.
    pub fn update_discrete_states(&mut self) -> Called<EventInfo> {
        let mut bytes = [UNWRITTEN; 5];
        let mut next = f64::NAN;
        let [update, terminate, nominals, values, defined] = &mut bytes;
        // SAFETY: places for the six answers.
        let status = unsafe {
            (self.functions().update_discrete_states)(
                self.component,
                update,
                terminate,
                nominals,
                values,
                defined,
                &mut next,
            )
        };
        let [needs_update, terminate, nominals_changed, values_changed, next_event_defined] = bytes;
        self.check("fmi3UpdateDiscreteStates", status).map(|()| EventInfo {
            needs_update,
            terminate,
            nominals_changed,
            values_changed,
            next_event_defined,
            next_event_time: next,
        })
    }

    /// fmi3DoStep from `time` by `step`, s; the past is never asked for again, and nobody hears of points within
    /// the step.
    pub fn do_step(&mut self, time: f64, step: f64) -> Called<Step> {
        self.do_step_hearing(time, step, None)
    }

    /// The same; `within` hears of the points within the step at which the FMU calls intermediateUpdate.
    pub fn do_step_hearing(
        &mut self,
        time: f64,
        step: f64,
        within: Option<&mut Within<'_>>,
    ) -> Called<Step> {
        if let Some(within) = within {
            let within: *mut Within<'_> = within;
            // SAFETY: the lifetime alone changes; the pointer is taken back before this function returns.
            let within =
                unsafe { std::mem::transmute::<*mut Within<'_>, *mut Within<'static>>(within) };
            self.stepping.within.set(within);
        }
        let mut bytes = [UNWRITTEN; 3];
        let mut last_time = f64::NAN;
        let [event, terminate, early_return] = &mut bytes;
        let before = STEPPING.replace(&raw const *self.stepping);
        // SAFETY: places for the four answers.
        let status = unsafe {
            (self.stepping().do_step)(
                self.component,
                time,
                step,
                1,
                event,
                terminate,
                early_return,
                &mut last_time,
            )
        };
        STEPPING.set(before);
        self.stepping.within.set(null_mut::<Nobody>() as *mut Within<'static>);
        let [event, terminate, early_return] = bytes;
        self.check("fmi3DoStep", status).map(|()| Step {
            event,
            terminate,
            early_return,
            last_time,
        })
    }

    // ------------------------------------------------ variables by reference

    /// fmi3Get… of the type of the values; `values` has room for all elements of all variables.
    pub fn fetch<T: Exchanged>(&mut self, references: &[u32], values: &mut [T]) -> Called {
        let (get, _) = T::calls(self.functions());
        // SAFETY: two slices of the lengths given.
        let status = unsafe {
            get(
                self.component,
                references.as_ptr(),
                references.len(),
                values.as_mut_ptr(),
                values.len(),
            )
        };
        self.check(T::CALLS[0], status)
    }

    /// fmi3Set… of the type of the values.
    pub fn give<T: Exchanged>(&mut self, references: &[u32], values: &[T]) -> Called {
        let (_, set) = T::calls(self.functions());
        // SAFETY: two slices of the lengths given.
        let status = unsafe {
            set(
                self.component,
                references.as_ptr(),
                references.len(),
                values.as_ptr(),
                values.len(),
            )
        };
        self.check(T::CALLS[1], status)
    }

    /// fmi3GetBoolean; the bytes, of which only 0 and 1 are proper.
    pub fn fetch_boolean(&mut self, references: &[u32], values: &mut [u8]) -> Called {
        // SAFETY: two slices of the lengths given.
        let status = unsafe {
            (self.functions().get_boolean)(
                self.component,
                references.as_ptr(),
                references.len(),
                values.as_mut_ptr(),
                values.len(),
            )
        };
        self.check("fmi3GetBoolean", status)
    }

    /// fmi3SetBoolean; the bytes, of which every non-zero one is true.
    pub fn give_boolean(&mut self, references: &[u32], values: &[u8]) -> Called {
        // SAFETY: two slices of the lengths given.
        let status = unsafe {
            (self.functions().set_boolean)(
                self.component,
                references.as_ptr(),
                references.len(),
                values.as_ptr(),
                values.len(),
            )
        };
        self.check("fmi3SetBoolean", status)
    }

    /// fmi3GetString of `count` values; the texts are copied, because the FMU's live only until the next call.
    pub fn fetch_string(&mut self, references: &[u32], count: usize) -> Called<Vec<String>> {
        let mut pointers: Vec<*const c_char> = vec![null(); count];
        // SAFETY: two slices of the lengths given.
        let status = unsafe {
            (self.functions().get_string)(
                self.component,
                references.as_ptr(),
                references.len(),
                pointers.as_mut_ptr(),
                count,
            )
        };
        self.check("fmi3GetString", status)?;
        let text = |p: *const c_char| match p.is_null() {
            true => String::new(),
            // SAFETY: the FMU answered OK, so it points to a terminated string of the FMU.
            false => unsafe { CStr::from_ptr(p) }.to_string_lossy().into_owned(),
        };
        Ok(pointers.into_iter().map(text).collect())
    }

    /// fmi3SetString.
    pub fn give_string(&mut self, references: &[u32], values: &[&str]) -> Called {
        let values: Vec<CString> =
            values.iter().map(|v| CString::new(*v).unwrap_or_default()).collect();
        let pointers: Vec<*const c_char> = values.iter().map(|v| v.as_ptr()).collect();
        // SAFETY: two slices of the lengths given, of strings that outlive the call.
        let status = unsafe {
            (self.functions().set_string)(
                self.component,
                references.as_ptr(),
                references.len(),
                pointers.as_ptr(),
                pointers.len(),
            )
        };
        self.check("fmi3SetString", status)
    }

    /// fmi3GetOutputDerivatives.
    pub fn output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Called {
        assert_eq!(references.len(), orders.len());
        // SAFETY: slices of the lengths given.
        let status = unsafe {
            (self.stepping().get_output_derivatives)(
                self.component,
                references.as_ptr(),
                references.len(),
                orders.as_ptr(),
                values.as_mut_ptr(),
                values.len(),
            )
        };
        self.check("fmi3GetOutputDerivatives", status)
    }

    /// fmi3GetDirectionalDerivative: the sensitivity of `count` elements of the unknowns for the seed, which has as
    /// many values as the knowns have elements.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        count: usize,
    ) -> Called<Vec<f64>> {
        let function = self.functions().get_directional_derivative;
        self.derivative("fmi3GetDirectionalDerivative", function, unknowns, knowns, seed, count)
    }

    /// fmi3GetAdjointDerivative: the sensitivity of `count` elements of the knowns for the seed, which has as many
    /// values as the unknowns have elements.
    pub fn adjoint_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        count: usize,
    ) -> Called<Vec<f64>> {
        let function = self.functions().get_adjoint_derivative;
        self.derivative("fmi3GetAdjointDerivative", function, unknowns, knowns, seed, count)
    }

    fn derivative(
        &mut self,
        name: &'static str,
        function: Derivative,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        count: usize,
    ) -> Called<Vec<f64>> {
        let mut answer = vec![f64::NAN; count];
        // SAFETY: slices of the lengths given.
        let status = unsafe {
            function(
                self.component,
                unknowns.as_ptr(),
                unknowns.len(),
                knowns.as_ptr(),
                knowns.len(),
                seed.as_ptr(),
                seed.len(),
                answer.as_mut_ptr(),
                count,
            )
        };
        self.check(name, status)?;
        Ok(answer)
    }

    /// fmi3GetVariableDependencies, as many as fmi3GetNumberOfVariableDependencies says.
    pub fn dependencies(&mut self, reference: u32) -> Called<Vec<Dependency>> {
        let mut count = 0;
        // SAFETY: a place for the answer.
        let status = unsafe {
            (self.functions().number_of_dependencies)(self.component, reference, &mut count)
        };
        self.check("fmi3GetNumberOfVariableDependencies", status)?;
        const MOST: usize = 1 << 20;
        let count = count.min(MOST);
        let (mut own, mut other) = (vec![0usize; count], vec![0usize; count]);
        let (mut independents, mut kinds) = (vec![0u32; count], vec![0 as c_int; count]);
        // SAFETY: four arrays of the length given.
        let status = unsafe {
            (self.functions().dependencies)(
                self.component,
                reference,
                own.as_mut_ptr(),
                independents.as_mut_ptr(),
                other.as_mut_ptr(),
                kinds.as_mut_ptr(),
                count,
            )
        };
        self.check("fmi3GetVariableDependencies", status)?;
        let one = |i: usize| Dependency {
            element: own[i],
            independent: independents[i],
            independent_element: other[i],
            kind: kinds[i],
        };
        Ok((0..count).map(one).collect())
    }

    // ------------------------------------------------ variables as the description has them

    /// All values of one variable or array by its value reference in the FMU.
    pub fn values(&mut self, c_type: CType, reference: u32, count: usize) -> Called<Vec<Value>> {
        fn all<T: Exchanged>(
            instance: &mut Instance,
            reference: u32,
            count: usize,
            value: impl Fn(T) -> Value,
        ) -> Called<Vec<Value>> {
            let mut values = vec![T::default(); count];
            instance.fetch(&[reference], &mut values)?;
            Ok(values.into_iter().map(value).collect())
        }
        let integer = Value::Integer;
        match c_type {
            CType::Float32 => all(self, reference, count, |x: f32| Value::Real(x.into())),
            CType::Float64 => all(self, reference, count, Value::Real),
            CType::Int8 => all(self, reference, count, |n: i8| integer(n.into())),
            CType::UInt8 => all(self, reference, count, |n: u8| integer(n.into())),
            CType::Int16 => all(self, reference, count, |n: i16| integer(n.into())),
            CType::UInt16 => all(self, reference, count, |n: u16| integer(n.into())),
            CType::Int32 => all(self, reference, count, |n: i32| integer(n.into())),
            CType::UInt32 => all(self, reference, count, |n: u32| integer(n.into())),
            CType::Int64 => all(self, reference, count, integer),
            // a number of more than 63 bits becomes the largest there is
            CType::UInt64 => {
                all(self, reference, count, |n: u64| integer(n.try_into().unwrap_or(i64::MAX)))
            }
            CType::Boolean => {
                let mut values = vec![0; count];
                self.fetch_boolean(&[reference], &mut values)?;
                Ok(values.into_iter().map(|byte| Value::Boolean(byte != 0)).collect())
            }
            CType::String => {
                let texts = self.fetch_string(&[reference], count)?;
                Ok(texts.into_iter().map(Value::String).collect())
            }
            // no values of these are exchanged: `ModelDescription::value` refuses them
            CType::Binary | CType::Clock => Ok(Vec::new()),
        }
    }

    /// Sets all values of one variable or array by its value reference in the FMU.
    pub fn set_values(&mut self, c_type: CType, reference: u32, values: &[Value]) -> Called {
        let real = |v: &Value| if let Value::Real(x) = v { *x } else { f64::NAN };
        let whole = |v: &Value| if let Value::Integer(n) = v { *n } else { 0 };
        macro_rules! give {
            ($type:ty) => {{
                // read within the type's bounds
                let values: Vec<$type> = values.iter().map(|v| whole(v) as $type).collect();
                self.give(&[reference], &values)
            }};
        }
        match c_type {
            CType::Float32 => {
                let values: Vec<f32> = values.iter().map(|v| real(v) as f32).collect();
                self.give(&[reference], &values)
            }
            CType::Float64 => {
                let values: Vec<f64> = values.iter().map(real).collect();
                self.give(&[reference], &values)
            }
            CType::Int8 => give!(i8),
            CType::UInt8 => give!(u8),
            CType::Int16 => give!(i16),
            CType::UInt16 => give!(u16),
            CType::Int32 => give!(i32),
            CType::UInt32 => give!(u32),
            CType::Int64 => give!(i64),
            CType::UInt64 => give!(u64),
            CType::Boolean => {
                let values: Vec<u8> =
                    values.iter().map(|v| u8::from(*v == Value::Boolean(true))).collect();
                self.give_boolean(&[reference], &values)
            }
            CType::String => {
                let text = |v: &'_ Value| match v {
                    Value::String(text) => text.clone(),
                    _ => String::new(),
                };
                let texts: Vec<String> = values.iter().map(text).collect();
                let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
                self.give_string(&[reference], &texts)
            }
            CType::Binary | CType::Clock => Ok(()),
        }
    }

    /// The value of a variable, or of an element of an array.
    pub fn value(&mut self, variable: &Variable) -> Called<Value> {
        let none = Value::String(String::new());
        let description = &self.fmu.description;
        let Some(element) = description.element(variable.reference) else {
            let mut values = self.values(variable.c_type(), variable.reference, 1)?;
            return Ok(values.pop().unwrap_or(none));
        };
        let length = description.array(element.array).map_or(0, |array| array.length);
        let values = self.values(variable.c_type(), element.array, length)?;
        Ok(values.into_iter().nth(element.index).unwrap_or(none))
    }

    /// Sets a variable, or an element of an array: the others keep what was set last, or their start values.
    pub fn set_value(&mut self, variable: &Variable, value: Value) -> Called {
        let description = &self.fmu.description;
        let Some(element) = description.element(variable.reference) else {
            return self.set_values(variable.c_type(), variable.reference, &[value]);
        };
        let mut values = match self.arrays.borrow_mut().remove(&element.array) {
            Some(values) => values,
            None => {
                let of_array = |v: &&Variable| {
                    description.element(v.reference).is_some_and(|e| e.array == element.array)
                };
                let all = description.variables.iter().filter(of_array);
                let start = |v: &Variable| {
                    let start = v.attributes().start.as_deref().unwrap_or("0");
                    description.value(v, start).unwrap_or(Value::Real(0.0))
                };
                all.map(start).collect()
            }
        };
        if let Some(place) = values.get_mut(element.index) {
            *place = value;
        }
        let set = self.set_values(variable.c_type(), element.array, &values);
        self.arrays.borrow_mut().insert(element.array, values);
        set
    }

    // ------------------------------------------------ snapshots

    /// fmi3GetFMUState into a new snapshot.
    pub fn get_state(&mut self) -> Called<FmuState> {
        let mut state = FmuState(null_mut());
        self.get_state_into(&mut state)?;
        Ok(state)
    }

    /// fmi3GetFMUState into a snapshot that is there already.
    pub fn get_state_into(&mut self, state: &mut FmuState) -> Called {
        // SAFETY: NULL or a handle from this FMU.
        let status = unsafe { (self.functions().get_fmu_state)(self.component, &mut state.0) };
        self.check("fmi3GetFMUState", status)
    }

    /// fmi3SetFMUState.
    pub fn set_state(&mut self, state: &FmuState) -> Called {
        // SAFETY: a handle from this FMU.
        let status = unsafe { (self.functions().set_fmu_state)(self.component, state.0) };
        self.check("fmi3SetFMUState", status)
    }

    /// fmi3FreeFMUState.
    pub fn free_state(&mut self, mut state: FmuState) -> Called {
        // SAFETY: a handle from this FMU, gone after this call.
        let status = unsafe { (self.functions().free_fmu_state)(self.component, &mut state.0) };
        self.check("fmi3FreeFMUState", status)
    }

    /// fmi3FreeFMUState with a pointer to NULL, which must be fine.
    pub fn free_state_null(&mut self) -> Called {
        self.free_state(FmuState(null_mut()))
    }

    /// fmi3SerializeFMUState.
    pub fn serialize(&mut self, state: &FmuState) -> Called<Vec<u8>> {
        let mut size = 0;
        // SAFETY: a handle from this FMU, a place for the size.
        let status = unsafe {
            (self.functions().serialized_fmu_state_size)(self.component, state.0, &mut size)
        };
        self.check("fmi3SerializedFMUStateSize", status)?;
        let mut bytes = vec![0u8; size];
        // SAFETY: `size` bytes are there.
        let status = unsafe {
            (self.functions().serialize_fmu_state)(
                self.component,
                state.0,
                bytes.as_mut_ptr(),
                size,
            )
        };
        self.check("fmi3SerializeFMUState", status)?;
        Ok(bytes)
    }

    /// fmi3DeserializeFMUState.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Called<FmuState> {
        let mut state = FmuState(null_mut());
        // SAFETY: `bytes.len()` bytes are there.
        let status = unsafe {
            (self.functions().deserialize_fmu_state)(
                self.component,
                bytes.as_ptr(),
                bytes.len(),
                &mut state.0,
            )
        };
        self.check("fmi3DeserializeFMUState", status)?;
        Ok(state)
    }

    // ------------------------------------------------ model exchange

    /// fmi3EnterContinuousTimeMode. As all calls of this section it panics when the FMU does not have it.
    pub fn enter_continuous_time_mode(&mut self) -> Called {
        let function = self.exchange().enter_continuous_time_mode;
        self.plain("fmi3EnterContinuousTimeMode", function)
    }

    /// fmi3CompletedIntegratorStep: enterEventMode, terminateSimulation.
    pub fn completed_integrator_step(&mut self) -> Called<(bool, bool)> {
        let (mut enter, mut terminate) = (0, 0);
        // SAFETY: places for the answers.
        let status = unsafe {
            (self.exchange().completed_integrator_step)(
                self.component,
                1,
                &mut enter,
                &mut terminate,
            )
        };
        self.check("fmi3CompletedIntegratorStep", status).map(|()| (enter != 0, terminate != 0))
    }

    /// fmi3SetTime, s.
    pub fn set_time(&mut self, time: f64) -> Called {
        // SAFETY: plain value on a live instance.
        let status = unsafe { (self.exchange().set_time)(self.component, time) };
        self.check("fmi3SetTime", status)
    }

    /// fmi3GetNumberOfContinuousStates.
    pub fn number_of_states(&mut self) -> Called<usize> {
        let function = self.exchange().number_of_continuous_states;
        self.count("fmi3GetNumberOfContinuousStates", function)
    }

    /// fmi3GetNumberOfEventIndicators.
    pub fn number_of_indicators(&mut self) -> Called<usize> {
        let function = self.exchange().number_of_event_indicators;
        self.count("fmi3GetNumberOfEventIndicators", function)
    }

    fn count(&mut self, name: &'static str, function: Count) -> Called<usize> {
        let mut count = 0;
        // SAFETY: a place for the answer.
        let status = unsafe { function(self.component, &mut count) };
        self.check(name, status).map(|()| count)
    }

    fn vector(&mut self, name: &'static str, function: GetVector, x: &mut [f64]) -> Called {
        // SAFETY: a slice of the length given.
        let status = unsafe { function(self.component, x.as_mut_ptr(), x.len()) };
        self.check(name, status)
    }

    /// fmi3SetContinuousStates.
    pub fn set_continuous_states(&mut self, x: &[f64]) -> Called {
        // SAFETY: a slice of the length given.
        let status =
            unsafe { (self.exchange().set_continuous_states)(self.component, x.as_ptr(), x.len()) };
        self.check("fmi3SetContinuousStates", status)
    }

    /// fmi3GetContinuousStates.
    pub fn continuous_states(&mut self, x: &mut [f64]) -> Called {
        let function = self.exchange().get_continuous_states;
        self.vector("fmi3GetContinuousStates", function, x)
    }

    /// fmi3GetContinuousStateDerivatives.
    pub fn derivatives(&mut self, dx: &mut [f64]) -> Called {
        let function = self.exchange().get_derivatives;
        self.vector("fmi3GetContinuousStateDerivatives", function, dx)
    }

    /// fmi3GetEventIndicators.
    pub fn event_indicators(&mut self, z: &mut [f64]) -> Called {
        let function = self.exchange().get_event_indicators;
        self.vector("fmi3GetEventIndicators", function, z)
    }

    /// fmi3GetNominalsOfContinuousStates.
    pub fn nominals(&mut self, x: &mut [f64]) -> Called {
        let function = self.exchange().get_nominals;
        self.vector("fmi3GetNominalsOfContinuousStates", function, x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_fmu_of_fmi_3_exports_75_functions() {
        let mut all = Fmu::symbols();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 75);
    }
}

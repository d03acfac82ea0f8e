//! The FMI 2.0 C ABI, seen from the host: opens a packed `.fmu`, loads its binary
//! and turns the 34 C functions of co-simulation into safe calls whose errors carry
//! the FMU's own words; those of model exchange too, where the FMU has them.
//!
//! Unsafe code of the harness is here, in `c_abi.rs`, `fmi3.rs` and `harness/batch/src/abi.rs` (`tests/architecture.rs`).
#![allow(unsafe_code)]

use std::cell::Cell;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::sync::Once;

use anyhow::{Context, Result, bail};
use libloading::Library;

use crate::archive::Archive;
use crate::c_abi::{self, Environment, Loaded, functions};
pub use crate::c_abi::{CallError, Called, HostState, Message, Status};
use crate::description::{ModelDescription, Type, Value, Variable};
use crate::guard::Calls;
use crate::temporary;

pub mod guarded;

/// Folder of the binaries for the platform this program was built for (FMI 2.0.5, section 2.3): 32 and
/// 64 stand for x86, other processors have the platform tuples of FMI 3.0. On macOS darwin64 is for
/// both processors, for hosts look there on both and one universal binary serves them.
pub const PLATFORM: &str = if cfg!(all(target_os = "windows", target_arch = "aarch64")) {
    "aarch64-windows"
} else if cfg!(target_os = "windows") {
    if cfg!(target_pointer_width = "64") { "win64" } else { "win32" }
} else if cfg!(target_os = "macos") {
    "darwin64"
} else if cfg!(target_arch = "aarch64") {
    "aarch64-linux"
} else if cfg!(target_pointer_width = "64") {
    "linux64"
} else {
    "linux32"
};

// ---------------------------------------------------------------- C types

type Component = *mut c_void;
type State = *mut c_void;

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

/// `fmi2CallbackFunctions`.
#[repr(C)]
struct CallbackFunctions {
    logger: Option<Logger>,
    allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    step_finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    environment: *mut c_void,
}

type Real = f64;
type Refs = *const u32;
type Call = unsafe extern "C" fn(Component) -> c_int;
type Get<T> = unsafe extern "C" fn(Component, Refs, usize, *mut T) -> c_int;
type Set<T> = unsafe extern "C" fn(Component, Refs, usize, *const T) -> c_int;
type GetVector = unsafe extern "C" fn(Component, *mut Real, usize) -> c_int;
type GetStatus<T> = unsafe extern "C" fn(Component, c_int, *mut T) -> c_int;

// What every FMU must export.
functions! { Functions:
    get_types_platform "fmi2GetTypesPlatform" unsafe extern "C" fn() -> *const c_char;
    get_version "fmi2GetVersion" unsafe extern "C" fn() -> *const c_char;
    set_debug_logging "fmi2SetDebugLogging" unsafe extern "C" fn(Component, c_int, usize, *const *const c_char) -> c_int;
    instantiate "fmi2Instantiate" unsafe extern "C" fn(*const c_char, c_int, *const c_char, *const c_char, *const CallbackFunctions, c_int, c_int) -> Component;
    free_instance "fmi2FreeInstance" unsafe extern "C" fn(Component);
    setup_experiment "fmi2SetupExperiment" unsafe extern "C" fn(Component, c_int, Real, Real, c_int, Real) -> c_int;
    enter_initialization_mode "fmi2EnterInitializationMode" Call;
    exit_initialization_mode "fmi2ExitInitializationMode" Call;
    terminate "fmi2Terminate" Call;
    reset "fmi2Reset" Call;
    get_real "fmi2GetReal" Get<Real>;
    get_integer "fmi2GetInteger" Get<c_int>;
    get_boolean "fmi2GetBoolean" Get<c_int>;
    get_string "fmi2GetString" Get<*const c_char>;
    set_real "fmi2SetReal" Set<Real>;
    set_integer "fmi2SetInteger" Set<c_int>;
    set_boolean "fmi2SetBoolean" Set<c_int>;
    set_string "fmi2SetString" Set<*const c_char>;
    get_fmu_state "fmi2GetFMUstate" unsafe extern "C" fn(Component, *mut State) -> c_int;
    set_fmu_state "fmi2SetFMUstate" unsafe extern "C" fn(Component, State) -> c_int;
    free_fmu_state "fmi2FreeFMUstate" unsafe extern "C" fn(Component, *mut State) -> c_int;
    serialized_fmu_state_size "fmi2SerializedFMUstateSize" unsafe extern "C" fn(Component, State, *mut usize) -> c_int;
    serialize_fmu_state "fmi2SerializeFMUstate" unsafe extern "C" fn(Component, State, *mut c_char, usize) -> c_int;
    deserialize_fmu_state "fmi2DeSerializeFMUstate" unsafe extern "C" fn(Component, *const c_char, usize, *mut State) -> c_int;
    get_directional_derivative "fmi2GetDirectionalDerivative" unsafe extern "C" fn(Component, Refs, usize, Refs, usize, *const Real, *mut Real) -> c_int;
}

// What a co-simulation FMU must export besides.
functions! { StepFunctions:
    set_real_input_derivatives "fmi2SetRealInputDerivatives" unsafe extern "C" fn(Component, Refs, usize, *const c_int, *const Real) -> c_int;
    get_real_output_derivatives "fmi2GetRealOutputDerivatives" unsafe extern "C" fn(Component, Refs, usize, *const c_int, *mut Real) -> c_int;
    do_step "fmi2DoStep" unsafe extern "C" fn(Component, Real, Real, c_int) -> c_int;
    cancel_step "fmi2CancelStep" Call;
    get_status "fmi2GetStatus" GetStatus<c_int>;
    get_real_status "fmi2GetRealStatus" GetStatus<Real>;
    get_integer_status "fmi2GetIntegerStatus" GetStatus<c_int>;
    get_boolean_status "fmi2GetBooleanStatus" GetStatus<c_int>;
    get_string_status "fmi2GetStringStatus" GetStatus<*const c_char>;
}

// What a model exchange FMU must export besides.
functions! { ExchangeFunctions:
    enter_event_mode "fmi2EnterEventMode" Call;
    new_discrete_states "fmi2NewDiscreteStates" unsafe extern "C" fn(Component, *mut EventInfo) -> c_int;
    enter_continuous_time_mode "fmi2EnterContinuousTimeMode" Call;
    completed_integrator_step "fmi2CompletedIntegratorStep" unsafe extern "C" fn(Component, c_int, *mut c_int, *mut c_int) -> c_int;
    set_time "fmi2SetTime" unsafe extern "C" fn(Component, Real) -> c_int;
    set_continuous_states "fmi2SetContinuousStates" unsafe extern "C" fn(Component, *const Real, usize) -> c_int;
    get_derivatives "fmi2GetDerivatives" GetVector;
    get_event_indicators "fmi2GetEventIndicators" GetVector;
    get_continuous_states "fmi2GetContinuousStates" GetVector;
    get_nominals "fmi2GetNominalsOfContinuousStates" GetVector;
}

/// `fmi2EventInfo`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct EventInfo {
    pub new_discrete_states_needed: c_int,
    pub terminate_simulation: c_int,
    pub nominals_changed: c_int,
    pub values_changed: c_int,
    pub next_event_time_defined: c_int,
    pub next_event_time: f64,
}

// ---------------------------------------------------------------- the FMU

/// An opened FMU: unpacked to a temporary directory, its binary loaded.
pub struct Fmu {
    description: ModelDescription,
    functions: Functions,
    stepping: Option<StepFunctions>,
    exchange: Option<ExchangeFunctions>,
    resources: String,
    hash: String,
    binary_hash: String,
    path: PathBuf,
    changed: Vec<&'static str>,
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

impl Fmu {
    /// Opens a packed FMU and loads the binary for this platform.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let name = path.display();
        let archive = Archive::open(path)?;
        let directory = temporary::Folder::new()?;
        archive.unpack(directory.path()).with_context(|| format!("{name} is not an FMU"))?;

        let mut fmu = Fmu::load(directory.path(), path)?;
        let description = &fmu.description;
        description.check_version().with_context(|| format!("{name} cannot be used"))?;
        if description.co_simulation.is_none() {
            bail!("{name} offers no co-simulation; this host drives nothing else");
        }
        fmu.hash = archive.hash().with_context(|| format!("{name} cannot be read"))?;
        fmu._directory = Some(directory);
        Ok(fmu)
    }

    /// Loads the binary of an FMU that is unpacked in `directory`, for co-simulation, model
    /// exchange or both; errors speak of `path`. [`Fmu::hash`] is empty.
    pub fn load(directory: &Path, path: &Path) -> Result<Self> {
        Fmu::load_binary(None, directory, path)
    }

    /// [`Fmu::load`] with the binary of one interface, [`CO_SIMULATION`] or [`MODEL_EXCHANGE`]:
    /// the two may name different ones.
    pub fn load_for(kind: i32, directory: &Path, path: &Path) -> Result<Self> {
        Fmu::load_binary(Some(kind), directory, path)
    }

    fn load_binary(kind: Option<i32>, directory: &Path, path: &Path) -> Result<Self> {
        let name = path.display();
        let xml = directory.join("modelDescription.xml");
        if !xml.exists() {
            bail!("{name} is not an FMU: it has no modelDescription.xml");
        }
        let text = std::fs::read_to_string(&xml)
            .with_context(|| format!("modelDescription.xml in {name} cannot be read"))?;
        let description =
            ModelDescription::from_xml(&text).with_context(|| format!("{name} cannot be used"))?;
        drop(text);
        let stepping = description.co_simulation.as_ref().map(|i| &i.model_identifier);
        let exchange = description.model_exchange.as_ref().map(|i| &i.model_identifier);
        let identifier = match kind {
            None => stepping.or(exchange),
            Some(CO_SIMULATION) => stepping,
            Some(_) => exchange,
        };
        let identifier = identifier
            .with_context(|| format!("{name} offers neither co-simulation nor model exchange"))?;
        let Loaded { library, hash, changed, binary } =
            c_abi::load(directory, path, PLATFORM, identifier)?;
        let mut needed = Functions::SYMBOLS.to_vec();
        if stepping == Some(identifier) {
            needed.extend(StepFunctions::SYMBOLS);
        }
        let lacking = c_abi::lacking(&library, &needed);
        if !lacking.is_empty() {
            bail!("{binary} in {name} lacks {}", lacking.join(", "));
        }
        // SAFETY: the binary says it follows FMI 2.0, whose types are declared above.
        let functions = unsafe { Functions::load(&library) }
            .with_context(|| format!("{binary} in {name} cannot be used"))?;
        // SAFETY: as above; an FMU of one interface lacks the other's, and nothing is wrong.
        let (stepping, exchange) =
            unsafe { (StepFunctions::load(&library).ok(), ExchangeFunctions::load(&library).ok()) };
        Ok(Fmu {
            description,
            functions,
            stepping,
            exchange,
            resources: format!("file://{}/resources", directory.display()),
            hash: String::new(),
            binary_hash: hash,
            path: path.to_path_buf(),
            changed,
            library: Some(library),
            _directory: None,
        })
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

    /// Changes of the whole process by loading the binary, such as the rounding mode.
    pub fn changed(&self) -> &[&'static str] {
        &self.changed
    }

    /// Returns true if the binary has all functions of Model Exchange.
    pub fn has_exchange(&self) -> bool {
        self.exchange.is_some()
    }

    /// The file it was opened from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Names of the 25 C functions every FMU must export.
    pub fn symbols() -> &'static [&'static str] {
        Functions::SYMBOLS
    }

    /// Names of the 9 C functions every co-simulation FMU must export besides.
    pub fn step_symbols() -> &'static [&'static str] {
        StepFunctions::SYMBOLS
    }

    /// Names of the 10 C functions every model exchange FMU must export besides.
    pub fn exchange_symbols() -> &'static [&'static str] {
        ExchangeFunctions::SYMBOLS
    }

    /// Result of fmi2GetVersion.
    pub fn version(&self) -> String {
        // SAFETY: takes nothing, returns a constant string.
        unsafe { CStr::from_ptr((self.functions.get_version)()) }.to_string_lossy().into_owned()
    }

    /// Result of fmi2GetTypesPlatform.
    pub fn types_platform(&self) -> String {
        // SAFETY: as above.
        unsafe { CStr::from_ptr((self.functions.get_types_platform)()) }
            .to_string_lossy()
            .into_owned()
    }

    /// A new co-simulation instance with logging on.
    pub fn instantiate(&self, name: &str) -> Result<Instance<'_>, CallError> {
        self.instantiate_with(&self.instantiation(name))
    }

    /// The same, at rest: [`ModelDescription::moving_starts`] are 0. What then moves was asked for.
    pub fn instantiate_at_rest(&self, name: &str) -> Result<Instance<'_>> {
        let mut instance = self.instantiate(name)?;
        for start in self.description.moving_starts() {
            instance.set(start, "0")?;
        }
        Ok(instance)
    }

    /// The arguments [`Fmu::instantiate`] uses, to be bent for tests of bad calls.
    pub fn instantiation<'a>(&'a self, name: &'a str) -> Instantiation<'a> {
        Instantiation {
            name: Some(name),
            kind: CO_SIMULATION,
            guid: Some(&self.description.guid),
            resources: Some(&self.resources),
            callbacks: Callbacks::Full,
            logging: true,
        }
    }

    /// Calls fmi2Instantiate with exactly these arguments.
    pub fn instantiate_with(&self, with: &Instantiation) -> Result<Instance<'_>, CallError> {
        const CALL: &str = "fmi2Instantiate";
        let c_string = |text: Option<&str>| text.map(|t| CString::new(t).unwrap_or_default());
        let (name, guid, resources) =
            (c_string(with.name), c_string(with.guid), c_string(with.resources));
        let pointer = |text: &Option<CString>| text.as_ref().map_or(null(), |t| t.as_ptr());
        static ONCE: Once = Once::new();
        // SAFETY: the function lives as long as the program.
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
        let calls = Calls::one();
        environment.begin_call();
        // SAFETY: strings and callbacks outlive the call; the callbacks outlive the instance.
        let component = unsafe {
            (self.functions.instantiate)(
                pointer(&name),
                with.kind,
                pointer(&guid),
                pointer(&resources),
                if with.callbacks == Callbacks::Null { null() } else { callbacks },
                0,
                with.logging.into(),
            )
        };
        calls.end();
        if with.callbacks == Callbacks::Fleeting {
            // SAFETY: made above, read by nobody any more.
            unsafe { callbacks.write_bytes(0, 1) };
        }
        // A NULL component never reaches the FMU again: Drop frees only the callbacks.
        let instance = Instance {
            fmu: self,
            component,
            environment,
            callbacks,
            warned: Cell::new(None),
            calls,
            one_thread: PhantomData,
        };
        if component.is_null() {
            let messages = instance.take_messages();
            return Err(CallError { call: CALL, status: Status::Error, messages });
        }
        Ok(instance)
    }

    /// For tests: fmi2FreeInstance(NULL), which does nothing.
    pub fn free_null_instance(&self) {
        // SAFETY: the standard allows NULL here (FMI 2.0.5, section 2.1.5).
        unsafe { (self.functions.free_instance)(null_mut()) }
    }

    /// For tests: what each function that takes an instance answers to NULL.
    pub fn calls_with_null_instance(&self) -> Vec<(&'static str, Status)> {
        let f = &self.functions;
        let c: Component = null_mut();
        let (mut i, mut x, mut n, mut s, mut t): (c_int, Real, usize, State, *const c_char) =
            (0, 0.0, 0, null_mut(), null());
        // SAFETY: the FMU must refuse a NULL instance before it touches anything else; every other
        // pointer is valid or comes with the length 0.
        let answers = unsafe {
            [
                ("fmi2SetDebugLogging", (f.set_debug_logging)(c, 0, 0, null())),
                ("fmi2SetupExperiment", (f.setup_experiment)(c, 0, 0.0, 0.0, 0, 0.0)),
                ("fmi2EnterInitializationMode", (f.enter_initialization_mode)(c)),
                ("fmi2ExitInitializationMode", (f.exit_initialization_mode)(c)),
                ("fmi2Terminate", (f.terminate)(c)),
                ("fmi2Reset", (f.reset)(c)),
                ("fmi2GetReal", (f.get_real)(c, null(), 0, null_mut())),
                ("fmi2GetInteger", (f.get_integer)(c, null(), 0, null_mut())),
                ("fmi2GetBoolean", (f.get_boolean)(c, null(), 0, null_mut())),
                ("fmi2GetString", (f.get_string)(c, null(), 0, null_mut())),
                ("fmi2SetReal", (f.set_real)(c, null(), 0, null())),
                ("fmi2SetInteger", (f.set_integer)(c, null(), 0, null())),
                ("fmi2SetBoolean", (f.set_boolean)(c, null(), 0, null())),
                ("fmi2SetString", (f.set_string)(c, null(), 0, null())),
                ("fmi2GetFMUstate", (f.get_fmu_state)(c, &mut s)),
                ("fmi2SetFMUstate", (f.set_fmu_state)(c, s)),
                ("fmi2FreeFMUstate", (f.free_fmu_state)(c, &mut s)),
                ("fmi2SerializedFMUstateSize", (f.serialized_fmu_state_size)(c, s, &mut n)),
                ("fmi2SerializeFMUstate", (f.serialize_fmu_state)(c, s, null_mut(), 0)),
                ("fmi2DeSerializeFMUstate", (f.deserialize_fmu_state)(c, null(), 0, &mut s)),
                (
                    "fmi2GetDirectionalDerivative",
                    (f.get_directional_derivative)(c, null(), 0, null(), 0, null(), null_mut()),
                ),
            ]
        };
        let mut answers = answers.to_vec();
        if let Some(f) = &self.stepping {
            // SAFETY: as above.
            answers.extend(unsafe {
                [
                    (
                        "fmi2SetRealInputDerivatives",
                        (f.set_real_input_derivatives)(c, null(), 0, null(), null()),
                    ),
                    (
                        "fmi2GetRealOutputDerivatives",
                        (f.get_real_output_derivatives)(c, null(), 0, null(), null_mut()),
                    ),
                    ("fmi2DoStep", (f.do_step)(c, 0.0, 1.0, 0)),
                    ("fmi2CancelStep", (f.cancel_step)(c)),
                    ("fmi2GetStatus", (f.get_status)(c, 0, &mut i)),
                    ("fmi2GetRealStatus", (f.get_real_status)(c, 2, &mut x)),
                    ("fmi2GetIntegerStatus", (f.get_integer_status)(c, 0, &mut i)),
                    ("fmi2GetBooleanStatus", (f.get_boolean_status)(c, 3, &mut i)),
                    ("fmi2GetStringStatus", (f.get_string_status)(c, 1, &mut t)),
                ]
            });
        }
        if let Some(f) = &self.exchange {
            // SAFETY: as above.
            answers.extend(unsafe {
                [
                    ("fmi2EnterEventMode", (f.enter_event_mode)(c)),
                    ("fmi2NewDiscreteStates", (f.new_discrete_states)(c, null_mut())),
                    ("fmi2EnterContinuousTimeMode", (f.enter_continuous_time_mode)(c)),
                    (
                        "fmi2CompletedIntegratorStep",
                        (f.completed_integrator_step)(c, 0, null_mut(), null_mut()),
                    ),
                    ("fmi2SetTime", (f.set_time)(c, 0.0)),
                    ("fmi2SetContinuousStates", (f.set_continuous_states)(c, null(), 0)),
                    ("fmi2GetDerivatives", (f.get_derivatives)(c, null_mut(), 0)),
                    ("fmi2GetEventIndicators", (f.get_event_indicators)(c, null_mut(), 0)),
                    ("fmi2GetContinuousStates", (f.get_continuous_states)(c, null_mut(), 0)),
                    ("fmi2GetNominalsOfContinuousStates", (f.get_nominals)(c, null_mut(), 0)),
                ]
            });
        }
        answers.into_iter().map(|(call, status)| (call, status.into())).collect()
    }
}

/// fmi2Type of an instance that the host integrates.
pub const MODEL_EXCHANGE: i32 = 0;
/// fmi2Type of an instance that integrates itself.
pub const CO_SIMULATION: i32 = 1;

/// Arguments of fmi2Instantiate; `None` becomes a NULL pointer.
#[derive(Clone, Debug)]
pub struct Instantiation<'a> {
    /// Instance name.
    pub name: Option<&'a str>,
    /// fmi2Type: [`CO_SIMULATION`] or [`MODEL_EXCHANGE`].
    pub kind: i32,
    /// GUID the host expects.
    pub guid: Option<&'a str>,
    /// URI of the unpacked resources folder.
    pub resources: Option<&'a str>,
    /// Callbacks for the FMU.
    pub callbacks: Callbacks,
    /// True if the FMU may log.
    pub logging: bool,
}

/// Callback functions for fmi2Instantiate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Callbacks {
    /// Logger and memory functions.
    Full,
    /// Like `Full`, with the struct wiped after fmi2Instantiate has returned: it is valid during
    /// that call alone.
    Fleeting,
    /// The logger alone; the memory functions are NULL.
    Logger,
    /// A struct whose members are all NULL.
    Empty,
    /// No struct at all.
    Null,
}

// ---------------------------------------------------------------- an instance

/// One instance of the FMU; freed when dropped. Belongs to the thread that made it.
pub struct Instance<'fmu> {
    fmu: &'fmu Fmu,
    component: Component,
    environment: Environment,
    callbacks: *mut CallbackFunctions,
    warned: Cell<Option<&'static str>>,
    calls: Calls,
    one_thread: PhantomData<*mut ()>,
}

impl Drop for Instance<'_> {
    fn drop(&mut self) {
        // SAFETY: made by fmi2Instantiate and Box::into_raw, freed here alone; the instance goes
        // first, because it may still log.
        unsafe {
            if !self.component.is_null() {
                (self.functions().free_instance)(self.component);
            }
            drop(Box::from_raw(self.callbacks));
        }
    }
}

/// A snapshot of an instance (`fmi2FMUstate`). Belongs to the instance it was taken from, and must
/// be given back to it with [`Instance::free_state`]; otherwise its memory is lost.
pub struct FmuState(State);

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

    /// The last call that returned fmi2Warning since somebody asked.
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

    /// fmi2SetDebugLogging.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Called {
        let categories: Vec<CString> =
            categories.iter().map(|c| CString::new(*c).unwrap_or_default()).collect();
        let pointers: Vec<*const c_char> = categories.iter().map(|c| c.as_ptr()).collect();
        // SAFETY: pointers to strings that outlive the call.
        let status = unsafe {
            (self.functions().set_debug_logging)(
                self.component,
                on.into(),
                pointers.len(),
                if pointers.is_empty() { null() } else { pointers.as_ptr() },
            )
        };
        self.check("fmi2SetDebugLogging", status)
    }

    /// fmi2SetupExperiment: times in s; `tolerance` is relative.
    pub fn setup_experiment(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Called {
        // SAFETY: plain values.
        let status = unsafe {
            (self.functions().setup_experiment)(
                self.component,
                tolerance.is_some().into(),
                tolerance.unwrap_or(0.0),
                start,
                stop.is_some().into(),
                stop.unwrap_or(0.0),
            )
        };
        self.check("fmi2SetupExperiment", status)
    }

    /// fmi2EnterInitializationMode.
    pub fn enter_initialization_mode(&mut self) -> Called {
        // SAFETY: plain call on a live instance; so are the next four.
        let status = unsafe { (self.functions().enter_initialization_mode)(self.component) };
        self.check("fmi2EnterInitializationMode", status)
    }

    /// fmi2ExitInitializationMode.
    pub fn exit_initialization_mode(&mut self) -> Called {
        // SAFETY: see above.
        let status = unsafe { (self.functions().exit_initialization_mode)(self.component) };
        self.check("fmi2ExitInitializationMode", status)
    }

    /// fmi2Terminate.
    pub fn terminate(&mut self) -> Called {
        // SAFETY: see above.
        let status = unsafe { (self.functions().terminate)(self.component) };
        self.check("fmi2Terminate", status)
    }

    /// fmi2Reset.
    pub fn reset(&mut self) -> Called {
        // SAFETY: see above.
        let status = unsafe { (self.functions().reset)(self.component) };
        self.check("fmi2Reset", status)
    }

    /// fmi2CancelStep.
    pub fn cancel_step(&mut self) -> Called {
        // SAFETY: see above.
        let status = unsafe { (self.stepping().cancel_step)(self.component) };
        self.check("fmi2CancelStep", status)
    }

    /// fmi2DoStep from `time` by `step`, s; the past is never asked for again.
    pub fn do_step(&mut self, time: f64, step: f64) -> Called {
        self.do_step_keeping(time, step, true)
    }

    /// fmi2DoStep, saying whether the past may still be asked for
    /// (noSetFMUStatePriorToCurrentPoint = `forget`).
    pub fn do_step_keeping(&mut self, time: f64, step: f64, forget: bool) -> Called {
        // SAFETY: plain values on a live instance.
        let status =
            unsafe { (self.stepping().do_step)(self.component, time, step, forget.into()) };
        self.check("fmi2DoStep", status)
    }

    // ------------------------------------------------ variables by reference

    /// One of the functions that write values into a slice.
    fn fetch<T>(
        &mut self,
        name: &'static str,
        function: Get<T>,
        references: &[u32],
        values: &mut [T],
    ) -> Called {
        assert_eq!(references.len(), values.len());
        self.begin_call();
        // SAFETY: two slices of the length given.
        let status = unsafe {
            function(self.component, references.as_ptr(), references.len(), values.as_mut_ptr())
        };
        self.check(name, status)
    }

    /// One of the functions that read values from a slice.
    fn give<T>(
        &mut self,
        name: &'static str,
        function: Set<T>,
        references: &[u32],
        values: &[T],
    ) -> Called {
        assert_eq!(references.len(), values.len());
        self.begin_call();
        // SAFETY: two slices of the length given.
        let status = unsafe {
            function(self.component, references.as_ptr(), references.len(), values.as_ptr())
        };
        self.check(name, status)
    }

    /// fmi2GetReal.
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Called {
        self.fetch("fmi2GetReal", self.fmu.functions.get_real, references, values)
    }

    /// fmi2SetReal.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Called {
        self.give("fmi2SetReal", self.fmu.functions.set_real, references, values)
    }

    /// fmi2GetInteger (enumerations too).
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Called {
        self.fetch("fmi2GetInteger", self.fmu.functions.get_integer, references, values)
    }

    /// fmi2SetInteger (enumerations too).
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Called {
        self.give("fmi2SetInteger", self.fmu.functions.set_integer, references, values)
    }

    /// fmi2GetBoolean; the C values, of which only 0 and 1 are proper.
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Called {
        self.fetch("fmi2GetBoolean", self.fmu.functions.get_boolean, references, values)
    }

    /// fmi2SetBoolean; the C values, of which every non-zero one is true.
    pub fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Called {
        self.give("fmi2SetBoolean", self.fmu.functions.set_boolean, references, values)
    }

    /// fmi2GetString; the texts are copied, because the FMU's live only until the next call.
    pub fn get_string(&mut self, references: &[u32]) -> Called<Vec<String>> {
        let mut pointers: Vec<*const c_char> = vec![null(); references.len()];
        let function = self.fmu.functions.get_string;
        self.fetch("fmi2GetString", function, references, &mut pointers)?;
        let text = |p: *const c_char| {
            if p.is_null() {
                return String::new();
            }
            // SAFETY: the FMU answered OK, so it points to a terminated string of the FMU.
            unsafe { CStr::from_ptr(p) }.to_string_lossy().into_owned()
        };
        Ok(pointers.into_iter().map(text).collect())
    }

    /// fmi2SetString.
    pub fn set_string(&mut self, references: &[u32], values: &[&str]) -> Called {
        let values: Vec<CString> =
            values.iter().map(|v| CString::new(*v).unwrap_or_default()).collect();
        let pointers: Vec<*const c_char> = values.iter().map(|v| v.as_ptr()).collect();
        self.give("fmi2SetString", self.fmu.functions.set_string, references, &pointers)
    }

    /// fmi2SetRealInputDerivatives.
    pub fn set_real_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Called {
        assert!(references.len() == orders.len() && orders.len() == values.len());
        // SAFETY: slices of the lengths given.
        let status = unsafe {
            (self.stepping().set_real_input_derivatives)(
                self.component,
                references.as_ptr(),
                references.len(),
                orders.as_ptr(),
                values.as_ptr(),
            )
        };
        self.check("fmi2SetRealInputDerivatives", status)
    }

    /// fmi2GetRealOutputDerivatives.
    pub fn get_real_output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Called {
        assert!(references.len() == orders.len() && orders.len() == values.len());
        // SAFETY: slices of the lengths given.
        let status = unsafe {
            (self.stepping().get_real_output_derivatives)(
                self.component,
                references.as_ptr(),
                references.len(),
                orders.as_ptr(),
                values.as_mut_ptr(),
            )
        };
        self.check("fmi2GetRealOutputDerivatives", status)
    }

    /// fmi2GetDirectionalDerivative: d(unknowns) for a change `change` of the knowns.
    pub fn get_directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        change: &[f64],
    ) -> Called<Vec<f64>> {
        assert_eq!(knowns.len(), change.len());
        let mut answer = vec![0.0; unknowns.len()];
        // SAFETY: slices of the lengths given.
        let status = unsafe {
            (self.functions().get_directional_derivative)(
                self.component,
                unknowns.as_ptr(),
                unknowns.len(),
                knowns.as_ptr(),
                knowns.len(),
                change.as_ptr(),
                answer.as_mut_ptr(),
            )
        };
        self.check("fmi2GetDirectionalDerivative", status)?;
        Ok(answer)
    }

    // ------------------------------------------------ variables by name

    /// The value of a variable.
    pub fn get(&mut self, name: &str) -> Result<Value> {
        Ok(self.value(self.fmu.description.variable(name)?)?)
    }

    /// The value of a variable of the description.
    pub fn value(&mut self, variable: &Variable) -> Called<Value> {
        let reference = [variable.reference];
        Ok(match variable.kind() {
            Type::Real => {
                let mut value = [0.0];
                self.get_real(&reference, &mut value)?;
                Value::Real(value[0])
            }
            Type::Integer | Type::Enumeration => {
                let mut value = [0];
                self.get_integer(&reference, &mut value)?;
                Value::Integer(value[0].into())
            }
            Type::Boolean => {
                let mut value = [0];
                self.get_boolean(&reference, &mut value)?;
                Value::Boolean(value[0] != 0)
            }
            // FMI 2.0 has no Binary and no Clock
            Type::String | Type::Binary | Type::Clock => {
                Value::String(self.get_string(&reference)?.remove(0))
            }
        })
    }

    /// Sets a variable of the description.
    pub fn set_value(&mut self, variable: &Variable, value: Value) -> Called {
        let reference = [variable.reference];
        match value {
            Value::Real(value) => self.set_real(&reference, &[value]),
            // read within 32 bits: `ModelDescription::value`
            Value::Integer(value) => self.set_integer(&reference, &[value as i32]),
            Value::Boolean(value) => self.set_boolean(&reference, &[value.into()]),
            Value::String(value) => self.set_string(&reference, &[&value]),
        }
    }

    /// The value of a real variable.
    pub fn real(&mut self, name: &str) -> Result<f64> {
        match self.get(name)? {
            Value::Real(value) => Ok(value),
            other => bail!("{name} is not a Real but {other:?}"),
        }
    }

    /// Sets a variable from text: a number, `true`/`false`, or an enumeration's value by name or
    /// number.
    pub fn set(&mut self, name: &str, text: &str) -> Result<()> {
        let description = &self.fmu.description;
        let variable = description.variable(name)?;
        let value = description.value(variable, text)?;
        self.set_value(variable, value).with_context(|| format!("{name}={text} was refused"))
    }

    // ------------------------------------------------ snapshots

    /// fmi2GetFMUstate into a new snapshot.
    pub fn get_state(&mut self) -> Called<FmuState> {
        let mut state = FmuState(null_mut());
        self.get_state_into(&mut state)?;
        Ok(state)
    }

    /// fmi2GetFMUstate into a snapshot that is there already.
    pub fn get_state_into(&mut self, state: &mut FmuState) -> Called {
        // SAFETY: NULL or a handle from this FMU.
        let status = unsafe { (self.functions().get_fmu_state)(self.component, &mut state.0) };
        self.check("fmi2GetFMUstate", status)
    }

    /// fmi2SetFMUstate.
    pub fn set_state(&mut self, state: &FmuState) -> Called {
        // SAFETY: a handle from this FMU.
        let status = unsafe { (self.functions().set_fmu_state)(self.component, state.0) };
        self.check("fmi2SetFMUstate", status)
    }

    /// fmi2FreeFMUstate.
    pub fn free_state(&mut self, mut state: FmuState) -> Called {
        // SAFETY: a handle from this FMU, gone after this call.
        let status = unsafe { (self.functions().free_fmu_state)(self.component, &mut state.0) };
        self.check("fmi2FreeFMUstate", status)
    }

    /// fmi2SerializeFMUstate.
    pub fn serialize(&mut self, state: &FmuState) -> Called<Vec<u8>> {
        let mut size = 0;
        // SAFETY: a handle from this FMU, a place for the size.
        let status = unsafe {
            (self.functions().serialized_fmu_state_size)(self.component, state.0, &mut size)
        };
        self.check("fmi2SerializedFMUstateSize", status)?;
        let mut bytes = vec![0u8; size];
        // SAFETY: `size` bytes are there.
        let status = unsafe {
            (self.functions().serialize_fmu_state)(
                self.component,
                state.0,
                bytes.as_mut_ptr().cast(),
                size,
            )
        };
        self.check("fmi2SerializeFMUstate", status)?;
        Ok(bytes)
    }

    /// fmi2DeSerializeFMUstate.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Called<FmuState> {
        let mut state = FmuState(null_mut());
        // SAFETY: `bytes.len()` bytes are there.
        let status = unsafe {
            (self.functions().deserialize_fmu_state)(
                self.component,
                bytes.as_ptr().cast(),
                bytes.len(),
                &mut state.0,
            )
        };
        self.check("fmi2DeSerializeFMUstate", status)?;
        Ok(state)
    }

    // ------------------------------------------------ status of an asynchronous step

    /// fmi2GetStatus, `kind` being an fmi2StatusKind.
    pub fn status(&mut self, kind: i32) -> Called<i32> {
        let mut value = 0;
        // SAFETY: a place for the answer; so in the next four.
        let status = unsafe { (self.stepping().get_status)(self.component, kind, &mut value) };
        self.check("fmi2GetStatus", status).map(|()| value)
    }

    /// fmi2GetRealStatus.
    pub fn real_status(&mut self, kind: i32) -> Called<f64> {
        let mut value = 0.0;
        // SAFETY: see status.
        let status = unsafe { (self.stepping().get_real_status)(self.component, kind, &mut value) };
        self.check("fmi2GetRealStatus", status).map(|()| value)
    }

    /// fmi2GetIntegerStatus.
    pub fn integer_status(&mut self, kind: i32) -> Called<i32> {
        let mut value = 0;
        // SAFETY: see status.
        let status =
            unsafe { (self.stepping().get_integer_status)(self.component, kind, &mut value) };
        self.check("fmi2GetIntegerStatus", status).map(|()| value)
    }

    /// fmi2GetBooleanStatus.
    pub fn boolean_status(&mut self, kind: i32) -> Called<bool> {
        let mut value = 0;
        // SAFETY: see status.
        let status =
            unsafe { (self.stepping().get_boolean_status)(self.component, kind, &mut value) };
        self.check("fmi2GetBooleanStatus", status).map(|()| value != 0)
    }

    /// fmi2GetStringStatus.
    pub fn string_status(&mut self, kind: i32) -> Called<String> {
        let mut value = null();
        // SAFETY: see status.
        let status =
            unsafe { (self.stepping().get_string_status)(self.component, kind, &mut value) };
        self.check("fmi2GetStringStatus", status)?;
        if value.is_null() {
            return Ok(String::new());
        }
        // SAFETY: the FMU answered OK, so it points to a terminated string of the FMU.
        Ok(unsafe { CStr::from_ptr(value) }.to_string_lossy().into_owned())
    }

    // ------------------------------------------------ model exchange

    /// The functions that every FMU has, for a call.
    fn functions(&self) -> &'fmu Functions {
        self.begin_call();
        &self.fmu.functions
    }

    fn stepping(&self) -> &'fmu StepFunctions {
        self.begin_call();
        let functions = self.fmu.stepping.as_ref();
        functions.expect("the FMU exports the functions of co-simulation")
    }

    fn exchange(&self) -> &'fmu ExchangeFunctions {
        self.begin_call();
        let functions = self.fmu.exchange.as_ref();
        functions.expect("the FMU exports the functions of model exchange")
    }

    /// fmi2EnterEventMode. As all calls of this section it panics when the FMU does not have it.
    pub fn enter_event_mode(&mut self) -> Called {
        // SAFETY: plain call on a live instance; so in enter_continuous_time_mode.
        let status = unsafe { (self.exchange().enter_event_mode)(self.component) };
        self.check("fmi2EnterEventMode", status)
    }

    /// fmi2EnterContinuousTimeMode.
    pub fn enter_continuous_time_mode(&mut self) -> Called {
        // SAFETY: see enter_event_mode.
        let status = unsafe { (self.exchange().enter_continuous_time_mode)(self.component) };
        self.check("fmi2EnterContinuousTimeMode", status)
    }

    /// fmi2NewDiscreteStates.
    pub fn new_discrete_states(&mut self) -> Called<EventInfo> {
        let mut info = EventInfo::default();
        // SAFETY: a place for the answer.
        let status = unsafe { (self.exchange().new_discrete_states)(self.component, &mut info) };
        self.check("fmi2NewDiscreteStates", status).map(|()| info)
    }

    /// fmi2CompletedIntegratorStep: enterEventMode, terminateSimulation.
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
        self.check("fmi2CompletedIntegratorStep", status).map(|()| (enter != 0, terminate != 0))
    }

    /// fmi2SetTime, s.
    pub fn set_time(&mut self, time: f64) -> Called {
        // SAFETY: plain value on a live instance.
        let status = unsafe { (self.exchange().set_time)(self.component, time) };
        self.check("fmi2SetTime", status)
    }

    /// fmi2SetContinuousStates.
    pub fn set_continuous_states(&mut self, x: &[f64]) -> Called {
        // SAFETY: a slice of the length given; so in the next four.
        let status =
            unsafe { (self.exchange().set_continuous_states)(self.component, x.as_ptr(), x.len()) };
        self.check("fmi2SetContinuousStates", status)
    }

    /// fmi2GetContinuousStates.
    pub fn continuous_states(&mut self, x: &mut [f64]) -> Called {
        // SAFETY: see set_continuous_states.
        let status = unsafe {
            (self.exchange().get_continuous_states)(self.component, x.as_mut_ptr(), x.len())
        };
        self.check("fmi2GetContinuousStates", status)
    }

    /// fmi2GetDerivatives.
    pub fn derivatives(&mut self, dx: &mut [f64]) -> Called {
        // SAFETY: see set_continuous_states.
        let status =
            unsafe { (self.exchange().get_derivatives)(self.component, dx.as_mut_ptr(), dx.len()) };
        self.check("fmi2GetDerivatives", status)
    }

    /// fmi2GetEventIndicators.
    pub fn event_indicators(&mut self, z: &mut [f64]) -> Called {
        // SAFETY: see set_continuous_states.
        let status = unsafe {
            (self.exchange().get_event_indicators)(self.component, z.as_mut_ptr(), z.len())
        };
        self.check("fmi2GetEventIndicators", status)
    }

    /// fmi2GetNominalsOfContinuousStates.
    pub fn nominals(&mut self, x: &mut [f64]) -> Called {
        // SAFETY: see set_continuous_states.
        let status =
            unsafe { (self.exchange().get_nominals)(self.component, x.as_mut_ptr(), x.len()) };
        self.check("fmi2GetNominalsOfContinuousStates", status)
    }

    // ------------------------------------------------ for tests of bad calls

    /// fmi2GetReal with `count` and NULL pointers: an FMU must accept 0 and refuse the rest.
    pub fn get_real_null(&mut self, count: usize) -> Called {
        // SAFETY: the point of the call is that the FMU looks before it leaps; so in the next four.
        let status =
            unsafe { (self.functions().get_real)(self.component, null(), count, null_mut()) };
        self.check("fmi2GetReal", status)
    }

    /// fmi2SetReal with `count` and NULL pointers.
    pub fn set_real_null(&mut self, count: usize) -> Called {
        // SAFETY: see get_real_null.
        let status = unsafe { (self.functions().set_real)(self.component, null(), count, null()) };
        self.check("fmi2SetReal", status)
    }

    /// fmi2Get… and fmi2Set… of each type without variables and with NULL pointers, which must be
    /// fine.
    pub fn nothing_null(&mut self) -> [(&'static str, Status); 8] {
        let (f, c) = (&self.fmu.functions, self.component);
        // SAFETY: see get_real_null.
        let answers = unsafe {
            [
                ("fmi2GetReal", (f.get_real)(c, null(), 0, null_mut())),
                ("fmi2GetInteger", (f.get_integer)(c, null(), 0, null_mut())),
                ("fmi2GetBoolean", (f.get_boolean)(c, null(), 0, null_mut())),
                ("fmi2GetString", (f.get_string)(c, null(), 0, null_mut())),
                ("fmi2SetReal", (f.set_real)(c, null(), 0, null())),
                ("fmi2SetInteger", (f.set_integer)(c, null(), 0, null())),
                ("fmi2SetBoolean", (f.set_boolean)(c, null(), 0, null())),
                ("fmi2SetString", (f.set_string)(c, null(), 0, null())),
            ]
        };
        answers.map(|(call, status)| (call, status.into()))
    }

    /// fmi2SetString with one NULL text.
    pub fn set_string_null(&mut self, reference: u32) -> Called {
        // SAFETY: see get_real_null.
        let status = unsafe {
            (self.functions().set_string)(self.component, &reference, 1, &null::<c_char>())
        };
        self.check("fmi2SetString", status)
    }

    /// fmi2SetFMUstate with NULL.
    pub fn set_state_null(&mut self) -> Called {
        self.set_state(&FmuState(null_mut()))
    }

    /// fmi2FreeFMUstate with the state itself in place of its address, as fmusim calls it.
    pub fn free_state_itself(&mut self, state: FmuState) -> Called {
        // SAFETY: a handle from this FMU, gone after this call; it points to more than a pointer.
        let status = unsafe { (self.functions().free_fmu_state)(self.component, state.0.cast()) };
        self.check("fmi2FreeFMUstate", status)
    }

    /// fmi2FreeFMUstate with NULL and with a pointer to NULL, which must both be fine.
    pub fn free_state_null(&mut self) -> Called {
        // SAFETY: see get_real_null.
        let status = unsafe { (self.functions().free_fmu_state)(self.component, null_mut()) };
        self.check("fmi2FreeFMUstate", status)?;
        self.free_state(FmuState(null_mut()))
    }
}

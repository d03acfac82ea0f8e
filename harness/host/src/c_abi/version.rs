//! The part of an FMU and its instances that all versions of FMI have in common. The trait [`Version`] contains the
//! differences; `fmi2.rs` and `fmi3.rs` implement it and add the calls that only one version has.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::ffi::{CString, c_char, c_int, c_void};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::slice;

use anyhow::{Context, Result, bail};
use files::temporary;
use libloading::Library;

use super::{
    CallError, Called, Environment, Function, Loaded, Message, Status, copy_text, functions,
    missing_functions,
};
use crate::archive::Archive;
use crate::description::{CType, ModelDescription, Type, Value, Variable};
use crate::guard::Calls;
use crate::xml::Element;

pub(crate) type Component = *mut c_void;
pub(crate) type State = *mut c_void;
pub(crate) type Refs = *const u32;
pub(crate) type Call = unsafe extern "C" fn(Component) -> c_int;
pub(crate) type GetVector = unsafe extern "C" fn(Component, *mut f64, usize) -> c_int;

// Functions that every FMU must export, with the same types in both versions except for the Boolean.
functions! { Common<B>:
    get_version "fmi2GetVersion" "fmi3GetVersion", unsafe extern "C" fn() -> *const c_char;
    set_debug_logging "fmi2SetDebugLogging" "fmi3SetDebugLogging", unsafe extern "C" fn(Component, B, usize, *const *const c_char) -> c_int;
    free_instance "fmi2FreeInstance" "fmi3FreeInstance", unsafe extern "C" fn(Component);
    exit_initialization_mode "fmi2ExitInitializationMode" "fmi3ExitInitializationMode", Call;
    terminate "fmi2Terminate" "fmi3Terminate", Call;
    reset "fmi2Reset" "fmi3Reset", Call;
    get_fmu_state "fmi2GetFMUstate" "fmi3GetFMUState", unsafe extern "C" fn(Component, *mut State) -> c_int;
    set_fmu_state "fmi2SetFMUstate" "fmi3SetFMUState", unsafe extern "C" fn(Component, State) -> c_int;
    free_fmu_state "fmi2FreeFMUstate" "fmi3FreeFMUState", unsafe extern "C" fn(Component, *mut State) -> c_int;
    serialized_fmu_state_size "fmi2SerializedFMUstateSize" "fmi3SerializedFMUStateSize", unsafe extern "C" fn(Component, State, *mut usize) -> c_int;
    serialize_fmu_state "fmi2SerializeFMUstate" "fmi3SerializeFMUState", unsafe extern "C" fn(Component, State, *mut u8, usize) -> c_int;
    deserialize_fmu_state "fmi2DeSerializeFMUstate" "fmi3DeserializeFMUState", unsafe extern "C" fn(Component, *const u8, usize, *mut State) -> c_int;
}

// Functions that an FMU for Model Exchange must export in addition to `Common`.
functions! { Exchange<B>:
    enter_continuous_time_mode "fmi2EnterContinuousTimeMode" "fmi3EnterContinuousTimeMode", Call;
    completed_integrator_step "fmi2CompletedIntegratorStep" "fmi3CompletedIntegratorStep", unsafe extern "C" fn(Component, B, *mut B, *mut B) -> c_int;
    set_time "fmi2SetTime" "fmi3SetTime", unsafe extern "C" fn(Component, f64) -> c_int;
    set_continuous_states "fmi2SetContinuousStates" "fmi3SetContinuousStates", unsafe extern "C" fn(Component, *const f64, usize) -> c_int;
    get_derivatives "fmi2GetDerivatives" "fmi3GetContinuousStateDerivatives", GetVector;
    get_event_indicators "fmi2GetEventIndicators" "fmi3GetEventIndicators", GetVector;
    get_continuous_states "fmi2GetContinuousStates" "fmi3GetContinuousStates", GetVector;
    get_nominals "fmi2GetNominalsOfContinuousStates" "fmi3GetNominalsOfContinuousStates", GetVector;
}

pub(crate) trait Getter<T> {
    /// Calls this get function of an FMU, for example fmi2GetReal, and returns its status.
    ///
    /// # Safety
    /// The function must belong to the FMU of the instance `component`.
    unsafe fn get(self, component: Component, references: &[u32], values: &mut [T]) -> c_int;
}

pub(crate) trait Setter<T> {
    /// Calls this set function of an FMU, for example fmi2SetReal, and returns its status.
    ///
    /// # Safety
    /// The function must belong to the FMU of the instance `component`. If the values are pointers,
    /// their targets must exist.
    unsafe fn set(self, component: Component, references: &[u32], values: &[T]) -> c_int;
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interface {
    CoSimulation,
    ModelExchange,
}

impl std::fmt::Display for Interface {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Interface::CoSimulation => "Co-Simulation",
            Interface::ModelExchange => "Model Exchange",
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Updated {
    pub again: bool,
    pub terminate: bool,
    pub next_event: Option<f64>,
}

/// Folder below `binaries/` with the binaries for the platform of this program, in FMI 2.0 (FMI
/// 2.0.5, section 2.3) and in FMI 3.0 (FMI 3.0.2, section 2.5.1.4.1). FMI 2.0 defines names such as
/// `linux64` only for x86; for other processors the names of FMI 3.0 are used. On macOS `darwin64`
/// is used for both processors, because hosts look there on both, and one universal binary serves
/// both.
pub(crate) const PLATFORM: [&str; 2] = {
    let (is_arm, has_64_bits) = (cfg!(target_arch = "aarch64"), cfg!(target_pointer_width = "64"));
    match (cfg!(target_os = "windows"), cfg!(target_os = "macos"), is_arm) {
        (true, _, true) => ["aarch64-windows"; 2],
        (true, ..) if has_64_bits => ["win64", "x86_64-windows"],
        (true, ..) => ["win32", "x86-windows"],
        (_, true, true) => ["darwin64", "aarch64-darwin"],
        (_, true, false) => ["darwin64", "x86_64-darwin"],
        (.., true) => ["aarch64-linux"; 2],
        _ if has_64_bits => ["linux64", "x86_64-linux"],
        _ => ["linux32", "x86-linux"],
    }
};

/// A version of FMI: its C functions, and the order in which a host calls them. `Fmu` and
/// `Instance` are generic over this trait, so that code common to FMI 2.0 and 3.0 is written once.
pub trait Version: Sized {
    const NUMBER: usize;
    const PLATFORM: &'static str = PLATFORM[Self::NUMBER];
    /// `fmi2Boolean` or `fmi3Boolean`. It is not `bool`, because a byte that is neither 0 nor 1 must not
    /// become a `bool`.
    type Boolean: Copy + Default + PartialEq + From<bool>;
    type Kept;

    /// Returns the names of the functions that a binary must export. `steps` is true if the FMU has
    /// Co-Simulation, `exchanges` if it has Model Exchange.
    fn required_functions(steps: bool, exchanges: bool) -> Vec<&'static str>;

    /// Finds the C functions of this version of FMI in `library`.
    ///
    /// # Errors
    ///
    /// If a function is missing that every FMU must export.
    ///
    /// # Safety
    ///
    /// The library must be a binary for this version of FMI, because the types of the functions
    /// cannot be checked.
    unsafe fn load(library: &Library) -> Result<Self, libloading::Error>;

    /// Returns the location of the resources of the FMU that is unpacked in `directory`, in the
    /// form that the instantiation expects: a URI in FMI 2.0, a path in FMI 3.0.
    fn resources(directory: &Path) -> Option<String>;

    fn instantiate<'fmu>(fmu: &'fmu Fmu<Self>, name: &str) -> Called<Instance<'fmu, Self>>;

    /// Enters initialization mode. `start` and `stop` are in s, `tolerance` is relative. `None`
    /// tells the FMU that the stop time or the tolerance is not defined.
    fn initialize(
        instance: &mut Instance<'_, Self>,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Called;

    fn configure(instance: &mut Instance<'_, Self>, enters: bool) -> Called;

    fn step(instance: &mut Instance<'_, Self>, time: f64, step: f64) -> Called;

    /// Sets the time derivatives `slopes`, per s, of the inputs with the value references
    /// `references`. Nothing happens in FMI 3.0, which has no function for derivatives of inputs.
    fn set_slopes(instance: &mut Instance<'_, Self>, references: &[u32], slopes: &[f64]) -> Called;

    /// Simulates from `time` to `time + step`, s, while the inputs change linearly: `values` are
    /// the inputs at the start of the step, and `slopes` are their derivatives, per s.
    fn step_along(
        instance: &mut Instance<'_, Self>,
        time: f64,
        step: f64,
        references: &[u32],
        values: &[f64],
        slopes: &[f64],
    ) -> Called;

    fn enter_event_mode(instance: &mut Instance<'_, Self>) -> Called;

    fn update(instance: &mut Instance<'_, Self>) -> Called<Updated>;

    fn sizes(instance: &mut Instance<'_, Self>) -> Called<(usize, usize)>;

    fn values(
        instance: &mut Instance<'_, Self>,
        c_type: CType,
        reference: u32,
        count: usize,
    ) -> Called<Vec<Value>>;

    fn set_values(
        instance: &mut Instance<'_, Self>,
        c_type: CType,
        reference: u32,
        values: &[Value],
    ) -> Called;

    fn reals(instance: &mut Instance<'_, Self>, references: &[u32], values: &mut [f64]) -> Called;

    fn set_reals(instance: &mut Instance<'_, Self>, references: &[u32], values: &[f64]) -> Called;
}

pub struct Fmu<V: Version> {
    pub(crate) description: ModelDescription,
    pub(crate) common: Common<V::Boolean>,
    pub(crate) exchange: Option<Exchange<V::Boolean>>,
    pub(crate) own: V,
    pub(crate) interface: Interface,
    pub(crate) resources: Option<String>,
    hash: String,
    binary_hash: String,
    path: PathBuf,
    changed: Vec<&'static str>,
    /// True if all Reals are scalars of type Float64. They can then be exchanged in one call
    /// without a check of each reference.
    is_plain: bool,
    plain: Vec<u32>,
    /// Value references of the Float64 inputs, also elements of arrays, that the host may set
    /// within a step (attribute intermediateUpdate of FMI 3.0), in ascending order.
    pub(crate) taken: Vec<u32>,
    structural: BTreeMap<u32, Value>,
    // The order of these fields is the order in which they are dropped: first the library, then its files.
    library: Option<Library>,
    _directory: Option<temporary::Folder>,
}

impl<V: Version> Drop for Fmu<V> {
    fn drop(&mut self) {
        let _calls = Calls::one();
        self.library = None;
    }
}

impl<V: Version> Fmu<V> {
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let archive = Archive::open(path)?;
        let described = ModelDescription::from_archive(&archive, path)?;
        Fmu::from_archive(&archive, described, path, Interface::CoSimulation, &[])
    }

    /// Unpacks an FMU and loads its binary for `interface`. `text` is modelDescription.xml and
    /// `description` its content. Only structural parameters of FMI 3.0 among `settings` are used,
    /// because they determine the sizes of arrays.
    pub(crate) fn from_archive(
        archive: &Archive,
        (text, description): (String, ModelDescription),
        path: &Path,
        interface: Interface,
        settings: &[(String, String)],
    ) -> Result<Self> {
        let name = path.display();
        match interface {
            Interface::CoSimulation if description.co_simulation.is_none() => {
                bail!(
                    "{name} has no Co-Simulation, which is the only interface that this command uses"
                )
            }
            Interface::ModelExchange if description.model_exchange.is_none() => {
                bail!("{name} has no Model Exchange, so only the FMU's own solver can step it")
            }
            _ => {}
        }
        let directory = temporary::Folder::new()?;
        archive.unpack(directory.path()).with_context(|| format!("{name} is not an FMU"))?;
        let mut fmu = Fmu::load_described(description, Some(interface), directory.path(), path)?;
        fmu.hash = archive.hash().with_context(|| format!("{name} cannot be read"))?;
        fmu._directory = Some(directory);
        fmu.configure(&text, settings)?;
        Ok(fmu)
    }

    /// Loads the binary of an FMU that is unpacked in `directory`, for Co-Simulation if the FMU offers it. `path` is
    /// the FMU's name in error messages. [`Fmu::hash`] is empty, because there is no archive.
    pub fn load(directory: &Path, path: &Path) -> Result<Self> {
        Fmu::load_binary(None, directory, path)
    }

    /// Loads the binary of the FMU that is unpacked in `directory`. Co-Simulation and Model
    /// Exchange may have different binaries: `interface` selects one, and without it Co-Simulation
    /// is used if the FMU offers it.
    pub(crate) fn load_binary(
        interface: Option<Interface>,
        directory: &Path,
        path: &Path,
    ) -> Result<Self> {
        let name = path.display();
        let xml = directory.join("modelDescription.xml");
        if !xml.exists() {
            bail!("{name} is not an FMU: it has no modelDescription.xml");
        }
        let text = std::fs::read_to_string(&xml)
            .with_context(|| format!("modelDescription.xml in {name} cannot be read"))?;
        let description = ModelDescription::from_xml(&text)
            .with_context(|| format!("the FMU {name} cannot be used"))?;
        Fmu::load_described(description, interface, directory, path)
    }

    /// Loads the binary of the FMU that is unpacked in `directory`, with the model description
    /// `root`. The caller parses the description once for several calls, because parsing a large
    /// description takes most of the time.
    pub fn load_for(
        interface: Option<Interface>,
        directory: &Path,
        path: &Path,
        root: &Element,
    ) -> Result<Self> {
        let description = ModelDescription::from_element(root, &BTreeMap::new())
            .with_context(|| format!("the FMU {} cannot be used", path.display()))?;
        Fmu::load_described(description, interface, directory, path)
    }

    fn load_described(
        description: ModelDescription,
        interface: Option<Interface>,
        directory: &Path,
        path: &Path,
    ) -> Result<Self> {
        let name = path.display();
        let stepping = description.co_simulation.as_ref().map(|i| &i.model_identifier);
        let exchange = description.model_exchange.as_ref().map(|i| &i.model_identifier);
        let identifier = match interface {
            None => stepping.or(exchange),
            Some(Interface::CoSimulation) => stepping,
            Some(Interface::ModelExchange) => exchange,
        };
        let identifier = identifier
            .with_context(|| format!("{name} has neither Co-Simulation nor Model Exchange"))?;
        let Loaded { library, hash, changed, binary } =
            super::load(directory, path, V::PLATFORM, identifier)?;
        let needed =
            V::required_functions(stepping == Some(identifier), exchange == Some(identifier));
        let lacking = missing_functions(&library, &needed);
        if !lacking.is_empty() {
            bail!("{binary} in the FMU {name} lacks the functions {}", lacking.join(", "));
        }
        // SAFETY: by its modelDescription.xml the binary has the functions of this version of FMI, whose types the
        // tables declare. An FMU with one interface may lack the functions of the other.
        let (common, own, exchange) = unsafe {
            let refused = || format!("{binary} in the FMU {name} cannot be used");
            (
                Common::load(&library, V::NUMBER).with_context(refused)?,
                V::load(&library).with_context(refused)?,
                Exchange::load(&library, V::NUMBER).ok(),
            )
        };
        let (is_plain, plain) = scalar_reals(&description);
        let taken = intermediate_inputs(&description);
        Ok(Fmu {
            common,
            exchange,
            own,
            interface: interface.unwrap_or(match description.co_simulation {
                Some(_) => Interface::CoSimulation,
                None => Interface::ModelExchange,
            }),
            description,
            resources: V::resources(directory),
            hash: String::new(),
            binary_hash: hash,
            path: path.to_path_buf(),
            changed,
            is_plain,
            plain,
            taken,
            structural: BTreeMap::new(),
            library: Some(library),
            _directory: None,
        })
    }

    /// Sets structural parameters to values other than the declared values. `settings` are pairs of
    /// a name and a value, and `text` is modelDescription.xml. Every instance from
    /// [`Fmu::instantiate`] then sets these parameters first, in configuration mode, and
    /// [`Fmu::description`] has the resulting array sizes. The start values of arrays whose size
    /// changes are read from the FMU.
    ///
    /// # Errors
    ///
    /// If the FMU refuses a value.
    fn configure(&mut self, text: &str, settings: &[(String, String)]) -> Result<()> {
        let mut is_set = false;
        for (name, value) in settings {
            let of = |v: &&Variable| v.is_structural() && v.name == *name;
            let Some(variable) = self.description.variables.iter().find(of) else { continue };
            is_set = true;
            let value = self.description.value(variable, value)?;
            let start = variable.attributes().start.as_deref().unwrap_or_default();
            // A parameter with its declared value needs no call.
            match self.description.value(variable, start).is_ok_and(|start| start == value) {
                true => self.structural.remove(&variable.reference),
                false => self.structural.insert(variable.reference, value),
            };
        }
        if !is_set {
            return Ok(());
        }
        // The FMU is asked for the size before the description is parsed, because a size that the FMU refuses may also
        // be too large for a description.
        let mut instance = self.instantiate("sizes")?;
        let mut description = ModelDescription::from_xml_with(text, &self.structural)?;
        let mut starts = Vec::new();
        for (reference, array) in description.arrays().filter(|(_, array)| array.is_resized) {
            starts.push((
                reference,
                V::values(&mut instance, array.c_type, reference, array.length)?,
            ));
        }
        drop(instance);
        for (array, values) in starts {
            description.set_starts(array, &values);
        }
        (self.is_plain, self.plain) = scalar_reals(&description);
        self.taken = intermediate_inputs(&description);
        self.description = description;
        Ok(())
    }

    pub fn description(&self) -> &ModelDescription {
        &self.description
    }

    pub fn hash(&self) -> &str {
        &self.hash
    }

    pub fn binary_hash(&self) -> &str {
        &self.binary_hash
    }

    /// Names the settings of the process, for example the rounding mode, that changed while the
    /// binary was loaded. An FMU must not change them.
    pub fn changed(&self) -> &[&'static str] {
        &self.changed
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn version(&self) -> String {
        // SAFETY: the function has no arguments and returns a constant string.
        unsafe { copy_text((self.common.get_version.call)()) }
    }

    fn is_plain(&self, references: &[u32]) -> bool {
        self.is_plain || references.iter().all(|r| self.plain.binary_search(r).is_ok())
    }

    pub fn instantiate(&self, name: &str) -> Called<Instance<'_, V>> {
        let mut instance = V::instantiate(self, name)?;
        if !self.structural.is_empty() {
            V::configure(&mut instance, true)?;
            for (reference, value) in &self.structural {
                let of = |v: &&Variable| v.is_structural() && v.reference == *reference;
                if let Some(variable) = self.description.variables.iter().find(of) {
                    let value = slice::from_ref(value);
                    V::set_values(&mut instance, variable.c_type(), *reference, value)?;
                }
            }
            V::configure(&mut instance, false)?;
        }
        Ok(instance)
    }

    pub(crate) fn create_instance(
        &self,
        name: &'static str,
        environment: Environment,
        kept: V::Kept,
        make: impl FnOnce() -> Component,
    ) -> Called<Instance<'_, V>> {
        let calls = Calls::one();
        environment.begin_call();
        let component = make();
        calls.end();
        // An instance that is NULL is refused here, so that no later call passes a NULL pointer to the FMU.
        let instance = Instance {
            fmu: self,
            component,
            environment,
            kept,
            warned: Cell::new(None),
            calls,
            arrays: RefCell::default(),
            one_thread: PhantomData,
        };
        if component.is_null() {
            let messages = instance.take_messages();
            return Err(CallError { call: name, status: Status::Error, messages });
        }
        Ok(instance)
    }

    pub fn free_null_instance(&self) {
        // SAFETY: the standard allows NULL here (FMI 2.0.5, section 2.1.5; FMI 3.0.2, section 2.3.1).
        unsafe { (self.common.free_instance.call)(null_mut()) }
    }
}

/// Returns `true` if all Reals of the FMU are scalars of type Float64, and the value references of
/// all such scalars in ascending order.
fn scalar_reals(description: &ModelDescription) -> (bool, Vec<u32>) {
    let reals = description.variables.iter().filter(|v| v.kind() == Type::Real);
    let (plain, others): (Vec<&Variable>, Vec<&Variable>) = reals
        .partition(|v| v.c_type() == CType::Float64 && description.element(v.reference).is_none());
    let mut plain: Vec<u32> = plain.iter().map(|v| v.reference).collect();
    plain.sort_unstable();
    (others.is_empty(), plain)
}

fn intermediate_inputs(description: &ModelDescription) -> Vec<u32> {
    let is_taken = |v: &&Variable| v.intermediate && v.c_type() == CType::Float64;
    let taken = description.variables.iter().filter(is_taken);
    let mut taken: Vec<u32> = taken.map(|v| v.reference).collect();
    taken.sort_unstable();
    taken
}

#[derive(Clone, Copy, Debug)]
pub struct CompletedStep {
    pub enter_event_mode: bool,
    pub terminate: bool,
}

/// Instance of an FMU. It is freed when it is dropped, and it cannot be sent to another thread than
/// the thread that created it.
pub struct Instance<'fmu, V: Version> {
    pub(crate) fmu: &'fmu Fmu<V>,
    pub(crate) component: Component,
    environment: Environment,
    pub(crate) kept: V::Kept,
    warned: Cell<Option<&'static str>>,
    pub(crate) calls: Calls,
    /// Values of the arrays of which the host has set single elements, by value reference. FMI can
    /// only set a whole array, so that the values of the other elements must be known when the next
    /// element is set.
    arrays: RefCell<BTreeMap<u32, Vec<Value>>>,
    one_thread: PhantomData<*mut ()>,
}

impl<V: Version> Drop for Instance<'_, V> {
    fn drop(&mut self) {
        if !self.component.is_null() {
            self.begin_call();
            // SAFETY: the FMU created the instance, and only this call frees it. The environment is dropped later,
            // because the FMU may still log.
            unsafe { (self.fmu.common.free_instance.call)(self.component) };
            self.calls.end();
        }
    }
}

/// A saved state of an instance. It belongs to the instance from which it was taken. It must be
/// returned to the instance with [`Instance::free_state`]; otherwise its memory is never freed.
pub struct FmuState(pub(crate) State);

impl<'fmu, V: Version> Instance<'fmu, V> {
    pub fn fmu(&self) -> &'fmu Fmu<V> {
        self.fmu
    }

    pub fn take_messages(&self) -> Vec<Message> {
        self.environment.take()
    }

    /// Returns the texts of the warnings that the FMU has logged since the last call, and drops all
    /// other stored messages.
    pub fn take_warnings(&self) -> Vec<String> {
        let messages = self.take_messages().into_iter();
        let warnings = messages.filter(|message| message.status == Status::Warning);
        warnings.map(|message| message.text.trim().to_string()).collect()
    }

    pub fn uncategorised(&self) -> usize {
        self.environment.uncategorised()
    }

    /// Returns the name of the last C function that returned the status Warning since the previous
    /// call of `take_warning`, or `None` if no function did.
    pub fn take_warning(&self) -> Option<&'static str> {
        self.warned.take()
    }

    pub(crate) fn begin_call(&self) {
        self.environment.begin_call();
        self.calls.begin();
    }

    pub(crate) fn call<T>(
        &self,
        function: Function<T>,
        call: impl FnOnce(T, Component) -> c_int,
    ) -> Called {
        self.begin_call();
        let status = call(function.call, self.component);
        self.calls.end();
        match Status::from(status) {
            Status::Ok => Ok(()),
            Status::Warning => {
                self.warned.set(Some(function.name));
                Ok(())
            }
            status => {
                Err(CallError { call: function.name, status, messages: self.take_messages() })
            }
        }
    }

    pub(crate) fn call_plain(&self, function: Function<Call>) -> Called {
        // SAFETY: the instance is alive.
        self.call(function, |f, c| unsafe { f(c) })
    }

    fn vector(&self, function: Function<GetVector>, x: &mut [f64]) -> Called {
        // SAFETY: the slice has the length that is passed.
        self.call(function, |f, c| unsafe { f(c, x.as_mut_ptr(), x.len()) })
    }

    pub(crate) fn read<T>(
        &self,
        function: Function<impl Getter<T>>,
        references: &[u32],
        values: &mut [T],
    ) -> Called {
        // SAFETY: the function belongs to this FMU.
        self.call(function, |f, c| unsafe { f.get(c, references, values) })
    }

    pub(crate) fn write<T>(
        &self,
        function: Function<impl Setter<T>>,
        references: &[u32],
        values: &[T],
    ) -> Called {
        // SAFETY: the function belongs to this FMU.
        self.call(function, |f, c| unsafe { f.set(c, references, values) })
    }

    pub(crate) fn read_texts(
        &self,
        function: Function<impl Getter<*const c_char>>,
        references: &[u32],
        count: usize,
    ) -> Called<Vec<String>> {
        let mut pointers: Vec<*const c_char> = vec![null(); count];
        self.read(function, references, &mut pointers)?;
        // SAFETY: the FMU has returned OK, so that each pointer leads to a terminated string of the FMU.
        Ok(pointers.into_iter().map(|text| unsafe { copy_text(text) }).collect())
    }

    pub(crate) fn write_texts(
        &self,
        function: Function<impl Setter<*const c_char>>,
        references: &[u32],
        values: &[&str],
    ) -> Called {
        let (_texts, pointers) = c_strings(values);
        self.write(function, references, &pointers)
    }

    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Called {
        let (_texts, pointers) = c_strings(categories);
        let start = if pointers.is_empty() { null() } else { pointers.as_ptr() };
        // SAFETY: the pointers lead to strings that exist until the call has returned.
        self.call(self.fmu.common.set_debug_logging, |f, c| unsafe {
            f(c, on.into(), pointers.len(), start)
        })
    }

    pub fn exit_initialization_mode(&mut self) -> Called {
        self.call_plain(self.fmu.common.exit_initialization_mode)
    }

    pub fn terminate(&mut self) -> Called {
        self.call_plain(self.fmu.common.terminate)
    }

    pub fn reset(&mut self) -> Called {
        self.arrays.borrow_mut().clear();
        self.call_plain(self.fmu.common.reset)
    }

    pub fn enter_event_mode(&mut self) -> Called {
        V::enter_event_mode(self)
    }

    // ------------------------------------------------ variables of the description

    fn variable(&self, reference: u32) -> &'fmu Variable {
        let variables = &self.fmu.description.variables;
        let of = variables.iter().find(|v| v.reference == reference && v.kind() == Type::Real);
        of.expect("a reference of one of the FMU's Reals")
    }

    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Called {
        if self.fmu.is_plain(references) {
            return V::reals(self, references, values);
        }
        for (reference, value) in references.iter().zip(values.iter_mut()) {
            if let Value::Real(x) = self.value(self.variable(*reference))? {
                *value = x;
            }
        }
        Ok(())
    }

    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Called {
        if self.fmu.is_plain(references) {
            return V::set_reals(self, references, values);
        }
        for (reference, value) in references.iter().zip(values) {
            self.set_value(self.variable(*reference), Value::Real(*value))?;
        }
        Ok(())
    }

    pub fn value(&mut self, variable: &Variable) -> Called<Value> {
        let description = &self.fmu.description;
        let (reference, length, index) = match description.element(variable.reference) {
            None => (variable.reference, 1, 0),
            Some(element) => {
                let length = description.array(element.array).map_or(0, |array| array.length);
                (element.array, length, element.index)
            }
        };
        let values = V::values(self, variable.c_type(), reference, length)?;
        Ok(values.into_iter().nth(index).unwrap_or(Value::String(String::new())))
    }

    /// Sets a variable or one element of an array. FMI sets an array as a whole, so that the other
    /// elements are sent with it: they keep the values that were set last, or their start values.
    pub fn set_value(&mut self, variable: &Variable, value: Value) -> Called {
        let description = &self.fmu.description;
        let Some(element) = description.element(variable.reference) else {
            return V::set_values(self, variable.c_type(), variable.reference, &[value]);
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
        let set = V::set_values(self, variable.c_type(), element.array, &values);
        self.arrays.borrow_mut().insert(element.array, values);
        set
    }

    pub fn values(&mut self, c_type: CType, reference: u32, count: usize) -> Called<Vec<Value>> {
        V::values(self, c_type, reference, count)
    }

    pub fn set_values(&mut self, c_type: CType, reference: u32, values: &[Value]) -> Called {
        V::set_values(self, c_type, reference, values)
    }

    pub fn get(&mut self, name: &str) -> Result<Value> {
        let variable = self.fmu.description.variable(name)?;
        if matches!(variable.kind(), Type::Binary | Type::Clock) {
            bail!("{name} is of type {:?}, whose values this command cannot read", variable.kind());
        }
        Ok(self.value(variable)?)
    }

    pub fn real(&mut self, name: &str) -> Result<f64> {
        match self.get(name)? {
            Value::Real(value) => Ok(value),
            other => bail!("{name} is not a Real but {other:?}"),
        }
    }

    /// Sets the variable `name` from a text, for example from the command line: a number, `true` or
    /// `false`, or an item of an enumeration by its name or number.
    ///
    /// # Errors
    ///
    /// If the text is not a value of the variable's type, the FMU refuses the value, or the
    /// variable is a structural parameter of FMI 3.0 and the value differs from the value with
    /// which the FMU was opened.
    pub fn set(&mut self, name: &str, text: &str) -> Result<()> {
        let description = &self.fmu.description;
        let variable = description.variable(name)?;
        let value = description.value(variable, text)?;
        if variable.is_structural() {
            let now = variable.attributes().start.as_deref().unwrap_or_default();
            if description.value(variable, now).is_ok_and(|now| now == value) {
                return Ok(());
            }
            bail!(
                "{name} cannot be set to {text}: it is a structural parameter that sizes arrays, and its value here is {now} \
                 (`hubslosh run` can set it)"
            );
        }
        self.set_value(variable, value).with_context(|| format!("the FMU refuses {name} = {text}"))
    }

    // ------------------------------------------------ snapshots

    pub fn get_state(&mut self) -> Called<FmuState> {
        let mut state = FmuState(null_mut());
        self.get_state_into(&mut state)?;
        Ok(state)
    }

    pub fn get_state_into(&mut self, state: &mut FmuState) -> Called {
        // SAFETY: the handle is NULL or comes from this FMU.
        self.call(self.fmu.common.get_fmu_state, |f, c| unsafe { f(c, &mut state.0) })
    }

    pub fn set_state(&mut self, state: &FmuState) -> Called {
        // SAFETY: the handle comes from this FMU.
        self.call(self.fmu.common.set_fmu_state, |f, c| unsafe { f(c, state.0) })
    }

    pub fn free_state(&mut self, mut state: FmuState) -> Called {
        // SAFETY: the handle comes from this FMU and is not used after this call.
        self.call(self.fmu.common.free_fmu_state, |f, c| unsafe { f(c, &mut state.0) })
    }

    pub fn serialize(&mut self, state: &FmuState) -> Called<Vec<u8>> {
        let mut size = 0;
        let common = &self.fmu.common;
        // SAFETY: the handle comes from this FMU, and there is a variable for the size.
        self.call(common.serialized_fmu_state_size, |f, c| unsafe { f(c, state.0, &mut size) })?;
        let mut bytes = vec![0u8; size];
        // SAFETY: the array has `size` bytes.
        self.call(common.serialize_fmu_state, |f, c| unsafe {
            f(c, state.0, bytes.as_mut_ptr(), size)
        })?;
        Ok(bytes)
    }

    pub fn deserialize(&mut self, bytes: &[u8]) -> Called<FmuState> {
        let mut state = FmuState(null_mut());
        // SAFETY: the array has `bytes.len()` bytes.
        self.call(self.fmu.common.deserialize_fmu_state, |f, c| unsafe {
            f(c, bytes.as_ptr(), bytes.len(), &mut state.0)
        })?;
        Ok(state)
    }

    // ------------------------------------------------ model exchange

    fn exchange(&self) -> &'fmu Exchange<V::Boolean> {
        self.fmu.exchange.as_ref().expect("the FMU exports the functions of model exchange")
    }

    /// Enters continuous-time mode of Model Exchange, in which the host integrates the states.
    ///
    /// # Panics
    ///
    /// If the FMU does not export the functions of Model Exchange. This holds for all functions of
    /// Model Exchange below.
    pub fn enter_continuous_time_mode(&mut self) -> Called {
        self.call_plain(self.exchange().enter_continuous_time_mode)
    }

    pub fn completed_integrator_step(&mut self) -> Called<CompletedStep> {
        let no = V::Boolean::default();
        let (mut enter, mut terminate) = (no, no);
        // SAFETY: the pointers lead to variables for the results.
        self.call(self.exchange().completed_integrator_step, |f, c| unsafe {
            f(c, true.into(), &mut enter, &mut terminate)
        })?;
        Ok(CompletedStep { enter_event_mode: enter != no, terminate: terminate != no })
    }

    pub fn set_time(&mut self, time: f64) -> Called {
        // SAFETY: the argument is a plain value, and the instance is alive.
        self.call(self.exchange().set_time, |f, c| unsafe { f(c, time) })
    }

    pub fn set_continuous_states(&mut self, x: &[f64]) -> Called {
        // SAFETY: the slice has the length that is passed.
        self.call(self.exchange().set_continuous_states, |f, c| unsafe {
            f(c, x.as_ptr(), x.len())
        })
    }

    pub fn continuous_states(&mut self, x: &mut [f64]) -> Called {
        self.vector(self.exchange().get_continuous_states, x)
    }

    pub fn derivatives(&mut self, dx: &mut [f64]) -> Called {
        self.vector(self.exchange().get_derivatives, dx)
    }

    pub fn event_indicators(&mut self, z: &mut [f64]) -> Called {
        self.vector(self.exchange().get_event_indicators, z)
    }

    pub fn nominals(&mut self, x: &mut [f64]) -> Called {
        self.vector(self.exchange().get_nominals, x)
    }
}

fn c_strings(texts: &[&str]) -> (Vec<CString>, Vec<*const c_char>) {
    let texts: Vec<CString> = texts.iter().map(|t| CString::new(*t).unwrap_or_default()).collect();
    let pointers = texts.iter().map(|text| text.as_ptr()).collect();
    (texts, pointers)
}

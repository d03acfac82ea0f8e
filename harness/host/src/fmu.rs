//! An FMU of either version, for a host that steps it in Co-Simulation or integrates it in Model Exchange.
//!
//! In Co-Simulation FMI 3.0 is used like FMI 2.0, without event mode and early return: the FMU handles its events
//! itself. For inputs that change linearly within a step, an FMU 2.0 receives derivatives, and an FMU 3.0 receives
//! values in intermediate updates if it provides them.

use std::path::Path;

use anyhow::Result;

use crate::archive::Archive;
use crate::c_abi::version::Version;
pub use crate::c_abi::version::{CompletedStep, FmuState as State, Interface, Updated};
use crate::c_abi::{Called, Message};
use crate::description::{ModelDescription, Value, Variable};
use crate::{fmi2, fmi3};

/// An opened FMU, unpacked into a temporary folder, with its binary loaded.
#[allow(clippy::large_enum_variant)] // made once and hardly moved
pub enum Fmu {
    V2(fmi2::Fmu),
    V3(fmi3::Fmu),
}

/// An instance of an FMU. It is freed when it is dropped, and belongs to the thread that created it.
pub enum Instance<'fmu> {
    V2(fmi2::Instance<'fmu>),
    V3(fmi3::Instance<'fmu>),
}

/// Evaluates an expression with the inner FMU or instance, for both versions of FMI.
macro_rules! each {
    ($type:ident, $of:expr, $one:ident => $do:expr) => {
        match $of {
            $type::V2($one) => $do,
            $type::V3($one) => $do,
        }
    };
}

impl Fmu {
    /// Opens a packed FMU for Co-Simulation and loads the binary for this platform.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Fmu::open_with(path, &[])
    }

    /// Opens a packed FMU for Co-Simulation. Of `settings` only structural parameters of FMI 3.0 are used,
    /// because they determine the sizes of arrays: every instance sets them first, and the description has
    /// the resulting elements.
    ///
    /// # Errors
    ///
    /// If the FMU cannot be opened, or refuses one of these parameters.
    pub fn open_with(path: impl AsRef<Path>, settings: &[(String, String)]) -> Result<Self> {
        Fmu::open_for(Interface::CoSimulation, path, settings)
    }

    /// Opens an FMU for simulations between communication points: in Co-Simulation, or in Model Exchange if it does not
    /// offer Co-Simulation. For `settings` see [`Fmu::open_with`].
    pub fn open_to_run(path: impl AsRef<Path>, settings: &[(String, String)]) -> Result<Self> {
        let path = path.as_ref();
        let description = ModelDescription::from_fmu(path)?;
        let exchanges = description.co_simulation.is_none() && description.model_exchange.is_some();
        let interface = if exchanges { Interface::ModelExchange } else { Interface::CoSimulation };
        Fmu::open_for(interface, path, settings)
    }

    pub fn open_for(
        interface: Interface,
        path: impl AsRef<Path>,
        settings: &[(String, String)],
    ) -> Result<Self> {
        let path = path.as_ref();
        let archive = Archive::open(path)?;
        let described = ModelDescription::from_archive(&archive, path)?;
        Ok(match described.1.is_fmi3() {
            false => {
                Fmu::V2(fmi2::Fmu::from_archive(&archive, described, path, interface, settings)?)
            }
            true => {
                Fmu::V3(fmi3::Fmu::from_archive(&archive, described, path, interface, settings)?)
            }
        })
    }

    pub fn description(&self) -> &ModelDescription {
        each!(Fmu, self, fmu => fmu.description())
    }

    pub fn hash(&self) -> &str {
        each!(Fmu, self, fmu => fmu.hash())
    }

    pub fn binary_hash(&self) -> &str {
        each!(Fmu, self, fmu => fmu.binary_hash())
    }

    /// Lists the parts of the process state, for example the rounding mode, that have changed while
    /// the binary was loaded.
    pub fn changed(&self) -> &[&'static str] {
        each!(Fmu, self, fmu => fmu.changed())
    }

    pub fn path(&self) -> &Path {
        each!(Fmu, self, fmu => fmu.path())
    }

    /// Creates an instance with logging on, for the interface for which the FMU was opened.
    pub fn instantiate(&self, name: &str) -> Called<Instance<'_>> {
        Ok(match self {
            Fmu::V2(fmu) => Instance::V2(fmu.instantiate(name)?),
            Fmu::V3(fmu) => Instance::V3(fmu.instantiate(name)?),
        })
    }
}

/// Declares methods of [`Instance`] that call the method of the same name of an instance of FMI 2.0
/// or 3.0.
macro_rules! passed_on {
    ($($(#[$doc:meta])* $name:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {
        impl Instance<'_> {$(
            $(#[$doc])*
            pub fn $name(&mut self, $($argument: $type),*) -> $result {
                each!(Instance, self, instance => instance.$name($($argument),*))
            }
        )*}
    };
}

passed_on! {
    take_messages() -> Vec<Message>;
    take_warnings() -> Vec<String>;
    exit_initialization_mode() -> Called;
    /// Saves the state. It must be freed with [`Instance::free_state`]; otherwise its memory is lost.
    get_state() -> Called<State>;
    set_state(state: &State) -> Called;
    serialize(state: &State) -> Called<Vec<u8>>;
    deserialize(bytes: &[u8]) -> Called<State>;
    free_state(state: State) -> Called;
    get_real(references: &[u32], values: &mut [f64]) -> Called;
    set_real(references: &[u32], values: &[f64]) -> Called;
    value(variable: &Variable) -> Called<Value>;
    /// Sets a variable or one element of an array. The other elements of the array keep the values that were set last,
    /// or their start values.
    set_value(variable: &Variable, value: Value) -> Called;
    get(name: &str) -> Result<Value>;
    real(name: &str) -> Result<f64>;
    /// Sets a variable from a text: a number, `true` or `false`, or an item of an enumeration by name or number.
    ///
    /// # Errors
    ///
    /// If the text is not a value of the variable's type, the FMU refuses the value, or the variable is a structural
    /// parameter of FMI 3.0 and the value differs from the value with which the FMU was opened.
    set(name: &str, text: &str) -> Result<()>;
    /// Enters event mode. This and the following calls need an FMU that was opened for Model Exchange.
    enter_event_mode() -> Called;
    enter_continuous_time_mode() -> Called;
    completed_integrator_step() -> Called<CompletedStep>;
    set_time(time: f64) -> Called;
    set_continuous_states(x: &[f64]) -> Called;
    continuous_states(x: &mut [f64]) -> Called;
    derivatives(dx: &mut [f64]) -> Called;
    event_indicators(z: &mut [f64]) -> Called;
    nominals(x: &mut [f64]) -> Called;
}

impl<'fmu> Instance<'fmu> {
    pub fn description(&self) -> &'fmu ModelDescription {
        each!(Instance, self, instance => instance.fmu().description())
    }

    pub fn enter_initialization_mode(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Called {
        each!(Instance, self, instance => Version::initialize(instance, tolerance, start, stop))
    }

    pub fn do_step(&mut self, time: f64, step: f64) -> Called {
        each!(Instance, self, instance => Version::step(instance, time, step))
    }

    /// Sets the time derivatives of inputs of an FMU 2.0 from now on, per s. An FMU 3.0 receives them only
    /// within the step.
    pub fn set_slopes(&mut self, references: &[u32], slopes: &[f64]) -> Called {
        each!(Instance, self, instance => Version::set_slopes(instance, references, slopes))
    }

    /// Makes a step in which Real inputs change linearly. The inputs have already been set to `values`; `slopes` are
    /// their derivatives, per s. An FMU 3.0 receives further values in intermediate updates.
    pub fn do_step_along(
        &mut self,
        time: f64,
        step: f64,
        references: &[u32],
        values: &[f64],
        slopes: &[f64],
    ) -> Called {
        each!(Instance, self, instance => {
            Version::step_along(instance, time, step, references, values, slopes)
        })
    }

    /// Returns true if the FMU 2.0 has refused a step because it requests the end of the simulation.
    pub fn wants_to_end(&mut self) -> bool {
        match self {
            Instance::V2(instance) => instance.boolean_status(fmi2::TERMINATED).unwrap_or(false),
            Instance::V3(_) => false, // the refusal says it
        }
    }

    /// Returns the derivatives of `unknowns` for the change `direction` of `knowns`; all must be scalars of
    /// the FMU.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
    ) -> Called<Vec<f64>> {
        match self {
            Instance::V2(instance) => {
                instance.get_directional_derivative(unknowns, knowns, direction)
            }
            Instance::V3(instance) => {
                instance.directional_derivative(unknowns, knowns, direction, unknowns.len())
            }
        }
    }

    pub fn update_discrete_states(&mut self) -> Called<Updated> {
        each!(Instance, self, instance => Version::update(instance))
    }

    pub fn sizes(&mut self) -> Called<(usize, usize)> {
        each!(Instance, self, instance => Version::sizes(instance))
    }
}

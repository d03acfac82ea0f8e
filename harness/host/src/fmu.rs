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

/// An opened FMU of either version of FMI: it is unpacked into a temporary folder, and its binary
/// is loaded.
#[allow(clippy::large_enum_variant)] // made once and hardly moved
pub enum Fmu {
    V2(fmi2::Fmu),
    V3(fmi3::Fmu),
}

/// An instance of an FMU of either version of FMI. It is freed when it is dropped, and it cannot be
/// sent to another thread than the thread that created it.
pub enum Instance<'fmu> {
    V2(fmi2::Instance<'fmu>),
    V3(fmi3::Instance<'fmu>),
}

macro_rules! each {
    ($type:ident, $of:expr, $one:ident => $do:expr) => {
        match $of {
            $type::V2($one) => $do,
            $type::V3($one) => $do,
        }
    };
}

impl Fmu {
    /// Opens the packed FMU at `path` for Co-Simulation: unpacks it into a temporary folder and
    /// loads the binary for this platform.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Fmu::open_with(path, &[])
    }

    /// Opens the packed FMU at `path` for Co-Simulation with other values of structural parameters
    /// of FMI 3.0, which determine the sizes of arrays. `settings` are pairs of a name and a value;
    /// other parameters among them are ignored. Every instance sets the structural parameters
    /// first, and the description has the resulting array elements.
    ///
    /// # Errors
    ///
    /// If the FMU cannot be opened, or refuses one of these parameters.
    pub fn open_with(path: impl AsRef<Path>, settings: &[(String, String)]) -> Result<Self> {
        Fmu::open_for(Interface::CoSimulation, path, settings)
    }

    /// Opens an FMU for simulations that advance from one communication point to the next: in
    /// Co-Simulation if the FMU offers it, otherwise in Model Exchange with the host's solver. For
    /// `settings` see [`Fmu::open_with`].
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

    /// Names the settings of the process, for example the rounding mode, that changed while the
    /// binary was loaded. An FMU must not change them.
    pub fn changed(&self) -> &[&'static str] {
        each!(Fmu, self, fmu => fmu.changed())
    }

    pub fn path(&self) -> &Path {
        each!(Fmu, self, fmu => fmu.path())
    }

    /// Creates an instance with the name `name` and with logging on, for the interface
    /// (Co-Simulation or Model Exchange) for which the FMU was opened.
    pub fn instantiate(&self, name: &str) -> Called<Instance<'_>> {
        Ok(match self {
            Fmu::V2(fmu) => Instance::V2(fmu.instantiate(name)?),
            Fmu::V3(fmu) => Instance::V3(fmu.instantiate(name)?),
        })
    }
}

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
    /// Saves the state of the instance. The state must be freed with [`Instance::free_state`];
    /// otherwise its memory is lost.
    get_state() -> Called<State>;
    set_state(state: &State) -> Called;
    serialize(state: &State) -> Called<Vec<u8>>;
    deserialize(bytes: &[u8]) -> Called<State>;
    free_state(state: State) -> Called;
    get_real(references: &[u32], values: &mut [f64]) -> Called;
    set_real(references: &[u32], values: &[f64]) -> Called;
    value(variable: &Variable) -> Called<Value>;
    /// Sets a variable or one element of an array. FMI sets an array as a whole, so that the other
    /// elements are sent with it: they keep the values that were set last, or their start values.
    set_value(variable: &Variable, value: Value) -> Called;
    get(name: &str) -> Result<Value>;
    real(name: &str) -> Result<f64>;
    /// Sets the variable `name` from a text, for example from the command line: a number, `true` or
    /// `false`, or an item of an enumeration by its name or number.
    ///
    /// # Errors
    ///
    /// If the text is not a value of the variable's type, the FMU refuses the value, or the
    /// variable is a structural parameter of FMI 3.0 and the value differs from the value with
    /// which the FMU was opened.
    set(name: &str, text: &str) -> Result<()>;
    /// Enters event mode. The FMU must have been opened for Model Exchange.
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

    /// Sets the time derivatives of inputs, per s, in an FMU 2.0. In an FMU 3.0 the call does
    /// nothing, because FMI 3.0 passes new values of inputs within the step instead of derivatives.
    pub fn set_slopes(&mut self, references: &[u32], slopes: &[f64]) -> Called {
        each!(Instance, self, instance => Version::set_slopes(instance, references, slopes))
    }

    /// Simulates from `time` to `time + step`, s, while the Real inputs `references` change
    /// linearly. The inputs have already been set to `values`; `slopes` are their derivatives, per
    /// s. An FMU 3.0 receives further values within the step.
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

    /// Returns `true` if an FMU 2.0 has refused a step because it requests the end of the
    /// simulation (fmi2Terminated). Returns `false` for an FMU 3.0, because the error of the
    /// refused step already says this.
    pub fn wants_to_end(&mut self) -> bool {
        match self {
            Instance::V2(instance) => instance.boolean_status(fmi2::TERMINATED).unwrap_or(false),
            Instance::V3(_) => false, // the refusal says it
        }
    }

    /// Returns the change of the variables `unknowns` per unit of a change of the variables
    /// `knowns` in the direction `direction`, which has one component for each known. All variables
    /// must be scalars.
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

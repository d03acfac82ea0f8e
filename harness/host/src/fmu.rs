//! An FMU of either version, for a host that runs it by Co-Simulation or integrates it by Model Exchange.
//!
//! FMI 3.0 is driven without event mode and early return in Co-Simulation, as FMI 2.0: the FMU handles its events itself.
//! Inputs that change linearly within a step are set by their derivatives in FMI 2.0 and in intermediate update in FMI 3.0,
//! where the FMU provides it.

use std::path::Path;

use anyhow::Result;

use crate::archive::Archive;
pub use crate::c_abi::version::{CompletedStep, FmuState as State, Interface, Updated};
use crate::c_abi::version::{Version, described};
use crate::c_abi::{Called, Message};
use crate::description::{ModelDescription, Value, Variable};
use crate::{fmi2, fmi3};

/// An opened FMU: unpacked to a temporary directory, its binary loaded.
#[allow(clippy::large_enum_variant)] // made once and hardly moved
pub enum Fmu {
    /// FMI 2.0.
    V2(fmi2::Fmu),
    /// FMI 3.0.
    V3(fmi3::Fmu),
}

/// One instance; freed when dropped. Belongs to the thread that made it.
pub enum Instance<'fmu> {
    /// FMI 2.0.
    V2(fmi2::Instance<'fmu>),
    /// FMI 3.0.
    V3(fmi3::Instance<'fmu>),
}

/// Does the same with an FMU or an instance of either version.
macro_rules! each {
    ($type:ident, $of:expr, $one:ident => $do:expr) => {
        match $of {
            $type::V2($one) => $do,
            $type::V3($one) => $do,
        }
    };
}

impl Fmu {
    /// Opens a packed FMU and loads the binary for this platform.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Fmu::open_with(path, &[])
    }

    /// The same; of the settings it takes those that are structural parameters of FMI 3.0, which say how long arrays are. Every
    /// instance sets them before anything else, and the description has the elements that there are then.
    ///
    /// # Errors
    /// Also if the FMU refuses such a parameter.
    pub fn open_with(path: impl AsRef<Path>, settings: &[(String, String)]) -> Result<Self> {
        Fmu::open_for(Interface::CoSimulation, path, settings)
    }

    /// The same for a run from communication point to communication point: by Model Exchange if the FMU offers nothing else.
    pub fn open_to_run(path: impl AsRef<Path>, settings: &[(String, String)]) -> Result<Self> {
        let path = path.as_ref();
        let (_, description) = described(&Archive::open(path)?, path)?;
        let exchanges = description.co_simulation.is_none() && description.model_exchange.is_some();
        let interface = if exchanges { Interface::ModelExchange } else { Interface::CoSimulation };
        Fmu::open_for(interface, path, settings)
    }

    /// The same for one interface.
    pub fn open_for(
        interface: Interface,
        path: impl AsRef<Path>,
        settings: &[(String, String)],
    ) -> Result<Self> {
        let path = path.as_ref();
        let archive = Archive::open(path)?;
        let described = described(&archive, path)?;
        Ok(match described.1.is_fmi3() {
            false => {
                Fmu::V2(fmi2::Fmu::of_archive(&archive, described, path, interface, settings)?)
            }
            true => Fmu::V3(fmi3::Fmu::of_archive(&archive, described, path, interface, settings)?),
        })
    }

    /// Model description of the FMU.
    pub fn description(&self) -> &ModelDescription {
        each!(Fmu, self, fmu => fmu.description())
    }

    /// SHA-256 of the `.fmu` file, in hexadecimal digits.
    pub fn hash(&self) -> &str {
        each!(Fmu, self, fmu => fmu.hash())
    }

    /// SHA-256 of the binary that is loaded, in hexadecimal digits.
    pub fn binary_hash(&self) -> &str {
        each!(Fmu, self, fmu => fmu.binary_hash())
    }

    /// Changes of the whole process by loading the binary, such as the rounding mode.
    pub fn changed(&self) -> &[&'static str] {
        each!(Fmu, self, fmu => fmu.changed())
    }

    /// The file it was opened from.
    pub fn path(&self) -> &Path {
        each!(Fmu, self, fmu => fmu.path())
    }

    /// A new instance with logging on, for the interface that the FMU was opened for.
    pub fn instantiate(&self, name: &str) -> Called<Instance<'_>> {
        Ok(match self {
            Fmu::V2(fmu) => Instance::V2(fmu.instantiate(name)?),
            Fmu::V3(fmu) => Instance::V3(fmu.instantiate(name)?),
        })
    }
}

/// Declares methods that the instance of each version has itself.
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
    /// Everything logged since the last time somebody asked.
    take_messages() -> Vec<Message>;
    /// Returns the FMU's warnings since the last call.
    take_warnings() -> Vec<String>;
    /// Leaves initialization mode, ready for the first step.
    exit_initialization_mode() -> Called;
    /// Takes a snapshot. Must be given back with [`Instance::free_state`]; otherwise its memory is lost.
    get_state() -> Called<State>;
    /// Goes back to a snapshot of this instance.
    set_state(state: &State) -> Called;
    /// Writes a snapshot as bytes.
    serialize(state: &State) -> Called<Vec<u8>>;
    /// Makes a snapshot of such bytes.
    deserialize(bytes: &[u8]) -> Called<State>;
    /// Gives a snapshot of this instance back.
    free_state(state: State) -> Called;
    /// Reads Reals by reference.
    get_real(references: &[u32], values: &mut [f64]) -> Called;
    /// Sets Reals by reference.
    set_real(references: &[u32], values: &[f64]) -> Called;
    /// The value of a variable of the FMU's description.
    value(variable: &Variable) -> Called<Value>;
    /// Sets a variable, or an element of an array: the others keep what was set last, or their start values.
    set_value(variable: &Variable, value: Value) -> Called;
    /// The value of a variable by name.
    get(name: &str) -> Result<Value>;
    /// The value of a real variable.
    real(name: &str) -> Result<f64>;
    /// Sets a variable from text: a number, `true`/`false`, or an enumeration's value by name or number.
    ///
    /// # Errors
    /// If the text is not of its type, or the FMU refuses it. A structural parameter of FMI 3.0 keeps the value that it has
    /// since [`Fmu::open_with`].
    set(name: &str, text: &str) -> Result<()>;
    /// Enters event mode. As the calls that follow, for an FMU that was opened for Model Exchange.
    enter_event_mode() -> Called;
    /// Enters continuous-time mode.
    enter_continuous_time_mode() -> Called;
    /// Completes a step of the integrator.
    completed_integrator_step() -> Called<CompletedStep>;
    /// Sets the time, s.
    set_time(time: f64) -> Called;
    /// Sets the continuous states.
    set_continuous_states(x: &[f64]) -> Called;
    /// Reads the continuous states.
    continuous_states(x: &mut [f64]) -> Called;
    /// Reads the derivatives of the continuous states.
    derivatives(dx: &mut [f64]) -> Called;
    /// Reads the event indicators.
    event_indicators(z: &mut [f64]) -> Called;
    /// Reads the nominal values of the continuous states.
    nominals(x: &mut [f64]) -> Called;
}

impl<'fmu> Instance<'fmu> {
    /// Model description of the FMU.
    pub fn description(&self) -> &'fmu ModelDescription {
        each!(Instance, self, instance => instance.fmu().description())
    }

    /// Enters initialization mode: times in s; `tolerance` is relative.
    pub fn enter_initialization_mode(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Called {
        each!(Instance, self, instance => Version::initialize(instance, tolerance, start, stop))
    }

    /// Makes a step from `time` by `step`, s, inputs held.
    pub fn do_step(&mut self, time: f64, step: f64) -> Called {
        each!(Instance, self, instance => Version::step(instance, time, step))
    }

    /// Sets the slopes of inputs of an FMU 2.0 from now on, per s. An FMU 3.0 receives them only within the step.
    pub fn set_slopes(&mut self, references: &[u32], slopes: &[f64]) -> Called {
        each!(Instance, self, instance => Version::set_slopes(instance, references, slopes))
    }

    /// Makes a step through which these Reals, inputs that were set just now to `values`, go with `slopes`, per s. An
    /// FMU 3.0 hears of them in intermediate update.
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

    /// Returns true if the FMU has refused a step because it wants the simulation to end.
    pub fn wants_to_end(&mut self) -> bool {
        match self {
            Instance::V2(instance) => instance.boolean_status(fmi2::TERMINATED).unwrap_or(false),
            Instance::V3(_) => false, // the refusal says it
        }
    }

    /// Derivatives of unknowns in a direction of knowns, all of them scalars of the FMU.
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

    /// Updates the discrete states, in event mode.
    pub fn update_discrete_states(&mut self) -> Called<Updated> {
        each!(Instance, self, instance => Version::update(instance))
    }

    /// Numbers of continuous states and of event indicators.
    pub fn sizes(&mut self) -> Called<(usize, usize)> {
        each!(Instance, self, instance => Version::sizes(instance))
    }
}

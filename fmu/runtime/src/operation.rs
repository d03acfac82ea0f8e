//! What a host can ask of an instance, and in which instance state: data, not code.
//!
//! An operation is the same in every version of FMI; its name and the states in which it may be
//! called are the version's ([`Rule`]).

use std::fmt;

/// What an instance is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Interface {
    /// The host integrates.
    ModelExchange = 0,
    /// The FMU integrates.
    CoSimulation = 1,
}

impl Interface {
    /// As messages name it.
    pub const fn name(self) -> &'static str {
        match self {
            Interface::ModelExchange => "Model Exchange",
            Interface::CoSimulation => "Co-Simulation",
        }
    }
}

/// The state of an instance, as in the state machines of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum InstanceState {
    /// Just made, or reset.
    Instantiated = 0,
    /// Between fmi2EnterInitializationMode and fmi2ExitInitializationMode.
    Initialization = 1,
    /// Co-Simulation: ready for fmi2DoStep.
    Stepping = 2,
    /// Model Exchange: at an event.
    Event = 3,
    /// Model Exchange: between events.
    Continuous = 4,
    /// After fmi2Terminate: the last values can still be read.
    Terminated = 5,
    /// A step failed. The last values can be read, a saved state restored.
    Failed = 6,
    /// A call panicked. Only freeing is left.
    Fatal = 7,
    /// Model Exchange: event mode after initialization mode. Parameters can still be set, as
    /// OpenModelica does; the first call that goes on makes it an event as any other.
    Initialized = 8,
}

impl InstanceState {
    /// All of them, each at the place of its number.
    pub const ALL: [InstanceState; 9] = [
        InstanceState::Instantiated,
        InstanceState::Initialization,
        InstanceState::Stepping,
        InstanceState::Event,
        InstanceState::Continuous,
        InstanceState::Terminated,
        InstanceState::Failed,
        InstanceState::Fatal,
        InstanceState::Initialized,
    ];

    /// As messages name it.
    pub const fn name(self) -> &'static str {
        match self {
            InstanceState::Instantiated => "instantiated",
            InstanceState::Initialization => "initialization mode",
            InstanceState::Stepping => "stepping",
            InstanceState::Event | InstanceState::Initialized => "event mode",
            InstanceState::Continuous => "continuous-time mode",
            InstanceState::Terminated => "terminated",
            InstanceState::Failed => "step failed",
            InstanceState::Fatal => "fatal",
        }
    }

    /// The interface whose instances alone get there.
    pub const fn only_in(self) -> Option<Interface> {
        match self {
            InstanceState::Stepping => Some(Interface::CoSimulation),
            InstanceState::Event | InstanceState::Initialized | InstanceState::Continuous => {
                Some(Interface::ModelExchange)
            }
            _ => None,
        }
    }

    const fn bit(self) -> u16 {
        1 << self as u16
    }
}

/// The C types that values are got and set with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum CType {
    Real,
    Integer,
    Boolean,
    String,
}

/// A version of FMI's C interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0
    Fmi2,
}

/// What one version of FMI says of an operation.
#[derive(Debug)]
pub struct Rule {
    /// The function's name.
    pub name: &'static str,
    /// The states in which it may be called.
    allowed: u16,
}

/// Something that a host can ask of an instance.
#[derive(Debug)]
pub struct Operation {
    /// The C type of the values it passes, if that is its business.
    c_type: Option<CType>,
    /// The interface it belongs to, if not to both.
    only_in: Option<Interface>,
    fmi2: Rule,
}

const I: u16 = InstanceState::Instantiated.bit();
const M: u16 = InstanceState::Initialization.bit();
const S: u16 = InstanceState::Stepping.bit();
const E: u16 = InstanceState::Event.bit() | InstanceState::Initialized.bit();
const C: u16 = InstanceState::Continuous.bit();
const T: u16 = InstanceState::Terminated.bit();
const F: u16 = InstanceState::Failed.bit();
/// All but fatal.
const ANY: u16 = I | M | S | E | C | T | F;
/// All in which the model moves or has moved.
const RUN: u16 = S | E | C | T | F;

const fn both(name: &'static str, allowed: u16) -> Operation {
    Operation { c_type: None, only_in: None, fmi2: Rule { name, allowed } }
}

const fn of(c_type: CType, name: &'static str, allowed: u16) -> Operation {
    Operation { c_type: Some(c_type), ..both(name, allowed) }
}

/// Of Co-Simulation.
const fn cs(operation: Operation) -> Operation {
    Operation { only_in: Some(Interface::CoSimulation), ..operation }
}

/// Of Model Exchange.
const fn me(operation: Operation) -> Operation {
    Operation { only_in: Some(Interface::ModelExchange), ..operation }
}

#[allow(missing_docs)]
#[rustfmt::skip]
mod list {
    use super::CType::*;
    use super::*;
    pub static SET_DEBUG_LOGGING:        Operation = both("fmi2SetDebugLogging", ANY);
    pub static SETUP_EXPERIMENT:         Operation = both("fmi2SetupExperiment", I);
    pub static ENTER_INITIALIZATION:     Operation = both("fmi2EnterInitializationMode", I);
    pub static EXIT_INITIALIZATION:      Operation = both("fmi2ExitInitializationMode", M);
    pub static TERMINATE:                Operation = both("fmi2Terminate", S | E | C | F);
    pub static RESET:                    Operation = both("fmi2Reset", ANY);
    // Parameters and inputs can be read from the start; everything else has a
    // value from initialization mode on. Which variable can be set when is the
    // variable's business.
    pub static GET_REAL:                 Operation = of(Real, "fmi2GetReal", ANY);
    pub static GET_INTEGER:              Operation = of(Integer, "fmi2GetInteger", ANY);
    pub static GET_BOOLEAN:              Operation = of(Boolean, "fmi2GetBoolean", ANY);
    pub static GET_STRING:               Operation = of(String, "fmi2GetString", ANY);
    pub static SET_REAL:                 Operation = of(Real, "fmi2SetReal", I | M | S | E | C);
    pub static SET_INTEGER:              Operation = of(Integer, "fmi2SetInteger", I | M | S | E | C);
    pub static SET_BOOLEAN:              Operation = of(Boolean, "fmi2SetBoolean", I | M | S | E | C);
    pub static SET_STRING:               Operation = of(String, "fmi2SetString", I | M | S | E | C);
    pub static GET_FMU_STATE:            Operation = both("fmi2GetFMUstate", ANY);
    pub static SET_FMU_STATE:            Operation = both("fmi2SetFMUstate", ANY);
    pub static FREE_FMU_STATE:           Operation = both("fmi2FreeFMUstate", ANY | InstanceState::Fatal.bit());
    pub static SERIALIZED_SIZE:          Operation = both("fmi2SerializedFMUstateSize", ANY);
    pub static SERIALIZE:                Operation = both("fmi2SerializeFMUstate", ANY);
    pub static DESERIALIZE:              Operation = both("fmi2DeSerializeFMUstate", ANY);
    pub static DIRECTIONAL_DERIVATIVE:   Operation = of(Real, "fmi2GetDirectionalDerivative", M | RUN);

    pub static SET_INPUT_DERIVATIVES:    Operation = cs(of(Real, "fmi2SetRealInputDerivatives", I | M | S));
    pub static GET_OUTPUT_DERIVATIVES:   Operation = cs(of(Real, "fmi2GetRealOutputDerivatives", RUN));
    pub static DO_STEP:                  Operation = cs(both("fmi2DoStep", S));
    pub static CANCEL_STEP:              Operation = cs(both("fmi2CancelStep", S));
    pub static GET_STATUS:               Operation = cs(both("fmi2GetStatus", ANY));
    pub static GET_REAL_STATUS:          Operation = cs(both("fmi2GetRealStatus", ANY));
    pub static GET_INTEGER_STATUS:       Operation = cs(both("fmi2GetIntegerStatus", ANY));
    pub static GET_BOOLEAN_STATUS:       Operation = cs(both("fmi2GetBooleanStatus", ANY));
    pub static GET_STRING_STATUS:        Operation = cs(both("fmi2GetStringStatus", ANY));

    // The standard has this in continuous-time mode alone; OpenModelica up to 1.27 calls it in
    // the event mode after initialization too.
    pub static ENTER_EVENT:              Operation = me(both("fmi2EnterEventMode", E | C));
    pub static NEW_DISCRETE_STATES:      Operation = me(both("fmi2NewDiscreteStates", E));
    pub static ENTER_CONTINUOUS_TIME:    Operation = me(both("fmi2EnterContinuousTimeMode", E));
    pub static COMPLETED_STEP:           Operation = me(both("fmi2CompletedIntegratorStep", C));
    pub static SET_TIME:                 Operation = me(both("fmi2SetTime", E | C));
    // As above.
    pub static SET_CONTINUOUS_STATES:    Operation = me(both("fmi2SetContinuousStates", E | C));
    pub static GET_DERIVATIVES:          Operation = me(both("fmi2GetDerivatives", M | E | C | T | F));
    pub static GET_EVENT_INDICATORS:     Operation = me(both("fmi2GetEventIndicators", M | E | C | T | F));
    pub static GET_CONTINUOUS_STATES:    Operation = me(both("fmi2GetContinuousStates", M | E | C | T | F));
    pub static GET_NOMINALS:             Operation = me(both("fmi2GetNominalsOfContinuousStates", ANY));
}
pub use list::*;

/// A call of an operation in one version of FMI: what messages name.
#[derive(Clone, Copy, Debug)]
pub struct Call {
    operation: &'static Operation,
    version: Version,
}

impl Operation {
    /// It is called through the C interface of a version.
    #[inline]
    pub const fn call(&'static self, version: Version) -> Call {
        Call { operation: self, version }
    }
}

impl Call {
    #[inline]
    const fn rule(&self) -> &'static Rule {
        match self.version {
            Version::Fmi2 => &self.operation.fmi2,
        }
    }

    /// The function's name.
    pub const fn name(&self) -> &'static str {
        self.rule().name
    }

    /// The C type of the values it passes, if that is its business.
    #[inline]
    pub const fn c_type(&self) -> Option<CType> {
        self.operation.c_type
    }

    /// Whether it may be called in this state; if not, the message says where.
    #[inline]
    pub fn check(&self, interface: Interface, state: InstanceState) -> Result<(), Fault> {
        let foreign = self.operation.only_in.filter(|only| *only != interface);
        if foreign.is_none() && self.rule().allowed & state.bit() != 0 {
            return Ok(());
        }
        self.refuse(foreign, interface, state)
    }

    #[cold]
    fn refuse(
        &self,
        foreign: Option<Interface>,
        interface: Interface,
        state: InstanceState,
    ) -> Result<(), Fault> {
        if state == InstanceState::Fatal {
            let text = "an earlier call panicked; the instance can only be freed";
            return Err(Fault {
                severity: Severity::Fatal,
                text: format!("{}: {text}", self.name()),
            });
        }
        if let Some(other) = foreign {
            return Err(self.error(format_args!(
                "not allowed in state \"{}\": it belongs to {}, and this instance is for {}",
                state.name(),
                other.name(),
                interface.name()
            )));
        }
        let possible =
            InstanceState::ALL.iter().filter(|s| s.only_in().is_none_or(|only| only == interface));
        // To a host the first event mode is one as any other.
        let possible = possible.filter(|s| **s != InstanceState::Initialized);
        let allowed: Vec<_> =
            possible.filter(|s| self.rule().allowed & s.bit() != 0).map(|s| s.name()).collect();
        Err(self.error(format_args!(
            "not allowed in state \"{}\"; allowed in: {}",
            state.name(),
            allowed.join(", ")
        )))
    }

    /// This call failed.
    #[cold]
    pub fn error(&self, why: impl fmt::Display) -> Fault {
        Fault { severity: Severity::Error, text: format!("{}: {why}", self.name()) }
    }

    /// This call has no answer, and nothing is wrong with the instance.
    #[cold]
    pub fn discard(&self, why: impl fmt::Display) -> Fault {
        Fault { severity: Severity::Discard, text: format!("{}: {why}", self.name()) }
    }
}

/// How bad a failure is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// fmi2Discard
    Discard,
    /// fmi2Error
    Error,
    /// fmi2Fatal
    Fatal,
}

/// Why a call failed.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// What the call returns.
    pub severity: Severity,
    /// What the log says: the call, the variable, what is allowed.
    pub text: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_stand_at_their_number() {
        for (n, state) in InstanceState::ALL.iter().enumerate() {
            assert_eq!(*state as usize, n);
        }
    }

    const FMI2: Version = Version::Fmi2;
    const CS: Interface = Interface::CoSimulation;
    const ME: Interface = Interface::ModelExchange;

    #[test]
    fn refusal_names_call_state_and_allowed_states() {
        let fault = DO_STEP.call(FMI2).check(CS, InstanceState::Instantiated).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2DoStep: not allowed in state \"instantiated\"; allowed in: stepping"
        );
        let fault = TERMINATE.call(FMI2).check(ME, InstanceState::Initialization).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2Terminate: not allowed in state \"initialization mode\"; allowed in: event mode, \
             continuous-time mode, step failed"
        );
    }

    #[test]
    fn calls_of_the_other_interface_are_refused_and_say_so() {
        let fault = DO_STEP.call(FMI2).check(ME, InstanceState::Event).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2DoStep: not allowed in state \"event mode\": it belongs to Co-Simulation, and this \
             instance is for Model Exchange"
        );
        assert!(SET_TIME.call(FMI2).check(CS, InstanceState::Stepping).is_err());
    }

    #[test]
    fn after_a_panic_everything_is_fatal_but_freeing() {
        assert_eq!(
            GET_REAL.call(FMI2).check(CS, InstanceState::Fatal).unwrap_err().severity,
            Severity::Fatal
        );
        assert_eq!(
            DO_STEP.call(FMI2).check(ME, InstanceState::Fatal).unwrap_err().severity,
            Severity::Fatal
        );
        assert_eq!(FREE_FMU_STATE.call(FMI2).check(CS, InstanceState::Fatal), Ok(()));
    }
}

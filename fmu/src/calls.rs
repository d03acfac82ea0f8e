//! Which call is allowed in which state: data, not code.

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

/// Where an instance is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
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

impl Mode {
    /// All of them, each at the place of its number.
    pub const ALL: [Mode; 9] = [
        Mode::Instantiated,
        Mode::Initialization,
        Mode::Stepping,
        Mode::Event,
        Mode::Continuous,
        Mode::Terminated,
        Mode::Failed,
        Mode::Fatal,
        Mode::Initialized,
    ];

    /// As messages name it.
    pub const fn name(self) -> &'static str {
        match self {
            Mode::Instantiated => "instantiated",
            Mode::Initialization => "initialization mode",
            Mode::Stepping => "stepping",
            Mode::Event | Mode::Initialized => "event mode",
            Mode::Continuous => "continuous-time mode",
            Mode::Terminated => "terminated",
            Mode::Failed => "step failed",
            Mode::Fatal => "fatal",
        }
    }

    /// The interface whose instances alone get there.
    pub const fn only_in(self) -> Option<Interface> {
        match self {
            Mode::Stepping => Some(Interface::CoSimulation),
            Mode::Event | Mode::Initialized | Mode::Continuous => Some(Interface::ModelExchange),
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

/// A function of FMI 2.0 and the states in which it may be called.
#[derive(Debug)]
pub struct Call {
    /// The function's name.
    pub name: &'static str,
    /// The C type of the values it passes, if that is its business.
    pub c_type: Option<CType>,
    allowed: u16,
    /// The interface it belongs to, if not to both.
    only_in: Option<Interface>,
}

const I: u16 = Mode::Instantiated.bit();
const M: u16 = Mode::Initialization.bit();
const S: u16 = Mode::Stepping.bit();
const E: u16 = Mode::Event.bit() | Mode::Initialized.bit();
const C: u16 = Mode::Continuous.bit();
const T: u16 = Mode::Terminated.bit();
const F: u16 = Mode::Failed.bit();
/// All but fatal.
const ANY: u16 = I | M | S | E | C | T | F;
/// All in which the plant moves or has moved.
const RUN: u16 = S | E | C | T | F;

const fn call(name: &'static str, allowed: u16) -> Call {
    Call { name, c_type: None, allowed, only_in: None }
}

const fn of(c_type: CType, name: &'static str, allowed: u16) -> Call {
    Call { name, c_type: Some(c_type), allowed, only_in: None }
}

/// Of Co-Simulation.
const fn cs(call: Call) -> Call {
    Call { only_in: Some(Interface::CoSimulation), ..call }
}

/// Of Model Exchange.
const fn me(call: Call) -> Call {
    Call { only_in: Some(Interface::ModelExchange), ..call }
}

#[allow(missing_docs)]
#[rustfmt::skip]
mod list {
    use super::CType::*;
    use super::*;
    pub static SET_DEBUG_LOGGING:        Call = call("fmi2SetDebugLogging", ANY);
    pub static SETUP_EXPERIMENT:         Call = call("fmi2SetupExperiment", I);
    pub static ENTER_INITIALIZATION:     Call = call("fmi2EnterInitializationMode", I);
    pub static EXIT_INITIALIZATION:      Call = call("fmi2ExitInitializationMode", M);
    pub static TERMINATE:                Call = call("fmi2Terminate", S | E | C | F);
    pub static RESET:                    Call = call("fmi2Reset", ANY);
    // Parameters and inputs can be read from the start; everything else has a
    // value from initialization mode on. Which variable can be set when is the
    // variable's business.
    pub static GET_REAL:                 Call = of(Real, "fmi2GetReal", ANY);
    pub static GET_INTEGER:              Call = of(Integer, "fmi2GetInteger", ANY);
    pub static GET_BOOLEAN:              Call = of(Boolean, "fmi2GetBoolean", ANY);
    pub static GET_STRING:               Call = of(String, "fmi2GetString", ANY);
    pub static SET_REAL:                 Call = of(Real, "fmi2SetReal", I | M | S | E | C);
    pub static SET_INTEGER:              Call = of(Integer, "fmi2SetInteger", I | M | S | E | C);
    pub static SET_BOOLEAN:              Call = of(Boolean, "fmi2SetBoolean", I | M | S | E | C);
    pub static SET_STRING:               Call = of(String, "fmi2SetString", I | M | S | E | C);
    pub static GET_FMU_STATE:            Call = call("fmi2GetFMUstate", ANY);
    pub static SET_FMU_STATE:            Call = call("fmi2SetFMUstate", ANY);
    pub static FREE_FMU_STATE:           Call = call("fmi2FreeFMUstate", ANY | Mode::Fatal.bit());
    pub static SERIALIZED_SIZE:          Call = call("fmi2SerializedFMUstateSize", ANY);
    pub static SERIALIZE:                Call = call("fmi2SerializeFMUstate", ANY);
    pub static DESERIALIZE:              Call = call("fmi2DeSerializeFMUstate", ANY);
    pub static DIRECTIONAL_DERIVATIVE:   Call = of(Real, "fmi2GetDirectionalDerivative", M | RUN);

    pub static SET_INPUT_DERIVATIVES:    Call = cs(of(Real, "fmi2SetRealInputDerivatives", I | M | S));
    pub static GET_OUTPUT_DERIVATIVES:   Call = cs(of(Real, "fmi2GetRealOutputDerivatives", RUN));
    pub static DO_STEP:                  Call = cs(call("fmi2DoStep", S));
    pub static CANCEL_STEP:              Call = cs(call("fmi2CancelStep", S));
    pub static GET_STATUS:               Call = cs(call("fmi2GetStatus", ANY));
    pub static GET_REAL_STATUS:          Call = cs(call("fmi2GetRealStatus", ANY));
    pub static GET_INTEGER_STATUS:       Call = cs(call("fmi2GetIntegerStatus", ANY));
    pub static GET_BOOLEAN_STATUS:       Call = cs(call("fmi2GetBooleanStatus", ANY));
    pub static GET_STRING_STATUS:        Call = cs(call("fmi2GetStringStatus", ANY));

    // The standard has this in continuous-time mode alone; OpenModelica up to 1.27 calls it in
    // the event mode after initialization too.
    pub static ENTER_EVENT:              Call = me(call("fmi2EnterEventMode", E | C));
    pub static NEW_DISCRETE_STATES:      Call = me(call("fmi2NewDiscreteStates", E));
    pub static ENTER_CONTINUOUS_TIME:    Call = me(call("fmi2EnterContinuousTimeMode", E));
    pub static COMPLETED_STEP:           Call = me(call("fmi2CompletedIntegratorStep", C));
    pub static SET_TIME:                 Call = me(call("fmi2SetTime", E | C));
    // As above.
    pub static SET_CONTINUOUS_STATES:    Call = me(call("fmi2SetContinuousStates", E | C));
    pub static GET_DERIVATIVES:          Call = me(call("fmi2GetDerivatives", M | E | C | T | F));
    pub static GET_EVENT_INDICATORS:     Call = me(call("fmi2GetEventIndicators", M | E | C | T | F));
    pub static GET_CONTINUOUS_STATES:    Call = me(call("fmi2GetContinuousStates", M | E | C | T | F));
    pub static GET_NOMINALS:             Call = me(call("fmi2GetNominalsOfContinuousStates", ANY));
}
pub use list::*;

impl Call {
    /// Whether it may be called in this state; if not, the message says where.
    #[inline]
    pub fn check(&self, interface: Interface, mode: Mode) -> Result<(), Fault> {
        let foreign = self.only_in.filter(|only| *only != interface);
        if foreign.is_none() && self.allowed & mode.bit() != 0 {
            return Ok(());
        }
        self.refuse(foreign, interface, mode)
    }

    #[cold]
    fn refuse(
        &self,
        foreign: Option<Interface>,
        interface: Interface,
        mode: Mode,
    ) -> Result<(), Fault> {
        if mode == Mode::Fatal {
            let text = "an earlier call panicked; the instance can only be freed";
            return Err(Fault {
                severity: Severity::Fatal,
                text: format!("{}: {text}", self.name),
            });
        }
        if let Some(other) = foreign {
            return Err(self.error(format_args!(
                "not allowed in state \"{}\": it belongs to {}, and this instance was made for {}",
                mode.name(),
                other.name(),
                interface.name()
            )));
        }
        let possible =
            Mode::ALL.iter().filter(|m| m.only_in().is_none_or(|only| only == interface));
        // To a host the first event mode is one as any other.
        let possible = possible.filter(|m| **m != Mode::Initialized);
        let allowed: Vec<_> =
            possible.filter(|m| self.allowed & m.bit() != 0).map(|m| m.name()).collect();
        Err(self.error(format_args!(
            "not allowed in state \"{}\"; allowed in: {}",
            mode.name(),
            allowed.join(", ")
        )))
    }

    /// This call failed.
    #[cold]
    pub fn error(&self, why: impl fmt::Display) -> Fault {
        Fault { severity: Severity::Error, text: format!("{}: {why}", self.name) }
    }

    /// This call has no answer, and nothing is wrong with the instance.
    pub fn discard(&self, why: impl fmt::Display) -> Fault {
        Fault { severity: Severity::Discard, text: format!("{}: {why}", self.name) }
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
    fn modes_stand_at_their_number() {
        for (n, mode) in Mode::ALL.iter().enumerate() {
            assert_eq!(*mode as usize, n);
        }
    }

    const CS: Interface = Interface::CoSimulation;
    const ME: Interface = Interface::ModelExchange;

    #[test]
    fn refusal_names_call_state_and_allowed_states() {
        let fault = DO_STEP.check(CS, Mode::Instantiated).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2DoStep: not allowed in state \"instantiated\"; allowed in: stepping"
        );
        let fault = TERMINATE.check(ME, Mode::Initialization).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2Terminate: not allowed in state \"initialization mode\"; allowed in: event mode, \
             continuous-time mode, step failed"
        );
    }

    #[test]
    fn calls_of_the_other_interface_are_refused_and_say_so() {
        let fault = DO_STEP.check(ME, Mode::Event).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2DoStep: not allowed in state \"event mode\": it belongs to Co-Simulation, and this \
             instance was made for Model Exchange"
        );
        assert!(SET_TIME.check(CS, Mode::Stepping).is_err());
    }

    #[test]
    fn after_a_panic_everything_is_fatal_but_freeing() {
        assert_eq!(GET_REAL.check(CS, Mode::Fatal).unwrap_err().severity, Severity::Fatal);
        assert_eq!(DO_STEP.check(ME, Mode::Fatal).unwrap_err().severity, Severity::Fatal);
        assert_eq!(FREE_FMU_STATE.check(CS, Mode::Fatal), Ok(()));
    }
}

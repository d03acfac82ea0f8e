//! Calls of a host as data: the function's name and the instance states in which it is allowed, and the message if it is not.
//!
//! The calls themselves are listed by each version of FMI (see [`Version`](crate::version::Version)).

use std::fmt;

/// Interface type of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Interface {
    /// The host integrates.
    ModelExchange = 0,
    /// The FMU integrates.
    CoSimulation = 1,
}

impl Interface {
    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Interface::ModelExchange => "Model Exchange",
            Interface::CoSimulation => "Co-Simulation",
        }
    }
}

/// Handler of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Events {
    /// The FMU, within the steps that it makes.
    InStep = 0,
    /// The host, in event mode: what is discrete changes there alone.
    ByHost = 1,
    /// The FMU, within the steps that it makes; but what is discrete is shown to the host in event mode alone.
    Reported = 2,
}

impl Events {
    /// All of them, each at the place of its number.
    pub const ALL: [Events; 3] = [Events::InStep, Events::ByHost, Events::Reported];
}

/// The state of an instance, as in the state machines of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum InstanceState {
    /// Just made, or reset.
    Instantiated = 0,
    /// Parameters and inputs are set, initial values can be read.
    Initialization = 1,
    /// Co-Simulation: ready for a step.
    Stepping = 2,
    /// At an event that the host handles.
    Event = 3,
    /// Model Exchange: between events.
    Continuous = 4,
    /// The simulation has ended: the last values can still be read.
    Terminated = 5,
    /// A step failed. The last values can be read, a saved state restored.
    Failed = 6,
    /// A call panicked. Only freeing is left.
    Fatal = 7,
    /// Event mode after initialization mode. Parameters can still be set, as
    /// OpenModelica does; the first call that goes on makes it an event as any other.
    Initialized = 8,
    /// Before initialization mode: structural parameters are set.
    Configuration = 9,
    /// Within a step that the host looks into.
    Intermediate = 10,
}

impl InstanceState {
    /// All of them, each at the place of its number.
    pub const ALL: [InstanceState; 11] = [
        InstanceState::Instantiated,
        InstanceState::Initialization,
        InstanceState::Stepping,
        InstanceState::Event,
        InstanceState::Continuous,
        InstanceState::Terminated,
        InstanceState::Failed,
        InstanceState::Fatal,
        InstanceState::Initialized,
        InstanceState::Configuration,
        InstanceState::Intermediate,
    ];

    /// Name in messages.
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
            InstanceState::Configuration => "configuration mode",
            InstanceState::Intermediate => "intermediate update",
        }
    }

    /// Returns true if an instance for this interface and with this policy can reach the state and stay in it.
    pub fn is_reachable(self, interface: Interface, events: Events) -> bool {
        match self {
            InstanceState::Stepping => interface == Interface::CoSimulation,
            // Calls come and go there; no saved state is of them.
            InstanceState::Configuration | InstanceState::Intermediate => false,
            InstanceState::Continuous => interface == Interface::ModelExchange,
            InstanceState::Event | InstanceState::Initialized => events != Events::InStep,
            _ => true,
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
    /// Enumeration, in versions with a type for it.
    Enumeration,
    /// Structural parameter, in versions with a type for it.
    Size,
    Boolean,
    String,
}

/// Sets of instance states, to write down where a call is allowed.
#[allow(missing_docs)]
pub(crate) mod states {
    use super::InstanceState;

    pub const I: u16 = InstanceState::Instantiated.bit();
    pub const M: u16 = InstanceState::Initialization.bit();
    pub const S: u16 = InstanceState::Stepping.bit();
    pub const E: u16 = InstanceState::Event.bit() | InstanceState::Initialized.bit();
    pub const C: u16 = InstanceState::Continuous.bit();
    pub const T: u16 = InstanceState::Terminated.bit();
    pub const F: u16 = InstanceState::Failed.bit();
    /// All but fatal.
    pub const ANY: u16 = I | M | S | E | C | T | F;
    /// All in which the model moves or has moved.
    pub const RUN: u16 = S | E | C | T | F;
    pub const FATAL: u16 = InstanceState::Fatal.bit();
    pub const CONFIGURATION: u16 = InstanceState::Configuration.bit();
    pub const INTERMEDIATE: u16 = InstanceState::Intermediate.bit();
}

/// A function of one version of FMI, as far as an instance is concerned.
#[derive(Debug)]
pub struct Call {
    /// The function's name, which messages begin with.
    pub name: &'static str,
    /// The states in which it may be called.
    allowed: u16,
    /// The C type of the values it passes, if that is its business.
    pub c_type: Option<CType>,
    /// The interface it belongs to, if not to both.
    only_in: Option<Interface>,
}

impl Call {
    /// A function that may be called in some [`states`].
    pub(crate) const fn new(name: &'static str, allowed: u16) -> Call {
        Call { name, allowed, c_type: None, only_in: None }
    }

    /// Makes it a call that passes values of a type.
    pub(crate) const fn of(self, c_type: CType) -> Call {
        Call { c_type: Some(c_type), ..self }
    }

    /// Makes it a call of one interface only.
    pub(crate) const fn only_in(self, interface: Interface) -> Call {
        Call { only_in: Some(interface), ..self }
    }

    /// Refuses a call that is not allowed in this state; the message names the states in which it is.
    #[inline]
    pub fn check(
        &self,
        interface: Interface,
        events: Events,
        state: InstanceState,
    ) -> Result<(), Fault> {
        let foreign = self.only_in.filter(|only| *only != interface);
        if foreign.is_none() && self.allowed & state.bit() != 0 {
            return Ok(());
        }
        self.refuse(foreign, interface, events, state)
    }

    #[cold]
    fn refuse(
        &self,
        foreign: Option<Interface>,
        interface: Interface,
        events: Events,
        state: InstanceState,
    ) -> Result<(), Fault> {
        if state == InstanceState::Fatal {
            let text = "an earlier call panicked; the instance can only be freed";
            return Err(Fault {
                severity: Severity::Fatal,
                text: format!("{}: {text}", self.name),
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
        let passing = [InstanceState::Configuration, InstanceState::Intermediate];
        let possible = InstanceState::ALL
            .iter()
            .filter(|s| s.is_reachable(interface, events) || passing.contains(s));
        // To a host the first event mode is one as any other.
        let possible = possible.filter(|s| **s != InstanceState::Initialized);
        let allowed: Vec<_> =
            possible.filter(|s| self.allowed & s.bit() != 0).map(|s| s.name()).collect();
        Err(self.error(format_args!(
            "not allowed in state \"{}\"; allowed in: {}",
            state.name(),
            allowed.join(", ")
        )))
    }

    /// Returns the fault of a failed call.
    #[cold]
    pub fn error(&self, why: impl fmt::Display) -> Fault {
        Fault { severity: Severity::Error, text: format!("{}: {why}", self.name) }
    }

    /// Returns the fault of a call without an answer; the instance is unharmed.
    #[cold]
    pub fn discard(&self, why: impl fmt::Display) -> Fault {
        Fault { severity: Severity::Discard, text: format!("{}: {why}", self.name) }
    }
}

/// Severity of a failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The call has no answer.
    Discard,
    /// The call was refused or failed.
    Error,
    /// The instance is unusable.
    Fatal,
}

/// Failure of a call.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Status to return.
    pub severity: Severity,
    /// Message for the log: the call, the variable, the allowed values.
    pub text: String,
}

#[cfg(test)]
mod tests {
    use super::Events::{ByHost, InStep};
    use super::*;
    use crate::v2::{FREE_STATE, Fmi2, GET_REAL};
    use crate::version::Version;

    #[test]
    fn states_stand_at_their_number() {
        for (n, state) in InstanceState::ALL.iter().enumerate() {
            assert_eq!(*state as usize, n);
        }
    }

    const CS: Interface = Interface::CoSimulation;
    const ME: Interface = Interface::ModelExchange;

    #[test]
    fn refusal_names_call_state_and_allowed_states() {
        let fault = Fmi2::DO_STEP.check(CS, InStep, InstanceState::Instantiated).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2DoStep: not allowed in state \"instantiated\"; allowed in: stepping"
        );
        let fault = Fmi2::TERMINATE.check(ME, ByHost, InstanceState::Initialization).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2Terminate: not allowed in state \"initialization mode\"; allowed in: event mode, \
             continuous-time mode, step failed"
        );
    }

    #[test]
    fn calls_of_the_other_interface_are_refused_and_say_so() {
        let fault = Fmi2::DO_STEP.check(ME, ByHost, InstanceState::Event).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2DoStep: not allowed in state \"event mode\": it belongs to Co-Simulation, and this \
             instance is for Model Exchange"
        );
        assert!(Fmi2::SET_TIME.check(CS, InStep, InstanceState::Stepping).is_err());
    }

    #[test]
    fn after_a_panic_everything_is_fatal_but_freeing() {
        assert_eq!(
            GET_REAL.check(CS, InStep, InstanceState::Fatal).unwrap_err().severity,
            Severity::Fatal
        );
        assert_eq!(
            Fmi2::DO_STEP.check(ME, ByHost, InstanceState::Fatal).unwrap_err().severity,
            Severity::Fatal
        );
        assert_eq!(FREE_STATE.check(CS, InStep, InstanceState::Fatal), Ok(()));
    }
}

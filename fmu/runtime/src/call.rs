//! Properties of the functions of FMI: name, the instance states in which they are allowed, and the error message if a
//! call is not allowed.
//!
//! Each version of FMI lists its functions (see [`Version`](crate::version::Version)).

use std::fmt;

/// Type of the interface for which a host creates an instance: in Model Exchange the host integrates the equations of the
/// FMU, in Co-Simulation the FMU does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs)]
pub enum Interface {
    ModelExchange = 0,
    CoSimulation = 1,
}

#[allow(missing_docs)]
impl Interface {
    pub const fn name(self) -> &'static str {
        match self {
            Interface::ModelExchange => "Model Exchange",
            Interface::CoSimulation => "Co-Simulation",
        }
    }
}

/// The side that handles events, such as the start of sticking: the FMU within its steps, or the host in event mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs)]
pub enum Events {
    InStep = 0,
    /// The host handles events in event mode. Discrete values change only there.
    ByHost = 1,
    /// The FMU handles events within its steps, but the host sees changes of discrete values only in event mode.
    Reported = 2,
}

#[allow(missing_docs)]
impl Events {
    pub const ALL: [Events; 3] = [Events::InStep, Events::ByHost, Events::Reported];
}

/// The state of an instance in the state machine of the FMI standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs)]
pub enum InstanceState {
    Instantiated = 0,
    Initialization = 1,
    Stepping = 2,
    Event = 3,
    Continuous = 4,
    Terminated = 5,
    /// A step has failed. The host can read the last values and restore a saved state.
    Failed = 6,
    /// A call has panicked. The host can only free the instance.
    Fatal = 7,
    /// Event mode directly after initialization mode. Parameters can still be set here, because OpenModelica sets them here.
    /// The next call that continues the simulation changes the state to `Event`.
    Initialized = 8,
    Configuration = 9,
    Intermediate = 10,
}

#[allow(missing_docs)]
impl InstanceState {
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

    /// Returns true if an instance with this interface and this handling of events can enter this state and stay in it.
    pub fn is_reachable(self, interface: Interface, events: Events) -> bool {
        match self {
            InstanceState::Stepping => interface == Interface::CoSimulation,
            // These states exist only during a call and are never saved.
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

/// C type of the values that an FMI function gets or sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum CType {
    Real,
    Integer,
    /// Enumeration, which FMI 2.0 reads as an Integer and FMI 3.0 by the functions of Int64.
    Enumeration,
    /// Structural parameter of FMI 3.0, which the functions of UInt64 get and set.
    Size,
    Boolean,
    String,
}

/// Sets of instance states in which a function is allowed. A set is an integer with one bit for each state.
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
    pub const ANY: u16 = I | M | S | E | C | T | F;
    /// All states after initialization mode, except `Fatal`.
    pub const RUN: u16 = S | E | C | T | F;
    pub const FATAL: u16 = InstanceState::Fatal.bit();
    pub const CONFIGURATION: u16 = InstanceState::Configuration.bit();
    pub const INTERMEDIATE: u16 = InstanceState::Intermediate.bit();
}

/// A function of one version of FMI, with the conditions under which a host may call it.
#[derive(Debug)]
pub struct Call {
    /// Name of the function, with which error messages begin.
    pub name: &'static str,
    allowed: u16,
    /// The C type of the values if the function gets or sets variables; `None` for all other functions.
    pub c_type: Option<CType>,
    only_in: Option<Interface>,
}

impl Call {
    pub(crate) const fn new(name: &'static str, allowed: u16) -> Call {
        Call { name, allowed, c_type: None, only_in: None }
    }

    /// Checks that the host may make this call on an instance with this `interface`, this handling of `events` and this
    /// present `state`.
    ///
    /// # Errors
    /// If the call is not allowed; the message lists the states in which it is allowed.
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
                "not allowed in state \"{}\": the function belongs to {}, but this instance is for {}",
                state.name(),
                other.name(),
                interface.name()
            )));
        }
        let passing = [InstanceState::Configuration, InstanceState::Intermediate];
        let possible = InstanceState::ALL
            .iter()
            .filter(|s| s.is_reachable(interface, events) || passing.contains(s));
        // The message does not distinguish the first event mode from any other.
        let possible = possible.filter(|s| **s != InstanceState::Initialized);
        let allowed: Vec<_> =
            possible.filter(|s| self.allowed & s.bit() != 0).map(|s| s.name()).collect();
        Err(self.error(format_args!(
            "not allowed in state \"{}\"; allowed in: {}",
            state.name(),
            allowed.join(", ")
        )))
    }

    /// Returns a fault with the status Error, because the call was refused or has failed.
    #[cold]
    pub fn error(&self, why: impl fmt::Display) -> Fault {
        Fault { severity: Severity::Error, text: format!("{}: {why}", self.name) }
    }

    /// Returns a fault with the status Discard, because the result of the call cannot be computed and
    /// the instance is unchanged.
    #[cold]
    pub fn discard(&self, why: impl fmt::Display) -> Fault {
        Fault { severity: Severity::Discard, text: format!("{}: {why}", self.name) }
    }
}

pub(crate) const fn typed(c_type: CType, name: &'static str, allowed: u16) -> Call {
    Call { c_type: Some(c_type), ..Call::new(name, allowed) }
}

pub(crate) const fn cs(call: Call) -> Call {
    Call { only_in: Some(Interface::CoSimulation), ..call }
}

pub(crate) const fn me(call: Call) -> Call {
    Call { only_in: Some(Interface::ModelExchange), ..call }
}

/// Severity of a fault, from which the status follows that the FMI function returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Severity {
    Discard,
    Error,
    Fatal,
}

#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Fault {
    pub severity: Severity,
    /// Message for the log, which names the function and the variable and states the allowed values.
    pub text: String,
}

#[cfg(test)]
mod tests {
    use super::Events::{ByHost, InStep};
    use super::*;
    use crate::v2::{FREE_STATE, Fmi2, GET_REAL};
    use crate::version::Version;

    #[test]
    fn the_number_of_each_instance_state_is_its_position_in_the_list() {
        for (n, state) in InstanceState::ALL.iter().enumerate() {
            assert_eq!(*state as usize, n);
        }
    }

    const CS: Interface = Interface::CoSimulation;
    const ME: Interface = Interface::ModelExchange;

    #[test]
    fn the_message_of_a_refused_call_names_its_state_and_the_allowed_states() {
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
    fn calls_of_model_exchange_are_refused_in_co_simulation_and_the_reverse() {
        let fault = Fmi2::DO_STEP.check(ME, ByHost, InstanceState::Event).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2DoStep: not allowed in state \"event mode\": the function belongs to \
             Co-Simulation, but this instance is for Model Exchange"
        );
        assert!(Fmi2::SET_TIME.check(CS, InStep, InstanceState::Stepping).is_err());
    }

    #[test]
    fn after_a_panic_every_call_except_freeing_returns_fatal() {
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

//! Which call is allowed in which state: data, not code.

use std::fmt;

/// Where an instance is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    /// Just made, or reset.
    Instantiated = 0,
    /// Between fmi2EnterInitializationMode and fmi2ExitInitializationMode.
    Initialization = 1,
    /// Ready for fmi2DoStep.
    Stepping = 2,
    /// After fmi2Terminate: the last values can still be read.
    Terminated = 3,
    /// A step failed. The last values can be read, a saved state restored.
    Failed = 4,
    /// A call panicked. Only freeing is left.
    Fatal = 5,
}

impl Mode {
    /// All of them, each at the place of its number.
    pub const ALL: [Mode; 6] = [
        Mode::Instantiated,
        Mode::Initialization,
        Mode::Stepping,
        Mode::Terminated,
        Mode::Failed,
        Mode::Fatal,
    ];

    /// As messages name it.
    pub const fn name(self) -> &'static str {
        match self {
            Mode::Instantiated => "instantiated",
            Mode::Initialization => "initialization mode",
            Mode::Stepping => "stepping",
            Mode::Terminated => "terminated",
            Mode::Failed => "step failed",
            Mode::Fatal => "fatal",
        }
    }

    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// A function of FMI 2.0 and the states in which it may be called.
#[derive(Debug)]
pub struct Call {
    /// The function's name.
    pub name: &'static str,
    /// The C type of the values it passes: "" if that is not its business.
    pub c_type: &'static str,
    allowed: u8,
}

const I: u8 = Mode::Instantiated.bit();
const M: u8 = Mode::Initialization.bit();
const S: u8 = Mode::Stepping.bit();
const T: u8 = Mode::Terminated.bit();
const F: u8 = Mode::Failed.bit();
/// All but fatal.
const ANY: u8 = I | M | S | T | F;

const fn call(name: &'static str, allowed: u8) -> Call {
    Call { name, c_type: "", allowed }
}

const fn of(c_type: &'static str, name: &'static str, allowed: u8) -> Call {
    Call { name, c_type, allowed }
}

#[allow(missing_docs)]
#[rustfmt::skip]
mod list {
    use super::*;
    pub static SET_DEBUG_LOGGING:        Call = call("fmi2SetDebugLogging", ANY);
    pub static SETUP_EXPERIMENT:         Call = call("fmi2SetupExperiment", I);
    pub static ENTER_INITIALIZATION:     Call = call("fmi2EnterInitializationMode", I);
    pub static EXIT_INITIALIZATION:      Call = call("fmi2ExitInitializationMode", M);
    pub static TERMINATE:                Call = call("fmi2Terminate", S | F);
    pub static RESET:                    Call = call("fmi2Reset", ANY);
    // Parameters and inputs can be read from the start; everything else has a
    // value from initialization mode on. Parameters are fixed once that ends.
    pub static GET_REAL:                 Call = of("Real", "fmi2GetReal", ANY);
    pub static GET_INTEGER:              Call = of("Integer", "fmi2GetInteger", ANY);
    pub static GET_BOOLEAN:              Call = of("Boolean", "fmi2GetBoolean", ANY);
    pub static GET_STRING:               Call = of("String", "fmi2GetString", ANY);
    pub static SET_REAL:                 Call = of("Real", "fmi2SetReal", I | M | S);
    pub static SET_INTEGER:              Call = of("Integer", "fmi2SetInteger", I | M | S);
    pub static SET_BOOLEAN:              Call = of("Boolean", "fmi2SetBoolean", I | M | S);
    pub static SET_STRING:               Call = of("String", "fmi2SetString", I | M | S);
    pub static GET_FMU_STATE:            Call = call("fmi2GetFMUstate", ANY);
    pub static SET_FMU_STATE:            Call = call("fmi2SetFMUstate", ANY);
    pub static FREE_FMU_STATE:           Call = call("fmi2FreeFMUstate", ANY | Mode::Fatal.bit());
    pub static SERIALIZED_SIZE:          Call = call("fmi2SerializedFMUstateSize", ANY);
    pub static SERIALIZE:                Call = call("fmi2SerializeFMUstate", ANY);
    pub static DESERIALIZE:              Call = call("fmi2DeSerializeFMUstate", ANY);
    pub static DIRECTIONAL_DERIVATIVE:   Call = of("Real", "fmi2GetDirectionalDerivative", M | S | T | F);
    pub static SET_INPUT_DERIVATIVES:    Call = of("Real", "fmi2SetRealInputDerivatives", I | M | S);
    pub static GET_OUTPUT_DERIVATIVES:   Call = of("Real", "fmi2GetRealOutputDerivatives", M | S | T | F);
    pub static DO_STEP:                  Call = call("fmi2DoStep", S);
    pub static CANCEL_STEP:              Call = call("fmi2CancelStep", S);
    pub static GET_STATUS:               Call = call("fmi2GetStatus", ANY);
    pub static GET_REAL_STATUS:          Call = call("fmi2GetRealStatus", ANY);
    pub static GET_INTEGER_STATUS:       Call = call("fmi2GetIntegerStatus", ANY);
    pub static GET_BOOLEAN_STATUS:       Call = call("fmi2GetBooleanStatus", ANY);
    pub static GET_STRING_STATUS:        Call = call("fmi2GetStringStatus", ANY);
}
pub use list::*;

impl Call {
    /// Whether it may be called in this state; if not, the message says where.
    pub fn check(&self, mode: Mode) -> Result<(), Fault> {
        if self.allowed & mode.bit() != 0 {
            return Ok(());
        }
        if mode == Mode::Fatal {
            let text = "an earlier call panicked; the instance can only be freed";
            return Err(Fault {
                severity: Severity::Fatal,
                text: format!("{}: {text}", self.name),
            });
        }
        let allowed: Vec<_> =
            Mode::ALL.iter().filter(|m| self.allowed & m.bit() != 0).map(|m| m.name()).collect();
        Err(self.error(format_args!(
            "not allowed in state \"{}\"; allowed in: {}",
            mode.name(),
            allowed.join(", ")
        )))
    }

    /// This call failed.
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

    #[test]
    fn refusal_names_call_state_and_allowed_states() {
        let fault = DO_STEP.check(Mode::Instantiated).unwrap_err();
        assert_eq!(
            fault.text,
            "fmi2DoStep: not allowed in state \"instantiated\"; allowed in: stepping"
        );
    }

    #[test]
    fn after_a_panic_everything_is_fatal_but_freeing() {
        assert_eq!(GET_REAL.check(Mode::Fatal).unwrap_err().severity, Severity::Fatal);
        assert_eq!(FREE_FMU_STATE.check(Mode::Fatal), Ok(()));
    }
}

//! Reasons why an integrator refuses a step.

use alloc::string::String;

/// Reason why a step is refused; its text is for the user. The state is then the same as before the step. Times are in s
/// since the start of the call, or after [`StepError::delayed`] since another instant.
#[derive(Clone, Debug, PartialEq)]
pub enum StepError {
    Length {
        h: f64,
    },
    NotFinite {
        time: f64,
    },
    /// The call needs more internal integration steps than `solver.max_steps`, and has reached `time`. `advice` is the end
    /// of the message: what the user of this model can change other than the communication step and `solver.max_steps`.
    TooManySteps {
        time: f64,
        max_steps: usize,
        advice: &'static str,
    },
    Model(String),
}

impl StepError {
    /// Returns true if a shorter step may succeed, because the motion itself is still within the model's range.
    pub fn shorter_may_succeed(&self) -> bool {
        matches!(self, StepError::TooManySteps { .. } | StepError::NotFinite { .. })
    }
}

impl core::fmt::Display for StepError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            StepError::Length { h } => {
                write!(f, "the length of the step is {h} s (allowed: a finite length above 0)")
            }
            StepError::NotFinite { time } => write!(
                f,
                "the motion is no longer finite at t = {time} s: check that inputs and their \
                 derivatives are finite and not too large"
            ),
            StepError::TooManySteps { time, max_steps, advice } => write!(
                f,
                "the step stopped at t = {time} s after solver.max_steps = {max_steps} internal \
                 steps: use shorter communication steps, a looser tolerance or a larger \
                 solver.max_steps{advice}"
            ),
            StepError::Model(why) => f.write_str(why),
        }
    }
}

impl core::error::Error for StepError {}

impl StepError {
    /// Returns the same error with `begin`, s, added to its time. A time since the start of a part
    /// of a call thus becomes a time since the start of the call.
    pub fn delayed(mut self, begin: f64) -> StepError {
        if let StepError::NotFinite { time } | StepError::TooManySteps { time, .. } = &mut self {
            *time += begin;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    #[test]
    fn every_solver_error_names_its_cause_and_time() {
        let says = |error: StepError, parts: &[&str]| {
            let text = error.to_string();
            assert!(parts.iter().all(|part| text.contains(part)), "{text}");
        };
        says(StepError::Length { h: -1.5 }, &["-1.5 s", "above 0"]);
        says(StepError::NotFinite { time: 2.5 }.delayed(1.0), &["t = 3.5 s", "inputs"]);
        let many = StepError::TooManySteps { time: 0.5, max_steps: 7, advice: ", or rest" };
        says(
            many.delayed(1.0),
            &["t = 1.5 s", "solver.max_steps = 7", "solver.max_steps, or rest"],
        );
        says(StepError::Model("the tank is empty".into()).delayed(1.0), &["the tank is empty"]);
    }
}

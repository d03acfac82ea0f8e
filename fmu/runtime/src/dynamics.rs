//! The interface that a model implements to become an FMU.

use std::fmt::Debug;

pub use crate::clock::Instant;

/// Reason why a model could not compute a step; `text` is a message for the user.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct StepFailure {
    pub text: String,
    /// True if the step may succeed if the host tries it again with a smaller size.
    pub shorter_may_succeed: bool,
}

/// Creates a failure after which a shorter step may succeed, for example because the step needed too many internal steps.
impl From<&str> for StepFailure {
    fn from(text: &str) -> StepFailure {
        StepFailure { text: text.into(), shorter_may_succeed: true }
    }
}

/// How a step of [`Model::step_to_event`] has ended.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum StepEnd {
    End,
    /// The step has reached its end, and there is an event at that instant.
    EventAtEnd,
    /// The step has stopped at an event before its end. The number is the time from the start of
    /// the step to the event, s.
    Event(f64),
}

/// A dynamic system with inputs, parameters, continuous states and events.
///
/// A clone of the model is a saved state, so that a model must not keep data elsewhere. Times are in s. Functions that a
/// smooth model without events does not need have a default implementation.
pub trait Dynamics: Clone + Debug + Sized + 'static {
    /// All parameters of the model; their default values are the start values.
    type Parameters: Clone + Debug + Default;
    /// All inputs, each with its present value and its slope over the step. The default contains the start values,
    /// and slopes of 0.
    type Inputs: Copy + Debug + Default;
    /// All values that follow from states and inputs at one instant. A value of this type can also contain the directional
    /// derivatives of the outputs.
    type Outputs: Copy + Debug;
    /// Data from which [`Model::revert`] restores the discrete values that [`Model::apply_present_inputs`] has changed; `()` for
    /// a model without events.
    type Discrete: Default;

    /// True if outputs also depend on the inputs' slopes, for example because an output is a time derivative.
    const OUTPUTS_USE_SLOPES: bool = false;

    /// Name of the parameter that counts the elements that have event indicators, for example the tanks. Each element
    /// has the same number of indicators, in the order of the elements. `None` if the number of indicators does not
    /// depend on a parameter.
    const INDICATORS_OF: Option<&'static str> = None;

    /// Creates the model at the start of the simulation, with the inputs at that time. `tolerance` is the relative
    /// tolerance of the integration.
    ///
    /// # Errors
    /// The messages of all problems with combinations of parameters. Each parameter is within its own range.
    fn new(
        parameters: &Self::Parameters,
        inputs: &Self::Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Self, Vec<String>>;

    /// Returns warnings, one sentence each, if parameters or initial inputs are outside the range in which
    /// the model was verified.
    fn warnings(&self, parameters: &Self::Parameters, inputs: &Self::Inputs) -> Vec<String> {
        let _ = (parameters, inputs);
        Vec::new()
    }

    /// Returns the reason why a parameter has no effect although its part of the model is in use, as "name = value" of the
    /// parameter that replaces it. `name` is the name in the table, and `indices` are the indices of the element, from 0
    /// (empty for a scalar). The runtime warns about such parameters if they differ from their start values. It does not
    /// warn about parameters of parts that are switched off, because hosts often use the same parameters for several models.
    fn overridden(parameters: &Self::Parameters, name: &str, indices: &[usize]) -> Option<String> {
        let _ = (parameters, name, indices);
        None
    }

    /// Appends the states of the model to `words` for a saved state; the runtime saves parameters and inputs. The number of
    /// words is always [`About::saved_words`](crate::table::About::saved_words).
    fn save(&self, words: &mut Vec<u64>);

    /// Restores a saved state of a model with the same parameters. Returns `None` if the words are not a valid state.
    fn resume(parameters: &Self::Parameters, words: &[u64], tolerance: f64) -> Option<Self>;

    /// Advances by exactly `h` > 0 seconds while the inputs change with their slopes. If an error is returned, the model is
    /// unchanged. It allocates no memory unless it fails.
    fn step(&mut self, inputs: &Self::Inputs, h: f64) -> Result<(), StepFailure>;

    /// Advances as [`Model::step`] does, but stops at the first event. If a second step follows from this event to the end of the
    /// first step with the same inputs, both must give bit-identically the result of one whole step.
    fn step_to_event(&mut self, inputs: &Self::Inputs, h: f64) -> Result<StepEnd, StepFailure> {
        self.step(inputs, h).map(|()| StepEnd::End)
    }

    /// Applies the discrete changes that the present inputs cause, as [`Model::apply_present_inputs`] does, but permanently.
    fn take_present_inputs(&mut self, inputs: &Self::Inputs) {
        let _ = inputs;
    }

    /// Returns the outputs for the present states and the given inputs.
    fn outputs(&mut self, inputs: &Self::Inputs) -> Self::Outputs;

    /// Computes only the outputs that are integers, enumerations or Booleans, with the values of [`Model::outputs`], and
    /// writes them to `outputs`. Returns false if this would not be faster than to compute all outputs; nothing is written then.
    fn set_discrete_outputs(&mut self, inputs: &Self::Inputs, outputs: &mut Self::Outputs) -> bool {
        let _ = (inputs, outputs);
        false
    }

    /// Sets the slopes, over a step of size `h` (s), of inputs that are determined by other inputs during the step, for
    /// example of a rate from its derivative. [`Variable::follows_inputs`](crate::variable::Variable::follows_inputs)
    /// declares these inputs. Returns true if there are any.
    fn set_dependent_slopes(inputs: &mut Self::Inputs, h: f64) -> bool {
        let _ = (inputs, h);
        false
    }

    /// Returns the continuous states in the order of their numbers in the model (see `Variable::state`).
    fn continuous_states(&self) -> &[f64];

    /// Sets the continuous states as the host's integrator has computed them (Model Exchange).
    fn set_continuous_states(&mut self, x: &[f64]);

    /// Sets the simulation time to the time `now` that the host has passed (Model Exchange).
    fn set_time(&mut self, now: Instant);

    /// Computes the derivatives of the continuous states by time.
    fn derivatives(&mut self, inputs: &Self::Inputs, x_dot: &mut [f64]);

    /// Computes directional derivatives for a change of the states by `dx` and of the inputs by the slopes in `along`.
    /// Writes the derivatives of the state derivatives to `dx_dot`, and returns those of the outputs. Discrete values and
    /// the slopes of `inputs` do not change.
    fn directional_derivative(
        &mut self,
        inputs: &Self::Inputs,
        along: &Self::Inputs,
        dx: &[f64],
        dx_dot: &mut [f64],
    ) -> Self::Outputs;

    /// Applies the discrete changes that the present inputs cause, for example the start of sticking, before outputs are read.
    /// The returned value is passed to [`Model::revert`] afterwards. If the host handles events, neither function is called,
    /// because discrete values then change only in event mode.
    fn apply_present_inputs(&mut self, inputs: &Self::Inputs) -> Self::Discrete {
        let _ = inputs;
        Self::Discrete::default()
    }

    /// Reverts [`Model::apply_present_inputs`], so that reading outputs does not change the model.
    fn revert(&mut self, before: Self::Discrete) {
        let _ = before;
    }

    /// Changes the values of tunable parameters while the simulation runs.
    fn tune(
        &mut self,
        parameters: &Self::Parameters,
        inputs: &Self::Inputs,
    ) -> Result<(), Vec<String>> {
        let _ = (parameters, inputs);
        Ok(())
    }

    /// Computes the event indicators, which change their sign at events. There are
    /// [`About::event_indicators`](crate::table::About::event_indicators) of them; with a reduced model description only the
    /// first ones are used ([`Model::INDICATORS_OF`]).
    fn event_indicators(&mut self, inputs: &Self::Inputs, indicators: &mut [f64]) {
        let _ = (inputs, indicators);
    }

    /// Handles the events that are due now. Returns true if continuous states have changed. If an error is returned,
    /// the model is unchanged.
    fn handle_event(&mut self, inputs: &Self::Inputs) -> Result<bool, String> {
        let _ = inputs;
        Ok(false)
    }

    /// Returns the time at which the model's next time event is due, s; `None` if there is none.
    fn next_time_event(&self) -> Option<f64> {
        None
    }

    /// Checks the states after a step of the host's integrator (Model Exchange). Returns true if an event must be handled now.
    ///
    /// # Errors
    /// The reason why the states that the host has set are not valid.
    fn accept_step(&mut self, inputs: &Self::Inputs) -> Result<bool, String> {
        let _ = inputs;
        Ok(false)
    }

    /// Returns a warning about the simulation so far, or about the step sizes of a Model Exchange host. The runtime calls
    /// this function after each step until it returns a warning.
    fn step_warning(&self) -> Option<&'static str> {
        None
    }

    /// Returns the number of events since the start, from which the runtime notices new events.
    fn event_count(&self) -> i32 {
        0
    }

    /// Returns the text of the last event for the log: what happened, and when.
    fn last_event(&self) -> String {
        String::new()
    }
}

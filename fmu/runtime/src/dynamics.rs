//! The interface that a model implements to become an FMU.

use std::fmt::Debug;

pub use crate::clock::Instant;

/// Reason why a model could not compute a step. `text` is a message for the user.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct StepFailure {
    pub text: String,
    /// True if the host may try a shorter step from the same time, because it may succeed.
    pub shorter_may_succeed: bool,
}

/// Creates a failure after which a shorter step may succeed, for example because the step needed too many internal steps.
impl From<&str> for StepFailure {
    fn from(text: &str) -> StepFailure {
        StepFailure { text: text.into(), shorter_may_succeed: true }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum StepEnd {
    End,
    /// The step has reached its end, and an event is due at this instant.
    EventAtEnd,
    /// The step has stopped at an event before its end. The number is the time from the start of
    /// the step to the event, s.
    Event(f64),
}

/// A dynamic system with inputs, parameters, continuous states and events.
///
/// The runtime saves the state of a simulation as a clone of the model, so that a model must not keep data outside itself.
/// All times are in s. Functions that a smooth model without events does not need have a default implementation.
#[allow(missing_docs)]
pub trait Dynamics: Clone + Debug + Sized + 'static {
    /// All parameters of the model; their default values are the start values.
    type Parameters: Clone + Debug + Default;
    /// All inputs, each with its present value and its slope over the step. The default contains the start values,
    /// and slopes of 0.
    type Inputs: Copy + Debug + Default;
    /// All values that follow from states and inputs at one instant. The same type also holds the directional derivatives of
    /// the outputs.
    type Outputs: Copy + Debug;
    /// The discrete values that [`Dynamics::apply_present_inputs`] has replaced, from which [`Dynamics::revert`] restores
    /// them; `()` for a model without events.
    type Discrete: Default;

    /// True if outputs also depend on the inputs' slopes, for example because an output is a time derivative.
    const OUTPUTS_USE_SLOPES: bool = false;

    /// Name of the integer parameter that counts the elements of the model that have event indicators, for example the
    /// number of tanks; `None` if the number of indicators is always the same. All elements have equally many indicators,
    /// which are listed element by element.
    const INDICATORS_OF: Option<&'static str> = None;

    /// Creates the model at the start of the simulation, with the inputs at that time. `tolerance` is the relative tolerance
    /// of the integration. The caller has checked that each parameter is within its own range.
    ///
    /// # Errors
    /// Messages of all problems with combinations of parameters.
    fn new(
        parameters: &Self::Parameters,
        inputs: &Self::Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Self, Vec<String>>;

    /// Returns a warning, one sentence each, for every parameter and initial input that is outside the range in which the
    /// model was verified.
    fn warnings(&self, parameters: &Self::Parameters, inputs: &Self::Inputs) -> Vec<String> {
        let _ = (parameters, inputs);
        Vec::new()
    }

    /// Returns the reason why the value of a parameter has no effect although its part of the model is in use: "name = value"
    /// of the parameter that replaces it. `name` is the name of the parameter in the table of variables, and `indices` are
    /// the indices of the element, counted from 0 (empty for a scalar).
    ///
    /// The runtime warns about these parameters if they differ from their start values. It does not warn about parameters of
    /// parts that are switched off, because hosts often use the same parameters for several models.
    fn overridden(parameters: &Self::Parameters, name: &str, indices: &[usize]) -> Option<String> {
        let _ = (parameters, name, indices);
        None
    }

    /// Appends the states of the model to `words`, as a part of a saved state; the runtime itself saves parameters and
    /// inputs. The number of words must always be [`About::saved_words`](crate::table::About::saved_words).
    fn save(&self, words: &mut Vec<u64>);

    /// Restores the model from the words that [`Dynamics::save`] has written, for the same parameters. Returns `None` if the
    /// words are not a valid state.
    fn resume(parameters: &Self::Parameters, words: &[u64], tolerance: f64) -> Option<Self>;

    /// Advances the model by exactly `h` > 0 seconds, during which the inputs change linearly with their slopes. The step
    /// allocates no memory unless it fails.
    ///
    /// # Errors
    /// If the step cannot be computed; the model is then unchanged.
    fn step(&mut self, inputs: &Self::Inputs, h: f64) -> Result<(), StepFailure>;

    /// Advances the model as [`Dynamics::step`] does, but stops at the first event. If a second step continues from this
    /// event to the end of the first step with the same inputs, the result must be bit-identical to the result of one whole
    /// step.
    fn step_to_event(&mut self, inputs: &Self::Inputs, h: f64) -> Result<StepEnd, StepFailure> {
        self.step(inputs, h).map(|()| StepEnd::End)
    }

    /// Applies the discrete changes that the present inputs cause, for example the start of sticking, and keeps them.
    /// [`Dynamics::apply_present_inputs`] makes the same changes, which the runtime then undoes.
    fn take_present_inputs(&mut self, inputs: &Self::Inputs) {
        let _ = inputs;
    }

    fn outputs(&mut self, inputs: &Self::Inputs) -> Self::Outputs;

    /// Computes only those outputs that are integers, enumerations or Booleans, and writes them to `outputs`; their values
    /// must equal those of [`Dynamics::outputs`]. Returns false, and writes nothing, if this would not be faster than
    /// computing all outputs.
    fn set_discrete_outputs(&mut self, inputs: &Self::Inputs, outputs: &mut Self::Outputs) -> bool {
        let _ = (inputs, outputs);
        false
    }

    /// Sets the slopes of those inputs whose change during a step of `h` seconds follows from other inputs. For example, the
    /// slope of a rate is the derivative of the rate, which is another input.
    /// [`Variable::follows_inputs`](crate::variable::Variable::follows_inputs) declares these inputs. Returns true if there
    /// are any.
    fn set_dependent_slopes(inputs: &mut Self::Inputs, h: f64) -> bool {
        let _ = (inputs, h);
        false
    }

    /// Returns the continuous states in the order of their numbers in the model, which
    /// [`Variable::state`](crate::variable::Variable::state) states.
    fn continuous_states(&self) -> &[f64];

    fn set_continuous_states(&mut self, x: &[f64]);

    /// Sets the simulation time to the time `now` that the host has passed (Model Exchange).
    fn set_time(&mut self, now: Instant);

    fn derivatives(&mut self, inputs: &Self::Inputs, x_dot: &mut [f64]);

    /// Computes the directional derivative of the model for a change of the states by `dx` and of the inputs by the slopes in
    /// `along`. Writes the derivatives of the state derivatives to `dx_dot`, and returns the derivatives of the outputs.
    /// Discrete values count as constant, and the slopes in `inputs` do not change.
    fn directional_derivative(
        &mut self,
        inputs: &Self::Inputs,
        along: &Self::Inputs,
        dx: &[f64],
        dx_dot: &mut [f64],
    ) -> Self::Outputs;

    /// Applies the discrete changes that the present inputs cause, for example the start of sticking, so that the outputs
    /// that are read next show them. Returns the previous values, which the runtime passes to [`Dynamics::revert`] after
    /// reading. If the host handles events, neither function is called, because discrete values then change only in event
    /// mode.
    fn apply_present_inputs(&mut self, inputs: &Self::Inputs) -> Self::Discrete {
        let _ = inputs;
        Self::Discrete::default()
    }

    /// Undoes [`Dynamics::apply_present_inputs`], so that reading outputs does not change the model. `before` contains the
    /// previous discrete values.
    fn revert(&mut self, before: Self::Discrete) {
        let _ = before;
    }

    /// Changes tunable parameters while the simulation runs, to their values in `parameters`.
    ///
    /// # Errors
    /// Messages of all problems with the new values; the model is then unchanged.
    fn tune(
        &mut self,
        parameters: &Self::Parameters,
        inputs: &Self::Inputs,
    ) -> Result<(), Vec<String>> {
        let _ = (parameters, inputs);
        Ok(())
    }

    /// Writes the event indicators, each of which changes its sign at an event, to `indicators`. Their number is
    /// [`About::event_indicators`](crate::table::About::event_indicators); a host with a reduced model description reads
    /// only the first ones (see [`Dynamics::INDICATORS_OF`]).
    fn event_indicators(&mut self, inputs: &Self::Inputs, indicators: &mut [f64]) {
        let _ = (inputs, indicators);
    }

    /// Handles the events that are due now. Returns true if continuous states have changed.
    ///
    /// # Errors
    /// If an event cannot be handled; the model is then unchanged.
    fn handle_event(&mut self, inputs: &Self::Inputs) -> Result<bool, String> {
        let _ = inputs;
        Ok(false)
    }

    /// Returns the time at which the model's next time event is due, s; `None` if there is none.
    fn next_time_event(&self) -> Option<f64> {
        None
    }

    /// Checks the states after the integrator of the host has completed a step (Model Exchange). Returns true if an event
    /// must be handled now.
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

    /// Returns the number of events since the start of the simulation. The runtime compares it before and after a step in
    /// order to notice new events.
    fn event_count(&self) -> i32 {
        0
    }

    fn last_event(&self) -> String {
        String::new()
    }
}

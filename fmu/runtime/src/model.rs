//! Interface that a model implements to become an FMU.

use std::fmt::Debug;

pub use crate::clock::Instant;
use crate::table::Table;

/// Failure of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepFailure {
    /// Reason, in words.
    pub text: String,
    /// True if a shorter step may succeed.
    pub shorter_may_succeed: bool,
}

/// Makes a failure from a text: a shorter step may succeed, as when a step takes too much work.
impl From<&str> for StepFailure {
    fn from(text: &str) -> StepFailure {
        StepFailure { text: text.into(), shorter_may_succeed: true }
    }
}

/// End of a step that stops at events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepEnd {
    /// The end of the step.
    End,
    /// The end of the step, at an event.
    EventAtEnd,
    /// An event before the end, this long after the step's beginning, s.
    Event(f64),
}

/// A dynamic system with inputs, parameters, continuous states and events.
///
/// A clone is a saved state: nothing about a model is kept elsewhere. Times are in s.
/// Functions that a smooth model without events does not need have a default.
pub trait Model: Clone + Debug + Sized + 'static {
    /// All parameters; the default holds the start values.
    type Parameters: Clone + Debug + Default;
    /// All inputs, each with its value now and its slope over the step; the default holds the
    /// start values, slopes 0.
    type Inputs: Copy + Debug + Default;
    /// All that follows from states and inputs at one instant. The same type holds the outputs'
    /// derivatives along a direction.
    type Outputs: Copy + Debug;
    /// Discrete values that inputs can change at once; `()` for a model without events.
    type Discrete: Default;

    /// True if outputs depend on the inputs' slopes, not only on their values.
    const OUTPUTS_USE_SLOPES: bool = false;

    /// The parameter that counts what the event indicators belong to, the same number to each, in order.
    const INDICATORS_OF: Option<&'static str> = None;

    /// The variables and what else the model description says.
    fn table() -> &'static Table<Self>;

    /// The model at the start of its motion, with the inputs that act then. `tolerance` is the
    /// relative error allowed. Single parameters are within their ranges; all that is wrong with
    /// them together is returned.
    fn new(
        parameters: &Self::Parameters,
        inputs: &Self::Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Self, Vec<String>>;

    /// Lists where parameters and initial inputs leave the known range of the model,
    /// one sentence each.
    fn warnings(&self, parameters: &Self::Parameters, inputs: &Self::Inputs) -> Vec<String> {
        let _ = (parameters, inputs);
        Vec::new()
    }

    /// Returns why the value of a parameter is not used although the part of the model that it describes is, as "name = value" of
    /// the parameter that replaces it. `name` is the table's, `indices` are the element's, from 0, none for a scalar. Hosts get a
    /// warning of such parameters that differ from their start values. Parts that are switched off need none: the same
    /// parameters often serve several models.
    fn overridden(parameters: &Self::Parameters, name: &str, indices: &[usize]) -> Option<String> {
        let _ = (parameters, name, indices);
        None
    }

    /// Appends the saved state other than parameters and inputs as words: always
    /// [`About::saved_words`](crate::table::About::saved_words) of them.
    fn save(&self, words: &mut Vec<u64>);

    /// The reverse, with the same parameters; `None` when the words are no state.
    fn resume(parameters: &Self::Parameters, words: &[u64], tolerance: f64) -> Option<Self>;

    /// Moves on by exactly `h` > 0 seconds; the inputs run along their slopes. On an error the
    /// model is as before. Does not allocate unless it fails.
    fn step(&mut self, inputs: &Self::Inputs, h: f64) -> Result<(), StepFailure>;

    /// [`Model::step`] that stops at the first event. A step from there to the same end with the same inputs ends
    /// bit-identical to the whole step.
    fn step_to_event(&mut self, inputs: &Self::Inputs, h: f64) -> Result<StepEnd, StepFailure> {
        self.step(inputs, h).map(|()| StepEnd::End)
    }

    /// Changes for good what the present inputs change at once of what is discrete, see
    /// [`Model::apply_present_inputs`].
    fn take_present_inputs(&mut self, inputs: &Self::Inputs) {
        let _ = inputs;
    }

    /// Returns the current outputs.
    fn outputs(&mut self, inputs: &Self::Inputs) -> Self::Outputs;

    /// Sets the slopes, over a step of length `h`, of inputs that follow from others during it, such
    /// as a rate from its derivative: those declared by
    /// [`Variable::follows_inputs`](crate::variable::Variable::follows_inputs). Returns whether there are any.
    fn set_dependent_slopes(inputs: &mut Self::Inputs, h: f64) -> bool {
        let _ = (inputs, h);
        false
    }

    /// The continuous states, in an order of the model's own (see `Variable::state`).
    fn continuous_states(&self) -> &[f64];

    /// Takes the continuous states from the host.
    fn set_continuous_states(&mut self, x: &[f64]);

    /// Takes the present time from the host's clock.
    fn set_time(&mut self, now: Instant);

    /// The derivatives of the continuous states.
    fn derivatives(&mut self, inputs: &Self::Inputs, x_dot: &mut [f64]);

    /// Derivatives in the direction of the states `dx` and of the slopes of `along`: of the states'
    /// derivatives (into `dx_dot`), and of the outputs. What is discrete is held, and so are the
    /// slopes of `inputs`.
    fn directional_derivative(
        &mut self,
        inputs: &Self::Inputs,
        along: &Self::Inputs,
        dx: &[f64],
        dx_dot: &mut [f64],
    ) -> Self::Outputs;

    /// Changes what the present inputs change at once of what is discrete, before the model is looked
    /// at; what is returned goes to [`Model::revert`] afterwards. Where the host handles events,
    /// discrete changes happen there alone, and neither is called.
    fn apply_present_inputs(&mut self, inputs: &Self::Inputs) -> Self::Discrete {
        let _ = inputs;
        Self::Discrete::default()
    }

    /// Undoes [`Model::apply_present_inputs`].
    fn revert(&mut self, before: Self::Discrete) {
        let _ = before;
    }

    /// Takes over the parameters that can change while the simulation runs.
    fn tune(
        &mut self,
        parameters: &Self::Parameters,
        inputs: &Self::Inputs,
    ) -> Result<(), Vec<String>> {
        let _ = (parameters, inputs);
        Ok(())
    }

    /// Functions of the states that cross zero at events, [`About::event_indicators`](crate::table::About::event_indicators) of them;
    /// of a part of the variables the first ones ([`Model::INDICATORS_OF`]).
    fn event_indicators(&mut self, inputs: &Self::Inputs, indicators: &mut [f64]) {
        let _ = (inputs, indicators);
    }

    /// Does what is due at the present instant and returns whether continuous states have
    /// changed. On an error nothing has changed.
    fn handle_event(&mut self, inputs: &Self::Inputs) -> Result<bool, String> {
        let _ = inputs;
        Ok(false)
    }

    /// Time of the next event that depends on time alone.
    fn next_time_event(&self) -> Option<f64> {
        None
    }

    /// Model Exchange: the host has accepted a step. Returns whether an event has to be handled
    /// now, or why the states that the host has set mean nothing.
    fn accept_step(&mut self, inputs: &Self::Inputs) -> Result<bool, String> {
        let _ = inputs;
        Ok(false)
    }

    /// Warning about the motion so far, or about how a Model Exchange host has driven it; queried
    /// after each step until there is one.
    fn step_warning(&self) -> Option<&'static str> {
        None
    }

    /// Number of events since the start.
    fn event_count(&self) -> i32 {
        0
    }

    /// The last event, for the log: what happened, and when.
    fn last_event(&self) -> String {
        String::new()
    }
}

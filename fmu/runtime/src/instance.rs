//! The FMI calls on an instance, as far as they are the same in every version of FMI.
//!
//! A refused call changes nothing. The only exception is a step that the model cannot compute: the model keeps its state,
//! but the instance enters the state "step failed", in which the host can read, reset or restore the instance.
//!
//! In Model Exchange the host integrates and sets time and states. If the host handles events ([`Events::ByHost`]), discrete
//! values change only in [`Instance::new_discrete_states`].

use std::marker::PhantomData;
use std::sync::Arc;

use crate::call::{CType, Call, Events, Fault, InstanceState, Interface};
use crate::clock::Clock;
use crate::extent::Extent;
use crate::model::{Model, StepEnd, StepFailure};
use crate::number::{is_finite, text};
use crate::table::{Layout, Scalar};
use crate::variable::{Access, Causality, Value, Variable};
use crate::version::Version;

/// Relative tolerance of the integration if the host sets none.
pub const DEFAULT_TOLERANCE: f64 = 1e-8;
/// Range of the relative tolerances of the integration that a host can set.
pub const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-14..=1e-1;
/// Largest allowed magnitude of a continuous state. No realistic motion reaches it, and powers and products of larger states
/// could overflow.
pub const MAX_STATE: f64 = 1e30;

/// An instance of an FMU for one version of FMI. A clone of an instance is a complete saved state,
/// because the instance has no data elsewhere.
#[derive(Debug)]
#[allow(missing_docs)]
pub struct Instance<M: Model, V: Version> {
    version: PhantomData<V>,
    pub(crate) interface: Interface,
    pub(crate) events: Events,
    pub(crate) layout: Layout,
    pub(crate) extent: Option<Arc<Extent>>,
    pub(crate) state: InstanceState,
    pub(crate) clock: Clock,
    pub(crate) tolerance: f64,
    /// Values of the parameters in the order of the table. They may be outside their ranges until the end of initialization
    /// mode, where they are checked.
    pub(crate) parameters: Vec<Value>,
    pub(crate) inputs: M::Inputs,
    pub(crate) sloped: bool,
    /// True from the end of a step in which inputs changed linearly until an input is set. During this time the inputs keep
    /// the slopes of the step, so that outputs are limits from the left.
    pub(crate) past_slopes: bool,
    /// The model, which is created when a call first needs it in initialization mode. It is dropped if a parameter or input
    /// is set before the simulation starts.
    pub(crate) model: Option<M>,
    pub(crate) outputs: Option<M::Outputs>,
    pub(crate) known: Known,
    /// Values of the discrete outputs that the host saw when it was last in event mode, in the order of their
    /// [`Scalar::slot`]. They are needed if events are handled as [`Events::Reported`]. The list is empty until
    /// initialization has ended; until then, discrete outputs are computed like all other outputs.
    pub(crate) shown: Vec<i32>,
    scratch: [Vec<f64>; 2],
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Known {
    Nothing,
    /// Only those stored outputs are valid that are integers, enumerations or Booleans; real outputs are not.
    Discrete,
    All,
}

/// Iterator over the indices of the continuous states in the model's state vector, in the order in which the host reads the
/// states.
struct Places<M: Model> {
    extent: Option<Arc<Extent>>,
    next: usize,
    model: PhantomData<M>,
}

impl<M: Model> Iterator for Places<M> {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let n = self.next;
        self.next += 1;
        match &self.extent {
            Some(extent) => extent.places().get(n).copied(),
            None => match M::table().derivatives().get(n)?.access {
                Access::Derivative(place) => Some(place(M::table().derivatives()[n].element)),
                _ => Some(0),
            },
        }
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let all = match &self.extent {
            Some(extent) => extent.places().len(),
            None => M::table().derivatives().len(),
        };
        let left = all.saturating_sub(self.next);
        (left, Some(left))
    }
}

impl<M: Model> ExactSizeIterator for Places<M> {}

#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct StepInfo {
    pub event: bool,
    /// True if the step has stopped at an event before its end.
    pub early: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct EventInfo {
    pub states_changed: bool,
    /// Time of the next time event, s; `None` if there is none.
    pub next_time: Option<f64>,
}

// A derived `clone_from` would allocate memory.
impl<M: Model, V: Version> Clone for Instance<M, V> {
    fn clone(&self) -> Self {
        Instance {
            parameters: self.parameters.clone(),
            model: self.model.clone(),
            scratch: self.scratch.clone(),
            shown: self.shown.clone(),
            extent: self.extent.clone(),
            ..*self
        }
    }

    fn clone_from(&mut self, other: &Self) {
        let mut parameters = std::mem::take(&mut self.parameters);
        parameters.clone_from(&other.parameters);
        let mut model = self.model.take();
        model.clone_from(&other.model);
        let scratch = std::mem::take(&mut self.scratch);
        let mut shown = std::mem::take(&mut self.shown);
        shown.clone_from(&other.shown);
        let extent = other.extent.clone();
        *self = Instance { parameters, model, scratch, shown, extent, ..*other };
    }
}

#[allow(missing_docs)]
impl<M: Model, V: Version> Instance<M, V> {
    /// Creates an instance for a host that does not choose who handles events: in Model Exchange the host handles them, in
    /// Co-Simulation the FMU within its steps.
    pub fn new(interface: Interface) -> Self {
        Instance::with_events(interface, V::events(interface))
    }

    /// Creates an instance for a host that chooses who handles events.
    pub fn with_events(interface: Interface, events: Events) -> Self {
        let states = M::table().derivatives().len();
        Instance {
            version: PhantomData,
            interface,
            events,
            layout: Layout::Scalars,
            extent: None,
            state: InstanceState::Instantiated,
            clock: Clock::new(interface, 0.0, None),
            tolerance: DEFAULT_TOLERANCE,
            parameters: M::table().starts(),
            inputs: M::Inputs::default(),
            sloped: false,
            past_slopes: false,
            model: None,
            outputs: None,
            known: Known::Nothing,
            shown: Vec::new(),
            scratch: [vec![0.0; states], vec![0.0; states]],
        }
    }

    /// Restricts a new instance to the variables of a reduced model description; `None` keeps all variables.
    pub fn with_extent(mut self, extent: Option<Arc<Extent>>) -> Self {
        if let Some(extent) = &extent {
            self.parameters = extent.starts().to_vec();
            for (place, start) in extent.inputs() {
                self.store(&M::table().scalars[*place], Value::Real(*start));
            }
        }
        self.extent = extent;
        self
    }

    pub(crate) fn token(&self) -> &str {
        match &self.extent {
            Some(extent) => extent.token(),
            None => V::token::<M>(self.layout),
        }
    }

    fn places(&self) -> Places<M> {
        Places { extent: self.extent.clone(), next: 0, model: PhantomData }
    }

    pub fn interface(&self) -> Interface {
        self.interface
    }

    /// Checks that the present state of the instance allows a call, and returns the call.
    ///
    /// # Errors
    /// If the call is not allowed.
    #[inline]
    pub fn check(&self, call: &'static Call) -> Result<&'static Call, Fault> {
        call.check(self.interface, self.events, self.state)?;
        Ok(call)
    }

    pub fn state(&self) -> InstanceState {
        self.state
    }

    /// Returns the simulation time, s: the end of the last step, or in Model Exchange the time that the host has set.
    pub fn time(&self) -> f64 {
        self.clock.time
    }

    /// Makes the instance unusable after a panic, because its values may be wrong. Every further call is refused, except the
    /// call that frees the instance.
    pub fn poison(&mut self) {
        self.state = InstanceState::Fatal;
    }

    pub(crate) fn after_error(&mut self) {
        if let Some(state) = V::AFTER_ERROR.filter(|_| self.state != InstanceState::Fatal) {
            self.state = state;
        }
    }

    /// Sets the tolerance of the integration and the start and stop time of the experiment, s. `None` stands for a value that
    /// the host has not set.
    ///
    /// # Errors
    /// If a value is not allowed; the message names all wrong values.
    pub fn setup_experiment(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Result<(), Fault> {
        let call = self.check(V::SETUP_EXPERIMENT)?;
        let mut problems = Vec::new();
        if !is_finite(start) {
            problems.push(format!("startTime = {} (allowed: any finite number)", text(start)));
        }
        if let Some(stop) = stop
            && !(is_finite(stop) && stop >= start)
        {
            let (stop, start) = (text(stop), text(start));
            problems.push(format!("stopTime = {stop} (allowed: startTime {start} or later)"));
        }
        if let Some(tolerance) = tolerance
            && !TOLERANCES.contains(&tolerance)
        {
            let (low, high) = (TOLERANCES.start(), TOLERANCES.end());
            let tolerance = text(tolerance);
            problems.push(format!("tolerance = {tolerance} (allowed: {low:?} to {high:?})"));
        }
        if !problems.is_empty() {
            return Err(call.error(problems.join("; ")));
        }
        self.tolerance = tolerance.unwrap_or(DEFAULT_TOLERANCE);
        self.clock = Clock::new(self.interface, start, stop);
        Ok(())
    }

    pub fn enter_initialization_mode(&mut self) -> Result<(), Fault> {
        self.check(V::ENTER_INITIALIZATION)?;
        self.state = InstanceState::Initialization;
        Ok(())
    }

    /// Leaves initialization mode, so that the simulation can start.
    ///
    /// # Errors
    /// If parameters are not allowed; the message names all problems.
    pub fn exit_initialization_mode(&mut self) -> Result<(), Fault> {
        let call = self.check(V::EXIT_INITIALIZATION)?;
        self.outputs(call)?;
        self.state = match self.events {
            Events::InStep => InstanceState::Stepping,
            Events::ByHost | Events::Reported => V::FIRST_EVENT,
        };
        if self.events == Events::Reported {
            self.show_discrete(call)?;
        }
        Ok(())
    }

    fn starts(&self) -> Vec<Value> {
        self.extent.as_ref().map_or_else(|| M::table().starts(), |extent| extent.starts().to_vec())
    }

    /// Returns the warnings at the start of the simulation: the warnings of the model
    /// ([`Dynamics::warnings`](crate::model::Dynamics::warnings)), and one for each reason why parameters that differ from
    /// their start values have no effect ([`Dynamics::overridden`](crate::model::Dynamics::overridden)).
    pub fn warnings(&self) -> Vec<String> {
        let Some(model) = &self.model else { return Vec::new() };
        let parameters = self.given_parameters();
        let mut warnings = model.warnings(&parameters, &self.inputs);
        let mut reasons: Vec<(String, Vec<String>)> = Vec::new();
        let (table, starts) = (M::table(), self.starts());
        for ((scalar, value), start) in table.parameters().iter().zip(&self.parameters).zip(&starts)
        {
            let Scalar { variable, element, .. } = scalar;
            if value == start {
                continue;
            }
            let why = M::overridden(&parameters, variable.name, &variable.indices(*element));
            let Some(why) = why else { continue };
            match reasons.iter_mut().find(|(reason, _)| *reason == why) {
                Some((_, names)) => names.push(scalar.name()),
                None => reasons.push((why, vec![scalar.name()])),
            }
        }
        // A message with more names would hide its reason.
        const NAMED: usize = 6;
        warnings.extend(reasons.into_iter().map(|(why, names)| {
            let verb = if names.len() == 1 { "has" } else { "have" };
            let named = names[..names.len().min(NAMED)].join(", ");
            let more = match names.len().saturating_sub(NAMED) {
                0 => String::new(),
                more => format!(" and {more} more parameters"),
            };
            format!("{named}{more} {verb} no effect: {why}")
        }));
        warnings
    }

    fn leave_initialized(&mut self, call: &Call) -> Result<(), Fault> {
        if self.state == InstanceState::Initialized {
            self.model(call)?;
            self.state = InstanceState::Event;
        }
        Ok(())
    }

    /// Ends the simulation. Afterwards the host can still read the last values and reset the instance, but not make steps.
    pub fn terminate(&mut self) -> Result<(), Fault> {
        let call = self.check(V::TERMINATE)?;
        self.leave_initialized(call)?;
        self.state = InstanceState::Terminated;
        Ok(())
    }

    /// Resets the instance to its state after instantiation, in which all parameters and inputs have their start values. The
    /// layout of arrays and the reduced model description stay the same.
    pub fn reset(&mut self) -> Result<(), Fault> {
        self.check(V::RESET)?;
        let (layout, extent) = (self.layout, self.extent.take());
        let instance = Instance::with_events(self.interface, self.events).with_extent(extent);
        *self = Instance { layout, ..instance };
        Ok(())
    }

    /// Returns the value of the variable with the value reference `reference`. `call` is the function with which the host
    /// reads it.
    ///
    /// # Errors
    /// If the call is not allowed now, or if the variable does not exist, has another type or has no value.
    pub fn get(&mut self, call: &'static Call, reference: u32) -> Result<Value, Fault> {
        let call = self.check(call)?;
        self.value(call, reference)
    }

    /// Returns the value of a variable as [`Instance::get`] does, for a call that was already checked.
    #[inline(always)]
    pub fn value(&mut self, call: &Call, reference: u32) -> Result<Value, Fault> {
        let scalar = scalar::<M, V>(call, reference)?;
        // A state is read directly from the model, which is faster than computing the outputs.
        match (scalar.state, scalar.access, &self.model) {
            (Some(place), _, Some(model)) => {
                Ok(Value::Real(model.continuous_states()[place(scalar.element)]))
            }
            (None, Access::Output(get), Some(_)) => {
                finite(call, scalar, get(self.outputs(call)?, scalar.element))
            }
            _ => self.compute_value(call, scalar),
        }
    }

    fn compute_value(&mut self, call: &Call, scalar: &Scalar<M>) -> Result<Value, Fault> {
        let element = scalar.element;
        if let Access::Input(ramp) = scalar.access {
            return Ok(Value::Real(*ramp(&mut self.inputs, element)[0]));
        }
        if scalar.variable.causality == Causality::Parameter {
            let value = self.parameters.get(scalar.slot).copied();
            return value.ok_or_else(|| no_value(call, scalar));
        }
        if self.state == InstanceState::Instantiated {
            return Err(call.error(format_args!(
                "{} has no value in state \"{}\"; it has one from {} on",
                scalar.name(),
                self.state.name(),
                InstanceState::Initialization.name()
            )));
        }
        if let Some(place) = scalar.state() {
            return Ok(Value::Real(self.model(call)?.continuous_states()[place]));
        }
        Ok(match scalar.access {
            Access::Calculated(get) => finite(call, scalar, get(self.model(call)?, element))?,
            Access::Derivative(place) => {
                let mut x_dot = std::mem::take(&mut self.scratch[0]);
                let done = self.query(call, |model, inputs| model.derivatives(inputs, &mut x_dot));
                let value = x_dot[place(element)];
                self.scratch[0] = x_dot;
                done?;
                finite(call, scalar, value)?
            }
            Access::OfInputs(get) => {
                let inputs = self.inputs;
                finite(call, scalar, get(self.model(call)?, &inputs, element)[0])?
            }
            Access::Output(get) => finite(call, scalar, get(self.outputs(call)?, element))?,
            Access::OutputInteger(_) | Access::OutputBoolean(_)
                if let Some(shown) = self.shown.get(scalar.slot)
                    && self.is_running() =>
            {
                match scalar.access {
                    Access::OutputBoolean(_) => Value::Boolean(*shown != 0),
                    _ => Value::Integer(*shown),
                }
            }
            Access::OutputInteger(get) => {
                Value::Integer(get(self.discrete_outputs(call)?, element))
            }
            Access::OutputBoolean(get) => {
                Value::Boolean(get(self.discrete_outputs(call)?, element))
            }
            _ => return Err(no_value(call, scalar)),
        })
    }

    /// Sets several variables: element n of `references` gets `value(n)`. `call` is the function with which the host sets
    /// them.
    ///
    /// # Errors
    /// If one of the values is refused; then no variable is set.
    #[inline]
    pub fn set(
        &mut self,
        call: &'static Call,
        references: &[u32],
        value: impl Fn(usize) -> Value,
    ) -> Result<(), Fault> {
        let call = self.check(call)?;
        if let [reference] = references {
            let value = value(0);
            let scalar = self.check_set(call, *reference, value)?;
            if matches!(scalar.access, Access::Input(_)) {
                self.store(scalar, value);
                return Ok(());
            }
        }
        let mut tunes = false;
        for (n, reference) in references.iter().enumerate() {
            let scalar = self.check_set(call, *reference, value(n))?;
            tunes |= scalar.variable.causality == Causality::Parameter && self.is_running();
        }
        if tunes {
            self.tune(call, references, &value)?;
        }
        for (n, reference) in references.iter().enumerate() {
            self.store(scalar::<M, V>(call, *reference)?, value(n));
        }
        Ok(())
    }

    /// Sets the variables for which `meant` returns true to their start values. Returns the variables that had another value
    /// before, in the order of the table.
    pub(crate) fn restart(
        &mut self,
        meant: impl Fn(&Variable<M>) -> bool,
    ) -> Vec<&'static Variable<M>> {
        let mut lost: Vec<&'static Variable<M>> = Vec::new();
        for scalar in M::table().scalars.iter().filter(|scalar| meant(scalar.variable)) {
            let Some(start) = scalar.start() else { continue };
            let before = match scalar.access {
                Access::Input(ramp) => {
                    Some(Value::Real(*ramp(&mut self.inputs, scalar.element)[0]))
                }
                _ => self.parameters.get(scalar.slot).copied(),
            };
            let is_named = lost.last().is_some_and(|last| last.name == scalar.variable.name);
            if before != Some(start) && !is_named {
                lost.push(scalar.variable);
            }
            self.store(scalar, start);
        }
        lost
    }

    fn show_discrete(&mut self, call: &Call) -> Result<(), Fault> {
        let outputs = *self.discrete_outputs(call)?;
        self.shown.clear();
        self.shown.extend(M::table().discrete().map(|scalar| discrete(scalar, &outputs)));
        Ok(())
    }

    /// Returns true if a discrete output of the model differs from the value that the host reads, because the host's value
    /// changes only in event mode.
    fn hides_discrete(&mut self, call: &Call) -> Result<bool, Fault> {
        let outputs = *self.discrete_outputs(call)?;
        let mut all = M::table().discrete().zip(&self.shown);
        Ok(all.any(|(scalar, shown)| discrete(scalar, &outputs) != *shown))
    }

    #[inline(always)]
    fn store(&mut self, scalar: &Scalar<M>, value: Value) {
        match (scalar.access, value) {
            (Access::Input(ramp), Value::Real(x)) => {
                self.drop_past_slopes();
                *ramp(&mut self.inputs, scalar.element)[0] = x;
            }
            _ => self.store_parameter(scalar, value),
        }
        self.known = Known::Nothing;
        if !self.is_running() {
            self.model = None;
        }
    }

    fn store_parameter(&mut self, scalar: &Scalar<M>, value: Value) {
        match value {
            Value::Real(x) if V::SETS_STATES && scalar.state.is_some() => {
                if let (Some(model), Some(place)) = (&mut self.model, scalar.state()) {
                    self.scratch[0].copy_from_slice(model.continuous_states());
                    self.scratch[0][place] = x;
                    model.set_continuous_states(&self.scratch[0]);
                }
            }
            _ => {
                if let Some(slot) = self.parameters.get_mut(scalar.slot) {
                    *slot = value;
                }
            }
        }
    }

    #[inline]
    pub(crate) fn is_running(&self) -> bool {
        !matches!(
            self.state,
            InstanceState::Instantiated
                | InstanceState::Configuration
                | InstanceState::Initialization
                | InstanceState::Initialized
        )
    }

    #[inline(always)]
    fn check_set(
        &self,
        call: &Call,
        reference: u32,
        value: Value,
    ) -> Result<&'static Scalar<M>, Fault> {
        let scalar = scalar::<M, V>(call, reference)?;
        let is_input = matches!(scalar.access, Access::Input(_));
        if V::SETS_STATES && scalar.state.is_some() && self.takes_states() {
            return match value {
                Value::Real(x) if is_finite(x) && x.abs() < MAX_STATE => Ok(scalar),
                _ => Err(call.discard(state_refusal(scalar, value))),
            };
        }
        // Parameters that are not allowed are refused together when initialization ends. All other
        // values are refused immediately.
        if !is_input {
            self.check_set_parameter(call, scalar)?;
        }
        let later = !is_input
            && matches!(self.state, InstanceState::Instantiated | InstanceState::Initialization);
        match scalar.problem(value) {
            Some(problem) if !later => {
                Err(Fault { severity: V::OUT_OF_RANGE, ..call.error(problem) })
            }
            _ => Ok(scalar),
        }
    }

    /// Returns true if the host may set single continuous states now, that is, in event mode and continuous-time mode of
    /// Model Exchange.
    fn takes_states(&self) -> bool {
        self.interface == Interface::ModelExchange
            && matches!(self.state, InstanceState::Event | InstanceState::Continuous)
    }

    fn check_set_parameter(&self, call: &Call, scalar: &Scalar<M>) -> Result<(), Fault> {
        if scalar.variable.causality != Causality::Parameter {
            return Err(call.error(format_args!(
                "{} is computed; only inputs and parameters can be set",
                scalar.name()
            )));
        }
        if !self.is_running() {
            return Ok(());
        }
        let (kind, states) = match scalar.variable.tunable {
            true => ("tunable", &[InstanceState::Stepping, InstanceState::Event][..]),
            false => ("fixed", &[][..]),
        };
        if states.contains(&self.state) {
            return Ok(());
        }
        let (name, now) = (scalar.name(), self.state.name());
        let mut all =
            vec![InstanceState::Instantiated.name(), InstanceState::Initialization.name()];
        all.extend(states.iter().map(|state| state.name()));
        Err(call.error(format_args!(
            "{name} is a {kind} parameter and cannot be set in state \"{now}\"; it can in: {}",
            all.join(", ")
        )))
    }

    fn tune(
        &mut self,
        call: &Call,
        references: &[u32],
        value: &impl Fn(usize) -> Value,
    ) -> Result<(), Fault> {
        // All other parameters are within their ranges, which was checked when the simulation started.
        let mut parameters = self.given_parameters();
        for (n, reference) in references.iter().enumerate() {
            let scalar = scalar::<M, V>(call, *reference)?;
            scalar.variable.set_parameter(&mut parameters, scalar.element, value(n));
        }
        let inputs = self.inputs;
        self.model(call)?
            .tune(&parameters, &inputs)
            .map_err(|problems| call.error(problems.join("; ")))
    }

    /// Sets the slopes with which inputs change during the next step, in the unit of the input per second. After this step
    /// the inputs are constant again. `orders` must all be 1, because higher derivatives are not supported.
    ///
    /// # Errors
    /// If an order or a slope is not allowed; then no slope is set.
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), Fault> {
        let call = self.check(V::SET_INPUT_DERIVATIVES)?;
        for ((reference, order), slope) in references.iter().zip(orders).zip(values) {
            check_slope(call, scalar::<M, V>(call, *reference)?, *order, *slope)?;
        }
        self.drop_past_slopes();
        for (reference, slope) in references.iter().zip(values) {
            let scalar = scalar::<M, V>(call, *reference)?;
            if let Access::Input(ramp) = scalar.access {
                *ramp(&mut self.inputs, scalar.element)[1] = *slope;
                self.sloped = true;
            }
        }
        if M::OUTPUTS_USE_SLOPES {
            self.known = Known::Nothing;
        }
        Ok(())
    }

    /// Computes the time derivatives of the variables `references` and writes them to `answers`. The inputs have the slopes
    /// that are set for the next step. `orders` must all be 1.
    pub fn output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        answers: &mut [f64],
    ) -> Result<(), Fault> {
        let call = self.check(V::GET_OUTPUT_DERIVATIVES)?;
        for (reference, order) in references.iter().zip(orders) {
            check_order(call, scalar::<M, V>(call, *reference)?, *order)?;
        }
        let (inputs, past_slopes) = (self.inputs, self.past_slopes);
        self.drop_past_slopes();
        let done = self.slopes_of_outputs(call, references, answers);
        (self.inputs, self.past_slopes) = (inputs, past_slopes);
        done
    }

    fn slopes_of_outputs(
        &mut self,
        call: &Call,
        references: &[u32],
        answers: &mut [f64],
    ) -> Result<(), Fault> {
        let mut x_dot = std::mem::take(&mut self.scratch[0]);
        let done = self.query(call, |model, inputs| model.derivatives(inputs, &mut x_dot));
        self.scratch[0] = x_dot;
        done?;
        let mut along = self.inputs;
        M::set_dependent_slopes(&mut along, 0.0);
        self.derivatives_along(call, references, &along, answers)
    }

    /// Computes the directional derivative of the variables `unknowns` for a change of the variables `knowns` by `direction`,
    /// and writes it to `answers`. Knowns are inputs and continuous states. In initialization mode, before the initial state
    /// is computed, they are inputs and real parameters.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
        answers: &mut [f64],
    ) -> Result<(), Fault> {
        let call = self.check(V::DIRECTIONAL_DERIVATIVE)?;
        if self.state == InstanceState::Initialization {
            return self.initial_derivative(call, unknowns, (knowns, direction), answers);
        }
        let mut along = self.inputs;
        hold_inputs::<M>(&mut along);
        self.scratch[0].fill(0.0);
        for (reference, d) in knowns.iter().zip(direction) {
            let scalar = scalar::<M, V>(call, *reference)?;
            check_direction(call, scalar, *d)?;
            match (scalar.access, scalar.state()) {
                (Access::Input(ramp), _) => *ramp(&mut along, scalar.element)[1] += d,
                (_, Some(place)) => self.scratch[0][place] += d,
                _ => {
                    return Err(call.error(format_args!(
                        "{} cannot be a known: it is neither an input nor a continuous state",
                        scalar.name()
                    )));
                }
            }
        }
        self.derivatives_along(call, unknowns, &along, answers)
    }

    /// Computes the directional derivatives of the unknowns and writes them to `answers`. The states change by the vector
    /// `scratch[0]`, and the inputs by the slopes in `along`.
    fn derivatives_along(
        &mut self,
        call: &Call,
        unknowns: &[u32],
        along: &M::Inputs,
        answers: &mut [f64],
    ) -> Result<(), Fault> {
        let [dx, mut dx_dot] = std::mem::take(&mut self.scratch);
        let found = self.query(call, |model, inputs| {
            model.directional_derivative(inputs, along, &dx, &mut dx_dot)
        });
        let done = found.and_then(|outputs| {
            for (reference, answer) in unknowns.iter().zip(answers) {
                let scalar = scalar::<M, V>(call, *reference)?;
                *answer = match (scalar.access, scalar.state()) {
                    (Access::Derivative(place), _) => dx_dot[place(scalar.element)],
                    (_, Some(place)) => dx[place],
                    (Access::Output(get), _) => get(&outputs, scalar.element),
                    (Access::OfInputs(get), _) => get(self.model(call)?, along, scalar.element)[1],
                    _ => {
                        return Err(call.error(format_args!(
                            "{} has no derivative, because it is not computed from states and inputs",
                            scalar.name()
                        )));
                    }
                };
                if !is_finite(*answer) {
                    let (name, answer) = (scalar.name(), text(*answer));
                    return Err(call.error(format_args!(
                        "the derivative of {name} is {answer}: states, inputs or the direction are too large"
                    )));
                }
            }
            Ok(())
        });
        self.scratch = [dx, dx_dot];
        done
    }

    /// Returns the value references of the variables on which a variable depends. Before the simulation starts, these are
    /// the dependencies of its initial value. Afterwards they are the declared inputs and states that have an effect at
    /// present; for example, fewer inputs and states have an effect while the hub sticks. An input or state also counts if
    /// the derivative with respect to it vanishes only at the present point.
    pub(crate) fn dependencies(
        &mut self,
        call: &Call,
        scalar: &Scalar<M>,
    ) -> Result<Vec<u32>, Fault> {
        if !self.is_running() {
            return Ok(scalar.initial_depends_on().map(V::reference).collect());
        }
        let declared: Vec<_> = scalar.depends_on().collect();
        let has_derivative = matches!(
            scalar.access,
            Access::Output(_) | Access::OfInputs(_) | Access::Derivative(_)
        );
        if scalar.state.is_some() || !has_derivative {
            return Ok(declared.into_iter().map(V::reference).collect());
        }
        const NEAR: f64 = 1e-3;
        const POINTS: u64 = 4;
        let mut depends = vec![false; declared.len()];
        for point in 0..POINTS {
            let mut near = self.clone();
            near.model(call)?;
            if point > 0 {
                near.move_aside(NEAR, point);
            }
            for (known, depends) in declared.iter().zip(&mut depends).filter(|(_, is)| !**is) {
                let mut along = near.inputs;
                hold_inputs::<M>(&mut along);
                near.scratch[0].fill(0.0);
                match (known.access, known.state()) {
                    (Access::Input(ramp), _) => *ramp(&mut along, known.element)[1] = 1.0,
                    (_, Some(place)) => near.scratch[0][place] = 1.0,
                    _ => {}
                }
                let mut answer = [0.0];
                near.derivatives_along(call, &[V::reference(scalar)], &along, &mut answer)?;
                *depends = answer[0] != 0.0;
            }
        }
        let found = declared.into_iter().zip(depends).filter(|(_, is)| *is);
        Ok(found.map(|(known, _)| V::reference(known)).collect())
    }

    /// Changes all states and inputs by up to `share` of their nominal values; different numbers `point` give different
    /// changes. The derivatives at such nearby points show which dependencies vanish only at the present point.
    fn move_aside(&mut self, share: f64, point: u64) {
        // Multiples of the golden ratio fill the interval uniformly.
        let part = |n: u64| 2.0 * (0.618_033_988_749_895 * (n + 1) as f64).fract() - 1.0;
        if let Some(model) = &mut self.model {
            self.scratch[0].copy_from_slice(model.continuous_states());
            let count = self.scratch[0].len() as u64;
            for (n, scalar) in (point * count..).zip(M::table().derivatives()) {
                let Access::Derivative(place) = scalar.access else { continue };
                let place = place(scalar.element);
                let nominal =
                    M::table().state_at(place).map_or(1.0, |s| s.variable.nominal_value());
                self.scratch[0][place] += share * nominal * part(n);
            }
            model.set_continuous_states(&self.scratch[0]);
        }
        for (n, scalar) in (point..).zip(M::table().inputs()) {
            if let Access::Input(ramp) = scalar.access {
                let [value, _] = ramp(&mut self.inputs, scalar.element);
                let moved = *value + share * scalar.variable.nominal_value() * part(n).abs();
                if scalar.problem(Value::Real(moved)).is_none() {
                    *value = moved;
                }
            }
        }
        self.known = Known::Nothing;
    }

    /// Computes the directional derivatives of the unknowns in initialization mode and writes them to `answers`. It uses
    /// central differences with Richardson extrapolation between instances with different start values, because there are no
    /// equations for derivatives with respect to parameters. The step is so short that each known changes by at most some
    /// thousandths of its value, or of its nominal value if its value is 0.
    fn initial_derivative(
        &self,
        call: &Call,
        unknowns: &[u32],
        (knowns, direction): (&[u32], &[f64]),
        answers: &mut [f64],
    ) -> Result<(), Fault> {
        const SHARE: f64 = 1.0 / 1024.0;
        let mut start = Vec::with_capacity(knowns.len());
        let mut size: f64 = 0.0;
        for (reference, d) in knowns.iter().zip(direction) {
            let scalar = scalar::<M, V>(call, *reference)?;
            check_direction(call, scalar, *d)?;
            let known = [Causality::Input, Causality::Parameter];
            let value = match self.clone().compute_value(call, scalar)? {
                Value::Real(x) if known.contains(&scalar.variable.causality) => x,
                _ => {
                    return Err(call.error(format_args!(
                        "{} cannot be a known in initialization mode (allowed: inputs and parameters)",
                        scalar.name()
                    )));
                }
            };
            let unit = if value == 0.0 { scalar.variable.nominal_value() } else { value.abs() };
            size = size.max(d.abs() / unit);
            start.push(value);
        }
        let step = if size >= f64::MIN_POSITIVE { SHARE / size } else { 1.0 };
        let at = |s: f64| -> Result<Vec<f64>, Fault> {
            let mut moved = self.clone();
            for ((reference, x), d) in knowns.iter().zip(&start).zip(direction) {
                moved.store(scalar::<M, V>(call, *reference)?, Value::Real(x + s * step * d));
            }
            let values = unknowns.iter().map(|reference| {
                match moved.compute_value(call, scalar::<M, V>(call, *reference)?)? {
                    Value::Real(x) => Ok(x),
                    _ => Err(call.error("wrong type")),
                }
            });
            values.collect()
        };
        let (p2, p1, m1, m2) = (at(2.0)?, at(1.0)?, at(-1.0)?, at(-2.0)?);
        for (n, answer) in answers.iter_mut().take(unknowns.len()).enumerate() {
            *answer = (8.0 * (p1[n] - m1[n]) - (p2[n] - m2[n])) / (12.0 * step);
        }
        Ok(())
    }

    /// Makes a step of `h` seconds from the host's time `at`, s. The step allocates no memory unless it fails.
    ///
    /// # Errors
    /// If the step is not allowed or the model cannot compute it.
    pub fn do_step(&mut self, at: f64, h: f64) -> Result<(), Fault> {
        let call = self.check(V::DO_STEP)?;
        self.step_by(call, at, h, |model, inputs| model.step(inputs, h).map(|()| StepEnd::End))?;
        Ok(())
    }

    /// Makes a step as [`Instance::do_step`] does, for a host that handles events between steps. If `stops` is true, the step
    /// stops at its first event.
    #[inline(always)]
    pub fn step_to_event(&mut self, at: f64, h: f64, stops: bool) -> Result<StepInfo, Fault> {
        let call = self.check(V::DO_STEP)?;
        if self.events != Events::Reported {
            let step = |model: &mut M, inputs: &_| model.step(inputs, h).map(|()| StepEnd::End);
            self.step_by(call, at, h, step)?;
            return Ok(StepInfo { event: false, early: false });
        }
        self.step_reported(call, at, h, stops)
    }

    fn step_reported(
        &mut self,
        call: &Call,
        at: f64,
        h: f64,
        stops: bool,
    ) -> Result<StepInfo, Fault> {
        let next_time = self.model.as_ref().and_then(M::next_time_event);
        let end = self.step_by(call, at, h, |model, inputs| match stops {
            true => model.step_to_event(inputs, h),
            false => model.step(inputs, h).map(|()| StepEnd::End),
        })?;
        let sampled = match (next_time, self.model.as_ref().and_then(M::next_time_event)) {
            (Some(before), Some(after)) => !self.clock.is_same(before, after),
            (before, after) => before != after,
        };
        let event = end != StepEnd::End || sampled || self.hides_discrete(call)?;
        Ok(StepInfo { event, early: matches!(end, StepEnd::Event(_)) })
    }

    #[inline(always)]
    pub(crate) fn check_step(&self, call: &Call, at: f64, h: f64) -> Result<(), Fault> {
        self.clock.check_step(at, h).map_err(|why| call.error(why))
    }

    #[inline(always)]
    fn step_by(
        &mut self,
        call: &Call,
        at: f64,
        h: f64,
        step: impl FnOnce(&mut M, &M::Inputs) -> Result<StepEnd, StepFailure>,
    ) -> Result<StepEnd, Fault> {
        self.check_step(call, at, h)?;
        let now = self.clock.at(at, h);
        let mut inputs = self.inputs;
        if M::OUTPUTS_USE_SLOPES && self.past_slopes {
            hold_inputs::<M>(&mut inputs);
        }
        let sloped = M::set_dependent_slopes(&mut inputs, h) || self.sloped;
        let mut after = inputs;
        if sloped {
            follow_slopes::<M>(call, &mut after, h, now.resolution)?;
        }
        let Some(model) = &mut self.model else {
            return Err(call.error("the instance was never initialised"));
        };
        model.set_time(now);
        let ended = match step(model, &inputs) {
            Ok(ended) => ended,
            Err(StepFailure { text, shorter_may_succeed }) => {
                model.set_time(self.clock.now());
                let end = at + h;
                let why = format_args!("step from {at:?} s to {end:?} s failed: {text}");
                // In FMI 3.0 an error would end the simulation, so that a step is discarded if a shorter one may succeed. In FMI
                // 2.0 the instance enters the state "step failed", in which no shorter step is possible.
                if shorter_may_succeed && V::AFTER_ERROR.is_some() {
                    return Err(call.discard(why));
                }
                self.state = InstanceState::Failed;
                return Err(call.error(why));
            }
        };
        let length = match ended {
            StepEnd::Event(length) => {
                after = inputs;
                follow_slopes::<M>(call, &mut after, length, now.resolution)?;
                length
            }
            _ => h,
        };
        self.inputs = after;
        self.past_slopes = M::OUTPUTS_USE_SLOPES && sloped;
        self.sloped = false;
        self.clock.time = at + length;
        model.set_time(self.clock.now());
        self.known = Known::Nothing;
        Ok(ended)
    }

    #[inline]
    fn drop_past_slopes(&mut self) {
        if M::OUTPUTS_USE_SLOPES && self.past_slopes {
            self.past_slopes = false;
            hold_inputs::<M>(&mut self.inputs);
        }
    }

    // ---- Within a step: intermediate update ----

    pub(crate) fn enter_intermediate(&mut self) {
        self.state = InstanceState::Intermediate;
    }

    /// Ends an intermediate update, in which the host could call functions of the FMU.
    ///
    /// # Errors
    /// If a call that the host made during the intermediate update has failed.
    pub(crate) fn leave_intermediate(&mut self, call: &Call) -> Result<(), Fault> {
        if self.state != InstanceState::Intermediate {
            return Err(
                call.error("a call that the host made within the intermediate update has failed")
            );
        }
        self.state = InstanceState::Stepping;
        Ok(())
    }

    pub(crate) fn ramp_to(
        &mut self,
        call: &Call,
        references: &[u32],
        ends: &M::Inputs,
        h: f64,
    ) -> Result<(), Fault> {
        let mut ends = *ends;
        self.drop_past_slopes();
        for reference in references {
            let scalar =
                V::scalar::<M>(*reference, Some(CType::Real)).map_err(|why| call.error(why))?;
            let Access::Input(ramp) = scalar.access else { continue };
            let [value, slope] = ramp(&mut self.inputs, scalar.element);
            *slope = (*ramp(&mut ends, scalar.element)[0] - *value) / h;
            let slope = *slope;
            self.sloped = true;
            if let Err(fault) = check_slope(call, scalar, 1, slope) {
                self.drop_ramps();
                return Err(fault);
            }
        }
        Ok(())
    }

    /// Sets the inputs `references` to exactly the values `ends` that the host gave for the end of the step. The values that
    /// follow from the slopes differ from them by rounding.
    pub(crate) fn end_ramps(&mut self, references: &[u32], ends: &M::Inputs) {
        let mut ends = *ends;
        for reference in references {
            if let Ok(scalar) = V::scalar::<M>(*reference, Some(CType::Real))
                && let Access::Input(ramp) = scalar.access
            {
                *ramp(&mut self.inputs, scalar.element)[0] = *ramp(&mut ends, scalar.element)[0];
            }
        }
        self.known = Known::Nothing;
    }

    pub(crate) fn drop_ramps(&mut self) {
        hold_inputs::<M>(&mut self.inputs);
        self.sloped = false;
    }

    // ---- Events and continuous time, handled by the host ----

    /// Enters event mode, in which the host may change discrete inputs and handle events.
    ///
    /// # Errors
    /// If the present state does not allow it.
    pub fn enter_event_mode(&mut self) -> Result<(), Fault> {
        let call = self.check(V::ENTER_EVENT)?;
        if self.events == Events::InStep {
            return Err(call.error("this instance was instantiated with eventModeUsed = false, so it has no event mode (allowed: eventModeUsed = true)"));
        }
        self.leave_initialized(call)?;
        self.state = InstanceState::Event;
        Ok(())
    }

    /// Handles all events that are due. A second call at the same instant has no effect unless the inputs have changed.
    pub fn new_discrete_states(&mut self) -> Result<EventInfo, Fault> {
        let call = self.check(V::NEW_DISCRETE_STATES)?;
        if self.events == Events::Reported {
            return self.report_discrete_states(call);
        }
        let event = self.query(call, |model, inputs| model.handle_event(inputs))?;
        let states_changed = event.map_err(|why| call.error(why))?;
        self.state = InstanceState::Event;
        self.known = Known::Nothing;
        self.clock.last_event = self.clock.time;
        Ok(EventInfo { states_changed, next_time: self.model(call)?.next_time_event() })
    }

    /// Reports to the host the events that the model has already handled within its steps: applies the discrete changes that
    /// the present inputs cause, and lets the host see the new values of all discrete outputs.
    fn report_discrete_states(&mut self, call: &Call) -> Result<EventInfo, Fault> {
        let inputs = self.inputs;
        let now = self.clock.now();
        let model = self.model(call)?;
        model.set_time(now);
        model.take_present_inputs(&inputs);
        self.known = Known::Nothing;
        self.show_discrete(call)?;
        // The next step handles an event that is still due, for example in a damaged saved state.
        let next_time = self.model(call)?.next_time_event().filter(|next| *next > now.time);
        Ok(EventInfo { states_changed: false, next_time })
    }

    /// Enters or leaves configuration mode, in which structural parameters can be set: `to` is the new state.
    ///
    /// # Errors
    /// If the present state does not allow `call`.
    pub fn configure(&mut self, call: &'static Call, to: InstanceState) -> Result<(), Fault> {
        self.check(call)?;
        self.state = to;
        Ok(())
    }

    pub fn enter_step_mode(&mut self, call: &'static Call) -> Result<(), Fault> {
        self.check(call)?;
        self.state = InstanceState::Stepping;
        Ok(())
    }

    pub fn enter_continuous_time_mode(&mut self) -> Result<(), Fault> {
        let call = self.check(V::ENTER_CONTINUOUS_TIME)?;
        self.leave_initialized(call)?;
        self.state = InstanceState::Continuous;
        Ok(())
    }

    /// Checks the states after the integrator of the host has completed a step. Returns true if an event must be handled now.
    ///
    /// # Errors
    /// If the states are not valid, or the step has passed the stop time.
    pub fn completed_integrator_step(&mut self) -> Result<bool, Fault> {
        let call = self.check(V::COMPLETED_STEP)?;
        let time = self.clock.time;
        if let Some(stop) = self.clock.passed_stop() {
            return Err(call.error(format_args!(
                "the step to {time:?} s has passed the stop time {stop:?} s"
            )));
        }
        let accepted = self.query(call, |model, inputs| model.accept_step(inputs))?;
        self.known = Known::Nothing;
        accepted.map_err(|why| {
            self.state = InstanceState::Failed;
            call.error(why)
        })
    }

    /// Sets the simulation time, s, in Model Exchange. In FMI 2.0 a host may go back to any time, in FMI 3.0 only to the last
    /// event.
    ///
    /// # Errors
    /// If the time is not finite or not allowed.
    pub fn set_time(&mut self, time: f64) -> Result<(), Fault> {
        let call = self.check(V::SET_TIME)?;
        self.clock.check_time(time, !V::SETS_STATES).map_err(|why| call.error(why))?;
        self.leave_initialized(call)?;
        self.model(call)?;
        self.clock.time = time;
        let now = self.clock.now();
        self.model(call)?.set_time(now);
        self.known = Known::Nothing;
        Ok(())
    }

    /// Sets the continuous states (Model Exchange).
    ///
    /// # Errors
    /// If a state is NaN, infinite or larger than [`MAX_STATE`]. The call is then discarded, because the integrator of the
    /// host should try a smaller step.
    pub fn set_continuous_states(&mut self, states: &[f64]) -> Result<(), Fault> {
        let call = self.check(V::SET_CONTINUOUS_STATES)?;
        if let (Some(_), Some(model)) = (&self.extent, &self.model) {
            self.scratch[0].copy_from_slice(model.continuous_states()); // the host may know only some of the states
        }
        let places = self.places();
        check_length(call, "nx", states.len(), places.len())?;
        for (place, x) in places.zip(states) {
            let is_state = is_finite(*x) && x.abs() < MAX_STATE;
            if !is_state {
                let name = M::table().state_at(place).map_or("a state".into(), Scalar::name);
                return Err(call.discard(format_args!(
                    "{name} = {} (allowed: magnitudes below {MAX_STATE:e})",
                    text(*x)
                )));
            }
            self.scratch[0][place] = *x;
        }
        self.leave_initialized(call)?;
        self.model(call)?;
        if let Some(model) = &mut self.model {
            model.set_continuous_states(&self.scratch[0]);
        }
        self.known = Known::Nothing;
        Ok(())
    }

    /// Writes the continuous states to `states`, in the order of the derivatives in the model description.
    ///
    /// # Errors
    /// If `states` does not have one element for each state.
    pub fn continuous_states(&mut self, states: &mut [f64]) -> Result<(), Fault> {
        let call = self.check(V::GET_CONTINUOUS_STATES)?;
        let places = self.places();
        check_length(call, "nx", states.len(), places.len())?;
        let all = self.model(call)?.continuous_states();
        for (place, x) in places.zip(states) {
            *x = all[place];
        }
        Ok(())
    }

    /// Writes the derivatives of the continuous states to `derivatives`.
    ///
    /// # Errors
    /// If a derivative is NaN or infinite. The call is then discarded, because the integrator of the host should try a
    /// smaller step.
    pub fn derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), Fault> {
        let call = self.check(V::GET_DERIVATIVES)?;
        let places = self.places();
        check_length(call, "nx", derivatives.len(), places.len())?;
        let mut x_dot = std::mem::take(&mut self.scratch[0]);
        let done = self.query(call, |model, inputs| model.derivatives(inputs, &mut x_dot));
        for (place, x) in places.zip(&mut *derivatives) {
            *x = x_dot[place];
        }
        self.scratch[0] = x_dot;
        done?;
        for (x, place) in derivatives.iter().zip(self.places()) {
            if !is_finite(*x) {
                let mut all = M::table().places().zip(M::table().derivatives());
                let name = all
                    .find(|(of, _)| *of == place)
                    .map_or("a derivative".into(), |(_, d)| d.name());
                return Err(call.discard(format_args!("{name} = {}", text(*x))));
            }
        }
        Ok(())
    }

    /// Writes the event indicators, each of which changes its sign at an event, to `indicators`.
    ///
    /// # Errors
    /// If an indicator is NaN or infinite. The call is then discarded, because the host should try a smaller step.
    pub fn event_indicators(&mut self, indicators: &mut [f64]) -> Result<(), Fault> {
        let call = self.check(V::GET_EVENT_INDICATORS)?;
        let count = match &self.extent {
            Some(extent) => extent.indicators(),
            None => M::table().about.event_indicators,
        };
        check_length(call, "ni", indicators.len(), count)?;
        self.query(call, |model, inputs| model.event_indicators(inputs, indicators))?;
        match indicators.iter().position(|z| !is_finite(*z)) {
            Some(n) => Err(call.discard(format_args!(
                "event indicator {} = {}: states or inputs are too large",
                n + 1,
                text(indicators[n])
            ))),
            None => Ok(()),
        }
    }

    pub(crate) fn indicators_for(
        &mut self,
        call: &Call,
        indicators: &mut [f64],
    ) -> Result<(), Fault> {
        if self.state == InstanceState::Instantiated {
            return Err(call.error(format_args!(
                "event indicators have no value in state \"{}\"; they have one from {} on",
                self.state.name(),
                InstanceState::Initialization.name()
            )));
        }
        self.query(call, |model, inputs| model.event_indicators(inputs, indicators))
    }

    pub fn nominals(&self, nominals: &mut [f64]) -> Result<(), Fault> {
        let call = self.check(V::GET_NOMINALS)?;
        let places = self.places();
        check_length(call, "nx", nominals.len(), places.len())?;
        for (place, x) in places.zip(nominals) {
            *x = M::table().state_at(place).map_or(1.0, |s| s.variable.nominal_value());
        }
        Ok(())
    }

    // ---- Saved states, and the model ----

    /// Restores the saved state `saved`.
    ///
    /// # Errors
    /// If it belongs to an instance with another interface, another handling of events, or another set of variables.
    pub fn restore(&mut self, saved: &Self) -> Result<(), Fault> {
        let call = self.check(V::SET_STATE)?;
        if saved.interface != self.interface {
            return Err(call.error(format_args!(
                "the saved state belongs to an instance for {}, but this instance is for {}",
                saved.interface.name(),
                self.interface.name()
            )));
        }
        if saved.events != self.events {
            return Err(call.error(
                "the saved state belongs to an instance with another value of eventModeUsed (allowed: states of instances with the same value)",
            ));
        }
        self.check_layout(call, saved)?;
        self.clone_from(saved);
        Ok(())
    }

    pub(crate) fn check_layout(&self, call: &Call, saved: &Self) -> Result<(), Fault> {
        if saved.layout != self.layout {
            return Err(call.error(
                "the state was saved by an FMU with the same binary but another model description: one of the two FMUs has array variables, the other has only scalars (allowed: states saved by this FMU)",
            ));
        }
        if saved.token() != self.token() {
            return Err(call.error(format_args!(
                "the state was saved by an FMU whose model description has other variables: its GUID is {}, the GUID of this FMU is {} (allowed: states saved by this FMU)",
                saved.token(),
                self.token()
            )));
        }
        Ok(())
    }

    #[inline]
    fn model(&mut self, call: &Call) -> Result<&mut M, Fault> {
        if self.model.is_none() {
            self.make_model(call)?;
        }
        self.model.as_mut().ok_or_else(|| call.error("the instance was never initialised"))
    }

    #[cold]
    fn make_model(&mut self, call: &Call) -> Result<(), Fault> {
        let made = self.model_parameters().and_then(|parameters| {
            M::new(&parameters, &self.inputs, self.clock.start, self.tolerance)
        });
        let mut model = made.map_err(|problems| call.error(problems.join("; ")))?;
        model.set_time(self.clock.now());
        let problems: Vec<String> = M::table()
            .places()
            .filter_map(|place| {
                start_problem(M::table().state_at(place)?, model.continuous_states()[place])
            })
            .collect();
        if !problems.is_empty() {
            return Err(call.error(problems.join("; ")));
        }
        self.model = Some(model);
        Ok(())
    }

    pub(crate) fn model_parameters(&self) -> Result<M::Parameters, Vec<String>> {
        let all = M::table().parameters().iter().zip(&self.parameters);
        let problem = |(scalar, value): (&Scalar<M>, &Value)| {
            let beyond = |extent: &Arc<Extent>| extent.problem(scalar, *value);
            scalar.problem(*value).or_else(|| self.extent.as_ref().and_then(beyond))
        };
        let problems: Vec<String> = all.filter_map(problem).collect();
        if problems.is_empty() { Ok(self.given_parameters()) } else { Err(problems) }
    }

    fn given_parameters(&self) -> M::Parameters {
        let mut parameters = M::Parameters::default();
        for (scalar, value) in M::table().parameters().iter().zip(&self.parameters) {
            scalar.variable.set_parameter(&mut parameters, scalar.element, *value);
        }
        parameters
    }

    #[inline(always)]
    fn outputs(&mut self, call: &Call) -> Result<&M::Outputs, Fault> {
        if self.known != Known::All {
            self.evaluate(call)?;
        }
        self.outputs.as_ref().ok_or_else(|| call.error("the instance was never initialised"))
    }

    fn evaluate(&mut self, call: &Call) -> Result<(), Fault> {
        self.model(call)?;
        if let Instance { events, model: Some(model), inputs, outputs, known, .. } = self {
            *outputs = Some(query_model(*events, model, inputs, M::outputs));
            *known = Known::All;
        }
        Ok(())
    }

    /// Returns the outputs. Integers, enumerations and Booleans among them are valid at the present instant; real outputs
    /// may belong to an earlier instant.
    fn discrete_outputs(&mut self, call: &Call) -> Result<&M::Outputs, Fault> {
        let Instance { events, model, inputs, outputs, known, .. } = self;
        if *known == Known::Nothing
            && let (Some(model), Some(outputs)) = (model, outputs)
            && query_model(*events, model, inputs, |m, u| m.set_discrete_outputs(u, outputs))
        {
            *known = Known::Discrete;
        }
        match self.known {
            Known::Nothing => self.outputs(call),
            _ => self
                .outputs
                .as_ref()
                .ok_or_else(|| call.error("the instance was never initialised")),
        }
    }

    fn query<T>(
        &mut self,
        call: &Call,
        question: impl FnOnce(&mut M, &M::Inputs) -> T,
    ) -> Result<T, Fault> {
        self.model(call)?;
        let Instance { events, model: Some(model), inputs, .. } = self else {
            return Err(call.error("the instance was never initialised"));
        };
        Ok(query_model(*events, model, inputs, question))
    }

    pub fn step_warning(&self) -> Option<&'static str> {
        self.model.as_ref().and_then(M::step_warning)
    }

    /// Returns the number of events since the start, so that callers can notice new events. The number may overflow and start
    /// again.
    #[inline]
    pub fn event_count(&self) -> i32 {
        self.model.as_ref().map_or(0, M::event_count)
    }

    pub fn last_event(&self) -> String {
        self.model.as_ref().map_or(String::new(), M::last_event)
    }
}

/// Evaluates the function `question` of the model. If the FMU handles events within its steps, the discrete changes that the
/// present inputs cause are applied before and undone afterwards. If the host handles events, they are not applied.
#[inline(always)]
fn query_model<M: Model, T>(
    events: Events,
    model: &mut M,
    inputs: &M::Inputs,
    question: impl FnOnce(&mut M, &M::Inputs) -> T,
) -> T {
    match events {
        Events::InStep | Events::Reported => {
            let before = model.apply_present_inputs(inputs);
            let answer = question(model, inputs);
            model.revert(before);
            answer
        }
        Events::ByHost => question(model, inputs),
    }
}

fn discrete<M: Model>(scalar: &Scalar<M>, outputs: &M::Outputs) -> i32 {
    match scalar.access {
        Access::OutputInteger(get) => get(outputs, scalar.element),
        Access::OutputBoolean(get) => get(outputs, scalar.element).into(),
        _ => 0,
    }
}

#[inline(always)]
fn finite<M: Model>(call: &Call, scalar: &Scalar<M>, x: f64) -> Result<Value, Fault> {
    if is_finite(x) { Ok(Value::Real(x)) } else { Err(not_finite(call, scalar, x)) }
}

#[cold]
fn not_finite<M: Model>(call: &Call, scalar: &Scalar<M>, x: f64) -> Fault {
    let known: Vec<String> = scalar.depends_on().take(6).map(Scalar::name).collect();
    let more = if scalar.depends_on().count() > known.len() { ", ..." } else { "" };
    call.error(format_args!(
        "{} = {}: the values that it is computed from are too large ({}{more}). Check initial values, inputs and parameters; in Model \
         Exchange take shorter steps",
        scalar.name(),
        text(x),
        known.join(", ")
    ))
}

#[cold]
fn state_refusal<M: Model>(scalar: &Scalar<M>, value: Value) -> String {
    let value = match value {
        Value::Real(x) => text(x),
        other => format!("{other:?}"),
    };
    format!("{} = {value} (allowed: magnitudes below {MAX_STATE:e})", scalar.name())
}

fn start_problem<M: Model>(scalar: &Scalar<M>, x: f64) -> Option<String> {
    if is_finite(x) && x.abs() < MAX_STATE {
        return None;
    }
    let known: Vec<String> = scalar.initial_depends_on().map(Scalar::name).collect();
    Some(format!(
        "{} = {} at the start (allowed: magnitudes below {MAX_STATE:e}); it follows from {}",
        scalar.name(),
        text(x),
        known.join(", ")
    ))
}

/// Moves the inputs along their slopes by `h` seconds, and checks that they stay within their ranges. The host's times, from
/// which `h` is computed, have the error `resolution`, s.
#[inline(always)]
fn follow_slopes<M: Model>(
    call: &Call,
    inputs: &mut M::Inputs,
    h: f64,
    resolution: f64,
) -> Result<(), Fault> {
    for scalar in M::table().inputs() {
        let Access::Input(ramp) = scalar.access else { continue };
        let [value, slope] = ramp(inputs, scalar.element);
        if *slope == 0.0 {
            continue;
        }
        *value = end_of_ramp(scalar, (*value, *slope), h, resolution);
        if let Some(problem) = scalar.problem(Value::Real(*value)) {
            return Err(call.error(format_args!("at the end of the step {problem}")));
        }
        if !M::OUTPUTS_USE_SLOPES {
            *slope = 0.0;
        }
    }
    Ok(())
}

fn hold_inputs<M: Model>(inputs: &mut M::Inputs) {
    for scalar in M::table().inputs() {
        if let Access::Input(ramp) = scalar.access {
            *ramp(inputs, scalar.element)[1] = 0.0;
        }
    }
}

/// Returns the value of an input after `h` seconds on its slope. A value that is below the smallest allowed value only by
/// rounding is set to the smallest allowed value. `resolution`, s, is the rounding error of the host's times, from which `h`
/// is computed.
#[inline]
fn end_of_ramp<M: Model>(
    scalar: &Scalar<M>,
    (value, slope): (f64, f64),
    h: f64,
    resolution: f64,
) -> f64 {
    const ROUNDING: f64 = 1e-9;
    let end = value + slope * h;
    match scalar.variable.min() {
        Some(floor)
            if end < floor && end > floor - ROUNDING * (value - floor) + slope * resolution =>
        {
            floor
        }
        _ => end,
    }
}

#[cold]
fn no_value<M: Model>(call: &Call, scalar: &Scalar<M>) -> Fault {
    call.error(format_args!("{} has no value", scalar.name()))
}

#[inline(always)]
fn check_slope<M: Model>(
    call: &Call,
    scalar: &Scalar<M>,
    order: i32,
    slope: f64,
) -> Result<(), Fault> {
    let is_input = matches!(scalar.access, Access::Input(_));
    match is_input && order == 1 && scalar.variable.allows_rate(slope) {
        true => Ok(()),
        false => refuse_slope(call, scalar, order, slope),
    }
}

#[cold]
fn refuse_slope<M: Model>(
    call: &Call,
    scalar: &Scalar<M>,
    order: i32,
    slope: f64,
) -> Result<(), Fault> {
    let is_input = matches!(scalar.access, Access::Input(_));
    if !is_input {
        return Err(call.error(format_args!("{} is not an input", scalar.name())));
    }
    check_order(call, scalar, order)?;
    let (name, unit) = (scalar.name(), scalar.variable.unit());
    let fastest = scalar.variable.fastest();
    let allowed = match fastest.is_finite() {
        true => format!("-{fastest:?} to {fastest:?} {unit}/s"),
        false => "any finite number".into(),
    };
    let slope = text(slope);
    Err(call.error(format_args!("derivative of {name} = {slope} (allowed: {allowed})")))
}

fn check_order<M: Model>(call: &Call, scalar: &Scalar<M>, order: i32) -> Result<(), Fault> {
    if order == 1 {
        return Ok(());
    }
    Err(call
        .error(format_args!("derivative of order {order} of {} (allowed: order 1)", scalar.name())))
}

fn check_direction<M: Model>(call: &Call, scalar: &Scalar<M>, d: f64) -> Result<(), Fault> {
    if is_finite(d) {
        return Ok(());
    }
    let (name, d) = (scalar.name(), text(d));
    Err(call.error(format_args!("direction of {name} = {d} (allowed: any finite number)")))
}

fn check_length(call: &Call, name: &str, given: usize, needed: usize) -> Result<(), Fault> {
    if given == needed {
        return Ok(());
    }
    Err(call.error(format_args!("{name} = {given} (allowed: {needed})")))
}

#[inline]
fn scalar<M: Model, V: Version>(call: &Call, reference: u32) -> Result<&'static Scalar<M>, Fault> {
    V::scalar(reference, call.c_type).map_err(|why| call.error(why))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Dynamics;
    use crate::tests::trays::Trays;
    use crate::v3::Fmi3;

    /// The function `move_aside` moves states with the nominal value 5 m and inputs with the nominal value 4 m/s by up to a
    /// hundredth of these values, so that dependencies can be tested at nearby points. Inputs are only increased, and stay
    /// within their ranges.
    #[test]
    fn finite_differences_move_every_state_and_input_in_proportion_to_its_size() {
        let moved = |share: f64, point: u64, q: f64| {
            let mut instance = Instance::<Trays, Fmi3>::new(Interface::ModelExchange);
            instance.enter_initialization_mode().unwrap();
            instance.exit_initialization_mode().unwrap();
            let inputs = INPUTS.map(|n| &Trays::table().scalars[n]);
            for scalar in inputs {
                instance.store(scalar, Value::Real(q));
            }
            instance.move_aside(share, point);
            let x = instance.model.as_ref().unwrap().continuous_states();
            let by_state = [x[0] - 1.0, x[1] - 2.0, x[2] - 4.0].map(|dx| dx / (5.0 * share));
            let by_input = inputs.map(|scalar| {
                let Access::Input(ramp) = scalar.access else { panic!() };
                (*ramp(&mut instance.inputs, scalar.element)[0] - q) / (4.0 * share)
            });
            (by_state, by_input)
        };
        const INPUTS: [usize; 3] = [7, 8, 9];
        let (mut states, mut inputs) = (Vec::new(), Vec::new());
        for point in 1..9 {
            let (by_state, by_input) = moved(0.01, point, 0.5);
            // If the share is doubled, the displacements are twice as large.
            let (twice, inputs_twice) = moved(0.02, point, 0.5);
            for n in 0..3 {
                assert!((by_state[n] - twice[n]).abs() < 1e-12, "{by_state:?} {twice:?}");
                assert!((by_input[n] - inputs_twice[n]).abs() < 1e-12, "{by_input:?}");
            }
            states.extend(by_state);
            inputs.extend(by_input);
        }
        assert!(states.iter().all(|part| part.abs() <= 1.0), "{states:?}");
        assert!(inputs.iter().all(|part| (0.0..=1.0).contains(part)), "{inputs:?}");
        // The displacements fill the interval: of 24 displacements none is far from its neighbour. An input has the same
        // displacement for two points.
        states.sort_unstable_by(f64::total_cmp);
        assert!(states[0] < -0.85 && states[23] > 0.85, "{states:?}");
        assert!(
            states.windows(2).all(|pair| (1e-3..0.25).contains(&(pair[1] - pair[0]))),
            "{states:?}"
        );
        inputs.sort_unstable_by(f64::total_cmp);
        assert!(inputs[0] < 0.2 && inputs[23] > 0.7, "{inputs:?}");
        // Inputs at the end of their range do not change.
        assert_eq!(moved(0.01, 1, 8.0).1, [0.0; 3]);
    }
}

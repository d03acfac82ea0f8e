//! One instance's life, without C: what FMI's calls do to it.
//!
//! A call that is refused changes nothing. The one exception is a step that the
//! plant could not compute: the plant stands where it was, but the instance goes
//! to the state "step failed", where it can be read, reset, or given a saved
//! state.
//!
//! In Model Exchange the host integrates: it sets time and states, and what is
//! discrete (the contact of hub and bearing, the wave's regime, the gyro's reading)
//! changes in [`Instance::new_discrete_states`] alone.

use plant::{INDICATORS, Inputs, Outputs, Parameters, Plant, Ramp, STATES};

use crate::calls::{self, Call, Fault, Interface, Mode};
use crate::table::{self, RATES, SCALARS, Scalar};
use crate::variable::{Access, Causality, Value, Variable};

/// The tolerance when the host names none.
pub const DEFAULT_TOLERANCE: f64 = 1e-8;
/// The tolerances that a host can ask for.
pub const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-14..=1e-1;
/// What two times may differ by, relative to the larger of time and step: hosts
/// add up steps in their own way and are off by a few ulps.
const TIME_SLACK: f64 = 1e-9;

/// An instance of the FMU.
///
/// Cloning it is saving its state: there is nothing else to an instance.
#[derive(Clone, Debug)]
pub struct Instance {
    pub(crate) interface: Interface,
    pub(crate) mode: Mode,
    pub(crate) start: f64,
    pub(crate) stop: Option<f64>,
    pub(crate) tolerance: f64,
    /// The communication point the host has reached.
    pub(crate) time: f64,
    /// The parameters' values in the table's order, right or wrong.
    pub(crate) parameters: Vec<Value>,
    pub(crate) inputs: Inputs,
    /// There from the first look at it in initialization mode; gone when a parameter or an
    /// input is set before the instance runs.
    pub(crate) plant: Option<Plant>,
    /// What the plant shows now, if somebody has asked.
    pub(crate) shown: Option<Outputs>,
}

/// What fmi2NewDiscreteStates tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventInfo {
    /// The FMU has changed continuous states.
    pub states_changed: bool,
    /// When the next event is due at the latest, s.
    pub next_time: Option<f64>,
}

/// What a variable does in a direction of states and inputs.
struct Slopes {
    states: [f64; STATES],
    rates: [f64; STATES],
    outputs: Outputs,
}

impl Instance {
    /// As fmi2Instantiate leaves it.
    pub fn new(interface: Interface) -> Instance {
        Instance {
            interface,
            mode: Mode::Instantiated,
            start: 0.0,
            stop: None,
            tolerance: DEFAULT_TOLERANCE,
            time: 0.0,
            parameters: table::parameters().filter_map(Variable::start).collect(),
            inputs: Inputs::default(),
            plant: None,
            shown: None,
        }
    }

    /// What it is made for.
    pub fn interface(&self) -> Interface {
        self.interface
    }

    /// Whether a call is allowed now.
    pub fn check(&self, call: &Call) -> Result<(), Fault> {
        call.check(self.interface, self.mode)
    }

    /// Where it is in its life.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// The communication point the host has reached.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// After a panic nothing it says can be trusted.
    pub fn poison(&mut self) {
        self.mode = Mode::Fatal;
    }

    /// fmi2SetupExperiment: `None` where the host defines nothing.
    pub fn setup_experiment(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> Result<(), Fault> {
        let call = &calls::SETUP_EXPERIMENT;
        self.check(call)?;
        let mut problems = Vec::new();
        if !start.is_finite() {
            problems.push(format!("startTime = {start:?} (allowed: any finite number)"));
        }
        if let Some(stop) = stop
            && !(stop.is_finite() && stop >= start)
        {
            problems.push(format!("stopTime = {stop:?} (allowed: startTime {start:?} or later)"));
        }
        if let Some(tolerance) = tolerance
            && !TOLERANCES.contains(&tolerance)
        {
            let (low, high) = (TOLERANCES.start(), TOLERANCES.end());
            problems.push(format!("tolerance = {tolerance:?} (allowed: {low:?} to {high:?})"));
        }
        if !problems.is_empty() {
            return Err(call.error(problems.join("; ")));
        }
        self.tolerance = tolerance.unwrap_or(DEFAULT_TOLERANCE);
        self.start = start;
        self.stop = stop;
        self.time = start;
        Ok(())
    }

    /// fmi2EnterInitializationMode
    pub fn enter_initialization_mode(&mut self) -> Result<(), Fault> {
        self.check(&calls::ENTER_INITIALIZATION)?;
        self.mode = Mode::Initialization;
        Ok(())
    }

    /// fmi2ExitInitializationMode: here at the latest bad parameters come up.
    pub fn exit_initialization_mode(&mut self) -> Result<(), Fault> {
        let call = &calls::EXIT_INITIALIZATION;
        self.check(call)?;
        self.shown(call)?;
        self.mode = match self.interface {
            Interface::CoSimulation => Mode::Stepping,
            Interface::ModelExchange => Mode::Initialized,
        };
        Ok(())
    }

    /// Model Exchange goes on from initialization: parameters are what they are now.
    fn go_on(&mut self, call: &Call) -> Result<(), Fault> {
        if self.mode == Mode::Initialized {
            self.plant(call)?;
            self.mode = Mode::Event;
        }
        Ok(())
    }

    /// fmi2Terminate
    pub fn terminate(&mut self) -> Result<(), Fault> {
        let call = &calls::TERMINATE;
        self.check(call)?;
        self.go_on(call)?;
        self.mode = Mode::Terminated;
        Ok(())
    }

    /// fmi2Reset: as new.
    pub fn reset(&mut self) -> Result<(), Fault> {
        self.check(&calls::RESET)?;
        *self = Instance::new(self.interface);
        Ok(())
    }

    /// fmi2GetReal and its kin: one value.
    pub fn get(&mut self, call: &Call, reference: u32) -> Result<Value, Fault> {
        self.check(call)?;
        let scalar = scalar(call, reference)?;
        let name = scalar.variable.name;
        if let Access::Input(ramp) = scalar.variable.access {
            return Ok(Value::Real(ramp(&mut self.inputs).value));
        }
        if scalar.variable.causality == Causality::Parameter {
            let value = self.parameters.get(scalar.slot).copied();
            return value.ok_or_else(|| call.error(format_args!("{name} has no value")));
        }
        if self.mode == Mode::Instantiated {
            return Err(call.error(format_args!(
                "{name} has no value in state \"{}\"; it has one from {} on",
                self.mode.name(),
                Mode::Initialization.name()
            )));
        }
        let value = match (scalar.variable.access, scalar.variable.state) {
            (Access::Calculated(_) | Access::CalculatedPerMode(_), _) => {
                scalar.variable.calculated(self.plant(call)?.calculated(), scalar.element)
            }
            (_, Some(place)) => {
                let states = self.plant(call)?.continuous_states();
                Some(Value::Real(states[place.at(scalar.element)]))
            }
            (Access::Rate(place), _) => {
                let rates = self.look(call, |plant, inputs| plant.derivatives(inputs))?;
                Some(Value::Real(rates[place.at(scalar.element)]))
            }
            _ => scalar.variable.shown(self.shown(call)?),
        };
        value.ok_or_else(|| call.error(format_args!("{name} has no value")))
    }

    /// fmi2SetReal and its kin: all of the values, or none.
    pub fn set(
        &mut self,
        call: &Call,
        references: &[u32],
        value: impl Fn(usize) -> Value,
    ) -> Result<(), Fault> {
        self.check(call)?;
        let mut tunes = false;
        for (n, reference) in references.iter().enumerate() {
            let variable = self.check_set(call, *reference, value(n))?;
            tunes |= variable.causality == Causality::Parameter && self.is_running();
        }
        if tunes {
            self.tune(call, references, &value)?;
        }
        for (n, reference) in references.iter().enumerate() {
            self.put(call, *reference, value(n))?;
        }
        Ok(())
    }

    /// Sets an input or a parameter; what follows from it has to be computed anew.
    fn put(&mut self, call: &Call, reference: u32, value: Value) -> Result<(), Fault> {
        let scalar = scalar(call, reference)?;
        match (scalar.variable.access, value) {
            (Access::Input(ramp), Value::Real(x)) => ramp(&mut self.inputs).value = x,
            (_, value) => {
                if let Some(slot) = self.parameters.get_mut(scalar.slot) {
                    *slot = value;
                }
            }
        }
        self.shown = None;
        if !self.is_running() {
            self.plant = None;
        }
        Ok(())
    }

    /// Parameters that are fixed can no longer be set, and the motion has begun.
    pub(crate) fn is_running(&self) -> bool {
        !matches!(self.mode, Mode::Instantiated | Mode::Initialization | Mode::Initialized)
    }

    fn check_set(
        &self,
        call: &Call,
        reference: u32,
        value: Value,
    ) -> Result<&'static Variable, Fault> {
        let variable = scalar(call, reference)?.variable;
        let is_parameter = variable.causality == Causality::Parameter;
        if !is_parameter && variable.causality != Causality::Input {
            return Err(call.error(format_args!(
                "{} is computed; only inputs and parameters can be set",
                variable.name
            )));
        }
        if is_parameter && self.is_running() {
            let (kind, modes) = match variable.tunable {
                true => ("tunable", &[Mode::Stepping, Mode::Event][..]),
                false => ("fixed", &[][..]),
            };
            if !modes.contains(&self.mode) {
                let (name, now) = (variable.name, self.mode.name());
                let mut all = vec![Mode::Instantiated.name(), Mode::Initialization.name()];
                all.extend(modes.iter().map(|mode| mode.name()));
                return Err(call.error(format_args!(
                    "{name} is a {kind} parameter and cannot be set in state \"{now}\"; it can in: {}",
                    all.join(", ")
                )));
            }
        }
        // Wrong parameters are refused all together when initialization ends, everything
        // else on the spot.
        let later = is_parameter && matches!(self.mode, Mode::Instantiated | Mode::Initialization);
        match variable.problem(value) {
            Some(problem) if !later => Err(call.error(problem)),
            _ => Ok(variable),
        }
    }

    /// Gives the running plant what has been set among its tunable parameters.
    fn tune(
        &mut self,
        call: &Call,
        references: &[u32],
        value: &impl Fn(usize) -> Value,
    ) -> Result<(), Fault> {
        let mut parameters =
            self.plant_parameters().map_err(|problems| call.error(problems.join("; ")))?;
        for (n, reference) in references.iter().enumerate() {
            scalar(call, *reference)?.variable.set_parameter(&mut parameters, value(n));
        }
        let inputs = self.inputs;
        self.plant(call)?
            .set_friction(&parameters.friction, &inputs)
            .map_err(|problems| call.error(problems.join("; ")))
    }

    /// fmi2SetRealInputDerivatives: the slope holds for the next step only.
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), Fault> {
        let call = &calls::SET_INPUT_DERIVATIVES;
        self.check(call)?;
        for ((reference, order), slope) in references.iter().zip(orders).zip(values) {
            let variable = scalar(call, *reference)?.variable;
            let name = variable.name;
            if variable.causality != Causality::Input {
                return Err(call.error(format_args!("{name} is not an input")));
            }
            if *order != 1 {
                return Err(call.error(format_args!("order {order} of {name} (allowed: 1)")));
            }
            if !slope.is_finite() {
                return Err(call.error(format_args!(
                    "derivative of {name} = {slope} (allowed: any finite number)"
                )));
            }
        }
        for (reference, slope) in references.iter().zip(values) {
            if let Access::Input(ramp) = scalar(call, *reference)?.variable.access {
                ramp(&mut self.inputs).slope = *slope;
            }
        }
        Ok(())
    }

    /// fmi2GetRealOutputDerivatives: the time derivative of a variable, the inputs
    /// running along the slopes that are set for the next step.
    pub fn output_derivative(&mut self, reference: u32, order: i32) -> Result<f64, Fault> {
        let call = &calls::GET_OUTPUT_DERIVATIVES;
        self.check(call)?;
        let scalar = scalar(call, reference)?;
        if order != 1 {
            let name = scalar.name();
            return Err(call.error(format_args!("order {order} of {name} (allowed: 1)")));
        }
        let inputs = self.inputs;
        let states = self.look(call, |plant, inputs| plant.derivatives(inputs))?;
        self.slopes(call, states, &inputs)?.of(call, scalar)
    }

    /// fmi2GetDirectionalDerivative: what the unknowns do when the knowns go in a
    /// direction. Knowns are inputs and continuous states; in initialization mode, where
    /// the states are unknown as well, inputs and parameters.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
        answers: &mut [f64],
    ) -> Result<(), Fault> {
        let call = &calls::DIRECTIONAL_DERIVATIVE;
        self.check(call)?;
        if self.mode == Mode::Initialization {
            return self.initial_derivative(call, unknowns, (knowns, direction), answers);
        }
        let mut states = [0.0; STATES];
        let nowhere = Ramp::held(0.0);
        let mut along = Inputs { tau_cmd: nowhere, tau_ext: nowhere, g_axial: nowhere };
        for (reference, d) in knowns.iter().zip(direction) {
            let scalar = scalar(call, *reference)?;
            check_direction(call, scalar, *d)?;
            match (scalar.variable.access, scalar.variable.state) {
                (Access::Input(ramp), _) => ramp(&mut along).slope += d,
                (_, Some(place)) => states[place.at(scalar.element)] += d,
                _ => {
                    return Err(call.error(format_args!(
                        "{} is not among the knowns: it is neither an input nor a continuous state",
                        scalar.name()
                    )));
                }
            }
        }
        let slopes = self.slopes(call, states, &along)?;
        for (reference, answer) in unknowns.iter().zip(answers) {
            *answer = slopes.of(call, scalar(call, *reference)?)?;
        }
        Ok(())
    }

    /// As above, by central differences with Richardson's extrapolation between
    /// instances that start elsewhere: each known moves by a thousandth of its value, or
    /// of its order of magnitude where it is smaller.
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
            let scalar = scalar(call, *reference)?;
            check_direction(call, scalar, *d)?;
            let known = [Causality::Input, Causality::Parameter];
            let value = match self.clone().get(call, *reference)? {
                Value::Real(x) if known.contains(&scalar.variable.causality) => x,
                _ => {
                    return Err(call.error(format_args!(
                        "{} is not among the knowns: in initialization mode these are inputs and \
                         parameters",
                        scalar.name()
                    )));
                }
            };
            let unit = if value == 0.0 { scalar.variable.nominal() } else { value.abs() };
            size = size.max(d.abs() / unit);
            start.push(value);
        }
        let step = if size > 0.0 { SHARE / size } else { 1.0 };
        let at = |s: f64| -> Result<Vec<f64>, Fault> {
            let mut moved = self.clone();
            for ((reference, x), d) in knowns.iter().zip(&start).zip(direction) {
                moved.put(call, *reference, Value::Real(x + s * step * d))?;
            }
            let values = unknowns.iter().map(|reference| match moved.get(call, *reference)? {
                Value::Real(x) => Ok(x),
                _ => Err(call.error("wrong type")),
            });
            values.collect()
        };
        let (p2, p1, m1, m2) = (at(2.0)?, at(1.0)?, at(-1.0)?, at(-2.0)?);
        for (n, answer) in answers.iter_mut().take(unknowns.len()).enumerate() {
            *answer = (8.0 * (p1[n] - m1[n]) - (p2[n] - m2[n])) / (12.0 * step);
        }
        Ok(())
    }

    /// What everything does when the states go in a direction and the inputs along
    /// their slopes.
    fn slopes(
        &mut self,
        call: &Call,
        states: [f64; STATES],
        along: &Inputs,
    ) -> Result<Slopes, Fault> {
        let du = [along.tau_cmd.slope, along.tau_ext.slope, along.g_axial.slope];
        self.look(call, |plant, inputs| Slopes {
            states,
            rates: plant.directional_derivative(inputs, &states, &du),
            outputs: plant.output_derivatives(inputs, &states, &du),
        })
    }

    /// fmi2DoStep: from `at` on by `h`. Does not allocate unless it fails.
    pub fn do_step(&mut self, at: f64, h: f64) -> Result<(), Fault> {
        let call = &calls::DO_STEP;
        self.check(call)?;
        if !(h.is_finite() && h > 0.0) {
            return Err(call.error(format_args!(
                "communicationStepSize = {h:?} s (allowed: greater than 0, finite)"
            )));
        }
        // Written so that NaN does not pass.
        let close = (at - self.time).abs() <= TIME_SLACK * self.time.abs().max(h);
        if !close {
            return Err(call.error(format_args!(
                "currentCommunicationPoint = {at:?} s, but the last step ended at {:?} s",
                self.time
            )));
        }
        let end = at + h;
        if let Some(stop) = self.stop
            && end > stop + TIME_SLACK * stop.abs().max(h)
        {
            return Err(call
                .error(format_args!("the step to {end:?} s would pass the stop time {stop:?} s")));
        }
        let (used, after) = self.inputs_over(call, h)?;
        let Some(plant) = &mut self.plant else {
            return Err(call.error("the instance was never initialised"));
        };
        if let Err(why) = plant.step(&used, h) {
            self.mode = Mode::Failed;
            return Err(call.error(format_args!("step from {at:?} s to {end:?} s failed: {why}")));
        }
        self.time = end;
        self.inputs = after;
        self.shown = None;
        Ok(())
    }

    /// The inputs during a step of `h`, and where they stand after it.
    fn inputs_over(&self, call: &Call, h: f64) -> Result<(Inputs, Inputs), Fault> {
        let mut used = self.inputs;
        let mut after = self.inputs;
        for (variable, ramp) in table::ramps() {
            let during = ramp(&mut used);
            let mut end = during.value + during.slope * h;
            let floor = variable.min().unwrap_or(f64::NEG_INFINITY);
            // A ramp down to the smallest value may miss it by a rounding error.
            if end < floor && end > floor - TIME_SLACK * (during.value - floor) {
                end = floor;
                during.slope = (floor - during.value) / h;
            }
            if let Some(problem) = variable.problem(Value::Real(end)) {
                return Err(call.error(format_args!("at the end of the step {problem}")));
            }
            *ramp(&mut after) = Ramp { value: end, slope: 0.0 };
        }
        Ok((used, after))
    }

    // ---- Model Exchange ----

    /// fmi2EnterEventMode
    pub fn enter_event_mode(&mut self) -> Result<(), Fault> {
        let call = &calls::ENTER_EVENT;
        self.check(call)?;
        self.go_on(call)?;
        self.mode = Mode::Event;
        Ok(())
    }

    /// fmi2NewDiscreteStates: everything that is due now. Once is enough; calling it
    /// again, after other inputs, does no harm.
    pub fn new_discrete_states(&mut self) -> Result<EventInfo, Fault> {
        let call = &calls::NEW_DISCRETE_STATES;
        self.check(call)?;
        let event = self.look(call, |plant, inputs| plant.take_event(inputs))?;
        let states_changed = event.map_err(|why| call.error(why))?;
        self.mode = Mode::Event;
        self.shown = None;
        Ok(EventInfo { states_changed, next_time: self.plant(call)?.next_time_event() })
    }

    /// fmi2EnterContinuousTimeMode
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), Fault> {
        let call = &calls::ENTER_CONTINUOUS_TIME;
        self.check(call)?;
        self.go_on(call)?;
        self.mode = Mode::Continuous;
        Ok(())
    }

    /// fmi2CompletedIntegratorStep: whether an event has to be handled, because the
    /// regime has changed or the host has overlooked a change of the contact.
    pub fn completed_integrator_step(&mut self) -> Result<bool, Fault> {
        let call = &calls::COMPLETED_STEP;
        self.check(call)?;
        let time = self.time;
        if let Some(stop) = self.stop
            && time > stop + TIME_SLACK * stop.abs().max(1.0)
        {
            return Err(call.error(format_args!(
                "the step to {time:?} s has passed the stop time {stop:?} s"
            )));
        }
        let range = self.plant(call)?.check_range();
        if let Err(why) = range {
            self.mode = Mode::Failed;
            return Err(call.error(why));
        }
        self.look(call, |plant, inputs| plant.is_event_overdue(inputs))
    }

    /// fmi2SetTime
    pub fn set_time(&mut self, time: f64) -> Result<(), Fault> {
        let call = &calls::SET_TIME;
        self.check(call)?;
        if !time.is_finite() {
            return Err(call.error(format_args!("time = {time:?} s (allowed: any finite number)")));
        }
        self.go_on(call)?;
        self.plant(call)?.set_time(time);
        self.time = time;
        self.shown = None;
        Ok(())
    }

    /// fmi2SetContinuousStates. Numbers that are none are discarded: the integrator
    /// should try a shorter step.
    pub fn set_continuous_states(&mut self, states: &[f64]) -> Result<(), Fault> {
        let call = &calls::SET_CONTINUOUS_STATES;
        self.check(call)?;
        check_length(call, "nx", states.len(), STATES)?;
        let mut all = [0.0; STATES];
        for (place, x) in table::places().zip(states) {
            if !x.is_finite() {
                let name = table::state_at(place).map_or("a state".into(), Scalar::name);
                return Err(
                    call.discard(format_args!("{name} = {x:?} (allowed: any finite number)"))
                );
            }
            all[place] = *x;
        }
        self.go_on(call)?;
        self.plant(call)?.set_continuous_states(&all);
        self.shown = None;
        Ok(())
    }

    /// fmi2GetContinuousStates
    pub fn continuous_states(&mut self, states: &mut [f64]) -> Result<(), Fault> {
        let call = &calls::GET_CONTINUOUS_STATES;
        self.check(call)?;
        check_length(call, "nx", states.len(), STATES)?;
        let all = self.plant(call)?.continuous_states();
        for (place, x) in table::places().zip(states) {
            *x = all[place];
        }
        Ok(())
    }

    /// fmi2GetDerivatives. Numbers that are none are discarded, as above.
    pub fn derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), Fault> {
        let call = &calls::GET_DERIVATIVES;
        self.check(call)?;
        check_length(call, "nx", derivatives.len(), STATES)?;
        let all = self.look(call, |plant, inputs| plant.derivatives(inputs))?;
        for ((place, rate), x) in table::places().zip(&RATES).zip(derivatives) {
            *x = all[place];
            if !x.is_finite() {
                return Err(call.discard(format_args!("{} = {x:?}", rate.name())));
            }
        }
        Ok(())
    }

    /// fmi2GetEventIndicators
    pub fn event_indicators(&mut self, indicators: &mut [f64]) -> Result<(), Fault> {
        let call = &calls::GET_EVENT_INDICATORS;
        self.check(call)?;
        check_length(call, "ni", indicators.len(), INDICATORS)?;
        let all = self.look(call, |plant, inputs| plant.event_indicators(inputs))?;
        indicators.copy_from_slice(&all);
        Ok(())
    }

    /// fmi2GetNominalsOfContinuousStates
    pub fn nominals(&self, nominals: &mut [f64]) -> Result<(), Fault> {
        let call = &calls::GET_NOMINALS;
        self.check(call)?;
        check_length(call, "nx", nominals.len(), STATES)?;
        for (place, x) in table::places().zip(nominals) {
            *x = table::state_at(place).map_or(1.0, |state| state.variable.nominal());
        }
        Ok(())
    }

    // ---- Saved states and what is behind it all ----

    /// fmi2SetFMUstate
    pub fn restore(&mut self, saved: &Instance) -> Result<(), Fault> {
        let call = &calls::SET_FMU_STATE;
        self.check(call)?;
        if saved.interface != self.interface {
            return Err(call.error(format_args!(
                "the state is of an instance for {}, and this one is for {}",
                saved.interface.name(),
                self.interface.name()
            )));
        }
        self.clone_from(saved);
        Ok(())
    }

    /// The plant; it is made when it is first asked for.
    fn plant(&mut self, call: &Call) -> Result<&mut Plant, Fault> {
        if self.plant.is_none() {
            let made = self.plant_parameters().and_then(|parameters| {
                Plant::new(&parameters, &self.inputs, self.start, self.tolerance)
            });
            self.plant = Some(made.map_err(|problems| call.error(problems.join("; ")))?);
        }
        self.plant.as_mut().ok_or_else(|| call.error("the instance was never initialised"))
    }

    /// The parameters as the plant takes them, or all that is wrong with them.
    pub(crate) fn plant_parameters(&self) -> Result<Parameters, Vec<String>> {
        let mut parameters = Parameters::default();
        let mut problems = Vec::new();
        for (variable, value) in table::parameters().zip(&self.parameters) {
            variable.set_parameter(&mut parameters, *value);
            problems.extend(variable.problem(*value));
        }
        if problems.is_empty() { Ok(parameters) } else { Err(problems) }
    }

    /// What the plant shows now; it is computed when it is first asked for.
    fn shown(&mut self, call: &Call) -> Result<&Outputs, Fault> {
        if self.shown.is_none() {
            let inputs = self.inputs;
            let interface = self.interface;
            let plant = self.plant(call)?;
            self.shown = Some(match interface {
                Interface::CoSimulation => plant.outputs(&inputs),
                Interface::ModelExchange => plant.outputs_held(&inputs),
            });
        }
        self.shown.as_ref().ok_or_else(|| call.error("the outputs were not computed"))
    }

    /// Looks at the plant: in Co-Simulation with the contact that the present inputs
    /// give; in Model Exchange, where it changes at events alone, with the one it has.
    fn look<T>(
        &mut self,
        call: &Call,
        look: impl FnOnce(&mut Plant, &Inputs) -> T,
    ) -> Result<T, Fault> {
        let inputs = self.inputs;
        let interface = self.interface;
        let plant = self.plant(call)?;
        Ok(match interface {
            Interface::CoSimulation => {
                plant.with_present_contact(&inputs, |plant| look(plant, &inputs))
            }
            Interface::ModelExchange => look(plant, &inputs),
        })
    }

    /// How often hub and bearing have changed their contact, when last, and what it is;
    /// see [`Plant::last_contact`].
    pub fn last_contact(&self) -> Option<(i32, f64, i32)> {
        self.plant.as_ref().map(Plant::last_contact)
    }
}

impl Slopes {
    fn of(&self, call: &Call, scalar: &Scalar) -> Result<f64, Fault> {
        let v = scalar.variable;
        match (v.access, v.state, v.shown(&self.outputs)) {
            (Access::Rate(place), ..) => Ok(self.rates[place.at(scalar.element)]),
            (_, Some(place), _) => Ok(self.states[place.at(scalar.element)]),
            (_, _, Some(Value::Real(slope))) => Ok(slope),
            _ => {
                let name = scalar.name();
                Err(call.error(format_args!("{name} is not computed from states and inputs")))
            }
        }
    }
}

fn check_direction(call: &Call, scalar: &Scalar, d: f64) -> Result<(), Fault> {
    if d.is_finite() {
        return Ok(());
    }
    let name = scalar.name();
    Err(call.error(format_args!("direction of {name} = {d} (allowed: any finite number)")))
}

fn check_length(call: &Call, name: &str, given: usize, needed: usize) -> Result<(), Fault> {
    if given == needed {
        return Ok(());
    }
    Err(call.error(format_args!("{name} = {given} (allowed: {needed})")))
}

/// The variable of a value reference, if it has the type that the call is for.
#[inline]
fn scalar(call: &Call, reference: u32) -> Result<&'static Scalar, Fault> {
    let found = usize::try_from(reference).ok().and_then(|n| SCALARS.get(n));
    let Some(scalar) = found else {
        return Err(call.error(format_args!(
            "no variable has the value reference {reference}; the last one is {}",
            SCALARS.len() - 1
        )));
    };
    let c_type = scalar.variable.c_type();
    if call.c_type != Some(c_type) {
        return Err(call.error(format_args!(
            "{} (value reference {reference}) is of type {c_type:?}",
            scalar.name()
        )));
    }
    Ok(scalar)
}

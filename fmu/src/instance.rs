//! One instance's life, without C: what FMI's calls do to it.
//!
//! A call that is refused changes nothing. The one exception is a step that the
//! plant could not compute: the plant stands where it was, but the instance goes
//! to the state "step failed", where it can be read, reset, or given a saved
//! state.

use plant::{Inputs, Outputs, Parameters, Plant, Ramp};

use crate::calls::{self, Call, Fault, Mode};
use crate::table::{self, SCALARS, Scalar};
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
    pub(crate) mode: Mode,
    pub(crate) start: f64,
    pub(crate) stop: Option<f64>,
    pub(crate) tolerance: f64,
    /// The communication point the host has reached.
    pub(crate) time: f64,
    /// The parameters' values in the table's order, right or wrong.
    pub(crate) parameters: Vec<Value>,
    pub(crate) inputs: Inputs,
    /// There from the first look at it in initialization mode; gone when a
    /// parameter or an input is set there.
    pub(crate) plant: Option<Plant>,
    /// What the plant shows now, if somebody has asked.
    pub(crate) shown: Option<Outputs>,
}

impl Default for Instance {
    fn default() -> Self {
        Instance::new()
    }
}

impl Instance {
    /// As fmi2Instantiate leaves it.
    pub fn new() -> Instance {
        Instance {
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
        call.check(self.mode)?;
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
        calls::ENTER_INITIALIZATION.check(self.mode)?;
        self.mode = Mode::Initialization;
        Ok(())
    }

    /// fmi2ExitInitializationMode: here at the latest bad parameters come up.
    pub fn exit_initialization_mode(&mut self) -> Result<(), Fault> {
        let call = &calls::EXIT_INITIALIZATION;
        call.check(self.mode)?;
        self.plant(call)?;
        self.mode = Mode::Stepping;
        Ok(())
    }

    /// fmi2Terminate
    pub fn terminate(&mut self) -> Result<(), Fault> {
        calls::TERMINATE.check(self.mode)?;
        self.mode = Mode::Terminated;
        Ok(())
    }

    /// fmi2Reset: as new.
    pub fn reset(&mut self) -> Result<(), Fault> {
        calls::RESET.check(self.mode)?;
        *self = Instance::new();
        Ok(())
    }

    /// fmi2GetReal and its kin: one value.
    pub fn get(&mut self, call: &Call, reference: u32) -> Result<Value, Fault> {
        call.check(self.mode)?;
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
        let value = match scalar.variable.causality {
            Causality::CalculatedParameter => {
                scalar.variable.calculated(self.plant(call)?.calculated(), scalar.element)
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
        call.check(self.mode)?;
        for (n, reference) in references.iter().enumerate() {
            self.check_set(call, *reference, value(n))?;
        }
        for (n, reference) in references.iter().enumerate() {
            let scalar = scalar(call, *reference)?;
            match (scalar.variable.access, value(n)) {
                (Access::Input(ramp), Value::Real(x)) => ramp(&mut self.inputs).value = x,
                (_, value) => {
                    if let Some(slot) = self.parameters.get_mut(scalar.slot) {
                        *slot = value;
                    }
                }
            }
        }
        if !references.is_empty() {
            self.forget();
        }
        Ok(())
    }

    fn check_set(&self, call: &Call, reference: u32, value: Value) -> Result<(), Fault> {
        let variable = scalar(call, reference)?.variable;
        match variable.causality {
            // Wrong inputs are refused on the spot, wrong parameters all
            // together when initialization ends.
            Causality::Input => match variable.problem(value) {
                Some(problem) => Err(call.error(problem)),
                None => Ok(()),
            },
            Causality::Parameter if self.mode == Mode::Stepping => Err(call.error(format_args!(
                "{} is a fixed parameter and cannot be set in state \"{}\"; it can in: {}, {}",
                variable.name,
                self.mode.name(),
                Mode::Instantiated.name(),
                Mode::Initialization.name()
            ))),
            Causality::Parameter => Ok(()),
            _ => Err(call.error(format_args!(
                "{} is computed; only inputs and parameters can be set",
                variable.name
            ))),
        }
    }

    /// What follows from parameters and inputs has to be computed anew.
    fn forget(&mut self) {
        self.shown = None;
        if self.mode != Mode::Stepping {
            self.plant = None;
        }
    }

    /// fmi2SetRealInputDerivatives: the slope holds for the next step only.
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), Fault> {
        let call = &calls::SET_INPUT_DERIVATIVES;
        call.check(self.mode)?;
        let mut slopes = Vec::with_capacity(references.len());
        for ((reference, order), slope) in references.iter().zip(orders).zip(values) {
            let variable = scalar(call, *reference)?.variable;
            let name = variable.name;
            let Access::Input(ramp) = variable.access else {
                return Err(call.error(format_args!("{name} is not an input")));
            };
            if *order != 1 {
                return Err(call.error(format_args!("order {order} of {name} (allowed: 1)")));
            }
            if !slope.is_finite() {
                return Err(call.error(format_args!(
                    "derivative of {name} = {slope} (allowed: any finite number)"
                )));
            }
            slopes.push((ramp, *slope));
        }
        for (ramp, slope) in slopes {
            ramp(&mut self.inputs).slope = slope;
        }
        Ok(())
    }

    /// fmi2GetRealOutputDerivatives: the outputs whose derivative is a variable
    /// too have one.
    pub fn output_derivative(&mut self, reference: u32, order: i32) -> Result<f64, Fault> {
        type Derivative = fn(&Outputs) -> f64;
        const KNOWN: [(&str, Derivative); 4] = [
            ("theta", |o| o.omega),
            ("omega", |o| o.omega_dot),
            ("slosh_angle", |o| o.slosh_rate),
            ("slosh_angle_radial", |o| o.slosh_rate_radial),
        ];
        let call = &calls::GET_OUTPUT_DERIVATIVES;
        call.check(self.mode)?;
        let name = scalar(call, reference)?.variable.name;
        match KNOWN.iter().find(|(known, _)| *known == name) {
            Some((_, derivative)) if order == 1 => Ok(derivative(self.shown(call)?)),
            _ => {
                let known: Vec<_> = KNOWN.iter().map(|(known, _)| *known).collect();
                Err(call.error(format_args!(
                    "no derivative of order {order} of {name}; there are those of order 1 of {}",
                    known.join(", ")
                )))
            }
        }
    }

    /// fmi2DoStep: from `at` on by `h`. Does not allocate unless it fails.
    pub fn do_step(&mut self, at: f64, h: f64) -> Result<(), Fault> {
        let call = &calls::DO_STEP;
        call.check(self.mode)?;
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

    /// fmi2SetFMUstate
    pub fn restore(&mut self, saved: &Instance) -> Result<(), Fault> {
        calls::SET_FMU_STATE.check(self.mode)?;
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
        let shown = match self.shown {
            Some(shown) => shown,
            None => {
                let inputs = self.inputs;
                self.plant(call)?.outputs(&inputs)
            }
        };
        Ok(self.shown.insert(shown))
    }
}

/// The variable of a value reference, if it has the type that the call is for.
fn scalar(call: &Call, reference: u32) -> Result<Scalar, Fault> {
    let found = usize::try_from(reference).ok().and_then(|n| SCALARS.get(n));
    let Some(scalar) = found else {
        return Err(call.error(format_args!(
            "no variable has the value reference {reference}; the last one is {}",
            SCALARS.len() - 1
        )));
    };
    let c_type = scalar.variable.c_type();
    if c_type != call.c_type {
        return Err(call.error(format_args!(
            "{} (value reference {reference}) is of type {c_type}",
            scalar.name()
        )));
    }
    Ok(*scalar)
}

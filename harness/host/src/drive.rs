//! Runs an FMU of either version of FMI. Inputs are set at every communication point: Reals with their slope until the
//! next point, whereas integers, enumerations and Booleans are held. An FMU that was opened for Model Exchange is
//! integrated between the communication points by [`exchange`].

use std::borrow::Cow;

use anyhow::{Context, Result};

use crate::c_abi::Called;
use crate::description::{ModelDescription, Type, Value, Variable};
use crate::exchange;
use crate::fmu::Instance;

pub struct Inputs {
    references: Vec<u32>,
    places: Vec<usize>,
    discrete: Vec<(usize, Variable)>,
    sloped: bool,
    hold: bool,
    exchange: Option<f64>,
}

/// Relative tolerance of the host's solver in Model Exchange if neither the user nor the FMU's
/// default experiment states a tolerance.
const TOLERANCE: f64 = 1e-6;
/// Largest relative difference between an input and its linear extrapolation from the last
/// communication point that is not yet a jump. The limit separates jumps, which are events in Model
/// Exchange, from rounding errors of a ramp, which are not.
const JUMP: f64 = 1e-9;

/// Inputs for the time until the next communication point, which the closure of [`Inputs::drive`]
/// fills. Both lists have the order of the names that [`Inputs::new`] received.
///
/// - `slopes`: time derivatives, per s. They are ignored if the FMU cannot interpolate its inputs
///   or if the inputs are held.
pub struct Course<'a> {
    pub values: &'a mut [f64],
    pub slopes: &'a mut [f64],
}

impl Inputs {
    /// Selects the inputs `names` of an FMU, which a run then sets at each communication point.
    /// With `hold` they are constant during each step (zero-order hold); otherwise they change
    /// linearly.
    ///
    /// # Errors
    ///
    /// If the FMU has no variable with one of the names.
    pub fn new(description: &ModelDescription, names: &[&str], hold: bool) -> Result<Self> {
        let (mut references, mut places, mut discrete) = (Vec::new(), Vec::new(), Vec::new());
        for (place, name) in names.iter().enumerate() {
            let variable = description.variable(name)?;
            if variable.kind() == Type::Real {
                references.push(variable.reference);
                places.push(place);
            } else {
                discrete.push((place, variable.clone()));
            }
        }
        let interpolates =
            description.co_simulation.as_ref().is_some_and(|cs| cs.can_interpolate_inputs);
        let sloped = !hold && interpolates && !references.is_empty();
        let tolerance = description.default_experiment.tolerance.unwrap_or(TOLERANCE);
        let exchange = description.co_simulation.is_none().then_some(tolerance);
        Ok(Inputs { references, places, discrete, sloped, hold, exchange })
    }

    /// Sets the relative tolerance of the host's solver in Model Exchange. `None` leaves the
    /// tolerance of the default experiment.
    pub fn with_tolerance(self, tolerance: Option<f64>) -> Self {
        Inputs { exchange: self.exchange.map(|default| tolerance.unwrap_or(default)), ..self }
    }

    pub fn takes(kind: Type) -> bool {
        matches!(kind, Type::Real | Type::Integer | Type::Enumeration | Type::Boolean)
    }

    /// Initialises an instance whose start values have been set. `values` are the inputs at the
    /// time `start`, s. `tolerance` is relative, and `stop` is in s.
    pub fn initialise(
        &self,
        instance: &mut Instance,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
        values: &[f64],
    ) -> Called {
        instance.enter_initialization_mode(tolerance, start, stop)?;
        self.set(instance, values)?;
        instance.exit_initialization_mode()
    }

    /// Simulates an initialised instance from `start`, s. At every communication point the closure
    /// `at` is called with the instance and the time, s. It reads outputs, writes values and slopes
    /// of the inputs for the time until the next point, and returns the time of the next point, or
    /// `None` to end the run.
    ///
    /// # Errors
    ///
    /// Errors of `at`, and calls that the FMU refuses, with the time.
    pub fn drive<'fmu>(
        &self,
        instance: &mut Instance<'fmu>,
        start: f64,
        mut at: impl FnMut(&mut Instance<'fmu>, f64, Course) -> Result<Option<f64>>,
    ) -> Result<()> {
        if let Some(tolerance) = self.exchange {
            return self.integrate(instance, start, tolerance, at);
        }
        let count = self.places.len() + self.discrete.len();
        let (mut values, mut slopes) = (vec![0.0; count], vec![0.0; count]);
        let mut t = start;
        while let Some(next) = at(instance, t, Course { values: &mut values, slopes: &mut slopes })?
        {
            self.step(instance, t, next, &values, &slopes)
                .with_context(|| format!("the run stopped at t = {t} s"))?;
            t = next;
        }
        Ok(())
    }

    /// Simulates as [`Inputs::drive`] does, but in Model Exchange, with the host's solver of
    /// relative tolerance `tolerance`. An event is handled at a communication point if a Real input
    /// differs from its linear extrapolation from the previous point, or if an input of another
    /// type has changed.
    fn integrate<'fmu>(
        &self,
        instance: &mut Instance<'fmu>,
        start: f64,
        tolerance: f64,
        mut at: impl FnMut(&mut Instance<'fmu>, f64, Course) -> Result<Option<f64>>,
    ) -> Result<()> {
        let count = self.places.len() + self.discrete.len();
        let (mut values, mut slopes) = (vec![0.0; count], vec![0.0; count]);
        let mut run = exchange::Run::new(instance, tolerance, start, exchange::MOST_STEPS)?;
        // values, slopes and time of the inputs at the last communication point
        let mut last: Option<(Vec<f64>, Vec<f64>, f64)> = None;
        let mut t = start;
        while let Some(next) =
            at(run.instance(), t, Course { values: &mut values, slopes: &mut slopes })?
        {
            if self.hold {
                slopes.fill(0.0);
            }
            let mut step = || -> Result<()> {
                let jumps = |place: &usize| {
                    last.as_ref().is_some_and(|(before, slopes, from)| {
                        let (value, before) = (values[*place], before[*place]);
                        let by = slopes[*place] * (t - from);
                        let size = value.abs() + before.abs() + by.abs();
                        (value - before - by).abs() > JUMP * size
                    })
                };
                if self.discrete.iter().any(|(place, _)| jumps(place)) {
                    run.change(|instance| self.set_discrete(instance, &values))?;
                }
                let jump = self.places.iter().any(jumps);
                run.drive(&self.references, &self.reals(&values), &self.reals(&slopes), jump)?;
                run.integrate(next)
            };
            step().with_context(|| format!("the run stopped at t = {t} s"))?;
            last = Some((values.clone(), slopes.clone(), t));
            t = next;
        }
        Ok(())
    }

    fn reals<'a>(&self, values: &'a [f64]) -> Cow<'a, [f64]> {
        match self.discrete.is_empty() {
            true => Cow::Borrowed(values),
            false => self.places.iter().map(|place| values[*place]).collect(),
        }
    }

    fn set(&self, instance: &mut Instance, values: &[f64]) -> Called {
        self.set_discrete(instance, values)?;
        match self.references.is_empty() {
            true => Ok(()),
            false => instance.set_real(&self.references, &self.reals(values)),
        }
    }

    fn set_discrete(&self, instance: &mut Instance, values: &[f64]) -> Called {
        for (place, variable) in &self.discrete {
            let value = match variable.kind() {
                Type::Boolean => Value::Boolean(values[*place] != 0.0),
                _ => Value::Integer(values[*place] as _),
            };
            instance.set_value(variable, value)?;
        }
        Ok(())
    }

    fn step(
        &self,
        instance: &mut Instance,
        from: f64,
        to: f64,
        values: &[f64],
        slopes: &[f64],
    ) -> Called {
        self.set(instance, values)?;
        match self.sloped {
            true => {
                let (values, slopes) = (self.reals(values), self.reals(slopes));
                instance.do_step_along(from, to - from, &self.references, &values, &slopes)
            }
            false => instance.do_step(from, to - from),
        }
    }
}

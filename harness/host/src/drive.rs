//! A run by Co-Simulation of either version of FMI: Real inputs set at every communication point, with the slopes that they have
//! until the next.

use anyhow::{Context, Result};

use crate::c_abi::Called;
use crate::description::ModelDescription;
use crate::fmu::Instance;

/// The Real inputs that a host drives.
pub struct Inputs {
    references: Vec<u32>,
    /// The FMU takes slopes of inputs.
    sloped: bool,
}

/// Course of the inputs between two communication points, in their order.
pub struct Course<'a> {
    /// Values at the communication point.
    pub values: &'a mut [f64],
    /// Derivatives until the next, per s; an FMU that cannot interpolate, or whose inputs are held,
    /// does not hear of them.
    pub slopes: &'a mut [f64],
}

impl Inputs {
    /// Inputs by FMU name; `hold`: they are held over each step (zero-order hold).
    pub fn new(description: &ModelDescription, names: &[&str], hold: bool) -> Result<Self> {
        let references: Result<Vec<u32>> =
            names.iter().map(|name| Ok(description.variable(name)?.reference)).collect();
        let interpolates =
            description.co_simulation.as_ref().is_some_and(|cs| cs.can_interpolate_inputs);
        Ok(Inputs { references: references?, sloped: !hold && interpolates && !names.is_empty() })
    }

    /// Takes an instance whose start values are set through its initialisation, with the inputs' first
    /// values.
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

    /// Steps an initialised instance from `start`, s. At every communication point, `at` receives the time and the instance to
    /// read from. It returns the inputs until the next communication point and the time of that point; `None` ends the run.
    ///
    /// # Errors
    /// Errors of `at`; a call that the FMU refuses, with the time.
    pub fn drive<'fmu>(
        &self,
        instance: &mut Instance<'fmu>,
        start: f64,
        mut at: impl FnMut(&mut Instance<'fmu>, f64, Course) -> Result<Option<f64>>,
    ) -> Result<()> {
        let (mut values, mut slopes) =
            (vec![0.0; self.references.len()], vec![0.0; self.references.len()]);
        let mut t = start;
        while let Some(next) = at(instance, t, Course { values: &mut values, slopes: &mut slopes })?
        {
            self.step(instance, t, next, &values, &slopes)
                .with_context(|| format!("the run stopped at t = {t} s"))?;
            t = next;
        }
        Ok(())
    }

    fn set(&self, instance: &mut Instance, values: &[f64]) -> Called {
        if values.is_empty() { Ok(()) } else { instance.set_real(&self.references, values) }
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
            true => instance.do_step_along(from, to - from, &self.references, values, slopes),
            false => instance.do_step(from, to - from),
        }
    }
}

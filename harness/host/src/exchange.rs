//! The host's solver for FMUs for Model Exchange: the pair of Dormand and Prince of order 5(4) (J. Comput.
//! Appl. Math. 6, 1980), with events located on its continuous extension (Hairer, Nørsett, Wanner, Solving
//! Ordinary Differential Equations I, II.6).
//!
//! A state event is a sign change of an event indicator (FMI 2.0.5, section 3.1.1); its time is located by bisection to
//! [`LOCATED`] of the step. Time events, and events that completedIntegratorStep requests, are handled when they occur.
//! If events accumulate, for example in chattering, each event still advances the time by [`APART`] of the distance to
//! the next row, so that the run ends.

use std::ops::DerefMut;

use anyhow::{Result, bail, ensure};

use crate::c_abi::Called;
use crate::fmu::Instance;

/// Accuracy with which the time of an event is located, as a fraction of the integrator's step.
const LOCATED: f64 = 1e-13;
/// Shortest time between two events, as a fraction of the time between two rows of the result, so
/// that the simulation of a chattering FMU comes to its end.
const APART: f64 = 1e-6;
pub const MOST_STEPS: usize = 100_000;

const C: [f64; 6] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0];
const A: [[f64; 5]; 6] = [
    [0.0; 5],
    [0.2, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
];
const B: [f64; 6] =
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
const E: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];
const D: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

pub struct Run<I> {
    instance: I,
    t: f64,
    x: Vec<f64>,
    z: Vec<f64>,
    /// Nominal values of the states. The absolute tolerance of each state is its nominal value
    /// times the relative tolerance.
    nominals: Vec<f64>,
    tolerance: f64,
    h: f64,
    next_event: Option<f64>,
    most_steps: usize,
    /// Value references, values and slopes of the inputs, and the time at which they had these
    /// values.
    inputs: (Vec<u32>, Vec<f64>, Vec<f64>, f64),
}

impl<'fmu, I: DerefMut<Target = Instance<'fmu>>> Run<I> {
    /// Starts a simulation at the time `start`, s, from an instance in event mode, which is the
    /// mode after initialisation. `tolerance` is relative. `most_steps` limits the number of steps
    /// between two rows of the result.
    pub fn new(mut instance: I, tolerance: f64, start: f64, most_steps: usize) -> Result<Self> {
        let (states, indicators) = instance.sizes()?;
        let mut run = Run {
            instance,
            t: start,
            x: vec![0.0; states],
            z: vec![0.0; indicators],
            nominals: vec![1.0; states],
            tolerance,
            h: f64::INFINITY,
            next_event: None,
            most_steps,
            inputs: (Vec::new(), Vec::new(), Vec::new(), start),
        };
        run.update()?;
        if states > 0 {
            run.instance.nominals(&mut run.nominals)?;
        }
        Ok(run)
    }

    pub fn instance(&mut self) -> &mut Instance<'fmu> {
        &mut self.instance
    }

    pub fn change(&mut self, set: impl FnOnce(&mut Instance<'fmu>) -> Called) -> Result<()> {
        self.instance.enter_event_mode()?;
        set(&mut self.instance)?;
        self.update()
    }

    /// Sets the values and slopes of Real inputs from the present time on. `jump` is true if one of
    /// the inputs is discontinuous at this time; the FMU then handles an event.
    pub fn drive(
        &mut self,
        references: &[u32],
        values: &[f64],
        slopes: &[f64],
        jump: bool,
    ) -> Result<()> {
        self.inputs = (references.to_vec(), values.to_vec(), slopes.to_vec(), self.t);
        if jump {
            self.instance.enter_event_mode()?;
        }
        self.set_inputs(self.t)?;
        if jump { self.update() } else { Ok(()) }
    }

    fn set_inputs(&mut self, t: f64) -> Result<()> {
        let (references, values, slopes, from) = &self.inputs;
        if references.is_empty() {
            return Ok(());
        }
        let at: Vec<f64> = values.iter().zip(slopes).map(|(u, du)| u + du * (t - from)).collect();
        Ok(self.instance.set_real(references, &at)?)
    }

    fn update(&mut self) -> Result<()> {
        for _ in 0..1000 {
            let updated = self.instance.update_discrete_states()?;
            ensure!(
                !updated.terminate,
                "the FMU has requested the end of the simulation at t = {} s",
                self.t
            );
            if !updated.again {
                self.next_event = updated.next_event;
                self.instance.enter_continuous_time_mode()?;
                if !self.x.is_empty() {
                    self.instance.continuous_states(&mut self.x)?;
                }
                self.z = self.indicators()?;
                return Ok(());
            }
        }
        bail!(
            "the event iteration at t = {} s does not end: the FMU requests a new iteration again and again",
            self.t
        )
    }

    fn indicators(&mut self) -> Result<Vec<f64>> {
        let mut z = vec![0.0; self.z.len()];
        if !z.is_empty() {
            self.instance.event_indicators(&mut z)?;
        }
        Ok(z)
    }

    fn go_to(&mut self, t: f64, x: &[f64]) -> Result<()> {
        self.instance.set_time(t)?;
        self.set_inputs(t)?;
        if !x.is_empty() {
            self.instance.set_continuous_states(x)?;
        }
        Ok(())
    }

    fn derivatives(&mut self, t: f64, x: &[f64]) -> Result<Vec<f64>> {
        self.go_to(t, x)?;
        let mut dx = vec![0.0; x.len()];
        if !dx.is_empty() {
            self.instance.derivatives(&mut dx)?;
        }
        Ok(dx)
    }

    /// Returns `true` if one of the event indicators has changed its sign between the present point
    /// and the time `t`, s, with the continuous states `x`.
    fn crosses(&mut self, t: f64, x: &[f64]) -> Result<bool> {
        if self.z.is_empty() {
            return Ok(false);
        }
        self.go_to(t, x)?;
        let z = self.indicators()?;
        Ok(self.z.iter().zip(&z).any(|(a, b)| (*a > 0.0) != (*b > 0.0)))
    }

    /// Integrates from the present time to the time `end`, s, and handles the events on the way.
    ///
    /// # Errors
    ///
    /// If the FMU refuses a call, or more steps are needed than are allowed.
    pub fn integrate(&mut self, end: f64) -> Result<()> {
        let apart = APART * (end - self.t);
        self.h = self.h.min(end - self.t);
        for _ in 0..self.most_steps {
            if self.t >= end {
                return Ok(());
            }
            let limit = self.next_event.filter(|next| *next > self.t).map_or(end, |e| e.min(end));
            let h = self.h.min(limit - self.t);
            let (t, x) = (self.t, self.x.clone());
            let mut k: Vec<Vec<f64>> = Vec::with_capacity(7);
            let combine = |k: &[Vec<f64>], weights: &[f64]| -> Vec<f64> {
                let sum = |i: usize| k.iter().zip(weights).map(|(k, w)| k[i] * w).sum::<f64>();
                (0..x.len()).map(|i| x[i] + h * sum(i)).collect()
            };
            for stage in 0..6 {
                let at = combine(&k, &A[stage]);
                k.push(self.derivatives(t + C[stage] * h, &at)?);
            }
            let new = combine(&k, &B);
            k.push(self.derivatives(t + h, &new)?);
            let error = (0..x.len())
                .map(|i| {
                    let e = h * k.iter().zip(&E).map(|(k, w)| k[i] * w).sum::<f64>();
                    let scale = x[i].abs().max(new[i].abs()).max(self.nominals[i]);
                    (e / (self.tolerance * scale)).powi(2)
                })
                .sum::<f64>();
            let error = (error / x.len().max(1) as f64).sqrt();
            if !error.is_finite() || error > 1.0 {
                let factor = if error.is_finite() { 0.9 * error.powf(-0.2) } else { 0.1 };
                self.h = h * factor.clamp(0.1, 0.9);
                ensure!(
                    t + self.h > t,
                    "the host's solver cannot integrate the states beyond t = {t} s: even the shortest step has too large an error"
                );
                continue;
            }
            let ends_row = limit - (t + h) <= 4.0 * f64::EPSILON * limit.abs();
            let (mut to, mut x_to) = (if ends_row { limit } else { t + h }, new.clone());
            let crossed = self.crosses(to, &x_to)?;
            if crossed {
                // the sign change is between these fractions of the step: the last one with the old sign, and the first
                // one with the new sign
                let (mut before, mut after) = (0.0, 1.0);
                while after - before > LOCATED {
                    let middle = 0.5 * (before + after);
                    let at = extended(&x, &new, &k, h, middle);
                    if self.crosses(t + middle * h, &at)? {
                        after = middle
                    } else {
                        before = middle
                    }
                }
                let after = (after * h).max(apart).min(to - t);
                (to, x_to) = (t + after, extended(&x, &new, &k, h, after / h));
            }
            self.go_to(to, &x_to)?;
            (self.t, self.x) = (to, x_to);
            let grown = h * (0.9 * error.max(1e-10).powf(-0.2)).clamp(0.2, 5.0);
            // If a step was shortened only to end at a given time, the length of the next step does not follow from it.
            self.h = match crossed || h < self.h {
                true => self.h.max(grown),
                false => grown,
            };
            let completed = self.instance.completed_integrator_step()?;
            ensure!(
                !completed.terminate,
                "the FMU has requested the end of the simulation at t = {to} s"
            );
            let due = self.next_event.is_some_and(|next| to >= next);
            if crossed || completed.enter_event_mode || due {
                self.instance.enter_event_mode()?;
                self.update()?;
            } else {
                self.z = self.indicators()?;
            }
        }
        bail!(
            "the host's solver needed more than {} steps between two rows, before t = {end} s: the model is probably stiff, so use the FMU's own solver (Co-Simulation)",
            self.most_steps
        )
    }
}

/// Evaluates the continuous extension of the Dormand–Prince method, so that an event can be located
/// within a step without further evaluations of the FMU. `x` and `new` are the states at the two
/// ends of the step, `k` the derivatives of the stages, `h` the length of the step in s, and `s`
/// the fraction of the step, 0 to 1.
fn extended(x: &[f64], new: &[f64], k: &[Vec<f64>], h: f64, s: f64) -> Vec<f64> {
    (0..x.len())
        .map(|i| {
            let difference = new[i] - x[i];
            let bspl = h * k[0][i] - difference;
            let last = difference - h * k[6][i] - bspl;
            let fifth = h * k.iter().zip(&D).map(|(k, d)| k[i] * d).sum::<f64>();
            let s1 = 1.0 - s;
            x[i] + s * (difference + s1 * (bspl + s * (last + s1 * fifth)))
        })
        .collect()
}

//! The integrator with which the check simulates an FMU for Model Exchange.
//!
//! It must cope with any FMU: stiff or not, with or without states, at steps of a microsecond or of an hour.
//! The method is the Rosenbrock pair of Shampine and Reichelt (The MATLAB ODE Suite, SIAM J. Sci. Comput. 18,
//! 1997, "ode23s"), which is of second order for any matrix J in place of the Jacobian:
//!
//! ```text
//! W = I - h d J,   d = 1/(2 + √2),   e = 6 + √2
//! k1 = W⁻¹ f(t, x)
//! k2 = k1 + W⁻¹ (f(t + h/2, x + h/2 k1) - k1)
//! x' = x + h k2
//! k3 = W⁻¹ (f(t + h, x') - e (k2 - f(t + h/2, x + h/2 k1)) - 2 (k1 - f(t, x)))
//! error = h/6 (k1 - 2 k2 + k3)
//! ```
//!
//! With J = 0 it is the explicit midpoint rule, which needs three evaluations for a step and is tried first. If the midpoint
//! rule needs many steps, the FMU is stiff; J is then computed by finite differences, and the method is L-stable. The work
//! is bounded by a number of steps and not by elapsed time, so that the same run always gives bit-identical results.

use anyhow::Result;
use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::under_test::{Session, Tested, Unusable};
use host::fmi2::{CallError, Status};

/// Relative tolerance of a step. It is loose, because the check needs a plausible trajectory and not an
/// accurate one.
const TOLERANCE: f64 = 1e-3;
/// Number of explicit steps in one communication step after which the FMU counts as stiff.
const EXPLICIT_STEPS: usize = 40;
/// Largest number of integrator steps in one communication step. After these steps the host continues from the state
/// that it has reached, because FMI does not prescribe an accuracy.
const MOST_STEPS: usize = 100;
/// Largest number of states for which a Jacobian is computed by finite differences.
const MOST_STATES: usize = 200;
/// Ratio of the communication step to the first step that the integrator tries.
const PARTS: f64 = 8.0;
/// Accuracy with which an event indicator's zero crossing is located, as a fraction of the communication
/// step.
const LOCATED: f64 = 1e-3;
/// Shortest step that the integrator tries, as a fraction of the communication step.
const SHORTEST: f64 = 1e-12;

enum Trial {
    /// The step has succeeded: the new states, and the estimated error divided by the allowed error.
    Done(DVector<f64>, f64),
    /// The FMU could not be evaluated at a stage (fmi2Discard, or values that are NaN or infinite).
    Impossible(Impossible),
}

/// Reason why the integrator cannot make a step of the length that it tried.
#[derive(Debug, thiserror::Error)]
enum Impossible {
    #[error("the integrator's linearised system of equations is singular")]
    Singular,
    #[error("state {} becomes {value}", index + 1)]
    State { index: usize, value: f64 },
    #[error("derivative {} is {value}", index + 1)]
    Derivative { index: usize, value: f64 },
    #[error("{0}")]
    Discarded(CallError),
    #[error("the error of the step is {0:.1e} times the allowed error")]
    Inexact(f64),
}

impl<V: Tested> Session<'_, V> {
    /// Integrates to `end`, or as far as the allowed number of steps reaches, and handles events on the way.
    ///
    /// # Errors
    ///
    /// If the FMU refuses a call, or no step is short enough.
    pub(super) fn integrate(&mut self, end: f64) -> Result<()> {
        let start = self.time;
        let magnitudes = V::magnitudes(self)?;
        let n = magnitudes.len();
        let whole = end - start;
        let mut h = whole / PARTS;
        let mut jacobian: Option<DMatrix<f64>> = None;
        let mut z = self.indicators()?;
        for step in 0..MOST_STEPS {
            if self.time >= end || self.is_ended() {
                break;
            }
            if step == EXPLICIT_STEPS && n <= MOST_STATES {
                // The integration begins again, with a Jacobian and with a new initial step.
                h = (end - self.time) / PARTS;
            }
            let (t, x) = (self.time, DVector::from_vec(self.states()?));
            if step >= EXPLICIT_STEPS && n <= MOST_STATES {
                jacobian = Some(self.jacobian(t, &x, &magnitudes)?);
            }
            // If no step is possible, the reason for the failure of the shortest step, which is tried last, is reported.
            let mut why = None;
            loop {
                // A step ends neither after `end` nor after a time event that the FMU has announced.
                let limit = self.next_event.filter(|next| *next > t).unwrap_or(end).min(end);
                let last = t + h * 1.01 >= limit;
                let to = if last { limit } else { t + h };
                let shortest = (SHORTEST * whole).max(4.0 * f64::EPSILON * t.abs());
                if to - t < shortest && !last {
                    return Err(self.diverges(t, &x, why));
                }
                let (x_new, error) =
                    match self.trial(t, &x, to - t, jacobian.as_ref(), &magnitudes)? {
                        Trial::Impossible(reason) => {
                            why = Some(reason);
                            self.go_to(t, &x)?;
                            h = (to - t) / 4.0;
                            continue;
                        }
                        Trial::Done(x_new, error) => (x_new, error),
                    };
                let factor = (0.8 * error.powf(-1.0 / 3.0)).clamp(0.2, 5.0);
                if error > 1.0 {
                    why = Some(Impossible::Inexact(error));
                    self.go_to(t, &x)?;
                    h = (to - t) * factor;
                    continue;
                }
                self.go_to(to, &x_new)?;
                let z_new = self.indicators()?;
                let crossed = z.iter().zip(&z_new).any(|(a, b)| (*a > 0.0) != (*b > 0.0));
                if crossed && to - t > LOCATED * whole {
                    self.go_to(t, &x)?;
                    h = (to - t) / 2.0;
                    continue;
                }
                self.time = to;
                // If a step was shortened only to end at a given time, the length of the next step does not follow from it.
                h = if last { h.max((to - t) * factor) } else { (to - t) * factor };
                V::complete_step(self, crossed)?;
                z = if crossed { self.indicators()? } else { z_new };
                break;
            }
        }
        Ok(())
    }

    /// Tries one step of the Rosenbrock method of length `h` from (t, x). Without `jacobian` this is the
    /// explicit midpoint rule.
    fn trial(
        &mut self,
        t: f64,
        x: &DVector<f64>,
        h: f64,
        jacobian: Option<&DMatrix<f64>>,
        magnitudes: &[f64],
    ) -> Result<Trial> {
        let d = 1.0 / (2.0 + 2f64.sqrt());
        let e = 6.0 + 2f64.sqrt();
        let n = x.len();
        let w: Option<LU<f64, Dyn, Dyn>> =
            jacobian.map(|jacobian| (DMatrix::identity(n, n) - jacobian * (h * d)).lu());
        let solve = |b: DVector<f64>| match &w {
            None => Some(b),
            Some(w) => w.solve(&b),
        };
        let singular = || Trial::Impossible(Impossible::Singular);
        let f0 = match self.derivatives_at(t, x)? {
            Ok(f) => f,
            Err(why) => return Ok(Trial::Impossible(why)),
        };
        let Some(k1) = solve(f0.clone()) else { return Ok(singular()) };
        let f1 = match self.derivatives_at(t + 0.5 * h, &(x + &k1 * (0.5 * h)))? {
            Ok(f) => f,
            Err(why) => return Ok(Trial::Impossible(why)),
        };
        let Some(k2) = solve(&f1 - &k1).map(|dk| dk + &k1) else { return Ok(singular()) };
        let x_new = x + &k2 * h;
        let f2 = match self.derivatives_at(t + h, &x_new)? {
            Ok(f) => f,
            Err(why) => return Ok(Trial::Impossible(why)),
        };
        let rest = f2 - (&k2 - &f1) * e - (&k1 - &f0) * 2.0;
        let Some(k3) = solve(rest) else { return Ok(singular()) };
        let error = (k1 - k2 * 2.0 + k3) * (h / 6.0);
        let mut worst: f64 = 0.0;
        for i in 0..n {
            let scale = x[i].abs().max(x_new[i].abs()).max(magnitudes[i]);
            worst = worst.max(error[i].abs() / (TOLERANCE * scale));
        }
        Ok(Trial::Done(x_new, worst))
    }

    /// Evaluates the derivatives at (t, x). The inner error is the reason, for example fmi2Discard, why the FMU
    /// cannot be evaluated there.
    fn derivatives_at(
        &mut self,
        t: f64,
        x: &DVector<f64>,
    ) -> Result<Result<DVector<f64>, Impossible>> {
        if let Some(index) = x.iter().position(|x| !x.is_finite()) {
            return Ok(Err(Impossible::State { index, value: x[index] }));
        }
        let mut f = DVector::zeros(x.len());
        let asked = self.try_go_to(t, x).and_then(|()| match x.len() {
            0 => Ok(()),
            _ => self.instance.derivatives(f.as_mut_slice()),
        });
        match asked {
            Ok(()) => {}
            // fmi2Discard means that the host should try a shorter step (section 2.1.3).
            Err(error) if error.status == Status::Discard => {
                return Ok(Err(Impossible::Discarded(error)));
            }
            Err(error) => return Err(error.into()),
        }
        Ok(match f.iter().position(|f| !f.is_finite()) {
            Some(index) => Err(Impossible::Derivative { index, value: f[index] }),
            None => Ok(f),
        })
    }

    /// Computes the Jacobian by forward differences. A column that cannot be evaluated is set to 0, which
    /// only makes the method converge more slowly.
    fn jacobian(&mut self, t: f64, x: &DVector<f64>, magnitudes: &[f64]) -> Result<DMatrix<f64>> {
        let n = x.len();
        let mut jacobian = DMatrix::zeros(n, n);
        if let Ok(f) = self.derivatives_at(t, x)? {
            for j in 0..n {
                let mut moved = x.clone();
                let dx = f64::EPSILON.sqrt() * x[j].abs().max(magnitudes[j]);
                moved[j] += dx;
                if let Ok(there) = self.derivatives_at(t, &moved)? {
                    jacobian.set_column(j, &((there - &f) / (moved[j] - x[j])));
                }
            }
        }
        self.go_to(t, x)?;
        Ok(jacobian)
    }

    fn try_go_to(&mut self, t: f64, x: &DVector<f64>) -> Result<(), CallError> {
        self.instance.set_time(t)?;
        match x.len() {
            0 => Ok(()),
            _ => self.instance.set_continuous_states(x.as_slice()),
        }
    }

    fn go_to(&mut self, t: f64, x: &DVector<f64>) -> Result<()> {
        Ok(self.try_go_to(t, x)?)
    }

    fn diverges(&self, t: f64, x: &DVector<f64>, why: Option<Impossible>) -> anyhow::Error {
        let why = why.map(|why| why.to_string()).unwrap_or_default();
        let largest = x.iter().copied().fold(0.0f64, |a, b| a.max(b.abs()));
        let why = format!(
            "the states cannot be followed past t = {t:?} s however short the step: {why} (largest \
             state {largest:.1e})"
        );
        Unusable { rule: V::EXCHANGE_RUNS, why }.into()
    }
}

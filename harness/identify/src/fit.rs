//! Output-error fit in the time domain, with the friction inside the equations.
//!
//! ```text
//! minimise Σ e_k² + Σ ((x_i − μ_i)/s_i)²,   e = whitened( y_k − s ω(t_k − δ; p) − b )
//! ```
//!
//! ω is the FMU's answer (see [`crate::simulate`]), s, b and δ the gyro's scale and bias and the delay,
//! the second sum what is known of some parameters beforehand, the whitening filter that of
//! [`crate::noise`]. Levenberg and Marquardt's method as MINPACK has it.
//!
//! Sensitivities to s, b and δ are exact: −ω, −1 and s ω'. Those to the FMU's parameters are
//! differences. The step moves the whole answer by about [`MOVE`] standard deviations of its noise:
//! small against curvature and large against the integrator's tolerance.

use anyhow::{Context, Result};
use host::fmi2::Fmu;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, storage::Owned};
use rayon::prelude::*;

use crate::noise::{Noise, Whitening};
use crate::recording::{self, Recording};
use crate::simulate::{Motion, Setup};
use crate::uncertainty::Covariance;
use crate::unknown::{Quantity, Unknown};

/// By how much a difference moves the answer, in units of the noise's norm of one degree of freedom.
const MOVE: f64 = 1.0;
/// Drift of a MEMS gyro (the thesis's LSM6DS3), until the recording's own is known. Without it the slow
/// decay at a recording's start, where the drift is all the noise, would draw the friction after it.
const TYPICAL: Noise = Noise { white: 1.0, drift: 0.2, time: 100.0 };
/// Bounds of the differences' steps, in units of the variable x.
const STEPS: (f64, f64) = (1e-6, 2e-4);

/// Recordings, a set-up of the FMU, and the unknowns.
#[derive(Clone)]
pub struct Problem<'a> {
    /// The FMU.
    pub fmu: &'a Fmu,
    /// How it is set up.
    pub setup: Setup,
    /// The recordings, fitted together.
    pub recordings: &'a [Recording],
    /// What is estimated.
    pub unknowns: Vec<Unknown>,
    /// The gyro's noise in each recording.
    pub noise: Vec<Noise>,
}

/// What an answer looks like for given unknowns.
pub struct Answer {
    /// The FMU's motion, for each recording.
    pub motion: Vec<Motion>,
    /// Measured less modelled rate, rad/s, for each recording.
    pub residual: Vec<Vec<f64>>,
}

/// Estimated unknowns.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Variables x of the unknowns.
    pub x: Vec<f64>,
    /// Whether the search ended at a minimum.
    pub converged: bool,
    /// Why it ended.
    pub reason: String,
    /// Answers of the FMU that were needed, all recordings together being one.
    pub simulations: usize,
}

/// A minimum with its sensitivities.
pub struct Polished {
    /// Variables x of the unknowns.
    pub x: Vec<f64>,
    /// Sensitivities there.
    pub jacobian: DMatrix<f64>,
    /// Covariance there.
    pub covariance: Covariance,
    /// The FMU's answer there.
    pub answer: Answer,
    /// The next step, in standard deviations of the unknown that it moves most.
    pub remaining: f64,
    /// Answers of the FMU that were needed.
    pub simulations: usize,
}

/// How sensitivities are differenced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Differences {
    /// (f(x + h) − f(x))/h.
    Forward,
    /// (f(x + h) − f(x − h))/2h.
    Central,
}

impl<'a> Problem<'a> {
    /// Fits unknowns with noise of the level that the recordings show and [`TYPICAL`] drift.
    pub fn new(
        fmu: &'a Fmu,
        setup: Setup,
        recordings: &'a [Recording],
        unknowns: Vec<Unknown>,
    ) -> Self {
        let level = |r| Noise { white: recording::noise_level(r).max(1e-9), ..TYPICAL };
        let noise = recordings.iter().map(level).collect();
        Problem { fmu, setup, recordings, unknowns, noise }
    }

    /// Values of the unknowns for variables x.
    pub fn values(&self, x: &[f64]) -> Vec<f64> {
        self.unknowns.iter().zip(x).map(|(unknown, &x)| unknown.scale.value(x)).collect()
    }

    /// Variables of the starts.
    pub fn start(&self) -> Vec<f64> {
        self.unknowns.iter().map(|unknown| unknown.scale.variable(unknown.start)).collect()
    }

    /// Value of an unknown, or what it is if it is not unknown.
    fn value_of(&self, x: &[f64], quantity: &Quantity, otherwise: f64) -> f64 {
        let place = self.unknowns.iter().position(|unknown| unknown.quantity == *quantity);
        place.map_or(otherwise, |i| self.unknowns[i].scale.value(x[i]))
    }

    fn motion(&self, x: &[f64], recording: usize) -> Result<Motion> {
        let values: Vec<(&str, f64)> = self
            .unknowns
            .iter()
            .zip(x)
            .filter_map(|(unknown, &x)| match &unknown.quantity {
                Quantity::Parameter(name) => Some((name.as_str(), unknown.scale.value(x))),
                Quantity::Initial(of, name) if *of == recording => {
                    Some((name.as_str(), unknown.scale.value(x)))
                }
                _ => None,
            })
            .collect();
        let delay = self.value_of(x, &Quantity::Delay, 0.0);
        self.setup.run(self.fmu, &values, &self.recordings[recording], delay)
    }

    /// The FMU's answer and what it leaves of the recordings.
    pub fn answer(&self, x: &[f64]) -> Result<Answer> {
        let numbers: Vec<usize> = (0..self.recordings.len()).collect();
        let motion: Vec<Motion> =
            numbers.par_iter().map(|&i| self.motion(x, i)).collect::<Result<_>>()?;
        let scale = self.value_of(x, &Quantity::GyroScale, 1.0);
        let residual = numbers
            .iter()
            .map(|&i| {
                let bias = self.value_of(x, &Quantity::GyroBias(i), 0.0);
                let model = motion[i].rate.iter();
                self.recordings[i]
                    .rate
                    .iter()
                    .zip(model)
                    .map(|(y, w)| y - scale * w - bias)
                    .collect()
            })
            .collect();
        Ok(Answer { motion, residual })
    }

    fn filters(&self) -> Vec<Whitening> {
        let pairs = self.recordings.iter().zip(&self.noise);
        pairs.map(|(recording, noise)| noise.whitening(&recording.time)).collect()
    }

    /// Innovations over their standard deviation, one vector a recording.
    pub fn innovations(&self, answer: &Answer) -> Vec<Vec<f64>> {
        let whitened = |(residual, filter): (&Vec<f64>, &Whitening)| {
            let mut e = residual.clone();
            filter.apply(&mut e);
            e
        };
        answer.residual.iter().zip(&self.filters()).map(whitened).collect()
    }

    /// −2 ln L of the recordings but for a constant.
    pub fn deviance(&self, answer: &Answer) -> f64 {
        let squares: f64 = self.innovations(answer).iter().flatten().map(|e| e * e).sum();
        squares + self.filters().iter().map(Whitening::log_variance).sum::<f64>()
    }

    /// Estimates each recording's noise from what an answer leaves.
    pub fn estimate_noise(&mut self, answer: &Answer) {
        let pairs: Vec<_> = self.recordings.iter().zip(&answer.residual).collect();
        self.noise = pairs.par_iter().map(|(r, residual)| Noise::of(&r.time, residual)).collect();
    }

    /// Innovations of all recordings, and how far the unknowns are from what is known of them.
    pub fn stacked(&self, innovations: Vec<Vec<f64>>, x: &[f64]) -> DVector<f64> {
        let mut all = innovations.concat();
        for (unknown, &x) in self.unknowns.iter().zip(x) {
            if let Some((mean, deviation)) = unknown.prior {
                let middle = unknown.scale.variable(mean);
                all.push((x - middle) / (deviation / unknown.scale.slope(middle)));
            }
        }
        DVector::from_vec(all)
    }

    /// The sum of squares that a fit minimises.
    pub fn cost(&self, x: &[f64]) -> Result<f64> {
        let answer = self.answer(x)?;
        Ok(self.stacked(self.innovations(&answer), x).norm_squared())
    }

    /// Derivatives of the stacked innovations and priors with respect to x.
    pub fn jacobian(
        &self,
        x: &[f64],
        answer: &Answer,
        steps: &[f64],
        how: Differences,
    ) -> Result<DMatrix<f64>> {
        let filters = self.filters();
        let scale = self.value_of(x, &Quantity::GyroScale, 1.0);
        let rows: usize = self.recordings.iter().map(|r| r.time.len()).sum();
        let priors = self.unknowns.iter().filter(|unknown| unknown.prior.is_some()).count();
        let recordings = 0..self.recordings.len();
        let tasks: Vec<(usize, usize)> =
            (0..x.len()).flat_map(|j| recordings.clone().map(move |i| (j, i))).collect();
        let pieces: Vec<Vec<f64>> = tasks
            .par_iter()
            .map(|&(j, i)| -> Result<Vec<f64>> {
                let unknown = &self.unknowns[j];
                let slope = unknown.scale.slope(x[j]);
                let motion = &answer.motion[i];
                let count = motion.rate.len();
                let mut piece: Vec<f64> = match &unknown.quantity {
                    Quantity::GyroScale => motion.rate.iter().map(|w| -w * slope).collect(),
                    Quantity::GyroBias(of) => vec![if *of == i { -slope } else { 0.0 }; count],
                    Quantity::Delay => {
                        motion.acceleration.iter().map(|a| scale * a * slope).collect()
                    }
                    Quantity::Initial(of, _) if *of != i => vec![0.0; count],
                    Quantity::Parameter(_) | Quantity::Initial(..) => {
                        let moved = |by: f64| {
                            let mut moved = x.to_vec();
                            moved[j] += by;
                            self.motion(&moved, i)
                        };
                        let h = steps[j];
                        let ahead = moved(h)?;
                        let (behind, width) = match how {
                            Differences::Forward => (motion.rate.clone(), h),
                            Differences::Central => (moved(-h)?.rate, 2.0 * h),
                        };
                        let pairs = ahead.rate.iter().zip(&behind);
                        pairs.map(|(a, b)| -scale * (a - b) / width).collect()
                    }
                };
                filters[i].apply(&mut piece);
                Ok(piece)
            })
            .collect::<Result<_>>()?;
        let mut jacobian = DMatrix::zeros(rows + priors, x.len());
        for ((j, i), piece) in tasks.into_iter().zip(pieces) {
            let from: usize = self.recordings[..i].iter().map(|r| r.time.len()).sum();
            jacobian.view_mut((from, j), (piece.len(), 1)).copy_from_slice(&piece);
        }
        let mut row = rows;
        for (j, unknown) in self.unknowns.iter().enumerate() {
            if let Some((mean, deviation)) = unknown.prior {
                jacobian[(row, j)] = unknown.scale.slope(unknown.scale.variable(mean)) / deviation;
                row += 1;
            }
        }
        Ok(jacobian)
    }

    /// Steps of the differences that move the answer by [`MOVE`] at these sensitivities.
    pub fn steps(jacobian: &DMatrix<f64>) -> Vec<f64> {
        let step =
            |norm: f64| if norm > 0.0 { (MOVE / norm).clamp(STEPS.0, STEPS.1) } else { STEPS.1 };
        jacobian.column_iter().map(|column| step(column.norm())).collect()
    }

    /// Searches the minimum from x.
    pub fn fit(&self, x: &[f64]) -> Result<Estimate> {
        self.search(x, 1e-6)
    }

    /// Gauss and Newton's steps from near a minimum, until one is shorter than a fiftieth of a
    /// standard deviation or `rounds` are made; a step that makes it worse is not taken.
    pub fn gauss_newton(&self, x: &[f64], how: Differences, rounds: usize) -> Result<Polished> {
        let mut x = x.to_vec();
        let mut answer = self.answer(&x)?;
        let rough = self.jacobian(&x, &answer, &vec![1e-5; x.len()], Differences::Forward)?;
        let steps = Problem::steps(&rough);
        let mut simulations = 1 + x.len();
        for round in 1.. {
            let jacobian = self.jacobian(&x, &answer, &steps, how)?;
            simulations += x.len() * if how == Differences::Central { 2 } else { 1 };
            let names = || -> Vec<String> {
                self.unknowns.iter().map(|unknown| unknown.quantity.name()).collect()
            };
            let covariance = Covariance::of(&jacobian).with_context(|| {
                format!(
                    "some combination of the unknowns ({}) has no influence on the recording: fewer must be \
                     estimated",
                    names().join(", ")
                )
            })?;
            let e = self.stacked(self.innovations(&answer), &x);
            let step = -(&covariance.x * jacobian.tr_mul(&e));
            let size = |i: usize| step[i].abs() / covariance.x[(i, i)].sqrt();
            let remaining = (0..x.len()).map(size).fold(0.0, f64::max);
            let moved: Vec<f64> = x.iter().zip(step.iter()).map(|(x, step)| x + step).collect();
            let taken =
                (remaining > 0.02 && round < rounds).then(|| self.answer(&moved).ok()).flatten();
            simulations += 1;
            let better = taken.filter(|there| {
                let there = self.stacked(self.innovations(there), &moved);
                there.norm_squared() < e.norm_squared()
            });
            let Some(there) = better else {
                return Ok(Polished { x, jacobian, covariance, answer, remaining, simulations });
            };
            (x, answer) = (moved, there);
        }
        unreachable!("the rounds end")
    }

    fn search(&self, x: &[f64], tolerance: f64) -> Result<Estimate> {
        self.answer(x).context("the FMU refuses the start of the search")?;
        let search = Search::new(self, x);
        let (search, report) = LevenbergMarquardt::new()
            .with_ftol(tolerance)
            .with_xtol(1e-8)
            .with_gtol(0.0)
            .with_patience(30)
            .minimize(search);
        Ok(Estimate {
            x: search.x.clone(),
            converged: report.termination.was_successful(),
            reason: format!("{:?}", report.termination),
            simulations: search.simulations.get(),
        })
    }

    /// The same over windows of the recordings that grow, each from the estimate of the one before.
    ///
    /// A start whose slosh frequency is 20 % off is out of phase after a few cycles; over a whole
    /// recording its error has as many minima as there are cycles. Over the beginning it has one,
    /// and as the window grows the estimate stays within its reach. In a window each parameter is
    /// also held near its start ([`LOOSE`]), for a short window does not say everything, and what the
    /// model cannot follow yet counts as noise of ten times the gyro's.
    pub fn fit_growing(
        &self,
        x: &[f64],
        windows: &[f64],
        heard: &mut dyn FnMut(String),
    ) -> Result<Estimate> {
        let (mut x, mut simulations) = (x.to_vec(), 0);
        let first = x.clone();
        for &fraction in windows {
            let part: Vec<Recording> =
                self.recordings.iter().map(|r| r.beginning(fraction)).collect();
            let mut problem = Problem { recordings: &part, ..self.clone() };
            for (unknown, &x) in problem.unknowns.iter_mut().zip(&first) {
                if unknown.prior.is_none() && unknown.quantity.parameter().is_some() {
                    let loose = LOOSE * unknown.scale.slope(x).abs();
                    unknown.prior = Some((unknown.scale.value(x), loose));
                }
            }
            for noise in &mut problem.noise {
                noise.white *= 10.0;
            }
            let estimate = problem.search(&x, 1e-3)?;
            heard(format!("window of {:.0} %: {}", 100.0 * fraction, estimate.reason));
            simulations += estimate.simulations;
            x = estimate.x;
        }
        let mut last = self.fit(&x)?;
        last.simulations += simulations;
        Ok(last)
    }
}

/// Windows for starts that are far off, as fractions of the recordings.
pub const WINDOWS: [f64; 7] = [0.1, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0];
/// Windows for starts from the frequency response.
pub const WHOLE: [f64; 1] = [1.0];
/// How far a logarithm may be from its start in a window.
const LOOSE: f64 = 0.5;

/// The problem as the crate wants it.
struct Search<'p, 'a> {
    problem: &'p Problem<'a>,
    x: Vec<f64>,
    answer: Option<Answer>,
    steps: std::cell::RefCell<Vec<f64>>,
    simulations: std::cell::Cell<usize>,
}

impl<'p, 'a> Search<'p, 'a> {
    fn new(problem: &'p Problem<'a>, x: &[f64]) -> Self {
        Search {
            problem,
            x: x.to_vec(),
            answer: problem.answer(x).ok(),
            steps: vec![1e-5; x.len()].into(),
            simulations: 1.into(),
        }
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Search<'_, '_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x = x.as_slice().to_vec();
        self.answer = self.problem.answer(&self.x).ok();
        self.simulations.set(self.simulations.get() + 1);
    }

    fn params(&self) -> DVector<f64> {
        DVector::from_column_slice(&self.x)
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let Some(answer) = &self.answer else {
            // a parameter the FMU refuses: worse than anything, so that the step is taken back
            let rows: usize = self.problem.recordings.iter().map(|r| r.time.len()).sum();
            let far = vec![vec![1e6; rows]];
            return Some(self.problem.stacked(far, &self.x));
        };
        Some(self.problem.stacked(self.problem.innovations(answer), &self.x))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let steps = self.steps.borrow().clone();
        let answer = self.answer.as_ref()?;
        let jacobian = self.problem.jacobian(&self.x, answer, &steps, Differences::Forward).ok()?;
        self.simulations.set(self.simulations.get() + self.x.len());
        *self.steps.borrow_mut() = Problem::steps(&jacobian);
        Some(jacobian)
    }
}

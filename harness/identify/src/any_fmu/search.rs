//! The minimum of a [`Problem`] within bounds.
//!
//! Levenberg and Marquardt's method by projection (Kelley, Iterative Methods for Optimization, 5.5): a step is cut at the bounds;
//! an unknown at a bound whose cost falls beyond it is left out of the next step. So an estimate at a bound is one at which the
//! recordings want to go further, and no transformation flattens the cost on the way there.
//!
//! From afar the search goes over windows of the recordings that grow: over a whole recording of an oscillation the cost has as many
//! minima as there are cycles, over its beginning one.

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::problem::{Answer, Problem, Step};
use super::record::Record;
use super::unknown::Unknown;
use crate::decomposition;
use crate::news::News;
use analysis::random::Random;

/// A search has ended where the distance to the minimum, in standard deviations, is below this.
pub const DECREMENT: f64 = 0.02;
/// Directions along which the scaled cost is flatter than this part of the steepest are not known.
const FLAT: f64 = 1e-12;
/// Directions along which the scaled cost is not steeper than this many times what the errors of the derivatives make are not
/// resolved: they would be steep by chance.
const RESOLVED: f64 = 4.0;
/// Windows of a search from afar, as parts of the recordings.
const WINDOWS: [f64; 5] = [0.1, 0.2, 0.4, 0.7, 1.0];
/// Least noise of a window, in parts of an output's spread: what the model can't follow yet.
const COARSE: f64 = 0.03;
/// Residual over the noise from row to row beyond which a fit counts as bad, and another start is tried.
const BAD: f64 = 1.5;

/// End of a search.
#[derive(Clone)]
pub struct Minimum {
    /// The unknowns.
    pub x: Vec<f64>,
    /// The answer there.
    pub answer: Answer,
    /// Derivatives there.
    pub jacobian: DMatrix<f64>,
    /// Steps of the differences.
    pub steps: Vec<Step>,
    /// Distance to the minimum in standard deviations.
    pub decrement: f64,
}

impl Minimum {
    /// Sum of squares.
    pub fn cost(&self) -> f64 {
        self.answer.e.norm_squared()
    }

    /// Whether it is one: within half a standard deviation, which the stated ones contain.
    pub fn converged(&self) -> bool {
        self.decrement < 0.5
    }

    /// The unknowns that are not held at a bound.
    pub fn inner(&self, unknowns: &[Unknown]) -> Vec<usize> {
        inner(unknowns, &self.x, &(self.jacobian.tr_mul(&self.answer.e)))
    }
}

/// Those that are not at a bound beyond which the cost falls.
fn inner(unknowns: &[Unknown], x: &[f64], gradient: &DVector<f64>) -> Vec<usize> {
    let is_inner = |j: &usize| {
        let (low, high) = unknowns[*j].bounds;
        !(x[*j] <= low && gradient[*j] > 0.0 || x[*j] >= high && gradient[*j] < 0.0)
    };
    (0..x.len()).filter(is_inner).collect()
}

/// A symmetric matrix in its own scales, D A D with a unit diagonal, by eigenvectors. It may have no rows.
pub struct Curvature {
    values: DVector<f64>,
    vectors: DMatrix<f64>,
    scale: DVector<f64>,
}

impl Curvature {
    /// Of JᵀJ over the columns `which` of J; `names`: of all columns.
    ///
    /// # Errors
    /// If a derivative is not finite.
    pub fn of(jacobian: &DMatrix<f64>, names: &[String], which: &[usize]) -> Result<Self> {
        let picked = jacobian.select_columns(which);
        let picked_names: Vec<String> =
            which.iter().filter_map(|&j| names.get(j).cloned()).collect();
        decomposition::lengths(&picked, &picked_names)?;
        let a = picked.tr_mul(&picked);
        let scale = a.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 });
        if which.is_empty() {
            return Ok(Curvature { values: DVector::zeros(0), vectors: a, scale });
        }
        let scaled = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * scale[i] * scale[j]);
        let SymmetricEigen { eigenvalues, eigenvectors } = decomposition::symmetric(scaled)?;
        Ok(Curvature { values: eigenvalues, vectors: eigenvectors, scale })
    }

    /// The eigenvalue below which a direction is flat.
    fn flat(&self) -> f64 {
        FLAT * self.values.iter().copied().fold(0.0, f64::max)
    }

    /// A⁻¹ b, damped by λ in the matrix's own scales; nothing along directions that are flat.
    pub fn solve(&self, b: &DVector<f64>, damping: f64) -> DVector<f64> {
        let flat = self.flat();
        let mut c = self.vectors.tr_mul(&b.component_mul(&self.scale));
        for (c, value) in c.iter_mut().zip(&self.values) {
            *c = if *value > flat { *c / (value + damping) } else { 0.0 };
        }
        (&self.vectors * c).component_mul(&self.scale)
    }

    /// Directions that the matrix does not resolve. `errors` are the relative errors of the Jacobian's columns, all of them
    /// independent: along a unit eigenvector v they alone make an eigenvalue of Σ v_i² errors_i². Each direction is a unit vector
    /// in the matrix's own scales.
    pub fn unresolved(&self, errors: &[f64]) -> Vec<DVector<f64>> {
        let flat = self.flat();
        let is_flat = |value: f64, v: &DVector<f64>| {
            let made: f64 = v.iter().zip(errors).map(|(v, error)| (v * error).powi(2)).sum();
            value <= flat.max(RESOLVED * made)
        };
        let all = self.values.iter().zip(self.vectors.column_iter());
        let all = all.map(|(value, v)| (*value, v.into_owned()));
        all.filter(|(value, v)| is_flat(*value, v)).map(|(_, v)| v).collect()
    }

    /// A direction in the unknowns' own units.
    pub fn unscaled(&self, direction: &DVector<f64>) -> DVector<f64> {
        direction.component_mul(&self.scale)
    }

    /// A⁻¹ over the directions that are not flat.
    pub fn inverse(&self) -> DMatrix<f64> {
        let flat = self.flat();
        let n = self.scale.len();
        let mut inverse = DMatrix::zeros(n, n);
        for (value, v) in self.values.iter().zip(self.vectors.column_iter()) {
            if *value > flat {
                let v = v.component_mul(&self.scale);
                inverse += &v * v.transpose() / *value;
            }
        }
        inverse
    }
}

/// Searches from x until the decrement is below `tolerance`.
///
/// # Errors
/// If the FMU refuses the start, or every step of an unknown.
pub fn search(
    problem: &Problem,
    x: &[f64],
    steps: Vec<Step>,
    tolerance: f64,
    most: usize,
    news: &mut dyn FnMut(&News),
) -> Result<Minimum> {
    let answer = problem.answer(x).context("the FMU refuses the start of the search")?;
    let bounds: Vec<(f64, f64)> = problem.unknowns.iter().map(|u| u.bounds).collect();
    let (mut x, mut answer, mut steps, mut damping) = (x.to_vec(), answer, steps, 1e-3);
    for iteration in 0.. {
        let jacobian = problem.jacobian(&x, &answer.motion, &mut steps)?;
        let gradient = jacobian.tr_mul(&answer.e);
        let which = inner(&problem.unknowns, &x, &gradient);
        let curvature = Curvature::of(&jacobian, &problem.names(), &which)?;
        let picked =
            |g: &DVector<f64>| DVector::from_iterator(which.len(), which.iter().map(|&j| g[j]));
        let g = picked(&gradient);
        let decrement = g.dot(&curvature.solve(&g, 0.0)).max(0.0).sqrt();
        let cost = answer.e.norm_squared();
        news(&News::Detail(format!(
            "iteration {}: sum of squares {cost:.6e}, {decrement:.3} standard deviations from the minimum",
            iteration + 1
        )));
        let here = |x: Vec<f64>, answer: Answer, steps: Vec<Step>| Minimum {
            x,
            answer,
            jacobian: jacobian.clone(),
            steps,
            decrement,
        };
        if decrement < tolerance || iteration + 1 >= most {
            return Ok(here(x, answer, steps));
        }
        let to = |x: &[f64], g: &DVector<f64>, damping: f64| {
            let step = curvature.solve(g, damping);
            let mut moved = x.to_vec();
            for (k, &j) in which.iter().enumerate() {
                moved[j] = (x[j] - step[k]).clamp(bounds[j].0, bounds[j].1);
            }
            moved
        };
        let mut moved = false;
        for _ in 0..12 {
            let trial = to(&x, &g, damping);
            if let Ok(there) = problem.answer(&trial)
                && there.e.norm_squared() < cost
            {
                (x, answer, moved) = (trial, there, true);
                damping = (damping * 0.1).max(1e-9);
                break;
            }
            damping = (damping * 5.0).max(1e-6);
        }
        if !moved {
            // no shorter step helps: differences end here
            return Ok(here(x, answer, steps));
        }
        // with the same derivatives as long as they serve
        for _ in 0..3 {
            let gradient = picked(&jacobian.tr_mul(&answer.e));
            let left = gradient.dot(&curvature.solve(&gradient, 0.0)).max(0.0).sqrt();
            if left > 0.5 * decrement || left < 0.3 * tolerance {
                break;
            }
            let trial = to(&x, &gradient, damping);
            match problem.answer(&trial) {
                Ok(there) if there.e.norm_squared() < answer.e.norm_squared() => {
                    (x, answer) = (trial, there);
                }
                _ => break,
            }
        }
    }
    unreachable!("the loop ends by itself")
}

/// From a start that may be far off: over windows that grow, each unknown held by a spring of its reach.
fn from_afar(problem: &Problem, x: &[f64], news: &mut dyn FnMut(&News)) -> Result<Vec<f64>> {
    let mut x = x.to_vec();
    for part in WINDOWS {
        let cut: Vec<Record> = problem.records.iter().map(|r| r.beginning(part)).collect();
        let fewest = cut.iter().map(|record| record.time.len()).min().unwrap_or(0);
        if part < 1.0 && fewest < 2 * problem.unknowns.len() {
            continue;
        }
        let mut unknowns = problem.unknowns.clone();
        for (unknown, x) in unknowns.iter_mut().zip(&x) {
            let (mean, std) = unknown.prior.unwrap_or((*x, f64::INFINITY));
            unknown.prior = Some((mean, std.min(2.0 * unknown.reach)));
        }
        let mut window = Problem::new(problem.model, problem.setup, &cut, unknowns, COARSE);
        // sizes of the noise are those of the whole
        for (channel, whole) in window.channels.iter_mut().zip(&problem.channels) {
            let spread = problem.records[whole.recording].spread(whole.output);
            channel.noise.white = whole.noise.white.max(COARSE * spread);
        }
        let steps = window.first_steps();
        let found = search(&window, &x, steps, 0.1, 25, &mut |_| {})?;
        news(&News::Detail(format!(
            "window of {:.0} %: sum of squares {:.4e}",
            100.0 * part,
            found.cost()
        )));
        x = found.x;
    }
    Ok(x)
}

/// Mean square of the worst channel's residual over its noise from row to row.
fn misfit(problem: &Problem, answer: &Answer, x: &[f64]) -> f64 {
    let residuals = problem.residuals(&answer.motion, x);
    let one = |(channel, r): (&super::problem::Channel, &Vec<f64>)| {
        let squares: f64 = r.iter().map(|r| r * r).sum();
        (squares / channel.count() as f64).sqrt() / channel.noise.white
    };
    problem.channels.iter().zip(&residuals).map(one).fold(0.0, f64::max)
}

/// The best minimum from the start, and, where that is bad, from others drawn within the bounds. Says how many starts were tried.
///
/// # Errors
/// If no start led anywhere.
pub fn best(
    problem: &Problem,
    starts: usize,
    news: &mut dyn FnMut(&News),
) -> Result<(Minimum, usize)> {
    let mut random = Random::new(26, 0);
    let mut best: Option<Minimum> = None;
    let mut tried = 0;
    let mut first_error = None;
    while tried < starts.max(1) {
        let x = if tried == 0 { problem.start() } else { drawn(&problem.unknowns, &mut random) };
        tried += 1;
        let found = from_afar(problem, &x, news)
            .and_then(|x| search(problem, &x, problem.first_steps(), 0.3, 40, news));
        match found {
            Err(error) => first_error = first_error.or(Some(error)),
            Ok(found) => {
                let bad = misfit(problem, &found.answer, &found.x);
                news(&News::Step(format!(
                    "start {tried}: the residual is {bad:.2} times the noise from row to row"
                )));
                if best.as_ref().is_none_or(|best| found.cost() < best.cost()) {
                    best = Some(found);
                }
                if bad < BAD {
                    break;
                }
            }
        }
    }
    match (best, first_error) {
        (Some(best), _) => Ok((best, tried)),
        (None, error) => Err(error.context("no search was made")?),
    }
}

/// A start within the bounds, or within the reach where there are none.
fn drawn(unknowns: &[Unknown], random: &mut Random) -> Vec<f64> {
    let one = |unknown: &Unknown| {
        // all of bounds that were given (their reach is a quarter of them)
        let (low, high) = unknown.bounds;
        let wide = if high - low < 5.0 * unknown.reach { 4.0 } else { 1.0 };
        let low = low.max(unknown.start - wide * unknown.reach);
        let high = high.min(unknown.start + wide * unknown.reach);
        low + (high - low) * random.uniform()
    };
    unknowns.iter().map(one).collect()
}

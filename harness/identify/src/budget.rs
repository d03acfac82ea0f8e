//! The error budget: what an error of something that is not estimated does to the estimates.
//!
//! To first order, with e the innovations, J their sensitivities and q what is wrong,
//!
//! ```text
//! dx̂/dq = −(JᵀJ)⁻¹ Jᵀ ∂e/∂q
//! ```
//!
//! What is known of q makes that part of the covariance of x̂: σ_q² (dx̂/dq)(dx̂/dq)ᵀ, as if q were one more unknown with that knowledge.

use std::collections::BTreeMap;

use anyhow::Result;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::fit::{Answer, Problem};
use crate::nominal;
use crate::tolerance::{NAMES, Tolerances};
use crate::uncertainty::Covariance;

/// What an error of something that is not estimated does to the estimates.
#[derive(Clone, Debug, Serialize)]
pub struct Effect {
    /// What is wrong, and by how much.
    pub source: String,
    /// Change of each parameter, SI.
    pub change: BTreeMap<String, f64>,
    /// It is a tolerance: a standard deviation of what is known, and part of the intervals.
    pub tolerance: bool,
    /// Change of the variables x.
    #[serde(skip)]
    pub x: DVector<f64>,
}

/// Relative change by which the answer is differenced: of a long recording, less than a tenth of a standard deviation.
const STEP: f64 = 5e-6;
/// Rounds of [`modes`].
const ROUNDS: usize = 5;
/// What a round is taken to leave of the error before it, at least.
const LEAVES: f64 = 0.3;
/// Step, in standard deviations, that is not taken any more.
const SETTLED: f64 = 0.1;

/// What an error of something that is known within a tolerance does to the innovations.
pub struct Slope {
    /// Its name.
    name: &'static str,
    /// Relative standard deviation of what is known of it.
    tolerance: f64,
    /// Change of the stacked innovations by an error of that size.
    pub change: DVector<f64>,
}

/// Of all tolerances that count, at x with the FMU's answer there.
pub fn slopes(
    problem: &Problem,
    (x, answer): (&[f64], &Answer),
    tolerances: &Tolerances,
) -> Result<Vec<Slope>> {
    let sloshes = problem.index("slosh.zeta").is_some();
    let mut slopes = Vec::new();
    for (name, tolerance) in NAMES.into_iter().zip(tolerances.all()) {
        let estimated = problem.index(name).is_some();
        let recorded = name == "g_axial" && problem.recordings.iter().any(|r| r.gravity.is_some());
        let unseen = !sloshes && matches!(name, "g_axial");
        if tolerance == 0.0 || estimated || recorded || unseen {
            continue;
        }
        let change = relative_slope(problem, (x, answer), name)? * tolerance;
        slopes.push(Slope { name, tolerance, change });
    }
    Ok(slopes)
}

/// Derivative of the stacked innovations with respect to the logarithm of `torque`, `clock` or a parameter of the FMU that is not estimated.
pub fn relative_slope(
    problem: &Problem,
    (x, answer): (&[f64], &Answer),
    name: &str,
) -> Result<DVector<f64>> {
    let factor = 1.0 + STEP;
    let mut recordings = problem.recordings.to_vec();
    let mut other = problem.clone();
    match name {
        "torque" => recordings.iter_mut().flat_map(|r| &mut r.torque).for_each(|t| *t *= factor),
        "clock" => recordings.iter_mut().flat_map(|r| &mut r.time).for_each(|t| *t *= factor),
        _ => {
            let instance = nominal::initialised(problem.fmu, &problem.setup.settings);
            let value = instance?.real(name)? * factor;
            other.setup.settings.push((name.into(), value.to_string()));
        }
    }
    let other = Problem { recordings: &recordings, ..other };
    Ok((other.stacked(&other.answer(x)?, x) - problem.stacked(answer, x)) / STEP)
}

/// What may be wrong in a problem, the tolerances first, and what that does at the minimum x.
pub fn of(
    problem: &Problem,
    (x, answer): (&[f64], &Answer),
    jacobian: &DMatrix<f64>,
    covariance: &Covariance,
    slopes: &[Slope],
) -> Vec<Effect> {
    let effect = |source: String, change: DVector<f64>, tolerance: bool| {
        let there: Vec<f64> = x.iter().zip(change.iter()).map(|(x, change)| x + change).collect();
        let values = problem.values(x).into_iter().zip(problem.values(&there));
        let changes = problem.unknowns.iter().zip(values);
        let changes = changes.map(|(u, (before, after))| (u.quantity.name(), after - before));
        Effect { source, change: changes.collect(), tolerance, x: change }
    };
    let of_slope = |slope: &Slope| {
        let change = -(&covariance.x * jacobian.tr_mul(&slope.change));
        effect(format!("{} wrong by {}", slope.name, percent(slope.tolerance)), change, true)
    };
    let mut effects: Vec<Effect> = slopes.iter().map(of_slope).collect();
    let sloshes = problem.index("slosh.zeta").is_some();
    if let Some(change) = modes(problem, (x, answer), jacobian, covariance).filter(|_| sloshes) {
        effects.push(effect("slosh modes 2 to 4, left out".into(), change, false));
    }
    effects
}

/// A share in percent.
pub fn percent(part: f64) -> String {
    let text = format!("{:.4}", 100.0 * part);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

/// The change of x when the model is fitted anew with four modes, by Gauss and Newton's steps with the Jacobian that there is.
/// One step would not do: what of the innovations' change is of second order looks like a large error
/// in weak directions, friction's. `None` if they do not settle.
fn modes(
    problem: &Problem,
    (x, answer): (&[f64], &Answer),
    jacobian: &DMatrix<f64>,
    covariance: &Covariance,
) -> Option<DVector<f64>> {
    if problem.setup.settings.iter().any(|(name, _)| name == "slosh.modes") {
        return None;
    }
    let base = problem.stacked(answer, x);
    let mut other = problem.clone();
    other.setup.settings.push(("slosh.modes".into(), "4".into()));
    let (mut there, mut last) = (x.to_vec(), f64::INFINITY);
    for _ in 0..ROUNDS {
        let answer = other.answer(&there).ok()?;
        let change = other.stacked(&answer, &there) - &base;
        let step = -(&covariance.x * jacobian.tr_mul(&change));
        there.iter_mut().zip(step.iter()).for_each(|(x, step)| *x += step);
        let length = (jacobian * &step).norm();
        if !length.is_finite() || length > 2.0 * last {
            return None;
        }
        let next = if last.is_finite() { length * (length / last).max(LEAVES) } else { length };
        last = length;
        if next < SETTLED {
            return Some(DVector::from_iterator(x.len(), there.iter().zip(x).map(|(a, b)| a - b)));
        }
    }
    None
}

/// What tolerances add to the covariance of x.
pub fn of_tolerances(effects: &[Effect], n: usize) -> DMatrix<f64> {
    let each = effects.iter().filter(|effect| effect.tolerance).map(|e| &e.x * e.x.transpose());
    each.fold(DMatrix::zeros(n, n), |sum, one| sum + one)
}

//! Errors of the FMU's solver in the estimates and in the derivatives.
//!
//! The errors of an adaptive solver jump where the pattern of its steps changes. Two things are measured at the minimum, both as
//! vectors ε of whitened residuals:
//!
//! * the noise of the outputs between neighbouring values of a parameter: fourth differences of five runs, over √70, which is
//!   their norm for independent errors (Moré and Wild, SIAM J. Sci. Comput. 33, 2011). A smooth answer leaves next to nothing of
//!   them;
//! * the change of the outputs with a finer tolerance, with shorter communication steps, and with the host's solver.
//!
//! Each ε moves the estimates by (JᵀJ)⁻¹ Jᵀ ε. An interval of the measurement's noise alone holds as long as that is small
//! against the standard deviation. A solver that has the same errors in all of these runs shows none of them.

use analysis::statistics::peak;
use anyhow::Result;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::decomposition::Curvature;
use crate::fit::problem::{Motion, Problem, Step};
use crate::tuning::OUTPUT_ROUNDING;

/// Effect of the solver's errors.
#[derive(Clone, Debug)]
pub struct SolverError {
    /// Shift of each estimate, in its unit.
    pub shift: Vec<f64>,
    /// Relative error of each derivative: from noise, and with the curvature within its step.
    pub derivative: Vec<(f64, f64)>,
    /// True if a finer tolerance changes the outputs.
    pub heeds_tolerance: bool,
    /// True if any run with smaller errors of the solver changed the outputs.
    pub is_seen: bool,
}

/// Weights of the fourth difference, whose squares add up to 70, and of the third of the same points.
const FOURTH: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
const THIRD: [f64; 5] = [-1.0, 2.0, 0.0, -2.0, 1.0];
/// Sums of their squares.
const SQUARES: (f64, f64) = (70.0, 10.0);

/// Noise and curvature by one unknown.
struct Roughness {
    /// A sample of the noise.
    noise: DVector<f64>,
    /// Norm of h³ times the third derivative, noise taken out.
    third: f64,
    /// Half the distance of the outer points.
    step: f64,
}

fn roughness(
    problem: &Problem,
    x: &[f64],
    j: usize,
    base: &Motion,
    step: f64,
) -> Option<Roughness> {
    let unknown = &problem.unknowns[j];
    if !unknown.what.is_in_runs() {
        return None;
    }
    let (low, high) = unknown.bounds;
    let step = step.min(0.25 * (high - low));
    let centre = x[j].max(low + 2.0 * step).min(high - 2.0 * step);
    let one = |k: usize| -> Option<Motion> {
        let at = (centre + (k as f64 - 2.0) * step).clamp(low, high);
        if at == x[j] { Some(base.clone()) } else { problem.moved(x, j, at, base).ok() }
    };
    let motions = (0..5).into_par_iter().map(one).collect::<Option<Vec<Motion>>>()?;
    let combined = |weights: [f64; 5]| {
        let weighted: Vec<(f64, &Motion)> = weights.into_iter().zip(&motions).collect();
        problem.combined(x, &weighted)
    };
    let noise = combined(FOURTH) / SQUARES.0.sqrt();
    let third = combined(THIRD).norm_squared() - SQUARES.1 * noise.norm_squared();
    Some(Roughness { noise, third: 0.5 * third.max(0.0).sqrt(), step })
}

/// Measures the solver's errors at x, where the motion is `base` and `which` unknowns are not at a bound.
///
/// # Errors
/// If a derivative is not finite.
pub fn measure(
    problem: &Problem,
    x: &[f64],
    base: &Motion,
    jacobian: &DMatrix<f64>,
    steps: &[Step],
    which: &[usize],
) -> Result<SolverError> {
    let found: Vec<Option<Roughness>> = (0..x.len())
        .into_par_iter()
        .map(|j| roughness(problem, x, j, base, steps[j].size))
        .collect();
    let curvature = Curvature::of(jacobian, &problem.names(), which)?;
    let picked = jacobian.select_columns(which);
    let shift = |e: &DVector<f64>| curvature.solve(&picked.tr_mul(e), 0.0);
    // noise is another one at each point: the mean square over the samples
    let samples: Vec<DVector<f64>> = found.iter().flatten().map(|r| shift(&r.noise)).collect();
    let mut squares = DVector::zeros(which.len());
    for sample in &samples {
        squares += sample.component_mul(sample) / samples.len() as f64;
    }
    let mut most = squares.map(f64::sqrt);
    let finer = problem.setup.finer(problem.model);
    let motions: Vec<Option<Motion>> = finer
        .par_iter()
        .map(|finer| {
            let model = finer.model.as_ref().unwrap_or(problem.model);
            let other = Problem { setup: &finer.setup, model, ..problem.clone() };
            other.answer(x).ok().map(|answer| answer.motion)
        })
        .collect();
    let is_changed = |motion: &Motion| {
        let outputs = motion.iter().flatten().zip(base.iter().flatten());
        outputs.into_iter().any(|(new, old)| {
            let change =
                new.iter().zip(old).map(|(new, old)| (new - old).abs()).fold(0.0, f64::max);
            change > OUTPUT_ROUNDING * peak(old)
        })
    };
    let changes = motions.iter().flatten();
    let changes = changes.map(|motion| problem.combined(x, &[(1.0, motion), (-1.0, base)]));
    for change in changes {
        most = most.zip_map(&shift(&change), |most, by| most.max(by.abs()));
    }
    let mut all = vec![0.0; x.len()];
    which.iter().zip(&most).for_each(|(&j, by)| all[j] = *by);
    let derivative = |j: usize| {
        let norm = jacobian.column(j).norm();
        let Some(r) = found[j].as_ref().filter(|_| norm > 0.0) else { return (0.0, 0.0) };
        // of a central difference over 2 h: √2 ε/(2 h), and h² y'''/6
        let noise = r.noise.norm() / (std::f64::consts::SQRT_2 * r.step * norm);
        (noise, noise.hypot(r.third / (6.0 * r.step * norm)))
    };
    Ok(SolverError {
        shift: all,
        derivative: (0..x.len()).map(derivative).collect(),
        heeds_tolerance: motions[0].as_ref().is_some_and(is_changed),
        is_seen: motions.iter().flatten().any(is_changed),
    })
}

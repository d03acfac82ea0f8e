//! Errors of a system's solver in the estimates and in the derivatives.
//!
//! The errors of an adaptive solver jump where the pattern of its steps changes. Two things are measured at the minimum, both as
//! vectors ε of whitened residuals:
//!
//! * the noise of the outputs between neighbouring values of an unknown: fourth differences of five runs, over √70, which is
//!   their norm for independent errors (Moré and Wild, SIAM J. Sci. Comput. 33, 2011). A smooth answer leaves next to nothing of
//!   them;
//! * the change of the outputs of the same system with smaller errors.
//!
//! Each ε moves the estimates by (JᵀJ)⁻¹ Jᵀ ε. An interval of the measurement's noise alone holds as long as that is small
//! against the standard deviation. A solver that has the same errors in all of these runs shows none of them.

use analysis::statistics::peak;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::fit::{Fit, Point};
use super::minimum::{Curvature, places};
use super::problem::{Motion, Role, System};

/// Part of an output's peak by which rounding may change it.
const ROUNDING: f64 = 1e-12;

#[derive(Clone, Debug)]
pub struct SolverError {
    pub shift: Vec<f64>,
    /// Relative error of each derivative: from noise, and with the curvature within its step.
    pub derivative: Vec<(f64, f64)>,
    /// True for each of the systems with smaller errors whose outputs differ.
    pub differs: Vec<bool>,
}

/// Roughness of the outputs along one unknown: a sample of their noise between neighbouring values of the unknown, the
/// norm of h³ times the third derivative without this noise, and the step h.
struct Roughness {
    noise: DVector<f64>,
    third: f64,
    step: f64,
}

impl Fit<'_> {
    fn roughness(&self, at: &Point, j: usize) -> Option<Roughness> {
        if !matches!(self.problem.unknowns[j].role, Role::Run(_)) {
            return None;
        }
        let (low, high) = self.ends[j];
        let step = self.steps[j].0.min(0.25 * (high - low));
        let centre = at.z[j].max(low + 2.0 * step).min(high - 2.0 * step);
        let one = |k: usize| -> Option<Vec<Motion>> {
            let to = (centre + (k as f64 - 2.0) * step).clamp(low, high);
            match to == at.z[j] {
                true => Some(at.motion.clone()),
                false => self.motion_with(at, j, to).ok().map(|(_, motion)| motion),
            }
        };
        let motions = (0..5).into_par_iter().map(one).collect::<Option<Vec<_>>>()?;
        let combined = |weights: [f64; 5]| {
            let pairs: Vec<(f64, &[Motion])> =
                weights.into_iter().zip(motions.iter().map(Vec::as_slice)).collect();
            self.change(&at.z, &pairs)
        };
        // the squares of the weights add up to 70 and to 10
        let noise = combined([1.0, -4.0, 6.0, -4.0, 1.0]) / 70.0_f64.sqrt();
        let third = combined([-1.0, 2.0, 0.0, -2.0, 1.0]).norm_squared();
        let third = third - 10.0 * noise.norm_squared();
        Some(Roughness { noise, third: 0.5 * third.max(0.0).sqrt(), step })
    }

    /// Measures the solver's errors at a point with these derivatives by the unknowns `which`. `finer` are copies of the system
    /// whose solver has smaller errors.
    pub fn solver_error(
        &self,
        at: &Point,
        jacobian: &DMatrix<f64>,
        which: &[bool],
        finer: &[&dyn System],
    ) -> SolverError {
        let n = at.z.len();
        let found: Vec<Option<Roughness>> =
            (0..n).into_par_iter().map(|j| self.roughness(at, j)).collect();
        let covariance = Curvature::new(jacobian, places(which)).covariance(n);
        let shift = |e: &DVector<f64>| &covariance * jacobian.tr_mul(e);
        // noise is another one at each point: the mean square over the samples
        let samples: Vec<DVector<f64>> = found.iter().flatten().map(|r| shift(&r.noise)).collect();
        let mut squares = DVector::zeros(n);
        for sample in &samples {
            squares += sample.component_mul(sample) / samples.len() as f64;
        }
        let mut most = squares.map(f64::sqrt);
        let values = self.values(&at.z);
        let run = |system: &&dyn System| -> Option<Vec<Motion>> {
            let one = |k: usize| system.run(&values, k, self.rows(k), self.hold, false).ok();
            (0..self.problem.recordings.len()).into_par_iter().map(one).collect()
        };
        let motions: Vec<Option<Vec<Motion>>> = finer.par_iter().map(run).collect();
        for motion in motions.iter().flatten() {
            let change = self.change(&at.z, &[(1.0, motion), (-1.0, &at.motion)]);
            most = most.zip_map(&shift(&change), |most, by| most.max(by.abs()));
        }
        let derivative = |j: usize| {
            let norm = jacobian.column(j).norm();
            let Some(r) = found[j].as_ref().filter(|_| norm > 0.0) else { return (0.0, 0.0) };
            // of a central difference over 2 h: √2 ε/(2 h), and h² y'''/6
            let noise = r.noise.norm() / (std::f64::consts::SQRT_2 * r.step * norm);
            (noise, noise.hypot(r.third / (6.0 * r.step * norm)))
        };
        let differs = |motion: &Option<Vec<Motion>>| {
            motion.as_ref().is_some_and(|motion| is_changed(motion, &at.motion))
        };
        SolverError {
            shift: most.iter().copied().collect(),
            derivative: (0..n).map(derivative).collect(),
            differs: motions.iter().map(differs).collect(),
        }
    }
}

/// Returns true if an output differs by more than rounding.
fn is_changed(motion: &[Motion], base: &[Motion]) -> bool {
    let outputs = motion.iter().zip(base).flat_map(|(a, b)| a.outputs.iter().zip(&b.outputs));
    outputs.into_iter().any(|(new, old)| {
        let changes = new.iter().zip(old).map(|(new, old)| (new - old).abs());
        changes.fold(0.0, f64::max) > ROUNDING * peak(old)
    })
}

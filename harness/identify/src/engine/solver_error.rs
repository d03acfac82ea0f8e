//! Effect of the solver's errors on the estimates and on the derivatives.
//!
//! The errors of an adaptive solver jump when its sequence of step sizes changes. Two vectors ε of whitened residuals are
//! measured at the minimum:
//!
//! * the noise of the outputs between neighbouring values of an unknown. It is the fourth difference of five simulations,
//!   divided by √70, which is the norm of the weights for independent errors (Moré and Wild, SIAM J. Sci. Comput. 33, 2011).
//!   Smooth outputs have a fourth difference near 0;
//! * the change of the outputs if the same system is simulated with smaller errors.
//!
//! Each ε shifts the estimates by (JᵀJ)⁻¹ Jᵀ ε. If this shift is small against the standard deviation, an interval that
//! considers only the measurement noise is valid. A solver whose error is the same in all of these simulations is not detected.

use analysis::statistics::peak;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::fit::{Fit, Point};
use super::minimum::{Curvature, places};
use super::problem::{Motion, Role, System};

/// Change of an output, relative to its largest absolute value, that may come from rounding.
const ROUNDING: f64 = 1e-12;

#[derive(Clone, Debug)]
pub struct SolverError {
    pub shift: Vec<f64>,
    /// For the derivative by each unknown, two relative errors: from the solver's noise alone, and from this noise together
    /// with the truncation error of the finite difference.
    pub derivative: Vec<(f64, f64)>,
    /// For each system of `finer` in [`Fit::solver_error`], true if its outputs differ from the outputs of the fitted
    /// system.
    pub differs: Vec<bool>,
}

/// Errors of the solver along one unknown, from five simulations in which the unknown has neighbouring values, `step`
/// apart. `noise` is one sample of the solver's noise as a vector of whitened residuals. `third` is the norm of step³ times
/// the third derivative of the whitened residuals, without the part that the noise causes.
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
        // sums of the squared weights: 70 for the fourth difference, 10 for the third
        let noise = combined([1.0, -4.0, 6.0, -4.0, 1.0]) / 70.0_f64.sqrt();
        let third = combined([-1.0, 2.0, 0.0, -2.0, 1.0]).norm_squared();
        let third = third - 10.0 * noise.norm_squared();
        Some(Roughness { noise, third: 0.5 * third.max(0.0).sqrt(), step })
    }

    /// Measures how much the solver's errors change the estimates and the derivatives at the point `at`. `jacobian`
    /// contains the derivatives at this point by the unknowns for which `which` is true. `finer` are copies of the system
    /// with smaller solver errors; their outputs are compared with the outputs of the fitted system.
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
        // the noise differs from point to point: mean square over the samples
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
            // errors of a central difference over 2 h: √2 ε/(2 h) from noise, h² y'''/6 from curvature
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

/// Returns true if an output differs from the output of `base` by more than rounding.
fn is_changed(motion: &[Motion], base: &[Motion]) -> bool {
    let outputs = motion.iter().zip(base).flat_map(|(a, b)| a.outputs.iter().zip(&b.outputs));
    outputs.into_iter().any(|(new, old)| {
        let changes = new.iter().zip(old).map(|(new, old)| (new - old).abs());
        changes.fold(0.0, f64::max) > ROUNDING * peak(old)
    })
}

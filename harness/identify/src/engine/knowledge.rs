//! Information of the recordings about the unknowns at a point: the covariance, the directions in which no output changes, and
//! the unknowns whose estimates depend on the solver's errors.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use serde::Serialize;

use super::SEEN;
use super::fit::Fit;
use super::minimum::{Curvature, places};
use super::solver_error::SolverError;

/// Shift of an estimate by the solver's errors, in standard deviations, above which the estimate is not usable.
const DECIDED: f64 = 0.3;

/// Unknowns that can change together without a change of any output.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inseparable {
    /// Change of each unknown, in its coordinate. The sign is chosen so that the unknown with the largest effect
    /// on the outputs increases.
    pub direction: BTreeMap<String, f64>,
}

impl Inseparable {
    pub fn words(&self) -> String {
        let names: Vec<&str> = self.direction.keys().map(String::as_str).collect();
        let changes: Vec<String> =
            self.direction.iter().map(|(name, by)| format!("{name} {by:+.3e}")).collect();
        format!(
            "{} cannot be distinguished: no output changes when they change together ({}). Give one of them a value with --set \
             in place of --free, or a prior with --prior. Otherwise record an output that depends on them differently, or \
             another motion.",
            names.join(", "),
            changes.join(", ")
        )
    }
}

pub struct Knowledge {
    /// Covariance of all unknowns. The rows of unknowns at a bound are 0, and unknowns that the recordings do not determine
    /// have an infinite variance.
    pub covariance: DMatrix<f64>,
    pub inseparable: Vec<Inseparable>,
    /// True for each unknown whose derivative is smaller than the solver's errors, or whose estimate they shift by more
    /// than [`DECIDED`] standard deviations.
    pub decided_by_solver: Vec<bool>,
}

impl Fit<'_> {
    /// Computes the knowledge from the derivatives by the unknowns `which` and from the solver's errors.
    pub fn knowledge(
        &self,
        jacobian: &DMatrix<f64>,
        which: &[bool],
        solver: &SolverError,
    ) -> Knowledge {
        let (n, which) = (which.len(), places(which));
        let curvature = Curvature::new(jacobian, which.clone());
        let mut covariance = curvature.covariance(n);
        let (noise, both): (Vec<f64>, Vec<f64>) =
            which.iter().map(|&j| solver.derivative[j]).unzip();
        // the model itself causes directions that even exact derivatives do not resolve; the noise of the solver
        // adds further unresolved directions
        let curved: Vec<f64> =
            both.iter().zip(&noise).map(|(b, n)| (b * b - n * n).max(0.0).sqrt()).collect();
        let (of_model, of_both) = (curvature.unresolved(&curved), curvature.unresolved(&both));
        let mut decided_by_solver = vec![false; n];
        if of_both.len() > of_model.len() {
            for direction in &of_both {
                let parts = which.iter().zip(direction.iter()).filter(|(_, p)| p.abs() > SEEN);
                parts.for_each(|(&j, _)| decided_by_solver[j] = true);
            }
        }
        let mut inseparable = Vec::new();
        for direction in &of_model {
            let sign = direction[direction.iamax()].signum();
            let mut changes = BTreeMap::new();
            for (k, &j) in which.iter().enumerate().filter(|(k, _)| direction[*k].abs() > SEEN) {
                covariance[(j, j)] = f64::INFINITY;
                let by = sign * direction[k] * curvature.scale[k];
                changes.insert(self.problem.unknowns[j].name.clone(), by);
            }
            inseparable.push(Inseparable { direction: changes });
        }
        for &j in &which {
            let std = covariance[(j, j)].sqrt();
            decided_by_solver[j] |= std.is_finite() && solver.shift[j] > DECIDED * std;
        }
        Knowledge { covariance, inseparable, decided_by_solver }
    }
}

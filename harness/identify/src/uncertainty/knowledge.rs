//! Information about the unknowns at a point: covariance, directions that no output shows, and what the solver's errors decide.

use std::collections::BTreeMap;

use anyhow::Result;
use nalgebra::DMatrix;
use serde::Serialize;

use crate::fit::covariance::spread_out;
use crate::fit::decomposition::Curvature;
use crate::fit::problem::Problem;
use crate::tuning::{DIRECTION_PART, SOLVER_DECIDES};
use crate::uncertainty::solver_error::SolverError;

/// Unknowns that change together without a change of any output.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inseparable {
    /// The change of each, in its unit; the largest relative to its steepness is positive.
    pub direction: BTreeMap<String, f64>,
}

impl Inseparable {
    /// Returns the sentence about them.
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

/// Information about the unknowns at a point.
pub(crate) struct Knowledge {
    /// The covariance of all unknowns; rows of those at a bound are 0, and what is not resolved has an infinite variance.
    pub covariance: DMatrix<f64>,
    /// Directions that no output shows.
    pub inseparable: Vec<Inseparable>,
    /// Unknowns whose derivatives are lost in the solver's errors, or which these move by more than [`SOLVER_DECIDES`] of the standard
    /// deviation.
    pub decided_by_solver: Vec<bool>,
}

pub(crate) fn knowledge(
    problem: &Problem,
    jacobian: &DMatrix<f64>,
    which: &[usize],
    solver: &SolverError,
) -> Result<Knowledge> {
    let n = problem.unknowns.len();
    let curvature = Curvature::of(jacobian, &problem.names(), which)?;
    let mut covariance = spread_out(&curvature.inverse(), which, n);
    let (noise, both): (Vec<f64>, Vec<f64>) = which.iter().map(|&j| solver.derivative[j]).unzip();
    // what curvature alone leaves unresolved is a property of the model; what noise adds is one of the solver
    let curved: Vec<f64> =
        both.iter().zip(&noise).map(|(b, n)| (b * b - n * n).max(0.0).sqrt()).collect();
    let of_model = curvature.unresolved(&curved);
    let of_both = curvature.unresolved(&both);
    let mut decided_by_solver = vec![false; n];
    if of_both.len() > of_model.len() {
        for direction in &of_both {
            let of =
                which.iter().zip(direction.iter()).filter(|(_, part)| part.abs() > DIRECTION_PART);
            of.for_each(|(&j, _)| decided_by_solver[j] = true);
        }
    }
    let inseparable = of_model.iter().map(|direction| {
        let own = curvature.unscaled(direction);
        let sign = direction[direction.iamax()].signum();
        let of = which.iter().zip(direction.iter().zip(own.iter()));
        let of = of.filter(|(_, (part, _))| part.abs() > DIRECTION_PART);
        for (&j, _) in of.clone() {
            covariance[(j, j)] = f64::INFINITY;
        }
        let of = of.map(|(&j, (_, by))| (problem.unknowns[j].name.clone(), sign * by));
        Inseparable { direction: of.collect() }
    });
    let inseparable = inseparable.collect();
    for &j in which {
        let std = covariance[(j, j)].sqrt();
        decided_by_solver[j] |= std.is_finite() && solver.shift[j] > SOLVER_DECIDES * std;
    }
    Ok(Knowledge { covariance, inseparable, decided_by_solver })
}

/// JSON knows no infinity.
pub(crate) fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { f64::NAN }
}

//! How sure the estimates are.
//!
//! With whitened residuals of unit variance and sensitivities J, the covariance is (JᵀJ)⁻¹: the
//! Cramér–Rao bound of that noise. If the residual is more than noise, no such formula holds: what a
//! model leaves out is not random. The sandwich (JᵀJ)⁻¹ (Σ s_w s_wᵀ) (JᵀJ)⁻¹, s_w the sum of the scores
//! J_kᵀ e_k over windows of [`WINDOW`], then shows at least how much the estimate would move from
//! one part of the recording to the next.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::unknown::Unknown;

/// Length of the windows of the sandwich, s; two times the slosh's decay.
pub const WINDOW: f64 = 50.0;

/// Correlation beyond which two unknowns are told apart only if they are precise all the same.
const CORRELATED: f64 = 0.99;
/// Relative standard deviation beyond which a correlated unknown is not known by itself.
const VAGUE: f64 = 0.05;

/// Covariance of the variables x.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// Of x, priors included.
    pub x: DMatrix<f64>,
    /// Condition number of J with columns of unit length.
    pub condition: f64,
}

impl Covariance {
    /// From sensitivities; `None` if some combination of unknowns has no influence at all.
    pub fn of(jacobian: &DMatrix<f64>) -> Option<Self> {
        let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
        if !norms.iter().all(|norm| *norm > 0.0) {
            return None;
        }
        let mut scaled = jacobian.clone();
        for (mut column, norm) in scaled.column_iter_mut().zip(&norms) {
            column /= *norm;
        }
        let r = scaled.qr().r();
        let svd = r.svd(false, true);
        let (largest, smallest) = (svd.singular_values.max(), svd.singular_values.min());
        if smallest.is_nan() || smallest <= 1e-9 * largest {
            return None;
        }
        let v = svd.v_t?.transpose();
        let mut half = v;
        for (mut column, value) in half.column_iter_mut().zip(&svd.singular_values) {
            column /= *value;
        }
        for (mut row, norm) in half.row_iter_mut().zip(&norms) {
            row /= *norm;
        }
        Some(Covariance { x: &half * half.transpose(), condition: largest / smallest })
    }

    /// The sandwich for innovations that are not white; `windows` are ranges of rows.
    pub fn sandwich(
        &self,
        jacobian: &DMatrix<f64>,
        e: &[f64],
        windows: &[(usize, usize)],
    ) -> DMatrix<f64> {
        let n = self.x.nrows();
        let mut middle = DMatrix::zeros(n, n);
        for &(from, to) in windows {
            let e = DVector::from_column_slice(&e[from..to]);
            let score = jacobian.rows(from, to - from).tr_mul(&e);
            middle += &score * score.transpose();
        }
        &self.x * middle * &self.x
    }

    /// Correlations.
    pub fn correlations(covariance: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(covariance.nrows(), covariance.ncols(), |i, j| {
            covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()
        })
    }
}

/// Two unknowns of which only the sum is known.
#[derive(Clone, Debug, Serialize)]
pub struct Combination {
    /// `a + b`.
    pub name: String,
    /// The two.
    pub of: [String; 2],
    /// Their sum.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Unit.
    pub unit: String,
    /// Their correlation.
    pub correlation: f64,
}

/// Sums of unknowns that stand in for unknowns which are not known by themselves. `covariance` is
/// that of the values.
pub fn combinations(
    unknowns: &[Unknown],
    values: &[f64],
    covariance: &DMatrix<f64>,
) -> Vec<Combination> {
    let mut found = Vec::new();
    for i in 0..values.len() {
        for j in 0..i {
            let (vi, vj, vij) = (covariance[(i, i)], covariance[(j, j)], covariance[(i, j)]);
            let correlation = vij / (vi * vj).sqrt();
            let vague = |k: usize| covariance[(k, k)].sqrt() > VAGUE * values[k].abs();
            let alike = unknowns[i].unit == unknowns[j].unit;
            if alike && correlation < -CORRELATED && (vague(i) || vague(j)) {
                let of = [unknowns[j].quantity.name(), unknowns[i].quantity.name()];
                found.push(Combination {
                    name: of.join(" + "),
                    of,
                    value: values[i] + values[j],
                    std: (vi + vj + 2.0 * vij).max(0.0).sqrt(),
                    unit: unknowns[i].unit.clone(),
                    correlation,
                });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_has_its_textbook_covariance() {
        // y = a + b t at t = -2..2, unit noise: var a = 1/5, var b = 1/10, no correlation
        let jacobian = DMatrix::from_fn(5, 2, |k, j| if j == 0 { 1.0 } else { k as f64 - 2.0 });
        let found = Covariance::of(&jacobian).unwrap();
        assert!((found.x[(0, 0)] - 0.2).abs() < 1e-15 && (found.x[(1, 1)] - 0.1).abs() < 1e-15);
        assert!(found.x[(0, 1)].abs() < 1e-15 && (found.condition - 1.0).abs() < 1e-12);
        // two columns that are the same have no covariance
        assert!(Covariance::of(&DMatrix::from_element(5, 2, 1.0)).is_none());
    }
}

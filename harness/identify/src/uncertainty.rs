//! Covariances and intervals of the estimates.
//!
//! With whitened residuals of unit variance and sensitivities J, the covariance is (JᵀJ)⁻¹: the
//! Cramér–Rao bound of that noise. If the residual is more than noise, no such formula holds: what a
//! model leaves out is not random. The sandwich (JᵀJ)⁻¹ (Σ s_w s_wᵀ) (JᵀJ)⁻¹, s_w the sum of the scores
//! J_kᵀ e_k over windows of [`WINDOW`], then shows at least how much the estimate would move from
//! one part of the recording to the next.

use std::collections::BTreeMap;

use anyhow::Result;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::decomposition;
use crate::estimate::{Estimated, prose};
use crate::unknown::Unknown;
use names::hubslosh::friction;

/// Length of the windows of the sandwich, s; two times the slosh's decay.
pub const WINDOW: f64 = 50.0;

/// Standard deviation of the friction's asymmetry above which the recordings do not show it.
pub const ONE_WAY: f64 = 0.3;
/// Correlation above which two unknowns count as determined only if each is precise by itself.
const CORRELATED: f64 = 0.99;
/// Relative standard deviation beyond which a correlated unknown is not known by itself.
const VAGUE: f64 = 0.05;

/// Covariance of the variables x.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// Covariance of x, priors included.
    pub x: DMatrix<f64>,
    /// Condition number of J with columns of unit length.
    pub condition: f64,
}

impl Covariance {
    /// Computes the covariance from the sensitivities to unknowns with these names; `None` if some combination of unknowns has no
    /// influence.
    ///
    /// # Errors
    /// If a sensitivity is not finite.
    pub fn of(jacobian: &DMatrix<f64>, names: &[String]) -> Result<Option<Self>> {
        let (l, condition) = directions(jacobian, names)?;
        let all_act = jacobian.column_iter().all(|column| column.norm() > 0.0);
        Ok((all_act && condition < 1e9).then(|| Covariance { x: &l * l.transpose(), condition }))
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

    /// Correlations, row by row.
    pub fn correlations(covariance: &DMatrix<f64>) -> Vec<Vec<f64>> {
        let of = |i: usize, j: usize| {
            covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()
        };
        let n = covariance.nrows();
        (0..n).map(|i| (0..n).map(|j| of(i, j)).collect()).collect()
    }
}

/// L = V S⁻¹ of sensitivities U S Vᵀ, from columns of unit length: each column moves the answer by one standard
/// deviation, at right angles to the others, and L Lᵀ is the covariance (JᵀJ)⁻¹. Also the condition number.
///
/// # Errors
/// If a sensitivity is not finite.
pub fn directions(jacobian: &DMatrix<f64>, names: &[String]) -> Result<(DMatrix<f64>, f64)> {
    let lengths = decomposition::lengths(jacobian, names)?;
    let norms: Vec<f64> = lengths.iter().map(|length| length.max(1e-9)).collect();
    let mut scaled = jacobian.clone();
    scaled.column_iter_mut().zip(&norms).for_each(|(mut column, norm)| column /= *norm);
    let svd = decomposition::singular(scaled.qr().r())?;
    let (largest, smallest) = (svd.singular_values.max(), svd.singular_values.min());
    let mut l = svd.v_t.map_or_else(DMatrix::default, |v| v.transpose());
    for (mut column, value) in l.column_iter_mut().zip(&svd.singular_values) {
        column /= value.max(1e-9 * largest);
    }
    l.row_iter_mut().zip(&norms).for_each(|(mut row, norm)| row /= *norm);
    Ok((l, largest / smallest))
}

/// Windows of `seconds` for [`Covariance::sandwich`], of recordings with so many rows, so many seconds apart.
pub fn windows(
    recordings: impl Iterator<Item = (usize, f64)>,
    seconds: f64,
) -> Vec<(usize, usize)> {
    let (mut windows, mut first) = (Vec::new(), 0);
    for (rows, step) in recordings {
        let width = ((seconds / step) as usize).clamp(1, rows);
        windows
            .extend((0..rows).step_by(width).map(|k| (first + k, first + (k + width).min(rows))));
        first += rows;
    }
    windows
}

/// A square matrix over the variables `places` as one over all `n`, with zeros for the others.
pub fn spread_out(matrix: &DMatrix<f64>, places: &[usize], n: usize) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(n, n);
    for (i, &row) in places.iter().enumerate() {
        for (j, &column) in places.iter().enumerate() {
            all[(row, column)] = matrix[(i, j)];
        }
    }
    all
}

/// Sources of uncertainty, as covariances of the variables x.
#[derive(Clone, Copy, Debug)]
pub struct Sources<'a> {
    /// The recording's noise, (JᵀJ)⁻¹, with the gyro's scale known to its tolerance alone.
    pub noise: &'a DMatrix<f64>,
    /// Covariance of all variables over the profile of the friction's curves: the better account of the noise.
    pub friction_curves: Option<&'a DMatrix<f64>>,
    /// Covariance from the choice of slosh model.
    pub models: Option<&'a DMatrix<f64>>,
    /// Covariance from the intersample behaviour of the torque.
    pub between_rows: Option<&'a DMatrix<f64>>,
    /// Covariance from tolerances of values that are not estimated.
    pub tolerances: Option<&'a DMatrix<f64>>,
    /// The sandwich, where the residual is more than noise: no variance is less than there.
    pub residual: Option<&'a DMatrix<f64>>,
}

impl Sources<'_> {
    /// The covariance that noise makes, with no variance less than in the sandwich.
    pub fn least(noise: &DMatrix<f64>, sandwich: &DMatrix<f64>) -> DMatrix<f64> {
        Sources {
            noise,
            friction_curves: None,
            models: None,
            between_rows: None,
            tolerances: None,
            residual: Some(sandwich),
        }
        .total()
    }

    /// All of them together.
    pub fn total(&self) -> DMatrix<f64> {
        let mut all = self.noise.clone();
        if let Some(curves) = self.friction_curves {
            all.copy_from(curves);
        }
        if let Some(models) = self.models {
            let n = models.nrows();
            let with = all.view((0, 0), (n, n)) + models;
            all.view_mut((0, 0), (n, n)).copy_from(&with);
        }
        for more in [self.between_rows, self.tolerances].into_iter().flatten() {
            all += more;
        }
        if let Some(sandwich) = self.residual {
            for i in 0..all.nrows() {
                if sandwich[(i, i)] > all[(i, i)] {
                    let factor = (sandwich[(i, i)] / all[(i, i)]).sqrt();
                    all.row_mut(i).scale_mut(factor);
                    all.column_mut(i).scale_mut(factor);
                }
            }
        }
        all
    }
}

/// Two unknowns of which only a sum or a product is known.
#[derive(Clone, Debug, Serialize)]
pub struct Combination {
    /// `a + b`, or `a (1 + b)`.
    pub name: String,
    /// The two.
    pub of: [String; 2],
    /// Value of the combination.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Unit.
    pub unit: String,
    /// Their correlation.
    pub correlation: f64,
}

impl Combination {
    /// Returns the combination in words.
    pub fn words(&self) -> String {
        format!(
            "{} and {} cannot be distinguished (correlation {:.4}); only {} = {:.6} ± {:.6} {} is determined.",
            self.of[0],
            self.of[1],
            self.correlation,
            self.name,
            self.value,
            self.std,
            prose(&self.unit)
        )
    }
}

/// Replaces the estimates of dry friction if the hub turned one `way` alone (1: counter-clockwise, −1: clockwise). A fit with
/// asymmetry 0 gives only the friction of that direction, c (1 ± asymmetry) and d (1 ± asymmetry). The asymmetry is then anywhere
/// within its `bounds`, and c and d are at least half of that friction.
pub fn one_way(
    parameters: &mut BTreeMap<String, Estimated>,
    way: f64,
    bounds: [f64; 2],
) -> Vec<Combination> {
    const ASYMMETRY: &str = friction::ASYMMETRY;
    let mut combinations = Vec::new();
    for name in [friction::C, friction::D] {
        let Some(p) = parameters.get_mut(name) else { continue };
        combinations.push(Combination {
            name: format!("{name} (1 {} {ASYMMETRY})", if way > 0.0 { "+" } else { "-" }),
            of: [name, ASYMMETRY].map(String::from),
            value: p.value,
            std: p.std,
            unit: p.unit.clone(),
            correlation: -way,
        });
        p.interval = [0.5 * p.interval[0], f64::INFINITY];
        p.determined = false;
    }
    let unknown = Estimated::normal(0.0, (bounds[1] - bounds[0]) / 12f64.sqrt(), "1");
    let asymmetry = Estimated { interval: bounds, determined: false, ..unknown };
    parameters.insert(ASYMMETRY.into(), asymmetry);
    combinations
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

    /// Two variables and the gyro's scale.
    #[test]
    fn sources_of_uncertainty_add_up_and_a_residual_sets_the_least() {
        let diagonal = |d: [f64; 3]| DMatrix::from_diagonal(&DVector::from_row_slice(&d));
        let noise = diagonal([4.0, 2.0, 1.0]);
        let sources = Sources {
            noise: &noise,
            friction_curves: None,
            models: None,
            between_rows: None,
            tolerances: None,
            residual: None,
        };
        assert_eq!(sources.total(), noise);
        let two = DMatrix::from_row_slice(2, 2, &[10.0, 1.0, 1.0, 5.0]);
        let curves = diagonal([11.0, 5.0, 1.0]);
        let with_curves = Sources { friction_curves: Some(&curves), ..sources }.total();
        assert_eq!(with_curves, curves);
        let with_models = Sources { models: Some(&two), ..sources }.total();
        assert_eq!(with_models.diagonal().as_slice(), [14.0, 7.0, 1.0]);
        let with_tolerances = Sources { tolerances: Some(&noise), ..sources }.total();
        assert_eq!(with_tolerances.diagonal().as_slice(), [8.0, 4.0, 2.0]);
        let sandwich = diagonal([1.0, 8.0, 1.0]);
        let wide = Sources { models: Some(&two), residual: Some(&sandwich), ..sources }.total();
        // an off-diagonal element grows with the deviation, by sqrt(8/7)
        assert!((wide[(1, 1)] - 8.0).abs() < 1e-14 && wide[(0, 0)] == 14.0);
        assert!((wide[(0, 1)] - (8.0_f64 / 7.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn a_straight_line_has_its_textbook_covariance() {
        // y = a + b t at t = -2..2, unit noise: var a = 1/5, var b = 1/10, no correlation
        let jacobian = DMatrix::from_fn(5, 2, |k, j| if j == 0 { 1.0 } else { k as f64 - 2.0 });
        let found = Covariance::of(&jacobian, &[]).unwrap().unwrap();
        assert!((found.x[(0, 0)] - 0.2).abs() < 1e-15 && (found.x[(1, 1)] - 0.1).abs() < 1e-15);
        assert!(found.x[(0, 1)].abs() < 1e-15 && (found.condition - 1.0).abs() < 1e-12);
        // two columns that are the same have no covariance
        assert!(Covariance::of(&DMatrix::from_element(5, 2, 1.0), &[]).unwrap().is_none());
    }
}

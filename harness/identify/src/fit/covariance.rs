//! Covariances of the estimates: with whitened residuals of unit variance and sensitivities J, (JᵀJ)⁻¹, the Cramér–Rao bound.

use anyhow::Result;
use nalgebra::DMatrix;

use crate::fit::decomposition;

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

    /// Correlations, row by row; none of what has no finite variance.
    pub fn correlations(covariance: &DMatrix<f64>) -> Vec<Vec<f64>> {
        let of = |i: usize, j: usize| {
            let size = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            if size > 0.0 && size.is_finite() {
                covariance[(i, j)] / size
            } else {
                f64::from(i == j)
            }
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

#[cfg(test)]
mod tests {
    use super::*;

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

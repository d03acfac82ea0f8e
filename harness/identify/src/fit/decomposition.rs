//! Singular values and eigenvectors of matrices of derivatives. nalgebra's iterations never end for NaN or infinity.

use anyhow::{Context, Result, bail, ensure};
use nalgebra::{DMatrix, DVector, Dyn, SVD, SymmetricEigen};

use crate::tuning::{EIGEN_ITERATIONS, FLAT_EIGENVALUE, RESOLVED_EIGENVALUE};

/// Lengths of the columns.
///
/// # Errors
/// If the length of a column is not finite, with its name and, if an entry is not finite, its row.
pub fn lengths(derivatives: &DMatrix<f64>, names: &[String]) -> Result<Vec<f64>> {
    let length = |(j, column): (usize, nalgebra::DVectorView<f64>)| {
        let length = column.norm();
        if length.is_finite() {
            return Ok(length);
        }
        let name = names.get(j).cloned().unwrap_or_else(|| format!("unknown {}", j + 1));
        match column.iter().position(|entry| !entry.is_finite()) {
            Some(row) => bail!(
                "the derivative by {name} is {} in row {} of the residuals: the outputs or the noise are out of range there",
                column[row],
                row + 1
            ),
            None => bail!("the derivatives by {name} are too large: up to {:.0e}", column.amax()),
        }
    };
    derivatives.column_iter().enumerate().map(length).collect()
}

/// Singular values and right singular vectors of a matrix with columns of finite [`lengths`].
///
/// # Errors
/// If an entry is not finite, or the iterations do not end.
pub fn singular(matrix: DMatrix<f64>) -> Result<SVD<f64, Dyn, Dyn>> {
    ensure!(matrix.iter().all(|entry| entry.is_finite()), "{NOT_FINITE}");
    let found = matrix.try_svd(false, true, f64::EPSILON * 5.0, EIGEN_ITERATIONS);
    found.context("the singular values of the derivatives are not found")
}

/// Eigenvalues and eigenvectors of a symmetric matrix.
///
/// # Errors
/// If an entry is not finite, or the iterations do not end.
pub fn symmetric(matrix: DMatrix<f64>) -> Result<SymmetricEigen<f64, Dyn>> {
    ensure!(matrix.iter().all(|entry| entry.is_finite()), "{NOT_FINITE}");
    let found = matrix.try_symmetric_eigen(f64::EPSILON, EIGEN_ITERATIONS);
    found.context("the eigenvectors of the derivatives are not found")
}

/// A symmetric matrix in its own scales, D A D with a unit diagonal, by eigenvectors. It may have no rows.
pub struct Curvature {
    values: DVector<f64>,
    vectors: DMatrix<f64>,
    scale: DVector<f64>,
}

impl Curvature {
    /// Returns the curvature JᵀJ over the columns `which` of J, whose columns have these names.
    ///
    /// # Errors
    /// If a derivative is not finite.
    pub fn of(jacobian: &DMatrix<f64>, names: &[String], which: &[usize]) -> Result<Self> {
        let picked = jacobian.select_columns(which);
        let picked_names: Vec<String> =
            which.iter().filter_map(|&j| names.get(j).cloned()).collect();
        lengths(&picked, &picked_names)?;
        let a = picked.tr_mul(&picked);
        let scale = a.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 });
        if which.is_empty() {
            return Ok(Curvature { values: DVector::zeros(0), vectors: a, scale });
        }
        let scaled = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * scale[i] * scale[j]);
        let SymmetricEigen { eigenvalues, eigenvectors } = symmetric(scaled)?;
        Ok(Curvature { values: eigenvalues, vectors: eigenvectors, scale })
    }

    /// The eigenvalue below which a direction is flat.
    fn flat(&self) -> f64 {
        FLAT_EIGENVALUE * self.values.iter().copied().fold(0.0, f64::max)
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

    /// Returns the directions that the matrix does not resolve. `errors` are the independent relative errors of the Jacobian's
    /// columns. Along a unit eigenvector v they alone make an eigenvalue of Σ v_i² errors_i². Each direction is a unit vector in
    /// the matrix's own scales.
    pub fn unresolved(&self, errors: &[f64]) -> Vec<DVector<f64>> {
        let flat = self.flat();
        let is_flat = |value: f64, v: &DVector<f64>| {
            let made: f64 = v.iter().zip(errors).map(|(v, error)| (v * error).powi(2)).sum();
            value <= flat.max(RESOLVED_EIGENVALUE * made)
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

const NOT_FINITE: &str = "products of the derivatives are not finite";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::covariance::Covariance;

    #[test]
    fn values_that_are_not_finite_are_named_and_no_iteration_hangs() {
        let names = ["hub.I", "friction.d"].map(String::from);
        let line = DMatrix::from_fn(5, 2, |k, j| if j == 0 { 1.0 } else { k as f64 - 2.0 });
        for (entry, words) in [
            (f64::NAN, "derivative by friction.d is NaN in row 4"),
            (f64::INFINITY, "derivative by friction.d is inf in row 4"),
            (f64::NEG_INFINITY, "derivative by friction.d is -inf in row 4"),
            (1e200, "derivatives by friction.d are too large: up to 1e200"),
        ] {
            let mut bad = line.clone();
            bad[(3, 1)] = entry;
            let error = Covariance::of(&bad, &names).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
            let error = Curvature::of(&bad, &names, &[0, 1]).err().unwrap().to_string();
            assert!(error.contains(words), "{error}");
            // without the column in question
            assert!(Curvature::of(&bad, &names, &[0]).is_ok());
            assert!(singular(bad.clone()).is_err() || entry == 1e200);
            assert!(symmetric(bad.tr_mul(&bad)).is_err());
        }
        // sizes alone change nothing
        for size in [1e-300, 1e-150, 1e-9, 1.0, 1e9, 1e150] {
            let curvature = Curvature::of(&(&line * size), &names, &[0, 1]).unwrap();
            assert!(curvature.unresolved(&[0.0, 0.0]).is_empty() || size < 1e-150, "{size}");
            let found = Covariance::of(&(&line * size), &names).unwrap();
            assert_eq!(found.is_some(), size >= 1e-150, "{size}");
        }
    }
}

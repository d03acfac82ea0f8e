//! Singular values and eigenvectors of matrices of derivatives. nalgebra's iterations never end for NaN or infinity.

use anyhow::{Context, Result, bail, ensure};
use nalgebra::{DMatrix, Dyn, SVD, SymmetricEigen};

/// Limit of nalgebra's iterations; n columns take about 2 n.
const ITERATIONS: usize = 10_000;

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
    let found = matrix.try_svd(false, true, f64::EPSILON * 5.0, ITERATIONS);
    found.context("the singular values of the derivatives are not found")
}

/// Eigenvalues and eigenvectors of a symmetric matrix.
///
/// # Errors
/// If an entry is not finite, or the iterations do not end.
pub fn symmetric(matrix: DMatrix<f64>) -> Result<SymmetricEigen<f64, Dyn>> {
    ensure!(matrix.iter().all(|entry| entry.is_finite()), "{NOT_FINITE}");
    let found = matrix.try_symmetric_eigen(f64::EPSILON, ITERATIONS);
    found.context("the eigenvectors of the derivatives are not found")
}

const NOT_FINITE: &str = "products of the derivatives are not finite";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::any_fmu::search::Curvature;
    use crate::uncertainty::Covariance;

    #[test]
    fn what_is_not_finite_is_named_and_no_iteration_hangs() {
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

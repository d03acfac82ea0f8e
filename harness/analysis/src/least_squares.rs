use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, storage::Owned};

pub type Residuals<'a> = &'a dyn Fn(&[f64]) -> Vec<f64>;
/// Function that returns the derivatives of the residuals with respect to the unknowns, with one
/// row for each residual. `None` ends the search.
pub type Derivatives<'a> = &'a dyn Fn(&[f64]) -> Option<DMatrix<f64>>;

/// Minimum of a sum of squares.
///
/// - `x`: values of the unknowns at the minimum.
/// - `cost`: sum of squares at `x`.
/// - `converged`: false if the search reached its limit of iterations.
/// - `reason`: reason for which the search ended.
#[derive(Clone, Debug)]
pub struct Minimum {
    pub x: Vec<f64>,
    pub cost: f64,
    pub converged: bool,
    pub reason: String,
}

/// Returns the vector x that minimises |a x − b|; if there are several, the shortest of them.
/// Singular values of `a` up to `least` count as 0. Returns `None` if an entry is NaN or infinite,
/// because the iteration for the singular values would not end.
pub fn smallest(a: DMatrix<f64>, b: &DVector<f64>, least: f64) -> Option<DVector<f64>> {
    if !a.iter().chain(b.iter()).all(|entry| entry.is_finite()) {
        return None;
    }
    a.svd(true, true).solve(b, least).ok()
}

/// Minimises the sum of squares of `residuals`, starting from the unknowns `x`, by the
/// Levenberg–Marquardt method. `derivatives` is called only at the point for which `residuals` was
/// called last, so that both may share a simulation.
pub fn minimise(residuals: Residuals, derivatives: Derivatives, x: &[f64]) -> Minimum {
    let method = LevenbergMarquardt::new().with_ftol(1e-9).with_xtol(1e-9);
    minimise_by(&method, residuals, derivatives, x)
}

pub fn minimise_by(
    method: &LevenbergMarquardt<f64>,
    residuals: Residuals,
    derivatives: Derivatives,
    x: &[f64],
) -> Minimum {
    let search = Search { residuals, derivatives, x: DVector::from_column_slice(x) };
    let (search, report) = method.minimize(search);
    Minimum {
        x: search.x.as_slice().to_vec(),
        cost: 2.0 * report.objective_function,
        converged: report.termination.was_successful(),
        reason: format!("{:?}", report.termination),
    }
}

pub fn differences(residuals: Residuals, x: &[f64], steps: &[f64]) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = (0..x.len())
        .map(|j| {
            let at = |by: f64| {
                let mut moved = x.to_vec();
                moved[j] += by;
                DVector::from_vec(residuals(&moved))
            };
            (at(steps[j]) - at(-steps[j])) / (2.0 * steps[j])
        })
        .collect();
    DMatrix::from_columns(&columns)
}

struct Search<'a> {
    residuals: Residuals<'a>,
    derivatives: Derivatives<'a>,
    x: DVector<f64>,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Search<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x = x.clone();
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(DVector::from_vec((self.residuals)(self.x.as_slice())))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        (self.derivatives)(self.x.as_slice())
    }
}

//! Sanathanan and Koerner's iteration (IEEE Transactions on Automatic Control 8, 1963): a transfer
//! function with three poles and two zeros from spectra of input U and output Y,
//!
//! ```text
//! A(s) Y = B(s) U + T(s),   A = s³ + a2 s² + a1 s + a0,   B = b2 s² + b1 s + b0
//! ```
//!
//! by linear least squares. Each iteration is weighted with 1/|A| of the previous one. T, of the
//! same degree as B, represents the leakage of the record's ends.

use nalgebra::{DMatrix, DVector};

use fourier::Complex64;

/// Spectra of input and output at one frequency, which give one equation of the fit.
///
/// - `s`: complex frequency jω, divided by a frequency near the middle of all lines, so that the
///   equations are well conditioned.
/// - `scale`: divisor that weights the equation.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    pub s: Complex64,
    pub input: Complex64,
    pub output: Complex64,
    pub scale: f64,
}

/// Coefficients of a transfer function of the scaled frequency [`Line::s`].
///
/// - `numerator`: b2, b1, b0 of b2 s² + b1 s + b0.
/// - `denominator`: a2, a1, a0 of s³ + a2 s² + a1 s + a0.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients {
    pub numerator: [f64; 3],
    pub denominator: [f64; 3],
}

impl Coefficients {
    pub fn response(&self, s: Complex64) -> Complex64 {
        let [b2, b1, b0] = self.numerator;
        (b2 * s * s + b1 * s + b0) / self.denominator_at(s)
    }

    fn denominator_at(&self, s: Complex64) -> Complex64 {
        let [a2, a1, a0] = self.denominator;
        s * s * s + a2 * s * s + a1 * s + a0
    }
}

/// Fits a transfer function to `lines` in `rounds` iterations. If `transient` is true, the fit has
/// an additional term for the transient, because the ends of a record that is not periodic leak
/// into its spectra. `solve` solves the linear equations of the last iteration and may compute
/// further results of type `S`, such as a covariance. Returns `None` if there are too few lines.
pub fn fit<S>(
    lines: &[Line],
    transient: bool,
    rounds: usize,
    solve: impl Fn(DMatrix<f64>, DVector<f64>) -> Option<(DVector<f64>, S)>,
) -> Option<(Coefficients, S)> {
    // The unknowns are the coefficients of A and B, and of T if it is not left out.
    let unknowns = if transient { 9 } else { 6 };
    let rows = 2 * lines.len();
    if rows < 2 * unknowns {
        return None;
    }
    let mut found = Coefficients { numerator: [0.0; 3], denominator: [0.0; 3] };
    let mut said = None;
    for _ in 0..rounds {
        let (mut a, mut b) = (DMatrix::zeros(rows, unknowns), DVector::zeros(rows));
        for (k, &Line { s, input, output, scale }) in lines.iter().enumerate() {
            let weight = 1.0 / (found.denominator_at(s).norm() * scale);
            let of_transient = transient.then_some(Complex64::ONE);
            let factors = [input].into_iter().chain(of_transient).chain([-output]);
            let entries = factors.flat_map(|x| [x * s * s, x * s, x]);
            for (j, entry) in entries.enumerate() {
                (a[(2 * k, j)], a[(2 * k + 1, j)]) = (entry.re * weight, entry.im * weight);
            }
            let right = output * s * s * s * weight;
            (b[2 * k], b[2 * k + 1]) = (right.re, right.im);
        }
        let (x, beside) = solve(a, b)?;
        let a0 = unknowns - 1;
        found = Coefficients {
            numerator: [x[0], x[1], x[2]],
            denominator: [x[a0 - 2], x[a0 - 1], x[a0]],
        };
        said = Some(beside);
    }
    Some((found, said?))
}

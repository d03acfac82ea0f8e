//! A transfer function with three poles and two zeros, fitted to the spectra of a whole record
//! together with the leakage of the record's ends (Pintelon and Schoukens, *System Identification:
//! A Frequency Domain Approach*, 2nd ed., 2012, chapter 6). Without windows, torque U and rate Y of
//! a linear plant H = B/A obey
//!
//! ```text
//! A(s) Y = B(s) U + T(s),   s = jω, T of the degree of B
//! ```
//!
//! for any sweep rate and any duration of ringing. For a linear plant the fit therefore separates an
//! antiresonance and a resonance that are closer than the record's resolution. The squared residuals are
//! relative to |Y|, and weighted with the denominator of the preceding iteration (Sanathanan and Koerner).

use std::f64::consts::TAU;

use fourier::Forward;
use nalgebra::{DMatrix, DVector};

use crate::features::{Deviations, Features};
use crate::response::FrequencyResponse;
use crate::sanathanan_koerner::{self, Coefficients, Line};
use fourier::Complex64;

/// Largest number of spectral lines in a fit. If the band has more lines, equally spaced lines are
/// selected, so that the time of a fit does not grow with the length of the record.
const POINTS: usize = 1500;
const LEAST: usize = 20;
const ROUNDS: usize = 20;

type Spread = [[f64; 6]; 9];

/// Transfer function from torque to rate, fitted to the spectra of a record.
///
/// - `unit`: centre of the band, rad/s. The coefficients belong to the frequency variable s divided
///   by `unit`.
/// - `misfit`: root mean square of the fit's residual, relative to the spectrum of the rate.
/// - `spread`: square root of the covariance matrix of numerator and denominator, with one column
///   for each unknown of the fit.
#[derive(Clone, Debug)]
pub struct Rational {
    unit: f64,
    coefficients: Coefficients,
    pub misfit: f64,
    spread: Spread,
}

impl Rational {
    /// Fits a transfer function to the spectra of torque, N·m, and rate, rad/s, between the
    /// frequencies `from` and `to`, Hz. The signals are sampled every `step` seconds. Returns
    /// `None` if the spectra have too few lines in this band.
    pub fn fit(step: f64, torque: &[f64], rate: &[f64], (from, to): (f64, f64)) -> Option<Self> {
        let count = torque.len();
        let bin = 1.0 / (step * count as f64);
        let bins = (from / bin).ceil() as usize..=((to / bin) as usize).min(count / 2);
        let every = (bins.clone().count() / POINTS).max(1);
        let transform = Forward::new(count);
        let spectrum =
            |signal: &[f64]| transform.transform(signal.iter().map(|x| x / count as f64).collect());
        let (u, y) = (spectrum(torque), spectrum(rate));
        let unit = TAU * (from * to).sqrt();
        let lines: Vec<Line> = bins
            .step_by(every)
            .filter(|k| y[*k].norm_sqr() > 0.0)
            .map(|k| Line {
                s: Complex64::new(0.0, TAU * k as f64 * bin / unit),
                input: u[k],
                output: y[k],
                scale: y[k].norm(),
            })
            .collect();
        if lines.len() < LEAST {
            return None;
        }
        let (coefficients, (misfit, spread)) =
            sanathanan_koerner::fit(&lines, true, ROUNDS, solved)?;
        misfit.is_finite().then_some(Rational { unit, coefficients, misfit, spread })
    }

    /// Returns the relative standard deviation of the fitted response at `frequencies`, Hz, and the
    /// standard deviations of its antiresonance and resonance. They are computed by finite
    /// differences in the directions of the columns of the covariance's square root.
    pub fn deviations(&self, frequencies: &[f64]) -> (Vec<f64>, Deviations) {
        let nominal = self.frequency_response(frequencies);
        let found = Features::find(&nominal);
        let mut squares = vec![0.0; frequencies.len()];
        let mut moved = [Some(0.0), Some(0.0)];
        for column in &self.spread {
            let mut other = self.coefficients;
            for i in 0..3 {
                other.numerator[i] += column[i];
                other.denominator[i] += column[i + 3];
            }
            let response = self.response(other, frequencies);
            for (i, square) in squares.iter_mut().enumerate() {
                let (h, nominal) = (response.response[i].norm(), nominal.response[i].norm());
                *square += (h / nominal).ln().powi(2);
            }
            let features = Features::find(&response);
            for (sum, (new, old)) in
                moved.iter_mut().zip([(features.f_res, found.f_res), (features.f_dip, found.f_dip)])
            {
                *sum = (|| Some((*sum)? + (new? - old?).powi(2)))();
            }
        }
        let [f_res, f_dip] = moved.map(|sum| sum.map(f64::sqrt));
        (squares.into_iter().map(f64::sqrt).collect(), Deviations { f_res, f_dip })
    }

    pub fn frequency_response(&self, frequencies: &[f64]) -> FrequencyResponse {
        self.response(self.coefficients, frequencies)
    }

    fn response(&self, of: Coefficients, frequencies: &[f64]) -> FrequencyResponse {
        let response =
            frequencies.iter().map(|f| of.response(Complex64::new(0.0, TAU * f / self.unit)));
        FrequencyResponse { response: response.collect(), frequency: frequencies.to_vec() }
    }
}

/// Solves the linear least-squares problem `a` x = `b` of nine unknowns. Also returns the root mean
/// square of the residual, and those rows of a square root of the covariance that belong to the
/// first three and the last three unknowns.
fn solved(mut a: DMatrix<f64>, b: DVector<f64>) -> Option<(DVector<f64>, (f64, Spread))> {
    let sizes = DVector::from_iterator(9, a.column_iter().map(|column| column.norm().max(1e-300)));
    for (mut column, size) in a.column_iter_mut().zip(&sizes) {
        column /= *size;
    }
    // Householder's method, because the normal equations would lose half of the digits.
    let qr = a.clone().qr();
    let x = qr.r().solve_upper_triangular(&(qr.q().transpose() * &b))?;
    let rows = b.len() as f64;
    let misfit = (&a * &x - &b).norm() / rows.sqrt();
    // the covariance of x is misfit² (RᵀR)⁻¹
    let root = qr.r().try_inverse()?;
    let scale = misfit * (rows / (rows - 9.0)).sqrt();
    let column = |j| [0, 1, 2, 6, 7, 8].map(|i| scale * root[(i, j)] / sizes[i]);
    Some((x.component_div(&sizes), (misfit, std::array::from_fn(column))))
}

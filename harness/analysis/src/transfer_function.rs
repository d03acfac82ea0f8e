//! The thesis's parametric model (6.1.3): a transfer function with three poles and two zeros, fitted to a frequency
//! response, and the quality of the fit (6.3.2).
//!
//! ```text
//! H(s) = (b2 s² + b1 s + b0) / ((s + p) (s² + 2 ζ ω s + ω²))
//! ```
//!
//! [Sanathanan and Koerner's iteration](crate::sanathanan_koerner) gives the start. Levenberg–Marquardt then
//! minimises Σ |H_meas − H_mod|², on which the thesis's Fit_freq is based. p, ω and ζ are fitted as logarithms, so
//! that the poles are stable.

use std::f64::consts::TAU;

use levenberg_marquardt::LevenbergMarquardt;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix5, Vector3};

use crate::exponential::exponential;
use crate::features::Features;
use crate::least_squares::{minimise_by, smallest};
use crate::response::FrequencyResponse;
use crate::sanathanan_koerner::{self, Coefficients, Line};
use crate::statistics::mean;
use fourier::Complex64;

/// A transfer function with three stable poles and two zeros, with s in rad/s.
///
/// - `numerator`: b2, b1, b0 of b2 s² + b1 s + b0.
/// - `real_pole`: rate of the real pole, 1/s.
/// - `pole_omega`: natural frequency of the pair of poles, rad/s.
/// - `pole_damping`: damping ratio of the pair of poles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferFunction {
    pub numerator: [f64; 3],
    pub real_pole: f64,
    pub pole_omega: f64,
    pub pole_damping: f64,
}

impl TransferFunction {
    /// Returns the natural frequency of the two zeros (the antiresonance), Hz, or `None` if they
    /// are real with opposite signs.
    pub fn zero_frequency(&self) -> Option<f64> {
        let [b2, _, b0] = self.numerator;
        (b0 / b2 >= 0.0).then(|| (b0 / b2).sqrt() / TAU)
    }

    /// Returns the damping ratio of the two zeros, or `None` if the zeros are real with opposite
    /// signs or one of them is 0.
    pub fn zero_damping(&self) -> Option<f64> {
        let [b2, b1, b0] = self.numerator;
        (b0 / b2 > 0.0).then(|| b1 / b2 / (2.0 * (b0 / b2).sqrt()))
    }

    /// Returns the coefficients a2, a1, a0 of the denominator s³ + a2 s² + a1 s + a0.
    pub fn denominator(&self) -> [f64; 3] {
        let (p, w, z) = (self.real_pole, self.pole_omega, self.pole_damping);
        [p + 2.0 * z * w, w * w + 2.0 * z * w * p, w * w * p]
    }

    pub fn pole_frequency(&self) -> f64 {
        self.pole_omega / TAU
    }

    pub fn response(&self, frequency: f64) -> Complex64 {
        let s = Complex64::new(0.0, TAU * frequency);
        let [b2, b1, b0] = self.numerator;
        (b2 * s * s + b1 * s + b0) / ((s + self.real_pole) * self.pair(s))
    }

    fn pair(&self, s: Complex64) -> Complex64 {
        let w = self.pole_omega;
        s * s + 2.0 * self.pole_damping * w * s + w * w
    }

    /// Fits a transfer function to a measured frequency response. The search runs from two starts,
    /// because one alone may miss a narrow resonance, and the better fit is returned. Returns
    /// `None` if the response is empty.
    pub fn fit(measured: &FrequencyResponse) -> Option<Self> {
        let starts = [by_sanathanan_koerner(measured), at_the_resonance(measured)];
        let fitted = starts.into_iter().flatten().filter_map(|start| {
            let unit = start.pole_omega;
            let residuals = |x: &[f64]| Self::from_unknowns(x, unit).residuals(measured);
            let derivatives =
                |x: &[f64]| Some(Self::from_unknowns(x, unit).derivatives(measured, unit));
            let method = LevenbergMarquardt::new().with_patience(200);
            let found = minimise_by(&method, &residuals, &derivatives, &start.unknowns(unit));
            let fitted = Self::from_unknowns(&found.x, unit);
            (found.cost.is_finite() && fitted.pole_omega.is_finite())
                .then_some((found.cost, fitted))
        });
        // Of two almost equally good fits the first one is returned, so that rounding errors do
        // not decide between them.
        let best = fitted.reduce(|a, b| if b.0 < 0.999 * a.0 { b } else { a });
        best.map(|(_, fitted)| fitted)
    }

    /// Returns the share of the measured response that the model explains in the frequency domain,
    /// %: 100 (1 − |H_meas − H_mod| /
    /// |H_meas − mean H_meas|) with the measured response H_meas and the model's response H_mod
    /// (Rubaga's thesis, equation 6.15).
    pub fn fit_frequency(&self, measured: &FrequencyResponse) -> f64 {
        let count = measured.response.len() as f64;
        let mean = measured.response.iter().sum::<Complex64>() / count;
        let (mut miss, mut spread) = (0.0, 0.0);
        for (&f, h) in measured.frequency.iter().zip(&measured.response) {
            miss += (h - self.response(f)).norm_sqr();
            spread += (h - mean).norm_sqr();
        }
        100.0 * (1.0 - (miss / spread).sqrt())
    }

    /// Simulates the output of the model, which starts from rest, for an input that is linear
    /// between samples `step` seconds apart. The result is exact, because it uses the matrix
    /// exponential of the state and the input's value and slope.
    pub fn simulate(&self, step: f64, input: &[f64]) -> Vec<f64> {
        let (p, w, z) = (self.real_pole, self.pole_omega, self.pole_damping);
        let [b2, b1, b0] = self.numerator;
        // Controllable form of s³ + a2 s² + a1 s + a0.
        let (a2, a1, a0) = (p + 2.0 * z * w, w * w + 2.0 * z * w * p, w * w * p);
        let mut flow = Matrix5::zeros();
        (flow[(0, 1)], flow[(1, 2)], flow[(3, 4)]) = (1.0, 1.0, 1.0);
        (flow[(2, 0)], flow[(2, 1)], flow[(2, 2)], flow[(2, 3)]) = (-a0, -a1, -a2, 1.0);
        let flow = flow * step;
        let flow = exponential(flow, flow.abs().sum(), |flow| flow.exp());
        let a = flow.fixed_view::<3, 3>(0, 0).into_owned();
        let (value, slope): (Vector3<f64>, Vector3<f64>) =
            (flow.fixed_view::<3, 1>(0, 3).into(), flow.fixed_view::<3, 1>(0, 4).into());
        let out = Vector3::new(b0, b1, b2);
        let mut x = Vector3::zeros();
        let mut answer = vec![0.0];
        for pair in input.windows(2) {
            x = a * x + value * pair[0] + slope * ((pair[1] - pair[0]) / step);
            answer.push(out.dot(&x));
        }
        answer.truncate(input.len());
        answer
    }

    /// Returns the free response of the model (the response without input) that is closest to
    /// `signal`, which is sampled every `step` seconds, in the sense of least squares over the
    /// initial state.
    ///
    /// The initial state is needed because the measured band hardly determines the real pole, whose
    /// time constant may be fitted as a minute or an hour. If the model started from rest, the
    /// torque's first half cycle would leave an offset of the model's rate for the whole record,
    /// whereas the offset of the hub's rate decays in seconds. MATLAB's `compare` estimates the
    /// initial state for the same reason.
    pub fn free_answer(&self, step: f64, signal: &[f64]) -> Vec<f64> {
        let decay = self.pole_damping * self.pole_omega;
        let turn = self.pole_omega * (1.0 - self.pole_damping.powi(2)).max(0.0).sqrt();
        // From sample to sample the response decays and rotates by the same factor. This recurrence is accurate to
        // 1e-10 over a million samples, and takes a tenth of the time.
        let (slower, turned) = (
            (-self.real_pole * step).exp(),
            Complex64::from_polar((-decay * step).exp(), turn * step),
        );
        let answers = || {
            let (mut slow, mut pair) = (1.0, Complex64::ONE);
            (0..signal.len()).map(move |k| {
                // If the pole pair does not oscillate, the second free response is t e^(−decay t); a pair of real
                // poles is treated in this way, too.
                let second = if turn > 0.0 { pair.im } else { k as f64 * step * pair.re };
                let row = Vector3::new(slow, pair.re, second);
                slow *= slower;
                pair *= turned;
                row
            })
        };
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (row, value) in answers().zip(signal) {
            normal += row * row.transpose();
            right += row * *value;
        }
        let Some(inverse) = normal.try_inverse() else { return vec![0.0; signal.len()] };
        let weights = inverse * right;
        answers().map(|row| weights.dot(&row)).collect()
    }
}

/// Returns the share of the measured signal y that the model's output ŷ reproduces, %: 100 (1 − |y
/// − ŷ| / |y − mean y|) (Rubaga's thesis, equation 6.14). It is 100 for a perfect model and 0 for a
/// constant.
pub fn fit_time(measured: &[f64], model: &[f64]) -> f64 {
    let mean = mean(measured);
    let miss: f64 = measured.iter().zip(model).map(|(y, m)| (y - m).powi(2)).sum();
    let spread: f64 = measured.iter().map(|y| (y - mean).powi(2)).sum();
    100.0 * (1.0 - (miss / spread).sqrt())
}

/// Returns start values for the search: lightly damped poles at the measured resonance, and the
/// zeros that fit best with these poles. They are needed because the weights in Sanathanan and
/// Koerner's iteration, which gives the other start values, may hide a narrow resonance.
fn at_the_resonance(measured: &FrequencyResponse) -> Option<TransferFunction> {
    let pole_omega = TAU * Features::find(measured).f_res?;
    let (real_pole, pole_damping) = (0.01 * pole_omega, 0.01);
    let start =
        TransferFunction { numerator: [1.0, 0.0, 0.0], real_pole, pole_omega, pole_damping };
    let count = measured.frequency.len();
    let (mut a, mut b) = (DMatrix::zeros(2 * count, 3), DVector::zeros(2 * count));
    for (k, (&f, h)) in measured.frequency.iter().zip(&measured.response).enumerate() {
        let s = Complex64::new(0.0, TAU * f / pole_omega);
        // response N/D of the start with the numerator N = 1
        let over = start.response(f) / (s * s * pole_omega * pole_omega);
        for (j, power) in [s * s, s, Complex64::ONE].into_iter().enumerate() {
            let entry = power * over;
            (a[(2 * k, j)], a[(2 * k + 1, j)]) = (entry.re, entry.im);
        }
        (b[2 * k], b[2 * k + 1]) = (h.re, h.im);
    }
    let x = smallest(a, &b, 1e-14)?;
    let numerator = [x[0] / pole_omega.powi(2), x[1] / pole_omega, x[2]];
    Some(TransferFunction { numerator, ..start })
}

const ROUNDS: usize = 30;

/// Returns start values for the search from Sanathanan and Koerner's iteration. In this iteration
/// the input has the constant spectrum 1, and the spectrum of the output is the measured response.
fn by_sanathanan_koerner(measured: &FrequencyResponse) -> Option<TransferFunction> {
    let count = measured.frequency.len();
    let middle = TAU * measured.frequency.get(count / 2)?;
    let points = measured.frequency.iter().zip(&measured.response);
    let lines: Vec<Line> = points
        .map(|(&f, &h)| Line {
            s: Complex64::new(0.0, TAU * f / middle),
            input: Complex64::ONE,
            output: h,
            scale: 1.0,
        })
        .collect();
    // If the response does not determine all coefficients, the solution with the smallest norm is used.
    let solve = |a: DMatrix<f64>, b: DVector<f64>| Some((smallest(a, &b, 1e-14)?, ()));
    let (Coefficients { numerator: [b2, b1, b0], denominator }, ()) =
        sanathanan_koerner::fit(&lines, false, ROUNDS, solve)?;
    let (p, w, z) = stable_poles(denominator)?;
    // Converted back to rad/s; the numerator has the unit of H times s.
    Some(TransferFunction {
        numerator: [b2 * middle, b1 * middle.powi(2), b0 * middle.powi(3)],
        real_pole: p * middle,
        pole_omega: w * middle,
        pole_damping: z,
    })
}

/// Returns the poles of 1/(s³ + c2 s² + c1 s + c0): the real pole, 1/s, and the natural frequency,
/// rad/s, and damping ratio of the pair. Unstable poles are mirrored to the left half plane.
/// Returns `None` if the roots cannot be computed.
fn stable_poles([c2, c1, c0]: [f64; 3]) -> Option<(f64, f64, f64)> {
    let cubic = |s: f64| ((s + c2) * s + c1) * s + c0;
    // One real root lies within Cauchy's bound; it is found by bisection.
    let bound = 1.0 + c2.abs().max(c1.abs()).max(c0.abs());
    let (mut low, mut high) = (-bound, bound);
    for _ in 0..200 {
        let middle = (low + high) / 2.0;
        if cubic(middle) > 0.0 { high = middle } else { low = middle }
    }
    let root = (low + high) / 2.0;
    // s³ + ... = (s − root)(s² + d1 s + d0)
    let (d1, d0) = (c2 + root, c1 + root * (c2 + root));
    let least = 1e-6;
    let w = d0.abs().sqrt().max(least);
    let damping = (d1.abs() / (2.0 * w)).max(least);
    (root.is_finite() && w.is_finite()).then_some((root.abs().max(least), w, damping))
}

/// Conversions to and from the variables of the search: b2, b1 and b0 divided by powers of `unit`,
/// which is the pole frequency of the start, and the logarithms of the real pole, of the pole
/// frequency and of the damping ratio.
impl TransferFunction {
    fn from_unknowns(x: &[f64], unit: f64) -> Self {
        TransferFunction {
            numerator: [x[0] * unit, x[1] * unit.powi(2), x[2] * unit.powi(3)],
            real_pole: x[3].exp(),
            pole_omega: x[4].exp(),
            pole_damping: x[5].exp(),
        }
    }

    fn unknowns(&self, unit: f64) -> [f64; 6] {
        let [b2, b1, b0] = self.numerator;
        let [p, w, z] = [self.real_pole, self.pole_omega, self.pole_damping].map(f64::ln);
        [b2 / unit, b1 / unit.powi(2), b0 / unit.powi(3), p, w, z]
    }

    fn residuals(&self, measured: &FrequencyResponse) -> Vec<f64> {
        let points = measured.frequency.iter().zip(&measured.response);
        let misses = points.map(|(&f, h)| self.response(f) - h);
        misses.flat_map(|miss| [miss.re, miss.im]).collect()
    }

    fn derivatives(&self, measured: &FrequencyResponse, unit: f64) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(2 * measured.frequency.len(), 6);
        for (k, &f) in measured.frequency.iter().enumerate() {
            let s = Complex64::new(0.0, TAU * f);
            let (h, real, pair) = (self.response(f), s + self.real_pole, self.pair(s));
            let denominator = real * pair;
            let (w, z) = (self.pole_omega, self.pole_damping);
            let columns = [
                s * s * unit / denominator,
                s * unit.powi(2) / denominator,
                Complex64::from(unit.powi(3)) / denominator,
                -h / real * self.real_pole,
                -h / pair * (2.0 * z * s + 2.0 * w) * w,
                -h / pair * (2.0 * w * s) * z,
            ];
            for (j, column) in columns.into_iter().enumerate() {
                (jacobian[(2 * k, j)], jacobian[(2 * k + 1, j)]) = (column.re, column.im);
            }
        }
        jacobian
    }
}

//! Allan deviation of a gyro at rest, and the noise parameters that it determines (IEEE Std 952).
//!
//! | term | Allan variance | appearance of the deviation |
//! | --- | --- | --- |
//! | white noise, angle random walk N | N²/τ | slope −1/2 |
//! | flicker noise, bias instability B | (2 ln 2/π) B² | flat at 0.664 B |
//! | rate random walk K | K² τ/3 | slope +1/2 |
//! | rate ramp R | R² τ²/2 | slope +1, a drift of R rad/s² |
//! | first-order Gauss–Markov bias | see below | a peak |
//!
//! A first-order Gauss–Markov bias b has E\[b(t) b(t+s)\] = sigma² exp(−|s|/T). Its Allan deviation follows from
//! the averages b1, b2 over two neighbouring intervals tau = x T, with
//!
//! ```text
//! var b1      = 2 sigma² (x − 1 + e^−x) / x²
//! cov(b1, b2) =   sigma² (1 − e^−x)² / x²
//! sigma_A²(tau) = ½ E[(b2 − b1)²] = var b1 − cov(b1, b2) = sigma² (2x − 3 + 4 e^−x − e^−2x) / x²
//! ```
//!
//! The deviation rises with slope +1/2, has its maximum 0.617 sigma at tau = 1.89 T, and falls with slope −1/2,
//! without a plateau. The *bias instability* B in data sheets describes flicker noise. The FMU's Gauss–Markov
//! bias has sigma = B/0.664 (thesis 5.5). Its maximum is therefore 0.617/0.664 B = 0.93 B, and B is 0.664/0.617 =
//! 1.076 times the maximum.

mod covariance;
mod fit;

pub use self::covariance::Covariance;
pub use self::fit::{Estimate, Fit, Octaves, Outlier};

use std::f64::consts::{LN_2, PI};

/// Height of the flat part of the Allan deviation of flicker noise, relative to the bias
/// instability B. The FMU's Gauss–Markov bias has the standard deviation B/0.664.
pub const FLICKER: f64 = 0.664;

const PER_DECADE: f64 = 15.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub tau: f64,
    pub variance: f64,
}

/// Smallest number of averaging intervals in a record: Allan variances are computed for averaging
/// times up to a tenth of the record, because at longer times too few averages remain.
const LONGEST: usize = 10;

/// Returns the overlapping Allan variance of samples that are `step` seconds apart. The averaging
/// times are equally spaced in their logarithm, from one sample to a tenth of the record.
pub fn variances(step: f64, samples: &[f64]) -> Vec<Point> {
    overlapping(step, samples, factors(samples.len() / LONGEST))
}

fn overlapping(step: f64, samples: &[f64], factors: impl IntoIterator<Item = usize>) -> Vec<Point> {
    // sums[k] is the sum of the first k samples
    let mut sums = vec![0.0; samples.len() + 1];
    for (k, sample) in samples.iter().enumerate() {
        sums[k + 1] = sums[k] + sample;
    }
    factors
        .into_iter()
        .map(|m| {
            let differences =
                (2 * m..sums.len()).map(|k| sums[k] - 2.0 * sums[k - m] + sums[k - 2 * m]);
            let sum: f64 = differences.map(|d| d * d).sum();
            let count = (sums.len() - 2 * m) as f64;
            Point { tau: m as f64 * step, variance: sum / (2.0 * (m as f64).powi(2) * count) }
        })
        .collect()
}

fn factors(last: usize) -> Vec<usize> {
    let count = ((last.max(1) as f64).log10() * PER_DECADE).floor() as usize;
    let mut factors: Vec<usize> =
        (0..=count).map(|i| 10f64.powf(i as f64 / PER_DECADE).round() as usize).collect();
    factors.dedup();
    factors.retain(|m| *m <= last);
    factors
}

/// Terms of a gyro's noise. The coefficient of each term in the Allan variance is a square: N²
/// (white noise), B² (flicker noise), K² (rate random walk), R² (rate ramp), or the variance of a
/// Gauss–Markov bias.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Term {
    White,
    Flicker,
    Walk,
    Ramp,
    Markov,
}

impl Term {
    /// Returns the Allan variance that this term contributes at the averaging time `tau`, s, if its
    /// coefficient is 1. `time` is the correlation time of the Gauss–Markov bias, s; other terms do
    /// not use it.
    fn variance(self, tau: f64, time: f64) -> f64 {
        match self {
            Term::White => 1.0 / tau,
            Term::Flicker => 2.0 * LN_2 / PI,
            Term::Walk => tau / 3.0,
            Term::Ramp => tau * tau / 2.0,
            Term::Markov => markov(tau / time),
        }
    }
}

/// Noise of a gyro. A term that is absent is 0.
///
/// - `arw`: angle random walk N, rad/s/√Hz.
/// - `flicker`: bias instability B of flicker noise, rad/s.
/// - `rrw`: rate random walk K, rad/s/√s.
/// - `ramp`: rate ramp R, rad/s².
/// - `bias_instability`: 0.664 times the standard deviation of a Gauss–Markov bias, rad/s.
/// - `bias_time`: correlation time of this bias, s; it has no meaning if `bias_instability` is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    pub arw: f64,
    pub flicker: f64,
    pub rrw: f64,
    pub ramp: f64,
    pub bias_instability: f64,
    pub bias_time: f64,
}

impl Default for Noise {
    fn default() -> Self {
        let (arw, flicker, rrw, ramp, bias_instability) = (0.0, 0.0, 0.0, 0.0, 0.0);
        Noise { arw, flicker, rrw, ramp, bias_instability, bias_time: 100.0 }
    }
}

impl Noise {
    fn coefficient(&self, term: Term) -> f64 {
        match term {
            Term::White => self.arw.powi(2),
            Term::Flicker => self.flicker.powi(2),
            Term::Walk => self.rrw.powi(2),
            Term::Ramp => self.ramp.powi(2),
            Term::Markov => (self.bias_instability / FLICKER).powi(2),
        }
    }

    fn parameter(&mut self, term: Term) -> &mut f64 {
        match term {
            Term::White => &mut self.arw,
            Term::Flicker => &mut self.flicker,
            Term::Walk => &mut self.rrw,
            Term::Ramp => &mut self.ramp,
            Term::Markov => &mut self.bias_instability,
        }
    }

    pub fn terms(&self) -> Vec<Term> {
        let all = [Term::White, Term::Flicker, Term::Walk, Term::Ramp, Term::Markov];
        all.into_iter().filter(|term| self.coefficient(*term) > 0.0).collect()
    }

    /// Returns the Allan variance of this noise, (rad/s)², at the averaging time `tau`, s: the sum
    /// of the variances of its terms.
    pub fn variance(&self, tau: f64) -> f64 {
        let part = |term: Term| self.coefficient(term) * term.variance(tau, self.bias_time);
        self.terms().into_iter().map(part).sum()
    }
}

/// Returns the Allan variance of a Gauss–Markov process, divided by the variance of the process.
/// `x` is the averaging time divided by the correlation time.
fn markov(x: f64) -> f64 {
    // exp_m1 avoids cancellation: for small x, only (2/3) x³ remains of the terms
    (2.0 * x + 4.0 * (-x).exp_m1() - (-2.0 * x).exp_m1()) / (x * x)
}

//! Covariance of Allan variances at several averaging times, for Gaussian noise.
//!
//! The overlapping estimate A_m of the Allan variance at the averaging time τ_m = m Δt is the mean of D_m²/(2τ_m²)
//! over a record, where D_m(t) = θ(t + τ_m) − 2θ(t) + θ(t − τ_m) are the M_m second differences of the integrated rate
//! θ. For Gaussian noise
//!
//! ```text
//! cov(A_m, A_n) = Σ_k Σ_l 2 C_mn(l − k)² / (4 τ_m² τ_n² M_m M_n),   C_mn(s) = E[D_m(t) D_n(t + s)]
//! ```
//!
//! C_mn follows from the generalized autocovariance of θ (C. A. Greenhall and W. J. Riley, *Uncertainty of stability variances
//! based on finite differences*, PTTI 2003): −N²|s|/2, B² s² ln|s|/2π, K²|s|³/12, −σ²T²(x − 1 + e^−x) with x = |s|/T.
//! Equivalent degrees of freedom are 2 A²/var A.

use nalgebra::DMatrix;

use super::Term;
use std::f64::consts::PI;

/// Number of lags per averaging time in the sum over lags that gives the covariance of two Allan
/// variances. If an averaging time has at most this many samples, the sum contains every lag and is
/// exact.
const PER_TIME: usize = 8;
/// Longest lag in the sum that gives the covariance of two Allan variances, as a multiple of the
/// sum of their averaging times. Beyond the multiple 1 only flicker noise contributes, and its
/// contributions fall with the square of the lag.
const RANGE: usize = 2;
/// Largest ratio of two averaging times whose Allan variances are treated as correlated. For larger
/// ratios the covariance is set to 0.
const RATIO: usize = 32;

/// Part of the covariance matrix of Allan variances that does not depend on the coefficients of the
/// noise. For each pair of averaging times and each lag it contains the weight of the lag. It also
/// contains, for each term of the noise with the coefficient 1, the covariance of the second
/// differences of the gyro's angle over the two averaging times.
pub struct Covariance {
    terms: Vec<Term>,
    size: usize,
    pairs: Vec<Pair>,
}

struct Pair {
    places: (usize, usize),
    counts: Vec<f64>,
    scale: f64,
    of_terms: Vec<Vec<f64>>,
}

/// Returns the generalized autocovariance of the gyro's angle at `lag`, s, for one term of the
/// noise with the coefficient 1. `time` is the correlation time of the Gauss–Markov bias, s.
fn angle(term: Term, lag: f64, time: f64) -> f64 {
    let s = lag.abs();
    match term {
        Term::White => -s / 2.0,
        Term::Flicker if s > 0.0 => s * s * s.ln() / (2.0 * PI),
        Term::Walk => s * s * s / 12.0,
        Term::Markov => -time * time * ((-s / time).exp_m1() + s / time),
        Term::Flicker | Term::Ramp => 0.0,
    }
}

impl Covariance {
    /// Precomputes the data for records of `count` samples that are `step` seconds apart. `factors`
    /// are the numbers of samples per average, ascending; `terms` are the terms of the noise;
    /// `time` is the correlation time of the Gauss–Markov bias, s.
    pub fn new(step: f64, count: usize, factors: &[usize], terms: &[Term], time: f64) -> Self {
        let mut pairs = Vec::new();
        for (i, &m) in factors.iter().enumerate() {
            for (j, &n) in factors.iter().enumerate().skip(i) {
                if n > RATIO * m {
                    break;
                }
                pairs.push(pair((i, j), (m, n), (step, count), terms, time));
            }
        }
        Covariance { terms: terms.to_vec(), size: factors.len(), pairs }
    }

    /// Returns the covariance matrix of the Allan variances at all averaging times. `coefficients`
    /// are the coefficients of the noise, such as N² and B², in the order of the `terms` in
    /// [`Covariance::new`].
    pub fn matrix(&self, coefficients: &[f64]) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.size, self.size);
        let ramp = self.terms.iter().zip(coefficients).find(|(term, _)| **term == Term::Ramp);
        let ramp = ramp.map_or(0.0, |(_, coefficient)| *coefficient);
        for pair in &self.pairs {
            let (mut squares, mut sum) = (0.0, 0.0);
            for (k, count) in pair.counts.iter().enumerate() {
                let c: f64 = pair.of_terms.iter().zip(coefficients).map(|(t, a)| a * t[k]).sum();
                squares += count * c * c;
                sum += count * c;
            }
            // A ramp shifts the differences by R τ², and the product of this shift with the noise has a
            // variance of its own.
            let value = pair.scale * squares + ramp * sum;
            let (i, j) = pair.places;
            matrix[(i, j)] = value;
            matrix[(j, i)] = value;
        }
        matrix
    }
}

fn pair(
    places: (usize, usize),
    (m, n): (usize, usize),
    (step, count): (f64, usize),
    terms: &[Term],
    time: f64,
) -> Pair {
    let by = (m / PER_TIME).max(1);
    let last = (RANGE * (m + n) / by) as i64;
    let lags: Vec<i64> = (-last..=last).map(|k| k * by as i64).collect();
    let (m, n, count) = (m as i64, n as i64, count as i64);
    // The centres of the differences run from m to count − m, and from n to count − n.
    let total = ((count - 2 * m + 1) * (count - 2 * n + 1)) as f64;
    let counts = lags.iter().map(|s| {
        let overlap = (count - m).min(count - n - s) - m.max(n - s) + 1;
        overlap.max(0) as f64 * by as f64 / total
    });
    let difference = [(-1, 1.0), (0, -2.0), (1, 1.0)];
    let of_terms = terms.iter().map(|term| {
        let of_lag = |s: &i64| -> f64 {
            let products = difference.iter().flat_map(|(u, a)| {
                difference.iter().map(move |(v, b)| {
                    a * b * angle(*term, (s + v * n - u * m) as f64 * step, time)
                })
            });
            products.sum()
        };
        lags.iter().map(of_lag).collect()
    });
    let (tau_m, tau_n) = (m as f64 * step, n as f64 * step);
    Pair {
        places,
        of_terms: of_terms.collect(),
        counts: counts.collect(),
        scale: 1.0 / (2.0 * tau_m * tau_m * tau_n * tau_n),
    }
}

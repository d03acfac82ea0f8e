//! Allan deviation of a gyro at rest, and the noise parameters that it shows (IEEE Std 952).
//!
//! White noise of density N has the Allan deviation N/sqrt(tau), with the slope −1/2. A first-order
//! Gauss–Markov bias b has E\[b(t) b(t+s)\] = sigma² exp(−|s|/T). Its Allan deviation follows from
//! the averages b1, b2 over two neighbouring intervals tau = x T, with
//!
//! ```text
//! var b1      = 2 sigma² (x − 1 + e^−x) / x²
//! cov(b1, b2) =   sigma² (1 − e^−x)² / x²
//! sigma_A²(tau) = ½ E[(b2 − b1)²] = var b1 − cov(b1, b2) = sigma² (2x − 3 + 4 e^−x − e^−2x) / x²
//! ```
//!
//! The deviation rises with slope +1/2, has its maximum 0.617 sigma at tau = 1.89 T, and falls with slope −1/2, without
//! a plateau. The *bias instability* B of data sheets is that of flicker noise, whose Allan deviation is constant at
//! sqrt(2 ln 2/pi) B = 0.664 B. The FMU's bias has sigma = B/0.664 (thesis 5.5). The maximum is therefore 0.617/0.664
//! B = 0.93 B, and B is 0.664/0.617 = 1.076 times the maximum.

/// Flat part of the Allan deviation of flicker noise over B; the FMU's bias has sigma = B/0.664.
pub const FLICKER: f64 = 0.664;

/// Number of averaging times per decade.
const PER_DECADE: f64 = 15.0;

/// One point of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Averaging time, s.
    pub tau: f64,
    /// Allan variance, the unit of the signal squared.
    pub variance: f64,
}

/// Returns the overlapping Allan variance of samples `step` (s) apart, at averaging times equally
/// spaced in the logarithm from one sample to a tenth of the record.
pub fn variances(step: f64, samples: &[f64]) -> Vec<Point> {
    // sums[k] is the sum of the first k samples
    let mut sums = vec![0.0; samples.len() + 1];
    for (k, sample) in samples.iter().enumerate() {
        sums[k + 1] = sums[k] + sample;
    }
    factors(samples.len() / 10)
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

/// Returns whole numbers from 1 to `last`, at most [`PER_DECADE`] per decade.
fn factors(last: usize) -> Vec<usize> {
    let count = ((last.max(1) as f64).log10() * PER_DECADE).floor() as usize;
    let mut factors: Vec<usize> =
        (0..=count).map(|i| 10f64.powf(i as f64 / PER_DECADE).round() as usize).collect();
    factors.dedup();
    factors.retain(|m| *m <= last);
    factors
}

/// Noise of a gyro: white noise and a first-order Gauss–Markov bias.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Angle random walk N, rad/s/√Hz.
    pub arw: f64,
    /// Bias instability B, rad/s; the bias has the standard deviation B/0.664.
    pub bias_instability: f64,
    /// Correlation time of the bias T, s.
    pub bias_time: f64,
}

impl Noise {
    /// Returns the Allan variance at averaging time `tau` (s), (rad/s)².
    pub fn variance(&self, tau: f64) -> f64 {
        self.arw.powi(2) / tau
            + (self.bias_instability / FLICKER).powi(2) * markov(tau / self.bias_time)
    }

    /// Fits noise to the points of an Allan variance; `None` if they show no noise.
    ///
    /// The cost function sums squared relative errors, weighted with the number of intervals of
    /// that length in the record, the inverse of an Allan variance's variance. For a given T the
    /// curve is linear in N² and sigma². The search covers T from ten times the shortest averaging
    /// time (a shorter bias looks like white noise) to the longest. Without a bias T has no
    /// meaning, and B is scatter.
    pub fn fitted(points: &[Point]) -> Option<Noise> {
        let (first, last) = (points.first()?, points.last()?);
        if points.iter().any(|point| point.variance <= 0.0 || !point.variance.is_finite()) {
            return None;
        }
        let miss = |log_time: f64| linear_fit(points, log_time.exp()).1;
        let time = minimum(miss, (10.0 * first.tau).min(last.tau).ln(), last.tau.ln()).exp();
        Some(linear_fit(points, time).0)
    }
}

/// Returns the Allan variance of a Gauss–Markov process over its variance, at `x` correlation
/// times.
fn markov(x: f64) -> f64 {
    // exp_m1, because for small x everything except (2/3) x³ cancels
    (2.0 * x + 4.0 * (-x).exp_m1() - (-2.0 * x).exp_m1()) / (x * x)
}

/// Returns the best noise with this correlation time (s), and the sum of its weighted squared
/// errors.
fn linear_fit(points: &[Point], time: f64) -> (Noise, f64) {
    // per point: weight, and the contributions of N² = 1 and sigma² = 1 over the measured variance
    let terms = points
        .iter()
        .map(|p| (1.0 / p.tau, 1.0 / p.tau / p.variance, markov(p.tau / time) / p.variance));
    let (mut ww, mut wb, mut bb, mut w1, mut b1) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (weight, white, bias) in terms.clone() {
        ww += weight * white * white;
        wb += weight * white * bias;
        bb += weight * bias * bias;
        w1 += weight * white;
        b1 += weight * bias;
    }
    let determinant = ww * bb - wb * wb;
    let (mut white, mut bias) =
        ((w1 * bb - b1 * wb) / determinant, (b1 * ww - w1 * wb) / determinant);
    // variances are not negative: on the boundary the other parameter alone is fitted
    if white < 0.0 {
        (white, bias) = (0.0, b1 / bb);
    } else if bias < 0.0 {
        (white, bias) = (w1 / ww, 0.0);
    }
    let miss = terms.map(|(w, a, b)| w * (a * white + b * bias - 1.0).powi(2)).sum();
    let noise =
        Noise { arw: white.sqrt(), bias_instability: FLICKER * bias.sqrt(), bias_time: time };
    (noise, miss)
}

/// Returns the minimum of `f` from `low` to `high` by a coarse scan and golden sections.
fn minimum(f: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    const LOOKS: usize = 50;
    let step = (high - low) / LOOKS as f64;
    let best = (0..=LOOKS)
        .map(|i| low + i as f64 * step)
        .min_by(|a, b| f(*a).total_cmp(&f(*b)))
        .unwrap_or(low);
    let (mut low, mut high) = ((best - step).max(low), (best + step).min(high));
    let golden = (5f64.sqrt() - 1.0) / 2.0;
    while high - low > 1e-9 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if f(a) < f(b) {
            high = b;
        } else {
            low = a;
        }
    }
    (low + high) / 2.0
}

#[cfg(test)]
mod tests {
    use super::{FLICKER, Noise, Point, minimum, variances};
    use crate::random::Random;

    #[test]
    fn white_noise_falls_with_the_root_of_the_averaging_time() {
        let mut random = Random::new(1, 0);
        let samples: Vec<f64> = (0..100_000).map(|_| 3.0 * random.normal()).collect();
        for point in variances(0.02, &samples) {
            // of n samples each: sigma/sqrt(n). Its relative standard error is about
            // 1/sqrt(1.5 spans of that length) for the variance times two; five of them.
            let n = point.tau / 0.02;
            let expected = 3.0 / n.sqrt();
            let error = (2.0 / (1.5 * 100_000.0 / n)).sqrt() / 2.0;
            let found = point.variance.sqrt();
            assert!((found / expected - 1.0).abs() < 5.0 * error, "n = {n}: {found}");
        }
    }

    #[test]
    fn a_ramp_rises_with_the_averaging_time() {
        // rate D t: two neighbouring means differ by D tau, so the deviation is D tau / sqrt 2
        let samples: Vec<f64> = (0..20_000).map(|k| 0.25 * 0.1 * k as f64).collect();
        let points = variances(0.1, &samples);
        assert!(points.len() > 40 && (points.last().unwrap().tau - 200.0).abs() < 30.0);
        for point in points {
            let expected = 0.25 * point.tau / 2f64.sqrt();
            // sums of 2e4 numbers up to 5e2 carry 1e-9 each
            assert!((point.variance.sqrt() / expected - 1.0).abs() < 1e-7, "{point:?}");
        }
    }

    #[test]
    fn an_alternating_signal_is_seen_by_odd_averages_alone() {
        // +1, −1, ...: means of odd m are ±1/m, those of even m nothing
        let samples: Vec<f64> = (0..1000).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        for point in variances(1.0, &samples) {
            let m = point.tau;
            let expected = if m % 2.0 == 1.0 { 2.0 / (m * m) } else { 0.0 };
            assert!((point.variance - expected).abs() < 1e-12, "{point:?}");
        }
    }

    #[test]
    fn the_bias_has_its_peak_where_the_page_says() {
        let noise = Noise { arw: 0.0, bias_instability: FLICKER, bias_time: 100.0 };
        let deviation = |tau: f64| noise.variance(tau).sqrt();
        let peak = minimum(|log| -deviation(log.exp()), 1f64.ln(), 1e4f64.ln()).exp();
        // 1.8926 and 0.61737 by setting the derivative to zero: x from 3 − x − (4 + 2x) e^−x
        // + (1 + x) e^−2x = 0
        assert!((peak / 100.0 - 1.8926).abs() < 1e-3, "{peak}");
        assert!((deviation(peak) - 0.61737).abs() < 1e-4, "{}", deviation(peak));
        // slopes at the ends: sqrt(2x/3) and sqrt(2/x)
        assert!((deviation(0.01) / (2.0 * 1e-4 / 3.0f64).sqrt() - 1.0).abs() < 1e-3);
        assert!((deviation(1e6) / 2e-4f64.sqrt() - 1.0).abs() < 1e-3);
    }

    #[test]
    fn the_variance_of_a_simulated_bias_is_the_formula() {
        // 1e6 samples, 50 to a correlation time: 2e4 correlation times
        let (mut random, mut bias) = (Random::new(2, 0), 0.0);
        let keep = (-1.0 / 50.0f64).exp();
        let samples: Vec<f64> = (0..1_000_000)
            .map(|_| {
                bias = keep * bias + (1.0 - keep * keep).sqrt() * random.normal();
                bias
            })
            .collect();
        let noise = Noise { arw: 0.0, bias_instability: FLICKER, bias_time: 1.0 };
        for point in variances(0.02, &samples).iter().filter(|p| (0.2..20.0).contains(&p.tau)) {
            // below 0.2 s the sampling matters, which the formula does not include; a standard
            // error is sqrt(1/(1.5 x 2e4/20)) = 2.6 % at the longest time and less below
            let ratio = point.variance / noise.variance(point.tau);
            assert!((ratio - 1.0).abs() < 0.1, "{point:?}: {ratio}");
        }
    }

    #[test]
    fn the_fit_finds_the_noise_of_its_own_curve() {
        for noise in [
            Noise { arw: 5.75e-5, bias_instability: 5.21e-5, bias_time: 100.0 },
            Noise { arw: 1e-3, bias_instability: 3e-4, bias_time: 12.0 },
            Noise { arw: 2e-5, bias_instability: 4e-4, bias_time: 400.0 },
        ] {
            let tau = |i| 0.02 * 10f64.powf(i as f64 / 15.0);
            let points: Vec<Point> =
                (0..75).map(|i| Point { tau: tau(i), variance: noise.variance(tau(i)) }).collect();
            let found = Noise::fitted(&points).unwrap();
            for (found, specified) in [
                (found.arw, noise.arw),
                (found.bias_instability, noise.bias_instability),
                (found.bias_time, noise.bias_time),
            ] {
                // the search for the time ends at 1e-9, where the minimum is flat to 1e-8
                assert!((found / specified - 1.0).abs() < 1e-5, "{found}, not {specified}");
            }
        }
        assert_eq!(Noise::fitted(&[]), None);
        assert_eq!(Noise::fitted(&[Point { tau: 1.0, variance: 0.0 }]), None);
    }
}

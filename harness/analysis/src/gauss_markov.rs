//! Noise of a rate gyro, and the filter that whitens it.
//!
//! ```text
//! y_k = ω(t_k) + b_k + σ_w n_k,   b_{k+1} = φ b_k + σ_b sqrt(1 − φ²) m_k,   φ = exp(−Δt/T)
//! ```
//!
//! The noise is white noise plus a Gauss–Markov bias (IEEE Std 952). The Kalman filter of b turns a
//! residual r into innovations e, which are white if the residual is this noise. The same linear
//! filter turns sensitivities of the rate into sensitivities of the innovations. Least squares of
//! the innovations is then maximum likelihood, and slow drift is not mistaken for a signal.

/// Smallest white noise, rad/s or rad. Simulated recordings have less, but their differences are solver
/// errors, which are not random.
pub const FLOOR: f64 = 1e-6;

/// White noise of the standard deviation σ_w and a Gauss–Markov bias: `drift` is σ_b/σ_w and `time` the
/// correlation time T of the bias, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    pub white: f64,
    pub drift: f64,
    pub time: f64,
}

/// Whitening filter for the rows of one recording: for each row φ of the preceding step, the Kalman gain K,
/// and 1/sqrt(innovation variance); `log_variance` is Σ ln(innovation variance).
pub struct Whitening {
    rows: Vec<[f64; 3]>,
    log_variance: f64,
}

impl Noise {
    pub fn white(sigma: f64) -> Self {
        Noise { white: sigma, drift: 0.0, time: 100.0 }
    }

    /// Returns the whitening filter for rows at these times, s. Rows that are not `fresh` carry no new
    /// information; their innovation is 0.
    pub fn whitening(&self, time: &[f64], fresh: Option<&[bool]>) -> Whitening {
        let (white, drift) = (self.white.powi(2), (self.white * self.drift).powi(2));
        let mut variance = drift;
        let mut log_variance = 0.0;
        let mut rows = Vec::with_capacity(time.len());
        let (mut last_step, mut keep) = (0.0, 1.0);
        // Once the filter has settled its gains are constant.
        let (mut last_innovation, mut settled) = (f64::NEG_INFINITY, ([1.0, 0.0, 1.0], 0.0));
        for k in 0..time.len() {
            if k > 0 {
                let step = time[k] - time[k - 1];
                if k == 1 || (step - last_step).abs() > 1e-9 {
                    (last_step, keep) = (step, (-step / self.time).exp());
                }
                variance = keep * keep * variance + drift * (1.0 - keep * keep);
            }
            if fresh.is_some_and(|fresh| !fresh[k]) {
                rows.push([keep, 0.0, 0.0]);
                continue;
            }
            let innovation = variance + white;
            if (innovation - last_innovation).abs() > 1e-12 * innovation {
                let gain = variance / innovation;
                settled = ([keep, gain, innovation.sqrt().recip()], innovation.ln());
                last_innovation = innovation;
            }
            settled.0[0] = keep;
            rows.push(settled.0);
            log_variance += settled.1;
            variance *= 1.0 - settled.0[1];
        }
        Whitening { rows, log_variance }
    }

    /// Estimates the noise from a residual (rad/s) at these times by maximum likelihood.
    pub fn fit(time: &[f64], residual: &[f64], fresh: Option<&[bool]>) -> Self {
        let new = |fresh: &[bool]| fresh.iter().filter(|new| **new).count();
        let count = fresh.map_or(residual.len(), new) as f64;
        // σ_w follows from the other parameters; the search minimises −2 ln L.
        let sized = |ln_drift: f64, ln_time: f64| {
            let unit = Noise { white: 1.0, drift: ln_drift.exp(), time: ln_time.exp() };
            let filter = unit.whitening(time, fresh);
            let mut e = residual.to_vec();
            filter.apply(&mut e);
            let white = (e.iter().map(|v| v * v).sum::<f64>() / count).sqrt().max(FLOOR);
            (2.0 * count * white.ln() + filter.log_variance, Noise { white, ..unit })
        };
        let longest = (time[time.len() - 1] - time[0]).ln();
        let mut best = sized(-4.0, 4.6);
        let (mut at, mut reach): ((f64, f64), _) = ((-4.0, 4.6f64.min(longest)), (1.5, 1.5));
        // Coordinate search over two smooth variables, which takes some tens of evaluations.
        for _ in 0..40 {
            let mut moved = false;
            for (dx, dt) in [(reach.0, 0.0), (-reach.0, 0.0), (0.0, reach.1), (0.0, -reach.1)] {
                let to = ((at.0 + dx).clamp(-9.0, 4.0), (at.1 + dt).clamp(0.0, longest));
                let there = sized(to.0, to.1);
                if there.0 < best.0 {
                    (best, at, moved) = (there, to, true);
                }
            }
            if !moved {
                reach = (reach.0 / 2.0, reach.1 / 2.0);
                if reach.0 < 0.15 {
                    break;
                }
            }
        }
        best.1
    }
}

impl Whitening {
    /// Replaces a residual, or a sensitivity, by innovations divided by their standard deviation.
    pub fn apply(&self, signal: &mut [f64]) {
        let mut bias = 0.0;
        for (value, [keep, gain, scale]) in signal.iter_mut().zip(&self.rows) {
            bias *= keep;
            let innovation = *value - bias;
            bias += gain * innovation;
            *value = innovation * scale;
        }
    }

    /// Returns Σ ln(innovation variance); together with Σ e² it is −2 ln L up to a constant.
    pub fn log_variance(&self) -> f64 {
        self.log_variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_simulated_noise_is_estimated_and_its_innovations_are_white() {
        let mut random = crate::random::Random::new(3, 1);
        let time: Vec<f64> = (0..135_000).map(|k| 0.02 * f64::from(k)).collect();
        let keep = (-0.02f64 / 100.0).exp();
        let (white, drift) = (4.07e-4, 7.85e-5);
        let mut bias = drift * random.normal();
        let residual: Vec<f64> = time
            .iter()
            .map(|_| {
                let y = bias + white * random.normal();
                bias = keep * bias + drift * (1.0 - keep * keep).sqrt() * random.normal();
                y
            })
            .collect();
        let found = Noise::fit(&time, &residual, None);
        // 1/sqrt(2 N) = 0.2 %; the drift has 27 correlation times: 20 %, four of them
        assert!((found.white / white - 1.0).abs() < 0.01, "{found:?}");
        assert!((found.drift * found.white / drift).ln().abs() < 0.8, "{found:?}");
        let mut e = residual.clone();
        found.whitening(&time, None).apply(&mut e);
        for lag in [1, 50, 500] {
            let sum: f64 = e.iter().zip(&e[lag..]).map(|(a, b)| a * b).sum();
            assert!((sum / e.len() as f64).abs() < 4.0 / (e.len() as f64).sqrt(), "lag {lag}");
        }
    }
}

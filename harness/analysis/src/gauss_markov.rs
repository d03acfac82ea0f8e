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

/// White noise of the standard deviation σ_w and a Gauss–Markov bias: `drift` is σ_b/σ_w and `time` the
/// correlation time T of the bias, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    pub white: f64,
    pub drift: f64,
    pub time: f64,
}

/// Whitening filter for the rows of one recording. For each row it contains φ of the preceding step, the
/// Kalman gain K, and 1/sqrt(innovation variance); `log_variance` is Σ ln(innovation variance).
pub struct Whitening {
    rows: Vec<[f64; 3]>,
    log_variance: f64,
}

impl Noise {
    pub fn white(sigma: f64) -> Self {
        Noise { white: sigma, drift: 0.0, time: 100.0 }
    }

    /// Returns the whitening filter for rows at these times, s. Rows that are not `fresh` contain no new
    /// measurement; their innovation is 0.
    pub fn whitening(&self, time: &[f64], fresh: Option<&[bool]>) -> Whitening {
        let (white, drift) = (self.white.powi(2), (self.white * self.drift).powi(2));
        let mut variance = drift;
        let mut log_variance = 0.0;
        let mut rows = Vec::with_capacity(time.len());
        let (mut last_step, mut keep) = (0.0, 1.0);
        // After some rows of equal spacing the filter has settled, and its gains are constant.
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
}

impl Whitening {
    /// Replaces a residual, or a sensitivity, by its innovations divided by their standard deviation.
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

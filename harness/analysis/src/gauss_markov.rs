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

/// Noise of a gyro: white noise and a Gauss–Markov bias.
///
/// - `white`: standard deviation of the white noise of one sample, in the unit of the signal.
/// - `drift`: standard deviation of the bias, divided by `white`.
/// - `time`: correlation time of the bias, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    pub white: f64,
    pub drift: f64,
    pub time: f64,
}

/// Kalman filter that turns the rows of one recording into white innovations.
///
/// - `rows`: for each row the factor φ by which the bias has decayed since the last row, the Kalman
///   gain, and the reciprocal of the innovation's standard deviation.
/// - `log_variance`: sum of the logarithms of the innovations' variances.
pub struct Whitening {
    rows: Vec<[f64; 3]>,
    log_variance: f64,
}

impl Noise {
    pub fn white(sigma: f64) -> Self {
        Noise { white: sigma, drift: 0.0, time: 100.0 }
    }

    /// Returns the whitening filter for rows at the times `time`, s. Rows that are not `fresh`
    /// repeat an old measurement, so that their innovation is 0; without `fresh` every row is a
    /// measurement.
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
    /// Replaces `signal` by its innovations, divided by their standard deviations. The signal is a
    /// residual, or the derivative of a residual with respect to a parameter.
    pub fn apply(&self, signal: &mut [f64]) {
        let mut bias = 0.0;
        for (value, [keep, gain, scale]) in signal.iter_mut().zip(&self.rows) {
            bias *= keep;
            let innovation = *value - bias;
            bias += gain * innovation;
            *value = innovation * scale;
        }
    }

    pub fn log_variance(&self) -> f64 {
        self.log_variance
    }
}

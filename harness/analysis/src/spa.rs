//! Blackman–Tukey estimate of the frequency response, like MATLAB's `spa`: covariances of the whole
//! record, tapered by a Hann lag window and transformed,
//!
//! ```text
//! R_yu(τ) = 1/N Σ y(t+τ) u(t),   Φ_yu(ω) = Σ_{|τ|≤M} w(τ) R_yu(τ) e^{−jωτ}
//! H = Φ_yu / Φ_uu,   w(τ) = (1 + cos(πτ/M)) / 2
//! ```

use fourier::{Forward, Inverse};

use crate::response::FrequencyResponse;
use crate::statistics;
use fourier::Complex64;

/// Longest lag for the frequency band of Rubaga's thesis, 1.25 to 3.5 Hz, s. The resolution is
/// about 1/lag: 100 s give 10 mHz. With 200 s the shape of the antiresonance, whose half-power
/// width is 14 mHz, hardly changes.
pub const LAG: f64 = 200.0;

/// A frequency response with the data from which its uncertainty follows.
///
/// - `input`: two-sided power spectral density of the input at the response's frequencies, in the
///   input's unit squared times s.
pub struct Estimate {
    pub response: FrequencyResponse,
    pub input: Vec<f64>,
    lag: f64,
    duration: f64,
}

impl Estimate {
    pub fn new(
        step: f64,
        input: &[f64],
        output: &[f64],
        frequencies: &[f64],
        lag: f64,
    ) -> Estimate {
        let (response, power) = estimate(step, input, output, frequencies, lag);
        let duration = step * input.len() as f64;
        Estimate {
            response: FrequencyResponse { response, frequency: frequencies.to_vec() },
            input: power,
            lag,
            duration,
        }
    }

    /// Returns the relative standard deviation of the response's magnitude |H| at each frequency,
    /// which is also the standard deviation of the phase in rad. `unexplained` is the power
    /// spectral density Φ_v of the part of the output that the response does not explain. A record
    /// of the length T with the longest lag M averages n = 4 T/(3 M) independent lines, so that
    ///
    /// ```text
    /// var |H| / |H|² = Φ_v / (2 n |H|² Φ_uu)
    /// ```
    ///
    /// with the power spectral density Φ_uu of the input (Ljung, *System Identification*, 2nd ed.,
    /// 1999, equations 6.59 and 6.60).
    pub fn deviation(&self, unexplained: &[f64]) -> Vec<f64> {
        let average = 4.0 * self.duration / (3.0 * self.lag);
        let each = self.response.response.iter().zip(unexplained).zip(&self.input);
        each.map(|((h, v), u)| (v / (2.0 * average * h.norm_sqr() * u)).sqrt()).collect()
    }

    /// Returns a measure, in 1/Hz, of how fast the random error of the response varies along the
    /// frequency axis: the root mean square of its derivative divided by its own root mean square.
    /// It is 2π times the root mean square of the lag, weighted with the squared window. For Hann's
    /// window with the longest lag M, the mean square of the lag is (1/2 − 15/(4π²)) 2/3 M².
    pub fn slope(&self) -> f64 {
        let pi = std::f64::consts::PI;
        2.0 * pi * self.lag * ((0.5 - 3.75 / (pi * pi)) * 2.0 / 3.0).sqrt()
    }
}

/// Returns the frequency response of `output` to `input` by spectral analysis at `frequencies`, Hz.
/// The signals are sampled every `step` seconds, and their means are removed first. `lag` is the
/// longest lag of the correlation functions, s.
pub fn frequency_response(
    step: f64,
    input: &[f64],
    output: &[f64],
    frequencies: &[f64],
    lag: f64,
) -> FrequencyResponse {
    Estimate::new(step, input, output, frequencies, lag).response
}

fn estimate(
    step: f64,
    input: &[f64],
    output: &[f64],
    frequencies: &[f64],
    lag: f64,
) -> (Vec<Complex64>, Vec<f64>) {
    let lags = ((lag / step).round() as usize).min(input.len() - 1);
    // Zeros after the record, so that covariances up to `lags` do not wrap around.
    let length = (input.len() + lags).next_power_of_two();
    let (forward, inverse) = (Forward::new(length), Inverse::new(length));

    let spectrum = |signal: &[f64]| {
        let mean = statistics::mean(signal);
        let mut padded: Vec<f64> = signal.iter().map(|v| v - mean).collect();
        padded.resize(length, 0.0);
        forward.transform(padded)
    };
    // Sum and difference of the covariances at +k and −k steps, multiplied by the Hann lag window, are the factors of
    // cosine and sine. At 0 there is only one covariance.
    let tapered = |cross: Vec<Complex64>| -> Vec<(f64, f64)> {
        let covariance = inverse.transform(cross);
        let weight = |k: usize| (1.0 + (std::f64::consts::PI * k as f64 / lags as f64).cos()) / 2.0;
        let pair = |k: usize| match k {
            0 => (covariance[0], covariance[0]),
            _ => {
                let (ahead, behind) = (covariance[k], covariance[length - k]);
                (weight(k) * (ahead + behind), weight(k) * (ahead - behind))
            }
        };
        (0..=lags).map(pair).collect()
    };
    let (u, y) = (spectrum(input), spectrum(output));
    let yu = tapered(y.iter().zip(&u).map(|(y, u)| y * u.conj()).collect());
    let uu = tapered(u.iter().map(|u| (u * u.conj()).re.into()).collect());

    let lags: Vec<[f64; 3]> =
        yu.iter().zip(&uu).map(|(&(even, odd), &(auto, _))| [even, odd, auto]).collect();
    let response = frequencies.chunks(TOGETHER).flat_map(|chunk| {
        let mut angles = [0.0; TOGETHER]; // the unused angles of a last, shorter chunk are 0
        for (angle, frequency) in angles.iter_mut().zip(chunk) {
            *angle = -std::f64::consts::TAU * frequency * step;
        }
        transformed(&lags, angles).into_iter().take(chunk.len())
    });
    // factor by which the transforms are divided, because they are not normalised
    let unit = step / (length as f64 * input.len() as f64);
    response.map(|(h, power)| (h, power * unit)).unzip()
}

/// Number of frequencies whose sums are computed at the same time. A single sum would wait for its
/// last addition each time; sixteen independent sums are six times as fast.
const TOGETHER: usize = 16;

/// Returns the frequency response at sixteen frequencies from correlation functions, and the power
/// spectrum of the input. `lags` has the even and the odd part of the cross-correlation and the
/// autocorrelation at each lag; `angles` are the frequencies in rad per lag. The sums use the exact
/// frequencies, because interpolation between the lines of a Fourier transform misses deep
/// antiresonances.
fn transformed(lags: &[[f64; 3]], angles: [f64; TOGETHER]) -> [(Complex64, f64); TOGETHER] {
    let turn = angles.map(Complex64::cis);
    let (turn_re, turn_im) = (turn.map(|t| t.re), turn.map(|t| t.im));
    let (mut re, mut im) = ([1.0; TOGETHER], [0.0; TOGETHER]);
    let [mut cross_re, mut cross_im, mut auto] = [[0.0; TOGETHER]; 3];
    for &[even, odd, power] in lags {
        for j in 0..TOGETHER {
            cross_re[j] += re[j] * even;
            cross_im[j] += im[j] * odd;
            auto[j] += re[j] * power;
            let next = re[j] * turn_re[j] - im[j] * turn_im[j];
            im[j] = re[j] * turn_im[j] + im[j] * turn_re[j];
            re[j] = next;
        }
    }
    std::array::from_fn(|j| (Complex64::new(cross_re[j], cross_im[j]) / auto[j], auto[j]))
}

//! Blackman–Tukey estimate of the frequency response, as MATLAB's `spa`:
//! covariances of the whole record, tapered by a Hann lag window and transformed,
//!
//! ```text
//! R_yu(τ) = 1/N Σ y(t+τ) u(t),   Φ_yu(ω) = Σ_{|τ|≤M} w(τ) R_yu(τ) e^{−jωτ}
//! H = Φ_yu / Φ_uu,   w(τ) = (1 + cos(πτ/M)) / 2
//! ```

use realfft::RealFftPlanner;

use super::{Complex64, FrequencyResponse};

/// Longest lag, s. `spa` resolves about 1/lag: 10 mHz need 100 s. 200 s leave the dip, whose
/// half-power width is 14 mHz, nearly its own shape.
pub const LAG: f64 = 200.0;

/// Frequency response of `output` to `input`, sampled every `step` s, at `frequencies` (Hz), with
/// lags up to `lag` s. Means are taken off first.
pub fn frequency_response(
    step: f64,
    input: &[f64],
    output: &[f64],
    frequencies: &[f64],
    lag: f64,
) -> FrequencyResponse {
    let lags = ((lag / step).round() as usize).min(input.len() - 1);
    // zeros behind the record, so that covariances up to `lags` do not wrap around
    let length = (input.len() + lags).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, backward) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));

    let spectrum = |signal: &[f64]| {
        let mean = signal.iter().sum::<f64>() / signal.len() as f64;
        let mut padded: Vec<f64> = signal.iter().map(|v| v - mean).collect();
        padded.resize(length, 0.0);
        let mut spectrum = forward.make_output_vec();
        forward.process(&mut padded, &mut spectrum).expect("lengths are the plan's");
        spectrum
    };
    // circular covariance -> Hann lag window -> spectrum again
    let smoothed = |mut cross: Vec<Complex64>| {
        for end in [0, cross.len() - 1] {
            cross[end].im = 0.0; // real by symmetry; the inverse insists on it exactly
        }
        let mut covariance = backward.make_output_vec();
        backward.process(&mut cross, &mut covariance).expect("lengths are the plan's");
        for (i, value) in covariance.iter_mut().enumerate() {
            let tau = i.min(length - i);
            *value *= if tau <= lags {
                (1.0 + (std::f64::consts::PI * tau as f64 / lags as f64).cos()) / 2.0
            } else {
                0.0
            };
        }
        let mut spectrum = forward.make_output_vec();
        forward.process(&mut covariance, &mut spectrum).expect("lengths are the plan's");
        spectrum
    };
    let (u, y) = (spectrum(input), spectrum(output));
    let yu = smoothed(y.iter().zip(&u).map(|(y, u)| y * u.conj()).collect());
    let uu = smoothed(u.iter().map(|u| (u * u.conj()).re.into()).collect());

    // the lag window makes both spectra smooth over 1/lag, many bins: a line between bins will do
    let at = |spectrum: &[Complex64], frequency: f64| {
        let bin = (frequency * step * length as f64).clamp(0.0, (spectrum.len() - 2) as f64);
        let (low, part) = (bin as usize, bin.fract());
        spectrum[low] * (1.0 - part) + spectrum[low + 1] * part
    };
    FrequencyResponse {
        frequency: frequencies.to_vec(),
        response: frequencies.iter().map(|&f| at(&yu, f) / at(&uu, f)).collect(),
    }
}

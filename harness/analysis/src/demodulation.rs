//! Sweep-synchronous demodulation: the Fourier coefficient of torque and rate at
//! the sweep's own phase, over a window that slides with the sweep,
//!
//! ```text
//! Y(t) = Σ w(t' − t) y(t') e^{−jφ(t')},   H(f(t)) = Y(t) / U(t)
//! ```
//!
//! φ is the known phase of the sweep (it is not estimated), w a Hann window of
//! [so many cycles](cycles). U is formed with the same window, so whatever the
//! window does to amplitude and phase cancels in H. Harmonics that friction makes
//! turn by many cycles within the window and drop out.

use crate::sweep::Sweep;
use crate::{Complex64, FrequencyResponse};

/// Fewest cycles that a window has: in three of them a Hann window tells a sweep from what does not
/// turn with it.
pub const LEAST_CYCLES: f64 = 3.0;

/// Length of the window in cycles of a sweep that is slow enough. 24 cycles are 10 s at 2.4 Hz, in which the thesis's
/// sweep moves by 9 mHz: little against the 14 mHz half-power width of the slosh at 10 cm, and long
/// enough to tell the harmonics of a sticking bearing from the sweep.
pub const CYCLES: f64 = 24.0;

/// Largest relative change of a sweep's frequency within a window.
const MOST_MOVE: f64 = 0.015;

/// Cycles of the window at a frequency, Hz: 24, or fewer if the sweep would move by more
/// than 1.5 % of its frequency, but not fewer than 3, in which harmonics drop out.
pub fn cycles(sweep: &Sweep, frequency: f64) -> f64 {
    let slow = MOST_MOVE * frequency.powi(2) / sweep.rate_at(frequency).abs();
    slow.clamp(LEAST_CYCLES, CYCLES)
}

/// Responses, and what tells how uncertain they are.
pub struct Demodulated<const N: usize> {
    /// One for each output.
    pub responses: [FrequencyResponse; N],
    /// Variance of H for a noise of unit power spectral density in the output, Σ|w|²/(h |U|²), at
    /// the responses' frequencies.
    pub noise_gain: Vec<f64>,
}

/// Standard deviation of |H| relative to |H| (and of the phase, rad) if `unexplained` is the
/// two-sided power spectral density of what the response does not explain.
pub fn deviation(
    response: &FrequencyResponse,
    unexplained: &[f64],
    noise_gain: &[f64],
) -> Vec<f64> {
    let each = response.response.iter().zip(unexplained).zip(noise_gain);
    each.map(|((h, v), gain)| (v * gain / 2.0).sqrt() / h.norm()).collect()
}

/// Rate at which the error of a response changes along the frequency, in units of itself per Hz: the root
/// of ∫w'²/∫w², 2π/√3 per length of a Hann window, over the sweep's rate.
pub fn slope(sweep: &Sweep, frequency: f64) -> f64 {
    let window = cycles(sweep, frequency) / frequency;
    std::f64::consts::TAU / 3f64.sqrt() / (window * sweep.rate_at(frequency).abs())
}

/// Frequency responses of `outputs` to `input`, sampled at `time` (s, equal steps), while `sweep` passes
/// each of `frequencies` (Hz). Frequencies it does not pass are left out.
pub fn frequency_responses<const N: usize>(
    sweep: &Sweep,
    time: &[f64],
    input: &[f64],
    outputs: [&[f64]; N],
    frequencies: &[f64],
) -> Demodulated<N> {
    let carrier: Vec<Complex64> = time.iter().map(|&t| Complex64::cis(-sweep.phase(t))).collect();
    let step = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
    let mut results: [FrequencyResponse; N] = std::array::from_fn(|_| Default::default());
    let mut noise_gain = Vec::new();
    for &frequency in frequencies {
        let Some(centre) = sweep.time_of(frequency) else { continue };
        let half = cycles(sweep, frequency) / frequency / 2.0;
        let from = time.partition_point(|&t| t < centre - half);
        let to = time.partition_point(|&t| t <= centre + half);
        let (mut u, mut squares) = (Complex64::default(), 0.0);
        let mut y = [Complex64::default(); N];
        // the window's cosine turns by the same angle from sample to sample; over some hundred of
        // them that is exact to 1e-13, and costs a fifth of asking for each
        let turns = |seconds: f64| Complex64::cis(std::f64::consts::PI * seconds / half);
        let Some(first) = time.get(from) else { continue };
        let (mut window, turn) = (turns(first - centre), turns(step));
        for i in from..to {
            let weight = carrier[i] * (1.0 + window.re);
            window *= turn;
            squares += weight.norm_sqr();
            u += weight * input[i];
            for (sum, output) in y.iter_mut().zip(&outputs) {
                *sum += weight * output[i];
            }
        }
        noise_gain.push(squares / (step * u.norm_sqr()));
        for (result, sum) in results.iter_mut().zip(y) {
            result.frequency.push(frequency);
            result.response.push(sum / u);
        }
    }
    Demodulated { responses: results, noise_gain }
}

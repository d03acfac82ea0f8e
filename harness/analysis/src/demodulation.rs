//! Sweep-synchronous demodulation: Fourier coefficients of torque and rate at the phase of the sweep, over a
//! window that moves with the sweep,
//!
//! ```text
//! Y(t) = Σ w(t' − t) y(t') e^{−jφ(t')},   H(f(t)) = Y(t) / U(t)
//! ```
//!
//! φ is the known phase of the sweep (it is not estimated), w a Hann window of a number of [cycles]. U uses
//! the same window, so that the window's effect on amplitude and phase cancels in H. Harmonics due to
//! friction rotate by many cycles within the window and average out.

use crate::response::FrequencyResponse;
use crate::sweep::Sweep;
use fourier::Complex64;

/// Smallest number of cycles in a window. With three cycles a Hann window still separates the sweep
/// from other components of the signal.
pub const LEAST_CYCLES: f64 = 3.0;

/// Number of cycles in the window for a slow sweep. 24 cycles last 10 s at 2.4 Hz. In this time the
/// frequency of the sweep in Rubaga's thesis changes by 9 mHz, which is less than the half-power
/// width of the slosh in 10 cm of water, 14 mHz. The window is also long enough to separate the
/// harmonics that a sticking bearing causes from the sweep.
pub const CYCLES: f64 = 24.0;

const MOST_MOVE: f64 = 0.015;

/// Returns the number of cycles in the demodulation window when the sweep passes `frequency`, Hz.
/// It is [`CYCLES`], or fewer if the sweep would change by more than 1.5 % of its frequency in the
/// window. It is at least [`LEAST_CYCLES`], because with fewer cycles harmonics would not average
/// out.
pub fn cycles(sweep: &Sweep, frequency: f64) -> f64 {
    let slow = MOST_MOVE * frequency.powi(2) / sweep.rate_at(frequency).abs();
    slow.clamp(LEAST_CYCLES, CYCLES)
}

/// Frequency responses, one for each output, with the data from which their uncertainty follows.
///
/// - `noise_gain`: variance of the response at each frequency if the output has noise of unit power
///   spectral density. With the window w, the demodulated input U and the time h between samples it
///   is Σ|w|²/(h |U|²).
pub struct Demodulated<const N: usize> {
    pub responses: [FrequencyResponse; N],
    pub noise_gain: Vec<f64>,
}

/// Returns the relative standard deviation of the response's magnitude at each frequency, which is
/// also the standard deviation of the phase in rad. `unexplained` is the two-sided power spectral
/// density of the part of the output, such as noise, that the response does not explain.
/// `noise_gain` is the field of [`Demodulated`].
pub fn deviation(
    response: &FrequencyResponse,
    unexplained: &[f64],
    noise_gain: &[f64],
) -> Vec<f64> {
    let each = response.response.iter().zip(unexplained).zip(noise_gain);
    each.map(|((h, v), gain)| (v * gain / 2.0).sqrt() / h.norm()).collect()
}

/// Returns a measure, in 1/Hz, of how fast the random error of the response varies along the
/// frequency axis when the sweep passes `frequency`, Hz. It is the root mean square of the error's
/// derivative divided by the root mean square of the error. For a Hann window this is 2π/√3 divided
/// by the length of the window, s, and by the rate of the sweep, Hz/s.
pub fn slope(sweep: &Sweep, frequency: f64) -> f64 {
    let window = cycles(sweep, frequency) / frequency;
    std::f64::consts::TAU / 3f64.sqrt() / (window * sweep.rate_at(frequency).abs())
}

/// Returns the frequency responses of `outputs` to `input` by lock-in demodulation: signals are
/// averaged in a window around the time at which `sweep` passes each of `frequencies`, Hz.
/// Frequencies that the sweep does not pass are left out. The signals are sampled at the equally
/// spaced times `time`, s.
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
        let Some(centre) = sweep.time_at_frequency(frequency) else { continue };
        let half = cycles(sweep, frequency) / frequency / 2.0;
        let from = time.partition_point(|&t| t < centre - half);
        let to = time.partition_point(|&t| t <= centre + half);
        let (mut u, mut squares) = (Complex64::default(), 0.0);
        let mut y = [Complex64::default(); N];
        // From sample to sample the window's cosine rotates by the same angle. This recurrence is accurate to
        // 1e-13 over some hundred samples, and takes a fifth of the time.
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

//! Frequency responses from torque to hub rate, from a run's signals, and their features.
//!
//! Three estimators answer different questions, and a fourth is for records that are too short for
//! them:
//! * [`demodulation`]: the hub's response while the sweep passes a frequency, like a lock-in
//!   amplifier. It provides `features.csv`.
//! * [`spa`]: MATLAB's Blackman–Tukey estimate over the whole record, as in the thesis. The report
//!   compares it with the first.
//! * [`welch`]: the H1 estimate from averaged segments, the usual transfer function of two records.
//! * [`rational`]: a transfer function fitted to the spectra of the whole record.

pub mod allan;
pub mod demodulation;
mod exponential;
pub mod features;
pub mod free_decay;
pub mod gauss_markov;
pub mod innovations;
pub mod least_squares;
pub mod lengths;
pub mod linear;
pub mod noise;
pub mod off_axis;
pub mod random;
pub mod rational;
pub mod residual;
pub mod rest;
pub mod rotary;
pub mod sanathanan_koerner;
pub mod spa;
pub mod statistics;
pub mod sweep;
pub mod transfer_function;
pub mod welch;

pub use signals::fourier::Complex64;

/// A complex frequency response on a grid of frequencies.
#[derive(Clone, Debug, Default)]
pub struct FrequencyResponse {
    /// Frequencies, Hz, increasing.
    pub frequency: Vec<f64>,
    /// Rate over torque, (rad/s)/(N·m).
    pub response: Vec<Complex64>,
}

impl FrequencyResponse {
    pub fn decibels(&self) -> Vec<f64> {
        self.response.iter().map(|h| 20.0 * h.norm().log10()).collect()
    }

    pub fn degrees(&self) -> Vec<f64> {
        self.response.iter().map(|h| h.arg().to_degrees()).collect()
    }
}

/// The thesis's band (6.3.1), Hz.
pub const BAND: (f64, f64) = (1.25, 3.5);

/// Returns `points` frequencies from one end of the band to the other, equally spaced in log f, Hz.
pub fn logarithmic_grid((from, to): (f64, f64), points: usize) -> Vec<f64> {
    let step = (to / from).ln() / (points - 1) as f64;
    (0..points).map(|i| from * (i as f64 * step).exp()).collect()
}

//! From a run's signals to the frequency response of torque to hub rate, and
//! from that to its features.
//!
//! Three estimators, which answer different questions, and a fourth for records that are too short
//! for them:
//! * [`demodulation`]: what the hub does while the sweep passes a frequency, as
//!   a lock-in amplifier shows it. It feeds `features.csv`.
//! * [`spa`]: MATLAB's Blackman–Tukey estimate over the whole record, as the
//!   thesis used it. It stands beside the first in the report.
//! * [`welch`]: the H1 estimate from averaged segments, which most tools call
//!   the transfer function of two records.
//! * [`rational`]: a transfer function fitted to the spectra of the whole record.

pub mod allan;
pub mod armax;
pub mod demodulation;
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
    /// Frequencies, Hz, growing.
    pub frequency: Vec<f64>,
    /// Rate over torque, (rad/s)/(N·m).
    pub response: Vec<Complex64>,
}

impl FrequencyResponse {
    /// Magnitudes in dB re 1 (rad/s)/(N·m).
    pub fn decibels(&self) -> Vec<f64> {
        self.response.iter().map(|h| 20.0 * h.norm().log10()).collect()
    }

    /// Phases in degrees, −180 to 180.
    pub fn degrees(&self) -> Vec<f64> {
        self.response.iter().map(|h| h.arg().to_degrees()).collect()
    }
}

/// The band the thesis looks at (6.3.1), Hz.
pub const BAND: (f64, f64) = (1.25, 3.5);

/// `points` frequencies from one end of the band to the other, equally spaced in log f, Hz.
pub fn logarithmic_grid((from, to): (f64, f64), points: usize) -> Vec<f64> {
    let step = (to / from).ln() / (points - 1) as f64;
    (0..points).map(|i| from * (i as f64 * step).exp()).collect()
}

//! Frequency responses and their frequency grids.

use fourier::Complex64;

/// A complex frequency response at increasing frequencies, Hz. For the bench it is the hub's rate
/// divided by the torque, (rad/s)/(N·m).
#[derive(Clone, Debug, Default)]
pub struct FrequencyResponse {
    pub frequency: Vec<f64>,
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

pub const BAND: (f64, f64) = (1.25, 3.5);

/// Returns `points` frequencies from one end of the band to the other, Hz, equally spaced in their
/// logarithm.
pub fn logarithmic_grid((from, to): (f64, f64), points: usize) -> Vec<f64> {
    let step = (to / from).ln() / (points - 1) as f64;
    (0..points).map(|i| from * (i as f64 * step).exp()).collect()
}

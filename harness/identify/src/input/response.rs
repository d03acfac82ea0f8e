//! The frequency response that is estimated from a recording.

use analysis::welch::{self, Spectra};
use analysis::{FrequencyResponse, logarithmic_grid, spa};
use anyhow::{Context, Result, ensure};

use crate::input::recording::Recording;

/// Returns the lowest and highest frequency, Hz, between which the torque has 98 % of its power.
pub fn excited_band(step: f64, torque: &[f64], rate: &[f64]) -> Option<(f64, f64)> {
    let spectra = Spectra::estimate(step, torque, rate, welch::Segments::Seconds(60.0));
    let total: f64 = spectra.input.iter().skip(1).sum();
    let reached = |part: f64| {
        let mut sum = 0.0;
        spectra.input.iter().enumerate().skip(1).position(|(_, power)| {
            sum += power;
            sum >= part * total
        })
    };
    let (low, high) = (reached(0.01)? as f64, reached(0.99)? as f64);
    Some(((low + 1.0) * spectra.resolution, (high + 1.0) * spectra.resolution))
}

pub fn response(recording: &Recording) -> Result<FrequencyResponse> {
    let (step, torque, rate) = recording.even()?;
    let band = excited_band(step, &torque, &rate).context("the torque has no spectrum")?;
    ensure!(
        band.1 > 1.15 * band.0,
        "{}: the torque excites only {:.2} to {:.2} Hz. A frequency response needs a sweep, a multisine \
         or noise around the slosh frequency",
        recording.name,
        band.0,
        band.1
    );
    let lag = spa::LAG.min(recording.duration() / 4.0);
    Ok(spa::frequency_response(step, &torque, &rate, &logarithmic_grid(band, 1200), lag))
}

//! The thesis's linear model of a run, the quality of its fit, and its residual (6.3.2 to 6.3.5).

use crate::features::Features;
use crate::response::FrequencyResponse;
use crate::statistics;
use crate::transfer_function::{TransferFunction, fit_time};
use crate::welch::{Segments, Spectra};

/// A transfer function fitted to a run, with statistics of the residual, which is the measured rate
/// minus the rate of the model.
///
/// - `fit_frequency`, `fit_time`: share of the measurement that the model explains, in the
///   frequency domain and in the time domain, %.
/// - `coherence`: mean coherence of residual and torque between antiresonance and resonance; `None`
///   if one of them is missing.
/// - `skewness`, `kurtosis`: of the residual; 0 and 3 if it is Gaussian noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelFit {
    pub model: TransferFunction,
    pub fit_frequency: f64,
    pub fit_time: f64,
    pub coherence: Option<f64>,
    pub skewness: f64,
    pub kurtosis: f64,
}

impl ModelFit {
    /// Fits a transfer function to the frequency response `measured` from torque to rate, and
    /// simulates it with `torque`, N·m. The signals are sampled every `step` seconds. Returns the
    /// fit, and the averaged spectra of the torque and of the residual (`rate` minus the simulated
    /// rate) in segments of `segment` seconds. Their coherence is averaged between the antiresonance
    /// and the resonance in `features`. Returns `None` if `measured` is empty.
    pub fn fit(
        step: f64,
        segment: f64,
        torque: &[f64],
        rate: &[f64],
        measured: &FrequencyResponse,
        features: &Features,
    ) -> Option<(Self, Spectra)> {
        let model = TransferFunction::fit(measured)?;
        let mean = statistics::mean(rate);
        let forced = model.simulate(step, torque);
        let missing: Vec<f64> = rate.iter().zip(&forced).map(|(y, m)| y - mean - m).collect();
        let free = model.free_answer(step, &missing);
        let residual: Vec<f64> = missing.iter().zip(&free).map(|(e, f)| e - f).collect();
        let answer: Vec<f64> = forced.iter().zip(&free).map(|(m, f)| mean + m + f).collect();
        let (skewness, kurtosis) = skewness_and_kurtosis(&residual);
        let spectra = Spectra::estimate(step, torque, &residual, Segments::Seconds(segment));
        let fit = ModelFit {
            model,
            fit_frequency: model.fit_frequency(measured),
            fit_time: fit_time(rate, &answer),
            coherence: features
                .f_dip
                .zip(features.f_res)
                .map(|(antiresonance, resonance)| spectra.mean_coherence(antiresonance, resonance)),
            skewness,
            kurtosis,
        };
        Some((fit, spectra))
    }
}

/// Returns skewness and kurtosis of a signal: the means of z³ and z⁴, where z is the signal minus
/// its mean, divided by its standard deviation. For Gaussian noise they are 0 and 3.
pub fn skewness_and_kurtosis(signal: &[f64]) -> (f64, f64) {
    let count = signal.len() as f64;
    let mean = statistics::mean(signal);
    let moment = |n: i32| signal.iter().map(|x| (x - mean).powi(n)).sum::<f64>() / count;
    let deviation = moment(2).sqrt();
    (moment(3) / deviation.powi(3), moment(4) / deviation.powi(4))
}

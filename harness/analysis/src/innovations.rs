//! Tests whether the residual of a model is the gyro's noise. If it is, its innovations are white with unit variance
//! (Ljung, System Identification, chapter 16).
//!
//! * whiteness: Ljung and Box's Q of the autocorrelations up to [`LAGS`];
//! * in time: power in windows of [`WINDOW`] rows, compared with the level of the white noise; a burst or a
//!   clipped part raises it;
//! * in frequency: power in bands of the periodogram;
//! * cross-correlation with the torque and with its square: a correlation shows that the model lacks an
//!   effect of the input.
//!
//! With many rows each test also rejects negligible effects. Therefore the result contains the size
//! of the excess, too.

use fourier::Forward;
use serde::Serialize;

use crate::statistics::{mean, median};

pub const LAGS: usize = 50;
/// Number of rows in each of the time windows whose power is compared with the white noise; 1000
/// rows are 20 s at 50 Hz.
pub const WINDOW: usize = 1000;
const BANDS: usize = 100;
const FEWEST_LINES: usize = 4;
/// Largest acceptable result of a test, in standard deviations. If the residual is only the gyro's
/// noise, a single test exceeds this limit with the probability 1e-6, and at least one of a hundred
/// tests exceeds it with the probability 1e-4.
pub const LIMIT: f64 = 5.0;

/// Results of the tests of a residual, as multiples of the standard deviation that the result would
/// have if the residual were pure noise.
///
/// - `whiteness`: result of the whiteness test.
/// - `in_time`: largest excess of the power in a time window, and the time of the window, s.
/// - `in_frequency`: largest excess of the power in a frequency band, and the frequency of the
///   band, Hz.
/// - `torque`, `torque_squared`: largest cross-correlation with an input, or with its square, over
///   lags up to 2 s.
/// - `excess`: root mean square of the residual above the noise in the worst band, rad/s (not in
///   standard deviations).
#[derive(Clone, Debug, Default, Serialize)]
pub struct Tests {
    pub whiteness: f64,
    pub in_time: (f64, f64),
    pub in_frequency: (f64, f64),
    pub torque: f64,
    pub torque_squared: f64,
    #[serde(rename = "left")]
    pub excess: f64,
}

impl Tests {
    pub fn passed(&self) -> bool {
        self.worst() < LIMIT
    }

    pub fn worst(&self) -> f64 {
        [self.whiteness, self.in_time.0, self.in_frequency.0, self.torque, self.torque_squared]
            .into_iter()
            .fold(0.0, f64::max)
    }

    /// Tests if the innovations `e` of a fit are white noise. `time` are their times, s, `inputs`
    /// are the inputs of the model, such as the torque, and `white` is the standard deviation of
    /// the noise in the unit of the signal.
    pub fn run(time: &[f64], inputs: &[&[f64]], e: &[f64], white: f64) -> Self {
        let count = e.len() as f64;
        let middle = mean(e);
        let e: Vec<f64> = e.iter().map(|v| v - middle).collect();
        let power = e.iter().map(|v| v * v).sum::<f64>() / count;
        if power < 0.01 {
            // A residual below a tenth of `white` passes all tests. For example, the residual of a simulated recording
            // without noise is the error of a solver.
            return Tests::default();
        }
        // A short record uses fewer lags, so that each lag has several independent products.
        let lags = LAGS.min(e.len() / 4).max(1);
        let q: f64 = (1..=lags)
            .map(|lag| {
                let r = e.iter().zip(&e[lag..]).map(|(a, b)| a * b).sum::<f64>() / count / power;
                count * (count + 2.0) * r * r / (count - lag as f64)
            })
            .sum();
        let step = (time[time.len() - 1] - time[0]) / (count - 1.0);
        let window = WINDOW.min(e.len());
        let windows: Vec<(f64, f64)> = e
            .chunks_exact(window)
            .enumerate()
            .map(|(k, w)| (w.iter().map(|v| v * v).sum::<f64>() / window as f64, time[k * window]))
            .collect();
        let in_time = worst(&windows, window as f64);
        let (bands, width, per_band) = periodogram(&e, step);
        let levels: Vec<(f64, f64)> =
            bands.iter().enumerate().map(|(k, p)| (*p, (k as f64 + 0.5) * width)).collect();
        let in_frequency = worst(&levels, 2.0 * per_band);
        let middle = median(&bands).unwrap_or(0.0);
        let excess: f64 = bands.iter().map(|p| (p - middle).max(0.0)).fold(0.0, f64::max);
        let squared = |input: &&[f64]| input.iter().map(|u| u * u).collect::<Vec<f64>>();
        let largest =
            |crossed: &dyn Fn(&&[f64]) -> f64| inputs.iter().map(crossed).fold(0.0, f64::max);
        Tests {
            whiteness: normal(q, lags as f64),
            in_time,
            in_frequency,
            torque: largest(&|input| crossed(&e, input, step)),
            torque_squared: largest(&|input| crossed(&e, &squared(input), step)),
            excess: white * (excess / bands.len() as f64).sqrt(),
        }
    }
}

/// Converts a χ² value with `n` degrees of freedom into a standard normal deviate, by the
/// approximation of Wilson and Hilferty.
fn normal(chi_squared: f64, n: f64) -> f64 {
    let spread = 2.0 / (9.0 * n);
    ((chi_squared / n).powf(1.0 / 3.0) - (1.0 - spread)) / spread.sqrt()
}

/// Returns the excess of the largest of the `levels` over the median of all levels, and its time or
/// frequency. `levels` are pairs of a level and its time or frequency; each level is a mean of `n`
/// squares. The excess is returned as a standard normal deviate, because the probability of a given
/// excess depends on `n`.
fn worst(levels: &[(f64, f64)], n: f64) -> (f64, f64) {
    let values: Vec<f64> = levels.iter().map(|(level, _)| *level).collect();
    // The mean of χ² is needed, which is larger than its median by this factor.
    let middle = median(&values).unwrap_or(0.0) / (1.0 - 2.0 / (9.0 * n)).powi(3);
    levels
        .iter()
        .map(|&(level, place)| (normal(n * level / middle, n), place))
        .fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a })
}

/// Returns the mean of the periodogram of `e` in each of several bands from 0 to half the sampling
/// frequency, the width of the bands, Hz, and the number of spectral lines in each band.
fn periodogram(e: &[f64], step: f64) -> (Vec<f64>, f64, f64) {
    let spectrum = Forward::new(e.len()).transform(e.to_vec());
    let bands = BANDS.min((spectrum.len() - 1) / FEWEST_LINES).max(1);
    let lines = (spectrum.len() - 1) / bands;
    let power = |k: usize| spectrum[k].norm_sqr() / e.len() as f64;
    let bands = (0..bands)
        .map(|band| {
            (1 + band * lines..1 + (band + 1) * lines).map(power).sum::<f64>() / lines as f64
        })
        .collect();
    (bands, lines as f64 / (e.len() as f64 * step), lines as f64)
}

/// Returns the largest cross-correlation of the innovations `e` with `input` over lags from 0 to 2
/// s. It is in standard deviations of the result for white innovations that do not depend on the
/// input.
pub fn crossed(e: &[f64], input: &[f64], step: f64) -> f64 {
    let mean = mean(input);
    let lags = ((2.0 / step) as usize).min(e.len() / 2);
    let squares: f64 = input.iter().map(|u| (u - mean).powi(2)).sum();
    if squares == 0.0 {
        return 0.0;
    }
    (0..=lags)
        .step_by((lags / 25).max(1))
        .map(|lag| {
            let sum: f64 = e[lag..].iter().zip(input).map(|(e, u)| e * (u - mean)).sum();
            sum.abs() / squares.sqrt()
        })
        .fold(0.0, f64::max)
}

//! Detection of rotary slosh. X and Y are the Fourier coefficients of the radial and the tangential slosh angle,
//! both demodulated at the phase of the sweep. The *swirl number*
//!
//! ```text
//! S = 2 Im(X conj(Y)) / (|X|² + |Y|²)
//! ```
//!
//! is 0 for motion in a plane, +1 for a counter-clockwise circle seen from above (from outwards towards +θ), and −1
//! for a clockwise circle. Under any other torque the swirl number is computed in windows of time, from the angular
//! momentum of the angles.

use crate::response::FrequencyResponse;
use fourier::Complex64;

/// Magnitude of the swirl number (0 for motion in a plane, ±1 for motion on a circle) above which a
/// motion counts as rotary. It belongs to an ellipse with the axis ratio 1 : 3.7.
pub const ROTARY: f64 = 0.5;

/// Smallest slosh angle at which the swirl number is evaluated, rad. At smaller angles the small
/// radial part of a planar wave would dominate the swirl number.
pub const LEAST: f64 = 0.02;

const PERIODS: f64 = 10.0;

/// Rotary slosh (swirl) in a run.
///
/// - `from`, `to`: for a sweep, the first and the last frequency at which the slosh was rotary, Hz;
///   `None` if it never was.
/// - `time`: total duration of rotary slosh, s.
/// - `swirl`: swirl number with the largest magnitude, −1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Rotary {
    pub from: Option<f64>,
    pub to: Option<f64>,
    pub time: f64,
    pub swirl: f64,
}

/// Returns the swirl number at each frequency: ±1 for a circular motion of the liquid, 0 for a
/// planar motion. `radial` and `tangential` are the responses of the slosh angles to the torque,
/// rad/(N·m), and `torque` is the amplitude of the torque, N·m. The result is 0 where the slosh
/// angle is below [`LEAST`], because noise would dominate.
pub fn swirl(radial: &FrequencyResponse, tangential: &FrequencyResponse, torque: f64) -> Vec<f64> {
    let number = |(x, y): (&Complex64, &Complex64)| {
        let power = x.norm_sqr() + y.norm_sqr();
        if power.sqrt() * torque < LEAST { 0.0 } else { 2.0 * (x * y.conj()).im / power }
    };
    radial.response.iter().zip(&tangential.response).map(number).collect()
}

impl Rotary {
    pub fn from_sweep(frequency: &[f64], time: &[f64], swirl: &[f64]) -> Self {
        let turning: Vec<usize> = (0..swirl.len()).filter(|&i| swirl[i].abs() > ROTARY).collect();
        // Each frequency represents the time of the sweep up to half-way to the neighbouring frequencies.
        let share = |i: usize| {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(time.len() - 1));
            (time[after] - time[before]).abs() / 2.0
        };
        Rotary {
            from: turning.first().map(|&i| frequency[i]),
            to: turning.last().map(|&i| frequency[i]),
            time: turning.iter().fold(0.0, |sum, &i| sum + share(i)),
            swirl: largest(swirl),
        }
    }

    /// Measures rotary slosh under any torque from the radial and the tangential slosh angle, rad,
    /// sampled every `step` seconds. `frequency` is the natural frequency of the liquid, Hz, from
    /// which the length of the evaluated windows follows. In a window with the positions q and the
    /// velocities v the swirl number is Σ q × v / √(Σ q² Σ v²).
    pub fn from_angles(step: f64, frequency: f64, radial: &[f64], tangential: &[f64]) -> Self {
        let length = (PERIODS / frequency / step).ceil() as usize;
        let window = |(x, y): (&[f64], &[f64])| {
            let (mut turned, mut position, mut velocity) = (0.0, 0.0, 0.0);
            for (x, y) in x.windows(3).zip(y.windows(3)) {
                let (vx, vy) = (x[2] - x[0], y[2] - y[0]);
                turned += x[1] * vy - y[1] * vx;
                position += x[1] * x[1] + y[1] * y[1];
                velocity += vx * vx + vy * vy;
            }
            // An ellipse with semi-axes a and b has the mean square (a² + b²)/2.
            let amplitude = (2.0 * position / (x.len() - 2) as f64).sqrt();
            if amplitude < LEAST { 0.0 } else { turned / (position * velocity).sqrt() }
        };
        let length = length.max(3);
        let windows = radial.chunks_exact(length).zip(tangential.chunks_exact(length));
        let swirl: Vec<f64> = windows.map(window).collect();
        let turning = swirl.iter().filter(|s| s.abs() > ROTARY).count();
        Rotary {
            time: turning as f64 * length as f64 * step,
            swirl: largest(&swirl),
            ..Rotary::default()
        }
    }
}

fn largest(swirl: &[f64]) -> f64 {
    swirl.iter().fold(0.0, |m: f64, s| if s.abs() > m.abs() { *s } else { m })
}

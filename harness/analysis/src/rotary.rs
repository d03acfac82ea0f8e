//! Detection of rotary slosh. From the radial and the tangential slosh angle, both demodulated at
//! the sweep's phase, with Fourier coefficients X and Y, the *swirl number*
//!
//! ```text
//! S = 2 Im(X conj(Y)) / (|X|² + |Y|²)
//! ```
//!
//! is 0 for motion in a plane and ±1 for a circle, + counter-clockwise seen from above (from
//! outwards towards +θ).

use crate::{Complex64, FrequencyResponse};

/// Swirl number above which motion counts as rotary: an ellipse with axes 1 : 3.7.
pub const ROTARY: f64 = 0.5;

/// Smallest amplitude that counts, rad. Below it the small radial part of a planar wave makes the
/// swirl number meaningless.
pub const LEAST: f64 = 0.02;

/// Rotary motion in a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Rotary {
    /// First frequency with rotary slosh, Hz.
    pub from: Option<f64>,
    /// Last frequency with rotary slosh, Hz.
    pub to: Option<f64>,
    /// Time in rotary slosh, s.
    pub time: f64,
    /// Swirl number with the largest magnitude in the sweep.
    pub swirl: f64,
}

/// Returns the swirl number at each frequency, 0 where the motion is too small.
pub fn swirl(radial: &FrequencyResponse, tangential: &FrequencyResponse, torque: f64) -> Vec<f64> {
    let number = |(x, y): (&Complex64, &Complex64)| {
        let power = x.norm_sqr() + y.norm_sqr();
        if power.sqrt() * torque < LEAST { 0.0 } else { 2.0 * (x * y.conj()).im / power }
    };
    radial.response.iter().zip(&tangential.response).map(number).collect()
}

impl Rotary {
    /// Evaluates the swirl numbers at the frequencies (Hz) that a sweep passes at these times (s).
    pub fn of(frequency: &[f64], time: &[f64], swirl: &[f64]) -> Self {
        let turning: Vec<usize> = (0..swirl.len()).filter(|&i| swirl[i].abs() > ROTARY).collect();
        // each point represents the time half-way to its neighbours
        let share = |i: usize| {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(time.len() - 1));
            (time[after] - time[before]).abs() / 2.0
        };
        Rotary {
            from: turning.first().map(|&i| frequency[i]),
            to: turning.last().map(|&i| frequency[i]),
            time: turning.iter().fold(0.0, |sum, &i| sum + share(i)),
            swirl: swirl.iter().fold(0.0, |m: f64, s| if s.abs() > m.abs() { *s } else { m }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Rotary, swirl};
    use crate::Complex64;
    use crate::FrequencyResponse;

    #[test]
    fn a_circle_swirls_by_one_and_a_line_not_at_all() {
        let response = |values: &[Complex64]| FrequencyResponse {
            frequency: vec![2.0; values.len()],
            response: values.to_vec(),
        };
        let one = Complex64::new(1.0, 0.0);
        // x = cos φ has the coefficient 1, y = sin φ −i: from outwards towards +θ.
        let radial = response(&[one, one, one * 1e-4]);
        let tangential =
            response(&[Complex64::new(0.0, -1.0), one * 0.3, Complex64::new(0.0, 1e-4)]);
        let numbers = swirl(&radial, &tangential, 1.0);
        assert_eq!(numbers, [1.0, 0.0, 0.0]);
        let rotary = Rotary::of(&[1.0, 2.0, 3.0], &[0.0, 10.0, 20.0], &numbers);
        assert_eq!((rotary.from, rotary.to, rotary.swirl), (Some(1.0), Some(1.0), 1.0));
        assert_eq!(rotary.time, 5.0);
    }
}

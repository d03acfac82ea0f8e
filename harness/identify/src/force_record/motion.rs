//! Motion of a tank from recorded signals: displacement or acceleration of a point, and rotation about one axis.
//!
//! A polynomial of sixth degree through the rows about a time gives a signal's value and derivatives there. With dense rows it is a
//! fit by least squares, which reduces the noise.

use anyhow::{Result, ensure};
use nalgebra::{SMatrix, SVector};

/// Number of coefficients of the polynomials.
const TERMS: usize = 7;

/// A signal over time.
#[derive(Clone, Copy, Debug)]
pub struct Signal<'a> {
    /// Times of the rows, s, increasing.
    pub time: &'a [f64],
    /// Values of the rows.
    pub values: &'a [f64],
    /// Half the width of the fitted window, s.
    pub window: f64,
}

impl Signal<'_> {
    /// Returns the value and the first two derivatives at a time.
    ///
    /// # Errors
    /// If there are fewer rows than coefficients.
    pub fn at(&self, t: f64) -> Result<[f64; 3]> {
        let rows = self.time.len();
        ensure!(rows >= TERMS, "{rows} rows are too few for a motion (allowed: at least {TERMS})");
        let mut from = self.time.partition_point(|row| *row < t - self.window);
        let mut to = self.time.partition_point(|row| *row <= t + self.window);
        while to - from < TERMS {
            let is_left_nearer = match (from.checked_sub(1), self.time.get(to)) {
                (Some(left), Some(right)) => t - self.time[left] <= right - t,
                (left, _) => left.is_some(),
            };
            if is_left_nearer { from -= 1 } else { to += 1 }
        }
        let (time, values) = (&self.time[from..to], &self.values[from..to]);
        let scale = (t - time[0]).max(time[time.len() - 1] - t);
        let mut matrix = SMatrix::<f64, TERMS, TERMS>::zeros();
        let mut right = SVector::<f64, TERMS>::zeros();
        for (time, value) in time.iter().zip(values) {
            let x = (time - t) / scale;
            let mut powers = SVector::<f64, TERMS>::repeat(1.0);
            (1..TERMS).for_each(|k| powers[k] = powers[k - 1] * x);
            matrix += powers * powers.transpose();
            right += powers * *value;
        }
        let found = matrix.cholesky().map(|factor| factor.solve(&right));
        let found = found.unwrap_or_else(SVector::zeros);
        Ok([found[0], found[1] / scale, 2.0 * found[2] / (scale * scale)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_in_twenty_rows_a_period_has_its_derivatives() {
        let time: Vec<f64> = (0..400).map(|k| 0.05 * f64::from(k)).collect();
        let w = std::f64::consts::TAU;
        let values: Vec<f64> = time.iter().map(|t| (w * t).sin()).collect();
        let signal = Signal { time: &time, values: &values, window: 0.125 };
        for t in [5.0, 5.013, 12.3] {
            let [value, rate, bend] = signal.at(t).unwrap();
            // the next term is (2π 0.15)⁸/8! = 2e-5 of the value, and 56 times that of the second derivative
            assert!((value - (w * t).sin()).abs() < 1e-5, "{t}: {value}");
            assert!((rate / w - (w * t).cos()).abs() < 1e-4, "{t}: {rate}");
            assert!((bend / (w * w) + (w * t).sin()).abs() < 1e-3, "{t}: {bend}");
        }
    }
}

//! How a tank's modes and rigid liquid follow the mass of its liquid: a table, and between its points
//! monotone interpolation with two continuous derivatives.
//!
//! Between two points a distance h apart with the values y_0, y_1, secant s = (y_1 - y_0)/h, slopes
//! d_0, d_1 and second derivatives 0, t from 0 to 1:
//!
//! ```text
//! y' = 30 s t^2 (1 - t)^2 + d_0 (1 - 18 t^2 + 32 t^3 - 15 t^4) + d_1 (-12 t^2 + 28 t^3 - 15 t^4)
//! ```
//!
//! The slope at an inner point is the harmonic mean of the secants beside it, 0 where they differ in
//! sign, so at most twice the smaller; at the ends it is the secant. y' is linear in d_0 and d_1 and
//! has the sign of s at the corners of 0 <= d_0/s, d_1/s <= 2: y is monotone where the table is.
//!
//! Source: the region of monotonicity as in Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980), here
//! for quintics.

use taylor::number::Number;

use crate::sizes::{MODES, POINTS};

/// Modes and rigid liquid at some masses of the liquid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FillTable {
    /// How many points are used: 0 for a tank whose liquid stays, or 2 to [`POINTS`].
    pub points: usize,
    /// Mass of the whole liquid, kg, rising.
    pub liquid: [f64; POINTS],
    /// Height of the rigid liquid's centre of mass on the tank's axis, m.
    pub h_0: [f64; POINTS],
    /// Its inertia across the axis about its own centre of mass, kg m2.
    pub i_0: [f64; POINTS],
    /// Its inertia about the axis, kg m2.
    pub i_z: [f64; POINTS],
    /// Mass of each mode's bob, kg.
    pub mass: [[f64; POINTS]; MODES],
    /// Length of its pendulum, m.
    pub length: [[f64; POINTS]; MODES],
    /// Height of its hinge, m.
    pub hinge: [[f64; POINTS]; MODES],
}

impl FillTable {
    /// The masses in use.
    pub fn masses(&self) -> &[f64] {
        &self.liquid[..self.points]
    }

    /// y and its first two derivatives by the mass, at the mass x; beyond the ends the last interval
    /// goes on.
    pub fn at<T: Number>(&self, y: &[f64; POINTS], x: T) -> [T; 3] {
        let masses = self.masses();
        let last = self.points - 2;
        let i = (0..last).find(|&i| x.value() < masses[i + 1]).unwrap_or(last);
        let secant = |i: usize| (y[i + 1] - y[i]) / (masses[i + 1] - masses[i]);
        let slope = |i: usize| {
            if i == 0 {
                return secant(0);
            }
            if i > last {
                return secant(last);
            }
            let (a, b) = (secant(i - 1), secant(i));
            if a * b > 0.0 { 2.0 * a * b / (a + b) } else { 0.0 }
        };
        let h = masses[i + 1] - masses[i];
        let (s, d_0, d_1) = (secant(i), slope(i), slope(i + 1));
        let c_3 = 10.0 * s - 6.0 * d_0 - 4.0 * d_1;
        let c_4 = -15.0 * s + 8.0 * d_0 + 7.0 * d_1;
        let c_5 = 6.0 * s - 3.0 * (d_0 + d_1);
        let c = T::constant;
        let t = (x - c(masses[i])) * (1.0 / h);
        let t_2 = t * t;
        [
            c(y[i]) + t * (c(d_0) + t_2 * (c(c_3) + t * (c(c_4) + t * c_5))) * h,
            c(d_0) + t_2 * (c(3.0 * c_3) + t * (c(4.0 * c_4) + t * (5.0 * c_5))),
            t * (c(6.0 * c_3) + t * (c(12.0 * c_4) + t * (20.0 * c_5))) * (1.0 / h),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(liquid: &[f64]) -> FillTable {
        let mut table = FillTable { points: liquid.len(), ..crate::Tank::default().fill };
        table.liquid[..liquid.len()].copy_from_slice(liquid);
        table
    }

    /// Random monotone data, also with flat stretches: never a slope of the wrong sign, values and
    /// both derivatives the same from either side of a point.
    #[test]
    fn interpolation_is_monotone_and_has_two_continuous_derivatives() {
        let mut rng = fastrand::Rng::with_seed(3);
        for _ in 0..200 {
            let (mut x, mut y) = ([0.0; POINTS], [0.0; POINTS]);
            for i in 1..POINTS {
                x[i] = x[i - 1] + 0.1 + rng.f64();
                y[i] = y[i - 1] + [0.0, 1e-3, 1.0, 30.0][rng.usize(..4)] * rng.f64();
            }
            let table = table(&x);
            for k in 0..=1000 {
                let [value, slope, _] = table.at(&y, x[POINTS - 1] * k as f64 / 1000.0);
                assert!(slope > -1e-13, "{slope}");
                assert!(value > -1e-13 && value < y[POINTS - 1] + 1e-12);
            }
            for i in 1..POINTS - 1 {
                let [left, right] = [-1e-9, 1e-9].map(|e| table.at(&y, x[i] + e));
                assert!((left[0] - y[i]).abs() < 1e-6 && (right[0] - y[i]).abs() < 1e-6);
                assert!((left[1] - right[1]).abs() < 1e-4, "{left:?} {right:?}");
                // y'' is 0 there; y''' is up to 60 times the secant over h^2.
                assert!(left[2].abs() < 1e-2 && right[2].abs() < 1e-2, "{left:?} {right:?}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_by_differences() {
        let table = table(&[1.0, 2.0, 4.0, 5.0]);
        let y = [1.0, 3.0, 4.0, 9.0, 0.0, 0.0, 0.0, 0.0];
        for x in [1.3, 2.2, 3.9, 4.5] {
            let e = 1e-5;
            let [low, now, high] = [x - e, x, x + e].map(|x| table.at(&y, x));
            for i in 0..2 {
                assert!(((high[i] - low[i]) / (2.0 * e) - now[i + 1]).abs() < 1e-6);
            }
        }
    }
}

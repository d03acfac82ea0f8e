//! Interpolation with two continuous derivatives that is monotone wherever the data are.

use formulas::interpolation::{derivatives, quintic};

/// Interpolation by a piecewise polynomial of fifth degree through points (x_i, y_i), which is
/// twice continuously differentiable ([`formulas::interpolation`]). At a turning point of the data
/// it may exceed the data, because the true maximum lies between the points.
#[derive(Clone, Debug, PartialEq)]
pub struct Monotone {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
    curvature: Vec<f64>,
}

impl Monotone {
    /// Interpolates points with ascending `x`. A single point gives a constant.
    ///
    /// # Panics
    /// If there is no point, or `x` is not ascending.
    pub fn new(x: &[f64], y: &[f64]) -> Monotone {
        Monotone::interpolate(x, y, false)
    }

    /// Interpolates as [`Monotone::new`] does, but never exceeds the values of the two neighbouring
    /// points, so that the result turns exactly where the data turn. The FMUs interpolate their
    /// tables in this way.
    ///
    /// # Panics
    /// If there is no point, or `x` is not ascending.
    pub fn bounded(x: &[f64], y: &[f64]) -> Monotone {
        Monotone::interpolate(x, y, true)
    }

    fn interpolate(x: &[f64], y: &[f64], within: bool) -> Monotone {
        assert!(!x.is_empty() && x.len() == y.len() && x.windows(2).all(|w| w[0] < w[1]));
        let (mut slope, mut curvature) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        derivatives(x, y, within, &mut slope, &mut curvature);
        Monotone { x: x.to_vec(), y: y.to_vec(), slope, curvature }
    }

    pub fn evaluate(&self, x: f64) -> f64 {
        let count = self.x.len();
        let x = x.clamp(self.x[0], self.x[count - 1]);
        if count == 1 {
            return self.y[0];
        }
        let i = self.x.partition_point(|p| *p <= x).clamp(1, count - 1) - 1;
        let h = self.x[i + 1] - self.x[i];
        let t = (x - self.x[i]) / h;
        let end = |i: usize| [self.y[i], self.slope[i], self.curvature[i]];
        let c = quintic(h, end(i), end(i + 1));
        c.iter().rev().fold(0.0, |sum, c| sum * t + c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_data_are_interpolated_to_fifth_order() {
        let error = |count: usize| {
            let x: Vec<f64> = (0..=count).map(|i| i as f64 / count as f64).collect();
            let y: Vec<f64> = x.iter().map(|x| x.exp()).collect();
            let curve = Monotone::new(&x, &y);
            (0..1000)
                .map(|i| i as f64 / 1000.0)
                .map(|x| (curve.evaluate(x) - x.exp()).abs())
                .fold(0.0, f64::max)
        };
        // halving the step reduces the error by 2^5 = 32 in the middle, by 2^4 near the ends
        assert!(
            error(20) < 1e-6 && error(20) / error(40) > 14.0,
            "{:e} {:e}",
            error(20),
            error(40)
        );
    }

    #[test]
    fn an_interpolated_curve_is_monotone_where_its_data_are_and_twice_differentiable() {
        let x = [0.0, 0.1, 0.2, 0.5, 0.6, 0.61, 0.9, 1.0, 1.3, 1.4, 1.5];
        let y = [0.0, 0.0, 0.01, 0.02, 1.0, 1.5, 1.51, 1.51, 1.51, 1.8, 3.0];
        for sign in [1.0, -1.0] {
            let y: Vec<f64> = y.iter().map(|y| sign * y).collect();
            let curve = Monotone::new(&x, &y);
            let samples: Vec<f64> =
                (0..=30000).map(|i| sign * curve.evaluate(i as f64 * 5e-5)).collect();
            assert!(samples.windows(2).all(|w| w[1] >= w[0] - 1e-15));
            for &x in &x[1..10] {
                // The second differences on both sides of a point differ by an amount that falls with the step, down to
                // the rounding error of 1e-4.
                let jump = |h: f64| {
                    let second = |c: f64| {
                        (curve.evaluate(c + h) - 2.0 * curve.evaluate(c) + curve.evaluate(c - h))
                            / (h * h)
                    };
                    (second(x + h) - second(x - h)).abs()
                };
                assert!(jump(1e-5) < 0.2 * jump(1e-4) + 1e-4, "{x} {} {}", jump(1e-4), jump(1e-5));
            }
        }
    }
}

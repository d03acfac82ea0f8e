//! Interpolation with two continuous derivatives that is monotone where the data are.

/// Piecewise quintic through (x_i, y_i), twice continuously differentiable.
///
/// Slopes and second derivatives at the points come from the polynomial through the five nearest
/// points, so smooth data are met to the fifth order. Between two points that belong to a rise (or a
/// fall) of at least three points they are limited until the quintic's Bernstein coefficients rise
/// (or fall), which is enough for the curve to do so. At a turning point of the data nothing is
/// limited: the true maximum lies between the points.
#[derive(Clone, Debug, PartialEq)]
pub struct Monotone {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
    curvature: Vec<f64>,
}

impl Monotone {
    /// Through points with ascending `x`; one point is a constant.
    ///
    /// # Panics
    /// If there is no point, or `x` does not ascend.
    pub fn new(x: &[f64], y: &[f64]) -> Monotone {
        assert!(!x.is_empty() && x.len() == y.len() && x.windows(2).all(|w| w[0] < w[1]));
        let count = x.len();
        let (mut slope, mut curvature) = (vec![0.0; count], vec![0.0; count]);
        let nearest = count.min(5);
        for i in 0..count {
            let first = i.saturating_sub(nearest / 2).min(count - nearest);
            let own = first..first + nearest;
            (slope[i], curvature[i]) = derivatives(x[i], &x[own.clone()], &y[own]);
        }
        let secant: Vec<f64> = (1..count).map(|i| (y[i] - y[i - 1]) / (x[i] - x[i - 1])).collect();
        let turning = |j: usize| j > 0 && j + 1 < count && secant[j - 1] * secant[j] < 0.0;
        let limited = |j: usize| j + 1 < count && !turning(j) && !turning(j + 1);
        // In the direction of the rise 0 <= d, and 2 (d_0 + d_1)/5 < secant on every interval.
        for j in (0..count - 1).filter(|j| limited(*j)) {
            let sign = if secant[j] < 0.0 { -1.0 } else { 1.0 };
            for i in [j, j + 1] {
                slope[i] = sign * (sign * slope[i]).clamp(0.0, 2.4 * secant[j].abs());
            }
        }
        for j in (0..count - 1).filter(|j| limited(*j)) {
            let (sum, most) = (0.4 * (slope[j] + slope[j + 1]), 0.95 * secant[j]);
            if sum.abs() > most.abs() {
                slope[j] *= most / sum;
                slope[j + 1] *= most / sum;
            }
        }
        // b_2 - b_1 = h d/5 + h^2 s/20, b_4 - b_3 = h d/5 - h^2 s/20,
        // b_3 - b_2 = h [secant - 2 (d_0 + d_1)/5] + h^2 (s_1 - s_0)/20
        for i in 0..count {
            let mut limit = [f64::NEG_INFINITY, f64::INFINITY];
            for (j, at_left) in [(i, true), (i.wrapping_sub(1), false)] {
                let Some(&rise) = secant.get(j).filter(|_| limited(j)) else { continue };
                let sign = if rise < 0.0 { -1.0 } else { 1.0 };
                let h = x[j + 1] - x[j];
                let room = (20.0 / h) * (rise - 0.4 * (slope[j] + slope[j + 1])).abs();
                let own = 4.0 * slope[i].abs() / h;
                // s at the left end: s >= -own, s <= room/2; at the right end the other way round
                let (low, high) = if at_left { (-own, 0.5 * room) } else { (-0.5 * room, own) };
                let (low, high) = if sign > 0.0 { (low, high) } else { (-high, -low) };
                limit = [limit[0].max(low), limit[1].min(high)];
            }
            curvature[i] = curvature[i].max(limit[0]).min(limit[1]);
        }
        Monotone { x: x.to_vec(), y: y.to_vec(), slope, curvature }
    }

    /// Value at `x`; outside the points the nearest end's.
    pub fn at(&self, x: f64) -> f64 {
        let count = self.x.len();
        let x = x.clamp(self.x[0], self.x[count - 1]);
        if count == 1 {
            return self.y[0];
        }
        let i = self.x.partition_point(|p| *p <= x).clamp(1, count - 1) - 1;
        let h = self.x[i + 1] - self.x[i];
        let t = (x - self.x[i]) / h;
        let (d0, d1) = (h * self.slope[i] / 5.0, h * self.slope[i + 1] / 5.0);
        let (s0, s1) = (h * h * self.curvature[i] / 20.0, h * h * self.curvature[i + 1] / 20.0);
        let (y0, y1) = (self.y[i], self.y[i + 1]);
        let mut b = [y0, y0 + d0, y0 + 2.0 * d0 + s0, y1 - 2.0 * d1 + s1, y1 - d1, y1];
        for level in (1..6).rev() {
            for k in 0..level {
                b[k] += t * (b[k + 1] - b[k]);
            }
        }
        b[0]
    }
}

/// First and second derivative at `x0` of the polynomial through the points (Fornberg 1988).
fn derivatives(x0: f64, x: &[f64], y: &[f64]) -> (f64, f64) {
    let count = x.len();
    let mut weights = [[0.0; 5]; 3];
    weights[0][0] = 1.0;
    let (mut c1, mut c4) = (1.0, x[0] - x0);
    for i in 1..count {
        let (mut c2, c5) = (1.0, c4);
        c4 = x[i] - x0;
        for j in 0..i {
            let c3 = x[i] - x[j];
            c2 *= c3;
            if j + 1 == i {
                for k in (0..3).rev() {
                    let below = if k > 0 { k as f64 * weights[k - 1][i - 1] } else { 0.0 };
                    weights[k][i] = c1 * (below - c5 * weights[k][i - 1]) / c2;
                }
            }
            for k in (0..3).rev() {
                let below = if k > 0 { k as f64 * weights[k - 1][j] } else { 0.0 };
                weights[k][j] = (c4 * weights[k][j] - below) / c3;
            }
        }
        c1 = c2;
    }
    let sum = |k: usize| weights[k].iter().zip(y).map(|(w, y)| w * y).sum();
    (sum(1), sum(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_data_are_met_to_the_fifth_order() {
        let error = |count: usize| {
            let x: Vec<f64> = (0..=count).map(|i| i as f64 / count as f64).collect();
            let y: Vec<f64> = x.iter().map(|x| x.exp()).collect();
            let curve = Monotone::new(&x, &y);
            (0..1000)
                .map(|i| i as f64 / 1000.0)
                .map(|x| (curve.at(x) - x.exp()).abs())
                .fold(0.0, f64::max)
        };
        // halving the step gains 2^5 = 32 in the middle, 2^4 next to the ends
        assert!(
            error(20) < 1e-6 && error(20) / error(40) > 14.0,
            "{:e} {:e}",
            error(20),
            error(40)
        );
    }

    /// Data with a jump, a plateau, and a turning point: where they rise, so does the curve, and two
    /// derivatives are continuous everywhere.
    #[test]
    fn curve_is_monotone_where_data_are_and_twice_differentiable() {
        let x = [0.0, 0.1, 0.2, 0.5, 0.6, 0.61, 0.9, 1.0, 1.3, 1.4, 1.5];
        let y = [0.0, 0.0, 0.01, 0.02, 1.0, 1.5, 1.51, 1.51, 1.51, 1.8, 3.0];
        for sign in [1.0, -1.0] {
            let y: Vec<f64> = y.iter().map(|y| sign * y).collect();
            let curve = Monotone::new(&x, &y);
            let samples: Vec<f64> = (0..=30000).map(|i| sign * curve.at(i as f64 * 5e-5)).collect();
            assert!(samples.windows(2).all(|w| w[1] >= w[0] - 1e-15));
            for &x in &x[1..10] {
                // the difference of the second differences on both sides falls with their step; 1e-4
                // is what rounding leaves of them
                let jump = |h: f64| {
                    let second =
                        |c: f64| (curve.at(c + h) - 2.0 * curve.at(c) + curve.at(c - h)) / (h * h);
                    (second(x + h) - second(x - h)).abs()
                };
                assert!(jump(1e-5) < 0.2 * jump(1e-4) + 1e-4, "{x} {} {}", jump(1e-4), jump(1e-5));
            }
        }
    }
}

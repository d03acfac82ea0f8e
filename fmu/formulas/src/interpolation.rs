//! Interpolation with two continuous derivatives. The curve is monotone wherever the data are.
//!
//! In each interval the curve is a quintic, which has given values, slopes and second derivatives at both points. Slopes and
//! second derivatives come from the polynomial through the five nearest points, which is exact to fifth order for smooth
//! data. In each interval they are then limited so that the Bernstein coefficients of the quintic are monotone, which is
//! sufficient for a monotone curve.

/// Computes the slopes and second derivatives of a smooth curve through the points (`x`, `y`), and writes them to `slope` and
/// `curvature`. The values of `x` must ascend.
///
/// If `within` is true, the curve stays between the values of its two points in every interval, so that all its maxima and
/// minima are at points. Otherwise intervals next to a maximum or minimum of the data are not limited, because the true
/// extremum usually lies between two points.
///
/// # Panics
/// If the lengths of the slices differ.
pub fn derivatives(x: &[f64], y: &[f64], within: bool, slope: &mut [f64], curvature: &mut [f64]) {
    let count = x.len();
    assert!([y.len(), slope.len(), curvature.len()] == [count; 3]);
    let nearest = count.min(5);
    for i in 0..count {
        let first = i.saturating_sub(nearest / 2).min(count - nearest);
        let own = first..first + nearest;
        (slope[i], curvature[i]) = polynomial_derivatives(x[i], &x[own.clone()], &y[own]);
    }
    let secant = |j: usize| (y[j + 1] - y[j]) / (x[j + 1] - x[j]);
    let turning = |j: usize| j > 0 && j + 1 < count && secant(j - 1) * secant(j) < 0.0;
    let limited = |j: usize| j + 1 < count && (within || !turning(j) && !turning(j + 1));
    let sign = |j: usize| if secant(j) < 0.0 { -1.0 } else { 1.0 };
    // The slopes are limited so that every interval has 0 <= d and 2 (d_0 + d_1)/5 < secant, in the direction of the rise.
    for j in (0..count).filter(|j| limited(*j)) {
        for slope in &mut slope[j..j + 2] {
            *slope = sign(j) * (sign(j) * *slope).clamp(0.0, 2.4 * secant(j).abs());
        }
    }
    for j in (0..count).filter(|j| limited(*j)) {
        let (sum, most) = (0.4 * (slope[j] + slope[j + 1]), 0.95 * secant(j));
        if sum.abs() > most.abs() {
            slope[j] *= most / sum;
            slope[j + 1] *= most / sum;
        }
    }
    // For a monotone curve the differences of the Bernstein coefficients must have the sign of the rise: b_2 - b_1 = h d/5 + h^2
    // s/20, b_4 - b_3 = h d/5 - h^2 s/20, and b_3 - b_2 = h [secant - 2 (d_0 + d_1)/5] + h^2 (s_1 - s_0)/20.
    for i in 0..count {
        let mut limit = [f64::NEG_INFINITY, f64::INFINITY];
        for (j, at_left) in [(i, true), (i.wrapping_sub(1), false)] {
            if j >= count || !limited(j) {
                continue;
            }
            let h = x[j + 1] - x[j];
            let room = (20.0 / h) * (secant(j) - 0.4 * (slope[j] + slope[j + 1])).abs();
            let own = 4.0 * slope[i].abs() / h;
            // Therefore s is at least -own and at most room/2 at the left end; at the right end the signs are opposite.
            let (low, high) = if at_left { (-own, 0.5 * room) } else { (-0.5 * room, own) };
            let (low, high) = if sign(j) > 0.0 { (low, high) } else { (-high, -low) };
            limit = [limit[0].max(low), limit[1].min(high)];
        }
        curvature[i] = curvature[i].max(limit[0]).min(limit[1]);
    }
}

/// Returns the first and the second derivative, at `x0`, of the polynomial through the points (`x`, `y`), of which there are
/// at most five. The method is Fornberg's recurrence (1988).
fn polynomial_derivatives(x0: f64, x: &[f64], y: &[f64]) -> (f64, f64) {
    let mut weights = [[0.0; 5]; 3];
    weights[0][0] = 1.0;
    let (mut c1, mut c4) = (1.0, x[0] - x0);
    for i in 1..x.len() {
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

/// Returns the six coefficients of the quintic polynomial between two points, each given as `[value, slope, second
/// derivative]`. The points are `h` apart; the polynomial is in powers of t, which runs from 0 at the first point to 1 at the
/// second.
pub fn quintic(h: f64, [y_0, d_0, s_0]: [f64; 3], [y_1, d_1, s_1]: [f64; 3]) -> [f64; 6] {
    let (rise, d_0, d_1) = (y_1 - y_0, d_0 * h, d_1 * h);
    let (s_0, s_1) = (0.5 * s_0 * h * h, 0.5 * s_1 * h * h);
    [
        y_0,
        d_0,
        s_0,
        10.0 * rise - 6.0 * d_0 - 4.0 * d_1 - 3.0 * s_0 + s_1,
        -15.0 * rise + 8.0 * d_0 + 7.0 * d_1 + 3.0 * s_0 - 2.0 * s_1,
        6.0 * rise - 3.0 * (d_0 + d_1) - s_0 + s_1,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: [f64; 9] = [0.0, 0.3, 0.5, 1.1, 1.2, 1.9, 2.4, 2.7, 3.5];

    fn found<const N: usize>(x: [f64; N], y: [f64; N], within: bool) -> ([f64; N], [f64; N]) {
        let (mut slope, mut curvature) = ([0.0; N], [0.0; N]);
        derivatives(&x, &y, within, &mut slope, &mut curvature);
        (slope, curvature)
    }

    #[test]
    fn the_first_and_second_derivatives_of_an_interpolating_polynomial_are_exact() {
        let power = |x: f64, n: i32| {
            libm::pow(x.abs(), f64::from(n)) * if n % 2 == 0 { 1.0 } else { x.signum() }
        };
        for count in 2..=5 {
            for n in 1..count as i32 {
                let y = X.map(|x| 1.5 + power(x - 0.7, n));
                for x in [X[0], X[1], X[count - 1], 0.83] {
                    let (first, second) = polynomial_derivatives(x, &X[..count], &y[..count]);
                    let exact = f64::from(n) * power(x - 0.7, n - 1);
                    let bent =
                        if n < 2 { 0.0 } else { f64::from(n * (n - 1)) * power(x - 0.7, n - 2) };
                    assert!((first - exact).abs() < 1e-12, "{count} {n} {x}: {first} {exact}");
                    assert!((second - bent).abs() < 2e-11, "{count} {n} {x}: {second} {bent}");
                }
            }
        }
    }

    #[test]
    fn derivatives_of_smooth_data_equal_those_of_a_polynomial_through_the_five_nearest_points() {
        let y = X.map(libm::exp);
        for sign in [1.0, -1.0] {
            let y = y.map(|y| sign * y);
            for within in [false, true] {
                let (slope, curvature) = found(X, y, within);
                for i in 0..9 {
                    let own = [0, 0, 0, 1, 2, 3, 4, 4, 4][i];
                    let expected = polynomial_derivatives(X[i], &X[own..own + 5], &y[own..own + 5]);
                    assert_eq!((slope[i], curvature[i]), expected, "{i}");
                }
            }
        }
        // If there are fewer than five points, all of them are used.
        let parabola = [0.0, 1.0, 3.0].map(|x| x + x * x);
        let (slope, curvature) = found([0.0, 1.0, 3.0], parabola, true);
        for i in 0..3 {
            assert!((slope[i] - [1.0, 3.0, 7.0][i]).abs() < 1e-14, "{slope:?}");
            assert!((curvature[i] - 2.0).abs() < 1e-14, "{curvature:?}");
        }
    }

    #[test]
    fn next_to_a_turning_point_slopes_are_limited_only_if_the_curve_must_stay_within_its_points() {
        let x = [0.0, 1.0, 2.0, 3.0, 4.0];
        for sign in [1.0, -1.0] {
            let y = x.map(|x| sign * (x - 1.9) * (x - 1.9));
            let (slope, curvature) = found(x, y, false);
            for i in 0..5 {
                assert!((slope[i] - sign * 2.0 * (x[i] - 1.9)).abs() < 1e-13, "{i} {slope:?}");
                assert!((curvature[i] - sign * 2.0).abs() < 1e-12, "{i} {curvature:?}");
            }
            assert_eq!(found(x, y, true).0[2], 0.0);
        }
    }

    /// Returns the differences between neighbouring Bernstein coefficients of the quintic between two points, divided by
    /// their distance `h`. If all differences have the sign of the rise, the quintic is monotone. With the slope d and the
    /// second derivative s at the left point, the first two differences are d/5 and d/5 + h s/20; the last two follow in the
    /// same way from the right point, and the middle one is the rest of the rise.
    fn steps(h: f64, [y_0, d_0, s_0]: [f64; 3], [y_1, d_1, s_1]: [f64; 3]) -> [f64; 5] {
        let secant = (y_1 - y_0) / h;
        let sign = if secant < 0.0 { -1.0 } else { 1.0 };
        [
            d_0 / 5.0,
            d_0 / 5.0 + h * s_0 / 20.0,
            secant - 0.4 * (d_0 + d_1) + h * (s_1 - s_0) / 20.0,
            d_1 / 5.0 - h * s_1 / 20.0,
            d_1 / 5.0,
        ]
        .map(|step| sign * step)
    }

    /// The test uses random data: some jump by factors of up to 1e4, some rise or fall smoothly, and some have maxima and
    /// minima. The tolerance of 1e-11 allows for the rounding error of a slope, which is the last digit of the largest value
    /// divided by the smallest distance between points.
    #[test]
    fn the_interpolating_curve_rises_where_the_data_rise() {
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let (mut limited, mut free) = (0, 0);
        for round in 0..600 {
            let (turns, jumps) = (round % 3 == 2, if round % 2 == 0 { 4.0 } else { 0.3 });
            let direction = if round % 3 == 0 { 1.0 } else { -1.0 };
            let (mut x, mut y) = ([0.0; 8], [0.0; 8]);
            for i in 1..8 {
                x[i] = x[i - 1] + 0.05 + random();
                let rise = libm::pow(10.0, jumps * (random() - 0.5));
                let sign = if turns && random() < 0.3 { -direction } else { direction };
                y[i] = y[i - 1] + sign * rise;
            }
            let (slope, curvature) = found(x, y, true);
            for j in 0..7 {
                let at = |i: usize| [y[i], slope[i], curvature[i]];
                for step in steps(x[j + 1] - x[j], at(j), at(j + 1)) {
                    assert!(step > -1e-11, "{round} {j}: {step}");
                }
            }
            // Slopes that already satisfy the limits do not change if each end takes half of the remaining range.
            let (mut own, mut bent) = ([0.0; 8], [0.0; 8]);
            for i in 0..8 {
                let first = [0, 0, 0, 1, 2, 3, 3, 3][i];
                (own[i], bent[i]) =
                    polynomial_derivatives(x[i], &x[first..first + 5], &y[first..first + 5]);
            }
            for i in 2..6 {
                let obeys = |j: usize| {
                    let h = x[j + 1] - x[j];
                    let left = steps(h, [y[j], own[j], bent[j]], [y[j + 1], own[j + 1], 0.0]);
                    let right = steps(h, [y[j], own[j], 0.0], [y[j + 1], own[j + 1], bent[j + 1]]);
                    let both = steps(h, [y[j], own[j], 0.0], [y[j + 1], own[j + 1], 0.0]);
                    let secant = ((y[j + 1] - y[j]) / h).abs();
                    both.iter().chain(&left).chain(&right).all(|step| *step >= 0.0)
                        && both[0].max(both[4]) <= 0.48 * secant
                        && both[2] >= 0.05 * secant
                        && left[2].min(right[2]) >= 0.5 * both[2]
                };
                if (i - 2..i + 2).all(obeys) {
                    free += 1;
                    assert_eq!((slope[i], curvature[i]), (own[i], bent[i]), "{round} {i}");
                } else {
                    limited += 1;
                }
            }
        }
        assert!(free > 20 && limited > 1000, "{free} {limited}");
    }

    #[test]
    fn slopes_of_the_interpolating_curve_are_limited_where_they_are_too_steep() {
        // The secants are 1 and 10 alternately. Each slope is at most 2.4 times the smaller secant.
        let (x, y) = ([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 10.0, 11.0, 21.0, 22.0]);
        let (slope, _) = found(x, y, true);
        assert_eq!(found(x, y, true), found(x, y, false), "nothing turns");
        for i in 1..4 {
            assert!(slope[i] <= 2.4 + 1e-15, "{slope:?}");
        }
        // The sum of two slopes is at most 2.375 times the smaller secant.
        for j in [1, 3] {
            assert!((slope[j] + slope[j + 1]) <= 2.375 + 1e-14, "{slope:?}");
        }
        assert!((slope[1] + slope[2] - 2.375).abs() < 1e-14, "{slope:?}");
        // Where the data are constant, the curve is constant.
        let (slope, curvature) = found([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 0.0, 0.0, 1.0, 3.0], true);
        assert_eq!((slope[0], slope[1], slope[2]), (0.0, 0.0, 0.0));
        assert_eq!((curvature[0], curvature[1]), (0.0, 0.0));
    }

    #[test]
    fn a_quintic_has_the_given_values_and_derivatives_at_its_ends() {
        let (left, right) = ([1.25, -0.5, 3.0], [2.0, 0.75, -1.5]);
        let c = quintic(0.5, left, right);
        let sum = |f: &dyn Fn(f64) -> f64| {
            c.iter().enumerate().map(|(n, c)| c * f(n as f64)).sum::<f64>()
        };
        assert_eq!(c[..3].first(), Some(&left[0]));
        assert_eq!([c[1] / 0.5, 2.0 * c[2] / 0.25], [left[1], left[2]]);
        assert!((sum(&|_| 1.0) - right[0]).abs() < 1e-14);
        assert!((sum(&|n| n) / 0.5 - right[1]).abs() < 1e-13);
        assert!((sum(&|n| n * (n - 1.0)) / 0.25 - right[2]).abs() < 1e-12);
    }
}

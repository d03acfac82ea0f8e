//! Interpolation with two continuous derivatives that is monotone where the data are.
//!
//! A quintic between two points has value, slope and second derivative given at both. Slopes and second
//! derivatives at the points come from the polynomial through the five nearest points, so smooth
//! data are met to the fifth order. Between two points they are limited until the quintic's Bernstein
//! coefficients rise (or fall), which is enough for the curve to do so.

/// Slopes and second derivatives at points with ascending `x`, into `slope` and `curvature`.
///
/// A turning point of the data is the curve's, too, if `within`, and the curve is then between its two
/// points everywhere; otherwise nothing is limited beside it: the true maximum lies between points.
///
/// # Panics
/// If the slices are not of one length.
pub fn derivatives(x: &[f64], y: &[f64], within: bool, slope: &mut [f64], curvature: &mut [f64]) {
    let count = x.len();
    assert!([y.len(), slope.len(), curvature.len()] == [count; 3]);
    let nearest = count.min(5);
    for i in 0..count {
        let first = i.saturating_sub(nearest / 2).min(count - nearest);
        let own = first..first + nearest;
        (slope[i], curvature[i]) = of_polynomial(x[i], &x[own.clone()], &y[own]);
    }
    let secant = |j: usize| (y[j + 1] - y[j]) / (x[j + 1] - x[j]);
    let turning = |j: usize| j > 0 && j + 1 < count && secant(j - 1) * secant(j) < 0.0;
    let limited = |j: usize| j + 1 < count && (within || !turning(j) && !turning(j + 1));
    let sign = |j: usize| if secant(j) < 0.0 { -1.0 } else { 1.0 };
    // In the direction of the rise 0 <= d, and 2 (d_0 + d_1)/5 < secant on every interval.
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
    // b_2 - b_1 = h d/5 + h^2 s/20, b_4 - b_3 = h d/5 - h^2 s/20,
    // b_3 - b_2 = h [secant - 2 (d_0 + d_1)/5] + h^2 (s_1 - s_0)/20
    for i in 0..count {
        let mut limit = [f64::NEG_INFINITY, f64::INFINITY];
        for (j, at_left) in [(i, true), (i.wrapping_sub(1), false)] {
            if j >= count || !limited(j) {
                continue;
            }
            let h = x[j + 1] - x[j];
            let room = (20.0 / h) * (secant(j) - 0.4 * (slope[j] + slope[j + 1])).abs();
            let own = 4.0 * slope[i].abs() / h;
            // s at the left end: s >= -own, s <= room/2; at the right end the other way round
            let (low, high) = if at_left { (-own, 0.5 * room) } else { (-0.5 * room, own) };
            let (low, high) = if sign(j) > 0.0 { (low, high) } else { (-high, -low) };
            limit = [limit[0].max(low), limit[1].min(high)];
        }
        curvature[i] = curvature[i].max(limit[0]).min(limit[1]);
    }
}

/// First and second derivative at `x0` of the polynomial through up to five points (Fornberg 1988).
fn of_polynomial(x0: f64, x: &[f64], y: &[f64]) -> (f64, f64) {
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

/// Coefficients of the quintic between two points a distance `h` apart, in powers of t from 0 to 1, with
/// `[value, slope, second derivative]` at both.
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

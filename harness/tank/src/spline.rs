//! A smooth curve through points.

use nalgebra::{DMatrix, DVector};

use crate::contour::Problems;
use crate::curve::{Curve, Point, Segment, cross, dot, norm, sub};

/// Between straight pieces that turn by more than this, rad, the curve keeps its corner.
const CORNER: f64 = 0.7;

/// More points are thinned out.
const MANY: usize = 100;

/// Cubic splines through the points, twice continuously differentiable between corners; a point
/// where the polyline turns by more than 40 degrees is a corner. At the axis the curve is level,
/// at its other ends and at corners its third derivative is constant over two intervals
/// (not-a-knot).
///
/// # Errors
/// Two equal points in succession.
pub(crate) fn spline(points: &[Point]) -> Result<Vec<Segment>, Problems> {
    let same: Vec<String> = points
        .windows(2)
        .enumerate()
        .filter(|(_, p)| p[0] == p[1])
        .map(|(i, p)| {
            format!("Points {} and {} are the same, ({}, {}) m.", i + 1, i + 2, p[0][0], p[0][1])
        })
        .collect();
    if !same.is_empty() {
        return Err(Problems(same));
    }
    let mut segments = Vec::with_capacity(points.len());
    let mut first = 0;
    for i in 1..points.len() {
        let last = i + 1 == points.len();
        let corner = !last && {
            let (a, b) = (sub(points[i], points[i - 1]), sub(points[i + 1], points[i]));
            cross(a, b).atan2(dot(a, b)).abs() > CORNER
        };
        if corner || last {
            smooth(&thinned(&points[first..=i], points.len()), &mut segments);
            first = i;
        }
    }
    Ok(segments)
}

/// Of very many points every k-th, both ends kept, so that all `total` points make some 100 segments.
fn thinned(points: &[Point], total: usize) -> Vec<Point> {
    let every = total.div_ceil(MANY);
    let last = points.len() - 1;
    let count = last.div_ceil(every);
    (0..=count).map(|i| points[(i * last) / count]).collect()
}

/// One spline, its parameter the length of the polyline.
fn smooth(points: &[Point], segments: &mut Vec<Segment>) {
    let count = points.len();
    let h: Vec<f64> = points.windows(2).map(|p| norm(sub(p[1], p[0]))).collect();
    if count == 2 {
        segments.push(Segment::line(points[0], points[1]));
        return;
    }
    // Slopes d at the points: continuity of the second derivative inside, conditions at the ends.
    let mut matrix = DMatrix::zeros(count, count);
    let mut right: [DVector<f64>; 2] = [DVector::zeros(count), DVector::zeros(count)];
    let secant = |i: usize, axis: usize| (points[i + 1][axis] - points[i][axis]) / h[i];
    for i in 1..count - 1 {
        matrix[(i, i - 1)] = h[i];
        matrix[(i, i)] = 2.0 * (h[i - 1] + h[i]);
        matrix[(i, i + 1)] = h[i - 1];
        for axis in 0..2 {
            right[axis][i] = 3.0 * (h[i] * secant(i - 1, axis) + h[i - 1] * secant(i, axis));
        }
    }
    for (row, a, b, inner) in [(0, 0, 1, 1), (count - 1, count - 2, count - 3, count - 2)] {
        let end = if row == 0 { points[0] } else { points[count - 1] };
        if end[0].abs() < 1e-12 {
            matrix[(row, row)] = 1.0;
            right[0][row] = if row == 0 { 1.0 } else { -1.0 };
            continue;
        }
        if count == 3 {
            // a parabola: the second derivatives at both ends of the interval agree
            matrix[(row, row)] = 1.0;
            matrix[(row, inner)] = 1.0;
            for axis in 0..2 {
                right[axis][row] = 2.0 * secant(a, axis);
            }
            continue;
        }
        let other = if row == 0 { 2 } else { count - 3 };
        matrix[(row, row)] = h[b] * h[b];
        matrix[(row, inner)] = h[b] * h[b] - h[a] * h[a];
        matrix[(row, other)] = -h[a] * h[a];
        for axis in 0..2 {
            right[axis][row] =
                2.0 * (h[b] * h[b] * secant(a, axis) - h[a] * h[a] * secant(b, axis));
        }
    }
    let lu = matrix.lu();
    let slopes = right.map(|r| lu.solve(&r).expect("a spline through distinct points exists"));
    for i in 0..count - 1 {
        let mut c = [[0.0; 2]; 4];
        for axis in 0..2 {
            let (d0, d1) = (h[i] * slopes[axis][i], h[i] * slopes[axis][i + 1]);
            let step = points[i + 1][axis] - points[i][axis];
            c[0][axis] = points[i][axis];
            c[1][axis] = d0;
            c[2][axis] = 3.0 * step - 2.0 * d0 - d1;
            c[3][axis] = d0 + d1 - 2.0 * step;
        }
        segments.push(Segment { curve: Curve::Cubic { c }, from: 0.0, to: 1.0 });
    }
}

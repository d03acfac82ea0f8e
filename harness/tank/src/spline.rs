//! A smooth curve through points.

use nalgebra::{DMatrix, DVector};

use crate::contour::Problems;
use crate::curve::{Curve, Point, Segment, cross, dot, norm, sub};

/// Smallest angle between two straight pieces of the polyline at which the curve keeps a corner,
/// rad.
const CORNER: f64 = 0.7;

const MANY: usize = 100;

/// Fits a curve of cubic splines through `points`, which is twice continuously differentiable
/// between corners. A point where the polyline turns by more than 40 degrees ([`CORNER`]) is a
/// corner. At the axis the curve is horizontal. At its other ends and at corners the third
/// derivative is constant over the first two intervals (not-a-knot).
///
/// # Errors
/// Two successive points that are equal.
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
            smooth(&thin_points(&points[first..=i], points.len()), &mut segments);
            first = i;
        }
    }
    Ok(segments)
}

fn thin_points(points: &[Point], total: usize) -> Vec<Point> {
    let every = total.div_ceil(MANY);
    let last = points.len() - 1;
    let count = last.div_ceil(every);
    (0..=count).map(|i| points[(i * last) / count]).collect()
}

fn smooth(points: &[Point], segments: &mut Vec<Segment>) {
    let count = points.len();
    let h: Vec<f64> = points.windows(2).map(|p| norm(sub(p[1], p[0]))).collect();
    if count == 2 {
        segments.push(Segment::line(points[0], points[1]));
        return;
    }
    // unknown slopes d at the points: the second derivative is continuous inside; two conditions at the ends
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
            // with three points the curve is a parabola, whose second derivatives at both ends of the interval agree
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the value and the first three derivatives, with respect to arc length of the
    /// polyline, at both ends of every piece of the spline.
    fn derivatives(points: &[Point]) -> Vec<[[Point; 4]; 2]> {
        let pieces = spline(points).unwrap();
        let one = |(segment, p): (&Segment, &[Point])| {
            let Curve::Cubic { c } = &segment.curve else { panic!("{:?}", segment.curve) };
            let h = norm(sub(p[1], p[0]));
            let at = |t: f64| {
                let coordinate = |i: usize| {
                    [
                        c[0][i] + t * (c[1][i] + t * (c[2][i] + t * c[3][i])),
                        (c[1][i] + t * (2.0 * c[2][i] + t * 3.0 * c[3][i])) / h,
                        (2.0 * c[2][i] + t * 6.0 * c[3][i]) / (h * h),
                        6.0 * c[3][i] / (h * h * h),
                    ]
                };
                let (r, z) = (coordinate(0), coordinate(1));
                [0, 1, 2, 3].map(|n| [r[n], z[n]])
            };
            [at(0.0), at(1.0)]
        };
        pieces.iter().zip(points.windows(2)).map(one).collect()
    }

    fn near(a: Point, b: Point) {
        // Second and third derivatives are of the order of 10 and 100, and come from the solution of a linear system.
        assert!(norm(sub(a, b)) < 1e-10 * (1.0 + norm(b)), "{a:?} {b:?}");
    }

    const POINTS: [Point; 6] =
        [[1.0, 0.0], [1.3, 0.2], [1.4, 0.5], [1.35, 0.9], [1.1, 1.2], [0.9, 1.3]];

    #[test]
    fn a_spline_passes_through_its_points_and_is_twice_continuously_differentiable() {
        let all = derivatives(&POINTS);
        assert_eq!(all.len(), 5);
        for (piece, p) in all.iter().zip(POINTS.windows(2)) {
            near(piece[0][0], p[0]);
            near(piece[1][0], p[1]);
        }
        for pair in all.windows(2) {
            near(pair[0][1][1], pair[1][0][1]);
            near(pair[0][1][2], pair[1][0][2]);
        }
    }

    #[test]
    fn away_from_the_axis_the_first_two_pieces_of_a_spline_are_one_cubic_and_so_are_the_last_two() {
        let all = derivatives(&POINTS);
        near(all[0][0][3], all[1][0][3]);
        near(all[3][0][3], all[4][0][3]);
        assert!(norm(sub(all[1][0][3], all[2][0][3])) > 1.0);
        // Three points determine one parabola.
        for piece in derivatives(&POINTS[..3]) {
            near(piece[0][3], [0.0, 0.0]);
        }
    }

    #[test]
    fn a_spline_that_ends_on_the_axis_is_perpendicular_to_the_axis() {
        let mut dome = [0.0, 0.4, 0.9, 1.5, 2.0, 2.6, 3.0].map(|a: f64| [a.sin(), 1.0 - a.cos()]);
        dome[6] = [0.0, 2.0];
        let all = derivatives(&dome);
        near(all[0][0][1], [1.0, 0.0]);
        near(all[5][1][1], [-1.0, 0.0]);
    }

    #[test]
    fn a_spline_keeps_corners_and_thins_out_more_than_100_points() {
        let corner = spline(&[[1.0, 0.0], [1.0, 1.0], [2.0, 1.0]]).unwrap();
        assert!(corner.iter().all(|segment| !matches!(segment.curve, Curve::Cubic { .. })));
        let arc = |n: usize| -> Vec<Point> {
            let angle = |i: usize| 0.01 + 1.5 * i as f64 / (n - 1) as f64;
            (0..n).map(|i| [angle(i).sin(), 1.0 - angle(i).cos()]).collect()
        };
        for (points, pieces) in [(100, 99), (101, 50), (250, 83), (251, 84)] {
            let segments = spline(&arc(points)).unwrap();
            assert_eq!(segments.len(), pieces);
            let Curve::Cubic { c } = segments[pieces - 1].curve else { panic!() };
            let end = [0, 1].map(|i| c[0][i] + c[1][i] + c[2][i] + c[3][i]);
            near(end, arc(points)[points - 1]);
        }
    }

    #[test]
    fn the_error_about_equal_points_of_a_spline_names_all_of_them() {
        let p = [1.0, 0.5];
        let message = spline(&[p, p, [1.0, 1.0], p, p]).unwrap_err().to_string();
        assert!(message.contains("Points 1 and 2 are the same, (1, 0.5) m."), "{message}");
        assert!(message.contains("Points 4 and 5"), "{message}");
    }
}

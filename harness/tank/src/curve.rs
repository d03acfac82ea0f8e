//! A smooth segment of a tank's generating curve in the half plane (r, z).

use core::f64::consts::TAU;

pub type Point = [f64; 2];

pub(crate) fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

pub(crate) fn add(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1]]
}

pub(crate) fn norm(a: Point) -> f64 {
    (a[0] * a[0] + a[1] * a[1]).sqrt()
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(crate) fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Shapes of a segment of a contour, lengths in m. Each shape has its own parameter t.
///
/// - `Line`: straight from one point to the other, t = 0..1.
/// - `Ellipse`: center + (a_r cos t, a_z sin t) with the eccentric angle t, rad; a circle has a_r =
///   a_z.
/// - `Cassini`: oval about (0, zc), a > c, with the foci at the distance c from its centre. At the
///   polar angle t, rad, the distance rho from the centre follows from rho^2 = c^2 cos 2t +
///   sqrt(a^4 - c^4 sin^2 2t).
/// - `Cosine`: r = r0 + r1 cos(pi p); p and z are linear in t = 0..1.
/// - `Cubic`: c_0 + c_1 t + c_2 t^2 + c_3 t^3, t = 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    Line { from: Point, to: Point },
    Ellipse { center: Point, a_r: f64, a_z: f64 },
    Cassini { zc: f64, a: f64, c: f64 },
    Cosine { r0: f64, r1: f64, z: [f64; 2], p: [f64; 2] },
    Cubic { c: [Point; 4] },
}

/// Nodes and weights of Gauss quadrature with 8 points on -1..1; the list has the positive nodes
/// (DLMF 3.5.15).
const GAUSS8: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_29),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_47),
    (0.960_289_856_497_536_2, 0.101_228_536_290_376_26),
];

impl Curve {
    pub fn point_at(&self, t: f64) -> Point {
        match *self {
            Curve::Line { from, to } => {
                [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])]
            }
            Curve::Ellipse { center, a_r, a_z } => {
                [center[0] + a_r * t.cos(), center[1] + a_z * t.sin()]
            }
            Curve::Cassini { zc, a, c } => {
                let rho = cassini(a, c, t).0;
                [rho * t.cos(), zc + rho * t.sin()]
            }
            Curve::Cosine { r0, r1, z, p } => {
                let phase = core::f64::consts::PI * (p[0] + t * (p[1] - p[0]));
                [r0 + r1 * phase.cos(), z[0] + t * (z[1] - z[0])]
            }
            Curve::Cubic { c } => {
                core::array::from_fn(|i| c[0][i] + t * (c[1][i] + t * (c[2][i] + t * c[3][i])))
            }
        }
    }

    pub fn slope(&self, t: f64) -> Point {
        match *self {
            Curve::Line { from, to } => sub(to, from),
            Curve::Ellipse { a_r, a_z, .. } => [-a_r * t.sin(), a_z * t.cos()],
            Curve::Cassini { a, c, .. } => {
                let (rho, slope) = cassini(a, c, t);
                let (sin, cos) = t.sin_cos();
                [slope * cos - rho * sin, slope * sin + rho * cos]
            }
            Curve::Cosine { r1, z, p, .. } => {
                let rate = core::f64::consts::PI * (p[1] - p[0]);
                let phase = core::f64::consts::PI * p[0] + t * rate;
                [-r1 * rate * phase.sin(), z[1] - z[0]]
            }
            Curve::Cubic { c } => {
                core::array::from_fn(|i| c[1][i] + t * (2.0 * c[2][i] + 3.0 * t * c[3][i]))
            }
        }
    }

    /// Returns the vector from the point at the parameter `t` to the point at `t + dt`, to full
    /// relative accuracy for any `dt`. The kernels of the integral equation need it, because
    /// differences of coordinates lose all digits near a corner.
    pub fn chord(&self, t: f64, dt: f64) -> Point {
        match *self {
            Curve::Line { from, to } => [dt * (to[0] - from[0]), dt * (to[1] - from[1])],
            Curve::Ellipse { a_r, a_z, .. } => {
                let twice = 2.0 * (0.5 * dt).sin();
                let (sin, cos) = (t + 0.5 * dt).sin_cos();
                [-a_r * twice * sin, a_z * twice * cos]
            }
            Curve::Cubic { c } => {
                let u = t + dt;
                core::array::from_fn(|i| {
                    dt * (c[1][i] + c[2][i] * (t + u) + c[3][i] * (t * t + t * u + u * u))
                })
            }
            Curve::Cassini { .. } | Curve::Cosine { .. } if dt.abs() > 0.1 => {
                sub(self.point_at(t + dt), self.point_at(t))
            }
            Curve::Cassini { .. } | Curve::Cosine { .. } => {
                let mut sum = [0.0; 2];
                for (x, w) in GAUSS8 {
                    for side in [-x, x] {
                        let slope = self.slope(t + 0.5 * dt * (1.0 + side));
                        sum = add(sum, [w * slope[0], w * slope[1]]);
                    }
                }
                [0.5 * dt * sum[0], 0.5 * dt * sum[1]]
            }
        }
    }
}

fn cassini(a: f64, c: f64, t: f64) -> (f64, f64) {
    let (sin, cos) = (2.0 * t).sin_cos();
    let root = (a.powi(4) - c.powi(4) * sin * sin).sqrt();
    let rho = (c * c * cos + root).sqrt();
    let slope = -2.0 * c * c * sin - 2.0 * c.powi(4) * sin * cos / root;
    (rho, slope / (2.0 * rho))
}

/// Part of a curve between the values `from` and `to` of its parameter, in the direction from
/// `from` to `to`. `to` may be smaller than `from`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    pub curve: Curve,
    pub from: f64,
    pub to: f64,
}

impl Segment {
    pub fn line(from: Point, to: Point) -> Segment {
        Segment { curve: Curve::Line { from, to }, from: 0.0, to: 1.0 }
    }

    /// Creates an arc of an ellipse with the semi-axes `a_r` and `a_z`, m, from the eccentric angle
    /// `deg0` to `deg1`, degrees. With equal semi-axes it is an arc of a circle.
    pub fn ellipse(center: Point, a_r: f64, a_z: f64, deg0: f64, deg1: f64) -> Segment {
        let (from, to) = (deg0.to_radians(), deg1.to_radians());
        Segment { curve: Curve::Ellipse { center, a_r, a_z }, from, to }
    }

    pub fn arc(center: Point, radius: f64, deg0: f64, deg1: f64) -> Segment {
        Segment::ellipse(center, radius, radius, deg0, deg1)
    }

    /// Returns the first point of the segment. If it is within rounding errors of the axis, it is
    /// put exactly on the axis, because cos(pi/2) is not 0 in floating point.
    pub fn start(&self) -> Point {
        self.settle(self.curve.point_at(self.from))
    }

    pub fn end(&self) -> Point {
        self.settle(self.curve.point_at(self.to))
    }

    fn settle(&self, p: Point) -> Point {
        let size = self.size();
        [if p[0].abs() < 1e-14 * size { 0.0 } else { p[0] }, p[1]]
    }

    pub fn size(&self) -> f64 {
        match self.curve {
            Curve::Line { from, to } => norm(sub(to, from)),
            Curve::Ellipse { a_r, a_z, .. } => a_r.abs().max(a_z.abs()),
            Curve::Cassini { a, .. } => a,
            Curve::Cosine { z, .. } => (z[1] - z[0]).abs(),
            Curve::Cubic { c } => norm(add(c[1], add(c[2], c[3]))),
        }
    }

    pub fn tangent(&self, s: f64) -> Point {
        let sign = if self.to > self.from { 1.0 } else { -1.0 };
        let slope = self.curve.slope(self.from + s * (self.to - self.from));
        let length = norm(slope);
        [sign * slope[0] / length, sign * slope[1] / length]
    }

    pub fn point_at(&self, s: f64) -> Point {
        self.curve.point_at(self.from + s * (self.to - self.from))
    }

    /// Returns the angle through which the tangent turns along the segment, rad. For an ellipse it
    /// is an upper bound.
    pub(crate) fn turn(&self) -> f64 {
        let count = 32;
        let mut total = 0.0;
        for i in 0..count {
            let (a, b) = (
                self.tangent(i as f64 / count as f64),
                self.tangent((i + 1) as f64 / count as f64),
            );
            total += cross(a, b).atan2(dot(a, b)).abs();
        }
        total.min(TAU)
    }

    pub(crate) fn part(&self, from: f64, to: f64) -> Segment {
        Segment { curve: self.curve, from, to }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_difference_of_two_close_points_on_a_curve_has_no_cancellation() {
        let curves = [
            Curve::Line { from: [0.1, 0.2], to: [1.0, -0.4] },
            Curve::Ellipse { center: [0.3, 0.4], a_r: 1.2, a_z: 0.7 },
            Curve::Cassini { zc: 0.8, a: 1.0, c: 0.6 },
            Curve::Cosine { r0: 1.0, r1: 0.4, z: [0.5, 2.5], p: [0.2, 1.7] },
            Curve::Cubic { c: [[0.1, 0.0], [1.0, 0.2], [-0.3, 0.5], [0.2, -0.1]] },
        ];
        for curve in curves {
            // error of the finite difference: at most an eighth of the squared interval times the third derivative, 40
            let [before, after] = [0.3999, 0.4001].map(|t| curve.point_at(t));
            let slope = sub(after, before).map(|d| d / 2e-4);
            assert!(norm(sub(slope, curve.slope(0.4))) < 1e-6, "{curve:?}");
            for dt in [0.5, -0.09, 1e-3] {
                let (chord, plain) =
                    (curve.chord(0.4, dt), sub(curve.point_at(0.4 + dt), curve.point_at(0.4)));
                assert!(norm(sub(chord, plain)) < 4e-16, "{curve:?} {dt}");
            }
            // With a step of 1e-12 a difference of coordinates would have only four digits.
            let (chord, slope) = (curve.chord(0.4, 1e-12), curve.slope(0.4));
            assert!(norm(sub(chord, [1e-12 * slope[0], 1e-12 * slope[1]])) < 1e-23, "{curve:?}");
        }
    }
}

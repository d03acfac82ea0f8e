//! Dependence of the first mode's frequency on its amplitude, in a tank with vertical walls and a flat bottom:
//! potential flow to third order.
//!
//! The surface elevation eta and the surface potential Phi are canonical variables (Zakharov 1968) with
//!
//! ```text
//! L = int Phi eta_t dS - H,   H = (1/2) int (Phi G Phi + g eta^2) dS
//! G_0 = D tanh(h D),  G_1 = D.(eta D) - G_0 eta G_0                       (Craig and Sulem 1993)
//! G_2 = -(1/2) (D^2 eta^2 G_0 + G_0 eta^2 D^2 - 2 G_0 eta G_0 eta G_0)
//! ```
//!
//! These equations hold unchanged for vertical walls, because products of functions with zero slope at the wall also
//! have zero slope there. With g = 1, psi is the first mode of the cross-section, with wave number k and T = k tanh k h
//! = omega^2. A wave that consists of two modes X and Y of this frequency,
//!
//! ```text
//! eta = a (X cos wt + Y sin wt),   Phi = b (X sin wt - Y cos wt)
//! planar     X = psi, Y = 0        circular   X and Y: psi and psi turned by 90 degrees
//! ```
//!
//! excites the modes chi (wave number kappa, t = kappa tanh kappa h) at the frequencies 0 and 2 omega:
//!
//! ```text
//! eta_2 = sum (p_0 + p_2 cos 2wt + q_2 sin 2wt) chi,   Phi_2 = sum (f sin 2wt + g cos 2wt) chi
//! ```
//!
//! L averaged over a period is stationary with respect to p_0, p_2, q_2, f and g. The remaining L = L_2 a^2 + L_4 a^4
//! is stationary with respect to a, which is the nonlinear dispersion relation (Whitham 1974). The integrals in L_4 are
//! C = int chi psi^2, N = int chi^2 and, because grad psi.grad psi = k^2 psi^2 + (1/2) Lap psi^2,
//!
//! ```text
//! int chi |grad psi|^2 = (k^2 - kappa^2/2) C,   int psi grad psi.grad chi = (kappa^2/2) C
//! int psi^2 G_0 psi^2 = sum t C^2/N
//! ```
//!
//! and likewise for X^2, Y^2 and X Y. The cross-section enters only through k, C, N and int psi^4.
//!
//! The equivalent mass on a surface, with q/l the slosh angle,
//!
//! ```text
//! L = (1/2) m (q'^2 + s (q.q')^2/l^2) - (1/2) m omega^2 (q^2 + kappa q^4/(4 l^2))
//! ```
//!
//! has the shifts (3/8) kappa - s/2 (planar) and kappa/2 (circular) of omega^2 per squared angle;
//! they determine s and kappa. A pendulum is s = kappa = 1: -1/8 and +1/2.

use core::f64::consts::PI;

use nalgebra::{DMatrix, Matrix2, Vector2};

use crate::gauss::{Gauss, legendre, legendre_slopes};

/// Relative difference between twice the frequency of the first mode and the frequency of an
/// excited mode below which the third-order theory is not valid.
pub const DETUNING: f64 = 0.01;

/// A mode that the square of the first mode excites.
///
/// - `kappa`: its wave number, 1/m.
/// - `mode`: in round sections the azimuthal number, in sectors the number of half waves over the
///   angle, each followed by the number of the mode counted from 1; in boxes the numbers of half
///   waves along the motion and across it.
/// - `planar`, `circular`: for planar and for circular motion, two squared overlap integrals of the
///   shape chi of this mode with squares of the first mode psi, divided by int chi^2 and int psi^2.
///   The first element is the overlap with (X^2 + Y^2)/2, which excites the frequency 0. The second
///   element is the overlap with (X^2 - Y^2)/2 and X Y, which excite twice the frequency of the
///   first mode. X and Y are the elevations of the first mode at two instants a quarter of a period
///   apart.
/// - `at_wall`: chi at the wall times int chi psi^2/int chi^2, for planar motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excited {
    pub mode: [usize; 2],
    pub kappa: f64,
    pub planar: [f64; 2],
    pub circular: [f64; 2],
    pub at_wall: f64,
}

/// The first mode psi of a tank's cross-section and the modes that its square excites. They do not
/// depend on the depth.
///
/// - `k`: wave number of the first mode, 1/m.
/// - `amplitude`: amplitude of the elevation per slosh angle, m: int psi x/int psi^2, with x along
///   the motion.
/// - `fourth`: int psi^4/int psi^2 of planar motion, and 2 int [(X^2 - Y^2)^2/4 + X^2 Y^2]/int
///   psi^2 of circular motion (for X and Y see [`Excited`]); `None` if the section has no circular
///   motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlaps {
    pub k: f64,
    pub fourth: [Option<f64>; 2],
    pub amplitude: f64,
    pub excited: Vec<Excited>,
}

impl Overlaps {
    pub fn new(count: usize) -> Overlaps {
        Overlaps::round(0.0, 1.0, count)
    }

    /// Computes the overlap integrals of a circular (`inner` = 0) or annular section with `count`
    /// modes of each azimuthal number. The radii are in m.
    pub fn round(inner: f64, outer: f64, count: usize) -> Overlaps {
        let [first, mean, double] = [1.0, 0.0, 2.0].map(|nu| Radial::new(inner, outer, nu, count));
        Overlaps::from_waves(&first, &mean, &double)
    }

    /// Computes the overlap integrals of the first mode u(r) cos(nu theta) with the modes that its
    /// square excites. `first` are the modes of the azimuthal order nu, beginning with the first
    /// mode. `mean` are the modes of the order 0, and `double` the modes of the order 2 nu.
    fn from_waves(first: &Radial, mean: &Radial, double: &Radial) -> Overlaps {
        let psi = first.mode(0);
        let mut excited = Vec::new();
        for (waves, radial) in [(0, mean), (2, double)] {
            for n in 0..radial.kappa.len() {
                let chi = radial.mode(n);
                let c = radial.integral(|i| psi[i] * psi[i] * chi[i]);
                // times the integrals over theta of cos^2 or sin^2 of nu theta with 1, or with cos or sin of 2 nu theta
                let [planar, circular] = match waves {
                    0 => [[c * c / 8.0; 2], [c * c / 2.0, 0.0]],
                    _ => [[c * c / 16.0; 2], [0.0, c * c / 2.0]],
                };
                let at_wall = 0.5 * c * radial.at_wall[n];
                excited.push(Excited {
                    mode: [waves, n + 1],
                    kappa: radial.kappa[n],
                    planar,
                    circular,
                    at_wall,
                });
            }
        }
        let fourth = first.integral(|i| psi[i].powi(4));
        Overlaps {
            k: first.kappa[0],
            fourth: [Some(0.75 * fourth), Some(fourth)],
            amplitude: first.integral(|i| psi[i] * first.r[i]),
            excited,
        }
    }

    /// Computes the overlap integrals of a rectangular box for motion along its side of the length
    /// `length`, m.
    pub fn rectangle(length: f64) -> Overlaps {
        let k = PI / length;
        Overlaps {
            k,
            fourth: [Some(0.75), None],
            amplitude: 4.0 / (length * k * k),
            excited: vec![Excited {
                mode: [2, 0],
                kappa: 2.0 * k,
                planar: [1.0 / 16.0; 2],
                circular: [0.0; 2],
                at_wall: 0.5,
            }],
        }
    }

    /// Computes the overlap integrals of a square box with sides of the length `length`, m, for
    /// planar motion along its sides or, if `diagonal` is true, along a diagonal.
    pub fn square(length: f64, diagonal: bool) -> Overlaps {
        let k = PI / length;
        let double = [([2, 0], [0.5, 0.25]), ([0, 2], [0.0, 0.25])];
        let mut excited: Vec<Excited> = double
            .map(|(mode, [side, along])| Excited {
                mode,
                kappa: 2.0 * k,
                planar: [if diagonal { along * along } else { side * side } / 4.0; 2],
                circular: [1.0 / 16.0; 2],
                at_wall: if diagonal { along } else { side },
            })
            .to_vec();
        excited.push(Excited {
            mode: [1, 1],
            kappa: core::f64::consts::SQRT_2 * k,
            planar: [if diagonal { 1.0 / 8.0 } else { 0.0 }; 2],
            circular: [0.0, 0.5],
            at_wall: if diagonal { 1.0 } else { 0.0 },
        });
        Overlaps {
            fourth: [Some(if diagonal { 9.0 / 8.0 } else { 0.75 }), Some(1.25)],
            excited,
            ..Overlaps::rectangle(length)
        }
    }

    /// Returns the relative shifts of the squared frequency per squared slosh angle, in planar and
    /// in circular motion, at the depth `depth`, m. If the section has no circular motion, its
    /// shift is 0.
    pub fn shifts(&self, depth: f64) -> [f64; 2] {
        self.detuned_shifts(depth, 0.0)
    }

    /// Returns the shifts of the squared frequency as [`Overlaps::shifts`] does, but with the
    /// response of the excited modes at the frequency 2 omega (1 + `detuning`). A large difference
    /// shows that a pole of the theory is close.
    pub(crate) fn detuned_shifts(&self, depth: f64, detuning: f64) -> [f64; 2] {
        let [t_1, _, b] = self.wave(depth);
        let k2 = self.k * self.k;
        let mut l_4 = [0.5, 1.0].map(|part| part * b * b / 8.0 * k2 * t_1);
        for (l_4, fourth) in l_4.iter_mut().zip(self.fourth) {
            *l_4 *= fourth.unwrap_or(0.0);
        }
        for mode in &self.excited {
            let Response { t, elevated, matrix, vector } = self.response(mode, depth, detuning);
            let mean = 2.0 * (b * b * elevated / 4.0).powi(2);
            let double = 4.0 * (stationary(matrix, vector) - b * b / 16.0 * t_1 * t_1 * t);
            for (l_4, weight) in l_4.iter_mut().zip([mode.planar, mode.circular]) {
                *l_4 += weight[0] * mean + weight[1] * double;
            }
        }
        // a is stationary: a (omega^2/T - 1)/2 + 4 L_4 a^3 = 0; in circular motion both terms are doubled.
        let amplitude2 = self.amplitude * self.amplitude;
        [-8.0 * l_4[0] * amplitude2, -4.0 * l_4[1] * amplitude2]
    }

    /// Returns the coefficients s and kappa of the equivalent mass at the depth `depth`, m. If the
    /// section has no circular motion, s is 1 and kappa gives the planar shift.
    pub fn equivalent(&self, depth: f64) -> [f64; 2] {
        self.detuned_equivalent(depth, 0.0)
    }

    pub(crate) fn detuned_equivalent(&self, depth: f64, detuning: f64) -> [f64; 2] {
        let [planar, circular] = self.detuned_shifts(depth, detuning);
        if self.fourth[1].is_none() {
            return [1.0, 8.0 / 3.0 * (planar + 0.5)];
        }
        let kappa = 2.0 * circular;
        [0.75 * kappa - 2.0 * planar, kappa]
    }

    /// Returns the second-order elevation at the wall per squared slosh angle, m, at the instant
    /// when planar motion has its largest elevation there. It adds to the crest and subtracts from
    /// the trough.
    pub fn second_wave(&self, depth: f64) -> f64 {
        let [_, _, b] = self.wave(depth);
        let elevation = |mode: &Excited| {
            let Response { elevated, matrix, vector, .. } = self.response(mode, depth, 0.0);
            let mean = -b * b * elevated / 4.0;
            mode.at_wall * (mean - (inverse(matrix) * vector)[0])
        };
        self.amplitude * self.amplitude * self.excited.iter().map(elevation).sum::<f64>()
    }

    /// Returns three quantities of the first mode at the depth `depth`, m, with g = 1: k tanh(k h),
    /// the frequency, and the ratio of the first-order amplitudes of its potential and its
    /// elevation.
    fn wave(&self, depth: f64) -> [f64; 3] {
        let t_1 = self.k * (self.k * depth).tanh();
        // The last element follows from the first-order equation eta_t = G_0 Phi.
        [t_1, t_1.sqrt(), -t_1.sqrt() / t_1]
    }

    fn response(&self, mode: &Excited, depth: f64, detuning: f64) -> Response {
        let [t_1, omega, b] = self.wave(depth);
        let t = mode.kappa * (mode.kappa * depth).tanh();
        // int chi (|grad psi|^2 - (G_0 psi)^2) and int psi (grad psi.grad chi - G_0 psi G_0 chi), both divided by C
        let elevated = self.k * self.k - mode.kappa * mode.kappa / 2.0 - t_1 * t_1;
        let carried = mode.kappa * mode.kappa / 2.0 - t_1 * t;
        let driven = omega * (1.0 + detuning);
        Response {
            t,
            elevated,
            matrix: Matrix2::new(-0.5, -driven, -driven, -0.5 * t),
            vector: Vector2::new(b * b * elevated / 8.0, -b * carried / 4.0),
        }
    }

    /// Returns the excited mode whose frequency is within [`DETUNING`] of twice the first mode's
    /// frequency at the depth `depth`, m, or `None` if there is no such mode.
    pub fn secondary_resonance(&self, depth: f64) -> Option<[usize; 2]> {
        let [t_1, ..] = self.wave(depth);
        let near = |mode: &&Excited| {
            let t = mode.kappa * (mode.kappa * depth).tanh();
            ((4.0 * t_1 / t).sqrt() - 1.0).abs() < DETUNING
        };
        self.excited.iter().find(near).map(|mode| mode.mode)
    }
}

/// Equations for an excited mode with the wave number kappa at the depth h. They are divided by the
/// overlap integral of this mode with the square of the first mode. `t` is kappa tanh(kappa h).
/// `elevated` is the quantity to which the constant elevation is proportional. The elevation and
/// the potential at twice the frequency of the first mode are the two elements of a vector x with
/// `matrix` x + `vector` = 0.
struct Response {
    t: f64,
    elevated: f64,
    matrix: Matrix2<f64>,
    vector: Vector2<f64>,
}

fn inverse(m: Matrix2<f64>) -> Matrix2<f64> {
    let [a, b, c, d] = [m[(0, 0)], m[(0, 1)], m[(1, 0)], m[(1, 1)]];
    Matrix2::new(d, -b, -c, a) / (a * d - b * c)
}

fn stationary(m: Matrix2<f64>, v: Vector2<f64>) -> f64 {
    -0.5 * v.dot(&(inverse(m) * v))
}

/// Radial parts u(r) of the modes of the order nu in a circular or annular section, by Galerkin's
/// method. They obey (r u')'/r + (kappa^2 - nu^2/r^2) u = 0 with u' = 0 at the walls and int u^2 r
/// dr = 1; a constant is not a mode.
///
/// - `r`, `weights`: points, m, and weights of the quadrature; the weights include r dr.
/// - `kappa`: wave numbers, 1/m, ascending.
/// - `values`: u at the points, one mode a column.
/// - `at_wall`: u of each mode at the outer wall.
struct Radial {
    r: Vec<f64>,
    weights: Vec<f64>,
    kappa: Vec<f64>,
    values: DMatrix<f64>,
    at_wall: Vec<f64>,
}

impl Radial {
    fn new(inner: f64, outer: f64, nu: f64, count: usize) -> Radial {
        let size = count + count / 2 + 16;
        let rule = Gauss::new(4 * size);
        // In a circle, r = outer s^2 makes r^nu smooth. The last point, s = 1, is at the wall.
        let place = |s: f64| match inner {
            0.0 => (outer * s * s, 2.0 * outer * s),
            _ => (inner + (outer - inner) * s, outer - inner),
        };
        let basis = |s: f64| match inner {
            0.0 => circle_basis(nu, s.powi(4), size, outer),
            _ => ring_basis(s, size, outer - inner),
        };
        let (mut r, mut weights) = (Vec::new(), Vec::new());
        let mut values = DMatrix::zeros(rule.nodes.len(), size);
        let [mut mass, mut stiffness] = [0, 1].map(|_| DMatrix::zeros(rule.nodes.len(), size));
        let mut over_r = mass.clone();
        for (i, (s, w)) in rule.nodes.iter().zip(&rule.weights).enumerate() {
            let (radius, slope) = place(*s);
            let weight = w * slope * radius;
            for (j, (u, du)) in basis(*s).into_iter().enumerate() {
                values[(i, j)] = u;
                mass[(i, j)] = u * weight.sqrt();
                stiffness[(i, j)] = du * weight.sqrt();
                over_r[(i, j)] = nu / radius * u * weight.sqrt();
            }
            r.push(radius);
            weights.push(weight);
        }
        let (mass, stiffness) =
            (mass.tr_mul(&mass), stiffness.tr_mul(&stiffness) + over_r.tr_mul(&over_r));
        // The base functions are linearly independent, so that the Cholesky factor exists.
        let factor = mass.cholesky().map_or_else(|| DMatrix::identity(size, size), |c| c.l());
        let half = factor.solve_lower_triangular(&stiffness).unwrap_or_else(|| stiffness.clone());
        let whole = factor.solve_lower_triangular(&half.transpose()).unwrap_or(half);
        let eigen = (0.5 * (&whole + whole.transpose())).symmetric_eigen();
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let constant = usize::from(nu == 0.0);
        let order = &order[constant..constant + count];
        let vectors = DMatrix::from_fn(size, count, |i, j| eigen.eigenvectors[(i, order[j])]);
        let vectors = factor.tr_solve_lower_triangular(&vectors).unwrap_or(vectors);
        let wall = DMatrix::from_iterator(1, size, basis(1.0).into_iter().map(|(u, _)| u));
        Radial {
            r,
            weights,
            kappa: order.iter().map(|i| eigen.eigenvalues[*i].max(0.0).sqrt()).collect(),
            values: values * &vectors,
            at_wall: (wall * &vectors).iter().copied().collect(),
        }
    }

    fn mode(&self, n: usize) -> Vec<f64> {
        self.values.column(n).iter().copied().collect()
    }

    fn integral(&self, f: impl Fn(usize) -> f64) -> f64 {
        self.weights.iter().enumerate().map(|(i, w)| w * f(i)).sum()
    }
}

/// Returns `size` orthonormal functions on a disc of the radius R = `outer`, and their derivatives
/// with respect to r, at x = (r/R)^2. They are (r/R)^nu P_j^(0,nu)(2 x - 1) by the recurrence DLMF
/// 18.9.2.
pub(crate) fn circle_basis(nu: f64, x: f64, size: usize, outer: f64) -> Vec<(f64, f64)> {
    let y = 2.0 * x - 1.0;
    let (mut p, mut slope) = ((1.0, 1.0 + 0.5 * (nu + 2.0) * (y - 1.0)), (0.0, 0.5 * (nu + 2.0)));
    let radius = x.sqrt();
    let power = radius.powf(nu);
    let mut all = Vec::with_capacity(size);
    for j in 0..size {
        let j = j as f64;
        let norm = (2.0 * (2.0 * j + nu + 1.0)).sqrt() / outer;
        let along = nu * power / radius * p.0 + power * 4.0 * radius * slope.0;
        all.push((norm * power * p.0, norm * along / outer));
        let n = j + 1.0;
        let twice = 2.0 * n + nu;
        let front = (twice + 1.0) / (2.0 * (n + 1.0) * (n + nu + 1.0) * twice);
        let [linear, constant] = [front * (twice + 2.0) * twice, -front * nu * nu];
        let before = n * (n + nu) * (twice + 2.0) / ((n + 1.0) * (n + nu + 1.0) * twice);
        p = (p.1, (linear * y + constant) * p.1 - before * p.0);
        // derivatives with respect to y by the recurrence; p.0 is the polynomial of the previous degree
        slope = (slope.1, linear * p.0 + (linear * y + constant) * slope.1 - before * slope.0);
    }
    all
}

fn ring_basis(s: f64, size: usize, width: f64) -> Vec<(f64, f64)> {
    let (mut values, mut slopes) = (vec![0.0; size], vec![0.0; size]);
    legendre(s, &mut values);
    legendre_slopes(s, &mut slopes);
    values.into_iter().zip(slopes.into_iter().map(|slope| slope / width)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reference is table 9.5 of Abramowitz and Stegun, to more digits. The zero of J0' at 0
    /// does not belong to a mode. The tolerance covers the rounding error of the largest
    /// eigenvalue, about 1e6.
    #[test]
    fn wave_numbers_of_the_circle_equal_those_of_the_tables() {
        for (nu, known) in [
            (0.0, [3.831_705_970_207_512, 7.015_586_669_815_619, 10.173_468_135_062_722]),
            (1.0, [1.841_183_781_340_659, 5.331_442_773_525_033, 8.536_316_366_346_285]),
            (2.0, [3.054_236_928_227_14, 6.706_133_194_158_459, 9.969_467_823_087_596]),
        ] {
            let found = Radial::new(0.0, 2.0, nu, 40);
            for (x, known) in found.kappa.iter().zip(known) {
                assert!((2.0 * x / known - 1.0).abs() < 1e-9, "{nu}: {x} {known}");
            }
        }
    }
}

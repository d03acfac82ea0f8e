//! Dependence of the first mode's frequency on its amplitude, for a body of revolution of any contour: potential flow
//! to third order, by a variational method.
//!
//! The coordinates follow the wall. A point of the liquid is (rho, theta, z) with the radius r = r(rho, z): a line of
//! constant rho and theta begins at the radius rho of the surface at rest, z = z_F, and runs inside the tank. The
//! outermost line, rho = R, is the wall. The volume element is w rho drho dtheta dz with w = r r_rho/rho. The surface
//! is at z = z_F + zeta(rho, theta, t). The potential is phi = sum c_j(t) u_j with harmonic functions u_j. Q(t) is the
//! liquid, and Q0 the liquid at rest. Luke's variational principle (J. Fluid Mech. 27 (1967) 395) reads
//!
//! ```text
//! L = sum c_j d/dt int_Q u_j dV - (1/2) int_Q |grad phi|^2 dV - g int_Q (z - z_F) dV
//! int_Q B dV = int_Q0 B dV + int [B w zeta + (B w)_z zeta^2/2 + (B w)_zz zeta^3/6 + ...] rho drho dtheta
//! ```
//!
//! where B is any function of the point, and the derivatives are taken along the lines, at the surface at rest, so that
//! only slope and curvature of the wall at the contact line enter. Every elevation zeta is allowed, because the lines
//! do not leave the tank. Miles (1976) and Lukovsky use this principle for vertical walls and for cones. A wave with
//! the amplitude a and the frequency omega (w in wt) has, to first order, zeta = a f(rho) E and phi = -omega a U(r, z)
//! S, where f and U are the shapes of the first mode and
//!
//! ```text
//! planar     E = cos theta cos wt,    S = cos theta sin wt
//! circular   E = cos(wt - theta),     S = sin(wt - theta)
//! ```
//!
//! The second order adds p P + r Z to zeta and d F to phi, with the coefficients p, r and d. The shape P is constant in
//! time, Z and F have the frequency 2 omega; their azimuthal numbers are 0 and 2. L averaged over a period is
//! stationary with respect to p, r and d, with constant volume as a constraint. The remaining L_2 a^2 + L_4 a^4 is
//! stationary with respect to a, as in `third_order.rs`. Fields of the third order do not contribute, because L is
//! stationary at the first order.
//!
//! The u_j are the solid harmonics r^m, z r^m, ... about a point on the axis; zeta is a sum of polynomials in rho. Both
//! are complete in a liquid without holes. The result does not depend on the choice of the lines, and tests check this.

use core::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use crate::contour::{Wall, bisect};
use crate::gauss::Gauss;
use crate::third_order::circle_basis;

/// Depth below the surface, relative to the largest radius, below which the liquid is treated as at
/// rest. The first mode of a cylinder has 2e-5 of its motion at this depth.
const DEEP: f64 = 3.0;

/// Smallest ratio of an eigenvalue to the largest eigenvalue of the matrix of kinetic energy for
/// which the eigenvector is used. Eigenvectors with smaller eigenvalues consist of rounding errors.
const NOISE: f64 = 1e-13;

/// Periodic waves of the first mode up to third order, with lengths divided by the radius of the
/// free surface.
///
/// - `lambda`: omega_1^2/g of small waves.
/// - `shifts`: relative shift of omega_1^2 per squared slosh angle, in planar and in circular
///   motion.
/// - `second_wave`: second-order elevation at the wall per squared slosh angle, at the instant of
///   largest elevation in planar motion.
/// - `excited`: modes that the square of the first mode excites, each with its azimuthal number,
///   its number among the modes with this azimuthal number (counted from 1), and omega^2/g.
#[derive(Clone, Debug)]
pub(crate) struct Waves {
    pub lambda: f64,
    pub shifts: [f64; 2],
    pub second_wave: f64,
    pub excited: Vec<([usize; 2], f64)>,
}

pub(crate) struct Fields {
    pub u: DMatrix<f64>,
    pub r: DMatrix<f64>,
    pub z: DMatrix<f64>,
    pub rz: DMatrix<f64>,
    pub zz: DMatrix<f64>,
}

impl Fields {
    /// Computes solid harmonics of the azimuthal number `m`, and their derivatives, at `points` (r,
    /// z). These are the harmonic functions |x|^n P_n^m/`scale`^n for n from m (from 1 for m = 0)
    /// to `degree`.
    pub fn new(m: usize, degree: usize, scale: f64, points: &[[f64; 2]]) -> Fields {
        let first = m.max(1);
        let count = degree + 1 - first;
        let zero = || DMatrix::zeros(points.len(), count);
        let mut fields = Fields { u: zero(), r: zero(), z: zero(), rz: zero(), zz: zero() };
        for (i, [r, z]) in points.iter().map(|p| p.map(|x| x / scale)).enumerate() {
            let mut u = vec![0.0; degree + 1];
            u[m] = r.powi(m as i32);
            if degree > m {
                u[m + 1] = (2 * m + 1) as f64 * z * u[m];
            }
            for n in m + 1..degree {
                u[n + 1] = ((2 * n + 1) as f64 * z * u[n]
                    - (n + m) as f64 * (r * r + z * z) * u[n - 1])
                    / (n + 1 - m) as f64;
            }
            // d/dz of a harmonic has the next lower degree; r d/dr + z d/dz multiplies a harmonic by its degree
            let lower = |n: usize| if n > m { (n + m) as f64 * u[n - 1] } else { 0.0 };
            for n in first..=degree {
                let j = n - first;
                let along_z = lower(n);
                let twice = if n > m { (n + m) as f64 * lower(n - 1) } else { 0.0 };
                let across = |n: usize| (n as f64 * u[n] - z * lower(n)) / r;
                fields.u[(i, j)] = u[n];
                fields.z[(i, j)] = along_z / scale;
                fields.r[(i, j)] = across(n) / scale;
                fields.zz[(i, j)] = twice / (scale * scale);
                fields.rz[(i, j)] =
                    if n > m { (n + m) as f64 * across(n - 1) } else { 0.0 } / (scale * scale);
            }
        }
        fields
    }

    pub fn times(&self, e: &DMatrix<f64>) -> Fields {
        Fields {
            u: &self.u * e,
            r: &self.r * e,
            z: &self.z * e,
            rz: &self.rz * e,
            zz: &self.zz * e,
        }
    }
}

struct Boundary {
    points: Vec<[f64; 2]>,
    normals: Vec<[f64; 2]>,
    weights: Vec<f64>,
}

/// The liquid at rest, with lengths divided by the radius of the free surface, and heights z
/// counted from the surface.
///
/// - `boundary`: wetted wall and free surface.
/// - `centre`: height of the point about which the solid harmonics are defined, half way to the
///   bottom.
/// - `size`: length by which the harmonics are scaled.
/// - `wall`: slope dR/dz and curvature d^2R/dz^2 of the wall at the contact line.
/// - `rho`, `weights`: points of the quadrature over the surface.
pub(crate) struct Liquid {
    boundary: Boundary,
    pub centre: f64,
    pub size: f64,
    wall: [f64; 2],
    pub rho: Vec<f64>,
    weights: Vec<f64>,
}

impl Liquid {
    pub fn new(wall: &Wall, degree: usize) -> Option<Liquid> {
        let radius = wall.r_outer;
        if wall.r_inner > 0.0 || radius <= 0.0 {
            return None;
        }
        let rule = Gauss::new(degree + 16);
        let mut boundary =
            Boundary { points: Vec::new(), normals: Vec::new(), weights: Vec::new() };
        let scaled = |p: [f64; 2]| [p[0] / radius, (p[1] - wall.z_surface) / radius];
        let across = |p: &crate::curve::Segment| {
            (0..=32).map(|i| p.point_at(f64::from(i) / 32.0)[0]).fold(0.0, f64::max)
        };
        let widest = wall.segments.iter().map(across).fold(0.0, f64::max) / radius;
        let bottom = -DEEP * widest;
        let mut add = |p: [f64; 2], slope: [f64; 2], weight: f64| {
            let speed = slope[0].hypot(slope[1]);
            if p[0] > 0.0 && speed > 0.0 {
                boundary.points.push(p);
                boundary.normals.push([slope[1] / speed, -slope[0] / speed]);
                boundary.weights.push(weight * p[0] * speed);
            }
        };
        // The wall is followed from the contact line downwards, to the depth at which the liquid is taken as at rest.
        for segment in wall.segments.iter().rev() {
            let height = |t: f64| scaled(segment.curve.point_at(t))[1];
            let (mut from, to) = (segment.from, segment.to);
            let cut = height(from) < bottom;
            if cut {
                from = bisect(to, from, |t| height(t) >= bottom);
            }
            for (x, w) in rule.nodes.iter().zip(&rule.weights) {
                let t = from + (to - from) * x;
                let slope = segment.curve.slope(t).map(|d| d * (to - from) / radius);
                add(scaled(segment.curve.point_at(t)), slope, *w);
            }
            if cut {
                let end = scaled(segment.curve.point_at(from))[0];
                for (x, w) in rule.nodes.iter().zip(&rule.weights) {
                    add([end * x, bottom], [end, 0.0], *w);
                }
                break;
            }
        }
        let rho = rule.nodes.clone();
        let weights: Vec<f64> = rule.nodes.iter().zip(&rule.weights).map(|(x, w)| x * w).collect();
        for (x, w) in rho.iter().zip(&rule.weights) {
            add([*x, 0.0], [-1.0, 0.0], *w);
        }
        let centre = 0.5 * boundary.points.iter().map(|p| p[1]).fold(0.0, f64::min);
        for p in &mut boundary.points {
            p[1] -= centre;
        }
        let size = boundary.points.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
        let last = wall.segments.last()?;
        let inclination = |t: f64| {
            let [r, z] = last.curve.slope(t);
            r / z
        };
        let step = 1e-4;
        let rise = last.curve.slope(last.to)[1];
        let bend = (inclination(last.to + step) - inclination(last.to - step))
            / (2.0 * step * rise)
            * radius;
        Some(Liquid { boundary, centre, size, wall: [inclination(last.to), bend], rho, weights })
    }

    pub fn integral(&self, f: impl Fn(usize) -> f64) -> f64 {
        self.weights.iter().enumerate().map(|(i, w)| w * f(i)).sum()
    }

    /// Returns combinations of solid harmonics of the azimuthal number `m` up to `degree` whose
    /// kinetic energies are orthonormal. The energies are boundary integrals of u du/dn, with a
    /// harmonic u.
    pub fn harmonics(&self, m: usize, degree: usize) -> Harmonics {
        let Boundary { points, normals, weights } = &self.boundary;
        let fields = Fields::new(m, degree, self.size, points);
        let mut flux = fields.u.clone();
        for (i, (n, w)) in normals.iter().zip(weights).enumerate() {
            for j in 0..flux.ncols() {
                flux[(i, j)] = w * (n[0] * fields.r[(i, j)] + n[1] * fields.z[(i, j)]);
            }
        }
        let energy = fields.u.tr_mul(&flux);
        let norm: Vec<f64> = (0..energy.ncols()).map(|j| energy[(j, j)].abs().sqrt()).collect();
        let scaled = DMatrix::from_fn(norm.len(), norm.len(), |i, j| {
            0.5 * (energy[(i, j)] + energy[(j, i)]) / (norm[i] * norm[j])
        });
        let eigen = scaled.symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        let kept: Vec<usize> =
            (0..norm.len()).filter(|k| eigen.eigenvalues[*k] > NOISE * largest).collect();
        let e = DMatrix::from_fn(norm.len(), kept.len(), |i, k| {
            eigen.eigenvectors[(i, kept[k])] / (eigen.eigenvalues[kept[k]].sqrt() * norm[i])
        });
        let surface: Vec<[f64; 2]> = self.rho.iter().map(|r| [*r, -self.centre]).collect();
        let surface = Fields::new(m, degree, self.size, &surface).times(&e);
        Harmonics { e, surface }
    }

    /// Returns the values of `count` orthonormal polynomials in the radius, for elevations of the
    /// azimuthal number `m`. The rows are the points of the surface and, last, the wall.
    pub fn elevations(&self, m: usize, count: usize) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(self.rho.len() + 1, count);
        for (i, rho) in self.rho.iter().chain(&[1.0]).enumerate() {
            for (j, (f, _)) in circle_basis(m as f64, rho * rho, count, 1.0).into_iter().enumerate()
            {
                all[(i, j)] = f;
            }
        }
        all
    }

    /// Returns the integrals int f_i u_k rho drho over the free surface for all pairs of the
    /// elevations `f` and the potentials `u`, which are given by their values at the points of the
    /// surface.
    pub fn coupling(&self, f: &DMatrix<f64>, u: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(f.ncols(), u.ncols(), |i, k| self.integral(|q| f[(q, i)] * u[(q, k)]))
    }
}

type Wave = fn(f64, f64) -> f64;

/// Second-order parts of a motion as functions of azimuth and phase, for one azimuthal number.
///
/// - `m`: the azimuthal number.
/// - `mean`: the constant elevation; `None` if the motion has none.
/// - `double`: at twice the frequency: elevation, potential, and the derivative of the potential
///   with respect to the azimuth.
struct Shape {
    m: usize,
    mean: Option<Wave>,
    double: Option<[Wave; 3]>,
}

/// A planar or circular motion of the first mode. `first` contains three functions of azimuth and
/// phase: the elevation, the potential, and the derivative of the potential with respect to the
/// azimuth. `second` are the second-order parts that this motion causes.
struct Motion {
    first: [Wave; 3],
    second: Vec<Shape>,
}

fn motions() -> [Motion; 2] {
    let planar = Motion {
        first: [|h, t| h.cos() * t.cos(), |h, t| h.cos() * t.sin(), |h, t| -h.sin() * t.sin()],
        second: vec![
            Shape {
                m: 0,
                mean: Some(|_, _| 1.0),
                double: Some([|_, t| (2.0 * t).cos(), |_, t| (2.0 * t).sin(), |_, _| 0.0]),
            },
            Shape {
                m: 2,
                mean: Some(|h, _| (2.0 * h).cos()),
                double: Some([
                    |h, t| (2.0 * h).cos() * (2.0 * t).cos(),
                    |h, t| (2.0 * h).cos() * (2.0 * t).sin(),
                    |h, t| -2.0 * (2.0 * h).sin() * (2.0 * t).sin(),
                ]),
            },
        ],
    };
    let circular = Motion {
        first: [|h, t| (t - h).cos(), |h, t| (t - h).sin(), |h, t| -(t - h).cos()],
        second: vec![
            Shape { m: 0, mean: Some(|_, _| 1.0), double: None },
            Shape {
                m: 2,
                mean: None,
                double: Some([
                    |h, t| (2.0 * (t - h)).cos(),
                    |h, t| (2.0 * (t - h)).sin(),
                    |h, t| -2.0 * (2.0 * (t - h)).cos(),
                ]),
            },
        ],
    };
    [planar, circular]
}

/// Returns the mean of `f(azimuth, phase)` over azimuth and phase. It is exact for trigonometric
/// polynomials up to degree 11.
fn average(f: impl Fn(f64, f64) -> f64) -> f64 {
    let angle = |i: i32| TAU * f64::from(i) / 12.0;
    (0..144).map(|i| f(angle(i / 12), angle(i % 12))).sum::<f64>() / 144.0
}

/// Values at the points of the surface at rest that the equations of higher order need. The first
/// mode has the elevation f, with int f^2 rho drho = 1, and the potential U. The lines of the
/// coordinates run from the surface into the liquid and follow the wall; w is the volume element in
/// these coordinates.
///
/// - `along`: first and second derivative of U w along the lines.
/// - `gradient`: U_r, U_z and U/r.
/// - `energy`: derivatives along the lines of (U_r^2 + U_z^2) w and of (U^2/r^2) w.
/// - `w`: first and second derivative of w along the lines.
/// - `slope`: dr/dz of the lines.
struct First {
    lambda: f64,
    f: Vec<f64>,
    along: [Vec<f64>; 2],
    gradient: [Vec<f64>; 3],
    energy: [Vec<f64>; 2],
    w: [Vec<f64>; 2],
    slope: Vec<f64>,
}

/// Second-order part of a motion, for one azimuthal number. `p` are the coefficients of its
/// constant elevation, and `r` and `d` the coefficients of its elevation and of its potential at
/// twice the frequency. `l_4` is its contribution to the term of Luke's functional with the fourth
/// power of the amplitude.
struct Second {
    l_4: f64,
    p: DVector<f64>,
    r: DVector<f64>,
    d: DVector<f64>,
}

impl Second {
    fn at_wall(&self, f: &DMatrix<f64>) -> f64 {
        (f.row(f.nrows() - 1) * (&self.p + &self.r))[0]
    }
}

/// Combinations of solid harmonics with orthonormal kinetic energies: their coefficients are the
/// columns of `e`, and `surface` has their values at the surface.
pub(crate) struct Harmonics {
    pub e: DMatrix<f64>,
    pub surface: Fields,
}

/// Computes the waves of the first mode to third order with solid harmonics up to `degree`. The
/// computation uses curved coordinates, whose lines run from the surface into the liquid and follow
/// the wall. The slope of a line is proportional to its radius to the power `lines`, an odd number;
/// the result must not depend on it. The second-order response is computed at the frequency 2 omega
/// (1 + `detuning`), so that the influence of a nearby resonance can be seen. Returns `None` for a
/// liquid with a hole, such as a ring.
pub(crate) fn waves(wall: &Wall, degree: usize, lines: i32, detuning: f64) -> Option<Waves> {
    let liquid = Liquid::new(wall, degree)?;
    let count = degree / 2;
    let (u, f) = (liquid.harmonics(1, degree), liquid.elevations(1, count));
    let coupling = liquid.coupling(&f, &u.surface.u);
    let eigen = (&coupling * coupling.transpose()).symmetric_eigen();
    let best = eigen.eigenvalues.imax();
    let shape = eigen.eigenvectors.column(best).into_owned();
    let lambda = 1.0 / eigen.eigenvalues[best];
    let first =
        First::new(&liquid, &u.surface, lambda, &(&f * &shape), &coupling.tr_mul(&shape), lines);
    let amplitude = liquid.integral(|q| first.f[q] * liquid.rho[q]);
    let mut waves = Waves { lambda, shifts: [0.0; 2], second_wave: 0.0, excited: Vec::new() };
    let fields = [0, 2].map(|m| (liquid.harmonics(m, degree), liquid.elevations(m, count)));
    for (k, (u, f)) in fields.iter().enumerate() {
        // The constant elevation of m = 0 would change the volume, so that it is no mode.
        let coupling = liquid.coupling(f, &u.surface.u).remove_rows(0, 1 - k);
        let mut all =
            (&coupling * coupling.transpose()).symmetric_eigenvalues().as_slice().to_vec();
        all.sort_by(|a, b| b.total_cmp(a));
        let lowest = all.iter().take(4).enumerate();
        waves.excited.extend(lowest.map(|(n, value)| ([2 * k, n + 1], 1.0 / value)));
    }
    for (kind, motion) in motions().into_iter().enumerate() {
        let [e, s, s_theta] = motion.first;
        let fourth = average(|h, t| e(h, t).powi(4));
        let [along, round] = [s, s_theta].map(|s| average(|h, t| (s(h, t) * e(h, t)).powi(2)));
        let mut l_4 = liquid.integral(|q| {
            let f = first.f[q];
            lambda / 6.0 * fourth * first.along[1][q] * f.powi(3)
                - lambda / 4.0 * (along * first.energy[0][q] + round * first.energy[1][q]) * f * f
                - fourth / 8.0 * first.w[1][q] * f.powi(4)
        });
        let mut at_wall = 0.0;
        for shape in &motion.second {
            let (u, f) = &fields[shape.m / 2];
            let second = first.second(&liquid, &motion, shape, (&u.surface, f), detuning);
            l_4 += second.l_4;
            at_wall += second.at_wall(f);
        }
        let square = average(|h, t| e(h, t).powi(2));
        waves.shifts[kind] = -4.0 * l_4 / square * amplitude * amplitude;
        if kind == 0 {
            waves.second_wave = at_wall * amplitude * amplitude;
        }
    }
    Some(waves)
}

impl First {
    fn new(
        liquid: &Liquid,
        fields: &Fields,
        lambda: f64,
        f: &DVector<f64>,
        c: &DVector<f64>,
        lines: i32,
    ) -> First {
        let [big_u, u_r, u_z, u_rz, u_zz] =
            [&fields.u, &fields.r, &fields.z, &fields.rz, &fields.zz].map(|field| field * c);
        let [inclination, bend] = liquid.wall;
        let size = liquid.rho.len();
        let empty = || vec![0.0; size];
        let mut first = First {
            lambda,
            f: f.as_slice()[..size].to_vec(),
            along: [empty(), empty()],
            gradient: [empty(), empty(), empty()],
            energy: [empty(), empty()],
            w: [empty(), empty()],
            slope: empty(),
        };
        for (q, &rho) in liquid.rho.iter().enumerate() {
            // lines of constant rho: r = rho + slope z + curve z^2/2
            let power = rho.powi(lines);
            let [slope, curve] = [inclination * power, bend * power];
            let grows = f64::from(lines) / rho;
            let w_z = slope / rho + slope * grows;
            let w_zz = curve / rho + curve * grows + 2.0 * slope * slope * grows / rho;
            let (u, ur, uz, urz, uzz) = (big_u[q], u_r[q], u_z[q], u_rz[q], u_zz[q]);
            let urr = -ur / rho + u / (rho * rho) - uzz;
            let along = uz + slope * ur;
            let twice = uzz + 2.0 * slope * urz + slope * slope * urr + curve * ur;
            first.along[0][q] = along + u * w_z;
            first.along[1][q] = twice + 2.0 * along * w_z + u * w_zz;
            let [along_r, along_z] = [urz + slope * urr, uzz + slope * urz];
            first.energy[0][q] = 2.0 * (ur * along_r + uz * along_z) + (ur * ur + uz * uz) * w_z;
            let over = u / rho;
            let over_along = along / rho - slope * u / (rho * rho);
            first.energy[1][q] = 2.0 * over * over_along + over * over * w_z;
            for (field, value) in first.gradient.iter_mut().zip([ur, uz, over]) {
                field[q] = value;
            }
            (first.w[0][q], first.w[1][q], first.slope[q]) = (w_z, w_zz, slope);
        }
        first
    }

    fn second(
        &self,
        liquid: &Liquid,
        motion: &Motion,
        shape: &Shape,
        (fields, f): (&Fields, &DMatrix<f64>),
        detuning: f64,
    ) -> Second {
        let [e, s, s_theta] = motion.first;
        let [u_r, u_z, over] = &self.gradient;
        let count = f.ncols();
        // contribution of an elevation with the shape z to L_4, per coefficient of the elevation
        let source = |z: Wave| {
            let square = average(|h, t| e(h, t).powi(2) * z(h, t));
            let along = average(|h, t| s(h, t).powi(2) * z(h, t));
            let round = average(|h, t| s_theta(h, t).powi(2) * z(h, t));
            DVector::from_fn(count, |i, _| {
                liquid.integral(|q| {
                    let energy =
                        along * (u_r[q] * u_r[q] + u_z[q] * u_z[q]) + round * over[q] * over[q];
                    f[(q, i)]
                        * (self.lambda * square * self.along[0][q] * self.f[q]
                            - 0.5 * self.lambda * energy
                            - square * self.w[0][q] * self.f[q] * self.f[q])
                })
            })
        };
        // The first order changes the volume by its square; the second order has to compensate this change.
        let squeezed = liquid.integral(|q| self.w[0][q] * self.f[q] * self.f[q]);
        let level = liquid.integral(|q| f[(q, 0)]);
        let zero = DVector::zeros(count);
        let mut second =
            Second { l_4: 0.0, p: zero.clone(), r: zero, d: DVector::zeros(fields.u.ncols()) };
        if let Some(mean) = shape.mean {
            let norm = average(|h, t| mean(h, t).powi(2));
            let source = source(mean);
            let mut p = &source / norm;
            if shape.m == 0 {
                p[0] = -0.5 * average(|h, t| e(h, t).powi(2)) * squeezed / level;
            }
            second.l_4 += source.dot(&p) - 0.5 * norm * p.norm_squared();
            second.p = p;
        }
        if let Some([z, potential, potential_theta]) = shape.double {
            let omega = self.lambda.sqrt();
            let driven = omega * (1.0 + detuning);
            // The constant of m = 0 is the Lagrange multiplier of the volume.
            let constant = usize::from(shape.m == 0);
            let harmonics = fields.u.ncols();
            let size = count + harmonics + constant;
            let [norm, norm_potential] = [z, potential].map(|z| average(|h, t| z(h, t).powi(2)));
            let square = average(|h, t| e(h, t).powi(2) * z(h, t));
            let along = average(|h, t| s(h, t) * potential(h, t) * e(h, t));
            let round = average(|h, t| s_theta(h, t) * potential_theta(h, t) * e(h, t));
            let coupling = liquid.coupling(f, &fields.u);
            let mut matrix = DMatrix::zeros(size, size);
            let mut vector = DVector::zeros(size);
            vector.rows_mut(0, count).copy_from(&source(z));
            for i in 0..count {
                matrix[(i, i)] = -norm;
                for k in 0..harmonics {
                    matrix[(i, count + k)] = -2.0 * driven * norm * coupling[(i, k)];
                    matrix[(count + k, i)] = matrix[(i, count + k)];
                }
            }
            for k in 0..harmonics {
                matrix[(count + k, count + k)] = -norm_potential;
                vector[count + k] = omega
                    * liquid.integral(|q| {
                        let (u, r, z) = (fields.u[(q, k)], fields.r[(q, k)], fields.z[(q, k)]);
                        let grows = z + self.slope[q] * r + u * self.w[0][q];
                        self.f[q]
                            * (along * (u_r[q] * r + u_z[q] * z)
                                + round * over[q] * u / liquid.rho[q]
                                - square * grows * self.f[q])
                    });
            }
            if constant == 1 {
                let last = size - 1;
                matrix[(0, last)] = -2.0 * driven * norm * level;
                matrix[(last, 0)] = matrix[(0, last)];
                vector[last] = -omega * square * squeezed;
            }
            if let Some(x) = matrix.lu().solve(&vector) {
                second.l_4 -= 0.5 * vector.dot(&x);
                second.r.copy_from(&-x.rows(0, count));
                second.d.copy_from(&-x.rows(count, harmonics));
            }
        }
        second
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contour::Contour;
    use crate::curve::Segment;

    fn wall(segments: Vec<Segment>, fill: f64) -> Wall {
        Contour::new(segments).unwrap().cut(fill).unwrap()
    }

    fn sphere(fill: f64) -> Wall {
        wall(vec![Segment::arc([0.0, 1.0], 1.0, -90.0, 90.0)], fill)
    }

    /// The tolerance of 1e-5 covers the harmonics above degree 24, which are left out, and the
    /// liquid at large depth, which is treated as at rest.
    #[test]
    fn the_contour_method_equals_the_method_for_vertical_walls_in_cylinders() {
        let overlaps = crate::third_order::Overlaps::round(0.0, 0.5, 20);
        for fill in [0.2, 0.35, 0.61, 1.2] {
            let sides =
                vec![Segment::line([0.0, 0.0], [0.5, 0.0]), Segment::line([0.5, 0.0], [0.5, 2.0])];
            let found = waves(&wall(sides, fill), 24, 1, 0.0).unwrap();
            for (a, b) in found.shifts.into_iter().zip(overlaps.shifts(fill)) {
                assert!((a - b).abs() < 3e-5 * (1.0 + b.abs()), "{fill} {a} {b}");
            }
            let second = overlaps.second_wave(fill);
            assert!(
                (0.5 * found.second_wave / second - 1.0).abs() < 1e-3,
                "{fill} {found:?} {second}"
            );
        }
    }

    #[test]
    fn large_wave_results_do_not_depend_on_the_grid_of_the_surface_elevation() {
        let cone = wall(vec![Segment::line([0.0, 0.0], [1.0, 2.0])], 1.3);
        for wall in [cone, sphere(0.4), sphere(1.4)] {
            let [a, b] = [1, 3].map(|lines| waves(&wall, 20, lines, 0.0).unwrap());
            for (a, b) in a.shifts.into_iter().zip(b.shifts) {
                assert!((a - b).abs() < 1e-4 * (1.0 + a.abs()), "{a} {b}");
            }
            assert!((a.second_wave - b.second_wave).abs() < 1e-3, "{a:?} {b:?}");
        }
    }

    /// The bottom of a sphere is nearly a paraboloid, in which shallow liquid oscillates as a
    /// whole. To leading order in 1/depth its frequency does not depend on its amplitude (Thacker,
    /// J. Fluid Mech. 107 (1981) 499), whereas in a cylinder of this depth the shifts of the
    /// squared frequency are 1e6.
    #[test]
    fn the_frequency_of_shallow_liquid_in_a_bowl_hardly_depends_on_the_amplitude() {
        for fill in [1e-3, 1e-2] {
            let shifts = waves(&sphere(fill), 16, 1, 0.0).unwrap().shifts;
            assert!(shifts.iter().all(|shift| shift.abs() < 0.6), "{fill} {shifts:?}");
        }
    }

    /// The test evaluates Luke's functional for a motion of first and second order without a Taylor
    /// expansion about the surface at rest: the integrals run over the liquid up to the moving
    /// surface, with the true wall of a sphere. The coefficient of the fourth power of the
    /// amplitude gives the frequency shift, which is compared with the shift that `waves` returns.
    #[test]
    fn fourth_order_terms_equal_those_of_lukes_functional() {
        let (fill, degree, count) = (0.7, 14, 7);
        let shape = sphere(fill);
        let liquid = Liquid::new(&shape, degree).unwrap();
        let radius = shape.r_outer;
        let (u, f) = (liquid.harmonics(1, degree), liquid.elevations(1, count));
        let coupling = liquid.coupling(&f, &u.surface.u);
        let eigen = (&coupling * coupling.transpose()).symmetric_eigen();
        let best = eigen.eigenvalues.imax();
        let mode = eigen.eigenvectors.column(best).into_owned();
        let lambda = 1.0 / eigen.eigenvalues[best];
        let c = coupling.tr_mul(&mode);
        let first = First::new(&liquid, &u.surface, lambda, &(&f * &mode), &c, 1);
        let amplitude = liquid.integral(|q| first.f[q] * liquid.rho[q]);
        let known = waves(&shape, degree, 1, 0.0).unwrap().shifts;
        for (motion, known) in motions().into_iter().zip(known) {
            let [e, s, s_theta] = motion.first;
            let second: Vec<_> = motion
                .second
                .iter()
                .map(|shape| {
                    let (u, f) =
                        (liquid.harmonics(shape.m, degree), liquid.elevations(shape.m, count));
                    let second = first.second(&liquid, &motion, shape, (&u.surface, &f), 0.0);
                    (shape, u.e, f, second)
                })
                .collect();
            let omega = lambda.sqrt();
            let wall_at = |z: f64| {
                let z = fill - 1.0 + radius * z;
                (1.0 - z * z).sqrt() / radius
            };
            // potentials and their derivatives with respect to r and z at a point, one for each azimuthal number
            let at = |rho: f64, z: f64| -> Vec<[f64; 3]> {
                let point = [[rho * wall_at(z), z - liquid.centre]];
                let field = |m: usize, c: DVector<f64>| {
                    let fields = Fields::new(m, degree, liquid.size, &point);
                    [&fields.u, &fields.r, &fields.z].map(|field| (field * &c)[0])
                };
                let mut all = vec![field(1, &u.e * &c)];
                all.extend(
                    second.iter().map(|(shape, e, _, second)| field(shape.m, e * &second.d)),
                );
                all
            };
            let rule = Gauss::new(4);
            let functional = |a: f64| {
                let mut sum = 0.0;
                for (q, weight) in liquid.weights.iter().enumerate() {
                    let rho = liquid.rho[q];
                    for k in 0..144 {
                        let (h, t) =
                            (TAU * f64::from(k / 12) / 12.0, TAU * f64::from(k % 12) / 12.0);
                        let mut zeta = a * first.f[q] * e(h, t);
                        // The derivative of E with respect to the phase is -S.
                        let mut rate = -omega * a * first.f[q] * s(h, t);
                        for (shape, _, f, second) in &second {
                            let row = f.row(q);
                            if let Some(mean) = shape.mean {
                                zeta += a * a * (row * &second.p)[0] * mean(h, t);
                            }
                            if let Some([z, potential, _]) = shape.double {
                                let r = (row * &second.r)[0];
                                zeta += a * a * r * z(h, t);
                                rate -= 2.0 * omega * a * a * r * potential(h, t);
                            }
                        }
                        // The multiplier of the volume at 2 omega is left out: it is of the second order, and the
                        // volume is constant to the third order, so that their product does not contribute.
                        let phi = |z: f64| {
                            let mut phi = [0.0; 4];
                            for (i, [u, r, z]) in at(rho, z).into_iter().enumerate() {
                                let [value, slope] = match i {
                                    0 => [s, s_theta].map(|s| -omega * a * s(h, t)),
                                    _ => match second[i - 1].0.double {
                                        Some([_, potential, by_theta]) => {
                                            [potential, by_theta].map(|f| a * a * f(h, t))
                                        }
                                        None => [0.0; 2],
                                    },
                                };
                                phi = [
                                    phi[0] + value * u,
                                    phi[1] + value * r,
                                    phi[2] + value * z,
                                    phi[3] + slope * u,
                                ];
                            }
                            phi
                        };
                        let volume = |z: f64| wall_at(z).powi(2);
                        let mut value = phi(zeta)[0] * volume(zeta) * rate;
                        for (x, w) in rule.nodes.iter().zip(&rule.weights) {
                            let z = zeta * x;
                            let [_, r, up, round] = phi(z);
                            let round = round / (rho * wall_at(z));
                            let energy = 0.5 * (r * r + up * up + round * round) + z;
                            value -= w * zeta * volume(z) * energy;
                        }
                        sum += weight / 144.0 * value;
                    }
                }
                // energy of the liquid below the surface at rest: the sum of the squares of the coefficients, because
                // the combinations are orthonormal
                sum -= 0.5 * lambda * a * a * c.norm_squared() * average(|h, t| s(h, t).powi(2));
                for (shape, _, _, second) in &second {
                    if let Some([_, potential, _]) = shape.double {
                        let norm = average(|h, t| potential(h, t).powi(2));
                        sum -= 0.5 * a.powi(4) * second.d.norm_squared() * norm;
                    }
                }
                sum
            };
            // A combination of two amplitudes eliminates the term of sixth order.
            let [large, small] = [0.04, 0.02].map(|a| functional(a) / f64::powi(a, 4));
            let l_4 = (4.0 * small - large) / 3.0;
            let square = average(|h, t| e(h, t).powi(2));
            let shift = -4.0 * l_4 / square * amplitude * amplitude;
            assert!((shift - known).abs() < 1e-4, "{shift} {known}");
        }
    }
}

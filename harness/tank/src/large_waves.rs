//! Periodic waves of large amplitude in a body of revolution: fully nonlinear potential flow.
//!
//! The surface, the coordinates and Luke's functional are the same as in `contour_waves.rs`, but the functional is
//! not expanded in the amplitude: the integrals over the liquid run along the lines up to the surface. With the phase
//! tau = omega t, lengths over the radius of the surface and g = 1,
//!
//! ```text
//! L = < int [omega zeta_tau phi w - int_0^zeta w (|grad phi|^2/2 + z) dz] rho drho > - < int_Q0 |grad phi|^2 dV >/2
//! planar     zeta = sum Z f(rho) cos(m theta) cos(k tau),  phi = sum C u(r, z) cos(m theta) sin(k tau),  m + k even
//! circular   zeta = sum Z f(rho) cos(m (tau - theta)),     phi = sum C u(r, z) sin(m (tau - theta))
//! ```
//!
//! where < > is the mean over theta and tau, and phi and w are taken at the surface. L is stationary with respect to Z
//! and C, with constant volume as a constraint. Newton's method finds the wave and its frequency for a given amplitude
//! of the first mode.

use core::f64::consts::PI;
use std::thread;

use formulas::energy_terms::EnergyTerms;
use formulas::limits::{self, AngleLimit};
use nalgebra::{DMatrix, DVector};

use crate::contour::{Contour, Wall};
use crate::contour_waves::{Fields, Liquid};
use crate::curve::{Curve, Segment};
use crate::gauss::Gauss;

#[cfg(feature = "studies")]
pub mod forced;

/// A periodic wave of large amplitude.
///
/// - `angle`: slosh angle, rad. Its sine is m_liq x_cm/(m_1 l) with the largest distance x_cm of
///   the liquid's centre of mass from the axis, and mass m_1 and length l of the first mode.
/// - `frequency`: frequency divided by the frequency of small waves.
/// - `rise`: m_liq z_cm/(m_1 l), where z_cm is the height of the centre of mass above its height at
///   rest at the phase 0, at which the liquid of a planar wave is momentarily at rest.
#[derive(Clone, Copy, Debug)]
struct LargeWave {
    angle: f64,
    frequency: f64,
    rise: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    Planar,
    Circular,
    #[cfg(feature = "studies")]
    Forced(forced::Function),
}

/// Resolution of an expansion.
///
/// - `degree`: largest degree of the solid harmonics of the potential.
/// - `polynomials`: number of polynomials of the elevation for each azimuthal number.
/// - `order`: largest azimuthal number, which is also the largest multiple of the frequency.
#[derive(Clone, Copy, Debug)]
struct Resolution {
    degree: usize,
    polynomials: usize,
    order: usize,
}

/// Number of Gauss points between the surface at rest and the wave at each point of the surface.
const DEPTHS: usize = 4;
const STEPS: usize = 12;
const CONVERGED: f64 = 1e-9;
/// Largest elevation of a wave that is computed, above or below the contact line, as a fraction of
/// the distance from the contact line to the upper or lower end of the [`Side`].
const ROOM: f64 = 0.8;
/// Largest sine of the angle between two segments of the wall at which their joint counts as
/// smooth, so that the side continues beyond the joint.
const SMOOTH: f64 = 1e-3;

/// The smooth part of the wall around the contact line, where the radius of the wall is a function
/// of the height. Between the heights `low` and `high` above the surface at rest the wall has no
/// corner and rises. Heights and radii are divided by `radius`, the radius of the surface at rest;
/// `surface` is its height, m.
pub(crate) struct Side {
    pieces: Vec<Piece>,
    radius: f64,
    surface: f64,
    low: f64,
    high: f64,
}

/// A part of the wall that rises from the height `z[0]` to `z[1]`, m, while the parameter of its
/// curve goes from `t[0]` to `t[1]`.
struct Piece {
    curve: Curve,
    t: [f64; 2],
    z: [f64; 2],
}

impl Piece {
    /// Returns the part of a curve that begins at the parameter `start`, runs towards `end`, and
    /// rises (`sign` = 1) or falls (`sign` = -1) all along. Its two ends are in the order of their
    /// heights. The result is `None` if the height does not change.
    fn new(curve: Curve, start: f64, end: f64, sign: f64) -> Option<Piece> {
        let count = 64;
        let place = |i: usize| start + (end - start) * i as f64 / count as f64;
        let height = |i: usize| sign * curve.point_at(place(i))[1];
        let last = (1..=count).take_while(|&i| height(i) > height(i - 1)).last()?;
        let t = if sign > 0.0 { [start, place(last)] } else { [place(last), start] };
        Some(Piece { curve, t, z: t.map(|t| curve.point_at(t)[1]) })
    }

    fn parameter(&self, z: f64) -> f64 {
        let [mut low, mut high] = self.t;
        let mut t = low + (high - low) * (z - self.z[0]) / (self.z[1] - self.z[0]);
        for _ in 0..60 {
            let off = self.curve.point_at(t)[1] - z;
            if off > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let next = t - off / self.curve.slope(t)[1];
            let inside = (low.min(high)..=low.max(high)).contains(&next);
            let next = if inside { next } else { 0.5 * (low + high) };
            if (next - t).abs() < 1e-15 * (1.0 + t.abs()) {
                return next;
            }
            t = next;
        }
        t
    }
}

/// Returns the parts of consecutive segments along which the wall rises (`sign` = 1) or falls
/// (`sign` = -1). They begin at the parameter `start` of the first segment and end at the first
/// corner.
fn smooth_pieces<'s>(
    segments: impl Iterator<Item = &'s Segment>,
    start: f64,
    sign: f64,
) -> Vec<Piece> {
    let (mut pieces, mut before) = (Vec::new(), None::<&Segment>);
    for segment in segments {
        let is_up = sign > 0.0;
        let [near, far] = [segment.from, segment.to];
        let [near, far] = if is_up { [near, far] } else { [far, near] };
        let is_corner = before.is_some_and(|before| {
            let [low, high] = if is_up { [before, segment] } else { [segment, before] };
            let ([r, z], [r_1, z_1]) = (low.tangent(1.0), high.tangent(0.0));
            (r * z_1 - z * r_1).abs() >= SMOOTH
        });
        let start = if before.is_none() { start } else { near };
        let piece = (start != far).then(|| Piece::new(segment.curve, start, far, sign));
        if is_corner || matches!(piece, Some(None)) {
            break;
        }
        pieces.extend(piece.flatten());
        before = Some(segment);
    }
    pieces
}

impl Side {
    pub fn new(contour: &Contour, wall: &Wall) -> Option<Side> {
        let segments = contour.segments();
        let contact = wall.segments.last()?;
        let is_within = |t: f64, segment: &Segment| {
            let (a, b) = (segment.from.min(segment.to), segment.from.max(segment.to));
            (a..=b).contains(&t)
        };
        // If the contact line is at a joint, the segment above it counts.
        let first = segments
            .iter()
            .rposition(|part| part.curve == contact.curve && is_within(contact.to, part))?;
        let mut pieces = smooth_pieces(segments[..=first].iter().rev(), contact.to, -1.0);
        pieces.reverse();
        pieces.extend(smooth_pieces(segments[first..].iter(), contact.to, 1.0));
        let (radius, surface) = (wall.r_outer, wall.z_surface);
        let [low, high] =
            [pieces.first()?.z[0], pieces.last()?.z[1]].map(|z| ROOM * (z - surface) / radius);
        (low < 0.0 && high > 0.0).then_some(Side { pieces, radius, surface, low, high })
    }

    /// Returns the radius of the wall at the height `z` above the surface at rest, and its first
    /// and second derivative with respect to `z`, all divided by the radius of the surface. The
    /// result is `None` beyond the ends of the side.
    fn at(&self, z: f64) -> Option<[f64; 3]> {
        if !(self.low..=self.high).contains(&z) {
            return None;
        }
        let height = self.surface + z * self.radius;
        let piece = self.pieces.iter().find(|piece| height <= piece.z[1])?;
        let t = piece.parameter(height);
        let [d_r, d_z] = piece.curve.slope(t);
        let step = 1e-4;
        let inclination = |t: f64| {
            let [r, z] = piece.curve.slope(t);
            r / z
        };
        let bend =
            (inclination(t + step) - inclination(t - step)) / (2.0 * step * d_z) * self.radius;
        Some([piece.curve.point_at(t)[0] / self.radius, d_r / d_z, bend])
    }
}

/// A term of the expansion: the functions of azimuth and phase that multiply its elevation and its
/// potential. `m` is the azimuthal number, and `k` the multiple of the frequency.
#[derive(Clone, Copy)]
struct Term {
    m: usize,
    k: usize,
    motion: Motion,
}

impl Term {
    fn all(motion: Motion, order: usize) -> Vec<Term> {
        match motion {
            Motion::Circular => (0..=order).map(|m| Term { m, k: m, motion }).collect(),
            Motion::Planar => (0..=order)
                .flat_map(|m| (0..=order).map(move |k| Term { m, k, motion }))
                .filter(|term| (term.m + term.k) % 2 == 0)
                .collect(),
            #[cfg(feature = "studies")]
            Motion::Forced(function) => function.terms(order),
        }
    }

    fn has_potential(self) -> bool {
        match self.motion {
            Motion::Planar | Motion::Circular => self.k > 0,
            #[cfg(feature = "studies")]
            Motion::Forced(_) => self.m + self.k > 0,
        }
    }

    fn at(self, theta: f64, tau: f64) -> [f64; 4] {
        let (m, k) = (self.m as f64, self.k as f64);
        match self.motion {
            Motion::Planar => {
                let ((sin_h, cos_h), (sin_t, cos_t)) = ((m * theta).sin_cos(), (k * tau).sin_cos());
                [cos_h * cos_t, -k * cos_h * sin_t, cos_h * sin_t, -m * sin_h * sin_t]
            }
            Motion::Circular => {
                let (sin, cos) = (m * (tau - theta)).sin_cos();
                [cos, -m * sin, sin, -m * cos]
            }
            #[cfg(feature = "studies")]
            Motion::Forced(function) => function.at(self, [theta, tau]),
        }
    }

    /// Returns the mean square of the function of azimuth and phase that multiplies the potential
    /// of this term.
    fn norm(self) -> f64 {
        match self.motion {
            Motion::Planar if self.m > 0 => 0.25,
            #[cfg(feature = "studies")]
            Motion::Forced(function) => function.norm(self),
            _ => 0.5,
        }
    }
}

fn scaled(matrix: &DMatrix<f64>, by: &DVector<f64>) -> DMatrix<f64> {
    let mut out = matrix.clone();
    for mut column in out.column_iter_mut() {
        column.component_mul_assign(by);
    }
    out
}

/// Points of the quadrature on the surface: the radii `rho` with their weights, and pairs of
/// azimuth and phase.
struct Points {
    rho: Vec<f64>,
    weights: Vec<f64>,
    angles: Vec<[f64; 2]>,
}

impl Points {
    fn new(rule: &Gauss, grid: &[[f64; 2]]) -> Points {
        let mut points = Points { rho: Vec::new(), weights: Vec::new(), angles: Vec::new() };
        for angles in grid {
            for (rho, weight) in rule.nodes.iter().zip(&rule.weights) {
                points.rho.push(*rho);
                points.weights.push(weight * rho / grid.len() as f64);
                points.angles.push(*angles);
            }
        }
        points
    }
}

/// Values of the base functions u of the potential at points, with one column for each function: u,
/// u_r, u_z and u_theta/r.
struct Potentials {
    values: [DMatrix<f64>; 4],
    /// Derivatives of the sum of all base functions at each point: the second derivatives with
    /// respect to z z, r z and r r, the first with respect to theta, and the second with respect to
    /// z theta and r theta.
    second: Vec<[f64; 6]>,
}

struct Solver<'a> {
    liquid: Liquid,
    side: &'a Side,
    terms: Vec<Term>,
    resolution: Resolution,
    combinations: Vec<DMatrix<f64>>,
    points: Points,
    elevation: DMatrix<f64>,
    rate: DMatrix<f64>,
    shape: DVector<f64>,
    potential: DVector<f64>,
    lambda: f64,
    amplitude: f64,
    line: Gauss,
}

impl<'a> Solver<'a> {
    /// Prepares the computation of waves in the liquid above `wall`. `side` is the smooth part of
    /// the wall around the contact line. Returns `None` for a liquid with a hole, such as a ring.
    fn new(
        wall: &Wall,
        side: &'a Side,
        motion: Motion,
        resolution: Resolution,
    ) -> Option<Solver<'a>> {
        let Resolution { degree, polynomials, order } = resolution;
        let liquid = Liquid::new(wall, degree)?;
        let terms = Term::all(motion, order);
        let first = liquid.harmonics(1, degree);
        let f = liquid.elevations(1, polynomials);
        let coupling = liquid.coupling(&f, &first.surface.u);
        let eigen = (&coupling * coupling.transpose()).symmetric_eigen();
        let best = eigen.eigenvalues.imax();
        let mut shape = eigen.eigenvectors.column(best).into_owned();
        let lambda = 1.0 / eigen.eigenvalues[best];
        let row = &f * &shape;
        let mut amplitude = liquid.integral(|q| row[q] * liquid.rho[q]);
        if amplitude < 0.0 {
            (shape, amplitude) = (-shape, -amplitude);
        }
        let potential = coupling.tr_mul(&shape);
        let combinations = (0..=order).map(|m| liquid.harmonics(m, degree).e).collect();
        let rule = Gauss::new(polynomials + 6);
        let count = 2 * order + 2;
        let half = |n: usize| PI * (n as f64 + 0.5) / count as f64;
        let grid: Vec<[f64; 2]> = match motion {
            // The wave at (pi - theta, pi - tau) equals the wave at (theta, tau), so that half of the azimuths are enough.
            Motion::Planar => {
                (0..count / 2).flat_map(|i| (0..count).map(move |j| [half(i), half(j)])).collect()
            }
            Motion::Circular => (0..count).map(|i| [-half(i), 0.0]).collect(),
            #[cfg(feature = "studies")]
            Motion::Forced(function) => function.grid(count),
        };
        let points = Points::new(&rule, &grid);
        let mut solver = Solver {
            liquid,
            side,
            terms,
            resolution,
            combinations,
            points,
            elevation: DMatrix::zeros(0, 0),
            rate: DMatrix::zeros(0, 0),
            shape,
            potential,
            lambda,
            amplitude,
            line: Gauss::new(DEPTHS),
        };
        let [elevation, rate] = solver.elevations(&solver.points);
        (solver.elevation, solver.rate) = (elevation, rate);
        Some(solver)
    }

    fn elevations(&self, points: &Points) -> [DMatrix<f64>; 2] {
        let count = self.resolution.polynomials;
        let (rows, columns) = (points.rho.len(), count * self.terms.len());
        let [mut value, mut rate] = [0, 1].map(|_| DMatrix::zeros(rows, columns));
        for (i, (rho, [theta, tau])) in points.rho.iter().zip(&points.angles).enumerate() {
            for (n, term) in self.terms.iter().enumerate() {
                let [e, e_tau, ..] = term.at(*theta, *tau);
                let basis = crate::third_order::circle_basis(term.m as f64, rho * rho, count, 1.0);
                for (j, (f, _)) in basis.into_iter().enumerate() {
                    value[(i, n * count + j)] = f * e;
                    rate[(i, n * count + j)] = f * e_tau;
                }
            }
        }
        [value, rate]
    }

    /// Returns the number of coefficients in the potential of `term`. An axially symmetric term (m
    /// = 0) has one coefficient more: the coefficient of a constant, which keeps the volume of the
    /// liquid.
    fn potentials_of(&self, term: Term) -> usize {
        match term.has_potential() {
            true => self.combinations[term.m].ncols() + usize::from(term.m == 0),
            false => 0,
        }
    }

    fn sizes(&self) -> [usize; 2] {
        let potentials = self.terms.iter().map(|term| self.potentials_of(*term)).sum();
        [self.resolution.polynomials * self.terms.len(), potentials]
    }

    /// Computes the base functions of the potential at the heights `z` above the `points`. Each
    /// element of `walls` contains the radius, slope and curvature of the wall at one of these heights.
    /// `c` are the coefficients of the base functions; if they are given, derivatives of the sum of
    /// the base functions are computed, too: the second derivatives with respect to z z, r z and r
    /// r, the first derivative with respect to theta, and the second derivatives with respect to z
    /// theta and r theta.
    fn potentials(
        &self,
        points: &Points,
        z: &[f64],
        walls: &[[f64; 3]],
        c: Option<&DVector<f64>>,
    ) -> Potentials {
        let [_, columns] = self.sizes();
        let rows = points.rho.len();
        let mut values = [0; 4].map(|_| DMatrix::zeros(rows, columns));
        let mut second = vec![[0.0; 6]; if c.is_some() { rows } else { 0 }];
        let at: Vec<[f64; 2]> =
            (0..rows).map(|i| [points.rho[i] * walls[i][0], z[i] - self.liquid.centre]).collect();
        let degree = self.resolution.degree;
        let fields: Vec<Fields> = self
            .combinations
            .iter()
            .enumerate()
            .map(|(m, e)| Fields::new(m, degree, self.liquid.size, &at).times(e))
            .collect();
        let mut column = 0;
        for term in self.terms.iter().filter(|term| term.has_potential()) {
            let fields = &fields[term.m];
            let functions: Vec<[f64; 2]> = points
                .angles
                .iter()
                .map(|[theta, tau]| {
                    let [.., s, s_theta] = term.at(*theta, *tau);
                    [s, s_theta]
                })
                .collect();
            if term.m == 0 {
                for (i, [s, _]) in functions.iter().enumerate() {
                    values[0][(i, column)] = *s;
                }
                column += 1;
            }
            for j in 0..fields.u.ncols() {
                for (i, [s, s_theta]) in functions.iter().enumerate() {
                    let r = at[i][0];
                    values[0][(i, column)] = s * fields.u[(i, j)];
                    values[1][(i, column)] = s * fields.r[(i, j)];
                    values[2][(i, column)] = s * fields.z[(i, j)];
                    values[3][(i, column)] = s_theta * fields.u[(i, j)] / r;
                    if let Some(c) = c {
                        let (zz, m) = (fields.zz[(i, j)], term.m as f64);
                        let (u, u_r) = (fields.u[(i, j)], fields.r[(i, j)]);
                        let rr = m * m * u / (r * r) - u_r / r - zz;
                        let all = [
                            s * zz,
                            s * fields.rz[(i, j)],
                            s * rr,
                            s_theta * u,
                            s_theta * fields.z[(i, j)],
                            s_theta * u_r,
                        ];
                        for (sum, value) in second[i].iter_mut().zip(all) {
                            *sum += c[column] * value;
                        }
                    }
                }
                column += 1;
            }
        }
        Potentials { values, second }
    }

    fn walls(&self, z: &[f64]) -> Option<Vec<[f64; 3]>> {
        z.iter().map(|z| self.side.at(*z)).collect()
    }

    /// Returns the residuals of the equations for the unknowns `x`, and their derivatives. The
    /// residuals are the gradient of Luke's functional and the values of two constraints. `part` is
    /// the coefficient that the first mode must have. The result is `None` if the wave leaves the
    /// smooth side of the wall.
    fn equations(&self, x: &DVector<f64>, part: f64) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let [nz, nc] = self.sizes();
        let size = nz + nc + 2;
        let (elevations, c) = (x.rows(0, nz).into_owned(), x.rows(nz, nc).into_owned());
        let (pressure, omega) = (x[nz + nc], x[nz + nc + 1]);
        let zeta = &self.elevation * &elevations;
        let rate = &self.rate * &elevations;
        let rows = zeta.len();
        let walls = self.walls(zeta.as_slice())?;
        let at = self.potentials(&self.points, zeta.as_slice(), &walls, Some(&c));
        let [u, u_r, u_z, u_h] = &at.values;
        let [phi, phi_r, phi_z, phi_h] = at.values.each_ref().map(|u| u * &c);

        // derivatives along the lines of constant rho
        let mut along = DMatrix::zeros(rows, nc);
        let mut kinetic = DMatrix::zeros(rows, nc);
        // coefficients, at each point, of the diagonal blocks of the matrix of derivatives
        let [mut pull, mut lift, mut bend, mut couple] = [0; 4].map(|_| DVector::zeros(rows));
        let [mut by_omega, mut push, mut swell] = [0; 3].map(|_| DVector::zeros(rows));
        for i in 0..rows {
            let weight = self.points.weights[i];
            let (rho, [wide, slope, curve]) = (self.points.rho[i], walls[i]);
            let r = rho * wide;
            let sigma = rho * slope;
            let w = wide * wide;
            let w_1 = 2.0 * wide * slope;
            let w_2 = 2.0 * (slope * slope + wide * curve);
            let [zz, rz, rr, by_theta, z_theta, r_theta] = at.second[i];
            let d_phi = phi_z[i] + sigma * phi_r[i];
            let dd_phi = zz + 2.0 * sigma * rz + sigma * sigma * rr + rho * curve * phi_r[i];
            let flux_1 = d_phi * w + phi[i] * w_1;
            let flux_2 = dd_phi * w + 2.0 * d_phi * w_1 + phi[i] * w_2;
            let speed2 = phi_r[i].powi(2) + phi_z[i].powi(2) + phi_h[i].powi(2);
            let d_r = rz + sigma * rr;
            let d_z = zz + sigma * rz;
            let d_h = (z_theta + sigma * r_theta) / r - by_theta * sigma / (r * r);
            let d_speed2 = 2.0 * (phi_r[i] * d_r + phi_z[i] * d_z + phi_h[i] * d_h);
            let head = 0.5 * speed2 + zeta[i] - pressure;
            pull[i] = weight * (omega * rate[i] * flux_1 - w * head);
            lift[i] = weight * phi[i] * w;
            bend[i] = weight * (omega * rate[i] * flux_2 - w_1 * head - w * (0.5 * d_speed2 + 1.0));
            couple[i] = weight * omega * flux_1;
            by_omega[i] = weight * rate[i] * flux_1;
            push[i] = weight * rate[i] * w;
            swell[i] = weight * w;
            for j in 0..nc {
                let d_u = u_z[(i, j)] + sigma * u_r[(i, j)];
                along[(i, j)] = weight * omega * rate[i] * (d_u * w + u[(i, j)] * w_1);
                kinetic[(i, j)] = weight
                    * w
                    * (phi_r[i] * u_r[(i, j)] + phi_z[i] * u_z[(i, j)] + phi_h[i] * u_h[(i, j)]);
            }
        }
        let (energy, volume) = self.energy_above(&zeta)?;
        let moved = &energy * &c;

        let mut gradient = DVector::zeros(size);
        let on_z = self.elevation.tr_mul(&pull) + omega * self.rate.tr_mul(&lift);
        gradient.rows_mut(0, nz).copy_from(&on_z);
        let on_c = omega * u.tr_mul(&push) - moved;
        gradient.rows_mut(nz, nc).copy_from(&on_c);
        gradient[nz + nc] = volume;
        let first = self.first_mode();
        gradient[nz + nc + 1] = first.dot(&elevations) - part;

        let mut matrix = DMatrix::zeros(size, size);
        let cross = self.elevation.tr_mul(&scaled(&self.rate, &couple));
        let zz =
            self.elevation.tr_mul(&scaled(&self.elevation, &bend)) + &cross + cross.transpose();
        matrix.view_mut((0, 0), (nz, nz)).copy_from(&zz);
        let zc = self.elevation.tr_mul(&(along - kinetic))
            + omega * self.rate.tr_mul(&scaled(u, &swell));
        matrix.view_mut((0, nz), (nz, nc)).copy_from(&zc);
        matrix.view_mut((nz, 0), (nc, nz)).copy_from(&zc.transpose());
        matrix.view_mut((nz, nz), (nc, nc)).copy_from(&-energy);
        let swollen = self.elevation.tr_mul(&swell);
        matrix.view_mut((0, nz + nc), (nz, 1)).copy_from(&swollen);
        matrix.view_mut((nz + nc, 0), (1, nz)).copy_from(&swollen.transpose());
        let by_omega = self.elevation.tr_mul(&by_omega) + self.rate.tr_mul(&lift);
        matrix.view_mut((0, nz + nc + 1), (nz, 1)).copy_from(&by_omega);
        matrix.view_mut((nz, nz + nc + 1), (nc, 1)).copy_from(&u.tr_mul(&push));
        matrix.view_mut((nz + nc + 1, 0), (1, nz)).copy_from(&first.transpose());
        Some((gradient, matrix))
    }

    /// Returns the matrix of the kinetic energy for the surface elevation `zeta`, and the volume
    /// between the surface at rest and the wave, which must be 0. The result is `None` if the wave
    /// leaves the smooth side of the wall.
    fn energy_above(&self, zeta: &DVector<f64>) -> Option<(DMatrix<f64>, f64)> {
        let [_, nc] = self.sizes();
        let mut energy = DMatrix::zeros(nc, nc);
        let mut column = 0;
        for term in self.terms.iter().filter(|term| term.has_potential()) {
            let level = usize::from(term.m == 0);
            for j in level..self.potentials_of(*term) {
                energy[(column + j, column + j)] = term.norm();
            }
            column += self.potentials_of(*term);
        }
        let mut volume = 0.0;
        for (node, weight) in self.line.nodes.iter().zip(&self.line.weights) {
            let z: Vec<f64> = zeta.iter().map(|zeta| zeta * node).collect();
            let walls = self.walls(&z)?;
            let at = self.potentials(&self.points, &z, &walls, None);
            let by = DVector::from_fn(z.len(), |i, _| {
                self.points.weights[i] * weight * zeta[i] * walls[i][0].powi(2)
            });
            volume += by.sum();
            for field in &at.values[1..] {
                energy += field.tr_mul(&scaled(field, &by));
            }
        }
        Some((energy, volume))
    }

    /// Returns a vector whose scalar product with the coefficients of the elevation is the
    /// coefficient of the first mode.
    fn first_mode(&self) -> DVector<f64> {
        let [nz, _] = self.sizes();
        let count = self.resolution.polynomials;
        let mut all = DVector::zeros(nz);
        let n = self.terms.iter().position(|term| term.m == 1 && term.k == 1).unwrap_or(0);
        all.rows_mut(n * count, count).copy_from(&self.shape);
        all
    }

    fn small_wave(&self, part: f64) -> DVector<f64> {
        let [nz, nc] = self.sizes();
        let omega = self.lambda.sqrt();
        let mut x = DVector::zeros(nz + nc + 2);
        x.rows_mut(0, nz).copy_from(&(part * self.first_mode()));
        let mut column = nz;
        for term in &self.terms {
            if term.m == 1 && term.k == 1 {
                let all = -omega * part * &self.potential;
                x.rows_mut(column, all.len()).copy_from(&all);
            }
            column += self.potentials_of(*term);
        }
        x[nz + nc + 1] = omega;
        x
    }

    fn refine(&self, mut x: DVector<f64>, part: f64) -> Option<DVector<f64>> {
        for _ in 0..STEPS {
            let (gradient, matrix) = self.equations(&x, part)?;
            let change = matrix.lu().solve(&gradient)?;
            if !change.iter().all(|change| change.is_finite()) {
                return None;
            }
            x -= &change;
            if change.amax() < CONVERGED * part.abs() {
                return Some(x);
            }
        }
        None
    }

    /// Returns the sine of the slosh angle, and the rise of the centre of mass as [`LargeWave`]
    /// defines it, at the phase 0 of the wave with the unknowns `x`.
    fn measure(&self, x: &DVector<f64>) -> Option<[f64; 2]> {
        let scale = 2.0 / (self.amplitude * self.amplitude);
        Some(self.moments(x)?.map(|moment| scale * moment))
    }

    /// Returns the first moments, sideways and upwards, of the liquid between the surface at rest
    /// and the wave with the unknowns `x`, at the phase 0.
    fn moments(&self, x: &DVector<f64>) -> Option<[f64; 2]> {
        let [nz, _] = self.sizes();
        let rule = Gauss::new(self.resolution.polynomials + 6);
        let count = 2 * self.resolution.order + 4;
        let grid: Vec<[f64; 2]> =
            (0..count).map(|i| [PI * (i as f64 + 0.5) / count as f64, 0.0]).collect();
        let points = Points::new(&rule, &grid);
        let [elevation, _] = self.elevations(&points);
        let zeta = elevation * x.rows(0, nz);
        let [mut sideways, mut up] = [0.0; 2];
        for i in 0..zeta.len() {
            for (node, weight) in self.line.nodes.iter().zip(&self.line.weights) {
                let z = zeta[i] * node;
                let wide = self.side.at(z)?[0];
                let by = points.weights[i] * weight * zeta[i] * wide * wide;
                sideways += by * points.rho[i] * wide * points.angles[i][0].cos();
                up += by * z;
            }
        }
        Some([sideways, up])
    }

    /// Computes waves whose first mode has the slosh angles `angles`, rad, in ascending order. A
    /// wave is `None` if Newton's method does not converge.
    fn waves(&self, angles: &[f64]) -> Vec<Option<LargeWave>> {
        let mut found: Vec<(f64, DVector<f64>)> = Vec::new();
        let mut wave = |angle: &f64| {
            let part = angle.sin() * self.amplitude;
            let start = match &found[..] {
                [] => self.small_wave(part),
                [(a, x)] => {
                    let mut x = x * (part / a);
                    let last = x.len() - 1;
                    x[last] *= a / part;
                    x
                }
                [.., (a, x), (b, y)] => y + (y - x) * ((part - b) / (b - a)),
            };
            let x = self.refine(start, part)?;
            let [sine, rise] = self.measure(&x)?;
            let frequency = x[x.len() - 1] / self.lambda.sqrt();
            found.push((part, x));
            Some(LargeWave { angle: sine.asin(), frequency, rise })
        };
        angles.iter().map(&mut wave).collect()
    }
}

/// Degrees of the solid harmonics in the computations of one wave, whose median is used. The median
/// is needed because in each computation a few waves are wrong: a multiple of the wave's frequency
/// happens to equal the frequency of a high mode of the truncated liquid.
const DEGREES: [usize; 6] = [9, 10, 11, 12, 13, 14];
const ORDER: usize = 4;
/// Slosh angles at which waves are computed, degrees.
const ANGLES: [f64; 9] = [2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0];
/// Largest accepted relative scatter of the frequencies that the computations with the different
/// [`DEGREES`] give at one slosh angle, measured by the median absolute deviation.
const SCATTER: f64 = 2e-4;

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() % 2 {
        1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}

/// Returns periodic waves of the liquid above `wall` with rising slosh angle. Each wave is the
/// median of the results with the degrees [`DEGREES`] of the solid harmonics. The list ends at the
/// slosh angle at which the frequencies of these results scatter by more than [`SCATTER`]; it is
/// empty for a liquid with a hole.
fn backbone(wall: &Wall, side: &Side, motion: Motion) -> Vec<LargeWave> {
    let angles = ANGLES.map(f64::to_radians);
    let truncation = &|degree: usize| {
        let resolution = Resolution { degree, polynomials: degree / 2, order: ORDER };
        Some(Solver::new(wall, side, motion, resolution)?.waves(&angles))
    };
    let all: Vec<Vec<Option<LargeWave>>> = thread::scope(|scope| {
        let threads = DEGREES.map(|degree| scope.spawn(move || truncation(degree)));
        threads.into_iter().filter_map(|thread| thread.join().ok().flatten()).collect()
    });
    let mut pooled: Vec<(usize, LargeWave)> = Vec::new();
    for truncation in &all {
        pooled.extend(truncation.iter().enumerate().filter_map(|(i, wave)| Some((i, (*wave)?))));
    }
    let pooled = without_outliers(pooled);
    let mut waves = Vec::new();
    for i in 0..angles.len() {
        let here: Vec<LargeWave> =
            pooled.iter().filter(|(k, _)| *k == i).map(|(_, wave)| *wave).collect();
        if 2 * here.len() < DEGREES.len() {
            continue;
        }
        // The shift of omega^2 and the excess of the rise, both divided by the squared sine of the angle, hardly
        // depend on the angle.
        let of = |f: &dyn Fn(&LargeWave) -> f64| here.iter().map(f).collect::<Vec<f64>>();
        let square = |wave: &LargeWave| wave.angle.sin().powi(2);
        let shift = |wave: &LargeWave| (wave.frequency.powi(2) - 1.0) / square(wave);
        let excess = |wave: &LargeWave| (2.0 * wave.rise / square(wave) - 1.0) / square(wave);
        let (u, a, b) =
            (median(&mut of(&square)), median(&mut of(&shift)), median(&mut of(&excess)));
        let scatter = median(&mut of(&|wave: &LargeWave| 0.5 * u * (shift(wave) - a).abs()));
        if scatter > SCATTER {
            break;
        }
        waves.push(LargeWave {
            angle: u.sqrt().asin(),
            frequency: (1.0 + a * u).sqrt(),
            rise: 0.5 * u * (1.0 + b * u),
        });
    }
    waves
}

/// Relative distance from the straight line through the other waves beyond which a wave counts as
/// an outlier: for its frequency, and for the rise of its centre of mass.
const OUTLIER: [f64; 2] = [5e-4, 3e-3];

/// Removes waves whose frequency or rise lies off the straight line through the other waves,
/// because the truncated expansion has a resonance there. Each wave comes with the index of its
/// slosh angle. Two quantities are almost linear in u, the squared sine of the slosh angle: the
/// shift of omega^2 divided by u, and the relative excess of the rise over u/2, divided by u. The
/// slope of each line is the median over all pairs of waves with different angles.
fn without_outliers(mut waves: Vec<(usize, LargeWave)>) -> Vec<(usize, LargeWave)> {
    for (i, allowed) in OUTLIER.into_iter().enumerate() {
        let point = |wave: &LargeWave| {
            let u = wave.angle.sin().powi(2);
            let part = [0.5 * (wave.frequency.powi(2) - 1.0), 2.0 * wave.rise / u - 1.0][i];
            [u, part / u]
        };
        let points: Vec<(usize, [f64; 2])> =
            waves.iter().map(|(k, wave)| (*k, point(wave))).collect();
        let mut slopes = Vec::new();
        for (k, (number, [u, y])) in points.iter().enumerate() {
            let others = points[..k].iter().filter(|(other, _)| other != number);
            slopes.extend(others.map(|(_, [v, x])| (y - x) / (u - v)));
        }
        if slopes.is_empty() {
            return Vec::new();
        }
        let slope = median(&mut slopes);
        let mut starts: Vec<f64> = points.iter().map(|(_, [u, y])| y - slope * u).collect();
        let start = median(&mut starts);
        waves.retain(|(_, wave)| {
            let [u, y] = point(wave);
            u * (y - start - slope * u).abs() < allowed
        });
    }
    waves
}

/// A slosh mass with the energy and the frequencies of large waves, see `formulas::energy_terms`.
/// `errors` are the largest relative errors, up to the slosh angle `compared`, of the frequency in
/// planar motion, of the frequency in circular motion, and of the energy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fit {
    pub terms: EnergyTerms,
    pub errors: [f64; 3],
    pub shifts: [f64; 2],
}

fn line(points: &[[f64; 2]]) -> [f64; 2] {
    let mut sums = [0.0; 5];
    for [u, y] in points {
        let w = u * u;
        for (sum, value) in sums.iter_mut().zip([w, w * u, w * u * u, w * y, w * u * y]) {
            *sum += value;
        }
    }
    let [w, wu, wuu, wy, wuy] = sums;
    let determinant = w * wuu - wu * wu;
    [(wy * wuu - wuy * wu) / determinant, (w * wuy - wu * wy) / determinant]
}

/// Returns the frequency of the slosh mass in planar motion with the amplitude `angle`, rad,
/// divided by the frequency of small motion. The period is an integral over the displacement q = a
/// sin t, which is evaluated by quadrature.
fn planar_frequency(terms: &EnergyTerms, angle: f64) -> f64 {
    let ([s, kappa], [s_2, kappa_2]) = (terms.pair, terms.next);
    let (a, count) = (angle.sin(), 32);
    let quarter: f64 = (0..count)
        .map(|i| {
            let q = a * ((f64::from(i) + 0.5) * PI / (2.0 * f64::from(count))).sin();
            let u = q * q;
            let slope =
                q * (1.0 / (1.0 - u).sqrt() + (kappa - 1.0) * u / 2.0 + 0.375 * kappa_2 * u * u);
            let inertia = 1.0 + slope * slope + (s - 1.0) * u + s_2 * u * u;
            // (height(a) - height(q))/(a^2 - q^2), with the height of the surface on which the slosh mass moves
            let rise = 1.0 / ((1.0 - u).sqrt() + (1.0 - a * a).sqrt())
                + (kappa - 1.0) * (a * a + u) / 8.0
                + kappa_2 * (a.powi(4) + a * a * u + u * u) / 16.0;
            (inertia / (2.0 * rise)).sqrt() / f64::from(count)
        })
        .sum();
    1.0 / quarter
}

/// Returns the restoring force of the slosh mass divided by its displacement, in units in which
/// mass, length and specific force are 1. `u` is the squared displacement.
fn restoring_stiffness(terms: &EnergyTerms, u: f64) -> f64 {
    1.0 / (1.0 - u).sqrt() + (terms.pair[1] - 1.0) * u / 2.0 + 0.375 * terms.next[1] * u * u
}

fn circular_frequency(terms: &EnergyTerms, angle: f64) -> f64 {
    let (u, [t, t_2]) = (angle.sin().powi(2), terms.rotary);
    (restoring_stiffness(terms, u) / (1.0 + 2.0 * t * u + 3.0 * t_2 * u * u)).sqrt()
}

/// Returns the limits of a third-order slosh mass with the coefficients `pair` = (s, kappa), in a
/// tank whose large waves have the coefficients `terms`. Above the returned slosh angles the
/// frequency of the third-order mass, in planar or in circular motion, differs too much from the
/// frequency of the large waves. The returned angles never exceed the angle up to which `terms` are
/// valid.
pub(crate) fn third_order_limit(terms: &EnergyTerms, pair: [f64; 2]) -> AngleLimit {
    let third = EnergyTerms { pair, next: [0.0; 2], rotary: [0.0; 2], ..*terms };
    let off = |angle: f64| {
        [planar_frequency, circular_frequency]
            .map(|frequency| (frequency(&third, angle) / frequency(terms, angle) - 1.0).abs())
            .into_iter()
            .fold(0.0, f64::max)
    };
    let last_within = |error: f64| {
        let angles =
            (1..=LIMIT_STEPS).map(|i| terms.compared * f64::from(i) / f64::from(LIMIT_STEPS));
        angles.take_while(|angle| off(*angle) < error).last().unwrap_or(0.0)
    };
    AngleLimit {
        frequency: last_within(limits::FREQUENCY),
        forced: last_within(limits::FORCED_UNCOMPARED),
    }
}

const LIMIT_STEPS: u32 = 200;

/// Smallest slosh angle up to which waves must be known for a fit, rad.
pub(crate) const LEAST: f64 = 6.0 * PI / 180.0;

/// Computes periodic waves of the liquid above `wall`, and fits the coefficients of the slosh mass
/// to them. `side` is the smooth part of the wall around the contact line. Returns `None` for a
/// liquid with a hole, or if the waves end below the slosh angle [`LEAST`].
pub(crate) fn fit(wall: &Wall, side: &Side) -> Option<Fit> {
    let [planar, circular] =
        [Motion::Planar, Motion::Circular].map(|motion| backbone(wall, side, motion));
    fit_waves(&planar, &circular)
}

fn fit_waves(planar: &[LargeWave], circular: &[LargeWave]) -> Option<Fit> {
    if planar.len().min(circular.len()) < 3 {
        return None;
    }
    // Planar and circular motion are used up to the same slosh angle.
    let largest = planar[planar.len() - 1].angle.min(circular[circular.len() - 1].angle);
    let upto = |waves: &[LargeWave]| -> Vec<LargeWave> {
        waves.iter().filter(|wave| wave.angle < 1.05 * largest).copied().collect()
    };
    let [planar, circular] = [upto(planar), upto(circular)];
    if planar.len().min(circular.len()) < 3 || largest < 0.95 * LEAST {
        return None;
    }
    let square = |wave: &LargeWave| wave.angle.sin().powi(2);
    // At the largest angle of planar motion the liquid is at rest, so that its energy is the potential energy of its height.
    let heights: Vec<[f64; 2]> = planar
        .iter()
        .map(|wave| {
            let u = square(wave);
            [u, 8.0 * (wave.rise - (1.0 - (1.0 - u).sqrt())) / (u * u)]
        })
        .collect();
    let [kappa, kappa_2] = line(&heights);
    let mut terms = EnergyTerms {
        pair: [1.0, 1.0 + kappa],
        next: [0.0, 2.0 * kappa_2],
        rotary: [0.0; 2],
        compared: largest,
    };
    let turns: Vec<[f64; 2]> = circular
        .iter()
        .map(|wave| {
            let u = square(wave);
            [u, (restoring_stiffness(&terms, u) / wave.frequency.powi(2) - 1.0) / u]
        })
        .collect();
    let [t, t_2] = line(&turns);
    terms.rotary = [t / 2.0, t_2 / 3.0];
    // The frequency is almost linear in s u and s_2 u^2, with the coefficients -1/4 and -3/16.
    for _ in 0..8 {
        let off: Vec<[f64; 2]> = planar
            .iter()
            .map(|wave| {
                let u = square(wave);
                [u, 4.0 * (planar_frequency(&terms, wave.angle) / wave.frequency - 1.0) / u]
            })
            .collect();
        let [s, s_2] = line(&off);
        terms.pair[0] += s;
        terms.next[0] += s_2 / 0.75;
    }
    let shift = |wave: &LargeWave| (wave.frequency.powi(2) - 1.0) / square(wave);
    let shifts = [shift(&planar[0]), shift(&circular[0])];
    Some(Fit { errors: errors(&terms, &planar, &circular), shifts, terms })
}

/// Returns the largest relative errors of the slosh mass `terms` up to its angle `compared`: of its
/// frequency in planar motion, of its frequency in circular motion, and of its energy in planar
/// motion.
fn errors(terms: &EnergyTerms, planar: &[LargeWave], circular: &[LargeWave]) -> [f64; 3] {
    let square = |wave: &LargeWave| wave.angle.sin().powi(2);
    let is_compared = |wave: &&LargeWave| wave.angle < terms.compared + 1e-9;
    let mut errors = [0.0_f64; 3];
    for wave in planar.iter().filter(is_compared) {
        let u = square(wave);
        let height = 1.0 - (1.0 - u).sqrt()
            + (terms.pair[1] - 1.0) * u * u / 8.0
            + terms.next[1] * u.powi(3) / 16.0;
        let frequency = planar_frequency(terms, wave.angle);
        errors[0] = errors[0].max((frequency / wave.frequency - 1.0).abs());
        errors[2] = errors[2].max((height / wave.rise - 1.0).abs());
    }
    for wave in circular.iter().filter(is_compared) {
        let frequency = circular_frequency(terms, wave.angle);
        errors[1] = errors[1].max((frequency / wave.frequency - 1.0).abs());
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sphere_waves;

    fn cylinder() -> Contour {
        let bottom = Segment::line([0.0, 0.0], [1.0, 0.0]);
        Contour::new(vec![bottom, Segment::line([1.0, 0.0], [1.0, 4.0])]).unwrap()
    }

    fn sphere() -> Contour {
        Contour::new(vec![Segment::arc([0.0, 1.0], 1.0, -90.0, 90.0)]).unwrap()
    }

    fn waves(contour: &Contour, fill: f64) -> [Vec<LargeWave>; 2] {
        let wall = contour.cut(fill).unwrap();
        let side = Side::new(contour, &wall).unwrap();
        [Motion::Planar, Motion::Circular].map(|motion| backbone(&wall, &side, motion))
    }

    /// The frequencies in tests/backbones.csv were computed by two other programs. One uses a
    /// variational method with other base functions, the other marches in time.
    #[test]
    fn large_waves_in_cylinders_have_the_frequencies_of_two_other_programs() {
        let known: Vec<[Option<f64>; 4]> = include_str!("../tests/backbones.csv")
            .lines()
            .skip(1)
            .map(|line| {
                let mut cells = line.split(',').map(|cell| cell.parse().ok());
                core::array::from_fn(|_| cells.next().flatten())
            })
            .collect();
        let mut compared = 0;
        for fill in [0.5, 1.227] {
            for (motion, waves) in waves(&cylinder(), fill).iter().enumerate() {
                let points: Vec<[f64; 2]> = known
                    .iter()
                    .filter(|row| row[0] == Some(fill))
                    .filter_map(|row| Some([row[1]?, row[2 + motion]?]))
                    .collect();
                for wave in waves {
                    let degrees = wave.angle.to_degrees();
                    let Some(pair) = points.windows(2).find(|pair| pair[1][0] >= degrees) else {
                        continue;
                    };
                    // Interpolates between two waves: the shift of the frequency is nearly proportional to the
                    // square of the angle.
                    let [[a, f_a], [b, f_b]] = [pair[0], pair[1]];
                    let share = (degrees.powi(2) - a * a) / (b * b - a * a);
                    let exact = f_a + (f_b - f_a) * share;
                    let off = (wave.frequency / exact - 1.0).abs();
                    assert!(off < 3e-4, "{fill} {motion} {degrees}: {} {exact}", wave.frequency);
                    compared += 1;
                }
            }
        }
        assert!(compared > 20, "{compared}");
    }

    /// Returns the mean energy of the wave with the unknowns `x`, and its energy at the phase 0,
    /// where all energy is potential. Both are relative to 2 pi rho g R^4.
    fn energies(solver: &Solver, x: &DVector<f64>) -> [f64; 2] {
        let [nz, nc] = solver.sizes();
        let zeta = &solver.elevation * x.rows(0, nz);
        let (matrix, _) = solver.energy_above(&zeta).unwrap();
        let c = x.rows(nz, nc);
        let mut energy = 0.5 * (c.transpose() * matrix * c)[0];
        for i in 0..zeta.len() {
            for (node, weight) in solver.line.nodes.iter().zip(&solver.line.weights) {
                let z = zeta[i] * node;
                let wide = solver.side.at(z).unwrap()[0];
                energy += solver.points.weights[i] * weight * zeta[i] * wide * wide * z;
            }
        }
        [energy, solver.moments(x).unwrap()[1]]
    }

    /// Along a family of periodic motions the energy E and the action J obey dE = omega dJ. The
    /// action is the mean of twice the kinetic energy divided by omega. At the phase 0 the liquid
    /// is at rest, so that its height gives the whole energy. The expansion in this test has no
    /// resonance at these slosh angles.
    #[test]
    fn the_frequency_of_planar_waves_is_the_derivative_of_energy_by_action() {
        for (contour, fill) in [(cylinder(), 0.6), (sphere(), 0.6), (sphere(), 0.35)] {
            let wall = contour.cut(fill).unwrap();
            let side = Side::new(&contour, &wall).unwrap();
            let resolution = Resolution { degree: 10, polynomials: 5, order: 4 };
            let solver = Solver::new(&wall, &side, Motion::Planar, resolution).unwrap();
            let [nz, nc] = solver.sizes();
            let wave = |degrees: f64| {
                let part = degrees.to_radians().sin() * solver.amplitude;
                let mut x = solver.refine(solver.small_wave(0.02), 0.02).unwrap();
                for k in 1..=8 {
                    let next = 0.02 + (part - 0.02) * f64::from(k) / 8.0;
                    x = solver.refine(x, next).unwrap();
                }
                let [energy, at_rest] = energies(&solver, &x);
                assert!((at_rest / energy - 1.0).abs() < 5e-4, "{degrees} {at_rest} {energy}");
                let zeta = &solver.elevation * x.rows(0, nz);
                let (matrix, _) = solver.energy_above(&zeta).unwrap();
                let c = x.rows(nz, nc);
                let omega = x[nz + nc + 1];
                let action = (c.transpose() * matrix * c)[0] / omega;
                [energy, action, omega]
            };
            let [a, b] = [6.0, 6.2].map(wave);
            let mean = (b[0] - a[0]) / (b[1] - a[1]);
            let middle = 0.5 * (a[2] + b[2]);
            assert!((mean / middle - 1.0).abs() < 1e-6, "{mean} {middle}");
        }
    }

    /// The frequencies, each the median of the results with the degrees [`DEGREES`] of the solid
    /// harmonics, are compared with the result of one finer expansion, in which the largest
    /// multiple of the frequency is 5 instead of [`ORDER`].
    #[test]
    #[ignore = "ten seconds of CPU time: .ci/long-tests"]
    fn large_waves_in_a_sphere_do_not_depend_on_the_resolution() {
        let contour = sphere();
        let wall = contour.cut(0.5).unwrap();
        let side = Side::new(&contour, &wall).unwrap();
        let angles = [2.0, 5.0, 8.0, 10.0, 12.0].map(f64::to_radians);
        for motion in [Motion::Planar, Motion::Circular] {
            let resolution = Resolution { degree: 12, polynomials: 6, order: 5 };
            let fine = Solver::new(&wall, &side, motion, resolution).unwrap().waves(&angles);
            let coarse = backbone(&wall, &side, motion);
            let fine: Vec<LargeWave> = fine.into_iter().flatten().collect();
            let mut close = 0;
            for wave in &fine {
                let shift = |wave: &LargeWave| {
                    let u = wave.angle.sin().powi(2);
                    [(wave.frequency.powi(2) - 1.0) / u, (2.0 * wave.rise / u - 1.0) / u]
                };
                let near = coarse.iter().min_by(|a, b| {
                    (a.angle - wave.angle).abs().total_cmp(&(b.angle - wave.angle).abs())
                });
                let (near, found) = (shift(near.unwrap()), shift(wave));
                close += usize::from((0..2).all(|i| (near[i] - found[i]).abs() < 0.02));
            }
            // At most one wave of the finer expansion may be wrong, because this expansion has a resonance at its slosh angle.
            assert!(close >= 4 && fine.len() == 5, "{motion:?} {close} {fine:?} {coarse:?}");
        }
    }

    #[test]
    #[ignore = "ten seconds of CPU time: .ci/long-tests"]
    fn the_coefficients_of_spheres_are_accurate_between_the_fills_of_their_table() {
        for fill in [0.25, 0.35, 0.85] {
            let [planar, circular] = waves(&sphere(), fill);
            let terms = sphere_waves::energy_terms(fill).unwrap();
            let [flat, round, energy] = errors(&terms, &planar, &circular);
            println!("{fill}: {flat:.1e} {round:.1e} {energy:.1e}");
            let [frequency_error, energy_error] = sphere_waves::ERRORS;
            assert!(flat < frequency_error && round < frequency_error, "{fill}: {flat} {round}");
            assert!(energy < energy_error, "{fill}: {energy}");
        }
        assert_eq!(
            [0.09, 1.06, f64::NAN].map(|fill| sphere_waves::energy_terms(fill).is_some()),
            [false; 3]
        );
    }

    #[test]
    fn the_smooth_side_of_a_wall_ends_at_corners_and_continues_over_smooth_joints() {
        let joined = Contour::new(vec![
            Segment::arc([0.0, 1.0], 1.0, -90.0, -20.0),
            Segment::arc([0.0, 1.0], 1.0, -20.0, 10.0),
            Segment::arc([0.0, 1.0], 1.0, 10.0, 90.0),
        ])
        .unwrap();
        let sides = [sphere(), joined].map(|contour| {
            let wall = contour.cut(0.9).unwrap();
            Side::new(&contour, &wall).unwrap()
        });
        for z in [-0.6, -0.25, 0.0, 0.1, 0.3, 0.7] {
            let [a, b] = sides.each_ref().map(|side| side.at(z).unwrap());
            let height: f64 = z * 0.99f64.sqrt() - 0.1;
            let exact = ((1.0 - height * height) / 0.99).sqrt();
            assert!(
                (a[0] - exact).abs() < 1e-12 && (b[0] - exact).abs() < 1e-12,
                "{z} {a:?} {b:?}"
            );
            assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-6), "{z} {a:?} {b:?}");
        }
        let cone = Contour::new(vec![
            Segment::line([0.0, 0.0], [0.5, 0.5]),
            Segment::line([0.5, 0.5], [0.5, 1.5]),
        ])
        .unwrap();
        let wall = cone.cut(0.4).unwrap();
        let side = Side::new(&cone, &wall).unwrap();
        assert!((side.high - ROOM * 0.1 / 0.4).abs() < 1e-12 && side.at(0.21).is_none());
    }
}

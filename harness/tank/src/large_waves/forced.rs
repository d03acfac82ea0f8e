//! Steady waves of large amplitude that are forced by a tank which moves sideways with the frequency omega; used by studies.
//!
//! The functions of azimuth and phase in the elevation and in the potential are both cosines and sines. The tank's
//! acceleration a, and damping with the ratio zeta of every mode of small waves (frequency omega_n, potential phi = sum
//! c_n u_n), act on the surface as a pressure divided by density
//! ```text
//! a.x + 2 zeta sum omega_n c_n u_n
//! ```
//!
//! which is added to the equation of the elevation in `large_waves.rs`. A small wave then obeys eta'' + 2 zeta omega_n eta' +
//! omega_n^2 eta = -force, as a slosh mass does. Newton's method finds the acceleration for a given first mode of the wave,
//! because one acceleration can cause several waves, whereas a given wave is caused by only one acceleration.

use core::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};

use super::{Motion, Points, Resolution, STEPS, Side, Solver, Term};
use crate::contour::Wall;
use crate::gauss::Gauss;
use crate::tank::{Geometry, Tank};

/// Allowed motions of the liquid: in a plane (`Plane`), in space (`All`), and steadily on a circle
/// (`Circle`). On a circle, azimuth theta and phase tau occur only as tau - theta.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    Plane,
    All,
    Circle,
}

/// A function of azimuth theta and phase tau: the product of a function of m theta and a function
/// of k tau. Each is a sine where `sine` is true, otherwise a cosine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Function {
    space: Space,
    sine: [bool; 2],
}

fn wave(x: f64, sine: bool) -> [f64; 2] {
    let (sin, cos) = x.sin_cos();
    if sine { [sin, cos] } else { [cos, -sin] }
}

impl Function {
    pub(super) fn terms(self, order: usize) -> Vec<Term> {
        let of = |m: usize, k: usize, sine: [bool; 2]| {
            let motion = Motion::Forced(Function { space: self.space, sine });
            Term { m, k, motion }
        };
        let mut terms = Vec::new();
        for m in 0..=order {
            for k in 0..=order {
                for [a, b] in [[false, false], [false, true], [true, false], [true, true]] {
                    let is_zero = (m == 0 && a) || (k == 0 && b);
                    let is_odd = (m + k) % 2 == 1;
                    let is_left_out = match self.space {
                        Space::Plane => a,
                        Space::All => false,
                        Space::Circle => a || m != k,
                    };
                    if !(is_zero || is_odd || is_left_out) {
                        terms.push(of(m, k, [a, b]));
                    }
                }
            }
        }
        terms
    }

    pub(super) fn at(self, term: Term, [theta, tau]: [f64; 2]) -> [f64; 4] {
        let (m, k) = (term.m as f64, term.k as f64);
        let [value, by_tau, by_theta] = match self.space {
            Space::Circle => {
                let [value, slope] = wave(m * (tau - theta), self.sine[1]);
                [value, m * slope, -m * slope]
            }
            _ => {
                let [[a, a_1], [b, b_1]] =
                    [wave(m * theta, self.sine[0]), wave(k * tau, self.sine[1])];
                [a * b, k * a * b_1, m * a_1 * b]
            }
        };
        [value, by_tau, value, by_theta]
    }

    pub(super) fn norm(self, term: Term) -> f64 {
        let half = |n: usize| if n > 0 { 0.5 } else { 1.0 };
        match self.space {
            Space::Circle => half(term.m),
            _ => half(term.m) * half(term.k),
        }
    }

    /// Returns the pairs (azimuth, phase) at which the equations of a wave are evaluated. Half of
    /// all azimuths are enough, because the wave has the symmetry (theta + pi, tau + pi); in plane
    /// motion, which also has the symmetry -theta, a quarter of them is enough; on a circle, one
    /// phase. `count` is the number of azimuths in half a turn.
    pub(super) fn grid(self, count: usize) -> Vec<[f64; 2]> {
        let half = |n: usize| PI * (n as f64 + 0.5) / count as f64;
        let [thetas, taus] = match self.space {
            Space::Plane => [count / 2, 2 * count],
            Space::All => [count, 2 * count],
            Space::Circle => return (0..2 * count).map(|i| [half(i), 0.0]).collect(),
        };
        (0..thetas).flat_map(|i| (0..taus).map(move |j| [half(i), half(j)])).collect()
    }
}

/// A steady forced wave. Each vector holds the values of one period at [`PHASES`] phases.
///
/// - `q`: displacement of the slosh mass along x and y, in units of its length; its magnitude is
///   the sine of the slosh angle.
/// - `push`: acceleration of the tank along x and y, in units of g: for each axis the coefficients
///   of cos(tau) and sin(tau) with the phase tau.
/// - `ratio`: frequency of the wave divided by the frequency of small free waves.
#[derive(Clone, Debug)]
pub struct ForcedWave {
    pub q: [Vec<f64>; 2],
    pub push: [[f64; 2]; 2],
    pub ratio: f64,
}

pub const PHASES: usize = 64;

/// Returns the first harmonic of the values of one period, as the coefficients of cos(tau) and
/// sin(tau) with the phase tau.
pub fn first_harmonic(values: &[f64]) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (i, value) in values.iter().enumerate() {
        let (sin, cos) = (TAU * i as f64 / values.len() as f64).sin_cos();
        sums = [sums[0] + cos * value, sums[1] + sin * value];
    }
    sums.map(|sum| 2.0 * sum / values.len() as f64)
}

impl ForcedWave {
    /// Returns the force of the liquid on the tank along x and y at all phases, divided by the
    /// weight of the slosh mass. `share` is the slosh mass divided by the mass of the liquid.
    pub fn force(&self, share: f64) -> [Vec<f64>; 2] {
        [0, 1].map(|axis| {
            let values = &self.q[axis];
            (0..PHASES)
                .map(|i| {
                    let tau = TAU * i as f64 / PHASES as f64;
                    let push = self.push[axis][0] * tau.cos() + self.push[axis][1] * tau.sin();
                    -push / share - self.ratio.powi(2) * second_derivative(values, tau)
                })
                .collect()
        })
    }
}

/// Returns the second derivative, with respect to the phase, of a periodic function at the phase
/// `tau`. It is computed from the harmonics of the `values` of one period.
fn second_derivative(values: &[f64], tau: f64) -> f64 {
    let count = values.len();
    (1..count / 4)
        .map(|k| {
            let mut sum = 0.0;
            for (i, value) in values.iter().enumerate() {
                sum += value * (k as f64 * (tau - TAU * i as f64 / count as f64)).cos();
            }
            -(k as f64).powi(2) * 2.0 * sum / count as f64
        })
        .sum()
}

/// Solver for steady waves in a tank that moves sideways.
///
/// - `drag`: damping matrix for the coefficients of the potential: the sum of 2 zeta omega_n u_n
///   u_n^T over all modes n, where u_n is the vector of the coefficients of mode n.
/// - `first`: indices of the terms of the first mode, with the phase tau: cos(tau) and sin(tau) of
///   the motion along x, and then of the motion along y.
pub struct Forced<'a> {
    solver: Solver<'a>,
    drag: DMatrix<f64>,
    omega: f64,
    ratio: f64,
    first: Vec<usize>,
}

pub struct Walls {
    wall: Wall,
    side: Side,
}

impl Walls {
    /// Returns the walls of a tank that is filled to `fill`, m above the lowest point. The result
    /// is `None` for a box, and for a surface at a corner of the wall.
    pub fn new(tank: &Tank, fill: f64) -> Option<Walls> {
        let Geometry::Revolution { contour, .. } = &tank.geometry else { return None };
        let wall = contour.cut(fill).ok()?;
        let side = Side::new(contour, &wall)?;
        Some(Walls { wall, side })
    }
}

impl<'a> Forced<'a> {
    /// Prepares the computation of waves whose frequency is `ratio` times the frequency of small
    /// waves. `zeta` is the damping ratio of all modes. The resolution consists of the `degree` of
    /// the harmonics and the `order`, the largest multiple of the frequency. Returns `None` for a
    /// liquid with a hole.
    pub fn new(
        walls: &'a Walls,
        space: Space,
        [degree, order]: [usize; 2],
        [ratio, zeta]: [f64; 2],
    ) -> Option<Forced<'a>> {
        let resolution = Resolution { degree, polynomials: degree / 2, order };
        let motion = Motion::Forced(Function { space, sine: [false; 2] });
        let solver = Solver::new(&walls.wall, &walls.side, motion, resolution)?;
        let [_, columns] = solver.sizes();
        let mut drag = DMatrix::zeros(columns, columns);
        let mut column = 0;
        for term in solver.terms.iter().filter(|term| term.has_potential()) {
            column += usize::from(term.m == 0);
            let own = drag_of_modes(&solver, term.m) * (2.0 * zeta);
            drag.view_mut((column, column), own.shape()).copy_from(&own);
            column += own.ncols();
        }
        let first = (0..solver.terms.len())
            .filter(|&n| solver.terms[n].m == 1 && solver.terms[n].k == 1)
            .collect();
        let omega = ratio * solver.lambda.sqrt();
        Some(Forced { solver, drag, omega, ratio, first })
    }

    fn sizes(&self) -> [usize; 3] {
        let [nz, nc] = self.solver.sizes();
        [nz, nc, self.first.len()]
    }

    fn part(&self, n: usize) -> DVector<f64> {
        let [nz, ..] = self.sizes();
        let count = self.solver.resolution.polynomials;
        let mut all = DVector::zeros(nz);
        all.rows_mut(self.first[n] * count, count).copy_from(&self.solver.shape);
        all
    }

    fn equations(&self, x: &DVector<f64>, held: &[Held]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let [nz, nc, pushes] = self.sizes();
        let known = nz + nc + 1;
        let size = known + pushes;
        let mut free = DVector::zeros(known + 1);
        free.rows_mut(0, known).copy_from(&x.rows(0, known));
        free[known] = self.omega;
        let solver = &self.solver;
        let (of_free, by_free) = solver.equations(&free, 0.0)?;
        let mut gradient = DVector::zeros(size);
        let mut matrix = DMatrix::zeros(size, size);
        gradient.rows_mut(0, known).copy_from(&of_free.rows(0, known));
        matrix.view_mut((0, 0), (known, known)).copy_from(&by_free.view((0, 0), (known, known)));

        let zeta = &solver.elevation * x.rows(0, nz);
        let walls = solver.walls(zeta.as_slice())?;
        let at = solver.potentials(&solver.points, zeta.as_slice(), &walls, None);
        let [u, u_r, u_z, _] = &at.values;
        let dragged = &self.drag * x.rows(nz, nc);
        let [drag, drag_r, drag_z] = [u, u_r, u_z].map(|u| u * &dragged);
        let rows = zeta.len();
        let [mut pull, mut bend, mut wide] = [0; 3].map(|_| DVector::zeros(rows));
        let mut shapes = DMatrix::zeros(rows, pushes);
        for i in 0..rows {
            let weight = solver.points.weights[i];
            let (rho, [width, slope, _]) = (solver.points.rho[i], walls[i]);
            let [theta, tau] = solver.points.angles[i];
            let (w, w_1) = (width * width, 2.0 * width * slope);
            let (mut push, mut push_1) = (0.0, 0.0);
            for (n, term) in self.first.iter().enumerate() {
                let along = solver.terms[*term].at(theta, tau)[0];
                push += x[known + n] * along * rho * width;
                push_1 += x[known + n] * along * rho * slope;
                shapes[(i, n)] = -weight * w * along * rho * width;
            }
            let pressure = push + drag[i];
            let pressure_1 = push_1 + drag_z[i] + rho * slope * drag_r[i];
            pull[i] = -weight * w * pressure;
            bend[i] = -weight * (w_1 * pressure + w * pressure_1);
            wide[i] = -weight * w;
        }
        let mut rows_of_z = gradient.rows_mut(0, nz);
        rows_of_z += solver.elevation.tr_mul(&pull);
        let mut zz = matrix.view_mut((0, 0), (nz, nz));
        zz += solver.elevation.tr_mul(&super::scaled(&solver.elevation, &bend));
        let mut zc = matrix.view_mut((0, nz), (nz, nc));
        zc += solver.elevation.tr_mul(&super::scaled(&(u * &self.drag), &wide));
        matrix.view_mut((0, known), (nz, pushes)).copy_from(&solver.elevation.tr_mul(&shapes));
        for (row, held) in held.iter().enumerate() {
            let row = known + row;
            match held {
                Held::Wave(n, value) => {
                    let part = self.part(*n);
                    gradient[row] = part.dot(&x.rows(0, nz)) - value * solver.amplitude;
                    matrix.view_mut((row, 0), (1, nz)).copy_from(&part.transpose());
                }
                Held::Push(n, value) => {
                    gradient[row] = x[known + n] - value;
                    matrix[(row, known + n)] = 1.0;
                }
            }
        }
        Some((gradient, matrix))
    }

    fn refine(&self, mut x: DVector<f64>, held: &[Held]) -> Option<DVector<f64>> {
        for _ in 0..STEPS {
            let (gradient, matrix) = self.equations(&x, held)?;
            let change = matrix.lu().solve(&gradient)?;
            if !change.iter().all(|change| change.is_finite()) {
                return None;
            }
            x -= &change;
            if change.amax() < 1e-8 {
                return Some(x);
            }
        }
        None
    }

    /// Computes a wave for each of the ascending `sizes`. In each wave the first mode has the
    /// coefficients `shape` times the size. `shape` contains the coefficients of cos(tau) and
    /// sin(tau), with the phase tau, for the motion along x, and then for the motion along y. The
    /// list ends where Newton's method does not converge.
    pub fn waves(&self, shape: &[f64], sizes: &[f64]) -> Vec<(DVector<f64>, ForcedWave)> {
        let [nz, nc, pushes] = self.sizes();
        let mut found: Vec<(f64, DVector<f64>)> = Vec::new();
        let mut waves = Vec::new();
        for &size in sizes {
            let held: Vec<Held> =
                shape.iter().enumerate().map(|(n, part)| Held::Wave(n, size * part)).collect();
            let start = match &found[..] {
                [] => DVector::zeros(nz + nc + 1 + pushes),
                [(a, x)] => x * (size / a),
                [.., (a, x), (b, y)] => y + (y - x) * ((size - b) / (b - a)),
            };
            let Some(x) = self.refine(start, &held) else { break };
            let Some(wave) = self.measure(&x) else { break };
            found.push((size, x.clone()));
            waves.push((x, wave));
        }
        waves
    }

    /// Computes the wave in a tank that moves along x with the acceleration `push` cos(tau), in
    /// units of g. `x` holds the unknowns of a similar wave. If Newton's method does not converge,
    /// the acceleration is changed from its value in this wave to `push` in several steps. The
    /// solver must have been created with [`Space::All`].
    pub fn on_a_line(&self, x: &DVector<f64>, push: f64) -> Option<ForcedWave> {
        let [nz, nc, pushes] = self.sizes();
        let from = x.rows(nz + nc + 1, pushes).into_owned();
        let to = [push, 0.0, 0.0, 0.0];
        [1, 4, 16].iter().find_map(|&steps| {
            let mut x = x.clone();
            for step in 1..=steps {
                let part = f64::from(step) / f64::from(steps);
                let held: Vec<Held> = (0..pushes)
                    .map(|n| Held::Push(n, from[n] + part * (to[n] - from[n])))
                    .collect();
                x = self.refine(x, &held)?;
            }
            self.measure(&x)
        })
    }

    fn measure(&self, x: &DVector<f64>) -> Option<ForcedWave> {
        let [nz, nc, pushes] = self.sizes();
        let solver = &self.solver;
        let rule = Gauss::new(solver.resolution.polynomials + 6);
        let count = 4 * solver.resolution.order + 8;
        let scale = 2.0 / (solver.amplitude * solver.amplitude);
        let mut q = [Vec::new(), Vec::new()];
        for phase in 0..PHASES {
            let tau = TAU * phase as f64 / PHASES as f64;
            let grid: Vec<[f64; 2]> =
                (0..count).map(|i| [TAU * (i as f64 + 0.5) / count as f64, tau]).collect();
            let points = Points::new(&rule, &grid);
            let [elevation, _] = solver.elevations(&points);
            let zeta = elevation * x.rows(0, nz);
            let mut moment = [0.0; 2];
            for i in 0..zeta.len() {
                for (node, weight) in solver.line.nodes.iter().zip(&solver.line.weights) {
                    let wide = solver.side.at(zeta[i] * node)?[0];
                    let by = points.weights[i] * weight * zeta[i] * wide.powi(3) * points.rho[i];
                    let (sin, cos) = points.angles[i][0].sin_cos();
                    moment = [moment[0] + by * cos, moment[1] + by * sin];
                }
            }
            for (q, moment) in q.iter_mut().zip(moment) {
                q.push(scale * moment);
            }
        }
        let force = x.rows(nz + nc + 1, pushes);
        let push = match (solver.terms[self.first[0]].motion, pushes) {
            (Motion::Forced(Function { space: Space::Circle, .. }), _) => {
                // a.x = r (c cos(tau - theta) + s sin(tau - theta))
                [[force[0], force[1]], [-force[1], force[0]]]
            }
            (_, 2) => [[force[0], force[1]], [0.0; 2]],
            _ => [[force[0], force[1]], [force[2], force[3]]],
        };
        Some(ForcedWave { q, push, ratio: self.ratio })
    }
}

#[derive(Clone, Copy, Debug)]
enum Held {
    Wave(usize, f64),
    Push(usize, f64),
}

/// Returns the sum of omega_n u_n u_n^T over the modes n of the azimuthal number `m`, divided by
/// the square root of the specific force. The potential of mode n is a sum of the combinations of
/// solid harmonics that `Liquid::harmonics` returns, and the vector u_n contains the coefficients
/// of this sum.
fn drag_of_modes(solver: &Solver, m: usize) -> DMatrix<f64> {
    let Resolution { degree, polynomials, .. } = solver.resolution;
    let (f, harmonics) =
        (solver.liquid.elevations(m, polynomials), solver.liquid.harmonics(m, degree));
    let coupling = solver.liquid.coupling(&f, &harmonics.surface.u);
    // The constant elevation would change the volume, so that it is no mode.
    let level = usize::from(m == 0);
    let coupling = coupling.rows(level, polynomials - level).into_owned();
    let eigen = (&coupling * coupling.transpose()).symmetric_eigen();
    let mut drag = DMatrix::zeros(coupling.ncols(), coupling.ncols());
    for (n, value) in eigen.eigenvalues.iter().enumerate() {
        if *value > 1e-9 {
            // the mode is normalised so that its kinetic energy u_n^T u_n is 1
            let u = coupling.tr_mul(&eigen.eigenvectors.column(n)) / value.sqrt();
            drag += &u * u.transpose() / value.sqrt();
        }
    }
    drag
}

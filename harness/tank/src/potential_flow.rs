//! The m = 1 sloshing problem of linear potential flow, by a boundary integral equation.
//!
//! For a harmonic function u(r, z) cos(theta) with normal derivative q (out of the liquid),
//! Green's third identity on the boundary of the liquid reads, with the ring potential g,
//!
//!   u(x)/2 + int dg/dn(x, y) u(y) r ds = int g(x, y) q(y) r ds.
//!
//! Modes: q = 0 on the wall W, q = lambda u on the free surface F. So with
//! T = [(1/2 + D)^-1 S] restricted to F, T q = q/lambda: the largest eigenvalues of T. T is
//! self-adjoint under the weight r ds. The pitch function psi has q = z n_r - r n_z everywhere
//! (on F, n_z = 1 and n_r = 0: q = -r).
//!
//! Nystrom's method on graded panels with Gauss points; the integrals over a panel close to x
//! by bisection in the panel's own coordinate v until x is far from every part, the own panel
//! by rules that absorb the logarithm.

use nalgebra::DMatrix;

use crate::curve::{Point, Segment, norm, sub};
use crate::gauss::{Gauss, legendre, legendre_slopes};
use crate::panel::{Boundary, BoundaryPoint, Panel};
use crate::ring::potential;

/// A boundary cut into panels with `order` Gauss points each.
#[derive(Debug)]
pub(crate) struct Discretisation {
    boundary: Boundary,
    panels: Vec<Panel>,
    order: usize,
    rule: Gauss,
    points: Vec<BoundaryPoint>,
    /// Index of the first point on the free surface.
    surface: usize,
    /// Projects values at the points of a panel on Legendre polynomials: [k * order + j].
    projection: Vec<f64>,
}

/// Solutions on the boundary's points.
#[derive(Debug)]
pub(crate) struct Solution {
    /// lambda_n, 1/m, ascending.
    pub(crate) lambda: Vec<f64>,
    /// phi_n at all points, sum over F of phi_n^2 r ds = 1.
    pub(crate) phi: Vec<Vec<f64>>,
    /// psi at all points.
    pub(crate) psi: Vec<f64>,
}

/// A part [v0, v1] of a panel with points to integrate over it.
struct Part {
    v0: f64,
    v1: f64,
    points: Vec<BoundaryPoint>,
    weights: Vec<f64>,
    /// Legendre polynomials of the panel at the points, one after the other.
    values: Vec<f64>,
    halves: Option<[usize; 2]>,
}

/// Points of the rule on a part of a panel.
const PART: usize = 16;
/// x is far from a part if it is outside the Bernstein ellipse of this sum of semi-axes.
const FAR: f64 = 2.3;
/// The same for a whole panel, whose own points are used then.
const FAR_WHOLE: f64 = 3.0;
/// Iterations for the eigenvectors: the slowest part falls by about a third in each.
const ITERATIONS: usize = 30;
/// Points of the rule on each side of a point of the own panel, and the power that it absorbs the
/// logarithm with.
const OWN: usize = 20;
const OWN_POWER: i32 = 5;
/// Longest interval of v for that rule: the density is a polynomial of degree order - 1.
const OWN_LENGTH: f64 = 0.2;

impl Discretisation {
    /// For `modes` modes of the liquid above a wall, given from the axis or the inner contact line to
    /// the outer one; on more and shorter panels if `fine`.
    pub(crate) fn new(wall: &[Segment], modes: usize, order: usize, fine: bool) -> Discretisation {
        let boundary = Boundary::new(wall);
        let panels = boundary.panels(modes, fine);
        Discretisation::on_panels(boundary, panels, order)
    }

    /// The same panels with another number of points.
    pub(crate) fn with_order(&self, order: usize) -> Discretisation {
        Discretisation::on_panels(self.boundary.clone(), self.panels.clone(), order)
    }

    pub(crate) fn panel_count(&self) -> usize {
        self.panels.len()
    }

    fn on_panels(boundary: Boundary, panels: Vec<Panel>, order: usize) -> Discretisation {
        let rule = Gauss::new(order);
        let mut points = Vec::with_capacity(panels.len() * order);
        for panel in &panels {
            points.extend(rule.nodes.iter().map(|&v| boundary.point(panel, v)));
        }
        let on_wall = panels.iter().filter(|p| p.segment != boundary.surface).count();
        let mut projection = vec![0.0; order * order];
        let mut values = vec![0.0; order];
        for j in 0..order {
            legendre(rule.nodes[j], &mut values);
            for k in 0..order {
                projection[k * order + j] = (2 * k + 1) as f64 * rule.weights[j] * values[k];
            }
        }
        Discretisation {
            boundary,
            panels,
            order,
            rule,
            points,
            surface: on_wall * order,
            projection,
        }
    }

    /// Number of unknowns.
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// Weight r ds of every point.
    pub(crate) fn weights(&self) -> Vec<f64> {
        let weight =
            |(i, x): (usize, &BoundaryPoint)| x.p[0] * x.speed * self.rule.weights[i % self.order];
        self.points.iter().enumerate().map(weight).collect()
    }

    /// Radii of the points.
    pub(crate) fn radii(&self) -> Vec<f64> {
        self.points.iter().map(|x| x.p[0]).collect()
    }

    /// Normal velocity of the boundary that turns about (0, `z0`), at all points.
    pub(crate) fn pitch(&self, z0: f64) -> Vec<f64> {
        self.points.iter().map(|x| (x.p[1] - z0) * x.n[0] - x.p[0] * x.n[1]).collect()
    }

    /// Range of the points on the free surface.
    pub(crate) fn on_surface(&self) -> core::ops::Range<usize> {
        self.surface..self.points.len()
    }

    /// The first `modes` modes, and psi of the normal velocity `pitch`. None if the matrix cannot be
    /// solved: for m = 1 the operator is regular, so only if the panels are useless.
    pub(crate) fn solve(&self, modes: usize, pitch: &[f64]) -> Option<Solution> {
        let count = self.len();
        let surface = self.on_surface();
        let (matrix, right) = self.assemble(pitch);
        let solved = matrix.lu().solve(&right)?;
        if !solved.iter().all(|x| x.is_finite()) {
            return None;
        }
        let size = surface.len();
        let psi = (0..count).map(|i| solved[(i, size)]).collect();
        if size == 0 {
            return Some(Solution { lambda: Vec::new(), phi: Vec::new(), psi });
        }
        // Subspace iteration; T is self-adjoint under the weight r ds, so its projection on an
        // orthonormal basis is symmetric but for the discretisation's error. (Symmetrising T
        // itself would divide the error by the tiny weights next to the contact line.)
        let weights = self.weights();
        let t = solved.view((surface.start, 0), (size, size));
        let radius = self.points[surface.clone()].iter().map(|x| x.p[0]).fold(0.0, f64::max);
        let trial = (modes + 8).min(size);
        let mut basis = DMatrix::from_fn(size, trial, |i, j| {
            ((j as f64 + 0.5) * core::f64::consts::PI * self.points[surface.start + i].p[0]
                / radius)
                .sin()
        });
        for _ in 0..ITERATIONS {
            orthonormalise(&mut basis, &weights[surface.clone()]);
            basis = t * basis;
        }
        orthonormalise(&mut basis, &weights[surface.clone()]);
        let mut weighted = basis.clone();
        for (mut row, w) in weighted.row_iter_mut().zip(&weights[surface.clone()]) {
            row *= *w;
        }
        let projected = weighted.transpose() * (t * &basis);
        let eigen = (0.5 * (&projected + projected.transpose())).symmetric_eigen();
        let mut by_size: Vec<usize> = (0..trial).collect();
        by_size.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let modes = modes.min(trial);
        let mut lambda = Vec::with_capacity(modes);
        let mut phi = Vec::with_capacity(modes);
        for &k in &by_size[..modes] {
            let value = 1.0 / eigen.eigenvalues[k];
            let q = &basis * eigen.eigenvectors.column(k);
            lambda.push(value);
            phi.push((value * (solved.columns(0, size) * q)).as_slice().to_vec());
        }
        Some(Solution { lambda, phi, psi })
    }

    /// 1/2 + D, and S for sources at each point of F and for `q` on the whole boundary.
    fn assemble(&self, q: &[f64]) -> (DMatrix<f64>, DMatrix<f64>) {
        let (count, order) = (self.len(), self.order);
        let own = self.own_rules();
        let part_rule = Gauss::new(PART);
        let mut matrix = DMatrix::zeros(count, count);
        let size = count - self.surface;
        let mut right = DMatrix::zeros(count, size + 1);
        let mut d = vec![0.0; order];
        let mut s = vec![0.0; order];
        let mut moments_d = vec![0.0; order];
        let mut moments_s = vec![0.0; order];
        for (index, panel) in self.panels.iter().enumerate() {
            let first = index * order;
            let mut parts = vec![self.part(&part_rule, panel, 0.0, 1.0)];
            let ends = [self.boundary.point(panel, 1e-300), self.boundary.point(panel, 1.0)];
            let length = norm(self.boundary.difference(&ends[0], &ends[1]));
            for (i, x) in self.points.iter().enumerate() {
                let close = if i / order == index {
                    None
                } else {
                    Some(self.preimages(panel, &ends, length, x))
                };
                if let Some([None, None]) = close {
                    for j in 0..order {
                        let y = &self.points[first + j];
                        let (g, dg) =
                            potential(x.p[0], y.p[0], self.boundary.difference(x, y), y.n);
                        let weight = y.p[0] * y.speed * self.rule.weights[j];
                        d[j] = dg * weight;
                        s[j] = g * weight;
                    }
                } else {
                    moments_d.fill(0.0);
                    moments_s.fill(0.0);
                    let mut add = |y: &BoundaryPoint, weight: f64, values: &[f64]| {
                        let difference = self.boundary.difference(x, y);
                        if difference == [0.0, 0.0] {
                            return;
                        }
                        let (g, dg) = potential(x.p[0], y.p[0], difference, y.n);
                        let weight = weight * y.p[0] * y.speed;
                        for k in 0..order {
                            moments_d[k] += dg * weight * values[k];
                            moments_s[k] += g * weight * values[k];
                        }
                    };
                    if let Some(close) = close {
                        let mut stack = vec![0];
                        while let Some(k) = stack.pop() {
                            let (v0, v1) = (parts[k].v0, parts[k].v1);
                            let far = close.iter().flatten().all(|c| bernstein(*c, v0, v1) > FAR);
                            if far || v1 - v0 < 1e-7 {
                                let part = &parts[k];
                                for (j, y) in part.points.iter().enumerate() {
                                    add(
                                        y,
                                        part.weights[j],
                                        &part.values[j * order..(j + 1) * order],
                                    );
                                }
                                continue;
                            }
                            if parts[k].halves.is_none() {
                                let middle = 0.5 * (v0 + v1);
                                parts.push(self.part(&part_rule, panel, v0, middle));
                                parts.push(self.part(&part_rule, panel, middle, v1));
                                parts[k].halves = Some([parts.len() - 2, parts.len() - 1]);
                            }
                            stack.extend(parts[k].halves.unwrap());
                        }
                    } else {
                        let rule = &own[i - first];
                        for (j, &(v, weight)) in rule.points.iter().enumerate() {
                            add(
                                &self.boundary.point(panel, v),
                                weight,
                                &rule.values[j * order..(j + 1) * order],
                            );
                        }
                    }
                    d.fill(0.0);
                    s.fill(0.0);
                    for k in 0..order {
                        let row = &self.projection[k * order..(k + 1) * order];
                        for j in 0..order {
                            d[j] += moments_d[k] * row[j];
                            s[j] += moments_s[k] * row[j];
                        }
                    }
                }
                for j in 0..order {
                    matrix[(i, first + j)] = d[j];
                    right[(i, size)] += s[j] * q[first + j];
                    if first >= self.surface {
                        right[(i, first + j - self.surface)] = s[j];
                    }
                }
            }
        }
        for i in 0..count {
            matrix[(i, i)] += 0.5;
        }
        (matrix, right)
    }

    fn part(&self, rule: &Gauss, panel: &Panel, v0: f64, v1: f64) -> Part {
        let mut values = vec![0.0; PART * self.order];
        let mut points = Vec::with_capacity(PART);
        let mut weights = Vec::with_capacity(PART);
        for (j, chunk) in values.chunks_mut(self.order).enumerate() {
            let v = v0 + (v1 - v0) * rule.nodes[j];
            legendre(v, chunk);
            points.push(self.boundary.point(panel, v));
            weights.push((v1 - v0) * rule.weights[j]);
        }
        Part { v0, v1, points, weights, values, halves: None }
    }

    /// Where in the complex plane of a panel's v the point x is, and its mirror image behind the
    /// axis: the kernels are singular at both. None if far from the panel.
    fn preimages(
        &self,
        panel: &Panel,
        ends: &[BoundaryPoint; 2],
        length: f64,
        x: &BoundaryPoint,
    ) -> [Option<[f64; 2]>; 2] {
        let reach = if panel.gamma > 1.0 { 8.0 } else { 2.0 } * length;
        let find = |w: Point| {
            if norm(w) > reach {
                return None;
            }
            // s + i d: the foot of x on the panel's curve, and its distance, over the length
            let [re, im] = self.boundary.foot(panel, w);
            let v = if panel.gamma > 1.0 {
                let size = re.hypot(im).powf(1.0 / panel.gamma);
                let angle = im.atan2(re) / panel.gamma;
                [size * angle.cos(), size * angle.sin()]
            } else {
                [re, im]
            };
            (bernstein(v, 0.0, 1.0) < FAR_WHOLE).then_some(v)
        };
        let start = ends[0].p;
        [find(self.boundary.difference(&ends[0], x)), find(sub([-x.p[0], x.p[1]], start))]
    }

    /// Rules over the own panel for each of its points.
    fn own_rules(&self) -> Vec<OwnRule> {
        let (side, rest) = (Gauss::new(OWN), Gauss::new(PART));
        let mut rules = Vec::with_capacity(self.order);
        for &x in &self.rule.nodes {
            let mut points = Vec::new();
            // [v0, v1] with x outside, or at one end
            let mut stack = vec![(0.0, x), (x, 1.0)];
            while let Some((v0, v1)) = stack.pop() {
                let length: f64 = v1 - v0;
                if v0 == x || v1 == x {
                    let cut = (2.0 * x).min(OWN_LENGTH);
                    if length > 1.01 * cut {
                        let middle = if v0 == x { v0 + cut } else { v1 - cut };
                        stack.extend([(v0, middle), (middle, v1)]);
                        continue;
                    }
                    for (y, w) in side.nodes.iter().zip(&side.weights) {
                        let step = length * y.powi(OWN_POWER);
                        let v = if v0 == x { x + step } else { x - step };
                        points.push((v, w * length * OWN_POWER as f64 * y.powi(OWN_POWER - 1)));
                    }
                } else if bernstein([x, 0.0], v0, v1) < FAR {
                    let middle = 0.5 * (v0 + v1);
                    stack.extend([(v0, middle), (middle, v1)]);
                } else {
                    let pairs = rest.nodes.iter().zip(&rest.weights);
                    points.extend(pairs.map(|(y, w)| (v0 + length * y, w * length)));
                }
            }
            let mut values = vec![0.0; points.len() * self.order];
            for ((v, _), chunk) in points.iter().zip(values.chunks_mut(self.order)) {
                legendre(*v, chunk);
            }
            rules.push(OwnRule { points, values });
        }
        rules
    }

    /// Value of a function given at all points, at `v` of a panel.
    pub(crate) fn interpolate(&self, u: &[f64], panel: usize, v: f64) -> f64 {
        let mut values = vec![0.0; self.order];
        legendre(v, &mut values);
        self.expand(u, panel, &values)
    }

    fn expand(&self, u: &[f64], panel: usize, basis: &[f64]) -> f64 {
        let own = &u[panel * self.order..(panel + 1) * self.order];
        let coefficient = |k: usize| -> f64 {
            let row = &self.projection[k * self.order..(k + 1) * self.order];
            row.iter().zip(own).map(|(a, b)| a * b).sum()
        };
        basis.iter().enumerate().map(|(k, value)| value * coefficient(k)).sum()
    }

    /// int [u_s^2 + u^2/r^2] r ds over the free surface or the wall, u given at all points. Next to a corner u_s goes as
    /// rho^(nu - 1), and dividing du/dv by ds/dv loses all digits; the integral over the last 1e-6
    /// of the panel follows from the exponent (1 where nu > 1: u_s has a limit there).
    pub(crate) fn gradient(&self, u: &[f64], on_surface: bool) -> f64 {
        let rule = Gauss::new(24);
        let mut slopes = vec![0.0; self.order];
        let mut total = 0.0;
        let first = self.surface / self.order;
        let range = if on_surface { first..self.panels.len() } else { 0..first };
        for index in range {
            let panel = &self.panels[index];
            let v0 = if panel.gamma > 1.0 { 1e-6f64.powf(1.0 / panel.gamma) } else { 0.0 };
            let mut along = |v: f64| {
                legendre_slopes(v, &mut slopes);
                let x = self.boundary.point(panel, v);
                (self.expand(u, index, &slopes) / x.speed, x)
            };
            for (v, w) in rule.nodes.iter().zip(&rule.weights) {
                let (slope, x) = along(v0 + (1.0 - v0) * v);
                total += w * (1.0 - v0) * x.speed * x.p[0] * slope * slope;
            }
            if v0 > 0.0 {
                let (slope, x) = along(v0);
                let rho = x.speed * v0 / panel.gamma;
                total += slope * slope * x.p[0] * rho / (2.0 * panel.nu.min(1.0) - 1.0);
            }
            for j in 0..self.order {
                let (i, w) = (index * self.order + j, self.rule.weights[j]);
                total += w * self.points[i].speed * u[i] * u[i] / self.points[i].p[0];
            }
        }
        total
    }

    /// (r, z, |u_s|) along the wall from the outer contact line, u given at all points. Places next to
    /// corners, where u_s has no limit or no digits, are left out.
    pub(crate) fn along_wall(&self, u: &[f64]) -> Vec<[f64; 3]> {
        let mut slopes = vec![0.0; self.order];
        let mut all = Vec::new();
        for panel_index in (0..self.surface / self.order).rev() {
            let panel = &self.panels[panel_index];
            let mut own: Vec<[f64; 3]> = (0..24)
                .map(|i| (i as f64 + 0.5) / 24.0)
                .filter(|v| panel.gamma == 1.0 || v.powf(panel.gamma) > 1e-6)
                .map(|v| {
                    legendre_slopes(v, &mut slopes);
                    let x = self.boundary.point(panel, v);
                    [x.p[0], x.p[1], (self.expand(u, panel_index, &slopes) / x.speed).abs()]
                })
                .collect();
            if !panel.end {
                own.reverse();
            }
            all.extend(own);
        }
        all
    }

    /// Where on the free surface |u| is largest: (r, u).
    pub(crate) fn surface_peak(&self, u: &[f64]) -> [f64; 2] {
        let step = 1.0 / 16.0;
        let mut best = [0.0; 2];
        for panel in self.surface / self.order..self.panels.len() {
            let value = |v: f64| self.interpolate(u, panel, v.clamp(1e-300, 1.0));
            let better = |a: &f64, b: &f64| value(*a).abs().total_cmp(&value(*b).abs());
            let sample = (0..=16).map(|i| i as f64 * step).max_by(better).unwrap_or(0.0);
            // golden section between the neighbouring samples
            let (mut a, mut b) = ((sample - step).max(0.0), (sample + step).min(1.0));
            for _ in 0..36 {
                let (left, right) = (b - 0.618_034 * (b - a), a + 0.618_034 * (b - a));
                if better(&left, &right).is_gt() {
                    b = right;
                } else {
                    a = left;
                }
            }
            let v = [a, b, sample].into_iter().max_by(better).unwrap_or(sample).max(1e-300);
            if value(v).abs() > f64::abs(best[1]) {
                best = [self.boundary.point(&self.panels[panel], v).p[0], value(v)];
            }
        }
        best
    }

    /// A function given at all points, along the free surface: (r, value), from the outer contact
    /// line to the axis or inner contact line, both ends included; `dense` intervals per panel.
    pub(crate) fn along_surface(&self, u: &[f64], dense: usize) -> Vec<[f64; 2]> {
        let first = self.surface / self.order;
        let mut all = Vec::new();
        for panel in first..self.panels.len() {
            let mut own: Vec<[f64; 2]> = (0..=dense)
                .map(|i| {
                    let v = (i as f64 / dense as f64).max(1e-300);
                    let r = self.boundary.point(&self.panels[panel], v).p[0];
                    [r, self.interpolate(u, panel, v)]
                })
                .collect();
            if self.panels[panel].end {
                own.reverse();
            }
            if !all.is_empty() {
                own.remove(0);
            }
            all.extend(own);
        }
        all
    }
}

/// Gram-Schmidt under the given weights, twice.
fn orthonormalise(basis: &mut DMatrix<f64>, weights: &[f64]) {
    let product = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).zip(weights).map(|((a, b), w)| a * b * w).sum()
    };
    for j in 0..basis.ncols() {
        let mut own: Vec<f64> = basis.column(j).iter().copied().collect();
        for _ in 0..2 {
            for k in 0..j {
                let other = basis.column(k);
                let overlap = product(&own, other.as_slice());
                own.iter_mut().zip(&other).for_each(|(a, b)| *a -= overlap * b);
            }
            let size = product(&own, &own).sqrt();
            own.iter_mut().for_each(|a| *a /= size);
        }
        basis.column_mut(j).copy_from_slice(&own);
    }
}

struct OwnRule {
    points: Vec<(f64, f64)>,
    values: Vec<f64>,
}

/// Sum of the semi-axes of the ellipse with foci at the ends of [v0, v1] through a point of the
/// complex plane, over the half length. Gauss with n points converges as its power -2n.
fn bernstein(point: [f64; 2], v0: f64, v1: f64) -> f64 {
    let half = 0.5 * (v1 - v0);
    let x = (point[0] - 0.5 * (v0 + v1)) / half;
    let y = point[1] / half;
    let sum = 0.5 * (((x - 1.0).powi(2) + y * y).sqrt() + ((x + 1.0).powi(2) + y * y).sqrt());
    sum + (sum * sum - 1.0).max(0.0).sqrt()
}

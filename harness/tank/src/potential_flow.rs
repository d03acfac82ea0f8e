//! The m = 1 sloshing problem of linear potential flow, by a boundary integral equation.
//!
//! u(r, z) cos(theta) is a harmonic function with normal derivative q (out of the liquid). Green's
//! third identity on the boundary of the liquid reads, with the ring potential g,
//!
//!   u(x)/2 + int dg/dn(x, y) u(y) r ds = int g(x, y) q(y) r ds.
//!
//! Modes have q = 0 on the wall W and q = lambda u on the free surface F. So with T = [(1/2 + D)^-1 S] restricted to F,
//! T q = q/lambda: the lowest modes belong to the largest eigenvalues of T. T is self-adjoint under the weight r ds.
//! The pitch function psi (tank rotating about y) has q = z n_r - r n_z everywhere (on F, n_z = 1 and n_r = 0: q = -r).
//!
//! The method is Nystrom's on graded panels with Gauss points. For a panel close to x, the panel's coordinate v is bisected
//! until x is far from every part. On the panel that contains x, integration rules are used that absorb the logarithm.

use nalgebra::DMatrix;

use crate::contour::golden;
use crate::curve::{Point, Segment, norm, sub};
use crate::gauss::{Gauss, legendre, legendre_slopes};
use crate::panel::{Boundary, BoundaryPoint, Panel};
use crate::ring::potential;

/// Boundary of the liquid, cut into panels with `order` Gauss points each.
///
/// - `surface`: index of the first point on the free surface.
/// - `projection`: matrix [k * order + j] that turns the values at the points of a panel into
///   coefficients of Legendre polynomials.
#[derive(Debug)]
pub(crate) struct Discretisation {
    boundary: Boundary,
    panels: Vec<Panel>,
    order: usize,
    rule: Gauss,
    points: Vec<BoundaryPoint>,
    surface: usize,
    projection: Vec<f64>,
}

/// Solution at the points of the boundary.
///
/// - `lambda`: eigenvalues omega_n^2/g of the modes, 1/m, ascending.
/// - `phi`: potentials of the modes, normalised to int phi_n^2 r ds = 1 over the free surface.
/// - `psi`: potential of the liquid if the tank rotates about a horizontal axis (pitch).
#[derive(Debug)]
pub(crate) struct Solution {
    pub(crate) lambda: Vec<f64>,
    pub(crate) phi: Vec<Vec<f64>>,
    pub(crate) psi: Vec<f64>,
}

/// The part of a panel over which the panel's coordinate v goes from `v0` to `v1`. `points` and
/// `weights` are its integration points with their weights, and `values` are the panel's Legendre
/// polynomials at these points: first all polynomials at the first point, and so on.
struct Part {
    v0: f64,
    v1: f64,
    points: Vec<BoundaryPoint>,
    weights: Vec<f64>,
    values: Vec<f64>,
    halves: Option<[usize; 2]>,
}

const PART: usize = 16;
/// Smallest sum of semi-axes (see [`bernstein`]) for a point x at which a part of a panel is
/// integrated with Gauss points. If the sum is smaller, the part is bisected.
const FAR: f64 = 2.3;
/// Smallest sum of semi-axes (see [`bernstein`]) for a point x at which a whole panel is integrated
/// with its own points, without bisection.
const FAR_WHOLE: f64 = 3.0;
const ITERATIONS: usize = 30;
/// Number of integration points on each side of a point x that lies on the integrated panel itself,
/// because there the kernel has a logarithmic singularity at x. [`OWN_POWER`] is the power with
/// which the points are concentrated near x, so that the logarithm is integrated exactly.
const OWN: usize = 20;
const OWN_POWER: i32 = 5;
/// Longest interval of the panel's coordinate over which [`OWN`] points integrate. It is limited
/// because the points must also integrate the function on the panel, a polynomial of the degree
/// order - 1.
const OWN_LENGTH: f64 = 0.2;

impl Discretisation {
    /// Discretises the boundary of the liquid for `modes` modes, with `order` Gauss points per
    /// panel. `wall` runs from the axis or the inner contact line to the outer contact line. `fine`
    /// uses more and shorter panels.
    pub(crate) fn new(wall: &[Segment], modes: usize, order: usize, fine: bool) -> Discretisation {
        let boundary = Boundary::new(wall);
        let panels = boundary.panels(modes, fine);
        Discretisation::on_panels(boundary, panels, order)
    }

    pub(crate) fn with_order(&self, order: usize) -> Discretisation {
        Discretisation::on_panels(self.boundary.clone(), self.panels.clone(), order)
    }

    #[cfg(test)]
    pub(crate) fn halve(&self, order: usize) -> Discretisation {
        Discretisation::on_panels(self.boundary.clone(), Boundary::halve(&self.panels), order)
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

    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    pub(crate) fn weights(&self) -> Vec<f64> {
        let weight =
            |(i, x): (usize, &BoundaryPoint)| x.p[0] * x.speed * self.rule.weights[i % self.order];
        self.points.iter().enumerate().map(weight).collect()
    }

    pub(crate) fn radii(&self) -> Vec<f64> {
        self.points.iter().map(|x| x.p[0]).collect()
    }

    /// Returns the normal velocity at all points of the boundary, m/s, if the tank rotates at 1
    /// rad/s about a horizontal axis at the height `z0`, m.
    pub(crate) fn pitch(&self, z0: f64) -> Vec<f64> {
        self.points.iter().map(|x| (x.p[1] - z0) * x.n[0] - x.p[0] * x.n[1]).collect()
    }

    pub(crate) fn surface_range(&self) -> core::ops::Range<usize> {
        self.surface..self.points.len()
    }

    /// Solves for the first `modes` modes, and for the pitch potential with the normal velocity
    /// `pitch` at all points. Returns `None` if the matrix cannot be solved. The operator is
    /// regular, so that this happens only if the panels are unusable.
    pub(crate) fn solve(&self, modes: usize, pitch: &[f64]) -> Option<Solution> {
        let count = self.len();
        let surface = self.surface_range();
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
        // Subspace iteration. T is self-adjoint under the weight r ds, so its projection on an
        // orthonormal basis is symmetric up to the discretisation error. (Symmetrising T itself
        // would divide the error by the small weights near the contact line.)
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

    /// Assembles the matrix 1/2 + D, with the double layer D, and the right-hand sides of the
    /// boundary integral equation. The right-hand sides are the potentials (single layer) of a unit
    /// source at each point of the free surface and, in the last column, of the sources `q` on the
    /// whole boundary.
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

    /// Returns the complex values of a panel's coordinate that the panel maps to the point `x`, and
    /// to the mirror image of `x` behind the axis. The kernels of the integral equation are
    /// singular at these values. A value is `None` if it is far from the panel. `ends` are the ends
    /// of the panel and `length` its length, m.
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
            // s + i d: the foot of x on the panel's curve, and the distance of x from the foot, both divided by the length
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

    fn own_rules(&self) -> Vec<OwnRule> {
        let (side, rest) = (Gauss::new(OWN), Gauss::new(PART));
        let mut rules = Vec::with_capacity(self.order);
        for &x in &self.rule.nodes {
            let mut points = Vec::new();
            // intervals [v0, v1] that have x outside or at one end
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

    /// Returns the integral of the squared surface gradient of the function `u`, int [u_s^2 +
    /// u^2/r^2] r ds, over the free surface if `on_surface` is true and otherwise over the wall.
    /// `u` is given at all points, and u_s is its derivative along the contour. Near a corner u_s
    /// behaves as rho^(nu - 1), and division of du/dv by ds/dv loses all digits. Therefore the
    /// integral over the last 1e-6 of the panel is computed in closed form from this power law,
    /// with a constant u_s if nu > 1.
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

    /// Returns the radius on the free surface at which the magnitude of the function `u` is
    /// largest, and the value of `u` at this radius, with its sign. `u` is given at all points of
    /// the boundary.
    pub(crate) fn surface_peak(&self, u: &[f64]) -> [f64; 2] {
        let step = 1.0 / 16.0;
        let mut best = [0.0; 2];
        for panel in self.surface / self.order..self.panels.len() {
            let value = |v: f64| self.interpolate(u, panel, v.clamp(1e-300, 1.0));
            let better = |a: &f64, b: &f64| value(*a).abs().total_cmp(&value(*b).abs());
            let sample = (0..=16).map(|i| i as f64 * step).max_by(better).unwrap_or(0.0);
            let around = [(sample - step).max(0.0), (sample + step).min(1.0)];
            let [a, b] = golden(around, 36, |left, right| better(&left, &right).is_gt());
            let v = [a, b, sample].into_iter().max_by(better).unwrap_or(sample).max(1e-300);
            if value(v).abs() > f64::abs(best[1]) {
                best = [self.boundary.point(&self.panels[panel], v).p[0], value(v)];
            }
        }
        best
    }

    /// Interpolates the function `u`, which is given at all points, along the free surface. Returns
    /// pairs of radius and value from the outer contact line to the axis or to the inner contact
    /// line, both included, with `dense` intervals per panel.
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

/// Returns the sum of the semi-axes of the Bernstein ellipse through `point`, a point of the
/// complex plane. The ellipse has its foci at v0 and v1, and its size is divided by half of their
/// distance. The error of n Gauss points falls as this sum to the power -2n.
fn bernstein(point: [f64; 2], v0: f64, v1: f64) -> f64 {
    let half = 0.5 * (v1 - v0);
    let x = (point[0] - 0.5 * (v0 + v1)) / half;
    let y = point[1] / half;
    let sum = 0.5 * (((x - 1.0).powi(2) + y * y).sqrt() + ((x + 1.0).powi(2) + y * y).sqrt());
    sum + (sum * sum - 1.0).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::dot;
    use nalgebra::DVector;

    fn walls() -> [Vec<Segment>; 3] {
        [
            vec![Segment::arc([0.0, 0.1], 0.8, -90.0, 20.0)],
            vec![
                Segment::line([0.0, 0.3], [0.4, 0.3]),
                Segment::line([0.4, 0.3], [0.4, 0.0]),
                Segment::line([0.4, 0.0], [0.9, 0.0]),
                Segment::line([0.9, 0.0], [0.9, 0.7]),
            ],
            vec![Segment::arc([1.1, 0.2], 0.5, -200.0, 20.0)],
        ]
    }

    const HARMONIC: [fn(Point) -> (f64, Point); 3] = [
        |[r, _]| (r, [1.0, 0.0]),
        |[r, z]| (r * z, [z, r]),
        |[r, z]| (r * (4.0 * z * z - r * r), [4.0 * z * z - 3.0 * r * r, 8.0 * r * z]),
    ];

    /// Green's third identity holds to the quadrature error of 16 points per panel. One of the
    /// walls has a step with a re-entrant edge, near which r behaves as v^9, so that a cubic in r
    /// is a polynomial of degree 27 in v.
    #[test]
    fn harmonic_functions_satisfy_the_integral_equation() {
        for wall in walls() {
            for fine in [false, true] {
                let mesh = Discretisation::new(&wall, 3, 16, fine);
                for (harmonic, error) in HARMONIC.into_iter().zip([1e-10, 1e-10, 1e-7]) {
                    let values: Vec<_> = mesh.points.iter().map(|x| harmonic(x.p)).collect();
                    let slopes = mesh.points.iter().zip(&values);
                    let q: Vec<f64> = slopes.map(|(x, (_, slope))| dot(*slope, x.n)).collect();
                    let (matrix, right) = mesh.assemble(&q);
                    let u = DVector::from_iterator(values.len(), values.iter().map(|v| v.0));
                    let off = matrix * &u - right.column(right.ncols() - 1);
                    assert!(off.amax() < error, "{:e}", off.amax());
                    // the sources on the free surface are the last of all sources
                    let on_surface = DVector::from_column_slice(&q[mesh.surface_range()]);
                    let mut wall_alone = q.clone();
                    wall_alone[mesh.surface_range()].fill(0.0);
                    let alone = mesh.assemble(&wall_alone).1;
                    let parts = right.columns(0, right.ncols() - 1) * on_surface;
                    let all = parts + alone.column(alone.ncols() - 1);
                    assert!((all - right.column(right.ncols() - 1)).amax() < 1e-14);
                }
            }
        }
    }

    /// r cos theta is a uniform flow, whose int [u_s^2 + u^2/r^2] r ds over the free surface and
    /// the walls is known by hand. At the re-entrant edge of the wall with a step, the closed form
    /// for the last 1e-6 of a panel is 3 times the true integral, because it assumes a flow around
    /// the edge; the tolerance covers this.
    #[test]
    fn the_surface_gradient_of_a_uniform_flow_is_exact() {
        let (sin, cos) = 20f64.to_radians().sin_cos();
        let around = |t: f64| {
            let (sin, cos) = t.to_radians().sin_cos();
            let own = 1.1 * 0.5 * (1.5 * t.to_radians() - 0.5 * sin * cos);
            own + 0.25 * (sin.powi(3) / 3.0 + sin)
        };
        let known = [
            [(0.8 * cos).powi(2), 0.64 * ((sin.powi(3) + 1.0) / 3.0 + sin + 1.0)],
            [0.81, 0.81 + 0.4 * 0.3 + 0.9 * 0.7],
            [(1.1 + 0.5 * cos).powi(2) - (1.1 - 0.5 * cos).powi(2), around(20.0) - around(-200.0)],
        ];
        for (wall, known) in walls().iter().zip(known) {
            let mesh = Discretisation::new(wall, 3, 16, false);
            for (on_surface, known) in [(true, known[0]), (false, known[1])] {
                let found = mesh.gradient(&mesh.radii(), on_surface);
                assert!((found / known - 1.0).abs() < 2e-7, "{on_surface} {found} {known}");
            }
        }
    }

    #[test]
    fn values_along_the_free_surface_are_interpolated_at_points_from_the_wall_to_the_axis() {
        for wall in walls() {
            let mesh = Discretisation::new(&wall, 3, 16, false);
            let u = mesh.radii();
            let surface = mesh.along_surface(&u, 5);
            let (start, end) = (wall[0].start(), wall[wall.len() - 1].end());
            let inner = if wall.len() == 1 && start[0] > 0.0 { start[0] } else { 0.0 };
            assert!((surface[0][0] - end[0]).abs() < 1e-14);
            assert!((surface[surface.len() - 1][0] - inner).abs() < 1e-14);
            assert!(surface.windows(2).all(|pair| pair[1][0] < pair[0][0]));
            assert!(surface.iter().all(|[r, u]| (r - u).abs() < 1e-12));
        }
    }

    /// The wave r (1 − r²/(3 b²)) has its maximum at r = b, which is not a point of the mesh.
    #[test]
    fn the_surface_s_largest_elevation_is_found_between_points() {
        for (wall, b) in walls().iter().zip([0.5, 0.61, 1.2]) {
            let mesh = Discretisation::new(wall, 3, 16, false);
            for sign in [1.0, -1.0] {
                let wave = |r: f64| sign * r * (1.0 - r * r / (3.0 * b * b));
                let u: Vec<f64> = mesh.radii().into_iter().map(wave).collect();
                let [r, value] = mesh.surface_peak(&u);
                // The position of a flat maximum has half as many correct digits as its value.
                assert!(
                    (r - b).abs() < 1e-6 && (value - sign * b / 1.5).abs() < 1e-12,
                    "{r} {value}"
                );
            }
        }
    }

    #[test]
    fn the_bernstein_ellipse_through_a_point_has_its_foci_at_the_ends_of_the_interval() {
        for point in [[2.0 + 1.25, 0.0], [2.0 - 1.25, 0.0], [2.0, 0.75], [2.0, -0.75]] {
            assert!((bernstein(point, 1.0, 3.0) - 2.0).abs() < 1e-15, "{point:?}");
        }
        assert_eq!([bernstein([1.0, 0.0], 1.0, 3.0), bernstein([2.5, 0.0], 1.0, 3.0)], [1.0; 2]);
    }

    /// The test integrates v^k log|v - x| for k = 0 and 1, and polynomials. With 20 points on each
    /// side of x, concentrated by the fifth power, the error of the logarithm is 1e-12.
    #[test]
    fn quadrature_on_a_panel_with_a_logarithmic_singularity_is_exact() {
        let mesh = Discretisation::new(&walls()[0], 3, 12, false);
        let rules = mesh.own_rules();
        assert_eq!(rules.len(), 12);
        for (rule, x) in rules.iter().zip(&mesh.rule.nodes) {
            let sum =
                |f: &dyn Fn(f64) -> f64| rule.points.iter().map(|(v, w)| w * f(*v)).sum::<f64>();
            let part = |y: f64| {
                if y == 0.0 {
                    [0.0; 2]
                } else {
                    let log = y.abs().ln();
                    [y * (log - 1.0), 0.5 * y * y * (log - 0.5)]
                }
            };
            let [b, a] = [part(1.0 - x), part(-x)];
            let known = [b[0] - a[0], b[1] - a[1] + x * (b[0] - a[0])];
            for (k, known) in known.into_iter().enumerate() {
                let found = sum(&|v| v.powi(k as i32) * (v - x).abs().ln());
                assert!((found - known).abs() < 5e-12, "{x} {k}: {found} {known}");
                assert!((sum(&|v| v.powi(7 * k as i32)) - 1.0 / (1 + 7 * k) as f64).abs() < 1e-14);
            }
            let mut values = vec![0.0; 12];
            for ((v, _), own) in rule.points.iter().zip(rule.values.chunks(12)) {
                legendre(*v, &mut values);
                assert_eq!(own, values);
            }
        }
    }

    /// The preimage v of a point, or of its mirror image behind the axis, obeys v^gamma = s + i d
    /// with the exponent gamma of the panel. Here s is the nearest place on the panel, and d the
    /// distance from it, both as [`Boundary::foot`] returns them. The tested points are too close
    /// to the panel for integration with the panel's own points.
    #[test]
    fn the_preimage_of_a_point_under_a_panel_s_map_is_found() {
        let (mut graded, mut plain, mut far) = (0, 0, 0);
        for wall in walls() {
            let mesh = Discretisation::new(&wall, 3, 8, false);
            for panel in &mesh.panels {
                let ends = [1e-300, 1.0].map(|v| mesh.boundary.point(panel, v));
                let length = norm(mesh.boundary.difference(&ends[0], &ends[1]));
                for x in &mesh.points {
                    let image = sub([-x.p[0], x.p[1]], ends[0].p);
                    let places = [mesh.boundary.difference(&ends[0], x), image];
                    let found = mesh.preimages(panel, &ends, length, x);
                    for (found, w) in found.into_iter().zip(places) {
                        let Some(v) = found else {
                            far += 1;
                            // no panel that touches the point is left out
                            assert!(norm(w) > 0.1 * length, "{panel:?} {w:?}");
                            continue;
                        };
                        let (size, angle) = (v[0].hypot(v[1]), v[1].atan2(v[0]));
                        let (size, angle) = (size.powf(panel.gamma), panel.gamma * angle);
                        let foot = mesh.boundary.foot(panel, w);
                        let off = [size * angle.cos() - foot[0], size * angle.sin() - foot[1]];
                        assert!(norm(off) < 1e-12 * (1.0 + norm(foot)), "{panel:?}: {off:?}");
                        assert!(bernstein(v, 0.0, 1.0) < FAR_WHOLE);
                        *(if panel.gamma > 1.0 { &mut graded } else { &mut plain }) += 1;
                    }
                }
            }
        }
        assert!(graded > 100 && plain > 100 && far > 1000, "{graded} {plain} {far}");
    }
}

//! Slosh model `spherical`: a spherical (conical) pendulum in stereographic coordinates. The slosh mass's direction from the
//! hinge, a unit vector in the hub's frame, is
//!
//! ```text
//! p = (k xi_1, k xi_2, 1 - k),   k = 2/(1 + |xi|^2),   q = xi
//! ```
//!
//! At rest xi = 0; only the direction straight up is singular. The motion is expanded in p and in v, the slosh mass's
//! velocity relative to the hinge divided by l, both relative to inertial axes. In these variables Newton's law has few
//! products and no quotient. R rotates the horizontal part by a quarter turn, (a, b) -> (-b, a); e_x points outwards, e_y
//! along +theta, and e_z up:
//! ```text
//! p' = v - w R p
//! v' = -w R v - L p + (r/l) (w^2 e_x - w' e_y) - (g/l) e_z - (c/m) p'
//! ```
//!
//! m l L is the tension of the rod. It keeps v.p = 0, so
//!
//! ```text
//! L = L_0 - (r/l) w' p_y,   L_0 = |v|^2 - (g/l) p_z + (r/l) w^2 p_x
//! ```
//!
//! The rod pulls at the hinge, and the drag c l p' acts on the tank at the slosh mass, so
//!
//! ```text
//! J = m r^2 p_y^2     (beyond the hub's I0)
//! T = m r l p_y L_0 + c l [ r p_y' + l (p_x p_y' - p_y p_x') ]
//! E = m |l v + r w e_y|^2/2 + m g l (1 + p_z),  dissipated power c l^2 |p'|^2
//! H = m [ (r + l p_x) (l v_y + r w) - l p_y l v_x ]
//! ```
//!
//! tests/plant/rotary.rs checks these equations against another formulation of the hub's acceleration. They were also
//! checked against Lagrange's equations for xi (below) and against a pendulum in angles (Basilisk).

use alloc::format;
use alloc::string::String;
use taylor::angle::{self, SquaredAngle};
use taylor::number::Number;
use taylor::plane::{
    self, Vector2, ZERO_VECTOR2, component_products, dot, mul_part, mul_part_head, numbers, scale,
    scale_head, squares,
};
use taylor::series::{Series, ZERO, constant, mul, mul_tail, next, number, square, values};

use super::{Angles, HubReaction, SloshMode, own_pendulum};
use crate::hub::HubMotion;
use crate::parameters::Init;
use crate::pendulum::Pendulum;

#[derive(Clone, Debug)]
pub struct Spherical {
    p: Pendulum,
    xi: Vector2,
    xi_d: Vector2,
    sum: Series,
    k: Series,
    rho: Series,
    k_rho: Series,
    dir: Vector2,
    dir_z: Series,
    dir_d: Vector2,
    /// Horizontal components of the drag's power series: the drag coefficient, divided by its value at the start of the
    /// series, times the rate of the unit vector from the hinge to the slosh mass. The tangential component comes first and
    /// the radial one second, so that products with a direction, component by component, give the terms of a cross product.
    /// `drag_z` is the upward component.
    drag_swapped: Vector2,
    drag_z: Series,
    v: Vector2,
    v_z: Series,
    v_d: Vector2,
    v_z_d: Series,
    v_z2: Series,
    angle2: SquaredAngle,
    tension_0: Series,
    tension: Series,
    pulled: [f64; 2],
}

impl Spherical {
    /// Computes Taylor coefficient n of the slosh mass's direction p, a unit vector from the hinge, and of its velocity v
    /// from coefficient n of the stereographic coordinates xi and their rates. With k = 2/(1 + |xi|^2) the relations are p'
    /// = k xi' - v_z xi and v_z = k^2 xi.xi'.
    #[inline(always)]
    fn place(&mut self, n: usize, hub: &HubMotion) {
        let one = constant(n, 1.0);
        let [x2, y2] = squares(n, &self.xi);
        self.sum[n] = one + x2 + y2;
        self.k[n] = (2.0 * one - mul_tail(n, &self.sum, &self.k)) / self.sum[0];
        self.dir[n] = scale(n, &self.k, &self.xi);
        self.dir_z[n] = one - self.k[n];
        self.rho[n] = dot(n, &self.xi, &self.xi_d);
        self.k_rho[n] = mul(n, &self.k, &self.rho);
        self.v_z[n] = mul(n, &self.k, &self.k_rho);
        let (along, back) = (scale(n, &self.k, &self.xi_d), scale(n, &self.v_z, &self.xi));
        let turned = scale(n, &hub.omega, &self.dir);
        self.v[n] = [along[0] - back[0] - turned[1], along[1] - back[1] + turned[0]];
    }

    /// Returns Taylor coefficient n of k xi'', where xi are the stereographic coordinates and k = 2/(1 + |xi|^2). It is
    /// computed as p'' + 2 v_z xi' + v_z' xi with p'' = v' - w' R p - w R p', from the direction p and the velocity v of the
    /// slosh mass and the rate w of the hub; R rotates a vector by a quarter turn.
    fn k_xi_dd(&self, n: usize, hub: &HubMotion) -> [f64; 2] {
        let [x, y] = scale(n, &hub.omega_dot, &self.dir);
        let [x_d, y_d] = scale(n, &hub.omega, &self.dir_d);
        let dir_dd = [self.v_d[n][0] + y + y_d, self.v_d[n][1] - x - x_d];
        let twice = scale(n, &self.v_z, &self.xi_d);
        let once = scale(n, &self.v_z_d, &self.xi);
        [0, 1].map(|i| dir_dd[i] + 2.0 * twice[i] + once[i])
    }

    fn drag_power(&self, n: usize) -> f64 {
        let horizontal = |i: usize| {
            (0..=n).map(|j| self.dir_d[j][i] * self.drag_swapped[n - j][1 - i]).sum::<f64>()
        };
        horizontal(0) + horizontal(1) + mul(n, &self.v_z, &self.drag_z)
    }

    fn bob<T: Number>(&self) -> [T; 2] {
        let Pendulum { l, r, .. } = self.p;
        let [x, y]: [T; 2] = numbers(&self.dir);
        [T::constant(r) + x * l, y * l]
    }

    fn velocity<T: Number>(&self, hub: &HubMotion) -> [T; 3] {
        let Pendulum { l, r, .. } = self.p;
        let [v_x, v_y]: [T; 2] = numbers(&self.v);
        [v_x * l, v_y * l + number::<T>(&hub.omega) * r, number::<T>(&self.v_z) * l]
    }

    fn above_rest<T: Number>(&self) -> T {
        let [xi_1, xi_2]: [T; 2] = numbers(&self.xi);
        number::<T>(&self.k) * (xi_1 * xi_1 + xi_2 * xi_2)
    }
}

impl SloshMode for Spherical {
    const UNROLLED: bool = true;
    // The value of J at the start of the expansion is used throughout, because T includes the effect of its change.
    const MOVES_INERTIA: bool = false;

    fn new(p: &Pendulum) -> Self {
        Spherical {
            p: *p,
            xi: ZERO_VECTOR2,
            xi_d: ZERO_VECTOR2,
            sum: ZERO,
            k: ZERO,
            rho: ZERO,
            k_rho: ZERO,
            dir: ZERO_VECTOR2,
            dir_z: ZERO,
            dir_d: ZERO_VECTOR2,
            drag_swapped: ZERO_VECTOR2,
            drag_z: ZERO,
            v: ZERO_VECTOR2,
            v_z: ZERO,
            v_d: ZERO_VECTOR2,
            v_z_d: ZERO,
            v_z2: ZERO,
            angle2: SquaredAngle::default(),
            tension_0: ZERO,
            tension: ZERO,
            pulled: [0.0; 2],
        }
    }

    own_pendulum!();

    fn amplitude2<T: Number>(&self) -> [T; 2] {
        let [x_d, y_d] = numbers::<T>(&self.xi_d).map(|rate| number::<T>(&self.k) * rate);
        [angle::squared(self.above_rest::<T>() * 2.0), x_d * x_d + y_d * y_d]
    }

    fn start_problem(&self, init: &Init) -> Option<String> {
        let sines = [init.slosh_angle_radial, init.slosh_angle].map(libm::sin);
        let sum = sines[0] * sines[0] + sines[1] * sines[1];
        (sum > 0.9999).then(|| {
            format!(
                "init.slosh_angle = {} and init.slosh_angle_radial = {} put the slosh mass at or above \
                 the horizontal: sin^2 + sin^2 = {sum:.6} must be below 1",
                init.slosh_angle, init.slosh_angle_radial
            )
        })
    }

    /// Computes the coordinates from the slosh angles, whose sines are the horizontal components of the slosh mass's
    /// direction. The slosh mass is below its hinge.
    fn coordinates(&self, at: &Angles) -> [f64; 4] {
        let [p_x, p_y] = at.angle.map(libm::sin);
        let [v_x, v_y] = [0, 1].map(|i| libm::cos(at.angle[i]) * at.rate[i]);
        let p_z = -libm::sqrt(1.0 - p_x * p_x - p_y * p_y);
        let v_z = -(p_x * v_x + p_y * v_y) / p_z;
        let (x, y) = (p_x / (1.0 - p_z), p_y / (1.0 - p_z));
        [x, y, (v_x + x * v_z) / (1.0 - p_z), (v_y + y * v_z) / (1.0 - p_z)]
    }

    fn angles<T: Number>(&self) -> Angles<T> {
        let p = numbers::<T>(&self.dir).map(|p| p.clamp(-1.0, 1.0));
        let (d, one) = (numbers::<T>(&self.dir_d), T::constant(1.0));
        let rate = |i: usize| {
            let cos = ((one - p[i]) * (one + p[i])).sqrt();
            d[i].over_or_zero(cos)
        };
        Angles { angle: p.map(T::asin), rate: [rate(0), rate(1)] }
    }

    fn start(&mut self, q: &[f64; 4], hub: &HubMotion) {
        (self.xi[0], self.xi_d[0]) = ([q[0], q[1]], [q[2], q[3]]);
        self.place(0, hub);
    }

    fn seed_direction(&mut self, dq: &[f64; 4], hub: &HubMotion) {
        (self.xi[1], self.xi_d[1]) = ([dq[0], dq[1]], [dq[2], dq[3]]);
        self.place(1, hub);
    }

    fn derivatives(&self, n: usize, hub: &HubMotion) -> [f64; 4] {
        let at_once = self.k_xi_dd(0, hub).map(|a| a / self.k[0]);
        let [x_dd, y_dd] = if n == 0 {
            at_once
        } else {
            let k_xi_dd = self.k_xi_dd(n, hub);
            [0, 1].map(|i| (k_xi_dd[i] - self.k[n] * at_once[i]) / self.k[0])
        };
        let [x_d, y_d] = self.xi_d[n];
        [x_d, y_d, x_dd, y_dd]
    }

    #[inline(always)]
    fn hub_reaction(&mut self, n: usize, ramp: bool, hub: &HubMotion) -> HubReaction {
        let Pendulum { m, l, c, r, r_l, inv_l, .. } = self.p;
        let [w_x, w_y] = scale(n, &hub.omega, &self.dir);
        let (x_d, y_d) = (self.v[n][0] + w_y, self.v[n][1] - w_x);
        self.dir_d[n] = [x_d, y_d];
        self.v_z2[n] = square(n, &self.v_z);
        if ramp && self.p.follows_amplitude() {
            let [x2_d, y2_d] = squares(n, &self.dir_d);
            let chord2 = 2.0 * if n == 0 { self.above_rest() } else { self.dir_z[n] };
            let at = [self.angle2.expand(n, chord2), x2_d + y2_d + self.v_z2[n]];
            self.p.expand_drag(n, at);
        }
        let [drag_x, drag_y] =
            if ramp { scale(n, &self.p.course, &self.dir_d) } else { [x_d, y_d] };
        self.drag_swapped[n] = [drag_y, drag_x];
        self.drag_z[n] = self.p.drag(n, ramp, &self.v_z);
        let [v2_x, v2_y] = squares(n, &self.v);
        self.tension_0[n] = v2_x + v2_y + self.v_z2[n]
            - inv_l * self.p.weight(n, ramp, &self.dir_z)
            + r_l * mul_part(n, &hub.omega2, &self.dir, 0);
        if ramp {
            let [e_x, e_y] = &hub.tilt.e;
            self.tension_0[n] +=
                inv_l * (mul_part(n, e_x, &self.dir, 0) + mul_part(n, e_y, &self.dir, 1));
        }
        let [plus, minus] = component_products(n, &self.dir, &self.drag_swapped);
        // L and L p without the terms that contain coefficient n of w', because J represents these terms.
        let y_0 = self.dir[0][1];
        self.tension[n] = self.tension_0[n] - r_l * mul_part_head(n, &hub.omega_dot, &self.dir, 1);
        self.pulled = scale_head(n, &self.tension, &self.dir);
        HubReaction {
            j: if n == 0 { m * r * r * y_0 * y_0 } else { 0.0 },
            t: m * r * l * (self.pulled[1] + self.tension[n] * y_0)
                + c * l * (r * drag_y + l * (plus - minus)),
        }
    }

    #[inline(always)]
    fn accelerate(&mut self, n: usize, ramp: bool, hub: &HubMotion) {
        let Pendulum { c_m, r_l, inv_l, .. } = self.p;
        let [x_0, y_0] = self.dir[0];
        self.tension[n] -= r_l * hub.omega_dot[n] * y_0;
        let [w_x, w_y] = scale(n, &hub.omega, &self.v);
        let pulled =
            [self.pulled[0] + self.tension[n] * x_0, self.pulled[1] + self.tension[n] * y_0];
        let [drag_y, drag_x] = self.drag_swapped[n];
        let fall = inv_l * if n < 2 { self.p.g[n] } else { 0.0 };
        self.v_d[n] = [
            w_y - pulled[0] - c_m * drag_x + r_l * hub.omega2[n],
            -w_x - pulled[1] - c_m * drag_y - r_l * hub.omega_dot[n],
        ];
        if ramp {
            for i in 0..2 {
                self.v_d[n][i] += inv_l * hub.tilt.e[i][n];
            }
        }
        self.v_z_d[n] = -mul(n, &self.tension, &self.dir_z) - fall - c_m * self.drag_z[n];
        self.dir[n + 1] = self.dir_d[n].map(|rate| next(n, rate));
        self.dir_z[n + 1] = next(n, self.v_z[n]);
        self.v[n + 1] = self.v_d[n].map(|rate| next(n, rate));
        self.v_z[n + 1] = next(n, self.v_z_d[n]);
    }

    #[inline(always)]
    fn error_scale(&self) -> f64 {
        largest(self.dir_d[0]) + self.p.omega_n * largest(self.dir[0])
    }

    #[inline(always)]
    fn coefficient_norm(&self, n: usize) -> f64 {
        largest(self.v[n]).max(self.v_z[n].abs())
    }

    #[inline(always)]
    fn dissipation(&mut self, n: usize, ramp: bool) -> f64 {
        let speed2 = if ramp {
            self.drag_power(n)
        } else {
            let [x, y] = squares(n, &self.dir_d);
            x + y + self.v_z2[n]
        };
        self.p.c * self.p.l * self.p.l * speed2
    }

    /// Returns Taylor coefficient n of the slosh mass times its height above rest, m l (1 + p_z), kg m, where p_z is the
    /// upward component of its direction. The term 1 + p_z is computed as |xi|^2 k from the coordinates xi, because this form
    /// has no cancellation near rest.
    #[inline(always)]
    fn mass_height(&mut self, n: usize, hub: &HubMotion) -> f64 {
        let [xi_1, xi_2] = self.xi[0];
        let Pendulum { m, l, r, .. } = self.p;
        let place = |j: usize| [constant(j, r) + l * self.dir[j][0], l * self.dir[j][1]];
        let height = if n == 0 { self.k[0] * (xi_1 * xi_1 + xi_2 * xi_2) } else { self.dir_z[n] };
        m * l * height + m * hub.tilt.height(n, place)
    }

    /// Computes the stereographic coordinates xi and their rates from the direction p of the slosh mass, a unit vector, and
    /// its velocity v: xi = p/k and k xi' = p' + v_z xi with k = 1 - p_z. If the slosh mass is above its hinge, this
    /// difference would lose digits, and k is computed from |p| = 1 instead.
    #[inline(always)]
    fn coordinates_at(&self, n: usize, t: f64, omega: f64, _: bool) -> [f64; 4] {
        let [[x, y], [v_x, v_y]] = plane::values([&self.dir, &self.v], n, t);
        let [z, v_z] = values([&self.dir_z, &self.v_z], n, t);
        let inv_k = if z > 0.0 { (1.0 + z) / (x * x + y * y) } else { 1.0 / (1.0 - z) };
        let (xi, eta) = (inv_k * x, inv_k * y);
        let rate = |d: f64, xi: f64| inv_k * (d + v_z * xi);
        [xi, eta, rate(v_x + omega * y, xi), rate(v_y - omega * x, eta)]
    }

    fn height<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, .. } = self.p;
        let rate = numbers::<T>(&self.dir_d).map(|rate| rate * l);
        let tilted = hub.tilt.height_now(self.bob(), rate, number(&hub.omega));
        let above = [self.above_rest::<T>(), number(&self.v_z)];
        [0, 1].map(|i| above[i] * (m * l) + tilted[i] * m)
    }

    fn force<T: Number>(&self, _: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, .. } = self.p;
        let (tension, [_, c]) = (number::<T>(&self.tension), self.p.restoring_and_drag::<T>());
        let [p, p_d] = [&self.dir, &self.dir_d].map(numbers::<T>);
        [0, 1].map(|i| tension * (m * l) * p[i] + c * l * p_d[i])
    }

    /// Returns the torque of the slosh mass about the bearing axis, N m: the moment of the tension, which acts at the hinge,
    /// and of the drag, which acts at the slosh mass.
    fn torque<T: Number>(&self, hub: &HubMotion) -> T {
        let (Pendulum { l, r, .. }, [_, c]) = (self.p, self.p.restoring_and_drag::<T>());
        let [[x, y], [x_d, y_d]] = [&self.dir, &self.dir_d].map(numbers::<T>);
        self.force::<T>(hub)[1] * r + c * l * l * (x * y_d - y * x_d)
    }

    fn energy<T: Number>(&self, hub: &HubMotion) -> T {
        let (Pendulum { m, l, .. }, [g, _]) = (self.p, self.p.restoring_and_drag::<T>());
        let [v_x, v_y, v_z] = self.velocity::<T>(hub);
        let [xi_1, xi_2]: [T; 2] = numbers(&self.xi);
        let height = number::<T>(&self.k) * l * (xi_1 * xi_1 + xi_2 * xi_2);
        let ([x, y], [e_x, e_y]): ([T; 2], [T; 2]) = (self.bob(), hub.tilt.now());
        (v_x * v_x + v_y * v_y + v_z * v_z) * m * 0.5 + g * m * height - (e_x * x + e_y * y) * m
    }

    fn momentum<T: Number>(&self, hub: &HubMotion) -> T {
        let ([x, y], [v_x, v_y, _]): ([T; 2], [T; 3]) = (self.bob(), self.velocity(hub));
        (x * v_y - y * v_x) * self.p.m
    }

    fn out_of_range(&self, q: &[f64; 4]) -> Option<&'static str> {
        // |xi| = 1e3 is a direction within 0.12 degrees of straight up.
        let up = q[0] * q[0] + q[1] * q[1] > 1e6;
        up.then_some("its slosh mass is straight up, where no pendulum represents a liquid")
    }
}

fn largest([x, y]: [f64; 2]) -> f64 {
    f64::max(x.abs(), y.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use taylor::series::ORDER;

    /// Returns the acceleration of the coordinates xi by Lagrange's equations, as an independent reference. `q` contains the
    /// coordinates and their rates, `w` and `w_d` are rate and acceleration of the hub, and `g` is the specific force. With v
    /// = xi' + w R xi and rho = xi.xi',
    ///
    /// ```text
    /// xi'' = B + A w'
    /// B = -(g/l) xi - (c/m) xi' - w R (xi' + v) + 2 k rho v - k |v|^2 xi + (r/l) w^2 e
    /// e = ((1 - xi_1^2 + xi_2^2)/2, -xi_1 xi_2)
    /// A = (xi_2, -xi_1) + (r/l) (xi_1 xi_2, -(1 + xi_1^2 - xi_2^2)/2)
    /// ```
    fn lagrange(p: &Pendulum, q: [f64; 4], w: f64, w_d: f64, g: f64) -> [f64; 2] {
        let [x, y, x_d, y_d] = q;
        let (k, rho) = (2.0 / (1.0 + x * x + y * y), x * x_d + y * y_d);
        let v = [x_d - w * y, y_d + w * x];
        let v2 = v[0] * v[0] + v[1] * v[1];
        let coriolis = [w * (y_d + v[1]), -w * (x_d + v[0])];
        let e = [(1.0 - x * x + y * y) / 2.0, -x * y];
        let a = [y + p.r_l * x * y, -x - p.r_l * (1.0 + x * x - y * y) / 2.0];
        core::array::from_fn(|i| {
            let (xi, xi_d) = ([x, y][i], [x_d, y_d][i]);
            coriolis[i] - g / p.l * xi - p.c_m * xi_d + 2.0 * k * rho * v[i] - k * v2 * xi
                + p.r_l * w * w * e[i]
                + a[i] * w_d
        })
    }

    #[test]
    fn a_slosh_mass_above_its_hinge_is_out_of_range() {
        let mode = Spherical::new(&Pendulum::default());
        for (q, is_out) in
            [([0.0; 4], false), ([600.0, 700.0, 0.0, 0.0], false), ([0.0, -1001.0, 0.0, 0.0], true)]
        {
            assert_eq!(mode.out_of_range(&q).is_some(), is_out, "{q:?}");
        }
    }

    /// The test compares two descriptions of the motion: the direction and velocity of the slosh mass, which the model
    /// integrates, and the coordinates xi, whose acceleration follows from Lagrange's equations. The random angles lie
    /// between hanging straight down and 20 degrees from straight up.
    #[test]
    fn direction_and_velocity_of_a_spherical_pendulum_follow_lagranges_equations() {
        let mut rng = fastrand::Rng::with_seed(3);
        let mut between = |low: f64, high: f64| low + rng.f64() * (high - low);
        for _ in 0..1000 {
            let (m, l, c, r) = (0.7, between(0.02, 0.2), between(0.0, 0.5), between(0.0, 0.4));
            let (c_m, r_l, inv_l) = (c / m, r / l, 1.0 / l);
            let p = Pendulum { m, l, c, c_0: c, r, c_m, r_l, inv_l, ..Pendulum::default() };
            let q = core::array::from_fn(|i| between(-4.0, 4.0) * if i < 2 { 1.0 } else { 5.0 });
            let (w, w_d, g) = (between(-2.0, 2.0), between(-9.0, 9.0), between(0.0, 20.0));
            let mut hub = HubMotion::REST;
            (hub.omega[0], hub.omega2[0], hub.omega_dot[0]) = (w, w * w, w_d);
            let mut mode = Spherical::new(&p);
            mode.pendulum_mut().set_restoring([g, 0.0]);
            mode.start(&q, &hub);
            mode.hub_reaction(0, false, &hub);
            mode.accelerate(0, false, &hub);
            let expected = lagrange(&p, q, w, w_d, g);
            let [.., x_dd, y_dd] = mode.derivatives(0, &hub);
            // The terms are as large as k |v|^2 |xi|, 1e4, and half of them are computed from terms that are
            // 1/k, 20, times smaller.
            let size = 1.0 + expected[0].abs().max(expected[1].abs()) + 1e3;
            assert!((x_dd - expected[0]).abs() < 1e-13 * size, "{x_dd} {}", expected[0]);
            assert!((y_dd - expected[1]).abs() < 1e-13 * size, "{y_dd} {}", expected[1]);
            // The conversion back gives the same coordinates.
            let back = mode.coordinates_at(ORDER, 0.0, w, false);
            for (a, b) in back.iter().zip(q) {
                assert!((a - b).abs() < 1e-13 * (1.0 + b.abs()), "{a} {b}");
            }
        }
    }
}

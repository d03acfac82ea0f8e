//! Spherical (conical) pendulum in stereographic coordinates: the bob's direction
//! from the hinge, in the hub's frame, is
//!
//! ```text
//! p = (k xi_1, k xi_2, 1 - k),   k = 2/(1 + |xi|^2),   q = xi
//! ```
//!
//! (rest is xi = 0; only the bob straight up is singular). With R the quarter turn
//! (a, b) -> (-b, a), v = xi' + w R xi the rate seen from outside the hub, and
//! rho = xi.xi', Newton's law on the sphere reads
//!
//! ```text
//! xi'' = B + A w'
//! B = -(g/l) xi - (c/m) xi' - w R (xi' + v) + 2 k rho v - k |v|^2 xi + (r/l) w^2 e
//! e = ((1 - xi_1^2 + xi_2^2)/2, -xi_1 xi_2)
//! A = (xi_2, -xi_1) + (r/l) (xi_1 xi_2, -(1 + xi_1^2 - xi_2^2)/2)
//! ```
//!
//! The rod pulls with m (S - r p_y w'), S = l k^2 |v|^2 + r w^2 p_x - g p_z, at the
//! hinge; the drag c l p' acts on the tank at the bob. So
//!
//! ```text
//! J = m r^2 p_y^2     (beyond the hub's I0)
//! T = m r p_y S + c l [ r p_y' + l (p_x p_y' - p_y p_x') ],  p_x p_y' - p_y p_x' = k^2 (xi_1 xi_2' - xi_2 xi_1')
//! E = m |velocity|^2/2 + m g l (2 - k),  heat c l^2 |p'|^2,  |p'| = k |xi'|
//! ```
//!
//! Derived from the bob's Lagrangian; checked against a unit-vector form.

use super::{Angles, Hub, Load, Mode};
use crate::series::{
    Pair, Series, ZERO, ZERO_PAIR, constant, dot, each, mul, mul_ramp, mul_tail, next, scale,
    scale_ramp, square, squares, value_pair,
};
use crate::tank::Pendulum;

#[derive(Clone, Debug)]
pub struct Spherical {
    p: Pendulum,
    xi: Pair,
    xi_d: Pair,
    xi_dd: Pair,
    /// 1 + |xi|^2, k
    sum: Series,
    k: Series,
    /// (p_x, p_y), p_x, p_y, p_z
    across: Pair,
    p_x: Series,
    p_y: Series,
    p_z: Series,
    v: Pair,
    /// xi' + v
    xi_d_v: Pair,
    /// (rho, |v|^2), k rho, k |v|^2
    rho_v2: Pair,
    k_rho: Series,
    k_v2: Series,
    /// S
    pull: Series,
    /// k xi' and the same with its components exchanged
    k_xi_d: Pair,
    k_xi_d_swapped: Pair,
    e: Pair,
    a: Pair,
    b: Pair,
    omega_n: f64,
}

impl Spherical {
    /// p' at order 0.
    fn dir_d(&self) -> [f64; 3] {
        let (k, rho) = (self.k[0], self.rho_v2[0][0]);
        let along = |i: usize| k * self.xi_d[0][i] - k * k * rho * self.xi[0][i];
        [along(0), along(1), k * k * rho]
    }

    /// Bob in the hub's frame, horizontally: X, Y, X', Y'.
    fn bob(&self) -> [f64; 4] {
        let Pendulum { l, r, .. } = self.p;
        let d = self.dir_d();
        [r + l * self.p_x[0], l * self.p_y[0], l * d[0], l * d[1]]
    }
}

impl Mode for Spherical {
    fn new(p: &Pendulum) -> Self {
        Spherical {
            p: *p,
            xi: ZERO_PAIR,
            xi_d: ZERO_PAIR,
            xi_dd: ZERO_PAIR,
            sum: ZERO,
            k: ZERO,
            across: ZERO_PAIR,
            p_x: ZERO,
            p_y: ZERO,
            p_z: ZERO,
            v: ZERO_PAIR,
            xi_d_v: ZERO_PAIR,
            rho_v2: ZERO_PAIR,
            k_rho: ZERO,
            k_v2: ZERO,
            pull: ZERO,
            k_xi_d: ZERO_PAIR,
            k_xi_d_swapped: ZERO_PAIR,
            e: ZERO_PAIR,
            a: ZERO_PAIR,
            b: ZERO_PAIR,
            omega_n: 0.0,
        }
    }

    /// sin(angle) = p_x, p_y with the bob below its hinge.
    fn coordinates(&self, at: &Angles) -> [f64; 4] {
        let [p_x, p_y] = at.angle.map(libm::sin);
        let [v_x, v_y] = [0, 1].map(|i| libm::cos(at.angle[i]) * at.rate[i]);
        let p_z = -libm::sqrt(1.0 - p_x * p_x - p_y * p_y);
        let v_z = -(p_x * v_x + p_y * v_y) / p_z;
        let (x, y) = (p_x / (1.0 - p_z), p_y / (1.0 - p_z));
        [x, y, (v_x + x * v_z) / (1.0 - p_z), (v_y + y * v_z) / (1.0 - p_z)]
    }

    fn angles(&self) -> Angles {
        let d = self.dir_d();
        let p = self.across[0].map(|p| p.clamp(-1.0, 1.0));
        let rate = |i: usize| {
            let cos = libm::sqrt((1.0 - p[i]) * (1.0 + p[i]));
            if cos > 0.0 { d[i] / cos } else { 0.0 }
        };
        Angles { angle: p.map(libm::asin), rate: [rate(0), rate(1)] }
    }

    fn start(&mut self, q: &[f64; 4]) {
        (self.xi[0], self.xi_d[0]) = ([q[0], q[1]], [q[2], q[3]]);
    }

    fn aim(&mut self, dq: &[f64; 4]) {
        (self.xi[1], self.xi_d[1]) = ([dq[0], dq[1]], [dq[2], dq[3]]);
    }

    fn rate(&self, n: usize) -> [f64; 4] {
        let ([x_d, y_d], [x_dd, y_dd]) = (self.xi_d[n], self.xi_dd[n]);
        [x_d, y_d, x_dd, y_dd]
    }

    #[inline(always)]
    fn load<const N: usize>(&mut self, hub: &Hub) -> Load {
        let Pendulum { m, l, c, r, c_m, r_l, inv_l, .. } = self.p;
        let one = constant::<N>(1.0);
        if N == 0 {
            self.omega_n = libm::sqrt(f64::max(hub.g[0], 0.0) / l);
        }
        let ([x, y], [x_d, y_d]) = (self.xi[N], self.xi_d[N]);
        // geometry
        let [x2, y2] = squares::<N>(&self.xi);
        let mut xy = 0.0;
        for j in 0..=N {
            xy += self.xi[j][0] * self.xi[N - j][1];
        }
        self.sum[N] = one + x2 + y2;
        self.k[N] = (2.0 * one - mul_tail::<N>(&self.sum, &self.k)) / self.sum[0];
        self.across[N] = scale::<N>(&self.k, &self.xi);
        [self.p_x[N], self.p_y[N]] = self.across[N];
        self.p_z[N] = one - self.k[N];
        self.e[N] = [(one - x2 + y2) / 2.0, -xy];
        self.a[N] = [y + r_l * xy, -x - r_l * (one + x2 - y2) / 2.0];
        // rates
        let turned = scale::<N>(&hub.omega, &self.xi);
        self.v[N] = [x_d - turned[1], y_d + turned[0]];
        self.xi_d_v[N] = [x_d + self.v[N][0], y_d + self.v[N][1]];
        let [v2_x, v2_y] = squares::<N>(&self.v);
        self.rho_v2[N] = [dot::<N>(&self.xi, &self.xi_d), v2_x + v2_y];
        [self.k_rho[N], self.k_v2[N]] = scale::<N>(&self.k, &self.rho_v2);
        // B
        let turned = scale::<N>(&hub.omega, &self.xi_d_v);
        let turned = [turned[1], -turned[0]];
        let along = scale::<N>(&self.k_rho, &self.v);
        let back = scale::<N>(&self.k_v2, &self.xi);
        let out = scale::<N>(&hub.omega2, &self.e);
        let fall = scale_ramp::<N>(&hub.g, &self.xi);
        for i in 0..2 {
            let drag = c_m * self.xi_d[N][i];
            self.b[N][i] =
                turned[i] - inv_l * fall[i] - drag + 2.0 * along[i] - back[i] + r_l * out[i];
        }
        // J and T
        self.pull[N] = l * mul::<N>(&self.k, &self.k_v2) + r * mul::<N>(&hub.omega2, &self.p_x)
            - mul_ramp::<N>(&hub.g, &self.p_z);
        let [k_x_d, k_y_d] = scale::<N>(&self.k, &self.xi_d);
        self.k_xi_d[N] = [k_x_d, k_y_d];
        self.k_xi_d_swapped[N] = [k_y_d, k_x_d];
        let p_y_d = k_y_d - mul::<N>(&self.k_rho, &self.p_y);
        let [plus, minus] = each::<N>(&self.across, &self.k_xi_d_swapped);
        Load {
            j: m * r * r * square::<N>(&self.p_y),
            t: m * r * mul::<N>(&self.p_y, &self.pull) + c * l * (r * p_y_d + l * (plus - minus)),
        }
    }

    #[inline(always)]
    fn respond<const N: usize>(&mut self, hub: &Hub) {
        let pushed = scale::<N>(&hub.omega_dot, &self.a);
        self.xi_dd[N] = [self.b[N][0] + pushed[0], self.b[N][1] + pushed[1]];
        self.xi[N + 1] = self.xi_d[N].map(next::<N>);
        self.xi_d[N + 1] = self.xi_dd[N].map(next::<N>);
    }

    #[inline(always)]
    fn size(&self) -> f64 {
        let largest = |[x, y]: [f64; 2]| f64::max(x.abs(), y.abs());
        largest(self.xi_d[0]) + self.omega_n * largest(self.xi[0])
    }

    #[inline(always)]
    fn term(&self, n: usize) -> f64 {
        f64::max(self.xi_d[n][0].abs(), self.xi_d[n][1].abs())
    }

    /// c l^2 |k xi'|^2
    #[inline(always)]
    fn heat<const N: usize>(&mut self) -> f64 {
        let [x, y] = squares::<N>(&self.k_xi_d);
        self.p.c * self.p.l * self.p.l * (x + y)
    }

    #[inline(always)]
    fn at(&self, n: usize, t: f64) -> [f64; 4] {
        let [x, y] = value_pair(&self.xi, n, t);
        let [x_d, y_d] = value_pair(&self.xi_d, n, t);
        [x, y, x_d, y_d]
    }

    /// The rod's pull along p and the drag.
    fn force(&self, hub: &Hub) -> [f64; 2] {
        let Pendulum { m, l, c, r, .. } = self.p;
        let d = self.dir_d();
        let pull = m * (self.pull[0] - r * self.p_y[0] * hub.omega_dot[0]);
        [0, 1].map(|i| pull * self.across[0][i] + c * l * d[i])
    }

    /// The pull acts at the hinge, the drag at the bob.
    fn torque(&self, hub: &Hub) -> f64 {
        let Pendulum { l, c, r, .. } = self.p;
        let d = self.dir_d();
        let swirl = self.p_x[0] * d[1] - self.p_y[0] * d[0];
        r * self.force(hub)[1] + c * l * l * swirl
    }

    fn energy(&self, hub: &Hub) -> f64 {
        let Pendulum { m, l, .. } = self.p;
        let ([x, y, x_d, y_d], w) = (self.bob(), hub.omega[0]);
        let (v_x, v_y, v_z) = (x_d - w * y, y_d + w * x, l * self.dir_d()[2]);
        // 2 - k = |xi|^2 k, without cancellation near rest
        let [xi_1, xi_2] = self.xi[0];
        let height = l * self.k[0] * (xi_1 * xi_1 + xi_2 * xi_2);
        m * (v_x * v_x + v_y * v_y + v_z * v_z) / 2.0 + m * hub.g[0] * height
    }

    fn momentum(&self, hub: &Hub) -> f64 {
        let ([x, y, x_d, y_d], w) = (self.bob(), hub.omega[0]);
        self.p.m * (w * (x * x + y * y) + x * y_d - y * x_d)
    }

    fn out_of_range(&self, q: &[f64; 4]) -> Option<&'static str> {
        // |xi| = 1e3 is a bob within 0.12 degrees of straight up.
        let up = q[0] * q[0] + q[1] * q[1] > 1e6;
        up.then_some("its bob stands straight up, where a pendulum says nothing about a liquid")
    }
}

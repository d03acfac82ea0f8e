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
//! T = m r p_y S + c l [ r p_y' + l (p_x p_y' - p_y p_x') ]
//! E = m |velocity|^2/2 + m g l (2 - k),  heat c l^2 |p'|^2,  |p'| = k |xi'|
//! ```
//!
//! Derived from the bob's Lagrangian; checked against a unit-vector form.

use super::{Angles, Hub, Load, Mode};
use crate::series::{Series, ZERO, mul, mul_ramp, mul_tail, square, value};
use crate::tank::Pendulum;

#[derive(Clone, Debug)]
pub struct Spherical {
    p: Pendulum,
    xi: [Series; 2],
    xi_d: [Series; 2],
    xi_dd: [Series; 2],
    /// xi_1^2 - xi_2^2 and 1 + xi_1^2 + xi_2^2, xi_1 xi_2
    difference: Series,
    sum: Series,
    product: Series,
    k: Series,
    /// p_x, p_y, p_z
    dir: [Series; 3],
    v: [Series; 2],
    /// xi' + v
    xi_d_v: [Series; 2],
    rho: Series,
    /// k rho, |v|^2, k |v|^2
    k_rho: Series,
    v2: Series,
    k_v2: Series,
    /// S and r p_y S m, the rod's pull
    pull: Series,
    /// xi_1 xi_2' - xi_2 xi_1' and k times it
    swirl: Series,
    k_swirl: Series,
    e: [Series; 2],
    a: [Series; 2],
    b: [Series; 2],
    /// |xi'|^2, k |xi'|^2 (heat)
    xi_d2: Series,
    k_xi_d2: Series,
    omega_n: f64,
}

impl Spherical {
    /// p' at order 0.
    fn dir_d(&self) -> [f64; 3] {
        let (k, rho) = (self.k[0], self.rho[0]);
        let along = |i: usize| k * self.xi_d[i][0] - k * k * rho * self.xi[i][0];
        [along(0), along(1), k * k * rho]
    }

    /// Bob in the hub's frame, horizontally: X, Y, X', Y'.
    fn bob(&self) -> [f64; 4] {
        let Pendulum { l, r, .. } = self.p;
        let d = self.dir_d();
        [r + l * self.dir[0][0], l * self.dir[1][0], l * d[0], l * d[1]]
    }
}

impl Mode for Spherical {
    fn new(p: &Pendulum) -> Self {
        Spherical {
            p: *p,
            xi: [ZERO; 2],
            xi_d: [ZERO; 2],
            xi_dd: [ZERO; 2],
            difference: ZERO,
            sum: ZERO,
            product: ZERO,
            k: ZERO,
            dir: [ZERO; 3],
            v: [ZERO; 2],
            xi_d_v: [ZERO; 2],
            rho: ZERO,
            k_rho: ZERO,
            v2: ZERO,
            k_v2: ZERO,
            pull: ZERO,
            swirl: ZERO,
            k_swirl: ZERO,
            e: [ZERO; 2],
            a: [ZERO; 2],
            b: [ZERO; 2],
            xi_d2: ZERO,
            k_xi_d2: ZERO,
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
        let p = [0, 1].map(|i| self.dir[i][0].clamp(-1.0, 1.0));
        let rate = |i: usize| {
            let cos = libm::sqrt((1.0 - p[i]) * (1.0 + p[i]));
            if cos > 0.0 { d[i] / cos } else { 0.0 }
        };
        Angles { angle: p.map(libm::asin), rate: [rate(0), rate(1)] }
    }

    fn start(&mut self, q: &[f64; 4]) {
        (self.xi[0][0], self.xi[1][0]) = (q[0], q[1]);
        (self.xi_d[0][0], self.xi_d[1][0]) = (q[2], q[3]);
    }

    #[inline(always)]
    fn load(&mut self, n: usize, hub: &Hub) -> Load {
        let Pendulum { m, l, c, r, .. } = self.p;
        let one = if n == 0 { 1.0 } else { 0.0 };
        if n == 0 {
            self.omega_n = libm::sqrt(hub.g[0] / l);
        }
        let [x, y] = &self.xi;
        let [x_d, y_d] = &self.xi_d;
        // geometry
        let (x2, y2) = (square(x, n), square(y, n));
        self.sum[n] = one + x2 + y2;
        self.difference[n] = x2 - y2;
        self.product[n] = mul(x, y, n);
        self.k[n] = (2.0 * one - mul_tail(&self.sum, &self.k, n)) / self.sum[0];
        self.dir[0][n] = mul(&self.k, x, n);
        self.dir[1][n] = mul(&self.k, y, n);
        self.dir[2][n] = one - self.k[n];
        self.e[0][n] = (one - self.difference[n]) / 2.0;
        self.e[1][n] = -self.product[n];
        self.a[0][n] = y[n] + r / l * self.product[n];
        self.a[1][n] = -x[n] - r / l * (one + self.difference[n]) / 2.0;
        // rates
        self.v[0][n] = x_d[n] - mul(&hub.omega, y, n);
        self.v[1][n] = y_d[n] + mul(&hub.omega, x, n);
        self.xi_d_v[0][n] = x_d[n] + self.v[0][n];
        self.xi_d_v[1][n] = y_d[n] + self.v[1][n];
        self.rho[n] = mul(x, x_d, n) + mul(y, y_d, n);
        self.k_rho[n] = mul(&self.k, &self.rho, n);
        self.v2[n] = square(&self.v[0], n) + square(&self.v[1], n);
        self.k_v2[n] = mul(&self.k, &self.v2, n);
        // B
        let turn = [
            mul(&hub.omega, &self.xi_d_v[1], n),
            -mul(&hub.omega, &self.xi_d_v[0], n),
        ];
        for i in 0..2 {
            self.b[i][n] = turn[i]
                - mul_ramp(&hub.g, &self.xi[i], n) / l
                - c / m * self.xi_d[i][n]
                + 2.0 * mul(&self.k_rho, &self.v[i], n)
                - mul(&self.k_v2, &self.xi[i], n)
                + r / l * mul(&hub.omega2, &self.e[i], n);
        }
        // J and T
        self.pull[n] = l * mul(&self.k, &self.k_v2, n) + r * mul(&hub.omega2, &self.dir[0], n)
            - mul_ramp(&hub.g, &self.dir[2], n);
        self.swirl[n] = mul(x, y_d, n) - mul(y, x_d, n);
        self.k_swirl[n] = mul(&self.k, &self.swirl, n);
        let p_y_d = mul(&self.k, y_d, n) - mul(&self.k_rho, &self.dir[1], n);
        Load {
            j: m * r * r * square(&self.dir[1], n),
            t: m * r * mul(&self.dir[1], &self.pull, n)
                + c * l * (r * p_y_d + l * mul(&self.k, &self.k_swirl, n)),
        }
    }

    #[inline(always)]
    fn respond(&mut self, n: usize, hub: &Hub) {
        for i in 0..2 {
            self.xi_dd[i][n] = self.b[i][n] + mul(&self.a[i], &hub.omega_dot, n);
        }
    }

    #[inline(always)]
    fn grow(&mut self, n: usize) {
        for i in 0..2 {
            self.xi[i][n + 1] = self.xi_d[i][n] / (n + 1) as f64;
            self.xi_d[i][n + 1] = self.xi_dd[i][n] / (n + 1) as f64;
        }
    }

    #[inline(always)]
    fn size(&self) -> f64 {
        let largest = |pair: &[Series; 2]| f64::max(pair[0][0].abs(), pair[1][0].abs());
        largest(&self.xi_d) + self.omega_n * largest(&self.xi)
    }

    #[inline(always)]
    fn term(&self, n: usize) -> f64 {
        f64::max(self.xi_d[0][n].abs(), self.xi_d[1][n].abs())
    }

    /// c l^2 k^2 |xi'|^2
    #[inline(always)]
    fn heat(&mut self, n: usize) -> f64 {
        self.xi_d2[n] = square(&self.xi_d[0], n) + square(&self.xi_d[1], n);
        self.k_xi_d2[n] = mul(&self.k, &self.xi_d2, n);
        self.p.c * self.p.l * self.p.l * mul(&self.k, &self.k_xi_d2, n)
    }

    #[inline(always)]
    fn at(&self, n: usize, t: f64) -> [f64; 4] {
        let [x, y] = &self.xi;
        let [x_d, y_d] = &self.xi_d;
        [value(x, n, t), value(y, n, t), value(x_d, n, t), value(y_d, n, t)]
    }

    /// The rod's pull along p and the drag.
    fn force(&self, hub: &Hub) -> [f64; 2] {
        let Pendulum { m, l, c, r, .. } = self.p;
        let d = self.dir_d();
        let pull = m * (self.pull[0] - r * self.dir[1][0] * hub.omega_dot[0]);
        [0, 1].map(|i| pull * self.dir[i][0] + c * l * d[i])
    }

    /// The pull acts at the hinge, the drag at the bob.
    fn torque(&self, hub: &Hub) -> f64 {
        let Pendulum { l, c, r, .. } = self.p;
        let d = self.dir_d();
        let swirl = self.dir[0][0] * d[1] - self.dir[1][0] * d[0];
        r * self.force(hub)[1] + c * l * l * swirl
    }

    fn energy(&self, hub: &Hub) -> f64 {
        let Pendulum { m, l, .. } = self.p;
        let ([x, y, x_d, y_d], w) = (self.bob(), hub.omega[0]);
        let (v_x, v_y, v_z) = (x_d - w * y, y_d + w * x, l * self.dir_d()[2]);
        // 2 - k = |xi|^2 k, without cancellation near rest
        let height = l * self.k[0] * (self.sum[0] - 1.0);
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

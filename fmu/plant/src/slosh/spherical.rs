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
use crate::series::{Series, ZERO, constant, mul, mul_ramp, mul_tail, next, square, value};
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

    fn aim(&mut self, dq: &[f64; 4]) {
        (self.xi[0][1], self.xi[1][1]) = (dq[0], dq[1]);
        (self.xi_d[0][1], self.xi_d[1][1]) = (dq[2], dq[3]);
    }

    fn rate(&self, n: usize) -> [f64; 4] {
        [self.xi_d[0][n], self.xi_d[1][n], self.xi_dd[0][n], self.xi_dd[1][n]]
    }

    #[inline(always)]
    fn load<const N: usize>(&mut self, hub: &Hub) -> Load {
        let Pendulum { m, l, c, r, c_m, r_l, inv_l, .. } = self.p;
        let one = constant::<N>(1.0);
        if N == 0 {
            self.omega_n = libm::sqrt(f64::max(hub.g[0], 0.0) / l);
        }
        let [x, y] = &self.xi;
        let [x_d, y_d] = &self.xi_d;
        // geometry
        let (x2, y2) = (square::<N>(x), square::<N>(y));
        self.sum[N] = one + x2 + y2;
        self.difference[N] = x2 - y2;
        self.product[N] = mul::<N>(x, y);
        self.k[N] = (2.0 * one - mul_tail::<N>(&self.sum, &self.k)) / self.sum[0];
        self.dir[0][N] = mul::<N>(&self.k, x);
        self.dir[1][N] = mul::<N>(&self.k, y);
        self.dir[2][N] = one - self.k[N];
        self.e[0][N] = (one - self.difference[N]) / 2.0;
        self.e[1][N] = -self.product[N];
        self.a[0][N] = y[N] + r_l * self.product[N];
        self.a[1][N] = -x[N] - r_l * (one + self.difference[N]) / 2.0;
        // rates
        self.v[0][N] = x_d[N] - mul::<N>(&hub.omega, y);
        self.v[1][N] = y_d[N] + mul::<N>(&hub.omega, x);
        self.xi_d_v[0][N] = x_d[N] + self.v[0][N];
        self.xi_d_v[1][N] = y_d[N] + self.v[1][N];
        self.rho[N] = mul::<N>(x, x_d) + mul::<N>(y, y_d);
        self.k_rho[N] = mul::<N>(&self.k, &self.rho);
        self.v2[N] = square::<N>(&self.v[0]) + square::<N>(&self.v[1]);
        self.k_v2[N] = mul::<N>(&self.k, &self.v2);
        // B
        let turn = [mul::<N>(&hub.omega, &self.xi_d_v[1]), -mul::<N>(&hub.omega, &self.xi_d_v[0])];
        for i in 0..2 {
            self.b[i][N] =
                turn[i] - inv_l * mul_ramp::<N>(&hub.g, &self.xi[i]) - c_m * self.xi_d[i][N]
                    + 2.0 * mul::<N>(&self.k_rho, &self.v[i])
                    - mul::<N>(&self.k_v2, &self.xi[i])
                    + r_l * mul::<N>(&hub.omega2, &self.e[i]);
        }
        // J and T
        self.pull[N] = l * mul::<N>(&self.k, &self.k_v2) + r * mul::<N>(&hub.omega2, &self.dir[0])
            - mul_ramp::<N>(&hub.g, &self.dir[2]);
        self.swirl[N] = mul::<N>(x, y_d) - mul::<N>(y, x_d);
        self.k_swirl[N] = mul::<N>(&self.k, &self.swirl);
        let p_y_d = mul::<N>(&self.k, y_d) - mul::<N>(&self.k_rho, &self.dir[1]);
        Load {
            j: m * r * r * square::<N>(&self.dir[1]),
            t: m * r * mul::<N>(&self.dir[1], &self.pull)
                + c * l * (r * p_y_d + l * mul::<N>(&self.k, &self.k_swirl)),
        }
    }

    #[inline(always)]
    fn respond<const N: usize>(&mut self, hub: &Hub) {
        for i in 0..2 {
            self.xi_dd[i][N] = self.b[i][N] + mul::<N>(&self.a[i], &hub.omega_dot);
        }
    }

    #[inline(always)]
    fn grow<const N: usize>(&mut self) {
        for i in 0..2 {
            self.xi[i][N + 1] = next::<N>(self.xi_d[i][N]);
            self.xi_d[i][N + 1] = next::<N>(self.xi_dd[i][N]);
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
    fn heat<const N: usize>(&mut self) -> f64 {
        self.xi_d2[N] = square::<N>(&self.xi_d[0]) + square::<N>(&self.xi_d[1]);
        self.k_xi_d2[N] = mul::<N>(&self.k, &self.xi_d2);
        self.p.c * self.p.l * self.p.l * mul::<N>(&self.k, &self.k_xi_d2)
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

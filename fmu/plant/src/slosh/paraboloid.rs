//! A mass on the paraboloid z = |q|^2/(2 l) with a quartic spring: rotary motion
//! hardens less than a pendulum's. q = (x, y) is the bob minus the hinge, m, in the
//! hub's frame. With N = l^2 + |q|^2, h = hardening/R^2 and the hub's Coriolis and
//! centrifugal forces a = (2 w y' + w^2 (r + x), -2 w x' + w^2 y):
//!
//! ```text
//! mu   = [ q.a + |q'|^2 + g l (1 + h |q|^2) ] / N
//! q''  = -(c/m) q' + a - mu q + w' [ (y, -(r + x)) + (r y/N) q ]
//! J    = m r^2 y^2 / N                 (beyond the hub's I0)
//! T    = m r mu y + c [ (r + x) y' - y x' ]
//! E = m [(x' - w y)^2 + (y' + w (r + x))^2 + z'^2]/2 + m (g/l) [|q|^2/2 + h |q|^4/4]
//! heat c (|q'|^2 + z'^2),  z' = q.q'/l
//! ```
//!
//! Lagrange's equations for this E and the Rayleigh function c (|q'|^2 + z'^2)/2.
//! For small q a pendulum is the case h = 1/(2 l^2).

use super::{Angles, HubMotion, HubReaction, SloshMode};
use crate::series::{Series, ZERO, constant, mul, mul_tail, next, square, values};
use crate::tank::Pendulum;

#[derive(Clone, Debug)]
pub struct Paraboloid {
    p: Pendulum,
    q: [Series; 2],
    q_d: [Series; 2],
    q_dd: [Series; 2],
    /// q' times the course of the damping
    drag: [Series; 2],
    /// r + x
    arm: Series,
    /// N, a, mu and the factor g l (1 + h |q|^2) before g
    n: Series,
    a: [Series; 2],
    mu: Series,
    spring: Series,
    /// r y / N and w' times it
    lever: Series,
    push: Series,
    /// -(c/m) q' + a - mu q
    b: [Series; 2],
    /// q.q' and that times the course of the damping (dissipation); |q|^2 (height)
    rise: Series,
    drag_rise: Series,
    q2: Series,
    omega_n: f64,
}

impl SloshMode for Paraboloid {
    fn new(p: &Pendulum) -> Self {
        Paraboloid {
            p: *p,
            q: [ZERO; 2],
            q_d: [ZERO; 2],
            q_dd: [ZERO; 2],
            drag: [ZERO; 2],
            arm: ZERO,
            n: ZERO,
            a: [ZERO; 2],
            mu: ZERO,
            spring: ZERO,
            lever: ZERO,
            push: ZERO,
            b: [ZERO; 2],
            rise: ZERO,
            drag_rise: ZERO,
            q2: ZERO,
            omega_n: 0.0,
        }
    }

    fn set_damping(&mut self, factor: f64) {
        self.p.set_damping(factor);
    }

    /// A displacement is in m.
    fn coordinate_scale(&self) -> f64 {
        self.p.l
    }

    fn coordinates(&self, at: &Angles) -> [f64; 4] {
        let q = at.angle.map(|angle| self.p.l * libm::sin(angle));
        let rate = |i: usize| self.p.l * libm::cos(at.angle[i]) * at.rate[i];
        [q[0], q[1], rate(0), rate(1)]
    }

    fn angles(&self) -> Angles {
        let l = self.p.l;
        let sin = [0, 1].map(|i| (self.q[i][0] / l).clamp(-1.0, 1.0));
        let rate = |i: usize| {
            let cos = libm::sqrt((1.0 - sin[i]) * (1.0 + sin[i]));
            if cos > 0.0 { self.q_d[i][0] / (l * cos) } else { 0.0 }
        };
        Angles { angle: sin.map(libm::asin), rate: [rate(0), rate(1)] }
    }

    fn start(&mut self, q: &[f64; 4], _: &HubMotion) {
        (self.q[0][0], self.q[1][0]) = (q[0], q[1]);
        (self.q_d[0][0], self.q_d[1][0]) = (q[2], q[3]);
    }

    fn seed_direction(&mut self, dq: &[f64; 4], _: &HubMotion) {
        (self.q[0][1], self.q[1][1]) = (dq[0], dq[1]);
        (self.q_d[0][1], self.q_d[1][1]) = (dq[2], dq[3]);
    }

    fn derivatives<const N: usize>(&self, _: &HubMotion) -> [f64; 4] {
        [self.q_d[0][N], self.q_d[1][N], self.q_dd[0][N], self.q_dd[1][N]]
    }

    #[inline(always)]
    fn hub_reaction<const N: usize, const RAMP: bool>(&mut self, hub: &HubMotion) -> HubReaction {
        let Pendulum { m, l, c, r, c_m, hardening, .. } = self.p;
        let one = constant::<N>(1.0);
        if N == 0 {
            self.omega_n = libm::sqrt(f64::max(hub.g[0], 0.0) / l);
        }
        for i in 0..2 {
            self.drag[i][N] = hub.drag::<N, RAMP>(&self.q_d[i]);
        }
        let [x, y] = &self.q;
        let [x_d, y_d] = &self.q_d;
        let [drag_x, drag_y] = &self.drag;
        self.arm[N] = one * r + x[N];
        let q2 = square::<N>(x) + square::<N>(y);
        self.n[N] = one * l * l + q2;
        self.spring[N] = l * (one + hardening * q2);
        self.a[0][N] = 2.0 * mul::<N>(&hub.omega, y_d) + mul::<N>(&hub.omega2, &self.arm);
        self.a[1][N] = -2.0 * mul::<N>(&hub.omega, x_d) + mul::<N>(&hub.omega2, y);
        let numerator = mul::<N>(x, &self.a[0])
            + mul::<N>(y, &self.a[1])
            + square::<N>(x_d)
            + square::<N>(y_d)
            + hub.weight::<N, RAMP>(&self.spring);
        self.mu[N] = (numerator - mul_tail::<N>(&self.n, &self.mu)) / self.n[0];
        self.lever[N] = (r * y[N] - mul_tail::<N>(&self.n, &self.lever)) / self.n[0];
        let mu_q = [mul::<N>(&self.mu, x), mul::<N>(&self.mu, y)];
        for i in 0..2 {
            self.b[i][N] = -c_m * self.drag[i][N] + self.a[i][N] - mu_q[i];
        }
        HubReaction {
            j: m * r * mul::<N>(&self.lever, y),
            t: m * r * mu_q[1] + c * (mul::<N>(&self.arm, drag_y) - mul::<N>(y, drag_x)),
        }
    }

    #[inline(always)]
    fn accelerate<const N: usize, const RAMP: bool>(&mut self, hub: &HubMotion) {
        let [x, y] = &self.q;
        let wd = &hub.omega_dot;
        self.push[N] = mul::<N>(&self.lever, wd);
        self.q_dd[0][N] = self.b[0][N] + mul::<N>(wd, y) + mul::<N>(&self.push, x);
        self.q_dd[1][N] = self.b[1][N] - mul::<N>(wd, &self.arm) + mul::<N>(&self.push, y);
        for i in 0..2 {
            self.q[i][N + 1] = next::<N>(self.q_d[i][N]);
            self.q_d[i][N + 1] = next::<N>(self.q_dd[i][N]);
        }
    }

    #[inline(always)]
    fn error_scale(&self) -> f64 {
        let largest = |pair: &[Series; 2]| f64::max(pair[0][0].abs(), pair[1][0].abs());
        (largest(&self.q_d) + self.omega_n * largest(&self.q)) / self.p.l
    }

    #[inline(always)]
    fn coefficient_norm(&self, n: usize) -> f64 {
        f64::max(self.q_d[0][n].abs(), self.q_d[1][n].abs()) / self.p.l
    }

    #[inline(always)]
    fn dissipation<const N: usize, const RAMP: bool>(&mut self) -> f64 {
        let Pendulum { l, c, .. } = self.p;
        let ([x, y], [x_d, y_d]) = (&self.q, &self.q_d);
        self.rise[N] = mul::<N>(x, x_d) + mul::<N>(y, y_d);
        if RAMP {
            // q.(d q') = d (q.q')
            self.drag_rise[N] = mul::<N>(x, &self.drag[0]) + mul::<N>(y, &self.drag[1]);
        }
        let power = if RAMP {
            let horizontal = mul::<N>(&self.drag[0], x_d) + mul::<N>(&self.drag[1], y_d);
            (horizontal, mul::<N>(&self.drag_rise, &self.rise))
        } else {
            (square::<N>(x_d) + square::<N>(y_d), square::<N>(&self.rise))
        };
        c * (power.0 + power.1 / (l * l))
    }

    /// m (|q|^2/2 + h |q|^4/4)/l
    #[inline(always)]
    fn mass_height<const N: usize>(&mut self) -> f64 {
        let Pendulum { m, l, hardening, .. } = self.p;
        self.q2[N] = square::<N>(&self.q[0]) + square::<N>(&self.q[1]);
        m / l * (self.q2[N] / 2.0 + hardening * square::<N>(&self.q2) / 4.0)
    }

    #[inline(always)]
    fn at(&self, n: usize, t: f64, _: f64) -> [f64; 4] {
        let ([x, y], [x_d, y_d]) = (&self.q, &self.q_d);
        values([x, y, x_d, y_d], n, t)
    }

    /// Minus the bob's mass times its acceleration, -m (q'' - a - w' (y, -(r + x))).
    fn force(&self, hub: &HubMotion) -> [f64; 2] {
        let wd = hub.omega_dot[0];
        let euler = [wd * self.q[1][0], -wd * self.arm[0]];
        [0, 1].map(|i| -self.p.m * (self.q_dd[i][0] - self.a[i][0] - euler[i]))
    }

    fn torque(&self, hub: &HubMotion) -> f64 {
        let [f_x, f_y] = self.force(hub);
        self.arm[0] * f_y - self.q[1][0] * f_x
    }

    fn energy(&self, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, hardening, .. } = self.p;
        let (x, y, x_d, y_d) = (self.q[0][0], self.q[1][0], self.q_d[0][0], self.q_d[1][0]);
        let w = hub.omega[0];
        let (v_x, v_y) = (x_d - w * y, y_d + w * self.arm[0]);
        let v_z = (x * x_d + y * y_d) / l;
        let q2 = x * x + y * y;
        m * (v_x * v_x + v_y * v_y + v_z * v_z) / 2.0
            + m * hub.g[0] / l * (q2 / 2.0 + hardening * q2 * q2 / 4.0)
    }

    fn momentum(&self, hub: &HubMotion) -> f64 {
        let (y, x_d, y_d) = (self.q[1][0], self.q_d[0][0], self.q_d[1][0]);
        let arm = self.arm[0];
        self.p.m * (hub.omega[0] * (arm * arm + y * y) + arm * y_d - y * x_d)
    }

    fn out_of_range(&self, q: &[f64; 4]) -> Option<&'static str> {
        let out = q[0] * q[0] + q[1] * q[1] >= self.p.l * self.p.l;
        out.then_some("its mass has moved by its length l, where the surface stands at 45 degrees")
    }
}

//! Nonlinear planar pendulum: the bob swings in the tangential plane only, with
//! centripetal terms and a changing inertia. q_y = al in rad; q_x unused.
//! With s = sin al, c_ = cos al, the bob at (r, l s, -l c_) in the hub's frame:
//!
//! ```text
//! p    = g s + (c/m) l al' - l w^2 s c_          (restoring specific force)
//! J    = m (r^2 + l^2) s^2                        (beyond the hub's I0)
//! T    = m [ -2 l^2 s c_ w al' + r l s al'^2 + r c_ p ]
//! al'' = -(r/l) c_ w' - p/l
//! E = m [(r w + l c_ al')^2 + (l s al')^2 + (l s w)^2]/2 + 2 m g l sin^2(al/2)
//! H = m [(r^2 + l^2 s^2) w + r l c_ al']
//! ```
//!
//! Lagrange's equations for this bob on the hub; to first order the linear model.

use super::{Angles, HubMotion, HubReaction, SloshMode};
use crate::series::{Series, ZERO, mul, next, sin_cos, square, values};
use crate::tank::Pendulum;

#[derive(Clone, Debug)]
pub struct Planar {
    p: Pendulum,
    al: Series,
    al_d: Series,
    al_dd: Series,
    /// al' times the course of the damping
    drag: Series,
    /// al' as `sin_cos` keeps it
    slope: Series,
    s: Series,
    c: Series,
    /// s c_, w al', al'^2, w^2 s c_, p
    sc: Series,
    w_al_d: Series,
    al_d2: Series,
    force: Series,
    omega_n: f64,
}

impl SloshMode for Planar {
    fn new(p: &Pendulum) -> Self {
        Planar {
            p: *p,
            al: ZERO,
            al_d: ZERO,
            al_dd: ZERO,
            drag: ZERO,
            slope: ZERO,
            s: ZERO,
            c: ZERO,
            sc: ZERO,
            w_al_d: ZERO,
            al_d2: ZERO,
            force: ZERO,
            omega_n: 0.0,
        }
    }

    fn set_damping(&mut self, factor: f64) {
        self.p.set_damping(factor);
    }

    fn coordinates(&self, at: &Angles) -> [f64; 4] {
        [0.0, at.angle[1], 0.0, at.rate[1]]
    }

    fn angles(&self) -> Angles {
        Angles { angle: [0.0, self.al[0]], rate: [0.0, self.al_d[0]] }
    }

    fn start(&mut self, q: &[f64; 4], _: &HubMotion) {
        (self.al[0], self.al_d[0]) = (q[1], q[3]);
    }

    fn seed_direction(&mut self, dq: &[f64; 4], _: &HubMotion) {
        (self.al[1], self.al_d[1]) = (dq[1], dq[3]);
    }

    fn derivatives<const N: usize>(&self, _: &HubMotion) -> [f64; 4] {
        [0.0, self.al_d[N], 0.0, self.al_dd[N]]
    }

    #[inline(always)]
    fn hub_reaction<const N: usize, const RAMP: bool>(&mut self, hub: &HubMotion) -> HubReaction {
        let Pendulum { m, l, c_m, r, .. } = self.p;
        if N == 0 {
            self.omega_n = libm::sqrt(f64::max(hub.g[0], 0.0) / l);
        }
        (self.s[N], self.c[N]) = sin_cos::<N>(self.al[N], &mut self.slope, &self.s, &self.c);
        self.sc[N] = mul::<N>(&self.s, &self.c);
        self.w_al_d[N] = mul::<N>(&hub.omega, &self.al_d);
        self.al_d2[N] = square::<N>(&self.al_d);
        self.drag[N] = hub.drag::<N, RAMP>(&self.al_d);
        self.force[N] = hub.weight::<N, RAMP>(&self.s) + c_m * l * self.drag[N]
            - l * mul::<N>(&hub.omega2, &self.sc);
        HubReaction {
            j: m * (r * r + l * l) * square::<N>(&self.s),
            t: m * (-2.0 * l * l * mul::<N>(&self.sc, &self.w_al_d)
                + r * l * mul::<N>(&self.s, &self.al_d2)
                + r * mul::<N>(&self.c, &self.force)),
        }
    }

    #[inline(always)]
    fn accelerate<const N: usize, const RAMP: bool>(&mut self, hub: &HubMotion) {
        let Pendulum { r_l, inv_l, .. } = self.p;
        self.al_dd[N] = -r_l * mul::<N>(&self.c, &hub.omega_dot) - inv_l * self.force[N];
        self.al[N + 1] = next::<N>(self.al_d[N]);
        self.al_d[N + 1] = next::<N>(self.al_dd[N]);
    }

    #[inline(always)]
    fn error_scale(&self) -> f64 {
        self.al_d[0].abs() + self.omega_n * f64::min(self.al[0].abs(), 1.0)
    }

    #[inline(always)]
    fn coefficient_norm(&self, n: usize) -> f64 {
        self.al_d[n].abs()
    }

    #[inline(always)]
    fn dissipation<const N: usize, const RAMP: bool>(&mut self) -> f64 {
        self.p.c
            * self.p.l
            * self.p.l
            * if RAMP { mul::<N>(&self.drag, &self.al_d) } else { square::<N>(&self.al_d) }
    }

    /// 2 m l sin^2(al/2), whose rate is m l s al'
    #[inline(always)]
    fn mass_height<const N: usize>(&mut self) -> f64 {
        let Pendulum { m, l, .. } = self.p;
        let half = libm::sin(self.al[0] / 2.0);
        m * l * if N == 0 { 2.0 * half * half } else { -self.c[N] }
    }

    #[inline(always)]
    fn at(&self, n: usize, t: f64, _: f64) -> [f64; 4] {
        let [al, al_d] = values([&self.al, &self.al_d], n, t);
        [0.0, al, 0.0, al_d]
    }

    /// -m times the bob's acceleration at (r, l s); the plane's guide takes the
    /// radial part.
    fn force(&self, hub: &HubMotion) -> [f64; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let (s, c, ad) = (self.s[0], self.c[0], self.al_d[0]);
        let (w, wd) = (hub.omega[0], hub.omega_dot[0]);
        let (y, y_d, y_dd) = (l * s, l * c * ad, l * (c * self.al_dd[0] - s * ad * ad));
        [m * (wd * y + 2.0 * w * y_d + w * w * r), -m * (y_dd + wd * r - w * w * y)]
    }

    fn torque(&self, hub: &HubMotion) -> f64 {
        let [f_x, f_y] = self.force(hub);
        self.p.r * f_y - self.p.l * self.s[0] * f_x
    }

    fn energy(&self, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, .. } = self.p;
        let (s, c, ad, w) = (self.s[0], self.c[0], self.al_d[0], hub.omega[0]);
        let (along, up, across) = (r * w + l * c * ad, l * s * ad, l * s * w);
        let half = libm::sin(self.al[0] / 2.0);
        m * (along * along + up * up + across * across) / 2.0 + 2.0 * m * hub.g[0] * l * half * half
    }

    fn momentum(&self, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, .. } = self.p;
        let (s, c) = (self.s[0], self.c[0]);
        m * ((r * r + l * l * s * s) * hub.omega[0] + r * l * c * self.al_d[0])
    }
}

//! Linear planar pendulum. q_y = al, the tangential angle in rad; q_x unused.
//!
//! ```text
//! T   = r (m g al + c l al'),   no share of J beyond the hub's I0
//! al'' = -(c/m) al' - (g/l) al - (r/l) w'
//! ```
//!
//! (thesis 4.27, 4.29 with the sign of the slosh torque corrected: with the
//! printed one the plant makes energy from nothing.)
//! ```text
//! E = m (r w + l al')^2/2 + m g l al^2/2,  H = m r (r w + l al')
//! ```

use super::{Angles, HubMotion, HubReaction, SloshMode};
use crate::series::{Series, ZERO, mul, next, square, values};
use crate::tank::Pendulum;

#[derive(Clone, Debug)]
pub struct Linear {
    p: Pendulum,
    /// al, al', al''
    al: Series,
    al_d: Series,
    al_dd: Series,
    /// g al, and al' times the course of the damping
    g_al: Series,
    drag: Series,
    /// sqrt(g/l) at the start of the expansion, rad/s
    omega_n: f64,
}

impl SloshMode for Linear {
    const MOVES_INERTIA: bool = false;

    fn new(p: &Pendulum) -> Self {
        Linear { p: *p, al: ZERO, al_d: ZERO, al_dd: ZERO, g_al: ZERO, drag: ZERO, omega_n: 0.0 }
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
        let Pendulum { m, l, c, r, .. } = self.p;
        if N == 0 {
            self.omega_n = libm::sqrt(f64::max(hub.g[0], 0.0) / l);
        }
        self.g_al[N] = hub.weight::<N, RAMP>(&self.al);
        self.drag[N] = hub.drag::<N, RAMP>(&self.al_d);
        HubReaction { j: 0.0, t: r * (m * self.g_al[N] + c * l * self.drag[N]) }
    }

    #[inline(always)]
    fn accelerate<const N: usize, const RAMP: bool>(&mut self, hub: &HubMotion) {
        let Pendulum { c_m, r_l, inv_l, .. } = self.p;
        self.al_dd[N] = -c_m * self.drag[N] - inv_l * self.g_al[N] - r_l * hub.omega_dot[N];
        self.al[N + 1] = next::<N>(self.al_d[N]);
        self.al_d[N + 1] = next::<N>(self.al_dd[N]);
    }

    #[inline(always)]
    fn error_scale(&self) -> f64 {
        self.al_d[0].abs() + self.omega_n * self.al[0].abs()
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

    /// m l al^2/2
    #[inline(always)]
    fn mass_height<const N: usize>(&mut self) -> f64 {
        self.p.m * self.p.l * square::<N>(&self.al) / 2.0
    }

    #[inline(always)]
    fn at(&self, n: usize, t: f64, _: f64) -> [f64; 4] {
        let [al, al_d] = values([&self.al, &self.al_d], n, t);
        [0.0, al, 0.0, al_d]
    }

    /// Tangential -m (r w' + l al''); radial from the bob's place (r, l al):
    /// m (r w^2 + 2 w l al' + w' l al), of second order in the motion.
    fn force(&self, hub: &HubMotion) -> [f64; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let (w, wd) = (hub.omega[0], hub.omega_dot[0]);
        let radial = m * (r * w * w + 2.0 * w * l * self.al_d[0] + wd * l * self.al[0]);
        [radial, -m * (r * wd + l * self.al_dd[0])]
    }

    /// r F_y: in the linear model the force acts at the hinge.
    fn torque(&self, hub: &HubMotion) -> f64 {
        self.p.r * self.force(hub)[1]
    }

    fn energy(&self, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, .. } = self.p;
        let speed = r * hub.omega[0] + l * self.al_d[0];
        (m * speed * speed + m * hub.g[0] * l * self.al[0] * self.al[0]) / 2.0
    }

    fn momentum(&self, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, .. } = self.p;
        m * r * (r * hub.omega[0] + l * self.al_d[0])
    }
}

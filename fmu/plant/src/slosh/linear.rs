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
//! On a bench that leans, gravity across the axis, e, adds e_y/l to al'', -m l e_x al to T and
//! -m (e_x r + e_y l al) to E.

use taylor::series::{Series, ZERO, constant, mul, next, square, values};

use super::{Angles, HubReaction, SloshMode};
use crate::hub::HubMotion;
use crate::pendulum::Pendulum;

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
}

impl SloshMode for Linear {
    const UNROLLED: bool = true;
    const MOVES_INERTIA: bool = false;

    fn new(p: &Pendulum) -> Self {
        Linear { p: *p, al: ZERO, al_d: ZERO, al_dd: ZERO, g_al: ZERO, drag: ZERO }
    }

    fn pendulum(&mut self) -> &mut Pendulum {
        &mut self.p
    }

    fn amplitude2(&self) -> [f64; 2] {
        [self.al[0] * self.al[0], self.al_d[0] * self.al_d[0]]
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

    fn derivatives(&self, n: usize, _: &HubMotion) -> [f64; 4] {
        [0.0, self.al_d[n], 0.0, self.al_dd[n]]
    }

    #[inline(always)]
    fn hub_reaction(&mut self, n: usize, ramp: bool, hub: &HubMotion) -> HubReaction {
        let Pendulum { m, l, c, r, .. } = self.p;
        if ramp && self.p.baffle.zeta > 0.0 {
            let at = [square(n, &self.al), square(n, &self.al_d)];
            self.p.course[n] = self.p.baffle.expand(n, at);
        }
        self.g_al[n] = self.p.weight(n, ramp, &self.al);
        self.drag[n] = self.p.drag(n, ramp, &self.al_d);
        let mut t = r * (m * self.g_al[n] + c * l * self.drag[n]);
        if ramp {
            t -= m * l * mul(n, &hub.tilt.e[0], &self.al);
        }
        HubReaction { j: 0.0, t }
    }

    #[inline(always)]
    fn accelerate(&mut self, n: usize, ramp: bool, hub: &HubMotion) {
        let Pendulum { c_m, r_l, inv_l, .. } = self.p;
        self.al_dd[n] = -c_m * self.drag[n] - inv_l * self.g_al[n] - r_l * hub.omega_dot[n];
        if ramp {
            self.al_dd[n] += inv_l * hub.tilt.e[1][n];
        }
        self.al[n + 1] = next(n, self.al_d[n]);
        self.al_d[n + 1] = next(n, self.al_dd[n]);
    }

    #[inline(always)]
    fn error_scale(&self) -> f64 {
        self.al_d[0].abs() + self.p.omega_n * self.al[0].abs()
    }

    #[inline(always)]
    fn coefficient_norm(&self, n: usize) -> f64 {
        self.al_d[n].abs()
    }

    #[inline(always)]
    fn dissipation(&mut self, n: usize, ramp: bool) -> f64 {
        self.p.c
            * self.p.l
            * self.p.l
            * if ramp { mul(n, &self.drag, &self.al_d) } else { square(n, &self.al_d) }
    }

    /// m l al^2/2
    #[inline(always)]
    fn mass_height(&mut self, n: usize, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, .. } = self.p;
        let place = |j: usize| [constant(j, r), l * self.al[j]];
        m * l * square(n, &self.al) / 2.0 + m * hub.tilt.height(n, place)
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
        let [e_x, e_y] = hub.tilt.now();
        [radial + m * e_x, -m * (r * wd + l * self.al_dd[0]) + m * e_y]
    }

    /// r F_y: in the linear model the force acts at the hinge; gravity of a leaning bench at the bob.
    fn torque(&self, hub: &HubMotion) -> f64 {
        self.p.r * self.force(hub)[1] - self.p.m * self.p.l * self.al[0] * hub.tilt.now()[0]
    }

    fn energy(&self, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, .. } = self.p;
        let speed = r * hub.omega[0] + l * self.al_d[0];
        let [e_x, e_y] = hub.tilt.now();
        (m * speed * speed + m * self.p.g[0] * l * self.al[0] * self.al[0]) / 2.0
            - m * (e_x * r + e_y * l * self.al[0])
    }

    fn momentum(&self, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, .. } = self.p;
        m * r * (r * hub.omega[0] + l * self.al_d[0])
    }
}

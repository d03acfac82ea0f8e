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

use taylor::number::Number;
use taylor::series::{Series, ZERO, constant, mul, next, number, square, values};

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

    fn pendulum(&self) -> &Pendulum {
        &self.p
    }

    fn pendulum_mut(&mut self) -> &mut Pendulum {
        &mut self.p
    }

    fn amplitude2<T: Number>(&self) -> [T; 2] {
        [&self.al, &self.al_d].map(|x| number::<T>(x) * number::<T>(x))
    }

    fn coordinates(&self, at: &Angles) -> [f64; 4] {
        [0.0, at.angle[1], 0.0, at.rate[1]]
    }

    fn angles<T: Number>(&self) -> Angles<T> {
        let zero = T::constant(0.0);
        Angles { angle: [zero, number(&self.al)], rate: [zero, number(&self.al_d)] }
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
        if ramp && self.p.follows_amplitude() {
            let at = [square(n, &self.al), square(n, &self.al_d)];
            self.p.expand_drag(n, at);
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

    fn height<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let (al, al_d): (T, T) = (number(&self.al), number(&self.al_d));
        let (place, rate) = ([T::constant(r), al * l], [T::constant(0.0), al_d * l]);
        let tilted = hub.tilt.height_now(place, rate, number(&hub.omega));
        [al * al * (m * l) * 0.5 + tilted[0] * m, al * al_d * (m * l) + tilted[1] * m]
    }

    /// Tangential -m (r w' + l al''); radial from the bob's place (r, l al):
    /// m (r w^2 + 2 w l al' + w' l al), of second order in the motion.
    fn force<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let [w, wd]: [T; 2] = [number(&hub.omega), number(&hub.omega_dot)];
        let [al, al_d, al_dd] = [&self.al, &self.al_d, &self.al_dd].map(number::<T>);
        let radial = (w * r * w + w * 2.0 * l * al_d + wd * l * al) * m;
        let [e_x, e_y]: [T; 2] = hub.tilt.now();
        [radial + e_x * m, e_y * m - (wd * r + al_dd * l) * m]
    }

    /// r F_y: in the linear model the force acts at the hinge; gravity of a leaning bench at the bob.
    fn torque<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, .. } = self.p;
        let ([_, f_y], [e_x, _]): ([T; 2], [T; 2]) = (self.force(hub), hub.tilt.now());
        f_y * r - number::<T>(&self.al) * (m * l) * e_x
    }

    fn energy<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, .. } = self.p;
        let (al, [g, _]) = (number::<T>(&self.al), self.p.restoring_and_drag::<T>());
        let speed = number::<T>(&hub.omega) * r + number::<T>(&self.al_d) * l;
        let [e_x, e_y]: [T; 2] = hub.tilt.now();
        (speed * m * speed + g * m * l * al * al) * 0.5 - (e_x * r + e_y * l * al) * m
    }

    fn momentum<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, .. } = self.p;
        (number::<T>(&hub.omega) * r + number::<T>(&self.al_d) * l) * (m * r)
    }
}

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
//! Lagrange's equations for this bob on the hub; to first order the linear model. On a bench
//! that leans, gravity across the axis, e, adds -e_y c_ to p, m (r e_y - l s e_x) to T and
//! -m (e_x r + e_y l s) to E.

use taylor::number::Number;
use taylor::series::{Series, ZERO, constant, mul, next, number, sin_cos, square, values};

use super::{Angles, HubReaction, SloshMode};
use crate::hub::HubMotion;
use crate::pendulum::Pendulum;

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
        }
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
        let Pendulum { m, l, c_m, r, .. } = self.p;
        (self.s[n], self.c[n]) = sin_cos(n, self.al[n], &mut self.slope, &self.s, &self.c);
        self.sc[n] = mul(n, &self.s, &self.c);
        self.w_al_d[n] = mul(n, &hub.omega, &self.al_d);
        self.al_d2[n] = square(n, &self.al_d);
        if ramp && self.p.follows_amplitude() {
            let at = [square(n, &self.al), self.al_d2[n]];
            self.p.expand_drag(n, at);
        }
        self.drag[n] = self.p.drag(n, ramp, &self.al_d);
        self.force[n] = self.p.weight(n, ramp, &self.s) + c_m * l * self.drag[n]
            - l * mul(n, &hub.omega2, &self.sc);
        let mut t = 0.0;
        if ramp {
            self.force[n] -= mul(n, &hub.tilt.e[1], &self.c);
            t = m * (r * hub.tilt.e[1][n] - l * mul(n, &hub.tilt.e[0], &self.s));
        }
        HubReaction {
            j: m * (r * r + l * l) * square(n, &self.s),
            t: t + m
                * (-2.0 * l * l * mul(n, &self.sc, &self.w_al_d)
                    + r * l * mul(n, &self.s, &self.al_d2)
                    + r * mul(n, &self.c, &self.force)),
        }
    }

    #[inline(always)]
    fn accelerate(&mut self, n: usize, _: bool, hub: &HubMotion) {
        let Pendulum { r_l, inv_l, .. } = self.p;
        self.al_dd[n] = -r_l * mul(n, &self.c, &hub.omega_dot) - inv_l * self.force[n];
        self.al[n + 1] = next(n, self.al_d[n]);
        self.al_d[n + 1] = next(n, self.al_dd[n]);
    }

    #[inline(always)]
    fn error_scale(&self) -> f64 {
        self.al_d[0].abs() + self.p.omega_n * f64::min(self.al[0].abs(), 1.0)
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

    /// 2 m l sin^2(al/2), whose rate is m l s al'
    #[inline(always)]
    fn mass_height(&mut self, n: usize, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, .. } = self.p;
        let half = libm::sin(self.al[0] / 2.0);
        let place = |j: usize| [constant(j, r), l * self.s[j]];
        m * l * if n == 0 { 2.0 * half * half } else { -self.c[n] } + m * hub.tilt.height(n, place)
    }

    #[inline(always)]
    fn at(&self, n: usize, t: f64, _: f64) -> [f64; 4] {
        let [al, al_d] = values([&self.al, &self.al_d], n, t);
        [0.0, al, 0.0, al_d]
    }

    fn height<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let [al, al_d, s, c] = [&self.al, &self.al_d, &self.s, &self.c].map(number::<T>);
        let half = (al * 0.5).sin();
        let (place, rate) = ([T::constant(r), s * l], [T::constant(0.0), c * l * al_d]);
        let tilted = hub.tilt.height_now(place, rate, number(&hub.omega));
        [half * 2.0 * half * (m * l) + tilted[0] * m, s * al_d * (m * l) + tilted[1] * m]
    }

    /// -m times the bob's acceleration at (r, l s); the plane's guide takes the
    /// radial part.
    fn force<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let [s, c, ad, al_dd] = [&self.s, &self.c, &self.al_d, &self.al_dd].map(number::<T>);
        let [w, wd]: [T; 2] = [number(&hub.omega), number(&hub.omega_dot)];
        let (y, y_d, y_dd) = (s * l, c * l * ad, (c * al_dd - s * ad * ad) * l);
        let [e_x, e_y]: [T; 2] = hub.tilt.now();
        [(wd * y + w * 2.0 * y_d + w * w * r + e_x) * m, -((y_dd + wd * r - w * w * y - e_y) * m)]
    }

    fn torque<T: Number>(&self, hub: &HubMotion) -> T {
        let [f_x, f_y]: [T; 2] = self.force(hub);
        f_y * self.p.r - number::<T>(&self.s) * self.p.l * f_x
    }

    fn energy<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, .. } = self.p;
        let [al, s, c, ad] = [&self.al, &self.s, &self.c, &self.al_d].map(number::<T>);
        let (w, [g, _]) = (number::<T>(&hub.omega), self.p.restoring_and_drag::<T>());
        let (along, up, across) = (w * r + c * l * ad, s * l * ad, s * l * w);
        let half = (al * 0.5).sin();
        let [e_x, e_y]: [T; 2] = hub.tilt.now();
        (along * along + up * up + across * across) * m * 0.5 + g * (2.0 * m) * l * half * half
            - (e_x * r + e_y * l * s) * m
    }

    fn momentum<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, .. } = self.p;
        let [s, c, ad] = [&self.s, &self.c, &self.al_d].map(number::<T>);
        let inertia = T::constant(r * r) + s * (l * l) * s;
        (inertia * number::<T>(&hub.omega) + c * (r * l) * ad) * m
    }
}

//! Slosh model `planar`: the slosh mass is a nonlinear pendulum in one plane, by default the tangential plane, with
//! centripetal terms and a changing inertia. al is the angle, rad, along the plane's direction n = (n_x, n_t), so that q =
//! al n. With s = sin al, c_ = cos al, and the slosh mass at (r, l s, -l c_) in the hub's frame:
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
//! These are Lagrange's equations for this slosh mass on the hub; to first order they are the linear model. On a tilted
//! bench, gravity across the axis, e, adds -e_y c_ to p, m (r e_y - l s e_x) to T and -m (e_x r + e_y l s) to E.
//!
//! For another direction than the tangent (a box with modes along both axes), u = l s, r_x = r n_x, r_t = r n_t, and the
//! slosh mass is at (r + u n_x, u n_t, -l c_). Lagrange's equations of
//!
//! ```text
//! L = m [w^2 (r^2 + u^2 + 2 r_x u) + 2 w r_t u' + (l al')^2]/2 - m g l (1 - c_) + m [e_x (r + u n_x) + e_y u n_t]
//!
//! p    = g s + (c/m) l al' - w^2 (u + r_x) c_ - (e_x n_x + e_y n_t) c_
//! J    = m [r_x^2 + 2 r_x u + (r_t^2 + l^2) s^2]
//! T    = m [ -2 (u + r_x) l c_ w al' + r_t l s al'^2 + r_t c_ p + r e_y + u (e_y n_x - e_x n_t) ]
//! al'' = -(r_t/l) c_ w' - p/l
//! E = m [(r_t w + l c_ al')^2 + (l s al')^2 + (r_x + u)^2 w^2]/2 + 2 m g l sin^2(al/2) - m [e_x (r + u n_x) + e_y u n_t]
//! H = m [(r^2 + u^2 + 2 r_x u) w + r_t l c_ al']
//! ```
//!
//! The hub's angular acceleration does not move a radial slosh mass (n_t = 0). The centrifugal term w^2 (r + u) moves it
//! outwards, and it rotates with the hub at r + u, so that its motion accelerates and decelerates the hub (2 w u').

use alloc::string::String;

use taylor::number::Number;
use taylor::series::{Series, ZERO, constant, mul, next, number, sin_cos, square, values};

use super::{Angles, HubReaction, SloshMode, one_angle, own_pendulum};
use crate::hub::HubMotion;
use crate::parameters::Init;
use crate::pendulum::Pendulum;

#[derive(Clone, Debug)]
pub struct Planar {
    p: Pendulum,
    al: Series,
    al_d: Series,
    al_dd: Series,
    drag: Series,
    slope: Series,
    s: Series,
    c: Series,
    sc: Series,
    w_al_d: Series,
    al_d2: Series,
    force: Series,
}

impl SloshMode for Planar {
    one_angle!();

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

    #[inline(always)]
    fn hub_reaction(&mut self, n: usize, ramp: bool, hub: &HubMotion) -> HubReaction {
        let Pendulum { m, l, c_m, r, r_x, r_t, .. } = self.p;
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
        let (mut j, mut t) = (m * (r_t * r_t + l * l) * square(n, &self.s), 0.0);
        if ramp {
            self.force[n] -= self.p.component_times(n, &hub.tilt.e, &self.c);
            t = m * (r * hub.tilt.e[1][n] - l * self.p.across_times(n, &hub.tilt.e, &self.s));
            if self.p.is_askew() {
                self.force[n] -= r_x * mul(n, &hub.omega2, &self.c);
                j += m * r_x * (2.0 * l * self.s[n] + constant(n, r_x));
                t -= 2.0 * m * r_x * l * mul(n, &self.c, &self.w_al_d);
            }
        }
        HubReaction {
            j,
            t: t + m
                * (-2.0 * l * l * mul(n, &self.sc, &self.w_al_d)
                    + r_t * l * mul(n, &self.s, &self.al_d2)
                    + r_t * mul(n, &self.c, &self.force)),
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
    fn mass_height(&mut self, n: usize, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, along: [n_x, n_t], .. } = self.p;
        let half = libm::sin(self.al[0] / 2.0);
        let place = |j: usize| [constant(j, r) + l * self.s[j] * n_x, l * self.s[j] * n_t];
        m * l * if n == 0 { 2.0 * half * half } else { -self.c[n] } + m * hub.tilt.height(n, place)
    }

    fn height<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let [al, al_d, s, c] = [&self.al, &self.al_d, &self.s, &self.c].map(number::<T>);
        let half = (al * 0.5).sin();
        let ([x, y], rate) = (self.p.spread(s * l), self.p.spread(c * l * al_d));
        let place = [x + T::constant(r), y];
        let tilted = hub.tilt.height_now(place, rate, number(&hub.omega));
        [half * 2.0 * half * (m * l) + tilted[0] * m, s * al_d * (m * l) + tilted[1] * m]
    }

    /// Returns the radial and the tangential force of the slosh mass on the tank, N, which is minus its mass times its
    /// acceleration. The slosh mass moves in a plane; the guide that keeps it there carries the force across the plane.
    fn force<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let [s, c, ad, al_dd] = [&self.s, &self.c, &self.al_d, &self.al_dd].map(number::<T>);
        let [w, wd]: [T; 2] = [number(&hub.omega), number(&hub.omega_dot)];
        let ([x, y], [x_d, y_d]) = (self.p.spread(s * l), self.p.spread(c * l * ad));
        let [x_dd, y_dd] = self.p.spread((c * al_dd - s * ad * ad) * l);
        let (x, [e_x, e_y]): (T, [T; 2]) = (x + T::constant(r), hub.tilt.now());
        [
            (wd * y + w * 2.0 * y_d + w * w * x + e_x - x_dd) * m,
            -((y_dd + wd * x - w * w * y - e_y + w * 2.0 * x_d) * m),
        ]
    }

    fn torque<T: Number>(&self, hub: &HubMotion) -> T {
        let [f_x, f_y]: [T; 2] = self.force(hub);
        let [x, y] = self.p.spread(number::<T>(&self.s) * self.p.l);
        f_y * (x + T::constant(self.p.r)) - y * f_x
    }

    fn energy<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, r_x, r_t, .. } = self.p;
        let [al, s, c, ad] = [&self.al, &self.s, &self.c, &self.al_d].map(number::<T>);
        let (w, [g, _]) = (number::<T>(&hub.omega), self.p.restoring_and_drag::<T>());
        let (along, up, across) =
            (w * r_t + c * l * ad, s * l * ad, (s * l + T::constant(r_x)) * w);
        let half = (al * 0.5).sin();
        let ([e_x, e_y], [n_x, n_t]): ([T; 2], _) = (hub.tilt.now(), self.p.along);
        (along * along + up * up + across * across) * m * 0.5 + g * (2.0 * m) * l * half * half
            - (e_x * (s * (l * n_x) + T::constant(r)) + e_y * l * s * n_t) * m
    }

    fn momentum<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, r_x, r_t, .. } = self.p;
        let [s, c, ad] = [&self.s, &self.c, &self.al_d].map(number::<T>);
        let inertia = T::constant(r * r) + s * (l * l) * s + s * (2.0 * r_x * l);
        (inertia * number::<T>(&hub.omega) + c * (r_t * l) * ad) * m
    }
}

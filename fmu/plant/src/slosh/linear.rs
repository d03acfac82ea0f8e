//! Slosh model `linear`: linear planar pendulums. al is the angle, rad, along the direction n = (n_x, n_t), radial and
//! tangential, in which the slosh mass moves, so that q = al n. By default the direction is the tangent, q_x = 0.
//!
//! ```text
//! T   = r (m g al + c l al'),   no share of J beyond the hub's I0
//! al'' = -(c/m) al' - (g/l) al - (r/l) w'
//! ```
//!
//! Thesis 4.27, 4.29 with the sign of the slosh torque corrected. With the printed sign the plant would generate energy.
//! ```text
//! E = m (r w + l al')^2/2 + m g l al^2/2,  H = m r (r w + l al')
//! ```
//! On a tilted bench, gravity across the axis, e, adds e_y/l to al'', -m l e_x al to T and -m (e_x r + e_y l al) to E.
//!
//! For another direction than the tangent (a box with modes along both axes), u = l al, r_x = r n_x, r_t = r n_t,
//! and the slosh mass is at (r + u n_x, u n_t). Its kinetic energy to second order is m [(r_t w + u')^2 + (r_x
//! w)^2]/2. Lagrange's equations are
//! ```text
//! J   = m r_x^2,   T = r_t (m g al + c l al') - m (r_x + u)(e_x n_t - e_y n_x)
//! al'' = -(c/m) al' - (g/l) al - (r_t/l) w' + (e_x n_x + e_y n_t)/l
//! H = m (r^2 w + r_t u')
//! ```
//!
//! The rotation of the hub moves a radial mode (n_t = 0) only by terms of second order, r w^2 and 2 w u', which only
//! `planar.rs` contains. In the linear model only the tilt of the bench moves this mode, and its mass moves on the
//! circle of radius r.

use alloc::string::String;

use taylor::number::Number;
use taylor::series::{Series, ZERO, constant, mul, next, number, square, values};

use super::{Angles, HubReaction, SloshMode, one_angle, own_pendulum};
use crate::hub::HubMotion;
use crate::parameters::Init;
use crate::pendulum::Pendulum;

#[derive(Clone, Debug)]
pub struct Linear {
    p: Pendulum,
    al: Series,
    al_d: Series,
    al_dd: Series,
    g_al: Series,
    drag: Series,
}

impl SloshMode for Linear {
    const UNROLLED: bool = true;
    const MOVES_INERTIA: bool = false;

    one_angle!();

    fn new(p: &Pendulum) -> Self {
        Linear { p: *p, al: ZERO, al_d: ZERO, al_dd: ZERO, g_al: ZERO, drag: ZERO }
    }

    #[inline(always)]
    fn hub_reaction(&mut self, n: usize, ramp: bool, hub: &HubMotion) -> HubReaction {
        let Pendulum { m, l, c, r, r_x, r_t, .. } = self.p;
        if ramp && self.p.follows_amplitude() {
            let at = [square(n, &self.al), square(n, &self.al_d)];
            self.p.expand_drag(n, at);
        }
        self.g_al[n] = self.p.weight(n, ramp, &self.al);
        self.drag[n] = self.p.drag(n, ramp, &self.al_d);
        // If neither drag nor weight changes in time, the mode moves along the tangent.
        let arm = if ramp { r_t } else { r };
        let mut t = arm * (m * self.g_al[n] + c * l * self.drag[n]);
        let mut j = 0.0;
        if ramp {
            t -= m * l * self.p.across_times(n, &hub.tilt.e, &self.al);
            if self.p.is_askew() {
                let ([n_x, n_t], [e_x, e_t]) = (self.p.along, &hub.tilt.e);
                t -= m * r_x * (n_t * e_x[n] - n_x * e_t[n]);
                j = constant(n, m * r_x * r_x);
            }
        }
        HubReaction { j, t }
    }

    #[inline(always)]
    fn accelerate(&mut self, n: usize, ramp: bool, hub: &HubMotion) {
        let Pendulum { c_m, r_l, inv_l, .. } = self.p;
        self.al_dd[n] = -c_m * self.drag[n] - inv_l * self.g_al[n] - r_l * hub.omega_dot[n];
        if ramp {
            self.al_dd[n] += inv_l * self.p.component(n, &hub.tilt.e);
        }
        self.al[n + 1] = next(n, self.al_d[n]);
        self.al_d[n + 1] = next(n, self.al_dd[n]);
    }

    #[inline(always)]
    fn error_scale(&self) -> f64 {
        self.al_d[0].abs() + self.p.omega_n * self.al[0].abs()
    }

    /// Returns Taylor coefficient n of the slosh mass times its height above rest, kg m. The pendulum rises by l/2 times the
    /// squared angle; on a tilted bench the height of the slosh mass in the hub's frame is added.
    #[inline(always)]
    fn mass_height(&mut self, n: usize, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, along: [n_x, n_t], .. } = self.p;
        let place = |j: usize| [constant(j, r) + l * self.al[j] * n_x, l * self.al[j] * n_t];
        m * l * square(n, &self.al) / 2.0 + m * hub.tilt.height(n, place)
    }

    fn height<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let (al, al_d): (T, T) = (number(&self.al), number(&self.al_d));
        let ([x, y], rate) = (self.p.spread(al * l), self.p.spread(al_d * l));
        let place = [x + T::constant(r), y];
        let tilted = hub.tilt.height_now(place, rate, number(&hub.omega));
        [al * al * (m * l) * 0.5 + tilted[0] * m, al * al_d * (m * l) + tilted[1] * m]
    }

    /// Returns the radial and the tangential force of the slosh mass on the tank, N. With the slosh angle al along the
    /// direction (n_x, n_t), the hub's rate w, and the distance r of the hinge from the axis, the tangential force is -m (r
    /// w' + l al'' n_t). The radial force follows from the position (r + l al n_x, l al n_t) of the slosh mass: -m l al'' n_x
    /// plus terms of second order, m (r w^2 + 2 w l al' n_t + w' l al n_t).
    fn force<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, r, .. } = self.p;
        let [w, wd]: [T; 2] = [number(&hub.omega), number(&hub.omega_dot)];
        let [al, al_d, al_dd] = [&self.al, &self.al_d, &self.al_dd].map(number::<T>);
        let [n_x, n_t] = self.p.along;
        let radial = (w * r * w + w * 2.0 * l * al_d * n_t + wd * l * al * n_t) * m;
        let [e_x, e_y]: [T; 2] = hub.tilt.now();
        [radial + e_x * m - al_dd * (m * l * n_x), e_y * m - (wd * r + al_dd * l * n_t) * m]
    }

    /// Returns the torque of the liquid on the hub, N m: the tangential force times the distance r, because the linear model
    /// lets the force act at the hinge. Gravity of a tilted bench acts at the slosh mass instead.
    fn torque<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, .. } = self.p;
        let ([_, f_y], [e_x, e_y]): ([T; 2], [T; 2]) = (self.force(hub), hub.tilt.now());
        let [n_x, n_t] = self.p.along;
        f_y * r - number::<T>(&self.al) * (m * l) * (e_x * n_t - e_y * n_x)
    }

    fn energy<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, r_x, r_t, along: [n_x, n_t], .. } = self.p;
        let (al, [g, _]) = (number::<T>(&self.al), self.p.restoring_and_drag::<T>());
        let w = number::<T>(&hub.omega);
        let speed = w * r_t + number::<T>(&self.al_d) * l;
        let [e_x, e_y]: [T; 2] = hub.tilt.now();
        let place = al * (l * n_x) + T::constant(r);
        (speed * m * speed + g * m * l * al * al + w * (m * r_x * r_x) * w) * 0.5
            - (e_x * place + e_y * l * al * n_t) * m
    }

    fn momentum<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, r, along: [_, n_t], .. } = self.p;
        (number::<T>(&hub.omega) * r + number::<T>(&self.al_d) * l * n_t) * (m * r)
    }
}

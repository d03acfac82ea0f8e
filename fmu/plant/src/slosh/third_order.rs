//! Slosh model `liquid`: a mode to third order in its amplitude. It is a mass on the paraboloid z = |q|^2/(2 l) with a
//! quartic spring. The coefficients s and kappa give the liquid's shifts of frequency in planar and in circular motion
//! (`formulas::third_order`). q = (x, y) is the position of the slosh mass relative to the hinge, m, in the hub's frame.
//! With N = l^2/s + |q|^2, h = kappa/(2 l^2) and the hub's Coriolis and centrifugal accelerations a = (2 w y' + w^2 (r + x),
//! -2 w x' + w^2 y):
//!
//! ```text
//! mu   = [ q.a + |q'|^2 + g (l/s) (1 + h |q|^2) ] / N
//! q''  = -(c/m) q' + a - mu q + w' [ (y, -(r + x)) + (r y/N) q ]
//! J    = m r^2 y^2 / N                 (beyond the hub's I0)
//! T    = m r mu y + c [ (r + x) y' - y x' ]
//! E = m [(x' - w y)^2 + (y' + w (r + x))^2 + s z'^2]/2 + m (g/l) [|q|^2/2 + h |q|^4/4]
//! dissipated power c (|q'|^2 + s z'^2),  z' = q.q'/l
//! ```
//!
//! These are Lagrange's equations for this E and the Rayleigh function c (|q'|^2 + s z'^2)/2. On a tilted bench, gravity
//! across the axis, e, is added to a, and -m e.(r + x, y) to E. For small q a pendulum corresponds to s = kappa = 1.

use taylor::number::Number;
use taylor::series::{Series, ZERO, constant, mul, mul_tail, next, number, square, values};

use super::{Angles, HubReaction, SloshMode, own_pendulum};
use crate::hub::HubMotion;
use crate::pendulum::Pendulum;

#[derive(Clone, Debug)]
pub struct ThirdOrder {
    p: Pendulum,
    q: [Series; 2],
    q_d: [Series; 2],
    q_dd: [Series; 2],
    drag: [Series; 2],
    arm: Series,
    n: Series,
    a: [Series; 2],
    mu: Series,
    spring: Series,
    lever: Series,
    push: Series,
    b: [Series; 2],
    rise: Series,
    drag_rise: Series,
    q2: Series,
}

fn pair<T: Number>(a: &[Series; 2]) -> [T; 2] {
    [number(&a[0]), number(&a[1])]
}

impl SloshMode for ThirdOrder {
    fn new(p: &Pendulum) -> Self {
        ThirdOrder {
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
        }
    }

    own_pendulum!();

    fn amplitude2<T: Number>(&self) -> [T; 2] {
        let l2 = T::constant(self.p.l * self.p.l);
        [&self.q, &self.q_d].map(|q| {
            let [x, y] = pair::<T>(q);
            (x * x + y * y) / l2
        })
    }

    fn coordinates(&self, at: &Angles) -> [f64; 4] {
        let q = at.angle.map(|angle| self.p.l * libm::sin(angle));
        let rate = |i: usize| self.p.l * libm::cos(at.angle[i]) * at.rate[i];
        [q[0], q[1], rate(0), rate(1)]
    }

    fn angles<T: Number>(&self) -> Angles<T> {
        let (l, one) = (T::constant(self.p.l), T::constant(1.0));
        let [q, q_d] = [&self.q, &self.q_d].map(pair::<T>);
        let sin = q.map(|q| (q / l).clamp(-1.0, 1.0));
        let rate = |i: usize| {
            let cos = ((one - sin[i]) * (one + sin[i])).sqrt();
            q_d[i].over_or_zero(l * cos)
        };
        Angles { angle: sin.map(T::asin), rate: [rate(0), rate(1)] }
    }

    fn start(&mut self, q: &[f64; 4], _: &HubMotion) {
        (self.q[0][0], self.q[1][0]) = (q[0], q[1]);
        (self.q_d[0][0], self.q_d[1][0]) = (q[2], q[3]);
    }

    fn seed_direction(&mut self, dq: &[f64; 4], _: &HubMotion) {
        (self.q[0][1], self.q[1][1]) = (dq[0], dq[1]);
        (self.q_d[0][1], self.q_d[1][1]) = (dq[2], dq[3]);
    }

    fn derivatives(&self, n: usize, _: &HubMotion) -> [f64; 4] {
        [self.q_d[0][n], self.q_d[1][n], self.q_dd[0][n], self.q_dd[1][n]]
    }

    #[inline(always)]
    fn hub_reaction(&mut self, n: usize, ramp: bool, hub: &HubMotion) -> HubReaction {
        let Pendulum { m, c, r, c_m, spring, l_s, l2_s, .. } = self.p;
        let one = constant(n, 1.0);
        if ramp && self.p.follows_amplitude() {
            let inv_l2 = self.p.inv_l * self.p.inv_l;
            let at = [&self.q, &self.q_d].map(|[x, y]| inv_l2 * (square(n, x) + square(n, y)));
            self.p.expand_drag(n, at);
        }
        for i in 0..2 {
            self.drag[i][n] = self.p.drag(n, ramp, &self.q_d[i]);
        }
        let [x, y] = &self.q;
        let [x_d, y_d] = &self.q_d;
        let [drag_x, drag_y] = &self.drag;
        self.arm[n] = one * r + x[n];
        let q2 = square(n, x) + square(n, y);
        self.n[n] = one * l2_s + q2;
        self.spring[n] = l_s * (one + spring * q2);
        self.a[0][n] = 2.0 * mul(n, &hub.omega, y_d) + mul(n, &hub.omega2, &self.arm);
        self.a[1][n] = -2.0 * mul(n, &hub.omega, x_d) + mul(n, &hub.omega2, y);
        if ramp {
            for i in 0..2 {
                self.a[i][n] += hub.tilt.e[i][n];
            }
        }
        let numerator = mul(n, x, &self.a[0])
            + mul(n, y, &self.a[1])
            + square(n, x_d)
            + square(n, y_d)
            + self.p.weight(n, ramp, &self.spring);
        self.mu[n] = (numerator - mul_tail(n, &self.n, &self.mu)) / self.n[0];
        self.lever[n] = (r * y[n] - mul_tail(n, &self.n, &self.lever)) / self.n[0];
        let mu_q = [mul(n, &self.mu, x), mul(n, &self.mu, y)];
        for i in 0..2 {
            self.b[i][n] = -c_m * self.drag[i][n] + self.a[i][n] - mu_q[i];
        }
        HubReaction {
            j: m * r * mul(n, &self.lever, y),
            t: m * r * mu_q[1] + c * (mul(n, &self.arm, drag_y) - mul(n, y, drag_x)),
        }
    }

    #[inline(always)]
    fn accelerate(&mut self, n: usize, _: bool, hub: &HubMotion) {
        let [x, y] = &self.q;
        let wd = &hub.omega_dot;
        self.push[n] = mul(n, &self.lever, wd);
        self.q_dd[0][n] = self.b[0][n] + mul(n, wd, y) + mul(n, &self.push, x);
        self.q_dd[1][n] = self.b[1][n] - mul(n, wd, &self.arm) + mul(n, &self.push, y);
        for i in 0..2 {
            self.q[i][n + 1] = next(n, self.q_d[i][n]);
            self.q_d[i][n + 1] = next(n, self.q_dd[i][n]);
        }
    }

    #[inline(always)]
    fn error_scale(&self) -> f64 {
        let largest = |pair: &[Series; 2]| f64::max(pair[0][0].abs(), pair[1][0].abs());
        (largest(&self.q_d) + self.p.omega_n * largest(&self.q)) / self.p.l
    }

    #[inline(always)]
    fn coefficient_norm(&self, n: usize) -> f64 {
        f64::max(self.q_d[0][n].abs(), self.q_d[1][n].abs()) / self.p.l
    }

    #[inline(always)]
    fn dissipation(&mut self, n: usize, ramp: bool) -> f64 {
        let Pendulum { l, c, s, .. } = self.p;
        let ([x, y], [x_d, y_d]) = (&self.q, &self.q_d);
        self.rise[n] = mul(n, x, x_d) + mul(n, y, y_d);
        if ramp {
            // This uses q.(d q') = d (q.q'), where d is the drag coefficient.
            self.drag_rise[n] = mul(n, x, &self.drag[0]) + mul(n, y, &self.drag[1]);
        }
        let power = if ramp {
            let horizontal = mul(n, &self.drag[0], x_d) + mul(n, &self.drag[1], y_d);
            (horizontal, mul(n, &self.drag_rise, &self.rise))
        } else {
            (square(n, x_d) + square(n, y_d), square(n, &self.rise))
        };
        c * (power.0 + s * power.1 / (l * l))
    }

    #[inline(always)]
    fn mass_height(&mut self, n: usize, hub: &HubMotion) -> f64 {
        let Pendulum { m, l, r, spring, .. } = self.p;
        self.q2[n] = square(n, &self.q[0]) + square(n, &self.q[1]);
        let place = |j: usize| [constant(j, r) + self.q[0][j], self.q[1][j]];
        m / l * (self.q2[n] / 2.0 + spring * square(n, &self.q2) / 4.0)
            + m * hub.tilt.height(n, place)
    }

    #[inline(always)]
    fn coordinates_at(&self, n: usize, t: f64, _: f64, _: bool) -> [f64; 4] {
        let ([x, y], [x_d, y_d]) = (&self.q, &self.q_d);
        values([x, y, x_d, y_d], n, t)
    }

    fn height<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let Pendulum { m, l, spring, .. } = self.p;
        let [[x, y], rate] = [&self.q, &self.q_d].map(pair::<T>);
        let (q2, rise) = (x * x + y * y, x * rate[0] + y * rate[1]);
        let place = [number(&self.arm), y];
        let tilted = hub.tilt.height_now(place, rate, number(&hub.omega));
        let height = q2 * 0.5 + q2 * q2 * spring * 0.25;
        let height_d = rise + q2 * rise * spring;
        [height * (m / l) + tilted[0] * m, height_d * (m / l) + tilted[1] * m]
    }

    /// Returns the radial and the tangential force of the slosh mass on the tank, N, which is minus its mass times its
    /// acceleration. It is -m (q'' - a - w' (y, -(r + x))), where q = (x, y) is the position of the slosh mass m relative to
    /// its hinge, r the distance of the hinge from the bearing axis, w the rate of the hub, and a the Coriolis and
    /// centrifugal acceleration.
    fn force<T: Number>(&self, hub: &HubMotion) -> [T; 2] {
        let (wd, y, arm) =
            (number::<T>(&hub.omega_dot), number::<T>(&self.q[1]), number::<T>(&self.arm));
        let euler = [wd * y, -wd * arm];
        let [q_dd, a] = [&self.q_dd, &self.a].map(pair::<T>);
        [0, 1].map(|i| -((q_dd[i] - a[i] - euler[i]) * self.p.m))
    }

    fn torque<T: Number>(&self, hub: &HubMotion) -> T {
        let [f_x, f_y]: [T; 2] = self.force(hub);
        number::<T>(&self.arm) * f_y - number::<T>(&self.q[1]) * f_x
    }

    fn energy<T: Number>(&self, hub: &HubMotion) -> T {
        let Pendulum { m, l, spring, s, .. } = self.p;
        let ([x, y], [x_d, y_d]) = (pair::<T>(&self.q), pair::<T>(&self.q_d));
        let (w, arm, l) = (number::<T>(&hub.omega), number::<T>(&self.arm), T::constant(l));
        let ([e_x, e_y], [g, _]) = (hub.tilt.now::<T>(), self.p.restoring_and_drag::<T>());
        let (v_x, v_y) = (x_d - w * y, y_d + w * arm);
        let v_z = (x * x_d + y * y_d) / l;
        let q2 = x * x + y * y;
        (v_x * v_x + v_y * v_y + v_z * s * v_z) * m * 0.5
            + g * m / l * (q2 * 0.5 + q2 * spring * q2 * 0.25)
            - (e_x * arm + e_y * y) * m
    }

    fn momentum<T: Number>(&self, hub: &HubMotion) -> T {
        let ([_, y], [x_d, y_d]) = (pair::<T>(&self.q), pair::<T>(&self.q_d));
        let arm = number::<T>(&self.arm);
        (number::<T>(&hub.omega) * (arm * arm + y * y) + arm * y_d - y * x_d) * self.p.m
    }

    fn out_of_range(&self, q: &[f64; 4]) -> Option<&'static str> {
        let q2 = q[0] * q[0] + q[1] * q[1];
        let Pendulum { l, spring, .. } = self.p;
        if q2 >= l * l {
            Some("its mass has moved by its length l, where the surface is at 45 degrees")
        } else if spring * q2 < -0.9 {
            Some("its wave is too high for a softening spring")
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The range ends at a displacement of one pendulum length, or at a smaller displacement where only a tenth of a
    /// softening spring's stiffness is left.
    #[test]
    fn the_third_order_model_ends_at_a_displacement_of_one_length_or_at_a_tenth_of_its_stiffness() {
        let outside = |spring: f64, q: [f64; 2]| {
            let mode = ThirdOrder::new(&Pendulum { spring, ..Pendulum::default() });
            mode.out_of_range(&[q[0], q[1], 0.0, 0.0]).is_some()
        };
        for (spring, ends) in [(0.0, 1.0), (-2.0, 0.45), (2.0, 1.0)] {
            let at = |share: f64| [0.6, 0.8].map(|x| x * libm::sqrt(share * ends));
            assert!(!outside(spring, at(0.999)), "{spring}");
            assert!(outside(spring, at(1.001)), "{spring}");
        }
    }
}

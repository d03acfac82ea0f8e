//! One slosh mode that is a pendulum: a bob (slosh mass) at the end of a rod, which can swing about a hinge on the tank's
//! axis in every direction, also upwards.
//!
//! ```text
//! m  mass, l  length, e  the tank's axis, P  the hinge from O, p  unit vector from hinge to bob
//! c  drag -c l p' on the bob (its velocity against the tank), kg/s (`damping.rs`)
//! k  centring potential k l^2 |p_perp|^2/2, p_perp = p - e (e.p), N/m
//! B = a + w' x P + w x (w x P)     specific force at the hinge
//! T  tension of the rod, > 0 when it pulls the bob to the hinge
//! ```
//!
//! The motion is expanded in p and in v = p' + w x p, the bob's velocity relative to the hinge divided by l, both
//! relative to inertial axes. In these variables Newton's law is a polynomial, and w' occurs only in B, the specific
//! force at the hinge:
//!
//! ```text
//! p' = v - w x p
//! v' = -w x v - B/l - T/(m l) p - (c/m) p' - (k/m) p_perp
//! T  = m (l |v|^2 - p.B) - k l |p_perp|^2                        (keeps |p| = 1 and p.v = 0)
//! ```
//!
//! The bob acts on the craft with T p at the hinge and with phi = c l p' + k l p_perp at the bob, the reaction
//! of drag and centring:
//!
//! ```text
//! F = T p + phi,   moment about O = P x F + l p x phi
//! ```
//!
//! Source: Newton's second law, from which the tension as the constraint force is eliminated. All vectors are in body axes.
//! tests/craft/independent.rs checks the equations against an independent formulation in p''.

use taylor::number::Number;
use taylor::series::{self, Series, ZERO};
use taylor::space::{self, Pair, Vector, ZERO_PAIR, ZERO_VECTOR};
use taylor::vector::{
    Mat3, Vec3, add, constant, cross, dot, largest, on_sphere, on_sphere_slope, rotation, scale,
    sub, times, transposed_times, unit_quaternion,
};

use crate::damping::Drag;
use crate::parameters::Tank;

/// Values of one bob for the outputs, body axes: position `rho` from O and velocity relative to the tank, hinge from O,
/// direction of the tank's axis, and p in tank axes. `centring` is the energy of the centring stiffness, J. `spin` is the
/// angular momentum that the bob has in addition to a point mass; `None` if it has none.
pub(crate) struct BobNow<T> {
    pub m: T,
    pub rho: Vec3<T>,
    pub rate: Vec3<T>,
    pub hinge: Vec3<T>,
    pub e: Vec3,
    pub in_tank: Vec3<T>,
    pub wave: f64,
    pub centring: T,
    pub spin: Option<Vec3<T>>,
}

/// One bob that is a pendulum: its parameters and the power series of its motion, in body axes. `tank` and `mode` count
/// from 0. `follows` is true if the drag coefficient c depends on acceleration or amplitude, so that c and c p' are power
/// series. The fields after the series are the terms of the current order that do not depend on [a; w'] of this order.
#[derive(Clone, Debug)]
pub struct Bob {
    pub tank: usize,
    pub mode: usize,
    pub m: f64,
    pub l: f64,
    c: f64,
    k: f64,
    follows: bool,
    drag: Drag,
    dragged: Vector,
    c_m: f64,
    k_m: f64,
    inv_l: f64,
    e: Vec3,
    pub hinge: Vec3,
    pub wave: f64,
    axes: Mat3,
    pub p: Vector,
    v: Vector,
    both: Pair,
    p_d: Vector,
    v_d: Vector,
    /// The specific force B at the hinge, m/s^2, body axes.
    pub specific_force: Vector,
    tension: Series,
    height: Series,
    turned: [[f64; 2]; 3],
    centripetal: Vec3,
    p_perp: Vec3,
    known_tension: f64,
    known: Vec3,
    slope: Vec3,
}

impl Bob {
    /// Creates the bob of mode `mode` of tank number `index`, which both count from 0.
    pub fn new(tank: &Tank, index: usize, mode: usize) -> Bob {
        let axes = rotation(&unit_quaternion(tank.q));
        let e = axes.map(|row| row[2]);
        let (m, l, k, c) = (tank.mass[mode], tank.length[mode], tank.k[mode], tank.drag(mode));
        let (hinge, _) = tank.hinge_and_across(mode);
        Bob {
            tank: index,
            mode,
            m,
            l,
            c,
            k,
            follows: tank.follows(mode),
            drag: Drag::new(tank, mode),
            dragged: ZERO_VECTOR,
            c_m: c / m,
            k_m: k / m,
            inv_l: 1.0 / l,
            e,
            hinge,
            wave: tank.wave[mode],
            axes,
            p: ZERO_VECTOR,
            v: ZERO_VECTOR,
            both: ZERO_PAIR,
            p_d: ZERO_VECTOR,
            v_d: ZERO_VECTOR,
            specific_force: ZERO_VECTOR,
            tension: ZERO,
            height: ZERO,
            turned: [[0.0; 2]; 3],
            centripetal: [0.0; 3],
            p_perp: [0.0; 3],
            known_tension: 0.0,
            known: [0.0; 3],
            slope: [0.0; 3],
        }
    }

    /// Starts an expansion at the bob's direction and rate `x` (six numbers in tank axes), which are normalised first, while
    /// the craft rotates with the angular velocity `w`.
    #[inline(always)]
    pub fn start(&mut self, x: &[f64; 6], w: Vec3) {
        let p = times(&self.axes, [x[0], x[1], x[2]]);
        let p_d = times(&self.axes, [x[3], x[4], x[5]]);
        let [p, p_d] = on_sphere(p, p_d);
        self.p[0] = p;
        self.v[0] = add(p_d, cross(w, p));
        self.both.set(0, p, self.v[0]);
    }

    /// Sets coefficient 1 of direction and velocity to their derivatives for a change of the bob's states by `dx` and of the
    /// angular velocity by `dw`, for directional derivatives.
    pub fn seed_direction(&mut self, x: &[f64; 6], dx: &[f64; 6], w: Vec3, dw: Vec3) {
        let body = |x: &[f64], i: usize| times(&self.axes, [x[i], x[i + 1], x[i + 2]]);
        let [dp, dp_d] = on_sphere_slope(body(x, 0), body(x, 3), body(dx, 0), body(dx, 3));
        self.p[1] = dp;
        self.v[1] = add(dp_d, add(cross(dw, self.p[0]), cross(w, dp)));
        self.both.set(1, dp, self.v[1]);
    }

    /// Returns the bob's direction and rate, normalised, in tank axes, at the time `t` after the start of the expansion,
    /// from the series up to order n. `x` are direction and rate at the start, and `w` is the craft's angular velocity
    /// at the time `t`.
    ///
    /// Only the change since the start is rotated from body axes into tank axes. The rotation matrix is orthogonal only to
    /// rounding, so that rotating the whole vector to body axes and back would distort it by the same 1e-16 in every step.
    #[inline(always)]
    pub fn state_at(&self, x: &[f64; 6], n: usize, t: f64, w: Vec3) -> [f64; 6] {
        let [p, v] = self.both.value(n, t);
        let p_d = sub(v, cross(w, p));
        let dp = transposed_times(&self.axes, sub(p, self.p[0]));
        let dp_d = transposed_times(&self.axes, sub(p_d, self.p_d[0]));
        let [p, p_d] = on_sphere(
            [x[0] + dp[0], x[1] + dp[1], x[2] + dp[2]],
            [x[3] + dp_d[0], x[4] + dp_d[1], x[5] + dp_d[2]],
        );
        [p[0], p[1], p[2], p_d[0], p_d[1], p_d[2]]
    }

    /// Returns coefficient N of the power series of force and torque about O with which the bob acts on the craft. The
    /// terms that contain coefficient N of the accelerations [a; w'] are left out, because the mass matrix contains
    /// them. `w` is the pair (w, w), and `w2` is coefficient N of the matrix of the map y -> w x (w x y).
    #[inline(always)]
    pub fn reaction<const N: usize>(&mut self, w: &Pair, w2: &Mat3) -> [Vec3; 2] {
        let Bob { m, l, c, k, .. } = *self;
        self.turned = space::cross_pair::<N>(w, &self.both);
        let p_d = [0, 1, 2].map(|i| self.v[N][i] - self.turned[i][0]);
        self.p_d[N] = p_d;
        self.centripetal = times(w2, self.hinge);
        let mut tension = l * space::square_vector::<N>(&self.v)
            - space::dot_tail::<N>(&self.p, &self.specific_force)
            - dot(self.p[0], self.centripetal);
        let (mut reaction, mut twist) = ([0.0; 3], [0.0; 3]);
        if self.follows {
            self.set_drag::<N>();
            reaction = scale(l, self.dragged[N]);
            twist = scale(l, space::cross::<N>(&self.p, &self.dragged));
        } else if c > 0.0 {
            reaction = scale(c * l, p_d);
            twist = scale(c * l, space::cross::<N>(&self.p, &self.p_d));
        }
        if k > 0.0 {
            self.height[N] = dot(self.e, self.p[N]);
            self.p_perp = sub(self.p[N], scale(self.height[N], self.e));
            // |p_perp|^2 = 1 - (p.e)^2. At order 0 this form avoids cancellation near rest.
            let off_axis_2 = if N == 0 {
                dot(self.p_perp, self.p_perp)
            } else {
                -series::square(N, &self.height)
            };
            tension -= self.k_m * l * off_axis_2;
            reaction = add(reaction, scale(k * l, self.p_perp));
            let around = cross(self.e, space::scale::<N>(&self.height, &self.p));
            twist = add(twist, scale(k * l, around));
        }
        self.known_tension = tension;
        let pulled = space::scale_head::<N>(&self.tension, &self.p);
        self.known = add(pulled, scale(tension, self.p[0]));
        let force = add(scale(m, self.known), reaction);
        [force, add(cross(self.hinge, force), scale(l, twist))]
    }

    /// Sets coefficient N of the specific force at the hinge along the tank's axis, on which the drag depends.
    #[inline(always)]
    pub fn set_axial<const N: usize>(&mut self, x: f64) {
        self.drag.set_axial(N, x);
    }

    pub fn follows(&self) -> bool {
        self.follows
    }

    /// Returns the unit vector e of the tank's axis, and its moment P x e about the origin O, where
    /// P is the position of the hinge. The scalar product of these six numbers with the craft's
    /// accelerations [a; w'] is their contribution to the acceleration of the hinge along the axis.
    pub fn along_axis(&self) -> [Vec3; 2] {
        [self.e, cross(self.hinge, self.e)]
    }

    pub fn at_rest(&self) -> Vec3 {
        sub(self.hinge, scale(self.l, self.e))
    }

    #[inline(never)]
    fn set_drag<const N: usize>(&mut self) {
        self.height[N] = dot(self.e, self.p[N]);
        // |p + e|^2 = 2 + 2 p.e. At order 0 this form avoids cancellation near rest.
        let chord2 = if N == 0 {
            let chord = add(self.p[0], self.e);
            dot(chord, chord)
        } else {
            2.0 * self.height[N]
        };
        self.drag.expand(N, chord2, space::square_vector::<N>(&self.p_d));
        self.dragged[N] = space::scale::<N>(&self.drag.c, &self.p_d);
    }

    /// Sets coefficient N of the rod's tension and of the drag, and coefficient N + 1 of the bob's
    /// direction and velocity, from coefficient N of the craft's accelerations [a; w'].
    #[inline(always)]
    pub fn accelerate<const N: usize>(&mut self, a: Vec3, w_d: Vec3) {
        let at_hinge = add(a, cross(w_d, self.hinge));
        self.specific_force[N] = add(at_hinge, self.centripetal);
        let along = dot(self.p[0], at_hinge);
        self.tension[N] = self.known_tension - along;
        let pulled = sub(self.known, scale(along, self.p[0]));
        let fall = scale(self.inv_l, add(self.specific_force[N], pulled));
        let mut v_d = [0, 1, 2].map(|i| -self.turned[i][1] - fall[i]);
        if self.follows {
            v_d = sub(v_d, scale(1.0 / self.m, self.dragged[N]));
        } else if self.c > 0.0 {
            v_d = sub(v_d, scale(self.c_m, self.p_d[N]));
        }
        if self.k > 0.0 {
            v_d = sub(v_d, scale(self.k_m, self.p_perp));
        }
        self.v_d[N] = v_d;
        self.both.set_next(N, [0, 1, 2].map(|i| [self.p_d[N][i], v_d[i]]));
        [self.p[N + 1], self.v[N + 1]] = self.both.get(N + 1);
    }

    #[inline(always)]
    pub fn dissipation<const N: usize>(&self) -> f64 {
        if self.follows {
            let power =
                space::dot_tail::<N>(&self.p_d, &self.dragged) + dot(self.p_d[0], self.dragged[N]);
            self.l * self.l * power
        } else if self.c > 0.0 {
            self.c * self.l * self.l * space::square_vector::<N>(&self.p_d)
        } else {
            0.0
        }
    }

    /// Returns coefficient N of the derivatives of the bob's six states in tank axes: p' of the direction p, and p'' = v' -
    /// w' x p - w x p' of the rate. After [`Bob::seed_direction`] coefficient 1 is the directional derivative.
    pub fn rates<const N: usize>(&self, w: &Vector, w_d: &Vector) -> [f64; 6] {
        let turned = add(space::cross::<N>(w_d, &self.p), space::cross::<N>(w, &self.p_d));
        let p_dd = sub(self.v_d[N], turned);
        let p_d = transposed_times(&self.axes, self.p_d[N]);
        let p_dd = transposed_times(&self.axes, p_dd);
        [p_d[0], p_d[1], p_d[2], p_dd[0], p_dd[1], p_dd[2]]
    }

    /// Returns an estimate of the magnitude of the bob's velocity v, 1/s, to which the allowed
    /// error of v is relative: the present rate of the bob's direction, plus the natural frequency
    /// times the sine of the slosh angle.
    #[inline(always)]
    pub fn rate_scale(&self) -> f64 {
        let stiffness = largest(self.specific_force[0]) * self.inv_l + self.k_m;
        let off_axis = cross(self.e, self.p[0]);
        largest(self.p_d[0]) + libm::sqrt(stiffness) * largest(off_axis)
    }

    /// Estimates the time, s, over which the series of the drag converges reliably, from
    /// coefficients 0 to 2.
    pub fn convergence_radius(&self) -> f64 {
        if self.follows { self.drag.convergence_radius() } else { f64::INFINITY }
    }

    /// Returns the error, 1/s, of the bob's velocity v at the time `h`, s, after the start of the
    /// expansion. The error arises because the series of the drag end at order n.
    pub fn defect(&self, n: usize, h: f64) -> f64 {
        if !self.follows {
            return 0.0;
        }
        let end = largest(space::value(&self.p_d, n - 1, h));
        let rate = f64::max(largest(self.p_d[0]) + largest(self.p_d[1]) * h, end);
        self.drag.defect(n - 1, h) * rate * h
    }

    /// Stores v', the derivative of the bob's velocity v, at `h`, s, after the start of the
    /// expansion, from the series up to order n. [`Bob::slope_defect`] compares it with v' at the
    /// start of the next expansion.
    pub fn store_slope(&mut self, n: usize, h: f64) {
        self.slope = space::value(&self.v_d, n - 1, h);
    }

    /// Returns the error of the series at the end of the last expansion, 1/s^2: the derivative v'
    /// that [`Bob::store_slope`] has stored minus v' at the start of the present expansion.
    pub fn slope_defect(&self) -> f64 {
        largest(sub(self.slope, self.v_d[0]))
    }

    #[inline(always)]
    pub fn coefficient_norm(&self, n: usize) -> f64 {
        largest(self.v[n])
    }

    fn state<T: Number>(&self) -> [Vec3<T>; 3] {
        let number = |a: &Vector| [0, 1, 2].map(|i| T::with_slope(a[0][i], a[1][i]));
        [number(&self.p), number(&self.p_d), number(&self.specific_force)]
    }

    /// Returns the force of the bob on the craft and its torque about O, both in body axes.
    pub fn wrench<T: Number>(&self) -> [Vec3<T>; 2] {
        let [p, p_d, _] = self.state::<T>();
        let tension = T::with_slope(self.tension[0], self.tension[1]) * self.m;
        self.at_hinge_and_bob(tension, p, p_d)
    }

    /// Returns the force of the bob on the craft and its torque about O, for the craft's angular
    /// velocity `w`, if the specific force a at O and the angular acceleration w' are 0.
    pub fn bias<T: Number>(&self, w: Vec3<T>) -> [Vec3<T>; 2] {
        let [p, p_d, _] = self.state::<T>();
        let v = add(p_d, cross(w, p));
        let p_perp = self.perpendicular(p);
        let centripetal = cross(w, cross(w, constant(self.hinge)));
        let tension = (dot(v, v) * self.l - dot(p, centripetal)) * self.m
            - dot(p_perp, p_perp) * (self.k * self.l);
        self.at_hinge_and_bob(tension, p, p_d)
    }

    fn perpendicular<T: Number>(&self, p: Vec3<T>) -> Vec3<T> {
        let e = constant(self.e);
        sub(p, scale(dot(e, p), e))
    }

    fn at_hinge_and_bob<T: Number>(&self, tension: T, p: Vec3<T>, p_d: Vec3<T>) -> [Vec3<T>; 2] {
        let p_perp = self.perpendicular(p);
        let c = match self.follows {
            true => T::with_slope(self.drag.c[0], self.drag.c[1]),
            false => T::constant(self.c),
        };
        let phi = [0, 1, 2].map(|i| (p_d[i] * c + p_perp[i] * self.k) * self.l);
        let force = add(scale(tension, p), phi);
        let twist = cross(p, phi).map(|x| x * self.l);
        [force, add(cross(constant(self.hinge), force), twist)]
    }

    pub fn now<T: Number>(&self) -> BobNow<T> {
        let [p, p_d, _] = self.state::<T>();
        let p_perp = self.perpendicular(p);
        BobNow {
            m: T::constant(self.m),
            rho: add(constant(self.hinge), p.map(|x| x * self.l)),
            rate: p_d.map(|x| x * self.l),
            hinge: constant(self.hinge),
            e: self.e,
            in_tank: transposed_times(&self.axes.map(constant), p),
            wave: self.wave,
            centring: dot(p_perp, p_perp) * (0.5 * self.k * self.l * self.l),
            spin: None,
        }
    }

    /// Updates the rate p' of the bob's direction for an impulse that changes the velocity of O by `dv` and the angular
    /// velocity by `dw`, both in body axes. The bob keeps its velocity across the rod, so that l p' changes by -(1 - p
    /// p^T)(dv + dw x rho). `x` has the bob's six states at the start of the expansion.
    pub fn after_impulse(&self, x: &mut [f64; 6], dv: Vec3, dw: Vec3) {
        let p = self.p[0];
        let rho = add(self.hinge, scale(self.l, p));
        let kick = add(dv, cross(dw, rho));
        let across = sub(kick, scale(dot(p, kick), p));
        let change = transposed_times(&self.axes, scale(-self.inv_l, across));
        for i in 0..3 {
            x[3 + i] += change[i];
        }
    }
}

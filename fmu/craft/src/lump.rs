//! The "ball" regime: liquid that has left the bottom of its tank, modelled as one body.
//!
//! If thrust reverses, or if the bobs pass 45 degrees (mean cosine of their angles by modal mass), no pendulum represents
//! the liquid. With `ball.travel` > 0 all liquid of the tank then becomes one body, the lump. The centre of the lump flies
//! freely, bounces off the wall with losses and slides on it. When the lump comes to rest at the bottom, the pendulums take
//! over the liquid again.
//!
//! **Surface that the liquid's centre can reach.** The centre of liquid at rest under a specific force of any direction lies
//! on the tank's surface of centres of buoyancy, where the surface is perpendicular to the force. The radius of curvature of
//! this surface is I/V, the second moment of the free surface divided by the volume of the liquid (Dupin 1822, as in the
//! theory of ships). A mass point that slides on this surface rests where the liquid's centre rests, with the same energy.
//! For a spherical tank the surface is a sphere about the tank's centre on which the centre of the settled liquid lies. For
//! any other tank the model uses an ellipsoid of revolution about the tank's axis, through the liquid's centres at the
//! bottom and at the top:
//!
//! ```text
//! f = 1 - x.D x >= 0,   D = diag(1/b^2, 1/b^2, 1/a^2) in tank axes,   x from the surface's centre
//! z_s = (m_0 H_0 + sum of m (h - l))/m_liq      lower pole: the settled liquid's centre
//! a   = travel/2,   b^2 = a R_p or more,   R_p = sum of m l/m_liq
//! ```
//!
//! With b^2 = a R_p the surface has at the bottom the curvature of the path of the pendulums' common centre; the radius
//! of this path is I/V if all modes are modelled. For R_p <= a the pendulums' centre, on a sphere of radius R_p, then
//! lies within the surface in every direction: f = q (1 - c)^2 (1 - q), where q = R_p/a and c is the cosine of the
//! angle from the axis.
//!
//! **Motion.** The velocity of the lump is u = x' + w x rho, with rho from O; n is the normal outwards. The lump has
//! the inertia of the shape in which the liquid left the bottom. This inertia, J_a, rotates with the tank as a part of
//! the craft without mass.
//!
//! ```text
//! x' = u - w x rho
//! u' = -a - w x u - F/m                  F = N G + m d x' on the craft at rho, G = D x; 0 in flight
//! N  = (m/G.G) [x'.D x' - G.(a + w' x rho + w x (u + x'))]       keeps f = 0 while it slides, N > 0
//! ```
//!
//! The reaction of the drag may push the wall away from the lump. If the lump would leave the wall with drag, but stay on it
//! without drag, the model sets the drag to 0 until the wall force exceeds twice the drag.
//!
//! Like a rod, the wall adds a matrix of rank one to the craft's mass matrix, because N is affine in [a; w'], with
//! the slope -m G.(..)/G.G.
//!
//! **Impact** at the speed v_n = n.x': impulse J = (1 + e) mu v_n along n, 1/mu = 1/m + U.M^-1 U, U = [n; rho x n],
//! with M of the craft and everything attached to it. Momentum is conserved, and (1 - e^2) mu v_n^2/2 is dissipated. A
//! lump that is pressed to the wall and leaves an impact below `ball.contact_speed` stays on the wall (e = 0), which
//! ends a sequence of bounces.
//!
//! **Hand-over.** If the liquid leaves the bottom or returns to it, each part of the liquid keeps its momentum until the
//! body that it joins catches it plastically. Linear and angular momentum and the centre of mass of the whole are therefore
//! conserved, and energy is lost (Carnot). When the liquid leaves, its motions relative to its centre end. When it returns,
//! the tank catches m_0, and the bobs keep the motion that their rods allow. The pendulums take over the liquid only if
//! |p_perp|^2 + |x'|^2/(g l_s) <= sin^2 30 deg, 1/l_s = sum of (m/l)/sum of m. The left side is the mean over the modes, by
//! modal mass, of the energy that each mode takes over, so that the mean cosine stays far above cos 45 degrees. A hand-over
//! may raise the energy through the centring stiffness, or because the shape changes while the craft rotates. In this case
//! it waits until the lump is nearest to the axis.
//!
//! **Validity.** Times and momenta of crossings are valid, impacts only to an order of magnitude. The model does not
//! represent wall pressure, sprays, films or the liquid's path along the wall. The coefficient of restitution e and the drag
//! d are guesses unless they were measured.

use taylor::number::Number;
use taylor::root::first_root;
use taylor::series::{self, ORDER, Series, ZERO};
use taylor::space::{self, Vector, ZERO_VECTOR};
use taylor::vector::{
    Mat3, Vec3, add, constant, cross, dot, largest, part, rotation, scale, sub, times,
    transposed_times, unit_quaternion,
};

use crate::bob::{Bob, BobNow};
use crate::parameters::Tank;
use crate::rigid::{Factors, Rigid, along_rod};
use crate::sizes::MODES;
use crate::state::BallState;

/// Cosine of the largest angle from the axis at which a bob represents liquid.
pub(crate) const COS_45: f64 = core::f64::consts::FRAC_1_SQRT_2;

/// Largest coefficient, m, of the power series of the detached liquid's position that may be squared without overflow.
const LARGEST_COEFFICIENT: f64 = 1e75;
const TOUCHING: f64 = 1e-10;
const RESTING: f64 = 1e-9;
/// Detached liquid on the wall counts as pressed to the wall if the second derivative of f, the
/// function that describes the wall, exceeds this fraction of the terms of its sum. Smaller values
/// may be rounding errors.
const PRESSING: f64 = 1e-9;
/// Distance in time, relative to the time of an event, between the two points from which the slope of the event's function is
/// computed.
const NEAR: f64 = 1e-6;
/// Largest change of an event's time in one iteration of [`Lump::polish`], relative to this time.
const FAR: f64 = 0.1;
const ITERATIONS: usize = 4;
/// Square of the sine of the largest slosh angle, 30 degrees, at which the pendulums may take over detached liquid.
const SWING: f64 = 0.25;

/// Event of the liquid of a tank: it leaves the bottom, hits the wall, is no longer pressed to the wall (`Release`), is
/// pressed to the wall strongly enough for drag to act (`Drag`), or is taken over by the pendulums (`Settle`). At `Look` one
/// of several conditions for settling is fulfilled, so that the others have to be checked again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Due {
    Leave,
    Impact,
    Release,
    Drag,
    Settle,
    Look,
}

/// Kind of a function of time that crosses zero at an event of the liquid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Crossing {
    Exact, // wall force or mean cosine of the bobs, whose series are as exact as the motion's
    Contact,
    Axial,   // specific force along the axis minus its lower limit
    Passage, // half of the derivative of the squared distance from the axis
    Excess,  // wall force minus the force above which drag acts
    Settling(usize),
}

pub(crate) type Directions = [Vec3; MODES];

/// The detached liquid of one tank and the power series of its motion, body axes (symbols of the
/// module's head).
#[derive(Clone, Debug)]
pub(crate) struct Lump {
    pub tank: usize,
    /// State of the liquid, such as sliding on the wall, at the start of the present expansion.
    pub state: BallState,
    pub m: f64,
    restitution: f64,
    contact_speed: f64,
    drag: f64,  // d, 1/s
    axes: Mat3, // from tank axes to body axes
    e: Vec3,
    origin: Vec3,
    height: f64, // of the centre of the surface that the liquid can reach
    center: Vec3,
    half: f64,   // semi-axis of this surface along the axis
    radius: f64, // semi-axis of this surface across the axis
    d: Mat3,
    gyration: f64, // R_p
    hinge: Vec3,
    shares: [f64; MODES], // of the modes in the modal mass
    swing_length: f64,    // l_s
    pub rigid: Rigid,
    m_0: f64,
    s: Vec3,
    own: Mat3,
    modes: usize,
    masses: [f64; MODES],
    lengths: [f64; MODES],
    hinges: [Vec3; MODES],
    lowest: f64, // specific force along the axis below which the liquid leaves the bottom
    floor: f64,  // specific force along the axis above which it returns

    x_0: Vec3,
    rho: Vector,
    u: Vector,
    x_d: Vector,
    normal: Vector,
    squared: Series,
    pull: Series,
    force: Vector,
    specific: Vector,
    sum: Vector,
    turned: Vector,
    u_turned: Vec3,
    /// Directional derivative of J_a, the inertia of the liquid about its centre, kg m2, body axes;
    /// 0 if the expansion is in time.
    pub shape_slope: Mat3,
    known_pull: f64,
    known_force: Vec3,
    known_specific: Vec3,
}

fn dots(a: &Vector, b: &Vector, first: usize, n: usize) -> f64 {
    (first..=n).map(|k| dot(a[k], b[n - k])).sum()
}

fn crosses(b: &Vector, a: &Vector, first: usize, n: usize) -> Vec3 {
    (first..=n).fold([0.0; 3], |sum, k| add(sum, cross(b[n - k], a[k])))
}

fn scaled(s: &Series, a: &Vector, first: usize, n: usize) -> Vec3 {
    (first..=n).fold([0.0; 3], |sum, k| add(sum, scale(s[n - k], a[k])))
}

fn product(a: &Series, b: &Series, n: usize) -> f64 {
    (0..=n).map(|k| a[k] * b[n - k]).sum()
}

impl Lump {
    /// Creates the detached liquid of tank number `index`, which counts from 0. `tank` must be the result of
    /// [`Tank::resolve`]. Returns `None` if the tank has no model of detached liquid.
    pub fn new(tank: &Tank, index: usize) -> Option<Lump> {
        let surface = tank.ball_surface()?;
        let axes = rotation(&unit_quaternion(tank.q));
        let e = axes.map(|row| row[2]);
        let on_axis = |z: f64| add(tank.position, scale(z, e));
        let (a, b) = (surface.half, surface.radius);
        let (across, along) = (1.0 / (b * b), 1.0 / (a * a));
        let mut d = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let one = if i == j { across } else { 0.0 };
                d[i][j] = one + (along - across) * e[i] * e[j];
            }
        }
        let ball = &tank.ball;
        let modal: f64 = tank.mass[..tank.modes].iter().sum();
        let shares =
            core::array::from_fn(|n| if n < tank.modes { tank.mass[n] / modal } else { 0.0 });
        let shorter = (0..tank.modes).map(|n| shares[n] * (tank.length[0] / tank.length[n]));
        let swing_length = tank.length[0] / shorter.sum::<f64>();
        Some(Lump {
            tank: index,
            state: BallState::Settled,
            m: surface.mass,
            restitution: ball.restitution,
            contact_speed: ball.contact_speed,
            drag: ball.drag,
            axes,
            e,
            origin: tank.position,
            height: surface.height,
            center: on_axis(surface.height),
            half: a,
            radius: b,
            d,
            gyration: surface.gyration,
            hinge: on_axis(tank.hinge[0]),
            shares,
            swing_length,
            rigid: tank.rigid(),
            m_0: tank.m_0,
            s: on_axis(tank.h_0),
            own: tank.own_inertia(),
            modes: tank.modes,
            masses: tank.mass,
            lengths: tank.length,
            hinges: tank.hinge.map(on_axis),
            lowest: (0..tank.modes).map(|n| tank.lowest(n)).fold(f64::NEG_INFINITY, f64::max),
            floor: tank.smallest_acceleration(),
            x_0: [0.0; 3],
            rho: ZERO_VECTOR,
            u: ZERO_VECTOR,
            x_d: ZERO_VECTOR,
            normal: ZERO_VECTOR,
            squared: ZERO,
            pull: ZERO,
            force: ZERO_VECTOR,
            specific: ZERO_VECTOR,
            sum: ZERO_VECTOR,
            turned: ZERO_VECTOR,
            u_turned: [0.0; 3],
            shape_slope: [[0.0; 3]; 3],
            known_pull: 0.0,
            known_force: [0.0; 3],
            known_specific: [0.0; 3],
        })
    }

    /// Returns position and velocity (six numbers in tank axes) of the centre of liquid that rests at the bottom.
    pub fn at_rest(&self) -> [f64; 6] {
        [0.0, 0.0, self.height - self.half, 0.0, 0.0, 0.0]
    }

    /// Returns true if the liquid is detached, so that the pendulums are not in use.
    pub fn is_loose(&self) -> bool {
        self.state != BallState::Settled
    }

    fn drag(&self) -> f64 {
        if self.state == BallState::Sliding { self.drag } else { 0.0 }
    }

    /// Returns true if the wall exerts drag on the liquid. Without a drag coefficient (d = 0) it is always false, because
    /// rounding would otherwise make detached liquid alternate between the states `Sliding` and `Light`.
    pub fn drags(&self) -> bool {
        self.drag() > 0.0
    }

    fn slides(&self) -> bool {
        matches!(self.state, BallState::Sliding | BallState::Light | BallState::Held)
    }

    /// Returns mass and position from O of the rigid liquid and of each bob, with the directions `p` of the bobs' rods.
    fn parts(&self, p: &Directions) -> [(f64, Vec3); MODES + 1] {
        core::array::from_fn(|i| match i {
            0 => (self.m_0, self.s),
            _ if i > self.modes => (0.0, [0.0; 3]),
            _ => (self.masses[i - 1], self.bob_at(i - 1, times(&self.axes, p[i - 1]))),
        })
    }

    fn bob_at(&self, n: usize, p: Vec3) -> Vec3 {
        add(self.hinges[n], scale(self.lengths[n], p))
    }

    pub fn common_center(&self, p: &Directions) -> Vec3 {
        let moment = self.parts(p).iter().fold([0.0; 3], |sum, (m, rho)| add(sum, scale(*m, *rho)));
        scale(1.0 / self.m, moment)
    }

    /// Returns the shape of the liquid as a rigid body with the inertia J_a about its own centre. `p` are the directions
    /// of the bobs' rods.
    pub fn shape(&self, p: &Directions) -> Rigid {
        let center = self.common_center(p);
        let around =
            |sum: Mat3, (m, rho): &(f64, Vec3)| Rigid::new(*m, sub(*rho, center), &sum).inertia;
        let inertia = self.parts(p).iter().fold(self.own, around);
        Rigid { mass: 0.0, moment: [0.0; 3], inertia }
    }

    /// Sets the directional derivative of J_a, the inertia of the detached liquid about its centre,
    /// for a change of the directions `p` of the bobs by `dp`.
    pub fn seed_shape(&mut self, p: &Directions, dp: &Directions) {
        let center = self.common_center(p);
        let mut slope = [[0.0; 3]; 3];
        for n in 0..self.modes {
            let arm = sub(self.bob_at(n, times(&self.axes, p[n])), center);
            let moved = scale(self.masses[n] * self.lengths[n], times(&self.axes, dp[n]));
            let both = 2.0 * dot(arm, moved);
            for i in 0..3 {
                for j in 0..3 {
                    let one = if i == j { both } else { 0.0 };
                    slope[i][j] += one - arm[i] * moved[j] - moved[i] * arm[j];
                }
            }
        }
        self.shape_slope = slope;
    }

    /// Returns position and velocity in tank axes (six numbers) of detached liquid whose centre is at `rho` from O and moves
    /// with `rate` relative to the tank.
    pub fn numbers(&self, rho: Vec3, rate: Vec3) -> [f64; 6] {
        let at = transposed_times(&self.axes, sub(rho, self.origin));
        let rate = transposed_times(&self.axes, rate);
        [at[0], at[1], at[2], rate[0], rate[1], rate[2]]
    }

    /// Returns the six states of the detached liquid (position and rate, tank axes) with the position moved onto the wall and the
    /// rate made parallel to the wall.
    fn on_wall(&self, x: &[f64; 6]) -> [f64; 6] {
        let [across, along] = [self.radius, self.half].map(|r| 1.0 / (r * r));
        let at = [x[0], x[1], x[2] - self.height];
        let g = [at[0] * across, at[1] * across, at[2] * along];
        let [at, g] = [at, g].map(|y| scale(1.0 / libm::sqrt(dot(at, g)), y));
        let rate = part(x, 3);
        let rate = sub(rate, scale(dot(g, rate) / dot(g, g), g));
        [at[0], at[1], at[2] + self.height, rate[0], rate[1], rate[2]]
    }

    /// Starts an expansion at the position and rate `x` (six numbers in tank axes) while the craft rotates with `w`. If the
    /// liquid slides, its position is first moved onto the wall and its velocity made parallel to the wall.
    pub fn start(&mut self, x: &[f64; 6], w: Vec3) {
        let x = if self.slides() { self.on_wall(x) } else { *x };
        self.x_0 = times(&self.axes, [x[0], x[1], x[2] - self.height]);
        self.rho[0] = add(self.center, self.x_0);
        self.x_d[0] = times(&self.axes, part(&x, 3));
        self.shape_slope = [[0.0; 3]; 3];
        self.u[0] = add(self.x_d[0], cross(w, self.rho[0]));
    }

    /// Sets coefficient 1 of position and velocity to their derivatives for a change of the six states by `dx` and of the
    /// angular velocity by `dw`. The position of sliding liquid must be on the wall.
    pub fn seed_direction(&mut self, dx: &[f64; 6], w: Vec3, dw: Vec3) {
        let mut at = times(&self.axes, part(dx, 0));
        let mut rate = times(&self.axes, part(dx, 3));
        if self.slides() {
            let g = self.normal[0];
            at = sub(at, scale(dot(g, at), self.x_0));
            let turned = dot(times(&self.d, at), self.x_d[0]);
            rate = sub(rate, scale((turned + dot(g, rate)) / dot(g, g), g));
        }
        self.rho[1] = at;
        self.u[1] = add(rate, add(cross(dw, self.rho[0]), cross(w, at)));
    }

    /// Returns position and rate of the detached liquid (six numbers in tank axes) at `t`, s, after the start of the
    /// expansion, from the series up to order n. `x` are position and rate at the start, and `w` is the craft's angular
    /// velocity at the time `t`.
    pub fn state_at(&self, x: &[f64; 6], n: usize, t: f64, w: Vec3) -> [f64; 6] {
        let (rho, u) = (space::value(&self.rho, n, t), space::value(&self.u, n, t));
        let rate = sub(u, cross(w, rho));
        let moved = transposed_times(&self.axes, sub(rho, self.rho[0]));
        let change = transposed_times(&self.axes, sub(rate, self.x_d[0]));
        let x = if self.slides() { self.on_wall(x) } else { *x };
        let x: [f64; 6] =
            core::array::from_fn(|i| x[i] + if i < 3 { moved[i] } else { change[i - 3] });
        if self.slides() { self.on_wall(&x) } else { x }
    }

    /// Returns coefficient n of the power series of force and torque about O with which the detached liquid acts
    /// on the craft. The terms that contain coefficient n of the accelerations [a; w'] are left out, because the
    /// mass matrix contains them.
    pub fn reaction(&mut self, n: usize, w: &Vector, w_d: &Vector) -> [Vec3; 2] {
        self.x_d[n] = sub(self.u[n], crosses(w, &self.rho, 0, n));
        self.u_turned = crosses(w, &self.u, 0, n);
        (self.known_pull, self.known_force) = (0.0, [0.0; 3]);
        if !self.slides() {
            return [[0.0; 3]; 2];
        }
        self.normal[n] = times(&self.d, if n == 0 { self.x_0 } else { self.rho[n] });
        self.squared[n] = dots(&self.normal, &self.normal, 0, n);
        self.sum[n] = add(self.u[n], self.x_d[n]);
        self.turned[n] = crosses(w, &self.sum, 0, n);
        self.known_specific = crosses(w_d, &self.rho, 1, n);
        let bent: f64 = (0..=n).map(|k| dot(self.x_d[k], times(&self.d, self.x_d[n - k]))).sum();
        let across = bent
            - dots(&self.normal, &self.turned, 0, n)
            - dots(&self.normal, &self.specific, 1, n)
            - dot(self.normal[0], self.known_specific);
        let before: f64 = (1..=n).map(|k| self.squared[k] * self.pull[n - k]).sum();
        self.known_pull = (self.m * across - before) / self.squared[0];
        self.known_force = add(
            add(scaled(&self.pull, &self.normal, 1, n), scale(self.known_pull, self.normal[0])),
            scale(self.m * self.drag(), self.x_d[n]),
        );
        let torque = add(
            cross(self.rho[0], self.known_force),
            scale(-1.0, crosses(&self.force, &self.rho, 1, n)),
        );
        [self.known_force, torque]
    }

    /// Returns the normal n of the wall at sliding liquid and the moment rho x n of the normal about O, at the start of the
    /// expansion. The liquid adds inertia to the craft's mass matrix only in this direction. `None` if it does not slide.
    pub fn along_normal(&self) -> Option<[f64; 6]> {
        self.slides().then(|| along_rod(self.outwards(), self.rho[0]))
    }

    pub fn outwards(&self) -> Vec3 {
        let g = times(&self.d, self.x_0);
        scale(1.0 / libm::sqrt(dot(g, g)), g)
    }

    pub fn position(&self) -> Vec3 {
        self.rho[0]
    }

    pub fn rate(&self) -> Vec3 {
        self.x_d[0]
    }

    /// Sets coefficient n of the forces on the detached liquid, and coefficient n + 1 of its position and velocity, from
    /// coefficient n of the craft's accelerations [a; w'].
    pub fn accelerate(&mut self, n: usize, a: Vec3, w_d: Vec3) {
        let specific = add(a, cross(w_d, self.rho[0]));
        if self.slides() {
            self.specific[n] = add(specific, self.known_specific);
            let pull = -self.m * dot(self.normal[0], specific) / self.squared[0];
            self.pull[n] = self.known_pull + pull;
            self.force[n] = add(self.known_force, scale(pull, self.normal[0]));
        } else {
            (self.pull[n], self.force[n]) = (0.0, [0.0; 3]);
        }
        let fall = add(add(a, self.u_turned), scale(1.0 / self.m, self.force[n]));
        let order = (n + 1) as f64;
        self.u[n + 1] = fall.map(|x| -x / order);
        self.rho[n + 1] = self.x_d[n].map(|x| x / order);
    }

    pub fn dissipation(&self, n: usize) -> f64 {
        let drag = self.drag();
        if drag > 0.0 { self.m * drag * dots(&self.x_d, &self.x_d, 0, n) } else { 0.0 }
    }

    /// Returns coefficient n (0 or 1) of the derivatives of the detached liquid's six states, tank axes: x' of the position
    /// x, and x'' = u' - w' x rho - w x x' of the rate.
    pub fn rates(&self, n: usize, w: &Vector, w_d: &Vector) -> [f64; 6] {
        let u_d = scale((n + 1) as f64, self.u[n + 1]);
        let turned = add(crosses(w_d, &self.rho, 0, n), crosses(w, &self.x_d, 0, n));
        let x_d = transposed_times(&self.axes, self.x_d[n]);
        let x_dd = transposed_times(&self.axes, sub(u_d, turned));
        [x_d[0], x_d[1], x_d[2], x_dd[0], x_dd[1], x_dd[2]]
    }

    /// Returns an estimate of the speed of the detached liquid over the next `t` seconds, m/s, to
    /// which the allowed error of its velocity u is relative. `w` is the angular velocity of the
    /// craft.
    pub fn speed_scale(&self, w: Vec3, t: f64) -> f64 {
        largest(self.x_d[0]) + self.half * largest(w) + largest(self.u[1]) * t
    }

    pub fn coefficient_norm(&self, n: usize) -> f64 {
        largest(self.u[n])
    }

    fn value_and_slope<T: Number>(a: &Vector) -> Vec3<T> {
        [0, 1, 2].map(|i| T::with_slope(a[0][i], a[1][i]))
    }

    pub fn wrench<T: Number>(&self) -> [Vec3<T>; 2] {
        let force = Self::value_and_slope::<T>(&self.force);
        [force, cross(Self::value_and_slope(&self.rho), force)]
    }

    /// Returns the gradient G = D x of the function f that describes the wall, at the position of sliding liquid,
    /// and its square G.G.
    fn gradient<T: Number>(&self) -> (Vec3<T>, T) {
        let g = times(
            &self.d.map(constant),
            sub(Self::value_and_slope(&self.rho), constant(self.center)),
        );
        (g, dot(g, g))
    }

    /// Returns the force of the detached liquid on the craft and its torque about O if the accelerations a and w' are 0. The wall
    /// force N is computed for these accelerations, too.
    pub fn bias<T: Number>(&self, w: Vec3<T>) -> [Vec3<T>; 2] {
        if !self.slides() {
            return [constant([0.0; 3]); 2];
        }
        let (rho, x_d) =
            (Self::value_and_slope::<T>(&self.rho), Self::value_and_slope::<T>(&self.x_d));
        let (g, squared) = self.gradient::<T>();
        let twice = add(add(x_d, x_d), cross(w, rho));
        let bent = dot(x_d, times(&self.d.map(constant), x_d));
        let pull = (bent - dot(g, cross(w, twice))) * squared.recip() * self.m;
        let force = add(scale(pull, g), scale(T::constant(self.m * self.drag()), x_d));
        [force, cross(rho, force)]
    }

    /// Returns the added mass of sliding liquid, (m/G.G) u u^T, as the factor m/G.G and the vector
    /// u = [G; rho x G]. G is the gradient of the function f that describes the wall, and rho is
    /// the liquid's position from O. Returns `None` if the liquid does not slide.
    pub fn added_mass<T: Number>(&self) -> Option<(T, [T; 6])> {
        let (g, squared) = self.gradient::<T>();
        let along = || along_rod(g, Self::value_and_slope::<T>(&self.rho));
        self.slides().then(|| (squared.recip() * self.m, along()))
    }

    pub fn now<T: Number>(&self) -> BobNow<T> {
        BobNow {
            m: T::constant(self.m),
            rho: Self::value_and_slope(&self.rho),
            rate: Self::value_and_slope(&self.x_d),
            hinge: constant(self.hinge),
            e: self.e,
            in_tank: constant([0.0; 3]),
            wave: 0.0,
            centring: T::constant(0.0),
            spin: None,
        }
    }

    /// Updates the rate of the detached liquid after an impulse has changed the velocity of O by `dv` and the angular
    /// velocity of the craft by `dw`. In flight the liquid keeps its velocity; on the wall it keeps only the velocity
    /// component along the wall.
    pub fn after_impulse(&self, x: &mut [f64], dv: Vec3, dw: Vec3) {
        let mut kick = add(dv, cross(dw, self.rho[0]));
        if self.slides() {
            let n = self.outwards();
            kick = sub(kick, scale(dot(n, kick), n));
        }
        let change = transposed_times(&self.axes, kick);
        for i in 0..3 {
            x[3 + i] -= change[i];
        }
    }

    /// Returns the impulse (N s) on the craft and its moment about O if detached liquid hits the wall with its present
    /// normal speed v_n and the coefficient of restitution `e`. `matrix` are the factors of the mass matrix.
    pub fn impulse(&self, matrix: &Factors, e: f64) -> [Vec3; 2] {
        let n = self.outwards();
        let u = [n, cross(self.rho[0], n)];
        let [dv, dw] = matrix.solve(u);
        let mu = 1.0 / (1.0 / self.m + dot(u[0], dv) + dot(u[1], dw));
        u.map(|half| scale((1.0 + e) * mu * self.approach(), half))
    }

    pub fn approach(&self) -> f64 {
        dot(self.outwards(), self.x_d[0]).max(0.0)
    }

    /// Returns the coefficient of restitution, and the speed after an impact, m/s, below which the liquid stays on the wall
    /// if it is pressed to it.
    pub fn restitution(&self) -> (f64, f64) {
        (self.restitution, self.contact_speed)
    }

    pub fn is_pressed(&self) -> bool {
        self.pull[0] > 0.0
    }

    /// Returns the directions of the bobs' rods for which the common centre of the pendulums is nearest
    /// to the detached liquid.
    pub fn hanging(&self) -> Directions {
        let in_tank = transposed_times(&self.axes, self.x_0);
        let [x, y] = [in_tank[0] / self.gyration, in_tank[1] / self.gyration];
        [[x, y, -libm::sqrt((1.0 - x * x - y * y).max(0.0))]; MODES]
    }

    /// Computes the hand-over of detached liquid to rigid liquid and pendulums, in which the tank
    /// catches the liquid. Before it, all parts of the liquid move with the velocity `rate`
    /// relative to the tank; `p` are the directions of the rods. Returns the impulse on the craft
    /// with its moment about O, and the rates p' of the bobs afterwards.
    pub fn caught(&self, p: &Directions, rate: Vec3) -> ([Vec3; 2], Directions) {
        let mut impulse = scale(self.m_0, rate);
        let mut torque = cross(self.s, impulse);
        let mut rates = [[0.0; 3]; MODES];
        for n in 0..self.modes {
            let rod = times(&self.axes, p[n]);
            let along = scale(dot(rod, rate), rod);
            let pulled = scale(self.masses[n], along);
            impulse = add(impulse, pulled);
            torque = add(torque, cross(self.bob_at(n, rod), pulled));
            let across = scale(1.0 / self.lengths[n], sub(rate, along));
            rates[n] = transposed_times(&self.axes, across);
        }
        ([impulse, torque], rates)
    }

    /// Returns the momentum of the bobs' motion relative to the tank and its moment about the liquid's centre `center`, both
    /// divided by the mass of the liquid.
    pub fn stirred(&self, center: Vec3, bobs: impl Iterator<Item = BobNow<f64>>) -> [Vec3; 2] {
        bobs.fold([[0.0; 3]; 2], |[rate, moment], bob| {
            let momentum = scale(bob.m, bob.rate);
            let arm = sub(bob.rho, center);
            [add(rate, scale(1.0 / self.m, momentum)), add(moment, cross(arm, momentum))]
        })
    }

    /// Returns the coefficients of orders below n of the specific force along the tank's axis at the hinge of mode 1.
    fn axial(&self, n: usize, a: &Vector, w: &Vector, w_d: &Vector) -> Series {
        let turned = cross(self.hinge, self.e);
        let height = dot(self.e, self.hinge);
        let mut axial = ZERO;
        for (k, x) in axial.iter_mut().enumerate().take(n) {
            let turning: f64 = (0..=k)
                .map(|i| {
                    dot(self.e, w[i]) * dot(w[k - i], self.hinge) - height * dot(w[i], w[k - i])
                })
                .sum();
            *x = dot(self.e, a[k]) + dot(turned, w_d[k]) + turning;
        }
        axial
    }

    /// Returns the coefficients of orders below n of the three functions that must be positive before the pendulums may take over
    /// the liquid: largest allowed minus expected swing, thrust along the tank, and depth below the centre of the wall's surface.
    /// The second part of each pair is the magnitude of the function's rounding errors.
    fn settling(&self, n: usize, a: &Vector, w: &Vector, w_d: &Vector) -> [(Series, f64); 3] {
        let mut thrust = self.axial(n, a, w, w_d);
        thrust[0] -= self.floor;
        let (mut left, mut depth, mut swing) = (ZERO, ZERO, ZERO);
        for k in 0..n {
            let x = |k: usize| if k == 0 { self.x_0 } else { self.rho[k] };
            depth[k] = -dot(self.e, x(k));
            let across: f64 = (0..=k)
                .map(|i| dot(x(i), x(k - i)) - dot(self.e, x(i)) * dot(self.e, x(k - i)))
                .sum();
            left[k] = -across / (self.gyration * self.gyration);
        }
        left[0] += SWING;
        for k in 0..n {
            swing[k] =
                product(&thrust, &left, k) - dots(&self.x_d, &self.x_d, 0, k) / self.swing_length;
        }
        // Terms from which the magnitudes of rounding errors are estimated: the specific force from all rotations, and the
        // factors of the products.
        let arm = largest(self.hinge);
        let turning = largest(w[0]) * largest(w[0]) + largest(w_d[0]);
        let of_thrust = 1e-10 * self.floor + 1e-12 * (largest(a[0]) + turning * arm);
        let far = SWING + left[0].abs();
        let speed = dot(self.x_d[0], self.x_d[0]) / self.swing_length;
        let of_swing = 1e-10 * (thrust[0].abs() * far + speed) + of_thrust * far;
        [(swing, of_swing), (thrust, of_thrust), (depth, 1e-10 * self.half)]
    }

    /// Returns the next event of the liquid and its time within `h`, s, after the start of the
    /// expansion, from the series up to order n. `motion` has the series of the craft's a, w and
    /// w', and `bobs` are the bobs of the tank.
    pub fn next<'a>(
        &self,
        n: usize,
        h: f64,
        motion: [&Vector; 3],
        bobs: impl Iterator<Item = &'a Bob>,
    ) -> Option<(f64, Due)> {
        let (t, due, crossing) = self.next_crossing(n, h, motion, bobs)?;
        Some((self.polish(t, n, h, motion, crossing), due))
    }

    fn next_crossing<'a>(
        &self,
        n: usize,
        h: f64,
        [a, w, w_d]: [&Vector; 3],
        bobs: impl Iterator<Item = &'a Bob>,
    ) -> Option<(f64, Due, Crossing)> {
        match self.state {
            BallState::Settled => {
                let mut above = self.axial(n, a, w, w_d);
                above[0] -= self.lowest;
                let first = first_root(&above[..n], h);
                let upright = self.upright(bobs, n);
                let second = first_root(&upright[..=n], first.unwrap_or(h));
                match (first, second) {
                    (_, Some(t)) => Some((t, Due::Leave, Crossing::Exact)),
                    (first, None) => first.map(|t| (t, Due::Leave, Crossing::Axial)),
                }
            }
            BallState::Flying => {
                self.next_contact(n, h).map(|t| (t, Due::Impact, Crossing::Contact))
            }
            BallState::Sliding | BallState::Light | BallState::Held => {
                let mut first =
                    first_root(&self.pull[..n], h).map(|t| (t, Due::Release, Crossing::Exact));
                let mut sooner = |due: Option<(f64, Due, Crossing)>| {
                    if let Some((t, ..)) = due
                        && first.is_none_or(|(first, ..)| t < first)
                    {
                        first = due;
                    }
                };
                match self.state {
                    BallState::Held => {
                        sooner(self.next_passage(n, h).map(|t| (t, Due::Settle, Crossing::Passage)))
                    }
                    _ => sooner(self.next_settling(n, h, [a, w, w_d])),
                }
                if self.state == BallState::Light {
                    let rise = rise(&self.excess(n), n, h);
                    sooner(rise.map(|t| (t, Due::Drag, Crossing::Excess)));
                }
                first
            }
        }
    }

    /// Returns an improved time of an event; `t` is the root of the power series of the event's function. Coefficient k of a
    /// product of series is up to 2^k times as large as the coefficients of its factors, so that the product's series up to order
    /// n is less exact than the motion. Therefore the time is corrected with values of the function that are computed from the
    /// motion near the event.
    fn polish(
        &self,
        mut t: f64,
        n: usize,
        h: f64,
        motion: [&Vector; 3],
        crossing: Crossing,
    ) -> f64 {
        if crossing == Crossing::Exact || t <= 0.0 {
            return t;
        }
        let value = |t: f64| {
            let motion = motion.map(|a| space::value(a, n - 1, t));
            self.advanced(n, t).crossing(motion, crossing)
        };
        let root = t;
        for _ in 0..ITERATIONS {
            let (now, before) = (value(t), value(t * (1.0 - NEAR)));
            // Where the function touches zero without crossing it, its slope is 0 and gives no estimate of the time.
            let change = t * NEAR * now;
            if change.abs() > FAR * t * (before - now).abs() || before == now {
                return root;
            }
            let change = change / (before - now);
            t = (t + change).min(h);
            if change.abs() <= NEAR * NEAR * t {
                break;
            }
        }
        t
    }

    /// Returns a copy whose expansion starts at the time `t`: coefficients 0 are the motion at `t` from the series
    /// up to order n.
    fn advanced(&self, n: usize, t: f64) -> Lump {
        let mut then = self.clone();
        then.rho[0] = space::value(&self.rho, n, t);
        then.x_0 = add(self.x_0, sub(then.rho[0], self.rho[0]));
        then.x_d[0] = space::value(&self.x_d, n - 1, t);
        then.pull[0] = series::values([&self.pull], n - 1, t)[0];
        let normal = times(&self.d, then.x_0);
        then.squared[0] = dot(normal, normal);
        then
    }

    fn crossing(&self, motion: [Vec3; 3], crossing: Crossing) -> f64 {
        let [a, w, w_d] = motion.map(|x| {
            let mut vector = ZERO_VECTOR;
            vector[0] = x;
            vector
        });
        match crossing {
            Crossing::Exact => 0.0,
            Crossing::Axial => self.axial(1, &a, &w, &w_d)[0] - self.lowest,
            Crossing::Contact => 1.0 - dot(self.x_0, times(&self.d, self.x_0)),
            Crossing::Passage => {
                dot(sub(self.x_0, scale(dot(self.e, self.x_0), self.e)), self.x_d[0])
            }
            Crossing::Excess => self.excess(1)[0],
            Crossing::Settling(i) => self.settling(1, &a, &w, &w_d)[i].0[0],
        }
    }

    /// Returns the power series, up to order n, of the mean cosine of the bobs' angles from the
    /// tank's axis minus cos 45 degrees. The mean is weighted by the modal masses.
    fn upright<'a>(&self, bobs: impl Iterator<Item = &'a Bob>, n: usize) -> Series {
        let mut upright = ZERO;
        for bob in bobs {
            for (k, x) in upright.iter_mut().enumerate().take(n + 1) {
                *x -= self.shares[bob.mode] * dot(self.e, bob.p[k]);
            }
        }
        upright[0] -= COS_45;
        upright
    }

    fn next_contact(&self, n: usize, h: f64) -> Option<f64> {
        let x = |k: usize| if k == 0 { self.x_0 } else { self.rho[k] };
        // States from an external integrator that diverges may be so large that their squares overflow.
        if !(0..=n).all(|k| largest(x(k)) < LARGEST_COEFFICIENT) {
            return None;
        }
        // f is exact for the series of x up to order n. If the series of f ended at order n, an impact could be missed.
        let mut f = [0.0; 2 * ORDER + 1];
        for (k, f) in f.iter_mut().enumerate().take(2 * n + 1) {
            let term = |i: usize| dot(x(i), times(&self.d, x(k - i)));
            *f = -(k.saturating_sub(n)..=k.min(n)).map(term).sum::<f64>();
        }
        f[0] += 1.0;
        if f[0] > TOUCHING {
            return first_root(&f[..=2 * n], h);
        }
        if f[1] > RESTING {
            // The root near 0 lies in the past, where the liquid left the wall, so that it is divided out.
            return first_root(&f[1..=2 * n], h);
        }
        if self.meets_wall([f[0], f[1], f[2]], self.rho[2]) {
            return Some(0.0);
        }
        f[0] = TOUCHING;
        first_root(&f[..=2 * n], h)
    }

    /// Returns true if an impact is due: the liquid is on or outside the wall and moves outwards or is pressed outwards. `f`
    /// has coefficients 0 to 2 of the function f that describes the wall, and `x_2` is coefficient 2 of the position.
    fn meets_wall(&self, f: [f64; 3], x_2: Vec3) -> bool {
        if f[0] > TOUCHING || f[1] > RESTING {
            return false;
        }
        // Magnitude of the terms of f'', from which their rounding error follows.
        let g = times(&self.d, self.x_0);
        let size =
            1.0 + 2.0 * largest(g) * largest(x_2) + dot(self.rho[1], times(&self.d, self.rho[1]));
        f[1] < -RESTING || f[2] < -PRESSING * size
    }

    /// Returns the value of f, the function that describes the wall, as an event indicator for Model Exchange. Order 0 of the
    /// expansion must be computed. The value is below zero only if an impact is due. It is above zero if after an impact the
    /// liquid is outside the wall by rounding but moves inwards, or is on the wall without being pressed to it. An integrator
    /// that compares signs therefore does not miss a bounce shorter than its step.
    fn distance_to_wall(&self, w: &Vector, w_d: &Vector) -> f64 {
        let (x, x_d, g) = (self.x_0, self.x_d[0], times(&self.d, self.x_0));
        let f = 1.0 - dot(x, g);
        if f > TOUCHING {
            return f;
        }
        let turned = add(cross(w_d[0], self.rho[0]), cross(w[0], x_d));
        let x_2 = scale(0.5, sub(self.u[1], turned));
        let bent = dot(x_d, times(&self.d, x_d)) + 2.0 * dot(g, x_2);
        if self.meets_wall([f, -2.0 * dot(g, x_d), -bent], x_2) { f } else { TOUCHING }
    }

    /// Returns true if the present event indicators show that an external integrator (Model Exchange) has passed an event.
    pub fn is_overdue(&self, [leaves, ends]: [f64; 2]) -> bool {
        // If the state is `Held`, this indicator stays below zero after the liquid has passed the point nearest to the axis.
        leaves <= 0.0 || ends < 0.0 && self.state != BallState::Held
    }

    pub fn is_outside(&self) -> bool {
        1.0 - dot(self.x_0, times(&self.d, self.x_0)) < -TOUCHING
    }

    /// Returns the point of the wall, as a position from O, on the ray from the wall's centre through the detached liquid.
    pub fn on_wall_beside(&self) -> Vec3 {
        let size = libm::sqrt(dot(self.x_0, times(&self.d, self.x_0)));
        add(self.center, scale(1.0 / size, self.x_0))
    }

    /// Returns the coefficients of orders below n of a function that rises through zero where drag
    /// begins to act: the squared wall force minus the square of twice the drag force.
    fn excess(&self, n: usize) -> Series {
        let (mut pull, mut excess) = (ZERO, ZERO);
        for (k, x) in pull.iter_mut().enumerate().take(n) {
            *x = product(&self.pull, &self.pull, k);
        }
        let twice = 2.0 * self.m * self.drag;
        for (k, x) in excess.iter_mut().enumerate().take(n) {
            *x =
                product(&pull, &self.squared, k) - twice * twice * dots(&self.x_d, &self.x_d, 0, k);
        }
        excess
    }

    fn next_passage(&self, n: usize, h: f64) -> Option<f64> {
        let x = |k: usize| if k == 0 { self.x_0 } else { self.rho[k] };
        let across = |y: Vec3| sub(y, scale(dot(self.e, y), self.e));
        let mut outwards = ZERO;
        for (k, out) in outwards.iter_mut().enumerate().take(n) {
            *out = (0..=k).map(|i| dot(across(x(i)), self.x_d[k - i])).sum();
        }
        rise(&outwards, n, h)
    }

    fn next_settling(
        &self,
        n: usize,
        h: f64,
        [a, w, w_d]: [&Vector; 3],
    ) -> Option<(f64, Due, Crossing)> {
        let conditions = self.settling(n, a, w, w_d);
        let (mut first, mut many) = (None, 0);
        for (i, (x, _)) in conditions.iter().enumerate().filter(|(_, (x, fine))| x[0] <= -fine) {
            many += 1;
            let below = x.map(|x| -x);
            if let Some(t) = first_root(&below[..n], h)
                && first.is_none_or(|(first, _)| t < first)
            {
                first = Some((t, Crossing::Settling(i)));
            }
        }
        let due = if many == 1 { Due::Settle } else { Due::Look };
        match many {
            0 => Some((0.0, Due::Settle, Crossing::Exact)),
            _ => first.map(|(t, crossing)| (t, due, crossing)),
        }
    }

    /// Returns true if the pendulums may take over the liquid at the start of the expansion, by the conditions on swing,
    /// thrust and depth of [`Lump::settling`].
    pub fn may_settle(&self, a: &Vector, w: &Vector, w_d: &Vector) -> bool {
        self.settling(1, a, w, w_d).iter().all(|(x, fine)| x[0] > -fine)
    }

    /// Returns the event indicators for Model Exchange; `bobs` are the bobs of the tank. The indicators cross zero where
    /// [`Lump::next`] finds an event. They are computed from directions of unit length, although the directions that an external
    /// integrator sets may have another length.
    pub fn indicators<'a>(
        &self,
        [a, w, w_d]: [&Vector; 3],
        bobs: impl Iterator<Item = &'a Bob>,
    ) -> [f64; 2] {
        match self.state {
            BallState::Settled => {
                let above = self.axial(1, a, w, w_d)[0] - self.lowest;
                [above.min(self.upright(bobs, 0)[0]), 1.0]
            }
            BallState::Flying => [self.distance_to_wall(w, w_d), 1.0],
            BallState::Held => {
                let out = dot(sub(self.x_0, scale(dot(self.e, self.x_0), self.e)), self.x_d[0]);
                [self.pull[0] / self.m, -out]
            }
            BallState::Sliding | BallState::Light => {
                let mut least = self
                    .settling(1, a, w, w_d)
                    .iter()
                    .fold(f64::INFINITY, |least, (x, fine)| least.min(x[0] + fine));
                if self.state == BallState::Light {
                    least = least.max(self.excess(1)[0]);
                }
                [self.pull[0] / self.m, -least]
            }
        }
    }
}

/// Returns the time within `h`, s, at which the function with the power series `a`, up to order n, rises through zero; `None` if
/// it does not rise through zero. For h = 0, when an external integrator has located the event, returns 0 if a is positive.
fn rise(a: &Series, n: usize, h: f64) -> Option<f64> {
    let size = a[..n].iter().rev().fold(0.0, |sum, x| sum * h.min(1.0) + x.abs());
    let below = a.map(|x| -x);
    if h == 0.0 && a[0] > 0.0 {
        return Some(0.0);
    }
    if below[0] > 1e-10 * size { first_root(&below[..n], h) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// t - 1/4 rises through zero at 0.25, and t^2 - 1/4 at 0.5. Not counted are 1/4 - t, which falls, 1/4 + t, which is
    /// above zero, and t - 1e-12, which is zero at the start except for rounding.
    #[test]
    fn a_power_series_counts_as_rising_if_it_crosses_zero_from_below() {
        let series = |terms: &[f64]| {
            let mut series = ZERO;
            series[..terms.len()].copy_from_slice(terms);
            series
        };
        let close = |found: Option<f64>, t: f64| assert!((found.unwrap() - t).abs() < 1e-12);
        close(rise(&series(&[-0.25, 1.0]), 2, 1.0), 0.25);
        close(rise(&series(&[-0.25, 0.0, 1.0]), 3, 1.0), 0.5);
        close(rise(&series(&[-2.5e9, 1e10]), 2, 1.0), 0.25);
        assert_eq!(rise(&series(&[-0.25, 1.0]), 2, 0.2), None);
        // The coefficients from order n on are not used.
        assert_eq!(rise(&series(&[-0.25, 0.0, 1.0]), 2, 1.0), None);
        for falling in [[0.25, -1.0], [0.25, 1.0], [-0.25, -1.0], [-1e-12, 1.0]] {
            assert_eq!(rise(&series(&falling), 2, 1.0), None, "{falling:?}");
        }
        // With h = 0, when an external integrator has stopped at an event, the event is due if the value is above zero.
        assert_eq!([1e-9, -1e-9].map(|a| rise(&series(&[a, 1.0]), 2, 0.0)), [Some(0.0), None]);
    }

    /// Returns the detached liquid of the default tank, at the bottom of a surface that is 2 m high and 2 m wide.
    fn lump(state: BallState) -> Lump {
        let mut tank = Tank::default();
        tank.ball.travel = 0.6;
        let mut lump = Lump::new(&tank, 0).unwrap();
        (lump.state, lump.half, lump.d) =
            (state, 1.0, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        lump.x_0 = [0.0, 0.0, -1.0];
        (lump.m, lump.drag) = (5.0, 0.3);
        lump
    }

    fn along_x(terms: &[f64]) -> Vector {
        let mut vector = ZERO_VECTOR;
        for (n, term) in terms.iter().enumerate() {
            vector[n][0] = *term;
        }
        vector
    }

    fn along_z(terms: &[f64]) -> Vector {
        along_x(terms).map(|[x, y, z]| [z, y, x])
    }

    /// Returns the next event of detached liquid within one second. Without specific force the pendulums cannot
    /// take over the liquid.
    fn next(lump: &Lump) -> Option<(f64, Due)> {
        lump.next(4, 1.0, [&ZERO_VECTOR; 3], core::iter::empty())
    }

    fn assert_event(found: Option<(f64, Due)>, t: f64, due: Due) {
        let found = found.unwrap();
        assert!((found.0 - t).abs() < 1e-9 && found.1 == due, "{found:?} {t} {due:?}");
    }

    /// Drag acts if the wall force N |n| is above twice the drag m d |x'|: 2 x 5 kg x 0.3 1/s x 2 m/s = 6 N. A wall
    /// force of 4.5 N that rises by 4 N/s reaches this value after 0.375 s. No event is due if drag already acts, or if
    /// |n| is a half.
    #[test]
    fn drag_of_light_detached_liquid_begins_where_the_wall_force_is_twice_the_drag() {
        let mut lump = lump(BallState::Light);
        (lump.pull[0], lump.pull[1], lump.squared[0]) = (4.5, 4.0, 1.0);
        lump.x_d = along_x(&[2.0]);
        let excess = lump.excess(3);
        assert_eq!(excess[..3], [4.5 * 4.5 - 36.0, 2.0 * 4.5 * 4.0, 16.0]);
        assert_event(next(&lump), 0.375, Due::Drag);
        lump.squared[0] = 0.25;
        assert_eq!(next(&lump), None);
        lump.squared[0] = 1.0;
        lump.state = BallState::Sliding;
        assert_eq!(next(&lump), None);
        // Here the rate along the wall grows with time, and with it the force above which drag acts.
        lump.x_d = along_x(&[2.0, 1.0]);
        assert_eq!(lump.excess(3)[1], 36.0 - 36.0);
    }

    /// A wall force of 1 N that falls by 2 N/s vanishes after 0.5 s, when the liquid leaves the
    /// wall. The liquid is nearest to the tank's axis, where the pendulums may take it over, after
    /// 0.25 s in the first case and 0.75 s in the second.
    #[test]
    fn the_earlier_of_release_and_settling_is_the_next_event() {
        let mut lump = lump(BallState::Held);
        (lump.pull[0], lump.pull[1]) = (1.0, -2.0);
        lump.x_d = along_x(&[1.0]);
        lump.rho = along_x(&[0.0, 1.0]);
        for (x, t, due) in [(-0.25, 0.25, Due::Settle), (-0.75, 0.5, Due::Release)] {
            lump.x_0[0] = x;
            assert_event(next(&lump), t, due);
        }
        lump.pull[1] = 0.0;
        assert_event(next(&lump), 0.75, Due::Settle);
        // The liquid moves along the axis, so that its distance from the axis does not change.
        (lump.x_d, lump.rho) = (along_z(&[1.0]), along_z(&[0.0, 1.0]));
        assert_eq!(next(&lump), None);
    }

    /// Detached liquid halfway down that rises with 3 m/s reaches the top in half a second, and so does liquid that leaves
    /// the wall with 4 m/s. The impact is immediate if the liquid moves into the wall, or rests on it and is pressed to it.
    /// Liquid that falls away from the wall never hits it.
    #[test]
    fn the_impact_time_of_detached_liquid_on_the_wall_ahead_is_exact() {
        let mut lump = lump(BallState::Flying);
        lump.x_0[2] = -0.5;
        lump.rho = along_z(&[0.0, 3.0]);
        assert_event(next(&lump), 0.5, Due::Impact);
        lump.x_0[2] = -1.0;
        lump.rho = along_z(&[0.0, 4.0]);
        assert_event(next(&lump), 0.5, Due::Impact);
        for (terms, at_once) in [
            (&[0.0, -4.0][..], true),
            (&[0.0, -1e-8], true),
            (&[0.0, 0.0, -0.1], true),
            (&[0.0, 0.0, 0.1], false),
            (&[0.0, 1e-8, -0.1], false),
        ] {
            lump.rho = along_z(terms);
            let found = next(&lump);
            assert_eq!(found == Some((0.0, Due::Impact)), at_once, "{terms:?}: {found:?}");
        }
        // Near the wall the curvature matters: 1 m/s along the wall is an acceleration of 1 m/s² towards it.
        lump.rho = along_x(&[0.0, 1.0]);
        assert_eq!(next(&lump), Some((0.0, Due::Impact)));
    }

    /// The allowed error of the detached liquid's velocity is relative to the sum of its speed relative to the tank (2 m/s),
    /// the speed of the rotating tank (3 m/s), and acceleration times time (0.5 m/s).
    #[test]
    fn the_speed_scale_of_detached_liquid_adds_the_speeds_of_all_its_motions() {
        let mut lump = lump(BallState::Flying);
        lump.x_d = along_x(&[-2.0]);
        lump.u = along_z(&[7.0, 5.0]);
        assert_eq!(lump.speed_scale([0.0, -3.0, 1.0], 0.1), 2.0 + 3.0 + 0.5);
        assert_eq!([lump.coefficient_norm(0), lump.coefficient_norm(1)], [7.0, 5.0]);
    }
}

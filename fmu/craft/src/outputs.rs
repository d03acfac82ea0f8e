//! What the craft shows at one instant, and its derivative along a direction.
//!
//! ```text
//! P = C [ m V + w x S + sum of m (V + w x rho + l p') ]                          P' = C f
//! H = C [ I w + sum of m rho x (w x rho + l p') + h_w - r_c x (C^T P - m_all V) ]
//!                                                                    H' = C (tau - r_c x f)
//! E = m |V|^2/2 + V.(w x S) + w.(I w)/2 + sum of m |V + w x rho + l p'|^2/2
//!     + sum of k l^2 |p_perp|^2/2                      E' = f.V + (tau - h_w').w - dissipation
//! ```
//!
//! m, S, I: dry craft and rigid liquids about O; sums over the bobs; r_c: centre of mass of
//! everything from O; V in body axes. H is about r_c and does not contain V: after a long
//! thrust nothing cancels. On a pivot H is about O, and E has the potential a.S with all masses.

use crate::bob::Bob;
use crate::motion::CraftMotion;
use crate::parameters::{MODES, Mount, TANKS};
use crate::rigid::Rigid;
use crate::state::{STATES, index};
use crate::vector::{
    Mat3, Number, Quaternion, Vec3, add, constant, cross, dot, rotation, scale, sub, times,
};

/// What one tank shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TankOutputs {
    /// Force of the tank's whole liquid on the craft, N, body axes.
    pub force: Vec3,
    /// Its torque about O, N m, body axes.
    pub torque: Vec3,
    /// Direction from hinge to bob of each mode, tank axes.
    pub p: [Vec3; MODES],
    /// Its rate, 1/s, tank axes.
    pub p_dot: [Vec3; MODES],
    /// Slosh angle of each mode, rad: sin(angle_x) = p_x, tank axes.
    pub angle_x: [f64; MODES],
    /// Slosh angle of each mode, rad: sin(angle_y) = p_y, tank axes.
    pub angle_y: [f64; MODES],
}

/// What the craft shows at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    /// Attitude, body to inertial, scalar first.
    pub q: Quaternion,
    /// Angular velocity, rad/s, body axes.
    pub omega: Vec3,
    /// Angular acceleration, rad/s2, body axes.
    pub omega_dot: Vec3,
    /// What an accelerometer at O reads, m/s2, body axes.
    pub specific_force: Vec3,
    /// Position of O, m, inertial (freely falling) axes.
    pub position: Vec3,
    /// Velocity of O, m/s, inertial axes.
    pub velocity: Vec3,
    /// Force of all liquids on the craft, N, body axes.
    pub slosh_force: Vec3,
    /// Torque of all liquids on the craft about O, N m, body axes.
    pub slosh_torque: Vec3,
    /// Momentum of everything, kg m/s, inertial axes.
    pub momentum: Vec3,
    /// Angular momentum of everything, wheels included, about the centre of mass of everything
    /// (on a pivot: about O), N m s, inertial axes.
    pub angular_momentum: Vec3,
    /// Kinetic energy, with the wheels as dead mass, and energy of the centring stiffness (on a
    /// pivot: of gravity, too), J.
    pub energy: f64,
    /// Work of force and torque since the start, J.
    pub work: f64,
    /// Energy dissipated by the liquids since the start, J.
    pub dissipated: f64,
    /// Mass of everything, kg.
    pub mass: f64,
    /// Centre of mass of everything from O, m, body axes.
    pub center_of_mass: Vec3,
    /// Inertia of everything with the bobs as point masses where they are, about the
    /// centre of mass of everything, kg m2, body axes.
    pub inertia: Mat3,
    /// The tanks; those not used show no force.
    pub tank: [TankOutputs; TANKS],
}

impl TankOutputs {
    /// What a tank's modes show of their part of the states, or of a direction.
    pub(crate) fn of_states(x: &[f64]) -> TankOutputs {
        let part = |n: usize, at: usize| {
            let at = 6 * n + at;
            [x[at], x[at + 1], x[at + 2]]
        };
        TankOutputs {
            force: [0.0; 3],
            torque: [0.0; 3],
            p: core::array::from_fn(|n| part(n, 0)),
            p_dot: core::array::from_fn(|n| part(n, 3)),
            angle_x: [0.0; MODES],
            angle_y: [0.0; MODES],
        }
    }

    pub(crate) fn set_angles<T: Number>(&mut self, bob: &Bob) {
        let [x, y, _] = bob.direction_in_tank::<T>();
        self.angle_x[bob.mode] = x.asin().result();
        self.angle_y[bob.mode] = y.asin().result();
    }
}

fn result<T: Number>(a: Vec3<T>) -> Vec3 {
    a.map(T::result)
}

/// m (|s|^2 1 - s s^T).
fn point_inertia<T: Number>(m: f64, s: Vec3<T>) -> Mat3<T> {
    let s2 = dot(s, s);
    let row = |i: usize| {
        [0, 1, 2].map(|j| (if i == j { s2 } else { T::constant(0.0) } - s[i] * s[j]) * m)
    };
    [row(0), row(1), row(2)]
}

fn add_matrices<T: Number>(a: Mat3<T>, b: Mat3<T>) -> Mat3<T> {
    [add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])]
}

impl CraftMotion {
    /// The outputs from coefficient 0 of the motion, or their derivatives from coefficients 0
    /// and 1; `x` is the states, or the direction.
    pub fn outputs<T: Number>(&self, x: &[f64; STATES]) -> Outputs {
        let of = |a: &[Vec3]| -> Vec3<T> { [0, 1, 2].map(|i| T::of(a[0][i], a[1][i])) };
        let (a, w, w_d) = (of(&self.a), of(&self.w), of(&self.w_d));
        let (velocity, h) = (of(&self.drift), of(&self.h));
        let [q, dq] = [self.q.get(0), self.q.get(1)];
        let axes = rotation(&[0, 1, 2, 3].map(|i| T::of(q[i], dq[i])));
        let Rigid { mass: m_r, moment, inertia } = self.rigid;
        let (s, inertia) = (constant::<T>(moment), inertia.map(constant::<T>));

        let mut tank: [TankOutputs; TANKS] =
            core::array::from_fn(|i| TankOutputs::of_states(&x[index::bob(i, 0)..]));
        let (mut slosh_force, mut slosh_torque) = ([0.0; 3], [0.0; 3]);
        for (tank, liquid) in tank.iter_mut().zip(&self.liquids) {
            let [f, tau] = liquid.inertial_wrench(a, w, w_d);
            (tank.force, tank.torque) = (scale(-1.0, result(f)), scale(-1.0, result(tau)));
        }
        let mut mass = m_r;
        let mut all_moment = s;
        let mut all_inertia = inertia;
        // m times what O does not share of the velocity, and its moment about O.
        let inner = cross(w, s);
        let (mut inner_momentum, mut inner_angular) = (inner, times(&inertia, w));
        let half = 0.5;
        let mut energy =
            (dot(velocity, velocity) * m_r + dot(w, inner_angular)) * half + dot(velocity, inner);
        for bob in &self.bobs {
            let [f, tau] = bob.wrench::<T>().map(result);
            let out = &mut tank[bob.tank];
            (out.force, out.torque) = (add(out.force, f), add(out.torque, tau));
            out.set_angles::<T>(bob);
            let [rho, rate] = bob.place::<T>();
            let against_o = add(cross(w, rho), rate);
            mass += bob.m;
            all_moment = add(all_moment, rho.map(|x| x * bob.m));
            all_inertia = add_matrices(all_inertia, point_inertia(bob.m, rho));
            inner_momentum = add(inner_momentum, against_o.map(|x| x * bob.m));
            inner_angular = add(inner_angular, cross(rho, against_o).map(|x| x * bob.m));
            let speed = add(velocity, against_o);
            energy = energy + dot(speed, speed) * (half * bob.m) + bob.centring_energy::<T>();
        }
        for tank in &tank {
            slosh_force = add(slosh_force, tank.force);
            slosh_torque = add(slosh_torque, tank.torque);
        }
        let center = all_moment.map(|x| x * (1.0 / mass));
        let momentum = add(velocity.map(|x| x * mass), inner_momentum);
        let about_o = add(inner_angular, h);
        let angular_momentum = match self.mount {
            Mount::Free => sub(about_o, cross(center, inner_momentum)),
            Mount::Pivot => about_o,
        };
        if self.mount == Mount::Pivot {
            energy = energy + dot(a, all_moment);
        }
        let own = add_matrices(all_inertia, point_inertia(-mass, center));
        Outputs {
            q: [x[index::Q], x[index::Q + 1], x[index::Q + 2], x[index::Q + 3]],
            omega: crate::motion::part(x, index::OMEGA),
            omega_dot: result(w_d),
            specific_force: result(a),
            position: crate::motion::part(x, index::POSITION),
            velocity: crate::motion::part(x, index::VELOCITY),
            slosh_force,
            slosh_torque,
            momentum: result(times(&axes, momentum)),
            angular_momentum: result(times(&axes, angular_momentum)),
            energy: energy.result(),
            work: x[index::WORK],
            dissipated: x[index::DISSIPATED],
            mass: T::constant(mass).result(),
            center_of_mass: result(center),
            inertia: own.map(result),
            tank,
        }
    }
}

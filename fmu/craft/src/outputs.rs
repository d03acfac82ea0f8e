//! Outputs of the craft at one instant, and their derivatives along a direction.
//!
//! ```text
//! P = C [ m V + w x S + sum of m (V + w x rho + l p') ]                          P' = C f
//! H = C [ I w + sum of m rho x (w x rho + l p') + h_w - r_c x (C^T P - m_all V) ]
//!                                                                    H' = C (tau - r_c x f)
//! E = m |V|^2/2 + V.(w x S) + w.(I w)/2 + sum of m |V + w x rho + l p'|^2/2
//!     + sum of k l^2 |p_perp|^2/2           E' = f.V + (tau - h_w').w - dissipation - drained'
//! ```
//!
//! The appendages add K to P, L to H, and V.K + w.L and the energy of the modes to E (`appendage.rs`). The deformed
//! appendages also contribute to m, S and I. H also contains the angular momentum of rotary motion (`surface.rs`) and of the
//! liquid's spin (`spin.rs`), and E contains their energies. m, S and I are mass, first moment and inertia of dry craft and
//! rigid liquids about O. The sums are over the bobs. r_c is the centre of mass of craft and liquids from O, m_all their
//! mass, and V is in body axes. H refers to r_c and does not contain V, so that no large terms cancel after a long thrust.
//! drained' is in `contents.rs`. On a pivot H refers to O, and E includes the potential energy a.S of all masses and the
//! pivot's energy U (`pivot.rs`).

use core::borrow::Borrow;

use taylor::number::Number;
use taylor::vector::{
    Mat3, Quaternion, Vec3, add, constant, cross, dot, part, rotation, scale, sub, times,
};

use crate::appendage::Deformed;
use crate::bob::BobNow;
use crate::motion::CraftMotion;
use crate::parameters::Mount;
use crate::pivot::Pivot;
use crate::rigid::Rigid;
use crate::sizes::{MODES, TANKS};
use crate::spin::SpinScale;
use crate::state::{BallState, Ranges, STATES, index};

/// Outputs of one tank; names, units and axes are those of the FMUs' outputs `tank[].…` and described in the FMUs' variable
/// tables. `force` is the force of all liquid of the tank on the craft, and `torque` its torque about O, both in body axes.
/// Directions `p` and angles, sin(angle_x) = p_x, are in tank axes. `axial` is the specific force along the tank at the
/// first hinge, m/s2, and `turning` the rate at which the liquid rotates about the tank's axis, rad/s. While the liquid is
/// settled, `ball_position` is the position that its centre has at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct TankOutputs {
    pub force: Vec3,
    pub torque: Vec3,
    pub p: [Vec3; MODES],
    pub p_dot: [Vec3; MODES],
    pub angle_x: [f64; MODES],
    pub angle_y: [f64; MODES],
    pub wave_height: f64,
    pub axial: f64,
    pub turning: f64,
    pub spin_ratio: f64,
    pub spin_number: f64,
    pub ranges: Ranges,
    pub ball_state: BallState,
    pub ball_position: Vec3,
    pub ball_velocity: Vec3,
}

/// Outputs of the craft at one instant; names, units and axes are those of the FMU's outputs and described in the FMU's
/// variable table: the motion of O, the force of all liquids on the craft and its torque about O, momenta in inertial axes
/// (the angular momentum about the centre of mass, or on a pivot about O), the terms of the energy balance since the
/// start, J, and the mass properties with the bobs as point masses at their current positions. The force of a tank that is
/// not in use is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Outputs {
    pub q: Quaternion,
    pub omega: Vec3,
    pub omega_dot: Vec3,
    pub specific_force: Vec3,
    pub position: Vec3,
    pub velocity: Vec3,
    pub slosh_force: Vec3,
    pub slosh_torque: Vec3,
    pub pivot_torque: Vec3,
    pub momentum: Vec3,
    pub angular_momentum: Vec3,
    pub energy: f64,
    pub work: f64,
    pub dissipated: f64,
    pub drained: f64,
    pub mass: f64,
    pub center_of_mass: Vec3,
    pub inertia: Mat3,
    pub tank: [TankOutputs; TANKS],
}

impl TankOutputs {
    /// Returns the outputs of a tank's modes from the tank's part `x` of the state vector, or their derivatives if `x` is a
    /// change of the states.
    pub(crate) fn from_states(x: &[f64]) -> TankOutputs {
        let part = |n: usize, at: usize| {
            let at = 6 * n + at;
            [x[at], x[at + 1], x[at + 2]]
        };
        TankOutputs {
            p: core::array::from_fn(|n| part(n, 0)),
            p_dot: core::array::from_fn(|n| part(n, 3)),
            ..TankOutputs::default()
        }
    }

    /// Sets the outputs that depend on the bobs. `liquid` is the rate of the liquid's spin; if it is `None`, the liquid is
    /// assumed to rotate with the tank.
    pub(crate) fn set_angles<T: Number>(
        &mut self,
        [a, w, w_d]: [Vec3<T>; 3],
        bobs: impl Iterator<Item: Borrow<BobNow<T>>> + Clone,
        liquid: Option<T>,
        scale_of_spin: Option<SpinScale>,
    ) {
        if let Some(bob) = bobs.clone().next() {
            let bob = bob.borrow();
            let turning = add(cross(w_d, bob.hinge), cross(w, cross(w, bob.hinge)));
            let axial = dot(constant(bob.e), add(a, turning));
            self.axial = axial.result();
            let turning = liquid.unwrap_or_else(|| dot(constant(bob.e), w));
            self.turning = turning.result();
            if let Some(scale) = scale_of_spin {
                let numbers = scale.numbers(axial, turning);
                [self.spin_ratio, self.spin_number] = numbers.map(T::result);
            }
        }
        self.set_wave(bobs.map(|bob| (bob.borrow().in_tank, bob.borrow().wave)));
    }

    /// Sets the slosh angles and the height of the wave. `modes` yields for each mode the bob's
    /// direction p, tank axes, and the wave height per slosh angle, m.
    pub(crate) fn set_wave<T: Number>(&mut self, modes: impl Iterator<Item = (Vec3<T>, f64)>) {
        let mut wave = [T::constant(0.0); 2];
        for (n, ([x, y, _], height)) in modes.enumerate() {
            let [x, y] = [x.asin(), y.asin()];
            self.angle_x[n] = x.result();
            self.angle_y[n] = y.result();
            wave = [wave[0] + x * height, wave[1] + y * height];
        }
        self.wave_height = wave[0].hypot(wave[1]).result();
    }
}

/// Mass, and first and second moment of the mass about O, of rigid liquid and bobs at their current positions.
pub(crate) struct MassProperties<T> {
    pub mass: T,
    moment: Vec3<T>,
    inertia: Mat3<T>,
}

impl<T: Number> MassProperties<T> {
    pub fn from_rigid(rigid: &Rigid<T>) -> MassProperties<T> {
        let Rigid { mass, moment, inertia } = *rigid;
        MassProperties { mass, moment, inertia }
    }

    pub fn add(&mut self, m: T, rho: Vec3<T>) {
        self.mass = self.mass + m;
        self.moment = add(self.moment, scale(m, rho));
        self.inertia = add_matrices(self.inertia, point_inertia(m, rho));
    }

    pub fn center(&self) -> Vec3<T> {
        let is_something = self.mass.value() > 0.0;
        // `black_box` keeps the compiler from dividing before the check for mass, because an importer may make
        // divisions by 0 trap.
        let divisor = core::hint::black_box(if is_something { self.mass.value() } else { 1.0 });
        let share = T::with_slope(divisor, self.mass.result()).recip();
        if is_something { scale(share, self.moment) } else { constant([0.0; 3]) }
    }

    pub fn inertia(&self) -> Mat3 {
        add_matrices(self.inertia, point_inertia(-self.mass, self.center())).map(result)
    }
}

fn result<T: Number>(a: Vec3<T>) -> Vec3 {
    a.map(T::result)
}

fn point_inertia<T: Number>(m: T, s: Vec3<T>) -> Mat3<T> {
    let s2 = dot(s, s);
    let row = |i: usize| {
        [0, 1, 2].map(|j| (if i == j { s2 } else { T::constant(0.0) } - s[i] * s[j]) * m)
    };
    [row(0), row(1), row(2)]
}

fn add_matrices<T: Number>(a: Mat3<T>, b: Mat3<T>) -> Mat3<T> {
    [add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])]
}

/// One tank at an instant, for the outputs. `rigid` is the rigid liquid about O, and `wrench` the force of the liquid on the
/// craft and its torque about O. `flow_momentum` has the momentum, and the moment of momentum about O, of the flow within
/// the tank (`draining.rs`) and of the liquid's spin. `spin` has the energy and the rate of the spin, and `lump` is the
/// detached liquid, if any.
pub(crate) struct TankNow<T> {
    pub rigid: Rigid<T>,
    pub wrench: [Vec3<T>; 2],
    pub flow_momentum: [Vec3<T>; 2],
    pub spin: Option<[T; 2]>,
    pub bobs: [Option<BobNow<T>>; MODES],
    pub lump: Option<BobNow<T>>,
    pub ball_state: BallState,
}

/// The craft at an instant, or its directional derivative. `velocity` is the velocity of O in body axes, and `axes` rotates
/// from body axes to inertial axes. `pivot` has neither stiffness nor damping if the craft is free.
pub(crate) struct Now<T> {
    pub a: Vec3<T>,
    pub w: Vec3<T>,
    pub w_d: Vec3<T>,
    pub velocity: Vec3<T>,
    pub h_wheels: Vec3<T>,
    pub axes: Mat3<T>,
    pub mount: Mount,
    pub pivot: Pivot,
    pub craft: Rigid,
    pub tanks: [Option<TankNow<T>>; TANKS],
    pub deformed: Option<Deformed<T>>,
}

impl CraftMotion {
    /// Returns the craft at an instant from coefficient 0 of the motion, or as dual numbers from coefficients 0 and 1.
    pub fn now<T: Number>(&self) -> Now<T> {
        let number = |a: &[Vec3]| -> Vec3<T> { [0, 1, 2].map(|i| T::with_slope(a[0][i], a[1][i])) };
        let (a, w, w_d) = (number(&self.a), number(&self.w), number(&self.w_d));
        let [q, dq] = [self.q.get(0), self.q.get(1)];
        let mut instant = Now {
            a,
            w,
            w_d,
            velocity: number(&self.drift),
            h_wheels: number(&self.h),
            axes: rotation(&[0, 1, 2, 3].map(|i| T::with_slope(q[i], dq[i]))),
            mount: self.mount,
            pivot: self.pivot,
            craft: self.craft,
            tanks: [const { None }; TANKS],
            deformed: self.deformed(),
        };
        for (i, liquid) in self.liquids.iter().enumerate() {
            let lump = self.lumps.iter().find(|lump| lump.tank == i && lump.is_loose());
            let rigid = lump
                .map_or_else(|| liquid.lift(), |lump| liquid.with_inertia_slope(&lump.shape_slope));
            let mut wrench = rigid.inertial_wrench(a, w, w_d).map(|half| half.map(|x| -x));
            let mut bobs = [(); MODES].map(|()| None);
            for bob in self.bobs.iter().filter(|bob| bob.tank == i) {
                let [f, tau] = bob.wrench::<T>();
                wrench = [add(wrench[0], f), add(wrench[1], tau)];
                bobs[bob.mode] = Some(bob.now());
            }
            let flow_momentum = [constant([0.0; 3]); 2];
            let mut now = TankNow {
                rigid,
                wrench,
                flow_momentum,
                spin: None,
                bobs,
                lump: None,
                ball_state: BallState::Settled,
            };
            if let Some(lump) = lump {
                let [f, tau] = lump.wrench::<T>();
                now.wrench = [add(now.wrench[0], f), add(now.wrench[1], tau)];
                (now.lump, now.ball_state) = (Some(lump.now()), lump.state);
            }
            instant.tanks[i] = Some(now);
        }
        instant
    }
}

impl<T: Number> Now<T> {
    /// Returns the outputs. `scale_of_spin` maps the number of a tank, which counts from 0, to the
    /// natural frequency with which the spin of the tank's liquid is compared. If it returns
    /// `None`, the tank's outputs `spin_ratio` and `spin_number` are 0.
    pub fn outputs(
        &self,
        x: &[f64; STATES],
        scale_of_spin: impl Fn(usize) -> Option<SpinScale>,
    ) -> Outputs {
        let Now { w, velocity, .. } = *self;
        let tanks = || self.tanks.iter().flatten();
        let bobs = || tanks().flat_map(|tank| tank.bobs.iter().flatten().chain(&tank.lump));
        let lifted = self.craft.lift::<T>();
        let mut rigid = tanks().fold(lifted, |sum, tank| sum.combined_with(&tank.rigid));
        if let Some(deformed) = &self.deformed {
            rigid = rigid.combined_with(&deformed.body);
        }

        let mut tank: [TankOutputs; TANKS] =
            core::array::from_fn(|i| TankOutputs::from_states(&x[index::bob(i, 0)..]));
        for (i, tank) in tank.iter_mut().enumerate() {
            tank.ball_position = part(x, index::ball(i));
            tank.ball_velocity = part(x, index::ball(i) + 3);
        }
        let (mut slosh_force, mut slosh_torque) = ([0.0; 3], [0.0; 3]);
        for (i, (out, now)) in tank.iter_mut().zip(tanks()).enumerate() {
            [out.force, out.torque] = now.wrench.map(result);
            let (bobs, turning) = (now.bobs.iter().flatten(), now.spin.map(|[_, turning]| turning));
            out.set_angles([self.a, w, self.w_d], bobs, turning, scale_of_spin(i));
            out.ball_state = now.ball_state;
            slosh_force = add(slosh_force, out.force);
            slosh_torque = add(slosh_torque, out.torque);
        }
        // m times the velocity of the masses relative to O, and its moment about O.
        let inner = cross(w, rigid.moment);
        let (mut inner_momentum, mut inner_angular) = (inner, times(&rigid.inertia, w));
        let half = 0.5;
        let mut energy = (dot(velocity, velocity) * rigid.mass + dot(w, inner_angular)) * half
            + dot(velocity, inner);
        if let Some(deformed) = &self.deformed {
            let [momentum, moment] = deformed.momentum;
            energy = energy + dot(velocity, momentum) + dot(w, moment) + deformed.energy;
            inner_momentum = add(inner_momentum, momentum);
            inner_angular = add(inner_angular, moment);
        }
        let mut all = MassProperties::from_rigid(&rigid);
        for bob in bobs() {
            let against_o = add(cross(w, bob.rho), bob.rate);
            all.add(bob.m, bob.rho);
            inner_momentum = add(inner_momentum, scale(bob.m, against_o));
            inner_angular = add(inner_angular, scale(bob.m, cross(bob.rho, against_o)));
            if let Some(spin) = bob.spin {
                inner_angular = add(inner_angular, spin);
            }
            let speed = add(velocity, against_o);
            energy = energy + dot(speed, speed) * bob.m * half + bob.centring;
        }
        for tank in tanks() {
            inner_momentum = add(inner_momentum, tank.flow_momentum[0]);
            inner_angular = add(inner_angular, tank.flow_momentum[1]);
            if let Some([spin_energy, _]) = tank.spin {
                energy = energy + spin_energy;
            }
        }
        let center = all.center();
        let momentum = add(scale(all.mass, velocity), inner_momentum);
        let about_o = add(inner_angular, self.h_wheels);
        let angular_momentum = match self.mount {
            Mount::Free => sub(about_o, cross(center, inner_momentum)),
            Mount::Pivot => about_o,
        };
        if self.mount == Mount::Pivot {
            energy = energy + dot(self.a, all.moment);
        }
        let mut pivot_torque = [0.0; 3];
        if self.pivot.acts() {
            let (torque, _, strain) = self.pivot.present(&self.axes, w);
            (pivot_torque, energy) = (result(torque), energy + strain);
        }
        Outputs {
            q: [x[index::Q], x[index::Q + 1], x[index::Q + 2], x[index::Q + 3]],
            omega: part(x, index::OMEGA),
            omega_dot: result(self.w_d),
            specific_force: result(self.a),
            position: part(x, index::POSITION),
            velocity: part(x, index::VELOCITY),
            slosh_force,
            slosh_torque,
            pivot_torque,
            momentum: result(times(&self.axes, momentum)),
            angular_momentum: result(times(&self.axes, angular_momentum)),
            energy: energy.result(),
            work: x[index::WORK],
            dissipated: x[index::DISSIPATED],
            drained: x[index::DRAINED],
            mass: all.mass.result(),
            center_of_mass: result(center),
            inertia: all.inertia(),
            tank,
        }
    }
}

//! Transitions of a tank's liquid between settled liquid (pendulums) and detached liquid (`lump.rs`), and impacts of the detached
//! liquid on the wall. They are impulses on the craft that carries the tank.
//!
//! Each transition conserves momentum and angular momentum about the common centre of mass, and loses energy; see `lump.rs`.

use taylor::space::Vector;
use taylor::vector::{Vec3, add, cross, dot, scale, sub, times};

use crate::appendage::Deformed;
use crate::bob::BobNow;
use crate::lump::{Directions, Due, Lump};
use crate::rigid::{Factors, Rigid};
use crate::sizes::MODES;
use crate::state::BallState;

/// The craft that carries tanks whose liquid can detach: a Spacecraft, or the craft to which a SloshTank is attached. In
/// all methods `lump` is the index of the detached liquid and `t` is the time since the start of the call, s. Vectors
/// are in body axes.
pub(crate) trait Carrier {
    /// Copy of all data that [`Carrier::change`] may alter, from which they can be restored.
    type Memory;

    fn memory(&self) -> Self::Memory;

    fn restore(&mut self, memory: &Self::Memory);

    /// Computes all quantities of the equations of motion from the present states at the time `t`.
    fn evaluate_at(&mut self, t: f64);

    fn lump(&self, lump: usize) -> &Lump;

    fn ball_state(&mut self, lump: usize) -> &mut BallState;

    /// Returns the position and velocity (six numbers) of detached liquid in the carrier's state vector.
    fn ball(&mut self, lump: usize) -> &mut [f64];

    /// Returns direction p and rate p' (six numbers) of bob `n` in the tank of the detached liquid, in
    /// the carrier's state vector.
    fn bob(&mut self, lump: usize, n: usize) -> &mut [f64];

    fn directions(&self, lump: usize) -> Directions;

    /// Returns the bobs of the tank to which the detached liquid belongs, with their present motion.
    /// [`Carrier::evaluate_at`] must have been called.
    fn bobs_beside(&self, lump: usize) -> impl Iterator<Item = BobNow<f64>>;

    /// Returns all masses that move within the tanks, that is, bobs and detached liquids, with their present motion.
    /// [`Carrier::evaluate_at`] must have been called.
    fn points(&self) -> impl Iterator<Item = BobNow<f64>>;

    fn rigid(&self) -> Rigid;

    fn deformed(&self) -> Option<Deformed<f64>> {
        None
    }

    /// Returns the power series of the carrier's acceleration a, angular velocity w and angular acceleration w'.
    fn motion(&self) -> [&Vector; 3];

    /// Returns the factors of the mass matrix of the carrier with everything that moves with it.
    fn factors(&self) -> &Factors;

    fn dissipated(&mut self) -> &mut f64;

    /// Applies an impulse and its moment about O to the carrier and to the liquid that moves with it. Returns the changes of
    /// the velocity V of O and of the angular velocity w.
    fn apply_impulse(&mut self, impulse: [Vec3; 2], t: f64) -> [Vec3; 2];

    fn shift(&mut self, by: Vec3);

    fn is_pressed(&mut self, lump: usize, t: f64) -> bool;

    /// Performs the event `due` of a liquid at the time `t`: the liquid leaves the bottom, hits the wall, leaves the wall,
    /// starts or ceases to have drag, or is taken over by the pendulums.
    #[inline(never)]
    fn change(&mut self, lump: usize, due: Due, t: f64) {
        self.evaluate_at(t);
        match due {
            Due::Leave => self.leave(lump, t),
            Due::Impact => self.throw_back(lump, t),
            Due::Release => {
                if !(self.lump(lump).drags() && self.try_on_wall(lump, BallState::Light, t)) {
                    *self.ball_state(lump) = BallState::Flying;
                }
            }
            Due::Drag => {
                if !self.try_on_wall(lump, BallState::Sliding, t) {
                    *self.ball_state(lump) = BallState::Light;
                }
            }
            Due::Settle if self.may_settle(lump) => {
                let before = self.memory();
                if !self.settle(lump, t) {
                    self.restore(&before);
                    *self.ball_state(lump) = BallState::Held;
                }
            }
            Due::Settle if self.lump(lump).state == BallState::Held => {
                *self.ball_state(lump) = BallState::Sliding;
            }
            Due::Settle | Due::Look => {}
        }
    }

    fn may_settle(&self, lump: usize) -> bool {
        let [a, w, w_d] = self.motion();
        self.lump(lump).may_settle(a, w, w_d)
    }

    /// Returns the kinetic energy plus the energy of the centring stiffness, in a frame in which O moves with the
    /// velocity `v`, body axes. With a small `v` no large terms cancel, however fast the carrier is.
    /// [`Carrier::evaluate_at`] must have been called.
    fn energy_with(&self, v: Vec3) -> f64 {
        let (w, mut rigid, mut energy) = (self.motion()[1][0], self.rigid(), 0.0);
        if let Some(deformed) = self.deformed() {
            rigid = rigid.combined_with(&deformed.body);
            let [momentum, moment] = deformed.momentum;
            energy = dot(v, momentum) + dot(w, moment) + deformed.energy;
        }
        let spin = dot(w, times(&rigid.inertia, w));
        let along = dot(v, cross(w, rigid.moment));
        energy += (rigid.mass * dot(v, v) + spin) / 2.0 + along;
        for point in self.points() {
            let speed = add(v, add(cross(w, point.rho), point.rate));
            energy += point.m * dot(speed, speed) / 2.0 + point.centring;
        }
        energy
    }

    /// Returns the mass of carrier and liquids, and the velocity of their common centre of mass relative to O, body axes.
    fn drift_of_center(&self) -> (f64, Vec3) {
        let (w, rigid) = (self.motion()[1][0], self.rigid());
        let mut momentum = cross(w, rigid.moment);
        if let Some(deformed) = self.deformed() {
            momentum = add(momentum, add(cross(w, deformed.body.moment), deformed.momentum[0]));
        }
        let mut mass = rigid.mass;
        for point in self.points() {
            let speed = add(cross(w, point.rho), point.rate);
            momentum = add(momentum, scale(point.m, speed));
            mass += point.m;
        }
        (mass, scale(1.0 / mass, momentum))
    }

    /// Detaches the liquid of a tank from the bottom. The centre of the liquid keeps its velocity. Motions of the bobs
    /// relative to the centre end, and the carrier receives their angular momentum.
    fn leave(&mut self, lump: usize, t: f64) {
        let before = self.energy_with([0.0; 3]);
        let center = self.lump(lump).common_center(&self.directions(lump));
        let [rate, moment] = self.lump(lump).stirred(center, self.bobs_beside(lump));
        let numbers = self.lump(lump).numbers(center, rate);
        self.ball(lump).copy_from_slice(&numbers);
        for n in 0..MODES {
            self.bob(lump, n)[3..].fill(0.0);
        }
        *self.ball_state(lump) = BallState::Flying;
        let [dv, _] = self.apply_impulse([[0.0; 3], moment], t);
        self.evaluate_at(t);
        let loss = before - self.energy_with(dv);
        *self.dissipated() += loss;
    }

    /// Lets detached liquid bounce off the wall, or puts it into a sliding state if it is slow and pressed to the wall.
    fn throw_back(&mut self, lump: usize, t: f64) {
        let before = self.memory();
        let (e, contact_speed) = self.lump(lump).restitution();
        if e * self.lump(lump).approach() <= contact_speed {
            if self.lump(lump).is_outside() {
                self.bring_to_wall(lump, t);
            }
            self.strike(lump, 0.0, t);
            let stays = [BallState::Sliding, BallState::Light];
            if stays.into_iter().any(|state| self.try_on_wall(lump, state, t)) {
                return;
            }
            self.restore(&before);
            self.evaluate_at(t);
        }
        self.strike(lump, e, t);
    }

    /// Moves detached liquid back onto the wall if a step of an external integrator (Model Exchange) has carried it through the
    /// wall. The velocity of the liquid, the common centre of mass and the angular momentum do not change.
    fn bring_to_wall(&mut self, lump: usize, t: f64) {
        let before = self.energy_with([0.0; 3]);
        let (mass, of_center) = self.drift_of_center();
        let (strayed, w) = (self.lump(lump), self.motion()[1][0]);
        let moved = sub(strayed.on_wall_beside(), strayed.position());
        let velocity = add(cross(w, strayed.position()), strayed.rate());
        let lever = scale(-strayed.m, cross(moved, sub(velocity, of_center)));
        let rate = sub(strayed.rate(), cross(w, moved));
        let numbers = strayed.numbers(strayed.on_wall_beside(), rate);
        let share = -strayed.m / mass;
        self.ball(lump).copy_from_slice(&numbers);
        self.shift(scale(share, moved));
        let [dv, _] = self.apply_impulse([[0.0; 3], lever], t);
        self.evaluate_at(t);
        let loss = before - self.energy_with(dv);
        *self.dissipated() += loss;
    }

    /// Puts the detached liquid on the wall in the sliding state `on_wall`. Returns true if it is pressed to the wall there.
    fn try_on_wall(&mut self, lump: usize, on_wall: BallState, t: f64) -> bool {
        *self.ball_state(lump) = on_wall;
        self.is_pressed(lump, t)
    }

    fn strike(&mut self, lump: usize, e: f64, t: f64) {
        let struck = self.lump(lump);
        let (m, v_n) = (struck.m, struck.approach());
        let impulse = struck.impulse(self.factors(), e);
        self.apply_impulse(impulse, t);
        let change = self.lump(lump).numbers([0.0; 3], scale(-1.0 / m, impulse[0]));
        let numbers = self.ball(lump);
        for i in 3..6 {
            numbers[i] += change[i];
        }
        // The impulse is J = (1 + e) mu v_n.
        let j = libm::sqrt(dot(impulse[0], impulse[0]));
        *self.dissipated() += (1.0 - e) * j * v_n / 2.0;
    }

    /// Lets the pendulums of the tank take over the detached liquid. Returns true if the energy decreases, as it must. If it
    /// returns false, the states are invalid and the caller has to restore them.
    fn settle(&mut self, lump: usize, t: f64) -> bool {
        let before = self.energy_with([0.0; 3]);
        let (mass, of_center) = self.drift_of_center();
        let (settling, w) = (self.lump(lump), self.motion()[1][0]);
        let p = settling.hanging();
        // Each part of the liquid moves to its hinge with its velocity unchanged, so that the angular momentum about the
        // common centre of mass is conserved.
        let moved = sub(settling.common_center(&p), settling.position());
        let velocity = add(cross(w, settling.position()), settling.rate());
        let lever = scale(-settling.m, cross(moved, sub(velocity, of_center)));
        let left_with = settling.shape(&self.directions(lump)).inertia;
        let grown = sub(times(&settling.shape(&p).inertia, w), times(&left_with, w));
        let ([force, torque], rates) = settling.caught(&p, sub(settling.rate(), cross(w, moved)));
        let torque = add(torque, sub(lever, grown));
        let (share, at_rest) = (-settling.m / mass, settling.at_rest());
        self.shift(scale(share, moved));
        for n in 0..MODES {
            let bob = self.bob(lump, n);
            bob[..3].copy_from_slice(&p[n]);
            bob[3..].copy_from_slice(&rates[n]);
        }
        self.ball(lump).copy_from_slice(&at_rest);
        *self.ball_state(lump) = BallState::Settled;
        let [dv, _] = self.apply_impulse([force, torque], t);
        self.evaluate_at(t);
        let loss = before - self.energy_with(dv);
        *self.dissipated() += loss;
        // The tolerance allows for rounding errors.
        loss >= -1e-14 * before
    }
}

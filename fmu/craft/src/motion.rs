//! The equations of motion of the craft (rigid body, wheels, bobs of the slosh modes) as power series in time:
//!
//! ```text
//! M [a; w'] = [ f - w x (w x S) + sum of F ; tau - h_w' - w x (I w + h_w) + sum of torque ]
//! M = M_R + sum of m u u^T,   u = [p; P x p]        rigid part and bobs (rigid.rs, bob.rs)
//! q' = q o (0, w)/2
//! V' = C a,  r' = V                                  C: body to inertial axes
//! work' = f.C^T V + (tau - h_w').w
//! ```
//!
//! F and torque are the forces of the bobs on the craft and their torques about O, without the terms in M. M is factorised
//! once per expansion, because coefficient n of [a; w'] solves the same system at every order.
//!
//! Velocity and position are expanded in body axes, as changes of V_0 and r_0, their values at the start of the step:
//!
//! ```text
//! V = V_0 + C gain,        gain' = a - w x gain
//! r = r_0 + V_0 t + C path,  path' = gain - w x path
//! C^T V_0 = drift,        drift' = -w x drift
//! ```
//!
//! The rounding error is then relative to the change within a step, however fast and far from the origin the craft is.
//!
//! If O is on a pivot, a = -C^T g is given, and a' = -w x a. Then only the lower half of the system is solved. tau includes
//! the pivot's torque (pivot.rs), which depends on the pivot's axis Z = C^T e_z, with Z' = -w x Z.
//!
//! Bobs that are guided in planes or move on other surfaces than spheres add matrices of rank one to M (constrained.rs).
//!
//! Liquid that spins (spin.rs) adds a couple, which depends on w and on the states of the tank.
//!
//! If the liquid of a tank has detached, the tank has no rigid liquid and no bobs. Instead it has one free body, the
//! lump, and an inertia that rotates with the tank (lump.rs). The change from bobs to lump and back is an impulse at the
//! root of an event function.
//!
//! Source: Newton-Euler about O with the bobs' tensions eliminated.

use alloc::boxed::Box;
use alloc::vec::Vec;
use alloc::{format, vec};
use core::ops::ControlFlow;

use taylor::at_each_order;
use taylor::error::StepError;
use taylor::integrator::{
    self, Convergence, Expansion, KeptMotion, MAX_MAGNITUDE, Motion, RATE_FLOOR, Steps, add_time,
};
use taylor::number::Number;
use taylor::series::{self, ORDER, Series, ZERO};
use taylor::space::{
    self, Attitude, Pair, Vector, ZERO_ATTITUDE, ZERO_PAIR, ZERO_VECTOR, cross, cross_pair,
    cross_ramp, dot_ramp, next, product_coefficients, products, quaternion_rate, ramp,
};
use taylor::vector::{
    self, Mat3, Vec3, add, largest, part, rotation, scale, sub, times, transposed_times,
    unit_quaternion, unit_quaternion_slope,
};

use crate::appendage::{Deformed, Flexing, Structure};
use crate::bob::{Bob, BobNow};
use crate::constrained::ConstrainedBob;
use crate::handover::Carrier;
use crate::lump::{Directions, Due, Lump};
use crate::parameters::{Limits, Mount, Parameters, Tank};
use crate::pivot::{Pivot, Rubbing};
use crate::rigid::{Factors, Mat6, Rigid, add_rank_one, along_rod};
use crate::spin::SpinSeries;
use crate::state::{BallState, Inputs, Kept, STATES, State, index};

/// Longest time, s, for which the change of the rates is added to the magnitudes to which allowed
/// errors are relative. Only much longer steps could change the rates by more.
pub const SCALE_TIME: f64 = 0.1;

/// Returns coefficient n of the matrix w w^T - |w|^2 1, which maps a vector y to w x (w x y). The argument is coefficient n
/// of the elements xx, yy, zz, xy, xz, yz of w w^T.
#[inline(always)]
pub fn twice_crossed([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> Mat3 {
    [[-yy - zz, xy, xz], [xy, -xx - zz, yz], [xz, yz, -xx - yy]]
}

/// Returns the gyroscopic torque w x (I w) of a body with the `inertia` I, from the elements of w w^T. The torque is
/// linear in these elements, so that the function also works for a coefficient of their power series.
#[inline(always)]
fn gyroscopic(inertia: &Mat3, [xx, yy, zz, xy, xz, yz]: [f64; 6]) -> Vec3 {
    let columns = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let element = |k: usize, j: usize| vector::dot(inertia[k], columns[j]);
    [element(2, 1) - element(1, 2), element(0, 2) - element(2, 0), element(1, 0) - element(0, 1)]
}

/// Replaces the upper three equations of M [a; w'] = b by [a; w'] = b, so that the solution contains the upper three elements of
/// the right-hand side unchanged. On a pivot they are the given acceleration a.
#[inline(always)]
fn hold_upper_rows(matrix: &mut Mat6) {
    for i in 0..3 {
        for j in 0..6 {
            let one = if i == j { 1.0 } else { 0.0 };
            (matrix[i][j], matrix[j][i]) = (one, one);
        }
    }
}

/// The place that holds the states at the start of the expansion. A step copies these states only if they are needed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Start {
    /// The step continues the expansion of an earlier step. The states at its start are in
    /// `state.kept`.
    Kept,
    /// The expansion starts together with the step. The states at its start are in `before`.
    Step,
    /// The expansion starts within the step. The states at its start are in `begin`.
    Within,
}

/// State of a craft and the power series of its motion.
#[derive(Clone, Debug)]
pub struct CraftMotion {
    pub state: State,
    pub inputs: Inputs,
    pub mount: Mount,
    gravity: Vec3,
    pub pivot: Pivot,
    on_springs: bool,
    rubbing: Vec<Rubbing>,
    upright: Vector,
    spins: Vec<SpinSeries>,
    has_couples: bool,
    couple: Vec3,        // torque of pivot and spinning liquids
    loss_of_couple: f64, // power that `couple` dissipates
    pub craft: Rigid,    // dry craft
    pub rigid: Rigid,
    mass_matrix: Mat6,
    pub liquids: Vec<Rigid>,
    pub bobs: Vec<Bob>,
    constrained: Vec<ConstrainedBob>,
    parked: Vec<Bob>, // bobs of tanks whose liquid has detached
    pub lumps: Vec<Lump>,
    flexing: Option<Box<Flexing>>,
    any_apart: bool,
    has_events: bool,
    /// Index of the constrained bob, if any, whose slosh angle reaches the limit of its mode at the
    /// end of the expansion.
    beyond: Option<usize>,
    /// Number of the detached liquid that has an event at the end of the expansion, and this event, if any.
    due: Option<(usize, Due)>,
    follows: bool,
    whole: Rigid, // craft and liquids at rest as one rigid body, for the drag
    along: Vec<[Vec3; 2]>,
    matrix: Mat6, // M
    factors: Factors,
    force: [Vec3; 2],
    torque: [Vec3; 2], // tau - h_w'
    pub h: [Vec3; 2],
    pub q: Attitude,
    pub w: Vector,
    w_both: Pair, // (w, w)
    pub w_d: Vector,
    pub a: Vector,
    gain: Vector,
    travel: Pair,
    pub drift: Vector,
    speed: Vector,
    pub work: Series,
    pub dissipation: Series,
    inv_allowed: [f64; 4], // 1/allowed errors of attitude, angular velocity, bobs' v, and velocity
    lumps_allowed: f64,    // 1/allowed error of the lumps' u
    flexing_allowed: f64,  // 1/allowed error of the appendages' rates
    spins_allowed: f64,    // 1/allowed error of the spins' I^-1 L
    longest: f64,
    expansion: Expansion,
    start: Start,
    /// Number of states, counted from the first, that include all states which a step may change.
    /// Only these states are copied, because three quarters of the states of a small craft are not
    /// in use.
    pub changing: usize,
    /// Continuous states at the start of the step, of which only the first [`CraftMotion::changing`] are valid.
    pub before: [f64; STATES],
    /// States at the start of the expansion if it starts within a step ([`Start::Within`]). Only
    /// the first `changing` states are valid.
    begin: [f64; STATES],
    /// Derivatives of the angular velocity w and of the velocity V of O at the end of the
    /// expansion, body axes.
    slopes: [Vec3; 2],
}

impl CraftMotion {
    pub fn new(p: &Parameters, state: State) -> CraftMotion {
        // Parameters of tanks that are not in use may have any value within their ranges.
        let tanks: Vec<Tank> = p.tank[..p.tanks].iter().map(Tank::resolve).collect();
        let liquids: Vec<Rigid> = tanks.iter().map(Tank::rigid).collect();
        let rigid = liquids.iter().fold(p.craft.rigid(), |sum, tank| sum.combined_with(tank));
        let modes = || {
            let tanks = tanks.iter().enumerate();
            tanks.flat_map(|(i, tank)| (0..tank.modes).map(move |n| (tank, i, n)))
        };
        let constrained: Vec<_> =
            modes().filter_map(|(tank, i, n)| ConstrainedBob::new(tank, i, n)).collect();
        let free = |(tank, _, n): &(&Tank, usize, usize)| !tank.is_constrained(*n);
        let bobs: Vec<Bob> =
            modes().filter(free).map(|(tank, i, n)| Bob::new(tank, i, n)).collect();
        let mass_matrix = rigid.mass_matrix();
        let pivot = if p.mount == Mount::Pivot { p.pivot } else { Pivot::default() };
        let axes = if pivot.friction.acts() { 0..3 } else { 0..0 };
        let spins = tanks.iter().enumerate().filter_map(|(i, tank)| SpinSeries::new(tank, i));
        let spins: Vec<_> = spins.collect();
        let mut motion = CraftMotion {
            state,
            inputs: Inputs::default(),
            mount: p.mount,
            gravity: p.gravity,
            pivot,
            on_springs: pivot.acts(),
            rubbing: axes.map(|i| Rubbing::new(&pivot.friction, i)).collect(),
            upright: ZERO_VECTOR,
            has_couples: pivot.acts() || !spins.is_empty(),
            spins,
            couple: [0.0; 3],
            loss_of_couple: 0.0,
            craft: p.craft.rigid(),
            rigid,
            mass_matrix,
            liquids,
            follows: bobs.iter().any(Bob::follows)
                || constrained.iter().any(ConstrainedBob::follows),
            whole: rigid,
            along: vec![[[0.0; 3]; 2]; bobs.len() + constrained.len()],
            matrix: mass_matrix,
            factors: Factors::new(&mass_matrix),
            force: [[0.0; 3]; 2],
            torque: [[0.0; 3]; 2],
            h: [[0.0; 3]; 2],
            q: ZERO_ATTITUDE,
            w: ZERO_VECTOR,
            w_both: ZERO_PAIR,
            w_d: ZERO_VECTOR,
            a: ZERO_VECTOR,
            gain: ZERO_VECTOR,
            travel: ZERO_PAIR,
            drift: ZERO_VECTOR,
            speed: ZERO_VECTOR,
            work: ZERO,
            dissipation: ZERO,
            inv_allowed: [0.0; 4],
            longest: modes().fold(0.0, |longest, (tank, _, n)| tank.length[n].max(longest)),
            parked: Vec::with_capacity(bobs.len()),
            bobs,
            flexing: Structure::new(&p.appendage[..p.appendages], p.craft.rigid())
                .map(|structure| Box::new(Flexing::new(structure))),
            any_apart: false,
            has_events: false,
            beyond: None,
            constrained,
            lumps: match p.mount {
                Mount::Free => {
                    (0..).zip(&tanks).filter_map(|(i, tank)| Lump::new(tank, i)).collect()
                }
                Mount::Pivot => Vec::new(),
            },
            due: None,
            lumps_allowed: 0.0,
            flexing_allowed: 0.0,
            spins_allowed: 0.0,
            expansion: Expansion::default(),
            start: Start::Step,
            changing: modes().map(|(_, i, n)| index::bob(i, n + 1)).fold(index::BOBS, usize::max),
            before: [0.0; STATES],
            begin: [0.0; STATES],
            slopes: [[0.0; 3]; 2],
        };
        motion.has_events = !motion.lumps.is_empty() || !motion.constrained.is_empty();
        let only_bobs = motion.lumps.is_empty() && motion.spins.is_empty();
        if !only_bobs || motion.flexing.is_some() {
            motion.changing = STATES;
        }
        motion.freeze();
        motion.arrange();
        motion
    }

    /// Computes one rigid body of craft and liquids at rest. The acceleration of this body along the tanks determines the
    /// drag of the bobs.
    fn freeze(&mut self) {
        let point = |m: f64, at: Vec3| Rigid::new(m, at, &[[0.0; 3]; 3]);
        let constrained = self.constrained.iter().map(|bob| point(bob.m, bob.at_rest()));
        let bobs = self.bobs.iter().map(|bob| point(bob.m, bob.at_rest())).chain(constrained);
        self.whole = bobs.fold(self.rigid, |sum, bob| sum.combined_with(&bob));
        let mut matrix = self.whole.mass_matrix();
        if self.mount == Mount::Pivot {
            hold_upper_rows(&mut matrix);
        }
        let factors = Factors::new(&matrix);
        let constrained = self.constrained.iter().map(ConstrainedBob::along_axis);
        let axes = self.bobs.iter().map(Bob::along_axis).chain(constrained);
        for (along, axis) in self.along.iter_mut().zip(axes) {
            *along = factors.solve(axis);
        }
    }

    /// Replaces the rigid liquids and the bobs by the contents of `tanks`, which must have as many tanks
    /// and modes as before.
    pub fn refill<'a>(&mut self, tanks: impl Iterator<Item = &'a Tank> + Clone) {
        self.rigid = self.craft;
        for (liquid, tank) in self.liquids.iter_mut().zip(tanks.clone()) {
            *liquid = tank.rigid();
            self.rigid = self.rigid.combined_with(liquid);
        }
        self.mass_matrix = self.rigid.mass_matrix();
        for bob in &mut self.bobs {
            if let Some(tank) = tanks.clone().nth(bob.tank) {
                *bob = Bob::new(tank, bob.tank, bob.mode);
            }
        }
        for bob in &mut self.constrained {
            let tank = tanks.clone().nth(bob.tank);
            if let Some(now) = tank.and_then(|tank| ConstrainedBob::new(tank, bob.tank, bob.mode)) {
                *bob = now;
            }
        }
        self.freeze();
    }

    /// Computes the mass matrix M for the present directions of the bobs, and factorises it. On a pivot M is changed so that the
    /// solution contains the given acceleration a unchanged ([`hold_upper_rows`]).
    #[inline(always)]
    fn factorise(&mut self) {
        self.matrix = self.mass_matrix;
        for bob in &self.bobs {
            add_rank_one(&mut self.matrix, bob.m, &along_rod(bob.p[0], bob.hinge));
        }
        if self.any_apart {
            self.add_inertia_apart();
            if self.flexing.is_some() {
                return self.factorise_deformed();
            }
        }
        match self.mount {
            Mount::Free => self.factors.set(&self.matrix),
            Mount::Pivot => {
                let mut held = self.matrix;
                hold_upper_rows(&mut held);
                self.factors.set(&held);
            }
        }
    }

    #[inline(always)]
    fn solve(&self, [force, torque]: [Vec3; 2]) -> [Vec3; 2] {
        let mut torque = torque;
        if self.mount == Mount::Pivot {
            for i in 0..3 {
                torque[i] -= vector::dot(part(&self.matrix[3 + i], 0), force);
            }
        }
        self.factors.solve([force, torque])
    }

    /// Sets the angular momentum of the wheels to `h`. Returns true if it jumps.
    ///
    /// A jump by dh is an impulse on the craft. With the mass matrix M, the velocity and the
    /// angular velocity change by [dV; dw] = M^-1 [0; -dh]. The rate p' of each bob's direction p
    /// changes by l dp' = -(1 - p p^T)(dV + dw x rho). The wheels do the work -dh.(w + dw/2).
    pub fn set_wheels(&mut self, h: Vec3) -> bool {
        if h == self.state.h_wheels {
            return false;
        }
        let jump = sub(h, self.state.h_wheels);
        self.start(0.0);
        self.factorise();
        self.expansion.overwrite(1);
        let [dv, dw] = self.factors.solve([[0.0; 3], scale(-1.0, jump)]);
        let x = &mut self.state.x;
        for i in 0..3 {
            x[index::WORK] -= jump[i] * (x[index::OMEGA + i] + dw[i] / 2.0);
        }
        self.follow_impulse(dv, dw);
        self.state.h_wheels = h;
        true
    }

    /// Updates the states for an impulse that changes the velocity of O by `dv` and the angular
    /// velocity of the craft by `dw`, both in body axes. [`Motion::start`] must have been called.
    #[inline(never)]
    fn follow_impulse(&mut self, dv: Vec3, dw: Vec3) {
        let velocity_change = times(&rotation(&self.q.get(0)), dv);
        let x = &mut self.state.x;
        for i in 0..3 {
            x[index::OMEGA + i] += dw[i];
            x[index::VELOCITY + i] += velocity_change[i];
        }
        for bob in &self.bobs {
            let at = index::bob(bob.tank, bob.mode);
            bob.after_impulse((&mut x[at..at + 6]).try_into().unwrap(), dv, dw);
        }
        for bob in &self.constrained {
            let at = index::bob(bob.tank, bob.mode);
            bob.after_impulse((&mut x[at..at + 6]).try_into().unwrap(), dv, dw);
        }
        for lump in self.lumps.iter().filter(|lump| lump.is_loose()) {
            lump.after_impulse(&mut x[index::ball(lump.tank)..], dv, dw);
        }
        if let Some(flexing) = &self.flexing {
            flexing.after_impulse(x, dv, dw);
        }
    }

    pub fn evaluate(&mut self, inputs: &Inputs) {
        self.inputs = *inputs;
        self.evaluate_at(0.0);
    }

    /// Computes coefficients 0 and 1 of every quantity. Coefficient 1 is here the directional
    /// derivative for a change of the states by `dx` and of the inputs by `df` (force), `dtau`
    /// (torque) and `dh` (momentum of the wheels).
    pub fn evaluate_direction(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        [df, dtau, dh]: [Vec3; 3],
    ) {
        self.evaluate(inputs);
        let x = &self.state.x;
        let [q, dq] = [x, dx].map(|x| [x[0], x[1], x[2], x[3]]);
        self.q.set(1, unit_quaternion_slope(&self.q.get(0), &q, &dq));
        let turn = self.turn();
        let dw = part(dx, index::OMEGA);
        self.w[1] = dw;
        (self.force[1], self.torque[1]) = (df, dtau);
        self.h[1] = dh;
        self.gain[1] = [0.0; 3];
        self.travel.set(1, [0.0; 3], [0.0; 3]);
        match self.mount {
            Mount::Free => {
                let dv = transposed_times(&rotation(&self.q.get(0)), part(dx, index::VELOCITY));
                self.drift[1] = add(dv, vector::cross(self.drift[0], turn));
            }
            Mount::Pivot => self.a[1] = vector::cross(self.a[0], turn),
        }
        if self.on_springs {
            self.upright[1] = vector::cross(self.upright[0], turn);
        }
        for bob in &mut self.bobs {
            let at = index::bob(bob.tank, bob.mode);
            let [x, dx] = [x, dx].map(|x| x[at..at + 6].try_into().unwrap());
            bob.seed_direction(x, dx, self.w[0], dw);
        }
        for lump in self.lumps.iter_mut().filter(|lump| lump.is_loose()) {
            let at = index::ball(lump.tank);
            lump.seed_direction(dx[at..at + 6].try_into().unwrap(), self.w[0], dw);
            lump.seed_shape(&directions(x, lump.tank), &directions(dx, lump.tank));
        }
        if let Some(flexing) = &mut self.flexing {
            flexing.seed_direction(dx, self.w[0], dw);
        }
        self.expand_rates::<1>();
        self.expansion.overwrite(2);
    }

    /// Returns an interval, m/s2, that contains the specific force along the axis of tank number `tank` at the hinge of its first
    /// mode at the end of the last step. Returns `None` if the power series of this step is not known. In tests with random craft
    /// the series erred by at most a thousandth of the interval. The interval is still so narrow that the ranges of validity
    /// seldom depend on it.
    pub fn axial_interval(&self, tank: usize, inputs: &Inputs) -> Option<[f64; 2]> {
        let Kept { clock, start, .. } = self.state.kept;
        let orders = self.expansion.orders();
        if orders == 0 || !self.state.kept.is_continued(inputs, 0.0) {
            return None;
        }
        let Some(bob) = self.bobs.iter().find(|bob| bob.tank == tank && bob.mode == 0) else {
            return Some([0.0; 2]);
        };
        let t = (clock[0] - start[0]) - start[1];
        let force = space::value(&bob.specific_force, orders - 1, t);
        let axial = vector::dot(bob.along_axis()[0], force);
        let error = 1e-6 * largest(force) + 1e4 * self.longest / self.inv_allowed[2];
        Some([axial - error, axial + error])
    }

    /// Returns the rotation vector `turn` (rad, body axes) that corresponds to coefficient 1 of the attitude's power series:
    /// q_1 = q_0 o (0, turn)/2.
    fn turn(&self) -> Vec3 {
        let [a, x, y, z] = self.q.get(0);
        let [b, v @ ..] = self.q.get(1);
        let u = [x, y, z];
        let sum = add(sub(scale(a, v), scale(b, u)), scale(-1.0, vector::cross(u, v)));
        scale(2.0, sum)
    }

    pub fn set_state(&mut self, state: &State) {
        self.state = *state;
        self.expansion.clear();
    }

    /// Advances the states by `h` > 0, s. With `is_continued` the step continues the expansion in `state.kept`, whose inputs
    /// must be in the field `inputs`. Otherwise a new expansion starts: from the present states if the inputs have jumped
    /// (`has_jumped`), else from the states in the field `before`. If an error is returned, the states are invalid, and the
    /// expansion in `state.kept` is unchanged.
    // The preparation of a step is a function of its own, because both take more instructions if they are compiled together.
    #[inline(never)]
    pub fn advance(
        &mut self,
        h: f64,
        (is_continued, has_jumped): (bool, bool),
        limits: Limits,
    ) -> Result<(), StepError> {
        let (mut steps, changing) = (limits.steps(), self.changing);
        let State { x, kept, time, .. } = &mut self.state;
        let time = *time;
        let (mut clock, mut start) = ([0.0; 2], [0.0; 2]);
        if is_continued {
            x[..changing].copy_from_slice(&kept.x[..changing]);
            (clock, start) = (kept.clock, kept.start);
            self.start = Start::Kept;
        } else {
            self.expansion.clear();
            self.start = Start::Step;
            if has_jumped {
                self.keep();
            }
        }
        let origin = time - clock[0];
        clock = add_time(clock, h);
        let times = (clock[0], &mut start);
        integrator::advance_kept(self, times, limits.tolerance, &mut steps)
            .map_err(|why| why.delayed(origin))?;
        let State { x, kept, .. } = &mut self.state;
        if !kept.is_used() {
            kept.x = *x;
        }
        match self.start {
            Start::Kept => {}
            Start::Step => kept.renew(&self.before[..changing], &self.inputs),
            Start::Within => kept.renew(&self.begin[..changing], &self.inputs),
        }
        (kept.clock, kept.start) = (clock, start);
        Ok(())
    }

    #[inline(always)]
    fn expand_rates<const N: usize>(&mut self) {
        // The torques of pivot and spinning liquids are computed before the sums below. After them they would occupy
        // registers in every craft, which costs 4 % of a step.
        if self.has_couples {
            self.set_couples::<N>();
        }
        if self.follows {
            self.set_axial::<N>();
        }
        self.w_both.set(N, self.w[N], self.w[N]);
        let ww = products::<N>(&self.w);
        let w2 = twice_crossed(ww);
        let mut force = sub(ramp::<N>(&self.force), times(&w2, self.rigid.moment));
        let mut torque = sub(
            ramp::<N>(&self.torque),
            add(gyroscopic(&self.rigid.inertia, ww), cross_ramp::<N>(&self.w, &self.h)),
        );
        let mut dissipation = 0.0;
        if self.has_couples {
            torque = add(torque, self.couple);
            dissipation = self.loss_of_couple;
        }
        for bob in &mut self.bobs {
            let [f, tau] = bob.reaction::<N>(&self.w_both, &w2);
            force = add(force, f);
            torque = add(torque, tau);
        }
        if self.any_apart {
            [force, torque] = self.add_reactions_apart(N, [force, torque]);
        }
        if N == 0 {
            self.factorise();
        }
        if self.mount == Mount::Pivot {
            force = self.a[N];
        }
        let [a, w_d] = self.solve([force, torque]);
        self.w_d[N] = w_d;
        let q_d = quaternion_rate::<N>(&self.q, &self.w_both);
        self.q.set_next(N, q_d);
        self.work[N] = dot_ramp::<N>(&self.torque, &self.w);
        match self.mount {
            Mount::Free => {
                self.a[N] = a;
                self.speed[N] = add(self.drift[N], self.gain[N]);
                self.work[N] += dot_ramp::<N>(&self.force, &self.speed);
                let turned = cross_pair::<N>(&self.w_both, &self.travel);
                let gain = self.gain[N];
                let rates = [0, 1, 2].map(|i| [a[i] - turned[i][0], gain[i] - turned[i][1]]);
                self.travel.set_next(N, rates);
                self.gain[N + 1] = self.travel.get(N + 1)[0];
                self.drift[N + 1] = next::<N>(cross::<N>(&self.drift, &self.w));
            }
            Mount::Pivot => self.a[N + 1] = next::<N>(cross::<N>(&self.a, &self.w)),
        }
        self.w[N + 1] = next::<N>(w_d);
        for bob in &mut self.bobs {
            bob.accelerate::<N>(self.a[N], w_d);
            dissipation += bob.dissipation::<N>();
        }
        if self.any_apart {
            dissipation = self.accelerate_apart(N, dissipation);
        }
        self.dissipation[N] = dissipation;
    }

    #[inline(never)]
    fn set_couples<const N: usize>(&mut self) {
        (self.couple, self.loss_of_couple) = ([0.0; 3], 0.0);
        if self.on_springs {
            self.set_torque_of_pivot::<N>();
        }
        let CraftMotion { spins, constrained, w, couple, loss_of_couple, .. } = self;
        for spin in spins {
            let (torque, power) = spin.expand(N, w[N], constrained);
            *couple = add(*couple, torque);
            *loss_of_couple += power;
        }
    }

    #[inline(always)]
    fn set_torque_of_pivot<const N: usize>(&mut self) {
        let ww = products::<N>(&self.w);
        (self.couple, self.loss_of_couple) = self.pivot.load::<N>(&self.upright, &self.w, ww);
        for (i, rubbing) in self.rubbing.iter_mut().enumerate() {
            let (torque, power) = rubbing.expand(N, self.w[N][i]);
            self.couple[i] -= torque;
            self.loss_of_couple += power;
        }
        self.upright[N + 1] = next::<N>(cross::<N>(&self.upright, &self.w));
    }

    /// Computes, for each tank and hinge, coefficient N of the specific force along the tank's axis at the hinge P, e.(a +
    /// w' x P + w x (w x P)). Here a and w' are the accelerations of craft and liquids at rest as one rigid body.
    #[inline(never)]
    fn set_axial<const N: usize>(&mut self) {
        let ww = products::<N>(&self.w);
        let (whole, w2) = (&self.whole, twice_crossed(ww));
        let gyroscopic = add(gyroscopic(&whole.inertia, ww), cross_ramp::<N>(&self.w, &self.h));
        let mut torque = sub(ramp::<N>(&self.torque), gyroscopic);
        let force = match self.mount {
            Mount::Free => sub(ramp::<N>(&self.force), times(&w2, whole.moment)),
            Mount::Pivot => {
                torque = sub(torque, vector::cross(whole.moment, self.a[N]));
                self.a[N]
            }
        };
        if self.has_couples {
            torque = add(torque, self.couple);
        }
        // `zip` is not used because some compilers do not inline it here, which costs 1 % of a step.
        for (i, bob) in self.bobs.iter_mut().enumerate() {
            let [by_force, by_torque] = self.along[i];
            let [e, _] = bob.along_axis();
            let turning = vector::dot(e, times(&w2, bob.hinge));
            bob.set_axial::<N>(
                vector::dot(by_force, force) + vector::dot(by_torque, torque) + turning,
            );
        }
        if self.any_apart {
            self.set_axial_apart(N, [force, torque]);
        }
    }

    #[inline(never)]
    fn drag_convergence_radius(&self) -> f64 {
        let constrained = self.constrained.iter().map(ConstrainedBob::convergence_radius);
        self.bobs
            .iter()
            .map(Bob::convergence_radius)
            .chain(constrained)
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns the error of the bobs' velocities at the time `h`, divided by the allowed error, that arises because the
    /// series of the drag end at order n.
    #[inline(never)]
    fn drag_defect(&self, n: usize, h: f64) -> f64 {
        let constrained = self.constrained.iter().map(|bob| bob.defect(n, h));
        let all = self.bobs.iter().map(|bob| bob.defect(n, h)).chain(constrained);
        all.fold(0.0, f64::max) * self.inv_allowed[2]
    }

    #[inline(never)]
    fn friction_convergence_radius(&self) -> f64 {
        let about = |(i, rubbing): (usize, &Rubbing)| {
            rubbing.convergence_radius([self.w[0][i], self.w[1][i], self.w[2][i]])
        };
        self.rubbing.iter().enumerate().map(about).fold(f64::INFINITY, f64::min)
    }

    pub fn state_rates<const N: usize>(&self, x: &[f64; STATES]) -> [f64; STATES] {
        let mut rate = [0.0; STATES];
        let mut put = |at: usize, numbers: &[f64]| {
            rate[at..at + numbers.len()].copy_from_slice(numbers);
        };
        put(index::Q, &self.q.get(N + 1).map(|q| q * (N + 1) as f64));
        put(index::OMEGA, &self.w_d[N]);
        if self.mount == Mount::Free {
            let mut a = self.a[N];
            if N == 1 {
                a = add(a, vector::cross(self.turn(), self.a[0]));
            }
            put(index::POSITION, &part(x, index::VELOCITY));
            put(index::VELOCITY, &times(&rotation(&self.q.get(0)), a));
        }
        put(index::WORK, &[self.work[N]]);
        put(index::DISSIPATED, &[self.dissipation[N]]);
        for bob in &self.bobs {
            put(index::bob(bob.tank, bob.mode), &bob.rates::<N>(&self.w, &self.w_d));
        }
        for lump in self.lumps.iter().filter(|lump| lump.is_loose()) {
            put(index::ball(lump.tank), &lump.rates(N, &self.w, &self.w_d));
        }
        if let Some(flexing) = &self.flexing {
            let [eta_d, eta_dd] = flexing.rates(N);
            put(index::ETA, &eta_d);
            put(index::ETA_DOT, &eta_dd);
        }
        rate
    }
}

impl Motion for CraftMotion {
    #[inline(always)]
    fn start(&mut self, t: f64) {
        if !self.lumps.is_empty() {
            self.arrange();
        }
        let Inputs { force, torque, h_wheels, .. } = &self.inputs;
        self.force = [force.value_at(t), force.slope];
        self.torque = [sub(torque.value_at(t), h_wheels.slope), torque.slope];
        self.h = [h_wheels.value_at(t), h_wheels.slope];
        let x = &self.state.x;
        let q = unit_quaternion([x[0], x[1], x[2], x[3]]);
        self.q.set(0, q);
        self.w[0] = part(x, index::OMEGA);
        let axes = rotation(&q);
        match self.mount {
            Mount::Free => self.drift[0] = transposed_times(&axes, part(x, index::VELOCITY)),
            Mount::Pivot => self.a[0] = scale(-1.0, transposed_times(&axes, self.gravity)),
        }
        if self.on_springs {
            self.upright[0] = axes[2];
        }
        for bob in &mut self.bobs {
            let at = index::bob(bob.tank, bob.mode);
            bob.start(x[at..at + 6].try_into().unwrap(), self.w[0]);
        }
        for spin in &mut self.spins {
            spin.start(part(x, index::spin(spin.tank)));
        }
        if self.any_apart {
            self.start_apart();
        }
    }

    #[inline(always)]
    fn rates(&mut self, n: usize) {
        const RATES: [fn(&mut CraftMotion); ORDER] = at_each_order!(CraftMotion::expand_rates);
        RATES[n](self)
    }

    #[inline(always)]
    fn set_error_scale(&mut self, h: f64, allowed: f64) -> f64 {
        let time = h.min(SCALE_TIME);
        let rate = RATE_FLOOR + largest(self.w[0]) + largest(self.w[1]) * time;
        let swing = rate
            + self.bobs.iter().map(Bob::rate_scale).fold(0.0, |a, b| if b > a { b } else { a });
        // The speed that the force alone gives would vanish while the force crosses zero. RATE_FLOOR and the bobs' speed keep the
        // scale of the velocity above 0.
        let speed = largest(self.a[0]) * time + self.longest * swing + RATE_FLOOR;
        self.inv_allowed = [1.0, rate, swing, speed].map(|scale| 1.0 / (allowed * scale));
        if !self.spins.is_empty() {
            let fastest = self.spins.iter().map(SpinSeries::rate_scale).fold(rate, f64::max);
            self.spins_allowed = 1.0 / (allowed * fastest);
        }
        if self.any_apart {
            self.set_error_scale_apart(time, allowed, rate);
        }
        let h = if self.follows { h.min(self.drag_convergence_radius()) } else { h };
        if self.rubbing.is_empty() { h } else { h.min(self.friction_convergence_radius()) }
    }

    /// Returns the criterion by which the solver finds the number of terms of the series. With dry friction it
    /// requires four negligible terms in succession, because three successive terms of tanh vanish by symmetry if the
    /// motion starts at rest.
    #[inline(always)]
    fn convergence(&self) -> Convergence {
        if self.rubbing.is_empty() { Convergence::Decay } else { Convergence::Terms(4) }
    }

    #[inline(always)]
    fn coefficient_norm(&self, n: usize) -> f64 {
        let larger = |a: f64, b: f64| if b > a { b } else { a };
        let [attitude, rate, swing, speed] = self.inv_allowed;
        let [q_0, q @ ..] = self.q.get(n);
        // The matrix C is quadratic in q, so that its coefficients are up to 2^n times as large as those of q.
        let q = larger(q_0.abs(), largest(q)) * (1_u64 << n) as f64;
        let v = self.bobs.iter().map(|bob| bob.coefficient_norm(n)).fold(0.0, larger);
        let body = larger(q * attitude, largest(self.w[n]) * rate);
        let spins = self.spins.iter().map(|spin| spin.coefficient_norm(n) * self.spins_allowed);
        let body = spins.fold(body, larger);
        let norm = larger(body, larger(v * swing, largest(self.gain[n]) * speed));
        if self.any_apart { larger(norm, self.coefficient_norm_apart(n)) } else { norm }
    }

    #[inline(always)]
    fn defect(&self, n: usize, h: f64) -> f64 {
        if self.follows { self.drag_defect(n, h) } else { 0.0 }
    }

    #[inline(always)]
    fn event(&mut self, n: usize, h: f64) -> Option<f64> {
        if self.has_events { self.next_event(n, h) } else { None }
    }

    #[inline(always)]
    fn take(
        &mut self,
        n: usize,
        h: f64,
        t: f64,
        _: &mut Steps,
    ) -> Result<ControlFlow<f64>, StepError> {
        let q = unit_quaternion(self.q.value(n, h));
        let w = space::value(&self.w, n, h);
        let x = &mut self.state.x;
        x[index::Q..index::Q + 4].copy_from_slice(&q);
        x[index::OMEGA..index::OMEGA + 3].copy_from_slice(&w);
        if self.mount == Mount::Free {
            let axes = rotation(&q);
            let [gain, path] = self.travel.value(n, h).map(|x| times(&axes, x));
            for i in 0..3 {
                x[index::POSITION + i] += x[index::VELOCITY + i] * h + path[i];
                x[index::VELOCITY + i] += gain[i];
            }
        }
        let [work, dissipated] = series::integrals([&self.work, &self.dissipation], n - 1, h);
        x[index::WORK] += work;
        x[index::DISSIPATED] += dissipated;
        // The comparisons have no branches, so that the processor makes two at once.
        let all_finite = |x: &[f64]| x.iter().fold(true, |all, x| all & (x.abs() < MAX_MAGNITUDE));
        let mut finite = all_finite(&x[..index::BOBS]);
        for bob in &self.bobs {
            let at = index::bob(bob.tank, bob.mode);
            let moved = bob.state_at(x[at..at + 6].try_into().unwrap(), n, h, w);
            finite &= all_finite(&moved);
            x[at..at + 6].copy_from_slice(&moved);
        }
        for spin in &self.spins {
            let l = spin.state_at(n, h);
            finite &= largest(l) < MAX_MAGNITUDE;
            x[index::spin(spin.tank)..][..3].copy_from_slice(&l);
        }
        if self.any_apart {
            finite &= self.take_apart(n, h, w)?;
        }
        if !finite {
            return Err(StepError::NotFinite { time: t });
        }
        if let Some((lump, due)) = self.due.take() {
            self.change(lump, due, t);
        }
        Ok(ControlFlow::Continue(()))
    }
}

impl KeptMotion for CraftMotion {
    #[inline(always)]
    fn expansion(&mut self) -> &mut Expansion {
        &mut self.expansion
    }

    #[inline(never)]
    fn store_slopes(&mut self, n: usize, h: f64) {
        self.slopes = [&self.w_d, &self.a].map(|series| space::value(series, n - 1, h));
        for bob in &mut self.bobs {
            bob.store_slope(n, h);
        }
        for bob in &mut self.constrained {
            bob.store_slope(n, h);
        }
    }

    #[inline(never)]
    fn slope_defect(&self, h: f64) -> f64 {
        let [_, rate, swing, speed] = self.inv_allowed;
        let [w_d, a] = self.slopes;
        let body = f64::max(
            largest(sub(w_d, self.w_d[0])) * rate,
            if self.mount == Mount::Free { largest(sub(a, self.a[0])) * speed } else { 0.0 },
        );
        let constrained = self.constrained.iter().map(ConstrainedBob::slope_defect);
        let bobs = self.bobs.iter().map(Bob::slope_defect).chain(constrained);
        h * bobs.map(|defect| defect * swing).fold(body, f64::max)
    }

    #[inline(always)]
    fn return_to_start(&mut self) {
        let start = match self.start {
            Start::Kept => &self.state.kept.x,
            Start::Step => &self.before,
            Start::Within => &self.begin,
        };
        self.state.x[..self.changing].copy_from_slice(&start[..self.changing]);
    }

    #[inline(always)]
    fn keep(&mut self) {
        self.begin[..self.changing].copy_from_slice(&self.state.x[..self.changing]);
        self.start = Start::Within;
    }
}

// Functions for constrained bobs, detached liquid (lump.rs) and appendages (appendage.rs). They are separate from the equations
// of a craft without these parts, which then take fewer instructions.
impl CraftMotion {
    #[inline(never)]
    fn add_inertia_apart(&mut self) {
        for lump in &self.lumps {
            if let Some(u) = lump.along_normal() {
                add_rank_one(&mut self.matrix, lump.m, &u);
            }
        }
        for bob in &self.constrained {
            bob.add_inertia(&mut self.matrix);
        }
        if let Some(flexing) = &self.flexing {
            flexing.add_inertia(&mut self.matrix);
        }
    }

    #[inline(never)]
    fn factorise_deformed(&mut self) {
        let mut held = self.matrix;
        if self.mount == Mount::Pivot {
            hold_upper_rows(&mut held);
        }
        self.factors = Factors::definite_or_zero(&held);
    }

    #[inline(never)]
    fn start_apart(&mut self) {
        let CraftMotion { lumps, constrained, flexing, state, w, .. } = self;
        for bob in constrained {
            let at = index::bob(bob.tank, bob.mode);
            bob.start(state.x[at..at + 6].try_into().unwrap(), w[0]);
        }
        for lump in lumps.iter_mut().filter(|lump| lump.is_loose()) {
            let at = index::ball(lump.tank);
            lump.start(state.x[at..at + 6].try_into().unwrap(), w[0]);
        }
        if let Some(flexing) = flexing {
            flexing.start(&state.x, w[0]);
        }
    }

    #[inline(never)]
    fn set_axial_apart(&mut self, n: usize, [force, torque]: [Vec3; 2]) {
        let w2 = twice_crossed(product_coefficients(n, &self.w));
        let along = &self.along[self.bobs.len()..];
        for (bob, [by_force, by_torque]) in self.constrained.iter_mut().zip(along) {
            let [e, _] = bob.along_axis();
            let turning = vector::dot(e, times(&w2, bob.hinge));
            let x = vector::dot(*by_force, force) + vector::dot(*by_torque, torque) + turning;
            bob.set_axial(n, x);
        }
    }

    /// Adds coefficient n of the force and of the torque about O with which constrained bobs and detached liquid act on the
    /// craft to `force` and `torque`.
    #[inline(never)]
    fn add_reactions_apart(&mut self, n: usize, [mut force, mut torque]: [Vec3; 2]) -> [Vec3; 2] {
        let ww = product_coefficients(n, &self.w);
        let w2 = twice_crossed(ww);
        for bob in &mut self.constrained {
            let [f, tau] = bob.reaction(n, self.w[n], &w2);
            (force, torque) = (add(force, f), add(torque, tau));
        }
        for lump in self.lumps.iter_mut().filter(|lump| lump.is_loose()) {
            let [f, tau] = lump.reaction(n, &self.w, &self.w_d);
            force = add(force, f);
            torque = add(torque, tau);
            if n == 1 {
                // Adds force and torque of dJ, the derivative of the inertia: dJ w' + w x (dJ w).
                let (w, slope) = (self.w[0], &lump.shape_slope);
                let turned = vector::cross(w, times(slope, w));
                torque = sub(torque, add(times(slope, self.w_d[0]), turned));
            }
        }
        if let Some(flexing) = &mut self.flexing {
            let [f, tau] = flexing.reaction(n, [&self.a, &self.w, &self.w_d], ww);
            (force, torque) = (add(force, f), add(torque, tau));
        }
        [force, torque]
    }

    /// Computes coefficient n of the accelerations of constrained bobs, detached liquid and appendages from coefficient n of
    /// the craft's accelerations. Returns `dissipation` plus their dissipated power.
    #[inline(never)]
    fn accelerate_apart(&mut self, n: usize, mut dissipation: f64) -> f64 {
        for bob in &mut self.constrained {
            bob.accelerate(n, self.a[n], self.w_d[n]);
            dissipation += bob.dissipation(n);
        }
        for lump in self.lumps.iter_mut().filter(|lump| lump.is_loose()) {
            lump.accelerate(n, self.a[n], self.w_d[n]);
            dissipation += lump.dissipation(n);
        }
        if let Some(flexing) = &mut self.flexing {
            flexing.accelerate(n, self.a[n], self.w_d[n]);
            dissipation += flexing.dissipation(n);
        }
        dissipation
    }

    #[inline(never)]
    fn set_error_scale_apart(&mut self, time: f64, allowed: f64, rate: f64) {
        let larger = |a: f64, b: f64| if b > a { b } else { a };
        let swing = self.constrained.iter().map(ConstrainedBob::rate_scale).fold(0.0, larger);
        // All bobs share one scale, which also contributes to the scale of the craft's velocity.
        let [_, _, swings, speed] = &mut self.inv_allowed;
        let fastest = 1.0 / (allowed * (rate + swing));
        *swings = swings.min(fastest);
        *speed = speed.min(fastest / self.longest);
        let loose = self.lumps.iter().filter(|lump| lump.is_loose());
        let fastest =
            loose.fold(RATE_FLOOR, |most, lump| most.max(lump.speed_scale(self.w[0], time)));
        self.lumps_allowed = 1.0 / (allowed * fastest);
        let speed = self.flexing.as_ref().map_or(0.0, |flexing| flexing.speed_scale(time));
        self.flexing_allowed = 1.0 / (allowed * (RATE_FLOOR + speed));
    }

    #[inline(never)]
    fn coefficient_norm_apart(&self, n: usize) -> f64 {
        let loose = self.lumps.iter().filter(|lump| lump.is_loose());
        let lumps = loose.map(|lump| lump.coefficient_norm(n) * self.lumps_allowed);
        let swing = self.inv_allowed[2];
        let bobs = self.constrained.iter().map(|bob| bob.coefficient_norm(n) * swing);
        let flexing = self.flexing.iter().map(|it| it.coefficient_norm(n) * self.flexing_allowed);
        lumps
            .chain(bobs)
            .chain(flexing)
            .fold(0.0, |most, norm| if norm > most { norm } else { most })
    }

    /// Updates the craft, without allocating, after the liquid of a tank has detached or settled.
    /// Rigid liquid and bobs of a tank are parts of the craft only while the liquid is settled.
    fn arrange(&mut self) {
        let mut changed = false;
        for lump in &mut self.lumps {
            let state = self.state.ball[lump.tank];
            let was_loose = lump.is_loose();
            lump.state = state;
            if lump.is_loose() {
                // The shape of detached liquid depends on the directions that the bobs had when the liquid left the bottom.
                let shape = lump.shape(&directions(&self.state.x, lump.tank));
                changed |= self.liquids[lump.tank] != shape;
                self.liquids[lump.tank] = shape;
            } else if was_loose {
                self.liquids[lump.tank] = lump.rigid;
                changed = true;
            }
        }
        self.any_apart = self.lumps.iter().any(Lump::is_loose)
            || !self.constrained.is_empty()
            || self.flexing.is_some();
        if !changed {
            return;
        }
        let CraftMotion { bobs, parked, lumps, .. } = self;
        parked.append(bobs);
        parked.sort_unstable_by_key(|bob| (bob.tank, bob.mode));
        let is_loose = |tank: usize| lumps.iter().any(|lump| lump.tank == tank && lump.is_loose());
        let mut at = 0;
        while at < parked.len() {
            if is_loose(parked[at].tank) {
                at += 1;
            } else {
                bobs.push(parked.remove(at));
            }
        }
        self.rigid = self.liquids.iter().fold(self.craft, |sum, tank| sum.combined_with(tank));
        self.mass_matrix = self.rigid.mass_matrix();
        self.freeze();
    }

    /// Advances the states of constrained bobs, detached liquids and appendages to the time `h`, s,
    /// after the start of the expansion, by their series up to order `n`. `w` is the angular
    /// velocity at that time. Returns true if the new states are finite and not too large.
    ///
    /// # Errors
    ///
    /// If a slosh angle or the deflection of an appendage has reached the limit for which its mode
    /// is valid.
    #[inline(never)]
    fn take_apart(&mut self, n: usize, h: f64, w: Vec3) -> Result<bool, StepError> {
        if let Some(bob) = self.beyond.take() {
            let bob = &self.constrained[bob];
            return Err(StepError::Model(bob.bound_message(&format!("tank[{}]", bob.tank + 1))));
        }
        let (x, mut finite) = (&mut self.state.x, true);
        for bob in &self.constrained {
            let moved = bob.state_at(n, h, w);
            finite &= moved.iter().all(|x| x.abs() < MAX_MAGNITUDE);
            x[index::bob(bob.tank, bob.mode)..][..6].copy_from_slice(&moved);
        }
        for lump in self.lumps.iter().filter(|lump| lump.is_loose()) {
            let at = index::ball(lump.tank);
            let moved = lump.state_at(x[at..at + 6].try_into().unwrap(), n, h, w);
            finite &= moved.iter().all(|x| x.abs() < MAX_MAGNITUDE);
            x[at..at + 6].copy_from_slice(&moved);
        }
        if let Some(flexing) = &self.flexing {
            flexing.write_states(x, n, h);
            finite &= x[index::ETA..].iter().all(|x| x.abs() < MAX_MAGNITUDE);
            if finite {
                self.check_appendages()?;
            }
        }
        Ok(finite)
    }

    /// Returns an error if the deflection of an appendage is so large that its linear model is not valid.
    pub fn check_appendages(&self) -> Result<(), StepError> {
        self.flexing.as_ref().map_or(Ok(()), |flexing| flexing.structure.check(&self.state.x))
    }

    /// Returns the deformed appendages, or their directional derivatives, from coefficients 0 and 1 of their motion.
    pub fn deformed<T: Number>(&self) -> Option<Deformed<T>> {
        self.flexing.as_ref().map(|flexing| flexing.now())
    }

    /// Returns the time, s, of the first event within `h`: an event of detached liquid, or a slosh
    /// angle that reaches the limit for which its mode is valid. Returns `None` if there is no
    /// event.
    #[inline(never)]
    fn next_event(&mut self, n: usize, h: f64) -> Option<f64> {
        let mut first = self.next_of_lumps(n, h);
        self.beyond = None;
        for (i, bob) in self.constrained.iter().enumerate() {
            if let Some(t) = bob.bound(n, first.unwrap_or(h)) {
                (first, self.beyond) = (Some(t), Some(i));
            }
        }
        first
    }

    #[inline(never)]
    fn next_of_lumps(&mut self, n: usize, h: f64) -> Option<f64> {
        self.due = None;
        let mut first = None;
        for (i, lump) in self.lumps.iter().enumerate() {
            let bobs = self.bobs.iter().filter(|bob| bob.tank == lump.tank);
            let motion = [&self.a, &self.w, &self.w_d];
            if let Some((t, due)) = lump.next(n, first.unwrap_or(h), motion, bobs)
                && first.is_none_or(|first| t < first)
            {
                first = Some(t);
                self.due = Some((i, due));
            }
        }
        first
    }

    /// Performs all events of detached liquid that are due now (Model Exchange). Returns true if
    /// there were events. Returns `None` if states are so large that the power series could
    /// overflow.
    pub fn take_due(&mut self, inputs: &Inputs) -> Option<bool> {
        self.inputs = *inputs;
        let mut any = false;
        let is_bounded = |x: &[f64; STATES]| x.iter().all(|x| x.abs() < MAX_MAGNITUDE);
        // The detached liquid of each tank has at most four successive events at one instant.
        for _ in 0..4 * self.lumps.len() {
            if !is_bounded(&self.state.x) {
                return None;
            }
            self.evaluate_at(0.0);
            for n in 1..4 {
                self.rates(n);
            }
            self.expansion.overwrite(4);
            self.next_of_lumps(4, 0.0);
            let Some((lump, due)) = self.due.take() else { break };
            self.change(lump, due, 0.0);
            any = true;
        }
        is_bounded(&self.state.x).then_some(any)
    }

    pub fn indicators(&mut self, inputs: &Inputs, indicators: &mut [f64]) {
        indicators.fill(1.0);
        if self.lumps.is_empty() {
            return;
        }
        self.evaluate(inputs);
        for lump in &self.lumps {
            let i = lump.tank;
            let bobs = self.bobs.iter().filter(|bob| bob.tank == i);
            let now = lump.indicators([&self.a, &self.w, &self.w_d], bobs);
            indicators[2 * i..2 * i + 2].copy_from_slice(&now);
        }
    }
}

impl Carrier for CraftMotion {
    type Memory = State;

    fn memory(&self) -> State {
        self.state
    }

    fn restore(&mut self, memory: &State) {
        self.state = *memory;
    }

    #[inline(never)]
    fn evaluate_at(&mut self, t: f64) {
        self.start(t);
        self.expand_rates::<0>();
        self.expansion.overwrite(1);
    }

    fn lump(&self, lump: usize) -> &Lump {
        &self.lumps[lump]
    }

    fn ball_state(&mut self, lump: usize) -> &mut BallState {
        &mut self.state.ball[self.lumps[lump].tank]
    }

    fn ball(&mut self, lump: usize) -> &mut [f64] {
        &mut self.state.x[index::ball(self.lumps[lump].tank)..][..6]
    }

    fn bob(&mut self, lump: usize, n: usize) -> &mut [f64] {
        &mut self.state.x[index::bob(self.lumps[lump].tank, n)..][..6]
    }

    fn directions(&self, lump: usize) -> Directions {
        directions(&self.state.x, self.lumps[lump].tank)
    }

    fn bobs_beside(&self, lump: usize) -> impl Iterator<Item = BobNow<f64>> {
        let tank = self.lumps[lump].tank;
        self.bobs.iter().filter(move |bob| bob.tank == tank).map(Bob::now::<f64>)
    }

    fn points(&self) -> impl Iterator<Item = BobNow<f64>> {
        let loose = self.lumps.iter().filter(|lump| lump.is_loose()).map(Lump::now::<f64>);
        self.bobs.iter().map(Bob::now::<f64>).chain(loose)
    }

    fn rigid(&self) -> Rigid {
        self.rigid
    }

    fn deformed(&self) -> Option<Deformed<f64>> {
        CraftMotion::deformed(self)
    }

    fn motion(&self) -> [&Vector; 3] {
        [&self.a, &self.w, &self.w_d]
    }

    fn factors(&self) -> &Factors {
        &self.factors
    }

    fn dissipated(&mut self) -> &mut f64 {
        &mut self.state.x[index::DISSIPATED]
    }

    fn apply_impulse(&mut self, impulse: [Vec3; 2], t: f64) -> [Vec3; 2] {
        self.evaluate_at(t);
        let [dv, dw] = self.factors.solve(impulse);
        self.follow_impulse(dv, dw);
        [dv, dw]
    }

    fn shift(&mut self, by: Vec3) {
        let shift = times(&rotation(&self.q.get(0)), by);
        for i in 0..3 {
            self.state.x[index::POSITION + i] += shift[i];
        }
    }

    fn is_pressed(&mut self, lump: usize, t: f64) -> bool {
        self.evaluate_at(t);
        self.lumps[lump].is_pressed()
    }
}

fn directions(x: &[f64; STATES], tank: usize) -> Directions {
    core::array::from_fn(|n| part(x, index::bob(tank, n)))
}

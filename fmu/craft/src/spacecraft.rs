//! A free spacecraft with sloshing tanks: the whole, its steps, and its equations for hosts
//! that integrate themselves.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use taylor::error::StepError;
use taylor::number::{Dual, Number};
use taylor::vector::{dot, unit_quaternion};

use crate::contents::Drains;
use crate::draining::{Acting, Draining, Run};
use crate::motion::CraftMotion;
use crate::outputs::{Now, Outputs};
use crate::parameters::{Limits, Parameters, tolerance_problem};
use crate::ranges;
use crate::sizes::{MODES, TANKS};
use crate::state::{BallState, INPUTS, Inputs, Ranges, STATES, State, index};

/// A rigid body with up to four tanks, free or on a pivot.
#[derive(Clone, Debug)]
pub struct Spacecraft {
    motion: Box<CraftMotion>,
    /// Equations with draining tanks or planar modes, if there are any.
    draining: Option<Box<Draining>>,
    limits: Limits,
    /// Bounds of the tanks in use.
    bounds: Vec<ranges::Bounds>,
}

impl Spacecraft {
    /// A craft at the start of its motion, at `start_time` (s), with the inputs that act
    /// then; `tolerance` is the relative error allowed in rates, directions and attitude,
    /// 1e-14 to 0.1.
    ///
    /// Refused parameters are returned with everything that is wrong with them.
    pub fn new(
        p: &Parameters,
        inputs: &Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Spacecraft, Vec<String>> {
        let mut problems = p.problems();
        problems.extend(tolerance_problem(tolerance));
        if !problems.is_empty() {
            return Err(problems);
        }
        let mut x = [0.0; STATES];
        let mut put = |at: usize, numbers: &[f64]| {
            x[at..at + numbers.len()].copy_from_slice(numbers);
        };
        put(index::Q, &unit_quaternion(p.init.q));
        put(index::OMEGA, &p.init.omega);
        put(index::POSITION, &p.init.position);
        put(index::VELOCITY, &p.init.velocity);
        for i in 0..TANKS {
            if i < p.tanks {
                let tank = p.tank[i].resolve();
                let bobs: f64 = tank.mass[..tank.modes].iter().sum();
                put(index::LIQUID + i, &[tank.m_0 + bobs]);
            }
            for n in 0..MODES {
                let is_used = i < p.tanks && n < p.tank[i].modes;
                let [direction, rate] =
                    if is_used { p.tank[i].at_start(n) } else { [[0.0, 0.0, -1.0], [0.0; 3]] };
                put(index::bob(i, n), &direction);
                put(index::bob(i, n) + 3, &rate);
            }
        }
        for i in 0..p.tanks {
            if let Some(surface) = p.tank[i].resolve().ball_surface() {
                put(index::ball(i) + 2, &[surface.height - surface.half]);
            }
        }
        let flow = inputs.mass_flow.map(|flow| flow.value);
        let h_wheels = inputs.h_wheels.value;
        let ranges = [Ranges::default(); TANKS];
        let ball = [BallState::Settled; TANKS];
        let state = State { time: start_time, x, h_wheels, flow, ranges, ball };
        let mut craft = Spacecraft::resume(p, &state, tolerance);
        craft.motion.state.ranges = craft.ranges(inputs);
        Ok(craft)
    }

    /// A craft that continues from a saved state of one with the same parameters, which
    /// [`Spacecraft::new`] has accepted.
    pub fn resume(p: &Parameters, state: &State, tolerance: f64) -> Spacecraft {
        let draining = Draining::new(p).map(Box::new);
        let limits = Limits { tolerance, max_steps: p.max_steps };
        let tanks = p.tank[..p.tanks].iter().map(|tank| ranges::Bounds::new(&tank.resolve()));
        let motion = Box::new(CraftMotion::new(p, *state));
        Spacecraft { motion, draining, limits, bounds: tanks.collect() }
    }

    /// The present time, s.
    pub fn time(&self) -> f64 {
        self.motion.state.time
    }

    /// Takes the time from the host, s.
    pub fn set_time(&mut self, time: f64) {
        self.motion.state.time = time;
    }

    /// The state, for saving.
    pub fn state(&self) -> &State {
        &self.motion.state
    }

    /// Goes back to a saved state of this craft or of one with the same parameters.
    pub fn set_state(&mut self, state: &State) {
        self.motion.state = *state;
    }

    /// Moves on by exactly `h` > 0 seconds; the inputs run along their ramps. A jump of
    /// `h_wheels` or `mass_flow` since the last step acts as an impulse at the beginning. On an error
    /// the craft is as before.
    pub fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepError> {
        if !(h > 0.0 && h.is_finite()) {
            return Err(StepError::Length { h });
        }
        let before = self.motion.state;
        self.motion.inputs = *inputs;
        self.take_jumps(inputs);
        let done = match &self.draining {
            None => self.motion.advance(h, self.limits),
            Some(craft) => {
                let x = &mut self.motion.state.x;
                Run { craft, inputs }.advance(x, before.time, h, self.limits)
            }
        };
        let state = &mut self.motion.state;
        match done {
            Ok(()) => {
                state.time = before.time + h;
                state.h_wheels = inputs.h_wheels.at(h);
                state.flow = inputs.mass_flow.map(|flow| flow.at(h));
            }
            Err(_) => *state = before,
        }
        done
    }

    /// Outputs of the craft under the inputs' present values; a jump of `h_wheels` or
    /// `mass_flow` since the last step has had its effect.
    pub fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        let before = self.motion.state;
        self.take_jumps(inputs);
        let mut outputs = self.outputs_held(inputs);
        self.motion.state = before;
        self.update_ranges(&mut outputs);
        outputs
    }

    /// The ranges that the tanks' motion is in now.
    pub fn ranges(&mut self, inputs: &Inputs) -> [Ranges; TANKS] {
        let mut outputs = self.outputs_held(inputs);
        self.update_ranges(&mut outputs);
        outputs.tank.map(|tank| tank.ranges)
    }

    /// The ranges as the last event has left them.
    pub fn ranges_held(&self) -> [Ranges; TANKS] {
        self.motion.state.ranges
    }

    /// Returns true if a tank without a model of detached liquid is out of its range.
    pub fn leaves_range(&self, ranges: &[Ranges; TANKS]) -> bool {
        (0..TANKS).any(|i| !ranges[i].in_range && !self.has_ball(i))
    }

    fn has_ball(&self, tank: usize) -> bool {
        self.motion.lumps.iter().any(|lump| lump.tank == tank)
    }

    /// Returns true if every tank without a model of detached liquid is in its range after a step, judged by the liquid's directions at its end and the accelerations during it.
    pub fn is_in_range(&self) -> bool {
        let CraftMotion { bobs, state, .. } = &*self.motion;
        self.bounds.iter().enumerate().filter(|(i, _)| !self.has_ball(*i)).all(|(i, limits)| {
            let mut first = bobs.iter().filter(|bob| bob.tank == i && bob.mode == 0);
            // The accelerations of a craft that drains are its equations' alone.
            let axial = first
                .next()
                .filter(|_| self.draining.is_none())
                .map_or(0.0, |bob| dot(bob.along_axis()[0], bob.specific_force[0]));
            limits.contain(core::array::from_fn(|n| state.x[index::bob(i, n) + 2]), axial)
        })
    }

    /// Brings the ranges among the outputs to what the outputs are now.
    fn update_ranges(&self, outputs: &mut Outputs) {
        for (tank, limits) in outputs.tank.iter_mut().zip(&self.bounds) {
            tank.ranges = limits.of(tank);
        }
    }

    /// [`Spacecraft::outputs`] with the states as the last step or event left them.
    pub fn outputs_held(&mut self, inputs: &Inputs) -> Outputs {
        let x = &self.motion.state.x;
        let mut outputs = if let Some(draining) = &self.draining {
            draining.evaluate(x, &Acting::of(inputs, 0.0)).1.outputs(x)
        } else {
            self.motion.evaluate(inputs);
            self.motion.now::<f64>().outputs(&self.motion.state.x)
        };
        for (tank, ranges) in outputs.tank.iter_mut().zip(self.motion.state.ranges) {
            tank.ranges = ranges;
        }
        outputs
    }

    /// x; see [`index`].
    pub fn continuous_states(&self) -> [f64; STATES] {
        self.motion.state.x
    }

    /// [`Spacecraft::continuous_states`] without a copy.
    pub fn borrow_states(&self) -> &[f64; STATES] {
        &self.motion.state.x
    }

    /// Takes x from the host. Quaternion and directions need not be of unit length.
    pub fn set_continuous_states(&mut self, x: &[f64; STATES]) {
        self.motion.state.x = *x;
    }

    /// x'. Quaternion, directions and their rates are normalised first: those of x keep the
    /// length they have.
    ///
    /// `h_wheels` acts by w x h_w and by its slope. Where the slope is not known, the
    /// reaction -h_w' belongs into `torque`.
    pub fn derivatives(&mut self, inputs: &Inputs) -> [f64; STATES] {
        if let Some(draining) = &self.draining {
            return draining.evaluate(&self.motion.state.x, &Acting::of(inputs, 0.0)).0;
        }
        self.motion.evaluate(inputs);
        self.motion.state_rates::<0>(&self.motion.state.x)
    }

    /// The derivative of x' in the direction (dx, du), du of force, torque, h_wheels: coefficient
    /// 1 of x' along x + dx s, u + du s, exact. Slopes of the inputs are held.
    pub fn directional_derivative(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; INPUTS],
    ) -> [f64; STATES] {
        if let Some((rates, _)) = self.along(inputs, dx, du) {
            return rates.map(Number::result);
        }
        self.motion.evaluate_direction(inputs, dx, split(du));
        self.motion.state_rates::<1>(dx)
    }

    /// The derivative of the outputs in the direction (dx, du), exact. The slosh angles' is 0
    /// where they have none, at 90 degrees.
    pub fn output_derivatives(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; INPUTS],
    ) -> Outputs {
        if let Some((_, now)) = self.along(inputs, dx, du) {
            return now.outputs(dx);
        }
        self.motion.evaluate_direction(inputs, dx, split(du));
        self.motion.now::<Dual>().outputs(dx)
    }

    /// Derivatives of a craft that drains.
    fn along(
        &self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; INPUTS],
    ) -> Option<([Dual; STATES], Now<Dual>)> {
        let x = &self.motion.state.x;
        let along = core::array::from_fn(|i| Dual::of(x[i], dx[i]));
        let draining = self.draining.as_ref()?;
        Some(draining.evaluate(&along, &Acting::along(inputs, du)))
    }

    /// The impulses of what has jumped. Returns whether anything has.
    fn take_jumps(&mut self, inputs: &Inputs) -> bool {
        let Some(draining) = &self.draining else {
            return self.motion.set_wheels(inputs.h_wheels.value);
        };
        let turned = inputs.h_wheels.value != self.motion.state.h_wheels;
        if turned {
            let before = self.motion.state;
            let tanks = draining.tanks(&self.motion.state.x);
            self.motion.refill(tanks.iter());
            self.motion.set_wheels(inputs.h_wheels.value);
            draining.drain_by_impulse(&before, &mut self.motion.state);
        }
        draining.set_flow(&mut self.motion.state, &inputs.mass_flow) || turned
    }

    /// Returns true if liquid of any tank is detached.
    pub fn has_lump(&self) -> bool {
        let CraftMotion { lumps, state, .. } = &*self.motion;
        !lumps.is_empty() && state.ball.iter().any(|state| *state != BallState::Settled)
    }

    /// Functions of states and inputs that cross zero at events, two for each tank: what leaves the present state of the
    /// liquid, and what ends its sliding on the wall; 1 where there is none.
    pub fn event_indicators(&mut self, inputs: &Inputs, indicators: &mut [f64]) {
        self.motion.indicators(inputs, indicators);
    }

    /// Whether a host that integrates itself has passed an event of a liquid, whatever the indicators of its last steps have
    /// shown: the liquid is outside its wall and moves out, or has to leave its bottom or the wall, or may settle.
    pub fn is_event_overdue(&mut self, inputs: &Inputs) -> bool {
        let mut now = [1.0; 2 * TANKS];
        self.event_indicators(inputs, &mut now);
        let at = |tank: usize| [now[2 * tank], now[2 * tank + 1]];
        self.motion.lumps.iter().any(|lump| lump.is_overdue(at(lump.tank)))
    }

    /// Does what is due at an event: a jump of `h_wheels` or `mass_flow` acts as an impulse, and liquid leaves its bottom, meets
    /// the wall or settles. Returns
    /// whether continuous states have changed. On an error nothing has.
    pub fn take_event(&mut self, inputs: &Inputs) -> Result<bool, StepError> {
        let before = self.motion.state;
        let mut changed = self.take_jumps(inputs);
        if !self.motion.lumps.is_empty() {
            changed |= self.motion.take_due(inputs);
        }
        if self.motion.state.x.iter().any(|x| !x.is_finite()) {
            self.motion.state = before;
            return Err(StepError::NotFinite { time: before.time });
        }
        self.motion.state.ranges = self.ranges(inputs);
        Ok(changed)
    }

    /// Refuses masses of liquid, integrated by the host, outside the tanks' tables.
    pub fn check_liquids(&self) -> Result<(), StepError> {
        let x = &self.motion.state.x;
        self.draining.as_ref().map_or(Ok(()), |it| it.check(x))
    }

    /// Takes account of `h_wheels` and `mass_flow` having changed continuously: no impulse is due
    /// for it. For hosts that integrate themselves, after each of their steps.
    pub fn follow_inputs(&mut self, inputs: &Inputs) {
        self.motion.state.h_wheels = inputs.h_wheels.value;
        self.motion.state.flow = inputs.mass_flow.map(|flow| flow.value);
    }
}

fn split(du: &[f64; INPUTS]) -> [[f64; 3]; 3] {
    [[du[0], du[1], du[2]], [du[3], du[4], du[5]], [du[6], du[7], du[8]]]
}

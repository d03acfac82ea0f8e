//! A spacecraft with sloshing tanks, in free flight or on a pivot: its steps for Co-Simulation, and its derivatives
//! for Model Exchange.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;
use taylor::error::StepError;
use taylor::integrator::KeptMotion;
use taylor::number::{Dual, Number};
use taylor::vector::{dot, part, unit_quaternion};

use crate::bob::Bob;
use crate::contents::Drains;
use crate::draining::{Acting, Draining, Run};
use crate::lump::Lump;
use crate::motion::CraftMotion;
use crate::outputs::{Outputs, TankOutputs};
use crate::parameters::{Limits, Parameters, tolerance_problem};
use crate::ranges;
use crate::sizes::{MODES, TANKS};
use crate::state::{BallState, INPUTS, Inputs, Kept, Ranges, STATES, State, index};

/// A rigid body with up to four tanks, free or on a pivot.
#[derive(Clone, Debug)]
pub struct Spacecraft {
    motion: Box<CraftMotion>,
    draining: Option<Box<Draining>>,
    limits: Limits,
    bounds: Vec<ranges::Bounds>,
}

impl Spacecraft {
    /// Creates a craft at the start of its motion, at `start_time` (s), with the values that the inputs have then.
    /// `tolerance` is the allowed relative error of rates, directions and attitude, 1e-14 to 0.1.
    ///
    /// If parameters are invalid, returns the messages of all problems.
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
                put(index::spin(i), &tank.spin_at_start(p.init.omega));
            }
            for n in 0..MODES {
                let is_used = i < p.tanks && n < p.tank[i].modes;
                let [direction, rate] =
                    if is_used { p.tank[i].at_start(n) } else { [[0.0, 0.0, -1.0], [0.0; 3]] };
                put(index::bob(i, n), &direction);
                put(index::bob(i, n) + 3, &rate);
            }
        }
        for (j, appendage) in p.appendage[..p.appendages].iter().enumerate() {
            put(index::ETA + j, &[appendage.eta]);
            put(index::ETA_DOT + j, &[appendage.eta_dot]);
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
        let kept = Kept::NONE;
        let state = State { time: start_time, x, h_wheels, flow, ranges, ball, kept };
        let mut craft = Spacecraft::resume(p, &state, tolerance);
        craft.motion.state.ranges = craft.ranges(inputs);
        Ok(craft)
    }

    /// Creates a craft that continues from the saved state `state`. [`Spacecraft::new`] must have accepted the parameters,
    /// and the state must belong to a craft with the same parameters.
    pub fn resume(p: &Parameters, state: &State, tolerance: f64) -> Spacecraft {
        let draining = Draining::new(p).map(Box::new);
        let limits = Limits { tolerance, max_steps: p.max_steps };
        let tanks = p.tank[..p.tanks].iter().map(|tank| ranges::Bounds::new(&tank.resolve()));
        let mut motion = Box::new(CraftMotion::new(p, *state));
        if draining.is_some() {
            motion.changing = STATES;
        }
        Spacecraft { motion, draining, limits, bounds: tanks.collect() }
    }

    /// Returns the current time, s.
    pub fn time(&self) -> f64 {
        self.motion.state.time
    }

    /// Sets the simulation time, s (Model Exchange).
    pub fn set_time(&mut self, time: f64) {
        self.motion.state.time = time;
    }

    /// Returns the complete state, for saving.
    pub fn state(&self) -> &State {
        &self.motion.state
    }

    /// Restores a saved state of this craft or of a craft with the same parameters.
    pub fn set_state(&mut self, state: &State) {
        self.motion.set_state(state);
    }

    /// Advances by exactly `h` > 0 seconds, during which the inputs follow their ramps. If `h_wheels` or
    /// `mass_flow` has jumped since the last step, the jump acts as an impulse at the beginning. If an error is
    /// returned, the craft is unchanged.
    pub fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepError> {
        if !(h > 0.0 && h.is_finite()) {
            return Err(StepError::Length { h });
        }
        let CraftMotion {
            state: State { time, h_wheels, flow, ball, x, .. },
            before,
            changing,
            ..
        } = &mut *self.motion;
        let (time, h_wheels, flow, ball, changing) = (*time, *h_wheels, *flow, *ball, *changing);
        before[..changing].copy_from_slice(&x[..changing]);
        let drains = self.draining.as_ref().is_some_and(|craft| craft.drains());
        let is_continued = !drains && self.motion.state.kept.is_continued(inputs, h);
        self.motion.inputs = if is_continued { self.motion.state.kept.inputs() } else { *inputs };
        let has_jumped = !is_continued && self.may_jump(inputs) && self.take_jumps(inputs);
        let done = match &self.draining {
            Some(craft) if drains => {
                let x = &mut self.motion.state.x;
                Run { craft, inputs }.advance(x, time, h, self.limits)
            }
            _ => self.motion.advance(h, (is_continued, has_jumped), self.limits),
        };
        let CraftMotion { state, before, inputs: ramps, .. } = &mut *self.motion;
        if done.is_ok() {
            state.time = time + h;
            // The momentum follows from the start of its ramp, so that its rounding error does not depend on the steps.
            state.h_wheels = match drains {
                true => inputs.h_wheels.value_at(h),
                false => ramps.h_wheels.value_at(state.kept.clock[0]),
            };
            state.flow = inputs.mass_flow.map(|flow| flow.value_at(h));
        } else {
            state.x[..changing].copy_from_slice(&before[..changing]);
            (state.h_wheels, state.flow, state.ball) = (h_wheels, flow, ball);
            self.motion.expansion().clear();
        }
        done
    }

    /// Returns the outputs for the present values of the inputs. If `h_wheels` or `mass_flow` has jumped since the last
    /// step, the outputs include the effect of this jump.
    pub fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        // The copy is avoided in most calls, because the state is large and most calls find no jump.
        let may_jump = self.may_jump(inputs);
        let before = may_jump.then_some(self.motion.state);
        if may_jump {
            self.take_jumps(inputs);
        }
        let mut outputs = self.outputs_held(inputs);
        if let Some(before) = before {
            self.motion.state = before;
        }
        self.update_ranges(&mut outputs);
        outputs
    }

    /// Returns for each tank the ranges of validity and the state of its liquid that [`Spacecraft::outputs`] returns, with at
    /// most a fifth of the instructions. Returns `None` if it would need as many instructions.
    pub fn discrete_outputs(&mut self, inputs: &Inputs) -> Option<[(Ranges, BallState); TANKS]> {
        if self.may_jump(inputs) {
            return None;
        }
        let ball = |lump: Option<&Lump>| lump.map_or(BallState::Settled, |lump| lump.state);
        if let Some(ranges) = self.ranges_from_series(inputs) {
            return Some(ranges.map(|ranges| (ranges, ball(None))));
        }
        self.motion.evaluate(inputs);
        let CraftMotion { bobs, lumps, state, a, w, w_d, .. } = &*self.motion;
        let mut all = state.ranges.map(|ranges| (ranges, ball(None)));
        for (i, (all, bounds)) in all.iter_mut().zip(&self.bounds).enumerate() {
            let mut tank = TankOutputs::from_states(&state.x[index::bob(i, 0)..]);
            let bobs = bobs.iter().filter(|bob| bob.tank == i).map(Bob::now::<f64>);
            tank.set_angles([a[0], w[0], w_d[0]], bobs, None, None);
            tank.ball_state = ball(lumps.iter().find(|lump| lump.tank == i && lump.is_loose()));
            *all = (bounds.classify(&tank, state.x[index::LIQUID + i]), tank.ball_state);
        }
        Some(all)
    }

    /// Returns the ranges of validity of settled liquids after a step, from the power series of the step and without an
    /// evaluation of the equations. Returns `None` if a range depends on the small difference between series and equations.
    fn ranges_from_series(&self, inputs: &Inputs) -> Option<[Ranges; TANKS]> {
        if self.has_lump() {
            return None;
        }
        let State { x, ranges, .. } = &self.motion.state;
        let mut ranges = *ranges;
        for (i, (ranges, bounds)) in ranges.iter_mut().zip(&self.bounds).enumerate() {
            let axial = self.motion.axial_interval(i, inputs)?;
            let mut tank = TankOutputs::from_states(&x[index::bob(i, 0)..]);
            let bobs = self.motion.bobs.iter().filter(|bob| bob.tank == i);
            let w = part(x, index::OMEGA);
            tank.turning = bobs.clone().next().map_or(0.0, |bob| dot(bob.along_axis()[0], w));
            let p = tank.p;
            tank.set_wave::<f64>(bobs.map(|bob| (p[bob.mode], bob.wave)));
            *ranges = bounds.classify_within(tank, axial, x[index::LIQUID + i])?;
        }
        Some(ranges)
    }

    /// Returns for each tank the validity of the model for the present motion: the regime of the
    /// wave, the reason if the tank is out of its range, and whether pendulums can represent the
    /// liquid.
    pub fn ranges(&mut self, inputs: &Inputs) -> [Ranges; TANKS] {
        if let Some(known) = self.discrete_outputs(inputs) {
            return known.map(|(ranges, _)| ranges);
        }
        let mut outputs = self.outputs_held(inputs);
        self.update_ranges(&mut outputs);
        outputs.tank.map(|tank| tank.ranges)
    }

    /// Returns for each tank the ranges of validity as they were determined at the last event.
    pub fn ranges_held(&self) -> [Ranges; TANKS] {
        self.motion.state.ranges
    }

    /// Returns true if pendulums cannot represent the liquid of some tank that has no model of
    /// detached liquid: thrust does not hold the liquid at the bottom, or a bob is more than 45
    /// degrees from the tank's axis.
    pub fn leaves_range(&self, ranges: &[Ranges; TANKS]) -> bool {
        (0..TANKS).any(|i| !ranges[i].is_physical && !self.has_ball(i))
    }

    fn has_ball(&self, tank: usize) -> bool {
        self.motion.lumps.iter().any(|lump| lump.tank == tank)
    }

    /// Returns true if after a step the pendulums represent the liquid in every tank without a model of detached liquid. This
    /// depends on the bobs' directions at the end of the step and on the accelerations during the step.
    pub fn is_physical(&self) -> bool {
        let CraftMotion { bobs, state, .. } = &*self.motion;
        self.bounds.iter().enumerate().filter(|(i, _)| !self.has_ball(*i)).all(|(i, limits)| {
            let mut first = bobs.iter().filter(|bob| bob.tank == i && bob.mode == 0);
            // In a draining craft the accelerations follow from its own equations.
            let axial = first
                .next()
                .filter(|_| self.draining.is_none())
                .map_or(0.0, |bob| dot(bob.along_axis()[0], bob.specific_force[0]));
            limits.contain(core::array::from_fn(|n| state.x[index::bob(i, n) + 2]), axial)
        })
    }

    fn update_ranges(&self, outputs: &mut Outputs) {
        let x = &self.motion.state.x;
        for (i, (tank, limits)) in outputs.tank.iter_mut().zip(&self.bounds).enumerate() {
            tank.ranges = limits.classify(tank, x[index::LIQUID + i]);
        }
    }

    /// Returns the outputs as [`Spacecraft::outputs`] does, but without the effect of a jump of `h_wheels` or `mass_flow`
    /// since the last step, and with the ranges of validity as they were at the last event.
    pub fn outputs_held(&mut self, inputs: &Inputs) -> Outputs {
        let x = &self.motion.state.x;
        let mut outputs = if let Some(draining) = &self.draining {
            draining
                .evaluate(x, &Acting::from_inputs(inputs, 0.0))
                .outputs(x, |i| self.bounds.get(i)?.spin_scale())
        } else {
            self.motion.evaluate(inputs);
            self.motion
                .now::<f64>()
                .outputs(&self.motion.state.x, |i| self.bounds.get(i)?.spin_scale())
        };
        for (tank, ranges) in outputs.tank.iter_mut().zip(self.motion.state.ranges) {
            tank.ranges = ranges;
        }
        outputs
    }

    /// Returns the continuous states x, in the order of [`index`].
    pub fn continuous_states(&self) -> [f64; STATES] {
        self.motion.state.x
    }

    /// Returns [`Spacecraft::continuous_states`] without a copy.
    pub fn borrow_states(&self) -> &[f64; STATES] {
        &self.motion.state.x
    }

    /// Sets the continuous states `x`, in the order of [`index`]. Quaternion and directions need not have unit length.
    pub fn set_continuous_states(&mut self, x: &[f64; STATES]) {
        self.motion.state.x = *x;
        self.motion.state.kept.end();
    }

    /// Returns the derivatives x' of the continuous states x by time. They are computed from copies of quaternion, directions and
    /// rates that are normalised; x itself does not change.
    ///
    /// The angular momentum h_w of the wheels (`h_wheels`) and its slope h_w' act on the craft by the torque -w x h_w - h_w'. A
    /// caller that does not set the slope must add -h_w' to `torque`.
    pub fn derivatives(&mut self, inputs: &Inputs) -> [f64; STATES] {
        if let Some(draining) = &self.draining {
            return draining.rates(&self.motion.state.x, &Acting::from_inputs(inputs, 0.0));
        }
        self.motion.evaluate(inputs);
        self.motion.state_rates::<0>(&self.motion.state.x)
    }

    /// Returns the exact derivative of x' if the states change by dx and the inputs (force, torque and h_wheels) by du. It
    /// is coefficient 1 of the power series in s of x' at x + dx s and u + du s. The slopes of the inputs do not change.
    pub fn directional_derivative(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; INPUTS],
    ) -> [f64; STATES] {
        if let Some((draining, x, acting)) = self.dual_arguments(inputs, dx, du) {
            return draining.rates(&x, &acting).map(Number::result);
        }
        self.motion.evaluate_direction(inputs, dx, split(du));
        self.motion.state_rates::<1>(dx)
    }

    /// Returns the exact derivative of the outputs for a change of the states by dx and of the inputs by du. The derivative
    /// of an output slosh angle at 90 degrees does not exist; it is returned as 0.
    pub fn output_derivatives(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; INPUTS],
    ) -> Outputs {
        if let Some((draining, x, acting)) = self.dual_arguments(inputs, dx, du) {
            return draining
                .evaluate(&x, &acting)
                .outputs(dx, |i| self.bounds.get(i)?.spin_scale());
        }
        self.motion.evaluate_direction(inputs, dx, split(du));
        self.motion.now::<Dual>().outputs(dx, |i| self.bounds.get(i)?.spin_scale())
    }

    fn dual_arguments(
        &self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; INPUTS],
    ) -> Option<(&Draining, [Dual; STATES], Acting<Dual>)> {
        let x = &self.motion.state.x;
        let along = core::array::from_fn(|i| Dual::with_slope(x[i], dx[i]));
        Some((self.draining.as_ref()?, along, Acting::with_directions(inputs, du)))
    }

    #[inline(always)]
    fn may_jump(&self, inputs: &Inputs) -> bool {
        self.draining.is_some() || inputs.h_wheels.value != self.motion.state.h_wheels
    }

    fn take_jumps(&mut self, inputs: &Inputs) -> bool {
        let Some(draining) = self.draining.as_ref().filter(|craft| craft.drains()) else {
            // A difference of `h_wheels` from its ramp by a rounding error is no jump.
            return !self.motion.state.kept.is_continued(inputs, 0.0)
                && self.motion.set_wheels(inputs.h_wheels.value);
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

    /// Returns true if the liquid of any tank is detached.
    pub fn has_lump(&self) -> bool {
        let CraftMotion { lumps, state, .. } = &*self.motion;
        !lumps.is_empty() && state.ball.iter().any(|state| *state != BallState::Settled)
    }

    /// Writes the event indicators, two for each tank: the first crosses zero at the end of the liquid's current state, and
    /// the second where the liquid stops sliding on the wall. In a tank without a model of detached liquid the first crosses
    /// zero where the thrust no longer holds the liquid at the bottom, so that the tank leaves its range of validity. An
    /// indicator of an event that cannot occur is 1.
    pub fn event_indicators(&mut self, inputs: &Inputs, indicators: &mut [f64]) {
        self.motion.indicators(inputs, indicators);
        if (0..self.bounds.len()).all(|i| self.has_ball(i)) {
            return;
        }
        let outputs = self.outputs_held(inputs);
        for (i, bounds) in self.bounds.iter().enumerate() {
            if !self.has_ball(i) {
                indicators[2 * i] = bounds.held_indicator(outputs.tank[i].axial);
            }
        }
    }

    /// Returns true if an external integrator (Model Exchange) has passed an event of a liquid, even if the indicators of its
    /// last steps did not show the event. The liquid is then outside its wall and moves outwards, has to leave bottom or
    /// wall, or may settle.
    pub fn is_event_overdue(&mut self, inputs: &Inputs) -> bool {
        let mut now = [1.0; 2 * TANKS];
        self.motion.indicators(inputs, &mut now);
        let at = |tank: usize| [now[2 * tank], now[2 * tank + 1]];
        self.motion.lumps.iter().any(|lump| lump.is_overdue(at(lump.tank)))
    }

    /// Performs all events that are due: a jump of `h_wheels` or `mass_flow` acts as an impulse, and liquid leaves
    /// the bottom, hits the wall or settles. Returns true if continuous states have changed. If an error is returned,
    /// the craft is unchanged.
    pub fn take_event(&mut self, inputs: &Inputs) -> Result<bool, StepError> {
        let before = self.motion.state;
        let mut changed = self.take_jumps(inputs);
        let mut is_bounded = self.motion.state.x.iter().all(|x| x.is_finite());
        if is_bounded && !self.motion.lumps.is_empty() {
            let due = self.motion.take_due(inputs);
            is_bounded = due.is_some();
            changed |= due == Some(true);
        }
        if !is_bounded {
            self.motion.state = before;
            return Err(StepError::NotFinite { time: before.time });
        }
        self.motion.state.ranges = self.ranges(inputs);
        if changed {
            self.motion.state.kept.end();
        }
        Ok(changed)
    }

    /// Returns an error if states that an external integrator has set are outside the range for
    /// which the model is valid: a tank's mass of liquid is outside its fill table, a slosh angle
    /// is too large for its mode, or an appendage is deflected too far for its linear model.
    pub fn check_states(&self) -> Result<(), StepError> {
        let x = &self.motion.state.x;
        self.motion.check_appendages()?;
        self.draining.as_ref().map_or(Ok(()), |it| it.check(x))
    }

    /// Takes the present values of `h_wheels` and `mass_flow` as a continuous change, which gives no impulse. In Model Exchange
    /// this method is called after each step of the integrator.
    pub fn follow_inputs(&mut self, inputs: &Inputs) {
        self.motion.state.h_wheels = inputs.h_wheels.value;
        self.motion.state.flow = inputs.mass_flow.map(|flow| flow.value);
    }
}

fn split(du: &[f64; INPUTS]) -> [[f64; 3]; 3] {
    [[du[0], du[1], du[2]], [du[3], du[4], du[5]], [du[6], du[7], du[8]]]
}

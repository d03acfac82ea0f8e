//! The plant: hub, bearing, tank, wheel and gyro, and its steps.
//!
//! ```text
//! I_hub w' = tau_actuator + tau_ext + tau_friction + tau_fluid
//! ```

use alloc::boxed::Box;
use alloc::string::{String, ToString};
use alloc::vec;
use alloc::vec::Vec;
use core::ops::ControlFlow;

use formulas::limits::LimitedBy;
use formulas::regime::Regime;
use taylor::error::StepError;
use taylor::number::Number;

use crate::baffle::Range;
use crate::contact::Contact;
use crate::damping::Damping;
use crate::friction::Law;
use crate::inputs::{Inputs, Ramp};
use crate::limits::Limits;
use crate::motion::{Motion, Stop};
use crate::parameters::{Imu, MODES, Parameters, Wheel};
use crate::slosh::{Angles, Liquid, SloshMode, with_modes};
use crate::state::{Axial, Ranges, STATES, State, x};
use crate::tank::{self, Calculated};
use crate::wheel::{self, Piece};

/// Hub, bearing, tank, wheel and gyro: their state, and the power series of their equations of motion.
#[derive(Clone, Debug)]
pub struct Plant {
    calculated: Calculated,
    pub(crate) hub_inertia: f64,
    /// Mass of the rigid liquid, kg. `i_0` is its inertia, kg m2, and `r` the distance of the tank from the bearing axis, m.
    pub(crate) m_0: f64,
    pub(crate) i_0: f64,
    pub(crate) r: f64,
    pub(crate) wave: [f64; MODES],
    pub(crate) radius: f64,
    pub(crate) baffle: Option<Range>,
    pub(crate) limits: Limits,
    pub(crate) wheel: Wheel,
    pub(crate) imu: Imu,
    pub(crate) motion: Box<Motion>,
    pub(crate) liquid: Liquid,
    pub(crate) state: State,
    /// Times of the importing tool that differ by less than this, s, count as equal.
    pub(crate) resolution: f64,
    pub(crate) stopped: Option<StoppedStep>,
}

/// How a step that may stop at events has ended: without an event (`End`), with an event exactly at its end, or earlier at an
/// event, with the elapsed time, s.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum StepEnd {
    End,
    EventAtEnd,
    Event(f64),
}

/// A step that has stopped at an event. The plant continues it by repeating it from its `start` and passing this event, so
/// that the motion is bit-identical whether steps stop at events or not. `h` is the length of the whole step, s, and `passed`
/// the time from its start to the event. `inputs` are tau_cmd, tau_ext and g_axial during the step. `time` and `x` are time
/// and states at the event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoppedStep {
    start: State,
    h: f64,
    passed: f64,
    inputs: [f64; 3],
    time: f64,
    x: [f64; STATES],
}

impl StoppedStep {
    /// Number of 64-bit words in which a stopped step is saved.
    pub const WORDS: usize = State::WORDS + 6 + STATES;

    /// Returns the stopped step as 64-bit words, from which [`StoppedStep::from_words`] restores it.
    pub fn to_words(&self) -> [u64; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let (start, rest) = words.split_at_mut(State::WORDS);
        start.copy_from_slice(&self.start.to_words());
        let [a, b, c] = self.inputs;
        let numbers = [self.h, self.passed, a, b, c, self.time];
        for (word, x) in rest.iter_mut().zip(numbers.iter().chain(&self.x)) {
            *word = x.to_bits();
        }
        words
    }

    /// Restores a stopped step from the words that [`StoppedStep::to_words`] has returned; `None` if they are not valid.
    pub fn from_words(words: &[u64; Self::WORDS]) -> Option<StoppedStep> {
        let (start, rest) = words.split_first_chunk()?;
        let mut numbers = [0.0; 6 + STATES];
        for (x, word) in numbers.iter_mut().zip(rest) {
            *x = f64::from_bits(*word);
        }
        let ([h, passed, a, b, c, time], x) = numbers.split_first_chunk()?;
        let possible = numbers.iter().all(|x| x.is_finite()) && (0.0..*h).contains(passed);
        possible.then_some(StoppedStep {
            start: State::from_words(start)?,
            h: *h,
            passed: *passed,
            inputs: [*a, *b, *c],
            time: *time,
            x: x.try_into().ok()?,
        })
    }

    /// Returns true if a step of `h` seconds from the state `state` continues the stopped step, because it has the same end
    /// and the same inputs. Times that differ by at most `resolution`, s, count as equal.
    fn is_continued_by(&self, state: &State, inputs: &Inputs, h: f64, resolution: f64) -> bool {
        let left = self.h - self.passed;
        let is_same = |a: f64, b: f64| (a - b).abs() <= resolution.max(rounding(self.h));
        let held = [inputs.tau_cmd, inputs.tau_ext, inputs.g_axial];
        held.iter().all(|input| input.slope == 0.0)
            && held.map(|input| input.value) == self.inputs
            && state.x == self.x
            && is_same(state.time, self.time)
            && is_same(h, left)
    }
}

fn rounding(h: f64) -> f64 {
    4.0 * f64::EPSILON * h
}

#[allow(missing_docs)]
impl Plant {
    /// Returns a message for each combination of parameters that is not allowed. Problems that depend on the initial motion
    /// are not among them.
    pub fn problems(p: &Parameters) -> Vec<String> {
        let mut problems = Law::problems(&p.friction);
        problems.extend(p.wheel.problems());
        problems.extend(tank::problems(p));
        problems
    }

    /// Creates a plant at the start of its motion, at `start_time`, s. `inputs` are the values that the inputs have then, and
    /// `tolerance` is the allowed relative error of rates and angles. The caller must have checked the range of each
    /// parameter.
    ///
    /// # Errors
    /// Messages of all problems with combinations of parameters.
    pub fn new(
        p: &Parameters,
        inputs: &Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Plant, Vec<String>> {
        let problems = Plant::problems(p);
        if !problems.is_empty() {
            return Err(problems);
        }
        let mut state = State {
            time: start_time,
            x: [0.0; STATES],
            contact: Contact::Forward,
            ranges: Ranges { regime: Regime::Linear, baffle: true, limited_by: LimitedBy::None },
            event_count: 0,
            event_time: start_time,
            elapsed: [0.0; 2],
            start_g: inputs.g_axial.value,
            axial: Axial::default(),
            gyro: p.imu.start(),
        };
        state.x[x::THETA] = p.init.theta;
        state.x[x::OMEGA] = p.init.omega;
        state.x[x::WHEEL_SPEED] = p.wheel.speed_0;
        let mut plant = Plant::with_state(p, state, tolerance);
        if let Some(problem) = plant.liquid.start_problem(&p.init) {
            return Err(vec![problem]);
        }
        let angles = Angles {
            angle: [p.init.slosh_angle_radial, p.init.slosh_angle],
            rate: [p.init.slosh_rate_radial, p.init.slosh_rate],
        };
        with_modes!(&plant.liquid, modes => {
            if let Some(first) = modes.first() {
                plant.state.slosh_mut()[0] = first.coordinates(&angles);
            }
        });
        plant.check_range().map_err(|why| vec![why.to_string()])?;
        plant.state.contact = plant.present_contact(inputs);
        plant.state.ranges = plant.present_ranges(inputs);
        plant.state.axial.g = inputs.g_axial.value;
        plant.accept_step(inputs).map_err(|why| vec![why.to_string()])?;
        if plant.imu.enabled {
            let omega = plant.omega();
            plant.imu.sample(&mut plant.state.gyro, omega);
        }
        Ok(plant)
    }

    /// Returns a warning, one sentence each, for every parameter that is outside the known range of the models. The specific
    /// force in `inputs` is checked in the same way.
    pub fn warnings(p: &Parameters, inputs: &Inputs) -> Vec<String> {
        tank::warnings(p, inputs.g_axial.value)
    }

    /// Creates a plant that continues from the saved state `state`, which must belong to a plant with the same parameters.
    /// [`Plant::problems`] must have found no problem with them.
    pub fn resume(p: &Parameters, state: &State, tolerance: f64) -> Plant {
        Plant::with_state(p, *state, tolerance)
    }

    fn with_state(p: &Parameters, state: State, tolerance: f64) -> Plant {
        let calculated = Calculated::new(p, state.start_g);
        let i_0 = calculated.m_0 * p.tank.r * p.tank.r + p.tank.own_inertia;
        let mut wave = [0.0; MODES];
        for (wave, pendulum) in wave.iter_mut().zip(calculated.pendulums(p)) {
            *wave = pendulum.wave;
        }
        // If nothing restores the liquid at the start, the damping ratio is defined at 1 m/s2 instead.
        let mut used = calculated.mass.iter().zip(&calculated.centring).filter(|(m, _)| **m > 0.0);
        let restored =
            state.start_g > 0.0 || used.clone().count() > 0 && used.all(|(_, a)| *a > 0.0);
        let reference = if restored { state.start_g } else { 1.0 };
        let at_reference = Calculated::new(p, reference);
        let damping = Damping::new(p, &at_reference, reference);
        let motion = Motion::new(p, i_0, calculated.m_0, damping, tolerance);
        Plant {
            hub_inertia: p.hub.inertia,
            m_0: calculated.m_0,
            i_0,
            r: p.tank.r,
            wave,
            radius: p.tank.d / 2.0,
            baffle: Range::new(p),
            limits: Limits::new(p, &at_reference),
            wheel: p.wheel,
            imu: p.imu,
            motion: Box::new(motion),
            liquid: Liquid::new(p, &at_reference),
            calculated,
            state,
            resolution: 0.0,
            stopped: None,
        }
    }

    /// Returns the current time, s.
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// Returns the hub's rate, rad/s.
    pub fn omega(&self) -> f64 {
        self.state.x[x::OMEGA]
    }

    pub fn calculated(&self) -> &Calculated {
        &self.calculated
    }

    pub fn state(&self) -> &State {
        &self.state
    }

    /// Restores a saved state of this plant or of a plant with the same parameters.
    pub fn set_state(&mut self, state: &State) {
        self.state = *state;
    }

    pub fn stopped(&self) -> Option<&StoppedStep> {
        self.stopped.as_ref()
    }

    pub fn set_stopped(&mut self, stopped: Option<StoppedStep>) {
        self.stopped = stopped;
    }

    /// Advances the motion by exactly `h` > 0 seconds, during which the inputs follow their ramps.
    ///
    /// # Errors
    /// See [`StepError`]; the plant is then unchanged.
    pub fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepError> {
        let before = self.state;
        let done = self.advance(inputs, h, f64::INFINITY);
        if done.is_err() {
            self.state = before;
        }
        done.map(|_| ())
    }

    /// Advances the motion as [`Plant::step`] does, but stops at the first event: the hub sticks or slips, the wheel reaches
    /// a limit, or the gyro takes a sample. If the next step has the same end and the same inputs, it continues as if the
    /// step had not stopped.
    ///
    /// # Errors
    /// As [`Plant::step`].
    pub fn step_to_event(&mut self, inputs: &Inputs, h: f64) -> Result<StepEnd, StepError> {
        let (before, stopped) = (self.state, self.stopped.take());
        let (mut length, mut passed, mut begun) = (h, -1.0, 0.0);
        let goes_on =
            |step: &StoppedStep| step.is_continued_by(&before, inputs, h, self.resolution);
        if let Some(step) = stopped.filter(goes_on) {
            self.state = step.start;
            (length, passed, begun) = (step.h, step.passed, step.passed);
        }
        let start = self.state;
        let mut end = StepEnd::End;
        loop {
            match self.advance(inputs, length, passed) {
                Ok(ControlFlow::Continue(())) => return Ok(end),
                Ok(ControlFlow::Break(at)) => passed = at,
                Err(why) => {
                    (self.state, self.stopped) = (before, stopped);
                    return Err(why);
                }
            }
            if passed >= length {
                return Ok(StepEnd::EventAtEnd);
            }
            // If the event is at the end of the step except for rounding, no step remains.
            if length - passed > self.resolution.max(rounding(length)) {
                break;
            }
            (self.state, end) = (start, StepEnd::EventAtEnd);
        }
        let State { time, x, .. } = self.state;
        let inputs = [inputs.tau_cmd, inputs.tau_ext, inputs.g_axial].map(|input| input.value);
        self.stopped = Some(StoppedStep { start, h: length, passed, inputs, time, x });
        Ok(StepEnd::Event(passed - begun))
    }

    /// Advances the motion as [`Plant::step`] does, but leaves an invalid state if it returns an error. The step stops at the
    /// first event that is later than `passed` seconds after its start; then the time of this event is returned, in seconds
    /// after the start of the step.
    #[inline(always)]
    fn advance(
        &mut self,
        inputs: &Inputs,
        h: f64,
        passed: f64,
    ) -> Result<ControlFlow<f64>, StepError> {
        if inputs.g_axial.value != self.state.axial.g {
            self.state.axial.work = self.work_axial(inputs);
        }
        let state = &mut self.state;
        let (begin, elapsed) = (state.time, state.elapsed);
        let (mut t, mut steps, mut stopped) = (0.0, self.motion.steps(), None);
        let mut level = None;
        while t < h {
            // A piece of zero length takes no step of the integrator, but counts as an internal step, so that the number
            // of pieces is limited.
            steps.add_steps(1, begin + t)?;
            let speed = state.x[x::WHEEL_SPEED];
            let command = wheel::command_after(inputs.tau_cmd, t, level);
            let piece = self.wheel.next(speed, command, h - t);
            let Piece { length, torque, speed, .. } = piece;
            level = piece.passed.or(level);
            let external = inputs.tau_ext.shifted(t);
            let tau =
                Ramp { value: torque.value + external.value, slope: torque.slope + external.slope };
            let acting = (tau, inputs.g_axial.shifted(t));
            let stop = Stop { offset: t, passed };
            let flow = with_modes!(&mut self.liquid, modes => self.motion.advance(
                modes, state, acting, length, (&self.imu, stop), &mut steps,
            ))?;
            if let ControlFlow::Break(within) = flow {
                stopped = Some(t + within);
                if within < length {
                    state.x[x::WHEEL_SPEED] -= torque.integral(within) / self.wheel.inertia;
                    break;
                }
            }
            state.x[x::WHEEL_SPEED] = speed;
            t = if length == h - t { h } else { t + length };
            // At this time the slope of the wheel's torque changes, which is an event.
            if stopped.is_some() || t < h && t > passed {
                stopped = Some(t);
                break;
            }
        }
        let reached = stopped.unwrap_or(h);
        if reached >= h {
            state.set_clock((begin, elapsed), h);
        }
        state.axial.accepted = None;
        state.axial.g = inputs.g_axial.value_at(reached);
        if !state.axial.is_finite() {
            return Err(StepError::NotFinite { time: state.time });
        }
        // The end of a step matches a sampling time of the gyro only to rounding.
        while self.imu.enabled && reached >= h && self.takes_sample() {
            steps.add_steps(1, begin + h)?;
            stopped = Some(h).filter(|_| passed < f64::INFINITY);
        }
        Ok(stopped.map_or(ControlFlow::Continue(()), ControlFlow::Break))
    }

    /// Returns the work, J, that all changes of the specific force g_axial have done since the start, including its present
    /// change. A jump of g_axial does the work jump times mass times height of the liquid. In Model Exchange the work since
    /// the last accepted step is computed by Hermite's rule, for a g_axial that is linear in time.
    pub(crate) fn work_axial(&mut self, inputs: &Inputs) -> f64 {
        let last = self.state.axial;
        let change = inputs.g_axial.value - last.g;
        if change == 0.0 {
            return last.work;
        }
        self.evaluate(inputs);
        self.work_axial_at(change, self.height())
    }

    /// Returns the work, J, that all changes of the specific force g_axial have done since the start, or the directional
    /// derivative of this work; [`Plant::work_axial`] explains it. `change` is the change of g_axial since the last accepted
    /// step. `mass_height` is the present product of the liquid's mass and height, kg m, and `rate` the rate of this
    /// product.
    pub(crate) fn work_axial_at<T: Number>(&self, change: T, [mass_height, rate]: [T; 2]) -> T {
        let last = self.state.axial;
        let c = T::constant;
        let mean = match last.accepted {
            Some(accepted) if self.state.time > accepted.time => {
                let h = self.state.time - accepted.time;
                (c(accepted.mass_height) + mass_height) * 0.5
                    + (c(accepted.rate) - rate) * (h / 12.0)
            }
            _ => mass_height,
        };
        c(last.work) + change * mean
    }

    pub(crate) fn height<T: Number>(&self) -> [T; 2] {
        with_modes!(&self.liquid, modes => self.motion.height(modes))
    }

    pub(crate) fn evaluate(&mut self, inputs: &Inputs) {
        let tau_actuator = self.wheel.torque(self.state.x[x::WHEEL_SPEED], inputs.tau_cmd);
        let tau = Ramp::held(tau_actuator.value + inputs.tau_ext.value);
        let contact = self.state.contact;
        with_modes!(&mut self.liquid, modes => {
            self.motion.start(modes, &self.state, (tau, Ramp::held(inputs.g_axial.value)));
            if self.motion.varies {
                self.motion.derivatives_varying(modes, contact);
            } else {
                let hangs = self.motion.suspension.exists;
                self.motion.derivatives(0, (false, hangs), modes, contact);
            }
        });
    }

    pub(crate) fn present_contact(&mut self, inputs: &Inputs) -> Contact {
        self.evaluate(inputs);
        with_modes!(&mut self.liquid, modes => self.motion.contact(modes, &self.state))
    }

    pub(crate) fn present_ranges(&mut self, inputs: &Inputs) -> Ranges {
        let outputs = self.outputs_held(inputs);
        self.evaluate_ranges(&outputs)
    }

    /// Sets the contact (stick or slip) that belongs to the present inputs, and returns the previous contact, which
    /// [`Plant::revert_contact`] restores. The contact can differ because a torque that has changed since the last step may
    /// break the hub away, or may cancel a break-away at this instant.
    pub fn apply_present_contact(&mut self, inputs: &Inputs) -> Contact {
        let before = self.state.contact;
        if self.omega() == 0.0 {
            self.state.contact = self.present_contact(inputs);
        }
        before
    }

    /// Sets the contact (stick or slip) that belongs to the present inputs, as [`Plant::apply_present_contact`] does, and
    /// keeps it: the next step begins with this contact.
    pub fn take_present_contact(&mut self, inputs: &Inputs) {
        if self.omega() == 0.0 {
            let (contact, time) = (self.present_contact(inputs), self.state.time);
            self.state.record_contact(contact, time);
        }
    }

    pub fn revert_contact(&mut self, before: Contact) {
        self.state.contact = before;
    }
}

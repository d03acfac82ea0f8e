//! The plant as a whole: hub, bearing, tank, wheel and gyro, and how it steps.
//!
//! ```text
//! I_hub w' = tau_actuator + tau_ext + tau_friction + tau_fluid
//! ```

use alloc::boxed::Box;
use alloc::string::{String, ToString};
use alloc::vec;
use alloc::vec::Vec;
use formulas::regime::Regime;
use taylor::error::StepError;
use taylor::number::Number;

use crate::baffle::Range;
use crate::contact::Contact;
use crate::damping::Damping;
use crate::friction::Law;
use crate::inputs::{Inputs, Ramp};
use crate::motion::Motion;
use crate::parameters::{Imu, MODES, Parameters, Wheel};
use crate::slosh::{Angles, Liquid, SloshMode, with_modes};
use crate::state::{Axial, Ranges, STATES, State, x};
use crate::tank::{self, Calculated};

/// Hub, bearing, tank, wheel and gyro.
#[derive(Clone, Debug)]
pub struct Plant {
    calculated: Calculated,
    pub(crate) hub_inertia: f64,
    /// Mass and inertia of the liquid that moves with the tank, kg, kg m2; distance of the
    /// tank, m.
    pub(crate) m_0: f64,
    pub(crate) i_0: f64,
    pub(crate) r: f64,
    /// Wall elevation per slosh angle of each mode, m/rad, and the tank's radius, m.
    pub(crate) wave: [f64; MODES],
    pub(crate) radius: f64,
    pub(crate) baffle: Option<Range>,
    pub(crate) wheel: Wheel,
    pub(crate) imu: Imu,
    pub(crate) motion: Box<Motion>,
    pub(crate) liquid: Liquid,
    pub(crate) state: State,
}

impl Plant {
    /// Everything that is wrong with how the parameters go together, wherever the motion starts.
    pub fn problems(p: &Parameters) -> Vec<String> {
        let mut problems = Law::problems(&p.friction);
        problems.extend(p.wheel.problems());
        problems.extend(tank::problems(p));
        problems
    }

    /// A plant at the start of its motion, at `start_time` (s), with the inputs that
    /// act then; `tolerance` is the relative error allowed in rates and angles.
    ///
    /// # Errors
    /// The ranges of single parameters are the caller's business; what parameters
    /// mean together is checked here and all problems are returned.
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
            ranges: Ranges { regime: Regime::Linear, baffle: true },
            event_count: 0,
            event_time: start_time,
            start_time,
            start_g: inputs.g_axial.value,
            axial: Axial::default(),
            gyro: p.imu.start(),
        };
        state.x[x::THETA] = p.init.theta;
        state.x[x::OMEGA] = p.init.omega;
        state.x[x::WHEEL_SPEED] = p.wheel.speed_0;
        let mut plant = Plant::of_parameters(p, state, tolerance);
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
        plant.state.axial.time = start_time;
        plant.accept_step(inputs).map_err(|why| vec![why.to_string()])?;
        if plant.imu.enabled {
            let omega = plant.omega();
            plant.imu.sample(&mut plant.state.gyro, omega);
        }
        Ok(plant)
    }

    /// What parameters and specific force leave of the range in which the models are known, one
    /// sentence each.
    pub fn warnings(p: &Parameters, inputs: &Inputs) -> Vec<String> {
        tank::warnings(p, inputs.g_axial.value)
    }

    /// A plant that continues from a saved state of one with the same parameters, in which
    /// [`Plant::problems`] finds nothing.
    pub fn resume(p: &Parameters, state: &State, tolerance: f64) -> Plant {
        Plant::of_parameters(p, *state, tolerance)
    }

    fn of_parameters(p: &Parameters, state: State, tolerance: f64) -> Plant {
        let calculated = Calculated::new(p, state.start_g);
        let i_0 = calculated.m_0 * p.tank.r * p.tank.r + p.tank.own_inertia;
        let mut wave = [0.0; MODES];
        for (wave, pendulum) in wave.iter_mut().zip(calculated.pendulums(p)) {
            *wave = pendulum.wave;
        }
        // Without restoring force at the start the damping refers to 1 m/s2.
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
            wheel: p.wheel,
            imu: p.imu,
            motion: Box::new(motion),
            liquid: Liquid::new(p, &at_reference),
            calculated,
            state,
        }
    }

    /// The present time, s.
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// The hub's rate, rad/s.
    pub fn omega(&self) -> f64 {
        self.state.x[x::OMEGA]
    }

    /// What follows from the parameters.
    pub fn calculated(&self) -> &Calculated {
        &self.calculated
    }

    /// The state, for saving.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Goes back to a saved state of this plant or of one with the same parameters.
    pub fn set_state(&mut self, state: &State) {
        self.state = *state;
    }

    /// Moves on by exactly `h` > 0 seconds; the inputs run along their ramps.
    ///
    /// # Errors
    /// See [`StepError`]; the plant is as before.
    pub fn step(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepError> {
        let before = self.state;
        let done = self.advance(inputs, h);
        if done.is_err() {
            self.state = before;
        }
        done
    }

    /// As [`Plant::step`], but an error leaves the state unusable.
    fn advance(&mut self, inputs: &Inputs, h: f64) -> Result<(), StepError> {
        if inputs.g_axial.value != self.state.axial.g {
            self.state.axial.work = self.work_axial(inputs);
        }
        let state = &mut self.state;
        let begin = state.time;
        let (mut t, mut steps) = (0.0, self.motion.steps());
        while t < h {
            // A piece of no length takes no step of the integrator; it counts as one.
            steps.count(1, begin + t)?;
            let speed = state.x[x::WHEEL_SPEED];
            let (length, torque, speed) = self.wheel.next(speed, inputs.tau_cmd.after(t), h - t);
            let external = inputs.tau_ext.after(t);
            let tau =
                Ramp { value: torque.value + external.value, slope: torque.slope + external.slope };
            let acting = (tau, inputs.g_axial.after(t));
            with_modes!(&mut self.liquid, modes => self.motion.advance(
                modes, state, acting, length, &self.imu, &mut steps,
            ))?;
            state.x[x::WHEEL_SPEED] = speed;
            t = if length == h - t { h } else { t + length };
        }
        state.time = begin + h;
        state.axial.time = state.time;
        state.axial.g = inputs.g_axial.at(h);
        if !state.axial.is_finite() {
            return Err(StepError::NotFinite { time: state.time });
        }
        Ok(())
    }

    /// Work through the changes of g_axial since the start, J, the present one included: of a
    /// jump at an instant, g_axial's change times the liquid's mass times height; since the
    /// last accepted step of a host that integrates itself by Hermite's rule, as if g_axial
    /// had run along a line.
    pub(crate) fn work_axial(&mut self, inputs: &Inputs) -> f64 {
        let last = self.state.axial;
        let change = inputs.g_axial.value - last.g;
        if change == 0.0 {
            return last.work;
        }
        self.evaluate(inputs);
        self.work_axial_at(change, self.height())
    }

    /// The same from g_axial's change since the last accepted step and from the liquid's mass times height.
    pub(crate) fn work_axial_at<T: Number>(&self, change: T, [mass_height, rate]: [T; 2]) -> T {
        let last = self.state.axial;
        let h = self.state.time - last.time;
        let c = T::constant;
        let mean = if h > 0.0 {
            (c(last.mass_height) + mass_height) * 0.5 + (c(last.rate) - rate) * (h / 12.0)
        } else {
            mass_height
        };
        c(last.work) + change * mean
    }

    /// Mass times height of hub and liquid above rest, kg m, and its rate, where the equations were evaluated last.
    pub(crate) fn height<T: Number>(&self) -> [T; 2] {
        with_modes!(&self.liquid, modes => self.motion.height(modes))
    }

    /// Evaluates the equations at the present instant.
    pub(crate) fn evaluate(&mut self, inputs: &Inputs) {
        let tau_actuator = self.wheel.torque(self.state.x[x::WHEEL_SPEED], inputs.tau_cmd);
        let tau = Ramp::held(tau_actuator.value + inputs.tau_ext.value);
        let contact = self.state.contact;
        with_modes!(&mut self.liquid, modes => {
            self.motion.start(modes, &self.state, (tau, Ramp::held(inputs.g_axial.value)));
            if self.motion.varies {
                self.motion.derivatives_varying(modes, contact);
            } else {
                self.motion.derivatives(0, false, modes, contact);
            }
        });
    }

    /// The contact that the hub's rate or, at rest, the torques make.
    pub(crate) fn present_contact(&mut self, inputs: &Inputs) -> Contact {
        self.evaluate(inputs);
        with_modes!(&mut self.liquid, modes => self.motion.contact(modes, &self.state))
    }

    /// The ranges that the present motion is in.
    pub(crate) fn present_ranges(&mut self, inputs: &Inputs) -> Ranges {
        let outputs = self.outputs_held(inputs);
        self.ranges_of(&outputs)
    }

    /// Gives the hub the contact that the present inputs make, and returns the one before, for
    /// [`Plant::revert_contact`]: torque that was changed since the last step may already have
    /// broken the hub away, or a break-away an instant ago may be undone.
    pub fn apply_present_contact(&mut self, inputs: &Inputs) -> Contact {
        let before = self.state.contact;
        if self.omega() == 0.0 {
            self.state.contact = self.present_contact(inputs);
        }
        before
    }

    /// Undoes [`Plant::apply_present_contact`].
    pub fn revert_contact(&mut self, before: Contact) {
        self.state.contact = before;
    }
}

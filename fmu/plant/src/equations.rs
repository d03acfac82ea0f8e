//! The plant as equations x' = f(x, u) with events, and their partial derivatives, for Model Exchange, in which the importing
//! tool integrates the states.
//!
//! x is defined in `state.rs`. The contact of hub and bearing and the slosh regime are discrete states. They change only in
//! [`Plant::take_event`], after an event indicator has crossed zero.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use taylor::error::StepError;

use crate::contact::Contact;
use crate::friction::Law;
use crate::inputs::{Inputs, Ramp};
use crate::motion::out_of_range;
use crate::outputs::unsigned_zero;
use crate::parameters::Friction;
use crate::plant::Plant;
use crate::slosh::{SloshMode, with_modes};
use crate::state::{Accepted, Axial, INDICATORS, STATES, State, indicator, x};

/// Largest number of gyro samples that are taken at one instant. More samples are due only if the importing tool does not
/// stop at the time events of the FMU.
const SAMPLES_AT_ONCE: f64 = 1e6;

#[allow(missing_docs)]
impl Plant {
    pub fn continuous_states(&self) -> &[f64; STATES] {
        &self.state.x
    }

    pub fn set_continuous_states(&mut self, x: &[f64; STATES]) {
        self.state.x = *x;
    }

    /// Sets the simulation `time` that the importing tool states, s. In Model Exchange, `since_start` is the time since the
    /// start, s. Times of the importing tool that differ by at most `resolution`, s, count as equal.
    pub fn set_time(&mut self, time: f64, since_start: Option<f64>, resolution: f64) {
        (self.state.time, self.resolution) = (time, resolution);
        if let Some(elapsed) = since_start {
            self.state.elapsed = [elapsed, 0.0];
        }
    }

    pub fn derivatives(&mut self, inputs: &Inputs) -> [f64; STATES] {
        self.evaluate(inputs);
        let torque = self.wheel.torque(self.state.x[x::WHEEL_SPEED], inputs.tau_cmd);
        self.coefficients(0, -torque.value / self.wheel.inertia).map(unsigned_zero)
    }

    /// Returns the exact change of the time derivatives of the states if the states change by `dx` and the inputs tau_cmd,
    /// tau_ext and g_axial by `du`. While the change is computed, the contact (stick or slip) and the state of the wheel
    /// (blocked, at its torque limit or free) stay as they are. The result is coefficient 1 of a power series in the size of
    /// the change.
    pub fn directional_derivative(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; 3],
    ) -> [f64; STATES] {
        let along = |x: Ramp, slope: f64| Ramp { value: x.value, slope };
        let torque = self.wheel.torque(self.state.x[x::WHEEL_SPEED], along(inputs.tau_cmd, du[0]));
        let external = along(inputs.tau_ext, du[1]);
        let tau =
            Ramp { value: torque.value + external.value, slope: torque.slope + external.slope };
        let contact = self.state.contact;
        with_modes!(&mut self.liquid, modes => {
            let acting = (tau, along(inputs.g_axial, du[2]));
            self.motion.start(modes, &self.state, acting);
            let forces = (true, self.motion.suspension.exists);
            self.motion.derivatives(0, forces, modes, contact);
            self.motion.hub.theta[1] = dx[x::THETA];
            self.motion.hub.omega[1] = dx[x::OMEGA];
            self.motion.law.set_state(1, dx[x::BRISTLE]);
            for (mode, dq) in modes.iter_mut().zip(dx[x::SLOSH..].as_chunks::<4>().0) {
                mode.seed_direction(dq, &self.motion.hub);
            }
            self.motion.derivatives(1, forces, modes, contact);
        });
        self.coefficients(1, -torque.slope / self.wheel.inertia)
    }

    fn coefficients(&self, n: usize, wheel: f64) -> [f64; STATES] {
        let motion = &self.motion;
        let mut derivatives = [0.0; STATES];
        derivatives[x::THETA] = motion.hub.omega[n];
        derivatives[x::OMEGA] = motion.hub.omega_dot[n];
        derivatives[x::WORK] = motion.power[n];
        derivatives[x::HEAT] = motion.dissipation[n];
        derivatives[x::WHEEL_SPEED] = wheel;
        if n == 0 && self.state.contact == Contact::Stuck {
            derivatives[x::STUCK_TIME] = 1.0;
        }
        derivatives[x::BRISTLE] = motion.law.derivative(n);
        with_modes!(&self.liquid, modes => {
            let slosh = derivatives[x::SLOSH..].as_chunks_mut::<4>().0;
            for (mode, derivatives) in modes.iter().zip(slosh) {
                *derivatives = mode.derivatives(n, &motion.hub);
            }
        });
        derivatives
    }

    /// Returns the event indicators, whose indices are in the module [`indicator`]. They are positive between events and
    /// cross zero at events; the indicator of an event that cannot happen is 1. No indicator is ever exactly 0, so that the
    /// root finder of the importing tool sees no crossing right after an event.
    pub fn event_indicators(&mut self, inputs: &Inputs) -> [f64; INDICATORS] {
        let just_positive = |z: f64| if z == 0.0 { f64::MIN_POSITIVE } else { z };
        self.indicators(inputs).map(just_positive)
    }

    fn indicators(&mut self, inputs: &Inputs) -> [f64; INDICATORS] {
        let mut z = [1.0; INDICATORS];
        if self.motion.law.switches_at_rest() {
            if self.state.contact == Contact::Stuck {
                self.evaluate(inputs);
                let net = self.motion.net[0];
                let (against_backward, against_forward) =
                    self.motion.law.holding_torques(self.state.x[x::THETA]);
                z[indicator::BREAK_AWAY_FORWARD] = against_forward - net;
                z[indicator::BREAK_AWAY_BACKWARD] = against_backward + net;
            } else {
                z[indicator::REST] = self.state.contact as i8 as f64 * self.omega();
            }
        }
        if self.wheel.enabled {
            let (command, speed) = (inputs.tau_cmd.value, self.state.x[x::WHEEL_SPEED]);
            z[indicator::TORQUE_MAX] = self.wheel.tau_max - command;
            z[indicator::TORQUE_MIN] = self.wheel.tau_max + command;
            z[indicator::TORQUE_SIGN] = command;
            z[indicator::SPEED_MAX] = self.wheel.speed_max - speed;
            z[indicator::SPEED_MIN] = speed - self.wheel.speed_min;
        }
        z
    }

    /// Handles all events that are due at the present time: sets the rate of a hub that has stopped to exactly 0, determines
    /// its new contact, keeps the speed of the rotor within its limits, takes the samples of the gyro, and updates the slosh
    /// regime. Returns true if continuous states have changed.
    ///
    /// # Errors
    /// [`StepError::Model`] or [`StepError::NotFinite`]; the plant is then unchanged.
    pub fn take_event(&mut self, inputs: &Inputs) -> Result<bool, StepError> {
        let (before, time) = (self.state, self.state.time);
        let period = 1.0 / self.imu.rate;
        // Either too many samples are due, or the time is so large that double precision cannot distinguish the
        // times of two samples.
        let endless = |due: f64| -due > SAMPLES_AT_ONCE * period || time + period <= time;
        if self.next_sample().is_some_and(endless) {
            return Err(StepError::Model(format!(
                "too many gyro samples are due at t = {time} s. The host has skipped time events, or imu.rate is so high that double precision cannot resolve the sampling times there"
            )));
        }
        if self.wheel.enabled {
            let speed = &mut self.state.x[x::WHEEL_SPEED];
            *speed = speed.max(self.wheel.speed_min).min(self.wheel.speed_max);
        }
        if self.state.contact as i8 as f64 * self.omega() <= 0.0 {
            if self.motion.law.sticks() {
                self.state.x[x::OMEGA] = 0.0;
            }
            self.find_contact(inputs);
        }
        // A root finder may stop exactly at the break-away, where the bearing still holds the torque. The indicator would then
        // not change its sign again, so that the break-away is performed now.
        if self.state.contact == Contact::Stuck {
            let z = self.indicators(inputs);
            if z[indicator::BREAK_AWAY_FORWARD] <= 0.0 {
                self.state.record_contact(Contact::Forward, time);
            } else if z[indicator::BREAK_AWAY_BACKWARD] <= 0.0 {
                self.state.record_contact(Contact::Backward, time);
            }
        }
        while self.takes_sample() {}
        self.state.ranges = self.present_ranges(inputs);
        if let Err(why) = self.accept_step(inputs) {
            self.state = before;
            return Err(why);
        }
        Ok(self.state.x != before.x)
    }

    fn find_contact(&mut self, inputs: &Inputs) {
        let (contact, time) = (self.present_contact(inputs), self.state.time);
        self.state.record_contact(contact, time);
    }

    /// Returns true if an event is overdue that the importing tool could not see, because no indicator changed its sign
    /// within its last step. This happens if its integrator has passed a change of the contact or a speed limit of the rotor,
    /// or if the wave has reached another regime.
    pub fn is_event_overdue(&mut self, inputs: &Inputs) -> bool {
        let z = self.indicators(inputs);
        let lasting = [
            indicator::REST,
            indicator::BREAK_AWAY_FORWARD,
            indicator::BREAK_AWAY_BACKWARD,
            indicator::SPEED_MAX,
            indicator::SPEED_MIN,
        ];
        lasting.iter().any(|place| z[*place] < 0.0)
            || self.present_ranges(inputs) != self.state.ranges
    }

    /// Returns the number of contact changes since the start, the time of the last change, s, and the number of the present
    /// [`Contact`].
    pub fn last_contact(&self) -> (i32, f64, i32) {
        (self.state.event_count, self.state.event_time, self.state.contact as i32)
    }

    /// Changes the friction of the bearing from now on to the parameters `p`.
    ///
    /// # Errors
    /// All problems of the parameters; the plant is then unchanged.
    pub fn set_friction(&mut self, p: &Friction, inputs: &Inputs) -> Result<(), Vec<String>> {
        let problems = Law::problems(p);
        if !problems.is_empty() {
            return Err(problems);
        }
        self.motion.law = Law::new(p);
        self.stopped = None;
        self.find_contact(inputs);
        Ok(())
    }

    /// Adds the work that a changing specific force has done since the last accepted step. In Model Exchange this function
    /// must be called after the integrator of the importing tool has accepted a step.
    ///
    /// The derivatives of the inputs are not known here. The work is therefore exact to fourth order in the step if g_axial
    /// is linear in time, and otherwise to second order.
    ///
    /// # Errors
    /// [`StepError::NotFinite`]; the plant is then unchanged.
    pub fn accept_step(&mut self, inputs: &Inputs) -> Result<(), StepError> {
        let work = self.work_axial(inputs);
        self.evaluate(inputs);
        let [mass_height, rate] = self.height();
        let (g, time) = (inputs.g_axial.value, self.state.time);
        let axial = Axial { work, g, accepted: Some(Accepted { time, mass_height, rate }) };
        if !axial.is_finite() {
            return Err(StepError::NotFinite { time });
        }
        self.state.axial = axial;
        Ok(())
    }

    /// Checks that the states that the importing tool has integrated are within the range of the models.
    ///
    /// # Errors
    /// [`StepError::Model`] with the number of the mode and the reason.
    pub fn check_range(&self) -> Result<(), StepError> {
        let time = self.state.time;
        with_modes!(&self.liquid, modes => {
            for (i, (mode, q)) in modes.iter().zip(self.state.slosh()).enumerate() {
                if let Some(what) = mode.out_of_range(q) {
                    return Err(out_of_range(time, i, what));
                }
            }
        });
        Ok(())
    }

    /// Returns the simulation time at which the next sample of the gyro is due, s; `None` without a gyro.
    pub fn next_time_event(&self) -> Option<f64> {
        self.next_sample().map(|due| self.state.time + due)
    }

    pub(crate) fn takes_sample(&mut self) -> bool {
        let is_due = |due| self.imu.is_due(due, self.resolution);
        let takes = self.next_sample().is_some_and(is_due);
        if takes {
            let omega = self.omega();
            self.imu.sample(&mut self.state.gyro, omega);
        }
        takes
    }

    fn next_sample(&self) -> Option<f64> {
        let State { gyro, elapsed, .. } = &self.state;
        self.imu.enabled.then(|| self.imu.due(gyro.next, elapsed[0]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outputs::Outputs;
    use crate::parameters::{FrictionModel, Parameters, SloshSource};
    use crate::slosh_model::SloshModel;

    fn is_a_length(slosh: SloshModel) -> bool {
        slosh == SloshModel::Liquid
    }

    fn plant(slosh: SloshModel, friction: FrictionModel) -> (Plant, Inputs) {
        plant_with(slosh, friction, |_| {})
    }

    fn every_option(p: &mut Parameters) {
        (p.bench.tilt, p.bench.tilt_azimuth) = (0.1, 0.7);
        (p.hub.imbalance, p.hub.imbalance_angle) = (0.4, 2.0);
        (p.hub.k, p.hub.theta_0, p.hub.c) = (0.7, -0.3, 0.02);
        (p.baffle.width, p.baffle.depth) = (0.008, 0.01);
        (p.slosh.capillarity, p.fluid.sigma) = (true, 7.0);
        p.slosh.zeta_amplitude = 0.05;
    }

    fn breaking_waves(p: &mut Parameters) {
        (p.slosh.zeta_breaking, p.slosh.breaking_steepness) = (0.3, 0.8);
    }

    fn every_direction(p: &mut Parameters) {
        every_option(p);
        (p.slosh.source, p.baffle.width) = (SloshSource::Table, 0.0);
        let table = &mut p.slosh.table;
        table.m_liq = 3.0;
        (table.mass[0], table.mass[1]) = (1.5, 1.2);
        (table.length[0], table.length[1]) = (0.05, 0.04);
        (table.direction[0], table.direction[1]) = (0.6, -1.2);
    }

    fn third_order(p: &mut Parameters) {
        every_option(p);
        breaking_waves(p);
        p.slosh.source = SloshSource::Table;
        let table = &mut p.slosh.table;
        table.m_liq = 3.0;
        (table.mass[0], table.mass[1]) = (1.5, 1.2);
        (table.length[0], table.length[1]) = (0.05, 0.04);
        (table.wave_number[0], table.wave_number[1]) = (18.0, 30.0);
        (table.nonlinear_inertia[0], table.nonlinear_stiffness[0]) = (1.7, 0.6);
        (table.nonlinear_inertia[1], table.nonlinear_stiffness[1]) = (0.4, 2.3);
    }

    fn plant_with(
        slosh: SloshModel,
        friction: FrictionModel,
        change: fn(&mut Parameters),
    ) -> (Plant, Inputs) {
        let mut p = Parameters::default();
        change(&mut p);
        p.slosh.model = slosh;
        p.slosh.modes = 2;
        let along_one =
            matches!(slosh, SloshModel::Frozen | SloshModel::Linear | SloshModel::Planar);
        if p.slosh.table.is_askew(2) && !along_one {
            let whole = Parameters::default().slosh;
            (p.slosh.table, p.slosh.source) = (whole.table, whole.source);
        }
        p.friction.model = friction;
        p.friction.eps = 0.05;
        p.friction.asymmetry = 0.1;
        p.friction.harmonics_forward = [0.1, -0.05, 0.02, 0.1];
        p.init.omega = 0.07;
        p.init.slosh_angle = 0.5;
        p.init.slosh_angle_radial = -0.3;
        p.init.slosh_rate = 2.0;
        p.init.slosh_rate_radial = 3.0;
        if p.slosh.table.is_askew(2) {
            // The initial motion must be along the direction of mode 1.
            let across = libm::tan(p.slosh.table.direction[0]);
            p.init.slosh_angle_radial = across * p.init.slosh_angle;
            p.init.slosh_rate_radial = across * p.init.slosh_rate;
        }
        let inputs = Inputs {
            tau_cmd: Ramp::held(0.1),
            tau_ext: Ramp::held(-0.03),
            g_axial: Ramp::held(9.0),
        };
        let mut plant = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap();
        plant.step(&inputs, 0.1).unwrap();
        (plant, inputs)
    }

    #[test]
    fn time_in_stiction_grows_by_one_second_per_second_while_the_hub_sticks() {
        for (omega, rate) in [(0.0, 1.0), (0.07, 0.0)] {
            let mut p = Parameters::default();
            (p.slosh.model, p.friction.model) = (SloshModel::Frozen, FrictionModel::Stribeck);
            p.init.omega = omega;
            let inputs = Inputs::default();
            let mut plant = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap();
            assert_eq!(plant.derivatives(&inputs)[x::STUCK_TIME], rate);
            let slopes = plant.directional_derivative(&inputs, &[1.0; STATES], &[1.0; 3]);
            assert_eq!(slopes[x::STUCK_TIME], 0.0);
        }
    }

    #[test]
    fn a_rotor_beyond_its_speed_limit_makes_an_event_due_at_once() {
        let mut p = Parameters::default();
        p.wheel.enabled = true;
        let inputs = Inputs::default();
        let mut plant = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap();
        let is_overdue_at = |speed: f64, plant: &mut Plant| {
            plant.state.x[x::WHEEL_SPEED] = speed;
            plant.is_event_overdue(&inputs)
        };
        let (low, high) = (p.wheel.speed_min, p.wheel.speed_max);
        for (speed, limit) in [(high + 1e-3, high), (low - 1e-3, low)] {
            assert!(is_overdue_at(speed, &mut plant));
            plant.take_event(&inputs).unwrap();
            assert_eq!(plant.state.x[x::WHEEL_SPEED], limit);
            assert!(!is_overdue_at(limit, &mut plant));
        }
    }

    #[test]
    fn directional_derivatives_of_the_states_agree_with_finite_differences() {
        compare_directional_derivatives(|_| {});
        compare_directional_derivatives(every_option);
        compare_directional_derivatives(every_direction);
        compare_directional_derivatives(third_order);
        compare_directional_derivatives(breaking_waves);
    }

    fn compare_directional_derivatives(change: fn(&mut Parameters)) {
        for slosh in SloshModel::ALL {
            for friction in FrictionModel::ALL {
                let (mut plant, inputs) = plant_with(slosh, friction, change);
                let x = *plant.continuous_states();
                let unit = |i: usize| -> ([f64; STATES], [f64; 3]) {
                    let (mut dx, mut du) = ([0.0; STATES], [0.0; 3]);
                    if i < STATES {
                        dx[i] = 1.0
                    } else {
                        du[i - STATES] = 1.0
                    }
                    (dx, du)
                };
                for direction in 0..STATES + 3 {
                    let (dx, du) = unit(direction);
                    // The coordinates are 0.01 to 1. Central differences with a step of 1e-5 times the coordinate have an
                    // error of 1e-10 times the third derivative.
                    let eps = 1e-5 * if is_a_length(slosh) { 0.05 } else { 1.0 };
                    let at = |sign: f64, plant: &mut Plant| {
                        let mut moved = x;
                        for (x, dx) in moved.iter_mut().zip(dx) {
                            *x += sign * eps * dx;
                        }
                        let moved_input = |u: Ramp, du: f64| Ramp::held(u.value + sign * eps * du);
                        let u = Inputs {
                            tau_cmd: moved_input(inputs.tau_cmd, du[0]),
                            tau_ext: moved_input(inputs.tau_ext, du[1]),
                            g_axial: moved_input(inputs.g_axial, du[2]),
                        };
                        plant.set_continuous_states(&moved);
                        plant.derivatives(&u)
                    };
                    let (plus, minus) = (at(1.0, &mut plant), at(-1.0, &mut plant));
                    plant.set_continuous_states(&x);
                    let exact = plant.directional_derivative(&inputs, &dx, &du);
                    let size = exact.iter().fold(1e-3, |a: f64, b| a.max(b.abs()));
                    for (i, exact) in exact.iter().enumerate() {
                        let difference = (plus[i] - minus[i]) / (2.0 * eps);
                        assert!(
                            (difference - exact).abs() < 1e-6 * size,
                            "{slosh:?} {friction:?} d rate {i} / d {direction}: {exact} {difference}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn output_derivatives_agree_with_finite_differences() {
        compare_output_derivatives(|_| {});
        compare_output_derivatives(every_option);
        compare_output_derivatives(every_direction);
        compare_output_derivatives(third_order);
        compare_output_derivatives(breaking_waves);
    }

    fn continuous(outputs: &Outputs) -> Vec<(&'static str, f64)> {
        macro_rules! all {
            ($($name:ident),*) => {{
                // This pattern does not compile if an output is missing here.
                let Outputs { $($name,)* wave: [radial, tangential], discrete: _ } = *outputs;
                vec![$((stringify!($name), $name),)* ("wave", radial), ("wave", tangential)]
            }};
        }
        all!(
            theta,
            omega,
            omega_dot,
            slosh_angle,
            slosh_rate,
            slosh_angle_radial,
            slosh_rate_radial,
            tau_friction,
            tau_fluid,
            tau_gravity,
            tau_suspension,
            f_tangential,
            f_radial,
            wave_height,
            baffle_wave,
            omega_imu,
            energy,
            momentum,
            power_dissipated,
            tau_actuator,
            wheel_speed,
            work,
            work_axial,
            heat,
            stuck_time,
            baffle_zeta
        )
    }

    fn compare_output_derivatives(change: fn(&mut Parameters)) {
        for slosh in SloshModel::ALL {
            for friction in FrictionModel::ALL {
                for stuck in [false, true] {
                    let (mut plant, inputs) = plant_with(slosh, friction, change);
                    if stuck {
                        if friction != FrictionModel::Stribeck {
                            continue;
                        }
                        plant.state.contact = Contact::Stuck;
                        plant.state.x[x::OMEGA] = 0.0;
                    }
                    let x = *plant.continuous_states();
                    // The direction is arbitrary; the states have sizes of 0.01 to 1.
                    let mut dx: [f64; STATES] = core::array::from_fn(|i| libm::sin(1.0 + i as f64));
                    dx[x::BRISTLE] *= 1e-4; // bristle deflections are some µrad
                    let du = [0.3, -0.4, 0.7];
                    // Central differences have an error of the squared step times the third derivative, 1e-10 for a
                    // curvature over 0.1, and a rounding error of 1e-16/1e-6.
                    let eps = 1e-6 * if is_a_length(slosh) { 0.1 } else { 1.0 };
                    let at = |sign: f64, plant: &mut Plant| {
                        let moved = core::array::from_fn(|i| x[i] + sign * eps * dx[i]);
                        let moved_input = |u: Ramp, du: f64| Ramp::held(u.value + sign * eps * du);
                        plant.set_continuous_states(&moved);
                        plant.outputs_held(&Inputs {
                            tau_cmd: moved_input(inputs.tau_cmd, du[0]),
                            tau_ext: moved_input(inputs.tau_ext, du[1]),
                            g_axial: moved_input(inputs.g_axial, du[2]),
                        })
                    };
                    let (plus, minus) = (at(1.0, &mut plant), at(-1.0, &mut plant));
                    plant.set_continuous_states(&x);
                    let before = plant.outputs_held(&inputs);
                    let derivatives = plant.output_derivatives(&inputs, &dx, &du);
                    assert_eq!(
                        plant.outputs_held(&inputs),
                        before,
                        "the outputs must not have changed"
                    );
                    let [plus, minus, before, derivatives] =
                        [plus, minus, before, derivatives].map(|o| continuous(&o));
                    for (n, (name, got)) in derivatives.into_iter().enumerate() {
                        let difference = (plus[n].1 - minus[n].1) / (2.0 * eps);
                        let size = difference.abs().max(before[n].1.abs()).max(0.1);
                        assert!(
                            (difference - got).abs() < 1e-7 * size,
                            "{slosh:?} {friction:?} {name}: {got} {difference}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn torque_equal_to_the_static_friction_starts_the_hub_at_an_event() {
        let mut p = Parameters::default();
        p.slosh.model = SloshModel::Frozen;
        let rest = Inputs::default();
        for sign in [1.0, -1.0] {
            let mut plant = Plant::new(&p, &rest, 0.0, 1e-9).unwrap();
            let limit = sign * (p.friction.c + p.friction.d);
            let inputs = Inputs { tau_cmd: Ramp::held(limit), ..rest };
            let indicators = plant.event_indicators(&inputs);
            let [forward, backward] =
                [indicator::BREAK_AWAY_FORWARD, indicator::BREAK_AWAY_BACKWARD];
            assert_eq!(indicators[forward].min(indicators[backward]), f64::MIN_POSITIVE);
            plant.take_event(&inputs).unwrap();
            assert_eq!(plant.last_contact().2, sign as i32);
            // A second call at the same instant changes nothing.
            plant.take_event(&inputs).unwrap();
            assert_eq!(plant.last_contact(), (1, 0.0, sign as i32));
        }
    }

    #[test]
    fn each_due_gyro_sample_is_taken_once_and_too_many_samples_are_an_error() {
        let mut p = Parameters::default();
        p.imu.enabled = true;
        p.imu.rate = 1e4;
        let inputs = Inputs::default();
        // At 1e6 s the clock resolves 1e-10 s; the sample is due ten microseconds later.
        let mut plant = Plant::new(&p, &inputs, 1e6, 1e-9).unwrap();
        for _ in 0..100 {
            let due = plant.next_time_event().unwrap();
            plant.set_time(due, Some(due - 1e6), 2e-9);
            plant.take_event(&inputs).unwrap();
            assert!(plant.next_time_event().unwrap() > due);
        }
        let before = *plant.state();
        plant.set_time(1e12, Some(1e12 - 1e6), 2e-3);
        assert!(plant.take_event(&inputs).is_err());
        plant.set_time(before.time, Some(before.elapsed[0]), 2e-9);
        assert_eq!(*plant.state(), before);
        // At this time the clock has a resolution of seconds.
        let mut plant = Plant::new(&p, &inputs, 1e16, 1e-9).unwrap();
        assert!(plant.take_event(&inputs).is_err());
    }

    /// A step of 1e12 s with the gyro enabled would take 5e13 samples, more than `solver.max_steps` allows.
    #[test]
    fn a_step_with_too_many_gyro_samples_is_refused_at_once() {
        let mut p = Parameters::default();
        p.slosh.model = SloshModel::Frozen;
        p.imu.enabled = true;
        let inputs = Inputs::default();
        let mut plant = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap();
        let before = *plant.state();
        // Hub and liquid are at rest, so that the integrator needs only one step, but 5e13 samples would be due.
        let refused = plant.step(&inputs, 1e12);
        assert!(matches!(refused, Err(StepError::TooManySteps { .. })), "{refused:?}");
        assert_eq!(*plant.state(), before);
        plant.step(&inputs, 100.0).unwrap();
    }

    #[test]
    fn a_motion_whose_energy_overflows_is_refused() {
        for slosh in SloshModel::ALL {
            // These are the indices of omega and of the tangential rate of the first mode.
            let places = if slosh == SloshModel::Frozen {
                &[x::OMEGA][..]
            } else {
                &[x::OMEGA, x::SLOSH + 3]
            };
            for &place in places {
                let (mut plant, inputs) = plant(slosh, FrictionModel::Viscous);
                let mut x = *plant.continuous_states();
                x[place] = 1e160; // its square is infinite
                plant.set_continuous_states(&x);
                let before = *plant.state();
                assert!(plant.step(&inputs, 1e-6).is_err(), "{slosh:?} {place}");
                assert_eq!(*plant.state(), before);
            }
        }
    }

    /// A damaged saved state may contain any number as the work of g_axial. If the work after a step is too large for a saved
    /// state, the step must be refused.
    #[test]
    fn a_step_in_which_the_work_of_g_axial_overflows_is_refused() {
        let (mut plant, inputs) = plant(SloshModel::Linear, FrictionModel::Viscous);
        plant.state.axial.work = 1e200;
        let before = *plant.state();
        assert!(matches!(plant.step(&inputs, 0.1), Err(StepError::NotFinite { .. })));
        assert!(matches!(plant.take_event(&inputs), Err(StepError::NotFinite { .. })));
        assert_eq!(*plant.state(), before);
    }

    /// A torque of −0.03 N·m turns the hub. After the Coulomb friction is raised to 1 N·m between two steps, the hub sticks.
    #[test]
    fn a_hub_sticks_after_its_friction_was_raised_between_two_steps() {
        let (mut plant, inputs) = plant(SloshModel::Linear, FrictionModel::Stribeck);
        let held = Inputs { tau_cmd: Ramp::held(0.0), ..inputs };
        plant.set_continuous_states(&[0.0; STATES]);
        plant.find_contact(&held);
        assert_eq!(plant.last_contact().2, -1, "-0.03 N m is more than the bearing holds");
        let mut strong = Parameters::default().friction;
        strong.c = 1.0;
        plant.set_friction(&strong, &held).unwrap();
        assert_eq!(plant.last_contact().2, 0);
        plant.step(&held, 1.0).unwrap();
        assert_eq!(plant.omega(), 0.0);
        strong.asymmetry = 2.0;
        assert!(plant.set_friction(&strong, &held).is_err());
        strong = Friction { model: FrictionModel::None, ..Friction::default() };
        plant.set_friction(&strong, &held).unwrap();
        plant.step(&held, 1.0).unwrap();
        assert!(plant.omega() < 0.0);
    }

    /// The test integrates the derivatives of the bench by Runge–Kutta steps of 0.1 ms, and compares the end with the state
    /// that one Co-Simulation step reaches.
    #[test]
    fn a_model_exchange_host_reproduces_co_simulation_of_the_plant() {
        // Each Runge-Kutta step of 0.1 ms has the error (omega_2 h)^4 = 4e-11, so that the error after 0.2 s is 1e-9.
        for slosh in SloshModel::ALL {
            let (mut plant, inputs) = plant(slosh, FrictionModel::Viscous);
            let mut own = plant.clone();
            let h = 1e-4;
            for _ in 0..2000 {
                let x = *plant.continuous_states();
                let mut rate_at = |rate: &[f64; STATES], h: f64| {
                    let moved: [f64; STATES] = core::array::from_fn(|i| x[i] + h * rate[i]);
                    plant.set_continuous_states(&moved);
                    plant.derivatives(&inputs)
                };
                let k1 = rate_at(&[0.0; STATES], 0.0);
                let k2 = rate_at(&k1, h / 2.0);
                let k3 = rate_at(&k2, h / 2.0);
                let k4 = rate_at(&k3, h);
                let rate = core::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
                rate_at(&rate, h);
            }
            own.step(&inputs, 0.2).unwrap();
            for (a, b) in plant.continuous_states().iter().zip(own.continuous_states()) {
                assert!((a - b).abs() < 1e-9, "{slosh:?} {a} {b}");
            }
        }
    }
}

//! The plant as equations x' = f(x, u) with events, for hosts that integrate
//! themselves, and their partial derivatives.
//!
//! x = [theta, omega, work, heat, stuck_time, wheel_speed, then q_x, q_y, q_x', q_y' of
//! each mode]; modes that are not used stay at rest. The friction's contact is a
//! discrete state: it changes in [`Plant::take_event`] alone, when an indicator has
//! crossed zero.

use crate::friction::{Contact, Law};
use crate::hub::{Liquid, with_modes};
use crate::slosh::Mode;
use crate::{Friction, FrictionModel, Inputs, MODES, Outputs, Plant, Ramp, StepError};

/// Number of continuous states.
pub const STATES: usize = 6 + 4 * MODES;

/// Number of event indicators.
pub const INDICATORS: usize = 8;

/// How many of the gyro's samples may fall due at once: a host that has passed more of
/// them by does not look at the time events.
const SAMPLES_AT_ONCE: f64 = 1e6;

/// By how much the coordinates move to either side for a derivative by differences, as
/// a share of the size at which they curve (1 rad, or a pendulum's length). What is left
/// out, SHARE^4/30 of the fifth derivative, and the rounding, 1e-16/SHARE, are both
/// about 1e-13.
const SHARE: f64 = 1.0 / 512.0;

impl Plant {
    /// x. Units: rad, rad/s, J, J, s, rad/s; mode coordinates as in `slosh`.
    pub fn continuous_states(&self) -> [f64; STATES] {
        let s = &self.state;
        let mut x = [0.0; STATES];
        x[..6].copy_from_slice(&[s.theta, s.omega, s.work, s.heat, s.stuck_time, s.wheel_speed]);
        x[6..].copy_from_slice(s.modes.as_flattened());
        x
    }

    /// Element `place` of x.
    pub fn continuous_state(&self, place: usize) -> f64 {
        let s = &self.state;
        let hub = [s.theta, s.omega, s.work, s.heat, s.stuck_time, s.wheel_speed];
        hub.get(place).copied().unwrap_or_else(|| s.modes.as_flattened()[place - hub.len()])
    }

    /// Takes x from the host.
    pub fn set_continuous_states(&mut self, x: &[f64; STATES]) {
        let s = &mut self.state;
        (s.theta, s.omega, s.work) = (x[0], x[1], x[2]);
        (s.heat, s.stuck_time, s.wheel_speed) = (x[3], x[4], x[5]);
        s.modes.as_flattened_mut().copy_from_slice(&x[6..]);
    }

    /// Takes the time from the host, s.
    pub fn set_time(&mut self, time: f64) {
        self.state.time = time;
    }

    /// x'.
    pub fn derivatives(&mut self, inputs: &Inputs) -> [f64; STATES] {
        self.rates(inputs);
        let stuck = self.state.contact == Contact::Stuck;
        let torque = self.wheel.torque(self.state.wheel_speed, inputs.tau_cmd);
        let mut rate = self.rate_coefficients::<0>(-torque.value / self.wheel.inertia);
        rate[4] = if stuck { 1.0 } else { 0.0 };
        rate
    }

    /// The derivative of x' in the direction (dx, du), du = [tau_cmd, tau_ext, g_axial]:
    /// coefficient 1 of x' along x + dx s, u + du s. The contact and the wheel's
    /// state (blocked, at its torque limit or free) are held.
    pub fn directional_derivative(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; 3],
    ) -> [f64; STATES] {
        let along = |x: Ramp, slope: f64| Ramp { value: x.value, slope };
        let torque = self.wheel.torque(self.state.wheel_speed, along(inputs.tau_cmd, du[0]));
        let external = along(inputs.tau_ext, du[1]);
        let tau =
            Ramp { value: torque.value + external.value, slope: torque.slope + external.slope };
        let contact = self.state.contact;
        with_modes!(&mut self.liquid, modes => {
            self.motion.start(modes, &self.state, tau, along(inputs.g_axial, du[2]));
            self.motion.rates::<0, _>(modes, contact);
            self.motion.theta[1] = dx[0];
            self.motion.hub.omega[1] = dx[1];
            for (mode, dq) in modes.iter_mut().zip(dx[6..].as_chunks::<4>().0) {
                mode.aim(dq, &self.motion.hub);
            }
            self.motion.rates::<1, _>(modes, contact);
        });
        self.rate_coefficients::<1>(-torque.slope / self.wheel.inertia)
    }

    /// The derivative of the outputs in the direction (dx, du); what is discrete in them
    /// is as it is now. Contact and wheel are held.
    ///
    /// Friction, heat and the hub's acceleration come from the series and are exact.
    /// Forces, energy and the like are smooth in x once the friction is just another
    /// torque tau_f + tau_f' s, so they are differentiated by central differences with
    /// Richardson's extrapolation, four evaluations, good to 1e-9 of their size.
    pub fn output_derivatives(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; 3],
    ) -> Outputs {
        let now = self.outputs_held(inputs);
        let rate = self.directional_derivative(inputs, dx, du);
        let motion = &self.motion;
        let (friction, friction_d, heat_d) =
            (motion.friction.tau_f[0], motion.friction.tau_f[1], motion.heat[1]);
        let command = Ramp { value: inputs.tau_cmd.value, slope: du[0] };
        let torque = self.wheel.torque(self.state.wheel_speed, command);

        // From here on without wheel and friction: their torques are prescribed.
        let x = self.continuous_states();
        let size = self.size_of_direction(dx, du);
        let step = if size > 0.0 { SHARE / size } else { 1.0 };
        let with_wheel = std::mem::replace(&mut self.wheel.enabled, false);
        let law = std::mem::replace(&mut self.motion.friction.model, FrictionModel::None);
        let [p2, p1, m1, m2] = [2.0, 1.0, -1.0, -2.0].map(|steps| {
            let s = steps * step;
            let moved: [f64; STATES] = core::array::from_fn(|i| x[i] + s * dx[i]);
            self.set_continuous_states(&moved);
            self.outputs_held(&Inputs {
                tau_cmd: Ramp::held(torque.at(s)),
                tau_ext: Ramp::held(inputs.tau_ext.value + s * du[1] + friction + s * friction_d),
                g_axial: Ramp::held(inputs.g_axial.value + s * du[2]),
            })
        });
        self.wheel.enabled = with_wheel;
        self.motion.friction.model = law;
        self.set_continuous_states(&x);

        let by_differences = |get: fn(&Outputs) -> f64| {
            (8.0 * (get(&p1) - get(&m1)) - (get(&p2) - get(&m2))) / (12.0 * step)
        };
        let wave = [by_differences(|o| o.wave[0]), by_differences(|o| o.wave[1])];
        let wave_height = now.wave[0] * wave[0] + now.wave[1] * wave[1];
        Outputs {
            theta: dx[0],
            omega: dx[1],
            omega_dot: rate[1],
            slosh_angle: by_differences(|o| o.slosh_angle),
            slosh_rate: by_differences(|o| o.slosh_rate),
            slosh_angle_radial: by_differences(|o| o.slosh_angle_radial),
            slosh_rate_radial: by_differences(|o| o.slosh_rate_radial),
            tau_friction: friction_d,
            tau_fluid: self.hub_inertia * rate[1] - torque.slope - du[1] - friction_d,
            f_tangential: by_differences(|o| o.f_tangential),
            f_radial: by_differences(|o| o.f_radial),
            // A cone: at its tip there is no derivative.
            wave_height: if now.wave_height > 0.0 { wave_height / now.wave_height } else { 0.0 },
            wave,
            omega_imu: if self.imu.enabled { 0.0 } else { dx[1] },
            energy: by_differences(|o| o.energy),
            momentum: by_differences(|o| o.momentum),
            power_dissipated: heat_d,
            tau_actuator: torque.slope,
            wheel_speed: dx[5],
            work: dx[2],
            heat: dx[3],
            event_time: 0.0,
            stuck_time: dx[4],
            ..now
        }
    }

    /// Size of a direction, in units in which 1 is where the outputs curve. What they
    /// are linear in counts less: it may move far.
    fn size_of_direction(&self, dx: &[f64; STATES], du: &[f64; 3]) -> f64 {
        let torque = 10.0 * self.motion.i0;
        let hub = [dx[1] / 10.0, du[0] / torque, du[1] / torque, du[2] / 10.0];
        let hub = hub.iter().fold(0.0, |size: f64, d| size.max(d.abs()));
        let lengths = &self.calculated().length;
        let is_length = matches!(self.liquid, Liquid::Paraboloid(_));
        let modes = dx[6..].as_chunks::<4>().0.iter().zip(lengths).map(|(dq, length)| {
            let unit = if is_length && *length > 0.0 { *length } else { 1.0 };
            let q = f64::max(dq[0].abs(), dq[1].abs());
            let v = f64::max(dq[2].abs(), dq[3].abs());
            q.max(v / 10.0) / unit
        });
        modes.fold(hub, f64::max)
    }

    /// Coefficient N of x' as the series have it.
    fn rate_coefficients<const N: usize>(&self, wheel: f64) -> [f64; STATES] {
        let motion = &self.motion;
        let mut rate = [0.0; STATES];
        rate[..6].copy_from_slice(&[
            motion.hub.omega[N],
            motion.hub.omega_dot[N],
            motion.work[N],
            motion.heat[N],
            0.0,
            wheel,
        ]);
        with_modes!(&self.liquid, modes => {
            for (mode, rate) in modes.iter().zip(rate[6..].as_chunks_mut::<4>().0) {
                *rate = mode.rate::<N>(&motion.hub);
            }
        });
        rate
    }

    /// Functions that are positive between events and cross zero at them: the hub comes
    /// to rest; it breaks away forwards, backwards; the command passes the wheel's
    /// torque limits, and zero; the rotor reaches its highest, its lowest speed.
    /// 1 where the event can't happen.
    pub fn event_indicators(&mut self, inputs: &Inputs) -> [f64; INDICATORS] {
        let mut indicators = [1.0; INDICATORS];
        if self.motion.friction.can_stick() {
            if self.state.contact == Contact::Stuck {
                self.rates(inputs);
                let (against_backward, against_forward) =
                    self.motion.friction.holds(self.state.theta);
                indicators[1] = against_forward - self.motion.net[0];
                indicators[2] = against_backward + self.motion.net[0];
            } else {
                indicators[0] = self.state.contact as i8 as f64 * self.state.omega;
            }
        }
        if self.wheel.enabled {
            let command = inputs.tau_cmd.value;
            indicators[3] = self.wheel.tau_max - command;
            indicators[4] = self.wheel.tau_max + command;
            indicators[5] = command;
            indicators[6] = self.wheel.speed_max - self.state.wheel_speed;
            indicators[7] = self.state.wheel_speed - self.wheel.speed_min;
        }
        indicators
    }

    /// Does what is due at the present instant: puts a hub that has just stopped
    /// exactly at rest, finds its new contact, keeps the rotor within its speeds, takes
    /// the gyro's samples. Returns whether continuous states have changed. On an error
    /// nothing has changed.
    pub fn take_event(&mut self, inputs: &Inputs) -> Result<bool, StepError> {
        let (before, time) = (self.continuous_states(), self.state.time);
        let period = 1.0 / self.imu.rate;
        // Too many, or so far from zero that the clock can't tell one sample from the next.
        let endless = |due| time - due > SAMPLES_AT_ONCE * period || time + period <= time;
        if self.next_time_event().is_some_and(endless) {
            return Err(StepError::TooManySteps { time });
        }
        if self.wheel.enabled {
            let speed = self.state.wheel_speed;
            self.state.wheel_speed = speed.max(self.wheel.speed_min).min(self.wheel.speed_max);
        }
        if self.state.contact as i8 as f64 * self.state.omega <= 0.0 {
            if self.motion.friction.can_stick() {
                self.state.omega = 0.0;
            }
            self.find_contact(inputs);
        }
        // A host's root finder may land on the very instant of the break-away, where the
        // torque is still held; the next sign change would never come.
        if self.state.contact == Contact::Stuck {
            let indicators = self.event_indicators(inputs);
            if indicators[1] <= 0.0 {
                self.state.touch(Contact::Forward, time);
            } else if indicators[2] <= 0.0 {
                self.state.touch(Contact::Backward, time);
            }
        }
        // Hosts land on a time event exactly, or on it but for rounding.
        let slack = 1e-9 / self.imu.rate;
        while self.next_time_event().is_some_and(|due| due <= time + slack) {
            let omega = self.state.omega;
            self.imu.sample(&mut self.state.gyro, omega);
        }
        Ok(self.continuous_states() != before)
    }

    /// Gives the hub the contact that its rate or, at rest, the torques make.
    fn find_contact(&mut self, inputs: &Inputs) {
        self.rates(inputs);
        let contact = with_modes!(&mut self.liquid, modes => {
            self.motion.contact(modes, &self.state)
        });
        let time = self.state.time;
        self.state.touch(contact, time);
    }

    /// Whether a change of the contact is overdue: a host has integrated past a sign
    /// change of the indicators 0, 1 or 2 that it did not see.
    pub fn is_contact_overdue(&mut self, inputs: &Inputs) -> bool {
        self.event_indicators(inputs)[..3].iter().any(|indicator| *indicator < 0.0)
    }

    /// How often the contact has changed since the start, when last, s, and what it is
    /// (-1 turning backwards, 0 stuck, 1 turning forwards).
    pub fn last_contact(&self) -> (i32, f64, i32) {
        (self.state.event_count, self.state.event_time, self.state.contact as i32)
    }

    /// Takes another law of friction from here on.
    pub fn set_friction(&mut self, p: &Friction, inputs: &Inputs) -> Result<(), Vec<String>> {
        let problems = Law::problems(p);
        if !problems.is_empty() {
            return Err(problems);
        }
        self.motion.friction = Law::new(p);
        self.find_contact(inputs);
        Ok(())
    }

    /// Whether the states that the host has set are within the models' range.
    pub fn check_range(&self) -> Result<(), StepError> {
        let time = self.state.time;
        with_modes!(&self.liquid, modes => {
            for (i, (mode, q)) in modes.iter().zip(&self.state.modes).enumerate() {
                if let Some(what) = mode.out_of_range(q) {
                    return Err(StepError::OutOfRange { time, mode: i + 1, what });
                }
            }
        });
        Ok(())
    }

    /// When the gyro takes its next sample, s; `None` without a gyro.
    pub fn next_time_event(&self) -> Option<f64> {
        let next = self.state.gyro.next as f64 / self.imu.rate;
        self.imu.enabled.then_some(self.state.start_time + next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FrictionModel, Parameters, SloshModel};

    const SLOSH: [SloshModel; 5] = [
        SloshModel::Frozen,
        SloshModel::Linear,
        SloshModel::Planar,
        SloshModel::Spherical,
        SloshModel::Paraboloid,
    ];
    const FRICTION: [FrictionModel; 4] = [
        FrictionModel::None,
        FrictionModel::Viscous,
        FrictionModel::StribeckSmooth,
        FrictionModel::Stribeck,
    ];

    fn plant(slosh: SloshModel, friction: FrictionModel) -> (Plant, Inputs) {
        let mut p = Parameters::default();
        p.slosh.model = slosh;
        p.slosh.modes = 2;
        p.friction.model = friction;
        p.friction.eps = 0.05;
        p.friction.asymmetry = 0.1;
        p.friction.harmonics_forward = [0.1, -0.05, 0.02, 0.1];
        p.init.omega = 0.07;
        p.init.slosh_angle = 0.5;
        p.init.slosh_angle_radial = -0.3;
        p.init.slosh_rate = 2.0;
        p.init.slosh_rate_radial = 3.0;
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
    fn directional_derivatives_agree_with_finite_differences() {
        for slosh in SLOSH {
            for friction in FRICTION {
                let (mut plant, inputs) = plant(slosh, friction);
                let x = plant.continuous_states();
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
                    // Coordinates are 0.01 to 1: central differences over 2e-5 of that
                    // leave the square, 1e-10, times the third derivative.
                    let eps = 1e-5 * if slosh == SloshModel::Paraboloid { 0.05 } else { 1.0 };
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
        // Every continuous output.
        let reals: [fn(&Outputs) -> f64; 20] = [
            |o| o.theta,
            |o| o.omega,
            |o| o.omega_dot,
            |o| o.slosh_angle,
            |o| o.slosh_rate,
            |o| o.slosh_angle_radial,
            |o| o.slosh_rate_radial,
            |o| o.tau_friction,
            |o| o.tau_fluid,
            |o| o.f_tangential,
            |o| o.f_radial,
            |o| o.wave_height,
            |o| o.omega_imu,
            |o| o.energy,
            |o| o.momentum,
            |o| o.power_dissipated,
            |o| o.tau_actuator,
            |o| o.wheel_speed,
            |o| o.work,
            |o| o.heat,
        ];
        for slosh in SLOSH {
            for friction in FRICTION {
                for stuck in [false, true] {
                    let (mut plant, inputs) = plant(slosh, friction);
                    if stuck {
                        if friction != FrictionModel::Stribeck {
                            continue;
                        }
                        plant.state.contact = Contact::Stuck;
                        plant.state.omega = 0.0;
                    }
                    let x = plant.continuous_states();
                    // Any direction at all; the models' own scatter of sizes is 0.01 to 1.
                    let dx: [f64; STATES] = core::array::from_fn(|i| libm::sin(1.0 + i as f64));
                    let du = [0.3, -0.4, 0.7];
                    // Central differences leave the square of this times the third
                    // derivative, 1e-10 of what curves over 0.1, and round at 1e-16 / 1e-6.
                    let eps = 1e-6 * if slosh == SloshModel::Paraboloid { 0.1 } else { 1.0 };
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
                    assert_eq!(plant.outputs_held(&inputs), before, "nothing has moved");
                    for (n, get) in reals.iter().enumerate() {
                        let difference = (get(&plus) - get(&minus)) / (2.0 * eps);
                        let got = get(&derivatives);
                        let size = difference.abs().max(get(&before).abs()).max(0.1);
                        assert!(
                            (difference - got).abs() < 1e-7 * size,
                            "{slosh:?} {friction:?} output {n}: {got} {difference}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn torque_at_the_very_limit_breaks_the_hub_away_at_an_event() {
        let mut p = Parameters::default();
        p.slosh.model = SloshModel::Frozen;
        let rest = Inputs::default();
        for sign in [1.0, -1.0] {
            let mut plant = Plant::new(&p, &rest, 0.0, 1e-9).unwrap();
            let limit = sign * (p.friction.c + p.friction.d);
            let inputs = Inputs { tau_cmd: Ramp::held(limit), ..rest };
            let indicators = plant.event_indicators(&inputs);
            assert!(indicators[1] == 0.0 || indicators[2] == 0.0);
            plant.take_event(&inputs).unwrap();
            assert_eq!(plant.last_contact().2, sign as i32);
            // And again at the same instant.
            plant.take_event(&inputs).unwrap();
            assert_eq!(plant.last_contact(), (1, 0.0, sign as i32));
        }
    }

    #[test]
    fn samples_that_are_due_are_taken_and_no_host_can_ask_for_endless_many() {
        let mut p = Parameters::default();
        p.imu.enabled = true;
        p.imu.rate = 1e4;
        let inputs = Inputs::default();
        // At 1e6 s, ten microseconds after which the clock shows 1e-10 s and no less.
        let mut plant = Plant::new(&p, &inputs, 1e6, 1e-9).unwrap();
        for _ in 0..100 {
            let due = plant.next_time_event().unwrap();
            plant.set_time(due);
            plant.take_event(&inputs).unwrap();
            assert!(plant.next_time_event().unwrap() > due);
        }
        let before = *plant.state();
        plant.set_time(1e12);
        assert!(plant.take_event(&inputs).is_err());
        plant.set_time(before.time);
        assert_eq!(*plant.state(), before);
        // Where seconds are the smallest difference there is.
        let mut plant = Plant::new(&p, &inputs, 1e16, 1e-9).unwrap();
        assert!(plant.take_event(&inputs).is_err());
    }

    #[test]
    fn a_step_with_more_samples_than_allowed_is_refused_at_once() {
        let mut p = Parameters::default();
        p.slosh.model = SloshModel::Frozen;
        p.imu.enabled = true;
        let inputs = Inputs::default();
        let mut plant = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap();
        let before = *plant.state();
        // Hub and liquid rest: one step of the integrator, and 5e13 samples.
        let refused = plant.step(&inputs, 1e12);
        assert!(matches!(refused, Err(StepError::TooManySteps { .. })), "{refused:?}");
        assert_eq!(*plant.state(), before);
        plant.step(&inputs, 100.0).unwrap();
    }

    #[test]
    fn a_motion_whose_energy_is_no_number_is_refused() {
        for slosh in SLOSH {
            // omega, and the tangential rate of the first mode
            let places = if slosh == SloshModel::Frozen { &[1][..] } else { &[1, 9] };
            for &place in places {
                let (mut plant, inputs) = plant(slosh, FrictionModel::Viscous);
                let mut x = plant.continuous_states();
                x[place] = 1e160; // its square is infinite
                plant.set_continuous_states(&x);
                let before = *plant.state();
                assert!(plant.step(&inputs, 1e-6).is_err(), "{slosh:?} {place}");
                assert_eq!(*plant.state(), before);
            }
        }
    }

    #[test]
    fn friction_can_be_changed_while_running() {
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

    #[test]
    fn a_host_that_integrates_itself_meets_the_plants_own_steps() {
        // Runge-Kutta 4 at 0.1 ms: (omega_2 h)^4 = 4e-11 a step's share; 1e-9 over 0.2 s.
        for slosh in SLOSH {
            let (mut plant, inputs) = plant(slosh, FrictionModel::Viscous);
            let mut own = plant.clone();
            let h = 1e-4;
            for _ in 0..2000 {
                let x = plant.continuous_states();
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

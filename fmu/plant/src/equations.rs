//! The plant as equations x' = f(x, u) with events, for hosts that integrate
//! themselves, and their partial derivatives.
//!
//! x = [theta, omega, work, heat, stuck_time, wheel_speed, then q_x, q_y, q_x', q_y' of
//! each mode]; modes that are not used stay at rest. The friction's contact is a
//! discrete state: it changes in [`Plant::take_event`] alone, when an indicator has
//! crossed zero.

use crate::friction::Contact;
use crate::hub::{Liquid, with_modes};
use crate::slosh::Mode;
use crate::{Inputs, MODES, Plant, Ramp};

/// Number of continuous states.
pub const STATES: usize = 6 + 4 * MODES;

/// Number of event indicators.
pub const INDICATORS: usize = 8;

impl Plant {
    /// x. Units: rad, rad/s, J, J, s, rad/s; mode coordinates as in `slosh`.
    pub fn continuous_states(&self) -> [f64; STATES] {
        let s = &self.state;
        let mut x = [0.0; STATES];
        x[..6].copy_from_slice(&[s.theta, s.omega, s.work, s.heat, s.stuck_time, s.wheel_speed]);
        x[6..].copy_from_slice(s.modes.as_flattened());
        x
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
        let mut rate = self.rate_coefficients(0, -torque.value / self.wheel.inertia);
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
            self.motion.theta[1] = dx[0];
            self.motion.hub.omega[1] = dx[1];
            for (mode, dq) in modes.iter_mut().zip(dx[6..].as_chunks::<4>().0) {
                mode.aim(dq);
            }
            self.motion.rates::<0, _>(modes, contact);
            self.motion.rates::<1, _>(modes, contact);
        });
        self.rate_coefficients(1, -torque.slope / self.wheel.inertia)
    }

    /// Coefficient n of x' as the series have it.
    fn rate_coefficients(&self, n: usize, wheel: f64) -> [f64; STATES] {
        let motion = &self.motion;
        let mut rate = [0.0; STATES];
        rate[..6].copy_from_slice(&[
            motion.hub.omega[n],
            motion.hub.omega_dot[n],
            motion.work[n],
            motion.heat[n],
            0.0,
            wheel,
        ]);
        with_modes!(&self.liquid, modes => {
            for (mode, rate) in modes.iter().zip(rate[6..].as_chunks_mut::<4>().0) {
                *rate = mode.rate(n);
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
    /// the gyro's samples. Returns whether continuous states have changed.
    pub fn take_event(&mut self, inputs: &Inputs) -> bool {
        let before = self.continuous_states();
        let speed = self.state.wheel_speed;
        if self.wheel.enabled {
            self.state.wheel_speed = speed.max(self.wheel.speed_min).min(self.wheel.speed_max);
        }
        if self.motion.friction.can_stick() {
            let contact = self.state.contact;
            if contact as i8 as f64 * self.state.omega <= 0.0 {
                self.state.omega = 0.0;
                self.rates(inputs);
                let contact = with_modes!(&mut self.liquid, modes => {
                    self.motion.contact(modes, &self.state)
                });
                let time = self.state.time;
                self.state.touch(contact, time);
            }
        }
        if self.imu.enabled {
            let since_start = self.state.time - self.state.start_time;
            let omega = self.state.omega;
            self.imu.follow(&mut self.state.gyro, since_start, 0.0, |_| omega);
        }
        self.continuous_states() != before
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

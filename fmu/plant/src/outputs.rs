//! Outputs of the plant at an instant, and their directional derivatives.

use formulas::limits::LimitedBy;
use formulas::regime::Regime;
use taylor::number::{Dual, Number};
use taylor::series::number;

use crate::contact::Contact;
use crate::inputs::{Inputs, Ramp};
use crate::plant::Plant;
use crate::slosh::{Angles, SloshMode, with_modes};
use crate::state::{Ranges, STATES, x};

/// The outputs of the plant at one instant, or their directional derivatives. They have the names, units and signs of the
/// outputs of the FMU HubSlosh, which `fmu/hubslosh/src/table.rs` describes. `wave` is the radial and the tangential
/// component of the wave at the wall, m; `baffle_wave` is the amplitude of the first mode's wave at the wall, m, and 0
/// without a baffle. The energy balance is energy - (energy at the start) = work + work_axial - heat.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Outputs {
    pub theta: f64,
    pub omega: f64,
    pub omega_dot: f64,
    pub slosh_angle: f64,
    pub slosh_rate: f64,
    pub slosh_angle_radial: f64,
    pub slosh_rate_radial: f64,
    pub tau_friction: f64,
    pub tau_fluid: f64,
    pub tau_gravity: f64,
    pub tau_suspension: f64,
    pub f_tangential: f64,
    pub f_radial: f64,
    pub wave_height: f64,
    pub wave: [f64; 2],
    pub baffle_wave: f64,
    pub omega_imu: f64,
    pub energy: f64,
    pub momentum: f64,
    pub power_dissipated: f64,
    pub tau_actuator: f64,
    pub wheel_speed: f64,
    pub work: f64,
    pub work_axial: f64,
    pub heat: f64,
    pub stuck_time: f64,
    pub baffle_zeta: f64,
    pub discrete: Discrete,
}

/// The outputs that are constant between events: contact, ranges of validity and their reasons. `friction_mode` is the number
/// of the [`Contact`] if the hub can stick, and 1 under all other friction laws. `event_time`, s, is 0 in a directional
/// derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Discrete {
    pub stuck: bool,
    pub regime: Regime,
    pub limited_by: LimitedBy,
    pub baffle_in_range: bool,
    pub friction_mode: i32,
    pub event_count: i32,
    pub event_time: f64,
}

/// Returns 0 without a sign for -0, and any other value unchanged, because the outputs of a plant at rest should have no
/// sign.
pub(crate) fn unsigned_zero(x: f64) -> f64 {
    x + 0.0
}

#[allow(missing_docs)]
impl Plant {
    pub fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        let before = self.apply_present_contact(inputs);
        let mut outputs = self.outputs_held(inputs);
        self.revert_contact(before);
        self.update_ranges(&mut outputs);
        outputs
    }

    /// Returns the outputs as [`Plant::outputs`] does, but with contact and slosh regime as they were at the last event.
    /// Importing tools that handle events themselves need this.
    pub fn outputs_held(&mut self, inputs: &Inputs) -> Outputs {
        let work_axial = self.work_axial(inputs);
        self.evaluate(inputs);
        self.present(&self.state.x, inputs.tau_cmd, work_axial)
    }

    /// Computes the outputs, or their directional derivatives. `x` contains the states, or their change. The equations must
    /// have been evaluated before, for the same states and the same torque command.
    fn present<T: Number>(&self, x: &[f64; STATES], tau_cmd: Ramp, work_axial: T) -> Outputs {
        let (state, motion) = (&self.state, &self.motion);
        let hub = &motion.hub;
        let [w, wd]: [T; 2] = [number(&hub.omega), number(&hub.omega_dot)];
        let [e_x, e_y]: [T; 2] = hub.tilt.now();
        let mut force = [
            w * (self.m_0 * self.r) * w + e_x * self.m_0,
            e_y * self.m_0 - wd * (self.m_0 * self.r),
        ];
        let [tau_gravity, on_rigid]: [T; 2] = motion.gravity_torques();
        let mut tau_fluid = on_rigid - wd * self.i_0;
        let inertia = self.hub_inertia + self.i_0;
        let stored = T::with_slope(motion.law.energy(0), motion.law.energy(1));
        let mut energy = w * inertia * w * 0.5 + stored + motion.potential();
        let zero = T::constant(0.0);
        let mut tau_suspension = zero;
        if motion.suspension.exists {
            let [torque, strain]: [T; 2] = motion.suspension.present(hub);
            (tau_suspension, energy) = (torque, energy + strain);
        }
        let mut momentum = w * inertia;
        let (mut wave, mut mode1) = ([zero; 2], Angles::<T>::zero());
        let (mut amplitude, mut baffle_zeta) = (zero, zero);
        with_modes!(&self.liquid, modes => for (i, mode) in modes.iter().enumerate() {
            let [f_x, f_y]: [T; 2] = mode.force(hub);
            force = [force[0] + f_x, force[1] + f_y];
            tau_fluid = tau_fluid + mode.torque(hub);
            energy = energy + mode.energy(hub);
            momentum = momentum + mode.momentum(hub);
            let angles = mode.angles::<T>();
            for k in 0..2 {
                wave[k] = wave[k] + angles.angle[k] * self.wave[i];
            }
            if i == 0 {
                mode1 = angles;
                if self.baffle.is_some() {
                    let pendulum = mode.pendulum();
                    let [g, _]: [T; 2] = pendulum.restoring_and_drag();
                    (amplitude, baffle_zeta) =
                        pendulum.baffle.present(g * pendulum.inv_l, mode.amplitude2());
                }
            }
        });
        let gyro = if self.imu.enabled { T::constant(state.gyro.held) } else { w };
        let actuator = self.wheel.torque(state.x[x::WHEEL_SPEED], tau_cmd);
        let plain = |x: T| unsigned_zero(x.result());
        Outputs {
            theta: x[x::THETA],
            omega: x[x::OMEGA],
            omega_dot: plain(wd),
            slosh_angle: mode1.angle[1].result(),
            slosh_rate: mode1.rate[1].result(),
            slosh_angle_radial: mode1.angle[0].result(),
            slosh_rate_radial: mode1.rate[0].result(),
            tau_friction: plain(number(&motion.tau_f)),
            tau_fluid: plain(tau_fluid),
            tau_gravity: plain(tau_gravity),
            tau_suspension: plain(tau_suspension),
            f_tangential: plain(force[1]),
            f_radial: plain(force[0]),
            wave_height: wave[0].hypot(wave[1]).result(),
            wave: wave.map(T::result),
            baffle_wave: (amplitude * self.wave[0]).result(),
            omega_imu: gyro.result(),
            energy: energy.result(),
            momentum: plain(momentum),
            power_dissipated: plain(number(&motion.dissipation)),
            tau_actuator: plain(T::with_slope(actuator.value, actuator.slope)),
            wheel_speed: x[x::WHEEL_SPEED],
            work: x[x::WORK],
            work_axial: work_axial.result(),
            heat: x[x::HEAT],
            stuck_time: x[x::STUCK_TIME],
            baffle_zeta: baffle_zeta.result(),
            discrete: Discrete {
                stuck: state.contact == Contact::Stuck,
                regime: state.ranges.regime,
                limited_by: state.ranges.limited_by,
                baffle_in_range: state.ranges.baffle,
                friction_mode: state.contact as i32,
                event_count: state.event_count,
                event_time: T::constant(state.event_time).result(),
            },
        }
    }

    /// Returns the viscous damping ratio of mode `n` at the present specific force, and the rate, 1/s, at which it changes
    /// with the slope of the specific force. Both are 0 for unused modes and without specific force.
    pub fn damping_ratio(&self, n: usize, inputs: &Inputs) -> [f64; 2] {
        let (damping, g) = (&self.motion.damping, inputs.g_axial);
        [damping.ratio(n, g.value), damping.slope_of_ratio(n, g.value) * g.slope]
    }

    /// Returns the exact change of the outputs for a change of the states by `dx` and of the inputs tau_cmd, tau_ext and
    /// g_axial by `du`. Discrete outputs keep their values, and the states of contact and wheel do not change. The amplitude
    /// of a wave has no derivative at 0.
    pub fn output_derivatives(
        &mut self,
        inputs: &Inputs,
        dx: &[f64; STATES],
        du: &[f64; 3],
    ) -> Outputs {
        self.directional_derivative(inputs, dx, du);
        let change = Dual::with_slope(inputs.g_axial.value - self.state.axial.g, du[2]);
        let work_axial = self.work_axial_at(change, self.height());
        let tau_cmd = Ramp { value: inputs.tau_cmd.value, slope: du[0] };
        self.present::<Dual>(dx, tau_cmd, work_axial)
    }

    /// Sets the outputs that describe the range of validity (regime, baffle, limiting reason), which follow from the other
    /// values in `outputs`.
    pub fn update_ranges(&self, outputs: &mut Outputs) {
        let Ranges { regime, baffle, limited_by } = self.evaluate_ranges(outputs);
        outputs.discrete.regime = regime;
        outputs.discrete.limited_by = limited_by;
        outputs.discrete.baffle_in_range = baffle;
    }

    pub(crate) fn evaluate_ranges(&self, outputs: &Outputs) -> Ranges {
        let regime = Regime::from_ratio(outputs.wave_height / self.radius);
        let baffle = self.baffle.is_none_or(|range| range.contains(outputs.baffle_wave));
        let limited_by = with_modes!(&self.liquid, modes => {
            let modes = modes.iter().map(|mode| {
                let pendulum = mode.pendulum();
                let [g, _]: [f64; 2] = pendulum.restoring_and_drag();
                (mode.angles(), g * pendulum.inv_l, pendulum.l)
            });
            self.limits.reason(modes, outputs.omega)
        });
        Ranges { regime, baffle, limited_by }
    }
}

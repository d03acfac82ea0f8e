//! What can be read of the plant at an instant, and its time derivatives along a direction.

use crate::contact::Contact;
use crate::friction::Law;
use crate::inputs::{Inputs, Ramp};
use crate::plant::Plant;
use crate::slosh::{Angles, SloshMode, with_modes};
use crate::state::{Ranges, Regime, STATES, x};

/// By how much the coordinates move to either side for a derivative by differences, as
/// a share of the size at which they curve (1 rad, or a pendulum's length). What is left
/// out, SHARE^4/30 of the fifth derivative, and the rounding, 1e-16/SHARE, are both
/// about 1e-13.
const SHARE: f64 = 1.0 / 512.0;

/// The plant's outputs at one instant, or their derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    /// Hub angle, rad, not wrapped.
    pub theta: f64,
    /// Hub rate, rad/s.
    pub omega: f64,
    /// Hub acceleration, rad/s2.
    pub omega_dot: f64,
    /// Mode 1, tangential, + towards +theta, rad.
    pub slosh_angle: f64,
    /// Its rate, rad/s.
    pub slosh_rate: f64,
    /// Mode 1, radial, + outwards, rad.
    pub slosh_angle_radial: f64,
    /// Its rate, rad/s.
    pub slosh_rate_radial: f64,
    /// Torque of the bearing's friction on the hub, N m.
    pub tau_friction: f64,
    /// Torque of all liquid, its rigid part included, on the hub, N m.
    pub tau_fluid: f64,
    /// Torque of gravity on the dry hub, N m: only on a bench that leans.
    pub tau_gravity: f64,
    /// Force of all liquid on the tank along +theta, N.
    pub f_tangential: f64,
    /// Force of all liquid on the tank outwards, N.
    pub f_radial: f64,
    /// Wave amplitude at the tank's wall by linear theory, m.
    pub wave_height: f64,
    /// Its radial and tangential part, m.
    pub wave: [f64; 2],
    /// Amplitude at the wall of the first mode's oscillation, m; 0 without a baffle.
    pub baffle_wave: f64,
    /// Reading of the gyro, rad/s.
    pub omega_imu: f64,
    /// Kinetic and potential energy of hub and liquid, J.
    pub energy: f64,
    /// Angular momentum of hub and liquid about the bearing's axis, kg m2/s.
    pub momentum: f64,
    /// Power dissipated in bearing and liquid, W.
    pub power_dissipated: f64,
    /// Torque of the actuator on the hub, N m, after the wheel's limits.
    pub tau_actuator: f64,
    /// Absolute rate of the wheel's rotor, rad/s.
    pub wheel_speed: f64,
    /// Work of tau_actuator and tau_ext on the hub since the start, J.
    pub work: f64,
    /// Work through the changes of g_axial on the liquid since the start, J:
    /// energy - energy(0) = work + work_axial - heat.
    pub work_axial: f64,
    /// Energy dissipated in bearing and liquid since the start, J.
    pub heat: f64,
    /// Time spent stuck since the start, s.
    pub stuck_time: f64,
    /// Damping ratio of the first mode by the baffle, at the present motion.
    pub baffle_zeta: f64,
    /// What changes at events alone.
    pub discrete: Discrete,
}

/// The outputs that have no derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discrete {
    /// Does dry friction hold the hub at rest?
    pub stuck: bool,
    /// Range of sloshing by wave height.
    pub regime: Regime,
    /// Whether the law of the baffle's drag holds; true without a baffle.
    pub baffle_in_range: bool,
    /// Set-valued friction: -1 turning backwards, 0 stuck, 1 forwards; else 1.
    pub friction_mode: i32,
    /// How often `friction_mode` has changed since the start.
    pub event_count: i32,
    /// When it changed last, s.
    pub event_time: f64,
}

/// +0 for either zero, everything else as it is: a plant at rest has no direction.
pub(crate) fn unsigned_zero(x: f64) -> f64 {
    x + 0.0
}

impl Plant {
    /// The outputs now, under the inputs' present values.
    pub fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        let before = self.apply_present_contact(inputs);
        let mut outputs = self.outputs_held(inputs);
        self.revert_contact(before);
        self.update_ranges(&mut outputs);
        outputs
    }

    /// As [`Plant::outputs`], with contact and regime that the last event has left.
    pub fn outputs_held(&mut self, inputs: &Inputs) -> Outputs {
        let work_axial = self.work_axial(inputs);
        self.evaluate(inputs);
        let state = &self.state;
        let hub = &self.motion.hub;
        let (w, wd) = (state.x[x::OMEGA], hub.omega_dot[0]);
        let [e_x, e_y] = hub.tilt.now();
        let mut force =
            [self.m_0 * self.r * w * w + self.m_0 * e_x, -self.m_0 * self.r * wd + self.m_0 * e_y];
        let [tau_gravity, on_rigid] = self.motion.gravity_torques();
        let mut tau_fluid = -self.i_0 * wd + on_rigid;
        let mut energy = (self.hub_inertia + self.i_0) * w * w / 2.0
            + self.motion.law.energy(0)
            + self.motion.potential();
        let mut momentum = (self.hub_inertia + self.i_0) * w;
        let mut wave = [0.0; 2];
        let (mut mode1, mut baffle_zeta) = (Angles::default(), 0.0);
        let mut amplitude = 0.0;
        with_modes!(&mut self.liquid, modes => for (i, mode) in modes.iter_mut().enumerate() {
            let [f_x, f_y] = mode.force(hub);
            force[0] += f_x;
            force[1] += f_y;
            tau_fluid += mode.torque(hub);
            energy += mode.energy(hub);
            momentum += mode.momentum(hub);
            let angles = mode.angles();
            wave[0] += self.wave[i] * angles.angle[0];
            wave[1] += self.wave[i] * angles.angle[1];
            if i == 0 {
                mode1 = angles;
                if self.baffle.is_some() {
                    let at = mode.amplitude2();
                    let pendulum = mode.pendulum();
                    let w = pendulum.g[0] * pendulum.inv_l;
                    (amplitude, baffle_zeta) = pendulum.baffle.present(w, at);
                }
            }
        });
        let tau_actuator = self.wheel.torque(state.x[x::WHEEL_SPEED], inputs.tau_cmd).value;
        Outputs {
            theta: state.x[x::THETA],
            omega: w,
            omega_dot: unsigned_zero(wd),
            slosh_angle: mode1.angle[1],
            slosh_rate: mode1.rate[1],
            slosh_angle_radial: mode1.angle[0],
            slosh_rate_radial: mode1.rate[0],
            tau_friction: unsigned_zero(self.motion.tau_f[0]),
            tau_fluid: unsigned_zero(tau_fluid),
            tau_gravity: unsigned_zero(tau_gravity),
            f_tangential: unsigned_zero(force[1]),
            f_radial: unsigned_zero(force[0]),
            wave_height: libm::hypot(wave[0], wave[1]),
            wave,
            baffle_wave: self.wave[0] * amplitude,
            omega_imu: if self.imu.enabled { state.gyro.held } else { w },
            energy,
            momentum: unsigned_zero(momentum),
            power_dissipated: unsigned_zero(self.motion.dissipation[0]),
            tau_actuator: unsigned_zero(tau_actuator),
            wheel_speed: state.x[x::WHEEL_SPEED],
            work: state.x[x::WORK],
            work_axial,
            heat: state.x[x::HEAT],
            stuck_time: state.x[x::STUCK_TIME],
            baffle_zeta,
            discrete: Discrete {
                stuck: state.contact == Contact::Stuck,
                regime: state.ranges.regime,
                baffle_in_range: state.ranges.baffle,
                friction_mode: state.contact as i32,
                event_count: state.event_count,
                event_time: state.event_time,
            },
        }
    }

    /// Viscous damping ratio of mode `n` at the present g_axial, and its rate along g_axial's slope,
    /// 1/s; 0 for modes that are not used, and at g_axial = 0.
    pub fn damping_ratio(&self, n: usize, inputs: &Inputs) -> [f64; 2] {
        let (damping, g) = (&self.motion.damping, inputs.g_axial);
        [damping.ratio(n, g.value), damping.slope_of_ratio(n, g.value) * g.slope]
    }

    /// The derivative of the outputs in the direction (dx, du); what is discrete in them
    /// is as it is now. Contact and wheel are held.
    ///
    /// Friction, dissipation and the hub's acceleration come from the series and are exact.
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
        let derivatives = self.directional_derivative(inputs, dx, du);
        let motion = &self.motion;
        let (friction, friction_d) = (motion.tau_f[0], motion.tau_f[1]);
        let (dissipation_d, stored_d) = (motion.dissipation[1], motion.law.energy(1));
        let command = Ramp { value: inputs.tau_cmd.value, slope: du[0] };
        let torque = self.wheel.torque(self.state.x[x::WHEEL_SPEED], command);

        // From here on without wheel and friction: their torques are prescribed, and the slosh
        // damping is linear in g.
        let before = self.state.x;
        let size = self.size_of_direction(dx, du);
        let step = if size >= f64::MIN_POSITIVE { SHARE / size } else { 1.0 };
        let with_wheel = core::mem::replace(&mut self.wheel.enabled, false);
        let law = core::mem::replace(&mut self.motion.law, Law::NONE);
        let tangent = self.motion.damping.tangent(inputs.g_axial.value);
        let damping = self.motion.set_damping(tangent);
        let [p2, p1, m1, m2] = [2.0, 1.0, -1.0, -2.0].map(|steps| {
            let s = steps * step;
            self.state.x = core::array::from_fn(|i| before[i] + s * dx[i]);
            self.outputs_held(&Inputs {
                tau_cmd: Ramp::held(torque.at(s)),
                tau_ext: Ramp::held(inputs.tau_ext.value + s * du[1] + friction + s * friction_d),
                g_axial: Ramp::held(inputs.g_axial.value + s * du[2]),
            })
        });
        self.wheel.enabled = with_wheel;
        self.motion.law = law;
        self.motion.set_damping(damping);
        self.state.x = before;

        let by_differences = |get: fn(&Outputs) -> f64| {
            (8.0 * (get(&p1) - get(&m1)) - (get(&p2) - get(&m2))) / (12.0 * step)
        };
        let wave = [by_differences(|o| o.wave[0]), by_differences(|o| o.wave[1])];
        let tau_gravity = by_differences(|o| o.tau_gravity);
        let wave_height = now.wave[0] * wave[0] + now.wave[1] * wave[1];
        // Every field is named: an output without its derivative does not compile.
        Outputs {
            theta: dx[x::THETA],
            omega: dx[x::OMEGA],
            omega_dot: derivatives[x::OMEGA],
            slosh_angle: by_differences(|o| o.slosh_angle),
            slosh_rate: by_differences(|o| o.slosh_rate),
            slosh_angle_radial: by_differences(|o| o.slosh_angle_radial),
            slosh_rate_radial: by_differences(|o| o.slosh_rate_radial),
            tau_friction: friction_d,
            tau_fluid: self.hub_inertia * derivatives[x::OMEGA]
                - torque.slope
                - du[1]
                - friction_d
                - tau_gravity,
            tau_gravity,
            f_tangential: by_differences(|o| o.f_tangential),
            f_radial: by_differences(|o| o.f_radial),
            // A cone: at its tip there is no derivative.
            wave_height: if now.wave_height > 0.0 { wave_height / now.wave_height } else { 0.0 },
            wave,
            baffle_wave: by_differences(|o| o.baffle_wave),
            omega_imu: if self.imu.enabled { 0.0 } else { dx[x::OMEGA] },
            energy: by_differences(|o| o.energy) + stored_d,
            momentum: by_differences(|o| o.momentum),
            power_dissipated: dissipation_d,
            tau_actuator: torque.slope,
            wheel_speed: dx[x::WHEEL_SPEED],
            work: dx[x::WORK],
            work_axial: by_differences(|o| o.work_axial),
            heat: dx[x::HEAT],
            stuck_time: dx[x::STUCK_TIME],
            baffle_zeta: by_differences(|o| o.baffle_zeta),
            discrete: now.discrete,
        }
    }

    /// Size of a direction, in units in which 1 is where the outputs curve. What they
    /// are linear in counts less: it may move far.
    fn size_of_direction(&self, dx: &[f64; STATES], du: &[f64; 3]) -> f64 {
        let torque = 10.0 * self.motion.i0;
        let hub = [dx[x::OMEGA] / 10.0, du[0] / torque, du[1] / torque, du[2] / 10.0];
        let hub = hub.iter().fold(0.0, |size: f64, d| size.max(d.abs()));
        // On a bench that leans the weight curves with the angle.
        let angle = if self.motion.hub.tilt.tangent == 0.0 { 0.0 } else { dx[x::THETA].abs() };
        let hub = f64::max(hub, angle);
        let slosh = dx[x::SLOSH..].as_chunks::<4>().0.iter().enumerate();
        with_modes!(&self.liquid, modes => {
            let modes = slosh.map(|(i, dq)| {
                let q = f64::max(dq[0].abs(), dq[1].abs());
                let v = f64::max(dq[2].abs(), dq[3].abs());
                q.max(v / 10.0) / modes.get(i).map_or(1.0, SloshMode::coordinate_scale)
            });
            modes.fold(hub, f64::max)
        })
    }

    /// Brings the ranges among the outputs to what the outputs are now.
    pub fn update_ranges(&self, outputs: &mut Outputs) {
        let Ranges { regime, baffle } = self.ranges_of(outputs);
        outputs.discrete.regime = regime;
        outputs.discrete.baffle_in_range = baffle;
    }

    /// The ranges that the outputs are in.
    pub(crate) fn ranges_of(&self, outputs: &Outputs) -> Ranges {
        let regime = match outputs.wave_height / self.radius {
            ratio if ratio < 0.15 => Regime::Linear,
            ratio if ratio <= 0.25 => Regime::Transitional,
            _ => Regime::Nonlinear,
        };
        let baffle = self.baffle.is_none_or(|range| range.contains(outputs.baffle_wave));
        Ranges { regime, baffle }
    }
}

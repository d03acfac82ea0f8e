//! The plant as a whole: hub, bearing, tank, wheel and gyro, its state, what it shows.
//!
//! ```text
//! I_hub w' = tau_actuator + tau_ext + tau_friction + tau_fluid
//! ```

use crate::friction::{Contact, Law};
use crate::imu::Gyro;
use crate::motion::{MAX_STEPS, Motion, StepError};
use crate::slosh::linear::Linear;
use crate::slosh::paraboloid::Paraboloid;
use crate::slosh::planar::Planar;
use crate::slosh::spherical::Spherical;
use crate::slosh::{Angles, Mode};
use crate::{Calculated, Imu, MODES, Parameters, SloshModel, Wheel};

/// A quantity that is linear in time: `value + slope t`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Ramp {
    /// Value now.
    pub value: f64,
    /// Rate of change, 1/s.
    pub slope: f64,
}

impl Ramp {
    /// A quantity that stays.
    pub fn held(value: f64) -> Ramp {
        Ramp { value, slope: 0.0 }
    }

    /// The value after `t` seconds.
    pub fn at(self, t: f64) -> f64 {
        self.value + self.slope * t
    }

    pub(crate) fn integral(self, t: f64) -> f64 {
        (self.value + self.slope * t / 2.0) * t
    }
}

/// What acts on the plant from outside, over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs {
    /// Torque command to the actuator, N m.
    pub tau_cmd: Ramp,
    /// Any other torque on the hub, N m.
    pub tau_ext: Ramp,
    /// Specific force along the tank's axis, m/s2, not negative.
    pub g_axial: Ramp,
}

impl Default for Inputs {
    fn default() -> Self {
        Inputs { tau_cmd: Ramp::held(0.0), tau_ext: Ramp::held(0.0), g_axial: Ramp::held(9.81) }
    }
}

/// How far the linear range of sloshing reaches, by the wave's height at the wall:
/// below 0.15 R, up to 0.25 R, above (thesis 2.3.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Regime {
    /// Below 0.15 R.
    Linear = 1,
    /// From 0.15 R to 0.25 R.
    Transitional = 2,
    /// Above 0.25 R.
    Nonlinear = 3,
}

/// What the plant shows at one instant.
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
    /// Torque of all liquid, frozen part included, on the hub, N m.
    pub tau_fluid: f64,
    /// Force of all liquid on the tank along +theta, N.
    pub f_tangential: f64,
    /// Force of all liquid on the tank outwards, N.
    pub f_radial: f64,
    /// Wave amplitude at the tank's wall by linear theory, m.
    pub wave_height: f64,
    /// Its radial and tangential part, m.
    pub wave: [f64; 2],
    /// Reading of the gyro, rad/s.
    pub omega_imu: f64,
    /// Kinetic and potential energy of hub and liquid, J.
    pub energy: f64,
    /// Angular momentum of hub and liquid about the bearing's axis, kg m2/s.
    pub momentum: f64,
    /// Heat made in bearing and liquid, W.
    pub power_dissipated: f64,
    /// Torque of the actuator on the hub, N m, after the wheel's limits.
    pub tau_actuator: f64,
    /// Absolute rate of the wheel's rotor, rad/s.
    pub wheel_speed: f64,
    /// Does dry friction hold the hub at rest?
    pub stuck: bool,
    /// Range of sloshing by wave height.
    pub regime: Regime,
    /// Work of tau_actuator and tau_ext on the hub since the start, J.
    pub work: f64,
    /// Heat made in bearing and liquid since the start, J.
    pub heat: f64,
    /// Set-valued friction: -1 turning backwards, 0 stuck, 1 forwards; else 1.
    pub friction_mode: i32,
    /// How often `friction_mode` has changed since the start.
    pub event_count: i32,
    /// When it changed last, s.
    pub event_time: f64,
    /// Time spent stuck since the start, s.
    pub stuck_time: f64,
}

/// The plant's memory: all that a saved state needs besides parameters and inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub(crate) time: f64,
    pub(crate) theta: f64,
    pub(crate) omega: f64,
    /// Coordinates of each slosh mode, see `slosh`.
    pub(crate) modes: [[f64; 4]; MODES],
    pub(crate) contact: Contact,
    pub(crate) work: f64,
    pub(crate) heat: f64,
    pub(crate) event_count: i32,
    pub(crate) event_time: f64,
    pub(crate) stuck_time: f64,
    pub(crate) wheel_speed: f64,
    pub(crate) start_time: f64,
    /// g_axial at the start: the slosh damping belongs to it.
    pub(crate) start_g: f64,
    pub(crate) gyro: Gyro,
}

impl State {
    /// Length of the flat form.
    pub const WORDS: usize = 14 + 4 * MODES;

    /// The state as plain words, for saving.
    pub fn to_words(&self) -> [u64; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let numbers = [
            self.time,
            self.theta,
            self.omega,
            self.work,
            self.heat,
            self.event_time,
            self.stuck_time,
            self.wheel_speed,
            self.start_time,
            self.start_g,
            self.gyro.bias,
            self.gyro.held,
        ];
        let all = numbers.iter().chain(self.modes.iter().flatten());
        for (word, number) in words[2..].iter_mut().zip(all) {
            *word = number.to_bits();
        }
        words[0] = (self.contact as i8 as u8 as u64) << 32 | self.event_count as u32 as u64;
        words[1] = self.gyro.next;
        words
    }

    /// The reverse; `None` when the words are no state.
    pub fn from_words(words: &[u64; Self::WORDS]) -> Option<State> {
        let contact = match (words[0] >> 32) as u8 as i8 {
            -1 => Contact::Backward,
            0 => Contact::Stuck,
            1 => Contact::Forward,
            _ => return None,
        };
        let number = |j: usize| f64::from_bits(words[2 + j]);
        let mut modes = [[0.0; 4]; MODES];
        for (j, q) in modes.iter_mut().flatten().enumerate() {
            *q = number(12 + j);
        }
        let finite = (0..Self::WORDS - 2).all(|j| number(j).is_finite());
        // Beyond this the samples' instants can't be told apart.
        let countable = words[1] <= 1 << f64::MANTISSA_DIGITS;
        (finite && countable).then_some(State {
            time: number(0),
            theta: number(1),
            omega: number(2),
            modes,
            contact,
            work: number(3),
            heat: number(4),
            event_count: words[0] as u32 as i32,
            event_time: number(5),
            stuck_time: number(6),
            wheel_speed: number(7),
            start_time: number(8),
            start_g: number(9),
            gyro: Gyro { next: words[1], bias: number(10), held: number(11) },
        })
    }
}

/// The slosh modes in use, as the chosen model has them.
#[derive(Clone, Debug)]
pub(crate) enum Liquid {
    Linear(Vec<Linear>),
    Planar(Vec<Planar>),
    Spherical(Vec<Spherical>),
    Paraboloid(Vec<Paraboloid>),
}

/// Does the same with the modes of whatever model is in use.
macro_rules! with_modes {
    ($liquid:expr, $modes:ident => $do:expr) => {
        match $liquid {
            Liquid::Linear($modes) => $do,
            Liquid::Planar($modes) => $do,
            Liquid::Spherical($modes) => $do,
            Liquid::Paraboloid($modes) => $do,
        }
    };
}

pub(crate) use with_modes;

/// Hub, bearing, tank, wheel and gyro.
#[derive(Clone, Debug)]
pub struct Plant {
    calculated: Calculated,
    pub(crate) hub_inertia: f64,
    /// Mass and inertia of the frozen liquid, kg, kg m2; distance of the tank, m.
    m_0: f64,
    i_0: f64,
    r: f64,
    /// Wall elevation per slosh angle of each mode, m/rad, and the tank's radius, m.
    wave: [f64; MODES],
    radius: f64,
    pub(crate) wheel: Wheel,
    pub(crate) imu: Imu,
    pub(crate) motion: Box<Motion>,
    pub(crate) liquid: Liquid,
    pub(crate) state: State,
}

impl Plant {
    /// A plant at the start of its motion, at `start_time` (s), with the inputs that
    /// act then; `tolerance` is the relative error allowed in rates and angles.
    ///
    /// The ranges of single parameters are the caller's business; what parameters
    /// mean together is checked here and all problems are returned.
    pub fn new(
        p: &Parameters,
        inputs: &Inputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<Plant, Vec<String>> {
        let mut problems = Law::problems(&p.friction);
        problems.extend(p.wheel.problems());
        let sines = [p.init.slosh_angle_radial, p.init.slosh_angle].map(libm::sin);
        if p.slosh.model == SloshModel::Spherical
            && sines[0] * sines[0] + sines[1] * sines[1] > 0.9999
        {
            problems.push(format!(
                "init.slosh_angle = {} and init.slosh_angle_radial = {} put the bob at or beyond \
                 the horizontal: sin^2 + sin^2 = {:.6} must be below 1",
                p.init.slosh_angle,
                p.init.slosh_angle_radial,
                sines[0] * sines[0] + sines[1] * sines[1]
            ));
        }
        if !problems.is_empty() {
            return Err(problems);
        }
        let state = State {
            time: start_time,
            theta: p.init.theta,
            omega: p.init.omega,
            modes: [[0.0; 4]; MODES],
            contact: Contact::Forward,
            work: 0.0,
            heat: 0.0,
            event_count: 0,
            event_time: start_time,
            stuck_time: 0.0,
            wheel_speed: p.wheel.speed_0,
            start_time,
            start_g: inputs.g_axial.value,
            gyro: p.imu.start(),
        };
        let mut plant = Plant::of_parameters(p, state, tolerance);
        let angles = Angles {
            angle: [p.init.slosh_angle_radial, p.init.slosh_angle],
            rate: [p.init.slosh_rate_radial, p.init.slosh_rate],
        };
        with_modes!(&plant.liquid, modes => {
            if let Some(first) = modes.first() {
                plant.state.modes[0] = first.coordinates(&angles);
            }
        });
        plant.rates(inputs);
        plant.state.contact = with_modes!(&mut plant.liquid, modes => {
            plant.motion.contact(modes, &plant.state)
        });
        if plant.imu.enabled {
            let omega = plant.state.omega;
            plant.imu.sample(&mut plant.state.gyro, omega);
        }
        Ok(plant)
    }

    /// A plant that continues from a saved state of one with the same parameters.
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
        fn modes<M: Mode>(calculated: &Calculated, p: &Parameters) -> Vec<M> {
            calculated.pendulums(p).map(|pendulum| M::new(&pendulum)).collect()
        }
        Plant {
            hub_inertia: p.hub.inertia,
            m_0: calculated.m_0,
            i_0,
            r: p.tank.r,
            wave,
            radius: p.tank.d / 2.0,
            wheel: p.wheel,
            imu: p.imu,
            motion: Box::new(Motion::new(p.hub.inertia + i_0, Law::new(&p.friction), tolerance)),
            liquid: match p.slosh.model {
                // Frozen liquid is a linear model without modes.
                SloshModel::Frozen | SloshModel::Linear => Liquid::Linear(modes(&calculated, p)),
                SloshModel::Planar => Liquid::Planar(modes(&calculated, p)),
                SloshModel::Spherical => Liquid::Spherical(modes(&calculated, p)),
                SloshModel::Paraboloid => Liquid::Paraboloid(modes(&calculated, p)),
            },
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
        self.state.omega
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

    /// Moves on by exactly `h` > 0 seconds; the inputs run along their ramps. On an
    /// error the plant is as before.
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
        let state = &mut self.state;
        let begin = state.time;
        let (mut t, mut steps) = (0.0, 0);
        while t < h {
            // A piece of no length takes no step of the integrator; it counts as one.
            steps += 1;
            if steps > MAX_STEPS {
                return Err(StepError::TooManySteps { time: begin + t });
            }
            let now = |x: Ramp| Ramp { value: x.at(t), slope: x.slope };
            let (length, torque, speed) =
                self.wheel.next(state.wheel_speed, now(inputs.tau_cmd), h - t);
            let external = now(inputs.tau_ext);
            let tau =
                Ramp { value: torque.value + external.value, slope: torque.slope + external.slope };
            let acting = (tau, now(inputs.g_axial));
            with_modes!(&mut self.liquid, modes => self.motion.advance(
                modes, state, acting, length, &self.imu, &mut steps,
            ))?;
            state.wheel_speed = speed;
            t = if length == h - t { h } else { t + length };
        }
        state.time = begin + h;
        Ok(())
    }

    /// Evaluates the equations at the present instant.
    pub(crate) fn rates(&mut self, inputs: &Inputs) {
        let tau_actuator = self.wheel.torque(self.state.wheel_speed, inputs.tau_cmd);
        let tau = Ramp::held(tau_actuator.value + inputs.tau_ext.value);
        let contact = self.state.contact;
        with_modes!(&mut self.liquid, modes => {
            self.motion.start(modes, &self.state, tau, inputs.g_axial);
            self.motion.rates::<0, _>(modes, contact);
        });
    }

    /// What the plant shows now, under the inputs' present values.
    pub fn outputs(&mut self, inputs: &Inputs) -> Outputs {
        self.with_present_contact(inputs, |plant| plant.outputs_held(inputs))
    }

    /// Looks at the plant with the contact that the present inputs give: torque that was
    /// changed since the last step may already have broken the hub away, or a break-away
    /// an instant ago may be undone.
    pub fn with_present_contact<T>(
        &mut self,
        inputs: &Inputs,
        look: impl FnOnce(&mut Plant) -> T,
    ) -> T {
        let before = self.state.contact;
        if self.state.omega == 0.0 {
            self.rates(inputs);
            self.state.contact =
                with_modes!(&mut self.liquid, modes => self.motion.contact(modes, &self.state));
        }
        let seen = look(self);
        self.state.contact = before;
        seen
    }

    /// As [`Plant::outputs`], with the contact that the last step or event has left.
    pub fn outputs_held(&mut self, inputs: &Inputs) -> Outputs {
        self.rates(inputs);
        let contact = self.state.contact;
        let state = &self.state;
        let hub = &self.motion.hub;
        let (w, wd) = (state.omega, hub.omega_dot[0]);
        let mut force = [self.m_0 * self.r * w * w, -self.m_0 * self.r * wd];
        let mut tau_fluid = -self.i_0 * wd;
        let mut energy = (self.hub_inertia + self.i_0) * w * w / 2.0;
        let mut momentum = (self.hub_inertia + self.i_0) * w;
        let mut heat = -self.motion.friction.tau_f[0] * w;
        let mut wave = [0.0; 2];
        let mut mode1 = Angles::default();
        with_modes!(&mut self.liquid, modes => for (i, mode) in modes.iter_mut().enumerate() {
            let [f_x, f_y] = mode.force(hub);
            force[0] += f_x;
            force[1] += f_y;
            tau_fluid += mode.torque(hub);
            energy += mode.energy(hub);
            momentum += mode.momentum(hub);
            heat += mode.heat::<0>();
            let angles = mode.angles();
            wave[0] += self.wave[i] * angles.angle[0];
            wave[1] += self.wave[i] * angles.angle[1];
            if i == 0 {
                mode1 = angles;
            }
        });
        let wave_height = libm::hypot(wave[0], wave[1]);
        Outputs {
            theta: state.theta,
            omega: w,
            omega_dot: wd,
            slosh_angle: mode1.angle[1],
            slosh_rate: mode1.rate[1],
            slosh_angle_radial: mode1.angle[0],
            slosh_rate_radial: mode1.rate[0],
            tau_friction: self.motion.friction.tau_f[0],
            tau_fluid,
            f_tangential: force[1],
            f_radial: force[0],
            wave_height,
            wave,
            omega_imu: if self.imu.enabled { state.gyro.held } else { w },
            energy,
            momentum,
            power_dissipated: heat,
            tau_actuator: self.wheel.torque(state.wheel_speed, inputs.tau_cmd).value,
            wheel_speed: state.wheel_speed,
            stuck: contact == Contact::Stuck,
            regime: match wave_height / self.radius {
                ratio if ratio < 0.15 => Regime::Linear,
                ratio if ratio <= 0.25 => Regime::Transitional,
                _ => Regime::Nonlinear,
            },
            work: state.work,
            heat: state.heat,
            friction_mode: contact as i32,
            event_count: state.event_count,
            event_time: state.event_time,
            stuck_time: state.stuck_time,
        }
    }
}

//! What the plant is made of: every parameter with its unit and the bench's value.
//!
//! `Parameters::default()` is the thesis's bench (TRACTOR, 24 degC, 10 cm of
//! water). SI units throughout.

/// All parameters of the plant.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Parameters {
    /// The rigid hub.
    pub hub: Hub,
    /// The tank on it.
    pub tank: Tank,
    /// The liquid in the tank.
    pub fluid: Fluid,
    /// Which mechanical model stands for the liquid.
    pub slosh: Slosh,
    /// The bearing.
    pub friction: Friction,
    /// Where the motion starts.
    pub init: Init,
    /// The reaction wheel.
    pub wheel: Wheel,
    /// The rate gyro.
    pub imu: Imu,
}

/// The rigid hub with the dry tank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hub {
    /// Moment of inertia about the bearing axis, kg m2.
    pub inertia: f64,
}

/// An upright cylinder, its axis parallel to the bearing's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tank {
    /// Inner diameter, m.
    pub d: f64,
    /// Fill height, m.
    pub h: f64,
    /// Distance of the tank's axis from the bearing's axis, m.
    pub r: f64,
    /// Moment of inertia of liquid that turns with the tank about the tank's
    /// own axis, kg m2 (0: an upright cylinder does not turn inviscid liquid).
    pub own_inertia: f64,
}

/// The liquid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    /// Density, kg/m3.
    pub rho: f64,
    /// Kinematic viscosity, m2/s.
    pub nu: f64,
    /// Surface tension, N/m.
    pub sigma: f64,
}

/// The mechanical models of the liquid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum SloshModel {
    /// The liquid is a rigid body.
    Frozen = 1,
    /// Linear planar pendulums.
    Linear = 2,
    /// Nonlinear planar pendulums.
    Planar = 3,
    /// Spherical pendulums: the liquid can rotate.
    Spherical = 4,
    /// Masses on a paraboloid with a quartic spring.
    Paraboloid = 5,
}

/// The largest number of slosh modes.
pub const MODES: usize = 10;

/// Choice and parameters of the slosh model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slosh {
    /// Which model.
    pub model: SloshModel,
    /// How many modes are kept, 1 to [`MODES`].
    pub modes: usize,
    /// Damping from the Mikishev-Dorozhkin correlation (true) or `zeta` (false).
    pub zeta_from_correlation: bool,
    /// Damping ratio of every mode when it is not taken from the correlation.
    pub zeta: f64,
    /// Coefficient of the quartic spring (paraboloid only).
    pub hardening: f64,
}

/// The laws of the bearing's friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FrictionModel {
    /// A free bearing.
    None = 1,
    /// b omega.
    Viscous = 2,
    /// Stribeck curve with sgn(omega) smoothed to tanh(omega / eps).
    StribeckSmooth = 3,
    /// Stribeck curve as a set-valued law: the hub can stick.
    Stribeck = 4,
}

/// The bearing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Which law.
    pub model: FrictionModel,
    /// Viscous coefficient, N m s.
    pub b: f64,
    /// Coulomb torque, N m.
    pub c: f64,
    /// Static torque above Coulomb's, N m.
    pub d: f64,
    /// Stribeck speed, rad/s.
    pub omega_s: f64,
    /// Width of the smoothed sign (stribeck_smooth only), rad/s.
    pub eps: f64,
    /// Directional asymmetry eta: dry friction is (1 + eta) times as strong
    /// forwards and (1 - eta) times backwards.
    pub asymmetry: f64,
    /// Dry friction's dependence on the hub's angle while it turns forwards:
    /// coefficients of cos theta, sin theta, cos 2 theta, sin 2 theta.
    pub harmonics_forward: [f64; 4],
    /// The same while it turns backwards.
    pub harmonics_backward: [f64; 4],
}

/// Where the motion starts; the slosh quantities are mode 1's.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Init {
    /// Hub angle, rad.
    pub theta: f64,
    /// Hub rate, rad/s.
    pub omega: f64,
    /// Tangential slosh angle, + towards +theta, rad.
    pub slosh_angle: f64,
    /// Radial slosh angle, + outwards, rad.
    pub slosh_angle_radial: f64,
    /// Rate of the tangential angle, rad/s.
    pub slosh_rate: f64,
    /// Rate of the radial angle, rad/s.
    pub slosh_rate_radial: f64,
}

/// The reaction wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// Whether the wheel's limits apply; without it the command is the torque.
    pub enabled: bool,
    /// Moment of inertia of the rotor, kg m2.
    pub inertia: f64,
    /// Rotor speed at the start, rad/s.
    pub speed_0: f64,
    /// Lowest rotor speed, rad/s.
    pub speed_min: f64,
    /// Highest rotor speed, rad/s.
    pub speed_max: f64,
    /// Largest torque, N m.
    pub tau_max: f64,
}

/// The rate gyro on the hub.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imu {
    /// Whether `omega_imu` is sampled and noisy; without it it equals `omega`.
    pub enabled: bool,
    /// Sampling rate, Hz.
    pub rate: f64,
    /// Angle random walk N, rad/s/sqrt(Hz).
    pub arw: f64,
    /// Bias instability B, rad/s.
    pub bias_instability: f64,
    /// Correlation time of the bias, s.
    pub bias_time: f64,
    /// Quantisation step, rad/s (0: none).
    pub lsb: f64,
    /// Seed of the noise.
    pub seed: i32,
}

const RPM: f64 = core::f64::consts::PI / 30.0;

// Sources: thesis Tables 5.1, 5.4, 5.5, 5.6; water at 24 degC; the wheel's
// inertia is an inference (a steel disc of 125 mm diameter).
impl Default for Hub {
    fn default() -> Self {
        Hub { inertia: 0.322414 }
    }
}

impl Default for Tank {
    fn default() -> Self {
        Tank { d: 0.163, h: 0.10, r: 0.225, own_inertia: 0.0 }
    }
}

impl Default for Fluid {
    fn default() -> Self {
        Fluid { rho: 1000.0, nu: 9.1312e-7, sigma: 0.07213 }
    }
}

impl Default for Slosh {
    fn default() -> Self {
        Slosh {
            model: SloshModel::Linear,
            modes: 1,
            zeta_from_correlation: true,
            zeta: 0.003,
            hardening: 0.58,
        }
    }
}

impl Default for Friction {
    fn default() -> Self {
        Friction {
            model: FrictionModel::Stribeck,
            b: 0.03793,
            c: 0.003498,
            d: 0.002423,
            omega_s: 0.08581,
            eps: 1e-5,
            asymmetry: 0.0,
            harmonics_forward: [0.0; 4],
            harmonics_backward: [0.0; 4],
        }
    }
}

impl Default for Wheel {
    fn default() -> Self {
        Wheel {
            enabled: false,
            inertia: 2.25e-3,
            speed_0: 1600.0 * RPM,
            speed_min: 200.0 * RPM,
            speed_max: 3000.0 * RPM,
            tau_max: 0.26,
        }
    }
}

impl Default for Imu {
    fn default() -> Self {
        Imu {
            enabled: false,
            rate: 50.0,
            arw: 5.75e-5,
            bias_instability: 5.21e-5,
            bias_time: 100.0,
            lsb: 0.0,
            seed: 1,
        }
    }
}

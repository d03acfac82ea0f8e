//! Parameters of the plant with the bench's values, in SI units.
//!
//! `Parameters::default()` is the thesis's bench (TRACTOR, 24 degC, 10 cm of
//! water). Fields are named like the FMU's parameters (`tank.d` is `tank.d` there, `hub.inertia`
//! and `wheel.inertia` are `hub.I` and `wheel.I`, `own_inertia` is `I_own`); what each means,
//! its unit and its range stand in the FMU's variable table.

/// All parameters of the plant.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Parameters {
    pub hub: Hub,
    pub tank: Tank,
    pub fluid: Fluid,
    pub slosh: Slosh,
    pub baffle: Ring,
    pub bench: Bench,
    pub friction: Friction,
    pub init: Init,
    pub wheel: Wheel,
    pub imu: Imu,
    pub solver: Solver,
}

/// The rigid hub with the dry tank.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Hub {
    pub inertia: f64,
    pub imbalance: f64,
    pub imbalance_angle: f64,
    pub k: f64,
    pub theta_0: f64,
    pub c: f64,
}

/// An upright cylinder, its axis parallel to the bearing's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Tank {
    pub d: f64,
    pub h: f64,
    pub r: f64,
    pub own_inertia: f64,
}

/// The liquid.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Fluid {
    pub rho: f64,
    pub nu: f64,
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
    /// The first mode of an upright cylinder to third order in the amplitude.
    Liquid = 6,
}

impl SloshModel {
    /// All of them, in the order of their numbers.
    pub const ALL: [SloshModel; 6] = [
        SloshModel::Frozen,
        SloshModel::Linear,
        SloshModel::Planar,
        SloshModel::Spherical,
        SloshModel::Paraboloid,
        SloshModel::Liquid,
    ];
}

/// Source of the modal parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum SloshSource {
    /// An upright cylinder by its dimensions.
    Geometry = 1,
    /// A table of modes.
    Table = 2,
}

impl SloshSource {
    /// All of them, in the order of their numbers.
    pub const ALL: [SloshSource; 2] = [SloshSource::Geometry, SloshSource::Table];
}

/// The largest number of slosh modes.
pub const MODES: usize = 10;

/// Dependence of a mode's viscous coefficient c on its natural frequency omega_n.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum DampingLaw {
    /// c ~ omega_n^(1/2): a laminar layer at the wall, for bare tanks.
    Laminar = 1,
    /// c ~ omega_n: the damping ratio stays, for one that was measured or prescribed.
    ConstantRatio = 2,
    /// Laminar where the damping ratio comes from the correlation, constant where it is given.
    BySource = 3,
}

impl DampingLaw {
    /// All of them, in the order of their numbers.
    pub const ALL: [DampingLaw; 3] =
        [DampingLaw::Laminar, DampingLaw::ConstantRatio, DampingLaw::BySource];
}

/// Choice and parameters of the slosh model; `modes` is 1 to [`MODES`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Slosh {
    pub model: SloshModel,
    pub source: SloshSource,
    pub modes: usize,
    pub capillarity: bool,
    pub table: ModeTable,
    pub zeta_from_correlation: bool,
    pub zeta: f64,
    pub damping_law: DampingLaw,
    pub zeta_amplitude: f64,
    pub hardening: f64,
}

/// The modes of a tank of any shape; 0 for what is not given.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct ModeTable {
    /// The modes are those along one axis of a tank that has others across it.
    pub one_axis: bool,
    pub m_liq: f64,
    pub g_ref: f64,
    pub mass: [f64; MODES],
    pub length: [f64; MODES],
    pub frequency: [f64; MODES],
    pub hinge: [f64; MODES],
    pub k: [f64; MODES],
    pub zeta: [f64; MODES],
    pub wave: [f64; MODES],
    /// Angle from the tangent, outwards positive, of the direction in which a mode moves its mass, rad.
    pub direction: [f64; MODES],
}

impl ModeTable {
    /// Radial and tangential component of a mode's direction.
    pub(crate) fn along(&self, n: usize) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.direction[n]);
        [sin, cos]
    }

    /// Pendulum length, m: as given, or from the frequency f at g_ref and the centring stiffness,
    /// (2 pi f)^2 = g_ref/l + k/m.
    pub(crate) fn length_of(&self, n: usize) -> f64 {
        if self.length[n] > 0.0 {
            return self.length[n];
        }
        let omega = core::f64::consts::TAU * self.frequency[n];
        self.g_ref / (omega * omega - self.k[n] / self.mass[n])
    }
}

/// A flat ring at the tank's wall, `depth` below the surface; width 0: none.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Ring {
    pub width: f64,
    pub depth: f64,
}

/// Attitude of the bench: its axis is tilted by `tilt`; the component of gravity across the axis points to
/// `tilt_azimuth`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Bench {
    pub tilt: f64,
    pub tilt_azimuth: f64,
}

/// The laws of the bearing's friction; when to choose which is said in their files.
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
    /// Bristles that deflect before they slide (LuGre).
    Lugre = 5,
}

impl FrictionModel {
    /// All of them, in the order of their numbers.
    pub const ALL: [FrictionModel; 5] = [
        FrictionModel::None,
        FrictionModel::Viscous,
        FrictionModel::StribeckSmooth,
        FrictionModel::Stribeck,
        FrictionModel::Lugre,
    ];
}

/// The bearing; `harmonics_forward` and `harmonics_backward` are the coefficients of
/// cos theta, sin theta, cos 2 theta, sin 2 theta.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Friction {
    pub model: FrictionModel,
    pub b: f64,
    pub c: f64,
    pub d: f64,
    pub omega_s: f64,
    pub eps: f64,
    pub sigma0: f64,
    pub sigma1: f64,
    pub asymmetry: f64,
    pub harmonics_forward: [f64; 4],
    pub harmonics_backward: [f64; 4],
}

/// Initial motion; the slosh quantities are mode 1's.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Init {
    pub theta: f64,
    pub omega: f64,
    pub slosh_angle: f64,
    pub slosh_angle_radial: f64,
    pub slosh_rate: f64,
    pub slosh_rate_radial: f64,
}

/// The reaction wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Wheel {
    pub enabled: bool,
    pub inertia: f64,
    pub speed_0: f64,
    pub speed_min: f64,
    pub speed_max: f64,
    pub tau_max: f64,
}

/// The rate gyro on the hub.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Imu {
    pub enabled: bool,
    pub rate: f64,
    pub arw: f64,
    pub bias_instability: f64,
    pub bias_time: f64,
    pub lsb: f64,
    pub seed: i32,
}

/// The integrator; `max_steps` is how many internal steps and gyro samples one call may take.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Solver {
    pub max_steps: usize,
}

const RPM: f64 = core::f64::consts::PI / 30.0;

// Sources: thesis Tables 5.1, 5.4, 5.5, 5.6; water at 24 degC; the wheel's
// inertia is an inference (a steel disc of 125 mm diameter).
impl Default for Hub {
    fn default() -> Self {
        let (imbalance, imbalance_angle) = (0.0, 0.0);
        let (k, theta_0, c) = (0.0, 0.0, 0.0);
        Hub { inertia: 0.322414, imbalance, imbalance_angle, k, theta_0, c }
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
            source: SloshSource::Geometry,
            modes: 1,
            capillarity: false,
            table: ModeTable::default(),
            zeta_from_correlation: true,
            zeta: 0.003,
            damping_law: DampingLaw::BySource,
            zeta_amplitude: 0.0,
            hardening: 0.58,
        }
    }
}

impl Default for ModeTable {
    fn default() -> Self {
        let none = [0.0; MODES];
        ModeTable {
            one_axis: false,
            m_liq: 0.0,
            g_ref: 9.81,
            mass: none,
            length: none,
            frequency: none,
            hinge: none,
            k: none,
            zeta: none,
            wave: none,
            direction: none,
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
            // Not the thesis's: 6 µrad of deflection, and damping well within passivity.
            sigma0: 1000.0,
            sigma1: 0.01,
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

impl Default for Solver {
    /// One mode needs a fraction of a second for them, ten spherical ones some six seconds.
    fn default() -> Self {
        Solver { max_steps: 200_000 }
    }
}

//! Parameters of the plant, in SI units. `Parameters::default()` is the bench of Rubaga's thesis (TRACTOR, 24 degC, 10
//! cm of water). Fields have the names of the FMU's parameters, for example `tank.d`, except for `hub.inertia`
//! (`hub.I` in the FMU), `wheel.inertia` (`wheel.I`) and `own_inertia` (`I_own`). Meanings, units and ranges are in
//! the FMU's variable table.

// The variable table has the texts.
#![allow(missing_docs)]

use crate::slosh_model::SloshModel;

#[derive(Clone, Copy, Debug, PartialEq, Default)]
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

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hub {
    pub inertia: f64,
    pub imbalance: f64,
    pub imbalance_angle: f64,
    pub k: f64,
    pub theta_0: f64,
    pub c: f64,
}

/// An upright cylindrical tank, whose axis is parallel to the bearing axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tank {
    pub d: f64,
    pub h: f64,
    pub r: f64,
    pub own_inertia: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    pub rho: f64,
    pub nu: f64,
    pub sigma: f64,
}

/// Source of the modal parameters: the dimensions of an upright cylinder, or a table of modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum SloshSource {
    Geometry = 1,
    Table = 2,
}

impl SloshSource {
    pub const ALL: [SloshSource; 2] = [SloshSource::Geometry, SloshSource::Table];
}

/// Largest number of slosh modes.
pub const MODES: usize = 10;

/// How the drag coefficient of a mode changes with its natural frequency. `Laminar`: with the square root of the frequency,
/// as in the laminar layer at the wall of a tank without baffles. `ConstantRatio`: in proportion to the frequency, so that
/// the damping ratio stays the same. `BySource`: `Laminar` if the damping ratio comes from the correlation, and
/// `ConstantRatio` if it is a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum DampingLaw {
    Laminar = 1,
    ConstantRatio = 2,
    BySource = 3,
}

impl DampingLaw {
    pub const ALL: [DampingLaw; 3] =
        [DampingLaw::Laminar, DampingLaw::ConstantRatio, DampingLaw::BySource];
}

/// The slosh model and its parameters. `modes` is the number of modes, 1 to [`MODES`].
#[derive(Clone, Copy, Debug, PartialEq)]
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
    pub zeta_breaking: f64,
    pub breaking_steepness: f64,
}

/// Slosh modes of a tank of any shape. A value of 0 means that the value is not given.
/// - `nonlinear_inertia`, `nonlinear_stiffness`: large-wave coefficients s and kappa, which are 1 for a pendulum.
/// - `angle_limit`, `swirl_limit`: slosh angles, rad, above which a mode, or its rotary motion, is out of range.
/// - `direction`: angle, rad, from the tangent to the direction in which a mode moves its mass, positive outwards.
/// - `one_axis`: true if the tank also has modes along a second axis, which the table does not contain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeTable {
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
    pub wave_number: [f64; MODES],
    pub nonlinear_inertia: [f64; MODES],
    pub nonlinear_stiffness: [f64; MODES],
    pub angle_limit: [f64; MODES],
    pub swirl_limit: [f64; MODES],
    pub direction: [f64; MODES],
}

impl ModeTable {
    pub(crate) fn direction_components(&self, n: usize) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.direction[n]);
        [sin, cos]
    }

    /// Returns the pendulum length l of mode `n`, m. If the frequency f is given instead of the length, l follows from (2 pi
    /// f)^2 = g_ref/l + k/m with the specific force g_ref, the stiffness k by surface tension and the slosh mass m.
    pub(crate) fn pendulum_length(&self, n: usize) -> f64 {
        if self.length[n] > 0.0 {
            return self.length[n];
        }
        let omega = core::f64::consts::TAU * self.frequency[n];
        self.g_ref / (omega * omega - self.k[n] / self.mass[n])
    }
}

/// A flat ring baffle at the wall of the tank, `depth` m below the surface. A `width` of 0 m means that there is no baffle.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Ring {
    pub width: f64,
    pub depth: f64,
}

/// Attitude of the bench: the angle `tilt` between its axis and gravity, rad, and the azimuth `tilt_azimuth` of gravity's
/// component across the axis, rad.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Bench {
    pub tilt: f64,
    pub tilt_azimuth: f64,
}

/// Friction laws of the bearing: none; viscous friction; Stribeck's curve, in which the sign of the rate is either smoothed
/// or set-valued so that the hub can stick; and LuGre, with bristles that deflect before they slide. The file of each law
/// describes when to choose it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FrictionModel {
    None = 1,
    Viscous = 2,
    StribeckSmooth = 3,
    Stribeck = 4,
    Lugre = 5,
}

impl FrictionModel {
    pub const ALL: [FrictionModel; 5] = [
        FrictionModel::None,
        FrictionModel::Viscous,
        FrictionModel::StribeckSmooth,
        FrictionModel::Stribeck,
        FrictionModel::Lugre,
    ];
}

/// Friction of the bearing. `harmonics_forward` and `harmonics_backward` are, for each direction of rotation, the
/// coefficients of cos theta, sin theta, cos 2 theta and sin 2 theta in the directional factor.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// Initial conditions. The slosh angles and rates belong to mode 1; all other modes start at rest.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Init {
    pub theta: f64,
    pub omega: f64,
    pub slosh_angle: f64,
    pub slosh_angle_radial: f64,
    pub slosh_rate: f64,
    pub slosh_rate_radial: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    pub enabled: bool,
    pub inertia: f64,
    pub speed_0: f64,
    pub speed_min: f64,
    pub speed_max: f64,
    pub tau_max: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imu {
    pub enabled: bool,
    pub rate: f64,
    pub arw: f64,
    pub bias_instability: f64,
    pub bias_time: f64,
    pub flicker: f64,
    pub rrw: f64,
    pub lsb: f64,
    pub seed: i32,
}

/// Limits of the integrator. `max_steps` is the largest number of internal steps and gyro samples in one call.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solver {
    pub max_steps: usize,
}

const RPM: f64 = core::f64::consts::PI / 30.0;

// Sources: thesis Tables 5.1, 5.4, 5.5, 5.6; water at 24 degC. The wheel's inertia is an assumption
// (a steel disc of 125 mm diameter).
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
            zeta_breaking: 0.0,
            breaking_steepness: 0.0,
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
            wave_number: none,
            nonlinear_inertia: [1.0; MODES],
            nonlinear_stiffness: [1.0; MODES],
            angle_limit: none,
            swirl_limit: none,
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
            // These values are not from the thesis: a deflection of 6 µrad, and damping well within the limit of passivity.
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
            flicker: 0.0,
            rrw: 0.0,
            lsb: 0.0,
            seed: 1,
        }
    }
}

impl Default for Solver {
    /// Returns a limit on internal steps that corresponds to less than a second of computing time for one communication step
    /// with one mode, and to about six seconds with ten spherical modes.
    fn default() -> Self {
        Solver { max_steps: 200_000 }
    }
}

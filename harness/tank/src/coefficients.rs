//! Coefficients of the first mode at finite amplitude, as [`crate::finite_amplitude`] computes them.

use serde::Serialize;

/// Amplitude dependence of the first mode: its coefficients in the direction of motion or, for a box, along
/// the first and the second length; `None` if they are not known. `pendulum_limit` is the slosh angle, rad, above which a
/// pendulum in place of these coefficients is out of range, for each mode that has a direction. `warnings` hold limits of the
/// coefficients, and reasons for missing ones.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FiniteAmplitude {
    pub mode: Option<Coefficients>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode_y: Option<Coefficients>,
    pub pendulum_limit: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pendulum_limit_y: Option<f64>,
    pub warnings: Vec<String>,
}

/// Third-order coefficients of a mode.
///
/// - `nonlinear_inertia`, `nonlinear_stiffness`: s and kappa, as in the FMUs, 1 for a pendulum; `error` is
///   their estimated error over 1 + |s| and 1 + |kappa|.
/// - `planar`, `circular`: relative shift of omega^2 per squared slosh angle; a mode along one length of a
///   box has no circular motion.
/// - `wave_second`: second-order elevation at the wall per squared slosh angle, m/rad². At an angle A the
///   crest is wave A + wave_second A^2 high and the trough wave A - wave_second A^2 deep.
/// - `bridged`: true if the coefficients are interpolated over the fill across a pole of the third order.
/// - `energy`: coefficients that also give the wave's energy, for a tank that keeps its liquid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Coefficients {
    pub nonlinear_inertia: f64,
    pub nonlinear_stiffness: f64,
    pub error: f64,
    pub planar: f64,
    pub circular: Option<f64>,
    pub wave_second: f64,
    /// Slosh angle, rad, above which the equivalent mass does not represent the mode: the smaller
    /// of the angle at which its frequency errs by 0.3 % and the angle at which a forced response
    /// errs by 3 %.
    pub angle_limit: f64,
    pub angle_limit_from: LimitSource,
    pub frequency_limit: Option<f64>,
    /// Slosh angle, rad, above which rotary motion is out of range, because a forced response errs by 3 % or its branch
    /// folds by a secondary resonance; `None` if `angle_limit` is smaller or no rotary motion was compared.
    pub swirl_limit: Option<f64>,
    /// Angle at which the second-order wave is half of the first-order wave, rad, at most 30 degrees. The
    /// series is not valid above it, whereas below it the error is not known.
    pub series_limit: f64,
    pub bridged: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Energy>,
}

/// Coefficients of a mode with the wave's energy (`formulas::energy_terms`), in place of the coefficients of the third
/// order: s, kappa, s_2, kappa_2, t and t_2 under the names of the FMUs. `angle_limit` is the angle above which the mode is
/// out of range, rad, `swirl_limit` the angle for rotary motion, if it is smaller, and `frequency_limit` the angle up to
/// which the slosh mass was compared with potential flow: there its frequency, planar and rotary, and its energy in planar motion have at most these relative errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Energy {
    pub nonlinear_inertia: f64,
    pub nonlinear_stiffness: f64,
    pub nonlinear_inertia_2: f64,
    pub nonlinear_stiffness_2: f64,
    pub rotary_inertia: f64,
    pub rotary_inertia_2: f64,
    pub angle_limit: f64,
    pub swirl_limit: Option<f64>,
    pub frequency_limit: f64,
    pub frequency_error: f64,
    pub energy_error: f64,
    pub source: EnergySource,
}

impl Energy {
    /// Returns the coefficients s, kappa, s_2, kappa_2, t and t_2, each with the name of its
    /// parameter in the FMUs.
    pub fn parameters(&self) -> [(&'static str, f64); 6] {
        [
            ("nonlinear_inertia", self.nonlinear_inertia),
            ("nonlinear_stiffness", self.nonlinear_stiffness),
            ("nonlinear_inertia_2", self.nonlinear_inertia_2),
            ("nonlinear_stiffness_2", self.nonlinear_stiffness_2),
            ("rotary_inertia", self.rotary_inertia),
            ("rotary_inertia_2", self.rotary_inertia_2),
        ]
    }
}

/// Source of the coefficients that give the wave's energy, each by fully nonlinear potential flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EnergySource {
    CylinderTable,
    SphereTable,
    ThisTank,
}

impl EnergySource {
    pub fn words(self) -> &'static str {
        match self {
            EnergySource::CylinderTable => "upright cylinders",
            EnergySource::SphereTable => "spheres",
            EnergySource::ThisTank => "this tank",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitSource {
    PotentialFlow,
    /// The difference of the frequency from free waves of fully nonlinear potential flow in this tank.
    FreeWaves,
    /// A share of the angle at which the second-order wave is half of the first-order wave: the smallest
    /// share that upright cylinders and spheres have; at most the largest angle of an upright cylinder.
    Estimate,
}

impl LimitSource {
    pub fn words(self) -> &'static str {
        match self {
            LimitSource::PotentialFlow => {
                "fully nonlinear potential flow in this shape, free and forced"
            }
            LimitSource::FreeWaves => {
                "free waves of fully nonlinear potential flow in this shape; forced waves were not compared"
            }
            LimitSource::Estimate => {
                "an estimate, not a comparison: a share of the angle at which the series breaks down"
            }
        }
    }
}

//! Coefficients of the first mode at finite amplitude, as [`crate::finite_amplitude`] computes them.

use serde::Serialize;

/// Amplitude dependence of the first mode: its coefficients along the direction of motion or, for a box, along the
/// first and the second length; `None` if the coefficients are not known. `pendulum_limit` is the slosh angle, rad,
/// above which a pendulum (s = kappa = 1) is out of range as a model of this mode, one for each direction. `warnings`
/// state the limits of the coefficients, and the reasons for missing coefficients.
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
/// - `nonlinear_inertia`, `nonlinear_stiffness`: s and kappa, as in the FMUs, 1 for a pendulum; `error` is the
///   estimated error of both, relative to 1 + |s| and 1 + |kappa|.
/// - `planar`, `circular`: relative shift of omega^2 per squared slosh angle; a mode along one length of a box
///   has no circular motion.
/// - `wave_second`: second-order elevation at the wall per squared slosh angle, m/rad². At a slosh angle A the crest
///   is wave A + wave_second A^2 high and the trough wave A - wave_second A^2 deep.
/// - `bridged`: true if the third-order theory has a pole near this fill, so that the coefficients are interpolated
///   over the fill across it.
/// - `energy`: coefficients that also give the wave's energy, for a tank that keeps its liquid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Coefficients {
    pub nonlinear_inertia: f64,
    pub nonlinear_stiffness: f64,
    pub error: f64,
    pub planar: f64,
    pub circular: Option<f64>,
    pub wave_second: f64,
    /// Slosh angle, rad, up to which the equivalent mass represents the mode: the smaller of two angles. At one the
    /// error of the mass's frequency reaches 0.3 %, at the other the error of a forced response reaches 3 %.
    pub angle_limit: f64,
    pub angle_limit_from: LimitSource,
    pub frequency_limit: Option<f64>,
    /// Slosh angle, rad, above which rotary motion is out of range, because the error of a forced response reaches 3 %
    /// or because a secondary resonance folds the branch of rotary motion. `None` if `angle_limit` is smaller, or if
    /// rotary motion was not compared with potential flow.
    pub swirl_limit: Option<f64>,
    /// Slosh angle, rad, at which the second-order wave is half of the first-order wave, at most 30 degrees. Above this
    /// angle the series is not valid; below it, the error of the series is not known.
    pub series_limit: f64,
    pub bridged: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Energy>,
}

/// Coefficients of a mode that also give the wave's energy (`formulas::energy_terms`), used instead of the third-order
/// coefficients: s, kappa, s_2, kappa_2, t and t_2 under the names of the FMUs. The mode is out of range above the
/// slosh angle `angle_limit`, rad, and in rotary motion already above `swirl_limit` if that is smaller. Up to the angle
/// `frequency_limit` the slosh mass was compared with potential flow: its frequencies in planar and in rotary motion,
/// and its energy in planar motion, have at most the relative errors given here.
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

/// Method by which the coefficients that give the wave's energy were computed, each from fully nonlinear potential flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EnergySource {
    CylinderTable,
    SphereTable,
    ThisTank,
}

impl EnergySource {
    pub fn describe(self) -> &'static str {
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
    /// The frequency of the equivalent mass was compared with free waves of fully nonlinear potential flow in this tank.
    FreeWaves,
    /// No computed waves were available for comparison. The limit is a fraction of the slosh angle at which the
    /// second-order wave is half of the first-order wave: the smallest fraction found in upright cylinders and spheres.
    /// The limit is at most the largest one found in upright cylinders.
    Estimate,
}

impl LimitSource {
    pub fn describe(self) -> &'static str {
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

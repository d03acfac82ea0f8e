//! Coefficients of the first mode at finite amplitude, as [`crate::finite_amplitude`] computes them.

use serde::Serialize;

/// Amplitude dependence of the first mode of a tank.
///
/// - `mode`, `mode_y`: coefficients of the first mode, for a box along its first and along its
///   second side; `None` if not known.
/// - `pendulum_limit`, `pendulum_limit_y`: slosh angle, rad, above which a pendulum is out of range
///   as a model of this mode.
/// - `warnings`: limits of the coefficients, and the reasons why coefficients are missing.
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
/// - `nonlinear_inertia`, `nonlinear_stiffness`: coefficients s and kappa of an equivalent mass m
///   with the displacement q, the length l and the frequency omega of small motion. In a plane its
///   inertia is m (1 + s q^2/l^2), and its restoring force is m omega^2 q (1 + kappa q^2/(2 l^2)).
///   Both coefficients are 1 for a pendulum.
/// - `error`: estimated error of s and kappa, relative to 1 + |s| and 1 + |kappa|.
/// - `planar`, `circular`: relative shift of the squared frequency per squared slosh angle; a mode
///   along one length of a box has no circular motion.
/// - `wave_second`: second-order elevation at the wall per squared slosh angle, m/rad². At a slosh
///   angle A the crest is wave A + wave_second A^2 high and the trough wave A - wave_second A^2
///   deep.
/// - `bridged`: true if the third-order theory has a pole near this fill, so that the coefficients
///   are interpolated over the fill across the pole.
/// - `energy`: coefficients that also give the wave's energy, for a tank that keeps its liquid.
/// - `angle_limit`: slosh angle up to which the equivalent mass represents the mode, rad. It is the
///   smaller of two angles: the angle at which the error of the mass's frequency reaches 0.3 %, and
///   the angle at which the error of a forced response reaches 3 %.
/// - `swirl_limit`: slosh angle above which rotary motion is out of range, rad. There the error of
///   a forced response reaches 3 %, or a secondary resonance folds the branch of rotary motion.
///   `None` if `angle_limit` is smaller, or if rotary motion was not compared with potential flow.
/// - `series_limit`: slosh angle at which the second-order wave is half of the first-order wave,
///   rad, but at most 30 degrees. Above this angle the series is not valid; below it, the error of
///   the series is not known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Coefficients {
    pub nonlinear_inertia: f64,
    pub nonlinear_stiffness: f64,
    pub error: f64,
    pub planar: f64,
    pub circular: Option<f64>,
    pub wave_second: f64,
    pub angle_limit: f64,
    pub angle_limit_from: LimitSource,
    pub frequency_limit: Option<f64>,
    pub swirl_limit: Option<f64>,
    pub series_limit: f64,
    pub bridged: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Energy>,
}

/// Coefficients of a mode that give both the frequency and the energy of large waves
/// (`formulas::energy_terms`). If they are known, they are used instead of the third-order
/// coefficients. The first six fields, which have the names of the FMUs' parameters, are the
/// coefficients s, kappa, s_2, kappa_2, t and t_2 of that module.
///
/// - `angle_limit`: slosh angle above which the mode is out of range, rad.
/// - `swirl_limit`: slosh angle above which rotary motion is out of range, rad, if this angle is
///   smaller.
/// - `frequency_limit`: slosh angle up to which the slosh mass was compared with potential flow,
///   rad.
/// - `frequency_error`, `energy_error`: largest relative error, up to `frequency_limit`, of the
///   frequencies in planar and rotary motion, and of the energy in planar motion.
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

/// Origin of the coefficients that give the wave's energy. All of them come from fully nonlinear
/// potential flow.
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

/// Origin of the angle limit of a mode.
///
/// - `FreeWaves`: comparison of the equivalent mass's frequency with free waves of fully nonlinear
///   potential flow in this tank.
/// - `Estimate`: estimate, because no computed waves were available for a comparison. It is a
///   fraction of the slosh angle at which the second-order wave is half of the first-order wave:
///   the smallest fraction that was found in upright cylinders and spheres. The limit is never
///   above the largest limit found in upright cylinders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitSource {
    PotentialFlow,
    FreeWaves,
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

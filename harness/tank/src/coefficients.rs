//! Coefficients of the first mode at finite amplitude, as [`crate::finite_amplitude`] computes them.

use serde::Serialize;

/// Amplitude dependence of the first mode.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FiniteAmplitude {
    /// Coefficients of the first mode (of a box along its first length); `None` if they are not known.
    pub mode: Option<Coefficients>,
    /// Coefficients of a box's first mode along its second length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode_y: Option<Coefficients>,
    /// Limits of the coefficients, and reasons for missing ones, one sentence each.
    pub warnings: Vec<String>,
}

/// Third-order coefficients of a mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Coefficients {
    /// s, `nonlinear_inertia` in the FMUs; 1 for a pendulum.
    pub nonlinear_inertia: f64,
    /// kappa, `nonlinear_stiffness` in the FMUs; 1 for a pendulum.
    pub nonlinear_stiffness: f64,
    /// Estimated error of both, over 1 + |s| and 1 + |kappa|.
    pub error: f64,
    /// Relative shift of omega^2 per squared slosh angle, planar motion.
    pub planar: f64,
    /// The same for circular motion; `None` for a mode along one length of a box.
    pub circular: Option<f64>,
    /// Second-order elevation at the wall per squared slosh angle, m/rad². At an angle A the crest is wave A + wave_second
    /// A^2 high, the trough wave A - wave_second A^2 deep.
    pub wave_second: f64,
    /// Angle above which the mode is out of range, rad: the smaller of the angles at which its frequency errs by 0.3 % and a
    /// forced response by 3 %.
    pub angle_limit: f64,
    /// Source of `angle_limit`.
    pub angle_limit_from: LimitSource,
    /// Angle at which the frequency errs by 0.3 %, rad; `None` if it is not known.
    pub frequency_limit: Option<f64>,
    /// Angle above which rotary motion is out of range, because its branch folds by a secondary resonance, rad; `None` if
    /// no fold is known.
    pub swirl_limit: Option<f64>,
    /// Angle at which the second-order wave is half of the first-order wave, rad, at most 30 degrees. The series is not
    /// valid above; it says nothing about the error below.
    pub series_limit: f64,
    /// True if the coefficients are interpolated over the fill across a pole of the third order.
    pub bridged: bool,
    /// Coefficients that give the wave's energy, too, for a tank that keeps its liquid; `None` where they are not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Energy>,
}

/// Coefficients of a mode with the wave's energy (`formulas::energy_terms`), in place of those of the third order.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Energy {
    /// s, `nonlinear_inertia` in the FMUs.
    pub nonlinear_inertia: f64,
    /// kappa, `nonlinear_stiffness` in the FMUs.
    pub nonlinear_stiffness: f64,
    /// s_2
    pub nonlinear_inertia_2: f64,
    /// kappa_2
    pub nonlinear_stiffness_2: f64,
    /// t
    pub rotary_inertia: f64,
    /// t_2
    pub rotary_inertia_2: f64,
    /// Angle above which the mode is out of range, rad.
    pub angle_limit: f64,
    /// Angle up to which the frequency was compared with potential flow, rad; the error is below 0.11 %.
    pub frequency_limit: f64,
}

/// Source of the angle at which a mode is out of range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitSource {
    /// Comparison with fully nonlinear potential flow in upright cylinders (`formulas::limits`).
    PotentialFlow,
    /// Share of the angle at which the second-order wave is half of the first-order wave: the smallest one that upright
    /// cylinders have.
    Estimate,
}

impl LimitSource {
    /// Returns the source in words.
    pub fn words(self) -> &'static str {
        match self {
            LimitSource::PotentialFlow => "fully nonlinear potential flow in upright cylinders",
            LimitSource::Estimate => {
                "an estimate, not a comparison: a share of the angle at which the series breaks down"
            }
        }
    }
}

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
    /// Angle above which the third order is not valid, rad: the second-order wave is half of the first-order wave. At most 30
    /// degrees.
    pub angle_limit: f64,
}

//! Results of the output-error method.

use serde::Serialize;

use super::braking::{Braking, FrictionPoint};
use crate::bench::causes::{Cause, Missing};
use crate::bench::nominal::Start;
use crate::bench::start::Response;
use crate::words::combination::Combination;
use crate::words::identified::Identified;
use analysis::innovations::Tests;

/// One model's fit.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ModelFit {
    /// slosh.model.
    pub model: String,
    /// friction.model.
    pub friction: String,
    /// −2 ln L.
    pub deviance: f64,
    /// Bayesian information criterion; the smallest is the best.
    pub bic: f64,
    /// Fit in the time domain, %: 100 (1 − |y − ŷ|/|y − mean y|).
    pub fit_pct: f64,
    /// The search ended at a minimum.
    pub converged: bool,
    /// Distance to the minimum in standard deviations.
    pub newton_decrement: f64,
    /// Residual tests, for each recording.
    pub tests: Vec<Tests>,
    /// Fit of the recordings held back, %.
    pub validation_pct: Vec<f64>,
    /// The gyro's noise: white, rad/s.
    pub noise_white: f64,
    /// Simulations that were needed, of all recordings; those of a part of them count as that part.
    pub simulations: f64,
    /// True if neither noise nor a small effect explains the residual.
    #[serde(skip)]
    pub poor: bool,
}

impl ModelFit {
    /// Description in one line.
    pub fn line(&self) -> String {
        format!(
            "{} with {} friction: fit {:.3} %, BIC {:.1}, worst residual test {:.1} standard deviations, {:.0} \
             simulations",
            self.model,
            self.friction,
            self.fit_pct,
            self.bic,
            self.tests.iter().map(Tests::worst).fold(0.0, f64::max),
            self.simulations
        )
    }
}

/// Results that only the output-error method has.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Details {
    /// The chosen model's fit.
    pub fit: ModelFit,
    /// Sums that are determined although their terms are not.
    pub combinations: Vec<Combination>,
    /// Condition number of the sensitivities.
    pub condition: f64,
    /// A torque that the model lacks, if noise is left with it and its rivals lose.
    pub missing: Vec<Missing>,
    /// The cause of a misfit, if noise is left with it and its rivals lose.
    pub cause: Option<Cause>,
    /// All models that were tried, the chosen one first.
    pub models: Vec<ModelFit>,
    /// Estimates from the frequency response.
    pub frequency_response: Option<Response>,
    /// Starts from the data.
    pub start: Option<Start>,
    /// Braking over the angle in free decay, counter-clockwise and clockwise, of friction runs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub braking: Vec<Braking>,
    /// Measured friction over the rate, of friction runs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub friction_points: Vec<FrictionPoint>,
    /// Largest slosh angle of the fit, rad; 0 without slosh.
    pub slosh_angle: f64,
    /// Wall time, s.
    pub seconds: f64,
}

/// The estimates, with those details.
pub type Identification = Identified<Details>;

//! Results of the output-error method.

use serde::Serialize;

use super::braking::{Braking, FrictionPoint};
use crate::fit::bench::candidate::ModelFit;
use crate::fit::bench::start::Response;
use crate::model::bench::nominal::Start;
use crate::uncertainty::bench::budget::Effect;
use crate::uncertainty::bench::cause::Cause;
use crate::uncertainty::bench::missing::Missing;
use crate::uncertainty::bench::sources::Combination;
use crate::words::identified::Identified;
use crate::words::start_study::Trial;

/// Results that only the output-error method has.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Details {
    /// The chosen model's fit.
    pub fit: ModelFit,
    /// Sums that are determined although their terms are not.
    pub combinations: Vec<Combination>,
    /// Condition number of the sensitivities.
    pub condition: f64,
    /// The error budget.
    pub error_budget: Vec<Effect>,
    /// Torques that the model lacks, if noise is left with them and their rivals lose.
    pub missing: Vec<Missing>,
    /// The cause of a misfit, if noise is left with it and its rivals lose.
    pub cause: Option<Cause>,
    /// All models that were tried, the chosen one first.
    pub models: Vec<ModelFit>,
    /// Estimates from the frequency response.
    pub frequency_response: Option<Response>,
    /// Starts from the data.
    pub start: Option<Start>,
    /// Ends of searches from other starts, if requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub starts: Vec<Trial>,
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

//! What the output-error method finds.

use serde::Serialize;

use super::Identified;
use crate::budget::Effect;
use crate::candidate::ModelFit;
use crate::missing::Missing;
use crate::nominal::Start;
use crate::start::Response;
use crate::uncertainty::Combination;

/// What the output-error method alone has to say.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Details {
    /// The chosen model's fit.
    pub fit: ModelFit,
    /// Sums that are known where their terms are not.
    pub combinations: Vec<Combination>,
    /// Condition number of the sensitivities.
    pub condition: f64,
    /// The error budget.
    pub error_budget: Vec<Effect>,
    /// Torques that the model lacks.
    pub missing: Vec<Missing>,
    /// All models that were tried, the chosen one first.
    pub models: Vec<ModelFit>,
    /// What the frequency response says.
    pub frequency_response: Option<Response>,
    /// Starts from the data.
    pub start: Option<Start>,
    /// Wall time, s.
    pub seconds: f64,
}

/// The estimates, with those details.
pub type Identification = Identified<Details>;

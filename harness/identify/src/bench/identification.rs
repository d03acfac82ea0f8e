use maud::{Markup, html};
use report::page::table;
use serde::Serialize;

use super::braking::{Braking, FrictionPoint, braking_chart, friction_curve};
use crate::bench::causes::{Cause, Missing};
use crate::bench::nominal::Start;
use crate::bench::start::Response;
use crate::estimate::Combination;
use crate::words::identified::{Identified, Report, Sections};
use analysis::innovations::Tests;

#[derive(Clone, Debug, Default, Serialize)]
pub struct ModelFit {
    pub model: String,
    pub friction: String,
    pub deviance: f64,
    pub bic: f64,
    /// Fit of the simulated rates ŷ to the measured rates y, %: 100 (1 − ‖y − ŷ‖/‖y − mean y‖).
    pub fit_pct: f64,
    pub converged: bool,
    /// Newton decrement: the distance from the estimates to the minimum of −2 ln L, in standard deviations, as predicted by
    /// one more Newton step.
    pub newton_decrement: f64,
    pub tests: Vec<Tests>,
    /// Fit of each validation recording, %.
    pub validation_pct: Vec<f64>,
    /// Standard deviation of the gyro's white noise, rad/s.
    pub noise_white: f64,
    /// Number of simulations of all recordings. A simulation of a part of the rows counts as a fraction.
    pub simulations: f64,
    /// True if the fit is below 90 % and the root mean square of the residual is more than twice the gyro's noise, so that the
    /// search has probably ended in a wrong minimum.
    #[serde(skip)]
    pub poor: bool,
}

impl ModelFit {
    fn worst_test(&self) -> f64 {
        self.tests.iter().map(Tests::worst).fold(0.0, f64::max)
    }

    pub fn line(&self) -> String {
        format!(
            "{} with {} friction: fit {:.3} %, BIC {:.1}, worst residual test {:.1} standard deviations, {:.0} \
             simulations",
            self.model,
            self.friction,
            self.fit_pct,
            self.bic,
            self.worst_test(),
            self.simulations
        )
    }
}

/// Results of a fit of the bench that other methods do not have.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Details {
    pub fit: ModelFit,
    pub combinations: Vec<Combination>,
    pub condition: f64,
    /// Torque that the model lacks. It is named only if the residual is noise with it, and no other effect explains
    /// the recordings as well.
    pub missing: Vec<Missing>,
    /// Cause of a misfit. It is named only if the residual is noise with it, and no other effect explains the recordings as well.
    pub cause: Option<Cause>,
    pub models: Vec<ModelFit>,
    pub frequency_response: Option<Response>,
    pub start: Option<Start>,
    /// Deceleration over the angle in free decays, counter-clockwise and clockwise. Empty except for friction runs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub braking: Vec<Braking>,
    /// Measured friction over the rate. Empty except for friction runs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub friction_points: Vec<FrictionPoint>,
    /// Largest slosh angle of the fit, rad; 0 without slosh.
    pub slosh_angle: f64,
    pub seconds: f64,
}

pub type Identification = Identified<Details>;

impl Report for Details {
    fn lines(found: &Identification) -> Vec<String> {
        let Details { fit, condition, seconds, .. } = &found.details;
        vec![format!(
            "fit {:.3} %, noise {:.2e} rad/s, condition number {condition:.0}, {:.0} simulations in {seconds:.1} s",
            fit.fit_pct, fit.noise_white, fit.simulations
        )]
    }

    fn sections(found: &Identification) -> Sections {
        let details = &found.details;
        let fit = &details.fit;
        Sections {
            first: html! {
                @if found.fits == Some(true) && found.converged {
                    p {
                        (format!("The model {} with {} friction fits: its residual is the gyro's noise, {:.2e} rad/s a row.",
                            fit.model, fit.friction, fit.noise_white))
                    }
                }
            },
            figures: html! {
                @if !details.friction_points.is_empty() { (friction_curve(&found.parameters, &details.friction_points)) }
                @if !details.braking.is_empty() { (braking_chart(&details.braking)) }
            },
            combinations: details.combinations.clone(),
            condition: Some(details.condition),
            last: models(&details.models),
        }
    }
}

fn models(models: &[ModelFit]) -> Markup {
    let best = models.iter().map(|m| m.bic).fold(f64::INFINITY, f64::min);
    let row = |m: &ModelFit| {
        let held: Vec<String> = m.validation_pct.iter().map(|v| format!("{v:.3}")).collect();
        vec![
            m.model.clone(),
            m.friction.clone(),
            format!("{:.3}", m.fit_pct),
            format!("{:.1}", m.bic - best),
            format!("{:.1}", m.worst_test()),
            held.join(", "),
            format!("{:.0}", m.simulations),
        ]
    };
    let head = [
        "slosh",
        "friction",
        "fit, %",
        "BIC less the best",
        "worst residual test",
        "of recordings held back, %",
        "simulations",
    ];
    html! { h2 { "Models" } (table(head, models.iter().map(row))) }
}

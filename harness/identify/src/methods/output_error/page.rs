//! Sections of the page on an output-error fit: models, error budget, starts.

use maud::{Markup, html};
use report::page::table;

use crate::estimate::Estimated;
use crate::fit::bench::candidate::ModelFit;
use crate::methods::identification::Identification;
use crate::uncertainty::bench::budget::Effect;
use crate::words::page::Sections;
use crate::words::start_study;

/// The sections.
pub fn sections(found: &Identification) -> Sections {
    let fit = &found.details.fit;
    Sections {
        first: html! {
            @if found.fits == Some(true) && found.converged {
                p {
                    (format!("The model {} with {} friction fits: its residual is the gyro's noise, {:.2e} rad/s a row.",
                        fit.model, fit.friction, fit.noise_white))
                }
            }
        },
        combinations: found.details.combinations.clone(),
        condition: Some(found.details.condition),
        last: html! {
            (models(&found.details.models))
            (budget(found))
            (start_study::section(&found.details.starts))
        },
        ..Sections::default()
    }
}

fn models(models: &[ModelFit]) -> Markup {
    let best = models.iter().map(|m| m.bic).fold(f64::INFINITY, f64::min);
    let row = |m: &ModelFit| {
        let worst = m.tests.iter().map(|t| t.worst()).fold(0.0, f64::max);
        let held: Vec<String> = m.validation_pct.iter().map(|v| format!("{v:.3}")).collect();
        vec![
            m.model.clone(),
            m.friction.clone(),
            format!("{:.3}", m.fit_pct),
            format!("{:.1}", m.bic - best),
            format!("{worst:.1}"),
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

/// A change of an estimate: in per cent, or in its own unit where the estimate is zero within its
/// standard deviation and a share of it would say nothing.
fn change(by: f64, p: &Estimated) -> String {
    match p.percent(by) {
        Some(percent) => format!("{percent:+.3}"),
        None if by == 0.0 => "0".into(),
        None => p.change(by),
    }
}

fn budget(found: &Identification) -> Markup {
    let effects = &found.details.error_budget;
    let row = |(name, p): (&String, &Estimated)| {
        let of = |effect: &Effect| change(effect.change.get(name).copied().unwrap_or(0.0), p);
        std::iter::once(name.clone()).chain(effects.iter().map(of)).collect()
    };
    let head = std::iter::once("estimate").chain(effects.iter().map(|e| e.source.as_str()));
    html! {
        h2 { "Error budget" }
        p { "Effect of errors in quantities that are not estimated, in % of each estimate, or in its unit if it is zero within its standard deviation. Tolerances (\"wrong by\") are part of the intervals." }
        (table(head, found.parameters.iter().map(row)))
    }
}

#[cfg(test)]
mod tests {
    use super::change;
    use crate::estimate::Estimated;

    #[test]
    fn an_estimate_that_is_zero_has_no_per_cent() {
        let bias = Estimated::normal(-1.4e-14, 9.3e-9, "rad/s");
        assert_eq!(change(6e-4, &bias), "+6.0e-4 rad/s");
        assert_eq!(change(0.0, &bias), "0");
        let inertia = Estimated::normal(0.32241, 8.1e-4, "kg.m2");
        assert_eq!(change(-0.0032241, &inertia), "-1.000");
    }
}

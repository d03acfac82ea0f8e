//! Sections of the page about an output-error fit: the models that were tried.

use maud::{Markup, html};
use report::page::table;

use crate::bench::identification::{Identification, ModelFit};
use crate::words::page::Sections;

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

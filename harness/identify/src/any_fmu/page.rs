//! The self-contained HTML page about the identification of any FMU.

use maud::html;
use report::page::table;

use super::Identification;
use crate::estimate::prose;
use crate::words::page::{self, Sections};

pub fn write(found: &Identification) -> String {
    let outputs = found.details.outputs.iter().map(|o| {
        vec![
            format!("{}, {}", o.recording, o.name),
            o.rows.to_string(),
            format!("{:.3e} {}", o.noise_white, prose(&o.unit)),
            format!("{:.2}", o.fit_percent),
            format!("{:.1}", o.tests.worst().max(o.mean.abs())),
        ]
    });
    let figures = html! {
        h2 { "Outputs" }
        p { "Noise of a row, how much of the output the model explains, and the worst test of the residual in standard \
             deviations of chance; 5 is the limit." }
        (table(["output", "rows", "noise", "fit, %", "worst test"], outputs))
    };
    page::of(found, &Sections { figures, ..Sections::default() })
}

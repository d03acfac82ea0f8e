//! One self-contained page on the identification of any FMU.

use maud::html;
use report::svg::{Chart, Style};

use super::{Identification, Output};
use crate::estimate::{Estimated, prose};
use crate::methods::Residual;
use crate::methods::page::{axis_chart, digits, drawn, page, series, table};

/// Points of a curve.
const POINTS: usize = 700;

/// The page.
pub fn of(found: &Identification) -> String {
    let rows = found.parameters.iter().chain(&found.measurement).map(row);
    let head = ["name", "value", "standard deviation", "95 % interval", "unit"];
    let outputs = found.details.outputs.iter().map(|o| {
        vec![
            format!("{}, {}", o.recording, o.name),
            o.rows.to_string(),
            format!("{:.3e} {}", o.noise_white, prose(&o.unit)),
            format!("{:.2}", o.fit_percent),
            format!("{:.1}", o.tests.worst().max(o.mean.abs())),
        ]
    });
    let (names, matrix) = &found.correlations;
    let pairs = (0..names.len()).flat_map(|i| (0..i).map(move |j| (j, i)));
    let mut pairs: Vec<(usize, usize)> =
        pairs.filter(|(j, i)| matrix[*i][*j].abs() > 0.5).collect();
    pairs.sort_by(|a, b| matrix[b.1][b.0].abs().total_cmp(&matrix[a.1][a.0].abs()));
    let pairs = pairs.iter().map(|(j, i)| {
        vec![names[*j].clone(), names[*i].clone(), format!("{:+.3}", matrix[*i][*j])]
    });
    let body = html! {
        h2 { "Parameters" }
        (table(head, rows))
        h2 { "Outputs" }
        p { "Noise of a row, how much of the output the model explains, and the worst test of the residual in standard \
             deviations of chance; 5 is the limit." }
        (table(["output", "rows", "noise", "fit, %", "worst test"], outputs))
        @for (residual, output) in found.residuals.iter().zip(&found.details.outputs) {
            @for chart in charts(residual, output) { (drawn(&chart)) }
        }
        h2 { "Correlations above 0.5" }
        (table(["", "", "correlation"], pairs))
    };
    page(found, &html! {}, &body)
}

fn row((name, p): (&String, &Estimated)) -> Vec<String> {
    vec![
        name.clone(),
        digits(p.value, p.std),
        format!("{:.1e}", p.std),
        format!("{} to {}", digits(p.interval[0], p.std), digits(p.interval[1], p.std)),
        prose(&p.unit),
    ]
}

/// An output with its model, and the residual in units of its noise.
fn charts(residual: &Residual, output: &Output) -> [Chart; 2] {
    let every = residual.time.len().div_ceil(POINTS);
    let of = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        (0..residual.time.len()).step_by(every).map(|k| (residual.time[k], value(k))).collect()
    };
    let label = match output.unit.as_str() {
        "" | "1" => output.name.clone(),
        unit => format!("{}, {}", output.name, prose(unit)),
    };
    let both = vec![
        series(of(&|k| residual.measured[k]), "soft", Style::Cloud, "measured"),
        series(of(&|k| residual.measured[k] - residual.residual[k]), "a", Style::Line, "model"),
    ];
    let scaled = of(&|k| residual.residual[k] / output.noise_white);
    let scaled = vec![series(scaled, "b", Style::Cloud, "residual")];
    [
        axis_chart(&residual.name, "time, s", &label, both, false),
        axis_chart("Residual over its noise", "time, s", "standard deviations", scaled, false),
    ]
}

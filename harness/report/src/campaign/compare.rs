use std::collections::HashMap;
use std::path::Path;

use experiments::campaign::{Outcome, Results};
use maud::{Markup, html};

use super::colors;
use super::figure::{Figure, Panel, numbers};
use super::page::{Page, sentence_with_names};

const COMPARED: [(&str, &str, f64); 4] = [
    ("f_dip_hz", "antiresonance / mHz", 1e3),
    ("f_res_hz", "resonance / mHz", 1e3),
    ("peak_slosh_angle_deg", "largest slosh angle / deg", 1.0),
    ("fit_freq_pct", "fit in frequency / %", 1.0),
];

pub(super) fn compare(
    other: &Path,
    page: &Page,
    results: &Results,
    add: &mut dyn FnMut(Vec<Figure>) -> Markup,
) -> Markup {
    let name = other.display();
    let Some(rows) = rows(other) else {
        return html! { p .warning { (name) " has no runs.csv to compare with." } };
    };
    let mut alone = Vec::new();
    let (mut panels, mut traces) = (Vec::new(), Vec::new());
    let mut largest = Vec::new();
    for (p, (column, label, factor)) in COMPARED.into_iter().enumerate() {
        let value = |run: &Outcome| match column {
            "f_dip_hz" => run.features().f_dip,
            "f_res_hz" => run.features().f_res,
            "fit_freq_pct" => run.fit().map(|fit| fit.fit_frequency),
            _ => Some(run.totals.peak_slosh_angle.to_degrees()),
        };
        let mut most: Option<(f64, &str)> = None;
        panels.push(Panel::new(&format!("this − other, {label}"), if p == 0 { "run" } else { "" }));
        for (i, group) in page.groups.iter().enumerate() {
            let mut points = Vec::new();
            for run in &group.runs {
                let row = rows.get(&run.case.name);
                if row.is_none() && p == 0 {
                    alone.push(run.case.name.clone());
                }
                let there = row.and_then(|row| row.get(column)?.parse::<f64>().ok());
                if let (Some(here), Some(there)) = (value(run), there) {
                    let miss = (here - there) * factor;
                    points.push((run.case.name.as_str(), miss));
                    if most.is_none_or(|(m, _)| m.abs() < miss.abs()) {
                        most = Some((miss, &run.case.name));
                    }
                }
            }
            let title = group.title();
            traces.push(serde_json::json!({
                "type": "bar", "orientation": "h", "panel": p, "name": title, "legendgroup": title,
                "x": numbers(points.iter().map(|p| p.1)),
                "y": points.iter().map(|p| p.0).collect::<Vec<_>>(),
                "marker": {"color": colors::category(i)},
            }));
        }
        largest.extend(most.map(|(miss, run)| format!("{label}: {miss:+.3} ({run})")));
    }
    let figure = add(vec![Figure {
        title: "This campaign minus the other".into(),
        caption: html! {
            (sentence_with_names("Largest differences", &largest)) (sentence_with_names("Only in this campaign", &alone))
        },
        columns: 2,
        height: 120 + 14 * results.outcomes.len(),
        panels,
        traces,
        ..Figure::default()
    }]);
    html! { p { "Runs of the same name in " code { (name) } "." } (figure) }
}

fn rows(directory: &Path) -> Option<HashMap<String, HashMap<String, String>>> {
    let mut reader = csv::Reader::from_path(directory.join("runs.csv")).ok()?;
    let rows = reader.deserialize::<HashMap<String, String>>().filter_map(Result::ok);
    Some(rows.filter_map(|row| Some((row.get("name")?.clone(), row))).collect())
}

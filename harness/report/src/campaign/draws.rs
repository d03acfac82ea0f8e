//! Figures of Monte Carlo campaigns: the drawn parameters with the largest influence, and the
//! distribution of the results.

use analysis::statistics;
use experiments::campaign::Outcome;
use maud::html;

use super::colors;
use super::figure::{Figure, Panel, numbers};
use super::page::{Group, Page, best};
use crate::svg::range;

type Quantity = (&'static str, &'static str, fn(&Outcome) -> Option<f64>);

pub(super) const QUANTITIES: [Quantity; 4] = [
    ("antiresonance", "mHz", |run| Some(1e3 * best(run)?.0.features.f_dip?)),
    ("resonance", "mHz", |run| Some(1e3 * best(run)?.0.features.f_res?)),
    ("separation Δf", "mHz", |run| Some(1e3 * best(run)?.0.features.delta_f()?)),
    ("notch depth", "dB", |run| best(run)?.0.features.notch_db),
];

fn random_parameters<'a>(page: &Page<'a>) -> Vec<(usize, &'a str)> {
    let grouping = page.plan.grouping();
    let drawn = page.plan.varied().into_iter().enumerate();
    drawn.filter(|(_, n)| !grouping.contains(n) && !n.ends_with("seed")).collect()
}

/// Ranks the drawn parameters by their influence, the largest last. For each: name, change of antiresonance
/// and resonance (mHz) for one standard deviation of the parameter, and the two correlation coefficients.
pub(super) fn ranked<'a>(page: &Page<'a>, group: &Group) -> Vec<(&'a str, [f64; 2], [f64; 2])> {
    let effect = |place: usize, of: fn(&Outcome) -> Option<f64>| {
        let point = |run: &&Outcome| Some((run.case.varied[place].parse().ok()?, of(run)?));
        let points: Vec<(f64, f64)> = group.runs.iter().filter_map(point).collect();
        let (_, deviation) = moments(&points.iter().map(|p| p.1).collect::<Vec<_>>());
        (correlation(&points), deviation)
    };
    // One standard deviation of the parameter changes the quantity by ρ standard deviations of the quantity.
    let mut ranked: Vec<(&str, [f64; 2], [f64; 2])> = random_parameters(page)
        .into_iter()
        .map(|(place, name)| {
            let each = [0, 1].map(|i| effect(place, QUANTITIES[i].2));
            (name, each.map(|(rho, s)| rho * s), each.map(|(rho, _)| rho))
        })
        .collect();
    let size = |row: &(&str, [f64; 2], [f64; 2])| row.1[0].abs().max(row.1[1].abs());
    ranked.sort_by(|a, b| size(a).total_cmp(&size(b)));
    ranked
}

pub(super) fn draws(page: &Page, group: &Group) -> Vec<Figure> {
    let (drawn, ranked) = (random_parameters(page), ranked(page, group));
    let names: Vec<&str> = ranked.iter().map(|row| row.0).collect();
    let bars = [0, 1].map(|i| {
        let text: Vec<String> = ranked.iter().map(|row| format!("ρ = {:.2}", row.2[i])).collect();
        serde_json::json!({
            "type": "bar", "orientation": "h", "panel": 0, "name": QUANTITIES[i].0, "y": names,
            "x": numbers(ranked.iter().map(|row| row.1[i])), "text": text, "textposition": "none",
            "marker": {"color": colors::category(i)},
            "hovertemplate": "%{y}: %{x:.3g} mHz, %{text}",
        })
    });
    let count = group.runs.len();
    let by_chance = 2.0 / (count.max(1) as f64).sqrt();
    let first = Figure {
        title: "Ranked sensitivities".into(),
        caption: html! {
            "Shift of antiresonance and resonance if a drawn parameter grows by one standard deviation while the others vary at random, the largest effect first. ρ is the correlation coefficient; in " (count) " draws a magnitude below " (format!("{by_chance:.2}")) " may be chance."
        },
        height: 110 + 30 * ranked.len(),
        panels: vec![Panel::new("change for one standard deviation / mHz", "")],
        traces: bars.to_vec(),
        ..Figure::default()
    };
    let (mut panels, mut traces, mut says) = (Vec::new(), Vec::new(), Vec::new());
    for (p, (name, unit, of)) in QUANTITIES.into_iter().enumerate() {
        let values: Vec<f64> = group.runs.iter().filter_map(|run| of(run)).collect();
        let (mean, deviation) = moments(&values);
        says.push(format!("{name} {mean:.1} ± {deviation:.1} {unit}"));
        panels.push(Panel::new(&format!("{name} / {unit}"), "draws"));
        let (x, counts) = histogram(&values);
        traces.push(serde_json::json!({
            "type": "bar", "panel": p, "name": name, "showlegend": false,
            "x": numbers(x), "y": counts, "marker": {"color": colors::category(p)},
        }));
    }
    let second = Figure {
        title: "Distribution over the draws".into(),
        caption: html! { "Mean and standard deviation of " (count) " draws: " (says.join(", ")) "." },
        columns: 4,
        height: 270,
        panels,
        traces,
        ..Figure::default()
    };
    let (mut panels, mut traces) = (Vec::new(), Vec::new());
    for (p, row) in ranked.iter().rev().take(4).enumerate() {
        let Some((place, _)) = drawn.iter().find(|(_, name)| *name == row.0) else { continue };
        panels.push(Panel::new(row.0, "frequency / mHz"));
        for (i, (name, _, of)) in QUANTITIES.into_iter().take(2).enumerate() {
            let point =
                |run: &&Outcome| Some((run.case.varied[*place].parse::<f64>().ok()?, of(run)?));
            let points: Vec<(f64, f64)> = group.runs.iter().filter_map(point).collect();
            traces.push(serde_json::json!({
                "type": "scatter", "mode": "markers", "panel": p, "name": name, "legendgroup": name,
                "x": numbers(points.iter().map(|p| p.0)), "y": numbers(points.iter().map(|p| p.1)),
                "marker": {"color": colors::category(i), "size": 4},
            }));
        }
    }
    let third = Figure {
        title: "Every draw over the parameters that decide".into(),
        caption: html! { "Antiresonance and resonance of each draw over the four parameters with the largest effect." },
        columns: 4,
        height: 270,
        panels,
        traces,
        ..Figure::default()
    };
    vec![first, second, third]
}

fn histogram(values: &[f64]) -> (Vec<f64>, Vec<usize>) {
    const BINS: usize = 24;
    let (low, high) = range(values.iter().copied());
    let width = ((high - low) / BINS as f64).max(1e-9);
    let mut counts = vec![0; BINS];
    for value in values {
        counts[(((value - low) / width) as usize).min(BINS - 1)] += 1;
    }
    ((0..BINS).map(|i| low + (i as f64 + 0.5) * width).collect(), counts)
}

pub(super) fn moments(values: &[f64]) -> (f64, f64) {
    match values {
        [] => (0.0, 0.0),
        _ => (statistics::mean(values), statistics::deviation(values)),
    }
}

fn correlation(points: &[(f64, f64)]) -> f64 {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    let found = statistics::correlation(&x, &y);
    if found.is_finite() { found } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::{correlation, histogram};

    #[test]
    fn correlation_is_one_for_proportional_columns_and_undefined_for_constants() {
        let line: Vec<(f64, f64)> = (0..10).map(|i| (f64::from(i), 3.0 - f64::from(i))).collect();
        assert!((correlation(&line) + 1.0).abs() < 1e-12);
        assert_eq!(correlation(&[(1.0, 2.0), (2.0, 2.0)]), 0.0);
    }

    #[test]
    fn a_histogram_counts_every_value_once() {
        let (x, counts) = histogram(&[1.0, 1.1, 1.5, 2.0]);
        assert_eq!(counts.iter().sum::<usize>(), 4);
        assert!(x[0] > 1.0 && x[23] < 2.0);
    }
}

use analysis::{BAND, FrequencyResponse, logarithmic_grid};
use experiments::campaign::{Curve, Estimate, Outcome};
use maud::html;

use super::colors;
use super::figure::{Figure, Panel, line, number, numbers, thinned};
use super::page::{Axis, Group, MOST_CURVES, Page, best, cm, distinct, passing, zip};

pub(super) fn responses(page: &Page, group: &Group) -> Figure {
    let mut traces = Vec::new();
    let runs = group.drawn.iter().filter_map(|run| Some((run, best(run)?)));
    let runs: Vec<_> = runs.take(MOST_CURVES).collect();
    let mut names = Vec::new();
    for (i, (run, (estimate, name))) in runs.iter().enumerate() {
        let color = colors::ordered(i, runs.len());
        if !names.contains(name) {
            names.push(*name);
        }
        let (name, dash) = match estimate.doubt {
            Some(_) => (format!("{} (not trusted)", page.name(run)), "dash"),
            None => (page.name(run), "solid"),
        };
        traces.extend(bode(&name, &color, dash, &estimate.response));
        // Only the first and the last curve have an interval, because the intervals of all curves
        // would cover each other.
        if i == 0 || i + 1 == runs.len() {
            traces.extend(intervals(&name, &color, estimate));
        }
    }
    traces.extend(bode("exact, linear and viscous", colors::INK, "dot", &group.exact_response()));
    Figure {
        title: format!("Frequency response, {}", group.title()),
        caption: html! {
            "Hub rate over torque (" (names.join(", ")) "). The response falls to the antiresonance at the slosh frequency and rises to the resonance above it. Shaded: 95 % intervals of the first and the last run, where they are wider than a line. At first the range around antiresonance and resonance is shown; a double click shows the whole band."
        },
        thesis: "6.6",
        height: 235,
        half: true,
        shared: true,
        panels: ["|H| / dB", "phase / deg"].map(|y| panel(group, y)).into(),
        traces,
        ..Figure::default()
    }
}

/// Returns the band (Hz) around the antiresonance and the resonance of linear theory and of every plotted run, because
/// the resonance of a nonlinear liquid or a bench differs from linear theory.
fn band_around_resonance(group: &Group) -> Option<(f64, f64)> {
    let (from, to) = group.band().unwrap_or(BAND);
    let of_runs = group.drawn.iter().filter_map(|run| Some(best(run)?.0.features));
    let bands = group.exact.iter().copied().chain(of_runs).filter_map(|features| {
        let (antiresonance, resonance) = features.f_dip.zip(features.f_res)?;
        let delta = resonance - antiresonance;
        Some(((antiresonance - 2.5 * delta).max(from), (resonance + 4.0 * delta).min(to)))
    });
    bands.reduce(|all, one| (all.0.min(one.0), all.1.max(one.1)))
}

fn panel(group: &Group, y: &str) -> Panel {
    let range = band_around_resonance(group);
    Panel { log_x: true, range, ..Panel::new("frequency / Hz", y) }
}

fn bode(
    name: &str,
    color: &str,
    dash: &str,
    response: &FrequencyResponse,
) -> [serde_json::Value; 2] {
    let curve = |values: Vec<f64>| thinned(&zip(&response.frequency, &values), true);
    [
        line(0, name, color, dash, &curve(response.decibels())),
        line(1, name, color, dash, &curve(response.degrees())),
    ]
}

/// Draws the band of two standard deviations around a response. Draws nothing where the band would be as
/// narrow as the line.
fn intervals(name: &str, color: &str, estimate: &Estimate) -> Vec<serde_json::Value> {
    /// Smallest half-width of an uncertainty band that is visible, dB, and the largest half-width that is drawn, as
    /// the standard deviation of ln |H|.
    const SEEN: f64 = 0.2;
    const WIDEST: f64 = 0.5;
    let decibel = 20.0 / std::f64::consts::LN_10;
    let response = &estimate.response;
    let wide = |s: &f64| 2.0 * s * decibel > SEEN;
    if !estimate.deviation.iter().any(wide) {
        return Vec::new();
    }
    let width: Vec<f64> = estimate.deviation.iter().map(|s| 2.0 * s.min(WIDEST)).collect();
    let sides = [(response.decibels(), decibel), (response.degrees(), 1f64.to_degrees())];
    let area = |(panel, (middle, scale)): (usize, (Vec<f64>, f64))| {
        let side = |sign: f64| {
            let edge = middle.iter().zip(&width).map(|(y, w)| y + sign * scale * w);
            let edge: Vec<(f64, f64)> = response.frequency.iter().copied().zip(edge).collect();
            thinned(&edge.iter().step_by(8).copied().collect::<Vec<_>>(), true)
        };
        let around: Vec<(f64, f64)> =
            side(1.0).into_iter().chain(side(-1.0).into_iter().rev()).collect();
        serde_json::json!({
            "type": "scatter", "mode": "lines", "name": name, "legendgroup": name, "panel": panel,
            "x": numbers(around.iter().map(|p| p.0)),
            "y": numbers(around.iter().map(|p| p.1)),
            "fill": "toself", "fillcolor": color.replace("rgb(", "rgba(").replace(')', ",0.18)"),
            "line": {"width": 0, "color": color}, "hoverinfo": "skip", "showlegend": false,
        })
    };
    sides.into_iter().enumerate().map(area).collect()
}

/// Plots the linear models that were fitted to the first and the last run of a group, and the coherence of the
/// residuals with the torque.
pub(super) fn fitted(page: &Page, group: &Group) -> Figure {
    let ends = [group.drawn.first(), group.drawn.last()];
    let ends = distinct(ends.into_iter().flatten().map(|run| run.case.name.as_str()));
    let runs = group.drawn.iter().filter(|run| ends.contains(&run.case.name.as_str()));
    let mut traces = Vec::new();
    for (i, run) in runs.enumerate() {
        let Some(record) = &run.record else { continue };
        let Some((fit, coherence)) = &record.fit else { continue };
        let (name, color) = (page.name(run), colors::category(i));
        let frequency = record.spa.response.frequency.clone();
        let response = frequency.iter().map(|f| fit.model.response(*f)).collect();
        let model = FrequencyResponse { frequency, response };
        traces.extend(bode(&format!("{name}, measured"), color, "solid", &record.spa.response));
        traces.extend(bode(&format!("{name}, fitted"), color, "dash", &model));
        let coherence = thinned(coherence, true);
        traces.push(line(2, &format!("{name}, measured"), color, "solid", &coherence));
    }
    Figure {
        title: format!("Fitted transfer function and residual coherence, {}", group.title()),
        caption: html! { "A transfer function with three poles and two zeros (dashed) over the measured response of the smallest and the largest torque, and the coherence of the residual with the torque, which is 1 where the residual follows the torque linearly." },
        thesis: "6.4, 6.5 and 6.7",
        height: 235,
        half: true,
        shared: true,
        panels: ["|H| / dB", "phase / deg", "residual coherence γ²"]
            .map(|y| panel(group, y))
            .into(),
        traces,
        ..Figure::default()
    }
}

pub(super) fn models(page: &Page) -> Vec<Figure> {
    let comparable: Vec<&Group> = page.groups.iter().filter(|g| g.others.is_empty()).collect();
    let mut fills = distinct(comparable.iter().map(|group| group.fill));
    fills.retain(|fill| comparable.iter().filter(|group| group.fill == *fill).count() > 1);
    fills
        .into_iter()
        .map(|fill| {
            let mut groups: Vec<&&Group> = comparable.iter().filter(|g| g.fill == fill).collect();
            // recordings are drawn on top of the models
            groups.sort_by_key(|group| group.runs[0].is_recording());
            let mut traces = Vec::new();
            for (i, group) in groups.iter().enumerate() {
                let ends = distinct([group.drawn.first(), group.drawn.last()].into_iter().flatten().map(|r| r.case.name.as_str()));
                for (k, name) in ends.iter().enumerate() {
                    let run = group.drawn.iter().find(|run| run.case.name == **name);
                    let Some((run, (estimate, _))) = run.and_then(|run| Some((run, best(run)?))) else { continue };
                    let doubted = if estimate.doubt.is_some() { " (not trusted)" } else { "" };
                    let name = format!("{}, {}{doubted}", group.model, page.name(run));
                    let dash = ["dash", "solid"][k];
                    traces.push(line(0, &name, colors::category(i), dash, &thinned(&zip(&estimate.response.frequency, &estimate.response.decibels()), true)));
                }
            }
            let exact = groups[0].exact_response();
            let exact = thinned(&zip(&exact.frequency, &exact.decibels()), true);
            traces.push(line(0, "exact, linear and viscous", colors::INK, "dot", &exact));
            let what = fill.map_or("any fill".into(), |fill| format!("{} cm fill", cm(fill)));
            Figure {
                title: format!("Models overlaid, {what}"),
                caption: html! { "The smallest (dashed) and the largest (solid) of the runs of each model: what nonlinear slosh changes, and what dry friction does to all models alike. At first the range around antiresonance and resonance is shown; a double click shows the whole band." },
                thesis: "7.5 and 7.6",
                height: 340,
                half: true,
                panels: vec![panel(groups[0], "|H| / dB")],
                traces,
                ..Figure::default()
            }
        })
        .collect()
}

/// A quantity of a run that a heat map shows: its name, the function that reads it from the run, and the ends of the
/// colour scale if they are fixed.
struct Quantity {
    label: &'static str,
    of: fn(&Outcome) -> Curve,
    ends: Option<(f64, f64)>,
}

const CELLS: usize = 120;

pub(super) fn maps(group: &Group, axis: &Axis) -> Figure {
    let quantities = [
        Quantity { label: "magnitude |H| / dB", of: passing, ends: None },
        Quantity {
            label: "residual coherence γ²",
            of: |run| {
                let fit = run.record.as_ref().and_then(|record| record.fit.as_ref());
                fit.map_or(Curve::new(), |(_, coherence)| coherence.clone())
            },
            ends: Some((0.0, 1.0)),
        },
        Quantity {
            label: "signal-to-noise ratio / dB",
            of: |run| {
                run.record.as_ref().map_or(Curve::new(), |record| record.snr_over_band.clone())
            },
            ends: Some((-10.0, 60.0)),
        },
        Quantity {
            label: match group.runs[0].is_recording() {
                true => "leakage √(|H_x|²+|H_y|²)/|H|",
                false => "leakage r|F_r|/|τ|",
            },
            of: |run| {
                let passing = run.passing.as_ref();
                passing.map_or(Curve::new(), |p| zip(&p.rate.response.frequency, &p.leakage))
            },
            ends: None,
        },
    ];
    let (from, to) = group.band().unwrap_or(BAND);
    let grid = logarithmic_grid((from, to), CELLS);
    let (mut panels, mut traces) = (Vec::new(), Vec::new());
    for (p, quantity) in quantities.iter().enumerate() {
        let rows: Vec<Vec<serde_json::Value>> =
            group.drawn.iter().map(|run| cells(&(quantity.of)(run), (from, to))).collect();
        let y: Vec<String> =
            group.drawn.iter().filter_map(|run| axis.value(run)).map(|x| x.to_string()).collect();
        let mut trace = serde_json::json!({
            "type": "heatmap", "panel": p, "colorscale": "Viridis", "name": quantity.label,
            "x": numbers(grid.iter().copied()), "y": y, "z": rows, "hoverongaps": false,
            "hovertemplate": format!("%{{x:.4g}} Hz, %{{y}}: %{{z:.3g}}<extra>{}</extra>", quantity.label),
        });
        if let Some((low, high)) = quantity.ends {
            (trace["zmin"], trace["zmax"]) = (number(low), number(high));
        }
        traces.push(trace);
        panels.push(Panel {
            log_x: true,
            ..Panel::new(
                &format!("{}, f / Hz", quantity.label),
                if p == 0 { &axis.label } else { "" },
            )
        });
    }
    Figure {
        title: format!("Over frequency and {}, {}", axis.name, group.title()),
        caption: html! { "One row of cells for each run. Residual coherence: bright where the residual of the linear fit follows the torque linearly. Leakage: "
        @if group.runs[0].is_recording() { "the rates about the other axes divided by the rate about the hub's axis (thesis 6.3.6)." }
        @else { "the radial force times the tank's arm, divided by the torque; bright in rotary slosh." } },
        thesis: "7.11 to 7.14 and 7.16",
        columns: 4,
        height: 250,
        panels,
        traces,
        ..Figure::default()
    }
}

/// Averages a curve over frequency in cells of equal width in log frequency. An empty cell between other cells takes
/// the value of its left neighbour.
fn cells(curve: &Curve, (from, to): (f64, f64)) -> Vec<serde_json::Value> {
    let mut sums = vec![(0.0, 0usize); CELLS];
    for (f, value) in curve.iter().filter(|(_, v)| v.is_finite()) {
        let place = (f / from).ln() / (to / from).ln() * CELLS as f64;
        if (0.0..=CELLS as f64).contains(&place) {
            let sum = &mut sums[(place as usize).min(CELLS - 1)];
            *sum = (sum.0 + value, sum.1 + 1);
        }
    }
    let last = sums.iter().rposition(|sum| sum.1 > 0).unwrap_or(0);
    for i in 1..last {
        if sums[i].1 == 0 {
            sums[i] = sums[i - 1];
        }
    }
    let mean = |(sum, count): &(f64, usize)| {
        if *count == 0 { f64::NAN } else { 1e-3 * (1e3 * sum / *count as f64).round() }
    };
    sums.iter().map(|sum| number(mean(sum))).collect()
}

//! Figures whose horizontal axis is the parameter that the plan varies.

use analysis::features::{Deviations, Features};
use analysis::rotary;
use experiments::campaign::Outcome;
use maud::{Markup, html};

use super::colors;
use super::figure::{Figure, Label, Panel, dots, line};
use super::page::{Axis, Group, Page, best, distinct, exact_features, sentence_with_names};
use crate::svg::range;

/// A quantity of a run that is plotted: label, the function that reads it from a run, whether its axis is
/// logarithmic, and a level that is drawn for comparison.
struct Quantity<'a> {
    label: &'a str,
    value: &'a dyn Fn(&Outcome) -> Option<f64>,
    decades: bool,
    level: Option<(f64, &'a str)>,
}

fn quantity<'a>(label: &'a str, value: &'a dyn Fn(&Outcome) -> Option<f64>) -> Quantity<'a> {
    Quantity { label, value, decades: false, level: None }
}

/// Plots antiresonance and resonance of every group over the axis, and for comparison antiresonance and resonance of
/// the exact linear model. The colour shows the group, the line style the slosh model, and the marker whether a point
/// is an antiresonance or a resonance.
pub(super) fn extrema(page: &Page, axis: &Axis) -> Figure {
    let plants = distinct(page.groups.iter().map(Group::plant));
    let models = distinct(page.groups.iter().map(|group| group.model));
    // The last model has the solid line, because most plans list the model with the most physics last.
    let dash = |model: &str| {
        let place = models.iter().rev().position(|other| *other == model).unwrap_or(0);
        colors::line(place)
    };
    let mut traces = Vec::new();
    let mut untrusted = Vec::new();
    // Ends of the lines: (frequency, feature and plant, model, colour).
    let mut ends: Vec<(f64, String, &str, &str)> = Vec::new();
    for group in &page.groups {
        type Side = (
            &'static str,
            &'static str,
            fn(&Features) -> Option<f64>,
            fn(&Deviations) -> Option<f64>,
        );
        let sides: [Side; 2] = [
            ("antiresonance", "circle", |f| f.f_dip, |s| s.f_dip),
            ("resonance", "diamond", |f| f.f_res, |s| s.f_res),
        ];
        let plant = group.plant();
        let color = colors::category(plants.iter().position(|p| *p == plant).unwrap_or(0));
        for (what, symbol, get, std) in sides {
            let points: Vec<(f64, f64, Option<f64>)> = group
                .runs
                .iter()
                .filter_map(|run| {
                    let (estimate, _) = best(run)?;
                    let value = get(&estimate.features)?;
                    Some((axis.value(run)?, value, std(&estimate.deviations).map(|std| 2.0 * std)))
                })
                .collect();
            let name = format!("{what}, {}", group.title());
            let mut trace = dots(0, &name, color, symbol, &points);
            trace["line"]["dash"] = dash(group.model).0.into();
            traces.push(trace);
            if let Some((_, end, _)) = points.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
                let what = match plants.len() {
                    1 => what.to_string(),
                    _ => format!("{what}, {plant}"),
                };
                ends.push((*end, what, group.model, color));
            }
        }
        for run in &group.runs {
            let doubt = best(run).and_then(|(estimate, _)| estimate.doubt);
            untrusted.extend(doubt.map(|doubt| format!("{} ({doubt})", run.case.name)));
        }
    }
    // Groups with equal parameters have the same exact response, which is drawn only once.
    let mut drawn: Vec<Vec<(f64, f64)>> = Vec::new();
    for group in &page.groups {
        for get in [|f: &Features| f.f_dip, |f: &Features| f.f_res] {
            let points: Vec<(f64, f64)> = group
                .runs
                .iter()
                .filter_map(|run| Some((axis.value(run)?, get(&exact_features(run))?)))
                .collect();
            if !drawn.contains(&points) {
                traces.push(line(0, "exact, linear and viscous", colors::INK, "dot", &points));
                drawn.push(points);
            }
        }
    }
    let lines: Vec<String> =
        models.iter().map(|model| format!("{} {model}", dash(model).1)).collect();
    Figure {
        title: format!("Antiresonance and resonance over {}", axis.name),
        caption: html! {
            "Circles: antiresonance, where the liquid holds the hub still; diamonds: resonance, where hub and liquid swing against each other. "
            @if models.len() > 1 { "Lines: " (lines.join(", ")) ". " }
            "Thin and dotted: antiresonance and resonance of the exact linear plant with viscous friction. Bars: 95 % intervals, from the part of the rate that no linear response explains: gyro noise, dry friction, a nonlinear liquid (Methods). An upward sweep shows a narrow resonance late, so above the exact one (Methods)."
            (sentence_with_names("Invalid, and not drawn", &untrusted))
        },
        thesis: "7.1 and 7.2",
        height: 460,
        panels: vec![Panel::new(&axis.label, "frequency / Hz")],
        traces,
        labels: labels(ends),
        ..Figure::default()
    }
}

/// Returns labels for the ends of a figure's lines. Lines whose ends are close together share a label. If so many labels
/// are left that they could not be read, none is drawn.
fn labels(mut ends: Vec<(f64, String, &str, &str)>) -> Vec<Label> {
    const MOST: usize = 12;
    const TOGETHER: f64 = 0.03;
    ends.sort_by(|a, b| a.1.cmp(&b.1).then(a.0.total_cmp(&b.0)));
    let (lowest, highest) = range(ends.iter().map(|end| end.0));
    let span = highest - lowest;
    let mut labels: Vec<(f64, String, Vec<&str>, &str)> = Vec::new();
    for (y, what, model, color) in ends {
        match labels.last_mut() {
            Some(last) if last.1 == what && y - last.0 <= TOGETHER * span => last.2.push(model),
            _ => labels.push((y, what, vec![model], color)),
        }
    }
    if labels.len() > MOST {
        return Vec::new();
    }
    let label = |(y, what, models, color): (f64, String, Vec<&str>, &str)| Label {
        y,
        text: format!("{what}: {}", models.join(", ")),
        color: color.into(),
    };
    labels.into_iter().map(label).collect()
}

pub(super) fn residual_motion(page: &Page, axis: &Axis) -> Figure {
    let rate = |run: &Outcome| Some(1e3 * run.ending.rate?);
    let angle = |run: &Outcome| Some(run.ending.slosh_angle?.to_degrees());
    let title = format!("Residual motion after the manoeuvre, over {}", axis.name);
    let figure = small(
        page,
        axis,
        &title,
        html! { "The largest rate of the hub and the largest slosh angle after the torque has ended. After a torque that brings a rigid craft to rest, all residual motion comes from the liquid; an effect of bearing friction is the same for all models. In a slew by more than some tens of degrees linear and planar models turn the plane of the swing with the hub; spherical pendulums keep it in space." },
        [quantity("largest rate / (mrad/s)", &rate), quantity("largest slosh angle / deg", &angle)],
    );
    Figure { columns: 2, height: 340, ..figure }
}

pub(super) fn slosh_angles(page: &Page, axis: &Axis) -> Figure {
    let radial = |run: &Outcome| Some(run.totals.peak_radial_angle.to_degrees());
    let tangential = |run: &Outcome| Some(run.totals.peak_slosh_angle.to_degrees());
    let angle = |run: &Outcome| Some(run.ending.slosh_angle?.to_degrees());
    let rate = |run: &Outcome| run.ending.rate;
    let title = format!("Slosh angles over {}", axis.name);
    let figure = small(
        page,
        axis,
        &title,
        html! { "The largest tangential slosh angle (along the hub's rotation) and the largest radial one, which only rotary slosh causes. The values at the end are from the last fifth of the run, which in a dwell is the steady state." },
        [
            quantity("largest tangential / deg", &tangential),
            quantity("largest radial / deg", &radial),
            quantity("tangential at the end / deg", &angle),
            quantity("rate at the end / (rad/s)", &rate),
        ],
    );
    Figure { columns: 2, height: 300, ..figure }
}

pub(super) fn features(page: &Page, axis: &Axis) -> Figure {
    let figure = small(
        page,
        axis,
        "Separation and notch depth",
        html! { "While the sweep passes, and over the whole record (" code { "spa" } "). For a linear plant with linear friction these values would not depend on the amplitude of the torque. Dry friction matters most at small torques, a nonlinear liquid at large ones." },
        [
            quantity("Δf, swept / mHz", &|run| {
                Some(1e3 * run.passing.as_ref()?.rate.features.delta_f()?)
            }),
            quantity("Δf, spa / mHz", &|run| Some(1e3 * run.spa_features().delta_f()?)),
            quantity("notch, swept / dB", &|run| run.passing.as_ref()?.rate.features.notch_db),
            quantity("notch, spa / dB", &|run| run.spa_features().notch_db),
        ],
    );
    Figure { thesis: "7.1 and 7.2", ..figure }
}

pub(super) fn bearing_and_liquid(page: &Page, axis: &Axis) -> Figure {
    let quarter = page.groups.first().map_or(0.0, |g| g.runs[0].range.radius / 4.0 * 1e3);
    small(
        page,
        axis,
        "Stiction, slosh amplitude, energy balance",
        html! { "Beyond the dashed line, a quarter of the tank's radius, linear slosh theory no longer holds. Runs of a linear model there are numerically correct but do not represent a real tank. The energy residual checks the FMU's balance at every sample." },
        [
            Quantity {
                decades: true,
                ..quantity("time in stiction / s", &|run| Some(run.totals.stuck))
            },
            quantity("largest slosh angle / deg", &|run| {
                Some(run.totals.peak_slosh_angle.to_degrees())
            }),
            Quantity {
                level: Some((quarter, "a quarter of the radius")),
                ..quantity("largest wave / mm", &|run| Some(run.totals.peak_wave_height * 1e3))
            },
            Quantity {
                decades: true,
                ..quantity("energy residual / throughput", &|run| {
                    Some(run.totals.max_energy_residual)
                })
            },
        ],
    )
}

pub(super) fn linear_fit(page: &Page, axis: &Axis) -> Figure {
    let figure = small(
        page,
        axis,
        "Validity of a linear fit",
        html! { "A transfer function with three poles and two zeros, fitted to each run's " code { "spa" } " response and driven with the run's own torque, as in the thesis. It cannot represent dry friction at small torque, nor a resonance that moves with the amplitude." },
        [
            quantity("fit in frequency / %", &|run| Some(run.fit()?.fit_frequency)),
            quantity("fit in time / %", &|run| Some(run.fit()?.fit_time)),
            quantity("residual coherence", &|run| run.fit()?.coherence),
            quantity("SNR at antiresonance / dB", &|run| Some(run.record.as_ref()?.snr_db?[1])),
        ],
    );
    Figure { thesis: "7.3, 7.4 and 7.7 to 7.10", ..figure }
}

/// Plots cross-axis energy fraction and leakage of recordings, which follow from the rates about three axes.
pub(super) fn cross_axis(page: &Page, axis: &Axis) -> Figure {
    let share = |run: &Outcome| run.off_axis().filter(|_| run.is_recording());
    let figure = small(
        page,
        axis,
        "Cross-axis energy fraction and leakage of the recordings",
        html! { "Fraction of the squared rates that is about other axes than the hub's, each rate without its mean: the median over the samples and the fraction of the whole record. A value near 2/3 means that all three rates are noise of equal size. Leakage: root mean square over the frequencies of √(|H_x|²+|H_y|²)/|H|." },
        [
            quantity("CEF, median", &|run| Some(share(run)?.median)),
            quantity("CEF, whole record", &|run| Some(share(run)?.energy)),
            quantity("leakage, rms", &|run| Some(share(run)?.leakage)),
        ],
    );
    Figure { columns: 3, thesis: "7.15", ..figure }
}

pub(super) fn out_of_the_plane(page: &Page, axis: &Axis) -> Figure {
    // The cross-axis figures of recordings come from the rates, and `cross_axis` plots them.
    let share = |run: &Outcome| run.off_axis().filter(|_| !run.is_recording());
    small(
        page,
        axis,
        "Out of the plane",
        html! { "Swirl number: 0 for motion in a plane, 1 for a circle; above the dashed line the slosh is rotary. Off-axis energy and leakage: the liquid's radial force, which only loads the bearing, relative to the tangential one and to the torque." },
        [
            Quantity {
                level: Some((rotary::ROTARY, "counts as rotary")),
                ..quantity("largest |swirl|", &|run| Some(run.rotary?.swirl.abs()))
            },
            quantity("time in rotary slosh / s", &|run| Some(run.rotary?.time)),
            quantity("off-axis energy", &|run| Some(share(run)?.energy)),
            quantity("leakage", &|run| Some(share(run)?.leakage)),
        ],
    )
}

fn small<'a>(
    page: &Page,
    axis: &Axis,
    title: &str,
    caption: Markup,
    quantities: impl IntoIterator<Item = Quantity<'a>>,
) -> Figure {
    let (mut panels, mut traces) = (Vec::new(), Vec::new());
    for (p, quantity) in quantities.into_iter().enumerate() {
        panels.push(Panel { log_y: quantity.decades, ..Panel::new(&axis.label, quantity.label) });
        let mut all = Vec::new();
        for (i, group) in page.groups.iter().enumerate() {
            let points: Vec<(f64, f64, Option<f64>)> = group
                .runs
                .iter()
                .filter_map(|run| Some((axis.value(run)?, (quantity.value)(run)?, None)))
                .filter(|(_, y, _)| y.is_finite() && (!quantity.decades || *y > 0.0))
                .collect();
            all.extend(points.iter().map(|(x, ..)| *x));
            traces.push(dots(p, &group.title(), colors::category(i), colors::symbol(i), &points));
        }
        if let (Some((level, name)), false) = (quantity.level, all.is_empty()) {
            let (low, high) = range(all);
            traces.push(line(p, name, colors::INK, "dash", &[(low, level), (high, level)]));
        }
    }
    Figure {
        title: title.into(),
        caption,
        columns: 4,
        height: 270,
        panels,
        traces,
        ..Figure::default()
    }
}

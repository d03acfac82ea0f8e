//! Plots over time, and of the path of the wave crest.

use analysis::rotary;
use experiments::campaign::{History, Outcome, SloshPath};
use maud::html;

use super::colors;
use super::figure::{Figure, Panel, line};
use super::page::{Group, Page, manoeuvre};
use names::hubslosh::{OMEGA_IMU, SLOSH_ANGLE, SLOSH_ANGLE_RADIAL, TAU_CMD};

/// Selects the runs of a group that are plotted over time: all if they are few, otherwise the first, the
/// middle and the last.
fn plotted_runs<'a>(runs: &[&'a Outcome]) -> Vec<&'a Outcome> {
    match runs.len() {
        0..=4 => runs.to_vec(),
        n => vec![runs[0], runs[n / 2], runs[n - 1]],
    }
}

pub(super) fn history(page: &Page, group: &Group) -> Figure {
    let runs = plotted_runs(&group.drawn);
    let mut traces = Vec::new();
    let panels = [
        "torque / N·m",
        "rate / (rad/s)",
        "tangential / deg",
        "radial / deg",
        "residual / (rad/s)",
    ];
    let signals = [TAU_CMD, OMEGA_IMU, SLOSH_ANGLE, SLOSH_ANGLE_RADIAL, "residual"];
    // the radial angle is not plotted if the liquid stays in its plane
    let planar = runs.iter().all(|run| run.totals.peak_radial_angle == 0.0);
    // The largest curve is drawn first, so that it does not cover the others.
    for (i, run) in runs.iter().enumerate().rev() {
        let color = colors::ordered(i, runs.len());
        for (p, signal) in signals.iter().enumerate() {
            let mut curve = run.history.curve(signal);
            if p == 3 && planar {
                continue;
            }
            if p == 2 || p == 3 {
                curve.iter_mut().for_each(|(_, angle)| *angle = angle.to_degrees());
            }
            traces.push(line(p, &page.name(run), &color, "solid", &curve));
        }
    }
    Figure {
        title: format!("Time histories, {}", group.title()),
        caption: html! {
            "Torque, measured rate, tangential and radial slosh angle, and the residual. The residual is the rate minus the rate of the exact linear plant without dry friction under the same torque. It shows dry friction and nonlinear slosh."
            @if runs.len() < group.runs.len() {
                " " (runs.len()) " of " (super::page::runs(group.runs.len())) "."
            }
            @if runs.iter().any(|run| run.case.run().steps() > 2 * History::STRETCHES) {
                " Fast oscillations are drawn by their envelope."
            }
        },
        height: 135,
        half: page.groups.len() > 1,
        shared: true,
        panels: panels.map(|y| Panel::new("time / s", y)).to_vec(),
        traces,
        ..Figure::default()
    }
}

/// Plots rate and slosh angle after a manoeuvre for one run of each group, the middle one of the runs that are
/// plotted over time. The colour shows the group.
pub(super) fn motion_after_manoeuvre(page: &Page) -> Figure {
    let mut traces = Vec::new();
    let mut from = f64::INFINITY;
    for (i, group) in page.groups.iter().enumerate() {
        let Some(run) = group.drawn.get(group.drawn.len() / 2) else { continue };
        from = from.min(manoeuvre(run).unwrap_or(f64::INFINITY));
        let name = format!("{}, {}", group.title(), page.name(run));
        for (p, (signal, scale)) in
            [(OMEGA_IMU, 1e3), (SLOSH_ANGLE, 1f64.to_degrees())].iter().enumerate()
        {
            let late = run.history.curve(signal).into_iter().filter(|(t, _)| *t >= from);
            let curve: Vec<(f64, f64)> = late.map(|(t, value)| (t, scale * value)).collect();
            traces.push(line(p, &name, colors::category(i), "solid", &curve));
        }
    }
    Figure {
        title: "Rate and slosh angle after the manoeuvre".into(),
        caption: html! { "From the end of the torque on. With a rigid liquid the hub is then at rest; a sloshing liquid continues to drive it at the slosh frequency." },
        columns: 2,
        height: 300,
        panels: vec![
            Panel::new("time / s", "rate / (mrad/s)"),
            Panel::new("time / s", "tangential slosh angle / deg"),
        ],
        traces,
        ..Figure::default()
    }
}

pub(super) fn compared(page: &Page) -> Figure {
    let runs =
        || page.groups.iter().flat_map(|group| group.drawn.iter().map(move |run| (group, run)));
    let signals = [
        (OMEGA_IMU, "rate / (rad/s)", 1.0),
        (SLOSH_ANGLE, "tangential / deg", 1f64.to_degrees()),
        (SLOSH_ANGLE_RADIAL, "radial / deg", 1f64.to_degrees()),
    ];
    let mut traces = Vec::new();
    for (i, (group, run)) in runs().enumerate() {
        let name = match group.runs.len() {
            1 => group.title(),
            _ => format!("{}, {}", group.title(), page.name(run)),
        };
        for (p, (signal, _, scale)) in signals.iter().enumerate() {
            let curve = run.history.curve(signal).into_iter();
            let curve: Vec<(f64, f64)> = curve.map(|(t, value)| (t, scale * value)).collect();
            let (color, dash) = (colors::category(i), ["solid", "dash", "dot"][i % 3]);
            traces.push(line(p, &name, color, dash, &curve));
        }
    }
    // smallest and largest rate in each time interval of a run
    let envelope = |run: &Outcome| -> Vec<[f64; 2]> {
        let rate = run.history.curve(OMEGA_IMU);
        rate.chunks_exact(2).map(|p| [p[0].1.min(p[1].1), p[0].1.max(p[1].1)]).collect()
    };
    let rates: Vec<_> = runs().map(|(_, run)| envelope(run)).collect();
    let apart = match rates.iter().all(|rate| rate.len() == rates[0].len()) {
        true => {
            let pairs =
                rates.iter().flat_map(|rate| rate.iter().flatten().zip(rates[0].iter().flatten()));
            let most = pairs.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            format!(" The envelopes of the rates differ by at most {most:.1e} rad/s.")
        }
        false => String::new(),
    };
    Figure {
        title: "The runs compared".into(),
        caption: html! { "Measured rate, tangential and radial slosh angle." (apart) },
        height: 190,
        shared: true,
        panels: signals.iter().map(|(_, label, _)| Panel::new("time / s", label)).collect(),
        traces,
        ..Figure::default()
    }
}

pub(super) fn paths(page: &Page, group: &Group) -> Vec<Figure> {
    let radial = |run: &Outcome| run.totals.peak_radial_angle;
    let Some(last) = group.drawn.iter().copied().max_by(|a, b| radial(a).total_cmp(&radial(b)))
    else {
        return Vec::new();
    };
    // a wave that stays in its plane has no path to show, and a recording does not contain the wave
    if radial(last).is_nan() || radial(last) < rotary::LEAST {
        return Vec::new();
    }
    let onset = group.drawn.iter().find_map(|run| Some((*run, run.path.onset.as_ref()?)));
    let planar = group.drawn.iter().copied().take_while(|run| run.path.onset.is_none()).last();
    let mut parts: Vec<(String, &[[f64; 3]])> = Vec::new();
    if let (Some(planar), Some(_)) = (planar, onset) {
        parts.push((format!("planar, {}", page.name(planar)), &planar.path.largest));
    }
    if let Some((run, path)) = onset {
        parts.push((format!("onset of rotary slosh, {}", page.name(run)), path));
    }
    parts.push((format!("largest wave, {}", page.name(last)), &last.path.largest));
    let deg = f64::to_degrees;
    let mut traces = Vec::new();
    for (i, (name, path)) in parts.iter().enumerate() {
        let points: Vec<(f64, f64)> = path.iter().map(|[_, r, t]| (deg(*t), deg(*r))).collect();
        traces.push(line(0, name, colors::category(i), "solid", &points));
    }
    let seen = Figure {
        title: format!("The wave seen from above, {}", group.title()),
        caption: html! {
            "Radial against tangential slosh angle, with the same scale on both axes; a line is planar slosh, a circle rotary slosh. "
            (SloshPath::LARGEST) " periods around the largest wave, " (SloshPath::ONSET)
            " around the moment at which the swirl number passes " (rotary::ROTARY)
            ". A click on an entry of the legend hides or shows its path."
        },
        height: 470,
        half: true,
        panels: vec![Panel {
            equal: true,
            ..Panel::new("tangential angle / deg, towards +θ", "radial angle / deg, outwards")
        }],
        traces,
        ..Figure::default()
    };
    let (name, path) = &parts[parts.len().saturating_sub(if onset.is_some() { 2 } else { 1 })];
    let over = |k: usize| path.iter().map(|row| (row[0], deg(row[k]))).collect::<Vec<_>>();
    let time = Figure {
        title: format!("The same over time, {}", group.title()),
        caption: html! {
            "Run: " (name) ". The radial motion grows from the planar tangential motion; in rotary slosh the two are a quarter of a period apart."
        },
        height: 470,
        half: true,
        panels: vec![Panel::new("time / s", "slosh angle / deg")],
        traces: vec![
            line(0, "tangential", colors::category(0), "solid", &over(2)),
            line(0, "radial", colors::category(1), "solid", &over(1)),
        ],
        ..Figure::default()
    };
    vec![seen, time]
}

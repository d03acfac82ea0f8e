//! Figures about the runs of an FMU other than the bench: its outputs over time.

use std::collections::BTreeMap;

use experiments::campaign::{History, is_slosh_angle};
use host::fmu::Fmu;
use maud::html;

use super::colors;
use super::figure::{Figure, Panel, line};
use super::page::unit;

/// Plots one run: attitude and rates, the path of each slosh mass, and all other signals. `tail` contains the last part of
/// the run in more detail.
pub(super) fn run(fmu: &Fmu, name: &str, history: &History, tail: &History) -> Vec<Figure> {
    let unit = |signal: &str| unit(fmu, signal).map_or(String::new(), |unit| format!(" / {unit}"));
    // elements of one vector, such as omega[1], omega[2], omega[3], share a panel
    let mut vectors: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for (signal, values) in &history.signals {
        let moves = values.iter().any(|v| *v != values[0]);
        let stem = signal.rsplit_once('[').map_or(signal.as_str(), |(stem, _)| stem);
        if moves {
            vectors.entry(stem.into()).or_default().push(signal);
        }
    }
    let lead = |stem: &String| {
        let order = ["force", "torque", "q", "omega", "a"];
        (order.iter().position(|o| o == stem).unwrap_or(order.len()), stem.clone())
    };
    let mut stems: Vec<&String> = vectors.keys().collect();
    stems.sort_by_key(|stem| lead(stem));
    let mut out = Vec::new();
    for (part, chunk) in stems.chunks(6).enumerate() {
        let (mut panels, mut traces) = (Vec::new(), Vec::new());
        for (p, stem) in chunk.iter().enumerate() {
            let signals = &vectors[*stem];
            panels.push(Panel::new("time / s", &format!("{stem}{}", unit(signals[0]))));
            for signal in signals.iter().take(8) {
                // the colour depends on the number of curves in all panels, because all panels share one legend
                let i = traces.len();
                let curve = history.curve(signal);
                traces.push(line(p, signal, colors::category(i), colors::dash(i), &curve));
            }
        }
        out.push(Figure {
            title: format!(
                "Time histories{}, {name}",
                if part > 0 { format!(" ({})", part + 1) } else { String::new() }
            ),
            caption: html! { "Signals that change; of a long run the envelope." },
            columns: 2,
            height: 230,
            panels,
            traces,
            ..Figure::default()
        });
    }
    let bobs: Vec<(&str, String)> = tail
        .signals
        .iter()
        .filter(|(signal, _)| is_slosh_angle(signal) && signal.contains("angle_x"))
        .map(|(signal, _)| (signal.as_str(), signal.replace("angle_x", "angle_y")))
        .collect();
    let mut traces = Vec::new();
    for (i, (x, y)) in bobs.into_iter().enumerate() {
        let (x_curve, y_curve) = (tail.curve(x), tail.curve(&y));
        let points: Vec<(f64, f64)> = x_curve
            .iter()
            .zip(&y_curve)
            .map(|((_, x), (_, y))| (x.to_degrees(), y.to_degrees()))
            .collect();
        if points.iter().any(|p| p.0 != 0.0 || p.1 != 0.0) {
            let bob = x.replace(".angle_x", ", mode ");
            traces.push(line(0, &bob, colors::category(i), colors::dash(i), &points));
        }
    }
    out.push(Figure {
        title: format!("Path of the slosh masses, {name}"),
        caption: html! {
            "Slosh angles along the tank's axes, with the same scale on both axes, in the last "
            (tail.time.len()) " rows."
        },
        height: 470,
        half: true,
        panels: vec![Panel { equal: true, ..Panel::new("angle_x / deg", "angle_y / deg") }],
        traces,
        ..Figure::default()
    });
    out
}

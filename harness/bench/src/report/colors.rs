//! Colours, the same in every figure.

use std::fmt::Write as _;

use super::{Group, distinct, fills, thousandths};
use crate::svg::Style;

/// The colour map "viridis", which is ordered in lightness and safe for colour-blind readers.
const VIRIDIS: [[f64; 3]; 10] = [
    [68.0, 1.0, 84.0],
    [72.0, 40.0, 120.0],
    [62.0, 73.0, 137.0],
    [49.0, 104.0, 142.0],
    [38.0, 130.0, 142.0],
    [31.0, 158.0, 137.0],
    [53.0, 183.0, 121.0],
    [110.0, 206.0, 88.0],
    [181.0, 222.0, 43.0],
    [253.0, 231.0, 37.0],
];

/// CSS variables --a0, --a1, … from small to large amplitude: on paper without the bright end,
/// which would be lost there, in the dark without the dark end.
pub(super) fn amplitude_colors(count: usize) -> String {
    let scheme = |from: f64, to: f64| {
        let mut rules = String::new();
        for i in 0..count {
            let part = if count > 1 { i as f64 / (count - 1) as f64 } else { 0.5 };
            let _ = write!(rules, "--a{i}: {}; ", heat(from + (to - from) * part));
        }
        rules
    };
    format!(
        ":root {{ {}}}\n@media (prefers-color-scheme: dark) {{ :root {{ {}}} }}\n",
        scheme(0.0, 0.86),
        scheme(0.25, 1.0)
    )
}

pub(super) fn amplitude_color(amplitudes: &[f64], amplitude: f64) -> String {
    let mut sorted = amplitudes.to_vec();
    sorted.sort_by(f64::total_cmp);
    format!("var(--a{})", sorted.iter().position(|a| *a == amplitude).unwrap_or(0))
}

pub(super) fn amplitude_legend(amplitudes: &[f64]) -> String {
    let mut sorted = amplitudes.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut out = String::from("<div class=\"legend\"><span>Torque amplitude in mN·m:</span>");
    for (i, amplitude) in sorted.iter().enumerate() {
        let _ = write!(
            out,
            "<span><i style=\"color:var(--a{i})\"></i>{}</span>",
            thousandths(*amplitude)
        );
    }
    out.push_str("<span><i class=\"dash\" style=\"color:var(--exact)\"></i>exact transfer function of the linear model with viscous friction</span></div>\n");
    out
}

/// CSS colour of a place on the map, 0 to 1; the same in the light and in the dark.
pub(super) fn heat(place: f64) -> String {
    let place = place.clamp(0.0, 1.0) * 9.0;
    let (low, mix) = ((place as usize).min(8), place - (place as usize).min(8) as f64);
    let [r, g, b] = [0, 1, 2].map(|c| VIRIDIS[low][c] * (1.0 - mix) + VIRIDIS[low + 1][c] * mix);
    format!("rgb({r:.0} {g:.0} {b:.0})")
}

/// The models' colours, the same in every report.
pub(super) fn model_color(model: &str) -> String {
    let models = ["linear", "planar", "spherical", "paraboloid", "frozen"];
    format!("var(--f{})", models.iter().position(|m| *m == model).unwrap_or(0))
}

/// A legend of models and the exact response.
pub(super) fn model_legend<'a>(models: impl Iterator<Item = &'a str>) -> String {
    let mut out = String::from("<div class=\"legend\">");
    for model in models {
        let color = model_color(model);
        let _ = write!(out, "<span><i style=\"color:{color}\"></i>{model}</span>");
    }
    out.push_str("<span><i class=\"dash\" style=\"color:var(--exact)\"></i>exact, linear with viscous friction</span></div>\n");
    out
}

/// Colour and style of each group in a figure that has all of them: by model, and filled or open
/// by fill, where nothing else tells them apart; else each its own.
pub(super) fn group_marks(groups: &[Group]) -> Vec<(String, Style)> {
    let models: Vec<&str> = distinct(groups.iter().map(|g| g.model));
    let fills = fills(groups);
    if models.len() > 1 && fills.len() < 3 && groups.iter().all(|g| g.others.is_empty()) {
        return groups
            .iter()
            .map(|group| {
                let lower = fills.len() == 2 && group.fill == Some(fills[0]);
                let style = if lower { Style::OpenDots } else { Style::Dots };
                (model_color(group.model), style)
            })
            .collect();
    }
    (0..groups.len()).map(|i| (format!("var(--f{})", i % 5), Style::Dots)).collect()
}

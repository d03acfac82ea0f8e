//! The wave's path seen from above.

use super::*;
use crate::campaign::SloshPath;

/// For each group whose liquid can leave its plane: the last run with planar slosh, the
/// onset of rotary slosh in the first in which it occurs, and the largest wave of the last.
pub(super) fn paths<'a>(groups: &[Group<'a>]) -> String {
    let mut out = String::new();
    for group in groups {
        let path = |run: &'a Outcome| run.passing.as_ref().map(|passing| &passing.path);
        let onset = |run: &'a Outcome| path(run)?.onset.as_ref();
        let Some((first, rotary, begins)) =
            group.runs.iter().enumerate().find_map(|(i, run)| Some((i, *run, onset(run)?)))
        else {
            continue;
        };
        let last = group.runs[group.runs.len() - 1];
        let mut charts = Vec::new();
        let title =
            |what: &str, run: &Outcome| format!("{what}, {} mN·m", thousandths(torque_of(run)));
        if let Some(planar) = first.checked_sub(1).map(|i| group.runs[i]) {
            charts.extend(path(planar).map(|p| (title("Planar slosh", planar), &p.largest)));
        }
        charts.push((title("Onset of rotary slosh", rotary), begins));
        charts.extend(path(last).map(|p| (title("Largest wave", last), &p.largest)));
        let _ = writeln!(out, "{}<div class=\"three\">", group.heading());
        for (title, path) in charts {
            out.push_str(&chart(title, path, colors::model_color(group.model)).svg());
        }
        out.push_str("</div>\n");
    }
    if out.is_empty() {
        return out;
    }
    format!(
        "<h2>The wave seen from above</h2>\n<p>Slosh angle outwards against slosh angle along the hub's turn, the same scale both ways. The radial motion grows from the centripetal force alone; nothing else pushes the liquid out of its plane. Shown are {} s around the largest wave and {} s around the moment at which the swirl passes {}.</p>\n{out}",
        SloshPath::LARGEST,
        SloshPath::ONSET,
        rotary::ROTARY,
    )
}

fn chart(title: String, path: &[(f64, f64)], color: String) -> Chart {
    let points: Vec<(f64, f64)> =
        path.iter().map(|(x, y)| (y.to_degrees(), x.to_degrees())).collect();
    let largest = points.iter().fold(1.0, |m: f64, (x, y)| m.max(x.abs()).max(y.abs()));
    let axis = |label: &str| Axis::linear(label, [-largest, largest], 1.0, 6);
    Chart {
        title,
        size: (420.0, 418.0), // a square between the margins
        x: axis("tangential angle / deg, towards +θ"),
        y: axis("radial angle / deg, outwards"),
        series: vec![Series {
            points,
            color,
            style: Style::Line,
            title: "path of the wave's crest".into(),
        }],
        legend: false,
    }
}

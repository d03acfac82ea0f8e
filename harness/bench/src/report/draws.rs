//! Monte Carlo: the distribution of antiresonance and resonance, over every drawn parameter.

use super::*;

/// Antiresonance and resonance in all draws of a group.
struct Figure {
    title: &'static str,
    label: &'static str,
    unit: &'static str,
    of: fn(&Outcome) -> Option<f64>,
}

const FIGURES: [Figure; 4] = [
    Figure {
        title: "Antiresonance",
        label: "f_dip / Hz",
        unit: "Hz",
        of: |run| run.features().f_dip,
    },
    Figure { title: "Resonance", label: "f_res / Hz", unit: "Hz", of: |run| run.features().f_res },
    Figure {
        title: "Separation",
        label: "Δf / mHz",
        unit: "mHz",
        of: |run| run.features().delta_f().map(|f| f * 1e3),
    },
    Figure {
        title: "Notch depth",
        label: "notch / dB",
        unit: "dB",
        of: |run| run.features().notch_db,
    },
];

/// Histograms of the features, and antiresonance and resonance over every drawn parameter.
pub(super) fn draws(plan: &Plan, fmu: &Fmu, groups: &[Group]) -> String {
    let grouping = plan.grouping();
    let drawn: Vec<(usize, &str)> = plan
        .varied()
        .into_iter()
        .enumerate()
        .filter(|(_, name)| !grouping.contains(name) && !name.ends_with("seed"))
        .collect();
    let mut out = String::from(
        "<h2>Distribution of antiresonance and resonance</h2>\n<p>Histograms over all draws, and every draw's antiresonance (blue) and resonance (orange) as its deviation from the mean, over each parameter that was drawn. ρ is the coefficient of correlation: what stands near ±1 decides, what stands near 0 does not matter.</p>\n",
    );
    for group in groups {
        out.push_str(&group.heading());
        out.push_str("<div class=\"four\">\n");
        for figure in &FIGURES {
            let values: Vec<f64> = group.runs.iter().filter_map(|run| (figure.of)(run)).collect();
            if !values.is_empty() {
                out.push_str(&histogram(figure, &values).svg());
            }
        }
        for (place, name) in &drawn {
            let unit =
                fmu.description().variable(name).ok().and_then(|v| v.attributes().unit.clone());
            let label = unit.map_or(name.to_string(), |unit| format!("{name} / {unit}"));
            out.push_str(&scatter(group, *place, name, &label).svg());
        }
        out.push_str("</div>\n");
    }
    out
}

/// Mean and standard deviation.
fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
    (mean, variance.sqrt())
}

/// Coefficient of correlation, −1 to 1; 0 where one of the two does not vary.
fn correlation(points: &[(f64, f64)]) -> f64 {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    let ((mx, sx), (my, sy)) = (moments(&x), moments(&y));
    let mean = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / points.len() as f64;
    if sx * sy > 0.0 { mean / (sx * sy) } else { 0.0 }
}

fn histogram(figure: &Figure, values: &[f64]) -> Chart {
    let x = Axis::linear(figure.label, values.iter().copied(), 1e-6, 4);
    let bins = 24;
    let width = (x.to - x.from) / bins as f64;
    let mut counts = vec![0.0; bins];
    for value in values {
        counts[(((value - x.from) / width) as usize).min(bins - 1)] += 1.0;
    }
    let mut points = vec![(x.from, 0.0)];
    for (i, &count) in counts.iter().enumerate() {
        let left = x.from + i as f64 * width;
        points.extend([(left, count), (left + width, count)]);
    }
    points.push((x.to, 0.0));
    let (mean, deviation) = moments(values);
    let digits = if mean > 20.0 { 1 } else { 4 };
    Chart {
        title: format!("{}: {mean:.digits$} ± {deviation:.digits$} {}", figure.title, figure.unit),
        size: (330.0, 260.0),
        x,
        y: Axis::linear("draws", counts.iter().copied().chain([0.0]), 1.0, 5),
        series: vec![Series {
            points,
            color: "var(--e0)".into(),
            style: Style::Line,
            title: format!("{} draws", values.len()),
        }],
        legend: false,
    }
}

fn scatter(group: &Group, place: usize, name: &str, label: &str) -> Chart {
    let figures = [(&FIGURES[0], "var(--e0)"), (&FIGURES[1], "var(--e1)")];
    let mut correlations = Vec::new();
    let mut series = Vec::new();
    for (figure, color) in figures {
        let mut points: Vec<(f64, f64)> = group
            .runs
            .iter()
            .filter_map(|run| Some((run.case.varied[place].parse().ok()?, (figure.of)(run)?)))
            .collect();
        let values: Vec<f64> = points.iter().map(|(_, y)| *y).collect();
        let (mean, _) = moments(&values);
        points.iter_mut().for_each(|(_, y)| *y = (*y - mean) * 1e3);
        correlations.push(correlation(&points));
        series.push(Series {
            points,
            color: color.into(),
            style: Style::Cloud,
            title: figure.title.into(),
        });
    }
    let all = |pick: fn(&(f64, f64)) -> f64| {
        series.iter().flat_map(|s| &s.points).map(pick).collect::<Vec<f64>>()
    };
    Chart {
        title: format!("{name}: ρ = {:.2}, {:.2}", correlations[0], correlations[1]),
        size: (330.0, 260.0),
        x: Axis::linear(label, all(|p| p.0), 1e-9, 4),
        y: Axis::linear("from the mean / mHz", all(|p| p.1), 1.0, 5),
        series,
        legend: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_together_correlates_by_one_and_what_is_constant_not_at_all() {
        let line: Vec<(f64, f64)> = (0..10).map(|i| (f64::from(i), 3.0 - f64::from(i))).collect();
        assert!((correlation(&line) + 1.0).abs() < 1e-12);
        assert_eq!(correlation(&[(1.0, 2.0), (2.0, 2.0)]), 0.0);
    }

    #[test]
    fn a_histogram_counts_every_value_once() {
        let values = [1.0, 1.1, 1.5, 2.0];
        let chart = histogram(&FIGURES[0], &values);
        // each bin is drawn by two points
        let sum: f64 = chart.series[0].points.iter().map(|(_, y)| y / 2.0).sum();
        assert_eq!(sum, 4.0);
    }
}

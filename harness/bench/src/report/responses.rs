//! Frequency responses: every torque of a group, and models overlaid.

use super::*;

/// For each fill, the responses of all models at the smallest and at the largest torque (thesis
/// figures 7.5 and 7.6); nothing where there is one model only.
pub(super) fn models_over_each_other<'a>(groups: &[&Group<'a>]) -> String {
    let comparable: Vec<&Group<'a>> =
        groups.iter().copied().filter(|group| group.others.is_empty()).collect();
    let mut fills = distinct(comparable.iter().map(|group| group.fill));
    fills.retain(|fill| comparable.iter().filter(|group| group.fill == *fill).count() > 1);
    let mut out = String::new();
    for fill in fills {
        let models: Vec<&Group<'a>> =
            comparable.iter().copied().filter(|group| group.fill == fill).collect();
        let title = fill.map_or("Any fill".into(), |fill| format!("{} cm fill", cm(fill)));
        let _ = writeln!(out, "<h3>{title}: models overlaid</h3>");
        out.push_str(&colors::model_legend(models.iter().map(|group| group.model)));
        out.push_str("<div class=\"two\">\n");
        for largest in [false, true] {
            let end = |group: &Group<'a>| {
                let runs = &group.runs;
                if largest { runs.last().copied() } else { runs.first().copied() }
            };
            let mut series: Vec<Series> = models
                .iter()
                .filter_map(|group| {
                    let run = end(group)?;
                    Some(Series {
                        points: passing(run),
                        color: colors::model_color(group.model),
                        style: Style::Line,
                        title: group.model.into(),
                    })
                })
                .collect();
            let exact_response = &models[0].exact_response;
            series.push(exact(zip(&exact_response.frequency, &exact_response.decibels())));
            let (from, to) = models[0].sweep.map(Sweep::band).unwrap_or(BAND);
            let levels = series.iter().flat_map(|s| &s.points).map(|(_, y)| *y);
            let y = Axis::linear("|H| / dB re 1 (rad/s)/(N·m)", levels, 10.0, 6);
            let torque = end(models[0]).map_or(0.0, |run| thousandths(torque_of(run)));
            let chart = Chart {
                title: format!("{title}, {torque} mN·m"),
                size: (560.0, 330.0),
                x: Axis::logarithmic("frequency / Hz", (from, to), &frequency_ticks(from, to)),
                y,
                series,
                legend: false,
            };
            out.push_str(&chart.svg());
        }
        out.push_str("</div>\n");
    }
    out
}

pub(super) fn responses(group: &Group, amplitudes: &[f64]) -> String {
    let level = |r: &FrequencyResponse| zip(&r.frequency, &r.decibels());
    let phase = |r: &FrequencyResponse| zip(&r.frequency, &r.degrees());
    let curves = |of: &dyn Fn(&FrequencyResponse) -> Vec<(f64, f64)>| {
        let mut series: Vec<Series> = group
            .runs
            .iter()
            .map(|run| Series {
                points: run.passing.as_ref().map_or(Curve::new(), |p| of(&p.rate.response)),
                color: colors::amplitude_color(amplitudes, torque_of(run)),
                style: Style::Line,
                title: format!("{} mN·m", thousandths(torque_of(run))),
            })
            .collect();
        series.push(exact(of(&group.exact_response)));
        series
    };
    let levels = || curves(&level).into_iter().flat_map(|s| s.points).map(|(_, y)| y);
    let size = (560.0, 330.0);
    let (from, to) = group.sweep.map(Sweep::band).unwrap_or(BAND);
    let band = Axis::logarithmic("frequency / Hz", (from, to), &frequency_ticks(from, to));
    let antiresonance = group.exact.f_dip.unwrap_or(from);
    let resonance = group.exact.f_res.unwrap_or(to);
    let around = Axis::linear("frequency / Hz", [antiresonance - 0.08, resonance + 0.12], 0.3, 6);
    let decibels = Axis::linear("|H| / dB re 1 (rad/s)/(N·m)", levels(), 10.0, 6);

    let charts = [
        Chart {
            title: format!("Magnitude, {}", group.title()),
            size,
            x: band.clone(),
            y: decibels.clone(),
            series: curves(&level),
            legend: false,
        },
        Chart {
            title: "Magnitude around antiresonance and resonance".into(),
            size,
            x: around.clone(),
            y: decibels.clone(),
            series: curves(&level),
            legend: false,
        },
        Chart {
            title: format!("Phase, {}", group.title()),
            size,
            x: band,
            y: degrees_axis(&curves(&phase)),
            series: curves(&phase),
            legend: false,
        },
        estimator_chart(group, size),
    ];
    let mut out = format!("{}<div class=\"two\">\n", group.heading());
    for chart in charts {
        out.push_str(&chart.svg());
    }
    out.push_str("</div>\n");
    out
}

/// Phases in steps of 45 degrees.
fn degrees_axis(series: &[Series]) -> Axis {
    let places = |pick: fn(f64) -> f64, fold: fn(f64, f64) -> f64| {
        let phases = series.iter().flat_map(|s| &s.points).map(|(_, y)| pick(*y / 45.0));
        phases.reduce(fold).unwrap_or(0.0)
    };
    let (low, high) = (places(f64::floor, f64::min), places(f64::ceil, f64::max));
    let ticks = (low as i32..=high as i32).map(|i| f64::from(i) * 45.0).collect();
    Axis {
        label: "phase / deg".into(),
        from: low * 45.0,
        to: high * 45.0,
        logarithmic: false,
        ticks,
    }
}

/// The resonance of the run with the largest torque, as each estimator sees it.
fn estimator_chart(group: &Group, size: (f64, f64)) -> Chart {
    let seen = group.runs.last().and_then(|run| run.spa_features().f_res);
    let resonance = seen.or(group.exact.f_res).unwrap_or(BAND.1);
    let x = Axis::linear("frequency / Hz", [resonance - 0.04, resonance + 0.06], 0.1, 5);
    let inside = |points: Vec<(f64, f64)>| -> Vec<(f64, f64)> {
        points.into_iter().filter(|(f, _)| (x.from..=x.to).contains(f)).collect()
    };
    let magnitude = |r: &FrequencyResponse| {
        inside(r.frequency.iter().zip(&r.response).map(|(f, h)| (*f, h.norm())).collect())
    };
    let mut series = Vec::new();
    let last = group.runs.last();
    let both = last.and_then(|run| Some((run.passing.as_ref()?, run.record.as_ref()?)));
    if let Some((passing, record)) = both {
        series.push(Series {
            points: magnitude(&passing.rate.response),
            color: "var(--e0)".into(),
            style: Style::Line,
            title: "while the sweep passes".into(),
        });
        series.push(Series {
            points: magnitude(&record.spa.response),
            color: "var(--e1)".into(),
            style: Style::Dashed,
            title: "whole record (spa)".into(),
        });
        series.push(Series {
            points: magnitude(&record.h1.response),
            color: "var(--e2)".into(),
            style: Style::Dashed,
            title: "whole record (Welch, H1)".into(),
        });
    }
    series.push(exact(magnitude(&group.exact_response)));
    let top = series.iter().flat_map(|s| &s.points).map(|(_, y)| *y).fold(0.0, f64::max);
    let y = Axis::linear("|H| / (rad/s)/(N·m)", [0.0, top], 0.1, 5);
    let amplitude = group.runs.last().map_or(0.0, |run| thousandths(torque_of(run)));
    Chart {
        title: format!("The resonance at {amplitude} mN·m, as each estimator sees it"),
        size,
        x,
        y,
        series,
        legend: true,
    }
}

pub(super) fn frequency_ticks(from: f64, to: f64) -> Vec<f64> {
    if (from, to) == BAND {
        return vec![1.25, 1.5, 2.0, 2.5, 3.0, 3.5];
    }
    Axis::linear("", [from, to], 0.0, 6)
        .ticks
        .into_iter()
        .filter(|f| (from..=to).contains(f))
        .collect()
}

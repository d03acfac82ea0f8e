//! Figures against the torque's amplitude.

use super::*;

/// A feature: title, axis label, which it is, least span of the axis, and its scale.
type Feature = (&'static str, &'static str, fn(&Features) -> Option<f64>, f64, f64);

const FEATURES: [Feature; 4] = [
    ("Antiresonance", "f_dip / Hz", |f| f.f_dip, 0.01, 1.0),
    ("Resonance", "f_res / Hz", |f| f.f_res, 0.03, 1.0),
    ("Separation", "Δf / mHz", |f| f.delta_f(), 20.0, 1e3),
    ("Notch depth", "notch / dB", |f| f.notch_db, 5.0, 1.0),
];

/// The features of all models, fill by fill; nothing where there is one model only.
pub(super) fn models_over_each_other(groups: &[Group]) -> String {
    let models = distinct(groups.iter().map(|group| group.model));
    let fills = fills(groups);
    if models.len() < 2 || groups.iter().any(|group| !group.others.is_empty()) {
        return String::new();
    }
    let mut out = colors::model_legend(models.into_iter());
    for fill in fills {
        let _ = writeln!(out, "<h3>{} cm fill: models compared</h3>", cm(fill));
        out.push_str("<div class=\"four\">\n");
        let groups: Vec<&Group> = groups.iter().filter(|group| group.fill == Some(fill)).collect();
        for (title, label, get, span, scale) in FEATURES {
            let x = torque_axis(groups.iter().flat_map(|group| group.runs.iter().copied()));
            let mut series = Vec::new();
            if let Some(value) = get(&groups[0].exact) {
                series.push(exact(vec![(x.from, value * scale), (x.to, value * scale)]));
            }
            for group in &groups {
                let points = group.runs.iter().filter_map(|run| {
                    Some((thousandths(torque_of(run)), get(&run.features())? * scale))
                });
                series.push(Series {
                    points: points.collect(),
                    color: colors::model_color(group.model),
                    style: Style::Dots,
                    title: group.model.into(),
                });
            }
            let values: Vec<f64> = series.iter().flat_map(|s| &s.points).map(|(_, y)| *y).collect();
            let y = Axis::linear(label, values, span, 5);
            let chart =
                Chart { title: title.into(), size: (330.0, 260.0), x, y, series, legend: false };
            out.push_str(&chart.svg());
        }
        out.push_str("</div>\n");
    }
    out
}

/// The features of one group, as each estimator sees them.
pub(super) fn features(group: &Group) -> String {
    let mut out = format!("{}<div class=\"four\">\n", group.heading());
    for (title, label, get, span, scale) in FEATURES {
        let points = |of: &dyn Fn(&Outcome) -> Features| -> Vec<(f64, f64)> {
            group
                .runs
                .iter()
                .filter_map(|run| Some((thousandths(torque_of(run)), get(&of(run))? * scale)))
                .collect()
        };
        let x = torque_axis(group.runs.iter().copied());
        let mut series = vec![
            Series {
                points: points(&|run| run.h1_features()),
                color: "var(--e2)".into(),
                style: Style::OpenDots,
                title: "Welch, H1".into(),
            },
            Series {
                points: points(&|run| run.spa_features()),
                color: "var(--e1)".into(),
                style: Style::OpenDots,
                title: "spa".into(),
            },
            Series {
                points: points(&|run| run.features()),
                color: "var(--e0)".into(),
                style: Style::Dots,
                title: "demodulation".into(),
            },
        ];
        if let Some(value) = get(&group.exact) {
            series.insert(0, exact(vec![(x.from, value * scale), (x.to, value * scale)]));
        }
        let values = series.iter().flat_map(|s| &s.points).map(|(_, y)| *y);
        let y = Axis::linear(label, values.collect::<Vec<_>>(), span, 5);
        out.push_str(
            &Chart { title: title.into(), size: (330.0, 260.0), x, y, series, legend: false }.svg(),
        );
    }
    out.push_str("</div>\n");
    out
}

/// A small chart of one figure against torque, one line per group.
struct Panel {
    title: &'static str,
    label: &'static str,
    get: fn(&Outcome) -> Option<f64>,
    /// A logarithmic axis, which leaves out what is not positive.
    decades: bool,
    /// A level to compare with, and what it is.
    level: Option<(f64, &'static str)>,
}

pub(super) fn bearing_and_liquid(groups: &[Group]) -> String {
    let quarter = groups
        .first()
        .map(|group| (group.runs[0].tank_radius / 4.0 * 1e3, "a quarter of the tank's radius"));
    let panel = |title, label, get, decades| Panel { title, label, get, decades, level: None };
    let mut out = String::from(
        "<h2>Stiction, slosh amplitude, energy balance</h2>\n<p>At small torque the bearing sticks for part of every cycle, most of all near the antiresonance. The wave height is the linear formula's; beyond a quarter of the tank's radius (dashed line) it says that linear slosh theory no longer holds, not how high the water stands. So a linear model's runs at the larger torques are computed faithfully, but they are not what a tank does.</p>\n",
    );
    out.push_str(&panels(
        groups,
        [
            panel("Time in stiction", "stiction / s", |run| Some(run.figures.stuck), true),
            panel(
                "Largest slosh angle",
                "angle / deg",
                |run| Some(run.figures.peak_slosh_angle.to_degrees()),
                false,
            ),
            Panel {
                level: quarter,
                ..panel(
                    "Largest wave height",
                    "height / mm",
                    |run| Some(run.figures.peak_wave_height * 1e3),
                    false,
                )
            },
            panel(
                "Energy residual",
                "residual / energy throughput",
                |run| Some(run.figures.max_energy_residual),
                true,
            ),
        ],
    ));
    out
}

pub(super) fn linear_fit(groups: &[Group]) -> String {
    let panel = |title, label, get| Panel { title, label, get, decades: false, level: None };
    let mut out = String::from(
        "<h2>Validity of a linear fit</h2>\n<p>A transfer function with three poles and two zeros is fitted to each run's <code>spa</code> response and driven with the run's own torque, as in the thesis. What it cannot represent is dry friction at small torque and, in the nonlinear models, a resonance that moves with the amplitude. Residual coherence: of its residual with the torque, between antiresonance and resonance (Welch, segments of 20 s). Signal-to-noise ratio: from the coherence of rate and torque.</p>\n",
    );
    out.push_str(&panels(
        groups,
        [
            panel("Fit, frequency domain", "fit / %", |run| Some(run.fit()?.fit_frequency)),
            panel("Fit, time domain", "fit / %", |run| Some(run.fit()?.fit_time)),
            panel("Residual coherence", "mean coherence", |run| run.fit()?.coherence),
            panel("Signal-to-noise ratio, antiresonance", "SNR / dB", |run| {
                Some(run.record.as_ref()?.snr_db?[1])
            }),
        ],
    ));
    out
}

/// Whether the slosh leaves its plane, and the radial load on the bearing.
pub(super) fn out_of_the_plane(groups: &[Group]) -> String {
    let panel = |title, label, get| Panel { title, label, get, decades: false, level: None };
    let mut out = String::from(
        "<h2>Out of the plane</h2>\n<p>Swirl: 0 for motion in a plane, 1 for a circle; above the dashed line the slosh is rotary. Off-axis energy and leakage: the liquid's radial force, which only loads the bearing, relative to the tangential one and to the torque. The linear and planar models cannot leave their plane.</p>\n",
    );
    out.push_str(&panels(
        groups,
        [
            Panel {
                level: Some((rotary::ROTARY, "counts as rotary")),
                ..panel("Swirl", "largest |swirl|", |run| Some(run.rotary()?.swirl.abs()))
            },
            panel("Time in rotary slosh", "rotary slosh / s", |run| Some(run.rotary()?.time)),
            panel("Off-axis energy", "Σ F_r² / Σ (F_r² + F_t²)", |run| {
                Some(run.off_axis()?.energy)
            }),
            panel("Leakage", "rms of r|F_r|/|τ|", |run| Some(run.off_axis()?.leakage)),
        ],
    ));
    out
}

fn panels(groups: &[Group], panels: impl IntoIterator<Item = Panel>) -> String {
    let mut out = String::from("<div class=\"legend\">");
    let marks = colors::group_marks(groups);
    for (group, (color, style)) in groups.iter().zip(&marks) {
        let dash = if *style == Style::OpenDots { " class=\"dash\"" } else { "" };
        let _ = write!(
            out,
            "<span><i{dash} style=\"color:{color}\"></i>{}</span>",
            escape(&group.title())
        );
    }
    out.push_str("</div>\n<div class=\"four\">\n");
    for Panel { title, label, get, decades, level } in panels {
        let x = torque_axis(groups.iter().flat_map(|g| g.runs.iter().copied()));
        let mut series: Vec<Series> = groups
            .iter()
            .zip(&marks)
            .map(|(group, (color, style))| Series {
                points: group
                    .runs
                    .iter()
                    .filter_map(|run| Some((thousandths(torque_of(run)), get(run)?)))
                    .filter(|(_, y)| y.is_finite() && (!decades || *y > 0.0))
                    .collect(),
                color: color.clone(),
                style: *style,
                title: group.title(),
            })
            .collect();
        if let Some((level, what)) = level {
            series.push(Series {
                points: vec![(x.from, level), (x.to, level)],
                color: "var(--exact)".into(),
                style: Style::Dashed,
                title: what.into(),
            });
        }
        let values: Vec<f64> = series.iter().flat_map(|s| &s.points).map(|(_, y)| *y).collect();
        let nothing = values.is_empty();
        let y = if decades {
            Axis::decades(label, values)
        } else {
            Axis::linear(label, values.into_iter().chain([0.0, 0.1]), 1e-9, 5)
        };
        let title = if nothing { format!("{title}: none") } else { title.to_string() };
        out.push_str(&Chart { title, size: (330.0, 260.0), x, y, series, legend: false }.svg());
    }
    out.push_str("</div>\n");
    out
}

fn torque_axis<'a>(runs: impl Iterator<Item = &'a Outcome>) -> Axis {
    let values: Vec<f64> = runs.map(|run| thousandths(torque_of(run))).chain([0.0]).collect();
    let axis = Axis::linear("torque amplitude / mN·m", values, 10.0, 5);
    Axis { to: axis.to * 1.03, ..axis } // room for the last dot
}

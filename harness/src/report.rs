//! `report.html`: one self-contained page on a campaign.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;

use crate::analysis::features::Features;
use crate::analysis::{BAND, FrequencyResponse, demodulation, logarithmic_grid, rotary, spa};
use crate::campaign::{Campaign, Outcome, Results};
use crate::fmi2::Fmu;
use crate::html::escape;
use crate::output;
use crate::plan::{Plan, thousandths};
use crate::profile::{Profile, Torque};
use crate::svg::{Axis, Chart, Series, Style};

/// Writes the report.
pub fn write(path: &Path, campaign: &Campaign, fmu: &Fmu, results: &Results) -> Result<()> {
    let page = page(campaign, fmu, results);
    output::atomically(path, |file| Ok(std::io::Write::write_all(file, page.as_bytes())?))
}

/// Runs that differ in nothing but the torque's amplitude (and what is drawn at random).
struct Group<'a> {
    model: &'a str,
    /// m; `None` if it is drawn at random.
    fill: Option<f64>,
    /// What else tells it from the other groups, such as `tank.d = 0.111`.
    others: Vec<String>,
    runs: Vec<&'a Outcome>,
    /// The sweep of its first run.
    sweep: Option<&'a Profile>,
    /// Features of the exact linear response on the same grid.
    exact: Features,
    exact_response: FrequencyResponse,
}

impl Group<'_> {
    fn title(&self) -> String {
        let mut title = format!("{} model", self.model);
        if let Some(fill) = self.fill {
            let _ = write!(title, ", {} cm fill", cm(fill));
        }
        for other in &self.others {
            let _ = write!(title, ", {other}");
        }
        title
    }

    fn heading(&self) -> String {
        format!("<h3>{}</h3>\n", escape(&self.title()))
    }
}

/// The sweep that drives a run, if it is one.
fn sweep(run: &Outcome) -> Option<&Profile> {
    match &*run.case.torque {
        Torque::Profile(profile) if profile.is_sweep() => Some(profile),
        _ => None,
    }
}

fn groups<'a>(plan: &Plan, results: &'a Results) -> Vec<Group<'a>> {
    // the places, among all that is varied, of what tells groups apart beside model and fill
    let grouping = plan.grouping();
    let others: Vec<(usize, &str)> = plan
        .varied()
        .into_iter()
        .enumerate()
        .filter(|(_, name)| grouping.contains(name))
        .filter(|(_, name)| !["slosh.model", "tank.h", "profile.amplitude"].contains(name))
        .collect();
    let drawn_fill = plan.is_random() && !grouping.contains(&"tank.h");
    let mut groups: Vec<Group> = Vec::new();
    for run in &results.outcomes {
        let values = others.iter().filter(|(i, _)| !run.case.varied[*i].is_empty());
        let key: Vec<String> =
            values.map(|(i, name)| format!("{name} = {}", run.case.varied[*i])).collect();
        let same = |g: &&mut Group| {
            g.model == run.case.model
                && g.fill.is_none_or(|fill| fill == run.case.fill)
                && g.others == key
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.runs.push(run),
            None => {
                let sweep = sweep(run);
                let band = sweep.and_then(Profile::band).unwrap_or(BAND);
                let exact_response = run.linear.frequency_response(&logarithmic_grid(band, 2000));
                groups.push(Group {
                    model: &run.case.model,
                    fill: (!drawn_fill).then_some(run.case.fill),
                    others: key,
                    runs: vec![run],
                    sweep,
                    exact: Features::of(&exact_response),
                    exact_response,
                });
            }
        }
    }
    groups
}

fn page(campaign: &Campaign, fmu: &Fmu, results: &Results) -> String {
    let plan = &campaign.plan;
    let groups = groups(plan, results);
    let mut amplitudes: Vec<f64> =
        results.outcomes.iter().filter_map(|run| run.case.amplitude).collect();
    amplitudes.sort_by(f64::total_cmp);
    amplitudes.dedup();
    // each panel only where it says something: draws have no order along an axis
    let swept = groups.iter().any(|group| group.sweep.is_some()) && !plan.is_random();
    let along = amplitudes.len() > 1 && !plan.is_random();
    let mut page = String::new();
    let _ = write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>HubSlosh: {}</title>\n<style>\n{}{}</style>\n</head>\n<body><main>\n",
        escape(&plan.title),
        include_str!("report.css"),
        amplitude_colors(amplitudes.len())
    );
    page.push_str(&introduction(plan, fmu, results, &groups));
    if swept {
        page.push_str("<h2>Frequency responses</h2>\n<p>Hub rate over commanded torque while the sweep passes each frequency, one curve per torque amplitude. The dip stands at the slosh frequency, where the liquid holds the hub still; the peak, where hub and liquid swing against each other, stands above it. Rest the pointer on a curve to see which run it is.</p>\n");
        page.push_str(&amplitude_legend(&amplitudes));
        for group in groups.iter().filter(|group| group.sweep.is_some()) {
            page.push_str(&responses(group, &amplitudes));
        }
    }
    if swept && along {
        page.push_str("<h2>Features against torque amplitude</h2>\n<p>For a linear plant with linear friction these would be horizontal lines. What bends them at small torque is the bearing: dry friction counts most when the torque is small.</p>\n<div class=\"legend\"><span><i style=\"color:var(--e0)\"></i>while the sweep passes (demodulation; in <code>features.csv</code>)</span><span><i class=\"dash\" style=\"color:var(--e1)\"></i>over the whole record (<code>spa</code>)</span><span><i class=\"dash\" style=\"color:var(--exact)\"></i>exact, linear with viscous friction</span></div>\n");
        for group in groups.iter().filter(|group| group.sweep.is_some()) {
            page.push_str(&features(group));
        }
    }
    if along {
        page.push_str(&bearing_and_liquid(&groups));
    }
    if swept && along {
        page.push_str(&linear_fit(&groups));
    }
    if swept {
        page.push_str(&estimators(&groups));
    }
    page.push_str(&table(plan, results));
    page.push_str(&provenance(campaign, fmu, results));
    page.push_str("</main></body>\n</html>\n");
    page
}

// ---------------------------------------------------------------- text

fn introduction(plan: &Plan, fmu: &Fmu, results: &Results, groups: &[Group]) -> String {
    let mut out = format!(
        "<h1>A hub, a sloshing tank and a sticking bearing</h1>\n\
         <p class=\"lead\">{}. {} runs of the HubSlosh FMU (version {}), sampled at {:.0} Hz: {}.</p>\n",
        escape(if plan.title.is_empty() { "A campaign" } else { &plan.title }),
        results.outcomes.len(),
        escape(&fmu.description().version),
        results.outcomes.first().map_or(0.0, |run| 1.0 / run.case.step),
        escape(&torques(results)),
    );
    if !results.failures.is_empty() {
        let _ = write!(
            out,
            "<div class=\"failed\"><p><b>{} runs failed:</b></p><ul>",
            results.failures.len()
        );
        for failure in &results.failures {
            let _ = write!(
                out,
                "<li><code>{}</code>: {}</li>",
                escape(&failure.case.name),
                escape(&failure.reason)
            );
        }
        out.push_str("</ul></div>\n");
    }
    out.push_str("<div class=\"cards\">");
    for group in groups.iter().filter(|group| group.sweep.is_some()) {
        let over = |get: &dyn Fn(&Outcome) -> Option<f64>| {
            let values: Vec<f64> = group.runs.iter().filter_map(|run| get(run)).collect();
            match values
                .iter()
                .copied()
                .reduce(f64::min)
                .zip(values.iter().copied().reduce(f64::max))
            {
                Some((low, high)) if high - low < 5e-5 => format!("{low:.4}"),
                Some((low, high)) => format!("{low:.3}–{high:.3}"),
                None => "none".into(),
            }
        };
        for (what, value, exact) in [
            ("dip", over(&|run| run.features().f_dip), group.exact.f_dip),
            ("swept peak", over(&|run| run.features().f_res), group.exact.f_res),
        ] {
            let _ = write!(
                out,
                "<div class=\"card\"><b>{value} Hz</b><span>{what}, {}{}</span></div>",
                escape(&group.title()),
                exact
                    .filter(|_| !plan.is_random())
                    .map_or(String::new(), |f| format!(" (exact linear {f:.4} Hz)")),
            );
        }
    }
    out.push_str("</div>\n");
    out
}

fn estimators(groups: &[Group]) -> String {
    let mut out = format!(
        "<h2>How the figures are found</h2>\n\
         <p><b>Demodulation</b> (solid, in <code>features.csv</code>). Torque and rate are multiplied by e<sup>−jφ(t)</sup>, φ being the sweep's own known phase, and averaged over a Hann window of {cycles} cycles that slides with the sweep. Their ratio is the response the moment the sweep passes that frequency: what a lock-in amplifier would show. Both signals see the same window, so its effect on amplitude and phase cancels; harmonics that the bearing makes average out.</p>\n\
         <p><b><code>spa</code></b> (broken). MATLAB's Blackman–Tukey estimate, which the thesis used: covariances of the whole record up to a lag of {lag} s, Hann lag window, Fourier transform, ratio of cross spectrum to input spectrum. It resolves about {resolution:.0} mHz, which fills a narrow dip a little.</p>\n\
         <p><b>Features.</b> f<sub>res</sub> and f<sub>dip</sub> are the most prominent local maximum and minimum of |H| between {from} and {to} Hz, refined by a parabola through three points of log |H|; Δf is their distance, the notch depth their difference in dB. They are local on purpose: with strong damping the largest |H| in the band is its lower edge, not the slosh peak.</p>\n\
         <p><b>Energy residual.</b> Largest |E(t) − E(0) − work + heat| of a run over the energy turned over, Σ|Δwork| + heat. It is the FMU's own book-keeping, checked at every sample.</p>\n\
         <h2>Why the swept peak stands higher than the exact one</h2>\n\
         <p>The sweep is not slow enough for the liquid. Bare-wall damping makes the peak so narrow that the sweep crosses its half-power width in less time than the slosh needs to decay: the oscillation is still growing when its best frequency has gone by, so an upward sweep sees the largest rate later, at a higher frequency, and a little lower than it would be in a dwell. The ripple behind the peak is the beat between that ringing and the torque that has moved on. A bench that sweeps at this rate and reads the envelope sees the same shift; it belongs to the experiment, not to the plant.</p>\n",
        cycles = demodulation::CYCLES,
        lag = spa::LAG,
        resolution = 1e3 / spa::LAG,
        from = BAND.0,
        to = BAND.1,
    );
    out.push_str("<div class=\"wide\"><table><thead><tr><th>runs</th><th>exact<br>peak</th><th>half-power<br>width 2ζf</th><th>sweep rate<br>there</th><th>time to<br>cross</th><th>slosh decays<br>in 1/(2πζf)</th><th>largest torque,<br>swept peak</th><th>its<br>shift</th><th>largest torque,<br><code>spa</code> peak</th><th>its<br>shift</th></tr></thead><tbody>\n");
    for group in groups {
        let (Some(mode), Some(exact), Some(run), Some(sweep)) =
            (group.runs[0].linear.modes.first(), group.exact.f_res, group.runs.last(), group.sweep)
        else {
            continue;
        };
        let width = 2.0 * mode.damping * mode.frequency;
        let rate = sweep.rate_at(exact).abs();
        let shift =
            |f: Option<f64>| f.map_or(String::new(), |f| format!("{:+.1} mHz", (f - exact) * 1e3));
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td>{exact:.4} Hz</td><td>{:.1} mHz</td><td>{:.2} mHz/s</td><td>{:.1} s</td><td>{:.1} s</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escape(&group.title()),
            width * 1e3,
            rate * 1e3,
            width / rate,
            1.0 / (TAU * mode.damping * mode.frequency),
            hertz(run.demodulated_features.f_res),
            shift(run.demodulated_features.f_res),
            hertz(run.spa_features.f_res),
            shift(run.spa_features.f_res),
        );
    }
    out.push_str("</tbody></table></div>\n<p>The second estimator is the proof. For a linear plant the ratio of whole-record spectra is the frequency response however fast the input swept, because the ringing after the peak is in the record too; and there the shift is gone. The dip hardly moves in either: there the hub stands nearly still, so there is little that could ring; only at the smallest torques, where the bearing sticks near the dip, does the sweep see it a few mHz late. When runs of a nonlinear model are compared, both views count: demodulation says what happened at that moment, <code>spa</code> gives the best linear summary of the whole.</p>\n");
    out
}

/// The profiles of the runs, without what is varied along them.
fn torques(results: &Results) -> String {
    let mut profiles: Vec<&str> =
        results.outcomes.iter().map(|run| run.case.profile.as_str()).collect();
    profiles.sort_unstable();
    profiles.dedup();
    match profiles[..] {
        [] => "none".into(),
        [one] => one.into(),
        // what they have in common, key by key
        [first, ..] => {
            let (name, rest) = first.split_once(':').unwrap_or((first, ""));
            let same = |part: &&str| {
                profiles.iter().all(|p| {
                    let parts = p.strip_prefix(name).and_then(|p| p.strip_prefix(':'));
                    parts.is_some_and(|parts| parts.split(',').any(|other| other == *part))
                })
            };
            let common: Vec<_> = rest.split(',').filter(same).collect();
            match common[..] {
                [] => format!("{} torques", profiles.len()),
                _ => format!("{name}:{} ({} torques)", common.join(","), profiles.len()),
            }
        }
    }
}

fn provenance(campaign: &Campaign, fmu: &Fmu, results: &Results) -> String {
    let description = fmu.description();
    let (plan, first) = (&campaign.plan, results.outcomes.first().map(|run| &run.case));
    let settings: Vec<_> = plan.set().iter().map(|(k, v)| format!("{k} = {v}")).collect();
    let tolerance =
        match (first.and_then(|c| c.tolerance), description.default_experiment.tolerance) {
            (Some(t), _) => t.to_string(),
            (None, Some(t)) => format!("the FMU's own ({t})"),
            (None, None) => "the FMU's own".into(),
        };
    let torque = first.map_or(String::new(), |case| {
        let what = if case.hold { "value" } else { "value and slope" };
        format!("{}; {what} handed over every {} s", torques(results), case.step)
    });
    let rows = [
        ("FMU", format!("{}, version {}", description.model_name, description.version)),
        ("made by", description.generation_tool.clone()),
        ("GUID", description.guid.clone()),
        ("SHA-256", fmu.hash().to_string()),
        ("varied", plan.varied().join(", ")),
        (
            "parameters",
            if settings.is_empty() { "the FMU's start values".into() } else { settings.join(", ") },
        ),
        ("torque", torque),
        ("tolerance", tolerance),
        ("driven by", format!("hubslosh {}", env!("CARGO_PKG_VERSION"))),
    ];
    let mut out = String::from("<h2>What was run</h2>\n<dl>");
    for (name, value) in rows.iter().filter(|(_, value)| !value.is_empty()) {
        let _ = write!(out, "<dt>{name}</dt><dd><code>{}</code></dd>", escape(value));
    }
    let _ = write!(
        out,
        "</dl>\n<p>Each run lies in <code>runs/</code> as Parquet with its particulars in its metadata. <code>features.csv</code> holds the figures of the table above, <code>features_spa.csv</code> those of <code>spa</code> in the same columns, <code>runs.csv</code> all of them with everything that was varied, <code>plan.toml</code> the plan. This makes everything here again:</p>\n<p><code>{}</code></p>\n",
        escape(&campaign.command(fmu))
    );
    out
}

fn table(plan: &Plan, results: &Results) -> String {
    let varied = plan.varied();
    let others: Vec<(usize, &str)> = varied
        .into_iter()
        .enumerate()
        .filter(|(_, name)| !["slosh.model", "tank.h", "profile.amplitude"].contains(name))
        .collect();
    let heads: String =
        others.iter().map(|(_, name)| format!("<th>{}</th>", escape(name))).collect();
    let mut out = format!(
        "<h2>All figures</h2>\n<div class=\"wide\"><table><thead>\n\
         <tr><th colspan=\"{}\">Run</th><th colspan=\"4\">While the sweep passes</th><th colspan=\"4\">Whole record (<code>spa</code>)</th><th colspan=\"4\">The run itself</th></tr>\n\
         <tr><th>model</th><th>fill<br>cm</th><th>torque<br>mN·m</th>{heads}<th>f<sub>dip</sub><br>Hz</th><th>f<sub>res</sub><br>Hz</th><th>Δf<br>mHz</th><th>notch<br>dB</th><th>f<sub>dip</sub><br>Hz</th><th>f<sub>res</sub><br>Hz</th><th>Δf<br>mHz</th><th>notch<br>dB</th><th>peak slosh<br>angle, deg</th><th>peak wave<br>mm</th><th>stuck<br>s</th><th>energy<br>residual</th></tr>\n</thead><tbody>\n",
        3 + others.len()
    );
    for run in &results.outcomes {
        let _ = write!(
            out,
            "<tr><td>{}</td><td>{}</td><td>{}</td>",
            escape(&run.case.model),
            cm(run.case.fill),
            run.case.amplitude.map_or(String::new(), |a| thousandths(a).to_string())
        );
        for (place, _) in &others {
            let _ = write!(out, "<td>{}</td>", escape(&shortened(&run.case.varied[*place])));
        }
        for (features, response) in
            [(&run.demodulated_features, &run.demodulated), (&run.spa_features, &run.spa)]
        {
            let cell = |value: Option<f64>, digits: usize| match value {
                Some(value) => format!("<td>{value:.digits$}</td>"),
                None if response.frequency.is_empty() => "<td></td>".into(),
                None => "<td>none</td>".into(),
            };
            out.push_str(&cell(features.f_dip, 4));
            out.push_str(&cell(features.f_res, 4));
            out.push_str(&cell(features.delta_f().map(|f| f * 1e3), 1));
            out.push_str(&cell(features.notch_db, 2));
        }
        let figures = &run.figures;
        let _ = writeln!(
            out,
            "<td>{:.1}</td><td>{:.1}</td><td>{:.3}</td><td>{:.1e}</td></tr>",
            figures.peak_slosh_angle.to_degrees(),
            figures.peak_wave_height * 1e3,
            figures.stuck,
            figures.max_energy_residual
        );
    }
    out.push_str("</tbody></table></div>\n");
    out
}

/// A drawn number to six digits; any other text as it is.
fn shortened(text: &str) -> String {
    match text.parse::<f64>() {
        Ok(value) if text.len() > 8 => format!("{value:.5e}"),
        _ => text.to_string(),
    }
}

// ---------------------------------------------------------------- figures

fn frequency_ticks(from: f64, to: f64) -> Vec<f64> {
    if (from, to) == BAND {
        return vec![1.25, 1.5, 2.0, 2.5, 3.0, 3.5];
    }
    Axis::linear("", [from, to], 0.0, 6)
        .ticks
        .into_iter()
        .filter(|f| (from..=to).contains(f))
        .collect()
}

/// Amplitude of a run's torque, N·m; 0 where there is none.
fn torque_of(run: &Outcome) -> f64 {
    run.case.amplitude.unwrap_or(0.0)
}

fn responses(group: &Group, amplitudes: &[f64]) -> String {
    let level = |r: &FrequencyResponse| zip(&r.frequency, &r.decibels());
    let phase = |r: &FrequencyResponse| zip(&r.frequency, &r.degrees());
    let curves = |of: &dyn Fn(&FrequencyResponse) -> Vec<(f64, f64)>| {
        let mut series: Vec<Series> = group
            .runs
            .iter()
            .map(|run| Series {
                points: of(&run.demodulated),
                color: amplitude_color(amplitudes, torque_of(run)),
                style: Style::Line,
                title: format!("{} mN·m", thousandths(torque_of(run))),
            })
            .collect();
        series.push(exact(of(&group.exact_response)));
        series
    };
    let levels = || curves(&level).into_iter().flat_map(|s| s.points).map(|(_, y)| y);
    let size = (560.0, 330.0);
    let (from, to) = group.sweep.and_then(Profile::band).unwrap_or(BAND);
    let band = Axis::logarithmic("frequency / Hz", (from, to), &frequency_ticks(from, to));
    let dip = group.exact.f_dip.unwrap_or(from);
    let peak = group.exact.f_res.unwrap_or(to);
    let around = Axis::linear("frequency / Hz", [dip - 0.08, peak + 0.12], 0.3, 6);
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
            title: "Magnitude around dip and peak".into(),
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
        estimator_chart(group, size, peak),
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

/// The peak of the run with the largest torque, as each estimator sees it.
fn estimator_chart(group: &Group, size: (f64, f64), peak: f64) -> Chart {
    let x = Axis::linear("frequency / Hz", [peak - 0.04, peak + 0.06], 0.1, 5);
    let inside = |points: Vec<(f64, f64)>| -> Vec<(f64, f64)> {
        points.into_iter().filter(|(f, _)| (x.from..=x.to).contains(f)).collect()
    };
    let magnitude = |r: &FrequencyResponse| {
        inside(r.frequency.iter().zip(&r.response).map(|(f, h)| (*f, h.norm())).collect())
    };
    let mut series = Vec::new();
    if let Some(run) = group.runs.last() {
        series.push(Series {
            points: magnitude(&run.demodulated),
            color: "var(--e0)".into(),
            style: Style::Line,
            title: "while the sweep passes".into(),
        });
        series.push(Series {
            points: magnitude(&run.spa),
            color: "var(--e1)".into(),
            style: Style::Dashed,
            title: "whole record (spa)".into(),
        });
    }
    series.push(exact(magnitude(&group.exact_response)));
    let top = series.iter().flat_map(|s| &s.points).map(|(_, y)| *y).fold(0.0, f64::max);
    let y = Axis::linear("|H| / (rad/s)/(N·m)", [0.0, top], 0.1, 5);
    let amplitude = group.runs.last().map_or(0.0, |run| thousandths(torque_of(run)));
    Chart {
        title: format!("The peak at {amplitude} mN·m, as each estimator sees it"),
        size,
        x,
        y,
        series,
        legend: true,
    }
}

fn features(group: &Group) -> String {
    let mut out = format!("{}<div class=\"four\">\n", group.heading());
    type Get = fn(&Features) -> Option<f64>;
    let panels: [(&str, &str, Get, f64, f64); 4] = [
        ("Dip", "f_dip / Hz", |f| f.f_dip, 0.01, 1.0),
        ("Peak", "f_res / Hz", |f| f.f_res, 0.03, 1.0),
        ("Distance", "Δf / mHz", |f| f.delta_f(), 20.0, 1e3),
        ("Notch depth", "notch / dB", |f| f.notch_db, 5.0, 1.0),
    ];
    for (title, label, get, span, scale) in panels {
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
                points: points(&|run| run.spa_features),
                color: "var(--e1)".into(),
                style: Style::OpenDots,
                title: "spa".into(),
            },
            Series {
                points: points(&|run| run.demodulated_features),
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

fn bearing_and_liquid(groups: &[Group]) -> String {
    let quarter = groups
        .first()
        .map(|group| (group.runs[0].tank_radius / 4.0 * 1e3, "a quarter of the tank's radius"));
    let panel = |title, label, get, decades| Panel { title, label, get, decades, level: None };
    let mut out = String::from(
        "<h2>Bearing, liquid, book-keeping</h2>\n<p>At small torque the bearing sticks for part of every cycle, most of all near the dip. The wave height is the linear formula's; beyond a quarter of the tank's radius (broken line) it says that linear slosh theory no longer holds, not how high the water stands. So a linear model's runs at the larger torques are computed faithfully, but they are not what a tank does.</p>\n",
    );
    out.push_str(&panels(
        groups,
        [
            panel("Time stuck in the sweep", "stuck / s", |run| Some(run.figures.stuck), true),
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
                "residual / energy turned over",
                |run| Some(run.figures.max_energy_residual),
                true,
            ),
        ],
    ));
    out
}

fn linear_fit(groups: &[Group]) -> String {
    let panel = |title, label, get| Panel { title, label, get, decades: false, level: None };
    let mut out = String::from(
        "<h2>How far one linear model reaches</h2>\n<p>A transfer function with three poles and two zeros is fitted to each run's <code>spa</code> response and driven with the run's own torque, as in the thesis. What it can't be is dry friction at small torque and, in the nonlinear models, a resonance that moves with the amplitude. Coherence: of what it leaves with the torque, between dip and peak (Welch, 8 segments). Swirl: 0 for motion in a plane, 1 for a circle; where it passes the broken line the liquid turns.</p>\n",
    );
    out.push_str(&panels(
        groups,
        [
            panel("Fit, frequency domain", "fit / %", |run| Some(run.fit?.fit_frequency)),
            panel("Fit, time domain", "fit / %", |run| Some(run.fit?.fit_time)),
            panel("Coherence of the rest", "mean coherence", |run| Some(run.fit?.coherence)),
            Panel {
                level: Some((rotary::ROTARY, "counts as rotary")),
                ..panel("Swirl", "largest |swirl|", |run| Some(run.rotary?.swirl.abs()))
            },
        ],
    ));
    out
}

fn panels(groups: &[Group], panels: [Panel; 4]) -> String {
    let mut out = String::from("<div class=\"legend\">");
    for (i, group) in groups.iter().enumerate() {
        let _ = write!(
            out,
            "<span><i style=\"color:{}\"></i>{}</span>",
            fill_color(i),
            escape(&group.title())
        );
    }
    out.push_str("</div>\n<div class=\"four\">\n");
    for Panel { title, label, get, decades, level } in panels {
        let x = torque_axis(groups.iter().flat_map(|g| g.runs.iter().copied()));
        let mut series: Vec<Series> = groups
            .iter()
            .enumerate()
            .map(|(i, group)| Series {
                points: group
                    .runs
                    .iter()
                    .filter_map(|run| Some((thousandths(torque_of(run)), get(run)?)))
                    .filter(|(_, y)| y.is_finite() && (!decades || *y > 0.0))
                    .collect(),
                color: fill_color(i),
                style: Style::Dots,
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
            Axis::linear(label, values.into_iter().chain([0.0]), 1.0, 5)
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

fn exact(points: Vec<(f64, f64)>) -> Series {
    Series {
        points,
        color: "var(--exact)".into(),
        style: Style::Dashed,
        title: "exact, linear and viscous".into(),
    }
}

fn zip(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    x.iter().copied().zip(y.iter().copied()).collect()
}

// ---------------------------------------------------------------- colours and numbers

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
fn amplitude_colors(count: usize) -> String {
    let scheme = |from: f64, to: f64| {
        let mut rules = String::new();
        for i in 0..count {
            let part = if count > 1 { i as f64 / (count - 1) as f64 } else { 0.5 };
            let place = (from + (to - from) * part) * 9.0;
            let (low, mix) = ((place as usize).min(8), place - (place as usize).min(8) as f64);
            let [r, g, b] =
                [0, 1, 2].map(|c| VIRIDIS[low][c] * (1.0 - mix) + VIRIDIS[low + 1][c] * mix);
            let _ = write!(rules, "--a{i}: rgb({r:.0} {g:.0} {b:.0}); ");
        }
        rules
    };
    format!(
        ":root {{ {}}}\n@media (prefers-color-scheme: dark) {{ :root {{ {}}} }}\n",
        scheme(0.0, 0.86),
        scheme(0.25, 1.0)
    )
}

fn amplitude_color(amplitudes: &[f64], amplitude: f64) -> String {
    let mut sorted = amplitudes.to_vec();
    sorted.sort_by(f64::total_cmp);
    format!("var(--a{})", sorted.iter().position(|a| *a == amplitude).unwrap_or(0))
}

fn amplitude_legend(amplitudes: &[f64]) -> String {
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

fn fill_color(i: usize) -> String {
    format!("var(--f{})", i % 4)
}

/// A length in cm to the micrometre.
fn cm(length: f64) -> f64 {
    (length * 1e6).round() / 1e4
}

fn hertz(value: Option<f64>) -> String {
    value.map_or("none".into(), |f| format!("{f:.4} Hz"))
}

//! `report.html`: one self-contained page on a campaign.

mod amplitude;
mod colors;
mod draws;
mod maps;
mod notes;
mod paths;
mod responses;
mod thesis;

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;

use crate::analysis::features::Features;
use crate::analysis::{BAND, FrequencyResponse, demodulation, logarithmic_grid, rotary, spa};
use crate::campaign::{Campaign, Curve, Outcome, Results};
use crate::plan::{Plan, thousandths};
use crate::profile::{Sweep, Torque};
use crate::svg::{Axis, Chart, Series, Style};
use host::fmi2::Fmu;
use host::html::escape;
use host::output;

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
    sweep: Option<&'a Sweep>,
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

/// Level in dB over the frequency while the sweep passes.
fn passing(run: &Outcome) -> Curve {
    let response = run.passing.as_ref().map(|passing| &passing.rate.response);
    response.map_or(Curve::new(), |r| zip(&r.frequency, &r.decibels()))
}

/// The sweep that drives a run, if it is one.
fn sweep(run: &Outcome) -> Option<&Sweep> {
    match &*run.case.torque {
        Torque::Profile(profile) => profile.sweep(),
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
            g.model == run.model && g.fill.is_none_or(|fill| fill == run.fill) && g.others == key
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.runs.push(run),
            None => {
                let sweep = sweep(run);
                let band = sweep.map(Sweep::band).unwrap_or(BAND);
                let exact_response = run.linear.frequency_response(&logarithmic_grid(band, 2000));
                groups.push(Group {
                    model: &run.model,
                    fill: (!drawn_fill).then_some(run.fill),
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
        include_str!("page.css"),
        colors::amplitude_colors(amplitudes.len())
    );
    page.push_str(&introduction(plan, fmu, results, &groups));
    let sweeps: Vec<&Group> = groups.iter().filter(|group| group.sweep.is_some()).collect();
    if swept && along {
        page.push_str(&thesis::statements(&groups));
    }
    if swept {
        page.push_str("<h2>Frequency responses</h2>\n<p>Hub rate over commanded torque while the sweep passes each frequency, one curve per torque amplitude. The antiresonance stands at the slosh frequency, where the liquid holds the hub still; the resonance, where hub and liquid swing against each other, stands above it. Rest the pointer on a curve to see which run it is.</p>\n");
        page.push_str(&responses::models_over_each_other(&sweeps));
        page.push_str(&colors::amplitude_legend(&amplitudes));
        for group in &sweeps {
            page.push_str(&responses::responses(group, &amplitudes));
        }
    }
    if swept && along {
        page.push_str("<h2>Features against torque amplitude</h2>\n<p>For a linear plant with linear friction these would be horizontal lines. What bends them at small torque is the bearing: dry friction counts most when the torque is small. A nonlinear liquid bends them at large torque.</p>\n");
        page.push_str(&amplitude::models_over_each_other(&groups));
        page.push_str("<div class=\"legend\"><span><i style=\"color:var(--e0)\"></i>while the sweep passes (demodulation; in <code>features.csv</code>)</span><span><i class=\"dash\" style=\"color:var(--e1)\"></i>over the whole record (<code>spa</code>)</span><span><i class=\"dash\" style=\"color:var(--e2)\"></i>over the whole record (Welch, H1)</span><span><i class=\"dash\" style=\"color:var(--exact)\"></i>exact, linear with viscous friction</span></div>\n");
        for group in &sweeps {
            page.push_str(&amplitude::features(group));
        }
    }
    if along {
        page.push_str(&amplitude::bearing_and_liquid(&groups));
    }
    if swept && along {
        page.push_str(&amplitude::linear_fit(&groups));
        page.push_str(&amplitude::out_of_the_plane(&groups));
        page.push_str(&maps::maps(&groups));
    }
    if swept {
        page.push_str(&paths::paths(&groups));
    }
    if plan.is_random() && groups.iter().any(|group| group.sweep.is_some()) {
        page.push_str(&draws::draws(plan, fmu, &groups));
    }
    if swept {
        page.push_str(&notes::estimators(&groups));
    }
    page.push_str(&notes::table(plan, results));
    page.push_str(&notes::provenance(campaign, fmu, results));
    page.push_str("</main></body>\n</html>\n");
    page
}

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
        let [antiresonance, resonance] =
            [over(&|run| run.features().f_dip), over(&|run| run.features().f_res)];
        let exact = group.exact.f_dip.zip(group.exact.f_res).filter(|_| !plan.is_random());
        let _ = write!(
            out,
            "<div class=\"card\"><b>{antiresonance} Hz</b><b>{resonance} Hz</b><span>antiresonance and swept resonance, {}{}</span></div>",
            escape(&group.title()),
            exact.map_or(String::new(), |(antiresonance, resonance)| format!(
                " (exact, linear: {antiresonance:.4} and {resonance:.4} Hz)"
            )),
        );
    }
    out.push_str("</div>\n");
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

/// Each value once, in the order of the first.
fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

/// The groups' fills, m, from small to large.
fn fills(groups: &[Group]) -> Vec<f64> {
    let mut fills = distinct(groups.iter().filter_map(|group| group.fill));
    fills.sort_by(f64::total_cmp);
    fills
}

/// Amplitude of a run's torque, N·m; 0 where there is none.
fn torque_of(run: &Outcome) -> f64 {
    run.case.amplitude.unwrap_or(0.0)
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

/// A length in cm to the micrometre.
fn cm(length: f64) -> f64 {
    (length * 1e6).round() / 1e4
}

fn hertz(value: Option<f64>) -> String {
    value.map_or("none".into(), |f| format!("{f:.4} Hz"))
}

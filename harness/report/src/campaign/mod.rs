//! `report.html`: one self-contained page on a campaign.

mod along;
mod colors;
mod compare;
mod draws;
mod figure;
mod general;
mod histories;
mod notes;
mod page;
mod responses;
mod thesis;

use std::fmt::Write as _;

use analysis::BAND;
use analysis::features::Features;
use experiments::campaign::{Campaign, Results};
use experiments::rounding::thousandths;
use host::fmi2::Fmu;
use host::html::escape;

use self::figure::{Figure, Figures};
use self::page::{Group, Page, Varied, axis, best, groups, manoeuvre, runs};

/// Most groups that get figures of their own; more would be a book.
const MOST_GROUPS: usize = 6;

/// The report.
pub fn page(campaign: &Campaign, fmu: &Fmu, results: &Results) -> String {
    let plan = &campaign.plan;
    let page = Page {
        plan,
        groups: groups(plan, fmu, results),
        axis: axis(plan, fmu, &results.outcomes),
        varied: plan.varied().iter().map(|n| Varied::of(n, fmu, &results.outcomes)).collect(),
    };
    let mut figures = Figures::default();
    let sections = match results.unanalysed.is_empty() {
        true => bench_sections(&page, campaign, results, &mut figures),
        false => general_sections(fmu, results, &mut figures),
    };
    let mut out = String::new();
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>HubSlosh: {}</title>\n<style>\n{}</style>\n</head>\n<body><main>\n",
        escape(&plan.title),
        include_str!("page.css"),
    );
    out.push_str(&introduction(&page, fmu, results));
    out.push_str("<nav aria-label=\"Contents\"><b>Contents</b><ul>");
    let sections: Vec<(&str, String)> =
        sections.into_iter().filter(|(_, html)| !html.is_empty()).collect();
    for (title, _) in &sections {
        let _ = write!(out, "<li><a href=\"#{}\">{}</a></li>", anchor(title), escape(title));
    }
    let _ = writeln!(
        out,
        "</ul><details><summary>All figures</summary><ol>{}</ol></details></nav>\n\
         <noscript><p class=\"warning\">The figures need JavaScript; the numbers are in the results table and the files beside this page.</p></noscript>",
        figures.list()
    );
    for (title, html) in &sections {
        let _ = writeln!(out, "<h2 id=\"{}\">{}</h2>\n{html}", anchor(title), escape(title));
    }
    out.push_str(&notes::provenance(campaign, fmu, results));
    let _ = write!(
        out,
        "</main>\n<script type=\"application/json\" id=\"figures\">{}</script>\n\
         <script>\n/* {} */\n{}</script>\n<script>\n{}</script>\n</body>\n</html>\n",
        figures.json(),
        include_str!("plotly/LICENSE").replace("*/", "* /"),
        include_str!("plotly/plotly-cartesian.min.js"),
        include_str!("report.js"),
    );
    out
}

/// An element's name in a link.
fn anchor(title: &str) -> String {
    title.to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), "-")
}

/// Titles and contents of the sections on runs of the bench; empty ones are left out.
fn bench_sections<'a>(
    page: &Page,
    campaign: &Campaign,
    results: &Results,
    figures: &mut Figures,
) -> Vec<(&'a str, String)> {
    let (groups, plan) = (&page.groups, page.plan);
    let random = plan.is_random();
    let has_response = groups.iter().any(|group| group.band().is_some());
    let swept = groups.iter().any(|group| group.sweep.is_some());
    let axis = page.axis.as_ref();
    let few = &groups[..groups.len().min(MOST_GROUPS)];
    let mut sections: Vec<(&str, String)> = Vec::new();
    let mut add = |all: Vec<Figure>| all.into_iter().map(|f| figures.add(f)).collect::<String>();

    // the plan's question first
    let mut first = Vec::new();
    if random && has_response {
        first.extend(groups.iter().flat_map(|group| draws::draws(page, group)));
    } else if let (Some(axis), true) = (axis, has_response) {
        first.push(along::extrema(page, axis));
    } else if let (Some(axis), false) =
        (axis, groups.iter().all(|g| manoeuvre(g.runs[0]).is_none()))
    {
        first.push(along::left_behind(page, axis));
        first.push(histories::after(page));
    } else if let Some(axis) = axis {
        first.push(along::slosh_angles(page, axis));
    } else if results.outcomes.len() > 1 {
        first.push(histories::compared(page));
    }
    sections.push((if random { "What decides" } else { "In short" }, add(first)));
    let histories =
        |few: &[Group]| few.iter().map(|group| histories::history(page, group)).collect::<Vec<_>>();
    if has_response {
        let responses = few.iter().filter(|g| g.band().is_some());
        let mut all: Vec<Figure> = responses.map(|g| responses::responses(page, g)).collect();
        if axis.is_some() {
            all.extend(responses::models(page));
        }
        sections.push(("Frequency responses", add(all)));
    }
    sections.push(("Time histories", add(histories(few))));
    if !random {
        let paths = few.iter().flat_map(|group| histories::paths(page, group));
        sections.push(("Rotary slosh", add(paths.collect())));
    }
    if let Some(axis) = axis {
        let title = "Against what is varied";
        let mut all = Vec::new();
        if has_response {
            all.push(along::features(page, axis));
        }
        all.push(along::bearing_and_liquid(page, axis));
        if has_response {
            all.push(along::linear_fit(page, axis));
        }
        if swept {
            all.push(along::out_of_the_plane(page, axis));
        }
        sections.push((title, add(all)));
        if swept && groups.iter().any(|group| group.runs.len() > 2) {
            let maps = few.iter().map(|group| responses::maps(group, axis)).collect();
            sections.push(("Over the frequency", add(maps)));
        }
    }
    if let Some(other) = &campaign.compare {
        sections.push((
            "Comparison of two campaigns",
            compare::compare(other, page, results, &mut add),
        ));
    }
    let thesis = groups.iter().all(|group| group.band() == Some(BAND));
    if thesis && axis.is_some_and(|axis| axis.name == "torque amplitude") {
        sections.push(("Comparison with the thesis", thesis::statements(groups)));
    }
    sections.push(("Results table", notes::table(page, results)));
    if swept {
        sections.push(("Methods", notes::estimators(groups)));
    }
    sections
}

/// Sections on runs of another FMU.
fn general_sections<'a>(
    fmu: &Fmu,
    results: &Results,
    figures: &mut Figures,
) -> Vec<(&'a str, String)> {
    let mut out = String::new();
    for run in results.unanalysed.iter().take(MOST_GROUPS) {
        for figure in general::run(fmu, &run.case.name, &run.history, &run.tail) {
            out.push_str(&figures.add(figure));
        }
    }
    if results.unanalysed.len() > MOST_GROUPS {
        let _ = write!(out, "<p>The first {MOST_GROUPS} of {} runs.</p>", results.unanalysed.len());
    }
    vec![("Time histories", out)]
}

fn introduction(page: &Page, fmu: &Fmu, results: &Results) -> String {
    let plan = page.plan;
    let first = results.outcomes.first().map(|run| &run.case);
    let first = first.or_else(|| results.unanalysed.first().map(|run| &run.case));
    let count = results.outcomes.len() + results.unanalysed.len();
    let mut out = format!(
        "<h1>{}</h1>\n<p class=\"lead\">{} of the FMU {} (version {}), sampled at {} Hz: {}.</p>\n",
        escape(if plan.title.is_empty() { "A campaign" } else { &plan.title }),
        runs(count),
        escape(&fmu.description().model_name),
        escape(&fmu.description().version),
        first.map_or(0.0, |case| thousandths(1e3 / case.step) / 1e6),
        escape(&torques(results)),
    );
    if !results.failures.is_empty() {
        let _ = write!(
            out,
            "<div class=\"failed\"><p><b>{} failed:</b></p><ul>",
            runs(results.failures.len())
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
    let beyond: Vec<String> = results
        .outcomes
        .iter()
        .filter_map(|run| Some(format!("{} ({})", run.case.name, run.beyond_model()?)))
        .collect();
    if let Some(one) = beyond.first() {
        let _ = writeln!(
            out,
            "<p class=\"warning\"><b>{} of {} left the range of {} model</b>{} {}. Computed faithfully, but not what a tank does. The results table marks it.</p>",
            beyond.len(),
            runs(count),
            if beyond.len() == 1 { "its" } else { "their" },
            if beyond.len() == 1 { ":" } else { ", such as" },
            escape(one)
        );
    }
    out.push_str("<div class=\"cards\">");
    let groups = page.groups.iter().filter(|group| group.band().is_some());
    for group in groups.take(2 * MOST_GROUPS) {
        let over = |get: &dyn Fn(&Features) -> Option<f64>| {
            let found = group.runs.iter().filter_map(|run| get(&best(run)?.0.features));
            let values: Vec<f64> = found.collect();
            let ends = values
                .iter()
                .copied()
                .reduce(f64::min)
                .zip(values.iter().copied().reduce(f64::max));
            match ends {
                Some((low, high)) if high - low < 2e-5 * high => format!("{low:.4} Hz"),
                Some((low, high)) => format!("{}–{} Hz", digits(low, high), digits(high, low)),
                None => {
                    let doubt = group.runs.iter().find_map(|run| best(run)?.0.doubt);
                    doubt.map_or("none".into(), |doubt| format!("not to be trusted: {doubt}"))
                }
            }
        };
        let [antiresonance, resonance] = [over(&|f| f.f_dip), over(&|f| f.f_res)];
        let exact = group.exact[0].f_dip.zip(group.exact[0].f_res);
        let exact =
            exact.filter(|_| page.axis.as_ref().is_none_or(|a| a.name == "torque amplitude"));
        let _ = write!(
            out,
            "<div class=\"card\"><b>{antiresonance}</b><b>{resonance}</b><span>antiresonance and resonance ({}), {}{}</span></div>",
            best(group.runs[0]).map_or("", |(_, name)| name),
            escape(&group.title()),
            exact.filter(|_| !plan.is_random()).map_or(
                String::new(),
                |(antiresonance, resonance)| format!(
                    " (exact, linear: {antiresonance:.4} and {resonance:.4} Hz)"
                )
            ),
        );
    }
    out.push_str("</div>\n");
    out
}

/// A frequency with the digits that tell it from another.
fn digits(value: f64, other: f64) -> String {
    let places = (1.5 - (value - other).abs().max(1e-6).log10()).ceil().clamp(3.0, 4.0) as usize;
    format!("{value:.places$}")
}

/// The profiles of the runs, without what is varied along them.
fn torques(results: &Results) -> String {
    let analysed = results.outcomes.iter().map(|run| &run.case);
    let cases = analysed.chain(results.unanalysed.iter().map(|run| &run.case));
    let mut profiles: Vec<&str> = cases.map(|case| case.profile.as_str()).collect();
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

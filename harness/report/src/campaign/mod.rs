//! Writes `report.html`, one self-contained page about a campaign.

mod chapter;
mod colors;
mod figure;
mod general;
mod histories;
mod notes;
mod over_axis;
mod page;
mod recordings;
mod responses;
mod result;
mod thesis;

use analysis::BAND;
use analysis::features::Features;
use experiments::campaign::{Campaign, Outcome, Results};
use experiments::rounding::thousandths;
use host::fmu::Fmu;
use maud::{DOCTYPE, Markup, PreEscaped, html};

pub use self::chapter::{Chapter, Illustration};
use self::figure::{Figure, Figures};
pub(crate) use self::page::printed;
use self::page::{Group, Page, Varied, axis, best, groups, manoeuvre, runs};

pub(crate) static PLOTLY: &str = include_str!("plotly/plotly-cartesian.min.js");

pub(crate) static PLOTLY_LICENSE: &str = include_str!("plotly/LICENSE");

/// Largest number of groups of runs with figures of their own. The page names the groups whose
/// figures are left out.
const MOST_GROUPS: usize = 24;

const MOST_RUNS: usize = 6;

/// Returns the run that the report shows in 3-D: the run with the largest radial slosh angle, which is large only in
/// rotary slosh. If no run has a radial slosh angle, it is the run with the largest slosh angle. Recordings are left
/// out, because they do not contain the motion of the liquid.
pub fn most_swirling_run(results: &Results) -> Option<&Outcome> {
    let simulated = results.outcomes.iter().filter(|run| !run.is_recording());
    let (radial, tangential) =
        (|run: &Outcome| run.totals.peak_radial_angle, |run: &Outcome| run.totals.peak_slosh_angle);
    let largest = |angle: fn(&Outcome) -> f64| {
        simulated
            .clone()
            .filter(|run| angle(run) > 0.0)
            .max_by(|a, b| angle(a).total_cmp(&angle(b)))
    };
    largest(radial).or_else(|| largest(tangential))
}

/// Returns the report of a campaign as HTML. `view` is the file of the separate page that shows a run;
/// `chapters` come before the sections about the runs.
pub fn page(
    campaign: &Campaign,
    fmu: &Fmu,
    results: &Results,
    view: Option<(&str, &Outcome)>,
    chapters: Vec<Chapter>,
) -> String {
    let has_chapters = !chapters.is_empty();
    let plan = &campaign.plan;
    let page = data(campaign, fmu, results);
    let axis = page.axis.as_ref().map(|axis| axis.name.as_str());
    let of_the_thesis = axis == Some("torque amplitude") || has_chapters;
    let mut figures = Figures::new(of_the_thesis);
    let mut sections: Vec<(String, Markup)> =
        chapters.into_iter().map(|chapter| chapter.section(&mut figures)).collect();
    let of_runs = match results.unanalysed.is_empty() {
        true => bench_sections(&page, results, &mut figures),
        false => general_sections(fmu, results, &mut figures),
    };
    sections.extend(of_runs.into_iter().map(|(title, content)| (title.to_string(), content)));
    sections.retain(|(_, content)| !content.0.is_empty());
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "HubSlosh: " (plan.title) }
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                main {
                    (introduction(&page, fmu, results))
                    @if let Some((file, run)) = view { (link(file, run)) }
                    nav aria-label="Contents" {
                        b { "Contents" }
                        ul {
                            @for (title, _) in &sections {
                                li { a href={ "#" (anchor(title)) } { (title) } }
                            }
                        }
                        details { summary { "All figures" } ol { (figures.table_of_figures()) } }
                    }
                    noscript {
                        p .warning { "The figures need JavaScript; the numbers are in the results table and in the files in the folder of this page." }
                    }
                    @for (title, content) in &sections {
                        h2 id=(anchor(title)) { (title) }
                        (content)
                    }
                    (notes::provenance(campaign, fmu, results, has_chapters))
                }
                script type="application/json" id="figures" { (PreEscaped(figures.json())) }
                script {
                    (PreEscaped(format!("/* {} */\n", PLOTLY_LICENSE.replace("*/", "* /"))))
                    (PreEscaped(PLOTLY))
                }
                script { (PreEscaped(include_str!("report.js"))) }
            }
        }
    };
    page.into_string()
}

fn data<'a>(campaign: &'a Campaign, fmu: &Fmu, results: &'a Results) -> Page<'a> {
    let plan = &campaign.plan;
    Page {
        plan,
        groups: groups(plan, fmu, results),
        axis: axis(plan, fmu, &results.outcomes),
        varied: plan.varied().iter().map(|n| Varied::new(n, fmu, &results.outcomes)).collect(),
    }
}

fn repeats_the_thesis(page: &Page) -> bool {
    let band = !page.groups.is_empty() && page.groups.iter().all(|g| g.band() == Some(BAND));
    band && page.axis.as_ref().is_some_and(|axis| axis.name == "torque amplitude")
}

fn anchor(title: &str) -> String {
    title.to_lowercase().replace(|c: char| !c.is_ascii_alphanumeric(), "-")
}

fn bench_sections<'a>(
    page: &Page,
    results: &Results,
    figures: &mut Figures,
) -> Vec<(&'a str, Markup)> {
    let groups = &page.groups;
    let has_response = groups.iter().any(|group| group.band().is_some());
    let swept = groups.iter().any(|group| group.sweep.is_some());
    let axis = page.axis.as_ref();
    let few: Vec<&Group> =
        groups.iter().filter(|group| !group.drawn.is_empty()).take(MOST_GROUPS).collect();
    let mut sections: Vec<(&str, Markup)> = Vec::new();
    let mut add = |all: Vec<Figure>| html! { @for figure in all { (figures.add(figure)) } };

    // The answer to the question of the plan comes first.
    let mut first = Vec::new();
    if let (Some(axis), true) = (axis, has_response) {
        first.push(over_axis::extrema(page, axis));
    } else if let (Some(axis), false) =
        (axis, groups.iter().all(|g| manoeuvre(g.runs[0]).is_none()))
    {
        first.push(over_axis::residual_motion(page, axis));
        first.push(histories::motion_after_manoeuvre(page));
    } else if let Some(axis) = axis {
        first.push(over_axis::slosh_angles(page, axis));
    } else if results.outcomes.len() > 1 {
        first.push(histories::compared(page));
    }
    sections.push(("In short", add(first)));
    let histories = |few: &[&Group]| {
        few.iter().map(|group| histories::history(page, group)).collect::<Vec<_>>()
    };
    if has_response {
        let responses = few.iter().filter(|g| g.band().is_some());
        let mut all: Vec<Figure> = responses.map(|g| responses::responses(page, g)).collect();
        if axis.is_some() || results.outcomes.iter().any(|run| run.is_recording()) {
            all.extend(responses::models(page));
        }
        let recorded = few.iter().filter(|group| group.runs[0].is_recording());
        all.extend(recorded.map(|group| responses::fitted(page, group)));
        sections.push(("Frequency responses", add(all)));
    }
    sections.push(("Comparison of models with recordings", recordings::comparison_table(results)));
    sections.push(("Time histories", add(histories(&few))));
    let paths = few.iter().flat_map(|group| histories::paths(page, group));
    sections.push(("Rotary slosh", add(paths.collect())));
    if let Some(axis) = axis {
        let title = "Against what is varied";
        let mut all = Vec::new();
        if has_response {
            all.push(over_axis::features(page, axis));
        }
        all.push(over_axis::bearing_and_liquid(page, axis));
        if has_response {
            all.push(over_axis::linear_fit(page, axis));
        }
        if swept {
            all.push(over_axis::cross_axis(page, axis));
            all.push(over_axis::out_of_the_plane(page, axis));
        }
        sections.push((title, add(all)));
        if swept && groups.iter().any(|group| group.runs.len() > 2) {
            let maps = few.iter().map(|group| responses::maps(group, axis)).collect();
            sections.push(("Over the frequency", add(maps)));
        }
    }
    if repeats_the_thesis(page) {
        sections.push(("Comparison with the thesis", thesis::numbers(groups)));
    }
    sections.push(("Results table", notes::table(page, results)));
    if swept {
        sections.push(("Methods", notes::estimators(groups)));
    }
    sections
}

fn general_sections<'a>(
    fmu: &Fmu,
    results: &Results,
    figures: &mut Figures,
) -> Vec<(&'a str, Markup)> {
    let runs = &results.unanalysed;
    let drawn = runs.iter().filter(|run| !run.history.time.is_empty());
    let content = html! {
        @for run in drawn.take(MOST_RUNS) {
            @for figure in general::run(fmu, &run.case.name, &run.history, &run.tail) {
                (figures.add(figure))
            }
        }
        @if runs.len() > MOST_RUNS {
            p {
                @if runs.iter().all(|run| !run.history.time.is_empty()) { "The first " }
                (MOST_RUNS) " of " (runs.len()) " runs."
            }
        }
    };
    vec![("Time histories", content)]
}

fn introduction(page: &Page, fmu: &Fmu, results: &Results) -> Markup {
    let plan = page.plan;
    let first = results.outcomes.first().map(|run| &run.case);
    let first = first.or_else(|| results.unanalysed.first().map(|run| &run.case));
    let count = results.outcomes.len() + results.unanalysed.len();
    let rate = first.map_or(0.0, |case| thousandths(1e3 / case.step) / 1e6);
    let (fmu, failures) = (fmu.description(), &results.failures);
    let beyond: Vec<String> =
        results.beyond_model().map(|(case, how)| format!("{} ({how})", case.name)).collect();
    let groups = page.groups.iter().filter(|group| group.band().is_some());
    let result = result::sentence(page, results);
    let recorded = results.recordings();
    let drawn = results.outcomes.iter().filter(|run| run.has_curves()).count();
    html! {
        h1 { @if plan.title.is_empty() { "A campaign" } @else { (plan.title) } }
        @if !result.is_empty() { p .result { (result) } }
        p .lead {
            @if recorded > 0 {
                (recorded) " recording" @if recorded > 1 { "s" } ", compared with "
            }
            (runs(count - recorded)) " of the FMU " (fmu.model_name) " (version " (fmu.version)
            "), sampled at " (rate) " Hz: " (torques(results)) "."
        }
        @if drawn < results.outcomes.len() {
            p {
                "Responses and time histories are drawn of " (drawn) " of the "
                (runs(results.outcomes.len())) ". Figures of numbers and the CSV tables have all of them."
            }
        }
        @if let Some(one) = page.groups.get(MOST_GROUPS) {
            p {
                "Only the first " (MOST_GROUPS) " of " (page.groups.len())
                " groups of runs have figures of their own; none from " (one.title())
                " on. The results table has all runs."
            }
        }
        div .cards { @for group in groups.take(MOST_GROUPS) { (card(page, group)) } }
        @if !failures.is_empty() {
            div .failed {
                p { b { (runs(failures.len())) " failed:" } }
                ul {
                    @for failure in failures {
                        li { code { (failure.case.name) } ": " (failure.reason) }
                    }
                }
            }
        }
        @if let Some(one) = beyond.first() {
            p .warning {
                b {
                    (beyond.len()) " of " (runs(count)) " left the range of "
                    @if beyond.len() == 1 { "its" } @else { "their" } " model"
                }
                @if beyond.len() == 1 { ": " } @else { ", such as " }
                (one) ". While a run is out of range, its results are numerically correct but do not represent a real tank. "
                @if results.unanalysed.is_empty() { "The results table marks them." }
                @else { "In runs.csv the column beyond_model says how each run did." }
            }
        }
    }
}

fn link(file: &str, run: &Outcome) -> Markup {
    let radial = run.totals.peak_radial_angle;
    let degrees = |angle: f64| format!("{:.1}°", angle.to_degrees());
    html! {
        p {
            a href=(file) { b { "See a run move: " (run.case.name) } }
            @if radial > 0.0 {
                ". Of all runs, its liquid has the largest slosh angle across the plane of the hub's motion, "
                (degrees(radial)) "."
            } @else {
                ". Of all runs, its liquid has the largest slosh angle, " (degrees(run.totals.peak_slosh_angle)) "."
            }
            " A page of any other run: " code { "hubslosh view runs/NAME.parquet" } "."
        }
    }
}

fn card(page: &Page, group: &Group) -> Markup {
    let over = |get: &dyn Fn(&Features) -> Option<f64>| {
        let found = group.runs.iter().filter_map(|run| get(&best(run)?.0.features));
        let values: Vec<f64> = found.collect();
        let ends =
            values.iter().copied().reduce(f64::min).zip(values.iter().copied().reduce(f64::max));
        match ends {
            Some((low, high)) if high - low < 2e-5 * high => format!("{low:.4} Hz"),
            Some((low, high)) => {
                format!("{}–{} Hz", format_distinct(low, high), format_distinct(high, low))
            }
            None => {
                let doubt = group.runs.iter().find_map(|run| best(run)?.0.doubt);
                doubt.map_or("none".into(), |doubt| format!("not valid: {doubt}"))
            }
        }
    };
    let exact = group.exact[0].f_dip.zip(group.exact[0].f_res);
    let one_response = page.axis.as_ref().is_none_or(|axis| axis.name == "torque amplitude");
    let exact = exact.filter(|_| one_response);
    html! {
        div .card {
            b { (over(&|f| f.f_dip)) }
            b { (over(&|f| f.f_res)) }
            span {
                "antiresonance and resonance (" (best(group.runs[0]).map_or("", |(_, name)| name))
                "), " (group.title())
                @if let Some((antiresonance, resonance)) = exact {
                    " (exact, linear: " (format!("{antiresonance:.4}")) " and "
                    (format!("{resonance:.4}")) " Hz)"
                }
            }
        }
    }
}

fn format_distinct(value: f64, other: f64) -> String {
    let places = (1.5 - (value - other).abs().max(1e-6).log10()).ceil().clamp(3.0, 4.0) as usize;
    format!("{value:.places$}")
}

fn torques(results: &Results) -> String {
    let analysed = results.outcomes.iter().map(|run| &run.case);
    let cases = analysed.chain(results.unanalysed.iter().map(|run| &run.case));
    let mut profiles: Vec<&str> = cases.map(|case| case.profile.as_str()).collect();
    profiles.sort_unstable();
    profiles.dedup();
    match profiles[..] {
        [] => "none".into(),
        [one] => one.into(),
        // Of several profiles, the name and the parameters that all have in common are shown.
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

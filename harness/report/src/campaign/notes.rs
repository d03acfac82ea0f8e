//! The text at the end of the page: methods, table of results, and provenance.

use std::f64::consts::TAU;

use analysis::features::Features;
use analysis::lengths::Lengths;
use analysis::{BAND, demodulation};
use experiments::campaign::{Campaign, Estimate, Results};
use experiments::plan::AMPLITUDE;
use experiments::rounding::thousandths;
use host::fmu::Fmu;
use maud::{Markup, PreEscaped, html};
use names::hubslosh::{slosh, tank};

use super::page::{Group, Page, Varied, cm, hertz, sweep};
use super::torques;

pub(super) fn estimators(groups: &[Group]) -> Markup {
    let run = &groups[0].runs[0];
    let duration = run.case.run().steps() as f64 * run.case.step;
    let band = groups[0].band().unwrap_or(BAND);
    let lag = Lengths::for_record(band, groups[0].sweep, duration, run.case.step).lag;
    let methods = format!(
        include_str!("methods.html"),
        cycles = demodulation::CYCLES,
        resolution = 1e3 / lag,
        lag = lag
    );
    let rows: String = groups.iter().filter_map(swept_row).map(Markup::into_string).collect();
    html! {
        (PreEscaped(methods))
        @if !rows.is_empty() {
            (PreEscaped(format!(include_str!("swept_resonance.html"), rows = rows)))
        }
    }
}

/// Describes how far the sweep shifts the resonance in the last run of a group. If the runs of the group
/// differ in torque, this run has the largest torque. Returns `None` without a resonance.
fn swept_row(group: &Group) -> Option<Markup> {
    let run = group.runs.last()?;
    let (mode, exact) = (run.linear.modes.first()?, group.exact.last()?.f_res?);
    let rate = sweep(run)?.rate_at(exact).abs();
    let swept = run.passing.as_ref().and_then(|passing| passing.rate.features.f_res);
    let whole = run.spa_features().f_res;
    swept.or(whole)?;
    let width = 2.0 * mode.damping * mode.frequency;
    let shift =
        |f: Option<f64>| f.map_or(String::new(), |f| format!("{:+.1} mHz", (f - exact) * 1e3));
    let decay = 1.0 / (TAU * mode.damping * mode.frequency);
    Some(html! {
        tr {
            td { code { (run.case.name) } }
            td { (format!("{exact:.4} Hz")) }
            td { (format!("{:.1} mHz", width * 1e3)) }
            td { (format!("{:.2} mHz/s", rate * 1e3)) }
            td { (format!("{:.1} s", width / rate)) }
            td { (format!("{decay:.1} s")) }
            td { (hertz(swept)) }
            td { (shift(swept)) }
            td { (hertz(whole)) }
            td { (shift(whole)) }
        }
    })
}

/// Largest number of rows in the table of results. A browser would need seconds to lay out a longer table.
const MOST_ROWS: usize = 2000;

pub(super) fn table(page: &Page, results: &Results) -> Markup {
    let others: Vec<usize> = page
        .plan
        .varied()
        .into_iter()
        .enumerate()
        .filter(|(_, name)| ![slosh::MODEL, tank::H, AMPLITUDE].contains(name))
        .map(|(place, _)| place)
        .collect();
    let head = |place: &usize| {
        let label = page.varied[*place].as_ref().map_or(String::new(), Varied::label);
        let lines: Vec<&str> = label.split(" / ").collect();
        html! { th { @for (i, line) in lines.iter().enumerate() { @if i > 0 { br; } (line) } } }
    };
    // Columns without a value in any run are left out.
    let swept = results.outcomes.iter().any(|run| run.passing.is_some());
    let recorded = results.outcomes.iter().any(|run| run.record.is_some());
    let all = results.outcomes.len();
    html! {
        @if all > MOST_ROWS {
            p {
                "The first " (MOST_ROWS) " of " (all) " runs. " code { "features.csv" } " holds all of them."
            }
        }
        div .wide {
            table {
                thead {
                    tr {
                        th colspan=(3 + others.len()) { "Run" }
                        @if swept { th colspan="4" { "While the sweep passes" } }
                        @if recorded { th colspan="4" { "Whole record (" code { "spa" } ")" } }
                        th colspan="7" { "The run itself" }
                    }
                    tr {
                        th { "model" } th { "fill" br; "cm" } th { "torque" br; "mN·m" }
                        @for place in &others { (head(place)) }
                        @for _ in 0..usize::from(swept) + usize::from(recorded) {
                            th { "antiresonance" br; "Hz" } th { "resonance" br; "Hz" }
                            th { "Δf" br; "mHz" } th { "notch" br; "dB" }
                        }
                        th { "largest slosh" br; "angle, deg" } th { "largest wave" br; "mm" }
                        th { "largest rate" br; "rad/s" } th { "largest" br; "acceleration" br; "rad/s²" }
                        th { "stiction" br; "s" } th { "energy" br; "residual" }
                        th { "range of" br; "the model" }
                    }
                }
                tbody {
                    @for run in results.outcomes.iter().take(MOST_ROWS) {
                        tr {
                            td { (run.range.model) }
                            td { @if let Some(fill) = run.range.fill { (cm(fill)) } }
                            td { @if let Some(a) = run.case.amplitude { (thousandths(a)) } }
                            @for place in &others {
                                @let scale = page.varied[*place].as_ref().map_or(1.0, |v| v.scale);
                                td { (shortened(&run.case.varied[*place], scale)) }
                            }
                            @if swept { (cells(run.passing.as_ref().map(|passing| &passing.rate))) }
                            @if recorded { (cells(run.record.as_ref().map(|record| &record.spa))) }
                            // most parameters of recordings are unknown
                            @let known = |text: String| if text == "NaN" { String::new() } else { text };
                            td { (known(format!("{:.1}", run.totals.peak_slosh_angle.to_degrees()))) }
                            td { (known(format!("{:.1}", run.totals.peak_wave_height * 1e3))) }
                            td { (format!("{:.3}", run.totals.peak_rate)) }
                            td { (format!("{:.3}", run.totals.peak_acceleration)) }
                            td { (known(format!("{:.3}", run.totals.stuck))) }
                            td { (known(format!("{:.1e}", run.totals.max_energy_residual))) }
                            td {
                                @match run.beyond_model() {
                                    Some(how) => span .warn title=(how) { "left" },
                                    None if run.is_recording() => "recorded",
                                    None => "within",
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn cells(estimate: Option<&Estimate>) -> Markup {
    let features = estimate.map_or(Features::default(), |estimate| estimate.features);
    let columns = [
        (features.f_dip, 4),
        (features.f_res, 4),
        (features.delta_f().map(|f| f * 1e3), 1),
        (features.notch_db, 2),
    ];
    html! {
        @for (value, digits) in columns {
            @match (value, estimate, estimate.and_then(|estimate| estimate.doubt)) {
                (Some(value), ..) => td { (format!("{value:.digits$}")) },
                (_, None, _) => td {},
                (_, _, Some(doubt)) => td .warn title=(doubt) { "?" },
                _ => td { "none" },
            }
        }
    }
}

/// Formats a number multiplied by `scale`. A number with more than six digits is
/// rounded to six digits. A text that is not a number is returned unchanged.
fn shortened(text: &str, scale: f64) -> String {
    match text.parse::<f64>() {
        Ok(value) if text.len() > 8 => format!("{:.5e}", value * scale),
        Ok(value) => ((value * scale * 1e9).round() / 1e9).to_string(),
        _ => text.to_string(),
    }
}

pub(super) fn provenance(
    campaign: &Campaign,
    fmu: &Fmu,
    results: &Results,
    has_chapters: bool,
) -> Markup {
    let description = fmu.description();
    let analysed = results.outcomes.first().map(|run| &run.case);
    let first = analysed.or_else(|| results.unanalysed.first().map(|run| &run.case));
    let plan = &campaign.plan;
    let settings: Vec<_> = plan.set().map(|(k, v)| format!("{k} = {v}")).collect();
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
    html! {
        h2 { "What was run" }
        dl {
            @for (name, value) in rows.iter().filter(|(_, value)| !value.is_empty()) {
                dt { (name) } dd { code { (value) } }
            }
        }
        p {
            "Each run is in " code { "runs/" } " as Parquet; the metadata of a file state the FMU, the parameters and the torque of the run. " code { "features.csv" } " has the columns of the table above for every run; " code { "features_spa.csv" } " and " code { "features_h1.csv" } " have the same columns by the other estimators. " code { "runs.csv" } " has all features and everything that was varied, and " code { "plan.toml" } " has the plan. This command reproduces " @if has_chapters { "the tables and the figures on runs:" } @else { "everything here:" }
        }
        p { code { (campaign.command(fmu)) } }
    }
}

use experiments::campaign::{Outcome, Results};
use maud::{Markup, html};

use super::page::{best, cm, distinct};
use experiments::rounding::thousandths;

type Value = (f64, Option<f64>);

/// A number, such as the resonance, in which a model is compared with the recording. `value` reads the number and its
/// standard deviation from a run; it is shown with `digits` digits. `difference` describes how model minus recording
/// is shown: factor, digits and unit.
struct Feature {
    heading: [&'static str; 2],
    value: fn(&Outcome) -> Option<Value>,
    digits: usize,
    difference: (f64, usize, &'static str),
}

const fn feature(
    heading: [&'static str; 2],
    digits: usize,
    difference: (f64, usize, &'static str),
    value: fn(&Outcome) -> Option<Value>,
) -> Feature {
    Feature { heading, value, digits, difference }
}

const FEATURES: [Feature; 9] = [
    feature(["antiresonance", "Hz"], 4, (1e3, 1, "mHz"), |run| {
        let (estimate, _) = best(run)?;
        Some((estimate.features.f_dip?, estimate.deviations.f_dip))
    }),
    feature(["resonance", "Hz"], 4, (1e3, 1, "mHz"), |run| {
        let (estimate, _) = best(run)?;
        Some((estimate.features.f_res?, estimate.deviations.f_res))
    }),
    feature(["notch", "dB"], 2, (1.0, 2, "dB"), |run| exact(best(run)?.0.features.notch_db)),
    feature(["fit in", "frequency %"], 1, (1.0, 1, "%"), |run| {
        exact(Some(run.fit()?.fit_frequency))
    }),
    feature(["fit in", "time %"], 1, (1.0, 1, "%"), |run| exact(Some(run.fit()?.fit_time))),
    feature(["residual", "coherence"], 2, (1.0, 2, ""), |run| exact(run.fit()?.coherence)),
    feature(["SNR at", "resonance dB"], 0, (1.0, 0, "dB"), |run| {
        exact(Some(run.record.as_ref()?.snr_db?[0]))
    }),
    feature(["CEF,", "median"], 4, (1.0, 4, ""), |run| recorded(run, run.off_axis()?.median)),
    feature(["leakage,", "rms"], 4, (1.0, 4, ""), |run| recorded(run, run.off_axis()?.leakage)),
];

fn exact(value: Option<f64>) -> Option<Value> {
    Some((value?, None))
}

fn recorded(run: &Outcome, value: f64) -> Option<Value> {
    exact(Some(value)).filter(|_| run.is_recording())
}

fn same_run(a: &Outcome, b: &Outcome) -> bool {
    let close = |a: Option<f64>, b: Option<f64>| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() < 1e-9,
        (a, b) => a == b,
    };
    close(a.case.amplitude, b.case.amplitude) && close(a.case.fill, b.case.fill)
}

pub(super) fn result(results: &Results) -> String {
    let (recorded, simulated): (Vec<&Outcome>, Vec<&Outcome>) =
        results.outcomes.iter().partition(|run| run.is_recording());
    let models = distinct(simulated.iter().map(|run| run.range.model.as_str()));
    let off = |model: &str, feature: &Feature| {
        let value = |run: &Outcome| Some((feature.value)(run)?.0);
        let pairs = recorded.iter().flat_map(|there| {
            let same =
                simulated.iter().filter(|run| run.range.model == model && same_run(run, there));
            same.filter_map(|run| Some(1e3 * (value(run)? - value(there)?)))
        });
        pairs.reduce(|most, off| if off.abs() > most.abs() { off } else { most })
    };
    let sentences = models.iter().filter_map(|model| {
        let [antiresonance, resonance] = [off(model, &FEATURES[0])?, off(model, &FEATURES[1])?];
        let text = format!(
            "With the {model} model the antiresonance is off the recordings' by {antiresonance:+.1} mHz at most, the \
             resonance by {resonance:+.1} mHz."
        );
        Some(text.replace('-', "\u{2212}"))
    });
    sentences.collect::<Vec<_>>().join(" ")
}

pub(super) fn comparison_table(results: &Results) -> Markup {
    let (recorded, simulated): (Vec<&Outcome>, Vec<&Outcome>) =
        results.outcomes.iter().partition(|run| run.is_recording());
    if recorded.is_empty() {
        return html! {};
    }
    html! {
        p {
            "For each recording the table contains the results of the estimators, and below them the differences of the models' runs with the same torque and fill. ✓: within the joint 95 % interval of both estimates. This interval leaves out the uncertainty of the models' parameters, which matters most for the resonance in rotary slosh. CEF and leakage are computed from the recording's rates about the other axes (thesis 6.3.6), which a hub that cannot tilt does not have."
        }
        div .wide {
            table {
                thead {
                    tr {
                        th { "run" } th { "fill" br; "cm" } th { "torque" br; "mN·m" }
                        @for feature in FEATURES { th { (feature.heading[0]) br; (feature.heading[1]) } }
                    }
                }
                tbody {
                    @for recording in recorded {
                        tr {
                            td { b { "recording" } }
                            td { @if let Some(fill) = recording.range.fill { (cm(fill)) } }
                            td { @if let Some(a) = recording.case.amplitude { (thousandths(a)) } }
                            @for feature in FEATURES { td { (value(&feature, recording)) } }
                        }
                        @for run in simulated.iter().filter(|run| same_run(run, recording)) {
                            tr {
                                td { (run.range.model) } td {} td {}
                                @for feature in FEATURES { td { (difference(&feature, run, recording)) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn value(feature: &Feature, run: &Outcome) -> String {
    let digits = feature.digits;
    let Some((value, std)) = (feature.value)(run) else { return String::new() };
    let (factor, places, unit) = feature.difference;
    match std {
        Some(std) => format!("{value:.digits$} ± {:.places$} {unit}", 1.96 * std * factor),
        None => format!("{value:.digits$}"),
    }
}

/// Formats the difference between the values of a model and of the recording. A ✓ marks a difference within
/// the joint 95 % interval.
fn difference(feature: &Feature, run: &Outcome, recording: &Outcome) -> String {
    let Some(((model, a), (there, b))) = (feature.value)(run).zip((feature.value)(recording))
    else {
        return String::new();
    };
    let (factor, places, unit) = feature.difference;
    // a rounded −0.0 becomes 0.0 by adding 0
    let unit_of_last = 10f64.powi(places as i32);
    let rounded = ((model - there) * factor * unit_of_last).round() / unit_of_last + 0.0;
    let text = format!("{rounded:+.places$} {unit}").replace('-', "\u{2212}");
    let within = a.zip(b).is_some_and(|(a, b)| (model - there).abs() < 1.96 * a.hypot(b));
    format!("{}{}", text.trim_end(), if within { " ✓" } else { "" })
}

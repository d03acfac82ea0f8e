//! The text at the end: methods, results table, and what was run.

use std::f64::consts::TAU;

use analysis::features::Features;
use analysis::lengths::Lengths;
use analysis::{BAND, demodulation};
use experiments::campaign::{Campaign, Estimate, Results};
use experiments::rounding::thousandths;
use host::fmu::Fmu;
use maud::{Markup, html};

use super::page::{Group, Page, Varied, cm, hertz, sweep};
use super::torques;

pub(super) fn estimators(groups: &[Group]) -> Markup {
    let run = &groups[0].runs[0];
    let duration = run.case.run().steps() as f64 * run.case.step;
    let band = groups[0].band().unwrap_or(BAND);
    let lag = Lengths::of(band, groups[0].sweep, duration, run.case.step).lag;
    let rows: Vec<Markup> = groups.iter().filter_map(swept_row).collect();
    html! {
        p {
            b { "Demodulation" } " (solid, in " code { "features.csv" } "). Torque and rate are multiplied by e" sup { "−jφ(t)" } ", φ being the sweep's own known phase, and averaged over a Hann window of " (demodulation::CYCLES) " cycles (fewer if the sweep is fast, at least 3) that slides with the sweep. Their ratio is the response the moment the sweep passes that frequency: what a lock-in amplifier would show. Both signals see the same window, so its effect on amplitude and phase cancels; harmonics that the bearing makes average out."
        }
        p {
            b { code { "spa" } } " (dashed). MATLAB's Blackman–Tukey estimate, which the thesis used: covariances of the whole record up to a lag of " (format!("{lag:.0}")) " s, Hann lag window, Fourier transform, ratio of cross spectrum to input spectrum. It resolves about " (format!("{:.2}", 1e3 / lag)) " mHz, which fills a narrow antiresonance a little."
        }
        p {
            b { "Welch, H1." } " Eight half-overlapping Hamming segments, averaged cross spectrum over averaged input spectrum: what most tools call the transfer function of two records."
        }
        p {
            b { "Transfer function." } " Where none of these resolves antiresonance and resonance: three poles and two zeros, fitted to the spectra of the whole record together with what its ends leave in them; exact for a linear plant, however short the record."
        }
        p {
            b { "What is trusted." } " The response of the passing sweep, unless the sweep shifts the resonance by more than a quarter of the separation (0.6 √rate); then " code { "spa" } ", if the separation is three times what it resolves and the signal-to-noise ratio at the resonance is above 1; then the transfer function, if it leaves less than 30 % of the rate. Where these two, after a fast sweep, differ by more than a quarter of the separation, neither is: the liquid then rings at a frequency that follows its amplitude, and no single linear response describes the record. Else there is no number. " code { "estimator" } " and " code { "not_trusted" } " in the tables say which."
        }
        p {
            b { "Uncertainty." } " What of the rate no linear response explains is estimated by the local rational method: around each line of the whole record's spectra a rational function of the torque's spectrum and a polynomial for the record's ends are fitted, and what is left is gyro noise, dry friction and nonlinear slosh. From its power spectral density Φ" sub { "v" } " follow the standard deviations of |H|, √(Φ" sub { "v" } "/(2nΦ" sub { "uu" } ")) over n averaged lines, and of an extremum of ln |H|, that of its slope over its curvature. Intervals are two standard deviations to either side. A shift that the sweep itself makes (below) is not in them."
        }
        p {
            b { "Features." } " Antiresonance and resonance are the two ends of the largest rise of |H| as the frequency grows, within the sweep's band, refined by a parabola through three points of log |H|; Δf is their separation, the notch depth their difference in dB. For a bench with little damping they are the smallest and the largest |H| in the band, as in the thesis; with strong damping the largest |H| is the band's lower edge, not the slosh resonance, and the ripple behind the resonance may go deeper than the antiresonance."
        }
        p {
            b { "Fit." } " Three poles, two zeros, least squares on the complex " code { "spa" } " response. In time it is driven with the run's torque from the initial state that fits best, as MATLAB's " code { "compare" } " does: the band says little of a slow real pole, and from rest such a pole would keep the offset of the first half cycle for the whole run."
        }
        p {
            b { "Energy residual." } " Largest |E(t) − E(0) − work + heat| of a run over the energy throughput, Σ|Δwork| + heat. It checks the FMU's energy balance at every sample."
        }
        @if !rows.is_empty() {
            h3 { "Why the swept resonance lies above the exact one" }
            p {
                "The sweep is not slow enough for the liquid. Bare-wall damping makes the resonance so narrow that the sweep crosses its half-power width in less time than the slosh needs to decay: the oscillation is still growing when its best frequency has gone by, so an upward sweep sees the largest rate later, at a higher frequency, and a little lower than it would be in a dwell. The ripple behind the resonance is the beat between that ringing and the torque that has moved on. A bench that sweeps at this rate and reads the envelope sees the same shift; it belongs to the experiment, not to the plant."
            }
            div .wide {
                table {
                    thead {
                        tr {
                            th { "run" } th { "exact" br; "resonance" } th { "half-power" br; "width 2ζf" }
                            th { "sweep rate" br; "there" } th { "time to" br; "cross" }
                            th { "slosh decays" br; "in 1/(2πζf)" } th { "swept" br; "resonance" }
                            th { "its" br; "shift" } th { code { "spa" } br; "resonance" }
                            th { "its" br; "shift" }
                        }
                    }
                    tbody { @for row in &rows { (row) } }
                }
            }
            p {
                "The second estimator is the proof. For a linear plant the ratio of whole-record spectra is the frequency response however fast the input swept, because the ringing after the resonance is in the record too; and there the shift is gone. The antiresonance hardly moves in either: there the hub stands nearly still, so there is little that could ring; only at the smallest torques, where the bearing sticks near the antiresonance, does the sweep see it a few mHz late. When runs of a nonlinear model are compared, both views count: demodulation says what happened at that moment, " code { "spa" } " gives the best linear summary of the whole."
            }
        }
    }
}

/// Describes the shift by the sweep of the last run of a group (the largest torque, if torques differ).
/// Returns `None` without a resonance.
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

pub(super) fn table(page: &Page, results: &Results) -> Markup {
    let others: Vec<usize> = page
        .plan
        .varied()
        .into_iter()
        .enumerate()
        .filter(|(_, name)| !["slosh.model", "tank.h", "profile.amplitude"].contains(name))
        .map(|(place, _)| place)
        .collect();
    let head = |place: &usize| {
        let label = page.varied[*place].as_ref().map_or(String::new(), Varied::label);
        let lines: Vec<&str> = label.split(" / ").collect();
        html! { th { @for (i, line) in lines.iter().enumerate() { @if i > 0 { br; } (line) } } }
    };
    // columns that no run has
    let swept = results.outcomes.iter().any(|run| run.passing.is_some());
    let recorded = results.outcomes.iter().any(|run| run.record.is_some());
    html! {
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
                    @for run in &results.outcomes {
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
                            // of a recording most is unknown
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

/// Table cells for one estimate of a run's features.
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

/// A number times `scale`, a drawn one to six digits; any other text as it is.
fn shortened(text: &str, scale: f64) -> String {
    match text.parse::<f64>() {
        Ok(value) if text.len() > 8 => format!("{:.5e}", value * scale),
        Ok(value) => ((value * scale * 1e9).round() / 1e9).to_string(),
        _ => text.to_string(),
    }
}

pub(super) fn provenance(campaign: &Campaign, fmu: &Fmu, results: &Results) -> Markup {
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
            "Each run is in " code { "runs/" } " as Parquet, with what it was made from in its metadata. " code { "features.csv" } " holds the values of the table above, " code { "features_spa.csv" } " and " code { "features_h1.csv" } " those of the other estimators in the same columns, " code { "runs.csv" } " all of them with everything that was varied, " code { "plan.toml" } " the plan. This command reproduces everything here:"
        }
        p { code { (campaign.command(fmu)) } }
    }
}

//! The text at the end: methods, results table, and what was run.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use analysis::features::Features;
use analysis::lengths::Lengths;
use analysis::{BAND, demodulation};
use experiments::campaign::{Campaign, Doubt, Results};
use experiments::rounding::thousandths;
use host::fmi2::Fmu;
use host::html::escape;

use super::page::{Group, Page, Varied, cm, hertz, sweep};
use super::torques;

pub(super) fn estimators(groups: &[Group]) -> String {
    let run = &groups[0].runs[0];
    let duration = run.case.run().steps() as f64 * run.case.step;
    let band = groups[0].band().unwrap_or(BAND);
    let lag = Lengths::of(band, groups[0].sweep, duration, run.case.step).lag;
    let mut out = format!(
        "<p><b>Demodulation</b> (solid, in <code>features.csv</code>). Torque and rate are multiplied by e<sup>−jφ(t)</sup>, φ being the sweep's own known phase, and averaged over a Hann window of {cycles} cycles (fewer if the sweep is fast, at least 3) that slides with the sweep. Their ratio is the response the moment the sweep passes that frequency: what a lock-in amplifier would show. Both signals see the same window, so its effect on amplitude and phase cancels; harmonics that the bearing makes average out.</p>\n\
         <p><b><code>spa</code></b> (dashed). MATLAB's Blackman–Tukey estimate, which the thesis used: covariances of the whole record up to a lag of {lag:.0} s, Hann lag window, Fourier transform, ratio of cross spectrum to input spectrum. It resolves about {resolution:.2} mHz, which fills a narrow antiresonance a little.</p>\n\
         <p><b>Welch, H1.</b> Eight half-overlapping Hamming segments, averaged cross spectrum over averaged input spectrum: what most tools call the transfer function of two records.</p>\n\
         <p><b>Transfer function.</b> Where none of these resolves antiresonance and resonance: three poles and two zeros, fitted to the spectra of the whole record together with what its ends leave in them; exact for a linear plant, however short the record.</p>\n\
         <p><b>What is trusted.</b> The response of the passing sweep, unless the sweep shifts the resonance by more than a quarter of the separation (0.6 √rate); then <code>spa</code>, if the separation is three times what it resolves and the signal-to-noise ratio at the resonance is above 1; then the transfer function, if it leaves less than 30 % of the rate. Where these two, after a fast sweep, differ by more than a quarter of the separation, neither is: the liquid then rings at a frequency that follows its amplitude, and no single linear response describes the record. Else there is no number. <code>estimator</code> and <code>not_trusted</code> in the tables say which.</p>\n\
         <p><b>Uncertainty.</b> What of the rate no linear response explains is estimated by the local rational method: around each line of the whole record's spectra a rational function of the torque's spectrum and a polynomial for the record's ends are fitted, and what is left is gyro noise, dry friction and nonlinear slosh. From its power spectral density Φ<sub>v</sub> follow the standard deviations of |H|, √(Φ<sub>v</sub>/(2nΦ<sub>uu</sub>)) over n averaged lines, and of an extremum of ln |H|, that of its slope over its curvature. Intervals are two standard deviations to either side. A shift that the sweep itself makes (below) is not in them.</p>\n\
         <p><b>Features.</b> f<sub>dip</sub> and f<sub>res</sub> are the two ends of the largest rise of |H| as the frequency grows, within the sweep's band, refined by a parabola through three points of log |H|; Δf is their separation, the notch depth their difference in dB. For a bench with little damping they are the smallest and the largest |H| in the band, as in the thesis; with strong damping the largest |H| is the band's lower edge, not the slosh resonance, and the ripple behind the resonance may go deeper than the antiresonance.</p>\n\
         <p><b>Fit.</b> Three poles, two zeros, least squares on the complex <code>spa</code> response. In time it is driven with the run's torque from the initial state that fits best, as MATLAB's <code>compare</code> does: the band says little of a slow real pole, and from rest such a pole would keep the offset of the first half cycle for the whole run.</p>\n\
         <p><b>Energy residual.</b> Largest |E(t) − E(0) − work + heat| of a run over the energy throughput, Σ|Δwork| + heat. It checks the FMU's energy balance at every sample.</p>\n",
        cycles = demodulation::CYCLES,
        lag = lag,
        resolution = 1e3 / lag,
    );
    let rows: String = groups.iter().filter_map(swept_row).collect();
    if rows.is_empty() {
        return out;
    }
    out.push_str("<h3>Why the swept resonance lies above the exact one</h3>\n<p>The sweep is not slow enough for the liquid. Bare-wall damping makes the resonance so narrow that the sweep crosses its half-power width in less time than the slosh needs to decay: the oscillation is still growing when its best frequency has gone by, so an upward sweep sees the largest rate later, at a higher frequency, and a little lower than it would be in a dwell. The ripple behind the resonance is the beat between that ringing and the torque that has moved on. A bench that sweeps at this rate and reads the envelope sees the same shift; it belongs to the experiment, not to the plant.</p>\n<div class=\"wide\"><table><thead><tr><th>run</th><th>exact<br>resonance</th><th>half-power<br>width 2ζf</th><th>sweep rate<br>there</th><th>time to<br>cross</th><th>slosh decays<br>in 1/(2πζf)</th><th>swept<br>resonance</th><th>its<br>shift</th><th><code>spa</code><br>resonance</th><th>its<br>shift</th></tr></thead><tbody>\n");
    out.push_str(&rows);
    out.push_str("</tbody></table></div>\n<p>The second estimator is the proof. For a linear plant the ratio of whole-record spectra is the frequency response however fast the input swept, because the ringing after the resonance is in the record too; and there the shift is gone. The antiresonance hardly moves in either: there the hub stands nearly still, so there is little that could ring; only at the smallest torques, where the bearing sticks near the antiresonance, does the sweep see it a few mHz late. When runs of a nonlinear model are compared, both views count: demodulation says what happened at that moment, <code>spa</code> gives the best linear summary of the whole.</p>\n");
    out
}

/// What the last run of a group, that with the largest torque where runs differ in it, shows of the
/// sweep's shift; `None` if no resonance is seen.
fn swept_row(group: &Group) -> Option<String> {
    let run = group.runs.last()?;
    let (mode, exact) = (run.linear.modes.first()?, group.exact.last()?.f_res?);
    let rate = sweep(run)?.rate_at(exact).abs();
    let swept = run.passing.as_ref().and_then(|passing| passing.rate.features.f_res);
    let whole = run.spa_features().f_res;
    swept.or(whole)?;
    let width = 2.0 * mode.damping * mode.frequency;
    let shift =
        |f: Option<f64>| f.map_or(String::new(), |f| format!("{:+.1} mHz", (f - exact) * 1e3));
    Some(format!(
        "<tr><td><code>{}</code></td><td>{exact:.4} Hz</td><td>{:.1} mHz</td><td>{:.2} mHz/s</td><td>{:.1} s</td><td>{:.1} s</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        escape(&run.case.name),
        width * 1e3,
        rate * 1e3,
        width / rate,
        1.0 / (TAU * mode.damping * mode.frequency),
        hertz(swept),
        shift(swept),
        hertz(whole),
        shift(whole),
    ))
}

pub(super) fn table(page: &Page, results: &Results) -> String {
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
        format!("<th>{}</th>", escape(&label).replace(" / ", "<br>"))
    };
    let heads: String = others.iter().map(head).collect();
    // columns that no run has
    let swept = results.outcomes.iter().any(|run| run.passing.is_some());
    let recorded = results.outcomes.iter().any(|run| run.record.is_some());
    let kinds = [(swept, "While the sweep passes"), (recorded, "Whole record (<code>spa</code>)")];
    let kinds: Vec<&str> = kinds.into_iter().filter(|(is, _)| *is).map(|(_, name)| name).collect();
    let over: String = kinds.iter().map(|name| format!("<th colspan=\"4\">{name}</th>")).collect();
    let columns = "<th>f<sub>dip</sub><br>Hz</th><th>f<sub>res</sub><br>Hz</th><th>Δf<br>mHz</th><th>notch<br>dB</th>".repeat(kinds.len());
    let mut out = format!(
        "<div class=\"wide\"><table><thead>\n\
         <tr><th colspan=\"{}\">Run</th>{over}<th colspan=\"5\">The run itself</th></tr>\n\
         <tr><th>model</th><th>fill<br>cm</th><th>torque<br>mN·m</th>{heads}{columns}<th>largest slosh<br>angle, deg</th><th>largest wave<br>mm</th><th>stiction<br>s</th><th>energy<br>residual</th><th>range of<br>the model</th></tr>\n</thead><tbody>\n",
        3 + others.len()
    );
    for run in &results.outcomes {
        let _ = write!(
            out,
            "<tr><td>{}</td><td>{}</td><td>{}</td>",
            escape(&run.range.model),
            run.range.fill.map_or(String::new(), |fill| cm(fill).to_string()),
            run.case.amplitude.map_or(String::new(), |a| thousandths(a).to_string())
        );
        for place in &others {
            let scale = page.varied[*place].as_ref().map_or(1.0, |varied| varied.scale);
            let cell = shortened(&run.case.varied[*place], scale);
            let _ = write!(out, "<td>{}</td>", escape(&cell));
        }
        let passing = run.passing.as_ref().map(|passing| &passing.rate);
        let spa = run.record.as_ref().map(|record| &record.spa);
        let shown = [(swept, passing), (recorded, spa)].into_iter().filter(|(is, _)| *is);
        for (_, estimate) in shown {
            let features = estimate.map_or(Features::default(), |estimate| estimate.features);
            let doubt = estimate.and_then(|estimate| estimate.doubt);
            let cell = |value: Option<f64>, digits: usize| match value {
                Some(value) => format!("<td>{value:.digits$}</td>"),
                None if estimate.is_none() => "<td></td>".into(),
                None if doubt.is_some() => {
                    format!("<td class=\"warn\" title=\"{}\">?</td>", doubt.unwrap_or(Doubt::Noise))
                }
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
            "<td>{:.1}</td><td>{:.1}</td><td>{:.3}</td><td>{:.1e}</td><td>{}</td></tr>",
            figures.peak_slosh_angle.to_degrees(),
            figures.peak_wave_height * 1e3,
            figures.stuck,
            figures.max_energy_residual,
            run.beyond_model().map_or("within".into(), |how| format!(
                "<span class=\"warn\" title=\"{}\">left</span>",
                escape(&how)
            ))
        );
    }
    out.push_str("</tbody></table></div>\n");
    out
}

/// A number times `scale`, a drawn one to six digits; any other text as it is.
fn shortened(text: &str, scale: f64) -> String {
    match text.parse::<f64>() {
        Ok(value) if text.len() > 8 => format!("{:.5e}", value * scale),
        Ok(value) => ((value * scale * 1e9).round() / 1e9).to_string(),
        _ => text.to_string(),
    }
}

pub(super) fn provenance(campaign: &Campaign, fmu: &Fmu, results: &Results) -> String {
    let description = fmu.description();
    let analysed = results.outcomes.first().map(|run| &run.case);
    let first = analysed.or_else(|| results.unanalysed.first().map(|run| &run.case));
    let plan = &campaign.plan;
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
        "</dl>\n<p>Each run is in <code>runs/</code> as Parquet, with what it was made from in its metadata. <code>features.csv</code> holds the values of the table above, <code>features_spa.csv</code> and <code>features_h1.csv</code> those of the other estimators in the same columns, <code>runs.csv</code> all of them with everything that was varied, <code>plan.toml</code> the plan. This command reproduces everything here:</p>\n<p><code>{}</code></p>\n",
        escape(&campaign.command(fmu))
    );
    out
}

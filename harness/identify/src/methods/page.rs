//! One self-contained page on an identification.

use analysis::statistics::variance;
use analysis::welch::{Segments, Spectra};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use report::svg::{Axis, Chart, Series, Style};

use super::identification::Identification;
use super::{Identified, Residual};
use crate::budget::Effect;
use crate::candidate::ModelFit;
use crate::estimate::{Estimated, prose};
use crate::verdict::DOUBTS;

/// Points of a curve: more than a screen has pixels are not seen.
const POINTS: usize = 700;
/// Length of the stretch that is drawn row by row, s.
const STRETCH: f64 = 8.0;

/// Style sheet of every page about an identification.
const STYLE: &str = "
:root{color-scheme:light dark;--ink:#1c1c1e;--paper:#fff;--soft:#6b6b70;--rule:#d8d8dc;--a:#0b62c4;--b:#c2410c;--warn:#fde8d7}
@media(prefers-color-scheme:dark){:root{--ink:#e8e8ea;--paper:#16171a;--soft:#a0a0a8;--rule:#3a3b40;--a:#6cb1ff;--b:#ff9a5c;--warn:#4a2a12}}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:62rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums}
th,td{padding:.2rem .5rem;border-bottom:1px solid var(--rule);text-align:right;white-space:nowrap}
table{font-size:.88rem}th{white-space:normal;vertical-align:bottom}.numbered th,.numbered td{padding:.2rem .35rem}
th:first-child,td:first-child{text-align:left}
th{color:var(--soft);font-weight:500}.doubt{background:var(--warn);padding:.5rem .8rem;border-radius:4px}
svg{width:100%;min-width:40rem;height:auto;display:block;margin:.6rem 0}
svg text{fill:var(--ink);font:12px system-ui,sans-serif}svg .tick,svg .label{fill:var(--soft);font-size:11px}
svg .title{font-weight:600}svg .grid{stroke:var(--rule);stroke-width:.6;fill:none}svg .frame{stroke:var(--soft);fill:none}svg .curve path{fill:none;stroke-width:1.4}
details{margin:.6rem 0}summary{cursor:pointer}
";

/// The page.
pub fn of(found: &Identification) -> String {
    let fit = &found.details.fit;
    let first = html! {
        @if found.fits == Some(true) && found.converged {
            p {
                (format!("The model {} with {} friction fits: its residual is the gyro's noise, {:.2e} rad/s a row.",
                    fit.model, fit.friction, fit.noise_white))
            }
        }
    };
    let body = html! {
        (parameters(found))
        @for signals in &found.residuals {
            h2 { (signals.name) }
            @for chart in [envelope(signals), stretch(signals), spectrum(signals, fit.noise_white)] { (drawn(&chart)) }
        }
        (models(&found.details.models))
        (correlations(found))
        (budget(found))
    };
    page(found, &first, &body)
}

/// Returns a page: a first paragraph, the verdict, the body, and what was done.
pub(crate) fn page<D>(found: &Identified<D>, first: &Markup, body: &Markup) -> String {
    let is_doubt = |line: &str| DOUBTS.iter().any(|words| line.starts_with(words));
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width,initial-scale=1";
                title { "Identification" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "Identification" }
                (first)
                @for line in &found.verdict { p class=[is_doubt(line).then_some("doubt")] { (line) } }
                (body)
                h2 { "What was done" }
                details {
                    summary { (found.done.len()) " steps" }
                    ol { @for line in &found.done { li { (line) } } }
                }
            }
        }
    };
    page.into_string()
}

/// A chart that scrolls on a narrow screen, as a table does: shrunk, its letters could not be read.
pub(crate) fn drawn(chart: &Chart) -> Markup {
    html! { div class="scroll" { (PreEscaped(chart.svg())) } }
}

/// Returns a number with the digits that its standard deviation justifies, small numbers in scientific notation.
pub(crate) fn digits(value: f64, deviation: f64) -> String {
    let places = if deviation > 0.0 { 1.0 - deviation.log10().floor() } else { 6.0 };
    match value {
        _ if value.abs() < 1e-3 * deviation => "0".into(),
        _ if value.abs() < 1e-5 => format!("{value:.1e}"),
        _ => format!("{value:.*}", places.clamp(0.0, 9.0) as usize),
    }
}

/// A change of an estimate: in per cent, or in its own unit where the estimate is zero within its
/// standard deviation and a share of it would say nothing.
fn change(by: f64, p: &Estimated) -> String {
    match p.percent(by) {
        Some(percent) => format!("{percent:+.3}"),
        None if by == 0.0 => "0".into(),
        None => p.change(by),
    }
}

/// A table that scrolls where it is wider than the page.
pub(crate) fn table<'a>(
    head: impl IntoIterator<Item = &'a str>,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Markup {
    html! {
        div class="scroll" {
            table {
                tr { @for cell in head { th { (cell) } } }
                @for row in rows { tr { @for cell in row { td { (cell) } } } }
            }
        }
    }
}

/// The 95 % interval in words.
fn interval(p: &Estimated) -> String {
    let [low, high] = p.interval.map(|end| digits(end, p.std));
    if p.interval[1].is_finite() {
        format!("{low} to {high}")
    } else {
        format!("above {low}, open")
    }
}

fn parameters(found: &Identification) -> Markup {
    let row = |(name, p): (&String, &Estimated)| {
        vec![
            name.clone(),
            digits(p.value, p.std),
            format!("{:.1e}", p.std),
            p.percent(p.std).map_or("–".into(), |percent| format!("{:.3}", percent.abs())),
            format!("{:.1e}", p.std_noise),
            interval(p),
            prose(&p.unit),
        ]
    };
    let head =
        ["name", "value", "standard deviation", "%", "by noise alone", "95 % interval", "unit"];
    let sums = found.details.combinations.iter();
    let sums = sums.map(|c| row((&c.name, &Estimated::normal(c.value, c.std, &c.unit))));
    let rows = found.parameters.iter().chain(&found.measurement).map(row).chain(sums);
    html! { h2 { "Parameters" } (table(head, rows)) }
}

/// A chart as wide as the page.
pub(crate) fn axis_chart(
    title: &str,
    x: &str,
    y: &str,
    series: Vec<Series>,
    logarithmic: bool,
) -> Chart {
    let points = || series.iter().flat_map(|s| &s.points);
    Chart {
        title: title.into(),
        size: (900.0, 260.0),
        x: Axis::linear(x, points().map(|p| p.0), 0.0, 8),
        y: match logarithmic {
            true => Axis::decades(y, points().map(|p| p.1)),
            false => Axis::linear(y, points().map(|p| p.1), 0.0, 5),
        },
        series,
        legend: true,
    }
}

/// A curve in a colour of [`STYLE`].
pub(crate) fn series(points: Vec<(f64, f64)>, color: &str, style: Style, title: &str) -> Series {
    Series { points, color: format!("var(--{color})"), style, title: title.into() }
}

/// Largest rate in each of [`POINTS`] windows, measured and simulated, and the residual's root mean square.
fn envelope(signals: &Residual) -> Chart {
    let width = (signals.time.len() / POINTS).max(1);
    let windows = |of: &dyn Fn(usize) -> f64, mean: bool| -> Vec<(f64, f64)> {
        (0..signals.time.len() / width)
            .map(|k| {
                let rows = k * width..(k + 1) * width;
                let value = match mean {
                    true => (rows.map(|i| of(i).powi(2)).sum::<f64>() / width as f64).sqrt(),
                    false => rows.map(|i| of(i).abs()).fold(0.0, f64::max),
                };
                (signals.time[k * width], value.max(1e-9))
            })
            .collect()
    };
    let simulated = |i: usize| signals.measured[i] - signals.residual[i];
    let lines = vec![
        series(windows(&|i| signals.measured[i], false), "soft", Style::Line, "measured, peak"),
        series(windows(&simulated, false), "a", Style::Dashed, "simulated, peak"),
        series(windows(&|i| signals.residual[i], true), "b", Style::Line, "residual, rms"),
    ];
    axis_chart("Rate of the hub and residual", "time, s", "rad/s", lines, true)
}

/// The stretch around the fastest motion, row by row.
fn stretch(signals: &Residual) -> Chart {
    let fastest = (0..signals.measured.len())
        .max_by(|a, b| signals.measured[*a].abs().total_cmp(&signals.measured[*b].abs()))
        .unwrap_or(0);
    let middle = signals.time[fastest];
    let rows: Vec<usize> = (0..signals.time.len())
        .filter(|&i| (signals.time[i] - middle).abs() < STRETCH / 2.0)
        .collect();
    let of =
        |value: &dyn Fn(usize) -> f64| rows.iter().map(|&i| (signals.time[i], value(i))).collect();
    let lines = vec![
        series(of(&|i| signals.measured[i]), "soft", Style::Cloud, "measured"),
        series(of(&|i| signals.measured[i] - signals.residual[i]), "a", Style::Line, "simulated"),
    ];
    axis_chart("Where the motion is fastest", "time, s", "rad/s", lines, false)
}

/// One-sided amplitude density of residual and measured rate.
fn spectrum(signals: &Residual, white: f64) -> Chart {
    let count = signals.time.len();
    let step = (signals.time[count - 1] - signals.time[0]) / (count - 1) as f64;
    let spectra = Spectra::of(step, &signals.residual, &signals.measured, Segments::Seconds(20.0));
    // the spectra's unit is arbitrary: Parseval's theorem fixes it
    let density = |bins: &[f64], total: f64| -> Vec<(f64, f64)> {
        let sum = bins.iter().sum::<f64>() * spectra.resolution;
        let each = bins.iter().enumerate().skip(1).step_by((bins.len() / POINTS).max(1));
        each.map(|(k, p)| (k as f64 * spectra.resolution, (p * total / sum).sqrt().max(1e-12)))
            .collect()
    };
    let half = 0.5 / step;
    let level = white / half.sqrt();
    let lines = vec![
        series(
            density(&spectra.output, variance(&signals.measured)),
            "soft",
            Style::Line,
            "measured rate",
        ),
        series(density(&spectra.input, variance(&signals.residual)), "b", Style::Line, "residual"),
        series(vec![(0.0, level), (half, level)], "a", Style::Dashed, "white noise of the gyro"),
    ];
    axis_chart("Amplitude density", "frequency, Hz", "rad/s/√Hz", lines, true)
}

fn models(models: &[ModelFit]) -> Markup {
    let best = models.iter().map(|m| m.bic).fold(f64::INFINITY, f64::min);
    let row = |m: &ModelFit| {
        let worst = m.tests.iter().map(|t| t.worst()).fold(0.0, f64::max);
        let held: Vec<String> = m.validation_pct.iter().map(|v| format!("{v:.3}")).collect();
        vec![
            m.model.clone(),
            m.friction.clone(),
            format!("{:.3}", m.fit_pct),
            format!("{:.1}", m.bic - best),
            format!("{worst:.1}"),
            held.join(", "),
            format!("{:.0}", m.simulations),
        ]
    };
    let head = [
        "slosh",
        "friction",
        "fit, %",
        "BIC less the best",
        "worst residual test",
        "of recordings held back, %",
        "simulations",
    ];
    html! { h2 { "Models" } (table(head, models.iter().map(row))) }
}

fn correlations(found: &Identification) -> Markup {
    let (names, matrix) = &found.correlations;
    // the ink grows with the correlation
    let style = |value: f64| {
        let (share, color) = ((value.abs() * 60.0) as i32, if value < 0.0 { "b" } else { "a" });
        format!("background:color-mix(in srgb,var(--{color}) {share}%,transparent)")
    };
    html! {
        h2 { "Correlations" }
        p { (format!("Condition number of the sensitivities: {:.0}.", found.details.condition)) }
        div class="scroll" {
            // the columns have the rows' numbers: names would make it wider than a screen
            table .numbered {
                tr { th {} @for number in 1..=names.len() { th { (number) } } }
                @for (number, (name, row)) in (1..).zip(names.iter().zip(matrix)) {
                    tr {
                        td { (number) " " (name) }
                        @for value in row { td style=(style(*value)) { (format!("{value:.2}")) } }
                    }
                }
            }
        }
    }
}

fn budget(found: &Identification) -> Markup {
    let effects = &found.details.error_budget;
    let row = |(name, p): (&String, &Estimated)| {
        let of = |effect: &Effect| change(effect.change.get(name).copied().unwrap_or(0.0), p);
        std::iter::once(name.clone()).chain(effects.iter().map(of)).collect()
    };
    let head = std::iter::once("estimate").chain(effects.iter().map(|e| e.source.as_str()));
    html! {
        h2 { "Error budget" }
        p { "Effect of errors in quantities that are not estimated, in % of each estimate, or in its unit if it is zero within its standard deviation. Tolerances (\"wrong by\") are part of the intervals." }
        (table(head, found.parameters.iter().map(row)))
    }
}

#[cfg(test)]
mod tests {
    use super::{change, digits};
    use crate::estimate::Estimated;

    #[test]
    fn an_estimate_that_is_zero_has_no_per_cent() {
        let bias = Estimated::normal(-1.4e-14, 9.3e-9, "rad/s");
        assert_eq!(digits(bias.value, bias.std), "0");
        assert_eq!(change(6e-4, &bias), "+6.0e-4 rad/s");
        assert_eq!(change(0.0, &bias), "0");
        let inertia = Estimated::normal(0.32241, 8.1e-4, "kg.m2");
        assert_eq!(change(-0.0032241, &inertia), "-1.000");
        assert_eq!(digits(inertia.value, inertia.std), "0.32241");
        assert_eq!(digits(-1.82e-8, 9.3e-9), "-1.8e-8");
    }
}

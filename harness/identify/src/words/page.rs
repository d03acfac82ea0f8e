//! The HTML page about an identification, which all methods share: verdict, estimates, sections of the method, residuals over
//! time with their spectrum and autocorrelation, frequency responses of measurement and model, correlations.

use analysis::rest;
use analysis::statistics::{about_mean, variance};
use analysis::welch::{Segments, Spectra};
use maud::{Markup, html};
use report::page::{axis_chart, document, render_chart, series, table};
use report::svg::{Chart, Style};

use crate::estimate::{Combination, Estimated, prose};
use crate::input::recording::Recording;
use crate::input::response;
use crate::tuning::PAGE_POINTS;
use crate::words::identified::{Identified, Report, Residual};
use crate::words::verdict::DOUBTS;

pub const RATE: &str = "rad/s";

impl<D: Report> Identified<D> {
    pub fn page(&self) -> String {
        let sections = D::sections(self);
        let is_doubt = |line: &str| DOUBTS.iter().any(|words| line.starts_with(words));
        let body = html! {
            (sections.first)
            @for line in &self.verdict { p class=[is_doubt(line).then_some("doubt")] { (line) } }
            @if !(self.parameters.is_empty() && self.measurement.is_empty()) {
                (parameters(self, &sections.combinations))
            }
            (sections.figures)
            @for signals in &self.residuals {
                h2 { (signals.name) }
                @for chart in charts(signals) { (render_chart(&chart)) }
            }
            @if !self.correlations.0.is_empty() { (correlations(self, sections.condition)) }
            (sections.last)
            @if !self.done.is_empty() {
                h2 { "What was done" }
                details {
                    summary { (self.done.len()) " steps" }
                    ol { @for line in &self.done { li { (line) } } }
                }
            }
        };
        document("Identification", &body)
    }
}

fn charts(signals: &Residual) -> Vec<Chart> {
    if signals.time.len() < 3 {
        return Vec::new();
    }
    let mut charts = vec![
        envelope(signals),
        residual(signals),
        stretch(signals),
        spectrum(signals),
        autocorrelation(signals),
    ];
    charts.extend(bode(signals).into_iter().flatten());
    charts
}

/// Formats `value` with as many digits as its standard `deviation` justifies.
pub fn format_to_deviation(value: f64, deviation: f64) -> String {
    let places = if deviation > 0.0 { 1.0 - deviation.log10().floor() } else { 6.0 };
    match value {
        _ if value.abs() < 1e-3 * deviation => "0".into(),
        _ if value.abs() < 1e-5 => format!("{value:.1e}"),
        _ => format!("{value:.*}", places.clamp(0.0, 9.0) as usize),
    }
}

fn interval(p: &Estimated) -> String {
    let [low, high] = p.interval.map(|end| format_to_deviation(end, p.std));
    if p.interval[1].is_finite() {
        format!("{low} to {high}")
    } else {
        format!("above {low}, open")
    }
}

fn parameters<D>(found: &Identified<D>, combinations: &[Combination]) -> Markup {
    let row = |(name, p): (&String, &Estimated)| {
        vec![
            name.clone(),
            format_to_deviation(p.value, p.std),
            format!("{:.1e}", p.std),
            p.percent(p.std).map_or("–".into(), |percent| format!("{:.3}", percent.abs())),
            format!("{:.1e}", p.std_noise),
            interval(p),
            prose(&p.unit),
        ]
    };
    let head =
        ["name", "value", "standard deviation", "%", "by noise alone", "95 % interval", "unit"];
    let sums = combinations.iter();
    let sums = sums.map(|c| row((&c.name, &Estimated::normal(c.value, c.std, &c.unit))));
    let rows = found.parameters.iter().chain(&found.measurement).map(row).chain(sums);
    html! { h2 { "Parameters" } (table(head, rows)) }
}

/// Draws the largest measured and modelled value and the root mean square of the residual in each of [`PAGE_POINTS`] time
/// windows.
fn envelope(signals: &Residual) -> Chart {
    let width = (signals.time.len() / PAGE_POINTS).max(1);
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
        series(windows(&simulated, false), "a", Style::Dashed, "model, peak"),
        series(windows(&|i| signals.residual[i], true), "b", Style::Line, "residual, rms"),
    ];
    axis_chart("Measurement, model and residual", "time, s", &signals.label, lines, true)
}

/// Draws measured and modelled values in every row of the 8 s around the fastest motion.
fn stretch(signals: &Residual) -> Chart {
    let fastest = (0..signals.measured.len())
        .max_by(|a, b| signals.measured[*a].abs().total_cmp(&signals.measured[*b].abs()))
        .unwrap_or(0);
    let middle = signals.time[fastest];
    let rows: Vec<usize> =
        (0..signals.time.len()).filter(|&i| (signals.time[i] - middle).abs() < 4.0).collect();
    let of =
        |value: &dyn Fn(usize) -> f64| rows.iter().map(|&i| (signals.time[i], value(i))).collect();
    let lines = vec![
        series(of(&|i| signals.measured[i]), "soft", Style::Cloud, "measured"),
        series(of(&|i| signals.measured[i] - signals.residual[i]), "a", Style::Line, "model"),
    ];
    axis_chart("Where the signal is largest", "time, s", &signals.label, lines, false)
}

fn spectrum(signals: &Residual) -> Chart {
    let count = signals.time.len();
    let step = (signals.time[count - 1] - signals.time[0]) / (count - 1) as f64;
    let spectra =
        Spectra::estimate(step, &signals.residual, &signals.measured, Segments::Seconds(20.0));
    // scaled so that the integral is the mean square (Parseval's theorem)
    let density = |bins: &[f64], total: f64| -> Vec<(f64, f64)> {
        let sum = bins.iter().sum::<f64>() * spectra.resolution;
        let each = bins.iter().enumerate().skip(1).step_by((bins.len() / PAGE_POINTS).max(1));
        each.map(|(k, p)| (k as f64 * spectra.resolution, (p * total / sum).sqrt().max(1e-12)))
            .collect()
    };
    let half = 0.5 / step;
    let mut lines = vec![
        series(
            density(&spectra.output, variance(&signals.measured)),
            "soft",
            Style::Line,
            "measured",
        ),
        series(density(&spectra.input, variance(&signals.residual)), "b", Style::Line, "residual"),
    ];
    let level = signals.noise / half.sqrt();
    lines.push(series(vec![(0.0, level), (half, level)], "a", Style::Dashed, "white noise"));
    axis_chart("Amplitude density", "frequency, Hz", &format!("{}/√Hz", signals.label), lines, true)
}

/// Draws the residual over time, with at most 2 [`PAGE_POINTS`] points.
fn residual(signals: &Residual) -> Chart {
    let every = signals.time.len().div_ceil(2 * PAGE_POINTS);
    let rows = (0..signals.time.len()).step_by(every);
    let points = rows.map(|k| (signals.time[k], signals.residual[k])).collect();
    let title = match every {
        1 => "Residual over time".into(),
        _ => format!("Residual over time, one row in {every}"),
    };
    let lines = vec![series(points, "b", Style::Cloud, "measured less model")];
    axis_chart(&title, "time, s", &signals.label, lines, false)
}

fn autocorrelation(signals: &Residual) -> Chart {
    let count = signals.residual.len();
    let step = (signals.time[count - 1] - signals.time[0]) / (count - 1) as f64;
    let values = rest::autocorrelation(&about_mean(&signals.residual), 200);
    let last = (values.len() - 1) as f64 * step;
    let bound = 1.96 / (count as f64).sqrt();
    let values = values.iter().enumerate().skip(1).map(|(k, r)| (k as f64 * step, *r)).collect();
    let frame = vec![(0.0, bound), (last, bound), (last, -bound), (0.0, -bound)];
    let lines = vec![
        series(values, "b", Style::Line, "residual"),
        series(frame, "soft", Style::Dashed, "95 % interval of white noise"),
    ];
    let title = "Autocorrelation of the residual beyond lag 0, where it is 1";
    axis_chart(title, "lag, s", "autocorrelation", lines, false)
}

/// Draws the gain and phase from torque to rate, estimated from measurement and model by the same method. Returns `None` if
/// the recordings have no torque that excites a frequency band.
fn bode(signals: &Residual) -> Option<[Chart; 2]> {
    let simulated = signals.measured.iter().zip(&signals.residual).map(|(y, e)| y - e).collect();
    let of = |rate: Vec<f64>| {
        let torque = signals.torque.clone()?;
        response::response(&Recording::of(&signals.name, signals.time.clone(), torque, rate)).ok()
    };
    let (measured, model) = (of(signals.measured.clone())?, of(simulated)?);
    let gain = |response: &analysis::FrequencyResponse| -> Vec<(f64, f64)> {
        let values = response.frequency.iter().zip(&response.response);
        values.map(|(f, h)| (*f, 20.0 * h.norm().log10())).collect()
    };
    let phase = |response: &analysis::FrequencyResponse| -> Vec<(f64, f64)> {
        let mut last = None;
        let values = response.frequency.iter().zip(&response.response).map(|(f, h)| {
            let now = h.arg().to_degrees();
            // 360° are added or subtracted, so that the phase is continuous
            let phase = last.map_or(now, |last: f64| now + 360.0 * ((last - now) / 360.0).round());
            last = Some(phase);
            (*f, phase)
        });
        values.collect()
    };
    let chart =
        |title: &str, y: &str, of: &dyn Fn(&analysis::FrequencyResponse) -> Vec<(f64, f64)>| {
            let lines = vec![
                series(of(&measured), "soft", Style::Line, "measured"),
                series(of(&model), "a", Style::Dashed, "model"),
            ];
            axis_chart(title, "frequency, Hz", y, lines, false)
        };
    Some([
        chart("Gain from torque to rate", "dB re 1 rad/s/(N·m)", &gain),
        chart("Phase from torque to rate", "degrees", &phase),
    ])
}

fn correlations<D>(found: &Identified<D>, condition: Option<f64>) -> Markup {
    let (names, matrix) = &found.correlations;
    // the colour is stronger for a larger correlation
    let style = |value: f64| {
        let (share, color) = ((value.abs() * 60.0) as i32, if value < 0.0 { "b" } else { "a" });
        format!("background:color-mix(in srgb,var(--{color}) {share}%,transparent)")
    };
    html! {
        h2 { "Correlations" }
        @if let Some(condition) = condition {
            p { (format!("Condition number of the sensitivities: {condition:.0}.")) }
        }
        div class="scroll" {
            // columns have numbers instead of names, because names would make the table wider than a screen
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

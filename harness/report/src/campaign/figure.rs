use std::collections::BTreeSet;

use maud::{Markup, html};
use serde_json::{Value, json};

use crate::svg::{range, simplified};
use experiments::rounding::significant;

/// A figure of one or more panels with a common legend, with `columns` panels in a row on a wide screen. The
/// caption states what the figure shows. `thesis` contains the numbers of the corresponding figures about the
/// bench in Rubaga's thesis, for example `7.1 and 7.2`. `half` figures take half of the page's width on a wide
/// screen; the panels of `shared` figures zoom together along x. `labels` at the right ends of the lines in the
/// first panel replace a legend.
pub(super) struct Figure {
    pub title: String,
    pub caption: Markup,
    pub thesis: &'static str,
    pub columns: usize,
    pub height: usize,
    pub half: bool,
    pub shared: bool,
    pub panels: Vec<Panel>,
    pub traces: Vec<Value>,
    pub labels: Vec<Label>,
}

pub(super) struct Label {
    pub y: f64,
    pub text: String,
    pub color: String,
}

/// One pair of axes of a figure. If `equal` is true, both axes have the same scale. `range` is the range of x that is
/// shown at first (`None` shows all data).
#[derive(Clone, Default)]
pub(super) struct Panel {
    pub x: String,
    pub y: String,
    pub log_x: bool,
    pub log_y: bool,
    pub equal: bool,
    pub range: Option<(f64, f64)>,
}

impl Panel {
    pub fn new(x: &str, y: &str) -> Panel {
        Panel { x: x.into(), y: y.into(), ..Panel::default() }
    }
}

impl Default for Figure {
    fn default() -> Self {
        Figure {
            title: String::new(),
            caption: html! {},
            thesis: "",
            columns: 1,
            height: 330,
            half: false,
            shared: false,
            panels: Vec::new(),
            traces: Vec::new(),
            labels: Vec::new(),
        }
    }
}

#[derive(Default)]
pub(super) struct Figures {
    specifications: Vec<Value>,
    titles: Vec<String>,
    of_the_thesis: bool,
}

impl Figures {
    pub fn new(of_the_thesis: bool) -> Self {
        Figures { of_the_thesis, ..Figures::default() }
    }

    /// Adds a figure and returns the HTML element into which the page draws it, or nothing if the figure has no data.
    pub fn add(&mut self, figure: Figure) -> Markup {
        let none = |axis: &Value| axis.as_array().is_some_and(Vec::is_empty);
        let empty = |trace: &Value| none(&trace["x"]) || none(&trace["y"]);
        let mut traces: Vec<Value> = figure.traces.into_iter().filter(|t| !empty(t)).collect();
        // Panels without a trace are left out.
        let drawn: BTreeSet<u64> = traces.iter().filter_map(|t| t["panel"].as_u64()).collect();
        if drawn.is_empty() {
            return html! {};
        }
        for trace in &mut traces {
            let place = drawn.iter().position(|p| trace["panel"] == *p);
            trace["panel"] = json!(place);
        }
        let panels: Vec<Value> = drawn
            .iter()
            .map(|p| &figure.panels[*p as usize])
            .map(|p| {
                json!({"x": p.x, "y": p.y, "logx": p.log_x, "logy": p.log_y, "equal": p.equal,
                       "range": p.range.map(|(from, to)| [number(from), number(to)])})
            })
            .collect();
        let label = |l: &Label| json!({"y": number(l.y), "text": l.text, "color": l.color});
        let labels: Vec<Value> = figure.labels.iter().map(label).collect();
        self.specifications.push(json!({
            "columns": figure.columns, "height": figure.height, "shared": figure.shared,
            "panels": panels, "traces": traces, "labels": labels,
        }));
        let number = self.specifications.len();
        self.titles.push(figure.title.clone());
        html! {
            figure id={ "figure-" (number) } class=[figure.half.then_some("half")] {
                div .plot role="img" aria-label=(figure.title) {}
                figcaption {
                    a href={ "#figure-" (number) } { "Figure " (number) } " "
                    b { (figure.title) "." } " " (figure.caption)
                    @if self.of_the_thesis && !figure.thesis.is_empty() {
                        " Thesis: figure" @if figure.thesis.contains(' ') { "s" } " " (figure.thesis) "."
                    }
                }
            }
            "\n" // the space between two half figures
        }
    }

    pub fn table_of_figures(&self) -> Markup {
        html! {
            @for (title, number) in self.titles.iter().zip(1..) {
                li { a href={ "#figure-" (number) } { (title) } }
            }
        }
    }

    pub fn json(&self) -> String {
        web::json_in_script(&Value::Array(self.specifications.clone()).to_string())
    }
}

/// Rounds a number to five significant digits; NaN and infinite become null.
pub(super) fn number(value: f64) -> Value {
    let rounded = significant(value, 5);
    if rounded.is_finite() && rounded == rounded.trunc() && rounded.abs() < 1e15 {
        return json!(rounded as i64); // an integer is shorter in JSON
    }
    json!(rounded.is_finite().then_some(rounded))
}

pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> Vec<Value> {
    values.into_iter().map(number).collect()
}

pub(super) fn line(
    panel: usize,
    name: &str,
    color: &str,
    dash: &str,
    points: &[(f64, f64)],
) -> Value {
    let mut trace = json!({
        "type": "scatter", "mode": "lines", "name": name, "panel": panel, "legendgroup": name,
        "y": numbers(points.iter().map(|p| p.1)),
        "line": {"color": color, "dash": dash, "width": 1.6},
    });
    match even(points) {
        Some((first, step)) => (trace["x0"], trace["dx"]) = (json!(first), json!(step)),
        None => trace["x"] = Value::Array(numbers(points.iter().map(|p| p.0))),
    }
    trace
}

/// Returns the first x and the distance between neighbouring points if all points are equally spaced along x, so that
/// a page need not store every x. Otherwise returns `None`.
fn even(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let [first, .., last] = points else { return None };
    let step = (last.0 - first.0) / (points.len() - 1) as f64;
    let off = |(i, p): (usize, &(f64, f64))| (p.0 - first.0 - i as f64 * step).abs();
    let most = points.iter().enumerate().map(off).fold(0.0, f64::max);
    (points.len() > 20 && step > 0.0 && most < 1e-6 * step).then_some((first.0, step))
}

pub(super) fn dots(
    panel: usize,
    name: &str,
    color: &str,
    symbol: &str,
    points: &[(f64, f64, Option<f64>)],
) -> Value {
    let mut trace = json!({
        "type": "scatter", "mode": "lines+markers", "name": name, "panel": panel,
        "legendgroup": name,
        "x": numbers(points.iter().map(|p| p.0)), "y": numbers(points.iter().map(|p| p.1)),
        "line": {"color": color, "width": 1.2}, "marker": {"color": color, "symbol": symbol, "size": 7},
    });
    if points.iter().any(|p| p.2.is_some()) {
        let array = numbers(points.iter().map(|p| p.2.unwrap_or(0.0)));
        trace["error_y"] =
            json!({"type": "data", "array": array, "color": color, "thickness": 1, "width": 3});
    }
    trace
}

/// Returns the points of a curve that are needed to draw it at the usual size. `log` is true if the
/// x axis is logarithmic.
pub(super) fn thinned(points: &[(f64, f64)], log: bool) -> Vec<(f64, f64)> {
    let finite = |p: &&(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let points: Vec<(f64, f64)> = points.iter().filter(finite).copied().collect();
    let place = |x: f64| if log { x.ln() } else { x };
    let span = |of: &dyn Fn(&(f64, f64)) -> f64| {
        let (low, high) = range(points.iter().map(of));
        (low, (high - low).max(1e-300))
    };
    let ((x0, w), (y0, h)) = (span(&|p| place(p.0)), span(&|p| p.1));
    // Curves are thinned for a plot of 2000 by 400 px, which is larger than usual, because readers may zoom
    // into a narrow resonance.
    let scaled: Vec<(f64, f64)> =
        points.iter().map(|p| (2000.0 * (place(p.0) - x0) / w, 400.0 * (p.1 - y0) / h)).collect();
    let mut kept = simplified(&scaled, 0.4).into_iter().peekable();
    let mut keep = |i: usize| kept.next_if(|p| *p == scaled[i]).is_some();
    points.iter().enumerate().filter(|(i, _)| keep(*i)).map(|(_, p)| *p).collect()
}

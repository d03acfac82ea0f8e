//! Charts as inline SVG. Colours are CSS values, so that a page can change them with the light or dark
//! scheme of the reader.

use std::fmt::Write as _;

use maud::{Markup, html};

#[derive(Clone, Debug)]
pub struct Axis {
    pub label: String,
    pub from: f64,
    pub to: f64,
    pub logarithmic: bool,
    pub ticks: Vec<f64>,
}

impl Axis {
    /// Creates an axis that covers all `values` and at least a range of `span`, with about `count`
    /// ticks at round numbers.
    pub fn linear(
        label: &str,
        values: impl IntoIterator<Item = f64>,
        span: f64,
        count: usize,
    ) -> Self {
        let (mut low, mut high) = range(values);
        let lack = (span - (high - low)) / 2.0;
        if lack > 0.0 {
            (low, high) = (low - lack, high + lack);
        }
        let step = round_step((high - low) / count as f64);
        let (from, to) = ((low / step).floor() * step, (high / step).ceil() * step);
        let ticks = (0..=((to - from) / step).round() as i32).map(|i| from + i as f64 * step);
        Axis { label: label.into(), from, to, logarithmic: false, ticks: ticks.collect() }
    }

    pub fn decades(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = range(values.into_iter().filter(|v| *v > 0.0).map(f64::log10));
        let (low, mut high) = ((low + 1e-9).floor() as i32, (high - 1e-9).ceil() as i32);
        high = high.max(low + 1);
        let every = (high - low + 5) / 6;
        let ticks = (low..=high).step_by(every as usize).map(|e| 10f64.powi(e)).collect();
        let (from, to) = (10f64.powi(low), 10f64.powi(high));
        Axis { label: label.into(), from, to, logarithmic: true, ticks }
    }

    fn place(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value / self.from).ln() / (self.to / self.from).ln()
        } else {
            (value - self.from) / (self.to - self.from)
        }
    }
}

/// Returns the smallest and the largest of the finite values; 0 and 1 if there are none.
pub(crate) fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .into_iter()
        .filter(|v| v.is_finite())
        .fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    if low > high { (0.0, 1.0) } else { (low, high) }
}

fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.max(1e-300).log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| *s >= step * 0.999)
        .unwrap_or(step)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    Line,
    Dashed,
    Dots,
    OpenDots,
    Cloud,
}

/// A curve of a chart. Points that are NaN or infinite are left out. The title is shown while the pointer
/// is on the curve.
#[derive(Clone, Debug)]
pub struct Series {
    pub points: Vec<(f64, f64)>,
    pub color: String,
    pub style: Style,
    pub title: String,
}

pub fn series(points: Vec<(f64, f64)>, color: &str, style: Style, title: &str) -> Series {
    Series { points, color: color.into(), style, title: title.into() }
}

#[derive(Clone, Debug)]
pub struct Chart {
    pub title: String,
    pub size: (f64, f64),
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
    pub legend: bool,
}

const MARGIN: (f64, f64, f64, f64) = (56.0, 12.0, 26.0, 40.0);

impl Chart {
    pub fn new(title: &str, x: Axis, y: Axis, series: Vec<Series>) -> Self {
        Chart { title: title.into(), size: (640.0, 400.0), x, y, series, legend: true }
    }

    pub fn svg(&self) -> String {
        self.drawing(None)
    }

    pub fn file(&self) -> String {
        self.drawing(Some(include_str!("svg.css")))
    }

    fn drawing(&self, style: Option<&str>) -> String {
        let (width, height) = self.size;
        let (left, right, top, bottom) = (MARGIN.0, width - MARGIN.1, MARGIN.2, height - MARGIN.3);
        let x = |value: f64| left + (right - left) * self.x.place(value);
        let y = |value: f64| bottom - (bottom - top) * self.y.place(value);
        // a number that would extend beyond the right end is shifted to the left
        let place = |at: f64| if at > right - 6.0 { (width, "end") } else { (at, "middle") };
        let drawing = html! {
            svg xmlns=[style.map(|_| "http://www.w3.org/2000/svg")]
                viewBox={ "0 0 " (width) " " (height) } role="img" aria-label=(self.title) {
                @if let Some(style) = style { style { (style) } }
                text .title x=(left) y="15" { (self.title) }
                @for &tick in &self.x.ticks {
                    @let (at, anchor) = place(x(tick));
                    path .grid d={ "M" (tenth(x(tick))) " " (top) "V" (bottom) } {}
                    text .tick x=(tenth(at)) y=(tenth(bottom + 15.0)) text-anchor=(anchor) {
                        (number(tick, &self.x))
                    }
                }
                @for &tick in &self.y.ticks {
                    path .grid d={ "M" (left) " " (tenth(y(tick))) "H" (right) } {}
                    text .tick x=(tenth(left - 6.0)) y=(tenth(y(tick) + 3.5)) text-anchor="end" {
                        (number(tick, &self.y))
                    }
                }
                path .frame d={ "M" (left) " " (top) "V" (bottom) "H" (right) } {}
                text .label x=(tenth((left + right) / 2.0)) y=(tenth(height - 7.0))
                    text-anchor="middle" { (self.x.label) }
                text .label transform={ "translate(13 " (tenth((top + bottom) / 2.0)) ") rotate(-90)" }
                    text-anchor="middle" { (self.y.label) }
                // a nested svg clips curves to the plot
                @let (w, h) = (right - left, bottom - top);
                svg x=(left) y=(top) width=(w) height=(h)
                    viewBox={ (left) " " (top) " " (w) " " (h) } {
                    @for series in &self.series {
                        (curve(series.points.iter().map(|&(px, py)| (x(px), y(py))), series))
                    }
                    @if self.legend {
                        @for (i, series) in self.series.iter().enumerate() {
                            @let at = top + 14.0 + 16.0 * i as f64;
                            (curve([right - 30.0, right - 6.0].map(|x| (x, at - 4.0)), series))
                            text .label x=(tenth(right - 36.0)) y=(tenth(at)) text-anchor="end" {
                                (series.title)
                            }
                        }
                    }
                }
            }
        };
        drawing.into_string()
    }
}

fn tenth(length: f64) -> String {
    format!("{length:.1}")
}

fn curve(points: impl IntoIterator<Item = (f64, f64)>, series: &Series) -> Markup {
    let points: Vec<(f64, f64)> =
        points.into_iter().filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
    let mut path = String::new();
    let line = if series.style == Style::Cloud { Vec::new() } else { simplified(&points, 0.1) };
    for (i, (x, y)) in line.into_iter().enumerate() {
        let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { "M" } else { "L" });
    }
    let (dash, dots) = match series.style {
        Style::Line => (None, None),
        Style::Dashed => (Some("6 4"), None),
        Style::Dots | Style::Cloud => (None, Some(series.color.as_str())),
        Style::OpenDots => (Some("3 3"), Some("var(--paper)")),
    };
    let radius = if series.style == Style::Cloud { "1.5" } else { "3" };
    html! {
        g .curve style={ "stroke:" (series.color) } {
            title { (series.title) }
            @if !path.is_empty() { path d=(path) stroke-dasharray=[dash] {} }
            @if let Some(fill) = dots {
                @for (x, y) in &points {
                    circle cx=(tenth(*x)) cy=(tenth(*y)) r=(radius) style={ "fill:" (fill) } {}
                }
            }
        }
    }
}

/// Leaves out points that are within `tolerance` of the line through the remaining points
/// (Ramer, Douglas and Peucker).
pub(crate) fn simplified(points: &[(f64, f64)], tolerance: f64) -> Vec<(f64, f64)> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut kept = vec![false; points.len()];
    let mut spans = vec![(0, points.len() - 1)];
    while let Some((from, to)) = spans.pop() {
        (kept[from], kept[to]) = (true, true);
        let ((ax, ay), (bx, by)) = (points[from], points[to]);
        let length = (bx - ax).hypot(by - ay).max(1e-9);
        let away = |i: usize| {
            let (px, py) = points[i];
            ((bx - ax) * (py - ay) - (by - ay) * (px - ax)).abs() / length
        };
        let farthest = (from + 1..to).max_by(|&a, &b| away(a).total_cmp(&away(b)));
        if let Some(middle) = farthest.filter(|&i| away(i) > tolerance) {
            spans.extend([(from, middle), (middle, to)]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| *point).collect()
}

fn number(value: f64, axis: &Axis) -> Markup {
    let written = if axis.logarithmic && !(1e-3..1e4).contains(&value.abs()) {
        let exponent = value.log10().round() as i32;
        return html! { "10" tspan dy="-4" font-size="8" { (minus(&exponent.to_string())) } };
    } else if axis.logarithmic {
        format!("{value}")
    } else {
        let step = axis.ticks.windows(2).map(|t| t[1] - t[0]).fold(f64::MAX, f64::min);
        let digits = (-(step.log10() + 1e-9).floor()).clamp(0.0, 9.0) as usize;
        format!("{:.digits$}", if value.abs() < step * 1e-6 { 0.0 } else { value })
    };
    html! { (minus(&written)) }
}

fn minus(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::{Axis, number, simplified};

    #[test]
    fn ticks_are_round_and_cover_the_values() {
        let axis = Axis::linear("f / Hz", [2.4568, 2.4603], 0.02, 4);
        assert!(axis.from <= 2.4568 && axis.to >= 2.4603 && axis.to - axis.from >= 0.02);
        let written: Vec<_> = axis.ticks.iter().map(|t| number(*t, &axis).0).collect();
        assert_eq!(written, ["2.445", "2.450", "2.455", "2.460", "2.465", "2.470"]);
        let axis = Axis::decades("t / s", [0.0, 0.003, 59.0]);
        assert_eq!((axis.from, axis.to, axis.ticks.len()), (0.001, 100.0, 6));
    }

    #[test]
    fn simplification_of_a_curve_keeps_its_ends_and_corners() {
        let line: Vec<_> = (0..100).map(|i| (i as f64, 2.0 * i as f64)).collect();
        assert_eq!(simplified(&line, 0.1), [line[0], line[99]]);
        let corner = [(0.0, 0.0), (1.0, 0.0), (1.0, 5.0)];
        assert_eq!(simplified(&corner, 0.1), corner);
    }
}

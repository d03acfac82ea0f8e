//! Draws a tank with its liquid and mode shapes, and a sweep over the fill, as self-contained SVG.

use core::fmt::Write as _;

use crate::contour::Wall;
use crate::curve::{Curve, Point, Segment};
use crate::modal::{ModalData, Mode};
use crate::sweep::Sweep;
use crate::table::significant;
use crate::tank::{Geometry, Tank};

pub const COLOURS: [&str; 5] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00"];
const DRAWN: usize = 5;
const LIQUID: &str = "#dcecf7";
const INK: &str = "#222";
pub const FAINT: &str = "#999";

/// Rectangle of a diagram on the page, px, and the values of x and y at its edges.
#[derive(Clone, Copy)]
pub struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    pub x: [f64; 2],
    pub y: [f64; 2],
}

impl Frame {
    pub fn place(&self, x: f64, y: f64) -> (f64, f64) {
        (
            self.left + self.width * (x - self.x[0]) / (self.x[1] - self.x[0]),
            self.top + self.height * (self.y[1] - y) / (self.y[1] - self.y[0]),
        )
    }

    fn path(&self, points: &[Point]) -> String {
        let mut path = String::new();
        for (i, p) in points.iter().enumerate() {
            let (x, y) = self.place(p[0], p[1]);
            let _ = write!(path, "{}{x:.2} {y:.2}", if i == 0 { "M" } else { "L" });
        }
        path
    }

    pub fn curve(&self, svg: &mut String, points: &[Point], style: &str) {
        let _ = writeln!(svg, "<path d=\"{}\" fill=\"none\" {style}/>", self.path(points));
    }

    pub fn axes(&self, svg: &mut String, x_label: &str, y_label: Option<&str>) {
        let Frame { left, top, width, height, .. } = *self;
        let bottom = top + height;
        let _ = writeln!(
            svg,
            "<path d=\"M{left} {top}V{bottom}H{}\" fill=\"none\" stroke=\"{INK}\"/>",
            left + width
        );
        for x in ticks(self.x, (width / 70.0) as usize) {
            let (px, _) = self.place(x, self.y[0]);
            let _ = writeln!(svg, "<path d=\"M{px:.2} {bottom}v5\" stroke=\"{INK}\"/>");
            text(svg, px, bottom + 18.0, "middle", &significant(x));
        }
        text(svg, left + width / 2.0, bottom + 36.0, "middle", x_label);
        for y in ticks(self.y, (height / 50.0) as usize) {
            let (_, py) = self.place(self.x[0], y);
            let _ = writeln!(svg, "<path d=\"M{left} {py:.2}h-5\" stroke=\"{INK}\"/>");
            if y_label.is_some() {
                text(svg, left - 8.0, py + 4.0, "end", &significant(y));
            }
        }
        if let Some(y_label) = y_label {
            let (x, y) = (left - 48.0, top + height / 2.0);
            let _ = writeln!(
                svg,
                "<text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\" transform=\"rotate(-90 {x} {y})\">{}</text>",
                escape(y_label)
            );
        }
    }
}

fn ticks([from, to]: [f64; 2], count: usize) -> Vec<f64> {
    let raw = (to - from) / count.max(2) as f64;
    let power = 10f64.powf(raw.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= raw).unwrap_or(raw);
    let first = (from / step - 1e-9).ceil() as i64;
    (first..).map(|k| k as f64 * step).take_while(|t| *t <= to + 1e-9 * step).collect()
}

pub fn text(svg: &mut String, x: f64, y: f64, anchor: &str, words: &str) {
    let words = escape(words);
    let _ =
        writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>");
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

pub fn page(width: f64, height: f64, title: &str, content: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\" fill=\"{INK}\">\n\
         <title>{0}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n{content}</svg>\n",
        escape(title)
    )
}

fn outline(segments: &[Segment]) -> Vec<Point> {
    let mut points = Vec::new();
    for segment in segments {
        let count = if matches!(segment.curve, Curve::Line { .. }) { 1 } else { 60 };
        points.extend((0..=count).map(|i| segment.point_at(i as f64 / count as f64)));
    }
    points
}

struct Section {
    wall: Vec<Point>,
    wetted: Vec<Point>,
    z_surface: f64,
    r_outer: f64,
}

fn section(tank: &Tank, data: &ModalData) -> Section {
    match (&tank.geometry, &data.wall) {
        (Geometry::Revolution { contour, .. }, Some(Wall { segments, r_outer, z_surface, .. })) => {
            Section {
                wall: outline(contour.segments()),
                wetted: outline(segments),
                z_surface: *z_surface,
                r_outer: *r_outer,
            }
        }
        (Geometry::Revolution { contour, .. }, None) => Section {
            wall: outline(contour.segments()),
            wetted: Vec::new(),
            z_surface: contour.bottom(),
            r_outer: 0.0,
        },
        (Geometry::Box { length_x, .. }, _) => {
            let (r, h) = (0.5 * length_x, data.fill);
            Section {
                wall: vec![[0.0, 0.0], [r, 0.0], [r, 1.25 * h]],
                wetted: vec![[0.0, 0.0], [r, 0.0], [r, h]],
                z_surface: h,
                r_outer: r,
            }
        }
    }
}

fn tank_frame(
    section: &Section,
    left: f64,
    top: f64,
    [most_wide, most_high]: [f64; 2],
    margin: f64,
) -> Frame {
    let r = section.wall.iter().map(|p| p[0]).fold(0.0, f64::max) * 1.06;
    let z = || section.wall.iter().map(|p| p[1]);
    let low = z().fold(f64::MAX, f64::min) - margin;
    let high = z().fold(f64::MIN, f64::max).max(section.z_surface + margin) + margin;
    let scale = (most_wide / (2.0 * r)).min(most_high / (high - low));
    Frame {
        left,
        top,
        width: 2.0 * r * scale,
        height: (high - low) * scale,
        x: [-r, r],
        y: [low, high],
    }
}

fn mirrored(points: &[Point]) -> Vec<Point> {
    points.iter().map(|p| [-p[0], p[1]]).collect()
}

fn draw_tank(svg: &mut String, frame: &Frame, section: &Section) {
    for side in [section.wetted.clone(), mirrored(&section.wetted)] {
        if let (Some(first), Some(last)) = (side.first().copied(), side.last().copied()) {
            let mut area = side;
            // the surface of the liquid ends at the inner contact line, or without one at the axis
            let inner = if (first[1] - section.z_surface).abs() < 1e-9 * last[0].abs() {
                first[0]
            } else {
                0.0
            };
            area.push([inner, section.z_surface]);
            let _ = writeln!(svg, "<path d=\"{}Z\" fill=\"{LIQUID}\"/>", frame.path(&area));
        }
    }
    let (x, _) = frame.place(0.0, 0.0);
    let _ = writeln!(
        svg,
        "<path d=\"M{x:.2} {}v{}\" stroke=\"{FAINT}\" stroke-dasharray=\"8 3 2 3\"/>",
        frame.top, frame.height
    );
    for side in [section.wall.clone(), mirrored(&section.wall)] {
        frame.curve(svg, &side, &format!("stroke=\"{INK}\" stroke-width=\"2\""));
    }
}

fn draw_modes(svg: &mut String, frame: &Frame, section: &Section, modes: &[Mode], height: f64) {
    for (mode, colour) in modes.iter().take(DRAWN).zip(COLOURS) {
        let peak = mode.shape.iter().map(|p| p[1].abs()).fold(0.0, f64::max);
        if peak == 0.0 {
            continue;
        }
        for sign in [1.0, -1.0] {
            let points: Vec<Point> = mode
                .shape
                .iter()
                .map(|[r, wave]| [sign * r, section.z_surface + sign * height * wave / peak])
                .collect();
            frame.curve(svg, &points, &format!("stroke=\"{colour}\" stroke-width=\"1.6\""));
        }
    }
    for sign in [1.0, -1.0] {
        let from = modes.first().and_then(|m| m.shape.first()).map_or(0.0, |p| p[0]);
        let line = [[sign * from, section.z_surface], [sign * section.r_outer, section.z_surface]];
        frame.curve(svg, &line, &format!("stroke=\"{INK}\" stroke-width=\"0.8\""));
    }
}

/// Draws the section of the tank with its liquid as SVG. For each mode it draws the free surface,
/// scaled to equal largest elevations, and, if the mode has more than 1 % of the mass and the
/// drawing has room, hinge and slosh mass of the pendulum. The frequencies in the legend hold at
/// the specific force `gravity`, m/s², unless the data have frequencies with surface tension.
pub fn tank(tank: &Tank, data: &ModalData, gravity: f64) -> String {
    let section = section(tank, data);
    let margin = 0.16 * section.wall.iter().map(|p| p[0]).fold(0.0, f64::max);
    let frame = tank_frame(&section, 80.0, 50.0, [460.0, 480.0], margin);
    let mut svg = String::new();
    draw_tank(&mut svg, &frame, &section);
    draw_modes(&mut svg, &frame, &section, &data.modes, 0.75 * margin);
    for (mode, colour) in
        data.modes.iter().take(DRAWN).zip(COLOURS).filter(|(m, _)| m.m_ratio > 0.01)
    {
        let (Some(bob), Some(hinge)) = (mode.height, mode.hinge) else { continue };
        let inside = |z: f64| z >= frame.y[0] && z <= frame.y[1];
        let (x, y) = frame.place(0.0, bob);
        let (_, top) = frame.place(0.0, hinge.min(frame.y[1]));
        if inside(bob) {
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.2} {y:.2}V{top:.2}\" stroke=\"{colour}\" stroke-width=\"1.6\"/>"
            );
            let _ =
                writeln!(svg, "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"5\" fill=\"{colour}\"/>");
        }
        if inside(hinge) {
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.2}\" cy=\"{top:.2}\" r=\"4\" fill=\"#fff\" stroke=\"{colour}\" stroke-width=\"1.6\"/>"
            );
        }
    }
    frame.axes(&mut svg, if data.kind == "box" { "x, m" } else { "r, m" }, Some("z, m"));
    // legend
    let x = frame.left + frame.width + 40.0;
    let name = data.name.as_deref().unwrap_or("tank");
    let title = format!("{name}, fill {} m", significant(data.fill));
    text(&mut svg, frame.left, 28.0, "start", &title);
    let mut y = 70.0;
    for line in [
        format!("liquid {} kg", three_digits(data.m_liq)),
        format!("centre of mass at {} m", three_digits(data.z_cg)),
        match &data.capillarity {
            Some(found) => {
                let [g, sigma] = [gravity, found.sigma].map(significant);
                format!("at g = {g} m/s², surface tension {sigma} N/m:")
            }
            None => format!("at g = {} m/s²:", significant(gravity)),
        },
    ] {
        text(&mut svg, x, y, "start", &line);
        y += 20.0;
    }
    let frequencies = data.frequencies(gravity, false);
    for ((mode, colour), f) in data.modes.iter().take(DRAWN).zip(COLOURS).zip(frequencies) {
        let _ = writeln!(
            svg,
            "<path d=\"M{x} {}h24\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            y - 4.0
        );
        let words = format!(
            "{}: {}, {} % of the mass",
            mode.n,
            f.map_or("frequency not known".to_string(), |f| format!("{} Hz", three_digits(f))),
            three_digits(100.0 * mode.m_ratio)
        );
        text(&mut svg, x + 32.0, y, "start", &words);
        y += 20.0;
    }
    y += 8.0;
    for line in ["filled: bob at rest, open: hinge", "surface shapes not to scale"] {
        text(&mut svg, x, y, "start", line);
        y += 18.0;
    }
    page(x + 280.0, (frame.top + frame.height + 60.0).max(y + 20.0), &title, &svg)
}

fn three_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let places = (2 - value.abs().log10().floor() as i64).clamp(0, 12) as usize;
    if places == 12 { format!("{value:.2e}") } else { format!("{value:.places$}") }
}

/// Draws a sweep over the fill as SVG: the tank on the left, and on the right the frequencies, mass
/// ratios and hinges of the modes at the same heights of the free surface. The frequencies hold at
/// the specific force `gravity`, m/s².
pub fn sweep(tank: &Tank, sweep: &Sweep, gravity: f64) -> String {
    let rows: Vec<&ModalData> = sweep.rows.iter().filter(|r| !r.modes.is_empty()).collect();
    let Some(last) = rows.last() else { return page(200.0, 60.0, "sweep", "") };
    let section = section(tank, last);
    let margin = 0.05 * section.wall.iter().map(|p| p[0]).fold(0.0, f64::max);
    let mut frame = tank_frame(&section, 80.0, 70.0, [320.0, 420.0], margin);
    // Next to a low tank the charts are higher than the tank, so that they can be read.
    let scale = (300.0 / frame.height).max(1.0);
    let chart_height = frame.height * scale;
    frame.top += 0.5 * (chart_height - frame.height);
    let mut svg = String::new();
    draw_tank(&mut svg, &frame, &section);
    for row in &rows {
        if let Some(wall) = &row.wall {
            for sign in [1.0, -1.0] {
                let line =
                    [[sign * wall.r_inner, wall.z_surface], [sign * wall.r_outer, wall.z_surface]];
                frame.curve(&mut svg, &line, &format!("stroke=\"{FAINT}\" stroke-width=\"0.6\""));
            }
        }
    }
    frame.axes(&mut svg, if last.kind == "box" { "x, m" } else { "r, m" }, Some("z, m"));
    let bottom = last.wall.as_ref().map_or(0.0, |w| w.z_surface - last.fill);
    let mut left = frame.left + frame.width + 90.0;
    type Quantity<'a> = (&'a str, &'a dyn Fn(&Mode) -> Option<f64>);
    let frequency = |m: &Mode| Some((gravity * m.lambda).sqrt() / core::f64::consts::TAU);
    let charts: [Quantity; 3] = [
        ("frequency, Hz", &frequency),
        ("mass over liquid", &|m| Some(m.m_ratio)),
        ("hinge of mode 1, m", &|m| m.hinge.filter(|_| m.n == 1)),
    ];
    for (k, (name, quantity)) in charts.iter().enumerate() {
        let all = rows.iter().flat_map(|r| r.modes.iter().take(DRAWN)).filter_map(quantity);
        let (mut low, mut high) = all.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
        if k < 2 {
            low = 0.0;
        }
        // All frequencies are 0 without gravity, and all hinges of a sphere are equal.
        if high - low < 1e-9 {
            (low, high) = (low - 0.5, high + 0.5);
        }
        let pad = 0.04 * (high - low).max(1e-3 * high.abs());
        (low, high) = (if k < 2 { 0.0 } else { low - pad }, high + pad);
        let chart = Frame {
            left,
            top: 70.0,
            width: 210.0,
            height: chart_height,
            x: [low, high],
            y: frame.y,
        };
        chart.axes(&mut svg, name, if k == 0 { Some("free surface at z, m") } else { None });
        for (n, colour) in COLOURS.iter().enumerate().take(DRAWN) {
            let points: Vec<Point> = rows
                .iter()
                .filter_map(|r| Some([quantity(r.modes.get(n)?)?, bottom + r.fill]))
                .collect();
            if !points.is_empty() {
                chart.curve(
                    &mut svg,
                    &points,
                    &format!("stroke=\"{colour}\" stroke-width=\"1.6\""),
                );
                for p in &points {
                    let (x, y) = chart.place(p[0], p[1]);
                    let _ = writeln!(
                        svg,
                        "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"2\" fill=\"{colour}\"/>"
                    );
                }
            }
        }
        left += 250.0;
    }
    let name = last.name.as_deref().unwrap_or("tank");
    let title = format!("{name}: modes over the fill, g = {} m/s²", significant(gravity));
    text(&mut svg, frame.left, 26.0, "start", &title);
    let mut x = frame.left;
    for (n, colour) in COLOURS.iter().enumerate().take(last.modes.len().min(DRAWN)) {
        let _ = writeln!(svg, "<path d=\"M{x} 44h24\" stroke=\"{colour}\" stroke-width=\"2\"/>");
        text(&mut svg, x + 30.0, 48.0, "start", &format!("mode {}", n + 1));
        x += 100.0;
    }
    page(left, 70.0 + chart_height + 60.0, &title, &svg)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axis_ticks_are_round_numbers_and_reach_both_ends_of_the_axis() {
        for unit in [1e-9, 1e-3, 1.0, 1e6] {
            for (range, count, first, step, number) in [
                ([0.0, 3.0], 4, 0.0, 1.0, 4),
                ([0.0, 3.0], 5, 0.0, 1.0, 4),
                ([-1.0, 1.0], 5, -1.0, 0.5, 5),
                ([0.1, 2.0], 8, 0.5, 0.5, 4),
                ([2.0, 12.0], 6, 2.0, 2.0, 6),
                ([0.0, 0.9], 0, 0.0, 0.5, 2),
                ([0.0, 0.9], 1, 0.0, 0.5, 2),
            ] {
                let found = ticks(range.map(|x| unit * x), count);
                assert_eq!(found.len(), number, "{unit} {range:?}: {found:?}");
                for (k, x) in found.iter().enumerate() {
                    let expected = unit * (first + step * k as f64);
                    assert!((x - expected).abs() < 1e-9 * unit, "{unit} {range:?}: {found:?}");
                }
            }
        }
    }
}

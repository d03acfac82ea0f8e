//! Reads a contour from the first path of an SVG drawing.

use std::path::Path;

use svgtypes::{PathParser, PathSegment};

use crate::contour::Problems;
use crate::curve::{Curve, Point, Segment, cross, dot, sub};

/// Reads the contour of a tank from the first `<path>` of an SVG drawing. In the drawing the axis
/// is at x = 0 and y points downwards; `scale` is in m per unit of the drawing. Lines, cubic and
/// quadratic curves, and arcs with unrotated axes are supported. Lines that close the path along
/// the axis are left out.
///
/// # Errors
/// A file that cannot be read; a file without a path, or with a transform, rotated arcs or several
/// subpaths.
pub(crate) fn read(path: &Path, scale: f64) -> Result<Vec<Segment>, Problems> {
    let text = crate::contour::read_text(path)
        .map_err(|why| Problems::from(format!("{}: {why}", path.display())))?;
    let segments = first_path(&text).and_then(|data| segments(&data, scale));
    segments.map_err(|fault| Problems::from(format!("{}: {fault}", path.display())))
}

#[derive(Debug, thiserror::Error)]
enum Fault {
    #[error("not well-formed: {0}.")]
    Malformed(#[from] roxmltree::Error),
    #[error("the element `{0}` has a transform; apply it in the drawing.")]
    Transform(String),
    #[error("contains no path.")]
    NoPath,
    #[error("the path is not valid: {0}.")]
    Path(#[from] svgtypes::Error),
    #[error("the path has several parts; one is needed.")]
    Parts,
    #[error("an arc has rotated axes; draw it as a curve.")]
    Rotated,
}

fn first_path(text: &str) -> Result<String, Fault> {
    // SVG files of drawing programs have a document type declaration.
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let drawing = roxmltree::Document::parse_with_options(text, options)?;
    for element in drawing.descendants().filter(roxmltree::Node::is_element) {
        let name = element.tag_name().name();
        if element.has_attribute("transform") {
            return Err(Fault::Transform(name.into()));
        }
        if let ("path", Some(data)) = (name, element.attribute("d")) {
            return Ok(data.into());
        }
    }
    Err(Fault::NoPath)
}

fn segments(data: &str, scale: f64) -> Result<Vec<Segment>, Fault> {
    let mut segments: Vec<Segment> = Vec::new();
    // present point and start of the path, in the coordinates of the drawing
    let (mut here, mut start) = ([0.0, 0.0], [0.0, 0.0]);
    let mut control: Option<(Point, bool)> = None; // last control point, of a cubic
    let place = |p: Point| [scale * p[0], -scale * p[1]];
    for part in PathParser::from(data) {
        let part = part?;
        let to = |abs: bool, x: f64, y: f64| if abs { [x, y] } else { [here[0] + x, here[1] + y] };
        // the mirrored last control point, with which smooth curves begin
        let mirrored = |cubic: bool| match control {
            Some((c, kind)) if kind == cubic => [2.0 * here[0] - c[0], 2.0 * here[1] - c[1]],
            _ => here,
        };
        let mut next = None;
        let end = match part {
            PathSegment::MoveTo { abs, x, y } => {
                if !segments.is_empty() {
                    return Err(Fault::Parts);
                }
                start = to(abs, x, y);
                here = start;
                continue;
            }
            PathSegment::LineTo { abs, x, y } => to(abs, x, y),
            PathSegment::HorizontalLineTo { abs, x } => [to(abs, x, 0.0)[0], here[1]],
            PathSegment::VerticalLineTo { abs, y } => [here[0], to(abs, 0.0, y)[1]],
            PathSegment::ClosePath { .. } => start,
            PathSegment::CurveTo { abs, x1, y1, x2, y2, x, y } => {
                let (b, c, d) = (to(abs, x1, y1), to(abs, x2, y2), to(abs, x, y));
                next = Some((c, true));
                segments.push(bezier([here, b, c, d].map(place)));
                d
            }
            PathSegment::SmoothCurveTo { abs, x2, y2, x, y } => {
                let (b, c, d) = (mirrored(true), to(abs, x2, y2), to(abs, x, y));
                next = Some((c, true));
                segments.push(bezier([here, b, c, d].map(place)));
                d
            }
            PathSegment::Quadratic { abs, x1, y1, x, y } => {
                let (c, d) = (to(abs, x1, y1), to(abs, x, y));
                next = Some((c, false));
                segments.push(cubic_from_quadratic([here, c, d].map(place)));
                d
            }
            PathSegment::SmoothQuadratic { abs, x, y } => {
                let (c, d) = (mirrored(false), to(abs, x, y));
                next = Some((c, false));
                segments.push(cubic_from_quadratic([here, c, d].map(place)));
                d
            }
            PathSegment::EllipticalArc { abs, rx, ry, x_axis_rotation, large_arc, sweep, x, y } => {
                if x_axis_rotation != 0.0 && rx != ry {
                    return Err(Fault::Rotated);
                }
                let d = to(abs, x, y);
                // y is mirrored, which also reverses the sense of rotation.
                segments.push(arc(
                    place(here),
                    place(d),
                    scale * rx,
                    scale * ry,
                    large_arc,
                    !sweep,
                ));
                d
            }
        };
        let curved = next.is_some() || matches!(part, PathSegment::EllipticalArc { .. });
        if !curved && end != here {
            segments.push(Segment::line(place(here), place(end)));
        }
        control = next;
        here = end;
    }
    segments.retain(|s| {
        s.start()[0] != 0.0 || s.end()[0] != 0.0 || !matches!(s.curve, Curve::Line { .. })
    });
    Ok(segments)
}

fn bezier([a, b, c, d]: [Point; 4]) -> Segment {
    let coefficients = core::array::from_fn(|k| {
        core::array::from_fn(|i| match k {
            0 => a[i],
            1 => 3.0 * (b[i] - a[i]),
            2 => 3.0 * (a[i] - 2.0 * b[i] + c[i]),
            _ => d[i] - 3.0 * c[i] + 3.0 * b[i] - a[i],
        })
    });
    Segment { curve: Curve::Cubic { c: coefficients }, from: 0.0, to: 1.0 }
}

fn cubic_from_quadratic([a, b, c]: [Point; 3]) -> Segment {
    let third = |p: Point, q: Point| [(p[0] + 2.0 * q[0]) / 3.0, (p[1] + 2.0 * q[1]) / 3.0];
    bezier([a, third(a, b), third(c, b), c])
}

/// Creates the arc of an ellipse with the radii `rx` and `ry` from `p` to `q`: the longer of the
/// two arcs if `large` is true, and counter-clockwise if `up` is true (SVG 2, appendix B.2.4).
fn arc(p: Point, q: Point, rx: f64, ry: f64, large: bool, up: bool) -> Segment {
    let (rx, ry) = (rx.abs(), ry.abs());
    // both points in coordinates in which the ellipse is a unit circle
    let (u, v) = ([p[0] / rx, p[1] / ry], [q[0] / rx, q[1] / ry]);
    let half = [0.5 * (v[0] - u[0]), 0.5 * (v[1] - u[1])];
    let square = dot(half, half);
    let grow = square.max(1.0).sqrt(); // too small an ellipse grows
    let rise = (grow * grow / square - 1.0).max(0.0).sqrt();
    let side = if large == up { -1.0 } else { 1.0 };
    let center =
        [0.5 * (u[0] + v[0]) - side * rise * half[1], 0.5 * (u[1] + v[1]) + side * rise * half[0]];
    let (a, b) = (sub(u, center), sub(v, center));
    let from = a[1].atan2(a[0]);
    let mut turn = cross(a, b).atan2(dot(a, b));
    if up && turn < 0.0 {
        turn += core::f64::consts::TAU;
    } else if !up && turn > 0.0 {
        turn -= core::f64::consts::TAU;
    }
    let curve =
        Curve::Ellipse { center: [rx * center[0], ry * center[1]], a_r: grow * rx, a_z: grow * ry };
    Segment { curve, from, to: from + turn }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{PI, TAU};

    /// Between (2, 0) and (0, 1) of an ellipse of 2 by 1 there are four arcs: a quarter or three
    /// quarters of the ellipse, about one of two centres and in either direction.
    #[test]
    fn the_four_svg_arcs_between_two_points_have_the_expected_turns_and_centres() {
        let (p, q) = ([2.0, 0.0], [0.0, 1.0]);
        for (large, up, center, turn) in [
            (false, true, [0.0, 0.0], 0.25 * TAU),
            (true, true, [2.0, 1.0], 0.75 * TAU),
            (true, false, [0.0, 0.0], -0.75 * TAU),
            (false, false, [2.0, 1.0], -0.25 * TAU),
        ] {
            for size in [1.0, 3.0] {
                let scaled = |p: Point| p.map(|x| size * x);
                let found = arc(scaled(p), scaled(q), 2.0 * size, -size, large, up);
                let Curve::Ellipse { center: c, a_r, a_z } = found.curve else { panic!() };
                let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-15 * 8.0 * size, "{a} {b}");
                close(found.to - found.from, turn);
                for i in 0..2 {
                    close(c[i], size * center[i]);
                    close(found.curve.point_at(found.from)[i], size * p[i]);
                    close(found.curve.point_at(found.to)[i], size * q[i]);
                }
                close(a_r, 2.0 * size);
                close(a_z, size);
            }
        }
    }

    /// An ellipse that is too small to connect two points is enlarged until it connects them, as the
    /// SVG standard demands.
    #[test]
    fn an_svg_arc_that_is_too_small_is_enlarged() {
        let found = arc([0.0, 0.0], [4.0, 0.0], 1.0, 0.5, false, true);
        let Curve::Ellipse { center, a_r, a_z } = found.curve else { panic!() };
        assert_eq!((center, a_r, a_z), ([2.0, 0.0], 2.0, 1.0));
        assert!((found.to - found.from - PI).abs() < 1e-15);
    }

    /// The short form of a curve leaves out the first control point. This point is then the mirror
    /// image of the previous curve's last control point or, if the previous curve is of another
    /// kind, the start of the curve.
    #[test]
    fn short_commands_of_an_svg_path_equal_the_long_commands() {
        let read = |path: &str| segments(path, 0.5).unwrap();
        let start = "M 1 5 ";
        for (short, long) in [
            ("C 1 4 2 4 3 3 S 5 2 6 2", "C 1 4 2 4 3 3 C 4 2 5 2 6 2"),
            ("C 1 4 2 4 3 3 s 2 -1 3 -1", "C 1 4 2 4 3 3 C 4 2 5 2 6 2"),
            ("S 2 4 3 3", "C 1 5 2 4 3 3"),
            ("Q 2 5 3 4 T 5 3", "Q 2 5 3 4 Q 4 3 5 3"),
            ("Q 2 5 3 4 t 2 -1", "Q 2 5 3 4 Q 4 3 5 3"),
            ("T 5 3", "Q 1 5 5 3"),
            ("Q 2 5 3 4 S 5 2 6 2", "Q 2 5 3 4 C 3 4 5 2 6 2"),
            ("L 3 4 T 5 3", "L 3 4 Q 3 4 5 3"),
            ("H 4 V 2", "L 4 5 L 4 2"),
            ("h 3 v -3", "L 4 5 L 4 2"),
            ("L 4 4 L 3 2 Z", "L 4 4 L 3 2 L 1 5"),
        ] {
            assert_eq!(
                read(&format!("{start}{short}")),
                read(&format!("{start}{long}")),
                "{short}"
            );
        }
        // zero-length segments and lines along the axis are left out
        assert_eq!(read("M 1 5 L 1 5 L 2 5").len(), 1);
        assert_eq!(read("M 0 5 L 2 5 L 0 1 L 0 3 Z").len(), 2);
        let [line] = &read("M 1 5 l 2 -1")[..] else { panic!() };
        assert_eq!([line.start(), line.end()], [[0.5, -2.5], [1.5, -2.0]]);
    }
}

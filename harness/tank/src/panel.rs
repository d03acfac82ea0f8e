//! The boundary of the liquid cut into panels, and points on them.

use crate::curve::{Curve, Point, Segment, add, cross, dot, norm, sub};

pub(crate) type Corner = usize;

/// Part of a segment of the boundary over which the solution is smooth, with its own coordinate v =
/// 0..1. The curve's parameter, counted from the segment's end if `end` is true and otherwise from
/// its start, is `s0` + `length` v^gamma.
///
/// At a corner with the interior angle al of the liquid, the potential behaves as rho^nu with nu =
/// pi/al and the distance rho from the corner. If gamma is large enough, it is a smooth function of
/// v, and so are the singular parts of all kernels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel {
    pub(crate) segment: usize,
    pub(crate) end: bool,
    s0: f64,
    length: f64,
    pub(crate) gamma: f64,
    pub(crate) nu: f64,
}

/// A point of the boundary with its data for the integral equation.
///
/// - `p`, `n`: position, and unit normal out of the liquid.
/// - `speed`: derivative ds/dv of the arc length with respect to the panel's coordinate, m.
/// - `t`, `from_start`, `to_end`: parameter of the curve, and its distances from the two ends of
///   the segment.
/// - `corner`, `offset`: the nearer end of the segment, and the vector from this end to the point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoundaryPoint {
    pub(crate) p: Point,
    pub(crate) n: Point,
    pub(crate) speed: f64,
    segment: usize,
    t: f64,
    from_start: f64,
    to_end: f64,
    corner: Corner,
    offset: Point,
}

/// Boundary of the liquid: the segments of the wall, and after them the free surface,
/// counter-clockwise in (r, z).
///
/// - `surface`: index of the free surface; without a free surface the number of segments.
/// - `ends`: end points of every segment. An end point on the axis has exactly the radius 0.
/// - `grading`: exponents (gamma, nu) at the start and at the end of every segment, see [`Panel`].
#[derive(Clone, Debug)]
pub(crate) struct Boundary {
    pub(crate) segments: Vec<Segment>,
    pub(crate) surface: usize,
    ends: Vec<[Point; 2]>,
    grading: Vec<[(f64, f64); 2]>,
}

impl Boundary {
    pub(crate) fn new(wall: &[Segment]) -> Boundary {
        let mut segments = wall.to_vec();
        let (inner, outer) = (wall[0].start(), wall[wall.len() - 1].end());
        // A full tank has no surface: its wall ends on the axis or at its start.
        let open = outer[0] > 0.0 && norm(sub(outer, inner)) > 1e-9 * outer[0];
        if open {
            let inner = if inner[0] > 0.0 { inner[0] } else { 0.0 };
            segments.push(Segment::line(outer, [inner, outer[1]]));
        }
        let surface = wall.len();
        let ends: Vec<_> = segments.iter().map(|s| [s.start(), s.end()]).collect();
        let count = segments.len();
        let mut grading = vec![[(1.0, 1.0); 2]; count];
        for i in 0..count {
            let next = (i + 1) % count;
            let before = segments[i].tangent(1.0);
            let after = segments[next].tangent(0.0);
            if i + 1 == count && inner[0] <= 0.0 {
                // An apex on the axis is a corner, but the middle of the free surface is not.
                let apex = |tangent: Point| if tangent[1].abs() < 1e-9 { 1.0 } else { APEX };
                (grading[i][1].0, grading[next][0].0) = (apex(before), apex(after));
                continue;
            }
            // In a cusp the tangents do not determine the inside. The curves shortly before and after the cusp do.
            let inner = cross(segments[i].tangent(0.999), segments[next].tangent(0.001));
            let cusp = cross(before, after).atan2(dot(before, after)).abs() > 3.13 && inner > 0.0;
            let corner = if cusp { (1.0, 1.0) } else { grading_at(before, after, count > FEW) };
            grading[i][1] = corner;
            grading[next][0] = corner;
        }
        Boundary { segments, surface, ends, grading }
    }

    pub(crate) fn point(&self, panel: &Panel, v: f64) -> BoundaryPoint {
        let segment = &self.segments[panel.segment];
        let (power, slope) = if panel.gamma == 1.0 {
            (v, 1.0)
        } else {
            let power = v.powi(panel.gamma as i32);
            (power, panel.gamma * power / v)
        };
        let s = panel.s0 + panel.length * power;
        let total = (segment.to - segment.from).abs();
        let sign = (segment.to - segment.from).signum();
        let (from_start, to_end) = if panel.end { (total - s, s) } else { (s, total - s) };
        let t = if panel.end { segment.to - sign * s } else { segment.from + sign * s };
        let near_end = to_end < from_start;
        let offset = if near_end {
            segment.curve.chord(segment.to, -sign * to_end)
        } else {
            segment.curve.chord(segment.from, sign * from_start)
        };
        let p = add(self.ends[panel.segment][usize::from(near_end)], offset);
        let d = segment.curve.slope(t);
        let length = norm(d);
        BoundaryPoint {
            p,
            n: [sign * d[1] / length, -sign * d[0] / length],
            speed: length * panel.length * slope,
            segment: panel.segment,
            t,
            from_start,
            to_end,
            corner: (panel.segment + usize::from(near_end)) % self.segments.len(),
            offset,
        }
    }

    /// Returns the vector y - x between two points of the boundary, to full relative accuracy even
    /// if both are near a corner.
    pub(crate) fn difference(&self, x: &BoundaryPoint, y: &BoundaryPoint) -> Point {
        if x.segment == y.segment {
            let segment = &self.segments[x.segment];
            let sign = (segment.to - segment.from).signum();
            let near_end = x.to_end.min(y.to_end) < x.from_start.min(y.from_start);
            let dt = if near_end { x.to_end - y.to_end } else { y.from_start - x.from_start };
            segment.curve.chord(x.t, sign * dt)
        } else if x.corner == y.corner && x.p[0].min(y.p[0]) >= 0.0 && !self.is_on_axis(x.corner) {
            sub(y.offset, x.offset)
        } else {
            sub(y.p, x.p)
        }
    }

    /// Returns the place s on the panel's curve that is nearest to a point x, and its distance from
    /// x. s is the fraction of the panel up to this place; it may lie outside 0..1, because the
    /// curve is continued beyond the panel. The distance is divided by the length of the derivative
    /// of the curve with respect to s. `w` is the vector from the start of the panel to x.
    pub(crate) fn foot(&self, panel: &Panel, w: Point) -> [f64; 2] {
        let segment = &self.segments[panel.segment];
        let run = (segment.to - segment.from).signum();
        let sign = if panel.end { -run } else { run };
        let t0 = if panel.end { segment.to } else { segment.from } + sign * panel.s0;
        let step = sign * panel.length;
        let whole = segment.curve.chord(t0, step);
        let mut s = (dot(w, whole) / dot(whole, whole)).clamp(-1.0, 2.0);
        let straight = matches!(segment.curve, Curve::Line { .. });
        let (mut residual, mut slope) = (sub(w, [s * whole[0], s * whole[1]]), whole);
        for _ in 0..if straight { 0 } else { 4 } {
            residual = sub(w, segment.curve.chord(t0, s * step));
            let d = segment.curve.slope(t0 + s * step);
            slope = [d[0] * step, d[1] * step];
            s = (s + dot(residual, slope) / dot(slope, slope)).clamp(-1.0, 2.0);
        }
        if straight && (-1.0..=2.0).contains(&s) {
            return [s, norm(residual) / norm(whole)];
        }
        [s, norm(residual) / norm(slope)]
    }

    fn is_on_axis(&self, corner: Corner) -> bool {
        corner == 0 && self.ends[0][0][0] == 0.0
    }

    /// Cuts the boundary into panels over which the solution is smooth, for `modes` modes. No panel
    /// turns by more than 60 degrees. No panel is long compared with the free surface, with its
    /// distance from the free surface or from another part of the boundary, or with its neighbours.
    /// `fine` gives shorter panels, for contours with details that the usual panels do not resolve.
    pub(crate) fn panels(&self, modes: usize, fine: bool) -> Vec<Panel> {
        // In a thin layer or a cusp, short panels would be too many, so that longer panels are allowed.
        let (width, many) = if fine { (0.6 * WIDTH, 2 * MANY) } else { (WIDTH, MANY) };
        let gaps = if fine { [1.0, 4.0, 16.0] } else { [2.5, 10.0, 40.0] };
        for gap in gaps {
            if let Some(panels) = self.panels_for(modes, gap, width, many) {
                return panels;
            }
        }
        self.panels_for(modes, f64::INFINITY, width, many).unwrap_or_default()
    }

    #[cfg(test)]
    pub(crate) fn halve(panels: &[Panel]) -> Vec<Panel> {
        let halves = |panel: &Panel| {
            let length = 0.5 * panel.length;
            let inner = Panel { length, ..*panel };
            // Only the half of the panel at the corner is graded.
            let outer = Panel { s0: panel.s0 + length, gamma: 1.0, nu: 1.0, ..inner };
            // the two halves in the order along the contour
            if panel.end { [outer, inner] } else { [inner, outer] }
        };
        panels.iter().flat_map(halves).collect()
    }

    /// Returns panels that are at most `gap` times as long as their distance from another part of
    /// the boundary. On the free surface a panel is at most the fraction `width` of the surface's
    /// width, and shorter for more than five `modes`. The result is `None` if there would be more
    /// than `many` panels.
    fn panels_for(&self, modes: usize, gap: f64, width: f64, many: usize) -> Option<Vec<Panel>> {
        // The n-th mode has n half waves on the surface.
        let (longest, z_surface) = match self.ends.get(self.surface) {
            Some([a, b]) => (width * norm(sub(*a, *b)) * (5.0 / modes as f64).min(1.0), a[1]),
            None => (f64::INFINITY, 0.0),
        };
        let mut pieces: Vec<Piece> = Vec::new();
        for (i, segment) in self.segments.iter().enumerate() {
            let [start, end] = self.grading[i];
            let both = start.0 > 1.0 && end.0 > 1.0;
            let count = (segment.turn() / 1.05).ceil().max(if both { 2.0 } else { 1.0 });
            for j in 0..count as usize {
                pieces.push(Piece::new(segment, i, j as f64 / count, (j + 1) as f64 / count));
            }
        }
        let joined = self.ends[0][0][0] > 0.0; // the chain is closed
        for _ in 0..200 {
            let count = pieces.len();
            if gap.is_finite() && count > many.max(2 * self.segments.len()) {
                return None;
            }
            let too_long = |k: usize| {
                let piece = &pieces[k];
                let depth = piece.points.iter().map(|p| z_surface - p[1]).fold(f64::MAX, f64::min);
                if piece.length > longest + 1.5 * depth.max(0.0) {
                    return true;
                }
                (0..count).any(|other| {
                    let apart = (k as isize - other as isize).unsigned_abs();
                    let neighbours = apart == 1 || (joined && apart == count - 1);
                    if apart == 0 {
                        false
                    } else if neighbours {
                        piece.length > 3.0 * pieces[other].length
                    } else {
                        gap.is_finite() && piece.length > gap * piece.distance(&pieces[other])
                    }
                })
            };
            let cut: Vec<bool> = (0..count).map(too_long).collect();
            if !cut.contains(&true) {
                break;
            }
            pieces = pieces
                .iter()
                .zip(&cut)
                .flat_map(|(piece, cut)| {
                    let segment = &self.segments[piece.segment];
                    let middle = 0.5 * (piece.from + piece.to);
                    if *cut {
                        vec![
                            Piece::new(segment, piece.segment, piece.from, middle),
                            Piece::new(segment, piece.segment, middle, piece.to),
                        ]
                    } else {
                        vec![piece.clone()]
                    }
                })
                .collect();
        }
        Some(pieces.iter().map(|piece| self.panel(piece)).collect())
    }

    fn panel(&self, piece: &Piece) -> Panel {
        let segment = &self.segments[piece.segment];
        let total = (segment.to - segment.from).abs();
        let [start, end] = self.grading[piece.segment];
        let (at_start, at_end) = (piece.from == 0.0, piece.to == 1.0);
        let ((gamma, nu), from_end) = match (at_start && start.0 > 1.0, at_end && end.0 > 1.0) {
            (true, _) => (start, false),
            (_, true) => (end, true),
            _ => ((1.0, 1.0), 1.0 - piece.to < piece.from),
        };
        let s0 = if from_end { (1.0 - piece.to) * total } else { piece.from * total };
        let length = (piece.to - piece.from) * total;
        Panel { segment: piece.segment, end: from_end, s0, length, gamma, nu }
    }
}

const FEW: usize = 12;
const MANY: usize = 36;
const WIDTH: f64 = 0.35;
/// Exponent gamma that concentrates points near an apex on the axis. The potential near an apex is
/// a power of the distance with an exponent between 0.8 and 2, except for very slender cones.
const APEX: f64 = 4.0;

/// Returns the exponents gamma and nu (see [`Panel`]) at a corner between the directions of travel
/// `before` and `after`. gamma is a whole number, so that the curve is an analytic function of v.
/// At a corner it is the smallest number for which gamma nu is at least 6, but not above 9. If
/// `many` is true, the contour has many short segments; joints at which it turns by less than 0.3
/// rad then get a smaller gamma, because such weak corners need no panels of their own.
fn grading_at(before: Point, after: Point, many: bool) -> (f64, f64) {
    let turn = cross(before, after).atan2(dot(before, after));
    let nu = core::f64::consts::PI / (core::f64::consts::PI - turn);
    let gamma = match turn.abs() {
        ..0.1 if many => 1.0,
        ..0.3 if many => 2.0,
        ..1e-9 => 3.0, // where the curvature jumps: rho^2 log rho
        _ => (6.0 / nu).ceil().clamp(1.0, 9.0),
    };
    (gamma, nu)
}

#[derive(Clone, Debug)]
struct Piece {
    segment: usize,
    from: f64,
    to: f64,
    points: [Point; 9],
    length: f64,
}

impl Piece {
    fn new(segment: &Segment, index: usize, from: f64, to: f64) -> Piece {
        let points =
            core::array::from_fn(|i| segment.point_at(from + (to - from) * i as f64 / 8.0));
        let length = points.windows(2).map(|p: &[Point]| norm(sub(p[1], p[0]))).sum();
        Piece { segment: index, from, to, points, length }
    }

    fn distance(&self, other: &Piece) -> f64 {
        let pairs = self.points.iter().flat_map(|a| other.points.iter().map(move |b| (a, b)));
        pairs.map(|(a, b)| norm(sub(*a, *b))).fold(f64::MAX, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gauss::Gauss;
    use core::f64::consts::PI;

    fn sphere() -> Vec<Segment> {
        vec![Segment::arc([0.0, 0.0], 0.8, -90.0, 20.0)]
    }

    fn step() -> Vec<Segment> {
        vec![
            Segment::line([0.0, 0.3], [0.4, 0.3]),
            Segment::line([0.4, 0.3], [0.4, 0.0]),
            Segment::line([0.4, 0.0], [0.9, 0.0]),
            Segment::line([0.9, 0.0], [0.9, 0.7]),
        ]
    }

    fn ring() -> Vec<Segment> {
        vec![Segment::arc([1.1, 0.2], 0.5, -200.0, 20.0)]
    }

    /// nu is the exponent of the potential near a corner, and gamma the exponent that concentrates
    /// points there. An angle of pi/2 in the liquid has nu = 2, a re-entrant corner with 3 pi/2 has
    /// nu = 2/3. A cusp gets the largest gamma. At a jump of the curvature gamma is 3, because the
    /// term rho^2 log rho of the potential is then smooth.
    #[test]
    fn the_grading_of_panels_at_a_corner_follows_from_its_angle() {
        let at = |degrees: f64, many: bool| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            grading_at([1.0, 0.0], [cos, sin], many)
        };
        for (turn, gamma, nu) in [
            (90.0, 3.0, 2.0),
            (-90.0, 9.0, 2.0 / 3.0),
            (0.0, 3.0, 1.0),
            (62.0, 4.0, 180.0 / 118.0),
            (45.0, 5.0, 4.0 / 3.0),
            (-179.0, 9.0, 180.0 / 359.0),
            (152.0, 1.0, 180.0 / 28.0),
        ] {
            let found = at(turn, false);
            assert_eq!(found.0, gamma, "{turn}");
            assert!((found.1 / nu - 1.0).abs() < 1e-12, "{turn} {found:?}");
        }
        // 0.1 and 0.3 rad are 5.7 and 17.2 degrees
        for (turn, gamma) in [(5.7, 1.0), (-5.7, 1.0), (5.8, 2.0), (-17.1, 2.0), (17.3, 6.0)] {
            assert_eq!(at(turn, true).0, gamma, "{turn}");
        }
        assert_eq!(at(1.0, false).0, 6.0);
    }

    /// The points of each panel lie between its ends, and panels follow one another along the
    /// boundary; ds/dv is the derivative of the arc length; normals point outwards; the lengths of
    /// the panels add up to the length of the boundary.
    #[test]
    fn panels_cover_the_whole_boundary_without_gap_or_overlap() {
        let cap = 0.8 * 20f64.to_radians().cos();
        let gap = 2.0 * 0.5 * 20f64.to_radians().cos();
        for (wall, whole) in [
            (sphere(), 0.8 * 110f64.to_radians() + cap),
            (step(), 0.4 + 0.3 + 0.5 + 0.7 + 0.9),
            (ring(), 0.5 * 220f64.to_radians() + gap),
        ] {
            let boundary = Boundary::new(&wall);
            assert_eq!(boundary.surface, wall.len());
            for fine in [false, true] {
                let panels = boundary.panels(3, fine);
                let ends = |panel: &Panel| {
                    let ends = [1e-300, 1.0].map(|v| boundary.point(panel, v).p);
                    if panel.end { [ends[1], ends[0]] } else { ends }
                };
                for pair in panels.windows(2) {
                    let gap = norm(sub(ends(&pair[0])[1], ends(&pair[1])[0]));
                    assert!(gap < 1e-15, "{gap:e} {pair:?}");
                }
                let rule = Gauss::new(24);
                let mut length = 0.0;
                for panel in &panels {
                    for (v, w) in rule.nodes.iter().zip(&rule.weights) {
                        length += w * boundary.point(panel, *v).speed;
                    }
                    for v in [0.3, 0.6, 0.9] {
                        let h = 1e-5;
                        let [a, x, b] = [v - h, v, v + h].map(|v| boundary.point(panel, v));
                        let slope = sub(b.p, a.p).map(|d| 0.5 * d / h);
                        // error of the finite difference: h^2 times the third derivative of v^9, 504 of the length
                        assert!((norm(slope) - x.speed).abs() < 1e-7, "{panel:?}");
                        assert!(dot(slope, x.n).abs() < 1e-7 && (norm(x.n) - 1.0).abs() < 1e-15);
                        // the liquid is to the left of the direction of travel
                        let way = if panel.end { -1.0 } else { 1.0 };
                        assert!(way * cross(slope, x.n) < 0.0, "{panel:?}");
                        assert!(norm(sub(boundary.difference(&a, &b), sub(b.p, a.p))) < 1e-15);
                    }
                }
                assert!((length / whole - 1.0).abs() < 1e-13, "{length} {whole}");
            }
        }
    }

    #[test]
    fn distances_between_points_near_a_corner_have_full_relative_accuracy() {
        let boundary = Boundary::new(&step());
        let panels = boundary.panels(3, false);
        let corner = |segment: usize, end: bool| {
            let own = |p: &&Panel| p.segment == segment && p.end == end && p.gamma > 1.0;
            *panels.iter().find(own).unwrap()
        };
        // the inner edge of the floor, nu = 2/3 and gamma = 9: along -r on the upper floor, down
        // the step
        let (above, below) = (corner(0, true), corner(1, false));
        for (v, w) in [(1e-3, 2e-3), (0.01, 0.02), (0.5, 0.3)] {
            let [x, y] = [v, w].map(|v| boundary.point(&above, v));
            let across = boundary.point(&below, w);
            let along = |panel: &Panel, v: f64| {
                boundary.segments[panel.segment].size() * panel.length * v.powi(9)
            };
            let (dx, dy) = (along(&above, v), along(&above, w));
            let same = boundary.difference(&x, &y);
            assert!((same[0] / (dx - dy) - 1.0).abs() < 1e-13 && same[1] == 0.0, "{same:?}");
            let other = boundary.difference(&x, &across);
            assert!((other[0] / dx - 1.0).abs() < 1e-13, "{other:?}");
            assert!((other[1] / -along(&below, w) - 1.0).abs() < 1e-13, "{other:?}");
        }
    }

    /// The nearest place to a point near an arc has the same polar angle as the point. Each of the
    /// four iterations multiplies the error by the distance of the point from the arc divided by
    /// the radius of the arc, which is about 0.1 here.
    #[test]
    fn the_nearest_place_on_a_panel_is_found_for_every_point() {
        for wall in [sphere(), ring(), step()] {
            let boundary = Boundary::new(&wall);
            for panel in boundary.panels(3, false) {
                let start = boundary.point(&panel, 1e-300).p;
                for (v, off) in [(0.2f64, 0.1), (0.5, -0.05), (0.8, 0.3), (1.0, 0.0)] {
                    let x = boundary.point(&panel, v);
                    let p = add(x.p, x.n.map(|n| off * 0.2 * n));
                    let [s, distance] = boundary.foot(&panel, sub(p, start));
                    let power = v.powf(panel.gamma);
                    let local = x.speed * v / (panel.gamma * power);
                    assert!((s - power).abs() < 1e-5, "{panel:?}: {s} {power}");
                    assert!((distance - 0.2 * f64::abs(off) / local).abs() < 1e-5, "{distance}");
                }
            }
        }
    }

    #[test]
    fn a_full_sphere_has_three_panels() {
        let boundary = Boundary::new(&[Segment::arc([0.0, 0.0], 1.0, -90.0, 90.0)]);
        assert_eq!((boundary.surface, boundary.segments.len()), (1, 1));
        let panels = boundary.panels(1, false);
        assert_eq!(panels.len(), 3);
        for panel in panels {
            let [a, b] = [1e-300, 1.0].map(|v| boundary.point(&panel, v).n);
            assert!((dot(a, b).acos() - PI / 3.0).abs() < 1e-12);
        }
    }

    #[test]
    fn adjacent_panels_of_a_contour_have_similar_lengths() {
        let fine = [
            Segment::line([1.0, 0.01], [1.0, 0.0]),
            Segment::line([1.0, 0.0], [2.0, 0.0]),
            Segment::line([2.0, 0.0], [2.0, 0.01]),
        ];
        for wall in [sphere(), ring(), step(), fine.to_vec()] {
            let boundary = Boundary::new(&wall);
            for fine in [false, true] {
                let panels = boundary.panels(3, fine);
                let length = |panel: &Panel| {
                    let [a, b] = [1e-300, 1.0].map(|v| boundary.point(panel, v).p);
                    // a chord divided by its arc, for an arc of at most 60 degrees
                    (norm(sub(a, b)), norm(sub(a, b)) * (PI / 6.0) / 0.5)
                };
                let mut pairs: Vec<_> = panels.windows(2).map(|p| [p[0], p[1]]).collect();
                if wall[0].start()[0] > 0.0 {
                    pairs.push([panels[panels.len() - 1], panels[0]]);
                }
                for [a, b] in pairs {
                    assert!(
                        length(&a).0 <= 3.0 * length(&b).1 && length(&b).0 <= 3.0 * length(&a).1,
                        "{a:?} {b:?}"
                    );
                }
            }
        }
    }
}

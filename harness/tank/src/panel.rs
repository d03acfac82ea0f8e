//! The boundary of the liquid cut into panels, and points on them.

use crate::curve::{Curve, Point, Segment, add, cross, dot, norm, sub};

/// A corner of the boundary, by the index of the segment that starts there.
pub(crate) type Corner = usize;

/// Part of a segment, with a coordinate v = 0..1 of its own: seen from the segment's `end` (or
/// start), the curve's parameter is s = s0 + length v^gamma.
///
/// At a corner of interior angle al the velocity potential goes as rho^(pi/al), rho the distance;
/// with gamma > 1 it is a smooth function of v, and so are all of the kernels' singular parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel {
    pub(crate) segment: usize,
    pub(crate) end: bool,
    s0: f64,
    length: f64,
    pub(crate) gamma: f64,
    /// Exponent nu of rho^nu at the corner, if gamma > 1.
    pub(crate) nu: f64,
}

/// A point of the boundary as the integral equation needs it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoundaryPoint {
    pub(crate) p: Point,
    /// Unit normal out of the liquid.
    pub(crate) n: Point,
    /// ds/dv, m.
    pub(crate) speed: f64,
    segment: usize,
    /// Curve's parameter, its distance from the segment's start and from its end.
    t: f64,
    from_start: f64,
    to_end: f64,
    /// The nearer end of the segment, and the vector from there.
    corner: Corner,
    offset: Point,
}

/// Segments of the wall, then of the free surface, counter-clockwise in (r, z).
#[derive(Clone, Debug)]
pub(crate) struct Boundary {
    pub(crate) segments: Vec<Segment>,
    /// Index of the free surface among the segments; their number if there is none.
    pub(crate) surface: usize,
    /// Starts and ends, exact on the axis.
    ends: Vec<[Point; 2]>,
    /// (gamma, nu) at the start and the end of every segment.
    grading: Vec<[(f64, f64); 2]>,
}

impl Boundary {
    /// `wall` from the axis or the inner contact line to the outer one, cut at the free surface.
    pub(crate) fn new(wall: &[Segment]) -> Boundary {
        let mut segments = wall.to_vec();
        let (inner, outer) = (wall[0].start(), wall[wall.len() - 1].end());
        // A full tank has no surface: its wall ends on the axis or where it began.
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
                // An apex on the axis is a corner; the middle of the surface is not.
                let apex = |tangent: Point| if tangent[1].abs() < 1e-9 { 1.0 } else { APEX };
                (grading[i][1].0, grading[next][0].0) = (apex(before), apex(after));
                continue;
            }
            // In a cusp the tangents do not tell the inside; the curves shortly before and after do.
            let inner = cross(segments[i].tangent(0.999), segments[next].tangent(0.001));
            let cusp = cross(before, after).atan2(dot(before, after)).abs() > 3.13 && inner > 0.0;
            let corner = if cusp { (1.0, 1.0) } else { grading_at(before, after, count > FEW) };
            grading[i][1] = corner;
            grading[next][0] = corner;
        }
        Boundary { segments, surface, ends, grading }
    }

    /// The point at `v` of a panel.
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

    /// y - x, to full relative accuracy also where both are next to a corner.
    pub(crate) fn difference(&self, x: &BoundaryPoint, y: &BoundaryPoint) -> Point {
        if x.segment == y.segment {
            let segment = &self.segments[x.segment];
            let sign = (segment.to - segment.from).signum();
            let near_end = x.to_end.min(y.to_end) < x.from_start.min(y.from_start);
            let dt = if near_end { x.to_end - y.to_end } else { y.from_start - x.from_start };
            segment.curve.chord(x.t, sign * dt)
        } else if x.corner == y.corner && x.p[0].min(y.p[0]) >= 0.0 && !self.on_axis(x.corner) {
            sub(y.offset, x.offset)
        } else {
            sub(y.p, x.p)
        }
    }

    /// Fraction s of the panel (v^gamma, also outside 0..1) whose point is nearest to x, and the
    /// distance over the panel's local ds; `w` = x - start of the panel.
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

    /// Where the boundary begins and ends at the axis, the two ends are not one point.
    fn on_axis(&self, corner: Corner) -> bool {
        corner == 0 && self.ends[0][0][0] == 0.0
    }

    /// Cuts the boundary into panels over which the solution is smooth: none turns by more than
    /// 60 degrees, is long against the free surface or its distance from it, long against the
    /// gap to another part of the boundary, or much longer than its neighbour. `modes` modes are to
    /// be resolved. A `fine` cut is for contours whose details the usual one does not resolve.
    pub(crate) fn panels(&self, modes: usize, fine: bool) -> Vec<Panel> {
        // A thin layer or a cusp would take panels without end: the gap counts less then.
        let (width, many) = if fine { (0.6 * WIDTH, 2 * MANY) } else { (WIDTH, MANY) };
        let gaps = if fine { [1.0, 4.0, 16.0] } else { [2.5, 10.0, 40.0] };
        for gap in gaps {
            if let Some(panels) = self.panels_for(modes, gap, width, many) {
                return panels;
            }
        }
        self.panels_for(modes, f64::INFINITY, width, many).unwrap_or_default()
    }

    /// None if a panel at most `gap` times as long as its distance from another part takes more
    /// than `many` panels; those on the surface are at most `width` of its width.
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

/// Contours with more segments than this are taken for curves given point by point.
const FEW: usize = 12;
/// More panels are made only if the contour has many segments.
const MANY: usize = 36;
/// Longest panel on the free surface over the surface's width, for up to five modes.
const WIDTH: f64 = 0.35;
/// gamma at an apex on the axis: the exponents there are between 0.8 and 2 for all but needles.
const APEX: f64 = 4.0;

/// gamma at a corner between two directions of travel, and nu = pi/al. gamma is a whole number, so
/// that the curve is an analytic function of v, and gamma nu at least 6. A contour of `many` short
/// segments turns little at each: its corners are so weak that they need no panels of their own.
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

/// A candidate for a panel: fractions of a segment's parameter.
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
        let points = core::array::from_fn(|i| segment.at(from + (to - from) * i as f64 / 8.0));
        let length = points.windows(2).map(|p: &[Point]| norm(sub(p[1], p[0]))).sum();
        Piece { segment: index, from, to, points, length }
    }

    fn distance(&self, other: &Piece) -> f64 {
        let pairs = self.points.iter().flat_map(|a| other.points.iter().map(move |b| (a, b)));
        pairs.map(|(a, b)| norm(sub(*a, *b))).fold(f64::MAX, f64::min)
    }
}

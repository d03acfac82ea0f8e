//! The generating curve of a tank: its checks and its wetted part.

use std::path::Path;

use core::fmt;

use crate::curve::{Curve, Point, Segment, cross, dot, norm, sub};
use crate::gauss::Gauss;

#[derive(Clone, Debug, PartialEq)]
pub struct Problems(pub Vec<String>);

const LARGEST_FILE: u64 = 64 << 20;

/// Reads a text file, which must be a regular file, because reading a named pipe could wait forever
/// and a device may have no end. The messages do not name the file, because the callers add its
/// name.
pub(crate) fn read_text(path: &Path) -> Result<String, Problems> {
    let problem = |why: String| Problems::from(format!("the file cannot be read: {why}"));
    let about = std::fs::metadata(path).map_err(|error| problem(error.to_string()))?;
    if !about.is_file() {
        return Err(problem("the path does not lead to a regular file".into()));
    }
    if about.len() > LARGEST_FILE {
        return Err(problem(format!("the file is larger than {} MB", LARGEST_FILE / 1_000_000)));
    }
    std::fs::read_to_string(path).map_err(|error| problem(error.to_string()))
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join("\n"))
    }
}

impl std::error::Error for Problems {}

impl From<String> for Problems {
    fn from(problem: String) -> Problems {
        Problems(vec![problem])
    }
}

impl From<&str> for Problems {
    fn from(problem: &str) -> Problems {
        problem.to_string().into()
    }
}

/// Largest height or diameter of a tank, m. A larger tank was probably drawn in millimetres.
pub(crate) const LARGEST: f64 = 100.0;
/// Largest gap between two successive segments that counts as closed, relative to the tank's size.
const JOINED: f64 = 1e-6;
const LEVEL: f64 = 1e-9;

/// Generating curve of a whole tank of revolution in the half plane (r, z), m. It runs from the
/// axis, or from the top of an inner wall, along the bottom and up the outer wall to its top,
/// counter-clockwise around the liquid.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    segments: Vec<Segment>,
    bottom: f64,
    top: f64,
    size: f64,
}

/// Wetted part of a tank's contour at one fill.
///
/// - `segments`: from the axis or the inner contact line to the outer contact line.
/// - `r_outer`, `r_inner`: outer and inner radius of the free surface, m; the inner radius is 0 if
///   the surface reaches the axis.
/// - `z_surface`: height of the free surface, m from the zero of the contour.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    pub segments: Vec<Segment>,
    pub r_outer: f64,
    pub r_inner: f64,
    pub z_surface: f64,
}

/// Smallest distance of the free surface from a horizontal part of the wall, relative to the tank's
/// size. A closer fill is refused, because the modes are not defined at a horizontal wall.
const SHOULDER: f64 = 1e-6;
const STEEP: f64 = 1e-3;

#[derive(Clone, Copy, Debug)]
struct Crossing {
    segment: usize,
    t: f64,
    up: bool,
}

impl Contour {
    /// Creates a contour from its segments.
    ///
    /// # Errors
    /// Lists all defects: values that are not finite, radii below 0, segments without length, gaps,
    /// self-crossing, clockwise order, a size above 100 m.
    pub fn new(segments: Vec<Segment>) -> Result<Contour, Problems> {
        let mut problems = Vec::new();
        if segments.is_empty() {
            return Err("The contour has no segment: it needs at least one line or arc.".into());
        }
        for (i, segment) in segments.iter().enumerate() {
            if let Some(problem) = defect(segment) {
                problems.push(format!("Segment {}: {problem}.", i + 1));
            }
        }
        if !problems.is_empty() {
            return Err(Problems(problems)); // nothing below makes sense then
        }
        let outline = Outline::new(&segments);
        let size = outline.size();
        if size > LARGEST {
            problems.push(format!(
                "The contour is {size:.6} m large; lengths are in metres and at most {LARGEST} m \
                 (is the drawing in millimetres?)."
            ));
        }
        for i in 0..segments.len() {
            let low = outline.points[i].iter().map(|p| p[0]).fold(f64::MAX, f64::min);
            if low < -LEVEL * size {
                problems.push(format!(
                    "Segment {}: its radius falls to {low:.6} m; the contour lies in the half plane r >= 0.",
                    i + 1
                ));
            }
            if let Some(next) = segments.get(i + 1) {
                let (end, start) = (segments[i].end(), next.start());
                let gap = norm(sub(start, end));
                if gap > JOINED * size {
                    problems.push(format!(
                        "The contour is open: segment {} ends at ({:.6}, {:.6}) m and segment {} \
                         starts at ({:.6}, {:.6}) m, {gap:.3e} m apart.",
                        i + 1,
                        end[0],
                        end[1],
                        i + 2,
                        start[0],
                        start[1]
                    ));
                }
            }
        }
        if let Some((i, j, p)) = outline.crossing() {
            problems.push(format!(
                "The contour crosses itself near ({:.6}, {:.6}) m (segments {} and {}).",
                p[0],
                p[1],
                i + 1,
                j + 1
            ));
        } else if problems.is_empty() && outline.area() <= 0.0 {
            problems.push(
                "The contour is inside out (clockwise): list it from the axis or the inner wall \
                 along the bottom to the outer wall, with r to the right and z up."
                    .to_string(),
            );
        }
        if !problems.is_empty() {
            return Err(Problems(problems));
        }
        let heights = || outline.points.iter().flatten().map(|p| p[1]);
        let coarse = (heights().fold(f64::MAX, f64::min), heights().fold(f64::MIN, f64::max));
        let (bottom, top) = segments.iter().fold(coarse, |(low, high), s| {
            (low.min(extreme(s, 1.0).1), high.max(-extreme(s, -1.0).1))
        });
        Ok(Contour { segments: start_at_highest_point(segments, size), bottom, top, size })
    }

    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    pub fn bottom(&self) -> f64 {
        self.bottom
    }

    /// Returns the height of the lowest point of the tank, and the smallest distance from the axis
    /// at this height, both in m.
    pub(crate) fn lowest(&self) -> (f64, f64) {
        let outline = Outline::new(&self.segments);
        let points = || outline.points.iter().flatten();
        let low = points().map(|p| p[1]).fold(f64::MAX, f64::min);
        let flat = points().filter(|p| p[1] - low < LEVEL * self.size);
        (self.bottom, flat.map(|p| p[0]).fold(f64::MAX, f64::min))
    }

    pub(crate) fn largest_radius(&self) -> f64 {
        let outline = Outline::new(&self.segments);
        outline.points.iter().flatten().map(|p| p[0]).fold(0.0, f64::max)
    }

    /// Returns the largest possible fill, m above the lowest point: the height at which the outer
    /// wall, or a lower inner wall, ends.
    pub fn depth(&self) -> f64 {
        let end = self.segments[self.segments.len() - 1].end();
        let start = self.segments[0].start();
        let brim = if start[0] > 0.0 { end[1].min(start[1]) } else { end[1] };
        // A torus ends at its start, a closed tank on the axis.
        (if start == end { self.top } else { brim }) - self.bottom
    }

    fn volume_below(&self, fill: f64) -> f64 {
        let z = self.bottom + fill;
        let surface = |height: f64| if height < z { 0.0 } else { f64::INFINITY };
        let [volume] = self.integrate_wetted(surface, &[], |[r, _], _| [r * r]);
        core::f64::consts::PI * volume
    }

    /// Returns the integral of `density` dz along the wetted wall, up the outer wall and down the
    /// inner wall. `surface(z)` describes the free surface, which may be level or curved by a spin:
    /// it is the square, m², of the radius inside which there is no liquid at the height z. For a
    /// level surface it is 0 below the surface and infinite above it. `density` receives the point
    /// (r, z) of the wall and `surface(z)`, m². `kinks` are heights at which the slope of `surface`
    /// jumps.
    pub(crate) fn integrate_wetted<const N: usize>(
        &self,
        surface: impl Fn(f64) -> f64,
        kinks: &[f64],
        density: impl Fn(Point, f64) -> [f64; N],
    ) -> [f64; N] {
        // exact for r^2 dz of lines and cubics; an arc is cut into 128 pieces, which leaves an error of 1e-15
        let rule = Gauss::new(5);
        let mut sum = [0.0; N];
        for (segment, [from, to]) in self.wetted_pieces(&surface, kinks) {
            for (v, w) in rule.nodes.iter().zip(&rule.weights) {
                let t = from + (to - from) * v;
                let (point, dz) = (segment.curve.point_at(t), segment.curve.slope(t)[1]);
                let values = density(point, surface(point[1]));
                for (sum, value) in sum.iter_mut().zip(values) {
                    *sum += w * (to - from) * dz * value;
                }
            }
        }
        sum
    }

    /// Returns the height of the highest wet point of the wall, m from the zero of the contour. If
    /// no point is wet, it is the height of the lowest point of the tank. For `surface` see
    /// [`Contour::integrate_wetted`].
    pub(crate) fn highest_wetted(&self, surface: impl Fn(f64) -> f64) -> f64 {
        let pieces = self.wetted_pieces(&surface, &[]);
        let ends =
            pieces.iter().flat_map(|(segment, ends)| ends.map(|t| segment.curve.point_at(t)[1]));
        ends.fold(self.bottom, f64::max)
    }

    pub(crate) fn count_pools(&self, surface: impl Fn(f64) -> f64) -> usize {
        let pieces = self.wetted_pieces(&surface, &[]);
        let mut pools = usize::from(!pieces.is_empty());
        for pair in pieces.windows(2) {
            let [end, start] = [(pair[0].0, pair[0].1[1]), (pair[1].0, pair[1].1[0])]
                .map(|(segment, t)| segment.curve.point_at(t));
            pools += usize::from(norm(sub(start, end)) > JOINED * self.size);
        }
        pools
    }

    /// Returns the wet parts of the wall in the order of the contour, each as a segment and the
    /// range of its parameter. For the arguments see [`Contour::integrate_wetted`].
    fn wetted_pieces(
        &self,
        surface: impl Fn(f64) -> f64,
        kinks: &[f64],
    ) -> Vec<(&Segment, [f64; 2])> {
        let mut pieces = Vec::new();
        for segment in &self.segments {
            // Several samples on each segment are compared with the surface, because a curved surface may meet
            // a straight wall twice.
            let count = samples(segment).max(8);
            let parameter =
                |k: usize| segment.from + (segment.to - segment.from) * k as f64 / count as f64;
            let at = |t: f64| segment.curve.point_at(t);
            let is_wet = |t: f64| at(t)[0] * at(t)[0] >= surface(at(t)[1]);
            let mut ends: Vec<f64> = (0..=count).map(parameter).collect();
            for kink in kinks {
                let is_above = |t: f64| at(t)[1] > *kink;
                for k in (1..ends.len()).rev() {
                    if is_above(ends[k - 1]) != is_above(ends[k]) {
                        ends.insert(k, bisect(ends[k - 1], ends[k], is_above));
                    }
                }
            }
            for pair in ends.windows(2) {
                let (from, to) = (pair[0], pair[1]);
                match [from, to].map(is_wet) {
                    [true, true] => pieces.push((segment, [from, to])),
                    [true, false] => pieces.push((segment, [from, bisect(from, to, is_wet)])),
                    [false, true] => pieces.push((segment, [bisect(to, from, is_wet), to])),
                    [false, false] => {}
                }
            }
        }
        pieces
    }

    pub fn capacity(&self) -> f64 {
        self.volume_below(self.depth())
    }

    /// Returns the fill, m above the lowest point, at which the liquid has the volume `volume`, m³.
    /// For the tank's volume and for larger volumes it is the largest fill.
    pub(crate) fn fill_from_volume(&self, volume: f64) -> f64 {
        let depth = self.depth();
        if volume <= 0.0 {
            return 0.0;
        }
        if volume >= self.capacity() * (1.0 - 1e-12) {
            return depth;
        }
        bisect(0.0, depth, |fill| self.volume_below(fill) < volume)
    }

    /// Returns the whole contour as a wetted wall, for a full tank. The result is `None` if the
    /// tank cannot be full, because its contour ends neither on the axis nor at its start.
    pub(crate) fn closed(&self) -> Option<Wall> {
        let (start, end) = (self.segments[0].start(), self.segments[self.segments.len() - 1].end());
        let on_axis = start[0] <= LEVEL * self.size && end[0] <= LEVEL * self.size;
        let ring = norm(sub(start, end)) <= JOINED * self.size;
        (on_axis || ring).then(|| Wall {
            segments: self.segments.clone(),
            r_outer: 0.0,
            r_inner: 0.0,
            z_surface: self.top,
        })
    }

    /// Returns the wetted wall at `fill`, m above the lowest point.
    ///
    /// # Errors
    /// A fill that is not positive or above the top, separate pools, a free surface at a horizontal
    /// part of the wall or of zero width.
    pub fn cut(&self, fill: f64) -> Result<Wall, Problems> {
        if !fill.is_finite() {
            return Err(format!("The fill is {fill}; it must be a height in metres.").into());
        }
        if fill <= 0.0 {
            return Err(format!(
                "The fill is {fill} m; it must be above 0, the lowest point of the tank."
            )
            .into());
        }
        let depth = self.depth();
        if fill > depth * (1.0 + LEVEL) {
            return Err(format!(
                "The fill of {fill} m is above the top of the tank, {depth:.6} m above its lowest point."
            )
            .into());
        }
        let mut z = self.bottom + fill;
        // A contact line near a joint is moved to the joint.
        for segment in &self.segments {
            for end in [segment.start(), segment.end()] {
                if (end[1] - z).abs() < LEVEL * self.size {
                    z = end[1];
                }
            }
        }
        let (down, up) = self.contact_lines(z, fill)?;
        // Near a shoulder a small change of the fill changes the free surface.
        let radius = |c: Crossing| self.segments[c.segment].curve.point_at(c.t)[0];
        let radii =
            |(down, up): (Option<Crossing>, Crossing)| [down.map_or(-1.0, radius), radius(up)];
        let here = radii((down, up));
        for z in [z - SHOULDER * self.size, z + SHOULDER * self.size] {
            if let Ok(lines) = self.contact_lines(z, fill) {
                let there = radii(lines);
                if here
                    .iter()
                    .zip(there)
                    .any(|(a, b)| (a - b).abs() > 2.0 * SHOULDER / STEEP * self.size)
                {
                    return Err(horizontal_wall_problem(fill));
                }
            }
        }
        let mut wall = Vec::new();
        let begin = down.map_or((0, self.segments[0].from), |c| (c.segment, c.t));
        for i in begin.0..=up.segment {
            let segment = self.segments[i];
            let from = if i == begin.0 { begin.1 } else { segment.from };
            let to = if i == up.segment { up.t } else { segment.to };
            if from != to {
                wall.push(segment.part(from, to));
            }
        }
        let Some(end) = wall.last().map(Segment::end) else {
            return Err(horizontal_wall_problem(fill));
        };
        let start = wall[0].start();
        let r_inner = if down.is_some() { start[0] } else { 0.0 };
        if end[0] - r_inner < 1e-6 * self.size {
            return Err(format!(
                "At a fill of {fill} m the free surface is only {:.3e} m wide, too narrow for modes; take another fill.",
                end[0] - r_inner
            )
            .into());
        }
        let steep = |tangent: Point| tangent[1].abs() > STEEP;
        let outer = wall[wall.len() - 1].tangent(1.0);
        if !steep(outer) || (down.is_some() && !steep(wall[0].tangent(0.0))) {
            return Err(horizontal_wall_problem(fill));
        }
        Ok(Wall { segments: wall, r_outer: end[0], r_inner, z_surface: z })
    }

    fn contact_lines(&self, z: f64, fill: f64) -> Result<(Option<Crossing>, Crossing), Problems> {
        let crossings = self.crossings(z);
        // At the end of an inner wall only a horizontal part of the wall makes a fill invalid.
        let start = self.segments[0].start();
        let level = LEVEL * self.size;
        if start[1] < z - level && start[0] > level {
            return Err(horizontal_wall_problem(fill));
        }
        match crossings[..] {
            [up] if up.up => Ok((None, up)),
            [down, up] if !down.up && up.up => Ok((Some(down), up)),
            [] => Err(horizontal_wall_problem(fill)),
            _ => Err(format!(
                "At a fill of {fill} m the height of the free surface passes through the contour {} times: \
                 separate pools or trapped gas, which one set of modes cannot represent.",
                crossings.len()
            )
            .into()),
        }
    }

    /// Returns all places at which the contour passes through the height `z`, m, in the order of
    /// the contour. A point exactly at this height counts as above it.
    fn crossings(&self, z: f64) -> Vec<Crossing> {
        let mut found: Vec<Crossing> = Vec::new();
        let level = LEVEL * self.size;
        let mut above = self.segments[0].start()[1] >= z - level;
        for (i, segment) in self.segments.iter().enumerate() {
            let count = samples(segment);
            let parameter =
                |k: usize| segment.from + (segment.to - segment.from) * k as f64 / count as f64;
            for k in 0..count {
                let (mut a, mut b) = (parameter(k), parameter(k + 1));
                let next = match k + 1 == count {
                    true => segment.end()[1],
                    false => segment.curve.point_at(b)[1],
                };
                let next_above = next >= z - level;
                if next_above == above {
                    continue;
                }
                if (next - z).abs() <= level {
                    a = b; // exactly at a sample, a joint above all
                } else if (segment.curve.point_at(a)[1] - z).abs() <= level {
                    b = a;
                }
                let is_above = |t: f64| segment.curve.point_at(t)[1] >= z;
                let [a, b] = bisect_change([a, b], |t| is_above(t) == above);
                found.push(Crossing { segment: i, t: 0.5 * (a + b), up: next_above });
                above = next_above;
            }
        }
        found
    }
}

fn horizontal_wall_problem(fill: f64) -> Problems {
    format!(
        "At a fill of {fill} m the free surface lies at a horizontal part of the wall, where the modes \
         are not defined; take a slightly different fill."
    )
    .into()
}

fn defect(segment: &Segment) -> Option<String> {
    let numbers: Vec<f64> = match segment.curve {
        Curve::Line { from, to } => vec![from[0], from[1], to[0], to[1]],
        Curve::Ellipse { center, a_r, a_z } => vec![center[0], center[1], a_r, a_z],
        Curve::Cassini { zc, a, c } => vec![zc, a, c],
        Curve::Cosine { r0, r1, z, p } => vec![r0, r1, z[0], z[1], p[0], p[1]],
        Curve::Cubic { c } => c.concat(),
    };
    if let Some(bad) = numbers.iter().chain([&segment.from, &segment.to]).find(|x| !x.is_finite()) {
        return Some(format!("contains {bad}; every value must be a finite number"));
    }
    match segment.curve {
        Curve::Ellipse { a_r, a_z, .. } if a_r <= 0.0 || a_z <= 0.0 => {
            return Some(format!("radii {a_r} and {a_z} m must be above 0"));
        }
        Curve::Cassini { a, c, .. } if a <= c || c < 0.0 => {
            return Some(format!("an oval of Cassini needs a > c >= 0, here {a} and {c} m"));
        }
        _ => {}
    }
    if !matches!(segment.curve, Curve::Line { .. }) && (segment.to - segment.from).abs() > 6.3 {
        let degrees = (segment.to - segment.from).to_degrees().abs();
        return Some(format!("an arc of {degrees:.1} degrees is longer than a full circle"));
    }
    let outline: Vec<Point> = (0..=8).map(|k| segment.point_at(k as f64 / 8.0)).collect();
    let length: f64 = outline.windows(2).map(|p| norm(sub(p[1], p[0]))).sum();
    if length == 0.0 || !length.is_finite() {
        return Some("has no length".to_string());
    }
    None
}

/// Returns the segments of a torus in an order that begins at its highest point. A torus is a
/// contour that is closed away from the axis; other contours are returned unchanged. `size` is the
/// size of the tank, m.
fn start_at_highest_point(segments: Vec<Segment>, size: f64) -> Vec<Segment> {
    let (start, end) = (segments[0].start(), segments[segments.len() - 1].end());
    if norm(sub(start, end)) > JOINED * size || start[0] <= JOINED * size {
        return segments;
    }
    let tops = segments.iter().map(|s| extreme(s, -1.0)).enumerate();
    let Some((first, (s, _))) = tops.min_by(|a, b| a.1.1.total_cmp(&b.1.1)) else {
        return segments;
    };
    let Segment { from, to, .. } = segments[first];
    let t = from + s * (to - from);
    let mut turned = vec![segments[first].part(t, to)];
    turned.extend((1..segments.len()).map(|i| segments[(first + i) % segments.len()]));
    turned.push(segments[first].part(from, t));
    turned.retain(|s| s.from != s.to);
    turned
}

fn samples(segment: &Segment) -> usize {
    match segment.curve {
        Curve::Line { .. } => 1,
        Curve::Cubic { .. } => 8,
        _ => 128,
    }
}

pub(crate) fn bisect(first: f64, second: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let here = holds(first);
    bisect_change([first, second], |at| holds(at) == here)[0]
}

/// Narrows the interval between `near` and `far` by bisection to the position at which `is_near`
/// changes from true (at `near`) to false (at `far`). Returns the positions on both sides of the
/// change.
fn bisect_change([mut near, mut far]: [f64; 2], is_near: impl Fn(f64) -> bool) -> [f64; 2] {
    for _ in 0..80 {
        let middle = 0.5 * (near + far);
        *if is_near(middle) { &mut near } else { &mut far } = middle;
    }
    [near, far]
}

/// Narrows the interval from `a` to `b` around its best position by golden-section search, and
/// returns the ends of the narrow interval. `better` returns true if its first argument is better
/// than its second.
pub(crate) fn golden(
    [mut a, mut b]: [f64; 2],
    steps: usize,
    better: impl Fn(f64, f64) -> bool,
) -> [f64; 2] {
    for _ in 0..steps {
        let step = 0.618_033_988_749_894_8 * (b - a);
        let (left, right) = (b - step, a + step);
        if better(left, right) {
            b = right;
        } else {
            a = left;
        }
    }
    [a, b]
}

/// Returns the lowest point of a segment if `sign` is 1, and the highest point if `sign` is -1: the
/// fraction of the segment's parameter at which it lies, and `sign` times its height, m.
fn extreme(segment: &Segment, sign: f64) -> (f64, f64) {
    let count = samples(segment);
    let height = |s: f64| sign * segment.point_at(s.clamp(0.0, 1.0))[1];
    let step = 1.0 / count as f64;
    let lowest =
        (0..=count).min_by(|a, b| height(*a as f64 * step).total_cmp(&height(*b as f64 * step)));
    let at = lowest.unwrap_or(0) as f64 * step;
    let around = [(at - step).max(0.0), (at + step).min(1.0)];
    let [a, b] = golden(around, 60, |left, right| height(left) < height(right));
    let places = [a, b, at].map(|s| (s.clamp(0.0, 1.0), height(s)));
    places.into_iter().fold((at, f64::MAX), |low, x| if x.1 < low.1 { x } else { low })
}

struct Outline {
    points: Vec<Vec<Point>>,
}

impl Outline {
    fn new(segments: &[Segment]) -> Outline {
        let sampled = |s: &Segment| {
            let count = samples(s);
            (0..=count).map(|k| s.point_at(k as f64 / count as f64)).collect()
        };
        Outline { points: segments.iter().map(sampled).collect() }
    }

    fn size(&self) -> f64 {
        let range = |i: usize| {
            let all = || self.points.iter().flatten().map(|p| p[i]);
            (all().fold(f64::MAX, f64::min), all().fold(f64::MIN, f64::max))
        };
        let (r, z) = (range(0), range(1));
        r.1.max(z.1 - z.0)
    }

    /// Returns the area to the left of the contour, m², after the contour was closed along the
    /// axis, or by a straight line from its end to its start. The area is negative for a clockwise
    /// contour.
    fn area(&self) -> f64 {
        let all: Vec<Point> = self.points.iter().flatten().copied().collect();
        let (first, last) = (all[0], all[all.len() - 1]);
        let mut sum: f64 = all.windows(2).map(|p| cross(p[0], p[1])).sum();
        if first[0] <= 1e-9 * self.size() {
            // close the contour: from the end of the outer wall to the axis, and down along it
            let corner = [0.0, last[1]];
            sum += cross(last, corner) + cross(corner, first);
        } else {
            sum += cross(last, first);
        }
        0.5 * sum
    }

    fn crossing(&self) -> Option<(usize, usize, Point)> {
        let lines: Vec<(usize, Point, Point)> = self
            .points
            .iter()
            .enumerate()
            .flat_map(|(i, points)| points.windows(2).map(move |p| (i, p[0], p[1])))
            .collect();
        for (a, &(i, p, q)) in lines.iter().enumerate() {
            for (b, &(j, r, s)) in lines.iter().enumerate().skip(a + 2) {
                let apart = p[0].max(q[0]) < r[0].min(s[0])
                    || r[0].max(s[0]) < p[0].min(q[0])
                    || p[1].max(q[1]) < r[1].min(s[1])
                    || r[1].max(s[1]) < p[1].min(q[1]);
                // the first and the last segment of a closed contour meet
                if apart || (a == 0 && b + 1 == lines.len() && norm(sub(p, s)) < 1e-6) {
                    continue;
                }
                let (d, e) = (sub(q, p), sub(s, r));
                let area = cross(d, e);
                let (u, v) = (cross(sub(r, p), e) / area, cross(sub(r, p), d) / area);
                if area != 0.0 && (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v) {
                    return Some((i, j, [p[0] + u * d[0], p[1] + u * d[1]]));
                }
            }
            // The next line may fold back on the present line at the joint of the two.
            if let Some(&(j, _, s)) = lines.get(a + 1) {
                let (d, e) = (sub(q, p), sub(s, q));
                if cross(d, e).abs() < 1e-9 * norm(d) * norm(e) && dot(d, e) < 0.0 {
                    return Some((i, j, q));
                }
            }
        }
        None
    }
}

/// Volume integrals of the liquid.
///
/// - `volume`: m³.
/// - `z_cg`: height of the centre of volume, m from the zero of the contour.
/// - `across`, `axial`: inertia of the rigid liquid divided by the density, m⁵, across the axis
///   about the centre of volume, and about the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    pub volume: f64,
    pub z_cg: f64,
    pub across: f64,
    pub axial: f64,
}

impl Volume {
    /// Computes the volume integrals of the liquid in a wetted wall below its level surface. By
    /// Gauss's theorem they are integrals along the wall; for example, the volume is pi int r^2 dz.
    pub fn from_wall(wall: &Wall) -> Volume {
        let rule = Gauss::new(20);
        let base = wall.z_surface;
        let (mut volume, mut first, mut second, mut axial) = (0.0, 0.0, 0.0, 0.0);
        for segment in &wall.segments {
            let pieces = if matches!(segment.curve, Curve::Line { .. } | Curve::Cubic { .. }) {
                1
            } else {
                8
            };
            let step = (segment.to - segment.from) / pieces as f64;
            for k in 0..pieces {
                for (v, w) in rule.nodes.iter().zip(&rule.weights) {
                    let t = segment.from + step * (k as f64 + v);
                    let ([r, z], dz) =
                        (segment.curve.point_at(t), w * step * segment.curve.slope(t)[1]);
                    let z = z - base;
                    let disc = core::f64::consts::PI * r * r * dz;
                    volume += disc;
                    first += disc * z;
                    second += disc * z * z;
                    axial += 0.5 * disc * r * r;
                }
            }
        }
        let z_cg = first / volume;
        Volume { volume, z_cg: base + z_cg, across: 0.5 * axial + second - first * z_cg, axial }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_and_the_highest_point_of_a_curve_are_found_between_its_samples() {
        for (from, to) in [(-100.0, 63.0), (-123.4, 120.0), (-90.0, 90.0)] {
            let arc = Segment::arc([0.4, 0.2], 0.1, from, to);
            let (place, low) = extreme(&arc, 1.0);
            // Golden-section search ends at the root of the rounding error, so that the value has its square as error.
            assert!((low - 0.1).abs() < 1e-16 * 8.0, "{from} {low}");
            assert!((place - (-90.0 - from) / (to - from)).abs() < 1e-7, "{from} {place}");
            let top = 0.2 + 0.1 * f64::min(to, 90.0).to_radians().sin();
            assert!((-extreme(&arc, -1.0).1 - top).abs() < 1e-15, "{to}");
        }
    }

    /// In a tank of 1.5 m the narrowest accepted surface is 1.5 micrometres wide. The test cuts two
    /// narrower surfaces: between two leaning walls, and in the tip of a cone.
    #[test]
    fn a_free_surface_without_width_is_refused_with_its_width() {
        let gap = |width: f64| {
            let corners = [[1.0, 1.0], [0.5, 0.0], [1.5, 0.0], [1.0 + width, 1.0]];
            let walls = corners.windows(2).map(|p| Segment::line(p[0], p[1])).collect();
            Contour::new(walls).unwrap().cut(1.0)
        };
        let refused = gap(1e-6).unwrap_err().to_string();
        assert_eq!(
            refused,
            "At a fill of 1 m the free surface is only 1.000e-6 m wide, too narrow for modes; take another fill."
        );
        let wall = gap(2e-6).unwrap();
        assert!((wall.r_outer - wall.r_inner - 2e-6).abs() < 1e-15);
        let tip = |radius: f64| {
            let walls = [[0.0, 0.0], [1.5, 0.0], [radius, 1.0]];
            let walls = walls.windows(2).map(|p| Segment::line(p[0], p[1])).collect();
            Contour::new(walls).unwrap().cut(1.0)
        };
        assert!(tip(1e-6).unwrap_err().to_string().contains("only 1.000e-6 m wide"));
        assert!((tip(2e-6).unwrap().r_outer - 2e-6).abs() < 1e-15);
    }

    #[test]
    fn a_contour_with_a_gap_below_1e_6_of_its_size_counts_as_closed() {
        for size in [1.0 / 64.0, 1.0, 16.0] {
            for (gap, is_closed) in [(0.9e-6, true), (1.1e-6, false)] {
                let to = |r: f64, z: f64| [size * r, size * z];
                let corners =
                    [to(0.5, 0.5), to(0.5, 0.0), to(1.0, 0.0), to(1.0, 0.6), to(0.5, 0.5 + gap)];
                let walls = corners.windows(2).map(|p| Segment::line(p[0], p[1])).collect();
                let contour = Contour::new(walls).unwrap();
                assert_eq!(contour.closed().is_some(), is_closed, "{size} {gap}");
                let begins = if is_closed { to(1.0, 0.6) } else { to(0.5, 0.5) };
                assert_eq!(contour.segments()[0].start(), begins, "{size} {gap}");
            }
            // a bowl and its lid, with one end a billionth away from the axis
            for (off, is_closed) in [(0.9e-9, true), (1.1e-9, false)] {
                for ends in [[off, 0.0], [0.0, off]] {
                    let corners = [[ends[0], 0.0], [1.0, 0.5], [ends[1], 1.0]];
                    let corners = corners.map(|p| p.map(|x| size * x));
                    let walls = corners.windows(2).map(|p| Segment::line(p[0], p[1])).collect();
                    let closed = Contour::new(walls).unwrap().closed();
                    assert_eq!(closed.is_some(), is_closed, "{size} {ends:?}");
                }
            }
        }
    }
}

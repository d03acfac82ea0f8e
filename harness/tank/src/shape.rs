//! Recognises the shapes of the wetted contour, so that the damping of a tank does not depend on how it is drawn.
//!
//! [`recognise`] finds the shape of the whole wall; [`parts`] finds the shapes of the wall's lower parts. For example,
//! the wall of a capsule is a sphere up to the end of its lower dome.

use formulas::damping::{self, smooth_step};

use crate::contour::Wall;
use crate::curve::{Point, Segment, norm, sub};
use crate::tank::Shape;

/// Largest distance of a wetted wall from a sphere, cylinder, cone or torus, relative to its size,
/// at which the wall counts as this shape.
const SAME: f64 = 1e-6;

const PLACES: usize = 64;

/// A wetted wall with a shape whose damping was measured. `shape` is tall enough to contain the
/// liquid, whose surface is `fill` m above the lowest point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Recognised {
    pub shape: Shape,
    pub fill: f64,
}

impl Recognised {
    pub fn measured(&self) -> damping::Shape {
        let depth = self.fill;
        match self.shape {
            Shape::Cylinder { radius, .. } => damping::Shape::Cylinder { radius, depth },
            Shape::Sphere { radius } => damping::Shape::Sphere { radius, depth },
            Shape::Cone { half_angle, .. } => {
                let radius = depth * half_angle.to_radians().tan();
                damping::Shape::Cone { radius, half_angle }
            }
            Shape::Torus { tube_radius, .. } => damping::Shape::Torus { tube_radius, depth },
            _ => damping::Shape::Other,
        }
    }
}

/// Recognises a wetted wall as a sphere, upright cylinder, cone or torus, because only for these
/// shapes was the damping measured. `fill` is the height of the free surface above the lowest
/// point, m. Returns `None` for any other wall.
pub(crate) fn recognise(wall: &Wall, fill: f64) -> Option<Recognised> {
    let points = sample_points(wall, PLACES);
    let cut = Cut::from_whole_wall(&points, fill)?;
    KINDS.into_iter().find_map(|kind| {
        let shape = kind.shape_through(cut)?;
        let fits = |p: &Point| distance(&shape, *p, cut.bottom) <= SAME * cut.size();
        points.iter().all(fits).then_some(Recognised { shape, fill })
    })
}

/// A part of the wetted wall that has a shape whose damping was measured. Parts are listed upwards
/// from the lowest point of the tank.
///
/// - `found`: the shape, with the depth of liquid up to which the wall has this shape.
/// - `share`: the part's share of the wetted area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    pub found: Recognised,
    pub share: f64,
}

/// Returns the shapes with measured damping (sphere, cylinder, cone, torus) that parts of a wetted
/// wall have, each with its share. `fill` is the height of the free surface above the lowest point,
/// m.
///
/// The wall up to some height is compared with the sphere, cylinder, cone or torus through its
/// lowest point and the contact line that it would have at this height. The share of a shape is 1
/// if the wall deviates by less than 1e-6 of its size, and 0 from the deviation [`FAR`] on. A
/// smooth step between these deviations makes the result continuous in the fill and in the shape of
/// the tank.
pub(crate) fn parts(wall: &Wall, fill: f64) -> Vec<Part> {
    let places = (SAMPLES / wall.segments.len()).clamp(2, PLACES);
    let points = sample_points(wall, places);
    let mut found: Vec<Part> =
        KINDS.into_iter().filter_map(|kind| kind.part(&points, fill)).collect();
    // A wall of shallow liquid can be similar to several shapes. Their shares are weighted so that each share has the same
    // ratio to the remainder as if only its shape were considered; a share of 1 leaves nothing for the other shapes.
    let beyond = |skip: usize| -> f64 {
        found
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != skip)
            .map(|(_, part)| 1.0 - part.share)
            .product()
    };
    let weights: Vec<f64> =
        found.iter().enumerate().map(|(i, part)| part.share * beyond(i)).collect();
    let sum = weights.iter().sum::<f64>() + beyond(found.len());
    for (part, weight) in found.iter_mut().zip(weights) {
        part.share = weight / sum;
    }
    found
}

/// Returns the measured shapes that are similar to the whole wetted wall. The share of a shape
/// falls from 1 for an exact wall to 0 at the distance [`NEAR`]. `fill` is the height of the free
/// surface above the lowest point, m.
pub(crate) fn nearby_shapes(wall: &Wall, fill: f64) -> Vec<Part> {
    let points = sample_points(wall, PLACES);
    let Some(cut) = Cut::from_whole_wall(&points, fill) else { return Vec::new() };
    let widest = points.iter().fold(0.0, |widest: f64, p| widest.max(p[0]));
    // The height of a flat pool and the radius of a thin pipe are small, so that the smaller of both is the size: relative
    // to the larger one, every shape would be similar to every other shape.
    let size = fill.min(widest);
    let of_kind = |kind: Kind| {
        let shape = kind.shape_through(cut)?;
        let farthest =
            points.iter().fold(0.0, |far: f64, p| far.max(distance(&shape, *p, cut.bottom)));
        let share = 1.0 - smooth_step(farthest / (NEAR * size));
        (share > 0.0).then_some(Part { found: Recognised { shape, fill }, share })
    };
    KINDS.into_iter().filter_map(of_kind).collect()
}

/// Distance of a wall from a shape, relative to the wall's size, at and above which the wall does
/// not count as this shape.
const FAR: f64 = 0.01;

/// Distance of a wall from a shape, relative to the smaller of depth and largest radius, at and
/// above which the wall does not count as similar to this shape. For example, a spheroid that
/// differs by a few per cent from a sphere dissipates as much as the sphere.
const NEAR: f64 = 0.1;

const LEAST: f64 = 0.02;

const SAMPLES: usize = 256;

fn sample_points(wall: &Wall, places: usize) -> Vec<Point> {
    let on = |part: &Segment| -> Vec<Point> {
        (0..=places).map(|i| part.point_at(i as f64 / places as f64)).collect()
    };
    wall.segments.iter().flat_map(on).collect()
}

/// The part of a wall below a level: the radii of its contact lines, m (`inner` is `None` if the
/// wall begins on the axis), the height `bottom` of its lowest point, m from the zero of the
/// contour, and the depth at the level, m.
#[derive(Clone, Copy)]
struct Cut {
    inner: Option<f64>,
    outer: f64,
    bottom: f64,
    depth: f64,
}

impl Cut {
    fn from_whole_wall(points: &[Point], fill: f64) -> Option<Cut> {
        let (first, last) = (*points.first()?, *points.last()?);
        let on_axis = first[0] <= SAME * fill.max(last[0]);
        let inner = (!on_axis).then_some(first[0]);
        Some(Cut { inner, outer: last[0], bottom: last[1] - fill, depth: fill })
    }

    fn size(&self) -> f64 {
        self.depth.max(self.outer)
    }
}

const KINDS: [Kind; 4] = [Kind::Cylinder, Kind::Cone, Kind::Sphere, Kind::Torus];

#[derive(Clone, Copy)]
enum Kind {
    Cylinder,
    Cone,
    Sphere,
    Torus,
}

impl Kind {
    fn shape_through(self, cut: Cut) -> Option<Shape> {
        let Cut { outer, depth, .. } = cut;
        match (self, cut.inner) {
            (Kind::Cylinder, None) => Some(Shape::Cylinder { radius: outer, height: depth }),
            (Kind::Cone, None) => {
                Some(Shape::Cone { half_angle: (outer / depth).atan().to_degrees(), height: depth })
            }
            (Kind::Sphere, None) => {
                Some(Shape::Sphere { radius: (outer * outer + depth * depth) / (2.0 * depth) })
            }
            // The circle through both contact lines, which are level, and the lowest point.
            (Kind::Torus, Some(inner)) => {
                let half = 0.5 * (outer - inner);
                let tube_radius = (half * half + depth * depth) / (2.0 * depth);
                let ring_radius = 0.5 * (inner + outer);
                (ring_radius > tube_radius).then_some(Shape::Torus { ring_radius, tube_radius })
            }
            _ => None,
        }
    }

    /// Returns the part of the wall, from the lowest point upwards, that has a shape of this kind
    /// (for example a sphere), without regard to other kinds. `points` are points of the wall, and
    /// `fill` is the height of the free surface above the lowest point, m. Returns `None` if the
    /// share of the part is at most [`LEAST`].
    fn part(self, points: &[Point], fill: f64) -> Option<Part> {
        let whole = Cut::from_whole_wall(points, fill)?;
        let lowest =
            (0..points.len()).rev().min_by(|a, b| points[*a][1].total_cmp(&points[*b][1]))?;
        let bands: Vec<f64> =
            points.windows(2).map(|p| (p[0][0] + p[1][0]) * norm(sub(p[1], p[0]))).collect();
        let area: f64 = bands.iter().sum();
        // For each level, from the free surface down to the lowest point: weight of the wall below it, its
        // share, shape and depth.
        let (mut weight, mut sums) = (0.0_f64, [0.0; 4]);
        let mut above: Option<[f64; 4]> = None;
        for level in (lowest + 1..points.len()).rev() {
            let [outer, z] = points[level];
            let start = points[..lowest].iter().rposition(|p| p[1] > z).map_or(0, |i| i + 1);
            let inner = whole.inner.map(|first| match start {
                0 => first,
                _ => crossing(points[start - 1], points[start], z),
            });
            let cut = Cut { inner, outer, bottom: whole.bottom, depth: z - whole.bottom };
            if cut.depth <= SAME * whole.size() {
                break;
            }
            let Some(shape) = self.shape_through(cut) else { continue };
            let (limit, mut farthest) = (FAR * cut.size(), 0.0_f64);
            for p in &points[start..=level] {
                farthest = farthest.max(distance(&shape, *p, cut.bottom));
                if farthest >= limit {
                    break;
                }
            }
            let here = 1.0 - smooth_step((farthest / cut.size() - SAME) / (FAR - SAME));
            let share = bands[start..level].iter().sum::<f64>() / area;
            let share = if level + 1 == points.len() { 1.0 } else { share };
            let [size, ring] = dimensions(&shape);
            let values = [share, share * size, share * ring, share * cut.depth];
            // The wall below a lower level has at least the weight of the larger wall that contains it.
            if here > weight {
                let from = above.unwrap_or(values);
                for ((sum, a), b) in sums.iter_mut().zip(from).zip(values) {
                    *sum += (here - weight) * 0.5 * (a + b);
                }
                weight = here;
            }
            if weight == 1.0 {
                break;
            }
            above = Some(values);
        }
        let [share, size, ring, depth] = sums;
        if share <= LEAST {
            return None;
        }
        let shape = self.build(size / share, ring / share, depth / share);
        let found = Recognised { shape, fill: depth / share };
        Some(Part { found, share: (share - LEAST) / (1.0 - LEAST) })
    }

    fn build(self, size: f64, ring: f64, depth: f64) -> Shape {
        match self {
            Kind::Cylinder => Shape::Cylinder { radius: size, height: depth },
            Kind::Cone => Shape::Cone { half_angle: size, height: depth },
            Kind::Sphere => Shape::Sphere { radius: size },
            Kind::Torus => Shape::Torus { ring_radius: ring, tube_radius: size },
        }
    }
}

fn dimensions(shape: &Shape) -> [f64; 2] {
    match *shape {
        Shape::Cylinder { radius, .. } | Shape::Sphere { radius } => [radius, 0.0],
        Shape::Cone { half_angle, .. } => [half_angle, 0.0],
        Shape::Torus { ring_radius, tube_radius } => [tube_radius, ring_radius],
        _ => [0.0; 2],
    }
}

fn crossing(a: Point, b: Point, z: f64) -> f64 {
    a[0] + (z - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
}

fn distance(shape: &Shape, [r, z]: Point, bottom: f64) -> f64 {
    let z = z - bottom;
    match *shape {
        // distance from the bottom or from the side, whichever is nearer
        Shape::Cylinder { radius, .. } => f64::min(z.abs(), (r - radius).abs()),
        Shape::Cone { half_angle, .. } => {
            let (sin, cos) = half_angle.to_radians().sin_cos();
            (r * cos - z * sin).abs()
        }
        Shape::Sphere { radius } => (norm([r, z - radius]) - radius).abs(),
        Shape::Torus { ring_radius, tube_radius } => {
            (norm([r - ring_radius, z - tube_radius]) - tube_radius).abs()
        }
        _ => f64::INFINITY,
    }
}

//! Recognises the shape of the wetted contour, so that the damping of a tank does not depend on how
//! it is drawn.

use formulas::damping;

use crate::contour::Wall;
use crate::curve::{Point, norm, sub};
use crate::tank::Shape;

/// Largest distance of the wetted wall from a shape, over its size.
const SAME: f64 = 1e-6;

/// Number of positions compared on each segment.
const PLACES: usize = 64;

/// A shape with measured damping, its wetted part, and its fill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Recognised {
    /// The shape, large enough for the fill.
    pub shape: Shape,
    /// Fill, m above the lowest point.
    pub fill: f64,
}

impl Recognised {
    /// Returns the shape for the damping formulas.
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

/// Recognises a wetted wall as a sphere, upright cylinder, cone or torus. `fill` is the height of
/// the free surface above the lowest point, m.
pub(crate) fn recognise(wall: &Wall, fill: f64) -> Option<Recognised> {
    let points: Vec<Point> = wall
        .segments
        .iter()
        .flat_map(|part| (0..=PLACES).map(|i| part.at(i as f64 / PLACES as f64)))
        .collect();
    let (first, last) = (*points.first()?, *points.last()?);
    let (bottom, radius) = (last[1] - fill, last[0]);
    let size = fill.max(radius);
    let fits =
        |distance: &dyn Fn(Point) -> f64| points.iter().all(|p| distance(*p).abs() <= SAME * size);
    let closed = first[0] <= SAME * size && (first[1] - bottom).abs() <= SAME * size;
    if closed {
        // The bottom or the wall, whichever is nearer.
        if fits(&|p| f64::min((p[1] - bottom).abs(), (p[0] - radius).abs())) {
            return Some(Recognised { shape: Shape::Cylinder { radius, height: fill }, fill });
        }
        let slope = radius / fill;
        if fits(&|p| (p[0] - slope * (p[1] - bottom)) / slope.hypot(1.0)) {
            let half_angle = slope.atan().to_degrees();
            return Some(Recognised { shape: Shape::Cone { half_angle, height: fill }, fill });
        }
        // The circle about the axis through bottom and contact line.
        let sphere = (radius * radius + fill * fill) / (2.0 * fill);
        if fits(&|p| norm([p[0], p[1] - bottom - sphere]) - sphere) {
            return Some(Recognised { shape: Shape::Sphere { radius: sphere }, fill });
        }
        return None;
    }
    // The circle through both contact lines, which are level, and the lowest point.
    let tube = {
        let half = 0.5 * (last[0] - first[0]);
        (half * half + fill * fill) / (2.0 * fill)
    };
    let center = [0.5 * (first[0] + last[0]), bottom + tube];
    (center[0] > tube && fits(&|p| norm(sub(p, center)) - tube)).then_some(Recognised {
        shape: Shape::Torus { ring_radius: center[0], tube_radius: tube },
        fill,
    })
}

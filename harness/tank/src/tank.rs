//! A tank from a TOML file, and its modal parameters at a fill.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::closed_form;
use crate::contour::{Contour, Problems, Volume};
use crate::curve::{Curve, Point, Segment};
use crate::modal::{self, ModalData};
use crate::spline::spline;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: Option<String>,
    density: Option<f64>,
    profile: Option<Vec<Entry>>,
    #[serde(rename = "box")]
    lengths: Option<[f64; 2]>,
    points: Option<PathBuf>,
    spline: Option<bool>,
    svg: Option<PathBuf>,
    scale: Option<f64>,
    shape: Option<Shape>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Entry {
    Line([f64; 4]),
    Arc([f64; 5]),
    Ellipse([f64; 6]),
    Cassini([f64; 5]),
    Cosine([f64; 6]),
}

/// A tank given by its dimensions, m and degrees, with its lowest point at z = 0.
///
/// - `Cylinder`: upright, with flat ends.
/// - `Annulus`: ring between two upright walls, with a flat bottom.
/// - `Spheroid`: ellipsoid of revolution about the vertical axis.
/// - `Cone`: apex at the bottom, open at the top.
/// - `DomedCylinder`: cylinder with elliptical domes; `bottom` and `top` are the heights of the
///   domes, 0 for a flat end. If `bottom` is negative, the bottom bulges into the tank.
/// - `Torispherical`: cylinder whose heads have a spherical crown and a toroidal knuckle.
/// - `Torus`: ring with a circular section, its axis vertical.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    Cylinder { radius: f64, height: f64 },
    Sphere { radius: f64 },
    Spheroid { radius: f64, half_height: f64 },
    Cone { half_angle: f64, height: f64 },
    DomedCylinder { radius: f64, height: f64, bottom: f64, top: f64 },
    Torispherical { radius: f64, height: f64, crown_radius: f64, knuckle_radius: f64 },
    Annulus { inner_radius: f64, outer_radius: f64, height: f64 },
    Torus { ring_radius: f64, tube_radius: f64 },
}

impl Shape {
    pub fn segments(&self) -> Result<Vec<Segment>, Problems> {
        let mut problems = Vec::new();
        let mut above = |limit: f64, dimensions: &[(&str, f64)]| {
            for (name, value) in dimensions.iter().filter(|d| !(d.1 > limit && d.1.is_finite())) {
                problems
                    .push(format!("shape: {name} is {value}; it must be a number above {limit}."));
            }
        };
        let segments = match *self {
            Shape::Cylinder { radius, height } => {
                above(0.0, &[("radius", radius), ("height", height)]);
                vec![
                    Segment::line([0.0, 0.0], [radius, 0.0]),
                    Segment::line([radius, 0.0], [radius, height]),
                ]
            }
            Shape::Sphere { radius } => {
                above(0.0, &[("radius", radius)]);
                vec![Segment::arc([0.0, radius], radius, -90.0, 90.0)]
            }
            Shape::Spheroid { radius, half_height } => {
                above(0.0, &[("radius", radius), ("half_height", half_height)]);
                vec![Segment::ellipse([0.0, half_height], radius, half_height, -90.0, 90.0)]
            }
            Shape::Cone { half_angle, height } => {
                let rest = 90.0 - half_angle;
                above(0.0, &[("half_angle", half_angle), ("90 - half_angle", rest)]);
                above(0.0, &[("height", height)]);
                vec![Segment::line([0.0, 0.0], [height * half_angle.to_radians().tan(), height])]
            }
            Shape::DomedCylinder { radius, height, bottom, top } => {
                above(0.0, &[("radius", radius), ("height", height)]);
                above(-height, &[("bottom", bottom)]);
                above(-f64::MIN_POSITIVE, &[("top", top)]);
                // height of the lower edge of the cylindrical part
                let z = bottom.max(0.0);
                let mut segments = vec![if bottom == 0.0 {
                    Segment::line([0.0, 0.0], [radius, 0.0])
                } else {
                    let from = if bottom > 0.0 { -90.0 } else { 90.0 };
                    Segment::ellipse([0.0, z], radius, bottom.abs(), from, 0.0)
                }];
                segments.push(Segment::line([radius, z], [radius, z + height]));
                if top > 0.0 {
                    segments.push(Segment::ellipse([0.0, z + height], radius, top, 0.0, 90.0));
                }
                segments
            }
            Shape::Torispherical { radius, height, crown_radius, knuckle_radius } => {
                above(
                    0.0,
                    &[("radius", radius), ("height", height), ("knuckle_radius", knuckle_radius)],
                );
                above(0.0, &[("radius - knuckle_radius", radius - knuckle_radius)]);
                above(radius, &[("crown_radius", crown_radius)]);
                // Crown and knuckle touch on the straight line through the centres of their circles.
                let (crown, knuckle) = (crown_radius, knuckle_radius);
                let rise = ((crown - knuckle).powi(2) - (radius - knuckle).powi(2)).sqrt();
                let depth = crown - rise;
                let angle = rise.atan2(radius - knuckle).to_degrees();
                vec![
                    Segment::arc([0.0, crown], crown, -90.0, -angle),
                    Segment::arc([radius - knuckle, depth], knuckle, -angle, 0.0),
                    Segment::line([radius, depth], [radius, depth + height]),
                    Segment::arc([radius - knuckle, depth + height], knuckle, 0.0, angle),
                    Segment::arc([0.0, depth + height - rise], crown, angle, 90.0),
                ]
            }
            Shape::Annulus { inner_radius, outer_radius, height } => {
                above(0.0, &[("inner_radius", inner_radius)]);
                above(inner_radius.max(0.0), &[("outer_radius", outer_radius)]);
                above(0.0, &[("height", height)]);
                vec![
                    Segment::line([inner_radius, height], [inner_radius, 0.0]),
                    Segment::line([inner_radius, 0.0], [outer_radius, 0.0]),
                    Segment::line([outer_radius, 0.0], [outer_radius, height]),
                ]
            }
            Shape::Torus { ring_radius, tube_radius } => {
                above(0.0, &[("tube_radius", tube_radius)]);
                above(tube_radius.max(0.0), &[("ring_radius", ring_radius)]);
                vec![Segment::arc([ring_radius, tube_radius], tube_radius, -270.0, 90.0)]
            }
        };
        if problems.is_empty() { Ok(segments) } else { Err(Problems(problems)) }
    }
}

/// Shape of a tank, lengths in m: a body of revolution, with the [`Shape`] from which it was built,
/// if any, or a box that is open at the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    Revolution { contour: Contour, shape: Option<Shape> },
    Box { length_x: f64, length_y: f64 },
}

#[derive(Clone, Debug, PartialEq)]
pub struct Tank {
    pub name: Option<String>,
    pub density: f64,
    pub geometry: Geometry,
}

/// Amount of liquid in a tank: the height of the free surface above the tank's lowest point, m; a
/// fraction of the tank's volume, 1 for a full tank; or the mass of the liquid, kg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fill {
    Height(f64),
    Share(f64),
    Mass(f64),
}

#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is neither a height in m (1.2) nor per cent of the volume (60%)")]
pub struct NotAFill(String);

impl core::str::FromStr for Fill {
    type Err = NotAFill;

    fn from_str(text: &str) -> Result<Fill, NotAFill> {
        let number = |text: &str| text.trim().parse().map_err(|_| NotAFill(text.into()));
        match text.trim().strip_suffix('%') {
            Some(percent) => Ok(Fill::Share(number(percent)? / 100.0)),
            None => Ok(Fill::Height(number(text)?)),
        }
    }
}

/// Largest number of segments of a contour. It is limited because each segment is divided into
/// several panels, so that the computing time grows fast.
const MOST_SEGMENTS: usize = 200;

/// Phrases in the messages of the TOML reader, each with the phrase about tank files that replaces
/// it for the user.
const TERMS: [(&str, &str); 7] = [
    (
        "invalid type: unit variant, expected struct variant",
        "the shape has no dimensions (write for example { sphere = { radius = 0.4 } })",
    ),
    ("invalid type: ", "wrong type: "),
    ("expected f64", "expected a number"),
    ("unknown variant ", "unknown name "),
    (", expected one of ", ", allowed are "),
    ("unexpected keys in table: ", "unknown dimension "),
    (", available keys: ", ", allowed are "),
];

fn explain_toml_error(error: &toml::de::Error) -> String {
    let text = error.to_string().trim_end().to_string();
    TERMS.iter().fold(text, |text, (term, words)| text.replace(term, words))
}

pub const MOST_MODES: usize = 20;

impl Tank {
    /// Reads a tank from a TOML file. Paths in the file are relative to the file's folder.
    ///
    /// # Errors
    /// Lists all problems of the file.
    pub fn read(path: &Path) -> Result<Tank, Problems> {
        let text = crate::contour::read_text(path)?;
        Tank::parse(&text, path.parent().unwrap_or(Path::new("")))
    }

    /// Parses the text of a tank's TOML file. Paths in the text are relative to `folder`.
    ///
    /// # Errors
    /// Lists all problems of the file.
    pub fn parse(text: &str, folder: &Path) -> Result<Tank, Problems> {
        let file: File = toml::from_str(text).map_err(|error| explain_toml_error(&error))?;
        let mut problems = Vec::new();
        let density = match file.density {
            Some(density) if density > 0.0 && density.is_finite() => density,
            Some(density) => {
                problems
                    .push(format!("density is {density}; it must be a number above 0, in kg/m³."));
                1.0
            }
            None => {
                problems.push("density is missing: the liquid's density in kg/m³.".to_string());
                1.0
            }
        };
        if file.spline.is_some() && file.points.is_none() {
            problems.push(
                "spline is given without points (allowed: only together with points).".to_string(),
            );
        }
        if file.scale.is_some() && file.svg.is_none() {
            problems
                .push("scale is given without svg (allowed: only together with svg).".to_string());
        }
        let scale = file.scale.unwrap_or(1.0);
        if !(scale > 0.0 && scale.is_finite()) {
            problems.push(format!("scale is {scale}; it must be a number above 0, in m per unit."));
        }
        let given = [
            ("svg", file.svg.is_some()),
            ("profile", file.profile.is_some()),
            ("points", file.points.is_some()),
            ("shape", file.shape.is_some()),
            ("box", file.lengths.is_some()),
        ];
        let names: Vec<&str> = given.iter().filter(|g| g.1).map(|g| g.0).collect();
        if names.len() > 1 {
            problems.push(format!(
                "{} exclude each other: give only one of them.",
                names.join(" and ")
            ));
        }
        let geometry = if let Some(entries) = &file.profile {
            revolution(entries.iter().map(segment).collect(), None)
        } else if let Some(points) = &file.points {
            read_points(&folder.join(points))
                .and_then(|points| {
                    if file.spline == Some(true) { spline(&points) } else { polyline(&points) }
                })
                .and_then(|segments| revolution(segments, None))
        } else if let Some(svg) = &file.svg {
            crate::svg::read(&folder.join(svg), scale)
                .and_then(|segments| revolution(segments, None))
        } else if let Some(shape) = file.shape {
            shape.segments().and_then(|segments| revolution(segments, Some(shape)))
        } else if let Some(lengths) = file.lengths {
            rectangle(lengths)
        } else {
            Err("There is no tank: give profile, points, svg, shape or box.".to_string().into())
        };
        let geometry = with_problems(problems, geometry)?;
        Ok(Tank { name: file.name, density, geometry })
    }

    /// Creates a tank from a shape, with a liquid of the density `density`, kg/m³.
    ///
    /// # Errors
    /// Lists every dimension outside its range.
    pub fn from_shape(shape: Shape, density: f64) -> Result<Tank, Problems> {
        let geometry = revolution(shape.segments()?, Some(shape))?;
        Ok(Tank { name: None, density, geometry })
    }

    pub fn depth(&self) -> Option<f64> {
        self.contour().map(Contour::depth)
    }

    /// Returns the height of the free surface above the lowest point, m, for an amount of liquid. A
    /// fraction of the volume may be 0 to 1, and a mass 0 to the mass of the full tank. A height is
    /// returned unchanged and unchecked.
    ///
    /// # Errors
    /// An amount above the tank's capacity or below 0; a fraction of a box, which is open at the
    /// top.
    pub fn fill_height(&self, fill: Fill) -> Result<f64, Problems> {
        let capacity = self.contour().map(Contour::capacity);
        let volume = match (fill, capacity) {
            (Fill::Height(height), _) => return Ok(height),
            (Fill::Share(share), _) if !(0.0..=1.0).contains(&share) => {
                return Err(format!(
                    "The fill is {} % of the tank's volume; it must be 0 to 100 %.",
                    100.0 * share
                )
                .into());
            }
            (Fill::Share(share), Some(capacity)) => share * capacity,
            (Fill::Share(_), None) => {
                return Err("A box is open at the top and has no volume to take per cent of: give the fill as \
                            a height or a mass."
                    .into());
            }
            (Fill::Mass(mass), _) if !(mass >= 0.0 && mass.is_finite()) => {
                return Err(format!("The liquid's mass is {mass} kg; it must be 0 or more.").into());
            }
            (Fill::Mass(mass), _) => mass / self.density,
        };
        if let Some(capacity) = capacity.filter(|c| volume > c * (1.0 + 1e-9)) {
            return Err(format!(
                "{} kg are more than the tank holds: {:.6} kg ({capacity:.6} m³ at {} kg/m³).",
                volume * self.density,
                capacity * self.density,
                self.density
            )
            .into());
        }
        Ok(match &self.geometry {
            Geometry::Revolution { contour, .. } => contour.fill_from_volume(volume),
            Geometry::Box { length_x, length_y } => volume / (length_x * length_y),
        })
    }

    /// Returns the mass of the liquid, kg, at `fill`, m above the lowest point. It is bit-identical
    /// to the mass in the result of [`Tank::solve`], but does not take the time to solve for modes.
    ///
    /// # Errors
    /// A fill outside the tank.
    pub fn mass(&self, fill: f64) -> Result<f64, Problems> {
        let wall = match &self.geometry {
            Geometry::Revolution {
                shape: Some(Shape::Cylinder { .. } | Shape::Annulus { .. }),
                ..
            }
            | Geometry::Box { .. } => None,
            Geometry::Revolution { contour, .. } => contour.cut(fill).ok(),
        };
        match wall {
            Some(wall) => Ok(self.density * Volume::from_wall(&wall).volume),
            None => Ok(self.solve(fill, 1)?.m_liq),
        }
    }

    /// Solves for the modal parameters of the tank at `fill`, m above the lowest point, with
    /// `modes` modes. A full closed tank has no free surface and no modes.
    ///
    /// Cylinders and annuli given by their dimensions, and boxes, are solved in closed form, all
    /// other tanks by the boundary integral equation.
    ///
    /// # Errors
    /// A fill outside the tank; a number of modes outside 1 to [`MOST_MODES`].
    pub fn solve(&self, fill: f64, modes: usize) -> Result<ModalData, Problems> {
        let mut problems = Vec::new();
        if !(1..=MOST_MODES).contains(&modes) {
            problems.push(format!("The number of modes is {modes}; it must be 1 to {MOST_MODES}."));
        }
        let rho = self.density;
        let solved = match &self.geometry {
            Geometry::Box { length_x, length_y } if fill > 0.0 && fill.is_finite() => {
                Ok(closed_form::rectangular(*length_x, *length_y, fill, rho, modes))
            }
            Geometry::Box { .. } => {
                Err(format!("The fill is {fill} m; it must be a height above 0.").into())
            }
            Geometry::Revolution { contour, shape } => contour.cut(fill).and_then(|wall| {
                if !problems.is_empty() {
                    return Err(Problems(Vec::new()));
                }
                match *shape {
                    Some(Shape::Cylinder { radius, .. }) => {
                        Ok(closed_form::cylinder(radius, fill, rho, modes))
                    }
                    Some(Shape::Annulus { inner_radius, outer_radius, .. }) => {
                        Ok(closed_form::annulus(inner_radius, outer_radius, fill, rho, modes))
                    }
                    _ => modal::solve(wall, rho, fill, modes),
                }
            }),
        };
        let full =
            if problems.is_empty() && solved.is_err() { self.full_tank_data(fill) } else { None };
        Ok(self.with_name_and_lowest_point(with_problems(problems, full.map_or(solved, Ok))?))
    }

    fn contour(&self) -> Option<&Contour> {
        match &self.geometry {
            Geometry::Revolution { contour, .. } => Some(contour),
            Geometry::Box { .. } => None,
        }
    }

    fn kind(&self) -> &'static str {
        if self.contour().is_some() { "revolution" } else { "box" }
    }

    pub(crate) fn empty(&self) -> ModalData {
        let bottom = self.contour().map_or(0.0, Contour::bottom);
        let data =
            ModalData::new(self.kind(), self.density, 0.0, 0.0, bottom, [0.0; 3], Vec::new());
        self.with_name_and_lowest_point(data)
    }

    fn with_name_and_lowest_point(&self, mut data: ModalData) -> ModalData {
        data.name.clone_from(&self.name);
        if let Geometry::Revolution { contour, shape: None } = &self.geometry {
            data.z_lowest = contour.bottom();
        }
        data
    }

    fn full_tank_data(&self, fill: f64) -> Option<ModalData> {
        let contour = self.contour()?;
        if (fill / contour.depth() - 1.0).abs() > 1e-9 {
            return None;
        }
        modal::solve(contour.closed()?, self.density, fill, 0).ok()
    }
}

/// Returns the value of `result` if there are no `problems`. Otherwise it returns an error that
/// lists `problems` and the errors of `result`, so that the user sees all faults of a file at once.
fn with_problems<T>(mut problems: Vec<String>, result: Result<T, Problems>) -> Result<T, Problems> {
    match result {
        Ok(value) if problems.is_empty() => return Ok(value),
        Ok(_) => {}
        Err(more) => problems.extend(more.0),
    }
    Err(Problems(problems))
}

fn revolution(segments: Vec<Segment>, shape: Option<Shape>) -> Result<Geometry, Problems> {
    if segments.len() > MOST_SEGMENTS {
        let count = segments.len();
        return Err(format!("The contour has {count} segments, at most {MOST_SEGMENTS}.").into());
    }
    Ok(Geometry::Revolution { contour: Contour::new(segments)?, shape })
}

fn rectangle(lengths: [f64; 2]) -> Result<Geometry, Problems> {
    let [length_x, length_y] = lengths;
    if let Some(bad) = lengths.iter().find(|l| !(**l > 0.0 && l.is_finite())) {
        return Err(
            format!("box: a length is {bad} m; both side lengths must be above 0 m.").into()
        );
    }
    if let Some(long) = lengths.iter().find(|l| **l > crate::contour::LARGEST) {
        return Err(format!(
            "box: a length is {long} m; lengths are in metres and at most {} m (millimetres?).",
            crate::contour::LARGEST
        )
        .into());
    }
    Ok(Geometry::Box { length_x, length_y })
}

fn segment(entry: &Entry) -> Segment {
    match *entry {
        Entry::Line([r0, z0, r1, z1]) => Segment::line([r0, z0], [r1, z1]),
        Entry::Arc([rc, zc, radius, deg0, deg1]) => Segment::arc([rc, zc], radius, deg0, deg1),
        Entry::Ellipse([rc, zc, a_r, a_z, deg0, deg1]) => {
            Segment::ellipse([rc, zc], a_r, a_z, deg0, deg1)
        }
        Entry::Cassini([zc, a, c, deg0, deg1]) => Segment {
            curve: Curve::Cassini { zc, a, c },
            from: deg0.to_radians(),
            to: deg1.to_radians(),
        },
        Entry::Cosine([r0, r1, z0, z1, p0, p1]) => Segment {
            curve: Curve::Cosine { r0, r1, z: [z0, z1], p: [p0, p1] },
            from: 0.0,
            to: 1.0,
        },
    }
}

/// Reads the two columns r and z, m, of a file of points. A first line without numbers counts as a
/// heading, and `#` begins a comment.
fn read_points(path: &Path) -> Result<Vec<Point>, Problems> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_path(path)
        .map_err(|error| format!("Could not read {}: {error}.", path.display()))?;
    let (mut points, mut problems) = (Vec::new(), Vec::new());
    for (index, record) in reader.records().enumerate() {
        let record =
            record.map_err(|error| format!("Could not read {}: {error}.", path.display()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let numbers: Vec<Option<f64>> = record.iter().map(|field| field.parse().ok()).collect();
        match numbers[..] {
            [Some(r), Some(z)] if f64::is_finite(r) && f64::is_finite(z) => points.push([r, z]),
            _ if index == 0 && numbers.iter().all(Option::is_none) => {}
            _ => problems.push(format!(
                "{}, line {line}: expected two numbers r, z, found `{}`.",
                path.display(),
                record.iter().collect::<Vec<_>>().join(",")
            )),
        }
    }
    if points.len() < 2 && problems.is_empty() {
        problems.push(format!(
            "{} has {} point(s); a contour needs at least two.",
            path.display(),
            points.len()
        ));
    }
    if problems.is_empty() { Ok(points) } else { Err(Problems(problems)) }
}

fn polyline(points: &[Point]) -> Result<Vec<Segment>, Problems> {
    if points.len() > MOST_SEGMENTS + 1 {
        return Err(format!(
            "{} points are joined by straight lines, at most {MOST_SEGMENTS}; spline = true takes any \
             number of them.",
            points.len()
        )
        .into());
    }
    Ok(points.windows(2).map(|p| Segment::line(p[0], p[1])).collect())
}

//! Geometry of a run's bench or craft, computed from its parameters.
//!
//! The contour of a tank is not a parameter of an FMU. If the user gives no contour, the tank is drawn
//! as an upright cylinder:
//!
//! ```text
//! radius R        from the wave at the wall, w_1 = 2 R/(xi^2 - 1)
//! depth h         from m_1/m_liq = 2 tanh(xi h/R)/(xi (xi^2 - 1) h/R), which decreases with h/R
//! height          its middle at z_liq = [m_0 H_0 + sum m_n (h_n - l_n)]/m_liq
//! ```
//!
//! The result is exact for an upright cylinder. In a draining tank of any shape the surface is at z_s = d(m z_liq)/dm,
//! because added liquid is on top.

use std::collections::BTreeMap;

use formulas::cylinder::{MODES, XI, pendulum};
use formulas::interpolation::{derivatives, quintic};
use host::description::{ModelDescription, Value};
use names::Array;
use names::hubslosh::{self, SloshModel, SloshSource, fluid, tank};

/// Parameters of a run: the values that were set, and otherwise the FMU's start values.
pub(super) struct Parameters<'a> {
    pub description: &'a ModelDescription,
    pub set: &'a BTreeMap<String, String>,
}

impl Parameters<'_> {
    fn value(&self, name: &str) -> Option<(Value, String)> {
        let variable = self.description.variable(name).ok()?;
        let text = self.set.get(name).or(variable.attributes().start.as_ref())?;
        Some((self.description.value(variable, text).ok()?, text.clone()))
    }

    /// Returns the value of a parameter in SI units; 0 if the FMU has no parameter with this name.
    pub fn number(&self, name: &str) -> f64 {
        let number = self.value(name).map(|(value, _)| value.number());
        number.filter(|number| !number.is_nan()).unwrap_or(0.0)
    }

    pub fn item(&self, name: &str) -> String {
        let Some((Value::Integer(n), text)) = self.value(name) else { return String::new() };
        let variable = self.description.variable(name).expect("it has a value");
        let items = self.description.items(variable);
        items.iter().find(|item| item.value == n).map_or(text, |item| item.name.clone())
    }

    /// Returns the item of the enumeration `name`. For hosts that cannot set enumerations, the number in the parameter
    /// `kind` selects the item instead.
    pub fn choice(&self, name: &str, kind: &str) -> String {
        let number = self.number(kind) as i64;
        let items = self.description.variable(name).map(|v| self.description.items(v));
        let item = items.unwrap_or_default().iter().find(|item| item.value == number);
        item.map_or_else(|| self.item(name), |item| item.name.clone())
    }

    pub fn vector<const N: usize>(&self, name: &str) -> [f64; N] {
        std::array::from_fn(|i| self.number(&format!("{name}[{}]", i + 1)))
    }
}

/// Outline of a tank, m, in the axes of the tank: a contour, or the side lengths of a box along x and y with the heights
/// of bottom and top.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    Revolved(Vec<[f64; 2]>),
    Box([f64; 4]),
}

/// Function that returns the surface shapes of the first modes for a mass of liquid, kg. A shape is the
/// elevation at equal steps of the radius, from the axis or the inner wall to the outer wall, divided by the
/// elevation at the outer wall.
pub type Surfaces = dyn Fn(f64, usize) -> anyhow::Result<Vec<Vec<f64>>>;

/// Drawing of a tank that the user has given. `levels` are masses of liquid, kg, in ascending order, each with the height
/// of the surface at rest, m. A box has no `surfaces`, because its modes are sines.
pub struct Drawing {
    pub name: String,
    pub outline: Outline,
    pub levels: Vec<[f64; 2]>,
    pub surfaces: Option<Box<Surfaces>>,
}

impl Drawing {
    fn level(&self, liquid: f64) -> f64 {
        interpolate(&self.levels, liquid)
    }
}

/// Interpolates linearly between points with ascending x. Outside of the points the value of the nearest end is returned.
fn interpolate(points: &[[f64; 2]], x: f64) -> f64 {
    let after = points.partition_point(|p| p[0] < x);
    match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
        (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]),
        (Some(end), None) => end[1],
        (None, Some(end)) => end[1],
        (None, None) => 0.0,
    }
}

/// A slosh pendulum of a tank. `order` is the index of its mode, from 0, among the modes that move in the same direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pendulum {
    pub mass: f64,
    pub length: f64,
    pub hinge: f64,
    pub wave: f64,
    pub order: usize,
}

impl Pendulum {
    fn from_formula((order, one): (usize, &formulas::cylinder::Pendulum)) -> Pendulum {
        let formulas::cylinder::Pendulum { mass, length, hinge, wave } = *one;
        Pendulum { mass, length, hinge, wave, order }
    }
}

fn order<T: PartialEq>(n: usize, direction: impl Fn(usize) -> T) -> usize {
    (0..n).filter(|m| direction(*m) == direction(n)).count()
}

pub(super) struct Tank {
    pub prefix: String,
    pub position: [f64; 3],
    pub q: [f64; 4],
    pub outline: Outline,
    pub level: f64,
    pub liquid: f64,
    pub modes: Vec<Pendulum>,
    pub shapes: Vec<Vec<f64>>,
    pub fill: Option<Fill>,
    pub note: String,
}

impl Tank {
    /// Returns the radius of the sphere about the tank's origin that contains the tank, m.
    pub fn extent(&self) -> f64 {
        self.extent_from(0.0)
    }

    /// Returns the height of the tank's middle above its origin, and the radius of the sphere about this middle that
    /// contains the tank, both in m.
    pub fn middle_and_extent(&self) -> [f64; 2] {
        let middle = match &self.outline {
            Outline::Revolved(points) => {
                let heights = points.iter().map(|p| p[1]);
                let [low, high] =
                    [f64::min, f64::max].map(|extreme| heights.clone().reduce(extreme));
                0.5 * (low.unwrap_or(0.0) + high.unwrap_or(0.0))
            }
            Outline::Box([_, _, low, high]) => 0.5 * (low + high),
        };
        [middle, self.extent_from(middle)]
    }

    fn extent_from(&self, height: f64) -> f64 {
        match &self.outline {
            Outline::Revolved(points) => {
                points.iter().map(|p| p[0].hypot(p[1] - height)).fold(0.0, f64::max)
            }
            Outline::Box([a, b, low, high]) => {
                let off = (low - height).abs().max((high - height).abs());
                (0.5 * a.hypot(*b)).hypot(off)
            }
        }
    }
}

/// Modes and surface height of a draining tank over the mass of its liquid, interpolated as in the FMU. `masses` are
/// the points of the fill table, kg. `modes` has for each mode the pendulum length l and the hinge height h as two
/// curves, 1/l and h − l, each with its first and second derivative at the points. `levels` are pairs of a mass, kg,
/// and the height of the surface, m.
pub(super) struct Fill {
    masses: Vec<f64>,
    modes: Vec<[Vec<[f64; 3]>; 2]>,
    levels: Vec<[f64; 2]>,
}

impl Fill {
    pub fn level(&self, liquid: f64) -> f64 {
        interpolate(&self.levels, liquid)
    }

    /// Interpolates length and hinge height of mode `n` (from 0), m, for a mass of liquid in kg.
    pub fn mode(&self, n: usize, liquid: f64) -> [f64; 2] {
        let last = self.masses.len() - 1;
        let liquid = liquid.clamp(self.masses[0], self.masses[last]);
        let i = self.masses[1..last].partition_point(|m| *m <= liquid);
        let h = self.masses[i + 1] - self.masses[i];
        let t = (liquid - self.masses[i]) / h;
        let [stiffness, bob] = [0, 1].map(|k| {
            let curve = &self.modes[n][k];
            quintic(h, curve[i], curve[i + 1]).iter().rev().fold(0.0, |sum, c| sum * t + c)
        });
        [1.0 / stiffness, bob + 1.0 / stiffness]
    }
}

/// Assumed height of the drawn cylinder's wall above the liquid, in radii of the cylinder. No
/// parameter of the FMU states it.
const FREEBOARD: f64 = 0.7;

fn cylinder(radius: f64, bottom: f64, level: f64) -> Outline {
    Outline::Revolved(vec![[0.0, bottom], [radius, bottom], [radius, level + FREEBOARD * radius]])
}

/// Returns the ratio of depth to radius, h/R, of the upright cylinder whose first mode has this fraction of the
/// liquid's mass, by bisection.
fn depth_over_radius(share: f64) -> f64 {
    let xi = XI[0];
    let share_at = |x: f64| 2.0 * (xi * x).tanh() / (xi * (xi * xi - 1.0) * x);
    let (mut low, mut high) = (0.02, 50.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *if share_at(middle) > share { &mut low } else { &mut high } = middle;
    }
    0.5 * (low + high)
}

/// Returns the pendulum length of a mode, m, that gives it the natural frequency `frequency` (Hz) at the acceleration
/// `g` (m/s²), together with a stiffness per mass `k_over_m` (1/s²). Returns `given` if `frequency` is 0.
fn length(given: f64, frequency: f64, g: f64, k_over_m: f64) -> f64 {
    let omega = std::f64::consts::TAU * frequency;
    let stiffness = (omega * omega - k_over_m) / g;
    if frequency > 0.0 && stiffness > 0.0 { 1.0 / stiffness } else { given }
}

const DRAWN: &str = "an upright cylinder that matches the wave at the wall, the first mode's share of the liquid and the \
    liquid's centre of mass, with a cylinder's surface (--tank draws the tank itself)";

pub(super) fn bench(parameters: &Parameters, drawing: Option<&Drawing>) -> Tank {
    let number = |name: &str| parameters.number(name);
    let radius = 0.5 * number(tank::D);
    let is_table = parameters.choice(hubslosh::slosh::SOURCE, hubslosh::slosh::SOURCE_KIND)
        == SloshSource::Table.name();
    let count = match parameters.choice(hubslosh::slosh::MODEL, hubslosh::slosh::KIND).as_str() {
        model if model == SloshModel::Frozen.name() => 0,
        _ => (number(hubslosh::slosh::MODES) as usize).clamp(1, MODES),
    };
    let (modes, level, mut bottom, m_liq, mut note) = match is_table {
        false => {
            let h = number(tank::H);
            let m_liq = number(fluid::RHO) * std::f64::consts::PI * radius * radius * h;
            let modes: Vec<_> = (0..count).map(|n| pendulum(n, 2.0 * radius, h, m_liq)).collect();
            let note =
                "The tank is drawn with tank.d and tank.h; the height of its wall is not a parameter and is assumed."
                    .into();
            (modes, h, 0.0, m_liq, note)
        }
        true => {
            use names::hubslosh::slosh::table::{
                FREQUENCY, G_REF, HINGE, K, LENGTH, M_LIQ, MASS, WAVE,
            };
            let m_liq = number(M_LIQ);
            let g = number(G_REF);
            let element = |array: Array<1>, n: usize| number(&array.element([n + 1]));
            let mass = |n: usize| element(MASS, n);
            let depth = radius * depth_over_radius(mass(0) / m_liq);
            let mut modes = Vec::new();
            let mut bottom = 0.0;
            // The first mode with its position, and the other modes in use.
            for n in (0..count.max(1)).take_while(|n| *n == 0 || mass(*n) > 0.0) {
                let l =
                    length(element(LENGTH, n), element(FREQUENCY, n), g, element(K, n) / mass(n));
                let like = pendulum(n, 2.0 * radius, depth, m_liq);
                let wave = if element(WAVE, n) > 0.0 { element(WAVE, n) } else { like.wave };
                // hinge heights of a cylinder, if the table contains none
                let hinge =
                    if element(HINGE, n) == 0.0 { bottom + like.hinge } else { element(HINGE, n) };
                if n == 0 {
                    bottom = (hinge - l) - (like.hinge - like.length);
                }
                modes.push(formulas::cylinder::Pendulum { mass: mass(n), length: l, hinge, wave });
            }
            modes.truncate(count);
            let note = format!(
                "Only the modes of the tank are known (slosh.source = table): it is drawn as {DRAWN}."
            );
            (modes, bottom + depth, bottom, m_liq, note)
        }
    };
    let mut level = level;
    let outline = match drawing {
        Some(drawing) => {
            note = format!("The tank is drawn as {}.", drawing.name);
            level = drawing.level(m_liq);
            bottom = lowest(&drawing.outline);
            match drawing.outline {
                // `hubslosh tank` computes the modes along the first side of a box, which is the tangential
                // side on the bench
                Outline::Box([a, b, low, high]) => Outline::Box([b, a, low, high]),
                Outline::Revolved(_) => drawing.outline.clone(),
            }
        }
        None => cylinder(radius, bottom, level),
    };
    Tank {
        prefix: String::new(),
        // the tank stands on the platform, so that its bottom is at z = 0
        position: [number(tank::R), 0.0, -bottom],
        q: [1.0, 0.0, 0.0, 0.0],
        outline,
        level,
        liquid: m_liq,
        modes: modes
            .iter()
            .enumerate()
            .map(|(n, mode)| {
                let direction =
                    |n: usize| number(&hubslosh::slosh::table::DIRECTION.element([n + 1]));
                Pendulum::from_formula((if is_table { order(n, direction) } else { n }, mode))
            })
            .collect(),
        shapes: Vec::new(),
        fill: None,
        note,
    }
}

fn lowest(outline: &Outline) -> f64 {
    match outline {
        Outline::Revolved(points) => points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min),
        Outline::Box([_, _, low, _]) => *low,
    }
}

pub(super) fn tank(parameters: &Parameters, prefix: &str, drawing: Option<&Drawing>) -> Tank {
    let number = |key: &str| parameters.number(&format!("{prefix}.{key}"));
    let count = (number("modes") as usize).max(1);
    let element = |key: &str, n: usize| number(&format!("{key}[{}]", n + 1));
    let points = number("fill.points") as usize;
    let diameter = number("diameter");
    let fill = (points > 1).then(|| fill(&number, points, count));
    let mut modes: Vec<Pendulum> = (0..count)
        .map(|n| {
            let mass = element("mass", n);
            let l = length(
                element("length", n),
                element("frequency", n),
                number("g_ref"),
                element("k", n) / mass,
            );
            let direction = |n: usize| [1, 2].map(|i| number(&format!("direction[{},{i}]", n + 1)));
            let order = order(n, direction);
            Pendulum {
                mass,
                length: l,
                hinge: element("hinge", n),
                wave: element("wave", n),
                order,
            }
        })
        .collect();
    let (radius, level, bottom, m_liq, mut note);
    if let Some(fill) = &fill {
        m_liq = number("liquid_0");
        for (n, mode) in modes.iter_mut().enumerate() {
            [mode.length, mode.hinge] = fill.mode(n, m_liq);
        }
        radius = mode_radius(&modes[0]);
        level = fill.level(m_liq);
        // the lowest fill is treated as the fill of a cylinder: the liquid's centre is half-way
        // between bottom and surface
        let first = fill.levels[0];
        let part = fill.levels[1];
        bottom = first[1] - (part[1] - first[1]) * first[0] / (part[0] - first[0]);
        note = format!(
            "{prefix} drains by a table, which determines the height of its surface. It is drawn as an upright cylinder with the \
             radius of its wave at the wall."
        );
    } else if diameter > 0.0 {
        radius = 0.5 * diameter;
        let depth = number("depth");
        m_liq = number("density") * std::f64::consts::PI * radius * radius * depth;
        modes = (0..count)
            .map(|n| Pendulum::from_formula((n, &pendulum(n, diameter, depth, m_liq))))
            .collect();
        (level, bottom) = (depth, 0.0);
        note = format!(
            "{prefix} is drawn with its diameter and depth; the height of its wall is not a parameter and is assumed."
        );
    } else {
        m_liq = number("m_0") + modes.iter().map(|m| m.mass).sum::<f64>();
        let moment = number("m_0") * number("H_0")
            + modes.iter().map(|m| m.mass * (m.hinge - m.length)).sum::<f64>();
        radius = mode_radius(&modes[0]);
        let depth = radius * depth_over_radius(modes[0].mass / m_liq);
        (level, bottom) = (moment / m_liq + 0.5 * depth, moment / m_liq - 0.5 * depth);
        note = format!("Only the modes of {prefix} are known: it is drawn as {DRAWN}.");
    }
    let mut level = level;
    let outline = match drawing {
        Some(drawing) => {
            note = format!("{prefix} is drawn as {}.", drawing.name);
            level = drawing.level(m_liq);
            drawing.outline.clone()
        }
        None => cylinder(radius, bottom, level),
    };
    let fill = fill.map(|fill| match drawing {
        Some(drawing) => Fill { levels: drawing.levels.clone(), ..fill },
        None => fill,
    });
    let q: [f64; 4] = parameters.vector(&format!("{prefix}.q"));
    let position = parameters.vector(&format!("{prefix}.position"));
    Tank {
        prefix: prefix.into(),
        position,
        q,
        outline,
        level,
        liquid: m_liq,
        modes,
        shapes: Vec::new(),
        fill,
        note,
    }
}

fn mode_radius(mode: &Pendulum) -> f64 {
    match mode.wave {
        wave if wave > 0.0 => 0.5 * wave * (XI[0] * XI[0] - 1.0),
        // The first mode of a deep cylinder has the pendulum length R/xi.
        _ => mode.length * XI[0],
    }
}

fn fill(number: &dyn Fn(&str) -> f64, points: usize, count: usize) -> Fill {
    let at = |key: &str, k: usize| number(&format!("fill.{key}[{}]", k + 1));
    let element =
        |key: &str, n: usize, k: usize| number(&format!("fill.{key}[{},{}]", n + 1, k + 1));
    let masses: Vec<f64> = (0..points).map(|k| at("liquid", k)).collect();
    let curve = |y: Vec<f64>| {
        let (mut slope, mut curvature) = (vec![0.0; points], vec![0.0; points]);
        derivatives(&masses, &y, true, &mut slope, &mut curvature);
        (0..points).map(|k| [y[k], slope[k], curvature[k]]).collect::<Vec<_>>()
    };
    let modes: Vec<[Vec<[f64; 3]>; 2]> = (0..count)
        .map(|n| {
            let stiffness = (0..points).map(|k| 1.0 / element("length", n, k)).collect();
            let bob =
                (0..points).map(|k| element("hinge", n, k) - element("length", n, k)).collect();
            [curve(stiffness), curve(bob)]
        })
        .collect();
    // m z_liq at the points, and its derivative from the parabola through three neighbouring points, which is
    // exact for a cylinder
    let moment: Vec<f64> = (0..points)
        .map(|k| {
            let bobs: f64 = (0..count).map(|n| element("mass", n, k)).sum();
            let of_bobs: f64 = (0..count)
                .map(|n| element("mass", n, k) * (element("hinge", n, k) - element("length", n, k)))
                .sum();
            (masses[k] - bobs) * at("H_0", k) + of_bobs
        })
        .collect();
    let secant = |i: usize, j: usize| (moment[j] - moment[i]) / (masses[j] - masses[i]);
    let levels = (0..points)
        .map(|k| {
            let slope = match k {
                _ if points == 2 => secant(0, 1),
                0 => secant(0, 1) + secant(0, 2) - secant(1, 2),
                k if k + 1 == points => secant(k - 1, k) + secant(k - 2, k) - secant(k - 2, k - 1),
                k => secant(k - 1, k) + secant(k, k + 1) - secant(k - 1, k + 1),
            };
            [masses[k], slope]
        })
        .collect();
    Fill { masses, modes, levels }
}

/// Returns the side lengths of the homogeneous box with the dry craft's mass and moments of inertia, m: `a_x^2 = 6 (Jyy +
/// Jzz - Jxx)/m`. Returns `None` if no box has these moments of inertia.
pub(super) fn craft_box(parameters: &Parameters) -> Option<[f64; 3]> {
    let [m, x, y, z] =
        ["mass", "Jxx", "Jyy", "Jzz"].map(|k| parameters.number(&format!("craft.{k}")));
    let sides = [y + z - x, x + z - y, x + y - z].map(|twice| (6.0 * twice / m).sqrt());
    sides.iter().all(|side| side.is_finite() && *side > 0.0).then_some(sides)
}

#[cfg(test)]
mod tests {
    use super::*;

    const XML: &str = include_str!("../../../../modelDescription/SloshTank/modelDescription.xml");

    fn tank_with(set: &[(&str, &str)]) -> Tank {
        let description = ModelDescription::from_xml(XML).unwrap();
        let set = set.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect();
        tank(&Parameters { description: &description, set: &set }, "tank", None)
    }

    fn radius_and_bottom(tank: &Tank) -> [f64; 2] {
        let Outline::Revolved(points) = &tank.outline else { panic!("no body of revolution") };
        points[1]
    }

    /// The modes of the default tank have the parameters of a cylinder of 0.9 m diameter with a depth of 0.6 m, to six
    /// digits. The origin of the tank is at mid-depth.
    #[test]
    fn a_tank_with_the_modes_of_a_cylinder_is_drawn_as_this_cylinder() {
        let drawn = tank_with(&[]);
        let [radius, bottom] = radius_and_bottom(&drawn);
        for (found, exact) in [(radius, 0.45), (bottom, -0.3), (drawn.level, 0.3)] {
            assert!((found - exact).abs() < 2e-4, "{found}, not {exact}");
        }
    }

    /// The default fill table contains the depths 0.1 to 1.2 m of one cylinder. Between its points the surface
    /// rises with the mass.
    #[test]
    fn the_surface_of_a_draining_cylinder_is_at_the_depth_of_its_liquid() {
        let drawn = tank_with(&[("tank.fill.points", "12"), ("tank.liquid_0", "381.704")]);
        let fill = drawn.fill.as_ref().unwrap();
        let area = 1000.0 * std::f64::consts::PI * 0.45 * 0.45;
        for depth in [0.1, 0.17, 0.33, 0.6, 0.95, 1.2] {
            // heights and masses have six digits; the error is divided by the mass of a tenth of the tank
            assert!((fill.level(area * depth) + 0.3 - depth).abs() < 1e-3, "{depth}");
            let exact = pendulum(0, 0.9, depth, area * depth);
            let [length, hinge] = fill.mode(0, area * depth);
            assert!((length - exact.length).abs() < 3e-3 * exact.length, "{depth}: {length}");
            let bob = (hinge - length) - (exact.hinge - exact.length - 0.3);
            assert!(bob.abs() < 1e-3, "{depth}: {bob}");
        }
        assert!((radius_and_bottom(&drawn)[1] + 0.3).abs() < 1e-3);
    }

    #[test]
    fn a_mode_given_by_its_frequency_is_drawn_with_the_pendulum_length_of_this_frequency() {
        // 0.5 Hz at 1.5 m/s2: l = g/(2 pi f)^2
        let drawn = tank_with(&[("tank.frequency[1]", "0.5")]);
        let exact = 1.5 / (std::f64::consts::PI * std::f64::consts::PI);
        assert!((drawn.modes[0].length - exact).abs() < 1e-12);
    }
}

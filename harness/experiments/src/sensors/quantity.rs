//! Measured quantities, computed from variables of the FMU.
//!
//! The surface in an upright cylinder of radius R = d/2, filled to the height h, is a sum of modes (NASA SP-106, chapter
//! 2; Dodge 2000). At the wall and at the angle φ, from radial outwards towards tangential, with the slosh angle α_n of
//! mode n in that direction:
//!
//! ```text
//! wave       η(φ) = Σ b_n α_n                        b_n = 2 R/(ξ_n² − 1)
//! height of the best-fitting plane at the wall:      Σ 4 b_n α_n/ξ_n²
//! pressure   p(φ, z) = ρ g (h − z) + ρ Σ b_n (g α_n + a) cosh(ξ_n z/R)/cosh(ξ_n h/R) − ρ a R
//! ```
//!
//! p is the pressure relative to the gas, at the height z above the bottom, and a is the acceleration of the tank minus
//! the acceleration of gravity, in the direction φ. The formula for p follows in the frame of the tank from Φ_t + g η +
//! a r cos φ = 0 at the surface, and p = ρ g (h − z) − ρ Φ_t − ρ a R at the wall; each mode of Φ decreases with depth
//! as its cosh. A mode that the model does not include is assumed to follow the acceleration immediately, g α_n + a =
//! 0, and contributes nothing. The integral of p over the wall is the force of the pendulums and of the liquid that
//! moves with the tank, Σ m_n g α_n − m_0 a (`tests/all/sensors.rs`). The plane is the least-squares fit over the disc:
//! ∫ J_1(ξ r/R) r² dr = R³ J_1(ξ)/ξ².

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use formulas::cylinder::{MODES, XI};
use host::description::{ModelDescription, Type};
use names::hubslosh::{
    self, G_AXIAL, OMEGA, OMEGA_DOT, SloshModel, SloshSource, THETA, bench, fluid, tank,
};

/// Measured quantity of one sensor, computed from the Real variables `needs` of the FMU. `channels` are the numbers
/// that the quantity consists of, for example the heights that a camera measures. Each channel has the name that
/// follows the sensor's name in the table (empty for a single channel), and a unit.
#[derive(Clone, Debug)]
pub struct Quantity {
    pub needs: Vec<String>,
    pub channels: Vec<(String, String)>,
    rule: Rule,
}

#[derive(Clone, Debug)]
enum Rule {
    Itself,
    Wave { modes: Modes, angle: f64 },
    Pressure { modes: Modes, angle: f64, height: f64 },
    Camera { modes: Modes },
    Acceleration { radius: f64, angle: f64 },
}

/// Meaning of the coordinates `slosh.q_radial` and `slosh.q_tangential` of HubSlosh's pendulums: slosh angles, rad
/// (`Angle`); components of a vector whose length is the tangent of half the angle from the vertical
/// (`Stereographic`); or displacements of the slosh mass, m (`Displacement`).
#[derive(Clone, Copy, Debug)]
pub enum Coordinate {
    Angle,
    Stereographic,
    Displacement,
}

impl Coordinate {
    /// Returns the coordinate that a `slosh.model` uses; `None` for a model whose liquid does not move.
    pub fn from_model(model: &str) -> Option<Coordinate> {
        use SloshModel::{Frozen, Linear, Liquid, Planar, Spherical};
        match SloshModel::named(model)? {
            Frozen => None,
            Linear | Planar => Some(Coordinate::Angle),
            Spherical => Some(Coordinate::Stereographic),
            Liquid => Some(Coordinate::Displacement),
        }
    }

    /// Converts the coordinates `q` of a mode, radial and tangential, to slosh angles, rad.
    /// `length` is the length of the mode's pendulum, m.
    pub fn angles(self, q: [f64; 2], length: f64) -> [f64; 2] {
        match self {
            Coordinate::Angle => q,
            Coordinate::Stereographic => {
                let k = 2.0 / (1.0 + q[0] * q[0] + q[1] * q[1]);
                q.map(|q| (k * q).clamp(-1.0, 1.0).asin())
            }
            Coordinate::Displacement => q.map(|q| (q / length).clamp(-1.0, 1.0).asin()),
        }
    }
}

/// Number of slosh modes and meaning of their coordinates. The variables that a sensor reads begin with the radial
/// coordinate, the tangential coordinate and the pendulum length of each mode, followed by the tank's diameter.
#[derive(Clone, Debug)]
struct Modes {
    count: usize,
    coordinate: Coordinate,
}

const MOTION: [&str; 7] =
    [THETA, OMEGA, OMEGA_DOT, tank::R, G_AXIAL, bench::TILT, bench::TILT_AZIMUTH];

impl Quantity {
    /// Creates the quantity that is equal to a Real variable of the FMU. `unit` is the unit that the variable must have.
    ///
    /// # Errors
    /// If there is no such variable, or it has another unit.
    pub fn variable(
        description: &ModelDescription,
        name: &str,
        unit: Option<&str>,
    ) -> Result<Self> {
        let variable = description.variable(name)?;
        ensure!(variable.kind() == Type::Real, "{name} is not a Real");
        let own = description.unit(variable);
        ensure!(
            unit.is_none_or(|unit| unit == own),
            "{name} has the unit {own} (allowed: {})",
            unit.unwrap_or_default()
        );
        let channels = vec![(String::new(), own.to_string())];
        Ok(Quantity { needs: vec![name.into()], channels, rule: Rule::Itself })
    }

    /// Creates the wave height at an angle on the wall (rad), m.
    ///
    /// # Errors
    /// If the FMU is not HubSlosh with an upright cylinder whose liquid moves.
    pub fn wave(surface: &Surface, angle: f64) -> Result<Self> {
        let (needs, modes) = surface.modes()?;
        Ok(Quantity { needs, channels: single_value("m"), rule: Rule::Wave { modes, angle } })
    }

    /// Creates the pressure, Pa, at an angle on the wall (rad) and a height above the bottom (m).
    ///
    /// # Errors
    /// If the FMU is not HubSlosh with an upright cylinder whose liquid moves, or the height is above the liquid at rest.
    pub fn pressure(surface: &Surface, angle: f64, height: f64) -> Result<Self> {
        let (mut needs, modes) = surface.modes()?;
        let h = surface.number(tank::H)?;
        ensure!(height <= h, "height {height} m is above the liquid at rest, tank.h = {h} m");
        needs.extend([tank::H, fluid::RHO].into_iter().chain(MOTION).map(String::from));
        Ok(Quantity {
            needs,
            channels: single_value("Pa"),
            rule: Rule::Pressure { modes, angle, height },
        })
    }

    /// Creates the quantities of the surface that a camera measures: the best-fitting plane and every mode, each as a
    /// height at the wall, m.
    ///
    /// # Errors
    /// If the FMU is not HubSlosh with an upright cylinder whose liquid moves.
    pub fn camera(surface: &Surface) -> Result<Self> {
        let (needs, modes) = surface.modes()?;
        let plane = ["plane_radial".to_string(), "plane_tangential".into()];
        let each = (1..=modes.count)
            .flat_map(|n| [format!("mode_radial[{n}]"), format!("mode_tangential[{n}]")]);
        let channels = plane.into_iter().chain(each).map(|name| (name, "m".into())).collect();
        Ok(Quantity { needs, channels, rule: Rule::Camera { modes } })
    }

    /// Creates the specific force at a point of the hub, m/s², in the direction of an angle (rad) from
    /// radial outwards towards tangential.
    ///
    /// # Errors
    /// If the FMU is not HubSlosh.
    pub fn acceleration(description: &ModelDescription, radius: f64, angle: f64) -> Result<Self> {
        let needs: Vec<String> = MOTION.map(String::from).into();
        present(description, &needs)?;
        Ok(Quantity {
            needs,
            channels: single_value("m/s2"),
            rule: Rule::Acceleration { radius, angle },
        })
    }

    pub fn values(&self, read: &[f64]) -> Vec<f64> {
        match &self.rule {
            Rule::Itself => vec![read[0]],
            Rule::Wave { modes, angle } => {
                let angles = modes.angles(read);
                let radius = modes.radius(read);
                let wave =
                    |(n, a): (usize, &[f64; 2])| wall(n, radius) * component_along(*a, *angle);
                vec![angles.iter().enumerate().map(wave).sum()]
            }
            Rule::Pressure { modes, angle, height } => {
                let (angles, radius) = (modes.angles(read), modes.radius(read));
                let rest = &read[modes.reads()..];
                let (h, rho) = (rest[0], rest[1]);
                let motion = &rest[2..];
                let (g, a) = (motion[4], component_along(acceleration(motion, motion[3]), *angle));
                let modal = |(n, angles): (usize, &[f64; 2])| {
                    let k = XI[n] / radius;
                    // cosh kz / cosh kh, written so that it does not overflow
                    let falls = (k * (height - h)).exp() * (1.0 + (-2.0 * k * height).exp())
                        / (1.0 + (-2.0 * k * h).exp());
                    wall(n, radius) * (g * component_along(*angles, *angle) + a) * falls
                };
                let modal: f64 = angles.iter().enumerate().map(modal).sum();
                vec![rho * (g * (h - height) + modal - a * radius)]
            }
            Rule::Camera { modes } => {
                let (angles, radius) = (modes.angles(read), modes.radius(read));
                let each = angles.iter().enumerate();
                let each: Vec<[f64; 2]> =
                    each.map(|(n, a)| a.map(|a| wall(n, radius) * a)).collect();
                let plane = |k: usize| -> f64 {
                    each.iter().enumerate().map(|(n, a)| 4.0 * a[k] / (XI[n] * XI[n])).sum()
                };
                [plane(0), plane(1)].into_iter().chain(each.iter().flatten().copied()).collect()
            }
            Rule::Acceleration { radius, angle } => {
                vec![component_along(acceleration(read, *radius), *angle)]
            }
        }
    }
}

/// Returns the elevation of the wave at the wall divided by the slosh angle of mode `n`, which counts from 0, m/rad.
fn wall(n: usize, radius: f64) -> f64 {
    2.0 * radius / (XI[n] * XI[n] - 1.0)
}

fn component_along([radial, tangential]: [f64; 2], angle: f64) -> f64 {
    radial * angle.cos() + tangential * angle.sin()
}

/// Returns the radial and tangential acceleration of a point of the hub on the tank's side, minus the acceleration of
/// gravity, m/s². `motion` contains the values of [`MOTION`].
fn acceleration(motion: &[f64], radius: f64) -> [f64; 2] {
    let [theta, omega, omega_dot, _, g, tilt, azimuth] = std::array::from_fn(|k| motion[k]);
    let (across, from_low) = (g * f64::tan(tilt), theta - azimuth);
    [
        -radius * omega * omega - across * f64::cos(from_low),
        radius * omega_dot + across * f64::sin(from_low),
    ]
}

fn single_value(unit: &str) -> Vec<(String, String)> {
    vec![(String::new(), unit.into())]
}

impl Modes {
    fn reads(&self) -> usize {
        3 * self.count + 1
    }

    fn radius(&self, read: &[f64]) -> f64 {
        0.5 * read[3 * self.count]
    }

    fn angles(&self, read: &[f64]) -> Vec<[f64; 2]> {
        let angle = |mode: &[f64]| self.coordinate.angles([mode[0], mode[1]], mode[2]);
        read[..3 * self.count].chunks_exact(3).map(angle).collect()
    }
}

pub struct Surface<'a> {
    pub description: &'a ModelDescription,
    pub parameters: &'a BTreeMap<String, String>,
}

impl Surface<'_> {
    fn text(&self, name: &str) -> Result<&str> {
        let found = self.parameters.get(name).map(String::as_str);
        found.with_context(|| format!("the FMU has no variable {name}: only HubSlosh models the liquid's surface for this sensor"))
    }

    fn number(&self, name: &str) -> Result<f64> {
        Ok(self.text(name)?.parse()?)
    }

    /// Returns the selected item of the enumeration `name`. For hosts that cannot set enumerations, the integer parameter
    /// `kind` selects the item instead, unless it is 0.
    fn choice(&self, name: &str, kind: &str) -> Result<String> {
        let number: i64 = self.text(kind)?.parse()?;
        let items = self.description.items(self.description.variable(name)?);
        let item = items.iter().find(|item| item.value == number);
        Ok(item.map_or(self.text(name)?.to_string(), |item| item.name.clone()))
    }

    fn modes(&self) -> Result<(Vec<String>, Modes)> {
        let source = self.choice(hubslosh::slosh::SOURCE, hubslosh::slosh::SOURCE_KIND)?;
        ensure!(
            source == SloshSource::Geometry.name(),
            "the surface is known only for an upright cylinder (slosh.source = geometry), not for a {source}"
        );
        let model = self.choice(hubslosh::slosh::MODEL, hubslosh::slosh::KIND)?;
        let coordinate = Coordinate::from_model(&model).with_context(|| {
            format!("slosh.model = {model} has no moving surface (allowed: models with slosh)")
        })?;
        let count = (self.number(hubslosh::slosh::MODES)? as usize).clamp(1, MODES);
        let mut needs = Vec::new();
        for n in 1..=count {
            use names::hubslosh::slosh::{LENGTH, Q_RADIAL, Q_TANGENTIAL};
            needs.extend([Q_RADIAL, Q_TANGENTIAL, LENGTH].map(|array| array.element([n])));
        }
        needs.push(tank::D.into());
        present(self.description, &needs)?;
        Ok((needs, Modes { count, coordinate }))
    }
}

fn present(description: &ModelDescription, names: &[String]) -> Result<()> {
    for name in names {
        description
            .variable(name)
            .with_context(|| format!("the sensor needs the variable {name} of HubSlosh"))?;
    }
    Ok(())
}

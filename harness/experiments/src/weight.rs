//! Detects runs in which weight does not dominate the liquid, from Bond, Weber and Froude numbers (Rubaga's thesis 2.5). It
//! is used for the bench's tank and for tanks of the six-axis FMUs.

use anyhow::{Result, ensure};
use formulas::cylinder::{self, XI};
use formulas::similarity::{Liquid, ruling_force};
use host::description::{ModelDescription, Value};
use host::fmu::Instance;
use names::{sloshtank, spacecraft};
use signals::table::Table;

/// Bond number below which none of the project's models is valid (thesis 2.5, 8.2.2).
const LEAST_BOND: f64 = 30.0;

/// Surface tension of water at 24 degC, N/m: HubSlosh's start value of `fluid.sigma`.
pub const WATER_TENSION: f64 = 0.07213;

#[derive(Clone, Copy, Debug)]
pub struct Contents {
    pub liquid: Liquid,
    pub radius: f64,
}

/// Bond and Weber number of the row in which weight dominates least. The Bond number is negative if the specific force
/// points out of the liquid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weightless {
    bond: f64,
    weber: f64,
}

impl Contents {
    /// Returns the Bond and Weber number of the row in which weight dominates the liquid least, or `None` if it dominates
    /// in every row. A row contains the specific force towards the bottom of the tank, m/s², and the speed of the free
    /// surface, m/s. The Weber number of a row uses the radius, and the highest speed in this row and all rows before.
    pub fn without_weight(&self, rows: impl IntoIterator<Item = (f64, f64)>) -> Option<Weightless> {
        let (mut speed, mut worst) = (0.0f64, None::<(f64, Weightless)>);
        for (g, v) in rows {
            speed = speed.max(v);
            let bond = self.liquid.bond(g, self.radius);
            let weber = self.liquid.weber(speed, self.radius);
            // Dominance of weight in a row: the Bond number divided by 30 or, if this is smaller, the ratio
            // of weight to inertia.
            let rules = (bond / LEAST_BOND).min(bond / weber.max(1.0));
            if rules < 1.0 && worst.is_none_or(|(other, _)| rules < other) {
                worst = Some((rules, Weightless { bond, weber }));
            }
        }
        worst.map(|(_, numbers)| numbers)
    }
}

impl Weightless {
    /// Returns true if the liquid leaves the bottom of the tank, because inertia dominates or because the dominant force
    /// points out of the liquid.
    fn leaves(self) -> bool {
        self.bond < -1.0 || ruling_force(self.bond, self.weber).starts_with("inertia")
    }
}

impl std::fmt::Display for Weightless {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Weightless { bond, weber } = *self;
        let froude = if bond > 0.0 { format!("{:.2}", weber / bond) } else { "infinite".into() };
        let rules = match ruling_force(bond, weber) {
            _ if bond < -1.0 && weber <= -bond => {
                "the specific force points out of the liquid, which falls to the tank's other end"
            }
            // Weight still dominates, but the surface is curved.
            gravity if gravity.starts_with("gravity") => {
                "the surface is curved, and the position of the liquid is uncertain"
            }
            other => other,
        };
        write!(
            f,
            "Bond number {bond:.3}, Weber number {weber:.3}, Froude number {froude} (waves and pendulums need a \
             Bond number above {LEAST_BOND} and a Froude number below 1): {rules}"
        )
    }
}

/// A tank of Spacecraft or SloshTank. Vectors are in the axes of the craft.
///
/// - `name`: first part of the names of its variables, for example `tank[1]`.
/// - `hinge`: hinge of the pendulum of mode 1 relative to the craft's reference point O, m.
/// - `upwards`: unit vector from the bottom of the tank to the surface of the liquid.
/// - `wave`: for each mode, height of the wave at the wall divided by the slosh angle, m.
/// - `has_ball`: true if the FMU could simulate the detached liquid of this tank, but `ball.travel` is set to 0.
#[derive(Clone, Debug)]
struct Tank {
    name: String,
    contents: Contents,
    hinge: [f64; 3],
    upwards: [f64; 3],
    wave: Vec<f64>,
    has_ball: bool,
}

/// The tanks of Spacecraft or SloshTank whose liquid no stiffness holds at the bottom, but only its weight.
/// `accelerometer` is the variable of the specific force at the craft's reference point O: the output
/// `specific_force` of Spacecraft, or the input `a` of SloshTank.
#[derive(Clone, Debug)]
pub struct Tanks {
    tanks: Vec<Tank>,
    accelerometer: &'static str,
}

fn components(name: &str) -> [String; 3] {
    [1, 2, 3].map(|i| format!("{name}[{i}]"))
}

impl Tanks {
    /// Reads the tanks from an initialised instance; `None` if the FMU is neither Spacecraft nor SloshTank.
    ///
    /// `tension` is the surface tension, N/m, which is no parameter of these FMUs. A tank whose `diameter` is 0 is
    /// treated as an upright cylinder, whose radius R follows from its wave height per slosh angle: wave = 2 R/(ξ² −
    /// 1). Three kinds of tanks are left out: tanks without modes, tanks of unknown dimensions (`wave` = 0), and
    /// tanks whose liquid is held by a stiffness.
    ///
    /// # Errors
    /// If the tension is not positive, or a variable cannot be read.
    pub fn read(
        description: &ModelDescription,
        instance: &mut Instance,
        tension: f64,
    ) -> Result<Option<Tanks>> {
        let has = |name: &str| description.variable(name).is_ok();
        let (accelerometer, names) = match () {
            () if has(&spacecraft::SPECIFIC_FORCE.element([1]))
                && has(&spacecraft::tank::WAVE.element([1, 1])) =>
            {
                let used = integer(description, instance, spacecraft::TANKS)?;
                ("specific_force", (1..=used).map(|i| format!("tank[{i}]")).collect())
            }
            () if has(&sloshtank::A.element([1])) && has(&sloshtank::tank::WAVE.element([1])) => {
                ("a", vec!["tank".to_string()])
            }
            () => return Ok(None),
        };
        ensure!(
            tension > 0.0 && tension.is_finite(),
            "the surface tension must be a positive number of N/m, not {tension}"
        );
        let tanks = names
            .into_iter()
            .filter_map(|name| Tank::read(description, instance, name, tension).transpose())
            .collect::<Result<_>>()?;
        Ok(Some(Tanks { tanks, accelerometer }))
    }

    pub fn required_variables(&self) -> Vec<String> {
        let host = [self.accelerometer, "omega", "omega_dot"].map(components).into_iter().flatten();
        let tanks = self.tanks.iter().flat_map(Tank::rates);
        if self.tanks.is_empty() { Vec::new() } else { host.chain(tanks).collect() }
    }

    /// Describes the tanks of a run in which weight does not dominate the liquid. The table must contain
    /// the variables of [`Tanks::required_variables`].
    pub fn without_weight(&self, table: &Table) -> Vec<String> {
        self.tanks
            .iter()
            .filter_map(|tank| tank.without_weight(table, self.accelerometer))
            .collect()
    }
}

fn integer(description: &ModelDescription, instance: &mut Instance, name: &str) -> Result<i64> {
    match instance.value(description.variable(name)?)? {
        Value::Integer(n) => Ok(n),
        other => anyhow::bail!("{name} must be an integer, but it is {other:?}"),
    }
}

impl Tank {
    fn read(
        description: &ModelDescription,
        instance: &mut Instance,
        name: String,
        tension: f64,
    ) -> Result<Option<Tank>> {
        let modes = integer(description, instance, &format!("{name}.modes"))?;
        let drains = integer(description, instance, &format!("{name}.fill.points"))? > 0;
        let mut real = |what: &str| instance.real(&format!("{name}.{what}"));
        let (diameter, depth) = (real("diameter")?, real("depth")?);
        let cylinder = |n: i64| cylinder::pendulum(n as usize - 1, diameter, depth, 1.0);
        let mut wave = Vec::new();
        for n in 1..=modes {
            let given = real(&format!("wave[{n}]"))?;
            wave.push(if diameter > 0.0 { cylinder(n).wave } else { given });
        }
        let Some(first) = wave.first().filter(|wave| **wave > 0.0) else { return Ok(None) };
        let radius = first * (XI[0] * XI[0] - 1.0) / 2.0;
        if real("k[1]")? > 0.0 {
            return Ok(None);
        }
        // the hinge moves in a tank that drains, so that the origin of the tank is used instead
        let height = match (drains, diameter > 0.0) {
            (true, _) => 0.0,
            (_, true) => cylinder(1).hinge,
            (..) => real("hinge[1]")?,
        };
        let liquid = Liquid { density: real("density")?, tension };
        let (mut position, mut q) = ([0.0; 3], [0.0; 4]);
        for (i, x) in position.iter_mut().enumerate() {
            *x = real(&format!("position[{}]", i + 1))?;
        }
        for (i, x) in q.iter_mut().enumerate() {
            *x = real(&format!("q[{}]", i + 1))?;
        }
        let has_ball = real("ball.travel").is_ok_and(|travel| travel == 0.0);
        let upwards = third_axis(q);
        let hinge = std::array::from_fn(|i| position[i] + height * upwards[i]);
        let contents = Contents { liquid, radius };
        Ok(Some(Tank { name, contents, hinge, upwards, wave, has_ball }))
    }

    fn rates(&self) -> Vec<String> {
        let modes = 1..=self.wave.len();
        modes.flat_map(|n| [1, 2].map(|i| format!("{}.p_dot[{n},{i}]", self.name))).collect()
    }

    /// Returns a sentence if weight fails to dominate the liquid of this tank in at least one row of `table`.
    /// `accelerometer` is the variable of the specific force f_O at the craft's reference point O. At the hinge of
    /// mode 1, whose position relative to O is ρ, the specific force is f_O + ω' × ρ + ω × (ω × ρ); its component
    /// along the axis of the tank counts as weight. The speed of the surface at the wall is the sum over all modes.
    fn without_weight(&self, table: &Table, accelerometer: &str) -> Option<String> {
        let column = |name: &String| table.column(name);
        let vector = |name: &str| {
            let [x, y, z] = components(name);
            Some([column(&x)?, column(&y)?, column(&z)?])
        };
        let [f, omega, omega_dot] =
            [vector(accelerometer)?, vector("omega")?, vector("omega_dot")?];
        let rates: Vec<&[f64]> = self.rates().iter().map(column).collect::<Option<_>>()?;
        let row = |i: usize| {
            let [f, w, w_d] = [f, omega, omega_dot].map(|v| v.map(|component| component[i]));
            let (turned, swung) = (cross(w_d, self.hinge), cross(w, cross(w, self.hinge)));
            let g = (0..3).map(|k| self.upwards[k] * (f[k] + turned[k] + swung[k])).sum();
            let across = |k: usize| -> f64 {
                self.wave.iter().enumerate().map(|(n, wave)| wave * rates[2 * n + k][i]).sum()
            };
            (g, across(0).hypot(across(1)))
        };
        let rows = table.column("time")?.len();
        let numbers = self.contents.without_weight((0..rows).map(row))?;
        let Tank { name, contents: Contents { liquid, radius }, .. } = self;
        let ball = match (numbers.leaves(), self.has_ball) {
            (true, true) => {
                format!("; with {name}.ball.travel above 0 it crosses the tank as one lump")
            }
            _ => String::new(),
        };
        Some(format!(
            "{name}: {numbers}{ball}. By R = {radius:.4} m, {} kg/m3 ({name}.density) and {} N/m (--tension)",
            liquid.density, liquid.tension
        ))
    }
}

/// Returns the unit vector of a frame's z axis in the outer axes. The attitude of the frame is a quaternion of any norm
/// with the scalar first.
fn third_axis([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let norm2 = w * w + x * x + y * y + z * z;
    [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z]
        .map(|component| component / norm2)
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    const WATER: Liquid = Liquid { density: 1000.0, tension: 0.072 };

    /// Returns a tank at x = 1 m with a radius of 0.45 m. Its axis is parallel to y, because it is turned by 90°
    /// about −x, and its hinge is 0.5 m above its origin along this axis.
    fn tank(has_ball: bool) -> Tanks {
        let upwards = third_axis([1.0, -1.0, 0.0, 0.0]);
        assert_eq!(upwards, [0.0, 1.0, 0.0]);
        let tank = Tank {
            name: "tank[1]".into(),
            contents: Contents { liquid: WATER, radius: 0.45 },
            hinge: [1.0, 0.5, 0.0],
            upwards,
            wave: vec![0.4, 0.1],
            has_ball,
        };
        Tanks { tanks: vec![tank], accelerometer: "specific_force" }
    }

    /// Returns the warnings about the tanks for a run. A row of the run has five numbers: specific force along y,
    /// angular acceleration about z, rate about x, and the slosh rates of the first two modes along x.
    fn warnings(tanks: &Tanks, rows: &[[f64; 5]]) -> Vec<String> {
        let names: Vec<String> =
            ["time".to_string()].into_iter().chain(tanks.required_variables()).collect();
        let column = |name: &String| {
            let place = match name.as_str() {
                "specific_force[2]" => 0,
                "omega_dot[3]" => 1,
                "omega[1]" => 2,
                "tank[1].p_dot[1,1]" => 3,
                "tank[1].p_dot[2,1]" => 4,
                _ => return vec![0.0; rows.len()],
            };
            rows.iter().map(|row| row[place]).collect()
        };
        let columns = names.iter().map(column).collect();
        tanks.without_weight(&Table::new(names, columns))
    }

    #[test]
    fn bond_and_weber_numbers_use_the_acceleration_of_the_hinge_and_the_speed_of_all_modes() {
        let tanks = tank(true);
        // 0.02 m/s²: Bo = 1000 0.02 0.45²/0.072 = 56.3; 0.4 0.05 + 0.1 0.1 = 0.03 m/s: We = 5.6, Fr = 0.1
        assert_eq!(warnings(&tanks, &[[0.02, 0.0, 0.0, 0.05, 0.1]; 2]), [""; 0]);
        // With no thrust the specific force is ω' x = 0.004 1 m/s² minus ω² 0.5 = 0.002 m/s²: Bo = 1000 0.002 0.45²/0.072 =
        // 5.625. The surface moved at 0.4 0.2 m/s before: We = 1000 0.08² 0.45/0.072 = 40, Fr = 7.11.
        let omega = 0.004f64.sqrt();
        let rows = [[0.2, 0.0, 0.0, 0.2, 0.0], [0.0, 0.004, omega, 0.0, 0.0]];
        let [cut] = <[String; 1]>::try_from(warnings(&tanks, &rows)).unwrap();
        for words in ["tank[1]: Bond number 5.625, Weber number 40.000, Froude number 7.11"]
            .into_iter()
            .chain(["inertia", "; with tank[1].ball.travel above 0 it crosses", "R = 0.4500 m"])
        {
            assert!(cut.contains(words), "{words}: {cut}");
        }
        let [without] = <[String; 1]>::try_from(warnings(&tank(false), &rows)).unwrap();
        assert!(!without.contains("ball"), "{without}");
        // Weight still dominates at 0.01 m/s², Bo = 28.1, in liquid at rest, but the surface is curved: the warning is the
        // same as for the bench.
        let [low] =
            <[String; 1]>::try_from(warnings(&tanks, &[[0.01, 0.0, 0.0, 0.0, 0.0]])).unwrap();
        assert!(low.contains("Bond number 28.125") && low.contains("curved"), "{low}");
        assert!(!low.contains("ball"), "{low}");
        // With the opposite direction of the specific force the liquid falls.
        let [back] =
            <[String; 1]>::try_from(warnings(&tanks, &[[-0.01, 0.0, 0.0, 0.0, 0.0]])).unwrap();
        for words in ["Bond number -28.125", "Froude number infinite", "other end", "ball.travel"] {
            assert!(back.contains(words), "{words}: {back}");
        }
    }

    #[test]
    fn a_liquid_that_weight_does_not_hold_is_reported_with_the_smallest_bond_number() {
        // water in the bench's tank
        let contents = Contents { liquid: WATER, radius: 0.0815 };
        let numbers = |rows: &[(f64, f64)]| contents.without_weight(rows.iter().copied());
        assert_eq!(numbers(&[(9.81, 0.2945); 3]), None, "Bo 905, Fr 0.1");
        let Weightless { bond, weber } = numbers(&[(9.81, 0.2945), (0.01, 0.0)]).unwrap();
        assert!((bond - 0.9225).abs() < 1e-3 && (weber - 98.2).abs() < 0.1, "{bond} {weber}");
    }
}

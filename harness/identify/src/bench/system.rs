//! The FMU of the bench as a system that the engine can fit.
//!
//! The unknowns of the search are the quantities that a recording determines: pendulum length l and mass ratio μ = m r²/J of the
//! first slosh mode, its damping ratio, and the inertia J that turns with the hub without the mass m of this mode. The FMU
//! receives them as a table of modes. Diameter d and filling height h of the tank and inertia I of the hub are computed from
//! draws of the unknowns:
//!
//! ```text
//! m = μ J/r²,  d⁴ = 8ξ²(ξ² − 1) l m/(π ρ),  T = d/(2ξ l) = tanh(2ξ h/d),  I = J − r² (ρ π d² h/4 − m)
//! ```
//!
//! d, h and I themselves are not the unknowns, because the likelihood has a long bent valley in them: in a deep tank T hardly
//! depends on h. However, if tank, hub or modes are set or known, the FMU's own parameters are the unknowns.

use std::borrow::Cow;
use std::f64::consts::PI;
use std::sync::OnceLock;

use anyhow::Result;
use formulas::cylinder::XI;
use host::fmu::Fmu;
use names::hubslosh::{FrictionModel, SloshSource, friction, hub, slosh, tank, wheel};

use crate::bench::effect::Effects;
use crate::bench::nominal::Bench;
use crate::bench::simulate::{self, Setup};
use crate::engine::{Hold, Motion, System};
use crate::input::recording::Recording;

#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    Parameter(String),
    Initial(usize, String),
    /// Length l of the pendulum that is equivalent to the first mode, m.
    Length,
    MassRatio,
    /// Inertia J that turns with the hub, without the mass of the first mode, kg·m².
    Inertia,
    Zeta,
    Delay,
    AngleDelay,
    ActuatorLag,
    GyroLag,
    FrictionDrift,
    GyroScale,
    /// Bias of the gyro, rad/s: its reading at rest.
    GyroBias,
    /// Offset of the encoder, rad: its reading at the hub angle 0.
    AngleOffset,
    /// Asymmetry of the dry friction of a hub that turns only one way. The search determines the friction c and d in this
    /// direction; the asymmetry converts them to the mean of both directions.
    Asymmetry,
    /// Scale of the torque: the acting torque divided by the recorded torque.
    Torque,
    /// Scale of the clock: true time divided by recorded time.
    Clock,
    Gravity,
    Arm,
    Density,
    /// Relative difference of the largest torque command and the torque at which the actuator saturates:
    /// 1 − saturation/largest command.
    Limit,
    /// Compliance of the bearing, rad/(N·m): the elastic twist divided by the torque, before it slips.
    Compliance,
    SecondMode,
    /// Error of a value that the user states with a standard deviation.
    Stated(String),
    ProportionalTorque(usize),
}

pub struct Row {
    /// Time since the first row of the recording, s.
    pub time: f64,
    pub torque: f64,
    pub angle: f64,
    pub rate: f64,
    pub slosh_angle: f64,
}

/// An additional torque: the quantity of the motion that it follows, the unit of its factor, and the torque in one row of the
/// recording for a factor of 1.
pub type ProportionalTorque = (&'static str, &'static str, fn(&Row) -> f64);

/// Additional torques that may act on a bench and that the FMU does not model.
pub const ADDITIONAL_TORQUES: [ProportionalTorque; 7] = [
    ("the rate", "N.m.s/rad", |row| row.rate),
    ("the rate's square against the motion", "N.m.s2/rad2", |row| row.rate * row.rate.abs()),
    ("the angle", "N.m/rad", |row| row.angle),
    ("the angle's square", "N.m/rad2", |row| row.angle * row.angle),
    ("the slosh angle", "N.m/rad", |row| row.slosh_angle),
    ("time", "N.m/s", |row| row.time),
    ("the commanded torque's square with its sign", "1/(N.m)", |row| row.torque * row.torque.abs()),
];

pub struct BenchSystem<'a> {
    pub fmu: &'a Fmu,
    pub recordings: &'a [Recording],
    pub settings: Vec<(String, String)>,
    pub bench: Bench,
    pub targets: Vec<Target>,
    /// Number of unknowns that users see; known values and candidate effects follow them.
    pub derived: usize,
    /// Direction of rotation of a hub that turns in one direction only, 1 or −1; 0 if it turns in both.
    pub way: f64,
    /// Largest absolute torque of the recordings, N·m.
    pub largest: f64,
    /// For each recording, the motion at the minimum. Additional torques, for example a torque proportional to the rate,
    /// are computed from this motion.
    pub base: OnceLock<Vec<Motion>>,
}

/// Largest T = tanh(2ξ h/d) from which a filling height is computed. The height is then 1.7 diameters.
const DEEPEST: f64 = 0.999_99;

/// Returns the diameter d and filling height h of the tank and the inertia I of the hub for this first mode and this total
/// inertia J; `None` if no tank and hub have these properties.
fn tank_of(length: f64, mass: f64, inertia: f64, bench: Bench) -> Option<[f64; 3]> {
    let xi = XI[0];
    let d = diameter(length, mass, bench);
    let t = d / (2.0 * xi * length);
    let h = (t < DEEPEST).then(|| t.atanh() * d / (2.0 * xi))?;
    let hub = inertia - bench.inertia(bench.liquid(d, h) - mass);
    (hub > 0.0).then_some([d, h, hub])
}

/// Returns the diameter d, m, of a tank whose first mode has this pendulum length and mass.
fn diameter(length: f64, mass: f64, bench: Bench) -> f64 {
    let xi = XI[0];
    (8.0 * xi * xi * (xi * xi - 1.0) * length * mass / (PI * bench.density)).powf(0.25)
}

impl BenchSystem<'_> {
    pub fn value(&self, values: &[f64], target: &Target) -> Option<f64> {
        self.targets.iter().position(|other| other == target).map(|k| values[k])
    }

    fn bench(&self, values: &[f64]) -> Bench {
        let of = |target: &Target| self.value(values, target).unwrap_or(1.0);
        let Bench { arm, density, gravity } = self.bench;
        Bench { arm: arm * of(&Target::Arm), density: density * of(&Target::Density), gravity }
    }

    /// Returns the pendulum length (m) and mass (kg) of the first mode, and the inertia J (kg·m²), if they are unknowns.
    fn mode(&self, values: &[f64]) -> Option<[f64; 3]> {
        let of = |target: Target| self.value(values, &target);
        let (length, ratio) = of(Target::Length).zip(of(Target::MassRatio))?;
        let inertia = of(Target::Inertia)?;
        Some([length, ratio * inertia / self.bench(values).inertia(1.0), inertia])
    }

    /// Returns the sum of the additional torques ([`ADDITIONAL_TORQUES`]) in each row of a recording, N·m; `None` if all are 0.
    fn additional_torque(&self, values: &[f64], recording: usize) -> Option<Vec<f64>> {
        let base = self.base.get()?;
        let size = |(target, value): (&Target, &f64)| match target {
            Target::ProportionalTorque(kind) if *value != 0.0 => Some((*kind, *value)),
            _ => None,
        };
        let sizes: Vec<_> = self.targets.iter().zip(values).filter_map(size).collect();
        if sizes.is_empty() {
            return None;
        }
        let (motion, recorded) = (&base[recording], &self.recordings[recording]);
        let torque = |k: usize| {
            let row = Row {
                time: recorded.time[k] - recorded.time[0],
                torque: recorded.torque[k],
                angle: motion.others[1][k],
                rate: motion.outputs[0][k],
                slosh_angle: motion.others[0][k],
            };
            sizes.iter().map(|(kind, size)| size * (ADDITIONAL_TORQUES[*kind].2)(&row)).sum()
        };
        Some((0..recorded.time.len()).map(torque).collect())
    }
}

impl System for BenchSystem<'_> {
    fn run(
        &self,
        values: &[f64],
        recording: usize,
        rows: usize,
        hold: Hold,
        whole: bool,
    ) -> Result<Motion> {
        let bench = self.bench(values);
        let mut settings = self.settings.clone();
        let mut reals: Vec<(String, f64)> = Vec::new();
        let mut set = |name: &str, value: &str| settings.push((name.into(), value.into()));
        let mut effects = Effects::default();
        let of = |target: Target, absent: f64| self.value(values, &target).unwrap_or(absent);
        let second = of(Target::SecondMode, 0.0);
        if second != 0.0 {
            set(slosh::MODES, "2");
        }
        if let Some([length, mass, inertia]) = self.mode(values) {
            // the second mode's mass in a deep cylinder is 3 % of the first mode's
            let other = second * 0.03 * mass;
            set(slosh::SOURCE, SloshSource::Table.name());
            let modes = [(1, length, mass), (2, length * XI[0] / XI[1], other)];
            for (k, length, mass) in &modes[..if second == 0.0 { 1 } else { 2 }] {
                reals.push((slosh::table::LENGTH.element([*k]), *length));
                reals.push((slosh::table::MASS.element([*k]), *mass));
                reals.push((slosh::table::ZETA.element([*k]), of(Target::Zeta, 0.0)));
            }
            reals.push((hub::I.into(), inertia));
            reals.push((tank::D.into(), diameter(length, mass, bench)));
            reals.push((slosh::table::M_LIQ.into(), mass + other));
        }
        for (target, &value) in self.targets.iter().zip(values) {
            match target {
                Target::Parameter(name) => reals.push((name.clone(), value)),
                Target::Initial(of, name) if *of == recording => reals.push((name.clone(), value)),
                Target::ActuatorLag => effects.actuator_lag = value,
                Target::GyroLag => effects.gyro_lag = value,
                Target::FrictionDrift => effects.friction_drift = value,
                Target::Arm => reals.push((tank::R.into(), bench.arm)),
                Target::Density => reals.push((names::hubslosh::fluid::RHO.into(), bench.density)),
                Target::Limit if value > 0.0 => {
                    set(wheel::ENABLED, "true");
                    reals.push((wheel::TAU_MAX.into(), self.largest * (1.0 - value)));
                }
                Target::Compliance if value > 0.0 => {
                    set(friction::MODEL, FrictionModel::Lugre.name());
                    set(friction::SIGMA1, "0");
                    reals.push((friction::SIGMA0.into(), 1.0 / value));
                }
                _ => {}
            }
        }
        let additional = self.additional_torque(values, recording);
        effects.torque = additional.as_deref();
        let torque = of(Target::Torque, 1.0);
        let (clock, gravity) = (of(Target::Clock, 1.0), of(Target::Gravity, 1.0));
        let all = &self.recordings[recording];
        let mut acting = Cow::Borrowed(all);
        if rows < all.time.len() || torque != 1.0 || clock != 1.0 {
            let mut own = all.first_rows(rows);
            own.torque.iter_mut().for_each(|value| *value *= torque);
            let first = own.time[0];
            own.time.iter_mut().for_each(|t| *t = first + clock * (*t - first));
            acting = Cow::Owned(own);
        }
        if all.gravity.is_none() && gravity != 1.0 {
            reals.push((names::hubslosh::G_AXIAL.into(), self.bench.gravity * gravity));
        }
        let setup = Setup { settings, intersample: hold };
        let reals: Vec<(&str, f64)> = reals.iter().map(|(name, v)| (name.as_str(), *v)).collect();
        let delay = of(Target::Delay, 0.0);
        let found = setup.run_under(self.fmu, &reals, &acting, delay, &effects, whole)?;
        let turned = acting.angle.is_some().then(|| {
            let lead = delay - of(Target::AngleDelay, delay);
            simulate::angle_and_rate_at(&acting.time, &found, lead)
        });
        let (mut outputs, mut slopes) = (vec![found.rate], vec![found.acceleration]);
        if let Some([angle, rate]) = turned {
            outputs.push(angle);
            slopes.push(rate);
        }
        let others = vec![found.slosh_angle, found.angle];
        Ok(match whole {
            true => Motion { outputs, slopes, others },
            false => Motion { outputs, ..Motion::default() },
        })
    }

    fn derived(&self, _: usize) -> usize {
        self.derived
    }

    fn derive(&self, values: &[f64]) -> Option<Vec<f64>> {
        let bench = self.bench(values);
        let shape = match self.mode(values) {
            Some([length, mass, inertia]) => Some(tank_of(length, mass, inertia, bench)?),
            None => None,
        };
        let asymmetry = self.value(values, &Target::Asymmetry).unwrap_or(0.0);
        let other = 1.0 + self.way * asymmetry;
        let one = |(target, value): (&Target, &f64)| match (target, shape) {
            (Target::Length, Some([d, ..])) => d,
            (Target::MassRatio, Some([_, h, _])) => h,
            (Target::Inertia, Some([.., inertia])) => inertia,
            (Target::Parameter(name), _) if [friction::C, friction::D].contains(&name.as_str()) => {
                value / other
            }
            (Target::GyroScale, _) => 1.0 + value,
            _ => *value,
        };
        Some(self.targets.iter().zip(values).take(self.derived).map(one).collect())
    }
}

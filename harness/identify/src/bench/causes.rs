//! Effects that may explain why no model fits: their description in words, and the options that estimate them.

use names::hubslosh::{hub, slosh, wheel};
use serde::Serialize;

use super::nominal::PARAMETERS;
use super::system::{ADDITIONAL_TORQUES, BenchSystem, Target};
use crate::engine::cause::Effect;
use crate::estimate::prose;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    pub effect: String,
    pub flags: String,
    /// Name, value and unit of the effect's size, if it has a size.
    pub size: Option<(String, f64, String)>,
    /// Decrease of −2 ln L (L: likelihood) when the model includes the effect.
    pub gain: f64,
}

impl Cause {
    pub fn words(&self) -> String {
        let size = self.size.as_ref().map_or(String::new(), |(name, value, unit)| {
            let unit = if unit == "1" { String::new() } else { format!(" {}", prose(unit)) };
            format!(" ({name} = {value:.3e}{unit})")
        });
        format!(
            "The cause is {}: with it{size} the residual is noise, and no other effect that was tried explains it as \
             well. {} includes it in the fit.",
            self.effect, self.flags
        )
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Missing {
    pub follows: String,
    /// Factor k of the missing torque k q, where q is a quantity of the motion. `std` is its standard deviation,
    /// in the same `unit`.
    pub factor: f64,
    pub std: f64,
    pub unit: String,
    pub deviations: f64,
}

impl Missing {
    pub fn words(&self) -> String {
        format!(
            "a torque that follows {} is missing, {:.2e} ± {:.1e} {} ({:.0} σ)",
            self.follows,
            self.factor,
            self.std,
            prose(&self.unit),
            self.deviations
        )
    }
}

pub fn words(target: &Target) -> String {
    match target {
        Target::ActuatorLag => "an actuator that lags its command",
        Target::GyroLag => "a gyro with a low-pass filter",
        Target::FrictionDrift => "friction that drifts",
        Target::Limit => "an actuator that reaches its largest torque",
        Target::Compliance => "a bearing that yields before it slips (presliding stiffness)",
        Target::SecondMode => "the second slosh mode",
        Target::Parameter(name) if name == hub::K => {
            "a torque that turns the hub back, of a cable or of an imbalance on a tilted axis"
        }
        Target::Parameter(name) if name == slosh::ZETA_AMPLITUDE => {
            "damping that grows with the amplitude"
        }
        Target::Parameter(name) | Target::Stated(name) => {
            return format!("a wrong value of {name}");
        }
        Target::ProportionalTorque(kind) => {
            return format!("a torque that follows {}", ADDITIONAL_TORQUES[*kind].0);
        }
        _ => "an effect",
    }
    .into()
}

/// Returns the effect as a cause, with the flags that estimate it. Returns `None` if the effect is an additional torque,
/// because no option estimates such a torque.
pub fn cause(system: &BenchSystem, effect: &Effect) -> Option<Cause> {
    let target = &system.targets[effect.unknown];
    let value = effect.size.0;
    let start = |name: &str, value: f64| format!("--start {name}={value:.3}");
    let limit = system.largest * (1.0 - value);
    let (flags, size) = match target {
        Target::ActuatorLag => ("--also actuator_lag".into(), Some(("actuator_lag", value, "s"))),
        Target::GyroLag => ("--also gyro_lag".into(), Some(("gyro_lag", value, "s"))),
        Target::FrictionDrift => {
            ("--also friction_drift".into(), Some(("friction_drift", value, "1")))
        }
        Target::Limit => (
            format!("--set {}=true {}", wheel::ENABLED, start(wheel::TAU_MAX, limit)),
            Some((wheel::TAU_MAX, limit, "N.m")),
        ),
        Target::Compliance => (
            "--friction stribeck,lugre".into(),
            Some((names::hubslosh::friction::SIGMA0, 1.0 / value, "N.m/rad")),
        ),
        Target::SecondMode => (format!("--set {}=2", slosh::MODES), None),
        Target::Stated(name) => (format!("--start {name} without its standard deviation"), None),
        Target::Parameter(name) if PARAMETERS.contains(&name.as_str()) => {
            (format!("{} in place of --set", start(name, value)), None)
        }
        Target::Parameter(name) => {
            let unit = if name == hub::K { "N.m/rad" } else { "1" };
            (start(name, value), Some((name.as_str(), value, unit)))
        }
        _ => return None,
    };
    let size = size.map(|(name, value, unit)| (name.to_string(), value, unit.to_string()));
    Some(Cause { effect: words(target), flags, size, gain: effect.gain })
}

/// Returns the effect as a missing torque. Returns `None` if the effect is no torque proportional to a
/// quantity of the motion.
pub fn missing(system: &BenchSystem, effect: &Effect) -> Option<Missing> {
    let Target::ProportionalTorque(kind) = &system.targets[effect.unknown] else { return None };
    let (follows, unit, _) = ADDITIONAL_TORQUES[*kind];
    let (factor, std) = effect.size;
    Some(Missing {
        follows: follows.into(),
        factor,
        std,
        unit: unit.into(),
        deviations: (factor / std).abs(),
    })
}

//! Unknowns: parameters of the FMU, and properties of sensors and data link.

use host::description::ModelDescription;
use names::hubslosh::{friction, init, slosh};
use serde::Serialize;

use crate::model::bench::breaking;
use crate::model::unknown::range;
use crate::tuning::RANGE_MARGIN;

/// One unknown number.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Estimated quantity.
    pub quantity: Quantity,
    /// Unit, as in modelDescription.xml.
    pub unit: String,
    /// Start of the search.
    pub start: f64,
    /// Prior: mean and standard deviation.
    pub prior: Option<(f64, f64)>,
    /// True if the prior only states the order of magnitude, to guide the search; it does not count as knowledge.
    pub vague: bool,
    /// Transformation to a variable without bounds.
    pub scale: Scale,
    /// Least and largest value that the FMU allows.
    pub range: [f64; 2],
}

/// Kinds of unknowns.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub enum Quantity {
    /// A parameter of the FMU, the same in all recordings.
    Parameter(String),
    /// Delay from recorded torque to recorded rate, s. Torque's and gyro's own delays add up to it;
    /// torque and rate alone cannot tell one from the other.
    Delay,
    /// Delay of the encoder's angle, s. It is that of the rate where the two sensors are equally late.
    AngleDelay,
    /// Time constant of an actuator that lags its command, s ([`crate::model::bench::effect`]).
    ActuatorLag,
    /// Time constant of the gyro's filter, s.
    GyroLag,
    /// Relative change of the friction from a recording's first row to its last.
    FrictionDrift,
    /// Reading of the gyro over the rate.
    GyroScale,
    /// Reading of the gyro at rest, rad/s, one for each recording.
    GyroBias(usize),
    /// Reading of the encoder at angle 0, rad, one for each recording.
    AngleOffset(usize),
    /// An `init.` parameter of a recording that does not start at rest.
    Initial(usize, String),
}

impl Quantity {
    /// Name in tables and files; that of the FMU where it is one of the FMU's.
    pub fn name(&self) -> String {
        match self {
            Quantity::Parameter(name) => name.clone(),
            Quantity::Delay => "delay".into(),
            Quantity::AngleDelay => "angle_delay".into(),
            Quantity::ActuatorLag => "actuator_lag".into(),
            Quantity::GyroLag => "gyro_lag".into(),
            Quantity::FrictionDrift => "friction_drift".into(),
            Quantity::GyroScale => "gyro_scale".into(),
            Quantity::GyroBias(recording) => format!("gyro_bias[{}]", recording + 1),
            Quantity::AngleOffset(recording) => format!("angle_offset[{}]", recording + 1),
            Quantity::Initial(recording, name) => format!("{name}[{}]", recording + 1),
        }
    }

    /// Returns true if derivatives by it are differences of runs; the others are exact.
    pub fn is_in_runs(&self) -> bool {
        use Quantity::{ActuatorLag, FrictionDrift, GyroLag, Initial, Parameter};
        matches!(self, Parameter(_) | Initial(..) | ActuatorLag | GyroLag | FrictionDrift)
    }

    /// The parameter's name if it is one of the FMU's for all recordings.
    pub fn parameter(&self) -> Option<&str> {
        match self {
            Quantity::Parameter(name) => Some(name),
            _ => None,
        }
    }
}

/// Transformation of a bounded value to an unbounded variable x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// x = ln value: positive.
    Log,
    /// value = unit ln(1 + eˣ): positive, and linear where it is much more than the unit. For parameters
    /// whose sums are known better than they are themselves: valleys along such sums stay straight.
    Softplus(f64),
    /// x = ln((value − a)/(b − value)): between a and b.
    Logit(f64, f64),
    /// x = value/unit: free.
    Linear(f64),
}

impl Scale {
    /// The value for x.
    pub fn value(self, x: f64) -> f64 {
        match self {
            Scale::Log => x.exp(),
            Scale::Softplus(unit) => unit * (x.max(0.0) + (-x.abs()).exp().ln_1p()),
            Scale::Logit(a, b) => a + (b - a) / (1.0 + (-x).exp()),
            Scale::Linear(unit) => x * unit,
        }
    }

    /// The x for a value.
    pub fn variable(self, value: f64) -> f64 {
        match self {
            Scale::Log => value.ln(),
            Scale::Softplus(unit) => value / unit + (-(-value / unit).exp_m1()).ln(),
            Scale::Logit(a, b) => ((value - a) / (b - value)).ln(),
            Scale::Linear(unit) => value / unit,
        }
    }

    /// d value/d x.
    pub fn slope(self, x: f64) -> f64 {
        match self {
            Scale::Log => x.exp(),
            Scale::Softplus(unit) => unit / (1.0 + (-x).exp()),
            Scale::Logit(a, b) => (b - a) / (2.0 + x.exp() + (-x).exp()),
            Scale::Linear(unit) => unit,
        }
    }
}

impl Unknown {
    /// An unknown of which nothing is known beforehand.
    fn new(quantity: Quantity, unit: &str, start: f64, scale: Scale) -> Self {
        let range = [f64::NEG_INFINITY, f64::INFINITY];
        Unknown { quantity, unit: unit.into(), start, prior: None, vague: false, scale, range }
    }

    /// A positive parameter of the FMU.
    pub fn positive(name: &str, unit: &str, start: f64) -> Self {
        Unknown::new(Quantity::Parameter(name.into()), unit, start, Scale::Log)
    }

    /// The same with the range that the FMU declares for it.
    pub fn within_range_of(self, description: &ModelDescription) -> Self {
        let name = match &self.quantity {
            Quantity::Parameter(name) | Quantity::Initial(_, name) => name,
            _ => return self,
        };
        match description.variable(name) {
            Ok(variable) => Unknown { range: range(variable), ..self },
            Err(_) => self,
        }
    }

    /// Value for x, within the range.
    pub fn value(&self, x: f64) -> f64 {
        // NaN where the scale itself does not reach an end
        self.scale.value(x).max(self.range[0]).min(self.range[1])
    }

    /// The ends of x for a search: the range's, less a margin.
    pub fn ends(&self) -> [f64; 2] {
        let [low, high] = self.range.map(|end| self.scale.variable(end));
        let or = |end: f64, open: f64| if end.is_nan() { open } else { end };
        [or(low, f64::NEG_INFINITY) + RANGE_MARGIN, or(high, f64::INFINITY) - RANGE_MARGIN]
    }

    /// x within [`Unknown::ends`].
    pub fn inside(&self, x: f64) -> f64 {
        let [low, high] = self.ends();
        x.max(low).min(high)
    }

    /// Returns true if x is at one of these ends: only the FMU's range stops it.
    pub fn is_at_end(&self, x: f64) -> bool {
        let [low, high] = self.ends();
        x <= low || x >= high
    }

    /// Returns true if the value must be positive.
    pub fn is_positive(&self) -> bool {
        matches!(self.scale, Scale::Log | Scale::Softplus(_))
    }

    /// An end of its interval, `reach` (in x) from x.
    pub fn end(&self, x: f64, reach: f64) -> f64 {
        if self.is_additive() {
            (self.scale.value(x) + reach * self.scale.slope(x)).max(0.0)
        } else {
            self.scale.value(x + reach)
        }
    }

    /// Returns true if the answer is linear in the value instead of x. Intervals are then symmetric in the value, which must be
    /// positive.
    pub fn is_additive(&self) -> bool {
        matches!(self.scale, Scale::Softplus(_))
    }

    /// The same, known beforehand to be `mean` with standard deviation `deviation`.
    pub fn known(self, mean: f64, deviation: f64) -> Self {
        Unknown { prior: Some((mean, deviation)), ..self }
    }

    /// The direction-dependent part of dry friction, between −1 and 1.
    pub fn asymmetry() -> Self {
        let quantity = Quantity::Parameter(friction::ASYMMETRY.into());
        Unknown::new(quantity, "1", 0.0, Scale::Logit(-1.0, 1.0))
    }

    /// The delay from torque to rate.
    pub fn delay() -> Self {
        Unknown::new(Quantity::Delay, "s", 0.0, Scale::Linear(1e-3))
    }

    /// The delay from torque to the encoder's angle.
    pub fn angle_delay() -> Self {
        Unknown::new(Quantity::AngleDelay, "s", 0.0, Scale::Linear(1e-3))
    }

    /// The lag of the actuator.
    pub fn actuator_lag() -> Self {
        Unknown::new(Quantity::ActuatorLag, "s", 0.02, Scale::Softplus(5e-3))
    }

    /// The lag of the gyro's filter.
    pub fn gyro_lag() -> Self {
        Unknown::new(Quantity::GyroLag, "s", 0.02, Scale::Softplus(5e-3))
    }

    /// The drift of the friction.
    pub fn friction_drift() -> Self {
        Unknown::new(Quantity::FrictionDrift, "1", 0.1, Scale::Linear(0.1))
    }

    /// Damping by waves that break, and the steepness at which they begin to.
    pub fn breaking() -> [Self; 2] {
        let (begins, deviation) = breaking::BEGINS;
        let growth = Unknown::positive(slosh::ZETA_BREAKING, "1", 0.04);
        let growth =
            Unknown { scale: Scale::Softplus(0.004), vague: true, ..growth.known(0.04, 0.2) };
        let onset = Unknown::positive(slosh::BREAKING_STEEPNESS, "1", begins);
        [growth, onset.known(begins, deviation)]
    }

    /// The stiffness of LuGre's bristles. Stiffer than the upper end, bristles move less than 1/100 of what a gyro of this kind sees.
    pub fn bristle_stiffness(unit: &str) -> Self {
        let stiffness = Unknown::positive(friction::SIGMA0, unit, 100.0);
        Unknown { scale: Scale::Logit(0.0, 1000.0), ..stiffness }
    }

    /// The gyro's scale.
    pub fn gyro_scale() -> Self {
        Unknown::new(Quantity::GyroScale, "1", 1.0, Scale::Log)
    }

    /// The gyro's bias in a recording.
    pub fn gyro_bias(recording: usize) -> Self {
        Unknown::new(Quantity::GyroBias(recording), "rad/s", 0.0, Scale::Linear(1e-3))
    }

    /// The encoder's zero in a recording.
    pub fn angle_offset(recording: usize, start: f64) -> Self {
        Unknown::new(Quantity::AngleOffset(recording), "rad", start, Scale::Linear(1e-3))
    }

    /// The start of a recording that does not begin at rest: `init.omega`, `init.slosh_angle` or
    /// `init.slosh_rate`, with what is typical of it.
    pub fn initial(recording: usize, name: &str, unit: &str, typical: f64) -> Self {
        let scale = match name {
            // the FMU allows 1.5 rad
            init::SLOSH_ANGLE => Scale::Logit(-1.4, 1.4),
            _ => Scale::Linear(typical),
        };
        Unknown::new(Quantity::Initial(recording, name.into()), unit, 0.0, scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_stays_within_the_range_that_the_fmu_declares() {
        let zeta = Unknown { range: [0.0, 0.999], ..Unknown::positive("slosh.zeta", "1", 0.003) };
        assert_eq!((zeta.value(1.0), zeta.is_at_end(zeta.inside(3.0))), (0.999, true));
        let x = zeta.scale.variable(0.003);
        assert!(zeta.inside(x) == x && !zeta.is_at_end(x));
        // a step of a difference from the end is still within
        assert!(zeta.scale.value(zeta.inside(3.0) + 0.05) < 0.999);
        // ends that the scale does not reach
        let angle = Unknown::initial(0, "init.slosh_angle", "rad", 0.1);
        let angle = Unknown { range: [-1.5, 1.5], ..angle };
        assert!(angle.inside(9.0) == 9.0 && angle.inside(-9.0) == -9.0);
        let bias = Unknown::gyro_bias(0);
        assert!(bias.inside(1e9) == 1e9 && !bias.is_at_end(-1e9));
    }

    #[test]
    fn variables_and_values_go_there_and_back() {
        for (scale, value) in [
            (Scale::Log, 0.163),
            (Scale::Softplus(1e-3), 0.0035),
            (Scale::Softplus(1e-3), 0.0001),
            (Scale::Logit(-1.0, 1.0), 0.1),
            (Scale::Linear(1e-3), -0.005),
        ] {
            let x = scale.variable(value);
            assert!((scale.value(x) - value).abs() < 1e-15);
            let difference = (scale.value(x + 1e-6) - scale.value(x - 1e-6)) / 2e-6;
            assert!((scale.slope(x) / difference - 1.0).abs() < 1e-8);
        }
    }
}

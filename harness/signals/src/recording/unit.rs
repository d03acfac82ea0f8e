//! Units in which recordings come, and what they are in SI.

use std::fmt;

/// Quantity of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// s.
    Time,
    /// N·m.
    Torque,
    /// rad/s.
    Rate,
    /// rad.
    Angle,
    /// m/s².
    Acceleration,
    /// m.
    Length,
    /// N.
    Force,
}

use Quantity::{Acceleration, Angle, Force, Length, Rate, Time, Torque};

/// Standard gravity, m/s² (BIPM, The International System of Units, 3rd CGPM 1901).
const GRAVITY: f64 = 9.80665;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Units by name, and one of them in SI; of each quantity the SI unit first. Names are written without dots,
/// blanks and powers' signs ([`plain`]).
const UNITS: &[(Quantity, &str, f64)] = &[
    (Time, "s", 1.0),
    (Time, "ms", 1e-3),
    (Time, "us", 1e-6),
    (Time, "ns", 1e-9),
    (Time, "min", 60.0),
    (Time, "h", 3600.0),
    (Torque, "Nm", 1.0),
    (Torque, "mNm", 1e-3),
    (Torque, "uNm", 1e-6),
    (Torque, "Ncm", 1e-2),
    (Torque, "kNm", 1e3),
    (Rate, "rad/s", 1.0),
    (Rate, "mrad/s", 1e-3),
    (Rate, "deg/s", DEGREE),
    (Rate, "mdeg/s", 1e-3 * DEGREE),
    (Rate, "dps", DEGREE),
    (Rate, "deg/h", DEGREE / 3600.0),
    (Rate, "rpm", 6.0 * DEGREE),
    (Angle, "rad", 1.0),
    (Angle, "mrad", 1e-3),
    (Angle, "urad", 1e-6),
    (Angle, "deg", DEGREE),
    (Angle, "arcsec", DEGREE / 3600.0),
    (Acceleration, "m/s2", 1.0),
    (Acceleration, "mm/s2", 1e-3),
    (Acceleration, "g", GRAVITY),
    (Acceleration, "mg", 1e-3 * GRAVITY),
    (Length, "m", 1.0),
    (Length, "cm", 1e-2),
    (Length, "mm", 1e-3),
    (Length, "um", 1e-6),
    (Force, "N", 1.0),
    (Force, "mN", 1e-3),
    (Force, "kN", 1e3),
];

/// A unit's name as [`UNITS`] has it: N·m, N.m, N*m and "N m" are Nm, m/s² and m/s^2 are m/s2, °/s and deg/sec are deg/s.
fn plain(text: &str) -> String {
    let text = text.replace('°', "deg").replace(['µ', 'μ'], "u").replace('²', "2");
    let name: String =
        text.chars().filter(|c| !matches!(c, '·' | '.' | '*' | '^' | ' ' | '⋅')).collect();
    match name.strip_suffix("sec") {
        Some(start) if !start.ends_with("arc") => format!("{start}s"),
        _ => name,
    }
}

/// Units of what no signal measures, by which a row of units is known.
const OTHERS: [&str; 38] = [
    "-", "1", "%", "V", "mV", "A", "mA", "W", "J", "ohm", "K", "C", "degC", "degF", "Pa", "hPa",
    "kPa", "MPa", "bar", "mbar", "psi", "Hz", "kHz", "kg", "l", "m/s", "km/h", "mph", "km", "T",
    "uT", "mT", "G", "rad/s2", "deg/s2", "dB", "counts", "raw",
];

/// Returns true for the name of a unit, which may stand in brackets.
pub(super) fn is_unit(text: &str) -> bool {
    let name = plain(text.trim_matches(['[', ']', '(', ')', ' ']));
    UNITS.iter().any(|(_, unit, _)| *unit == name) || OTHERS.contains(&name.as_str())
}

/// Factor from one unit to another; `None` unless both are known units of one quantity.
pub fn conversion(from: &str, to: &str) -> Option<f64> {
    let (from, to) = (plain(from), plain(to));
    if from == to {
        return Some(1.0);
    }
    let known = |name: &str| UNITS.iter().find(|(_, unit, _)| *unit == name);
    let ((quantity, _, factor), (other, _, own)) = (known(&from)?, known(&to)?);
    (quantity == other).then_some(factor / own)
}

impl Quantity {
    /// Factor from that unit to SI; `None` for an unknown unit.
    pub fn factor(self, unit: &str) -> Option<f64> {
        let unit = plain(unit);
        let found = UNITS.iter().find(|(quantity, name, _)| *quantity == self && *name == unit);
        found.map(|(_, _, factor)| *factor)
    }

    /// The names of its units.
    pub fn units(self) -> String {
        let names = UNITS.iter().filter(|(quantity, _, _)| *quantity == self);
        names.map(|(_, name, _)| *name).collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Time => "a time",
            Torque => "a torque",
            Rate => "a rate",
            Angle => "an angle",
            Acceleration => "an acceleration",
            Length => "a length",
            Force => "a force",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_known_in_each_of_its_spellings() {
        for text in ["mN.m", "mN·m", "mNm", "mN*m", "mN m"] {
            assert_eq!(Torque.factor(text), Some(1e-3), "{text}");
        }
        assert_eq!(Rate.factor("°/s"), Some(std::f64::consts::PI / 180.0));
        assert_eq!(Acceleration.factor("m/s²"), Acceleration.factor("m/s^2"));
        assert_eq!((conversion("mN.m", "N.m"), conversion("kg", "kg")), (Some(1e-3), Some(1.0)));
        assert_eq!((conversion("deg", "rad/s"), conversion("mm", "furlong")), (None, None));
        assert_eq!((Rate.factor("deg"), Torque.factor("mnm")), (None, None));
    }
}

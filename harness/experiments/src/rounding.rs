//! Numbers with the digits that mean something.

/// A quantity in thousandths of its unit, without the dust of binary fractions.
pub fn thousandths(value: f64) -> f64 {
    (value * 1e9).round() / 1e6
}

/// A value rounded to so many significant digits, and no sign at zero.
pub fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value) + 0.0
}

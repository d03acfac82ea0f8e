//! Rounds numbers to meaningful digits.

/// Converts a quantity to thousandths of its unit, without the rounding errors of binary
/// fractions: 0.0125 becomes 12.5.
pub fn thousandths(value: f64) -> f64 {
    (value * 1e9).round() / 1e6
}

/// Rounds a value to this number of significant digits; −0 becomes 0.
pub fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value) + 0.0
}

//! Steepness of waves, and where they break.

use formulas::cylinder::XI;

/// Steepness at which waves break, and its standard deviation: 0.60 to 0.66 in water.
pub const BEGINS: (f64, f64) = (0.63, 0.03);

/// Least steepness at which waves may break.
pub fn least() -> f64 {
    BEGINS.0 - BEGINS.1
}

/// Steepness k a of an upright cylinder's first mode at a slosh angle, rad (SloshTank's rule for all tanks).
pub fn steepness(angle: f64) -> f64 {
    2.0 * XI[0] / (XI[0] * XI[0] - 1.0) * angle
}

/// The words about waves that do not break up to a slosh angle, rad.
pub fn never(angle: f64) -> String {
    format!(
        "the record never breaks: its steepness k a reaches {:.2} ({:.1}°), and waves break from {:.2} on",
        steepness(angle),
        angle.to_degrees(),
        least()
    )
}

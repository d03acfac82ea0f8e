//! Steepness of waves, and where they break.

use formulas::cylinder::XI;

/// Steepness k a (wave number times amplitude) from which on waves break, and its standard
/// deviation; in water it is 0.60 to 0.66.
pub const BEGINS: (f64, f64) = (0.63, 0.03);

pub fn least() -> f64 {
    BEGINS.0 - BEGINS.1
}

/// Returns the steepness k a, wave number times amplitude, of an upright cylinder's first mode at a slosh angle, rad (SloshTank
/// uses it for all tanks).
pub fn steepness(angle: f64) -> f64 {
    2.0 * XI[0] / (XI[0] * XI[0] - 1.0) * angle
}

/// Returns the clause of the verdict that says that no wave breaks up to this slosh angle, rad.
pub fn never(angle: f64) -> String {
    format!(
        "the record never breaks: its steepness k a reaches {:.2} ({:.1}°), and waves break from {:.2} on",
        steepness(angle),
        angle.to_degrees(),
        least()
    )
}

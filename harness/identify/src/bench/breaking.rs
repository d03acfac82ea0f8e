//! Steepness of waves, and the steepness at which they break.

use formulas::cylinder::XI;

/// Mean and standard deviation of the steepness k a (wave number times amplitude) at which waves begin to break; in
/// water 0.60 to 0.66.
pub const BEGINS: (f64, f64) = (0.63, 0.03);

pub fn least() -> f64 {
    BEGINS.0 - BEGINS.1
}

/// Returns the steepness k a (wave number times amplitude) of the first mode of an upright cylinder at a slosh angle, rad.
/// SloshTank uses this formula for all tanks.
pub fn steepness(angle: f64) -> f64 {
    2.0 * XI[0] / (XI[0] * XI[0] - 1.0) * angle
}

/// Returns the clause of the verdict that no wave breaks up to this slosh angle, rad.
pub fn never(angle: f64) -> String {
    format!(
        "no wave breaks in the recordings: their steepness k a reaches {:.2} ({:.1}°), and waves break from {:.2} on",
        steepness(angle),
        angle.to_degrees(),
        least()
    )
}

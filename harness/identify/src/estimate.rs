//! A number with its uncertainty.

use serde::Serialize;

/// An estimated number.
#[derive(Clone, Debug, Serialize)]
pub struct Estimated {
    /// SI.
    pub value: f64,
    /// Standard deviation, everything in it.
    pub std: f64,
    /// Standard deviation from the noise alone.
    pub std_noise: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// As in modelDescription.xml.
    pub unit: String,
}

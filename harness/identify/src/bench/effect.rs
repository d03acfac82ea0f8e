//! Effects on a bench that the FMU does not model: an actuator that lags its command, a gyro with a low-pass
//! filter, friction that drifts.
//!
//! ```text
//! actuator lag   T τ' = τ_cmd − τ          gyro lag   T y' = ω − y
//! friction drift (b, c, d)(t) = (b, c, d) (1 + a (t − t₀)/(t₁ − t₀)), from the recording's first row t₀ to its last t₁
//! ```
//!
//! The lags are applied to the signals outside the FMU. The solution is exact for signals that are linear between instants.

use crate::tuning::LAG_PARTS;

/// Sizes of the effects that the FMU does not model. An effect of size 0 is absent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effects<'a> {
    /// Torque on the hub in addition to the recorded torque, at the recording's rows, N·m.
    pub torque: Option<&'a [f64]>,
    pub actuator_lag: f64,
    pub gyro_lag: f64,
    pub friction_drift: f64,
}

/// Returns the output of a first-order lag (s) at the end of a step `h` (s). At the beginning of the step the output is `y` and
/// the input is a; within the step the input is linear with the slope b.
fn lagged(y: f64, (a, b): (f64, f64), h: f64, lag: f64) -> f64 {
    let settled = a - b * lag;
    settled + b * h + (y - settled) * (-h / lag).exp()
}

/// Returns times and values of the torque of an actuator with this lag (s). The times are the knots of the command and points
/// between them, dense enough for linear interpolation. The command is held from knot to knot if `held` is true, and linear
/// otherwise. At the first knot the actuator's torque equals the command.
pub fn lagged_torque(lag: f64, knots: &[f64], torque: &[f64], held: bool) -> (Vec<f64>, Vec<f64>) {
    let (mut time, mut values) = (vec![knots[0]], vec![torque[0]]);
    let mut y = torque[0];
    for k in 1..knots.len() {
        let h = knots[k] - knots[k - 1];
        let slope = if held { 0.0 } else { (torque[k] - torque[k - 1]) / h };
        let parts = (2.0 * h / lag).ceil().clamp(LAG_PARTS.0, LAG_PARTS.1);
        for part in 0..parts as usize {
            let by = h * part as f64 / parts;
            y = lagged(y, (torque[k - 1] + slope * by, slope), h / parts, lag);
            let last = part + 1 == parts as usize;
            time.push(if last { knots[k] } else { knots[k - 1] + by + h / parts });
            values.push(y);
        }
    }
    (time, values)
}

/// Returns the output of a first-order filter with this lag (s) at increasing times (s). Its input is linear
/// between the given values.
pub fn of_gyro(lag: f64, time: &[f64], lines: &[f64]) -> Vec<f64> {
    let mut y = lines[0];
    let mut read = vec![y];
    for k in 1..lines.len() {
        let h = time[k] - time[k - 1];
        y = lagged(y, (lines[k - 1], (lines[k] - lines[k - 1]) / h), h, lag);
        read.push(y);
    }
    read
}

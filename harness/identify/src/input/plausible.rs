//! Checks whether a recording is plausible for this bench. Refuses an inertia that only a wrong unit explains, and evaluates
//! additional columns, for example the wheel's speed or rates about other axes.

use anyhow::{Result, bail};

use crate::input::recording::Recording;
use crate::tuning::WHEEL_WINDOW;
use analysis::innovations;
use analysis::statistics::{deviation, mean, median, noise_level};

/// Returns true if an estimated inertia differs from the nominal one by less than a factor of 8. A larger factor means that a
/// column has a wrong unit.
pub fn is_size(inertia: f64, nominal: f64) -> bool {
    // the smallest factor that a wrong unit causes is 9.5 (revolutions per minute)
    (0.125..8.0).contains(&(nominal / inertia))
}

/// Refuses an estimated inertia (kg·m²) that differs from the nominal one by a factor that only a wrong unit can
/// explain.
pub fn check_size(inertia: f64, nominal: f64) -> Result<()> {
    let ratio = nominal / inertia;
    if is_size(inertia, nominal) {
        return Ok(());
    }
    let guess = match ratio {
        r if (30.0..110.0).contains(&r) => {
            "omega looks like degrees per second; it must be in rad/s"
        }
        r if r > 110.0 => {
            "tau_cmd must be in N·m and omega in rad/s; omega looks like mrad/s or mdeg/s"
        }
        r if (300.0..3000.0).contains(&(1.0 / r)) => "tau_cmd looks like mN·m; it must be in N·m",
        r if r > 1.0 => "omega looks like rpm; it must be in rad/s",
        _ => "tau_cmd must be in N·m, omega in rad/s and time in s",
    };
    bail!(
        "the recording shows an inertia of {:.3e} kg·m², the FMU with its settings has {nominal:.3e} kg·m²: \
         {guess}. A torque with little power near the slosh frequency, such as a push, does not show the inertia either: record a \
         sweep. If the bench really is that different, give its expected inertia: --start hub.I={:.1e}:{:.1e} then estimates the inertia from this recording.",
        inertia,
        0.8 * inertia,
        0.4 * inertia
    )
}

/// Evaluates the wheel's speed and the rates about other axes. Returns notes for the reader, and doubts, which are faults of the
/// bench that no fit can correct.
pub fn columns(recording: &Recording) -> (Vec<String>, Vec<String>) {
    let (mut notes, mut doubts) = (Vec::new(), Vec::new());
    if let Some(speed) = &recording.wheel_speed {
        match actuator(recording, speed) {
            Actuator { inertia, missing: None } => notes.push(format!(
                "{}: the wheel gave the commanded torque, wheel.I = {inertia:.3e} kg·m² by its speed",
                recording.name
            )),
            Actuator { inertia, missing: Some((from, seconds)) } => doubts.push(format!(
                "{}: the wheel's speed (wheel.I = {inertia:.3e} kg·m²) does not follow tau_cmd for {seconds:.1} s, first \
                 at {from:.1} s: the wheel did not give the commanded torque",
                recording.name
            )),
        }
    }
    for (axis, name) in recording.off_axis.iter().zip(["omega_x", "omega_y"]) {
        let Some(rate) = axis else { continue };
        let noise = noise_level(rate);
        let (mean, rms) = (mean(rate), deviation(rate));
        let unit: Vec<f64> = rate.iter().map(|w| (w - mean) / noise.max(1e-12)).collect();
        let correlation = innovations::crossed(&unit, &recording.torque, recording.step());
        let line = format!(
            "{}: {name} is {rms:.2e} rad/s rms, {noise:.2e} rad/s of it noise",
            recording.name
        );
        notes.push(match (rms > 2.0 * noise, correlation > innovations::LIMIT) {
            (_, true) => format!(
                "{line}; it is correlated with the torque ({correlation:.0} standard deviations): the hub's axis is not \
                 a principal axis, or the liquid leaves its plane"
            ),
            (true, false) => format!("{line}; it is not correlated with the torque: nutation or vibration"),
            _ => line,
        });
    }
    (notes, doubts)
}

struct Actuator {
    inertia: f64,
    /// First time at which the wheel's speed does not follow the torque, s, and total duration of all windows in which
    /// it does not, s.
    missing: Option<(f64, f64)>,
}

/// Compares the wheel's speed Ω with the torque τ over windows, in which I_w ΔΩ = −∫τ dt. The wheel's inertia I_w is the median
/// over windows with a large change of speed. The torque counts as missing in a window in which this equation is violated by more
/// than a tenth of the largest change plus six standard deviations of the speed's noise.
fn actuator(recording: &Recording, speed: &[f64]) -> Actuator {
    let width = ((WHEEL_WINDOW / recording.step()) as usize).max(2);
    let noise = noise_level(speed);
    let mut pairs = Vec::new();
    for k in (0..speed.len().saturating_sub(width)).step_by(width) {
        let (time, torque) = (&recording.time[k..=k + width], &recording.torque[k..=k + width]);
        let areas = (0..width).map(|i| 0.5 * (torque[i] + torque[i + 1]) * (time[i + 1] - time[i]));
        pairs.push((recording.time[k], areas.sum::<f64>(), speed[k] - speed[k + width]));
    }
    // median over large windows, so that a part with a saturated wheel does not change it
    let largest = pairs.iter().map(|p| p.2.abs()).fold(0.0, f64::max);
    let ratios: Vec<f64> = pairs
        .iter()
        .filter(|p| p.2.abs() > 0.2 * largest)
        .map(|(_, impulse, change)| impulse / change)
        .collect();
    let inertia = median(&ratios).unwrap_or(f64::NAN);
    let allowed = 0.1 * largest + 6.0 * noise;
    let off: Vec<f64> = pairs
        .iter()
        .filter(|(_, impulse, change)| (impulse / inertia - change).abs() > allowed)
        .map(|p| p.0)
        .collect();
    Actuator { inertia, missing: off.first().map(|from| (*from, off.len() as f64 * WHEEL_WINDOW)) }
}

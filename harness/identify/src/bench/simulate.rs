//! Simulates the FMU's response to the torque of a recording, at the instants of the recording.

use anyhow::{Result, ensure};
use experiments::rest;
use host::drive::Inputs;
use host::fmu::Fmu;
use names::hubslosh::{
    G_AXIAL, OMEGA, OMEGA_DOT, SLOSH_ANGLE, TAU_CMD, TAU_EXT, THETA, friction, solver,
};

use crate::bench::effect::{self, Effects};
use crate::engine::Hold;
use crate::input::clocks;
use crate::input::recording::{Recording, masked};
use crate::model::simulate::most_steps;
use crate::tuning::SAME_INSTANT;

/// The FMU's friction coefficients. If friction drifts during a recording, all three change in proportion.
const FRICTION: [&str; 3] = [friction::B, friction::C, friction::D];

#[derive(Clone, Debug, Default)]
pub struct Motion {
    pub angle: Vec<f64>,
    pub rate: Vec<f64>,
    pub acceleration: Vec<f64>,
    pub slosh_angle: Vec<f64>,
}

/// Returns corrected samples of a smooth signal, so that linear interpolation between them has the same effect as the
/// signal. Linear interpolation of a sine with the angular frequency Ω reduces its amplitude by sinc²(Ωh/2), with the time h
/// between rows: by 0.8 % at 2.4 Hz and 50 Hz sampling. The correction uses the second difference δ², which multiplies a
/// sine by −(Ωh)² + (Ωh)⁴/12:
///
/// ```text
/// 1/sinc²(Ωh/2) = 1 + (Ωh)²/12 + (Ωh)⁴/240 + … ≈ 1 − δ²/12 + δ⁴/90
/// ```
///
/// In unevenly spaced rows only the term with δ² is used.
pub fn smooth(time: &[f64], signal: &[f64]) -> Vec<f64> {
    let n = signal.len();
    let second = |x: &[f64]| -> Vec<f64> {
        let mut d = vec![0.0; n];
        for k in 1..n - 1 {
            let (a, b) = (time[k] - time[k - 1], time[k + 1] - time[k]);
            d[k] = 2.0 * ((x[k + 1] - x[k]) / b - (x[k] - x[k - 1]) / a) / (a + b) * a * b;
        }
        d
    };
    let two = second(signal);
    let mut four = if clocks::is_even(time) { second(&two) } else { vec![0.0; n] };
    (four[0], four[1], four[n - 2], four[n - 1]) = (0.0, 0.0, 0.0, 0.0);
    (0..n).map(|k| signal[k] - two[k] / 12.0 + four[k] / 90.0).collect()
}

/// Returns the instants of a recording's torque, s, and its values there, N·m, including the first and the last row of the
/// recording. A band-limited torque is corrected for linear interpolation ([`smooth`]).
pub fn course(recording: &Recording, intersample: Hold) -> (Vec<f64>, Vec<f64>) {
    let commanded = recording.commanded.as_deref();
    let mut knots = masked(&recording.time, commanded);
    let mut torque = masked(&recording.torque, commanded);
    if intersample == Hold::BandLimited && knots.len() > 3 {
        let (fine, values) = clocks::refined(&knots, &torque);
        torque = smooth(&fine, &values);
        knots = fine;
    }
    let last = recording.time.len() - 1;
    if knots.first().is_none_or(|t| *t > recording.time[0]) {
        knots.insert(0, recording.time[0]);
        torque.insert(0, recording.torque[0]);
    }
    if knots[knots.len() - 1] < recording.time[last] {
        knots.push(recording.time[last]);
        torque.push(recording.torque[last]);
    }
    (knots, torque)
}

#[derive(Clone, Debug)]
pub struct Setup {
    pub settings: Vec<(String, String)>,
    pub intersample: Hold,
}

impl Setup {
    /// Simulates the FMU with these real parameters, by name, over a recording. `delay` (s) is the time from the recorded
    /// torque to the recorded rate: row k reads the FMU at t_k − delay.
    ///
    /// # Errors
    /// If the delay is longer than the recording, a step takes more than [`most_steps`], or the FMU refuses a call.
    pub fn run(
        &self,
        fmu: &Fmu,
        values: &[(&str, f64)],
        recording: &Recording,
        delay: f64,
    ) -> Result<Motion> {
        self.run_under(fmu, values, recording, delay, &Effects::default(), true)
    }

    /// Simulates the FMU as [`Setup::run`] does, with effects that the FMU does not model. If the gyro has a filter, the returned
    /// rate is the output of this filter. Unless `whole` is true, only angle and rate are returned, as finite differences need
    /// them: both are states, so that the FMU does not have to compute its outputs.
    pub fn run_under(
        &self,
        fmu: &Fmu,
        values: &[(&str, f64)],
        recording: &Recording,
        delay: f64,
        effects: &Effects,
        whole: bool,
    ) -> Result<Motion> {
        let time = &recording.time;
        let span = time[time.len() - 1] - time[0];
        ensure!(
            delay.abs() <= span,
            "a delay of {delay} s is longer than the recording (allowed: up to {span} s)"
        );
        let reference =
            |name: &str| Ok::<_, anyhow::Error>(fmu.description().variable(name)?.reference);
        let mut instance = rest::instantiate(fmu, "identify")?;
        for (name, value) in &self.settings {
            instance.set(name, value)?;
        }
        let set = self.settings.iter().map(|(name, _)| name.as_str());
        if let Some(most) = most_steps(fmu.description(), set, time) {
            instance.set(solver::MAX_STEPS, &most.to_string())?;
        }
        for (name, value) in values {
            instance.set_real(&[reference(name)?], &[*value])?;
        }
        let (mut knots, mut torque) = course(recording, self.intersample);
        let mut held = self.intersample == Hold::ZeroOrderHold;
        if effects.actuator_lag > 0.0 {
            (knots, torque) = effect::lagged_torque(effects.actuator_lag, &knots, &torque, held);
            held = false;
        }
        let at_knots = |signal: &[f64]| -> Vec<f64> {
            if knots.len() == recording.time.len() && knots == recording.time {
                return signal.to_vec();
            }
            let mut row = 0;
            let value = |t: &f64| clocks::interpolated_at(&recording.time, signal, *t, &mut row);
            knots.iter().map(value).collect()
        };
        let gravity = recording.gravity.as_deref().map(at_knots);
        let additional = effects.torque.map(at_knots);
        let mut driven = vec![(TAU_CMD, torque.as_slice())];
        driven.extend(gravity.as_ref().map(|gravity| (G_AXIAL, gravity.as_slice())));
        driven.extend(additional.as_ref().map(|torque| (TAU_EXT, torque.as_slice())));
        let (names, signals): (Vec<&str>, Vec<&[f64]>) = driven.into_iter().unzip();
        let inputs = Inputs::new(fmu.description(), &names, held)?;
        let first: Vec<f64> = signals.iter().map(|signal| signal[0]).collect();
        inputs.initialise(&mut instance, None, time[0], None, &first)?;
        let drifting = match effects.friction_drift == 0.0 {
            true => Vec::new(),
            false => FRICTION.map(reference).into_iter().collect::<Result<Vec<u32>>>()?,
        };
        let mut friction = vec![0.0; drifting.len()];
        instance.get_real(&drifting, &mut friction)?;

        let outputs =
            [reference(THETA)?, reference(OMEGA)?, reference(OMEGA_DOT)?, reference(SLOSH_ANGLE)?];
        let outputs = if whole { &outputs[..] } else { &outputs[..2] };
        let mut motion = Motion::default();
        // `row` is the next row to be read; the signals are linear from `knot` to the next knot
        let (mut row, mut knot) = (0, 0);
        inputs.drive(&mut instance, time[0], |instance, t, course| {
            let target = loop {
                let Some(&recorded) = time.get(row) else { return Ok(None) };
                let target = recorded - delay;
                if t < target - SAME_INSTANT {
                    break target;
                }
                let mut values = [0.0; 4];
                instance.get_real(outputs, &mut values[..outputs.len()])?;
                motion.angle.push(values[0]);
                motion.rate.push(values[1]);
                if whole {
                    motion.acceleration.push(values[2]);
                    motion.slosh_angle.push(values[3]);
                }
                row += 1;
                if !drifting.is_empty() {
                    let part = 1.0 + effects.friction_drift * (recorded - time[0]) / span;
                    let now: Vec<f64> =
                        friction.iter().map(|value| value * part.max(0.0)).collect();
                    instance.set_real(&drifting, &now)?;
                }
            };
            if knots.get(knot + 1).is_some_and(|end| t >= *end) {
                knot += 1;
            }
            let end = knots.get(knot + 1).copied();
            for (i, signal) in signals.iter().enumerate() {
                course.slopes[i] = match end {
                    Some(end) if !held => (signal[knot + 1] - signal[knot]) / (end - knots[knot]),
                    _ => 0.0,
                };
                course.values[i] = signal[knot] + course.slopes[i] * (t - knots[knot]);
            }
            Ok(Some(end.filter(|end| *end < target + SAME_INSTANT).unwrap_or(target)))
        })?;
        if effects.gyro_lag > 0.0 {
            for signal in [&mut motion.rate, &mut motion.acceleration] {
                if signal.len() > 3 {
                    *signal = effect::of_gyro(effects.gyro_lag, time, &smooth(time, signal));
                }
            }
        }
        Ok(motion)
    }
}

/// Returns value and slope of a signal `lead` (s) after each time, by cubic Hermite interpolation between rows. Beyond the ends
/// the signal continues as a line.
fn hermite(time: &[f64], values: &[f64], slopes: &[f64], lead: f64) -> Vec<(f64, f64)> {
    let last = time.len() - 1;
    let mut row = 0;
    let at = |t: f64| {
        let t = t + lead;
        while row + 1 < last && time[row + 1] <= t {
            row += 1;
        }
        while row > 0 && time[row] > t {
            row -= 1;
        }
        for (end, beyond) in [(0, t <= time[0]), (last, t >= time[last])] {
            if beyond {
                return (values[end] + slopes[end] * (t - time[end]), slopes[end]);
            }
        }
        let h = time[row + 1] - time[row];
        let u = (t - time[row]) / h;
        let (a, b) = (values[row], values[row + 1]);
        let (p, q) = (h * slopes[row], h * slopes[row + 1]);
        let (c, d) = (3.0 * (b - a) - 2.0 * p - q, 2.0 * (a - b) + p + q);
        (a + u * (p + u * (c + u * d)), (p + u * (2.0 * c + 3.0 * u * d)) / h)
    };
    time.iter().copied().map(at).collect()
}

/// Returns angle and rate of a motion `lead` (s) after the instants `time`.
pub fn angle_and_rate_at(time: &[f64], motion: &Motion, lead: f64) -> [Vec<f64>; 2] {
    if lead == 0.0 {
        return [motion.angle.clone(), motion.rate.clone()];
    }
    let (angle, rate) = hermite(time, &motion.angle, &motion.rate, lead).into_iter().unzip();
    [angle, rate]
}

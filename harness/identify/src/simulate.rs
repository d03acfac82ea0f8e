//! The FMU's answer to a recording's torque, at the recording's instants.

use anyhow::{Context, Result};
use host::fmi2::{Fmu, Instance};

use crate::recording::Recording;

/// Instants closer than this are the same, s.
const SAME: f64 = 1e-9;

/// Motion of the hub at the rows of a recording.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// rad.
    pub angle: Vec<f64>,
    /// rad/s.
    pub rate: Vec<f64>,
    /// rad/s².
    pub acceleration: Vec<f64>,
}

/// Which instants the FMU is stepped to if there is a delay between torque and rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instants {
    /// Those of the rows less the delay and those where the torque changes: nothing is interpolated.
    All,
    /// Those where the torque changes: half as many steps. In between, angle and rate are cubics
    /// through values and derivatives at both ends. Their error is at most (Ωh)⁴/384 of the rate, 1e-4 at 3.5 Hz
    /// and 50 Hz sampling: good for sensitivities, not for residuals.
    Knots,
}

/// How the FMU is set up and driven.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Values by FMU name, as text, set first.
    pub settings: Vec<(String, String)>,
    /// Torque is held from row to row (else it is linear between them).
    pub held: bool,
}

impl Setup {
    /// Runs the FMU with these real parameters, by name, through a recording. `delay` (s) lies
    /// between the recorded torque and the recorded rate: row k sees the FMU at t_k − delay.
    pub fn run(
        &self,
        fmu: &Fmu,
        values: &[(&str, f64)],
        recording: &Recording,
        delay: f64,
        instants: Instants,
    ) -> Result<Motion> {
        let reference =
            |name: &str| Ok::<_, anyhow::Error>(fmu.description().variable(name)?.reference);
        let mut instance = fmu.instantiate("identify")?;
        for (name, value) in &self.settings {
            instance.set(name, value)?;
        }
        for (name, value) in values {
            instance.set_real(&[reference(name)?], &[*value])?;
        }
        let mut inputs = vec![(reference("tau_cmd")?, &recording.torque)];
        if let Some(gravity) = &recording.gravity {
            inputs.push((reference("g_axial")?, gravity));
        }
        let mut drive = Drive {
            references: inputs.iter().map(|(reference, _)| *reference).collect(),
            signals: inputs.iter().map(|(_, signal)| signal.as_slice()).collect(),
            outputs: [reference("theta")?, reference("omega")?, reference("omega_dot")?],
            time: &recording.time,
            held: self.held,
            instance: &mut instance,
        };
        drive.begin()?;
        if instants == Instants::All || delay == 0.0 {
            drive.exactly(delay)
        } else {
            Ok(late(&recording.time, &drive.exactly(0.0)?, delay))
        }
    }
}

/// An instance that is driven with the signals of a recording.
struct Drive<'a, 'fmu> {
    instance: &'a mut Instance<'fmu>,
    references: Vec<u32>,
    signals: Vec<&'a [f64]>,
    outputs: [u32; 3],
    time: &'a [f64],
    held: bool,
}

impl Drive<'_, '_> {
    fn begin(&mut self) -> Result<()> {
        self.instance.setup_experiment(None, self.time[0], None)?;
        self.instance.enter_initialization_mode()?;
        let first: Vec<f64> = self.signals.iter().map(|signal| signal[0]).collect();
        self.instance.set_real(&self.references, &first)?;
        self.instance.exit_initialization_mode()?;
        Ok(())
    }

    fn exactly(&mut self, delay: f64) -> Result<Motion> {
        let (time, count) = (self.time, self.references.len());
        let orders = vec![1; count];
        let (mut values, mut slopes) = (vec![0.0; count], vec![0.0; count]);
        let mut motion = Motion::default();
        let (mut t, mut knot) = (time[0], 0);
        for &row in time {
            let target = row - delay;
            while t < target - SAME {
                let end = time.get(knot + 1).copied().unwrap_or(f64::INFINITY);
                let next = if end < target + SAME { end } else { target };
                for (i, signal) in self.signals.iter().enumerate() {
                    slopes[i] = match time.get(knot + 1) {
                        Some(end) if !self.held => {
                            (signal[knot + 1] - signal[knot]) / (end - time[knot])
                        }
                        _ => 0.0,
                    };
                    values[i] = signal[knot] + slopes[i] * (t - time[knot]);
                }
                let references = &self.references;
                self.instance
                    .set_real(references, &values)
                    .and_then(|()| match self.held {
                        true => Ok(()),
                        false => {
                            self.instance.set_real_input_derivatives(references, &orders, &slopes)
                        }
                    })
                    .and_then(|()| self.instance.do_step(t, next - t))
                    .with_context(|| format!("the FMU stopped at t = {t} s"))?;
                t = next;
                if t >= end {
                    knot += 1;
                }
            }
            let mut values = [0.0; 3];
            self.instance.get_real(&self.outputs, &mut values)?;
            motion.angle.push(values[0]);
            motion.rate.push(values[1]);
            motion.acceleration.push(values[2]);
        }
        Ok(motion)
    }
}

/// A motion that is known at the rows, at the rows less a delay: cubics (Hermite) between them, the first
/// value before, the last one after.
fn late(time: &[f64], at_rows: &Motion, delay: f64) -> Motion {
    let mut motion = Motion::default();
    let last = time.len() - 1;
    let mut k = 0;
    for &row in time {
        let t = (row - delay).clamp(time[0], time[last]);
        while k + 1 < last && time[k + 1] <= t {
            k += 1;
        }
        while k > 0 && time[k] > t {
            k -= 1;
        }
        let h = time[k + 1] - time[k];
        let u = (t - time[k]) / h;
        // value and derivative of the cubic through (y0, d0) and (y1, d1)
        let cubic = |y: &[f64], d: &[f64]| {
            let (y0, y1, d0, d1) = (y[k], y[k + 1], h * d[k], h * d[k + 1]);
            let (second, third) = (3.0 * (y1 - y0) - 2.0 * d0 - d1, 2.0 * (y0 - y1) + d0 + d1);
            let value = y0 + u * (d0 + u * (second + u * third));
            (value, (d0 + u * (2.0 * second + 3.0 * u * third)) / h)
        };
        let (rate, acceleration) = cubic(&at_rows.rate, &at_rows.acceleration);
        motion.angle.push(cubic(&at_rows.angle, &at_rows.rate).0);
        motion.rate.push(rate);
        motion.acceleration.push(acceleration);
    }
    motion
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_late_exactly() {
        let time: Vec<f64> = (0..20).map(|k| 0.02 * f64::from(k)).collect();
        let of = |f: fn(f64) -> f64| time.iter().map(|t| f(*t)).collect::<Vec<f64>>();
        let at_rows = Motion {
            angle: of(|t| t * t * t),
            rate: of(|t| 3.0 * t * t),
            acceleration: of(|t| 6.0 * t),
        };
        for delay in [0.007, -0.007, 0.031] {
            let found = late(&time, &at_rows, delay);
            for k in 3..17 {
                let t = time[k] - delay;
                assert!((found.angle[k] - t * t * t).abs() < 1e-14);
                assert!((found.rate[k] - 3.0 * t * t).abs() < 1e-14);
                assert!((found.acceleration[k] - 6.0 * t).abs() < 1e-12);
            }
        }
    }
}

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

/// Intersample behaviour: what the torque does between the rows of a recording (Ljung; Pintelon & Schoukens).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Intersample {
    /// A line from row to row.
    FirstOrderHold,
    /// The row's value until the next.
    ZeroOrderHold,
    /// What a band-limited signal does that was sampled: see [`smooth`].
    BandLimited,
}

impl Intersample {
    /// All, the likeliest first.
    pub const ALL: [Intersample; 3] =
        [Intersample::FirstOrderHold, Intersample::BandLimited, Intersample::ZeroOrderHold];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Intersample::FirstOrderHold => "linear between rows",
            Intersample::ZeroOrderHold => "held from row to row",
            Intersample::BandLimited => "smooth between rows",
        }
    }
}

/// Values that, joined by lines, act as the smooth signal does whose samples these are. Lines make sinc²(Ωh/2) of a sine at
/// Ω, h the time between rows: 0.8 % less at 2.4 Hz and 50 Hz sampling. With δ² the second difference, which makes
/// −(Ωh)² + (Ωh)⁴/12 of it,
///
/// ```text
/// 1/sinc²(Ωh/2) = 1 + (Ωh)²/12 + (Ωh)⁴/240 + … ≈ 1 − δ²/12 + δ⁴/90
/// ```
///
/// Where rows are unevenly spaced, δ² alone.
pub fn smooth(time: &[f64], signal: &[f64]) -> Vec<f64> {
    let n = signal.len();
    let mean = (time[n - 1] - time[0]) / (n - 1) as f64;
    let even = time.windows(2).all(|t| (t[1] - t[0] - mean).abs() < 0.01 * mean);
    let second = |x: &[f64]| -> Vec<f64> {
        let mut d = vec![0.0; n];
        for k in 1..n - 1 {
            let (a, b) = (time[k] - time[k - 1], time[k + 1] - time[k]);
            d[k] = 2.0 * ((x[k + 1] - x[k]) / b - (x[k] - x[k - 1]) / a) / (a + b) * a * b;
        }
        d
    };
    let two = second(signal);
    let mut four = if even { second(&two) } else { vec![0.0; n] };
    (four[0], four[1], four[n - 2], four[n - 1]) = (0.0, 0.0, 0.0, 0.0);
    (0..n).map(|k| signal[k] - two[k] / 12.0 + four[k] / 90.0).collect()
}

/// How the FMU is set up and driven.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Values by FMU name, as text, set first.
    pub settings: Vec<(String, String)>,
    /// What the torque does between rows.
    pub intersample: Intersample,
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
        let smoothed;
        let torque = match self.intersample {
            Intersample::BandLimited => {
                smoothed = smooth(&recording.time, &recording.torque);
                &smoothed
            }
            Intersample::FirstOrderHold | Intersample::ZeroOrderHold => &recording.torque,
        };
        let mut inputs = vec![(reference("tau_cmd")?, torque)];
        if let Some(gravity) = &recording.gravity {
            inputs.push((reference("g_axial")?, gravity));
        }
        let mut drive = Drive {
            references: inputs.iter().map(|(reference, _)| *reference).collect(),
            signals: inputs.iter().map(|(_, signal)| signal.as_slice()).collect(),
            outputs: [reference("theta")?, reference("omega")?, reference("omega_dot")?],
            time: &recording.time,
            held: self.intersample == Intersample::ZeroOrderHold,
            instance: &mut instance,
        };
        drive.begin()?;
        drive.through(delay)
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

    fn through(&mut self, delay: f64) -> Result<Motion> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_through_smoothed_values_are_the_sine_that_was_sampled() {
        let h = 0.02;
        for f in [1.25, 2.4, 3.5] {
            let w = std::f64::consts::TAU * f;
            let time: Vec<f64> = (0..5000).map(|k| h * f64::from(k)).collect();
            let sine: Vec<f64> = time.iter().map(|t| (w * t).sin()).collect();
            let amplitude = |x: &[f64]| {
                // of the lines through x at f: that of x times sinc²
                let half: f64 = 0.5 * w * h;
                let tone = time.iter().zip(x).map(|(t, x)| x * (w * t).sin()).sum::<f64>();
                let whole = sine.iter().map(|s| s * s).sum::<f64>();
                tone / whole * (half.sin() / half).powi(2)
            };
            assert!(amplitude(&sine) < 0.998);
            // the next term of the series, (Ωh)⁶/1600: 5e-6 at 3.5 Hz, and the two ends
            assert!((amplitude(&smooth(&time, &sine)) - 1.0).abs() < 2e-5, "{f}");
        }
    }
}

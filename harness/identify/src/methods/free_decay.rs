//! Frequency and damping from free decays ([`analysis::free_decay`]): records without torque of a wave height, a force,
//! an angle or a rate, of a tank that was shaken once or of a hub that was pushed.

use analysis::free_decay::{self, LEAST_PERIODS, Record, Value};
use anyhow::{Context, Result};
use serde::Serialize;
use signals::recording::{Quantity, quantity};

use super::{Method, Needs, Task};
use crate::estimate::Estimated;
use crate::input::recording::Recording;
use crate::news::News;
use crate::tuning::{DECAY_MISFIT, NAMED_OSCILLATION};
use crate::words::identified::{Identified, Residual};
use analysis::statistics::noise_level;

/// The result; `measurement` has f, ζ, ζ_A and κ.
pub type Found = Identified<Details>;

/// Results that only this method has.
#[derive(Clone, Debug, Serialize)]
pub struct Details {
    /// The signal.
    pub signal: String,
    /// Amplitude at the beginning and at the end of each record, in the signal's SI unit.
    pub amplitudes: Vec<[f64; 2]>,
    /// Periods of each record.
    pub periods: Vec<f64>,
    /// ζ, if it is taken as the same at all amplitudes.
    pub zeta_constant: f64,
    /// Root mean square of the residual, in the signal's unit.
    pub residual: f64,
    /// The same if ζ is taken as constant.
    pub residual_constant: f64,
    /// The signal's white noise, in its unit.
    pub noise: f64,
}

/// Fits free decays.
pub struct FreeDecay {
    /// Name of the signal that the recordings hold in place of the rate.
    pub signal: &'static str,
    /// Relative standard deviation of the recordings' clock.
    pub clock: f64,
}

impl FreeDecay {
    /// The signal's unit, and those of ζ_A and κ.
    fn units(&self) -> [&'static str; 3] {
        match quantity(self.signal) {
            Ok(Quantity::Length) => ["m", "1/m", "1/m2"],
            Ok(Quantity::Force) => ["N", "1/N", "1/N2"],
            Ok(Quantity::Angle) => ["rad", "1/rad", "1/rad2"],
            _ => ["rad/s", "s/rad", "s2/rad2"],
        }
    }
}

impl Method for FreeDecay {
    type Details = Details;

    const NEEDS: Needs = Needs { fmu: false, validation: false };

    fn identify(&self, task: &Task, _: &mut dyn FnMut(&News)) -> Result<Found> {
        let [unit, inverse, squared] = self.units();
        for recording in task.recordings {
            recording.check()?;
        }
        let records: Vec<Record> =
            task.recordings.iter().map(|r| Record { time: &r.time, signal: &r.rate }).collect();
        let found = free_decay::FreeDecay::fit(&records).with_context(|| {
            format!(
                "{}: no decaying oscillation of at least {LEAST_PERIODS} periods is seen in {}",
                task.recordings.iter().map(|r| r.name.as_str()).collect::<Vec<_>>().join(", "),
                self.signal
            )
        })?;
        let noise = task.recordings.iter().map(|r| noise_level(&r.rate)).fold(0.0, f64::max);
        let mut answer = Found::new(Details {
            signal: self.signal.into(),
            amplitudes: found.amplitudes.clone(),
            periods: found.periods.clone(),
            zeta_constant: found.constant,
            residual: found.residual,
            residual_constant: found.residual_constant,
            noise,
        });
        let estimates = [
            ("zeta", found.zeta, "1"),
            ("zeta_amplitude", found.zeta_amplitude, inverse),
            ("hardening", found.hardening, squared),
        ];
        for (name, Value { value, std }, unit) in estimates {
            answer.measurement.insert(name.into(), Estimated::normal(value, std, unit));
        }
        // a damping ratio does not depend on the clock
        let f = found.frequency;
        let frequency = Value { std: f.std.hypot(self.clock * f.value), ..f };
        let estimated = Estimated::normal(f.value, frequency.std, "Hz");
        let estimated = Estimated { std_noise: f.std, ..estimated };
        answer.measurement.insert("frequency".into(), estimated);
        answer.converged = found.converged;
        let residual = |(recording, residual): (&Recording, &Vec<f64>)| Residual {
            name: recording.name.clone(),
            label: format!("{}, {unit}", self.signal),
            time: recording.time.clone(),
            measured: recording.rate.clone(),
            residual: residual.clone(),
            noise: Some(noise),
            torque: None,
        };
        answer.residuals = task.recordings.iter().zip(&found.residuals).map(residual).collect();
        let fits = found.residual < DECAY_MISFIT * noise.max(1e-9 * found.amplitudes[0][0]);
        answer.fits = Some(fits);
        let all = found.amplitudes.iter().flatten();
        let (least, most) = all.fold((f64::MAX, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
        let plus = |value: Value| format!("{:.5} ± {:.5}", value.value, 1.96 * value.std);
        answer.verdict = vec![
            format!(
                "f = {} Hz, ζ = {} at vanishing amplitude (95 % intervals).",
                plus(frequency),
                plus(found.zeta)
            ),
            format!(
                "The interval of f includes the clock's tolerance, {} % (--tolerance clock=…).",
                100.0 * self.clock
            ),
            if found.zeta_amplitude.value.abs() > 1.96 * found.zeta_amplitude.std {
                format!(
                    "Damping depends on the amplitude: ζ_A = {:.4} ± {:.4} {inverse}, so ζ is {:.5} at {least:.3} {unit} and \
                     {:.5} at {most:.3} {unit}, the ends of what was recorded.",
                    found.zeta_amplitude.value,
                    1.96 * found.zeta_amplitude.std,
                    found.zeta_at(least),
                    found.zeta_at(most)
                )
            } else {
                format!(
                    "No dependence of the damping on the amplitude is seen: ζ_A = {:.4} ± {:.4} {inverse}; with ζ_A = 0, ζ = \
                     {:.5}.",
                    found.zeta_amplitude.value,
                    1.96 * found.zeta_amplitude.std,
                    found.constant
                )
            },
            if fits {
                "One decaying oscillation fits the record: the residual is its noise.".to_string()
            } else {
                format!(
                    "One decaying oscillation does not fit the record: the residual is {:.2} times its noise. The intervals only \
                     include the part of the residual at frequencies near f.",
                    found.residual / noise
                )
            },
        ];
        let (at, size) = found.other;
        if size > NAMED_OSCILLATION * most && !fits {
            answer.verdict.push(format!(
                "The residual has an oscillation of {:.0} % at {at:.3} Hz: another mode, or a beat with it.",
                100.0 * size / most
            ));
        }
        Ok(answer)
    }

    fn lines(found: &Found) -> Vec<String> {
        let Details { signal, amplitudes, periods, residual, noise, .. } = &found.details;
        let mut lines: Vec<String> = amplitudes
            .iter()
            .zip(periods)
            .map(|([first, last], periods)| {
                format!("{signal}: {periods:.0} periods, amplitude from {first:.4} to {last:.4}")
            })
            .collect();
        lines.push(format!("residual {residual:.2e}, noise {noise:.2e}"));
        lines
    }
}

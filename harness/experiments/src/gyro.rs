//! Tests the simulated gyro as on a bench: simulates hours at rest, computes the Allan deviation, and
//! compares the estimated with the specified noise. The formulas are in [`allan`].

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde_json::json;

use crate::profile::{Torque, Written};
use crate::progress::Progress;
use crate::run::{Run, TORQUE};
use analysis::allan::{self, Estimate, Fit, Noise, Octaves, Point, Term};
use files::budget;
use host::fmu::Fmu;
use names::hubslosh::{OMEGA, OMEGA_IMU, imu};
use signals::table::Table;

const MOST_RECORDS: usize = 10_000;
/// Length of the shortest record from which a Gauss–Markov bias can be estimated, in correlation times of the
/// bias. The Allan deviation of the bias has its maximum at 1.89 correlation times, and the longest averaging
/// time is a tenth of the record.
const LEAST_TIMES: f64 = 30.0;

/// Records of a gyro to simulate. `settings` are start values by their names in the FMU, as text,
/// without `imu.enabled` and `imu.seed`.
#[derive(Clone, Debug)]
pub struct Recording {
    pub settings: Vec<(String, String)>,
    pub hours: f64,
    pub records: usize,
}

/// Specified and estimated noise of a gyro. The specified N includes the quantisation noise of `imu.lsb`,
/// lsb/√(12 rate). The specified terms are fitted to the mean of the records' Allan variances, `points`,
/// (rad/s)².
#[derive(Clone, Debug)]
pub struct Characteristics {
    pub specified: Noise,
    pub fit: Fit,
    pub points: Vec<Point>,
}

impl Recording {
    /// Simulates the records, several in parallel, and analyses them.
    ///
    /// # Errors
    /// If the hub is not at rest, the gyro has no noise, or the records are too short for its bias.
    pub fn characterise(
        &self,
        fmu: &Fmu,
        watch: &(dyn Fn(Progress) + Sync),
    ) -> Result<Characteristics> {
        ensure!(
            (1..=MOST_RECORDS).contains(&self.records),
            "{} records (allowed: 1 to {MOST_RECORDS})",
            self.records
        );
        ensure!(
            self.hours > 0.0 && self.hours.is_finite(),
            "a record must last a positive number of hours, not {}",
            self.hours
        );
        for name in [imu::ENABLED, imu::SEED] {
            ensure!(
                self.settings.iter().all(|(set, _)| set != name),
                "{name} cannot be set: the gyro is on, the records' seeds count from 1"
            );
        }
        let seconds = self.hours * 3600.0;
        let mut instance = self.run(1, 1.0, 1.0)?.initialise(fmu)?;
        let mut real = |name: &str| instance.real(name);
        let (rate, lsb) = (real(imu::RATE)?, real(imu::LSB)?);
        let specified = Noise {
            arw: real(imu::ARW)?.hypot(lsb / (12.0 * rate).sqrt()),
            flicker: real(imu::FLICKER)?,
            rrw: real(imu::RRW)?,
            ramp: 0.0,
            bias_instability: real(imu::BIAS_INSTABILITY)?,
            bias_time: real(imu::BIAS_TIME)?,
        };
        drop(instance);
        ensure!(
            !specified.terms().is_empty(),
            "the gyro has no noise: imu.arw, imu.bias_instability, imu.flicker, imu.rrw and imu.lsb are 0"
        );
        ensure!(
            specified.bias_instability == 0.0 || seconds >= LEAST_TIMES * specified.bias_time,
            "a bias of imu.bias_time = {} s needs records of {:.2} h or more, not {} h",
            specified.bias_time,
            LEAST_TIMES * specified.bias_time / 3600.0,
            self.hours
        );
        ensure!(
            (100.0..=budget::ROWS as f64).contains(&(seconds * rate)),
            "{} h at imu.rate = {rate} Hz are {:.0} samples (allowed: 100 to {})",
            self.hours,
            seconds * rate,
            budget::ROWS
        );

        let runs = (1..=self.records)
            .map(|seed| self.run(seed, 1.0 / rate, seconds))
            .collect::<Result<Vec<_>>>()?;
        let steps = runs.iter().map(|run| run.steps() as u64).sum();
        watch(Progress::Begins { runs: runs.len(), steps });
        let records: Vec<(Vec<Point>, Octaves)> =
            runs.par_iter().map(|run| record(run, fmu, watch)).collect::<Result<_>>()?;
        Characteristics::estimate(specified, &records)
    }

    fn run(&self, seed: usize, step: f64, stop: f64) -> Result<Run> {
        let ours = [(imu::ENABLED, "true".to_string()), (imu::SEED, seed.to_string())];
        let ours = ours.map(|(name, value)| (name.to_string(), value));
        let torque: Torque = format!("zero:duration={stop}").parse::<Written>()?.torque()?;
        let settings = [&self.settings[..], &ours].concat();
        Ok(Run {
            settings,
            input: Some(TORQUE.into()),
            torque,
            others: Vec::new(),
            step,
            sample: step,
            stop,
            tolerance: None,
            hold: true,
        })
    }
}

fn record(
    run: &Run,
    fmu: &Fmu,
    watch: &(dyn Fn(Progress) + Sync),
) -> Result<(Vec<Point>, Octaves)> {
    let mut instance = run.initialise(fmu)?;
    let table =
        run.drive(&mut instance, &[OMEGA, OMEGA_IMU], |steps| watch(Progress::Steps(steps)))?;
    let column = |name| table.column(name).unwrap_or_default();
    ensure!(
        column(OMEGA).iter().all(|omega| *omega == 0.0),
        "the hub is not at rest: do not set its initial state, its torques or the friction of the bearing"
    );
    let readings = column(OMEGA_IMU);
    Ok((allan::variances(run.step, readings), Octaves::from_samples(run.step, readings)))
}

impl Characteristics {
    fn estimate(specified: Noise, records: &[(Vec<Point>, Octaves)]) -> Result<Self> {
        let count = records.len() as f64;
        let points: Vec<Point> = (0..records[0].0.len())
            .map(|i| Point {
                tau: records[0].0[i].tau,
                variance: records.iter().map(|record| record.0[i].variance).sum::<f64>() / count,
            })
            .collect();
        let octaves: Vec<Octaves> = records.iter().map(|record| record.1.clone()).collect();
        let fit = Octaves::mean(&octaves).and_then(|mean| mean.fit(&specified.terms(), 0));
        let fit =
            fit.context("the gyro's readings do not change. Probably the resolution imu.lsb is larger than the noise; reduce imu.lsb")?;
        Ok(Characteristics { specified, fit, points })
    }

    /// Returns the specified parameters with their names, and their estimates where the noise has that term.
    fn quantities(&self) -> [(&'static str, f64, Option<Estimate>); 5] {
        let estimate =
            |term| self.fit.terms.iter().find(|(t, _)| *t == term).map(|(_, found)| *found);
        let Noise { arw, bias_instability, bias_time, flicker, rrw, .. } = self.specified;
        [
            ("N, rad/s/sqrt(Hz)", arw, estimate(Term::White)),
            ("B, rad/s", bias_instability, estimate(Term::Markov)),
            ("imu.bias_time, s", bias_time, self.fit.bias_time),
            ("B of flicker, rad/s", flicker, estimate(Term::Flicker)),
            ("K, rad/s/sqrt(s)", rrw, estimate(Term::Walk)),
        ]
    }

    pub fn text(&self) -> String {
        let mut text = format!(
            "{:22}{:>12}{:>12}{:>12}{:>16}\n",
            "", "specified", "estimated", "deviation", "standard error"
        );
        for (name, specified, found) in self.quantities() {
            let Some(found) = found else { continue };
            let percent = |part: f64| match part / specified * 100.0 {
                percent if percent.is_finite() => format!("{percent:.2} %"),
                _ => "-".into(),
            };
            text.push_str(&format!(
                "{name:22}{specified:>12.4e}{:>12.4e}{:>12}{:>16}\n",
                found.value,
                percent(found.value - specified),
                percent(found.error)
            ));
        }
        text
    }

    /// Returns specified and estimated values for programs; null for a term that the gyro does not have.
    pub fn json(&self) -> serde_json::Value {
        let quantity = |(name, specified, found): (&str, f64, Option<Estimate>)| {
            let [value, error, low, high] = match found {
                Some(found) => [found.value, found.error, found.low, found.high],
                None => [f64::NAN; 4],
            };
            let values = json!({
                "specified": specified, "estimated": value, "standard_error": error, "low": low, "high": high
            });
            (name.to_string(), values)
        };
        serde_json::Value::Object(self.quantities().into_iter().map(quantity).collect())
    }

    /// Returns the Allan deviations of the records, of the specified and of the fitted noise.
    pub fn table(&self) -> Table {
        let deviation = |variance: &dyn Fn(&Point) -> f64| -> Vec<f64> {
            self.points.iter().map(|point| variance(point).sqrt()).collect()
        };
        Table::of([
            ("tau_s", self.points.iter().map(|point| point.tau).collect()),
            ("deviation", deviation(&|point| point.variance)),
            ("specified", deviation(&|point| self.specified.variance(point.tau))),
            ("estimated", deviation(&|point| self.fit.noise.variance(point.tau))),
        ])
    }
}

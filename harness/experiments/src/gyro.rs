//! Tests the simulated gyro as on a bench: hours at rest, the Allan deviation, and its estimated
//! noise compared with the specified one. [`allan`] has the formulas.

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde_json::json;

use crate::profile::{Torque, Written};
use crate::progress::Progress;
use crate::run::{Run, TORQUE};
use analysis::allan::{self, Noise, Point};
use files::budget;
use host::fmu::Fmu;
use names::hubslosh::{OMEGA, OMEGA_IMU, imu};
use signals::table::Table;

/// Smallest number of records for a standard error from their scatter; that of four is uncertain by
/// 40 %.
const LEAST_RECORDS: usize = 4;
/// Largest number of records; more would take days.
const MOST_RECORDS: usize = 10_000;
/// Shortest record in correlation times of the bias, so that the maximum (at 1.89) is visible. The
/// longest averaging time is a tenth of the record.
const LEAST_TIMES: f64 = 30.0;

/// A recording to simulate.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Start values by FMU name, as text; not `imu.enabled` and `imu.seed`.
    pub settings: Vec<(String, String)>,
    /// Length of a record, h.
    pub hours: f64,
    /// Number of records; their `imu.seed` counts from 1.
    pub records: usize,
}

/// Specified and estimated noise.
#[derive(Clone, Debug)]
pub struct Characteristics {
    /// Specified noise; N includes the quantisation noise of `imu.lsb`, lsb/√(12 rate).
    pub specified: Noise,
    /// Noise estimated from the mean of the records' Allan variances.
    pub estimated: Noise,
    /// Standard errors of `estimated`, from the scatter of the single records; NaN if fewer than
    /// [`LEAST_RECORDS`] can be fitted.
    pub error: Noise,
    /// The mean of the records' Allan variances, (rad/s)².
    pub points: Vec<Point>,
}

impl Recording {
    /// Simulates the records, several in parallel, and analyses them. Fails if the hub does not
    /// rest, if the gyro has no noise, or if the records are too short for its bias.
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
            bias_instability: real(imu::BIAS_INSTABILITY)?,
            bias_time: real(imu::BIAS_TIME)?,
        };
        drop(instance);
        ensure!(
            specified.arw > 0.0 || specified.bias_instability > 0.0,
            "the gyro has no noise: imu.arw, imu.bias_instability and imu.lsb are 0"
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
        let records: Vec<Vec<Point>> =
            runs.par_iter().map(|run| record(run, fmu, watch)).collect::<Result<_>>()?;
        Characteristics::of(specified, &records)
    }

    /// Returns one record, sampled at the gyro's own instants.
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
            stop,
            tolerance: None,
            hold: true,
        })
    }
}

/// Returns the Allan variances of one record.
fn record(run: &Run, fmu: &Fmu, watch: &(dyn Fn(Progress) + Sync)) -> Result<Vec<Point>> {
    let mut instance = run.initialise(fmu)?;
    let table =
        run.drive(&mut instance, &[OMEGA, OMEGA_IMU], |steps| watch(Progress::Steps(steps)))?;
    let column = |name| table.column(name).unwrap_or_default();
    ensure!(
        column(OMEGA).iter().all(|omega| *omega == 0.0),
        "the hub does not rest: leave its start, its torques and the friction of the bearing alone"
    );
    Ok(allan::variances(run.step, column(OMEGA_IMU)))
}

impl Characteristics {
    fn of(specified: Noise, records: &[Vec<Point>]) -> Result<Self> {
        let count = records.len() as f64;
        let points: Vec<Point> = (0..records[0].len())
            .map(|i| Point {
                tau: records[0][i].tau,
                variance: records.iter().map(|record| record[i].variance).sum::<f64>() / count,
            })
            .collect();
        let why = "the gyro's readings do not change; is imu.lsb larger than its noise?";
        let estimated = Noise::fitted(&points).context(why)?;
        let each: Vec<Noise> = records.iter().filter_map(|record| Noise::fitted(record)).collect();
        let error = |of: fn(&Noise) -> f64| {
            if each.len() < LEAST_RECORDS {
                return f64::NAN;
            }
            let count = each.len() as f64;
            let mean = each.iter().map(of).sum::<f64>() / count;
            let squares: f64 = each.iter().map(|noise| (of(noise) - mean).powi(2)).sum();
            (squares / (count - 1.0) / count).sqrt()
        };
        let error = Noise {
            arw: error(|noise| noise.arw),
            bias_instability: error(|noise| noise.bias_instability),
            bias_time: error(|noise| noise.bias_time),
        };
        Ok(Characteristics { specified, estimated, error, points })
    }

    /// Returns specified and estimated values as lines of text.
    pub fn text(&self) -> String {
        let mut text = format!(
            "{:22}{:>12}{:>12}{:>12}{:>16}\n",
            "", "specified", "estimated", "deviation", "standard error"
        );
        for (name, of) in QUANTITIES {
            let (specified, estimated, error) =
                (of(&self.specified), of(&self.estimated), of(&self.error));
            let percent = |part: f64| match part / specified * 100.0 {
                percent if percent.is_finite() => format!("{percent:.2} %"),
                _ => "-".into(),
            };
            text.push_str(&format!(
                "{name:22}{specified:>12.4e}{estimated:>12.4e}{:>12}{:>16}\n",
                percent(estimated - specified),
                percent(error)
            ));
        }
        text
    }

    /// Returns specified and estimated values for programs; null for a non-finite number.
    pub fn json(&self) -> serde_json::Value {
        let quantity = |(name, of): &Quantity| {
            let (specified, estimated, error) =
                (of(&self.specified), of(&self.estimated), of(&self.error));
            let values =
                json!({ "specified": specified, "estimated": estimated, "standard_error": error });
            (name.to_string(), values)
        };
        serde_json::Value::Object(QUANTITIES.iter().map(quantity).collect())
    }

    /// Returns the Allan deviations of the records, of the specified and of the fitted noise.
    pub fn table(&self) -> Table {
        let deviation = |of: &dyn Fn(&Point) -> f64| -> Vec<f64> {
            self.points.iter().map(|point| of(point).sqrt()).collect()
        };
        let columns = vec![
            self.points.iter().map(|point| point.tau).collect(),
            deviation(&|point| point.variance),
            deviation(&|point| self.specified.variance(point.tau)),
            deviation(&|point| self.estimated.variance(point.tau)),
        ];
        Table::new(
            ["tau_s", "deviation", "specified", "estimated"].map(String::from).to_vec(),
            columns,
        )
    }
}

/// A parameter of the noise by its name and unit.
type Quantity = (&'static str, fn(&Noise) -> f64);

/// Quantities in the table.
const QUANTITIES: [Quantity; 3] = [
    ("N, rad/s/sqrt(Hz)", |noise| noise.arw),
    ("B, rad/s", |noise| noise.bias_instability),
    ("imu.bias_time, s", |noise| noise.bias_time),
];

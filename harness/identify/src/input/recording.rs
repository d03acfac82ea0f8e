//! A recording of a bench: torque command and hub rate over time, in SI units.
//!
//! A recording is not resampled: the FMU is stepped exactly to the instants of the rows. Signals may have different sampling
//! clocks: a row without a value of a sensor is not compared with this sensor, but still drives the FMU
//! ([`crate::input::clocks`]). [`crate::input::reading`] reads recordings from files.

use std::borrow::Cow;

use analysis::statistics::{mean, noise_level};
use anyhow::{Context, Result, bail, ensure};
use files::budget;

use crate::input::clocks::{completed, interpolated_at, usual};
use crate::tuning::{LARGEST_VALUE, ON_CLOCK, SLOW_GYRO, SLOWEST_GYRO};

#[derive(Clone, Debug)]
pub struct Recording {
    pub name: String,
    pub time: Vec<f64>,
    /// Torque command, N·m.
    pub torque: Vec<f64>,
    /// Hub rate as measured, rad/s.
    pub rate: Vec<f64>,
    /// Hub angle from an encoder, rad, if it was recorded. It is fitted together with the rate.
    pub angle: Option<Vec<f64>>,
    /// Specific force along the tank's axis, m/s², if it was recorded. It is an input of the model like the torque.
    pub gravity: Option<Vec<f64>>,
    /// Speed of the reaction wheel, rad/s. It shows whether the wheel gave the commanded torque.
    pub wheel_speed: Option<Vec<f64>>,
    /// Rates about the hub's x and y axes, rad/s. The model turns only about the z axis.
    pub off_axis: [Option<Vec<f64>>; 2],
    /// True if the recording begins at rest; otherwise the initial state is unknown.
    pub from_rest: bool,
    /// True for rows in which the gyro has a new value without a sensor fault. Only these rows are fitted. `None`: all rows.
    pub fresh: Option<Vec<bool>>,
    /// True for rows in which the encoder has a new value without a sensor fault. `None`: all rows.
    pub angle_fresh: Option<Vec<bool>>,
    /// True for rows in which the torque was recorded. In the other rows it is interpolated. `None`: all rows.
    pub commanded: Option<Vec<bool>>,
}

#[derive(Clone, Copy, Debug)]
pub struct Row {
    pub time: f64,
    /// Index of this row in the original recording; `None` for an added row.
    pub own: Option<usize>,
    /// Value for a missing torque in this row, N·m.
    pub filled: Option<f64>,
}

pub(crate) fn masked(values: &[f64], mask: Option<&[bool]>) -> Vec<f64> {
    match mask {
        None => values.to_vec(),
        Some(mask) => values.iter().zip(mask).filter(|(_, new)| **new).map(|(v, _)| *v).collect(),
    }
}

pub(crate) fn places(mask: &Option<Vec<bool>>, rows: usize) -> Vec<usize> {
    (0..rows).filter(|k| mask.as_ref().is_none_or(|mask| mask[*k])).collect()
}

pub(crate) fn take_out(mask: &mut Option<Vec<bool>>, row: usize, rows: usize) {
    mask.get_or_insert_with(|| vec![true; rows])[row] = false;
}

impl Recording {
    pub fn duration(&self) -> f64 {
        self.time[self.time.len() - 1] - self.time[0]
    }

    pub fn step(&self) -> f64 {
        self.duration() / (self.time.len() - 1) as f64
    }

    fn mapped(
        &self,
        of: impl Fn(&Vec<f64>) -> Vec<f64>,
        mask: impl Fn(&Vec<bool>) -> Option<Vec<bool>>,
    ) -> Recording {
        let mask = |rows: &Option<Vec<bool>>| rows.as_ref().and_then(&mask);
        Recording {
            angle: self.angle.as_ref().map(&of),
            gravity: self.gravity.as_ref().map(&of),
            wheel_speed: self.wheel_speed.as_ref().map(&of),
            off_axis: [0, 1].map(|axis| self.off_axis[axis].as_ref().map(&of)),
            from_rest: self.from_rest,
            fresh: mask(&self.fresh),
            angle_fresh: mask(&self.angle_fresh),
            commanded: mask(&self.commanded),
            ..Recording::of(&self.name, of(&self.time), of(&self.torque), of(&self.rate))
        }
    }

    /// Returns the rows `from..to` as a recording. Its initial state is unknown, because it begins in the middle of a motion.
    pub fn rows(&self, from: usize, to: usize) -> Recording {
        let part = self.mapped(|x| x[from..to].to_vec(), |mask| Some(mask[from..to].to_vec()));
        Recording { from_rest: false, ..part }
    }

    pub fn commands(&self) -> Vec<usize> {
        places(&self.commanded, self.time.len())
    }

    pub fn torque_step(&self) -> f64 {
        let time = masked(&self.time, self.commanded.as_deref());
        (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64
    }

    /// Returns the recording at these rows. Signals without a value in a row are interpolated there.
    pub fn with_rows(&self, rows: &[Row]) -> Recording {
        let time: Vec<f64> = rows.iter().map(|row| row.time).collect();
        let of = |values: &[f64], mask: Option<&[bool]>| {
            let value = |row: &Row| {
                let own = row.own.filter(|k| mask.is_none_or(|mask| mask[*k]));
                own.map_or(f64::NAN, |k| values[k])
            };
            completed(&time, rows.iter().map(value).collect())
        };
        let (own, _) = of(&self.torque, self.commanded.as_deref());
        let torque = rows.iter().zip(own).map(|(row, own)| row.filled.unwrap_or(own)).collect();
        let is_own = |k: usize| self.commanded.as_ref().is_none_or(|commanded| commanded[k]);
        let commanded: Vec<bool> =
            rows.iter().map(|row| row.filled.is_some() || row.own.is_some_and(is_own)).collect();
        let (rate, fresh) = of(&self.rate, self.fresh.as_deref());
        let angle = self.angle.as_ref().map(|angle| of(angle, self.angle_fresh.as_deref()));
        let (angle, angle_fresh) = angle.unzip();
        Recording {
            torque,
            rate,
            angle,
            fresh,
            angle_fresh: angle_fresh.flatten(),
            commanded: commanded.contains(&false).then_some(commanded),
            time: time.clone(),
            ..self.mapped(|values| of(values, None).0, |_| None)
        }
    }

    pub fn of_fresh(&self, values: &[f64]) -> Vec<f64> {
        masked(values, self.fresh.as_deref())
    }

    pub fn of_fresh_angle(&self, values: &[f64]) -> Vec<f64> {
        masked(values, self.angle_fresh.as_deref())
    }

    /// Returns the mean of the gyro's first two values, rad/s.
    pub fn first_rate(&self) -> f64 {
        let first: Vec<f64> = self.of_fresh(&self.rate).into_iter().take(2).collect();
        mean(&first)
    }

    pub fn rate_noise(&self) -> f64 {
        noise_level(&self.of_fresh(&self.rate))
    }

    /// Creates a recording that has only torque and rate, and begins at rest.
    pub fn of(name: &str, time: Vec<f64>, torque: Vec<f64>, rate: Vec<f64>) -> Self {
        Recording {
            name: name.into(),
            time,
            torque,
            rate,
            angle: None,
            gravity: None,
            wheel_speed: None,
            off_axis: [None, None],
            from_rest: true,
            fresh: None,
            angle_fresh: None,
            commanded: None,
        }
    }

    /// Finds the rows with new values of a gyro that is slower than the recording, and marks them. Returns false if the gyro has
    /// a new value in every row.
    pub(crate) fn with_repeats(&mut self) -> bool {
        let Some(new) = fresh(&self.of_fresh(&self.rate)) else { return false };
        let rows = self.time.len();
        let places = places(&self.fresh, rows);
        for (k, _) in new.iter().enumerate().filter(|(_, new)| !**new) {
            take_out(&mut self.fresh, places[k], rows);
        }
        true
    }

    pub fn between(&self, from: f64, to: f64) -> Recording {
        let first = self.time.partition_point(|t| *t < from);
        let last = self.time.partition_point(|t| *t <= to);
        self.rows(first, last.max(first))
    }

    pub fn beginning(&self, fraction: f64) -> Recording {
        let rows = ((self.time.len() as f64 * fraction) as usize).max(2);
        self.first_rows(rows.min(self.time.len()))
    }

    /// Returns a recording of the first `rows` rows. It begins at rest if this recording does.
    pub(crate) fn first_rows(&self, rows: usize) -> Recording {
        Recording { from_rest: self.from_rest, ..self.rows(0, rows) }
    }

    /// Checks times and values. Returns the usual step from row to row, s.
    ///
    /// # Errors
    /// If times or values are out of range.
    pub fn check(&self) -> Result<f64> {
        let of_file = || format!("the recording {} cannot be used", self.name);
        ensure!(
            self.time.len() > 2,
            "the recording {} has {} rows (allowed: at least 3)",
            self.name,
            self.time.len()
        );
        let step = check_times(&self.time).with_context(of_file)?;
        let signals = [
            ("tau_cmd", Some(&self.torque)),
            ("omega", Some(&self.rate)),
            ("theta", self.angle.as_ref()),
            ("g_axial", self.gravity.as_ref()),
            ("wheel_speed", self.wheel_speed.as_ref()),
            ("omega_x", self.off_axis[0].as_ref()),
            ("omega_y", self.off_axis[1].as_ref()),
        ];
        for (name, signal) in signals {
            check_values(name, signal.into_iter().flatten().copied()).with_context(of_file)?;
        }
        Ok(step)
    }

    /// Returns the mean step (s), and torque and rate interpolated linearly onto an even grid with this step, for spectra.
    ///
    /// # Errors
    /// If times or values are out of range.
    pub fn even(&self) -> Result<(f64, Vec<f64>, Vec<f64>)> {
        self.of_gyro().even_rows()
    }

    /// Returns only the rows with a new value of the gyro if the gyro is slower than the recording; otherwise all rows.
    pub fn of_gyro(&self) -> Cow<'_, Recording> {
        let rows = places(&self.fresh, self.time.len());
        if rows.len() as f64 > SLOW_GYRO * self.time.len() as f64 || rows.len() < 3 {
            return Cow::Borrowed(self);
        }
        Cow::Owned(self.mapped(|x| rows.iter().map(|k| x[*k]).collect(), |_| None))
    }

    pub(crate) fn even_rows(&self) -> Result<(f64, Vec<f64>, Vec<f64>)> {
        self.check()?;
        let step = self.step();
        let at = |signal: &[f64]| -> Vec<f64> {
            let (mut row, times) =
                (0, (0..self.time.len()).map(|k| self.time[0] + k as f64 * step));
            times.map(|t| interpolated_at(&self.time, signal, t, &mut row)).collect()
        };
        Ok((step, at(&self.torque), at(&self.rate)))
    }
}

/// Fails unless times are finite and increasing, and their range is a reasonable number of usual steps. Returns
/// the usual step, s.
pub fn check_times(time: &[f64]) -> Result<f64> {
    ensure!(time.len() > 1, "there are {} rows (allowed: at least 2)", time.len());
    if let Some(row) = time.iter().position(|t| !t.is_finite()) {
        bail!("row {}: time is {}", row + 1, time[row]);
    }
    if let Some(row) = time.windows(2).position(|pair| pair[1] <= pair[0]) {
        bail!("row {}: time must grow, but {} s follows {} s", row + 2, time[row + 1], time[row]);
    }
    let step = usual(time);
    budget::steps(time[time.len() - 1] - time[0], step).context("times of the rows")?;
    Ok(step)
}

/// Fails if a value is not a number within ±[`LARGEST_VALUE`].
pub fn check_values(name: &str, values: impl Iterator<Item = f64>) -> Result<()> {
    for (row, value) in values.enumerate() {
        ensure!(
            value.abs() <= LARGEST_VALUE,
            "row {}: {name} is {value:e} (allowed: up to {LARGEST_VALUE:e})",
            row + 1
        );
    }
    Ok(())
}

/// Returns the rows with a new value if the rows between them only repeat values, as with a gyro that is slower than the
/// recording. A gyro with a coarse resolution may repeat values by chance; then only changes in every n-th row count as a slower
/// clock. If the resolution is fine, so that two values are seldom equal, every repeated value counts.
pub fn fresh(rate: &[f64]) -> Option<Vec<bool>> {
    let changes: Vec<usize> = (1..rate.len()).filter(|&k| rate[k] != rate[k - 1]).collect();
    if changes.len() < 10 || changes.len() > 9 * rate.len() / 10 {
        return None;
    }
    for n in (2..=SLOWEST_GYRO.min(rate.len() / 10)).rev() {
        let mut hits = vec![0; n];
        changes.iter().for_each(|k| hits[k % n] += 1);
        let (phase, most) = hits.iter().enumerate().max_by_key(|(_, count)| **count)?;
        if *most as f64 > ON_CLOCK * changes.len() as f64 {
            return Some((0..rate.len()).map(|k| k % n == phase).collect());
        }
    }
    let mut values: Vec<f64> = changes.iter().map(|&k| rate[k]).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    let fine = values.len() > 9 * changes.len() / 10;
    fine.then(|| (0..rate.len()).map(|k| k == 0 || rate[k] != rate[k - 1]).collect())
}

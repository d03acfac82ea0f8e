//! Reads a recording as a run: on an evenly spaced grid, from the beginning of the torque to its end.

use std::f64::consts::TAU;
use std::path::Path;

use analysis::Complex64;
use analysis::sweep::Sweep;
use anyhow::{Context, Result, ensure};
use files::budget;
use fourier::{Forward, Inverse};
use nalgebra::{DMatrix, DVector};
use signals::recording::{self, Between, Signal, Wanted, even_with_gaps};
use signals::table::Table;

use crate::plan::{Case, Recorded};
use crate::profile::Torque;

/// Signals that are read from a recording. Rows without a rate about the hub's axis (`omega`) are left out; missing
/// values of the other signals are interpolated linearly.
const SIGNALS: [Signal; 4] = [
    Signal { name: "omega", required: true, between: Between::Line, unit: None },
    Signal { name: "tau_cmd", required: true, between: Between::Line, unit: None },
    Signal { name: "omega_x", required: false, between: Between::Line, unit: None },
    Signal { name: "omega_y", required: false, between: Between::Line, unit: None },
];

/// Smallest correlation coefficient of the recorded torque and the plan's torque at which a recording is accepted.
const LEAST_CORRELATION: f64 = 0.9;
/// Largest fraction of the run that may be missing at the ends of the recording.
const MISSING: f64 = 0.5;
/// Largest fraction of a sweep's time that may be in gaps of the recording. In gaps torque and rate are both interpolated
/// linearly, which hardly changes their ratio. A record that lost 3 % of its rows one by one has 6 % of its time in gaps.
const GAPS: f64 = 0.15;
/// Largest relative difference between the rates of the recorder's clock and of the clock that generated the torque.
const FASTEST_CLOCK: f64 = 2e-3;
/// Shift of the recorded torque relative to the sweep at the end of a record, in cycles, above which the times are
/// corrected. A wrong clock causes such a shift.
const SHIFT: f64 = 0.02;
/// Length of a block, in cycles of the sweep. In each block the phase of the record is compared with the
/// phase of the sweep.
const BLOCK_CYCLES: f64 = 6.0;
/// Number of iterations in which the error of the recorder's clock is estimated.
const ROUNDS: usize = 3;

/// Reads a recording, and resamples it onto an evenly spaced grid. Returns the step of the grid, s, and the table.
///
/// # Errors
/// If the recording cannot be used.
pub fn read(recorded: &Recorded, done: &mut dyn FnMut(String)) -> Result<(f64, Table)> {
    let name = recorded.path.display().to_string();
    let table = recording::read(
        &recorded.path,
        &Wanted { signals: &SIGNALS, columns: &recorded.columns },
        done,
    )?;
    even_with_gaps(table, GAPS, &mut |words| done(format!("{name}: {words}")))
        .with_context(|| format!("the recording {name} cannot be used"))
}

/// Checks that the rows of a recording, `step` s apart, are dense enough for the torque.
///
/// # Errors
/// If the torque has frequencies of at least half of the sampling rate.
pub fn check_rows(path: &Path, step: f64, torque: &Torque) -> Result<()> {
    let Some(profile) = torque.profile() else { return Ok(()) };
    let highest = profile.band().map_or(0.0, |band| band.1);
    ensure!(
        step * highest < 0.5,
        "{}: the rows are {step:.3e} s apart, and {profile} goes to {highest} Hz (allowed: less than {:.3e} s). Is the time in \
         another unit? --columns time=COLUMN:UNIT states it",
        path.display(),
        0.5 / highest
    );
    Ok(())
}

/// Reads the recording of a run. Returns the time between rows, s, and a table whose time is 0 at the beginning of
/// the torque. This beginning is found by correlation of the recorded torque with the plan's torque. The table has
/// those columns of a stored run that the recording contains.
///
/// # Errors
/// If the recording cannot be used, or has another torque.
pub(super) fn table(
    case: &Case,
    recorded: &Recorded,
    done: &mut dyn FnMut(String),
) -> Result<(f64, Table)> {
    let name = recorded.path.display();
    let (step, table) = read(recorded, done)?;
    let column = |name: &str| table.column(name).unwrap_or_default();
    let (time, torque) = (column("time"), column("tau_cmd"));
    let (from, to) = case.torque.span();
    let to = to.min(case.stop);
    let clock = match case.torque.profile().and_then(|profile| profile.sweep()) {
        Some(sweep) => {
            check_rows(&recorded.path, step, &case.torque)?;
            budget::table(budget::steps(to - from, step).with_context(|| name.to_string())?, 4)?;
            let sought = Sought { step, span: (from, to), sweep };
            let (clock, correlation) = sought.align(torque);
            ensure!(
                !sought.is_reversed(torque, (clock, correlation)),
                "{name}: its torque is {} with the opposite sign. Correct the sign in the logger, or change the sign of the amplitude in the plan",
                case.profile
            );
            ensure!(
                correlation > LEAST_CORRELATION,
                "{name}: the recorded torque is not {} (correlation {correlation:.2}; allowed: at least {LEAST_CORRELATION}, with a clock \
                 that is up to {} ppm off). The bench was driven with another profile, duration or frequency band, or the times are in another unit",
                case.profile,
                1e6 * FASTEST_CLOCK
            );
            clock
        }
        // the phase of random noise in the recording is unknown, so that its torque cannot be found by correlation
        None => Clock { first: 0.0, rate: 0.0 },
    };
    let Clock { first, rate } = clock;
    if first != 0.0 {
        done(format!(
            "{name}: the torque begins at {:.2} s of the recording",
            time[0] + first * step
        ));
    }
    if rate != 0.0 {
        done(format!(
            "{name}: its clock runs {:+.0} ppm against the clock of the torque; times are converted to the clock of the torque, so that frequencies are \
             those of the plan",
            1e6 * rate
        ));
    }
    let (recorded_step, step) = (step, step / (1.0 + rate));
    let rows: Vec<usize> = (0..time.len())
        .filter(|k| {
            let t = from + (*k as f64 - first) * step;
            t > from - 0.5 * step && t < to + 0.5 * step
        })
        .collect();
    let seconds = rows.len() as f64 * step;
    ensure!(
        seconds > (1.0 - MISSING) * (to - from),
        "{name}: it contains {seconds:.0} s of {}, which lasts {:.0} s (allowed: at least {:.0} %)",
        case.profile,
        to - from,
        100.0 * (1.0 - MISSING)
    );
    // times that already count from the beginning of the torque are not changed
    let origin = time[0] + first * recorded_step - from;
    let origin = if origin.abs() < 1e-9 { 0.0 } else { origin };
    let cut = |values: &[f64]| rows.iter().map(|k| values[*k]).collect::<Vec<f64>>();
    let times = match rate == 0.0 {
        true => cut(time).iter().map(|t| t - origin).collect(),
        false => rows.iter().map(|k| from + (*k as f64 - first) * step).collect(),
    };
    let mut columns = vec![
        ("time", times),
        ("tau_cmd", cut(torque)),
        ("omega", cut(column("omega"))),
        ("omega_imu", cut(column("omega"))),
    ];
    for rate in ["omega_x", "omega_y"] {
        columns.extend(table.column(rate).map(|values| (rate, cut(values))));
    }
    // a step that equals the plan's step within rounding is set to the plan's step
    let step = if (step / case.step - 1.0).abs() < 1e-6 { case.step } else { step };
    Ok((step, Table::of(columns)))
}

/// Relation between the recorder's clock and the clock of the torque command. `first` is the row of the recording at
/// which the torque begins (it may be before the first row or between two rows), and 1 + `rate` recorded seconds are one
/// second of the torque.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Clock {
    first: f64,
    rate: f64,
}

/// A sweep to be found in a record whose rows are `step` s apart. `span` is the first and last time of the sweep, s.
struct Sought<'t> {
    step: f64,
    span: (f64, f64),
    sweep: &'t Sweep,
}

impl Sought<'_> {
    /// Finds the sweep in a record. Returns the recorder's clock, and the correlation coefficient of record and
    /// sweep with this clock.
    ///
    /// An error of the clock of 50 ppm shifts the end of a sweep of 2700 s by half a cycle, so that the whole sweep does
    /// not correlate with the record. Therefore the phase of the record relative to the sweep is measured in blocks and
    /// unwrapped. It is 2π f(t) (α + β t) + 2π n, which determines the error α of the start, the error β of the clock's
    /// rate, and the number n of whole cycles.
    fn align(&self, record: &[f64]) -> (Clock, f64) {
        let (from, to) = self.span;
        let count = ((to - from) / self.step).round() as usize;
        let wanted: Vec<f64> =
            (0..=count).map(|k| self.sweep.torque(from + k as f64 * self.step)).collect();
        let (lag, correlation) = aligned(record, &wanted);
        let whole = Clock { first: lag as f64, rate: 0.0 };
        let mut clock = whole;
        for _ in 0..ROUNDS {
            clock = self.refined(record, clock).unwrap_or(clock);
        }
        let cycles = (self.sweep.phase(to) - self.sweep.phase(from)).abs() / TAU;
        let is_same = correlation > LEAST_CORRELATION && cycles * clock.rate.abs() < SHIFT;
        if is_same || clock.rate.abs() > FASTEST_CLOCK {
            return (whole, correlation);
        }
        let found = self.correlation(record, clock);
        if found > correlation { (clock, found) } else { (whole, correlation) }
    }

    /// Returns true if the record fits the sweep with the opposite sign better than the sweep itself. A wrong sign
    /// looks like a shift by half a cycle, which a wrong `clock` can compensate with a `correlation` above 0.9.
    /// Therefore a clock is also fitted for the opposite sign before the two correlations are compared.
    fn is_reversed(&self, record: &[f64], (clock, correlation): (Clock, f64)) -> bool {
        let is_plain = clock.rate == 0.0 && correlation > LEAST_CORRELATION;
        let reversed: Vec<f64> = record.iter().map(|tau| -tau).collect();
        !is_plain && self.align(&reversed).1 > correlation.max(LEAST_CORRELATION)
    }

    fn time(&self, clock: Clock, row: usize) -> f64 {
        self.span.0 + (row as f64 - clock.first) * self.step / (1.0 + clock.rate)
    }

    fn correlation(&self, record: &[f64], clock: Clock) -> f64 {
        let (mut product, mut squares, mut others) = (0.0, 0.0, 0.0);
        for (row, recorded) in record.iter().enumerate() {
            let t = self.time(clock, row);
            if (self.span.0..=self.span.1).contains(&t) {
                let value = self.sweep.torque(t);
                product += value * recorded;
                squares += value * value;
                others += recorded * recorded;
            }
        }
        product / f64::sqrt(squares * others)
    }

    /// Improves an approximate `clock`. The record is divided into blocks, and in each block its phase is compared
    /// with the phase of the sweep. Least squares over all blocks then give the beginning and the rate of the
    /// recorder's clock. Returns `None` if the blocks do not determine them.
    fn refined(&self, record: &[f64], clock: Clock) -> Option<Clock> {
        let (from, to) = self.span;
        let rows = (BLOCK_CYCLES / self.sweep.band().0 / self.step).ceil() as usize;
        let (mut equations, mut last) = (Vec::new(), None);
        for (block, values) in record.chunks_exact(rows).enumerate() {
            let row = block * rows;
            let (begin, end) = (self.time(clock, row), self.time(clock, row + rows));
            if begin < from || end > to {
                continue;
            }
            let mut sum = Complex64::default();
            for (k, value) in values.iter().enumerate() {
                let window = 1.0 - (TAU * (k as f64 + 0.5) / rows as f64).cos();
                let phase = self.sweep.phase(self.time(clock, row + k));
                sum += window * value * Complex64::cis(-phase);
            }
            // a sine lags behind the cosine with the same phase angle by a quarter of a turn
            let angle = (sum * self.sweep.amplitude.signum()).arg() / TAU + 0.25;
            let unwrapped = last.map_or(angle, |last: f64| angle - (angle - last).round());
            last = Some(unwrapped);
            let middle = 0.5 * (begin + end);
            let frequency = (self.sweep.phase(end) - self.sweep.phase(begin)) / TAU / (end - begin);
            equations.push([frequency, frequency * middle, 1.0, unwrapped]);
        }
        let columns = |n: usize| DMatrix::from_fn(equations.len(), n, |row, k| equations[row][k]);
        let solve = |n: usize, right: &dyn Fn(&[f64; 4]) -> f64| {
            let right = DVector::from_iterator(equations.len(), equations.iter().map(right));
            columns(n).svd(true, true).solve(&right, 1e-12).ok()
        };
        if equations.len() < 4 {
            return None;
        }
        let cycles = solve(3, &|equation| equation[3])?[2].round();
        let found = solve(2, &|equation| equation[3] - cycles)?;
        let (alpha, beta) = (found[0], found[1]);
        let first =
            clock.first + ((from - alpha) / (1.0 + beta) - from) * (1.0 + clock.rate) / self.step;
        Some(Clock { first, rate: (1.0 + clock.rate) / (1.0 + beta) - 1.0 })
    }
}

/// Finds the signal `wanted` in a record by correlation. Returns the row of the record at which it begins, possibly before
/// the first row, and the correlation coefficient in the rows where they overlap.
fn aligned(record: &[f64], wanted: &[f64]) -> (i64, f64) {
    let length = (record.len() + wanted.len()).next_power_of_two();
    let forward = Forward::new(length);
    let spectrum = |signal: &[f64]| {
        let mut padded = signal.to_vec();
        padded.resize(length, 0.0);
        forward.transform(padded)
    };
    let product =
        spectrum(record).iter().zip(&spectrum(wanted)).map(|(a, b)| a * b.conj()).collect();
    let sums = Inverse::new(length).transform(product);
    let best = (0..length).max_by(|a, b| sums[*a].total_cmp(&sums[*b])).unwrap_or(0);
    let lag = if best < record.len() { best as i64 } else { best as i64 - length as i64 };
    let (mut product, mut squares, mut others) = (0.0, 0.0, 0.0);
    for (k, value) in wanted.iter().enumerate() {
        let Some(recorded) = usize::try_from(k as i64 + lag).ok().and_then(|k| record.get(k))
        else {
            continue;
        };
        product += value * recorded;
        squares += value * value;
        others += recorded * recorded;
    }
    (lag, product / (squares * others).sqrt())
}

#[cfg(test)]
mod tests {
    use super::{Clock, LEAST_CORRELATION, Sought, aligned};
    use analysis::sweep::Sweep;

    /// The recording begins 300 rows before the sweep, or 400 rows after the sweep's beginning.
    #[test]
    fn a_sweep_is_found_in_a_record_that_begins_before_or_within_it() {
        let sweep = Sweep { duration: 100.0, ..Sweep::THESIS };
        let wanted: Vec<f64> = (0..=5000).map(|k| sweep.torque(0.02 * f64::from(k))).collect();
        let mut late = vec![0.0; 300];
        late.extend(&wanted);
        late.extend([0.0; 70]);
        let (lag, correlation) = aligned(&late, &wanted);
        assert!(lag == 300 && correlation > 0.999_999, "{lag} {correlation}");
        let (lag, correlation) = aligned(&wanted[400..], &wanted);
        assert!(lag == -400 && correlation > 0.999_999, "{lag} {correlation}");
        let found =
            |record: &[f64]| Sought { step: 0.02, span: (0.0, 100.0), sweep: &sweep }.align(record);
        // if both clocks are equal, times are not corrected
        assert_eq!(found(&late).0, Clock { first: 300.0, rate: 0.0 });
        let reversed: Vec<f64> = wanted.iter().rev().copied().collect();
        assert!(aligned(&reversed, &wanted).1 < 0.9);
    }

    #[test]
    fn a_sweep_is_found_despite_clock_errors_and_lost_rows() {
        let sweep = Sweep::THESIS;
        let sought = Sought { step: 0.02, span: (0.0, 2700.0), sweep: &sweep };
        for (rate, begins) in [(5e-5, 5.13), (-3e-4, 5.13), (1e-3, 0.0), (3e-4, -400.0)] {
            // times of the sweep by the recorder's clock; 3 % of the rows are interpolated linearly
            let at = |k: usize| {
                let t = (0.02 * k as f64 - begins) / (1.0 + rate);
                if (0.0..2700.0).contains(&t) { sweep.torque(t) } else { 0.0 }
            };
            let is_lost = |k: usize| k * 7919 % 100 < 3;
            let record: Vec<f64> = (0..135_900)
                .map(|k| if is_lost(k) { 0.5 * (at(k.max(1) - 1) + at(k + 1)) } else { at(k) })
                .collect();
            let (clock, correlation) = sought.align(&record);
            assert!(correlation > 0.99, "{rate} {clock:?} {correlation}");
            // one ppm of 2700 s is 2.7 ms, a hundredth of a cycle
            assert!((clock.rate - rate).abs() < 1e-6, "{rate} {clock:?}");
            assert!((clock.first - begins / 0.02).abs() < 0.2, "{rate} {clock:?}");
            let reversed: Vec<f64> = record.iter().map(|tau| -tau).collect();
            assert!(!sought.is_reversed(&record, (clock, correlation)));
            assert!(sought.is_reversed(&reversed, sought.align(&reversed)), "{rate}");
        }
        let other = Sweep { duration: 2600.0, ..sweep };
        let record: Vec<f64> = (0..135_000).map(|k| other.torque(0.02 * f64::from(k))).collect();
        assert!(sought.align(&record).1 < LEAST_CORRELATION);
    }
}

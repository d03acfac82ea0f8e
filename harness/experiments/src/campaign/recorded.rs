//! Reads a recording as a run: on an equally spaced grid, from the torque's beginning to its end.

use anyhow::{Context, Result, ensure};
use files::budget;
use signals::fourier::{Forward, Inverse};
use signals::recording::{self, Between, Signal, Wanted, even};
use signals::table::Table;

use crate::plan::{Case, Recorded};
use crate::profile::Torque;

/// Signals read from a recording: the rate defines the rows; torque and rates about the other axes are interpolated linearly.
const SIGNALS: [Signal; 4] = [
    Signal { name: "omega", required: true, between: Between::Line, unit: None },
    Signal { name: "tau_cmd", required: true, between: Between::Line, unit: None },
    Signal { name: "omega_x", required: false, between: Between::Line, unit: None },
    Signal { name: "omega_y", required: false, between: Between::Line, unit: None },
];

/// Smallest correlation of the recorded torque with the torque of the plan.
const LEAST_CORRELATION: f64 = 0.9;
/// Largest part of the run that may be missing at its ends.
const MISSING: f64 = 0.5;

/// Reads a recording on an equally spaced grid. Returns its step, s, and the table.
///
/// # Errors
/// The recording cannot be used.
pub fn read(recorded: &Recorded, done: &mut dyn FnMut(String)) -> Result<(f64, Table)> {
    let name = recorded.path.display().to_string();
    let table = recording::read(
        &recorded.path,
        &Wanted { signals: &SIGNALS, columns: &recorded.columns },
        done,
    )?;
    even(table, &mut |words| done(format!("{name}: {words}")))
        .with_context(|| format!("{name} cannot be used"))
}

/// Reads the recording of a run. Time counts from the torque's beginning, found by correlation with the torque of the
/// plan. The columns are those of a stored run, as far as the recording has them.
///
/// # Errors
/// The recording cannot be used, or has another torque.
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
    let first = match &*case.torque {
        Torque::Profile(profile) if profile.sweep().is_some() => {
            let highest = profile.band().map_or(0.0, |band| band.1);
            ensure!(
                step * highest < 0.5,
                "{name}: its rows are {step:.3e} s apart, and {} goes to {highest} Hz (allowed: less than {:.3e} s). Is the time in \
                 another unit? --columns time=COLUMN:UNIT states it",
                case.profile,
                0.5 / highest
            );
            budget::table(budget::steps(to - from, step).with_context(|| name.to_string())?, 4)?;
            let count = ((to - from) / step).round() as usize;
            let wanted: Vec<f64> =
                (0..=count).map(|k| case.torque.at(from + k as f64 * step)).collect();
            let (lag, correlation) = aligned(torque, &wanted);
            ensure!(
                correlation > LEAST_CORRELATION,
                "{name}: its torque is not {} (correlation {correlation:.2}; allowed: at least {LEAST_CORRELATION}). Is the \
                 profile another one, or the torque's sign?",
                case.profile
            );
            lag
        }
        // of a noise nobody knows which it was
        _ => 0,
    };
    if first != 0 {
        done(format!("{name}: the torque begins at {:.2} s of it", time[0] + first as f64 * step));
    }
    let rows: Vec<usize> = (0..time.len())
        .filter(|k| {
            let t = from + (*k as f64 - first as f64) * step;
            t > from - 0.5 * step && t < to + 0.5 * step
        })
        .collect();
    let seconds = rows.len() as f64 * step;
    ensure!(
        seconds > (1.0 - MISSING) * (to - from),
        "{name}: {seconds:.0} s of it belong to {}, which lasts {:.0} s (allowed: at least {:.0} %)",
        case.profile,
        to - from,
        100.0 * (1.0 - MISSING)
    );
    // times that already count from the beginning are kept
    let origin = time[0] + first as f64 * step - from;
    let origin = if origin.abs() < 1e-9 { 0.0 } else { origin };
    let cut = |values: &[f64]| rows.iter().map(|k| values[*k]).collect::<Vec<f64>>();
    let mut columns = vec![
        ("time", cut(time).iter().map(|t| t - origin).collect()),
        ("tau_cmd", cut(torque)),
        ("omega", cut(column("omega"))),
        ("omega_imu", cut(column("omega"))),
    ];
    for rate in ["omega_x", "omega_y"] {
        columns.extend(table.column(rate).map(|values| (rate, cut(values))));
    }
    let (names, columns) =
        columns.into_iter().map(|(name, values)| (name.to_string(), values)).unzip();
    // the plan's own step if it is equal to rounding
    let step = if (step / case.step - 1.0).abs() < 1e-6 { case.step } else { step };
    Ok((step, Table::new(names, columns)))
}

/// Returns the row of a record at which a signal begins, possibly before the first row, and the correlation coefficient
/// of the two where they overlap.
fn aligned(record: &[f64], wanted: &[f64]) -> (i64, f64) {
    let length = (record.len() + wanted.len()).next_power_of_two();
    let forward = Forward::new(length);
    let spectrum = |signal: &[f64]| {
        let mut padded = signal.to_vec();
        padded.resize(length, 0.0);
        forward.of(padded)
    };
    let product =
        spectrum(record).iter().zip(&spectrum(wanted)).map(|(a, b)| a * b.conj()).collect();
    let sums = Inverse::new(length).of(product);
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
    use super::aligned;
    use analysis::sweep::Sweep;

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
        let reversed: Vec<f64> = wanted.iter().rev().copied().collect();
        assert!(aligned(&reversed, &wanted).1 < 0.9);
    }
}

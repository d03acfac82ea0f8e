//! Resampling to an even time grid, which spectra and Allan variances need.

use anyhow::{Result, ensure};
use files::budget;

use super::SHORT;
use crate::table::Table;

const OFF: f64 = 1e-3;
const MISSING: f64 = 0.01;
const MOST_ROWS: f64 = 10.0;

/// Resamples a table onto an even time grid, and returns the time step of the grid, s, and the resampled table. Rows that
/// lie on the grid are unchanged; other values are interpolated linearly, also in a few missing rows. `done` receives a
/// message if values were interpolated.
///
/// # Errors
/// If time does not increase, or if too many rows are missing.
pub fn even(table: Table, done: &mut dyn FnMut(String)) -> Result<(f64, Table)> {
    even_with_gaps(table, MISSING, done)
}

/// Resamples a table as [`even`] does, but accepts that up to the fraction `most_missing` of the rows is missing, for
/// example 0.1 for 10 %.
///
/// # Errors
/// If time does not increase, or if more rows are missing.
pub fn even_with_gaps(
    table: Table,
    most_missing: f64,
    done: &mut dyn FnMut(String),
) -> Result<(f64, Table)> {
    let time = table.column("time").unwrap_or_default();
    let rows = time.len();
    ensure!(rows > 2, "the recording has {rows} rows (allowed: at least 3)");
    if let Some(row) = time.windows(2).position(|pair| pair[1] <= pair[0]) {
        anyhow::bail!(
            "row {}: time must grow, but {} s follows {} s",
            row + 2,
            time[row + 1],
            time[row]
        );
    }
    let (first, last) = (time[0], time[rows - 1]);
    let mean = (last - first) / (rows - 1) as f64;
    if time.iter().enumerate().all(|(k, t)| (t - first - k as f64 * mean).abs() < OFF * mean) {
        return Ok((mean, table));
    }
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = *steps.select_nth_unstable_by((rows - 1) / 2, f64::total_cmp).1;
    let gaps =
        time.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > SHORT.max(1.5 * usual));
    let (count, missing) = gaps.fold((0, 0.0), |(n, sum), gap| (n + 1, sum + gap));
    ensure!(
        missing < most_missing * (last - first),
        "rows are missing for {missing:.1} of {:.1} s, in {count} gaps (allowed: {} %)",
        last - first,
        100.0 * most_missing
    );
    let lost = time.windows(2).filter(|pair| pair[1] - pair[0] > 1.5 * usual).count();
    // Number of steps between the first and the last row, as a whole number.
    let count_of = ((last - first) / usual).round().max(1.0);
    // A table whose times have a wrong spacing must not produce an enormous grid.
    ensure!(
        count_of <= MOST_ROWS * rows as f64,
        "most rows are {usual:e} s apart, so that an even grid over the {:.3e} s of the recording would have {count_of:.1e} rows \
         (allowed: at most {MOST_ROWS} times the {rows} rows of the recording)",
        last - first
    );
    budget::table(count_of as usize, table.names().len())?;
    let step = (last - first) / count_of;
    done(format!(
        "the rows are not equally spaced (usually {usual:.6} s apart, in {lost} places more than 1.5 times as much): they are \
         interpolated linearly on a grid of {step:.6} s"
    ));
    let grid: Vec<f64> = (0..=count_of as usize).map(|k| first + k as f64 * step).collect();
    let columns = table.names().iter().map(|name| {
        let values = table.column(name).unwrap_or_default();
        let mut row = 0;
        let at = |t: &f64| {
            while row + 2 < rows && time[row + 1] < *t {
                row += 1;
            }
            let part = ((t - time[row]) / (time[row + 1] - time[row])).clamp(0.0, 1.0);
            values[row] + part * (values[row + 1] - values[row])
        };
        if name == "time" { grid.clone() } else { grid.iter().map(at).collect() }
    });
    Ok((step, Table::new(table.names().to_vec(), columns.collect())))
}

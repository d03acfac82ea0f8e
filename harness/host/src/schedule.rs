//! Communication points of a run, and the inputs between them. The command line and the Python package follow the same rules.
//!
//! An input is a [`History`]: rows that are joined by straight lines, or held. The [`Schedule`] of a run has a
//! communication point at the start, at every row of an input, at every row of the result, and at the stop time. The
//! FMU therefore follows a line between two rows exactly, and the rows of the result can be chosen freely.

use anyhow::{Result, bail, ensure};
use files::budget;

use crate::description::ModelDescription;

/// Fraction of the row interval below which two times count as equal. A row of the result this
/// close to a row of an input, or to the stop time, is moved there. This is needed because, for
/// example, 3 · 0.02 is not exactly 0.06.
const SAME: f64 = 1e-6;

/// Sentence in the metadata of a result file. It states the times to which the inputs and the
/// outputs in one row belong.
pub const ROWS: &str =
    "inputs from the row's time on; other variables at the row's time, before these inputs act";

/// Returns the words in the metadata of a result file that state how the inputs change between two
/// rows. `hold` is true for a zero-order hold.
pub const fn between(hold: bool) -> &'static str {
    if hold { "held from row to row" } else { "straight lines between rows" }
}

/// An input as a function of time, given by rows. Two rows with equal times are a jump. Before the
/// first and after the last row the input is constant.
#[derive(Clone, Debug, PartialEq)]
pub struct History {
    time: Vec<f64>,
    values: Vec<f64>,
    /// Slope from each row to the next, per s; 0 in the last row.
    slopes: Vec<f64>,
}

impl History {
    /// Creates a history in which row `k` has the time `time[k]`, s, and the value `values[k]`.
    /// Between two rows the input has the slope `slopes[k]`, per s, and may jump at the next row.
    /// Without `slopes` two rows are joined by a straight line; with `hold` the value is constant
    /// between rows.
    ///
    /// # Errors
    ///
    /// If there are fewer than two rows, or the times are not ascending.
    pub fn new(
        time: Vec<f64>,
        values: Vec<f64>,
        slopes: Option<Vec<f64>>,
        hold: bool,
    ) -> Result<Self> {
        let rows = time.len();
        ensure!(rows >= 2, "the table of inputs has {rows} rows (allowed: at least two)");
        ensure!(
            values.len() == rows && slopes.as_ref().is_none_or(|slopes| slopes.len() == rows),
            "the columns of times, values and slopes have different lengths (allowed: one number of each in every row)"
        );
        // The condition is also true for NaN.
        if let Some(row) = time
            .windows(2)
            .position(|pair| pair[0] > pair[1] || pair[0].is_nan() || pair[1].is_nan())
        {
            bail!(
                "row {}: time goes from {} to {} s; it must not go back (two rows at one time are a jump)",
                row + 2,
                time[row],
                time[row + 1]
            );
        }
        let mut slopes = match slopes {
            _ if hold => vec![0.0; rows],
            Some(slopes) => slopes,
            None => {
                let slope = |k: usize| match time[k + 1] - time[k] {
                    0.0 => 0.0,
                    length => (values[k + 1] - values[k]) / length,
                };
                (0..rows - 1).map(slope).chain([0.0]).collect()
            }
        };
        slopes[rows - 1] = 0.0;
        Ok(History { time, values, slopes })
    }

    pub fn held(&self) -> History {
        let slopes = vec![0.0; self.time.len()];
        History { time: self.time.clone(), values: self.values.clone(), slopes }
    }

    pub fn time(&self) -> &[f64] {
        &self.time
    }

    pub fn is_held(&self) -> bool {
        self.slopes.iter().all(|slope| *slope == 0.0)
    }

    /// Returns the value and the slope, per s, of the input immediately after the time `t`, s. If
    /// the input jumps at `t`, these are the values after the jump.
    pub fn after(&self, t: f64) -> (f64, f64) {
        self.at_row(self.time.partition_point(|row| *row <= t), t)
    }

    /// Returns the value of the input at the time `t`, s. If `t` is a sum of steps, it has a
    /// rounding error. A jump at most 1e-9 (1 + |t|) s after `t` is therefore taken to have
    /// happened, so that it is not missed.
    pub fn near(&self, t: f64) -> f64 {
        let slack = 1e-9 * (1.0 + t.abs());
        self.at_row(self.time.partition_point(|row| *row <= t + slack), t).0
    }

    /// Returns the value of the input and its slope, per s, at the time `t`, s. `begun` is the
    /// number of rows whose times are at most `t`.
    fn at_row(&self, begun: usize, t: f64) -> (f64, f64) {
        let Some(k) = begun.checked_sub(1) else { return (self.values[0], 0.0) };
        let (value, slope) = (self.values[k], self.slopes[k]);
        (if t == self.time[k] { value } else { value + slope * (t - self.time[k]) }, slope)
    }

    /// Returns a cursor that evaluates the history at ascending times. This is faster than a search
    /// for each time.
    pub fn cursor(&self) -> Cursor<'_> {
        Cursor { history: self, begun: 0 }
    }
}

pub struct Cursor<'h> {
    history: &'h History,
    begun: usize,
}

impl Cursor<'_> {
    /// Returns the value and the slope, per s, immediately after the time `t`, s. `t` must not be
    /// before the time of the previous call, because the cursor only moves forwards.
    pub fn after(&mut self, t: f64) -> (f64, f64) {
        let time = &self.history.time;
        while time.get(self.begun).is_some_and(|row| *row <= t) {
            self.begun += 1;
        }
        self.history.at_row(self.begun, t)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    pub time: Vec<f64>,
    /// For each communication point, true if the result has a row at this point. `None` means that
    /// it has a row at every point.
    pub rows: Option<Vec<bool>>,
}

impl Schedule {
    /// Returns the communication points from `start` to `stop`, s: both ends, the times in
    /// `inputs`, at which inputs change, and the rows of the result. The rows are `step` seconds
    /// apart and end at `stop`; without `step` every communication point is a row.
    ///
    /// # Errors
    ///
    /// If the times are not valid, or there are more points than [`budget::ROWS`].
    pub fn new<'h>(
        (start, stop): (f64, f64),
        step: Option<f64>,
        inputs: impl IntoIterator<Item = &'h [f64]>,
    ) -> Result<Self> {
        let mut knots: Vec<f64> = Vec::new();
        let mut last: Option<&[f64]> = None;
        for times in inputs {
            // All inputs of one table have the same rows.
            if last != Some(times) {
                let from = times.partition_point(|t| *t <= start);
                let to = times.partition_point(|t| *t < stop);
                knots.extend(times.get(from..to).unwrap_or_default());
            }
            last = Some(times);
        }
        knots.sort_unstable_by(f64::total_cmp);
        knots.dedup();
        let most = |points: usize| -> Result<()> {
            ensure!(
                points <= budget::ROWS + 1,
                "the {} rows of the inputs and the rows of the result are together {points} communication points (allowed: at most {})",
                knots.len(),
                budget::ROWS
            );
            Ok(())
        };
        let Some(step) = step else {
            most(knots.len() + 2)?;
            let time = [start].into_iter().chain(knots.iter().copied()).chain([stop]).collect();
            return Ok(Schedule { time, rows: None });
        };
        let steps = budget::steps(stop - start, step)?;
        let (mut time, mut rows) = (Vec::with_capacity(steps + 1), Vec::with_capacity(steps + 1));
        let mut next = 0;
        for k in 0..=steps {
            let grid = match k {
                0 => start,
                _ if k == steps => stop,
                _ => start + k as f64 * step,
            };
            let mut row = grid;
            while let Some(knot) = knots.get(next).filter(|knot| **knot <= grid + SAME * step) {
                let is_row = k > 0 && k < steps && (knot - grid).abs() <= SAME * step;
                // If two points are close to a row, the closer one becomes the row.
                if is_row && (row == grid || (knot - grid).abs() < (row - grid).abs()) {
                    row = *knot;
                }
                time.push(*knot);
                rows.push(false);
                next += 1;
            }
            match time.iter().rposition(|t| *t <= row).filter(|at| time[*at] == row) {
                Some(at) => rows[at] = true,
                None => {
                    let at = time.iter().rposition(|t| *t < row).map_or(0, |at| at + 1);
                    time.insert(at, row);
                    rows.insert(at, true);
                }
            }
            most(time.len())?;
        }
        let all = rows.iter().all(|row| *row);
        Ok(Schedule { time, rows: (!all).then_some(rows) })
    }

    pub fn is_row(&self, k: usize) -> bool {
        self.rows.as_ref().is_none_or(|rows| rows[k])
    }
}

/// Returns `true` if inputs can change linearly between communication points. The FMU must accept
/// derivatives or intermediate values of inputs. An FMU with only Model Exchange always can,
/// because the host integrates it and sets the inputs at any time.
pub fn interpolates(description: &ModelDescription) -> bool {
    description
        .co_simulation
        .as_ref()
        .is_none_or(|co_simulation| co_simulation.can_interpolate_inputs)
}

/// Returns an error if an input changes linearly between its rows, but the FMU cannot interpolate
/// its inputs. If the input were held over each step, it would lag, and a row of the result would
/// pair an input with the response to the previous input. `hold` is the name of the option by which
/// the user can hold inputs between rows; the error message names it.
pub fn check_interpolation<'h>(
    description: &ModelDescription,
    inputs: impl IntoIterator<Item = (&'h str, &'h History)>,
    hold: &str,
) -> Result<()> {
    if interpolates(description) {
        return Ok(());
    }
    for (name, history) in inputs {
        ensure!(
            history.is_held(),
            "{} cannot interpolate its inputs (canInterpolateInputs is false), but {name} is not constant between its \
             rows: run with {hold} to hold each value until the next row",
            description.model_name
        );
    }
    Ok(())
}

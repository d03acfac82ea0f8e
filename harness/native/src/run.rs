//! Simulates whole runs for Python: the loop over the communication points.

use std::time::{Duration, Instant};

use host::c_abi::{Called, Status};
use host::description::{Type, Value, Variable};
use host::fmu::Instance;
use pyo3::prelude::*;

use crate::feedback::{Feedback, expect};
use crate::fmu::Fmu;
use crate::numbers::{Failure, Numbers};

/// Largest number of rows that are simulated before the run returns briefly to Python, which exchanges rows with the numpy arrays
/// and notices Ctrl-C.
const ROWS: usize = 1024;
/// Longest time that a run computes before it returns briefly to Python, unless a single step takes
/// longer.
const LONGEST_COMPUTATION: Duration = Duration::from_millis(100);

/// Variables that form the columns of a table. Reals are read or set with one call of the FMU, variables of other types with one
/// call each.
struct Columns<'fmu> {
    references: Vec<u32>,
    places: Vec<usize>,
    reals: Vec<f64>,
    others: Vec<(&'fmu Variable, usize)>,
    row: Vec<f64>,
}

impl<'fmu> Columns<'fmu> {
    fn find(fmu: &'fmu Fmu, names: &[String]) -> PyResult<Columns<'fmu>> {
        let all = names.iter().map(|name| fmu.variable(name)).collect::<PyResult<Vec<_>>>()?;
        let (reals, mut others): (Vec<_>, Vec<_>) =
            all.into_iter().zip(0..).partition(|(variable, _)| variable.kind() == Type::Real);
        others.sort_by_key(|(variable, _)| variable.kind() == Type::Boolean);
        Ok(Columns {
            references: reals.iter().map(|(variable, _)| variable.reference).collect(),
            places: reals.iter().map(|(_, place)| *place).collect(),
            reals: vec![0.0; reals.len()],
            others,
            row: vec![0.0; names.len()],
        })
    }

    fn get(&mut self, from: &mut Instance) -> Called<&[f64]> {
        if !self.references.is_empty() {
            from.get_real(&self.references, &mut self.reals)?;
        }
        if self.others.is_empty() {
            return Ok(self.last());
        }
        for (place, real) in self.places.iter().zip(&self.reals) {
            self.row[*place] = *real;
        }
        for (variable, place) in &self.others {
            self.row[*place] = from.value(variable)?.number();
        }
        Ok(self.last())
    }

    fn last(&self) -> &[f64] {
        if self.others.is_empty() { &self.reals } else { &self.row }
    }

    /// Sets the inputs to the values in `row`. `are_held` is true if inputs are constant until the next row; Reals
    /// that have not changed are then not set again.
    fn set(&mut self, to: &mut Instance, row: &[f64], are_held: bool) -> Called {
        let mut is_new = !are_held;
        for (place, real) in self.places.iter().zip(&mut self.reals) {
            is_new |= real.to_bits() != row[*place].to_bits();
            *real = row[*place];
        }
        if is_new && !self.references.is_empty() {
            to.set_real(&self.references, &self.reals)?;
        }
        for (variable, place) in &self.others {
            let value = match variable.kind() {
                Type::Boolean => Value::Boolean(row[*place] != 0.0),
                _ => Value::Integer(row[*place] as i64),
            };
            to.set_value(variable, value)?;
        }
        Ok(())
    }
}

/// Description of a run that the FMU ended: the row, the number of rows that were recorded, and the reason.
pub type Stop = (usize, usize, String);

/// Names of columns, and a numpy array with one column of floats for each name.
pub type Table<'py> = (Vec<String>, Bound<'py, PyAny>);

/// The Reals that change linearly from one row to the next: value references, values at the row, and derivatives. This
/// is working memory, so that a row allocates nothing.
#[derive(Default)]
struct Lines {
    references: Vec<u32>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

pub struct Run<'fmu> {
    time: Vec<f64>,
    /// For each row true if its outputs are read; `None` if the outputs of all rows are read. A row that is not read
    /// repeats the outputs of the row before. As few rows as possible are read, because the FMU may have to compute
    /// all its outputs for one read.
    wanted: Option<Vec<bool>>,
    inputs: (Columns<'fmu>, Numbers),
    slopes: Option<Numbers>,
    lines: Lines,
    outputs: (Columns<'fmu>, Numbers),
    feedback: Option<Feedback>,
}

impl<'fmu> Run<'fmu> {
    /// Prepares a run. `time` has the communication points, s; if some rows are not read, also a flag for each row,
    /// which is 0 for those rows. `slopes` has the same columns as `inputs`.
    ///
    /// # Errors
    ///
    /// If a variable is unknown, or a table has another size.
    pub fn new(
        fmu: &'fmu Fmu,
        (time, wanted): (Vec<f64>, Option<Vec<u8>>),
        (inputs, values): &Table,
        slopes: Option<&Bound<PyAny>>,
        (outputs, recorded): &Table,
        feedback: Option<&Bound<PyAny>>,
    ) -> PyResult<Run<'fmu>> {
        let (rows, width) = (time.len(), inputs.len());
        if let Some(wanted) = &wanted {
            expect("rows of the run", wanted.len(), rows)?;
        }
        let columns = Columns::find(fmu, inputs)?;
        let slopes = slopes.map(|of| Numbers::borrow(of, rows, width, false)).transpose()?;
        Ok(Run {
            slopes,
            lines: Lines::default(),
            inputs: (columns, Numbers::borrow(values, rows, width, false)?),
            outputs: (
                Columns::find(fmu, outputs)?,
                Numbers::borrow(recorded, rows, outputs.len(), true)?,
            ),
            feedback: feedback.map(|of| Feedback::read(of, fmu, rows)).transpose()?,
            wanted: wanted.map(|of| of.iter().map(|byte| *byte != 0).collect()),
            time,
        })
    }

    /// Simulates all rows and returns the reason if the FMU ended the run early. Python's lock is held only while rows are
    /// exchanged.
    ///
    /// # Errors
    ///
    /// If the controller raises an exception, or on KeyboardInterrupt.
    pub fn make(&mut self, instance: &mut Instance) -> PyResult<Option<Stop>> {
        let end = self.drive(instance);
        Python::attach(|py| self.hand_over(py));
        match end {
            Ok(()) => Ok(None),
            Err((_, Failure::Python(why))) => Err(why),
            Err((row, Failure::Call(why))) => {
                let read = row + usize::from(!why.call[4..].starts_with("Get"));
                let ends = why.call == "fmi2DoStep" && why.status == Status::Discard;
                let ends = ends && instance.wants_to_end();
                let wish = if ends { "; the FMU wants the simulation to end" } else { "" };
                Ok(Some((row, read, format!("{why}{wish}"))))
            }
        }
    }

    /// Simulates one row: reads the outputs, lets the controller (if there is one) compute its commands, sets the inputs and
    /// makes a step. The last row has only outputs. `row` counts from the start of the run, `i` from the start of the block of
    /// rows that was last read from Python.
    fn row(&mut self, instance: &mut Instance, row: usize, i: usize) -> Result<(), Failure> {
        let (columns, recorded) = &mut self.outputs;
        recorded.push(match &self.wanted {
            Some(rows) if row > 0 && !rows[row] => columns.last(),
            _ => columns.get(instance)?,
        });
        let time = self.time[row];
        let Some(next) = self.time.get(row + 1) else {
            if let Some(feedback) = &mut self.feedback {
                feedback.record_speeds();
            }
            return Ok(());
        };
        if let Some(feedback) = &mut self.feedback {
            feedback.act(instance, row, time)?;
        }
        let (columns, given) = &mut self.inputs;
        columns.set(instance, given.row(i), self.slopes.is_none() && row > 0)?;
        let Lines { references, values, slopes } = &mut self.lines;
        let mut begin = time;
        // one step, or several steps if wheels reach their largest speeds before the next row
        while begin < *next {
            let end = match &mut self.feedback {
                Some(feedback) => feedback.turn(instance, begin, *next)?,
                None => *next,
            };
            references.clear();
            values.clear();
            slopes.clear();
            if let Some(along) = &mut self.slopes {
                references.extend(&columns.references);
                slopes.extend(columns.places.iter().map(|place| along.row(i)[*place]));
                values.extend(&columns.reals);
                if begin > time {
                    let moved = values.iter_mut().zip(&*slopes);
                    moved.for_each(|(value, slope)| *value += slope * (begin - time));
                    instance.set_real(references, values)?;
                }
            }
            if let Some((turned, h, h_dot)) = self.feedback.as_ref().and_then(Feedback::lines) {
                references.extend(turned);
                values.extend(h);
                slopes.extend(h_dot);
            }
            match references.is_empty() {
                true => instance.do_step(begin, end - begin)?,
                false => instance.do_step_along(begin, end - begin, references, values, slopes)?,
            }
            begin = end;
        }
        Ok(())
    }

    fn drive(&mut self, instance: &mut Instance) -> Result<(), (usize, Failure)> {
        let mut row = 0;
        while row < self.time.len() {
            Python::attach(|py| self.visit(py)).map_err(|why| (row, why.into()))?;
            let (first, visited) = (row, Instant::now());
            while row < self.time.len() && row - first < ROWS {
                if row % 16 == 0 && visited.elapsed() > LONGEST_COMPUTATION && row > first {
                    break;
                }
                self.row(instance, row, row - first).map_err(|why| (row, why))?;
                row += 1;
            }
            self.inputs.1.keep(row - first);
            if let Some(slopes) = &mut self.slopes {
                slopes.keep(row - first);
            }
        }
        Ok(())
    }

    /// Writes the computed rows into the numpy arrays of Python, and reads the next rows of inputs from them. Fails
    /// if the user has pressed Ctrl-C.
    fn visit(&mut self, py: Python) -> PyResult<()> {
        self.hand_over(py);
        self.inputs.1.read(py, ROWS);
        if let Some(slopes) = &mut self.slopes {
            slopes.read(py, ROWS);
        }
        py.check_signals()
    }

    fn hand_over(&mut self, py: Python) {
        self.outputs.1.write(py);
        if let Some(feedback) = &mut self.feedback {
            feedback.write(py);
        }
    }
}

//! Communication points and inputs over time for Python, by the same rules as in the command line.

use host::schedule::{self, Schedule};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::fmu::{Fmu, error};
use crate::numbers::numbers;

/// An input as a function of time: rows that are joined by straight lines or held. Two rows with the same time are a jump.
#[pyclass(frozen, module = "hubslosh")]
pub struct History(schedule::History);

/// Returns numbers as bytes, which numpy reads as an array of 64-bit floats without copying each number.
pub fn bytes<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyBytes> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_ne_bytes()).collect();
    PyBytes::new(py, &bytes)
}

#[pymethods]
impl History {
    /// Create the history of an input from rows with times in s. `slopes` has the slope from each row to the next; None means
    /// straight lines between the rows. With `hold` each value is kept until the next row.
    #[new]
    fn new(
        time: &Bound<PyAny>,
        values: &Bound<PyAny>,
        slopes: Option<&Bound<PyAny>>,
        hold: bool,
    ) -> PyResult<History> {
        let slopes = slopes.map(numbers).transpose()?;
        let history = schedule::History::new(numbers(time)?, numbers(values)?, slopes, hold);
        history.map(History).map_err(error)
    }

    /// Return two arrays for ascending times (s): the values immediately after each time, and the slopes there.
    fn after<'py>(
        &self,
        py: Python<'py>,
        time: &Bound<PyAny>,
    ) -> PyResult<(Bound<'py, PyBytes>, Bound<'py, PyBytes>)> {
        let mut cursor = self.0.cursor();
        let (values, slopes): (Vec<f64>, Vec<f64>) =
            numbers(time)?.into_iter().map(|t| cursor.after(t)).unzip();
        Ok((bytes(py, &values), bytes(py, &slopes)))
    }
}

/// Return the communication points of a run, s, and a mask of those that are rows of the result (None: all are).
#[pyfunction]
pub fn communication_points<'py>(
    py: Python<'py>,
    start: f64,
    stop: f64,
    step: Option<f64>,
    inputs: Option<&Bound<PyAny>>,
) -> PyResult<(Bound<'py, PyBytes>, Option<Bound<'py, PyBytes>>)> {
    let inputs = inputs.map(numbers).transpose()?;
    let inputs = inputs.as_deref();
    let Schedule { time, rows } = Schedule::new((start, stop), step, inputs).map_err(error)?;
    let rows = rows.map(|rows| {
        let rows: Vec<u8> = rows.into_iter().map(u8::from).collect();
        PyBytes::new(py, &rows)
    });
    Ok((bytes(py, &time), rows))
}

/// Raise FmuError if an input changes linearly between rows but the FMU can only hold inputs. `hold` is the option that the
/// message recommends.
#[pyfunction]
pub fn check_interpolation(
    fmu: &Fmu,
    inputs: Vec<(String, PyRef<History>)>,
    hold: &str,
) -> PyResult<()> {
    let inputs = inputs.iter().map(|(name, history)| (name.as_str(), &history.0));
    schedule::check_interpolation(fmu.description(), inputs, hold).map_err(error)
}

/// Return two sentences for the metadata of a result. They state at which times the inputs and the outputs of a row
/// are valid, and whether inputs are constant (`hold`) or linear between rows.
#[pyfunction]
pub fn pairing(hold: bool) -> (&'static str, &'static str) {
    (schedule::ROWS, schedule::between(hold))
}

//! Communication points and histories of inputs, as the command has them.

use host::schedule::{self, Schedule};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::fmu::{Fmu, error};
use crate::numbers::numbers;

/// An input over time: lines between rows, or steps. Two rows at one time are a jump.
#[pyclass(frozen, module = "hubslosh")]
pub struct History(schedule::History);

/// Returns the numbers as bytes, which numpy reads as an array of floats.
pub fn bytes<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyBytes> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_ne_bytes()).collect();
    PyBytes::new(py, &bytes)
}

#[pymethods]
impl History {
    /// Take rows, s; slopes: from each to the next, None: of the lines between them.
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

    /// Return values and slopes at ascending times and immediately after them.
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

/// Return the communication points of a run, s, and which of them are rows of the result (None: all).
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

/// Raise FmuError if the FMU cannot interpolate and one of the inputs has slopes.
#[pyfunction]
pub fn check_interpolation(
    fmu: &Fmu,
    inputs: Vec<(String, PyRef<History>)>,
    hold: &str,
) -> PyResult<()> {
    let inputs = inputs.iter().map(|(name, history)| (name.as_str(), &history.0));
    schedule::check_interpolation(fmu.description(), inputs, hold).map_err(error)
}

/// Return what a row of a result pairs, and how inputs go on from row to row.
#[pyfunction]
pub fn pairing(hold: bool) -> (&'static str, &'static str) {
    (schedule::ROWS, schedule::between(hold))
}

//! Transfers tables of numbers between numpy arrays and the simulation.
#![allow(unsafe_code)]

use host::c_abi::CallError;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Reason why a run ended before its last row.
pub enum Failure {
    /// A call of the FMU failed.
    Call(CallError),
    /// The controller failed, or the user pressed Ctrl-C.
    Python(PyErr),
}

impl From<CallError> for Failure {
    fn from(why: CallError) -> Failure {
        Failure::Call(why)
    }
}

impl From<PyErr> for Failure {
    fn from(why: PyErr) -> Failure {
        Failure::Python(why)
    }
}

/// Returns the numbers in a numpy array of floats.
///
/// # Errors
/// If the object is not an array of floats.
pub fn numbers(array: &Bound<PyAny>) -> PyResult<Vec<f64>> {
    PyBuffer::get(array)?.to_vec(array.py())
}

/// A numpy array with `rows` rows of `width` numbers. Its rows are copied in blocks between the array and this value,
/// so that Python's lock is needed only once for each block.
pub struct Numbers {
    array: PyBuffer<f64>,
    width: usize,
    rows: Vec<f64>,
    at: usize,
}

impl Numbers {
    pub fn borrow(
        array: &Bound<PyAny>,
        rows: usize,
        width: usize,
        writes: bool,
    ) -> PyResult<Numbers> {
        let array = PyBuffer::get(array)?;
        if array.item_count() != rows * width
            || !array.is_c_contiguous()
            || (writes && array.readonly())
        {
            return Err(PyValueError::new_err(format!("an array of {rows} × {width} is expected")));
        }
        Ok(Numbers { array, width, rows: Vec::new(), at: 0 })
    }

    /// Adds a row to the block of rows that has not been written to the array.
    pub fn push(&mut self, row: &[f64]) {
        self.rows.extend_from_slice(row);
    }

    /// Writes the block of rows to the numpy array.
    pub fn write(&mut self, _: Python) {
        if let Some(mut numbers) = self.array.as_slice_ptr() {
            // SAFETY: `borrow` has checked type and size, and Python's lock is held.
            let numbers = unsafe { numbers.as_mut() };
            numbers[self.at..][..self.rows.len()].copy_from_slice(&self.rows);
        }
        self.at += self.rows.len();
        self.rows.clear();
    }

    /// Copies the next `rows` rows from the numpy array.
    pub fn read(&mut self, _: Python, rows: usize) {
        self.at += self.rows.len();
        self.rows.clear();
        if let Some(numbers) = self.array.as_slice_ptr() {
            // SAFETY: the same as in `write`.
            let numbers = unsafe { &numbers.as_ref()[self.at..] };
            self.rows.extend(numbers.iter().take(rows * self.width));
        }
    }

    /// Marks only the first `rows` rows of the present block as read; the next [`Numbers::read`] begins with the
    /// following row.
    pub fn keep(&mut self, rows: usize) {
        self.rows.truncate(rows * self.width);
    }

    /// Returns row `i` of the present block.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.rows[i * self.width..(i + 1) * self.width]
    }
}

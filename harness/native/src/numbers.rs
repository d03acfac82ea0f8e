//! Numbers between Python and the host.
#![allow(unsafe_code)]

use host::c_abi::CallError;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Reason for the end of a run before its last row.
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

/// Returns the numbers of an array of numpy.
///
/// # Errors
/// If it is not an array of floats.
pub fn numbers(array: &Bound<PyAny>) -> PyResult<Vec<f64>> {
    PyBuffer::get(array)?.to_vec(array.py())
}

/// A numpy array of rows × width, and the rows that are being copied to or from it.
pub struct Numbers {
    array: PyBuffer<f64>,
    width: usize,
    rows: Vec<f64>,
    /// Number of values in the array before those rows.
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

    /// Adds a row to those that wait to be written.
    pub fn push(&mut self, row: &[f64]) {
        self.rows.extend_from_slice(row);
    }

    /// Writes the waiting rows to the Python array.
    pub fn write(&mut self, _: Python) {
        if let Some(mut numbers) = self.array.as_slice_ptr() {
            // SAFETY: of() has looked at its type and size, and nobody else runs Python meanwhile.
            let numbers = unsafe { numbers.as_mut() };
            numbers[self.at..][..self.rows.len()].copy_from_slice(&self.rows);
        }
        self.at += self.rows.len();
        self.rows.clear();
    }

    /// Copies the next `rows` rows from the Python array.
    pub fn read(&mut self, _: Python, rows: usize) {
        self.at += self.rows.len();
        self.rows.clear();
        if let Some(numbers) = self.array.as_slice_ptr() {
            // SAFETY: as above.
            let numbers = unsafe { &numbers.as_ref()[self.at..] };
            self.rows.extend(numbers.iter().take(rows * self.width));
        }
    }

    /// Returns all rows after the first `rows` of those that were read, so that they are read again.
    pub fn keep(&mut self, rows: usize) {
        self.rows.truncate(rows * self.width);
    }

    /// Returns one of the rows that were read.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.rows[i * self.width..(i + 1) * self.width]
    }
}

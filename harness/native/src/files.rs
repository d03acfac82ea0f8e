//! Files: parameters and recordings that are read, and places of outputs.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use ::files::output::{self, Destination};
use ::files::temporary::{self, PREFIX};
use host::description::Value;
use host::parameter_set::ParameterSet;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList};
use signals::recording::{self, Between, Columns, Signal, Wanted};

use crate::fmu::error;
use crate::schedule::bytes;

/// Exponents of SI's base units, factor, offset.
type Base = ([i32; 8], f64, f64);

/// Return the parameters of a file, each with name, value, and the name and the definition of its unit; and warnings.
#[pyfunction]
pub fn read_parameters(py: Python, path: PathBuf) -> PyResult<(Bound<PyList>, Vec<String>)> {
    let found = py.detach(|| ParameterSet::read(&path)).map_err(error)?;
    let all = PyList::empty(py);
    for parameter in found.parameters {
        let (unit, base) = match parameter.unit {
            Some(unit) => (Some(unit.name), unit.base),
            None => (None, None),
        };
        let base: Option<Base> = base.map(|base| (base.exponents, base.factor, base.offset));
        let name = parameter.name;
        match parameter.value {
            Value::Real(value) => all.append((name, value, unit, base))?,
            Value::Integer(value) => all.append((name, value, unit, base))?,
            Value::Boolean(value) => all.append((name, value, unit, base))?,
            Value::String(value) => all.append((name, value, unit, base))?,
        }
    }
    Ok((all, found.warnings))
}

/// A signal: its name, its SI unit, its values as 64-bit floats.
type Values<'py> = (String, &'static str, Bound<'py, PyBytes>);

/// Return the signals of a recording, the time first, and notes on what was read; None if it is of a kind that the package
/// converts. Errors call it `name`.
#[pyfunction]
pub fn read_recording<'py>(
    py: Python<'py>,
    path: PathBuf,
    name: PathBuf,
    columns: Option<&str>,
    rate: Option<f64>,
) -> PyResult<Option<(Vec<Values<'py>>, Vec<String>)>> {
    let signal = |(name, _): &(&'static str, _)| Signal {
        name,
        required: false,
        between: Between::Missing,
        unit: None,
    };
    let signals: Vec<Signal> = recording::SIGNALS.iter().skip(1).map(signal).collect();
    let columns: Columns = columns.unwrap_or_default().parse().map_err(error)?;
    let columns = columns.with_rate(rate).map_err(error)?;
    let wanted = Wanted { signals: &signals, columns: &columns };
    let mut notes = Vec::new();
    let read =
        py.detach(|| recording::read_here(&path, &name, &wanted, &mut |note| notes.push(note)));
    let Some(table) = read.map_err(error)? else { return Ok(None) };
    let values = table.names().iter().zip(table.columns()).map(|(name, values)| {
        let unit = recording::quantity(name).map_err(error)?.unit();
        Ok((name.clone(), unit, bytes(py, values)))
    });
    Ok(Some((values.collect::<PyResult<_>>()?, notes)))
}

/// Return the plain file to which the path of an output leads, which the output may replace; None for a device or a pipe, to which
/// it is written.
#[pyfunction]
pub fn destination(path: PathBuf) -> PyResult<Option<PathBuf>> {
    match output::destination(&path).map_err(error)? {
        Destination::File(file) => Ok(Some(file)),
        Destination::Stream => Ok(None),
    }
}

/// Move a complete file to where the path of an output leads; a device or a pipe gets its bytes.
#[pyfunction]
pub fn put(py: Python, draft: PathBuf, path: PathBuf) -> PyResult<()> {
    py.detach(|| output::publish_draft(&draft, &path)).map_err(error)
}

/// A temporary folder in `parent`, which is removed at the end of `with`, or after a kill when the next one is made there.
#[pyclass(frozen, module = "hubslosh")]
pub struct Folder(Mutex<Option<temporary::Folder>>, PathBuf);

#[pymethods]
impl Folder {
    #[new]
    fn new(py: Python, parent: PathBuf, hidden: bool) -> PyResult<Folder> {
        let prefix = if hidden { format!(".{PREFIX}") } else { PREFIX.into() };
        let made = py.detach(|| temporary::Folder::new_in(&parent, &prefix)).map_err(error)?;
        let path = made.path().to_path_buf();
        Ok(Folder(Mutex::new(Some(made)), path))
    }

    /// Return the path for the files.
    fn __enter__(&self) -> PathBuf {
        self.1.clone()
    }

    /// Remove the folder, unless this process is a fork of the one that made it.
    #[pyo3(signature = (*_failure))]
    fn __exit__(&self, _failure: &Bound<pyo3::types::PyTuple>) {
        drop(self.0.lock().unwrap_or_else(PoisonError::into_inner).take());
    }
}

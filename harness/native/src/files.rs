//! Reads files of parameters and recordings for the Python package, and finds where its output files go.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use ::files::output::{self, Destination};
use ::files::temporary::{self, PREFIX};
use host::parameter_set::ParameterSet;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList};
use signals::recording::{self, Between, Columns, Signal, Wanted};

use crate::fmu::{Base, error, object};
use crate::schedule::bytes;

/// Return the parameters in a file and warnings. Each parameter has its name, its value, and the name and the definition of its
/// unit.
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
        all.append((parameter.name, object(py, parameter.value)?, unit, base))?;
    }
    Ok((all, found.warnings))
}

/// A signal of a recording: its name, its SI unit, and its values as the bytes of 64-bit floats.
type Values<'py> = (String, &'static str, Bound<'py, PyBytes>);

/// Return the signals of a recording, with the time first, and notes on units and times that were assumed or converted. Return
/// None if the file is of a kind that only the Python package can read, such as .mat. Error messages name the file `name`,
/// because `path` may be a temporary file.
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

/// Return the file that an output at `path` replaces, after following links; None if `path` is a device or a pipe, which is
/// written to instead of replaced.
#[pyfunction]
pub fn destination(path: PathBuf) -> PyResult<Option<PathBuf>> {
    match output::destination(&path).map_err(error)? {
        Destination::File(file) => Ok(Some(file)),
        Destination::Stream => Ok(None),
    }
}

/// Move the complete file `draft` to the place to which `path` leads; if this is a device or a pipe, write the bytes of the file
/// to it.
#[pyfunction]
pub fn put(py: Python, draft: PathBuf, path: PathBuf) -> PyResult<()> {
    py.detach(|| output::publish_draft(&draft, &path)).map_err(error)
}

/// A temporary folder within `parent`. It is removed at the end of the `with` statement; if the process is killed, the next
/// `Folder` in `parent` removes it.
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

    /// Return the path of the folder.
    fn __enter__(&self) -> PathBuf {
        self.1.clone()
    }

    /// Remove the folder, but not in a forked copy of the process that created it.
    #[pyo3(signature = (*_failure))]
    fn __exit__(&self, _failure: &Bound<pyo3::types::PyTuple>) {
        drop(self.0.lock().unwrap_or_else(PoisonError::into_inner).take());
    }
}

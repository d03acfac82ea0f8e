//! Words for how the tanks of a run left the range of their model.

use std::collections::BTreeMap;

use names::limits::Limits;
use pyo3::prelude::*;

use crate::fmu::Fmu;
use crate::numbers::numbers;

fn limits_of(fmu: &Fmu) -> Limits {
    Limits::find(|name| fmu.has(name))
}

/// Return the names of the columns that `out_of_range` reads besides the time; none for other FMUs.
#[pyfunction]
pub fn limit_columns(fmu: &Fmu) -> Vec<String> {
    limits_of(fmu).required_columns().map(String::from).collect()
}

/// Return a sentence for each tank that was out of the range of its model, from `time` (s) and the other columns.
#[pyfunction]
pub fn out_of_range(fmu: &Fmu, columns: BTreeMap<String, Bound<PyAny>>) -> PyResult<Vec<String>> {
    let read = columns.into_iter().map(|(name, values)| Ok((name, numbers(&values)?)));
    let columns = read.collect::<PyResult<BTreeMap<_, _>>>()?;
    Ok(limits_of(fmu).describe(|name| columns.get(name).map(Vec::as_slice)))
}

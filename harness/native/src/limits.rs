//! Describes how the tanks in a run left the range in which their model is valid.

use std::collections::BTreeMap;

use names::limits::Limits;
use pyo3::prelude::*;

use crate::fmu::Fmu;
use crate::numbers::numbers;

fn limits_of(fmu: &Fmu) -> Limits {
    Limits::find(|name| fmu.has(name))
}

/// Return the names of the columns that `out_of_range` needs in addition to the time; none if the FMU has no tanks with limits.
#[pyfunction]
pub fn limit_columns(fmu: &Fmu) -> Vec<String> {
    limits_of(fmu).required_columns().map(String::from).collect()
}

/// Return one sentence for each tank that left the range of its model, with times and reasons. `columns` has the time (s) under
/// the name `time` and the columns that `limit_columns` names.
#[pyfunction]
pub fn out_of_range(fmu: &Fmu, columns: BTreeMap<String, Bound<PyAny>>) -> PyResult<Vec<String>> {
    let read = columns.into_iter().map(|(name, values)| Ok((name, numbers(&values)?)));
    let columns = read.collect::<PyResult<BTreeMap<_, _>>>()?;
    Ok(limits_of(fmu).describe(|name| columns.get(name).map(Vec::as_slice)))
}

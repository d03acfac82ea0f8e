//! The compiled half of the Python package `hubslosh`: reads FMUs ([`fmu`]), drives their instances through single calls
//! ([`instance`]) and whole runs ([`run`]), with a controller in the loop if there is one ([`feedback`]).
//!
//! Every call of an FMU is made by the crate `host`, without Python's lock. Tables are arrays of numpy, through the buffer
//! protocol; the package depends on the stable ABI alone, so that one library serves every Python from 3.11 on.

mod feedback;
mod fmu;
mod instance;
mod numbers;
mod run;

/// Functions of `hubslosh._native`.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::fmu::{Fmu, FmuError, FmuWarning, Variable};
    #[pymodule_export]
    use crate::instance::Instance;
}

//! The compiled half of the Python package `hubslosh`. It reads FMUs ([`fmu`]) and runs their instances by single calls
//! ([`instance`]) or as whole runs ([`run`]), with or without a controller ([`feedback`]). It also finds the
//! [`crossings`] of loop gains, computes the modal parameters of [`tanks`], describes how runs left the [`limits`] of
//! their model, reads recordings and parameters, finds the destinations of [`files`], and stores the runs of a [`study`].
//!
//! The crate `host` makes all calls of FMUs, without Python's lock. Tables are numpy arrays, which are accessed through
//! the buffer protocol. The library depends only on the stable ABI, so that one library serves every Python from 3.11 on.

#![warn(missing_docs)]

mod crossings;
mod feedback;
mod files;
mod fmu;
mod instance;
mod limits;
mod numbers;
mod run;
mod schedule;
mod study;
mod tanks;

/// Functions and classes of the Python module `hubslosh._native`.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::crossings::{Model, exponential};
    #[pymodule_export]
    use crate::files::{Folder, destination, put, read_parameters, read_recording};
    #[pymodule_export]
    use crate::fmu::{Fmu, FmuError, FmuWarning, Variable};
    #[pymodule_export]
    use crate::instance::Instance;
    #[pymodule_export]
    use crate::limits::{limit_columns, out_of_range};
    #[pymodule_export]
    use crate::schedule::{History, check_interpolation, communication_points, pairing};
    #[pymodule_export]
    use crate::study::{Store, uniforms};
    #[pymodule_export]
    use crate::tanks::{Liquid, Solved, Tank, solve, table};
}

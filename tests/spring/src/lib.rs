//! A mass on a spring as an FMU.
#![allow(non_snake_case)]

pub mod spring;

/// The functions of FMI 2.0.
pub mod fmi2 {
    pub use runtime::v2::*;

    runtime::export_fmi2!(crate::spring::Spring);
}

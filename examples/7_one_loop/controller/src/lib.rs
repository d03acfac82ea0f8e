//! FMU of a PD controller.
#![allow(non_snake_case)]

pub mod controller;

pub mod fmi2 {
    pub use runtime::v2::*;

    runtime::export_fmi2!(crate::controller::Controller);
}

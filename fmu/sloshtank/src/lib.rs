//! SloshTank as an FMU: one sloshing tank on a spacecraft that the host simulates. Its variables are in
//! [`table`], its physics in the crate `craft`, FMI in the crate `runtime`.

// The library's name is the FMU's modelIdentifier.
#![allow(non_snake_case)]

pub mod model;
pub mod table;

pub use model::Model;

pub mod fmi2 {
    // Parameter types of the standard's header.
    pub use runtime::v2::*;

    runtime::export_fmi2!(crate::Model);
}

pub mod fmi3 {
    pub use runtime::v3::*;

    runtime::export_fmi3!(crate::Model);
}

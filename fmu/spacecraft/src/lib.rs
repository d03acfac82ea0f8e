//! The FMU Spacecraft: a free spacecraft with sloshing tanks. The table of variables is in [`table`], the physics in the
//! crate `craft`, and FMI in the crate `runtime`.

// The library's name is the FMU's modelIdentifier.
#![allow(non_snake_case)]

pub mod model;
pub mod table;

pub use model::Model;

pub mod fmi2 {
    // The exported functions have argument types with the names of the standard's header.
    pub use runtime::v2::*;

    runtime::export_fmi2!(crate::Model);
}

pub mod fmi3 {
    pub use runtime::v3::*;

    runtime::export_fmi3!(crate::Model);
}

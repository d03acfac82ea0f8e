//! The FMU HubSlosh: its table of variables ([`table`]) and the implementation of the runtime's `Model` for the plant
//! ([`model`]). The physics is in the crate `plant`, and FMI in the crate `runtime`.

// The library's name is the FMU's modelIdentifier.
#![allow(non_snake_case)]

pub mod model;
pub mod table;

pub use model::{HubSlosh, Parameters};

use runtime::call::Interface;
use runtime::v2::Fmi2;

pub type Instance = runtime::instance::Instance<HubSlosh, Fmi2>;

pub type Scalar = runtime::table::Scalar<HubSlosh>;

/// Creates an instance as a host of FMI 2.0 does, for tests and other callers in Rust.
pub fn instance(interface: Interface) -> Instance {
    Instance::new(interface)
}

/// Restores an instance from the bytes of a saved state.
///
/// # Errors
/// The reason if the bytes are not a saved state.
pub fn from_bytes(bytes: &[u8]) -> Result<Instance, String> {
    runtime::snapshot::from_bytes(bytes)
}

pub mod fmi2 {
    // The exported functions have argument types with the names of the standard's header.
    pub use runtime::v2::*;

    runtime::export_fmi2!(crate::HubSlosh);
}

pub mod fmi3 {
    pub use runtime::v3::*;

    runtime::export_fmi3!(crate::HubSlosh);
}

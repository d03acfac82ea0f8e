//! Common base of the project's FMUs. This crate implements FMI and contains no physics; a model contains physics and no
//! FMI. The trait [`Model`] connects the two.
//!
//! [`variable`] and [`table`] define the variables of a model, [`call`] the instance states in which functions are allowed,
//! and [`instance`] the effects of calls. [`snapshot`] serialises saved states, and [`log`] selects messages for the host's
//! log. The trait [`version::Version`] contains the differences between versions of FMI. Each version is one module ([`v2`],
//! [`v3`]) with its C interface, on top of the common `c_abi`. Only these modules contain unsafe code.
//!
//! An FMU is a crate with a table, an implementation of [`Model`] and two lines:
//! `runtime::export_fmi2!(TheModel);` and `runtime::export_fmi3!(TheModel);`.

#![warn(missing_docs)]

mod c_abi;
pub mod call;
pub mod clock;
pub mod dynamics;
mod extent;
pub mod hash;
pub mod instance;
pub mod log;
pub mod model;
pub mod number;
pub mod snapshot;
pub mod table;
pub mod unit;
pub mod v2;
pub mod v3;
pub mod variable;
pub mod version;

pub use dynamics::Dynamics;
pub use model::Model;

// The tests of this crate use the FMU of tests/spring.
#[cfg(test)]
extern crate self as runtime;
#[cfg(test)]
#[path = "../../../tests/spring/src/spring.rs"]
mod spring;
#[cfg(test)]
mod tests;

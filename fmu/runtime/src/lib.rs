//! What every FMU of the project shares. It knows FMI and no physics; a model knows its physics
//! and no FMI. They meet in one trait, [`Model`].
//!
//! [`variable`] and [`table`] say what a model's variables are, [`operation`] which call is
//! allowed in which state, [`instance`] what the calls do, [`snapshot`] how a state is saved,
//! [`log`] what is told to the host. Each version of FMI's C interface is one file ([`v2`]); these
//! files hold the only unsafe code.
//!
//! An FMU is a crate with a table, an implementation of [`Model`] and one line:
//! `runtime::export_fmi2!(TheModel);`.

pub mod hash;
pub mod instance;
pub mod log;
pub mod model;
pub mod operation;
pub mod snapshot;
pub mod table;
pub mod unit;
pub mod v2;
pub mod variable;

pub use model::Model;

// The runtime's own tests drive the FMU of tests/spring.
#[cfg(test)]
extern crate self as runtime;
#[cfg(test)]
#[path = "../../../tests/spring/src/spring.rs"]
mod spring;

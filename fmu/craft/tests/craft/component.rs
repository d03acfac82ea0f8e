//! The components under test.

pub use craft::{SloshTank, Spacecraft};

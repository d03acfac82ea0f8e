//! What is under test. `tests/six` has the packed FMUs in its place.

pub use craft::{SloshTank, Spacecraft};

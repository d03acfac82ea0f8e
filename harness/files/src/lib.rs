//! Files of one command: the inputs that it may read and their largest sizes, and outputs, which are written
//! completely or not at all.
//!
//! All other crates of the harness may use this crate, which itself knows neither FMUs nor signals. It also writes
//! the report after a panic of our own code, with the names of the files that were read.

pub mod budget;
pub mod bug;
pub mod input;
pub mod output;
pub mod store;
pub mod temporary;

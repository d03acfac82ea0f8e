//! Files and budgets of one command: what it may read, how much of it, and how outputs appear complete or not at all.
//!
//! The bottom of the harness: it knows no FMU and no signal. Panics of our own code are reported here, with the files that
//! were read.

pub mod budget;
pub mod bug;
pub mod input;
pub mod output;
pub mod store;
pub mod temporary;

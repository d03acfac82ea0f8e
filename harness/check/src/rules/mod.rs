//! The tables of rules, one for each version of FMI. The documentation shows them; a test compares the two.

pub mod fmi2;
pub mod fmi3;

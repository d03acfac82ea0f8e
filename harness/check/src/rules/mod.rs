//! The tables of rules, one for each version of FMI. The book shows them, and a test compares the book with
//! the tables.

pub mod fmi2;
pub mod fmi3;

//! Methods of identification for the bench, each in a file of its own.

pub mod free_decay;
pub mod friction;
pub mod output_error;

//! Uncertainty of the bench's estimates: sources, error budget, and causes of a misfit.

pub mod budget;
pub mod cause;
pub mod deep_tank;
pub mod design;
pub mod missing;
pub mod sources;

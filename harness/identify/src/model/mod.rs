//! The unknowns of an identification, and the simulation of the FMU with given values of the unknowns.

pub mod overridden;
pub mod simulate;
pub mod unknown;

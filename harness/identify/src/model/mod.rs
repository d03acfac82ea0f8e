//! Second stage of an identification: the unknowns, and the outputs that the FMU computes for their
//! values.

pub mod overridden;
pub mod simulate;
pub mod unknown;

//! Second stage: unknowns, and the FMU's answer for their values.

pub mod overridden;
pub mod simulate;
pub mod unknown;

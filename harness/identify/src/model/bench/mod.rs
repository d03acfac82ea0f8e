//! The bench as a model: its unknowns, its effects outside the FMU, and the FMU's answer.

pub mod breaking;
pub mod effect;
pub mod nominal;
pub mod simulate;
pub mod stribeck;
pub mod tank;
pub mod unknown;

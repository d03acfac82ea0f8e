//! From recordings of torque and hub rate to the FMU's parameters, with their uncertainty.

pub mod design;
pub mod fit;
pub mod identification;
pub mod noise;
pub mod recording;
pub mod residual;
pub mod simulate;
pub mod start;
pub mod twin;
pub mod uncertainty;
pub mod unknown;

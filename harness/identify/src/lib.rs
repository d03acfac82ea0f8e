//! From recordings of torque and hub rate to the FMU's parameters, with their uncertainty.

pub mod budget;
pub mod candidate;
pub mod design;
pub mod fit;
pub mod friction;
pub mod identification;
pub mod noise;
pub mod plausible;
pub mod recording;
pub mod report;
pub mod residual;
pub mod simulate;
pub mod start;
pub mod twin;
pub mod uncertainty;
pub mod unknown;
pub mod verdict;

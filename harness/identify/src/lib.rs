//! From recordings of torque and hub rate to the FMU's parameters, with their uncertainty.

pub mod acceleration;
pub mod black_box;
pub mod budget;
pub mod candidate;
pub mod compensation;
pub mod design;
pub mod distortion;
pub mod fit;
pub mod frequency;
pub mod friction;
pub mod identification;
pub mod least_squares;
pub mod noise;
pub mod nominal;
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

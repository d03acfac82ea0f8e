//! From recordings of torque and hub rate to the FMU's parameters, with their uncertainty.

pub mod any_fmu;
pub mod between;
pub mod budget;
pub mod candidate;
pub mod design;
pub mod estimate;
pub mod fit;
pub mod friction;
pub mod goodness;
pub mod methods;
pub mod missing;
pub mod news;
pub mod nominal;
pub mod options;
pub mod plausible;
pub mod recording;
pub mod search;
pub mod simulate;
pub mod spikes;
pub mod start;
pub mod stribeck;
pub mod tolerance;
pub mod twin;
pub mod uncertainty;
pub mod unknown;
pub mod verdict;

//! Reads and checks recordings, questions and tolerances, before any FMU is simulated.

pub mod clocks;
pub mod gaps;
pub mod names;
pub mod plausible;
pub mod question;
pub mod reading;
pub mod record;
pub mod recording;
pub mod response;
pub mod sensor_faults;
pub mod spikes;
pub mod tolerance;

//! Third stage: the sum of squares and the search for its minimum.

pub mod covariance;
pub mod decomposition;
pub mod evidence;
pub mod goodness;
pub mod minimum;
pub mod problem;
pub mod search;

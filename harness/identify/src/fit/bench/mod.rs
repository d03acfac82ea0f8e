//! The fit of the bench: starts from data, candidates of model, friction and intersample behaviour.

pub mod between;
pub mod candidate;
pub mod friction;
pub mod goodness;
pub mod options;
pub mod problem;
pub mod search;
pub mod start;

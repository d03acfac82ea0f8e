//! The slosh bench as data for [`crate::engine`]: what a recording shows, what that means in tank and hub, and what may act besides.

pub mod answer;
pub mod braking;
pub mod breaking;
pub mod causes;
pub mod combination;
pub mod design;
pub mod effect;
pub mod identification;
pub mod nominal;
pub mod options;
pub mod problem;
pub mod simulate;
pub mod start;
pub mod system;
pub mod verdict;

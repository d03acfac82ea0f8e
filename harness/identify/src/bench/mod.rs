//! The slosh bench as an estimation problem for [`crate::engine`]: the model and its unknowns, the conversion of unknowns to
//! dimensions of tank and hub, and effects that the FMU does not model, for example lags of the actuator and the gyro.

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

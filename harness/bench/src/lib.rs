//! Drives FMUs: torque histories, single runs, plans of many runs, what their frequency responses
//! and gyros show, and the report about it.

pub mod analysis;
pub mod campaign;
pub mod example;
pub mod gyro;
pub mod plan;
pub mod profile;
pub mod progress;
pub mod random;
pub mod report;
pub mod run;
pub mod scaling;
pub mod svg;

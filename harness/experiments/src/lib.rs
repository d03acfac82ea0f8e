//! Drives FMUs: torque histories, single runs, plans with many runs, and campaigns with their tables.

pub mod campaign;
pub mod example;
pub mod plan;
pub mod profile;
pub mod progress;
pub mod rest;
pub mod rounding;
pub mod run;
pub mod scaling;
pub mod sensors;
pub mod weight;

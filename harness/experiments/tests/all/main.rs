//! Tests of the crate `experiments` on packed FMUs.

mod example;
mod gyro;
mod plans;
mod sensors;
mod sizes;
mod weight;

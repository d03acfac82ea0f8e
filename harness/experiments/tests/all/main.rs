//! Tests of the bench on the packed FMU.

mod example;
mod gyro;
mod plans;
mod sensors;
mod sizes;
mod weight;

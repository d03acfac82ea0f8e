//! What the bench finds of the packed FMU.

mod example;
mod gyro;
mod plans;
mod sensors;
mod sizes;
mod weight;

//! What must hold of the plant.

mod balances;
mod changing_g;
mod common;
mod errata;
mod lugre;
mod options;
mod rotary;
mod trajectories;

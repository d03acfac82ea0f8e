//! Tests of the plant.

mod balances;
mod changing_g;
mod common;
mod corners;
mod decays;
mod directions;
mod errata;
mod events;
mod free_oscillation;
mod kinematics;
mod leaning;
mod liquid;
mod lugre;
mod options;
mod ranges;
mod rotary;
mod steps;
mod suspension;
mod tanks;
mod trajectories;

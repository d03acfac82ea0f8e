//! Tests that run the program `hubslosh` in a separate process.

mod campaign;
mod check;
mod command_line;
mod communication;
mod documents;
mod folder;
mod foreign;
mod identify;
mod outputs;
mod plans;
mod recordings;
mod report;
mod sizes;
mod tank;
mod view;

//! Tests of the tank's modal parameters, in one binary.

mod backbones;
mod common;
mod continuity;
mod dimensions;
mod files;
mod finite_amplitude;
mod formulas;
mod liquid_figure;
mod physics;
mod pictures;
mod reference;
mod spin;
mod sweeps;
mod third_order;

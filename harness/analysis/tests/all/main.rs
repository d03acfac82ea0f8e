//! Each estimator on signals whose properties are known, for example from closed formulas or from simulations.

mod allan;
mod allan_fit;
mod exponential;
mod features;
mod free_decay;
mod innovations;
mod least_squares;
mod lengths;
mod linear;
mod noise;
mod off_axis;
mod random;
mod rational;
mod residual;
mod rest;
mod rotary;
mod sanathanan_koerner;
mod spa;
mod statistics;
mod sweep;
mod transfer_function;
mod welch;

//! Frequency responses from torque to hub rate, estimated from the signals of a run, and their features.
//!
//! Three estimators answer different questions, and a fourth is for records that are too short for them:
//! * [`demodulation`]: the hub's response while the sweep passes a frequency, as a lock-in amplifier measures
//!   it. It provides `features.csv`.
//! * [`spa`]: MATLAB's Blackman–Tukey estimate over the whole record, as in the thesis. The report compares
//!   it with the response from demodulation.
//! * [`welch`]: the H1 estimate from averaged segments, the usual estimate of a transfer
//!   function from two signals.
//! * [`rational`]: a transfer function fitted to the spectra of the whole record.

pub mod allan;
pub mod demodulation;
pub mod exponential;
pub mod features;
pub mod free_decay;
pub mod gauss_markov;
pub mod innovations;
pub mod least_squares;
pub mod lengths;
pub mod linear;
pub mod noise;
pub mod off_axis;
pub mod random;
pub mod rational;
pub mod residual;
mod response;
pub mod rest;
pub mod rotary;
pub mod sanathanan_koerner;
pub mod spa;
pub mod statistics;
pub mod sweep;
pub mod transfer_function;
pub mod welch;

pub use fourier::Complex64;
pub use response::{BAND, FrequencyResponse, logarithmic_grid};

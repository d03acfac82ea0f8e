//! A whole run of an FMU 2.0 or 3.0 for Co-Simulation in one call of a C library.
//!
//! A host written in Python pays some 3 µs for every call of a C function, and a step takes four.
//! Such a host instantiates and initialises the FMU itself, then hands over the instance, the FMU's
//! functions and arrays with one row per communication point ([`abi`]); the loop over the rows
//! ([`run`]) is done here, with a sampled controller from outputs to inputs if there is one
//! ([`feedback`]). It knows no model, allocates once, and makes the same calls with the same numbers
//! as the host would.

pub mod abi;
pub mod feedback;
pub mod instance;
pub mod run;

//! Estimates parameters of an FMU, with their uncertainty, from recordings of its inputs and outputs; for the slosh bench, torque
//! and rate of the hub.
//!
//! All fits use one [`engine`], which searches the minimum, computes intervals and tests the residual, and which does not
//! depend on FMUs. [`bench`] and [`any_fmu`] formulate the estimation problems of the slosh bench and of other FMUs, and
//! [`methods`] contains the methods of identification for the bench. [`input`] reads recordings, [`model`] simulates FMUs,
//! and [`words`] writes verdicts and pages. [`tuning`] contains those constants of these modules that were chosen by
//! experience and not derived.

pub mod any_fmu;
pub mod bench;
pub mod engine;
pub mod estimate;
pub mod input;
pub mod methods;
pub mod model;
pub mod news;
pub mod tuning;
pub mod words;

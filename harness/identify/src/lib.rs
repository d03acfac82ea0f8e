//! Estimates the FMU's parameters, with their uncertainty, from recordings of torque and hub rate.
//!
//! All fits use one [`engine`], which searches the minimum, computes intervals and tests the residual, and which knows no FMU. [`bench`]
//! and [`any_fmu`] state the estimation problems of the slosh bench and of other FMUs, and [`methods`] contains the kinds of identification
//! of the bench. [`input`] reads recordings, [`model`] runs FMUs, and [`words`] writes verdicts and pages. [`tuning`] has the constants of
//! these modules that are chosen and not derived.

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

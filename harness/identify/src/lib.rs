//! Estimates the FMU's parameters, with their uncertainty, from recordings of torque and hub rate.
//!
//! One [`engine`] makes every fit: it searches, states intervals and tests the residual, and knows no FMU. [`bench`] and [`any_fmu`]
//! are its data for the slosh bench and for other FMUs, [`methods`] what is asked of the bench. [`input`] reads recordings, [`model`]
//! runs FMUs, [`words`] says what was found. [`tuning`] has constants of these that are chosen and not derived.

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

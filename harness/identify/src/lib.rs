//! Estimates the FMU's parameters, with their uncertainty, from recordings of torque and hub rate.
//!
//! Each stage uses the ones before it: [`input`], [`model`], [`fit`], [`uncertainty`], [`words`]. The methods join them:
//! [`methods`] for the bench, [`any_fmu`] for other FMUs. A folder `bench` holds the parts of a stage that only the bench needs,
//! [`tuning`] all constants that are chosen and not derived.

pub mod any_fmu;
pub mod bench;
pub mod engine;
pub mod estimate;
pub mod fit;
pub mod input;
pub mod methods;
pub mod model;
pub mod news;
pub mod tuning;
pub mod uncertainty;
pub mod words;

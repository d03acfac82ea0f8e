//! Closed formulas of slosh for models and harness, in SI units: liquid in an upright cylinder (`cylinder.rs`), to third
//! order in the amplitude (`third_order.rs`) and beyond (`energy_terms.rs`), and with a tilted surface (`tilt.rs`); damping
//! by published correlations (`damping.rs`); limits of the slosh models (`limits.rs`); range of linear theory (`regime.rs`);
//! similarity numbers (`similarity.rs`); and interpolation of fill tables (`interpolation.rs`).

#![no_std]

pub mod cylinder;
pub mod damping;
pub mod energy_terms;
pub mod interpolation;
pub mod limits;
pub mod regime;
pub mod similarity;
pub mod third_order;
pub mod tilt;

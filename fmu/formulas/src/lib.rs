//! Closed formulas of slosh, for the models and for the harness alike: liquid in an upright cylinder
//! (`cylinder.rs`, to third order in the amplitude `third_order.rs`, under gravity that leans `tilt.rs`), damping by published correlations
//! (`damping.rs`), where linear theory ends (`regime.rs`), similarity numbers (`similarity.rs`), and the interpolation of tables over a tank's fill
//! (`interpolation.rs`). SI units. No model is in here.

#![no_std]

pub mod cylinder;
pub mod damping;
pub mod interpolation;
pub mod regime;
pub mod similarity;
pub mod third_order;
pub mod tilt;

//! Modal parameters of the liquid in a tank: a body of revolution of any contour, or a box.
//!
//! A [`Tank`] is read from a TOML file ([`Tank::read`]) and solved at a fill ([`Tank::solve`]): slosh
//! masses, pendulum lengths, heights, wall waves and what stays with the tank, with their error. The
//! theory, the file format and the measured accuracy are in the crate's `README.md`.
//!
//! * [`curve`], [`contour`], [`tank`]: geometry and the file
//! * `ring`, `gauss`, `panel`, `potential_flow`: the boundary integral equation
//! * [`modal`]: modes as pendulums; [`closed_form`]: cylinder, annulus, box
//! * [`sweep`]: tables over the fill and their [`interpolation`]
//! * [`fill_table`]: such tables for FMUs whose tanks drain
//! * [`table()`], [`picture`]: to read and to look at; [`parameters`]: files for the FMUs
//! * [`damping`], [`low_gravity`], [`third_order`]: what the modal parameters leave out; `shape`: which measured shape a
//!   contour is

pub mod closed_form;
pub mod contour;
pub mod curve;
pub mod damping;
pub mod fill_table;
mod gauss;
pub mod interpolation;
pub mod low_gravity;
pub mod modal;
mod panel;
pub mod parameters;
pub mod picture;
mod potential_flow;
mod ring;
mod shape;
mod spline;
mod svg;
pub mod sweep;
mod table;
pub mod tank;
pub mod third_order;

pub use contour::Problems;
pub use modal::{ModalData, Mode, Rest};
pub use table::table;
pub use tank::{Fill, Tank};

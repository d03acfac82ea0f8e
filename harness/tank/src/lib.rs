//! Modal parameters of the liquid in a tank: a body of revolution of any contour, or a box.
//!
//! [`Tank::read`] reads a [`Tank`] from a TOML file, and [`Tank::solve`] solves it at a fill. The
//! result has slosh masses, pendulum lengths, heights, wall waves and the rigid liquid, with their
//! errors. The crate's `README.md` has theory, file format and measured accuracy.
//!
//! * [`curve`], [`contour`], [`tank`]: the geometry of a tank, and its TOML file
//! * `ring`, `gauss`, `panel`, `potential_flow`: solve the boundary integral equation of the liquid
//! * [`modal`]: expresses the modes as pendulums; [`closed_form`]: modes of cylinder, annulus and box by formulas
//! * [`sweep`]: tables over the fill, and their [`interpolation`]
//! * [`fill_table`]: tables over the fill for FMUs whose tanks drain
//! * [`table()`]: a result as text; [`picture`]: drawings; [`parameters`]: files of parameters for the FMUs
//! * [`damping`], [`low_gravity`], [`third_order`], [`finite_amplitude`], [`spin`]: effects beyond the modal parameters
//! * `contour_waves`, `large_waves`, `sphere_waves`: waves of finite amplitude
//! * `shape`: recognises the shapes of tank whose damping has been measured

pub mod closed_form;
pub mod coefficients;
pub mod contour;
mod contour_waves;
pub mod curve;
pub mod damping;
mod fill_amplitude;
pub mod fill_table;
pub mod finite_amplitude;
mod gauss;
pub mod interpolation;
mod large_waves;
pub mod low_gravity;
pub mod modal;
mod panel;
pub mod parameters;
pub mod picture;
mod potential_flow;
mod ring;
mod shape;
mod sphere_waves;
pub mod spin;
mod spline;
mod svg;
pub mod sweep;
mod table;
pub mod tank;
pub mod third_order;

pub use contour::Problems;
#[cfg(feature = "studies")]
pub use large_waves::forced;
pub use modal::{ModalData, Mode, Rest};
pub use table::table;
pub use tank::{Fill, Tank};

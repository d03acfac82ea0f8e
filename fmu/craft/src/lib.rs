//! The physics of a spacecraft in six degrees of freedom with sloshing tanks. The crate models a rigid body with up to four tanks
//! of up to three pendulums each and up to six modes of flexible appendages, and also a single tank for a spacecraft that another
//! program simulates. It contains no FMI, no I/O and no unsafe code, and allocates nothing while stepping.
//!
//! Frames and signs: the inertial frame falls freely with the craft. The body frame is fixed
//! in the dry craft, its origin is O. The attitude q (scalar first) maps body to inertial
//! components. Specific force is what an accelerometer reads. A tank's z axis is its own
//! axis; liquid at rest hangs towards -z. SI units.
//!
//! ```
//! use craft::{Inputs, Parameters, Ramp, Spacecraft};
//!
//! // 1180 kg, one tank with 382 kg of liquid on its axis, thrust along it.
//! let thrust = Inputs { force: Ramp::held([0.0, 0.0, 2400.0]), ..Inputs::default() };
//! let mut craft = Spacecraft::new(&Parameters::default(), &thrust, 0.0, 1e-8).unwrap();
//! // A second with a lateral force that grows from 0 to 10 N.
//! let ramp = Ramp { value: [0.0, 0.0, 2400.0], slope: [10.0, 0.0, 0.0] };
//! craft.step(&Inputs { force: ramp, ..thrust }, 1.0).unwrap();
//! let shown = craft.outputs(&thrust);
//! assert!(shown.tank[0].angle_x[0] < 0.0); // the liquid falls behind
//! assert!((shown.momentum[2] - 2400.0).abs() < 1e-3);
//! ```
//!
//! `spacecraft.rs` and `slosh_tank.rs` are the two components for which there are FMUs. `motion.rs` has the craft's equations,
//! `bob.rs` and `constrained.rs` have the equations of one slosh mode, and `rigid.rs` has the mass matrix. `appendage.rs` has
//! flexible appendages, `lump.rs` describes detached liquid, `handover.rs` its impulses on the craft that carries the tank.
//! `outputs.rs` has energy and momentum. `contents.rs` describes a tank that drains by a table (`table.rs`), `draining.rs` a
//! craft with such tanks, and `spin.rs` liquid that spins. The crate `taylor` integrates.

#![warn(missing_docs)]
#![cfg_attr(not(test), no_std)]

extern crate alloc;

mod appendage;
mod bob;
mod constrained;
mod contents;
mod damping;
mod draining;
mod handover;
mod lump;
mod motion;
mod outputs;
mod overridden;
mod parameters;
mod pivot;
mod ranges;
mod rigid;
mod sizes;
mod slosh_tank;
mod spacecraft;
mod spin;
mod state;
mod surface;
mod table;

pub use appendage::Appendage;
pub use formulas::limits::LimitedBy;
pub use formulas::regime::Regime;
pub use outputs::{Outputs, TankOutputs};
pub use parameters::{Ball, Craft, DampingLaw, Inertia, Init, Mount, Parameters, Tank};
pub use pivot::{Pivot, PivotFriction};
pub use sizes::{APPENDAGES, MODES, POINTS, TANKS};
pub use slosh_tank::{
    Coupling, SloshTank, SloshTankOutputs, TANK_INPUTS, TANK_STATES, TRIANGLE, TankInputs,
    TankParameters, TankState,
};
pub use spacecraft::Spacecraft;
pub use state::{BallState, INPUTS, Inputs, Line, Ramp, Ranges, STATES, State, index};
pub use table::FillTable;
pub use taylor::error::StepError;

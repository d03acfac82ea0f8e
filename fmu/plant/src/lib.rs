//! The physics of HubSlosh: a rigid hub turns about a vertical axis on a bearing with dry friction,
//! and a cylindrical tank sits off the axis. Pendulums represent the liquid. No FMI, no I/O, no
//! unsafe code, no allocation while stepping.
//!
//! Frames and signs: z points up along the bearing axis. The hub's frame turns with theta about +z.
//! x points from the axis to the tank's centre (radial), y along +theta (tangential). SI units.
//!
//! `plant.rs` couples all parts, `state.rs` declares the states, `outputs.rs` and `equations.rs` have the outputs, and
//! the equations for Model Exchange. `motion.rs` integrates and locates stick and slip. `friction/`, `slosh/`,
//! `damping.rs`, `tank.rs`, `suspension.rs`, `wheel.rs` and `imu.rs` have the parts. The integrator and the power series
//! are in the crate `taylor`.

#![warn(missing_docs)]
#![cfg_attr(not(test), no_std)]

extern crate alloc;

mod amplitude;
mod baffle;
mod contact;
mod damping;
mod equations;
mod friction;
mod hub;
mod imu;
mod inputs;
mod leaning;
mod limits;
mod motion;
mod outputs;
mod overridden;
mod parameters;
mod pendulum;
mod plant;
mod slosh;
mod slosh_model;
mod state;
mod suspension;
mod tank;
mod wheel;

pub use contact::Contact;
pub use formulas::limits::LimitedBy;
pub use formulas::regime::Regime;
pub use inputs::{Inputs, Ramp};
pub use outputs::{Discrete, Outputs};
pub use parameters::{
    Bench, DampingLaw, Fluid, Friction, FrictionModel, Hub, Imu, Init, MODES, ModeTable,
    Parameters, Ring, Slosh, SloshSource, Solver, Tank, Wheel,
};
pub use plant::{Plant, StepEnd, StoppedStep};
pub use slosh_model::SloshModel;
pub use state::{INDICATORS, STATES, State, indicator, x};
pub use tank::Calculated;
pub use taylor::error::StepError;

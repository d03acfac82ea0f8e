//! The physics of HubSlosh: a rigid hub turns about a vertical axis on a bearing
//! with dry friction; a cylindrical tank sits off the axis; the liquid in it is a
//! set of pendulums. No FMI, no I/O, no unsafe code, no allocation while stepping.
//!
//! Frames and signs: z up along the bearing's axis; the hub's frame turns with
//! theta about +z; x points from the axis to the tank's centre (radial), y along
//! +theta (tangential). SI units.
//!
//! Where to look: `plant.rs` couples everything, `state.rs` declares the states, `outputs.rs`
//! and `equations.rs` are what a host reads, `motion.rs` steps through time and finds stick
//! and slip, `friction/`, `slosh/`, `damping.rs`, `tank.rs`, `suspension.rs`, `wheel.rs`,
//! `imu.rs` say what their names say,
//! the arithmetic is the crate `taylor`.

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
mod motion;
mod outputs;
mod overridden;
mod parameters;
mod pendulum;
mod plant;
mod slosh;
mod state;
mod suspension;
mod tank;
mod wheel;

pub use contact::Contact;
pub use formulas::regime::Regime;
pub use inputs::{Inputs, Ramp};
pub use outputs::{Discrete, Outputs};
pub use parameters::{
    Bench, DampingLaw, Fluid, Friction, FrictionModel, Hub, Imu, Init, MODES, ModeTable,
    Parameters, Ring, Slosh, SloshModel, SloshSource, Solver, Tank, Wheel,
};
pub use plant::{Plant, StepEnd, StoppedStep};
pub use state::{INDICATORS, STATES, State, indicator, x};
pub use tank::Calculated;
pub use taylor::error::StepError;

//! The physics of HubSlosh: a rigid hub turns about a vertical axis on a bearing
//! with dry friction; a cylindrical tank sits off the axis; the liquid in it is a
//! set of pendulums. No FMI, no I/O, no unsafe code, no allocation while stepping.
//!
//! Frames and signs: z up along the bearing's axis; the hub's frame turns with
//! theta about +z; x points from the axis to the tank's centre (radial), y along
//! +theta (tangential). SI units.
//!
//! Where to look: `hub.rs` couples everything and holds the outputs, `motion.rs`
//! steps through time and finds stick and slip, `friction.rs`, `slosh/`, `tank.rs`,
//! `wheel.rs`, `imu.rs` say what their names say, `series.rs` is the arithmetic.

mod equations;
mod friction;
mod hub;
mod imu;
mod motion;
mod parameters;
mod series;
mod slosh;
mod tank;
mod wheel;

pub use equations::{INDICATORS, STATES};
pub use hub::{Inputs, Outputs, Plant, Ramp, Regime, State};
pub use motion::StepError;
pub use parameters::{
    Fluid, Friction, FrictionModel, Hub, Imu, Init, MODES, Parameters, Slosh, SloshModel, Tank,
    Wheel,
};
pub use tank::Calculated;

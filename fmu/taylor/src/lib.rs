//! The core of the models: what the equations of motion of any of them need, and no physics.
//!
//! A model writes its right-hand side once, as rules for power series ([`series`], [`plane`], [`space`]), and
//! implements [`integrator::Motion`]; [`integrator::advance`] steps it through time. What follows from the states at
//! an instant it writes over [`number::Number`]: the same formula gives value and derivative along a direction.
//! Rates that are not expanded are stepped by [`extrapolation`].
//!
//! Where to look: why a step was refused, `error.rs`; when a series has converged, how long a step is and how many
//! there may be, `integrator.rs`; when an event falls due, `root.rs`.

#![cfg_attr(not(test), no_std)]

extern crate alloc;

pub mod angle;
pub mod error;
pub mod extrapolation;
pub mod integrator;
pub mod number;
pub mod plane;
pub mod ramp;
pub mod root;
pub mod series;
pub mod space;
pub mod vector;

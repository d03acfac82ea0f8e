//! Numerical core of the models: power series, integrators and event times, without physics.
//!
//! A model writes its right-hand side once, as rules for power series ([`series`], [`plane`], [`space`]), and
//! implements [`integrator::Motion`]. [`integrator::advance`] integrates it. Functions of the states at an instant are
//! written over [`number::Number`]: the same formula gives value and derivative along a direction. [`runge_kutta`]
//! integrates rates that are not expanded.
//!
//! `error.rs` has the reasons for a refused step. `integrator.rs` decides when a series has converged, how long a step
//! is, and how many steps are allowed. `root.rs` finds the time of an event.

#![cfg_attr(not(test), no_std)]

extern crate alloc;

pub mod angle;
pub mod error;
pub mod integrator;
pub mod number;
pub mod plane;
pub mod ramp;
pub mod root;
pub mod runge_kutta;
pub mod series;
pub mod space;
pub mod vector;

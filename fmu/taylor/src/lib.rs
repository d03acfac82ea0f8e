//! Numerical methods of the models: power series, integrators and event times. This crate contains no physics.
//!
//! A model writes its right-hand side once, as rules for power series ([`series`], [`plane`], [`space`]), and implements
//! [`integrator::Motion`], which [`integrator::advance`] integrates. Functions of the states at an instant are generic over
//! [`number::Number`], so that the same formula gives a value and its directional derivative. [`runge_kutta`] integrates
//! equations that are not written as power series.
//!
//! `error.rs` defines the reasons for a refused step. `integrator.rs` determines when a series has converged, the length of
//! a step, and how many steps are allowed. `root.rs` finds the times of events.

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

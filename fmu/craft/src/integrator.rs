//! Steps through time: a Taylor-series integrator.
//!
//! Over one step the whole motion is a power series in time (`series.rs`). The order grows
//! until two terms in succession, at the step's end, are below what the tolerance allows; where
//! the highest order does not get there, the step is cut to the length at which it does. So
//! short steps are cheap, nothing is ever rejected, and a step ends exactly where it should.
//!
//! Source: Jorba & Zou, Experimental Mathematics 14 (2005).

use crate::series::{ORDER, for_each_order};

/// Error of one step against the tolerance. A step's error decays with the liquid's motion,
/// within some thousand steps.
pub const STEP_SHARE: f64 = 1e-2;

/// Rates below this are nothing, rad/s: the floor of the error's scale.
pub const RATE_FLOOR: f64 = 1e-6;

/// From here on energies and forces may not be finite, though the states still are.
pub const MAX_MAGNITUDE: f64 = 1e100;

/// The integrator's steps that one call may take: twelve modes need some seconds for them.
pub const MAX_STEPS: usize = 100_000;

/// The lowest order that is trusted to show that a series has converged.
const MIN_ORDER: usize = 5;

/// Terms in succession that must be negligible: a motion that starts at rest is even in time,
/// every second term of it is zero.
const NEGLIGIBLE_TERMS: usize = 2;

/// Why a step was refused; its text is for the user. The state is as before the step.
#[derive(Clone, Debug, PartialEq)]
pub enum StepError {
    /// The step's length is not a finite number above 0.
    Length {
        /// The length, s.
        h: f64,
    },
    /// The motion grew beyond all numbers, or the inputs are not finite.
    NotFinite {
        /// When, s.
        time: f64,
    },
    /// The step needs more work than is allowed.
    TooManySteps {
        /// How far the integrator came, s.
        time: f64,
    },
}

impl core::fmt::Display for StepError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            StepError::Length { h } => {
                write!(f, "a step of {h} s (allowed: a finite length above 0)")
            }
            StepError::NotFinite { time } => write!(
                f,
                "the motion is no longer finite at t = {time} s; check that inputs and their \
                 derivatives are finite and of sensible size"
            ),
            StepError::TooManySteps { time } => write!(
                f,
                "the integrator used up its {MAX_STEPS} steps at t = {time} s; take shorter \
                 communication steps or a looser tolerance, or check for a very short pendulum \
                 (length) or a very stiff one (k)"
            ),
        }
    }
}

impl core::error::Error for StepError {}

/// A motion that can be expanded in a power series.
pub trait Motion {
    /// Coefficient N of every quantity from coefficients up to N of the states, and coefficient
    /// N + 1 of the states.
    fn rates<const N: usize>(&mut self);

    /// Sets what the terms of a step of length `h` are compared with, from coefficients 0 and
    /// 1: what is `allowed` of 1.
    fn set_error_scale(&mut self, h: f64, allowed: f64);

    /// The largest of the states' coefficients n over what is allowed of it.
    fn coefficient_norm(&self, n: usize) -> f64;

    /// Starts the expansion at the present states, `t` seconds into the inputs' ramps.
    fn start(&mut self, t: f64);

    /// Moves the states to `h` after the start by the series cut after order n. Returns whether
    /// they are still finite.
    fn take(&mut self, n: usize, h: f64) -> bool;
}

/// Expands the motion up to `h` ahead. Returns the order and the length, at most `h`, at
/// which the terms left out are below the tolerance.
#[inline(always)]
fn expand<M: Motion>(motion: &mut M, h: f64, tolerance: f64) -> (usize, f64) {
    let mut power = 1.0; // h^(N+1)
    let mut negligible = 0;
    for_each_order!(N => {
        motion.rates::<N>();
        if N == 1 {
            motion.set_error_scale(h, STEP_SHARE * tolerance);
        }
        power *= h;
        if N + 2 >= MIN_ORDER {
            // NaN is not negligible; it ends the step below.
            let is_negligible = motion.coefficient_norm(N + 1) * power <= 1.0;
            negligible = if is_negligible { negligible + 1 } else { 0 };
            if negligible >= NEGLIGIBLE_TERMS {
                return (N + 1, h);
            }
        }
    });
    // The last two terms reach the tolerance at this length.
    let length = |n: usize| {
        let term = motion.coefficient_norm(n);
        if term > 0.0 { libm::exp(-libm::log(term) / n as f64) } else { h }
    };
    (ORDER, h.min(length(ORDER)).min(length(ORDER - 1)))
}

/// Moves the motion on by exactly `h` > 0 from the time `begin`. On an error its states are
/// unusable.
pub fn advance<M: Motion>(
    motion: &mut M,
    begin: f64,
    h: f64,
    tolerance: f64,
) -> Result<(), StepError> {
    let (mut t, mut steps) = (0.0, 0);
    while t < h {
        steps += 1;
        if steps > MAX_STEPS {
            return Err(StepError::TooManySteps { time: begin + t });
        }
        motion.start(t);
        let left = h - t;
        let (n, length) = expand(motion, left, tolerance);
        t = if length == left { h } else { t + length };
        let is_step = length > 0.0 && length.is_finite();
        if !is_step || !motion.take(n, length) {
            return Err(StepError::NotFinite { time: begin + t });
        }
    }
    Ok(())
}

//! Steps through time: a Taylor-series integrator with events.
//!
//! Over one step the whole motion is a power series in time (`series.rs`). The order grows
//! until terms in a row, at the step's end, are below what the tolerance allows; where the highest
//! order does not get there, the step is cut to the length at which it does. So short steps are cheap,
//! nothing is ever rejected, and the series between the ends is as exact as at the ends: a step ends
//! exactly where it should, and events are roots of polynomials (`root.rs`), found without stepping back.
//!
//! Source: Jorba & Zou, Experimental Mathematics 14 (2005).

use crate::error::StepError;
use crate::for_each_order;
use crate::series::ORDER;

/// Error of one step against the tolerance. A step's error decays with the liquid's motion,
/// within some thousand steps.
pub const STEP_SHARE: f64 = 1e-2;

/// Rates below this are nothing, rad/s: the floor of the error's scale.
pub const RATE_FLOOR: f64 = 1e-6;

/// From here on energies and forces may not be finite, though the states still are.
pub const MAX_MAGNITUDE: f64 = 1e100;

/// The longest expansion, s: its powers up to the highest order do not overflow.
const LONGEST: f64 = 1e9;

/// The lowest order that is trusted to show that a series has converged.
const MIN_ORDER: usize = 5;

/// What two orders must take off a term for its decay to be relied on.
const DECAY: f64 = 0.1;

/// What is allowed of a term that is foretold, of what is allowed of one that is known.
const FORETOLD: f64 = 0.25;

/// The integrator's steps that one call may take, and those that it has taken.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    taken: usize,
    max: usize,
    advice: &'static str,
}

impl Steps {
    /// None taken yet of `max`; `advice` is what to do where they do not suffice.
    pub fn new(max: usize, advice: &'static str) -> Steps {
        // A fuzzer's sanitizer makes each step dear.
        let max = if cfg!(fuzzing) { max.min(200) } else { max };
        Steps { taken: 0, max, advice }
    }

    /// Counts steps or what costs as much, at `time`.
    ///
    /// # Errors
    /// There have been too many.
    #[inline(always)]
    pub fn count(&mut self, number: usize, time: f64) -> Result<(), StepError> {
        self.taken += number;
        if self.taken > self.max { Err(self.too_many(time)) } else { Ok(()) }
    }

    #[cold]
    fn too_many(&self, time: f64) -> StepError {
        StepError::TooManySteps { time, max_steps: self.max, advice: self.advice }
    }

    /// How many are left.
    pub fn left(&self) -> usize {
        self.max - self.taken
    }
}

/// When a motion's series have converged. A motion that starts at rest is even in time, every second term of it is
/// zero: at least two terms in succession must be negligible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Convergence {
    /// When so many terms in succession are negligible.
    Terms(usize),
    /// When two are, the second of them as the decay of the terms before foretells.
    Decay,
}

/// What two terms in succession, n + 1 and n, over what is allowed of them, have to be: negligible, the second of them
/// as foretold, for terms n, n - 1, n - 2, n - 3.
///
/// t_(n+1) is foretold from n - 1 by what two orders have taken off n - 2 and n - 3:
/// t_(n+1) = t_(n-1) max(t_n/t_(n-2), t_(n-1)/t_(n-3)).
#[inline(always)]
fn are_negligible([now, one, two, three]: [f64; 4]) -> bool {
    let decays = now <= DECAY * two && one <= DECAY * three;
    let foretold = one * now <= FORETOLD * two && one * one <= FORETOLD * three;
    // NaN is not negligible; it ends the step.
    now <= 1.0 && (one <= 1.0 || decays && foretold)
}

/// A motion that can be expanded in a power series.
pub trait Motion {
    /// Whether expansions are compiled with the sums of every order written out: about twice as fast,
    /// more code.
    const UNROLLED: bool = true;

    /// Starts the expansion at the present states, `t` after the start of the call.
    fn start(&mut self, t: f64);

    /// Coefficient n of every quantity from coefficients up to n of the states, and coefficient
    /// n + 1 of the states.
    fn rates(&mut self, n: usize);

    /// Sets what the terms of a step of length `h` are compared with, from coefficients 0 and
    /// 1: what is `allowed` of 1. Returns how far the series reach: `h`, or less.
    fn set_error_scale(&mut self, h: f64, allowed: f64) -> f64;

    /// The largest of the states' coefficients n over what is allowed of it.
    fn coefficient_norm(&self, n: usize) -> f64;

    /// Whether coefficient n times `power` is within what is allowed.
    #[inline(always)]
    fn is_negligible(&self, n: usize, power: f64) -> bool {
        self.coefficient_norm(n) * power <= 1.0
    }

    /// When the series have converged.
    #[inline(always)]
    fn convergence(&self) -> Convergence {
        Convergence::Decay
    }

    /// The highest order of an expansion.
    #[inline(always)]
    fn highest_order(&self) -> usize {
        ORDER
    }

    /// When, within `h` after the start of the expansion, an event ends it, by the series cut after
    /// order n.
    #[inline(always)]
    fn event(&mut self, _n: usize, _h: f64) -> Option<f64> {
        None
    }

    /// Moves the states by the series cut after order n to `h` after the start of the expansion, which
    /// is `t` after the start of the call; there is the event that was found last, if there was one.
    ///
    /// # Errors
    /// The states are not finite, or the model does not hold there.
    fn take(&mut self, n: usize, h: f64, t: f64, steps: &mut Steps) -> Result<(), StepError>;
}

/// How far an expansion has come.
struct Reach {
    /// Its length, s.
    h: f64,
    /// h^(n + 1) after order n.
    power: f64,
    /// The last terms over what is allowed of them, the newest first.
    terms: [f64; 4],
    /// How many of the last terms in succession were negligible.
    negligible: usize,
}

/// Order n of an expansion. Returns whether it is enough.
#[inline(always)]
fn expand_order<M: Motion>(motion: &mut M, n: usize, tolerance: f64, reach: &mut Reach) -> bool {
    motion.rates(n);
    if n == 1 {
        reach.h = motion.set_error_scale(reach.h, STEP_SHARE * tolerance);
        reach.power = reach.h;
    }
    reach.power *= reach.h;
    match motion.convergence() {
        Convergence::Terms(count) => {
            if n + 2 < MIN_ORDER {
                return false;
            }
            reach.negligible =
                if motion.is_negligible(n + 1, reach.power) { reach.negligible + 1 } else { 0 };
            reach.negligible >= count
        }
        Convergence::Decay => {
            if n + 4 < MIN_ORDER {
                return false;
            }
            let [now, one, two, _] = reach.terms;
            reach.terms = [motion.coefficient_norm(n + 1) * reach.power, now, one, two];
            n + 1 >= MIN_ORDER && are_negligible(reach.terms)
        }
    }
}

/// Expands the motion up to `h` ahead. Returns the order and the length, at most `h`, at
/// which the terms left out are below the tolerance.
#[inline(always)]
fn expand<M: Motion>(motion: &mut M, h: f64, tolerance: f64) -> (usize, f64) {
    let mut reach =
        Reach { h: h.min(LONGEST), power: 1.0, terms: [f64::INFINITY; 4], negligible: 0 };
    let highest = motion.highest_order();
    if M::UNROLLED {
        for_each_order!(N => {
            if expand_order(motion, N, tolerance, &mut reach) {
                return (N + 1, reach.h);
            }
        });
    } else {
        for n in 0..highest {
            if expand_order(motion, n, tolerance, &mut reach) {
                return (n + 1, reach.h);
            }
        }
    }
    // The last two terms reach the tolerance at this length.
    let h = reach.h;
    let length = |n: usize| {
        let term = motion.coefficient_norm(n);
        if term > 0.0 { libm::exp(-libm::log(term) / n as f64) } else { h }
    };
    (highest, h.min(length(highest)).min(length(highest - 1)))
}

/// Moves the motion on by exactly `h` > 0 from the time `begin`. On an error its states are
/// unusable.
///
/// # Errors
/// See [`StepError`].
#[inline(always)]
pub fn advance<M: Motion>(
    motion: &mut M,
    begin: f64,
    h: f64,
    tolerance: f64,
    steps: &mut Steps,
) -> Result<(), StepError> {
    let mut t = 0.0;
    while t < h {
        steps.count(1, begin + t)?;
        motion.start(t);
        let left = h - t;
        let (n, length) = expand(motion, left, tolerance);
        let event = motion.event(n, length);
        let length = event.unwrap_or(length);
        // An event may be due at once.
        if !(length.is_finite() && (length > 0.0 || event.is_some())) {
            return Err(StepError::NotFinite { time: begin + t });
        }
        t = if length == left { h } else { t + length };
        motion.take(n, length, t, steps)?;
    }
    Ok(())
}

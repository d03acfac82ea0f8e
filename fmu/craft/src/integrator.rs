//! Steps through time: a Taylor-series integrator.
//!
//! Over one step the whole motion is a power series in time (`series.rs`). The order grows
//! until two terms in succession, at the step's end, are below what the tolerance allows, the second
//! of them as the decay of the terms before foretells; where the highest order does not get there,
//! the step is cut to the length at which it does. So short steps are cheap, nothing is ever
//! rejected, and a step ends exactly where it should.
//!
//! Craft with tanks that drain are extrapolated instead, with rejections, see [`advance_by_extrapolation`].
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

/// The integrator's steps that one call may take, unless a parameter says otherwise: twelve modes need
/// some seconds for them. It stops what would never end; what keeps any step below 0.1 s, 650 where twelve modes
/// drain, would refuse single steps over minutes, which take thousands.
pub const MAX_STEPS: usize = 100_000;

/// What one call may take.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Relative error.
    pub tolerance: f64,
    /// Steps of the integrator.
    pub max_steps: usize,
}

impl Limits {
    /// Counts a step that starts at `time`, unless there have been too many.
    fn count(&self, steps: &mut usize, time: f64) -> Result<(), StepError> {
        // A fuzzer's sanitizer makes each step dear.
        let max_steps = if cfg!(fuzzing) { self.max_steps.min(200) } else { self.max_steps };
        *steps += 1;
        if *steps > max_steps { Err(StepError::TooManySteps { time, max_steps }) } else { Ok(()) }
    }
}

/// The lowest order that is trusted to show that a series has converged.
const MIN_ORDER: usize = 5;

/// What two orders must take off a term for its decay to be relied on.
const DECAY: f64 = 0.1;

/// What is allowed of a term that is foretold, of what is allowed of one that is known.
const FORETOLD: f64 = 0.25;

/// Whether term n and those after it are negligible, for terms n, n - 1, n - 2, n - 3 over what is allowed.
///
/// A motion that starts at rest is even in time, every second term of it is zero: two in succession must be. The
/// second, n + 1, is foretold from n - 1 by what two orders have taken off n - 2 and n - 3:
/// t_(n+1) = t_(n-1) max(t_n/t_(n-2), t_(n-1)/t_(n-3)).
fn are_negligible([now, one, two, three]: [f64; 4]) -> bool {
    let decays = now <= DECAY * two && one <= DECAY * three;
    let foretold = one * now <= FORETOLD * two && one * one <= FORETOLD * three;
    // NaN is not negligible; it ends the step.
    now <= 1.0 && (one <= 1.0 || decays && foretold)
}

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
    /// A tank drains or fills beyond the ends of its table.
    BeyondTable {
        /// Which, from 1; 0: there is one only.
        tank: usize,
        /// The mass of liquid that it would reach, kg.
        liquid: f64,
        /// The table's ends, kg.
        ends: [f64; 2],
    },
    /// The step needs more work than is allowed.
    TooManySteps {
        /// How far the integrator came, s.
        time: f64,
        /// `solver.max_steps`.
        max_steps: usize,
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
            StepError::BeyondTable { tank, liquid, ends: [low, high] } => {
                let index = if *tank > 0 { format!("[{tank}]") } else { String::new() };
                write!(
                    f,
                    "mass_flow{index} would leave {liquid} kg in tank{index} (allowed: {low} to {high} kg, \
                     the ends of its table fill.liquid)"
                )
            }
            StepError::TooManySteps { time, max_steps } => write!(
                f,
                "the step was stopped at t = {time} s after solver.max_steps = {max_steps} internal \
                 steps; use shorter communication steps, a looser tolerance or a larger \
                 solver.max_steps, or check for a very short pendulum (length) or a very stiff one (k)"
            ),
        }
    }
}

impl core::error::Error for StepError {}

impl StepError {
    /// The same with its time counted from `begin` instead of from there.
    pub(crate) fn after(mut self, begin: f64) -> StepError {
        if let StepError::NotFinite { time } | StepError::TooManySteps { time, .. } = &mut self {
            *time += begin;
        }
        self
    }
}

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
    let mut terms = [f64::INFINITY; 4];
    for_each_order!(N => {
        motion.rates::<N>();
        if N == 1 {
            motion.set_error_scale(h, STEP_SHARE * tolerance);
        }
        power *= h;
        if N + 4 >= MIN_ORDER {
            let [now, one, two, _] = terms;
            terms = [motion.coefficient_norm(N + 1) * power, now, one, two];
            if N + 1 >= MIN_ORDER && are_negligible(terms) {
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

/// A system of first order, x' = rates(t, x), that [`advance_by_extrapolation`] moves on.
pub trait System<const D: usize> {
    /// The rates of the states, `t` after the start of the call.
    fn rates(&self, t: f64, x: &[f64; D]) -> [f64; D];

    /// What the errors of a step are compared with, from states and rates at its start t; `h`: how far there is to go.
    fn error_scale(&self, t: f64, x: &[f64; D], rate: &[f64; D], h: f64) -> [f64; D];
}

/// Columns of an extrapolation.
const COLUMNS: usize = 8;

/// Rounding of a step, of its scale and of 1 rad, rad/s, m, m/s: no smaller error is asked for. Below these terms may
/// cancel in the rates that are not small themselves.
const ROUNDING: f64 = 2e-14;

/// How much longer or shorter a step may be than the one before.
const LONGER: f64 = 4.0;
const SHORTER: f64 = 0.1;

/// Errors below this, which make no step longer than [`LONGER`] allows, count as this: 1/0 and powers of numbers near
/// the largest end the process of a host that traps them.
const LEAST_ERROR: f64 = 1e-30;

/// Evaluations of the rates up to column k (from 0).
fn work(k: usize) -> f64 {
    (1 + (k + 1) * (k + 2)) as f64
}

/// One step of an extrapolation.
struct Trial<const D: usize> {
    /// The states at its end, where two columns agree.
    end: Option<[f64; D]>,
    /// The length, s, with the least work per second.
    best: f64,
}

/// Moves x, whose rates at t are `first`, on by `h` with Gragg's midpoint rule of 2, 4, ... 16 steps, extrapolated to
/// steps of length 0 until two columns agree to `allowed`. Gives up where the columns hardly come nearer to each other.
fn extrapolate<const D: usize>(
    system: &impl System<D>,
    x: &[f64; D],
    first: &[f64; D],
    (t, h): (f64, f64),
    allowed: &[f64; D],
) -> Trial<D> {
    let mut before = [[0.0; D]; COLUMNS];
    let (mut least, mut best) = (f64::INFINITY, SHORTER * h);
    let mut error_before = f64::INFINITY;
    for k in 0..COLUMNS {
        let n = 2 * (k + 1);
        let step = h / n as f64;
        let (mut last, mut now) = (*x, *x);
        for i in 0..D {
            now[i] += step * first[i];
        }
        for j in 1..n {
            let rate = system.rates(t + j as f64 * step, &now);
            for i in 0..D {
                (last[i], now[i]) = (now[i], last[i] + 2.0 * step * rate[i]);
            }
        }
        let rate = system.rates(t + h, &now);
        let mut row = [[0.0; D]; COLUMNS];
        for i in 0..D {
            row[0][i] = 0.5 * (now[i] + last[i] + step * rate[i]);
        }
        for j in 1..=k {
            let ratio = n as f64 / (2 * (k + 1 - j)) as f64;
            for i in 0..D {
                row[j][i] =
                    row[j - 1][i] + (row[j - 1][i] - before[j - 1][i]) / (ratio * ratio - 1.0);
            }
        }
        if k >= 2 {
            let error = (0..D).fold(0.0, |largest, i| {
                let error = (row[k][i] - row[k - 1][i]).abs() / allowed[i];
                // NaN is an error without bounds.
                if error <= largest { largest } else { f64::min(error, f64::MAX) }
            });
            // Error of column k - 1: h^(2k + 1).
            let change =
                0.94 * libm::pow(0.65 / f64::max(error, LEAST_ERROR), 1.0 / (2 * k + 1) as f64);
            let length = h * change.clamp(SHORTER, LONGER);
            let is_best = work(k) / length < least;
            if is_best {
                (least, best) = (work(k) / length, length);
            }
            if error <= 1.0 {
                // One column more would be better still.
                if is_best && k + 1 < COLUMNS {
                    best = f64::min(best * work(k + 1) / work(k), LONGER * h);
                }
                return Trial { end: Some(row[k]), best };
            }
            if error > 0.1 * error_before {
                break;
            }
            error_before = error;
        }
        before = row;
    }
    Trial { end: None, best }
}

/// How an extrapolation goes on from one stretch of a call to the next.
pub struct Pace {
    /// The steps that the call has tried.
    steps: usize,
    /// Length of the next step, s.
    h: f64,
}

impl Pace {
    /// At the start of a call over `h`: the first step tries the whole.
    pub fn new(h: f64) -> Pace {
        Pace { steps: 0, h }
    }
}

/// Moves x from `begin` to `end` by extrapolation, in as many steps as the tolerance needs. A step's length follows
/// from the errors of the columns before, what they are compared with from the states at its start: after a rejection
/// steps grow again.
///
/// Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.9.
pub fn advance_by_extrapolation<const D: usize>(
    system: &impl System<D>,
    x: &mut [f64; D],
    (begin, end): (f64, f64),
    limits: Limits,
    pace: &mut Pace,
) -> Result<(), StepError> {
    let mut t = begin;
    while t < end {
        let first = system.rates(t, x);
        let allowed = system.error_scale(t, x, &first, end - t).map(|scale| {
            f64::max(STEP_SHARE * limits.tolerance * scale, ROUNDING * f64::max(scale, 1.0))
        });
        loop {
            limits.count(&mut pace.steps, t)?;
            let is_last = t + pace.h >= end;
            let h = if is_last { end - t } else { pace.h };
            let Trial { end: moved, best } = extrapolate(system, x, &first, (t, h), &allowed);
            let Some(moved) = moved else {
                pace.h = f64::min(best, h / 2.0);
                if t + pace.h <= t {
                    return Err(StepError::NotFinite { time: t });
                }
                continue;
            };
            if !moved.iter().all(|x| x.abs() < MAX_MAGNITUDE) {
                return Err(StepError::NotFinite { time: t });
            }
            *x = moved;
            t = if is_last { end } else { t + h };
            // A step that a stretch's end has cut short says less of the next than the one before.
            pace.h = if is_last { f64::max(best, pace.h) } else { best };
            break;
        }
    }
    Ok(())
}

/// Moves the motion on by exactly `h` > 0 from the time `begin`. On an error its states are
/// unusable.
pub fn advance<M: Motion>(
    motion: &mut M,
    begin: f64,
    h: f64,
    limits: Limits,
) -> Result<(), StepError> {
    let (mut t, mut steps) = (0.0, 0);
    while t < h {
        limits.count(&mut steps, begin + t)?;
        motion.start(t);
        let left = h - t;
        let (n, length) = expand(motion, left, limits.tolerance);
        t = if length == left { h } else { t + length };
        let is_step = length > 0.0 && length.is_finite();
        if !is_step || !motion.take(n, length) {
            return Err(StepError::NotFinite { time: begin + t });
        }
    }
    Ok(())
}

//! Taylor-series integrator with events.
//!
//! In one step the whole motion is a power series in time (`series.rs`). The order is increased until successive terms at
//! the step's end are below the tolerance. If the highest order is not enough, the step is shortened to the length for which
//! it is enough. Short steps are therefore cheap, and no step is rejected. The series is as exact within the step as at its
//! end. A step ends exactly at the requested time, and events are roots of polynomials (`root.rs`), so that no step is
//! repeated to find them.
//!
//! [`advance`] starts a new series in each call. [`advance_kept`] continues the series of the previous call, so that results
//! do not depend on the times at which calls end.
//!
//! Source: Jorba & Zou, Experimental Mathematics 14 (2005).

use core::ops::ControlFlow;

use crate::error::StepError;
use crate::for_each_order;
use crate::series::ORDER;

/// Allowed error of one internal step, divided by the allowed error of the whole motion. It is less than 1 because the
/// errors of some thousand steps add up until the liquid's damping removes them.
pub const STEP_SHARE: f64 = 1e-2;

/// Smallest rate, rad/s, to which an allowed error is relative. Rates below it are negligible.
pub const RATE_FLOOR: f64 = 1e-6;

/// Largest magnitude of a state. Above it energies and forces may overflow although the states do not.
pub const MAX_MAGNITUDE: f64 = 1e30;

/// Longest expansion, s, for which the powers of the length up to the highest order do not overflow.
const LONGEST: f64 = 1e9;

const MIN_ORDER: usize = 5;

/// Largest ratio of two terms of a power series, two orders apart, for which the following terms are predicted from the
/// decay of the previous terms.
const DECAY: f64 = 0.1;

/// Allowed magnitude of a predicted term of the series, divided by the allowed magnitude of a computed term.
const PREDICTED_SHARE: f64 = 0.25;

/// Largest magnitude of the last computed term of a series, divided by its allowed magnitude, for which the
/// following terms are predicted.
const LARGEST_LAST: f64 = 30.0;

/// Length of a step, s, from which on a step may have the whole allowed error. In a kept
/// [`Expansion`] the allowed error of a shorter step is proportional to its length, because the
/// errors of many short steps add up. If a call ends later than this after the start of the
/// expansion, its derivatives are compared with the right-hand side.
const FULL_LENGTH: f64 = 0.1;

/// Largest error of the functions with rounded corners ([`Motion::defect`]) at the end of a step,
/// divided by the allowed error of the step's terms. A step with a larger error is repeated with
/// half the length.
const DEFECT: f64 = 10.0;

/// Counter of the internal steps of one call: `taken` is the number of steps so far, and `max` the largest allowed number.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    taken: usize,
    max: usize,
    advice: &'static str,
}

impl Steps {
    /// Creates a counter for at most `max` steps. `advice` is the end of the error message if more
    /// steps are needed, and states what the user can change.
    pub const fn new(max: usize, advice: &'static str) -> Steps {
        Steps { taken: 0, max, advice }
    }

    /// Counts `number` more steps, or other work of the same cost, at the time `time`.
    ///
    /// # Errors
    /// If the limit is exceeded.
    #[inline(always)]
    pub fn add_steps(&mut self, number: usize, time: f64) -> Result<(), StepError> {
        self.taken += number;
        if self.taken > self.max { Err(self.too_many(time)) } else { Ok(()) }
    }

    #[cold]
    fn too_many(&self, time: f64) -> StepError {
        StepError::TooManySteps { time, max_steps: self.max, advice: self.advice }
    }

    pub fn left(&self) -> usize {
        self.max - self.taken
    }
}

/// Criterion by which the power series of a motion is long enough. `Terms` requires the given number of successive
/// negligible terms. `Decay` requires two successive negligible terms, which may be predicted from the decay of the previous
/// terms. One negligible term is not enough, because a motion that starts at rest is an even function of time, so that every
/// second term is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Convergence {
    Terms(usize),
    Decay,
}

/// Returns true if the series may end with term n, because two successive terms are negligible: n -
/// 1 and n, n and n + 1, or n + 1 and n + 2. The arguments are the terms n, n - 1, n - 2 and n - 3,
/// each divided by its allowed error.
///
/// The terms after n are not computed but predicted from the slower of two decays, each over two
/// orders: t_(n+1) = t_(n-1) max(t_n/t_(n-2), t_(n-1)/t_(n-3)). In the same way t_(n+2) follows
/// from t_n.
#[inline(always)]
fn are_negligible([now, one, two, three]: [f64; 4]) -> bool {
    // NaN is not negligible; another check ends the step if states are not finite.
    if now <= 1.0 && one <= 1.0 {
        return true;
    }
    let decays = now <= DECAY * two && one <= DECAY * three;
    let is_small =
        |term: f64| term * now <= PREDICTED_SHARE * two && term * one <= PREDICTED_SHARE * three;
    decays && is_small(one) && (now <= 1.0 || now <= LARGEST_LAST && is_small(now))
}

/// A motion that [`advance`] can expand in a power series. Lengths of steps and times are in s.
pub trait Motion {
    /// True if expansions are compiled with the sums of every order written out, which is about twice as fast
    /// but gives larger code.
    const UNROLLED: bool = true;

    /// Starts the expansion at the present states, at the time `t` after the start of the call.
    fn start(&mut self, t: f64);

    /// Computes coefficient n of every quantity from coefficients up to n of the states, and then coefficient
    /// n + 1 of the states.
    fn rates(&mut self, n: usize);

    /// Sets the magnitudes to which the errors of a step of length `h` are relative, from coefficients 0 and 1; `allowed` is
    /// the allowed relative error. Returns the time, at most `h`, over which the series is valid, from coefficients 0 to 2
    /// of every quantity. It is shorter than `h` for example if a function with a rounded corner has singularities near the
    /// real axis, which later coefficients may not show.
    fn set_error_scale(&mut self, h: f64, allowed: f64) -> f64;

    /// Returns the norm of coefficient n of the states' series: the largest of these coefficients,
    /// each divided by its allowed error.
    fn coefficient_norm(&self, n: usize) -> f64;

    #[inline(always)]
    fn is_negligible(&self, n: usize, power: f64) -> bool {
        self.coefficient_norm(n) * power <= 1.0
    }

    #[inline(always)]
    fn convergence(&self) -> Convergence {
        Convergence::Decay
    }

    #[inline(always)]
    fn highest_order(&self) -> usize {
        ORDER
    }

    /// Returns the error of the series of functions with rounded corners at the time `h` after the start of the expansion,
    /// divided by the allowed error. The error is the difference between the series up to order n and the function itself.
    #[inline(always)]
    fn defect(&self, _n: usize, _h: f64) -> f64 {
        0.0
    }

    /// Returns the time of the first event within `h` after the start of the expansion, from the series up to
    /// order n, if there is one.
    #[inline(always)]
    fn event(&mut self, _n: usize, _h: f64) -> Option<f64> {
        None
    }

    /// Advances the states to the time `h` after the start of the expansion (which was `t` after the start of the call), by
    /// the series up to order n. If the last call of [`Motion::event`] has found an event, the event is at `h`. Returns
    /// `Continue` if the call goes on, otherwise `Break` with the elapsed time.
    ///
    /// # Errors
    /// If the states at `h` are not finite, or the model is not valid for them.
    fn take(
        &mut self,
        n: usize,
        h: f64,
        t: f64,
        steps: &mut Steps,
    ) -> Result<ControlFlow<f64>, StepError>;
}

/// A motion whose expansion can be continued by further calls of [`advance_kept`].
pub trait KeptMotion: Motion {
    fn expansion(&mut self) -> &mut Expansion;

    /// Stores the derivatives of the states at the time `h` after the start of the expansion, from the series up to order n.
    #[inline(always)]
    fn store_slopes(&mut self, _n: usize, _h: f64) {}

    /// Returns the error of the states over the time `h`, divided by the allowed error. It follows
    /// from the derivatives that [`KeptMotion::store_slopes`] has stored minus the derivatives of
    /// the right-hand side.
    #[inline(always)]
    fn slope_defect(&self, _h: f64) -> f64 {
        0.0
    }

    /// Restores the states that [`Motion::keep`] has stored.
    #[inline(always)]
    fn return_to_start(&mut self) {}

    /// Stores the present states as the start of the next kept [`Expansion`].
    #[inline(always)]
    fn keep(&mut self) {}
}

/// Progress of the computation of a power series for a step of the length `h`, s.
struct Progress {
    h: f64,
    power: f64,        // h^(n + 1) after order n
    terms: [f64; 4],   // last terms over their allowed errors, the newest first
    negligible: usize, // number of successive negligible terms at the end
}

#[inline(always)]
fn expand_order<M: Motion>(
    motion: &mut M,
    n: usize,
    tolerance: f64,
    progress: &mut Progress,
) -> bool {
    motion.rates(n);
    if n == 2 {
        progress.h = motion.set_error_scale(progress.h, STEP_SHARE * tolerance);
        progress.power = progress.h * progress.h;
        if motion.convergence() == Convergence::Decay {
            progress.terms[0] = motion.coefficient_norm(n) * progress.power;
        }
    }
    progress.power *= progress.h;
    match motion.convergence() {
        Convergence::Terms(count) => {
            if n + 2 < MIN_ORDER {
                return false;
            }
            progress.negligible = if motion.is_negligible(n + 1, progress.power) {
                progress.negligible + 1
            } else {
                0
            };
            progress.negligible >= count
        }
        Convergence::Decay => {
            if n + 3 < MIN_ORDER {
                return false;
            }
            let [now, one, two, _] = progress.terms;
            progress.terms = [motion.coefficient_norm(n + 1) * progress.power, now, one, two];
            n + 1 >= MIN_ORDER && are_negligible(progress.terms)
        }
    }
}

/// Computes the power series of `motion` from its present states. Returns the order n of the last
/// term, and the length of the step, s: at most `h`, and short enough that the omitted terms are
/// below `tolerance`.
#[inline(always)]
fn expand<M: Motion>(motion: &mut M, h: f64, tolerance: f64) -> (usize, f64) {
    let mut progress =
        Progress { h: h.min(LONGEST), power: 1.0, terms: [f64::INFINITY; 4], negligible: 0 };
    let highest = motion.highest_order();
    if M::UNROLLED {
        for_each_order!(N => {
            if expand_order(motion, N, tolerance, &mut progress) {
                return (N + 1, progress.h);
            }
        });
    } else {
        for n in 0..highest {
            if expand_order(motion, n, tolerance, &mut progress) {
                return (n + 1, progress.h);
            }
        }
    }
    let mut norms = [0.0; ORDER + 1];
    for n in [highest - 1, highest] {
        norms[n] = motion.coefficient_norm(n);
    }
    (highest, length(&norms, highest, progress.h))
}

/// Advances the motion by exactly `h` > 0 from the time `begin`. If the motion ends the call itself ([`Motion::take`]),
/// returns the elapsed time. If an error is returned, the states are invalid.
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
) -> Result<ControlFlow<f64>, StepError> {
    let mut t = 0.0;
    while t < h {
        steps.add_steps(1, begin + t)?;
        motion.start(t);
        let left = h - t;
        let (n, mut length) = expand(motion, left, tolerance);
        while motion.defect(n, length) > DEFECT {
            length /= 2.0;
            steps.add_steps(1, begin + t)?;
        }
        // An event may be due immediately.
        let (length, moves) = match motion.event(n, length) {
            Some(event) => (event, event.is_finite()),
            None => (length, length > 0.0 && length.is_finite()),
        };
        if !moves {
            return Err(StepError::NotFinite { time: begin + t });
        }
        t = if length == left { h } else { t + length };
        if let ControlFlow::Break(t) = motion.take(n, length, t, steps)? {
            return Ok(ControlFlow::Break(t));
        }
    }
    Ok(ControlFlow::Continue(()))
}

/// Adds `t`, s, to a time that consists of two numbers: the rounded sum and the rounding error of this sum. Many small steps
/// can thus be added without error.
#[inline(always)]
pub fn add_time([time, rest]: [f64; 2], t: f64) -> [f64; 2] {
    // This is Knuth's sum of two numbers and its rounding error, followed by Dekker's sum.
    let sum = time + t;
    let added = sum - time;
    let rest = rest + ((time - (sum - added)) + (t - added));
    let total = sum + rest;
    [total, rest - (total - sum)]
}

/// An expansion that calls of [`advance_kept`] continue while the inputs are constant or keep their slopes. Each call
/// computes as many orders as its end needs. The state at an instant depends only on the start of the expansion and on the
/// time since this start, and not on the times at which earlier calls have ended.
#[derive(Clone, Debug)]
pub struct Expansion {
    orders: usize,
    /// Number of orders, from order 0 on, whose coefficients were overwritten, because another
    /// computation has used the motion since the expansion.
    overwritten: usize,
    norms: [f64; ORDER + 1],
    radius: f64,
    end: Option<(usize, f64)>,
    /// A call that ends up to this time after the start of the expansion, s, needs no comparison of
    /// its derivatives with the right-hand side.
    verified: f64,
}

impl Default for Expansion {
    fn default() -> Self {
        let norms = [0.0; ORDER + 1];
        Expansion {
            orders: 0,
            overwritten: 0,
            norms,
            radius: f64::INFINITY,
            end: None,
            verified: FULL_LENGTH,
        }
    }
}

impl Expansion {
    /// Returns the number of orders whose coefficients are known; 0 if another computation has
    /// overwritten any of them.
    pub fn orders(&self) -> usize {
        if self.overwritten == 0 { self.orders } else { 0 }
    }

    #[inline(always)]
    pub fn clear(&mut self) {
        (self.orders, self.overwritten, self.end, self.verified) = (0, 0, None, FULL_LENGTH);
    }

    /// Records that another computation has overwritten the coefficients below `order` of all
    /// quantities, and coefficient `order` of the states. `order` is at most 4.
    #[inline(always)]
    pub fn overwrite(&mut self, order: usize) {
        debug_assert!(order <= 4, "`repair` computes four orders");
        self.overwritten = self.overwritten.max(order);
    }
}

/// Computes the overwritten coefficients of the expansion again. The expansion starts at the time `t`, s.
// Only four orders are compiled: all of them would be a sixth of the binary.
#[inline(never)]
fn repair<M: KeptMotion>(motion: &mut M, t: f64) {
    let Expansion { overwritten, orders, .. } = *motion.expansion();
    if orders > 0 {
        motion.start(t);
        for_each_order!(N => {
            if N < overwritten.min(orders) {
                motion.rates(N);
            }
        }; 0 1 2 3);
    }
    motion.expansion().overwritten = 0;
}

/// Computes coefficient n + 1 of the states' series, and the norm of this coefficient.
#[inline(always)]
fn compute_order<M: KeptMotion>(motion: &mut M, n: usize, tolerance: f64) {
    motion.rates(n);
    if n == 2 {
        let radius = motion.set_error_scale(LONGEST, STEP_SHARE * tolerance).min(LONGEST);
        motion.expansion().radius = radius;
        motion.expansion().norms[2] = motion.coefficient_norm(2);
    }
    if n >= 2 {
        motion.expansion().norms[n + 1] = motion.coefficient_norm(n + 1);
    }
    motion.expansion().orders = n + 1;
}

/// Search for the order up to which a series is exact at the time `t` after the start of the
/// expansion.
struct Search {
    t: f64,
    tolerance: f64,
    highest: usize,
    convergence: Convergence,
    power: f64,        // t^n over the fraction of the allowed error
    terms: [f64; 4],   // last terms over their allowed errors, the newest first
    negligible: usize, // number of successive negligible terms at the end
}

impl Search {
    /// Adds the term of order 2. Returns false if `t` is beyond the time over which the series
    /// converges.
    #[inline(always)]
    fn add_first_term(&mut self, expansion: &Expansion) -> bool {
        self.terms[0] = expansion.norms[2] * self.power;
        self.t <= expansion.radius
    }

    /// Adds the term of order n + 1, n >= 2, whose coefficient has the norm `norm`. If the search ends, returns `Break`
    /// with the order up to which the series is exact.
    #[inline(always)]
    fn add_term(&mut self, n: usize, norm: f64) -> ControlFlow<Option<usize>> {
        self.power *= self.t;
        let [now, one, two, _] = self.terms;
        self.terms = [norm * self.power, now, one, two];
        let is_exact = match self.convergence {
            Convergence::Decay => n + 1 >= MIN_ORDER && are_negligible(self.terms),
            Convergence::Terms(count) => {
                self.negligible = if self.terms[0] <= 1.0 { self.negligible + 1 } else { 0 };
                n + 1 >= MIN_ORDER && self.negligible >= count
            }
        };
        match is_exact {
            true => ControlFlow::Break(Some(n + 1)),
            false if n + 1 >= self.highest => ControlFlow::Break(None),
            false => ControlFlow::Continue(()),
        }
    }

    /// Computes coefficient n + 1 of the states' series, and adds its term.
    #[inline(always)]
    fn compute_term<M: KeptMotion>(
        &mut self,
        motion: &mut M,
        n: usize,
    ) -> ControlFlow<Option<usize>> {
        compute_order(motion, n, self.tolerance);
        if n < 2 {
            return ControlFlow::Continue(());
        }
        if n == 2 && !self.add_first_term(motion.expansion()) {
            return ControlFlow::Break(None);
        }
        self.add_term(n, motion.expansion().norms[n + 1])
    }

    #[inline(never)]
    fn extend<M: KeptMotion>(mut self, motion: &mut M) -> Option<usize> {
        let known = motion.expansion().orders;
        if M::UNROLLED {
            for_each_order!(N => {
                if N + 1 > known
                    && let ControlFlow::Break(end) = self.compute_term(motion, N)
                {
                    return end;
                }
            });
            return None;
        }
        let mut orders = known..self.highest;
        let end = orders.find_map(|n| self.compute_term(motion, n).break_value());
        end.flatten()
    }
}

/// Returns the order up to which the series is exact at the time `t` after the start of the expansion. The order increases
/// with `t`. Returns `None` if no order is high enough.
#[inline(always)]
fn order_at<M: KeptMotion>(motion: &mut M, t: f64, tolerance: f64) -> Option<usize> {
    // 1 divided by the fraction of the allowed error that this step may have.
    let share = if t < FULL_LENGTH { FULL_LENGTH / t } else { 1.0 };
    let mut search = Search {
        t,
        tolerance,
        highest: highest_order(motion, tolerance),
        convergence: motion.convergence(),
        power: t * t * share,
        terms: [f64::INFINITY; 4],
        negligible: 0,
    };
    // The loop is separate, because the functions of the single orders are far apart in memory.
    let expansion = motion.expansion();
    if expansion.orders > 2 {
        if !search.add_first_term(expansion) {
            return None;
        }
        for (n, norm) in (2..).zip(&expansion.norms[3..=expansion.orders.min(ORDER)]) {
            if let ControlFlow::Break(end) = search.add_term(n, *norm) {
                return end;
            }
        }
    }
    search.extend(motion)
}

#[cold]
fn whole_expansion<M: KeptMotion>(
    motion: &mut M,
    tolerance: f64,
    (begin, steps): (f64, &mut Steps),
) -> Result<(usize, f64), StepError> {
    let Expansion { end, radius, .. } = *motion.expansion();
    if let Some(end) = end {
        return Ok(end);
    }
    let (n, mut length) = match order_at(motion, radius, tolerance) {
        Some(n) => (n, radius),
        None => {
            let highest = highest_order(motion, tolerance);
            (highest, length(&motion.expansion().norms, highest, radius))
        }
    };
    while motion.defect(n, length) > DEFECT {
        length /= 2.0;
        steps.add_steps(1, begin)?;
    }
    motion.expansion().end = Some((n, length));
    Ok((n, length))
}

/// Returns the length of a step, s, at most `longest`, at which the larger of the last two terms of
/// the series, of the orders n - 1 and n, equals its allowed error. `norms` are the coefficients of
/// the series divided by their allowed errors.
fn length(norms: &[f64; ORDER + 1], n: usize, longest: f64) -> f64 {
    let length = |n: usize| {
        let term = norms[n];
        if term > 0.0 { libm::exp(-libm::log(term) / n as f64) } else { longest }
    };
    longest.min(length(n)).min(length(n - 1))
}

/// Returns the order with which a motion needs the fewest operations per time. For the allowed error e, the length of an
/// expansion of order n is the radius of convergence times e^(1/n), and its cost increases with n^2. The best order is
/// therefore near -ln(e)/2 (Jorba & Zou). If a part of the cost increases less, such as the solution for the accelerations,
/// a higher order is better.
#[inline(always)]
fn highest_order<M: Motion>(motion: &M, tolerance: f64) -> usize {
    if motion.convergence() != Convergence::Decay {
        return motion.highest_order();
    }
    // This is -log2(e), rounded.
    let bits = 1023 - ((STEP_SHARE * tolerance).to_bits() >> 52 & 0x7ff) as usize;
    (5 + 35 * bits / 100).clamp(MIN_ORDER + 3, motion.highest_order())
}

/// Returns the largest allowed defect of the derivatives at the end of a series. At small tolerances it is the rounding
/// error of the derivatives.
#[inline(always)]
fn largest_slope_defect(tolerance: f64) -> f64 {
    const ROUNDING: f64 = 1e-13;
    DEFECT * (1.0 + ROUNDING / (STEP_SHARE * tolerance))
}

/// Advances the motion to the time `clock` after the last jump of the inputs or their slopes: within the expansion if it is
/// exact at this time, otherwise by further expansions. `start` is the time at the start of the expansion with its rounding
/// error. `clock` has no rounding error, because this error would depend on the lengths of the calls. Before the call the
/// states must be those at the start of the expansion; after the call they are those at `clock`. The motion gets all times
/// since the jump.
///
/// # Errors
/// See [`StepError`]. Times of errors count from the jump.
#[inline(always)]
pub fn advance_kept<M: KeptMotion>(
    motion: &mut M,
    (clock, start): (f64, &mut [f64; 2]),
    tolerance: f64,
    steps: &mut Steps,
) -> Result<(), StepError> {
    if motion.expansion().overwritten > 0 {
        repair(motion, start[0]);
    }
    loop {
        steps.add_steps(1, start[0])?;
        let t = (clock - start[0]) - start[1];
        if t <= 0.0 {
            return Ok(()); // an event has ended the call
        }
        if motion.expansion().orders == 0 {
            motion.start(start[0]);
        }
        let order = order_at(motion, t, tolerance);
        let fits = motion.expansion().end.is_none_or(|(_, end)| t <= end);
        let (mut n, mut length) = match order.filter(|n| fits && motion.defect(*n, t) <= DEFECT) {
            Some(n) => (n, t),
            None => {
                let (n, end) = whole_expansion(motion, tolerance, (start[0], steps))?;
                (n, end.min(t))
            }
        };
        let mut event = motion.event(n, length);
        if event.is_some() {
            // The series of the whole expansion is used, because it has the same root whenever the call ends.
            (n, length) = whole_expansion(motion, tolerance, (start[0], steps))?;
            event = motion.event(n, length).map(|event| event.min(t));
            length = length.min(t);
        }
        let moves = match event {
            Some(event) => {
                length = event;
                event.is_finite()
            }
            None => length > 0.0 && length.is_finite(),
        };
        if !moves {
            return Err(StepError::NotFinite { time: start[0] });
        }
        let is_end = length == t && event.is_none();
        let is_verified = is_end && length <= motion.expansion().verified;
        if event.is_none() && !is_verified {
            motion.store_slopes(n, length);
        }
        let _ = motion.take(n, length, start[0] + length, steps)?;
        if is_verified {
            return Ok(());
        }
        let end = add_time(*start, length);
        // The derivatives at the end are computed for the comparison; the next expansion needs them, too.
        if event.is_none() {
            motion.start(end[0]);
            motion.rates(0);
            motion.expansion().overwrite(1);
            if motion.slope_defect(length / n as f64) > largest_slope_defect(tolerance) {
                motion.return_to_start();
                repair(motion, start[0]);
                let whole = motion.expansion().end.map_or(length, |(_, end)| end.min(length));
                motion.expansion().end = Some((n, whole / 2.0));
                continue;
            }
        }
        if is_end {
            motion.expansion().verified = 2.0 * length;
            return Ok(());
        }
        *start = end;
        motion.keep();
        motion.expansion().clear();
        motion.expansion().orders = usize::from(event.is_none());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::root::first_root;
    use crate::series::{self, Series, ZERO};

    /// The oscillator x' = v, v' = -x between walls. If `wall` is set, v changes its sign at x = `wall`.
    struct Oscillator {
        now: [f64; 2],
        x: Series,
        v: Series,
        allowed: f64,
        wall: Option<f64>,
        hits: usize,
        convergence: Convergence,
        highest: usize,
        rates: usize,
    }

    impl Oscillator {
        fn new(convergence: Convergence) -> Oscillator {
            Oscillator {
                now: [1.0, 0.0],
                x: ZERO,
                v: ZERO,
                allowed: 0.0,
                wall: None,
                hits: 0,
                convergence,
                highest: ORDER,
                rates: 0,
            }
        }

        fn advance(&mut self, h: f64, tolerance: f64) -> Result<(), StepError> {
            advance(self, 7.0, h, tolerance, &mut Steps::new(100_000, "")).map(|_| ())
        }

        fn error(&self, t: f64) -> f64 {
            f64::max((self.now[0] - t.cos()).abs(), (self.now[1] + t.sin()).abs())
        }
    }

    impl Motion for Oscillator {
        const UNROLLED: bool = false;

        fn start(&mut self, _: f64) {
            [self.x[0], self.v[0]] = self.now;
        }

        fn rates(&mut self, n: usize) {
            self.rates += 1;
            self.x[n + 1] = series::next(n, self.v[n]);
            self.v[n + 1] = series::next(n, -self.x[n]);
        }

        fn set_error_scale(&mut self, h: f64, allowed: f64) -> f64 {
            self.allowed = allowed;
            h
        }

        fn coefficient_norm(&self, n: usize) -> f64 {
            f64::max(self.x[n].abs(), self.v[n].abs()) / self.allowed
        }

        fn convergence(&self) -> Convergence {
            self.convergence
        }

        fn highest_order(&self) -> usize {
            self.highest
        }

        fn event(&mut self, n: usize, h: f64) -> Option<f64> {
            let mut above = self.x;
            above[0] -= self.wall?;
            // If the oscillator starts on the wall, the root at 0 belongs to the reflection before and is left out.
            let behind = usize::from(above[0] <= 1e-15);
            first_root(&above[behind..=n], h)
        }

        fn take(
            &mut self,
            n: usize,
            h: f64,
            _: f64,
            _: &mut Steps,
        ) -> Result<ControlFlow<f64>, StepError> {
            self.now = series::values([&self.x, &self.v], n, h);
            if self.now.iter().any(|x| x.is_nan()) {
                return Err(StepError::NotFinite { time: 0.5 });
            }
            if self.wall.is_some_and(|wall| (self.now[0] - wall).abs() < 1e-12) {
                self.now[1] = -self.now[1];
                self.hits += 1;
            }
            Ok(ControlFlow::Continue(()))
        }
    }

    struct Unrolled(Oscillator);

    impl Motion for Unrolled {
        fn start(&mut self, t: f64) {
            self.0.start(t);
        }

        fn rates(&mut self, n: usize) {
            self.0.rates(n);
        }

        fn set_error_scale(&mut self, h: f64, allowed: f64) -> f64 {
            self.0.set_error_scale(h, allowed)
        }

        fn coefficient_norm(&self, n: usize) -> f64 {
            self.0.coefficient_norm(n)
        }

        fn take(
            &mut self,
            n: usize,
            h: f64,
            t: f64,
            s: &mut Steps,
        ) -> Result<ControlFlow<f64>, StepError> {
            self.0.take(n, h, t, s)
        }
    }

    #[test]
    fn steps_of_any_length_keep_the_tolerance() {
        for convergence in [Convergence::Decay, Convergence::Terms(2), Convergence::Terms(3)] {
            for tolerance in [1e-4, 1e-8, 1e-12] {
                for h in [1e-3, 0.1, 2.0, 50.0] {
                    let mut motion = Oscillator::new(convergence);
                    motion.advance(h, tolerance).unwrap();
                    // The error of one step is a hundredth of the tolerance, and 50 s take up to thirty steps. 1e-14
                    // allows for rounding errors.
                    let error = motion.error(h);
                    assert!(error < tolerance + 1e-14, "{convergence:?} {tolerance} {h}: {error}");
                }
            }
        }
    }

    /// The terms of this series are 0.1^n/n! from order 4 on. The order at which the expansion ends
    /// is compared with the order that follows from these terms and from the allowed error.
    #[test]
    fn an_expansion_ends_at_the_order_whose_terms_are_negligible() {
        let order = |convergence, tolerance: f64| {
            let mut motion = Oscillator::new(convergence);
            motion.start(0.0);
            let (n, h) = expand(&mut motion, 0.1, tolerance);
            assert_eq!((h, motion.rates), (0.1, n));
            n
        };
        // The terms from order 4 on are 4.2e-6, 8.3e-8, 1.4e-9, 2.0e-11 and 2.5e-13. The allowed error is a
        // hundredth of the tolerance.
        assert_eq!(order(Convergence::Terms(2), 1e-3), 5);
        assert_eq!(order(Convergence::Terms(3), 1e-3), 6);
        assert_eq!(order(Convergence::Terms(4), 1e-3), 7);
        assert_eq!(order(Convergence::Terms(2), 1e-4), 6);
        assert_eq!(order(Convergence::Terms(2), 1e-6), 7);
        // Term 5 is negligible, and term 6 is predicted, from the decay over two orders, to be below a quarter
        // of the allowed error.
        assert_eq!(order(Convergence::Decay, 1e-3), 5);
        assert_eq!(order(Convergence::Decay, 1e-5), 5);
        assert_eq!(order(Convergence::Decay, 1e-6), 6);
    }

    /// The solver decides by `are_negligible` whether a power series may end. The arguments are the
    /// terms n, n - 1, n - 2 and n - 3 of the series, each divided by its allowed error.
    #[test]
    fn a_series_ends_when_its_next_two_terms_are_negligible_or_predicted_to_be() {
        // Two successive computed terms are at the tolerance.
        assert!(are_negligible([1.0, 1.0, 9.0, 9.0]));
        assert!(!are_negligible([1.1, 0.1, 9.0, 9.0]));
        // The predicted terms, 2 x 0.5/20 = 0.05 and 2 x 2/30, are below a quarter, and the decays are tenfold and more.
        assert!(are_negligible([0.5, 2.0, 20.0, 30.0]));
        assert!(are_negligible([0.5, 2.0, 9.0, 30.0]));
        // First one of the two terms does not decay enough over two orders, and then the other one.
        assert!(!are_negligible([0.5, 2.0, 4.0, 30.0]));
        assert!(!are_negligible([0.05, 2.0, 20.0, 19.0]));
        // The decay is sufficient, but the predicted terms 4 x 1/12 and 8 x 8/81 are too large.
        assert!(!are_negligible([1.0, 4.0, 12.0, 400.0]));
        assert!(!are_negligible([0.1, 8.0, 20.0, 81.0]));
        assert!(!are_negligible([f64::NAN, 0.0, 0.0, 0.0]));
        assert!(!are_negligible([0.0, f64::NAN, 0.0, 0.0]));
    }

    struct Given([f64; ORDER + 1]);

    impl Motion for Given {
        fn start(&mut self, _: f64) {}

        fn rates(&mut self, _: usize) {}

        fn set_error_scale(&mut self, h: f64, _: f64) -> f64 {
            h
        }

        fn coefficient_norm(&self, n: usize) -> f64 {
            self.0[n]
        }

        fn event(&mut self, _: usize, _: f64) -> Option<f64> {
            Some(f64::NAN)
        }

        fn take(
            &mut self,
            _: usize,
            _: f64,
            _: f64,
            _: &mut Steps,
        ) -> Result<ControlFlow<f64>, StepError> {
            Ok(ControlFlow::Continue(()))
        }
    }

    #[test]
    fn the_decay_of_terms_counts_from_the_second_term_and_a_zero_step_is_refused() {
        let mut terms = [0.0; ORDER + 1];
        // At order 5 the decay from term 2 to term 4 is known.
        terms[2..6].copy_from_slice(&[60.0, 30.0, 3.0, 0.1]);
        assert_eq!(expand(&mut Given(terms), 1.0, 1e-8), (5, 1.0));
        terms[2] = 29.0;
        assert_eq!(expand(&mut Given(terms), 1.0, 1e-8), (6, 1.0));
        let end = advance(&mut Given(terms), 7.0, 1.0, 1e-8, &mut Steps::new(9, ""));
        assert_eq!(end, Err(StepError::NotFinite { time: 7.0 }));
    }

    /// A step of 50 s is too long for the highest order. It is shortened until the larger of the
    /// last two terms equals its allowed error.
    #[test]
    fn a_step_too_long_for_the_highest_order_is_shortened_to_the_allowed_error() {
        for highest in [10, ORDER] {
            let mut motion = Oscillator { highest, ..Oscillator::new(Convergence::Decay) };
            motion.start(0.0);
            let (n, h) = expand(&mut motion, 50.0, 1e-8);
            assert_eq!(n, highest);
            let term = |n: usize| motion.coefficient_norm(n) * h.powi(n as i32);
            let largest = f64::max(term(n), term(n - 1));
            // One of the last two terms is at the tolerance, except for the rounding of a power.
            assert!((largest - 1.0).abs() < 1e-12, "{largest}");
        }
    }

    #[test]
    fn an_expansion_compiled_separately_for_each_order_gives_bit_identical_results() {
        let mut loops = Oscillator::new(Convergence::Decay);
        let mut apart = Unrolled(Oscillator::new(Convergence::Decay));
        for h in [0.01, 0.3, 9.0] {
            loops.advance(h, 1e-9).unwrap();
            let flow = advance(&mut apart, 7.0, h, 1e-9, &mut Steps::new(100, ""));
            assert_eq!(flow, Ok(ControlFlow::Continue(())));
            assert_eq!(loops.now, apart.0.now);
        }
    }

    /// An oscillator that starts at x = 1 reaches the wall at 1/2 every 2 pi/3.
    #[test]
    fn an_event_ends_the_power_series_and_a_new_series_begins_at_the_event() {
        let mut motion = Oscillator { wall: Some(0.5), ..Oscillator::new(Convergence::Decay) };
        motion.advance(7.0, 1e-12).unwrap();
        let since = 7.0 - 3.0 * core::f64::consts::TAU / 3.0;
        assert_eq!(motion.hits, 3);
        assert!((motion.now[0] - since.cos()).abs() < 1e-12, "{:?}", motion.now);
    }

    #[test]
    fn internal_steps_are_counted_and_errors_state_the_time_of_the_host() {
        let mut motion = Oscillator::new(Convergence::Decay);
        let mut steps = Steps::new(3, "; rest");
        let error = advance(&mut motion, 7.0, 1e3, 1e-8, &mut steps).unwrap_err();
        let StepError::TooManySteps { time, max_steps: 3, advice: "; rest" } = error else {
            panic!("{error}");
        };
        // Each of the three steps is about 2 s long.
        assert!(time > 9.0 && time < 20.0, "{time}");
        let mut steps = Steps::new(5, "");
        steps.add_steps(3, 0.0).unwrap();
        assert_eq!(steps.left(), 2);
        steps.add_steps(2, 0.0).unwrap();
        assert!(steps.add_steps(1, 0.0).is_err());
    }

    #[test]
    fn values_that_are_not_finite_are_refused() {
        let mut motion = Oscillator { now: [f64::NAN, 0.0], ..Oscillator::new(Convergence::Decay) };
        assert_eq!(motion.advance(1.0, 1e-8), Err(StepError::NotFinite { time: 0.5 }));
        let mut motion = Oscillator::new(Convergence::Decay);
        assert_eq!(motion.advance(f64::INFINITY, 1e-8).map_err(|_| ()), Err(()));
        // If the allowed error is zero, no step has a positive length.
        let mut motion = Oscillator::new(Convergence::Decay);
        assert_eq!(motion.advance(1.0, 0.0), Err(StepError::NotFinite { time: 7.0 }));
    }

    #[test]
    fn a_power_series_over_a_very_long_step_stays_finite() {
        let mut motion = Oscillator { now: [0.0, 0.0], ..Oscillator::new(Convergence::Terms(2)) };
        motion.start(0.0);
        assert_eq!(expand(&mut motion, 1e300, 1e-8), (5, LONGEST));
    }

    /// An oscillator with its kept expansion. `begin` are the states at the start of the expansion, `clock` is the time at
    /// the end of the last call, and `start` the time at the start of the expansion.
    struct Kept {
        motion: Oscillator,
        begin: [f64; 2],
        expansion: Expansion,
        clock: [f64; 2],
        start: [f64; 2],
    }

    impl Motion for Kept {
        const UNROLLED: bool = false;

        fn start(&mut self, t: f64) {
            self.motion.start(t);
        }

        fn rates(&mut self, n: usize) {
            self.motion.rates(n);
        }

        fn set_error_scale(&mut self, h: f64, allowed: f64) -> f64 {
            self.motion.set_error_scale(h, allowed)
        }

        fn coefficient_norm(&self, n: usize) -> f64 {
            self.motion.coefficient_norm(n)
        }

        fn convergence(&self) -> Convergence {
            self.motion.convergence
        }

        fn event(&mut self, n: usize, h: f64) -> Option<f64> {
            self.motion.event(n, h)
        }

        fn take(
            &mut self,
            n: usize,
            h: f64,
            t: f64,
            steps: &mut Steps,
        ) -> Result<ControlFlow<f64>, StepError> {
            self.motion.take(n, h, t, steps)
        }
    }

    impl KeptMotion for Kept {
        fn expansion(&mut self) -> &mut Expansion {
            &mut self.expansion
        }

        fn keep(&mut self) {
            self.begin = self.motion.now;
        }
    }

    impl Kept {
        fn new(motion: Oscillator) -> Kept {
            let (begin, expansion) = (motion.now, Expansion::default());
            Kept { motion, begin, expansion, clock: [0.0; 2], start: [0.0; 2] }
        }

        fn advance(&mut self, h: f64, tolerance: f64) {
            self.motion.now = self.begin;
            self.clock = add_time(self.clock, h);
            let mut start = self.start;
            let times = (self.clock[0], &mut start);
            let mut steps = Steps::new(100_000, "");
            advance_kept(self, times, tolerance, &mut steps).unwrap();
            self.start = start;
        }
    }

    /// Whatever the lengths of the calls are, they end with bit-identical states, before and after reflections at the wall,
    /// and within the tolerance. Coefficients that other functions have overwritten are computed again.
    #[test]
    fn evaluating_a_power_series_in_several_calls_changes_no_bit_of_the_motion() {
        for convergence in [Convergence::Decay, Convergence::Terms(2)] {
            for (wall, tolerance) in [(None, 1e-4), (None, 1e-10), (Some(0.5), 1e-12)] {
                let kept = || Kept::new(Oscillator { wall, ..Oscillator::new(convergence) });
                let mut whole = kept();
                whole.advance(20.0, tolerance);
                let mut many = kept();
                for n in 0..20 * 64 {
                    many.advance(1.0 / 64.0, tolerance);
                    if n % 5 == 0 {
                        many.motion.start(0.0);
                        many.motion.rates(0);
                        many.expansion.overwrite(1);
                    }
                }
                assert_eq!(many.motion.now, whole.motion.now, "{convergence:?} {wall:?}");
                if wall.is_none() {
                    let error = whole.motion.error(20.0);
                    assert!(error < 10.0 * tolerance, "{convergence:?} {tolerance}: {error}");
                    // The orders that several calls within one expansion need are computed only once.
                    assert!(many.motion.rates < 2 * whole.motion.rates + 20 * 64);
                }
            }
        }
    }

    #[test]
    fn the_order_of_a_power_series_grows_with_the_step_length_and_with_a_smaller_tolerance() {
        let orders = |h: f64, tolerance: f64| {
            let mut kept = Kept::new(Oscillator::new(Convergence::Decay));
            kept.advance(h, tolerance);
            kept.expansion.orders
        };
        assert_eq!(orders(0.02, 1e-4), MIN_ORDER);
        assert!(orders(0.02, 1e-10) < orders(0.5, 1e-10));
        assert!(orders(0.02, 1e-8) < orders(0.02, 1e-12));
        // If several expansions follow each other, each has the order that needs the fewest operations.
        let highest = [1e-6, 1e-10, 1e-14].map(|tolerance| orders(50.0, tolerance));
        assert!(highest[0] < highest[1] && highest[2] <= ORDER, "{highest:?}");
    }

    /// Ten steps of 0.1 s give exactly 1 s and a remainder of 5.55e-17 s.
    #[test]
    fn the_sum_of_time_steps_carries_its_rounding_error() {
        let sum = (0..10).fold([0.0; 2], |sum, _| add_time(sum, 0.1));
        assert_eq!(sum[0], 1.0);
        let back = add_time(sum, -1.0);
        // The remainder is ten times the rounding error of 0.1, which is 5.55e-18.
        assert!((back[0] / 5.55e-17 - 1.0).abs() < 1e-2, "{back:?}");
    }

    /// The test problem y' = sqrt((t - 1)^2 + eps^2), whose right-hand side has a rounded corner at
    /// t = 1. Far from t = 1 its coefficients beyond the first two are of order eps^2, so that they
    /// do not show the corner. If `compares` is false, the derivatives at the end of a series are
    /// not compared with the right-hand side.
    struct Corner {
        now: [f64; 2],
        begin: [f64; 2],
        square: Series,
        root: Series,
        y: Series,
        allowed: f64,
        slope: f64,
        expansion: Expansion,
        compares: bool,
    }

    const EPS: f64 = 1e-4;

    impl Motion for Corner {
        const UNROLLED: bool = false;

        fn start(&mut self, _: f64) {
            let [s, y] = self.now;
            (self.square, self.y[0]) = (ZERO, y);
            self.square[..3].copy_from_slice(&[s * s + EPS * EPS, 2.0 * s, 1.0]);
        }

        fn rates(&mut self, n: usize) {
            self.root[n] = series::sqrt(n, self.square[n], &self.root);
            self.y[n + 1] = series::next(n, self.root[n]);
        }

        fn set_error_scale(&mut self, h: f64, allowed: f64) -> f64 {
            self.allowed = allowed;
            h
        }

        fn coefficient_norm(&self, n: usize) -> f64 {
            self.y[n].abs() / self.allowed
        }

        fn take(
            &mut self,
            n: usize,
            h: f64,
            _: f64,
            _: &mut Steps,
        ) -> Result<ControlFlow<f64>, StepError> {
            self.now = [self.now[0] + h, series::values([&self.y], n, h)[0]];
            Ok(ControlFlow::Continue(()))
        }
    }

    impl KeptMotion for Corner {
        fn expansion(&mut self) -> &mut Expansion {
            &mut self.expansion
        }

        fn store_slopes(&mut self, n: usize, h: f64) {
            [self.slope] = series::values([&self.root], n - 1, h);
        }

        fn slope_defect(&self, h: f64) -> f64 {
            let compared = f64::from(self.compares);
            compared * (self.slope - self.root[0]).abs() * h / self.allowed
        }

        fn return_to_start(&mut self) {
            self.now = self.begin;
        }

        fn keep(&mut self) {
            self.begin = self.now;
        }
    }

    /// The exact solution of the test problem is (s r + eps^2 asinh(s/eps))/2 with r = sqrt(s^2 +
    /// eps^2) and s = t - 1. A series across the corner at t = 1 is found to be wrong by a
    /// comparison of the derivatives at its end.
    #[test]
    fn an_expansion_across_a_corner_is_repeated_over_a_shorter_time() {
        let error = |tolerance: f64, compares: bool| {
            let now = [-1.0, 0.0];
            let [square, root, y] = [ZERO; 3];
            let (begin, allowed, slope, expansion) = (now, 0.0, 0.0, Expansion::default());
            let mut motion =
                Corner { now, begin, square, root, y, allowed, slope, expansion, compares };
            let (mut steps, times) = (Steps::new(1000, ""), (3.0, &mut [0.0; 2]));
            advance_kept(&mut motion, times, tolerance, &mut steps).unwrap();
            let integral = |s: f64| 0.5 * (s * s.hypot(EPS) + EPS * EPS * (s / EPS).asinh());
            (motion.now[1] - integral(2.0) + integral(-1.0)).abs() / tolerance
        };
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
            assert!(error(tolerance, true) < 1.0, "{tolerance:e}: {}", error(tolerance, true));
        }
        assert!(error(1e-4, false) > 1000.0);
    }
}

//! Chooses the intersample behaviour of the inputs by the likelihood.
//!
//! A zero-order hold delays the input by half a row on average, so "zero-order hold without a delay" and "linear with a delay of
//! half a row" fit about equally well. Therefore the minimum is searched separately for each intersample behaviour, with all
//! unknowns free. An intersample behaviour with an output that precedes its input is refused. If others explain the recordings
//! about as well as the best one, all of them enter the result, each with its probability.

use anyhow::Result;

use super::minimum::{End, Minimum};
use super::problem::{Hold, Role};
use super::{ALIKE, DECIDES, ENDS, Fit, SETS};

/// Negative delay, in rows, that still counts as no delay, because the time stamps of two channels may differ by so much.
const EARLIEST: f64 = 0.05;

/// Result of the search with an intersample behaviour that was not chosen.
#[derive(Clone, Debug)]
pub struct Rival {
    pub hold: Hold,
    /// Smallest sum of squares with this intersample behaviour minus the smallest sum of squares with the chosen one.
    pub more: f64,
    /// Difference of the minimum with this intersample behaviour from the minimum with the chosen one, in the coordinates
    /// of the unknowns.
    pub shift: Vec<f64>,
    /// Delay, s, that was estimated with this intersample behaviour, if a delay is estimated.
    pub delay: Option<f64>,
    /// True if an output would precede its input with this delay.
    pub early: bool,
    /// True if the search with this intersample behaviour was given up, because its sum of squares was far above the lowest
    /// one.
    pub lost: bool,
}

impl Rival {
    /// Returns true if this intersample behaviour explains the recordings about as well as the chosen one.
    pub fn is_near(&self) -> bool {
        !self.early && self.more < DECIDES
    }
}

impl Fit<'_> {
    pub fn delay(&self) -> Option<usize> {
        self.problem.unknowns.iter().position(|u| u.role == Role::Delay(0))
    }

    /// Returns true if at the coordinates `z` an output precedes its input by more than the uncertainty `spare` of the delay, s,
    /// and the problem does not allow that.
    pub fn is_early(&self, z: &[f64], spare: f64) -> bool {
        let step = self.problem.recordings.first().map_or(0.0, |r| r.step);
        let delay = self.delay().filter(|j| self.free[*j] && !self.problem.acausal);
        delay.is_some_and(|j| z[j] + spare < -EARLIEST * step)
    }

    /// Searches the minimum for each intersample behaviour. Returns the minimum of the best one, which the fit then uses, and the
    /// others. An intersample behaviour with which the system cannot be simulated is left out.
    ///
    /// # Errors
    /// If the system refuses the minimum that was found so far.
    pub fn compare_holds(&mut self, found: Minimum) -> Result<(Minimum, Vec<Rival>)> {
        if self.problem.holds.len() < 2 {
            return Ok((found, Vec::new()));
        }
        let delay = self.delay().filter(|j| self.free[*j]);
        let step = self.problem.recordings.first().map_or(0.0, |r| r.step);
        let (now, free) = (self.hold, self.free.clone());
        let mut found = found;
        if found.decrement >= ENDS.0 {
            let z = found.point.z.clone();
            found = self.minimise(&z, &free, found.derivatives, End::new(12, ENDS.0))?;
        }
        let mut least =
            if self.is_early(&found.point.z, 0.0) { f64::INFINITY } else { found.point.cost };
        let mut all: Vec<(Hold, Minimum)> = vec![(now, found.clone())];
        for hold in self.problem.holds.iter().copied().filter(|hold| *hold != now) {
            self.hold = hold;
            let mut z = found.point.z.clone();
            if let Some(j) = delay {
                let late = |h: Hold| if h == Hold::ZeroOrderHold { 0.5 * step } else { 0.0 };
                z[j] += late(now) - late(hold);
            }
            let end = End { above: least + DECIDES, ..End::new(SETS, ENDS.0) };
            let Ok(other) = self.minimise(&z, &free, found.derivatives.clone(), end) else {
                continue;
            };
            if !self.is_early(&other.point.z, 0.0) {
                least = least.min(other.point.cost);
            }
            all.push((hold, other));
        }
        let mut best = 0;
        for (k, (_, other)) in all.iter().enumerate().skip(1) {
            let first = &all[best].1;
            let is_better =
                self.is_early(&first.point.z, 0.0) || other.point.cost < first.point.cost - ALIKE;
            if !self.is_early(&other.point.z, 0.0) && is_better {
                best = k;
            }
        }
        let (hold, found) = all.remove(best);
        self.hold = hold;
        let rivals = all.into_iter().map(|(hold, other)| Rival {
            hold,
            more: other.point.cost - found.point.cost,
            shift: other.point.z.iter().zip(&found.point.z).map(|(a, b)| a - b).collect(),
            delay: delay.map(|j| other.point.z[j]),
            early: self.is_early(&other.point.z, 0.0),
            lost: other.decrement >= 1.0,
        });
        let rivals = rivals.collect();
        Ok((found, rivals))
    }
}

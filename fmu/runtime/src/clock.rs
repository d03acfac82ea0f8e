//! The clock of an instance. Times of the host are compared here only, with one tolerance.
//!
//! A host may multiply (k h), add up (t += h) or convert counters, may start at 1e9 s, and may be off by a few units in
//! the last place. The motion must not depend on that: in Co-Simulation the host's time only names instants, and a model that
//! needs the time since its start adds up the lengths of its steps.

use crate::call::Interface;
use crate::variable::{is_finite, text};

/// Part of the time since the start by which the clock of a host that adds up its steps may drift: 1e7 steps of 0.1 s are off
/// by 2e-10.
const DRIFT: f64 = 1e-9;

/// Rounding errors of a host's time, in parts of the largest number that it computes with: 8 to 16 units in the last place.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A time of the host, as a model sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// The host's time, s. It names the instant in messages and outputs.
    pub time: f64,
    /// Time since the start, s, for a host that integrates itself. In Co-Simulation the model adds up its steps.
    pub since_start: Option<f64>,
    /// Times of the host that differ by less than this are the same, s.
    pub resolution: f64,
}

/// Start, stop and present time of an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clock {
    pub start: f64,
    pub stop: Option<f64>,
    /// The host's time, s.
    pub time: f64,
    /// True for a host that integrates itself.
    pub is_hosts: bool,
    /// The last event, behind which a host that integrates itself may not go back, s.
    pub last_event: f64,
}

impl Clock {
    /// Returns a clock at `start`.
    pub fn new(interface: Interface, start: f64, stop: Option<f64>) -> Clock {
        let is_hosts = interface == Interface::ModelExchange;
        Clock { start, stop, time: start, is_hosts, last_event: f64::NEG_INFINITY }
    }

    /// Returns the present instant.
    pub fn now(&self) -> Instant {
        self.at(self.time, 0.0)
    }

    /// Returns the present instant, which the host calls `time`, before a step of length `h`.
    pub fn at(&self, time: f64, h: f64) -> Instant {
        let resolution = self.resolution(time).max(self.resolution(time + h));
        let since_start = self.is_hosts.then_some(time - self.start);
        Instant { time, since_start, resolution }
    }

    /// Returns the difference, s, below which two times of the host near `time` are the same.
    fn resolution(&self, time: f64) -> f64 {
        ROUNDING * self.start.abs().max(time.abs())
    }

    /// Returns the difference, s, below which a time near `time` is the one that was expected after a step of length `h`.
    fn tolerance(&self, time: f64, h: f64) -> f64 {
        DRIFT * (time - self.start).abs().max(h) + self.resolution(time)
    }

    /// Returns true if two times are the same but for rounding.
    pub fn is_same(&self, a: f64, b: f64) -> bool {
        (a - b).abs() <= self.resolution(a)
    }

    /// Returns true if `time` is finite and lies before `end` by more than rounding.
    pub fn is_before(&self, time: f64, end: f64) -> bool {
        is_finite(time) && time < end - self.resolution(end)
    }

    /// Returns why no step can begin at `at` with length `h`.
    #[inline(always)]
    pub fn check_step(&self, at: f64, h: f64) -> Result<(), String> {
        if !(is_finite(h) && h > 0.0) {
            let h = text(h);
            return Err(format!("communicationStepSize = {h} s (allowed: greater than 0, finite)"));
        }
        let is_close = is_finite(at) && (at - self.time).abs() <= self.tolerance(self.time, h);
        if !is_close {
            let (at, time) = (text(at), self.time);
            return Err(format!(
                "currentCommunicationPoint = {at} s, but the last step ended at {time:?} s"
            ));
        }
        let end = at + h;
        match self.stop {
            Some(stop) if end > stop + self.tolerance(stop, h) => {
                Err(format!("the step to {end:?} s would pass the stop time {stop:?} s"))
            }
            _ => Ok(()),
        }
    }

    /// Returns why the host cannot set this time.
    pub fn check_time(&self, time: f64, goes_back: bool) -> Result<(), String> {
        if !is_finite(time) {
            return Err(format!("time = {} s (allowed: any finite number)", text(time)));
        }
        let last = self.last_event;
        if !goes_back && time < last - self.tolerance(last, 0.0) {
            let time = text(time);
            return Err(format!(
                "time = {time} s lies before the last event (allowed: {last:?} s or later)"
            ));
        }
        Ok(())
    }

    /// Returns the stop time if the present time lies behind it.
    pub fn passed_stop(&self) -> Option<f64> {
        self.stop.filter(|stop| self.time > stop + self.tolerance(*stop, 1.0))
    }
}

//! The clock of an instance. Only this module compares times of the host, with one tolerance that allows
//! for their rounding errors.
//!
//! A host may multiply (k h), accumulate (t += h) or convert counters, may start at 1e9 s, and its time may have errors of a
//! few units in the last place. The simulation must not depend on these errors: in Co-Simulation the host's time is only a
//! label of an instant, and a model that needs the time since the start adds up the step sizes.

use crate::call::Interface;
use crate::number::{is_finite, text};

/// Allowed drift of the clock of a host that adds up its step sizes, as a fraction of the time since the start. After 1e7
/// steps of 0.1 s the sum has drifted by 2e-10 of its value.
const DRIFT: f64 = 1e-9;

/// Allowed rounding error of a time that the host passes, relative to the largest number from which this time is computed: 8
/// to 16 units in the last place.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// An instant of the simulation, as the runtime passes it to a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// Simulation time that the host has passed, s. Messages and outputs contain this time.
    pub time: f64,
    /// Time since the start of the simulation, s, in Model Exchange. `None` in Co-Simulation, where
    /// the model adds up the step sizes instead.
    pub since_start: Option<f64>,
    /// Two times of the host that differ by less than this, s, count as equal, because they may differ by rounding.
    pub resolution: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Clock {
    pub start: f64,
    pub stop: Option<f64>,
    pub time: f64,
    /// True in Model Exchange, where the host sets `time`; false in Co-Simulation, where steps advance it.
    pub is_hosts: bool,
    /// Time of the last event, s. A host of Model Exchange may not go back before it.
    pub last_event: f64,
}

impl Clock {
    pub fn new(interface: Interface, start: f64, stop: Option<f64>) -> Clock {
        let is_hosts = interface == Interface::ModelExchange;
        Clock { start, stop, time: start, is_hosts, last_event: f64::NEG_INFINITY }
    }

    pub fn now(&self) -> Instant {
        self.at(self.time, 0.0)
    }

    /// Returns the instant at which a step of `h` seconds starts. `time` is the host's time of the start, s.
    pub fn at(&self, time: f64, h: f64) -> Instant {
        let resolution = self.resolution(time).max(self.resolution(time + h));
        let since_start = self.is_hosts.then_some(time - self.start);
        Instant { time, since_start, resolution }
    }

    fn resolution(&self, time: f64) -> f64 {
        ROUNDING * self.start.abs().max(time.abs())
    }

    /// Returns the tolerance, s, within which a time near `time` counts as the end of a step of `h` seconds.
    fn tolerance(&self, time: f64, h: f64) -> f64 {
        DRIFT * (time - self.start).abs().max(h) + self.resolution(time)
    }

    pub fn is_same(&self, a: f64, b: f64) -> bool {
        (a - b).abs() <= self.resolution(a)
    }

    pub fn is_before(&self, time: f64, end: f64) -> bool {
        is_finite(time) && time < end - self.resolution(end)
    }

    /// Checks that the host may make a step of `h` seconds from its time `at`, s.
    ///
    /// # Errors
    /// The reason if the step is not allowed, for example because it does not start at the present time.
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

    /// Checks a time, s, that the host wants to set in Model Exchange. `goes_back` is true if the host may also set times
    /// before the last event, as in FMI 2.0 but not in FMI 3.0.
    ///
    /// # Errors
    /// The reason if the time is not allowed.
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

    /// Returns the stop time, s, if the present time is later by more than a rounding error; otherwise `None`.
    pub fn passed_stop(&self) -> Option<f64> {
        self.stop.filter(|stop| self.time > stop + self.tolerance(*stop, 1.0))
    }
}

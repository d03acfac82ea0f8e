//! A sine sweep, a torque whose phase is a known function of time.

use std::f64::consts::TAU;

use crate::response::BAND;

/// Torque with a constant amplitude and a frequency that sweeps from one value to another, upwards
/// or downwards.
///
/// - `amplitude`: amplitude of the torque, N·m.
/// - `f0`, `f1`: frequencies at the beginning and at the end, Hz.
/// - `duration`: time from `f0` to `f1`, s.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    pub amplitude: f64,
    pub f0: f64,
    pub f1: f64,
    pub duration: f64,
    pub law: Law,
}

/// Laws of a sweep's frequency f over the time t, for a sweep from f0 to f1 with the duration T.
/// Exponential: f = f0 e^{at} with a = ln(f1/f0)/T (Rubaga's thesis, 5.1.4). Linear: f = f0 + s t
/// with s = (f1 − f0)/T.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    Exponential,
    Linear,
}

impl Sweep {
    pub const THESIS: Sweep =
        Sweep { amplitude: 0.1, f0: BAND.0, f1: BAND.1, duration: 2700.0, law: Law::Exponential };

    pub fn torque(&self, t: f64) -> f64 {
        self.amplitude * self.phase(t).sin()
    }

    /// Returns the phase of the sweep at the time `t`, s, in rad. For an exponential sweep with the
    /// growth rate a it is 2π f0 (e^{at} − 1)/a, for a linear sweep with the slope s it is
    /// 2π (f0 t + s t²/2).
    pub fn phase(&self, t: f64) -> f64 {
        let Sweep { f0, f1, duration, .. } = *self;
        match self.law {
            Law::Exponential => {
                let a = (f1 / f0).ln() / duration;
                TAU * f0 * (a * t).exp_m1() / a
            }
            Law::Linear => TAU * (f0 * t + (f1 - f0) / duration * t * t / 2.0),
        }
    }

    pub fn frequency_at(&self, t: f64) -> f64 {
        let Sweep { f0, f1, duration, .. } = *self;
        match self.law {
            Law::Exponential => f0 * ((f1 / f0).ln() / duration * t).exp(),
            Law::Linear => f0 + (f1 - f0) / duration * t,
        }
    }

    /// Returns the time at which the sweep passes `frequency`, Hz, in s, or `None` if the sweep
    /// does not pass this frequency.
    pub fn time_at_frequency(&self, frequency: f64) -> Option<f64> {
        let Sweep { f0, f1, duration, .. } = *self;
        let t = match self.law {
            Law::Exponential => (frequency / f0).ln() * duration / (f1 / f0).ln(),
            Law::Linear => (frequency - f0) / (f1 - f0) * duration,
        };
        (-1e-9..=duration * (1.0 + 1e-12)).contains(&t).then_some(t)
    }

    /// Returns the rate at which the frequency changes when the sweep passes `frequency`, Hz, in
    /// Hz/s. It is negative for a downward sweep.
    pub fn rate_at(&self, frequency: f64) -> f64 {
        let Sweep { f0, f1, duration, .. } = *self;
        match self.law {
            Law::Exponential => frequency * (f1 / f0).ln() / duration,
            Law::Linear => (f1 - f0) / duration,
        }
    }

    /// Returns the lowest and the highest frequency of the sweep, Hz. If the sweep begins at 0 Hz,
    /// the lowest frequency is the frequency at the end of its first cycle, √(2 f1/T) with the
    /// duration T.
    pub fn band(&self) -> (f64, f64) {
        if self.f0 == 0.0 {
            return ((2.0 * self.f1 / self.duration).sqrt().min(self.f1), self.f1);
        }
        (self.f0.min(self.f1), self.f0.max(self.f1))
    }
}

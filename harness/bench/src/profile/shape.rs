//! Torque against time by a formula: what the profiles are made from.

use std::f64::consts::TAU;
use std::fmt::Debug;

/// A torque against time; t in s, torque in N·m.
pub trait Shape: Debug + Send + Sync {
    /// Torque just after `t`.
    fn after(&self, t: f64) -> f64;

    /// Torque just before `t`; another one where the torque jumps.
    fn before(&self, t: f64) -> f64 {
        self.after(t)
    }

    /// The frequencies it excites uniformly enough for a frequency response, from and to, Hz; `None`
    /// if there are none.
    fn band(&self) -> Option<(f64, f64)> {
        None
    }

    /// Itself, if its frequency sweeps.
    fn sweep(&self) -> Option<&Sweep> {
        None
    }
}

/// A sin φ(t), with a frequency φ'/2π that goes from f0 to f1, upwards or downwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// A, N·m.
    pub amplitude: f64,
    /// Frequency at the start, Hz.
    pub f0: f64,
    /// Frequency at the end, Hz.
    pub f1: f64,
    /// T, s.
    pub duration: f64,
    /// How it gets from one to the other.
    pub law: Law,
}

/// How a sweep's frequency grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// f = f0 e^{at}, a = ln(f1/f0)/T (Rubaga's thesis 5.1.4).
    Exponential,
    /// f = f0 + s t, s = (f1 − f0)/T.
    Linear,
}

impl Sweep {
    /// Phase φ(t), rad: 2π f0 (e^{at} − 1)/a, or 2π (f0 t + s t²/2).
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

    /// The time at which it passes `frequency` (Hz), s; `None` if it never does.
    pub fn time_of(&self, frequency: f64) -> Option<f64> {
        let Sweep { f0, f1, duration, .. } = *self;
        let t = match self.law {
            Law::Exponential => (frequency / f0).ln() * duration / (f1 / f0).ln(),
            Law::Linear => (frequency - f0) / (f1 - f0) * duration,
        };
        (-1e-9..=duration * (1.0 + 1e-12)).contains(&t).then_some(t)
    }

    /// df/dt at `frequency`, Hz/s, negative downwards.
    pub fn rate_at(&self, frequency: f64) -> f64 {
        let Sweep { f0, f1, duration, .. } = *self;
        match self.law {
            Law::Exponential => frequency * (f1 / f0).ln() / duration,
            Law::Linear => (f1 - f0) / duration,
        }
    }

    /// Lowest and highest frequency, Hz.
    pub fn band(&self) -> (f64, f64) {
        (self.f0.min(self.f1), self.f0.max(self.f1))
    }
}

impl Shape for Sweep {
    fn after(&self, t: f64) -> f64 {
        self.amplitude * self.phase(t).sin()
    }

    fn band(&self) -> Option<(f64, f64)> {
        Some(Sweep::band(self))
    }

    fn sweep(&self) -> Option<&Sweep> {
        Some(self)
    }
}

/// A sin 2πft.
#[derive(Clone, Debug, PartialEq)]
pub struct Dwell {
    /// A, N·m.
    pub amplitude: f64,
    /// f, Hz.
    pub frequency: f64,
}

impl Shape for Dwell {
    fn after(&self, t: f64) -> f64 {
        self.amplitude * (TAU * self.frequency * t).sin()
    }
}

/// Constant torques one after the other, none between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Pieces(pub Vec<Piece>);

/// A constant torque for some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    from: f64,
    to: f64,
    torque: f64,
}

impl Piece {
    /// A torque (N·m) from `start` for `width` seconds.
    pub fn new(start: f64, width: f64, torque: f64) -> Piece {
        Piece { from: start, to: start + width, torque }
    }

    /// A torque (N·m) without end.
    pub fn always(torque: f64) -> Piece {
        Piece { from: f64::NEG_INFINITY, to: f64::INFINITY, torque }
    }
}

impl Shape for Pieces {
    fn after(&self, t: f64) -> f64 {
        // a communication point k·H may lie an ulp beside the edge it is meant to be
        let slack = 1e-9 * (1.0 + t.abs());
        let now = self.0.iter().find(|piece| t >= piece.from - slack && t < piece.to - slack);
        now.map_or(0.0, |piece| piece.torque)
    }

    fn before(&self, t: f64) -> f64 {
        self.after(t - 3e-9 * (1.0 + t.abs()))
    }
}

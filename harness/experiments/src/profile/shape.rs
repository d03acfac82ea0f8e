//! Torques as functions of time, of which the profiles consist.

use std::f64::consts::TAU;
use std::fmt::Debug;

use analysis::sweep::Sweep;

/// A torque, N·m, as a function of time t, s.
pub trait Shape: Debug + Send + Sync {
    /// Returns the torque at `t`; at a jump this is the value after the jump.
    fn torque_after(&self, t: f64) -> f64;

    /// Returns the highest frequency of the torque from 0 to `stop` (s), Hz; 0 for a torque that is
    /// constant between its edges.
    fn highest(&self, stop: f64) -> f64;

    fn edges(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Returns the lowest and highest frequency (Hz) of the band that the torque excites uniformly enough for
    /// a frequency response; `None` for torques without such a band.
    fn band(&self) -> Option<(f64, f64)> {
        None
    }

    fn sweep(&self) -> Option<&Sweep> {
        None
    }
}

impl Shape for Sweep {
    fn torque_after(&self, t: f64) -> f64 {
        self.torque(t)
    }

    fn highest(&self, stop: f64) -> f64 {
        let end = if stop > self.duration { self.frequency_at(stop).abs() } else { self.f1 };
        self.f0.max(self.f1).max(end)
    }

    fn band(&self) -> Option<(f64, f64)> {
        Some(Sweep::band(self))
    }

    fn sweep(&self) -> Option<&Sweep> {
        Some(self)
    }
}

/// A sine A sin 2πft with the amplitude A (N·m) and the frequency f (Hz).
#[derive(Clone, Debug, PartialEq)]
pub struct Dwell {
    pub amplitude: f64,
    pub frequency: f64,
}

impl Shape for Dwell {
    fn torque_after(&self, t: f64) -> f64 {
        self.amplitude * (TAU * self.frequency * t).sin()
    }

    fn highest(&self, _: f64) -> f64 {
        self.frequency.abs()
    }
}

/// A sequence of constant torques, with zero torque between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Pieces(pub Vec<Piece>);

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    from: f64,
    to: f64,
    torque: f64,
}

impl Piece {
    pub fn new(start: f64, width: f64, torque: f64) -> Piece {
        Piece { from: start, to: start + width, torque }
    }

    pub fn constant(torque: f64) -> Piece {
        Piece { from: f64::NEG_INFINITY, to: f64::INFINITY, torque }
    }
}

impl Shape for Pieces {
    fn torque_after(&self, t: f64) -> f64 {
        // a communication point k·H may differ from the time of an edge by a rounding error
        let slack = 1e-9 * (1.0 + t.abs());
        let now = self.0.iter().find(|piece| t >= piece.from - slack && t < piece.to - slack);
        now.map_or(0.0, |piece| piece.torque)
    }

    fn highest(&self, _: f64) -> f64 {
        0.0
    }

    fn edges(&self) -> Vec<f64> {
        self.0.iter().flat_map(|piece| [piece.from, piece.to]).collect()
    }
}

//! The noise of a signal, estimated from its residual by maximum likelihood with a weak prior of the drift.
//!
//! A short recording cannot separate the drift of a gyro from the friction of the bearing. Therefore the drift has a prior, whose
//! size is typical of gyros of its kind ([`Drift`]).

use analysis::gauss_markov::Noise;
use analysis::statistics::deviation;

use super::problem::{Drift, Signal};

/// Smallest white noise, relative to the standard deviation of the signal. A simulated recording may have less, but its residual
/// is then the error of the solver, which no test accepts as noise.
const LEAST_NOISE: f64 = 1e-5;
/// Prior standard deviation of the logarithm of a drift's correlation time.
const TIME_WIDTH: f64 = 1.0;
/// Smallest step of the search over the logarithms of a drift's size and correlation time. A finer search would
/// not change any estimate.
const LEAST_STEP: f64 = 0.05;

impl Signal {
    pub fn first_noise(&self) -> Noise {
        let (drift, time) = self.drift.map_or((0.0, 100.0), |drift| (drift.size, drift.time));
        Noise { white: self.own_noise(), drift, time }
    }

    /// Returns the noise between neighbouring rows, but at least the smallest noise that a fit assumes.
    pub fn own_noise(&self) -> f64 {
        self.white.max(self.least_noise())
    }

    fn least_noise(&self) -> f64 {
        let spread = deviation(&self.picked(&self.measured));
        // a constant signal has a standard deviation of 0
        (LEAST_NOISE * spread).max(1e-6 * self.white).max(f64::MIN_POSITIVE)
    }

    pub fn noise_of(&self, time: &[f64], residual: &[f64]) -> Noise {
        let count = self.measured_row_count().max(1) as f64;
        let least = self.least_noise();
        let sized = |drift: f64, time_constant: f64| {
            let unit = Noise { white: 1.0, drift, time: time_constant };
            let filter = unit.whitening(time, Some(&self.sampled));
            let mut e = residual.to_vec();
            filter.apply(&mut e);
            let white = (e.iter().map(|v| v * v).sum::<f64>() / count).sqrt().max(least);
            (2.0 * count * white.ln() + filter.log_variance(), Noise { white, ..unit })
        };
        let Some(Drift { size: drift, time: usual, width }) = self.drift else {
            return sized(0.0, 100.0).1;
        };
        let span = time[time.len() - 1] - time[0];
        let ends = (5.0 * span / time.len() as f64, span);
        let bound = |ln_time: f64| ln_time.clamp(ends.0.ln(), ends.1.ln());
        let prior = |x: f64, mean: f64, width: f64| ((x - mean) / width).powi(2);
        let cost = |at: (f64, f64)| {
            let (deviance, noise) = sized(at.0.exp(), bound(at.1).exp());
            let known = prior(at.0, drift.ln(), width) + prior(at.1, usual.ln(), TIME_WIDTH);
            (deviance + known, noise)
        };
        let mut at = (drift.ln(), bound((span / 4.0).ln()));
        let mut best = cost(at);
        let mut reach = 0.8;
        while reach > LEAST_STEP {
            let mut moved = false;
            for by in [(reach, 0.0), (-reach, 0.0), (0.0, reach), (0.0, -reach)] {
                let to = (at.0 + by.0, bound(at.1 + by.1));
                let there = cost(to);
                if there.0 < best.0 {
                    (best, at, moved) = (there, to, true);
                }
            }
            if !moved {
                reach *= 0.5;
            }
        }
        best.1
    }
}

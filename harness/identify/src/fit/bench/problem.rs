//! Output-error fit in the time domain, with the friction inside the equations.
//!
//! ```text
//! minimise Σ e_k² + Σ ((x_i − μ_i)/s_i)²,   e = whitened( y_k − s ω(t_k − δ; p) − b )
//! ```
//!
//! ω is the FMU's answer (see [`crate::model::bench::simulate`]), s, b and δ are the gyro's scale, its bias and the delay. The second sum holds
//! the priors. [`analysis::gauss_markov`] has the whitening filter. An encoder's angle, less an offset, with a delay of its
//! own, adds a sum of the same form without the gyro's scale.
//!
//! `sensitivities` has the derivatives, `steps` Gauss and Newton's steps near a minimum, and `windows` the search from afar.

mod sensitivities;
mod steps;
mod windows;

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use anyhow::{Context, Result};
use host::fmu::Fmu;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::covariance::Covariance;
use crate::input::recording::Recording;
use crate::model::bench::effect::Effects;
use crate::model::bench::nominal::{self, Bench, Nominal};
use crate::model::bench::simulate::{Motion, Read, Setup};
use crate::model::bench::unknown::{Quantity, Unknown};
use crate::model::overridden::{near, refuse};
use crate::tuning::TYPICAL_DRIFT;
use analysis::gauss_markov::{FLOOR, Noise, Whitening};

pub use steps::{Known, Polished, Until};
pub use windows::Rough;

/// A measured signal of the hub.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Rate of the hub by the gyro.
    Rate,
    /// Angle of the hub by the encoder.
    Angle,
}

/// A signal of a recording with its noise.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Number of the recording.
    pub recording: usize,
    /// The signal.
    pub signal: Signal,
    /// Noise.
    pub noise: Noise,
}

/// Returns true if the noise of channels has changed so much that the minimum moves: the white noise, or a drift that counts.
pub fn is_other(before: &[Channel], now: &[Channel]) -> bool {
    let differs = |a: f64, b: f64, by: f64| (a / b).ln().abs() > by;
    before.iter().map(|c| c.noise).zip(now.iter().map(|c| c.noise)).any(|(a, b)| {
        let drifts = a.drift.max(b.drift) > 0.02;
        differs(a.white, b.white, 0.05) || drifts && differs(a.drift, b.drift, 0.2)
    })
}

/// Recordings, a set-up of the FMU, and the unknowns.
#[derive(Clone)]
pub struct Problem<'a> {
    /// The FMU.
    pub fmu: &'a Fmu,
    /// Settings and drive of the FMU.
    pub setup: Setup,
    /// The recordings, fitted together.
    pub recordings: &'a [Recording],
    /// Unknowns.
    pub unknowns: Vec<Unknown>,
    /// Measured signals, with their noise.
    pub channels: Vec<Channel>,
    /// Kind of the differences for sensitivities.
    pub differences: Differences,
    /// The bench as it is set up; `None`: the FMU refuses its settings.
    pub bench: Option<Bench>,
    /// Rows that the FMU was driven through, by this problem and its clones.
    pub driven: Arc<AtomicUsize>,
}

/// The FMU's answer for given unknowns.
#[derive(Clone)]
pub struct Answer {
    /// The FMU's motion, for each recording.
    pub motion: Vec<Motion>,
    /// Measured less modelled signal, rad/s or rad, for each channel.
    pub residual: Vec<Vec<f64>>,
}

/// Kinds of differences for sensitivities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Differences {
    /// (f(x + h) − f(x))/h.
    Forward,
    /// (f(x + h) − f(x − h))/2h.
    Central,
}

impl<'a> Problem<'a> {
    /// Fits unknowns with noise of the level that the recordings show and [`TYPICAL_DRIFT`] drift.
    pub fn new(
        fmu: &'a Fmu,
        setup: Setup,
        recordings: &'a [Recording],
        unknowns: Vec<Unknown>,
    ) -> Self {
        let mut channels = Vec::new();
        for (index, recording) in recordings.iter().enumerate() {
            let noise = Noise { white: recording.rate_noise().max(FLOOR), ..TYPICAL_DRIFT };
            channels.push(Channel { recording: index, signal: Signal::Rate, noise });
            if let Some(angle) = &recording.angle {
                // the angle integrates the residual of the rate: much drift
                let angle = recording.of_fresh_angle(angle);
                let white = analysis::statistics::noise_level(&angle).max(FLOOR);
                let noise = Noise { white, drift: 30.0, time: 100.0 };
                channels.push(Channel { recording: index, signal: Signal::Angle, noise });
            }
        }
        let description = fmu.description();
        let unknowns =
            unknowns.into_iter().map(|unknown| unknown.within_range_of(description)).collect();
        let differences = Differences::Forward;
        let bench = Nominal::of(fmu, &setup.settings, &[]).ok().map(|nominal| nominal.bench);
        let driven = Arc::default();
        Problem { fmu, setup, recordings, unknowns, channels, differences, bench, driven }
    }

    /// Refuses unknowns that have no effect because of the settings.
    ///
    /// # Errors
    /// For such an unknown, with the FMU's reason.
    pub fn refuse_overridden(&self) -> Result<()> {
        let parameters = self.unknowns.iter().filter_map(|unknown| match &unknown.quantity {
            Quantity::Parameter(name) => {
                let value = unknown.start;
                Some((name, near(value, (f64::MIN, f64::MAX), value.abs()).to_string()))
            }
            _ => None,
        });
        let parameters: Vec<_> = parameters.map(|(name, value)| (name.clone(), value)).collect();
        let settings = [&self.setup.settings[..], &parameters].concat();
        // what the FMU refuses here, the search tells
        let warnings = nominal::warnings(self.fmu, &settings).unwrap_or_default();
        parameters.iter().try_for_each(|(name, _)| refuse(name, &warnings))
    }

    /// Simulations so far, of all recordings; of a part of them they count as that part.
    pub fn simulations(&self) -> f64 {
        let rows: usize = self.recordings.iter().map(|r| r.time.len()).sum();
        self.driven.load(Relaxed) as f64 / rows as f64
    }

    /// Values of the unknowns for variables x.
    pub fn values(&self, x: &[f64]) -> Vec<f64> {
        self.unknowns.iter().zip(x).map(|(unknown, &x)| unknown.value(x)).collect()
    }

    /// Variables within the ranges that the FMU allows.
    pub fn inside(&self, x: &[f64]) -> Vec<f64> {
        self.unknowns.iter().zip(x).map(|(unknown, &x)| unknown.inside(x)).collect()
    }

    /// Variables of the starts.
    pub fn start(&self) -> Vec<f64> {
        let variable = |unknown: &Unknown| unknown.inside(unknown.scale.variable(unknown.start));
        self.unknowns.iter().map(variable).collect()
    }

    /// Index of a parameter of the FMU among the unknowns.
    pub fn index(&self, parameter: &str) -> Option<usize> {
        self.unknowns.iter().position(|u| u.quantity.parameter() == Some(parameter))
    }

    /// Value of an unknown, or what it is if it is not unknown.
    fn value_of(&self, x: &[f64], quantity: &Quantity, otherwise: f64) -> f64 {
        let index = self.unknowns.iter().position(|unknown| unknown.quantity == *quantity);
        index.map_or(otherwise, |i| self.unknowns[i].scale.value(x[i]))
    }

    fn motion(
        &self,
        x: &[f64],
        recording: usize,
        besides: Option<&[f64]>,
        read: Read,
    ) -> Result<Motion> {
        let values: Vec<(&str, f64)> = self
            .unknowns
            .iter()
            .zip(x)
            .filter_map(|(unknown, &x)| match &unknown.quantity {
                Quantity::Parameter(name) => Some((name.as_str(), unknown.value(x))),
                Quantity::Initial(of, name) if *of == recording => {
                    Some((name.as_str(), unknown.value(x)))
                }
                _ => None,
            })
            .collect();
        let delay = self.value_of(x, &Quantity::Delay, 0.0);
        let recording = &self.recordings[recording];
        let effects = Effects {
            torque: besides,
            actuator_lag: self.value_of(x, &Quantity::ActuatorLag, 0.0),
            gyro_lag: self.value_of(x, &Quantity::GyroLag, 0.0),
            friction_drift: self.value_of(x, &Quantity::FrictionDrift, 0.0),
        };
        self.driven.fetch_add(recording.time.len(), Relaxed);
        self.setup.run_under(self.fmu, &values, recording, delay, &effects, read)
    }

    fn motions(&self, x: &[f64], read: Read) -> Result<Vec<Motion>> {
        (0..self.recordings.len()).into_par_iter().map(|i| self.motion(x, i, None, read)).collect()
    }

    /// The FMU's answer and the residual of the recordings.
    pub fn answer(&self, x: &[f64]) -> Result<Answer> {
        let motion = self.motions(x, Read::All)?;
        let residual = self.channels.iter().map(|c| self.residual(x, *c, &motion)).collect();
        Ok(Answer { motion, residual })
    }

    fn residual(&self, x: &[f64], channel: Channel, motion: &[Motion]) -> Vec<f64> {
        let i = channel.recording;
        let (recording, motion) = (&self.recordings[i], &motion[i]);
        match channel.signal {
            Signal::Rate => {
                let scale = self.value_of(x, &Quantity::GyroScale, 1.0);
                let bias = self.value_of(x, &Quantity::GyroBias(i), 0.0);
                let pairs = recording.rate.iter().zip(&motion.rate);
                pairs.map(|(y, w)| y - scale * w - bias).collect()
            }
            Signal::Angle => {
                let offset = self.value_of(x, &Quantity::AngleOffset(i), 0.0);
                let angle = angle_at(&recording.time, motion, self.angle_lead(x));
                let pairs = recording.angle.iter().flatten().zip(angle.iter());
                pairs.map(|(y, theta)| y - theta - offset).collect()
            }
        }
    }

    /// Returns the rows of a channel that hold new values; `None`: all.
    fn fresh(&self, channel: &Channel) -> Option<&'a [bool]> {
        match channel.signal {
            Signal::Rate => self.recordings[channel.recording].fresh.as_deref(),
            Signal::Angle => self.recordings[channel.recording].angle_fresh.as_deref(),
        }
    }

    /// How much later the encoder's angle is taken than the gyro's rate, s.
    fn angle_lead(&self, x: &[f64]) -> f64 {
        let delay = self.value_of(x, &Quantity::Delay, 0.0);
        delay - self.value_of(x, &Quantity::AngleDelay, delay)
    }

    fn filters(&self) -> Vec<Whitening> {
        let filter =
            |c: &Channel| c.noise.whitening(&self.recordings[c.recording].time, self.fresh(c));
        self.channels.iter().map(filter).collect()
    }

    /// Innovations over their standard deviation, one vector a channel.
    pub fn innovations(&self, answer: &Answer) -> Vec<Vec<f64>> {
        let whitened = |(residual, filter): (&Vec<f64>, &Whitening)| {
            let mut e = residual.clone();
            filter.apply(&mut e);
            e
        };
        answer.residual.iter().zip(&self.filters()).map(whitened).collect()
    }

    /// −2 ln L of the recordings but for a constant.
    pub fn deviance(&self, answer: &Answer) -> f64 {
        let squares: f64 = self.innovations(answer).iter().flatten().map(|e| e * e).sum();
        squares + self.filters().iter().map(Whitening::log_variance).sum::<f64>()
    }

    /// Estimates each channel's noise from the residual of an answer.
    pub fn estimate_noise(&mut self, answer: &Answer) {
        let of = |(channel, residual): (&Channel, &Vec<f64>)| {
            Noise::fit(&self.recordings[channel.recording].time, residual, self.fresh(channel))
        };
        let noises: Vec<Noise> = self.channels.par_iter().zip(&answer.residual).map(of).collect();
        self.channels.iter_mut().zip(noises).for_each(|(channel, noise)| channel.noise = noise);
    }

    /// The noise from the residual at a minimum; whether it is so much another one that the minimum is, too. Sum of squares, sensitivities
    /// and covariance there are then of that noise.
    ///
    /// # Errors
    /// If a sensitivity is not finite.
    pub fn renew_noise(&mut self, found: &mut Polished) -> Result<bool> {
        let before = self.channels.clone();
        self.estimate_noise(&found.answer);
        found.cost = self.stacked(&found.answer, &found.x).norm_squared();
        let rows = |c: &Channel| self.recordings[c.recording].time.len();
        // those of a part of the recordings lead nowhere
        if found.jacobian.nrows() >= self.channels.iter().map(rows).sum() {
            let mut first = 0;
            for (then, now) in before.iter().zip(&self.channels) {
                let factor = then.noise.white / now.noise.white;
                found.jacobian.rows_mut(first, rows(now)).scale_mut(factor);
                first += rows(now);
            }
            if let Some(covariance) = Covariance::of(&found.jacobian, &self.names())? {
                found.covariance = covariance;
            }
        }
        Ok(is_other(&before, &self.channels))
    }

    /// Innovations of all channels, and how far the unknowns are from what is known of them.
    pub fn stacked(&self, answer: &Answer, x: &[f64]) -> DVector<f64> {
        let mut all = self.innovations(answer).concat();
        for (unknown, &x) in self.unknowns.iter().zip(x) {
            if let Some((mean, deviation)) = unknown.prior {
                let middle = unknown.scale.variable(mean);
                all.push((x - middle) / (deviation / unknown.scale.slope(middle)));
            }
        }
        DVector::from_vec(all)
    }

    /// The sum of squares that a fit minimises.
    pub fn cost(&self, x: &[f64]) -> Result<f64> {
        Ok(self.stacked(&self.answer(x)?, x).norm_squared())
    }

    /// Returns the part of the sum of squares that vague priors make.
    pub fn vague_cost(&self, x: &[f64]) -> f64 {
        let vague = (0..x.len()).filter(|&i| self.unknowns[i].vague);
        vague.map(|i| (self.prior_slope(i) * (x[i] - self.prior_middle(i))).powi(2)).sum()
    }

    /// x of what is known of an unknown.
    fn prior_middle(&self, i: usize) -> f64 {
        let unknown = &self.unknowns[i];
        unknown.scale.variable(unknown.prior.map_or(1.0, |(mean, _)| mean))
    }

    /// Derivative of what is known of an unknown with respect to its x: 1 over its standard deviation.
    fn prior_slope(&self, i: usize) -> f64 {
        let unknown = &self.unknowns[i];
        let (mean, deviation) = unknown.prior.unwrap_or((1.0, 1.0));
        unknown.scale.slope(unknown.scale.variable(mean)) / deviation
    }

    /// The covariance for sensitivities.
    pub fn covariance(&self, jacobian: &DMatrix<f64>) -> Result<Covariance> {
        let names = self.names();
        Covariance::of(jacobian, &names)?.with_context(|| {
            format!(
                "some combination of the unknowns ({}) has no influence on the recording: fewer must be \
                 estimated",
                names.join(", ")
            )
        })
    }

    /// Names of the unknowns.
    pub fn names(&self) -> Vec<String> {
        self.unknowns.iter().map(|unknown| unknown.quantity.name()).collect()
    }
}

/// A cubic between two rows from values and slopes at them, and its slope; beyond the ends the slope stays.
fn hermite(time: &[f64], values: &[f64], slopes: &[f64], lead: f64) -> Vec<(f64, f64)> {
    let last = time.len() - 1;
    let mut row = 0;
    let at = |t: f64| {
        let t = t + lead;
        while row + 1 < last && time[row + 1] <= t {
            row += 1;
        }
        while row > 0 && time[row] > t {
            row -= 1;
        }
        for (end, beyond) in [(0, t <= time[0]), (last, t >= time[last])] {
            if beyond {
                return (values[end] + slopes[end] * (t - time[end]), slopes[end]);
            }
        }
        let h = time[row + 1] - time[row];
        let u = (t - time[row]) / h;
        let (a, b) = (values[row], values[row + 1]);
        let (p, q) = (h * slopes[row], h * slopes[row + 1]);
        let (c, d) = (3.0 * (b - a) - 2.0 * p - q, 2.0 * (a - b) + p + q);
        (a + u * (p + u * (c + u * d)), (p + u * (2.0 * c + 3.0 * u * d)) / h)
    };
    time.iter().copied().map(at).collect()
}

/// The angle of a motion `lead` (s) after the instants at which it was read.
fn angle_at<'m>(time: &[f64], motion: &'m Motion, lead: f64) -> Cow<'m, [f64]> {
    if lead == 0.0 {
        return Cow::Borrowed(&motion.angle);
    }
    let cubic = hermite(time, &motion.angle, &motion.rate, lead);
    Cow::Owned(cubic.into_iter().map(|(angle, _)| angle).collect())
}

/// The rate there.
fn rate_at<'m>(time: &[f64], motion: &'m Motion, lead: f64) -> Cow<'m, [f64]> {
    if lead == 0.0 {
        return Cow::Borrowed(&motion.rate);
    }
    let cubic = hermite(time, &motion.angle, &motion.rate, lead);
    Cow::Owned(cubic.into_iter().map(|(_, rate)| rate).collect())
}

/// Speeds of some of the rows, growing, rad/s.
pub fn speeds(motion: &[Motion]) -> Vec<f64> {
    let mut speeds: Vec<f64> =
        motion.iter().flat_map(|m| &m.rate).step_by(7).map(|w| w.abs()).collect();
    speeds.sort_by(f64::total_cmp);
    speeds
}

/// The speed that 1 % of the rows exceed, rad/s.
pub fn fastest(motion: &[Motion]) -> f64 {
    let speeds = speeds(motion);
    speeds[speeds.len() * 99 / 100]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channels(white: f64, drift: f64) -> [Channel; 1] {
        let noise = Noise { white, drift, time: 100.0 };
        [Channel { recording: 0, signal: Signal::Angle, noise }]
    }

    /// An encoder that is later or earlier than the gyro reads the motion's angle at its own instants.
    #[test]
    fn an_angle_is_known_between_rows() {
        let time: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k)).collect();
        let (sine, cosine) = (|t: f64| (15.0 * t).sin(), |t: f64| 15.0 * (15.0 * t).cos());
        let motion = Motion {
            angle: time.iter().map(|t| sine(*t)).collect(),
            rate: time.iter().map(|t| cosine(*t)).collect(),
            ..Motion::default()
        };
        for lead in [-0.053, -0.004, 0.0, 0.02, 0.031] {
            let (angle, rate) = (angle_at(&time, &motion, lead), rate_at(&time, &motion, lead));
            // the cubic's remainder, (15 h)⁴/384, and that of its slope
            for k in 3..197 {
                assert!((angle[k] - sine(time[k] + lead)).abs() < 3e-5, "{lead} {k}");
                assert!((rate[k] - cosine(time[k] + lead)).abs() < 5e-3, "{lead} {k}");
            }
        }
    }

    /// An encoder's angle is taken for all drift at first: once that is known to be little, the minimum is another one, whatever the white
    /// noise.
    #[test]
    fn noise_is_another_one_by_its_drift_too_where_that_counts() {
        let first = channels(3e-4, 30.0);
        assert!(is_other(&first, &channels(3e-4, 0.8)));
        assert!(is_other(&first, &channels(2e-4, 30.0)));
        assert!(!is_other(&first, &channels(3.1e-4, 29.0)));
        // next to nothing, and nothing
        assert!(!is_other(&channels(3e-4, 1e-3), &channels(3e-4, 1e-4)));
    }
}

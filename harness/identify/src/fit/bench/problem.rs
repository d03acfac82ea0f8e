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
//! Far from the minimum the search is that of [`crate::fit::minimum`]. Near it, Gauss–Newton steps reuse their sensitivities while
//! they still reduce the cost: one simulation a step instead of one for each unknown. It ends by the Newton decrement
//!
//! ```text
//! λ = sqrt(gᵀ (JᵀJ)⁻¹ g),   g = Jᵀe
//! ```
//!
//! which is the distance to the minimum in standard deviations, whatever the units (Boyd & Vandenberghe,
//! Convex Optimization, 9.5).
//!
//! Sensitivities to s, b and δ are exact: −ω, −1 and s ω'. Those to the FMU's parameters are
//! differences. The step moves the whole answer by [`BENCH_MOVE`] standard deviations of its noise:
//! small against curvature and large against the integrator's tolerance
//! (`sensitivities_are_those_of_smaller_and_larger_steps` in tests/twin.rs).
//!
//! Along a valley large sensitivities cancel: c and d of the friction are 0.9999 correlated, and differences that are right to 1
//! % say nothing about c − d. So differences are taken along the directions L = V S⁻¹ of earlier sensitivities J = U S Vᵀ. These
//! directions move the answer by one standard deviation each, at right angles to one another. With D the differences along them,
//! J = D L⁻¹ is as accurate along the valley as across it.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use anyhow::{Context, Result};
use host::fmu::Fmu;
use nalgebra::{DMatrix, DVector};
use names::hubslosh::{friction, init};
use rayon::prelude::*;

use crate::fit::covariance::{self, Covariance};
use crate::fit::minimum::{self, End, SumOfSquares};
use crate::input::recording::Recording;
use crate::model::bench::effect::Effects;
use crate::model::bench::nominal::{self, Bench, Nominal};
use crate::model::bench::simulate::{Motion, Read, Setup};
use crate::model::bench::stribeck;
use crate::model::bench::tank;
use crate::model::bench::unknown::{Quantity, Scale, Unknown};
use crate::model::overridden::{near, refuse};
use crate::tuning::{
    BENCH_DECREMENT, BENCH_FIRST_STEP, BENCH_MOVE, BENCH_STEPS, LONGEST_STEP, LOUDEST, MINIMUM,
    MOST_SETS, NOISE_FACTOR, ROUNDS, RUN_IN, SHARPEST_BEND, SHORTEST_GROWTH, TYPICAL_DRIFT,
    WINDOW_JUMP, WINDOW_PRIOR,
};
use analysis::gauss_markov::{FLOOR, Noise, Whitening};

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

/// End of a search from afar, over all recordings or a part of them; the answer is with the stacked innovations.
pub type Rough = minimum::Minimum<(Answer, DVector<f64>), f64>;

impl Rough {
    /// Mean square of the stacked innovations.
    fn mean_square(&self) -> f64 {
        let e = &self.answer.1;
        e.norm_squared() / e.len() as f64
    }
}

/// A minimum with its sensitivities.
#[derive(Clone)]
pub struct Polished {
    /// Variables x of the unknowns.
    pub x: Vec<f64>,
    /// Sensitivities there or, if a step went from there, very near; those of a part of the recordings where that part refuted the model.
    pub jacobian: DMatrix<f64>,
    /// Covariance there.
    pub covariance: Covariance,
    /// The FMU's answer there.
    pub answer: Answer,
    /// Sum of squares there.
    pub cost: f64,
    /// Newton decrement: the distance to the minimum, in standard deviations.
    pub decrement: f64,
}

impl Polished {
    /// Returns true if it is a minimum.
    pub fn converged(&self) -> bool {
        self.decrement < MINIMUM
    }
}

/// Sensitivities known before Gauss–Newton steps.
#[derive(Clone, Copy, Debug)]
pub enum Known<'j> {
    /// Nothing.
    Nothing,
    /// Sensitivities of a similar problem: they give the directions of the first differences.
    Directions(&'j DMatrix<f64>),
    /// Sensitivities of nearly the same problem: the search starts with them.
    Sensitivities(&'j DMatrix<f64>),
}

/// Conditions that end Gauss–Newton steps.
#[derive(Clone, Copy, Debug)]
pub struct Until {
    /// Newton decrement that is small enough.
    pub decrement: f64,
    /// Most sets of sensitivities.
    pub rounds: usize,
    /// Sum of squares that counts: steps end if they cannot come below it.
    pub cost: f64,
    /// Newton decrement up to which that forecast is trusted.
    pub trust: f64,
    /// Sum of squares above which steps end after the first one.
    pub far: f64,
}

impl Until {
    /// Returns the condition to end at the minimum, whatever its sum of squares.
    fn minimum(rounds: usize) -> Self {
        Until { decrement: BENCH_DECREMENT, rounds, ..Until::at_most(f64::INFINITY) }
    }

    /// Returns the condition to end at the minimum, or if the minimum's sum of squares is above `cost`.
    pub fn at_most(cost: f64) -> Self {
        let (decrement, rounds) = (BENCH_DECREMENT, ROUNDS);
        Until { decrement, rounds, cost, trust: f64::INFINITY, far: f64::INFINITY }
    }

    /// Returns true if the sum of squares will not come below the one that counts.
    pub fn is_hopeless(&self, cost: f64, decrement: f64) -> bool {
        decrement < self.trust && Until::foreseen(cost, decrement) > self.cost
    }

    /// Returns the least sum of squares that steps can leave. To second order it falls by the decrement's square; half as much again is allowed for.
    pub fn foreseen(cost: f64, decrement: f64) -> f64 {
        cost - 1.5 * decrement * decrement
    }
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
            Noise::of(&self.recordings[channel.recording].time, residual, self.fresh(channel))
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

    /// Derivatives of the stacked innovations and priors with respect to the variables `which` of x.
    /// `base` is the motion at x.
    pub fn jacobian(
        &self,
        x: &[f64],
        which: &[usize],
        base: &[Motion],
        steps: &[f64],
    ) -> Result<DMatrix<f64>> {
        let column = |k: usize| self.column(x, which[k], base, steps[which[k]]);
        Ok(self.with_priors(&self.whitened(which.len(), &column)?, which))
    }

    /// A matrix whose columns are given channel by channel, each turned into innovations.
    fn whitened(
        &self,
        count: usize,
        column: &(dyn Fn(usize) -> Result<Vec<Vec<f64>>> + Sync),
    ) -> Result<DMatrix<f64>> {
        let filters = self.filters();
        let filtered = |k: usize| -> Result<Vec<f64>> {
            let mut pieces = column(k)?;
            pieces.iter_mut().zip(&filters).for_each(|(piece, filter)| filter.apply(piece));
            Ok(pieces.concat())
        };
        let columns: Vec<Vec<f64>> =
            (0..count).into_par_iter().map(filtered).collect::<Result<_>>()?;
        let rows = self.channels.iter().map(|c| self.recordings[c.recording].time.len()).sum();
        Ok(DMatrix::from_vec(rows, count, columns.concat()))
    }

    /// Sensitivities to the variables `which` with the rows of what is known of unknowns below.
    fn with_priors(&self, sensitivities: &DMatrix<f64>, which: &[usize]) -> DMatrix<f64> {
        let known: Vec<usize> =
            (0..self.unknowns.len()).filter(|&j| self.unknowns[j].prior.is_some()).collect();
        let rows = sensitivities.nrows();
        let mut all = sensitivities.clone().resize_vertically(rows + known.len(), 0.0);
        for (row, i) in known.into_iter().enumerate() {
            if let Some(column) = which.iter().position(|&j| j == i) {
                all[(rows + row, column)] = self.prior_slope(i);
            }
        }
        all
    }

    /// Derivative of the residuals with respect to one variable, for each channel.
    fn column(&self, x: &[f64], j: usize, base: &[Motion], step: f64) -> Result<Vec<Vec<f64>>> {
        let quantity = &self.unknowns[j].quantity;
        if quantity.is_in_runs() {
            let moved = |by: f64| -> Result<Vec<Motion>> {
                let mut moved = x.to_vec();
                moved[j] += by;
                let each = (0..self.recordings.len()).into_par_iter();
                each.map(|i| match quantity {
                    Quantity::Initial(of, _) if *of != i => Ok(base[i].clone()),
                    _ => self.motion(&moved, i, None, Read::States),
                })
                .collect()
            };
            return self.differenced(x, base, step, &moved);
        }
        let slope = self.unknowns[j].scale.slope(x[j]);
        let scale = self.value_of(x, &Quantity::GyroScale, 1.0);
        let exact = |c: &Channel| -> Vec<f64> {
            let motion = &base[c.recording];
            match (quantity, c.signal) {
                (Quantity::GyroScale, Signal::Rate) => {
                    motion.rate.iter().map(|w| -w * slope).collect()
                }
                (Quantity::GyroBias(of), Signal::Rate)
                | (Quantity::AngleOffset(of), Signal::Angle)
                    if c.recording == *of =>
                {
                    vec![-slope; motion.rate.len()]
                }
                (Quantity::Delay, Signal::Rate) => {
                    motion.acceleration.iter().map(|a| scale * a * slope).collect()
                }
                (Quantity::Delay, Signal::Angle) if self.has_angle_delay() => {
                    vec![0.0; motion.rate.len()]
                }
                (Quantity::Delay | Quantity::AngleDelay, Signal::Angle) => {
                    let time = &self.recordings[c.recording].time;
                    let rate = rate_at(time, motion, self.angle_lead(x));
                    rate.iter().map(|w| w * slope).collect()
                }
                _ => vec![0.0; motion.rate.len()],
            }
        };
        Ok(self.channels.iter().map(exact).collect())
    }

    /// Derivative of the stacked innovations and priors with respect to k, under torques k φ on the hub: `torque` is φ at the
    /// rows of each recording.
    pub fn to_torque(
        &self,
        x: &[f64],
        base: &[Motion],
        torque: &[Vec<f64>],
        step: f64,
    ) -> Result<DVector<f64>> {
        let moved = |by: f64| -> Result<Vec<Motion>> {
            let each = (0..self.recordings.len()).into_par_iter();
            each.map(|i| {
                let scaled: Vec<f64> = torque[i].iter().map(|phi| by * phi).collect();
                self.motion(x, i, Some(&scaled), Read::States)
            })
            .collect()
        };
        let column = self.whitened(1, &|_| self.differenced(x, base, step, &moved))?;
        Ok(self.with_priors(&column, &[]).column(0).into_owned())
    }

    /// Derivative of the residuals for each channel by differences of the motion, which `moved` gives some steps from
    /// x in a direction.
    fn differenced(
        &self,
        x: &[f64],
        base: &[Motion],
        step: f64,
        moved: &dyn Fn(f64) -> Result<Vec<Motion>>,
    ) -> Result<Vec<Vec<f64>>> {
        let ahead = moved(step)?;
        let (behind, width) = match self.differences {
            Differences::Forward => (None, step),
            Differences::Central => (Some(moved(-step)?), 2.0 * step),
        };
        let behind = behind.as_deref().unwrap_or(base);
        let scale = self.value_of(x, &Quantity::GyroScale, 1.0);
        let lead = self.angle_lead(x);
        let difference = |c: &Channel| -> Vec<f64> {
            let (a, b) = (&ahead[c.recording], &behind[c.recording]);
            let time = &self.recordings[c.recording].time;
            let angles = [a, b].map(|m| match c.signal {
                Signal::Rate => Cow::Borrowed(&[][..]),
                Signal::Angle => angle_at(time, m, lead),
            });
            let (a, b, factor) = match c.signal {
                Signal::Rate => (&a.rate[..], &b.rate[..], scale / width),
                Signal::Angle => (&*angles[0], &*angles[1], 1.0 / width),
            };
            a.iter().zip(b).map(|(a, b)| -factor * (a - b)).collect()
        };
        Ok(self.channels.iter().map(difference).collect())
    }

    fn has_angle_delay(&self) -> bool {
        self.unknowns.iter().any(|unknown| unknown.quantity == Quantity::AngleDelay)
    }

    /// Steps of the differences that move the answer by [`BENCH_MOVE`] at these sensitivities.
    pub fn steps(jacobian: &DMatrix<f64>) -> Vec<f64> {
        let step = |norm: f64| {
            if norm > 0.0 {
                (BENCH_MOVE / norm).clamp(BENCH_STEPS.0, BENCH_STEPS.1)
            } else {
                BENCH_STEPS.1
            }
        };
        jacobian.column_iter().map(|column| step(column.norm())).collect()
    }

    /// Sensitivities at x to the variables `free`. The differences' directions come from sensitivities `known` to all
    /// variables, of this or a similar problem; if there are none, rough ones are found first.
    pub fn sensitivities(
        &self,
        x: &[f64],
        free: &[usize],
        base: &[Motion],
        known: Option<&DMatrix<f64>>,
    ) -> Result<DMatrix<f64>> {
        let Some(known) = known else {
            let axes = vec![BENCH_FIRST_STEP; x.len()];
            let rough = self.jacobian(x, free, base, &axes)?;
            let known = at_places(&rough, free, x.len());
            return self.sensitivities(x, free, base, Some(&known));
        };
        let is_parameter = |j: &usize| matches!(self.unknowns[*j].quantity, Quantity::Parameter(_));
        let (mixed, single): (Vec<usize>, Vec<usize>) =
            free.iter().copied().partition(is_parameter);
        let steps = Problem::steps(known);
        let along_axes = self.jacobian(x, &single, base, &steps)?;
        let mixture = self.along(x, &mixed, base, known)?;
        let all = at_places(&along_axes, &single, x.len()) + at_places(&mixture, &mixed, x.len());
        Ok(all.select_columns(free))
    }

    /// Sensitivities to the parameters `mixed`, differenced along the directions that `known` ones give.
    fn along(
        &self,
        x: &[f64],
        mixed: &[usize],
        base: &[Motion],
        known: &DMatrix<f64>,
    ) -> Result<DMatrix<f64>> {
        let names: Vec<String> = mixed.iter().map(|&j| self.unknowns[j].quantity.name()).collect();
        let (directions, _) = covariance::directions(&known.select_columns(mixed), &names)?;
        let fastest = fastest(base);
        let column = |k: usize| {
            let direction = directions.column(k);
            let step = BENCH_MOVE.min(LONGEST_STEP / direction.amax());
            let moved = |by: f64| {
                let mut part = vec![0.0; x.len()];
                mixed.iter().zip(&direction).for_each(|(&j, d)| part[j] = by * d);
                self.motions(&self.moved(x, &part, fastest), Read::States)
            };
            self.differenced(x, base, step, &moved)
        };
        let differences = self.whitened(mixed.len(), &column)?;
        let inverse = directions.clone().try_inverse();
        let found = differences * inverse.context("sensitivities without a direction")?;
        Ok(self.with_priors(&found, mixed))
    }

    /// x with a step added along the valleys that are known: of the friction's curve, and of tank and hub.
    pub fn moved(&self, x: &[f64], step: &[f64], fastest: f64) -> Vec<f64> {
        let mut there = stribeck::moved(&self.unknowns, x, step, fastest);
        if let Some(bench) = self.bench {
            tank::bent(&self.unknowns, bench, x, step, &mut there);
        }
        there
    }

    /// Returns ∂[`Problem::moved`]/∂step at x and this step, in the variables `free`.
    pub fn turn(&self, x: &[f64], step: &[f64], free: &[usize], fastest: f64) -> DMatrix<f64> {
        let small = 1e-5;
        let column = |k: usize| {
            let at = |by: f64| {
                let mut step = step.to_vec();
                step[free[k]] += by;
                self.moved(x, &step, fastest)
            };
            let (ahead, behind) = (at(small), at(-small));
            let of = |j: &usize| (ahead[*j] - behind[*j]) / (2.0 * small);
            DVector::from_iterator(free.len(), free.iter().map(of))
        };
        DMatrix::from_columns(&(0..free.len()).map(column).collect::<Vec<_>>())
    }

    /// Moves sensitivities along a valley without a simulation. They are constant in the variables in which the valley is
    /// straight, so J there is J here times the inverse of `turn`. The rows of priors stay. Returns false and changes nothing if
    /// `turn` cannot be inverted: a bound has cut the step short (there is no such tank).
    pub fn carry(&self, jacobian: &mut DMatrix<f64>, turn: &DMatrix<f64>) -> bool {
        let known = self.unknowns.iter().filter(|unknown| unknown.prior.is_some()).count();
        let Some(back) = turn.clone().try_inverse().filter(|back| back.amax() < SHARPEST_BEND)
        else {
            return false;
        };
        let mut rows = jacobian.rows_mut(0, jacobian.nrows() - known);
        let carried = &rows * back;
        rows.copy_from(&carried);
        true
    }

    /// An end of the interval of unknown j: its value `reach` standard deviations of `covariance` from x, along the valley that it is in.
    pub fn end(
        &self,
        x: &[f64],
        covariance: &DMatrix<f64>,
        (j, reach): (usize, f64),
        fastest: f64,
    ) -> f64 {
        let (unknown, deviation) = (&self.unknowns[j], covariance[(j, j)].sqrt());
        if unknown.is_additive() || deviation == 0.0 {
            return unknown.end(x[j], reach * deviation);
        }
        let step = covariance.column(j) * (reach / deviation);
        unknown.scale.value(self.moved(x, step.as_slice(), fastest)[j])
    }

    /// Sensitivities at x: those to the parameters `which` by differences along the directions of `known`, the others as known.
    pub fn refreshed(
        &self,
        x: &[f64],
        which: &[usize],
        base: &[Motion],
        known: &DMatrix<f64>,
    ) -> Result<DMatrix<f64>> {
        let found = self.along(x, which, base, known)?;
        let mut all = known.clone();
        which.iter().enumerate().for_each(|(k, &j)| all.set_column(j, &found.column(k)));
        Ok(all)
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

    /// Gauss and Newton's steps from near a minimum, until the Newton decrement is below [`BENCH_DECREMENT`], with
    /// at most `rounds` sets of sensitivities. A step v that increases the cost has left a curved valley. The curvature's part is
    /// e(x + v) − e(x) − J v, and −(JᵀJ)⁻¹Jᵀ times it leads back: a correction of second order that costs one simulation
    /// (geodesic acceleration; Transtrum & Sethna, arXiv:1207.4999). A step that is worse even so is shortened.
    pub fn polish(
        &self,
        x: &[f64],
        known: Option<&DMatrix<f64>>,
        rounds: usize,
    ) -> Result<Polished> {
        self.polish_from((x, self.answer(x)?), known, rounds)
    }

    /// The same where the FMU's answer at x is known.
    pub fn polish_from(
        &self,
        at: (&[f64], Answer),
        known: Option<&DMatrix<f64>>,
        rounds: usize,
    ) -> Result<Polished> {
        let all: Vec<usize> = (0..at.0.len()).collect();
        let known = known.map_or(Known::Nothing, Known::Directions);
        self.polish_some(at, &all, known, Until::minimum(rounds))
    }

    /// The same from where a search has ended.
    pub fn polish_on(&self, from: &Polished, rounds: usize) -> Result<Polished> {
        self.polish_from((&from.x, from.answer.clone()), Some(&from.jacobian), rounds)
    }

    /// The same from sensitivities of a problem that differs by next to nothing: they serve until they no longer do, and others
    /// are found then.
    pub fn polish_near(
        &self,
        x: &[f64],
        sensitivities: &DMatrix<f64>,
        until: Until,
    ) -> Result<Polished> {
        let all: Vec<usize> = (0..x.len()).collect();
        let answer = self.answer(x)?;
        self.polish_some((x, answer), &all, Known::Sensitivities(sensitivities), until)
    }

    /// The same in the variables `free` alone, from x with the FMU's answer there. Sensitivities and covariance are those of
    /// these variables.
    pub fn polish_some(
        &self,
        (x, mut answer): (&[f64], Answer),
        free: &[usize],
        known: Known,
        until: Until,
    ) -> Result<Polished> {
        let mut x = x.to_vec();
        let mut e = self.stacked(&answer, &x);
        let fastest = fastest(&answer.motion);
        let (mut known, mut given) = match known {
            Known::Nothing => (None, None),
            Known::Directions(known) => (Some(known.clone()), None),
            Known::Sensitivities(known) => (None, Some(known.select_columns(free))),
        };
        for round in 1.. {
            let mut jacobian = match given.take() {
                Some(jacobian) => jacobian,
                None => self.sensitivities(&x, free, &answer.motion, known.as_ref())?,
            };
            let mut covariance = self.covariance(&jacobian)?;
            // decrement of the step before, and which part of that was taken
            let (mut before, mut part) = (f64::INFINITY, 1.0_f64);
            let (decrement, hopeless) = loop {
                let gradient = jacobian.tr_mul(&e);
                let step = -(&covariance.x * &gradient);
                let decrement = (-gradient.dot(&step)).max(0.0).sqrt();
                // the same sensitivities serve as long as they come closer by half of what they foresee
                let serve = decrement <= (1.0 - 0.5 * part) * before;
                let cost = e.norm_squared();
                let is_far = before.is_finite() && cost > until.far;
                let hopeless = is_far || until.is_hopeless(cost, decrement);
                if decrement < until.decrement || !serve || hopeless {
                    break (decrement, hopeless);
                }
                before = decrement;
                let mut taken = false;
                part = (3.0 * part).min(1.0);
                // what is left to gain shows in whole steps or not at all
                let shortest = if decrement < MINIMUM { 0.5 } else { 1e-3 };
                while part > shortest && !taken {
                    let at_free = |values: DVector<f64>| {
                        let mut all = vec![0.0; x.len()];
                        free.iter().zip(values.iter()).for_each(|(&j, value)| all[j] = *value);
                        all
                    };
                    let mut way = vec![(x.clone(), at_free(part * &step))];
                    let mut trial = self.inside(&self.moved(&x, &way[0].1, fastest));
                    // the step and, where it makes it worse, the same along the bent valley
                    for is_straight in [true, false] {
                        let Ok(there) = self.answer(&trial) else { break };
                        let new = self.stacked(&there, &trial);
                        if new.norm_squared() < e.norm_squared() {
                            for (from, step) in &way {
                                let turn = self.turn(from, step, free, fastest);
                                if self.carry(&mut jacobian, &turn) {
                                    covariance.x = &turn * covariance.x * turn.transpose();
                                }
                            }
                            (x, answer, e, taken) = (trial, there, new, true);
                            break;
                        }
                        if !is_straight {
                            break;
                        }
                        let bend = &new - &e - part * (&jacobian * &step);
                        let back = -(&covariance.x * jacobian.tr_mul(&bend));
                        way.push((trial, at_free(back)));
                        trial = self.inside(&self.moved(&way[1].0, &way[1].1, fastest));
                    }
                    if !taken {
                        part *= 0.3;
                    }
                }
                if !taken {
                    break (decrement, false);
                }
            };
            let ended = decrement < until.decrement.max(MINIMUM);
            if ended || hopeless || round >= until.rounds {
                let (cost, covariance) = (e.norm_squared(), self.covariance(&jacobian)?);
                return Ok(Polished { x, jacobian, covariance, answer, cost, decrement });
            }
            known = Some(at_places(&jacobian, free, x.len()));
        }
        unreachable!("the rounds are counted")
    }

    /// If a search has ended off the minimum, searches again with the unknowns held whose minimum is at a kink, which no Newton
    /// step finds. These are a friction that the step would make negative, an unknown that it would lead out of the FMU's range,
    /// and an initial rate of the hub that is zero within two standard deviations. (Dry friction stops a slow hub within a row,
    /// whatever the sign of its rate.) Sensitivities and covariance are those of all unknowns.
    pub fn polish_at_kink(&self, found: Polished, rounds: usize) -> Result<Polished> {
        if found.decrement < MINIMUM {
            return Ok(found);
        }
        let e = self.stacked(&found.answer, &found.x);
        let step = -(&found.covariance.x * found.jacobian.tr_mul(&e));
        let is_held = |&j: &usize| {
            let Unknown { quantity, scale, .. } = &self.unknowns[j];
            let (x, deviation) = (found.x[j], found.covariance.x[(j, j)].sqrt());
            let [low, high] = self.unknowns[j].ends();
            if x <= low && step[j] < 0.0 || x >= high && step[j] > 0.0 {
                return true;
            }
            match quantity {
                Quantity::Initial(_, name) => name == init::OMEGA && x.abs() < 2.0 * deviation,
                _ => {
                    matches!(scale, Scale::Softplus(_))
                        && scale.value(x) + scale.slope(x) * step[j] < 0.0
                }
            }
        };
        let all: Vec<usize> = (0..found.x.len()).collect();
        let (held, free): (Vec<usize>, Vec<usize>) = all.iter().partition(|j| is_held(j));
        if held.is_empty() {
            return Ok(found);
        }
        let known = Known::Directions(&found.jacobian);
        let start = (&found.x[..], found.answer);
        let there = self.polish_some(start, &free, known, Until::minimum(rounds))?;
        let motion = &there.answer.motion;
        let jacobian = self.sensitivities(&there.x, &all, motion, Some(&found.jacobian))?;
        Ok(Polished { covariance: self.covariance(&jacobian)?, jacobian, ..there })
    }

    /// The covariance of estimates at x, where the recordings are what the FMU does: the Cramér–Rao bound; and the
    /// sensitivities.
    pub fn information(&self, x: &[f64]) -> Result<(Covariance, DMatrix<f64>)> {
        let motion = self.motions(x, Read::All)?;
        let all: Vec<usize> = (0..x.len()).collect();
        let jacobian = self.sensitivities(x, &all, &motion, None)?;
        Ok((self.covariance(&jacobian)?, jacobian))
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

    /// Searches from x until steps would lessen the sum of squares by less than this part of it.
    ///
    /// # Errors
    /// If the FMU refuses the start, or a difference.
    pub fn search(&self, x: &[f64], part: f64) -> Result<Rough> {
        let end = End { decrement: BENCH_DECREMENT, part, most: MOST_SETS };
        minimum::search(
            self,
            &self.inside(x),
            vec![BENCH_FIRST_STEP; x.len()],
            end,
            &mut |_, _, _| {},
        )
    }

    /// The same over windows of the recordings that grow, each from the estimate of the one before.
    ///
    /// A start whose slosh frequency is 20 % off is out of phase after a few cycles; over a whole
    /// recording its error has as many minima as there are cycles. Over the beginning it has one,
    /// and as the window grows the estimate stays within its reach. If the residual's mean square rises by the factor [`WINDOW_JUMP`]
    /// from one window to the next (a resonance or rotary slosh begins), the window grows in smaller steps.
    pub fn search_growing(
        &self,
        x: &[f64],
        windows: &[f64],
        progress: &mut dyn FnMut(String),
    ) -> Result<Rough> {
        let mut to_come: Vec<f64> = windows.iter().rev().copied().collect();
        let (mut from, mut last) = (x.to_vec(), None);
        // the last window, its residual, its estimate; none once a leap was taken all the same
        let mut before: Option<(f64, f64, Vec<f64>)> = None;
        let mut careful = true;
        while let Some(window) = to_come.pop() {
            let part: Vec<Recording> =
                self.recordings.iter().map(|r| r.beginning(window)).collect();
            let found = self.search_part(x, &from, &part)?;
            let residual = found.mean_square();
            progress(format!("window of {:.0} %: mean square {residual:.3e}", 100.0 * window));
            if let Some((reached, less, estimate)) =
                before.take_if(|b| residual > WINDOW_JUMP * b.1)
            {
                if window - reached > SHORTEST_GROWTH {
                    to_come.extend([window, 0.5 * (reached + window)]);
                    from.clone_from(&estimate);
                    before = Some((reached, less, estimate));
                    continue;
                }
                careful = false;
            }
            if careful {
                before = Some((window, residual, found.x.clone()));
            }
            from.clone_from(&found.x);
            last = Some(found);
        }
        let mut rough = last.context("there is no window")?;
        rough.jacobian *= NOISE_FACTOR;
        Ok(rough)
    }

    /// The same over the loudest parts, from x; over the whole recordings where they have none.
    pub fn search_loudest(&self, x: &[f64]) -> Result<Rough> {
        let Some(part) = self.loudest() else { return self.search_growing(x, &WHOLE, &mut |_| {}) };
        let mut rough = self.search_part(x, x, &part)?;
        let rows = |all: &[Recording]| all.iter().map(|r| r.time.len()).sum::<usize>() as f64;
        rough.jacobian *= NOISE_FACTOR * (rows(self.recordings) / rows(&part)).sqrt();
        Ok(rough)
    }

    /// The loudest parts of the recordings; `None` where one has none.
    pub fn loudest(&self) -> Option<Vec<Recording>> {
        self.recordings.iter().map(|r| r.loudest(LOUDEST, RUN_IN)).collect()
    }

    /// Searches over parts of the recordings from x. A wide prior ([`WINDOW_PRIOR`]) holds each parameter near its first start,
    /// because a short window does not determine all. Noise of [`NOISE_FACTOR`] times the gyro's covers what the model cannot
    /// follow yet.
    fn search_part(&self, first: &[f64], x: &[f64], part: &[Recording]) -> Result<Rough> {
        let mut problem = Problem { recordings: part, ..self.clone() };
        for (unknown, &x) in problem.unknowns.iter_mut().zip(first) {
            if let Some(name) = unknown.quantity.parameter() {
                // the friction's shape is left to the search that knows of its valleys
                let shape = matches!(name, friction::D | friction::OMEGA_S);
                let width = if shape { 0.4 * WINDOW_PRIOR } else { WINDOW_PRIOR };
                let value = unknown.scale.value(x);
                let size = match unknown.scale {
                    Scale::Log | Scale::Softplus(_) => value,
                    Scale::Logit(..) | Scale::Linear(_) => unknown.scale.slope(x).abs(),
                };
                unknown.prior = Some((value, width * size));
            }
        }
        for channel in &mut problem.channels {
            channel.noise.white *= NOISE_FACTOR;
        }
        problem.search(x, 1e-3)
    }
}

impl SumOfSquares for Problem<'_> {
    type Answer = (Answer, DVector<f64>);
    type Step = f64;

    fn names(&self) -> Vec<String> {
        self.names()
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.unknowns.iter().map(|unknown| unknown.ends().into()).collect()
    }

    fn at(&self, x: &[f64]) -> Result<Self::Answer> {
        let answer = self.answer(x)?;
        let e = self.stacked(&answer, x);
        Ok((answer, e))
    }

    fn residuals(answer: &Self::Answer) -> &DVector<f64> {
        &answer.1
    }

    fn derivatives(
        &self,
        x: &[f64],
        answer: &Self::Answer,
        steps: &mut [f64],
    ) -> Result<DMatrix<f64>> {
        let all: Vec<usize> = (0..x.len()).collect();
        let found = self.jacobian(x, &all, &answer.0.motion, steps)?;
        steps.copy_from_slice(&Problem::steps(&found));
        Ok(found)
    }
}

/// The columns of a matrix at these places of `n` columns, with zeros for the others.
fn at_places(columns: &DMatrix<f64>, places: &[usize], n: usize) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(columns.nrows(), n);
    places.iter().enumerate().for_each(|(k, &j)| all.set_column(j, &columns.column(k)));
    all
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

/// All of the recordings at once.
const WHOLE: [f64; 1] = [1.0];

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

    /// To second order the sum of squares falls by the decrement's square; by how much that may be too little is for whoever asks.
    #[test]
    fn a_search_is_hopeless_only_where_its_foresight_is_trusted() {
        let until = Until { trust: 1.0, ..Until::at_most(100.0) };
        assert!(until.is_hopeless(103.0, 0.9));
        assert!(!until.is_hopeless(101.0, 0.9));
        assert!(!until.is_hopeless(103.0, 1.1));
        assert!(Until::at_most(100.0).is_hopeless(103.0, 1.1));
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

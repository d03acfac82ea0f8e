//! The sum of squares that the identification of any FMU minimises, and its derivatives.
//!
//! ```text
//! Σ e_k² + Σ ((x_i − μ_i)/s_i)²,   e = whitened( y_ok − y_o(t_k; x) − Σ_j M_oj y_j(t_k; x) − b_o )
//! ```
//!
//! y are the FMU's outputs, M and b the errors of the sensors, the whitening filter that of [`analysis::gauss_markov`], the second
//! sum what is known beforehand.
//!
//! Derivatives by M and b are exact. Derivatives by parameters and starts are central differences of whole runs. Each step moves
//! the answer by [`MOVE`] standard deviations, the smallest change that the recordings resolve. It is large against the solver's
//! errors, and it is a derivative in the mean where an event moves across a row and the residual jumps.
//! `fmi2GetDirectionalDerivative` does not help: after initialization it gives derivatives by states and inputs alone (FMI 2.0.5,
//! section 2.1.9), and unknowns are set before it. The variational equations would need ∂f/∂p by differences all the same, and
//! jump at each event.

use std::borrow::Cow;

use anyhow::Result;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::input::record::Record;
use crate::model::overridden::{near, refuse};
use crate::model::simulate::{Model, Setup, Value};
use crate::model::unknown::{Unknown, What};
use crate::tuning::{BEND, FIRST_STEP, MOVE, OUTPUT_JUMP, STEPS, WIDER};
use analysis::gauss_markov::{Noise, Whitening};
use analysis::statistics::median;

/// An output of a recording with its noise.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Number of the recording.
    pub recording: usize,
    /// Number of the output.
    pub output: usize,
    /// Noise.
    pub noise: Noise,
    /// Rows that have a value.
    pub sampled: Vec<bool>,
}

/// The FMU's outputs by recording, output and row.
pub type Motion = Vec<Vec<Vec<f64>>>;

/// A model, recordings and unknowns.
#[derive(Clone)]
pub struct Problem<'a> {
    /// The FMU.
    pub model: &'a Model,
    /// Setup of the simulation.
    pub setup: &'a Setup,
    /// Recordings, fitted together.
    pub records: &'a [Record],
    /// Unknowns.
    pub unknowns: Vec<Unknown>,
    /// Outputs with their noise.
    pub channels: Vec<Channel>,
}

/// Step of the differences by one unknown, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Size.
    pub size: f64,
    /// Smaller steps were seen to measure the noise of the FMU's solver; 0: none was.
    pub least: f64,
}

/// A difference of the residuals by one unknown.
struct Difference {
    /// Residuals per unit of the unknown, for each channel.
    slope: Vec<Vec<f64>>,
    /// Norm of the second difference over that of the first: near √3 where noise decides, small where neither noise nor
    /// curvature does.
    bend: f64,
}

/// Answers of the FMU to one set of values.
#[derive(Clone)]
pub struct Answer {
    /// Outputs.
    pub motion: Motion,
    /// Residuals over their standard deviation, then what is known beforehand.
    pub e: DVector<f64>,
}

impl<'a> Problem<'a> {
    /// Returns the problem with white noise estimated from each output's differences from row to row. `floor` is the least noise,
    /// relative to the output's spread.
    pub fn new(
        model: &'a Model,
        setup: &'a Setup,
        records: &'a [Record],
        unknowns: Vec<Unknown>,
        floor: f64,
    ) -> Self {
        let mut channels = Vec::new();
        for (recording, record) in records.iter().enumerate() {
            for output in 0..record.outputs.len() {
                let white = record.noise(output).max(floor * record.spread(output));
                let sampled = record.sampled(output);
                channels.push(Channel { recording, output, noise: Noise::white(white), sampled });
            }
        }
        Problem { model, setup, records, unknowns, channels }
    }

    /// Names of the unknowns.
    pub fn names(&self) -> Vec<String> {
        self.unknowns.iter().map(|unknown| unknown.name.clone()).collect()
    }

    /// The starts.
    pub fn start(&self) -> Vec<f64> {
        self.unknowns.iter().map(|unknown| unknown.start).collect()
    }

    /// Steps of the first differences.
    pub fn first_steps(&self) -> Vec<Step> {
        let first = |unknown: &Unknown| Step { size: FIRST_STEP * unknown.reach, least: 0.0 };
        self.unknowns.iter().map(first).collect()
    }

    fn values(&self, x: &[f64], number: usize) -> Vec<Value> {
        let of = |(unknown, &x): (&Unknown, &f64)| match unknown.what {
            What::Parameter { reference, .. } => {
                unknown.what.is_of(number).then_some((reference, x))
            }
            _ => None,
        };
        self.unknowns.iter().zip(x).filter_map(of).collect()
    }

    fn run(&self, x: &[f64], number: usize) -> Result<Vec<Vec<f64>>> {
        let record = self.acting(x, number);
        self.setup.run(self.model, &self.values(x, number), number, &record)
    }

    /// The recording with inputs and times as they act, if a scale is among the unknowns.
    fn acting(&self, x: &[f64], number: usize) -> Cow<'_, Record> {
        let mut record = Cow::Borrowed(&self.records[number]);
        for (unknown, x) in self.unknowns.iter().zip(x).filter(|(u, _)| u.what.is_of(number)) {
            let factor = 1.0 + x;
            match unknown.what {
                What::Scale { input, .. } => {
                    record.to_mut().inputs[input].iter_mut().for_each(|value| *value *= factor);
                }
                What::Clock { .. } => {
                    let first = record.time[0];
                    let time = &mut record.to_mut().time;
                    time.iter_mut().for_each(|t| *t = first + factor * (*t - first));
                }
                _ => {}
            }
        }
        record
    }

    /// The FMU's warnings of the motions that begin at the starts, each once.
    ///
    /// # Errors
    /// If an unknown has no effect in any recording because of another parameter.
    pub fn warnings(&self) -> Result<Vec<String>> {
        let start = self.start();
        let moved: Vec<f64> =
            self.unknowns.iter().map(|u| near(u.start, u.bounds, u.reach)).collect();
        let of = |(number, record): (usize, &Record)| {
            let with = |x: &[f64]| {
                self.setup.warnings(self.model, &self.values(x, number), number, record)
            };
            // what the FMU refuses here, the search tells
            with(&moved).or_else(|_| with(&start)).unwrap_or_default()
        };
        let warnings: Vec<Vec<String>> = self.records.iter().enumerate().map(of).collect();
        for unknown in &self.unknowns {
            let What::Parameter { recording, .. } = unknown.what else { continue };
            let own = warnings.iter().enumerate();
            let own = own.filter(|(number, _)| unknown.what.is_of(*number));
            let name = recording.and_then(|_| unknown.name.rsplit_once('@'));
            let name = name.map_or(&*unknown.name, |(name, _)| name);
            let refused: Vec<Result<()>> = own.map(|(_, said)| refuse(name, said)).collect();
            // an unknown that has an effect in one recording can be estimated
            if refused.iter().all(Result::is_err) {
                refused.into_iter().collect::<Result<()>>()?;
            }
        }
        let mut once: Vec<String> = Vec::new();
        for warning in warnings.into_iter().flatten() {
            if !once.contains(&warning) {
                once.push(warning);
            }
        }
        Ok(once)
    }

    /// The FMU's answer for x.
    pub fn answer(&self, x: &[f64]) -> Result<Answer> {
        let runs = (0..self.records.len()).into_par_iter().map(|number| self.run(x, number));
        let motion = runs.collect::<Result<Motion>>()?;
        let e = self.stacked(&motion, x);
        Ok(Answer { motion, e })
    }

    /// Measured less modelled, for each channel; 0 where nothing was read.
    pub fn residuals(&self, motion: &Motion, x: &[f64]) -> Vec<Vec<f64>> {
        let of = |channel: &Channel| {
            let (outputs, number) = (&motion[channel.recording], channel.output);
            let mut residual: Vec<f64> = self.records[channel.recording].outputs[number]
                .iter()
                .zip(&outputs[number])
                .map(|(y, model)| if y.is_nan() { 0.0 } else { y - model })
                .collect();
            for (unknown, x) in self.unknowns.iter().zip(x) {
                if let Some(shape) = sensor(unknown, channel, outputs) {
                    residual.iter_mut().enumerate().for_each(|(k, r)| *r -= x * shape(k));
                }
            }
            residual.iter_mut().zip(&channel.sampled).for_each(|(r, s)| *r *= f64::from(*s));
            residual
        };
        self.channels.iter().map(of).collect()
    }

    fn filters(&self) -> Vec<Whitening> {
        let filter = |channel: &Channel| {
            let time = &self.records[channel.recording].time;
            channel.noise.whitening(time, Some(&channel.sampled))
        };
        self.channels.iter().map(filter).collect()
    }

    /// Residuals over their standard deviation, a vector a channel.
    pub fn innovations(&self, motion: &Motion, x: &[f64]) -> Vec<Vec<f64>> {
        let mut residuals = self.residuals(motion, x);
        residuals.iter_mut().zip(self.filters()).for_each(|(r, filter)| filter.apply(r));
        residuals
    }

    /// Innovations and what is known beforehand.
    pub fn stacked(&self, motion: &Motion, x: &[f64]) -> DVector<f64> {
        let mut all = self.innovations(motion, x).concat();
        for (unknown, x) in self.unknowns.iter().zip(x) {
            if let Some((mean, std)) = unknown.prior {
                all.push((x - mean) / std);
            }
        }
        DVector::from_vec(all)
    }

    /// −2 ln L of recordings and priors but for a constant.
    pub fn deviance(&self, answer: &Answer) -> f64 {
        answer.e.norm_squared() + self.filters().iter().map(Whitening::log_variance).sum::<f64>()
    }

    /// Derivatives of the stacked innovations at x, where the motion is `base`. `steps` of the differences are made anew.
    ///
    /// # Errors
    /// If the FMU refuses every step of an unknown.
    pub fn jacobian(&self, x: &[f64], base: &Motion, steps: &mut [Step]) -> Result<DMatrix<f64>> {
        let filters = self.filters();
        let column = |j: usize| -> Result<(DVector<f64>, f64)> {
            let unknown = &self.unknowns[j];
            let (mut pieces, least) = match unknown.what.is_in_runs() {
                true => self.resolved_difference(x, j, base, steps[j])?,
                false => {
                    let one = |channel: &Channel| {
                        let rows = channel.sampled.len();
                        match sensor(unknown, channel, &base[channel.recording]) {
                            None => vec![0.0; rows],
                            Some(shape) => (0..rows).map(|k| -shape(k)).collect(),
                        }
                    };
                    (self.channels.iter().map(one).collect(), 0.0)
                }
            };
            self.whiten(&mut pieces, &filters);
            let mut all = pieces.concat();
            for (i, unknown) in self.unknowns.iter().enumerate() {
                if let Some((_, std)) = unknown.prior {
                    all.push(if i == j { 1.0 / std } else { 0.0 });
                }
            }
            Ok((DVector::from_vec(all), least))
        };
        let (columns, least): (Vec<DVector<f64>>, Vec<f64>) = (0..x.len())
            .into_par_iter()
            .map(column)
            .collect::<Result<Vec<(DVector<f64>, f64)>>>()?
            .into_iter()
            .unzip();
        let found = DMatrix::from_columns(&columns);
        for (j, step) in steps.iter_mut().enumerate() {
            let reach = self.unknowns[j].reach;
            let size = (MOVE / found.column(j).norm()).clamp(STEPS.0 * reach, STEPS.1 * reach);
            *step = Step { size: size.max(least[j]), least: least[j] };
        }
        Ok(found)
    }

    /// Masks and whitens residuals, or differences of them.
    fn whiten(&self, pieces: &mut [Vec<f64>], filters: &[Whitening]) {
        for ((piece, channel), filter) in pieces.iter_mut().zip(&self.channels).zip(filters) {
            piece.iter_mut().zip(&channel.sampled).for_each(|(v, s)| *v *= f64::from(*s));
            filter.apply(piece);
        }
    }

    /// A linear combination of motions at points that differ in one unknown, as whitened residuals; the weights add up to 0,
    /// so that the measurement cancels.
    pub fn combined(&self, x: &[f64], motions: &[(f64, &Motion)]) -> DVector<f64> {
        let mut sum: Vec<Vec<f64>> =
            self.channels.iter().map(|c| vec![0.0; c.sampled.len()]).collect();
        for (weight, motion) in motions {
            for (sum, residual) in sum.iter_mut().zip(self.residuals(motion, x)) {
                sum.iter_mut().zip(residual).for_each(|(sum, r)| *sum += weight * r);
            }
        }
        self.whiten(&mut sum, &self.filters());
        let mut all = sum.concat();
        let priors = self.unknowns.iter().filter(|unknown| unknown.prior.is_some()).count();
        all.resize(all.len() + priors, 0.0);
        DVector::from_vec(all)
    }

    /// The FMU's outputs with one unknown moved.
    pub fn moved(&self, x: &[f64], j: usize, to: f64, base: &Motion) -> Result<Motion> {
        let mut moved = x.to_vec();
        moved[j] = to;
        let what = self.unknowns[j].what;
        let runs = (0..self.records.len()).into_par_iter().map(|number| match what.is_of(number) {
            true => self.run(&moved, number),
            false => Ok(base[number].clone()),
        });
        runs.collect()
    }

    /// A difference whose step is as small as noise lets it be: where the second difference is not small against the first,
    /// wider steps are tried. A wider one makes the part of noise smaller, and that of curvature larger. Also returns the step
    /// below which noise decides.
    fn resolved_difference(
        &self,
        x: &[f64],
        j: usize,
        base: &Motion,
        step: Step,
    ) -> Result<(Vec<Vec<f64>>, f64)> {
        let mut best = self.difference(x, j, base, step.size)?;
        let (mut size, mut least) = (step.size, step.least);
        let widest = WIDER.1 * self.unknowns[j].reach;
        while best.bend > BEND && size * WIDER.0 <= widest {
            size *= WIDER.0;
            match self.difference(x, j, base, size) {
                // curvature would have made it larger
                Ok(wider) if wider.bend < 0.7 * best.bend => (best, least) = (wider, size),
                Ok(_) => {}
                Err(_) => break,
            }
        }
        Ok((best.slope, least))
    }

    /// Central difference of the residuals by one unknown; at a bound, or where the FMU refuses one side, the other side alone.
    fn difference(&self, x: &[f64], j: usize, base: &Motion, step: f64) -> Result<Difference> {
        let (low, high) = self.unknowns[j].bounds;
        let side = |by: f64| -> Result<(f64, Motion)> {
            let to = (x[j] + by).clamp(low, high);
            Ok((to, self.moved(x, j, to, base)?))
        };
        let (ahead, behind) = rayon::join(|| side(step), || side(-step));
        let here = || (x[j], base.clone());
        let (ahead, behind) = match (ahead, behind) {
            (Err(error), Err(_)) => return Err(error),
            (ahead, behind) => {
                (ahead.unwrap_or_else(|_| here()), behind.unwrap_or_else(|_| here()))
            }
        };
        let (mut to, mut from) = (x.to_vec(), x.to_vec());
        (to[j], from[j]) = (ahead.0, behind.0);
        let (to, from) = (self.residuals(&ahead.1, &to), self.residuals(&behind.1, &from));
        let width = ahead.0 - behind.0;
        let slope = |(a, b): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| (a - b) / width).collect()
        };
        let slope = to.iter().zip(&from).map(slope).collect();
        // a point between both: x itself, or halfway where one side is x
        let is_one_sided = ahead.0 <= x[j] || behind.0 >= x[j];
        let middle = 0.5 * (ahead.0 + behind.0);
        let between = match is_one_sided {
            true => self.moved(x, j, middle, base).ok().map(|motion| (middle, motion)),
            false => Some(here()),
        };
        let bend = between.map_or(0.0, |(at, motion)| {
            let part = (at - behind.0) / width;
            let bent = self.combined(
                x,
                &[(2.0, &motion), (-2.0 * part, &ahead.1), (2.0 * (part - 1.0), &behind.1)],
            );
            let first = self.combined(x, &[(1.0, &ahead.1), (-1.0, &behind.1)]).norm();
            if first > 0.0 { bent.norm() / first } else { 0.0 }
        });
        Ok(Difference { slope, bend })
    }

    /// Leaves out the rows next to jumps of the model's outputs and returns their number. If the estimate puts an event on the
    /// wrong side of a row, the cost jumps, and the row does not show how far the event is off.
    pub fn leave_out_jumps(&mut self, motion: &Motion) -> usize {
        let mut count = 0;
        for channel in &mut self.channels {
            let y = &motion[channel.recording][channel.output];
            channel.sampled = self.records[channel.recording].sampled(channel.output);
            let bends: Vec<f64> = y.windows(3).map(|y| (y[2] - 2.0 * y[1] + y[0]).abs()).collect();
            let usual = median(&bends).unwrap_or(0.0);
            let limit = (OUTPUT_JUMP.0 * channel.noise.white).max(OUTPUT_JUMP.1 * usual);
            for (k, _) in bends.iter().enumerate().filter(|(_, bend)| **bend > limit) {
                count += usize::from(channel.sampled[k + 1]);
                channel.sampled[k + 1] = false;
            }
        }
        count
    }

    /// Runs that a Jacobian needs.
    pub fn runs_of_jacobian(&self) -> usize {
        let one = |unknown: &Unknown| {
            let own = (0..self.records.len()).filter(|number| unknown.what.is_of(*number));
            2 * own.count()
        };
        self.unknowns.iter().filter(|unknown| unknown.what.is_in_runs()).map(one).sum()
    }

    /// Estimates the noise of each channel from the residual at x, of which `free` degrees of freedom are fitted.
    pub fn estimate_noise(&mut self, motion: &Motion, x: &[f64], free: usize, drift: bool) {
        let residuals = self.residuals(motion, x);
        let all: usize = self.channels.iter().map(Channel::count).sum();
        let lost = 1.0 - (free as f64 / all as f64).min(0.5);
        let of = |(channel, residual): (&Channel, &Vec<f64>)| {
            let record = &self.records[channel.recording];
            let squares: f64 = residual.iter().map(|r| r * r).sum();
            let least = 1e-9 * record.spread(channel.output);
            let rms = (squares / (lost * channel.count() as f64)).sqrt().max(least);
            if !drift {
                return Noise::white(rms);
            }
            // in units of its size, which may be any
            let unit: Vec<f64> = residual.iter().map(|r| r / rms).collect();
            let found = Noise::fit(&record.time, &unit, Some(&channel.sampled));
            Noise { white: found.white * rms / lost.sqrt(), ..found }
        };
        let noises: Vec<Noise> = self.channels.par_iter().zip(&residuals).map(of).collect();
        self.channels.iter_mut().zip(noises).for_each(|(channel, noise)| channel.noise = noise);
    }
}

impl Channel {
    /// Values of a signal in the rows with a value.
    pub fn picked(&self, values: &[f64]) -> Vec<f64> {
        let there = values.iter().zip(&self.sampled).filter(|(_, sampled)| **sampled);
        there.map(|(value, _)| *value).collect()
    }

    /// Rows with a value.
    pub fn count(&self) -> usize {
        self.sampled.iter().filter(|sampled| **sampled).count()
    }
}

/// Returns the change of a channel's reading per unit of a sensor's unknown, row by row; `None`: no change.
fn sensor<'m>(
    unknown: &Unknown,
    channel: &Channel,
    outputs: &'m [Vec<f64>],
) -> Option<Box<dyn Fn(usize) -> f64 + 'm>> {
    match unknown.what {
        What::Bias { output, recording }
            if (output, recording) == (channel.output, channel.recording) =>
        {
            Some(Box::new(|_| 1.0))
        }
        What::Gain { output, of } if output == channel.output => {
            let other = &outputs[of];
            Some(Box::new(move |k| other[k]))
        }
        _ => None,
    }
}

//! The sum of squares of a problem, and its derivatives.

use std::borrow::Cow;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use analysis::gauss_markov::{Noise, Whitening};
use analysis::innovations::Tests;
use anyhow::{Result, bail};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::problem::{Hold, Motion, Part, Problem, Role, Signal, Unknown};
use super::{BEND, MOVE, STEPS, WIDER};

/// A problem with the state of its search: the noise of its signals, and the intersample behaviour of its inputs.
pub struct Fit<'p> {
    pub problem: &'p Problem<'p>,
    pub noise: Vec<Noise>,
    pub hold: Hold,
    /// Factor of the noise in the sum of squares. A factor above 1 gives the priors more weight.
    pub inflation: f64,
    /// Fraction of each recording, from its beginning, that is fitted.
    pub part: f64,
    pub free: Vec<bool>,
    /// True for central differences, because one-sided differences are wrong if the outputs are strongly curved in an unknown.
    pub central: bool,
    pub ends: Vec<(f64, f64)>,
    /// The unknown whose profile is followed, if −2 ln L along it was found not to be a parabola.
    pub bent: Option<usize>,
    /// For each unknown, the step of its finite difference, and the smallest step whose effect on the outputs exceeds the
    /// errors of the solver.
    pub(super) steps: Vec<(f64, f64)>,
    filters: Vec<Whitening>,
    driven: AtomicUsize,
}

/// A simulation at the coordinates `z`: the outputs of each recording (`motion`), the vector `e` of the whitened residuals
/// followed by the normalised deviations from the priors, and `cost`, the sum of the squares of `e`.
#[derive(Clone, Debug)]
pub struct Point {
    pub z: Vec<f64>,
    pub motion: Vec<Motion>,
    pub e: DVector<f64>,
    pub cost: f64,
}

#[derive(Clone, Debug)]
pub struct Derivatives {
    /// Jacobian of `Point::e` with a column for each unknown. The column is 0 if the derivative by this
    /// unknown was not requested.
    pub matrix: DMatrix<f64>,
    /// Derivative of the mean of each signal (row of the matrix) by each unknown (column). The mean is over the rows in
    /// which the signal was measured.
    pub means: DMatrix<f64>,
}

impl<'p> Fit<'p> {
    /// Creates the fit of a problem, with the noise that is assumed before the first search.
    pub fn new(problem: &'p Problem<'p>) -> Self {
        let unknowns = &problem.unknowns;
        let mut fit = Fit {
            problem,
            noise: problem.signals.iter().map(Signal::first_noise).collect(),
            hold: problem.holds[0],
            inflation: 1.0,
            part: 1.0,
            free: unknowns.iter().map(|u| u.part == Part::Free).collect(),
            central: problem.rough,
            bent: None,
            ends: unknowns.iter().map(Unknown::ends).collect(),
            steps: unknowns.iter().map(|u| ((STEPS.0 * STEPS.1).sqrt() * u.reach, 0.0)).collect(),
            filters: Vec::new(),
            driven: AtomicUsize::new(0),
        };
        fit.renew_filters();
        fit
    }

    /// Returns the number of simulations so far. A simulation of a part of the rows counts as a fraction.
    pub fn simulations(&self) -> f64 {
        let rows: usize = self.problem.recordings.iter().map(|r| r.time.len()).sum();
        self.driven.load(Relaxed) as f64 / rows as f64
    }

    pub fn set(&mut self, noise: Vec<Noise>, part: f64) {
        (self.noise, self.part) = (noise, part);
        self.renew_filters();
    }

    fn renew_filters(&mut self) {
        let filter = |(signal, noise): (&Signal, &Noise)| {
            let rows = self.rows(signal.recording);
            let time = &self.problem.recordings[signal.recording].time[..rows];
            noise.whitening(time, Some(&signal.sampled[..rows]))
        };
        self.filters = self.problem.signals.iter().zip(&self.noise).map(filter).collect();
    }

    pub fn rows(&self, recording: usize) -> usize {
        let all = self.problem.recordings[recording].time.len();
        ((self.part * all as f64).ceil() as usize).clamp(2.min(all), all)
    }

    pub fn coordinates(&self, values: &[f64]) -> Vec<f64> {
        let all = self.problem.unknowns.iter().zip(values).zip(&self.ends);
        all.map(|((u, value), ends)| u.coordinate(*value).clamp(ends.0, ends.1)).collect()
    }

    pub fn values(&self, z: &[f64]) -> Vec<f64> {
        self.problem.unknowns.iter().zip(z).map(|(u, z)| u.value(*z)).collect()
    }

    fn run(&self, z: &[f64], recording: usize, whole: bool) -> Result<Motion> {
        let rows = self.rows(recording);
        self.driven.fetch_add(rows, Relaxed);
        self.problem.system.run(&self.values(z), recording, rows, self.hold, whole)
    }

    /// Simulates all recordings at the coordinates z.
    ///
    /// # Errors
    /// If the system refuses z.
    pub fn at(&self, z: &[f64]) -> Result<Point> {
        let runs = (0..self.problem.recordings.len()).into_par_iter();
        let motion = runs.map(|k| self.run(z, k, true)).collect::<Result<Vec<Motion>>>()?;
        Ok(self.point(z, motion))
    }

    pub fn point(&self, z: &[f64], motion: Vec<Motion>) -> Point {
        let residuals = self.residuals(z, &motion);
        let e = DVector::from_vec(self.stacked(residuals, z));
        let cost = e.norm_squared();
        let cost = if cost.is_finite() { cost } else { f64::INFINITY };
        Point { z: z.to_vec(), motion, e, cost }
    }

    /// Returns the measured minus the modelled values of each signal, and 0 in rows without a measured value.
    pub fn residuals(&self, z: &[f64], motion: &[Motion]) -> Vec<Vec<f64>> {
        let values = self.values(z);
        let of = |signal: &Signal| {
            let motion = &motion[signal.recording];
            let output = &motion.outputs[signal.output];
            let mut residual: Vec<f64> = output
                .iter()
                .zip(signal.measured.iter().zip(&signal.sampled))
                .map(|(model, (y, sampled))| if *sampled { y - model } else { 0.0 })
                .collect();
            for (unknown, value) in self.problem.unknowns.iter().zip(&values) {
                if *value == 0.0 {
                    continue;
                }
                let Some(shape) = reading(unknown, signal, motion) else { continue };
                let rows = residual.iter_mut().zip(shape.iter()).zip(&signal.sampled);
                rows.filter(|(_, s)| **s).for_each(|((r, shape), _)| *r -= value * shape);
            }
            residual
        };
        self.problem.signals.iter().map(of).collect()
    }

    /// Whitens the residuals of each signal, so that they have unit variance.
    pub fn innovations(&self, mut residuals: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        for (piece, filter) in residuals.iter_mut().zip(&self.filters) {
            filter.apply(piece);
            if self.inflation != 1.0 {
                piece.iter_mut().for_each(|e| *e /= self.inflation);
            }
        }
        residuals
    }

    fn stacked(&self, residuals: Vec<Vec<f64>>, z: &[f64]) -> Vec<f64> {
        let unknowns = &self.problem.unknowns;
        let mut all = self.innovations(residuals).concat();
        for (j, (unknown, own)) in unknowns.iter().zip(z).enumerate() {
            let Some((mean, std)) = unknown.prior else { continue };
            let wrong = unknowns.iter().zip(z).filter(|(other, _)| other.role == Role::Stated(j));
            all.push((own - mean - wrong.map(|(_, by)| by).sum::<f64>()) / std);
        }
        all
    }

    /// Returns the number of priors, whose deviations follow the residuals in `Point::e`.
    pub fn priors(&self) -> usize {
        self.problem.unknowns.iter().filter(|u| u.prior.is_some()).count()
    }

    /// Returns −2 ln L of a point up to a constant, where L is the likelihood with the current noise.
    pub fn deviance(&self, point: &Point) -> f64 {
        point.cost + self.filters.iter().map(Whitening::log_variance).sum::<f64>()
    }

    /// Returns the derivatives at a point by the unknowns `which`, and adapts the steps of the finite differences
    /// for the next call.
    ///
    /// # Errors
    /// If the system refuses every step of an unknown.
    pub fn derivatives(&mut self, at: &Point, which: &[bool]) -> Result<Derivatives> {
        let n = at.z.len();
        let columns: Vec<Option<Column>> = (0..n)
            .into_par_iter()
            .map(|j| which[j].then(|| self.column(at, j)).transpose())
            .collect::<Result<_>>()?;
        let rows = at.e.len();
        let mut found = Derivatives {
            matrix: DMatrix::zeros(rows, n),
            means: DMatrix::zeros(self.problem.signals.len(), n),
        };
        for (j, column) in columns.into_iter().enumerate() {
            let Some(Column { values, means, step }) = column else { continue };
            check_finite(&values, &self.problem.unknowns[j].name)?;
            found.matrix.column_mut(j).copy_from_slice(&values);
            found.means.column_mut(j).copy_from_slice(&means);
            self.steps[j] = step;
        }
        let mut row = rows - self.priors();
        for (j, unknown) in self.problem.unknowns.iter().enumerate() {
            if let Some((_, std)) = unknown.prior {
                found.matrix[(row, j)] = 1.0 / std;
                for (k, other) in self.problem.unknowns.iter().enumerate() {
                    if which[k] && other.role == Role::Stated(j) {
                        found.matrix[(row, k)] = -1.0 / std;
                    }
                }
                row += 1;
            }
        }
        Ok(found)
    }

    fn column(&self, at: &Point, j: usize) -> Result<Column> {
        let unknown = &self.problem.unknowns[j];
        let slope_of = |z: f64| if unknown.log { z.exp() } else { 1.0 };
        let whitened = |pieces: Vec<Vec<f64>>| {
            let mean = |(piece, signal): (&Vec<f64>, &Signal)| {
                let count = signal.sampled[..piece.len()].iter().filter(|s| **s).count();
                -piece.iter().sum::<f64>() / count.max(1) as f64
            };
            let means = pieces.iter().zip(&self.problem.signals).map(mean).collect();
            let mut values = self.innovations(pieces).concat();
            values.resize(at.e.len(), 0.0);
            (values, means)
        };
        let is_late = match unknown.role {
            Role::Delay(output) => at.motion.iter().all(|m| m.slopes.len() > output),
            _ => false,
        };
        if !matches!(unknown.role, Role::Run(_) | Role::Delay(_)) || is_late {
            let of = |signal: &Signal| -> Vec<f64> {
                let motion = &at.motion[signal.recording];
                let rows = motion.outputs[signal.output].len();
                match (unknown.role, reading(unknown, signal, motion)) {
                    (Role::Delay(output), _) if output == signal.output => {
                        let scale = self.scale(&at.z, output);
                        motion.slopes[output].iter().map(|slope| scale * slope).collect()
                    }
                    (_, Some(shape)) => shape.iter().map(|s| -s * slope_of(at.z[j])).collect(),
                    _ => vec![0.0; rows],
                }
            };
            let pieces = self.problem.signals.iter().map(|s| masked(of(s), s)).collect();
            let (values, means) = whitened(pieces);
            return Ok(Column { values, means, step: self.steps[j] });
        }
        let reach = unknown.reach;
        let (mut step, mut least) = self.steps[j];
        loop {
            let is_first = step == self.steps[j].0;
            let (mut pieces, mut bend) = self.difference(at, j, step)?;
            // a wider step reduces the influence of the solver's errors, and increases the influence of curvature
            let mut wider = step * WIDER;
            while self.problem.rough && bend > BEND && wider <= STEPS.1 * reach {
                match self.difference(at, j, wider) {
                    Ok((other, less)) if less < 0.7 * bend => {
                        (pieces, bend, least) = (other, less, wider);
                    }
                    Ok(_) => {}
                    Err(_) => break,
                }
                wider *= WIDER;
            }
            let (values, means) = whitened(pieces);
            let norm = values.iter().map(|v| v * v).sum::<f64>().sqrt() * self.inflation;
            let next = (MOVE / norm.max(1e-300)).clamp(STEPS.0 * reach, STEPS.1 * reach).max(least);
            // repeated with a better step if the effect of this step was far too large or too small
            if !is_first || (0.05..20.0).contains(&(next / step)) || !norm.is_finite() {
                return Ok(Column { values, means, step: (next, least) });
            }
            step = next;
        }
    }

    /// Returns the derivative of each residual by coordinate `j` from a one-sided difference, or from a central one if `central`
    /// is true. Also returns the norm of the second difference divided by the norm of the first. This ratio is near √3 if the
    /// solver's errors dominate the difference, and small if neither these errors nor curvature matter.
    fn difference(&self, at: &Point, j: usize, step: f64) -> Result<(Vec<Vec<f64>>, f64)> {
        let (by, there) = self.moved(at, j, step)?;
        let other = self.central.then(|| self.moved(at, j, -by)).transpose().ok().flatten();
        let other = other.filter(|(from, _)| *from == -by);
        let is_central = other.is_some();
        let here = || self.residuals(&at.z, &at.motion);
        let (from, base) = other.unwrap_or_else(|| (0.0, here()));
        let bend = if self.problem.rough {
            let middle = if is_central { here() } else { self.moved(at, j, 0.5 * by)?.1 };
            let norm = |weights: [f64; 3]| {
                self.weighted(weights.into_iter().zip([&there, &middle, &base])).norm()
            };
            norm([-1.0, 2.0, -1.0]) / norm([1.0, 0.0, -1.0]).max(1e-300)
        } else {
            0.0
        };
        let width = by - from;
        let slope = |(a, b): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| (a - b) / width).collect()
        };
        Ok((there.iter().zip(&base).map(slope).collect(), bend))
    }

    /// Returns the residuals after coordinate `j` was changed by a step, and this step. If the bounds or the system refuse the
    /// step, it is taken in the opposite direction.
    fn moved(&self, at: &Point, j: usize, step: f64) -> Result<(f64, Vec<Vec<f64>>)> {
        let is_inside = |by: f64| (self.ends[j].0..=self.ends[j].1).contains(&(at.z[j] + by));
        let to = |by: f64| -> Result<(f64, Vec<Vec<f64>>)> {
            let (z, motion) = self.motion_with(at, j, at.z[j] + by)?;
            Ok((by, self.residuals(&z, &motion)))
        };
        let (first, second) = if is_inside(step) { (step, -step) } else { (-step, step) };
        to(first).or_else(|error| if is_inside(second) { to(second) } else { Err(error) })
    }

    /// Returns coordinates and motion of a point, with coordinate `j` set to `value`.
    ///
    /// # Errors
    /// If the system refuses the value.
    pub fn motion_with(&self, at: &Point, j: usize, value: f64) -> Result<(Vec<f64>, Vec<Motion>)> {
        let mut z = at.z.clone();
        z[j] = value;
        let runs = (0..self.problem.recordings.len()).into_par_iter();
        let one = |k: usize| match self.problem.unknowns[j].is_of(k) {
            true => self.run(&z, k, false),
            false => Ok(at.motion[k].clone()),
        };
        let motion = runs.map(one).collect::<Result<Vec<Motion>>>()?;
        Ok((z, motion))
    }

    /// Returns a weighted sum of simulations at the coordinates z as whitened residuals. The weights have to add up to 0, so that
    /// the measured values cancel.
    pub fn change(&self, z: &[f64], motions: &[(f64, &[Motion])]) -> DVector<f64> {
        let residuals: Vec<_> =
            motions.iter().map(|(_, motion)| self.residuals(z, motion)).collect();
        self.weighted(motions.iter().map(|(weight, _)| *weight).zip(&residuals))
    }

    /// Whitens a weighted sum of residuals. Elements that belong to priors are 0.
    fn weighted<'r>(&self, all: impl Iterator<Item = (f64, &'r Vec<Vec<f64>>)>) -> DVector<f64> {
        let mut sum: Vec<Vec<f64>> = Vec::new();
        for (weight, residuals) in all {
            sum.resize_with(residuals.len(), Vec::new);
            for (sum, residual) in sum.iter_mut().zip(residuals) {
                sum.resize(residual.len(), 0.0);
                sum.iter_mut().zip(residual).for_each(|(sum, r)| *sum += weight * r);
            }
        }
        let mut whitened = self.innovations(sum).concat();
        whitened.resize(whitened.len() + self.priors(), 0.0);
        DVector::from_vec(whitened)
    }

    /// Returns the factor from an output to its measured value: 1 plus the scale error of the sensor.
    fn scale(&self, z: &[f64], output: usize) -> f64 {
        let own =
            |(u, z): (&Unknown, &f64)| (u.role == Role::Gain(output, output)).then(|| u.value(*z));
        1.0 + self.problem.unknowns.iter().zip(z).filter_map(own).sum::<f64>()
    }

    pub fn tests(&self, point: &Point) -> Vec<Tests> {
        let innovations = self.innovations(self.residuals(&point.z, &point.motion));
        self.tests_of(&innovations)
    }

    pub fn tests_of(&self, innovations: &[Vec<f64>]) -> Vec<Tests> {
        let all = self.problem.signals.iter().zip(innovations).zip(&self.noise);
        let one = |((signal, e), noise): ((&Signal, &Vec<f64>), &Noise)| {
            let recording = &self.problem.recordings[signal.recording];
            let inputs: Vec<Vec<f64>> =
                recording.inputs.iter().map(|input| signal.picked(input)).collect();
            let inputs: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
            Tests::run(&signal.picked(&recording.time), &inputs, &signal.picked(e), noise.white)
        };
        all.map(one).collect()
    }

    pub fn renew_noise(&mut self, point: &Point) {
        let residuals = self.residuals(&point.z, &point.motion);
        let of = |(signal, residual): (&Signal, &Vec<f64>)| {
            let rows = residual.len();
            let time = &self.problem.recordings[signal.recording].time[..rows];
            signal.noise_of(time, residual)
        };
        let noise = self.problem.signals.par_iter().zip(&residuals).map(of).collect();
        self.set(noise, self.part);
    }
}

struct Column {
    values: Vec<f64>,
    means: Vec<f64>,
    step: (f64, f64),
}

/// Refuses `values`, the derivatives of the outputs by the unknown `name`, if one of them is NaN or infinite.
pub fn check_finite(values: &[f64], name: &str) -> Result<()> {
    if values.iter().map(|v| v * v).sum::<f64>().is_finite() {
        return Ok(());
    }
    match values.iter().position(|v| !v.is_finite()) {
        Some(row) => bail!(
            "the derivative by {name} is {} in row {} of the residuals: the outputs or the noise are out of range there",
            values[row],
            row + 1
        ),
        None => bail!("the derivatives of the residuals with respect to {name} are too large"),
    }
}

fn masked(mut piece: Vec<f64>, signal: &Signal) -> Vec<f64> {
    piece.iter_mut().zip(&signal.sampled).for_each(|(v, s)| *v *= f64::from(*s));
    piece
}

/// Returns the change of a signal per unit of an unknown of its sensor, in each row; `None` if the unknown does not affect the
/// signal.
fn reading<'m>(unknown: &Unknown, signal: &Signal, motion: &'m Motion) -> Option<Cow<'m, [f64]>> {
    match unknown.role {
        Role::Bias(output, _) if output == signal.output && unknown.is_of(signal.recording) => {
            Some(vec![1.0; motion.outputs[output].len()].into())
        }
        Role::Gain(output, of) if output == signal.output => Some((&motion.outputs[of]).into()),
        _ => None,
    }
}

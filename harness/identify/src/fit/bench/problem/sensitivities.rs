//! Derivatives of the bench's residuals.
//!
//! Sensitivities to s, b and δ are exact: −ω, −1 and s ω'. Those to the FMU's parameters are
//! differences. The step moves the whole answer by [`BENCH_MOVE`] standard deviations of its noise:
//! small against curvature and large against the integrator's tolerance
//! (`sensitivities_equal_those_of_smaller_and_larger_steps` in tests/twin.rs).
//!
//! Along a valley large sensitivities cancel: c and d of the friction are 0.9999 correlated, and differences that are right to 1
//! % say nothing about c − d. So differences are taken along the directions L = V S⁻¹ of earlier sensitivities J = U S Vᵀ. These
//! directions move the answer by one standard deviation each, at right angles to one another. With D the differences along them,
//! J = D L⁻¹ is as accurate along the valley as across it.

use std::borrow::Cow;

use anyhow::{Context, Result};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::Channel;
use super::{Differences, Problem, Signal, angle_at, fastest, rate_at};
use crate::fit::covariance::{self, Covariance};
use crate::model::bench::simulate::{Motion, Read};
use crate::model::bench::unknown::Quantity;
use crate::tuning::{BENCH_FIRST_STEP, BENCH_MOVE, BENCH_STEPS, LONGEST_STEP};

impl Problem<'_> {
    /// The covariance of estimates at x, where the recordings are what the FMU does: the Cramér–Rao bound; and the
    /// sensitivities.
    pub fn information(&self, x: &[f64]) -> Result<(Covariance, DMatrix<f64>)> {
        let motion = self.motions(x, Read::All)?;
        let all: Vec<usize> = (0..x.len()).collect();
        let jacobian = self.sensitivities(x, &all, &motion, None)?;
        Ok((self.covariance(&jacobian)?, jacobian))
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
}

/// The columns of a matrix at these places of `n` columns, with zeros for the others.
pub(super) fn at_places(columns: &DMatrix<f64>, places: &[usize], n: usize) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(columns.nrows(), n);
    places.iter().enumerate().for_each(|(k, &j)| all.set_column(j, &columns.column(k)));
    all
}

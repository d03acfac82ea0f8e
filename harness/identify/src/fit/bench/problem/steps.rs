//! Steps of the bench's fit near a minimum, along its valleys.
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

use anyhow::Result;
use nalgebra::{DMatrix, DVector};
use names::hubslosh::init;

use super::sensitivities::at_places;
use super::{Answer, Problem, fastest};
use crate::fit::covariance::Covariance;
use crate::model::bench::stribeck;
use crate::model::bench::tank;
use crate::model::bench::unknown::{Quantity, Scale, Unknown};
use crate::tuning::{BENCH_DECREMENT, MINIMUM, ROUNDS, SHARPEST_BEND};

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

impl Problem<'_> {
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
}

#[cfg(test)]
mod tests {
    use super::*;

    /// To second order the sum of squares falls by the decrement's square; by how much that may be too little is for whoever asks.
    #[test]
    fn a_search_is_hopeless_only_where_its_foresight_is_trusted() {
        let until = Until { trust: 1.0, ..Until::at_most(100.0) };
        assert!(until.is_hopeless(103.0, 0.9));
        assert!(!until.is_hopeless(101.0, 0.9));
        assert!(!until.is_hopeless(103.0, 1.1));
        assert!(Until::at_most(100.0).is_hopeless(103.0, 1.1));
    }
}

//! What the torque does between rows: which behaviour explains the recordings best.
//!
//! A torque that is held from row to row comes half a row late, on average: held without a delay and linear with one of half a row
//! differ by little. So behaviour and delay are judged together, and with all other unknowns free; and no behaviour is taken that
//! needs an effect before its cause.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::evidence::{ALIKE, DECIDES, probabilities};
use crate::fit::{Channel, MINIMUM, Polished, Problem, ROUNDS, Until, is_other};
use crate::recording::Recording;
use crate::simulate::Intersample;
use crate::uncertainty::Covariance;
use crate::unknown::Quantity;

/// Standard deviations by which a delay below zero is more than chance.
const ACAUSAL: f64 = 3.0;

/// Part of a row by which time stamps of two channels may be apart without anybody's minding.
const SYNCHRONOUS: f64 = 0.02;

/// Part of a row by which a delay may differ from half a row and still be taken for one.
const NEAR_HALF: f64 = 0.1;

/// Another behaviour than the one that was fitted.
#[derive(Clone)]
pub struct Alternative {
    /// The behaviour.
    pub behaviour: Intersample,
    /// The minimum with it, all unknowns free.
    pub minimum: Polished,
    /// Sum of squares there, less what steps would still win by their second order.
    pub cost: f64,
    /// The delay with it, s, and its standard deviation; `None` if it is not estimated.
    pub delay: Option<(f64, f64)>,
}

/// The other behaviours, and the minimum that they were sought from.
#[derive(Clone)]
pub struct Others {
    /// The variables there.
    from: Vec<f64>,
    /// With what noise.
    channels: Vec<Channel>,
    /// Each with its own minimum.
    pub all: Vec<Alternative>,
}

impl Others {
    /// The one with a behaviour, where the noise is the same and a minimum less than a standard deviation from the one that it was sought from.
    fn near(
        &self,
        behaviour: Intersample,
        channels: &[Channel],
        minimum: &Polished,
    ) -> Option<&Alternative> {
        let n = self.from.len();
        let off = minimum.x.iter().zip(&self.from).map(|(now, then)| now - then);
        let off = DVector::from_iterator(n, off);
        let is_near = (minimum.jacobian.columns(0, n) * off).norm_squared() < 1.0;
        let is_same = is_near && !is_other(&self.channels, channels);
        self.all.iter().find(|other| is_same && other.behaviour == behaviour)
    }
}

impl Alternative {
    /// Variables and sensitivities of its minimum; what was not unknown there is as at `now`.
    fn with_unknowns_of(&self, now: &Polished) -> (Vec<f64>, DMatrix<f64>) {
        let (known, (rows, n)) = (self.minimum.x.len(), now.jacobian.shape());
        let x = self.minimum.x.iter().chain(&now.x[known..]).copied().collect();
        let mut jacobian = self.minimum.jacobian.clone().resize(rows, n, 0.0);
        let new = now.jacobian.columns(known, n - known);
        jacobian.columns_mut(known, n - known).copy_from(&new);
        (x, jacobian)
    }

    /// Returns true if the rate would come before the torque.
    pub fn is_acausal(&self, step: f64) -> bool {
        self.delay.is_some_and(|delay| is_acausal(delay, step))
    }
}

/// Returns true if a delay (s, with its standard deviation) is below zero by more than chance and time stamps explain, with rows every
/// `step` seconds.
pub fn is_acausal((delay, std): (f64, f64), step: f64) -> bool {
    delay < -(ACAUSAL * std).max(SYNCHRONOUS * step)
}

/// The delay at `x` and its standard deviation, s; `None` if it is not estimated.
pub fn delay(problem: &Problem, x: &[f64], covariance: &Covariance) -> Option<(f64, f64)> {
    let index = problem.unknowns.iter().position(|u| u.quantity == Quantity::Delay)?;
    let scale = problem.unknowns[index].scale;
    let std = covariance.x[(index, index)].sqrt() * scale.slope(x[index]).abs();
    Some((scale.value(x[index]), std))
}

/// Returns true if the behaviour matters: the torque changes a lot from one row to the next.
pub fn matters(recordings: &[Recording]) -> bool {
    let square = |x: f64| x * x;
    let varies = |recording: &Recording| {
        let changes: f64 = recording.torque.windows(2).map(|t| square(t[1] - t[0])).sum();
        changes > 1e-4 * recording.torque.iter().map(|t| square(*t)).sum::<f64>()
    };
    recordings.iter().any(varies)
}

/// Sum of squares over the first behaviour's beyond which another one is no rival, wherever its minimum is.
const NO_RIVAL: f64 = 1.5;

/// The same beyond which another one is given up, if a step has been taken.
const LOST: f64 = 10.0;

/// Newton decrement below which the sum of squares of the minimum is foreseen well enough to say that it does not count.
const FORESEEN: f64 = 1.0;

/// The other behaviours, each with its own minimum, which is sought from this one: a torque that is held is late by half a row. The
/// sensitivities are nearly the same, so each costs a few simulations; where they lead near the minimum but not to it (the wrong behaviour may have
/// moved what a recording hardly shows far along its valley) it has its own, for a sum of squares on the way is no evidence, unless it is
/// less than a standard deviation from a minimum that decides against it. Where they were sought
/// `before`, of nearly the same noise and from nearly the same minimum, they are sought on from where they were found, and one that was far is still far.
pub fn alternatives(problem: &Problem, minimum: &Polished, before: Option<&Others>) -> Others {
    let now = problem.setup.intersample;
    let delayed = problem.unknowns.iter().position(|u| u.quantity == Quantity::Delay);
    let late = |b: Intersample| if b == Intersample::ZeroOrderHold { 0.5 } else { 0.0 };
    let most = NO_RIVAL * minimum.cost;
    let until = Until {
        decrement: MINIMUM,
        rounds: 2,
        trust: FORESEEN,
        far: LOST * minimum.cost,
        ..Until::at_most(minimum.cost + DECIDES)
    };
    let one = |behaviour: Intersample| {
        let mut problem = problem.clone();
        problem.setup.intersample = behaviour;
        let known = before.and_then(|b| b.near(behaviour, &problem.channels, minimum));
        let is_far =
            |other: &&Alternative| !other.minimum.converged() && other.minimum.cost >= most;
        if let Some(far) = known.filter(is_far) {
            return Some(far.clone());
        }
        let (x, jacobian) = if let Some(other) = known {
            other.with_unknowns_of(minimum)
        } else {
            let mut x = minimum.x.clone();
            if let Some(index) = delayed {
                let scale = problem.unknowns[index].scale;
                let rows = late(now) - late(behaviour);
                let delay = scale.value(x[index]) + rows * problem.recordings[0].step();
                x[index] = scale.variable(delay);
            }
            (x, minimum.jacobian.clone())
        };
        let mut minimum = problem.polish_near(&x, &jacobian, until).ok()?;
        let is_out = until.is_hopeless(minimum.cost, minimum.decrement);
        if !minimum.converged() && !is_out && minimum.cost < most {
            minimum = problem.polish_on(&minimum, ROUNDS).ok()?;
        }
        let delay = delay(&problem, &minimum.x, &minimum.covariance);
        let left = if minimum.decrement < FORESEEN { minimum.decrement.powi(2) } else { 0.0 };
        let cost = minimum.cost - left;
        Some(Alternative { behaviour, minimum, cost, delay })
    };
    let others: Vec<Intersample> = Intersample::ALL.into_iter().filter(|b| *b != now).collect();
    let all = others.into_par_iter().filter_map(one).collect();
    Others { from: minimum.x.clone(), channels: problem.channels.clone(), all }
}

/// Returns the behaviour that fits best; `None` if no other allowed one is clearly better.
pub fn better(cost: f64, step: f64, acausal: bool, others: &[Alternative]) -> Option<&Alternative> {
    others
        .iter()
        .filter(|other| acausal || !other.is_acausal(step))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .filter(|best| best.cost < cost - ALIKE)
}

/// What the covariance of the unknowns x gains because the torque may be another one between rows: Σ p_k δ_k δ_kᵀ, with p_k the
/// probability of behaviour k, all equally probable beforehand, and δ_k how far its minimum is from this one's. `None`: this one is sure.
pub fn gained(
    found: &Polished,
    step: f64,
    acausal: bool,
    others: &[Alternative],
) -> Option<DMatrix<f64>> {
    let near: Vec<&Alternative> = near(found.cost, step, acausal, others).collect();
    let costs = near.iter().map(|other| other.cost);
    let probabilities = probabilities(std::iter::once(found.cost).chain(costs));
    let mut gained = None;
    for (other, probability) in near.iter().zip(&probabilities[1..]) {
        let off =
            DVector::from_column_slice(&other.minimum.x) - DVector::from_column_slice(&found.x);
        let one = &off * off.transpose() * *probability;
        gained = Some(gained.map_or_else(|| one.clone(), |sum: DMatrix<f64>| sum + &one));
    }
    gained
}

/// The behaviours that cannot be told from the one that was fitted.
fn near(
    cost: f64,
    step: f64,
    acausal: bool,
    others: &[Alternative],
) -> impl Iterator<Item = &Alternative> {
    others
        .iter()
        .filter(move |other| (acausal || !other.is_acausal(step)) && other.cost < cost + DECIDES)
}

/// What the choice rests on, in words: the behaviour that was fitted with its sum of squares, and the others. Rows come every
/// `step` seconds.
pub fn evidence(
    problem: &Problem,
    found: &Polished,
    step: f64,
    acausal: bool,
    others: &[Alternative],
) -> String {
    let now = problem.setup.intersample;
    let allowed = others.iter().filter(|other| acausal || !other.is_acausal(step));
    let cost = allowed.map(|other| other.cost).fold(found.cost, f64::min);
    let late = |delay: Option<(f64, f64)>| {
        delay.map_or(String::new(), |(delay, _)| format!(" with a delay of {:.2} ms", 1e3 * delay))
    };
    let alike: Vec<&Alternative> = near(cost, step, acausal, others).collect();
    let is_near = found.cost < cost + DECIDES;
    let cost = found.cost;
    if is_near && !alike.is_empty() {
        let costs = std::iter::once(cost).chain(alike.iter().map(|other| other.cost));
        let first = (now, delay(problem, &found.x, &found.covariance));
        let all = std::iter::once(first).chain(alike.iter().map(|o| (o.behaviour, o.delay)));
        let each: Vec<String> = all
            .zip(probabilities(costs))
            .map(|((behaviour, delay), p)| {
                format!("{}{} (probability {p:.2})", behaviour.words(), late(delay))
            })
            .collect();
        return format!(
            "Cannot tell what the torque does between rows: {}. The values are those of the first; their standard deviations hold \
             that it may be another. --torque sets it.",
            each.join(", ")
        );
    }
    let each: Vec<String> = others
        .iter()
        .map(|other| {
            let more = other.cost - cost;
            let behaviour = other.behaviour.words();
            match other.delay.filter(|_| !acausal && other.is_acausal(step)) {
                Some((delay, _)) => {
                    format!("{behaviour} would need a delay of {:.2} ms", 1e3 * delay)
                }
                None if other.minimum.decrement >= FORESEEN => {
                    format!("{behaviour} was given up with a sum of squares {more:.0} larger")
                }
                None => format!(
                    "{behaviour}{} changes the sum of squares by {more:+.0}",
                    late(other.delay)
                ),
            }
        })
        .collect();
    format!(
        "The torque is taken as {}: with all else free, {}. --torque sets it.",
        now.words(),
        each.join(", ")
    )
}

/// Returns true if a torque that is half a row late would be found: no other behaviour explains the recordings as well with a delay
/// (`delay` is the fitted one, s) that differs by more than a quarter of a row.
pub fn is_found(
    (cost, delay): (f64, f64),
    step: f64,
    acausal: bool,
    others: &[Alternative],
) -> bool {
    let differs = |other: &Alternative| {
        other.delay.is_none_or(|(other, _)| (other - delay).abs() > 0.25 * step)
    };
    !near(cost, step, acausal, others).any(differs) && others.len() + 1 == Intersample::ALL.len()
}

/// A delay (s, with its standard deviation) that looks like another behaviour of a torque with rows every `step` seconds, in
/// words. It is a finding only where the behaviour was not found ([`is_found`]).
pub fn half_a_row(delay: (f64, f64), step: f64) -> Option<String> {
    let rows = delay.0.abs() / step;
    let known = delay.1 < NEAR_HALF * step;
    (known && (rows - 0.5).abs() < NEAR_HALF).then(|| {
        format!(
            "The delay, {:.2} ms, is half a row ({:.2} ms): the torque may be held from row to row where it is taken as linear, or \
             the other way round. Say which it is (--torque), or how late the rate is.",
            1e3 * delay.0,
            0.5e3 * step
        )
    })
}

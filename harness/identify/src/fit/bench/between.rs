//! Chooses the intersample behaviour of the torque that explains the recordings best.
//!
//! A held torque comes half a row late on average, so "held without a delay" and "linear with a delay of half a row" differ
//! little. So behaviour and delay are judged together, and with all other unknowns free; and no behaviour is taken that needs an
//! effect before its cause.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::bench::problem::{Channel, Polished, Problem, Until, is_other};
use crate::fit::covariance::Covariance;
use crate::fit::evidence::probabilities;
use crate::input::recording::Recording;
use crate::model::bench::simulate::Intersample;
use crate::model::bench::unknown::Quantity;
use crate::tuning::{
    ACAUSAL, BIC_ALIKE, BIC_DECIDES, FORESEEN, HALF_ROW, LOST_RIVAL, MINIMUM, NO_RIVAL, ROUNDS,
    SYNCHRONOUS,
};

/// Another behaviour than the one that was fitted.
#[derive(Clone)]
pub struct Alternative {
    /// The behaviour.
    pub behaviour: Intersample,
    /// The minimum with this behaviour, all unknowns free.
    pub minimum: Polished,
    /// Sum of squares there, less what steps would still win by their second order.
    pub cost: f64,
    /// The delay with this behaviour, s, and its standard deviation; `None` if the delay is not estimated.
    pub delay: Option<(f64, f64)>,
}

/// The other intersample behaviours, and the minimum at which their searches began.
#[derive(Clone)]
pub struct Others {
    /// Variables x at that minimum.
    from: Vec<f64>,
    /// Channels, with the noise levels of that minimum.
    channels: Vec<Channel>,
    /// The other behaviours, each with its own minimum.
    pub all: Vec<Alternative>,
}

impl Others {
    /// Returns the result for a behaviour if the noise is the same and the new minimum is less than a standard deviation from the
    /// one at which the search began.
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

/// The other behaviours, each with its own minimum, which is sought from this one: a torque that is held is late by half a row.
/// The sensitivities are nearly the same, so each behaviour costs a few simulations. If they lead near its minimum but not to it,
/// the behaviour gets sensitivities of its own: a wrong behaviour may have moved a poorly determined unknown far along its
/// valley, and a sum of squares on the way proves nothing. The exception is a point less than a standard deviation from a minimum
/// that already decides against the behaviour. If they were sought `before` with nearly the same noise and from nearly the same
/// minimum, the search continues from the earlier results, and a behaviour that was far off stays rejected.
pub fn alternatives(problem: &Problem, minimum: &Polished, before: Option<&Others>) -> Others {
    let now = problem.setup.intersample;
    let delayed = problem.unknowns.iter().position(|u| u.quantity == Quantity::Delay);
    let late = |b: Intersample| if b == Intersample::ZeroOrderHold { 0.5 } else { 0.0 };
    let most = NO_RIVAL * minimum.cost;
    let until = Until {
        decrement: MINIMUM,
        rounds: 2,
        trust: FORESEEN,
        far: LOST_RIVAL * minimum.cost,
        ..Until::at_most(minimum.cost + BIC_DECIDES)
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
                let delay = scale.value(x[index]) + rows * problem.recordings[0].torque_step();
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
        .filter(|best| best.cost < cost - BIC_ALIKE)
}

/// Returns the covariance that the unknown intersample behaviour adds to the unknowns x: Σ p_k δ_k δ_kᵀ. p_k is the probability
/// of behaviour k (equal priors), δ_k the distance of its minimum from this one. `None`: this one is sure.
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

/// Returns the behaviours that the recordings cannot distinguish from the fitted one.
fn near(
    cost: f64,
    step: f64,
    acausal: bool,
    others: &[Alternative],
) -> impl Iterator<Item = &Alternative> {
    others.iter().filter(move |other| {
        (acausal || !other.is_acausal(step)) && other.cost < cost + BIC_DECIDES
    })
}

/// Returns the evidence in words: the sums of squares of the fitted behaviour and of the others. Rows come every `step` seconds.
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
    let is_near = found.cost < cost + BIC_DECIDES;
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
            "Cannot tell what the torque does between rows: {}. The values are those of the first; their standard deviations \
             include the others. --torque sets it.",
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

/// Returns true if the fit would notice a torque that is half a row late: no other behaviour explains the recordings equally well
/// with a delay that differs from the fitted `delay` (s) by more than a quarter of a row.
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
    let known = delay.1 < HALF_ROW * step;
    (known && (rows - 0.5).abs() < HALF_ROW).then(|| {
        format!(
            "The delay, {:.2} ms, is half a row ({:.2} ms): the torque may be held from row to row where it is taken as linear, or \
             the other way round. Say which it is (--torque), or how late the rate is.",
            1e3 * delay.0,
            0.5e3 * step
        )
    })
}

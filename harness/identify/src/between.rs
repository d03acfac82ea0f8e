//! What the torque does between rows: which behaviour explains the recordings best.
//!
//! A torque that is held from row to row comes half a row late, on average: held without a delay and linear with one of half a row
//! differ by little. So behaviour and delay are judged together, and with all other unknowns free; and no behaviour is taken that
//! needs an effect before its cause.

use nalgebra::{DMatrix, DVector};

use crate::fit::Problem;
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
pub struct Alternative {
    /// Which.
    pub behaviour: Intersample,
    /// Sum of squares with all unknowns free, to first order.
    pub cost: f64,
    /// The delay with it, s, and its standard deviation; `None` if it is not estimated.
    pub delay: Option<(f64, f64)>,
}

impl Alternative {
    /// Whether the rate would come before the torque.
    pub fn is_acausal(&self, step: f64) -> bool {
        self.delay.is_some_and(|delay| is_acausal(delay, step))
    }
}

/// Whether a delay (s, with its standard deviation) is below zero by more than chance and time stamps explain, with rows every
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

/// Whether it matters: where the torque changes a lot from one row to the next.
pub fn matters(recordings: &[Recording]) -> bool {
    let square = |x: f64| x * x;
    let varies = |recording: &Recording| {
        let changes: f64 = recording.torque.windows(2).map(|t| square(t[1] - t[0])).sum();
        changes > 1e-4 * recording.torque.iter().map(|t| square(*t)).sum::<f64>()
    };
    recordings.iter().any(varies)
}

/// The other behaviours at a minimum `x` with these sensitivities. Each costs one simulation.
pub fn alternatives(
    problem: &Problem,
    x: &[f64],
    jacobian: &DMatrix<f64>,
    covariance: &Covariance,
) -> Vec<Alternative> {
    let now = problem.setup.intersample;
    let delayed = problem.unknowns.iter().position(|u| u.quantity == Quantity::Delay);
    let late = |b: Intersample| if b == Intersample::ZeroOrderHold { 0.5 } else { 0.0 };
    let one = |behaviour: Intersample| {
        let mut problem = problem.clone();
        problem.setup.intersample = behaviour;
        // held torque is late by half a row
        let mut x = DVector::from_column_slice(x);
        if let Some(index) = delayed {
            let scale = problem.unknowns[index].scale;
            let rows = late(now) - late(behaviour);
            let delay = scale.value(x[index]) + rows * problem.recordings[0].step();
            x[index] = scale.variable(delay);
        }
        let answer = problem.answer(x.as_slice()).ok()?;
        let e = problem.stacked(&answer, x.as_slice());
        let gradient = jacobian.tr_mul(&e);
        let step = &covariance.x * &gradient;
        let cost = e.norm_squared() - gradient.dot(&step);
        let delay = delay(&problem, (&x - &step).as_slice(), covariance);
        Some(Alternative { behaviour, cost, delay })
    };
    Intersample::ALL.into_iter().filter(|b| *b != now).filter_map(one).collect()
}

/// What the choice rests on, in words: the behaviour that was fitted with its sum of squares `cost`, and the others. Rows come every
/// `step` seconds.
pub fn evidence((now, cost): (Intersample, f64), step: f64, others: &[Alternative]) -> String {
    let each: Vec<String> = others
        .iter()
        .map(|other| {
            let more = other.cost - cost;
            let behaviour = other.behaviour.words();
            match other.delay.filter(|_| other.is_acausal(step)) {
                Some((delay, _)) => {
                    format!("{behaviour} would need a delay of {:.2} ms", 1e3 * delay)
                }
                None => format!("{behaviour} changes the sum of squares by {more:+.0}"),
            }
        })
        .collect();
    format!(
        "The torque is taken as {}: with all else free, {}. --torque sets it.",
        now.words(),
        each.join(", ")
    )
}

/// A delay (s, with its standard deviation) that looks like another behaviour of a torque with rows every `step` seconds, in words.
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

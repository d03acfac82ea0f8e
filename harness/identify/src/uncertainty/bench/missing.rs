//! Finds a torque on the hub that the model lacks, by a score test (Lagrange multiplier; Rao 1948, Engle 1984) of torques that
//! depend on the model's motion.
//!
//! Under a small torque k φ(t) the innovations move by k s; s is a difference of two answers of the FMU. Of s, the unknowns
//! can take what lies in the span of their sensitivities J; the rest is seen:
//!
//! ```text
//! s' = s − J (JᵀJ)⁻¹ Jᵀ s,   k = −s'·e / |s'|²,   σ_k = 1/|s'|
//! ```
//!
//! k/σ_k is normal with unit variance if nothing is missing. A general test of the innovations spreads over hundreds of rows or
//! bands what this test gathers in one number: an estimate can be off by ten standard deviations without a sign in a general
//! test. Of all torques, the test takes the one that explains most, then the one that explains most of the remainder. Tolerances
//! count as unknowns with priors: a clock that is wrong by its tolerance leaves a trace in an encoder's angle that no other
//! unknown explains, and that is not a torque.

use anyhow::Result;
use nalgebra::DVector;
use rayon::prelude::*;
use serde::Serialize;

use crate::estimate::prose;
use crate::fit::bench::goodness::tests_of;
use crate::fit::bench::problem::{Differences, Polished, Problem};
use crate::input::recording::Recording;
use crate::model::bench::simulate::{Motion, TORQUE_BESIDES};
use crate::tuning::{MISSING_LIMIT, MISSING_STEP, QUIET_TORQUE, SEEN_SENSITIVITY};
use crate::uncertainty::bench::budget::Slope;
use analysis::innovations::Tests;

/// A row of the model's motion.
struct Row {
    /// Time from the recording's first row, s.
    time: f64,
    /// Commanded, N·m.
    torque: f64,
    /// Angle of the hub, rad.
    angle: f64,
    /// Rate of the hub, rad/s.
    rate: f64,
    /// Slosh angle, rad.
    slosh_angle: f64,
}

/// Possible torque on the hub: in words, the unit of k, and φ.
struct Kind {
    words: &'static str,
    unit: &'static str,
    of: fn(&Row) -> f64,
}

const KINDS: [Kind; 7] = [
    Kind { words: "the rate", unit: "N.m.s/rad", of: |row| row.rate },
    Kind {
        words: "the rate's square against the motion",
        unit: "N.m.s2/rad2",
        of: |row| row.rate * row.rate.abs(),
    },
    Kind { words: "the angle", unit: "N.m/rad", of: |row| row.angle },
    Kind { words: "the angle's square", unit: "N.m/rad2", of: |row| row.angle * row.angle },
    Kind { words: "the slosh angle", unit: "N.m/rad", of: |row| row.slosh_angle },
    Kind { words: "time", unit: "N.m/s", of: |row| row.time },
    Kind {
        words: "the commanded torque's square with its sign",
        unit: "1/(N.m)",
        of: |row| row.torque * row.torque.abs(),
    },
];

/// A torque k φ that the model lacks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Missing {
    /// Meaning of φ.
    pub follows: String,
    /// k.
    pub factor: f64,
    /// Standard deviation of k.
    pub std: f64,
    /// Unit of k.
    pub unit: String,
    /// k over its standard deviation, without its sign.
    pub deviations: f64,
}

impl Missing {
    /// Returns the result in words.
    pub fn words(&self) -> String {
        format!(
            "a torque that follows {} is missing, {:.2e} ± {:.1e} {} ({:.0} σ)",
            self.follows,
            self.factor,
            self.std,
            prose(&self.unit),
            self.deviations
        )
    }
}

/// Torques that a model lacks.
#[derive(Clone, Debug, Default)]
pub struct Torques {
    /// The torques, what explains most first.
    pub all: Vec<Missing>,
    /// True if noise alone is left with all of them.
    pub explain: bool,
}

impl Torques {
    /// Returns the decrease of −2 ln L by all of them.
    pub fn gain(&self) -> f64 {
        self.all.iter().map(|torque| torque.deviations.powi(2)).sum()
    }
}

/// Torques that the model lacks; none where the FMU has no input for them. `e` are the stacked innovations at the minimum `found`.
pub fn torques(
    problem: &Problem,
    found: &Polished,
    e: &DVector<f64>,
    tolerances: &[Slope],
) -> Result<Torques> {
    let Polished { x, answer, .. } = found;
    let base = &answer.motion;
    // a size to a thousandth is enough
    let problem = &Problem { differences: Differences::Forward, ..problem.clone() };
    if problem.fmu.description().variable(TORQUE_BESIDES).is_err() {
        return Ok(Torques::default());
    }
    let (rows, n) = found.jacobian.shape();
    let more = tolerances.len();
    let mut jacobian = found.jacobian.clone().resize(rows + more, n + more, 0.0);
    for (k, slope) in tolerances.iter().enumerate() {
        jacobian.view_mut((0, n + k), (rows, 1)).copy_from(&slope.change);
        jacobian[(rows + k, n + k)] = 1.0;
    }
    let covariance = problem.covariance(&jacobian)?;
    let extended = |v: &DVector<f64>| v.clone().resize_vertically(rows + more, 0.0);
    let rest = |v: DVector<f64>| &v - &jacobian * (&covariance.x * jacobian.tr_mul(&v));
    let mut left = rest(extended(e));
    let of_kind = |kind: &'static Kind| -> Result<Option<(&Kind, DVector<f64>)>> {
        let torque = course(problem, base, kind);
        let size = rms(torque.iter().flatten());
        if size == 0.0 {
            return Ok(None);
        }
        let command = rms(problem.recordings.iter().flat_map(|r| &r.torque));
        let step = MISSING_STEP * command.max(QUIET_TORQUE) / size;
        let s = problem.to_torque(x, base, &torque, step)?;
        let seen = rest(extended(&s));
        Ok((seen.norm() > SEEN_SENSITIVITY * s.norm()).then_some((kind, seen)))
    };
    let seen: Vec<_> = KINDS.par_iter().map(of_kind).collect::<Result<_>>()?;
    let mut seen: Vec<_> = seen.into_iter().flatten().collect();
    let mut missing = Vec::new();
    loop {
        let score = |s: &DVector<f64>| -s.dot(&left) / s.norm();
        let most = seen
            .iter()
            .enumerate()
            .map(|(i, (_, s))| (i, score(s)))
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let Some((i, deviations)) = most.filter(|(_, d)| d.abs() > MISSING_LIMIT) else {
            let mut rest = left.iter().copied();
            let innovations: Vec<Vec<f64>> = problem
                .innovations(answer)
                .iter()
                .map(|channel| rest.by_ref().take(channel.len()).collect())
                .collect();
            let explain = tests_of(problem, &innovations).iter().all(Tests::passed);
            return Ok(Torques { all: missing, explain });
        };
        let (kind, s) = seen.swap_remove(i);
        let norm = s.norm();
        missing.push(Missing {
            follows: kind.words.into(),
            factor: deviations / norm,
            std: 1.0 / norm,
            unit: kind.unit.into(),
            deviations: deviations.abs(),
        });
        let direction = s / norm;
        let without = |v: &DVector<f64>| v - &direction * direction.dot(v);
        left = without(&left);
        seen = seen
            .into_iter()
            .map(|(kind, s)| (kind, without(&s), s.norm()))
            .filter(|(_, s, before)| s.norm() > SEEN_SENSITIVITY * before)
            .map(|(kind, s, _)| (kind, s))
            .collect();
    }
}

/// φ along each recording.
fn course(problem: &Problem, base: &[Motion], kind: &Kind) -> Vec<Vec<f64>> {
    let of = |(motion, recording): (&Motion, &Recording)| {
        let row = |k: usize| Row {
            time: recording.time[k] - recording.time[0],
            torque: recording.torque[k],
            angle: motion.angle[k],
            rate: motion.rate[k],
            slosh_angle: motion.slosh_angle[k],
        };
        (0..motion.rate.len()).map(|k| (kind.of)(&row(k))).collect()
    };
    base.iter().zip(problem.recordings).map(of).collect()
}

fn rms<'v>(values: impl Iterator<Item = &'v f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}

//! Predicts the accuracy of a planned recording: the Cramér–Rao bound of each unknown from its sensitivities
//! along the planned inputs.

use anyhow::{Result, ensure};
use serde::Serialize;

use super::finite;
use super::system::FmuSystem;
use crate::engine::{Fit, PRIOR_ALONE};
use crate::input::question::Question;
use crate::input::record::Record;
use crate::model::simulate::Model;
use analysis::gauss_markov::Noise;

#[derive(Clone, Debug, Serialize)]
pub struct Bound {
    pub name: String,
    pub value: f64,
    /// Smallest standard deviation of an unbiased estimate; NaN if the recordings allow no estimate or if the bound depends
    /// on the solver's errors.
    pub std: f64,
    /// True if the estimate would hardly be more accurate than the prior or, without a prior, if its standard deviation
    /// exceeds its own value.
    pub not_determined: bool,
    /// True if the bound depends on the solver's errors; `std` and `std_alone` are then NaN.
    pub decided_by_solver: bool,
    /// Names of the other unknowns that the recordings cannot distinguish from this unknown.
    pub inseparable_from: Vec<String>,
    /// Smallest standard deviation of an unbiased estimate of this unknown if all other unknowns were known.
    pub std_alone: f64,
    pub prior: Option<f64>,
    pub unit: String,
    /// Name of the unknown with the largest correlation, and this correlation.
    pub with: Option<(String, f64)>,
    /// True for a parameter or a start value of the FMU; false for errors of sensors and for known values.
    pub is_parameter: bool,
}

/// Predicts the Cramér–Rao bound of each unknown for recordings with these inputs, linearised at the start values. `noise` is
/// the standard deviation of one sample of each output. Known values to which the question gives a tolerance are unknowns
/// with a prior. `warn` receives the FMU's warnings.
///
/// # Errors
/// If the question has a fault (the message lists all), or the FMU refuses a call.
pub fn foresee(
    model: &Model,
    question: &Question,
    records: &[Record],
    noise: &[f64],
    warn: &mut dyn FnMut(String),
) -> Result<Vec<Bound>> {
    ensure!(!records.is_empty(), "there is no table of planned inputs");
    for record in records {
        ensure!(!record.time.is_empty(), "{}: it has no row (allowed: at least one)", record.name);
    }
    ensure!(
        noise.iter().all(|sigma| *sigma > 0.0 && sigma.is_finite()),
        "the noise of an output must be above 0"
    );
    let (system, unknowns) = FmuSystem::new(model, question, records)?;
    let mut problem = system.problem(unknowns, question);
    for signal in &mut problem.signals {
        signal.sampled.fill(true);
        signal.measured.fill(0.0);
    }
    system.warnings(&problem.unknowns)?.into_iter().for_each(warn);
    let x = problem.starts[0].clone();
    let mut fit = Fit::new(&problem);
    fit.set(problem.signals.iter().map(|s| Noise::white(noise[s.output])).collect(), 1.0);
    let at = fit.at(&x)?;
    let everything = vec![true; x.len()];
    // computed twice, because the first call adapts the steps of the finite differences to the noise
    fit.derivatives(&at, &everything)?;
    let jacobian = fit.derivatives(&at, &everything)?.matrix;
    let solver = system.with_finer(|finer| fit.solver_error(&at, &jacobian, &everything, finer));
    let known = fit.knowledge(&jacobian, &everything, &solver);
    let covariance = &known.covariance;
    let bound = |j: usize| {
        let unknown = &problem.unknowns[j];
        let std = covariance[(j, j)].sqrt();
        let correlation =
            |k: usize| covariance[(j, k)] / (covariance[(j, j)] * covariance[(k, k)]).sqrt();
        let with = (0..x.len()).filter(|k| *k != j).map(|k| (k, correlation(k)));
        let with = with.filter(|(_, r)| r.is_finite());
        let with = with.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let is_lost = known.decided_by_solver[j];
        let sets = known.inseparable.iter().filter(|set| set.direction.contains_key(&unknown.name));
        let others =
            sets.flat_map(|set| set.direction.keys()).filter(|name| **name != unknown.name);
        let prior = unknown.prior.map(|(_, std)| std);
        let is_vague = match prior {
            Some(prior) => std > PRIOR_ALONE * prior,
            None => !std.is_finite() || std > x[j].abs(),
        };
        Bound {
            not_determined: is_vague && !is_lost,
            decided_by_solver: is_lost,
            inseparable_from: others.cloned().collect(),
            name: unknown.name.clone(),
            value: x[j],
            std: if std.is_finite() && !is_lost { std } else { f64::NAN },
            std_alone: if is_lost { f64::NAN } else { finite(1.0 / jacobian.column(j).norm()) },
            prior,
            unit: unknown.unit.clone(),
            with: with.map(|(k, r)| (problem.unknowns[k].name.clone(), r)),
            is_parameter: !unknown.is_known() && system.is_parameter(j),
        }
    };
    Ok((0..x.len()).map(bound).collect())
}

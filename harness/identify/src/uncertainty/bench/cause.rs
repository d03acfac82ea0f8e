//! Names the cause of a misfit: an effect of ordinary benches that was not fitted.
//!
//! Each candidate is added to the model that fits best. One run shows the direction in which it moves the residual. Of the part that
//! the unknowns cannot take, the candidate explains a share of the sum of squares at first order. The [`REFITTED`] candidates with
//! the largest shares are fitted with all unknowns. A candidate is the cause if its gain is far beyond chance, if the residual with it is
//! noise, and if its rivals lose: no other candidate that leaves noise, and no torque that follows the motion, has a deviance
//! within [`BIC_DECIDES`] of it. Otherwise the cause is unknown. All of this starts from the recording's own noise: the noise of the misfit would hide what it is made of.

use anyhow::Result;
use nalgebra::DVector;
use names::hubslosh::{FrictionModel, SloshModel, friction, hub, slosh, wheel};
use rayon::prelude::*;
use serde::Serialize;

use crate::estimate::prose;
use crate::fit::bench::goodness::tests;
use crate::fit::bench::problem::{Problem, Rough};
use crate::model::bench::unknown::{Quantity, Unknown};
use crate::tuning::{ACTUATOR_LIMIT, BIC_DECIDES, CAUSE_LEAST, CAUSE_PART, REFITTED};
use analysis::innovations::Tests;
use analysis::statistics::peak;

/// Cause of a misfit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    /// Effect that acts, in words.
    pub effect: String,
    /// Flags of `hubslosh identify` that fit it.
    pub flags: String,
    /// Estimate of its size: name, value and unit.
    pub size: Option<(String, f64, String)>,
    /// Decrease of −2 ln L.
    pub gain: f64,
}

/// Effects that leave noise alone, the largest gain first.
pub type Rivals = Vec<Cause>;

/// Returns true if a gain is beyond chance against that of the best rival.
pub fn wins(gain: f64, rival: Option<f64>) -> bool {
    rival.is_none_or(|rival| gain > rival + BIC_DECIDES)
}

impl Cause {
    /// Returns the cause in words.
    pub fn words(&self) -> String {
        let size = self.size.as_ref().map_or(String::new(), |(name, value, unit)| {
            let unit = if unit == "1" { String::new() } else { format!(" {}", prose(unit)) };
            format!(" ({name} = {value:.3e}{unit})")
        });
        format!(
            "The cause is {}: with it{size} the residual is noise, and no other effect that was tried explains it as well. {} fits it.",
            self.effect, self.flags
        )
    }
}

/// An effect that may explain a misfit.
struct Candidate {
    effect: &'static str,
    flags: String,
    settings: Vec<(String, String)>,
    unknown: Option<Unknown>,
}

fn candidates(problem: &Problem, model: &str, law: &str) -> Vec<Candidate> {
    let with = |effect, flags: &str, unknown: Unknown| Candidate {
        effect,
        flags: flags.into(),
        settings: Vec::new(),
        unknown: Some(unknown),
    };
    let set = |name: &str, value: &str| (name.to_string(), value.to_string());
    let unit = |name: &str| {
        let variable = problem.fmu.description().variable(name).ok();
        variable.and_then(|v| v.attributes().unit.clone()).unwrap_or_default()
    };
    let parameter = |name: &str, start: f64| Unknown::positive(name, &unit(name), start);
    let start = |name: &str, value: f64| format!("--start {name}={value:.3}");
    let most = problem.recordings.iter().map(|r| peak(&r.torque)).fold(0.0, f64::max);
    let limit = ACTUATOR_LIMIT * most;
    let mut all = vec![
        with("an actuator that lags its command", "--actuator-lag", Unknown::actuator_lag()),
        with("a gyro with a low-pass filter", "--gyro-lag", Unknown::gyro_lag()),
        with("friction that drifts", "--friction-drift", Unknown::friction_drift()),
        with(
            "a torque that turns the hub back, of a cable or of an imbalance on a tilted axis",
            &start(hub::K, 0.02),
            parameter(hub::K, 0.02),
        ),
        Candidate {
            settings: vec![set(wheel::ENABLED, "true")],
            ..with(
                "an actuator that reaches its largest torque",
                &format!("--set {}=true {}", wheel::ENABLED, start(wheel::TAU_MAX, limit)),
                parameter(wheel::TAU_MAX, limit),
            )
        },
    ];
    if law == FrictionModel::Stribeck.name() {
        all.push(Candidate {
            settings: vec![
                set(friction::MODEL, FrictionModel::Lugre.name()),
                set(friction::SIGMA1, "0"),
            ],
            ..with(
                "a bearing that yields before it slips (presliding stiffness)",
                "--friction stribeck,lugre",
                Unknown::bristle_stiffness(&unit(friction::SIGMA0)),
            )
        });
    }
    if model != SloshModel::Frozen.name() {
        all.push(with(
            "damping that grows with the amplitude",
            &start(slosh::ZETA_AMPLITUDE, 0.005),
            parameter(slosh::ZETA_AMPLITUDE, 0.005),
        ));
        all.push(Candidate {
            effect: "the second slosh mode",
            flags: format!("--set {}=2", slosh::MODES),
            settings: vec![set(slosh::MODES, "2")],
            unknown: None,
        });
    }
    // what is set or estimated was considered already
    all.retain(|candidate| {
        let fitted = |unknown: &Unknown| {
            problem.unknowns.iter().any(|other| other.quantity == unknown.quantity)
        };
        let is_set = |name: &str| problem.setup.settings.iter().any(|(other, _)| other == name);
        let is_named = match candidate.unknown.as_ref().map(|u| &u.quantity) {
            Some(Quantity::Parameter(name)) => is_set(name),
            Some(_) => false,
            None => candidate.settings.iter().any(|(name, _)| is_set(name)),
        };
        !is_named && !candidate.unknown.as_ref().is_some_and(fitted)
    });
    all
}

/// The same problem with the recordings' own noise.
fn fresh<'a>(problem: &Problem<'a>) -> Problem<'a> {
    let Problem { fmu, setup, recordings, unknowns, .. } = problem;
    let own = Problem::new(fmu, setup.clone(), recordings, unknowns.clone());
    Problem { driven: problem.driven.clone(), ..own }
}

/// Returns −2 ln L at the end of a search, with the noise that it leaves.
fn deviance(problem: &Problem, found: &Rough) -> f64 {
    let mut problem = problem.clone();
    problem.estimate_noise(&found.answer.0);
    problem.deviance(&found.answer.0)
}

/// A problem with a candidate, and its start from x.
fn with_candidate<'a>(
    problem: &Problem<'a>,
    candidate: &Candidate,
    x: &[f64],
) -> (Problem<'a>, Vec<f64>) {
    let (mut other, mut there) = (problem.clone(), x.to_vec());
    other.setup.settings.extend(candidate.settings.iter().cloned());
    if let Some(unknown) = &candidate.unknown {
        let unknown = unknown.clone().within_range_of(problem.fmu.description());
        there.push(unknown.inside(unknown.scale.variable(unknown.start)));
        other.unknowns.push(unknown);
    }
    (other, there)
}

/// Returns the effects that explain the misfit which a model with this friction law leaves at x.
///
/// # Errors
/// If the FMU refuses the model itself. A candidate that it refuses is left out.
pub fn find(
    problem: &Problem,
    x: &[f64],
    (model, law): (&str, &str),
    tell: &mut dyn FnMut(&str),
) -> Result<Rivals> {
    let problem = fresh(problem);
    let base = problem.search(x, CAUSE_PART.0)?;
    let (jacobian, e) = (&base.jacobian, &base.answer.1);
    let covariance = problem.covariance(jacobian)?;
    // what the unknowns cannot take
    let rest = |v: &DVector<f64>| v - jacobian * (&covariance.x * jacobian.tr_mul(v));
    let left = rest(e);
    let score = |candidate: &Candidate| {
        let (other, there) = with_candidate(&problem, candidate, &base.x);
        let Ok(answer) = other.answer(&there) else { return 0.0 };
        let seen = rest(&(other.stacked(&answer, &there) - e));
        let size = seen.norm();
        if size > 0.0 { (seen.dot(&left) / size).powi(2) } else { 0.0 }
    };
    let all = candidates(&problem, model, law);
    let mut scored: Vec<(f64, Candidate)> =
        all.into_par_iter().map(|candidate| (score(&candidate), candidate)).collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (score, candidate) in &scored {
        let part = score / e.norm_squared();
        tell(&format!(
            "{}: {:.1} % of the sum of squares at first order",
            candidate.effect,
            100.0 * part
        ));
    }
    let before = deviance(&problem, &base);
    let chance = (e.len() as f64).ln() + BIC_DECIDES;
    let mut rivals = Rivals::new();
    let least = scored.first().map_or(0.0, |best| CAUSE_LEAST * best.0).max(chance);
    let worth = scored.into_iter().take(REFITTED).filter(|(score, _)| *score > least);
    for (_, candidate) in worth {
        let (mut other, there) = with_candidate(&problem, &candidate, &base.x);
        let Ok(found) = other.search(&there, CAUSE_PART.0) else { continue };
        let gain = before - deviance(&other, &found);
        let mut fits = false;
        let mut size = None;
        if gain > chance {
            // the noise of the last search is the recording's; the tests need the noise that is left
            other.estimate_noise(&found.answer.0);
            let found = other.search(&found.x, CAUSE_PART.1)?;
            other.estimate_noise(&found.answer.0);
            fits = tests(&other, &found.answer.0).iter().all(Tests::passed);
            size = candidate.unknown.as_ref().and(other.unknowns.last()).map(|unknown| {
                let value = unknown.value(found.x[found.x.len() - 1]);
                (unknown.quantity.name(), value, unknown.unit.clone())
            });
        }
        tell(&format!(
            "with {}, −2 ln L falls by {gain:.1}, and {}",
            candidate.effect,
            if fits { "noise is left" } else { "more than noise is left" }
        ));
        if fits {
            let (effect, flags) = (candidate.effect.into(), candidate.flags);
            rivals.push(Cause { effect, flags, size, gain });
        }
    }
    rivals.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(rivals)
}

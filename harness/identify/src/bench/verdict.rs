//! Writes the verdict on a bench: sentences about slosh model, friction, fit and estimates.

use std::collections::BTreeMap;

use crate::bench::causes::{Cause, Missing};
use crate::bench::identification::ModelFit;
use crate::engine::DECIDES;
use crate::estimate::Combination;
use crate::estimate::{Estimated, prose};
use crate::words::verdict::{DOES_NOT_FIT, NO_MINIMUM, failed};
use analysis::innovations::Tests;
use names::hubslosh::{SloshModel, hub};

pub struct Question<'a> {
    pub slosh: &'a [ModelFit],
    pub near: usize,
    pub laws: &'a [ModelFit],
    pub doubts: &'a [String],
}

pub struct Findings {
    pub torque: Option<String>,
    /// True if the residual passes the tests for noise.
    pub is_noise: bool,
    /// True if the residual shows an effect that was not estimated.
    pub asks: bool,
    pub alike: Vec<String>,
    /// The additional torque that the model lacks, if it is the cause of a misfit.
    pub missing: Vec<Missing>,
    pub cause: Option<Cause>,
    pub doubts: Vec<String>,
}

impl Findings {
    /// Returns true if the model explains the recordings.
    pub fn fits(&self) -> bool {
        self.is_noise && !self.asks && self.doubts.is_empty()
    }
}

/// Returns the sentences of the verdict: the slosh model, the friction, whether the model fits, and
/// which estimates are determined.
pub fn words(
    question: &Question,
    findings: &Findings,
    fit: &ModelFit,
    combinations: &[Combination],
    parameters: &BTreeMap<String, Estimated>,
) -> Vec<String> {
    let (mut lines, fits) = (Vec::new(), findings.fits());
    lines.extend(slosh(question, fits));
    lines.extend(friction(question.laws));
    lines.extend(findings.torque.iter().cloned());
    if !fits {
        let mut reasons: Vec<String> =
            fit.tests.iter().flat_map(|tests| failed(tests, "the torque")).collect();
        reasons.extend(findings.missing.iter().map(Missing::words));
        reasons.extend(findings.doubts.iter().cloned());
        if reasons.is_empty() {
            reasons.push("it shows an effect that is not estimated".into());
        }
        lines.push(format!(
            "{DOES_NOT_FIT}: no model leaves only the gyro's noise as residual ({}). Values and intervals are those of the \
             nearest model and cannot be trusted: something acts on the bench that the models lack.",
            reasons.join("; ")
        ));
        match &findings.cause {
            Some(cause) => lines.push(cause.words()),
            None if findings.missing.is_empty() => lines.push(unknown_cause(findings, fit)),
            None => {}
        }
    }
    if !fit.converged {
        lines.push(format!(
            "{NO_MINIMUM} (it is {:.2} standard deviations away): values and standard deviations cannot be trusted. More torque, \
             a longer recording or --start may help.",
            fit.newton_decrement
        ));
    }
    if fit.model == SloshModel::Frozen.name() && parameters.contains_key(hub::I) {
        lines.push(
            "hub.I is the total inertia minus the inertia of the liquid in the settings (tank.d, tank.h, tank.r, fluid.rho). A \
             recording without slosh does not show the liquid: the interval is valid only for this liquid."
                .into(),
        );
    }
    lines.extend(combinations.iter().map(Combination::words));
    for (name, p) in parameters {
        if !p.determined && !p.interval[0].is_nan() {
            let [low, high] = p.interval;
            let within = if high.is_finite() {
                format!("from {low:.2e} to {high:.2e}")
            } else {
                format!("above {low:.2e}")
            };
            lines.push(format!(
                "{name} is not determined by these data: 95 % interval {within} {}, the nearest fit has {:.3e}.",
                prose(&p.unit),
                p.value
            ));
        }
    }
    lines
}

/// Returns the sentence about a misfit with an unknown cause: where the residual is large, and which effects
/// the recording cannot distinguish.
fn unknown_cause(findings: &Findings, fit: &ModelFit) -> String {
    let worst = |test: fn(&Tests) -> (f64, f64)| {
        let all = fit.tests.iter().map(test);
        all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
    };
    let ((in_frequency, f), (in_time, t)) = (worst(|t| t.in_frequency), worst(|t| t.in_time));
    let why = match findings.alike.len() {
        0 => "no effect that was tried explains it".to_string(),
        _ => format!("{} explain it about as well", findings.alike.join(", ")),
    };
    format!(
        "The cause is unknown: {why}. The residual is largest around {f:.2} Hz ({in_frequency:.1} σ) and around {t:.1} s \
         ({in_time:.1} σ)."
    )
}

fn slosh(question: &Question, fits: bool) -> Option<String> {
    let best = question.slosh.first()?;
    if question.slosh.len() == 1 {
        return None;
    }
    if question.near > 1 {
        let near = &question.slosh[..question.near];
        let each: Vec<String> = near
            .iter()
            .zip(probabilities(near.iter().map(|m| m.bic)))
            .map(|(model, p)| format!("{} (probability {p:.2})", model.model))
            .collect();
        return Some(format!(
            "Cannot tell which slosh model it is: {}. The parameters below are those of the first; their standard deviations \
             include the others.",
            each.join(", ")
        ));
    }
    let second = &question.slosh[1];
    let is = if fits { "The slosh model is" } else { "The nearest slosh model is" };
    Some(format!(
        "{is} {}: its BIC is {:.0} below that of the next, {}.",
        best.model,
        second.bic - best.bic,
        second.model
    ))
}

fn friction(laws: &[ModelFit]) -> Vec<String> {
    let Some(first) = laws.first() else { return Vec::new() };
    let one = |other: &ModelFit| {
        let gain = first.bic - other.bic;
        match gain {
            g if g > DECIDES => {
                format!(
                    "The friction is {}: its BIC is {g:.0} below that of {}.",
                    other.friction, first.friction
                )
            }
            // BIC counts ln N for each further unknown; without this term both laws are equally good
            _ if first.deviance - other.deviance > -DECIDES => format!(
                "Cannot tell the friction's law: {} explains the data as well as {}, which has fewer unknowns and is used.",
                other.friction, first.friction
            ),
            g => format!(
                "The friction is {}: its BIC is {:.0} below that of {}.",
                first.friction, -g, other.friction
            ),
        }
    };
    laws[1..].iter().map(one).collect()
}

/// Returns the probabilities of models with these values of BIC, if all are equally probable beforehand: exp(−BIC/2) divided by
/// the sum over all models (Kass and Raftery 1995).
pub fn probabilities(bic: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    let least = bic.clone().fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = bic.map(|b| (-(b - least) / 2.0).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| w / sum).collect()
}

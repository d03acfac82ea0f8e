//! Effects that may explain a misfit: a score test (Lagrange multiplier; Rao 1948, Engle 1984) of each candidate, then fits
//! of the best ones.
//!
//! A small effect of size x shifts the residuals e by x v. The unknowns and the tolerances can cancel the part of v
//! that lies in the span of their derivatives J. The remaining part v' gives the size that explains the residual best,
//! and its standard deviation:
//!
//! ```text
//! x = −v'·e/|v'|²,   σ_x = 1/|v'|
//! ```
//!
//! If the effect is absent, x/σ_x has a standard normal distribution. A score test gathers in one number the evidence that a
//! general test of whiteness spreads over hundreds of lags or bands: an estimate can be off by ten standard deviations while all
//! general tests pass. The candidates with the largest scores are fitted together with all unknowns. These fits begin with the
//! noise between neighbouring rows, because the noise that was estimated from a misfit contains the misfit and would hide it.
//!
//! An effect may imitate another one that is not among the candidates. For example, a lag with a negative delay changes the gain
//! over the frequency as a wrong inertia does. Therefore a fitted effect is not accepted as the cause if an output then precedes
//! its input, if another unknown then lies at a bound, if the known values would together be beyond their tolerances, or if
//! another candidate still has a score that chance does not explain.

use analysis::innovations::LIMIT;
use anyhow::Result;
use nalgebra::DVector;
use rayon::prelude::*;

use super::minimum::{Curvature, End, Minimum, places};
use super::problem::Part;
use super::search::{ABOVE, OWN};
use super::{ALIKE, DECIDES, ENDS, Fit, SEEN, SETS, Solution, Unknown, Z};
use crate::news::News;

/// Largest number of candidates that are fitted. They are the candidates with the largest scores.
const FITTED: usize = 4;

#[derive(Clone, Copy, Debug)]
pub struct Effect {
    pub unknown: usize,
    pub size: (f64, f64),
    /// Decrease of −2 ln L when the effect is fitted.
    pub gain: f64,
    /// True if the residual is noise once the effect is fitted, and nothing indicates that another effect is the true
    /// cause.
    pub fits: bool,
}

struct Score {
    unknown: usize,
    size: f64,
    score: f64,
}

/// Returns the score of each candidate at a minimum, the largest first. A candidate has no score if the unknowns cancel its
/// effect, or if the system refuses it.
///
/// # Errors
/// If the system refuses the minimum.
fn scores(fit: &mut Fit, minimum: &Minimum, candidates: &[usize]) -> Result<Vec<Score>> {
    let unknowns = &fit.problem.unknowns;
    let is_known = |(u, free): (&Unknown, &bool)| *free || u.is_known();
    let known: Vec<bool> = unknowns.iter().zip(&minimum.free).map(is_known).collect();
    let base = &minimum.point;
    let jacobian = fit.derivatives(base, &known)?.matrix;
    let covariance = Curvature::new(&jacobian, places(&known)).covariance(known.len());
    let rest = |v: &DVector<f64>| v - &jacobian * (&covariance * jacobian.tr_mul(v));
    let one = |&unknown: &usize| -> Option<Score> {
        let mut z = base.z.clone();
        // a plausible size of the effect, because an infinitesimal lag has the same effect as a delay, and an infinitesimal
        // limit has no effect
        let step = unknowns[unknown].reach;
        z[unknown] += step;
        let there = fit.at(&z).ok()?;
        let change = (there.e - &base.e) / step;
        let seen = rest(&change);
        let norm = seen.norm();
        // the remainder that the unknowns cannot cancel
        if !(norm.is_finite() && norm > SEEN * change.norm()) {
            return None;
        }
        let score = -seen.dot(&base.e) / norm;
        Some(Score { unknown, size: score / norm, score })
    };
    let mut scores: Vec<Score> = candidates.par_iter().filter_map(one).collect();
    scores.sort_by(|a, b| b.score.abs().total_cmp(&a.score.abs()));
    Ok(scores)
}

/// Returns the effects that explain a part of a solution's residual, the largest decrease of −2 ln L first. Only candidates whose
/// score is beyond chance are fitted; a candidate that the system refuses is left out.
///
/// # Errors
/// If the system refuses the minimum.
pub fn effects(solution: &Solution, news: &mut dyn FnMut(&News)) -> Result<Vec<Effect>> {
    let problem = solution.fit.problem;
    let name = |j: usize| &problem.unknowns[j].name;
    let is_candidate: Vec<bool> =
        problem.unknowns.iter().map(|u| u.part == Part::Candidate).collect();
    let candidates = places(&is_candidate);
    if candidates.is_empty() {
        return Ok(Vec::new());
    }
    let mut fit = Fit::new(problem);
    (fit.hold, fit.free) = (solution.fit.hold, solution.fit.free.clone());
    fit.set(solution.fit.noise.clone(), 1.0);
    let mut base = solution.minimum.clone();
    if !solution.is_noise() {
        fit.limit_noise();
        let z = base.point.z.clone();
        base = fit.minimise(&z, &solution.fit.free, None, End::new(6, ENDS.0))?;
    }
    let words = |scores: &[Score]| -> String {
        let all = scores.iter().map(|s| format!("{} {:.1}", name(s.unknown), s.score));
        all.collect::<Vec<_>>().join(", ")
    };
    let first_scores = scores(&mut fit, &base, &candidates)?;
    let said = words(&first_scores);
    news(&News::Detail(format!("scores of effects that are not estimated: {said}")));
    let own = fit.noise.clone();
    fit.renew_noise(&base.point);
    let before = fit.deviance(&fit.point(&base.point.z, base.point.motion.clone()));
    fit.set(own, 1.0);
    let chance = DECIDES + (base.point.e.len() as f64).ln();
    let noise = fit.noise.clone();
    let at_bound = fit.stuck(&base.point.z).len();
    // above this the noise is loud, so that the effect cannot be the cause
    let loud = (ABOVE * OWN.0).powi(2) * base.point.e.len() as f64;
    let (mut firsts, mut least) = (Vec::new(), loud.min(base.point.cost - chance) - chance);
    for score in first_scores.iter().take(FITTED).filter(|s| s.score.abs() >= LIMIT) {
        let j = score.unknown;
        let mut free = fit.free.clone();
        free[j] = true;
        let mut z = base.point.z.clone();
        let reach = problem.unknowns[j].reach;
        let mut size = score.size.abs().max(0.3 * reach);
        // far from its minimum an effect that can have only one sign may seem to have the opposite sign
        if fit.ends[j].0 < z[j] {
            size = size.copysign(score.size);
        }
        z[j] = (z[j] + size).clamp(fit.ends[j].0, fit.ends[j].1);
        let end = End { gain: ALIKE, above: least + chance, ..End::new(SETS, ENDS.0) };
        let Ok(first) = fit.minimise(&z, &free, None, end) else { continue };
        news(&News::Detail(format!(
            "with {} the sum of squares is {:.1}, {:.0} simulations",
            name(j),
            first.point.cost,
            fit.simulations()
        )));
        least = least.min(first.point.cost);
        firsts.push((j, first));
    }
    let mut found = Vec::new();
    for (j, first) in firsts.into_iter().filter(|(_, first)| first.point.cost < least + chance) {
        fit.set(noise.clone(), 1.0);
        fit.renew_noise(&first.point);
        let (z, free) = (first.point.z.clone(), first.free.clone());
        let Ok(mut other) = fit.minimise(&z, &free, None, End::new(6, ENDS.0 * 0.2)) else {
            continue;
        };
        fit.renew_noise(&other.point);
        other.point = fit.point(&other.point.z, std::mem::take(&mut other.point.motion));
        other.derivatives = None;
        let gain = before - fit.deviance(&other.point);
        let Ok(found_there) = fit.derivatives_at(&mut other) else { continue };
        let curvature = Curvature::new(&found_there.matrix, places(&free));
        let covariance = curvature.covariance(free.len());
        let std = |i: usize| covariance[(i, i)].sqrt();
        let rivals: Vec<usize> = candidates.iter().copied().filter(|i| *i != j).collect();
        let why_not = if !fit.is_noise(&other.point) {
            Some("more than noise is left".into())
        } else if fit.is_early(&other.point.z, Z * fit.delay().map_or(0.0, std)) {
            Some("the rate would precede the torque".into())
        } else if fit.pull(&other.point.z) > LIMIT {
            Some("known values would be beyond their tolerances".into())
        } else if fit.stuck(&other.point.z).len() > at_bound {
            Some("an unknown is at its bound".into())
        } else {
            let mut asked = scores(&mut fit, &other, &rivals)?;
            asked.retain(|score| score.score.abs() >= LIMIT);
            (!asked.is_empty()).then(|| format!("the residual still shows {}", words(&asked)))
        };
        let value = problem.unknowns[j].value(other.point.z[j]);
        let slope = if problem.unknowns[j].log { value } else { 1.0 };
        let size = (value, slope * std(j));
        news(&News::Detail(format!(
            "with {} = {:.3e} ± {:.1e}, −2 ln L falls by {gain:.1}, and {}",
            name(j),
            size.0,
            size.1,
            why_not.as_deref().unwrap_or("noise is left")
        )));
        if gain > chance {
            found.push(Effect { unknown: j, size, gain, fits: why_not.is_none() });
        }
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(found)
}

/// Returns the effect that is the cause: with it the residual is noise, no other effect explains the recordings clearly better,
/// and no other effect with which the residual is noise explains them about as well.
pub fn cause(effects: &[Effect]) -> Option<&Effect> {
    let best = effects.first()?.gain;
    let mut fitting = effects.iter().filter(|effect| effect.fits);
    let first = fitting.next().filter(|first| first.gain > best - DECIDES)?;
    fitting.next().is_none_or(|second| first.gain > second.gain + DECIDES).then_some(first)
}

//! Effects that a misfit asks for: a score test (Lagrange multiplier; Rao 1948, Engle 1984) of each candidate, then fits of the best.
//!
//! Under a small effect of size x the residuals e move by x v. The unknowns and the tolerances can cancel the part of v that lies
//! in the span of their derivatives J. The rest v' of it gives the size that explains the residual best, and its standard
//! deviation:
//!
//! ```text
//! x = −v'·e/|v'|²,   σ_x = 1/|v'|
//! ```
//!
//! x/σ_x is normal if the effect is absent. A general test spreads over hundreds of rows or bands what this test gathers in one
//! number: an estimate can be off by ten standard deviations without a sign in a general test. The candidates with the largest
//! scores are fitted with all unknowns, from the recordings' own noise, because the noise that is estimated from a misfit
//! contains the misfit and would hide it.

use analysis::innovations::{LIMIT, Tests};
use anyhow::Result;
use nalgebra::DVector;
use rayon::prelude::*;

use super::minimum::{Curvature, End, places};
use super::problem::Part;
use super::{DECIDES, ENDS, Fit, SEEN, Solution};
use crate::news::News;

/// Largest number of candidates that are fitted, those with the largest scores.
const FITTED: usize = 3;

#[derive(Clone, Copy, Debug)]
pub struct Effect {
    pub unknown: usize,
    pub size: (f64, f64),
    /// Decrease of −2 ln L by the effect.
    pub gain: f64,
    /// True if the residual is noise once the effect is fitted.
    pub fits: bool,
}

struct Score {
    unknown: usize,
    size: f64,
    std: f64,
    score: f64,
}

/// Returns the effects that explain a part of a solution's residual, the largest gain first. Only candidates with a score beyond
/// chance are fitted.
///
/// # Errors
/// If the system refuses the minimum. A candidate that it refuses is left out.
pub fn effects(solution: &Solution, news: &mut dyn FnMut(&News)) -> Result<Vec<Effect>> {
    let problem = solution.fit.problem;
    let is_part =
        |part: Part| -> Vec<bool> { problem.unknowns.iter().map(|u| u.part == part).collect() };
    let candidates = places(&is_part(Part::Candidate));
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
    let tolerances = is_part(Part::Tolerance);
    let known: Vec<bool> = tolerances.iter().zip(&fit.free).map(|(t, free)| *t || *free).collect();
    let jacobian = fit.derivatives(&base.point, &known)?.matrix;
    let covariance = Curvature::new(&jacobian, places(&known)).covariance(known.len());
    let rest = |v: &DVector<f64>| v - &jacobian * (&covariance * jacobian.tr_mul(v));
    let one = |&unknown: &usize| -> Option<Score> {
        let mut z = base.point.z.clone();
        // a plausible size: the first order of a lag is a delay, that of a limit is nothing
        let step = problem.unknowns[unknown].reach;
        z[unknown] += step;
        let there = fit.at(&z).ok()?;
        let change = (there.e - &base.point.e) / step;
        let seen = rest(&change);
        let norm = seen.norm();
        // the rest the unknowns cancel
        if !(norm.is_finite() && norm > SEEN * change.norm()) {
            return None;
        }
        let score = -seen.dot(&base.point.e) / norm;
        Some(Score { unknown, size: score / norm, std: 1.0 / norm, score })
    };
    let mut scores: Vec<Score> = candidates.par_iter().filter_map(one).collect();
    scores.sort_by(|a, b| b.score.abs().total_cmp(&a.score.abs()));
    let name = |j: usize| &problem.unknowns[j].name;
    let said: Vec<String> =
        scores.iter().map(|s| format!("{} {:.1}", name(s.unknown), s.score)).collect();
    news(&News::Detail(format!("scores of effects that are not estimated: {}", said.join(", "))));
    let own = fit.noise.clone();
    fit.renew_noise(&base.point);
    let before = fit.deviance(&fit.point(&base.point.z, base.point.motion.clone()));
    fit.set(own, 1.0);
    let chance = DECIDES + (base.point.e.len() as f64).ln();
    let noise = fit.noise.clone();
    let mut found = Vec::new();
    for score in scores.iter().take(FITTED).filter(|s| s.score.abs() >= LIMIT) {
        let j = score.unknown;
        fit.set(noise.clone(), 1.0);
        let mut free = fit.free.clone();
        free[j] = true;
        let mut z = base.point.z.clone();
        let reach = problem.unknowns[j].reach;
        let mut size = score.size.abs().max(0.3 * reach);
        // far from its minimum an effect that has one sign may seem to have the other
        if fit.ends[j].0 < 0.0 {
            size = size.copysign(score.size);
        }
        z[j] = size.clamp(fit.ends[j].0, fit.ends[j].1);
        let Ok(first) = fit.minimise(&z, &free, None, End::new(8, ENDS.0)) else { continue };
        fit.renew_noise(&first.point);
        let z = first.point.z.clone();
        let Ok(mut other) = fit.minimise(&z, &free, None, End::new(6, ENDS.0 * 0.2)) else {
            continue;
        };
        fit.renew_noise(&other.point);
        let there = fit.point(&other.point.z, other.point.motion.clone());
        let gain = before - fit.deviance(&there);
        let fits = fit.tests(&there).iter().all(Tests::passed) && !fit.is_loud();
        let std = fit.derivatives_at(&mut other).map_or(score.std, |found| {
            let covariance = Curvature::new(&found.matrix, places(&free)).covariance(free.len());
            covariance[(j, j)].sqrt()
        });
        let size = (there.z[j], std);
        news(&News::Detail(format!(
            "with {} = {:.3e} ± {:.1e}, −2 ln L falls by {gain:.1}, and {}",
            name(j),
            size.0,
            size.1,
            if fits { "noise is left" } else { "more than noise is left" }
        )));
        if gain > chance {
            found.push(Effect { unknown: j, size, gain, fits });
        }
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    Ok(found)
}

/// Returns the effect that is the cause: it leaves noise as residual, and no other effect that does so explains the recordings
/// about as well.
pub fn cause(effects: &[Effect]) -> Option<&Effect> {
    let mut fitting = effects.iter().filter(|effect| effect.fits);
    let first = fitting.next()?;
    fitting.next().is_none_or(|second| first.gain > second.gain + DECIDES).then_some(first)
}

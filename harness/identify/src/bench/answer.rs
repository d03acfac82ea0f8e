//! The result for the bench, from the solution of the engine: estimates, combinations, causes and sentences of the verdict.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;

use analysis::innovations::{LIMIT, Tests};
use analysis::statistics::{about_mean, correlation, deviation, peak};
use anyhow::Result;
use formulas::cylinder::XI;
use formulas::regime::Regime;
use names::hubslosh::{SloshModel, friction};

use super::causes::{self, Cause, Missing};
use super::combination::{self, ONE_WAY};
use super::problem::LEAST_FRICTION;
use super::system::{BenchSystem, Target};
use crate::bench::identification::{Details, Identification, ModelFit};
use crate::bench::verdict::{self, Findings};
use crate::engine::cause::{Effect, cause, effects};
use crate::engine::draws::Derived;
use crate::engine::hold::Rival;
use crate::engine::minimum::{Curvature, places};
use crate::engine::{ENDS, Fit, Signal, Solution, Z};
use crate::estimate::Combination;
use crate::estimate::{Estimated, fit_percent, mean_square, prose};
use crate::input::recording::Recording;
use crate::input::tolerance::{self, Share};
use crate::news::News;
use crate::words::identified::{Identified, Residual, residuals};
use crate::words::page::RATE;

/// Fit of the rates, %, below which the search is assumed to have ended in a local minimum far from the true values.
const POOR_FIT: f64 = 90.0;

pub fn summary(solution: &Solution, (model, law): (&str, &str)) -> ModelFit {
    let fit = &solution.fit;
    let point = &solution.minimum.point;
    let deviance = fit.deviance(point);
    let count = places(&fit.free).len();
    let residuals = fit.residuals(&point.z, &point.motion);
    let rates = fit.problem.signals.iter().zip(&residuals).filter(|(signal, _)| signal.output == 0);
    let (left, measured): (Vec<_>, Vec<_>) =
        rates.map(|(s, r)| (s.picked(r), about_mean(&s.picked(&s.measured)))).unzip();
    let fit_pct = fit_percent(&left.concat(), &measured.concat());
    let rms = mean_square(&left[0]).sqrt();
    ModelFit {
        model: model.into(),
        friction: law.into(),
        deviance,
        bic: deviance + count as f64 * (fit.sampled() as f64).ln(),
        fit_pct,
        converged: solution.minimum.decrement < ENDS.0,
        newton_decrement: solution.minimum.decrement,
        tests: solution.tests.clone(),
        validation_pct: Vec::new(),
        noise_white: fit.noise[0].white,
        simulations: fit.simulations(),
        poor: fit_pct < POOR_FIT && rms > 2.0 * fit.problem.signals[0].white,
    }
}

/// Returns the fit, %, of each recording of `validation`. These recordings were not fitted; they are simulated
/// with the estimated values.
///
/// # Errors
/// If the FMU refuses to run.
pub fn validate(
    system: &BenchSystem,
    solution: &Solution,
    validation: &[Recording],
) -> Result<Vec<f64>> {
    let values = solution.fit.values(&solution.minimum.point.z);
    let one = |recording: &Recording| -> Result<f64> {
        let own = BenchSystem {
            recordings: std::slice::from_ref(recording),
            settings: system.settings.clone(),
            targets: system.targets.clone(),
            base: std::sync::OnceLock::new(),
            ..*system
        };
        let rows = recording.time.len();
        let motion = crate::engine::System::run(&own, &values, 0, rows, solution.fit.hold, false)?;
        let rate = recording.of_fresh(&recording.rate);
        let model = recording.of_fresh(&motion.outputs[0]);
        let scale = 1.0 + own.value(&values, &Target::GyroScale).unwrap_or(0.0);
        // a recording that was not fitted has a bias of its own
        let off: Vec<f64> = rate.iter().zip(&model).map(|(y, w)| y - scale * w).collect();
        Ok(fit_percent(&about_mean(&off), &rate))
    };
    validation.iter().map(one).collect()
}

pub struct Fitted<'p> {
    pub system: &'p BenchSystem<'p>,
    pub solution: Solution<'p>,
    pub fit: ModelFit,
}

/// Completes the identification with the chosen model `best`. `near` contains the probability of the chosen model, and the
/// other models that explain the recordings about as well, each with its probability. The draws of all of them are mixed,
/// which widens the intervals.
///
/// # Errors
/// If the FMU refuses a run at the minimum.
pub fn conclude(
    mut best: Fitted,
    near: (f64, &mut [(f64, Fitted)]),
    question: &verdict::Question,
    tell: &mut dyn FnMut(News),
) -> Result<Identification> {
    let (system, solution) = (best.system, &mut best.solution);
    let motion = solution.minimum.point.motion.clone();
    let _ = system.base.set(motion.clone());
    let found = effects(solution, &mut |news| tell(news.clone()))?;
    let mut full = solution.draw(true)?;
    let own = solution.draw(false)?;
    if !near.1.is_empty() {
        let mut all = vec![(near.0, full)];
        for (probability, other) in near.1 {
            all.push((*probability, other.solution.draw(true)?));
        }
        full = Derived::mixed(&all);
    }
    let rate = motion.iter().flat_map(|motion| motion.outputs[0].iter().copied());
    let way = combination::way(rate);
    let combinations = combination::combinations(&full, way);
    let mut parameters = BTreeMap::new();
    let mut measurement = BTreeMap::new();
    for (k, name) in full.names.iter().enumerate() {
        let estimated = estimated(system, solution, (&full, &own), k, &combinations);
        match &system.targets[k] {
            Target::Parameter(_)
            | Target::Asymmetry
            | Target::Length
            | Target::MassRatio
            | Target::Inertia
            | Target::Zeta => parameters.insert(name.clone(), estimated),
            _ => measurement.insert(name.clone(), estimated),
        };
    }
    let mut fit = best.fit.clone();
    fit.simulations = solution.fit.simulations();
    let findings = findings(system, solution, &found, question);
    let fits = findings.fits();
    let mut verdict = verdict::words(question, &findings, &fit, &combinations, &parameters);
    let unknowns = &solution.fit.problem.unknowns;
    let held = unknowns.iter().zip(&solution.fit.free);
    let held = held.filter(|(u, free)| u.is_known() && !**free);
    let known = held.filter_map(|(u, _)| Some((u.name.as_str(), u.prior?.1)));
    verdict.extend(shares(&full, &own, known));
    verdict.extend(shown(system, solution, &full, &mut parameters));
    let angles = motion.iter().map(|motion| peak(&motion.others[0]));
    let is_frozen = fit.model == SloshModel::Frozen.name();
    let slosh_angle = if is_frozen { 0.0 } else { angles.fold(0.0, f64::max) };
    if !full.has_enough_draws() {
        verdict.push(
            "No interval is given: hardly any combination of tank and hub has the slosh mode that the recordings show.".into(),
        );
    }
    verdict.extend(regime(&fit.model, slosh_angle));
    let columns: Vec<&Vec<f64>> = full.columns.iter().collect();
    let correlations =
        columns.iter().map(|a| columns.iter().map(|b| correlation(a, b)).collect()).collect();
    let details = Details {
        combinations,
        condition: solution.minimum.derivatives.as_ref().map_or(f64::NAN, |found| {
            Curvature::new(&found.matrix, places(&solution.fit.free)).condition()
        }),
        missing: findings.missing.clone(),
        cause: findings.cause.clone(),
        slosh_angle,
        ..Details::default()
    };
    let converged = fit.converged && full.has_enough_draws();
    Ok(Identification {
        parameters,
        measurement,
        settings: system.settings.iter().cloned().collect(),
        correlations: (full.names.clone(), correlations),
        converged,
        fits: Some(fits),
        verdict,
        residuals: rate_residuals(system, solution),
        ..Identified::new(Details { fit, ..details })
    })
}

fn estimated(
    system: &BenchSystem,
    solution: &Solution,
    (full, own): (&Derived, &Derived),
    k: usize,
    combinations: &[Combination],
) -> Estimated {
    let name = &full.names[k];
    let unknown = &solution.fit.problem.unknowns[k];
    let (mut std, mut interval, std_noise) = (full.std(k), full.interval(k), own.std(k));
    let positive = unknown.log || unknown.bounds.0 >= 0.0;
    if let Some((_, open)) = full.open.as_ref().filter(|(open, _)| open == name) {
        let ends = [0.0, f64::INFINITY];
        (0..2).filter(|end| open[*end]).for_each(|end| interval[end] = ends[end]);
    }
    let value = full.values[k];
    // an asymmetric interval has the standard deviation of its longer side
    let mut ends = interval;
    if !interval[1].is_finite() {
        // an open interval counts up to the largest draw, at the end of the profile
        ends[1] = full.columns[k].iter().copied().fold(value, f64::max);
    }
    let reach = ends.map(|end| (end - value).abs() / Z);
    let reach = reach.into_iter().filter(|reach| reach.is_finite()).fold(0.0, f64::max);
    std = if std.is_finite() { std.max(reach) } else { std };
    let is_part = |c: &Combination| c.of.contains(name) && c.std < 0.5 * std;
    let is_shown = match &system.targets[k] {
        _ if name == friction::ASYMMETRY => std < ONE_WAY,
        _ if !positive => true,
        _ => interval[1].is_finite() && std < 0.5 * value.abs(),
    };
    let determined = is_shown && !combinations.iter().any(|c| c.name.contains("(1 ") && is_part(c));
    Estimated { value, std, std_noise, interval, determined, unit: full.units[k].clone() }
}

fn findings(
    system: &BenchSystem,
    solution: &Solution,
    found: &[Effect],
    question: &verdict::Question,
) -> Findings {
    let problem = solution.fit.problem;
    let named = cause(found);
    let mut doubts = question.doubts.to_vec();
    let z = &solution.minimum.point.z;
    if let Some(j) = solution.fit.delay().filter(|_| solution.fit.is_early(z, 0.0)) {
        doubts.push(format!(
            "the rate comes {:.2} ms before the torque: check the time stamps and the torque between rows (--torque; \
             --also early_rate allows it)",
            -1e3 * z[j]
        ));
    }
    let pull = solution.fit.pull(z);
    if pull > LIMIT {
        doubts.push(format!(
            "the fit needs known values outside their tolerances, together by {pull:.1} standard deviations: check \
             --set, --start and --tolerance"
        ));
    }
    for j in &solution.at_bound {
        let unknown = &problem.unknowns[*j];
        let target = &system.targets[*j];
        let is_own = matches!(target, Target::Parameter(_)) && !unknown.bent;
        // a friction at its lower bound is not reported, because friction may be 0
        let least = LEAST_FRICTION * unknown.start;
        let is_zero =
            !unknown.log && unknown.bounds.0 >= 0.0 && solution.minimum.point.z[*j] <= 2.0 * least;
        if is_own && !is_zero {
            doubts.push(format!(
                "{} = {:.4e} is at the end of the range that the FMU allows, {} to {}",
                unknown.name,
                unknown.value(solution.minimum.point.z[*j]),
                unknown.bounds.0,
                unknown.bounds.1
            ));
        }
    }
    if solution.fit.is_loud() {
        let (noise, signal) = (&solution.fit.noise[0], &problem.signals[0]);
        doubts.push(format!(
            "the residual is {:.1} times the noise between neighbouring rows",
            noise.white / signal.own_noise()
        ));
    }
    let missing: Vec<Missing> =
        named.and_then(|e| causes::missing(system, e)).into_iter().collect();
    let named: Option<Cause> = named.and_then(|effect| causes::cause(system, effect));
    let alike = found.iter().filter(|e| e.fits).map(|e| causes::words(&system.targets[e.unknown]));
    Findings {
        torque: torque_words(solution),
        is_noise: solution.tests.iter().all(Tests::passed),
        asks: !found.is_empty(),
        alike: alike.collect(),
        missing,
        cause: named,
        doubts,
    }
}

fn torque_words(solution: &Solution) -> Option<String> {
    if solution.rivals.is_empty() {
        return None;
    }
    let fit = &solution.fit;
    let now = fit.hold.words();
    let late = |delay: Option<f64>| {
        delay.map_or(String::new(), |delay| format!(" with a delay of {:.2} ms", 1e3 * delay))
    };
    let own = fit.delay().filter(|j| fit.free[*j]).map(|j| solution.minimum.point.z[j]);
    let near: Vec<&Rival> = solution.rivals.iter().filter(|r| r.is_near()).collect();
    if !near.is_empty() {
        let weights = near.iter().map(|r| (-0.5 * r.more).exp());
        let sum = 1.0 + weights.clone().sum::<f64>();
        let mut each = vec![format!("{now}{} (probability {:.2})", late(own), 1.0 / sum)];
        each.extend(near.iter().zip(weights).map(|(r, w)| {
            format!("{}{} (probability {:.2})", r.hold.words(), late(r.delay), w / sum)
        }));
        return Some(format!(
            "Cannot tell what the torque does between rows: {}. The values are those of the first; their standard deviations \
             include the others. --torque sets it.",
            each.join(", ")
        ));
    }
    let each = solution.rivals.iter().map(|r| {
        let hold = r.hold.words();
        match r.delay.filter(|_| r.early) {
            Some(delay) => format!("{hold} would need a delay of {:.2} ms", 1e3 * delay),
            None if r.lost => {
                format!("{hold} was given up, because its sum of squares was {:.0} larger", r.more)
            }
            None => format!("{hold}{} changes the sum of squares by {:+.0}", late(r.delay), r.more),
        }
    });
    Some(format!(
        "The torque is taken as {now}: with all else free, {}. --torque sets it.",
        each.collect::<Vec<_>>().join(", ")
    ))
}

/// Returns the sentence on the estimates whose uncertainty comes mostly from tolerances.
fn shares<'a>(
    full: &Derived,
    own: &Derived,
    known: impl Iterator<Item = (&'a str, f64)>,
) -> Option<String> {
    let mut all = Vec::new();
    for (k, name) in full.names.iter().enumerate() {
        let share = 1.0 - (own.std(k) / full.std(k)).powi(2);
        let each = full.tolerances.iter();
        let each = each.map(|(of, draws)| (of, correlation(draws, &full.columns[k]).abs()));
        let most = each.filter(|(_, r)| r.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1));
        all.extend(most.map(|(most, _)| Share { name: name.clone(), share, most: most.clone() }));
    }
    let known: Vec<String> =
        known.map(|(name, std)| format!("{name} {} %", (1e6 * std).round() / 1e4)).collect();
    tolerance::shares(&known, &all)
}

/// Returns a warning if the fit is outside the range of linear slosh. The measure is the wave height at the wall of an upright
/// cylinder divided by its radius, 2 α/(ξ² − 1), with the slosh angle α and the first zero ξ = 1.841 of J₁'.
fn regime(model: &str, angle: f64) -> Option<String> {
    let wave = 2.0 * angle / (XI[0] * XI[0] - 1.0);
    let (is, advice) = match Regime::from_ratio(wave) {
        _ if model == SloshModel::Frozen.name() => return None,
        Regime::Nonlinear => ("nonlinear", "less torque is better known"),
        Regime::Transitional if model == SloshModel::Linear.name() => {
            ("between linear and nonlinear", "--model planar,spherical tells whether that matters")
        }
        _ => return None,
    };
    Some(format!(
        "The slosh is {is}: the fit has a slosh angle up to {angle:.2} rad, a wave of {wave:.2} of the radius (linear up to 0.15, \
         nonlinear from 0.25); {advice}."
    ))
}

/// Adds a known value to `parameters` if the recordings determine it better than its tolerance does. Returns a sentence
/// about each added value.
fn shown(
    system: &BenchSystem,
    solution: &Solution,
    full: &Derived,
    parameters: &mut BTreeMap<String, Estimated>,
) -> Vec<String> {
    let mut sentences = Vec::new();
    let Fit { problem, free, .. } = &solution.fit;
    for (j, unknown) in problem.unknowns.iter().enumerate() {
        let found = full.tolerances.iter().find(|(name, _)| *name == unknown.name);
        let (Some((_, prior)), Some((name, draws))) = (unknown.prior, found) else { continue };
        let relative = deviation(draws);
        // the recordings contain at least as much information as the tolerance
        if !free[j] || !unknown.is_known() || relative > FRAC_1_SQRT_2 * prior {
            continue;
        }
        let (nominal, unit) = match &system.targets[j] {
            Target::Arm => (system.bench.arm, "m"),
            Target::Density => (system.bench.density, "kg/m3"),
            Target::Gravity => (system.bench.gravity, "m/s2"),
            _ => (1.0, "1"),
        };
        let value = nominal * unknown.value(solution.minimum.point.z[j]);
        let estimated = Estimated::normal(value, relative * value, unit);
        sentences.push(format!(
            "{name} is estimated within its tolerance, because the recordings determine it better than the tolerance: {value:.4e} ± {:.1e} {}.",
            estimated.std,
            prose(unit)
        ));
        parameters.insert(name.clone(), estimated);
    }
    sentences
}

fn rate_residuals(system: &BenchSystem, solution: &Solution) -> Vec<Residual> {
    let name = |signal: &Signal| system.recordings[signal.recording].name.clone();
    let all = residuals(solution, |signal| (name(signal), RATE.into()));
    let signals = solution.fit.problem.signals.iter();
    let rates = signals.zip(all).filter(|(signal, _)| signal.output == 0);
    let with_torque = |(signal, residual): (&Signal, Residual)| Residual {
        torque: Some(signal.picked(&system.recordings[signal.recording].torque)),
        ..residual
    };
    rates.map(with_torque).collect()
}

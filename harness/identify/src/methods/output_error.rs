//! Output-error fit of the FMU in the time domain: the whole way from recordings to parameters with their uncertainty,
//! and to words.

mod page;

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::{Result, ensure};
use formulas::cylinder::XI;
use formulas::regime::Regime;
use host::fmu::Fmu;
use nalgebra::{DMatrix, DVector};
use names::hubslosh::SloshModel::{self, Frozen, Linear, Planar, Spherical};
use names::hubslosh::{self, FrictionModel};
use rayon::prelude::*;

use super::identification::{Details, Identification};
use super::{Method, Needs, Task};
use crate::estimate::Estimated;
use crate::fit::bench::between::{self, Others};
use crate::fit::bench::candidate::{self, Fitted, ModelFit};
use crate::fit::bench::friction;
use crate::fit::bench::goodness::{fit_pct, is_poor, tests};
use crate::fit::bench::options::Options;
use crate::fit::bench::problem::{self, Answer, Differences, Polished, Problem};
use crate::fit::bench::start::{self, Response};
use crate::fit::covariance::{self, Covariance, directions};
use crate::fit::evidence;
use crate::input::plausible;
use crate::input::recording::Recording;
use crate::input::tolerance::{self, Share};
use crate::model::bench::breaking;
use crate::model::bench::unknown::{Quantity, Unknown};
use crate::news::{News, Since};
use crate::tuning::{
    BEGINNINGS, BIC_ALIKE, BIC_DECIDES, CONVERGED, GOES_ON, LONG_RECORDING, ONE_WAY, ROUNDS,
    SANDWICH_WINDOW, STUDY_REACH,
};
use crate::uncertainty::bench::budget::{self, Effect, Slope};
use crate::uncertainty::bench::cause;
use crate::uncertainty::bench::deep_tank;
use crate::uncertainty::bench::missing;
use crate::uncertainty::bench::sources::{self, Sources};
use crate::words::identified::{Identified, Residual};
use crate::words::page::{RATE, Sections};
use crate::words::start_study::{self, Trial};
use crate::words::verdict::{self, Findings};

/// The FMU fitted in the time domain.
pub struct OutputError {
    /// Options of the fit.
    pub options: Options,
}

impl Method for OutputError {
    type Details = Details;

    const NEEDS: Needs = Needs { fmu: true, validation: true };

    fn identify(&self, task: &Task, progress: &mut dyn FnMut(&News)) -> Result<Identification> {
        let options = Options { validation: task.validation.to_vec(), ..self.options.clone() };
        identify(task.fmu()?, task.recordings, &options, progress)
    }

    fn lines(found: &Identification) -> Vec<String> {
        let Details { fit, condition, seconds, .. } = &found.details;
        vec![format!(
            "fit {:.3} %, noise {:.2e} rad/s, condition number {condition:.0}, {:.0} simulations in {seconds:.1} s",
            fit.fit_pct, fit.noise_white, fit.simulations
        )]
    }

    fn sections(found: &Identification) -> Sections {
        page::sections(found)
    }
}

/// Slosh models in the order in which they are fitted.
const ORDER: [&str; 4] = [Linear.name(), Planar.name(), Spherical.name(), Frozen.name()];

/// Slosh models, the simplest first.
const SIMPLEST: [&str; 4] = [Frozen.name(), Linear.name(), Planar.name(), Spherical.name()];

/// Identifies the FMU from recordings. `progress` receives each message.
pub fn identify(
    fmu: &Fmu,
    recordings: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(&News),
) -> Result<Identification> {
    let mut found = identify_whole(fmu, recordings, options, progress)?;
    let angle = found.details.slosh_angle;
    let breaks = breaking::steepness(angle) >= breaking::least();
    let is_asked = options.breaking;
    let options = &Options { breaking: is_asked && breaks, ..options.clone() };
    let is_set = |name: &str| options.settings.iter().any(|(other, _)| other == name);
    if is_asked && !breaks {
        found = identify_whole(fmu, recordings, options, progress)?;
        found
            .verdict
            .push(format!("slosh.zeta_breaking is not estimated: {}.", breaking::never(angle)));
    } else if breaks && !is_asked && !is_set(hubslosh::slosh::ZETA_BREAKING) {
        found.verdict.push(format!(
            "The fit's waves reach a steepness k a of {:.2} ({:.1}°), and waves break from {:.2} on: --breaking estimates this damping.",
            breaking::steepness(angle),
            angle.to_degrees(),
            breaking::least()
        ));
    }
    if let ([recording], Some(false), true) = (recordings, found.fits, found.details.fit.poor) {
        found.verdict.extend(fitting_beginning(fmu, recording, options, progress));
    }
    Ok(found)
}

/// The longest beginning of a recording that a model fits, in words.
fn fitting_beginning(
    fmu: &Fmu,
    recording: &Recording,
    options: &Options,
    progress: &mut dyn FnMut(&News),
) -> Option<String> {
    let options = Options { validation: Vec::new(), ..options.clone() };
    let mut longest = None;
    for part in BEGINNINGS.map(|fraction| recording.beginning(fraction)) {
        let end = part.time[part.time.len() - 1];
        if part.duration() < LONG_RECORDING {
            continue;
        }
        progress(&News::Step(format!(
            "no model fits the whole recording; the rows until {end:.0} s"
        )));
        match identify_whole(fmu, &[part], &options, &mut |_| {}) {
            Ok(found) if found.fits == Some(true) && found.converged => {
                longest = Some((end, found));
            }
            _ => break,
        }
    }
    let (end, found) = longest?;
    Some(format!(
        "Until {end:.0} s the {} model fits the recording, and the residual is noise alone: --trim {:.0},{end:.0} gives parameters \
         that can be trusted. (Where slosh begins to rotate it is chaotic, and no fit follows it from there on.)",
        found.details.fit.model, recording.time[0]
    ))
}

fn identify_whole(
    fmu: &Fmu,
    recordings: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(&News),
) -> Result<Identification> {
    let begun = Instant::now();
    ensure!(!recordings.is_empty(), "there is no recording");
    let mut done = Vec::new();
    let mut tell = |news: News| {
        progress(&news);
        done.push(news.line().to_string());
    };
    let nominal = options.nominal(fmu)?;
    let mut doubts = Vec::new();
    for recording in recordings {
        let (notes, found) = plausible::columns(recording);
        notes.into_iter().for_each(|line| tell(News::Step(line)));
        doubts.extend(found);
    }
    let (response, starts) = start::from_data(recordings, &nominal)?;
    // the response is that of a hub with slosh
    if let (Some(found), true) = (&response, options.models.iter().any(|m| *m != Frozen.name())) {
        plausible::check_size(found.inertia, nominal.inertia)?;
    }
    let said = response.as_ref().map(Response::line);
    tell(News::Step(said.unwrap_or("frequency response: no slosh in it".into())));
    for (number, start) in starts.iter().enumerate() {
        let line = format!("start {}: {}", number + 1, start.line());
        tell(if number == 0 { News::Step(line) } else { News::Detail(line) });
    }
    // the slosh models with the first friction law, each from the best so far
    let law = options.friction.first().map_or(FrictionModel::Stribeck.name(), String::as_str);
    let (mut fitted, mut failed): (Vec<Fitted>, _) = (Vec::new(), None);
    for model in ORDER.into_iter().filter(|model| options.models.iter().any(|m| m == model)) {
        if model != SloshModel::Frozen.name() && response.is_none() && options.starts.is_empty() {
            tell(News::Step(format!("{model}: not tried because the data show no slosh")));
            continue;
        }
        let from = fitted.iter().min_by(|a, b| a.fit.bic.total_cmp(&b.fit.bic));
        match candidate::fit(fmu, recordings, options, (model, law), &starts, from, &mut tell) {
            Ok(one) => fitted.push(one),
            Err(error) => {
                tell(News::Step(format!("{model}: could not be fitted: {error:#}")));
                failed = Some(error);
            }
        }
    }
    if let (true, Some(error)) = (fitted.is_empty(), failed) {
        return Err(error);
    }
    ensure!(
        !fitted.is_empty(),
        "the data show no slosh (no antiresonance with a resonance above it in the excited band), and no \
         start was given"
    );
    let (near, slosh) = sort(&mut fitted);
    // other friction laws with the slosh model that was chosen
    let (first, mut others) = (&fitted[0], Vec::new());
    for law in options.friction.iter().skip(1) {
        let pair = (&*first.fit.model, law.as_str());
        let from = Some(first);
        others.push(candidate::fit(fmu, recordings, options, pair, &starts, from, &mut tell)?);
    }
    let laws: Vec<ModelFit> =
        std::iter::once(first).chain(&others).map(|f| f.fit.clone()).collect();
    let mut models: Vec<ModelFit> = fitted.iter().chain(&others).map(|f| f.fit.clone()).collect();
    // a law must be better than the first by what decides
    let (best, of_models) =
        match others.iter().position(|f| f.fit.bic < first.fit.bic - BIC_DECIDES) {
            Some(index) => (others.swap_remove(index), None),
            None => {
                let gained = of_models(&fitted[..near]);
                (fitted.swap_remove(0), Some(gained))
            }
        };
    let question =
        verdict::Question { slosh: &models[..slosh], near, laws: &laws, doubts: &doubts };
    let mut found = finish(best, of_models, &question, options, &mut tell)?;
    let details = &mut found.details;
    let fit = &details.fit;
    let chosen = models.iter().position(|m| *m.model == fit.model && m.friction == fit.friction);
    models.swap(0, chosen.unwrap_or(0));
    details.models = models;
    details.frequency_response = response;
    details.start = starts.first().copied();
    details.seconds = begun.elapsed().as_secs_f64();
    found.done = done;
    Ok(found)
}

/// Sorts the models by the information criterion; among equal ones the simplest comes first. Returns how many models are not
/// clearly worse than the first, and the number of models.
fn sort(fitted: &mut [Fitted]) -> (usize, usize) {
    fitted.sort_by(|a, b| a.fit.bic.total_cmp(&b.fit.bic));
    let within = |of: f64| fitted.iter().filter(|f| f.fit.bic < fitted[0].fit.bic + of).count();
    let (near, alike) = (within(BIC_DECIDES), within(BIC_ALIKE));
    fitted[..alike].sort_by_key(|f| SIMPLEST.iter().position(|model| *model == f.fit.model));
    (near, fitted.len())
}

/// Returns the covariance that the choice of a model adds to the first model's unknowns x: Σ p_k δ_k δ_kᵀ. p_k is the probability
/// of model k, δ_k the distance of its estimate from the first one.
fn of_models(near: &[Fitted]) -> DMatrix<f64> {
    let probabilities = evidence::probabilities(near.iter().map(|f| f.fit.bic));
    let (first, unknowns) = (&near[0].polished.x, &near[0].problem.unknowns);
    let mut gained = DMatrix::zeros(first.len(), first.len());
    for (other, probability) in near.iter().zip(probabilities).skip(1) {
        let difference = unknowns.iter().zip(first).map(|(unknown, x)| {
            let same = |u: &Unknown| u.quantity == unknown.quantity;
            let index = other.problem.unknowns.iter().position(same);
            index.map_or(0.0, |index| other.polished.x[index] - x)
        });
        let difference = DVector::from_iterator(first.len(), difference);
        gained += &difference * difference.transpose() * probability;
    }
    gained
}

/// The last steps with the gyro's scale as an unknown, covariance, error budget and words.
fn finish(
    best: Fitted,
    of_models: Option<DMatrix<f64>>,
    question: &verdict::Question,
    options: &Options,
    tell: &mut dyn FnMut(News),
) -> Result<Identification> {
    let Fitted { mut problem, polished, mut fit, mut speeds, others } = best;
    let (mut since, model) = (Since::default(), fit.model.clone());
    let mut say = |what: &str, problem: &Problem| {
        tell(News::Detail(since.line(format!("{model}: {what}"), problem.simulations())));
    };
    say("chosen", &problem);
    let (mut x, mut known) = (polished.x.clone(), polished.jacobian.clone());
    let place =
        |problem: &Problem| problem.unknowns.iter().position(|u| u.quantity == Quantity::GyroScale);
    if options.gyro_scale > 0.0 && place(&problem).is_none() {
        problem.unknowns.push(Unknown::gyro_scale().known(1.0, options.gyro_scale));
        x.push(0.0);
        // sensitivities to the scale are exact: no direction is needed for them
        let last = known.ncols();
        known = known.insert_column(last, 0.0);
    }
    if place(&problem).is_some() {
        // the gyro's scale is nearly a combination of the others: only exact sensitivities tell it from them
        problem.differences = Differences::Central;
    }
    let mut polished = problem.polish_from((&x, polished.answer), Some(&known), ROUNDS)?;
    // a search that ended elsewhere has taken what it left for noise
    if problem.renew_noise(&mut polished)? {
        polished = problem.polish_on(&polished, ROUNDS)?;
    }
    polished = problem.polish_at_kink(polished, ROUNDS)?;
    polished = on_to_the_end(&problem, polished)?;
    let way = one_way(&mut problem, &mut polished)?;
    let of_models = match &way {
        Some(OneWay { place, .. }) => {
            of_models.map(|gained| gained.remove_row(*place).remove_column(*place))
        }
        None => of_models,
    };
    let end = polished.decrement;
    say(&format!("the last steps, to {end:.4} standard deviations from the minimum"), &problem);
    let others = others.as_ref().filter(|_| way.is_none());
    let mut between_rows = torque_between_rows(&mut problem, &mut polished, others, options)?;
    say("other torques between rows", &problem);
    let (mut changes, mut findings) =
        judge(&problem, &polished, (&between_rows, question), options, &mut fit)?;
    say("tolerances, and torques that may be missing", &problem);
    let mut shown = if findings.fits(&fit) {
        Vec::new()
    } else {
        budget::shown(&problem, &polished, &changes)?
    };
    if !shown.is_empty() {
        let names: Vec<String> = shown.iter().map(|unknown| unknown.quantity.name()).collect();
        let names = names.join(", ");
        match with_unknowns(&problem, &polished, &shown, question, options, &fit) {
            Ok(other) if other.findings.fits(&other.fit) && other.fit.converged => {
                say(&format!("{names} within its tolerance explains the misfit"), &other.problem);
                Judged { problem, polished, between_rows, fit, changes, findings } = other;
                // they were found without these unknowns
                speeds.clear();
            }
            Ok(other) => {
                say(&format!("{names} does not explain the misfit"), &other.problem);
                shown.clear();
            }
            Err(error) => {
                say(&format!("{names} cannot be estimated: {error:#}"), &problem);
                shown.clear();
            }
        }
    }
    x.clone_from(&polished.x);
    let e = problem.stacked(&polished.answer, &x);
    let fits = findings.fits(&fit);
    if !fits {
        let law = fit.friction.clone();
        let found = cause::find(&problem, &polished.x, (&model, &law), &mut |line| {
            say(line, &problem);
        });
        findings.rivals = found.unwrap_or_else(|error| {
            say(&format!("the cause of the misfit cannot be sought: {error:#}"), &problem);
            Vec::new()
        });
    }
    let profile = friction::profile(&problem, &polished, &speeds)?;
    say("profile of the friction's curve", &problem);
    let Polished { jacobian, covariance, answer, .. } = polished;
    let (error_budget, modes_unknown) =
        budget::of(&problem, (&x, &answer), &jacobian, &covariance, &changes);
    say("higher slosh modes", &problem);
    let starts = start_study(&problem, &x, e.norm_squared(), options.start_study);
    say("other starts", &problem);
    fit.simulations = problem.simulations();
    let tolerances = budget::of_tolerances(&error_budget, x.len());
    let noise_only = match place(&problem) {
        Some(scale) => without(&problem, &jacobian, scale)?,
        None => None,
    };
    let noise_only = noise_only.unwrap_or_else(|| covariance.x.clone());
    let values = problem.values(&x);
    let slopes: Vec<f64> =
        problem.unknowns.iter().zip(&x).map(|(u, &x)| u.scale.slope(x)).collect();
    // of the values, and so of the variables
    let friction_curves = profile.as_ref().map(|profile| {
        let n = x.len();
        DMatrix::from_fn(n, n, |i, j| profile.covariance[(i, j)] / slopes[i] / slopes[j])
    });
    let sandwich =
        (!fits).then(|| covariance.sandwich(&jacobian, e.as_slice(), &windows(&problem)));
    // no estimate is further from the minimum than this part of its standard deviation
    let wider = 1.0 + fit.newton_decrement.powi(2);
    let noise = Sources {
        noise: &covariance.x,
        friction_curves: friction_curves.as_ref(),
        models: None,
        between_rows: None,
        tolerances: None,
        residual: None,
    };
    let full = Sources {
        models: of_models.as_ref(),
        between_rows: between_rows.gained.as_ref(),
        tolerances: Some(&tolerances),
        residual: sandwich.as_ref(),
        ..noise
    }
    .total()
        * wider;
    let noise = noise.total();
    let n = x.len();
    let mut more = between_rows.gained.clone().unwrap_or_else(|| DMatrix::zeros(n, n));
    if let Some(models) = &of_models {
        let mut first = more.view_mut((0, 0), models.shape());
        first += models;
    }
    let deep = deep_tank::Minimum {
        x: &x,
        answer: &answer,
        jacobian: &jacobian,
        e: &e,
        tolerances: changes.iter().map(|slope| &slope.change).collect(),
        more: &more,
        wider,
    };
    // of a residual that is more than noise the sandwich says more
    let deep = if fits { deep_tank::intervals(&problem, &deep)? } else { None };
    let of_values = DMatrix::from_fn(x.len(), x.len(), |i, j| full[(i, j)] * slopes[i] * slopes[j]);
    let fastest = problem::fastest(&answer.motion);
    let (mut parameters, mut measurement) = (BTreeMap::new(), BTreeMap::new());
    for (i, unknown) in problem.unknowns.iter().enumerate() {
        let ends = |covariance: &DMatrix<f64>| {
            [-1.96, 1.96].map(|reach| problem.end(&x, covariance, (i, reach), fastest))
        };
        let mut interval = ends(&full);
        if let Some(profile) = &profile {
            // the profile's ends, and what is not noise
            let of_noise = ends(&noise);
            for side in 0..2 {
                let off = |end: f64| (end - values[i]).powi(2);
                let more = (off(interval[side]) - off(of_noise[side])).max(0.0);
                let reach = (off(profile.intervals[i][side]) + more).sqrt();
                interval[side] = if side == 0 { values[i] - reach } else { values[i] + reach };
            }
            if unknown.is_positive() {
                interval[0] = interval[0].max(0.0);
            }
        }
        let of_deep = deep.iter().flat_map(|deep| &deep.0).find(|(place, _)| *place == i);
        if let Some((_, ends)) = of_deep {
            interval = *ends;
        }
        // an end that is open is 0 or infinite, whatever the range
        if interval[0] != 0.0 {
            interval[0] = interval[0].max(unknown.range[0]);
        }
        if interval[1].is_finite() {
            interval[1] = interval[1].min(unknown.range[1]);
        }
        // of a skew interval that of the longer side
        let reach = interval.map(|end| (end - values[i]).abs() / 1.96);
        let reach = reach.into_iter().filter(|reach| reach.is_finite()).fold(0.0, f64::max);
        let std = if of_deep.is_some() { reach } else { of_values[(i, i)].sqrt().max(reach) };
        let is_zero = !unknown.is_positive();
        let estimated = Estimated {
            value: values[i],
            std,
            std_noise: noise_only[(i, i)].sqrt() * slopes[i].abs(),
            interval,
            determined: is_zero || interval[1].is_finite() && std < 0.5 * values[i].abs(),
            unit: unknown.unit.clone(),
        };
        let name = unknown.quantity.name();
        match unknown.quantity {
            Quantity::Parameter(_) => parameters.insert(name, estimated),
            _ => measurement.insert(name, estimated),
        };
    }
    let mut combinations = sources::combinations(&problem.unknowns, &values, &of_values);
    if let Some(OneWay { way, range: bounds, .. }) = way {
        combinations.extend(sources::one_way(&mut parameters, way, bounds));
    }
    let shares = shares(&problem, &tolerances, &full, &error_budget);
    let names = problem.unknowns.iter().map(|u| u.quantity.name()).collect();
    let mut verdict =
        verdict::words(question, &findings, &fit, &combinations, &parameters, &error_budget);
    verdict.extend(shown.iter().filter_map(|unknown| {
        let name = unknown.quantity.name();
        Some(budget::shown_words(&name, parameters.get(&name)?))
    }));
    verdict.extend(shares);
    verdict.extend(budget::first_order(&changes));
    verdict.extend(modes_unknown);
    verdict.extend(start_study::words(&starts));
    let slosh_angle = if fit.model == Frozen.name() { 0.0 } else { largest_angle(&answer) };
    verdict.extend(regime(&fit.model, slosh_angle));
    let (converged, condition) = (fit.converged, covariance.condition);
    let (missing, cause) = (findings.missing().to_vec(), findings.cause().cloned());
    let details = Details {
        fit,
        combinations,
        condition,
        error_budget,
        missing,
        cause,
        starts,
        slosh_angle,
        ..Details::default()
    };
    Ok(Identification {
        parameters,
        measurement,
        settings: problem.setup.settings.iter().cloned().collect(),
        correlations: (names, Covariance::correlations(&full)),
        converged,
        fits: Some(fits),
        verdict,
        residuals: residuals(&problem, &answer),
        ..Identified::new(details)
    })
}

/// Judges a minimum: the tests of its residual, the effects of tolerances, and what the model lacks.
fn judge(
    problem: &Problem,
    found: &Polished,
    (between_rows, question): (&BetweenRows, &verdict::Question),
    options: &Options,
    fit: &mut ModelFit,
) -> Result<(Vec<Slope>, Findings)> {
    fit.fit_pct = fit_pct(problem, &found.answer);
    fit.tests = tests(problem, &found.answer);
    fit.poor = is_poor(problem, &found.answer);
    fit.noise_white = problem.channels[0].noise.white;
    fit.converged = found.decrement < CONVERGED;
    fit.newton_decrement = found.decrement;
    let changes = budget::slopes(problem, found, &options.tolerances)?;
    let e = problem.stacked(&found.answer, &found.x);
    let findings = Findings {
        rivals: Vec::new(),
        torque: between_rows.words.clone(),
        missing: missing::torques(problem, found, &e, &changes)?,
        doubts: question
            .doubts
            .iter()
            .cloned()
            .chain(acausal(problem, found, options))
            .chain(at_end(problem, &found.x))
            .collect(),
    };
    Ok((changes, findings))
}

/// A minimum of a problem, and what [`judge`] finds there.
struct Judged<'a> {
    problem: Problem<'a>,
    polished: Polished,
    between_rows: BetweenRows,
    fit: ModelFit,
    changes: Vec<Slope>,
    findings: Findings,
}

/// The problem with more unknowns, at its minimum.
fn with_unknowns<'a>(
    problem: &Problem<'a>,
    found: &Polished,
    more: &[Unknown],
    question: &verdict::Question,
    options: &Options,
    fit: &ModelFit,
) -> Result<Judged<'a>> {
    let (mut problem, mut fit, mut x) = (problem.clone(), fit.clone(), found.x.clone());
    x.extend(more.iter().map(|unknown| unknown.scale.variable(unknown.start)));
    problem.unknowns.extend(more.iter().cloned());
    let mut polished = problem.polish_from((&x, found.answer.clone()), None, ROUNDS)?;
    if problem.renew_noise(&mut polished)? {
        polished = problem.polish_on(&polished, ROUNDS)?;
    }
    polished = problem.polish_at_kink(polished, ROUNDS)?;
    polished = on_to_the_end(&problem, polished)?;
    let between_rows = torque_between_rows(&mut problem, &mut polished, None, options)?;
    let (changes, findings) =
        judge(&problem, &polished, (&between_rows, question), options, &mut fit)?;
    Ok(Judged { problem, polished, between_rows, fit, changes, findings })
}

/// Goes on with a search whose sets of sensitivities ran out before the minimum, as long as that lessens the sum of squares: two bent
/// valleys at once, of the friction's curve and of a deep tank's fill, take more sets than one.
fn on_to_the_end(problem: &Problem, mut found: Polished) -> Result<Polished> {
    for _ in 0..GOES_ON {
        if found.decrement < CONVERGED {
            break;
        }
        let before = found.cost;
        found = problem.polish_on(&found, ROUNDS)?;
        if found.cost >= before {
            break;
        }
    }
    Ok(found)
}

/// Ends of searches over the whole recordings that start with the tank's diameter or fill height off its estimate, or with inertia or
/// friction if there is no tank to fit. `cost`: sum of squares at the estimate x.
fn start_study(problem: &Problem, x: &[f64], cost: f64, count: usize) -> Vec<Trial> {
    let there = |names: &[&str]| -> Vec<usize> {
        names.iter().filter_map(|name| problem.index(name)).collect()
    };
    let mut places = there(&[hubslosh::tank::D, hubslosh::tank::H]);
    if places.is_empty() {
        let [b, c, d, speed] = [
            hubslosh::friction::B,
            hubslosh::friction::C,
            hubslosh::friction::D,
            hubslosh::friction::OMEGA_S,
        ];
        places = there(&[hubslosh::hub::I, b, c, d, speed]);
    }
    let starts = start_study::starts(count, STUDY_REACH);
    let one = |(place, factor): (usize, f64)| {
        let unknown = &problem.unknowns[place];
        let estimate = unknown.value(x[place]);
        let mut from = x.to_vec();
        from[place] = unknown.scale.variable(factor * estimate);
        let found = problem.search(&from, 0.0).ok();
        Trial {
            name: unknown.quantity.name(),
            start: factor,
            end: found.as_ref().map(|found| unknown.value(found.x[place]) / estimate),
            more: found.as_ref().map(|found| found.answer.1.norm_squared() - cost),
        }
    };
    let all: Vec<(usize, f64)> =
        places.iter().flat_map(|place| starts.iter().map(move |s| (*place, *s))).collect();
    all.into_par_iter().map(one).collect()
}

/// A hub that turned one way alone.
struct OneWay {
    /// 1 forwards, −1 backwards.
    way: f64,
    /// Allowed range of the asymmetry.
    range: [f64; 2],
    /// Former index among the unknowns.
    place: usize,
}

/// If the hub turns one way alone, only c (1 ± asymmetry) and d (1 ± asymmetry) act, and only vague priors separate the asymmetry
/// from c and d. The asymmetry is then not an unknown: the search fixes it at 0. A hub that turns both ways keeps it as an unknown,
/// however vague: there it says that dry friction is small, not that the friction of one direction is unknown.
fn one_way(problem: &mut Problem, found: &mut Polished) -> Result<Option<OneWay>> {
    const NAME: &str = hubslosh::friction::ASYMMETRY;
    let Some(place) = problem.index(NAME) else { return Ok(None) };
    let dry = [hubslosh::friction::C, hubslosh::friction::D].map(|name| problem.index(name));
    if dry.iter().flatten().next().is_none() {
        return Ok(None);
    }
    // vague priors of parameters do not count; that of the rate at the start stays, which nothing else may show
    let rows: usize = found.answer.residual.iter().map(Vec::len).sum();
    let priors = problem.unknowns.iter().filter(|unknown| unknown.prior.is_some());
    let mut jacobian = found.jacobian.clone();
    let is_vague = |unknown: &Unknown| unknown.vague && unknown.quantity.parameter().is_some();
    for (k, _) in priors.enumerate().filter(|(_, unknown)| is_vague(unknown)) {
        jacobian.row_mut(rows + k).fill(0.0);
    }
    let unknown = &problem.unknowns[place];
    let slope = unknown.scale.slope(found.x[place]).abs();
    // unknowns without influence, or others that are inseparable, do not widen it
    let std = directions(&jacobian, &problem.names())?.0.row(place).norm() * slope;
    if std < ONE_WAY || unknown.prior.is_some() {
        return Ok(None);
    }
    let rates = found.answer.motion.iter().flat_map(|motion| motion.rate.iter().copied());
    let Some(way) = sources::way(rates) else { return Ok(None) };
    let range = unknown.range;
    let factor = 1.0 + way * unknown.value(found.x[place]);
    let mut x = found.x.clone();
    for j in dry.into_iter().flatten() {
        let Unknown { scale, .. } = problem.unknowns[j];
        x[j] = scale.variable(scale.value(x[j]) * factor);
        if let Some((mean, deviation)) =
            problem.unknowns[j].prior.filter(|_| problem.unknowns[j].vague)
        {
            problem.unknowns[j].prior = Some((mean * factor, deviation * factor));
        }
    }
    x.remove(place);
    problem.unknowns.remove(place);
    let known = found.jacobian.clone().remove_column(place);
    let polished = problem.polish(&x, Some(&known), ROUNDS)?;
    *found = problem.polish_at_kink(polished, ROUNDS)?;
    Ok(Some(OneWay { way, range, place }))
}

/// Returns the largest slosh angle, rad.
fn largest_angle(answer: &Answer) -> f64 {
    let angles = answer.motion.iter().flat_map(|motion| &motion.slosh_angle);
    angles.fold(0.0_f64, |most, angle| most.max(angle.abs()))
}

/// Returns a warning if the fit leaves the range of linear slosh: the wave at the wall, 2 α R/(ξ² − 1), relative to the radius R
/// of an upright cylinder.
fn regime(model: &str, angle: f64) -> Option<String> {
    let wave = 2.0 * angle / (XI[0] * XI[0] - 1.0);
    let (is, advice) = match Regime::from_ratio(wave) {
        Regime::Nonlinear => ("nonlinear", "less torque is better known"),
        Regime::Transitional if model == SloshModel::Linear.name() => {
            ("between linear and nonlinear", "--model planar,spherical tells whether that matters")
        }
        _ => return None,
    };
    (model != SloshModel::Frozen.name()).then(|| {
        format!(
            "The slosh is {is}: the fit has a slosh angle up to {angle:.2} rad, a wave of {wave:.2} of the radius (linear up to 0.15, \
             nonlinear from 0.25); {advice}."
        )
    })
}

/// Returns sentences on the estimates whose uncertainty is due to tolerances more than to the recording.
fn shares(
    problem: &Problem,
    tolerances: &DMatrix<f64>,
    full: &DMatrix<f64>,
    effects: &[Effect],
) -> Option<String> {
    let mut all = Vec::new();
    for (i, unknown) in problem.unknowns.iter().enumerate() {
        let most = effects
            .iter()
            .filter(|effect| effect.tolerance)
            .max_by(|a, b| a.x[i].abs().total_cmp(&b.x[i].abs()));
        all.extend(most.map(|most| Share {
            name: unknown.quantity.name(),
            share: tolerances[(i, i)] / full[(i, i)],
            most: most.source.split(' ').next().unwrap_or_default().into(),
        }));
    }
    let known: Vec<String> = effects
        .iter()
        .filter(|effect| effect.tolerance)
        .map(|effect| effect.source.replace(" wrong by", ""))
        .collect();
    tolerance::shares(&known, &all)
}

/// Intersample behaviour of the torque, if it was free.
#[derive(Default)]
struct BetweenRows {
    /// Evidence in words.
    words: Vec<String>,
    /// Covariance added because another behaviour is possible.
    gained: Option<DMatrix<f64>>,
}

/// Judges once more what the torque does between rows, now that everything is free; problem and minimum are those of the best.
fn torque_between_rows(
    problem: &mut Problem,
    found: &mut Polished,
    before: Option<&Others>,
    options: &Options,
) -> Result<BetweenRows> {
    if options.intersample.is_some() || !between::matters(problem.recordings) {
        return Ok(BetweenRows::default());
    }
    let (step, acausal) = (problem.recordings[0].torque_step(), options.acausal);
    let mut others = between::alternatives(problem, found, before).all;
    if let Some(best) = between::better(found.cost, step, acausal, &others) {
        let before = std::mem::replace(&mut problem.setup.intersample, best.behaviour);
        let other = problem.polish_on(&best.minimum, ROUNDS)?;
        if other.cost < found.cost {
            *found = other;
            others = between::alternatives(problem, found, None).all;
        } else {
            problem.setup.intersample = before;
        }
    }
    let evidence = between::evidence(problem, found, step, acausal, &others);
    let delay = between::delay(problem, &found.x, &found.covariance);
    let half =
        delay.filter(|(late, _)| !between::is_found((found.cost, *late), step, acausal, &others));
    let half = half.and_then(|delay| between::half_a_row(delay, step));
    Ok(BetweenRows {
        words: std::iter::once(evidence).chain(half).collect(),
        gained: between::gained(found, step, acausal, &others),
    })
}

/// A rate that comes before the torque, if that is not allowed, in words.
fn acausal(problem: &Problem, found: &Polished, options: &Options) -> Option<String> {
    let (delay, std) = between::delay(problem, &found.x, &found.covariance)?;
    let step = problem.recordings[0].torque_step();
    (!options.acausal && between::is_acausal((delay, std), step)).then(|| {
        format!(
            "the rate comes {:.2} ± {:.2} ms before the torque: check the time stamps and the torque between rows (--torque; \
             --acausal allows it)",
            -1e3 * delay,
            1e3 * std
        )
    })
}

/// Unknowns that only the FMU's range keeps from going on, in words.
fn at_end(problem: &Problem, x: &[f64]) -> Vec<String> {
    let unknowns = problem.unknowns.iter().zip(x).filter(|(unknown, x)| unknown.is_at_end(**x));
    let words = |(unknown, x): (&Unknown, &f64)| {
        let [low, high] = unknown.range;
        format!(
            "{} = {:.4e} is at the end of the range that the FMU allows, {low} to {high}",
            unknown.quantity.name(),
            unknown.value(*x)
        )
    };
    unknowns.map(words).collect()
}

fn residuals(problem: &Problem, answer: &Answer) -> Vec<Residual> {
    let rates = problem.channels.iter().zip(&answer.residual);
    rates
        .filter(|(channel, _)| channel.signal == crate::fit::bench::problem::Signal::Rate)
        .map(|(channel, residual)| {
            let recording = &problem.recordings[channel.recording];
            Residual {
                name: recording.name.clone(),
                label: RATE.into(),
                time: recording.time.clone(),
                measured: recording.rate.clone(),
                residual: residual.clone(),
                noise: Some(channel.noise.white),
                torque: Some(recording.torque.clone()),
            }
        })
        .collect()
}

/// Rows of the windows of the sandwich.
fn windows(problem: &Problem) -> Vec<(usize, usize)> {
    let recordings = problem.channels.iter().map(|channel| &problem.recordings[channel.recording]);
    covariance::windows(recordings.map(|r| (r.time.len(), r.step())), SANDWICH_WINDOW)
}

/// The covariance if the unknown at `place` were known exactly; its row and column are 0.
fn without(
    problem: &Problem,
    jacobian: &DMatrix<f64>,
    place: usize,
) -> Result<Option<DMatrix<f64>>> {
    let mut names = problem.names();
    names.remove(place);
    let rest = Covariance::of(&jacobian.clone().remove_column(place), &names)?;
    Ok(rest.map(|rest| rest.x.insert_row(place, 0.0).insert_column(place, 0.0)))
}

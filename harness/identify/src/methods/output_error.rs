//! Output-error fit of the FMU in the time domain: from recordings to parameters with their uncertainty and a verdict.

use std::time::Instant;

use anyhow::{Result, ensure};
use host::fmu::Fmu;
use names::hubslosh::FrictionModel;
use names::hubslosh::SloshModel::{Frozen, Linear, Planar, Spherical};
use names::hubslosh::{self};

use crate::bench::answer::{self, Fitted, conclude};
use crate::bench::breaking;
use crate::bench::identification::{Identification, ModelFit};
use crate::bench::options::Options;
use crate::bench::problem;
use crate::bench::start::{self, Response};
use crate::bench::system::BenchSystem;
use crate::bench::verdict;
use crate::engine::search::solve;
use crate::engine::{ALIKE, DECIDES, Problem};
use crate::input::plausible;
use crate::input::recording::Recording;
use crate::news::News;
use crate::tuning::{BEGINNINGS, LONG_RECORDING};

const ORDER: [&str; 4] = [Linear.name(), Planar.name(), Spherical.name(), Frozen.name()];

const SIMPLEST: [&str; 4] = [Frozen.name(), Linear.name(), Planar.name(), Spherical.name()];

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
            "The fit's waves reach a steepness k a of {:.2} ({:.1}°), and waves break from {:.2} on: --also breaking estimates this damping.",
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

/// Returns a sentence that says up to which time a model fits a recording, if a model fits its beginning but not the whole.
/// Returns `None` if no model fits a beginning.
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
    // the result contains a frequency response only if the data show a hub with slosh
    if let (Some(found), true) = (&response, options.models.iter().any(|m| *m != Frozen.name())) {
        plausible::check_size(found.inertia, nominal.inertia)?;
    }
    let said = response.as_ref().map(Response::line);
    tell(News::Step(said.unwrap_or("frequency response: it shows no slosh".into())));
    for (number, start) in starts.iter().enumerate() {
        let line = format!("start {}: {}", number + 1, start.line());
        tell(if number == 0 { News::Step(line) } else { News::Detail(line) });
    }
    // all slosh models with the first friction law, then the other laws with the best slosh model
    let first = options.friction.first().map_or(FrictionModel::Stribeck.name(), String::as_str);
    let laws = std::iter::once(first).chain(options.friction.iter().skip(1).map(String::as_str));
    let is_asked = |model: &&str| options.models.iter().any(|other| other == model);
    let has_start = response.is_some() || !options.starts.is_empty();
    let (models, others): (Vec<&str>, Vec<&str>) =
        ORDER.into_iter().filter(is_asked).partition(|model| has_start || *model == Frozen.name());
    for model in others {
        tell(News::Step(format!("{model}: not tried because the data show no slosh")));
    }
    let with_law = |law| models.iter().map(move |model| (*model, law));
    let pairs: Vec<(&str, &str)> = laws.flat_map(with_law).collect();
    ensure!(
        !pairs.is_empty(),
        "the data show no slosh (no antiresonance with a resonance above it in the excited band), and no \
         start was given"
    );
    let systems =
        pairs.iter().map(|pair| problem::system(fmu, recordings, options, *pair, &starts));
    let systems = systems.collect::<Result<Vec<_>>>()?;
    let problems = systems.iter().map(|(system, unknowns, starts)| {
        problem::problem(system, unknowns.clone(), starts.clone(), options)
    });
    let problems: Vec<Problem> = problems.collect();
    let mut failed = None;
    let mut fit = |pair: (&str, &str), from: Option<&Fitted>, tell: &mut dyn FnMut(News)| {
        let number = pairs.iter().position(|other| *other == pair)?;
        let (system, problem) = (&systems[number].0, &problems[number]);
        let hold = |other: &Fitted| other.solution.fit.hold;
        let extra = from.map(|other| (transferred(other, system, problem), hold(other)));
        let ceiling = from.map_or(f64::INFINITY, |other| other.solution.ceiling());
        let found = solve(problem, extra, ceiling, &mut |news| {
            tell(News::Detail(format!("{}: {}", pair.0, news.line())));
        });
        match found {
            Ok(solution) => {
                let fit = answer::summary(&solution, pair);
                tell(News::Step(fit.line()));
                Some(Fitted { system, solution, fit })
            }
            Err(error) => {
                tell(News::Step(format!("the model {} could not be fitted: {error:#}", pair.0)));
                failed = Some(error);
                None
            }
        }
    };
    let mut fitted: Vec<Fitted> = Vec::new();
    for pair in pairs.iter().filter(|(_, law)| *law == first) {
        let from = fitted.iter().min_by(|a, b| a.fit.bic.total_cmp(&b.fit.bic));
        let found = fit(*pair, from, &mut tell);
        fitted.extend(found);
    }
    let mut others = Vec::new();
    let mut near = 0;
    let slosh = fitted.len();
    if slosh > 0 {
        near = sort(&mut fitted);
        let model = fitted[0].fit.model.clone();
        for pair in pairs.iter().filter(|(other, law)| *law != first && *other == model) {
            let found = fit(*pair, fitted.first(), &mut tell);
            others.extend(found);
        }
    }
    if let (true, Some(error)) = (fitted.is_empty(), failed) {
        return Err(error);
    }
    for one in fitted.iter_mut().chain(&mut others) {
        one.fit.validation_pct = answer::validate(one.system, &one.solution, &options.validation)?;
    }
    let laws: Vec<ModelFit> =
        fitted.first().into_iter().chain(&others).map(|f| f.fit.clone()).collect();
    let mut models: Vec<ModelFit> = fitted.iter().chain(&others).map(|f| f.fit.clone()).collect();
    // another law replaces the first only if it is clearly better
    let other = others.iter().position(|f| f.fit.bic < fitted[0].fit.bic - DECIDES);
    let probabilities = verdict::probabilities(fitted[..near].iter().map(|f| f.fit.bic));
    let question =
        verdict::Question { slosh: &models[..slosh], near, laws: &laws, doubts: &doubts };
    let (best, mut rivals) = match other {
        Some(index) => (others.swap_remove(index), Vec::new()),
        None => {
            fitted.truncate(near);
            let best = fitted.remove(0);
            (best, probabilities[1..].iter().copied().zip(fitted).collect())
        }
    };
    let own = if rivals.is_empty() { 1.0 } else { probabilities[0] };
    let mut found = conclude(best, (own, &mut rivals), &question, &mut tell)?;
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

/// Returns a start for `problem` from the minimum of another model. An unknown that the other model lacks starts at the
/// start value in `problem`.
fn transferred(from: &Fitted, to: &BenchSystem, problem: &Problem) -> Vec<f64> {
    let values = from.solution.fit.values(&from.solution.minimum.point.z);
    let mut start = problem.starts[0].clone();
    for (value, target) in start.iter_mut().zip(&to.targets) {
        if let Some(other) = from.system.value(&values, target) {
            *value = other;
        }
    }
    start
}

/// Sorts the models by the Bayesian information criterion; among equal ones the simplest comes first. Returns the number of
/// models that are not clearly worse than the first.
fn sort(fitted: &mut [Fitted]) -> usize {
    fitted.sort_by(|a, b| a.fit.bic.total_cmp(&b.fit.bic));
    let within = |of: f64| fitted.iter().filter(|f| f.fit.bic < fitted[0].fit.bic + of).count();
    let (near, alike) = (within(DECIDES), within(ALIKE));
    fitted[..alike].sort_by_key(|f| SIMPLEST.iter().position(|model| *model == f.fit.model));
    near
}

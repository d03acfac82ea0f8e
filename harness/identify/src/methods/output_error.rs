//! Output-error fit of the FMU in the time domain: the whole way from recordings to parameters with their uncertainty,
//! and to words.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::{Result, ensure};
use host::fmi2::Fmu;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::{Identified, Method, Needs, Residual, Task, page};
use crate::budget::{self, Effect};
use crate::candidate::{self, Fitted, ModelFit};
use crate::estimate::Estimated;
use crate::fit::{Answer, Differences, Problem};
use crate::nominal::Start;
use crate::options::Options;
use crate::plausible;
use crate::recording::{self, Recording};
use crate::residual::Tests;
use crate::start::{self, Response};
use crate::uncertainty::{self, Combination, Covariance, Sources};
use crate::unknown::{Quantity, Unknown};
use crate::verdict::{self, DECIDES};

/// The FMU fitted in the time domain.
pub struct OutputError {
    /// What is asked for.
    pub options: Options,
}

/// The result.
pub type Identification = Identified<Details>;

/// What this method alone has to say.
#[derive(Clone, Debug, Serialize)]
pub struct Details {
    /// The chosen model's fit.
    pub fit: ModelFit,
    /// Sums that are known where their terms are not.
    pub combinations: Vec<Combination>,
    /// Condition number of the sensitivities.
    pub condition: f64,
    /// The error budget.
    pub error_budget: Vec<Effect>,
    /// All models that were tried, the chosen one first.
    pub models: Vec<ModelFit>,
    /// What the frequency response says.
    pub frequency_response: Option<Response>,
    /// Starts from the data.
    pub start: Option<Start>,
    /// Wall time, s.
    pub seconds: f64,
}

impl Method for OutputError {
    type Details = Details;

    const NEEDS: Needs = Needs { fmu: true, validation: true };

    fn identify(&self, task: &Task, heard: &mut dyn FnMut(&str)) -> Result<Identification> {
        let options = Options { validation: task.validation.to_vec(), ..self.options.clone() };
        identify(task.fmu()?, task.recordings, &options, heard)
    }

    fn lines(found: &Identification) -> Vec<String> {
        let Details { fit, condition, seconds, .. } = &found.details;
        vec![format!(
            "fit {:.3} %, noise {:.2e} rad/s, condition number {condition:.0}, {} answers of the FMU in {seconds:.1} s",
            fit.fit_pct, fit.noise_white, fit.simulations
        )]
    }

    const HAS_PAGE: bool = true;

    fn page(found: &Identification) -> Option<String> {
        Some(page::of(found))
    }
}

/// Difference below which the simpler model is taken (not worth more than a bare mention, ibid.).
const ALIKE: f64 = 2.0;

/// From the simplest slosh model to the richest.
const SIMPLEST: [&str; 5] = ["frozen", "linear", "planar", "spherical", "paraboloid"];

/// Beginnings that are tried where the whole recording is not described, as fractions of its rows.
const BEGINNINGS: [f64; 2] = [0.35, 0.5];

/// Identifies the FMU from recordings. `heard` is told what happens.
pub fn identify(
    fmu: &Fmu,
    recordings: &[Recording],
    options: &Options,
    heard: &mut dyn FnMut(&str),
) -> Result<Identification> {
    let mut found = identify_whole(fmu, recordings, options, heard)?;
    if let ([recording], Some(false), true) = (recordings, found.described, found.details.fit.poor)
    {
        found.verdict.extend(described_beginning(fmu, recording, options, heard));
    }
    Ok(found)
}

/// The longest beginning of a recording that a model describes, in words.
fn described_beginning(
    fmu: &Fmu,
    recording: &Recording,
    options: &Options,
    heard: &mut dyn FnMut(&str),
) -> Option<String> {
    let options = Options { validation: Vec::new(), ..options.clone() };
    let mut longest = None;
    for part in BEGINNINGS.map(|fraction| recording.beginning(fraction)) {
        let end = part.time[part.time.len() - 1];
        if part.duration() < recording::SHORTEST {
            continue;
        }
        heard(&format!("no model describes the whole recording; the rows until {end:.0} s"));
        match identify_whole(fmu, &[part], &options, &mut |_| {}) {
            Ok(found) if found.described == Some(true) && found.converged => {
                longest = Some((end, found));
            }
            _ => break,
        }
    }
    let (end, found) = longest?;
    Some(format!(
        "Until {end:.0} s the {} model describes the recording, and leaves noise alone: --trim {:.0},{end:.0} gives parameters \
         that can be trusted. (Where slosh begins to rotate it is chaotic, and no fit follows it from there on.)",
        found.details.fit.model, recording.time[0]
    ))
}

fn identify_whole(
    fmu: &Fmu,
    recordings: &[Recording],
    options: &Options,
    heard: &mut dyn FnMut(&str),
) -> Result<Identification> {
    let begun = Instant::now();
    ensure!(!recordings.is_empty(), "there is no recording");
    let mut done = Vec::new();
    let mut say = |line: String, done: &mut Vec<String>| {
        heard(&line);
        done.push(line);
    };
    let nominal = options.nominal(fmu)?;
    let mut doubts = Vec::new();
    for recording in recordings {
        let (notes, found) = plausible::columns(recording);
        notes.into_iter().for_each(|line| say(line, &mut done));
        doubts.extend(found);
    }
    let (response, starts) = start::from_data(recordings, &nominal)?;
    let start = starts[0];
    if let Some(found) = &response {
        plausible::check_size(found, nominal.inertia)?;
        say(
            format!(
                "frequency response: slosh at {:.4} Hz, damping ratio {:.4}, resonance at {:.4} Hz, \
                 slosh mass {:.3} kg, inertia {:.4} kg.m2",
                found.slosh_frequency,
                found.slosh_damping,
                found.resonance_frequency,
                found.slosh_mass,
                found.inertia
            ),
            &mut done,
        );
    } else {
        say("frequency response: no slosh in it".into(), &mut done);
    }

    say(
        format!(
            "starts: d {:.4} m, h {:.4} m, damping ratio {:.4}, hub.I {:.4} kg.m2",
            start.d, start.h, start.zeta, start.hub_inertia
        ),
        &mut done,
    );
    let (mut fitted, mut failed): (Vec<Fitted>, _) = (Vec::new(), None);
    let order = ["linear", "planar", "spherical", "paraboloid", "frozen"];
    let wanted = |model: &&str| options.models.iter().any(|m| m == model);
    for model in order.into_iter().filter(wanted) {
        if model != "frozen" && response.is_none() && options.starts.is_empty() {
            say(format!("{model}: not tried, the data show no slosh to start from"), &mut done);
            continue;
        }
        let law = options.friction.first().map_or("stribeck", String::as_str);
        let from = fitted.iter().min_by(|a, b| a.fit.bic.total_cmp(&b.fit.bic));
        let one =
            candidate::fit(fmu, recordings, options, (model, law), &starts, from, &mut |line| {
                say(line, &mut done);
            });
        match one {
            Ok(one) => {
                say(one.fit.line(), &mut done);
                fitted.push(one);
            }
            Err(error) => {
                say(format!("{model}: could not be fitted: {error:#}"), &mut done);
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
    let rank = |f: &Fitted| SIMPLEST.iter().position(|s| *s == f.fit.model);
    let alike = sort(&mut fitted, &rank);
    // other friction laws with the slosh model that was chosen
    let mut friction = Vec::new();
    for law in options.friction.iter().skip(1) {
        let model = fitted[0].fit.model.clone();
        let from = fitted.first();
        let one =
            candidate::fit(fmu, recordings, options, (&model, law), &starts, from, &mut |line| {
                say(line, &mut done);
            })?;
        say(one.fit.line(), &mut done);
        friction.push(one);
    }
    let mut laws = vec![fitted[0].fit.clone()];
    laws.extend(friction.iter().map(|f| f.fit.clone()));
    let mut models: Vec<ModelFit> = fitted.iter().map(|f| f.fit.clone()).collect();
    models.extend(friction.iter().map(|f| f.fit.clone()));
    // a law must be better than the first by what decides
    let least = friction.iter().position(|f| f.fit.bic < fitted[0].fit.bic - DECIDES);
    let (best, of_models) = match least {
        Some(place) => (friction.swap_remove(place), None),
        None => {
            let gained = of_models(&fitted[..alike.0]);
            (fitted.swap_remove(0), Some(gained))
        }
    };
    let question = verdict::Question {
        slosh: &models[..alike.1],
        near: alike.0,
        laws: &laws,
        doubts: &doubts,
    };
    let mut found = finish(best, of_models, &question, options)?;
    let fit = &found.details.fit;
    let chosen = models.iter().position(|m| *m.model == fit.model && m.friction == fit.friction);
    models.swap(0, chosen.unwrap_or(0));
    let details = &mut found.details;
    details.models = models;
    details.frequency_response = response;
    details.start = Some(start);
    details.seconds = begun.elapsed().as_secs_f64();
    found.done = done;
    Ok(found)
}

/// Sorts by the information criterion, the simplest first among those that it does not tell apart at all. Returns how
/// many cannot be told from the first with certainty, and how many there are in all.
fn sort(fitted: &mut [Fitted], rank: &dyn Fn(&Fitted) -> Option<usize>) -> (usize, usize) {
    fitted.sort_by(|a, b| a.fit.bic.total_cmp(&b.fit.bic));
    let within = |of: f64| fitted.iter().filter(|f| f.fit.bic < fitted[0].fit.bic + of).count();
    let (near, alike) = (within(DECIDES), within(ALIKE));
    fitted[..alike].sort_by_key(rank);
    (near, fitted.len())
}

/// What the covariance of the first model's unknowns x gains because it may be one of the others: Σ p_k δ_k δ_kᵀ, with p_k
/// the probability of model k and δ_k how far its estimate is from the first's.
fn of_models(near: &[Fitted]) -> DMatrix<f64> {
    let probabilities = verdict::probabilities(near.iter().map(|f| f.fit.bic));
    let (first, unknowns) = (&near[0].polished.x, &near[0].problem.unknowns);
    let mut gained = DMatrix::zeros(first.len(), first.len());
    for (other, probability) in near.iter().zip(probabilities).skip(1) {
        let difference = unknowns.iter().zip(first).map(|(unknown, x)| {
            let same = |u: &Unknown| u.quantity == unknown.quantity;
            let place = other.problem.unknowns.iter().position(same);
            place.map_or(0.0, |place| other.polished.x[place] - x)
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
) -> Result<Identification> {
    let Fitted { mut problem, polished, mut fit, spread } = best;
    let (mut x, mut known) = (polished.x.clone(), polished.jacobian.clone());
    let scale_is_unknown = options.gyro_scale > 0.0;
    if scale_is_unknown {
        problem.unknowns.push(Unknown::gyro_scale().known(1.0, options.gyro_scale));
        x.push(0.0);
        // sensitivities to the scale are exact: no direction is needed for them
        let place = known.ncols();
        known = known.insert_column(place, 0.0);
    }
    // the gyro's scale is nearly a combination of the others: only exact sensitivities tell it from them
    problem.differences = Differences::Central;
    let polished = problem.polish(&x, Some(&known), 3)?;
    fit.simulations += polished.simulations;
    fit.converged = polished.converged();
    fit.newton_decrement = polished.decrement;
    x = polished.x;
    let (jacobian, covariance, answer) = (polished.jacobian, polished.covariance, polished.answer);
    let described = fit.tests.iter().all(Tests::passed) && question.doubts.is_empty();
    let noise_only = match scale_is_unknown {
        true => without_last(&jacobian).unwrap_or_else(|| covariance.x.clone()),
        false => covariance.x.clone(),
    };
    let values = problem.values(&x);
    let slopes: Vec<f64> =
        problem.unknowns.iter().zip(&x).map(|(u, &x)| u.scale.slope(x)).collect();
    // of the values, and so of the variables
    let friction_curves = spread.as_ref().map(|spread| {
        let n = spread.nrows();
        DMatrix::from_fn(n, n, |i, j| spread[(i, j)] / slopes[i] / slopes[j])
    });
    let sandwich = (!described).then(|| {
        let e = problem.stacked(&answer, &x);
        covariance.sandwich(&jacobian, e.as_slice(), &windows(&problem))
    });
    let full = Sources {
        noise: &covariance.x,
        noise_alone: &noise_only,
        friction_curves: friction_curves.as_ref(),
        models: of_models.as_ref(),
        residual: sandwich.as_ref(),
    }
    .total();
    let of_values = DMatrix::from_fn(x.len(), x.len(), |i, j| full[(i, j)] * slopes[i] * slopes[j]);
    let (mut parameters, mut measurement) = (BTreeMap::new(), BTreeMap::new());
    for (i, unknown) in problem.unknowns.iter().enumerate() {
        let deviation = full[(i, i)].sqrt();
        let end = |side: f64| match &spread {
            // too wide for a linear map of x
            Some(_) if unknown.is_positive() => {
                (values[i] + side * 1.96 * of_values[(i, i)].sqrt()).max(0.0)
            }
            _ => unknown.scale.value(x[i] + side * 1.96 * deviation),
        };
        let estimated = Estimated {
            value: values[i],
            std: of_values[(i, i)].sqrt(),
            std_noise: noise_only[(i, i)].sqrt() * slopes[i].abs(),
            interval: [end(-1.0), end(1.0)],
            unit: unknown.unit.clone(),
        };
        let name = unknown.quantity.name();
        match unknown.quantity {
            Quantity::Parameter(_) => parameters.insert(name, estimated),
            _ => measurement.insert(name, estimated),
        };
    }
    let combinations = uncertainty::combinations(&problem.unknowns, &values, &of_values);
    let error_budget = budget::of(&problem, &x, &answer, &jacobian, &covariance)?;
    let matrix = Covariance::correlations(&full);
    let names = problem.unknowns.iter().map(|u| u.quantity.name()).collect();
    let correlations = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
    let verdict =
        verdict::words(question, described, &fit, &combinations, &parameters, &error_budget);
    Ok(Identification {
        parameters,
        measurement,
        settings: problem.setup.settings.iter().cloned().collect(),
        correlations: (names, correlations),
        converged: fit.converged,
        described: Some(described),
        verdict,
        done: Vec::new(),
        residuals: residuals(&problem, &answer),
        details: Details {
            fit,
            combinations,
            condition: covariance.condition,
            error_budget,
            models: Vec::new(),
            frequency_response: None,
            start: None,
            seconds: 0.0,
        },
    })
}

fn residuals(problem: &Problem, answer: &Answer) -> Vec<Residual> {
    let rates = problem.channels.iter().zip(&answer.residual);
    rates
        .filter(|(channel, _)| channel.signal == crate::fit::Signal::Rate)
        .map(|(channel, residual)| {
            let recording = &problem.recordings[channel.recording];
            Residual {
                name: recording.name.clone(),
                time: recording.time.clone(),
                measured: recording.rate.clone(),
                residual: residual.clone(),
            }
        })
        .collect()
}

/// Rows of the windows of the sandwich.
fn windows(problem: &Problem) -> Vec<(usize, usize)> {
    let mut windows = Vec::new();
    let mut first = 0;
    for channel in &problem.channels {
        let recording = &problem.recordings[channel.recording];
        let rows = recording.time.len();
        let width = ((uncertainty::WINDOW / recording.step()) as usize).clamp(1, rows);
        windows
            .extend((0..rows).step_by(width).map(|k| (first + k, first + (k + width).min(rows))));
        first += rows;
    }
    windows
}

/// The covariance if the last unknown were known exactly; its row and column are 0.
fn without_last(jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let place = jacobian.ncols() - 1;
    let rest = Covariance::of(&jacobian.clone().remove_column(place))?.x;
    Some(rest.insert_row(place, 0.0).insert_column(place, 0.0))
}

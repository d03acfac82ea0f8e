//! One model that may explain the recordings: a slosh model with a friction law, fitted.

use anyhow::{Result, ensure};
use host::fmi2::Fmu;
use nalgebra::DMatrix;
use serde::Serialize;

use crate::fit::{Answer, Channel, Polished, Problem, Signal, WHOLE, WINDOWS};
use crate::friction;
use crate::nominal::Start;
use crate::options::Options;
use crate::recording::Recording;
use crate::residual::Tests;
use crate::simulate::{Intersample, Setup};
use crate::start;
use crate::stribeck::Places;
use crate::unknown::{Quantity, Scale, Unknown};

/// One model's fit.
#[derive(Clone, Debug, Serialize)]
pub struct ModelFit {
    /// slosh.model.
    pub model: String,
    /// friction.model.
    pub friction: String,
    /// −2 ln L.
    pub deviance: f64,
    /// Bayesian information criterion; the smallest is the best.
    pub bic: f64,
    /// Fit in the time domain, %: 100 (1 − |y − ŷ|/|y − mean y|).
    pub fit_pct: f64,
    /// The search ended at a minimum.
    pub converged: bool,
    /// Distance to the minimum in standard deviations.
    pub newton_decrement: f64,
    /// Residual tests, for each recording.
    pub tests: Vec<Tests>,
    /// Fit of the recordings held back, %.
    pub validation_pct: Vec<f64>,
    /// The gyro's noise: white, rad/s.
    pub noise_white: f64,
    /// Answers of the FMU that were needed.
    pub simulations: usize,
    /// Neither noise nor a small effect explains what the fit leaves.
    #[serde(skip)]
    pub poor: bool,
}

impl ModelFit {
    /// What it is in one line.
    pub fn line(&self) -> String {
        format!(
            "{} with {} friction: fit {:.3} %, BIC {:.1}, worst residual test {:.1} standard deviations, {} \
             simulations",
            self.model,
            self.friction,
            self.fit_pct,
            self.bic,
            self.tests.iter().map(Tests::worst).fold(0.0, f64::max),
            self.simulations
        )
    }
}

/// A fitted model with what is needed afterwards.
pub struct Fitted<'a> {
    /// What was solved.
    pub problem: Problem<'a>,
    /// The minimum.
    pub polished: Polished,
    /// In numbers for the reader.
    pub fit: ModelFit,
    /// Covariance of the values if several friction curves explain the recording ([`friction::spread`]).
    pub spread: Option<DMatrix<f64>>,
}

/// Fit of a rate below which a minimum is taken for a wrong one at first, %.
const POOR: f64 = 90.0;

/// Sum of squares over the rows beyond which a model near another one, which leaves only noise, is given up.
const HOPELESS: f64 = 1.5;

/// By how much less the sum of squares must be for another torque between rows.
const JOINS: f64 = 20.0;

/// Whether it matters what the torque does between rows: where it changes a lot from one to the next.
fn varies_fast(recording: &Recording) -> bool {
    let square = |x: f64| x * x;
    let changes: f64 = recording.torque.windows(2).map(|t| square(t[1] - t[0])).sum();
    changes > 1e-4 * recording.torque.iter().map(|t| square(*t)).sum::<f64>()
}

/// Fits a slosh model with a friction law, from the data's starts, the likeliest first, or from the fit of another model.
pub fn fit<'a>(
    fmu: &'a Fmu,
    recordings: &'a [Recording],
    options: &Options,
    (model, law): (&str, &str),
    starts: &[Start],
    from: Option<&Fitted<'a>>,
    heard: &mut dyn FnMut(String),
) -> Result<Fitted<'a>> {
    let of =
        |start: &Start, options: &Options| problem(fmu, recordings, options, (model, law), start);
    // starts that a user gives may be far off
    let far = !options.starts.is_empty();
    let mut told = options.clone();
    told.starts.retain(|(name, _)| !start::PARAMETERS.contains(&name.as_str()));
    let mut others = Vec::new();
    for start in &starts[if far { 0 } else { 1 }..] {
        others.push(of(start, &told)?.start());
    }
    others.retain(|x| x.iter().all(|x| x.is_finite()));
    let mut search = Search {
        problem: of(&starts[0], options)?,
        far,
        others,
        intersample: options.intersample,
        alone: options.models.iter().filter(|m| *m != "frozen").count() == 1,
        label: model.to_string(),
        simulations: 0,
        heard,
    };
    let (polished, spread) = match from {
        Some(other) => {
            let found = search.near(other, model)?;
            // a sibling that describes the recording, or nearly, leaves no room for a poor fit of this one, unless its
            // search went astray; then it is tried as if it were alone
            let sibling = matches!(
                (&*other.fit.model, model),
                ("planar", "spherical" | "paraboloid") | ("spherical", "paraboloid")
            );
            match sibling && !other.fit.poor && poor(&search.problem, &found.0.answer) {
                true => {
                    search.alone = true;
                    search.better(Ok(found), |search| search.begin(true))?
                }
                false => found,
            }
        }
        None => search.begin(model != "frozen")?,
    };
    let (mut problem, simulations) = (search.problem, search.simulations);
    problem.estimate_noise(&polished.answer);
    let fit = summary(&problem, &polished, options, (model, law), simulations)?;
    Ok(Fitted { problem, polished, fit, spread })
}

/// A minimum, and the values' covariance if several friction curves explain the recording.
type Found = (Polished, Option<DMatrix<f64>>);

struct Search<'a, 'h> {
    problem: Problem<'a>,
    far: bool,
    /// Further starts from the data, and for what is not in them from the user.
    others: Vec<Vec<f64>>,
    /// What the torque does between rows; `None`: not known.
    intersample: Option<Intersample>,
    /// No other model of the slosh is tried, which may fit where this one does not.
    alone: bool,
    label: String,
    simulations: usize,
    heard: &'h mut dyn FnMut(String),
}

impl<'a> Search<'a, '_> {
    fn polish(&mut self, x: &[f64], known: Option<&DMatrix<f64>>) -> Result<Polished> {
        let polished = self.problem.polish(x, known, 6)?;
        self.simulations += polished.simulations;
        (self.heard)(format!(
            "{}: {:.4} standard deviations from the minimum after {} simulations",
            self.label, polished.decrement, polished.simulations
        ));
        Ok(polished)
    }

    /// From variables x, over windows; the noise is estimated on the way.
    fn windows(&mut self, x: &[f64], windows: &[f64]) -> Result<Found> {
        let (label, heard) = (&self.label, &mut *self.heard);
        let rough = self
            .problem
            .search_growing(x, windows, &mut |line| heard(format!("{label}: {line}")))?;
        self.simulations += rough.simulations;
        let answer = self.problem.answer(&rough.x)?;
        self.problem.estimate_noise(&answer);
        if poor(&self.problem, &answer) {
            // a model that does not fit has no minimum worth the search
            let near = self.problem.polish(&rough.x, rough.jacobian.as_ref(), 1)?;
            self.simulations += near.simulations;
            return Ok((near, None));
        }
        let near = self.polish(&rough.x, rough.jacobian.as_ref())?;
        let near = self.joined(near)?;
        let (mut best, mut spread) = self.friction(near)?;
        if !best.converged() {
            let again = self.problem.search(&best.x, 1e-4)?;
            self.simulations += again.simulations;
            let other = self.polish(&again.x, again.jacobian.as_ref())?;
            if other.cost < best.cost {
                best = other;
            }
            let before = self.problem.setup.intersample;
            best = self.joined(best)?;
            if self.problem.setup.intersample != before {
                (best, spread) = self.friction(best)?;
            }
        }
        // the noise from what is left and, if it is another one, the minimum with its filter
        let before = self.problem.channels.clone();
        self.problem.estimate_noise(&best.answer);
        let pairs = before.iter().zip(&self.problem.channels);
        if pairs.into_iter().any(|(a, b)| (a.noise.white / b.noise.white - 1.0).abs() > 0.05) {
            let again = self.polish(&best.x, Some(&best.jacobian))?;
            (best, spread) = self.friction(again)?;
        }
        Ok((best, spread))
    }

    /// The minimum with what the torque does between rows, which only a minimum can tell.
    fn joined(&mut self, near: Polished) -> Result<Polished> {
        if !near.converged() || !self.join(&near)? {
            return Ok(near);
        }
        self.polish(&near.x, Some(&near.jacobian))
    }

    /// Tries what else the torque may do between rows: the sum of squares that is left after the best step from
    /// here, to first order. Returns whether another one was better and is set.
    fn join(&mut self, near: &Polished) -> Result<bool> {
        if self.intersample.is_some() || !self.problem.recordings.iter().any(varies_fast) {
            return Ok(false);
        }
        let now = self.problem.setup.intersample;
        let mut best = (near.cost - JOINS, now);
        for other in Intersample::ALL.into_iter().filter(|b| *b != now) {
            let mut problem = self.problem.clone();
            problem.setup.intersample = other;
            // held torque is late by half a row
            let mut x = near.x.clone();
            let late = |b: Intersample| if b == Intersample::ZeroOrderHold { 0.5 } else { 0.0 };
            if let Some(place) = problem.unknowns.iter().position(|u| u.quantity == Quantity::Delay)
            {
                let scale = problem.unknowns[place].scale;
                let rows = late(now) - late(other);
                let delay = scale.value(x[place]) + rows * problem.recordings[0].step();
                x[place] = scale.variable(delay);
            }
            self.simulations += 1;
            let Ok(answer) = problem.answer(&x) else { continue };
            let e = problem.stacked(&answer, &x);
            let gradient = near.jacobian.tr_mul(&e);
            let cost = e.norm_squared() - gradient.dot(&(&near.covariance.x * &gradient));
            if cost < best.0 {
                best = (cost, other);
            }
        }
        if best.1 == now {
            return Ok(false);
        }
        self.problem.setup.intersample = best.1;
        (self.heard)(format!("{}: the torque is {}", self.label, best.1.words()));
        Ok(true)
    }

    fn begin(&mut self, slosh: bool) -> Result<Found> {
        let x = self.problem.start();
        // The response that starts come from is linear: a model that is not may be far from it.
        let nonlinear = slosh && self.label != "linear";
        let mut best = self.windows(&x, if self.far || nonlinear { &WINDOWS } else { &WHOLE });
        for start in self.others.clone() {
            let found = best.as_ref().ok().map(|found| &found.0);
            let explained = found.is_some_and(|f| self.explains(f));
            // where other models are tried, one of them may fit where this one does not
            let left_to_others =
                found.is_some_and(|f| poor(&self.problem, &f.answer)) && !self.alone && !self.far;
            if !slosh || explained || left_to_others {
                break;
            }
            (self.heard)(format!("{}: noise does not explain it; from another start", self.label));
            let before = found.map(|f| f.x.clone());
            best = self.better(best, |search| search.windows(&start, &WHOLE));
            if let Ok((found, _)) = &best
                && before.is_none_or(|x| x != found.x)
                && !self.explains(found)
            {
                // such a torque has more minima than one; the lowest shows from the beginning on
                let near = found.x.clone();
                best = self.better(best, |search| search.windows(&near, &WINDOWS));
            }
        }
        let found = best.as_ref().ok().map(|found| &found.0);
        let nowhere = found.is_none_or(|f| poor(&self.problem, &f.answer));
        if slosh && !nonlinear && self.alone && !self.far && nowhere {
            (self.heard)(format!(
                "{}: poor fit from there; again with windows that grow",
                self.label
            ));
            best = self.better(best, |search| search.windows(&x, &WINDOWS));
        }
        best
    }

    /// Whether it is a minimum that leaves only noise.
    fn explains(&self, found: &Polished) -> bool {
        found.converged() && tests(&self.problem, &found.answer).iter().all(Tests::passed)
    }

    /// What was found or what `another` search finds, whichever leaves less.
    fn better(
        &mut self,
        found: Result<Found>,
        another: impl FnOnce(&mut Self) -> Result<Found>,
    ) -> Result<Found> {
        let before = self.problem.clone();
        let other = another(self);
        let fit = |problem: &Problem, found: &Result<Found>| {
            found.as_ref().map_or(f64::NEG_INFINITY, |f| fit_pct(problem, &f.0.answer))
        };
        if fit(&self.problem, &other) > fit(&before, &found) {
            return other;
        }
        self.problem = before;
        found
    }

    /// Other friction curves, if a minimum may be one of several, and the lowest.
    fn friction(&mut self, near: Polished) -> Result<Found> {
        let places = Places::of(&self.problem.unknowns);
        let Some(places) = places.filter(|p| friction::is_vague(&self.problem, &near, *p)) else {
            return Ok((near, None));
        };
        let points = friction::profile(&self.problem, &near, places)?;
        self.simulations += points.iter().map(|p| p.simulations).sum::<usize>();
        let lowest = points.iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        let mut best = near;
        if let Some(point) = lowest.filter(|p| p.cost < best.cost) {
            let other = self.polish(&point.x, Some(&best.jacobian))?;
            if other.cost < best.cost {
                best = other;
            }
        }
        let spread = friction::spread(&self.problem, &points, &best);
        if spread.is_some() {
            (self.heard)(format!("{}: several Stribeck speeds explain the recording", self.label));
        }
        Ok((best, spread))
    }

    fn near(&mut self, other: &Fitted<'a>, model: &str) -> Result<Found> {
        if model != "frozen" && poor(&other.problem, &other.polished.answer) {
            // so nonlinear that the other model's estimate leads nowhere
            return self.anew();
        }
        // what both have, from there
        let mut x = self.problem.start();
        let known = &other.problem.unknowns;
        for (x, unknown) in x.iter_mut().zip(&self.problem.unknowns) {
            if let Some(place) = known.iter().position(|u| u.quantity == unknown.quantity) {
                *x = other.polished.x[place];
            }
        }
        if model == "frozen"
            && let Some(hub) = self.problem.place("hub.I")
        {
            // all the liquid turns with the hub: the inertia above the resonance and more
            x[hub] += 0.1;
        }
        self.problem.channels.clone_from(&other.problem.channels);
        self.problem.setup.intersample = other.problem.setup.intersample;
        let same = self.problem.unknowns.len() == known.len();
        let known = same.then_some(&other.polished.jacobian);
        let polished = self.problem.polish(&x, known, 3)?;
        self.simulations += polished.simulations;
        let mut best = polished;
        // Where the other leaves only noise, this one is as good near there or not at all. Else its minimum may be
        // anywhere.
        let hopeless = poor(&self.problem, &best.answer)
            || best.cost > HOPELESS * best.answer.residual.concat().len() as f64;
        if !best.converged() && !hopeless && model != "frozen" {
            best = self.polish(&best.x.clone(), Some(&best.jacobian.clone()))?;
        }
        if other.fit.tests.iter().all(Tests::passed) && (best.converged() || hopeless)
            || model == "frozen"
        {
            return Ok((best, if same { other.spread.clone() } else { None }));
        }
        if !best.converged() && !poor(&self.problem, &best.answer) {
            let rough = self.problem.search(&best.x, 1e-3)?;
            self.simulations += rough.simulations;
            let again = self.polish(&rough.x, rough.jacobian.as_ref())?;
            if again.cost < best.cost {
                best = again;
            }
        }
        if poor(&self.problem, &best.answer) {
            return self.anew();
        }
        Ok((best, if same { other.spread.clone() } else { None }))
    }

    /// Without the other model: from the start over windows that grow, and over the whole where that leads nowhere.
    fn anew(&mut self) -> Result<Found> {
        let start = self.problem.start();
        let grown = self.windows(&start, &WINDOWS)?;
        if !poor(&self.problem, &grown.0.answer) {
            return Ok(grown);
        }
        self.better(Ok(grown), |search| search.windows(&start, &WHOLE))
    }
}

fn problem<'a>(
    fmu: &'a Fmu,
    recordings: &'a [Recording],
    options: &Options,
    (model, law): (&str, &str),
    start: &Start,
) -> Result<Problem<'a>> {
    let unknowns = unknowns(fmu, recordings, options, (model, law), start)?;
    let mut settings = vec![
        ("slosh.model".to_string(), model.to_string()),
        ("slosh.zeta_from_correlation".to_string(), "false".to_string()),
        ("friction.model".to_string(), law.to_string()),
    ];
    if law == "lugre" {
        // the bristles' damping is no more than a bearing with little viscous friction allows
        settings.push(("friction.sigma1".into(), "0".into()));
    }
    let chosen = |name: &str| matches!(name, "slosh.model" | "friction.model");
    settings.extend(options.settings.iter().filter(|(name, _)| !chosen(name)).cloned());
    let setup =
        Setup { settings, intersample: options.intersample.unwrap_or(Intersample::FirstOrderHold) };
    Ok(Problem::new(fmu, setup, recordings, unknowns))
}

fn unknowns(
    fmu: &Fmu,
    recordings: &[Recording],
    options: &Options,
    (model, law): (&str, &str),
    start: &Start,
) -> Result<Vec<Unknown>> {
    let setting = |name: &str| options.settings.iter().any(|(n, _)| n == name);
    let frozen = model == "frozen";
    let (viscous, dry) = (law != "none", !matches!(law, "none" | "viscous"));
    let inertia = if start.hub_inertia > 0.0 { start.hub_inertia } else { 0.3 };
    let all = [
        ("tank.d", start.d, !frozen),
        ("tank.h", start.h, !frozen),
        ("slosh.zeta", start.zeta, !frozen),
        ("hub.I", inertia, true),
        ("friction.b", start.b, viscous),
        ("friction.c", start.c, dry),
        ("friction.d", start.stribeck, dry),
        ("friction.omega_s", start.omega_s, dry),
    ];
    let given = |name: &str| options.starts.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
    let unit = |name: &str| -> Result<String> {
        let variable = fmu.description().variable(name)?;
        Ok(variable.attributes().unit.clone().unwrap_or_default())
    };
    let mut list = Vec::new();
    for (name, value, used) in all {
        if !used || setting(name) {
            continue;
        }
        let mut unknown = Unknown::positive(name, &unit(name)?, given(name).unwrap_or(value));
        if matches!(name, "friction.b" | "friction.c" | "friction.d") {
            unknown.scale = Scale::Softplus(0.1 * value);
        }
        // Of the right size, give or take a factor of some ten: without that, a model that does not fit may drive
        // what it does not need to nothing, and its influence with it.
        let vague = match name {
            "friction.b" => 3.0,
            "friction.c" | "friction.d" | "friction.omega_s" => 1.5,
            _ => 0.0,
        };
        if vague > 0.0 {
            unknown = unknown.known(value, vague * value);
        }
        list.push(unknown);
    }
    // parameters that are estimated because a start or something known of them is given
    for name in options.starts.iter().map(|s| &s.0).chain(options.known.iter().map(|k| &k.0)) {
        let there = list.iter().any(|u| u.quantity.parameter() == Some(name));
        if there || setting(name) || name == "friction.asymmetry" {
            continue;
        }
        let variable = fmu.description().variable(name)?;
        ensure!(
            variable.causality == "parameter" && variable.kind() == host::description::Type::Real,
            "{name} cannot be estimated: it is no parameter with a real value"
        );
        if !all.iter().any(|(n, _, used)| n == name && !used) {
            let known = options.known.iter().find(|k| k.0 == *name).map(|k| k.1);
            let start = given(name).or(known).unwrap_or(1.0);
            ensure!(start > 0.0, "{name}: only positive parameters can be estimated");
            list.push(Unknown::positive(name, &unit(name)?, start));
        }
    }
    if law == "lugre" && !setting("friction.sigma0") {
        // stiffer than the upper end, bristles move less than 1/100 of what a gyro of this kind sees
        let mut stiffness = Unknown::positive("friction.sigma0", &unit("friction.sigma0")?, 100.0);
        stiffness.scale = Scale::Logit(0.0, 1000.0);
        list.push(stiffness);
    }
    for (name, mean, deviation) in &options.known {
        if let Some(unknown) = list.iter_mut().find(|u| u.quantity.parameter() == Some(name)) {
            unknown.prior = Some((*mean, *deviation));
        }
    }
    if options.sensor_errors {
        if !setting("friction.asymmetry") && dry {
            list.push(Unknown::asymmetry());
        }
        list.push(Unknown::delay());
        list.extend((0..recordings.len()).map(Unknown::gyro_bias));
    }
    for (i, recording) in recordings.iter().enumerate() {
        if let Some(angle) = &recording.angle {
            list.push(Unknown::angle_offset(i, angle[0]));
        }
    }
    for (i, _) in recordings.iter().enumerate().filter(|(_, r)| !r.from_rest) {
        list.push(Unknown::initial(i, "init.omega", "rad/s", 1e-2));
        if !frozen {
            list.push(Unknown::initial(i, "init.slosh_angle", "rad", 0.1));
            list.push(Unknown::initial(i, "init.slosh_rate", "rad/s", 1.0));
        }
    }
    Ok(list)
}

fn summary(
    problem: &Problem,
    polished: &Polished,
    options: &Options,
    (model, law): (&str, &str),
    simulations: usize,
) -> Result<ModelFit> {
    let answer = &polished.answer;
    let deviance = problem.deviance(answer);
    let innovations = problem.innovations(answer);
    // rows that say nothing have no innovation
    let rows = innovations.iter().flatten().filter(|e| **e != 0.0).count();
    Ok(ModelFit {
        model: model.into(),
        friction: law.into(),
        deviance,
        bic: deviance + problem.unknowns.len() as f64 * (rows as f64).ln(),
        fit_pct: fit_pct(problem, answer),
        converged: polished.converged(),
        newton_decrement: polished.decrement,
        tests: tests(problem, answer),
        validation_pct: validate(problem, &polished.x, options)?,
        noise_white: problem.channels[0].noise.white,
        simulations,
        poor: poor(problem, answer),
    })
}

/// Whether what an answer leaves is noise, for each channel.
fn tests(problem: &Problem, answer: &Answer) -> Vec<Tests> {
    let one = |(channel, e): (&Channel, &Vec<f64>)| {
        let recording = &problem.recordings[channel.recording];
        let of = |x: &[f64]| match channel.signal {
            Signal::Rate => recording.of_fresh(x),
            Signal::Angle => x.to_vec(),
        };
        Tests::of(&of(&recording.time), &of(&recording.torque), &of(e), channel.noise.white)
    };
    problem.channels.iter().zip(&problem.innovations(answer)).map(one).collect()
}

/// Fit of the rates, %: 100 (1 − |y − ŷ|/|y − mean y|).
fn fit_pct(problem: &Problem, answer: &Answer) -> f64 {
    let spread: f64 = problem
        .recordings
        .iter()
        .map(|r| {
            let rate = r.of_fresh(&r.rate);
            let mean = rate.iter().sum::<f64>() / rate.len() as f64;
            rate.iter().map(|y| (y - mean).powi(2)).sum::<f64>()
        })
        .sum();
    let rates = problem.channels.iter().zip(&answer.residual);
    let rates = rates.filter(|(channel, _)| channel.signal == Signal::Rate);
    let fresh = |(c, residual): (&Channel, &Vec<f64>)| {
        problem.recordings[c.recording].of_fresh(residual).iter().map(|e| e * e).sum::<f64>()
    };
    100.0 * (1.0 - (rates.map(fresh).sum::<f64>() / spread).sqrt())
}

/// A fit that neither noise nor a small effect explains.
fn poor(problem: &Problem, answer: &Answer) -> bool {
    let noise = problem.recordings[0].rate_noise();
    let residual = problem.recordings[0].of_fresh(&answer.residual[0]);
    let rms = (residual.iter().map(|e| e * e).sum::<f64>() / residual.len() as f64).sqrt();
    fit_pct(problem, answer) < POOR && rms > 2.0 * noise
}

/// Fit of the recordings held back: the model is simulated through them.
fn validate(problem: &Problem, x: &[f64], options: &Options) -> Result<Vec<f64>> {
    let mut fits = Vec::new();
    for recording in &options.validation {
        let one = [recording.clone()];
        let there =
            Problem::new(problem.fmu, problem.setup.clone(), &one, problem.unknowns.clone());
        fits.push(fit_pct(&there, &there.answer(x)?));
    }
    Ok(fits)
}

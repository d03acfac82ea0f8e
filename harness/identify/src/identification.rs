//! The whole way from recordings to parameters with their uncertainty, and to words.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::{Result, bail, ensure};
use host::fmi2::Fmu;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::fit::{Differences, Problem, WHOLE, WINDOWS};
use crate::noise::Noise;
use crate::recording::Recording;
use crate::residual::{self, Tests};
use crate::simulate::Setup;
use crate::start::{self, Bench, Response, Start};
use crate::uncertainty::{self, Combination, Covariance};
use crate::unknown::{Quantity, Unknown};

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Options {
    /// Slosh models to be tried, by the names of `slosh.model`'s items.
    pub models: Vec<String>,
    /// What is known of the bench, by FMU name; these are not estimated.
    pub settings: Vec<(String, String)>,
    /// Starts in place of those from the data, by FMU name.
    pub starts: Vec<(String, f64)>,
    /// Whether delay, gyro bias and friction asymmetry are estimated as well.
    pub flaws: bool,
    /// Standard deviation of the gyro's scale about 1, as its data sheet has it; 0: exactly 1.
    pub gyro_scale: f64,
    /// Torque is held from row to row.
    pub held: bool,
    /// Recordings that are simulated, not fitted.
    pub validation: Vec<Recording>,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            models: ["frozen", "linear", "planar", "spherical"].map(String::from).to_vec(),
            settings: Vec::new(),
            starts: Vec::new(),
            flaws: true,
            gyro_scale: 0.01,
            held: false,
            validation: Vec::new(),
        }
    }
}

/// An estimated number.
#[derive(Clone, Debug, Serialize)]
pub struct Estimated {
    /// SI.
    pub value: f64,
    /// Standard deviation, everything in it.
    pub std: f64,
    /// Standard deviation from the noise alone.
    pub std_noise: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// As in modelDescription.xml.
    pub unit: String,
}

/// One model's fit.
#[derive(Clone, Debug, Serialize)]
pub struct ModelFit {
    /// slosh.model.
    pub model: String,
    /// −2 ln L.
    pub deviance: f64,
    /// Bayesian information criterion; the smallest is the best.
    pub bic: f64,
    /// Fit in the time domain, %: 100 (1 − |y − ŷ|/|y − mean y|).
    pub fit_pct: f64,
    /// The search ended at a minimum.
    pub converged: bool,
    /// Residual tests, for each recording.
    pub tests: Vec<Tests>,
    /// Fit of the recordings held back, %.
    pub validation_pct: Vec<f64>,
    /// The gyro's noise: white, rad/s.
    pub noise_white: f64,
    /// Answers of the FMU that were needed.
    pub simulations: usize,
}

/// What an error of something that is not estimated does to the estimates.
#[derive(Clone, Debug, Serialize)]
pub struct Effect {
    /// What is wrong, and by how much.
    pub source: String,
    /// Change of each parameter, SI.
    pub change: BTreeMap<String, f64>,
}

/// The result.
#[derive(Clone, Debug, Serialize)]
pub struct Identification {
    /// The FMU's parameters.
    pub parameters: BTreeMap<String, Estimated>,
    /// Delay, gyro scale and bias.
    pub measurement: BTreeMap<String, Estimated>,
    /// The chosen model's fit.
    pub fit: ModelFit,
    /// The search ended at a minimum.
    pub converged: bool,
    /// Whether the residual is the gyro's noise; if not, no interval is to be trusted.
    pub described: bool,
    /// The answer in words.
    pub verdict: Vec<String>,
    /// Sums that are known where their terms are not.
    pub combinations: Vec<Combination>,
    /// Names and matrix of the correlations.
    pub correlations: (Vec<String>, Vec<Vec<f64>>),
    /// Condition number of the sensitivities.
    pub condition: f64,
    /// The error budget.
    pub error_budget: Vec<Effect>,
    /// All models that were tried.
    pub models: Vec<ModelFit>,
    /// Settings of the FMU that belong to the parameters.
    pub settings: BTreeMap<String, String>,
    /// What the frequency response says.
    pub frequency_response: Option<Response>,
    /// Starts from the data.
    pub start: Option<Start>,
    /// What was done, step by step.
    pub done: Vec<String>,
    /// Wall time, s.
    pub seconds: f64,
}

impl Identification {
    /// As `result.json`.
    pub fn json(&self) -> Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

/// A fitted model with what is needed afterwards.
struct Fitted<'a> {
    problem: Problem<'a>,
    x: Vec<f64>,
    fit: ModelFit,
}

/// A search has ended if the next step is smaller than this part of a standard deviation.
const SETTLED: f64 = 0.1;

/// Least difference of the information criterion that decides (Kass and Raftery: very strong).
const DECIDES: f64 = 10.0;

/// Identifies the FMU from recordings. `heard` is told what happens.
pub fn identify(
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
    let (bench, nominal_inertia) = bench(fmu, options)?;
    let (response, start) = start::from_data(recordings, bench)?;
    if let Some(found) = &response {
        check_size(found, nominal_inertia)?;
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

    let mut fitted: Vec<Fitted> = Vec::new();
    let order = ["linear", "planar", "spherical", "paraboloid", "frozen"];
    for model in order.into_iter().filter(|m| options.models.iter().any(|o| o == m)) {
        if model != "frozen" && response.is_none() && options.starts.is_empty() {
            say(format!("{model}: not tried, the data show no slosh to start from"), &mut done);
            continue;
        }
        let from = fitted
            .iter()
            .find(|f| f.fit.model != "frozen")
            .map(|f| (f.x.clone(), f.problem.noise.clone()));
        let one = fit_model(fmu, recordings, options, model, &start, from, &mut |line| {
            say(line, &mut done);
        })?;
        say(
            format!(
                "{model}: fit {:.3} %, BIC {:.1}, worst residual test {:.1} standard deviations",
                one.fit.fit_pct,
                one.fit.bic,
                worst(&one.fit.tests)
            ),
            &mut done,
        );
        fitted.push(one);
    }
    ensure!(
        !fitted.is_empty(),
        "the data show no slosh (no antiresonance with a resonance above it in the excited band), and no \
         start was given"
    );
    fitted.sort_by(|a, b| a.fit.bic.total_cmp(&b.fit.bic));
    // among models that cannot be told apart, the simplest
    let near = fitted.iter().filter(|f| f.fit.bic < fitted[0].fit.bic + DECIDES).count();
    let simplest = ["frozen", "linear", "planar", "spherical", "paraboloid"];
    let rank = |f: &Fitted| simplest.iter().position(|s| *s == f.fit.model);
    fitted[..near].sort_by_key(rank);
    let models: Vec<ModelFit> = fitted.iter().map(|f| f.fit.clone()).collect();
    let best = fitted.swap_remove(0);
    finish(best, models, near, options, done, begun, response, start)
}

fn worst(tests: &[Tests]) -> f64 {
    tests.iter().map(Tests::worst).fold(0.0, f64::max)
}

/// tank.r, fluid.rho and g_axial of the FMU with the settings, and hub.I.
fn bench(fmu: &Fmu, options: &Options) -> Result<(Bench, f64)> {
    let mut instance = fmu.instantiate("identify")?;
    for (name, value) in &options.settings {
        let variable = fmu.description().variable(name)?;
        ensure!(
            matches!(variable.causality.as_str(), "parameter" | "input") && name != "tau_cmd",
            "{name} cannot be set: it is no parameter"
        );
        instance.set(name, value)?;
    }
    instance.setup_experiment(None, 0.0, None)?;
    instance.enter_initialization_mode()?;
    let mut real = |name: &str| instance.real(name);
    let bench =
        Bench { arm: real("tank.r")?, density: real("fluid.rho")?, gravity: real("g_axial")? };
    let (inertia, d, h) = (real("hub.I")?, real("tank.d")?, real("tank.h")?);
    let liquid = bench.density * std::f64::consts::PI / 4.0 * d * d * h;
    Ok((bench, inertia + liquid * bench.arm.powi(2)))
}

/// Refuses what is off by a factor that only a wrong unit makes.
fn check_size(found: &Response, nominal: f64) -> Result<()> {
    let ratio = nominal / found.inertia;
    if (0.1..10.0).contains(&ratio) {
        return Ok(());
    }
    let guess = match ratio {
        r if (30.0..110.0).contains(&r) => {
            "omega looks like degrees per second; it must be in rad/s"
        }
        r if r > 110.0 => {
            "tau_cmd must be in N.m and omega in rad/s; omega looks like mrad/s or mdeg/s"
        }
        r if (300.0..3000.0).contains(&(1.0 / r)) => "tau_cmd looks like mN.m; it must be in N.m",
        r if r > 1.0 => "omega looks like rpm; it must be in rad/s",
        _ => "tau_cmd must be in N.m and omega in rad/s",
    };
    bail!(
        "the recording shows an inertia of {:.3e} kg.m2, the FMU with its settings has {nominal:.3e} kg.m2: \
         {guess}. (If the bench really is that different, set hub.I to what is expected of it.)",
        found.inertia
    )
}

fn unknowns(
    fmu: &Fmu,
    recordings: &[Recording],
    options: &Options,
    model: &str,
    start: &Start,
) -> Result<Vec<Unknown>> {
    let setting = |name: &str| options.settings.iter().any(|(n, _)| n == name);
    let friction =
        options.settings.iter().find(|(n, _)| n == "friction.model").map(|(_, v)| v.as_str());
    let frozen = model == "frozen";
    let (inertia, d) = (start.hub_inertia, start.d);
    let all = [
        ("tank.d", d, !frozen),
        ("tank.h", start.h, !frozen),
        ("slosh.zeta", start.zeta, !frozen),
        ("hub.I", if inertia > 0.0 { inertia } else { 0.3 }, true),
        ("friction.b", start.b, friction != Some("none")),
        ("friction.c", start.c, !matches!(friction, Some("none" | "viscous"))),
        ("friction.d", start.stribeck, !matches!(friction, Some("none" | "viscous"))),
        ("friction.omega_s", start.omega_s, !matches!(friction, Some("none" | "viscous"))),
    ];
    let mut list = Vec::new();
    for (name, value, used) in all {
        if !used || setting(name) {
            continue;
        }
        let given = options.starts.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
        let unit = fmu.description().variable(name)?.attributes().unit.clone().unwrap_or_default();
        let unknown = Unknown::positive(name, &unit, given.unwrap_or(value));
        // the Stribeck speed lies where the data have speeds, give or take a factor of some ten
        let vague = name == "friction.omega_s" || name == "friction.d";
        list.push(if vague {
            unknown.clone().known(unknown.start, 1.5 * unknown.start)
        } else {
            unknown
        });
    }
    if options.flaws {
        if !setting("friction.asymmetry") && !matches!(friction, Some("none" | "viscous")) {
            list.push(Unknown::asymmetry());
        }
        list.push(Unknown::delay());
        list.extend((0..recordings.len()).map(Unknown::gyro_bias));
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

fn fit_model<'a>(
    fmu: &'a Fmu,
    recordings: &'a [Recording],
    options: &Options,
    model: &str,
    start: &Start,
    from: Option<(Vec<f64>, Vec<Noise>)>,
    heard: &mut dyn FnMut(String),
) -> Result<Fitted<'a>> {
    let unknowns = unknowns(fmu, recordings, options, model, start)?;
    let mut settings = vec![
        ("slosh.model".to_string(), model.to_string()),
        ("slosh.zeta_from_correlation".to_string(), "false".to_string()),
    ];
    settings.extend(options.settings.iter().filter(|(name, _)| name != "slosh.model").cloned());
    let setup = Setup { settings, held: options.held };
    let mut problem = Problem::new(fmu, setup, recordings, unknowns);
    let mut x = problem.start();
    let mut simulations = 0;
    let mut converged;
    match from {
        Some((other, noise)) if other.len() == x.len() => {
            x = other;
            problem.noise = noise;
            let estimate = problem.fit(&x)?;
            (x, converged) = (estimate.x, estimate.converged);
            simulations += estimate.simulations;
        }
        _ => {
            let far = !options.starts.is_empty();
            let windows: &[f64] = if far { &WINDOWS } else { &WHOLE };
            let estimate =
                problem.fit_growing(&x, windows, &mut |line| heard(format!("{model}: {line}")))?;
            simulations += estimate.simulations;
            let mut best = estimate;
            if !far && model != "frozen" && poor(&problem, &best.x)? {
                heard(format!("{model}: poor fit from there; again with windows that grow"));
                let again = problem
                    .fit_growing(&x, &WINDOWS, &mut |line| heard(format!("{model}: {line}")))?;
                simulations += again.simulations;
                if problem.deviance(&problem.answer(&again.x)?)
                    < problem.deviance(&problem.answer(&best.x)?)
                {
                    best = again;
                }
            }
            (x, converged) = (best.x, best.converged);
        }
    }
    // A Stribeck speed far from the data's speeds is a minimum of its own: then once more, the tank as
    // it was found and the friction from its start.
    let speed = |x: &[f64]| {
        let is = |u: &Unknown| u.quantity.parameter() == Some("friction.omega_s");
        let place = problem.unknowns.iter().position(is)?;
        Some(x[place] - problem.start()[place])
    };
    if model != "frozen" && speed(&x).is_some_and(|off| off.abs() > 1.5 || !converged) {
        heard(format!("{model}: friction far from the data's speeds; again from its start"));
        let starts = problem.start();
        let mut other = x.clone();
        for ((x, start), unknown) in other.iter_mut().zip(starts).zip(&problem.unknowns) {
            if unknown.quantity.parameter().is_some_and(|name| name.starts_with("friction.")) {
                *x = start;
            }
        }
        let again =
            problem.fit_growing(&other, &WHOLE, &mut |line| heard(format!("{model}: {line}")))?;
        simulations += again.simulations;
        if problem.cost(&again.x)? < problem.cost(&x)? {
            (x, converged) = (again.x, again.converged);
        }
    }
    // the noise from what is left, and the minimum with its filter
    let answer = problem.answer(&x)?;
    problem.estimate_noise(&answer);
    let estimate = problem.fit(&x)?;
    simulations += estimate.simulations;
    converged |= estimate.converged;
    x = estimate.x;
    let answer = problem.answer(&x)?;
    problem.estimate_noise(&answer);
    let deviance = problem.deviance(&answer);
    let innovations = problem.innovations(&answer);
    let tests = recordings
        .iter()
        .zip(&innovations)
        .zip(&problem.noise)
        .map(|((r, e), noise)| Tests::of(&r.time, &r.torque, e, noise.white))
        .collect();
    let rows: usize = recordings.iter().map(|r| r.time.len()).sum();
    let validation_pct = validate(&problem, &x, options)?;
    let fit = ModelFit {
        model: model.into(),
        deviance,
        bic: deviance + problem.unknowns.len() as f64 * (rows as f64).ln(),
        fit_pct: fit_pct(&problem, &answer.residual),
        converged,
        tests,
        validation_pct,
        noise_white: problem.noise[0].white,
        simulations,
    };
    Ok(Fitted { problem, x, fit })
}

fn fit_pct(problem: &Problem, residual: &[Vec<f64>]) -> f64 {
    let spread: f64 = problem
        .recordings
        .iter()
        .map(|r| {
            let mean = r.rate.iter().sum::<f64>() / r.rate.len() as f64;
            r.rate.iter().map(|y| (y - mean).powi(2)).sum::<f64>()
        })
        .sum();
    let miss: f64 = residual.iter().flatten().map(|e| e * e).sum();
    100.0 * (1.0 - (miss / spread).sqrt())
}

fn poor(problem: &Problem, x: &[f64]) -> Result<bool> {
    Ok(fit_pct(problem, &problem.answer(x)?.residual) < 90.0)
}

/// Fit of the recordings held back: the model is simulated through them.
fn validate(problem: &Problem, x: &[f64], options: &Options) -> Result<Vec<f64>> {
    let mut fits = Vec::new();
    for recording in &options.validation {
        let one = [recording.clone()];
        let mut there = Problem { recordings: &one, ..problem.clone() };
        there.unknowns.truncate(problem.unknowns.len());
        let residual = there.answer(x)?.residual;
        fits.push(fit_pct(&there, &residual));
    }
    Ok(fits)
}

/// Gauss and Newton's last steps with central differences, covariance, error budget and words.
#[allow(clippy::too_many_arguments)]
fn finish(
    best: Fitted,
    models: Vec<ModelFit>,
    near: usize,
    options: &Options,
    done: Vec<String>,
    begun: Instant,
    response: Option<Response>,
    start: Start,
) -> Result<Identification> {
    let Fitted { mut problem, mut x, mut fit } = best;
    if options.gyro_scale > 0.0 {
        problem.unknowns.push(Unknown::gyro_scale().known(1.0, options.gyro_scale));
        x.push(0.0);
    }
    let polished = problem.gauss_newton(&x, Differences::Central, 3)?;
    fit.simulations += polished.simulations;
    fit.converged = polished.remaining < SETTLED;
    x = polished.x;
    let (jacobian, covariance, answer) = (polished.jacobian, polished.covariance, polished.answer);
    let described = fit.tests.iter().all(Tests::passed);
    let e = stacked(&problem, &answer, &x);
    let mut full = covariance.x.clone();
    if !described {
        let robust = covariance.sandwich(&jacobian, e.as_slice(), &windows(&problem));
        for i in 0..x.len() {
            if robust[(i, i)] > full[(i, i)] {
                let factor = (robust[(i, i)] / full[(i, i)]).sqrt();
                for j in 0..x.len() {
                    full[(i, j)] *= factor;
                    full[(j, i)] *= factor;
                }
            }
        }
    }
    let noise_only = without_scale(&problem, &jacobian).unwrap_or_else(|| covariance.x.clone());
    let values = problem.values(&x);
    let slopes: Vec<f64> =
        problem.unknowns.iter().zip(&x).map(|(u, &x)| u.scale.slope(x)).collect();
    let of_values = DMatrix::from_fn(x.len(), x.len(), |i, j| full[(i, j)] * slopes[i] * slopes[j]);
    let (mut parameters, mut measurement) = (BTreeMap::new(), BTreeMap::new());
    for (i, unknown) in problem.unknowns.iter().enumerate() {
        let deviation = full[(i, i)].sqrt();
        let end = |side: f64| unknown.scale.value(x[i] + side * 1.96 * deviation);
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
    let error_budget = budget(&problem, &x, &answer, &jacobian, &covariance, &slopes)?;
    let matrix = Covariance::correlations(&full);
    let names = problem.unknowns.iter().map(|u| u.quantity.name()).collect();
    let correlations = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
    let verdict = words(&models, near, described, &fit, &combinations, &parameters, &error_budget);
    Ok(Identification {
        parameters,
        measurement,
        converged: fit.converged,
        fit,
        described,
        verdict,
        combinations,
        correlations: (names, correlations),
        condition: covariance.condition,
        error_budget,
        models,
        settings: problem.setup.settings.iter().cloned().collect(),
        frequency_response: response,
        start: Some(start),
        done,
        seconds: begun.elapsed().as_secs_f64(),
    })
}

/// Innovations and priors in one vector.
fn stacked(problem: &Problem, answer: &crate::fit::Answer, x: &[f64]) -> DVector<f64> {
    problem.stacked(problem.innovations(answer), x)
}

/// Rows of the windows of the sandwich.
fn windows(problem: &Problem) -> Vec<(usize, usize)> {
    let mut windows = Vec::new();
    let mut first = 0;
    for recording in problem.recordings {
        let rows = recording.time.len();
        let width = ((uncertainty::WINDOW / recording.step()) as usize).clamp(1, rows);
        windows
            .extend((0..rows).step_by(width).map(|k| (first + k, first + (k + width).min(rows))));
        first += rows;
    }
    windows
}

/// The covariance if the gyro's scale were known exactly.
fn without_scale(problem: &Problem, jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let place = problem.unknowns.iter().position(|u| u.quantity == Quantity::GyroScale)?;
    let rest = Covariance::of(&jacobian.clone().remove_column(place))?.x;
    Some(rest.insert_row(place, 0.0).insert_column(place, 0.0))
}

/// What errors of things that are not estimated do: the linearised shift of the estimates,
/// −(JᵀJ)⁻¹ Jᵀ Δe, with Δe the innovations' change.
fn budget(
    problem: &Problem,
    x: &[f64],
    answer: &crate::fit::Answer,
    jacobian: &DMatrix<f64>,
    covariance: &Covariance,
    slopes: &[f64],
) -> Result<Vec<Effect>> {
    let base = stacked(problem, answer, x);
    let sloshing = problem.unknowns.iter().any(|u| u.quantity.parameter() == Some("slosh.zeta"));
    let value = |name: &str| -> Result<f64> {
        let mut instance = problem.fmu.instantiate("identify")?;
        for (name, value) in &problem.setup.settings {
            instance.set(name, value)?;
        }
        instance.setup_experiment(None, 0.0, None)?;
        instance.enter_initialization_mode()?;
        instance.real(name)
    };
    // what is wrong, settings, gain of the torque, whether it is held the other way
    type Wrong = (String, Vec<(String, String)>, f64, bool);
    let mut list: Vec<Wrong> = Vec::new();
    let set = |name: &str, value: f64| vec![(name.to_string(), value.to_string())];
    if sloshing {
        list.push((
            "slosh modes 2 to 4, left out".into(),
            vec![("slosh.modes".into(), "4".into())],
            1.0,
            false,
        ));
        list.push((
            "tank.r wrong by 1 mm".into(),
            set("tank.r", value("tank.r")? + 1e-3),
            1.0,
            false,
        ));
        list.push((
            "fluid.rho wrong by 0.3 %".into(),
            set("fluid.rho", value("fluid.rho")? * 1.003),
            1.0,
            false,
        ));
        list.push((
            "g_axial wrong by 0.1 %".into(),
            set("g_axial", value("g_axial")? * 1.001),
            1.0,
            false,
        ));
    }
    list.push(("torque wrong by 1 %".into(), vec![], 1.01, false));
    list.push((
        "torque held between rows instead of linear, or the reverse".into(),
        vec![],
        1.0,
        true,
    ));
    let mut effects = Vec::new();
    for (source, settings, gain, swap) in list {
        let mut recordings = problem.recordings.to_vec();
        recordings.iter_mut().flat_map(|r| &mut r.torque).for_each(|t| *t *= gain);
        let mut other = Problem { recordings: &recordings, ..problem.clone() };
        other.setup.settings.extend(settings);
        other.setup.held ^= swap;
        let Ok(there) = other.answer(x) else { continue };
        let change = stacked(&other, &there, x) - &base;
        let shift = -(&covariance.x * jacobian.tr_mul(&change));
        let change = problem.unknowns.iter().enumerate();
        let change = change.map(|(i, u)| (u.quantity.name(), shift[i] * slopes[i])).collect();
        effects.push(Effect { source, change });
    }
    Ok(effects)
}

fn words(
    models: &[ModelFit],
    near: usize,
    described: bool,
    fit: &ModelFit,
    combinations: &[Combination],
    parameters: &BTreeMap<String, Estimated>,
    budget: &[Effect],
) -> Vec<String> {
    let mut lines = Vec::new();
    let others: Vec<&ModelFit> = models.iter().filter(|m| m.model != fit.model).collect();
    if !others.is_empty() {
        let alike: Vec<&str> = models[..near].iter().map(|m| m.model.as_str()).collect();
        lines.push(if near > 1 {
            format!(
                "Cannot tell which model it is: {} explain the data equally well (BIC within {DECIDES}). The \
                 parameters below are those of the simplest, {}.",
                alike.join(", "), fit.model
            )
        } else {
            let second = others.iter().map(|m| m.bic).fold(f64::INFINITY, f64::min);
            format!("The slosh model is {}: its BIC is {:.0} below the next.", fit.model, second - fit.bic)
        });
    }
    if !described {
        let tests: Vec<String> = fit.tests.iter().map(reasons).filter(|t| !t.is_empty()).collect();
        lines.push(format!(
            "NOT DESCRIBED: no model tried leaves only the gyro's noise ({}). Values and intervals are those of \
             the nearest model and are not to be trusted: something acts on the bench that the model does not have.",
            tests.join("; ")
        ));
    }
    if !fit.converged {
        lines.push("The search did not end at a minimum: values and standard deviations are not to be trusted, least of all \
             those of the friction. More torque, a longer recording or --start may help.".into());
    }
    for c in combinations {
        lines.push(format!(
            "{} and {} cannot be told apart (correlation {:.4}); known is {} = {:.6} ± {:.6} {}.",
            c.of[0], c.of[1], c.correlation, c.name, c.value, c.std, c.unit
        ));
    }
    for (name, p) in parameters {
        if p.value != 0.0 && p.std > 0.5 * p.value.abs() && name != "friction.asymmetry" {
            lines.push(format!(
                "{name} is not determined by these data ({:.3e} ± {:.1e} {}).",
                p.value, p.std, p.unit
            ));
        }
    }
    if let Some(modes) = budget.iter().find(|e| e.source.starts_with("slosh modes")) {
        let large = parameters.iter().filter_map(|(name, p)| {
            let change = modes.change.get(name)?;
            (change.abs() > p.std).then(|| format!("{name} {:+.2} %", 100.0 * change / p.value))
        });
        let large: Vec<String> = large.collect();
        if !large.is_empty() {
            lines.push(format!(
                "Slosh modes 2 to 4 are left out; with them the estimates would change by more than their \
                 standard deviation: {}. Set slosh.modes to include them.",
                large.join(", ")
            ));
        }
    }
    lines
}

fn reasons(tests: &Tests) -> String {
    let limit = residual::LIMIT;
    let mut list = Vec::new();
    if tests.whiteness > limit {
        list.push(format!(
            "its residual is correlated, {:.0} standard deviations",
            tests.whiteness
        ));
    }
    if tests.in_time.0 > limit {
        list.push(format!(
            "it is too large around {:.0} s ({:.0})",
            tests.in_time.1, tests.in_time.0
        ));
    }
    if tests.in_frequency.0 > limit {
        list.push(format!(
            "it is too large around {:.2} Hz ({:.0})",
            tests.in_frequency.1, tests.in_frequency.0
        ));
    }
    if tests.torque > limit {
        list.push(format!("it is correlated with the torque ({:.0})", tests.torque));
    }
    if tests.torque_squared > limit {
        list.push(format!(
            "it is correlated with the torque's square ({:.0})",
            tests.torque_squared
        ));
    }
    list.join(", ")
}

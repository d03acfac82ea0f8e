//! One model that may explain the recordings: a slosh model with a friction law, fitted.

use anyhow::{Result, ensure};
use host::causality::Causality;
use host::fmu::Fmu;
use names::hubslosh::{FrictionModel, SloshModel, friction, hub, init, slosh, tank};
use serde::Serialize;

use crate::fit::bench::between::Others;
use crate::fit::bench::goodness::{fit_pct, is_poor, tests};
use crate::fit::bench::options::Options;
use crate::fit::bench::problem::{Polished, Problem};
use crate::fit::bench::search::{Search, Sibling};
use crate::fit::bench::start;
use crate::input::recording::Recording;
use crate::model::bench::nominal::Start;
use crate::model::bench::simulate::{Intersample, Setup};
use crate::model::bench::unknown::{Scale, Unknown};
use crate::news::{News, Since};
use analysis::innovations::Tests;
use analysis::statistics::deviation;

/// One model's fit.
#[derive(Clone, Debug, Default, Serialize)]
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
    /// Simulations that were needed, of all recordings; those of a part of them count as that part.
    pub simulations: f64,
    /// True if neither noise nor a small effect explains the residual.
    #[serde(skip)]
    pub poor: bool,
}

impl ModelFit {
    /// Description in one line.
    pub fn line(&self) -> String {
        format!(
            "{} with {} friction: fit {:.3} %, BIC {:.1}, worst residual test {:.1} standard deviations, {:.0} \
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
    /// The solved problem.
    pub problem: Problem<'a>,
    /// The minimum.
    pub polished: Polished,
    /// Results of the fit, for the report.
    pub fit: ModelFit,
    /// Stribeck speeds that were tried, rad/s, with what they add to the sum of squares at least.
    pub speeds: Vec<(f64, f64)>,
    /// Fits with other intersample behaviours, if requested.
    pub others: Option<Others>,
}

/// Fits a slosh model with a friction law, from the data's starts, the likeliest first, or from the fit of another model.
pub fn fit<'a>(
    fmu: &'a Fmu,
    recordings: &'a [Recording],
    options: &Options,
    (model, law): (&str, &str),
    starts: &[Start],
    from: Option<&Fitted<'a>>,
    progress: &mut dyn FnMut(News),
) -> Result<Fitted<'a>> {
    let of =
        |start: &Start, options: &Options| problem(fmu, recordings, options, (model, law), start);
    // starts that a user gives may be far off
    let far = !options.starts.is_empty();
    let mut told = options.clone();
    told.starts.retain(|(name, _)| !start::PARAMETERS.contains(&name.as_str()));
    let first = of(&starts[0], options)?;
    let mut variables = vec![first.start()];
    for start in &starts[if far { 0 } else { 1 }..] {
        let x = of(start, &told)?.start();
        variables.extend(x.iter().all(|x| x.is_finite()).then_some(x));
    }
    let mut search = Search {
        problem: first,
        starts: variables,
        far,
        intersample: options.intersample,
        acausal: options.acausal,
        alone: options.models.iter().filter(|m| *m != SloshModel::Frozen.name()).count() == 1,
        model,
        speeds: Vec::new(),
        others: None,
        since: Since::default(),
        progress: &mut |line| progress(News::Detail(line)),
    };
    let sibling = from.map(|other| {
        use SloshModel::{Planar, Spherical};
        let is_poorer = match SloshModel::named(&other.fit.model) {
            Some(Planar) => model == Spherical.name(),
            _ => false,
        };
        Sibling {
            problem: &other.problem,
            minimum: &other.polished,
            is_poorer: is_poorer && !other.fit.poor,
        }
    });
    let mut polished = search.run(sibling.as_ref())?;
    let Search { mut problem, speeds, others, .. } = search;
    problem.renew_noise(&mut polished)?;
    let fit = summary(&problem, &polished, options, (model, law))?;
    progress(News::Step(fit.line()));
    Ok(Fitted { problem, polished, fit, speeds, others })
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
        (slosh::MODEL.to_string(), model.to_string()),
        (slosh::ZETA_FROM_CORRELATION.to_string(), "false".to_string()),
        (friction::MODEL.to_string(), law.to_string()),
    ];
    if law == FrictionModel::Lugre.name() {
        // the bristles' damping is no more than a bearing with little viscous friction allows
        settings.push((friction::SIGMA1.into(), "0".into()));
    }
    let chosen = |name: &str| matches!(name, slosh::MODEL | friction::MODEL);
    settings.extend(options.settings.iter().filter(|(name, _)| !chosen(name)).cloned());
    let setup =
        Setup { settings, intersample: options.intersample.unwrap_or(Intersample::FirstOrderHold) };
    let problem = Problem::new(fmu, setup, recordings, unknowns);
    problem.refuse_overridden()?;
    Ok(problem)
}

fn unknowns(
    fmu: &Fmu,
    recordings: &[Recording],
    options: &Options,
    (model, law): (&str, &str),
    start: &Start,
) -> Result<Vec<Unknown>> {
    let setting = |name: &str| options.settings.iter().any(|(n, _)| n == name);
    let frozen = model == SloshModel::Frozen.name();
    let (viscous, dry) = (
        law != FrictionModel::None.name(),
        ![FrictionModel::None.name(), FrictionModel::Viscous.name()].contains(&law),
    );
    let inertia = if start.hub_inertia > 0.0 { start.hub_inertia } else { 0.3 };
    let all = [
        (tank::D, start.d, !frozen),
        (tank::H, start.h, !frozen),
        (slosh::ZETA, start.zeta, !frozen),
        (hub::I, inertia, true),
        (friction::B, start.b, viscous),
        (friction::C, start.c, dry),
        (friction::D, start.stribeck, dry),
        (friction::OMEGA_S, start.omega_s, dry),
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
        if matches!(name, friction::B | friction::C | friction::D) {
            unknown.scale = Scale::Softplus(0.1 * value);
        }
        // Within about a factor of ten of the expected size. Otherwise a model that does not fit may drive a parameter that it
        // does not need to zero, and lose its influence.
        let vague = match name {
            friction::B => 3.0,
            // a deep tank's fill shows next to nothing of itself
            friction::C | friction::D | friction::OMEGA_S | tank::H => 1.5,
            _ => 0.0,
        };
        if vague > 0.0 {
            unknown = Unknown { vague: true, ..unknown.known(value, vague * value) };
        }
        list.push(unknown);
    }
    // parameters that are estimated because a start or something known of them is given
    for name in options.starts.iter().map(|s| &s.0).chain(options.known.iter().map(|k| &k.0)) {
        let there = list.iter().any(|u| u.quantity.parameter() == Some(name));
        if there || setting(name) || name == friction::ASYMMETRY {
            continue;
        }
        let variable = fmu.description().variable(name)?;
        ensure!(
            variable.causality == Causality::Parameter
                && variable.kind() == host::description::Type::Real,
            "{name} cannot be estimated: it is not a parameter with a real value"
        );
        if !all.iter().any(|(n, _, used)| n == name && !used) {
            let known = options.known.iter().find(|k| k.0 == *name).map(|k| k.1);
            let start = given(name).or(known).unwrap_or(1.0);
            ensure!(start > 0.0, "{name}: only positive parameters can be estimated");
            list.push(Unknown::positive(name, &unit(name)?, start));
        }
    }
    if law == FrictionModel::Lugre.name() && !setting(friction::SIGMA0) {
        list.push(Unknown::bristle_stiffness(&unit(friction::SIGMA0)?));
    }
    for (name, mean, deviation) in &options.known {
        if let Some(unknown) = list.iter_mut().find(|u| u.quantity.parameter() == Some(name)) {
            (unknown.prior, unknown.vague) = (Some((*mean, *deviation)), false);
        }
    }
    if options.sensor_errors {
        if !setting(friction::ASYMMETRY) && dry {
            list.push(Unknown::asymmetry());
        }
        list.push(Unknown::delay());
        if recordings.iter().any(|r| r.angle.is_some()) {
            list.push(Unknown::angle_delay());
        }
        list.extend((0..recordings.len()).map(Unknown::gyro_bias));
    }
    list.extend(options.effects.iter().cloned());
    if options.breaking && !frozen {
        let is_free = |u: &Unknown| !u.quantity.parameter().is_some_and(setting);
        list.extend(Unknown::breaking().into_iter().filter(is_free));
    }
    // with an encoder the rate's scale shows, and where slosh is not linear: without it no residual would be noise
    let nonlinear = !frozen && model != SloshModel::Linear.name();
    if options.gyro_scale > 0.0 && (nonlinear || recordings.iter().any(|r| r.angle.is_some())) {
        list.push(Unknown::gyro_scale().known(1.0, options.gyro_scale));
    }
    for (i, recording) in recordings.iter().enumerate() {
        if let Some(angle) = &recording.angle {
            list.push(Unknown::angle_offset(i, angle[0]));
        }
    }
    for (i, recording) in recordings.iter().enumerate().filter(|(_, r)| !r.from_rest) {
        // friction may stop the hub before the first row that is fitted; what the gyro reads then bounds the search
        let rate = Unknown::initial(i, init::OMEGA, "rad/s", 1e-2);
        let (first, spread) = (recording.first_rate(), deviation(&recording.rate));
        list.push(Unknown { vague: true, ..rate.known(first, spread) });
        if !frozen {
            list.push(Unknown::initial(i, init::SLOSH_ANGLE, "rad", 0.1));
            list.push(Unknown::initial(i, init::SLOSH_RATE, "rad/s", 1.0));
        }
    }
    Ok(list)
}

fn summary(
    problem: &Problem,
    polished: &Polished,
    options: &Options,
    (model, law): (&str, &str),
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
        simulations: problem.simulations(),
        poor: is_poor(problem, answer),
    })
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

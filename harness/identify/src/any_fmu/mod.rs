//! Identification of any FMU by output error: estimates the parameters and initial values with which its
//! outputs fit the recordings.
//!
//! A [`Question`] names the unknowns, [`Record`]s hold the recordings, and a [`Model`] simulates the FMU with its own solver or
//! the host's ([`host::exchange`]). All three together are a [`system::FmuSystem`], which the [`crate::engine`] fits.

pub mod foresee;
pub mod likelihood;
pub mod system;

use std::collections::BTreeMap;

use analysis::gauss_markov::Noise;
use analysis::innovations::{LIMIT, Tests};
use analysis::statistics::{mean, median};
use anyhow::{Context, Result, ensure};
use maud::html;
use nalgebra::DMatrix;
use report::page::table;
use serde::Serialize;

use crate::engine::knowledge::{Inseparable, Knowledge};
use crate::engine::minimum::{Curvature, places};
use crate::engine::profile::PARABOLIC;
use crate::engine::search::{solve, solve_near};
use crate::engine::solver_error::SolverError;
use crate::engine::{ENDS, Motion, PAIR, PRIOR_ALONE, ROUNDS, Signal, Solution, Unknown, Z};
use crate::estimate::{Estimated, fit_percent, prose};
use crate::input::question::{Question, Setting};
use crate::input::record::Record;
use crate::input::tolerance::{self, Share};
use crate::model::simulate::Model;
use crate::news::News;
use crate::words::identified::{Identified, Report, Sections, residuals};
use crate::words::verdict::{DOES_NOT_FIT, NO_MINIMUM, NOT_JUDGED, failed};
use system::FmuSystem;

/// Largest distance of the unconstrained minimum beyond a bound, in standard deviations, that chance may explain.
const PRESSED: f64 = 3.0;
/// A second difference of a simulated output counts as a jump if it exceeds the first number times the standard deviation of the
/// output's noise, and the second number times the median of all second differences.
const JUMP: (f64, f64) = (8.0, 20.0);

#[derive(Clone, Debug, Default, Serialize)]
pub struct Details {
    pub outputs: Vec<Output>,
    pub not_determined: Vec<String>,
    pub cannot_tell_apart: Vec<Inseparable>,
    pub decided_by_solver: Vec<String>,
    /// For each estimate, by name, its shift by the errors of the FMU's solver, in the estimate's unit.
    pub solver_shift: BTreeMap<String, f64>,
    pub at_bound: Vec<String>,
    /// Estimates whose likelihood is not a parabola, so that their interval is not the value ± 1.96 standard deviations.
    pub not_quadratic: Vec<String>,
    /// −2 ln L of the likelihood L at the estimates, up to a constant.
    pub deviance: f64,
    pub starts: usize,
    /// Newton decrement: the distance from the estimates to the minimum of −2 ln L, in standard deviations, as predicted by
    /// one more Newton step.
    pub decrement: f64,
    pub covariance: Vec<Vec<f64>>,
}

pub type Identification = Identified<Details>;

#[derive(Clone, Debug, Serialize)]
pub struct Output {
    pub recording: String,
    pub name: String,
    pub unit: String,
    pub rows: usize,
    pub noise_white: f64,
    /// Gauss–Markov bias: standard deviation and correlation time, s.
    pub drift: Option<(f64, f64)>,
    /// Fit of the simulated ŷ to the measured y, %: 100 (1 − ‖y − ŷ‖/‖y − mean y‖).
    pub fit_percent: f64,
    pub tests: Tests,
    /// Mean of an output's whitened residual, divided by the standard deviation of this mean. A large value means that the
    /// residual has an offset.
    pub mean: f64,
}

impl Output {
    /// Returns true if the residual is noise with zero mean.
    pub fn passed(&self) -> bool {
        self.tests.passed() && self.mean.abs() < LIMIT
    }

    fn worst_test(&self) -> f64 {
        self.tests.worst().max(self.mean.abs())
    }
}

/// Fits the question's unknowns to the recordings. `news` receives the progress.
///
/// # Errors
/// If the question has a fault (the message lists all), a recording cannot be used, or the FMU refuses a call.
pub fn identify(
    model: &Model,
    question: &Question,
    records: &[Record],
    news: &mut dyn FnMut(&News),
) -> Result<Identification> {
    ensure!(!records.is_empty(), "there is no recording");
    for record in records {
        record
            .check(question)
            .with_context(|| format!("the recording {} cannot be used", record.name))?;
    }
    let (system, unknowns) = FmuSystem::new(model, question, records)?;
    let mut done = Vec::new();
    let mut report = |words: &News| {
        if let News::Step(line) = words {
            done.push(line.clone());
        }
        news(words);
    };
    let count = unknowns.len();
    report(&News::Step(format!("{count} unknowns, {} recordings", records.len())));
    for warning in system.warnings(&unknowns)? {
        report(&News::Step(format!("the FMU warns: {warning}")));
    }
    let mut problem = system.problem(unknowns, question);
    let (mut near, mut starts, mut turn): (Option<Vec<f64>>, usize, usize) = (None, 0, 0);
    loop {
        let mut solution = match &near {
            None => solve(&problem, None, f64::INFINITY, &mut report)?,
            Some(values) => solve_near(&problem, values, &mut report)?,
        };
        (starts, turn) = (starts.max(solution.starts), turn + 1);
        let (point, noise) = (&solution.minimum.point, &solution.fit.noise);
        let mut signals = problem.signals.clone();
        let jumps = leave_out_jumps(&mut signals, records, &point.motion, noise);
        let is_same = signals.iter().zip(&problem.signals).all(|(a, b)| a.sampled == b.sampled);
        if turn == ROUNDS || is_same {
            report(&News::Step(format!(
                "{:.0} runs of each recording",
                solution.fit.simulations()
            )));
            let mut found = conclude(&system, &mut solution, question)?;
            found.details.starts = starts;
            found.done = done;
            return Ok(found);
        }
        report(&News::Step(format!("left out {jumps} rows next to jumps of an output")));
        near = Some(solution.fit.values(&point.z));
        problem.signals = signals;
    }
}

/// Leaves out the rows next to jumps of the model's outputs and returns the number of these rows. A jump comes from an event:
/// when the event moves past a row during the search, the sum of squares jumps, and its derivatives do not show how far the
/// event has to move.
fn leave_out_jumps(
    signals: &mut [Signal],
    records: &[Record],
    motion: &[Motion],
    noise: &[Noise],
) -> usize {
    let mut count = 0;
    for (signal, noise) in signals.iter_mut().zip(noise) {
        let y = &motion[signal.recording].outputs[signal.output];
        signal.sampled = records[signal.recording].sampled(signal.output);
        let bends: Vec<f64> = y.windows(3).map(|y| (y[2] - 2.0 * y[1] + y[0]).abs()).collect();
        let usual = median(&bends).unwrap_or(0.0);
        let limit = (JUMP.0 * noise.white).max(JUMP.1 * usual);
        for (k, _) in bends.iter().enumerate().filter(|(_, bend)| **bend > limit) {
            count += usize::from(signal.sampled[k + 1]);
            signal.sampled[k + 1] = false;
        }
    }
    count
}

/// Returns advice for smaller errors of the solver. `heeds_tolerance` is true if a smaller tolerance changes the FMU's outputs.
fn remedy(system: &FmuSystem, heeds_tolerance: bool) -> String {
    let finer = "a smaller tolerance, --solver own:TOLERANCE, makes them smaller";
    match system.model {
        Model::Host { .. } => {
            "a smaller tolerance, --solver host:TOLERANCE, makes them smaller".into()
        }
        Model::Own(_) if system.setup.can_exchange(system.model) => {
            let also = if heeds_tolerance { format!("; {finer} too") } else { String::new() };
            format!("with --solver host the host integrates this FMU, with errors of 1e-8{also}")
        }
        Model::Own(_) if heeds_tolerance => finer.into(),
        own => {
            let exchange = match own.offers_exchange() {
                true => {
                    "--solver host is of no use, because an output follows the slope of an input"
                }
                false => "or for Model Exchange and use --solver host",
            };
            format!(
                "the FMU ignores the tolerance that a host gives: export it with a finer solver, {exchange}"
            )
        }
    }
}

struct Number {
    std: f64,
    std_noise: f64,
    /// 95 % interval. `ended` is true for an end that follows from the likelihood, and false for an end at a bound.
    ends: [f64; 2],
    ended: [bool; 2],
    /// True if the likelihood is a parabola within the interval.
    is_quadratic: bool,
    /// True if the estimate is not at a bound.
    is_inner: bool,
    is_decided_by_solver: bool,
}

struct Numbers {
    each: Vec<Number>,
    covariance: DMatrix<f64>,
    inseparable: Vec<Inseparable>,
    /// Indices of the unknowns at a bound whose unconstrained minimum lies beyond the bound by more than [`PRESSED`] standard
    /// deviations.
    pressed: Vec<usize>,
    solver: SolverError,
}

impl Numbers {
    fn from_solution(system: &FmuSystem, solution: &mut Solution) -> Result<Self> {
        let unknowns = &solution.fit.problem.unknowns;
        let n = unknowns.len();
        let own = solution.fit.derivatives_at(&mut solution.minimum)?.matrix;
        let known: Vec<bool> = (0..n).map(|j| unknowns[j].is_known()).collect();
        let mut jacobian = own.clone();
        let tolerances = solution.fit.derivatives(&solution.minimum.point, &known)?.matrix;
        for j in places(&known) {
            jacobian.column_mut(j).copy_from(&tolerances.column(j));
        }
        let (fit, minimum) = (&solution.fit, &solution.minimum);
        let point = &minimum.point;
        let gradient = jacobian.tr_mul(&point.e);
        let inner = fit.inner(&point.z, &gradient, &vec![true; n]);
        let is_inner: Vec<bool> = (0..n).map(|j| inner.contains(&j)).collect();
        let solver =
            system.with_finer(|finer| fit.solver_error(point, &jacobian, &is_inner, finer));
        let knowledge = fit.knowledge(&jacobian, &is_inner, &solver);
        let asked: Vec<usize> = inner.iter().copied().filter(|j| !known[*j]).collect();
        let alone = Curvature::new(&jacobian, asked).covariance(n);
        // a search that ended before the minimum widens the standard deviation by its distance
        let widened = (1.0 + minimum.decrement.powi(2)).sqrt();
        // curvature along an unknown at a bound, with the other unknowns at their minimum
        let inverse = Curvature::new(&jacobian, inner.clone()).covariance(n);
        let curvature = |j: usize| {
            let crossed = jacobian.tr_mul(&jacobian.column(j));
            jacobian.column(j).norm_squared() - crossed.dot(&(&inverse * &crossed))
        };
        let is_pressed = |j: &usize| {
            !is_inner[*j] && gradient[*j].abs() / curvature(*j).max(0.0).sqrt() > PRESSED
        };
        let pressed = (0..n).filter(is_pressed).collect();
        let draws = match solution.profile {
            Some(_) => Some(solution.draw(true)?).filter(|draws| draws.has_enough_draws()),
            None => None,
        };
        let z = &solution.minimum.point.z;
        let mut each = Vec::with_capacity(n);
        for j in 0..n {
            let (low, high) = unknowns[j].bounds;
            let (own, is_inner) = (knowledge.covariance[(j, j)].sqrt(), is_inner[j]);
            let is_decided_by_solver = knowledge.decided_by_solver[j];
            let std = match (is_decided_by_solver, is_inner) {
                (true, _) => f64::NAN,
                (_, true) => (widened * own).hypot(solver.shift[j]),
                _ => 1.0 / jacobian.column(j).norm(),
            };
            let std_noise = if known.contains(&true) { alone[(j, j)].sqrt() } else { std };
            let parabola = [-1.0, 1.0].map(|sign| z[j] + sign * Z * std);
            let (ends, ended, is_quadratic) = (parabola, [true; 2], true);
            let mut found = Number {
                std,
                std_noise,
                ends,
                ended,
                is_quadratic,
                is_inner,
                is_decided_by_solver,
            };
            if !std.is_finite() {
                found.ends = [low, high].map(|end| if end.is_finite() { end } else { f64::NAN });
                (found.ended, found.is_quadratic) = ([false; 2], false);
            } else if !is_inner {
                // from the bound the sum of squares rises by c x² + 2 g x
                let (c, g) = (curvature(j).max(1e-300), gradient[j].abs());
                let far = ((g * g + Z * Z * c).sqrt() - g) / c;
                let is_upper = z[j] >= high;
                found.ends = if is_upper { [z[j] - far, high] } else { [low, z[j] + far] };
                (found.ended, found.is_quadratic) = ([is_upper, !is_upper], false);
            } else if let (Some(draws), false) = (&draws, known[j]) {
                // errors of the solver and of the search widen the interval
                found.ends = draws.interval(j).map(|end| z[j] + std / own * (end - z[j]));
                if let Some((_, open)) =
                    draws.open.as_ref().filter(|(of, _)| *of == unknowns[j].name)
                {
                    found.ended = open.map(|open| !open);
                }
                let off = (0..2).map(|k| (found.ends[k] - parabola[k]).abs() / (Z * std));
                found.is_quadratic =
                    off.fold(0.0, f64::max) < PARABOLIC && found.ended == [true; 2];
                let reach = found.ends.map(|end| (end - z[j]).abs() / Z);
                found.std = std.max(reach[0]).max(reach[1]);
            }
            for (k, bound) in [low, high].into_iter().enumerate() {
                let is_beyond = if k == 0 { found.ends[k] < bound } else { found.ends[k] > bound };
                if is_inner && (is_beyond || !found.ended[k]) && std.is_finite() {
                    let end = if bound.is_finite() { bound } else { found.ends[k] };
                    (found.ends[k], found.ended[k], found.is_quadratic) = (end, false, false);
                }
            }
            each.push(found);
        }
        let Knowledge { covariance, inseparable, .. } = knowledge;
        Ok(Numbers { each, covariance, inseparable, pressed, solver })
    }
}

fn outputs(system: &FmuSystem, solution: &Solution, question: &Question) -> Vec<Output> {
    let (fit, point) = (&solution.fit, &solution.minimum.point);
    let residuals = fit.residuals(&point.z, &point.motion);
    let innovations = fit.innovations(residuals.clone());
    let description = system.model.description();
    let one = |(k, signal): (usize, &Signal)| {
        let (noise, e) = (fit.noise[k], signal.picked(&innovations[k]));
        let name = &question.outputs[signal.output];
        Output {
            recording: system.records[signal.recording].name.clone(),
            name: name.clone(),
            unit: description.variable(name).map_or("", |v| description.unit(v)).into(),
            rows: e.len(),
            noise_white: noise.white,
            drift: (noise.drift > 0.0).then_some((noise.drift * noise.white, noise.time)),
            fit_percent: fit_percent(
                &signal.picked(&residuals[k]),
                &signal.picked(&signal.measured),
            ),
            tests: solution.tests[k].clone(),
            mean: mean(&e) * (e.len() as f64).sqrt(),
        }
    };
    fit.problem.signals.iter().enumerate().map(one).collect()
}

/// Returns NaN for an infinite value, because JSON has no infinity.
fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { f64::NAN }
}

fn conclude(
    system: &FmuSystem,
    solution: &mut Solution,
    question: &Question,
) -> Result<Identification> {
    let numbers = Numbers::from_solution(system, solution)?;
    let Numbers { each, covariance, solver, .. } = &numbers;
    let problem = solution.fit.problem;
    let unknowns = &problem.unknowns;
    let n = unknowns.len();
    let outputs = outputs(system, solution, question);
    let minimum = &solution.minimum;
    let names: Vec<String> = unknowns.iter().map(|u| u.name.clone()).collect();
    let named = |which: &[usize]| which.iter().map(|&j| names[j].clone()).collect::<Vec<_>>();
    let shifts = names.iter().cloned().zip(solver.shift.iter().copied().map(finite));
    let mut found = Identified::new(Details {
        outputs,
        cannot_tell_apart: numbers.inseparable.clone(),
        decided_by_solver: (0..n)
            .filter(|j| each[*j].is_decided_by_solver)
            .map(|j| names[j].clone())
            .collect(),
        solver_shift: shifts.collect(),
        deviance: solution.fit.deviance(&minimum.point),
        decrement: minimum.decrement,
        covariance: (0..n)
            .map(|i| covariance.row(i).iter().copied().map(finite).collect())
            .collect(),
        ..Details::default()
    });
    found.converged = minimum.decrement < ENDS.0;
    let fits = found.details.outputs.iter().all(Output::passed);
    let is_decided = !found.details.decided_by_solver.is_empty();
    let pressed = named(&numbers.pressed);
    found.fits = (!fits || !is_decided && pressed.is_empty()).then_some(fits);
    let mut words = vec![match found.fits {
        None if !is_decided => format!(
            "{NOT_JUDGED}: the residual of every output is noise, but {} would fit better beyond a bound, so that \
             no interval can be trusted. Wider bounds, or another start, may lead to another minimum.",
            pressed.join(", ")
        ),
        None => format!(
            "{NOT_JUDGED}: the residual of every output is noise, but estimates depend on the errors of the solver."
        ),
        Some(_) => fit_in_words(&found.details.outputs),
    }];
    let is_seen = solver.differs.contains(&true);
    if is_decided {
        let heeds = matches!(system.model, Model::Own(_)) && solver.differs.first() == Some(&true);
        words.push(format!(
            "No interval is given for {}, because the errors of the {} solver are too large for these estimates ({}).",
            found.details.decided_by_solver.join(", "),
            if matches!(system.model, Model::Own(_)) { "FMU's own" } else { "host's" },
            remedy(system, heeds)
        ));
    } else if !is_seen && (0..n).any(|j| system.is_parameter(j)) {
        words.push(
            "The size of the solver's errors is not known: the outputs are the same with a finer tolerance and with shorter \
             communication steps. The intervals hold if these errors are small against the noise."
                .into(),
        );
    }
    let sets = found.details.cannot_tell_apart.iter().filter(|set| set.direction.len() > 1);
    words.extend(sets.map(Inseparable::words));
    if !found.converged {
        words.push(format!(
            "{NO_MINIMUM}: the minimum is {:.1} standard deviations away",
            minimum.decrement
        ));
    }
    for (j, unknown) in unknowns.iter().enumerate() {
        let number = &each[j];
        let mut e = Estimated {
            value: minimum.point.z[j],
            std: finite(number.std),
            std_noise: finite(number.std_noise),
            interval: number.ends.map(finite),
            determined: false,
            unit: unknown.unit.clone(),
        };
        if number.is_decided_by_solver {
            e.interval = [f64::NAN; 2];
        } else if unknown.is_known() {
            e.determined = true;
        } else {
            say(unknown, e.value, number, &mut found.details, &mut words);
            e.determined = number.ends.iter().all(|end| end.is_finite())
                && !found.details.not_determined.contains(&unknown.name);
        }
        match system.is_parameter(j) {
            true => found.parameters.insert(unknown.name.clone(), e),
            false => found.measurement.insert(unknown.name.clone(), e),
        };
    }
    let correlation = |i: usize, j: usize| {
        let size = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
        match size > 0.0 && size.is_finite() {
            true => covariance[(i, j)] / size,
            false => f64::from(i == j),
        }
    };
    let (known, asked): (Vec<usize>, Vec<usize>) = (0..n).partition(|j| unknowns[*j].is_known());
    let share = |j: usize| {
        let size = |i: &&usize| correlation(**i, j).abs();
        let most = known.iter().max_by(|a, b| size(a).total_cmp(&size(b)))?;
        let share = 1.0 - (each[j].std_noise / each[j].std).powi(2);
        Some(Share { name: names[j].clone(), share, most: names[*most].clone() })
    };
    let known_spread = asked.iter().copied().filter(|j| each[*j].std.is_finite());
    let shares: Vec<Share> = known_spread.filter_map(share).collect();
    let sizes: Vec<String> = known.iter().map(|&j| size(system, unknowns, j)).collect();
    match known.is_empty() {
        true => words.push(NOISE_ALONE.into()),
        false => words.extend(tolerance::shares(&sizes, &shares)),
    }
    for &i in &asked {
        for &j in asked.iter().filter(|j| **j < i && correlation(i, **j).abs() > PAIR) {
            words.push(format!(
                "{} and {} are strongly correlated ({:+.3}): the recordings determine a combination of them better than each \
                 alone",
                names[j],
                names[i],
                correlation(i, j)
            ));
        }
    }
    let row = |i: usize| (0..n).map(|j| correlation(i, j)).collect();
    found.correlations = (names.clone(), (0..n).map(row).collect());
    found.verdict = words;
    found.settings = question.settings.iter().map(Setting::named).collect();
    found.residuals = residuals(solution, |signal| {
        let (recording, name) = (signal.recording, &question.outputs[signal.output]);
        let unit = system.model.description().variable(name);
        let unit = unit.map_or("", |v| system.model.description().unit(v));
        let label = prose(if unit.is_empty() { "1" } else { unit });
        (format!("{}, {name}", system.records[recording].name), label)
    });
    Ok(found)
}

/// Returns the name of known value `j` followed by its relative or absolute tolerance, for example `tank.r 0.40 %`.
fn size(system: &FmuSystem, unknowns: &[Unknown], j: usize) -> String {
    let Unknown { name, unit, prior, .. } = &unknowns[j];
    let (mean, std) = prior.unwrap_or_default();
    let whole = if system.is_parameter(j) { mean.abs() } else { 1.0 };
    match whole > 0.0 {
        true => format!("{name} {:.2} %", 100.0 * std / whole),
        false => format!("{name} ± {std:.1e} {}", prose(unit)),
    }
}

const NOISE_ALONE: &str = "The intervals include noise alone: settings, inputs and the clock count as exact. --tolerance states how sure they are.";

fn say(
    unknown: &Unknown,
    value: f64,
    number: &Number,
    details: &mut Details,
    words: &mut Vec<String>,
) {
    let &Number { std, ends, ended, is_quadratic, is_inner, .. } = number;
    let name = &unknown.name;
    let unit = prose(&unknown.unit);
    let unit = if unit == "1" || unit.is_empty() { String::new() } else { format!(" {unit}") };
    if !std.is_finite() || ended == [false, false] && is_inner {
        details.not_determined.push(name.clone());
        let is_of_a_set =
            |set: &Inseparable| set.direction.len() > 1 && set.direction.contains_key(name);
        if std.is_finite() {
            words.push(format!(
                "{name} is not determined: any value from {:.4e} to {:.4e}{unit} fits equally well",
                ends[0], ends[1]
            ));
        } else if !details.cannot_tell_apart.iter().any(is_of_a_set) {
            words.push(format!("{name} is not determined: no output depends on it by itself"));
        }
        return;
    }
    if let Some((mean, beforehand)) = unknown.prior
        && std > PRIOR_ALONE * beforehand
    {
        details.not_determined.push(name.clone());
        words.push(format!(
            "{name} is not determined by the recordings: {:.4e} ± {std:.1e}{unit} is the prior ({mean:.4e} ± {beforehand:.1e})",
            value
        ));
        return;
    }
    if !is_inner {
        let upper = value >= unknown.bounds.1;
        let (which, other) = if upper { ("upper", 0) } else { ("lower", 1) };
        details.at_bound.push(name.clone());
        words.push(format!(
            "{name} is at its {which} bound, {}{unit}: the minimum lies beyond it; its 95 % interval reaches from there to \
             {:.4e}{unit}",
            value, ends[other]
        ));
    } else if !is_quadratic {
        details.not_quadratic.push(name.clone());
        let open = match ended {
            [true, true] => String::new(),
            [false, _] => "; its lower end is the bound".into(),
            [_, false] => "; its upper end is the bound".into(),
        };
        words.push(format!(
            "{name}: the likelihood is not a parabola; its 95 % interval is {:.5e} to {:.5e}{unit}{open}",
            ends[0], ends[1]
        ));
    }
}

fn fit_in_words(outputs: &[Output]) -> String {
    let is_bad = |o: &&Output| !o.passed();
    let all = outputs.iter().filter(is_bad);
    let Some(o) = all.max_by(|a, b| a.worst_test().total_cmp(&b.worst_test())) else {
        return "The model fits: the residual of every output is noise.".into();
    };
    let mut why = failed(&o.tests, "an input");
    if o.mean.abs() >= LIMIT {
        why.push(format!("its mean is not 0 ({:.0} σ)", o.mean.abs()));
    }
    let count = outputs.iter().filter(is_bad).count();
    format!(
        "{DOES_NOT_FIT}: the residual of {count} of {} outputs is not noise; {} of {}: {}. No interval can be trusted.",
        outputs.len(),
        o.name,
        o.recording,
        why.join(", ")
    )
}

impl Report for Details {
    fn lines(found: &Identification) -> Vec<String> {
        let head = ["output", "rows", "noise", "fit %", "worst test"];
        let [output, rows, noise, fit, test] = head;
        let mut lines = vec![format!("{output:24} {rows:>8} {noise:>12} {fit:>8} {test:>10}")];
        for o in &found.details.outputs {
            // a constant output has no variance that a model could explain
            let fit = match o.fit_percent.is_finite() {
                true => format!("{:.2}", o.fit_percent),
                false => "–".into(),
            };
            let Output { name, rows, noise_white, recording, .. } = o;
            let test = o.worst_test();
            lines.push(format!(
                "{name:24} {rows:>8} {noise_white:>12.3e} {fit:>8} {test:>10.1}  {recording}"
            ));
        }
        lines
    }

    fn sections(found: &Identification) -> Sections {
        let outputs = found.details.outputs.iter().map(|o| {
            vec![
                format!("{}, {}", o.recording, o.name),
                o.rows.to_string(),
                format!("{:.3e} {}", o.noise_white, prose(&o.unit)),
                format!("{:.2}", o.fit_percent),
                format!("{:.1}", o.worst_test()),
            ]
        });
        let figures = html! {
            h2 { "Outputs" }
            p { "Noise of a row, how much of the output the model explains, and the worst test of the residual in standard \
                 deviations of chance; 5 is the limit." }
            (table(["output", "rows", "noise", "fit, %", "worst test"], outputs))
        };
        Sections { figures, ..Sections::default() }
    }
}

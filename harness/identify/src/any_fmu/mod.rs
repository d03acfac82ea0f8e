//! Identification of any FMU by output error: which values of its parameters and starts make its outputs those of the recordings.
//!
//! A [`Question`] names the unknowns, [`Record`]s hold the recordings, and a [`Model`] runs the FMU with its own solver or the
//! host's ([`host::exchange`]). The stages are those of the folders.

mod page;

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use serde::Serialize;

use crate::estimate::{Estimated, prose};
use crate::fit::covariance::Covariance;
use crate::fit::goodness::{Output, outputs};
use crate::fit::problem::Problem;
use crate::fit::search::{self, Minimum};
use crate::input::question::{Question, Setting};
use crate::input::record::Record;
use crate::model::simulate::{Model, Setup};
use crate::model::unknown::{Unknown, What};
use crate::news::News;
use crate::tuning::{DECREMENT, PAIR_CORRELATION, PRIOR_ALONE, SOLVER_ADDED, TURNS};
use crate::uncertainty::knowledge::{Inseparable, Knowledge, finite, knowledge};
use crate::uncertainty::profile::{self, Interval};
use crate::uncertainty::solver_error::{self, SolverError};
use crate::uncertainty::tolerated::Tolerated;
use crate::words::identified::{Identified, Residual};
use crate::words::verdict::{DOES_NOT_FIT, NO_MINIMUM, NOT_JUDGED, failed};
use analysis::innovations::LIMIT;

/// Results other than the estimates.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Details {
    /// The outputs of the recordings.
    pub outputs: Vec<Output>,
    /// Estimates that the recordings do not determine.
    pub not_determined: Vec<String>,
    /// Sets of estimates that the recordings cannot tell apart.
    pub cannot_tell_apart: Vec<Inseparable>,
    /// Estimates that the errors of the solver decide: they have no interval.
    pub decided_by_solver: Vec<String>,
    /// Shift of each estimate by the errors of the solver, in its unit.
    pub solver_shift: BTreeMap<String, f64>,
    /// Estimates at a bound.
    pub at_bound: Vec<String>,
    /// Estimates whose interval is no ± about them.
    pub not_quadratic: Vec<String>,
    /// −2 ln L but for a constant.
    pub deviance: f64,
    /// Starts that were tried.
    pub starts: usize,
    /// Distance to the minimum in standard deviations.
    pub decrement: f64,
    /// Covariance of the estimates, in the order of the correlations' names.
    pub covariance: Vec<Vec<f64>>,
}

/// Result of fitting any FMU.
pub type Identification = Identified<Details>;

/// Identifies.
///
/// # Errors
/// All that is wrong with what is asked; what the FMU refuses.
pub fn identify(
    model: &Model,
    question: &Question,
    records: &[Record],
    news: &mut dyn FnMut(&News),
) -> Result<Identification> {
    ensure!(!records.is_empty(), "there is no recording");
    for record in records {
        record.check(question).with_context(|| format!("{} cannot be used", record.name))?;
    }
    let setup = Setup::new(question, model.description())?;
    let unknowns = question.unknowns(model.description(), records)?;
    let mut done = Vec::new();
    let mut told = |words: &News| {
        if let News::Step(line) = words {
            done.push(line.clone());
        }
        news(words);
    };
    let problem = Problem::new(model, &setup, records, unknowns, 1e-3);
    told(&News::Step(format!(
        "{} unknowns, {} recordings, {} runs for a set of sensitivities",
        problem.unknowns.len(),
        records.len(),
        problem.runs_of_jacobian()
    )));
    for warning in problem.warnings()? {
        told(&News::Step(format!("the FMU warns: {warning}")));
    }
    let (mut minimum, starts) = search::best(&problem, question.starts, &mut told)?;
    let mut problem = problem;
    for _ in 0..ROUNDS {
        for turn in 1..=TURNS {
            let before: Vec<f64> = problem.channels.iter().map(|c| c.noise.white).collect();
            let free = problem.unknowns.iter().filter(|unknown| unknown.prior.is_none()).count();
            let jumps = problem.leave_out_jumps(&minimum.answer.motion);
            if jumps > 0 {
                told(&News::Step(format!("left out {jumps} rows next to jumps of an output")));
            }
            problem.estimate_noise(&minimum.answer.motion, &minimum.x, free, question.drift);
            let changes = problem.channels.iter().zip(&before);
            let change = changes.map(|(c, b)| (c.noise.white / b).ln().abs()).fold(0.0, f64::max);
            if turn > 2 && change < 0.01 && minimum.converged() {
                break;
            }
            told(&News::Step(format!("noise estimated, turn {turn}")));
            let (x, steps) = (&minimum.x, minimum.steps);
            minimum = search::search(&problem, x, steps, (DECREMENT, 30), &mut told)?;
        }
        // the last noise is that of the last minimum
        minimum.answer.e = problem.stacked(&minimum.answer.motion, &minimum.x);
        let is_better;
        (minimum, is_better) = search::not_worse(&problem, minimum, &mut told);
        if !is_better {
            break;
        }
    }
    told(&News::Step("intervals from the profiles of the likelihood".into()));
    let mut found = conclude(&problem, &minimum, question)?;
    found.details.starts = starts;
    found.done = done;
    Ok(found)
}

/// Minima at most, each better than the one before, about which the noise is estimated.
const ROUNDS: usize = 3;

/// Advice on how to make the solver's errors smaller.
fn remedy(problem: &Problem, solver: &SolverError) -> String {
    let finer = "a smaller tolerance, --solver own:TOLERANCE, makes them smaller";
    match problem.model {
        Model::Host { .. } => {
            "a smaller tolerance, --solver host:TOLERANCE, makes them smaller".into()
        }
        Model::Own(_) if problem.setup.can_exchange(problem.model) => {
            let also =
                if solver.heeds_tolerance { format!("; {finer} too") } else { String::new() };
            format!("with --solver host the host integrates this FMU, with errors of 1e-8{also}")
        }
        Model::Own(_) if solver.heeds_tolerance => finer.into(),
        Model::Own(_) => {
            let exchange = match problem.model.offers_exchange() {
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

fn conclude(problem: &Problem, minimum: &Minimum, question: &Question) -> Result<Identification> {
    let n = minimum.x.len();
    let inner = minimum.inner(problem);
    let solver = solver_error::measure(
        problem,
        &minimum.x,
        &minimum.answer.motion,
        &minimum.jacobian,
        &minimum.steps,
        &inner,
    )?;
    let Knowledge { covariance, inseparable, decided_by_solver } =
        knowledge(problem, &minimum.jacobian, &inner, &solver)?;
    let curvature_alone = |j: usize| 1.0 / minimum.jacobian.column(j).norm();
    // where differences end before the minimum, how far it may be off is part of how sure it is
    let widened = (1.0 + minimum.decrement.powi(2)).sqrt();
    // at a bound: as far as it would go with the others held
    let std: Vec<f64> = (0..n)
        .map(|j| {
            if decided_by_solver[j] {
                return f64::NAN;
            }
            let std = match inner.contains(&j) {
                true => widened * covariance[(j, j)].sqrt(),
                false => curvature_alone(j),
            };
            if solver.shift[j] > SOLVER_ADDED * std { std.hypot(solver.shift[j]) } else { std }
        })
        .collect();
    let intervals = profile::intervals(problem, minimum, &std)?;
    let known = Tolerated::of(problem, minimum, &inner)?;
    let outputs = outputs(problem, &minimum.answer.motion, &minimum.x, question);
    let mut found = Identified::new(Details {
        outputs,
        cannot_tell_apart: inseparable,
        deviance: problem.deviance(&minimum.answer),
        starts: 1,
        decrement: minimum.decrement,
        covariance: (0..n)
            .map(|i| covariance.row(i).iter().copied().map(finite).collect())
            .collect(),
        ..Details::default()
    });
    let names = problem.names();
    let correlations = Covariance::correlations(&covariance);
    found.converged = minimum.converged();
    let fits = found.details.outputs.iter().all(Output::passed);
    let decided: Vec<usize> = (0..n).filter(|&j| decided_by_solver[j]).collect();
    found.details.decided_by_solver = decided.iter().map(|&j| names[j].clone()).collect();
    let shifts = names.iter().cloned().zip(solver.shift.iter().copied().map(finite));
    found.details.solver_shift = shifts.collect();
    let pressed: Vec<String> =
        minimum.pressed(problem).into_iter().map(|j| names[j].clone()).collect();
    found.fits = (!fits || decided.is_empty() && pressed.is_empty()).then_some(fits);
    let mut words = match found.fits {
        None if decided.is_empty() => vec![format!(
            "{NOT_JUDGED}: the residual of every output is noise, but bounds hold {}: the recordings want to go further, so that \
             no interval can be trusted. Wider bounds, or another start, may lead to another minimum.",
            pressed.join(", ")
        )],
        None => vec![format!(
            "{NOT_JUDGED}: the residual of every output is noise, but the errors of the solver decide estimates."
        )],
        Some(_) => vec![fit_in_words(&found.details.outputs)],
    };
    if !decided.is_empty() {
        words.push(format!(
            "No interval is given for {}: the errors of the {} solver decide them ({}).",
            found.details.decided_by_solver.join(", "),
            if matches!(problem.model, Model::Own(_)) { "FMU's own" } else { "host's" },
            remedy(problem, &solver)
        ));
    }
    let is_parameter = |unknown: &Unknown| matches!(unknown.what, What::Parameter { .. });
    if decided.is_empty() && !solver.is_seen && problem.unknowns.iter().any(is_parameter) {
        words.push(
            "The size of the solver's errors is not known: the outputs are the same with a finer tolerance and with shorter \
             communication steps. The intervals hold if these errors are small against the noise."
                .into(),
        );
    }
    words.extend(
        found
            .details
            .cannot_tell_apart
            .iter()
            .filter(|set| set.direction.len() > 1)
            .map(Inseparable::words),
    );
    if !found.converged {
        words.push(format!(
            "{NO_MINIMUM}: it ended {:.1} standard deviations from it",
            minimum.decrement
        ));
    }
    for (j, unknown) in problem.unknowns.iter().enumerate() {
        let interval = &intervals[j];
        let mut e = Estimated {
            value: minimum.x[j],
            std: finite(std[j]),
            std_noise: known.as_ref().map_or(finite(std[j]), |known| finite(known.noise_only[j])),
            interval: interval.ends.map(finite),
            determined: false,
            unit: unknown.unit.clone(),
        };
        if decided_by_solver[j] {
            e.interval = [f64::NAN; 2];
        } else if unknown.is_known {
            e.determined = true;
        } else {
            say(unknown, &e, interval, inner.contains(&j), std[j], &mut found.details, &mut words);
            e.determined = interval.ends.iter().all(|end| end.is_finite())
                && !found.details.not_determined.contains(&unknown.name);
        }
        match unknown.what {
            What::Parameter { .. } => found.parameters.insert(unknown.name.clone(), e),
            _ => found.measurement.insert(unknown.name.clone(), e),
        };
    }
    match known {
        Some(known) => words.extend(known.words(problem, &std)),
        None => words.push(NOISE_ALONE.into()),
    }
    for i in 0..n {
        for j in 0..i {
            let is_asked = !(problem.unknowns[i].is_known || problem.unknowns[j].is_known);
            if is_asked && correlations[i][j].abs() > PAIR_CORRELATION {
                words.push(format!(
                    "{} and {} are strongly correlated ({:+.3}): the recordings determine a combination of them better than each \
                     alone",
                    names[j], names[i], correlations[i][j]
                ));
            }
        }
    }
    found.correlations = (names, correlations);
    found.verdict = words;
    found.settings = question.settings.iter().map(Setting::named).collect();
    let residuals = problem.residuals(&minimum.answer.motion, &minimum.x);
    found.residuals = problem
        .channels
        .iter()
        .zip(&residuals)
        .map(|(channel, residual)| {
            let record = &problem.records[channel.recording];
            let name = &question.outputs[channel.output];
            let description = problem.model.description();
            let unit = description.variable(name).map_or("1", |v| description.unit(v));
            Residual {
                name: format!("{}, {name}", record.name),
                label: prose(if unit.is_empty() { "1" } else { unit }),
                time: channel.picked(&record.time),
                measured: channel.picked(&record.outputs[channel.output]),
                residual: channel.picked(residual),
                noise: Some(channel.noise.white),
                torque: None,
            }
        })
        .collect();
    Ok(found)
}

/// Sentence about intervals of a fit without tolerances.
const NOISE_ALONE: &str = "The intervals include noise alone: settings, inputs and the clock count as exact. --tolerance states how sure they are.";

/// Writes remarks about one estimate.
fn say(
    unknown: &Unknown,
    e: &Estimated,
    interval: &Interval,
    is_inner: bool,
    std: f64,
    details: &mut Details,
    words: &mut Vec<String>,
) {
    let name = &unknown.name;
    let unit = prose(&unknown.unit);
    let unit = if unit == "1" || unit.is_empty() { String::new() } else { format!(" {unit}") };
    if !std.is_finite() || interval.ended == [false, false] && is_inner {
        details.not_determined.push(name.clone());
        let is_of_a_set =
            |set: &Inseparable| set.direction.len() > 1 && set.direction.contains_key(name);
        if std.is_finite() {
            words.push(format!(
                "{name} is not determined: any value from {:.4e} to {:.4e}{unit} fits equally well",
                interval.ends[0], interval.ends[1]
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
            e.value
        ));
        return;
    }
    if !is_inner {
        let upper = e.value >= unknown.bounds.1;
        let (which, other) = if upper { ("upper", 0) } else { ("lower", 1) };
        details.at_bound.push(name.clone());
        words.push(format!(
            "{name} is at its {which} bound, {}{unit}: the minimum lies beyond it; its 95 % interval reaches from there to \
             {:.4e}{unit}",
            e.value, interval.ends[other]
        ));
    } else if !interval.quadratic {
        details.not_quadratic.push(name.clone());
        let open = match interval.ended {
            [true, true] => String::new(),
            [false, _] => "; its lower end is the bound".into(),
            [_, false] => "; its upper end is the bound".into(),
        };
        words.push(format!(
            "{name}: the likelihood is not a parabola; its 95 % interval is {:.5e} to {:.5e}{unit}{open}",
            interval.ends[0], interval.ends[1]
        ));
    }
}

fn fit_in_words(outputs: &[Output]) -> String {
    let is_bad = |o: &&Output| !o.passed();
    let worst = outputs.iter().filter(is_bad).max_by(|a, b| {
        a.tests.worst().max(a.mean.abs()).total_cmp(&b.tests.worst().max(b.mean.abs()))
    });
    let Some(o) = worst else {
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

/// Lines for a terminal, below the table of estimates.
pub fn lines(found: &Identification) -> Vec<String> {
    let mut lines = vec![format!(
        "{:24} {:>8} {:>12} {:>8} {:>10}",
        "output", "rows", "noise", "fit %", "worst test"
    )];
    for o in &found.details.outputs {
        // an output that stands still has no share that is explained
        let fit = match o.fit_percent.is_finite() {
            true => format!("{:.2}", o.fit_percent),
            false => "–".into(),
        };
        lines.push(format!(
            "{:24} {:>8} {:>12.3e} {fit:>8} {:>10.1}  {}",
            o.name,
            o.rows,
            o.noise_white,
            o.tests.worst().max(o.mean.abs()),
            o.recording
        ));
    }
    lines
}

/// The page, in HTML.
pub fn page(found: &Identification) -> String {
    page::write(found)
}

//! The likelihood of an identification at other points, for those who sample the posterior (Markov chain Monte Carlo).

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde_json::Value;

use crate::fit::problem::Problem;
use crate::input::question::Question;
use crate::input::record::Record;
use crate::model::simulate::{Model, Setup};
use analysis::gauss_markov::Noise;

/// −2 ln L but for a constant, priors in it, of each point: values of the unknowns in the order of the result's correlations.
/// Noise and left-out rows are those of the result, a `result.json`. Infinite outside the bounds, and where the FMU refuses.
///
/// # Errors
/// If the result is of another question.
pub fn deviances(
    model: &Model,
    question: &Question,
    records: &[Record],
    result: &str,
    points: &[Vec<f64>],
) -> Result<Vec<f64>> {
    let result: Value = serde_json::from_str(result).context("the result cannot be read")?;
    let setup = Setup::new(question, model.description())?;
    let unknowns = question.unknowns(model.description(), records)?;
    let other = "the result belongs to another question: its unknowns or outputs differ";
    let estimate = |name: &str| {
        let of = |kind: &str| result[kind][name]["value"].as_f64();
        of("parameters").or_else(|| of("measurement")).context(other)
    };
    let x = unknowns.iter().map(|u| estimate(&u.name)).collect::<Result<Vec<f64>>>()?;
    let mut problem = Problem::new(model, &setup, records, unknowns, 1.0);
    let outputs = result["outputs"].as_array().context(other)?;
    ensure!(outputs.len() == problem.channels.len(), "{other}");
    for (channel, output) in problem.channels.iter_mut().zip(outputs) {
        let white = output["noise_white"].as_f64().context(other)?;
        let drift = output["drift"].as_array().and_then(|d| Some((d[0].as_f64()?, d[1].as_f64()?)));
        channel.noise = match drift {
            Some((std, time)) => Noise { white, drift: std / white, time },
            None => Noise::white(white),
        };
    }
    let motion = problem.answer(&x)?.motion;
    problem.leave_out_jumps(&motion);
    let inside = |point: &[f64]| {
        problem.unknowns.iter().zip(point).all(|(u, x)| (u.bounds.0..=u.bounds.1).contains(x))
    };
    let one = |point: &Vec<f64>| -> Result<f64> {
        ensure!(
            point.len() == x.len(),
            "a point has {} values (allowed: {})",
            point.len(),
            x.len()
        );
        let answer = if inside(point) { problem.answer(point).ok() } else { None };
        Ok(answer.map_or(f64::INFINITY, |answer| answer.e.norm_squared()))
    };
    points.par_iter().map(one).collect()
}

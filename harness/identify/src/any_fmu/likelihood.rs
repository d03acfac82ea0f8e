//! The likelihood of an identification at given points, for users who sample the posterior (Markov chain Monte Carlo).

use analysis::gauss_markov::Noise;
use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde_json::Value;

use super::leave_out_jumps;
use super::system::FmuSystem;
use crate::engine::Fit;
use crate::input::question::Question;
use crate::input::record::Record;
use crate::model::simulate::Model;

/// Returns the deviance −2 ln L of each point, including the priors, up to a constant. A point holds the values of the
/// unknowns in the order of the result's correlations. The noise and the rows that are left out are read from `result`, the
/// text of a `result.json`. The deviance is infinite outside the bounds and where the FMU refuses the values.
///
/// # Errors
/// If the result belongs to another question, or a point has a wrong number of values.
pub fn deviances(
    model: &Model,
    question: &Question,
    records: &[Record],
    result: &str,
    points: &[Vec<f64>],
) -> Result<Vec<f64>> {
    let result: Value = serde_json::from_str(result).context("the result cannot be read")?;
    let (system, unknowns) = FmuSystem::new(model, question, records)?;
    let mut problem = system.problem(unknowns, question);
    let other = "the result belongs to another fit: its unknowns or outputs differ";
    let estimate = |name: &str| {
        let of = |kind: &str| result[kind][name]["value"].as_f64();
        of("parameters").or_else(|| of("measurement")).context(other)
    };
    let x = problem.unknowns.iter().map(|u| estimate(&u.name)).collect::<Result<Vec<f64>>>()?;
    let outputs = result["outputs"].as_array().context(other)?;
    ensure!(outputs.len() == problem.signals.len(), "{other}");
    let noise = |output: &Value| -> Result<Noise> {
        let white = output["noise_white"].as_f64().context(other)?;
        let drift = output["drift"].as_array().and_then(|d| Some((d[0].as_f64()?, d[1].as_f64()?)));
        Ok(match drift {
            Some((std, time)) => Noise { white, drift: std / white, time },
            None => Noise::white(white),
        })
    };
    let noise = outputs.iter().map(noise).collect::<Result<Vec<Noise>>>()?;
    let motion = Fit::new(&problem).at(&x)?.motion;
    leave_out_jumps(&mut problem.signals, records, &motion, &noise);
    let mut fit = Fit::new(&problem);
    fit.set(noise, 1.0);
    let one = |point: &Vec<f64>| -> Result<f64> {
        let is_inside =
            |(u, x): (&crate::engine::Unknown, &f64)| (u.bounds.0..=u.bounds.1).contains(x);
        ensure!(
            point.len() == x.len(),
            "a point has {} values (allowed: {})",
            point.len(),
            x.len()
        );
        let inside = problem.unknowns.iter().zip(point).all(is_inside);
        let there = if inside { fit.at(point).ok() } else { None };
        Ok(there.map_or(f64::INFINITY, |there| there.cost))
    };
    points.par_iter().map(one).collect()
}

//! The error budget: what an error of something that is not estimated does to the estimates.

use std::collections::BTreeMap;

use anyhow::Result;
use nalgebra::DMatrix;
use serde::Serialize;

use crate::fit::{Answer, Problem};
use crate::nominal;
use crate::simulate::Intersample;
use crate::uncertainty::Covariance;

/// What an error of something that is not estimated does to the estimates.
#[derive(Clone, Debug, Serialize)]
pub struct Effect {
    /// What is wrong, and by how much.
    pub source: String,
    /// Change of each parameter, SI.
    pub change: BTreeMap<String, f64>,
}

/// A source of error: what may be wrong.
struct Source {
    name: &'static str,
    settings: Vec<(String, String)>,
    /// Factor of the torque.
    gain: f64,
    /// How much of what `name` says is tried; the estimates' change is taken as proportional.
    part: f64,
    /// The torque is held between rows where it was taken as linear, or the reverse.
    swap: bool,
}

/// How much of a number's error is tried: a long recording tells 0.1 % of g_axial by hundreds of standard deviations.
const PART: f64 = 0.1;
/// Rounds of [`of`]; each leaves a few tenths of the error before it.
const ROUNDS: usize = 10;
/// Step, in standard deviations, after which the estimates stay.
const SETTLED: f64 = 0.05;

/// The shift of the estimates when they are fitted anew: Gauss–Newton steps −(JᵀJ)⁻¹ Jᵀ Δe with the Jacobian that
/// there is, Δe the innovations' change. One step would not do: what of Δe is of second order looks like a large error
/// in weak directions, friction's. A source with which they do not settle is left out:
/// torque held in place of linear where no delay is estimated, which no fit could take for the bench.
pub fn of(
    problem: &Problem,
    x: &[f64],
    answer: &Answer,
    jacobian: &DMatrix<f64>,
    covariance: &Covariance,
) -> Result<Vec<Effect>> {
    let base = problem.stacked(answer, x);
    let mut effects = Vec::new();
    for source in list(problem)? {
        let mut recordings = problem.recordings.to_vec();
        recordings.iter_mut().flat_map(|r| &mut r.torque).for_each(|t| *t *= source.gain);
        let mut other = Problem { recordings: &recordings, ..problem.clone() };
        other.setup.settings.extend(source.settings);
        if source.swap {
            other.setup.intersample = match problem.setup.intersample {
                Intersample::ZeroOrderHold => Intersample::FirstOrderHold,
                Intersample::FirstOrderHold | Intersample::BandLimited => {
                    Intersample::ZeroOrderHold
                }
            };
        }
        let (mut there, mut last) = (x.to_vec(), f64::INFINITY);
        for _ in 0..ROUNDS {
            let Ok(answer) = other.answer(&there) else { break };
            let change = other.stacked(&answer, &there) - &base;
            let step = -(&covariance.x * jacobian.tr_mul(&change));
            there.iter_mut().zip(step.iter()).for_each(|(x, step)| *x += step);
            let length = (jacobian * &step).norm();
            if !length.is_finite() || length > 2.0 * last {
                break;
            }
            last = length;
            if length < SETTLED {
                break;
            }
        }
        if last >= SETTLED {
            continue;
        }
        let values = problem.values(x).into_iter().zip(problem.values(&there));
        let change = problem.unknowns.iter().zip(values);
        let change =
            change.map(|(u, (before, after))| (u.quantity.name(), (after - before) / source.part));
        effects.push(Effect { source: source.name.into(), change: change.collect() });
    }
    Ok(effects)
}

fn list(problem: &Problem) -> Result<Vec<Source>> {
    let mut instance = nominal::initialised(problem.fmu, &problem.setup.settings)?;
    let exact = |name, settings| Source { name, settings, gain: 1.0, part: 1.0, swap: false };
    let small = |name, settings| Source { part: PART, ..exact(name, settings) };
    let mut list = Vec::new();
    if problem.index("slosh.zeta").is_some() {
        let mut set = |name: &str, change: &dyn Fn(f64) -> f64| -> Result<_> {
            Ok(vec![(name.to_string(), change(instance.real(name)?).to_string())])
        };
        let modes = vec![("slosh.modes".to_string(), "4".to_string())];
        list.push(exact("slosh modes 2 to 4, left out", modes));
        list.push(small("tank.r wrong by 1 mm", set("tank.r", &|r| r + PART * 1e-3)?));
        let density = set("fluid.rho", &|rho| rho * (1.0 + PART * 0.003))?;
        list.push(small("fluid.rho wrong by 0.3 %", density));
        let measured = problem.recordings.iter().any(|r| r.gravity.is_some());
        if !measured {
            let gravity = set("g_axial", &|g| g * (1.0 + PART * 0.001))?;
            list.push(small("g_axial wrong by 0.1 %", gravity));
        }
    }
    list.push(Source { gain: 1.0 + PART * 0.01, ..small("torque wrong by 1 %", vec![]) });
    let held = "torque held between rows instead of linear, or the reverse";
    list.push(Source { swap: true, ..exact(held, vec![]) });
    Ok(list)
}

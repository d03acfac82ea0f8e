//! The error budget: the effect on the estimates of errors in quantities that are not estimated.
//!
//! The minimum is sought again with the error in place. e are the innovations, J their sensitivities, q the quantity with the
//! error:
//!
//! ```text
//! x̂ ← x̂ − (JᵀJ)⁻¹ Jᵀ (e(x̂; q + Δq) − e(x; q))
//! ```
//!
//! The uncertainty σ_q adds σ_q² (dx̂/dq)(dx̂/dq)ᵀ to the covariance of x̂, as if q were one more unknown with a prior.

use std::collections::BTreeMap;

use anyhow::{Result, bail, ensure};
use host::causality::Causality;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::estimate::{Estimated, prose};
use crate::fit::bench::problem::{Answer, Polished, Problem};
use crate::fit::covariance::Covariance;
use crate::input::tolerance::{NAMES, Tolerances};
use crate::model::bench::nominal::{self, Bench};
use crate::model::bench::tank;
use crate::model::bench::unknown::{Quantity, Unknown};
use crate::tuning::{
    BUDGET_LEAVES, BUDGET_ROUNDS, BUDGET_SETTLED, BUDGET_SIZE, BUDGET_STEP, SHOWN_TOLERANCE,
};
use names::hubslosh::{self, G_AXIAL, fluid, friction, hub, slosh};

/// Effect of an error of something that is not estimated.
#[derive(Clone, Debug, Serialize)]
pub struct Effect {
    /// The error and its size, in words.
    pub source: String,
    /// Change of each parameter, SI.
    pub change: BTreeMap<String, f64>,
    /// True for a tolerance, which is a standard deviation and part of the intervals.
    pub tolerance: bool,
    /// Change of the variables x.
    #[serde(skip)]
    pub x: DVector<f64>,
}

/// Effect of an error of something that is known within a tolerance.
pub struct Slope {
    /// Name.
    name: &'static str,
    /// Relative standard deviation of what is known of it.
    tolerance: f64,
    /// Change of the stacked innovations by an error of that size, the unknowns being held.
    pub change: DVector<f64>,
    /// Change of the variables x at the minimum by the same error.
    pub moved: DVector<f64>,
    /// Reason why both are of first order at the minimum only; `None`: the fit was repeated with the error.
    refused: Option<String>,
}

/// Returns the effects of all tolerances that count, at a minimum.
///
/// # Errors
/// If the FMU refuses to run.
pub fn slopes(problem: &Problem, found: &Polished, tolerances: &Tolerances) -> Result<Vec<Slope>> {
    let sloshes = problem.index(slosh::ZETA).is_some();
    let mut slopes = Vec::new();
    for (name, tolerance) in NAMES.into_iter().zip(tolerances.all()) {
        let estimated = problem.index(name).is_some();
        let recorded = name == G_AXIAL && problem.recordings.iter().any(|r| r.gravity.is_some());
        let unseen = !sloshes && matches!(name, G_AXIAL);
        if tolerance == 0.0 || estimated || recorded || unseen {
            continue;
        }
        let at = (&found.x[..], &found.answer, &found.jacobian);
        slopes.push(refit(problem, at, name, tolerance)?);
    }
    Ok(slopes)
}

/// Returns a sentence on the tolerances whose effect is of first order only, if there are any.
pub fn first_order(slopes: &[Slope]) -> Option<String> {
    let word = |s: &Slope| s.refused.as_ref().map(|why| format!("{} ({why})", s.name));
    let all: Vec<String> = slopes.iter().filter_map(word).collect();
    (!all.is_empty()).then(|| {
        format!(
            "The fit could not be repeated with errors of {}. Their effect is of first order, and intervals may be too narrow.",
            all.join(", ")
        )
    })
}

/// Returns the parameters of the FMU whose tolerances the recordings show, as unknowns with priors. An error of one standard deviation
/// then moves the innovations by more than [`SHOWN_TOLERANCE`], and no unknown can take that. For linear slosh there are none.
/// Nonlinear slosh shows its angle, and so the arm.
///
/// # Errors
/// If the FMU refuses its settings.
pub fn shown(problem: &Problem, found: &Polished, slopes: &[Slope]) -> Result<Vec<Unknown>> {
    let Polished { jacobian, covariance, .. } = found;
    let is_shown = |slope: &&Slope| {
        let taken = jacobian * (&covariance.x * jacobian.tr_mul(&slope.change));
        (&slope.change - taken).norm() > SHOWN_TOLERANCE
    };
    let description = problem.fmu.description();
    let mut instance = nominal::initialised(problem.fmu, &problem.setup.settings)?;
    let mut unknowns = Vec::new();
    for slope in slopes.iter().filter(is_shown) {
        let variable = description.variable(slope.name).ok();
        let Some(variable) = variable.filter(|v| v.causality == Causality::Parameter) else {
            continue;
        };
        let (value, unit) = (instance.real(slope.name)?, variable.attributes().unit.clone());
        let unknown = Unknown::positive(slope.name, &unit.unwrap_or_default(), value);
        let known = unknown.known(value, slope.tolerance * value);
        unknowns.push(known.within_range_of(description));
    }
    Ok(unknowns)
}

/// Returns a sentence on a parameter that is estimated because its tolerance leaves more than noise in the residual.
pub fn shown_words(name: &str, found: &Estimated) -> String {
    format!(
        "{name} is estimated within its tolerance, because its nominal value leaves more than noise: {:.4e} ± {:.1e} {}.",
        found.value,
        found.std,
        prose(&found.unit)
    )
}

/// Returns the derivative of the stacked innovations by the logarithm of `torque`, `clock` or a parameter of the FMU that is not
/// estimated, at a minimum.
///
/// # Errors
/// If the FMU refuses to run.
pub fn relative_slope(
    problem: &Problem,
    at: (&[f64], &Answer, &DMatrix<f64>),
    name: &'static str,
) -> Result<DVector<f64>> {
    Ok(refit(problem, at, name, BUDGET_SIZE)?.change / BUDGET_SIZE)
}

/// The same problem with an error of this relative size in what is not estimated.
fn with_error(
    problem: &Problem,
    name: &str,
    size: f64,
    then: impl FnOnce(&Problem) -> Result<(DVector<f64>, DVector<f64>)>,
) -> Result<(DVector<f64>, DVector<f64>)> {
    let factor = 1.0 + size;
    let mut recordings = problem.recordings.to_vec();
    let mut other = problem.clone();
    match name {
        "torque" => recordings.iter_mut().flat_map(|r| &mut r.torque).for_each(|t| *t *= factor),
        "clock" => recordings.iter_mut().flat_map(|r| &mut r.time).for_each(|t| *t *= factor),
        _ => {
            let instance = nominal::initialised(problem.fmu, &problem.setup.settings);
            let value = instance?.real(name)? * factor;
            other.setup.settings.push((name.into(), value.to_string()));
        }
    }
    then(&Problem { recordings: &recordings, ..other })
}

/// Change of the innovations at x by an error of this size, and how far the minimum moves.
///
/// The minimum is sought anew with the error, by Gauss and Newton's steps with the sensitivities that there are. It begins at the bench that has the
/// same motion under the error ([`same_motion`]). A difference at fixed x would be wrong: if dry friction makes the hub stick,
/// the instants of sticking jump with the torque. The sensitivities to b, c, d and the asymmetry could compensate that jump, but
/// not in such a difference. Where the steps do not settle, the first order at x is taken, and the verdict names it.
fn refit(
    problem: &Problem,
    (x, answer, jacobian): (&[f64], &Answer, &DMatrix<f64>),
    name: &'static str,
    size: f64,
) -> Result<Slope> {
    let slope = |(change, moved), refused| Slope { name, tolerance: size, change, moved, refused };
    let covariance = problem.covariance(jacobian)?;
    let base = problem.stacked(answer, x);
    let refitted = with_error(problem, name, size, |other| {
        let there = same_motion(problem, x, name, 1.0 + size).unwrap_or_else(|| x.to_vec());
        settled(other, (x, &base), (jacobian, &covariance), there)
    });
    let refused = match refitted {
        Ok(found) => return Ok(slope(found, None)),
        Err(error) => format!("{error:#}"),
    };
    let found = with_error(problem, name, BUDGET_STEP, |other| {
        let change = (other.stacked(&other.answer(x)?, x) - &base) * (size / BUDGET_STEP);
        let moved = -(&covariance.x * jacobian.tr_mul(&change));
        Ok((change, moved))
    })?;
    Ok(slope(found, Some(refused)))
}

/// Seeks the minimum of another problem from `there` by Gauss–Newton steps with the sensitivities of the problem at x, where the
/// stacked innovations are `base`. Returns the change of the innovations that no step explains, and how far the minimum is from x.
///
/// # Errors
/// If the steps do not settle, or the FMU refuses to run.
fn settled(
    other: &Problem,
    (x, base): (&[f64], &DVector<f64>),
    (jacobian, covariance): (&DMatrix<f64>, &Covariance),
    mut there: Vec<f64>,
) -> Result<(DVector<f64>, DVector<f64>)> {
    let off = |there: &[f64]| {
        DVector::from_iterator(x.len(), there.iter().zip(x).map(|(there, x)| there - x))
    };
    let mut last = f64::INFINITY;
    for _ in 0..BUDGET_ROUNDS {
        let change = other.stacked(&other.answer(&there)?, &there) - base;
        let step = -(&covariance.x * jacobian.tr_mul(&change));
        let explained = change - jacobian * off(&there);
        there.iter_mut().zip(step.iter()).for_each(|(x, step)| *x += step);
        let length = (jacobian * &step).norm();
        ensure!(length.is_finite() && length <= 2.0 * last, "the steps do not settle");
        let next =
            if last.is_finite() { length * (length / last).max(BUDGET_LEAVES) } else { length };
        last = length;
        if next < BUDGET_SETTLED {
            return Ok((explained, off(&there)));
        }
    }
    bail!("the steps do not settle")
}

/// The variables of the bench that moves the same though what is not estimated is `factor` times as large:
///
/// ```text
/// torque    b, c, d, I₀ and the mode's mass in proportion
/// clock     I₀ and the mass in proportion, the mode's length as the square, the delay in proportion
/// g_axial   the length in proportion
/// tank.r    the mass as the inverse square
/// fluid.rho the same mass
/// ```
///
/// I₀ is the inertia that turns with the hub. The law is exact for one linear mode (`tank.rs` has l, m and I₀ of d, h and I), and
/// for the torque of any liquid with one mode. `None` where the inertia is not estimated.
fn same_motion(problem: &Problem, x: &[f64], name: &str, factor: f64) -> Option<Vec<f64>> {
    let (bench, hub) = (problem.bench?, problem.index(hub::I)?);
    let (force, mass, length) = match name {
        "torque" => (factor, factor, 1.0),
        "clock" => (factor, factor, factor * factor),
        G_AXIAL => (1.0, 1.0, factor),
        hubslosh::tank::R => (1.0, factor.powi(-2), 1.0),
        fluid::RHO => (1.0, 1.0, 1.0),
        _ => return None,
    };
    let then = Bench {
        arm: bench.arm * if name == hubslosh::tank::R { factor } else { 1.0 },
        density: bench.density * if name == fluid::RHO { factor } else { 1.0 },
        ..bench
    };
    let values = problem.values(x);
    let mut there = x.to_vec();
    let set = |place: usize, value: f64, there: &mut Vec<f64>| {
        there[place] = problem.unknowns[place].scale.variable(value);
    };
    let inertia = match tank::Indices::of(&problem.unknowns) {
        Some(tank) => {
            let (d, h) = (values[tank.d], values[tank.h]);
            let mode = formulas::cylinder::pendulum(0, d, h, bench.liquid(d, h));
            let rigid = bench.inertia(bench.liquid(d, h) - mode.mass);
            let (mut new_d, mut new_h) = formulas::cylinder::tank_of_first_mode(
                mode.length * length,
                mode.mass * mass,
                then.density,
            );
            // a tank so deep that its mode says nothing of the fill stays as it is
            let reached = then.slosh_mass(new_d, new_h) / (mode.mass * mass);
            if !(new_h.is_finite() && (reached - 1.0).abs() < 1e-6) {
                (new_d, new_h) = (d, h);
            }
            set(tank.d, new_d, &mut there);
            set(tank.h, new_h, &mut there);
            let new_rigid = then.inertia(then.liquid(new_d, new_h) - then.slosh_mass(new_d, new_h));
            (values[hub] + rigid) * force - new_rigid
        }
        None => {
            let mut liquid = nominal::initialised(problem.fmu, &problem.setup.settings).ok()?;
            let liquid = liquid.real(hubslosh::tank::M_LIQ).ok()?;
            let then_liquid = liquid * then.density / bench.density;
            (values[hub] + bench.inertia(liquid)) * force - then.inertia(then_liquid)
        }
    };
    if inertia <= 0.0 {
        return None;
    }
    set(hub, inertia, &mut there);
    if name == "torque" {
        for friction in [friction::B, friction::C, friction::D] {
            if let Some(place) = problem.index(friction) {
                set(place, values[place] * factor, &mut there);
            }
        }
    }
    for (place, unknown) in problem.unknowns.iter().enumerate() {
        if name == "clock" && matches!(unknown.quantity, Quantity::Delay | Quantity::AngleDelay) {
            set(place, values[place] * factor, &mut there);
        }
    }
    Some(there)
}

/// Returns the effects of possible errors at the minimum x, the tolerances first, and a sentence if that of higher slosh modes is
/// not known.
pub fn of(
    problem: &Problem,
    (x, answer): (&[f64], &Answer),
    jacobian: &DMatrix<f64>,
    covariance: &Covariance,
    slopes: &[Slope],
) -> (Vec<Effect>, Option<String>) {
    let effect = |source: String, change: DVector<f64>, tolerance: bool| {
        let there: Vec<f64> = x.iter().zip(change.iter()).map(|(x, change)| x + change).collect();
        let values = problem.values(x).into_iter().zip(problem.values(&there));
        let changes = problem.unknowns.iter().zip(values);
        let changes = changes.map(|(u, (before, after))| (u.quantity.name(), after - before));
        Effect { source, change: changes.collect(), tolerance, x: change }
    };
    let of_slope = |slope: &Slope| {
        let source = format!("{} wrong by {}", slope.name, percent(slope.tolerance));
        effect(source, slope.moved.clone(), true)
    };
    let mut effects: Vec<Effect> = slopes.iter().map(of_slope).collect();
    let unknown = match modes(problem, (x, answer), jacobian, covariance) {
        Ok(change) => {
            let source = "slosh modes 2 to 4, left out".to_string();
            effects.extend(change.map(|change| effect(source, change, false)));
            None
        }
        Err(error) => Some(format!(
            "The effect of slosh modes 2 to 4, which are left out, is not known: the fit could not be repeated with them ({error:#}). \
             A second fit with --set slosh.modes=4 shows it."
        )),
    };
    (effects, unknown)
}

/// A share in percent.
pub fn percent(part: f64) -> String {
    let text = format!("{:.4}", 100.0 * part);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

/// Returns the change of x when the model is fitted anew with four modes; `None` if the liquid does not slosh or `slosh.modes` is
/// set. One step would not do: what of the innovations' change is of second order looks like a large error in weak directions,
/// friction's.
///
/// # Errors
/// If the steps do not settle, or the FMU refuses to run.
fn modes(
    problem: &Problem,
    (x, answer): (&[f64], &Answer),
    jacobian: &DMatrix<f64>,
    covariance: &Covariance,
) -> Result<Option<DVector<f64>>> {
    let is_set = problem.setup.settings.iter().any(|(name, _)| name == slosh::MODES);
    if is_set || problem.index(slosh::ZETA).is_none() {
        return Ok(None);
    }
    let base = problem.stacked(answer, x);
    let mut other = problem.clone();
    other.setup.settings.push((slosh::MODES.into(), "4".into()));
    let (_, moved) = settled(&other, (x, &base), (jacobian, covariance), x.to_vec())?;
    Ok(Some(moved))
}

/// Contribution of tolerances to the covariance of x.
pub fn of_tolerances(effects: &[Effect], n: usize) -> DMatrix<f64> {
    let each = effects.iter().filter(|effect| effect.tolerance).map(|e| &e.x * e.x.transpose());
    each.fold(DMatrix::zeros(n, n), |sum, one| sum + one)
}

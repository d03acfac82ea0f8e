//! The intervals of tank and hub where the tank is deep.
//!
//! ```text
//! l = d/(2ξ T),   m = ρ π d³ T/(4 ξ (ξ² − 1)) ~ ρ l³ T⁴,   I₀ = I + r² (ρ π d² h/4 − m),   T = tanh(2 ξ h/d)
//! ```
//!
//! A recording shows l, m and I₀ (`tank.rs`); they are normally distributed, and so is ln T. d, h and I are not if T is near 1: h
//! then follows from the last thousandths of T. To first order in d, h and I it would seem that T is known, and h from below with
//! it. The sensitivities to (ln l, ln T, ln I₀) come from those to d, h and I and to the density, which changes m as T⁴ does,
//!
//! ```text
//! e_T = 4 (e_ρ − a e_I),   e_l = e_d + e_h − 3 a e_I,   e_I₀ = (I₀/I) e_I,   a = r² (m_liq − m)/I,   all of logarithms,
//! ```
//!
//! and the intervals are quantiles of draws from their normal distribution where T < 1 and I > 0.

use analysis::random::Random;
use anyhow::Result;
use formulas::cylinder::XI;
use nalgebra::{DMatrix, DVector};
use names::hubslosh::fluid;

use crate::fit::bench::problem::{Answer, Problem};
use crate::fit::covariance::Covariance;
use crate::model::bench::nominal::Bench;
use crate::model::bench::tank::Indices;
use crate::tuning::{DEEP, DEEP_DRAWS, FEWEST_DRAWS};

/// 95 % intervals of d, h and I with the places of these among the unknowns.
pub struct Intervals(pub [(usize, [f64; 2]); 3]);

/// Information at the minimum.
pub struct Minimum<'a> {
    /// Variables of the unknowns.
    pub x: &'a [f64],
    /// The FMU's answer.
    pub answer: &'a Answer,
    /// Sensitivities of the stacked innovations.
    pub jacobian: &'a DMatrix<f64>,
    /// The stacked innovations.
    pub e: &'a DVector<f64>,
    /// Their changes by what is known within tolerances, of one standard deviation each.
    pub tolerances: Vec<&'a DVector<f64>>,
    /// More covariance of x, for other reasons.
    pub more: &'a DMatrix<f64>,
    /// Factor of the whole covariance.
    pub wider: f64,
}

/// `None` where tank and hub are not all unknown, without knowledge of their own, or the tank is not deep.
pub fn intervals(problem: &Problem, at: &Minimum) -> Result<Option<Intervals>> {
    let Some((indices, bench)) = Indices::of(&problem.unknowns).zip(problem.bench) else {
        return Ok(None);
    };
    let Some(hub) = indices.hub else { return Ok(None) };
    let places = [indices.d, indices.h, hub];
    if places.iter().any(|&j| problem.unknowns[j].prior.is_some() && !problem.unknowns[j].vague) {
        return Ok(None);
    }
    let values = problem.values(at.x);
    let [d, h, inertia] = places.map(|j| values[j]);
    let seen = Seen::of(bench, [d, h, inertia]);
    // ∂ ln value/∂x
    let logarithmic = places.map(|j| problem.unknowns[j].scale.slope(at.x[j]) / values[j]);
    let by_t = 2.0 * XI[0] * h / d * (1.0 - seen.t * seen.t) / seen.t;
    let density = crate::uncertainty::bench::budget::relative_slope(
        problem,
        (at.x, at.answer, at.jacobian),
        fluid::RHO,
    )?;
    let column = |k: usize| at.jacobian.column(places[k]) / logarithmic[k];
    let [e_d, e_h, e_hub] = [column(0), column(1), column(2)];
    let a = bench.inertia(bench.liquid(d, h) - bench.slosh_mass(d, h)) / inertia;
    let mut jacobian = at.jacobian.clone();
    jacobian.set_column(places[0], &(e_d + e_h - &e_hub * (3.0 * a)));
    jacobian.set_column(places[1], &((density - &e_hub * a) * 4.0));
    jacobian.set_column(places[2], &(&e_hub * (seen.inertia / inertia)));
    let Some(covariance) = Covariance::of(&jacobian, &problem.names())? else { return Ok(None) };
    let step = -(&covariance.x * jacobian.tr_mul(at.e));
    let by_tolerances = at.tolerances.iter().map(|change| {
        let moved = &covariance.x * jacobian.tr_mul(change);
        &moved * moved.transpose()
    });
    let all = by_tolerances.fold(covariance.x.clone(), |sum, one| sum + one);
    // (ln l, ln T, ln I₀) by the logarithms of d, h and I: of what else makes these uncertain
    let moved = |k: usize| {
        let by = 1e-6;
        let mut values = [d, h, inertia];
        values[k] *= 1.0 + by;
        let there = Seen::of(bench, values).logarithms();
        DVector::from_iterator(3, (0..3).map(|i| (there[i] - seen.logarithms()[i]) / by))
            * logarithmic[k]
    };
    let map = DMatrix::from_columns(&[moved(0), moved(1), moved(2)]);
    let of_three = |matrix: &DMatrix<f64>| matrix.select_rows(&places).select_columns(&places);
    let spread = (of_three(&all) + &map * of_three(at.more) * map.transpose()) * at.wider;
    if spread[(1, 1)].sqrt() < DEEP * by_t {
        return Ok(None);
    }
    let mean = seen.logarithms();
    let mean = [0, 1, 2].map(|i| mean[i] + step[places[i]]);
    let Some(ends) = quantiles(bench, mean, &spread) else { return Ok(None) };
    // the best fit is in its own interval
    let with = |k: usize| [ends[k][0].min(values[places[k]]), ends[k][1].max(values[places[k]])];
    Ok(Some(Intervals([0, 1, 2].map(|k| (places[k], with(k))))))
}

/// Quantities of tank and hub that a recording shows.
struct Seen {
    length: f64,
    t: f64,
    /// I₀.
    inertia: f64,
}

impl Seen {
    /// Returns the quantities for d, h and I.
    fn of(bench: Bench, [d, h, inertia]: [f64; 3]) -> Self {
        let t = (2.0 * XI[0] * h / d).tanh();
        let rigid = bench.liquid(d, h) - bench.slosh_mass(d, h);
        Seen { length: d / (2.0 * XI[0] * t), t, inertia: inertia + bench.inertia(rigid) }
    }

    fn logarithms(&self) -> [f64; 3] {
        [self.length, self.t, self.inertia].map(f64::ln)
    }

    /// d, h and I; `None` where there is no such tank or hub.
    fn values(bench: Bench, logarithms: [f64; 3]) -> Option<[f64; 3]> {
        let [length, t, inertia] = logarithms.map(f64::exp);
        let d = 2.0 * XI[0] * length * t;
        let h = t.atanh() * d / (2.0 * XI[0]);
        let hub = inertia - bench.inertia(bench.liquid(d, h) - bench.slosh_mass(d, h));
        (h.is_finite() && hub > 0.0).then_some([d, h, hub])
    }
}

/// The quantiles 2.5 and 97.5 % of d, h and I where (ln l, ln T, ln I₀) is normal, with ln T below 0.
fn quantiles(bench: Bench, mean: [f64; 3], spread: &DMatrix<f64>) -> Option<[[f64; 2]; 3]> {
    // ln T first, the others given it
    let order = [1, 0, 2];
    let ordered = spread.select_rows(&order).select_columns(&order);
    let factor = ordered.cholesky()?.l();
    let deviation = factor[(0, 0)];
    let beyond = mean[1] / deviation;
    let mut random = Random::new(1, 0);
    let mut draws: [Vec<f64>; 3] = Default::default();
    for _ in 0..DEEP_DRAWS {
        // far beyond 0 the tail is exponential
        let first = match beyond > 2.0 {
            true => (1.0 - random.uniform()).ln() / beyond - beyond,
            false => random.normal(),
        };
        let normals = DVector::from_vec(vec![first, random.normal(), random.normal()]);
        let off = &factor * normals;
        let drawn = [mean[0] + off[1], mean[1] + off[0], mean[2] + off[2]];
        if let (true, Some(values)) = (drawn[1] < 0.0, Seen::values(bench, drawn)) {
            draws.iter_mut().zip(values).for_each(|(draws, value)| draws.push(value));
        }
    }
    if draws[0].len() < FEWEST_DRAWS {
        return None;
    }
    Some(draws.map(|mut draws| {
        draws.sort_by(f64::total_cmp);
        let at = |part: f64| draws[(part * (draws.len() - 1) as f64).round() as usize];
        [at(0.025), at(0.975)]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BENCH: Bench = Bench { arm: 0.225, density: 1000.0, gravity: 9.81 };

    /// Standard deviations of ln l, ln T and ln I₀, independent.
    fn spread(deviations: [f64; 3]) -> DMatrix<f64> {
        DMatrix::from_diagonal(&DVector::from_iterator(3, deviations.map(|s| s * s)))
    }

    #[test]
    fn diameter_fill_and_inertia_follow_from_the_quantities_that_a_recording_determines() {
        for values in [[0.163, 0.05, 0.32], [0.163, 0.1, 0.32], [0.126, 0.13, 0.25]] {
            let back = Seen::values(BENCH, Seen::of(BENCH, values).logarithms()).unwrap();
            for (value, back) in values.iter().zip(back) {
                // tanh loses up to three digits: 1 − T is 1e-3
                assert!((back / value - 1.0).abs() < 1e-12, "{values:?} {back}");
            }
        }
    }

    #[test]
    fn in_a_shallow_tank_the_intervals_equal_those_of_first_order() {
        let values = [0.163, 0.05, 0.32];
        let mean = Seen::of(BENCH, values).logarithms();
        let by_t = 1e-4;
        let ends = quantiles(BENCH, mean, &spread([1e-9, by_t, 1e-9])).unwrap();
        let at = |by: f64| Seen::values(BENCH, [mean[0], mean[1] + by, mean[2]]).unwrap();
        for k in 0..3 {
            let reach = 1.96 * (at(by_t)[k] - at(-by_t)[k]).abs() / 2.0;
            for (end, side) in ends[k].iter().zip([-1.0, 1.0]) {
                // the quantiles of 20,000 draws are good to 0.02 deviations, 1 % of the reach
                assert!(((end - values[k]) / reach - side).abs() < 0.03, "{k}: {ends:?}");
            }
        }
    }

    /// If the best T is 1 or more, only a lower bound of the fill is known, from the smallest plausible T: the 2.5 % quantile of
    /// a half-normal distribution is at 2.24 deviations.
    #[test]
    fn the_fill_of_a_tank_without_a_bottom_is_known_from_below() {
        let (length, deviation, inertia) = (0.0343_f64, 2e-3, 4.0_f64);
        let mean = [length.ln(), 0.0, inertia.ln()];
        let ends = quantiles(BENCH, mean, &spread([1e-6, deviation, 1e-6])).unwrap();
        let t = (-2.241 * deviation).exp();
        let least = length * t * t.atanh();
        // the quantile's error is 0.04 deviations of T there, of which h changes by a quarter of its logarithm
        assert!((ends[1][0] / least - 1.0).abs() < 0.01, "{ends:?} {least}");
        // far beyond 1 the tail is exponential: ln 40 of deviation over how far it is
        let ends = quantiles(
            BENCH,
            [mean[0], 10.0 * deviation, mean[2]],
            &spread([1e-6, deviation, 1e-6]),
        );
        let t = (-(40.0_f64.ln()) / 10.0 * deviation).exp();
        let least = length * t * t.atanh();
        assert!((ends.unwrap()[1][0] / least - 1.0).abs() < 0.01, "{ends:?} {least}");
    }
}

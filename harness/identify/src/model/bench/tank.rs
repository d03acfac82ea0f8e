//! Steps along the valley of tank and hub.
//!
//! ```text
//! l = d/(2ξ T),   m = ρ π d³ T/(4 ξ (ξ² − 1)),   I₀ = I + r² (ρ π d² h/4 − m),   T = tanh(2 ξ h/d)
//! ```
//!
//! A recording determines the length l and the mass m of the first mode and the inertia I₀ that turns with the hub, rather than d, h
//! and I one by one. In a deep tank T hardly depends on h: the recording then shows I₀ alone, the valley is long, and in d, h and I
//! it is bent.

use formulas::cylinder::XI;
use names::hubslosh::{hub, tank};

use crate::model::bench::nominal::Bench;
use crate::model::bench::unknown::Unknown;
use crate::tuning::{SHALLOWEST, VALLEY_LEFT};

/// Indices of d, h and I among the unknowns.
#[derive(Clone, Copy, Debug)]
pub struct Indices {
    /// tank.d.
    pub d: usize,
    /// tank.h.
    pub h: usize,
    /// hub.I; `None`: known.
    pub hub: Option<usize>,
}

impl Indices {
    /// `None` unless the tank is unknown.
    pub fn of(unknowns: &[Unknown]) -> Option<Self> {
        let index = |name: &str| unknowns.iter().position(|u| u.quantity.parameter() == Some(name));
        Some(Indices { d: index(tank::D)?, h: index(tank::H)?, hub: index(hub::I) })
    }
}

/// `there`, which is x with a step added, so that l, m and I₀ change as the step's first order says, even where h moves far. Where no
/// tank has that mode, l and I₀ do, and h goes as far as it can.
pub fn bent(unknowns: &[Unknown], bench: Bench, x: &[f64], step: &[f64], there: &mut [f64]) {
    let Some(indices) = Indices::of(unknowns) else { return };
    let scale = |index: usize| unknowns[index].scale;
    let value = |index: usize| scale(index).value(x[index]);
    // first-order change of a value's logarithm
    let change = |index: usize| scale(index).slope(x[index]) * step[index] / value(index);
    let (d, h) = (value(indices.d), value(indices.h));
    let (by_d, by_h) = (change(indices.d), change(indices.h));
    let double = 2.0 * XI[0];
    let t = (double * h / d).tanh();
    let by_t = double * h / d * (1.0 - t * t) / t * (by_h - by_d);
    let length = d / (double * t) * (by_d - by_t).exp();
    // d⁴ goes with l m, T with d/l
    let deepest = 1.0 - VALLEY_LEFT * (1.0 - t);
    let tanh = (t * by_t.exp()).clamp(SHALLOWEST.min(t), deepest);
    let new_d = double * length * tanh;
    let mut new_h = tanh.atanh() * new_d / double;
    if !(new_d.is_finite() && new_h.is_finite() && new_d > 0.0) {
        return;
    }
    let fixed = |d: f64, h: f64| bench.inertia(bench.liquid(d, h) - bench.slosh_mass(d, h));
    if let Some(hub) = indices.hub {
        let now = value(hub) + fixed(d, h);
        let at = |by: f64| fixed(d * (by * by_d).exp(), h * (by * by_h).exp());
        // the fixed liquid's first order, by a central difference
        let slope = (at(1e-4) - at(-1e-4)) / 2e-4;
        let whole = now * ((value(hub) * change(hub) + slope) / now).exp();
        let least = VALLEY_LEFT * value(hub);
        let mut inertia = whole - fixed(new_d, new_h);
        if inertia < least {
            // of so deep a tank the mode's mass no longer changes
            new_h -= (least - inertia) / bench.inertia(bench.liquid(new_d, 1.0));
            inertia = least;
        }
        if new_h <= 0.0 {
            return;
        }
        there[hub] = scale(hub).variable(inertia);
    }
    there[indices.d] = scale(indices.d).variable(new_d);
    there[indices.h] = scale(indices.h).variable(new_h);
}

#[cfg(test)]
mod tests {
    use super::*;

    const BENCH: Bench = Bench { arm: 0.225, density: 1000.0, gravity: 9.81 };

    fn unknowns() -> Vec<Unknown> {
        let of = |name: &str, start: f64| Unknown::positive(name, "1", start);
        vec![of("tank.d", 0.126), of("tank.h", 0.13), of("hub.I", 0.4)]
    }

    /// l, m and I₀ of x.
    fn seen(x: &[f64]) -> [f64; 3] {
        let [d, h, inertia] = [x[0].exp(), x[1].exp(), x[2].exp()];
        let mode = formulas::cylinder::pendulum(0, d, h, BENCH.liquid(d, h));
        [mode.length, mode.mass, inertia + BENCH.inertia(BENCH.liquid(d, h) - mode.mass)]
    }

    /// A step of 0.4 in ln h along which l and I₀ stay to first order.
    #[test]
    fn a_long_step_along_the_valley_stays_in_it() {
        let unknowns = unknowns();
        let x: Vec<f64> = unknowns.iter().map(|u| u.scale.variable(u.start)).collect();
        // the null direction of l and I₀, by differences
        let by = |j: usize| {
            let mut there = x.clone();
            there[j] += 1e-6;
            let (a, b) = (seen(&there), seen(&x));
            [0, 1, 2].map(|k| (a[k] / b[k] - 1.0) / 1e-6)
        };
        let [of_d, of_h, of_hub] = [by(0), by(1), by(2)];
        let d = -of_h[0] / of_d[0];
        let step = [0.4 * d, 0.4, -0.4 * (of_h[2] + d * of_d[2]) / of_hub[2]];
        let plain: Vec<f64> = x.iter().zip(step).map(|(x, step)| x + step).collect();
        let mut there = plain.clone();
        bent(&unknowns, BENCH, &x, &step, &mut there);
        let off = |x: &[f64]| [0, 2].map(|k| (seen(x)[k] / seen(&start())[k] - 1.0).abs());
        assert!(off(&plain).iter().all(|off| *off > 1e-3), "{:?}", off(&plain));
        // the differences of 1e-6
        assert!(off(&there).iter().all(|off| *off < 1e-6), "{:?}", off(&there));
        assert!(there[1] > x[1] + 0.2, "{} from {}", there[1], x[1]);
    }

    fn start() -> Vec<f64> {
        unknowns().iter().map(|u| u.scale.variable(u.start)).collect()
    }

    /// No tank's first mode is as heavy as T > 1 would be, and no hub's inertia is negative.
    #[test]
    fn a_step_to_where_there_is_no_tank_ends_before() {
        let (unknowns, x) = (unknowns(), start());
        for step in [[0.05, 1.5, 0.0], [0.0, 8.0, 0.0], [0.0, 3.0, -5.0], [-0.2, -6.0, 0.5]] {
            let mut there: Vec<f64> = x.iter().zip(step).map(|(x, step)| x + step).collect();
            bent(&unknowns, BENCH, &x, &step, &mut there);
            let [d, h, inertia] = [there[0].exp(), there[1].exp(), there[2].exp()];
            assert!(there.iter().all(|x| x.is_finite()), "{step:?}: {there:?}");
            assert!(h < 2.0 && (0.05..0.3).contains(&d) && inertia > 0.005, "{d} {h} {inertia}");
        }
    }
}

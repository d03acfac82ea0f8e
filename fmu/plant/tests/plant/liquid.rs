//! How the frequency of free oscillations depends on their amplitude: that of a pendulum, and of a liquid
//! to third order.

use std::f64::consts::TAU;

use super::common::bench;
use formulas::third_order::coefficients;
use plant::{FrictionModel, Inputs, Parameters, Plant, SloshModel};

/// A hub that hardly moves (the liquid, 2 kg, against 1e9 kg m2), no damping, no friction.
fn held(model: SloshModel, depth: f64) -> Parameters {
    let mut p = bench(model, FrictionModel::None);
    p.hub.inertia = 1e9;
    p.tank.h = depth;
    (p.slosh.zeta_from_correlation, p.slosh.zeta) = (false, 0.0);
    p
}

/// The mean angular frequency, rad/s, of the slosh angle or, in a circular motion, of its direction: from
/// the instants at which the tangential angle rises through 0, each found by a straight line between
/// samples 1 ms apart, 1e-6 of a period.
fn frequency(p: &Parameters) -> f64 {
    let inputs = Inputs::default();
    let mut plant = Plant::new(p, &inputs, 0.0, 1e-11).unwrap();
    let (mut last, mut crossings) = (plant.outputs(&inputs).slosh_angle, Vec::new());
    let h = 1e-3;
    for k in 1..20_000 {
        plant.step(&inputs, h).unwrap();
        let now = plant.outputs(&inputs).slosh_angle;
        if last < 0.0 && now >= 0.0 {
            crossings.push(h * (f64::from(k) - now / (now - last)));
        }
        last = now;
    }
    let cycles = (crossings.len() - 1) as f64;
    TAU * cycles / (crossings[crossings.len() - 1] - crossings[0])
}

/// Relative shift of omega^2 per squared slosh angle of planar and circular motion at 0.05 rad. The next
/// order is that share squared of it, 2.5e-3, times numbers of order 1.
fn shifts(model: SloshModel, depth: f64) -> [f64; 2] {
    let amplitude: f64 = 0.05;
    let mut p = held(model, depth);
    let plant = Plant::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap();
    let linear = (9.81 / plant.calculated().length[0]).sqrt();
    let shift = |omega: f64| ((omega / linear).powi(2) - 1.0) / amplitude.powi(2);
    p.init.slosh_angle = amplitude.asin();
    let planar = shift(frequency(&p));
    // Sine of the angle: displacement over length. A circle needs the rate of its own frequency.
    p.init.slosh_angle = 0.0;
    p.init.slosh_angle_radial = amplitude.asin();
    let mut omega = linear;
    for _ in 0..2 {
        p.init.slosh_rate = omega * amplitude;
        omega = frequency(&p);
    }
    [planar, shift(omega)]
}

#[test]
fn a_pendulum_has_the_shifts_of_a_pendulum() {
    let found = shifts(SloshModel::Spherical, 0.10);
    assert!((found[0] / -0.125 - 1.0).abs() < 0.01, "{found:?}");
    assert!((found[1] / 0.5 - 1.0).abs() < 0.01, "{found:?}");
}

/// With the inertia s and the spring kappa of the third order: planar 3 kappa/8 - s/2, circular kappa/2; what
/// potential flow says of the two depths is in `tests/physics/liquid.rs`.
#[test]
fn a_liquid_has_the_shifts_of_the_third_order() {
    for (depth, potential_flow) in [(0.10, [-0.4285, 0.3671]), (0.05, [-0.2566, 0.4208])] {
        let found = shifts(SloshModel::Liquid, depth);
        let (s, kappa) = coefficients(depth / 0.0815);
        let expected = [3.0 * kappa / 8.0 - s / 2.0, kappa / 2.0];
        for i in 0..2 {
            assert!((found[i] / expected[i] - 1.0).abs() < 0.01, "{found:?} {expected:?}");
            let known = potential_flow[i];
            assert!((expected[i] - known).abs() < 1e-4, "{expected:?}");
        }
    }
}

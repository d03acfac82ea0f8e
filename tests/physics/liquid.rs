//! The model `liquid`: its coefficients are those of potential flow, and its free oscillations have
//! the shifts of frequency that potential flow has.

use std::f64::consts::TAU;

use formulas::third_order::coefficients;
use hubslosh_tank::third_order::Overlaps;
use plant::{FrictionModel, Inputs, Parameters, Plant, SloshModel};

/// Ten times the plant's eight excited modes of each azimuthal number change s and kappa by less than
/// 1e-4 of themselves; next to a secondary resonance both grow without bound, and with them that.
#[test]
fn coefficients_of_the_model_are_those_of_potential_flow() {
    let all = Overlaps::new(60);
    for i in 0..290 {
        let fill = 0.2 + 0.02 * f64::from(i);
        let (s, kappa) = coefficients(fill);
        let expected = all.equivalent(fill);
        for (found, expected) in [(s, expected[0]), (kappa, expected[1])] {
            assert!(
                (found - expected).abs() < 2e-4 * (1.0 + expected.abs()),
                "{fill} {found} {expected}"
            );
        }
    }
}

/// A hub that hardly moves (the liquid, 2 kg, against 1e9 kg m2), no damping, no friction.
fn held(model: SloshModel, fill: f64) -> Parameters {
    let mut p = Parameters::default();
    (p.slosh.model, p.friction.model) = (model, FrictionModel::None);
    p.hub.inertia = 1e9;
    p.tank.h = fill;
    (p.slosh.zeta_from_correlation, p.slosh.zeta) = (false, 0.0);
    p
}

/// The mean angular frequency, rad/s, of the slosh angle or, in a circular motion, of its
/// direction: from the instants at which the tangential angle rises through 0, each found by a
/// straight line between samples 0.1 ms apart, 4e-7 of a period.
fn frequency(p: &Parameters) -> f64 {
    let inputs = Inputs::default();
    let mut plant = Plant::new(p, &inputs, 0.0, 1e-11).unwrap();
    let (mut last, mut crossings) = (plant.outputs(&inputs).slosh_angle, Vec::new());
    let h = 1e-4;
    for k in 1..200_000 {
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

/// Relative shift of omega^2 per squared slosh angle of planar and circular motion at 0.05 rad.
/// The next order is that share squared of it, 2.5e-3, times numbers of order 1.
fn shifts(model: SloshModel, fill: f64) -> [f64; 2] {
    let amplitude: f64 = 0.05;
    let mut p = held(model, fill);
    let linear = (9.81
        / Plant::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap().calculated().length[0])
        .sqrt();
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
fn free_oscillations_have_the_shifts_of_potential_flow() {
    let all = Overlaps::new(40);
    for fill in [0.10, 0.05] {
        let (found, expected) = (shifts(SloshModel::Liquid, fill), all.shifts(fill / 0.0815));
        println!("{fill} m: {found:.4?}, potential flow {expected:.4?}");
        for i in 0..2 {
            assert!((found[i] / expected[i] - 1.0).abs() < 0.01, "{fill} {found:?} {expected:?}");
        }
    }
}

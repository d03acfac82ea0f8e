//! Tests of slosh modes on a tilted bench, whose free surface is tilted: frequency and sloshing mass of the simulated
//! motion equal those that are computed for the liquid.

use std::f64::consts::{FRAC_PI_2, TAU};

use formulas::{third_order, tilt};
use plant::{FrictionModel, Inputs, Parameters, Plant, Ramp, SloshModel, SloshSource};

use crate::common::SLOSHING;

const G: f64 = 9.81;

/// Returns a tank of h/R = 1 without damping on a hub that is too heavy to move. The axis is tilted, so that the transverse
/// component of gravity is `s` times the axial component. `beta` is the direction of the transverse component, rad, measured
/// from the radial direction (outwards) to the tangential direction.
fn leaning(model: SloshModel, s: f64, beta: f64) -> Parameters {
    let mut p = Parameters::default();
    (p.slosh.model, p.friction.model) = (model, FrictionModel::None);
    p.tank.h = p.tank.d / 2.0;
    p.hub.inertia = 1e10;
    (p.slosh.zeta_from_correlation, p.slosh.zeta) = (false, 0.0);
    // The start angle of the hub rotates hub and tilt alike, so that it has no effect.
    (p.bench.tilt, p.bench.tilt_azimuth, p.init.theta) = (s.atan(), beta + 0.3, 0.3);
    p
}

fn inputs_with_torque(tau: f64) -> Inputs {
    Inputs { g_axial: Ramp::held(G), tau_ext: Ramp::held(tau), ..Inputs::default() }
}

fn plant(p: &Parameters) -> Plant {
    Plant::new(p, &inputs_with_torque(0.0), 0.0, 1e-11).unwrap()
}

fn rest(p: &Parameters) -> f64 {
    let s = p.bench.tilt.tan();
    let spring = match p.slosh.model {
        SloshModel::Frozen | SloshModel::Linear => return s,
        SloshModel::Planar => return 0.0,
        SloshModel::Spherical => return s / (1.0 + s * s).sqrt(),
        SloshModel::Liquid => third_order::coefficients(2.0 * p.tank.h / p.tank.d).1 / 2.0,
    };
    // Bisection solves u (1 + H u^2) = s.
    let (mut low, mut high) = (0.0, s);
    for _ in 0..60 {
        let u = (low + high) / 2.0;
        *(if u * (1.0 + spring * u * u) < s { &mut low } else { &mut high }) = u;
    }
    low
}

fn hang(p: &mut Parameters, aside: f64) {
    let (sin, cos) = (p.bench.tilt_azimuth - p.init.theta).sin_cos();
    let u = rest(p);
    let [radial, along] = match p.slosh.model {
        // Only the component of gravity in the plane of the pendulum displaces it.
        SloshModel::Planar => [0.0, (p.bench.tilt.tan() * sin).atan().sin()],
        _ => [u * cos, u * sin],
    };
    // The sines of the slosh angles are the displacements, except in the linear model, whose angles are the displacements.
    let angle = |x: f64| if p.slosh.model == SloshModel::Linear { x } else { x.asin() };
    (p.init.slosh_angle, p.init.slosh_angle_radial) = (angle(along + aside), angle(radial));
}

/// Returns the frequency of a free oscillation of 1e-4 rad, Hz, from ten periods between zeros of the rate. Interpolation
/// between 400 samples per period has an error of 1e-7 of a period.
fn measured(p: &Parameters) -> f64 {
    let mut p = *p;
    hang(&mut p, 1e-4);
    p.init.slosh_rate = 0.0;
    let mut plant = plant(&p);
    let h = 1.0 / plant.calculated().frequency[0] / 400.0;
    let mut zeros = Vec::new();
    let mut last = 0.0;
    for k in 1.. {
        plant.step(&inputs_with_torque(0.0), h).unwrap();
        let now = plant.outputs(&inputs_with_torque(0.0)).slosh_rate;
        if k > 2 && last < 0.0 && now >= 0.0 {
            zeros.push((k as f64 - now / (now - last)) * h);
            if zeros.len() == 11 {
                break;
            }
        }
        last = now;
    }
    10.0 / (zeros[10] - zeros[0])
}

/// The expected relative changes of the squared frequency by the tilt, along the slope and across it, come from finite
/// elements (`hubslosh.liquid_modes`; `formulas::tilt` names the programs) on two meshes, whose results differ by 2e-4. The
/// tolerance of the frequency is half this difference plus the neglected second order, 1e-4 and 0.15 %.
#[test]
fn free_decays_on_a_tilted_bench_have_the_frequencies_of_finite_elements() {
    for (s, change, allowed) in
        [(0.15, [-0.00941, 0.00526], 2e-4), (0.35, [-0.04879, 0.02775], 1.5e-3)]
    {
        for model in SLOSHING {
            let upright = measured(&leaning(model, 0.0, 0.0));
            for (beta, change) in [FRAC_PI_2, 0.0].into_iter().zip(change) {
                let p = leaning(model, s, beta);
                let found = measured(&p) / upright;
                let error = found / f64::sqrt(1.0 + change) - 1.0;
                assert!(error.abs() < allowed, "{model:?} {s} {beta}: {found} {error}");
            }
        }
    }
}

/// The allowed difference is the square of the amplitude, 1e-4 rad, plus the measurement error of 1e-7. Models with one
/// direction are tested in a direction oblique to the slope.
#[test]
fn the_frequency_output_on_a_tilted_bench_equals_that_of_a_free_decay() {
    for model in SLOSHING {
        let oblique = model != SloshModel::Liquid;
        for beta in [0.0, FRAC_PI_2, 0.6] {
            if beta == 0.6 && !oblique {
                continue;
            }
            let p = leaning(model, 0.3, beta);
            let stated = plant(&p).calculated().frequency[0];
            let error = measured(&p) / stated - 1.0;
            assert!(error.abs() < 3e-7, "{model:?} {beta}: {error:e}");
            let l = formulas::cylinder::pendulum(0, p.tank.d, p.tank.h, 1.0).length;
            let [along, across] = tilt::factors(0, 1.0, 0.3);
            let n2 = beta.sin().powi(2);
            let wanted = (G / l * (along * n2 + across * (1.0 - n2))).sqrt() / TAU;
            assert!((stated / wanted - 1.0).abs() < 1e-14, "{model:?} {stated} {wanted}");
        }
    }
}

/// When a torque begins to act, the angular acceleration is torque/(I + r^2 (m_liq - m)), with the inertia I of the hub, the
/// distance r of the tank, the mass m_liq of all liquid, and the slosh mass m that moves tangentially on the tilted bench.
/// In the model `planar` the slosh mass cannot move radially, so that its tangential displacement adds to the inertia.
#[test]
fn on_a_tilted_bench_only_liquid_that_does_not_slosh_accelerates_with_the_hub() {
    for model in SLOSHING {
        for beta in [0.0, FRAC_PI_2, 0.6] {
            let mut p = leaning(model, 0.3, beta);
            p.hub.inertia = 0.05;
            hang(&mut p, 0.0);
            let plant = plant(&p);
            let rate = |tau: f64| plant.clone().outputs(&inputs_with_torque(tau)).omega_dot;
            let inertia = 1.0 / (rate(1.0) - rate(0.0));
            let (l, r) = (plant.calculated().length[0], p.tank.r);
            let upright = {
                let mut p = p;
                p.bench.tilt = 0.0;
                Plant::new(&p, &inputs_with_torque(0.0), 0.0, 1e-11).unwrap().calculated().mass[0]
            };
            let [along, across] = tilt::factors(0, 1.0, 0.3);
            let n2 = beta.sin().powi(2);
            let sloshing = upright * (along * n2 + across * (1.0 - n2));
            let mut wanted = 0.05 + r * r * (plant.calculated().m_liq - sloshing);
            if model == SloshModel::Planar {
                wanted += plant.calculated().mass[0] * (l * p.init.slosh_angle.sin()).powi(2);
            }
            assert!((inertia / wanted - 1.0).abs() < 1e-9, "{model:?} {beta}: {inertia} {wanted}");
        }
    }
}

#[test]
fn modes_are_corrected_for_tilt_only_on_a_tilted_bench_without_a_table() {
    for model in SLOSHING {
        let mut p = leaning(model, 0.0, 0.7);
        p.slosh.modes = 3;
        let upright = *plant(&p).calculated();
        p.bench.tilt_azimuth = 2.0;
        assert_eq!(*plant(&p).calculated(), upright, "nothing leans");
        p.bench.tilt = 0.1;
        assert_ne!(plant(&p).calculated().frequency, upright.frequency);
        if model != SloshModel::Liquid {
            p.slosh.source = SloshSource::Table;
            (p.slosh.table.m_liq, p.slosh.table.mass, p.slosh.table.length) =
                (upright.m_liq, upright.mass, upright.length);
            let table = *plant(&p).calculated();
            assert_eq!((table.mass, table.length), (upright.mass, upright.length));
            assert_eq!(table.frequency, upright.frequency);
        }
    }
}

#[test]
fn a_surface_that_reaches_the_bottom_is_refused_unless_the_liquid_is_rigid() {
    let refused = |p: &Parameters| Plant::new(p, &inputs_with_torque(0.0), 0.0, 1e-9).err();
    for model in SLOSHING {
        let why = refused(&leaning(model, 1.01, 0.0)).unwrap();
        assert!(why[0].contains("reaches the bottom") && why[0].contains("bench.tilt"), "{why:?}");
    }
    assert_eq!(refused(&leaning(SloshModel::Frozen, 1.01, 0.0)), None);
    assert_eq!(refused(&leaning(SloshModel::Linear, 0.99, 0.0)), None);
}

/// In a tilted cylinder the frequencies across and along the slope differ, but a spherical pendulum has only one frequency.
#[test]
fn warnings_name_large_tilts_and_spherical_pendulums_in_a_tilted_cylinder() {
    let warnings = |model, s| Plant::warnings(&leaning(model, s, 0.0), &inputs_with_torque(0.0));
    let said = |model, s, text: &str| warnings(model, s).iter().any(|said| said.contains(text));
    for model in SLOSHING {
        assert!(said(model, 0.71, "exceeds 1 %") && !said(model, 0.69, "exceeds 1 %"));
        assert!(!said(model, 0.02, "bench.tilt"), "{:?}", warnings(model, 0.02));
    }
    // At the slope 0.176 the two frequencies differ by 1 %, from the ratio sqrt(1 + 0.65 s^2).
    assert!(
        said(SloshModel::Spherical, 0.19, "too high") && !said(SloshModel::Spherical, 0.16, "too")
    );
    assert!(!said(SloshModel::Planar, 0.3, "too"));
}

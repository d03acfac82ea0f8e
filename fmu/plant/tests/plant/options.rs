//! Tests of a tilted bench, a ring baffle, amplitude damping and capillarity. With each option and every slosh model, energy
//! and momentum balance, derivatives are exact, and the motion does not depend on the communication step.

use std::f64::consts::TAU;

use plant::{FrictionModel, Inputs, Outputs, Parameters, Plant, Ramp, SloshModel, SloshSource};

const TOLERANCE: f64 = 1e-9;

fn sloshing() -> impl Iterator<Item = SloshModel> {
    SloshModel::ALL.into_iter().filter(|model| *model != SloshModel::Frozen)
}

fn bench(slosh: SloshModel, friction: FrictionModel) -> Parameters {
    let mut p = Parameters::default();
    (p.slosh.model, p.friction.model) = (slosh, friction);
    (p.init.omega, p.init.slosh_angle, p.init.slosh_angle_radial) = (0.05, 0.2, 0.1);
    p.friction.eps = 1e-3;
    p
}

/// Returns a bench that is tilted by 3 degrees and has an unbalanced hub, a ring baffle, damping that grows with the
/// amplitude, breaking waves, and a hundred times the surface tension of water.
fn everything(slosh: SloshModel, friction: FrictionModel) -> Parameters {
    let mut p = bench(slosh, friction);
    (p.bench.tilt, p.bench.tilt_azimuth) = (0.05, 0.7);
    (p.hub.imbalance, p.hub.imbalance_angle) = (0.4, 2.0);
    (p.baffle.width, p.baffle.depth) = (0.008, 0.01);
    p.slosh.zeta_amplitude = 0.05;
    (p.slosh.zeta_breaking, p.slosh.breaking_steepness) = (0.2, 0.3);
    p.slosh.capillarity = true;
    p.fluid.sigma = 7.0;
    p
}

fn inputs_with_gravity(g: f64) -> Inputs {
    Inputs { g_axial: Ramp::held(g), ..Inputs::default() }
}

fn plant(p: &Parameters) -> Plant {
    Plant::new(p, &inputs_with_gravity(9.81), 0.0, TOLERANCE).unwrap()
}

const PIECES: [(Ramp, f64); 4] = [
    (Ramp { value: 9.81, slope: 0.0 }, 1.0),
    (Ramp { value: 9.81, slope: -9.81 }, 1.0),
    (Ramp { value: 0.0, slope: 0.0 }, 0.5),
    (Ramp { value: 0.0, slope: 6.0 }, 1.0),
];

fn run(p: &Parameters, h: f64) -> Vec<Outputs> {
    let mut plant = plant(p);
    let mut all = vec![plant.outputs(&inputs_with_gravity(9.81))];
    for (g, length) in PIECES {
        let steps = (length / h).ceil().max(1.0);
        let h = length / steps;
        for k in 0..steps as usize {
            let t = k as f64 * h;
            let inputs = Inputs {
                g_axial: Ramp { value: g.value_at(t), slope: g.slope },
                tau_cmd: Ramp { value: 0.03 - 0.1 * t, slope: -0.1 },
                ..Inputs::default()
            };
            plant.step(&inputs, h).unwrap();
            all.push(plant.outputs(&inputs_with_gravity(inputs.g_axial.value_at(h).max(0.0))));
        }
    }
    all
}

#[test]
fn energy_is_balanced_on_a_tilted_bench_with_baffle_and_capillarity() {
    for slosh in SloshModel::ALL {
        for friction in FrictionModel::ALL {
            for modes in [1, 3] {
                let mut p = everything(slosh, friction);
                p.slosh.modes = modes;
                let all = run(&p, 0.05);
                let (first, mut throughput) = (all[0], 0.0);
                for pair in all.windows(2) {
                    let [last, now] = [pair[0], pair[1]];
                    throughput += (now.work - last.work).abs()
                        + (now.heat - last.heat).abs()
                        + (now.work_axial - last.work_axial).abs();
                    assert!(now.heat >= last.heat && now.power_dissipated >= 0.0);
                    let balance = now.energy - first.energy - now.work - now.work_axial + now.heat;
                    // The tolerance is ten times that of the integrator; a missing term would be a visible
                    // fraction of the throughput.
                    assert!(
                        balance.abs() < 1e-8 * throughput,
                        "{slosh:?} {friction:?} {balance:e} {throughput}"
                    );
                }
            }
        }
    }
}

/// One step of 10 s must give the same motion as steps of 3 ms, on a tilted bench with baffle, capillarity, imbalance and
/// breaking waves.
#[test]
fn motion_with_all_options_does_not_depend_on_the_communication_step() {
    for slosh in SloshModel::ALL {
        let p = everything(slosh, FrictionModel::Viscous);
        let (coarse, fine) = (run(&p, 10.0), run(&p, 0.003));
        let [a, b] = [coarse.last().unwrap(), fine.last().unwrap()];
        // The tolerance is the error of rates of 1 rad/s and energies of 0.1 J at the solver's tolerance.
        assert!((a.omega - b.omega).abs() < 2e-9, "{slosh:?} {}", a.omega - b.omega);
        assert!((a.slosh_rate - b.slosh_rate).abs() < 2e-9, "{slosh:?}");
        assert!((a.work_axial - b.work_axial).abs() < 1e-9, "{slosh:?}");
    }
}

/// The derivative of the angular momentum must equal the moment of gravity on all masses at their positions. Both are
/// compared by Simpson's rule over 1 ms, whose error is (2 pi f h)^4/180 of the torque, 1e-10.
#[test]
fn momentum_on_a_tilted_bench_changes_by_the_moment_of_gravity() {
    for slosh in SloshModel::ALL {
        let mut p = everything(slosh, FrictionModel::None);
        (p.init.slosh_rate, p.init.slosh_rate_radial) = (2.0, -1.0);
        let mut plant = plant(&p);
        let (known, inputs) = (*plant.calculated(), inputs_with_gravity(9.81));
        let moment = |o: &Outputs| {
            let (sin, cos) = (p.bench.tilt_azimuth - o.theta).sin_cos();
            let e = [cos, sin].map(|part| 9.81 * p.bench.tilt.tan() * part);
            let (y, x) = match slosh {
                SloshModel::Linear => (known.length[0] * o.slosh_angle, 0.0),
                _ => (
                    known.length[0] * o.slosh_angle.sin(),
                    known.length[0] * o.slosh_angle_radial.sin(),
                ),
            };
            let (m, m_0, r) = (known.mass[0], known.m_0, p.tank.r);
            let (s_u, c_u) = p.hub.imbalance_angle.sin_cos();
            let first =
                [p.hub.imbalance * c_u + m_0 * r + m * (r + x), p.hub.imbalance * s_u + m * y];
            let on_hub = p.hub.imbalance * (c_u * e[1] - s_u * e[0]);
            assert!((o.tau_gravity - on_hub).abs() < 1e-15, "{} {on_hub}", o.tau_gravity);
            first[0] * e[1] - first[1] * e[0]
        };
        let first = plant.outputs(&inputs);
        let (mut integral, mut last, h) = (0.0, moment(&first), 1e-3);
        for _ in 0..2000 {
            plant.step(&inputs, h / 2.0).unwrap();
            let middle = moment(&plant.outputs(&inputs));
            plant.step(&inputs, h / 2.0).unwrap();
            let now = moment(&plant.outputs(&inputs));
            integral += h / 6.0 * (last + 4.0 * middle + now);
            last = now;
        }
        let now = plant.outputs(&inputs);
        let change = now.momentum - first.momentum;
        assert!(change.abs() > 0.01, "gravity acts");
        assert!((change - integral).abs() < 1e-9, "{slosh:?} {change} {integral}");
        let sum = now.tau_actuator + now.tau_friction + now.tau_fluid + now.tau_gravity;
        assert!((p.hub.inertia * now.omega_dot - sum).abs() < 1e-12, "{slosh:?}");
    }
}

/// With rigid liquid, hub and liquid are one pendulum about the bearing, with omega^2 = g tan(tilt) M/I, where M is the
/// static moment of all masses and I their inertia.
#[test]
fn an_unbalanced_hub_on_a_tilted_bench_swings_at_the_frequency_of_its_imbalance() {
    let mut p = bench(SloshModel::Frozen, FrictionModel::None);
    p.bench.tilt = 0.1;
    p.hub.imbalance = 0.3;
    (p.init.omega, p.init.theta) = (0.0, 1e-3);
    let mut plant = plant(&p);
    let m_0 = plant.calculated().m_0;
    let moment = 0.3 + m_0 * p.tank.r;
    let inertia = p.hub.inertia + m_0 * p.tank.r * p.tank.r;
    let omega = (9.81 * 0.1f64.tan() * moment / inertia).sqrt();
    plant.step(&inputs_with_gravity(9.81), TAU / omega / 3.0).unwrap();
    // After a third of a period the angle is cos(120 degrees) = -1/2 of its start. At 1 mrad the period of a pendulum is longer
    // by 6e-8 of itself.
    let theta = plant.outputs(&inputs_with_gravity(9.81)).theta;
    assert!((theta / 1e-3 + 0.5).abs() < 1e-6, "{theta}");
}

#[test]
fn liquid_on_a_tilted_bench_comes_to_rest_along_gravity() {
    for slosh in [SloshModel::Spherical, SloshModel::Liquid] {
        let mut p = bench(slosh, FrictionModel::Viscous);
        p.friction.b = 0.3;
        p.bench.tilt = 0.02;
        (p.slosh.zeta_from_correlation, p.slosh.zeta) = (false, 0.2);
        let mut plant = plant(&p);
        for _ in 0..200 {
            plant.step(&inputs_with_gravity(9.81), 1.0).unwrap();
        }
        let o = plant.outputs(&inputs_with_gravity(9.81));
        // Downhill is theta = 0, and the slosh mass hangs along gravity. In the model `liquid` its displacement (for the
        // tangent of the slope, with the quartic spring) is exact to the third order.
        assert!(o.theta.abs() < 1e-9 && o.slosh_angle.abs() < 1e-9, "{slosh:?} {o:?}");
        let allowed = if slosh == SloshModel::Spherical { 1e-9 } else { 2e-5 };
        assert!((o.slosh_angle_radial - 0.02).abs() < allowed, "{slosh:?} {o:?}");
        assert!(o.energy < 0.0, "the energy must be below that of the upright bench at rest");
    }
}

/// On a tilted bench gravity exerts a torque on the hub's imbalance. Dry friction must hold the hub while this torque is
/// below the break-away torque.
#[test]
fn dry_friction_holds_an_unbalanced_hub_on_a_tilted_bench() {
    // The torque is 9.81 tan(0.001) (0.3 + 2.087 0.225) N m sin(phi) = 7.5 mN m sin(phi). At 90 degrees it exceeds the
    // break-away torque of 5.9 mN m.
    let mut p = bench(SloshModel::Linear, FrictionModel::Stribeck);
    (p.bench.tilt, p.hub.imbalance) = (0.001, 0.3);
    (p.init.omega, p.init.slosh_angle) = (0.0, 0.0);
    let mut stuck = |azimuth: f64| {
        p.bench.tilt_azimuth = azimuth;
        plant(&p).outputs(&inputs_with_gravity(9.81)).discrete.stuck
    };
    assert!(stuck(0.0) && stuck(0.3));
    p.init.slosh_angle = 0.001; // in equilibrium with gravity across the axis
    let mut moved = plant(&p);
    assert!(moved.outputs(&inputs_with_gravity(9.81)).discrete.stuck);
    p.bench.tilt_azimuth = TAU / 4.0;
    moved = plant(&p);
    assert!(!moved.outputs(&inputs_with_gravity(9.81)).discrete.stuck);
    moved.step(&inputs_with_gravity(9.81), 5.0).unwrap();
    assert!(moved.outputs(&inputs_with_gravity(9.81)).theta > 0.01, "the hub must turn downhill");
}

/// Returns a hub that does not move, without viscous damping, with a ring baffle whose depth and width are a tenth of the
/// radius.
fn ringed(slosh: SloshModel) -> Parameters {
    let mut p = bench(slosh, FrictionModel::None);
    p.hub.inertia = 1e9;
    (p.init.omega, p.init.slosh_angle_radial) = (0.0, 0.0);
    (p.slosh.zeta_from_correlation, p.slosh.zeta) = (false, 0.0);
    (p.baffle.width, p.baffle.depth) = (0.00815, 0.00815);
    p
}

/// By Miles's formula the damping ratio is 2.83 exp(-0.46) 0.19^1.5 0.1^0.5 = 0.0468 for a wave of 0.1 R, which is a slosh
/// angle of 0.1195 rad.
#[test]
fn a_ring_baffle_has_the_damping_and_the_range_of_miles_s_formula() {
    let mut p = ringed(SloshModel::Linear);
    let wave = 2.0 / (1.841_183_781_340_66f64.powi(2) - 1.0);
    let zeta = |p: &Parameters| {
        let o = plant(p).outputs(&inputs_with_gravity(9.81));
        (o.baffle_zeta, o.discrete.baffle_in_range)
    };
    p.init.slosh_angle = 0.1 / wave;
    let (found, within) = zeta(&p);
    assert!((found - 0.0468).abs() < 5e-5 && within, "{found}");
    // A slosh rate has the same effect as a slosh angle, because both contribute to the amplitude of the wave.
    let omega = (9.81 / plant(&p).calculated().length[0]).sqrt();
    (p.init.slosh_angle, p.init.slosh_rate) = (0.0, 0.1 / wave * omega);
    assert!((zeta(&p).0 / found - 1.0).abs() < 1e-6);
    // A wave of 0.07 R is too small for the formula, a wave of 0.12 R uncovers the ring, and a ring of 0.2 R covers
    // 0.36 of the cross-section.
    (p.init.slosh_angle, p.init.slosh_rate) = (0.07 / wave, 0.0);
    assert!(!zeta(&p).1);
    p.init.slosh_angle = 0.12 / wave;
    assert!(!zeta(&p).1);
    (p.init.slosh_angle, p.baffle.width) = (0.09 / wave, 0.2 * 0.0815);
    assert!(
        !zeta(&p).1 && Plant::warnings(&p, &inputs_with_gravity(9.81))[0].contains("covers 0.360")
    );
    (p.baffle.width, p.baffle.depth) = (0.1, 0.2);
    assert_eq!(
        Plant::new(&p, &inputs_with_gravity(9.81), 0.0, 1e-9).err().map(|all| all.len()),
        Some(2)
    );
}

/// With a ring baffle the damping ratio at the amplitude a is Z a^(1/2) with a constant Z, so that a^(-1/2) grows at the
/// rate Z omega/2. The oscillation starts at 0.1 rad and lasts ten periods. The tolerance of 1 % includes the effect of the
/// ring on the frequency and the cubic terms of the pendulum.
#[test]
fn with_a_ring_baffle_damping_follows_the_root_of_the_decaying_amplitude() {
    for slosh in sloshing() {
        let mut p = ringed(slosh);
        p.init.slosh_angle = 0.1;
        let mut plant = plant(&p);
        let omega = (9.81 / plant.calculated().length[0]).sqrt();
        let first = plant.outputs(&inputs_with_gravity(9.81));
        let z = first.baffle_zeta / 0.1f64.sqrt();
        let mut energy = first.energy;
        let time = 10.0 * TAU / omega;
        for _ in 0..1000 {
            plant.step(&inputs_with_gravity(9.81), time / 1000.0).unwrap();
            let now = plant.outputs(&inputs_with_gravity(9.81)).energy;
            assert!(now <= energy * (1.0 + 1e-12), "{slosh:?}: the ring added energy");
            energy = now;
        }
        let left = (energy / first.energy).sqrt();
        let expected = (1.0 + 0.1f64.sqrt() * z * omega * time / 2.0).powi(-2);
        println!("{slosh:?} {left} {expected}");
        assert!(
            ((1.0 - left) / (1.0 - expected) - 1.0).abs() < 0.01,
            "{slosh:?} {left} {expected}"
        );
    }
}

/// The first frequency must be omega_1^2 = (g xi/R + sigma xi^3/(rho R^3)) tanh(xi h/R), also at g = 0. The length of the
/// pendulum does not depend on surface tension.
#[test]
fn surface_tension_restores_the_liquid_also_without_gravity() {
    let (xi, radius) = (1.841_183_781_340_66f64, 0.0815);
    for slosh in sloshing() {
        for g in [9.81, 0.01, 0.0] {
            let mut p = bench(slosh, FrictionModel::None);
            p.hub.inertia = 1e9;
            (p.init.omega, p.init.slosh_angle, p.init.slosh_angle_radial) = (0.0, 1e-3, 0.0);
            (p.slosh.zeta_from_correlation, p.slosh.zeta) = (false, 0.0);
            let length = plant(&p).calculated().length[0];
            p.slosh.capillarity = true;
            let mut plant = Plant::new(&p, &inputs_with_gravity(g), 0.0, TOLERANCE).unwrap();
            assert_eq!(plant.calculated().length[0], length);
            let capillary = p.fluid.sigma * (xi / radius).powi(3) / p.fluid.rho;
            let omega = ((g * xi / radius + capillary) * (xi * 0.1 / radius).tanh()).sqrt();
            let frequency = plant.calculated().frequency[0];
            assert!((frequency * TAU / omega - 1.0).abs() < 1e-12, "{g} {frequency}");
            plant.step(&inputs_with_gravity(g), TAU / omega / 3.0).unwrap();
            let angle = plant.outputs(&inputs_with_gravity(g)).slosh_angle;
            // After a third of a period the angle is cos(120 degrees) = -1/2 of its start. The tolerance includes the third
            // order at 1 mrad.
            assert!((angle / 1e-3 + 0.5).abs() < 1e-5, "{slosh:?} {g} {angle}");
        }
    }
}

/// The drag coefficient is 2 zeta m omega at every specific force. If zeta is a parameter, it is constant; if it comes from
/// the correlation, it varies as omega^(-1/2).
#[test]
fn damping_ratio_follows_the_restoring_force_down_to_weightlessness() {
    let mut p = bench(SloshModel::Linear, FrictionModel::None);
    p.hub.inertia = 1e9;
    p.init.omega = 0.0;
    (p.slosh.capillarity, p.slosh.modes) = (true, 2);
    for correlation in [false, true] {
        (p.slosh.zeta_from_correlation, p.slosh.zeta) = (correlation, 0.02);
        let mut plant = plant(&p);
        let first = [0, 1].map(|n| plant.damping_ratio(n, &inputs_with_gravity(9.81))[0]);
        let down = Inputs { g_axial: Ramp { value: 9.81, slope: -9.81 }, ..Inputs::default() };
        plant.step(&down, 1.0).unwrap();
        let last = [0, 1].map(|n| plant.damping_ratio(n, &inputs_with_gravity(0.0))[0]);
        let weightless = Plant::new(&p, &inputs_with_gravity(0.0), 0.0, TOLERANCE).unwrap();
        for n in 0..2 {
            let ratio = weightless.calculated().frequency[n]
                / Plant::new(&p, &inputs_with_gravity(9.81), 0.0, 1e-9)
                    .unwrap()
                    .calculated()
                    .frequency[n];
            let expected = if correlation { first[n] * ratio.powf(-0.5) } else { first[n] };
            assert!((last[n] / expected - 1.0).abs() < 1e-12, "{correlation} {n} {last:?}");
            // A start without weight has the damping ratio that is calculated for it.
            let started = weightless.damping_ratio(n, &inputs_with_gravity(0.0))[0];
            let calculated = weightless.calculated().damping[n];
            assert!((started / calculated - 1.0).abs() < 1e-14, "{started} {calculated}");
        }
        // The motion also decays with this damping ratio, which is measured from the envelope over a period.
        let omega = TAU * weightless.calculated().frequency[0];
        let before = plant.outputs(&inputs_with_gravity(0.0)).energy;
        plant.step(&inputs_with_gravity(0.0), 2.0 * TAU / omega).unwrap();
        let decay = (plant.outputs(&inputs_with_gravity(0.0)).energy / before).ln() / (2.0 * TAU);
        let zeta = last[0];
        assert!((decay / -(2.0 * zeta) - 1.0).abs() < 0.05, "{decay} {zeta}");
    }
}

/// For example, `slosh.zeta` has no effect while `slosh.zeta_from_correlation` is true; the reason must contain the name
/// `slosh.zeta_from_correlation`.
#[test]
fn a_parameter_without_effect_is_reported_with_the_parameter_that_replaces_it() {
    let why = |p: &Parameters, name: &str| p.overridden(name).unwrap_or_default();
    let mut p = Parameters::default();
    assert!(why(&p, "slosh.zeta").contains("slosh.zeta_from_correlation is true"));
    assert_eq!(why(&p, "tank.h"), "");
    assert_eq!(why(&p, "slosh.table.mass"), "slosh.source = geometry");
    p.slosh.zeta_from_correlation = false;
    assert_eq!(why(&p, "slosh.zeta"), "");
    p.slosh.source = SloshSource::Table;
    assert!(why(&p, "tank.h").contains("slosh.source = table"));
    assert!(why(&p, "slosh.zeta").contains("slosh.source = table"));
    assert_eq!(why(&p, "slosh.table.mass"), "");
    // Parameters of slosh modes have no reason if the liquid is rigid, because this part of the model is switched off.
    p.slosh.model = SloshModel::Frozen;
    assert_eq!(why(&p, "slosh.zeta"), "");
}

#[test]
fn a_warning_names_a_low_bond_number_of_the_tank() {
    let mut p = bench(SloshModel::Linear, FrictionModel::None);
    p.init.slosh_angle_radial = 0.0;
    assert!(Plant::warnings(&p, &inputs_with_gravity(9.81)).is_empty());
    assert!(Plant::warnings(&p, &inputs_with_gravity(0.1))[0].contains("Bond number is 9.209"));
    let mut with = p;
    with.slosh.capillarity = true;
    assert!(Plant::warnings(&with, &inputs_with_gravity(0.1))[0].contains("contact angles"));
    assert!(Plant::warnings(&with, &inputs_with_gravity(9.81)).is_empty());
}

/// At rates at which the smoothed sign is 1, the expected torque is -b w -+ (C + D exp(-(w/w_s)^2)) (1 +- A + harmonics of
/// the angle), with viscous friction b, Coulomb friction C, excess at rest D, Stribeck speed w_s and asymmetry A, for both
/// Stribeck laws and both directions of rotation.
#[test]
fn dry_friction_of_a_turning_hub_depends_on_direction_and_angle() {
    for model in [FrictionModel::Stribeck, FrictionModel::StribeckSmooth] {
        let mut p = bench(SloshModel::Frozen, model);
        p.friction.asymmetry = 0.1;
        p.friction.harmonics_forward = [0.04, -0.03, 0.02, 0.01];
        p.friction.harmonics_backward = [-0.02, 0.05, 0.03, -0.04];
        for (omega, harmonics) in
            [(0.1, p.friction.harmonics_forward), (-0.1, p.friction.harmonics_backward)]
        {
            (p.init.omega, p.init.theta) = (omega, 0.7);
            let sign = f64::signum(omega);
            let trig = [0.7f64.cos(), 0.7f64.sin(), 1.4f64.cos(), 1.4f64.sin()];
            let factor = 1.0
                + sign * p.friction.asymmetry
                + harmonics.iter().zip(trig).map(|(h, x)| h * x).sum::<f64>();
            let v = omega / p.friction.omega_s;
            let curve = p.friction.c + p.friction.d * (-v * v).exp();
            let expected = -p.friction.b * omega - sign * curve * factor;
            let inputs = Inputs::default();
            let mut plant = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap();
            let found = plant.outputs(&inputs).tau_friction;
            assert!(
                (found / expected - 1.0).abs() < 1e-14,
                "{model:?} {omega}: {found} {expected}"
            );
            // The torque is also expected within a step; in a millisecond it changes by less than 1e-3.
            plant.step(&inputs, 1e-3).unwrap();
            let m_liq = 1000.0 * std::f64::consts::PI / 4.0 * p.tank.d * p.tank.d * p.tank.h;
            let inertia = p.hub.inertia + m_liq * p.tank.r * p.tank.r;
            let change = (plant.omega() - omega) * inertia;
            assert!((change / (1e-3 * expected) - 1.0).abs() < 1e-3, "{model:?} {omega}: {change}");
        }
    }
}

/// A warning is due if one of the two parameters of breaking waves is missing, or if waves of the slosh model cannot reach
/// the steepness at which they would break. For example, waves of the model `liquid` have an amplitude of up to 1 rad, at
/// which their steepness is 1.541.
#[test]
fn warnings_name_parameters_of_breaking_waves_that_have_no_effect() {
    let mut p = bench(SloshModel::Liquid, FrictionModel::None);
    p.slosh.breaking_steepness = 0.66;
    assert_eq!(Plant::warnings(&p, &inputs_with_gravity(9.81)), [""; 0]);
    // Even without damping by breaking, the steepness limits the range of validity (limited_by).
    assert_eq!(p.overridden("slosh.breaking_steepness"), None);
    p.slosh.zeta_breaking = 0.04;
    assert_eq!(p.overridden("slosh.breaking_steepness"), None);
    for (model, onset, what) in [
        (SloshModel::Liquid, 0.0, "smallest wave"),
        (SloshModel::Liquid, 1.54, ""),
        (
            SloshModel::Liquid,
            1.55,
            "has almost no effect on mode 1: the steepness of its wave reaches 1.541 at",
        ),
        (SloshModel::Spherical, 1.55, ""),
        (
            SloshModel::Spherical,
            2.43,
            "steepness of its wave reaches 2.420 at an amplitude of 1.571",
        ),
        (SloshModel::Frozen, 0.0, ""),
    ] {
        (p.slosh.model, p.slosh.breaking_steepness) = (model, onset);
        let warnings = Plant::warnings(&p, &inputs_with_gravity(9.81));
        let first = warnings.first().map_or("", String::as_str);
        assert!(first.contains(what) && warnings.is_empty() == what.is_empty(), "{warnings:?}");
    }
}

/// If the table of modes contains the wave elevation and the wave number of a cylinder, waves begin to break at the same
/// amplitude as in the cylinder.
#[test]
fn wave_steepness_follows_from_the_wave_elevation_and_wave_number_in_the_table() {
    let power = |p: &Parameters| plant(p).outputs(&inputs_with_gravity(9.81)).power_dissipated;
    let mut p = bench(SloshModel::Spherical, FrictionModel::None);
    (p.slosh.zeta_breaking, p.slosh.breaking_steepness, p.init.slosh_rate) = (0.04, 0.25, 1.0);
    let (expected, known) = (power(&p), *plant(&p).calculated());
    p.slosh.source = SloshSource::Table;
    let table = &mut p.slosh.table;
    (table.m_liq, table.mass[0], table.length[0]) = (known.m_liq, known.mass[0], known.length[0]);
    table.zeta[0] = known.damping[0];
    let close = |p: &Parameters, share: f64| {
        let found = power(p);
        assert!((found / (share * expected) - 1.0).abs() < 1e-12, "{found} {expected}");
    };
    close(&p, 1.0);
    let xi: f64 = 1.841_183_781_340_66;
    p.slosh.table.wave_number[0] = xi / 0.0815;
    close(&p, 1.0);
    // Half the elevation at twice the wave number is as steep.
    p.slosh.table.wave[0] = 0.0815 / (xi * xi - 1.0);
    p.slosh.table.wave_number[0] *= 2.0;
    close(&p, 1.0);
    p.slosh.table.wave_number[0] /= 2.0;
    assert!(power(&p) < 0.9 * expected, "half as steep: it does not break");
}

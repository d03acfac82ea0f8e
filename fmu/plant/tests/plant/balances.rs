//! Tests of laws that hold for every slosh model, parameter and input: energy, momentum, and limiting cases.

use super::common::{FRICTION, SLOSH, anywhere, bench, has_rim};
use plant::{FrictionModel, Inputs, Outputs, Plant, Ramp, SloshModel};

/// Tolerance of the solver in these tests. The errors of the plant are two to three decades below it, so that a bound of 1e-8
/// leaves a margin, while a wrong term would be a visible fraction of the energy throughput.
const TOLERANCE: f64 = 1e-9;

fn plant(p: &plant::Parameters, inputs: &Inputs) -> Plant {
    Plant::new(p, inputs, 0.0, TOLERANCE).unwrap()
}

struct Turnover {
    first: Outputs,
    last: Outputs,
    sum: f64,
}

impl Turnover {
    fn new(first: Outputs) -> Turnover {
        Turnover { first, last: first, sum: 0.0 }
    }

    fn add(&mut self, now: Outputs) {
        self.sum += (now.work - self.last.work).abs() + (now.heat - self.last.heat).abs();
        self.last = now;
    }

    fn residual(&self) -> f64 {
        let gained = self.last.energy - self.first.energy;
        (gained - self.last.work + self.last.heat).abs() / (self.sum + self.first.energy)
    }
}

#[test]
fn energy_is_balanced_with_every_slosh_model_friction_law_and_damping() {
    let mut rng = fastrand::Rng::with_seed(1);
    for slosh in SLOSH {
        for friction in FRICTION {
            for _ in 0..25 {
                let p = anywhere(&mut rng, slosh, friction);
                // The torque gives the hub an angular acceleration of about 1 rad/s2.
                let torque = p.hub.inertia;
                let mut inputs = Inputs::default();
                let mut plant = plant(&p, &inputs);
                let mut energy = Turnover::new(plant.outputs(&inputs));
                for _ in 0..100 {
                    inputs.tau_cmd.slope = torque * (rng.f64() - 0.5) * 4.0;
                    inputs.tau_ext = Ramp::held(torque * (rng.f64() - 0.5));
                    let h = 0.05 * rng.f64() + 1e-3;
                    if let Err(error) = plant.step(&inputs, h) {
                        assert!(has_rim(slosh), "{error} {p:?}");
                        break;
                    }
                    inputs.tau_cmd = Ramp::held(inputs.tau_cmd.value_at(h));
                    energy.add(plant.outputs(&inputs));
                }
                assert!(energy.residual() < 1e-8, "{:.1e} {p:?}", energy.residual());
            }
        }
    }
}

#[test]
fn the_dissipated_power_equals_the_rate_at_which_energy_is_lost() {
    // The power is computed as a central difference of the energy over 2 ms, which has the error (2 pi f h)^2/6 of the
    // power's change, about 1e-4.
    for slosh in SLOSH {
        let mut p = bench(slosh, FrictionModel::Viscous);
        (p.init.omega, p.init.slosh_angle, p.init.slosh_rate_radial) = (0.1, 0.2, 1.0);
        let inputs = Inputs::default();
        let mut plant = plant(&p, &inputs);
        let before = plant.outputs(&inputs).energy;
        plant.step(&inputs, 1e-3).unwrap();
        let power = plant.outputs(&inputs).power_dissipated;
        plant.step(&inputs, 1e-3).unwrap();
        let lost = (before - plant.outputs(&inputs).energy) / 2e-3;
        assert!((power / lost - 1.0).abs() < 1e-3, "{slosh:?}: {power} {lost}");
    }
}

#[test]
fn momentum_is_constant_without_torque_and_friction() {
    let mut rng = fastrand::Rng::with_seed(2);
    for slosh in SLOSH {
        for _ in 0..50 {
            let p = anywhere(&mut rng, slosh, FrictionModel::None);
            let inputs = Inputs::default();
            let mut plant = plant(&p, &inputs);
            let first = plant.outputs(&inputs);
            let mut largest = first.momentum.abs();
            let mut change: f64 = 0.0;
            for _ in 0..100 {
                if plant.step(&inputs, 0.05).is_err() {
                    assert!(has_rim(slosh));
                    break;
                }
                let now = plant.outputs(&inputs);
                // The largest momentum of the hub shows how much momentum hub and liquid exchange.
                largest = largest.max((now.omega * p.hub.inertia).abs());
                change = change.max((now.momentum - first.momentum).abs());
            }
            assert!(change <= 1e-10 * largest, "{slosh:?} {:.1e} {p:?}", change / largest);
        }
    }
}

#[test]
fn momentum_changes_only_by_torque_whatever_the_damping_of_the_liquid() {
    let mut p = bench(SloshModel::Spherical, FrictionModel::None);
    p.slosh.zeta_from_correlation = false;
    p.slosh.zeta = 0.1;
    (p.init.slosh_angle, p.init.slosh_rate_radial) = (0.4, 3.0);
    let inputs = Inputs { tau_cmd: Ramp::held(0.01), ..Inputs::default() };
    let mut plant = plant(&p, &inputs);
    let first = plant.outputs(&inputs).momentum;
    plant.step(&inputs, 10.0).unwrap();
    assert!((plant.outputs(&inputs).momentum - first - 0.1).abs() < 1e-11);
}

#[test]
fn energy_never_grows_without_torque() {
    let mut rng = fastrand::Rng::with_seed(3);
    for slosh in SLOSH {
        for friction in FRICTION {
            for _ in 0..10 {
                let mut p = anywhere(&mut rng, slosh, friction);
                p.slosh.zeta_from_correlation = true;
                let inputs = Inputs::default();
                let mut plant = plant(&p, &inputs);
                let first = plant.outputs(&inputs);
                let mut last = first;
                for _ in 0..200 {
                    if plant.step(&inputs, 0.05).is_err() {
                        assert!(has_rim(slosh));
                        break;
                    }
                    let now = plant.outputs(&inputs);
                    // The tolerance allows for rounding of the energy and for the error of the step.
                    assert!(now.energy <= last.energy + 1e-11 * first.energy, "{p:?}");
                    assert!(now.power_dissipated >= 0.0, "{p:?}");
                    assert!(now.heat >= last.heat - 1e-13 * first.energy, "{p:?}");
                    last = now;
                }
                let damped = slosh != SloshModel::Frozen || friction != FrictionModel::None;
                // A mode of the model `liquid` may reach the end of its range in the first step.
                if damped && first.energy > 0.0 && plant.time() > 0.0 {
                    assert!(last.heat > 0.0, "damping dissipates energy: {p:?}");
                }
            }
        }
    }
}

#[test]
fn the_outputs_fulfil_the_equation_of_motion_of_the_hub() {
    let mut rng = fastrand::Rng::with_seed(4);
    for slosh in SLOSH {
        for friction in FRICTION {
            for _ in 0..20 {
                let p = anywhere(&mut rng, slosh, friction);
                let inputs = Inputs {
                    tau_cmd: Ramp::held(p.hub.inertia * rng.f64()),
                    tau_ext: Ramp::held(p.hub.inertia * rng.f64()),
                    ..Inputs::default()
                };
                let mut plant = plant(&p, &inputs);
                let _ = plant.step(&inputs, 0.3);
                let o = plant.outputs(&inputs);
                let terms = [o.tau_actuator, inputs.tau_ext.value, o.tau_friction, o.tau_fluid];
                let size = terms.iter().map(|t| t.abs()).sum::<f64>();
                let rest = p.hub.inertia * o.omega_dot - terms.iter().sum::<f64>();
                // The liquid's torque is computed from forces, and not by the formula of omega_dot. The tolerance allows for
                // rounding errors with a heavy liquid on a light hub.
                assert!(rest.abs() <= 1e-11 * size, "{slosh:?} {friction:?} {rest:e} {size:e}");
            }
        }
    }
}

#[test]
fn a_stuck_hub_is_exactly_at_rest() {
    let mut p = bench(SloshModel::Linear, FrictionModel::Stribeck);
    // A slosh angle of 1 mrad exerts 1.7 mN m. The total is 3.7 mN m, and the bearing holds up to 5.9 mN m.
    p.init.slosh_angle = 0.001;
    let inputs = Inputs { tau_cmd: Ramp::held(0.002), ..Inputs::default() };
    let mut plant = plant(&p, &inputs);
    for _ in 0..500 {
        plant.step(&inputs, 0.02).unwrap();
        let o = plant.outputs(&inputs);
        assert!(o.discrete.stuck && o.omega == 0.0 && o.omega_dot == 0.0 && o.theta == 0.0);
        assert!(o.slosh_rate != 0.0, "the liquid must still move");
    }
}

#[test]
fn trajectory_does_not_depend_on_the_communication_step() {
    let mut rng = fastrand::Rng::with_seed(5);
    for slosh in SLOSH {
        for friction in FRICTION {
            let mut p = bench(slosh, friction);
            p.init.slosh_angle = 0.3;
            p.init.slosh_angle_radial = 0.1;
            let mut runs = Vec::new();
            for cut in 0..3 {
                // The torque is the same in all runs: a ramp over 10 s.
                let ramp = Ramp { value: -0.02, slope: 0.004 };
                let mut inputs = Inputs { tau_cmd: ramp, ..Inputs::default() };
                let mut plant = plant(&p, &inputs);
                while plant.time() < 10.0 {
                    let h = [0.02, 0.005, rng.f64() * 0.2 + 1e-6][cut].min(10.0 - plant.time());
                    plant.step(&inputs, h).unwrap();
                    inputs.tau_cmd.value = ramp.value_at(plant.time());
                }
                runs.push(plant.outputs(&inputs));
            }
            for other in &runs[1..] {
                assert!((runs[0].omega - other.omega).abs() < TOLERANCE, "{slosh:?} {friction:?}");
                assert!((runs[0].slosh_angle - other.slosh_angle).abs() < TOLERANCE);
            }
        }
    }
}

/// If the amplitude of the motion is halved, the relative difference of each nonlinear slosh model from the linear model
/// falls to a quarter.
#[test]
fn nonlinear_slosh_models_approach_the_linear_model_quadratically() {
    // Halving the amplitude must quarter the largest difference from the linear model, relative to the size of the motion.
    // The difference is a cubic term.
    for slosh in SLOSH {
        if matches!(slosh, SloshModel::Frozen | SloshModel::Linear) {
            continue;
        }
        let difference = |amplitude: f64| {
            let run = |slosh| {
                let mut p = bench(slosh, FrictionModel::Viscous);
                p.init.slosh_angle = amplitude;
                let inputs = Inputs::default();
                let mut plant = plant(&p, &inputs);
                (0..50)
                    .map(|_| {
                        plant.step(&inputs, 0.02).unwrap();
                        plant.outputs(&inputs).omega
                    })
                    .collect::<Vec<f64>>()
            };
            let pairs = run(SloshModel::Linear).into_iter().zip(run(slosh));
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / amplitude
        };
        let ratio = difference(0.02) / difference(0.01);
        assert!((ratio - 4.0).abs() < 0.1, "{slosh:?}: {ratio}");
    }
}

#[test]
fn a_bench_with_liquid_of_vanishing_mass_moves_as_a_bench_with_rigid_liquid() {
    let run = |slosh, rho| {
        let mut p = bench(slosh, FrictionModel::Stribeck);
        p.fluid.rho = rho;
        let inputs = Inputs { tau_cmd: Ramp::held(0.02), ..Inputs::default() };
        let mut plant = plant(&p, &inputs);
        plant.step(&inputs, 2.0).unwrap();
        plant.outputs(&inputs).omega
    };
    for slosh in [SloshModel::Linear, SloshModel::Planar, SloshModel::Spherical] {
        let frozen = run(SloshModel::Frozen, 1e-3);
        // 2 mg of water on 0.32 kg m2: the inertia of the pendulum is 1e-7 of the hub's inertia.
        assert!((run(slosh, 1e-3) / frozen - 1.0).abs() < 1e-6, "{slosh:?}");
    }
}

#[test]
fn friction_that_would_drive_the_hub_is_refused() {
    let refused = |asymmetry: f64, forward: [f64; 4]| {
        let mut p = bench(SloshModel::Linear, FrictionModel::Stribeck);
        p.friction.asymmetry = asymmetry;
        p.friction.harmonics_forward = forward;
        Plant::new(&p, &Inputs::default(), 0.0, TOLERANCE).err()
    };
    assert_eq!(refused(0.5, [0.4, 0.0, 0.0, 0.0]), None);
    assert_eq!(refused(-0.5, [0.3, 0.0, 0.0, 0.1]), None);
    // The lowest factor of dry friction is 1 - 0.5 - 0.4 sqrt(2) < 0.
    let problems = refused(-0.5, [0.4, 0.4, 0.0, 0.0]).unwrap();
    assert!(problems[0].contains("friction.asymmetry"), "{problems:?}");
    assert_eq!(refused(1.1, [0.0; 4]).unwrap().len(), 1, "only the backward factor is below 0");
}

#[test]
fn a_bearing_with_a_preferential_direction_holds_less_torque_in_that_direction() {
    // The hub breaks away at (c + d)(1 -+ eta): 4.737 and 7.105 mN m.
    let mut p = bench(SloshModel::Frozen, FrictionModel::Stribeck);
    p.friction.asymmetry = -0.2;
    let stuck = |torque: f64| {
        let inputs = Inputs { tau_cmd: Ramp::held(torque), ..Inputs::default() };
        plant(&p, &inputs).outputs(&inputs).discrete.stuck
    };
    assert!(stuck(4.736e-3) && !stuck(4.738e-3));
    assert!(stuck(-7.105e-3) && !stuck(-7.106e-3));
}

#[test]
fn hub_liquid_and_wheel_together_keep_their_momentum() {
    let mut p = bench(SloshModel::Spherical, FrictionModel::None);
    p.wheel.enabled = true;
    // The wheel saturates: first it reaches its torque limit, then the lowest speed of the rotor.
    let inputs = Inputs { tau_cmd: Ramp { value: 0.5, slope: -0.05 }, ..Inputs::default() };
    let mut plant = plant(&p, &inputs);
    let total = |o: Outputs| o.momentum + p.wheel.inertia * o.wheel_speed;
    let first = total(plant.outputs(&inputs));
    plant.step(&inputs, 20.0).unwrap();
    let last = plant.outputs(&inputs);
    assert!((total(last) - first).abs() < 1e-11, "{:e}", total(last) - first);
    assert!(last.wheel_speed > p.wheel.speed_min, "the reversed command must speed up the rotor");
}

/// The specific force falls to 0, so that nothing restores the liquid. All results must stay finite, or the run must end with
/// an error because the liquid has drifted beyond the largest displacement of the slosh model.
#[test]
fn without_gravity_results_stay_finite_or_drifting_liquid_ends_the_run() {
    for slosh in SLOSH {
        let mut p = bench(slosh, FrictionModel::Stribeck);
        p.init.slosh_angle = 0.1;
        let mut inputs = Inputs::default();
        let mut plant = plant(&p, &inputs);
        inputs.g_axial = Ramp { value: 9.81, slope: -9.81 };
        plant.step(&inputs, 1.0).unwrap();
        inputs.g_axial = Ramp::held(0.0);
        for _ in 0..10 {
            if plant.step(&inputs, 0.1).is_err() {
                assert!(has_rim(slosh), "this model has no largest displacement");
                break;
            }
        }
        let o = plant.outputs(&inputs);
        assert!(o.omega.is_finite() && o.slosh_angle.is_finite() && o.energy >= 0.0);
    }
}

#[test]
fn gyro_readings_are_equal_for_any_communication_step() {
    let mut p = bench(SloshModel::Linear, FrictionModel::Viscous);
    p.imu.enabled = true;
    p.imu.lsb = 1e-6;
    p.init.slosh_angle = 0.1;
    let inputs = Inputs::default();
    let reading = |cut: f64| {
        let mut plant = plant(&p, &inputs);
        while plant.time() < 1.99 {
            plant.step(&inputs, cut).unwrap();
        }
        let at = 2.005 - plant.time();
        plant.step(&inputs, at).unwrap();
        plant.outputs(&inputs)
    };
    let first = reading(0.02);
    assert!((first.omega_imu - first.omega).abs() > 0.0, "the reading must contain noise");
    for cut in [0.005, 0.0137, 0.4] {
        // The noise is equal. The rate itself differs within the tolerance, by at most one quantisation step.
        assert!((reading(cut).omega_imu - first.omega_imu).abs() < 1.1e-6, "{cut}");
    }
}

/// Number of random steps, which is smaller without `--release`. `.ci/run --nightly` sets HUBSLOSH_RANDOM_STEPS to 20,000; a
/// million steps take some 25 minutes. `HUBSLOSH_RANDOM_SEED` sets the first seed, so that several processes can share the
/// steps.
const RANDOM_STEPS: usize = if cfg!(debug_assertions) { 200 } else { 1_000 };

#[test]
fn random_steps_give_finite_results_or_a_clear_error() {
    let from =
        |name: &str, otherwise| std::env::var(name).map_or(otherwise, |s| s.parse().unwrap());
    let count = from("HUBSLOSH_RANDOM_STEPS", RANDOM_STEPS);
    let mut rng = fastrand::Rng::with_seed(from("HUBSLOSH_RANDOM_SEED", 6) as u64);
    let (mut done, mut refused) = (0, 0);
    while done < count {
        let slosh = SLOSH[rng.usize(0..SLOSH.len())];
        let friction = FRICTION[rng.usize(0..FRICTION.len())];
        // Half of the plants are the default bench, which a torque of 100 N m accelerates by 310 rad/s2. The torque on a smaller
        // plant is limited so that it does not accelerate it more.
        let mut p =
            if rng.bool() { bench(slosh, friction) } else { anywhere(&mut rng, slosh, friction) };
        // The number of modes is random, and usually small, because ten spherical modes are slow.
        p.slosh.modes = 1 + (rng.f64().powi(4) * plant::MODES as f64) as usize;
        p.wheel.enabled = rng.u8(..) < 32;
        p.imu.enabled = rng.u8(..) < 32;
        let largest = f64::min(100.0, 310.0 * p.hub.inertia);
        let mut inputs = Inputs::default();
        let mut plant = plant(&p, &inputs);
        for _ in 0..50 {
            let h = 10f64.powf(rng.f64() * 7.0 - 6.0);
            let torque = largest * (2.0 * rng.f64() - 1.0) * 10f64.powf(-4.0 * rng.f64());
            inputs.tau_cmd = Ramp { value: torque, slope: (rng.f64() - 0.5) * torque / h };
            inputs.tau_ext = Ramp::held(torque * (rng.f64() - 0.5));
            inputs.g_axial = Ramp::held(if rng.u8(..) < 8 { 0.0 } else { 20.0 * rng.f64() });
            let before = *plant.state();
            done += 1;
            match plant.step(&inputs, h) {
                Ok(()) => {
                    let o = plant.outputs(&inputs);
                    let all = [
                        o.theta,
                        o.omega,
                        o.omega_dot,
                        o.slosh_angle,
                        o.slosh_rate,
                        o.slosh_angle_radial,
                        o.slosh_rate_radial,
                        o.tau_friction,
                        o.tau_fluid,
                        o.f_tangential,
                        o.f_radial,
                        o.wave_height,
                        o.omega_imu,
                        o.energy,
                        o.momentum,
                        o.power_dissipated,
                        o.work,
                        o.heat,
                        o.wheel_speed,
                    ];
                    assert!(all.iter().all(|x| x.is_finite()), "{o:?} {p:?}");
                }
                Err(error) => {
                    refused += 1;
                    assert!(error.to_string().len() > 20);
                    assert_eq!(*plant.state(), before, "a refused step must not change the state");
                    break;
                }
            }
        }
    }
    println!("{done} steps, {refused} refused");
}

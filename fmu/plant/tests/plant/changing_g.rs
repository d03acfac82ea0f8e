//! Tests of a specific force along the tank's axis that changes while the plant runs: the damping follows it, and the work
//! that it does is in the energy balance.

use plant::{
    FrictionModel, Inputs, Outputs, Parameters, Plant, Ramp, STATES, SloshModel, Solver, x,
};

use crate::common::SLOSHING;

const TOLERANCE: f64 = 1e-9;

fn bench(slosh: SloshModel, friction: FrictionModel) -> Parameters {
    let mut p = Parameters::default();
    (p.slosh.model, p.friction.model) = (slosh, friction);
    (p.init.omega, p.init.slosh_angle, p.init.slosh_angle_radial) = (0.05, 0.2, 0.1);
    p.friction.eps = 1e-3;
    p
}

fn inputs_with_gravity(g: f64) -> Inputs {
    Inputs { g_axial: Ramp::held(g), ..Inputs::default() }
}

/// Specific force over 4 s: ramps, a jump upwards, a ramp to 0 and a ramp from 0.
const PIECES: [(Ramp, f64); 7] = [
    (Ramp { value: 9.81, slope: -3.0 }, 1.0),
    (Ramp { value: 6.81, slope: 0.0 }, 0.5),
    (Ramp { value: 12.0, slope: 2.0 }, 0.5),
    (Ramp { value: 13.0, slope: -26.0 }, 0.5),
    (Ramp { value: 0.0, slope: 0.0 }, 0.2),
    (Ramp { value: 0.0, slope: 10.0 }, 0.8),
    (Ramp { value: 3.0, slope: 1.0 }, 0.5),
];

fn run(p: &Parameters, h: f64) -> Vec<Outputs> {
    let mut plant = Plant::new(p, &inputs_with_gravity(9.81), 0.0, TOLERANCE).unwrap();
    let mut all = vec![plant.outputs(&inputs_with_gravity(9.81))];
    for (g, length) in PIECES {
        let steps = (length / h).ceil().max(1.0);
        let h = length / steps;
        for k in 0..steps as usize {
            let value = g.value_at(k as f64 * h);
            let torque = Ramp { value: 0.02 - 0.1 * k as f64 * h, slope: -0.1 };
            let inputs = Inputs {
                g_axial: Ramp { value, slope: g.slope },
                tau_cmd: torque,
                ..Inputs::default()
            };
            plant.step(&inputs, h).unwrap();
            let g_axial = Ramp::held(inputs.g_axial.value_at(h).max(0.0));
            all.push(plant.outputs(&Inputs { g_axial, ..inputs }));
        }
    }
    all
}

/// The specific force changes in ramps and jumps. The output `work_axial` is the work that these changes do.
#[test]
fn energy_is_balanced_if_the_work_of_a_changing_g_is_included() {
    for slosh in SloshModel::ALL {
        for friction in FrictionModel::ALL {
            for (correlation, zeta, modes) in [(true, 0.0, 1), (false, 0.05, 3), (false, 0.0, 1)] {
                let mut p = bench(slosh, friction);
                p.slosh.zeta_from_correlation = correlation;
                (p.slosh.zeta, p.slosh.modes) = (zeta, modes);
                let all = run(&p, 0.05);
                let first = all[0];
                let (mut throughput, mut axial) = (first.energy, 0.0);
                for pair in all.windows(2) {
                    let [last, now] = [pair[0], pair[1]];
                    throughput += (now.work - last.work).abs()
                        + (now.heat - last.heat).abs()
                        + (now.work_axial - last.work_axial).abs();
                    axial += (now.work_axial - last.work_axial).abs();
                    let balance = now.energy - first.energy - now.work - now.work_axial + now.heat;
                    // The tolerance is the solver's tolerance; a missing term would be a visible fraction of the throughput.
                    assert!(
                        balance.abs() < 1e-8 * throughput,
                        "{slosh:?} {friction:?} {balance:e}"
                    );
                }
                let sloshes = slosh != SloshModel::Frozen;
                assert_eq!(axial > 0.01 * throughput, sloshes, "{axial} of {throughput}");
            }
        }
    }
}

/// If the specific force jumps by dg, the potential energy of a mass m at the height z changes by m z dg, and the output
/// `work_axial` must contain this work for hub and liquid. The output `energy` is computed in another way, from the
/// components of gravity across the axis; its jump, and the jump of its derivative, must be equal.
#[test]
fn a_jump_of_g_on_a_tilted_bench_does_the_work_of_the_change_in_height() {
    for slosh in SloshModel::ALL {
        let mut p = bench(slosh, FrictionModel::Viscous);
        (p.bench.tilt, p.bench.tilt_azimuth) = (0.1, 0.7);
        (p.hub.imbalance, p.hub.imbalance_angle) = (0.4, 2.0);
        let mut plant = Plant::new(&p, &inputs_with_gravity(9.81), 0.0, TOLERANCE).unwrap();
        plant.step(&inputs_with_gravity(9.81), 0.1).unwrap();
        let x_dot = plant.derivatives(&inputs_with_gravity(9.81));
        let [before, after] = [9.81, 12.81].map(|g| {
            let rate = plant.output_derivatives(&inputs_with_gravity(g), &x_dot, &[0.0; 3]);
            [plant.outputs_held(&inputs_with_gravity(g)), rate]
        });
        for (value, other) in before.iter().zip(&after) {
            let residual = other.energy - value.energy - (other.work_axial - value.work_axial);
            // The tolerance allows for rounding errors in energies of 0.1 to 1 J and powers of 0.1 to 1 W.
            assert!(residual.abs() < 1e-14, "{slosh:?} {residual:e}");
        }
    }
}

#[test]
fn motion_under_ramps_of_g_does_not_depend_on_the_communication_step() {
    for slosh in SLOSHING {
        for correlation in [true, false] {
            let mut p = bench(slosh, FrictionModel::Viscous);
            p.slosh.zeta_from_correlation = correlation;
            p.slosh.zeta = 0.05;
            let (coarse, fine) = (run(&p, 10.0), run(&p, 0.003));
            let [a, b] = [coarse.last().unwrap(), fine.last().unwrap()];
            // The tolerance is the error of rates of 2 rad/s at the solver's tolerance.
            assert!((a.omega - b.omega).abs() < 1e-9, "{slosh:?} {}", a.omega - b.omega);
            assert!((a.slosh_rate - b.slosh_rate).abs() < 2e-9, "{slosh:?}");
            // The tolerance is the error of energies of 0.1 J at the solver's tolerance.
            assert!((a.work_axial - b.work_axial).abs() < 1e-10, "{slosh:?}");
        }
    }
}

/// The reference integrates the linear pendulum by classical Runge–Kutta in steps of 20 µs, with the damping formula written
/// out; the hub is too heavy to move.
#[test]
fn damping_follows_its_formula_while_g_ramps_through_zero() {
    let mut p = bench(SloshModel::Linear, FrictionModel::None);
    (p.slosh.zeta_from_correlation, p.slosh.zeta) = (false, 0.2);
    p.hub.inertia = 1e9; // so large that the hub does not move
    p.init.omega = 0.0;
    let down = Inputs { g_axial: Ramp { value: 4.0, slope: -4.0 }, ..Inputs::default() };
    let up = Inputs { g_axial: Ramp { value: 0.0, slope: 4.0 }, ..Inputs::default() };
    let mut plant = Plant::new(&p, &down, 0.0, TOLERANCE).unwrap();
    let length = plant.calculated().length[0];
    plant.step(&down, 1.0).unwrap();
    plant.step(&up, 1.0).unwrap();
    let x = plant.continuous_states();
    // c/m is 2 zeta sqrt(g/l) at any g.
    let pull = |t: f64, al: f64, rate: f64| {
        let g = 4.0 * (t - 1.0).abs();
        -2.0 * 0.2 * (g / length).sqrt() * rate - g / length * al
    };
    let (mut al, mut rate) = (0.2, 0.0);
    let steps = 100_000;
    let h = 2.0 / steps as f64;
    for k in 0..steps {
        let t = k as f64 * h;
        let k1 = (rate, pull(t, al, rate));
        let k2 =
            (rate + h / 2.0 * k1.1, pull(t + h / 2.0, al + h / 2.0 * k1.0, rate + h / 2.0 * k1.1));
        let k3 =
            (rate + h / 2.0 * k2.1, pull(t + h / 2.0, al + h / 2.0 * k2.0, rate + h / 2.0 * k2.1));
        let k4 = (rate + h * k3.1, pull(t + h, al + h * k3.0, rate + h * k3.1));
        al += h / 6.0 * (k1.0 + 2.0 * (k2.0 + k3.0) + k4.0);
        rate += h / 6.0 * (k1.1 + 2.0 * (k2.1 + k3.1) + k4.1);
    }
    // At g = 0 the root has a kink, where the Runge-Kutta method has an error of h^(3/2) = 9e-8 of the drag.
    assert!((x[x::SLOSH + 1] - al).abs() < 2e-8, "{} {al}", x[x::SLOSH + 1]);
    assert!((x[x::SLOSH + 3] - rate).abs() < 2e-7, "{} {rate}", x[x::SLOSH + 3]);
}

#[test]
fn ramps_of_g_to_zero_and_from_zero_take_a_bounded_number_of_internal_steps() {
    for slosh in SLOSHING {
        let mut p = bench(slosh, FrictionModel::None);
        // The limit of 100 internal steps allows for 20 halvings of g down to a millionth, for 34 steps in which g grows by half
        // from there, and for the steps that the motion needs.
        p.solver = Solver { max_steps: 100 };
        let inputs = |value, slope| Inputs { g_axial: Ramp { value, slope }, ..Inputs::default() };
        let mut plant = Plant::new(&p, &inputs_with_gravity(9.81), 0.0, TOLERANCE).unwrap();
        plant.step(&inputs(9.81, -98.1), 0.1).unwrap();
        plant.step(&inputs(0.0, 98.1), 0.1).unwrap();
        // The number of steps is also limited if the end of the ramp is inexact because of rounding of the simulation time.
        let (slope, h) = (-9.81 / 0.3, 0.3);
        let mut plant = Plant::new(&p, &inputs_with_gravity(9.81), 0.1, TOLERANCE).unwrap();
        plant.step(&inputs(9.81, slope), h).unwrap();
        assert!((inputs(9.81, slope).g_axial.value_at(h)).abs() < 1e-14);
    }
}

/// Returns the damping ratio from the logarithmic decrement of a free tangential motion on a heavy hub. The plant starts at
/// the specific force `g_start`, m/s2, and the motion takes place at `g`.
fn measured_zeta(p: &Parameters, g_start: f64, g: f64) -> f64 {
    let mut plant = Plant::new(p, &inputs_with_gravity(g_start), 0.0, TOLERANCE).unwrap();
    let length = plant.calculated().length[0];
    if g != g_start {
        let ramp = Ramp { value: g_start, slope: g - g_start };
        plant.step(&Inputs { g_axial: ramp, ..Inputs::default() }, 1.0).unwrap();
    }
    // The energy divided by g has peaks in every half period; ten periods are evaluated.
    let period = core::f64::consts::TAU / (g / length).sqrt();
    let amplitude2 = |plant: &Plant| {
        let x = plant.continuous_states();
        let (al, rate) = (x[x::SLOSH + 1], x[x::SLOSH + 3]);
        al * al + rate * rate * length / g
    };
    let before = amplitude2(&plant);
    for _ in 0..10 {
        plant.step(&inputs_with_gravity(g), period).unwrap();
    }
    -(amplitude2(&plant) / before).ln() / (2.0 * core::f64::consts::TAU * 10.0)
}

/// The specific force falls from 9.81 to 1, 0.1 or 0.01 m/s². The measured damping ratio must equal the damping ratio of a
/// run that starts at the lower value.
#[test]
fn damping_after_a_change_of_g_equals_the_damping_after_a_start_at_the_new_g() {
    for correlation in [true, false] {
        let mut p = bench(SloshModel::Linear, FrictionModel::None);
        p.hub.inertia = 1e9;
        p.slosh.zeta_from_correlation = correlation;
        p.init = plant::Init { slosh_angle: 0.1, ..Default::default() };
        for g in [1.0, 0.1, 0.01] {
            let (changed, started) = (measured_zeta(&p, 9.81, g), measured_zeta(&p, g, g));
            assert!((changed / started - 1.0).abs() < 0.01, "{g}: {changed} {started}");
            let plant = Plant::new(&p, &inputs_with_gravity(g), 0.0, TOLERANCE).unwrap();
            let zeta = plant.calculated().damping[0];
            // The damping ratio by the energy and the damping ratio by its peaks are defined differently and differ by zeta^2.
            assert!((started / zeta - 1.0).abs() < 0.01, "{g}: {started} {zeta}");
            let plant = Plant::new(&p, &inputs_with_gravity(9.81), 0.0, TOLERANCE).unwrap();
            let [shown, _] = plant.damping_ratio(0, &inputs_with_gravity(g));
            assert!((shown / zeta - 1.0).abs() < 1e-14, "{shown} {zeta}");
            assert_eq!(plant.damping_ratio(0, &inputs_with_gravity(0.0)), [0.0; 2]);
        }
    }
}

/// A plant that starts without specific force dissipates nothing. If 1 m/s² acts later, it has the same damping ratio as a
/// plant that starts at 1 m/s².
#[test]
fn a_plant_that_starts_at_zero_g_has_damping_once_g_acts() {
    for correlation in [true, false] {
        let mut p = bench(SloshModel::Linear, FrictionModel::None);
        p.hub.inertia = 1e9;
        p.slosh.zeta_from_correlation = correlation;
        p.init = plant::Init { slosh_angle: 0.1, ..Default::default() };
        let mut plant = Plant::new(&p, &inputs_with_gravity(0.0), 0.0, TOLERANCE).unwrap();
        let rest = plant.outputs(&inputs_with_gravity(0.0));
        plant.step(&inputs_with_gravity(0.0), 1.0).unwrap();
        assert_eq!(plant.outputs(&inputs_with_gravity(0.0)).heat, rest.heat, "nothing drags");
        let (from_zero, started) = (measured_zeta(&p, 0.0, 1.0), measured_zeta(&p, 1.0, 1.0));
        assert!((from_zero / started - 1.0).abs() < 1e-3, "{from_zero} {started}");
    }
}

#[test]
fn directional_derivatives_with_respect_to_g_include_the_change_of_the_damping() {
    for slosh in SLOSHING {
        let mut p = bench(slosh, FrictionModel::Viscous);
        p.init.slosh_rate = 1.0;
        let mut plant = Plant::new(&p, &inputs_with_gravity(9.81), 0.0, TOLERANCE).unwrap();
        // g differs from its value at the last accepted step, up to which the work is known.
        let (g, step) = (0.02, 1e-6);
        let (none, du) = ([0.0; STATES], [0.0, 0.0, 1.0]);
        let slopes = plant.directional_derivative(&inputs_with_gravity(g), &none, &du);
        let outputs = plant.output_derivatives(&inputs_with_gravity(g), &none, &du);
        let [above, below] =
            [g + step, g - step].map(|g| plant.derivatives(&inputs_with_gravity(g)));
        for i in 0..STATES {
            let difference = (above[i] - below[i]) / (2.0 * step);
            // The error is the square of 5e-5 of g, times the third derivative of the power.
            assert!((slopes[i] - difference).abs() < 1e-7 * (1.0 + difference.abs()), "{i}");
        }
        let ratio = |g: f64| plant.damping_ratio(0, &inputs_with_gravity(g))[0];
        let difference = (ratio(g + step) - ratio(g - step)) / (2.0 * step);
        let along = |value: f64| Inputs {
            g_axial: Ramp { value, slope: 1.0 },
            ..inputs_with_gravity(value)
        };
        let [_, slope] = plant.damping_ratio(0, &along(g));
        assert!((slope - difference).abs() < 1e-6 * (1e-3 + difference.abs()), "{slosh:?}");
        assert_eq!(plant.damping_ratio(0, &along(0.0))[1], 0.0, "no derivative: 0");
        let [above, below] = [g + step, g - step].map(|g| plant.outputs(&inputs_with_gravity(g)));
        let pairs: [fn(&Outputs) -> f64; 5] = [
            |o| o.work_axial,
            |o| o.energy,
            |o| o.f_tangential,
            |o| o.power_dissipated,
            |o| o.tau_fluid,
        ];
        for (n, get) in pairs.iter().enumerate() {
            let difference = (get(&above) - get(&below)) / (2.0 * step);
            let got = get(&outputs);
            assert!((got - difference).abs() < 1e-6 * (1e-3 + difference.abs()), "{slosh:?} {n}");
        }
        // Without specific force the derivative with respect to g does not exist; a finite number is returned.
        let at_zero = plant.directional_derivative(&inputs_with_gravity(0.0), &none, &du);
        assert!(at_zero.iter().all(|x| x.is_finite()));
        let at_zero = plant.output_derivatives(&inputs_with_gravity(0.0), &none, &du);
        assert!(at_zero.f_tangential.is_finite());
    }
}

/// Simulates a host of Model Exchange with a Runge–Kutta method of order 4 and steps of `h` seconds, while the specific force
/// is `g(t)`. Returns the residual of the energy balance, divided by the work of the changing specific force.
fn residual_of_a_host(p: &Parameters, h: f64, g: impl Fn(f64) -> f64) -> f64 {
    let mut plant = Plant::new(p, &inputs_with_gravity(g(0.0)), 0.0, TOLERANCE).unwrap();
    let energy = plant.outputs_held(&inputs_with_gravity(g(0.0))).energy;
    let steps = (2.0 / h).round() as usize;
    for k in 0..steps {
        let t = k as f64 * h;
        let x = *plant.continuous_states();
        let mut derivatives = |direction: &[f64; STATES], s: f64| {
            let moved = core::array::from_fn(|i| x[i] + s * direction[i]);
            plant.set_continuous_states(&moved);
            plant.set_time(t + s, Some(t + s), 0.0);
            plant.derivatives(&inputs_with_gravity(g(t + s)))
        };
        let k1 = derivatives(&[0.0; STATES], 0.0);
        let k2 = derivatives(&k1, h / 2.0);
        let k3 = derivatives(&k2, h / 2.0);
        let k4 = derivatives(&k3, h);
        let mean = core::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        derivatives(&mean, h);
        plant.accept_step(&inputs_with_gravity(g(t + h))).unwrap();
    }
    let o = plant.outputs_held(&inputs_with_gravity(g(2.0)));
    // A jump at an instant does exactly the expected work, without an error of the integrator.
    let jumped = inputs_with_gravity(g(2.0) + 3.0);
    let after = plant.outputs_held(&jumped);
    let jump = after.energy - o.energy - (after.work_axial - o.work_axial);
    assert!(jump.abs() < 1e-14, "{jump:e}");
    plant.take_event(&jumped).unwrap();
    assert_eq!(plant.outputs_held(&jumped).work_axial, after.work_axial);
    ((o.energy - energy - o.work - o.work_axial + o.heat) / o.work_axial).abs()
}

/// The residual of the energy balance must fall with the step size as the order of the integrator says. If trial evaluations
/// of the integrator changed `work_axial`, it would not.
#[test]
fn work_of_a_changing_g_is_added_at_accepted_steps_only() {
    for (slosh, tilt) in SLOSHING.into_iter().flat_map(|slosh| [(slosh, 0.0), (slosh, 0.1)]) {
        let mut p = bench(slosh, FrictionModel::Viscous);
        (p.bench.tilt, p.bench.tilt_azimuth) = (tilt, 0.7);
        (p.hub.imbalance, p.hub.imbalance_angle) = (4.0 * tilt, 2.0);
        // If g is linear in time, the residual is of fourth order, like the integrator; for a sine it is of second order.
        for (order, g) in [
            (4, (|t: f64| 9.0 - 3.0 * t) as fn(f64) -> f64),
            (2, |t: f64| 9.0 + 2.0 * libm::sin(5.0 * t)),
        ] {
            let [coarse, fine] = [4e-3, 2e-3].map(|h| residual_of_a_host(&p, h, g));
            let rate = libm::log2(coarse / fine);
            assert!(rate > order as f64 - 0.3, "{slosh:?} {order}: {coarse:e} {fine:e}");
            assert!(fine < if order == 4 { 1e-6 } else { 1e-3 }, "{slosh:?}: {fine:e}");
        }
    }
}

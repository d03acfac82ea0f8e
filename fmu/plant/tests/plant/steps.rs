//! Tests of the cost and the accuracy of steps.

use super::common::bench;
use plant::{FrictionModel, Inputs, Parameters, Plant, Ramp, STATES, SloshModel, StepError};

fn start(slosh: SloshModel, friction: FrictionModel) -> (Parameters, Inputs) {
    let mut p = bench(slosh, friction);
    p.friction.eps = 1e-2;
    p.friction.sigma0 = 100.0;
    (p.init.omega, p.init.slosh_angle, p.init.slosh_angle_radial) = (0.1, 0.2, 0.1);
    (p, Inputs { tau_cmd: Ramp { value: -0.05, slope: 0.02 }, ..Inputs::default() })
}

fn after(p: &Parameters, inputs: &Inputs, tolerance: f64, h: f64) -> [f64; STATES] {
    let mut plant = Plant::new(p, inputs, 0.0, tolerance).unwrap();
    plant.step(inputs, h).unwrap();
    *plant.continuous_states()
}

fn steps(p: &Parameters, inputs: &Inputs, tolerance: f64, h: f64) -> usize {
    let is_enough = |max_steps: usize| {
        let mut p = *p;
        p.solver.max_steps = max_steps;
        let done = Plant::new(&p, inputs, 0.0, tolerance).unwrap().step(inputs, h);
        assert!(matches!(done, Ok(()) | Err(StepError::TooManySteps { .. })), "{done:?}");
        done.is_ok()
    };
    let (mut few, mut enough) = (0, 1 << 16);
    while enough - few > 1 {
        let middle = (few + enough) / 2;
        if is_enough(middle) { enough = middle } else { few = middle }
    }
    enough
}

#[test]
fn errors_of_states_stay_within_the_solver_tolerance() {
    for slosh in SloshModel::ALL {
        for friction in FrictionModel::ALL {
            let (p, inputs) = start(slosh, friction);
            let exact = after(&p, &inputs, 1e-14, 2.0);
            for tolerance in [1e-3, 1e-5, 1e-7, 1e-9] {
                let found = after(&p, &inputs, tolerance, 2.0);
                let off = found.iter().zip(exact).map(|(a, b)| (a - b).abs());
                let off = off.fold(0.0, f64::max);
                // The states have rates of about 3 rad/s, and the error of a step may be a hundredth of the tolerance.
                assert!(off < 0.1 * tolerance, "{slosh:?} {friction:?} {tolerance:e}: {off:e}");
            }
        }
    }
}

/// If the torque on a hub without liquid and friction is linear in time, then angle, rate and energies are polynomials of
/// time, which the integrator computes exactly in steps of any length.
#[test]
fn for_polynomial_motion_the_number_of_internal_steps_does_not_depend_on_the_communication_step() {
    let p = bench(SloshModel::Frozen, FrictionModel::None);
    let inputs = Inputs { tau_cmd: Ramp { value: 0.01, slope: 1e-3 }, ..Inputs::default() };
    let [short, long] = [0.02, 1e4].map(|h| steps(&p, &inputs, 1e-9, h));
    assert_eq!(long, short);
}

/// Expected number of internal steps for each slosh model (rows) and friction law (columns), in the order of the
/// enumerations, and in each pair for the tolerances 1e-5 and 1e-10. More steps would be slower, and fewer steps less exact.
/// A deviation of one in twenty is accepted, because rounding changes the number.
const STEPS: [[[usize; 2]; FrictionModel::ALL.len()]; SloshModel::ALL.len()] = [
    [[2, 2], [2, 2], [7, 11], [4, 5], [121, 129]],
    [[7, 12], [7, 12], [34, 56], [16, 29], [174, 194]],
    [[15, 28], [15, 28], [34, 56], [16, 30], [172, 194]],
    [[16, 30], [16, 30], [34, 56], [17, 31], [172, 192]],
    [[19, 36], [19, 36], [34, 57], [20, 37], [172, 192]],
];

/// A change that makes the integrator slower is noticed, because the numbers of internal steps are compared for every slosh
/// model and friction law.
#[test]
fn a_second_of_motion_takes_the_expected_number_of_internal_steps() {
    let found = SloshModel::ALL.map(|slosh| {
        FrictionModel::ALL.map(|friction| {
            let (p, inputs) = start(slosh, friction);
            [1e-5, 1e-10].map(|tolerance| steps(&p, &inputs, tolerance, 1.0))
        })
    });
    let mut pairs =
        found.as_flattened().as_flattened().iter().zip(STEPS.as_flattened().as_flattened());
    let is_near = |(found, expected): (&usize, &usize)| 20 * found.abs_diff(*expected) <= *expected;
    let rows: String = found.iter().map(|row| format!("    {row:?},\n")).collect();
    assert!(
        pairs.all(is_near),
        "the numbers of steps differ from STEPS; if the change is intended, replace the rows by:\n{rows}"
    );
}

/// The tolerance is relative to the size of the motion, so that small waves on a hub at rest take no more steps than large
/// waves.
#[test]
fn a_small_motion_takes_no_more_internal_steps_than_a_large_one() {
    for slosh in SloshModel::ALL {
        let of_angle = |angle: f64| {
            let mut p = bench(slosh, FrictionModel::None);
            p.init.slosh_angle = angle;
            steps(&p, &Inputs::default(), 1e-8, 1.0)
        };
        let [small, large] = [2e-3, 0.2].map(of_angle);
        assert!(small <= large + 1, "{slosh:?}: {small} {large}");
    }
}

/// The hub is too heavy to move. The scale of the allowed error includes both angles and rates, so that a motion that starts
/// with an angle and without a rate needs no more steps than a motion that starts with a rate.
#[test]
fn rotary_slosh_takes_no_more_internal_steps_than_planar_slosh() {
    for slosh in SloshModel::ALL {
        let mut p = bench(slosh, FrictionModel::None);
        p.hub.inertia = 1e9;
        let of_start = |angle: f64, rate: f64| {
            let mut p = p;
            (p.init.slosh_angle, p.init.slosh_rate) = (angle, rate);
            steps(&p, &Inputs::default(), 1e-10, 0.1)
        };
        let [turning, swinging] = [of_start(0.01, 0.0), of_start(0.0, 0.15)];
        assert!(turning <= swinging + 1, "{slosh:?}: {turning} {swinging}");
    }
}

/// At eight times the Stribeck speed the excess friction of Stribeck's law is below 1e-30 and invisible at any tolerance. A
/// long step from this rate to rest must still take it into account.
#[test]
fn a_long_step_from_a_fast_hub_to_rest_equals_short_steps() {
    for friction in [FrictionModel::Stribeck, FrictionModel::StribeckSmooth] {
        for (omega, torque) in [(0.7, -0.3), (1.5, -0.5), (0.5, -0.2)] {
            let mut p = bench(SloshModel::Frozen, friction);
            (p.init.omega, p.friction.eps) = (omega, 1e-3);
            let inputs = Inputs { tau_cmd: Ramp::held(torque), ..Inputs::default() };
            let run = |h: f64, count: usize| {
                let mut plant = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap();
                for _ in 0..count {
                    plant.step(&inputs, h).unwrap();
                }
                plant.omega()
            };
            let off = run(4.0, 1) - run(1e-3, 4000);
            assert!(off.abs() < 1e-10, "{friction:?} {omega}: {off:e}");
        }
    }
}

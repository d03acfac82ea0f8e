//! While the inputs are constant or follow ramps, additional communication points change no bit of the motion, because they
//! lie within power series that do not depend on them.

use std::collections::BTreeSet;

use craft::{INPUTS, Inputs, MODES, Mount, Parameters, Ramp, STATES, Spacecraft, State, index};

use super::random::Random;
use super::seeds::every_or;

const TOLERANCES: [f64; 3] = [1e-5, 1e-8, 1e-11];

fn random_rows(random: &mut Random, total: f64) -> Vec<f64> {
    let mut times = vec![0.0];
    loop {
        let next = times[times.len() - 1] + random.magnitude(1e-4, 0.7);
        if next >= total {
            break;
        }
        times.push(next);
    }
    times.push(total);
    times.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Returns a craft of the given kind: with pendulums, drag that depends on the motion, other surfaces than spheres, planar
/// modes, a pivot with dry friction, liquid that may detach, flexible appendages, or spinning liquid.
fn craft_of(kind: usize, seed: u64) -> (Parameters, [Inputs; 4]) {
    let mut random = Random::new(seed);
    let mut p = random.parameters();
    p.tanks = 1 + seed as usize % 2;
    match kind {
        1 => p.tank.iter_mut().for_each(|tank| random.follow(tank)),
        2 => random.bend_all(&mut p),
        3 => random.make_all_planar(&mut p),
        4 => {
            (p.mount, p.pivot) = (Mount::Pivot, random.pivot());
            (p.init.position, p.init.velocity) = ([0.0; 3], [0.0; 3]);
        }
        5 => p.tank.iter_mut().for_each(|tank| tank.ball.travel = 0.6),
        6 => random.flex(&mut p),
        7 => random.spin_all(&mut p),
        _ => {}
    }
    let inputs = [(); 4].map(|()| {
        let mut u = Inputs {
            force: Ramp::held(random.vector(200.0)),
            torque: Ramp::held(random.vector(50.0)),
            h_wheels: Ramp::held(random.vector(5.0)),
            ..Inputs::default()
        };
        u.force.value[2] += [2.0, 1.0][random.below(2)] * p.craft.mass;
        u
    });
    (p, inputs)
}

/// Returns the inputs with slopes, so that they change by about a tenth of their size in 2 s.
fn sloped(inputs: &[Inputs; 4], seed: u64) -> [Inputs; 4] {
    let mut random = Random::new(seed);
    inputs.map(|mut u| {
        u.force.slope = random.vector(10.0);
        u.torque.slope = random.vector(2.5);
        u.h_wheels.slope = random.vector(0.25);
        u
    })
}

/// Returns the inputs `t` seconds later, as a host computes them: with rounding errors.
fn inputs_after(u: &Inputs, t: f64) -> Inputs {
    let [force, torque, h_wheels] = [u.force, u.torque, u.h_wheels]
        .map(|ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope });
    Inputs { force, torque, h_wheels, ..*u }
}

fn bits(craft: &Spacecraft) -> [u64; STATES] {
    craft.borrow_states().map(f64::to_bits)
}

/// Simulates the craft with each of the `inputs`, which follow their ramps, for 2 s. `rows` returns the lengths of the steps,
/// and `look` is called after each step. Returns the bits of the states at each change of the
/// inputs.
fn run(
    (p, inputs, tolerance): (&Parameters, &[Inputs; 4], f64),
    mut rows: impl FnMut() -> Vec<f64>,
    mut look: impl FnMut(&mut Spacecraft, &Inputs),
) -> Vec<[u64; STATES]> {
    let mut craft = Spacecraft::new(p, &inputs[0], 0.0, tolerance).unwrap();
    let mut all = Vec::new();
    for u in inputs {
        let mut t = 0.0;
        for h in rows() {
            if craft.step(&inputs_after(u, t), h).is_err() {
                return all; // a bob at the bound of its surface
            }
            t += h;
            look(&mut craft, &inputs_after(u, t));
        }
        all.push(bits(&craft));
    }
    all
}

fn assert_same(found: &[[u64; STATES]], whole: &[[u64; STATES]], what: &str) {
    assert_eq!(found.len(), whole.len(), "{what}");
    for (n, (found, whole)) in found.iter().zip(whole).enumerate() {
        for (i, (found, whole)) in found.iter().zip(whole).enumerate() {
            let [a, b] = [*found, *whole].map(f64::from_bits);
            assert!(found == whole, "{what}: state {i} at change {n}: {a:?} and {b:?}");
        }
    }
}

fn every_kind(mut test: impl FnMut((&Parameters, &[Inputs; 4], f64), usize, u64)) {
    for kind in 0..8 {
        for seed in every_or(&[0, 1, 2], 0..6) {
            let (p, inputs) = craft_of(kind, 10 * kind as u64 + seed);
            for inputs in [inputs, sloped(&inputs, seed)] {
                test((&p, &inputs, TOLERANCES[seed as usize % 3]), kind, seed);
            }
        }
    }
}

/// The ranges of validity that are computed alone must equal the ranges among all outputs. The
/// tanks have random limits of the slosh angle, which about half of the waves exceed, so that
/// different ranges occur.
#[test]
fn after_each_row_the_discrete_outputs_computed_alone_equal_those_computed_with_all_outputs() {
    let (mut compared, mut reasons) = (0, BTreeSet::new());
    every_kind(|(p, inputs, tolerance), kind, seed| {
        let (mut p, mut random) = (*p, Random::new(seed));
        for tank in &mut p.tank {
            tank.g_bond = [0.0, random.between(0.0, 2.0)][random.below(2)];
            tank.wave = [0.4; MODES];
            tank.angle_limit = random.vector::<MODES>(0.5).map(f64::abs);
            tank.swirl_limit =
                [[0.0; MODES], random.vector(0.5).map(f64::abs)][seed as usize / 2 % 2];
            tank.breaking_steepness = random.vector::<MODES>(0.8).map(f64::abs);
        }
        let rows = || random_rows(&mut random, 2.0);
        run((&p, inputs, tolerance), rows, |craft, u| {
            let Some(alone) = craft.discrete_outputs(u) else { return };
            let all = craft.outputs(u).tank.map(|tank| (tank.ranges, tank.ball_state));
            assert_eq!(alone, all, "kind {kind}, seed {seed}");
            compared += 1;
            reasons.extend(all.map(|(ranges, _)| ranges.limited_by as u8));
        });
    });
    assert!(compared > 1000 && reasons.len() > 5, "{compared} {reasons:?}");
}

#[test]
fn communication_points_change_no_bit_of_the_motion_while_inputs_are_constant_or_follow_ramps() {
    let mut compared = 0;
    every_kind(|motion, kind, seed| {
        let tolerance = motion.2;
        let whole = run(motion, || vec![2.0], |_, _| {});
        compared += whole.len();
        let mut random = Random::new(seed);
        for found in [
            run(motion, || vec![1.0; 2], |_, _| {}),
            run(motion, || vec![0.03125; 64], |_, _| {}),
            run(motion, || random_rows(&mut random, 2.0), |_, _| {}),
        ] {
            assert_same(&found, &whole, &format!("{kind} {seed} {tolerance:e}"));
        }
    });
    assert!(compared > 100, "{compared}");
}

/// Between steps an importer may read outputs (also for other inputs), derivatives and event indicators, and may save and restore
/// the state, without changing the motion.
#[test]
fn reading_and_saving_between_rows_change_no_bit_of_the_motion() {
    every_kind(|motion, kind, seed| {
        let (p, _, tolerance) = motion;
        let whole = run(motion, || vec![2.0], |_, _| {});
        let mut random = Random::new(seed + 100);
        let mut rows = Random::new(seed);
        let look = |craft: &mut Spacecraft, u: &Inputs| match random.below(8) {
            0 => _ = craft.outputs(u),
            1 => _ = craft.outputs(&random.inputs()),
            2 => _ = craft.derivatives(u),
            3 => {
                let _ = craft.directional_derivative(u, &[0.1; STATES], &[1.0; INPUTS]);
                let _ = craft.output_derivatives(u, &[0.2; STATES], &[0.5; INPUTS]);
            }
            4 => craft.event_indicators(u, &mut [0.0; 2 * craft::TANKS]),
            5 => {
                let state = State::from_words(&craft.state().to_words()).unwrap();
                *craft = Spacecraft::resume(p, &state, tolerance);
            }
            6 => {
                let saved = *craft.state();
                craft.step(&random.inputs(), 0.3).ok();
                craft.set_state(&saved);
            }
            _ => *craft = craft.clone(),
        };
        let found = run(motion, || random_rows(&mut rows, 2.0), look);
        assert_same(&found, &whole, &format!("{kind} {seed} {tolerance:e}"));
    });
}

/// Thrust is reversed at 2 s, so that the liquid leaves the bottom, flies and hits the wall. Events are located as roots of the
/// power series of a whole internal step, and output rows do not shorten this step.
#[test]
fn the_spacing_of_output_rows_changes_no_bit_of_the_motion_of_detached_liquid() {
    let mut p = Parameters::default();
    p.tank[0].ball.travel = 0.6;
    p.init.omega = [0.02, 0.01, 0.0];
    let thrust = |f: f64| Inputs { force: Ramp::held([5.0, 0.0, f]), ..Inputs::default() };
    let inputs = [500.0, -200.0, 300.0, 100.0].map(thrust);
    let motion = (&p, &inputs, 1e-9);
    let mut states = Vec::new();
    let whole = run(motion, || vec![2.0], |craft, _| states.push(craft.has_lump()));
    assert!(states[1] && whole.len() == 4, "{states:?}");
    let mut random = Random::new(7);
    for found in [
        run(motion, || vec![0.03125; 64], |_, _| {}),
        run(motion, || random_rows(&mut random, 2.0), |craft, u| _ = craft.outputs(u)),
    ] {
        assert_same(&found, &whole, "ball");
    }
}

#[test]
fn setting_the_states_starts_a_new_expansion() {
    let (p, inputs) = craft_of(0, 3);
    let mut craft = Spacecraft::new(&p, &inputs[0], 0.0, 1e-9).unwrap();
    craft.step(&inputs[0], 0.1).unwrap();
    let mut x = craft.continuous_states();
    x[index::OMEGA] += 0.1;
    craft.set_continuous_states(&x);
    let mut other = Spacecraft::new(&p, &inputs[0], 0.0, 1e-9).unwrap();
    other.step(&inputs[0], 0.1).unwrap();
    craft.step(&inputs[0], 0.1).unwrap();
    other.step(&inputs[0], 0.1).unwrap();
    let turned = craft.continuous_states()[index::OMEGA] - other.continuous_states()[index::OMEGA];
    assert!((turned - 0.1).abs() < 0.05, "{turned}");
}

/// Returns the largest error of attitude, angular velocity and bobs after 20 s. The inputs change every `h` seconds, and the
/// integrator starts a new power series at each change.
fn error_of_restarts(h: f64, tolerance: f64) -> f64 {
    let (p, _) = craft_of(0, 2);
    let run = |tolerance: f64| {
        let torque = |k: usize| {
            let value = 20.0 * f64::sin(2.5 * h * k as f64);
            Ramp::held([value, 0.5 * value, -value])
        };
        let with = |k: usize| Inputs {
            force: Ramp::held([0.0, 0.0, 2.0 * p.craft.mass]),
            torque: torque(k),
            ..Inputs::default()
        };
        let mut craft = Spacecraft::new(&p, &with(0), 0.0, tolerance).unwrap();
        (0..(20.0 / h) as usize).for_each(|k| craft.step(&with(k), h).unwrap());
        craft.continuous_states()
    };
    let (found, exact) = (run(tolerance), run(1e-14));
    let angles = (0..index::POSITION).chain(index::BOBS..index::LIQUID);
    angles.map(|i| (found[i] - exact[i]).abs()).fold(0.0, f64::max)
}

/// The allowed error of a short step is proportional to its length, so that many short steps
/// together stay within the tolerance.
#[test]
fn short_steps_between_changes_of_inputs_are_within_the_solver_tolerance() {
    for h in [0.1, 0.05, 0.02, 0.005] {
        for tolerance in [1e-6, 1e-8, 1e-10, 1e-12] {
            let error = error_of_restarts(h, tolerance);
            assert!(error < tolerance, "{h} s, {tolerance:e}: {error:e}");
        }
    }
}

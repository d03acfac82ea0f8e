//! The packed FMUs compute bit-identical results to the crate `craft`, so that the results of the crate's tests
//! hold for the FMUs.

use craft::{
    BallState, Coupling, INPUTS, Inputs, Line, Mount, Parameters, Ramp, Ranges, STATES, TankInputs,
    TankOutputs, TankParameters,
};

use super::component::{SloshTank, Spacecraft};
use super::random::{Random, draining_craft, draining_tank};
use super::records::{
    STEP, at_end, inputs, motion, motion_at_end, numbers, parameters, records, steps,
    tank_parameters,
};

const TOLERANCE: f64 = 1e-10;

/// Number of communication steps in a random run of 2 s, whose inputs jump every half second.
const COUNT: usize = 100;

/// Returns the outputs of a tank after setting outputs that `component.rs` does not read to 0.
fn read(out: TankOutputs) -> TankOutputs {
    TankOutputs {
        axial: 0.0,
        turning: 0.0,
        ranges: Ranges::default(),
        ball_state: BallState::Settled,
        ball_position: [0.0; 3],
        ball_velocity: [0.0; 3],
        ..out
    }
}

/// Compares craft in the FMU and in the crate: the outputs after each of `count` steps, then the derivatives and their
/// directional derivative in Model Exchange. `input` returns the inputs of a step, and `what` describes the run for messages.
fn compare(what: &str, p: &Parameters, input: impl Fn(usize) -> Inputs, count: usize) {
    let start = input(0);
    let mut own = craft::Spacecraft::new(p, &start, 0.0, TOLERANCE).unwrap();
    let mut packed = Spacecraft::new(p, &start, 0.0, TOLERANCE).unwrap();
    for k in 0..count {
        let u = input(k);
        own.step(&u, STEP).unwrap();
        packed.step(&u, STEP).unwrap();
        let end = at_end(&u);
        let mut expected = own.outputs(&end);
        expected.tank = expected.tank.map(read);
        assert_eq!(packed.outputs(&end), expected, "{what}, step {k}");
    }
    let x = own.continuous_states();
    assert_eq!(packed.continuous_states(), x, "{what}");

    // In Model Exchange the FMU receives no slopes of inputs.
    let held = |ramp: Ramp| Ramp::held(ramp.value);
    let u = Inputs {
        force: held(start.force),
        torque: held(start.torque),
        h_wheels: held(start.h_wheels),
        mass_flow: start.mass_flow.map(|flow| Line { value: flow.value, slope: 0.0 }),
    };
    packed.set_continuous_states(&x);
    let mut own = craft::Spacecraft::new(p, &start, 0.0, TOLERANCE).unwrap();
    own.set_continuous_states(&x);
    assert_eq!(packed.derivatives(&u), own.derivatives(&u), "{what}");
    let mut random = Random::new(count as u64);
    let (dx, du): ([f64; STATES], [f64; INPUTS]) = (random.vector(1.0), random.vector(1.0));
    let expected = own.directional_derivative(&u, &dx, &du);
    assert_eq!(packed.directional_derivative(&u, &dx, &du), expected, "{what}");
}

/// The random craft are free or on a pivot, with round and planar modes, surfaces other than spheres, every damping law,
/// draining, appendages, and liquid that spins.
#[test]
fn the_fmu_and_the_crate_move_random_craft_bit_identically() {
    for seed in 0..40 {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        let mut mass_flow = Inputs::default().mass_flow;
        match seed % 5 {
            0 => {}
            1 => {
                (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
                p.pivot = random.pivot();
            }
            2 => random.make_all_planar(&mut p),
            3 => random.bend_all(&mut p),
            _ => {
                let (draining, u) = draining_craft(seed, seed as usize / 5 % 4);
                (p, mass_flow) = (draining, u.mass_flow);
            }
        }
        if seed % 3 == 0 && seed % 5 != 4 {
            p.tank.iter_mut().for_each(|tank| random.follow(tank));
        }
        if seed >= 25 {
            random.flex(&mut p);
        }
        if seed >= 30 && seed % 5 != 4 {
            random.spin_all(&mut p);
        }
        let pieces: Vec<Inputs> = (0..COUNT / 25).map(|_| random.inputs()).collect();
        let input = |k: usize| {
            let (piece, t) = (pieces[k / 25], (k % 25) as f64 * STEP);
            let at = |ramp: Ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope };
            let since = k as f64 * STEP;
            Inputs {
                force: at(piece.force),
                torque: at(piece.torque),
                h_wheels: at(piece.h_wheels),
                mass_flow: mass_flow
                    .map(|flow| Line { value: flow.value_at(since), slope: flow.slope }),
            }
        };
        compare(&format!("seed {seed}"), &p, input, COUNT);
    }
}

/// The FMU and the crate get the inputs of each reference record. The crate's test `reference` compares their final state
/// with the record.
#[test]
fn spacecraft_equals_the_crate_bit_for_bit_in_every_reference_record() {
    for record in &records("craft") {
        let (last, _) = steps(record);
        let name = record["name"].as_str().unwrap();
        compare(name, &parameters(record), |k| inputs(record, k), last);
    }
}

fn compare_tank(
    what: &str,
    p: &TankParameters,
    mut u: TankInputs,
    next: impl Fn(usize, TankInputs) -> TankInputs,
    count: usize,
) {
    let start = u;
    let mut own = craft::SloshTank::new(p, &start, 0.0, TOLERANCE).unwrap();
    let mut packed = SloshTank::new(p, &start, 0.0, TOLERANCE).unwrap();
    assert_eq!(packed.coupling_ratio(), own.coupling_ratio(), "{what}");
    for k in 0..count {
        u = next(k, u);
        own.step(&u, STEP).unwrap();
        packed.step(&u, STEP).unwrap();
        u = motion_at_end(&u);
        let mut expected = own.outputs(&u);
        expected.tank = read(expected.tank);
        assert_eq!(packed.outputs(&u), expected, "{what}, step {k}");
    }
    let x = own.continuous_states();
    assert_eq!(packed.continuous_states(), x, "{what}");

    packed.set_continuous_states(&x);
    let mut own = craft::SloshTank::new(p, &start, 0.0, TOLERANCE).unwrap();
    own.set_continuous_states(&x);
    assert_eq!(packed.derivatives(&start), own.derivatives(&start), "{what}");
}

#[test]
fn the_fmu_and_the_crate_move_random_tanks_bit_identically() {
    for seed in 0..36 {
        let mut random = Random::new(seed);
        let mut p = TankParameters {
            tank: random.tank(),
            coupling: Coupling::ALL[seed as usize % 3],
            ..TankParameters::default()
        };
        match seed % 4 {
            0 => {}
            1 => random.make_planar(&mut p.tank),
            2 => random.bend(&mut p.tank),
            _ => p.tank = draining_tank(&mut random, seed as usize / 4 % 4),
        }
        if seed % 5 == 0 && seed % 4 != 3 {
            random.follow(&mut p.tank);
        }
        if seed >= 20 && seed % 4 != 3 {
            random.spin(&mut p.tank);
        }
        if seed % 2 == 0 {
            p.host = Some(random.parameters().craft);
        }
        let mut ramp = |size: f64| Ramp { value: random.vector(size), slope: random.vector(size) };
        let pieces = [(); COUNT / 25].map(|()| (ramp(2.0), ramp(1.0)));
        let omega = ramp(0.5).value;
        let flow = Line { value: random.between(1.0, 5.0), slope: 0.0 };
        let next = |k: usize, u: TankInputs| {
            let t = (k % 25) as f64 * STEP;
            let at = |ramp: Ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope };
            let (a, omega_dot) = pieces[k / 25];
            TankInputs { a: at(a), omega_dot: at(omega_dot), ..u }
        };
        let start = TankInputs { omega, mass_flow: flow, ..TankInputs::default() };
        compare_tank(&format!("seed {seed}"), &p, start, next, COUNT);
    }
}

#[test]
fn slosh_tank_equals_the_crate_bit_for_bit_in_every_reference_record() {
    for record in &records("tank") {
        let (last, _) = steps(record);
        let name = record["name"].as_str().unwrap();
        let omega = numbers(&record["w0"]).try_into().unwrap();
        let next = |k: usize, u: TankInputs| motion(record, k, u.omega);
        compare_tank(name, &tank_parameters(record), motion(record, 0, omega), next, last);
    }
}

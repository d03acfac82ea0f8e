//! Communication steps of both FMUs: what is shown after one, and that how many there are does not
//! matter.

use craft::{Inputs, Ramp, TankInputs, TankParameters};
use host::fmi2::{CallError, Status};
use runtime::instance::Instance;
use runtime::operation::{Interface, SET_REAL, Version};
use runtime::snapshot::to_bytes;
use runtime::variable::Value;

use super::component::{SloshTank, Spacecraft};
use super::random::Random;
use super::records::{STEP, at_end, motion_at_end};

/// Right after a step outputs are limits from the left: the torque of wheels that have been turning
/// up is in them, and the rate of a host that has turned.
#[test]
fn outputs_after_a_step_are_those_at_its_end() {
    for seed in 0..10 {
        let mut random = Random::new(seed);
        let p = random.parameters();
        let u = random.inputs();
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
        craft.step(&u, STEP).unwrap();
        let after = craft.outputs_after_step();
        assert_eq!(after, craft.outputs(&at_end(&u)));

        let p = TankParameters { tank: random.tank(), ..TankParameters::default() };
        let mut ramp = |size: f64| Ramp { value: random.vector(size), slope: random.vector(size) };
        let u = TankInputs {
            a: ramp(2.0),
            omega: ramp(0.5).value,
            omega_dot: ramp(0.5),
            ..TankInputs::default()
        };
        let mut tank = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
        tank.step(&u, STEP).unwrap();
        let after = tank.outputs_after_step();
        assert_eq!(after.bias, tank.outputs(&motion_at_end(&u)).bias);
        assert_eq!(after.tank.force, tank.outputs(&motion_at_end(&u)).tank.force);
    }
}

/// Steps of random craft and tanks with anything at all as input, one in twenty beyond all sense:
/// finite numbers, or fmi2Error with a message. Returns how many were refused.
fn random_steps(count: usize, seed: u64) -> usize {
    let mut random = Random::new(seed);
    let (mut steps, mut refused) = (0, 0);
    while steps < count {
        let mut p = random.parameters();
        p.init.omega = [(); 3].map(|()| random.magnitude(1e-6, 1e2));
        let alone = TankParameters { tank: p.tank[0], ..TankParameters::default() };
        let tolerance = random.magnitude(1e-14, 1e-1);
        let mut craft = Spacecraft::new(&p, &Inputs::default(), 0.0, tolerance).unwrap();
        let mut tank = SloshTank::new(&alone, &TankInputs::default(), 0.0, tolerance).unwrap();
        // After fmi2Error an instance makes no more steps.
        let [mut craft_goes_on, mut tank_goes_on] = [true; 2];
        for _ in 0..100 {
            let nonsense = random.below(20) == 0;
            let size = if nonsense { 1e160 } else { random.magnitude(1e-6, 1e5) };
            let mut ramp = || Ramp { value: random.vector(size), slope: random.vector(size) };
            let u = Inputs { force: ramp(), torque: ramp(), h_wheels: ramp(), ..Inputs::default() };
            let size = if nonsense { 1e160 } else { random.magnitude(1e-6, 1e2) };
            let mut ramp = || Ramp { value: random.vector(size), slope: random.vector(size) };
            let motion = TankInputs {
                a: ramp(),
                omega: ramp().value,
                omega_dot: ramp(),
                ..TankInputs::default()
            };
            let h = random.magnitude(1e-9, 0.1);
            let mut check = |done: Result<Vec<f64>, CallError>| {
                steps += 1;
                match done {
                    Ok(numbers) => {
                        assert!(numbers.iter().all(|x| x.is_finite()));
                        true
                    }
                    Err(error) => {
                        refused += 1;
                        assert!(error.status == Status::Error && !error.text().is_empty());
                        false
                    }
                }
            };
            if craft_goes_on {
                let done = craft.step(&u, h);
                craft_goes_on = check(done.map(|()| craft.all()));
            }
            if tank_goes_on {
                let done = tank.step(&motion, h);
                tank_goes_on = check(done.map(|()| tank.all()));
            }
        }
    }
    refused
}

#[test]
fn random_steps_end_in_numbers_or_a_clear_error() {
    let refused = random_steps(20_000, 7);
    assert!((500..10_000).contains(&refused), "{refused}");
}

/// The same, longer: `.ci/run` calls it.
#[test]
#[ignore = "takes a minute"]
fn a_million_random_steps_end_in_numbers_or_a_clear_error() {
    random_steps(1_000_000, 8);
}

/// omega follows from omega_dot in a step and may not leave its range there.
#[test]
fn a_step_refused_for_where_an_input_would_end_leaves_the_tank_as_it_was() {
    let mut tank = Instance::<::SloshTank::Model>::new(Version::Fmi2, Interface::CoSimulation);
    tank.setup_experiment(None, 0.0, None).unwrap();
    tank.enter_initialization_mode().unwrap();
    tank.exit_initialization_mode().unwrap();
    let omega_dot = ::SloshTank::table::TABLE.find("omega_dot[1]").unwrap();
    tank.set(&SET_REAL, &[omega_dot], |_| Value::Real(8e8)).unwrap();
    let before = to_bytes(&tank);
    let why = tank.do_step(0.0, 2.0).unwrap_err();
    assert!(why.text.contains("omega[1] = 1600000000.0"), "{}", why.text);
    assert!(to_bytes(&tank) == before);
}

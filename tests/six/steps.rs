//! Communication steps of Spacecraft and SloshTank: outputs after a step, and independence of the number of steps.

use craft::{Inputs, Line, Parameters, Ramp, TankInputs, TankParameters};
use host::fmi2::{CallError, MODEL_EXCHANGE, Status};
use runtime::call::Interface;
use runtime::instance::Instance;
use runtime::snapshot::to_bytes;
use runtime::v2::{Fmi2, GET_REAL, SET_INTEGER, SET_REAL};
use runtime::variable::Value;

use super::component::{SloshTank, Spacecraft, load};
use super::random::{Random, draining_tank};
use super::records::{STEP, at_end, motion_at_end};

/// Directly after a step the outputs are limits from the left: they include the torque of wheels that have accelerated in the
/// step, and the rate of a tank that has rotated.
#[test]
fn outputs_after_a_step_belong_to_its_end() {
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

/// Makes `count` steps of random craft and tanks with random inputs, one in twenty of extreme magnitude. Each step must give
/// finite numbers, or fmi2Error with a message. Returns the number of refused steps.
fn random_steps(count: usize, seed: u64) -> usize {
    let mut random = Random::new(seed);
    let (mut steps, mut refused) = (0, 0);
    while steps < count {
        let mut p = random.parameters();
        p.init.omega = [(); 3].map(|()| random.magnitude(1e-6, 1e2));
        // Every third tank drains.
        if random.below(3) == 0 {
            p.tank[0] = draining_tank(&mut random, 2);
        }
        let alone = TankParameters { tank: p.tank[0], ..TankParameters::default() };
        let tolerance = random.magnitude(1e-14, 1e-1);
        let mut craft = Spacecraft::new(&p, &Inputs::default(), 0.0, tolerance).unwrap();
        let mut tank = SloshTank::new(&alone, &TankInputs::default(), 0.0, tolerance).unwrap();
        // After fmi2Error no further steps of this instance are made.
        let [mut craft_goes_on, mut tank_goes_on] = [true; 2];
        for _ in 0..100 {
            let nonsense = random.below(20) == 0;
            let size = if nonsense { 1e160 } else { random.magnitude(1e-6, 1e5) };
            let mut ramp = || Ramp { value: random.vector(size), slope: random.vector(size) };
            let [force, torque, h_wheels] = [ramp(), ramp(), ramp()];
            let size = if nonsense { 1e160 } else { random.magnitude(1e-6, 1e2) };
            let mut ramp = || Ramp { value: random.vector(size), slope: random.vector(size) };
            let motion = TankInputs {
                a: ramp(),
                omega: ramp().value,
                omega_dot: ramp(),
                ..TankInputs::default()
            };
            let mass_flow = [(); 4].map(|()| Line {
                value: random.between(-1.0, 1.0),
                slope: random.between(-1.0, 1.0),
            });
            let u = Inputs { force, torque, h_wheels, mass_flow };
            let motion = TankInputs { mass_flow: mass_flow[0], ..motion };
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
fn random_steps_give_finite_results_or_a_clear_error_message() {
    let refused = random_steps(20_000, 7);
    assert!((500..10_000).contains(&refused), "{refused}");
}

/// The long form of `random_steps_give_finite_results_or_a_clear_error_message`.
#[test]
#[ignore = "a minute: .ci/run --nightly"]
fn a_million_random_steps_give_finite_results_or_a_clear_error() {
    random_steps(1_000_000, 8);
}

/// The FMU computes how omega changes within a step from omega_dot; omega must not leave its range.
#[test]
fn a_step_in_which_an_input_would_leave_its_range_is_refused_and_changes_nothing() {
    let mut tank = Instance::<::SloshTank::Model, Fmi2>::new(Interface::CoSimulation);
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

/// Sets an enumeration and its integer twin, and returns the output `shown`, or the reason why the FMU refused the settings.
fn with_kind<M: runtime::Model>(
    settings: &[(&str, i32)],
    shown: &str,
) -> Result<Value, runtime::call::Fault> {
    let mut instance = Instance::<M, Fmi2>::new(Interface::CoSimulation);
    // The tank is at rest.
    for name in ["init.omega[1]", "init.omega[3]", "a[1]", "a[3]"] {
        if let Some(reference) = M::table().find(name) {
            instance.set(&SET_REAL, &[reference], |_| Value::Real(0.0))?;
        }
    }
    for (name, number) in settings {
        let reference = M::table().find(name).unwrap();
        instance.set(&SET_INTEGER, &[reference], |_| Value::Integer(*number))?;
    }
    instance.setup_experiment(None, 0.0, None)?;
    instance.enter_initialization_mode()?;
    instance.exit_initialization_mode()?;
    instance.get(&GET_REAL, M::table().find(shown).unwrap())
}

/// For example `mount_kind` = 2 has the effect of `mount` = pivot; two different values are refused.
#[test]
fn an_integer_kind_parameter_replaces_its_enumeration_for_hosts_that_cannot_set_enumerations() {
    type Craft = ::Spacecraft::Model;
    type Tank = ::SloshTank::Model;
    // On a pivot an accelerometer measures minus the specific force of gravity.
    let a = |settings: &[(&str, i32)]| with_kind::<Craft>(settings, "specific_force[3]");
    assert_eq!(a(&[("mount_kind", 2)]).unwrap(), Value::Real(9.81));
    assert_eq!(a(&[("mount", 2), ("mount_kind", 2)]).unwrap(), Value::Real(9.81));
    assert_eq!(a(&[("mount_kind", 1)]).unwrap(), Value::Real(0.0));
    let why = a(&[("mount", 2), ("mount_kind", 1)]).unwrap_err().text;
    assert!(why.contains("mount_kind = 1 contradicts mount = 2"), "{why}");
    // The slosh mass is at rest straight below its hinge. The added mass therefore contains the slosh mass only along z, but with
    // `lumped` also along x.
    let m = |settings: &[(&str, i32)]| with_kind::<Tank>(settings, "added_mass[1]");
    assert_eq!(m(&[("coupling_kind", 1)]).unwrap(), Value::Real(253.493));
    for kind in [2, 3] {
        assert_eq!(m(&[("coupling_kind", kind)]).unwrap(), Value::Real(253.493 + 128.211));
    }
    let why = m(&[("coupling", 2), ("coupling_kind", 3)]).unwrap_err().text;
    assert!(why.contains("coupling_kind = 3 contradicts coupling = 2"), "{why}");
}

/// In Model Exchange the angular momentum of the wheels changes and no torque is applied. There must be one warning, however
/// many steps follow.
#[test]
fn a_warning_names_wheels_that_move_without_a_torque_once_in_model_exchange() {
    let fmu = load("Spacecraft");
    let mut with = fmu.instantiation("one");
    with.kind = MODEL_EXCHANGE;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    instance.setup_experiment(None, 0.0, None).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance.new_discrete_states().unwrap();
    instance.enter_continuous_time_mode().unwrap();
    let mut warnings = Vec::new();
    for k in 1..=10 {
        instance.set_time(k as f64 * STEP).unwrap();
        instance.set("h_wheels[1]", &format!("{}", 0.1 * k as f64)).unwrap();
        instance.completed_integrator_step().unwrap();
        warnings.extend(instance.take_messages());
    }
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert_eq!((warning.status, warning.category.as_str()), (Status::Warning, "logStatusWarning"));
    assert!(warning.text.contains("add -d(h_wheels)/dt to torque"), "{}", warning.text);
}

#[test]
fn detached_liquid_moves_in_the_packed_fmu_as_in_the_crate() {
    let mut p = Parameters::default();
    p.tank[0].ball.travel = 0.6;
    (p.tank[0].ball.drag, p.tank[0].ball.contact_speed) = (0.2, 0.05);
    p.tank[0].position[0] = 0.1;
    let thrust = |force: f64| Inputs { force: Ramp::held([0.0, 0.0, force]), ..Inputs::default() };
    let pieces = [(thrust(-100.0), 120), (thrust(0.0), 20), (thrust(700.0), 200)];
    let mut packed = Spacecraft::new(&p, &pieces[0].0, 0.0, 1e-8).unwrap();
    let mut own = craft::Spacecraft::new(&p, &pieces[0].0, 0.0, 1e-8).unwrap();
    let mut seen = Vec::new();
    for (u, steps) in &pieces {
        for _ in 0..*steps {
            packed.step(u, 0.1).unwrap();
            own.step(u, 0.1).unwrap();
            seen.push(own.outputs(u).tank[0].ball_state);
        }
        assert_eq!(packed.continuous_states(), own.continuous_states());
    }
    for state in [craft::BallState::Flying, craft::BallState::Sliding] {
        assert!(seen.contains(&state), "{state:?}");
    }
    assert_eq!(seen.last(), Some(&craft::BallState::Settled));
}

/// SloshTank with detached liquid is attached to a craft that another program simulates. The impulses on this craft must be
/// those of the Rust crate.
#[test]
fn detached_liquid_gives_its_host_the_impulses_of_the_crate() {
    let mut p = TankParameters { host: Some(Parameters::default().craft), ..Default::default() };
    p.tank.ball.travel = 0.6;
    (p.tank.ball.drag, p.tank.ball.contact_speed) = (0.2, 0.05);
    p.tank.position[0] = 0.1;
    let given = |x: f64, z: f64| TankInputs {
        a: Ramp::held([x, 0.0, z]),
        omega: [0.01, 0.0, 0.0],
        ..TankInputs::default()
    };
    let pieces = [(given(0.0, -0.1), 120), (given(0.01, 0.0), 20), (given(0.0, 0.7), 200)];
    let mut packed = SloshTank::new(&p, &pieces[0].0, 0.0, 1e-8).unwrap();
    let mut own = craft::SloshTank::new(&p, &pieces[0].0, 0.0, 1e-8).unwrap();
    let (mut seen, mut impulses) = (Vec::new(), 0);
    for (u, steps) in &pieces {
        for _ in 0..*steps {
            let before = own.outputs(u).impulse;
            packed.step(u, 0.1).unwrap();
            own.step(u, 0.1).unwrap();
            let (want, got) = (own.outputs(u), packed.outputs(u));
            assert_eq!((got.impulse, got.bias), (want.impulse, want.bias));
            assert_eq!(got.added_mass, want.added_mass);
            seen.push(want.tank.ball_state);
            impulses += usize::from(before != want.impulse);
        }
        assert_eq!(packed.continuous_states(), own.continuous_states());
    }
    for state in [craft::BallState::Flying, craft::BallState::Sliding] {
        assert!(seen.contains(&state), "{state:?}");
    }
    assert_eq!(seen.last(), Some(&craft::BallState::Settled));
    assert!(impulses >= 4, "{impulses}");
}

/// `canInterpolateInputs` refers to all Real inputs, so that hosts set the derivatives of all. The derivative of omega has no
/// effect, because omega changes by omega_dot within the step.
#[test]
fn an_input_derivative_set_for_omega_is_accepted_and_ignored() {
    let table = &::SloshTank::table::TABLE;
    let find = |name: &str| table.find(name).unwrap();
    let run = |slope: Option<f64>| {
        let mut tank = Instance::<::SloshTank::Model, Fmi2>::new(Interface::CoSimulation);
        tank.setup_experiment(None, 0.0, None).unwrap();
        tank.enter_initialization_mode().unwrap();
        tank.exit_initialization_mode().unwrap();
        let rate = find("omega_dot[2]");
        tank.set(&SET_REAL, &[rate], |_| Value::Real(0.3)).unwrap();
        let mut seen = Vec::new();
        for k in 0..20 {
            tank.set_input_derivatives(&[rate], &[1], &[0.1]).unwrap();
            if let Some(slope) = slope {
                tank.set_input_derivatives(&[find("omega[2]")], &[1], &[slope]).unwrap();
            }
            tank.do_step(f64::from(k) * 0.1, 0.1).unwrap();
            let shown = ["omega[2]", "force[1]", "torque[2]", "tank.angle_x[1]"].map(find);
            seen.push(shown.map(|r| tank.get(&GET_REAL, r).unwrap()));
            let mut slopes = [0.0; 2];
            let outputs = ["force[1]", "torque[2]"].map(find);
            tank.output_derivatives(&outputs, &[1; 2], &mut slopes).unwrap();
            seen.push([slopes[0], slopes[1], 0.0, 0.0].map(Value::Real));
        }
        seen
    };
    let consistent = run(None);
    for slope in [0.0, -7.0, 1e6] {
        assert_eq!(run(Some(slope)), consistent, "{slope}");
    }
}

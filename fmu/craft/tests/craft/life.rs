//! Tests of steps, saved states and error messages, on which importers rely.

use craft::{
    Coupling, Inertia, Inputs, Line, Mount, Parameters, Ramp, STATES, SloshTank, Spacecraft, State,
    StepError, TANK_STATES, TankInputs, TankParameters, TankState, index,
};

use super::draining::after;
use super::random::{Random, draining_tank};
use super::records::{STEP, at_end, inputs, record, spacecraft};

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs() / (1.0 + a.abs().max(b.abs()))).fold(0.0, f64::max)
}

#[test]
fn results_do_not_depend_on_the_communication_step() {
    for seed in 0..30 {
        let mut random = Random::new(seed);
        let (mut p, u) = (random.parameters(), random.inputs());
        if (20..26).contains(&seed) {
            random.make_all_planar(&mut p);
        }
        if seed >= 25 {
            random.spin_all(&mut p);
        }
        let mut whole = Spacecraft::new(&p, &u, 5.0, 1e-12).unwrap();
        let mut cut = whole.clone();
        whole.step(&u, 2.0).unwrap();
        let mut t = 0.0;
        while t < 2.0 {
            let h = f64::min(random.magnitude(1e-4, 0.5), 2.0 - t);
            cut.step(&after(&u, t), h).unwrap();
            t += h;
        }
        // Both errors are within the tolerance per step, amplified by the motion of the liquid.
        let off = largest_difference(&whole.continuous_states(), &cut.continuous_states());
        assert!(off < 1e-10, "{seed}: {off:e}");
        assert_eq!(whole.time(), 7.0);
    }
}

/// The results of four records are compared with runs at a tolerance of 1e-13. In the first record the liquid swings by 60
/// degrees, and the second record has all kinds of inputs.
#[test]
fn errors_stay_within_the_solver_tolerance() {
    for name in ["conical", "four_tanks", "wheels", "rotary"] {
        let record = record(name);
        let run = |tolerance: f64| {
            let mut craft = spacecraft(&record, tolerance);
            for k in 0..1000 {
                craft.step(&inputs(&record, k), STEP).unwrap();
            }
            let x = craft.continuous_states();
            [&x[..index::POSITION], &x[index::BOBS..]].concat()
        };
        let exact = run(1e-13);
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
            let off = largest_difference(&run(tolerance), &exact);
            println!("{name} {tolerance:e}: {off:.1e}");
            assert!(off < tolerance, "{name} at {tolerance:e}: {off:e}");
        }
    }
}

/// The allowed error of a step is relative to the size of the motion, which starts at 0 in a craft
/// at rest. The craft is accelerated by 1 rad/s2, so that a bob with high centring stiffness, too
/// light to affect the craft, begins to swing at 10 rad/s.
#[test]
fn errors_stay_within_the_solver_tolerance_from_rest() {
    let mut p = Parameters::default();
    (p.tank[0].mass[0], p.tank[0].k[0]) = (1e-3, 0.1);
    let torque = Ramp::held([900.0, 300.0, 600.0]);
    let u = Inputs { torque, ..Inputs::default() };
    let run = |tolerance: f64| {
        let mut craft = Spacecraft::new(&p, &u, 0.0, tolerance).unwrap();
        craft.step(&u, 1.0).unwrap();
        let x = craft.continuous_states();
        [&x[..index::POSITION], &x[index::BOBS..]].concat()
    };
    let exact = run(1e-13);
    for tolerance in [1e-3, 1e-5, 1e-8] {
        let off = largest_difference(&run(tolerance), &exact);
        assert!(off < tolerance, "{tolerance:e}: {off:e}");
    }
}

/// A draining tank, alone and on a craft, is simulated in one step of 5 s and compared with a run at a tolerance of 1e-13.
/// The difference may be a hundred times the tolerance, which is the allowed error of one internal step.
#[test]
fn errors_stay_within_the_solver_tolerance_while_tanks_drain() {
    for seed in 0..4 {
        let mut random = Random::new(seed);
        let tank = draining_tank(&mut random, 2);
        let mass_flow = Line { value: 5.0, slope: 0.5 };
        let alone = TankParameters { tank, ..TankParameters::default() };
        let u = TankInputs {
            a: Ramp { value: [0.3, -0.2, 2.0], slope: [0.1, 0.2, 0.0] },
            omega: [0.1, -0.2, 0.3],
            omega_dot: Ramp { value: [0.05, 0.1, 0.0], slope: [0.0, -0.02, 0.01] },
            mass_flow,
        };
        let of_tank = |tolerance: f64| {
            let mut tank = SloshTank::new(&alone, &u, 0.0, tolerance).unwrap();
            tank.step(&u, 5.0).unwrap();
            assert_eq!(&tank.continuous_states(), tank.borrow_states());
            tank.continuous_states().to_vec()
        };
        let mut p = Parameters { tanks: 1, ..random.parameters() };
        p.tank[0] = tank;
        let thrust = [20.0, -10.0, 2.0 * p.craft.mass];
        let mut on = Inputs { force: Ramp::held(thrust), ..Inputs::default() };
        on.torque = Ramp { value: [5.0, 3.0, -1.0], slope: [1.0, -2.0, 0.5] };
        on.mass_flow[0] = mass_flow;
        let of_craft = |tolerance: f64| {
            let mut craft = Spacecraft::new(&p, &on, 0.0, tolerance).unwrap();
            craft.step(&on, 5.0).unwrap();
            let x = craft.continuous_states();
            assert_eq!(&x, craft.borrow_states());
            [&x[..index::POSITION], &x[index::BOBS..]].concat()
        };
        let runs: [&dyn Fn(f64) -> Vec<f64>; 2] = [&of_tank, &of_craft];
        for (what, run) in ["tank", "craft"].into_iter().zip(runs) {
            let exact = run(1e-13);
            for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
                let off = largest_difference(&run(tolerance), &exact);
                assert!(off < 100.0 * tolerance, "{what} {seed} at {tolerance:e}: {off:e}");
            }
        }
    }
}

#[test]
fn a_saved_state_continues_bit_for_bit() {
    for seed in 0..10 {
        let mut random = Random::new(seed);
        let (mut p, u) = (random.parameters(), random.inputs());
        if seed >= 5 {
            random.flex(&mut p);
        }
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
        craft.step(&u, 0.3).unwrap();
        let state = State::from_words(&craft.state().to_words()).unwrap();
        assert_eq!(state, *craft.state());
        let mut resumed = Spacecraft::resume(&p, &state, 1e-9);
        let u = random.inputs();
        craft.step(&u, 0.7).unwrap();
        resumed.step(&u, 0.7).unwrap();
        assert_eq!(resumed.state().to_words(), craft.state().to_words());
        assert_eq!(resumed.outputs(&u), craft.outputs(&u));
        resumed.set_state(&state);
        assert_eq!(*resumed.state(), state);

        let p = TankParameters { tank: p.tank[0], ..TankParameters::default() };
        let u = TankInputs { a: Ramp::held([0.1, 0.2, 2.0]), ..TankInputs::default() };
        let mut tank = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
        tank.step(&u, 0.3).unwrap();
        let state = TankState::from_words(&tank.state().to_words()).unwrap();
        let mut resumed = SloshTank::resume(&p, &state, 1e-9);
        tank.step(&u, 0.7).unwrap();
        resumed.step(&u, 0.7).unwrap();
        assert_eq!(resumed.state().to_words(), tank.state().to_words());
    }
}

#[test]
fn saved_data_that_is_no_state_is_refused() {
    let craft = Spacecraft::new(&Parameters::default(), &Inputs::default(), 0.0, 1e-9).unwrap();
    let good = craft.state().to_words();
    for at in 0..State::WORDS {
        let mut words = good;
        words[at] = f64::NAN.to_bits();
        assert_eq!(State::from_words(&words), None);
        words[at] = f64::INFINITY.to_bits();
        assert_eq!(State::from_words(&words), None);
    }
    assert_eq!(State::from_words(&[0; State::WORDS]), None);
    let p = TankParameters::default();
    let tank = SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap();
    for at in 0..TankState::WORDS {
        for wrong in [f64::NAN, f64::INFINITY] {
            let mut words = tank.state().to_words();
            words[at] = wrong.to_bits();
            assert_eq!(TankState::from_words(&words), None, "{at}");
        }
    }
    assert_eq!(TankState::from_words(&[0; TankState::WORDS]), None);
}

/// The wheels' momentum jumps at the first step and again after a second, or rises by the same amount within a step. The
/// angular momentum H is constant to rounding, and the energy changes by the work of the impulse.
#[test]
fn jumps_of_the_wheels_keep_angular_momentum_and_balance_energy() {
    for seed in 0..28 {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        if seed >= 20 {
            random.make_all_planar(&mut p);
        }
        if seed % 3 == 2 {
            random.flex(&mut p);
        }
        let pivot = seed.is_multiple_of(5);
        if pivot {
            // Without gravity H is constant.
            (p.mount, p.init.velocity, p.gravity) = (Mount::Pivot, [0.0; 3], [0.0; 3]);
        }
        let wheels = |h: [f64; 3]| Inputs { h_wheels: Ramp::held(h), ..Inputs::default() };
        let first = wheels(random.vector(10.0));
        let mut craft = Spacecraft::new(&p, &first, 0.0, 1e-12).unwrap();
        let start = craft.outputs(&first);
        let mut held = first;
        for _ in 0..4 {
            held = wheels(random.vector(30.0));
            // The outputs before the step already contain the effect of the jump.
            let shown = craft.outputs(&held);
            let mut event = craft.clone();
            assert!(event.take_event(&held).unwrap());
            assert_eq!(event.outputs(&held), shown);
            assert!(!event.take_event(&held).unwrap());
            for out in [shown, {
                craft.step(&held, 0.5).unwrap();
                craft.outputs(&held)
            }] {
                let size = 100.0;
                for i in 0..3 {
                    let off = out.angular_momentum[i] - start.angular_momentum[i];
                    assert!(off.abs() < 1e-11 * size, "{seed}: H {off:e}");
                }
                let off = out.energy - start.energy - out.work + out.dissipated;
                assert!(off.abs() < 1e-10 * size, "{seed}: E {off:e}");
            }
        }
        // A jump of the wheels' momentum has the effect of a ramp in the limit of zero duration.
        let jumped = wheels(random.vector(30.0));
        let ramp = |h: f64| {
            let (from, to) = (held.h_wheels.value, jumped.h_wheels.value);
            let slope = [0, 1, 2].map(|i| (to[i] - from[i]) / h);
            Inputs { h_wheels: Ramp { value: from, slope }, ..Inputs::default() }
        };
        let x = {
            let mut craft = craft.clone();
            craft.take_event(&jumped).unwrap();
            craft.continuous_states()
        };
        let off = [1e-3, 1e-4].map(|h| {
            let mut craft = craft.clone();
            craft.step(&ramp(h), h).unwrap();
            largest_difference(&craft.continuous_states(), &x)
        });
        assert!(off[1] < 1e-2, "{off:?}");
        assert!((off[0] / off[1] / 10.0 - 1.0).abs() < 0.2, "{off:?}");
    }
}

#[test]
fn a_continuous_change_of_the_wheels_momentum_gives_no_impulse() {
    let p = Parameters::default();
    let mut craft = Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap();
    let before = craft.continuous_states();
    let u = Inputs { h_wheels: Ramp::held([1.0, 2.0, 3.0]), ..Inputs::default() };
    craft.follow_inputs(&u);
    assert!(!craft.take_event(&u).unwrap());
    assert_eq!(craft.continuous_states(), before);
}

#[test]
fn a_refused_step_leaves_the_craft_as_it_was_and_says_why() {
    let mut random = Random::new(1);
    let mut p = random.parameters();
    p.tanks = 2;
    let u = random.inputs();
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
    craft.step(&u, 0.1).unwrap();
    let before = *craft.state();
    let mut refused = |u: &Inputs, h: f64, kind: fn(&StepError) -> bool, text: &str| {
        let error = craft.step(u, h).unwrap_err();
        assert!(kind(&error), "{error:?}");
        assert!(error.to_string().contains(text), "{error}");
        assert_eq!(*craft.state(), before);
    };
    let is_length: fn(&StepError) -> bool = |e| matches!(e, StepError::Length { .. });
    for h in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        refused(&u, h, is_length, "allowed: a finite length above 0");
    }
    // The error occurs within the step, at 0.1 s.
    let not_finite: fn(&StepError) -> bool =
        |e| matches!(e, StepError::NotFinite { time } if (0.1..=0.2).contains(time));
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let mut wrong = u;
        wrong.force.value[1] = bad;
        refused(&wrong, 0.1, not_finite, "no longer finite");
        let mut wrong = u;
        wrong.torque.slope[0] = bad;
        refused(&wrong, 0.1, not_finite, "no longer finite");
        let mut wrong = u;
        wrong.h_wheels.value[2] = bad;
        refused(&wrong, 0.1, not_finite, "no longer finite");
    }
    let wheels = Inputs { h_wheels: Ramp::held([f64::NAN; 3]), ..u };
    assert!(craft.take_event(&wheels).is_err());
    assert_eq!(*craft.state(), before);
    let few = Parameters { max_steps: 3, ..p };
    let mut bounded = Spacecraft::new(&few, &Inputs::default(), 0.0, 1e-9).unwrap();
    let before = *bounded.state();
    let error = bounded.step(&u, 10.0).unwrap_err();
    assert_eq!(*bounded.state(), before);
    assert!(matches!(error, StepError::TooManySteps { max_steps: 3, .. }), "{error:?}");
    for text in ["solver.max_steps = 3", "shorter communication steps"] {
        assert!(error.to_string().contains(text), "{error}");
    }
    let none = Parameters { max_steps: 0, ..p };
    let problems = Spacecraft::new(&none, &Inputs::default(), 0.0, 1e-9).unwrap_err();
    assert_eq!(problems, ["solver.max_steps = 0 (allowed: 1 and above)"]);

    let p = TankParameters { tank: p.tank[0], max_steps: 100, ..TankParameters::default() };
    let u = TankInputs { a: Ramp::held([0.1, 0.2, 2.0]), ..TankInputs::default() };
    let mut tank = SloshTank::new(&p, &u, 3.0, 1e-9).unwrap();
    let too_many: fn(&StepError) -> bool = |e| matches!(e, StepError::TooManySteps { .. });
    let before = *tank.state();
    let not_finite: fn(&StepError) -> bool =
        |e| matches!(e, StepError::NotFinite { time } if (3.0..=3.1).contains(time));
    for (a, h, kind) in [
        (f64::NAN, 0.1, not_finite),
        (1e200, 0.1, not_finite),
        (1.0, 0.0, is_length),
        (1.0, 1e9, too_many),
    ] {
        let u = TankInputs { a: Ramp::held([a; 3]), ..u };
        let error = tank.step(&u, h).unwrap_err();
        assert!(kind(&error), "{error:?}");
        assert_eq!(*tank.state(), before);
    }
}

/// Each problem is reported in a sentence with parameter, value and allowed range, and all problems are returned together.
#[test]
fn every_problem_with_the_parameters_is_returned() {
    let mut p = Parameters::default();
    p.craft.mass = 0.0;
    p.craft.j.xy = 1e4;
    p.craft.r[1] = f64::NAN;
    p.tanks = 2;
    p.tank[1].modes = 4;
    p.tank[1].length[0] = -0.1;
    p.tank[1].mass[2] = f64::INFINITY;
    p.tank[0].q = [0.0; 4];
    p.tank[0].g_ref = 0.0;
    p.tank[0].p_0[0] = [0.0; 3];
    p.tank[3].m_0 = -1.0; // is not used
    p.init.q[2] = f64::NAN;
    p.init.velocity[0] = 1.0;
    p.mount = Mount::Pivot;
    let problems = Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap_err();
    let expected = [
        "craft.mass = 0.0 (allowed: 1e-9 to 1000000000000.0 kg)",
        "craft.r[2] = NaN (allowed: -1000000000.0 to 1000000000.0 m)",
        "craft.Jxy^2 = 100000000.0 (allowed: up to craft.Jxx craft.Jyy = 782600.0)",
        "tank[1].q = [0.0, 0.0, 0.0, 0.0] has no direction (allowed: length above 1e-6)",
        "tank[1].g_ref = 0.0 (allowed: 1e-9 to 1000000.0 m/s2)",
        "tank[1].p_0[1] = [0.0, 0.0, 0.0] has no direction (allowed: length above 1e-6)",
        "tank[2].modes = 4 (allowed: 0 to 3)",
        "tank[2].length[1] = -0.1 (allowed: 1e-6 to 1000000000.0 m)",
        "tank[2].mass[3] = inf (allowed: 1e-9 to 1000000000000.0 kg)",
        "init.q[3] = NaN (allowed: -1000000000.0 to 1000000000.0)",
        "init.velocity = [1.0, 0.0, 0.0] m/s cannot be combined with mount = pivot, because the pivot holds the origin O of the body frame: \
         set init.velocity = 0",
    ];
    assert_eq!(problems, expected);

    // The craft has no inertia about its axis, except from the rigid liquid of a tank.
    let mut p = Parameters::default();
    p.craft.r = [0.0; 3];
    (p.craft.j.xx, p.craft.j.yy, p.craft.j.zz) = (5.0, 5.0, 0.0);
    let problems = p.problems();
    assert_eq!(problems.len(), 1);
    assert!(problems[0].contains("is singular"), "{problems:?}");
    p.tank[0].i_z = 1.0;
    assert!(p.problems().is_empty());
    // This inertia is so small that a division by it overflows.
    p.tank[0].i_z = 1e-200;
    assert!(p.problems()[0].contains("is singular"));
    p.craft.j.zz = -1.0;
    assert!(p.problems()[0].starts_with("craft.Jzz = -1.0 (allowed: 0.0 to"));

    for tolerance in [0.0, 1.0, f64::NAN] {
        let p = Parameters::default();
        let problems = Spacecraft::new(&p, &Inputs::default(), 0.0, tolerance).unwrap_err();
        assert_eq!(problems, [format!("tolerance = {tolerance:?} (allowed: 1e-14 to 0.1)")]);
    }

    let mut p = TankParameters::default();
    p.tank.k[0] = -1.0;
    p.host = Some(craft::Craft { mass: -1.0, ..craft::Craft::default() });
    let problems = SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap_err();
    assert_eq!(problems.len(), 2);
    assert!(problems[0].starts_with("tank.k[1] = -1.0 (allowed: 0.0 to"));
    assert!(problems[1].starts_with("host.mass = -1.0"));
}

/// No principal moment of inertia of a body exceeds the sum of the other two, whether the axes are principal axes or not.
/// For a flat plate it equals the sum, so that moments of a plate that are rounded to four digits must be accepted.
#[test]
fn principal_moments_that_no_body_has_are_refused() {
    let with = |[xx, yy, zz, xy, xz, yz]: [f64; 6]| {
        let mut p = Parameters::default();
        p.craft.j = Inertia { xx, yy, zz, xy, xz, yz };
        p.problems()
    };
    let message = |[small, middle, large, sum]: [&str; 4]| {
        format!(
            "craft.Jxx, craft.Jyy, craft.Jzz, with craft.Jxy, craft.Jxz, craft.Jyz, have the principal moments {small}, \
             {middle} and {large} kg.m2: the largest exceeds {sum}, the sum of the others (allowed: up to that sum)"
        )
    };
    let wanted = message(["100.0", "200.0", "400.0", "300.0"]);
    assert_eq!(with([100.0, 400.0, 200.0, 0.0, 0.0, 0.0]), std::slice::from_ref(&wanted));
    // The same inertia in axes that are rotated by 30 degrees about x is refused with the same message.
    let (c, s) = (f64::sqrt(0.75), 0.5);
    let (yy, zz) = (c * c * 400.0 + s * s * 200.0, s * s * 400.0 + c * c * 200.0);
    assert_eq!(with([100.0, yy, zz, 0.0, 0.0, c * s * 200.0]), [wanted]);
    // This matrix is positive definite, and no diagonal element exceeds the sum of the other two.
    let wanted = message(["10.0", "10.0", "280.0", "20.0"]);
    assert_eq!(with([100.0, 100.0, 100.0, 90.0, 90.0, 90.0]), [wanted]);
    let fits: [[f64; 6]; 3] = [
        [1.3333, 1.3333, 2.6667, 0.0, 0.0, 0.0],
        [100.0, 100.0, 100.0, 0.0, 0.0, 0.0],
        [100.0, 300.0, 399.9, 0.0, 0.0, 0.0],
    ];
    for j in fits {
        assert_eq!(with(j), [""; 0], "{j:?}");
    }
    let mut tank =
        TankParameters { host: Some(Parameters::default().craft), ..TankParameters::default() };
    tank.host.as_mut().unwrap().j.zz = 5000.0;
    let problem = tank.problems().remove(0);
    assert!(
        problem.contains("host.Jyz, have the principal moments 860.0, 910.0 and 5000.0 kg.m2: ")
    );
}

#[test]
fn random_steps_give_finite_results_or_an_error() {
    let mut refused = 0;
    let mut random = Random::new(7);
    for _ in 0..200 {
        let mut p = random.parameters();
        p.init.omega = [(); 3].map(|()| random.magnitude(1e-6, 1e2));
        let tolerance = random.magnitude(1e-14, 1e-1);
        let mut craft = Spacecraft::new(&p, &Inputs::default(), 0.0, tolerance).unwrap();
        for _ in 0..30 {
            // In one of twenty steps the inputs are too large to be physical.
            let nonsense = random.below(20) == 0;
            let size = if nonsense { 1e160 } else { random.magnitude(1e-6, 1e5) };
            let ramp = |random: &mut Random| Ramp {
                value: random.vector(size),
                slope: random.vector(size),
            };
            let (force, torque) = (ramp(&mut random), ramp(&mut random));
            let u = Inputs { force, torque, h_wheels: ramp(&mut random), ..Inputs::default() };
            let before = *craft.state();
            let h = random.magnitude(1e-9, 0.1);
            match craft.step(&u, h) {
                Ok(()) => {
                    assert!(craft.continuous_states().iter().all(|x| x.is_finite()));
                    assert!(craft.outputs(&u).energy.is_finite());
                }
                Err(_) => {
                    refused += 1;
                    assert_eq!(*craft.state(), before);
                }
            }
        }
    }
    assert!((100..600).contains(&refused), "{refused}");
}

/// However long the simulation is, directions and quaternion have the length 1 to rounding, and the rates of directions stay
/// perpendicular to the directions.
#[test]
fn directions_and_quaternion_keep_unit_length_to_rounding() {
    let record = record("four_tanks");
    let mut craft = spacecraft(&record, 1e-6);
    for k in 0..1000 {
        craft.step(&inputs(&record, k), STEP).unwrap();
        let x = craft.continuous_states();
        let size: f64 = x[..4].iter().map(|x| x * x).sum();
        assert!((size - 1.0).abs() < 1e-15 * 4.0);
        for bob in x[index::BOBS..index::LIQUID].chunks_exact(6) {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            assert!((dot(&bob[..3], &bob[..3]) - 1.0).abs() < 1e-15 * 4.0);
            assert!(dot(&bob[..3], &bob[3..]).abs() < 1e-14);
        }
    }
}

#[test]
fn slosh_masses_of_planar_modes_stay_in_their_planes_within_rounding() {
    let mut random = Random::new(1);
    let (mut p, u) = (random.parameters(), random.inputs());
    random.make_all_planar(&mut p);
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-6).unwrap();
    for k in 0..500 {
        craft.step(&after(&u, k as f64 * STEP), STEP).unwrap();
        let x = craft.continuous_states();
        for (i, tank) in p.tank[..p.tanks].iter().enumerate() {
            for n in 0..tank.modes {
                let [c, s] = tank.direction[n];
                let size = f64::hypot(c, s).max(1e-300);
                let off = |at: usize| (c * x[at + 1] - s * x[at]) / size;
                let at = index::bob(i, n);
                let rate = 1.0 + x[at + 3..at + 6].iter().fold(0.0, |a: f64, x| a.max(x.abs()));
                assert!(off(at).abs() < 1e-15 && off(at + 3).abs() < 1e-15 * rate, "{i} {n}");
            }
        }
    }
}

#[test]
fn slosh_masses_of_unused_modes_and_tanks_stay_at_rest() {
    let mut p = Parameters::default();
    p.tank[0].p_dot_0[1] = [1.0, 0.0, 0.0];
    let u = Inputs { force: Ramp::held([10.0, 0.0, 2000.0]), ..Inputs::default() };
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
    craft.step(&u, 1.0).unwrap();
    let (x, rate) = (craft.continuous_states(), craft.derivatives(&u));
    for at in (index::bob(0, 1)..index::LIQUID).step_by(6) {
        assert_eq!(x[at..at + 6], [0.0, 0.0, -1.0, 0.0, 0.0, 0.0]);
        assert_eq!(rate[at..at + 6], [0.0; 6]);
    }
    let out = craft.outputs(&u);
    assert_eq!(out.tank[1].force, [0.0; 3]);
    assert_eq!(out.tank[1].p[2], [0.0, 0.0, -1.0]);
    assert_eq!(out.mass, 1180.0 + 253.493 + 128.211);
}

#[test]
fn nothing_is_allocated_while_stepping() {
    let record = record("four_tanks");
    let mut craft = spacecraft(&record, 1e-9);
    let inputs: Vec<Inputs> = (0..100).map(|k| inputs(&record, k)).collect();
    let p = TankParameters { coupling: Coupling::Lumped, ..TankParameters::default() };
    let u = TankInputs { a: Ramp::held([0.1, 0.2, 2.0]), ..TankInputs::default() };
    let mut tank = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
    let mut planar = p;
    planar.tank.direction[0] = [0.6, 0.8];
    let mut planar = SloshTank::new(&planar, &u, 0.0, 1e-9).unwrap();
    let counted = allocation_counter::measure(|| {
        for u in &inputs {
            craft.step(u, STEP).unwrap();
            craft.outputs(&at_end(u));
            craft.derivatives(u);
            craft.directional_derivative(u, &[1.0; STATES], &[1.0; craft::INPUTS]);
            craft.output_derivatives(u, &[1.0; STATES], &[1.0; craft::INPUTS]);
        }
        for tank in [&mut tank, &mut planar] {
            tank.step(&u, 1.0).unwrap();
            tank.outputs(&u);
            tank.apply_host_impulse([0.1, 0.0, 0.0], [0.0, 0.1, 0.0]);
            tank.directional_derivative(&u, &[1.0; TANK_STATES], &[1.0; craft::TANK_INPUTS]);
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn an_impossible_outflow_is_refused() {
    let (mut p, mut u) = (Parameters::default(), Inputs::default());
    let flow = |value: f64| [value, 0.0, 0.0, 0.0].map(|value| Line { value, slope: 0.0 });
    // A flow out of a tank without a fill table has no effect.
    u.mass_flow = flow(0.1);
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
    let mass = craft.outputs(&u).mass;
    craft.step(&u, 1.0).unwrap();
    assert_eq!(craft.outputs(&u).mass, mass);

    let tank = &mut p.tank[0];
    (tank.modes, tank.fill.points, tank.liquid_0) = (0, 2, 15.0);
    (tank.fill.liquid[0], tank.fill.liquid[1]) = (10.0, 20.0);
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
    for value in [5.1, -5.1] {
        u.mass_flow = flow(value);
        let error = craft.step(&u, 1.0).unwrap_err();
        let message = error.to_string();
        assert!(matches!(error, StepError::Model(_)), "{message}");
        assert!(message.contains("(allowed: 10 to 20 kg"), "{message}");
    }
    // Within the step the flow of 6 - 3 t kg/s reverses. After 2 s of the step of 4 s 6 kg have drained, and at the end all
    // of it has returned.
    for (value, missing) in [(6.0, 6.0), (-6.0, -6.0)] {
        u.mass_flow = flow(value);
        u.mass_flow[0].slope = -value / 2.0;
        let message = craft.step(&u, 4.0).unwrap_err().to_string();
        let wanted =
            format!("mass_flow[1] would change the liquid in tank[1] to {} kg", 15.0 - missing);
        assert!(message.contains(&wanted), "{message}");
    }
    // For a single tank the message has no index.
    let alone = craft::TankParameters { tank: p.tank[0], ..craft::TankParameters::default() };
    let of_tank = craft::TankInputs { mass_flow: flow(6.0)[0], ..craft::TankInputs::default() };
    let mut tank = super::component::SloshTank::new(&alone, &of_tank, 0.0, 1e-9).unwrap();
    let message = tank.step(&of_tank, 1.0).unwrap_err().to_string();
    assert!(
        message.contains("mass_flow would change the liquid in tank to 9 kg (allowed"),
        "{message}"
    );
    u.mass_flow = flow(4.5);
    u.mass_flow[0].slope = -2.25;
    craft.step(&u, 4.0).unwrap();
    assert_eq!(craft.continuous_states()[index::LIQUID], 15.0);
    u.mass_flow = flow(5.0);
    craft.step(&u, 1.0).unwrap();

    // All liquid drains in several steps. The drained masses of the steps add up to the whole only up to rounding.
    (p.tank[0].fill.liquid[0], p.tank[0].fill.liquid[1]) = (1000.0, 2000.0);
    p.tank[0].liquid_0 = 1500.0;
    let mut rounded = false;
    for pieces in [3, 7, 11, 13, 49, 300] {
        u.mass_flow = flow(500.0 / f64::from(pieces));
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
        for _ in 0..pieces {
            craft.step(&u, 1.0).unwrap();
        }
        let left = craft.continuous_states()[index::LIQUID];
        assert!((left - 1000.0).abs() < 1e-10, "{left}");
        rounded |= left < 1000.0;
    }
    assert!(rounded);

    p.tank[0].fill.liquid[1] = 9.0;
    p.tank[0].liquid_0 = 30.0;
    let problems = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap_err();
    assert!(problems[0].starts_with("tank[1].fill.liquid[2] = 9.0"), "{problems:?}");
    assert!(problems[1].starts_with("tank[1].liquid_0 = 30.0"), "{problems:?}");
}

fn swinging_tank() -> (SloshTank, TankInputs) {
    let inputs = TankInputs { a: Ramp::held([1.0, 0.0, 9.0]), ..TankInputs::default() };
    let mut parameters = TankParameters::default();
    parameters.tank.zeta = [0.05; 3];
    (SloshTank::new(&parameters, &inputs, 0.0, 1e-10).unwrap(), inputs)
}

#[test]
fn a_tank_continues_bit_identically_from_a_saved_state() {
    let (mut tank, inputs) = swinging_tank();
    tank.step(&inputs, 0.7).unwrap();
    let saved = *tank.state();
    let run = |tank: &mut SloshTank| {
        tank.step(&inputs, 0.5).unwrap();
        (tank.time(), tank.outputs(&inputs))
    };
    let first = run(&mut tank);
    tank.set_state(&saved);
    assert_eq!(tank.time(), 0.7);
    assert_eq!(run(&mut tank), first);
}

#[test]
fn the_dissipated_energy_of_a_long_step_is_the_sum_over_short_steps() {
    let (mut long, inputs) = swinging_tank();
    let mut short = long.clone();
    long.step(&inputs, 2.0).unwrap();
    let mut before = 0.0;
    for _ in 0..100 {
        short.step(&inputs, 0.02).unwrap();
        let now = short.outputs(&inputs).dissipated;
        assert!(now > before, "{now} {before}");
        before = now;
    }
    // The allowed difference is a hundred steps times the tolerance of a step.
    let dissipated = long.outputs(&inputs).dissipated;
    assert!((dissipated / before - 1.0).abs() < 1e-8, "{dissipated} {before}");
}

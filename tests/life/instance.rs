//! The life cycle of one instance: each call is allowed only in certain states, a refused call changes nothing, and a
//! saved state is complete.

use crate::common::items;
use HubSlosh::table::TABLE;
use HubSlosh::{Instance, Scalar, from_bytes};
use plant::{STATES, SloshModel};
use runtime::call::{CType, Fault, InstanceState, Interface, Severity};
use runtime::hash::Hash;
use runtime::instance::DEFAULT_TOLERANCE;
use runtime::snapshot::{size, to_bytes};
use runtime::v2::{GET_BOOLEAN, GET_INTEGER, GET_REAL, SET_BOOLEAN, SET_INTEGER, SET_REAL};
use runtime::variable::{Access, Causality, Kind, Value};

fn new_instance() -> Instance {
    HubSlosh::instance(Interface::CoSimulation)
}

fn reference(name: &str) -> u32 {
    TABLE.find(name).unwrap_or_else(|| panic!("no variable {name}"))
}

fn try_set(instance: &mut Instance, name: &str, value: Value) -> Result<(), Fault> {
    let call = match value {
        Value::Real(_) => &SET_REAL,
        Value::Integer(_) => &SET_INTEGER,
        Value::Boolean(_) => &SET_BOOLEAN,
    };
    instance.set(call, &[reference(name)], |_| value)
}

fn set(instance: &mut Instance, values: &[(&str, Value)]) {
    for (name, value) in values {
        try_set(instance, name, *value).unwrap();
    }
}

fn get_by_reference(instance: &mut Instance, reference: u32) -> Result<Value, Fault> {
    let call = match TABLE.scalars[reference as usize].variable.c_type() {
        CType::Real => &GET_REAL,
        CType::Integer => &GET_INTEGER,
        _ => &GET_BOOLEAN,
    };
    instance.get(call, reference)
}

fn real(instance: &mut Instance, name: &str) -> f64 {
    match get_by_reference(instance, reference(name)) {
        Ok(Value::Real(x)) => x,
        other => panic!("{name}: {other:?}"),
    }
}

fn output_derivative(instance: &mut Instance, reference: u32, order: i32) -> Result<f64, Fault> {
    let mut answer = [0.0];
    instance.output_derivatives(&[reference], &[order], &mut answer)?;
    Ok(answer[0])
}

fn all(instance: &mut Instance) -> Vec<u64> {
    let each =
        (0..TABLE.scalars.len() as u32).map(|n| match get_by_reference(instance, n).unwrap() {
            Value::Real(x) => x.to_bits(),
            Value::Integer(n) => n as u64,
            Value::Boolean(b) => u64::from(b),
        });
    each.collect()
}

fn stepping_from(start: f64, stop: Option<f64>, values: &[(&str, Value)]) -> Instance {
    let mut instance = new_instance();
    set(&mut instance, values);
    instance.setup_experiment(None, start, stop).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance
}

fn stepping(values: &[(&str, Value)]) -> Instance {
    stepping_from(0.0, None, values)
}

const fn number(n: i32) -> Value {
    Value::Integer(n)
}

fn moving_instance(slosh_model: i32, friction_model: i32) -> Instance {
    stepping(&[
        ("slosh.model", number(slosh_model)),
        ("friction.model", number(friction_model)),
        ("slosh.modes", number(2)),
        ("init.omega", Value::Real(0.3)),
        ("init.slosh_angle", Value::Real(0.2)),
        ("init.slosh_angle_radial", Value::Real(0.1)),
        ("wheel.enabled", Value::Boolean(true)),
        ("imu.enabled", Value::Boolean(true)),
        ("tau_cmd", Value::Real(0.05)),
    ])
}

#[test]
fn calls_are_refused_in_the_wrong_state_and_change_nothing() {
    let mut instance = new_instance();
    let before = to_bytes(&instance);
    assert!(instance.exit_initialization_mode().is_err());
    assert!(instance.do_step(0.0, 0.1).is_err());
    assert!(instance.terminate().is_err());
    assert!(instance.get(&GET_REAL, reference("omega")).is_err());
    assert_eq!(to_bytes(&instance), before);

    instance.enter_initialization_mode().unwrap();
    assert!(instance.setup_experiment(None, 0.0, None).is_err());
    assert!(instance.enter_initialization_mode().is_err());
    assert!(instance.do_step(0.0, 0.1).is_err());

    instance.exit_initialization_mode().unwrap();
    assert!(instance.enter_initialization_mode().is_err());
    let fault = try_set(&mut instance, "tank.h", Value::Real(0.05)).unwrap_err();
    assert!(fault.text.contains("fmi2SetReal: tank.h") && fault.text.contains("stepping"));

    instance.terminate().unwrap();
    assert!(instance.do_step(0.0, 0.1).is_err());
    assert!(try_set(&mut instance, "tau_cmd", Value::Real(0.1)).is_err());
    all(&mut instance);
}

#[test]
fn parameters_and_inputs_can_be_set_before_and_after_setup_and_in_initialization_mode() {
    let mut instance = new_instance();
    set(&mut instance, &[("tank.h", Value::Real(0.06)), ("tau_cmd", Value::Real(0.01))]);
    instance.setup_experiment(None, 0.0, None).unwrap();
    set(&mut instance, &[("tank.h", Value::Real(0.07)), ("tau_cmd", Value::Real(0.02))]);
    instance.enter_initialization_mode().unwrap();
    let at_7_cm = real(&mut instance, "slosh.frequency[1]");
    set(&mut instance, &[("tank.h", Value::Real(0.08)), ("g_axial", Value::Real(9.81))]);
    assert!(real(&mut instance, "slosh.frequency[1]") > at_7_cm, "deeper liquid is faster");
    instance.exit_initialization_mode().unwrap();
    assert_eq!(real(&mut instance, "tank.h"), 0.08);
}

/// The natural frequency, an output, depends on the axial specific force, an input. If the host sets this input in
/// initialization mode, the frequency must follow before the first step.
#[test]
fn inputs_set_in_initialization_mode_act_from_the_start_time() {
    let mut instance = new_instance();
    instance.enter_initialization_mode().unwrap();
    let on_earth = real(&mut instance, "slosh.frequency[1]");
    set(&mut instance, &[("g_axial", Value::Real(9.81 / 4.0))]);
    instance.exit_initialization_mode().unwrap();
    let quarter = real(&mut instance, "slosh.frequency[1]");
    // sqrt(g/l) is computed with two rounding errors.
    assert!((quarter / on_earth - 0.5).abs() < 1e-15);
}

#[test]
fn all_wrong_parameters_are_reported_at_once_and_can_be_corrected() {
    let mut instance = new_instance();
    set(
        &mut instance,
        &[
            ("tank.h", Value::Real(-1.0)),
            ("tank.d", Value::Real(f64::NAN)),
            ("init.theta", Value::Real(f64::INFINITY)),
            ("slosh.modes", number(11)),
            ("slosh.model", number(0)),
            ("friction.model", number(i32::MIN)),
        ],
    );
    instance.enter_initialization_mode().unwrap();
    let fault = instance.exit_initialization_mode().unwrap_err();
    assert_eq!(fault.severity, Severity::Error);
    for part in [
        "tank.h = -1.0 m (allowed: 0.0001 m to 100.0 m)",
        "tank.d = NaN m",
        "init.theta = inf rad (allowed: any finite number)",
        "slosh.modes = 11 (allowed: 1 to 10)",
        "slosh.model = 0 (allowed: 1 frozen, 2 linear",
        "friction.model = -2147483648",
    ] {
        assert!(fault.text.contains(part), "{part} is not in: {}", fault.text);
    }
    assert_eq!(instance.state(), InstanceState::Initialization);
    set(
        &mut instance,
        &[
            ("tank.h", Value::Real(0.1)),
            ("tank.d", Value::Real(0.163)),
            ("init.theta", Value::Real(0.0)),
            ("slosh.modes", number(1)),
            ("slosh.model", number(2)),
            ("friction.model", number(4)),
        ],
    );
    instance.exit_initialization_mode().unwrap();
}

#[test]
fn parameters_that_contradict_each_other_are_reported() {
    let mut instance = new_instance();
    set(&mut instance, &[("wheel.speed_min", Value::Real(1e4))]);
    instance.enter_initialization_mode().unwrap();
    let fault = instance.exit_initialization_mode().unwrap_err();
    assert!(fault.text.contains("wheel.speed_min"), "{}", fault.text);
}

#[test]
fn wrong_inputs_are_refused_by_the_call_that_sets_them() {
    let mut instance = stepping(&[]);
    let before = to_bytes(&instance);
    for (name, value) in [("tau_cmd", f64::NAN), ("tau_ext", f64::NEG_INFINITY), ("g_axial", -1e-9)]
    {
        let fault = try_set(&mut instance, name, Value::Real(value)).unwrap_err();
        assert!(fault.text.contains(name), "{}", fault.text);
    }
    // If one of several values is wrong, none of them is set.
    let references = [reference("tau_cmd"), reference("tau_ext")];
    assert!(instance.set(&SET_REAL, &references, |n| Value::Real([1.0, f64::NAN][n])).is_err());
    assert!(instance.set_input_derivatives(&references, &[1, 1], &[1.0, f64::NAN]).is_err());
    assert!(instance.set_input_derivatives(&references, &[1, 2], &[1.0, 1.0]).is_err());
    assert!(instance.set_input_derivatives(&[reference("omega")], &[1], &[1.0]).is_err());
    assert_eq!(to_bytes(&instance), before);
}

#[test]
fn unknown_and_mistyped_references_are_refused_with_name_and_type() {
    let mut instance = stepping(&[]);
    let fault = instance.get(&GET_REAL, 4711).unwrap_err();
    assert!(fault.text.contains("4711"), "{}", fault.text);
    let fault = instance.get(&GET_INTEGER, reference("omega")).unwrap_err();
    assert!(fault.text.contains("omega") && fault.text.contains("Real"), "{}", fault.text);
    let fault = instance.get(&GET_REAL, reference("stuck")).unwrap_err();
    assert!(fault.text.contains("stuck") && fault.text.contains("Boolean"), "{}", fault.text);
    assert!(try_set(&mut instance, "omega", Value::Real(1.0)).is_err());
    assert!(try_set(&mut instance, "slosh.mass[3]", Value::Real(1.0)).is_err());
}

#[test]
fn an_experiment_with_wrong_times_is_refused() {
    let mut instance = new_instance();
    let before = to_bytes(&instance);
    assert!(instance.setup_experiment(None, f64::NAN, None).is_err());
    assert!(instance.setup_experiment(None, 1.0, Some(0.0)).is_err());
    assert!(instance.setup_experiment(None, 0.0, Some(f64::INFINITY)).is_err());
    for tolerance in [0.0, -1e-6, 1e-15, 0.5, f64::NAN] {
        assert!(instance.setup_experiment(Some(tolerance), 0.0, None).is_err());
    }
    assert_eq!(to_bytes(&instance), before);
    instance.setup_experiment(Some(DEFAULT_TOLERANCE), -5.0, Some(-5.0)).unwrap();
}

#[test]
fn a_step_with_an_invalid_size_or_start_is_refused_and_changes_nothing() {
    let mut instance = stepping_from(0.0, Some(1.0), &[("init.omega", Value::Real(0.1))]);
    instance.do_step(0.0, 0.25).unwrap();
    let before = to_bytes(&instance);
    for h in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(instance.do_step(0.25, h).is_err(), "{h}");
    }
    for at in [0.0, 0.5, f64::NAN] {
        assert!(instance.do_step(at, 0.1).is_err(), "{at}");
    }
    let fault = instance.do_step(0.25, 0.76).unwrap_err();
    assert!(fault.text.contains("stop time"), "{}", fault.text);
    assert_eq!(to_bytes(&instance), before);
    instance.do_step(0.25, 0.75).unwrap();
}

/// Hosts compute the time as n h, or add up h. Both times, and the stop time, differ from the exact value by some units in
/// the last place.
#[test]
fn communication_points_may_differ_from_the_exact_time_by_rounding_errors() {
    let h = 0.1;
    for start in [0.0, 1e6] {
        let mut added = start;
        let steps = 2000;
        let mut instance = stepping_from(start, Some(start + f64::from(steps) * h), &[]);
        for n in 0..steps {
            let at = if n % 2 == 0 { start + f64::from(n) * h } else { added };
            instance.do_step(at, h).unwrap();
            assert_eq!(instance.time(), at + h, "lands exactly where the host says");
            added += h;
        }
    }
}

/// The results of one long step and of many short steps must agree within the tolerance 1e-8.
#[test]
fn input_with_a_slope_does_not_depend_on_the_choice_of_communication_step() {
    let run = |cuts: u32| {
        let mut instance =
            stepping(&[("friction.model", number(2)), ("tau_cmd", Value::Real(-0.05))]);
        let h = 1.0 / f64::from(cuts);
        for n in 0..cuts {
            let command = [reference("tau_cmd")];
            instance.set_input_derivatives(&command, &[1], &[0.1]).unwrap();
            instance.do_step(f64::from(n) * h, h).unwrap();
        }
        // The input has the value at the end of the ramp, and keeps it.
        assert!((real(&mut instance, "tau_cmd") - 0.05).abs() < 1e-15);
        instance.do_step(1.0, 1.0).unwrap();
        assert!((real(&mut instance, "tau_cmd") - 0.05).abs() < 1e-15);
        real(&mut instance, "theta")
    };
    let (whole, cut) = (run(1), run(64));
    assert!((whole - cut).abs() < 1e-7 * whole.abs(), "{whole} {cut}");
}

/// The specific force falls because of its input derivative. A step in which it would become negative is refused and changes
/// nothing.
#[test]
fn the_axial_specific_force_may_fall_to_zero_but_not_below() {
    let down = |slope: f64| {
        let mut instance = stepping(&[("init.slosh_angle", Value::Real(0.1))]);
        let references = [reference("g_axial")];
        for n in 0..3 {
            instance.set_input_derivatives(&references, &[1], &[slope]).unwrap();
            let before = to_bytes(&instance);
            if let Err(fault) = instance.do_step(f64::from(n) * 0.1, 0.1) {
                assert_eq!(to_bytes(&instance), before);
                return Err(fault);
            }
        }
        Ok(real(&mut instance, "g_axial"))
    };
    // Three steps of 0.1 s at 9.81 / 0.3 per second reach 0 up to rounding.
    let end = down(-9.81 / 0.3).unwrap();
    assert!((0.0..1e-14).contains(&end), "{end}");
    let fault = down(-33.0).unwrap_err();
    assert!(fault.text.contains("g_axial"), "{}", fault.text);
}

#[test]
fn a_reset_instance_equals_a_new_instance() {
    let expected = to_bytes(&new_instance());
    let mut instance = moving_instance(4, 4);
    instance.do_step(0.0, 0.5).unwrap();
    instance.reset().unwrap();
    assert_eq!(to_bytes(&instance), expected);

    let mut failed = diverged();
    failed.reset().unwrap();
    assert_eq!(to_bytes(&failed), expected);
}

fn diverged() -> Instance {
    let mut instance = stepping(&[("slosh.model", number(1)), ("tau_cmd", Value::Real(1e12))]);
    instance.do_step(0.0, 1e200).unwrap_err();
    instance
}

#[test]
fn after_a_step_that_failed_values_can_be_read_and_a_saved_state_restored() {
    let good = stepping(&[]);
    let mut instance = diverged();
    assert_eq!(instance.state(), InstanceState::Failed);
    assert_eq!(real(&mut instance, "theta"), 0.0);
    assert!(instance.do_step(0.0, 1.0).is_err());
    instance.restore(&good).unwrap();
    instance.do_step(0.0, 1.0).unwrap();
}

#[test]
fn after_a_panic_every_call_of_the_instance_returns_fatal() {
    let mut instance = stepping(&[]);
    instance.poison();
    assert_eq!(instance.do_step(0.0, 1.0).unwrap_err().severity, Severity::Fatal);
    assert_eq!(instance.reset().unwrap_err().severity, Severity::Fatal);
    assert_eq!(instance.get(&GET_REAL, 0).unwrap_err().severity, Severity::Fatal);
    assert_eq!(instance.restore(&new_instance()).unwrap_err().severity, Severity::Fatal);
}

#[test]
fn a_restored_state_continues_bit_identically() {
    for slosh_model in items("slosh.model") {
        for friction_model in items("friction.model") {
            let mut original = moving_instance(slosh_model, friction_model);
            original.do_step(0.0, 0.777).unwrap();
            original.set_input_derivatives(&[reference("tau_cmd")], &[1], &[-0.3]).unwrap();
            let saved = original.clone();
            let bytes = to_bytes(&saved);
            let here = all(&mut original);
            original.do_step(0.777, 0.4).unwrap();
            original.do_step(1.177, 0.1).unwrap();
            let there = all(&mut original);
            assert_ne!(here, there);

            original.restore(&saved).unwrap();
            let mut other = new_instance();
            other.restore(&from_bytes(&bytes).unwrap()).unwrap();
            for instance in [&mut original, &mut other] {
                assert_eq!(all(instance), here, "slosh {slosh_model}, friction {friction_model}");
                instance.do_step(0.777, 0.4).unwrap();
                instance.do_step(1.177, 0.1).unwrap();
                assert_eq!(all(instance), there, "slosh {slosh_model}, friction {friction_model}");
            }
        }
    }
}

fn random_step(rng: &mut fastrand::Rng, instance: &mut Instance) {
    let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
    let inputs = ["tau_cmd", "tau_ext", "g_axial"].map(reference);
    let values = [between(-0.1, 0.1), between(-0.05, 0.05), between(5.0, 15.0)];
    let slopes = [between(-0.5, 0.5), between(-0.5, 0.5), between(-5.0, 5.0)];
    let friction = between(0.0, 0.01);
    let h = 10f64.powf(between(-4.0, -0.5));
    instance.set(&SET_REAL, &inputs, |n| Value::Real(values[n])).unwrap();
    if rng.bool() {
        instance.set_input_derivatives(&inputs, &[1; 3], &slopes).unwrap();
    }
    if rng.u8(..8) == 0 {
        set(instance, &[("friction.c", Value::Real(friction))]);
    }
    if rng.bool() {
        all(instance);
    }
    instance.do_step(instance.time(), h).unwrap();
}

#[test]
fn restoring_a_saved_state_is_exact_in_a_thousand_random_sequences() {
    let mut rng = fastrand::Rng::with_seed(11);
    let laws = || items("friction.model");
    let models = items("slosh.model").flat_map(|slosh| laws().map(move |law| (slosh, law)));
    for (slosh, law) in models.cycle().take(1000) {
        let mut instance = stepping(&[
            ("slosh.model", number(slosh)),
            ("friction.model", number(law)),
            ("slosh.modes", number(rng.i32(1..=4))),
            ("friction.eps", Value::Real(1e-3)),
            // Without bristle damping LuGre friction is passive with every tunable Coulomb torque.
            ("friction.sigma1", Value::Real(0.0)),
            ("init.omega", Value::Real(0.1 * rng.f64())),
            ("init.slosh_angle", Value::Real(0.2 * rng.f64())),
            ("wheel.enabled", Value::Boolean(rng.bool())),
            ("wheel.tau_max", Value::Real(0.05)),
            ("imu.enabled", Value::Boolean(rng.bool())),
        ]);
        for _ in 0..rng.usize(..5) {
            random_step(&mut rng, &mut instance);
        }
        let saved = to_bytes(&instance);
        let tape = rng.clone();
        let steps = rng.usize(1..5);
        let run = |instance: &mut Instance| {
            let mut rng = tape.clone();
            for _ in 0..steps {
                random_step(&mut rng, instance);
            }
            to_bytes(instance)
        };
        let first = run(&mut instance);
        let read = from_bytes(&saved).unwrap();
        instance.restore(&read).unwrap();
        assert!(to_bytes(&instance) == saved, "slosh model {slosh}, law {law}");
        assert!(run(&mut instance) == first, "slosh model {slosh}, law {law}");
        let mut other = new_instance();
        other.restore(&read).unwrap();
        assert!(run(&mut other) == first, "slosh model {slosh}, law {law}, another instance");
    }
}

#[test]
fn random_calls_never_panic() {
    let mut rng = fastrand::Rng::with_seed(13);
    let odd = [f64::NAN, f64::INFINITY, -f64::INFINITY, 0.0, -1.0, 1e308, -1e300, 5e-324, 1e9];
    for n in 0..400 {
        let interface = [Interface::CoSimulation, Interface::ModelExchange][n % 2];
        let mut instance = HubSlosh::instance(interface);
        let mut time = 0.0;
        let mut saved = instance.clone();
        for _ in 0..60 {
            let real = |rng: &mut fastrand::Rng| match rng.u8(..4) {
                0 => odd[rng.usize(..odd.len())],
                _ => rng.f64() * 2.0 - 1.0,
            };
            let x = real(&mut rng);
            let any = rng.u32(..TABLE.scalars.len() as u32 + 3);
            let _ = match rng.u8(..24) {
                0 => instance.setup_experiment(Some(x.abs() * 1e-6), 0.0, None),
                1 | 2 => instance.enter_initialization_mode(),
                3 | 4 => instance.exit_initialization_mode(),
                5 | 6 => {
                    time = instance.time();
                    instance.do_step(time, 0.01 * x.min(1.0))
                }
                7 => instance.set(&SET_REAL, &[any], |_| Value::Real(x)),
                8 => instance.set(&SET_INTEGER, &[any], |_| number(x as i32 + 2)),
                9 => instance.set(&SET_BOOLEAN, &[any], |_| Value::Boolean(x > 0.0)),
                10 => instance.get(&GET_REAL, any).map(drop),
                11 => instance.new_discrete_states().map(drop),
                12 | 13 => instance.enter_continuous_time_mode(),
                14 => instance.enter_event_mode(),
                15 => {
                    time += x.abs();
                    instance.set_time(time)
                }
                16 => {
                    let mut states = [0.0; STATES];
                    states.fill_with(|| real(&mut rng));
                    instance.set_continuous_states(&states)
                }
                17 => instance.derivatives(&mut [0.0; STATES]),
                18 => instance.event_indicators(&mut [0.0; plant::INDICATORS]),
                19 => instance.completed_integrator_step().map(drop),
                20 => instance.directional_derivative(&[any], &[any / 2], &[x], &mut [0.0]),
                21 => output_derivative(&mut instance, any, 1).map(drop),
                22 => instance.set_input_derivatives(&[12 + any % 3], &[1], &[x]),
                _ if rng.bool() => {
                    saved = from_bytes(&to_bytes(&instance)).unwrap();
                    Ok(())
                }
                _ => instance.restore(&saved),
            };
        }
    }
}

/// Instances of HubSlosh that are new, initialising, stepping, failed or terminated are saved to bytes and restored. Instance
/// state and bytes must then be equal.
#[test]
fn a_state_can_be_saved_in_every_instance_state() {
    let mut initializing = new_instance();
    set(&mut initializing, &[("tank.h", Value::Real(-1.0))]);
    initializing.enter_initialization_mode().unwrap();
    let mut terminated = moving_instance(2, 4);
    terminated.do_step(0.0, 0.1).unwrap();
    terminated.terminate().unwrap();
    for saved in [new_instance(), initializing, terminated, diverged(), moving_instance(2, 4)] {
        let bytes = to_bytes(&saved);
        assert_eq!(bytes.len(), size::<HubSlosh::HubSlosh>());
        let read = from_bytes(&bytes).unwrap();
        assert_eq!(read.state(), saved.state());
        assert_eq!(to_bytes(&read), bytes);
    }
}

#[test]
fn bytes_that_are_not_a_saved_state_are_refused() {
    let mut instance = moving_instance(4, 4);
    instance.do_step(0.0, 0.1).unwrap();
    let bytes = to_bytes(&instance);
    for length in 0..bytes.len() {
        assert!(from_bytes(&bytes[..length]).is_err(), "cut off after {length}");
    }
    for place in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[place] ^= 0x10;
        assert!(from_bytes(&damaged).is_err(), "damaged at {place}");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(from_bytes(&longer).is_err());
    assert!(from_bytes(b"HubSlosh").is_err());
}

/// A gyro sample is due at the end of each step. It must not come one step late because the sum of the steps and the times of
/// the host differ, by 1e-11 s after 52 s. The tolerance: the rate changes by 1e-3 rad/s per step, and a sample may be taken
/// a millionth of a period early.
#[test]
fn gyro_samples_are_on_time_after_many_steps_whether_the_host_adds_or_multiplies() {
    let h = 0.01;
    for adds in [true, false] {
        let mut instance = stepping(&[
            ("slosh.model", number(1)),
            ("friction.model", number(1)),
            ("imu.enabled", Value::Boolean(true)),
            ("imu.rate", Value::Real(1.0 / h)),
            ("imu.arw", Value::Real(0.0)),
            ("imu.bias_instability", Value::Real(0.0)),
            ("imu.lsb", Value::Real(0.0)),
        ]);
        let mut time = 0.0;
        for n in 1..=20_000 {
            set(
                &mut instance,
                &[("tau_cmd", Value::Real(if n % 100 < 50 { 0.05 } else { -0.05 }))],
            );
            instance.do_step(time, h).unwrap();
            time = if adds { time + h } else { f64::from(n) * h };
            let late = real(&mut instance, "omega_imu") - real(&mut instance, "omega");
            assert!(late.abs() < 1e-8, "{late} rad/s at {time} s");
        }
    }
}

fn with_number(mut bytes: Vec<u8>, old: f64, new: f64) -> Vec<u8> {
    let place = bytes.windows(8).position(|bytes| bytes == old.to_le_bytes()).unwrap();
    bytes[place..place + 8].copy_from_slice(&new.to_le_bytes());
    let body = bytes.len() - 16;
    let checksum = Hash::new().bytes(&bytes[..body]).value().to_le_bytes();
    bytes[body..].copy_from_slice(&checksum);
    bytes
}

#[test]
fn an_input_out_of_range_in_saved_bytes_is_refused() {
    let mut instance = moving_instance(4, 4);
    let g: f64 = 9.123456;
    set(&mut instance, &[("g_axial", Value::Real(g))]);
    let why = from_bytes(&with_number(to_bytes(&instance), g, -g)).unwrap_err();
    assert!(why.contains("g_axial = -9.123456"), "{why}");
}

/// A ring baffle wider than the radius of the tank is within the range of its variable, but contradicts the tank.
#[test]
fn parameters_in_saved_bytes_that_do_not_go_together_are_refused() {
    let width = 0.0123456;
    let mut instance = new_instance();
    set(&mut instance, &[("baffle.width", Value::Real(width))]);
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    let bytes = to_bytes(&instance);
    assert!(from_bytes(&with_number(bytes.clone(), width, 0.012)).is_ok());
    assert!(from_bytes(&with_number(bytes, width, 1.9)).is_err());
}

/// The difference quotient over 1 µs has an error of (1 µs)^2 times the third derivative, which is at most 1e3/s^3 of the
/// signal's size here, plus the rounding error 1e-16/1e-6.
#[test]
fn output_derivatives_equal_differences_of_the_outputs() {
    for slosh_model in items("slosh.model") {
        let mut instance = moving_instance(slosh_model, 4);
        instance.do_step(0.0, 0.3).unwrap();
        set(&mut instance, &[("tau_cmd", Value::Real(0.02))]);
        let slope = 0.3;
        let set_slope = |instance: &mut Instance| {
            instance.set_input_derivatives(&[reference("tau_cmd")], &[1], &[slope]).unwrap();
        };
        set_slope(&mut instance);
        for scalar in TABLE.scalars.iter().filter(|s| s.variable.causality == Causality::Output) {
            let n = scalar.index;
            let derivative = output_derivative(&mut instance, n, 1).unwrap();
            assert!(output_derivative(&mut instance, n, 2).is_err());
            let h = 1e-6;
            let mut other = instance.clone();
            let mut after = Vec::new();
            for k in 0..2 {
                set_slope(&mut other);
                other.do_step(0.3 + f64::from(k) * h, h).unwrap();
                after.push(real(&mut other, scalar.variable.name));
            }
            let now = real(&mut instance, scalar.variable.name);
            // This is a one-sided difference of second order.
            let moved = (4.0 * (after[0] - now) - (after[1] - now)) / (2.0 * h);
            let size = derivative.abs().max(now.abs()).max(1e-3);
            // The gyro takes no sample during this time.
            assert!(
                (moved - derivative).abs() < 1e-5 * size,
                "{} {slosh_model}: {derivative} {moved}",
                scalar.variable.name
            );
        }
        assert!(output_derivative(&mut instance, reference("tank.h"), 1).is_err());
        let omega = real(&mut instance, "omega");
        assert_eq!(output_derivative(&mut instance, reference("theta"), 1).unwrap(), omega);
    }
}

#[test]
fn directional_derivatives_of_outputs_and_state_derivatives_match_finite_differences() {
    let mut rng = fastrand::Rng::with_seed(7);
    for slosh_model in items("slosh.model") {
        for friction_model in items("friction.model") {
            for _ in 0..10 {
                check_directional_derivatives(&mut rng, slosh_model, friction_model);
            }
        }
    }
}

fn check_directional_derivatives(rng: &mut fastrand::Rng, slosh_model: i32, friction_model: i32) {
    let mut instance = HubSlosh::instance(Interface::ModelExchange);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
    set(
        &mut instance,
        &[
            ("slosh.model", number(slosh_model)),
            ("slosh.modes", number(3)),
            ("friction.model", number(friction_model)),
            // With the default of 1e-5 the friction curve bends within a range that differences cannot resolve.
            ("friction.eps", Value::Real(0.05)),
            ("friction.forward_cos1", Value::Real(between(-0.2, 0.2))),
            ("friction.asymmetry", Value::Real(between(-0.2, 0.2))),
            ("init.omega", Value::Real(0.2)),
            ("tau_cmd", Value::Real(between(-0.1, 0.1))),
            ("tau_ext", Value::Real(between(-0.1, 0.1))),
            ("g_axial", Value::Real(between(1.0, 20.0))),
        ],
    );
    // The start time is not 0, so that outputs that are times differ from their derivatives.
    instance.setup_experiment(None, 1.0, None).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance.enter_continuous_time_mode().unwrap();
    // States are angles; in the model `liquid` they are lengths, and the pendulum of the third mode is 9 mm long.
    let unit = if slosh_model == 5 { 0.009 } else { 1.0 };
    let mut states = [0.0; STATES];
    for (n, x) in states.iter_mut().enumerate() {
        *x = match n {
            0 => between(-3.0, 3.0),
            1 => between(0.05, 0.3),
            2..6 => between(-1.0, 1.0),
            6..26 => between(-0.3, 0.3) * unit,
            _ => between(-2.0, 2.0) * unit,
        };
    }
    instance.set_continuous_states(&states).unwrap();

    let inputs: Vec<u32> = TABLE.inputs().iter().map(|s| s.index).collect();
    let states_by_reference: Vec<u32> = TABLE
        .derivatives()
        .iter()
        .map(|rate| reference(rate.name().trim_start_matches("der(").trim_end_matches(')')))
        .collect();
    let knowns = [inputs.clone(), states_by_reference].concat();
    let direction: Vec<f64> = (0..knowns.len())
        .map(|n| between(-1.0, 1.0) * if n >= inputs.len() + 6 { unit } else { 1.0 })
        .collect();
    let is_unknown = |s: &&Scalar| {
        matches!(s.variable.access, Access::Output(_) | Access::OfInputs(_) | Access::Derivative(_))
    };
    let unknowns: Vec<u32> = TABLE.scalars.iter().filter(is_unknown).map(|s| s.index).collect();
    let mut answers = vec![0.0; unknowns.len()];
    instance
        .directional_derivative(&unknowns, &knowns, &vec![0.0; knowns.len()], &mut answers)
        .unwrap();
    assert!(answers.iter().all(|d| *d == 0.0), "derivatives along the seed 0: {answers:?}");
    instance.directional_derivative(&unknowns, &knowns, &direction, &mut answers).unwrap();

    // Central differences with Richardson extrapolation: truncation error 1e-12, rounding error 1e-13.
    let h = 1e-3;
    let start: Vec<f64> = inputs
        .iter()
        .map(|n| match instance.get(&GET_REAL, *n).unwrap() {
            Value::Real(x) => x,
            other => panic!("{other:?}"),
        })
        .collect();
    let at = |s: f64| -> Vec<f64> {
        let mut moved = instance.clone();
        moved.set(&SET_REAL, &inputs, |n| Value::Real(start[n] + s * direction[n])).unwrap();
        let x: Vec<f64> =
            states.iter().zip(&direction[inputs.len()..]).map(|(x, d)| x + s * d).collect();
        moved.set_continuous_states(&x).unwrap();
        let value = |n: &u32| match moved.get(&GET_REAL, *n).unwrap() {
            Value::Real(x) => x,
            other => panic!("{other:?}"),
        };
        unknowns.iter().map(value).collect()
    };
    let [p2, p1, m1, m2] = [2.0, 1.0, -1.0, -2.0].map(|k| at(k * h));
    for (n, answer) in answers.iter().enumerate() {
        let name = TABLE.scalars[unknowns[n] as usize].name();
        // wave_height as a function of the slosh angles is a cone; differences across its tip have no meaning.
        if name == "wave_height" && [p2[n], p1[n], m1[n], m2[n]].iter().any(|x| *x < 5e-3) {
            continue;
        }
        let difference = (8.0 * (p1[n] - m1[n]) - (p2[n] - m2[n])) / (12.0 * h);
        let size = difference.abs().max(p1[n].abs()).max(1e-3);
        assert!(
            (answer - difference).abs() < 1e-6 * size,
            "slosh {slosh_model} friction {friction_model} {name}: {answer} {difference}"
        );
    }
}

/// Three derivatives are known in closed form: of the natural frequency with respect to g_axial, of the hub's angle with
/// respect to its start value, and of the hub's acceleration with respect to the torque. The last one is the inverse of the
/// inertia of hub and liquid if nothing else moves.
#[test]
fn directional_derivatives_in_initialization_mode_are_with_respect_to_inputs_and_parameters() {
    let mut instance = new_instance();
    set(
        &mut instance,
        &[
            ("slosh.model", number(1)),
            ("friction.model", number(1)),
            ("init.slosh_angle", Value::Real(0.1)),
        ],
    );
    instance.enter_initialization_mode().unwrap();
    let derivative = |instance: &mut Instance, unknown: &str, known: &str| {
        let mut answer = [0.0];
        let (unknown, known) = ([reference(unknown)], [reference(known)]);
        instance.directional_derivative(&unknown, &known, &[2.0], &mut answer).unwrap();
        answer[0] / 2.0
    };
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * b.abs();
    let inertia = real(&mut instance, "hub.I")
        + real(&mut instance, "tank.m_liq") * real(&mut instance, "tank.r").powi(2);
    assert!(close(derivative(&mut instance, "omega_dot", "tau_ext"), 1.0 / inertia));
    assert!(close(derivative(&mut instance, "der(omega)", "tau_cmd"), 1.0 / inertia));
    assert!(close(derivative(&mut instance, "theta", "init.theta"), 1.0));
    set(&mut instance, &[("slosh.model", number(2))]);
    let frequency = real(&mut instance, "slosh.frequency[1]");
    let by_g = derivative(&mut instance, "slosh.frequency[1]", "g_axial");
    assert!(close(by_g, frequency / 2.0 / 9.81), "{by_g}");
    let before = to_bytes(&instance);
    let (omega, mass) = ([reference("omega")], [reference("slosh.mass[1]")]);
    assert!(instance.directional_derivative(&omega, &omega, &[1.0], &mut [0.0]).is_err());
    assert!(instance.directional_derivative(&omega, &mass, &[1.0], &mut [0.0]).is_err());
    assert!(to_bytes(&instance) == before);
}

#[test]
fn directional_derivatives_of_variables_without_any_are_refused() {
    let mut instance = moving_instance(4, 4);
    let mut answer = [0.0];
    let [omega, stuck, height, mass] =
        ["omega", "stuck", "tank.h", "slosh.mass[1]"].map(|name| [reference(name)]);
    assert!(instance.directional_derivative(&omega, &height, &[1.0], &mut answer).is_err());
    assert!(instance.directional_derivative(&stuck, &omega, &[1.0], &mut answer).is_err());
    assert!(instance.directional_derivative(&mass, &omega, &[1.0], &mut answer).is_err());
    assert!(instance.directional_derivative(&omega, &omega, &[f64::NAN], &mut answer).is_err());
    instance.directional_derivative(&omega, &omega, &[2.0], &mut answer).unwrap();
    assert_eq!(answer, [2.0]);
    instance.directional_derivative(&omega, &[], &[], &mut answer).unwrap();
    assert_eq!(answer, [0.0]);
}

#[test]
fn only_friction_parameters_can_be_changed_between_steps() {
    let mut instance =
        stepping(&[("tau_cmd", Value::Real(0.01)), ("init.omega", Value::Real(0.1))]);
    instance.do_step(0.0, 0.5).unwrap();
    let before = to_bytes(&instance);
    for (name, value) in [
        ("friction.c", Value::Real(-1.0)),
        ("friction.c", Value::Real(f64::NAN)),
        ("friction.model", number(items("friction.model").count() as i32 + 1)),
        ("friction.forward_cos1", Value::Real(1.0)),
        ("tank.h", Value::Real(0.05)),
        ("slosh.model", number(3)),
    ] {
        assert!(try_set(&mut instance, name, value).is_err(), "{name}");
        assert_eq!(to_bytes(&instance), before, "{name}");
    }
    // The friction brakes the hub.
    set(&mut instance, &[("friction.c", Value::Real(10.0))]);
    instance.do_step(0.5, 0.5).unwrap();
    assert_eq!(real(&mut instance, "omega"), 0.0);
    // The changed parameter is part of a saved state, and is restored from it.
    let mut other = HubSlosh::instance(Interface::CoSimulation);
    other.restore(&from_bytes(&to_bytes(&instance)).unwrap()).unwrap();
    for instance in [&mut instance, &mut other] {
        instance.do_step(1.0, 0.5).unwrap();
        assert_eq!(real(instance, "omega"), 0.0);
        set(instance, &[("friction.model", number(1))]);
        instance.do_step(1.5, 0.5).unwrap();
        assert!(real(instance, "omega") > 0.0);
    }
    assert_eq!(to_bytes(&instance), to_bytes(&other));
}

#[test]
fn a_saved_state_of_the_other_fmi_interface_is_refused() {
    let mut exchange = HubSlosh::instance(Interface::ModelExchange);
    let mut instance = new_instance();
    assert!(instance.restore(&exchange).unwrap_err().text.contains("Model Exchange"));
    assert!(exchange.restore(&instance).is_err());
    assert!(exchange.setup_experiment(None, 0.0, None).is_ok());
    exchange.reset().unwrap();
    assert_eq!(exchange.interface(), Interface::ModelExchange);
}

/// If a change of an input immediately changes an output, the model description must list the input as a dependency of the
/// output, because importers find algebraic loops by these lists.
#[test]
fn no_output_depends_directly_on_an_input_that_it_does_not_list() {
    for slosh_model in items("slosh.model") {
        for friction_model in items("friction.model") {
            // The instances have a moving hub, and a hub that is stuck at the start.
            let mut moving = moving_instance(slosh_model, friction_model);
            moving.do_step(0.0, 0.5).unwrap();
            let stuck = stepping(&[
                ("slosh.model", number(slosh_model)),
                ("friction.model", number(friction_model)),
            ]);
            for instance in [moving, stuck] {
                for input in TABLE.inputs() {
                    let mut other = instance.clone();
                    let value = real(&mut other, &input.name()) + 0.1;
                    set(&mut other, &[(&input.name(), Value::Real(value))]);
                    let (before, after) = (all(&mut instance.clone()), all(&mut other));
                    for (n, scalar) in TABLE.scalars.iter().enumerate() {
                        let v = scalar.variable;
                        let computed = matches!(v.causality, Causality::Output | Causality::Local);
                        if computed
                            && !scalar.depends_on().any(|s| s.variable.name == input.variable.name)
                        {
                            assert_eq!(before[n], after[n], "{} follows {}", v.name, input.name());
                        }
                    }
                }
            }
        }
    }
}

#[test]
#[ignore = "six seconds: .ci/long-tests"]
fn no_initial_value_depends_on_a_parameter_that_it_does_not_list() {
    let base: &[(&str, Value)] = &[
        ("init.omega", Value::Real(0.3)),
        ("init.slosh_angle", Value::Real(0.2)),
        ("init.slosh_angle_radial", Value::Real(0.1)),
        ("init.slosh_rate", Value::Real(0.2)),
        ("init.slosh_rate_radial", Value::Real(0.1)),
        ("wheel.enabled", Value::Boolean(true)),
        ("imu.enabled", Value::Boolean(true)),
        ("tau_cmd", Value::Real(0.05)),
        ("bench.tilt", Value::Real(0.02)),
        ("hub.imbalance", Value::Real(0.1)),
        ("baffle.width", Value::Real(0.005)),
        ("baffle.depth", Value::Real(0.01)),
        ("slosh.table.m_liq", Value::Real(2.0)),
        ("slosh.table.mass[1]", Value::Real(0.7)),
        ("slosh.table.mass[2]", Value::Real(0.02)),
        ("slosh.table.length[1]", Value::Real(0.05)),
        ("slosh.table.length[2]", Value::Real(0.015)),
        ("slosh.table.zeta[1]", Value::Real(0.01)),
    ];
    let reference_of_model = |group: &str| reference(&format!("{group}.model"));
    let models = items("slosh.model").map(|model| (model, 1));
    let of_table = SloshModel::ALL.into_iter().map(|model| (model as i32, 2));
    for (slosh_model, source) in models.chain(of_table) {
        let mut instance = new_instance();
        set(&mut instance, base);
        set(&mut instance, &[("slosh.model", number(slosh_model))]);
        set(&mut instance, &[("slosh.source", number(source))]);
        instance.enter_initialization_mode().unwrap();
        let before = all(&mut instance);
        for parameter in TABLE.parameters() {
            let refused = match (slosh_model, source) {
                (_, 1) => false,
                (_, _) => {
                    // If a length is given, the frequency has no effect; if source_kind is 1, the table is not used.
                    ["slosh.table.frequency[1]", "slosh.source_kind"]
                        .contains(&parameter.name().as_str())
                        // The models linear and planar start along the direction of mode 1.
                        || [2, 3].contains(&slosh_model)
                            && parameter.name() == "slosh.table.direction[1]"
                        // The slosh models spherical and liquid move along both axes and refuse these parameters.
                        || [4, 5].contains(&slosh_model)
                            && ["slosh.table.one_axis", "slosh.table.direction"]
                                .iter()
                                .any(|along_one| parameter.name().starts_with(along_one))
                }
            };
            if refused {
                continue;
            }
            let mut other = instance.clone();
            let reference = reference(&parameter.name());
            let value =
                match (get_by_reference(&mut other, reference).unwrap(), parameter.variable.kind) {
                    (Value::Real(x), _) => Value::Real(x * 1.01 + 0.01),
                    (Value::Integer(n), Kind::Enumeration(of)) => {
                        number(n % of.items.len() as i32 + 1)
                    }
                    (Value::Integer(n), _) => number(n + 1),
                    (Value::Boolean(b), _) => Value::Boolean(!b),
                };
            set(&mut other, &[(&parameter.name(), value)]);
            // The enumeration gets its start value, so that it does not contradict its integer twin.
            if let Some(group) = parameter.variable.name.strip_suffix(".kind") {
                let model = TABLE.scalars[reference_of_model(group) as usize];
                set(&mut other, &[(&model.name(), model.start().unwrap())]);
            }
            let after = all(&mut other);
            for (n, scalar) in TABLE.scalars.iter().enumerate() {
                let v = scalar.variable;
                let computed =
                    matches!(v.causality, Causality::Output | Causality::CalculatedParameter)
                        || v.state.is_some()
                        || matches!(v.access, Access::Derivative(_));
                let listed =
                    scalar.initial_depends_on().any(|s| s.variable.name == parameter.variable.name);
                if computed && !listed {
                    assert_eq!(before[n], after[n], "{} starts from {}", v.name, parameter.name());
                }
            }
        }
    }
}

/// Each continuous state is changed separately. If a variable then changes, the model description must list the state as a
/// dependency, because a host's solver may set entries of the Jacobian that are not listed to 0.
#[test]
fn no_variable_depends_on_a_continuous_state_that_it_does_not_list() {
    for slosh_model in items("slosh.model") {
        for friction_model in items("friction.model") {
            for enabled in [true, false] {
                let mut instance = HubSlosh::instance(Interface::ModelExchange);
                set(
                    &mut instance,
                    &[
                        ("slosh.model", number(slosh_model)),
                        ("slosh.modes", number(3)),
                        ("friction.model", number(friction_model)),
                        ("friction.forward_sin1", Value::Real(0.2)),
                        ("friction.eps", Value::Real(0.1)),
                        ("wheel.enabled", Value::Boolean(enabled)),
                        ("imu.enabled", Value::Boolean(enabled)),
                        ("init.omega", Value::Real(0.3)),
                        ("init.slosh_angle", Value::Real(0.2)),
                        ("init.slosh_angle_radial", Value::Real(0.1)),
                        ("init.slosh_rate", Value::Real(0.2)),
                        ("init.slosh_rate_radial", Value::Real(0.1)),
                        ("tau_cmd", Value::Real(0.05)),
                    ],
                );
                instance.enter_initialization_mode().unwrap();
                instance.exit_initialization_mode().unwrap();
                instance.enter_continuous_time_mode().unwrap();
                let before = all(&mut instance);
                let mut states = [0.0; STATES];
                instance.continuous_states(&mut states).unwrap();
                for (n, place) in TABLE.places().enumerate() {
                    let state = TABLE.state_at(place).unwrap();
                    let mut moved = states;
                    moved[n] += 1e-3;
                    let mut other = instance.clone();
                    other.set_continuous_states(&moved).unwrap();
                    for (scalar, (before, after)) in
                        TABLE.scalars.iter().zip(before.iter().zip(all(&mut other)))
                    {
                        let listed = scalar.depends_on().any(|s| s.index == state.index);
                        if !listed {
                            let (name, state) = (scalar.name(), state.name());
                            assert_eq!(*before, after, "{name} follows {state}");
                        }
                    }
                }
            }
        }
    }
}

/// The integers `slosh.kind` and `friction.kind` repeat the enumerations `slosh.model` and `friction.model`, because
/// OpenModelica's import, ecos and libcosim do not set enumerations, and OMSimulator does not set enumerations with the name
/// `model`.
#[test]
fn integer_kind_parameters_have_the_effect_of_their_enumerations() {
    for (kind, model) in [("slosh.kind", "slosh.model"), ("friction.kind", "friction.model")] {
        for n in items(model) {
            let motion = |name: &str| {
                let start = [("init.slosh_angle", Value::Real(0.2)), (name, number(n))];
                let mut instance = stepping(&start);
                instance.do_step(0.0, 1.0).unwrap();
                ["omega", "energy", "heat"].map(|name| real(&mut instance, name).to_bits())
            };
            assert_eq!(motion(kind), motion(model), "{kind} = {n}");
        }
        let too_many = items(model).count() as i32 + 1;
        let mut instance = new_instance();
        set(&mut instance, &[(kind, number(too_many))]);
        instance.enter_initialization_mode().unwrap();
        let fault = instance.exit_initialization_mode().unwrap_err();
        assert!(
            fault.text.contains(kind) && fault.text.contains("allowed: 0 to"),
            "{}",
            fault.text
        );
    }
}

/// Each Boolean has an integer twin, for example `wheel.enabled_kind` for `wheel.enabled`, because OpenModelica up to 1.27
/// sets Booleans to random numbers. A twin of 1 or 2 replaces the Boolean by false or true; 0 has no effect.
#[test]
fn an_integer_kind_parameter_that_is_not_0_replaces_its_boolean() {
    for name in ["slosh.zeta_from_correlation", "slosh.capillarity", "wheel.enabled", "imu.enabled"]
    {
        let kind = format!("{name}_kind");
        let motion = |settings: &[(&str, Value)]| {
            let mut all =
                vec![("init.slosh_angle", Value::Real(0.2)), ("tau_cmd", Value::Real(0.4))];
            all.extend(settings);
            let mut instance = stepping(&all);
            instance.do_step(0.0, 1.0).unwrap();
            ["omega", "omega_imu", "heat"].map(|name| real(&mut instance, name).to_bits())
        };
        let [no, yes] = [false, true].map(|b| motion(&[(name, Value::Boolean(b))]));
        assert_ne!(no, yes, "{name} shows");
        for said in [false, true] {
            let with = |n| motion(&[(name, Value::Boolean(said)), (kind.as_str(), number(n))]);
            assert_eq!(with(0), if said { yes } else { no }, "{name} = {said}");
            assert_eq!((with(1), with(2)), (no, yes), "{kind} with {name} = {said}");
        }
    }
}

/// `slosh.kind` and `friction.kind` repeat `slosh.model` and `friction.model` as integers, for hosts that cannot set
/// enumerations. Two different values are refused at the end of initialisation.
#[test]
fn integer_kind_parameters_that_contradict_their_enumerations_are_all_reported() {
    let mut instance = new_instance();
    set(&mut instance, &[("slosh.model", number(3)), ("slosh.kind", number(4))]);
    set(&mut instance, &[("friction.model", number(1)), ("friction.kind", number(2))]);
    instance.enter_initialization_mode().unwrap();
    let fault = instance.exit_initialization_mode().unwrap_err();
    for text in ["slosh.kind = 4", "slosh.model = 3", "friction.kind = 2", "friction.model = 1"] {
        assert!(fault.text.contains(text), "{text} is not in: {}", fault.text);
    }
    // If both are set to the same number, they do not contradict each other. Neither does an enumeration at its start
    // value, which many hosts set.
    for (model, kind) in [(4, 4), (2, 4)] {
        stepping(&[("slosh.model", number(model)), ("slosh.kind", number(kind))]);
    }
}

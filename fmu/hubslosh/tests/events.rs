//! Tests of events in Co-Simulation of FMI 3.0 (FMI 3.0.2, section 4.2.1). The motion is the same whether the FMU reports
//! events to the host or not, and steps stop exactly at events. The reference is the FMI 2.0 interface.

use HubSlosh::HubSlosh as Model;
use runtime::call::{Events, InstanceState, Interface};
use runtime::instance::Instance;
use runtime::snapshot::{from_bytes, to_bytes};
use runtime::table::Scalar;
use runtime::v2::{self, Fmi2};
use runtime::v3::{self, Fmi3};
use runtime::variable::{Kind, Value};
use runtime::version::Version;

type Two = Instance<Model, Fmi2>;
type Three = Instance<Model, Fmi3>;

fn scalar(name: &str) -> &'static Scalar<Model> {
    let table = <Model as runtime::Model>::table();
    &table.scalars[table.find(name).unwrap_or_else(|| panic!("no variable {name}")) as usize]
}

fn reference<V: Version>(name: &str) -> u32 {
    V::reference(scalar(name))
}

fn get<V: Version>(instance: &mut Instance<Model, V>, name: &str) -> Value {
    let is_two = V::PREFIX == "fmi2";
    let call = match scalar(name).variable.kind {
        Kind::Real(_) if is_two => &v2::GET_REAL,
        Kind::Integer { .. } | Kind::Enumeration(_) if is_two => &v2::GET_INTEGER,
        Kind::Boolean if is_two => &v2::GET_BOOLEAN,
        Kind::Real(_) => &v3::GET_FLOAT64,
        Kind::Integer { .. } => &v3::GET_INT32,
        Kind::Enumeration(_) => &v3::GET_INT64,
        Kind::Boolean => &v3::GET_BOOLEAN,
    };
    instance.get(call, reference::<V>(name)).unwrap()
}

fn real<V: Version>(instance: &mut Instance<Model, V>, name: &str) -> f64 {
    match get(instance, name) {
        Value::Real(x) => x,
        other => panic!("{name} = {other:?}"),
    }
}

fn set<V: Version>(instance: &mut Instance<Model, V>, name: &str, value: Value) {
    let is_two = V::PREFIX == "fmi2";
    let call = match scalar(name).variable.kind {
        Kind::Real(_) if is_two => &v2::SET_REAL,
        Kind::Integer { .. } | Kind::Enumeration(_) if is_two => &v2::SET_INTEGER,
        Kind::Boolean if is_two => &v2::SET_BOOLEAN,
        Kind::Real(_) => &v3::SET_FLOAT64,
        Kind::Integer { .. } => &v3::SET_INT32,
        Kind::Enumeration(_) => &v3::SET_INT64,
        Kind::Boolean => &v3::SET_BOOLEAN,
    };
    instance.set(call, &[reference::<V>(name)], |_| value).unwrap();
}

/// Start values of a hub that reverses, sticks and breaks away many times, with a wheel near its limits and a gyro.
const LIVELY: &[(&str, Value)] = &[
    ("slosh.model", Value::Integer(4)),
    ("slosh.modes", Value::Integer(2)),
    ("init.omega", Value::Real(0.05)),
    ("init.slosh_angle", Value::Real(0.2)),
    ("init.slosh_angle_radial", Value::Real(0.1)),
    ("wheel.enabled", Value::Boolean(true)),
    ("wheel.speed_max", Value::Real(170.0)),
    ("imu.enabled", Value::Boolean(true)),
    ("imu.rate", Value::Real(7.0)),
];

fn initialised<V: Version>(events: Events, values: &[(&str, Value)]) -> Instance<Model, V> {
    let mut instance = Instance::with_events(Interface::CoSimulation, events);
    for (name, value) in values {
        set(&mut instance, name, *value);
    }
    instance.setup_experiment(None, 0.0, None).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance
}

fn handle(instance: &mut Three) {
    if instance.state() == InstanceState::Stepping {
        instance.enter_event_mode().unwrap();
    }
    let next = instance.new_discrete_states().unwrap().next_time;
    assert!(next.is_none_or(|next| next > instance.time()), "{next:?} {}", instance.time());
    instance.enter_step_mode(&v3::ENTER_STEP).unwrap();
}

fn torque(step: usize) -> f64 {
    0.06 * (0.7 * step as f64).sin()
}

const LOOKED_AT: [&str; 12] = [
    "theta",
    "omega",
    "omega_dot",
    "slosh_angle",
    "slosh_rate",
    "slosh_angle_radial",
    "omega_imu",
    "tau_friction",
    "F_tangential",
    "energy",
    "wheel_speed",
    "event_time",
];
const DISCRETE: [&str; 3] = ["stuck", "event_count", "regime"];

const STEPS: usize = 100;
const STEP: f64 = 0.1;

fn reals<V: Version>(instance: &mut Instance<Model, V>) -> Vec<u64> {
    LOOKED_AT.iter().map(|name| real(instance, name).to_bits()).collect()
}

fn discrete<V: Version>(instance: &mut Instance<Model, V>) -> Vec<Value> {
    DISCRETE.iter().map(|name| get(instance, name)).collect()
}

fn trajectory() -> Vec<(Vec<u64>, Vec<Value>)> {
    let mut two: Two = initialised(Events::InStep, LIVELY);
    let mut all = Vec::new();
    for n in 0..STEPS {
        set(&mut two, "tau_cmd", Value::Real(torque(n)));
        two.do_step(n as f64 * STEP, STEP).unwrap();
        all.push((reals(&mut two), discrete(&mut two)));
    }
    all
}

#[test]
fn fmi_3_without_event_mode_gives_bit_identical_results_to_fmi_2() {
    let expected = trajectory();
    for stops in [false, true] {
        let mut three: Three = initialised(Events::InStep, LIVELY);
        for (n, expected) in expected.iter().enumerate() {
            set(&mut three, "tau_cmd", Value::Real(torque(n)));
            let info = three.step_to_event(n as f64 * STEP, STEP, stops).unwrap();
            assert!(!info.event && !info.early, "the FMU reports no event without event mode");
            assert_eq!(three.time(), n as f64 * STEP + STEP);
            assert_eq!(&(reals(&mut three), discrete(&mut three)), expected, "step {n}");
        }
    }
}

#[test]
fn a_host_that_handles_events_gets_the_motion_of_fmi_2_bit_for_bit() {
    let expected = trajectory();
    let mut three: Three = initialised(Events::Reported, LIVELY);
    handle(&mut three);
    let mut early = 0;
    for (n, expected) in expected.iter().enumerate() {
        set(&mut three, "tau_cmd", Value::Real(torque(n)));
        let end = n as f64 * STEP + STEP;
        let (mut at, mut h) = (n as f64 * STEP, STEP);
        loop {
            let before = discrete(&mut three);
            let info = three.step_to_event(at, h, true).unwrap();
            assert_eq!(discrete(&mut three), before, "discrete values change in event mode alone");
            if info.event {
                handle(&mut three);
            }
            if !info.early {
                break;
            }
            early += 1;
            at = three.time();
            h = end - at;
            assert!(h > 0.0);
        }
        assert_eq!(&(reals(&mut three), discrete(&mut three)), expected, "step {n}");
    }
    // The events are 70 samples of the gyro, changes of the contact, and limits of the wheel.
    assert!(early > 80, "{early} early returns");
}

/// The events within a step are reported at its end, because the host does not allow an early return.
#[test]
fn without_early_return_the_motion_is_bit_identical_and_events_are_reported_after_the_step() {
    let expected = trajectory();
    let mut three: Three = initialised(Events::Reported, LIVELY);
    handle(&mut three);
    let mut told = 0;
    for (n, expected) in expected.iter().enumerate() {
        set(&mut three, "tau_cmd", Value::Real(torque(n)));
        let before = discrete(&mut three);
        let info = three.step_to_event(n as f64 * STEP, STEP, false).unwrap();
        assert!(!info.early);
        assert_eq!(reals(&mut three), expected.0, "step {n}");
        assert_eq!(discrete(&mut three), before, "latched until event mode");
        assert!(info.event || before == expected.1, "step {n}: a change without an event");
        if info.event {
            told += 1;
            handle(&mut three);
        }
        assert_eq!(discrete(&mut three), expected.1, "step {n}");
    }
    assert!(told > 60, "{told} events");
}

#[test]
fn a_host_that_does_not_enter_event_mode_after_events_gets_the_motion_of_fmi_2() {
    let expected = trajectory();
    let mut three: Three = initialised(Events::Reported, LIVELY);
    handle(&mut three);
    for (n, expected) in expected.iter().enumerate() {
        set(&mut three, "tau_cmd", Value::Real(torque(n)));
        let (mut at, mut h, end) = (n as f64 * STEP, STEP, n as f64 * STEP + STEP);
        while three.step_to_event(at, h, true).unwrap().early {
            at = three.time();
            h = end - at;
        }
        assert_eq!(reals(&mut three), expected.0, "step {n}");
    }
}

/// Without gyro and wheel the stick and slip of the hub are the only events, so that the times of early returns can be
/// compared with the event times that FMI 2.0 reports.
#[test]
fn fmi_3_steps_return_early_exactly_at_the_event_times_of_fmi_2() {
    let values = &LIVELY[..5];
    let mut two: Two = initialised(Events::InStep, values);
    let mut three: Three = initialised(Events::Reported, values);
    handle(&mut three);
    let mut stops = 0;
    for n in 0..2 * STEPS {
        let (mut at, mut h, end) = (n as f64 * STEP, STEP, n as f64 * STEP + STEP);
        set(&mut two, "tau_cmd", Value::Real(torque(n)));
        set(&mut three, "tau_cmd", Value::Real(torque(n)));
        two.do_step(at, STEP).unwrap();
        let mut last = None;
        while three.step_to_event(at, h, true).unwrap().early {
            at = three.time();
            h = end - at;
            last = Some(at);
            handle(&mut three);
            assert_eq!(real(&mut three, "event_time"), at, "event_time must be the present time");
        }
        if let Some(last) = last {
            stops += 1;
            assert_eq!(last.to_bits(), real(&mut two, "event_time").to_bits(), "step {n}");
        }
    }
    assert!(stops > 10, "{stops} steps with events");
}

#[test]
fn torque_set_in_event_mode_that_breaks_stiction_makes_the_hub_slip() {
    let values = [("slosh.model", Value::Integer(1))];
    let mut three: Three = initialised(Events::Reported, &values);
    handle(&mut three);
    assert_eq!(get(&mut three, "stuck"), Value::Boolean(true));
    three.step_to_event(0.0, 0.5, true).unwrap();
    three.enter_event_mode().unwrap();
    set(&mut three, "tau_cmd", Value::Real(0.5));
    assert_eq!(
        get(&mut three, "stuck"),
        Value::Boolean(true),
        "stuck must change only with the update"
    );
    three.new_discrete_states().unwrap();
    assert_eq!(get(&mut three, "stuck"), Value::Boolean(false));
    let count = get(&mut three, "event_count");
    three.new_discrete_states().unwrap();
    assert_eq!(get(&mut three, "event_count"), count, "a second update must have no effect");
    assert_eq!(real(&mut three, "event_time"), 0.5);
    // In step mode, without event mode between the steps, the same torque causes an event at the start of the step.
    let mut three: Three = initialised(Events::Reported, &values);
    handle(&mut three);
    set(&mut three, "tau_cmd", Value::Real(0.5));
    let info = three.step_to_event(0.0, 0.5, true).unwrap();
    assert!(info.event && info.early && three.time() == 0.0);
    handle(&mut three);
    assert_eq!(get(&mut three, "stuck"), Value::Boolean(false));
    let info = three.step_to_event(0.0, 0.5, true).unwrap();
    assert!(!info.early && three.time() == 0.5);
}

#[test]
fn a_state_saved_at_an_event_continues_the_same_motion() {
    let mut three: Three = initialised(Events::Reported, LIVELY);
    handle(&mut three);
    set(&mut three, "tau_cmd", Value::Real(0.03));
    let mut at = 0.0;
    while three.step_to_event(at, 1.0 - at, true).unwrap().early {
        at = three.time();
        // The state is saved at the event, in event mode and after event mode.
        for handled in 0..3 {
            match handled {
                1 => three.enter_event_mode().unwrap(),
                2 => handle(&mut three),
                _ => {}
            }
            let bytes = to_bytes(&three);
            let mut other: Three = from_bytes(&bytes).unwrap();
            assert_eq!(to_bytes(&other), bytes);
            let mut one = three.clone();
            for instance in [&mut one, &mut other] {
                if handled < 2 {
                    handle(instance);
                }
                instance.step_to_event(at, 1.0 - at, true).unwrap();
            }
            assert_eq!(to_bytes(&one), to_bytes(&other));
        }
    }
    let plain: Three = initialised(Events::InStep, LIVELY);
    assert!(three.restore(&plain).is_err(), "the saved state's host handles events in another way");
}

/// With `solver.max_steps` = 10 a long step returns fmi3Discard, and a shorter step from the same time succeeds.
#[test]
fn a_step_with_too_many_internal_steps_is_discarded_and_a_shorter_step_succeeds() {
    let mut three: Three = initialised(Events::InStep, &[("solver.max_steps", Value::Integer(10))]);
    let before = to_bytes(&three);
    let fault = three.step_to_event(0.0, 1e4, false).unwrap_err();
    assert_eq!(fault.severity, runtime::call::Severity::Discard, "{}", fault.text);
    assert_eq!(to_bytes(&three), before);
    three.step_to_event(0.0, 0.1, false).unwrap();
}

#[test]
fn a_reset_instance_equals_a_new_one_with_and_without_event_mode() {
    for events in [Events::InStep, Events::Reported] {
        let fresh: Three = Instance::with_events(Interface::CoSimulation, events);
        let mut three: Three = initialised(events, LIVELY);
        if events == Events::Reported {
            handle(&mut three);
        }
        set(&mut three, "tau_cmd", Value::Real(0.03));
        three.step_to_event(0.0, 1.0, true).unwrap();
        assert!(to_bytes(&three) != to_bytes(&fresh));
        three.reset().unwrap();
        assert!(to_bytes(&three) == to_bytes(&fresh), "{events:?}");
    }
}

#[test]
fn continuous_states_cannot_be_set_in_co_simulation() {
    let mut three: Three = initialised(Events::Reported, LIVELY);
    let omega = [reference::<Fmi3>("omega")];
    assert_eq!(three.state(), InstanceState::Event);
    assert!(three.set(&v3::SET_FLOAT64, &omega, |_| Value::Real(0.1)).is_err());
    handle(&mut three);
    assert!(three.set(&v3::SET_FLOAT64, &omega, |_| Value::Real(0.1)).is_err());
}

/// Simulates 1 s in steps of 20 ms, while the axial specific force (input g_axial) is constant in each step and jumps
/// between steps. Returns the output work_axial, the work of this force, J, and the gyro reading omega_imu, rad/s. The
/// simulation begins at `start`, s. `at` receives the number of a step and the time of the FMU, and returns the time that
/// the host passes for this step.
fn held_g<V: Version>(start: f64, at: impl Fn(usize, f64) -> f64) -> [f64; 2] {
    let mut instance = Instance::<Model, V>::with_events(Interface::CoSimulation, Events::InStep);
    set(&mut instance, "imu.enabled", Value::Boolean(true));
    set(&mut instance, "init.slosh_angle", Value::Real(0.3));
    set(&mut instance, "init.omega", Value::Real(0.1));
    instance.setup_experiment(None, start, None).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    for k in 0..50 {
        set(&mut instance, "g_axial", Value::Real(9.81 + f64::from(k % 3)));
        let time = instance.time();
        instance.do_step(at(k as usize, time), 0.02).unwrap();
    }
    ["work_axial", "omega_imu"].map(|name| real(&mut instance, name))
}

/// The outputs must equal the outputs for a host that passes the FMU's own time and starts at 0. Before this was corrected,
/// rounding errors of the host's times caused errors of the work of up to 1.5e-4 J, and at 1e9 s gyro samples were one step
/// late.
#[test]
fn work_by_g_axial_and_gyro_samples_do_not_depend_on_rounding_of_the_host_clock() {
    fn compare<V: Version>() {
        let exact = held_g::<V>(0.0, |_, time| time);
        assert!(exact[0].abs() > 1e-3 && exact[1] != 0.0, "{exact:?}");
        for start in [0.0, 0.1, 1e9] {
            assert_eq!(held_g::<V>(start, |k, _| start + k as f64 * 0.02), exact, "k h, {start}");
            assert_eq!(held_g::<V>(start, |_, time| time), exact, "t += h, {start}");
            assert_eq!(held_g::<V>(start, |_, time| time.next_up()), exact, "late, {start}");
            assert_eq!(held_g::<V>(start, |_, time| time.next_down()), exact, "early, {start}");
        }
    }
    compare::<Fmi2>();
    compare::<Fmi3>();
}

/// The energy of a suspension line that is twisted by 1e308 rad is not finite.
#[test]
fn the_error_about_a_too_large_initial_state_names_its_parameter() {
    fn refused<V: Version>() {
        let mut instance =
            Instance::<Model, V>::with_events(Interface::CoSimulation, Events::InStep);
        set(&mut instance, "init.theta", Value::Real(1e308));
        instance.setup_experiment(None, 0.0, None).unwrap();
        instance.enter_initialization_mode().unwrap();
        let why = instance.exit_initialization_mode().unwrap_err().text;
        assert!(why.contains("theta = 1e308 at the start"), "{why}");
        assert!(why.contains("init.theta"), "{why}");
    }
    refused::<Fmi2>();
    refused::<Fmi3>();
}

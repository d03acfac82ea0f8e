//! Tests of Co-Simulation in FMI 3.0 with a host that handles events in event mode. The FMU applies events within the steps, but
//! the host sees the changed discrete outputs only after it has updated the discrete states.

use super::*;
use crate::call::{Events, InstanceState};
use crate::instance::{EventInfo, StepInfo};
use crate::snapshot::from_bytes;
use crate::table::Layout;
use crate::v3::{ENTER_STEP, Fmi3, GET_BOOLEAN, GET_FLOAT64, GET_INT32, GET_INT64, SET_FLOAT64};
use crate::version::Version;

type Host = Instance<Vessels, Fmi3>;

fn number(name: &str) -> u32 {
    reference(name) + 1
}

fn stepping(events: Events, start: f64, values: &[(&str, f64)]) -> Host {
    let mut host = Host::with_events(CS, events);
    for (name, x) in values {
        host.set(&SET_FLOAT64, &[number(name)], |_| Value::Real(*x)).unwrap();
    }
    host.setup_experiment(None, start, None).unwrap();
    host.enter_initialization_mode().unwrap();
    host.exit_initialization_mode().unwrap();
    if events == Events::Reported {
        assert_eq!(host.state(), InstanceState::Event);
        host.enter_step_mode(&ENTER_STEP).unwrap();
    }
    host
}

fn valve_outputs(host: &mut Host) -> [Value; 3] {
    [
        host.get(&GET_BOOLEAN, number("open")).unwrap(),
        host.get(&GET_INT32, number("events")).unwrap(),
        host.get(&GET_INT64, number("valve")).unwrap(),
    ]
}

const CLOSED: [Value; 3] = [Value::Boolean(false), Value::Integer(0), Value::Integer(1)];
const OPENED: [Value; 3] = [Value::Boolean(true), Value::Integer(1), Value::Integer(2)];

/// In FMI 3.0 with event mode, discrete outputs do not change in the step that ends at an event, but only in the event mode
/// that follows.
#[test]
fn discrete_outputs_keep_their_value_until_the_host_handles_the_event() {
    let mut host = stepping(Events::Reported, 0.0, &[("inspection", 5.0)]);
    assert_eq!(valve_outputs(&mut host), CLOSED);
    let quiet = StepInfo { event: false, early: false };
    assert_eq!(host.step_to_event(0.0, 0.5, false), Ok(quiet));
    host.set(&SET_FLOAT64, &[number("z")], |_| Value::Real(3.0)).unwrap();
    let level = |host: &mut Host| match host.get(&GET_FLOAT64, number("level[1]")) {
        Ok(Value::Real(x)) => x,
        other => panic!("{other:?}"),
    };
    let before = level(&mut host);
    let event = StepInfo { event: true, early: false };
    assert_eq!(host.step_to_event(0.5, 0.001, false), Ok(event));
    assert_eq!(valve_outputs(&mut host), CLOSED, "the valve has opened");
    assert!((level(&mut host) / before - 0.5).abs() < 1e-3, "half of the vessel must be spilt");
    // The event is reported again until the host handles it.
    assert_eq!(host.step_to_event(0.501, 0.5, false), Ok(event));
    host.enter_event_mode().unwrap();
    assert_eq!(valve_outputs(&mut host), CLOSED);
    let info = EventInfo { states_changed: false, next_time: Some(5.0) };
    assert_eq!(host.new_discrete_states(), Ok(info));
    assert_eq!(valve_outputs(&mut host), OPENED);
    host.enter_step_mode(&ENTER_STEP).unwrap();
    assert_eq!(host.step_to_event(1.001, 0.5, false), Ok(quiet));
    assert_eq!(valve_outputs(&mut host), OPENED);
}

/// In FMI 3.0 an error ends the simulation of an instance, but the host can still read its variables.
#[test]
fn after_an_error_before_initialization_discrete_outputs_have_their_start_values() {
    let mut host = Host::with_events(CS, Events::Reported);
    assert!(host.exit_initialization_mode().is_err());
    host.after_error();
    assert_eq!(host.state(), InstanceState::Terminated);
    assert_eq!(valve_outputs(&mut host), CLOSED);
    // A saved state contains whether discrete outputs have a value.
    let bytes = to_bytes(&host);
    let mut other = from_bytes::<Vessels, Fmi3>(&bytes).unwrap();
    assert_eq!(valve_outputs(&mut other), CLOSED);
    assert!(to_bytes(&other) == bytes);
}

/// In FMI 3.0 initialisation fails because a parameter is NaN. Reading a discrete or a continuous output is then an error.
#[test]
fn after_an_error_in_initialization_by_a_wrong_parameter_outputs_have_no_value() {
    let mut host = Host::with_events(CS, Events::Reported);
    host.set(&SET_FLOAT64, &[number("inspection")], |_| Value::Real(f64::NAN)).unwrap();
    host.enter_initialization_mode().unwrap();
    assert!(host.exit_initialization_mode().is_err());
    host.after_error();
    assert!(host.get(&GET_BOOLEAN, number("open")).is_err());
    assert!(host.get(&GET_INT32, number("events")).is_err());
    assert!(host.get(&GET_INT64, number("valve")).is_err());
    assert!(host.get(&GET_FLOAT64, number("level[1]")).is_err());
}

/// In the test model a platform rises at 0.25 m/s from height 0, from t = 1 s on. At a certain height it opens a valve, which
/// is the event.
#[test]
fn a_step_ends_at_an_event_if_the_host_allows_early_return_and_input_ramps_end_there_too() {
    let real = |host: &mut Host, name: &str| match host.get(&GET_FLOAT64, number(name)) {
        Ok(Value::Real(x)) => x,
        other => panic!("{name}: {other:?}"),
    };
    let values = [("inspection", 5.0), ("w", 0.25)];
    let after = |events, stops, h| {
        let mut host = stepping(events, 1.0, &values);
        let info = host.step_to_event(1.0, h, stops).unwrap();
        ((info.event, info.early), (host.time(), real(&mut host, "z")))
    };
    assert_eq!(after(Events::Reported, true, 6.0), ((true, true), (5.0, 1.0)));
    assert_eq!(
        after(Events::Reported, true, 4.0),
        ((true, false), (5.0, 1.0)),
        "the event is at the end of the step"
    );
    assert_eq!(after(Events::Reported, true, 2.0), ((false, false), (3.0, 0.5)), "before");
    assert_eq!(after(Events::Reported, false, 6.0), ((true, false), (7.0, 1.5)), "passed");
    assert_eq!(after(Events::InStep, true, 6.0), ((false, false), (7.0, 1.5)), "not told");
}

/// A time before the last event is allowed within 1e-9 of the time since the start, plus 8 rounding errors of the largest
/// time.
#[test]
fn time_may_go_back_to_the_last_event_at_most() {
    for (start, last, slack) in [
        (0.0, 1000.0, 1e-6),
        (-2000.0, -1000.0, 1e-6),
        (0.0, 0.0, 0.0),
        (1e9, 1e9 + 1.0, 1.7764e-6 + 1e-9),
    ] {
        let mut host = Host::new(ME);
        host.setup_experiment(None, start, None).unwrap();
        host.enter_initialization_mode().unwrap();
        host.exit_initialization_mode().unwrap();
        host.new_discrete_states().unwrap();
        host.enter_continuous_time_mode().unwrap();
        host.set_time(last).unwrap();
        host.enter_event_mode().unwrap();
        host.new_discrete_states().unwrap();
        host.enter_continuous_time_mode().unwrap();
        host.set_time(last + 2.0).unwrap();
        host.set_time(last - 0.9 * slack).unwrap();
        let why = refused(host.set_time(last - 1.1 * slack - 1e-9));
        assert!(
            why.contains(&format!("before the last event (allowed: {last:?} s or later)")),
            "{why}"
        );
    }
}

/// In FMI 3.0, setting an input or a state to a value outside its range returns the status Discard, after which the host may
/// continue.
#[test]
fn inputs_and_states_out_of_range_return_discard_with_the_allowed_range() {
    let mut host = stepping(Events::Reported, 0.0, &[]);
    let said = discarded(host.set(&SET_FLOAT64, &[number("q[2]")], |_| Value::Real(11.0)));
    assert!(said.contains("q[2] = 11.0"), "{said}");
    let mut host = Host::new(ME);
    host.enter_initialization_mode().unwrap();
    host.exit_initialization_mode().unwrap();
    for (x, text) in [(1e30, "1e30"), (f64::NAN, "NaN"), (f64::NEG_INFINITY, "-inf")] {
        let said = discarded(host.set(&SET_FLOAT64, &[number("level[2]")], |_| Value::Real(x)));
        let expected = format!("level[2] = {text} (allowed: magnitudes below 1e30)");
        assert!(said.contains(&expected), "{said}");
    }
    host.set(&SET_FLOAT64, &[number("level[2]")], |_| Value::Real(-9.9e29)).unwrap();
    // An input out of its range is discarded, too.
    let said = discarded(host.set(&SET_FLOAT64, &[number("q[2]")], |_| Value::Real(11.0)));
    assert!(said.contains("q[2] = 11.0"), "{said}");
    let start = number("start.level[1]");
    assert!(
        refused(host.set(&SET_FLOAT64, &[start], |_| Value::Real(2.0))).contains("start.level[1]")
    );
    // A Model Exchange host can also set a state after the simulation has started.
    let level = |host: &mut Host| {
        refused(host.set(&SET_FLOAT64, &[number("level[2]")], |_| Value::Real(1.0)))
    };
    let mut early = Host::new(ME);
    assert!(level(&mut early).contains("level[2]"));
    let mut stepped = stepping(Events::Reported, 0.0, &[]);
    stepped.enter_event_mode().unwrap();
    assert!(level(&mut stepped).contains("level[2]"));
    let mut two = continuous(&[]);
    assert!(refused(set(&mut two, "level[2]", 1.0)).contains("level[2]"));
}

/// In FMI 3.0 a step that needs more than a million internal steps is discarded, because a shorter step may succeed. A step
/// in which a vessel overflows is an error, because no shorter step would succeed. In FMI 2.0 both are errors, which end the
/// simulation.
#[test]
fn a_step_is_discarded_where_a_shorter_one_may_succeed() {
    let too_long = |discards: bool, done: Result<(), Fault>| {
        let said = if discards { discarded(done) } else { refused(done) };
        assert!(said.contains("more than 1e6 internal steps"), "{said}");
    };
    let mut three = Instance::<Spring, Fmi3>::new(CS);
    three.enter_initialization_mode().unwrap();
    three.exit_initialization_mode().unwrap();
    too_long(true, three.do_step(0.0, 1001.0));
    assert_eq!(three.do_step(0.0, 1.0), Ok(()));
    let mut two = spring(CS);
    too_long(false, two.do_step(0.0, 1001.0));
    assert_eq!(two.state(), InstanceState::Failed);
    let mut host =
        stepping(Events::InStep, 0.0, &[("start.level[1]", 79.0), ("q[1]", 10.0), ("leak", 1e-3)]);
    assert!(refused(host.do_step(0.0, 1.0)).contains("a vessel overflows"));
    assert_eq!(host.state(), InstanceState::Failed);
}

#[test]
fn each_interface_and_fmi_version_allows_its_own_kinds_of_event_handling() {
    let allowed = |interface| Events::ALL.map(|events| Fmi3::allows(interface, events));
    assert_eq!(allowed(CS), [true, false, true]);
    assert_eq!(allowed(ME), [false, true, false]);
    let of_2 = [CS, ME].map(|interface| Events::ALL.map(|events| Fmi2::allows(interface, events)));
    assert_eq!(of_2, [[true, false, false], [false, true, false]]);
    let tokens = Layout::ALL.map(Fmi3::token::<Vessels>);
    assert_eq!(tokens, Layout::ALL.map(|layout| TABLE.token(layout)));
    assert_ne!(tokens[0], tokens[1]);
}

//! Tests of Model Exchange, in which the host integrates the states and handles events.

use super::*;
use crate::call::InstanceState;
use crate::instance::EventInfo;

#[test]
fn states_derivatives_and_nominals_are_in_the_order_of_the_model_description() {
    let mut instance = started(ME, &[]);
    let mut x = [0.0; 2];
    instance.continuous_states(&mut x).unwrap();
    assert_eq!(x, [3.0, 4.0]);
    instance.derivatives(&mut x).unwrap();
    assert_eq!(x, [1.0 - 1.5, 2.0 - 2.0]);
    instance.nominals(&mut x).unwrap();
    assert_eq!(x, [5.0, 5.0]);
    spring(ME).nominals(&mut x).unwrap();
    assert_eq!(x, [1.0, 1.0]);
    instance.set_continuous_states(&[6.0, 8.0]).unwrap();
    assert_eq!((real(&mut instance, "level[1]"), real(&mut instance, "sum")), (6.0, 14.0));
    assert_eq!(real(&mut instance, "der(level[2])"), 2.0 - 4.0);
    let mut room = [0.0];
    instance.event_indicators(&mut room).unwrap();
    assert_eq!(room, [-2.0]);
}

#[test]
fn arrays_of_states_and_derivatives_with_a_wrong_length_are_refused() {
    let mut instance = started(ME, &[]);
    let long = &mut [0.0; 3];
    let messages = [
        unchanged(&mut instance, |i| i.continuous_states(long)),
        unchanged(&mut instance, |i| i.set_continuous_states(&[1.0])),
        unchanged(&mut instance, |i| i.derivatives(&mut [0.0; 3])),
        unchanged(&mut instance, |i| i.nominals(&mut [0.0; 3])),
        unchanged(&mut instance, |i| i.event_indicators(&mut [0.0; 2])),
    ];
    for (message, end) in messages.iter().zip([
        "nx = 3 (allowed: 2)",
        "nx = 1 (allowed: 2)",
        "nx = 3 (allowed: 2)",
        "nx = 3 (allowed: 2)",
        "ni = 2 (allowed: 1)",
    ]) {
        assert!(message.ends_with(end), "{message}");
    }
}

#[test]
fn setting_continuous_states_that_are_too_large_is_discarded() {
    let mut instance = continuous(&[]);
    for x in [f64::NAN, f64::INFINITY, 1e30, -1e30] {
        let before = to_bytes(&instance);
        let why = discarded(instance.set_continuous_states(&[1.0, x]));
        let x = if x.is_nan() { "NaN".into() } else { format!("{x:?}") };
        assert_eq!(
            why,
            format!("fmi2SetContinuousStates: level[2] = {x} (allowed: magnitudes below 1e30)")
        );
        assert_eq!(to_bytes(&instance), before);
    }
    assert_eq!(instance.set_continuous_states(&[0.99e30, -0.99e30]), Ok(()));
}

#[test]
fn reading_derivatives_that_are_not_finite_is_discarded() {
    let mut instance = continuous(&[("leak", 1e300)]);
    instance.set_continuous_states(&[0.0, 1e29]).unwrap();
    let mut x = [0.0; 2];
    assert_eq!(discarded(instance.derivatives(&mut x)), "fmi2GetDerivatives: der(level[2]) = -inf");
}

#[test]
fn discrete_values_change_only_at_events() {
    let mut instance = continuous(&[("inspection", 5.0)]);
    set(&mut instance, "z", 3.0).unwrap();
    assert_eq!(get(&mut instance, "open"), Ok(Value::Boolean(false)));
    assert_eq!(instance.completed_integrator_step(), Ok(true));
    instance.enter_event_mode().unwrap();
    let info = EventInfo { states_changed: true, next_time: Some(5.0) };
    assert_eq!(instance.new_discrete_states(), Ok(info));
    assert_eq!(get(&mut instance, "open"), Ok(Value::Boolean(true)));
    assert_eq!(real(&mut instance, "level[1]"), 1.5);
    assert_eq!((instance.event_count(), instance.time()), (1, 0.0));
    // A second call of `new_discrete_states` has no effect.
    let info = EventInfo { states_changed: false, next_time: Some(5.0) };
    assert_eq!(instance.new_discrete_states(), Ok(info));
    instance.enter_continuous_time_mode().unwrap();
    assert_eq!(instance.completed_integrator_step(), Ok(false));
    instance.set_time(5.0).unwrap();
    assert_eq!(instance.time(), 5.0);
    instance.enter_event_mode().unwrap();
    assert_eq!(instance.new_discrete_states().unwrap().next_time, None);
    set(&mut instance, "z", 101.0).unwrap();
    assert_eq!(
        unchanged(&mut instance, |i| i.new_discrete_states()),
        "fmi2NewDiscreteStates: the platform is too high"
    );
}

/// In the test model a rate depends on the inflow and, only if there is a leak, on the level. Before the simulation starts, a
/// variable depends on the values from which its initial value is computed.
#[test]
fn only_declared_dependencies_that_have_an_effect_now_are_reported() {
    let of = |instance: &mut Subject, name: &str| {
        let scalar = &TABLE.scalars[reference(name) as usize];
        instance.dependencies(&GET_REAL, scalar).unwrap()
    };
    let mut instance = fresh(ME);
    let initially = references(["q[2]", "leak", "start.level[1]"]);
    assert_eq!(of(&mut instance, "net[2]"), initially);
    for (leak, expected) in [(0.5, vec!["level[2]", "q[2]"]), (0.0, vec!["q[2]"])] {
        let mut instance = continuous(&[("leak", leak)]);
        let expected: Vec<_> = expected.into_iter().map(reference).collect();
        assert_eq!(of(&mut instance, "net[2]"), expected, "{leak}");
        assert_eq!(of(&mut instance, "level[2]"), [reference("level[2]")]);
        assert_eq!(of(&mut instance, "room"), [reference("z")]);
        assert_eq!(of(&mut instance, "open"), [0; 0]);
    }
}

#[test]
fn outputs_have_the_values_for_the_time_states_and_inputs_that_the_host_set_last() {
    let mut instance = continuous(&[]);
    assert_eq!(real(&mut instance, "sum"), 7.0);
    instance.set_continuous_states(&[1.0, 1.0]).unwrap();
    assert_eq!(real(&mut instance, "sum"), 2.0);
    assert_eq!(
        unchanged(&mut instance, |i| i.set_time(f64::NAN)),
        "fmi2SetTime: time = NaN s (allowed: any finite number)"
    );
}

#[test]
fn invalid_continuous_states_in_model_exchange_end_the_simulation() {
    let mut instance = continuous(&[]);
    instance.set_continuous_states(&[-2.0, 1.0]).unwrap();
    assert_eq!(
        refused(instance.completed_integrator_step()),
        "fmi2CompletedIntegratorStep: a level is below the ground"
    );
    assert_eq!(instance.state(), InstanceState::Failed);
}

/// The tolerance is 1e-9 of the time since the start, at least 1e-9 s, plus 8 rounding errors of the largest time.
#[test]
fn accepted_steps_may_pass_the_stop_time_by_rounding_errors() {
    for (start, stop, slack) in [
        (-2000.0, 1000.0, 3e-6),
        (-2000.0, -1000.0, 1e-6),
        (0.0, 0.0, 1e-9),
        (1e9, 1e9 + 1.0, 1.7764e-6 + 1e-9),
    ] {
        let mut instance = fresh(ME);
        instance.setup_experiment(None, start, Some(stop)).unwrap();
        instance.enter_initialization_mode().unwrap();
        instance.exit_initialization_mode().unwrap();
        instance.enter_continuous_time_mode().unwrap();
        for share in [-1.0, 0.0, 0.9] {
            instance.set_time(stop + share * slack).unwrap();
            assert_eq!(instance.completed_integrator_step(), Ok(false));
        }
        instance.set_time(stop + 1.1 * slack).unwrap();
        let why = unchanged(&mut instance, |i| i.completed_integrator_step());
        assert!(why.contains(&format!("has passed the stop time {stop:?} s")), "{why}");
    }
}

#[test]
fn a_model_without_events_reports_no_event() {
    let mut instance = spring(ME);
    let info = EventInfo { states_changed: false, next_time: None };
    assert_eq!(instance.new_discrete_states(), Ok(info));
    instance.enter_continuous_time_mode().unwrap();
    assert_eq!(instance.completed_integrator_step(), Ok(false));
    assert_eq!(instance.event_indicators(&mut []), Ok(()));
    assert_eq!((instance.event_count(), instance.last_event()), (0, String::new()));
    assert_eq!((instance.warnings(), instance.step_warning()), (Vec::new(), None));
    let mut inputs = [1.0, 0.0];
    assert!(!Spring::set_dependent_slopes(&mut inputs, 1.0));
    let Ok(mut model) = Spring::new(&Default::default(), &inputs, 0.0, 1e-6) else { panic!() };
    assert_eq!(model.tune(&Default::default(), &inputs), Ok(()));
}

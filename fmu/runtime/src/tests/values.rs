//! Tests of reading and setting variables.

use super::*;
use crate::call::InstanceState;
use crate::v2::{GET_STRING, SET_STRING};
use Value::{Boolean, Integer, Real};

#[test]
fn every_kind_of_variable_is_read_from_the_model() {
    let mut instance = started(CS, &[("z", 0.25)]);
    for (name, value) in [
        ("level[1]", Real(3.0)),
        ("level[2]", Real(4.0)),
        ("sum", Real(7.0)),
        ("trend", Real(0.0)),
        ("net[1]", Real(1.0 - 0.5 * 3.0)),
        ("net[2]", Real(2.0 - 0.5 * 4.0)),
        ("room", Real(1.75)),
        ("open", Boolean(false)),
        ("events", Integer(0)),
        ("valve", Integer(1)),
        ("der(level[1])", Real(-0.5)),
        ("der(level[2])", Real(0.0)),
        ("q[1]", Real(1.0)),
        ("q[2]", Real(2.0)),
        ("z", Real(0.25)),
        ("leak", Real(0.5)),
        ("start.level[1]", Real(3.0)),
        ("start.level[2]", Real(4.0)),
        ("has_lid", Boolean(true)),
        ("number", Integer(2)),
        ("gauges", Integer(3)),
        ("material", Integer(1)),
        ("time_constant", Real(2.0)),
    ] {
        assert_eq!(get(&mut instance, name), Ok(value), "{name}");
    }
}

#[test]
fn computed_variables_have_a_value_from_initialization_mode_on() {
    let mut instance = fresh(CS);
    assert_eq!(get(&mut instance, "leak"), Ok(Real(0.5)));
    assert_eq!(get(&mut instance, "q[2]"), Ok(Real(2.0)));
    for name in ["level[1]", "sum", "room", "open", "der(level[1])", "time_constant"] {
        let why = unchanged(&mut instance, |i| get(i, name));
        let says = "has no value in state \"instantiated\"; it has one from initialization mode on";
        assert!(why.contains(&format!("{name} {says}")), "{why}");
    }
    instance.enter_initialization_mode().unwrap();
    // Each time an input is set, the variables that depend on it change.
    for (z, room) in [(0.5, 1.5), (1.0, 1.0)] {
        set(&mut instance, "z", z).unwrap();
        assert_eq!(real(&mut instance, "room"), room);
    }
    for (level, net) in [(4.0, -1.0), (6.0, -2.0)] {
        set(&mut instance, "start.level[1]", level).unwrap();
        assert_eq!(real(&mut instance, "level[1]"), level);
        assert_eq!(real(&mut instance, "net[1]"), net);
    }
    set_boolean(&mut instance, "has_lid", false).unwrap();
    set_integer(&mut instance, "number", -3).unwrap();
    set_integer(&mut instance, "gauges", 9).unwrap();
    set_integer(&mut instance, "material", 2).unwrap();
    assert_eq!(get(&mut instance, "has_lid"), Ok(Boolean(false)));
    assert_eq!(get(&mut instance, "number"), Ok(Integer(-3)));
    assert_eq!(get(&mut instance, "gauges"), Ok(Integer(9)));
    assert_eq!(get(&mut instance, "material"), Ok(Integer(2)));
    let parameters = instance.model_parameters().unwrap();
    assert_eq!((parameters.has_lid, parameters.number), (false, -3));
    assert_eq!((parameters.gauges, parameters.material), (9, 2));
    assert_eq!(parameters.level_0, [6.0, 4.0]);
}

#[test]
fn value_references_of_another_type_or_without_a_variable_are_refused() {
    let mut instance = started(CS, &[]);
    let integer = reference("number");
    let last = TABLE.scalars.len() as u32;
    assert_eq!(
        refused(instance.get(&GET_REAL, integer)),
        format!("fmi2GetReal: number (value reference {integer}) is of type Integer")
    );
    let valve = reference("valve");
    assert!(refused(instance.get(&GET_BOOLEAN, valve)).ends_with("is of type Integer"));
    let why = unchanged(&mut instance, |i| i.set(&SET_INTEGER, &[last], |_| Integer(1)));
    assert_eq!(
        why,
        format!(
            "fmi2SetInteger: no variable has the value reference {last}; the last one is {}",
            last - 1
        )
    );
    // The model has no strings.
    assert!(refused(instance.get(&GET_STRING, 0)).starts_with("fmi2GetString: level[1] (value"));
    assert!(refused(instance.set(&SET_STRING, &[0], |_| Boolean(true))).contains("of type Real"));
}

#[test]
fn setting_several_values_succeeds_or_fails_as_a_whole() {
    let mut instance = started(CS, &[]);
    let both = references(["q[1]", "q[2]"]);
    let why = unchanged(&mut instance, |i| i.set(&SET_REAL, &both, |n| Real([5.0, 11.0][n])));
    assert_eq!(why, "fmi2SetReal: q[2] = 11.0 m/s (allowed: 1.0 m/s to 10.0 m/s)");
    instance.set(&SET_REAL, &both, |n| Real([5.0, 6.0][n])).unwrap();
    assert_eq!((real(&mut instance, "q[1]"), real(&mut instance, "q[2]")), (5.0, 6.0));
    // A single input that is out of its range is refused, too.
    assert!(unchanged(&mut instance, |i| set(i, "q[1]", 0.9)).contains("q[1] = 0.9"));
    assert!(unchanged(&mut instance, |i| set(i, "z", f64::NAN)).contains("z = NaN"));
    set(&mut instance, "q[1]", 10.0).unwrap();
    assert_eq!(real(&mut instance, "net[1]"), 10.0 - 0.5 * 3.0);
}

#[test]
fn all_wrong_parameters_are_reported_when_initialization_ends() {
    let mut instance = fresh(CS);
    set(&mut instance, "start.level[1]", -1.0).unwrap();
    set_integer(&mut instance, "number", 6).unwrap();
    // Each value can be set whatever the others are, because the model is not needed for it.
    set(&mut instance, "leak", 0.25).unwrap();
    assert!(instance.model.is_none());
    instance.enter_initialization_mode().unwrap();
    set_integer(&mut instance, "material", 3).unwrap();
    assert_eq!(
        unchanged(&mut instance, |i| i.exit_initialization_mode()),
        "fmi2ExitInitializationMode: start.level[1] = -1.0 m (allowed: 0.0 m to 100.0 m); number = 6 \
         (allowed: -3 to 5); material = 3 (allowed: 1 glass, 2 steel)"
    );
    // Inputs out of range are refused immediately.
    assert!(unchanged(&mut instance, |i| set(i, "q[1]", 0.0)).contains("q[1] = 0.0"));
    // Parameters in event mode after initialization are refused immediately, too.
    let mut instance = started(ME, &[]);
    assert!(unchanged(&mut instance, |i| set(i, "leak", -1.0)).contains("leak = -1.0"));
    set(&mut instance, "leak", 4.0).unwrap();
    assert_eq!(real(&mut instance, "time_constant"), 0.25);
}

#[test]
fn only_inputs_and_tunable_parameters_can_be_set_during_the_simulation() {
    let mut instance = started(CS, &[]);
    assert_eq!(
        unchanged(&mut instance, |i| set(i, "sum", 1.0)),
        "fmi2SetReal: sum is computed; only inputs and parameters can be set"
    );
    assert!(unchanged(&mut fresh(CS), |i| set(i, "level[1]", 1.0)).contains("is computed"));
    assert_eq!(
        unchanged(&mut instance, |i| set(i, "inspection", 1.0)),
        "fmi2SetReal: inspection is a fixed parameter and cannot be set in state \"stepping\"; it can \
         in: instantiated, initialization mode"
    );
    set(&mut instance, "leak", 4.0).unwrap();
    assert_eq!(real(&mut instance, "time_constant"), 0.25);
    assert_eq!(real(&mut instance, "leak"), 4.0);
    assert_eq!(real(&mut instance, "net[1]"), 1.0 - 4.0 * 3.0);
    assert!(unchanged(&mut instance, |i| set(i, "leak", -1.0)).contains("leak = -1.0 1/s"));

    let mut instance = continuous(&[]);
    assert_eq!(
        unchanged(&mut instance, |i| set(i, "leak", 4.0)),
        "fmi2SetReal: leak is a tunable parameter and cannot be set in state \"continuous-time mode\"; \
         it can in: instantiated, initialization mode, stepping, event mode"
    );
    instance.enter_event_mode().unwrap();
    set(&mut instance, "leak", 4.0).unwrap();
    assert_eq!(real(&mut instance, "time_constant"), 0.25);
}

/// The model refuses a tunable parameter that contradicts its state. An input that the same call sets keeps its old value.
#[test]
fn a_call_with_one_refused_tunable_parameter_sets_no_variable() {
    let mut instance = started(CS, &[("z", 3.0)]);
    let both = references(["q[1]", "leak"]);
    let why = unchanged(&mut instance, |i| i.set(&SET_REAL, &both, |n| Real([5.0, 200.0][n])));
    assert_eq!(why, "fmi2SetReal: the leak is too fast; the valve is open");
    instance.set(&SET_REAL, &both, |n| Real([5.0, 20.0][n])).unwrap();
    assert_eq!(real(&mut instance, "net[1]"), 5.0 - 20.0 * 3.0);
}

#[test]
fn directional_derivatives_equal_the_partial_derivatives_of_the_equations() {
    let mut instance = started(CS, &[]);
    let unknowns = references([
        "der(level[1])",
        "der(level[2])",
        "level[1]",
        "level[2]",
        "sum",
        "net[2]",
        "room",
    ]);
    // The direction is d level[1] = 2, d level[2] = 3, d q[2] = 5, d z = 7; a known that occurs twice counts twice.
    let knowns = references(["level[1]", "level[2]", "q[2]", "z", "z", "level[1]"]);
    let mut answers = [0.0; 7];
    let direction = [1.5, 3.0, 5.0, 4.0, 3.0, 0.5];
    for _ in 0..2 {
        instance.directional_derivative(&unknowns, &knowns, &direction, &mut answers).unwrap();
        assert_eq!(answers, [-0.5 * 2.0, 5.0 - 0.5 * 3.0, 2.0, 3.0, 5.0, 3.5, -7.0]);
    }
    let level = references(["level[1]"]);
    let mut ask = |unknown: &str, known: &str, d: f64| {
        let (unknown, known) = (reference(unknown), reference(known));
        unchanged(&mut instance, |i| {
            i.directional_derivative(&[unknown], &[known], &[d], &mut [0.0])
        })
    };
    assert!(
        ask("sum", "leak", 1.0)
            .ends_with("leak cannot be a known: it is neither an input nor a continuous state")
    );
    assert!(
        ask("leak", "z", 1.0)
            .ends_with("leak has no derivative, because it is not computed from states and inputs")
    );
    assert!(
        ask("sum", "z", f64::NAN).ends_with("direction of z = NaN (allowed: any finite number)")
    );
    // Slopes that are set for the next step have no effect on the directional derivative.
    instance.set_input_derivatives(&references(["q[1]"]), &[1], &[8.0]).unwrap();
    instance.directional_derivative(&unknowns, &level, &[1.0], &mut answers).unwrap();
    assert_eq!(answers[0], -0.5);
}

#[test]
fn in_initialization_mode_directional_derivatives_are_by_inputs_and_parameters() {
    let mut instance = fresh(CS);
    set(&mut instance, "q[1]", 4.0).unwrap();
    instance.enter_initialization_mode().unwrap();
    let mut ask = |unknown: &str, known: &str, d: f64| {
        let mut answer = [0.0];
        let (unknowns, knowns) = ([reference(unknown)], [reference(known)]);
        let done = instance.directional_derivative(&unknowns, &knowns, &[d], &mut answer);
        done.map(|()| answer[0])
    };
    // The derivative of 1/k by steps of k/1024: central differences with Richardson's extrapolation have a relative error of
    // 4/1024^4 = 4e-12, and rounding adds 1024 x 2e-16.
    close(ask("time_constant", "leak", 1.0).unwrap(), -4.0, 1e-11);
    close(ask("time_constant", "leak", -3.0).unwrap(), 12.0, 1e-11);
    // Derivatives of linear functions are exact except for rounding.
    close(ask("net[1]", "start.level[1]", 2.0).unwrap(), -1.0, 1e-11);
    close(ask("net[1]", "q[1]", 1.0).unwrap(), 1.0, 1e-11);
    close(ask("sum", "start.level[2]", 1.0).unwrap(), 1.0, 1e-11);
    // If the value of the known is 0, the step of the difference follows from its nominal value.
    close(ask("room", "z", 1.0).unwrap(), -1.0, 1e-11);
    assert_eq!(ask("sum", "q[1]", 0.0), Ok(0.0));
    let known = "cannot be a known in initialization mode (allowed: inputs and parameters)";
    assert!(refused(ask("sum", "level[1]", 1.0)).ends_with(&format!("level[1] {known}")));
    assert!(refused(ask("sum", "z", f64::INFINITY)).contains("direction of z = inf"));
}

/// After fmi2DoStep has returned fmi2Error, the instance has time and values of the start of the step. Reading, reset,
/// termination and restoring a state are still allowed.
#[test]
fn after_a_step_that_failed_the_last_values_can_be_read() {
    let mut instance = started(CS, &[("z", 101.0)]);
    let message = refused(instance.do_step(0.0, 0.5));
    assert_eq!(message, "fmi2DoStep: step from 0.0 s to 0.5 s failed: the platform is too high");
    assert_eq!((instance.state(), instance.time()), (InstanceState::Failed, 0.0));
    assert_eq!(real(&mut instance, "sum"), 7.0);
    assert!(unchanged(&mut instance, |i| set(i, "z", 1.0)).contains("state \"step failed\""));
}

/// A leak of 1e300 1/s at a level of 1e20 m gives a rate that exceeds the largest number.
#[test]
fn a_nan_or_infinite_value_is_an_error_that_names_the_variable_and_its_inputs() {
    let mut instance = started(ME, &[]);
    instance.enter_event_mode().unwrap();
    set(&mut instance, "leak", 1e300).unwrap();
    instance.enter_continuous_time_mode().unwrap();
    instance.set_continuous_states(&[1e20, 1.0]).unwrap();
    let why = refused(get(&mut instance, "net[1]"));
    assert!(why.contains("net[1] = -inf") && why.contains("level[1]"), "{why}");
    let why = refused(get(&mut instance, "der(level[1])"));
    assert!(why.contains("der(level[1]) = -inf"), "{why}");
    assert!(instance.derivatives(&mut [0.0; 2]).is_err());
}

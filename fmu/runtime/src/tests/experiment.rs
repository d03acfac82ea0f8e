//! Tests of the setup before the simulation, and of the instance states in which each call is allowed.

use super::*;
use crate::call::{Call, Events, InstanceState};
use crate::instance::DEFAULT_TOLERANCE;
use crate::v2::*;
use crate::version::Version;

#[test]
fn an_instance_keeps_tolerance_start_and_stop_time_of_the_experiment() {
    let mut instance = fresh(CS);
    assert_eq!((instance.time(), instance.tolerance), (0.0, DEFAULT_TOLERANCE));
    instance.setup_experiment(Some(1e-5), 7.0, Some(7.0)).unwrap();
    assert_eq!((instance.clock.start, instance.clock.stop), (7.0, Some(7.0)));
    assert_eq!((instance.time(), instance.tolerance), (7.0, 1e-5));
    instance.setup_experiment(None, -1.0, None).unwrap();
    assert_eq!((instance.clock.stop, instance.tolerance), (None, DEFAULT_TOLERANCE));
    for tolerance in [1e-14, 1e-1] {
        assert_eq!(instance.setup_experiment(Some(tolerance), 0.0, None), Ok(()));
    }
}

#[test]
fn setup_experiment_refuses_invalid_values_and_names_each_of_them() {
    let mut instance = fresh(CS);
    let why = unchanged(&mut instance, |i| i.setup_experiment(Some(0.2), f64::NAN, Some(1.0)));
    assert_eq!(
        why,
        "fmi2SetupExperiment: startTime = NaN (allowed: any finite number); stopTime = 1.0 (allowed: \
         startTime NaN or later); tolerance = 0.2 (allowed: 1e-14 to 0.1)"
    );
    for (tolerance, start, stop) in [
        (None, f64::INFINITY, None),
        (None, 2.0, Some(1.9)),
        (None, 2.0, Some(f64::INFINITY)),
        (None, 2.0, Some(f64::NAN)),
        (Some(0.9e-14), 0.0, None),
        (Some(f64::NAN), 0.0, None),
    ] {
        let why = unchanged(&mut instance, |i| i.setup_experiment(tolerance, start, stop));
        assert_eq!(why.matches("allowed").count(), 1, "{why}");
    }
}

#[test]
fn an_instance_passes_through_the_states_of_co_simulation_or_model_exchange() {
    use InstanceState::*;
    let mut instance = fresh(CS);
    assert_eq!((instance.interface(), instance.state()), (CS, Instantiated));
    instance.enter_initialization_mode().unwrap();
    assert_eq!(instance.state(), Initialization);
    instance.exit_initialization_mode().unwrap();
    assert_eq!(instance.state(), Stepping);
    instance.terminate().unwrap();
    assert_eq!(instance.state(), Terminated);
    instance.reset().unwrap();
    assert_eq!(to_bytes(&instance), to_bytes(&fresh(CS)));

    let mut instance = started(ME, &[]);
    assert_eq!((instance.interface(), instance.state()), (ME, Initialized));
    assert!(!instance.is_running());
    instance.enter_continuous_time_mode().unwrap();
    assert_eq!(instance.state(), Continuous);
    instance.enter_event_mode().unwrap();
    assert_eq!(instance.state(), Event);
    instance.reset().unwrap();
    assert_eq!(to_bytes(&instance), to_bytes(&fresh(ME)));
    // After a call that continues the simulation, parameters can no longer be set.
    type GoesOn = fn(&mut Subject) -> Result<(), Fault>;
    let goes_on: [GoesOn; 6] = [
        |i| i.enter_event_mode(),
        |i| i.enter_continuous_time_mode(),
        |i| i.new_discrete_states().map(|_| ()),
        |i| i.set_time(0.5),
        |i| i.set_continuous_states(&[1.0, 2.0]),
        |i| i.terminate(),
    ];
    for call in goes_on {
        let mut instance = started(ME, &[]);
        call(&mut instance).unwrap();
        assert!(instance.is_running());
    }
}

/// Both vessels of the test model start with a level that is too high. The error at the end of initialisation contains both
/// problems, and the host can then correct the levels.
#[test]
fn contradicting_parameters_end_initialization_with_all_faults_named() {
    let mut instance = fresh(CS);
    set(&mut instance, "start.level[1]", 90.0).unwrap();
    set(&mut instance, "start.level[2]", 90.0).unwrap();
    instance.enter_initialization_mode().unwrap();
    assert_eq!(
        unchanged(&mut instance, |i| i.exit_initialization_mode()),
        "fmi2ExitInitializationMode: the first vessel is too full; the second vessel is too full"
    );
    set(&mut instance, "start.level[1]", 10.0).unwrap();
    set(&mut instance, "start.level[2]", 10.0).unwrap();
    assert_eq!(instance.exit_initialization_mode(), Ok(()));
    // In Model Exchange parameters can still be set after initialization.
    let mut instance = started(ME, &[]);
    set(&mut instance, "start.level[1]", 90.0).unwrap();
    assert_eq!(
        unchanged(&mut instance, |i| i.enter_event_mode()),
        "fmi2EnterEventMode: the first vessel is too full"
    );
}

const CALLS: [&Call; 40] = [
    &SET_DEBUG_LOGGING,
    Fmi2::SETUP_EXPERIMENT,
    Fmi2::ENTER_INITIALIZATION,
    Fmi2::EXIT_INITIALIZATION,
    Fmi2::TERMINATE,
    Fmi2::RESET,
    &GET_REAL,
    &GET_INTEGER,
    &GET_BOOLEAN,
    &GET_STRING,
    &SET_REAL,
    &SET_INTEGER,
    &SET_BOOLEAN,
    &SET_STRING,
    &GET_STATE,
    Fmi2::SET_STATE,
    &FREE_STATE,
    &SERIALIZED_SIZE,
    &SERIALIZE,
    &DESERIALIZE,
    Fmi2::DIRECTIONAL_DERIVATIVE,
    Fmi2::SET_INPUT_DERIVATIVES,
    Fmi2::GET_OUTPUT_DERIVATIVES,
    Fmi2::DO_STEP,
    &CANCEL_STEP,
    &GET_STATUS,
    &GET_REAL_STATUS,
    &GET_INTEGER_STATUS,
    &GET_BOOLEAN_STATUS,
    &GET_STRING_STATUS,
    Fmi2::ENTER_EVENT,
    Fmi2::NEW_DISCRETE_STATES,
    Fmi2::ENTER_CONTINUOUS_TIME,
    Fmi2::COMPLETED_STEP,
    Fmi2::SET_TIME,
    Fmi2::SET_CONTINUOUS_STATES,
    Fmi2::GET_DERIVATIVES,
    Fmi2::GET_EVENT_INDICATORS,
    Fmi2::GET_CONTINUOUS_STATES,
    Fmi2::GET_NOMINALS,
];

const ALWAYS: [&str; 12] = [
    "SetDebugLogging",
    "Reset",
    "GetReal",
    "GetInteger",
    "GetBoolean",
    "GetString",
    "GetFMUstate",
    "SetFMUstate",
    "FreeFMUstate",
    "SerializedFMUstateSize",
    "SerializeFMUstate",
    "DeSerializeFMUstate",
];
const STATUS: [&str; 5] =
    ["GetStatus", "GetRealStatus", "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus"];
const SET: [&str; 4] = ["SetReal", "SetInteger", "SetBoolean", "SetString"];
const LOOK: [&str; 3] = ["GetDerivatives", "GetEventIndicators", "GetContinuousStates"];

/// The expected calls are listed in the standard FMI 2.0.1, sections 3.2.3 and 4.2.4. In addition, this FMU lets hosts enter
/// event mode again from event mode, set time and states in event mode, and terminate after a failed step.
#[test]
fn calls_allowed_in_each_state_equal_those_of_the_standard() {
    use InstanceState::*;
    let both = |state, interface| -> Vec<&str> {
        let mut all = ALWAYS.to_vec();
        all.extend(if interface == CS { &STATUS[..] } else { &["GetNominalsOfContinuousStates"] });
        match state {
            Instantiated => {
                all.extend(SET);
                all.extend(["SetupExperiment", "EnterInitializationMode"]);
            }
            Initialization => {
                all.extend(SET);
                all.extend(["ExitInitializationMode", "GetDirectionalDerivative"]);
            }
            Fatal => all = vec!["FreeFMUstate"],
            _ => all.push("GetDirectionalDerivative"),
        }
        all
    };
    for (state, more) in [
        (Instantiated, &["SetRealInputDerivatives"][..]),
        (Initialization, &["SetRealInputDerivatives"]),
        (
            Stepping,
            &[
                "SetRealInputDerivatives",
                "GetRealOutputDerivatives",
                "DoStep",
                "CancelStep",
                "Terminate",
            ],
        ),
        (Terminated, &["GetRealOutputDerivatives"]),
        (Failed, &["GetRealOutputDerivatives", "Terminate"]),
        (Fatal, &[]),
    ] {
        let mut expected = both(state, CS);
        expected.extend(more);
        if state == Stepping {
            expected.extend(SET);
        }
        compare(CS, Events::InStep, state, expected);
    }
    for (state, more) in [
        (Instantiated, &[][..]),
        (Initialization, &[]),
        (
            Event,
            &[
                "EnterEventMode",
                "NewDiscreteStates",
                "EnterContinuousTimeMode",
                "SetTime",
                "SetContinuousStates",
                "Terminate",
            ],
        ),
        (
            Continuous,
            &[
                "EnterEventMode",
                "CompletedIntegratorStep",
                "SetTime",
                "SetContinuousStates",
                "Terminate",
            ],
        ),
        (Terminated, &[]),
        (Failed, &["Terminate"]),
        (Fatal, &[]),
    ] {
        let mut expected = both(state, ME);
        expected.extend(more);
        if ![Instantiated, Fatal].contains(&state) {
            expected.extend(LOOK);
        }
        if [Event, Continuous].contains(&state) {
            expected.extend(SET);
        }
        if state == Event {
            compare(ME, Events::ByHost, Initialized, expected.clone());
        }
        compare(ME, Events::ByHost, state, expected);
    }
}

fn compare(interface: Interface, events: Events, state: InstanceState, mut expected: Vec<&str>) {
    let allowed = CALLS.iter().filter(|call| call.check(interface, events, state).is_ok());
    let mut names: Vec<_> = allowed.map(|call| call.name.strip_prefix("fmi2").unwrap()).collect();
    names.sort_unstable();
    expected.sort_unstable();
    assert_eq!(names, expected, "{interface:?}, {state:?}");
}

#[test]
fn reachable_instance_states_depend_on_the_interface_and_on_event_handling_by_the_host() {
    use Events::{ByHost, InStep};
    use InstanceState::*;
    let reached = |interface, events| -> Vec<_> {
        let all = InstanceState::ALL.into_iter();
        all.filter(|state| state.is_reachable(interface, events)).collect()
    };
    let always = [Instantiated, Initialization, Terminated, Failed, Fatal];
    for (interface, events, own) in [
        (CS, InStep, &[Stepping][..]),
        (CS, ByHost, &[Stepping, Event, Initialized]),
        (CS, Events::Reported, &[Stepping, Event, Initialized]),
        (ME, ByHost, &[Event, Continuous, Initialized]),
    ] {
        let reached = reached(interface, events);
        let expected = always.iter().chain(own);
        assert!(expected.clone().all(|state| reached.contains(state)), "{interface:?} {events:?}");
        assert_eq!(reached.len(), expected.count(), "{interface:?} {events:?}");
    }
}

//! Tests with an FMI 3.0 host that has read the model description with scalar variables.

#![allow(unsafe_code)]

use std::ffi::c_void;
use std::ptr;
use std::sync::Mutex;

use crate::c_abi::{c_string, text};
use crate::call::Interface;
use crate::instance::Instance;
use crate::model::Model;
use crate::spring::Spring;
use crate::table::Layout;
use crate::v2::{self, Fmi2};
use crate::v3::*;
use crate::variable::Value;

fn token() -> std::ffi::CString {
    c_string(Spring::table().token(Layout::Scalars))
}

fn reference(name: &str) -> u32 {
    Spring::table().find(name).unwrap() + 1
}

#[derive(Default)]
struct TestHost {
    instance: Option<usize>,
    lines: Vec<(fmi3Status, String, String)>,
    /// The intermediate updates that the host has received: the time of each, and true if the host could set inputs then.
    updates: Vec<(f64, bool)>,
    /// The force that the host sets in an intermediate update, for the end of the step.
    force: Option<f64>,
    wish: Option<f64>,
    statuses: Vec<fmi3Status>,
    x: f64,
}

unsafe extern "C" fn log(
    environment: *mut c_void,
    status: fmi3Status,
    category: fmi3String,
    message: fmi3String,
) {
    let host = unsafe { &*environment.cast::<Mutex<TestHost>>() };
    let line = unsafe { (status, text(category).unwrap(), text(message).unwrap()) };
    host.lock().unwrap().lines.push(line);
}

unsafe extern "C" fn update(
    environment: *mut c_void,
    time: f64,
    set: fmi3Boolean,
    get: fmi3Boolean,
    finished: fmi3Boolean,
    can_return: fmi3Boolean,
    requested: *mut fmi3Boolean,
    at: *mut f64,
) {
    let host = unsafe { &*environment.cast::<Mutex<TestHost>>() };
    let (instance, force, wish) = {
        let mut host = host.lock().unwrap();
        host.updates.push((time, set != 0));
        (host.instance.unwrap() as *mut c_void, host.force, host.wish)
    };
    assert_eq!((get, finished), (1 - set, 1 - set));
    unsafe {
        assert_eq!((*requested, *at), (0, time), "by default the return time is the present time");
        let mut statuses = Vec::new();
        if set != 0
            && let Some(force) = force
        {
            let set = fmi3SetFloat64::<Spring>(instance, &reference("F"), 1, &force, 1);
            statuses.push(set);
            if can_return != 0
                && let Some(wish) = wish
            {
                (*requested, *at) = (1, wish);
            }
        }
        let mut x = 0.0;
        if get != 0 {
            statuses.push(fmi3GetFloat64::<Spring>(instance, &reference("x"), 1, &mut x, 1));
        }
        let mut host = host.lock().unwrap();
        host.x = x;
        host.statuses.append(&mut statuses);
    }
}

fn stepping(early_return: bool) -> (fmi3Instance, Box<Mutex<TestHost>>) {
    let host = Box::new(Mutex::new(TestHost::default()));
    let environment = ptr::from_ref(&*host).cast_mut().cast();
    let required = [reference("F"), reference("x")];
    let instance = unsafe {
        let instance = fmi3InstantiateCoSimulation::<Spring>(
            c"one".as_ptr(),
            token().as_ptr(),
            ptr::null(),
            0,
            1,
            0,
            early_return.into(),
            required.as_ptr(),
            required.len(),
            environment,
            Some(log),
            Some(update),
        );
        assert!(!instance.is_null(), "{:?}", host.lock().unwrap().lines);
        assert_eq!(
            fmi3EnterInitializationMode::<Spring>(instance, 0, f64::NAN, 0.0, 0, f64::NAN),
            fmi3OK
        );
        assert_eq!(fmi3ExitInitializationMode::<Spring>(instance), fmi3OK);
        instance
    };
    host.lock().unwrap().instance = Some(instance as usize);
    (instance, host)
}

fn step(instance: fmi3Instance, at: f64, h: f64) -> (fmi3Status, bool, f64) {
    let (mut event, mut terminate, mut early, mut last) = (7, 7, 7, f64::NAN);
    let status = unsafe {
        fmi3DoStep::<Spring>(instance, at, h, 1, &mut event, &mut terminate, &mut early, &mut last)
    };
    assert_eq!((event, terminate), (0, 0));
    (status, early == 1, last)
}

/// A host of FMI 3.0 changes an input within a step by intermediate updates; a host of FMI 2.0 sets the derivative of the
/// input before the step.
#[test]
fn a_ramp_by_intermediate_update_is_the_input_derivative_of_fmi_2_to_the_last_bit() {
    let (instance, host) = stepping(false);
    let mut two = Instance::<Spring, Fmi2>::new(Interface::CoSimulation);
    two.enter_initialization_mode().unwrap();
    two.exit_initialization_mode().unwrap();
    let (force, x) = (reference("F") - 1, reference("x") - 1);
    let at_knot = |n: usize| 0.3 * (n as f64).sin();
    for n in 0..20 {
        let (at, h) = (n as f64 * 0.1, 0.1);
        host.lock().unwrap().force = Some(at_knot(n + 1));
        assert_eq!(step(instance, at, h), (fmi3OK, false, at + h));
        let slope = (at_knot(n + 1) - at_knot(n)) / h;
        two.set(&v2::SET_REAL, &[force], |_| Value::Real(at_knot(n))).unwrap();
        two.set_input_derivatives(&[force], &[1], &[slope]).unwrap();
        two.do_step(at, h).unwrap();
        let Value::Real(expected) = two.get(&v2::GET_REAL, x).unwrap() else { panic!() };
        let host = host.lock().unwrap();
        assert_eq!(host.x.to_bits(), expected.to_bits(), "step {n}");
        assert_eq!(host.updates[2 * n..], [(at + h, true), (at + h, false)]);
    }
    let mut force_now = 0.0;
    unsafe {
        fmi3GetFloat64::<Spring>(instance, &reference("F"), 1, &mut force_now, 1);
        assert_eq!(force_now, at_knot(20), "the ramp must end at the value that the host has set");
        // If the host sets no force in the intermediate update, the input is constant.
        host.lock().unwrap().force = None;
        assert_eq!(step(instance, 20.0 * 0.1, 0.1).0, fmi3OK);
        fmi3GetFloat64::<Spring>(instance, &reference("F"), 1, &mut force_now, 1);
        assert_eq!(force_now, at_knot(20));
        fmi3FreeInstance::<Spring>(instance);
    }
    assert!(host.lock().unwrap().statuses.iter().all(|status| *status == fmi3OK));
}

/// If the requested time is before the step or NaN, the step ends at once; if it is after the end of the step, it has no
/// effect.
#[test]
fn a_step_returns_early_at_the_time_that_the_host_requests_if_it_allows_early_return() {
    let (instance, host) = stepping(true);
    host.lock().unwrap().force = Some(1.0);
    host.lock().unwrap().wish = Some(0.25);
    assert_eq!(step(instance, 0.0, 1.0), (fmi3OK, true, 0.25));
    // A requested return before the start of the step, or at NaN, ends the step at once.
    for wish in [0.1, f64::NAN] {
        host.lock().unwrap().wish = Some(wish);
        assert_eq!(step(instance, 0.25, 0.5), (fmi3OK, true, 0.25));
    }
    // A requested return after the end of the step has no effect.
    host.lock().unwrap().wish = Some(9.0);
    assert_eq!(step(instance, 0.25, 0.5), (fmi3OK, false, 0.75));
    unsafe { fmi3FreeInstance::<Spring>(instance) };
    let (instance, host) = stepping(false);
    host.lock().unwrap().force = Some(1.0);
    host.lock().unwrap().wish = Some(0.25);
    assert_eq!(step(instance, 0.0, 1.0), (fmi3OK, false, 1.0), "early return is not allowed");
    unsafe { fmi3FreeInstance::<Spring>(instance) };
}

/// In an intermediate update the host lets the force rise to 1, but also requests a return at once. In the next step the host
/// sets no force, so that the force stays 0.
#[test]
fn after_an_early_return_at_the_start_of_a_step_inputs_keep_their_values() {
    let (instance, host) = stepping(true);
    (host.lock().unwrap().force, host.lock().unwrap().wish) = (Some(1.0), Some(-1.0));
    assert_eq!(step(instance, 0.0, 0.5), (fmi3OK, true, 0.0));
    (host.lock().unwrap().force, host.lock().unwrap().wish) = (None, None);
    assert_eq!(step(instance, 0.0, 0.5), (fmi3OK, false, 0.5));
    let mut force = 9.0;
    unsafe {
        fmi3GetFloat64::<Spring>(instance, &reference("F"), 1, &mut force, 1);
        fmi3FreeInstance::<Spring>(instance);
    }
    assert_eq!(force, 0.0);
}

/// The host sets the force to NaN. fmi3SetFloat64 returns fmi3Discard, and fmi3DoStep still reaches the end of the step.
#[test]
fn a_value_out_of_range_in_intermediate_update_is_discarded_and_the_step_goes_on() {
    let (instance, host) = stepping(false);
    host.lock().unwrap().force = Some(f64::NAN);
    assert_eq!(step(instance, 0.0, 0.5), (fmi3OK, false, 0.5));
    assert_eq!(host.lock().unwrap().statuses, [fmi3Discard, fmi3OK]);
    unsafe {
        // F is not among the variables that the host requires within steps, but between steps it can be set.
        assert_eq!(fmi3SetFloat64::<Spring>(instance, &reference("F"), 1, &2.0, 1), fmi3OK);
        fmi3FreeInstance::<Spring>(instance);
    }
}

#[test]
fn after_an_error_values_can_be_read_and_the_instance_reset() {
    let (instance, host) = stepping(false);
    unsafe {
        let mut x = 0.0;
        assert_eq!(fmi3GetFloat64::<Spring>(instance, &999, 1, &mut x, 1), fmi3Error);
        assert_eq!(step(instance, 0.0, 0.1).0, fmi3Error, "terminated");
        assert_eq!(fmi3GetFloat64::<Spring>(instance, &reference("x"), 1, &mut x, 1), fmi3OK);
        assert_eq!(fmi3Terminate::<Spring>(instance), fmi3Error);
        assert_eq!(fmi3Reset::<Spring>(instance), fmi3OK);
        assert_eq!(fmi3EnterInitializationMode::<Spring>(instance, 0, 0.0, 5.0, 0, 0.0), fmi3OK);
        fmi3FreeInstance::<Spring>(instance);
    }
    let lines = &host.lock().unwrap().lines;
    assert!(lines[0].2.contains("fmi3GetFloat64") && lines[0].2.contains("999"), "{lines:?}");
    assert!(lines.iter().all(|(_, category, _)| category == "logStatusError"), "{lines:?}");
}

#[test]
fn counts_types_and_value_references_are_checked_before_any_value_is_written() {
    for case in 0..6 {
        let (instance, host) = stepping(false);
        let references = [reference("x"), reference("v")];
        let mut room = [7.0; 3];
        let status = unsafe {
            match case {
                0 => {
                    fmi3GetFloat64::<Spring>(instance, references.as_ptr(), 2, room.as_mut_ptr(), 1)
                }
                1 => {
                    fmi3GetFloat64::<Spring>(instance, references.as_ptr(), 2, room.as_mut_ptr(), 3)
                }
                2 => fmi3GetFloat64::<Spring>(instance, &0, 1, room.as_mut_ptr(), 1),
                3 => fmi3GetInt32::<Spring>(instance, references.as_ptr(), 1, &mut 0, 1),
                4 => fmi3GetFloat64::<Spring>(instance, ptr::null(), 1, room.as_mut_ptr(), 1),
                _ => fmi3GetString::<Spring>(instance, references.as_ptr(), 1, ptr::null_mut(), 1),
            }
        };
        assert_eq!((status, room), (fmi3Error, [7.0; 3]), "{case}");
        let said = host.lock().unwrap().lines[0].2.clone();
        let part = ["allowed: 2", "allowed: 2", "reference 0", "Float64", "NULL", "Float64"][case];
        assert!(said.contains(part), "{said}");
        unsafe { fmi3FreeInstance::<Spring>(instance) };
    }
    // Calls without references succeed for types that no variable has, and arrays may then be NULL.
    let (instance, _host) = stepping(false);
    unsafe {
        assert_eq!(fmi3GetUInt64::<Spring>(instance, ptr::null(), 0, ptr::null_mut(), 0), fmi3OK);
        assert_eq!(fmi3SetFloat64::<Spring>(instance, ptr::null(), 0, ptr::null(), 0), fmi3OK);
        assert_eq!(fmi3GetClock::<Spring>(instance, ptr::null(), 0, ptr::null_mut()), fmi3OK);
        fmi3FreeInstance::<Spring>(instance);
    }
}

#[test]
fn the_independent_variable_time_can_be_read_and_not_set() {
    let (instance, _host) = stepping(false);
    let (mut time, reference) = (0.0, time_reference::<Spring>());
    step(instance, 0.0, 0.125);
    unsafe {
        assert_eq!(fmi3GetFloat64::<Spring>(instance, &reference, 1, &mut time, 1), fmi3OK);
        assert_eq!(time, 0.125);
        assert_eq!(fmi3SetFloat64::<Spring>(instance, &reference, 1, &time, 1), fmi3Error);
        fmi3FreeInstance::<Spring>(instance);
    }
}

#[test]
fn instantiation_fails_without_name_or_token_or_for_scheduled_execution() {
    let host = Mutex::new(TestHost::default());
    let environment = ptr::from_ref(&host).cast_mut().cast();
    let guid = c_string(Spring::table().guid());
    let (name, token) = (c"one".as_ptr(), token());
    let make = |name, token, logger: fmi3LogMessageCallback| unsafe {
        fmi3InstantiateModelExchange::<Spring>(name, token, ptr::null(), 0, 0, environment, logger)
    };
    assert!(make(ptr::null(), token.as_ptr(), Some(log)).is_null());
    assert!(make(name, ptr::null(), Some(log)).is_null());
    assert!(make(name, guid.as_ptr(), Some(log)).is_null(), "the GUID belongs to FMI 2.0");
    assert!(make(name, guid.as_ptr(), None).is_null());
    let scheduled = unsafe {
        fmi3InstantiateScheduledExecution::<Spring>(
            name,
            token.as_ptr(),
            ptr::null(),
            0,
            0,
            environment,
            Some(log),
            None,
            None,
            None,
        )
    };
    assert!(scheduled.is_null());
    let said = host.lock().unwrap().lines.iter().map(|line| line.2.clone()).collect::<Vec<_>>();
    for (said, part) in
        said.iter().zip(["instanceName", "NULL", "expected", "no Scheduled Execution"])
    {
        assert!(said.contains(part), "{said}");
    }
    assert_eq!(said.len(), 4);
    let made = make(name, token.as_ptr(), None);
    assert!(!made.is_null());
    unsafe { fmi3FreeInstance::<Spring>(made) };
}

#[test]
fn log_messages_of_fmi_3_double_number_signs_and_keep_percent_signs() {
    let host = Mutex::new(TestHost::default());
    let environment = ptr::from_ref(&host).cast_mut().cast();
    unsafe {
        let made = fmi3InstantiateModelExchange::<Spring>(
            c"one".as_ptr(),
            c"#1 %s".as_ptr(),
            ptr::null(),
            0,
            0,
            environment,
            Some(log),
        );
        assert!(made.is_null());
    }
    let said = &host.lock().unwrap().lines[0].2;
    assert!(said.contains("##1 %s;"), "{said}");
}

#[test]
fn fmi3_get_version_returns_3_0() {
    assert_eq!(unsafe { text(fmi3GetVersion::<Spring>()) }, Some("3.0".into()));
}

#[test]
fn a_directional_derivative_with_wrong_numbers_of_seeds_or_sensitivities_is_refused() {
    for (seed, sensitivity, said) in
        [(2, 2, "nSeed = 2 (allowed: 1)"), (1, 1, "nSensitivity = 1 (allowed: 2)")]
    {
        let (instance, host) = stepping(false);
        let (unknowns, known) = (["a", "der(v)"].map(reference), reference("F"));
        let (numbers, mut room) = ([1.0; 2], [7.0; 2]);
        let status = unsafe {
            fmi3GetDirectionalDerivative::<Spring>(
                instance,
                unknowns.as_ptr(),
                2,
                &known,
                1,
                numbers.as_ptr(),
                seed,
                room.as_mut_ptr(),
                sensitivity,
            )
        };
        unsafe { fmi3FreeInstance::<Spring>(instance) };
        assert_eq!((status, room), (fmi3Error, [7.0; 2]));
        let lines = &host.lock().unwrap().lines;
        assert!(lines[0].2.contains(said), "{lines:?}");
    }
}

/// For the matrix J of partial derivatives and random vectors v and w, w.(J v) must equal (J^T w).v. The two sides sum the
/// same products in different orders.
#[test]
fn adjoint_derivatives_are_the_transpose_of_directional_derivatives() {
    let (instance, _host) = stepping(false);
    let unknowns = ["a", "der(x)", "der(v)"].map(reference);
    let knowns = [reference("F"), reference("x"), reference("v"), time_reference::<Spring>()];
    let (seed, weights) = ([0.3, -1.2, 0.7, 5.0], [0.9, 0.4, -2.0]);
    let (mut forward, mut adjoint) = ([0.0; 3], [0.0; 4]);
    unsafe {
        assert_eq!(
            fmi3GetDirectionalDerivative::<Spring>(
                instance,
                unknowns.as_ptr(),
                3,
                knowns.as_ptr(),
                4,
                seed.as_ptr(),
                4,
                forward.as_mut_ptr(),
                3,
            ),
            fmi3OK
        );
        assert_eq!(
            fmi3GetAdjointDerivative::<Spring>(
                instance,
                unknowns.as_ptr(),
                3,
                knowns.as_ptr(),
                4,
                weights.as_ptr(),
                3,
                adjoint.as_mut_ptr(),
                4,
            ),
            fmi3OK
        );
        fmi3FreeInstance::<Spring>(instance);
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (one, other) = (dot(&weights, &forward), dot(&adjoint, &seed));
    assert!((one - other).abs() <= 1e-13 * one.abs(), "{one} {other}");
    assert_eq!(adjoint[3], 0.0, "outputs depend on time only through states and inputs");
}

#[test]
fn initial_values_have_their_own_dependencies_until_initialization_ends() {
    let host = Mutex::new(TestHost::default());
    unsafe {
        let instance = model_exchange(&host);
        let of = |instance, name: &str| {
            let mut count = 99;
            let status = fmi3GetNumberOfVariableDependencies::<Spring>(
                instance,
                reference(name),
                &mut count,
            );
            assert_eq!(status, fmi3OK, "{:?}", host.lock().unwrap().lines);
            let (mut elements, mut known) = (vec![9; count], vec![0; count]);
            let (mut known_elements, mut kinds) = (vec![9; count], vec![9; count]);
            let status = fmi3GetVariableDependencies::<Spring>(
                instance,
                reference(name),
                elements.as_mut_ptr(),
                known.as_mut_ptr(),
                known_elements.as_mut_ptr(),
                kinds.as_mut_ptr(),
                count,
            );
            assert_eq!(status, fmi3OK);
            assert!(elements.iter().chain(&known_elements).all(|element| *element == 1));
            assert!(kinds.iter().all(|kind| *kind == fmi3Dependent));
            known
        };
        let mut expected = ["F", "x0", "m", "d", "k"].map(reference);
        expected.sort_unstable();
        let mut found = of(instance, "a");
        found.sort_unstable();
        assert_eq!(found, expected);
        fmi3EnterInitializationMode::<Spring>(instance, 0, 0.0, 0.0, 0, 0.0);
        fmi3ExitInitializationMode::<Spring>(instance);
        let mut found = of(instance, "a");
        found.sort_unstable();
        let mut expected = ["F", "x", "v"].map(reference);
        expected.sort_unstable();
        assert_eq!(found, expected);
        assert_eq!(of(instance, "der(x)"), [reference("v")]);
        assert_eq!(of(instance, "f"), []);
        fmi3FreeInstance::<Spring>(instance);
    }
}

fn model_exchange(host: &Mutex<TestHost>) -> fmi3Instance {
    let environment = ptr::from_ref(host).cast_mut().cast();
    let (name, token) = (c"one".as_ptr(), token());
    unsafe {
        fmi3InstantiateModelExchange::<Spring>(
            name,
            token.as_ptr(),
            ptr::null(),
            0,
            0,
            environment,
            Some(log),
        )
    }
}

#[test]
fn a_model_exchange_instance_passes_through_its_modes_and_single_states_can_be_set() {
    let host = Mutex::new(TestHost::default());
    unsafe {
        let instance = model_exchange(&host);
        assert_eq!(fmi3EnterConfigurationMode::<Spring>(instance), fmi3OK);
        assert_eq!(fmi3ExitConfigurationMode::<Spring>(instance), fmi3OK);
        let mut count = 0;
        assert_eq!(fmi3GetNumberOfContinuousStates::<Spring>(instance, &mut count), fmi3OK);
        assert_eq!(count, 2);
        assert_eq!(fmi3GetNumberOfEventIndicators::<Spring>(instance, &mut count), fmi3OK);
        assert_eq!(count, 0);
        fmi3EnterInitializationMode::<Spring>(instance, 0, 0.0, 1.0, 0, 0.0);
        assert_eq!(fmi3ExitInitializationMode::<Spring>(instance), fmi3OK);
        let mut b = [9; 5];
        let [b0, b1, b2, b3, b4] = &mut b;
        let mut next = 0.0;
        let status = fmi3UpdateDiscreteStates::<Spring>(instance, b0, b1, b2, b3, b4, &mut next);
        assert_eq!((status, b, next), (fmi3OK, [0; 5], 0.0));
        assert_eq!(fmi3EvaluateDiscreteStates::<Spring>(instance), fmi3OK);
        assert_eq!(fmi3EnterContinuousTimeMode::<Spring>(instance), fmi3OK);
        // If a state is set by its reference, its derivative changes.
        let force = [0.25, 0.5];
        let references = ["x", "v"].map(reference);
        assert_eq!(
            fmi3SetFloat64::<Spring>(instance, references.as_ptr(), 2, force.as_ptr(), 2),
            fmi3OK
        );
        let mut x = [0.0; 2];
        assert_eq!(fmi3GetContinuousStates::<Spring>(instance, x.as_mut_ptr(), 2), fmi3OK);
        assert_eq!(x, force);
        assert_eq!(
            fmi3GetContinuousStateDerivatives::<Spring>(instance, x.as_mut_ptr(), 2),
            fmi3OK
        );
        assert_eq!(x[0], 0.5);
        assert_eq!(
            fmi3SetFloat64::<Spring>(instance, references.as_ptr(), 1, &f64::NAN, 1),
            fmi3Discard
        );
        // The host may go back to the event, but not to an earlier time.
        assert_eq!(fmi3SetTime::<Spring>(instance, 2.0), fmi3OK);
        assert_eq!(fmi3SetTime::<Spring>(instance, 1.0), fmi3OK);
        assert_eq!(fmi3SetTime::<Spring>(instance, 0.9), fmi3Error);
        fmi3FreeInstance::<Spring>(instance);
    }
}

#[test]
fn only_real_outputs_and_independent_inputs_have_intermediate_updates() {
    let vessels = crate::tests::vessels::TABLE.variables.iter();
    let seen = vessels.filter(|variable| has_intermediate_update(variable));
    let names: Vec<_> = seen.map(|variable| variable.name).collect();
    assert_eq!(names, ["level", "sum", "q", "w"]);
}

#[test]
fn every_byte_except_0_counts_as_true_in_an_fmi3_boolean() {
    assert_eq!(size_of::<fmi3Boolean>(), 1);
    let (instance, _host) = stepping(false);
    unsafe {
        assert_eq!(fmi3SetDebugLogging::<Spring>(instance, 0xFF, 0, ptr::null()), fmi3OK);
        fmi3FreeInstance::<Spring>(instance);
        fmi3FreeInstance::<Spring>(ptr::null_mut());
    }
}

#[test]
fn initialization_sets_start_and_stop_time_and_undefined_times_may_be_nan() {
    let host = Mutex::new(TestHost::default());
    unsafe {
        let instance = fmi3InstantiateCoSimulation::<Spring>(
            c"one".as_ptr(),
            token().as_ptr(),
            ptr::null(),
            0,
            0,
            0,
            0,
            ptr::null(),
            0,
            ptr::from_ref(&host).cast_mut().cast(),
            Some(log),
            None,
        );
        let begin = |tolerance, at, stop_defined, stop| {
            fmi3EnterInitializationMode::<Spring>(instance, 0, tolerance, at, stop_defined, stop)
        };
        assert_eq!(
            begin(f64::NAN, 2.0, 1, 1.0),
            fmi3Error,
            "the stop time is before the start time"
        );
        assert_eq!(fmi3Reset::<Spring>(instance), fmi3OK);
        assert_eq!(begin(f64::NAN, 2.0, 1, 3.0), fmi3OK);
        assert_eq!(fmi3ExitInitializationMode::<Spring>(instance), fmi3OK);
        assert_eq!(step(instance, 2.0, 1.0), (fmi3OK, false, 3.0));
        assert_eq!(step(instance, 3.0, 0.1).0, fmi3Error, "the step would pass the stop time");
        assert_eq!(fmi3Reset::<Spring>(instance), fmi3OK);
        assert_eq!(begin(f64::NAN, -1.0, 0, f64::NAN), fmi3OK);
        assert_eq!(fmi3ExitInitializationMode::<Spring>(instance), fmi3OK);
        assert_eq!(step(instance, -1.0, 5.0), (fmi3OK, false, 4.0));
        fmi3FreeInstance::<Spring>(instance);
    }
}

/// The program fmusim 0.8 calls fmi3GetNumberOfContinuousStates and fmi3GetNumberOfEventIndicators in continuous-time mode,
/// in which the standard does not allow them.
#[test]
fn fmusim_may_ask_for_the_numbers_of_states_and_indicators_in_continuous_time_mode() {
    let host = Mutex::new(TestHost::default());
    unsafe {
        let instance = model_exchange(&host);
        fmi3EnterInitializationMode::<Spring>(instance, 0, 0.0, 0.0, 0, 0.0);
        fmi3ExitInitializationMode::<Spring>(instance);
        assert_eq!(fmi3EnterContinuousTimeMode::<Spring>(instance), fmi3OK);
        let mut count = 9;
        assert_eq!(fmi3GetNumberOfContinuousStates::<Spring>(instance, &mut count), fmi3OK);
        assert_eq!(count, 2);
        assert_eq!(fmi3GetNumberOfEventIndicators::<Spring>(instance, &mut count), fmi3OK);
        assert_eq!(count, 0);
        fmi3FreeInstance::<Spring>(instance);
    }
}

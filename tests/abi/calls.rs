//! Calls the packed FMU through its C interface, as hosts do, correctly and incorrectly. Every test uses the
//! file that users get.

use std::collections::BTreeSet;
use std::fs::File;

use host::description::Type;
use host::fmi2::{CallError, Callbacks, Fmu, Instance, Message, Status};
use object::Object;
use pack::packed_for_tests;

const DO_STEP_STATUS: i32 = 0;
const PENDING_STATUS: i32 = 1;
const LAST_SUCCESSFUL_TIME: i32 = 2;
const TERMINATED: i32 = 3;

fn open() -> Fmu {
    Fmu::open(packed_for_tests()).unwrap()
}

fn reference(fmu: &Fmu, name: &str) -> u32 {
    fmu.description().variable(name).unwrap().reference
}

fn stepping<'fmu>(fmu: &'fmu Fmu, settings: &[(&str, &str)]) -> Instance<'fmu> {
    stepping_from(fmu, 0.0, None, settings)
}

fn stepping_from<'fmu>(
    fmu: &'fmu Fmu,
    start: f64,
    stop: Option<f64>,
    settings: &[(&str, &str)],
) -> Instance<'fmu> {
    let mut instance = fmu.instantiate("one").unwrap();
    for (name, value) in settings {
        instance.set(name, value).unwrap();
    }
    instance.setup_experiment(None, start, stop).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance
}

const LIVELY: &[(&str, &str)] = &[
    ("slosh.model", "spherical"),
    ("slosh.modes", "2"),
    ("init.omega", "0.05"),
    ("init.slosh_angle", "0.2"),
    ("init.slosh_angle_radial", "0.1"),
    ("wheel.enabled", "true"),
    ("imu.enabled", "true"),
];

fn all(instance: &mut Instance) -> Vec<u64> {
    let variables = &instance.fmu().description().variables;
    let each = variables.iter().map(|variable| {
        let reference = [variable.reference];
        match variable.kind() {
            Type::Real => {
                let mut value = [0.0];
                instance.get_real(&reference, &mut value).unwrap();
                value[0].to_bits()
            }
            Type::Boolean => {
                let mut value = [0];
                instance.get_boolean(&reference, &mut value).unwrap();
                value[0] as u64
            }
            _ => {
                let mut value = [0];
                instance.get_integer(&reference, &mut value).unwrap();
                value[0] as u64
            }
        }
    });
    each.collect()
}

fn state_bytes(instance: &mut Instance) -> Vec<u8> {
    let saved = instance.get_state().unwrap();
    let bytes = instance.serialize(&saved).unwrap();
    instance.free_state(saved).unwrap();
    bytes
}

fn drive(instance: &mut Instance, from: f64) {
    let torque = [reference(instance.fmu(), "tau_cmd")];
    let mut at = from;
    for (n, h) in [0.01, 0.14, 0.2, 0.05, 0.3, 0.3].into_iter().enumerate() {
        instance.set_real(&torque, &[0.03 * (n as f64 - 2.0)]).unwrap();
        instance.set_real_input_derivatives(&torque, &[1], &[0.1]).unwrap();
        instance.do_step(at, h).unwrap();
        at += h;
    }
}

#[track_caller]
fn assert_refused<T>(result: Result<T, CallError>, parts: &[&str]) {
    let Err(error) = result else { panic!("not refused") };
    assert_eq!(error.status, Status::Error, "{error}");
    let [message] = &error.messages[..] else { panic!("{:?}", error.messages) };
    assert!(message.text.starts_with(error.call), "{} is not named: {}", error.call, message.text);
    for part in parts {
        assert!(message.text.contains(part), "{part} is not in: {}", message.text);
    }
}

// ---- Archive and binary ----

fn archive() -> zip::ZipArchive<File> {
    zip::ZipArchive::new(File::open(packed_for_tests()).unwrap()).unwrap()
}

/// Every importer can unpack these two methods of zip.
#[test]
fn the_archive_begins_with_the_model_description_and_uses_only_stored_and_deflated_files() {
    let mut archive = archive();
    let mut names = BTreeSet::new();
    for n in 0..archive.len() {
        let file = archive.by_index(n).unwrap();
        let name = file.name().unwrap().into_owned();
        assert_eq!(n == 0, name == "modelDescription.xml", "{name} is number {n}");
        let plain = matches!(
            file.compression(),
            zip::CompressionMethod::Deflated | zip::CompressionMethod::Stored
        );
        assert!(plain && !file.encrypted() && !file.is_symlink(), "{name}");
        assert!(!name.contains('\\') && !name.starts_with('/') && !name.contains(".."), "{name}");
        let time = file.last_modified().unwrap();
        assert_eq!((time.year(), time.month(), time.day()), (1980, 1, 1), "{name}");
        assert!(names.insert(name.clone()), "{name} is there twice");
    }
}

#[test]
fn the_same_source_gives_the_same_archive() {
    let directory = tempfile();
    let again = directory.path().join("again.fmu");
    pack::pack(pack::HUBSLOSH, pack::Fmi::V2, &again).unwrap();
    // Cargo builds the library once for both archives, so that only the packing is compared; it must give the same bytes each
    // time.
    assert!(std::fs::read(again).unwrap() == std::fs::read(packed_for_tests()).unwrap());
}

fn tempfile() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn fmi3_functions() -> BTreeSet<String> {
    let values = "Float32 Float64 Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Boolean String Binary Clock \
                  IntervalDecimal IntervalFraction ShiftDecimal ShiftFraction FMUState";
    let values =
        values.split_whitespace().flat_map(|t| [format!("fmi3Get{t}"), format!("fmi3Set{t}")]);
    let others = "GetVersion SetDebugLogging InstantiateModelExchange InstantiateCoSimulation \
                  InstantiateScheduledExecution FreeInstance EnterInitializationMode ExitInitializationMode \
                  EnterEventMode Terminate Reset GetNumberOfVariableDependencies GetVariableDependencies \
                  FreeFMUState SerializedFMUStateSize SerializeFMUState DeserializeFMUState \
                  GetDirectionalDerivative GetAdjointDerivative EnterConfigurationMode ExitConfigurationMode \
                  EvaluateDiscreteStates UpdateDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep \
                  SetTime SetContinuousStates GetContinuousStateDerivatives GetEventIndicators \
                  GetContinuousStates GetNominalsOfContinuousStates GetNumberOfEventIndicators \
                  GetNumberOfContinuousStates EnterStepMode GetOutputDerivatives DoStep ActivateModelPartition";
    let all: BTreeSet<String> =
        values.chain(others.split_whitespace().map(|name| format!("fmi3{name}"))).collect();
    assert_eq!(all.len(), 75);
    all
}

#[test]
fn binary_exports_the_functions_of_fmi_and_nothing_else() {
    let mut archive = archive();
    let binaries: Vec<String> = archive
        .file_names()
        .flatten()
        .filter(|name| name.starts_with("binaries/"))
        .map(String::from)
        .collect();
    assert!(!binaries.is_empty());
    let expected: BTreeSet<String> = [Fmu::symbols(), Fmu::step_symbols(), Fmu::exchange_symbols()]
        .concat()
        .iter()
        .map(|s| s.to_string())
        .collect();
    assert_eq!(expected.len(), 44);
    // The library contains the functions of both versions; the model description that a host reads determines the version.
    let expected = &expected | &fmi3_functions();
    for name in binaries {
        let mut bytes = Vec::new();
        std::io::copy(&mut archive.by_name(&name).unwrap(), &mut bytes).unwrap();
        let binary = object::File::parse(&*bytes).unwrap();
        let exported: BTreeSet<String> = binary
            .exports()
            .unwrap()
            .iter()
            // In Mach-O files an underscore precedes every C name.
            .map(|export| String::from_utf8_lossy(export.name()).trim_start_matches('_').into())
            .collect();
        assert_eq!(exported, expected, "{name}");
    }
}

#[test]
fn the_binary_returns_version_2_0_and_the_types_platform_default() {
    let fmu = open();
    assert_eq!((fmu.version().as_str(), fmu.types_platform().as_str()), ("2.0", "default"));
}

#[test]
fn functions_that_are_not_supported_return_an_error_with_a_message() {
    let fmu = open();
    let mut instance = stepping(&fmu, &[]);
    assert_refused(instance.cancel_step(), &["no step is running"]);
    assert_refused(instance.get_string(&[0]), &["theta", "Real"]);
    assert_refused(instance.set_string(&[0], &["one"]), &["theta", "Real"]);
    assert_refused(instance.set_string_null(0), &["theta", "Real"]);
}

// ---- Loading, copies, threads ----

#[test]
fn the_binary_can_be_loaded_and_unloaded_many_times() {
    for _ in 0..50 {
        let fmu = open();
        let mut instance = stepping(&fmu, &[]);
        instance.do_step(0.0, 0.1).unwrap();
        // A panic hook that is still installed after unloading would point to code that is no longer loaded.
        assert_refused(instance.do_step(f64::NAN, 0.1), &[]);
    }
}

/// 20 instances of two loaded copies of HubSlosh are stepped in turns. Each must have the results of an instance that runs by
/// itself.
#[test]
fn several_copies_and_instances_do_not_disturb_each_other() {
    let (first, second) = (open(), open());
    let mut alone = stepping(&first, LIVELY);
    drive(&mut alone, 0.0);
    let expected = all(&mut alone);
    let mut instances: Vec<_> =
        [&first, &second].into_iter().cycle().take(20).map(|fmu| stepping(fmu, LIVELY)).collect();
    let torque = [reference(&first, "tau_cmd")];
    // The instances take turns: each step of `drive` is made in all of them.
    let mut at = 0.0;
    for (n, h) in [0.01, 0.14, 0.2, 0.05, 0.3, 0.3].into_iter().enumerate() {
        for instance in &mut instances {
            instance.set_real(&torque, &[0.03 * (n as f64 - 2.0)]).unwrap();
            instance.set_real_input_derivatives(&torque, &[1], &[0.1]).unwrap();
            instance.do_step(at, h).unwrap();
        }
        at += h;
    }
    for instance in &mut instances {
        assert_eq!(all(instance), expected);
    }
}

#[test]
fn instances_in_several_threads_give_the_same_bits() {
    let fmu = open();
    let run = || {
        let mut instance = stepping(&fmu, LIVELY);
        for n in 0..20 {
            drive(&mut instance, n as f64);
        }
        all(&mut instance)
    };
    let expected = run();
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(run)).collect();
        for thread in threads {
            assert_eq!(thread.join().unwrap(), expected);
        }
    });
}

#[test]
fn floating_point_state_and_working_directory_of_the_host_are_unchanged() {
    let arithmetic = || {
        let [one, three, small] = [1.0, 3.0, f64::MIN_POSITIVE].map(std::hint::black_box);
        [one / three, -one / three, small / three, 2.5f64.round_ties_even()].map(f64::to_bits)
    };
    let before = (arithmetic(), std::env::current_dir().unwrap());
    let fmu = open();
    let mut instance = stepping(&fmu, LIVELY);
    drive(&mut instance, 0.0);
    assert_eq!((arithmetic(), std::env::current_dir().unwrap()), before);
}

// ---- Making an instance ----

#[test]
fn wrong_or_missing_guid_gives_no_instance_and_a_reason() {
    let fmu = open();
    let guid = fmu.description().guid.as_str();
    for wrong in [None, Some(""), Some("{8c4e810f-3df3-4a00-8276-176fa3c9f000}"), Some("%s%n%d")] {
        let mut with = fmu.instantiation("one");
        with.guid = wrong;
        assert_refused(fmu.instantiate_with(&with), &[wrong.unwrap_or("NULL"), guid]);
    }
}

#[test]
fn missing_name_and_unknown_type_give_no_instance_and_a_reason() {
    let fmu = open();
    let mut with = fmu.instantiation("one");
    with.kind = 2;
    assert_refused(fmu.instantiate_with(&with), &["fmuType = 2"]);
    for wrong in [None, Some(""), Some(" \t")] {
        let mut with = fmu.instantiation("one");
        with.name = wrong;
        assert_refused(fmu.instantiate_with(&with), &["instanceName"]);
    }
}

#[test]
fn instantiation_without_callbacks_returns_null_and_does_not_crash() {
    let fmu = open();
    let mut with = fmu.instantiation("one");
    with.callbacks = Callbacks::Null;
    assert!(fmu.instantiate_with(&with).is_err());
}

#[test]
fn every_callback_and_the_resource_location_may_be_null() {
    let fmu = open();
    let mut with = fmu.instantiation("one");
    with.callbacks = Callbacks::Empty;
    with.resources = None;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance.do_step(0.0, 0.1).unwrap();
    // The step is refused although there is no logger to which the error could be reported.
    assert!(instance.do_step(0.0, -0.1).is_err());
    // If fmi2Instantiate fails, there is no logger for the reason, either.
    with.guid = None;
    assert!(fmu.instantiate_with(&with).is_err());
}

/// The host frees the callback structure, the instance name and the GUID after fmi2Instantiate, so that later calls must not
/// read them.
#[test]
fn callbacks_name_and_guid_need_not_outlive_fmi2_instantiate() {
    let fmu = open();
    let mut with = fmu.instantiation("one");
    with.callbacks = Callbacks::Fleeting;
    let mut instance = fmu.instantiate_with(&with).unwrap();
    assert_refused(instance.do_step(0.0, 0.1), &["fmi2DoStep"]);
}

#[test]
fn an_instance_name_may_contain_any_characters() {
    let fmu = open();
    for name in ["%s%n", "Ünwucht 液", &"x".repeat(10_000)] {
        fmu.instantiate(name).unwrap();
    }
}

#[test]
fn every_function_handles_a_null_instance() {
    let fmu = open();
    fmu.free_null_instance();
    for (call, status) in fmu.calls_with_null_instance() {
        assert_eq!(status, Status::Error, "{call}");
    }
}

// ---- The logger ----

#[test]
fn log_messages_are_valid_text_in_a_declared_category() {
    let fmu = open();
    let xml = {
        let mut text = String::new();
        let mut archive = archive();
        let mut file = archive.by_name("modelDescription.xml").unwrap();
        std::io::Read::read_to_string(&mut file, &mut text).unwrap();
        text
    };
    let mut instance = stepping(&fmu, &[]);
    let errors = [
        instance.do_step(0.0, f64::NAN).unwrap_err(),
        instance.get_real(&[u32::MAX], &mut [0.0]).unwrap_err(),
        instance.get_real_null(1).unwrap_err(),
        instance.real_status(PENDING_STATUS).unwrap_err(),
        instance.set_debug_logging(true, &["%s%n Ü"]).unwrap_err(),
    ];
    for Message { category, text, status } in errors.iter().flat_map(|e| &e.messages) {
        assert!(xml.contains(&format!("<Category name=\"{category}\"")), "{category}");
        assert!(!text.is_empty() && text.trim() == text && !text.contains('\u{fffd}'), "{text:?}");
        assert!(!text.contains('\n'), "{text:?}");
        assert!(matches!(status, Status::Error | Status::Discard));
    }
}

#[test]
fn a_percent_sign_in_a_message_is_not_a_printf_format() {
    let fmu = open();
    let mut instance = fmu.instantiate("one").unwrap();
    let text = "%s%s%s%n%d %";
    assert_refused(instance.set_debug_logging(true, &[text]), &[text, "logStatusError"]);
}

/// For each choice of log categories the host makes a wrong step and a wrong query.
#[test]
fn only_messages_of_the_enabled_log_categories_are_logged() {
    let fmu = open();
    let mut instance = stepping(&fmu, &[]);
    let messages = |instance: &mut Instance| {
        instance.do_step(0.0, -1.0).unwrap_err().messages.len()
            + 10 * instance.real_status(PENDING_STATUS).unwrap_err().messages.len()
    };
    instance.set_debug_logging(true, &[]).unwrap();
    assert_eq!(messages(&mut instance), 11, "no categories means all");
    instance.set_debug_logging(true, &["logStatusDiscard"]).unwrap();
    assert_eq!(messages(&mut instance), 10);
    instance.set_debug_logging(true, &["logStatusError", "logStatusFatal"]).unwrap();
    assert_eq!(messages(&mut instance), 1);
    instance.set_debug_logging(false, &[]).unwrap();
    assert_eq!(messages(&mut instance), 0);
    instance.set_debug_logging(true, &["logAll"]).unwrap();
    assert_eq!(messages(&mut instance), 11);
}

/// With the category logEvents the FMU logs a message for each time at which the hub comes to rest or begins to slip.
#[test]
fn stick_and_slip_are_logged_on_request() {
    let fmu = open();
    let mut instance = stepping(&fmu, &[("init.omega", "0.1"), ("slosh.model", "frozen")]);
    instance.set_debug_logging(true, &["logEvents"]).unwrap();
    let torque = [reference(&fmu, "tau_cmd")];
    instance.do_step(0.0, 20.0).unwrap();
    instance.set_real(&torque, &[-0.1]).unwrap();
    instance.do_step(20.0, 1.0).unwrap();
    let messages = instance.take_messages();
    let texts: Vec<_> = messages.iter().map(|m| m.text.as_str()).collect();
    assert!(messages.iter().all(|m| (m.status, m.category.as_str()) == (Status::Ok, "logEvents")));
    assert_eq!(texts.len(), 2, "{texts:?}");
    assert!(texts[0].contains("stuck at t = "), "{texts:?}");
    assert!(texts[1].contains("broke away backwards at t = 20.0 s"), "{texts:?}");
}

/// The host enables logging and sets a tolerance. It must receive no warning, because some hosts treat everything except
/// fmi2OK as a failure.
#[test]
fn a_correct_run_logs_no_message() {
    let fmu = open();
    let mut instance = fmu.instantiate("one").unwrap();
    for (name, value) in LIVELY {
        instance.set(name, value).unwrap();
    }
    instance.setup_experiment(Some(1e-6), 0.0, Some(10.0)).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    for n in 0..10 {
        drive(&mut instance, n as f64);
        all(&mut instance);
    }
    instance.terminate().unwrap();
    assert_eq!(instance.take_messages(), []);
}

// ---- The order of calls ----

/// The message of fmi2DoStep before initialisation, for example, names the state of the instance and the states in which the
/// call is allowed.
#[test]
fn calls_in_the_wrong_state_are_refused_with_call_and_state() {
    let fmu = open();
    let torque = [reference(&fmu, "tau_cmd")];
    let omega = [reference(&fmu, "omega")];

    let mut instance = fmu.instantiate("one").unwrap();
    let before = state_bytes(&mut instance);
    assert_refused(
        instance.exit_initialization_mode(),
        &["\"instantiated\"", "initialization mode"],
    );
    assert_refused(instance.do_step(0.0, 0.1), &["\"instantiated\"", "stepping"]);
    assert_refused(instance.terminate(), &["\"instantiated\""]);
    assert_refused(instance.cancel_step(), &["\"instantiated\""]);
    assert_refused(instance.get_real(&omega, &mut [0.0]), &["omega", "\"instantiated\""]);
    assert_refused(
        instance.get_real_output_derivatives(&omega, &[1], &mut [0.0]),
        &["\"instantiated\""],
    );
    assert_refused(
        instance.get_directional_derivative(&omega, &torque, &[1.0]),
        &["\"instantiated\""],
    );
    assert_refused(instance.enter_event_mode(), &["\"instantiated\"", "Model Exchange"]);
    assert_eq!(state_bytes(&mut instance), before);

    instance.enter_initialization_mode().unwrap();
    assert_refused(instance.enter_initialization_mode(), &["\"initialization mode\""]);
    assert_refused(instance.setup_experiment(None, 0.0, None), &["\"initialization mode\""]);
    assert_refused(instance.do_step(0.0, 0.1), &["\"initialization mode\""]);
    assert_refused(instance.terminate(), &["\"initialization mode\""]);

    instance.exit_initialization_mode().unwrap();
    assert_refused(instance.enter_initialization_mode(), &["\"stepping\""]);
    assert_refused(instance.exit_initialization_mode(), &["\"stepping\""]);
    assert_refused(instance.setup_experiment(None, 0.0, None), &["\"stepping\""]);
    assert_refused(instance.set_time(1.0), &["\"stepping\"", "Model Exchange"]);
    assert_refused(instance.new_discrete_states().map(drop), &["\"stepping\"", "Model Exchange"]);

    instance.terminate().unwrap();
    assert_refused(instance.terminate(), &["\"terminated\""]);
    assert_refused(instance.do_step(0.0, 0.1), &["\"terminated\""]);
    assert_refused(instance.set_real(&torque, &[0.1]), &["\"terminated\""]);
    all(&mut instance);
}

#[test]
fn parameters_and_inputs_can_be_set_before_and_after_setup_experiment() {
    let fmu = open();
    let mut instance = fmu.instantiate("one").unwrap();
    instance.set("tau_cmd", "0.01").unwrap();
    instance.set("tank.h", "0.05").unwrap();
    instance.setup_experiment(None, 0.0, None).unwrap();
    instance.set("tau_cmd", "0.02").unwrap();
    instance.set("tank.h", "0.06").unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.set("tau_cmd", "0.03").unwrap();
    instance.set("tank.h", "0.07").unwrap();
    all(&mut instance);
    instance.exit_initialization_mode().unwrap();
    assert_eq!(instance.real("tau_cmd").unwrap(), 0.03);
    assert_eq!(instance.real("tank.h").unwrap(), 0.07);
}

#[test]
fn fmi2_setup_experiment_may_be_left_out() {
    let fmu = open();
    let mut instance = fmu.instantiate("one").unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance.do_step(0.0, 0.1).unwrap();
}

#[test]
fn null_pointers_are_accepted_only_for_zero_values_to_get_or_set() {
    let fmu = open();
    let mut instance = stepping(&fmu, &[]);
    instance.get_real_null(0).unwrap();
    instance.set_real_null(0).unwrap();
    assert_refused(instance.get_real_null(1), &["vr is NULL"]);
    assert_refused(instance.set_real_null(1), &["vr is NULL"]);
}

#[test]
fn unknown_mistyped_and_computed_variables_are_refused_by_name() {
    let fmu = open();
    let mut instance = stepping(&fmu, &[]);
    let [omega, stuck, regime, height] =
        ["omega", "stuck", "regime", "tank.h"].map(|n| [reference(&fmu, n)]);
    assert_refused(instance.get_real(&[u32::MAX], &mut [0.0]), &["4294967295"]);
    assert_refused(instance.get_real(&stuck, &mut [0.0]), &["stuck", "Boolean"]);
    assert_refused(instance.get_integer(&omega, &mut [0]), &["omega", "Real"]);
    assert_refused(instance.get_boolean(&regime, &mut [0]), &["regime", "Integer"]);
    assert_refused(instance.set_boolean(&omega, &[1]), &["omega", "Real"]);
    assert_refused(instance.set_integer(&regime, &[1]), &["regime", "computed"]);
    assert_refused(instance.set_real(&height, &[0.1]), &["tank.h", "fixed", "stepping"]);
}

#[test]
fn every_boolean_that_is_not_0_is_true_and_reads_1() {
    let fmu = open();
    let mut instance = fmu.instantiate("one").unwrap();
    let enabled = [reference(&fmu, "imu.enabled")];
    for (set, got) in [(2, 1), (0, 0), (-1, 1), (i32::MIN, 1)] {
        instance.set_boolean(&enabled, &[set]).unwrap();
        let mut value = [7];
        instance.get_boolean(&enabled, &mut value).unwrap();
        assert_eq!(value, [got]);
    }
}

// ---- Parameters and inputs ----

/// HubSlosh gets five wrong parameters. fmi2ExitInitializationMode returns one error that names all five, and succeeds after
/// the values are corrected.
#[test]
fn all_wrong_parameters_are_reported_at_once_and_can_be_corrected() {
    let fmu = open();
    let mut instance = fmu.instantiate("one").unwrap();
    let bad = [("tank.h", "-1"), ("tank.d", "NaN"), ("init.theta", "inf"), ("slosh.modes", "11")];
    for (name, value) in bad {
        instance.set(name, value).unwrap();
    }
    instance.set_integer(&[reference(&fmu, "slosh.model")], &[0]).unwrap();
    instance.enter_initialization_mode().unwrap();
    assert_refused(
        instance.exit_initialization_mode(),
        &[
            "tank.h = -1.0 m (allowed: 0.0001 m to 100.0 m)",
            "tank.d = NaN m",
            "init.theta = inf rad",
            "slosh.modes = 11 (allowed: 1 to 10)",
            "slosh.model = 0 (allowed: 1 frozen, 2 linear",
        ],
    );
    let good = [("tank.h", "0.1"), ("tank.d", "0.163"), ("init.theta", "0"), ("slosh.modes", "1")];
    for (name, value) in good {
        instance.set(name, value).unwrap();
    }
    instance.set("slosh.model", "linear").unwrap();
    instance.exit_initialization_mode().unwrap();
}

/// The smallest wheel speed is set above the initial wheel speed. The message contains the names of both.
#[test]
fn parameters_that_contradict_each_other_are_reported() {
    let fmu = open();
    let mut instance = fmu.instantiate("one").unwrap();
    instance.set("wheel.speed_min", "1000").unwrap();
    instance.enter_initialization_mode().unwrap();
    assert_refused(instance.exit_initialization_mode(), &["wheel.speed_0", "wheel.speed_min"]);
}

/// The inputs are set to NaN, to infinity and to a too large value. The message contains the allowed range, and the state of
/// HubSlosh stays as it was.
#[test]
fn inputs_that_are_nan_or_out_of_range_are_refused_by_the_call_that_sets_them() {
    let fmu = open();
    let mut instance = stepping(&fmu, LIVELY);
    let before = state_bytes(&mut instance);
    let inputs = ["tau_cmd", "tau_ext", "g_axial"].map(|n| reference(&fmu, n));
    // The range is so narrow that every number which the plant computes from an allowed value is finite; ±1e308
    // did not ensure this.
    for (n, value, allowed) in [
        (0, f64::NAN, "-1000000000000.0 N.m to 1000000000000.0 N.m"),
        (0, 1e308, "-1000000000000.0 N.m to 1000000000000.0 N.m"),
        (1, f64::NEG_INFINITY, "-1000000000000.0 N.m to 1000000000000.0 N.m"),
        (1, -1e308, "-1000000000000.0 N.m to 1000000000000.0 N.m"),
        (2, -1.0, "0.0 m/s2 to 1000000000.0 m/s2"),
        (2, 1e308, "0.0 m/s2 to 1000000000.0 m/s2"),
    ] {
        let mut values = [0.1, 0.2, 9.0];
        values[n] = value;
        let name = ["tau_cmd", "tau_ext", "g_axial"][n];
        assert_refused(instance.set_real(&inputs, &values), &[name, allowed]);
        for slope in [f64::NAN, 1e308, -1e308] {
            let set = instance.set_real_input_derivatives(&inputs[n..=n], &[1], &[slope]);
            let unit = ["N.m/s", "N.m/s", "m/s2/s"][n];
            assert_refused(set, &[name, &format!("{slope:?} (allowed: -1e"), unit]);
        }
        assert_refused(
            instance.set_real_input_derivatives(&inputs[n..=n], &[2], &[0.1]),
            &["order 2"],
        );
    }
    assert_eq!(state_bytes(&mut instance), before);
}

// ---- Steps ----

/// HubSlosh refuses a communication step that is not positive or not finite, and a communication point that is not the
/// present time.
#[test]
fn steps_whose_length_is_not_positive_are_refused_and_change_nothing() {
    let fmu = open();
    let mut instance = stepping(&fmu, LIVELY);
    instance.do_step(0.0, 0.5).unwrap();
    let before = state_bytes(&mut instance);
    for h in [0.0, -0.0, -0.1, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_refused(instance.do_step(0.5, h), &["communicationStepSize"]);
    }
    for at in [0.0, 0.4, 0.51, 1e9, f64::NAN, f64::INFINITY] {
        assert_refused(instance.do_step(at, 0.1), &["currentCommunicationPoint"]);
    }
    assert_eq!(state_bytes(&mut instance), before);
    instance.do_step(0.5, 0.1).unwrap();
}

/// Hosts compute n h, or add up h. Both differ from the exact time by a few units in the last place.
#[test]
fn communication_points_off_by_rounding_are_reached_exactly() {
    let fmu = open();
    let h = 0.1;
    for start in [0.0, -100.0, 1e6] {
        let steps = 1000;
        let stop = start + f64::from(steps) * h;
        let mut instance = stepping_from(&fmu, start, Some(stop), &[]);
        let mut added = start;
        for n in 0..steps {
            let at = if n % 2 == 0 { start + f64::from(n) * h } else { added };
            instance.do_step(at, h).unwrap();
            assert_eq!(instance.real_status(LAST_SUCCESSFUL_TIME).unwrap(), at + h);
            added += h;
        }
    }
}

#[test]
fn a_step_past_the_stop_time_is_refused() {
    let fmu = open();
    let mut instance = stepping_from(&fmu, 0.0, Some(1.0), &[]);
    instance.do_step(0.0, 0.75).unwrap();
    assert_refused(instance.do_step(0.75, 0.26), &["stop time"]);
    instance.do_step(0.75, 0.25).unwrap();
    assert_refused(instance.do_step(1.0, 1e-3), &["stop time"]);
}

/// All times are multiples of powers of two, so that they are exact.
#[test]
fn the_motion_does_not_depend_on_the_start_time() {
    let fmu = open();
    let run = |start: f64| {
        let mut instance = stepping_from(&fmu, start, None, &[("init.slosh_angle", "0.2")]);
        for n in 0..64 {
            instance.do_step(start + f64::from(n) * 0.125, 0.125).unwrap();
        }
        ["theta", "slosh_angle", "energy"].map(|name| instance.real(name).unwrap().to_bits())
    };
    let expected = run(0.0);
    for start in [-1024.0, -2.0, 65536.0] {
        assert_eq!(run(start), expected, "{start}");
    }
}

#[test]
fn an_experiment_with_invalid_times_is_refused() {
    let fmu = open();
    let mut instance = fmu.instantiate("one").unwrap();
    assert_refused(instance.setup_experiment(None, f64::NAN, None), &["startTime"]);
    assert_refused(instance.setup_experiment(None, 1.0, Some(0.0)), &["stopTime"]);
    assert_refused(instance.setup_experiment(Some(0.0), 0.0, None), &["tolerance"]);
    instance.setup_experiment(Some(1e-6), 0.0, Some(1.0)).unwrap();
}

/// A torque of 1e12 N·m for 1e200 s needs more internal steps than `solver.max_steps` allows. fmi2DoStep returns fmi2Error,
/// the instance keeps the state that it had before the step, and it can only be terminated or reset.
#[test]
fn a_step_that_needs_too_many_internal_steps_is_an_error() {
    let fmu = open();
    // The hub rotates so fast, and the step is so long, that no allowed number of integration steps is enough.
    let mut instance = stepping(&fmu, &[("slosh.model", "frozen"), ("tau_cmd", "1e12")]);
    assert_refused(
        instance.do_step(0.0, 1e200),
        &["failed: the step stopped at", "solver.max_steps"],
    );
    assert_eq!(instance.status(DO_STEP_STATUS).unwrap(), 3, "fmi2Error");
    assert_eq!(instance.real_status(LAST_SUCCESSFUL_TIME).unwrap(), 0.0);
    assert_eq!(instance.real("theta").unwrap(), 0.0, "stands where it was");
    assert_refused(instance.do_step(0.0, 0.1), &["\"step failed\""]);
    instance.terminate().unwrap();
}

/// fmi2GetStatus and fmi2GetRealStatus return fmi2OK and the end of the step. Queries about pending steps are refused.
#[test]
fn the_status_of_the_last_step_can_be_queried() {
    let fmu = open();
    let mut instance = stepping(&fmu, &[]);
    instance.do_step(0.0, 0.25).unwrap();
    assert_eq!(instance.status(DO_STEP_STATUS).unwrap(), 0, "fmi2OK");
    assert_eq!(instance.real_status(LAST_SUCCESSFUL_TIME).unwrap(), 0.25);
    assert!(!instance.boolean_status(TERMINATED).unwrap());
    // These queries have no answer, for example because no step is ever pending.
    let unanswered = [
        instance.string_status(PENDING_STATUS).unwrap_err(),
        instance.integer_status(DO_STEP_STATUS).unwrap_err(),
        instance.status(77).unwrap_err(),
    ];
    for error in unanswered {
        assert_eq!(error.status, Status::Discard, "{error}");
    }
}

// ---- Reset, end, saved states ----

#[test]
fn a_reset_in_any_instance_state_gives_the_bits_of_a_new_instance() {
    let fmu = open();
    let mut fresh = fmu.instantiate("one").unwrap();
    let expected = state_bytes(&mut fresh);
    let mut initializing = fmu.instantiate("one").unwrap();
    initializing.set("tank.h", "NaN").unwrap();
    initializing.setup_experiment(Some(1e-5), 3.0, Some(4.0)).unwrap();
    initializing.enter_initialization_mode().unwrap();
    let mut stepped = stepping_from(&fmu, 5.0, Some(9.0), LIVELY);
    drive(&mut stepped, 5.0);
    let mut terminated = stepping(&fmu, LIVELY);
    terminated.terminate().unwrap();
    let mut failed = stepping(&fmu, &[("slosh.model", "frozen"), ("tau_cmd", "1e12")]);
    failed.do_step(0.0, 1e200).unwrap_err();
    for mut instance in [fresh, initializing, stepped, terminated, failed] {
        instance.reset().unwrap();
        assert_eq!(state_bytes(&mut instance), expected);
        // The reset instance behaves like a new one.
        let mut other = stepping(&fmu, LIVELY);
        for (name, value) in LIVELY {
            instance.set(name, value).unwrap();
        }
        instance.setup_experiment(None, 0.0, None).unwrap();
        instance.enter_initialization_mode().unwrap();
        instance.exit_initialization_mode().unwrap();
        drive(&mut instance, 0.0);
        drive(&mut other, 0.0);
        assert_eq!(state_bytes(&mut instance), state_bytes(&mut other));
    }
}

#[test]
fn values_of_a_terminated_instance_can_still_be_read() {
    let fmu = open();
    let mut instance = stepping(&fmu, LIVELY);
    drive(&mut instance, 0.0);
    let last = all(&mut instance);
    instance.terminate().unwrap();
    assert_eq!(all(&mut instance), last);
}

#[test]
fn a_saved_state_continues_bit_for_bit_also_in_a_new_instance() {
    let fmu = open();
    for model in ["frozen", "linear", "planar", "spherical", "liquid"] {
        let mut instance = fmu.instantiate("one").unwrap();
        for (name, value) in LIVELY {
            instance.set(name, value).unwrap();
        }
        instance.set("slosh.model", model).unwrap();
        instance.enter_initialization_mode().unwrap();
        instance.exit_initialization_mode().unwrap();
        drive(&mut instance, 0.0);
        let saved = instance.get_state().unwrap();
        let bytes = instance.serialize(&saved).unwrap();
        let here = all(&mut instance);
        drive(&mut instance, 1.0);
        let there = all(&mut instance);

        instance.set_state(&saved).unwrap();
        assert_eq!(all(&mut instance), here, "{model}");
        drive(&mut instance, 1.0);
        assert_eq!(all(&mut instance), there, "{model}");
        instance.free_state(saved).unwrap();

        let elsewhere = open();
        let mut other = elsewhere.instantiate("other").unwrap();
        let read = other.deserialize(&bytes).unwrap();
        other.set_state(&read).unwrap();
        assert_eq!(all(&mut other), here, "{model}");
        drive(&mut other, 1.0);
        assert_eq!(all(&mut other), there, "{model}");
        other.free_state(read).unwrap();
    }
}

#[test]
fn a_handle_of_a_saved_state_can_be_reused_and_a_null_handle_can_be_freed() {
    let fmu = open();
    let mut instance = stepping(&fmu, LIVELY);
    let mut saved = instance.get_state().unwrap();
    drive(&mut instance, 0.0);
    let here = all(&mut instance);
    instance.get_state_into(&mut saved).unwrap();
    drive(&mut instance, 1.0);
    instance.set_state(&saved).unwrap();
    assert_eq!(all(&mut instance), here);
    instance.free_state(saved).unwrap();
    instance.free_state_null().unwrap();
    assert_refused(instance.set_state_null(), &["FMUstate is NULL"]);
}

/// fmusim 0.0.39 passes the handle itself. If the FMU refused it, this program would end its run with an error.
#[test]
fn a_saved_state_can_be_freed_by_its_handle_or_by_the_address_of_the_handle() {
    let fmu = open();
    let mut instance = stepping(&fmu, &[]);
    let saved = instance.get_state().unwrap();
    instance.do_step(0.0, 0.1).unwrap();
    instance.set_state(&saved).unwrap();
    instance.free_state_itself(saved).unwrap();
    instance.do_step(0.0, 0.1).unwrap();
}

#[test]
fn bytes_that_are_not_a_saved_state_are_refused() {
    let fmu = open();
    let mut instance = stepping(&fmu, LIVELY);
    drive(&mut instance, 0.0);
    let bytes = state_bytes(&mut instance);
    assert!(bytes.starts_with(b"FMUstate"));
    assert!(bytes.windows(38).any(|w| w == fmu.description().guid.as_bytes()), "carries the GUID");
    assert_refused(instance.deserialize(&[]).map(drop), &[]);
    assert_refused(instance.deserialize(&[0; 200]).map(drop), &["not a saved state"]);
    assert_refused(instance.deserialize(&bytes[..bytes.len() - 1]).map(drop), &["bytes"]);
    assert_refused(instance.deserialize(&[&bytes[..], &[0]].concat()).map(drop), &["bytes"]);
    let mut rng = fastrand::Rng::with_seed(5);
    for _ in 0..1000 {
        let mut damaged = bytes.clone();
        damaged[rng.usize(..bytes.len())] ^= 1 << rng.u8(..8);
        assert_refused(instance.deserialize(&damaged).map(drop), &[]);
    }
    assert_eq!(state_bytes(&mut instance), bytes);
}

//! Rules of calls: a library around our binary that misbehaves (shim.c), and descriptions that do not match the binary.

use std::collections::BTreeSet;

use check::Severity;
use host::fmi2::PLATFORM;
use host::fmu::Fmu;
use zip::CompressionMethod;

use crate::common::{
    binary, broken_rules, cases, changed, check_bytes, check_rules, compiled, keep, our_files,
    our_fmu_with_description, with, xml, zipped,
};

/// Returns our FMU with one fault, which a shim around its binary makes. `word` is the name of the fault in shim.c.
fn misbehaving(word: &str) -> Vec<u8> {
    let name = binary();
    let folder = format!("binaries/{PLATFORM}");
    let ours = our_files().iter().find(|(n, _)| *n == name).unwrap().1.clone();
    let mut files = with(&name, compiled("shim.c", &[]));
    let text = xml();
    let guid = text.split("guid=\"").nth(1).unwrap().split('"').next().unwrap();
    files.push((format!("{folder}/real.so"), ours));
    let tunable = text.split("name=\"friction.b\" valueReference=\"").nth(1).unwrap();
    let tunable = tunable.split('"').next().unwrap();
    let said = format!("{word} {guid} {tunable}\n");
    files.push((format!("{folder}/misbehaviour.txt"), said.into_bytes()));
    zipped(&files, CompressionMethod::Stored)
}

/// The library passes the address of one of its own variables to the logger. A host that used this pointer would follow it
/// into the variable.
#[test]
fn an_fmu_that_hands_its_own_pointer_to_the_logger_breaks_one_rule_and_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Mutant.fmu");
    std::fs::write(&path, misbehaving("hands_its_own")).unwrap();
    let report = check_rules(&path, &["log", "instantiate", "life.order", "values.unknown"], 60.0);
    assert_eq!(broken_rules(&report), BTreeSet::from(["log.environment"]), "{}", report.text());
    let fmu = Fmu::open(&path).unwrap();
    let begin = |friction: &str| -> anyhow::Result<()> {
        let mut instance = fmu.instantiate("a")?;
        instance.set("friction.b", friction)?;
        instance.enter_initialization_mode(None, 0.0, None)?;
        instance.exit_initialization_mode()?;
        Ok(instance.do_step(0.0, 1.0)?)
    };
    begin("0.1").unwrap();
    // The host nevertheless assigns the message to the instance that was called.
    let refused = begin("-1").unwrap_err();
    assert!(format!("{refused:#}").contains("friction.b = -1"), "{refused:#}");
}

/// Faults that the library shim.c adds to the binary of HubSlosh, each with the rule that must report the fault.
const MISBEHAVIOURS: &[(&str, &str)] = &[
    ("crashes_when_loaded", "load.opens"),
    ("types_platform", "load.types_platform"),
    ("version", "load.version"),
    ("never_initialises", "load.initialises"),
    ("endless_events", "exchange.event_iteration"),
    ("past_events", "exchange.next_event_time"),
    ("terminates", "exchange.terminate_simulation"),
    ("terminates", "steps.terminated"),
    ("swallows_small_steps", "steps.small"),
    ("refuses_tunables", "values.tunable"),
    ("drops_tunables", "values.tunable"),
    ("ignores_tunables", "values.tunable_effect"),
    ("writes_past", "host.arrays"),
    ("writes_past_vectors", "host.arrays"),
    ("remembers_loads", "load.again"),
    ("any_guid", "instantiate.guid"),
    ("swallows_messages", "instantiate.guid"),
    ("needs_resources", "instantiate.arguments"),
    ("needs_callbacks", "instantiate.callbacks"),
    ("keeps_callbacks", "instantiate.copies"),
    ("free_null_crashes", "instantiate.free_null"),
    ("null_crashes", "instantiate.null"),
    ("counts_steps", "life.instances"),
    ("counts_instances", "life.deterministic"),
    ("resets_not_all", "life.reset"),
    ("no_reset_when_terminated", "life.reset_anywhere"),
    ("terminate_fails", "life.terminate"),
    ("any_order", "life.order"),
    ("ends_the_process", "life.order"),
    ("prints", "host.silent"),
    ("rounds_up", "host.untouched"),
    ("changes_directory", "host.untouched"),
    ("leaks_files", "host.untouched"),
    ("frees_nothing", "host.memory"),
    ("leaks_in_steps", "host.memory"),
    ("keeps_states", "host.memory"),
    ("hands_its_own", "log.environment"),
    ("text_as_format", "log.percent"),
    ("odd_category", "log.categories"),
    ("line_break", "log.text"),
    ("not_utf8", "log.text"),
    ("chatters", "log.quiet"),
    ("wants_categories", "log.switch"),
    ("other_start", "values.start"),
    ("not_a_number", "values.readable"),
    ("true_is_two", "values.booleans"),
    ("forgets_settings", "values.round_trip"),
    ("wants_variables", "values.nothing"),
    ("any_reference", "values.unknown"),
    ("crashes_on_unknown", "values.unknown"),
    ("swallows_messages", "values.unknown"),
    ("any_type", "values.wrong_type"),
    ("sets_anything", "values.fixed"),
    ("sets_anything", "values.computed"),
    ("any_number", "values.not_a_number"),
    ("warns", "values.no_warning"),
    ("discards", "steps.run"),
    ("any_step", "steps.size"),
    ("any_point", "steps.point"),
    ("exact_time", "steps.wobble"),
    ("starts_at_zero", "steps.start_time"),
    ("passes_stop", "steps.stop_time"),
    ("no_tolerance", "steps.tolerance"),
    ("counts_steps", "steps.cut"),
    ("any_number", "steps.inputs"),
    ("no_slopes", "steps.inputs"),
    ("ignores_slopes", "steps.input_derivatives"),
    ("wrong_slopes", "steps.output_derivatives"),
    ("opposite_slopes", "steps.output_derivatives"),
    ("restores_nothing", "states.rollback"),
    ("one_handle_only", "states.handle"),
    ("reads_no_bytes", "states.bytes"),
    ("wants_setup", "states.bytes"),
    ("reads_garbage", "states.garbage"),
    ("saves_only_running", "states.modes"),
    ("wrong_directions", "dependencies.directional"),
    ("frozen_indicators", "exchange.events"),
    ("hides_jumps", "exchange.values_changed"),
    ("other_nominals", "exchange.nominals"),
    ("zero_nominals", "exchange.vectors"),
    ("any_length", "exchange.lengths"),
    ("other_order", "exchange.variables"),
];

/// The library around the binary of HubSlosh makes one fault at a time, for example it returns a wrong status.
#[cfg(target_os = "linux")]
#[test]
fn binaries_that_misbehave_are_reported_by_the_intended_rule() {
    let rules: BTreeSet<&str> = MISBEHAVIOURS.iter().map(|(_, rule)| *rule).collect();
    let rules: Vec<&str> = rules.into_iter().collect();
    // Without a misbehaviour the library breaks no rule.
    keep("none", &misbehaving("none"), &[]);
    let report = check_bytes(&misbehaving("none"), &rules);
    assert_eq!(broken_rules(&report), BTreeSet::new(), "{}", report.text());
    let mut untold = Vec::new();
    for (word, rule) in MISBEHAVIOURS {
        keep(word, &misbehaving(word), &[rule]);
        let report = check_bytes(&misbehaving(word), &[rule]);
        if !broken_rules(&report).contains(rule) {
            untold.push(format!("{word} is not told by {rule}: {}", report.text()));
        }
    }
    assert!(untold.is_empty(), "{}", untold.join("\n"));
}

/// The library writes four bytes behind or eight bytes before an array of fmi2GetRealOutputDerivatives, or into the array of
/// orders, which an FMU may only read.
#[cfg(target_os = "linux")]
#[test]
fn a_finding_about_an_array_says_where_the_fmu_has_written() {
    for (word, array, fault) in [
        ("writes_past_orders", "order, ", "it writes up to 4 bytes past its end"),
        ("writes_before", "value, ", "it writes up to 8 bytes before its beginning"),
        ("writes_orders", "order, ", "it changes an array that it may only read"),
    ] {
        let report = check_bytes(&misbehaving(word), &["host.arrays"]);
        let place = format!("fmi2GetRealOutputDerivatives, {array}");
        let all: Vec<_> = report.all().collect();
        assert!(!all.is_empty(), "{word}");
        for (_, finding) in all {
            let is_there = finding.place.starts_with(&place) && finding.text.starts_with(fault);
            assert!(is_there, "{word}: {}", report.text());
        }
    }
}

#[cfg(target_os = "linux")]
fn severities(word: &str, rule: &str) -> (Vec<Severity>, String) {
    let report = check_bytes(&misbehaving(word), &[rule]);
    (report.all().map(|(_, finding)| finding.severity).collect(), report.text())
}

#[cfg(target_os = "linux")]
#[test]
fn a_wrong_answer_is_an_error_and_a_crash_in_a_call_with_undefined_effect_is_a_warning() {
    for (word, rule, meant) in [
        ("opposite_slopes", "steps.output_derivatives", Severity::Error),
        ("true_is_two", "values.booleans", Severity::Error),
        ("prints", "host.silent", Severity::Error),
        ("free_null_crashes", "instantiate.free_null", Severity::Error),
        // a crash, and a call that never returns, with arguments whose effect the standard does not define
        ("null_crashes", "instantiate.null", Severity::Warning),
        ("hangs_at_nan", "steps.size", Severity::Warning),
    ] {
        let (found, text) = severities(word, rule);
        // A Boolean that is read as 2 also gives a second finding, a warning, because the FMU stores a 2.
        let worst = found.iter().min();
        assert_eq!(worst, Some(&meant), "{word}: {text}");
    }
    // start values of which only the last bit differs from the file
    let (found, text) = severities("last_bit_of_start", "values.start");
    assert!(found.is_empty(), "{text}");
    // a tunable parameter that is declared as fixed
    let fixed = changed("name=\"friction.b\"", "tunable", "fixed");
    let report = check_bytes(&fixed, &["values.fixed"]);
    let all: Vec<_> = report.all().collect();
    let [(_, finding)] = &all[..] else { panic!("{}", report.text()) };
    assert_eq!(finding.severity, Severity::Error);
    assert!(finding.place.contains("friction.b"), "{}", report.text());
    // A binary that accepts all changes of fixed parameters is too lax, and none of the parameters is in fact tunable.
    let (found, text) = severities("sets_anything", "values.fixed");
    assert!(!found.is_empty() && found.iter().all(|s| *s == Severity::Warning), "{text}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_call_without_end_is_a_finding_and_not_the_end_of_the_check() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("Mutant.fmu");
    std::fs::write(&path, misbehaving("hangs_at_zero")).unwrap();
    // a time limit that is long enough for the preceding calls on a busy machine
    let report = check_rules(&path, &["steps.size", "load.version"], 5.0);
    let all: Vec<_> = report.all().collect();
    let [(rule, finding)] = &all[..] else { panic!("{}", report.text()) };
    assert_eq!((rule.id, finding.severity), ("steps.size", Severity::Error));
    assert!(finding.place.contains("communicationStepSize = 0.0"), "{}", finding.place);
    assert!(finding.text.contains("have not ended after 4 s"), "{}", finding.text);
}

/// Faults in modelDescription.xml. The cells of a line are: name of the case, text that precedes the change, old
/// text, new text, and the rule that must report the fault.
const WORDS: &str = r#"
another start | name="hub.I" | start="0.322414" | start="0.322415" | values.start
a min that is refused | name="hub.I" | min="1e-6" | min="-1" | values.limits
a max that is passed | name="hub.I" | max="1000000000000.0" | max="10" | values.limits
a fixed parameter that is tunable | name="friction.b" | tunable | fixed | values.fixed
a max narrower than the binary's | name="hub.I" | max="1000000000000.0" | max="900000000000.0" | values.limits_exact
a max of an Integer narrower than the binary's | name="slosh.modes" | max="10" | max="9" | values.limits_exact
an output beyond its max | name="omega" | unit="rad/s" | unit="rad/s" max="-1" | values.in_range
a fixed parameter declared tunable | name="hub.I" | variability="fixed" | variability="tunable" | values.tunable
derivatives of outputs to an order that is not there | <CoSimulation | maxOutputDerivativeOrder="1" | maxOutputDerivativeOrder="2" | steps.output_derivative_order
another GUID | <fmiModelDescription | guid="{ | guid="{x | load.instance
"#;

/// The model description of HubSlosh is changed, for example two value references are exchanged, and the binary is not
/// changed.
#[test]
fn descriptions_that_do_not_fit_the_binary_are_reported() {
    // the value references of theta and omega
    let references = {
        let text = xml();
        let text = text
            .replacen("valueReference=\"0\"", "valueReference=\"_\"", 1)
            .replacen("valueReference=\"1\"", "valueReference=\"0\"", 1)
            .replacen("valueReference=\"_\"", "valueReference=\"1\"", 1);
        our_fmu_with_description(text)
    };
    let unknown = |list: &str, name: &str, from: &str, to: &str| {
        let text = xml();
        let index = text[..text.find(&format!("name=\"{name}\"")).unwrap()]
            .matches("<ScalarVariable")
            .count();
        let at = text.find(list).unwrap();
        let after = format!("<Unknown index=\"{index}\"");
        let at = at + text[at..].find(&after).unwrap();
        let (head, tail) = text.split_at(at);
        assert!(tail.starts_with(&after) && tail[..tail.find("/>").unwrap()].contains(from));
        let text = format!("{head}{}", tail.replacen(from, to, 1));
        our_fmu_with_description(text)
    };
    let without_line = |word: &str| {
        let text = xml();
        let line = text.lines().find(|line| line.contains(word)).unwrap();
        our_fmu_with_description(text.replacen(line, "", 1))
    };
    let words = cases::<5>(WORDS).into_iter();
    let words = words.map(|[name, after, from, to, rule]| (name, changed(after, from, to), rule));
    let mut wrong = Vec::new();
    let others = [
        ("an item that is missing", without_line("<Item name=\"liquid\""), "values.items"),
        (
            "a constant factor that is none",
            unknown(
                "<Outputs>",
                "omega_dot",
                "Kind=\"dependent dependent",
                "Kind=\"dependent constant",
            ),
            "dependencies.kinds",
        ),
        (
            "a fixed factor that is none",
            unknown(
                "<Derivatives>",
                "der(omega)",
                "Kind=\"dependent dependent",
                "Kind=\"dependent fixed",
            ),
            "dependencies.kinds",
        ),
        ("swapped references", references, "exchange.variables"),
        (
            "no binary",
            zipped(&with(&binary(), b"text".to_vec()), CompressionMethod::Stored),
            "load.opens",
        ),
        // The first input on which omega_dot depends is tau_cmd.
        (
            "a hidden feedthrough",
            unknown("<Outputs>", "omega_dot", "dependencies=\"", "dependencies=\"\" x=\""),
            "dependencies.running",
        ),
        (
            "a false feedthrough",
            unknown("<Outputs>", "theta", "dependencies=\"", "dependencies=\"13 "),
            "dependencies.feedthrough",
        ),
        (
            "a hidden start",
            unknown("<InitialUnknowns>", "omega", "dependencies=\"", "dependencies=\"\" x=\""),
            "dependencies.initial",
        ),
    ];
    for (name, bytes, rule) in words.chain(others) {
        keep(name, &bytes, &[rule]);
        let report = check_bytes(&bytes, &[rule]);
        if !broken_rules(&report).contains(rule) {
            wrong.push(format!("{name} is not told by {rule}: {}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn an_fmu_that_gives_no_instance_is_reported_once() {
    let report = check_bytes(
        &changed("<fmiModelDescription", "guid=\"{", "guid=\"{x"),
        &["load", "life", "values", "steps"],
    );
    assert_eq!(broken_rules(&report), BTreeSet::from(["load.instance"]), "{}", report.text());
}

//! Tests of the messages that the host's logger receives.

use std::cell::RefCell;
use std::rc::Rc;

use super::*;
use crate::c_abi::{self, Log, Status};
use crate::log::{Category, Filter, Topic, categories};
use crate::version::Version;

type Line = (Status, String, String);

fn log() -> (Log, Rc<RefCell<Vec<Line>>>) {
    let lines = Rc::new(RefCell::new(Vec::new()));
    let to = lines.clone();
    let logger = move |status, category: &std::ffi::CStr, message: &std::ffi::CStr| {
        let text = |c: &std::ffi::CStr| c.to_str().unwrap().to_string();
        to.borrow_mut().push((status, text(category), text(message)));
    };
    (Log::new(Some(Box::new(logger))), lines)
}

fn line(status: Status, category: &str, message: &str) -> Line {
    (status, category.into(), message.into())
}

#[test]
fn the_log_of_a_failure_has_its_status_and_category() {
    let (mut log, lines) = log();
    for (severity, status, category) in [
        (Severity::Discard, c_abi::DISCARD, "logStatusDiscard"),
        (Severity::Error, c_abi::ERROR, "logStatusError"),
        (Severity::Fatal, c_abi::FATAL, "logStatusFatal"),
    ] {
        log.report(&Fault { severity, text: "100 %, \0 and all".into() });
        assert_eq!(lines.take(), [line(status, category, "100 %,   and all")]);
    }
    log.filter = Filter::NONE;
    log.report(&Fault { severity: Severity::Fatal, text: String::new() });
    assert!(lines.take().is_empty());
    // If the host has no logger, a report has no effect.
    Log::new(None).report(&Fault { severity: Severity::Fatal, text: String::new() });
}

#[test]
fn on_request_a_step_logs_its_number_of_events_and_the_last_one() {
    let (mut log, lines) = log();
    let mut instance = started(CS, &[("z", 3.0)]);
    set(&mut instance, "z", 1.0).unwrap();
    instance.do_step(0.0, 0.5).unwrap();
    log.report_event(Fmi2::DO_STEP, 0, &instance);
    assert!(lines.take().is_empty());
    log.filter = Filter::ALL;
    log.report_event(Fmi2::DO_STEP, 0, &instance);
    let message = "fmi2DoStep: valve closes at 0.5 s";
    assert_eq!(lines.take(), [line(c_abi::OK, "logEvents", message)]);
    log.report_event(Fmi2::DO_STEP, -1, &instance);
    let message = "fmi2DoStep: valve closes at 0.5 s, the last of 2 events in this call";
    assert_eq!(lines.take(), [line(c_abi::OK, "logEvents", message)]);
    log.report_event(Fmi2::DO_STEP, 1, &instance);
    assert!(lines.take().is_empty());
}

#[test]
fn warnings_concern_the_parameters_at_the_start_of_the_motion() {
    let mut instance = fresh(ME);
    set(&mut instance, "leak", 6.0).unwrap();
    set(&mut instance, "start.level[2]", 8.0).unwrap();
    assert!(instance.warnings().is_empty());
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    set(&mut instance, "z", 1.5).unwrap();
    instance.enter_event_mode().unwrap();
    let warning = "leak 6 of 6, levels [8.0, 3.0], platform at 1.5 m";
    assert_eq!(instance.warnings(), [warning]);
    let (mut log, lines) = log();
    log.report_warnings(&instance);
    assert_eq!(lines.take(), [line(c_abi::WARNING, "logStatusWarning", warning)]);
    log.filter = Filter::NONE;
    log.report_warnings(&instance);
    assert!(lines.take().is_empty());
    assert!(started(CS, &[]).warnings().is_empty());
}

#[test]
fn parameters_without_effect_that_differ_from_their_start_values_are_named_with_the_reason() {
    let with = |values: &[(&str, f64)]| {
        let mut instance = fresh(CS);
        instance.set(&SET_BOOLEAN, &[reference("has_lid")], |_| Value::Boolean(true)).unwrap();
        for (name, x) in values {
            match *name {
                "number" | "gauges" => {
                    let value = Value::Integer(*x as i32);
                    instance.set(&SET_INTEGER, &[reference(name)], |_| value).unwrap();
                }
                _ => set(&mut instance, name, *x).unwrap(),
            }
        }
        instance.enter_initialization_mode().unwrap();
        instance.exit_initialization_mode().unwrap();
        instance.warnings()
    };
    assert!(with(&[]).is_empty());
    assert_eq!(with(&[("number", 4.0)]), ["number has no effect: has_lid is true"]);
    let both = ["start.level[1], gauges have no effect: has_lid is true"];
    assert_eq!(with(&[("gauges", 7.0), ("start.level[1]", 4.5), ("start.level[2]", 4.5)]), both);
}

#[test]
fn a_warning_about_the_hosts_inputs_is_logged_once() {
    let (mut log, lines) = log();
    let mut instance = continuous(&[]);
    log.report_step_warning(&instance);
    assert!(lines.take().is_empty());
    instance.set_time(2.0).unwrap();
    assert_eq!(instance.step_warning(), Some("the host's steps are long"));
    log.filter = Filter::NONE;
    log.report_step_warning(&instance);
    log.filter = Filter::FAILURES;
    log.report_step_warning(&instance);
    log.report_step_warning(&instance);
    let expected = line(c_abi::WARNING, "logStatusWarning", "the host's steps are long");
    assert_eq!(lines.take(), [expected]);
}

#[test]
fn log_categories_are_the_standards_and_include_events_only_if_the_model_has_events() {
    let described = |all: Vec<Category>| -> Vec<(&str, String)> {
        all.into_iter().map(|c| (c.name, c.description)).collect()
    };
    let all = described(categories::<_, Fmi2>(&TABLE));
    let expected = [
        ("logEvents", "The valve moves"),
        (
            "logStatusWarning",
            "Warnings about parameters and inputs, such as values for which the model is not valid",
        ),
        ("logStatusDiscard", "Why a call returned fmi2Discard"),
        ("logStatusError", "Why a call returned fmi2Error"),
        ("logStatusFatal", "Why a call returned fmi2Fatal"),
        ("logAll", "All of the above"),
    ];
    assert_eq!(all, expected.map(|(name, description)| (name, description.to_string())));
    let without = described(categories::<_, Fmi2>(Spring::table()));
    assert_eq!(without, all[1..]);
}

#[test]
fn only_messages_in_log_categories_that_the_host_names_are_logged() {
    let all = [
        Topic::Event,
        Topic::Warning,
        Topic::Failure(Severity::Discard),
        Topic::Failure(Severity::Error),
        Topic::Failure(Severity::Fatal),
    ];
    let wanted = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
        Filter::from_categories(&names, &TABLE).map(|filter| all.map(|topic| filter.wants(topic)))
    };
    assert_eq!(wanted(&[]), Ok([true; 5]));
    assert_eq!(wanted(&["logAll"]), Ok([true; 5]));
    assert_eq!(wanted(&["logEvents", "logStatusError"]), Ok([true, false, false, true, false]));
    assert_eq!(
        wanted(&["logStatusWarning", "logStatusDiscard"]),
        Ok([false, true, true, false, false])
    );
    assert_eq!(
        wanted(&["a", "logEvents", "b"]),
        Err("unknown log category \"a\", \"b\"; known: logEvents, logStatusWarning, logStatusDiscard, \
             logStatusError, logStatusFatal, logAll"
            .into())
    );
    let events = Filter::from_categories(&["logEvents".into()], Spring::table());
    assert!(events.unwrap_err().ends_with(
        "known: logStatusWarning, logStatusDiscard, \
         logStatusError, logStatusFatal, logAll"
    ));
    assert_eq!(all.map(|topic| Filter::FAILURES.wants(topic)), [false, true, true, true, true]);
    assert_eq!(all.map(|topic| Filter::NONE.wants(topic)), [false; 5]);
}

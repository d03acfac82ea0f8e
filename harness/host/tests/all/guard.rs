use files::bug;
use host::guard::{Cause, Limits, Output, enter, run};

/// Argument with which a test starts the test program again as the guarded process. Rust's test
/// runner reads the argument as the name of a test that does not exist, and therefore runs no
/// test.
const CHILD: &str = "guarded_process";

fn end_of_child(name: &str, work: fn()) -> Cause {
    if std::env::args().any(|argument| argument == CHILD) {
        bug::keep_panics();
        enter().unwrap();
        work();
    }
    let name = format!("guard::{name}");
    let call = std::time::Duration::from_secs(60);
    let limits = Limits { call, total: Some(call), memory: 1 << 40, file: 1 << 40 };
    let program = std::env::current_exe().unwrap();
    let arguments = ["--exact", &name, CHILD];
    run(&program, arguments, &limits, Output::Kept, |_| {}).unwrap().cause
}

#[test]
fn a_panic_in_a_guarded_process_is_reported_to_its_parent() {
    let name = "a_panic_in_a_guarded_process_is_reported_to_its_parent";
    let cause = end_of_child(name, || panic!("row {} is odd", 7));
    let Cause::Panicked(report) = &cause else { panic!("{cause:?}") };
    assert!(report.starts_with("this is a bug of hubslosh"), "{report}");
    assert!(report.contains("row 7 is odd (harness/host/tests/all/guard.rs:"), "{report}");
}

#[test]
fn a_panic_that_aborts_a_guarded_process_is_reported_to_its_parent() {
    extern "C" fn called_by_an_fmu() {
        panic!("row 7 is odd");
    }
    let name = "a_panic_that_aborts_a_guarded_process_is_reported_to_its_parent";
    let cause = end_of_child(name, || called_by_an_fmu());
    let Cause::Panicked(report) = &cause else { panic!("{cause:?}") };
    assert!(report.contains("row 7 is odd (harness/host/tests/all/guard.rs:"), "{report}");
}

#[test]
fn a_panic_that_was_caught_does_not_explain_a_later_crash() {
    let cause = end_of_child("a_panic_that_was_caught_does_not_explain_a_later_crash", || {
        bug::catch_panic(|| -> i32 { panic!("a damaged file") }).unwrap_err();
        std::process::abort();
    });
    assert!(matches!(cause, Cause::Ended(_)), "{cause:?}");
}

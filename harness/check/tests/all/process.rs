//! The process in which a rule calls an FMU.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::time::Duration;

use check::process::{SoFar, Unpacked, check};
use check::trace::{Crash, announce_call};
use check::{Findings, Options, RULES};
use host::guard;

/// Command-line argument by which the test recognises that it runs in the child process. The test harness reads
/// the argument as the name of a further test, so that no test may have this name.
const CHILD: &str = "process_of_the_rule";

#[test]
fn a_panic_of_hubslosh_is_not_reported_as_a_fault_of_the_fmu() {
    let program = std::env::current_exe().unwrap();
    if std::env::args().any(|argument| argument == CHILD) {
        files::bug::keep_panics();
        guard::enter().unwrap();
        announce_call("loading the binary", Crash::Error);
        panic!("row 7 is odd");
    }
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("hubslosh");
    let name = "process::a_panic_of_hubslosh_is_not_reported_as_a_fault_of_the_fmu";
    let text = format!("#!/bin/sh\nexec '{}' --exact {name} {CHILD}\n", program.display());
    std::fs::write(&script, text).unwrap();
    std::fs::set_permissions(&script, std::fs::Permissions::from_mode(0o700)).unwrap();
    let limit = Duration::from_secs(60);
    let options = Options { program: script, only: Vec::new(), limit };
    let so_far = SoFar::default();
    let (path, directory) = (Path::new("a.fmu"), folder.path());
    let fmu = Unpacked { path, directory, description: path };
    // The second rule is checked, too, although the process of the first rule ended while the FMU was loaded.
    for id in ["steps.run", "values.start"] {
        let rule = RULES.iter().find(|rule| rule.id == id).unwrap();
        let mut findings = Findings::new(rule.severity);
        check(rule, fmu, &options, &so_far, &mut findings);
        assert_eq!(findings.list, []);
        let why = findings.skipped.unwrap();
        assert!(why.starts_with("this is a bug of hubslosh"), "{why}");
        assert!(why.contains("row 7 is odd"), "{why}");
        assert_eq!(so_far.bug.get(), Some(&why));
    }
}

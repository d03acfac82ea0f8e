//! The FMU in Python's hands: runs the tests of `harness/python` with pytest,
//! in a virtual environment of their own in the target directory.

use std::path::Path;
use std::process::Command;

use crate::common::{harness, python, run};

#[test]
fn fmpy_drives_the_fmu_as_the_harness_does() {
    let fmu = pack::packed_for_tests();
    let wheel = pack::wheel::for_tests(&[fmu]);
    let scripts = pack::root().join("harness").join("python");
    let said = run(
        Command::new(python())
            .args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider"])
            .args([Path::new("--fmu"), fmu])
            .args([Path::new("--hubslosh"), &harness()])
            .args([Path::new("--wheel"), &wheel])
            .arg(&scripts)
            // the source tree stays as it is
            .env("PYTHONDONTWRITEBYTECODE", "1"),
        "the tests in Python failed",
    );
    // pytest's last line, "61 passed in 20.07s"
    let last = said.trim_end().lines().last().unwrap_or_default();
    let left_out = ["skipped", "deselected", "xfailed"].iter().any(|word| last.contains(word));
    assert!(last.contains(" passed") && !left_out, "pytest did not run every test:\n{said}");
    println!("{last}");
}

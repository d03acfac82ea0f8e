//! The FMU in Python's hands: runs the tests of `harness/python` with pytest,
//! in a virtual environment of their own in the target directory.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{python, run};

/// The harness's binary, of the profile that this test was built with; it is
/// another package's, so Cargo does not say where it is.
fn binary(target: &Path) -> PathBuf {
    let mut build = Command::new(env!("CARGO"));
    build.current_dir(pack::root()).args(["build", "--quiet", "--bin", "hubslosh"]);
    let profile = if cfg!(debug_assertions) { "debug" } else { "release" };
    if profile == "release" {
        build.arg("--release");
    }
    run(&mut build, "the binary hubslosh did not build");
    target.join(profile).join("hubslosh").with_extension(std::env::consts::EXE_EXTENSION)
}

#[test]
fn fmpy_drives_the_fmu_as_the_harness_does() {
    let fmu = pack::packed_for_tests();
    let target = fmu.ancestors().nth(2).expect("<target>/test-fmu/HubSlosh.fmu");
    let scripts = pack::root().join("harness").join("python");
    let said = run(
        Command::new(python())
            .args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider"])
            .args([Path::new("--fmu"), fmu])
            .args([Path::new("--hubslosh"), &binary(target)])
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

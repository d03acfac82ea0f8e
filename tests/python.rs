//! Runs the tests of `harness/python`, the short forms of the studies, and the examples with pytest, in a virtual
//! environment in the target directory.

use std::path::Path;
use std::process::Command;

use pack::{Fmi, MODELS};

use crate::common::{binary, harness, python, run, target};

/// Runs pytest in the tests' environment, and checks the number of tests that passed. `sentence` is the message of a failure.
///
/// # Panics
/// If a test fails or is not run.
fn pytest(arguments: &mut Command, sentence: &str) {
    let settings = pack::root().join("harness/python/pyproject.toml");
    let said = run(
        arguments
            .args(["--quiet", "-p", "no:cacheprovider"])
            .args([Path::new("-c"), &settings])
            // Each test process uses one thread, because the other processors run other tests, with which NumPy's
            // threads would only compete.
            .envs(["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"].map(|name| (name, "1")))
            // Python must not write bytecode into the source tree. All processes share one folder for it, so that
            // no process compiles a package again.
            .env("PYTHONPYCACHEPREFIX", target().join("python").join("bytecode")),
        sentence,
    );
    // This is the last line of pytest's output, such as "61 passed in 20.07s".
    let last = said.trim_end().lines().last().unwrap_or_default();
    let left_out = ["skipped", "deselected", "xfailed"].iter().any(|word| last.contains(word));
    assert!(last.contains(" passed") && !left_out, "pytest did not run every test:\n{said}");
    println!("{last}");
}

/// Test files of `harness/python` that need only the FMU HubSlosh. They take as long as all other files together, so that the
/// two groups can run in parallel.
const BESIDE: [&str; 6] = [
    "test_liquid.py",
    "test_model_exchange.py",
    "test_program.py",
    "test_recordings.py",
    "test_review.py",
    "test_uncertain.py",
];

/// Returns the pytest command with the options that the tests of the package need: the FMU and the command `hubslosh`.
fn package_tests() -> Command {
    let mut command = Command::new(python());
    command
        .args(["-m", "pytest"])
        .args([Path::new("--fmu"), pack::packed_for_tests()])
        .args([Path::new("--hubslosh"), harness()]);
    command
}

/// Packs every FMU in each version of FMI into one folder, as the tests of the package expect.
fn fmus() -> Vec<&'static Path> {
    let all = Fmi::ALL
        .map(|fmi| MODELS.each_ref().map(|model| pack::packed_version_for_tests(model, fmi)));
    all.concat()
}

/// Runs pytest on harness/python, except for the six files that need only HubSlosh.
#[test]
fn the_python_tests_of_the_fmus_with_fmpy_pass() {
    let tests = pack::root().join("harness/python");
    let mut command = package_tests();
    fmus();
    command.arg(&tests);
    for file in BESIDE {
        command.arg("--ignore").arg(tests.join("tests").join(file));
    }
    pytest(&mut command, "the tests in Python failed");
}

/// These tests take seconds each: type checkers; the code of docstrings and notebooks with the wheel; 22 sweeps of 45 minutes
/// with each of six slosh models.
#[test]
#[ignore = "minutes: .ci/long-tests"]
fn long_tests_of_the_python_package_pass() {
    pytest(
        package_tests()
            .args([Path::new("--wheel"), &pack::wheel::for_tests(&fmus())])
            .arg("--long")
            .arg(pack::root().join("harness/python")),
        "the long tests in Python failed",
    );
}

/// Runs pytest on the six files of harness/python/tests that need only HubSlosh.
#[test]
fn the_python_package_finds_modes_of_liquids_reads_recordings_and_reviews_craft() {
    let tests = pack::root().join("harness/python/tests");
    pytest(package_tests().args(BESIDE.map(|file| tests.join(file))), "the tests in Python failed");
}

/// Runs the tests of the studies that take only seconds: features computed from their definitions, and the benchmark.
#[test]
fn the_studies_reproduce_every_feature_and_the_scores_of_the_benchmark() {
    for model in &MODELS {
        pack::packed_model_for_tests(model);
    }
    let studies = pack::root().join("harness/studies");
    let quick = ["test_analysis.py", "test_benchmark.py"].map(|file| studies.join(file));
    pytest(package_tests().args(quick), "a study failed");
}

/// Each study compares its results with the numbers in the book.
#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn the_studies_compute_the_numbers_of_the_book() {
    for model in &MODELS {
        pack::packed_model_for_tests(model);
    }
    let studies = pack::root().join("harness/studies");
    pytest(package_tests().arg("--long").arg(studies), "a study failed");
}

#[test]
fn the_examples_give_the_results_that_their_readmes_state() {
    // The examples expect all FMUs in one folder.
    let [fmu, ..] = pack::MODELS.each_ref().map(pack::packed_model_for_tests);
    let folder = fmu.with_file_name("one-loop");
    std::fs::create_dir_all(&folder).expect("a folder in the target directory");
    let one_loop = binary("one-loop", &["--workspace"]);
    run(Command::new(one_loop).arg(fmu).arg(&folder), "the loop in the harness failed");
    pytest(
        Command::new(python())
            .env("HUBSLOSH", harness())
            .args(["-m", "pytest"])
            .args([Path::new("--fmu"), fmu])
            .args([Path::new("--folder"), &folder])
            .arg(pack::root().join("examples")),
        "an example failed",
    );
}

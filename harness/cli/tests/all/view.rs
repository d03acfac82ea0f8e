//! A run as a page, from outside; what is drawn of it in a browser is compared by `.ci/browser`.

use std::path::Path;
use std::process::{Command, Output};

use pack::packed_for_tests;

fn hubslosh(directory: &Path, arguments: &[&str]) -> Output {
    let fmu = ["--fmu", packed_for_tests().to_str().unwrap()];
    let mut command = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
    command.current_dir(directory).args(arguments).args(fmu).output().expect("the program runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const RUN: [&str; 5] =
    ["run", "--profile", "exp-sweep:amplitude=0.1,duration=20", "--set", "tank.d=200mm"];

/// What the page draws.
fn drawn(directory: &Path, file: &str) -> serde_json::Value {
    let page = std::fs::read_to_string(directory.join(file)).unwrap();
    for word in [" src=\"", "<link", "@import", "url(http"] {
        assert!(!page.contains(word), "{word} is in the page");
    }
    assert!(page.contains("<noscript>") && page.contains("The MIT License"));
    let (_, rest) = page.split_once("id=\"run\">").unwrap();
    serde_json::from_str(rest.split("</script>").next().unwrap()).unwrap()
}

#[test]
fn a_run_as_it_is_recorded_by_default_becomes_a_page_that_knows_its_parameters() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    assert!(hubslosh(directory, &[&RUN[..], &["--out", "run.parquet"]].concat()).status.success());
    let done = hubslosh(directory, &["view", "run.parquet", "--from", "5", "--to", "10"]);
    assert!(done.status.success(), "{}", said(&done));
    assert_eq!(said(&done), "");
    let run = drawn(directory, "run.html");
    assert_eq!(run["time"]["count"], 251);
    assert_eq!(run["scene"]["geometry"]["tanks"][0]["shape"]["contour"][1][0], 0.1);
    // what a CSV file cannot say is said on the command line, or missed
    assert!(hubslosh(directory, &[&RUN[..], &["--out", "run.csv"]].concat()).status.success());
    let done = hubslosh(directory, &["view", "run.csv", "--out", "csv.html"]);
    assert!(said(&done).contains("does not say which parameters"), "{}", said(&done));
    assert_eq!(
        drawn(directory, "csv.html")["scene"]["geometry"]["tanks"][0]["shape"]["contour"][1][0],
        0.0815
    );
}

#[test]
fn what_cannot_be_drawn_is_refused_and_leaves_no_page() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let columns = ["--columns", "wave_height", "--out", "run.parquet"];
    assert!(hubslosh(directory, &[&RUN[..], &columns].concat()).status.success());
    for (arguments, why) in [
        (
            &["run.parquet"][..],
            "no theta (or omega); no slosh_angle_radial, slosh_angle (or slosh_angle)",
        ),
        (&["run.parquet"], "--columns theta,omega,slosh_angle,slosh_angle_radial,wave_height"),
        (&["run.parquet", "--from", "30"], "leave 0 row(s)"),
        (&["run.parquet", "--out", "page.txt"], "must end in .html"),
        (&["run.parquet", "--set", "tank.dd=1"], "no variable \"tank.dd\""),
        (&["none.parquet"], "cannot be opened"),
    ] {
        let done = hubslosh(directory, &[&["view"], arguments].concat());
        assert_eq!(done.status.code(), Some(1));
        assert!(said(&done).contains(why), "{arguments:?}: {}", said(&done));
    }
    assert!(!directory.join("run.html").exists());
}

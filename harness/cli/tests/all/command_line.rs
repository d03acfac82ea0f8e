//! Runs the program `hubslosh` as a process: the files that it writes, and its errors for wrong input. Each failure must be one sentence
//! with a non-zero exit code, and must leave no new file.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pack::packed_for_tests;
use signals::table::Table;

fn hubslosh(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .current_dir(directory)
        .args(arguments)
        .output()
        .expect("the program runs")
}

fn short_run(directory: &Path, arguments: &[&str]) -> Output {
    let fmu = packed_for_tests().to_str().unwrap();
    let common = ["run", "--fmu", fmu, "--stop", "0.2", "--out", "out.csv"];
    hubslosh(directory, &[&common, arguments].concat())
}

fn files(directory: &Path) -> Vec<String> {
    let names = std::fs::read_dir(directory).unwrap().map(|f| f.unwrap().file_name());
    let mut names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Asserts that a command fails with a line that contains all of `words`, and leaves the directory
/// unchanged. Another line, which lists the columns in use, may come before.
fn refuses(directory: &Path, output: impl FnOnce() -> Output, words: &[&str]) {
    let before = files(directory);
    let output = output();
    let said = String::from_utf8_lossy(&output.stderr).trim().to_string();
    assert!(!output.status.success(), "it succeeded; {said}");
    let lines = said.lines().filter(|line| !line.contains(": columns used: "));
    assert_eq!(lines.count(), 1, "not one sentence: {said}");
    for word in words {
        assert!(said.contains(word), "\"{word}\" is not in: {said}");
    }
    assert_eq!(files(directory), before, "it left something behind");
}

fn edited_fmu(directory: &Path, edit: impl Fn(String) -> Option<String>) -> PathBuf {
    use std::io::{Read, Write};
    let path = directory.join("Edited.fmu");
    let mut from = zip::ZipArchive::new(std::fs::File::open(packed_for_tests()).unwrap()).unwrap();
    let mut to = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    for i in 0..from.len() {
        let mut file = from.by_index(i).unwrap();
        let name = file.name().unwrap().into_owned();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).unwrap();
        if name == "modelDescription.xml" {
            match edit(String::from_utf8(bytes).unwrap()) {
                Some(text) => bytes = text.into_bytes(),
                None => continue,
            }
        }
        to.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        to.write_all(&bytes).unwrap();
    }
    to.finish().unwrap();
    path
}

#[test]
fn a_run_writes_the_requested_columns() {
    let directory = tempfile::tempdir().unwrap();
    let done = short_run(
        directory.path(),
        &[
            "--profile",
            "sine:frequency=2",
            "--columns",
            "theta,omega,stuck",
            "--set",
            "slosh.model=linear",
        ],
    );
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let table = Table::read(
        &directory.path().join("out.csv"),
        &["time", "tau_cmd", "theta", "omega", "stuck"],
    )
    .unwrap();
    assert_eq!(table.rows(), 11);
    assert_eq!(table.column("time").unwrap()[10], 0.2);
    // At rest, the bearing holds the hub until the torque exceeds 5.9 mN·m.
    assert_eq!(table.column("stuck").unwrap()[0], 1.0);
    assert!(table.column("omega").unwrap()[10] > 0.0);
    assert_eq!(files(directory.path()), ["out.csv"]);
}

#[test]
fn a_torque_file_gives_the_same_motion_as_csv_and_as_parquet() {
    let directory = tempfile::tempdir().unwrap();
    let time: Vec<f64> = (0..=10).map(|k| f64::from(k) * 0.02).collect();
    let tau = time.iter().map(|t| 0.1 * (15.0 * t).sin()).collect();
    let torque = Table::new(vec!["time".into(), "tau_cmd".into()], vec![time, tau]);
    let mut answers = Vec::new();
    for name in ["torque.csv", "torque.parquet"] {
        torque.write(&directory.path().join(name), &Default::default()).unwrap();
        let done = short_run(directory.path(), &["--input", name]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        answers.push(std::fs::read_to_string(directory.path().join("out.csv")).unwrap());
    }
    assert_eq!(answers[0], answers[1]);
}

#[test]
fn the_error_about_an_unknown_variable_suggests_a_similar_name() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    refuses(
        directory,
        || short_run(directory, &["--profile", "zero", "--set", "friction.modle=none"]),
        &["no variable \"friction.modle\"", "did you mean \"friction.model\""],
    );
    refuses(
        directory,
        || short_run(directory, &["--profile", "zero", "--columns", "omegga"]),
        &["no variable \"omegga\"", "\"omega\""],
    );
}

/// Each case sets a value of the wrong kind, for example an unknown item of an enumeration, a text
/// in place of a number, a value for an output, or a value for the input that the profile drives.
#[test]
fn a_value_of_the_wrong_kind_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    for (set, words) in [
        ("friction.model=oily", &["friction.model", "stribeck (4)", "\"oily\""][..]),
        ("tank.h=deep", &["tank.h expects a number", "\"deep\""]),
        ("wheel.enabled=perhaps", &["wheel.enabled expects true or false"]),
        ("omega=1", &["omega cannot be set", "output"]),
        (
            "tau_cmd=1",
            &["tau_cmd cannot be set, because the profile or the file of inputs drives it"],
        ),
    ] {
        refuses(directory, || short_run(directory, &["--profile", "zero", "--set", set]), words);
    }
}

#[test]
fn a_tank_without_liquid_is_refused_with_the_message_of_the_fmu() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    for height in ["tank.h=0", "tank.h=-0.1", "tank.h=NaN"] {
        refuses(
            directory,
            || short_run(directory, &["--profile", "zero", "--set", height]),
            &["tank.h", "fmi2Error"],
        );
    }
}

#[test]
fn runs_that_need_more_memory_than_any_machine_has_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let fmu = packed_for_tests().to_str().unwrap();
    for (arguments, words) in [
        (
            &["run", "--fmu", fmu, "--profile", "sine:duration=1e12", "--out", "x.csv"][..],
            &["5.000e13 steps"][..],
        ),
        (
            &["torque", "--profile", "zero", "--step", "1e-9", "--out", "x.csv"],
            &["at most 20000000"],
        ),
        (&["scale", "froude", "--lambda", "1e308"], &["lambda = 1e308"]),
        // A negative number counts as a value, not as a flag.
        (&["scale", "froude", "--lambda", "-1"], &["lambda = -1", "positive"]),
        (
            &["run", "--fmu", fmu, "--profile", "zero", "--step", "-0.1", "--out", "x.csv"],
            &["not -0.1"],
        ),
    ] {
        refuses(directory, || hubslosh(directory, arguments), words);
    }
}

/// Numbers of runs or steps that need too much memory are refused
/// before anything is allocated.
#[test]
fn numbers_of_runs_and_steps_that_need_too_much_memory_are_refused_before_allocation() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let fmu = packed_for_tests().to_str().unwrap();
    let many = [0.1; 100];
    let plan = format!(
        "profile = \"sine\"\n[vary]\ntank.h = {many:?}\ntank.d = {many:?}\ntank.r = {many:?}\n"
    );
    std::fs::write(directory.join("plan.toml"), plan).unwrap();
    let steps = "steps (allowed: at most 20000000)";
    for (arguments, words) in [
        (&["run", "--fmu", fmu, "--profile", "zero:duration=1e12", "--out", "a.csv"][..], steps),
        (&["run", "--fmu", fmu, "--profile", "zero", "--step", "1e-300", "--out", "a.csv"], steps),
        (&["torque", "--profile", "zero:duration=1e12", "--out", "a.csv"], steps),
        (&["torque", "--profile", "zero", "--stop", "1e300", "--out", "a.csv"], steps),
        (&["torque", "--profile", "exp-sweep:f0=1e-320", "--out", "a.csv"], "from 1e-9 to 1e9 Hz"),
        // between two rows 1e-300 s apart a torque of 1e300 N·m has no finite slope
        (
            &[
                "torque",
                "--profile",
                "sine:amplitude=1e300,duration=1e-299,frequency=1e9",
                "--step",
                "1e-300",
                "--out",
                "a.csv",
            ],
            "a.csv cannot be written: row ",
        ),
        (&["design", "--fmu", fmu, "--multisine", "0.2", "--duration", "1e12"], steps),
        (&["design", "--fmu", fmu, "--profile", "zero:duration=1e12"], steps),
        (
            &["design", "--fmu", fmu, "--multisine", "0.2", "--band", "1,1e9"],
            "allowed: up to 25 Hz",
        ),
        (&["design", "--fmu", fmu, "--multisine", "0.2", "--period", "1e9"], "odd lines"),
        (&["design", "--fmu", fmu, "--multisine", "inf"], "must be positive numbers"),
        (
            &[
                "design",
                "--fmu",
                fmu,
                "--multisine",
                "0.2",
                "--duration",
                "200000",
                "--period",
                "10000",
            ],
            "needs 8.4e10 values of sines (allowed: at most 2e9)",
        ),
        (
            &["campaign", "--fmu", fmu, "--plan", "plan.toml", "--out", "c"],
            "a plan may have at most 100000 runs",
        ),
    ] {
        refuses(directory, || hubslosh(directory, arguments), &[words]);
    }
    let jobs = ["campaign", "--fmu", fmu, "--jobs", "100000", "--out", "c"];
    let done = hubslosh(directory, &jobs);
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(said.contains("100000 runs at once (allowed: 1 to 512)"), "{said}");
}

/// The cases are a torque of 0, a torque below the dry friction, a gyro without noise, and a record
/// of two rows.
#[test]
fn design_refuses_an_experiment_without_information_about_the_parameters() {
    let directory = tempfile::tempdir().unwrap();
    let fmu = packed_for_tests().to_str().unwrap();
    for (plan, words) in [
        (&["zero"][..], &["up to 0.00e0 N·m, does not turn the hub"][..]),
        (&["sine:amplitude=5e-3"], &["friction.c + friction.d = 5.92e-3 N·m", "a larger torque"]),
        (&["sine", "--set", "imu.arw=0"], &["imu.arw = 0: without noise", "above 0"]),
        (&["zero:duration=0.02"], &["2 rows", "more than 20", "longer duration"]),
    ] {
        let arguments = [&["design", "--fmu", fmu, "--profile"], plan].concat();
        refuses(directory.path(), || hubslosh(directory.path(), &arguments), words);
    }
    // --duration is an option for the multisine; with a profile it is refused.
    let done = hubslosh(directory.path(), &["design", "--profile", "sine", "--duration", "0.02"]);
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(said.contains("cannot be used with '--duration"), "{said}");
}

#[test]
fn hubslosh_run_prints_the_warnings_of_the_fmu() {
    let directory = tempfile::tempdir().unwrap();
    let said = |arguments: &[&str]| {
        let done = short_run(directory.path(), arguments);
        assert!(done.status.success());
        String::from_utf8_lossy(&done.stderr).into_owned()
    };
    let warning = said(&["--profile", "zero", "--set", "g_axial=0.1"]);
    assert!(warning.starts_with("warning: the Bond number is 9.2"), "{warning}");
    assert_eq!(said(&["--profile", "zero"]), "");
}

/// The cases are a file with two columns tau_cmd, an output that is listed twice, and two options
/// that name one output file.
#[test]
fn a_parameter_or_output_given_twice_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    std::fs::write(directory.join("in.csv"), "time,tau_cmd,tau_cmd\n0,1,2\n1,1,2\n").unwrap();
    let run = || short_run(directory, &["--input", "in.csv"]);
    refuses(directory, run, &["in.csv", "more than one column tau_cmd"]);
    let twice = || short_run(directory, &["--profile", "zero", "--columns", "omega,omega"]);
    refuses(directory, twice, &["omega twice"]);
    let tank = pack::root().join("harness/tank/examples/capsule.toml");
    let flags = ["tank", tank.to_str().unwrap(), "--fill", "0.5", "--out", "t.toml"];
    let same = || hubslosh(directory, &[&flags[..], &["--parameters", "t.toml"]].concat());
    refuses(directory, same, &["t.toml is the file of two outputs"]);
}

#[test]
fn a_torque_file_without_a_column_of_an_input_is_refused_and_the_message_lists_its_columns() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    std::fs::write(directory.join("in.csv"), "time,torque\n0,1\n1,1\n").unwrap();
    refuses(
        directory,
        || short_run(directory, &["--input", "in.csv"]),
        &[
            "in.csv",
            "none of its columns is an input",
            "torque is not an input",
            "the FMU's inputs: tau_cmd, tau_ext, g_axial",
            "columns in the file: time, torque",
        ],
    );
}

#[test]
fn a_torque_that_is_not_a_number_is_named_by_file_and_row() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    for (text, word) in [
        ("time,tau_cmd\n0,1\n1,NaN\n2,0\n", "row 2"),
        ("time,tau_cmd\n0,1\n1,1\n2,inf\n", "line 4, column tau_cmd"),
        ("time,tau_cmd\n0,1\n1,one\n", "line 3, column tau_cmd"),
        ("time,tau_cmd\n0,1\n1,1\n0.9,1\n", "row 3"),
        ("time,tau_cmd\n0,1\n", "1 rows"),
    ] {
        std::fs::write(directory.join("in.csv"), text).unwrap();
        let run = || short_run(directory, &["--input", "in.csv"]);
        refuses(directory, run, &["in.csv", word]);
    }
}

#[test]
fn the_error_about_a_file_that_cannot_be_read_or_written_names_the_file() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    std::fs::write(directory.join("not.fmu"), "no zip").unwrap();
    std::fs::write(directory.join("not.parquet"), "no parquet").unwrap();
    let fmu = packed_for_tests().to_str().unwrap();
    for (arguments, words) in [
        (
            &["run", "--profile", "zero", "--fmu", "none.fmu", "--out", "a.csv"][..],
            &["none.fmu"][..],
        ),
        (&["run", "--profile", "zero", "--fmu", "not.fmu", "--out", "a.csv"], &["not.fmu", "zip"]),
        (&["run", "--input", "none.csv", "--fmu", fmu, "--out", "a.csv"], &["none.csv"]),
        (&["run", "--input", "not.parquet", "--fmu", fmu, "--out", "a.csv"], &["not.parquet"]),
        (&["run", "--profile", "zero", "--fmu", fmu, "--out", "nowhere/a.csv"], &["nowhere/a.csv"]),
        (&["run", "--profile", "zero", "--fmu", fmu, "--out", "a.txt"], &["a.txt", ".parquet"]),
        (&["run", "--profile", "zero", "--step", "0", "--fmu", fmu, "--out", "a.csv"], &["step"]),
        (&["campaign", "--fmu", fmu, "--out", "not.fmu/c"], &["not.fmu/c"]),
        (&["campaign", "--fmu", "none.fmu"], &["none.fmu"]),
    ] {
        refuses(directory, || hubslosh(directory, arguments), words);
    }
}

/// The GUID, and then other parts, of modelDescription.xml are edited in an FMU.
#[test]
fn an_fmu_whose_description_and_binary_do_not_belong_together_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let run = || {
        hubslosh(directory, &["run", "--profile", "zero", "--fmu", "Edited.fmu", "--out", "a.csv"])
    };
    let guid = |xml: String| {
        let start = xml.find("guid=\"").unwrap() + 6;
        Some(format!("{}x{}", &xml[..start], &xml[start..]))
    };
    edited_fmu(directory, guid);
    refuses(directory, run, &["fmi2Instantiate", "GUID"]);
    edited_fmu(directory, |_| None);
    refuses(directory, run, &["no modelDescription.xml"]);
    edited_fmu(directory, |xml| Some(xml.replace("fmiVersion=\"2.0\"", "fmiVersion=\"1.0\"")));
    refuses(directory, run, &["FMI version 1.0", "2.0 and 3.0"]);
    edited_fmu(directory, |xml| {
        Some(xml.replace("modelIdentifier=\"HubSlosh\"", "modelIdentifier=\"Other\""))
    });
    refuses(directory, run, &["no binary for this platform", "binaries in the FMU: binaries/"]);
    edited_fmu(directory, |_| Some("<fmiModelDescription".into()));
    refuses(directory, run, &["Edited.fmu", "modelDescription.xml"]);
}

#[test]
fn the_output_of_each_command_on_the_scaling_page_equals_the_printed_output() {
    let page = pack::root().join("book/scaling.md");
    let page = std::fs::read_to_string(page).unwrap();
    let mut commands = 0;
    for block in page.split("\n\n") {
        let Some((command, shown)) = block.split_once('\n') else { continue };
        let Some(arguments) = command.strip_prefix("    $ hubslosh ") else { continue };
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let output = hubslosh(Path::new("."), &arguments);
        let printed = String::from_utf8(output.stdout).unwrap();
        let shown: Vec<&str> =
            shown.lines().map(|line| line.strip_prefix("    ").unwrap_or(line)).collect();
        let printed: Vec<&str> = printed.lines().map(str::trim_end).collect();
        assert_eq!(shown, printed, "{command}");
        commands += 1;
    }
    assert_eq!(commands, 4);
}

#[test]
fn every_column_named_after_an_input_drives_this_input_and_other_columns_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let run = |text: &str, more: &[&str]| {
        std::fs::write(directory.join("in.csv"), text).unwrap();
        let columns = ["--input", "in.csv", "--columns", "theta,tau_actuator,wave_height"];
        let set = ["--set", "friction.model=none", "--set", "slosh.model=frozen"];
        short_run(directory, &[&columns[..], &set, more].concat())
    };
    let read = |names: &[&str]| Table::read(&directory.join("out.csv"), names).unwrap();
    // tau_ext without tau_cmd turns the hub in the same way as tau_cmd does: theta = tau t²/2 divided by the same inertia.
    let done = run("time,tau_ext,g_axial\n0,0.1,2\n0.2,0.1,4\n", &[]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let both = read(&["time", "tau_ext", "g_axial", "theta"]);
    assert_eq!(both.column("g_axial").unwrap()[5], 3.0, "joined by lines");
    assert!(run("time,tau_cmd\n0,0.1\n0.2,0.1\n", &[]).status.success());
    let (ext, cmd) =
        (both.column("theta").unwrap()[10], read(&["theta"]).column("theta").unwrap()[10]);
    // The same torque through either input gives the same angle, to rounding.
    assert!((ext / cmd - 1.0).abs() < 1e-12 && ext > 1e-3, "{ext} {cmd}");

    // With a column of slopes, the torque jumps at a row: 0.1 N·m for 0.1 s, then 0. Without this column, lines would
    // join the rows, and the torque would fall gradually during a step.
    let edge = "time,tau_cmd,tau_slope\n0,0.1,0\n0.1,0,0\n0.2,0,0\n";
    assert!(run(edge, &[]).status.success());
    let table = read(&["theta", "tau_cmd"]);
    assert_eq!(table.column("tau_cmd").unwrap()[4..6], [0.1, 0.0]);
    let (theta, steady) = (table.column("theta").unwrap()[10], cmd);
    // angle tau/I (t1²/2 + t1 t1) after the edge, compared with tau/I (2 t1)²/2 of a constant torque
    assert!((theta / steady - 0.75).abs() < 1e-9, "{theta} {steady}");

    refuses(
        directory,
        || run("time,tau_cmd,oil,omega\n0,0,0,0\n1,0,0,0\n", &[]),
        &["oil, omega are not inputs", "--ignore-columns"],
    );
    let passed = run("time,tau_cmd,oil\n0,0,0\n1,0,0\n", &["--ignore-columns"]);
    assert!(passed.status.success());
    refuses(
        directory,
        || run("time,tau_cmd,g_axial\n0,0,9\n1,0,9\n", &["--set", "g_axial=3"]),
        &["g_axial cannot be set, because the profile or the file of inputs drives it"],
    );
}

#[test]
fn a_table_goes_to_stdout_and_a_closed_pipe_ends_the_program_quietly() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let fmu = packed_for_tests().to_str().unwrap();
    let arguments = ["run", "--fmu", fmu, "--profile", "zero:duration=400", "--out", "-"];
    let done = hubslosh(directory, &arguments);
    let said = String::from_utf8_lossy(&done.stdout);
    assert!(said.starts_with("time,tau_cmd,omega") && said.lines().count() == 20_002);
    assert_eq!(files(directory), Vec::<String>::new());
    for arguments in [&arguments[..], &["variables", "--fmu", fmu]] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
            .args(arguments)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take()); // the reader goes
        let done = child.wait_with_output().unwrap();
        let error = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success() && error.is_empty(), "{}: {error}", done.status);
    }
}

#[test]
fn variables_are_listed_with_unit_range_and_meaning() {
    let fmu = packed_for_tests().to_str().unwrap();
    let list = |arguments: &[&str]| {
        let done = hubslosh(Path::new("."), &[&["variables", "--fmu", fmu], arguments].concat());
        (done.status.success(), String::from_utf8_lossy(&done.stdout).into_owned())
    };
    let (_, all) = list(&["friction", "--causality", "parameter"]);
    let line =
        |name: &str| all.lines().find(|l| l.starts_with(name)).unwrap_or_default().to_string();
    for word in ["parameter", "stribeck", "none|viscous|"] {
        assert!(line("friction.model ").contains(word), "{word}: {all}");
    }
    for word in ["0.003498", "N.m", "0.0 to 1000000.0"] {
        assert!(line("friction.c ").contains(word), "{word}: {all}");
    }
    let (_, inputs) = list(&["--causality", "input"]);
    assert_eq!(inputs.lines().count(), 4, "a head and three inputs: {inputs}");
    assert!(!list(&["no such thing"]).0);
}

#[test]
fn shell_completions_contain_every_command() {
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let done = hubslosh(Path::new("."), &["completions", shell]);
        let script = String::from_utf8_lossy(&done.stdout).into_owned();
        for word in ["campaign", "variables", "ignore-columns"] {
            assert!(done.status.success() && script.contains(word), "{shell}: {word}");
        }
    }
}

#[test]
fn exit_codes_distinguish_a_failure_from_a_wrong_command_line() {
    for (arguments, code) in [
        (&["variables", "--fmu", "none.fmu"][..], 1),
        (&["run", "--no-such-flag"], 2),
        (&["--help"], 0),
    ] {
        assert_eq!(hubslosh(Path::new("."), arguments).status.code(), Some(code), "{arguments:?}");
    }
}

#[test]
fn a_parameter_given_with_a_unit_has_the_same_effect_as_its_si_value() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let answer = |sets: [&str; 2]| {
        let [a, b] = sets;
        let done = short_run(directory, &["--profile", "sine", "--set", a, "--set", b]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        std::fs::read(directory.join("out.csv")).unwrap()
    };
    let in_si = answer(["tank.h=0.05", "init.slosh_angle=0.1"]);
    assert_eq!(answer(["tank.h=50mm", "init.slosh_angle = 0.1 rad"]), in_si);
    refuses(
        directory,
        || short_run(directory, &["--profile", "zero", "--set", "tank.h=2 in"]),
        &["tank.h has no unit \"in\" (allowed: m, mm)"],
    );
}

#[test]
fn messages_are_coloured_on_request_and_not_by_default_in_files() {
    let run = |color: &str| {
        let flags = [color, "variables", "--fmu", "none.fmu"];
        String::from_utf8(hubslosh(Path::new("."), &flags).stderr).unwrap()
    };
    assert!(
        run("--color=always").starts_with("\u{1b}[1m\u{1b}[31merror:\u{1b}[0m there is no FMU")
    );
    assert!(run("--color=auto").starts_with("error: there is no FMU"));
    assert!(run("--color=never").starts_with("error: there is no FMU"));
    // Messages of the parser of the command line are coloured, too.
    let wrong = hubslosh(Path::new("."), &["--color", "always", "nothing"]);
    assert!(String::from_utf8(wrong.stderr).unwrap().contains("\u{1b}[31merror:"));
}

#[test]
fn the_option_quiet_keeps_results_and_warnings_and_strict_makes_warnings_fail() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let loud = short_run(directory, &["--profile", "zero"]);
    assert_eq!(text(&loud.stdout), "11 rows in out.csv\n");
    let quiet = short_run(directory, &["--profile", "zero", "--quiet", "--strict"]);
    assert!(quiet.status.success() && quiet.stdout.is_empty() && quiet.stderr.is_empty());
    // there is no restoring force: the FMU warns, and at the end the run says which force dominates and that the model
    // has left its range
    let weightless = ["--profile", "zero", "--set", "g_axial=0", "--quiet"];
    let warned = short_run(directory, &weightless);
    assert!(warned.status.success() && text(&warned.stderr).starts_with("warning: "));
    let strict = short_run(directory, &[&weightless[..], &["--strict"]].concat());
    assert_eq!(strict.status.code(), Some(1));
    let last = text(&strict.stderr).lines().last().map(String::from);
    assert_eq!(
        last.as_deref(),
        Some("error: there were 3 warnings, which --strict makes an error")
    );
    let rows = hubslosh(directory, &["--quiet", "torque", "--profiles"]);
    assert!(text(&rows.stdout).contains("exp-sweep"), "what is asked for is not a notice");
}

#[test]
fn every_command_that_prints_a_table_also_prints_json() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let fmu = packed_for_tests().to_str().unwrap();
    let json = |arguments: &[&str]| -> serde_json::Value {
        let done = hubslosh(directory, arguments);
        assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
        serde_json::from_slice(&done.stdout).unwrap_or_else(|e| panic!("{arguments:?}: {e}"))
    };
    let tank = concat!(env!("CARGO_MANIFEST_DIR"), "/../tank/examples/capsule.toml");
    let half = json(&["tank", tank, "--fill", "50%", "--modes", "1", "--json"]);
    let rows = json(&["tank", tank, "--sweep", "40%,50%", "--modes", "1", "--json"]);
    assert_eq!(rows[1]["modes"], half["modes"]);
    let start = &json(&["variables", "tank.h", "--json", "--fmu", fmu])[0]["start"];
    assert_eq!(start, &serde_json::json!(0.1));
    let units = &json(&["variables", "tank.h", "--json", "--fmu", fmu])[0]["units"];
    assert_eq!(units["mm"]["factor"], 1000.0);
    let bond = &json(&["scale", "bond", "--json"])["bond"];
    assert!((bond.as_f64().unwrap() - 902.2915).abs() < 1e-4, "{bond}");
    assert_eq!(json(&["scale", "--json", "froude", "--lambda", "4"])["factors"]["time"], 2.0);
    assert!(json(&["scale", "rotation", "--alpha", "2.21", "--json"])["Bo_r"]["bond"].is_f64());
    assert!(json(&["scale", "thesis", "--json"])[0]["value"].is_f64());
    assert_eq!(json(&["torque", "--profiles", "--json"])[0]["profile"], "exp-sweep");
    assert_eq!(json(&["check", "--rules", "--json"])[0]["rule"], "zip.readable");
    assert_eq!(json(&["check", fmu, "--only", "zip", "--json"])["errors"], 0);
    let plan = ["design", "--fmu", fmu, "--profile", "sine:duration=20", "--json"];
    assert_eq!(json(&plan)["parameters"]["hub.I"]["unit"], "kg.m2");
}

/// The command is copied to bin/ and an FMU to the folder of the Python package. `hubslosh run`
/// without --fmu, started in another directory, finds the FMU.
#[test]
fn an_installed_command_finds_the_fmus_that_came_with_it() {
    let directory = tempfile::tempdir().unwrap();
    let place = |name: &str| directory.path().join(name);
    let command = place("bin").join(if cfg!(windows) { "hubslosh.exe" } else { "hubslosh" });
    for folder in ["bin", "elsewhere", "lib/python3.12/site-packages/hubslosh/fmus"] {
        std::fs::create_dir_all(place(folder)).unwrap();
    }
    std::fs::copy(env!("CARGO_BIN_EXE_hubslosh"), &command).unwrap();
    let fmu = place("lib/python3.12/site-packages/hubslosh/fmus/HubSlosh.fmu");
    std::fs::copy(packed_for_tests(), fmu).unwrap();
    let run = ["run", "--profile", "zero", "--stop", "0.1", "--out", "a.csv"];
    let done = Command::new(&command).current_dir(place("elsewhere")).args(run).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(done.stderr.is_empty(), "nothing is built: {}", String::from_utf8_lossy(&done.stderr));
    assert_eq!(files(&place("elsewhere")), ["a.csv"]);
    let said = |arguments: &[&str]| {
        let done = Command::new(&command)
            .current_dir(place("elsewhere"))
            .args(arguments)
            .output()
            .unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        String::from_utf8(done.stdout).unwrap().trim().to_string()
    };
    let package = place("lib/python3.12/site-packages/hubslosh").canonicalize().unwrap();
    assert_eq!(Path::new(&said(&["fmus"])), package.join("fmus/HubSlosh.fmu"));
    // The Python package does not contain the book.
    let address = said(&["book"]);
    assert!(address.starts_with("https://") && address.ends_with("/book/index.md"), "{address}");
    let copy = Command::new(&command).args(["book", "--out", "copy"]).output().unwrap();
    assert!(!copy.status.success());
    let why = String::from_utf8_lossy(&copy.stderr);
    assert!(why.contains("--out") && why.contains(&address), "{why}");
}

#[test]
fn without_arguments_an_installed_command_prints_help_and_writes_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
    // cargo sets this variable for tests, too.
    command.env_remove("CARGO_MANIFEST_DIR").current_dir(directory.path());
    let done = command.output().unwrap();
    let said = String::from_utf8_lossy(&done.stdout);
    assert!(done.status.success() && done.stderr.is_empty());
    assert!(said.contains("Usage: hubslosh") && said.contains("examples"), "{said}");
    assert!(files(directory.path()).is_empty());
}

/// FMUs, Parquet, JSON, SSV and CSV files are truncated or contain text. The messages must contain
/// no terms of the libraries that read them.
#[test]
fn damaged_input_files_are_refused_in_words_for_users() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let whole = std::fs::read(packed_for_tests()).unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(directory.join(name), bytes).unwrap();
    write("text.fmu", b"not an archive");
    write("cut.fmu", &whole[..3000]);
    write("cut.parquet", b"PAR1 and no more");
    write("cut.json", b"{");
    write("text.ssv", b"text");
    write("zero.csv", b"time,tau_cmd,omega\n0,0,0\n0.1,0,0\n0.2,0,0\n");
    let cases: [(&[&str], &str); 8] = [
        (
            &["run", "--profile", "zero", "--out", "o.csv", "--fmu", "text.fmu"],
            "the file is not a zip archive",
        ),
        (&["run", "--profile", "zero", "--out", "o.csv", "--fmu", "cut.fmu"], "the end is missing"),
        (
            &["run", "--input", "cut.parquet", "--out", "o.csv"],
            "the file is not a complete Parquet file",
        ),
        (
            &["run", "--profile", "zero", "--parameters", "cut.json", "--out", "o.csv"],
            "it is not a result of `hubslosh identify`",
        ),
        (
            &["run", "--profile", "zero", "--parameters", "text.ssv", "--out", "o.csv"],
            "line 1, column 1",
        ),
        (
            &["run", "--input", "none.csv", "--out", "o.csv"],
            "none.csv cannot be used: the file cannot be opened",
        ),
        (&["tank", "none.toml", "--fill", "1"], "none.toml: the file cannot be read"),
        (&["analyse", "zero.csv", "--out", "o"], "tau_cmd is 0 N·m in every row"),
    ];
    let fmu = packed_for_tests().to_str().unwrap();
    for (arguments, words) in cases {
        let fmu = if arguments.contains(&"--fmu") || arguments[0] == "tank" {
            &[][..]
        } else {
            &["--fmu", fmu]
        };
        let output = hubslosh(directory, &[arguments, fmu].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains(words), "{arguments:?}: {said}");
        for jargon in
            ["EOCD", "EOF", "os error", "invalid Zip", "root node", "--method", "line and column"]
        {
            assert!(!said.contains(jargon), "{arguments:?}: {said}");
        }
    }
}

/// `hubslosh review plan.toml --python PROGRAM` runs PROGRAM with `-m hubslosh.project plan.toml`,
/// and fails if it does not exist.
#[test]
fn hubslosh_review_starts_the_python_package() {
    let directory = tempfile::tempdir().unwrap();
    let review =
        |python: &str| hubslosh(directory.path(), &["review", "plan.toml", "--python", python]);
    refuses(
        directory.path(),
        || review("no-such-python"),
        &["no Python was found", "no-such-python"],
    );
    if cfg!(unix) {
        let said = String::from_utf8(review("echo").stdout).unwrap();
        assert_eq!(said, "-m hubslosh.project plan.toml\n");
        refuses(directory.path(), || review("false"), &["false ended with"]);
    }
}

#[test]
fn examples_are_listed_and_copied_to_a_new_folder() {
    let directory = tempfile::tempdir().unwrap();
    let listed = hubslosh(directory.path(), &["examples"]);
    let listed = String::from_utf8(listed.stdout).unwrap();
    let scripts = listed.lines().filter(|line| line.contains(". ")).count();
    assert!(scripts >= 15 && listed.contains("12_spacecraft"), "{listed}");
    let copied = hubslosh(directory.path(), &["examples", "--copy", "mine"]);
    assert!(copied.status.success(), "{}", String::from_utf8_lossy(&copied.stderr));
    let own = files(&directory.path().join("mine/12_spacecraft"));
    assert_eq!(own, ["README.md", "spacecraft.py"]);
    let again = || hubslosh(directory.path(), &["examples", "--copy", "mine"]);
    refuses(directory.path(), again, &["mine", "exists", "a new folder"]);
}

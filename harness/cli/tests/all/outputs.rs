//! Outputs never replace inputs, and inputs that would hang a command are refused.

use std::path::Path;
use std::process::{Command, Output};

use pack::packed_for_tests;

fn hubslosh(directory: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_hubslosh");
    Command::new(program).current_dir(directory).args(arguments).output().unwrap()
}

fn expect_refusal(directory: &Path, arguments: &[&str]) -> String {
    let output = hubslosh(directory, arguments);
    let said = String::from_utf8_lossy(&output.stderr).trim().to_string();
    assert!(!output.status.success(), "{arguments:?} succeeded: {said}");
    said
}

/// Command lines with an input IN and an output OUT, one for each option that names an output.
const CASES: [&str; 15] = [
    "run --input IN --out OUT",
    "run --profile zero --parameters IN --out OUT",
    "torque --profile file:path=IN --out OUT",
    "view IN --out OUT",
    "check IN --json OUT",
    "check IN --junit OUT",
    "check IN --sarif OUT",
    "tank IN --fill 1 --out OUT",
    "tank IN --fill 1 --picture OUT",
    "tank IN --fill 1 --parameters OUT",
    "gyro --recording IN --report OUT",
    "identify IN --out OUT",
    "identify IN --out result.json --report OUT",
    "design IN --free a=1 --out OUT",
    "analyse IN --fmu IN --out OUT",
];

/// The output has the path of an input, a hard link, a symbolic link or another spelling of the
/// path.
#[cfg(unix)]
#[test]
fn no_output_option_replaces_an_input_under_any_of_its_names() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    std::fs::write(at("input.csv"), "input").unwrap();
    std::fs::create_dir(at("folder")).unwrap();
    std::fs::hard_link(at("input.csv"), at("hard.csv")).unwrap();
    std::os::unix::fs::symlink("input.csv", at("symbolic.csv")).unwrap();
    let names = ["input.csv", "./input.csv", "hard.csv", "symbolic.csv", "folder/../input.csv"];
    for (k, case) in CASES.iter().enumerate() {
        let name = names[k % names.len()];
        let arguments: Vec<&str> = case
            .split(' ')
            .map(|word| if word == "OUT" { name } else { word })
            .map(|word| if word == "IN" { "input.csv" } else { word })
            .map(|word| if word == "file:path=IN" { "file:path=input.csv" } else { word })
            .collect();
        let said = expect_refusal(directory.path(), &arguments);
        assert!(
            said.contains("is not written: it is the input input.csv") && said.contains(name),
            "{case}: {said}"
        );
        assert_eq!(std::fs::read_to_string(at("input.csv")).unwrap(), "input", "{case}");
    }
}

/// The file tank.toml names drawing.svg as its drawing, which `hubslosh tank --picture drawing.svg`
/// must not overwrite.
#[test]
fn files_named_in_a_plan_or_tank_file_are_protected_like_inputs() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    std::fs::write(at("tank.toml"), "density = 1000\nsvg = \"drawing.svg\"\n").unwrap();
    std::fs::write(at("drawing.svg"), "<svg/>").unwrap();
    let said = expect_refusal(
        directory.path(),
        &["tank", "tank.toml", "--fill", "1", "--picture", "drawing.svg"],
    );
    assert!(said.contains("it is the input"), "{said}");
}

/// `check --json A.fmu B.fmu` takes A.fmu as the name of its output. The command refuses to replace
/// an existing .fmu file.
#[test]
fn an_existing_file_that_looks_like_an_input_is_not_replaced() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    std::fs::write(at("A.fmu"), "an FMU").unwrap();
    std::fs::write(at("B.fmu"), "an FMU").unwrap();
    for option in ["--json", "--junit", "--sarif"] {
        let said = expect_refusal(directory.path(), &["check", option, "A.fmu", "B.fmu"]);
        assert!(
            said.contains(&format!("{option} would replace A.fmu, an existing .fmu file")),
            "{said}"
        );
    }
    let said = expect_refusal(
        directory.path(),
        &["check", "B.fmu", "--json", "c.json", "--sarif", "./c.json"],
    );
    assert!(said.contains("is the file of two outputs (--json, --sarif)"), "{said}");
    assert_eq!(std::fs::read_to_string(at("A.fmu")).unwrap(), "an FMU");
}

fn helps(command: &[&str], texts: &mut Vec<(String, String)>) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_hubslosh")).args(command).arg("--help").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let commands = text.split("\nCommands:\n").nth(1).unwrap_or_default();
    let names = commands.lines().take_while(|line| !line.is_empty());
    for name in names.filter(|line| line.starts_with("  ") && !line.starts_with("   ")) {
        let name = name.split_whitespace().next().unwrap();
        if name != "help" {
            helps(&[command, &[name]].concat(), texts);
        }
    }
    texts.push((command.join(" "), text));
}

const INPUTS: &str = "analyse --plan, analyse --bench-day, analyse --fmu, campaign --plan, campaign --fmu, \
    design --fmu, example --fmu, gyro --recording, identify --fmu, run --input, \
    run --parameters, run --fmu, pack --parameters, variables --fmu, view --parameters, view --fmu, book --theme";

/// Each option with FILE or FOLDER in its help must be in one of two lists, so that no output can
/// replace an input.
#[test]
fn every_option_that_names_a_file_is_listed_as_an_input_or_an_output() {
    let source = include_str!("../../src/outputs.rs");
    let mut texts = Vec::new();
    helps(&[], &mut texts);
    let (mut found, mut unknown) = (0, Vec::new());
    for (command, text) in &texts {
        // The kinds of recordings of `identify` have its input and output options.
        let command = command.split(' ').next().unwrap();
        for line in text.lines().filter(|line| line.trim_start().starts_with('-')) {
            let Some(option) = line.split_whitespace().find(|word| word.starts_with("--")) else {
                continue;
            };
            if !["<FILE", "[<FILE", "<DIRECTORY", "<FOLDER"].iter().any(|kind| line.contains(kind))
            {
                continue;
            }
            found += 1;
            let output = format!("(\"{command}\", \"{}\",", option.trim_start_matches("--"));
            let input = format!("{command} {option}");
            if !source.contains(&output) && !INPUTS.split(", ").any(|known| known == input) {
                unknown.push(input);
            }
        }
    }
    assert!(found > 30, "{found}");
    assert!(unknown.is_empty(), "neither in INPUTS here nor in OUTPUTS of outputs.rs: {unknown:?}");
}

/// Returns the commands of the examples in a help text. Continued lines are joined, and the rest of
/// a line after a pipe or a redirection is left out.
fn examples(text: &str) -> Vec<String> {
    let joined = text.replace("\\\n", " ");
    let lines = joined.lines().filter(|line| line.starts_with("  hubslosh "));
    let commands =
        lines.flat_map(|line| line.split(" && ").map(|command| command.trim().to_string()));
    commands
        .filter(|command| command.starts_with("hubslosh "))
        .map(|command| command.split(['|', '>']).next().unwrap().to_string())
        .collect()
}

/// Beginnings of the examples in help texts that take at most a second each, and run in a folder
/// with the files that they name.
const CHEAP: [&str; 7] = [
    "hubslosh scale",
    "hubslosh tank",
    "hubslosh torque",
    "hubslosh variables",
    "hubslosh check --rules",
    "hubslosh run --profile zero",
    "hubslosh run --input torque.csv",
];

#[test]
fn every_example_in_a_help_is_parsed_and_the_fast_examples_run() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let tank = concat!(env!("CARGO_MANIFEST_DIR"), "/../tank/examples/capsule.toml");
    std::fs::create_dir_all(at("dist")).unwrap();
    std::fs::create_dir_all(at("harness/tank/examples")).unwrap();
    for place in ["tank.toml", "harness/tank/examples/capsule.toml"] {
        std::fs::copy(tank, at(place)).unwrap();
    }
    let bench = tank.replace("capsule", "bench");
    std::fs::copy(bench, at("harness/tank/examples/bench.toml")).unwrap();
    for fmu in ["HubSlosh.fmu", "Spacecraft.fmu"] {
        std::fs::copy(packed_for_tests(), at("dist").join(fmu)).unwrap();
    }
    std::fs::write(at("torque.csv"), "time,tau_cmd\n0,0.1\n1,0\n").unwrap();
    let mut texts = Vec::new();
    helps(&[], &mut texts);
    let (mut understood, mut run) = (0, 0);
    for (command, text) in &texts {
        for example in examples(text) {
            let words = shlex::split(&example).unwrap();
            let words: Vec<&str> = words[1..].iter().map(String::as_str).collect();
            let only_parsed = [&["--parse-only"][..], &words].concat();
            let output = hubslosh(directory.path(), &only_parsed);
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{command}: {example}\n{said}");
            understood += 1;
            if CHEAP.iter().any(|cheap| example.starts_with(cheap)) {
                let output = hubslosh(directory.path(), &words);
                let said = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{command}: {example}\n{said}");
                run += 1;
            }
        }
    }
    assert!(understood > 50 && run > 15, "{understood} {run}");
}

#[test]
fn every_help_lists_the_commands_own_options_first_and_has_an_example() {
    let mut texts = Vec::new();
    helps(&[], &mut texts);
    assert!(texts.len() > 25, "{}", texts.len());
    for (command, text) in &texts {
        let (own, global) = text.split_once("\nGlobal options:\n").expect(command);
        for option in ["--call-limit", "--memory", "--quiet", "--strict", "--color"] {
            let starts = |line: &str| line.split_whitespace().any(|word| word == option);
            let is_listed = |part: &str| part.lines().any(|l| l.starts_with("  ") && starts(l));
            assert!(!is_listed(own) && is_listed(global), "{command}: {option}");
        }
        let is_example = |line: &str| line.starts_with(&format!("  hubslosh {command}"));
        assert!(command.is_empty() || text.lines().any(is_example), "{command} has no example");
    }
}

#[test]
fn a_draining_tank_gets_the_damping_of_every_fill() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let shape = "density = 1000\nshape = { cylinder = { radius = 0.5, height = 2 } }\n";
    std::fs::write(at("tank.toml"), shape).unwrap();
    let written = |extra: &[&str]| {
        let arguments = ["tank", "tank.toml", "--sweep", "0.2,0.5,1", "--model", "SloshTank"];
        let output = hubslosh(
            directory.path(),
            &[&arguments[..], &["--modes", "1", "--parameters", "draining.toml"], extra].concat(),
        );
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        std::fs::read_to_string(at("draining.toml")).unwrap()
    };
    let text = written(&["--nu", "1e-6"]);
    // The column of the fill table replaces this parameter.
    assert!(!text.contains("\"tank.zeta[1]\""), "{text}");
    // the damping ratio that is expected of a tank of this size with smooth walls: some 0.1 %
    for point in 1..=3 {
        assert!(text.contains(&format!("\"tank.fill.zeta[1,{point}]\" = 0.00")), "{text}");
    }
    let alone = ["tank", "tank.toml", "--sweep", "0.2,0.5,1", "--modes=1", "--nu=1e-6"];
    let output = hubslosh(directory.path(), &alone);
    let csv = String::from_utf8(output.stdout).unwrap();
    assert!(
        output.status.success()
            && csv.contains(",zeta_1,zeta_low_1,zeta_high_1,nonlinear_inertia_1,"),
        "{csv}"
    );
}

/// A named pipe without a writer is given as recording, parameters, plan or tank of each command.
/// The command must fail instead of waiting.
#[cfg(unix)]
#[test]
fn a_named_pipe_is_refused_as_any_input() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    for ending in ["csv", "parquet", "mat", "toml", "ssv", "json"] {
        let made = Command::new("mkfifo").arg(at(&format!("pipe.{ending}"))).status().unwrap();
        assert!(made.success());
    }
    let fmu = packed_for_tests().to_str().unwrap();
    for arguments in [
        "run --fmu FMU --input pipe.csv --out a.csv",
        "run --fmu FMU --input pipe.parquet --out a.csv",
        "run --fmu FMU --profile zero --parameters pipe.toml --out a.csv",
        "run --fmu FMU --profile zero --parameters pipe.ssv --out a.csv",
        "run --fmu FMU --profile file:path=pipe.csv --out a.csv",
        "campaign --fmu FMU --plan pipe.toml --out a",
        "gyro --recording pipe.csv --out a",
        "gyro --recording pipe.csv --out a",
        "identify pipe.parquet --fmu FMU --out a.json",
        "identify friction pipe.csv --fmu FMU --out a.json",
        "tank pipe.toml --fill 1",
        "view pipe.parquet --fmu FMU",
    ] {
        let words: Vec<&str> =
            arguments.split(' ').map(|word| if word == "FMU" { fmu } else { word }).collect();
        let said = expect_refusal(directory.path(), &words);
        assert!(said.contains("pipe.") && (said.contains("regular file")), "{arguments}: {said}");
    }
}

/// One command for each kind of output is run with a symbolic link, and with a named pipe, as the
/// output.
#[cfg(unix)]
#[test]
fn an_output_follows_links_and_is_written_to_a_pipe() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let fmu = packed_for_tests().to_str().unwrap();
    std::fs::create_dir(at("far")).unwrap();
    let tank = "density = 1000\nshape = { sphere = { radius = 2 } }\n";
    std::fs::write(at("tank.toml"), tank).unwrap();
    for (arguments, ending) in [
        ("run --fmu FMU --profile zero --stop 0.1 --out OUT", "csv"),
        ("run --fmu FMU --profile zero --stop 0.1 --out OUT", "parquet"),
        ("tank tank.toml --fill 2 --picture OUT", "svg"),
        ("tank tank.toml --fill 2 --out OUT", "json"),
    ] {
        let run = |out: &str| {
            let words: Vec<&str> = arguments
                .split(' ')
                .map(|word| match word {
                    "FMU" => fmu,
                    "OUT" => out,
                    word => word,
                })
                .collect();
            let done = hubslosh(directory.path(), &words);
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        };
        let [plain, link, far, pipe] =
            ["plain", "link", "far/file", "pipe"].map(|name| format!("{name}.{ending}"));
        run(&plain);
        let expected = std::fs::read(at(&plain)).unwrap();
        std::os::unix::fs::symlink(&far, at(&link)).unwrap();
        run(&link);
        assert!(at(&link).is_symlink(), "{arguments}");
        // Pictures and results are equal; Parquet files may differ in their metadata.
        let ends = |bytes: &[u8]| (bytes[..16].to_vec(), bytes[bytes.len() - 6..].to_vec());
        let is_same = |found: &[u8]| ends(found) == ends(&expected);
        assert!(is_same(&std::fs::read(at(&far)).unwrap()), "{arguments}");
        assert!(Command::new("mkfifo").arg(at(&pipe)).status().unwrap().success());
        let path = at(&pipe);
        let reader = std::thread::spawn(move || std::fs::read(path).unwrap());
        run(&pipe);
        assert!(is_same(&reader.join().unwrap()), "{arguments}");
        use std::os::unix::fs::FileTypeExt;
        assert!(at(&pipe).symlink_metadata().unwrap().file_type().is_fifo(), "{arguments}");
        for name in [&plain, &link, &far, &pipe] {
            std::fs::remove_file(at(name)).unwrap();
        }
    }
    // three reports of one check in three formats
    let reports = ["a.json", "a.xml", "a.sarif"];
    for name in reports {
        std::os::unix::fs::symlink(format!("far/{name}"), at(name)).unwrap();
    }
    let [json, junit, sarif] = reports;
    let options = ["check", fmu, "--json", json, "--junit", junit, "--sarif", sarif];
    assert!(hubslosh(directory.path(), &options).status.success());
    for name in reports {
        let far = std::fs::read(at("far").join(name)).unwrap();
        assert!(at(name).is_symlink() && !far.is_empty(), "{name}");
    }
}

#[test]
fn a_driven_input_has_exactly_one_column_in_the_table() {
    let directory = tempfile::tempdir().unwrap();
    let fmu = packed_for_tests().to_str().unwrap();
    let run = ["run", "--fmu", fmu, "--profile", "zero", "--stop", "0.1", "--out", "-"];
    let output = hubslosh(directory.path(), &[&run[..], &["--columns", "tau_cmd,omega"]].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().next().unwrap(), "time,tau_cmd,omega");
}

fn ssv(name: &str, value: &str, units: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<ssv:ParameterSet version=\"1.0\" name=\"p\" \
         xmlns:ssv=\"http://ssp-standard.org/SSP1/SystemStructureParameterValues\" \
         xmlns:ssc=\"http://ssp-standard.org/SSP1/SystemStructureCommon\"><ssv:Parameters>\
         <ssv:Parameter name=\"{name}\">{value}</ssv:Parameter></ssv:Parameters>{units}</ssv:ParameterSet>"
    )
}

#[test]
fn units_of_a_parameter_set_are_converted_or_refused() {
    let directory = tempfile::tempdir().unwrap();
    let fmu = packed_for_tests().to_str().unwrap();
    let run = |text: &str| {
        std::fs::write(directory.path().join("set.ssv"), text).unwrap();
        let arguments = ["run", "--fmu", fmu, "--profile", "sine", "--stop", "0.1"];
        let output = hubslosh(
            directory.path(),
            &[&arguments[..], &["--parameters", "set.ssv", "--out", "-"]].concat(),
        );
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.success(), text(output.stdout), text(output.stderr))
    };
    let units = |unit: &str, base: &str| {
        format!(
            "<ssv:Units><ssc:Unit name=\"{unit}\"><ssc:BaseUnit {base}/></ssc:Unit></ssv:Units>"
        )
    };
    let (_, expected, _) = run(&ssv("tank.h", "<ssv:Real value=\"0.05\"/>", ""));
    for text in [
        // units: the FMU's own, one of its display units, and units that the file defines
        ssv("tank.h", "<ssv:Real value=\"0.05\" unit=\"m\"/>", ""),
        ssv("tank.h", "<ssv:Real value=\"50\" unit=\"mm\"/>", ""),
        ssv(
            "tank.h",
            "<ssv:Real value=\"50\" unit=\"mm\"/>",
            &units("mm", "m=\"1\" factor=\"0.001\""),
        ),
        ssv(
            "tank.h",
            "<ssv:Real value=\"5\" unit=\"finger\"/>",
            &units("finger", "m=\"1\" factor=\"0.01\""),
        ),
    ] {
        let (ok, found, said) = run(&text);
        assert!(ok, "{said}\n{text}");
        assert_eq!(found, expected, "{text}");
    }
    for (text, words) in [
        (
            ssv("tank.h", "<ssv:Real value=\"50\" unit=\"furlong\"/>", ""),
            "tank.h has no unit \"furlong\" (allowed: m, ",
        ),
        (
            ssv("tank.h", "<ssv:Real value=\"50\" unit=\"kg\"/>", &units("kg", "kg=\"1\"")),
            "tank.h: kg cannot be converted to m (allowed: m, ",
        ),
        (
            ssv("tank.h", "<ssv:Real value=\"50\" unit=\"mm\"/>", &units("mm", "m=\"one\"")),
            "line 2: the unit \"mm\" has no valid BaseUnit",
        ),
        (
            ssv("slosh.model", "<ssv:Enumeration value=\"linear\" unit=\"m\"/>", ""),
            "slosh.model has the type Enumeration and no unit",
        ),
    ] {
        let (ok, _, said) = run(&text);
        assert!(!ok && said.contains(words) && said.contains("set.ssv"), "{words}: {said}");
    }
}

/// Returns the text of a recording of a torque sweep from 1 to 3 Hz in 100 s and of a response to
/// it. Its times are multiplied by `times`, its rates by `values`.
fn sweep(times: f64, values: f64) -> String {
    let mut text = String::from("time,tau_cmd,omega\n");
    for k in 0..=5000 {
        let t = 0.02 * f64::from(k);
        let phase = std::f64::consts::TAU * (t + 0.01 * t * t);
        let (torque, rate) = (0.1 * phase.sin(), 0.01 * values * (phase - 0.5).sin());
        text += &format!("{:?},{torque:?},{rate:?}\n", t * times);
    }
    text
}

/// The recordings have times in milliseconds or nanoseconds without a stated unit, dates in the far
/// future, or values of 1e300.
#[test]
fn a_recording_in_another_unit_or_of_absurd_values_is_refused_at_once() {
    let directory = tempfile::tempdir().unwrap();
    let fmu = packed_for_tests().to_str().unwrap();
    for (times, values, words) in [
        (1e12, 1.0, "millennia after 1970"),
        (1e3, 1.0, "states no unit, and its rows are 20.0 apart"),
        (1e-9, 1.0, "states no unit, and its rows are 2e-11 apart"),
        (1.0, 1e300, "(allowed: magnitudes up to 1e60)"),
    ] {
        std::fs::write(directory.path().join("a.csv"), sweep(times, values)).unwrap();
        let profile = "lin-sweep:f0=1,f1=3,duration=100";
        let arguments =
            ["analyse", "a.csv", "--profile", profile, "--model", "linear", "--fmu", fmu];
        let said = expect_refusal(directory.path(), &[&arguments[..], &["--out", "a"]].concat());
        assert!(said.contains(words) && said.contains("a.csv"), "{words}: {said}");
    }
}

#[test]
fn a_sweep_that_is_shorter_than_a_step_ends_without_a_response() {
    let directory = tempfile::tempdir().unwrap();
    let fmu = packed_for_tests().to_str().unwrap();
    let plan = "title = \"t\"\nprofile = \"lin-sweep:duration=1e-9,f0=1,f1=3\"\n[vary]\nprofile.amplitude = [0.1]\n";
    std::fs::write(directory.path().join("plan.toml"), plan).unwrap();
    let output = hubslosh(
        directory.path(),
        &["campaign", "--plan", "plan.toml", "--fmu", fmu, "--out", "a"],
    );
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

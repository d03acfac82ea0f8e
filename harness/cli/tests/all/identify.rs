//! Runs `hubslosh identify` as a process, and uses its results in further commands.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};

use analysis::statistics::deviation;
use signals::table::Table;

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .current_dir(folder)
        .args(arguments)
        .args(["--fmu", pack::packed_for_tests().to_str().unwrap()])
        .output()
        .unwrap()
}

fn hubslosh(folder: &Path, arguments: &[&str]) -> Result<String, String> {
    let done = run(folder, arguments);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if done.status.success() { Ok(text(&done.stdout)) } else { Err(text(&done.stderr)) }
}

fn record(folder: &Path, name: &str, settings: &[&str]) {
    let torque = "lin-sweep:amplitude=0.05,f0=0.3,f1=3,duration=90";
    let mut arguments = vec!["run", "--profile", torque, "--columns", "omega,omega_imu"];
    for setting in ["slosh.model=frozen", "imu.enabled=true"].iter().chain(settings) {
        arguments.extend(["--set", setting]);
    }
    hubslosh(folder, &[&arguments[..], &["--out", "clean.csv"]].concat()).unwrap();
    let all = ["time", "tau_cmd", "omega_imu"];
    let clean = Table::read(&folder.join("clean.csv"), &all).unwrap();
    let columns = all.map(|column| clean.column(column).unwrap().to_vec()).to_vec();
    let names = ["time", "tau_cmd", "omega"].map(String::from).to_vec();
    Table::new(names, columns).write(&folder.join(name), &Default::default()).unwrap();
}

#[test]
fn hubslosh_run_accepts_the_parameters_that_identify_has_estimated() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    record(folder, "data.csv", &["hub.I=0.5"]);
    let asked =
        ["identify", "data.csv", "--model", "frozen", "--also", "none", "--out", "result.json"];
    let said = hubslosh(folder, &asked).unwrap();
    // The inertia of the liquid was computed from the tank and not estimated, which the verdict states.
    assert!(said.contains("the interval is valid only for this liquid"), "{said}");
    let asked = ["run", "--parameters", "result.json", "--input", "data.csv", "--ignore-columns"];
    hubslosh(folder, &[&asked[..], &["--columns", "omega", "--out", "twin.csv"]].concat()).unwrap();
    let column = |name: &str| {
        let table = Table::read(&folder.join(name), &["omega"]).unwrap();
        table.column("omega").unwrap().to_vec()
    };
    let (clean, twin) = (column("clean.csv"), column("twin.csv"));
    let off: f64 = clean.iter().zip(&twin).map(|(a, b)| (a - b).powi(2)).sum();
    // The outputs of the run differ from the clean ones by far less than the noise of one row, 4e-4 rad/s, and by far
    // less than the 0.03 rad/s that another inertia would cause.
    assert!((off / clean.len() as f64).sqrt() < 1e-4, "{off}");
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn identify_and_design_accept_a_single_unknown_an_unknown_at_its_bound_and_no_input() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    record(folder, "data.csv", &["hub.I=0.5"]);
    let asked = |command: &str, free: &str, more: &[&str]| {
        let asked = [command, "data.csv", "--free", free, "--outputs", "omega"];
        let asked =
            [&asked[..], &["--solver", "host", "--set", "slosh.model=frozen"], more].concat();
        hubslosh(folder, &asked).unwrap()
    };
    let fitted = ["--inputs", "tau_cmd", "--out", "result.json"];
    let said = asked("identify", "hub.I=0.55:0.3:2", &fitted);
    let row = said.lines().find(|line| line.starts_with("hub.I ")).unwrap();
    let value: f64 = row.split_whitespace().nth(1).unwrap().parse().unwrap();
    assert!((value - 0.5).abs() < 0.01, "{said}");
    let said = asked("identify", "hub.I=0.1:0.1:0.12", &fitted);
    assert!(said.contains("hub.I is at its upper bound, 0.12"), "{said}");
    let said = asked("design", "hub.I=0.5", &["--noise", "omega=1e-4"]);
    assert!(said.contains("These inputs do not determine hub.I"), "{said}");
    assert!(said.contains("unknown") && !said.contains("NaN") && !said.contains("inf"), "{said}");
    let json = asked("design", "hub.I=0.5", &["--noise", "omega=1e-4", "--json"]);
    let bounds: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(bounds[0]["std"].is_null() && bounds[0]["not_determined"] == true, "{json}");
}

/// Lines that name written files go to stderr, so that programs can parse stdout as JSON.
#[test]
fn printed_json_is_the_only_content_of_stdout() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let plan = ["design", "--profile", "lin-sweep:duration=10", "--out", "t.csv", "--json"];
    let said = hubslosh(folder, &plan).unwrap();
    serde_json::from_str::<serde_json::Value>(&said).expect(&said);
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_search() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    record(folder, "data.csv", &[]);
    let report = ["--out", "result.json", "--report", "nowhere/page.html"];
    for (flags, word) in [
        (&["--out", "nowhere/result.json"][..], "nowhere/result.json cannot be written"),
        (&report, "nowhere/page.html cannot be written"),
    ] {
        let error = hubslosh(folder, &[&["identify", "data.csv"], flags].concat()).unwrap_err();
        assert!(error.contains(word), "{error}");
    }
    // The result of a model that does not fit its recording says so when it is used, also in files of older versions.
    for key in ["fits", "described"] {
        let result = r#"{"KEY":false,"settings":{},"parameters":{"hub.I":{"value":0.4}}}"#;
        std::fs::write(folder.join("poor.json"), result.replace("KEY", key)).unwrap();
        let flags = ["--parameters", "poor.json", "--profile", "zero", "--out", "out.csv"];
        let done = run(folder, &[&["run"][..], &flags].concat());
        let said = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success() && said.contains("does not fit the recording"), "{said}");
    }
}

#[test]
fn hubslosh_run_accepts_the_friction_that_identify_friction_has_estimated() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    record(folder, "data.csv", &["fluid.rho=1e-6"]);
    let asked = ["identify", "friction", "data.csv", "--out", "friction.json"];
    let asked = [&asked[..], &["--report", "friction.html"]].concat();
    let said = hubslosh(folder, &asked).unwrap();
    assert!(said.contains("The tank is taken as empty"), "{said}");
    let page = std::fs::read_to_string(folder.join("friction.html")).unwrap();
    assert!(page.contains("Friction torque against the rate"), "{page}");
    let asked = ["run", "--parameters", "friction.json", "--input", "data.csv", "--ignore-columns"];
    hubslosh(folder, &[&asked[..], &["--out", "twin.csv"]].concat()).unwrap();
}

/// The requested peak of 0.5 N·m exceeds the limit of the wheel, 0.26 N·m.
#[test]
fn a_designed_multisine_is_within_the_wheels_limits() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let asked = ["design", "--multisine", "0.5", "--duration", "400", "--optimal"];
    let said = hubslosh(folder, &[&asked[..], &["--out", "torque.csv"]].concat()).unwrap();
    // the requested 0.5 N·m exceed the limit of the wheel, 0.26 N·m
    assert!(
        said.contains("within the wheel's limits") && said.contains("peak 0.260 N·m"),
        "{said}"
    );
    // The command compares the multisine with a linear sweep, and recommends the sweep if it gives more information.
    let mean = said.lines().find(|line| line.starts_with("Mean standard deviation")).unwrap();
    let numbers: Vec<f64> = mean.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let recommended =
        if numbers[0] <= numbers[1] { "the multisine" } else { "the sweep, --profile lin-sweep" };
    assert!(said.contains(&format!("Recommended: {recommended}")), "{said}");
    // The torque is reduced further if the slosh has to stay linear.
    let asked = [
        "design",
        "--profile",
        "lin-sweep:duration=100,f0=2.2,f1=2.6",
        "--slosh-angle",
        "0.1",
        "--json",
    ];
    let limited: serde_json::Value =
        serde_json::from_str(&hubslosh(folder, &asked).unwrap()).unwrap();
    let angle = limited["slosh_angle"].as_f64().unwrap();
    assert!((0.09..=0.1).contains(&angle), "{limited}");
}

#[test]
fn the_error_of_a_removed_option_names_its_replacement() {
    let folder = tempfile::tempdir().unwrap();
    for (option, replacement) in [
        (&["--method", "multisine"][..], "Noise or nonlinearity?"),
        (&["--method=black-box"], "ARX and ARMAX"),
        (&["--method", "acceleration"], "identify friction"),
        (&["--method", "frequency"], "identify bench"),
        (&["--method", "free-decay"], "identify decay"),
        (&["--empty"], "identify friction"),
        (&["--tank=a.toml"], "--fmu SloshTank"),
        (&["--known", "hub.I=5:3"], "--start NAME=VALUE:STD"),
        (&["--acausal"], "--also early_rate"),
        (&["--exchange"], "--solver host"),
    ] {
        let asked = [&["identify", "a.csv"], option, &["--out", "a.json"]].concat();
        let said = hubslosh(folder.path(), &asked).unwrap_err();
        assert!(said.contains("was removed") && said.contains(replacement), "{said}");
    }
}

#[test]
fn each_kind_of_identify_has_at_most_15_options() {
    let folder = tempfile::tempdir().unwrap();
    for kind in ["bench", "fmu", "friction", "decay"] {
        let said = hubslosh(folder.path(), &["identify", kind, "--help"]).unwrap();
        let every = hubslosh(folder.path(), &["fmus", "--help"]).unwrap();
        let named = |text: &str| -> Vec<String> {
            let lines = text.lines().map(str::trim_start);
            let word =
                |line: &str| line.split([' ', '=']).find(|w| w.starts_with("--")).map(String::from);
            lines.filter(|line| line.starts_with('-')).filter_map(word).collect()
        };
        let (of_every, own) = (named(&every), named(&said));
        // A continued line of an example may begin with an option.
        let own: BTreeSet<&String> =
            own.iter().filter(|option| !of_every.contains(option)).collect();
        assert!(!own.is_empty() && own.len() <= 15, "{kind}: {own:?}");
    }
}

#[test]
fn identify_without_a_kind_of_recording_accepts_the_options_of_bench_and_fmu() {
    let folder = tempfile::tempdir().unwrap();
    let parsed = |arguments: &[&str]| {
        let all = [&["--parse-only", "identify"], arguments, &["--out", "a.json"]].concat();
        hubslosh(folder.path(), &all)
    };
    for kind in [&[][..], &["bench"]] {
        assert!(parsed(&[kind, &["a.csv", "--model", "linear"]].concat()).is_ok());
    }
    for kind in [&[][..], &["fmu"]] {
        assert!(parsed(&[kind, &["a.csv", "--free", "mu=1", "--outputs", "x"]].concat()).is_ok());
    }
    for place in [0, 1] {
        let mut all = vec!["friction", "a.csv"];
        all.insert(place, "-q");
        assert!(parsed(&all).is_ok(), "{place}");
    }
    // An option that belongs to another kind of recording is refused.
    let error = parsed(&["friction", "a.csv", "--model", "linear"]).unwrap_err();
    assert!(error.contains("unexpected argument '--model'"), "{error}");
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_design_uses_the_damping_ratio_that_is_set_and_prints_no_infinite_percentage() {
    let folder = tempfile::tempdir().unwrap();
    let asked = ["design", "--profile", "lin-sweep:duration=40,f0=2,f1=2.8", "--sensor-errors"];
    let with = |more: &[&str]| hubslosh(folder.path(), &[&asked[..], more].concat()).unwrap();
    let json = with(&["--set", "slosh.zeta=0.01", "--json"]);
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(found["parameters"]["slosh.zeta"]["value"], 0.01, "{json}");
    // If --set requests the correlation, it is used, even if --set also gives a damping ratio.
    let both = ["--set", "slosh.zeta=0.01", "--set", "slosh.zeta_from_correlation=true", "--json"];
    let json = with(&both);
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_ne!(found["parameters"]["slosh.zeta"]["value"], 0.01, "{json}");
    // With the correlation the damping ratio has no effect, and the FMU warns.
    record(folder.path(), "data.csv", &[]);
    let identify = ["identify", "friction", "data.csv", "--out", "a.json"];
    for command in [&asked[..], &identify] {
        let both = &both[..both.len() - usize::from(command[0] == "identify")];
        let said = run(folder.path(), &[command, both].concat()).stderr;
        let said = String::from_utf8_lossy(&said).into_owned();
        assert_eq!(said.matches("slosh.zeta has no effect: ").count(), 1, "{said}");
    }
    let said = with(&[]);
    for name in ["friction.asymmetry", "delay", "gyro_bias[1]"] {
        let line = said.lines().find(|line| line.starts_with(name)).unwrap();
        assert!(line.trim_end().ends_with('-'), "{line}");
    }
    assert!(!said.contains("inf"), "{said}");
}

#[test]
fn a_torque_designed_for_a_signal_to_noise_ratio_achieves_it_in_the_gyro_samples() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let asked = ["design", "--snr", "20", "--band", "1.25,20"];
    // In a linear bench 7500 samples determine the noise to 0.8 %, 0.07 dB; the tolerance is four times this. Dry friction
    // takes a quarter of the torque at the lower end of the band, and more than half at the resonance. The command
    // replaces it by viscous friction with the same first harmonic, whose error is a twentieth.
    let linear = ["friction.c=0", "friction.d=0"];
    for (set, most) in [(&linear[..], 0.3), (&[], 0.5)] {
        let set: Vec<&str> = set.iter().flat_map(|one| ["--set", one]).collect();
        let said = hubslosh(folder, &[&asked[..], &["--json"], &set].concat()).unwrap();
        let found: serde_json::Value = serde_json::from_str(&said).unwrap();
        for what in ["lower end", "least", "upper end of"] {
            let needs = found["needs"].as_array().unwrap();
            let row = needs.iter().find(|n| n["what"].as_str().unwrap().starts_with(what)).unwrap();
            let profile = format!(
                "sine:amplitude={},frequency={},duration=300",
                row["torque"], row["frequency"]
            );
            // Straight lines between rows 1 ms apart reproduce the sine to (2π 20 Hz 1 ms)²/12 = 0.13 %.
            let flags = ["--step", "0.001", "--set", "imu.enabled=true", "--set", "imu.rate=50"];
            let out = ["--columns", "omega,omega_imu", "--out", "twin.parquet"];
            let run = ["run", "--profile", &profile];
            hubslosh(folder, &[&run[..], &flags, &out, &set].concat()).unwrap();
            let table = Table::read(&folder.join("twin.parquet"), &["omega", "omega_imu"]).unwrap();
            // the rate and the noise at the gyro's sampling times, after the liquid's own oscillation has decayed by
            // exp(−0.003 · 2π 2.4 · 150) = e⁻⁷
            let taken = |name: &str| -> Vec<f64> {
                table.column(name).unwrap()[150_000..].iter().copied().step_by(20).collect()
            };
            let (rate, gyro) = (taken("omega"), taken("omega_imu"));
            let noise: Vec<f64> = rate.iter().zip(&gyro).map(|(rate, gyro)| gyro - rate).collect();
            let off = 20.0 * (deviation(&rate) / deviation(&noise)).log10() - 20.0;
            println!("{profile} {set:?}: {off:+.2} dB");
            assert!(off.abs() < most, "{profile} {set:?}: {off:+.2} dB off");
        }
    }
    let said = hubslosh(folder, &asked).unwrap();
    let line = said.lines().find(|line| line.starts_with("upper end of")).unwrap();
    assert!(line.ends_with("more than the wheel gives"), "{said}");
}

//! Runs campaigns from plan files as processes: campaigns that are killed and started again, runs that another importer simulated, and
//! tables in which values are missing.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use host::fmi2::Fmu;
use pack::packed_for_tests;
use signals::table::Table;

fn hubslosh(directory: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
    command.current_dir(directory).args(arguments);
    command
}

fn campaign(directory: &Path, plan: &str, out: &str, arguments: &[&str]) -> Command {
    std::fs::write(directory.join("plan.toml"), plan).unwrap();
    let fmu = packed_for_tests().to_str().unwrap();
    let common = ["campaign", "--plan", "plan.toml", "--out", out];
    let fmu = if arguments.contains(&"--fmu") { &[][..] } else { &["--fmu", fmu] };
    hubslosh(directory, &[&common, fmu, arguments].concat())
}

fn successful(mut command: Command) -> Output {
    let done = command.output().expect("the program runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    done
}

fn text(directory: &Path, file: &str) -> String {
    std::fs::read_to_string(directory.join(file)).unwrap()
}

fn rows(directory: &Path, file: &str) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(directory.join(file)).unwrap();
    reader.deserialize().map(|row| row.unwrap()).collect()
}

const SWEEPS: &str = "title = \"Sweeps\"\n\
    profile = \"exp-sweep:f0=2.1,f1=2.8,duration=DURATION\"\n\
    [set]\nimu.enabled = true\n\
    [vary]\nslosh.model = [\"linear\", \"spherical\"]\nhub.I = [0.3, 0.35]\nprofile.amplitude = [0.05, 0.1, 0.2]\n\
    [count]\nimu.seed = 5\n";

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_killed_campaign_continues_with_its_stored_runs() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let plan = SWEEPS.replace("DURATION", "300");
    // With one run at a time the other runs are not done when the first run is stored.
    let mut child = campaign(directory, &plan, "killed", &["--jobs", "1"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let runs = || -> Vec<std::path::PathBuf> {
        let files = std::fs::read_dir(directory.join("killed/runs")).into_iter().flatten();
        let paths = files.map(|f| f.unwrap().path());
        paths.filter(|p| p.extension().is_some_and(|e| e == "parquet")).collect()
    };
    let begin = Instant::now();
    while runs().is_empty() {
        assert!(begin.elapsed() < Duration::from_secs(120), "no run in two minutes");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let left = runs();
    assert!((1..12).contains(&left.len()), "it was killed too late: {} runs", left.len());
    for run in &left {
        assert_eq!(Table::read(run, &["time"]).unwrap().rows(), 15_001, "{}", run.display());
    }
    let said = successful(campaign(directory, &plan, "killed", &[])).stdout;
    let said = String::from_utf8_lossy(&said);
    assert!(said.contains(&format!("{} reused", left.len())), "{said}");
    successful(campaign(directory, &plan, "whole", &[]));
    for file in ["features.csv", "features_spa.csv", "runs.csv", "plan.toml"] {
        let [killed, whole] = ["killed", "whole"].map(|d| text(directory, &format!("{d}/{file}")));
        assert_eq!(killed, whole, "{file}");
    }
}

/// `campaign --list` prints the inputs and parameters of each run. Another importer simulates and
/// stores the runs of this list.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn runs_by_another_importer_give_the_same_tables() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let plan = SWEEPS.replace("DURATION", "60");
    let plan = format!(
        "{plan}\n[[run]]\nname = \"up\"\n[[run]]\nname = \"bang\"\nprofile = \"bang-stop-bang:duration=20\"\n"
    );
    let list = successful(campaign(directory, &plan, "theirs", &["--list"])).stdout;
    assert!(!directory.join("theirs").exists(), "--list makes nothing");
    let list: serde_json::Value = serde_json::from_slice(&list).unwrap();
    let runs = list["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 24);

    // this code takes the place of another importer, which knows only the list, `hubslosh torque` and FMI
    let fmu = Fmu::open(list["fmu"]["path"].as_str().unwrap()).unwrap();
    let columns: Vec<String> = serde_json::from_value(list["columns"].clone()).unwrap();
    std::fs::create_dir_all(directory.join("theirs/runs")).unwrap();
    for run in runs {
        let number = |key: &str| run[key].as_f64().unwrap();
        let [step, sample, stop] = ["step", "sample", "stop"].map(|key| number(key).to_string());
        let profile = run["profile"].as_str().unwrap();
        let arguments =
            ["--profile", profile, "--step", &step, "--sample", &sample, "--stop", &stop];
        successful(hubslosh(
            directory,
            &[&["torque", "--out", "torque.parquet"], &arguments[..]].concat(),
        ));
        let torque =
            Table::read(&directory.join("torque.parquet"), &["time", "tau_cmd", "tau_slope"]);
        let torque = torque.unwrap();
        let [time, tau, slope] =
            ["time", "tau_cmd", "tau_slope"].map(|name| torque.column(name).unwrap());
        let mut instance = fmu.instantiate("theirs").unwrap();
        for (name, value) in run["settings"].as_object().unwrap() {
            let value = value.as_str().map_or(value.to_string(), String::from);
            instance.set(name, &value).unwrap();
        }
        instance.setup_experiment(None, time[0], Some(number("stop"))).unwrap();
        instance.enter_initialization_mode().unwrap();
        let reference = [fmu.description().variable("tau_cmd").unwrap().reference];
        instance.set_real(&reference, &tau[..1]).unwrap();
        instance.exit_initialization_mode().unwrap();
        let mut recorded = vec![time.to_vec(), tau.to_vec()];
        recorded.resize(columns.len(), Vec::new());
        for k in 0..time.len() {
            for (name, column) in columns.iter().zip(&mut recorded).skip(2) {
                column.push(instance.get(name).unwrap().number());
            }
            if k + 1 < time.len() {
                instance.set_real(&reference, &[tau[k]]).unwrap();
                instance.set_real_input_derivatives(&reference, &[1], &[slope[k]]).unwrap();
                instance.do_step(time[k], time[k + 1] - time[k]).unwrap();
            }
        }
        let mut notes: BTreeMap<String, String> =
            serde_json::from_value(run["notes"].clone()).unwrap();
        notes.insert("made_by".into(), "another importer".into());
        let file = directory.join("theirs").join(run["file"].as_str().unwrap());
        Table::new(columns.clone(), recorded).write(&file, &notes).unwrap();
    }

    let said = successful(campaign(directory, &plan, "theirs", &[])).stdout;
    assert!(String::from_utf8_lossy(&said).contains("0 runs simulated, 24 reused"));
    successful(campaign(directory, &plan, "ours", &[]));
    for file in ["features.csv", "features_spa.csv", "runs.csv"] {
        let [theirs, ours] = ["theirs", "ours"].map(|d| text(directory, &format!("{d}/{file}")));
        assert_eq!(theirs, ours, "{file}");
    }
}

#[test]
fn a_stored_run_with_other_parameters_is_simulated_again_with_a_reason() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let plan = "profile = \"sine:duration=1\"\n[[run]]\nname = \"a\"\nhub.I = 0.3\n";
    successful(campaign(directory, plan, "c", &[]));
    let changed = plan.replace("0.3", "0.4");
    let done = successful(campaign(directory, &changed, "c", &[]));
    assert!(String::from_utf8_lossy(&done.stdout).contains("1 runs simulated, 0 reused"));
    assert_eq!(
        String::from_utf8_lossy(&done.stderr),
        "c held the campaign of another plan; its tables and report are replaced\nre-running a: hub.I was 0.3, is 0.4\n"
    );
    // The same values in another notation are the same run.
    let same = changed.replace("hub.I = 0.4\n", "hub.I = 4e-1\ntank.h = 0.100\n");
    let done = successful(campaign(directory, &same, "c", &[]));
    assert!(String::from_utf8_lossy(&done.stdout).contains("0 runs simulated, 1 reused"));
    // A stored run that lacks the columns for the tables is simulated again, too.
    let run = directory.join("c/runs/a.parquet");
    let notes = signals::table::metadata(&run).unwrap();
    Table::read(&run, &["time", "omega"]).unwrap().write(&run, &notes).unwrap();
    let done = successful(campaign(directory, &changed, "c", &[]));
    assert!(String::from_utf8_lossy(&done.stdout).contains("1 runs simulated, 0 reused"));
}

#[test]
fn features_that_the_torque_does_not_excite_stay_empty() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    std::fs::write(directory.join("torque.csv"), "time,tau_cmd\n1,0\n2,0.1\n3,0\n").unwrap();
    let plan = "title = \"Without a sweep\"\nprofile = \"zero\"\n[vary]\nprofile = [\n\
        \"sine:duration=5\", \"bang-stop-bang:duration=20\", \"acceleration-step:duration=10\",\n\
        \"file:path=torque.csv\", \"noise:duration=100\", \"zero:duration=1\"]\n";
    successful(campaign(directory, plan, "c", &[]));
    let table = rows(directory, "c/runs.csv");
    assert_eq!(table.len(), 6);
    for row in &table {
        for column in ["f_res_hz", "f_dip_hz", "delta_f_hz", "notch_db", "rotary_from_hz"] {
            assert_eq!(row[column], "", "{column} of {}", row["name"]);
        }
        // Only planar slosh occurs: none of these torques excites rotary slosh.
        assert_eq!(row["swirl"].parse(), Ok(0.0), "{row:?}");
        // only the torque `noise` has a frequency band to which a model can be fitted
        assert_eq!(row["fit_freq_pct"].is_empty(), row["name"] != "noise", "{row:?}");
        assert!(row["peak_slosh_angle_deg"].parse::<f64>().unwrap() >= 0.0);
        assert!(row["max_energy_residual"].parse::<f64>().unwrap() < 1e-8, "{row:?}");
    }
    let has_amplitude = |row: &&HashMap<String, String>| !row["amplitude_nm"].is_empty();
    assert_eq!(table.iter().filter(has_amplitude).count(), 2);
    for file in ["c/runs.csv", "c/features.csv", "c/features_spa.csv"] {
        assert!(!text(directory, file).contains("NaN"), "{file}");
    }
}

#[test]
fn a_failed_run_is_a_row_of_runs_csv_with_the_error() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let plan = "profile = \"sine:duration=1\"\n[vary]\ntank.d = [-1, 0.163]\n";
    let done = campaign(directory, plan, "c", &[]).output().unwrap();
    assert!(!done.status.success());
    let rows = rows(directory, "c/runs.csv");
    assert_eq!(rows.len(), 2);
    assert_eq!((rows[0]["name"].as_str(), rows[0]["error"].as_str()), ("d_0.163", ""));
    assert_eq!((rows[1]["name"].as_str(), rows[1]["tank.d"].as_str()), ("d_-1", "-1"));
    assert!(rows[1]["error"].contains("tank.d"), "{}", rows[1]["error"]);
    assert!(text(directory, "c/report.html").contains("d_-1"));
}

#[test]
fn a_wrong_plan_writes_nothing_and_reports_every_fault() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let plan = "profile = \"sine:frequncy=1\"\n[set]\ntank.hh = 1\n";
    let done = campaign(directory, plan, "c", &[]).output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(!done.status.success() && !directory.join("c").exists());
    for words in ["\"frequncy\"", "\"tank.hh\"", "did you mean \"tank.h\""] {
        assert!(said.contains(words), "{said}");
    }
    let done = hubslosh(directory, &["campaign", "--plan", "plan.toml", "--fills", "0.1"]).output();
    let said = String::from_utf8(done.unwrap().stderr).unwrap();
    assert!(said.contains("--plan") && said.contains("--fills"), "{said}");
}

/// The output directory has quotes, spaces and `$(…)` in its name. A shell that runs the report's
/// command must see one argument.
#[test]
fn the_command_in_the_report_is_quoted_for_the_shell() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let out = "it's $(touch here) `touch there` \"c\"";
    let plan = "profile = \"sine:duration=0.2\"\n";
    successful(campaign(directory, plan, out, &[]));
    let page = text(directory, &format!("{out}/report.html"));
    let command = page.split("<code>hubslosh campaign ").nth(1).unwrap();
    let command = command.split("</code>").next().unwrap();
    let command = [("&quot;", "\""), ("&#39;", "'"), ("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&")]
        .iter()
        .fold(command.to_string(), |text, (escaped, plain)| text.replace(escaped, plain));
    let words = shlex::split(&command).unwrap();
    let value = |flag: &str| &words[words.iter().position(|word| word == flag).unwrap() + 1];
    assert_eq!(value("--out"), out);
    assert_eq!(*value("--plan"), format!("{out}/plan.toml"));
    if cfg!(unix) {
        let program = env!("CARGO_BIN_EXE_hubslosh");
        let done = Command::new("sh")
            .current_dir(directory)
            .args(["-c", &format!("{program} campaign {command}")])
            .output()
            .unwrap();
        assert!(String::from_utf8_lossy(&done.stdout).contains("0 runs simulated, 1 reused"));
        assert!(!directory.join("here").exists() && !directory.join("there").exists());
    }
}

#[test]
fn a_runs_name_may_be_any_text_that_is_not_empty_or_too_long_for_a_file_name() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let plan = "profile = \"exp-sweep:f0=2,f1=2.8,duration=60\"\n\
        [[run]]\nname = \"<!--<script>\"\n[[run]]\nname = \"</script>\"\nhub.I = 0.3\n";
    successful(campaign(directory, plan, "c", &[]));
    let page = text(directory, "c/report.html");
    let figures = page.split("id=\"figures\">").nth(1).unwrap().split("</script>").next().unwrap();
    assert!(!figures.contains('<'), "nothing in the data starts or ends an element");
    let figures: serde_json::Value = serde_json::from_str(figures).unwrap();
    let names = figures.to_string();
    assert!(names.contains("<!--<script>") && names.contains("</script>"), "the figures name them");
    assert!(!page.contains("<!--<script>"));
    for name in ["", &"x".repeat(201)] {
        let plan = format!("profile = \"sine:duration=1\"\n[[run]]\nname = \"{name}\"\n");
        let done = campaign(directory, &plan, "d", &[]).output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert!(!done.status.success() && said.contains("must have 1 to 200 bytes"), "{said}");
    }
    assert!(!directory.join("d").exists());
    // A name that is composed from several parts is cut if it is too long.
    let long = "long".repeat(50);
    let plan = format!(
        "profile = \"sine:duration=0.2\"\n[[run]]\nname = \"{long}\"\n[vary]\nhub.I = [0.3, 0.4]\n"
    );
    let said = successful(campaign(directory, &plan, "e", &[])).stdout;
    assert!(String::from_utf8_lossy(&said).contains("2 runs simulated"));
    let names: Vec<String> =
        rows(directory, "e/runs.csv").iter().map(|row| row["name"].clone()).collect();
    assert!(
        names.iter().all(|name| name.len() == 200 && name.starts_with("longlong")),
        "{names:?}"
    );
    assert_ne!(names[0], names[1]);
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn the_command_in_the_report_makes_the_same_tables_again() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let fmu = packed_for_tests().to_str().unwrap();
    // A campaign that was started with flags also writes a plan.
    successful(hubslosh(
        directory,
        &[
            "campaign",
            "--fmu",
            fmu,
            "--model",
            "linear",
            "--fills",
            "0.1",
            "--amplitudes",
            "0.1",
            "--set",
            "hub.I=0.35",
            "--out",
            "dist/campaign",
        ],
    ));
    let before = text(directory, "dist/campaign/runs.csv");
    let page = text(directory, "dist/campaign/report.html");
    let command =
        page.split("<code>hubslosh campaign ").nth(1).unwrap().split("</code>").next().unwrap();
    std::fs::remove_dir_all(directory.join("dist/campaign/runs")).unwrap();
    std::fs::remove_file(directory.join("dist/campaign/runs.csv")).unwrap();
    let arguments: Vec<&str> = ["campaign"].into_iter().chain(command.split(' ')).collect();
    let said = successful(hubslosh(directory, &arguments)).stdout;
    assert!(String::from_utf8_lossy(&said).contains("1 runs simulated"));
    assert_eq!(text(directory, "dist/campaign/runs.csv"), before);
    assert!(before.contains("linear_100mm_100"));
}

#[test]
fn hubslosh_torque_writes_the_slope_of_each_row() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let profile = "pulse:amplitude=0.2,start=0.1,width=0.1,duration=0.5";
    successful(hubslosh(
        directory,
        &["torque", "--profile", profile, "--step", "0.05", "--out", "t.csv"],
    ));
    let table = Table::read(&directory.join("t.csv"), &["time", "tau_cmd", "tau_slope"]).unwrap();
    assert_eq!(table.rows(), 11);
    assert_eq!(table.column("tau_cmd").unwrap()[1..5], [0.0, 0.2, 0.2, 0.0]);
    assert!(table.column("tau_slope").unwrap().iter().all(|slope| *slope == 0.0), "no ramps");
    for (arguments, word) in [
        (&["--profile", "sin", "--out", "a.csv"][..], "did you mean \"sine\""),
        (&["--profile", "sine", "--out", "a.txt"], ".parquet"),
        (&["--profile", "sine", "--step", "0", "--out", "a.csv"], "step"),
    ] {
        let done = hubslosh(directory, &[&["torque"], arguments].concat()).output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert!(!done.status.success() && said.contains(word), "{said}");
    }
}

#[test]
fn a_campaign_with_another_fmu_than_the_bench_stores_runs_without_analysis() {
    // the description of the bench, with another name for one of the outputs that its analysis needs
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let unpacked = directory.join("unpacked");
    let archive = std::fs::File::open(packed_for_tests()).unwrap();
    zip::ZipArchive::new(archive).unwrap().extract(&unpacked).unwrap();
    let xml = std::fs::read_to_string(unpacked.join("modelDescription.xml")).unwrap();
    let xml = xml.replace("name=\"F_radial\"", "name=\"pull\"");
    let name = format!("HubSlosh{}", std::env::consts::DLL_SUFFIX);
    let binary = unpacked.join("binaries").join(host::fmi2::PLATFORM).join(name);
    let fmu = directory.join("other.fmu");
    pack::archive::plain(&xml, &binary, "HubSlosh", None, &fmu).unwrap();
    let plan = "profile = \"sine:duration=1\"\n[vary]\nhub.I = [0.3, 0.4]\n";
    let fmu = fmu.to_str().unwrap();
    let done = successful(campaign(directory, plan, "c", &["--fmu", fmu]));
    assert!(String::from_utf8_lossy(&done.stdout).contains("2 runs simulated, 0 reused"));
    let run = Table::read(&directory.join("c/runs/I_0.3.parquet"), &["time", "tau_cmd", "pull"]);
    assert_eq!(run.unwrap().rows(), 51);
    let rows = rows(directory, "c/runs.csv");
    assert_eq!(
        (rows.len(), rows[1]["hub.I"].as_str(), rows[1]["f_res_hz"].as_str()),
        (2, "0.4", "")
    );
    assert!(!directory.join("c/features.csv").exists());
    assert!(text(directory, "c/report.html").contains("Time histories, I_0.3"));
    let done = successful(campaign(directory, plan, "c", &["--fmu", fmu]));
    assert!(String::from_utf8_lossy(&done.stdout).contains("0 runs simulated, 2 reused"));
}

//! The directory of a campaign: damaged runs, two campaigns at the same time, killed campaigns, full disks.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use analysis::random::Random;
use experiments::campaign::CURVES;
use files::output::sha256;
use files::store::{CAMPAIGN, MANIFEST, Store};
use pack::packed_for_tests;

fn campaign(directory: &Path, plan: &str) -> Command {
    std::fs::write(directory.join("given.toml"), plan).unwrap();
    std::fs::create_dir_all(directory.join("tmp")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
    command.current_dir(directory).env("TMPDIR", directory.join("tmp"));
    command.args(["campaign", "--plan", "given.toml", "--out", "c", "--fmu"]);
    command.arg(packed_for_tests());
    command
}

fn printed_texts(output: &Output) -> (String, String) {
    let [said, error] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    (said.into_owned(), error.into_owned())
}

fn successful(mut command: Command) -> (String, String) {
    let done = command.output().expect("the program runs");
    assert!(done.status.success(), "{}", printed_texts(&done).1);
    printed_texts(&done)
}

fn names(directory: &Path) -> Vec<String> {
    let names = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().file_name());
    let mut names: Vec<String> = names.map(|name| name.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn published(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = names(&directory.join("c")).into_iter().filter(|name| name.contains('.'));
    let files = files.filter(|name| !name.starts_with('.'));
    files
        .map(|name| (name.clone(), std::fs::read(directory.join("c").join(name)).unwrap()))
        .collect()
}

fn is_consistent(directory: &Path) {
    let folder = directory.join("c");
    let manifest = std::fs::read_to_string(folder.join(MANIFEST)).unwrap();
    // If several lines of the manifest have the same file name, the last one is valid.
    let sums: BTreeMap<&str, &str> =
        manifest.lines().map(|line| line.split_once("  ").unwrap()).map(|(s, n)| (n, s)).collect();
    for (name, sum) in sums {
        if let Ok(bytes) = std::fs::read(folder.join(name)) {
            assert_eq!(sha256(&bytes), sum, "{name}");
        }
    }
    let plan = sha256(&std::fs::read(folder.join("plan.toml")).unwrap());
    for table in ["features.csv", "features_spa.csv", "features_h1.csv", "runs.csv"] {
        let mut reader = csv::Reader::from_path(folder.join(table)).unwrap();
        let last = reader.headers().unwrap().len() - 1;
        assert_eq!(&reader.headers().unwrap()[last], "plan_sha256", "{table}");
        for row in reader.records() {
            assert_eq!(&row.unwrap()[last], plan, "{table}");
        }
    }
}

/// One bit of each of 50 stored runs is flipped. The next campaign simulates these runs again and
/// has the tables of the first.
#[test]
fn every_flipped_bit_in_a_stored_run_is_noticed() {
    const RUNS: usize = 50;
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let inertias: Vec<f64> = (0..RUNS).map(|i| 0.3 + i as f64 / 1000.0).collect();
    let plan = format!("profile = \"sine:duration=0.2\"\n[vary]\nhub.I = {inertias:?}\n");
    successful(campaign(directory, &plan));
    is_consistent(directory);
    let before = published(directory);
    let runs: Vec<PathBuf> =
        names(&directory.join("c/runs")).iter().map(|n| directory.join("c/runs").join(n)).collect();
    assert_eq!(runs.len(), RUNS);
    let whole: Vec<Vec<u8>> = runs.iter().map(|run| std::fs::read(run).unwrap()).collect();
    let mut random = Random::new(1, 0);
    let mut draw = |below: usize| (random.uniform() * below as f64) as usize;
    // 200 bits are flipped, one in each of 50 runs, four times
    for _ in 0..4 {
        for (run, bytes) in runs.iter().zip(&whole) {
            let mut bytes = bytes.clone();
            let (byte, bit) = (draw(bytes.len()), draw(8));
            bytes[byte] ^= 1 << bit;
            std::fs::write(run, bytes).unwrap();
        }
        let (said, error) = successful(campaign(directory, &plan));
        assert!(said.contains("50 runs simulated, 0 reused"), "{said}");
        assert_eq!(
            error
                .matches("the SHA-256 of the file differs from the one in manifest.sha256")
                .count(),
            RUNS
        );
        for (run, bytes) in runs.iter().zip(&whole) {
            assert!(std::fs::read(run).unwrap() == *bytes, "{} is as it was", run.display());
        }
        assert!(
            published(directory) == before,
            "tables, plan, report and manifest are as they were"
        );
    }
}

#[test]
fn a_damaged_run_that_the_manifest_does_not_list_is_never_reused() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let plan = "profile = \"sine:duration=0.2\"\n[vary]\nhub.I = [0.3, 0.31]\n";
    successful(campaign(directory, plan));
    let before = published(directory);
    let manifest = directory.join("c").join(MANIFEST);
    let text = std::fs::read_to_string(&manifest).unwrap();
    let run = directory.join("c/runs").join(&names(&directory.join("c/runs"))[0]);
    let name = format!("runs/{}", run.file_name().unwrap().to_string_lossy());
    let whole = std::fs::read(&run).unwrap();
    let mut flipped = whole.clone();
    flipped[100] ^= 1;
    // If a line of the manifest is lost, its run is simulated again, and the command says so.
    let without: String = text.split_inclusive('\n').filter(|line| !line.contains(&name)).collect();
    for damaged in [without, String::new()] {
        std::fs::write(&run, &flipped).unwrap();
        std::fs::write(&manifest, damaged).unwrap();
        let (_, error) = successful(campaign(directory, plan));
        assert!(error.contains("the run has no line in manifest.sha256"), "{error}");
        assert!(std::fs::read(&run).unwrap() == whole);
        assert!(published(directory) == before);
    }
    // the file of a run is lost
    std::fs::remove_file(&run).unwrap();
    let (_, error) = successful(campaign(directory, plan));
    assert!(error.contains(": the file of the run is missing"), "{error}");
    // the manifest is lost, and the run is damaged
    std::fs::write(&run, &flipped).unwrap();
    std::fs::remove_file(&manifest).unwrap();
    let done = campaign(directory, plan).output().unwrap();
    let (_, error) = printed_texts(&done);
    assert_eq!(done.status.code(), Some(1), "{error}");
    assert!(error.contains("nothing verifies the stored runs; restore it, or remove"), "{error}");
    std::fs::remove_dir_all(directory.join("c/runs")).unwrap();
    successful(campaign(directory, plan));
    assert!(published(directory) == before);
}

#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_large_campaign_keeps_the_curves_of_some_runs_and_the_numbers_of_all() {
    const RUNS: usize = CURVES + 10;
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let inertias: Vec<f64> = (0..RUNS).map(|i| 0.3 + i as f64 / 10_000.0).collect();
    let plan = format!("profile = \"sine:duration=0.06\"\n[vary]\nhub.I = {inertias:?}\n");
    successful(campaign(directory, &plan));
    let rows = |name: &str| {
        let mut reader = csv::Reader::from_path(directory.join("c").join(name)).unwrap();
        reader.records().map(Result::unwrap).collect::<Vec<_>>()
    };
    let all = rows("runs.csv");
    assert_eq!(all.len(), RUNS);
    let report = std::fs::read_to_string(directory.join("c/report.html")).unwrap();
    // The report draws every second run and the last one.
    let words = format!("drawn of {} of the {RUNS} runs", RUNS / 2 + 1);
    assert!(report.contains(&words), "{words}");
    // A run whose curves are not kept has the same numbers as in a campaign of this run only.
    let alone = format!("profile = \"sine:duration=0.06\"\n[vary]\nhub.I = [{:?}]\n", inertias[1]);
    successful(campaign(directory, &alone));
    let [one] = &rows("runs.csv")[..] else { panic!() };
    let same = |row: &csv::StringRecord| {
        // the last column is left out, because it is the hash of the plan
        row.iter().take(row.len() - 1).map(String::from).collect::<Vec<_>>()
    };
    assert!(all.iter().any(|row| same(row) == same(one)), "{one:?}");
}

#[test]
fn a_second_campaign_in_a_directory_is_refused_with_the_name_of_the_first() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    let plan = "title = \"Second\"\nprofile = \"sine:duration=0.2\"\n";
    let first = Store::take(&directory.join("c"), CAMPAIGN, "the plan \"First\"", None).unwrap();
    let done = campaign(directory, plan).output().unwrap();
    let (_, error) = printed_texts(&done);
    assert_eq!(done.status.code(), Some(1), "{error}");
    for words in ["c is in use by another campaign", "the plan \"First\"", "--out DIRECTORY"] {
        assert!(error.contains(words), "\"{words}\" is not in: {error}");
    }
    assert!(error.contains(&format!("process {}", std::process::id())), "{error}");
    assert!(names(&directory.join("c/runs")).is_empty(), "it made no run");
    drop(first);
    successful(campaign(directory, plan));
}

/// A plan whose campaign can be interrupted: it has a run of one second, then runs of an hour.
#[cfg(unix)]
const INTERRUPTED: &str = "profile = \"zero\"\n[vary]\nprofile = [\"sine:duration=1\", \
    \"exp-sweep:duration=40000,amplitude=0.05\", \"exp-sweep:duration=40000,amplitude=0.06\", \
    \"exp-sweep:duration=40000,amplitude=0.04\", \"exp-sweep:duration=40000,amplitude=0.03\"]\n";

#[cfg(unix)]
#[test]
fn a_campaign_ended_by_a_signal_leaves_the_last_results_and_no_temporary_file() {
    use std::os::unix::process::ExitStatusExt;
    use std::process::Stdio;
    for (signal, number) in [("TERM", 15), ("INT", 2), ("KILL", 9)] {
        let directory = tempfile::tempdir().unwrap();
        let directory = directory.path();
        let plan = "title = \"A\"\nprofile = \"sine:duration=0.2\"\n";
        successful(campaign(directory, plan));
        let before = published(directory);
        let mut other = campaign(directory, INTERRUPTED);
        let mut child = other.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        // waits until the run is in the manifest and has its final name
        while !directory.join("c/runs/sine.parquet").exists() {
            assert!(child.try_wait().unwrap().is_none(), "it ended before its first run");
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        assert!(!names(&directory.join("tmp")).is_empty(), "the FMU is unpacked there");
        let kill =
            Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status();
        assert!(kill.unwrap().success());
        assert_eq!(child.wait().unwrap().signal(), Some(number), "it dies of the signal");
        is_consistent(directory);
        let after = published(directory);
        for (name, bytes) in &before {
            assert!(name == MANIFEST || after[name] == *bytes, "{name} is as it was");
        }
        assert_eq!(before.len(), after.len());
        if signal != "KILL" {
            assert_eq!(names(&directory.join("tmp")), [""; 0], "SIG{signal}");
            assert!(!directory.join("c/.unfinished").exists(), "SIG{signal}");
        }
        // The next start removes temporary files, and reuses the completed runs.
        successful(campaign(directory, plan));
        assert_eq!(names(&directory.join("tmp")), [""; 0], "SIG{signal}");
        assert!(!directory.join("c/.unfinished").exists(), "SIG{signal}");
        is_consistent(directory);
        let first = "profile = \"zero\"\n[vary]\nprofile = [\"sine:duration=1\"]\n";
        let (said, _) = successful(campaign(directory, first));
        assert!(said.contains("0 runs simulated, 1 reused"), "{said}");
        is_consistent(directory);
    }
}

#[cfg(unix)]
fn with_file_size_limit(command: &Command, blocks: usize) -> Command {
    let mut shell = Command::new("sh");
    // POSIX counts blocks of 512 bytes. With the signal ignored, a write beyond the limit fails as on a full disk.
    shell.args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"")]);
    shell.arg(command.get_program()).args(command.get_args());
    shell.current_dir(command.get_current_dir().unwrap());
    shell.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
    shell
}

/// A limit on file size makes the report of a second campaign fail in the directory of a completed
/// campaign.
#[cfg(unix)]
#[test]
fn a_full_disk_gives_an_error_with_the_file_and_leaves_the_last_results() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    // four runs of 60 s, so that the report is larger than the FMU's binary
    let vary = "[vary]\nslosh.model = [\"frozen\", \"linear\", \"planar\", \"spherical\"]\n";
    let plan = format!("title = \"A\"\nprofile = \"sine:duration=60\"\n{vary}");
    successful(campaign(directory, &plan));
    let before = published(directory);
    // the limit is 4 KiB below the size of the report, which is larger than the FMU's binary and smaller than a
    // run of a sweep
    let room = before["report.html"].len() / 512 - 8;
    let sweep = "title = \"B\"\nprofile = \"exp-sweep:duration=2700\"\n";
    let short = format!("title = \"C\"\nprofile = \"sine:duration=61\"\n{vary}");
    for (plan, file) in [(sweep, "c/runs/linear_100mm_100.parquet"), (&short, "c/report.html")] {
        let done = with_file_size_limit(&campaign(directory, plan), room).output().unwrap();
        let (_, error) = printed_texts(&done);
        assert_eq!(done.status.code(), Some(1), "{error}");
        assert!(error.contains(file), "{file} is not in: {error}");
        let after = published(directory);
        for (name, bytes) in &before {
            assert!(name == MANIFEST || after[name] == *bytes, "{name} is as it was");
        }
        is_consistent(directory);
        assert!(!directory.join("c/.unfinished").exists());
        assert_eq!(names(&directory.join("tmp")), [""; 0]);
    }
    let mut torque = Command::new(env!("CARGO_BIN_EXE_hubslosh"));
    torque.current_dir(directory).args(["torque", "--profile", "exp-sweep", "--out", "t.csv"]);
    let done = with_file_size_limit(&torque, room).output().unwrap();
    let (_, error) = printed_texts(&done);
    assert!(!done.status.success() && error.contains("t.csv cannot be written"), "{error}");
    assert!(!directory.join("t.csv").exists());
}

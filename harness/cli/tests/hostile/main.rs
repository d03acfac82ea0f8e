//! FMUs that harm the programs that open or run them: archives and descriptions that need more memory than a machine
//! has, and binaries that end or block the process, or fill memory or disk. Each command ends with a message, within
//! 500 MB of memory and 100 MB of temporary files, and no process is left.

#![cfg(target_os = "linux")]

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

use host::fmi2::PLATFORM;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

const MEMORY: i64 = 500 << 20;
const DISK: u64 = 100 << 20;

/// Runs the program in a folder of its own, with another folder for temporary files.
struct Sandbox {
    directory: tempfile::TempDir,
}

impl Sandbox {
    fn new() -> Sandbox {
        let sandbox = Sandbox { directory: tempfile::tempdir().unwrap() };
        std::fs::create_dir(sandbox.temporary()).unwrap();
        sandbox
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn temporary(&self) -> PathBuf {
        self.path("temporary")
    }

    /// Runs a command to its end, and asserts that it leaves neither a process nor a temporary
    /// file.
    fn hubslosh(&self, arguments: &[&str]) -> Output {
        let temporary = self.temporary();
        let marker = format!("HOSTILE={}", self.directory.path().display());
        let child = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
            .args(arguments)
            .current_dir(self.directory.path())
            .env("TMPDIR", &temporary)
            .env("HOSTILE", self.directory.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (ended, most) = (AtomicBool::new(false), std::sync::Mutex::new(0));
        let output = std::thread::scope(|scope| {
            scope.spawn(|| {
                while !ended.load(Ordering::Relaxed) {
                    let now = size(&temporary);
                    let mut most = most.lock().unwrap();
                    *most = now.max(*most);
                    std::thread::sleep(std::time::Duration::from_millis(5));
                }
            });
            let output = child.wait_with_output().unwrap();
            ended.store(true, Ordering::Relaxed);
            output
        });
        let said = String::from_utf8_lossy(&output.stderr);
        let start: String = said.chars().take(2000).collect();
        let most = *most.lock().unwrap();
        assert!(most <= DISK, "{arguments:?}: {most} bytes of temporary files\n{start}");
        let left: Vec<_> = std::fs::read_dir(&temporary).unwrap().flatten().collect();
        assert!(left.is_empty(), "{arguments:?} leaves {left:?}\n{start}");
        assert_eq!(processes_with(&marker), [""; 0], "{arguments:?} leaves processes\n{start}");
        assert!(output.stdout.len() + output.stderr.len() < 1 << 20, "{arguments:?} floods");
        output
    }

    fn expect_failure(&self, arguments: &[&str]) -> String {
        let output = self.hubslosh(arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(said.contains("error: ") && !said.contains("panicked"), "{arguments:?}: {said}");
        said
    }
}

fn size(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .map(|entry| match entry.metadata() {
            Ok(about) if about.is_dir() => size(&entry.path()),
            Ok(about) => about.len(),
            Err(_) => 0,
        })
        .sum()
}

fn processes_with(marker: &str) -> Vec<String> {
    let folders = std::fs::read_dir("/proc").unwrap().flatten();
    let has = |folder: &PathBuf| {
        let environment = std::fs::read(folder.join("environ")).unwrap_or_default();
        environment.split(|byte| *byte == 0).any(|variable| variable == marker.as_bytes())
    };
    folders.map(|entry| entry.path()).filter(has).map(|path| path.display().to_string()).collect()
}

/// Asserts that no process that has ended since this program began has used more than [`MEMORY`].
fn memory_was_enough() {
    use nix::sys::resource::{UsageWho, getrusage};
    let most = getrusage(UsageWho::RUSAGE_CHILDREN).unwrap().max_rss() << 10;
    assert!(most <= MEMORY, "a process took {most} bytes of memory");
}

type Files<'a> = Vec<(&'a str, Vec<u8>)>;

fn zipped(files: &Files) -> Vec<u8> {
    let mut to = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        to.start_file(*name, SimpleFileOptions::default()).unwrap();
        to.write_all(bytes).unwrap();
    }
    to.finish().unwrap().into_inner()
}

const HEAD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="model" guid="{model}" numberOfEventIndicators="0">"#;
const STEPPING: &str = r#"
<CoSimulation modelIdentifier="model" canHandleVariableCommunicationStepSize="true"/>
<DefaultExperiment startTime="0" stopTime="10" stepSize="0.01"/>
<ModelVariables>
<ScalarVariable name="x" valueReference="0" causality="output" variability="continuous" initial="exact"><Real start="1"/></ScalarVariable>
<ScalarVariable name="u" valueReference="3" causality="input" variability="continuous"><Real start="0"/></ScalarVariable>"#;
const TAIL: &str = r#"</ModelVariables>
<ModelStructure><Outputs><Unknown index="1" dependencies="2"/></Outputs></ModelStructure>
</fmiModelDescription>"#;

fn xml(variables: &str) -> Vec<u8> {
    format!("{HEAD}{STEPPING}{variables}{TAIL}").into_bytes()
}

fn with_size(mut bytes: Vec<u8>, size: u32) -> Vec<u8> {
    let central = bytes.windows(4).position(|four| four == b"PK\x01\x02").unwrap();
    for at in [22, central + 24] {
        bytes[at..at + 4].copy_from_slice(&size.to_le_bytes());
    }
    bytes
}

#[test]
fn hostile_archives_and_descriptions_are_refused_by_every_command() {
    const NAME: &str = "modelDescription.xml";
    let described = |text: Vec<u8>| zipped(&vec![(NAME, text)]);
    let plus = |name: &str, content: Vec<u8>| zipped(&vec![(NAME, xml("")), (name, content)]);
    let variable = r#"<ScalarVariable name="v" valueReference="1"><Real/></ScalarVariable>"#;
    let one = |attribute: &str, text: String| {
        xml(&variable.replace(attribute, &attribute.replace(['v', '1'], &text)))
    };
    let many: Vec<String> = (0..20_000).map(|n| format!("resources/{n}")).collect();
    let many: Files = many.iter().map(|name| (name.as_str(), Vec::new())).collect();
    let attributes: String = (0..199).map(|n| format!(" a{n}=''")).collect();
    let spaces: String = (0..150).map(|n| format!(" xmlns:a{n}='a{n}'")).collect();
    let items = "<Item name='i' value='1'/>".repeat(100_000);
    let types = format!(
        "<TypeDefinitions><SimpleType name='t'><Enumeration>{items}</Enumeration></SimpleType>\
         </TypeDefinitions>"
    );
    let entities = "<!DOCTYPE a [<!ENTITY b \"bbbbbbbbbb\"><!ENTITY c \"&b;&b;&b;\">]>";
    // Only archives that unpack to a very large size have to be large. Zeros compress to a thousandth.
    let mut set: Vec<(&str, Vec<u8>, &str)> = vec![
        ("an empty file", Vec::new(), "archive"),
        ("no archive", b"PK\x05\x06 and no more".to_vec(), "archive"),
        ("half an archive", described(xml(""))[..400].to_vec(), "archive"),
        ("zeros", plus("resources/zeros", vec![0; 200 << 20]), "the archive unpacks to"),
        (
            "4 GB by the header",
            with_size(described(xml("")), u32::MAX - 1),
            "the archive unpacks to 429496",
        ),
        ("2 bytes by the header", with_size(described(xml("")), 2), "its declared"),
        ("20,001 entries", zipped(&[vec![(NAME, xml(""))], many].concat()), "20001 entries"),
        (
            "a name of 60,000 bytes",
            plus(&"n".repeat(60_000), Vec::new()),
            "a name in the archive has 60000",
        ),
        ("a way out", plus("../../outside", Vec::new()), "leads out"),
        ("an absolute name", plus("/tmp/outside", Vec::new()), "absolute"),
        ("a backslash", plus("..\\outside", Vec::new()), "backslash"),
        (
            "white space",
            described([HEAD.as_bytes(), &vec![b'\n'; 60 << 20]].concat()),
            "bytes (allowed",
        ),
        ("elements", described(xml(&"<a/>".repeat(400_001))), "more elements"),
        (
            "attributes",
            described(xml(&format!("<a{attributes}/>").repeat(5100))),
            "more attributes",
        ),
        (
            "200 attributes",
            described(xml(&format!("<a{attributes} b='' c=''/>"))),
            "201 attributes",
        ),
        ("namespaces", described(xml(&format!("<a{spaces}/>"))), "150 namespaces"),
        ("levels", described(xml(&"<a>".repeat(200_000))), "deeper"),
        ("a value of 2 MB", described(one("\"1\"", "1".repeat(2 << 20))), "an attribute has 20971"),
        (
            "a tag of 70,000 bytes",
            described(xml(&format!("<{}/>", "n".repeat(70_000)))),
            "a name has 7000",
        ),
        ("entities", described([entities.as_bytes(), &xml("")].concat()), "DTD"),
        (
            "a library outside",
            described(
                String::from_utf8(xml(""))
                    .unwrap()
                    .replace("\"model\" can", "\"../../model\" can")
                    .into(),
            ),
            "modelIdentifier",
        ),
    ];
    // archives that `check` opens, because it reports the fault and continues
    let taken_by_check =
        ["a variable of 70,000 bytes", "100,000 items", "variables without anything"];
    set.push((
        "a variable of 70,000 bytes",
        described(one("\"v\"", "v".repeat(70_000))),
        "70000 bytes long",
    ));
    set.push((
        "100,000 items",
        described(format!("{HEAD}{types}{STEPPING}{TAIL}").into()),
        "100000 types",
    ));
    set.push((
        "variables without anything",
        described(xml(&"<ScalarVariable/>".repeat(290_000))),
        "more like these",
    ));
    let sandbox = Sandbox::new();
    for (name, bytes, words) in &set {
        std::fs::write(sandbox.path("a.fmu"), bytes).unwrap();
        if *name != "a library outside" {
            let said = sandbox.expect_failure(&["variables", "--fmu", "a.fmu"]);
            assert!(said.contains(words), "{name}: {said}");
        }
        let run = ["run", "--profile", "zero", "--stop", "1", "--fmu", "a.fmu", "--out", "a.csv"];
        let said = sandbox.expect_failure(&run);
        assert!(said.contains(words), "{name}: {said}");
        let output = sandbox.hubslosh(&["check", "a.fmu"]);
        let report = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(1), "{name}: {report}");
        assert!(taken_by_check.contains(name) || report.contains("error "), "{name}: {report}");
    }
    memory_was_enough();
}

fn harmful(harm: u32, when: &str) -> Vec<u8> {
    packed(harm, when, xml(""))
}

fn with_description(xml: Vec<u8>) -> Vec<u8> {
    packed(0, "AT_STEP", xml)
}

fn packed(harm: u32, when: &str, xml: Vec<u8>) -> Vec<u8> {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("model.so");
    let done = Command::new("cc")
        .args(["-std=gnu11", "-O0", "-w", "-shared", "-fPIC", "-DRATE=1", "-DCO_SIMULATION"])
        .args([format!("-DHARM={harm}"), format!("-D{when}"), "-o".into()])
        .arg(&out)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hostile/hostile.c"))
        .arg("-lm")
        .output()
        .expect("a C compiler is there");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let binary = format!("binaries/{PLATFORM}/model.so");
    zipped(&vec![("modelDescription.xml", xml), (binary.as_str(), std::fs::read(out).unwrap())])
}

const HARMS: [&str; 12] = [
    "exits with 0",
    "aborts",
    "crashes",
    "loops",
    "sleeps",
    "takes all memory",
    "maps all memory",
    "takes all of the stack",
    "fills the disk",
    "prints 1 GB",
    "starts processes and exits",
    "stops itself",
];
const LOUD: &str = "prints 1 GB";

fn ends_its_own_process(when: &str) {
    let sandbox = Sandbox::new();
    std::fs::write(sandbox.path("plan.toml"), "title = \"a\"\nprofile = \"zero:duration=1\"\n")
        .unwrap();
    for (harm, name) in HARMS.iter().enumerate() {
        let fmu = format!("{harm}{when}.fmu");
        std::fs::write(sandbox.path(&fmu), harmful(harm as u32 + 1, when)).unwrap();
        let what = format!("{name}, {when}");
        let run = [
            "run",
            "--call-limit",
            "0.5",
            "--profile",
            "zero",
            "--stop",
            "0.02",
            "--fmu",
            &fmu,
            "--out",
            "a.csv",
        ];
        let campaign = [
            "campaign",
            "--call-limit",
            "0.5",
            "--plan",
            "plan.toml",
            "--fmu",
            &fmu,
            "--out",
            "campaign",
            "--force",
        ];
        let output = sandbox.hubslosh(&["variables", "--fmu", &fmu]);
        assert!(output.status.success(), "{what}: a description is not a binary");
        if *name == LOUD {
            // Printing a gigabyte through a pipe may take longer than the limit of the other cases.
            let patient: Vec<&str> =
                run.iter().copied().filter(|a| !matches!(*a, "--call-limit" | "0.5")).collect();
            let output = sandbox.hubslosh(&patient);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{what}: {said}");
        } else {
            for command in [&run[..], &campaign[..]] {
                let said = sandbox.expect_failure(command);
                let told = said.contains("the FMU has ended the process")
                    || said.contains("has not returned within 0.5 s");
                assert!(told, "{what}: {said}");
            }
        }
        // Only rules that notice the fault are checked; with all rules, every step of every rule would wait
        // for the endless call.
        let only = if when == "AT_LOAD" { "load" } else { "load,host.silent,steps.run" };
        let output = sandbox.hubslosh(&["check", &fmu, "--limit", "1", "--only", only]);
        let report = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(1), "{what}: {report}");
        let told = ["the process ended", "have not ended after 1 s", "the FMU prints"];
        assert!(told.iter().any(|words| report.contains(words)), "{what}: {report}");
    }
    memory_was_enough();
}

/// FMU binaries crash, exit, loop or fill the memory while they are loaded.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_binary_that_does_harm_when_loaded_ends_only_its_own_process_and_every_command_reports_it() {
    ends_its_own_process("AT_LOAD");
}

#[test]
fn a_binary_that_does_harm_in_a_step_ends_only_its_own_process_and_every_command_reports_it() {
    ends_its_own_process("AT_STEP");
}

/// A malicious FMU writes into the pipe through which its guarded process reports to hubslosh.
#[test]
fn messages_that_an_fmu_forges_in_the_pipe_of_its_process_are_refused() {
    const FORGE: u32 = 19;
    let sandbox = Sandbox::new();
    for when in ["AT_LOAD", "AT_STEP"] {
        std::fs::write(sandbox.path("a.fmu"), harmful(FORGE, when)).unwrap();
        let run = ["run", "--profile", "zero", "--stop", "0.1", "--fmu", "a.fmu", "--out", "a.csv"];
        let said = sandbox.expect_failure(&run);
        assert!(said.contains("the FMU has written to, or has closed, the pipe"), "{when}: {said}");
        let only = if when == "AT_LOAD" { "load.opens" } else { "steps.run" };
        let output = sandbox.hubslosh(&["check", "a.fmu", "--only", only]);
        let report = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(1), "{when}: {report}");
        assert!(
            report.contains("the FMU writes to a file or connection of the host"),
            "{when}: {report}"
        );
    }
}

/// An FMU fills temporary files, memfd or mapped memory beyond `--memory 48`.
#[test]
fn temporary_files_and_shared_memory_count_against_the_memory_limit() {
    const FIRST: u32 = 15;
    let sandbox = Sandbox::new();
    for (harm, what) in (FIRST..).zip(["files", "unlinked files", "memfd", "mapped memory"]) {
        std::fs::write(sandbox.path("a.fmu"), harmful(harm, "AT_STEP")).unwrap();
        let run = ["run", "--memory", "48", "--profile", "zero", "--stop", "0.1"];
        let said =
            sandbox.expect_failure(&[&run[..], &["--fmu", "a.fmu", "--out", "a.csv"]].concat());
        assert!(said.contains("of the FMU take more than 48 MiB"), "{what}: {said}");
        assert!(!sandbox.path("a.csv").exists(), "{what}");
    }
}

/// The binary of an FMU changes the floating-point control word while it is loaded. `hubslosh
/// check` reports it and `hubslosh run` warns.
#[test]
fn changes_of_the_process_by_loading_an_fmu_are_reported() {
    const FLUSH: u32 = 13;
    let sandbox = Sandbox::new();
    std::fs::write(sandbox.path("a.fmu"), harmful(FLUSH, "AT_LOAD")).unwrap();
    let output = sandbox.hubslosh(&["check", "a.fmu", "--only", "host.untouched"]);
    let report = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(report.contains("the FMU changes the floating-point control"), "{report}");
    let run = ["run", "--profile", "zero", "--stop", "0.1", "--fmu", "a.fmu", "--out", "a.csv"];
    let said = sandbox.hubslosh(&run).stderr;
    let said = String::from_utf8_lossy(&said);
    assert!(said.contains("warning: loading a.fmu has changed"), "{said}");
}

#[test]
fn a_call_that_never_returns_fails_the_run_at_the_call_limit() {
    const LOOP: u32 = 4;
    let sandbox = Sandbox::new();
    std::fs::write(sandbox.path("a.fmu"), harmful(LOOP, "AT_GET")).unwrap();
    let run = ["run", "--call-limit", "0.5", "--profile", "zero", "--stop", "0.1"];
    let said = sandbox.expect_failure(&[&run[..], &["--fmu", "a.fmu", "--out", "a.csv"]].concat());
    assert!(said.contains("has not returned within 0.5 s"), "{said}");
}

#[test]
fn a_run_with_nan_or_without_values_fails() {
    const NONE: u32 = 14;
    let sandbox = Sandbox::new();
    std::fs::write(sandbox.path("a.fmu"), harmful(NONE, "AT_GET")).unwrap();
    let plan = "title = \"a\"\nprofile = \"zero:duration=1\"\n";
    std::fs::write(sandbox.path("plan.toml"), plan).unwrap();
    let run = ["run", "--profile", "zero", "--stop", "0.1", "--fmu", "a.fmu", "--out", "a.csv"];
    let campaign = ["campaign", "--plan", "plan.toml", "--fmu", "a.fmu", "--out", "campaign"];
    for command in [&run[..], &campaign[..]] {
        let said = sandbox.expect_failure(command);
        assert!(said.contains("the FMU gives x = NaN at t = 0.06 s"), "{said}");
    }
    assert!(!sandbox.path("a.csv").exists());

    let local = |text: String| text.replace("causality=\"output\"", "causality=\"local\"");
    let silent = local(String::from_utf8(xml("")).unwrap());
    let silent = silent.replace("<Outputs><Unknown index=\"1\" dependencies=\"2\"/></Outputs>", "");
    std::fs::write(sandbox.path("b.fmu"), with_description(silent.into_bytes())).unwrap();
    let nothing = "nothing would be recorded";
    for command in [&run[..], &campaign[..]] {
        let command: Vec<_> =
            command.iter().map(|&a| if a == "a.fmu" { "b.fmu" } else { a }).collect();
        let said = sandbox.expect_failure(&command);
        assert!(said.contains(nothing), "{said}");
    }
}

//! `hubslosh check` on FMUs 3.0: a model without a fault (model3.c, model3.xml) keeps every rule, and copies of it
//! that are wrong in one way break the rule that is meant.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use ::check::rules::fmi3;
use ::check::{self, Options, Report};
use host::fmi3::PLATFORM;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

const XML: &str = include_str!("model3.xml");
const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/model3.c");

/// The model's library, with a fault of its own.
fn library(folder: &Path, mutant: u32) -> PathBuf {
    let path = folder.join(format!("{mutant}{}", std::env::consts::DLL_SUFFIX));
    let done = Command::new("cc")
        .args([
            "-std=gnu11",
            "-O1",
            "-fPIC",
            "-shared",
            &format!("-DMUTANT={mutant}"),
            SOURCE,
            "-o",
        ])
        .arg(&path)
        .arg("-lm")
        .status()
        .unwrap();
    assert!(done.success());
    path
}

fn binary() -> String {
    format!("binaries/{PLATFORM}/Model3{}", std::env::consts::DLL_SUFFIX)
}

type Files = Vec<(String, Vec<u8>)>;

/// The files of the model.
fn files(library: &Path) -> Files {
    vec![("modelDescription.xml".into(), XML.into()), (binary(), std::fs::read(library).unwrap())]
}

fn pack(files: &Files, path: &Path) {
    let mut to = ZipWriter::new(std::fs::File::create(path).unwrap());
    for (name, bytes) in files {
        to.start_file(name.as_str(), SimpleFileOptions::default()).unwrap();
        to.write_all(bytes).unwrap();
    }
    to.finish().unwrap();
}

fn look(path: &Path, only: &[&str]) -> Report {
    let options = Options {
        program: PathBuf::from(env!("CARGO_BIN_EXE_hubslosh")),
        only: only.iter().map(|rule| rule.to_string()).collect(),
        limit: Duration::from_secs(60),
    };
    check::check(path, &options, |_| {}).unwrap()
}

fn broken(report: &Report) -> BTreeSet<&'static str> {
    report.all().map(|(rule, _)| rule.id).collect()
}

/// The file of the model without a fault.
fn model(folder: &Path) -> PathBuf {
    let path = folder.join("Model3.fmu");
    pack(&files(&library(folder, 0)), &path);
    path
}

#[test]
fn an_fmu_3_without_a_fault_keeps_every_rule() {
    let folder = tempfile::tempdir().unwrap();
    let report = look(&model(folder.path()), &[]);
    assert_eq!(report.all().count(), 0, "{}", report.text());
    assert_eq!(report.outcomes.len(), fmi3::RULES.len());
    let skipped = report.outcomes.iter().filter(|o| o.findings.skipped.is_some());
    let skipped: Vec<_> = skipped.map(|o| o.rule.id).collect();
    // it has no licence, no terminals, no layered standard
    assert_eq!(skipped, ["zip.licenses", "zip.terminals", "zip.layered_standards"]);
}

/// A word of modelDescription.xml, what stands in its place, and the rule that tells it.
const STATIC: &[(&str, &str, &str)] = &[
    ("fmiVersion=\"3.0\"", "fmiVersion=\"3.0.2\"", "xml.fmi_version"),
    ("instantiationToken=\"{model3}\"", "instantiationToken=\"\"", "xml.token"),
    (" instantiationToken=\"{model3}\"", "", "xml.schema"),
    (
        "modelIdentifier=\"Model3\" canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\" canHandle",
        "modelIdentifier=\"Model-3\" canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\" canHandle",
        "xml.model_identifier",
    ),
    (
        "canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\" provides",
        "canSerializeFMUState=\"true\" provides",
        "xml.capabilities",
    ),
    ("providesIntermediateUpdate=\"true\" ", "", "xml.capabilities"),
    ("hasEventMode=\"true\"", "hasEventMode=\"yes\"", "xml.values"),
    ("stopTime=\"10\"", "stopTime=\"-1\"", "xml.default_experiment"),
    ("<Unit name=\"rad/s\">", "<Unit name=\"rad\">", "xml.unique"),
    ("<Item name=\"above\" value=\"2\"/>", "<Item name=\"above\" value=\"1\"/>", "xml.unique"),
    (
        "start=\"1\" unit=\"rad\" displayUnit=\"deg\"",
        "start=\"1\" unit=\"rad\" displayUnit=\"rpm\"",
        "xml.units",
    ),
    ("variability=\"continuous\" unit=\"s\"", "variability=\"continuous\" unit=\"h\"", "xml.units"),
    ("factor=\"57.29577951308232\"", "factor=\"0\"", "xml.units"),
    ("<Boolean name=\"on\"", "<Boolean declaredType=\"Side\" name=\"on\"", "xml.types"),
    ("name=\"k\"", "name=\"y\"", "xml.names"),
    (
        "intermediateUpdate=\"true\" unit=\"rad\"/>\n    <Int32",
        "intermediateUpdate=\"true\" unit=\"rad\"><Alias name=\"u\"/></Float64>\n    <Int32",
        "xml.names",
    ),
    ("name=\"der(x)\"", "name=\"dx/dt\"", "xml.structured_names"),
    ("name=\"z\" valueReference=\"8\"", "name=\"z\" valueReference=\"6\"", "xml.references"),
    (
        "name=\"n\" valueReference=\"7\" causality=\"output\" variability=\"discrete\"",
        "name=\"n\" valueReference=\"7\" causality=\"output\" variability=\"continuous\"",
        "xml.causality",
    ),
    (
        "causality=\"parameter\" variability=\"fixed\" initial=\"exact\" start=\"1\"",
        "causality=\"parameter\" variability=\"discrete\" initial=\"exact\" start=\"1\"",
        "xml.causality",
    ),
    (
        "causality=\"parameter\" variability=\"fixed\" initial=\"exact\" start=\"1\"",
        "causality=\"parameter\" variability=\"fixed\" initial=\"approx\" start=\"1\"",
        "xml.initial",
    ),
    ("initial=\"exact\" start=\"1\" unit=\"rad\"", "initial=\"exact\" unit=\"rad\"", "xml.start"),
    ("start=\"1 2 3\"", "start=\"1 2\"", "xml.start"),
    ("start=\"1 2 3\"", "start=\"1 NaN 3\"", "xml.finite"),
    ("start=\"1\" min=\"0\"", "start=\"1\" min=\"2\"", "xml.range"),
    (
        "<Boolean name=\"on\" valueReference=\"10\" causality=\"parameter\" variability=\"fixed\" initial=\"exact\" start=\"false\"/>",
        "<Enumeration name=\"on\" declaredType=\"Side\" valueReference=\"10\" causality=\"parameter\" variability=\"fixed\" initial=\"exact\" start=\"3\"/>",
        "xml.range",
    ),
    (
        "causality=\"independent\" variability=\"continuous\"",
        "causality=\"local\" variability=\"continuous\"",
        "xml.independent",
    ),
    (
        "causality=\"independent\" variability=\"continuous\"",
        "causality=\"independent\" variability=\"continuous\" start=\"0\"",
        "xml.independent",
    ),
    (
        "name=\"n\" valueReference=\"7\" causality=\"output\"",
        "name=\"n\" valueReference=\"7\" intermediateUpdate=\"true\" causality=\"output\"",
        "xml.flags",
    ),
    (
        "name=\"n\" valueReference=\"7\"",
        "name=\"n\" valueReference=\"7\" clocks=\"10\"",
        "xml.clocks",
    ),
    ("<Dimension start=\"3\"/>", "<Dimension start=\"3\" valueReference=\"5\"/>", "xml.dimensions"),
    ("<Dimension start=\"3\"/>", "<Dimension valueReference=\"7\"/>", "xml.dimensions"),
    ("<Dimension start=\"3\"/>", "<Dimension start=\"0\"/>", "xml.dimensions"),
    ("derivative=\"2\"", "derivative=\"9\"", "xml.derivatives_of"),
    ("derivative=\"2\"", "derivative=\"3\"", "xml.derivatives_of"),
    (
        "start=\"0\" intermediateUpdate",
        "start=\"0\" reinit=\"true\" intermediateUpdate",
        "xml.derivatives_of",
    ),
    (
        "<Output valueReference=\"7\" dependencies=\"1\" dependenciesKind=\"dependent\"/>",
        "",
        "xml.outputs",
    ),
    (
        "<ContinuousStateDerivative valueReference=\"3\"",
        "<ContinuousStateDerivative valueReference=\"2\"",
        "xml.derivatives",
    ),
    ("<InitialUnknown valueReference=\"3\" dependencies=\"2 4 5\"/>", "", "xml.initial_unknowns"),
    (
        "<EventIndicator valueReference=\"8\"",
        "<EventIndicator valueReference=\"7\"",
        "xml.event_indicators",
    ),
    (
        "<EventIndicator valueReference=\"8\"",
        "<EventIndicator valueReference=\"80\"",
        "xml.structure_references",
    ),
    ("dependenciesKind=\"fixed fixed\"", "dependenciesKind=\"fixed\"", "xml.dependencies"),
    (
        "<InitialUnknown valueReference=\"6\" dependencies=\"2\"/>",
        "<InitialUnknown valueReference=\"6\" dependencies=\"2\" dependenciesKind=\"fixed\"/>",
        "xml.dependencies",
    ),
    (
        "<Output valueReference=\"6\" dependencies=\"2\" dependenciesKind=\"constant\"/>",
        "<Output valueReference=\"6\" dependencies=\"8\"/>",
        "xml.dependencies_known",
    ),
];

#[test]
fn a_wrong_word_in_the_description_of_an_fmu_3_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let library = library(folder.path(), 0);
    let path = folder.path().join("Mutant.fmu");
    let mut wrong = Vec::new();
    for (from, to, rule) in STATIC {
        assert_eq!(XML.matches(from).count(), 1, "{from}");
        let mut files = files(&library);
        files[0].1 = XML.replace(from, to).into();
        pack(&files, &path);
        let report = look(&path, &["zip", "xml", "bin"]);
        if !broken(&report).contains(rule) {
            wrong.push(format!("{from} -> {to}: meant {rule}\n{}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_wrong_archive_of_an_fmu_3_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let library = library(folder.path(), 0);
    let path = folder.path().join("Mutant.fmu");
    let manifest = |name: &str| {
        format!(
            "<fmiLayeredStandardManifest xmlns:fmi-ls=\"x\" fmi-ls:fmi-ls-name=\"{name}\" fmi-ls:fmi-ls-version=\"1\"/>"
        )
    };
    let icons = "<fmiTerminalsAndIcons fmiVersion=\"2.0\"/>".to_string();
    let suffix = std::env::consts::DLL_SUFFIX;
    // where the library is, a file more, and the rule that tells it
    let other = [("linux64", "linux"), ("win64", "windows"), ("darwin64", "macos")];
    let old =
        other.iter().find(|(_, os)| *os == std::env::consts::OS).map_or("linux64", |(old, _)| old);
    type Case = (String, Option<(String, String)>, &'static str);
    let cases: Vec<Case> = vec![
        (format!("binaries/{old}/Model3{suffix}"), None, "bin.tuples"),
        (format!("binaries/{PLATFORM}/libModel3{suffix}"), None, "bin.name"),
        (binary(), Some(("model.png".into(), "x".into())), "zip.folders"),
        (binary(), Some(("terminalsAndIcons/icon.svg".into(), "<svg/>".into())), "zip.pictures"),
        (
            binary(),
            Some(("terminalsAndIcons/terminalsAndIcons.xml".into(), icons)),
            "zip.terminals",
        ),
        (binary(), Some(("documentation/licenses/MIT.txt".into(), "x".into())), "zip.licenses"),
        (binary(), Some(("extra/data/x.csv".into(), "x".into())), "zip.extra"),
        (
            binary(),
            Some(("extra/org.example.ls/fmi-ls-manifest.xml".into(), manifest("org.example.ls"))),
            "zip.layered_standards",
        ),
        (binary(), Some(("MODELDESCRIPTION.xml".into(), "x".into())), "zip.duplicates"),
    ];
    for (place, more, rule) in cases {
        let mut files = files(&library);
        files[1].0 = place.clone();
        files.extend(more.clone().map(|(name, text)| (name, text.into_bytes())));
        pack(&files, &path);
        let report = look(&path, &["zip", "xml", "bin"]);
        assert!(
            broken(&report).contains(rule),
            "{place}, {more:?}: meant {rule}\n{}",
            report.text()
        );
    }
}

/// Faults of model3.c by number, and the rule that tells each.
const BEHAVIOUR: &[(u32, &str)] = &[
    (1, "instantiate.token"),
    (2, "life.reset"),
    (3, "exchange.indicators"),
    (4, "values.counts"),
    (5, "values.set"),
    (6, "values.unknown"),
    (7, "values.fixed"),
    (8, "values.type"),
    (9, "values.booleans"),
    (10, "states.restore"),
    (11, "states.serialize"),
    (12, "derivatives.directional"),
    (13, "derivatives.adjoint"),
    (14, "dependencies.elements"),
    (15, "events.idempotent"),
    (16, "events.answers"),
    (17, "exchange.states_set"),
    (18, "log.errors"),
    (19, "log.categories"),
    (20, "load.version"),
    (21, "exchange.counts"),
    (22, "steps.wrong"),
    (23, "steps.answers"),
    (24, "steps.answers"),
    (25, "instantiate.callbacks"),
    (26, "intermediate.time"),
    (27, "intermediate.inputs"),
    (28, "intermediate.inputs"),
    (29, "events.discrete_held"),
    (30, "events.same_trajectory"),
    (31, "steps.answers"),
    (32, "intermediate.early_return"),
    (33, "steps.answers"),
    (34, "steps.answers"),
    (35, "log.environment"),
];

#[test]
fn an_fmu_3_that_misbehaves_is_told_by_the_rule_that_is_meant() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Mutant.fmu");
    let mut wrong = Vec::new();
    for (mutant, rule) in BEHAVIOUR {
        pack(&files(&library(folder.path(), *mutant)), &path);
        let report = look(&path, &[rule]);
        if !broken(&report).contains(rule) {
            wrong.push(format!("mutant {mutant}: meant {rule}\n{}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn an_fmu_3_that_hands_its_instance_to_the_callbacks_breaks_one_rule_and_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Mutant.fmu");
    pack(&files(&library(folder.path(), 35)), &path);
    let report = look(&path, &["log", "instantiate", "intermediate", "steps", "values"]);
    assert_eq!(broken(&report), BTreeSet::from(["log.environment"]), "{}", report.text());
    follows_its_closed_solution(&path, folder.path());
}

#[test]
fn findings_are_written_as_sarif() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("Mutant.fmu");
    let mut files = files(&library(folder.path(), 0));
    files[0].1 = XML.replace("derivative=\"2\"", "derivative=\"3\"").into();
    pack(&files, &path);
    let sarif = folder.path().join("check.sarif");
    let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .arg("check")
        .args([
            &path,
            Path::new("--only"),
            Path::new("xml.derivatives_of"),
            Path::new("--sarif"),
            &sarif,
        ])
        .output()
        .unwrap();
    assert!(!done.status.success());
    let sarif: serde_json::Value = serde_json::from_slice(&std::fs::read(&sarif).unwrap()).unwrap();
    assert_eq!(sarif["version"], "2.1.0");
    let result = &sarif["runs"][0]["results"][0];
    assert_eq!(
        (&result["ruleId"], &result["level"]),
        (&"xml.derivatives_of".into(), &"error".into())
    );
    assert!(result["message"]["text"].as_str().unwrap().contains("its own derivative"));
}

#[test]
fn an_fmu_3_runs_as_its_closed_solution_with_inputs_along_lines() {
    let folder = tempfile::tempdir().unwrap();
    follows_its_closed_solution(&model(folder.path()), folder.path());
}

/// Runs the model with an input along lines, which intermediateUpdate sets, and compares its outputs.
fn follows_its_closed_solution(path: &Path, folder: &Path) {
    let input = folder.join("u.csv");
    std::fs::write(&input, "time,u\n0,0\n10,5\n").unwrap();
    let out = folder.join("out.csv");
    let done = Command::new(env!("CARGO_BIN_EXE_hubslosh"))
        .args(["run", "--fmu"])
        .arg(path)
        .arg("--input")
        .arg(&input)
        .args([
            "--set",
            "k=2",
            "--set",
            "a[2]=7",
            "--columns",
            "y,n,a[1],a[2],on",
            "--step",
            "0.1",
            "--stop",
            "10",
            "--out",
        ])
        .arg(&out)
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let text = std::fs::read_to_string(&out).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time,u,y,n,a[1],a[2],on"));
    let mut rows = 0;
    for line in lines {
        let row: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        // x' = -k (x - s t), x(0) = 1: x = s t - s/k + (1 + s/k) exp(-k t)
        let (t, k, s) = (row[0], 2.0, 0.5);
        let x = s * t - s / k + (1.0 + s / k) * (-k * t).exp();
        // 100 steps, each exact to rounding
        assert!((row[2] - 2.0 * x).abs() < 1e-12, "{line}: {x}");
        assert_eq!(row[3], (t / 0.25 + 1e-6).floor(), "{line}");
        assert_eq!(row[4..], [1.0, 7.0, 0.0], "{line}");
        rows += 1;
    }
    assert_eq!(rows, 101);
}

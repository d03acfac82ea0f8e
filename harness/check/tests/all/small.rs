//! Checks small FMUs that are compiled from C (model.c).

use std::collections::BTreeSet;
use std::io::{Cursor, Read};

use check::{Report, Severity};
use host::fmi2::PLATFORM;
use zip::{CompressionMethod, ZipArchive};

use crate::common::{Files, XML, broken_rules, check_bytes, compiled, keep, zipped};

struct Small<'a> {
    definitions: &'a [&'a str],
    /// Rate k of the equation x' = -k (x - u), 1/s.
    rate: f64,
    experiment: &'a str,
}

impl Small<'_> {
    fn has_definition(&self, interface: &str) -> bool {
        self.definitions.contains(&interface)
    }

    fn xml(&self) -> String {
        let flags = "canNotUseMemoryManagementFunctions=\"true\" canGetAndSetFMUstate=\"true\" \
                     canSerializeFMUstate=\"true\"";
        let once = self
            .has_definition("-DONCE")
            .then_some(" canBeInstantiatedOnlyOncePerProcess=\"true\"");
        let flags = flags.to_string() + once.unwrap_or_default();
        let exchange = match self.has_definition("-DMODEL_EXCHANGE") {
            true => format!("<ModelExchange modelIdentifier=\"model\" {flags}/>"),
            false => String::new(),
        };
        let stepping = match self.has_definition("-DCO_SIMULATION") {
            true => format!(
                "<CoSimulation modelIdentifier=\"model\" \
                 canHandleVariableCommunicationStepSize=\"true\" {flags}/>"
            ),
            false => String::new(),
        };
        let derivatives = match self.has_definition("-DHIDDEN_STATE") {
            true => "",
            false => {
                "<Derivatives><Unknown index=\"2\" dependencies=\"1 4\" \
                 dependenciesKind=\"fixed fixed\"/></Derivatives>"
            }
        };
        let Small { rate, experiment, .. } = self;
        format!(
            r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="model" guid="{{model}}" numberOfEventIndicators="0">
  {exchange}
  {stepping}
  <LogCategories><Category name="logStatusError"/></LogCategories>
  <DefaultExperiment {experiment}/>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" causality="output" variability="continuous" initial="exact"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="1" variability="continuous" initial="calculated"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="2" causality="parameter" variability="fixed" initial="exact"><Real min="0" start="{rate:?}"/></ScalarVariable>
    <ScalarVariable name="u" valueReference="3" causality="input" variability="continuous"><Real start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1" dependencies="1" dependenciesKind="constant"/></Outputs>
    {derivatives}
    <InitialUnknowns><Unknown index="2" dependencies="1 3 4"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#
        )
    }

    fn packed(&self) -> Vec<u8> {
        let rate = format!("-DRATE={:e}", self.rate);
        let library = compiled("model.c", &[&[rate.as_str()], self.definitions].concat());
        let resources = ("resources/rate.txt".into(), format!("{}", self.rate).into_bytes());
        let files: Files = vec![
            (XML.into(), self.xml().into_bytes()),
            (format!("binaries/{PLATFORM}/model.so"), library),
            resources,
            ("documentation/index.html".into(), b"<html></html>".to_vec()),
            ("documentation/licenses/license.txt".into(), b"MIT".to_vec()),
        ];
        zipped(&files, CompressionMethod::Deflated)
    }
}

const BOTH: &[&str] = &["-DCO_SIMULATION", "-DMODEL_EXCHANGE"];
const ONCE: &[&str] = &["-DCO_SIMULATION", "-DMODEL_EXCHANGE", "-DONCE"];
const USUAL: &str = "startTime=\"0\" stopTime=\"10\" stepSize=\"0.01\"";

#[cfg(target_os = "linux")]
fn get_no_finding(cases: &[(&str, &[&str], f64, &str)]) {
    let mut wrong = Vec::new();
    for (name, definitions, rate, experiment) in cases {
        let small = Small { definitions, rate: *rate, experiment };
        let report = check_bytes(&small.packed(), &[]);
        // Findings of two rules are expected: the small FMUs are built without the options for old systems, and one case has
        // a step that is too long on purpose.
        let fine = ["bin.system", "xml.default_experiment"];
        let others: Vec<_> = report.all().filter(|(rule, _)| !fine.contains(&rule.id)).collect();
        if !others.is_empty() || report.count_findings(Severity::Error) > 0 {
            wrong.push(format!("{name}: {}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The FMUs are small ones in C, with time constants down to 1e-5 s or with only one of the two interfaces.
#[cfg(target_os = "linux")]
#[test]
fn correct_fmus_get_no_finding_whatever_their_stiffness_and_capabilities() {
    get_no_finding(&[
        ("stiff", BOTH, 1e5, USUAL),
        ("steps longer than the experiment", BOTH, 1.0, "stopTime=\"1\" stepSize=\"1000\""),
        ("Co-Simulation only", &BOTH[..1], 1.0, USUAL),
        ("Model Exchange only", &BOTH[1..], 1.0, USUAL),
        ("one instance per process", ONCE, 1.0, USUAL),
    ]);
}

/// The FMUs are small ones in C, with step sizes of the default experiment from 1 µs to 1000 s.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "five seconds of CPU time: .ci/long-tests"]
fn correct_fmus_get_no_finding_whatever_their_step_size() {
    let long = "startTime=\"0\" stopTime=\"1e6\" stepSize=\"1000\"";
    get_no_finding(&[
        ("both interfaces", BOTH, 1.0, USUAL),
        ("stiff, Model Exchange only", &BOTH[1..], 1e5, USUAL),
        ("very stiff", BOTH, 1e9, USUAL),
        ("steps of 1000 s", BOTH, 1.0, long),
        ("stiff in steps of 1000 s", BOTH, 1e5, long),
        ("steps of 1000 s without an end", BOTH, 1.0, "stepSize=\"1000\""),
        ("short steps", BOTH, 1.0, "stopTime=\"1e-3\" stepSize=\"1e-6\""),
    ]);
}

/// The state of this Model Exchange FMU goes to infinity in finite time, which breaks only the rule `exchange.run`.
#[cfg(target_os = "linux")]
#[test]
fn a_model_without_a_solution_is_reported_by_one_rule() {
    let definitions = &["-DMODEL_EXCHANGE", "-DBLOWS_UP"];
    let small = Small { definitions, rate: 10.0, experiment: USUAL };
    let report = check_bytes(&small.packed(), &["life", "exchange", "values", "states"]);
    assert_eq!(broken_rules(&report), BTreeSet::from(["exchange.run"]), "{}", report.text());
    let text = report.text();
    assert!(text.contains("cannot be followed past t = 0.1"), "{text}");
}

#[cfg(target_os = "linux")]
fn check_co_simulation(definitions: &[&str], experiment: &str, only: &[&str]) -> Report {
    let all = [&BOTH[..1], definitions].concat();
    let bytes = Small { definitions: &all, rate: 1.0, experiment }.packed();
    let is_one_of = |list: &[&str]| definitions.iter().all(|one| list.contains(one));
    if is_one_of(&[
        "-DSTALE",
        "-DRESOURCES",
        "-DRAW_LOCATION",
        "-DNEEDS_AUTHORITY",
        "-DNO_CATEGORY",
    ]) {
        let is_faultless = is_one_of(&["-DRESOURCES"]);
        keep(&definitions.concat(), &bytes, if is_faultless { &[] } else { only });
    }
    check_bytes(&bytes, only)
}

#[cfg(target_os = "linux")]
#[test]
fn outputs_that_lag_by_one_step_are_reported_and_intended_delays_are_not() {
    // with -DSTALE, x after 1.5 s is its value at 1.4 s, which is 11 % too large
    let experiment = "startTime=\"0\" stopTime=\"10\" stepSize=\"0.1\"";
    for (habit, severity) in [
        (&["-DSTALE"][..], Some(Severity::Error)),
        // If an output lags by a step, the check cannot be sure that the lag is a fault, and gives a warning.
        (&["-DSTALE", "-DHIDDEN_STATE"], Some(Severity::Warning)),
        (&["-DDELAY"], None),
        (&["-DUNIT_DELAY"], None),
        (&["-DEULER"], None),
        (&[], None),
    ] {
        let report = check_co_simulation(habit, experiment, &["steps.lag"]);
        let found: Vec<_> = report.all().map(|(_, finding)| finding.severity).collect();
        assert_eq!(found, Vec::from_iter(severity), "{habit:?}: {}", report.text());
        assert_eq!(report.outcomes[0].findings.skipped, None, "{}", report.text());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn the_check_reports_an_fmu_that_does_not_find_its_resources_by_every_file_uri() {
    for (fault, told) in [
        (&["-DRESOURCES"][..], &[][..]),
        (&["-DRESOURCES", "-DRAW_LOCATION"], &["a%20b%2541c"]),
        (&["-DRESOURCES", "-DNEEDS_AUTHORITY"], &["location file:/"]),
        (&["-DRESOURCES", "-DRAW_LOCATION", "-DNEEDS_AUTHORITY"], &["%20b", "location file:/"]),
    ] {
        let report = check_co_simulation(fault, USUAL, &["instantiate.resources"]);
        let places: Vec<_> = report.all().map(|(_, finding)| finding.place.as_str()).collect();
        assert_eq!(places.len(), told.len(), "{fault:?}: {}", report.text());
        for (place, part) in places.iter().zip(told) {
            assert!(place.contains(part), "{fault:?}: {place}");
        }
        assert_eq!(report.count_findings(Severity::Error), told.len());
        assert_eq!(report.outcomes[0].findings.skipped, None, "{}", report.text());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn the_check_reports_a_log_message_without_category() {
    let report = check_co_simulation(&["-DNO_CATEGORY"], USUAL, &["log"]);
    assert_eq!(broken_rules(&report), BTreeSet::from(["log.categories"]), "{}", report.text());
    assert!(report.text().contains("the category of the message is NULL"), "{}", report.text());
}

#[cfg(target_os = "linux")]
#[test]
fn an_fmu_that_crashes_in_every_step_gets_a_single_finding() {
    let report =
        check_co_simulation(&["-DCRASHES"], USUAL, &["life", "host", "values", "states", "steps"]);
    let all: Vec<_> = report.all().map(|(rule, _)| rule.id).collect();
    assert_eq!(all, ["steps.run"], "{}", report.text());
    let reasons = report.outcomes.iter().filter_map(|outcome| outcome.findings.reason());
    let because = reasons.filter(|why| why.starts_with("because of steps.run: a step from"));
    assert!(because.count() > 15, "{}", report.text());
}

/// The cases imitate public FMUs. Some of them have one fault that could be reported by several rules; others refuse,
/// as the standard allows, a value that the check sets.
#[cfg(target_os = "linux")]
#[test]
fn a_fault_is_reported_by_its_own_rule_with_its_severity() {
    let mut wrong = Vec::new();
    for (fault, groups, errors, warnings) in [
        (
            &["-DUNKNOWN"][..],
            &["instantiate", "life", "log", "host", "values.unknown"][..],
            &["values.unknown"][..],
            &[][..],
        ),
        (&["-DSILENT"], &["values.unknown", "instantiate.copies"], &[], &["values.unknown"]),
        (&["-DGIVES_UP"], &["log"], &[], &[]),
        (&["-DNOISE"], &["load", "life", "instantiate"], &["life.deterministic"], &[]),
        (&["-DFORGETS"], &["states"], &["states.rollback"], &[]),
        (&["-DRESOURCES", "-DTRUSTS"], &["instantiate"], &[], &["instantiate.arguments"]),
        (&["-DSINGULAR"], &["dependencies", "load"], &[], &[]),
        (&["-DMOVED"], &["dependencies", "values.tunable"], &[], &[]),
    ] {
        let report = check_co_simulation(fault, USUAL, groups);
        let told = |severity| -> BTreeSet<&str> {
            let of = report.all().filter(|(_, finding)| finding.severity == severity);
            of.map(|(rule, _)| rule.id).collect()
        };
        let found = (told(Severity::Error), told(Severity::Warning));
        if found != (errors.iter().copied().collect(), warnings.iter().copied().collect()) {
            wrong.push(format!("{fault:?}: {}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[cfg(target_os = "linux")]
#[test]
fn undefined_symbols_of_cpp_and_python_are_reported_in_readable_form() {
    for (symbol, told) in [
        ("_ZNK9pythonfmu7PyState4callEv", "undefined symbol: pythonfmu::PyState::call"),
        ("_Py_NoneStruct", "needs a Python host"),
        ("PyExc_TypeError", "needs a Python host"),
        ("__Py_Dealloc", "needs a Python host"),
    ] {
        let undefined = format!("-DUNDEFINED={symbol}");
        let definitions = [BOTH, &[&undefined]].concat();
        let small = Small { definitions: &definitions, rate: 1.0, experiment: USUAL };
        let report = check_bytes(&small.packed(), &["bin", "load"]);
        let text = report.text();
        assert!(broken_rules(&report).contains("load.opens"), "{text}");
        assert!(text.contains(told), "{text}");
        let is_of_python = symbol.trim_start_matches('_').starts_with("Py");
        assert_eq!(text.contains("needs a Python host"), is_of_python, "{text}");
        assert!(text.contains("1001 symbols, among them pythonfmu::m000, "), "{text}");
        let longest = report.all().map(|(_, finding)| finding.text.len()).max();
        assert!(longest < Some(500) && !text.contains("_ZN"), "{longest:?}: {text}");
    }
}

#[test]
fn a_windows_library_may_have_other_capitals_in_its_name_and_a_linux_library_may_not() {
    let small = Small { definitions: BOTH, rate: 1.0, experiment: USUAL };
    let with = |library: &str| {
        let files: Files =
            vec![(XML.into(), small.xml().into_bytes()), (library.into(), b"MZ".to_vec())];
        broken_rules(&check_bytes(
            &zipped(&files, CompressionMethod::Stored),
            &["bin.name", "bin.present"],
        ))
    };
    assert_eq!(with("binaries/win64/Model.dll"), BTreeSet::new());
    assert!(with("binaries/linux64/Model.so").contains("bin.name"));
}

#[cfg(target_os = "linux")]
#[test]
fn each_interface_is_called_in_the_binary_that_it_names() {
    let small = Small { definitions: BOTH, rate: 1.0, experiment: USUAL };
    let text = small.xml().replacen(
        "ModelExchange modelIdentifier=\"model\"",
        "ModelExchange modelIdentifier=\"other\"",
        1,
    );
    let stepping = Small { definitions: &BOTH[..1], ..small };
    let exchange = Small { definitions: &BOTH[1..], rate: 1.0, experiment: USUAL };
    let library = |small: &Small| {
        let bytes = small.packed();
        let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut file = archive.by_index(1).unwrap();
        let mut library = Vec::new();
        file.read_to_end(&mut library).unwrap();
        library
    };
    let documentation = |name: &str| (format!("documentation/{name}"), b"text".to_vec());
    let mut files: Files = vec![
        (XML.into(), text.into_bytes()),
        (format!("binaries/{PLATFORM}/model.so"), library(&stepping)),
        documentation("index.html"),
        documentation("licenses/license.txt"),
        (format!("binaries/{PLATFORM}/other.so"), library(&exchange)),
    ];
    let report = check_bytes(&zipped(&files, CompressionMethod::Stored), &[]);
    let found: Vec<_> = report.all().filter(|(rule, _)| rule.id != "bin.system").collect();
    assert!(found.is_empty(), "{}", report.text());
    let called = |id: &str, report: &Report| {
        report.outcomes.iter().any(|o| o.rule.id == id && o.findings.skipped.is_none())
    };
    assert!(called("exchange.run", &report) && called("steps.run", &report));
    // If the binary of one interface is missing, the other interface is still called.
    files.pop();
    let report = check_bytes(&zipped(&files, CompressionMethod::Stored), &[]);
    assert!(broken_rules(&report).contains("bin.each_interface"), "{}", report.text());
    assert!(called("steps.run", &report) && !called("exchange.run", &report));
}

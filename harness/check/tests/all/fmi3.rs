//! Rules on FMUs 3.0. A model without a fault (model3.c, model3.xml) breaks no rule. Each of its copies has one fault, and
//! breaks the rule about this fault.

use std::collections::BTreeSet;

use check::Report;
use check::rules::fmi3;
use host::fmi3::PLATFORM;
use zip::CompressionMethod;

use crate::common::{Files, broken_rules, cases, check_bytes, compiled, zipped};

const XML: &str = include_str!("model3.xml");

fn binary() -> String {
    format!("binaries/{PLATFORM}/Model3{}", std::env::consts::DLL_SUFFIX)
}

/// Returns the files of an FMU whose library, compiled from model3.c, has the fault with the number `mutant`. The
/// number replaces the zeros of the text "MUTANT=00" in the library.
fn files(mutant: u32) -> Files {
    let mut library = compiled("model3.c", &[]);
    let at = library.windows(9).position(|bytes| bytes == b"MUTANT=00").unwrap();
    library[at + 7..][..2].copy_from_slice(format!("{mutant:02}").as_bytes());
    vec![("modelDescription.xml".into(), XML.into()), (binary(), library)]
}

fn report(files: &Files, only: &[&str]) -> Report {
    check_bytes(&zipped(files, CompressionMethod::Deflated), only)
}

#[test]
fn an_fmu_3_without_a_fault_breaks_no_rule() {
    let report = report(&files(0), &[]);
    assert_eq!(report.all().count(), 0, "{}", report.text());
    assert_eq!(report.outcomes.len(), fmi3::RULES.len());
    let skipped = report.outcomes.iter().filter(|o| o.findings.skipped.is_some());
    let skipped: Vec<_> = skipped.map(|o| o.rule.id).collect();
    // The model has no licence, no terminals and no layered standard.
    assert_eq!(skipped, ["zip.licenses", "zip.terminals", "zip.layered_standards"]);
}

/// Changes of modelDescription.xml, one in a line: a text, its replacement, and the rule that must find the change. A cell
/// with one space is the end of a line.
const STATIC: &str = r#"
fmiVersion="3.0" | fmiVersion="3.0.2" | xml.fmi_version
instantiationToken="{model3}" | instantiationToken="" | xml.token
 instantiationToken="{model3}" |  | xml.schema
modelIdentifier="Model3" canGetAndSetFMUState="true" canSerializeFMUState="true" canHandle | modelIdentifier="Model-3" canGetAndSetFMUState="true" canSerializeFMUState="true" canHandle | xml.model_identifier
canGetAndSetFMUState="true" canSerializeFMUState="true" provides | canSerializeFMUState="true" provides | xml.capabilities
providesIntermediateUpdate="true"  |  | xml.capabilities
hasEventMode="true" | hasEventMode="yes" | xml.values
stopTime="10" | stopTime="-1" | xml.default_experiment
<Unit name="rad/s"> | <Unit name="rad"> | xml.unique
<Item name="above" value="2"/> | <Item name="above" value="1"/> | xml.unique
start="1" unit="rad" displayUnit="deg" | start="1" unit="rad" displayUnit="rpm" | xml.units
variability="continuous" unit="s" | variability="continuous" unit="h" | xml.units
factor="57.29577951308232" | factor="0" | xml.units
<Boolean name="on" | <Boolean declaredType="Side" name="on" | xml.types
name="k" | name="y" | xml.names
intermediateUpdate="true" unit="rad"/>\n    <Int32 | intermediateUpdate="true" unit="rad"><Alias name="u"/></Float64>\n    <Int32 | xml.names
name="der(x)" | name="dx/dt" | xml.structured_names
name="z" valueReference="8" | name="z" valueReference="6" | xml.references
name="n" valueReference="7" causality="output" variability="discrete" | name="n" valueReference="7" causality="output" variability="continuous" | xml.causality
causality="parameter" variability="fixed" initial="exact" start="1" | causality="parameter" variability="discrete" initial="exact" start="1" | xml.causality
causality="parameter" variability="fixed" initial="exact" start="1" | causality="parameter" variability="fixed" initial="approx" start="1" | xml.initial
initial="exact" start="1" unit="rad" | initial="exact" unit="rad" | xml.start
start="1 2 3" | start="1 2" | xml.start
start="1 2 3" | start="1 NaN 3" | xml.finite
start="1" min="0" | start="1" min="2" | xml.range
<Boolean name="on" valueReference="10" causality="parameter" variability="fixed" initial="exact" start="false"/> | <Enumeration name="on" declaredType="Side" valueReference="10" causality="parameter" variability="fixed" initial="exact" start="3"/> | xml.range
causality="independent" variability="continuous" | causality="local" variability="continuous" | xml.independent
causality="independent" variability="continuous" | causality="independent" variability="continuous" start="0" | xml.independent
name="n" valueReference="7" causality="output" | name="n" valueReference="7" intermediateUpdate="true" causality="output" | xml.flags
name="n" valueReference="7" | name="n" valueReference="7" clocks="10" | xml.clocks
<Dimension start="3"/> | <Dimension start="3" valueReference="5"/> | xml.dimensions
<Dimension start="3"/> | <Dimension valueReference="7"/> | xml.dimensions
<Dimension start="3"/> | <Dimension start="0"/> | xml.dimensions
derivative="2" | derivative="9" | xml.derivatives_of
derivative="2" | derivative="3" | xml.derivatives_of
start="0" intermediateUpdate | start="0" reinit="true" intermediateUpdate | xml.derivatives_of
<Output valueReference="7" dependencies="1" dependenciesKind="dependent"/> |  | xml.outputs
<ContinuousStateDerivative valueReference="3" | <ContinuousStateDerivative valueReference="2" | xml.derivatives
<InitialUnknown valueReference="3" dependencies="2 4 5"/> |  | xml.initial_unknowns
<EventIndicator valueReference="8" | <EventIndicator valueReference="7" | xml.event_indicators
<EventIndicator valueReference="8" | <EventIndicator valueReference="80" | xml.structure_references
dependenciesKind="fixed fixed" | dependenciesKind="fixed" | xml.dependencies
<InitialUnknown valueReference="6" dependencies="2"/> | <InitialUnknown valueReference="6" dependencies="2" dependenciesKind="fixed"/> | xml.dependencies
<Output valueReference="6" dependencies="2" dependenciesKind="constant"/> | <Output valueReference="6" dependencies="8"/> | xml.dependencies_known
"#;

#[test]
fn a_wrong_attribute_in_the_description_of_an_fmu_3_is_reported() {
    let mut files = files(0);
    let mut wrong = Vec::new();
    for [from, to, rule] in cases(STATIC) {
        let [from, to] = [from, to].map(|text| text.replace("\\n", "\n"));
        assert_eq!(XML.matches(&from).count(), 1, "{from}");
        files[0].1 = XML.replace(&from, &to).into();
        let report = report(&files, &["zip", "xml", "bin"]);
        if !broken_rules(&report).contains(rule) {
            wrong.push(format!("{from} -> {to}: meant {rule}\n{}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// FMI 3.0 allows an FMU with clocks to refuse an instance without event mode (section 2.3.1).
#[test]
fn co_simulation_of_an_fmu_with_clocks_is_not_called() {
    let clock = "<Clock name=\"tick\" valueReference=\"90\" causality=\"input\" \
                 variability=\"discrete\" intervalVariability=\"triggered\"/>\n  </ModelVariables>";
    let mut files = files(0);
    files[0].1 = XML.replace("</ModelVariables>", clock).into_bytes();
    let report = report(&files, &["load", "steps.answers"]);
    assert_eq!(broken_rules(&report), BTreeSet::new(), "{}", report.text());
    let skipped = report.outcomes.iter().filter(|o| o.findings.skipped.is_some());
    let skipped: Vec<_> = skipped.map(|o| o.rule.id).collect();
    assert_eq!(skipped, ["steps.answers"], "{}", report.text());
}

/// Each case moves or adds one file in the archive.
#[test]
fn a_wrong_archive_of_an_fmu_3_is_reported() {
    let without_fault = files(0);
    let manifest = |name: &str| {
        format!(
            "<fmiLayeredStandardManifest xmlns:fmi-ls=\"x\" fmi-ls:fmi-ls-name=\"{name}\" fmi-ls:fmi-ls-version=\"1\"/>"
        )
    };
    let icons = "<fmiTerminalsAndIcons fmiVersion=\"2.0\"/>".to_string();
    let suffix = std::env::consts::DLL_SUFFIX;
    // Each case has the path of the library, an additional file, and the rule that reports the fault.
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
        let mut files = without_fault.clone();
        files[1].0 = place.clone();
        files.extend(more.clone().map(|(name, text)| (name, text.into_bytes())));
        let report = report(&files, &["zip", "xml", "bin"]);
        assert!(
            broken_rules(&report).contains(rule),
            "{place}, {more:?}: meant {rule}\n{}",
            report.text()
        );
    }
}

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
    (37, "steps.run"),
    (38, "steps.run"),
    (39, "life.deterministic"),
];

#[test]
fn an_fmu_3_that_misbehaves_is_reported_by_the_intended_rule() {
    let mut wrong = Vec::new();
    for (mutant, rule) in BEHAVIOUR {
        let report = report(&files(*mutant), &[rule]);
        if !broken_rules(&report).contains(rule) {
            wrong.push(format!("mutant {mutant}: meant {rule}\n{}", report.text()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn an_fmu_3_that_hands_its_instance_to_the_callbacks_breaks_one_rule() {
    let report = report(&files(35), &["log", "instantiate", "intermediate", "steps", "values"]);
    assert_eq!(broken_rules(&report), BTreeSet::from(["log.environment"]), "{}", report.text());
}

/// If every run differs from every other run, a difference after a reset shows nothing.
#[test]
fn the_rule_on_reset_is_skipped_if_runs_differ_without_a_reset() {
    let report = report(&files(39), &["life"]);
    assert_eq!(broken_rules(&report), BTreeSet::from(["life.deterministic"]), "{}", report.text());
}

#[test]
fn an_interface_that_cannot_be_loaded_is_reported_and_the_other_is_checked() {
    let mut files = files(0);
    files[0].1 = XML
        .replace(
            "CoSimulation modelIdentifier=\"Model3\"",
            "CoSimulation modelIdentifier=\"Other\"",
        )
        .into_bytes();
    files.push((binary().replace("Model3", "Other"), b"text".to_vec()));
    let report = report(&files, &["load", "exchange", "steps.answers"]);
    assert_eq!(broken_rules(&report), BTreeSet::from(["load.opens"]), "{}", report.text());
    let skipped = report.outcomes.iter().filter(|o| o.findings.skipped.is_some());
    let skipped: Vec<_> = skipped.map(|o| o.rule.id).collect();
    assert_eq!(skipped, ["steps.answers"], "{}", report.text());
}

/// The library allows only one instance in a process (fault 36), which breaks rules unless the FMU declares it.
#[test]
fn an_fmu_3_that_declares_one_instance_per_process_passes_the_check() {
    let undeclared = files(36);
    let xml = XML
        .replace("<ModelExchange ", "<ModelExchange canBeInstantiatedOnlyOncePerProcess=\"true\" ");
    let xml = xml
        .replace("<CoSimulation ", "<CoSimulation canBeInstantiatedOnlyOncePerProcess=\"true\" ");
    let mut declared = undeclared.clone();
    declared[0].1 = xml.into_bytes();
    let report = report(&declared, &[]);
    assert_eq!(report.all().count(), 0, "{}", report.text());
    let report = self::report(&undeclared, &["load.instance"]);
    assert_eq!(broken_rules(&report), BTreeSet::from(["load.instance"]), "{}", report.text());
}

//! Rules of modelDescription.xml.

use std::collections::BTreeSet;

use check::{RULES, Severity};
use zip::CompressionMethod;

use crate::common::{
    XML, assert_description_faults, breaks, broken_rules, changed, check_bytes,
    our_fmu_with_description, with, xml, zipped,
};

/// Returns a DOCTYPE that defines ten entities. Each of them expands to ten times the entity before it, which makes 10^10
/// characters in all.
fn entity_bomb() -> String {
    let mut entities = "<!ENTITY e0 \"xxxxxxxxxx\">".to_string();
    for n in 1..10 {
        entities += &format!("<!ENTITY e{n} \"{}\">", format!("&e{};", n - 1).repeat(10));
    }
    let text = xml().replacen("<fmi", &format!("<!DOCTYPE a [{entities}]>\n<fmi"), 1);
    text.replacen("description=\"", "description=\"&e9;", 1)
}

fn nested(levels: usize) -> String {
    let deep = "<a>".repeat(levels) + &"</a>".repeat(levels);
    let annotations =
        format!("<VendorAnnotations><Tool name=\"t\">{deep}</Tool></VendorAnnotations>");
    xml().replacen("<ModelVariables>", &format!("{annotations}<ModelVariables>"), 1)
}

/// The levels are counted before any XML parser, which might overflow its stack, reads the file. The message must not call
/// the file ill-formed.
#[test]
fn xml_nested_200_000_levels_deep_is_refused_as_too_deep() {
    let bytes = zipped(&with(XML, nested(200_000).into_bytes()), CompressionMethod::Deflated);
    let report = check_bytes(&bytes, &[]);
    assert_eq!(broken_rules(&report), BTreeSet::from(["xml.size"]), "{}", report.text());
    assert!(report.text().contains("256 levels"), "{}", report.text());
    // Annotations of vendors with 50 levels are accepted.
    let report = check_bytes(
        &zipped(&with(XML, nested(50).into_bytes()), CompressionMethod::Stored),
        &["xml"],
    );
    assert_eq!(broken_rules(&report), BTreeSet::new(), "{}", report.text());
}

#[test]
fn faults_of_the_file_and_its_elements_break_the_intended_rules() {
    assert_description_faults(
        r#"
not well-formed | </ModelVariables> | </ModelVariables> |  | xml.well_formed
Latin-1 | <?xml | encoding="UTF-8" | encoding="ISO-8859-1" | xml.encoding
no encoding | <?xml |  encoding="UTF-8" |  | xml.encoding
fmiVersion 2.1 | <fmiModelDescription | fmiVersion="2.0" | fmiVersion="2.1" | xml.fmi_version
an unknown attribute | name="theta" | description | comment="" description | xml.schema
a missing attribute | name="theta" | valueReference="0"  |  | xml.schema
a missing GUID | <fmiModelDescription | guid=" | guid="" author2=" | xml.guid xml.schema
a bad date | <fmiModelDescription | generationDateAndTime="2 | generationDateAndTime="31.01.2 | xml.values xml.date
a local time | generationDateAndTime | Z" | +01:00" | xml.date
a broken exponent | <BaseUnit kg="1" | kg="1" | kg="0.5" | xml.values
a decimal comma | name="hub.I" | start="0.322414" | start="0,322414" | xml.values
a start that is not a number | name="hub.I" | start="0.322414" | start="0.3x" | xml.values
a max that is not a number | name="hub.I" | max="1000000000000.0" | max="1e" | xml.values
a min that is not a number | name="hub.I" | min="1e-6" | min="-inf" | xml.values
a document type declaration | <fmiModelDescription | <fmi | <!DOCTYPE fmiModelDescription> <fmi | xml.doctype
an external entity | <fmiModelDescription | <fmi | <!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/hostname">]> <fmi | xml.doctype
"#,
    );
}

#[test]
fn faults_of_interfaces_and_experiment_break_the_intended_rules() {
    assert_description_faults(
        r#"
no C identifier | <CoSimulation | "HubSlosh" | "Hub-Slosh" | xml.model_identifier
serialize without get | <CoSimulation | canGetAndSetFMUstate="true" | canGetAndSetFMUstate="false" | xml.capabilities xml.state_capability
interfaces that disagree | <CoSimulation | canNotUseMemoryManagementFunctions="true" | canNotUseMemoryManagementFunctions="false" | xml.capabilities
states not saved | <CoSimulation | canSerializeFMUstate="true" | canSerializeFMUstate="false" | xml.state_capability
stop before start | <DefaultExperiment | stopTime="20.0" | stopTime="-1" | xml.stop_time
a step longer than the experiment | <DefaultExperiment | stepSize="0.02" | stepSize="1000" | xml.default_experiment
an item's value twice | <SimpleType name="SloshModel" | value="2" | value="1" | xml.unique xml.range
a category twice | <Category name="logStatusError" | logStatusError | logEvents | xml.unique
"#,
    );
}

#[test]
fn faults_of_units_and_types_break_the_intended_rules() {
    assert_description_faults(
        r#"
an inverted display factor | <DisplayUnit name="deg" | 57.29577951308232 | 0.0174532925199433 | xml.display_units
a display unit of something else | <DisplayUnit name="mm2/s" | name="mm2/s" | name="mm2" | xml.display_units xml.units
a wrong exponent | <Unit name="N.m" | m="2" | m="1" | xml.base_units xml.display_units
an infinite offset | <DisplayUnit name="deg" | factor= | offset="INF" factor= | xml.unit_numbers
a factor of 0 | <DisplayUnit name="mm" | factor="1000.0" | factor="0" | xml.unit_numbers xml.display_units
a derivative in the unit of its state | name="der(omega)" | unit="rad/s2" | unit="rad/s" | xml.derivative_units
an undefined unit | name="theta" | unit="rad" | unit="radian" | xml.units
an undefined displayUnit | name="theta" | displayUnit="deg" | displayUnit="grad" | xml.units
an undefined type | name="slosh.model" | declaredType="SloshModel" | declaredType="Slosh" | xml.types
"#,
    );
}

#[test]
fn faults_of_names_and_causalities_break_the_intended_rules() {
    assert_description_faults(
        r#"
a name twice | name="omega" | name="omega" | name="theta" | xml.names
an unstructured name | name="hub.I" | hub.I | hub..I | xml.structured_names
a dotted port | name="theta" | name="theta" | name="hub.theta" | xml.flat_ports
half an array of ports | name="theta" | name="theta" | name="theta[2]" | xml.flat_ports
a continuous parameter | name="hub.I" | variability="fixed" | variability="continuous" | xml.causality
a continuous Integer | name="friction_mode" | variability="discrete" | variability="continuous" | xml.causality
no variability | name="friction_mode" | variability="discrete"  |  | xml.variability
an input with initial | name="tau_cmd" | variability="continuous" | variability="continuous" initial="exact" | xml.initial
multiple set of a parameter | name="hub.I" | causality | canHandleMultipleSetPerTimeInstant="true" causality | xml.multiple_set
"#,
    );
}

#[test]
fn faults_of_start_values_and_ranges_break_the_intended_rules() {
    assert_description_faults(
        r#"
calculated with start | name="theta" | displayUnit="deg" | displayUnit="deg" start="0" | xml.start
a parameter without start | name="hub.I" |  start="0.322414" |  | xml.start
start NaN | name="hub.I" | start="0.322414" | start="NaN" | xml.finite
nominal 0 | name="omega" | nominal="0.1" | nominal="0" | xml.finite
start outside | name="hub.I" | start="0.322414" | start="-1" | xml.range
no such item | name="slosh.model" | start="2" | start="7" | xml.range
min above max | name="tank.d" | min="0.001" | min="1000" | xml.range
"#,
    );
}

#[test]
fn faults_of_the_model_structure_break_the_intended_rules() {
    assert_description_faults(
        r#"
a shared reference | name="tau_ext" | valueReference="13" | valueReference="12" | xml.aliases
a derivative of nothing | name="der(omega)" | derivative="2" | derivative="9999" | xml.states xml.dependencies_known
an index too far | <Outputs> | dependencies=" | dependencies="9999  | xml.indices xml.dependencies
a kind missing | index="3" | dependenciesKind="dependent  | dependenciesKind=" | xml.dependencies
"#,
    );
}

fn line(list: &str, n: usize) -> String {
    let text = xml();
    text[text.find(list).unwrap()..].lines().nth(n + 1).unwrap().to_string()
}

#[test]
fn malicious_xml_and_elements_out_of_order_break_the_intended_rules() {
    let mut no_order = xml();
    let [types, categories] =
        ["  <TypeDefinitions>", "  <LogCategories>"].map(|word| no_order.find(word).unwrap());
    let moved: String = no_order.drain(types..categories).collect();
    no_order.insert_str(no_order.find("  <ModelVariables>").unwrap(), &moved);
    let long = format!("hub.{}", "I".repeat(60));
    breaks(
        vec![
            ("order of elements", our_fmu_with_description(no_order), &["xml.schema"][..]),
            ("an entity bomb", our_fmu_with_description(entity_bomb()), &["xml.doctype"]),
            ("200,000 levels", our_fmu_with_description(nested(200_000)), &["xml.size"]),
            ("a long name", changed("name=\"hub.I\"", "hub.I", &long), &["xml.parameter_names"]),
        ],
        &["xml"],
    );
}

#[test]
fn missing_repeated_and_misplaced_entries_of_the_model_structure_are_reported() {
    let [outputs, derivatives, initial] = ["<Outputs>", "<Derivatives>", "<InitialUnknowns>"];
    let without = |list| changed(list, &line(list, 0), "");
    let twice = |list| changed(list, &line(list, 0), &line(list, 0).repeat(2));
    let [first, second] = [line(initial, 0), line(initial, 1)];
    let swapped = changed(initial, &format!("{first}\n{second}"), &format!("{second}\n{first}"));
    let mut undeclared = xml();
    let at = undeclared.find(outputs).unwrap();
    let from = at + undeclared[at..].find(" dependencies=").unwrap();
    let to = from + undeclared[from..].find("/>").unwrap();
    undeclared.replace_range(from..to, "");
    breaks(
        vec![
            ("an output missing", without(outputs), &["xml.outputs"][..]),
            ("an output twice", twice(outputs), &["xml.outputs"]),
            // Without its entry in Derivatives the variable is neither a state nor a derivative, so that InitialUnknowns
            // must not list it.
            (
                "a derivative missing",
                without(derivatives),
                &["xml.initial_unknowns", "xml.dependencies_known"],
            ),
            ("a derivative twice", twice(derivatives), &["xml.derivatives"]),
            ("an initial unknown missing", without(initial), &["xml.initial_unknowns"]),
            ("an initial unknown twice", twice(initial), &["xml.initial_unknowns"]),
            ("initial unknowns unsorted", swapped, &["xml.initial_unknowns"]),
            (
                "no dependencies",
                our_fmu_with_description(undeclared),
                &["xml.dependencies_written"],
            ),
        ],
        &["xml"],
    );
}

/// FMI 2.0.5, section 2.2.7: any variable may name the variable whose derivative it is, but only the list Derivatives makes
/// that variable a state (2.2.8). Dymola and JModelica write the attribute also for outputs, inputs and dummy derivatives.
#[test]
fn a_variable_is_a_state_only_if_the_list_derivatives_names_its_derivative() {
    let of = |variable: &str, index: &str| {
        let derivative = format!("<Real derivative=\"{index}\"");
        changed(&format!("name=\"{variable}\""), "<Real", &derivative)
    };
    for (variable, index) in [("omega_dot", "2"), ("tau_ext", "13"), ("F_radial", "8")] {
        let report = check_bytes(&of(variable, index), &["xml"]);
        let rules = broken_rules(&report);
        let others: Vec<_> = rules.iter().filter(|rule| **rule != "xml.derivative_units").collect();
        assert!(others.is_empty(), "{variable}: {}", report.text());
    }
    let report = check_bytes(&of("omega_dot", "9999"), &["xml"]);
    assert_eq!(broken_rules(&report), BTreeSet::from(["xml.states"]), "{}", report.text());
}

#[test]
fn an_fmu_of_another_version_of_fmi_gets_one_finding() {
    for version in ["1.0", "1.5", "3.0-beta.3"] {
        let fmu = changed(
            "<fmiModelDescription",
            "fmiVersion=\"2.0\"",
            &format!("fmiVersion=\"{version}\" odd=\"\""),
        );
        for only in [&[][..], &["zip"]] {
            let report = check_bytes(&fmu, only);
            let all: Vec<_> = report.all().collect();
            let [(rule, finding)] = &all[..] else { panic!("{}", report.text()) };
            assert_eq!((rule.id, finding.severity), ("xml.fmi_version", Severity::Error));
            assert!(finding.text.contains(version), "{}", finding.text);
            assert_eq!(report.outcomes.len(), 1);
        }
    }
}

/// The page of the book states the groups and the numbers of rules; `book/conf.py` adds the rules themselves from the source.
#[test]
fn documentation_has_the_groups_and_numbers_of_rules() {
    let page = |name: &str| {
        let path = format!("{}/../../book/{name}", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).unwrap();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let third = check::rules::fmi3::RULES;
    let check = page("check.md");
    for rule in RULES.iter().chain(third) {
        let group = rule.id.split('.').next().unwrap();
        assert!(check.contains(&format!("`{group}`")), "book/check.md has no group {group}");
    }
    let counts = format!("{} rules for FMI 2.0 and {} for FMI 3.0", RULES.len(), third.len());
    assert!(check.contains(&counts), "book/check.md does not contain: {counts}");
    let first = format!("{} rules checked, 2 skipped", RULES.len() - 2);
    assert!(page("check_ci.md").contains(&first), "book/check_ci.md has not: {first}");
}

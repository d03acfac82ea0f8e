//! Rules that read modelDescription.xml, on descriptions that consist only of the elements in question.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use check::reading::Doctype;
use check::{Description, Finding, Findings, Severity, reading, schema, units, variables};
use host::causality::{Causality, Variability};
use host::description::Type;

use crate::common::{XML, archive};

/// Returns the findings of a rule about the description `xml`.
fn findings(xml: &str, rule: fn(&Description, &mut Findings)) -> Vec<Finding> {
    let mut findings = Findings::new(Severity::Error);
    rule(&Description::read(xml.as_bytes()).unwrap(), &mut findings);
    assert_eq!(findings.skipped, None);
    findings.list
}

fn with_outputs(names: &[&str]) -> String {
    let variables = names.iter().map(|name| {
        format!("<ScalarVariable name=\"{name}\" causality=\"output\"><Real/></ScalarVariable>")
    });
    format!(
        "<fmiModelDescription variableNamingConvention=\"structured\"><ModelVariables>{}</ModelVariables>\
         </fmiModelDescription>",
        variables.collect::<String>()
    )
}

#[test]
fn names_of_variables_follow_the_syntax_of_structured_names() {
    let is_structured =
        |name| findings(&with_outputs(&[name]), variables::structured_names).is_empty();
    for right in [
        "a",
        "a.b_1[2,3].c",
        "der(a.b)",
        "der(a[1],2)",
        "der(a[1].b[2,3])",
        "der(a[1,2],2)",
        "a.'b c\\'d'.e",
        "_x",
    ] {
        assert!(is_structured(right), "{right}");
    }
    for wrong in ["", "a b", "1a", "a..b", "a.", "a[x]", "a[1", "der(a,b)", "a-b", "'a"] {
        assert!(!is_structured(wrong), "{wrong}");
    }
}

#[test]
fn an_array_is_complete_if_no_index_from_1_to_the_last_is_missing() {
    let is_whole =
        |names: &[&str]| findings(&with_outputs(names), variables::flat_ports).is_empty();
    assert!(is_whole(&["a"]));
    assert!(is_whole(&["a[1]"]) && is_whole(&["a[2]", "a[1]"]));
    assert!(is_whole(&["a[1,1]", "a[1,2]", "a[2,1]", "a[2,2]"]));
    for broken in [
        &["a[0]"][..],
        &["a[2]"],
        &["a[1]", "a[3]"],
        &["a[1]", "a[1]"],
        &["a[1,1]", "a[2,2]"],
        &["a[1]", "a[1,2]"],
        &["a[4294967295,4294967295,4294967295]"],
        &["a[x]"],
    ] {
        assert!(!is_whole(broken), "{broken:?}");
    }
}

#[test]
fn the_encoding_of_an_xml_file_is_read_from_its_declaration() {
    let found = |text: &str| {
        let archive = archive(&[(XML, text)]);
        let mut findings = Findings::new(Severity::Error);
        reading::utf8(&archive, &mut findings);
        findings.list.iter().map(|finding| (finding.severity, finding.text.clone())).next()
    };
    let (severity, text) = found("<?xml version='1.0' encoding = 'ISO-8859-1' ?>").unwrap();
    assert_eq!(severity, Severity::Error);
    assert_eq!(text, "encoding=\"ISO-8859-1\" (allowed: \"UTF-8\")");
    assert_eq!(found("\u{feff}<?xml encoding=\"UTF-8\"?><a/>"), None);
    for none in ["", "<a encoding=\"x\"/>", "<?xml version=\"1.0\"?><a/>", "<?xml encoding=\"x"] {
        let (severity, text) = found(none).unwrap();
        assert!(severity == Severity::Warning && text.starts_with("no encoding"), "{none}: {text}");
    }
}

#[test]
fn a_document_type_declaration_is_found_before_the_root_and_nowhere_else() {
    let found = |text: &str| Doctype::find(text.as_bytes());
    let simple = found("<?xml version=\"1.0\"?>\n<!-- a -->\n<!DOCTYPE a><a/>").unwrap();
    assert_eq!(
        (simple.line, simple.text.as_str(), simple.parser_reaction()),
        (3, "<!DOCTYPE a>", "many parsers refuse it")
    );
    let bomb = found("<!DOCTYPE a [<!ENTITY b \"c>d\"> ]><a/>").unwrap();
    assert!(bomb.text.ends_with("]>") && bomb.parser_reaction().contains("entities"));
    let outside = found("<!doctype a SYSTEM \"file:///etc/passwd\"><a/>").unwrap();
    assert!(outside.parser_reaction().contains("another file"));
    for none in ["<a><!-- <!DOCTYPE a> --></a>", "<!-- <!DOCTYPE a> --><a/>", "", "<a/>"] {
        assert!(found(none).is_none(), "{none}");
    }
}

/// Each unit is declared with the dimensions and the factor of its name, which is no fault, and then with a factor that is 1 %
/// larger and with another dimension, which are faults.
#[test]
fn unit_names_are_read_by_the_rules_of_modelica() {
    let is_faultless = |name: &str, base: &str, factor: f64| {
        let unit = format!("<Unit name=\"{name}\"><BaseUnit {base} factor=\"{factor:?}\"/></Unit>");
        let xml = format!(
            "<fmiModelDescription><UnitDefinitions>{unit}</UnitDefinitions></fmiModelDescription>"
        );
        findings(&xml, units::base_units).is_empty()
    };
    for (name, base, factor) in [
        ("N.m", "kg='1' m='2' s='-2'", 1.0),
        ("kg.m2/s2", "kg='1' m='2' s='-2'", 1.0),
        ("J", "kg='1' m='2' s='-2'", 1.0),
        ("W/(m2.K)", "kg='1' s='-3' K='-1'", 1.0),
        ("1/s", "s='-1'", 1.0),
        ("s-1", "s='-1'", 1.0),
        ("km/h", "m='1' s='-1'", 1.0 / 3.6),
        ("deg/h", "rad='1' s='-1'", PI / 180.0 / 3600.0),
        ("mm2", "m='2'", 1e-6),
        ("cm3", "m='3'", 1e-6),
        ("mbar", "kg='1' m='-1' s='-2'", 100.0),
        ("kWh", "kg='1' m='2' s='-2'", 3.6e6),
        ("min", "s='1'", 60.0),
        ("kg", "kg='1'", 1.0),
    ] {
        assert!(is_faultless(name, base, factor), "{name}");
        assert!(!is_faultless(name, base, 1.01 * factor), "{name}");
        assert!(!is_faultless(name, &format!("{base} cd='1'"), factor), "{name}");
    }
    assert!(!is_faultless("min", "m='1'", 2.54e-5), "a thousandth of an inch");
    // No dimensions are known for a name that cannot be read, so that none are wrong.
    for unread in ["", "foo", "W/m2.K", "m/s/s", "m2/", "(m", "m)", "m^", "N m", "m2x"] {
        assert!(is_faultless(unread, "cd='7'", 1234.5), "{unread}");
    }
}

#[test]
fn missing_attributes_of_a_variable_get_the_defaults_of_the_standard() {
    let xml = br#"<fmiModelDescription><TypeDefinitions><SimpleType name="T"><Real unit="m"
        min="1"/></SimpleType></TypeDefinitions><ModelVariables>
        <ScalarVariable name="a" valueReference="3"><Real declaredType="T" min="2"/></ScalarVariable>
        <ScalarVariable name="b" valueReference="4" causality="parameter" variability="fixed"><Integer/></ScalarVariable>
        <ScalarVariable name="c" valueReference="4"><Boolean/></ScalarVariable>
        </ModelVariables></fmiModelDescription>"#;
    let d = Description::read(xml).unwrap();
    let [a, b, c] = &d.variables[..] else { panic!() };
    assert_eq!((&a.causality, &a.variability), (&Causality::Local, &Variability::Continuous));
    assert_eq!(a.initial.as_deref(), Some("calculated"));
    assert_eq!((a.bounds(), a.typed.get("unit")), ((2.0, f64::INFINITY), Some("m")));
    assert_eq!((b.initial.as_deref(), b.kind, b.key), (Some("exact"), Type::Integer, 2));
    assert_eq!(c.variability, Variability::Discrete);
}

#[test]
fn times_are_read_as_xml_date_times() {
    let is_time = |text: &str| {
        let xml = format!("<fmiModelDescription generationDateAndTime=\"{text}\"/>");
        findings(&xml, schema::values).is_empty()
    };
    for right in [
        "2026-01-31T12:00:00Z",
        "2026-01-31T12:00:00.25+01:00",
        "2026-01-31T12:00:00",
        "2024-02-29T23:59:59Z",
    ] {
        assert!(is_time(right), "{right}");
    }
    for wrong in [
        "2026-01-31",
        "2026-13-31T12:00:00Z",
        "2026-04-31T12:00:00Z",
        "31.01.2026 12:00",
        "2026-01-31T25:00:00Z",
        "2026-01-31T12:00Z",
        "2026-01-31T12:00:00Zulu",
        "2026-01-31 12:00:00Z",
        "",
        "T",
    ] {
        assert!(!is_time(wrong), "{wrong}");
    }
}

/// The test follows the schema from the root. Each element that a finding lists as an allowed child is given an unknown
/// attribute and an unknown child. The schema table has the element if a finding reports one of the two.
#[test]
fn every_child_element_that_the_schema_allows_is_in_the_schema_table() {
    for version in ["2.0", "3.0"] {
        let mut paths = vec![vec![]];
        let mut seen = BTreeSet::new();
        while let Some(path) = paths.pop() {
            let (mut begin, mut end) = (String::new(), String::new());
            for (n, name) in path.iter().enumerate() {
                let odd = if n + 1 == path.len() { " odd=''" } else { "" };
                begin += &format!("<{name}{odd}>");
                end.insert_str(0, &format!("</{name}>"));
            }
            let xml = format!(
                "<fmiModelDescription fmiVersion=\"{version}\">{begin}<odd/>{end}</fmiModelDescription>"
            );
            let found = findings(&xml, schema::structure);
            let last = path.last().map_or("fmiModelDescription", String::as_str);
            let odd_child = format!("the element is not allowed in {last} (allowed: ");
            let children = found.iter().find_map(|f| f.text.strip_prefix(&odd_child));
            let odd_attribute = "the schema has no attribute odd";
            let is_known =
                children.is_some() || found.iter().any(|f| f.text.starts_with(odd_attribute));
            assert!(is_known, "{path:?}");
            let children = children.unwrap_or("nothing)").trim_end_matches(')');
            for child in children.split(", ").filter(|child| *child != "nothing") {
                if seen.insert((last.to_string(), child.to_string())) {
                    paths.push([&path[..], &[child.to_string()]].concat());
                }
            }
        }
        assert!(seen.len() > 30, "{seen:?}");
    }
}

//! Writes the report as JUnit XML with one test case per rule, so that any CI server can show it.

use std::io::Write;

use anyhow::Result;
use serde::Serialize;

use super::findings::Severity;
use super::report::{Outcome, Report};

#[derive(Serialize)]
#[serde(rename = "testsuites")]
struct TestSuites {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "@tests")]
    tests: usize,
    #[serde(rename = "@failures")]
    failures: usize,
    #[serde(rename = "@errors")]
    errors: usize,
    #[serde(rename = "testsuite")]
    suite: TestSuite,
}

#[derive(Serialize)]
struct TestSuite {
    #[serde(rename = "@name")]
    name: String,
    #[serde(rename = "@tests")]
    tests: usize,
    #[serde(rename = "@skipped")]
    skipped: usize,
    #[serde(rename = "@errors")]
    errors: usize,
    #[serde(rename = "@failures")]
    failures: usize,
    #[serde(rename = "testcase")]
    cases: Vec<TestCase>,
}

#[derive(Serialize)]
struct TestCase {
    #[serde(rename = "@name")]
    name: &'static str,
    #[serde(rename = "@classname")]
    class: &'static str,
    #[serde(rename = "@time")]
    time: String,
    error: Option<Text>,
    failure: Option<Text>,
    skipped: Option<Text>,
    #[serde(rename = "system-out")]
    output: Option<String>,
}

#[derive(Serialize)]
struct Text {
    #[serde(rename = "@message")]
    message: String,
    #[serde(rename = "#text")]
    text: Option<String>,
}

/// Writes the report. Each rule is a test case, classed by the rule's group; errors fail the test case, and
/// warnings are its output.
pub fn write(report: &Report, out: &mut impl Write) -> Result<()> {
    let mut cases: Vec<_> = report.outcomes.iter().map(case).collect();
    cases.extend(report.unchecked.as_deref().map(unchecked));
    let errors = cases.iter().filter(|case| case.error.is_some()).count();
    let tests = cases.len();
    let failures = cases.iter().filter(|case| case.failure.is_some()).count();
    let skipped = cases.iter().filter(|case| case.skipped.is_some()).count();
    let name = xml_characters(&report.path.display().to_string());
    let suite = TestSuite { name, tests, skipped, errors, failures, cases };
    let suites = TestSuites { name: "hubslosh check", tests, failures, errors, suite };
    let layout = xml::EmitterConfig::new().perform_indent(true).indent_string("  ");
    serde_xml_rs::SerdeXml::new().emitter(layout).to_writer(&mut *out, &suites)?;
    Ok(writeln!(out)?)
}

fn case(outcome: &Outcome) -> TestCase {
    let rule = outcome.rule;
    let lines = |severity: Severity| {
        let of = outcome.findings.list.iter().filter(move |f| f.severity == severity);
        xml_characters(
            &of.map(|f| format!("{}: {}", f.place, f.text)).collect::<Vec<_>>().join("\n"),
        )
    };
    let (errors, warnings) = (lines(Severity::Error), lines(Severity::Warning));
    let failed = !errors.is_empty();
    TestCase {
        name: rule.id,
        class: rule.id.split('.').next().unwrap_or_default(),
        time: format!("{:.3}", outcome.time.as_secs_f64()),
        error: None,
        skipped: outcome
            .findings
            .reason()
            .filter(|_| !failed)
            .map(|why| Text { message: xml_characters(&why), text: None }),
        failure: failed.then(|| Text {
            message: format!("{} [{}]", rule.title, rule.source),
            text: Some(errors),
        }),
        output: (!warnings.is_empty()).then(|| format!("warning: {warnings}")),
    }
}

/// Returns a separate test case for the error that no rule was checked, because viewers show a suite that is
/// skipped as a whole as a success.
fn unchecked(why: &str) -> TestCase {
    TestCase {
        name: "check",
        class: "check",
        time: "0.000".into(),
        error: Some(Text { message: xml_characters(why), text: None }),
        failure: None,
        skipped: None,
        output: None,
    }
}

fn xml_characters(text: &str) -> String {
    let allowed = |c: &char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{fffd}' | '\u{10000}'..);
    text.chars().filter(allowed).collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::findings::Findings;
    use super::super::report::Outcome;
    use super::super::rules::fmi2::RULES;
    use super::*;
    use host::xml::Element;

    #[test]
    fn every_rule_is_a_junit_case_and_any_text_is_escaped() {
        let mut outcomes: Vec<_> = RULES
            .iter()
            .map(|rule| Outcome {
                rule,
                findings: Findings::new(Severity::Warning),
                time: Duration::ZERO,
            })
            .collect();
        outcomes[0].findings.at("a\u{1}b").fail("<&\"]]>");
        outcomes[1].findings.at("c").add("d");
        outcomes[2].findings.skip("e");
        let report = Report { path: "x.fmu".into(), outcomes, unchecked: None, bug: None };
        let mut out = Vec::new();
        write(&report, &mut out).unwrap();
        let root = Element::parse(&out).unwrap();
        let suite = &root.children[0];
        assert_eq!(suite.children.len(), RULES.len());
        assert_eq!((suite.get("failures"), suite.get("skipped")), (Some("1"), Some("1")));
        assert_eq!(root.get("failures"), Some("1"));
        assert_eq!(suite.children[0].children[0].name, "failure");
        assert_eq!(suite.children[1].children[0].name, "system-out");
        assert_eq!(suite.children[2].children[0].name, "skipped");
    }
}

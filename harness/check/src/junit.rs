//! The report as JUnit XML: one test case for each rule, so that any CI shows it.

use std::io::Write;

use anyhow::Result;
use quick_junit::{NonSuccessKind, TestCase, TestCaseStatus, TestSuite};

use super::{Report, Severity};

/// Writes the report. Rules are test cases, classed by their group; errors fail them, warnings are
/// their output.
pub fn write(report: &Report, out: &mut impl Write) -> Result<()> {
    let mut suite = TestSuite::new(report.path.display().to_string());
    for outcome in &report.outcomes {
        let rule = outcome.rule;
        let lines = |severity: Severity| {
            let of = outcome.findings.list.iter().filter(move |f| f.severity == severity);
            of.map(|f| format!("{}: {}", f.place, f.text)).collect::<Vec<_>>().join("\n")
        };
        let (errors, warnings) = (lines(Severity::Error), lines(Severity::Warning));
        let mut status = match &outcome.findings.skipped {
            _ if !errors.is_empty() => TestCaseStatus::non_success(NonSuccessKind::Failure),
            Some(_) => TestCaseStatus::skipped(),
            None => TestCaseStatus::success(),
        };
        if !errors.is_empty() {
            status.set_message(format!("{} [{}]", rule.title, rule.source));
            status.set_description(errors);
        } else if let Some(why) = &outcome.findings.skipped {
            status.set_message(why.as_str());
        }
        let mut case = TestCase::new(rule.id, status);
        case.set_classname(rule.id.split('.').next().unwrap_or_default());
        case.set_time(outcome.time);
        if !warnings.is_empty() {
            case.set_system_out(format!("warning: {warnings}"));
        }
        suite.add_test_case(case);
    }
    let mut junit = quick_junit::Report::new("hubslosh check");
    junit.add_test_suite(suite);
    junit.serialize(out)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::{Findings, Outcome, RULES};
    use super::*;
    use host::xml::Element;

    #[test]
    fn every_rule_is_a_case_and_any_text_can_be_told() {
        let mut outcomes: Vec<_> = RULES
            .iter()
            .map(|rule| Outcome {
                rule,
                findings: Findings::new(Severity::Warning),
                time: Duration::ZERO,
            })
            .collect();
        outcomes[0].findings.fail("a\u{1}b", "<&\"]]>");
        outcomes[1].findings.add("c", "d");
        outcomes[2].findings.skip("e");
        let report = Report { path: "x.fmu".into(), outcomes };
        let mut out = Vec::new();
        write(&report, &mut out).unwrap();
        let root = Element::parse(&out).unwrap();
        let suite = &root.children[0];
        assert_eq!(suite.children.len(), RULES.len());
        assert_eq!((suite.get("failures"), suite.get("skipped")), (Some("1"), Some("1")));
        assert_eq!(suite.children[0].children[0].name, "failure");
        assert_eq!(suite.children[1].children[0].name, "system-out");
        assert_eq!(suite.children[2].children[0].name, "skipped");
    }
}

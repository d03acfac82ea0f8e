//! The report as JUnit XML: one test case for each rule, so that any CI shows it.

use std::io::Write;

use anyhow::Result;
use xml::writer::{EmitterConfig, EventWriter, XmlEvent};

use super::{Report, Severity};

/// Writes the report. Rules are test cases, classed by their group; errors fail them, warnings are
/// their output.
pub fn write(report: &Report, out: &mut impl Write) -> Result<()> {
    let failures = |outcome: &super::Outcome| {
        outcome.findings.list.iter().any(|f| f.severity == Severity::Error)
    };
    let failed = report.outcomes.iter().filter(|o| failures(o)).count().to_string();
    let skipped = report.outcomes.iter().filter(|o| o.findings.skipped.is_some()).count();
    let tests = report.outcomes.len().to_string();
    let path = report.path.display().to_string();
    let mut writer =
        EventWriter::new_with_config(&mut *out, EmitterConfig::new().perform_indent(true));
    writer.write(XmlEvent::start_element("testsuites"))?;
    writer.write(
        XmlEvent::start_element("testsuite")
            .attr("name", &writable(&path))
            .attr("tests", &tests)
            .attr("failures", &failed)
            .attr("errors", "0")
            .attr("skipped", &skipped.to_string()),
    )?;
    for outcome in &report.outcomes {
        let group = outcome.rule.id.split('.').next().unwrap_or_default();
        writer.write(
            XmlEvent::start_element("testcase")
                .attr("classname", group)
                .attr("name", outcome.rule.id)
                .attr("time", &format!("{:.3}", outcome.time.as_secs_f64())),
        )?;
        let lines = |severity: Severity| {
            let of = outcome.findings.list.iter().filter(move |f| f.severity == severity);
            let lines: Vec<_> = of.map(|f| writable(&format!("{}: {}", f.place, f.text))).collect();
            lines.join("\n")
        };
        let (errors, warnings) = (lines(Severity::Error), lines(Severity::Warning));
        if !errors.is_empty() {
            let message = format!("{} [{}]", outcome.rule.title, outcome.rule.source);
            writer.write(XmlEvent::start_element("failure").attr("message", &message))?;
            writer.write(XmlEvent::characters(&errors))?;
            writer.write(XmlEvent::end_element())?;
        } else if let Some(why) = &outcome.findings.skipped {
            writer.write(XmlEvent::start_element("skipped").attr("message", &writable(why)))?;
            writer.write(XmlEvent::end_element())?;
        }
        if !warnings.is_empty() {
            writer.write(XmlEvent::start_element("system-out"))?;
            writer.write(XmlEvent::characters(&format!("warning: {warnings}")))?;
            writer.write(XmlEvent::end_element())?;
        }
        writer.write(XmlEvent::end_element())?;
    }
    writer.write(XmlEvent::end_element())?;
    writer.write(XmlEvent::end_element())?;
    writeln!(out)?;
    Ok(())
}

/// Without the characters that XML cannot hold; an FMU may log any.
fn writable(text: &str) -> String {
    let allowed = |c: char| c >= ' ' || matches!(c, '\n' | '\t');
    text.chars().map(|c| if allowed(c) { c } else { '\u{fffd}' }).collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::element::Element;
    use super::super::{Findings, Outcome, RULES};
    use super::*;

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

//! Writes the report as JUnit XML with one test case per rule, so that any CI server can show it.

use std::io::Write;

use anyhow::Result;
use xml::EmitterConfig;
use xml::writer::{EventWriter, XmlEvent};

use super::findings::Severity;
use super::report::{Outcome, Report};

/// Writes the report. Each rule is a test case, whose class is the group of the rule. Errors make the test case fail,
/// and warnings are its output.
pub fn write(report: &Report, out: &mut impl Write) -> Result<()> {
    let is_failed = |o: &&Outcome| o.findings.list.iter().any(|f| f.severity == Severity::Error);
    let failures = report.outcomes.iter().filter(is_failed).count();
    let is_skipped = |o: &&Outcome| !is_failed(o) && o.findings.skipped.is_some();
    let skipped = report.outcomes.iter().filter(is_skipped).count();
    let errors = usize::from(report.unchecked.is_some());
    let tests = report.outcomes.len() + errors;
    let [tests, skipped, errors, failures] =
        [tests, skipped, errors, failures].map(|number| number.to_string());
    let layout = EmitterConfig::new().perform_indent(true).indent_string("  ");
    let mut xml = layout.create_writer(&mut *out);
    let suites = XmlEvent::start_element("testsuites").attr("name", "hubslosh check");
    let suites = suites.attr("tests", &tests).attr("failures", &failures).attr("errors", &errors);
    xml.write(suites)?;
    let name = xml_characters(&report.path.display().to_string());
    let suite = XmlEvent::start_element("testsuite").attr("name", &name).attr("tests", &tests);
    let suite = suite.attr("skipped", &skipped).attr("errors", &errors);
    xml.write(suite.attr("failures", &failures))?;
    for outcome in &report.outcomes {
        let Outcome { rule, findings, time } = outcome;
        let lines = |severity: Severity| {
            let of = findings.list.iter().filter(move |f| f.severity == severity);
            of.map(|f| format!("{}: {}", f.place, f.text)).collect::<Vec<_>>().join("\n")
        };
        let (errors, warnings) = (lines(Severity::Error), lines(Severity::Warning));
        begin_case(&mut xml, rule.id, &format!("{:.3}", time.as_secs_f64()))?;
        if !errors.is_empty() {
            let message = format!("{} [{}]", rule.title, rule.source);
            write_element(&mut xml, "failure", Some(&message), &errors)?;
        } else if let Some(why) = findings.reason() {
            write_element(&mut xml, "skipped", Some(&why), "")?;
        }
        if !warnings.is_empty() {
            write_element(&mut xml, "system-out", None, &format!("warning: {warnings}"))?;
        }
        xml.write(XmlEvent::end_element())?;
    }
    // An unchecked FMU is a test case of its own that fails, because viewers show a suite whose cases are all
    // skipped as a success.
    if let Some(why) = &report.unchecked {
        begin_case(&mut xml, "check", "0.000")?;
        write_element(&mut xml, "error", Some(why), "")?;
        xml.write(XmlEvent::end_element())?;
    }
    xml.write(XmlEvent::end_element())?;
    xml.write(XmlEvent::end_element())?;
    Ok(writeln!(out)?)
}

fn begin_case(xml: &mut EventWriter<impl Write>, rule: &str, seconds: &str) -> Result<()> {
    let group = rule.split('.').next().unwrap_or_default();
    let case = XmlEvent::start_element("testcase").attr("name", rule);
    Ok(xml.write(case.attr("classname", group).attr("time", seconds))?)
}

fn write_element(
    xml: &mut EventWriter<impl Write>,
    name: &str,
    message: Option<&str>,
    text: &str,
) -> Result<()> {
    let message = message.map(xml_characters);
    let element = XmlEvent::start_element(name);
    xml.write(match &message {
        Some(message) => element.attr("message", message),
        None => element,
    })?;
    if !text.is_empty() {
        xml.write(XmlEvent::characters(&xml_characters(text)))?;
    }
    Ok(xml.write(XmlEvent::end_element())?)
}

fn xml_characters(text: &str) -> String {
    let allowed = |c: &char| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{fffd}' | '\u{10000}'..);
    text.chars().filter(allowed).collect()
}

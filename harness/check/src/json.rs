use std::io::Write;

use anyhow::Result;
use serde::Serialize;

use super::findings::{Finding, Severity};
use super::report::{Outcome, Report};

#[derive(Serialize)]
struct File<'r> {
    fmu: String,
    errors: usize,
    warnings: usize,
    unchecked: Option<&'r str>,
    rules: Vec<Rule<'r>>,
}

#[derive(Serialize)]
struct Rule<'r> {
    rule: &'static str,
    title: &'static str,
    source: &'static str,
    findings: &'r [Finding],
    skipped: Option<String>,
    seconds: f64,
}

impl<'r> Rule<'r> {
    fn new(outcome: &'r Outcome) -> Rule<'r> {
        Rule {
            rule: outcome.rule.id,
            title: outcome.rule.title,
            source: outcome.rule.source,
            findings: &outcome.findings.list,
            skipped: outcome.findings.reason(),
            seconds: outcome.time.as_secs_f64(),
        }
    }
}

pub fn write(report: &Report, out: &mut impl Write) -> Result<()> {
    let rules = report.outcomes.iter().map(Rule::new).collect();
    let file = File {
        fmu: report.path.display().to_string(),
        errors: report.count_findings(Severity::Error),
        warnings: report.count_findings(Severity::Warning),
        unchecked: report.unchecked.as_deref(),
        rules,
    };
    serde_json::to_writer_pretty(&mut *out, &file)?;
    writeln!(out)?;
    Ok(())
}

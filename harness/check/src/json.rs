//! The report as JSON, for programs.

use std::io::Write;

use anyhow::Result;
use serde::Serialize;

use super::findings::{Finding, Severity};
use super::report::{Outcome, Report};

/// The file as a whole.
#[derive(Serialize)]
struct File<'r> {
    /// The FMU.
    fmu: String,
    /// Number of errors.
    errors: usize,
    /// Number of warnings.
    warnings: usize,
    /// The error that no selected rule was checked; null if one was.
    unchecked: Option<&'r str>,
    /// One for each rule that was looked at or skipped, in the table's order.
    rules: Vec<Rule<'r>>,
}

/// Result of a rule.
#[derive(Serialize)]
struct Rule<'r> {
    rule: &'static str,
    title: &'static str,
    source: &'static str,
    findings: &'r [Finding],
    /// Reason why it was not checked; null if it was.
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

/// Writes the report.
///
/// # Errors
/// If it cannot be written.
pub fn write(report: &Report, out: &mut impl Write) -> Result<()> {
    let rules = report.outcomes.iter().map(Rule::new).collect();
    let file = File {
        fmu: report.path.display().to_string(),
        errors: report.count(Severity::Error),
        warnings: report.count(Severity::Warning),
        unchecked: report.unchecked.as_deref(),
        rules,
    };
    serde_json::to_writer_pretty(&mut *out, &file)?;
    writeln!(out)?;
    Ok(())
}

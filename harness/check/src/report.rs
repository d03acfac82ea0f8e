//! The report of a check.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use crate::findings::{Finding, Findings, Severity};
use crate::rule::Rule;

/// Findings of one rule that a person is shown; those kept are in the JUnit file.
const SHOWN: usize = 8;

/// Result of a rule.
pub struct Outcome {
    /// The rule.
    pub rule: &'static Rule,
    /// Findings.
    pub findings: Findings,
    /// Time that it took.
    pub time: Duration,
}

/// Everything that was looked at.
pub struct Report {
    /// The FMU.
    pub path: PathBuf,
    /// One for each rule, in the table's order.
    pub outcomes: Vec<Outcome>,
    /// The error that no selected rule was checked, if that is so: such a report says nothing about the FMU.
    pub unchecked: Option<String>,
    /// Report of a bug of this program for which a rule could not be checked.
    pub bug: Option<String>,
}

impl Report {
    /// Number of findings of this severity.
    pub fn count(&self, severity: Severity) -> usize {
        let more = self.outcomes.iter().map(|outcome| &outcome.findings);
        let more = more.filter(|f| f.severity == severity).map(|f| f.more).sum::<usize>();
        more + self.all().filter(|(_, finding)| finding.severity == severity).count()
    }

    /// All findings, each with its rule.
    pub fn all(&self) -> impl Iterator<Item = (&'static Rule, &Finding)> {
        self.outcomes.iter().flat_map(|o| o.findings.list.iter().map(move |f| (o.rule, f)))
    }

    /// Returns the report as text: every finding, the skipped rules with reasons, and a summary.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for outcome in &self.outcomes {
            let Outcome { rule, findings, .. } = outcome;
            for finding in findings.list.iter().take(SHOWN) {
                let _ = writeln!(
                    text,
                    "{} {}: {}: {}",
                    finding.severity.name(),
                    rule.id,
                    finding.place,
                    finding.text
                );
            }
            let more = findings.more + findings.list.len().saturating_sub(SHOWN);
            if more > 0 {
                let _ = writeln!(text, "  and {more} more like these");
            }
            if !findings.list.is_empty() {
                let _ = writeln!(text, "  rule: {} [{}]", rule.title, rule.source);
            }
        }
        let mut reasons: Vec<(String, Vec<&str>)> = Vec::new();
        for outcome in &self.outcomes {
            let Some(why) = outcome.findings.reason() else { continue };
            match reasons.iter_mut().find(|(known, _)| *known == why) {
                Some((_, rules)) => rules.push(outcome.rule.id),
                None => reasons.push((why, vec![outcome.rule.id])),
            }
        }
        for (why, rules) in reasons {
            match rules.len() {
                1 => _ = writeln!(text, "skipped {}: {why}", rules[0]),
                n => {
                    _ = writeln!(text, "skipped {n} rules, {} to {}: {why}", rules[0], rules[n - 1])
                }
            }
        }
        let skipped = self.outcomes.iter().filter(|o| o.findings.skipped.is_some()).count();
        let _ = writeln!(
            text,
            "{}: {} errors, {} warnings; {} rules looked at, {skipped} skipped",
            self.path.display(),
            self.count(Severity::Error),
            self.count(Severity::Warning),
            self.outcomes.len() - skipped,
        );
        if let Some(why) = &self.unchecked {
            let _ = writeln!(text, "error: {why}");
        }
        text
    }
}

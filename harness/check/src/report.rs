use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use crate::findings::{Finding, Findings, Severity};
use crate::rule::Rule;

/// Largest number of findings of one rule in the text report. The JUnit file lists all findings that were stored.
const SHOWN: usize = 8;

pub struct Outcome {
    pub rule: &'static Rule,
    pub findings: Findings,
    pub time: Duration,
}

pub struct Report {
    pub path: PathBuf,
    pub outcomes: Vec<Outcome>,
    /// The error that no selected rule could be checked. A report with this error contains no result about the FMU.
    pub unchecked: Option<String>,
    /// Report of a bug in this program that prevented the check of a rule.
    pub bug: Option<String>,
}

impl Report {
    pub fn count_findings(&self, severity: Severity) -> usize {
        let more = self.outcomes.iter().map(|outcome| &outcome.findings);
        let more = more.filter(|f| f.severity == severity).map(|f| f.more).sum::<usize>();
        more + self.all().filter(|(_, finding)| finding.severity == severity).count()
    }

    pub fn all(&self) -> impl Iterator<Item = (&'static Rule, &Finding)> {
        self.outcomes.iter().flat_map(|o| o.findings.list.iter().map(move |f| (o.rule, f)))
    }

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
            "{}: {} errors, {} warnings; {} rules checked, {skipped} skipped",
            self.path.display(),
            self.count_findings(Severity::Error),
            self.count_findings(Severity::Warning),
            self.outcomes.len() - skipped,
        );
        if let Some(why) = &self.unchecked {
            let _ = writeln!(text, "error: {why}");
        }
        text
    }
}

//! Findings of one rule, and their severity.

use serde::{Deserialize, Serialize};

/// Findings of one rule that are kept: a file with a hundred thousand variables, all of them wrong,
/// shall not fill the memory with sentences.
const KEPT: usize = 1000;

/// Severity of a broken rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The standard forbids it, or hosts fail.
    Error,
    /// Some importers fail on it, or their users get no useful message.
    Warning,
}

impl Severity {
    /// The word that reports use.
    pub fn name(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
        }
    }
}

/// A rule that is broken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Severity.
    pub severity: Severity,
    /// Location: a file, a line, a variable, a call.
    pub place: String,
    /// The fault, and what is allowed.
    pub text: String,
}

/// Result of one rule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Findings {
    pub(crate) severity: Severity,
    /// The first [`KEPT`] findings; empty if there are none.
    pub list: Vec<Finding>,
    /// Number of further findings.
    pub more: usize,
    /// Reason why the rule does not apply or could not be checked.
    pub skipped: Option<String>,
    /// The rule that must tell the fault for which this one could not be looked at.
    pub(crate) told_by: Option<String>,
    /// The call at which the rule had to stop, if a crash or a refused call ended it: its last finding.
    pub(crate) stopped_at: Option<String>,
}

impl Findings {
    /// Nothing found yet; what will be found is this bad.
    pub fn new(severity: Severity) -> Findings {
        Findings {
            severity,
            list: Vec::new(),
            more: 0,
            skipped: None,
            told_by: None,
            stopped_at: None,
        }
    }

    /// The rule is broken.
    pub fn add(&mut self, place: impl Into<String>, text: impl Into<String>) {
        if self.list.len() >= KEPT {
            self.more += 1;
            return;
        }
        self.list.push(Finding { severity: self.severity, place: place.into(), text: text.into() });
    }

    /// The rule is broken, and that is an error whatever the rule says.
    pub fn fail(&mut self, place: impl Into<String>, text: impl Into<String>) {
        let finding = Finding { severity: Severity::Error, place: place.into(), text: text.into() };
        if self.list.len() >= KEPT {
            self.list.pop(); // an error shows, however many warnings there are
            self.more += 1;
        }
        self.list.push(finding);
    }

    /// The rule is bent: a warning, whatever the rule says.
    pub fn warn(&mut self, place: impl Into<String>, text: impl Into<String>) {
        let kept = self.list.len();
        self.add(place, text);
        if let Some(last) = self.list.get_mut(kept) {
            last.severity = Severity::Warning;
        }
    }

    /// True if an error was found.
    pub(crate) fn has_error(&self) -> bool {
        self.list.iter().any(|finding| finding.severity == Severity::Error)
    }

    /// The rule does not apply.
    pub fn skip(&mut self, why: impl Into<String>) {
        self.skipped = Some(why.into());
    }

    /// Returns why the rule was not checked, with the rule that names the cause.
    pub fn reason(&self) -> Option<String> {
        let why = self.skipped.as_deref()?;
        Some(match self.told_by.as_deref() {
            None | Some("") => why.into(),
            Some(rule) => format!("because of {rule}: {why}"),
        })
    }

    /// The rule cannot be looked at, for a fault that another rule tells.
    pub fn skip_for(&mut self, rule: &str, why: impl Into<String>) {
        self.skip(why);
        self.told_by = Some(rule.into());
    }
}

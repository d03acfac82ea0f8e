use serde::{Deserialize, Serialize};

/// Largest number of findings that are stored for one rule, so that a file with a hundred thousand wrong
/// variables does not fill the memory.
const KEPT: usize = 1000;

/// Severity of a broken rule: an error is forbidden by the standard or makes hosts fail; a warning makes some
/// importers fail or leaves their users without a useful message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    Error,
    Warning,
}

impl Severity {
    pub fn name(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    pub severity: Severity,
    /// Location of the fault: a file, line, variable or call.
    pub place: String,
    /// Description of the fault and of the allowed values.
    pub text: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Findings {
    pub(crate) severity: Severity,
    /// The first findings, at most [`KEPT`].
    pub list: Vec<Finding>,
    /// Number of findings beyond [`KEPT`].
    pub more: usize,
    pub skipped: Option<String>,
    /// Identifier of the rule that reports the fault which made this rule impossible to check.
    pub(crate) reported_by: Option<String>,
    /// The call at which the rule ended early because of a crash or a refusal. This is then the rule's last
    /// finding.
    pub(crate) stopped_at: Option<String>,
}

impl Findings {
    /// Creates an empty list whose findings will have this severity.
    pub fn new(severity: Severity) -> Findings {
        Findings {
            severity,
            list: Vec::new(),
            more: 0,
            skipped: None,
            reported_by: None,
            stopped_at: None,
        }
    }

    pub fn add(&mut self, place: impl Into<String>, text: impl Into<String>) {
        if self.list.len() >= KEPT {
            self.more += 1;
            return;
        }
        self.list.push(Finding { severity: self.severity, place: place.into(), text: text.into() });
    }

    /// Adds a finding that is an error even if the rule is only a warning.
    pub fn fail(&mut self, place: impl Into<String>, text: impl Into<String>) {
        let finding = Finding { severity: Severity::Error, place: place.into(), text: text.into() };
        if self.list.len() >= KEPT {
            self.list.pop(); // an error shows, however many warnings there are
            self.more += 1;
        }
        self.list.push(finding);
    }

    /// Adds a finding that is only a warning even if the rule is an error.
    pub fn warn(&mut self, place: impl Into<String>, text: impl Into<String>) {
        let kept = self.list.len();
        self.add(place, text);
        if let Some(last) = self.list.get_mut(kept) {
            last.severity = Severity::Warning;
        }
    }

    pub(crate) fn has_error(&self) -> bool {
        self.list.iter().any(|finding| finding.severity == Severity::Error)
    }

    pub fn skip(&mut self, why: impl Into<String>) {
        self.skipped = Some(why.into());
    }

    /// Returns the reason why the rule was not checked, together with the rule that reports the cause.
    pub fn reason(&self) -> Option<String> {
        let why = self.skipped.as_deref()?;
        Some(match self.reported_by.as_deref() {
            None | Some("") => why.into(),
            Some(rule) => format!("because of {rule}: {why}"),
        })
    }

    /// Skips the rule because of a fault that `rule` reports.
    pub fn skip_for(&mut self, rule: &str, why: impl Into<String>) {
        self.skip(why);
        self.reported_by = Some(rule.into());
    }
}

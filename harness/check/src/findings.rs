use serde::{Deserialize, Serialize};

/// Largest number of findings that are stored for one rule, so that a file with a hundred thousand wrong
/// variables does not fill the memory.
const KEPT: usize = 1000;

/// Severity of a broken rule: an error is forbidden by the standard or makes hosts fail; a warning makes some
/// importers fail or leaves their users without a useful message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    #[default]
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
    pub place: String,
    pub text: String,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Findings {
    pub(crate) severity: Severity,
    pub list: Vec<Finding>,
    pub more: usize,
    pub skipped: Option<String>,
    /// Identifier of another rule that reports the fault because of which this rule cannot be checked.
    pub(crate) reported_by: Option<String>,
    /// The call at which the rule ended early, because the FMU crashed or refused the call. The rule's last finding
    /// then describes this call.
    pub(crate) stopped_at: Option<String>,
}

impl Findings {
    pub fn new(severity: Severity) -> Findings {
        Findings { severity, ..Findings::default() }
    }

    /// Begins a finding about the element, file or call `place`; the methods of the returned value
    /// add its text.
    pub fn at(&mut self, place: impl Into<String>) -> At<'_> {
        At { findings: self, place: place.into() }
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

pub struct At<'f> {
    findings: &'f mut Findings,
    place: String,
}

impl At<'_> {
    pub fn add(self, text: impl Into<String>) {
        let severity = self.findings.severity;
        self.push(severity, text.into());
    }

    /// Adds a finding that is an error, even if broken rules of this kind are normally only warnings.
    pub fn fail(self, text: impl Into<String>) {
        self.push(Severity::Error, text.into());
    }

    /// Adds a finding that is only a warning even if the rule is an error.
    pub fn warn(self, text: impl Into<String>) {
        self.push(Severity::Warning, text.into());
    }

    fn push(self, severity: Severity, text: String) {
        let At { findings, place } = self;
        if findings.list.len() >= KEPT {
            findings.more += 1;
            // If the list is full, an error replaces a warning, so that the error is shown in any case.
            let is_hidden = severity == Severity::Error && !findings.has_error();
            if !is_hidden {
                return;
            }
            findings.list.pop();
        }
        findings.list.push(Finding { severity, place, text });
    }
}

//! One rule and the function that checks it.

use anyhow::Result;

use crate::archive::Archive;
use crate::binaries::Binaries;
use crate::description::Description;
use crate::findings::{Findings, Severity};
use crate::under_test::FmuUnderTest;
use crate::v3;

/// One rule: what must hold, who says so, and how to look.
pub struct Rule {
    /// Group and name, `group.name`.
    pub id: &'static str,
    /// Statement that must hold.
    pub title: &'static str,
    /// The section of FMI 2.0.5 or 3.0.2, or the host that trips over it.
    pub source: &'static str,
    /// Severity when it is broken. A crash or an endless call is always an error.
    pub severity: Severity,
    /// Function that checks it.
    pub check: Check,
}

/// A rule as a line of a table.
pub(crate) const fn rule(
    id: &'static str,
    severity: Severity,
    title: &'static str,
    source: &'static str,
    check: Check,
) -> Rule {
    Rule { id, title, source, severity, check }
}

/// The function behind a rule, by what it looks at.
pub enum Check {
    /// The zip archive.
    Archive(fn(&Archive, &mut Findings)),
    /// modelDescription.xml.
    Description(fn(&Description, &mut Findings)),
    /// The files under `binaries/`.
    Binaries(fn(&Binaries, &mut Findings)),
    /// The loaded FMU, in a process of its own. A call that fails although it must not is a finding.
    Calls(fn(&FmuUnderTest, &mut Findings) -> Result<()>),
    /// modelDescription.xml of FMI 3.0.
    Description3(fn(&v3::Description, &mut Findings)),
    /// The files under `binaries/` of an FMU 3.0.
    Binaries3(fn(&v3::Binaries, &mut Findings)),
    /// The loaded FMU 3.0, in a process of its own.
    Calls3(fn(&v3::Subject, &mut Findings) -> Result<()>),
}

impl Rule {
    /// True if it calls the FMU.
    pub fn is_of_calls(&self) -> bool {
        matches!(self.check, Check::Calls(_) | Check::Calls3(_))
    }
}

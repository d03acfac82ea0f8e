use anyhow::Result;

use crate::archive::Archive;
use crate::binaries::Binaries;
use crate::description::Description;
use crate::findings::{Findings, Severity};
use crate::under_test::UnderTest;
use host::fmi2::Fmi2;
use host::fmi3::Fmi3;

/// A rule: a statement about every FMU, its source in the standard, and the function that checks it.
#[derive(serde::Serialize)]
pub struct Rule {
    #[serde(rename = "rule")]
    pub id: &'static str,
    pub title: &'static str,
    /// The section of FMI 2.0.5 or 3.0.2, or the name of a host that fails if the rule is broken.
    pub source: &'static str,
    /// Severity of a finding. A crash or an endless call is always an error.
    pub severity: Severity,
    #[serde(skip)]
    pub check: Check,
}

pub(crate) const fn rule(
    id: &'static str,
    severity: Severity,
    title: &'static str,
    source: &'static str,
    check: Check,
) -> Rule {
    Rule { id, title, source, severity, check }
}

pub type CheckCalls<V> = fn(&UnderTest<V>, &mut Findings) -> Result<()>;

pub enum Check {
    Archive(fn(&Archive, &mut Findings)),
    Description(fn(&Description, &mut Findings)),
    Binaries(fn(&Binaries, &mut Findings)),
    /// Function that checks the loaded FMU in a separate process. If the function returns an error, the call that
    /// failed is a finding.
    Calls(CheckCalls<Fmi2>),
    Calls3(CheckCalls<Fmi3>),
}

impl Rule {
    pub fn is_of_calls(&self) -> bool {
        matches!(self.check, Check::Calls(_) | Check::Calls3(_))
    }
}

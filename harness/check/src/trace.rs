//! The file through which a rule's process tells what it is about to do and what it found, for the FMU may
//! write to stdout.

use std::fs::File;
use std::io::Write;

use anyhow::Result;
use serde::{Deserialize, Serialize};

use super::Findings;

/// What it is if the process ends, or does not end, during what comes next.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Crash {
    /// An error, whatever the rule.
    Error,
    /// As bad as the rule: the standard does not say what such a call does.
    Open,
    /// What this rule tells.
    ToldBy(String),
}

/// One line of the file.
#[derive(Serialize, Deserialize)]
pub(super) enum Line {
    /// What comes next.
    Doing(String, Crash),
    /// All that was found; the last line.
    Done(Findings),
}

/// Where the process writes what it does.
pub struct Trace(pub(super) File);

impl Trace {
    fn write(&self, line: &Line) -> Result<()> {
        let mut text = serde_json::to_string(line)?;
        text.push('\n');
        // One call without a buffer: what was written is there when the process crashes.
        (&self.0).write_all(text.as_bytes())?;
        Ok(())
    }

    /// Another hand on the same file.
    pub fn again(&self) -> Result<Trace> {
        Ok(Trace(self.0.try_clone()?))
    }

    /// Tells what comes next.
    pub fn doing(&self, what: &str, crash: Crash) {
        // Without it a crash is told less well; that is all.
        let _ = self.write(&Line::Doing(what.into(), crash));
    }

    /// Tells what was found; nothing comes after it.
    pub fn done(&self, findings: Findings) -> Result<()> {
        self.write(&Line::Done(findings))
    }
}

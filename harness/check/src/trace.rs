//! The file through which a rule's process tells what it is about to do and what it found, for the FMU may
//! write to stdout.

use std::fs::File;
use std::io::Write;

use anyhow::Result;
use serde::{Deserialize, Serialize};

use super::Findings;

/// Meaning of a crash or hang during the next call.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Crash {
    /// An error, whatever the rule.
    Error,
    /// Same severity as the rule: the standard leaves the call open.
    Open,
    /// Reported by this rule.
    ToldBy(String),
}

/// One line of the file.
#[derive(Serialize, Deserialize)]
pub(super) enum Line {
    /// Announcement of the next call.
    Doing(String, Crash),
    /// All that was found; the last line.
    Done(Findings),
}

/// File to which the process writes its progress.
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

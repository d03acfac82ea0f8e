//! Messages from the process of a rule to its parent: the next call, and the findings.

use anyhow::Result;
use host::guard;
use serde::{Deserialize, Serialize};

use super::findings::Findings;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Crash {
    Error,
    /// The crash has the severity of the rule, because the standard leaves the call's effect open.
    Open,
    /// The crash is reported by the rule of this name, so that the present rule is skipped.
    ReportedBy(String),
}

#[derive(Serialize, Deserialize)]
pub(super) enum Answer {
    /// The next call, and what a crash in it would mean.
    Doing(String, Crash),
    Done(Findings),
}

/// Tells the parent process which call comes next and what a crash in it would mean.
pub fn doing(what: &str, crash: Crash) {
    // If sending fails, the report of a crash does not name the call.
    let _ = send(&Answer::Doing(what.into(), crash));
}

pub fn done(findings: Findings) -> Result<()> {
    send(&Answer::Done(findings))
}

fn send(answer: &Answer) -> Result<()> {
    guard::send_answer(&serde_json::to_vec(answer)?);
    Ok(())
}

//! Messages from the process of a rule to its parent: the next call, and the findings.

use anyhow::Result;
use host::guard;
use serde::{Deserialize, Serialize};

use super::findings::Findings;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Crash {
    Error,
    /// A crash is an error or a warning, according to the severity of the rule,
    /// because the standard does not define the effect of the call.
    Open,
    /// Another rule with this name reports the crash, so that the present rule is skipped.
    ReportedBy(String),
}

#[derive(Serialize, Deserialize)]
pub(super) enum Answer {
    /// The description of the next call, and the meaning of a crash in this call.
    Doing(String, Crash),
    Done(Findings),
}

/// Tells the parent process the next call and the meaning of a crash in this call.
pub fn announce_call(what: &str, crash: Crash) {
    // If the message cannot be sent, the report of a crash does not name the call; nothing
    // else depends on it.
    let _ = send(&Answer::Doing(what.into(), crash));
}

pub fn done(findings: Findings) -> Result<()> {
    send(&Answer::Done(findings))
}

fn send(answer: &Answer) -> Result<()> {
    guard::send_answer(&serde_json::to_vec(answer)?);
    Ok(())
}

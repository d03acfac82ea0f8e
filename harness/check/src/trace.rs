//! Messages from a rule's process to its parent: the next call and the findings.

use anyhow::Result;
use host::guard;
use serde::{Deserialize, Serialize};

use super::findings::Findings;

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

/// An answer.
#[derive(Serialize, Deserialize)]
pub(super) enum Answer {
    /// Announcement of the next call.
    Doing(String, Crash),
    /// All that was found; the last answer.
    Done(Findings),
}

/// Announces the next call to the parent.
pub fn doing(what: &str, crash: Crash) {
    // without it, the report of a crash does not name the call
    let _ = send(&Answer::Doing(what.into(), crash));
}

/// Sends the findings to the parent, as the last message.
pub fn done(findings: Findings) -> Result<()> {
    send(&Answer::Done(findings))
}

fn send(answer: &Answer) -> Result<()> {
    guard::answer(&serde_json::to_vec(answer)?);
    Ok(())
}

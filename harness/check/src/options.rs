//! Options of a check.

use std::path::PathBuf;
use std::time::Duration;

/// Options of a check.
pub struct Options {
    /// The program that makes the calls, `hubslosh`, run with the hidden subcommand `check-calls`.
    pub program: PathBuf,
    /// Rules or groups of rules to look at, by the beginning of their names; empty for all.
    pub only: Vec<String>,
    /// Time that the calls of one rule may take.
    pub limit: Duration,
}

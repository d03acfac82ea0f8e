use std::path::PathBuf;
use std::time::Duration;

pub struct Options {
    /// The program `hubslosh`, whose hidden subcommand `check-calls` makes the calls.
    pub program: PathBuf,
    /// Rules, or groups of rules such as `steps`, to check; empty for all.
    pub only: Vec<String>,
    pub limit: Duration,
}

//! Progress of a long computation, for the program that displays it.

/// A piece of news. It may come from any thread.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// Start of some runs, with the total number of their communication steps.
    Begins {
        /// Number of runs.
        runs: usize,
        /// Number of communication steps of all runs.
        steps: u64,
    },
    /// Number of further steps done.
    Steps(u64),
    /// A line for people.
    Note(String),
}

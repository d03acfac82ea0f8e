//! Progress of a long computation, for the program that displays it.

/// A report of progress, sent from any thread.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// Start of some runs, with their number and the total number of their communication steps.
    Begins { runs: usize, steps: u64 },
    /// Number of further steps done.
    Steps(u64),
    /// A line for people.
    Note(String),
}

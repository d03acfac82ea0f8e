//! Progress of a long computation, for the program that displays it.

/// A report of progress, sent from any thread: the start of a number of runs with the total number of their
/// communication steps, the number of steps done since the last report, or a line of text.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    Begins { runs: usize, steps: u64 },
    Steps(u64),
    Note(String),
}

//! Progress of a long computation, for the program that displays it.

/// A report of progress, sent from any thread: the start of some runs, with their number and the total number
/// of their communication steps; the number of further steps done; or a line for people.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    Begins { runs: usize, steps: u64 },
    Steps(u64),
    Note(String),
}

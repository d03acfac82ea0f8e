//! What a long computation tells the program that shows its progress.

/// A piece of news. It may come from any thread.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// So many runs begin, of so many communication steps together.
    Begins {
        /// Number of runs.
        runs: usize,
        /// Number of communication steps of all runs.
        steps: u64,
    },
    /// So many further steps are done.
    Steps(u64),
    /// A line for people.
    Note(String),
}

//! Collects all problems of a plan, each with its lines in the file.

use anyhow::{Result, bail};

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Lines(Vec<usize>);

impl Lines {
    pub fn single(line: usize) -> Self {
        Lines(vec![line])
    }

    pub fn union(&self, other: &Lines) -> Self {
        let mut all = [&self.0[..], &other.0].concat();
        all.sort_unstable();
        all.dedup();
        Lines(all)
    }

    fn prefix(&self) -> String {
        match &self.0[..] {
            [] => String::new(),
            [one] => format!("line {one}: "),
            [all @ .., last] => {
                let all: Vec<String> = all.iter().map(usize::to_string).collect();
                format!("lines {} and {last}: ", all.join(", "))
            }
        }
    }
}

#[derive(Default)]
pub(super) struct Problems(Vec<(Lines, String)>);

impl Problems {
    pub fn add(&mut self, lines: &Lines, problem: impl Into<String>) {
        let problem = (lines.clone(), problem.into());
        if !self.0.contains(&problem) {
            self.0.push(problem);
        }
    }

    pub fn take<T>(&mut self, lines: &Lines, result: Result<T>) -> Option<T> {
        result.map_err(|error| self.add(lines, format!("{error:#}"))).ok()
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns all collected problems as one error, in the order of the plan's file, or `Ok` if
    /// there are none.
    pub fn check(mut self) -> Result<()> {
        self.0.sort_by_key(|(lines, _)| lines.0.first().copied());
        let all: Vec<String> =
            self.0.iter().map(|(lines, problem)| lines.prefix() + problem).collect();
        match &all[..] {
            [] => Ok(()),
            [one] => bail!("{one}"),
            many => bail!("{} problems:\n  {}", many.len(), many.join("\n  ")),
        }
    }
}

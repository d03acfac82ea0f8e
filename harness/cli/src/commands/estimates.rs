//! Results of `hubslosh identify`, whatever they were identified from.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use files::output;
use identify::estimate::Estimated;
use identify::news::News;

use crate::{progress, terminal};

/// Files and form of the results.
pub struct Out<'a> {
    /// File of the result, JSON.
    pub result: Option<&'a Path>,
    /// File of the report, HTML.
    pub report: Option<&'a Path>,
    /// Prints the result as JSON in place of tables.
    pub json: bool,
    /// Prints each attempt of the search.
    pub verbose: bool,
}

impl Out<'_> {
    /// Shows the progress of a search.
    ///
    /// # Errors
    /// If the search fails.
    pub fn search<T>(&self, search: impl FnOnce(&mut dyn FnMut(&News)) -> Result<T>) -> Result<T> {
        let spinner = progress::of_search()?;
        let found = search(&mut |news| match news {
            News::Detail(line) if !self.verbose => spinner.set_message(line.clone()),
            news => progress::tell(&spinner, news.line()),
        });
        spinner.finish_and_clear();
        found
    }

    /// Writes a result to its file, and sends it to the program that started this one, if there is one. `text` is JSON.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn keep(&self, text: &str) -> Result<()> {
        if terminal::has_reader() {
            terminal::message("result", text);
        }
        match self.result {
            Some(path) => output::write(path, text.as_bytes()),
            None => Ok(()),
        }
    }

    /// Keeps a result, prints it by `tables`, and writes the report.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn give(
        &self,
        text: &str,
        is_trusted: bool,
        tables: impl FnOnce(),
        page: impl FnOnce() -> String,
    ) -> Result<()> {
        self.keep(text)?;
        if self.json {
            print!("{text}");
        } else if !terminal::has_reader() {
            tables();
        }
        if !is_trusted {
            terminal::warn("the result cannot be trusted; its verdict says why");
        }
        if let Some(path) = self.report {
            output::write(path, page().as_bytes())?;
            done!("{}", path.display());
        }
        if let Some(path) = self.result {
            done!("{}", path.display());
        }
        Ok(())
    }
}

/// Prints a table of estimates.
pub(super) fn print_estimates(tables: &[&BTreeMap<String, Estimated>]) {
    println!("{:24} {:>14} {:>12} {:>9}  unit", "", "value", "std", "std %");
    for (name, p) in tables.iter().flat_map(|table| table.iter()) {
        let percent =
            p.percent(p.std).map_or("–".into(), |percent| format!("{:.4}", percent.abs()));
        let std = if p.std.is_nan() { "–".into() } else { format!("{:.2e}", p.std) };
        println!("{name:24} {:>14.7} {std:>12} {percent:>9}  {}", p.value, p.unit);
    }
}

/// Returns a standard deviation that is foreseen, for a table; NaN: the inputs tell nothing of it.
pub(super) fn deviation(std: f64) -> String {
    if std.is_finite() { format!("{std:.2e}") } else { "not told".into() }
}

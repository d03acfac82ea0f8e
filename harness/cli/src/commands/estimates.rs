//! Prints and writes the results of all kinds of `hubslosh identify`.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use files::output;
use identify::estimate::Estimated;
use identify::news::News;

use crate::{progress, terminal};

pub struct Out<'a> {
    pub result: Option<&'a Path>,
    pub report: Option<&'a Path>,
}

impl Out<'_> {
    /// Runs `search` and shows its progress as a spinner. `search` receives a function that it
    /// calls with each message about its progress.
    ///
    /// # Errors
    ///
    /// If the search fails.
    pub fn search<T>(&self, search: impl FnOnce(&mut dyn FnMut(&News)) -> Result<T>) -> Result<T> {
        let spinner = progress::search_spinner()?;
        let found = search(&mut |news| match news {
            News::Detail(line) => spinner.set_message(line.clone()),
            news => progress::show_line(&spinner, news.line()),
        });
        spinner.finish_and_clear();
        found
    }

    /// Writes the JSON text of a result to the result file. If the Python package has started this
    /// program, the result is also sent to the package as a message.
    ///
    /// # Errors
    ///
    /// If the file cannot be written.
    pub fn save(&self, text: &str) -> Result<()> {
        if terminal::has_reader() {
            terminal::message("result", text);
        }
        match self.result {
            Some(path) => output::write(path, text.as_bytes()),
            None => Ok(()),
        }
    }

    /// Saves the JSON text `text` of a result, calls `tables` to print its tables, and writes the
    /// report that `page` returns. If the result cannot be trusted, a warning is printed, which the
    /// option `--strict` makes an error.
    ///
    /// # Errors
    ///
    /// If a file cannot be written.
    pub fn finish(
        &self,
        text: &str,
        is_trusted: bool,
        tables: impl FnOnce(),
        page: impl FnOnce() -> String,
    ) -> Result<()> {
        self.save(text)?;
        if !terminal::has_reader() {
            tables();
        }
        if !is_trusted {
            terminal::warn("the result cannot be trusted; the verdict in the result says why");
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

pub(super) fn print_estimates(tables: &[&BTreeMap<String, Estimated>]) {
    println!("{:24} {:>14} {:>12} {:>9}  unit", "", "value", "std", "std %");
    for (name, p) in tables.iter().flat_map(|table| table.iter()) {
        let percent =
            p.percent(p.std).map_or("–".into(), |percent| format!("{:.4}", percent.abs()));
        let std = if p.std.is_nan() { "–".into() } else { format!("{:.2e}", p.std) };
        println!("{name:24} {:>14.7} {std:>12} {percent:>9}  {}", p.value, p.unit);
    }
}

pub(super) fn deviation(std: f64) -> String {
    if std.is_finite() { format!("{std:.2e}") } else { "unknown".into() }
}

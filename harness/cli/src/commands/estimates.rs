//! Prints and writes the results of all kinds of `hubslosh identify`.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use files::output;
use identify::estimate::Estimated;
use identify::news::News;
use identify::words::identified::{Identified, Report};

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

    /// Adds `notes` at the beginning of the result's steps, saves the result, prints its tables,
    /// and writes its report. If the result cannot be trusted, prints a warning, which `--strict`
    /// makes an error.
    ///
    /// # Errors
    ///
    /// If a file cannot be written.
    pub fn finish<D: Report>(&self, mut found: Identified<D>, notes: Vec<String>) -> Result<()> {
        found.done.splice(0..0, notes);
        self.save(&found.json()?)?;
        if !terminal::has_reader() {
            if !(found.parameters.is_empty() && found.measurement.is_empty()) {
                print_estimates(&[&found.parameters, &found.measurement]);
            }
            for line in found.lines().iter().chain(&found.verdict) {
                println!("{line}");
            }
        }
        if !(found.fits == Some(true) && found.converged) {
            terminal::warn("the result cannot be trusted; the verdict in the result says why");
        }
        if let Some(path) = self.report {
            output::write(path, found.page().as_bytes())?;
            done!("{}", path.display());
        }
        if let Some(path) = self.result {
            done!("{}", path.display());
        }
        Ok(())
    }
}

fn print_estimates(tables: &[&BTreeMap<String, Estimated>]) {
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

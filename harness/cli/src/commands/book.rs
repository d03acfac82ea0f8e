//! `hubslosh book`.

use std::path::PathBuf;

use anyhow::Result;
use pack::archive;
use pack::documentation::book;

use crate::{fmu, terminal};

/// Opens the documentation in the web browser: a static site with search that needs no network.
///
/// The Python package contains the book. From the project's source the command makes it of the Markdown files that
/// book/SUMMARY.md lists.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  hubslosh book\n  hubslosh book --no-open\n  hubslosh book --out site"
)]
pub struct BookArgs {
    /// Writes the book to this directory, and opens no browser [default: the Python package's own book, or dist/book].
    #[arg(long, value_name = "DIRECTORY")]
    out: Option<PathBuf>,
    /// Prints the path of the first page and opens no browser.
    #[arg(long)]
    no_open: bool,
}

impl BookArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        let shipped = fmu::came_with("book");
        let folder = match (shipped, &self.out) {
            (Some(shipped), None) => shipped,
            (Some(shipped), Some(out)) => {
                book::write(&archive::below(&shipped)?, out)?;
                out.clone()
            }
            (None, out) => {
                pack::needs_source("the book")?;
                let out = out.clone().unwrap_or_else(|| "dist/book".into());
                book::write(&book::render(&pack::root())?, &out)?;
                out
            }
        };
        let page = folder.join("index.html");
        println!("{}", page.display());
        if self.out.is_none() && !self.no_open && open::that_detached(&page).is_err() {
            terminal::note("no web browser was found: open the page above");
        }
        Ok(())
    }
}

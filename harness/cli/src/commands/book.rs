//! `hubslosh book`.

use std::path::PathBuf;

use anyhow::Result;
use pack::documentation::book;

/// Writes the documentation as a book: a static site with search, to be opened from the disk.
///
/// Its pages are Markdown files of this project; book/SUMMARY.md lists them.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  hubslosh book && xdg-open dist/book/index.html")]
pub struct BookArgs {
    /// Directory for the site.
    #[arg(long, value_name = "DIRECTORY", default_value = "dist/book")]
    out: PathBuf,
}

impl BookArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        pack::needs_source("the book")?;
        let files = book::write(&pack::root(), &self.out)?;
        done!("{} ({files} files)", self.out.join("index.html").display());
        Ok(())
    }
}

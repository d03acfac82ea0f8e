//! `hubslosh book`.

use std::path::PathBuf;

use anyhow::Result;
use pack::documentation::book;
use pack::documentation::live;

/// Writes the documentation as a book: a static site with search, to be opened from the disk.
///
/// Pages are Markdown files of this project; book/SUMMARY.md lists them.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  hubslosh book && xdg-open dist/book/index.html\n  hubslosh book --live"
)]
pub struct BookArgs {
    /// Directory for the site.
    #[arg(long, value_name = "DIRECTORY", default_value = "dist/book")]
    out: PathBuf,
    /// Adds running plants to the live pages: FMUs and tank solver as WebAssembly. harness/platforms/setup --wasm installs the
    /// tools.
    #[arg(long)]
    live: bool,
}

impl BookArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        pack::needs_source("the book")?;
        let modules = if self.live { live::build()? } else { Vec::new() };
        let files = book::write(&pack::root(), &self.out, &modules)?;
        done!("{} ({files} files)", self.out.join("index.html").display());
        Ok(())
    }
}

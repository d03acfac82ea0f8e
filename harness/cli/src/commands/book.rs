use std::path::PathBuf;

use anyhow::{Result, ensure};
use pack::book;

use crate::{fmu, terminal};

/// Builds the documentation and opens it in the web browser.
///
/// The documentation is a static site, whose search works without a network. Sphinx builds it from the project's source;
/// the first time, the packages of Sphinx are downloaded (70 MB). The Python package does not contain the documentation:
/// its command `hubslosh book` prints the address at which the pages can be read.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  hubslosh book\n  hubslosh book --no-open\n  hubslosh book --out site"
)]
pub struct BookArgs {
    /// Directory for the documentation. If it is given, no browser is opened [default: dist/book].
    #[arg(long, value_name = "DIRECTORY")]
    out: Option<PathBuf>,
    /// Builds the documentation and prints the path of its first page, without opening a browser.
    #[arg(long)]
    no_open: bool,
}

impl BookArgs {
    pub fn run(self) -> Result<()> {
        if fmu::shipped_folder("fmus").is_some() || !pack::has_source() {
            let address = book::address();
            ensure!(
                self.out.is_none(),
                "--out: the book is built from the project's source, which this command does not have; read it at {address}"
            );
            println!("{address}");
            terminal::note(
                "the Python package does not contain the book: read it at the address above, or build it in the project's folder \
                 with cargo run --release -- book",
            );
            return Ok(());
        }
        let folder = self.out.clone().unwrap_or_else(|| "dist/book".into());
        book::write(&folder)?;
        let page = folder.join("index.html");
        println!("{}", page.display());
        if self.out.is_none() && !self.no_open && open::that_detached(&page).is_err() {
            terminal::note("no web browser was found: open the page above");
        }
        Ok(())
    }
}

//! Builds the book as a static site. Sphinx renders the project's Markdown files and the docstrings of the
//! Python package, as configured in `book/conf.py`.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use files::output;

use crate::archive::below;
use crate::metadata::{REPOSITORY, VERSION};
use crate::{build_native, needs_source, root};

pub fn address() -> String {
    format!("{REPOSITORY}/blob/v{VERSION}/book/index.md")
}

/// Builds the book and writes its files to the folder `out`. The first call installs Sphinx into a
/// separate environment.
///
/// # Errors
///
/// If the source, Python or a package is missing, and at every warning of Sphinx: links and figures
/// that do not exist, pages that no list contains, equations that are not LaTeX, docstrings that
/// are not reStructuredText.
pub fn write(out: &Path) -> Result<()> {
    needs_source("the book")?;
    let root = root();
    let native = build_native(false)?; // Sphinx imports the package
    let target = native.ancestors().nth(2).context("no target directory")?;
    let python = environment(target)?;

    // The folder is removed first, because it may contain pages about names that the package no longer has.
    match fs::remove_dir_all(root.join("book/api")) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error).context("book/api")?,
        _ => {}
    }
    let built = tempfile::tempdir().context("no temporary folder can be made")?;
    let site = built.path().join("site");
    let done = Command::new(python)
        .current_dir(&root)
        .args(["-m", "sphinx", "--quiet", "--fail-on-warning", "--keep-going", "-c", "book"])
        .args([Path::new("-d"), &built.path().join("doctrees"), Path::new("."), &site])
        .env("CARGO_TARGET_DIR", target)
        .stdout(Stdio::null())
        .status()
        .context("Sphinx cannot be run")?;
    ensure!(done.success(), "the book was not built, because Sphinx printed errors or warnings");

    for (name, bytes) in below(&site)? {
        let file = out.join(name);
        output::directory(file.parent().unwrap_or(out))?;
        output::write(&file, bytes)?;
    }
    Ok(())
}

fn environment(target: &Path) -> Result<PathBuf> {
    let python = if cfg!(windows) { "python" } else { "python3" };
    let made = Command::new(python)
        .current_dir(root())
        .arg("harness/python/environment.py")
        .args([&target.join("python/book"), Path::new("book/requirements.txt")])
        .stderr(Stdio::inherit())
        .output()
        .context("Python cannot be started; the book needs Python 3.11 or newer")?;
    ensure!(made.status.success(), "the environment with Sphinx could not be made");
    Ok(PathBuf::from(String::from_utf8(made.stdout)?.trim()))
}

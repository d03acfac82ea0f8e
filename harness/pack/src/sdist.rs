//! Packs the project's source as a Python sdist (packaging.python.org, "Source distribution format"). If Rust and a C
//! compiler are installed, pip builds the wheel from it. Equal files give byte-identical archives.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use files::output;
use flate2::Compression;
use flate2::write::GzEncoder;
use tar::{Builder, Header};

use crate::archive::{Files, read};
use crate::metadata::{self, PACKAGE, VERSION};
use crate::root;

/// Line of pyproject.toml with the path of the build backend. The first text is the line in the
/// project, where the path is relative to `harness/python`. The second text replaces it in the
/// source distribution (sdist), where pyproject.toml is at the root.
const BACKEND: [&str; 2] = ["backend-path = [\".\"]", "backend-path = [\"harness/python\"]"];

/// Writes the source distribution of the Python package (sdist) to `folder` and returns its path.
///
/// # Errors
///
/// If git does not list the project's files, or a file cannot be read or written.
pub fn write(folder: &Path) -> Result<PathBuf> {
    let name = format!("{PACKAGE}-{VERSION}");
    let out = folder.join(format!("{name}.tar.gz"));
    let files = files()?;
    output::directory(folder)?;
    output::atomically(&out, |file| {
        // The header of gzip contains neither a name nor a time, so that equal files give equal bytes.
        let mut archive = Builder::new(GzEncoder::new(file, Compression::best()));
        for (path, bytes) in &files {
            let mut header = Header::new_ustar();
            header.set_size(bytes.len() as u64);
            header.set_mode(if bytes.starts_with(b"#!") { 0o755 } else { 0o644 });
            header.set_mtime(0);
            archive.append_data(&mut header, format!("{name}/{path}"), &bytes[..])?;
        }
        archive.into_inner()?.finish()?;
        Ok(())
    })?;
    Ok(out)
}

/// Reads the project's files under version control, except releases and files that only a checkout
/// needs. pyproject.toml and the metadata are placed at the root of the source distribution, as pip
/// expects.
fn files() -> Result<Files> {
    let said = Command::new("git")
        .current_dir(root())
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .output()
        .context("git cannot be run; it is needed to list the files of the source")?;
    let why = String::from_utf8_lossy(&said.stderr);
    ensure!(said.status.success(), "git does not list the files of the source: {}", why.trim());
    let mut files = Files::new();
    for name in String::from_utf8(said.stdout)?.split('\0').filter(|name| !name.is_empty()) {
        // A file that is deleted in the working tree may still be in git's index.
        let path = root().join(name);
        if !name.starts_with("dist/") && !name.starts_with(".git") && path.is_file() {
            files.push((name.into(), read(&path)?));
        }
    }
    let project = String::from_utf8(read(&root().join("harness/python/pyproject.toml"))?)?;
    ensure!(
        project.contains(BACKEND[0]),
        "pyproject.toml does not contain the line {}",
        BACKEND[0]
    );
    files.push(("pyproject.toml".into(), project.replace(BACKEND[0], BACKEND[1]).into_bytes()));
    files.push(("PKG-INFO".into(), metadata::text()?.into_bytes()));
    files.sort();
    Ok(files)
}

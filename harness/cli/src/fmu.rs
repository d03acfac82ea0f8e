//! Finds the FMU of `--fmu`: a file, or one of the project's FMUs by name.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use pack::Fmi;

/// Folders, relative to the folder of this command, in which FMUs of this project may be installed:
/// the folder of the command itself, its data folders, and the Python package with which the
/// command was installed.
const INSTALLED: [&str; 5] =
    [".", "fmus", "../share/hubslosh", "../hubslosh/fmus", "../Lib/site-packages/hubslosh/fmus"];

/// Returns the file of an FMU. `name` is a file, or the name of an FMU of this project. An FMU of
/// this project is searched first in the folder `dist`, to which `hubslosh pack` writes, then among
/// the files installed with this command, then in `dist` of the source from which the command was
/// built. If that source exists, a missing FMU is packed there.
///
/// # Errors
///
/// If the FMU is not found; the message says what to do.
pub fn find(name: &Path) -> Result<PathBuf> {
    let Some((model, fmi)) = name.to_str().and_then(pack::named) else {
        let all: Vec<_> = pack::MODELS.iter().map(|model| model.name).collect();
        ensure!(
            name.is_file(),
            "there is no FMU at {} (allowed: a file, or {}, for FMI 3.0 with -fmi3 or -fmi3-arrays)",
            name.display(),
            all.join(", ")
        );
        return Ok(name.into());
    };
    let packed = fmi.path("dist".as_ref(), model.name);
    let file = packed.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if packed.is_file() {
        return Ok(packed);
    }
    if let Some(installed) = find_installed(&file) {
        return Ok(installed);
    }
    if !pack::has_source() {
        let places: Vec<_> = folders().iter().map(|place| place.display().to_string()).collect();
        let there: Vec<_> =
            all().iter().filter_map(|fmu| Some(fmu.file_stem()?.display().to_string())).collect();
        bail!(
            "{file} was not found in dist or in this command's folder ({}; FMUs: {}). In the project's source, with Rust, \
             `cargo run --release -- pack` builds it; --fmu FILE names a file elsewhere",
            places.join(", "),
            if there.is_empty() { "none".into() } else { there.join(", ") }
        );
    }
    let packed = pack::root().join(packed);
    if !packed.is_file() {
        super::terminal::note(format_args!("building {}", packed.display()));
        pack::pack(&model, fmi, &packed)
            .with_context(|| format!("there is no {file} yet, and it cannot be built"))?;
    }
    Ok(packed)
}

/// Lists the FMUs that [`find`] finds without packing any: first the files in `dist`, then the
/// files installed with this command.
pub fn all() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = Vec::new();
    for folder in ["dist".into()].into_iter().chain(folders()) {
        for model in pack::MODELS {
            let paths = Fmi::ALL.map(|fmi| fmi.path(&folder, model.name));
            found.extend(paths.into_iter().filter(|path| path.is_file()));
        }
    }
    let mut seen = BTreeSet::new();
    found.retain(|path| seen.insert(path.file_name().map(OsString::from)));
    found
}

pub fn find_installed(file: &str) -> Option<PathBuf> {
    folders().into_iter().map(|folder| folder.join(file)).find(|path| path.is_file())
}

/// Returns the folder with the name `folder`, for example `examples`, of the Python package with
/// which this command was installed, or `None` if it was installed without the package.
pub fn shipped_folder(folder: &str) -> Option<PathBuf> {
    let packages = folders().into_iter().filter(|fmus| fmus.ends_with("hubslosh/fmus"));
    packages.map(|fmus| fmus.with_file_name(folder)).find(|path| path.is_dir())
}

fn folders() -> Vec<PathBuf> {
    let command = std::env::current_exe().and_then(|path| path.canonicalize());
    let Some(own) = command.ok().and_then(|path| path.parent().map(Path::to_path_buf)) else {
        return Vec::new();
    };
    // On Linux and macOS the folder is lib/python3.12/site-packages.
    let versions = std::fs::read_dir(own.join("../lib")).into_iter().flatten().flatten();
    let mut pythons: Vec<_> = versions
        .map(|entry| entry.path())
        .filter(|path| path.to_string_lossy().contains("python3"))
        .map(|python| python.join("site-packages/hubslosh/fmus"))
        .collect();
    pythons.sort();
    let all = INSTALLED.iter().map(|place| own.join(place)).chain(pythons);
    // Existing folders are written without `..`, as a user would write them.
    all.filter(|place| place.is_dir()).map(|place| place.canonicalize().unwrap_or(place)).collect()
}

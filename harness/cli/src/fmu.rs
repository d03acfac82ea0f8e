//! Resolves `--fmu`: a file, or one of the project's FMUs by name.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use pack::{Fmi, Model};

/// Folders of the project's FMUs relative to the command's own: next to it, in its data folder,
/// in the Python package that it came with.
const INSTALLED: [&str; 5] =
    [".", "fmus", "../share/hubslosh", "../hubslosh/fmus", "../Lib/site-packages/hubslosh/fmus"];

/// The file of an FMU: `name` is a file, or the name of one of this project's FMUs. The search order is `dist`, where `hubslosh
/// pack` puts it, the folder of this command, then `dist` of the source that the command was built from. There the command packs
/// the FMU if necessary.
///
/// # Errors
/// If there is none; the error says what to do.
pub fn find(name: &Path) -> Result<PathBuf> {
    let all = Fmi::ALL.iter().flat_map(|fmi| pack::MODELS.iter().map(move |model| (*fmi, model)));
    let known = all.clone().find(|(fmi, model)| name == Path::new(&named(*fmi, model)));
    let Some((fmi, model)) = known else {
        let all: Vec<_> = all.map(|(fmi, model)| named(fmi, model)).collect();
        ensure!(
            name.is_file(),
            "there is no FMU at {} (allowed: a file, or one of this project by its name: {})",
            name.display(),
            all.join(", ")
        );
        return Ok(name.into());
    };
    let file = format!("{}.fmu", named(fmi, model));
    let packed = Path::new("dist").join(&file);
    if packed.is_file() {
        return Ok(packed);
    }
    if let Some(installed) = installed(&file) {
        return Ok(installed);
    }
    if !pack::has_source() {
        let places: Vec<_> = folders().iter().map(|place| place.display().to_string()).collect();
        bail!(
            "{file} was not found in dist or in this command's folder ({}), and there is no source to build it from. Put it \
             there or name it with --fmu FILE; releases and the Python package contain it",
            places.join(", ")
        );
    }
    let packed = pack::root().join("dist").join(&file);
    if !packed.is_file() {
        super::terminal::note(format_args!("building {}", packed.display()));
        pack::pack(model, fmi, &packed)
            .with_context(|| format!("there is no {file} yet, and it cannot be built"))?;
    }
    Ok(packed)
}

/// Name of one of the project's FMUs for `--fmu`: `HubSlosh`, and of FMI 3.0 `HubSlosh-fmi3` and
/// `HubSlosh-fmi3-arrays`.
fn named(fmi: Fmi, model: &Model) -> String {
    format!("{}{}", model.name, fmi.suffix())
}

/// The FMU that came with this command.
pub fn installed(file: &str) -> Option<PathBuf> {
    folders().into_iter().map(|folder| folder.join(file)).find(|path| path.is_file())
}

/// A folder of the Python package that came with this command.
pub fn came_with(folder: &str) -> Option<PathBuf> {
    let packages = folders().into_iter().filter_map(|fmus| fmus.parent().map(Path::to_path_buf));
    packages.map(|package| package.join(folder)).find(|path| path.is_dir())
}

/// The folders that [`INSTALLED`] means.
fn folders() -> Vec<PathBuf> {
    let command = std::env::current_exe().and_then(|path| path.canonicalize());
    let Some(own) = command.ok().and_then(|path| path.parent().map(Path::to_path_buf)) else {
        return Vec::new();
    };
    // lib/python3.12/site-packages on Linux and macOS
    let versions = std::fs::read_dir(own.join("../lib")).into_iter().flatten().flatten();
    let mut pythons: Vec<_> = versions
        .map(|entry| entry.path())
        .filter(|path| path.to_string_lossy().contains("python3"))
        .map(|python| python.join("site-packages/hubslosh/fmus"))
        .collect();
    pythons.sort();
    let all = INSTALLED.iter().map(|place| own.join(place)).chain(pythons);
    // as the reader would write it, where it is there
    all.filter(|place| place.is_dir()).map(|place| place.canonicalize().unwrap_or(place)).collect()
}

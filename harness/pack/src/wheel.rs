//! The Python package `hubslosh` as a wheel, with the FMUs inside (packaging.python.org, "Binary
//! distribution format"): same files, same bytes.
//!
//! The wheel's tag is `py3-none-any`, because its Python runs anywhere and an FMU's binaries are data
//! to it. Which platforms the FMUs have binaries for stands in its metadata, and the package says
//! so where there is none for its own.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use base64ct::{Base64UrlUnpadded, Encoding};
use host::fmi2::PLATFORM;
use sha2::{Digest, Sha256};
use toml::{Table, Value};

use crate::archive::{self, Files, below, read};
use crate::{MODELS, build, pack, pack_all, root};

/// Name of the package.
const PACKAGE: &str = "hubslosh";
/// Its version.
const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Any Python 3, no binary interface of Python's, any platform.
const TAG: &str = "py3-none-any";
/// Cargo package of the library that makes a whole run in one call.
const BATCH: &str = "hubslosh-batch";
const LICENSES: [&str; 2] = ["LICENSE-APACHE", "LICENSE-MIT"];

/// The file's name, from which pip reads package, version and tag.
pub fn name() -> String {
    format!("{PACKAGE}-{VERSION}-{TAG}.whl")
}

/// Builds and packs every FMU of this project, then the wheel to `out`. Returns the platforms its FMUs
/// have binaries for. The library for whole runs in one call is there for this machine's platform
/// alone; on others the package makes the calls one by one.
///
/// # Errors
/// If the file's name is not [`name`], or if something cannot be built, read or written.
pub fn write(out: &Path, all_platforms: bool) -> Result<Vec<&'static str>> {
    ensure!(
        out.file_name().is_some_and(|file| file == name().as_str()),
        "the wheel's file must be called {}, not {}: pip reads package and version from its name",
        name(),
        out.display()
    );
    let made = tempfile::tempdir().context("there is no place for temporary files")?;
    let mut platforms = vec![PLATFORM];
    let mut fmus = Vec::new();
    for model in &MODELS {
        let fmu = made.path().join(format!("{}.fmu", model.name));
        if all_platforms {
            platforms = pack_all(model, &fmu)?.iter().map(|built| built.folder).collect();
        } else {
            pack(model, &fmu)?;
        }
        fmus.push(fmu);
    }
    let library = build(BATCH, true)?;
    archive::write(&files(&fmus, &library, &platforms)?, out)?;
    Ok(platforms)
}

/// A wheel for tests, with these FMUs: to the folder of the first of them. Returns where it is.
///
/// # Panics
/// If it cannot be made.
pub fn for_tests(fmus: &[&Path]) -> PathBuf {
    let make = || {
        let out = fmus[0].with_file_name(name());
        let fmus: Vec<_> = fmus.iter().map(|fmu| fmu.to_path_buf()).collect();
        archive::write(&files(&fmus, &build(BATCH, true)?, &[PLATFORM])?, &out)?;
        anyhow::Ok(out)
    };
    make().unwrap_or_else(|error| panic!("the wheel for the tests could not be packed: {error:#}"))
}

/// What is in the wheel; its metadata last, as the standard recommends, RECORD at the very end.
fn files(fmus: &[PathBuf], library: &Path, platforms: &[&str]) -> Result<Files> {
    let source = root().join("harness").join("python");
    let package = below(&source.join(PACKAGE))?.into_iter();
    let mut files: Files = package
        .filter(|(name, _)| !name.contains("__pycache__"))
        .map(|(name, bytes)| (format!("{PACKAGE}/{name}"), bytes))
        .collect();
    for fmu in fmus {
        files.push((format!("{PACKAGE}/fmus/{}", file_name(fmu)), read(fmu)?));
    }
    files.push((format!("{PACKAGE}/lib/{PLATFORM}/{}", file_name(library)), read(library)?));
    files.sort();

    let info = format!("{PACKAGE}-{VERSION}.dist-info");
    let project = String::from_utf8(read(&source.join("pyproject.toml"))?)?;
    let models: Vec<_> = fmus.iter().map(|fmu| file_name(fmu)).collect();
    let metadata = metadata(&project.parse()?, &models, platforms).context("pyproject.toml")?;
    for license in LICENSES {
        files.push((format!("{info}/licenses/{license}"), read(&root().join(license))?));
    }
    files.push((format!("{info}/METADATA"), metadata.into_bytes()));
    let wheel = format!(
        "Wheel-Version: 1.0\nGenerator: {PACKAGE} {VERSION}\nRoot-Is-Purelib: true\nTag: {TAG}\n"
    );
    files.push((format!("{info}/WHEEL"), wheel.into_bytes()));
    let record = format!("{info}/RECORD");
    let list = files.iter().map(|(name, bytes)| record_line(name, bytes)).collect::<String>();
    files.push((record.clone(), format!("{list}{record},,\n").into_bytes()));
    Ok(files)
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// `name,sha256=…,size`: the hash in base64 of its own alphabet, without padding.
fn record_line(name: &str, bytes: &[u8]) -> String {
    let hash = Base64UrlUnpadded::encode_string(&Sha256::digest(bytes));
    format!("{name},sha256={hash},{}\n", bytes.len())
}

/// The core metadata, version 2.4, from `[project]` of pyproject.toml.
fn metadata(pyproject: &Table, fmus: &[String], platforms: &[&str]) -> Result<String> {
    let project =
        pyproject.get("project").and_then(Value::as_table).context("it has no [project]")?;
    let text = |key: &str| {
        project.get(key).and_then(Value::as_str).with_context(|| format!("it has no {key}"))
    };
    let mut lines = vec![
        "Metadata-Version: 2.4".to_string(),
        format!("Name: {}", text("name")?),
        format!("Version: {VERSION}"),
        format!("Summary: {}", text("description")?),
        format!("Requires-Python: {}", text("requires-python")?),
        "License-Expression: MIT OR Apache-2.0".to_string(),
    ];
    lines.extend(LICENSES.map(|license| format!("License-File: {license}")));
    lines.extend(platforms.iter().map(|platform| format!("Platform: {platform}")));
    let list = |value: &Value| -> Vec<String> {
        let values = value.as_array().into_iter().flatten();
        values.filter_map(Value::as_str).map(String::from).collect()
    };
    for needed in project.get("dependencies").map(list).unwrap_or_default() {
        lines.push(format!("Requires-Dist: {needed}"));
    }
    let extras = project.get("optional-dependencies").and_then(Value::as_table);
    for (extra, packages) in extras.into_iter().flatten() {
        lines.push(format!("Provides-Extra: {extra}"));
        let packages = list(packages).into_iter();
        lines.extend(
            packages.map(|package| format!("Requires-Dist: {package}; extra == '{extra}'")),
        );
    }
    lines.push("Description-Content-Type: text/markdown".to_string());
    Ok(format!(
        "{}\n\n{}.\n\nFMUs in this wheel: {}, with binaries for {}.\n",
        lines.join("\n"),
        text("description")?,
        fmus.join(", "),
        platforms.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_record_has_the_hash_in_base64_for_addresses() {
        // the empty text's SHA-256; base64 has both `-` and `_` where plain base64 has `+` and `/`
        assert_eq!(
            record_line("a/b.py", b""),
            "a/b.py,sha256=47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU,0\n"
        );
    }

    #[test]
    fn metadata_has_what_pip_reads_and_names_the_platforms() {
        let pyproject = r#"
            [project]
            name = "hubslosh"
            description = "Slosh"
            requires-python = ">=3.11"
            dependencies = ["numpy>=2", "scipy"]
            [project.optional-dependencies]
            plot = ["matplotlib"]
        "#;
        let said = metadata(&pyproject.parse().unwrap(), &["M.fmu".into()], &["linux64"]).unwrap();
        for line in [
            "FMUs in this wheel: M.fmu, with binaries for linux64.",
            "Name: hubslosh",
            "Platform: linux64",
            "Requires-Dist: scipy",
            "Provides-Extra: plot",
            "Requires-Dist: matplotlib; extra == 'plot'",
        ] {
            assert!(said.lines().any(|there| there == line), "{line} in\n{said}");
        }
        let error = metadata(&"[project]\nname = \"x\"".parse().unwrap(), &[], &[]).unwrap_err();
        assert_eq!(error.to_string(), "it has no description");
    }

    #[test]
    fn another_name_of_the_file_is_refused_before_anything_is_built() {
        let error = write(Path::new("dist/mine.whl"), false).unwrap_err().to_string();
        assert!(error.contains(&name()) && error.contains("mine.whl"), "{error}");
    }
}

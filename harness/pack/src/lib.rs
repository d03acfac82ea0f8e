//! Builds the binaries of an FMU and packs them, with documentation and licences, into a `.fmu` (FMI 2.0, section 2.3; FMI 3.0,
//! section 2.5).

pub mod archive;
pub mod book;
pub mod components;
pub mod documentation;
pub mod fmi;
pub mod metadata;
pub mod models;
pub mod part;
pub mod platforms;
mod project;
pub mod release;
pub mod sdist;
pub mod wheel;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, Result};
use host::description::ModelDescription;

use crate::archive::{Files, Packed, below, read};
pub use crate::fmi::Fmi;
pub use crate::models::{HUBSLOSH, MODELS, Model, REFERENCES, model, named};
pub use crate::platforms::{Built, Platform};
pub use crate::project::{build, build_native, has_source, needs_source, root};

/// Builds the binary of an FMU for the platform on which this program runs, and packs the FMU in
/// the form `fmi` to `out`.
pub fn pack(model: &Model, fmi: Fmi, out: &Path) -> Result<()> {
    let binary = Packed::native(&build(model.package, false)?)?;
    archive::write(&files(model, fmi, &[binary])?, out)
}

/// Builds the binaries of an FMU for `platforms`, and packs the FMU with them in the form `fmi` to
/// `out`. Returns the binaries.
pub fn pack_for(
    platforms: &[&Platform],
    model: &Model,
    fmi: Fmi,
    out: &Path,
) -> Result<Vec<Built>> {
    let all = platforms::build(platforms, model)?;
    pack_built(model, fmi, &all, out)?;
    Ok(all)
}

fn pack_built(model: &Model, fmi: Fmi, all: &[Built], out: &Path) -> Result<()> {
    let binaries: Vec<_> = all
        .iter()
        .map(|b| Packed { folder: b.folder, ending: b.ending, bytes: b.bytes.clone() })
        .collect();
    archive::write(&files(model, fmi, &binaries)?, out)
}

pub fn packed_for_tests() -> &'static Path {
    packed_model_for_tests(HUBSLOSH)
}

/// Returns the path of a packed FMU 2.0 for tests. It is built and packed once in each process, to
/// `test-fmu/<name>.fmu` in the target directory. Several processes may do this at the same time,
/// because each renames a complete file, and all files are equal.
///
/// # Panics
///
/// If it cannot be built.
pub fn packed_model_for_tests(model: &Model) -> &'static Path {
    packed_version_for_tests(model, Fmi::V2)
}

/// Returns the path of a packed FMU in the form `fmi` for tests, as [`packed_model_for_tests`] does
/// for FMI 2.0. Its name is `test-fmu/<name>-fmi3.fmu` for FMI 3.0, and
/// `test-fmu/<name>-fmi3-arrays.fmu` with array variables.
///
/// # Panics
///
/// If it cannot be built.
pub fn packed_version_for_tests(model: &Model, fmi: Fmi) -> &'static Path {
    static PACKED: Mutex<BTreeMap<(&str, &str), &Path>> = Mutex::new(BTreeMap::new());
    let mut packed = PACKED.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    packed.entry((model.name, fmi.suffix())).or_insert_with(|| match pack_for_tests(model, fmi) {
        Ok(path) => Box::leak(path.into_boxed_path()),
        Err(error) => panic!("the FMU for the tests could not be packed: {error:#}"),
    })
}

fn pack_for_tests(model: &Model, fmi: Fmi) -> Result<PathBuf> {
    let binary = build(model.package, true)?;
    // <target>/<profile>/<binary>
    let target = binary.ancestors().nth(2).context("no target directory")?;
    let out = fmi.path(&target.join("test-fmu"), model.name);
    archive::write(&files(model, fmi, &[Packed::native(&binary)?])?, &out)?;
    Ok(out)
}

/// Returns the list of related files that the layered standard FMI-LS-REF (1.0.0-beta.1) places in
/// an FMU: the inputs of the example and its result.
fn references(model: &Model) -> String {
    let name = model.name;
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiReferences xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest" fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-ref" fmi-ls:fmi-ls-version="1.0.0-beta.1" fmi-ls:fmi-ls-description="Layered Standard providing information on related files included in an FMU.">
  <Related type="text/csv" source="{name}_in.csv" role="experiment" description="Inputs of the example, with every parameter and start value as they are" />
  <Related type="text/csv" source="{name}_ref.csv" role="result" description="All outputs of the example" />
  <Related type="text/markdown" source="README.md" role="report" description="What the example shows, and how to compare with it" />
</fmiReferences>
"#
    )
}

fn files(model: &Model, fmi: Fmi, binaries: &[Packed]) -> Result<Files> {
    let source = model.folder();
    let xml = model.description(fmi)?;
    // The parts of the description that are used here are equal in all versions.
    let first = model.description(Fmi::V2)?;
    let description = ModelDescription::from_xml(&String::from_utf8_lossy(&first))?;
    let icon = read(&root().join("modelDescription/icon/icon.png"))?;
    let mut files = vec![("modelDescription.xml".into(), xml), (fmi.icon().into(), icon)];
    for binary in binaries {
        let placed = binary.files(model.name, fmi);
        files.extend(placed.map(|(name, bytes)| (name, bytes.to_vec())));
    }

    let title = format!("{} {}", description.model_name, description.version);
    let introduction = format!("modelDescription/{}/documentation/index.md", model.name);
    let pages = documentation::fmu::render(&root(), &introduction, &title)?;
    files.push(("documentation/index.html".into(), pages.page.into_bytes()));
    for (name, figure) in pages.figures {
        files.push((format!("documentation/{name}"), figure));
    }

    let components = components::linked(model.package, binaries)?;
    let note = components::licence_note(&description, &components);
    files.push(("documentation/licenses/license.txt".into(), note.into_bytes()));
    let texts: BTreeSet<_> = components.iter().flat_map(|component| &component.texts).collect();
    for text in texts {
        let own = components::OWN_TEXTS.contains(&text.as_str());
        let folder = if own { root() } else { root().join("modelDescription/licenses") };
        files.push((format!("documentation/licenses/{text}"), read(&folder.join(text))?));
    }

    // terminalsAndIcons.xml is not written, because this model has no terminals, and because FMI Library logs a fatal
    // error for an FMU 2.0 that contains the file.
    let extra = source.join("extra");
    if extra.is_dir() {
        let extra = below(&extra)?.into_iter();
        files.extend(extra.map(|(name, bytes)| (format!("extra/{name}"), bytes)));
        files.push((format!("{REFERENCES}/fmi-ls-manifest.xml"), references(model).into_bytes()));
    }
    let sbom = components::sbom(model, fmi, &description, binaries, &components);
    files.push((model.sbom(), sbom.into_bytes()));
    Ok(files)
}

//! Third-party components of the FMU's binaries, which are found in Cargo.lock and in the binaries themselves. Writes
//! the note on licences and the SBOM (CycloneDX 1.6).
//!
//! Licence texts are committed in modelDescription/licenses; [`licence_note`] names their sources.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, bail};
use cargo_metadata::{DependencyKind, MetadataCommand};

use crate::archive::Packed;
use crate::fmi::Fmi;
use crate::models::Model;
use crate::project;
use files::output::sha256;
use host::description::ModelDescription;
use serde_json::json;

const OWN: &str = "MIT OR Apache-2.0";
pub const OWN_TEXTS: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Component {
    pub name: String,
    /// Version of the component. `None` for run-time libraries of the tools that link the binaries
    /// (zig and MinGW), such as libgcc, because the version of these tools is not recorded.
    pub version: Option<String>,
    pub licence: String,
    pub texts: Vec<String>,
    pub purl: String,
    pub sha256: Option<String>,
    pub origin: String,
    pub platforms: BTreeSet<&'static str>,
}

/// Crates of Rust's standard library with their licences. A binary contains the path and version of
/// each of these crates whose code is linked and can panic, so that they can be recognised in it.
const STANDARD: [(&str, &str); 10] = [
    ("addr2line", "Apache-2.0 OR MIT"),
    ("adler2", "0BSD OR MIT OR Apache-2.0"),
    ("cfg-if", "MIT OR Apache-2.0"),
    ("gimli", "MIT OR Apache-2.0"),
    ("hashbrown", "MIT OR Apache-2.0"),
    ("libc", "MIT OR Apache-2.0"),
    ("memchr", "Unlicense OR MIT"),
    ("miniz_oxide", "MIT OR Zlib OR Apache-2.0"),
    ("object", "Apache-2.0 OR MIT"),
    ("rustc-demangle", "MIT OR Apache-2.0"),
];
const STANDARD_TEXT: &str = "rust-standard-library.txt";

struct RunTime {
    mark: &'static [u8],
    name: &'static str,
    licence: &'static str,
    text: &'static str,
    origin: &'static str,
}

/// Reverses a text at compile time. The texts are marks by which components are found in the files
/// of a wheel. This program is itself in the wheel and must therefore not contain the marks, but
/// only the reversed texts.
const fn backwards<const N: usize>(text: [u8; N]) -> [u8; N] {
    let (mut reversed, mut place) = ([0; N], 0);
    while place < N {
        reversed[place] = text[N - 1 - place];
        place += 1;
    }
    reversed
}

const RUN_TIME: [RunTime; 4] = [
    RunTime {
        mark: &backwards(*b"libunwind: "),
        name: "llvm-libunwind",
        licence: "Apache-2.0 WITH LLVM-exception",
        text: "llvm-libunwind.txt",
        origin: "Unwinding of panics, from zig's distribution; the text is its lib/libunwind/LICENSE.TXT",
    },
    RunTime {
        // The mark of libunwind also stands for this library, because zig links both when it builds for an old glibc.
        mark: &backwards(*b"libunwind: "),
        name: "glibc-nonshared",
        licence: "LicenseRef-LGPL-2.1-or-later-with-unlimited-permission-to-link",
        text: "glibc.txt",
        origin: "stat64 and fstat64 for systems before glibc 2.33, from zig's distribution; the text is the \
                 head of its lib/libc/glibc/io/stat64-2.32.c",
    },
    RunTime {
        mark: &backwards(*b"Mingw-w64 runtime failure"),
        name: "mingw-w64-runtime",
        licence: "ZPL-2.1 AND LicenseRef-public-domain",
        text: "mingw-w64.txt",
        origin: "Start-up of the DLL, thread-local storage (public domain) and onexit tables; the text is \
                 MinGW-w64's COPYING",
    },
    RunTime {
        mark: &backwards(*b"Mingw-w64 runtime failure"),
        name: "libgcc",
        licence: "GPL-3.0-or-later WITH GCC-exception-3.1",
        text: "gcc-runtime.txt",
        origin: "Unwinding of panics (libgcc_eh) and crtbegin, from MinGW's GCC; the texts are the FSF's",
    },
];

/// Lists the third-party components that are linked into the `binaries` of the crate `package`, for
/// its SBOM.
///
/// # Errors
/// If the licence of a component is not known to this program.
pub fn linked(package: &str, binaries: &[Packed]) -> Result<Vec<Component>> {
    let everywhere: BTreeSet<&str> = binaries.iter().map(|binary| binary.folder).collect();
    let mut all = crates(package, &everywhere)?;
    all.push(Component {
        name: "std".into(),
        version: Some(rust_version()?),
        licence: "MIT OR Apache-2.0".into(),
        texts: vec![STANDARD_TEXT.into()],
        origin:
            "Rust's standard library: core, alloc, std, panic_unwind, compiler_builtins, and the parts of other crates that it uses; \
                 those of these crates that can be recognised in the binaries follow"
                .into(),
        platforms: everywhere,
        ..Component::default()
    });
    let mut crates_of_std: BTreeMap<(String, String), BTreeSet<&str>> = BTreeMap::new();
    for binary in binaries {
        for found in standard_crates(&binary.bytes)? {
            crates_of_std.entry(found).or_default().insert(binary.folder);
        }
    }
    for ((name, version), platforms) in crates_of_std {
        let licence = STANDARD.iter().find(|(known, _)| *known == name).map_or("", |(_, l)| l);
        all.push(Component {
            purl: format!("pkg:cargo/{name}@{version}"),
            name,
            version: Some(version),
            licence: licence.into(),
            texts: vec![STANDARD_TEXT.into()],
            origin: "Part of Rust's standard library".into(),
            platforms,
            ..Component::default()
        });
    }
    for part in RUN_TIME {
        let platforms: BTreeSet<_> = binaries
            .iter()
            .filter(|binary| contains_backwards(&binary.bytes, part.mark))
            .map(|binary| binary.folder)
            .collect();
        if !platforms.is_empty() {
            all.push(Component {
                name: part.name.into(),
                licence: part.licence.into(),
                texts: vec![part.text.into()],
                origin: part.origin.into(),
                platforms,
                ..Component::default()
            });
        }
    }
    for component in all.iter_mut().filter(|component| component.purl.is_empty()) {
        let at = component.version.as_ref().map(|v| format!("@{v}")).unwrap_or_default();
        component.purl = format!("pkg:generic/{}{at}", component.name);
    }
    Ok(all)
}

fn crates(package: &str, platforms: &BTreeSet<&'static str>) -> Result<Vec<Component>> {
    let root = project::root();
    let metadata = MetadataCommand::new()
        .current_dir(&root)
        .exec()
        .context("`cargo metadata` failed; it is needed to list the crates of the FMU")?;
    let lock = std::fs::read_to_string(root.join("Cargo.lock")).context("Cargo.lock")?;
    let lock: toml::Table = lock.parse().context("Cargo.lock cannot be understood")?;
    let nodes = metadata.resolve.as_ref().map_or(&[][..], |resolve| &resolve.nodes);
    let first = metadata.packages.iter().find(|one| one.name == package);
    let first = first.with_context(|| format!("the workspace has no package {package}"))?;
    let mut wanted = vec![&first.id];
    let mut place = 0;
    while place < wanted.len() {
        let node = nodes.iter().find(|node| node.id == *wanted[place]);
        for dependency in node.into_iter().flat_map(|node| &node.deps) {
            // dependencies of tests and of build scripts are left out, because they are not linked
            let linked = dependency.dep_kinds.iter().any(|d| d.kind == DependencyKind::Normal);
            if linked && !wanted.contains(&&dependency.pkg) {
                wanted.push(&dependency.pkg);
            }
        }
        place += 1;
    }
    let mut all = Vec::new();
    for package in wanted.into_iter().map(|id| &metadata[id]) {
        let (name, version) = (package.name.to_string(), package.version.to_string());
        let locked = lock.get("package").and_then(|packages| packages.as_array());
        let locked = locked.into_iter().flatten().find(|one| {
            let is = |key: &str, value: &str| one.get(key).and_then(|v| v.as_str()) == Some(value);
            is("name", &name) && is("version", &version)
        });
        let checksum = locked.and_then(|one| one.get("checksum")).and_then(|sum| sum.as_str());
        all.push(Component {
            purl: format!("pkg:cargo/{name}@{version}"),
            licence: package.license.clone().unwrap_or_default(),
            texts: match package.source {
                None => OWN_TEXTS.map(String::from).to_vec(),
                Some(_) => vec![format!("{name}.txt")],
            },
            sha256: checksum.map(String::from),
            origin: package.description.clone().unwrap_or_default(),
            platforms: platforms.clone(),
            name,
            version: Some(version),
        });
    }
    Ok(all)
}

fn rust_version() -> Result<String> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let said =
        std::process::Command::new(rustc).current_dir(project::root()).arg("--version").output();
    let said = said.context("rustc cannot be run; packing the FMU needs Rust")?;
    let said = String::from_utf8_lossy(&said.stdout);
    let version = said.split_whitespace().nth(1).context("`rustc --version` prints no version")?;
    Ok(version.into())
}

fn contains_backwards(bytes: &[u8], text: &[u8]) -> bool {
    bytes.windows(text.len()).any(|window| window.iter().rev().eq(text))
}

/// Lists the crates of the standard library whose paths are in a binary, such as
/// "/rust/deps/gimli-0.32.3/src", with their versions.
fn standard_crates(bytes: &[u8]) -> Result<BTreeSet<(String, String)>> {
    const BEFORE: &[u8] = b"/rust/deps";
    let mut all = BTreeSet::new();
    let places = bytes.windows(BEFORE.len()).enumerate().filter(|(_, w)| *w == BEFORE);
    for (place, _) in places {
        // on either side of the path is a path separator, of this system or of the target's system
        let separator = |b: &u8| b"/\\".contains(b);
        let Some((first, rest)) = bytes[place + BEFORE.len()..].split_first() else { continue };
        let of_a_name = |b: &u8| b.is_ascii_alphanumeric() || b"-_.+".contains(b);
        let end = rest.iter().position(|b| !of_a_name(b)).unwrap_or(rest.len());
        if end == 0 || !separator(first) || !rest.get(end).is_some_and(separator) {
            continue; // no folder: the texts above, where the binary is this program
        }
        let folder = String::from_utf8_lossy(&rest[..end]);
        let parts = folder.split_once("-").and_then(|_| folder.rsplit_once('-'));
        let known = parts.filter(|(name, _)| STANDARD.iter().any(|(known, _)| known == name));
        let Some((name, version)) = known else {
            bail!(
                "the binary holds {folder}, a crate of Rust's standard library whose licence is \
                 not known: add it to STANDARD in harness/pack/src/components.rs and its text to \
                 modelDescription/licenses/{STANDARD_TEXT}"
            );
        };
        all.insert((name.to_string(), version.to_string()));
    }
    Ok(all)
}

pub fn licence_note(description: &ModelDescription, components: &[Component]) -> String {
    let mut note = format!(
        "{} {}\nSPDX-License-Identifier: {OWN}\n\n\
         You may use this FMU under either licence; the texts are in LICENSE-MIT and LICENSE-APACHE. The binaries\n\
         also contain the components below, whose licences require only that their notices are distributed\n\
         with the binary, as they are here.\n",
        description.model_name, description.version
    );
    for component in components {
        let platforms: Vec<_> = component.platforms.iter().copied().collect();
        let _ = write!(
            note,
            "\n{} {}\n  {}\n  licence:   {}\n  text:      {}\n  platforms: {}\n",
            component.name,
            component.version.as_deref().unwrap_or("(version of the linking tool)"),
            component.origin,
            component.licence,
            component.texts.join(", "),
            platforms.join(", "),
        );
    }
    note
}

fn linked_in_wheel(command: Packed) -> Result<Vec<Component>> {
    let native = crates(project::NATIVE, &BTreeSet::from([command.folder]))?;
    let mut all = linked("hubslosh", &[command])?;
    for component in native {
        if all.iter().all(|known| known.purl != component.purl) {
            all.push(component);
        }
    }
    Ok(all)
}

/// Returns the notice of a wheel for one platform: the licences of all components that are linked
/// into its binaries, with their full texts. `binary` is the command `hubslosh`, and `folder` names
/// the platform. The texts of crates are read from the sources of the crates.
pub fn notices(binary: &[u8], folder: &'static str) -> Result<String> {
    let binary = Packed { folder, ending: "", bytes: binary.to_vec() };
    let metadata = MetadataCommand::new()
        .current_dir(project::root())
        .exec()
        .context("`cargo metadata` failed; it is needed to list the crates of the program")?;
    let ours = project::root().join("modelDescription/licenses");
    // each licence text once, with the components to which it applies
    let mut texts: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut list = String::new();
    for component in linked_in_wheel(binary)? {
        let version = component.version.as_deref().unwrap_or_default();
        let this = format!("{} {version}", component.name).trim_end().to_string();
        let package = metadata.packages.iter().find(|package| {
            *package.name == component.name && package.version.to_string() == version
        });
        let found = match package {
            Some(package) if package.source.is_none() => continue, // this project's own
            Some(package) => {
                let folder = package.manifest_path.parent().context("a crate without folder")?;
                texts_in(folder.as_std_path())?
            }
            None => component
                .texts
                .iter()
                .map(|name| crate::archive::read(&ours.join(name)))
                .collect::<Result<_>>()?,
        };
        let _ = writeln!(list, "{this}: {}", component.licence);
        for text in found {
            let text = String::from_utf8_lossy(&text).trim().replace("\r\n", "\n");
            texts.entry(text).or_default().insert(this.clone());
        }
    }
    let mut notices = format!(
        "The command hubslosh and the library _native in this package contain the components below, whose licences\n\
         require only that their notices are distributed with the program, as they are here.\n\n{list}"
    );
    for (text, names) in texts {
        let names: Vec<_> = names.into_iter().collect();
        let _ = write!(notices, "\n{}\n{}\n\n{text}\n", "=".repeat(80), names.join(", "));
    }
    Ok(notices)
}

fn texts_in(folder: &Path) -> Result<Vec<Vec<u8>>> {
    const BEGINNINGS: [&str; 5] = ["LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE"];
    let mut found = Vec::new();
    let cannot = || format!("{} cannot be read", folder.display());
    for entry in folder.read_dir().with_context(cannot)? {
        let path = entry.with_context(cannot)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_uppercase();
        if path.is_file() && BEGINNINGS.iter().any(|beginning| name.starts_with(beginning)) {
            found.push(crate::archive::read(&path)?);
        }
    }
    Ok(found)
}

pub fn sbom(
    model: &Model,
    fmi: Fmi,
    description: &ModelDescription,
    binaries: &[Packed],
    components: &[Component],
) -> String {
    let files = binaries.iter().flat_map(|binary| {
        binary.files(model.name, fmi).map(|(name, bytes)| (name, sha256(bytes)))
    });
    let product = Product {
        kind: "library",
        name: &description.model_name,
        version: &description.version,
        description: &description.description,
        files: files.collect(),
    };
    product.sbom(components)
}

/// Returns the SBOM of a wheel for one platform, as JSON. It lists the components of the command,
/// whose bytes are `command`, and of the library. `folder` names the platform, and `files` has the
/// names and SHA-256 of the wheel's binaries and FMUs.
///
/// # Errors
///
/// If a component's licence is unknown.
pub fn sbom_of_wheel(
    command: &[u8],
    folder: &'static str,
    files: Vec<(String, String)>,
) -> Result<String> {
    let binary = Packed { folder, ending: "", bytes: command.to_vec() };
    let product = Product {
        kind: "application",
        name: crate::metadata::PACKAGE,
        version: crate::metadata::VERSION,
        description: "Python package and command hubslosh",
        files,
    };
    Ok(product.sbom(&linked_in_wheel(binary)?))
}

struct Product<'a> {
    kind: &'static str,
    name: &'a str,
    version: &'a str,
    description: &'a str,
    files: Vec<(String, String)>,
}

impl Product<'_> {
    /// Returns the SBOM of a product with the linked `components`, as JSON. It contains neither a
    /// time nor a random number, so that equal binaries have equal SBOMs.
    fn sbom(&self, components: &[Component]) -> String {
        let Product { kind, name, version, description, files } = self;
        let this = format!("{name}@{version}");
        let licences = |expression: &str| json!([{ "expression": expression }]);
        let mut list = Vec::new();
        for component in components {
            let platforms = component.platforms.iter();
            let mut entry = json!({
                "type": "library",
                "bom-ref": component.purl,
                "name": component.name,
                "description": component.origin,
                "licenses": licences(&component.licence),
                "purl": component.purl,
                "properties": platforms
                    .map(|folder| json!({ "name": "hubslosh:platform", "value": folder }))
                    .collect::<Vec<_>>(),
            });
            if let Some(version) = &component.version {
                entry["version"] = json!(version);
            }
            if let Some(hash) = &component.sha256 {
                entry["hashes"] = json!([{ "alg": "SHA-256", "content": hash }]);
            }
            list.push(entry);
        }
        let parts = components.iter().map(|c| c.purl.clone());
        let mut dependencies =
            vec![json!({ "ref": this, "dependsOn": parts.clone().collect::<Vec<_>>() })];
        dependencies.extend(parts.map(|purl| json!({ "ref": purl })));
        let files = files.iter().map(|(name, hash)| {
        json!({ "type": "file", "name": name, "hashes": [{ "alg": "SHA-256", "content": hash }] })
    });
        let sbom = json!({
            "bomFormat": "CycloneDX",
            "specVersion": "1.6",
            "version": 1,
            "metadata": { "component": {
                "type": kind,
                "bom-ref": this,
                "name": name,
                "version": version,
                "description": description,
                "licenses": licences(OWN),
                "components": files.collect::<Vec<_>>(),
            }},
            "components": list,
            "dependencies": dependencies,
        });
        format!("{sbom:#}\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::MODELS;

    #[test]
    fn crates_of_the_standard_library_are_found_in_a_binary_by_name_and_version() {
        let found = standard_crates(
            b"x/rust/deps/rustc-demangle-0.1.27/src/v0.rs\0/rust/deps\\gimli-0.32.3\\src",
        );
        let found = found.unwrap();
        let wanted = [("gimli", "0.32.3"), ("rustc-demangle", "0.1.27")];
        assert_eq!(found, wanted.map(|(n, v)| (n.to_string(), v.to_string())).into());
        let error = standard_crates(b"/rust/deps/new-thing-1.0.0/src").unwrap_err().to_string();
        assert!(error.contains("new-thing-1.0.0"), "{error}");
    }

    #[test]
    fn the_search_for_linked_crates_does_not_find_its_own_list_of_names() {
        for words in [
            "/rust/depsaddr2lineApache-2.0 OR MIT/x",
            "/rust/deps",
            "/rust/deps/",
            "/rust/deps/a b/",
            "/rust/deps/\\library`cargo metadata`", // the separators, then any other text
        ] {
            assert!(standard_crates(words.as_bytes()).unwrap().is_empty(), "{words}");
        }
    }

    #[test]
    fn this_program_is_not_mistaken_for_one_that_links_a_run_time_library() {
        let this = crate::archive::read(&std::env::current_exe().unwrap()).unwrap();
        for part in RUN_TIME {
            assert!(!contains_backwards(&this, part.mark), "{}", part.name);
            let text: Vec<u8> = part.mark.iter().rev().copied().collect();
            assert!(contains_backwards(&text, part.mark), "{}", part.name);
        }
    }

    #[test]
    fn the_sbom_of_a_wheel_lists_its_files_and_what_its_binaries_link() {
        let files = vec![("hubslosh.data/scripts/hubslosh".to_string(), "ab".to_string())];
        let sbom = sbom_of_wheel(b"/rust/deps/gimli-0.32.3/src", "linux64", files).unwrap();
        let sbom: serde_json::Value = serde_json::from_str(&sbom).unwrap();
        assert_eq!(
            (&sbom["bomFormat"], &sbom["specVersion"]),
            (&"CycloneDX".into(), &"1.6".into())
        );
        let product = &sbom["metadata"]["component"];
        assert_eq!(product["name"], crate::metadata::PACKAGE);
        assert_eq!(product["components"][0]["hashes"][0]["content"], "ab");
        let components = sbom["components"].as_array().unwrap();
        for name in ["hubslosh", "host", "clap", "pyo3", "std", "gimli"] {
            let found = components.iter().find(|component| component["name"] == name);
            assert!(found.is_some_and(|c| !c["licenses"][0]["expression"].is_null()), "{name}");
        }
    }

    #[test]
    fn libm_is_the_only_third_party_crate_in_an_fmu() {
        for model in &MODELS {
            let all = crates(model.package, &BTreeSet::from(["linux64"])).unwrap();
            assert_eq!(all[0].name, model.package);
            let foreign: Vec<_> = all.iter().filter(|c| c.texts != OWN_TEXTS).collect();
            let names: Vec<_> = foreign.iter().map(|c| c.name.as_str()).collect();
            assert_eq!(names, ["libm"]);
            assert_eq!(foreign[0].sha256.as_ref().unwrap().len(), 64, "as Cargo.lock has it");
        }
    }
}

//! The invariants of ARCHITECTURE.md that the compiler does not enforce.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use cargo_metadata::{DependencyKind, MetadataCommand};

/// What each package of the workspace links, tests and build scripts left out.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let metadata =
        MetadataCommand::new().current_dir(pack::root()).no_deps().exec().expect("cargo metadata");
    let linked = |package: &cargo_metadata::Package| {
        let normal = package.dependencies.iter().filter(|d| d.kind == DependencyKind::Normal);
        normal.map(|d| d.name.clone()).collect()
    };
    metadata.packages.iter().map(|package| (package.name.to_string(), linked(package))).collect()
}

#[test]
fn the_physics_knows_no_fmi_and_the_runtime_no_physics() {
    let all = dependencies();
    for physics in ["plant", "craft"] {
        let of_both = BTreeSet::from(["formulas".into(), "libm".into(), "taylor".into()]);
        assert_eq!(all[physics], of_both, "{physics}");
    }
    for core in ["formulas", "taylor"] {
        assert_eq!(all[core], BTreeSet::from(["libm".into()]), "{core}");
    }
    assert_eq!(all["runtime"], BTreeSet::new());
}

/// A build is the check: without the standard library's prelude a crate that needs it does not compile.
#[test]
fn the_models_and_what_they_are_made_of_need_no_standard_library() {
    for krate in ["formulas", "taylor", "plant", "craft"] {
        let file = pack::root().join("fmu").join(krate).join("src/lib.rs");
        let text = fs::read_to_string(file).expect("a crate's root");
        let is_free = ["#![no_std]", "#![cfg_attr(not(test), no_std)]"];
        assert!(text.lines().any(|line| is_free.contains(&line)), "{krate}");
        assert!(!text.contains("extern crate std"), "{krate}");
    }
}

/// The packages of the harness, each with those of the workspace that it may link: of `fmu/` the formulas
/// alone, which are no model.
const HARNESS: [(&str, &[&str]); 12] = [
    ("host", &[]),
    ("signals", &["host"]),
    ("check", &["host"]),
    ("analysis", &["signals"]),
    ("experiments", &["formulas", "host", "signals", "analysis"]),
    ("web", &[]),
    ("pack", &["host", "web"]),
    ("report", &["formulas", "host", "signals", "analysis", "experiments", "web"]),
    ("identify", &["formulas", "host", "signals", "analysis", "experiments", "report"]),
    ("hubslosh-tank", &["formulas"]),
    ("hubslosh-batch", &[]),
    (
        "hubslosh",
        &[
            "formulas",
            "host",
            "signals",
            "check",
            "pack",
            "analysis",
            "experiments",
            "report",
            "identify",
            "hubslosh-tank",
        ],
    ),
];

#[test]
fn the_harness_never_links_a_model_and_its_packages_depend_one_way() {
    let all = dependencies();
    for (package, allowed) in HARNESS {
        let own = all[package].iter().map(String::as_str).filter(|name| all.contains_key(*name));
        assert_eq!(own.collect::<BTreeSet<_>>(), allowed.iter().copied().collect(), "{package}");
    }
    let harness = pack::root().join("harness");
    for folder in fs::read_dir(harness).expect("the harness").flatten() {
        if let Ok(manifest) = fs::read_to_string(folder.path().join("Cargo.toml")) {
            let named =
                |(package, _): &(&str, _)| manifest.contains(&format!("name = \"{package}\""));
            assert!(HARNESS.iter().any(named), "{} is not in the list", folder.path().display());
        }
    }
}

#[test]
fn only_the_command_line_draws_progress() {
    for (package, dependencies) in dependencies() {
        assert!(package == "hubslosh" || !dependencies.contains("indicatif"), "{package}");
    }
}

/// Files in which the workspace's `unsafe_code = "deny"` is lifted.
#[test]
fn unsafe_code_stands_in_the_files_of_the_c_interface() {
    let mut found = BTreeSet::new();
    let root = pack::root();
    collect(&root, &root, &mut found);
    let known = [
        "fmu/fuzz/src/calls.rs",
        "fmu/runtime/src/c_abi.rs",
        "fmu/runtime/src/v2.rs",
        "fmu/runtime/src/v3.rs",
        "harness/batch/src/abi.rs",
        "harness/host/src/c_abi.rs",
        "harness/host/src/fmi2.rs", // and its submodules
        "harness/host/src/fmi3.rs",
    ];
    assert_eq!(found, known.map(String::from).into());
}

fn collect(root: &Path, folder: &Path, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("a folder of the project").flatten() {
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            collect(root, &path, found);
        } else if name.ends_with(".rs") {
            let text = fs::read_to_string(&path).expect("a source file");
            let lifted = format!("allow({}", "unsafe_code)");
            if text.lines().any(|line| line.trim_start().starts_with("#") && line.contains(&lifted))
            {
                let relative = path.strip_prefix(root).expect("below the root");
                found.insert(relative.to_string_lossy().replace('\\', "/"));
            }
        }
    }
}

/// The crates whose modules use each other one way, with the modules that may go round in a circle.
const ONE_WAY: [(&str, &[&str]); 20] = [
    ("fmu/plant", &[]),
    ("fmu/craft", &[]),
    ("fmu/formulas", &[]),
    ("fmu/taylor", &[]),
    // a variable gets and sets through the model, whose table it stands in
    ("fmu/runtime", &["model", "table", "variable"]),
    // a model says which table is its own
    ("fmu/hubslosh", &["model", "table"]),
    ("fmu/spacecraft", &["model", "table"]),
    ("fmu/sloshtank", &["model", "table"]),
    ("fmu/fuzz", &[]),
    ("modelDescription", &[]),
    ("harness/host", &[]),
    ("harness/signals", &[]),
    ("harness/check", &[]),
    ("harness/pack", &[]),
    ("harness/analysis", &[]),
    ("harness/experiments", &[]),
    ("harness/report", &[]),
    ("harness/identify", &[]),
    ("harness/tank", &[]),
    ("harness/cli", &[]),
];

/// The modules of a crate (a folder is one), each with those that it names as `crate::module`; tests
/// within the files are left out.
fn modules(krate: &Path) -> BTreeMap<String, BTreeSet<String>> {
    fn read(path: &Path, text: &mut String) {
        if path.is_dir() {
            for entry in fs::read_dir(path).expect("a folder of modules").flatten() {
                read(&entry.path(), text);
            }
        } else if path.extension().is_some_and(|e| e == "rs") {
            let file = fs::read_to_string(path).expect("a source file");
            let code = file.split("#[cfg(test)]").next().unwrap_or_default();
            text.extend(code.lines().filter(|line| !line.trim_start().starts_with("//")));
        }
    }
    let mut all: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for entry in fs::read_dir(krate.join("src")).expect("a crate's src").flatten() {
        let (path, mut text) = (entry.path(), String::new());
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if !matches!(name.as_str(), "lib" | "main") {
            read(&path, &mut text);
            // `crate::name…` and `crate::{one, other::…}`
            let names = text.split("crate::").skip(1).flat_map(|rest| {
                let (list, count) = match rest.strip_prefix('{') {
                    Some(list) => (list.split('}').next().unwrap_or_default(), usize::MAX),
                    None => (rest, 1),
                };
                list.split(|c: char| !c.is_alphanumeric() && c != '_').take(count)
            });
            all.insert(name, names.map(String::from).collect());
        }
    }
    let known: BTreeSet<String> = all.keys().cloned().collect();
    for (name, used) in &mut all {
        used.retain(|other| known.contains(other) && other != name);
    }
    all
}

#[test]
fn modules_of_a_crate_use_each_other_one_way() {
    for (krate, may_circle) in ONE_WAY {
        let mut left = modules(&pack::root().join(krate));
        for used in left.values_mut() {
            used.retain(|other| !may_circle.contains(&other.as_str()));
        }
        // What uses nothing that is left is no part of a circle.
        while let Some(leaf) =
            left.iter().find(|(_, used)| used.is_empty()).map(|(name, _)| name.clone())
        {
            left.remove(&leaf);
            left.values_mut().for_each(|used| {
                used.remove(&leaf);
            });
        }
        assert!(left.is_empty(), "{krate}: in a circle or above one: {left:?}");
    }
}

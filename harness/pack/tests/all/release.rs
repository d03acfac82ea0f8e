//! The FMUs released in dist/release are whole, and of this source as long as they bear this
//! version.

use std::path::PathBuf;

use host::binary::Binary;
use host::output::sha256;
use pack::platforms::{PLATFORMS, Platform};
use pack::{Fmi, MODELS, Model, release};

/// The committed FMUs of this version. There are none between a new version's number and its
/// release; then an older one must be there.
fn released() -> Vec<(&'static Model, Fmi, PathBuf)> {
    let folder = pack::root().join("dist").join("release");
    let of = |model| Fmi::RELEASED.map(|fmi| (model, fmi, release::path(model, fmi, &folder)));
    let fmus: Vec<_> = MODELS.iter().flat_map(of).collect();
    let missing: Vec<_> = fmus.iter().filter(|(.., fmu)| !fmu.exists()).collect();
    if missing.len() < fmus.len() {
        assert!(missing.is_empty(), "some FMUs of this version are missing: {missing:?}");
        return fmus;
    }
    let older = folder.read_dir().unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let ends = |name: &str| name.ends_with(".fmu");
    assert!(older.flatten().any(|file| ends(&file.file_name().to_string_lossy())), "no release");
    vec![]
}

#[test]
fn release_of_this_version_has_this_interface() {
    for (model, fmi, fmu) in released() {
        let source = model.folder().join(match fmi {
            Fmi::V2 => "modelDescription.xml",
            Fmi::V3 => "fmi3/modelDescription.xml",
            Fmi::V3Arrays => "fmi3-arrays/modelDescription.xml",
        });
        let there = release::read(&fmu, "modelDescription.xml").unwrap();
        assert!(
            there == std::fs::read(source).unwrap(),
            "{} has another modelDescription.xml than the source of the same version: raise the \
         version in Cargo.toml, or, if that release has gone to nobody yet, make it again by \
         `hubslosh release`",
            fmu.display()
        );
    }
}

#[test]
fn hash_and_sbom_beside_the_release_are_its_own() {
    for (model, _, fmu) in released() {
        let name = fmu.file_name().unwrap().to_string_lossy();
        let written = std::fs::read_to_string(fmu.with_extension("fmu.sha256")).unwrap();
        assert_eq!(written, format!("{}  {name}\n", sha256(&std::fs::read(&fmu).unwrap())));
        let beside = std::fs::read(fmu.with_extension("cdx.json")).unwrap();
        assert!(beside == release::read(&fmu, &model.sbom()).unwrap());
        let sbom: serde_json::Value = serde_json::from_slice(&beside).unwrap();
        for file in sbom["metadata"]["component"]["components"].as_array().unwrap() {
            let binary = release::read(&fmu, file["name"].as_str().unwrap()).unwrap();
            assert_eq!(file["hashes"][0]["content"], sha256(&binary));
        }
    }
}

/// The tree keeps the files of one version; of the older ones it keeps the hashes.
#[test]
fn release_folder_holds_one_version_and_the_hashes_of_all() {
    let folder = pack::root().join("dist").join("release");
    let sums = std::fs::read_to_string(folder.join("SHA256SUMS")).unwrap();
    let mut versions = std::collections::BTreeSet::new();
    for entry in folder.read_dir().unwrap().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.ends_with(".fmu") || name.ends_with(".whl") {
            versions.extend(name.trim_end_matches(".fmu").split('-').nth(1).map(String::from));
            let line = format!("{}  {name}\n", sha256(&std::fs::read(entry.path()).unwrap()));
            assert!(sums.contains(&line), "SHA256SUMS has no line {line}");
        }
    }
    assert_eq!(versions.len(), 1, "{versions:?}");
    assert!(sums.contains("  HubSlosh-0.1.0.fmu\n"));
}

#[test]
fn wheel_beside_the_release_is_the_only_one_and_has_its_hash() {
    let folder = pack::root().join("dist").join("release");
    let entries = folder.read_dir().unwrap().flatten().map(|entry| entry.path());
    let wheels: Vec<_> = entries.filter(|p| p.extension().is_some_and(|e| e == "whl")).collect();
    let Ok(hashes) = std::fs::read_to_string(release::wheel_hashes(&folder)) else {
        assert!(wheels.is_empty() || released().is_empty(), "a wheel without its hash: {wheels:?}");
        return;
    };
    assert_eq!(hashes.lines().count(), 5, "Linux, macOS twice each, Windows: {hashes}");
    assert!(wheels.len() <= 1, "{wheels:?}");
    for wheel in wheels {
        let bytes = std::fs::read(&wheel).unwrap();
        let name = wheel.file_name().unwrap().to_string_lossy();
        assert!(hashes.contains(&format!("{}  {name}\n", sha256(&bytes))), "{name}");
        assert!(bytes.len() as u64 <= release::LARGEST_WHEEL, "{name}: {} bytes", bytes.len());
    }
}

#[test]
fn release_passed_the_check() {
    for (.., fmu) in released() {
        let report = std::fs::read_to_string(fmu.with_extension("check.txt")).unwrap();
        let sum = report.lines().last().unwrap();
        let name = fmu.file_name().unwrap().to_string_lossy();
        assert!(sum.starts_with(&format!("{name}: 0 errors, ")), "{report}");
    }
}

#[test]
fn release_is_small_and_for_all_platforms() {
    for (Model { name, .. }, fmi, fmu) in released() {
        let mut processors = 0;
        for Platform { folder, ending, .. } in &PLATFORMS {
            // both of macOS are in each of its two folders of FMI 3.0
            for folder in fmi.folders(folder) {
                let binary = format!("binaries/{folder}/{name}{ending}");
                let binary = Binary::read(&release::read(&fmu, &binary).unwrap()).unwrap();
                processors += binary.architectures.len() as u64;
            }
        }
        let size = fmu.metadata().unwrap().len();
        // Code for one processor takes 530 to 750 kB since 0.4.0, whose libraries have the functions of both versions of FMI, and
        // Spacecraft's the modes of tanks without axial symmetry; before it were 410 to 520 kB.
        let limit = 800_000 * processors;
        assert!(size < limit, "{}: {size} bytes of {limit}", fmu.display());
    }
}

//! The released FMUs in dist/release are complete. As long as they have the version in Cargo.toml, they belong to this source.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use files::output::sha256;
use host::binary::Binary;
use pack::platforms::{PLATFORMS, Platform};
use pack::{Fmi, MODELS, Model, release};

/// Returns the committed FMUs of this version. The list is empty after the version in Cargo.toml
/// has changed and before the release is made; files of an older version must exist then.
fn committed_fmus() -> Vec<(&'static Model, Fmi, PathBuf)> {
    let folder = pack::root().join("dist").join("release");
    let of = |model| Fmi::ALL.map(|fmi| (model, fmi, release::path(model, fmi, &folder)));
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
fn the_committed_release_has_the_interface_of_the_source() {
    for (model, fmi, fmu) in committed_fmus() {
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
fn the_committed_sbom_equals_the_sbom_inside_the_released_fmu() {
    for (model, _, fmu) in committed_fmus() {
        let beside = std::fs::read(fmu.with_extension("cdx.json")).unwrap();
        assert!(beside == release::read(&fmu, &model.sbom()).unwrap());
        let sbom: serde_json::Value = serde_json::from_slice(&beside).unwrap();
        for file in sbom["metadata"]["component"]["components"].as_array().unwrap() {
            let binary = release::read(&fmu, file["name"].as_str().unwrap()).unwrap();
            assert_eq!(file["hashes"][0]["content"], sha256(&binary));
        }
    }
}

#[test]
fn the_release_folder_has_the_files_of_one_version_and_the_hashes_of_all_versions() {
    let folder = pack::root().join("dist").join("release");
    let sums = std::fs::read_to_string(folder.join(release::MANIFEST)).unwrap();
    let mut versions = BTreeSet::new();
    let mut wheels = 0;
    for entry in folder.read_dir().unwrap().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if [release::MANIFEST, release::PRESENT].contains(&name.as_str()) {
            continue;
        }
        let bytes = std::fs::read(entry.path()).unwrap();
        let line = format!("{}  {name}\n", sha256(&bytes));
        assert!(sums.contains(&line), "{} has no line {line}", release::MANIFEST);
        if name.ends_with(".fmu") || name.ends_with(".whl") {
            versions.extend(name.trim_end_matches(".fmu").split('-').nth(1).map(String::from));
        }
        if name.ends_with(".whl") {
            wheels += 1;
            let size = bytes.len() as u64;
            assert!(size <= release::LARGEST_WHEEL, "{name}: {size} bytes");
        }
    }
    assert_eq!(versions.len(), 1, "{versions:?}");
    assert!(wheels <= 1, "{wheels} wheels");
    let version = versions.first().unwrap();
    let listed =
        |line: &&str| line.contains(&format!("  hubslosh-{version}-")) && line.ends_with(".whl");
    assert_eq!(sums.lines().filter(listed).count(), 5, "Linux, macOS twice each, Windows");
    assert!(sums.contains("  HubSlosh-0.1.0.fmu\n"));
    let present = std::fs::read_to_string(folder.join(release::PRESENT)).unwrap();
    let absent = |line: &&str| !folder.join(line.split_once("  ").unwrap().1).is_file();
    assert_eq!(present.lines().find(absent), None, "sha256sum --check would fail");
}

#[cfg(unix)]
fn tree_with_a_release(folder: &Path) {
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    let script = std::fs::read_to_string(pack::root().join(".github/release-files")).unwrap();
    write(".github/release-files", &script);
    write("Cargo.toml", "[workspace.package]\nversion = \"1.2.3\"\n\n");
    write("CITATION.cff", "version: 1.2.3\n");
    write("CHANGELOG.md", "## 1.2.3\n\nAll.\n\n## 1.2.2\n\nLess.\n");
    let mut sums = "0  HubSlosh-1.2.2.fmu\n0  HubSlosh-1.2.30.fmu\n".to_string();
    let mut listed = |file: &str, name: &str| {
        write(file, name);
        sums += &format!("{}  {name}\n", sha256(name.as_bytes()));
    };
    for model in ["HubSlosh", "Spacecraft", "SloshTank"] {
        for name in ["", "-fmi3", "-fmi3-arrays"].map(|fmi| format!("{model}-1.2.3{fmi}.fmu")) {
            listed(&format!("dist/release/{name}"), &name);
        }
    }
    listed("dist/release/HubSlosh-1.2.3-fmi3.cdx.json", "HubSlosh-1.2.3-fmi3.cdx.json");
    listed("wheels/hubslosh-1.2.3-py3-none-win_amd64.whl", "hubslosh-1.2.3-py3-none-win_amd64.whl");
    write("wheels/hubslosh-1.2.3.tar.gz", "sdist");
    write("dist/release/notes.txt", "not listed");
    write("dist/release/SHA256SUMS.all", &sums);
}

#[cfg(unix)]
fn gather_release_files(tree: &Path, arguments: &[&str]) -> Result<BTreeSet<String>, String> {
    let mut command = Command::new("bash");
    let command = command.current_dir(tree).arg(".github/release-files").args(arguments);
    let done = command.output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    let names = std::fs::read_dir(tree.join(arguments[1])).into_iter().flatten().flatten();
    let names = names.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    if done.status.success() { Ok(names) } else { Err(said) }
}

#[cfg(unix)]
#[test]
fn the_files_of_the_release_have_the_hashes_in_the_manifest() {
    let whole = tempfile::tempdir().unwrap();
    tree_with_a_release(whole.path());
    let found = gather_release_files(whole.path(), &["v1.2.3", "files"]).unwrap();
    let mut wanted: BTreeSet<String> =
        ["SHA256SUMS", "notes.md", "HubSlosh-1.2.3-fmi3.cdx.json"].map(String::from).into();
    for model in ["HubSlosh", "Spacecraft", "SloshTank"] {
        wanted.extend(["", "-fmi3", "-fmi3-arrays"].map(|fmi| format!("{model}-1.2.3{fmi}.fmu")));
    }
    assert_eq!(found, wanted);
    let found = gather_release_files(whole.path(), &["v1.2.3", "all", "wheels"]).unwrap();
    wanted.extend(
        ["hubslosh-1.2.3-py3-none-win_amd64.whl", "hubslosh-1.2.3.tar.gz"].map(String::from),
    );
    assert_eq!(found, wanted);
    let check = Command::new("sha256sum")
        .current_dir(whole.path().join("all"))
        .args(["--check", "--quiet", "SHA256SUMS"])
        .status()
        .unwrap();
    assert!(check.success());
    let fmu = "dist/release/Spacecraft-1.2.3-fmi3.fmu";
    let wheel = "wheels/hubslosh-1.2.3-py3-none-win_amd64.whl";
    let other = "wheels/hubslosh-1.2.3-py3-none-any.whl";
    for (name, content, why) in [
        (fmu, None, "is missing"),
        (fmu, Some("other"), "has the SHA-256"),
        ("dist/release/HubSlosh-1.2.3-fmi3.cdx.json", None, "is missing"),
        (wheel, None, "is missing"),
        (wheel, Some("other"), "has the SHA-256"),
        (other, Some("other"), "lists no hubslosh-1.2.3-py3-none-any.whl"),
        (
            "dist/release/SHA256SUMS.all",
            Some("0  HubSlosh-1.2.3.fmu\n"),
            "lists no HubSlosh-1.2.3-fmi3.fmu",
        ),
        ("CITATION.cff", Some("version: 1.2.2\n"), "CITATION.cff has another version"),
    ] {
        let tree = tempfile::tempdir().unwrap();
        tree_with_a_release(tree.path());
        match content {
            Some(content) => std::fs::write(tree.path().join(name), content).unwrap(),
            None => std::fs::remove_file(tree.path().join(name)).unwrap(),
        }
        let said = gather_release_files(tree.path(), &["v1.2.3", "files", "wheels"]).unwrap_err();
        assert!(said.contains(why), "{name}: {said}");
    }
}

#[test]
fn the_committed_release_has_a_check_report_without_errors() {
    for (.., fmu) in committed_fmus() {
        let report = std::fs::read_to_string(fmu.with_extension("check.txt")).unwrap();
        let sum = report.lines().last().unwrap();
        let name = fmu.file_name().unwrap().to_string_lossy();
        assert!(sum.starts_with(&format!("{name}: 0 errors, ")), "{report}");
    }
}

#[test]
fn the_released_fmus_are_small_and_have_binaries_for_all_platforms() {
    for (Model { name, .. }, fmi, fmu) in committed_fmus() {
        let mut processors = 0;
        for Platform { folder, ending, .. } in &PLATFORMS {
            // In FMI 2.0 both processors of macOS share one folder.
            for folder in fmi.folders(folder) {
                let binary = format!("binaries/{folder}/{name}{ending}");
                let binary = Binary::read(&release::read(&fmu, &binary).unwrap()).unwrap();
                processors += binary.architectures.len() as u64;
            }
        }
        let size = fmu.metadata().unwrap().len();
        // Since 0.4.0 the code for one processor has 530 to 750 kB, because the libraries contain the functions of both
        // versions of FMI, and Spacecraft's library also the modes of tanks without axial symmetry. Before 0.4.0 it had
        // 410 to 520 kB.
        let limit = 800_000 * processors;
        assert!(size < limit, "{}: {size} bytes of {limit}", fmu.display());
    }
}

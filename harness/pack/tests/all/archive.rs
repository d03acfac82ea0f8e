//! Files of the FMU other than description and binaries.

use std::collections::{BTreeMap, BTreeSet};

use pack::{HUBSLOSH, packed_for_tests};

fn files() -> BTreeMap<String, Vec<u8>> {
    use std::io::Read;
    let file = std::fs::File::open(packed_for_tests()).unwrap();
    let mut archive = zip::ZipArchive::new(file).unwrap();
    let mut all = BTreeMap::new();
    for i in 0..archive.len() {
        let mut file = archive.by_index(i).unwrap();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).unwrap();
        all.insert(file.name().unwrap().into_owned(), bytes);
    }
    all
}

fn text(files: &BTreeMap<String, Vec<u8>>, name: &str) -> String {
    String::from_utf8(files[name].clone()).unwrap()
}

fn attributes(page: &str, name: &str) -> BTreeSet<String> {
    let before = format!(" {name}=\"");
    page.split(&before).skip(1).map(|part| part.split('"').next().unwrap().to_string()).collect()
}

#[test]
fn every_link_and_figure_of_the_documentation_is_in_the_fmu() {
    let files = files();
    let page = text(&files, "documentation/index.html");
    let ids = attributes(&page, "id");
    let links = attributes(&page, "href");
    assert!(links.len() > 40, "the list of contents alone has more links");
    for link in links {
        let anchor = link.strip_prefix('#').unwrap_or_else(|| panic!("{link} leads out"));
        assert!(ids.contains(anchor), "{link} leads nowhere");
    }
    let figures = attributes(&page, "src");
    assert!(figures.contains("bench.svg"));
    for figure in figures {
        assert!(files.contains_key(&format!("documentation/{figure}")), "{figure} is missing");
    }
    assert!(!page.contains("<script"));
}

#[test]
fn every_licence_that_the_fmu_names_is_in_the_fmu_as_text() {
    let files = files();
    let note = text(&files, "documentation/licenses/license.txt");
    assert!(note.contains("SPDX-License-Identifier: MIT OR Apache-2.0\n"));
    let named: BTreeSet<&str> = note
        .lines()
        .filter_map(|line| line.trim().strip_prefix("text:"))
        .flat_map(|texts| texts.split(','))
        .map(str::trim)
        .collect();
    assert!(named.contains("libm.txt") && named.contains("rust-standard-library.txt"));
    for text in named {
        assert!(files[&format!("documentation/licenses/{text}")].len() > 500, "{text}");
    }
}

#[test]
fn the_sbom_of_an_fmu_lists_the_linked_crates_and_has_no_dangling_reference() {
    let files = files();
    let sbom: serde_json::Value = serde_json::from_slice(&files[&HUBSLOSH.sbom()]).unwrap();
    let parts = sbom["components"].as_array().unwrap();
    let names: BTreeSet<&str> = parts.iter().map(|part| part["name"].as_str().unwrap()).collect();
    for name in [HUBSLOSH.package, "plant", "libm", "std", "gimli"] {
        assert!(names.contains(name), "{name} is not in {names:?}");
    }
    // Crates that only the harness uses are not in the FMU.
    assert!(!names.contains("zip") && !names.contains("clap"));
    let references: BTreeSet<&str> = parts.iter().map(|p| p["bom-ref"].as_str().unwrap()).collect();
    assert_eq!(references.len(), parts.len(), "references are unique");
    for part in sbom["dependencies"][0]["dependsOn"].as_array().unwrap() {
        assert!(references.contains(part.as_str().unwrap()));
    }
}

#[test]
fn an_fmu_packed_from_a_binary_a_description_and_a_folder_contains_only_these_files() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        path
    };
    let binary = write("target/libm.so", "binary");
    write("extra/resources/b.txt", "b");
    write("extra/resources/a/c.txt", "c");
    let out = folder.path().join("new/M.fmu");
    let extra = folder.path().join("extra");
    pack::archive::plain("<xml/>", &binary, "M", Some(&extra), &out).unwrap();
    let archive = zip::ZipArchive::new(std::fs::File::open(&out).unwrap()).unwrap();
    let names: Vec<_> = archive.file_names().flatten().map(|n| n.into_owned()).collect();
    let ending = std::env::consts::DLL_SUFFIX;
    let binary = format!("binaries/{}/M{ending}", host::fmi2::PLATFORM);
    assert_eq!(names, ["modelDescription.xml", &binary, "resources/a/c.txt", "resources/b.txt"]);
}

#[test]
fn an_fmu_2_has_its_icon_and_no_terminals_of_fmi_3() {
    let files = files();
    assert_eq!(files["model.png"][..8], *b"\x89PNG\r\n\x1a\n");
    // FMI Library 3.0.4 and newer log a fatal error if an FMU 2.0 contains terminalsAndIcons.xml.
    assert!(!files.keys().any(|name| name.starts_with("terminalsAndIcons")));
}

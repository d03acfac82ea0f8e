//! Statements about the project in other files agree with Cargo.toml.

use pack::metadata::{self, REPOSITORY, VERSION};
use pack::root;

use super::documentation::markdown;

fn read(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn released_wheel() -> String {
    let folder = root().join("dist/release").read_dir().expect("the release");
    let mut names = folder.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    let wheel = names.find(|name| name.ends_with(".whl")).expect("a wheel");
    wheel.split('-').nth(1).expect("a version").to_string()
}

#[test]
fn repository_address_and_version_in_all_pages_equal_cargo_toml() {
    let citation = read("CITATION.cff");
    assert!(citation.lines().any(|line| line == format!("version: {VERSION}")), "CITATION.cff");
    assert!(!citation.contains(REPOSITORY), "the address has one place, Cargo.toml");
    for page in markdown() {
        for line in read(&page).lines() {
            let clone = line.trim_start().strip_prefix("git clone ");
            assert!(clone.is_none_or(|rest| rest.starts_with(REPOSITORY)), "{page}: {line}");
            // `pip install --find-links dist "hubslosh[plot]==1.2.3"`
            if let Some((_, wanted)) =
                line.split_once("hubslosh").and_then(|(_, w)| w.split_once("=="))
            {
                let version = if line.contains("--find-links dist/release ") {
                    released_wheel()
                } else {
                    VERSION.into()
                };
                assert!(wanted.starts_with(&version), "{page}: {line}");
            }
        }
    }
}

#[test]
fn the_package_index_shows_readme_with_absolute_links() {
    let text = metadata::text().unwrap();
    let (head, body) = text.split_once("\n\n").unwrap();
    assert!(head.contains(&format!("\nProject-URL: Source, {REPOSITORY}\n")), "{head}");
    assert!(body.starts_with("# HubSlosh\n"), "{body}");
    // Every link and picture is absolute, or leads to a heading of the page.
    for target in body.match_indices("](").map(|(place, _)| &body[place + 2..]) {
        let to = target.split([')', ' ']).next().unwrap_or_default();
        assert!(to.starts_with("https://") || to.starts_with('#'), "{to}");
    }
}

//! The documentation: links, figures, the book.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use pack::documentation::book;
use pack::documentation::page::{Gathered, Layout, Page};

/// Paths of all Markdown files of the project, from its root.
pub fn markdown() -> Vec<String> {
    fn below(folder: &Path, all: &mut Vec<PathBuf>) {
        for entry in folder.read_dir().unwrap().flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            let name = name.to_string_lossy();
            // built things, and other projects' texts in virtual environments
            if name.starts_with('.') && name != ".ci" || ["target", "dist"].contains(&&*name) {
                continue;
            }
            if path.is_dir() {
                below(&path, all);
            } else if name.ends_with(".md") {
                all.push(path);
            }
        }
    }
    let (root, mut all) = (pack::root(), Vec::new());
    below(&root, &mut all);
    all.iter().map(|path| path.strip_prefix(&root).unwrap().to_string_lossy().into()).collect()
}

/// Values of an attribute, wherever it is.
fn attributes(page: &str, name: &str) -> BTreeSet<String> {
    let before = format!(" {name}=\"");
    page.split(&before).skip(1).map(|part| part.split('"').next().unwrap().to_string()).collect()
}

#[test]
fn no_link_no_figure_and_no_equation_of_any_markdown_file_is_broken() {
    let root = pack::root();
    let pages: Vec<_> = markdown().iter().map(|path| Page::read(&root, path).unwrap()).collect();
    assert!(pages.iter().any(|page| page.path == "README.md"));
    let mut all = Gathered::default();
    for page in &pages {
        page.html(&root, &pages, Layout::Site, &mut all);
    }
    assert!(all.faults.is_empty(), "{:#?}", all.faults);
}

#[test]
fn every_page_of_the_documentation_is_in_the_book() {
    let summary = std::fs::read_to_string(pack::root().join("book/SUMMARY.md")).unwrap();
    for path in markdown() {
        let Some((folder, name)) = path.rsplit_once('/') else { continue };
        let link = match folder {
            "book" => name.to_string(),
            _ if folder.ends_with("/documentation") => format!("../{path}"),
            _ if folder.starts_with("examples") && name == "README.md" => format!("../{path}"),
            _ => continue,
        };
        let listed = summary.contains(&format!("]({link})"));
        assert!(listed || path == "book/SUMMARY.md", "{path} is not in book/SUMMARY.md");
    }
}

#[test]
fn every_link_and_figure_of_the_book_leads_to_one_of_its_files() {
    let files = book::render(&pack::root()).unwrap();
    let files: BTreeMap<_, _> = files.into_iter().collect();
    let text = |name: &str| String::from_utf8(files[name].clone()).unwrap();
    let pages: Vec<_> = files.keys().filter(|name| name.ends_with(".html")).collect();
    assert!(pages.len() > 20, "{pages:?}");
    for name in pages {
        let page = text(name);
        for source in attributes(&page, "src") {
            assert!(files.contains_key(&source), "{name}: {source} is missing");
        }
        for link in attributes(&page, "href") {
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let file = if file.is_empty() { name } else { file };
            assert!(files.contains_key(file), "{name}: {link} leads nowhere");
            let there = anchor.is_empty() || attributes(&text(file), "id").contains(anchor);
            assert!(there, "{name}: {link} leads nowhere");
        }
    }
}

#[test]
fn every_equation_is_typeset_and_every_place_the_search_finds_exists() {
    let files: BTreeMap<_, _> = book::render(&pack::root()).unwrap().into_iter().collect();
    let text = |name: &str| String::from_utf8(files[name].clone()).unwrap();
    for name in files.keys().filter(|name| name.ends_with(".html")) {
        let page = text(name);
        assert!(!page.contains("<merror") && !page.contains("$$"), "{name}");
    }
    let index = text("search-index.js");
    let json = index.strip_prefix("const SECTIONS = ").unwrap().trim_end().trim_end_matches(';');
    let sections: serde_json::Value = serde_json::from_str(json).unwrap();
    let sections = sections.as_array().unwrap();
    assert!(sections.len() > 100);
    for section in sections {
        let (file, anchor) = section["at"].as_str().unwrap().split_once('#').unwrap_or_default();
        let there = file.is_empty() || attributes(&text(file), "id").contains(anchor);
        assert!(there, "{section}");
    }
}

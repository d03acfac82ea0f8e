//! Tests that the tables of evidence in the book name only tests that exist.

use std::fs;
use std::path::Path;

fn sources(directory: &Path, code: &mut String, files: &mut Vec<String>) {
    for entry in fs::read_dir(directory).expect("a directory of the project") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() && name != "target" && name != "dist" && !name.starts_with('.') {
            sources(&path, code, files);
        } else if name.ends_with(".rs") || name.ends_with(".py") {
            code.push_str(&fs::read_to_string(&path).expect("a source file"));
            files.push(name.to_string());
        }
    }
}

fn rows(page: &str, heading: &str) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(root.join("book").join(page)).expect("the page");
    let tables = page.split("\n\n").filter(|table| table.trim_start().starts_with(heading));
    tables.flat_map(|table| table.trim().lines().skip(2)).map(String::from).collect()
}

fn named(row: &str) -> impl Iterator<Item = &str> {
    let last = row.trim_end_matches([' ', '|']).rsplit(" | ").next().unwrap_or_default();
    last.split('`').skip(1).step_by(2)
}

/// Returns the names in the rows of a table that do not exist in the sources. Names have the forms `function_name`,
/// `crate::file_stem` and `test_file.py`; commands, and scripts with a path, are not checked.
fn missing(rows: &[String]) -> Vec<&str> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (mut code, mut files) = (String::new(), Vec::new());
    for part in ["fmu", "modelDescription", "harness", "tests"] {
        sources(&root.join(part), &mut code, &mut files);
    }
    let is_there = |name: &&str| {
        let stem = name.rsplit("::").next().unwrap_or(name);
        let file = if stem.ends_with(".py") { stem.to_string() } else { format!("{stem}.rs") };
        files.contains(&file)
            || code.contains(&format!("fn {name}("))
            || code.contains(&format!("def {name}("))
    };
    let looked_up = |name: &&str| !name.contains([' ', '/', '=']);
    rows.iter().flat_map(|row| named(row)).filter(looked_up).filter(|n| !is_there(n)).collect()
}

#[test]
fn every_test_that_the_checklist_names_exists() {
    let rows = rows("checklist.md", "| demand");
    assert!(rows.len() >= 40, "{} rows are left", rows.len());
    for row in rows.iter().filter(|row| !row.starts_with("| **")) {
        assert!(named(row).next().is_some(), "no test: {row}");
    }
    assert_eq!(missing(&rows), [""; 0]);
}

#[test]
fn every_test_that_the_page_of_verification_names_exists() {
    let rows = rows("verification.md", "| claim");
    assert!(rows.len() >= 50, "{} rows are left", rows.len());
    for row in &rows {
        let by_hand = row.contains("| by hand");
        assert!(by_hand || named(row).next().is_some(), "no test: {row}");
    }
    assert_eq!(missing(&rows), [""; 0]);
}

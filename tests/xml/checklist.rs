//! The pages of what hosts ask name tests that are there.

use std::fs;
use std::path::Path;

/// The text of all sources below `directory`.
fn sources(directory: &Path, all: &mut String) {
    for entry in fs::read_dir(directory).expect("a directory of the project") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() && name != "target" && name != "dist" && !name.starts_with('.') {
            sources(&path, all);
        } else if name.ends_with(".rs") || name.ends_with(".py") {
            all.push_str(&fs::read_to_string(&path).expect("a source file"));
        }
    }
}

/// The rows of the tables of a page of the book.
fn rows(page: &str, heading: &str) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(root.join("book").join(page)).expect("the page");
    let rows = page.lines().filter(|line| line.starts_with("| ") && !line.starts_with(heading));
    rows.filter(|line| !line.starts_with("| ---")).map(String::from).collect()
}

/// The tests that rows name and that are nowhere.
fn missing(rows: &[String]) -> Vec<&str> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut code = String::new();
    for part in ["fmu", "modelDescription", "harness", "tests"] {
        sources(&root.join(part), &mut code);
    }
    let named = rows.iter().flat_map(|row| named(row));
    named
        .filter(|name| {
            !code.contains(&format!("fn {name}(")) && !code.contains(&format!("def {name}("))
        })
        .collect()
}

/// Code in a row of the pages; single words, shorter than a test's name, are code.
fn named(row: &str) -> impl Iterator<Item = &str> {
    row.split('`').skip(1).step_by(2).filter(|name| name.contains('_'))
}

#[test]
fn every_test_that_the_checklist_names_is_there() {
    let rows = rows("checklist.md", "| asked");
    assert!(rows.len() >= 26, "{} rows are left", rows.len());
    for row in &rows {
        assert!(named(row).next().is_some(), "no test: {row}");
    }
    assert_eq!(missing(&rows), [""; 0]);
}

/// 88 demands, and twenty ways to misbehave.
#[test]
fn every_line_of_the_checklist_of_fmi_3_has_a_test_that_is_there_or_a_reason() {
    let rows = rows("fmi3_checklist.md", "| no.");
    let mut numbers = Vec::new();
    for row in &rows {
        let [_, number, _, shown, _] = *row.split('|').collect::<Vec<_>>() else {
            panic!("no row of three: {row}")
        };
        let shown = shown.trim();
        let reason = shown.strip_prefix("none: ").is_some_and(|why| !why.is_empty());
        let the_line_above = shown.starts_with("the same, and");
        assert!(named(row).next().is_some() || reason || the_line_above, "neither: {row}");
        numbers.extend(number.split(',').map(|number| number.trim().to_string()));
    }
    let expected = (1..=88).map(|n| n.to_string()).chain((1..=20).map(|n| format!("B{n}")));
    assert_eq!(numbers, expected.collect::<Vec<_>>());
    assert_eq!(missing(&rows), [""; 0]);
}

//! The page of what hosts ask names tests that are there.

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

#[test]
fn every_test_that_the_checklist_names_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = fs::read_to_string(root.join("book/checklist.md")).expect("the page");
    let mut code = String::new();
    for part in ["fmu", "modelDescription", "harness", "tests"] {
        sources(&root.join(part), &mut code);
    }
    let rows = page.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| asked"));
    let rows: Vec<&str> = rows.filter(|line| !line.starts_with("| ---")).collect();
    assert!(rows.len() >= 26, "{} rows are left", rows.len());
    let mut missing = Vec::new();
    for row in rows {
        let tests: Vec<&str> = row.split('`').skip(1).step_by(2).collect();
        assert!(!tests.is_empty(), "no test: {row}");
        missing.extend(tests.into_iter().filter(|name| {
            !code.contains(&format!("fn {name}(")) && !code.contains(&format!("def {name}("))
        }));
    }
    assert!(missing.is_empty(), "no such tests: {}", missing.join(", "));
}

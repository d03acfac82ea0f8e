use std::path::{Path, PathBuf};

use pack::documentation::page::{Gathered, Page};

pub fn markdown() -> Vec<String> {
    fn collect_pages(folder: &Path, all: &mut Vec<PathBuf>) {
        for entry in folder.read_dir().unwrap().flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            let name = name.to_string_lossy();
            // skips files that were built, and texts of other projects in virtual environments
            if name.starts_with('.') && name != ".ci" || ["target", "dist"].contains(&&*name) {
                continue;
            }
            if path.is_dir() {
                collect_pages(&path, all);
            } else if name.ends_with(".md") {
                all.push(path);
            }
        }
    }
    let (root, mut all) = (pack::root(), Vec::new());
    collect_pages(&root, &mut all);
    all.iter().map(|path| path.strip_prefix(&root).unwrap().to_string_lossy().into()).collect()
}

#[test]
fn no_link_no_figure_and_no_equation_of_any_markdown_file_is_broken() {
    let root = pack::root();
    let pages: Vec<_> = markdown().iter().map(|path| Page::read(&root, path).unwrap()).collect();
    assert!(pages.iter().any(|page| page.path == "README.md"));
    let mut all = Gathered::default();
    for page in &pages {
        page.html(&root, &pages, &mut all);
    }
    assert!(all.faults.is_empty(), "{:#?}", all.faults);
}

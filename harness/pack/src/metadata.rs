//! The core metadata of the Python package, version 2.4 (packaging.python.org, "Core metadata specifications"). The data
//! come from `[project]` in pyproject.toml, from Cargo.toml (version, authors, licence, repository) and from README.md.

use std::ops::Range;

use anyhow::{Context, Result};
use pulldown_cmark::{Event, Options, Parser, Tag};
use toml::{Table, Value};

use crate::archive::read;
use crate::root;

pub const PACKAGE: &str = "hubslosh";
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
pub const REPOSITORY: &str = env!("CARGO_PKG_REPOSITORY");
pub const LICENSES: [&str; 2] = ["LICENSE-APACHE", "LICENSE-MIT"];
/// Name of the file in a wheel with the licences and notices of all components that are linked into
/// its command.
pub const NOTICES: &str = "THIRD-PARTY.txt";

pub fn text() -> Result<String> {
    let project = read(&root().join("harness/python/pyproject.toml"))?;
    let readme = String::from_utf8(read(&root().join("README.md"))?).context("README.md")?;
    compose(&String::from_utf8(project)?.parse()?, &readme).context("pyproject.toml")
}

fn compose(pyproject: &Table, readme: &str) -> Result<String> {
    let project = pyproject
        .get("project")
        .and_then(Value::as_table)
        .context("the file has no table [project]")?;
    let text = |key: &str| {
        project.get(key).and_then(Value::as_str).with_context(|| format!("[project] has no {key}"))
    };
    let list = |value: &Value| -> Vec<String> {
        let values = value.as_array().into_iter().flatten();
        values.filter_map(Value::as_str).map(String::from).collect()
    };
    let of = |key: &str| project.get(key).map(list).unwrap_or_default();
    let mut lines = vec![
        "Metadata-Version: 2.4".to_string(),
        format!("Name: {}", text("name")?),
        format!("Version: {VERSION}"),
        format!("Summary: {}", text("description")?),
        format!("Keywords: {}", of("keywords").join(",")),
        format!("Author: {}", env!("CARGO_PKG_AUTHORS").replace(':', ", ")),
        format!("License-Expression: {}", env!("CARGO_PKG_LICENSE")),
    ];
    lines.extend(LICENSES.map(|license| format!("License-File: {license}")));
    lines.extend(of("classifiers").iter().map(|classifier| format!("Classifier: {classifier}")));
    for (name, page) in [
        ("Source", ""),
        ("Documentation", "/blob/main/book/index.md"),
        ("Changelog", "/blob/main/CHANGELOG.md"),
        ("Issues", "/issues"),
    ] {
        lines.push(format!("Project-URL: {name}, {REPOSITORY}{page}"));
    }
    lines.push(format!("Requires-Python: {}", text("requires-python")?));
    lines.extend(of("dependencies").iter().map(|needed| format!("Requires-Dist: {needed}")));
    let extras = project.get("optional-dependencies").and_then(Value::as_table);
    for (extra, packages) in extras.into_iter().flatten() {
        lines.push(format!("Provides-Extra: {extra}"));
        let packages = list(packages).into_iter();
        lines.extend(
            packages.map(|package| format!("Requires-Dist: {package}; extra == '{extra}'")),
        );
    }
    lines.push("Description-Content-Type: text/markdown; variant=GFM".to_string());
    Ok(format!("{}\n\n{}", lines.join("\n"), published(readme)))
}

/// Rewrites the links of a Markdown page so that they also work outside the project, for example on
/// a package index: links to files of the project lead to the repository at this version.
fn published(page: &str) -> String {
    let mut changes: Vec<(Range<usize>, String)> = Vec::new();
    for (event, range) in Parser::new_ext(page, Options::ENABLE_TABLES).into_offset_iter() {
        let (to, raw) = match event {
            Event::Start(Tag::Link { dest_url, .. }) => (dest_url, "blob"),
            Event::Start(Tag::Image { dest_url, .. }) => (dest_url, "raw"),
            // <img src="…" …>
            Event::Html(_) | Event::InlineHtml(_) => {
                if let Some(place) = page[range.clone()].find(" src=\"") {
                    let start = range.start + place + " src=\"".len();
                    if !page[start..].starts_with("https://") {
                        changes.push((start..start, format!("{REPOSITORY}/raw/v{VERSION}/")));
                    }
                }
                continue;
            }
            _ => continue,
        };
        // The last "](…" in the range of the link is its own, because links inside the text of the link end earlier.
        let written = format!("]({to}");
        if !to.contains("://")
            && !to.starts_with('#')
            && let Some(place) = page[range.clone()].rfind(&written)
        {
            let start = range.start + place + "](".len();
            let address = format!("{REPOSITORY}/{raw}/v{VERSION}/{to}");
            changes.push((start..start + to.len(), address));
        }
    }
    // The parser reports an image inside a link after the link, but the image comes before the end of the link.
    changes.sort_by_key(|(range, _)| range.start);
    let mut published = page.to_string();
    for (range, address) in changes.into_iter().rev() {
        published.replace_range(range, &address);
    }
    published
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheel_metadata_has_all_fields_that_pip_and_a_package_index_need() {
        let pyproject = r#"
            [project]
            name = "hubslosh"
            description = "Slosh"
            keywords = ["slosh", "FMI"]
            requires-python = ">=3.11"
            classifiers = ["Topic :: Scientific/Engineering"]
            dependencies = ["numpy>=2", "scipy"]
            [project.optional-dependencies]
            plot = ["matplotlib"]
        "#;
        let said = compose(&pyproject.parse().unwrap(), "# Slosh\n").unwrap();
        for line in [
            "Name: hubslosh",
            "Keywords: slosh,FMI",
            "License-Expression: MIT OR Apache-2.0",
            "Classifier: Topic :: Scientific/Engineering",
            &format!("Project-URL: Source, {REPOSITORY}"),
            "Requires-Dist: scipy",
            "Provides-Extra: plot",
            "Requires-Dist: matplotlib; extra == 'plot'",
            "# Slosh",
        ] {
            assert!(said.lines().any(|there| there == line), "{line} in\n{said}");
        }
        let error = compose(&"[project]\nname = \"x\"".parse().unwrap(), "").unwrap_err();
        assert_eq!(error.to_string(), "[project] has no description");
    }

    #[test]
    fn wheel_metadata_links_files_to_the_repository_and_keeps_other_links() {
        let page = "See [a](b.md#c), [d](https://e.org), [f](#f).\n\n| [g](h/) |\n| --- |\n| x |\n\n\
                    [![i](j.svg)](k.html) `[l](m)`\n\n<img src=\"n.png\" width=\"9\">\n";
        let (blob, raw) =
            (format!("{REPOSITORY}/blob/v{VERSION}"), format!("{REPOSITORY}/raw/v{VERSION}"));
        assert_eq!(
            published(page),
            format!(
                "See [a]({blob}/b.md#c), [d](https://e.org), [f](#f).\n\n| [g]({blob}/h/) |\n| --- |\n| x |\n\n\
                 [![i]({raw}/j.svg)]({blob}/k.html) `[l](m)`\n\n\
                 <img src=\"{raw}/n.png\" width=\"9\">\n"
            )
        );
    }
}

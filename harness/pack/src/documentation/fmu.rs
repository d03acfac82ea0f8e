//! Renders `documentation/index.html` of an FMU: its introduction, and the pages that the introduction lists, as one
//! file. Only the figures are separate files, in the same folder.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::page::{Gathered, Page};

pub struct Documentation {
    pub page: String,
    pub figures: BTreeMap<String, Vec<u8>>,
}

/// Renders the page `introduction`, and all pages to which its lists link, as one page of HTML with
/// the title `title`. Paths are relative to `root`.
///
/// # Errors
///
/// All broken links, missing figures and equations that are not LaTeX.
pub fn render(root: &Path, introduction: &str, title: &str) -> Result<Documentation> {
    let first = Page::read(root, introduction)?;
    let listed = first.listed();
    let mut pages = vec![first];
    for path in listed {
        pages.push(Page::read(root, &path)?);
    }
    let mut all = Gathered::default();
    let page = single_page(root, &pages, title, &mut all).into_string();
    Ok(Documentation { page, figures: all.figures()? })
}

fn single_page(root: &Path, pages: &[Page], title: &str, all: &mut Gathered) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) }
                style { (PreEscaped(super::CSS)) }
            }
            body {
                nav {
                    p { (title) }
                    ul {
                        @for page in pages {
                            li {
                                a href=(page.address("")) { (page.title) }
                                ul {
                                    @for heading in page.chapters() {
                                        @let address = page.address(&heading.slug);
                                        li { a href=(address) { (heading.title) } }
                                    }
                                }
                            }
                        }
                    }
                }
                main {
                    @for page in pages {
                        section id=(page.id("")) { (page.html(root, pages, all)) }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        folder
    }

    #[test]
    fn links_between_documentation_pages_become_links_within_the_single_page() {
        let folder = folder(&[
            ("m/index.md", "# All\n\nSee [b](b.md#two-words).\n\n* [c](../c.md)\n* [b](b.md)\n"),
            ("m/b.md", "# B\n\n## Two `words`\n\n[up](#b) and [out](../README.md)\n"),
            ("c.md", "# C\n\n<!-- no one reads this -->\n![x](m/x.svg)\n"),
            ("m/x.svg", "<svg/>"),
            ("README.md", "# Not listed\n"),
        ]);
        let made = render(folder.path(), "m/index.md", "T").unwrap();
        assert!(made.page.contains("<a href=\"#m-b--two-words\">b</a>"), "{}", made.page);
        assert!(made.page.contains("<h2 id=\"m-b--two-words\">"));
        assert!(made.page.contains("<a href=\"#m-b--b\">up</a> and out<"));
        assert!(!made.page.contains("no one reads this"));
        assert!(made.page.find("id=\"c\"") < made.page.find("id=\"m-b\""), "the order of the list");
        assert_eq!(made.figures["x.svg"], b"<svg/>");
    }

    #[test]
    fn rendering_the_documentation_names_dead_links_and_missing_figures() {
        let folder = folder(&[(
            "index.md",
            "# A\n\n[1](gone.md) [2](#nothing) ![3](none.svg) [4](index.md#a)\n",
        )]);
        let error = render(folder.path(), "index.md", "T").err().unwrap().to_string();
        for word in ["gone.md", "#nothing", "none.svg"] {
            assert!(error.contains(word), "{word}: {error}");
        }
        assert!(!error.contains("index.md#a"), "{error}");
    }
}

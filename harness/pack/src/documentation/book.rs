//! The book: all documentation as a static site with a search that needs no server.
//!
//! `book/SUMMARY.md` lists parts (headings) and pages (list items), in the form of mdBook. A page may
//! be anywhere in the project.

use std::path::Path;

use anyhow::{Context, Result, bail};
use files::output;
use maud::{DOCTYPE, Markup, html};
use serde_json::json;

use super::Files;
use super::fmu::one_file;
use super::page::{Gathered, Layout, Page};

/// The list of parts and pages, from the project's root.
const SUMMARY: &str = "book/SUMMARY.md";

/// A part of the book: its name and its pages, as places in the list of all.
struct Part {
    name: String,
    pages: Vec<usize>,
}

/// Writes a rendered book into a directory.
///
/// # Errors
/// If a file cannot be written.
pub fn write(files: &Files, out: &Path) -> Result<()> {
    output::directory(out)?;
    for (name, bytes) in files {
        output::write(&out.join(name), bytes)?;
    }
    Ok(())
}

/// Renders the book as the files of a static site.
///
/// # Errors
/// With every link that leads nowhere, every missing figure and every equation that is not LaTeX.
pub fn render(root: &Path) -> Result<Files> {
    let (parts, pages, titles) = read(root)?;
    let mut all = Gathered::default();
    let mut files = Files::new();
    for (place, page) in pages.iter().enumerate() {
        let body = page.html(root, &pages, Layout::Site, &mut all);
        let navigation = navigation(&parts, &pages, &titles, place);
        let neighbours = neighbours(&pages, &titles, place);
        let html = site_page(&titles[place], &navigation, &body, &neighbours).into_string();
        files.push((format!("{}.html", page.name), html.into_bytes()));
    }
    let whole = one_file(root, &pages, "HubSlosh: the whole book", &mut all);
    files.push(("print.html".into(), whole.into_string().into_bytes()));
    files.push(("page.css".into(), super::CSS.into()));
    files.push(("search.js".into(), include_bytes!("search.js").to_vec()));
    files.push(("search-index.js".into(), search_index(&pages, &titles)?.into_bytes()));
    files.extend(all.figures()?);
    Ok(files)
}

/// Parts, pages and the pages' titles in the list.
fn read(root: &Path) -> Result<(Vec<Part>, Vec<Page>, Vec<String>)> {
    let text = std::fs::read_to_string(root.join(SUMMARY))
        .with_context(|| format!("{SUMMARY} cannot be read"))?;
    let (mut parts, mut pages, mut titles) = (Vec::<Part>::new(), Vec::new(), Vec::new());
    for line in text.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix("# ") {
            parts.push(Part { name: name.into(), pages: Vec::new() });
        } else if let Some((title, path)) = link(line) {
            let part =
                parts.last_mut().with_context(|| format!("{SUMMARY}: no part before {line}"))?;
            part.pages.push(pages.len());
            let page = Page::read(root, &super::page::resolve(SUMMARY, path))?;
            if let Some(other) = pages.iter().find(|other: &&Page| other.name == page.name) {
                bail!("{SUMMARY}: {} and {} have one name", other.path, page.path);
            }
            pages.push(page);
            titles.push(title.into());
        }
    }
    Ok((parts, pages, titles))
}

/// Title and path of `- [title](path)`.
fn link(line: &str) -> Option<(&str, &str)> {
    let (title, path) = line.strip_prefix("- [")?.split_once("](")?;
    Some((title, path.strip_suffix(')')?))
}

/// The list of all pages; of the present one the headings too.
fn navigation(parts: &[Part], pages: &[Page], titles: &[String], present: usize) -> Markup {
    html! {
        @for part in parts {
            p { (part.name) }
            ul {
                @for &place in &part.pages {
                    @let here = place == present;
                    @let address = Layout::Site.address(&pages[place], "");
                    li {
                        a aria-current=[here.then_some("page")] href=(address) { (titles[place]) }
                        @if here {
                            ul {
                                @for heading in pages[place].chapters() {
                                    li { a href={ "#" (heading.slug) } { (heading.title) } }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Links to the page before and the page after.
fn neighbours(pages: &[Page], titles: &[String], present: usize) -> Markup {
    let link = |place: Option<usize>, class: &str| {
        let neighbour = place.and_then(|place| pages.get(place).zip(titles.get(place)));
        html! {
            @if let Some((page, title)) = neighbour {
                a class=(class) href=(Layout::Site.address(page, "")) { (title) }
            }
        }
    };
    html! { (link(present.checked_sub(1), "before")) (link(Some(present + 1), "after")) }
}

fn site_page(title: &str, navigation: &Markup, body: &Markup, neighbours: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) " · HubSlosh" }
                link rel="stylesheet" href="page.css";
            }
            body .site {
                input type="checkbox" id="menu" aria-label="Contents";
                label for="menu" { "Contents" }
                nav {
                    input type="search" id="search" placeholder="Search" aria-label="Search"
                        autocomplete="off" spellcheck="false";
                    ol #found {}
                    div #pages {
                        (navigation)
                        p { a href="print.html" { "The whole book on one page, to print" } }
                    }
                }
                main { (body) footer { (neighbours) } }
                script src="search-index.js" defer {}
                script src="search.js" defer {}
            }
        }
    }
}

/// The words of every section: a script, because a page opened from the disk may load no data. Pages have
/// their titles in the list of all, which tells those of several FMUs apart.
fn search_index(pages: &[Page], titles: &[String]) -> Result<String> {
    let mut sections = Vec::new();
    for (page, title) in pages.iter().zip(titles) {
        for section in page.sections() {
            let title = match section.slug.as_str() {
                _ if section.title == page.title => title.clone(),
                _ => format!("{title}: {}", section.title),
            };
            let address = Layout::Site.address(page, &section.slug);
            sections.push(json!({ "at": address, "title": title, "words": section.words }));
        }
    }
    let json = serde_json::to_string(&sections)?;
    Ok(format!("const SECTIONS = {};\n", web::json_in_script(&json)))
}

//! The book: all documentation as a static site with a search that needs no server.
//!
//! `book/SUMMARY.md` lists parts (headings) and pages (list items), in the form of mdBook. A page may
//! be anywhere in the project.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, bail};
use host::html::escape;
use host::output;
use serde_json::json;

use super::fmu::one_file;
use super::page::{Gathered, Layout, Page};

/// The list of parts and pages, from the project's root.
const SUMMARY: &str = "book/SUMMARY.md";

/// The book before it is written: name and content of each file.
pub type Files = Vec<(String, Vec<u8>)>;

/// A part of the book: its name and its pages, as places in the list of all.
struct Part {
    name: String,
    pages: Vec<usize>,
}

/// Writes the book into a directory.
///
/// # Errors
/// As [`render`], or if a file cannot be written.
pub fn write(root: &Path, out: &Path) -> Result<usize> {
    let files = render(root)?;
    output::directory(out)?;
    for (name, bytes) in &files {
        output::atomically(&out.join(name), |file| Ok(std::io::Write::write_all(file, bytes)?))?;
    }
    Ok(files.len())
}

/// Renders the book.
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
        let html = site_page(page, &navigation, &body, &neighbours(&pages, &titles, place));
        files.push((format!("{}.html", page.name), html.into_bytes()));
    }
    let whole = one_file(root, &pages, "HubSlosh: the whole book", &mut all);
    files.push(("print.html".into(), whole.into_bytes()));
    files.push(("page.css".into(), super::CSS.into()));
    files.push(("search.js".into(), include_bytes!("search.js").to_vec()));
    files.push(("search-index.js".into(), search_index(&pages)?.into_bytes()));
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
fn navigation(parts: &[Part], pages: &[Page], titles: &[String], present: usize) -> String {
    let mut list = String::new();
    for part in parts {
        let _ = write!(list, "<p>{}</p>\n<ul>\n", escape(&part.name));
        for &place in &part.pages {
            let (page, title) = (&pages[place], escape(&titles[place]));
            let address = Layout::Site.address(page, "");
            if place != present {
                let _ = writeln!(list, "<li><a href=\"{address}\">{title}</a></li>");
                continue;
            }
            let _ = write!(list, "<li><a aria-current=\"page\" href=\"{address}\">{title}</a><ul>");
            for heading in page.headings.iter().filter(|heading| heading.level == 2) {
                let (slug, title) = (escape(&heading.slug), escape(&heading.title));
                let _ = write!(list, "<li><a href=\"#{slug}\">{title}</a></li>");
            }
            list.push_str("</ul></li>\n");
        }
        list.push_str("</ul>\n");
    }
    list
}

/// Links to the page before and the page after.
fn neighbours(pages: &[Page], titles: &[String], present: usize) -> String {
    let link = |place: Option<usize>, class: &str| {
        let Some((page, title)) = place.and_then(|p| Some((pages.get(p)?, titles.get(p)?))) else {
            return String::new();
        };
        let (address, title) = (Layout::Site.address(page, ""), escape(title));
        format!("<a class=\"{class}\" href=\"{address}\">{title}</a>")
    };
    link(present.checked_sub(1), "before") + &link(Some(present + 1), "after")
}

fn site_page(page: &Page, navigation: &str, body: &str, neighbours: &str) -> String {
    let title = escape(&page.title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title} · HubSlosh</title>\n\
         <link rel=\"stylesheet\" href=\"page.css\"></head><body class=\"site\">\n\
         <input type=\"checkbox\" id=\"menu\" aria-label=\"Contents\"><label for=\"menu\">Contents</label>\n\
         <nav><input type=\"search\" id=\"search\" placeholder=\"Search\" aria-label=\"Search\" \
         autocomplete=\"off\" spellcheck=\"false\">\n\
         <ol id=\"found\"></ol>\n<div id=\"pages\">\n{navigation}\
         <p><a href=\"print.html\">The whole book on one page, to print</a></p></div></nav>\n\
         <main>\n{body}<footer>{neighbours}</footer>\n</main>\n\
         <script src=\"search-index.js\" defer></script><script src=\"search.js\" defer></script>\
         </body></html>\n"
    )
}

/// The words of every section: a script, because a page opened from the disk may load no data.
fn search_index(pages: &[Page]) -> Result<String> {
    let mut sections = Vec::new();
    for page in pages {
        for section in page.sections() {
            let title = match section.slug.as_str() {
                _ if section.title == page.title => page.title.clone(),
                _ => format!("{}: {}", page.title, section.title),
            };
            let address = Layout::Site.address(page, &section.slug);
            sections.push(json!({ "at": address, "title": title, "words": section.words }));
        }
    }
    Ok(format!("const SECTIONS = {};\n", serde_json::to_string(&sections)?))
}

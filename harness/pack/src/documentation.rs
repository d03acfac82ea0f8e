//! `documentation/index.html` of the FMU: the pages of modelDescription/HubSlosh/documentation, as
//! one page with everything in it but its figures, which lie beside it.
//!
//! The order is that of the list in index.md; a page that is not in it comes after.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result, bail};
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd, html};

use host::html::escape;

/// The page that comes first.
const FIRST: &str = "index";

/// What the FMU holds below `documentation/`.
pub struct Documentation {
    /// `index.html`.
    pub page: String,
    /// The figures it shows: name and content.
    pub figures: Vec<(String, Vec<u8>)>,
}

/// One Markdown file.
struct Page {
    /// Its name without the ending.
    name: String,
    text: String,
}

/// Renders all pages of a folder under a title. Fails with every link that leads nowhere and
/// every figure that is missing.
pub fn render(folder: &Path, title: &str) -> Result<Documentation> {
    let pages = read(folder)?;
    let anchors: BTreeSet<String> = pages
        .iter()
        .flat_map(|page| {
            let headings = headings(page).into_iter().map(|heading| heading.anchor);
            headings.chain([page.name.clone()])
        })
        .collect();
    let (mut navigation, mut body) = (String::new(), String::new());
    let (mut faults, mut figures) = (Vec::new(), BTreeMap::new());
    for page in &pages {
        contents(page, &mut navigation);
        let _ = writeln!(body, "<section id=\"{}\">", page.name);
        let mut headings = headings(page).into_iter();
        let mut dropped = false; // inside a link that leads out of the documentation
        let events = events(page).into_iter().filter_map(|event| match event {
            Event::Start(Tag::Heading { level, classes, attrs, .. }) => {
                let id = headings.next().map(|heading| CowStr::from(heading.anchor));
                Some(Event::Start(Tag::Heading { level, id, classes, attrs }))
            }
            Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
                let Some(anchor) = anchor(page, &dest_url) else {
                    dropped = true;
                    return None;
                };
                if !anchors.contains(&anchor) {
                    faults.push(format!("{}.md: the link {dest_url} leads nowhere", page.name));
                }
                let dest_url = format!("#{anchor}").into();
                Some(Event::Start(Tag::Link { link_type, dest_url, title, id }))
            }
            Event::End(TagEnd::Link) if std::mem::take(&mut dropped) => None,
            Event::Start(Tag::Image { link_type, dest_url, title, id }) => {
                match std::fs::read(folder.join(&*dest_url)) {
                    Ok(bytes) => _ = figures.insert(dest_url.to_string(), bytes),
                    Err(e) => faults.push(format!("{}.md: figure {dest_url}: {e}", page.name)),
                }
                Some(Event::Start(Tag::Image { link_type, dest_url, title, id }))
            }
            Event::Start(Tag::Table(_)) => Some(Event::Html("<div class=\"wide\"><table>".into())),
            Event::End(TagEnd::Table) => Some(Event::Html("</tbody></table></div>\n".into())),
            // remarks for those who edit the page
            Event::Html(text) if text.trim_start().starts_with("<!--") => None,
            other => Some(other),
        });
        html::push_html(&mut body, events);
        body.push_str("</section>\n");
    }
    if !faults.is_empty() {
        bail!("the documentation in {} is not whole: {}", folder.display(), faults.join("; "));
    }
    let page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
         <style>\n{css}</style></head><body>\n<nav><p>{title}</p>\n<ul>\n{navigation}</ul></nav>\n\
         <main>\n{body}</main></body></html>\n",
        title = escape(title),
        css = include_str!("documentation.css"),
    );
    Ok(Documentation { page, figures: figures.into_iter().collect() })
}

/// The pages in their order.
fn read(folder: &Path) -> Result<Vec<Page>> {
    let cannot = || format!("the documentation in {} cannot be read", folder.display());
    let mut pages = Vec::new();
    for entry in folder.read_dir().with_context(cannot)? {
        let path = entry.with_context(cannot)?.path();
        if path.extension().is_some_and(|ending| ending == "md") {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            pages.push(Page { name, text: std::fs::read_to_string(&path).with_context(cannot)? });
        }
    }
    let first = pages.iter().find(|page| page.name == FIRST);
    let first = first.with_context(|| format!("{FIRST}.md is missing in {}", folder.display()))?;
    let listed = listed(first);
    let place = |page: &Page| match page.name.as_str() {
        FIRST => 0,
        name => 1 + listed.iter().position(|linked| linked == name).unwrap_or(listed.len()),
    };
    pages.sort_by(|a, b| (place(a), &a.name).cmp(&(place(b), &b.name)));
    Ok(pages)
}

/// The pages in the lists of a page, in their order.
fn listed(page: &Page) -> Vec<String> {
    let (mut items, mut names) = (0, Vec::new());
    for event in events(page) {
        match event {
            Event::Start(Tag::Item) => items += 1,
            Event::End(TagEnd::Item) => items -= 1,
            Event::Start(Tag::Link { dest_url, .. }) if items > 0 => {
                names.extend(dest_url.strip_suffix(".md").map(String::from));
            }
            _ => {}
        }
    }
    names
}

/// What the Markdown says.
fn events(page: &Page) -> Vec<Event<'_>> {
    Parser::new_ext(&page.text, Options::ENABLE_TABLES).collect()
}

struct Heading {
    /// 1 for the page's title.
    level: usize,
    title: String,
    anchor: String,
}

/// The headings of a page with their anchors: the page's name and what GitHub makes of the
/// heading, so that a link works here as it does there.
fn headings(page: &Page) -> Vec<Heading> {
    let mut all: Vec<Heading> = Vec::new();
    let mut open = false;
    for event in events(page) {
        match event {
            Event::Start(Tag::Heading { level, .. }) => {
                open = true;
                let (title, anchor) = (String::new(), String::new());
                all.push(Heading { level: level as usize, title, anchor });
            }
            Event::End(TagEnd::Heading(_)) => open = false,
            Event::Text(text) | Event::Code(text) if open => {
                if let Some(heading) = all.last_mut() {
                    heading.title.push_str(&text);
                }
            }
            _ => {}
        }
    }
    for heading in &mut all {
        heading.anchor = format!("{}-{}", page.name, slug(&heading.title));
    }
    all
}

/// A heading as GitHub writes it into an address.
fn slug(title: &str) -> String {
    let kept = title.to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// The anchor that a link of a page leads to; `None` if it leads out of the documentation.
fn anchor(page: &Page, link: &str) -> Option<String> {
    let (file, heading) = link.split_once('#').unwrap_or((link, ""));
    let name = if file.is_empty() { &page.name } else { file.strip_suffix(".md")? };
    match (name.contains(['/', ':']), heading) {
        (true, _) => None,
        (false, "") => Some(name.into()),
        (false, heading) => Some(format!("{name}-{heading}")),
    }
}

/// A page's entries in the list of contents.
fn contents(page: &Page, list: &mut String) {
    let headings = headings(page);
    let title = headings.first().map_or(page.name.as_str(), |heading| &heading.title);
    let _ = write!(list, "<li><a href=\"#{}\">{}</a><ul>", page.name, escape(title));
    for heading in headings.iter().filter(|heading| heading.level == 2) {
        let _ = write!(
            list,
            "<li><a href=\"#{}\">{}</a></li>",
            escape(&heading.anchor),
            escape(&heading.title)
        );
    }
    list.push_str("</ul></li>\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    #[test]
    fn links_between_pages_become_links_within_the_page() {
        let folder = folder(&[
            ("index.md", "# All\n\nSee [b](b.md#two-words).\n\n* [c](c.md)\n* [b](b.md)\n"),
            ("b.md", "# B\n\n## Two `words`\n\n[up](#b) and [out](../../README.md)\n"),
            ("c.md", "# C\n\n<!-- no one reads this -->\n![x](x.svg)\n"),
            ("x.svg", "<svg/>"),
        ]);
        let made = render(folder.path(), "T").unwrap();
        assert!(made.page.contains("<a href=\"#b-two-words\">b</a>"), "{}", made.page);
        assert!(made.page.contains("<h2 id=\"b-two-words\">"));
        assert!(made.page.contains("<a href=\"#b-b\">up</a> and out<"));
        assert!(!made.page.contains("no one reads this"));
        assert!(made.page.find("id=\"c\"") < made.page.find("id=\"b\""), "the order of the list");
        assert_eq!(made.figures, [("x.svg".to_string(), b"<svg/>".to_vec())]);
    }

    #[test]
    fn every_dead_link_and_missing_figure_is_named() {
        let folder = folder(&[(
            "index.md",
            "# A\n\n[1](gone.md) [2](#nothing) ![3](none.svg) [4](index.md#a)\n",
        )]);
        let error = render(folder.path(), "T").err().unwrap().to_string();
        for word in ["gone.md", "#nothing", "none.svg"] {
            assert!(error.contains(word), "{word}: {error}");
        }
        assert!(!error.contains("index.md#a"), "{error}");
    }
}

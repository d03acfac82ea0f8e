//! A Markdown file: its headings, links, figures and equations.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use maud::{Markup, PreEscaped, html};
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd};
use pulldown_latex::config::{DisplayMode, RenderConfig};

#[derive(Debug)]
pub struct Page {
    pub path: String,
    /// Short name of the page, with which its anchors begin, for example `hubslosh-model` for
    /// `modelDescription/HubSlosh/documentation/model.md`.
    pub name: String,
    pub title: String,
    pub headings: Vec<Heading>,
    text: String,
}

#[derive(Debug)]
pub struct Heading {
    pub level: usize,
    pub title: String,
    pub slug: String,
}

#[derive(Debug, Default)]
pub struct Gathered {
    pub figures: BTreeMap<String, Vec<u8>>,
    pub faults: Vec<String>,
}

impl Gathered {
    /// Returns the figures of all pages by file name, after the pages have been rendered.
    ///
    /// # Errors
    /// All faults that were found while the pages were rendered, if there are any.
    pub fn figures(mut self) -> Result<BTreeMap<String, Vec<u8>>> {
        self.faults.sort();
        self.faults.dedup(); // pages are rendered more than once
        if !self.faults.is_empty() {
            bail!("the documentation has faults: {}", self.faults.join("; "));
        }
        Ok(self.figures)
    }
}

impl Page {
    /// Returns the `id` of the heading `slug` of this page in the file with all pages. If `slug` is
    /// empty, it is the `id` of the page itself.
    pub fn id(&self, slug: &str) -> String {
        if slug.is_empty() { self.name.clone() } else { format!("{}--{slug}", self.name) }
    }

    pub fn address(&self, slug: &str) -> String {
        format!("#{}", self.id(slug))
    }

    pub fn read(root: &Path, path: &str) -> Result<Self> {
        let text = std::fs::read_to_string(root.join(path))
            .with_context(|| format!("the documentation's page {path} cannot be read"))?;
        let mut page = Page {
            path: path.into(),
            name: name(path),
            title: String::new(),
            headings: headings(&text),
            text,
        };
        page.title = page.headings.first().map_or_else(|| page.name.clone(), |h| h.title.clone());
        Ok(page)
    }

    /// Returns the paths of the Markdown pages to which the bulleted and numbered lists of this
    /// page link, relative to the project's root and in the order of the links.
    pub fn listed(&self) -> Vec<String> {
        let (mut items, mut paths) = (0, Vec::new());
        for event in events(&self.text) {
            match event {
                Event::Start(Tag::Item) => items += 1,
                Event::End(TagEnd::Item) => items -= 1,
                Event::Start(Tag::Link { dest_url, .. })
                    if items > 0 && dest_url.ends_with(".md") && !dest_url.contains("://") =>
                {
                    paths.push(resolve(&self.path, &dest_url));
                }
                _ => {}
            }
        }
        paths
    }

    pub fn chapters(&self) -> impl Iterator<Item = &Heading> {
        self.headings.iter().filter(|heading| heading.level == 2)
    }

    /// Renders the page as HTML for a file with all `pages`. Links to other pages lead to their
    /// places in this file. Of a link to another file of the project only the text is kept, because
    /// the reader may not have that file. `all` collects figures and faults.
    pub fn html(&self, root: &Path, pages: &[Page], all: &mut Gathered) -> Markup {
        let mut headings = self.headings.iter();
        let mut dropped = false; // inside a link that leads out of the documentation
        let events = events(&self.text).filter_map(|event| match event {
            Event::Start(Tag::Heading { level, classes, attrs, .. }) => {
                let id = headings.next().map(|h| CowStr::from(self.id(&h.slug)));
                Some(Event::Start(Tag::Heading { level, id, classes, attrs }))
            }
            Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
                match self.target(root, pages, &dest_url) {
                    Ok(Some(address)) => {
                        let dest_url = address.into();
                        return Some(Event::Start(Tag::Link { link_type, dest_url, title, id }));
                    }
                    Ok(None) => {}
                    Err(fault) => all.faults.push(fault.to_string()),
                }
                dropped = true;
                None
            }
            Event::End(TagEnd::Link) if std::mem::take(&mut dropped) => None,
            Event::Start(Tag::Image { link_type, dest_url, title, id }) => {
                let path = resolve(&self.path, &dest_url);
                let name = path.rsplit('/').next().unwrap_or_default().to_string();
                match std::fs::read(root.join(&path)) {
                    Ok(bytes) => {
                        let other = all.figures.insert(name.clone(), bytes.clone());
                        if other.is_some_and(|other| other != bytes) {
                            all.faults.push(format!("two figures have the name {name}"));
                        }
                    }
                    Err(e) => all.faults.push(format!("{}: figure {dest_url}: {e}", self.path)),
                }
                Some(Event::Start(Tag::Image { link_type, dest_url: name.into(), title, id }))
            }
            Event::Start(Tag::Table(_)) => Some(Event::Html("<div class=\"wide\"><table>".into())),
            Event::End(TagEnd::Table) => Some(Event::Html("</tbody></table></div>\n".into())),
            Event::InlineMath(latex) => Some(Event::InlineHtml(self.equation(&latex, false, all))),
            Event::DisplayMath(latex) => Some(Event::InlineHtml(self.equation(&latex, true, all))),
            // Comments are meant for people who edit the page.
            Event::Html(text) if text.trim_start().starts_with("<!--") => None,
            other => Some(other),
        });
        let mut page = String::new();
        pulldown_cmark::html::push_html(&mut page, events);
        PreEscaped(page)
    }

    /// Returns the address to which the link `link` of this page leads in the file with all
    /// `pages`, or `None` if it leads out of the documentation.
    ///
    /// # Errors
    /// If the target of the link does not exist.
    fn target(&self, root: &Path, pages: &[Page], link: &str) -> Result<Option<String>> {
        if link.contains("://") {
            return Ok(None);
        }
        let dead = || anyhow!("{}: the target of the link {link} does not exist", self.path);
        let (file, slug) = link.split_once('#').unwrap_or((link, ""));
        let path = if file.is_empty() { self.path.clone() } else { resolve(&self.path, file) };
        let Some(page) = pages.iter().find(|page| page.path == path) else {
            return if root.join(&path).exists() { Ok(None) } else { Err(dead()) };
        };
        if !slug.is_empty() && !page.headings.iter().any(|heading| heading.slug == slug) {
            return Err(dead());
        }
        Ok(Some(page.address(slug)))
    }

    fn equation<'a>(&self, latex: &str, block: bool, all: &mut Gathered) -> CowStr<'a> {
        let storage = pulldown_latex::Storage::new();
        let parsed: Result<Vec<_>, _> = pulldown_latex::Parser::new(latex, &storage).collect();
        let events = match parsed {
            Ok(events) => events,
            Err(error) => {
                all.faults.push(format!("{}: the equation {latex}: {error}", self.path));
                return CowStr::from("");
            }
        };
        let display_mode = if block { DisplayMode::Block } else { DisplayMode::Inline };
        let config = RenderConfig { display_mode, ..RenderConfig::default() };
        let mut mathml = String::new();
        let events = events.into_iter().map(Ok::<_, Infallible>);
        // Writing to a String cannot fail.
        let _ = pulldown_latex::push_mathml(&mut mathml, events, config);
        // works around a fault of pulldown-latex 0.8.0, which treats a space as the base of a superscript
        if ["<msup><mspace", "<msub><mspace", "&amp;nbsp;"]
            .iter()
            .any(|wrong| mathml.contains(wrong))
        {
            all.faults.push(format!(
                "{}: the equation {latex}: write {{\\sin}}^2 for \\sin^2, \\; for a backslash and a space",
                self.path
            ));
        }
        if block {
            mathml = html! { span .equation { (PreEscaped(mathml)) } }.into_string();
        }
        mathml.into()
    }
}

fn events(text: &str) -> impl Iterator<Item = Event<'_>> {
    Parser::new_ext(text, Options::ENABLE_TABLES | Options::ENABLE_MATH)
}

fn headings(text: &str) -> Vec<Heading> {
    let mut all: Vec<Heading> = Vec::new();
    let mut open = false;
    for event in events(text) {
        match event {
            Event::Start(Tag::Heading { level, .. }) => {
                open = true;
                let (title, slug) = (String::new(), String::new());
                all.push(Heading { level: level as usize, title, slug });
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
    let mut seen = BTreeMap::<String, usize>::new();
    for heading in &mut all {
        let slug = slug(&heading.title);
        let before = seen.entry(slug.clone()).or_default();
        heading.slug = if *before == 0 { slug } else { format!("{slug}-{before}") };
        *before += 1;
    }
    all
}

fn slug(title: &str) -> String {
    let kept = title.to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn name(path: &str) -> String {
    let common = ["modelDescription", "documentation", "book", "README"];
    let path = path.strip_suffix(".md").unwrap_or(path);
    let kept: Vec<_> = path.split('/').filter(|part| !common.contains(part)).collect();
    kept.join("-").to_lowercase()
}

fn resolve(from: &str, link: &str) -> String {
    let mut parts: Vec<&str> = from.split('/').collect();
    parts.pop();
    for part in link.split('/') {
        match part {
            "." | "" => {}
            ".." => _ = parts.pop(),
            part => parts.push(part),
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_resolved_relative_to_the_page_that_contains_them() {
        assert_eq!(resolve("a/b/c.md", "d.md"), "a/b/d.md");
        assert_eq!(resolve("a/b/c.md", "../../d.md"), "d.md");
        assert_eq!(resolve("c.md", "./a/d.md"), "a/d.md");
    }

    #[test]
    fn pages_of_different_fmus_have_different_short_names() {
        assert_eq!(name("modelDescription/HubSlosh/documentation/model.md"), "hubslosh-model");
        assert_eq!(name("modelDescription/Spacecraft/documentation/model.md"), "spacecraft-model");
        assert_eq!(name("book/campaigns.md"), "campaigns");
        assert_eq!(name("harness/tank/README.md"), "harness-tank");
        assert_eq!(name("ARCHITECTURE.md"), "architecture");
    }

    #[test]
    fn equal_headings_of_a_page_get_different_anchors() {
        let slugs: Vec<_> =
            headings("# A b\n\n## C\n\n## C\n").into_iter().map(|h| h.slug).collect();
        assert_eq!(slugs, ["a-b", "c", "c-1"]);
    }

    #[test]
    fn equations_become_mathml_and_a_broken_equation_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(
            folder.path().join("a.md"),
            "$\\xi_1$ and\n\n$$\\frac{1}{2}$$\n\n$\\nosuch$\n",
        )
        .unwrap();
        let page = Page::read(folder.path(), "a.md").unwrap();
        let mut all = Gathered::default();
        let html = page.html(folder.path(), &[], &mut all).into_string();
        assert!(html.contains("<msub><mi>ξ</mi><mn>1</mn></msub>"), "{html}");
        assert!(html.contains("display=\"block\"") && html.contains("<mfrac>"), "{html}");
        assert_eq!(all.faults.len(), 1);
        assert!(all.faults[0].contains("a.md: the equation \\nosuch"), "{:?}", all.faults);
    }
}

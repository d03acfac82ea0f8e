//! Rules about dangerous content of modelDescription.xml. A host parses this file before it knows anything about the FMU.

use host::xml::{Element, Fault};

use super::archive::Archive;
use super::findings::Findings;

const NAME: &str = "modelDescription.xml";

pub struct Doctype {
    pub line: usize,
    pub text: String,
}

impl Doctype {
    /// Finds the DOCTYPE of a file. Only the XML declaration, comments, processing instructions and white
    /// space may precede it. The bytes are searched directly, because a parser might refuse the file for
    /// other reasons.
    pub fn find(bytes: &[u8]) -> Option<Doctype> {
        let text = String::from_utf8_lossy(bytes);
        let mut rest = text.trim_start_matches('\u{feff}');
        loop {
            rest = rest.trim_start();
            if let Some(comment) = rest.strip_prefix("<!--") {
                rest = comment.split_once("-->")?.1;
            } else if let Some(instruction) = rest.strip_prefix("<?") {
                rest = instruction.split_once("?>")?.1;
            } else {
                break;
            }
        }
        if !rest.get(..9)?.eq_ignore_ascii_case("<!DOCTYPE") {
            return None;
        }
        let line = text[..text.len() - rest.len()].matches('\n').count() + 1;
        // The declaration ends after its internal subset, if it has one.
        let end = match rest.find(['[', '>']) {
            Some(at) if rest[at..].starts_with('[') => rest.find("]>").map(|at| at + 2),
            at => at.map(|at| at + 1),
        };
        Some(Doctype { line, text: rest[..end.unwrap_or(rest.len())].to_string() })
    }

    /// Describes, as the end of a sentence, what an XML parser does because of this DOCTYPE.
    pub fn parser_reaction(&self) -> &'static str {
        if self.text.contains("SYSTEM") || self.text.contains("PUBLIC") {
            "it makes a parser open another file or address"
        } else if self.text.contains("<!ENTITY") {
            "it defines entities, which can grow without bound"
        } else {
            "many parsers refuse it"
        }
    }
}

fn encoding(bytes: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(1000)]);
    let declaration = text.trim_start_matches('\u{feff}').strip_prefix("<?xml")?;
    let (declaration, _) = declaration.split_once("?>")?;
    let (_, value) = declaration.split_once("encoding")?;
    let value = value.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|quote| matches!(quote, '"' | '\''))?;
    Some(value[1..].split_once(quote)?.0.to_string())
}

pub fn utf8(archive: &Archive, findings: &mut Findings) {
    let Some(bytes) = archive.description_or_skip(findings) else { return };
    match encoding(bytes) {
        Some(encoding) if encoding.eq_ignore_ascii_case("UTF-8") => {}
        Some(other) => findings
            .at(format!("{NAME}, line 1"))
            .fail(format!("encoding=\"{other}\" (allowed: \"UTF-8\")")),
        None => findings
            .at(format!("{NAME}, line 1"))
            .warn("no encoding is declared (allowed: <?xml version=\"1.0\" encoding=\"UTF-8\"?>)"),
    }
}

pub fn doctype(archive: &Archive, findings: &mut Findings) {
    let Some(bytes) = archive.description_or_skip(findings) else { return };
    if let Some(doctype) = Doctype::find(bytes) {
        let start: String = doctype.text.chars().take(80).collect();
        let danger = doctype.parser_reaction();
        findings.at(format!("{NAME}, line {}", doctype.line)).add(format!(
            "{:?}: {danger} (allowed: no document type declaration and no entities but &lt; \
                 &gt; &amp; &quot; &apos; and character references)",
            start
        ));
    }
}

pub fn size(archive: &Archive, findings: &mut Findings) {
    let Some(bytes) = archive.description_or_skip(findings) else { return };
    if let Err(Fault::TooLarge(why)) = Element::parse(bytes) {
        findings.at(NAME).add(why);
    }
}

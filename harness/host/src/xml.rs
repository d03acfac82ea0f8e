//! Reads XML into a tree of elements with line numbers. The harness reads all XML with this module.

use std::borrow::Cow;

use roxmltree::{Document, Error, Node};

pub const DEEPEST: usize = 256;
/// Size of the largest XML file that is read, bytes. This and the following limits allow a hundred
/// thousand variables, whose description has 27 MB and takes 0.6 GB of memory.
pub const LONGEST: usize = 32 << 20;
pub const MOST: usize = 400_000;
pub const MOST_ATTRIBUTES: usize = 1_000_000;
pub const MOST_OF_ONE: usize = 200;
pub const LONGEST_NAME: usize = 1000;
/// Longest value of an attribute, bytes. The longest values in FMI are lists of dependencies.
pub const LONGEST_VALUE: usize = 1 << 20;
/// Largest number of XML namespaces that a file may declare. It is limited because the time to look
/// up a name grows with the number of namespaces.
pub const MOST_NAMESPACES: usize = 100;

/// Reason why an XML file is refused. All texts except `TooLarge` begin with the place, for example
/// `line 1, column 1: `.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    #[error("{0}")]
    Malformed(String),
    #[error("{0}")]
    TooLarge(String),
    /// The file has a document type declaration. It is refused because it can define entities that
    /// expand to huge texts, and can refer to other files.
    #[error("{0}")]
    Doctype(String),
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Element {
    pub name: Cow<'static, str>,
    pub line: u64,
    pub attributes: Vec<(Cow<'static, str>, Cow<'static, str>)>,
    pub children: Vec<Element>,
}

impl Element {
    /// Parses the XML file with the content `bytes` and returns its root element.
    ///
    /// # Errors
    ///
    /// If the file is not well-formed, not UTF-8, has a DOCTYPE, or exceeds a limit such as
    /// [`DEEPEST`]. The text begins with line and column.
    pub fn parse(bytes: &[u8]) -> Result<Element, Fault> {
        if bytes.len() > LONGEST {
            let length = bytes.len();
            return Err(Fault::TooLarge(format!(
                "the file has {length} bytes (allowed: {LONGEST})"
            )));
        }
        let text = std::str::from_utf8(bytes).map_err(|error| {
            let before = &bytes[..error.valid_up_to()];
            let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
            let column = 1 + before.iter().rev().take_while(|byte| **byte != b'\n').count();
            Fault::Malformed(format!("line {line}, column {column}: it is not UTF-8"))
        })?;
        if let Some(excess) = exceeded_budget(text) {
            return Err(Fault::TooLarge(excess));
        }
        let document = Document::parse(text).map_err(|error| {
            let (at, what) = (error.pos(), error.to_string());
            let what = what.strip_suffix(&format!(" at {at}")).unwrap_or(&what);
            let what = what.replace("a root node", "an element");
            let why = format!("line {}, column {}: {what}", at.row, at.col);
            match error {
                Error::DtdDetected => Fault::Doctype(why),
                _ => Fault::Malformed(why),
            }
        })?;
        Ok(Element::from_node(document.root_element(), &mut Lines { text, at: 0, line: 1 }))
    }

    fn from_node(node: Node, lines: &mut Lines) -> Element {
        let line = lines.line_at(node.range().start);
        let owned = |text: &str| Cow::Owned(text.to_string());
        let attribute = |a: roxmltree::Attribute| (owned(a.name()), owned(a.value()));
        Element {
            name: owned(node.tag_name().name()),
            line,
            attributes: node.attributes().map(attribute).collect(),
            children: node
                .children()
                .filter(Node::is_element)
                .map(|child| Element::from_node(child, lines))
                .collect(),
        }
    }

    /// Appends the element to `to` in a binary format, which [`Element::unpack`] reads many times
    /// faster than XML.
    pub fn pack(&self, to: &mut Vec<u8>) {
        let number = |number: usize, to: &mut Vec<u8>| to.extend((number as u32).to_le_bytes());
        let text = |text: &str, to: &mut Vec<u8>| {
            number(text.len(), to);
            to.extend(text.as_bytes());
        };
        text(&self.name, to);
        number(self.line as usize, to);
        number(self.attributes.len(), to);
        for (name, value) in &self.attributes {
            text(name, to);
            text(value, to);
        }
        number(self.children.len(), to);
        self.children.iter().for_each(|child| child.pack(to));
    }

    /// Reads an element in the binary format of [`Element::pack`] from the beginning of `bytes` and
    /// removes it from them. Its texts are borrowed, not copied. The result is `None` if the bytes
    /// have another format.
    pub fn unpack(bytes: &mut &'static [u8]) -> Option<Element> {
        fn number(bytes: &mut &'static [u8]) -> Option<usize> {
            let number;
            (number, *bytes) = bytes.split_first_chunk()?;
            Some(u32::from_le_bytes(*number) as usize)
        }
        fn text(bytes: &mut &'static [u8]) -> Option<Cow<'static, str>> {
            let text;
            let length = number(bytes)?;
            (text, *bytes) = bytes.split_at_checked(length)?;
            std::str::from_utf8(text).ok().map(Cow::Borrowed)
        }
        // Each item has at least 8 bytes. This limits the memory that a wrong number could reserve.
        fn read_count(bytes: &mut &'static [u8]) -> Option<usize> {
            number(bytes).filter(|count| *count <= bytes.len() / 8)
        }
        let (name, line) = (text(bytes)?, number(bytes)? as u64);
        let mut attributes = Vec::with_capacity(read_count(bytes)?);
        for _ in 0..attributes.capacity() {
            attributes.push((text(bytes)?, text(bytes)?));
        }
        let mut children = Vec::with_capacity(read_count(bytes)?);
        for _ in 0..children.capacity() {
            children.push(Element::unpack(bytes)?);
        }
        Some(Element { name, line, attributes, children })
    }

    pub fn get(&self, attribute: &str) -> Option<&str> {
        self.attributes.iter().find(|(name, _)| name == attribute).map(|(_, value)| &**value)
    }

    pub fn number(&self, attribute: &str) -> Option<f64> {
        self.get(attribute).and_then(double)
    }

    pub fn flag(&self, attribute: &str) -> bool {
        matches!(self.get(attribute).map(str::trim), Some("true" | "1"))
    }

    pub fn child(&self, name: &str) -> Option<&Element> {
        self.children.iter().find(|child| child.name == name)
    }

    pub fn list<'a>(&'a self, list: &str) -> impl Iterator<Item = &'a Element> + use<'a> {
        self.child(list).into_iter().flat_map(|list| &list.children)
    }
}

/// Returns the first limit that the XML text exceeds, as a sentence. The limits are checked before
/// parsing, because the time of some parsers grows with the square of the depth or of the number of
/// attributes. The parser checks later if the file is well-formed.
fn exceeded_budget(text: &str) -> Option<String> {
    let namespaces = text.matches("xmlns").count();
    if namespaces > MOST_NAMESPACES {
        return Some(format!(
            "the file declares {namespaces} namespaces (allowed: {MOST_NAMESPACES})"
        ));
    }
    let (mut depth, mut elements, mut all_attributes, mut rest) = (0usize, 0, 0, text);
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        // Skip comments, CDATA, processing instructions, declarations and end tags.
        let skipped = [("!--", "-->"), ("![CDATA[", "]]>"), ("?", "?>"), ("!", ">"), ("/", ">")]
            .into_iter()
            .find(|(start, _)| rest.starts_with(start));
        if let Some((start, end)) = skipped {
            if start == "/" {
                depth = depth.saturating_sub(1);
            }
            rest = rest.split_once(end)?.1;
            continue;
        }
        // the end of the start tag, which must not be within quotes
        let (mut quote, mut attributes, mut empty) = (None, 0, false);
        let (mut name, mut longest_name, mut value, mut longest_value) = (0usize, 0, 0usize, 0);
        let end = rest.bytes().position(|byte| {
            match (quote, byte) {
                (Some(q), byte) if q == byte => quote = None,
                (Some(_), _) => {}
                (None, b'"' | b'\'') => quote = Some(byte),
                (None, b'=') => attributes += 1,
                (None, b'>') => return true,
                (None, _) => {}
            }
            empty = byte == b'/';
            let in_name = quote.is_none() && byte != b'=' && !byte.is_ascii_whitespace();
            name = if in_name { name + 1 } else { 0 };
            longest_name = longest_name.max(name);
            value = if quote.is_some() { value + 1 } else { 0 };
            longest_value = longest_value.max(value);
            false
        });
        // A tag without an end is reported by the parser; this function checks only the length of its names.
        let end = end.unwrap_or(rest.len().saturating_sub(1));
        depth += 1;
        elements += 1;
        all_attributes += attributes;
        let fault = if depth > DEEPEST {
            format!("elements are nested deeper than allowed ({DEEPEST} levels)")
        } else if elements > MOST {
            format!("the file has more elements than allowed ({MOST})")
        } else if all_attributes > MOST_ATTRIBUTES {
            format!("the file has more attributes than allowed ({MOST_ATTRIBUTES})")
        } else if attributes > MOST_OF_ONE {
            format!("an element has {attributes} attributes (allowed: {MOST_OF_ONE})")
        } else if longest_name > LONGEST_NAME {
            format!("a name has {longest_name} bytes (allowed: {LONGEST_NAME})")
        } else if longest_value > LONGEST_VALUE {
            format!("an attribute has {longest_value} bytes (allowed: {LONGEST_VALUE})")
        } else {
            depth -= usize::from(empty);
            rest = rest.get(end + 1..).unwrap_or_default();
            continue;
        };
        let line = 1 + text[..text.len() - rest.len()].matches('\n').count();
        return Some(format!("line {line}: {fault}"));
    }
    None
}

/// Position in a text with the number of its line. Lines are counted from the last position on,
/// because counting from the beginning for every element would take quadratic time.
struct Lines<'t> {
    text: &'t str,
    at: usize,
    line: u64,
}

impl Lines<'_> {
    /// Returns the number of the line that contains the byte with the position `byte`. The position
    /// must not be smaller than in the previous call.
    fn line_at(&mut self, byte: usize) -> u64 {
        let passed = &self.text.as_bytes()[self.at..byte.max(self.at)];
        self.line += passed.iter().filter(|b| **b == b'\n').count() as u64;
        self.at = byte.max(self.at);
        self.line
    }
}

/// Parses a number in the format of XML (`xs:double`): a number with a decimal point and an
/// exponent, `INF`, `-INF` or `NaN`. Returns `None` for any other text, for example for `inf`.
pub fn double(text: &str) -> Option<f64> {
    match text.trim() {
        "INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        "NaN" => Some(f64::NAN),
        // Rust also accepts words that XML does not allow: "inf", "infinity", "nan".
        number if number.chars().any(|c| c.is_alphabetic() && !matches!(c, 'e' | 'E')) => None,
        number => number.parse().ok(),
    }
}

//! An XML file as a tree of elements, each with the line it starts in.

use xml::reader::{EventReader, ParserConfig, XmlEvent};

/// An element with its attributes and what is inside it; text is left out.
#[derive(Clone, Debug, Default)]
pub struct Element {
    /// Name, without prefix.
    pub name: String,
    /// Line of the file, counted from 1.
    pub line: u64,
    /// Names and values, in the order of the file.
    pub attributes: Vec<(String, String)>,
    /// The elements inside, in the order of the file.
    pub children: Vec<Element>,
}

impl Element {
    /// Reads a file; the error says in which line it is not well-formed.
    pub fn parse(bytes: &[u8]) -> Result<Element, String> {
        let mut reader = EventReader::new_with_config(bytes, ParserConfig::new());
        // The last one is open, the first one stands for the file.
        let mut open = vec![Element::default()];
        loop {
            let event = reader.next().map_err(|error| error.to_string())?;
            match event {
                XmlEvent::StartElement { name, attributes, .. } => open.push(Element {
                    name: name.local_name,
                    line: xml::common::Position::position(&reader).row + 1,
                    attributes: attributes
                        .into_iter()
                        .map(|attribute| (attribute.name.local_name, attribute.value))
                        .collect(),
                    children: Vec::new(),
                }),
                XmlEvent::EndElement { .. } => {
                    let done = open.pop().unwrap_or_default();
                    if let Some(parent) = open.last_mut() {
                        parent.children.push(done);
                    }
                }
                XmlEvent::EndDocument => break,
                _ => {}
            }
        }
        let root = open.pop().and_then(|mut file| file.children.pop());
        root.ok_or_else(|| "it has no element".to_string())
    }

    /// The value of an attribute.
    pub fn get(&self, attribute: &str) -> Option<&str> {
        self.attributes.iter().find(|(name, _)| name == attribute).map(|(_, value)| value.as_str())
    }

    /// The value of an attribute that is a number; none if it is not written or is no number.
    pub fn number(&self, attribute: &str) -> Option<f64> {
        self.get(attribute).and_then(double)
    }

    /// Whether an attribute says yes.
    pub fn flag(&self, attribute: &str) -> bool {
        matches!(self.get(attribute).map(str::trim), Some("true" | "1"))
    }

    /// The first element of that name inside.
    pub fn child(&self, name: &str) -> Option<&Element> {
        self.children.iter().find(|child| child.name == name)
    }

    /// All elements below `list`, if that is there.
    pub fn list<'a>(&'a self, list: &str) -> impl Iterator<Item = &'a Element> + use<'a> {
        self.child(list).into_iter().flat_map(|list| &list.children)
    }
}

/// A number as XML writes it (`xs:double`): a decimal point, `INF`, `-INF`, `NaN`.
pub fn double(text: &str) -> Option<f64> {
    match text.trim() {
        "INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        "NaN" => Some(f64::NAN),
        // Rust reads words that XML does not: "inf", "infinity", "nan"
        number if number.chars().any(|c| c.is_alphabetic() && !matches!(c, 'e' | 'E')) => None,
        number => number.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_know_their_line_their_attributes_and_what_is_inside() {
        let root =
            Element::parse(b"<a>\n <b x='1' y=\"&lt;\"/>\n <!-- no --><b><c/></b></a>").unwrap();
        assert_eq!((root.name.as_str(), root.line, root.children.len()), ("a", 1, 2));
        let b = root.child("b").unwrap();
        assert_eq!(
            (b.line, b.get("x"), b.get("y"), b.number("x")),
            (2, Some("1"), Some("<"), Some(1.0))
        );
        assert_eq!(root.children[1].children[0].name, "c");
    }

    #[test]
    fn what_is_not_well_formed_is_an_error_with_its_line() {
        for text in ["", "<a>", "<a></b>", "<a x=1/>", "<a>\n<b></a>", "\u{feff}", "<a>\u{1}</a>"] {
            assert!(Element::parse(text.as_bytes()).is_err(), "{text:?}");
        }
        assert!(Element::parse(b"<a>\n<b></a>").unwrap_err().contains("2:"));
        assert!(Element::parse(b"<a x='\xff'/>").is_err());
    }

    #[test]
    fn numbers_are_those_of_xml() {
        assert_eq!(double(" 1.5e3 "), Some(1500.0));
        assert_eq!(double("-INF"), Some(f64::NEG_INFINITY));
        for wrong in ["1,5", "inf", "nan", "infinity", "0x10", "", "1.0d"] {
            assert_eq!(double(wrong), None, "{wrong}");
        }
    }
}

//! XML elements as text, indented by two spaces per level.

use std::fmt::Display;

use xml::EmitterConfig;
use xml::writer::{Error, EventWriter, XmlEvent};

pub(crate) struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    children: Vec<Element>,
}

impl Element {
    pub(crate) fn new(name: &'static str) -> Self {
        Self { name, attributes: Vec::new(), children: Vec::new() }
    }

    pub(crate) fn with(self, name: &'static str, value: impl Display) -> Self {
        self.with_some(name, Some(value))
    }

    pub(crate) fn with_some(mut self, name: &'static str, value: Option<impl Display>) -> Self {
        self.attributes.extend(value.map(|value| (name, value.to_string())));
        self
    }

    pub(crate) fn holding(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children);
        self
    }

    pub(crate) fn document(&self) -> Result<String, Error> {
        let layout = EmitterConfig::new().perform_indent(true).indent_string("  ");
        let mut writer = layout.create_writer(Vec::new());
        self.write(&mut writer)?;
        Ok(String::from_utf8_lossy(&writer.into_inner()).into_owned() + "\n")
    }

    fn write(&self, writer: &mut EventWriter<Vec<u8>>) -> Result<(), Error> {
        let start = XmlEvent::start_element(self.name);
        writer.write(
            self.attributes.iter().fold(start, |start, (name, value)| start.attr(*name, value)),
        )?;
        for child in &self.children {
            child.write(writer)?;
        }
        writer.write(XmlEvent::end_element())
    }
}

//! What is committed and follows from something else is what it follows from; the icon and the
//! terminals are what importers want.

use std::collections::BTreeMap;

use HubSlosh::table::TABLE;
use HubSlosh::variable::Causality;
use model_description::{icon, variables};

const GENERATE: &str = "run `cargo run --release -p model-description`";

fn committed(path: &str) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

#[test]
fn page_of_variables_is_what_the_table_says() {
    let page = String::from_utf8(committed(variables::PATH)).unwrap();
    assert!(page == variables::page(), "{} is out of date: {GENERATE}", variables::PATH);
}

#[test]
fn icon_is_a_png_of_the_drawing() {
    let png = committed(icon::PATH);
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let shown = resvg::tiny_skia::Pixmap::decode_png(&png).unwrap();
    assert_eq!((shown.width(), shown.height()), (512, 512));
    let drawn = icon::draw(&String::from_utf8(committed(icon::SOURCE)).unwrap()).unwrap();
    // Edges may be shaded differently by a step or two where another processor rounds otherwise.
    let far = shown.data().iter().zip(drawn.data()).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert_eq!(far, 0, "{} is out of date: {GENERATE}", icon::PATH);
}

#[test]
fn every_input_and_output_is_in_one_terminal() {
    let path =
        pack::root().join("modelDescription/HubSlosh/terminalsAndIcons/terminalsAndIcons.xml");
    let text = std::fs::read_to_string(path).unwrap();
    let mut members = BTreeMap::new();
    for event in xml::EventReader::from_str(&text) {
        let xml::reader::XmlEvent::StartElement { name, attributes, .. } = event.unwrap() else {
            continue;
        };
        if name.local_name == "TerminalMemberVariable" {
            let of = attributes.iter().find(|a| a.name.local_name == "variableName").unwrap();
            *members.entry(of.value.clone()).or_insert(0) += 1;
        }
    }
    let connected = [Causality::Input, Causality::Output];
    let wanted: BTreeMap<_, _> = TABLE
        .iter()
        .filter(|v| connected.contains(&v.causality))
        .map(|v| (v.name.to_string(), 1))
        .collect();
    assert_eq!(members, wanted);
}

use host::xml::{DEEPEST, Element, Fault, LONGEST_VALUE, MOST_NAMESPACES, MOST_OF_ONE, double};

#[test]
fn xml_elements_have_their_line_attributes_and_children() {
    let root = Element::parse(b"<a>\n <b x='1' y=\"&lt;\"/>\n <!-- no --><b><c/></b></a>").unwrap();
    assert_eq!((&*root.name, root.line, root.children.len()), ("a", 1, 2));
    let b = root.child("b").unwrap();
    assert_eq!(
        (b.line, b.get("x"), b.get("y"), b.number("x")),
        (2, Some("1"), Some("<"), Some(1.0))
    );
    assert_eq!(root.children[1].children[0].name, "c");
}

#[test]
fn a_packed_xml_element_is_restored_and_other_bytes_are_refused() {
    let text = "<a b='\u{b0}&#10;'>\n<c/>text<c d='' e='1'><f g='2'/></c></a>";
    let root = Element::parse(text.as_bytes()).unwrap();
    let mut bytes = Vec::new();
    root.pack(&mut bytes);
    let all: &'static [u8] = bytes.leak();
    let (mut rest, mut short) = (all, &all[..all.len() - 1]);
    assert_eq!(Element::unpack(&mut rest).as_ref(), Some(&root));
    assert!(rest.is_empty());
    assert_eq!(Element::unpack(&mut short), None);
    // At each position four bytes are overwritten, which gives a wrong length or a wrong line number
    // of the packed element.
    for at in 0..all.len() - 3 {
        let mut wrong = all.to_vec();
        wrong[at..at + 4].fill(0xff);
        assert_ne!(Element::unpack(&mut &*wrong.leak()).as_ref(), Some(&root), "{at}");
    }
}

#[test]
fn xml_that_is_not_well_formed_is_an_error_with_its_line() {
    for text in ["", "<a>", "<a></b>", "<a x=1/>", "<a>\n<b></a>", "\u{feff}", "<a>\u{1}</a>"] {
        assert!(Element::parse(text.as_bytes()).is_err(), "{text:?}");
    }
    let fault = |text: &[u8]| Element::parse(text).unwrap_err().to_string();
    assert!(fault(b"<a>\n<b></a>").starts_with("line 2, column "));
    assert_eq!(fault(b"<a\nx='\xff'/>"), "line 2, column 4: it is not UTF-8");
}

#[test]
fn xml_with_entities_or_too_deep_nesting_is_refused() {
    let bomb = "<!DOCTYPE a [<!ENTITY x \"y\">]><a>&x;</a>";
    assert!(Element::parse(bomb.as_bytes()).unwrap_err().to_string().contains("DTD"));
    let nested = |depth: usize| "<a>".repeat(depth) + &"</a>".repeat(depth);
    assert!(Element::parse(nested(DEEPEST).as_bytes()).is_ok());
    for wrong in [nested(DEEPEST + 1), nested(200_000), "<a>".repeat(200_000)] {
        let fault = Element::parse(wrong.as_bytes()).unwrap_err();
        assert!(matches!(&fault, Fault::TooLarge(why) if why.contains("deeper than")));
    }
    // Comments, texts and empty elements do not count as levels.
    let flat = ["<b/>", "<b c='>'/>", "<!-- <b> -->", "<![CDATA[<b>]]>", "<?b <b> ?>"];
    let flat = format!("<a>{}</a>", flat.map(|one| one.repeat(300)).concat());
    assert_eq!(Element::parse(flat.as_bytes()).unwrap().children.len(), 600);
    let many: String = (0..=MOST_OF_ONE).map(|n| format!(" b{n}='='")).collect();
    let fault = Element::parse(format!("<a{many}/>").as_bytes()).unwrap_err();
    assert_eq!(fault.to_string(), "line 1: an element has 201 attributes (allowed: 200)");
    for name in ["a".repeat(70_000), format!("a {}=''", "b".repeat(70_000))] {
        for text in [format!("<{name}/>"), format!("<{name}"), format!("<c>\n<{name}></c>")] {
            let fault = Element::parse(text.as_bytes()).unwrap_err().to_string();
            assert!(fault.contains("a name has 7000"), "{fault}");
        }
    }
    let long = "9".repeat(LONGEST_VALUE);
    let fault = Element::parse(format!("<a b='{long}'/>").as_bytes()).unwrap_err();
    assert_eq!(fault.to_string(), "line 1: an attribute has 1048577 bytes (allowed: 1048576)");
    let spaces: String = (0..=MOST_NAMESPACES).map(|n| format!("<b xmlns:c{n}='d'/>")).collect();
    let fault = Element::parse(format!("<a>{spaces}</a>").as_bytes()).unwrap_err();
    assert_eq!(fault.to_string(), "the file declares 101 namespaces (allowed: 100)");
    let fault = Element::parse(bomb.as_bytes()).unwrap_err();
    assert!(matches!(fault, Fault::Doctype(_)));
}

#[test]
fn an_xml_file_of_a_hundred_thousand_elements_is_read_in_linear_time() {
    let lines = "<b c=\"0123456789\"/>\n".repeat(100_000);
    let started = std::time::Instant::now();
    let root = Element::parse(format!("<a>\n{lines}</a>").as_bytes()).unwrap();
    assert_eq!(root.children.last().map(|b| b.line), Some(100_001));
    // Counting the lines from the beginning for each element would take minutes.
    assert!(started.elapsed().as_secs_f64() < 5.0);
}

#[test]
fn numbers_in_xml_files_are_read_as_the_type_double_of_xml() {
    assert_eq!(double(" 1.5e3 "), Some(1500.0));
    assert_eq!(double("-INF"), Some(f64::NEG_INFINITY));
    for wrong in ["1,5", "inf", "nan", "infinity", "0x10", "", "1.0d"] {
        assert_eq!(double(wrong), None, "{wrong}");
    }
}

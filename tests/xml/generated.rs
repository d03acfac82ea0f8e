//! What is committed and follows from something else is what it follows from; the icon is what
//! importers want.

use std::path::Path;

use model_description::{fmi3, icon, variables};
use runtime::Model;
use runtime::table::Layout::{Arrays, Scalars};

const GENERATE: &str = "run: cargo run --release -p model-description";

fn committed(path: impl AsRef<Path>) -> Vec<u8> {
    let path = path.as_ref();
    std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn description_and_page_of_variables_are_what_the_table_says() {
    up_to_date::<HubSlosh::HubSlosh>();
    up_to_date::<Spacecraft::Model>();
    up_to_date::<SloshTank::Model>();
}

fn up_to_date<M: Model>() {
    for (path, text) in [
        (model_description::path::<M>(), model_description::xml::<M>().unwrap()),
        (fmi3::path::<M>(Scalars), fmi3::xml::<M>(Scalars).unwrap()),
        (fmi3::path::<M>(Arrays), fmi3::xml::<M>(Arrays).unwrap()),
        (variables::path::<M>(), variables::page::<M>()),
    ] {
        let there = String::from_utf8(committed(&path)).unwrap();
        assert!(there == text, "{} is out of date: {GENERATE}", path.display());
    }
}

#[test]
fn icon_is_a_png_of_the_drawing() {
    let png = committed(format!("{}/icon.png", icon::FOLDER));
    assert_eq!(&png[..16], b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    assert_eq!(
        (&png[16..20], &png[20..24]),
        (&icon::SIZE.to_be_bytes()[..], &icon::SIZE.to_be_bytes()[..])
    );
    let drawn = String::from_utf8(committed(format!("{}/SHA256SUMS", icon::FOLDER))).unwrap();
    assert_eq!(icon::hashes().unwrap(), drawn, "{GENERATE} --features icon");
}

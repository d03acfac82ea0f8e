//! Committed files that are generated equal the output of their generators, and the icon has the size and
//! format that importers expect.

use std::path::Path;

use model_description::{fmi3, icon, names, variables};
use runtime::Model;
use runtime::table::Layout::{Arrays, Scalars};
use runtime::table::Scalar;

const GENERATE: &str = "run: cargo run --release -p model-description";

fn committed(path: impl AsRef<Path>) -> Vec<u8> {
    let path = path.as_ref();
    std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn model_description_and_page_of_variables_equal_the_table() {
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
        (names::path::<M>(), names::module::<M>()),
    ] {
        let there = String::from_utf8(committed(&path)).unwrap();
        assert!(there == text, "{} is out of date: {GENERATE}", path.display());
    }
}

/// In the row of an array the page must state the start value of every element that the XML states.
#[test]
fn pages_of_variables_have_the_start_values_of_all_components() {
    let row = |page: &str, name: &str| {
        let row = page.lines().find(|line| line.starts_with(&format!("| `{name}` |")));
        row.unwrap_or_else(|| panic!("no row of {name}")).split(" | ").nth(2).unwrap().to_string()
    };
    let page = variables::page::<Spacecraft::Model>();
    assert_eq!(row(&page, "craft.r[1..3]"), "0, 0, 0.21");
    assert_eq!(row(&page, "gravity[1..3]"), "0, 0, -9.81");
    assert_eq!(row(&page, "tank[1..4].position[1..3]"), "0, 0, -0.45");
    assert_eq!(row(&page, "tank[1..4].mass[1..3]"), "128.211, 3.91595, 0.93327");
    assert_eq!(row(&page, "tank[1..4].p_0[1..3,1..3]"), "0, 0, -1; 0, 0, -1; 0, 0, -1");
    assert_eq!(row(&page, "init.omega[1..3]"), "0");
    assert!(row(&page, "tank[1..4].fill.liquid[1..12]").ends_with(", 763.407"));
    let page = variables::page::<SloshTank::Model>();
    assert!(!page.contains("slosh.model"), "SloshTank has no variable slosh.model");
    assert_eq!(row(&page, "tank.p_0[1..3,1..3]"), "0, 0, -1");
    assert_eq!(row(&page, "a[1..3]"), "0");
}

/// Returns two numbers of scalar parameters: of the whole table, and of the part that a craft with one tank of one mode and
/// without appendages needs.
fn parameters<M: Model>() -> [usize; 2] {
    const OF_MODES: [&str; 32] = [
        "mass",
        "length",
        "frequency",
        "hinge",
        "direction",
        "arm",
        "k",
        "zeta",
        "zeta_amplitude",
        "zeta_breaking",
        "breaking_steepness",
        "nonlinear_inertia",
        "nonlinear_stiffness",
        "nonlinear_inertia_2",
        "nonlinear_stiffness_2",
        "rotary_inertia",
        "rotary_inertia_2",
        "gyroscopic",
        "gyroscopic_stiffness",
        "angle_limit",
        "swirl_limit",
        "wave",
        "fill.mass",
        "fill.length",
        "fill.zeta",
        "fill.nonlinear_inertia",
        "fill.nonlinear_stiffness",
        "fill.angle_limit",
        "fill.swirl_limit",
        "fill.hinge",
        "p_0",
        "p_dot_0",
    ];
    let all = M::table().parameters();
    let is_further = |s: &Scalar<M>| {
        let indices = s.variable.indices(s.element);
        if s.variable.name.starts_with("appendage[]") {
            return true;
        }
        let field = s.variable.name.strip_prefix("tank[].");
        field.is_some_and(|field| indices[0] > 0 || OF_MODES.contains(&field) && indices[1] > 0)
    };
    [all.len(), all.iter().filter(|s| !is_further(s)).count()]
}

#[test]
fn numbers_of_variables_in_the_documentation_equal_those_of_the_tables() {
    let [spacecraft, small] = parameters::<Spacecraft::Model>();
    let [hub, _] = parameters::<HubSlosh::HubSlosh>();
    let [tank, _] = parameters::<SloshTank::Model>();
    let extra = 1 + Spacecraft::table::TABLE.about.event_indicators;
    let scalars = Spacecraft::table::TABLE.scalars.len() + extra;
    let arrays = Spacecraft::table::TABLE.variables.len() + 2;
    for (page, text) in [
        (
            "modelDescription/Spacecraft/documentation/index.md",
            format!(
                "Of its {spacecraft} parameters a craft with one tank of one mode needs {small}."
            ),
        ),
        (
            "book/hosts.md",
            format!("HubSlosh has {hub} parameters, SloshTank {tank}, Spacecraft {spacecraft}:"),
        ),
        ("book/hosts.md", format!("description has {arrays} variables in place of {scalars},")),
        ("book/hosts.md", format!("| Spacecraft with `pack --tanks 1 --modes 1` | {small} |")),
        ("book/commands.md", format!("with {small} parameters in place of {spacecraft} |")),
    ] {
        let there = String::from_utf8(committed(pack::root().join(page))).unwrap();
        let there = there.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(there.contains(&text), "{page} does not contain: {text}");
    }
}

#[test]
fn the_icon_is_a_png_of_its_drawing() {
    let png = committed(format!("{}/icon.png", icon::FOLDER));
    assert_eq!(&png[..16], b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    assert_eq!(
        (&png[16..20], &png[20..24]),
        (&icon::SIZE.to_be_bytes()[..], &icon::SIZE.to_be_bytes()[..])
    );
    let drawn = String::from_utf8(committed(format!("{}/SHA256SUMS", icon::FOLDER))).unwrap();
    assert_eq!(icon::hashes().unwrap(), drawn, "{GENERATE} --features icon");
}

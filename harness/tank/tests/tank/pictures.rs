//! What people look at.

use std::path::Path;

use hubslosh_tank::sweep::sweep;
use hubslosh_tank::{Tank, picture, table};

/// An axis has some length where all its values are the same: frequencies without gravity, hinges at a sphere's centre.
#[test]
fn a_sweep_whose_values_are_all_the_same_can_be_drawn() {
    let text = "density = 1.0\nprofile = [{ arc = [0, 0, 1, -90, 90] }]";
    let tank = Tank::parse(text, Path::new("")).unwrap();
    let swept = sweep(&tank, &[0.5, 1.0, 2.0], 2).unwrap();
    let svg = picture::sweep(&tank, &swept, 0.0);
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    // ticks of 0.1 and 0.2 over a width of 1
    assert!(svg.matches("<text").count() < 80, "{}", svg.matches("<text").count());
}

/// Every example: well-formed XML without anything that is not a number, the table with every mode.
#[test]
fn examples_can_be_drawn_and_tabulated() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        let tank = Tank::read(&path).unwrap();
        let depth = tank.depth().unwrap_or(0.5);
        let data = tank.solve(0.55 * depth, 5).unwrap();
        let swept = sweep(&tank, &[0.0, 0.3 * depth, 0.6 * depth, 0.9 * depth], 3).unwrap();
        for svg in [picture::tank(&tank, &data, 9.80665), picture::sweep(&tank, &swept, 9.80665)] {
            roxmltree::Document::parse(&svg)
                .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{}", path.display());
            assert!(
                svg.contains(">z, m<") && svg.contains("mode") == svg.contains("over the fill")
            );
        }
        let text = table(&data, 9.80665);
        assert!(!text.contains("NaN"), "{text}");
        for mode in &data.modes {
            assert!(text.contains(&format!("{:.6}", mode.lambda)), "{text}");
        }
    }
}

//! Tank files: accepted input, and messages for refused input.

use std::path::Path;

use crate::common::{solve, tank};
use hubslosh_tank::parameters::{self, Liquid, ParameterSet, Target};
use hubslosh_tank::tank::Geometry;
use hubslosh_tank::{Fill, Tank, table};

fn problems(text: &str) -> String {
    match Tank::parse(&format!("density = 1000.0\n{text}"), Path::new("")) {
        Ok(_) => panic!("accepted without error: {text}"),
        Err(problems) => problems.to_string(),
    }
}

#[test]
fn every_defect_of_a_contour_has_a_clear_message() {
    let cases = [
        ("profile = []", "no segment"),
        (
            "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0.1, 1, 1] }]",
            "open: segment 1 ends at (1.000000, 0.000000) m and segment 2 starts at (1.000000, 0.100000)",
        ),
        (
            "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0, 0.5, 1] }, { line = [0.5, 1, 0.5, -0.5] }]",
            "crosses itself near (0.5",
        ),
        // the first line crosses the last line, and a line meets a corner at the corner's height or at its radius
        (
            "profile = [{ line = [0.5, 1, 0.5, 0] }, { line = [0.5, 0, 1, 0] }, { line = [1, 0, 1, 1] }, { line = [1, 1, 0.4, 0.5] }]",
            "crosses itself near (0.500000, 0.583333) m (segments 1 and 4)",
        ),
        (
            "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0, 1, 1] }, { line = [1, 1, 0.5, 0] }, { line = [0.5, 0, 0.2, 1] }]",
            "crosses itself near (0.500000, 0.000000) m (segments 1 and 3)",
        ),
        (
            "profile = [{ line = [0.5, 1, 0.5, 0] }, { line = [0.5, 0, 1, 0] }, { line = [1, 0, 0.5, 0.5] }, { line = [0.5, 0.5, 1, 1] }]",
            "crosses itself near (0.500000, 0.500000) m (segments 1 and 3)",
        ),
        (
            "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0, 1, 1] }, { line = [1, 1, 0.5, 0.6] }, { line = [0.5, 0.6, 1, 0.2] }]",
            "crosses itself near (1.000000, 0.200000) m (segments 2 and 4)",
        ),
        (
            "profile = [{ line = [0, 0.5, 0.5, 0.5] }, { line = [0.5, 0.5, 0.6, 0] }, { line = [0.6, 0, 1, 0] }, { line = [1, 0, 0.3, 0.5] }, { line = [0.3, 0.5, 1, 0.9] }]",
            "crosses itself",
        ),
        // a line that folds back exactly on the previous line, or misses it by a billionth of a radian
        (
            "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0, 1, 1] }, { line = [1, 1, 1, 0.5] }]",
            "crosses itself near (1.000000, 1.000000) m (segments 2 and 3)",
        ),
        (
            "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0, 1, 1] }, { line = [1, 1, 0.9999999999, 0.5] }]",
            "crosses itself near (1.000000, 1.000000) m (segments 2 and 3)",
        ),
        ("profile = [{ line = [1, 1, 1, 0] }, { line = [1, 0, 0, 0] }]", "inside out (clockwise)"),
        (
            "profile = [{ line = [0, 0, nan, 0] }]",
            "Segment 1: contains NaN; every value must be a finite number",
        ),
        ("profile = [{ line = [0, 0, inf, 0] }]", "contains inf"),
        ("profile = [{ line = [0.5, 0.5, 0.5, 0.5] }]", "Segment 1: has no length"),
        (
            "profile = [{ line = [0, 0, 500, 0] }, { line = [500, 0, 500, 800] }]",
            "is the drawing in millimetres?",
        ),
        ("profile = [{ line = [0, 0, -1, 0] }, { line = [-1, 0, -1, 1] }]", "r >= 0"),
        ("profile = [{ arc = [0, 1, -1, -90, 0] }]", "radii -1 and -1 m must be above 0"),
        ("profile = [{ ellipse = [0, 1, 1, 0, -90, 0] }]", "radii 1 and 0 m must be above 0"),
        ("profile = [{ ellipse = [0, 1, 0, 1, -90, 0] }]", "radii 0 and 1 m must be above 0"),
        // This tank is 110 m high and 1 m wide.
        (
            "profile = [{ line = [0, -60, 1, -60] }, { line = [1, -60, 1, 50] }]",
            "is 110.000000 m large",
        ),
        (
            "profile = [{ arc = [0, 1, 1, -90, 400] }]",
            "an arc of 490.0 degrees is longer than a full circle",
        ),
        ("profile = [{ line = [0, 0, 1] }]", "expected an array of length 4"),
        ("profile = [{ circle = [0, 0, 1] }]", "unknown name `circle`, allowed are `line`"),
        ("profile = [{ line = [0, 0, 1, 0] }]\ncolour = 3", "unknown field `colour`"),
        (
            "shape = { sphere = { radius = 1.0, height = 2.0 } }",
            "unknown dimension height, allowed are radius",
        ),
        ("shape = { spheer = { radius = 1.0 } }", "unknown name `spheer`, allowed are `cylinder`"),
        ("shape = 'sphere'", "the shape has no dimensions"),
        ("shape = { sphere = { radius = '1 m' } }", "expected a number"),
        ("shape = { sphere = { radius = -1.0 } }", "radius is -1; it must be a number above 0"),
        (
            "shape = { annulus = { inner_radius = 0.5, outer_radius = 0.4, height = 1.0 } }",
            "outer_radius is 0.4",
        ),
        ("box = [0.8]", "expected an array of length 2"),
        ("box = [0.8, 0.0]", "box: a length is 0"),
        ("box = [800, 500]", "millimetres?"),
        ("", "There is no tank: give profile, points, svg, shape or box"),
        (
            "box = [1.0, 1.0]\nshape = { sphere = { radius = 1.0 } }",
            "shape and box exclude each other",
        ),
        ("points = 'nowhere.csv'", "Could not read nowhere.csv"),
        ("this is no TOML", "expected"),
    ];
    for (text, words) in cases {
        let said = problems(text);
        assert!(said.contains(words), "{text}\nsaid: {said}\nexpected: {words}");
    }
}

#[test]
fn all_problems_of_a_tank_file_are_reported_at_once() {
    let text = "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0.1, -2, 900] }]";
    let said = Tank::parse(text, Path::new("")).unwrap_err().0;
    assert_eq!(said.len(), 4, "{said:?}");
    for words in ["density is missing", "millimetres?", "falls to -2", "open: segment 1"] {
        assert!(said.iter().any(|s| s.contains(words)), "{words}: {said:?}");
    }
    let tank = tank("density = 1.0\nbox = [1.0, 1.0]");
    assert_eq!(tank.solve(-1.0, 0).unwrap_err().0.len(), 2);
    assert_eq!(tank.solve(1.0, 0).unwrap_err().0.len(), 1);
}

#[test]
fn every_impossible_fill_of_a_tank_is_refused_with_a_clear_message() {
    let cases = [
        (
            "shape = { cylinder = { radius = 1.0, height = 1.0 } }",
            1.1,
            "above the top of the tank, 1.000000 m",
        ),
        ("shape = { cylinder = { radius = 1.0, height = 1.0 } }", 0.0, "must be above 0"),
        ("shape = { cylinder = { radius = 1.0, height = 1.0 } }", -1.0, "must be above 0"),
        ("shape = { cylinder = { radius = 1.0, height = 1.0 } }", f64::NAN, "fill is NaN"),
        ("shape = { sphere = { radius = 1.0 } }", 2.1, "above the top of the tank, 2.000000 m"),
        // the free surface is at a horizontal part of the wall at 0.5 m
        (
            "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0, 1, 0.5] }, { line = [1, 0.5, 2, 0.5] }, { line = [2, 0.5, 2, 1] }]",
            0.5,
            "horizontal part",
        ),
        // walls that are horizontal at the free surface: an inner wall, an outer wall, and the top of a dome
        (
            "profile = [{ arc = [0.5, 0, 0.3, 90, 0] }, { line = [0.8, 0, 1, 0] }, { line = [1, 0, 1, 1] }]",
            0.3,
            "horizontal part",
        ),
        (
            "profile = [{ line = [0, 0, 0.7, 0] }, { arc = [1, 0, 0.3, 180, 90] }]",
            0.3,
            "horizontal part",
        ),
        (
            "profile = [{ arc = [0, 0, 0.3, 90, 0] }, { line = [0.3, 0, 1, 0] }, { line = [1, 0, 1, 1] }]",
            0.3,
            "horizontal part",
        ),
        // the same tanks with the free surface a little below the horizontal part
        (
            "profile = [{ arc = [0.5, 0, 0.3, 90, 0] }, { line = [0.8, 0, 1, 0] }, { line = [1, 0, 1, 1] }]",
            0.295,
            "",
        ),
        ("profile = [{ line = [0, 0, 0.7, 0] }, { arc = [1, 0, 0.3, 180, 90] }]", 0.295, ""),
        (
            "profile = [{ arc = [0, 0, 0.3, 90, 0] }, { line = [0.3, 0, 1, 0] }, { line = [1, 0, 1, 1] }]",
            0.295,
            "",
        ),
        // a ring-shaped sump around a dome, and a second sump outside it
        (
            "profile = [{ line = [0, 0, 1, 1] }, { line = [1, 1, 2, 0] }, { line = [2, 0, 3, 2] }]",
            0.5,
            "separate pools",
        ),
        // an inner wall that begins below the free surface
        (
            "profile = [{ line = [0.5, 0.2, 0.5, 0] }, { line = [0.5, 0, 1, 0] }, { line = [1, 0, 1, 1] }]",
            0.15,
            "",
        ),
        (
            "profile = [{ line = [0.5, 0.2, 0.5, 0] }, { line = [0.5, 0, 1, 0] }, { line = [1, 0, 1, 1] }]",
            0.5,
            "above the top",
        ),
        ("profile = [{ line = [0.5, 0, 1, 0] }, { line = [1, 0, 1, 1] }]", 0.5, "above the top"),
    ];
    for (text, fill, words) in cases {
        let tank = tank(&format!("density = 1000.0\n{text}"));
        match tank.solve(fill, 5) {
            Ok(_) => assert!(words.is_empty(), "{text} {fill}"),
            Err(problems) => {
                let said = problems.to_string();
                assert!(!words.is_empty() && said.contains(words), "{text} {fill}: {said}");
            }
        }
    }
}

/// Gaps and distances from a shoulder count relative to the size of the tank, up to the largest
/// size of 100 m.
#[test]
fn checks_of_contours_do_not_depend_on_the_size_of_the_tank() {
    for c in [0.01, 1.0, 50.0] {
        let parsed = |gap: f64| {
            let text = format!(
                "density = 1.0\nprofile = [{{ line = [0, 0, {c}, 0] }}, {{ line = [{}, 0, {c}, {}] }}, {{ line = [{c}, {}, {}, {}] }}, {{ line = [{}, {}, {}, {}] }}]",
                c * (1.0 + gap),
                0.5 * c,
                0.5 * c,
                2.0 * c,
                0.5 * c,
                2.0 * c,
                0.5 * c,
                2.0 * c,
                c
            );
            Tank::parse(&text, Path::new(""))
        };
        // A contact line within 1e-9 of a joint is moved to the joint.
        let text = format!(
            "density = 1.0\nprofile = [{{ line = [0, 0, {c}, 0] }}, {{ line = [{c}, 0, {c}, {}] }}, {{ line = [{c}, {}, {c}, {c}] }}]",
            0.5 * c,
            0.5 * c
        );
        let Geometry::Revolution { contour, .. } = tank(&text).geometry else { panic!() };
        let surface = |off: f64| contour.cut(c * (0.5 + off)).unwrap().z_surface;
        assert_eq!([-0.9e-9, 0.9e-9].map(surface), [0.5 * c; 2]);
        assert!([-1.1e-9, 1.1e-9].iter().all(|off| surface(*off) != 0.5 * c), "{c}");
        // the limit is relative to the tank's size of 2 m
        assert!(parsed(1.9e-6).is_ok());
        assert!(parsed(2.1e-6).unwrap_err().to_string().contains("open"), "{c}");
        let Geometry::Revolution { contour, .. } = parsed(0.0).unwrap().geometry else { panic!() };
        for off in [-1.9e-6, 1.9e-6, 1e-9] {
            let said = contour.cut(c * (0.5 + off)).unwrap_err().to_string();
            assert!(said.contains("horizontal part"), "{c} {off}: {said}");
        }
        assert!([-2.1e-6, 2.1e-6].iter().all(|off| contour.cut(c * (0.5 + off)).is_ok()), "{c}");
    }
    for (text, allowed) in [
        ("box = [100, 100]", true),
        ("box = [100.01, 1]", false),
        ("box = [1, 100.01]", false),
        ("shape = { cylinder = { radius = 100, height = 1 } }", true),
        ("shape = { cylinder = { radius = 1, height = 100.01 } }", false),
    ] {
        let parsed = Tank::parse(&format!("density = 1.0\n{text}"), Path::new(""));
        assert_eq!(parsed.is_ok(), allowed, "{text}");
    }
}

/// The full tank is given as a height, as a fraction and as a mass.
#[test]
fn a_full_closed_tank_has_no_modes_and_a_message_with_its_rigid_liquid() {
    let tank = tank("density = 1000.0\nshape = { sphere = { radius = 1.0 } }");
    let mass = 1000.0 * 4.0 / 3.0 * core::f64::consts::PI;
    for fill in [Fill::Height(2.0), Fill::Share(1.0), Fill::Mass(mass)] {
        let data = tank.solve(tank.fill_height(fill).unwrap(), 5).unwrap();
        assert!(data.modes.is_empty() && data.rest.is_empty());
        assert!((data.m_liq / mass - 1.0).abs() < 1e-12 && (data.z_cg - 1.0).abs() < 1e-12);
        let text = table(&data, 9.80665);
        assert!(text.contains("the tank is full and does not slosh") && !text.contains("NaN"));
        let liquid =
            Liquid { gravity: 9.8, nu: None, sigma: None, contact_angle: 90.0, spin: None };
        let refused = ParameterSet::new(&tank, &data, Target::SloshTank, liquid).unwrap_err();
        let said = refused.to_string();
        assert!(said.contains("4188.790205 kg at z = 1.000000 m"), "{said}");
    }
}

/// Volumes are integrated by two rules, with 20 points per piece and with 5 points on smaller
/// pieces, so that only rounding errors and the error of 60 bisections remain.
#[test]
fn a_fill_in_per_cent_or_as_a_mass_gives_the_height_with_this_volume() {
    let tanks = [
        "shape = { sphere = { radius = 1.0 } }",
        "shape = { torus = { ring_radius = 1.0, tube_radius = 0.4 } }",
        "shape = { annulus = { inner_radius = 0.3, outer_radius = 1.0, height = 2.0 } }",
        // a dome that bulges into the tank, so that the contour starts above the tank's lowest point
        "profile = [{ arc = [0, -1.05, 1.45, 90, 46.39718102729638] }, { line = [1, 0, 1, 2] }, { ellipse = [0, 2, 1, 0.6, 0, 90] }]",
        // a horizontal part of the wall at half the depth, where the first bisection step falls
        "profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0, 1, 0.5] }, { line = [1, 0.5, 2, 0.5] }, { line = [2, 0.5, 2, 1] }]",
    ];
    for text in tanks {
        let tank = tank(&format!("density = 800.0\n{text}"));
        let Geometry::Revolution { contour, .. } = &tank.geometry else { panic!() };
        for share in [0.03, 0.25, 0.5, 0.77, 0.98] {
            let volume = share * contour.capacity();
            let height = tank.fill_height(Fill::Share(share)).unwrap();
            let data = tank.solve(height, 1).unwrap();
            assert!((data.m_liq / (800.0 * volume) - 1.0).abs() < 1e-10, "{text} {share}");
            let same = tank.fill_height(Fill::Mass(800.0 * volume)).unwrap();
            assert!((same / height - 1.0).abs() < 1e-12, "{text} {share}");
        }
    }
    let sphere = tank("density = 1000.0\nshape = { sphere = { radius = 1.0 } }");
    assert!((sphere.fill_height(Fill::Share(0.5)).unwrap() - 1.0).abs() < 1e-14);
    assert_eq!(sphere.fill_height(Fill::Share(0.0)), Ok(0.0));
    let open = tank("density = 1000.0\nbox = [0.5, 0.4]");
    assert!((open.fill_height(Fill::Mass(50.0)).unwrap() - 0.25).abs() < 1e-15);
    for (tank, fill, words) in [
        (&open, Fill::Share(0.5), "open at the top"),
        (&sphere, Fill::Share(1.01), "0 to 100 %"),
        (&sphere, Fill::Share(f64::NAN), "0 to 100 %"),
        (&sphere, Fill::Mass(-1.0), "must be 0 or more"),
        (&sphere, Fill::Mass(5000.0), "more than the tank holds: 4188.790205 kg"),
    ] {
        let said = tank.fill_height(fill).unwrap_err().to_string();
        assert!(said.contains(words), "{said}");
    }
    assert_eq!("60%".parse(), Ok(Fill::Share(0.6)));
    assert_eq!("1.2".parse(), Ok(Fill::Height(1.2)));
    assert!("1.2 m".parse::<Fill>().unwrap_err().to_string().contains("neither a height in m"));
}

/// Heights of a shape count from its lowest point, heights of a contour from the zero of its
/// drawing.
#[test]
fn table_and_parameter_file_state_the_zero_of_their_heights() {
    let shape = tank("density = 1.0\nshape = { sphere = { radius = 1.0 } }");
    let drawn = tank("density = 1.0\nprofile = [{ arc = [0, -0.5, 1, -90, 90] }]");
    for (tank, lowest, words) in [
        (&shape, 0.0, "z = 0 is the tank's lowest point"),
        (&drawn, -1.5, "contour's own zero, z up; the tank's lowest point is at z = -1.500000 m"),
    ] {
        let data = tank.solve(0.8, 1).unwrap();
        assert!((data.z_lowest - lowest).abs() < 1e-12);
        assert!((data.modes[0].hinge.unwrap() - lowest - 1.0).abs() < 1e-9);
        let liquid =
            Liquid { gravity: 9.8, nu: None, sigma: None, contact_angle: 90.0, spin: None };
        let set = ParameterSet::new(tank, &data, Target::SloshTank, liquid).unwrap();
        for text in [table(&data, 9.8), set.to_toml(), set.to_ssv()] {
            assert!(text.contains(words), "{text}");
        }
        assert!(serde_json::to_value(&data).unwrap()["z_lowest"].is_number());
    }
}

#[test]
fn a_tank_filled_in_part_equals_the_contour_up_to_the_fill() {
    let whole = solve("shape = { torus = { ring_radius = 1.0, tube_radius = 0.4 } }", 0.5, 3);
    // asin(0.25) = 14.4775 degrees above the equator on both sides
    let angle = 0.25f64.asin().to_degrees();
    let drawn = solve(
        &format!("profile = [{{ arc = [1, 0.4, 0.4, {}, {angle}] }}]", -180.0 - angle),
        0.5,
        3,
    );
    for (a, b) in whole.modes.iter().zip(&drawn.modes) {
        assert!((a.lambda / b.lambda - 1.0).abs() < 1e-11 && (a.wave - b.wave).abs() < 1e-9);
    }
    let elsewhere = solve("profile = [{ arc = [1, 0.4, 0.4, -180, 180] }]", 0.5, 3);
    assert!((whole.modes[0].lambda / elsewhere.modes[0].lambda - 1.0).abs() < 1e-11);
    // heights count from the contour's own zero, the fill from its lowest point
    let dome =
        "profile = [{ arc = [0, -1.05, 1.45, 90, 46.39718102729638] }, { line = [1, 0, 1, 2] }]";
    let ring = solve(dome, 0.3, 1);
    assert!((ring.r_inner.unwrap() - (1.45f64 * 1.45 - 1.35 * 1.35).sqrt()).abs() < 1e-12);
    assert!(solve(dome, 0.7, 1).r_inner == Some(0.0));
}

#[test]
fn built_in_shapes_have_the_volumes_of_textbooks() {
    use core::f64::consts::PI;
    let cap = |r: f64, h: f64| PI * h * h * (r - h / 3.0);
    let cases = [
        ("cylinder = { radius = 0.5, height = 1.0 }", 0.7, PI * 0.25 * 0.7),
        ("sphere = { radius = 0.5 }", 0.7, cap(0.5, 0.7)),
        ("spheroid = { radius = 1.0, half_height = 0.5 }", 0.7, 4.0 * cap(0.5, 0.7)),
        ("cone = { half_angle = 30.0, height = 1.0 }", 0.6, PI * 0.072 / 3.0),
        (
            "domed_cylinder = { radius = 1.0, height = 1.0, bottom = 0.5, top = 0.5 }",
            1.2,
            PI * (2.0 * 0.5 / 3.0 + 0.7),
        ),
        (
            "domed_cylinder = { radius = 1.0, height = 1.0, bottom = -0.5, top = 0.0 }",
            0.8,
            PI * (0.8 - 2.0 * 0.5 / 3.0),
        ),
        (
            "annulus = { inner_radius = 0.5, outer_radius = 1.0, height = 1.0 }",
            0.4,
            PI * 0.75 * 0.4,
        ),
        ("torus = { ring_radius = 1.0, tube_radius = 0.3 }", 0.3, PI * PI * 0.09),
    ];
    for (shape, fill, volume) in cases {
        let data = solve(&format!("shape = {{ {shape} }}"), fill, 2);
        assert!((data.m_liq / (1000.0 * volume) - 1.0).abs() < 1e-12, "{shape}");
    }
    // heads as in the reference: crown radius 2, knuckle radius 0.2
    let heads = "shape = { torispherical = { radius = 1.0, height = 1.0, crown_radius = 2.0, knuckle_radius = 0.2 } }";
    let bottom = tank(&format!("density = 1.0\n{heads}"));
    assert!((bottom.depth().unwrap() - 1.0 - 2.0 * 0.387_548_450_340_290_2).abs() < 1e-12);
    assert!(bottom.solve(1.5, 2).is_ok());
}

/// For 25 points of a half circle the error of straight lines is 2e-3, the error of the spline
/// 1e-6.
#[test]
fn points_of_a_contour_are_joined_by_straight_lines_or_by_a_spline() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "r, z\n# half a circle\n".to_string();
    for i in 0..=25 {
        let angle = core::f64::consts::PI * (i as f64 / 25.0 - 0.5);
        let r = if i == 0 || i == 25 { 0.0 } else { angle.cos() };
        text += &format!("{r},{}\n", 1.0 + angle.sin());
    }
    std::fs::write(folder.path().join("sphere.csv"), text).unwrap();
    let read = |extra: &str| {
        let tank = Tank::parse(
            &format!("density = 1000.0\npoints = 'sphere.csv'\n{extra}"),
            folder.path(),
        )
        .unwrap();
        tank.solve(1.0, 2).unwrap()
    };
    let (lines, spline) = (read(""), read("spline = true"));
    let exact = 1.560_157_174;
    assert!((lines.modes[0].lambda - exact).abs() > 1e-3);
    assert!((spline.modes[0].lambda - exact).abs() < 1e-5, "{}", spline.modes[0].lambda);
    // Very many points are thinned out for a spline, but refused for straight lines.
    let many: String = (0..=2000)
        .map(|i| core::f64::consts::PI * (i as f64 / 2000.0 - 0.5))
        .map(|a| format!("{:.12},{:.12}\n", a.cos().max(0.0), 1.0 + a.sin()))
        .collect();
    std::fs::write(folder.path().join("many.csv"), many).unwrap();
    let text = "density = 1000.0\npoints = 'many.csv'";
    let said = Tank::parse(text, folder.path()).unwrap_err().to_string();
    assert!(said.contains("2001 points are joined by straight lines, at most 200"), "{said}");
    let tank = Tank::parse(&format!("{text}\nspline = true"), folder.path()).unwrap();
    let lambda = tank.solve(1.0, 2).unwrap().modes[0].lambda;
    assert!((lambda - exact).abs() < 1e-7, "{lambda}");
    // A contour of two points is a cone.
    std::fs::write(folder.path().join("two.csv"), "0,0\n1,2\n").unwrap();
    let cone = Tank::parse("density = 1.0\npoints = 'two.csv'", folder.path()).unwrap();
    let mass = cone.solve(1.0, 1).unwrap().m_liq;
    assert!((mass / (core::f64::consts::PI / 12.0) - 1.0).abs() < 1e-12, "{mass}");
    // The message of a file with a bad line names the line.
    std::fs::write(folder.path().join("bad.csv"), "0,0\n1,zero\n1,1,1\n").unwrap();
    let said =
        Tank::parse("density = 1.0\npoints = 'bad.csv'", folder.path()).unwrap_err().to_string();
    assert!(said.contains("line 2") && said.contains("line 3"), "{said}");
    std::fs::write(folder.path().join("one.csv"), "0,0\n").unwrap();
    let said =
        Tank::parse("density = 1.0\npoints = 'one.csv'", folder.path()).unwrap_err().to_string();
    assert!(said.contains("1 point(s); a contour needs at least two"), "{said}");
}

/// The drawing is in millimetres with y downwards: a hemispherical bottom as an arc, a wall, a top
/// dome as two cubic curves (accurate to 3e-4), closed along the axis.
#[test]
fn a_contour_is_read_from_an_svg_drawing() {
    let folder = tempfile::tempdir().unwrap();
    let read = |path: &str, scale: f64| {
        let svg = format!(
            "<!DOCTYPE svg PUBLIC '-//W3C//DTD SVG 1.1//EN' 'http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd'>
            <svg xmlns='http://www.w3.org/2000/svg'><g><path fill='none' d='{path}'/></g></svg>"
        );
        std::fs::write(folder.path().join("tank.svg"), svg).unwrap();
        let text = format!("density = 1000.0\nsvg = 'tank.svg'\nscale = {scale:?}");
        Tank::parse(&text, folder.path())
    };
    let drawn = "M 0 2000 A 500 500 0 0 0 500 1500 V 500 C 500 223.86 276.14 0 0 0 Z";
    let same = "m 0 2000 a 500 500 0 0 0 500 -500 v -1000 c 0 -276.14 -223.86 -500 -500 -500 z";
    let capsule = solve(
        "profile = [{ arc = [0, 0.5, 0.5, -90, 0] }, { line = [0.5, 0.5, 0.5, 1.5] }, { arc = [0, 1.5, 0.5, 0, 90] }]",
        1.2,
        3,
    );
    for path in [drawn, same] {
        let tank = read(path, 1e-3).unwrap();
        assert!((tank.depth().unwrap() - 2.0).abs() < 1e-12);
        let data = tank.solve(1.2, 3).unwrap();
        for (a, b) in data.modes.iter().zip(&capsule.modes) {
            assert!((a.lambda / b.lambda - 1.0).abs() < 1e-9, "{} {}", a.lambda, b.lambda);
            // the drawing's zero is at the top of the tank
            assert!((a.hinge.unwrap() + 2.0 - b.hinge.unwrap()).abs() < 1e-8);
        }
        assert!((tank.solve(1.8, 1).unwrap().modes[0].lambda / 5.445_194 - 1.0).abs() < 2e-3);
    }
    // A parabola is a quadratic curve: z = r^2 from the axis to r = 1 encloses pi/2 m3.
    for path in ["M 0 1 Q 0.5 1 1 0", "m 0 3 q 0.5 0 1 -1"] {
        let data = read(path, 1.0).unwrap().solve(1.0, 1).unwrap();
        let volume = data.m_liq / 1000.0;
        assert!((volume / core::f64::consts::FRAC_PI_2 - 1.0).abs() < 1e-12, "{path}: {volume}");
        // The centre of mass of this paraboloid is at two thirds of its height.
        let center = data.z_cg - data.z_lowest;
        assert!((center - 2.0 / 3.0).abs() < 1e-12, "{path}: {center}");
    }
    // arcs the long way round and in the other sense: the section of a whole sphere
    let sphere = read("M 0 2 A 1 1 0 0 0 1 1 A 1 1 0 0 0 0 0", 1.0).unwrap();
    assert!((sphere.solve(1.0, 1).unwrap().modes[0].lambda - 1.560_157_174).abs() < 1e-8);
    let whole = read("M 0 2 A 1 1 0 1 0 0 0", 1.0).unwrap();
    assert!((whole.solve(1.0, 1).unwrap().modes[0].lambda - 1.560_157_174).abs() < 1e-8);
    for scale in [0.0, -1.0, f64::INFINITY] {
        let said = read(drawn, scale).unwrap_err().to_string();
        assert!(said.contains("it must be a number above 0, in m per unit"), "{scale}: {said}");
    }
    for (path, words) in [
        ("M 0 2 L 1 2 M 3 3 L 4 4", "several parts"),
        ("M 0 2 A 1 2 30 0 0 1 1", "rotated axes"),
        ("M 0 2 Q", "not valid"),
        (drawn, "millimetres?"),
    ] {
        let said = read(path, 1.0).unwrap_err().to_string();
        assert!(said.contains(words), "{path}: {said}");
    }
}

#[test]
fn every_example_file_of_a_tank_is_read_and_solved() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let tank = Tank::read(&path).unwrap_or_else(|p| panic!("{}: {p}", path.display()));
            let fill = tank.depth().map_or(0.2, |depth| 0.6 * depth);
            assert!(tank.solve(fill, 5).unwrap().error < 1e-6, "{}", path.display());
            count += 1;
        }
    }
    assert!(count >= 6);
}

#[test]
fn a_contour_of_a_tank_with_more_than_200_segments_is_refused() {
    let parsed = |count: usize| {
        let z = |i: usize| i as f64 / (count - 1) as f64;
        let line = |i: usize| format!("{{ line = [1, {}, 1, {}] }}", z(i), z(i + 1));
        let wall: Vec<String> = (0..count - 1).map(line).collect();
        let floor = "{ line = [0, 0, 1, 0] }";
        let text = format!("density = 1.0\nprofile = [{floor}, {}]", wall.join(", "));
        Tank::parse(&text, Path::new(""))
    };
    assert!(parsed(200).is_ok());
    let message = parsed(201).unwrap_err().to_string();
    assert!(message.contains("The contour has 201 segments, at most 200."), "{message}");
}

#[test]
fn a_result_states_if_the_tank_is_a_body_of_revolution_or_a_box() {
    for (text, kind) in [
        ("shape = { cylinder = { radius = 1.0, height = 1.0 } }", "revolution"),
        ("profile = [{ arc = [0, 0, 1, -90, 90] }]", "revolution"),
        ("box = [1.0, 2.0]", "box"),
    ] {
        let tank = tank(&format!("density = 1.0\n{text}"));
        for fill in [0.0, 0.7] {
            let swept = hubslosh_tank::sweep::sweep(&tank, &[fill], 1).unwrap();
            assert_eq!(swept.rows[0].kind, kind, "{text} {fill}");
        }
    }
}

/// Each number of the printed table stands below its heading.
#[test]
fn the_table_has_the_damping_of_every_mode_with_its_frequency_in_hertz() {
    let tank = tank("density = 1000.0\nbox = [0.8, 0.5]");
    let mut data = tank.solve(0.3, 2).unwrap();
    let liquid =
        Liquid { gravity: 9.81, nu: Some(1e-6), sigma: None, contact_angle: 90.0, spin: None };
    data.damping =
        Some(hubslosh_tank::parameters::tank_damping(&tank, &data, 1e-6, liquid).unwrap());
    let damping = data.damping.clone().unwrap();
    let text = table(&data, 9.81);
    assert!(
        text.contains("damping at 9.81 m/s², nu 0.000001 m2/s: ") || text.contains("nu 1e-6 m2/s"),
        "{text}"
    );
    let (_, rows) = text.split_once("damping at").unwrap();
    let numbers: Vec<Vec<f64>> = rows
        .lines()
        .map(|line| line.split_whitespace().filter_map(|word| word.parse().ok()).collect())
        .filter(|row: &Vec<f64>| row.len() == 6)
        .collect();
    let modes = damping.modes.iter().chain(&damping.modes_y);
    assert_eq!((numbers.len(), damping.modes.len(), damping.modes_y.len()), (4, 2, 2), "{text}");
    for ((row, mode), n) in numbers.iter().zip(modes).zip([1.0, 2.0, 1.0, 2.0]) {
        let [low, high] = mode.interval;
        let expected = [n, mode.omega / core::f64::consts::TAU, mode.zeta, low, high, mode.laminar];
        for (found, expected) in row.iter().zip(expected) {
            // The ends of the interval are printed with three digits.
            assert!((found / expected - 1.0).abs() < 5e-3, "{row:?} {expected}");
        }
    }
    assert_eq!(rows.matches("n along y").count(), 1, "{rows}");
}

/// Each dimension is set to its limit, which is refused, and to a value slightly above the limit,
/// which is accepted.
#[test]
fn every_dimension_of_a_shape_has_a_limit_and_the_error_names_the_dimension() {
    let dome = |bottom: f64, top: f64| {
        format!(
            "domed_cylinder = {{ radius = 1.0, height = 0.5, bottom = {bottom:?}, top = {top:?} }}"
        )
    };
    let dish = |crown: f64, knuckle: f64| {
        let ends = format!("crown_radius = {crown:?}, knuckle_radius = {knuckle:?}");
        format!("torispherical = {{ radius = 1.0, height = 0.5, {ends} }}")
    };
    let shape = |name: &str, dimensions: &[(&str, f64)]| {
        let all: Vec<_> = dimensions.iter().map(|(name, x)| format!("{name} = {x:?}")).collect();
        format!("{name} = {{ {} }}", all.join(", "))
    };
    type Case<'a> = (&'a str, f64, &'a dyn Fn(f64) -> String);
    let cases: [Case; 18] = [
        ("radius", 0.0, &|x| shape("cylinder", &[("radius", x), ("height", 1.0)])),
        ("height", 0.0, &|x| shape("cylinder", &[("radius", 1.0), ("height", x)])),
        ("radius", 0.0, &|x| shape("sphere", &[("radius", x)])),
        ("radius", 0.0, &|x| shape("spheroid", &[("radius", x), ("half_height", 1.0)])),
        ("half_height", 0.0, &|x| shape("spheroid", &[("radius", 1.0), ("half_height", x)])),
        ("half_angle", 0.0, &|x| shape("cone", &[("half_angle", 300.0 * x), ("height", 1.0)])),
        ("90 - half_angle", 0.0, &|x| {
            shape("cone", &[("half_angle", 90.0 - 300.0 * x), ("height", 1.0)])
        }),
        ("height", 0.0, &|x| shape("cone", &[("half_angle", 30.0), ("height", x)])),
        ("bottom", -0.5, &|x| dome(x, 0.5)),
        ("top", -f64::MIN_POSITIVE, &|x| dome(0.0, x)),
        ("crown_radius", 1.0, &|x| dish(x, 0.1)),
        ("knuckle_radius", 0.0, &|x| dish(1.5, x)),
        ("radius - knuckle_radius", 0.0, &|x| dish(1.5, 1.0 - x)),
        ("inner_radius", 0.0, &|x| {
            shape("annulus", &[("inner_radius", x), ("outer_radius", 1.0), ("height", 1.0)])
        }),
        ("outer_radius", 0.4, &|x| {
            shape("annulus", &[("inner_radius", 0.4), ("outer_radius", x), ("height", 1.0)])
        }),
        ("height", 0.0, &|x| {
            shape("annulus", &[("inner_radius", 0.4), ("outer_radius", 1.0), ("height", x)])
        }),
        ("tube_radius", 0.0, &|x| shape("torus", &[("ring_radius", 1.0), ("tube_radius", x)])),
        ("ring_radius", 0.4, &|x| shape("torus", &[("ring_radius", x), ("tube_radius", 0.4)])),
    ];
    for (name, limit, with) in cases {
        let said = problems(&format!("shape = {{ {} }}", with(limit)));
        let words = format!("shape: {name} is {limit}; it must be a number above {limit}.");
        assert!(said.contains(&words), "{said}\n{words}");
        assert_eq!(said.lines().count(), 1, "{said}");
        tank(&format!("density = 1.0\nshape = {{ {} }}", with(limit + 0.01)));
    }
}

#[test]
fn the_first_slosh_mode_of_a_tank_has_the_number_1() {
    for text in [
        "shape = { cylinder = { radius = 1.0, height = 1.0 } }",
        "shape = { annulus = { inner_radius = 0.3, outer_radius = 1.0, height = 2.0 } }",
        "shape = { sphere = { radius = 1.0 } }",
        "box = [1.0, 2.0]",
    ] {
        let data = solve(text, 0.7, 3);
        let numbers = |modes: &[hubslosh_tank::Mode]| modes.iter().map(|m| m.n).collect::<Vec<_>>();
        assert_eq!(numbers(&data.modes), [1, 2, 3], "{text}");
        for axis in data.axes.iter().flat_map(|axes| [&axes.x, &axes.y]) {
            assert_eq!(numbers(&axis.modes), [1, 2, 3], "{text}");
        }
        let rest: Vec<_> = data.rest.iter().map(|rest| rest.modes).collect();
        assert_eq!(rest, [1, 2, 3], "{text}");
        // A mode of a tank with an inner wall has a wave at this wall, too.
        let inner = data.modes.iter().all(|mode| mode.wave_inner.is_some());
        let none = data.modes.iter().all(|mode| mode.wave_inner.is_none());
        assert_eq!((inner, none), (text.contains("annulus"), !text.contains("annulus")), "{text}");
    }
}

#[test]
fn a_table_at_0_gravity_has_a_note_that_only_capillarity_restores_the_liquid() {
    let sphere = tank("density = 1000.0\nshape = { sphere = { radius = 1.0 } }");
    let said = |fill: f64, gravity: f64| {
        let text = table(&sphere.solve(fill, 1).unwrap(), gravity);
        (text.contains("only capillarity brings the liquid back"), text.contains("does not slosh"))
    };
    assert_eq!(said(1.0, 0.0), (true, false));
    assert_eq!(said(1.0, 9.81), (false, false));
    assert_eq!(said(2.0, 0.0), (false, true));
}

#[test]
fn a_tank_drawn_far_above_its_zero_does_not_count_as_large() {
    let far = solve("profile = [{ line = [0, 80, 1, 80] }, { line = [1, 80, 1, 81] }]", 0.5, 1);
    assert!((far.m_liq / (500.0 * core::f64::consts::PI) - 1.0).abs() < 1e-12);
}

#[test]
fn a_contour_of_more_than_201_points_without_a_spline_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let read = |count: usize| {
        let angle = |i: usize| 3.0 * i as f64 / (count - 1) as f64;
        let rows: String =
            (0..count).map(|i| format!("{},{}\n", angle(i).sin(), 1.0 - angle(i).cos())).collect();
        std::fs::write(folder.path().join("points.csv"), rows).unwrap();
        Tank::parse("density = 1.0\npoints = 'points.csv'", folder.path())
    };
    assert!(read(201).is_ok(), "{:?}", read(201));
    let said = read(202).unwrap_err().to_string();
    assert!(said.contains("202 points are joined by straight lines, at most 200"), "{said}");
}

#[test]
fn parameter_files_use_the_damping_of_their_own_liquid_and_not_of_the_result() {
    let text = "density = 875.0\n\
        shape = { domed_cylinder = { radius = 0.45, height = 0.9, bottom = 0.45, top = 0.45 } }\n";
    let tank = tank(text);
    let liquid = Liquid {
        gravity: 0.2,
        nu: Some(8.9e-7),
        sigma: Some(0.03),
        contact_angle: 90.0,
        spin: None,
    };
    let whole = parameters::solve(&tank, Fill::Share(0.4), 2, liquid).unwrap();
    let fill = tank.fill_height(Fill::Share(0.4)).unwrap();
    let plain = tank.solve(fill, 2).unwrap();
    assert!(whole.damping.is_some() && plain.damping.is_none());
    for other in [
        liquid,
        Liquid { nu: Some(1e-6), ..liquid },
        Liquid { gravity: 0.3, ..liquid },
        Liquid { sigma: None, ..liquid },
        Liquid { sigma: Some(0.02), ..liquid },
        Liquid { nu: None, ..liquid },
    ] {
        let [known, new] =
            [&whole, &plain].map(|data| ParameterSet::new(&tank, data, Target::SloshTank, other));
        assert_eq!(known.unwrap(), new.unwrap(), "{other:?}");
    }
}

#[test]
fn the_mass_without_modes_equals_the_mass_of_the_solution_with_modes() {
    for text in [
        "shape = { sphere = { radius = 0.4 } }",
        "shape = { cylinder = { radius = 0.4, height = 0.8 } }",
        "shape = { annulus = { inner_radius = 0.1, outer_radius = 0.4, height = 0.8 } }",
        "box = [0.3, 0.5]",
    ] {
        let tank = tank(&format!("density = 1000.0\n{text}\n"));
        for fill in [0.01, 0.4, 0.7, 0.8] {
            assert_eq!(tank.mass(fill).unwrap(), tank.solve(fill, 1).unwrap().m_liq, "{text}");
        }
        assert!(tank.mass(-0.1).is_err(), "{text}");
    }
}

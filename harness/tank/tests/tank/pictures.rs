use std::path::Path;

use crate::liquid_figure;
use hubslosh_tank::sweep::sweep;
use hubslosh_tank::third_order::Overlaps;
use hubslosh_tank::{Tank, picture, table};

/// Asserts that the drawing `svg` equals the committed `file`. If `HUBSLOSH_DRAW` is set, the drawing is written to this file
/// instead, so that it can be looked at.
fn is_drawn(svg: &str, file: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    if std::env::var_os("HUBSLOSH_DRAW").is_some() {
        std::fs::write(&path, svg).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap();
    let differs = committed.lines().zip(svg.lines()).find(|(a, b)| a != b);
    assert!(committed == svg, "{file}: {differs:?}");
}

#[test]
fn the_committed_figure_of_the_documentation_equals_the_drawn_figure() {
    let svg = liquid_figure::draw(&Overlaps::new(40));
    is_drawn(&svg, "../../modelDescription/HubSlosh/documentation/liquid.svg");
}

/// The expected pictures, of a tank with a dome, its modes and its sweep, were inspected by eye
/// once.
#[test]
fn pictures_of_a_tank_and_its_sweep_equal_the_inspected_ones() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/common_bulkhead.toml");
    let tank = Tank::read(&path).unwrap();
    let depth = tank.depth().unwrap();
    let data = tank.solve(0.55 * depth, 3).unwrap();
    is_drawn(&picture::tank(&tank, &data, 9.80665), "tests/tank/drawn/tank.svg");
    let fills: Vec<f64> = (1..10).map(|i| 0.1 * depth * f64::from(i)).collect();
    let swept = sweep(&tank, &fills, 3).unwrap();
    is_drawn(&picture::sweep(&tank, &swept, 9.80665), "tests/tank/drawn/sweep.svg");
}

fn curves(svg: &str) -> Vec<&str> {
    svg.lines().filter(|line| line.contains(" fill=\"none\"") && line.contains("width")).collect()
}

/// Two drawings of a tank and of the same tank scaled by a factor differ only in the numbers at the
/// axes.
#[test]
fn the_picture_of_a_scaled_tank_has_identical_lines() {
    let drawn = |factor: f64| {
        let text = format!("density = 1.0\nprofile = [{{ arc = [0, 0, {factor}, -90, 90] }}]");
        let tank = Tank::parse(&text, Path::new("")).unwrap();
        let data = tank.solve(0.7 * factor, 3).unwrap();
        let fills = [0.5, 1.0, 1.5].map(|fill| fill * factor);
        let swept = sweep(&tank, &fills, 3).unwrap();
        [picture::tank(&tank, &data, 9.80665), picture::sweep(&tank, &swept, 9.80665)]
    };
    let [small, large] = [1.0, 4.0].map(drawn);
    for (small, large) in small.iter().zip(&large) {
        assert!(curves(small).len() > 8);
        assert_eq!(curves(small), curves(large));
        assert_ne!(small, large);
    }
}

#[test]
fn a_sweep_with_equal_values_at_all_fills_can_be_drawn() {
    let text = "density = 1.0\nprofile = [{ arc = [0, 0, 1, -90, 90] }]";
    let tank = Tank::parse(text, Path::new("")).unwrap();
    let swept = sweep(&tank, &[0.5, 1.0, 2.0], 2).unwrap();
    let svg = picture::sweep(&tank, &swept, 0.0);
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    // Ticks every 0.1 and 0.2 over a width of 1 are few texts.
    assert!(svg.matches("<text").count() < 80, "{}", svg.matches("<text").count());
    // Every curve lies inside the picture.
    let view = svg.split("viewBox=\"0 0 ").nth(1).unwrap().split('"').next().unwrap();
    let size: Vec<f64> = view.split(' ').map(|x| x.parse().unwrap()).collect();
    for line in curves(&svg) {
        let path = line.split('"').nth(1).unwrap();
        for point in path.split(['M', 'L']).skip(1) {
            let place: Vec<f64> = point.split(' ').map(|x| x.parse().unwrap()).collect();
            assert!((0.0..=size[0]).contains(&place[0]), "{line}");
            assert!((0.0..=size[1]).contains(&place[1]), "{line}");
        }
    }
}

#[test]
fn every_example_tank_can_be_drawn_and_tabulated() {
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

fn points(path: &str) -> Vec<[f64; 2]> {
    let place = |point: &str| -> [f64; 2] {
        let (x, y) = point.trim_end_matches('Z').split_once(' ').unwrap();
        [x.parse().unwrap(), y.parse().unwrap()]
    };
    path.split(['M', 'L']).skip(1).map(place).collect()
}

/// Areas are divided by the squared distance from the axis to the tank's wall, so that they do not
/// depend on the scale of the drawing; for example, a cylinder must have the area fill/radius. The
/// tolerance is a hundredth of a pixel of some hundred pixels.
#[test]
fn the_drawn_liquid_has_the_area_of_the_wetted_section() {
    for (text, fill, area) in [
        ("shape = { cylinder = { radius = 2.0, height = 3.0 } }", 1.0, 0.5),
        (
            "shape = { annulus = { inner_radius = 0.5, outer_radius = 2.0, height = 3.0 } }",
            1.0,
            0.375,
        ),
        ("shape = { cone = { half_angle = 45.0, height = 1.0 } }", 0.5, 0.125),
        ("profile = [{ arc = [0, 0, 1, -90, 90] }]", 1.0, core::f64::consts::PI / 4.0),
        ("box = [4.0, 9.0]", 1.0, 0.5),
    ] {
        let tank = Tank::parse(&format!("density = 1.0\n{text}"), Path::new("")).unwrap();
        let svg = picture::tank(&tank, &tank.solve(fill, 1).unwrap(), 9.81);
        let path = |part: &str| -> Vec<Vec<[f64; 2]>> {
            let paths = svg.lines().filter(|line| line.contains(part));
            let paths = paths.map(|line| line.split('"').nth(1).unwrap());
            paths.filter(|path| !path.contains('h')).map(points).collect()
        };
        let [right, left] = &path("fill=\"#dcecf7\"")[..] else { panic!("{text}") };
        let [wall, _] = &path("stroke-width=\"2\"")[..2] else { panic!("{text}") };
        let axis = 0.5 * (right[1][0] + left[1][0]);
        let radius = wall.iter().map(|p| p[0] - axis).fold(0.0, f64::max);
        for side in [right, left] {
            let closed = side.iter().zip(side.iter().cycle().skip(1));
            let twice: f64 = closed.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
            let found = 0.5 * twice.abs() / (radius * radius);
            assert!((found / area - 1.0).abs() < 1e-3, "{text}: {found} {area}");
            // no liquid is drawn on the other side of the axis
            assert!(side.iter().all(|p| (p[0] - axis) * (side[1][0] - axis) >= 0.0), "{text}");
        }
        // A box has no upper end; it is drawn a quarter higher than its liquid.
        if text.starts_with("box") {
            let heights = |points: &[[f64; 2]]| {
                let of =
                    |f: fn(f64, f64) -> f64, from: f64| points.iter().map(|p| p[1]).fold(from, f);
                of(f64::max, f64::MIN) - of(f64::min, f64::MAX)
            };
            assert!((heights(wall) / heights(right) - 1.25).abs() < 1e-3);
        }
    }
}

//! Damping as a function of the fill and of the shape of a tank has no steps, and follows one rule on both
//! sides of each transition.

use crate::common::tank;
use formulas::damping;
use hubslosh_tank::Tank;
use hubslosh_tank::modal::Damping;
use hubslosh_tank::parameters::{Liquid, tank_damping};

/// Kinematic viscosity, m²/s, and specific force, m/s², at which most of the tanks are within the
/// range of the correlation for spheres.
const SLOW: [f64; 2] = [1e-6, 0.3];

fn damping_at(tank: &Tank, fill: f64, [nu, gravity]: [f64; 2]) -> Damping {
    let data = tank.solve(fill, 1).unwrap();
    let liquid = Liquid { gravity, nu: Some(nu), sigma: None, contact_angle: 90.0, spin: None };
    tank_damping(tank, &data, nu, liquid).unwrap()
}

fn tank_with(shape: &str) -> Tank {
    tank(&format!("density = 1000.0\n{shape}"))
}

/// Name, tank, and liquid (viscosity, specific force) of each test. Cone, sphere and torus have one
/// correlation at every fill, the box has none, and the cylinder has two. The walls of capsule,
/// cylinder with a dome, cone with a cylinder, and dish are a measured shape up to a tangent point
/// or a corner.
const TANKS: [(&str, &str, [f64; 2]); 9] = [
    ("sphere", "shape = { sphere = { radius = 0.3 } }", SLOW),
    (
        "capsule",
        "shape = { domed_cylinder = { radius = 0.3, height = 0.4, bottom = 0.3, top = 0.3 } }",
        SLOW,
    ),
    ("cone", "shape = { cone = { half_angle = 30, height = 1.0 } }", SLOW),
    ("torus", "shape = { torus = { ring_radius = 0.3, tube_radius = 0.0635 } }", [3.3e-6, 9.81]),
    ("box", "box = [0.8, 0.5]", SLOW),
    ("cylinder", "shape = { cylinder = { radius = 0.3, height = 0.9 } }", SLOW),
    (
        "cylinder with a dome",
        "shape = { domed_cylinder = { radius = 0.3, height = 0.4, bottom = 0, top = 0.3 } }",
        SLOW,
    ),
    (
        "cone with a cylinder",
        "profile = [{ line = [0, 0, 0.3, 0.5] }, { line = [0.3, 0.5, 0.3, 1] }]",
        SLOW,
    ),
    (
        "dish",
        "shape = { torispherical = { radius = 0.3, height = 0.3, crown_radius = 0.6, knuckle_radius = 0.06 } }",
        SLOW,
    ),
];

/// Returns the largest relative changes between `count` + 1 neighbouring fills from the fill `from`
/// on, which are 0.1 % of the tank's height apart. The first number is the change of the damping
/// ratio. The other three are changes of the damping ratio and of both ends of its interval after
/// division by the damping of the laminar layer, because this damping changes with the fill, too.
fn largest_steps(tank: &Tank, liquid: [f64; 2], from: f64, count: usize) -> [f64; 4] {
    let depth = tank.depth().unwrap_or(1.0);
    let numbers = |i: usize| {
        let mode = damping_at(tank, from + 1e-3 * depth * i as f64, liquid).modes[0];
        let [zeta, low, high] = [mode.zeta, mode.interval[0], mode.interval[1]];
        [zeta, zeta / mode.laminar, low / mode.laminar, high / mode.laminar]
    };
    let mut worst = [0.0_f64; 4];
    let mut last = numbers(0);
    for i in 1..=count {
        let next = numbers(i);
        worst = std::array::from_fn(|k| worst[k].max((next[k] / last[k] - 1.0).abs()));
        last = next;
    }
    worst
}

#[test]
#[ignore = "minutes: .ci/run --nightly"]
fn the_damping_ratio_has_no_step_at_500_fills() {
    // At a corner of the wall the laminar layer itself changes by 3 % from fill to fill, for example in the
    // cone with a cylinder.
    for (name, shape, liquid) in &TANKS[..7] {
        let tank = tank_with(shape);
        let from = 0.25 * tank.depth().unwrap_or(1.0);
        let [zeta, ..] = largest_steps(&tank, *liquid, from, 500);
        assert!(zeta < 0.01, "{name}: {zeta}");
    }
}

/// Covers each place where a wall stops being a measured shape (tangent point, shoulder, corner,
/// knuckle), the ends of the measured ranges, and the fill of a torus at which its correlation
/// falls below the damping of the laminar layer.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn damping_has_no_step_where_a_wall_stops_being_a_measured_shape() {
    for (name, levels) in [
        ("sphere", &[0.03][..]),
        ("capsule", &[0.3, 0.7]),
        ("torus", &[0.1 * 0.127, 0.68 * 0.127, 0.73 * 0.127, 0.9 * 0.127]),
        ("cylinder", &[0.12, 0.135, 0.15]),
        ("cylinder with a dome", &[0.4]),
        ("cone with a cylinder", &[0.5]),
        ("dish", &[0.0667]),
    ] {
        let (_, shape, liquid) = TANKS.into_iter().find(|tank| tank.0 == name).unwrap();
        let tank = tank_with(shape);
        for level in levels {
            let from = level - 4.5e-3 * tank.depth().unwrap();
            let [_, factor, low, high] = largest_steps(&tank, liquid, from, 8);
            assert!(
                factor < 0.01 && low < 0.01 && high < 0.01,
                "{name} at {level}: {factor} {low} {high}"
            );
        }
    }
}

#[test]
fn a_capsule_has_the_damping_factor_of_its_dome_on_the_area_of_the_dome() {
    let (_, shape, liquid) = TANKS[1];
    let tank = tank_with(shape);
    let ratio = |fill: f64| {
        let mode = damping_at(&tank, fill, liquid).modes[0];
        mode.zeta / mode.laminar
    };
    // the damping above the tangent point stays 3.16 times the damping of the laminar layer, and does not
    // fall to 1.45 times
    assert!((ratio(0.3001) / ratio(0.3) - 1.0).abs() < 2e-3);
    let full = damping_at(&tank, 0.7, liquid);
    let [part] = &full.parts[..] else { panic!("{full:?}") };
    // The dome is 0.3 m of a wetted height of 0.7 m; the lowest part of the cylinder counts as sphere in part.
    assert!(part.shape == "sphere" && (3.0 / 7.0..0.52).contains(&part.share), "{part:?}");
    let mean = 1.45 + part.share * (part.factor - 1.45);
    assert!((full.modes[0].zeta / full.modes[0].laminar / mean - 1.0).abs() < 1e-12);
    assert_eq!((full.shape, full.correlation), ("other", None));
    for words in ["of the wetted wall is a sphere", "disagree", "low end for stability"] {
        assert!(full.taken.contains(words), "{words}: {}", full.taken);
    }
}

/// A wall that has a measured shape only in part has two estimates of its damping: the correlation
/// of that shape, and 1.45 times the damping of the laminar layer, which is used for unmeasured
/// shapes.
#[test]
fn damping_of_a_partly_measured_wall_lies_between_the_measured_and_the_general_estimate() {
    let walls = [
        ("capsule", [0.32, 0.5, 0.9]),
        ("dish", [0.07, 0.2, 0.4]),
        ("cone with a cylinder", [0.51, 0.6, 0.9]),
    ];
    for (name, fills) in walls {
        let (_, shape, liquid) = TANKS.into_iter().find(|tank| tank.0 == name).unwrap();
        for fill in fills {
            let found = damping_at(&tank_with(shape), fill, liquid);
            let mode = found.modes[0];
            let [part] = &found.parts[..] else { panic!("{name} {fill}: {found:?}") };
            let both = [1.45, part.factor].map(|factor| factor * mode.laminar);
            let [low, high] = mode.interval;
            assert!(both.into_iter().all(|zeta| low < zeta && zeta < high), "{name} {fill}");
            assert!(
                both[0].min(both[1]) < mode.zeta && mode.zeta < both[0].max(both[1]),
                "{name} {fill}"
            );
        }
    }
}

/// The dimensions of spheroids and capsules change gradually until the shape is a sphere. At 0.8 of
/// its height, the sphere has ten times the damping of the laminar layer.
#[test]
#[ignore = "five seconds of CPU time: .ci/long-tests"]
fn shapes_close_to_a_sphere_have_the_damping_of_the_sphere() {
    let solved = |e: f64| {
        let height = 0.3 * (1.0 + e);
        let tank = tank_with(&format!(
            "shape = {{ spheroid = {{ radius = 0.3, half_height = {height:?} }} }}"
        ));
        damping_at(&tank, 1.6 * height, SLOW)
    };
    let spheroid = |e: f64| solved(e).modes[0].zeta;
    let capsule = |e: f64| {
        let height = 0.6 * e;
        let text = format!(
            "shape = {{ domed_cylinder = {{ radius = 0.3, height = {height:?}, bottom = 0.3, top = 0.3 }} }}"
        );
        damping_at(&tank_with(&text), 0.48 * (1.0 + e), SLOW).modes[0].zeta
    };
    let sphere =
        damping_at(&tank_with("shape = { sphere = { radius = 0.3 } }"), 0.48, SLOW).modes[0].zeta;
    for e in [1e-7, 5e-6, 1e-3] {
        for zeta in [spheroid(e), spheroid(-e), capsule(e)] {
            assert!((zeta / sphere - 1.0).abs() < 1e-5 + 10.0 * e, "{e:e}: {zeta} {sphere}");
        }
    }
    // The heights of neighbouring spheroids differ by 0.5 %, and all together cover the transition.
    let all: Vec<f64> = (-6..=6).map(|i| spheroid(5e-3 * f64::from(i))).collect();
    for pair in all.windows(2) {
        assert!((pair[1] / pair[0]).ln().abs() < 0.5, "{all:?}");
    }
    assert!(all[0] < 0.4 * sphere && all[12] < 0.4 * sphere && all[6] == sphere);
    for e in [-0.05, -0.02, 0.02, 0.05] {
        let found = solved(e);
        let [low, high] = found.modes[0].interval;
        assert!(low < sphere && sphere < high, "{e}: {low} {sphere} {high}");
        assert!(found.taken.contains("a sphere, whose correlation"), "{}", found.taken);
    }
}

#[test]
fn a_wall_with_a_measured_shape_has_the_damping_of_its_published_correlation() {
    let close = |found: f64, expected: f64| {
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}")
    };
    let [nu, g] = SLOW;
    for x in [0.11, 0.5, 1.0, 1.3, 1.89] {
        let sphere = tank_with("shape = { sphere = { radius = 0.3 } }");
        close(
            damping_at(&sphere, 0.3 * x, SLOW).modes[0].zeta,
            damping::sphere(0.3, 0.3 * x, nu, g),
        );
    }
    for x in [0.1, 0.39, 0.5, 0.8, 2.0] {
        let cylinder = tank_with("shape = { cylinder = { radius = 0.3, height = 0.9 } }");
        let formula = if x < 0.5 { damping::stephens } else { damping::mikishev_dorozhkin };
        close(damping_at(&cylinder, 0.3 * x, SLOW).modes[0].zeta, formula(0.3, 0.3 * x, nu, g));
    }
    for angle in [20.0, 44.0] {
        let cone =
            tank_with(&format!("shape = {{ cone = {{ half_angle = {angle:?}, height = 1.0 }} }}"));
        let radius = 0.5 * f64::to_radians(angle).tan();
        close(damping_at(&cone, 0.5, SLOW).modes[0].zeta, damping::cone(radius, angle, nu, g));
    }
    let (_, shape, [nu, g]) = TANKS[3];
    let torus = damping_at(&tank_with(shape), 0.86 * 0.127, [nu, g]);
    close(torus.modes[0].zeta, damping::torus(0.0635, 0.86 * 0.127, nu, g));
    let wave = damping_at(&tank_with("box = [0.8, 0.5]"), 0.4, SLOW).modes[0];
    let layer = &hubslosh_tank::closed_form::box_axis(0.8, 0.5, 0.4, 1.0, 1).modes[0];
    close(wave.zeta, 1.45 * damping::laminar(layer.beta, SLOW[0], (SLOW[1] * layer.lambda).sqrt()));
}

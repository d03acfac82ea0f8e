//! Coefficients of the first mode at finite amplitude.

use formulas::energy_terms::energy_terms;
use hubslosh_tank::coefficients::{Coefficients, EnergySource, FiniteAmplitude, LimitSource};
use hubslosh_tank::fill_table;
use hubslosh_tank::finite_amplitude::{add_large_waves, amplitude_dependence};
use hubslosh_tank::interpolation::Monotone;
use hubslosh_tank::parameters::{
    self, Liquid, ParameterSet, Target, Value, surface_tension_warnings,
};
use hubslosh_tank::sweep::sweep;
use hubslosh_tank::{Fill, Tank, table};

use crate::common::tank;

fn amplitude_dependence_at(text: &str, fill: f64) -> FiniteAmplitude {
    let tank = tank(&format!("density = 1000.0\n{text}"));
    amplitude_dependence(&tank, &tank.solve(fill, 1).unwrap())
}

fn coefficients_at(text: &str, fill: f64) -> Coefficients {
    let found = amplitude_dependence_at(text, fill);
    found.mode.unwrap_or_else(|| panic!("{text} {fill} {found:?}"))
}

fn assert_unknown(text: &str, fill: f64, why: &str) {
    let found = amplitude_dependence_at(text, fill);
    assert_eq!((found.mode, found.mode_y), (None, None), "{text} {fill}");
    assert!(found.warnings[0].contains(why), "{text} {fill} {found:?}");
    assert!(found.warnings[0].contains("pendulum"), "{found:?}");
}

/// Each pair has a slosh angle, degrees, and the frequency at this angle divided by the frequency
/// of small waves, from potential flow without expansion in the steepness. At 8 degrees terms of
/// the fifth order contribute 3e-4.
#[test]
fn backbone_curves_of_the_bench_equal_those_of_fully_nonlinear_flow() {
    for (fill, planar, circular) in [
        (0.1, [(4.0, 0.998962), (8.0, 0.995954)], [(4.0, 1.00091), (6.0, 1.00208)]),
        (0.05, [(4.0, 0.999368), (8.0, 0.997373)], [(4.0, 1.00104), (6.0, 1.00238)]),
    ] {
        let known =
            coefficients_at("shape = { cylinder = { radius = 0.0815, height = 0.2 } }", fill);
        let (s, kappa) = (known.nonlinear_inertia, known.nonlinear_stiffness);
        assert!((known.planar - (0.375 * kappa - 0.5 * s)).abs() < 1e-12, "{known:?}");
        assert!((known.circular.unwrap() - 0.5 * kappa).abs() < 1e-12, "{known:?}");
        let shifts = [known.planar, known.circular.unwrap()];
        for (shift, exact) in shifts.into_iter().zip([planar, circular]) {
            for (angle, ratio) in exact {
                let third = (1.0 + shift * f64::to_radians(angle).powi(2)).sqrt();
                assert!((third - ratio).abs() < 4e-4, "{fill} {angle} {third} {ratio}");
            }
        }
    }
}

/// The tank is given as a shape, as a profile, and with a bottom that is almost but not exactly
/// flat, which the method for any contour solves.
#[test]
fn the_methods_for_flat_bottoms_and_for_any_contour_agree_within_their_errors() {
    for fill in [0.5, 1.3, 2.5] {
        let shape = coefficients_at("shape = { cylinder = { radius = 1.0, height = 3.0 } }", fill);
        let profile =
            coefficients_at("profile = [{ line = [0, 0, 1, 0] }, { line = [1, 0, 1, 3] }]", fill);
        assert_eq!(shape, Coefficients { series_limit: shape.series_limit, ..profile });
        let domed = coefficients_at(
            "profile = [{ line = [0, 0, 1, 1e-5] }, { line = [1, 1e-5, 1, 3] }]",
            fill,
        );
        assert!(domed.error < 1e-3 && shape.error < 1e-4, "{domed:?} {shape:?}");
        let allowed = shape.error + domed.error + 1e-4;
        for (a, b) in [
            (shape.nonlinear_inertia, domed.nonlinear_inertia),
            (shape.nonlinear_stiffness, domed.nonlinear_stiffness),
        ] {
            assert!((a - b).abs() < allowed * (1.0 + a.abs()), "{fill} {a} {b}");
        }
        assert!((shape.wave_second / domed.wave_second - 1.0).abs() < 2e-3, "{shape:?} {domed:?}");
    }
}

/// A scaled tank has the same coefficients, and a capsule that is filled only within its lower half
/// sphere has the sphere's coefficients.
#[test]
fn third_order_coefficients_depend_only_on_the_shape_of_the_liquid() {
    let sphere = coefficients_at("shape = { sphere = { radius = 1.0 } }", 0.5);
    let small = coefficients_at("shape = { sphere = { radius = 0.01 } }", 0.005);
    let capsule =
        "shape = { domed_cylinder = { radius = 1.0, height = 1.0, bottom = 1.0, top = 1.0 } }";
    let capsule = coefficients_at(capsule, 0.5);
    for (other, scale) in [(small, 0.01), (capsule, 1.0)] {
        assert!((sphere.nonlinear_inertia - other.nonlinear_inertia).abs() < 1e-6, "{other:?}");
        assert!((sphere.nonlinear_stiffness - other.nonlinear_stiffness).abs() < 1e-6, "{other:?}");
        assert!((scale * sphere.wave_second - other.wave_second).abs() < 1e-6 * scale);
    }
    assert!((sphere.angle_limit - small.angle_limit).abs() < 1e-6, "{small:?}");
    // The capsule is not a sphere above its joint, where large waves reach, so that its limit is an estimate.
    assert!(capsule.angle_limit < sphere.angle_limit, "{capsule:?}");
}

/// Large-wave coefficients are left out for a ring with inclined walls, for a nearly full sphere,
/// and at depths with secondary resonances.
#[test]
fn unknown_large_wave_coefficients_are_left_out_with_a_reason() {
    assert_unknown(
        "shape = { torus = { ring_radius = 1.0, tube_radius = 0.3 } }",
        0.3,
        "ring of liquid",
    );
    assert_unknown("shape = { sphere = { radius = 1.0 } }", 1.95, "are known to");
    assert_unknown("shape = { sphere = { radius = 1.0 } }", 1.12, "mode (2,2)");
    let shallow =
        amplitude_dependence_at("shape = { cylinder = { radius = 1.0, height = 2.0 } }", 0.1);
    assert!(
        shallow.mode.is_some() && shallow.warnings[0].contains("hold up to 1.7"),
        "{shallow:?}"
    );
}

/// Near the poles of the third-order theory a cylinder gets interpolated values of s and kappa.
#[test]
fn a_cylinder_has_large_wave_coefficients_and_angle_limits_at_every_depth() {
    let at =
        |fill: f64| coefficients_at("shape = { cylinder = { radius = 1.0, height = 4.0 } }", fill);
    for i in 0..=60 {
        let fill = 0.25 + 0.05 * f64::from(i);
        let mode = at(fill);
        assert_eq!(mode.angle_limit_from, LimitSource::PotentialFlow);
        assert_eq!(mode.bridged, fill > 0.7 && fill < 1.2, "{fill}");
        assert!(mode.angle_limit <= mode.frequency_limit.unwrap(), "{fill}");
        assert_eq!(mode.swirl_limit.is_some(), fill > 0.649, "{fill}");
        assert!((0.6..12.0).contains(&mode.nonlinear_stiffness), "{fill} {mode:?}");
    }
    for (fill, frequency, forced) in [(0.25, 4.4, 1.3), (0.4, 11.5, 4.7), (0.5, 14.6, 6.5)] {
        let mode = at(fill);
        let limits = [mode.frequency_limit.unwrap(), mode.angle_limit].map(f64::to_degrees);
        for (limit, expected) in limits.into_iter().zip([frequency, forced]) {
            assert!((limit - expected).abs() < 0.1, "{fill} {limits:?}");
        }
    }
    let bridged =
        amplitude_dependence_at("shape = { cylinder = { radius = 1.0, height = 2.0 } }", 0.8314);
    assert!(bridged.warnings[0].contains("interpolated between h/R 0.7 and 1.2"), "{bridged:?}");
    assert!(bridged.warnings[1].contains("folds the branch of rotary motion"), "{bridged:?}");
    let other = coefficients_at("shape = { sphere = { radius = 1.0 } }", 1.5);
    assert_eq!((other.angle_limit_from, other.frequency_limit), (LimitSource::Estimate, None));
    assert!(other.angle_limit < 0.61 * other.series_limit, "{other:?}");
}

/// Both models of a sphere are valid up to the angle at which their response differs by 3 % from
/// forced waves of potential flow. At fills outside the table the limit is an estimate; at h/R =
/// 1.5 it must be smaller than the 2.6 degrees of the forced waves.
#[test]
fn angle_limits_of_a_sphere_follow_from_its_forced_waves() {
    let at = |fill: f64| coefficients_at("shape = { sphere = { radius = 1.0 } }", fill);
    for i in 0..=19 {
        let fill = 0.1 + 0.05 * f64::from(i);
        let mode = at(fill);
        let [limit, frequency] =
            [mode.angle_limit, mode.frequency_limit.unwrap()].map(f64::to_degrees);
        assert!(limit < frequency && (7.0..10.3).contains(&limit), "{fill} {limit} {frequency}");
        let energy = mode.energy.unwrap();
        assert!(energy.angle_limit <= energy.frequency_limit, "{fill}");
        assert!((8.1..14.1).contains(&energy.angle_limit.to_degrees()), "{fill}");
        assert!((7.5..9.1).contains(&energy.swirl_limit.unwrap().to_degrees()), "{fill}");
        assert_eq!(mode.angle_limit_from, LimitSource::PotentialFlow);
    }
    let deep = at(1.5);
    assert_eq!(deep.angle_limit_from, LimitSource::Estimate);
    assert!(deep.angle_limit.to_degrees() < 2.62, "{deep:?}");
}

/// The FMU's test with forced waves reads its coefficients and limits from a file, and they must be
/// those that `hubslosh tank` writes.
#[test]
fn the_test_of_forced_waves_uses_the_coefficients_and_limits_of_parameter_files() {
    let rows = include_str!("../../../../fmu/craft/tests/craft/forced_waves.csv").lines().skip(1);
    let rows: Vec<Vec<&str>> = rows.map(|row| row.split(',').collect()).collect();
    let mut compared = Vec::new();
    for row in &rows {
        if compared.contains(&(row[0], row[1])) {
            continue;
        }
        compared.push((row[0], row[1]));
        let number = |i: usize| row[i].parse::<f64>().unwrap();
        let text = match row[0] {
            "sphere" => "shape = { sphere = { radius = 1.0 } }",
            _ => "shape = { cylinder = { radius = 1.0, height = 4.0 } }",
        };
        let mode = coefficients_at(text, number(1));
        let ([s, kappa], planar, rotary) = match mode.energy {
            Some(of) => {
                ([of.nonlinear_inertia, of.nonlinear_stiffness], of.angle_limit, of.swirl_limit)
            }
            None => {
                let pair = [mode.nonlinear_inertia, mode.nonlinear_stiffness];
                (pair, mode.angle_limit, mode.swirl_limit)
            }
        };
        for (x, i) in [(s, 12), (kappa, 13)] {
            assert!((x / number(i) - 1.0).abs() < 1e-5, "{row:?} {x}");
        }
        for (limit, i) in [(planar, 18), (rotary.unwrap_or(0.0), 19)] {
            let limit = limit.to_degrees();
            assert!((limit - number(i)).abs() < 0.02, "{row:?} {limit}");
        }
    }
    assert_eq!(compared.len(), 18);
}

#[test]
fn parameter_files_for_the_fmus_have_the_angle_limits() {
    let limit = |text: &str, fill: f64, target: Target, name: &str| {
        let tank = tank(&format!("density = 1000.0\n{text}"));
        let data = tank.solve(fill, 1).unwrap();
        let set = ParameterSet::new(&tank, &data, target, WATER).unwrap();
        let found = set.values.iter().find(|(other, _)| other == name);
        found.map(|(_, value)| match value {
            Value::Real(x) => *x,
            other => panic!("{other:?}"),
        })
    };
    let cylinder = "shape = { cylinder = { radius = 0.1, height = 2.0 } }";
    for (target, prefix, expected) in [
        (Target::HubSlosh, "slosh.table", 6.5),
        (Target::SloshTank, "tank", 11.8),
        (Target::Spacecraft { tank: 2 }, "tank[2]", 11.8),
    ] {
        let angle = limit(cylinder, 0.05, target, &format!("{prefix}.angle_limit[1]")).unwrap();
        assert!((angle.to_degrees() - expected).abs() < 0.01, "{angle}");
        let swirl = format!("{prefix}.swirl_limit[1]");
        let at_half = limit(cylinder, 0.05, target, &swirl).map(f64::to_degrees);
        let has_energy = target != Target::HubSlosh;
        assert_eq!(at_half.map(|angle| (10.0 * angle).round() / 10.0), has_energy.then_some(7.5));
        let swirl = limit(cylinder, 0.25, target, &swirl).unwrap();
        assert!((swirl.to_degrees() - 7.2).abs() < 0.01, "{swirl}");
    }
    let amplitude_dependence =
        |text: &str, fill: f64| limit(text, fill, Target::SloshTank, "tank.angle_limit[1]");
    // At h/R = 0.1 s and kappa are not known, so that the limit is the limit of a pendulum.
    assert!(amplitude_dependence(cylinder, 0.01).unwrap().to_degrees() < 0.5);
    assert!(amplitude_dependence("box = [0.8, 0.5]", 0.4).is_some());
}

/// Returns the parameter `angle_limit` of mode 1, in degrees, for a tank that is filled to the
/// fraction `share` (a box to 0.6 `share` m), and true if the file contains coefficients of large
/// waves.
fn angle_limit(text: &str, share: f64, liquid: Liquid) -> (f64, bool) {
    let tank = tank(&format!("density = 1000.0\n{text}"));
    let fill = tank.fill_height(Fill::Share(share)).unwrap_or(0.6 * share);
    let data = tank.solve(fill, 1).unwrap();
    let set = ParameterSet::new(&tank, &data, Target::SloshTank, liquid).unwrap();
    let value = set.values.iter().find(|(name, _)| name == "tank.angle_limit[1]");
    let Some((_, Value::Real(limit))) = value else { panic!("{text} {share}: {:?}", set.notes) };
    (limit.to_degrees(), !third_order_of(&set).is_empty())
}

/// Without coefficients the limit is the angle at which a pendulum differs from the liquid, and not
/// the FMU's default of 45 degrees.
#[test]
fn parameter_files_have_an_angle_limit_for_every_shape_and_fill() {
    let mut pendulums = 0;
    for text in [
        "shape = { sphere = { radius = 1.0 } }",
        "shape = { cylinder = { radius = 1.0, height = 2.0 } }",
        "shape = { domed_cylinder = { radius = 1.0, height = 0.5, bottom = 0.7, top = 0.7 } }",
        "shape = { torus = { ring_radius = 1.0, tube_radius = 0.3 } }",
        "shape = { annulus = { inner_radius = 0.4, outer_radius = 1.0, height = 2.0 } }",
        // a box filled to 0.6 m
        "box = [0.8, 0.8]",
    ] {
        for i in 1..20 {
            let share = 0.05 * f64::from(i);
            let (limit, has_coefficients) = angle_limit(text, share, WATER);
            println!("{text} {share:.2}: {limit:.2} {has_coefficients}");
            assert!(limit > 0.0 && limit < 15.01, "{text} {share}: {limit}");
            // The largest limit of a pendulum in a cylinder of any depth is 6.3 degrees.
            assert!(has_coefficients || limit < 6.3, "{text} {share}: {limit}");
            pendulums += usize::from(!has_coefficients);
        }
    }
    assert!(pendulums > 20, "{pendulums}");
    let low = Liquid { gravity: 0.01, sigma: Some(0.07), ..WATER };
    let small = "shape = { cylinder = { radius = 0.1, height = 0.4 } }";
    let (limit, has_coefficients) = angle_limit(small, 0.5, low);
    assert!(limit < 6.3 && !has_coefficients, "{limit}");
}

/// Between h/R 1.1 and 1.25 the third-order theory has poles, so that the frequency of the liquid
/// changes more strongly with the amplitude.
#[test]
fn near_poles_of_third_order_theory_a_pendulum_has_a_small_angle_limit() {
    let at = |fill: f64| amplitude_dependence_at("shape = { sphere = { radius = 1.0 } }", fill);
    let neighbours = [1.07, 1.3].map(|fill| at(fill).pendulum_limit.unwrap().to_degrees());
    let mut refused = 0;
    for i in 0..=16 {
        let fill = 1.1 + 0.01 * f64::from(i);
        let found = at(fill);
        let limit = found.pendulum_limit.unwrap().to_degrees();
        println!("{fill:.2}: {limit:.2} {}", found.mode.is_none());
        refused += usize::from(found.mode.is_none());
        assert!(
            limit > 0.0 && limit < neighbours[0].max(neighbours[1]),
            "{fill} {limit} {neighbours:?}"
        );
    }
    assert!(refused > 8, "{refused}");
}

/// Coefficients of the wave's energy are known for h/R from 0.25 to 0.7. Files for HubSlosh and for
/// draining tanks contain the third-order coefficients.
#[test]
fn parameter_files_have_all_large_wave_coefficients_where_they_are_known() {
    let cylinder = tank("density = 1000.0\nshape = { cylinder = { radius = 0.1, height = 2.0 } }");
    let coefficients = |set: &ParameterSet| -> Vec<(String, f64)> {
        let number = |(name, value): &(String, Value)| match value {
            Value::Real(x) if name.contains("nonlinear") || name.contains("rotary") => {
                Some((name.clone(), *x))
            }
            _ => None,
        };
        set.values.iter().filter_map(number).collect()
    };
    for (fill, target, prefix, count) in [
        // At this fill the third-order series is valid only below 5 degrees, so that the file has no coefficients.
        (0.024, Target::SloshTank, "tank", 0),
        (0.025, Target::SloshTank, "tank", 6),
        (0.05, Target::Spacecraft { tank: 2 }, "tank[2]", 6),
        (0.0699, Target::SloshTank, "tank", 6),
        (0.0701, Target::SloshTank, "tank", 2),
        (0.05, Target::HubSlosh, "slosh.table", 2),
    ] {
        let data = cylinder.solve(fill, 2).unwrap();
        let set = ParameterSet::new(&cylinder, &data, target, WATER).unwrap();
        let found = coefficients(&set);
        assert_eq!(found.len(), count, "{fill} {found:?}");
        if count == 6 {
            let known = energy_terms(data.fill / 0.1).unwrap();
            let [[s, kappa], [s_2, kappa_2], [t, t_2]] = [known.pair, known.next, known.rotary];
            let expected = [
                ("nonlinear_inertia", s),
                ("nonlinear_stiffness", kappa),
                ("nonlinear_inertia_2", s_2),
                ("nonlinear_stiffness_2", kappa_2),
                ("rotary_inertia", t),
                ("rotary_inertia_2", t_2),
            ];
            assert_eq!(found, expected.map(|(what, x)| (format!("{prefix}.{what}[1]"), x)));
            let source = "potential flow in upright cylinders, frequency";
            assert!(set.notes.iter().any(|note| note.contains(source)), "{:?}", set.notes);
        }
    }
    let swept = sweep(&cylinder, &[0.03, 0.05, 0.06], 1).unwrap();
    let set = fill_table::parameters(&cylinder, &swept, None, Target::SloshTank, WATER).unwrap();
    let found = coefficients(&set);
    assert!(found.iter().all(|(name, _)| name.contains(".fill.nonlinear")), "{found:?}");
    assert_eq!(found.len(), 6);
    let limits = [1, 2, 3].map(|i| format!("tank.fill.angle_limit[1,{i}]"));
    let all: Vec<_> = set.values.iter().filter(|(name, _)| limits.contains(name)).collect();
    assert!(matches!(all[1].1, Value::Real(x) if (x.to_degrees() - 6.5).abs() < 0.01), "{all:?}");
}

/// For small waves the coefficients of the table must give the frequency of third-order theory,
/// which another method computes.
#[test]
fn spheres_have_all_large_wave_coefficients_at_the_fills_of_their_table() {
    let sphere = tank("density = 1000.0\nshape = { sphere = { radius = 0.4 } }");
    let at = |fill: f64| {
        amplitude_dependence(&sphere, &sphere.solve(fill * 0.4, 1).unwrap()).mode.unwrap()
    };
    for fill in [0.12, 0.25, 0.55, 0.9, 1.04] {
        let (known, energy) = (at(fill), at(fill).energy.unwrap());
        assert_eq!(energy.source, EnergySource::SphereTable);
        let planar = 0.375 * energy.nonlinear_stiffness - 0.5 * energy.nonlinear_inertia;
        let circular = 0.5 * energy.nonlinear_stiffness - 2.0 * energy.rotary_inertia;
        assert!((planar - known.planar).abs() < 0.03, "{fill}: {planar} {}", known.planar);
        let third = known.circular.unwrap();
        assert!((circular - third).abs() < 0.05, "{fill}: {circular} {third}");
        assert!(energy.frequency_limit >= energy.angle_limit, "{fill}");
    }
    assert!([0.09, 1.08].iter().all(|fill| at(*fill).energy.is_none()));
    // A capsule is a sphere up to its joint, but its waves differ from waves in a sphere.
    let capsule = tank(include_str!("../../examples/capsule.toml"));
    let data = capsule.solve(0.3, 1).unwrap();
    assert!(amplitude_dependence(&capsule, &data).mode.is_none_or(|known| known.energy.is_none()));
}

fn with_large_waves(text: &str, fill: f64) -> FiniteAmplitude {
    let tank = tank(text);
    let mut data = parameters::solve(&tank, Fill::Height(fill), 1, WATER).unwrap();
    add_large_waves(&tank, &mut data);
    data.finite_amplitude.unwrap()
}

#[test]
#[ignore = "four seconds of CPU time: .ci/long-tests"]
fn large_wave_coefficients_of_a_cone_are_computed_on_request() {
    let cone = "density = 1000.0\nshape = { cone = { half_angle = 45, height = 1.0 } }";
    let found = with_large_waves(cone, 0.5);
    let known = found.mode.unwrap();
    let energy = known.energy.unwrap_or_else(|| panic!("{found:?}"));
    assert_eq!(energy.source, EnergySource::ThisTank);
    assert!(energy.frequency_error < 3e-3 && energy.energy_error < 1e-2, "{energy:?}");
    let planar = 0.375 * energy.nonlinear_stiffness - 0.5 * energy.nonlinear_inertia;
    assert!((planar - known.planar).abs() < 0.03, "{planar} {}", known.planar);
}

#[test]
fn large_waves_are_refused_for_a_box_and_a_ring_with_a_reason() {
    for (text, fill, why) in [
        ("density = 1000.0\nbox = [0.8, 0.5]", 0.4, "the tank is not a body of revolution"),
        (
            "density = 1000.0\nshape = { torus = { ring_radius = 1.0, tube_radius = 0.3 } }",
            0.3,
            "s and kappa of the third order are not known",
        ),
    ] {
        let found = with_large_waves(text, fill);
        let said = found.warnings.iter().filter(|warning| warning.contains(why)).count();
        assert!(said == 1 && found.mode.is_none_or(|known| known.energy.is_none()), "{found:?}");
    }
}

/// With 1000 kg/m³, R = 0.1 m and the largest expected sigma/rho of 7.3e-5 m³/s² the Bond number is
/// 100 at 0.73 m/s².
#[test]
fn a_missing_surface_tension_gives_a_warning_at_low_bond_numbers() {
    let tank = tank("density = 1000.0\nshape = { sphere = { radius = 0.1 } }");
    let data = tank.solve(0.1, 1).unwrap();
    for (gravity, sigma, expected) in
        [(0.72, None, true), (0.74, None, false), (0.0, None, false), (0.1, Some(0.07), false)]
    {
        let liquid = Liquid { gravity, sigma, ..WATER };
        let text = "surface tension: sigma is not given";
        let set = ParameterSet::new(&tank, &data, Target::SloshTank, liquid).unwrap();
        let warned = set.warnings.iter().any(|warning| warning.contains(text));
        assert_eq!(warned, expected, "{gravity} {:?}", set.warnings);
        let all = surface_tension_warnings(&data, liquid);
        assert_eq!(all.iter().any(|warning| warning.contains(text)), expected);
    }
    let g_bond = |sigma: Option<f64>| {
        let liquid = Liquid { sigma, ..WATER };
        let set = ParameterSet::new(&tank, &data, Target::SloshTank, liquid).unwrap();
        let found = set.values.iter().find(|(name, _)| name == "tank.g_bond").unwrap();
        if let Value::Real(x) = found.1 { x } else { panic!("{found:?}") }
    };
    assert!((g_bond(None) / 0.73 - 1.0).abs() < 1e-3, "{}", g_bond(None));
    // With sigma, the FMU is out of range at the gravity at which the file would be refused.
    for (factor, refused) in [(0.99, true), (1.01, false)] {
        let liquid = Liquid { gravity: factor * g_bond(Some(0.07)), sigma: Some(0.07), ..WATER };
        let set = ParameterSet::new(&tank, &data, Target::SloshTank, liquid).unwrap();
        assert_eq!(!set.unknown.is_empty(), refused, "{factor}");
    }
}

/// A rectangular box has s = 1 and the kappa that gives the planar shift of the frequency; a square
/// box also has circular motion, which determines s.
#[test]
fn boxes_have_third_order_coefficients_for_each_length() {
    let long = amplitude_dependence_at("box = [0.8, 0.5]", 0.4);
    let (x, y) = (long.mode.unwrap(), long.mode_y.unwrap());
    assert!((x.planar + 0.3155).abs() < 1e-4 && (y.planar + 0.3943).abs() < 1e-4, "{x:?} {y:?}");
    for mode in [x, y] {
        assert_eq!((mode.nonlinear_inertia, mode.circular), (1.0, None));
        assert!((0.375 * mode.nonlinear_stiffness - 0.5 - mode.planar).abs() < 1e-12);
    }
    assert!(long.warnings.is_empty(), "{long:?}");
    let near = amplitude_dependence_at("box = [1.0, 0.95]", 0.6);
    assert!(near.warnings[0].contains("exchange energy"), "{near:?}");
    let square = amplitude_dependence_at("box = [0.5, 0.5]", 0.4);
    let mode = square.mode.unwrap();
    assert_eq!(square.mode, square.mode_y);
    assert!((mode.planar - y.planar).abs() < 1e-12 && mode.circular.unwrap() > 0.0, "{mode:?}");
    assert!(square.warnings[0].contains("along a diagonal"), "{square:?}");
}

#[test]
fn the_printed_table_of_a_tank_has_large_wave_coefficients_wave_heights_and_warnings() {
    let text = |text: &str, fill: f64| {
        let tank: Tank = tank(&format!("density = 1000.0\n{text}"));
        let mut data = tank.solve(fill, 1).unwrap();
        data.finite_amplitude = Some(amplitude_dependence(&tank, &data));
        table(&data, 9.80665)
    };
    let cylinder = text("shape = { cylinder = { radius = 0.0815, height = 0.2 } }", 0.1);
    for line in [
        "s = 1.4076, kappa = 0.7341, error 1e-5 of the series",
        "in range: frequency within 0.3 % up to 21.2 degrees, a forced response within 3 % up to 9.3 degrees, rotary motion up \
         to 5.9 degrees (fully nonlinear potential flow",
        "planar motion, circular +0.3671 A^2",
        "crest 0.068202 A +0.056965 A^2, trough 0.068202 A -0.056965 A^2",
    ] {
        assert!(cylinder.contains(line), "{line}\n{cylinder}");
    }
    let torus = text("shape = { torus = { ring_radius = 1.0, tube_radius = 0.3 } }", 0.3);
    assert!(torus.contains("warning: finite amplitude: s and kappa"), "{torus}");
    assert!(text("box = [0.8, 0.5]", 0.4).contains("motion along y: s = 1.0000"));
}

fn third_order_of(set: &ParameterSet) -> Vec<(String, f64)> {
    let of = |(name, value): &(String, Value)| match value {
        Value::Real(x) if name.contains("nonlinear") => Some((name.clone(), *x)),
        _ => None,
    };
    set.values.iter().filter_map(of).collect()
}

const WATER: Liquid =
    Liquid { gravity: 9.81, nu: None, sigma: None, contact_angle: 90.0, spin: None };

/// Only mode 1 has coefficients (in a box: the first mode along each length). Files for HubSlosh
/// contain none for a box.
#[test]
fn parameter_files_for_the_fmus_have_large_wave_coefficients_of_the_first_mode() {
    let cylinder =
        tank("density = 1000.0\nshape = { cylinder = { radius = 0.0815, height = 0.2 } }");
    let data = cylinder.solve(0.1, 3).unwrap();
    let mode = amplitude_dependence(&cylinder, &data).mode.unwrap();
    for (target, prefix) in [
        (Target::HubSlosh, "slosh.table"),
        (Target::SloshTank, "tank"),
        (Target::Spacecraft { tank: 2 }, "tank[2]"),
    ] {
        let set = ParameterSet::new(&cylinder, &data, target, WATER).unwrap();
        let expected = [
            (format!("{prefix}.nonlinear_inertia[1]"), mode.nonlinear_inertia),
            (format!("{prefix}.nonlinear_stiffness[1]"), mode.nonlinear_stiffness),
        ];
        assert_eq!(third_order_of(&set), expected);
        assert!(set.warnings.is_empty(), "{:?}", set.warnings);
    }
    let long = tank("density = 1000.0\nbox = [0.8, 0.5]");
    let data = long.solve(0.4, 3).unwrap();
    let found = amplitude_dependence(&long, &data);
    let set = ParameterSet::new(&long, &data, Target::SloshTank, WATER).unwrap();
    let names: Vec<String> = third_order_of(&set).into_iter().map(|(name, _)| name).collect();
    let expected =
        [1, 2].map(|n| ["inertia", "stiffness"].map(|x| format!("tank.nonlinear_{x}[{n}]")));
    assert_eq!(names, expected.concat());
    assert_eq!(third_order_of(&set)[3].1, found.mode_y.unwrap().nonlinear_stiffness);
    let set = ParameterSet::new(&long, &data, Target::HubSlosh, WATER).unwrap();
    assert!(third_order_of(&set).is_empty());
}

#[test]
fn parameter_files_without_large_wave_coefficients_state_the_reason() {
    let cylinder = "shape = { cylinder = { radius = 0.1, height = 2.0 } }";
    let low = Liquid { gravity: 0.01, sigma: Some(0.07), ..WATER };
    for (text, fill, liquid, why) in [
        (
            "shape = { torus = { ring_radius = 1.0, tube_radius = 0.3 } }",
            0.3,
            WATER,
            "ring of liquid",
        ),
        ("shape = { sphere = { radius = 0.1 } }", 0.112, WATER, "mode (2,2)"),
        (cylinder, 0.01, WATER, "hold up to 1.7"),
        (cylinder, 0.2, low, "surface tension"),
    ] {
        let tank = tank(&format!("density = 1000.0\n{text}"));
        let data = tank.solve(fill, 1).unwrap();
        let set = ParameterSet::new(&tank, &data, Target::SloshTank, liquid).unwrap();
        assert!(third_order_of(&set).is_empty(), "{why}");
        assert!(set.notes.iter().any(|note| note.contains(why)), "{why} {:?}", set.notes);
    }
}

fn columns(set: &ParameterSet) -> [Vec<f64>; 2] {
    let all = third_order_of(set);
    ["inertia", "stiffness"].map(|what| {
        let name = format!("tank.fill.nonlinear_{what}[1,");
        all.iter().filter(|(other, _)| other.starts_with(&name)).map(|(_, x)| *x).collect()
    })
}

#[test]
fn a_draining_tank_has_large_wave_coefficients_at_every_fill() {
    let sphere = tank("density = 1000.0\nshape = { sphere = { radius = 0.5 } }");
    let table = sweep(&sphere, &[0.1, 0.2, 0.4], 1).unwrap();
    let set = fill_table::parameters(&sphere, &table, None, Target::SloshTank, WATER).unwrap();
    let [s, kappa] = columns(&set);
    for (i, row) in table.rows.iter().enumerate() {
        let known = amplitude_dependence(&sphere, row).mode.unwrap();
        assert_eq!((s[i], kappa[i]), (known.nonlinear_inertia, known.nonlinear_stiffness));
        let words = format!("fill {} m: s = {:.4}", row.fill, known.nonlinear_inertia);
        assert!(
            set.notes.iter().any(|note| note.starts_with(&words[..words.len() - 1])),
            "{words}"
        );
    }
    assert_eq!((s.len(), third_order_of(&set).len()), (3, 6));
    assert_eq!(set.warnings, [""; 0]);
}

/// In the sphere the third order has poles from 0.556 to 0.63 m, and the coefficients are not known
/// above 0.85 m.
#[test]
fn a_fill_table_bounds_unknown_large_wave_coefficients_by_neighbours_and_names_the_fills() {
    let sphere = tank("density = 1000.0\nshape = { sphere = { radius = 0.5 } }");
    let fills = [0.5, 0.56, 0.6, 0.7, 0.8, 0.88, 0.9];
    let table = sweep(&sphere, &fills, 1).unwrap();
    let set = fill_table::parameters(&sphere, &table, None, Target::SloshTank, WATER).unwrap();
    let pair = |i: usize| {
        let known = amplitude_dependence(&sphere, &table.rows[i]).mode;
        known.map(|known| [known.nonlinear_inertia, known.nonlinear_stiffness])
    };
    let columns = columns(&set);
    for (i, unknown) in [false, true, true, false, false, true, true].into_iter().enumerate() {
        assert_eq!(pair(i).is_none(), unknown, "{}", fills[i]);
        for (k, column) in columns.iter().enumerate() {
            let value = column[i];
            match i {
                1 | 2 => {
                    let [a, b] = [0, 3].map(|i| pair(i).unwrap()[k]);
                    assert!((a.min(b)..a.max(b)).contains(&value), "{value} {a} {b}");
                }
                5 | 6 => assert!((value - column[4]).abs() < 1e-12, "{value} {}", column[4]),
                _ => assert_eq!(value, pair(i).unwrap()[k]),
            }
        }
    }
    let words = "s and kappa of mode 1 are not known at the fills 0.56, 0.6, 0.88, 0.9 m";
    assert!(set.warnings.len() == 1 && set.warnings[0].contains(words), "{:?}", set.warnings);
    assert!(set.warnings[0].ends_with("where s and kappa have a pole"), "{:?}", set.warnings);
    let unknown = |note: &&String| note.contains("error not known, bounded by the neighbours: ");
    assert_eq!(set.notes.iter().filter(unknown).count(), 4);
}

/// A torus has no large-wave coefficients at any fill, and the sphere has them at only one of the
/// two tested fills.
#[test]
fn a_fill_table_with_fewer_than_two_known_large_wave_coefficients_uses_pendulums() {
    for (shape, fills, why) in [
        ("torus = { ring_radius = 1.0, tube_radius = 0.3 }", [0.2, 0.3], "ring of liquid"),
        ("sphere = { radius = 0.1 }", [0.112, 0.14], "mode (2,2)"),
    ] {
        let tank = tank(&format!("density = 1000.0\nshape = {{ {shape} }}"));
        let table = sweep(&tank, &fills, 1).unwrap();
        let set = fill_table::parameters(&tank, &table, None, Target::SloshTank, WATER).unwrap();
        assert!(third_order_of(&set).is_empty() && set.third_order.is_empty(), "{shape}");
        let said = |note: &String| note.contains("as a pendulum") && note.contains(why);
        assert!(set.notes.iter().any(said), "{shape} {:?}", set.notes);
    }
}

#[test]
fn a_fill_table_of_a_cylinder_states_the_error_of_the_coefficients_between_its_points() {
    compare_placed_tables(&[("cylinder = { radius = 0.5, height = 1.5 }", 0.7, 1.4)]);
}

/// The modes of these shapes are computed by the boundary integral equation and not in closed form.
#[test]
#[ignore = "five seconds of CPU time: .ci/long-tests"]
fn fill_tables_of_a_cone_and_of_a_sphere_state_the_error_of_the_coefficients() {
    compare_placed_tables(&[
        ("cone = { half_angle = 30, height = 1.0 }", 0.3, 0.9),
        ("sphere = { radius = 0.5 }", 0.1, 0.5),
    ]);
}

fn compare_placed_tables(tanks: &[(&str, f64, f64)]) {
    for &(shape, low, high) in tanks {
        let tank = tank(&format!("density = 1000.0\nshape = {{ {shape} }}"));
        let placed = fill_table::place(&tank, low, high, 1).unwrap();
        let between = Some(&placed.between);
        let set = fill_table::parameters(&tank, &placed.sweep, between, Target::SloshTank, WATER);
        let set = set.unwrap();
        let x: Vec<f64> = placed.sweep.rows.iter().map(|row| row.m_liq).collect();
        let curves = columns(&set).map(|y| Monotone::bounded(&x, &y));
        let mut worst = 0.0_f64;
        for share in [0.13, 0.29, 0.51, 0.77, 0.94] {
            let row = tank.solve(low + share * (high - low), 1).unwrap();
            let known = amplitude_dependence(&tank, &row).mode.unwrap();
            for (curve, exact) in
                curves.iter().zip([known.nonlinear_inertia, known.nonlinear_stiffness])
            {
                let off = (curve.evaluate(row.m_liq) - exact).abs() / (1.0 + exact.abs());
                worst = worst.max(off);
            }
        }
        let note = set
            .notes
            .iter()
            .find(|note| note.starts_with("between the points of the table"))
            .unwrap();
        let stated: f64 =
            note.split(" at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        println!("{shape}: {worst:.1e}, stated {stated:.1e}");
        // The table measures the error in the middle of an interval, but the largest error may be elsewhere in it.
        assert!(worst < 3.0 * stated + 1e-6 && stated < 0.01, "{shape}: {worst:e} {stated:e}");
    }
}

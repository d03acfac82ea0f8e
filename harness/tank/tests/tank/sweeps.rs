use crate::common::tank;
use hubslosh_tank::fill_table::Between;
use hubslosh_tank::interpolation::Monotone;
use hubslosh_tank::parameters::{Liquid, Target, Value, tank_damping};
use hubslosh_tank::sweep::sweep;
use hubslosh_tank::{Fill, ModalData, closed_form, fill_table};

fn fills(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| from + (to - from) * i as f64 / count as f64).collect()
}

/// Liquid that fills a sphere does not rotate with the sphere: I_eff is 0, while rigid liquid would
/// have 2/5 m R^2.
#[test]
fn empty_and_full_tanks_have_no_modes() {
    let sphere = tank("density = 1000.0\nshape = { sphere = { radius = 1.0 } }");
    let table = sweep(&sphere, &[0.0, 1.0, 2.0], 2).unwrap();
    let [empty, half, full] = &table.rows[..] else { panic!() };
    assert!(
        empty.m_liq == 0.0
            && empty.modes.is_empty()
            && half.modes.len() == 2
            && full.modes.is_empty()
    );
    assert!((full.m_liq / (4000.0 / 3.0 * core::f64::consts::PI) - 1.0).abs() < 1e-12);
    assert!(full.i_eff_cg.abs() < 1e-9 * full.i_frozen_cg, "{}", full.i_eff_cg);
    assert!((full.rest(0).height - 1.0).abs() < 1e-12);
    // a nearly full sphere has the limit of ever smaller free surfaces
    let nearly = sphere.solve(1.9999, 1).unwrap();
    assert!(nearly.i_eff_cg < 1e-6 * nearly.i_frozen_cg);
    let csv = table.to_csv();
    assert_eq!(csv.lines().count(), 4);
    assert!(!csv.contains("NaN") && csv.lines().all(|l| l.split(',').count() == 24), "{csv}");
}

/// In a full capsule 8 % of the rigid inertia across the axis remains.
#[test]
#[ignore = "three seconds: .ci/long-tests"]
fn full_tanks_have_the_inertia_of_nearly_full_tanks() {
    let capsule = tank(
        "density = 1.0\nprofile = [{ arc = [0, 0.5, 0.5, -90, 0] }, { line = [0.5, 0.5, 0.5, 1.5] }, { arc = [0, 1.5, 0.5, 0, 90] }]",
    );
    let full = &sweep(&capsule, &[2.0], 1).unwrap().rows[0];
    let below = capsule.solve(1.99999, 1).unwrap();
    assert!(
        (full.i_eff_cg / below.i_eff_cg - 1.0).abs() < 1e-4,
        "{} {}",
        full.i_eff_cg,
        below.i_eff_cg
    );
    let torus = tank("density = 1.0\nshape = { torus = { ring_radius = 1.0, tube_radius = 0.4 } }");
    let full = &sweep(&torus, &[0.8], 1).unwrap().rows[0];
    let below = torus.solve(0.7999, 1).unwrap();
    assert!(
        (full.i_eff_cg / below.i_eff_cg - 1.0).abs() < 1e-3,
        "{} {}",
        full.i_eff_cg,
        below.i_eff_cg
    );
}

#[test]
fn a_sweep_has_the_third_order_coefficients_of_every_fill() {
    let tank = tank("density = 1000.0\nshape = { sphere = { radius = 0.1 } }");
    let mut table = sweep(&tank, &[0.0, 0.112, 0.14], 2).unwrap();
    assert!(!table.to_csv().contains("nonlinear"));
    table.add_third_order(&tank);
    let csv = table.to_csv();
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let at = lines[0].len() - 4;
    let names = ["nonlinear_inertia_1", "nonlinear_stiffness_1", "finite_amplitude_error_1"];
    assert_eq!((&lines[0][at..at + 3], lines[0][at + 3]), (&names[..], "angle_limit_1"));
    assert!(lines[1][at..] == [""; 4] && lines[2][at..] == [""; 4], "{csv}");
    let known = table.rows[2].finite_amplitude.as_ref().unwrap().mode.unwrap();
    let cells: Vec<f64> = lines[3][at..].iter().map(|cell| cell.parse().unwrap()).collect();
    let [s, kappa] = [known.nonlinear_inertia, known.nonlinear_stiffness];
    assert_eq!(cells, [s, kappa, known.error, known.angle_limit]);
}

#[test]
fn a_sweep_has_the_damping_of_every_fill() {
    let tank = tank("density = 1000.0\nshape = { cylinder = { radius = 1.0, height = 3.0 } }");
    let mut table = sweep(&tank, &[0.0, 0.5, 2.0], 2).unwrap();
    assert!(!table.to_csv().contains("zeta"));
    let liquid =
        Liquid { gravity: 9.81, nu: Some(1e-6), sigma: None, contact_angle: 90.0, spin: None };
    table.add_damping(&tank, 1e-6, liquid).unwrap();
    let csv = table.to_csv();
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| lines[0].iter().position(|other| *other == name).unwrap();
    assert_eq!(lines[0].len(), 10 + 2 * 10);
    assert_eq!((column("zeta_1"), column("zeta_high_2")), (17, 29));
    for (row, line) in table.rows.iter().zip(&lines[1..]) {
        for n in [1, 2] {
            let cells = ["zeta", "zeta_low", "zeta_high"]
                .map(|name| line[column(&format!("{name}_{n}"))].parse::<f64>().ok());
            let expected = (!row.modes.is_empty()).then(|| {
                let mode = tank_damping(&tank, row, 1e-6, liquid).unwrap().modes[n - 1];
                [mode.zeta, mode.interval[0], mode.interval[1]]
            });
            match expected {
                Some(expected) => assert_eq!(cells, expected.map(Some)),
                None => assert_eq!(cells, [None; 3]),
            }
        }
    }
}

#[test]
fn every_impossible_fill_of_a_sweep_is_reported() {
    let tank = tank("density = 1.0\nshape = { cylinder = { radius = 1.0, height = 1.0 } }");
    assert_eq!(sweep(&tank, &[-1.0, 0.5, 1.5, 2.0], 2).unwrap_err().0.len(), 3);
    assert!(sweep(&tank, &[0.5, 0.4], 2).unwrap_err().to_string().contains("must ascend"));
    assert!(sweep(&tank, &[], 2).is_err());
}

/// The FMUs interpolate between the twelve fills of a table. At eight other fills the interpolated
/// values are compared with solutions for these fills.
#[test]
#[ignore = "some seconds: .ci/long-tests"]
fn a_fill_table_of_twelve_points_is_accurate_enough_for_tanks_of_many_shapes() {
    for shape in [
        "cylinder = { radius = 0.5, height = 1.5 }",
        "sphere = { radius = 0.5 }",
        "domed_cylinder = { radius = 0.5, height = 1.0, bottom = 0.5, top = 0.5 }",
        "cone = { half_angle = 30, height = 1.0 }",
    ] {
        let tank = tank(&format!("density = 1000.0\nshape = {{ {shape} }}"));
        let height = |share: f64| tank.fill_height(Fill::Share(share)).unwrap();
        let placed = fill_table::place(&tank, height(0.02), height(0.98), 3).unwrap();
        let rows = &placed.sweep.rows;
        assert_eq!(rows.len(), fill_table::POINTS);
        let x: Vec<f64> = rows.iter().map(|row| row.m_liq).collect();
        let curve = |f: &dyn Fn(&ModalData) -> f64| {
            Monotone::bounded(&x, &rows.iter().map(f).collect::<Vec<_>>())
        };
        let hinge = |row: &ModalData| row.modes[0].hinge.unwrap();
        let stiffness = curve(&|row| 1.0 / row.modes[0].l);
        let bob = curve(&|row| hinge(row) - row.modes[0].l);
        let share = curve(&|row| row.modes[0].m / row.m_liq);
        for fill in [0.031, 0.077, 0.152, 0.291, 0.443, 0.672, 0.879, 0.969] {
            let exact = tank.solve(height(fill), 3).unwrap();
            let (mode, m) = (&exact.modes[0], exact.m_liq);
            let frequency = (stiffness.evaluate(m) * mode.l).sqrt() - 1.0;
            let mass = share.evaluate(m) * m / mode.m - 1.0;
            let height = (bob.evaluate(m) + 1.0 / stiffness.evaluate(m) - hinge(&exact)) / 0.5;
            for (what, off) in [("frequency", frequency), ("mass", mass), ("hinge", height)] {
                assert!(off.abs() < 5e-3, "{shape} at {fill}: {what} {off:.1e}");
            }
        }
    }
}

#[test]
fn a_fill_table_states_the_errors_of_the_modes_between_its_points() {
    let tank = tank("density = 1000.0\nshape = { cylinder = { radius = 0.5, height = 1.5 } }");
    let placed = fill_table::place(&tank, 0.03, 1.47, 1).unwrap();
    let rows = &placed.sweep.rows;
    let x: Vec<f64> = rows.iter().map(|row| row.m_liq).collect();
    let curve =
        |f: fn(&ModalData) -> f64| Monotone::bounded(&x, &rows.iter().map(f).collect::<Vec<_>>());
    let hinge = |row: &ModalData| row.modes[0].hinge.unwrap();
    let stiffness = curve(|row| 1.0 / row.modes[0].l);
    let bob = curve(|row| row.modes[0].height.unwrap());
    let share = curve(|row| row.modes[0].m / row.m_liq);
    let mut found = [0.0_f64; 3];
    for fill in fills(0.03, 1.47, 1000) {
        let exact = closed_form::cylinder(0.5, fill, 1000.0, 1);
        let (mode, m) = (&exact.modes[0], exact.m_liq);
        let off = [
            (stiffness.evaluate(m) * mode.l).sqrt() - 1.0,
            share.evaluate(m) * m / mode.m - 1.0,
            (bob.evaluate(m) + 1.0 / stiffness.evaluate(m) - hinge(&exact)) / 0.5,
        ];
        found = std::array::from_fn(|k| found[k].max(off[k].abs()));
    }
    for (found, stated) in found.into_iter().zip(placed.between.error) {
        // The stated error was measured in the middles of the intervals, but the largest error may be elsewhere in them.
        assert!((0.95..1.1).contains(&(found / stated)), "{found:e} {stated:e}");
        assert!(stated < 5e-3);
    }
    // Twelve evenly spaced fills have errors ten times as large as the placed fills.
    let even = sweep(&tank, &fills(0.03, 1.47, fill_table::POINTS - 1), 1).unwrap().rows;
    let x: Vec<f64> = even.iter().map(|row| row.m_liq).collect();
    let y: Vec<f64> = even.iter().map(|row| 1.0 / row.modes[0].l).collect();
    let stiffness = Monotone::bounded(&x, &y);
    let off = |fill: f64| {
        let exact = closed_form::cylinder(0.5, fill, 1000.0, 1);
        ((stiffness.evaluate(exact.m_liq) * exact.modes[0].l).sqrt() - 1.0).abs()
    };
    let worst = fills(0.03, 1.47, 1000).into_iter().map(off).fold(0.0, f64::max);
    let placed = placed.between.error.into_iter().fold(0.0, f64::max);
    assert!(worst > 10.0 * placed, "{worst:e} {placed:e}");
}

#[test]
fn a_fill_table_is_written_for_spacecraft_and_sloshtank() {
    let tank = tank("density = 1000.0\nshape = { sphere = { radius = 0.5 } }");
    let table = sweep(&tank, &[0.1, 0.4, 0.8], 3).unwrap();
    let liquid = Liquid { gravity: 9.81, nu: None, sigma: None, contact_angle: 90.0, spin: None };
    for (target, prefix) in
        [(Target::SloshTank, "tank"), (Target::Spacecraft { tank: 2 }, "tank[2]")]
    {
        let set = fill_table::parameters(&tank, &table, None, target, liquid).unwrap();
        let value = |what: &str| {
            let name = format!("{prefix}.{what}");
            set.values.iter().find(|(known, _)| *known == name).map(|(_, value)| value.clone())
        };
        assert_eq!(value("fill.points"), Some(Value::Integer(3)));
        assert_eq!(value("liquid_0"), Some(Value::Real(table.rows[2].m_liq)));
        assert_eq!(value("fill.length[2,3]"), Some(Value::Real(table.rows[2].modes[1].l)));
        for (i, row) in table.rows.iter().enumerate() {
            let (at, rest) = (format!("[{}]", i + 1), row.rest(3));
            let numbers =
                [("liquid", row.m_liq), ("H_0", rest.height), ("I_0", rest.inertia), ("I_z", 0.0)];
            for (what, number) in numbers {
                assert_eq!(
                    value(&format!("fill.{what}{at}")),
                    Some(Value::Real(number)),
                    "{what}{at}"
                );
            }
            for mode in &row.modes {
                let at = format!("[{},{}]", mode.n, i + 1);
                let numbers =
                    [("mass", mode.m), ("length", mode.l), ("hinge", mode.hinge.unwrap())];
                for (what, number) in numbers {
                    assert_eq!(
                        value(&format!("fill.{what}{at}")),
                        Some(Value::Real(number)),
                        "{what}{at}"
                    );
                }
            }
        }
        assert!(value("m_0").is_none() && value("mass[1]").is_none());
        assert!(value("zeta[1]").is_some() && value("wave[3]").is_some());
    }
    let refused = |table, target| {
        fill_table::parameters(&tank, table, None, target, liquid).unwrap_err().to_string()
    };
    assert!(refused(&table, Target::HubSlosh).contains("does not drain"));
    let one = sweep(&tank, &[0.4], 3).unwrap();
    assert!(refused(&one, Target::SloshTank).contains("2 to 12 points"));
    let empty = sweep(&tank, &[0.0, 0.4], 3).unwrap();
    assert!(refused(&empty, Target::SloshTank).contains("free surface"));
    assert!(fill_table::place(&tank, 0.1, 1.0, 3).is_err());
}

/// In a cone of 45 degrees only the first mode has mass. In a sphere all modes have mass, and
/// Spacecraft and SloshTank keep three of them.
#[test]
fn a_fill_table_has_the_modes_that_carry_liquid_at_every_fill() {
    let liquid = Liquid { gravity: 9.81, nu: None, sigma: None, contact_angle: 90.0, spin: None };
    for (shape, asked, kept) in [
        ("cone = { half_angle = 45.0, height = 1.5 }", 4, 1),
        ("sphere = { radius = 0.5 }", 1, 1),
        ("sphere = { radius = 0.5 }", 2, 2),
        ("sphere = { radius = 0.5 }", 4, 3),
    ] {
        let tank = tank(&format!("density = 1000.0\nshape = {{ {shape} }}"));
        let table = sweep(&tank, &[0.3, 0.7], asked).unwrap();
        let set = fill_table::parameters(&tank, &table, None, Target::SloshTank, liquid).unwrap();
        let modes = Value::Integer(kept);
        assert!(set.values.contains(&("tank.modes".to_string(), modes)), "{shape} {asked}");
        for n in 1..=asked as i64 {
            let name = format!("tank.fill.mass[{n},2]");
            let is_there = set.values.iter().any(|(known, _)| *known == name);
            assert_eq!(is_there, n <= kept, "{shape} {asked}: {name}");
        }
    }
}

/// The parameter set states the errors as percentages, and the test has them as fractions. If an
/// error is above 0.5 %, a warning says that the table has too few points.
#[test]
fn parameter_sets_state_the_errors_between_the_points_of_a_fill_table() {
    let tank = tank("density = 1000.0\nshape = { sphere = { radius = 0.5 } }");
    let table = sweep(&tank, &[0.1, 0.4, 0.8], 1).unwrap();
    let liquid =
        Liquid { gravity: 9.81, nu: Some(1e-6), sigma: None, contact_angle: 90.0, spin: None };
    for (error, few) in [
        ([0.001, 0.002, 0.003], false),
        ([0.005, 0.002, 0.003], false),
        ([0.006, 0.002, 0.003], true),
        ([0.001, 0.006, 0.003], true),
        ([0.001, 0.002, 0.006], true),
    ] {
        let between = Some(&Between { error, rows: Vec::new() });
        let set =
            fill_table::parameters(&tank, &table, between, Target::SloshTank, liquid).unwrap();
        let [frequency, mass, hinge] = error.map(|x| format!("{:.2} %", 100.0 * x));
        let words = format!("frequency {frequency}, mass {mass}, hinge {hinge}");
        assert!(set.notes.iter().any(|note| note.contains(&words)), "{:?}", set.notes);
        let warned = |words: &str| set.warnings.iter().any(|warning| warning.contains(words));
        assert_eq!(warned("3 points are too few for this tank"), few, "{:?}", set.warnings);
        // the table has the damping ratio of every fill
        for (i, row) in table.rows.iter().enumerate() {
            let ratio = tank_damping(&tank, row, 1e-6, liquid).unwrap().modes[0].zeta;
            let name = format!("tank.fill.zeta[1,{}]", i + 1);
            assert!(set.values.contains(&(name, Value::Real(ratio))), "{:?}", set.values);
        }
        assert!(!warned("keep their values of the largest fill"), "{:?}", set.warnings);
    }
    // the warning that the stiffness of the largest fill is used at all fills
    let wet = Liquid { sigma: Some(0.07), ..liquid };
    let set = fill_table::parameters(&tank, &table, None, Target::SloshTank, wet).unwrap();
    assert!(
        set.warnings.iter().any(|why| why.contains("stiffnesses keep their values")),
        "{:?}",
        set.warnings
    );
}

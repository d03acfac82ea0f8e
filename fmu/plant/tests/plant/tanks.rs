//! Tests of tanks of any shape, whose modes are given by a table.

use super::common::{SLOSHING, bench};
use formulas::{cylinder, third_order};
use plant::{FrictionModel, Inputs, Outputs, Parameters, Plant, Ramp, SloshModel, SloshSource};

fn plant(p: &Parameters) -> Plant {
    Plant::new(p, &Inputs::default(), 0.0, 1e-10).unwrap()
}

fn sphere() -> Parameters {
    let mut p = bench(SloshModel::Linear, FrictionModel::Viscous);
    (p.slosh.source, p.slosh.modes) = (SloshSource::Table, 3);
    let table = &mut p.slosh.table;
    table.m_liq = 2.0944;
    table.mass[..3].copy_from_slice(&[1.2, 0.05, 0.012]);
    table.length[..3].copy_from_slice(&[0.0641, 0.0189, 0.0117]);
    p
}

fn run(p: &Parameters) -> Vec<Outputs> {
    let mut plant = plant(p);
    let mut inputs = Inputs { tau_cmd: Ramp { value: 0.1, slope: -0.02 }, ..Inputs::default() };
    (0..100)
        .map(|_| {
            plant.step(&inputs, 0.02).unwrap();
            inputs.tau_cmd.value += 0.02 * inputs.tau_cmd.slope;
            plant.outputs(&inputs)
        })
        .collect()
}

/// The table of modes is tested with wave heights and without them. Without them the model uses the wave height of a
/// cylinder with the diameter `tank.d`.
#[test]
fn modes_of_a_cylinder_given_as_a_table_move_like_the_cylinder() {
    for model in SLOSHING {
        let mut p = bench(model, FrictionModel::Stribeck);
        p.slosh.modes = 3;
        let (expected, known) = (run(&p), *plant(&p).calculated());
        p.slosh.source = SloshSource::Table;
        p.slosh.table.m_liq = known.m_liq;
        for n in 0..3 {
            let of = cylinder::pendulum(n, p.tank.d, p.tank.h, known.m_liq);
            (p.slosh.table.mass[n], p.slosh.table.length[n]) = (of.mass, of.length);
            p.slosh.table.zeta[n] = known.damping[n];
        }
        let (s, kappa) = third_order::coefficients(p.tank.h / (p.tank.d / 2.0));
        (p.slosh.table.nonlinear_inertia[0], p.slosh.table.nonlinear_stiffness[0]) = (s, kappa);
        assert_eq!(run(&p), expected, "{model:?}");
        // Other wave heights in the table change no output but the wave heights.
        p.slosh.table.wave[..3].copy_from_slice(&[0.1, 0.2, 0.3]);
        for (a, b) in run(&p).iter().zip(&expected) {
            assert_eq!((a.omega, a.slosh_angle), (b.omega, b.slosh_angle));
        }
        let mut start = p;
        (start.init.slosh_angle, start.init.slosh_angle_radial) = (0.3, 0.4);
        let o = plant(&start).outputs(&Inputs::default());
        let radial = if o.slosh_angle_radial == 0.0 { 0.0 } else { 0.4 };
        let [x, y] = o.wave;
        assert!((x - 0.1 * radial).abs() < 1e-15 && (y - 0.1 * 0.3).abs() < 1e-15, "{model:?}");
        assert!((o.wave_height - x.hypot(y)).abs() < 1e-15, "{model:?}");
    }
}

#[test]
fn a_slosh_frequency_in_the_table_determines_the_pendulum_length() {
    let mut p = sphere();
    p.slosh.table.k = [0.0; plant::MODES];
    p.slosh.table.k[0] = 2.0;
    let lengths = plant(&p).calculated().length;
    for n in 0..3 {
        let table = &mut p.slosh.table;
        let omega2 = table.g_ref / lengths[n] + table.k[n] / table.mass[n];
        table.frequency[n] = omega2.sqrt() / std::f64::consts::TAU;
        table.length[n] = 0.0;
    }
    for (a, b) in plant(&p).calculated().length.iter().zip(lengths).take(3) {
        assert!((a / b - 1.0).abs() < 1e-14, "{a} {b}");
    }
}

#[test]
fn an_impossible_table_of_modes_is_refused_with_all_its_faults() {
    let good = sphere();
    let refused = |change: fn(&mut Parameters)| {
        let mut p = good;
        change(&mut p);
        Plant::new(&p, &Inputs::default(), 0.0, 1e-9).err().unwrap_or_default()
    };
    assert!(refused(|_| {}).is_empty());
    let all = refused(|p| {
        p.slosh.table.m_liq = 0.0;
        p.slosh.table.mass[1] = 0.0;
        p.slosh.table.length[2] = 0.0;
        p.slosh.model = SloshModel::Liquid;
        (p.slosh.table.nonlinear_inertia[0], p.slosh.table.nonlinear_inertia[2]) = (0.0, -2.0);
    });
    assert_eq!(all.len(), 5, "{all:?}");
    for (what, place) in [
        ("slosh.table.nonlinear_inertia[1] = 0", 0),
        ("slosh.table.nonlinear_inertia[3] = -2", 1),
        ("slosh.table.m_liq", 2),
        ("slosh.table.mass[2]", 3),
        ("length[3]", 4),
    ] {
        assert!(all[place].contains(what), "{all:?}");
    }
    let one = |change: fn(&mut Parameters), what: &str| {
        let problems = refused(change);
        assert!(problems.len() == 1 && problems[0].contains(what), "{problems:?}");
    };
    one(|p| p.slosh.table.frequency[0] = 1.0, "set one of the two above 0");
    one(|p| p.slosh.table.length.swap(0, 1), "order of their frequencies");
    // The stiffness k contributes to the frequency: omega^2 = g/l + k/m.
    one(|p| p.slosh.table.k[0] = 1000.0, "order of their frequencies");
    assert!(refused(|p| (p.slosh.table.length[1], p.slosh.table.k[1]) = (0.1, 20.0)).is_empty());
    one(|p| p.slosh.table.m_liq *= 0.1, "add up to");
    one(
        |p| {
            p.slosh.table.length[0] = 0.0;
            (p.slosh.table.frequency[0], p.slosh.table.k[0]) = (0.1, 1e3);
        },
        "above the frequency that the stiffness slosh.table.k[1]",
    );
}

/// Liquid that rotates with the walls of the tank (`tank.I_own`) adds to the inertia of the hub, wherever the tank is.
#[test]
fn the_tanks_own_inertia_adds_to_the_inertia_of_the_hub() {
    let mut p = bench(SloshModel::Frozen, FrictionModel::None);
    let inputs = Inputs { tau_cmd: Ramp::held(1e-3), ..Inputs::default() };
    for r in [0.0, 0.225] {
        p.tank.r = r;
        p.tank.own_inertia = 0.002;
        let o = Plant::new(&p, &inputs, 0.0, 1e-9).unwrap().outputs(&inputs);
        // pi/4 d^2 h of rigid water moves on the circle of radius r.
        let m = 1000.0 * core::f64::consts::FRAC_PI_4 * 0.163 * 0.163 * 0.10;
        let inertia = p.hub.inertia + 0.002 + m * r * r;
        assert!((o.omega_dot * inertia / 1e-3 - 1.0).abs() < 1e-12, "{r} {}", o.omega_dot);
        let drag = -(0.002 + m * r * r) * o.omega_dot;
        assert!((o.tau_fluid / drag - 1.0).abs() < 1e-12, "{r} {}", o.tau_fluid);
    }
}

/// If the table contains only the modes along one axis of a box, slosh models in which the liquid also moves along the other
/// axis are refused, because the modes along that axis are different.
#[test]
fn a_table_of_modes_along_one_axis_is_refused_for_liquid_that_moves_along_both() {
    for model in SloshModel::ALL {
        let mut p = sphere();
        (p.slosh.model, p.slosh.table.one_axis) = (model, true);
        let refused = Plant::new(&p, &Inputs::default(), 0.0, 1e-10).err();
        let both = matches!(model, SloshModel::Spherical | SloshModel::Liquid);
        let named = refused.is_some_and(|problems| problems[0].starts_with("slosh.table.one_axis"));
        assert_eq!(named, both, "{model:?}");
    }
}

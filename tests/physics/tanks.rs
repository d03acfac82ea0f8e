//! Tanks that `hubslosh tank` has computed, simulated with the plant's table of modes.

use hubslosh_tank::Tank;
use plant::{FrictionModel, Inputs, Outputs, Parameters, Plant, Ramp, SloshModel, SloshSource};

fn with_table(p: &Parameters, tank: &str, modes: usize) -> Parameters {
    let tank = Tank::parse(tank, std::path::Path::new("")).unwrap();
    let data = tank.solve(p.tank.h, modes).unwrap();
    let known = *plant(p).calculated();
    let mut p = *p;
    p.slosh.source = SloshSource::Table;
    p.slosh.modes = modes;
    p.slosh.table.m_liq = data.m_liq;
    for (n, mode) in data.modes.iter().enumerate() {
        p.slosh.table.mass[n] = mode.m;
        p.slosh.table.length[n] = mode.l;
        p.slosh.table.wave[n] = mode.wave;
        p.slosh.table.zeta[n] = known.damping[n];
    }
    p
}

fn plant(p: &Parameters) -> Plant {
    Plant::new(p, &Inputs::default(), 0.0, 1e-10).unwrap()
}

fn run(p: &Parameters) -> Vec<Outputs> {
    let mut plant = plant(p);
    let mut inputs = Inputs { tau_cmd: Ramp { value: 0.1, slope: -0.02 }, ..Inputs::default() };
    (0..500)
        .map(|_| {
            plant.step(&inputs, 0.02).unwrap();
            inputs.tau_cmd.value += 0.02 * inputs.tau_cmd.slope;
            plant.outputs(&inputs)
        })
        .collect()
}

/// The bench's cylinder is described in three ways: by its dimensions, by the closed form of `hubslosh tank`, and by its
/// contour, for which a boundary integral equation is solved. Masses and lengths agree to 1e-11. The motions over 10 s agree
/// to the integrator's tolerance times the growth of a small change in rotary motion.
#[test]
fn a_table_of_modes_of_a_cylinder_gives_the_motion_of_the_cylinder() {
    for model in [SloshModel::Linear, SloshModel::Planar, SloshModel::Spherical] {
        let mut p = Parameters::default();
        p.slosh.model = model;
        p.slosh.modes = 3;
        let expected = run(&p);
        for tank in [
            "density = 1000\nshape = { cylinder = { radius = 0.0815, height = 0.2 } }",
            "density = 1000\nprofile = [{ line = [0, 0, 0.0815, 0] }, { line = [0.0815, 0, 0.0815, 0.2] }]",
        ] {
            let found = run(&with_table(&p, tank, 3));
            for (a, b) in expected.iter().zip(&found) {
                assert!((a.omega - b.omega).abs() < 1e-9, "{model:?} {} {}", a.omega, b.omega);
                assert!((a.slosh_angle - b.slosh_angle).abs() < 1e-8, "{model:?}");
                assert!((a.wave_height - b.wave_height).abs() < 1e-9, "{model:?}");
                assert!((a.f_tangential - b.f_tangential).abs() < 1e-7, "{model:?}");
                assert_eq!(a.discrete.event_count, b.discrete.event_count, "{model:?}");
            }
        }
    }
}

/// The liquid that a box takes along when it rotates about its vertical axis increases its inertia (`tank.I_own`). For a
/// square box of 0.1 m this inertia is 0.1565 of that of rigid liquid.
#[test]
fn a_box_takes_liquid_along_about_its_vertical_axis() {
    let tank = Tank::parse("density = 1000\nbox = [0.1, 0.1]", std::path::Path::new("")).unwrap();
    let data = tank.solve(0.1, 1).unwrap();
    let own = data.i_eff_axis.unwrap();
    assert!((own / data.i_frozen_axis - 0.1565).abs() < 5e-5, "{}", own / data.i_frozen_axis);
    let mut p = Parameters::default();
    p.friction.model = FrictionModel::None;
    p.slosh.source = SloshSource::Table;
    (p.tank.r, p.hub.inertia) = (0.0, 1e-3);
    p.slosh.table.m_liq = data.m_liq;
    (p.slosh.table.mass[0], p.slosh.table.length[0]) = (data.modes[0].m, data.modes[0].l);
    let acceleration = |own: f64| {
        p.tank.own_inertia = own;
        let inputs = Inputs { tau_cmd: Ramp::held(1e-3), ..Inputs::default() };
        Plant::new(&p, &inputs, 0.0, 1e-9).unwrap().outputs(&inputs).omega_dot
    };
    // If the tank is on the hub's axis, only the liquid's own inertia counts.
    let [without, with] = [0.0, own].map(acceleration);
    assert!((without - 1.0).abs() < 1e-12, "{without}");
    assert!((with * (1e-3 + own) / 1e-3 - 1.0).abs() < 1e-12, "{with}");
}

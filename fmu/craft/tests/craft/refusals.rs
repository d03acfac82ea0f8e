//! Tests of the ranges of all numeric parameters: at the ends of its range a parameter is accepted, and beyond them it is
//! refused with a message that contains its name.

use craft::{Inertia, Inputs, MODES, Mount, POINTS, Parameters, Spacecraft, Tank, TankParameters};

/// A parameter: its name in messages, a function that returns a reference to its value, and the ends of its range.
type Number = (&'static str, fn(&mut Parameters) -> &mut f64, f64, f64);

const NUMBERS: [Number; 22] = [
    ("craft.mass", |p| &mut p.craft.mass, 1e-9, 1e12),
    ("craft.r[3]", |p| &mut p.craft.r[2], -1e9, 1e9),
    ("gravity[1]", |p| &mut p.gravity[0], -1e9, 1e9),
    ("init.omega[2]", |p| &mut p.init.omega[1], -1e9, 1e9),
    ("init.position[1]", |p| &mut p.init.position[0], -1e9, 1e9),
    ("init.velocity[3]", |p| &mut p.init.velocity[2], -1e9, 1e9),
    ("init.q[4]", |p| &mut p.init.q[3], -1e9, 1e9),
    ("tank[2].position[2]", |p| &mut p.tank[1].position[1], -1e9, 1e9),
    ("tank[1].q[1]", |p| &mut p.tank[0].q[0], -1e9, 1e9),
    ("tank[1].m_0", |p| &mut p.tank[0].m_0, 0.0, 1e12),
    ("tank[1].H_0", |p| &mut p.tank[0].h_0, -1e9, 1e9),
    ("tank[1].I_0", |p| &mut p.tank[0].i_0, 0.0, 1e12),
    ("tank[1].I_z", |p| &mut p.tank[0].i_z, 0.0, 1e12),
    ("tank[1].g_ref", |p| &mut p.tank[0].g_ref, 1e-9, 1e6),
    ("tank[1].mass[1]", |p| &mut p.tank[0].mass[0], 1e-9, 1e12),
    ("tank[1].length[2]", |p| &mut p.tank[0].length[1], 1e-6, 1e9),
    ("tank[1].hinge[1]", |p| &mut p.tank[0].hinge[0], -1e9, 1e9),
    ("tank[1].k[1]", |p| &mut p.tank[0].k[0], 0.0, 1e12),
    ("tank[1].zeta[2]", |p| &mut p.tank[0].zeta[1], 0.0, 10.0),
    ("tank[1].wave[1]", |p| &mut p.tank[0].wave[0], 0.0, 1e9),
    ("tank[1].p_0[1][1]", |p| &mut p.tank[0].p_0[0][0], -1e9, 1e9),
    ("tank[1].p_dot_0[2][3]", |p| &mut p.tank[0].p_dot_0[1][2], -1e9, 1e9),
];

const CYLINDER: [Number; 3] = [
    ("tank[1].diameter", |p| &mut p.tank[0].diameter, 1e-6, 1e3),
    ("tank[1].depth", |p| &mut p.tank[0].depth, 1e-3, 1e3),
    ("tank[1].density", |p| &mut p.tank[0].density, 1e-3, 1e5),
];

const FILL: [Number; 6] = [
    ("tank[1].fill.H_0[2]", |p| &mut p.tank[0].fill.h_0[1], -1e9, 1e9),
    ("tank[1].fill.I_0[1]", |p| &mut p.tank[0].fill.i_0[0], 0.0, 1e12),
    ("tank[1].fill.I_z[3]", |p| &mut p.tank[0].fill.i_z[2], 0.0, 1e12),
    ("tank[1].fill.length[2,3]", |p| &mut p.tank[0].fill.length[1][2], 1e-6, 1e9),
    ("tank[1].fill.hinge[1,12]", |p| &mut p.tank[0].fill.hinge[0][11], -1e9, 1e9),
    ("tank[1].outlet", |p| &mut p.tank[0].outlet, -1e9, 1e9),
];

fn craft() -> Parameters {
    let mut p = Parameters { tanks: 2, ..Parameters::default() };
    for tank in &mut p.tank {
        tank.modes = 2;
    }
    p
}

fn refusal_message(p: &Parameters, (name, place, ..): &Number, value: f64) -> Option<String> {
    let mut p = *p;
    *place(&mut p) = value;
    let problems = p.problems();
    problems.into_iter().find(|text| text.starts_with(&format!("{name} = ")))
}

#[test]
fn parameters_are_accepted_up_to_the_ends_of_their_ranges_and_refused_beyond() {
    let cylinder = {
        let mut p = craft();
        p.tank[0].diameter = 0.9;
        p
    };
    let draining = {
        let mut p = craft();
        p.tank[0].fill.points = craft::POINTS;
        p
    };
    for (p, numbers) in [(craft(), &NUMBERS[..]), (cylinder, &CYLINDER), (draining, &FILL)] {
        assert_eq!(p.problems(), [""; 0]);
        for number in numbers {
            let (name, _, low, high) = *number;
            assert_eq!(
                [low, high].map(|end| refusal_message(&p, number, end)),
                [None, None],
                "{name}"
            );
            let below = if low == 0.0 { -1e-300 } else { low - low.abs() * 1e-9 };
            for value in [below, high * (1.0 + 1e-9), f64::NAN, f64::INFINITY] {
                // With a diameter of 0 or less the tank is not a cylinder, so that the value is accepted.
                if name == "tank[1].diameter" && (0.0..high).contains(&value) {
                    continue;
                }
                let text = refusal_message(&p, number, value);
                assert!(text.is_some_and(|text| text.contains("(allowed: ")), "{name} {value}");
            }
        }
    }
}

#[test]
fn parameters_of_unused_tanks_and_modes_are_not_checked() {
    let mut p = craft();
    p.tank[2].m_0 = -1.0; // not used, because there are two tanks
    p.tank[0].mass[2] = -1.0; // not used, because the tank has two modes
    p.tank[0].depth = -1.0; // not used, because the tank is no cylinder
    p.tank[0].outlet = f64::NAN; // not used, because the tank does not drain
    p.tank[0].fill.i_0[0] = -1.0;
    assert_eq!(p.problems(), [""; 0]);
    p.tanks = 4;
    assert_eq!(p.problems().len(), 1);
    p.tanks = 5;
    assert!(p.problems()[0].starts_with("tanks = 5 (allowed: 0 to 4)"));
}

#[test]
fn directions_need_a_length_above_a_millionth() {
    let with = |x: f64| {
        let mut p = craft();
        p.tank[0].q = [0.0, 0.6 * x, 0.0, 0.8 * x];
        p.init.q = [0.0, 0.0, x, 0.0];
        p.problems().len()
    };
    assert_eq!([with(1.001e-6), with(0.999e-6)], [0, 2]);
}

#[test]
fn an_initial_velocity_is_refused_only_on_a_pivot() {
    let mut p = craft();
    p.init.velocity = [0.0, 1.0, 0.0];
    assert_eq!(p.problems(), [""; 0]);
    p.mount = Mount::Pivot;
    assert_eq!(p.problems().len(), 1);
    p.init.velocity = [0.0; 3];
    assert_eq!(p.problems(), [""; 0]);
}

/// Products of inertia are refused if |J_ij|^2 exceeds J_ii J_jj for a pair of axes i and j. A thin
/// rod, J = (0, 1, 1) in axes of which x lies along it, has exactly this largest value if the axes
/// are rotated.
#[test]
fn products_of_inertia_need_moments_of_inertia_large_enough() {
    let with = |[xx, yy, zz, xy, xz, yz]: [f64; 6]| {
        let mut p = craft();
        p.craft.j = Inertia { xx, yy, zz, xy, xz, yz };
        p.problems()
    };
    let base = [200.0, 250.0, 300.0, 0.0, 0.0, 0.0];
    assert_eq!(with(base), [""; 0]);
    // This product of inertia is 10 % above the root of the product of its two moments; only this product is reported.
    for (i, name, most) in [
        (3, "craft.Jxy^2 = ", 50_000f64),
        (4, "craft.Jxz^2 = ", 60_000f64),
        (5, "craft.Jyz^2 = ", 75_000f64),
    ] {
        for sign in [1.0, -1.0] {
            let mut j = base;
            j[i] = sign * 1.1 * most.sqrt();
            let problems = with(j);
            assert!(problems.len() == 1 && problems[0].starts_with(name), "{problems:?}");
            let moments = format!("= {most:?})");
            assert!(problems[0].ends_with(&moments), "{problems:?}");
            j[i] = sign * 0.3 * most.sqrt();
            assert_eq!(with(j), [""; 0], "{name}");
        }
    }
    // A thin rod in the plane of two axes has |J_xy|^2 = J_xx J_yy, except for rounding errors.
    for degrees in 1..90 {
        let (s, c) = f64::from(degrees).to_radians().sin_cos();
        assert_eq!(with([s * s, c * c, 1.0, -s * c, 0.0, 0.0]), [""; 0], "{degrees}");
    }
    // Each pair of moments is consistent with its product, but one principal moment is below 0. With equal moments 1 and
    // products c the determinant is 1 + 2 c^3 - 3 c^2 = (1 - c)^2 (1 + 2 c), which is negative for c below -1/2.
    let equal = |c: f64| with([1.0, 1.0, 1.0, c, c, c].map(|x| 100.0 * x));
    let negative = equal(-0.51);
    assert!(negative.len() == 1, "{negative:?}");
    assert!(negative[0].contains("the inertia matrix is -45602"), "{negative:?}");
    assert_eq!(equal(-0.49), [""; 0]);
    // A craft with a millionth of the inertia is refused for the same reason.
    let small = with([1.0, 1.0, 1.0, -0.51, -0.51, -0.51].map(|x| 1e-6 * x));
    assert!(small.len() == 1 && small[0].contains("negative principal moment"), "{small:?}");
    let wide = with([1.0, 1.0, 2.5, 0.0, 0.0, 0.0].map(|x| 1e-6 * x));
    assert!(wide.len() == 1 && wide[0].contains("exceeds"), "{wide:?}");
    // With the moments 2, 3 and 5 the determinant is 30 + 2 d - (2 yz^2 + 3 xz^2 + 5 xy^2), where d is the product of
    // xy, xz and yz.
    let [xy, xz, yz] = [0.7, -1.1, 2.0f64];
    let determinant = 30.0 + 2.0 * xy * xz * yz - 2.0 * yz * yz - 3.0 * xz * xz - 5.0 * xy * xy;
    let scaled = |factor: f64| {
        let c = [2.0, 3.0, 5.0, xy, xz, yz * factor].map(|x| 100.0 * x);
        with(c).iter().any(|text| text.contains("negative principal moment"))
    };
    assert!(determinant > 0.0 && !scaled(1.0));
    // If only yz changes, the determinant vanishes where 2 yz^2 + 1.54 yz - 23.92 = 0, that is, at 3.0949.
    assert!(!scaled(3.09 / 2.0) && scaled(3.10 / 2.0));
}

/// The pendulum length l follows from the frequency f by (2 pi f)^2 = g/l + k/m. This equation has a solution only if f is
/// above the frequency that the stiffness k alone causes.
#[test]
fn a_slosh_frequency_without_a_valid_pendulum_length_is_refused() {
    let mut p = craft();
    let tank = &mut p.tank[0];
    (tank.mass[0], tank.k[0]) = (100.0, 400.0); // 2 rad/s alone
    let own = 2.0 / std::f64::consts::TAU;
    tank.frequency[0] = own * 1.001;
    assert_eq!(p.problems(), [""; 0]);
    p.tank[0].frequency[0] = own * 0.999;
    let problems = p.problems();
    assert!(problems.len() == 1, "{problems:?}");
    assert!(problems[0].starts_with("tank[1].frequency[1] = 0.317"), "{problems:?}");
    assert!(problems[0].contains("above 0.318309"), "{problems:?}");
    // The frequency of a pendulum of 1e-6 m at 1.5 m/s2 is sqrt(1.5e6)/(2 pi).
    assert!(problems[0].contains("below 194.9"), "{problems:?}");
    p.tank[0].frequency[0] = 195.0;
    assert_eq!(p.problems().len(), 1);
    p.tank[0].frequency[0] = 194.0;
    assert_eq!(p.problems(), [""; 0]);
}

#[test]
fn the_masses_in_a_fill_table_must_increase_and_include_the_modal_masses() {
    let with = |change: fn(&mut Tank)| {
        let mut p = craft();
        p.tank[0].fill.points = 3;
        p.tank[0].liquid_0 = 100.0;
        change(&mut p.tank[0]);
        p.problems()
    };
    assert_eq!(with(|_| {}), [""; 0]);
    let one = |change: fn(&mut Tank), text: &str| {
        let problems = with(change);
        assert!(problems.len() == 1 && problems[0].contains(text), "{text}: {problems:?}");
    };
    one(
        |t| t.fill.points = 1,
        "tank[1].fill.points = 1 (allowed: 0 for a tank that does not drain, or 2 to 12)",
    );
    one(|t| t.fill.points = 13, "tank[1].fill.points = 13");
    one(|t| t.fill.liquid[2] = t.fill.liquid[1], "equals the mass of the previous point");
    one(|t| t.fill.liquid[2] = t.fill.liquid[1] * 0.99, "tank[1].fill.liquid[3] = 125.9");
    one(|t| t.liquid_0 = 63.6, "tank[1].liquid_0 = 63.6 (allowed: 63.6173 to 190.852 kg)");
    one(|t| t.liquid_0 = 190.9, "tank[1].liquid_0 = 190.9");
    assert_eq!(with(|t| t.liquid_0 = t.fill.liquid[2]), [""; 0]);
    one(|t| t.fill.mass[0][2] = 190.0, "tank[1].fill.mass at point 3 adds up to 193.9");
    // The modal masses may add up to exactly the mass of the liquid.
    let all = |t: &mut Tank| t.fill.mass[0][2] = t.fill.liquid[2] - t.fill.mass[1][2];
    let problems = with(all);
    assert!(problems.iter().all(|text| !text.contains("adds up")), "{problems:?}");
    one(|t| t.diameter = 0.9, "tank[1].diameter cannot be combined with tank[1].fill");
    one(|t| t.frequency[1] = 1.0, "tank[1].frequency cannot be combined with tank[1].fill");
    // The table's values of the third mode are not checked, because the tank has two modes.
    assert_eq!(with(|t| t.fill.mass[2][0] = 1e9), [""; 0]);
}

/// A SloshTank is refused if the craft that carries it has no inertia about its z axis. If there is a second problem,
/// both messages are returned.
#[test]
fn a_host_without_inertia_about_an_axis_is_refused() {
    let mut p =
        TankParameters { host: Some(Parameters::default().craft), ..TankParameters::default() };
    assert_eq!(p.problems(), [""; 0]);
    let host = p.host.as_mut().unwrap();
    host.r = [0.0; 3];
    (host.j.xx, host.j.yy, host.j.zz) = (5.0, 5.0, 0.0);
    assert_eq!(
        p.problems(),
        ["host.Jxx to host.Jyz are singular: the inertia about every axis must be above 0 kg.m2"]
    );
    p.max_steps = 0;
    assert_eq!(p.problems().len(), 2);
}

/// The values of tanks, modes and points that are not in use would be refused, or would cause a division by 0, if
/// they were in use.
#[test]
fn unused_tanks_modes_and_table_points_are_never_evaluated() {
    let step = |p: &Parameters| {
        let mut craft = Spacecraft::new(p, &Inputs::default(), 0.0, 1e-8).unwrap();
        craft.step(&Inputs::default(), 0.5).unwrap();
        craft.state().to_words()
    };
    let mut p = Parameters::default();
    p.init.omega = [0.1, 0.0, 0.2];
    let as_it_was = step(&p);
    let unused = &mut p.tank[1];
    unused.fill.points = 6;
    unused.fill.length[0] = [0.0; POINTS];
    unused.fill.liquid[2] = 0.0;
    (unused.modes, unused.diameter, unused.mass) = (9, 1.0, [0.0; MODES]);
    assert_eq!(step(&p), as_it_was);
    p.tank[1].fill.points = 1;
    assert_eq!(step(&p), as_it_was);

    (p.tank[0].fill.points, p.tank[0].liquid_0) = (5, 200.0);
    let as_it_was = step(&p);
    let table = &mut p.tank[0].fill;
    (table.liquid[5], table.length[0][5], table.mass[0][6]) = (0.0, 0.0, -1.0);
    (table.length[1], table.mass[1]) = ([0.0; POINTS], [0.0; POINTS]);
    assert_eq!(step(&p), as_it_was);
}

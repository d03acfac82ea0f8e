//! Liquid that spins with its tank (`src/spin.rs`).

use craft::{
    Craft, INPUTS, Inertia, Inputs, Parameters, STATES, TANKS, Tank, TankInputs, TankParameters,
    index,
};
use nalgebra::Complex;

use super::component::{SloshTank, Spacecraft};
use super::random::{Random, draining_craft};

type C = Complex<f64>;

/// A rigid body with the inertias A_r across its axis and C_r about it, and a full spheroid of m kg with the semi-axes a
/// and c along the axis, its centre in the body's: rows of A_r, C_r, m, a, c and of both lambda, nutation's rates over the
/// rate of spin, seen from the body. Poincare's equations give them (`fmu/craft/src/spin.rs`).
const SPHEROIDS: [([f64; 5], [[f64; 2]; 2]); 6] = [
    ([60.0, 40.0, 30.0, 0.3, 0.2], [[-0.326391621079, 0.0], [-1.3901790763, 0.0]]),
    ([60.0, 40.0, 30.0, 0.25, 0.25], [[-1.0 / 3.0, 0.0], [-1.0, 0.0]]),
    ([60.0, 40.0, 30.0, 0.2, 0.3], [[-0.343039898263, 0.0], [-0.605776480496, 0.0]]),
    (
        [1.0, 1.0, 100.0, 0.5, 0.75],
        [[-0.443502824859, 0.966048004587], [-0.443502824859, -0.966048004587]],
    ),
    ([0.2, 0.1, 100.0, 0.2, 0.7], [[-0.230218643499, 0.0], [-0.760878565355, 0.0]]),
    ([50.0, 90.0, 80.0, 0.3, 0.4], [[0.783443734998, 0.0], [-0.71017527478, 0.0]]),
];

/// A craft that turns about its z axis at `rate`, rad/s, with the friction `decay` of the liquid.
fn spheroid([across, axial, m, a, c]: [f64; 5], rate: f64, decay: [f64; 2]) -> Parameters {
    let mut p = Parameters::default();
    let j = Inertia { xx: across, yy: across, zz: axial, xy: 0.0, xz: 0.0, yz: 0.0 };
    p.craft = Craft { mass: 100.0, r: [0.0; 3], j };
    let squares = a * a + c * c;
    p.tank[0] = Tank {
        position: [0.0; 3],
        modes: 0,
        m_0: m,
        h_0: 0.0,
        i_0: m * (a * a - c * c).powi(2) / (5.0 * squares),
        i_z: 0.0,
        spin_inertia: 2.0 * m * a * a / 5.0,
        spin_inertia_across: m * squares / 5.0,
        spin_coupling: 2.0 * a * c / squares,
        spin_decay: decay,
        ..Tank::default()
    };
    p.init.omega = [0.0, 0.0, rate];
    p
}

/// Returns the roots of a l^2 + b l + c.
fn roots(a: C, b: C, c: C) -> [C; 2] {
    let root = (b * b - a * c * 4.0).sqrt();
    [(-b + root) / (a * 2.0), (-b - root) / (a * 2.0)]
}

/// Returns lambda of both nutations from the craft's own derivatives. By symmetry w_x + i w_y and L_x + i L_y obey two complex
/// equations.
fn nutations(p: &Parameters) -> [C; 2] {
    let inputs = Inputs::default();
    let mut craft = Spacecraft::new(p, &inputs, 0.0, 1e-9).unwrap();
    let at = [index::OMEGA, index::spin(0)];
    let columns = at.map(|i| {
        let mut dx = [0.0; STATES];
        dx[i] = 1.0;
        let rate = craft.directional_derivative(&inputs, &dx, &[0.0; INPUTS]);
        at.map(|k| C::new(rate[k], rate[k + 1]))
    });
    let [[a, c], [b, d]] = columns;
    let one = C::from(1.0);
    // exp(i lambda Omega t)
    roots(one, -(a + d), a * d - b * c).map(|sigma| sigma / C::new(0.0, p.init.omega[2]))
}

fn assert_roots(found: [C; 2], want: [C; 2], what: &str) {
    let off = |k: usize| (found[0] - want[k]).norm() + (found[1] - want[1 - k]).norm();
    assert!(off(0).min(off(1)) < 2e-9, "{what}: {found:?} {want:?}");
}

#[test]
fn craft_with_full_spheroids_nutate_at_the_rates_of_poincare() {
    for (k, (body, want)) in SPHEROIDS.into_iter().enumerate() {
        for rate in [9.0, -0.5] {
            let found = nutations(&spheroid(body, rate, [0.0; 2]));
            assert_roots(found, want.map(|[re, im]| C::new(re, im)), &format!("{k}"));
        }
    }
}

/// (A A' - F^2) lambda^2 + [(A - C) A' + A C' - F^2] lambda + (A - C) C' = 0, with C' - i K/Omega for C' where the liquid
/// rubs.
fn closed_form([across, axial, m, a, c]: [f64; 5], by_friction: C) -> [C; 3] {
    let (inner, whole) = (m * (a * a + c * c) / 5.0, 2.0 * m * a * a / 5.0);
    let shared = 2.0 * m * a * c / 5.0;
    let (across, axial) = (across + inner, axial + whole);
    let turning = C::from(whole) + by_friction;
    [
        C::from(across * inner - shared * shared),
        turning * across + (across - axial) * inner - shared * shared,
        turning * (across - axial),
    ]
}

fn random_body(random: &mut Random) -> [f64; 5] {
    let across = random.magnitude(0.2, 60.0);
    let axial = across * random.between(0.3, 1.9);
    let a = random.between(0.2, 0.5);
    [across, axial, random.magnitude(5.0, 300.0), a, a * random.between(0.4, 3.0)]
}

#[test]
fn friction_in_full_spheroids_changes_nutation_as_the_closed_form_says() {
    let mut random = Random::new(1);
    for k in 0..30 {
        let (body, rate) = (random_body(&mut random), random.between(0.5, 9.0));
        let decay = random.magnitude(1e-3, 0.3);
        let inner = body[2] * (body[3] * body[3] + body[4] * body[4]) / 5.0;
        let [a, b, c] = closed_form(body, C::new(0.0, -decay * inner / rate));
        let found = nutations(&spheroid(body, rate, [0.0, decay]));
        assert_roots(found, roots(a, b, c), &format!("{k}"));
    }
}

/// Rumyantsev's condition: a real lambda. A nutation of 1e-7 rad/s grows by more than its own size in the time in which the closed
/// form says 1,000 times, and otherwise stays within what two nutations at once can beat.
#[test]
fn spinning_craft_are_stable_where_rumyantsev_says_so() {
    let mut random = Random::new(2);
    let (mut stable, mut unstable) = (0, 0);
    while stable + unstable < 30 {
        let body = random_body(&mut random);
        let coefficients = closed_form(body, C::from(0.0));
        let [a, b, c] = coefficients.map(|x| x.re);
        let discriminant = b * b - 4.0 * a * c;
        // At the boundary a nutation grows slower than by any power of e.
        if discriminant.abs() < 1e-3 * b * b {
            continue;
        }
        let rate = 2.0;
        let growth = f64::max(-discriminant, 0.0).sqrt() / (2.0 * a) * rate;
        let end = if growth > 0.0 { 1000.0_f64.ln() / growth } else { 200.0 };
        let mut p = spheroid(body, rate, [0.0; 2]);
        p.init.omega[0] = 1e-7;
        let mut craft = Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-12).unwrap();
        let mut largest = 0.0_f64;
        for _ in 0..200 {
            craft.step(&Inputs::default(), end / 200.0).unwrap();
            let [x, y, _] = craft.outputs(&Inputs::default()).omega;
            largest = largest.max(x.hypot(y) / 1e-7);
        }
        if discriminant < 0.0 {
            unstable += 1;
            assert!(largest > 30.0, "{body:?}: {largest}");
        } else {
            stable += 1;
            let parts = b.abs().max(1.0) / discriminant.sqrt();
            assert!(largest < 30.0_f64.min(2.0 + 20.0 * parts), "{body:?}: {largest}");
        }
    }
    assert!(stable > 5 && unstable > 5, "{stable} {unstable}");
}

/// The liquid starts at rest in a tank that turns at Omega about its axis: Omega (1 - exp(-t decay)), with a torque of
/// I Omega decay exp(-t decay) on the tank.
#[test]
fn liquid_spins_up_with_its_tank_at_the_rate_of_its_decay() {
    let mut p = TankParameters::default();
    (p.tank.modes, p.tank.i_z) = (0, 0.0);
    (p.tank.spin_inertia, p.tank.spin_decay, p.tank.slip_0) = (3.0, [0.05, 0.0], [0.0, 0.0, -2.0]);
    let u = TankInputs { omega: [0.0, 0.0, 2.0], ..TankInputs::default() };
    let mut tank = SloshTank::new(&p, &u, 0.0, 1e-12).unwrap();
    for k in 0..40 {
        let left = f64::exp(-0.05 * k as f64);
        let (x, out) = (tank.continuous_states(), tank.outputs(&u));
        assert!((x[x.len() - 1] - 6.0 * (1.0 - left)).abs() < 1e-10, "{k}");
        assert!((out.tank.torque[2] + 0.3 * left).abs() < 1e-10, "{k} {:?}", out.tank.torque);
        assert!((out.dissipated - 6.0 * (1.0 - left * left)).abs() < 1e-9, "{k}");
        tank.step(&u, 1.0).unwrap();
    }
}

/// Returns a hash of states and outputs along motions of random craft.
fn bits(change: impl Fn(&mut Parameters)) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |x: f64| hash = (hash ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3);
    for seed in 0..12 {
        let mut random = Random::new(seed);
        let (mut p, inputs) = match seed {
            0..10 => (random.parameters(), random.inputs()),
            _ => draining_craft(seed, 2),
        };
        match seed {
            4 | 5 => random.make_all_planar(&mut p),
            6 | 7 => random.bend_all(&mut p),
            8 => p.tank.iter_mut().for_each(|tank| random.follow(tank)),
            _ => (),
        }
        change(&mut p);
        let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-8).unwrap();
        for _ in 0..20 {
            craft.step(&inputs, 0.05).unwrap();
            let out = craft.outputs(&inputs);
            craft.borrow_states()[..index::BALLS + 6 * TANKS].iter().for_each(|x| take(*x));
            out.angular_momentum.into_iter().for_each(&mut take);
            out.omega_dot.into_iter().for_each(&mut take);
            take(out.energy);
        }
    }
    hash
}

#[test]
fn craft_without_spin_move_as_before_spin_was_modelled() {
    // Of the version before.
    const BEFORE: u64 = 711_689_300_248_721_179;
    assert_eq!(bits(|_| ()), BEFORE);
    let neutral = |p: &mut Parameters| {
        for tank in &mut p.tank {
            (tank.spin_inertia_across, tank.spin_coupling) = (3.0, 0.5);
            (tank.spin_decay, tank.slip_0) = ([0.1, 0.2], [0.3, 0.4, 0.5]);
        }
    };
    assert_eq!(bits(neutral), BEFORE);
}

#[test]
fn spin_without_inertia_or_of_liquid_that_leaves_its_place_is_refused_by_name() {
    let said = |change: &dyn Fn(&mut Tank)| {
        let mut p = Parameters::default();
        p.tank[0].spin_inertia = 3.0;
        change(&mut p.tank[0]);
        Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-9).err().unwrap_or_default().join("; ")
    };
    assert_eq!(said(&|_| ()), "");
    let cases: [(&dyn Fn(&mut Tank), &str); 7] = [
        (&|tank| tank.spin_inertia = 1e-12, "tank[1].spin_inertia = 1e-12"),
        (&|tank| tank.spin_inertia_across = -1.0, "tank[1].spin_inertia_across = -1.0"),
        (&|tank| tank.spin_coupling = 1.1, "tank[1].spin_coupling = 1.1"),
        (&|tank| tank.spin_decay[1] = -0.1, "tank[1].spin_decay[2] = -0.1"),
        (&|tank| tank.slip_0[2] = f64::NAN, "tank[1].slip_0[3] = NaN"),
        (&|tank| tank.fill.points = 12, "tank[1].spin_inertia with tank[1].fill.points"),
        (&|tank| tank.ball.travel = 0.6, "tank[1].spin_inertia with tank[1].ball.travel"),
    ];
    for (change, why) in cases {
        let said = said(change);
        assert!(said.contains(why) && said.contains("allowed: "), "{why}: {said}");
    }
    let mut p = Parameters { tanks: 2, ..Parameters::default() };
    (p.tank[0].ball.travel, p.tank[1].spin_inertia) = (0.6, 3.0);
    let said = Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap_err().join("; ");
    assert!(said.contains("tank[1].ball.travel with tank[2].spin_inertia (allowed: "), "{said}");
    let mut p = Parameters::default();
    assert!(p.overridden("tank[].spin_decay", &[0, 1]).unwrap().contains("spin_inertia = 0"));
    p.tank[0].spin_inertia = 3.0;
    assert_eq!(p.overridden("tank[].spin_decay", &[0, 1]), None);
}

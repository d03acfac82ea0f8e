//! Cases with another, simpler description: one axis, degenerate parameters.

use craft::{
    Inertia, Inputs, Mount, Parameters, Ramp, STATES, SloshTank, Spacecraft, Tank, TankInputs,
    TankParameters, index,
};

use crate::random::Random;

/// The bench: a hub of I_hub that turns about z, a tank at r on its x axis, one mode.
struct Bench {
    i_hub: f64,
    i_z: f64,
    m_0: f64,
    m: f64,
    l: f64,
    c: f64,
    r: f64,
    g: f64,
}

const BENCH: Bench = Bench {
    i_hub: 0.322414,
    i_z: 2e-3,
    m_0: 1.3304,
    m: 0.7563,
    l: 0.0546,
    c: 0.05,
    r: 0.225,
    g: 9.81,
};

/// Torque on the hub, N m, that swings the liquid to some 30 degrees, in both directions.
fn torque(t: f64) -> f64 {
    0.6 * f64::sin(13.0 * t)
}

/// Knots between which the torque is linear, s.
const KNOT: f64 = 0.01;

fn torque_in_knot(k: usize) -> (f64, f64) {
    let (from, to) = (torque(k as f64 * KNOT), torque((k + 1) as f64 * KNOT));
    (from, (to - from) / KNOT)
}

const START: [f64; 6] = [0.2, -0.1, 0.0, 0.3, 0.5, 0.0];

/// w, p, p' by HubSlosh's spherical model: v = p' + w R p, R the quarter turn about z,
///
/// ```text
/// p' = v - w R p,   v' = -w R v - L p + (r/l) (w^2 e_x - w' e_y) - (g/l) e_z - (c/m) p'
/// L = L_0 - (r/l) w' p_y,   L_0 = |v|^2 - (g/l) p_z + (r/l) w^2 p_x
/// (I_hub + m_0 r^2 + I_z + m r^2 p_y^2) w' = tau + m r l p_y L_0
///                                            + c l [r p_y' + l (p_x p_y' - p_y p_x')]
/// ```
fn one_axis(x: &[f64; 7], tau: f64) -> [f64; 7] {
    let Bench { i_hub, i_z, m_0, m, l, c, r, g } = BENCH;
    let (w, p, v) = (x[0], [x[1], x[2], x[3]], [x[4], x[5], x[6]]);
    let p_d = [v[0] + w * p[1], v[1] - w * p[0], v[2]];
    let v2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let pull_0 = v2 - g / l * p[2] + r / l * w * w * p[0];
    let inertia = i_hub + m_0 * r * r + i_z + m * r * r * p[1] * p[1];
    let drag = c * l * (r * p_d[1] + l * (p[0] * p_d[1] - p[1] * p_d[0]));
    let w_d = (tau + m * r * l * p[1] * pull_0 + drag) / inertia;
    let pull = pull_0 - r / l * w_d * p[1];
    let v_d = [
        w * v[1] - pull * p[0] + r / l * w * w - c / m * p_d[0],
        -w * v[0] - pull * p[1] - r / l * w_d - c / m * p_d[1],
        -pull * p[2] - g / l - c / m * p_d[2],
    ];
    [w_d, p_d[0], p_d[1], p_d[2], v_d[0], v_d[1], v_d[2]]
}

/// Classical Runge-Kutta from 0 to 20 s, so many steps a knot.
fn runge_kutta<const N: usize>(
    mut f: impl FnMut(&[f64; N], f64) -> [f64; N],
    x: &mut [f64; N],
    knots: usize,
    steps: usize,
) {
    let h = KNOT / steps as f64;
    for k in 0..knots {
        let (from, slope) = torque_in_knot(k);
        for j in 0..steps {
            let tau = |share: f64| from + slope * (j as f64 + share) * h;
            let at = |x: &[f64; N], d: &[f64; N], h: f64| -> [f64; N] {
                std::array::from_fn(|i| x[i] + h * d[i])
            };
            let k1 = f(x, tau(0.0));
            let k2 = f(&at(x, &k1, h / 2.0), tau(0.5));
            let k3 = f(&at(x, &k2, h / 2.0), tau(0.5));
            let k4 = f(&at(x, &k3, h), tau(1.0));
            for i in 0..N {
                x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
    }
}

fn bench_tank() -> Tank {
    let Bench { i_z, m_0, m, l, c, r, g, .. } = BENCH;
    let mut tank = Tank {
        position: [r, 0.0, 0.3],
        q: [1.0, 0.0, 0.0, 0.0],
        m_0,
        // Heights and I_0 drop out.
        h_0: -0.04,
        i_0: 0.01,
        i_z,
        modes: 1,
        g_ref: g,
        ..Tank::default()
    };
    (tank.mass[0], tank.length[0], tank.hinge[0]) = (m, l, 0.02);
    tank.zeta[0] = 0.5;
    tank.zeta[0] *= c / tank.drag(0);
    let [x, y, z] = [START[0], START[1], -1.0];
    tank.p_0[0] = [x, y, z];
    tank.p_dot_0[0] = [START[3], START[4], START[5]];
    tank
}

/// w, p, v of the one-axis equations after `knots`, from the tank's start. 1 ms steps leave
/// (15 h)^4/120 of the motion a radian: 1e-9 in 20 s would need 0.5 ms; 0.25 ms has 1e-11.
fn one_axis_after(knots: usize) -> [f64; 7] {
    let tank = TankParameters { tank: bench_tank(), ..TankParameters::default() };
    let x = SloshTank::new(&tank, &TankInputs::default(), 0.0, 1e-9).unwrap().continuous_states();
    let mut x = [0.0, x[0], x[1], x[2], x[3], x[4], x[5]];
    runge_kutta(one_axis, &mut x, knots, 40);
    x
}

#[test]
fn a_craft_too_heavy_to_move_but_about_one_axis_is_hubslosh_s_spherical_model() {
    let Bench { i_hub, m, g, m_0, .. } = BENCH;
    let knots = 2000;
    let want = one_axis_after(knots);
    // What is left of the craft's motion goes as 1/M.
    for (mass, allowed) in [(1e9, 1e-7), (1e11, 1e-9)] {
        let mut p = Parameters { tanks: 1, ..Parameters::default() };
        p.craft.mass = mass;
        p.craft.r = [0.0; 3];
        p.craft.j = Inertia { xx: mass, yy: mass, zz: i_hub, xy: 0.0, xz: 0.0, yz: 0.0 };
        p.tank[0] = bench_tank();
        let force = Ramp::held([0.0, 0.0, (mass + m + m_0) * g]);
        let input = |k: usize| {
            let (tau, slope) = torque_in_knot(k);
            let torque = Ramp { value: [0.0, 0.0, tau], slope: [0.0, 0.0, slope] };
            Inputs { force, torque, ..Inputs::default() }
        };
        let mut craft = Spacecraft::new(&p, &input(0), 0.0, 1e-12).unwrap();
        let mut most = 0.0_f64;
        for k in 0..knots {
            craft.step(&input(k), KNOT).unwrap();
            most = most.max(craft.continuous_states()[index::bob(0, 0)].abs());
        }
        // Nonlinear enough to mean something.
        assert!(most > 0.3, "{most}");
        let x = craft.continuous_states();
        let w = x[index::OMEGA + 2];
        assert!((w - want[0]).abs() < allowed, "{mass:e}: {w} {}", want[0]);
        for i in 0..3 {
            let got = x[index::bob(0, 0) + i];
            assert!((got - want[1 + i]).abs() < allowed, "{mass:e}: {got} {}", want[1 + i]);
        }
    }
}

/// I_hub w' = tau + bias_6 - M_a,6. [0, 0, g, 0, 0, w'] in every stage of the host's integrator:
/// nothing but rounding and Runge-Kutta's error between.
#[test]
fn a_tank_on_a_hub_is_hubslosh_s_spherical_model() {
    let Bench { i_hub, g, .. } = BENCH;
    let knots = 1000;
    let want = one_axis_after(knots);
    let p = TankParameters { tank: bench_tank(), ..TankParameters::default() };
    let mut tank = SloshTank::new(&p, &TankInputs::default(), 0.0, 1e-9).unwrap();
    let start = tank.continuous_states();
    let mut x = [0.0; 7];
    x[1..].copy_from_slice(&start[..6]);
    let a = Ramp::held([0.0, 0.0, g]);
    let rates = |x: &[f64; 7], tau: f64| {
        let mut states = tank.continuous_states();
        states[..6].copy_from_slice(&x[1..]);
        tank.set_continuous_states(&states);
        let mut u = TankInputs { a, omega: [0.0, 0.0, x[0]], ..TankInputs::default() };
        let out = tank.outputs(&u);
        // Elements 36 and 66 of the upper triangle by rows.
        let (m_36, m_66) = (out.added_mass[14], out.added_mass[20]);
        let w_d = (tau + out.bias[5] - m_36 * g) / (i_hub + m_66);
        u.omega_dot = Ramp::held([0.0, 0.0, w_d]);
        let d = tank.derivatives(&u);
        [w_d, d[0], d[1], d[2], d[3], d[4], d[5]]
    };
    runge_kutta(rates, &mut x, knots, 40);
    let w = x[0];
    assert!((w - want[0]).abs() < 1e-9, "{w} {}", want[0]);
    for i in 0..3 {
        assert!((x[1 + i] - want[1 + i]).abs() < 1e-9, "{} {}", x[1 + i], want[1 + i]);
    }
}

/// The states after ten seconds of thrust and a swinging torque.
fn after_ten_seconds(p: &Parameters) -> [f64; STATES] {
    let force = Ramp::held([50.0, 0.0, 2400.0]);
    let input = |k: usize| {
        let (tau, slope) = torque_in_knot(2 * k);
        let torque =
            Ramp { value: [50.0 * tau, 20.0 * tau, 0.0], slope: [50.0 * slope, 20.0 * slope, 0.0] };
        Inputs { force, torque, ..Inputs::default() }
    };
    let mut craft = Spacecraft::new(p, &input(0), 0.0, 1e-12).unwrap();
    for k in 0..500 {
        craft.step(&input(k), 0.02).unwrap();
    }
    craft.continuous_states()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// m, c, k to 0 in proportion: the rest of the craft moves as without, with an error in
/// proportion to m.
#[test]
fn bobs_without_mass_are_witnesses() {
    let mut without = Parameters::default();
    without.tank[0].modes = 0;
    let want = after_ten_seconds(&without);
    let off = [1e-3, 1e-6].map(|m| {
        let mut p = Parameters::default();
        p.tank[0].mass[0] = m;
        p.tank[0].k[0] = 0.5 * m;
        p.tank[0].p_0[0] = [0.2, 0.1, -1.0];
        largest_difference(&after_ten_seconds(&p)[..7], &want[..7])
    });
    assert!(off[0] < 1e-5 && off[1] < 1e-8 && off[1] > 0.0, "{off:?}");
    let ratio = off[0] / off[1];
    assert!((ratio / 1e3 - 1.0).abs() < 0.01, "{ratio}");
}

/// l to 0: the mass sits at its hinge, with an error in proportion to l. The bobs are made to
/// rest at first; strong damping lets them follow.
#[test]
fn a_pendulum_without_length_is_a_mass_at_its_hinge() {
    let mut lumped = Parameters::default();
    let (m, hinge) = (lumped.tank[0].mass[0], lumped.tank[0].hinge[0]);
    let tank = &mut lumped.tank[0];
    tank.modes = 0;
    let m_0 = tank.m_0 + m;
    let center = (tank.m_0 * tank.h_0 + m * hinge) / m_0;
    tank.i_0 += tank.m_0 * (tank.h_0 - center).powi(2) + m * (hinge - center).powi(2);
    (tank.m_0, tank.h_0) = (m_0, center);
    let want = after_ten_seconds(&lumped);
    let off = [1e-4, 1e-5].map(|l| {
        let mut p = Parameters::default();
        p.tank[0].length[0] = l;
        p.tank[0].zeta[0] = 1.0;
        largest_difference(&after_ten_seconds(&p)[..7], &want[..7])
    });
    assert!(off[1] < 1e-6, "{off:?}");
    let ratio = off[0] / off[1];
    assert!((ratio / 10.0 - 1.0).abs() < 0.1, "{ratio} {off:?}");
}

/// M_a of a tank without rigid liquid has the rank of its modes.
#[test]
fn a_tank_of_pendulums_alone_is_allowed() {
    let mut p = Parameters::default();
    (p.tank[0].m_0, p.tank[0].i_0, p.tank[0].modes) = (0.0, 0.0, 2);
    after_ten_seconds(&p);
    let alone = TankParameters { tank: p.tank[0], ..TankParameters::default() };
    let mut tank = SloshTank::new(&alone, &TankInputs::default(), 0.0, 1e-9).unwrap();
    let triangle = tank.outputs(&TankInputs::default()).added_mass;
    let mut m = nalgebra::Matrix6::zeros();
    let mut elements = triangle.iter();
    for i in 0..6 {
        for j in i..6 {
            m[(i, j)] = *elements.next().unwrap();
            m[(j, i)] = m[(i, j)];
        }
    }
    // Both bobs hang on the same axis: their directions are the same.
    assert_eq!(m.symmetric_eigenvalues().iter().filter(|x| x.abs() > 1e-9).count(), 1);
}

/// The bob straight up, where stereographic coordinates fail, is a place like any other: the
/// motion through it keeps its energy.
#[test]
fn a_bob_passes_straight_up() {
    let mut p = Parameters::default();
    p.tank[0].zeta[0] = 0.0;
    p.tank[0].p_0[0] = [0.0, 0.0, 1.0];
    p.tank[0].p_dot_0[0] = [1.0, 0.0, 0.0];
    let force = Ramp::held([0.0, 0.0, 2400.0]);
    let u = Inputs { force, ..Inputs::default() };
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-12).unwrap();
    let start = craft.outputs(&u);
    let mut lowest = 1.0_f64;
    for _ in 0..500 {
        craft.step(&u, 0.02).unwrap();
        lowest = lowest.min(craft.continuous_states()[index::bob(0, 0) + 2]);
    }
    assert!(lowest < -0.9, "it swung through: {lowest}");
    let end = craft.outputs(&u);
    let residual = end.energy - start.energy - end.work;
    assert!(residual.abs() < 1e-10 * end.work, "{residual}");
}

/// Without force and stiffness a bob coasts on its sphere: p'' = -|p'|^2 p as seen without the
/// rotation; here the craft is a billion times heavier.
#[test]
fn without_force_and_stiffness_a_bob_coasts_on_its_sphere() {
    let mut p = Parameters::default();
    p.craft.mass = 1e11;
    p.craft.j = Inertia { xx: 1e11, yy: 1e11, zz: 1e11, xy: 0.0, xz: 0.0, yz: 0.0 };
    p.tank[0].zeta[0] = 0.0;
    p.tank[0].p_dot_0[0] = [0.8, 0.6, 0.0];
    let u = Inputs::default();
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-12).unwrap();
    for _ in 0..100 {
        craft.step(&u, 0.02).unwrap();
    }
    let x = craft.continuous_states();
    let (sin, cos) = f64::sin_cos(2.0);
    let want = [0.8 * sin, 0.6 * sin, -cos];
    assert!(largest_difference(&x[index::bob(0, 0)..][..3], &want) < 1e-8);
}

/// Without tanks and without wheels: Euler's equations of a symmetric body have a closed form.
#[test]
fn a_rigid_body_without_tanks_precesses_by_euler() {
    let mut p = Parameters { tanks: 0, ..Parameters::default() };
    p.craft.r = [0.0; 3];
    p.craft.j = Inertia { xx: 900.0, yy: 900.0, zz: 600.0, xy: 0.0, xz: 0.0, yz: 0.0 };
    p.init.omega = [0.3, 0.0, 0.7];
    let u = Inputs::default();
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-13).unwrap();
    for _ in 0..500 {
        craft.step(&u, 0.02).unwrap();
    }
    // w_x + i w_y turns at (I_z - I)/I w_z.
    let (sin, cos) = f64::sin_cos((600.0 - 900.0) / 900.0 * 0.7 * 10.0);
    let want = [0.3 * cos, 0.3 * sin, 0.7];
    assert!(largest_difference(&craft.continuous_states()[index::OMEGA..][..3], &want) < 1e-13);
}

/// On a pivot nothing but the angular momentum about O counts: the same as a free craft of
/// infinite mass at O, which accelerates by -g.
#[test]
fn a_pivot_is_a_free_craft_with_all_the_mass_of_the_world_at_o() {
    for seed in 0..5 {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        p.tanks = 2;
        (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
        let u = Inputs { torque: Ramp::held(random.vector(20.0)), ..Inputs::default() };
        let mut pivot = Spacecraft::new(&p, &u, 0.0, 1e-12).unwrap();
        // Let the free one be pushed at O by -g times all its mass, in the inertial frame; over
        // this short while only the start counts, so compare the rates there.
        let heavy = 1e11;
        let mut free = p;
        free.mount = Mount::Free;
        let r = p.craft.r;
        let m = p.craft.mass;
        let j = p.craft.j.matrix();
        let r2: f64 = r.iter().map(|x| x * x).sum();
        let about_o =
            |i: usize, k: usize| j[i][k] + m * (if i == k { r2 } else { 0.0 } - r[i] * r[k]);
        // The mass at O leaves S = m r, I about O as they were.
        let share = m / (m + heavy);
        free.craft.mass = m + heavy;
        free.craft.r = r.map(|x| x * share);
        let own = |i: usize, k: usize| {
            let (r2, x, y) = (r2 * share * share, r[i] * share, r[k] * share);
            about_o(i, k) - (m + heavy) * (if i == k { r2 } else { 0.0 } - x * y)
        };
        free.craft.j = Inertia {
            xx: own(0, 0),
            yy: own(1, 1),
            zz: own(2, 2),
            xy: own(0, 1),
            xz: own(0, 2),
            yz: own(1, 2),
        };
        let a = pivot.outputs(&u).specific_force;
        let push = Inputs { force: Ramp::held(a.map(|a| a * heavy)), ..u };
        let mut free = Spacecraft::new(&free, &push, 0.0, 1e-12).unwrap();
        let (got, want) = (free.outputs(&push).omega_dot, pivot.outputs(&u).omega_dot);
        // The rest of the mass, 1e3 of 1e11, falls behind.
        assert!(largest_difference(&got, &want) < 1e-6, "{got:?} {want:?}");
    }
}

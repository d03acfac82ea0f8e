//! Special cases in which the motion has a simpler description: motion about one axis, and parameters at
//! the ends of their ranges.

use craft::{Inertia, Inputs, Mount, Parameters, Ramp, STATES, TankInputs, TankParameters, index};

use super::component::{SloshTank, Spacecraft};
use super::random::Random;

fn torque(t: f64) -> f64 {
    0.6 * f64::sin(13.0 * t)
}

const KNOT: f64 = 0.01;

fn torque_in_knot(k: usize) -> (f64, f64) {
    let (from, to) = (torque(k as f64 * KNOT), torque((k + 1) as f64 * KNOT));
    (from, (to - from) / KNOT)
}

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

#[test]
fn a_tank_given_as_a_cylinder_moves_as_a_tank_with_the_cylinders_modes() {
    let given = Parameters::default();
    let mut cylinder = given;
    let tank = &mut cylinder.tank[0];
    (tank.diameter, tank.depth, tank.density) = (0.9, 0.6, 1000.0);
    // Heights in `formulas::cylinder` are measured from mid-depth.
    tank.position[2] -= 0.3;
    let (got, want) = (after_ten_seconds(&cylinder), after_ten_seconds(&given));
    let off = largest_difference(&got[..index::POSITION], &want[..index::POSITION]);
    assert!(off < 1e-5, "{off}");
    let bobs = index::BOBS..index::LIQUID;
    assert!(largest_difference(&got[bobs.clone()], &want[bobs]) < 1e-5);
}

#[test]
fn mass_centre_of_mass_and_inertia_at_rest_do_not_depend_on_the_number_of_modes() {
    let of = |modes: usize| {
        let mut p = Parameters::default();
        p.tank[0].diameter = 0.9;
        p.tank[0].modes = modes;
        let u = Inputs::default();
        Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap().outputs(&u)
    };
    let rigid = of(0);
    let m_liq = 1000.0 * std::f64::consts::PI * 0.45 * 0.45 * 0.6;
    assert!((rigid.mass / (1180.0 + m_liq) - 1.0).abs() < 1e-14);
    let z = (1180.0 * 0.21 + m_liq * (-0.45 + 0.3)) / (1180.0 + m_liq);
    assert!((rigid.center_of_mass[2] - z).abs() < 1e-14);
    for modes in 1..=3 {
        let out = of(modes);
        assert!((out.mass / rigid.mass - 1.0).abs() < 1e-14);
        assert!(largest_difference(&out.center_of_mass, &rigid.center_of_mass) < 1e-14);
        for i in 0..3 {
            let off = largest_difference(&out.inertia[i], &rigid.inertia[i]);
            assert!(off < 1e-11, "{modes} {off}");
        }
    }
}

/// If mass m, drag coefficient c and stiffness k of the bobs go to 0 in proportion, the motion of the craft approaches its
/// motion without bobs, with an error proportional to m.
#[test]
fn bobs_without_mass_move_without_effect_on_the_craft() {
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

/// If the length l goes to 0, the bob approaches a mass at its hinge, with an error proportional to l. The bobs are at rest
/// at first, and strong damping keeps them from oscillating.
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

#[test]
fn a_tank_without_rigid_liquid_is_allowed() {
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
    // Both bobs have the same direction, because they hang on the same axis.
    assert_eq!(m.symmetric_eigenvalues().iter().filter(|x| x.abs() > 1e-9).count(), 1);
}

/// A bob may swing through the upright position, at which stereographic coordinates would fail, and its energy is conserved.
#[test]
fn a_bob_swings_through_the_upright_position() {
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
    assert!(lowest < -0.9, "the bob did not swing through: {lowest}");
    let end = craft.outputs(&u);
    let residual = end.energy - start.energy - end.work;
    assert!(residual.abs() < 1e-10 * end.work, "{residual}");
}

/// Without force and stiffness a bob moves on a great circle of its sphere, p'' = -|p'|^2 p, in axes that do not rotate. The
/// craft is a billion times heavier, so that it does not move.
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

#[test]
fn a_rigid_body_without_tanks_precesses_by_eulers_equations() {
    let mut p = Parameters { tanks: 0, ..Parameters::default() };
    p.craft.r = [0.0; 3];
    p.craft.j = Inertia { xx: 900.0, yy: 900.0, zz: 600.0, xy: 0.0, xz: 0.0, yz: 0.0 };
    p.init.omega = [0.3, 0.0, 0.7];
    let u = Inputs::default();
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-13).unwrap();
    for _ in 0..500 {
        craft.step(&u, 0.02).unwrap();
    }
    // w_x + i w_y rotates at the rate (I_z - I)/I w_z.
    let (sin, cos) = f64::sin_cos((600.0 - 900.0) / 900.0 * 0.7 * 10.0);
    let want = [0.3 * cos, 0.3 * sin, 0.7];
    assert!(largest_difference(&craft.continuous_states()[index::OMEGA..][..3], &want) < 1e-13);
}

/// A craft on a pivot moves like a free craft with an additional, very large mass M at O, on which the force -M g acts.
#[test]
fn a_craft_on_a_pivot_moves_as_a_free_craft_with_a_very_large_mass_at_o() {
    for seed in 0..5 {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        p.tanks = 2;
        (p.mount, p.init.velocity) = (Mount::Pivot, [0.0; 3]);
        let u = Inputs { torque: Ramp::held(random.vector(20.0)), ..Inputs::default() };
        let mut pivot = Spacecraft::new(&p, &u, 0.0, 1e-12).unwrap();
        // The free craft is pushed at O by -g times its total mass, in the inertial frame. The test compares the derivatives
        // at the start, where both craft have the same state.
        let heavy = 1e11;
        let mut free = p;
        free.mount = Mount::Free;
        let r = p.craft.r;
        let m = p.craft.mass;
        let j = p.craft.j.matrix();
        let r2: f64 = r.iter().map(|x| x * x).sum();
        let about_o =
            |i: usize, k: usize| j[i][k] + m * (if i == k { r2 } else { 0.0 } - r[i] * r[k]);
        // The mass at O does not change the first moment S and the inertia I about O.
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
        // The error is the mass of the craft divided by the added mass, 1e3/1e11.
        assert!(largest_difference(&got, &want) < 1e-6, "{got:?} {want:?}");
    }
}

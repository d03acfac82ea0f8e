//! Two descriptions of the same craft, for example with another reference point, give the same motion.
//!
//! The simulations last ten seconds at a tolerance of 1e-13. They differ only by rounding, about 1e-16 in each of 500 steps,
//! which the motion of the liquids amplifies about ten times.

use craft::{INPUTS, Inputs, Parameters, Ramp, STATES, TANKS, index};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::component::Spacecraft;
use super::random::Random;
use super::records::STEP;

type V = Vector3<f64>;

const SAME: f64 = 1e-12;

/// Returns a random craft with at least one tank, and its inputs: a force at O and a torque. The axes of the tanks are
/// within about 30 degrees of the thrust, because a bob that falls over would amplify differences.
fn random_craft(seed: u64) -> (Random, Parameters, Vec<[f64; INPUTS]>) {
    let mut random = Random::new(seed);
    let mut p = random.parameters();
    p.tanks = p.tanks.max(1);
    for tank in &mut p.tank {
        let [x, y, z] = random.vector(0.15);
        tank.q = [1.0, x, y, z];
    }
    let thrust = p.craft.mass * 1.5;
    let inputs = (0..=500)
        .map(|k| {
            let swing = f64::sin(0.05 * k as f64);
            let mut u = [0.0; INPUTS];
            u[2] = thrust;
            u[0] = 0.1 * thrust * swing;
            u[3] = 30.0 * swing;
            u[5] = -20.0 * swing;
            u[7] = 5.0 * swing;
            u
        })
        .collect();
    (random, p, inputs)
}

fn run(p: &Parameters, knots: &[[f64; INPUTS]]) -> [f64; STATES] {
    let inputs = |k: usize| {
        let (from, to) = (knots[k], knots[k + 1]);
        let ramp = |at: usize| Ramp {
            value: [from[at], from[at + 1], from[at + 2]],
            slope: [0, 1, 2].map(|i| (to[at + i] - from[at + i]) / STEP),
        };
        Inputs { force: ramp(0), torque: ramp(3), h_wheels: ramp(6), ..Inputs::default() }
    };
    let mut craft = Spacecraft::new(p, &inputs(0), 0.0, 1e-13).unwrap();
    for k in 0..knots.len() - 1 {
        craft.step(&inputs(k), STEP).unwrap();
    }
    craft.continuous_states()
}

fn v(x: &[f64]) -> V {
    V::new(x[0], x[1], x[2])
}

fn attitude(q: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

fn numbers(q: UnitQuaternion<f64>) -> [f64; 4] {
    [q.w, q.i, q.j, q.k]
}

fn assert_same(got: &[f64], want: &[f64], what: &str) {
    for (i, (got, want)) in got.iter().zip(want).enumerate() {
        assert!((got - want).abs() < SAME * (1.0 + want.abs()), "{what} [{i}]: {got} {want}");
    }
}

fn assert_same_attitude(got: &[f64], want: &[f64]) {
    let sign = got.iter().zip(want).map(|(a, b)| a * b).sum::<f64>().signum();
    let turned: Vec<f64> = got[..4].iter().map(|x| sign * x).collect();
    assert_same(&turned, &want[..4], "attitude");
}

/// The body's origin O is shifted by a random vector, and the positions of all parts are changed accordingly. The motion relative
/// to inertial axes must be the same.
#[test]
fn a_craft_moves_alike_for_any_reference_point_of_its_positions() {
    for seed in 0..8 {
        let (mut random, p, knots) = random_craft(seed);
        let want = run(&p, &knots);
        // The new O is at the position d from the old O, body axes.
        let d = v(&random.vector::<3>(1.0));
        let mut moved = p;
        let less = |x: [f64; 3]| <[f64; 3]>::from(v(&x) - d);
        moved.craft.r = less(p.craft.r);
        for tank in &mut moved.tank {
            tank.position = less(tank.position);
        }
        let q = attitude(&p.init.q);
        moved.init.position = (v(&p.init.position) + q * d).into();
        moved.init.velocity = (v(&p.init.velocity) + q * v(&p.init.omega).cross(&d)).into();
        let moved_knots: Vec<_> = knots
            .iter()
            .map(|u| {
                let torque = v(&u[3..]) - d.cross(&v(u));
                let mut moved = *u;
                moved[3..6].copy_from_slice(torque.as_slice());
                moved
            })
            .collect();
        let got = run(&moved, &moved_knots);
        assert_same_attitude(&got, &want);
        assert_same(&got[index::OMEGA..][..3], &want[index::OMEGA..][..3], "omega");
        let at = v(&want[index::POSITION..]) + attitude(&want) * d;
        assert_same(&got[index::POSITION..][..3], at.as_slice(), "position");
        assert_same(&got[index::BOBS..], &want[index::BOBS..], "bobs");
    }
}

/// The body axes are rotated at random, and all parameters and inputs are changed accordingly. The motion relative to inertial
/// axes must be the same.
#[test]
fn a_craft_moves_alike_for_any_orientation_of_its_body_axes() {
    for seed in 0..8 {
        let (mut random, p, knots) = random_craft(seed);
        let want = run(&p, &knots);
        // `turn` rotates from new to old body axes.
        let turn = attitude(&random.vector::<4>(1.0));
        let back = |x: [f64; 3]| <[f64; 3]>::from(turn.inverse() * v(&x));
        let mut turned = p;
        turned.craft.r = back(p.craft.r);
        let matrix: Matrix3<f64> = turn.to_rotation_matrix().into();
        let j = matrix.transpose() * Matrix3::from_fn(|i, k| p.craft.j.matrix()[i][k]) * matrix;
        let to = &mut turned.craft.j;
        (to.xx, to.yy, to.zz) = (j[(0, 0)], j[(1, 1)], j[(2, 2)]);
        (to.xy, to.xz, to.yz) = (j[(0, 1)], j[(0, 2)], j[(1, 2)]);
        for (tank, from) in turned.tank.iter_mut().zip(&p.tank) {
            tank.position = back(from.position);
            tank.q = numbers(turn.inverse() * attitude(&from.q));
        }
        turned.init.q = numbers(attitude(&p.init.q) * turn);
        turned.init.omega = back(p.init.omega);
        let turned_knots: Vec<_> = knots
            .iter()
            .map(|u| {
                let mut turned = *u;
                for at in [0, 3, 6] {
                    turned[at..at + 3].copy_from_slice(&back([u[at], u[at + 1], u[at + 2]]));
                }
                turned
            })
            .collect();
        let got = run(&turned, &turned_knots);
        assert_same_attitude(&numbers(attitude(&got) * turn.inverse()), &want);
        let omega = turn * v(&got[index::OMEGA..]);
        assert_same(omega.as_slice(), &want[index::OMEGA..][..3], "omega");
        assert_same(
            &got[index::POSITION..],
            &want[index::POSITION..],
            "position and all later states",
        );
    }
}

/// Initial attitude, position and velocity are rotated at random. The motion must be rotated in the same way.
#[test]
fn a_craft_moves_alike_in_any_inertial_frame() {
    for seed in 0..8 {
        let (mut random, p, knots) = random_craft(seed);
        let want = run(&p, &knots);
        let turn = attitude(&random.vector::<4>(1.0));
        let mut turned = p;
        turned.init.q = numbers(turn * attitude(&p.init.q));
        turned.init.position = (turn * v(&p.init.position)).into();
        turned.init.velocity = (turn * v(&p.init.velocity)).into();
        let got = run(&turned, &knots);
        assert_same_attitude(&numbers(turn.inverse() * attitude(&got)), &want);
        assert_same(&got[index::OMEGA..][..3], &want[index::OMEGA..][..3], "omega");
        for at in [index::POSITION, index::VELOCITY] {
            let vector = turn.inverse() * v(&got[at..]);
            assert_same(vector.as_slice(), &want[at..at + 3], "position, velocity");
        }
        assert_same(&got[index::WORK..], &want[index::WORK..], "work and all later states");
    }
}

#[test]
fn reversing_the_order_of_the_tanks_does_not_change_the_motion() {
    for seed in 0..8 {
        let (_, mut p, knots) = random_craft(seed);
        p.tanks = TANKS;
        let want = run(&p, &knots);
        let mut reversed = p;
        reversed.tank.reverse();
        let got = run(&reversed, &knots);
        assert_same(&got[..index::BOBS], &want[..index::BOBS], "craft");
        for i in 0..TANKS {
            let (from, to) = (index::bob(TANKS - 1 - i, 0), index::bob(i, 0));
            assert_same(&got[from..from + 18], &want[to..to + 18], "bobs");
        }
    }
}

/// Each tank has one mode, or two modes with half of the mass and the same length, hinge and damping.
#[test]
fn a_slosh_mass_split_into_two_equal_pendulums_moves_as_one_pendulum() {
    for seed in 0..8 {
        let (_, mut p, knots) = random_craft(seed);
        for tank in &mut p.tank {
            tank.modes = 1;
        }
        let want = run(&p, &knots);
        let mut halves = p;
        for tank in &mut halves.tank {
            tank.modes = 2;
            tank.length[1] = tank.length[0];
            tank.hinge[1] = tank.hinge[0];
            tank.zeta[1] = tank.zeta[0];
            tank.p_0[1] = tank.p_0[0];
            tank.p_dot_0[1] = tank.p_dot_0[0];
            let (m, k) = (tank.mass[0], tank.k[0]);
            (tank.mass[0], tank.mass[1]) = (0.3 * m, 0.7 * m);
            (tank.k[0], tank.k[1]) = (0.3 * k, 0.7 * k);
        }
        let got = run(&halves, &knots);
        assert_same(&got[..index::BOBS], &want[..index::BOBS], "craft");
        for i in 0..p.tanks {
            for n in 0..2 {
                let (part, whole) = (index::bob(i, n), index::bob(i, 0));
                assert_same(&got[part..part + 6], &want[whole..whole + 6], "bob");
            }
        }
    }
}

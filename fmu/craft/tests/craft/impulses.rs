//! Impulses on a single tank and on a craft that drains, the ends of a fill table, and the number of internal steps.

use craft::{
    Inputs, Line, Parameters, Ramp, SloshTank, Spacecraft, Tank, TankInputs, TankParameters,
};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::draining;
use super::random::{Random, draining_craft, draining_tank};
use super::seeds::every_or;

type V = Vector3<f64>;

/// Returns the length of a bob's rod, the bob's position relative to the body's origin O, and the tank's axes, for `liquid` kg in
/// the tank and the direction p of the rod.
fn rod(tank: &Tank, n: usize, liquid: f64, p: V) -> (f64, V, Matrix3<f64>) {
    let drains = tank.fill.points > 0;
    let [_, l, h] =
        if drains { tank.fill.mode(n, liquid) } else { [0.0, tank.length[n], tank.hinge[n]] };
    let [q0, x, y, z] = tank.q;
    let axes = UnitQuaternion::from_quaternion(Quaternion::new(q0, x, y, z));
    let axes: Matrix3<f64> = axes.to_rotation_matrix().into();
    (l, V::from(tank.position) + axes * (V::z() * h + l * p), axes)
}

/// A jump of the velocity of the body that carries the tank acts on a bob only by a force along its rod. Therefore the component
/// across the rod of the bob's velocity V + w x rho + l p' does not change.
#[test]
fn an_impulse_of_the_host_does_not_change_the_bobs_velocities_across_their_rods() {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let drains = seed % 2 == 0;
        let mut tank = if drains { draining_tank(&mut random, 2) } else { random.tank() };
        if seed % 4 == 3 {
            random.make_planar(&mut tank);
        }
        let p = TankParameters { tank, ..TankParameters::default() };
        let u = TankInputs {
            a: Ramp::held([0.1, -0.2, 2.0]),
            omega: random.vector(0.3),
            mass_flow: Line { value: 20.0, slope: 0.0 },
            ..TankInputs::default()
        };
        let mut moved = SloshTank::new(&p, &u, 0.0, 1e-10).unwrap();
        moved.step(&u, 5.0).unwrap();
        let liquid = moved.outputs(&u).liquid;
        let (before, dv, dw) = (moved.continuous_states(), random.vector(1.0), random.vector(1.0));
        moved.apply_host_impulse(dv, dw);
        let after = moved.continuous_states();
        let at = |x: &[f64], i: usize| V::new(x[i], x[i + 1], x[i + 2]);
        for n in 0..tank.modes {
            let direction = at(&before, 6 * n);
            assert!((direction - at(&after, 6 * n)).norm() < 1e-15);
            let (l, mut rho, axes) = rod(&tank, n, liquid, direction);
            let [x, y] = tank.direction[n];
            let across = V::new(-y, x, 0.0).try_normalize(0.0).map(|b| axes * b);
            if let Some(b) = across {
                rho -= b * tank.arm[n];
            }
            let change = axes * (at(&after, 6 * n + 3) - at(&before, 6 * n + 3)) * l;
            let kick = V::from(dv) + V::from(dw).cross(&rho);
            let (rod, mut velocity) = (axes * direction, kick + change);
            if let Some(b) = across {
                // A planar mode moves with the tank in the direction perpendicular to its plane.
                velocity -= b * b.dot(&kick);
                assert!(change.dot(&b).abs() < 1e-14, "p' stays in the plane");
            }
            // The tolerance allows for rounding errors of velocities of 1 m/s and of rods of 0.1 m.
            assert!((velocity - rod * rod.dot(&velocity)).norm() < 1e-14, "{seed} {n}");
            assert!(change.dot(&rod).abs() < 1e-14, "p' stays tangential");
        }
        assert_eq!(before[18..], after[18..], "energy and liquid");
    }
}

/// When some liquid has drained, a jump of the wheels' angular momentum conserves the momentum P and the angular momentum H
/// of the craft with the remaining liquid. The work of the jump equals the increase of `energy` plus `drained`, because the
/// flow moves the ends of the rods, which therefore do work.
#[test]
fn a_jump_of_the_wheels_keeps_momentum_and_energy_of_a_draining_craft() {
    let (mut by_rods, h) = (0.0_f64, 1e-7);
    for seed in every_or(&[0, 3, 21, 42], (0..6).chain(21..24).chain(41..44)) {
        let (p, u) = draining_craft(seed, seed as usize % 4);
        let mut now =
            Inputs { force: Ramp::held([0.0, 0.0, 2.0 * p.craft.mass]), ..Inputs::default() };
        now.mass_flow = u.mass_flow.map(|flow| Line { value: 4.0 * flow.value, slope: 0.0 });
        let mut craft = Spacecraft::new(&p, &now, 0.0, 1e-12).unwrap();
        craft.step(&now, 10.0).unwrap();
        let before = craft.outputs(&now);
        let jump = [20.0, -30.0, 10.0];
        let jumped = craft.outputs(&Inputs { h_wheels: Ramp::held(jump), ..now });
        let [p_0, h_0] = draining::momenta(&before);
        let [p_1, h_1] = draining::momenta(&jumped);
        // The tolerance is some rounding errors of numbers of the size of p_0.
        assert!((p_1 - p_0).norm() < 1e-14 * p_0.norm(), "{seed} {p_0} {p_1}");
        assert!((h_1 - h_0).norm() < 1e-13 * h_0.norm(), "{seed} {h_0} {h_1}");
        assert!((V::from(jumped.omega) - V::from(before.omega)).norm() > 1e-3);
        let off = (draining::energy(&jumped) - draining::energy(&before)).abs();
        assert!(off < 1e-13 * before.energy, "{seed} {off:e}");

        let [turned, coasted] = [1.0 / h, 0.0].map(|rate| {
            let (mut craft, mut u) = (craft.clone(), now);
            u.h_wheels.slope = jump.map(|jump| rate * jump);
            craft.step(&u, h).unwrap();
            craft.continuous_states()[craft::index::DRAINED]
        });
        let (limit, gone) = (turned - coasted, jumped.drained - before.drained);
        // Apart from the effect of the jump, the drained energies of the two runs differ by about 0.1 W times the interval h.
        assert!((gone - limit).abs() < 1e-3 * gone.abs() + h, "{seed}: {gone:e} {limit:e}");
        by_rods = by_rods.max(gone.abs());
    }
    assert!(by_rods > 1e3 * h, "{by_rods:e} J");
}

#[test]
fn liquid_masses_beyond_the_fill_table_are_refused() {
    let mut random = Random::new(1);
    let mut p = Parameters { tanks: 2, ..random.parameters() };
    p.tank[1] = draining_tank(&mut random, 1);
    let masses = p.tank[1].fill.liquid;
    let mut craft = Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap();
    let mut with = |liquid: f64| {
        let mut x = craft.continuous_states();
        x[craft::index::LIQUID + 1] = liquid;
        craft.set_continuous_states(&x);
        craft.check_states()
    };
    let (first, last) = (masses[0], masses[craft::POINTS - 1]);
    assert!([first * 1.001, 400.0, last * 0.999].into_iter().all(|liquid| with(liquid).is_ok()));
    for liquid in [first * 0.99, last * 1.01] {
        let why = with(liquid).unwrap_err().to_string();
        assert!(why.contains("tank 2") || why.contains("tank[2]"), "{why}");
    }
}

/// Returns the number of internal steps in one step of 2 s: the smallest `max_steps` for which `is_enough` returns true.
fn steps(is_enough: impl Fn(usize) -> bool) -> usize {
    let (mut few, mut enough) = (0, 1 << 12);
    while enough - few > 1 {
        let middle = (few + enough) / 2;
        if is_enough(middle) { enough = middle } else { few = middle }
    }
    enough
}

/// Expected numbers of internal steps of a tank that does not drain and one that drains, alone and on a craft, at the
/// tolerances 1e-5 and 1e-10. More steps would be slower, and fewer less exact.
const STEPS: [[[usize; 2]; 4]; 2] =
    [[[16, 8], [31, 12], [48, 26], [150, 86]], [[8, 10], [16, 13], [40, 29], [146, 98]]];

/// The numbers of internal steps of random tanks, alone and on a craft, equal the expected numbers, so that a change that
/// makes the integrator slower is noticed.
#[test]
fn a_step_takes_the_expected_number_of_internal_steps() {
    let counted = [0, 1].map(|seed| {
        let mut random = Random::new(seed);
        let tanks = [random.tank(), draining_tank(&mut random, 2)];
        let u = TankInputs {
            a: Ramp { value: [0.3, -0.2, 2.0], slope: [0.1, 0.2, 0.0] },
            omega: [0.1, -0.2, 0.3],
            omega_dot: Ramp { value: [0.05, 0.1, 0.0], slope: [0.0, -0.02, 0.01] },
            mass_flow: Line { value: 5.0, slope: 0.5 },
        };
        let [keeps, drains] = tanks.map(|tank| {
            [1e-5, 1e-10].map(|tolerance| {
                let alone = steps(|max_steps| {
                    let p = TankParameters { tank, max_steps, ..TankParameters::default() };
                    SloshTank::new(&p, &u, 0.0, tolerance).unwrap().step(&u, 2.0).is_ok()
                });
                let on_craft = steps(|max_steps| {
                    let mut random = Random::new(seed + 10);
                    let mut p = Parameters { tanks: 1, max_steps, ..random.parameters() };
                    p.tank[0] = tank;
                    let mut u = random.inputs();
                    u.mass_flow[0] = Line { value: 5.0, slope: 0.5 };
                    Spacecraft::new(&p, &u, 0.0, tolerance).unwrap().step(&u, 2.0).is_ok()
                });
                [alone, on_craft]
            })
        });
        [keeps[0], keeps[1], drains[0], drains[1]]
    });
    assert_eq!(counted, STEPS);
}

/// Froude scaling: with four times the lengths and accelerations and the same masses and stiffnesses, angles have the same
/// values at the same instants to the last bit, because scaling by a power of two is exact. The dissipated energy, m
/// l^2/s^2, is 16 times as large. The numerical errors therefore do not depend on the unit of length.
#[test]
fn a_tank_four_times_as_large_under_four_times_the_acceleration_moves_the_same() {
    for seed in 0..10 {
        let mut random = Random::new(seed);
        let mut tank = random.tank();
        random.follow(&mut tank);
        let u = TankInputs {
            a: Ramp { value: random.vector(3.0), slope: random.vector(1.0) },
            omega: random.vector(0.5),
            omega_dot: Ramp { value: random.vector(0.5), slope: random.vector(0.2) },
            ..TankInputs::default()
        };
        let by = |factor: f64, x: [f64; 3]| x.map(|x| factor * x);
        let run = |factor: f64| {
            let mut tank = tank;
            tank.position = by(factor, tank.position);
            (tank.length, tank.hinge) = (by(factor, tank.length), by(factor, tank.hinge));
            (tank.g_ref, tank.g_floor) = (factor * tank.g_ref, factor * tank.g_floor);
            let a = Ramp { value: by(factor, u.a.value), slope: by(factor, u.a.slope) };
            let (p, u) =
                (TankParameters { tank, ..TankParameters::default() }, TankInputs { a, ..u });
            let mut tank = SloshTank::new(&p, &u, 0.0, 1e-6).unwrap();
            tank.step(&u, 3.0).unwrap();
            *tank.continuous_states().first_chunk::<19>().unwrap()
        };
        let (mut small, large) = (run(1.0), run(4.0));
        small[18] *= 16.0;
        assert_eq!(large, small, "{seed}");
    }
}

//! Impulses on a tank alone, where its table ends, and what a step costs.

use craft::{
    Inputs, Line, Parameters, Ramp, SloshTank, Spacecraft, Tank, TankInputs, TankParameters,
};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::draining;
use super::random::Random;

type V = Vector3<f64>;

/// Where the bob is from the host's O, and its rate on the rod, with `liquid` in the tank: l, rho, axes.
fn rod(tank: &Tank, n: usize, liquid: f64, p: V) -> (f64, V, Matrix3<f64>) {
    let drains = tank.fill.points > 0;
    let [_, l, h] =
        if drains { tank.fill.mode(n, liquid) } else { [0.0, tank.length[n], tank.hinge[n]] };
    let [q0, x, y, z] = tank.q;
    let axes = UnitQuaternion::from_quaternion(Quaternion::new(q0, x, y, z));
    let axes: Matrix3<f64> = axes.to_rotation_matrix().into();
    (l, V::from(tank.position) + axes * (V::z() * h + l * p), axes)
}

/// The rod can only pull: across it the bob's velocity V + w x rho + l p' is what it was.
#[test]
fn an_impulse_of_the_host_leaves_the_bobs_velocities_across_their_rods() {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let drains = seed % 2 == 0;
        let tank = if drains { draining::tank(&mut random, 2) } else { random.tank() };
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
        moved.take_impulse(dv, dw);
        let after = moved.continuous_states();
        let at = |x: &[f64], i: usize| V::new(x[i], x[i + 1], x[i + 2]);
        for n in 0..tank.modes {
            let direction = at(&before, 6 * n);
            assert_eq!(direction, at(&after, 6 * n));
            let (l, rho, axes) = rod(&tank, n, liquid, direction);
            let change = axes * (at(&after, 6 * n + 3) - at(&before, 6 * n + 3)) * l;
            let kick = V::from(dv) + V::from(dw).cross(&rho);
            let (rod, velocity) = (axes * direction, kick + change);
            // 1 m/s on rods of 0.1 m.
            assert!((velocity - rod * rod.dot(&velocity)).norm() < 1e-14, "{seed} {n}");
            assert!(change.dot(&rod).abs() < 1e-14, "p' stays tangential");
        }
        assert_eq!(before[18..], after[18..], "energy and liquid");
    }
}

/// What a host that integrates itself makes of the mass of liquid is held against the table.
#[test]
fn liquids_beyond_their_tables_are_refused() {
    let mut random = Random::new(1);
    let mut p = Parameters { tanks: 2, ..random.parameters() };
    p.tank[1] = draining::tank(&mut random, 1);
    let masses = p.tank[1].fill.liquid;
    let mut craft = Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap();
    let mut with = |liquid: f64| {
        let mut x = craft.continuous_states();
        x[craft::index::LIQUID + 1] = liquid;
        craft.set_continuous_states(&x);
        craft.check_liquids()
    };
    let (first, last) = (masses[0], masses[craft::POINTS - 1]);
    assert!([first * 1.001, 400.0, last * 0.999].into_iter().all(|liquid| with(liquid).is_ok()));
    for liquid in [first * 0.99, last * 1.01] {
        let why = with(liquid).unwrap_err().to_string();
        assert!(why.contains("tank 2") || why.contains("tank[2]"), "{why}");
    }
}

/// The internal steps that one step of 2 s takes.
fn steps(is_enough: impl Fn(usize) -> bool) -> usize {
    let (mut few, mut enough) = (0, 1 << 12);
    while enough - few > 1 {
        let middle = (few + enough) / 2;
        if is_enough(middle) { enough = middle } else { few = middle }
    }
    enough
}

/// Of a tank that stays and one that drains, at the tolerances 1e-5 and 1e-10 each: alone and on a craft.
/// More would be slower, fewer less exact.
const STEPS: [[[usize; 2]; 4]; 2] =
    [[[16, 6], [31, 12], [19, 10], [27, 13]], [[8, 7], [16, 13], [18, 8], [23, 15]]];

#[test]
fn a_step_takes_few_internal_steps() {
    for (seed, expected) in (0..).zip(STEPS) {
        let mut random = Random::new(seed);
        let tanks = [random.tank(), draining::tank(&mut random, 2)];
        let u = TankInputs {
            a: Ramp { value: [0.3, -0.2, 2.0], slope: [0.1, 0.2, 0.0] },
            omega: [0.1, -0.2, 0.3],
            omega_dot: Ramp { value: [0.05, 0.1, 0.0], slope: [0.0, -0.02, 0.01] },
            mass_flow: Line { value: 5.0, slope: 0.5 },
        };
        let mut of_all = Vec::new();
        for tank in tanks {
            for tolerance in [1e-5, 1e-10] {
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
                of_all.push([alone, on_craft]);
            }
        }
        assert_eq!(of_all, expected, "{seed}");
    }
}

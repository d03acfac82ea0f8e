//! Tests of mass, centre of mass and inertia of craft and liquid, by a sum over all bodies.

use craft::{Inputs, Tank, TankInputs, TankParameters};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::component::{SloshTank, Spacecraft};
use super::random::Random;

type V = Vector3<f64>;
type M = Matrix3<f64>;

/// A rigid body: its mass, its centre of mass from O, and its inertia about the centre of mass.
type Body = (f64, V, M);

fn point(m: f64, s: V) -> M {
    m * (M::identity() * s.norm_squared() - s * s.transpose())
}

/// Returns the mass, the centre of mass and the inertia about this centre of all bodies together.
fn sum(bodies: &[Body]) -> Body {
    let mass: f64 = bodies.iter().map(|(m, ..)| m).sum();
    let center = bodies.iter().map(|(m, s, _)| *m * s).sum::<V>() / mass;
    let inertia = bodies.iter().map(|(m, s, own)| own + point(*m, s - center)).sum();
    (mass, center, inertia)
}

fn liquid(tank: &Tank, p: &[[f64; 3]]) -> Vec<Body> {
    let [q0, x, y, z] = tank.q;
    let axes = UnitQuaternion::from_quaternion(Quaternion::new(q0, x, y, z));
    let axes: M = axes.to_rotation_matrix().into();
    let place = |s: V| V::from(tank.position) + axes * s;
    let own = M::from_diagonal(&V::new(tank.i_0, tank.i_0, tank.i_z));
    let rigid = (tank.m_0, place(V::z() * tank.h_0), axes * own * axes.transpose());
    let bob = |n: usize| {
        let s = V::z() * tank.hinge[n] + tank.length[n] * V::from(p[n]).normalize();
        (tank.mass[n], place(s), M::zeros())
    };
    std::iter::once(rigid).chain((0..tank.modes).map(bob)).collect()
}

#[track_caller]
fn assert_same(got: (f64, [f64; 3], [[f64; 3]; 3]), want: &Body) {
    let (mass, center, inertia) = got;
    // The tolerances allow for rounding errors in numbers of about 1000 kg, 1 m and 1000 kg m2.
    assert!((mass / want.0 - 1.0).abs() < 1e-14);
    assert!((V::from(center) - want.1).norm() < 1e-13);
    for i in 0..3 {
        for j in 0..3 {
            let off = (inertia[i][j] - want.2[(i, j)]).abs();
            assert!(off < 1e-12 * want.2.norm(), "{i} {j} {off}");
        }
    }
}

#[test]
fn mass_properties_equal_those_of_all_bodies_together() {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let (p, u) = (random.parameters(), random.inputs());
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
        craft.step(&u, 0.3).unwrap();
        let still = Inputs::default();
        let out = craft.outputs(&still);
        let j = p.craft.j;
        let own = M::new(j.xx, j.xy, j.xz, j.xy, j.yy, j.yz, j.xz, j.yz, j.zz);
        let mut bodies = vec![(p.craft.mass, V::from(p.craft.r), own)];
        for (tank, shown) in p.tank[..p.tanks].iter().zip(&out.tank) {
            bodies.extend(liquid(tank, &shown.p));
        }
        assert_same((out.mass, out.center_of_mass, out.inertia), &sum(&bodies));

        let alone = TankParameters { tank: random.tank(), ..TankParameters::default() };
        let inputs = TankInputs::default();
        let out = SloshTank::new(&alone, &inputs, 0.0, 1e-9).unwrap().outputs(&inputs);
        let bodies = liquid(&alone.tank, &alone.tank.p_0);
        assert_same((out.mass, out.center_of_mass, out.inertia), &sum(&bodies));
    }
}

#[test]
fn a_tank_without_liquid_has_no_mass_anywhere() {
    let mut p = TankParameters::default();
    (p.tank.m_0, p.tank.i_0, p.tank.modes) = (0.0, 0.0, 0);
    let inputs = TankInputs::default();
    let out = SloshTank::new(&p, &inputs, 0.0, 1e-9).unwrap().outputs(&inputs);
    assert_eq!((out.mass, out.center_of_mass, out.inertia), (0.0, [0.0; 3], [[0.0; 3]; 3]));
}

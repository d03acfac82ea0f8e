//! Tanks without axial symmetry: modes that swing in one plane.

use craft::{Inertia, Inputs, Mount, POINTS, Parameters, Ramp, STATES, Tank, index};

use super::component::Spacecraft;

/// A box of 1000 kg of liquid as wide as deep along y and twice as long along x: a mode along each axis, whose masses are more
/// than the liquid's.
fn a_box() -> Tank {
    let mut tank = Tank {
        position: [0.0; 3],
        modes: 2,
        m_0: -120.0,
        h_0: 0.6,
        i_0: 90.0,
        di_y: 60.0,
        i_z: 70.0,
        ..Tank::default()
    };
    tank.direction[..2].copy_from_slice(&[[1.0, 0.0], [0.0, 2.0]]);
    tank.mass[..2].copy_from_slice(&[700.0, 420.0]);
    tank.length[..2].copy_from_slice(&[0.9, 0.35]);
    tank.hinge[..2].copy_from_slice(&[1.1, 0.7]);
    tank
}

fn craft(tank: Tank) -> Parameters {
    let mut p = Parameters::default();
    p.craft.mass = 2500.0;
    p.craft.r = [0.0, 0.0, -0.3];
    p.craft.j = Inertia { xx: 2000.0, yy: 1800.0, zz: 1500.0, xy: 0.0, xz: 0.0, yz: 0.0 };
    p.tank[0] = tank;
    p
}

/// Moving in one of its planes of symmetry, at any amplitude, a craft with a box has the motion of one with a tank all around, in
/// which the mode along the other axis is frozen where it hangs.
#[test]
fn in_a_plane_of_symmetry_the_mode_across_is_rigid_liquid() {
    for along in [0, 1] {
        let (planar, across) = (a_box(), 1 - along);
        let mut around = Tank { modes: 1, direction: Default::default(), ..planar };
        for all in [&mut around.mass, &mut around.length, &mut around.hinge] {
            all[0] = all[along];
        }
        // m_0 and the bob across as one body, its inertia about the axis that the motion turns about.
        let (m, z) = (planar.mass[across], planar.hinge[across] - planar.length[across]);
        around.m_0 = planar.m_0 + m;
        around.h_0 = (planar.m_0 * planar.h_0 + m * z) / around.m_0;
        let apart = (planar.h_0 - z).powi(2);
        let own = planar.i_0 + if along == 0 { planar.di_y } else { 0.0 };
        (around.i_0, around.di_y) = (own + planar.m_0 * m / around.m_0 * apart, 0.0);
        let mut planar = planar;
        for p_0 in [&mut planar.p_0[along], &mut around.p_0[0]] {
            p_0[along] = 0.8;
        }

        let (mut force, mut torque) = ([0.0, 0.0, 5000.0], [0.0; 3]);
        (force[along], torque[across]) = (4000.0, 600.0);
        let u = Inputs {
            force: Ramp::held(force),
            torque: Ramp { value: torque, slope: torque.map(|x| -0.4 * x) },
            ..Inputs::default()
        };
        let [planar, around] = [planar, around].map(|tank| {
            let mut craft = Spacecraft::new(&craft(tank), &u, 0.0, 1e-12).unwrap();
            craft.step(&u, 4.0).unwrap();
            craft.continuous_states()
        });
        let bob = |along: usize| index::bob(0, along)..index::bob(0, along) + 6;
        let same = (0..index::BOBS).map(|i| (i, i)).chain(bob(along).zip(bob(0)));
        for (i, k) in same {
            let (got, want) = (planar[i], around[k]);
            // 1e-12 a step, grown over 4 s; power series against extrapolation.
            assert!((got - want).abs() < 1e-10 * (1.0 + want.abs()), "{along} [{i}]: {got} {want}");
        }
        // Across nothing moves.
        assert!((planar[bob(across)][2] + 1.0).abs() < 1e-14);
    }
}

/// k/m (1 + m/M + m z^2/I_y + m y^2/I_z) of a free craft without thrust: z the bob's height and y the arm of its line of motion from
/// the centre of mass of the rest, of mass M and moments of inertia I.
#[test]
fn a_free_body_with_a_planar_mode_off_its_axis_has_the_closed_form_s_frequency() {
    for along in [0, 1] {
        let (m, z, arm, k) = (300.0, -0.8, 0.45, 900.0);
        let mut tank = Tank { m_0: 0.0, i_0: 0.0, position: [0.0; 3], ..Tank::default() };
        (tank.mass[0], tank.length[0], tank.hinge[0], tank.k[0]) = (m, 0.5, z + 0.5, k);
        (tank.zeta[0], tank.arm[0]) = (0.0, arm);
        tank.direction[0][along] = 1.0;
        let mut p = craft(tank);
        p.craft.r = [0.0; 3];
        let u = Inputs::default();
        let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
        let mut dx = [0.0; STATES];
        let at = index::bob(0, 0) + along;
        dx[at] = 1.0;
        let got = -craft.directional_derivative(&u, &dx, &Default::default())[at + 3];
        let j = &p.craft.j;
        let across = if along == 0 { j.yy } else { j.xx };
        let share = m / p.craft.mass + m * z * z / across + m * arm * arm / j.zz;
        let want = k / m * (1.0 + share);
        assert!((got / want - 1.0).abs() < 1e-13, "{along}: {got} {want}");
    }
}

/// On a pivot too heavy to turn a box has a frequency along each axis, and what is pushed along one stays there.
#[test]
fn a_box_at_rest_under_gravity_has_two_frequencies() {
    let heavy = 1e11;
    let mut p = craft(a_box());
    (p.mount, p.gravity) = (Mount::Pivot, [0.0, 0.0, -9.81]);
    p.craft.j = Inertia { xx: heavy, yy: heavy, zz: heavy, xy: 0.0, xz: 0.0, yz: 0.0 };
    let u = Inputs::default();
    let mut craft = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap();
    for n in [0, 1] {
        let mut dx = [0.0; STATES];
        // Both directions of every bob.
        for bob in [index::bob(0, 0), index::bob(0, 1)] {
            (dx[bob], dx[bob + 1]) = (1.0, 1.0);
        }
        let rate = craft.directional_derivative(&u, &dx, &Default::default());
        let at = index::bob(0, n) + 3;
        let want = 9.81 / p.tank[0].length[n];
        // Its 1000 kg turn 1e11 kg m2 by 1e-8 of it.
        assert!((-rate[at + n] / want - 1.0).abs() < 1e-7, "{n}: {} {want}", rate[at + n]);
        assert_eq!(rate[at + 1 - n], 0.0);
    }
}

#[test]
fn what_is_alike_all_around_is_refused_with_what_is_not_by_both_names() {
    type Change = fn(&mut Tank);
    let axial: [(&str, Change); 3] = [
        ("diameter", |tank| tank.diameter = 0.9),
        ("fill.points", |tank| tank.fill.points = POINTS),
        ("ball.travel", |tank| tank.ball.travel = 1.0),
    ];
    let uneven: [(&str, Change); 4] = [
        ("direction", |tank| tank.direction[0] = [0.0, -1.0]),
        ("r_0", |tank| tank.r_0[1] = 0.1),
        ("dI_y", |tank| tank.di_y = 1.0),
        ("I_xy, I_xz, I_yz", |tank| tank.products[1] = 0.1),
    ];
    for (one, change) in axial {
        for (other, also) in uneven {
            let mut p = Parameters::default();
            change(&mut p.tank[0]);
            assert_eq!(p.problems(), [""; 0]);
            also(&mut p.tank[0]);
            let said = p.problems();
            let names = format!("tank[1].{one} with tank[1].{other} (allowed: ");
            assert!(said.iter().any(|text| text.starts_with(&names)), "{names} {said:?}");
        }
    }
    let mut p = Parameters { tanks: 2, ..Parameters::default() };
    p.tank[0].ball.travel = 1.0;
    p.tank[1].direction[0] = [1.0, 0.0];
    assert!(p.problems()[0].starts_with("tank[1].ball.travel with tank[2].direction (allowed: "));
}

/// Rigid liquid below 0 goes with planar modes alone, and the whole has to have inertia.
#[test]
fn rigid_liquid_below_0_is_allowed_with_planar_modes_as_long_as_the_whole_is_not() {
    let mut p = craft(a_box());
    assert_eq!(p.problems(), [""; 0]);
    p.tank[0].m_0 = -3000.0;
    assert!(p.problems()[0].contains("is singular"), "{:?}", p.problems());
    let mut p = craft(a_box());
    p.tank[0].direction = Default::default();
    let said = p.problems();
    assert!(said[0].starts_with("tank[1].m_0 = -120.0 (allowed: 0.0 to "), "{said:?}");
    let mut p = craft(a_box());
    p.tank[0].p_0[1] = [1.0, 0.0, 0.0];
    let said = p.problems();
    assert!(said[0].starts_with("tank[1].p_0[2] = ") && said[0].contains("tank[1].direction[2]"));
    p.tank[0].direction[1] = [1e-9, 0.0];
    assert!(p.problems()[0].starts_with("tank[1].direction[2] = "), "{:?}", p.problems());
}

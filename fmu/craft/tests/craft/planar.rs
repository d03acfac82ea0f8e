//! Tests of tanks without axial symmetry, whose modes swing in one plane.

use craft::{
    Coupling, Inertia, Inputs, Line, MODES, Mount, POINTS, Parameters, Ramp, STATES, TANK_STATES,
    Tank, TankInputs, TankParameters, index,
};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::component::{SloshTank, Spacecraft};
use super::exchange::{HostWithTanks, runge_kutta};
use super::random::Random;
use super::seeds::every_or;

/// Returns a box with 1000 kg of liquid, which is as deep as it is wide along y and twice as long along x. It has one mode
/// along each axis. The masses of both modes add up to more than the mass of the liquid.
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

/// If a craft with a box moves in a plane of symmetry, it moves, at any amplitude, like a craft with an axisymmetric tank: the
/// mode along the other axis stays at its position at rest and acts as rigid liquid.
#[test]
fn in_a_plane_of_symmetry_the_mode_across_the_plane_moves_as_rigid_liquid() {
    for along in [0, 1] {
        let (planar, across) = (a_box(), 1 - along);
        let mut around = Tank { modes: 1, direction: Default::default(), ..planar };
        for all in [&mut around.mass, &mut around.length, &mut around.hinge] {
            all[0] = all[along];
        }
        // m_0 and the bob of the mode across the plane are combined into one body, whose inertia is needed about the axis about
        // which the craft rotates.
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
            // Each step has an error of 1e-12, which grows over 4 s. The two motions are computed
            // by bob.rs and constrained.rs.
            assert!((got - want).abs() < 1e-10 * (1.0 + want.abs()), "{along} [{i}]: {got} {want}");
        }
        // Nothing moves perpendicular to the plane.
        assert!((planar[bob(across)][2] + 1.0).abs() < 1e-14);
    }
}

/// The expected squared frequency of a free craft without thrust is k/m (1 + m/M + m z^2/I_y + m y^2/I_z). z is the bob's
/// height and y the distance of its line of motion, both from the centre of mass of the remaining body, with mass M and
/// moments of inertia I.
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

/// On a craft that is too heavy to rotate, the liquid in a box has one frequency along each horizontal axis, and a motion that
/// starts along one axis stays along this axis.
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
        // The change of the states has a part in each of the two directions of every bob.
        for bob in [index::bob(0, 0), index::bob(0, 1)] {
            (dx[bob], dx[bob + 1]) = (1.0, 1.0);
        }
        let rate = craft.directional_derivative(&u, &dx, &Default::default());
        let at = index::bob(0, n) + 3;
        let want = 9.81 / p.tank[0].length[n];
        // The oscillation of 1000 kg of liquid rotates the craft, whose inertia is 1e11 kg m2, by 1e-8 of the slosh angle.
        assert!((-rate[at + n] / want - 1.0).abs() < 1e-7, "{n}: {} {want}", rate[at + n]);
        assert_eq!(rate[at + 1 - n], 0.0);
    }
}

/// For example `diameter`, `fill.points` or `ball.travel` is refused together with `direction` or `dI_y`. The
/// message contains both parameters.
#[test]
fn options_of_axisymmetric_tanks_are_refused_together_with_options_of_asymmetric_tanks() {
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
            let names = format!("tank[1].{one} cannot be combined with tank[1].{other}, because");
            assert!(said.iter().any(|text| text.starts_with(&names)), "{names} {said:?}");
        }
    }
    let mut p = Parameters { tanks: 2, ..Parameters::default() };
    p.tank[0].ball.travel = 1.0;
    p.tank[1].direction[0] = [1.0, 0.0];
    let names = "tank[1].ball.travel cannot be combined with tank[2].direction, because";
    assert!(p.problems()[0].starts_with(names));
}

#[test]
fn negative_rigid_mass_is_allowed_with_planar_modes_if_the_total_inertia_is_positive() {
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

/// A craft of 10 kg has a box whose rigid liquid has the mass -120 kg. While the bobs hang at rest
/// their masses make the mass matrix regular, but if both swing by 90 degrees, it is singular.
#[test]
fn a_craft_with_a_singular_mass_matrix_only_beyond_the_range_of_its_modes_is_allowed() {
    let light = |mass: f64| {
        let mut p = craft(a_box());
        p.craft.mass = mass;
        p
    };
    // The mass matrix of this craft is singular only where planar modes swing beyond 45 degrees, out of the
    // range of the model.
    assert_eq!(light(10.0).problems(), [""; 0]);
    // Craft and rigid liquid have 880 kg and positive inertia about every axis even without bobs, which only add inertia.
    assert_eq!(light(1000.0).problems(), [""; 0]);
    let host = TankParameters {
        tank: a_box(),
        host: Some(light(10.0).craft),
        ..TankParameters::default()
    };
    assert_eq!(host.problems(), [""; 0]);
    let host = TankParameters { host: Some(light(1000.0).craft), ..host };
    assert_eq!(host.problems(), [""; 0]);
}

/// A craft without inertia about its own axis has inertia only because of the liquid in a tank that is off the axis. While the
/// liquid is in flight, the craft does not even have this inertia.
#[test]
fn a_craft_with_a_singular_mass_matrix_without_liquid_is_refused_if_the_liquid_may_detach() {
    let mut p = Parameters::default();
    p.craft.r = [0.0; 3];
    p.craft.j = Inertia { xx: 900.0, yy: 900.0, zz: 0.0, xy: 0.0, xz: 0.0, yz: 0.0 };
    p.tank[0].position = [2.0, 0.0, 0.0];
    assert_eq!(p.problems(), [""; 0]);
    p.tank[0].ball.travel = 0.6;
    let said = p.problems();
    assert!(said.len() == 1 && said[0].contains("while the liquid is detached"), "{said:?}");
    p.tank[0].i_z = 1.0;
    assert_eq!(p.problems(), [""; 0]);
}

type V = Vector3<f64>;

/// Returns the momentum and the angular momentum about the inertial origin, and the energy, of a craft with its tanks, as a
/// sum over the positions and velocities of all masses, without the craft's outputs.
fn sums(p: &Parameters, x: &[f64; STATES]) -> [f64; 7] {
    let v = |at: usize| V::from_column_slice(&x[at..at + 3]);
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(x[0], x[1], x[2], x[3]));
    let (w, o, v_o) = (v(index::OMEGA), v(index::POSITION), turn.inverse() * v(index::VELOCITY));
    let (mut momentum, mut angular, mut energy) = (V::zeros(), V::zeros(), 0.0);
    let mut add = |m: f64, s: V, own: Matrix3<f64>, rate: V| {
        let velocity = v_o + w.cross(&s) + rate;
        momentum += turn * velocity * m;
        angular += (o + turn * s).cross(&(turn * velocity * m)) + turn * (own * w);
        energy += m * velocity.norm_squared() / 2.0 + w.dot(&(own * w)) / 2.0;
    };
    let j = p.craft.j.matrix();
    let zero = Matrix3::zeros();
    add(p.craft.mass, V::from(p.craft.r), Matrix3::from_fn(|i, k| j[i][k]), V::zeros());
    let mut springs = 0.0;
    for (i, tank) in p.tank[..p.tanks].iter().enumerate() {
        let [q, x, y, z] = tank.q;
        let axes = UnitQuaternion::from_quaternion(Quaternion::new(q, x, y, z));
        let axes: Matrix3<f64> = axes.to_rotation_matrix().into();
        let at = |r: V| V::from(tank.position) + axes * r;
        let [xy, xz, yz] = tank.products;
        let (xx, yy) = (tank.i_0, tank.i_0 + tank.di_y);
        let own = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, tank.i_z);
        let center = V::new(tank.r_0[0], tank.r_0[1], tank.h_0);
        add(tank.m_0, at(center), axes * own * axes.transpose(), V::zeros());
        for n in 0..tank.modes {
            let place = index::bob(i, n);
            let (rod, rate, l) = (v(place), v(place + 3), tank.length[n]);
            let [along, across] = tank.direction[n];
            // The line of motion is at the distance `arm` from the axis, on the side on which a motion along the direction
            // goes around the axis in the positive sense.
            let aside = V::new(along, across, 0.0).try_normalize(0.0).unwrap_or_default();
            let hinge = aside.cross(&V::z()) * tank.arm[n] + V::z() * tank.hinge[n];
            add(tank.mass[n], at(hinge + rod * l), zero, axes * rate * l);
            springs += tank.k[n] * l * l * (rod.x * rod.x + rod.y * rod.y) / 2.0;
        }
    }
    let [p, h] = [momentum, angular];
    [p.x, p.y, p.z, h.x, h.y, h.z, energy + springs]
}

/// A rigid body that carries the tanks, without external forces, solves (M_body + sum of M_a) [a; w'] = rest + sum of bias.
/// Body and tanks together conserve momentum and angular momentum in every stage of the integrator, and lose the energy
/// that the tanks dissipate.
#[test]
fn a_host_coupled_to_tanks_keeps_momentum_and_loses_the_energy_that_the_tanks_dissipate() {
    let mut telling = 0;
    let seeds = every_or(&[0, 1, 2], 0..8);
    for &seed in &seeds {
        let mut random = Random::new(seed);
        let mut p = random.parameters();
        random.make_all_planar(&mut p);
        for tank in &mut p.tank {
            // The drag is constant, so that the bias does not depend on the acceleration that is computed from it.
            tank.zeta = [0.05; MODES];
        }
        let u = Inputs::default();
        let start = Spacecraft::new(&p, &u, 0.0, 1e-9).unwrap().continuous_states();
        let mut host = HostWithTanks::new(&p, u);
        let mut x = start;
        runge_kutta(|t, x| host.rates(t, x), &mut x, 2.0, 4000);
        let (before, after) = (sums(&p, &start), sums(&p, &x));
        let size = before.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        for i in 0..6 {
            // The error is (h w)^5/120 in each of 4000 steps, for bobs at up to 60 1/s. The lengths |p| deviate from
            // 1 by as much.
            let off = (after[i] - before[i]).abs();
            assert!(off < 1e-10 * size, "{seed} [{i}] {off:e} of {size}");
        }
        let dissipated = x[index::DISSIPATED];
        let off = (after[6] + dissipated - before[6]).abs();
        assert!(off < 1e-9 * before[6], "{seed} {off:e} of {}", before[6]);
        telling += usize::from(dissipated > 1e-5 * before[6]);
    }
    assert!(telling > seeds.len() / 2, "{telling}");
}

fn inputs_after(u: &TankInputs, t: f64) -> TankInputs {
    let at = |ramp: &Ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope };
    let slope = u.omega_dot.slope;
    let omega = [0, 1, 2].map(|i| u.omega[i] + (u.omega_dot.value[i] + slope[i] * t / 2.0) * t);
    TankInputs { a: at(&u.a), omega, omega_dot: at(&u.omega_dot), ..*u }
}

/// One step of 2 s gives the same result as shorter steps, and as a Runge-Kutta integration of the tank's derivatives, under
/// every damping law. A mass flow has no effect, because these tanks have no fill table.
#[test]
fn co_simulation_of_a_tank_equals_model_exchange_by_a_runge_kutta_host() {
    for seed in every_or(&[0, 1, 2, 3], 0..8) {
        let mut random = Random::new(seed);
        let mut p = TankParameters { tank: random.tank(), ..TankParameters::default() };
        random.make_planar(&mut p.tank);
        if seed.is_multiple_of(2) {
            random.follow(&mut p.tank);
        }
        let mut ramp = || Ramp { value: random.vector(1.0), slope: random.vector(1.0) };
        let (a, omega_dot) = (ramp(), ramp());
        let mass_flow = Line { value: 5.0, slope: 1.0 };
        let u = TankInputs { a, omega: random.vector(0.5), omega_dot, mass_flow };
        let mut whole = SloshTank::new(&p, &u, 0.0, 1e-12).unwrap();
        let mut cut = SloshTank::new(&p, &u, 0.0, 1e-12).unwrap();
        let mut host = SloshTank::new(&p, &u, 0.0, 1e-12).unwrap();
        let start = whole.continuous_states();
        whole.step(&u, 2.0).unwrap();
        let mut t = 0.0;
        while t < 2.0 {
            let h = f64::min(random.magnitude(1e-3, 0.5), 2.0 - t);
            cut.step(&inputs_after(&u, t), h).unwrap();
            t += h;
        }
        let mut x = [0.0; STATES];
        x[..TANK_STATES].copy_from_slice(&start);
        let rates = |t: f64, x: &[f64; STATES]| {
            host.set_continuous_states(x[..TANK_STATES].try_into().unwrap());
            let mut rate = [0.0; STATES];
            rate[..TANK_STATES].copy_from_slice(&host.derivatives(&inputs_after(&u, t)));
            rate
        };
        runge_kutta(rates, &mut x, 2.0, 10_000);
        let (whole, cut) = (whole.continuous_states(), cut.continuous_states());
        for i in 0..TANK_STATES {
            let size = 1.0 + whole[i].abs();
            // Each step has an error of 1e-12, which grows over 2 s. The error of the Runge-Kutta method
            // is explained in `exchange.rs`.
            assert!(
                (cut[i] - whole[i]).abs() < 1e-10 * size,
                "{seed} [{i}] {} {}",
                cut[i],
                whole[i]
            );
            assert!((x[i] - whole[i]).abs() < 1e-9 * size, "{seed} [{i}] {} {}", x[i], whole[i]);
        }
        assert_eq!(whole[TANK_STATES - 1], start[TANK_STATES - 1], "liquid");
    }
}

/// In a tank at rest under the acceleration g, a pendulum has the squared frequency g/l, with another l along each axis of the
/// box. If the tank is suddenly accelerated along x, its wall at first pushes only the mass of the liquid minus the masses of the
/// modes that swing along x.
#[test]
fn a_box_on_a_host_has_two_frequencies_and_two_masses() {
    let p = TankParameters { tank: a_box(), ..TankParameters::default() };
    let u = TankInputs { a: Ramp::held([0.0, 0.0, 9.81]), ..TankInputs::default() };
    let mut tank = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
    let out = tank.outputs(&u);
    for along in [0, 1] {
        let mut x = [0.0; TANK_STATES];
        x.copy_from_slice(&tank.continuous_states());
        let small = 1e-6;
        x[6 * along + along] = small;
        let mut moved = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
        moved.set_continuous_states(&x);
        let got = -moved.derivatives(&u)[6 * along + 3 + along] / small;
        let want = 9.81 / p.tank.length[along];
        // The test compares the sine of an angle of 1e-6 rad.
        assert!((got / want - 1.0).abs() < 1e-11, "{along}: {got} {want}");
        let diagonal = out.added_mass[if along == 0 { 0 } else { 6 }];
        assert!((diagonal - (1000.0 - p.tank.mass[along])).abs() < 1e-10, "{along} {diagonal}");
    }
    assert!((out.mass - 1000.0).abs() < 1e-10);
}

/// A tank is refused if the total mass of its liquid is negative, or if the craft that carries it would not have
/// positive inertia with it.
#[test]
fn a_tank_with_negative_total_liquid_mass_is_refused() {
    let mut p = TankParameters { tank: a_box(), ..TankParameters::default() };
    p.host = Some(craft(a_box()).craft);
    for coupling in Coupling::ALL {
        p.coupling = coupling;
        assert_eq!(p.problems(), [""; 0]);
    }
    p.tank.i_z = -2000.0;
    let said = p.problems();
    assert!(said.len() == 1 && said[0].starts_with("the mass matrix of host.mass"), "{said:?}");
    p.host = None;
    assert_eq!(p.problems(), [""; 0]);
    p.tank.m_0 = -1120.0;
    let said = p.problems();
    assert_eq!(
        said,
        [
            "tank.m_0 = -1120.0 kg and tank.mass of all modes add up to 0.0 kg of liquid (allowed: more than 0)"
        ]
    );
    (p.tank.m_0, p.tank.direction) = (-120.0, Default::default());
    let said = p.problems();
    assert!(said[0].starts_with("tank.m_0 = -120.0 (allowed: 0.0 to "), "{said:?}");
}

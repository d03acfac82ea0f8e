//! Coefficients of the third order: bobs on other surfaces than spheres.
//!
//! `tests/six` compares their waves with potential flow.
//! `independent.rs`, `equations.rs`, `exchange.rs`, `balances.rs`, `draining.rs` and `impulses.rs` have such bobs among
//! their random tanks.

use craft::{
    Coupling, Inertia, Inputs, MODES, Mount, Parameters, Ramp, STATES, TANK_STATES, Tank,
    TankInputs, TankParameters,
};

use super::component::{SloshTank, Spacecraft};
use super::exchange::runge_kutta;
use super::random::Random;
use super::waves::{G, bench, circular, planar};

/// A tank that rests upright under gravity.
fn resting(tank: Tank) -> (SloshTank, TankInputs) {
    let u = TankInputs { a: Ramp::held([0.0, 0.0, G]), ..TankInputs::default() };
    let p = TankParameters { tank, ..TankParameters::default() };
    (SloshTank::new(&p, &u, 0.0, 1e-12).unwrap(), u)
}

/// Expected: (3 kappa/8 - s/2) A^2 and (kappa/2) A^2. Halving A divides what is left by 16.
#[test]
fn frequencies_shift_as_the_coefficients_say_and_the_rest_is_of_fourth_order() {
    for (s, kappa) in [(1.0, 1.0), (1.408, 0.734), (1.0, 8.0), (-3.0, 0.5), (1.0, 0.25), (0.0, 1.0)]
    {
        let mut tank = bench(1.227);
        (tank.nonlinear_inertia[0], tank.nonlinear_stiffness[0]) = (s, kappa);
        for (shift, frequency) in [
            (3.0 * kappa / 8.0 - s / 2.0, planar::<SloshTank> as fn(Tank, f64) -> f64),
            (kappa / 2.0, circular::<SloshTank>),
        ] {
            let left = |a: f64| frequency(tank, a).powi(2) - 1.0 - shift * a * a;
            let [large, small] = [left(0.1), left(0.05)];
            // Up to the sixth order.
            let bound = 30.0 * (1.0 + s.abs() + kappa.abs()).powi(2) * f64::powi(0.1, 4);
            assert!(large.abs() < bound, "{s} {kappa}: {large:e} of {bound:e}");
            let ratio = large / small;
            assert!(large.abs() < 1e-9 || (12.0..20.0).contains(&ratio), "{s} {kappa}: {ratio}");
        }
    }
}

/// One step ends where its pieces do, and where Runge-Kutta's does on the tank's own derivatives.
#[test]
fn a_tank_s_motion_does_not_depend_on_its_steps() {
    for seed in 0..8 {
        let mut random = Random::new(seed);
        let mut p = TankParameters { tank: random.tank(), ..TankParameters::default() };
        if seed.is_multiple_of(3) {
            random.make_planar(&mut p.tank);
        }
        random.bend(&mut p.tank);
        if seed.is_multiple_of(2) {
            random.follow(&mut p.tank);
        }
        let mut ramp = || Ramp { value: random.vector(1.0), slope: random.vector(1.0) };
        let (a, omega_dot) = (ramp(), ramp());
        let u = TankInputs { a, omega: random.vector(0.5), omega_dot, ..TankInputs::default() };
        let later = |t: f64| {
            let at = |ramp: &Ramp| Ramp { value: ramp.at(t), slope: ramp.slope };
            let slope = u.omega_dot.slope;
            let omega =
                [0, 1, 2].map(|i| u.omega[i] + (u.omega_dot.value[i] + slope[i] * t / 2.0) * t);
            TankInputs { a: at(&u.a), omega, omega_dot: at(&u.omega_dot), ..u }
        };
        let mut whole = SloshTank::new(&p, &u, 0.0, 1e-12).unwrap();
        let (mut cut, mut host) = (whole.clone(), whole.clone());
        let start = whole.continuous_states();
        whole.step(&u, 2.0).unwrap();
        let (mut t, mut dissipated) = (0.0, 0.0);
        while t < 2.0 {
            let h = f64::min(random.magnitude(1e-3, 0.5), 2.0 - t);
            cut.step(&later(t), h).unwrap();
            let lost = cut.continuous_states()[6 * MODES];
            assert!(lost >= dissipated, "{seed}: drag never drives");
            (t, dissipated) = (t + h, lost);
        }
        let mut x = [0.0; STATES];
        x[..TANK_STATES].copy_from_slice(&start);
        let rates = |t: f64, x: &[f64; STATES]| {
            host.set_continuous_states(x[..TANK_STATES].try_into().unwrap());
            let mut rate = [0.0; STATES];
            rate[..TANK_STATES].copy_from_slice(&host.derivatives(&later(t)));
            rate
        };
        runge_kutta(rates, &mut x, 2.0, 10_000);
        let (whole, cut) = (whole.continuous_states(), cut.continuous_states());
        for i in 0..TANK_STATES {
            let size = 1.0 + whole[i].abs();
            // 1e-12 a step, grown over 2 s.
            assert!((cut[i] - whole[i]).abs() < 1e-10 * size, "{seed} [{i}]");
            assert!((x[i] - whole[i]).abs() < 1e-9 * size, "{seed} [{i}]");
        }
    }
}

/// Coefficients of a pendulum leave the power series in place: the same bits as without them.
#[test]
fn a_surface_that_is_nearly_a_sphere_moves_as_a_pendulum() {
    let mut tank = Random::new(3).tank();
    (tank.modes, tank.k[0]) = (1, 0.0);
    let ends = [1.0, 1.0 + 1e-13].map(|s| {
        tank.nonlinear_inertia[0] = s;
        let (mut tank, u) = resting(tank);
        tank.step(&u, 3.0).unwrap();
        (tank.continuous_states(), tank.outputs(&u).bias, tank.outputs(&u).added_mass)
    });
    let [(x, bias, mass), (y, bias_y, mass_y)] = ends;
    for (a, b) in x.iter().chain(&bias).chain(&mass).zip(y.iter().chain(&bias_y).chain(&mass_y)) {
        // bob.rs against constrained.rs, 1e-12 a step.
        assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
    }
}

/// With s = -6 the inertia along the meridian reaches half of a pendulum's at 16.1 degrees.
#[test]
fn angles_at_which_the_inertia_vanishes_are_refused() {
    let mut tank = bench(1.227);
    tank.nonlinear_inertia[0] = -6.0;
    tank.nonlinear_stiffness[0] = 1.0;
    let u = TankInputs { a: Ramp::held([0.0, 0.0, G]), ..TankInputs::default() };
    let p = TankParameters { tank, ..TankParameters::default() };
    // u (1 - u) = 0.5/7
    let sin = f64::sqrt((1.0 - f64::sqrt(1.0 - 2.0 / 7.0)) / 2.0);
    let degrees = sin.asin().to_degrees();
    let bound = format!("exceeds {:.1} degrees", (degrees * 10.0).floor() / 10.0);

    let mut tilted = p;
    tilted.tank.p_0[0] = [1.02 * sin, 0.0, -f64::sqrt(1.0 - sin * sin)];
    let said = tilted.problems();
    assert!(said.len() == 1 && said[0].contains(&bound), "{bound} {said:?}");
    assert!(said[0].starts_with("tank.p_0[1]: "), "{said:?}");
    tilted.tank.p_0[0] = [0.98 * sin, 0.0, -f64::sqrt(1.0 - sin * sin)];
    assert_eq!(tilted.problems(), [""; 0]);

    // Pushed across until it reaches the bound, in one step and in many.
    let pushed = TankInputs { a: Ramp::held([3.0, 0.0, G]), ..u };
    for h in [3.0, 0.01] {
        let mut tank = SloshTank::new(&p, &u, 0.0, 1e-8).unwrap();
        let (mut before, mut done) = (tank.continuous_states(), Ok(()));
        for _ in 0..300 {
            before = tank.continuous_states();
            done = tank.step(&pushed, h);
            if done.is_err() {
                break;
            }
        }
        let why = done.unwrap_err();
        assert!(why.to_string().contains(&bound), "{why}");
        assert!(!why.shorter_may_succeed());
        assert_eq!(tank.continuous_states(), before);
        // A host that integrates itself is refused at the same angle.
        let mut x = before;
        (x[0], x[2]) = (1.02 * sin, -f64::sqrt(1.0 - 1.0404 * sin * sin));
        tank.set_continuous_states(&x);
        assert!(tank.check_surfaces().unwrap_err().to_string().contains(&bound));
        assert!(tank.derivatives(&u).iter().all(|x| x.is_finite()));
    }
    let mut craft = Parameters { tanks: 2, mount: Mount::Pivot, ..Parameters::default() };
    craft.tank[1] = p.tank;
    (craft.tank[1].p_dot_0[0], craft.craft.j.xx) = ([20.0, 0.0, 0.0], 900.0);
    let mut spacecraft = Spacecraft::new(&craft, &Inputs::default(), 0.0, 1e-8).unwrap();
    let why = spacecraft.step(&Inputs::default(), 3.0).unwrap_err().to_string();
    assert!(why.contains("tank[2].nonlinear_inertia[1] = -6.0") && why.contains(&bound), "{why}");
}

#[test]
fn coefficients_out_of_range_and_with_detached_liquid_are_refused_by_their_names() {
    let mut p = Parameters { tanks: 2, ..Parameters::default() };
    p.tank[1].nonlinear_inertia[0] = f64::NAN;
    p.tank[1].nonlinear_stiffness[0] = 2e3;
    let said = p.problems();
    assert!(said[0].starts_with("tank[2].nonlinear_inertia[1] = NaN (allowed: "), "{said:?}");
    assert!(said[1].starts_with("tank[2].nonlinear_stiffness[1] = 2000.0 (allowed: "), "{said:?}");
    (p.tank[1].nonlinear_inertia[0], p.tank[1].nonlinear_stiffness[0]) = (1.4, 0.7);
    assert_eq!(p.problems(), [""; 0]);
    for ball in [0, 1] {
        let mut p = p;
        p.tank[ball].ball.travel = 1.0;
        let said = p.problems();
        let name = format!("tank[{}].ball.travel with tank[2].nonlinear_inertia", ball + 1);
        assert!(said.len() == 1 && said[0].starts_with(&name), "{said:?}");
    }
    // Modes that are not in use do not count.
    p.tank[1].modes = 0;
    p.tank[0].ball.travel = 1.0;
    assert_eq!(p.problems(), [""; 0]);
}

/// For s = 0 a bob lends a third of its mass at 45 degrees.
#[test]
fn a_craft_too_light_for_its_coefficients_is_refused() {
    let mut p = Parameters { tanks: 1, ..Parameters::default() };
    p.tank[0].nonlinear_inertia[0] = 0.0;
    assert_eq!(p.problems(), [""; 0]);
    p.tank[0].m_0 = 0.0;
    p.craft.mass = 0.3 * p.tank[0].mass[0];
    p.craft.j = Inertia { xx: 90.0, yy: 86.0, zz: 64.0, xy: 0.0, xz: 0.0, yz: 0.0 };
    let said = p.problems();
    assert!(said.len() == 1 && said[0].contains("nonlinear_inertia below 1"), "{said:?}");
    let host = TankParameters {
        tank: p.tank[0],
        host: Some(p.craft),
        coupling: Coupling::Split,
        ..TankParameters::default()
    };
    let said = host.problems();
    assert!(said.len() == 1 && said[0].contains("nonlinear_inertia below 1"), "{said:?}");
    p.craft.mass = 3.0 * p.tank[0].mass[0];
    assert_eq!(p.problems(), [""; 0]);
}

//! Tests of the coefficients of the third order and beyond, with which bobs move on other surfaces than spheres.
//!
//! `tests/six` compares waves with these coefficients with potential flow. The random tanks of `independent.rs`, `equations.rs`,
//! `exchange.rs`, `balances.rs`, `draining.rs` and `impulses.rs` also have bobs on other surfaces than spheres.

use craft::{
    Coupling, FillTable, Inertia, Inputs, Line, MODES, Mount, POINTS, Parameters, Ramp, STATES,
    TANK_STATES, Tank, TankInputs, TankParameters,
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use taylor::number::{Dual, Number};

use super::component::{SloshTank, Spacecraft};
use super::exchange::runge_kutta;
use super::random::{Random, draining_tank};
use super::waves::{G, bench, circular, planar};

fn resting(tank: Tank) -> (SloshTank, TankInputs) {
    let u = TankInputs { a: Ramp::held([0.0, 0.0, G]), ..TankInputs::default() };
    let p = TankParameters { tank, ..TankParameters::default() };
    (SloshTank::new(&p, &u, 0.0, 1e-12).unwrap(), u)
}

/// If a wave has the amplitude A, the coefficients s and kappa change its frequency by the relative
/// amount (3 kappa/8 - s/2) A^2 in planar motion and (kappa/2) A^2 in circular motion. The
/// remaining difference is of the fourth order: it falls by a factor of 16 if A is halved.
#[test]
fn frequencies_shift_as_s_and_kappa_predict_up_to_fourth_order() {
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
            // The bound includes terms up to the sixth order.
            let bound = 30.0 * (1.0 + s.abs() + kappa.abs()).powi(2) * f64::powi(0.1, 4);
            assert!(large.abs() < bound, "{s} {kappa}: {large:e} of {bound:e}");
            let ratio = large / small;
            assert!(large.abs() < 1e-9 || (12.0..20.0).contains(&ratio), "{s} {kappa}: {ratio}");
        }
    }
}

#[test]
fn the_motion_of_a_tank_does_not_depend_on_the_communication_step() {
    for seed in 0..8 {
        let mut random = Random::new(seed);
        let mut p = TankParameters { tank: random.tank(), ..TankParameters::default() };
        if seed.is_multiple_of(3) {
            random.make_planar(&mut p.tank);
        }
        random.bend(&mut p.tank);
        if seed > 3 {
            random.bend_further(&mut p.tank);
        }
        if seed.is_multiple_of(2) {
            random.follow(&mut p.tank);
        }
        let mut ramp = || Ramp { value: random.vector(1.0), slope: random.vector(1.0) };
        let (a, omega_dot) = (ramp(), ramp());
        let u = TankInputs { a, omega: random.vector(0.5), omega_dot, ..TankInputs::default() };
        let later = |t: f64| {
            let at = |ramp: &Ramp| Ramp { value: ramp.value_at(t), slope: ramp.slope };
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
            assert!(lost >= dissipated, "{seed}: drag added energy");
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
            // Each step has an error of 1e-12, which grows over 2 s.
            assert!((cut[i] - whole[i]).abs() < 1e-10 * size, "{seed} [{i}]");
            assert!((x[i] - whole[i]).abs() < 1e-9 * size, "{seed} [{i}]");
        }
    }
}

/// If s = kappa = 1, the power series of a pendulum are used, so that the results are bit-identical to those of a tank without
/// these coefficients. If they differ little from 1, the motion is nearly the same.
#[test]
fn coefficients_near_one_move_as_a_pendulum() {
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
        // The two motions are computed by bob.rs and constrained.rs, with an error of 1e-12 in each step.
        assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
    }
}

/// With s = -6 the bob's inertia along the meridian of its surface falls to half of a pendulum's
/// inertia at 16.1 degrees, where the model ends.
#[test]
fn slosh_angles_at_which_a_bob_has_too_little_inertia_are_refused() {
    let mut tank = bench(1.227);
    tank.nonlinear_inertia[0] = -6.0;
    tank.nonlinear_stiffness[0] = 1.0;
    let u = TankInputs { a: Ramp::held([0.0, 0.0, G]), ..TankInputs::default() };
    let p = TankParameters { tank, ..TankParameters::default() };
    // The angle at which half of the inertia is left follows from u (1 - u) = 0.5/7.
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

    // The bob is pushed across the axis until it reaches the limit, in one step and in many.
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
        // In Model Exchange the error occurs at the same angle.
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
fn large_wave_coefficients_are_refused_out_of_range_and_with_detached_liquid() {
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
        let name = format!(
            "tank[{}].ball.travel cannot be combined with tank[2].nonlinear_inertia",
            ball + 1
        );
        assert!(said.len() == 1 && said[0].starts_with(&name), "{said:?}");
    }
    // Parameters of modes that are not in use have no effect.
    p.tank[1].modes = 0;
    p.tank[0].ball.travel = 1.0;
    assert_eq!(p.problems(), [""; 0]);
}

/// For s = 0 (`nonlinear_inertia`) a bob at 45 degrees reduces the inertia of the craft by a third
/// of its own mass, so that a craft with 0.3 times this mass is refused.
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

/// Lagrangian of one mode of a draining tank, divided by the mass:
///
/// ```text
/// L = |rho' + w x rho|^2/2 - a.rho + (s - 1) l^2 (q.q')^2/2 - (k/m) l^2 |q|^2/2
/// rho = d + h e + l q + [(kappa - 1) l |q|^4/8 - l sqrt(1 - |q|^2)] e
/// ```
///
/// q has the x and y components of the unit vector from hinge to bob. The fill table has two points. Between them 1/l, h - l, m
/// divided by the mass of liquid, s and kappa are linear functions of the mass of liquid.
struct Lagrangian<'a> {
    tank: &'a Tank,
    n: usize,
    u: &'a TankInputs,
}

impl Lagrangian<'_> {
    fn table<T: Number>(&self, t: T) -> [T; 5] {
        if self.tank.fill.points == 0 {
            let Tank {
                length, hinge, mass, nonlinear_inertia: s, nonlinear_stiffness: kappa, ..
            } = self.tank;
            return [length, hinge, mass, s, kappa].map(|of| T::constant(of[self.n]));
        }
        let (FillTable { liquid, mass, length, hinge, .. }, n) = (&self.tank.fill, self.n);
        let flow = self.u.mass_flow;
        let left = T::constant(self.tank.liquid_0)
            - t * (T::constant(flow.value) + t * (flow.slope / 2.0));
        let share = (left - T::constant(liquid[0])) * (1.0 / (liquid[1] - liquid[0]));
        let line = |y: [f64; 2]| T::constant(y[0]) + share * (y[1] - y[0]);
        let ends = |of: &dyn Fn(usize) -> f64| line([of(0), of(1)]);
        let l = ends(&|i| 1.0 / length[n][i]).recip();
        let h = ends(&|i| hinge[n][i] - length[n][i]) + l;
        let m = ends(&|i| mass[n][i] / liquid[i]) * left;
        let FillTable { nonlinear_inertia, nonlinear_stiffness, .. } = &self.tank.fill;
        [l, h, m, ends(&|i| nonlinear_inertia[n][i]), ends(&|i| nonlinear_stiffness[n][i])]
    }

    fn at(&self, q: [f64; 2], q_d: [f64; 2], t: f64) -> f64 {
        let time = Dual::with_slope(t, 1.0);
        let [l, h, _, _, kappa] = self.table(time);
        let [x, y] = [0, 1].map(|i| Dual::with_slope(q[i], q_d[i]));
        let u = x * x + y * y;
        let one = Dual::constant(1.0);
        let kappa_2 = self.tank.nonlinear_stiffness_2[self.n];
        let up = h + (kappa - one) * l * u * u * 0.125 + l * u * u * u * (kappa_2 / 16.0)
            - l * (one - u).sqrt();
        let in_tank = [l * x, l * y, up];
        let vector = |of: fn(Dual) -> f64| Vector3::from(in_tank.map(of));
        let [w, x_q, y_q, z_q] = self.tank.q;
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x_q, y_q, z_q));
        let rho = Vector3::from(self.tank.position) + turn * vector(Dual::value);
        let TankInputs { a, omega, omega_dot, .. } = self.u;
        let moved = |i: usize| omega[i] + (omega_dot.value[i] + omega_dot.slope[i] * t / 2.0) * t;
        let w = Vector3::from([0, 1, 2].map(moved));
        let speed = turn * vector(Dual::result) + w.cross(&rho);
        let [l, _, m, s, _] = self.table(t);
        let sigma = q[0] * q_d[0] + q[1] * q_d[1];
        let (u, tank) = (u.value(), self.tank);
        let tau = q[0] * q_d[1] - q[1] * q_d[0] + u * w.dot(&(turn * Vector3::z()));
        let along = s - 1.0 + tank.nonlinear_inertia_2[self.n] * u;
        let around = tank.rotary_inertia[self.n] + tank.rotary_inertia_2[self.n] * u;
        let inner = 0.5 * (along * (l * sigma).powi(2) + around * (l * tau).powi(2));
        let centring = 0.5 * self.tank.k[self.n] / m * l * l * (q[0] * q[0] + q[1] * q[1]);
        0.5 * speed.norm_squared() - Vector3::from(a.value_at(t)).dot(&rho) + inner - centring
    }
}

/// Central difference of the sixth order: for each pair of points its distance from the centre, in steps, and its weight.
const DIFFERENCES: [(f64, f64); 6] = [
    (1.0, 0.75),
    (2.0, -0.15),
    (3.0, 1.0 / 60.0),
    (-1.0, -0.75),
    (-2.0, 0.15),
    (-3.0, -1.0 / 60.0),
];

/// The motion of a tank's bobs fulfils Lagrange's equations, d(dL/dq')/dt = dL/dq, for a Lagrangian
/// L whose derivatives are computed by finite differences. In some tanks the liquid flows so fast
/// that the changes of s and kappa matter. In the others the modes have coefficients beyond the
/// third order.
#[test]
fn bobs_with_s_and_kappa_follow_lagrange_s_equations() {
    for seed in 0..36 {
        let mut random = Random::new(seed);
        let mut tank = draining_tank(&mut random, 1 + seed as usize % 3);
        random.bend_by_fill(&mut tank);
        (tank.fill.points, tank.zeta, tank.fill.zeta) = (2, [0.0; MODES], [[0.0; POINTS]; MODES]);
        tank.liquid_0 = 0.5 * (tank.fill.liquid[0] + tank.fill.liquid[1]);
        if seed >= 24 {
            tank.fill.points = 0;
            random.bend(&mut tank);
            random.bend_further(&mut tank);
        }
        let mut ramp = || Ramp { value: random.vector(2.0), slope: random.vector(1.0) };
        let (a, omega, omega_dot) = (ramp(), ramp().value, ramp());
        let mass_flow =
            Line { value: random.between(-30.0, 30.0), slope: random.between(-50.0, 50.0) };
        let u = TankInputs { a, omega, omega_dot, mass_flow };
        let p = TankParameters { tank, ..TankParameters::default() };
        let start = SloshTank::new(&p, &u, 0.0, 1e-13).unwrap();
        // The errors are h^6 times the seventh derivative of a motion with up to 20 rad/s, and 1e-13/h.
        let (h, middle) = (2e-3, 0.05);
        let at = |t: f64| {
            let mut tank = start.clone();
            tank.step(&u, t).unwrap();
            tank.continuous_states()
        };
        let states: Vec<_> = (0..7).map(|k| at(middle + (k as f64 - 3.0) * h)).collect();
        for n in 0..tank.modes {
            let law = Lagrangian { tank: &tank, n, u: &u };
            let q = |x: &[f64; TANK_STATES]| {
                let bob = &x[6 * n..];
                [[bob[0], bob[1]], [bob[3], bob[4]]]
            };
            let moved = |mut q: [f64; 2], i: usize, by: f64| {
                q[i] += by;
                q
            };
            // One difference is enough because L is quadratic in q'.
            let momentum = |k: usize, i: usize| {
                let ([place, rate], t) = (q(&states[k]), middle + (k as f64 - 3.0) * h);
                let [more, less] = [0.5, -0.5].map(|by| law.at(place, moved(rate, i, by), t));
                more - less
            };
            let [place, rate] = q(&states[3]);
            for i in 0..2 {
                let (mut left, mut right) = (0.0, 0.0);
                for (step, weight) in DIFFERENCES {
                    left += weight * momentum((3.0 + step) as usize, i) / h;
                    right += weight * law.at(moved(place, i, 0.01 * step), rate, middle) / 0.01;
                }
                let l = law.table(middle)[0];
                let size = l * (1.0 + l * rate[0].hypot(rate[1]));
                println!(
                    "{seed} {n} {i}: {left:.9} {right:.9} {:.1e}",
                    (left - right).abs() / size
                );
                assert!((left - right).abs() < 1e-8 * size, "{seed} {n} {i}: {left} {right}");
            }
        }
    }
}

/// The amplitude of a wave with coefficients beyond the third order decays as the damping c/m demands: the dissipated power is 2
/// c/m times the kinetic energy, which includes the kinetic energy within the liquid.
#[test]
fn drag_dissipates_2_c_over_m_times_the_whole_kinetic_energy() {
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let mut tank = Tank { modes: 1, k: [0.0; MODES], ..random.tank() };
        tank.damping_law = craft::DampingLaw::Constant;
        tank.zeta_amplitude = [0.0; MODES];
        tank.zeta_breaking = [0.0; MODES];
        tank.zeta[0] = 0.01;
        random.bend(&mut tank);
        random.bend_further(&mut tank);
        tank.p_0[0] = random.vector(1.0);
        tank.p_dot_0[0] = random.vector(3.0);
        let (u, p) = (TankInputs::default(), TankParameters { tank, ..TankParameters::default() });
        let mut slosh = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
        let x = slosh.continuous_states();
        let kinetic = Lagrangian { tank: &tank, n: 0, u: &u }.at([x[0], x[1]], [x[3], x[4]], 0.0);
        let expected = 4.0 * 0.01 * f64::sqrt(tank.g_ref / tank.length[0]) * tank.mass[0] * kinetic;
        let power = slosh.derivatives(&u)[6 * MODES];
        // The Lagrangian is valid only for a bob below its hinge.
        if x[2] < -0.1 {
            assert!((power / expected - 1.0).abs() < 1e-12, "{seed}: {power} {expected}");
        }
    }
}

/// The rotation of a tank about its axis does not change a wave: with and without rotation the bob is at the same place in
/// inertial axes, and the tank gets no torque about its axis.
#[test]
fn a_wave_is_unchanged_in_a_tank_that_turns_about_its_axis() {
    let mut tank = bench(0.5);
    [tank.nonlinear_inertia[0], tank.nonlinear_inertia_2[0]] = [3.02, -0.65];
    [tank.nonlinear_stiffness[0], tank.nonlinear_stiffness_2[0]] = [4.11, -6.6];
    [tank.rotary_inertia[0], tank.rotary_inertia_2[0]] = [0.70, -1.56];
    tank.p_0[0] = [0.2, 0.0, -f64::sqrt(0.96)];
    let still = [0.05, 2.0];
    let moved = |rate: f64| {
        let mut tank = tank;
        tank.p_dot_0[0] = [still[0], still[1] - 0.2 * rate, 0.0];
        let a = Ramp::held([0.0, 0.0, G]);
        let u = TankInputs { a, omega: [0.0, 0.0, rate], ..TankInputs::default() };
        let p = TankParameters { tank, ..TankParameters::default() };
        let mut tank = SloshTank::new(&p, &u, 0.0, 1e-12).unwrap();
        assert_eq!(p.problems(), [""; 0]);
        tank.step(&u, 3.0).unwrap();
        let torque = tank.outputs(&u).tank.torque[2];
        assert!(torque.abs() < 1e-13, "{rate}: {torque:e}");
        let x = tank.continuous_states();
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 3.0 * rate);
        turned * Vector3::new(x[0], x[1], x[2])
    };
    let without = moved(0.0);
    for rate in [0.7, -2.0] {
        let off = (moved(rate) - without).norm();
        assert!(off < 1e-9, "{rate}: {off:e}");
    }
}

/// At 20.7 degrees the inertia of rotary motion, 1 - 4 u with the squared sine u of the slosh
/// angle, falls to half of a pendulum's inertia, so that the model ends there.
#[test]
fn slosh_angles_at_which_rotary_motion_has_too_little_inertia_are_refused() {
    let mut tank = bench(1.227);
    (tank.rotary_inertia[0], tank.nonlinear_inertia[0]) = (-4.0, 1.0);
    tank.p_0[0] = [0.36, 0.0, -f64::sqrt(1.0 - 0.36 * 0.36)];
    let said = TankParameters { tank, ..TankParameters::default() }.problems();
    assert!(said.len() == 1 && said[0].contains("exceeds 20.7 degrees"), "{said:?}");
    assert!(said[0].contains("rotary_inertia[1] = -4.0"), "{said:?}");
    tank.p_0[0] = [0.35, 0.0, -f64::sqrt(1.0 - 0.35 * 0.35)];
    assert_eq!(TankParameters { tank, ..TankParameters::default() }.problems(), [""; 0]);
}

/// For example, `rotary_inertia` of a mode with a `direction` is refused. The message contains both parameters.
#[test]
fn coefficients_beyond_the_third_order_are_refused_with_planar_modes_and_fill_tables() {
    let mut p = TankParameters::default();
    p.tank.rotary_inertia[0] = 0.5;
    p.tank.direction[0] = [1.0, 0.0];
    let said = p.problems();
    let names = "tank.rotary_inertia[1] = 0.5 cannot be combined with tank.direction[1]";
    assert!(said[0].starts_with(names), "{said:?}");
    p.tank.direction[0] = [0.0; 2];
    assert_eq!(p.problems(), [""; 0]);
    p.tank.fill.points = POINTS;
    let said = p.problems();
    let names = "tank.rotary_inertia[1] = 0.5 cannot be combined with tank.fill";
    assert!(said[0].starts_with(names), "{said:?}");
    (p.tank.fill.points, p.tank.nonlinear_inertia_2[0]) = (0, 2e5);
    let said = p.problems();
    assert!(said[0].starts_with("tank.nonlinear_inertia_2[1] = 200000.0 (allowed: "), "{said:?}");
}

#[test]
fn a_fill_table_with_constant_s_and_kappa_moves_as_a_tank_with_these_values() {
    for seed in 0..6 {
        let mut random = Random::new(seed);
        let mut tank = draining_tank(&mut random, 1 + seed as usize % 3);
        random.bend(&mut tank);
        let mass_flow = Line { value: 5.0, slope: 0.5 };
        let a = Ramp { value: random.vector(2.0), slope: random.vector(1.0) };
        let u = TankInputs { a, omega: random.vector(0.5), mass_flow, ..TankInputs::default() };
        let mut by_table = tank;
        for n in 0..tank.modes {
            by_table.fill.nonlinear_inertia[n] = [tank.nonlinear_inertia[n]; POINTS];
            by_table.fill.nonlinear_stiffness[n] = [tank.nonlinear_stiffness[n]; POINTS];
        }
        by_table.nonlinear_inertia = [1.0; MODES];
        by_table.nonlinear_stiffness = [1.0; MODES];
        let [mut one, mut other] = [tank, by_table].map(|tank| {
            let p = TankParameters { tank, ..TankParameters::default() };
            let mut tank = SloshTank::new(&p, &u, 0.0, 1e-12).unwrap();
            tank.step(&u, 2.0).unwrap();
            tank
        });
        let (out, same) = (one.outputs(&u), other.outputs(&u));
        let all = |tank: &SloshTank, bias: &[f64]| [&tank.continuous_states()[..], bias].concat();
        for (a, b) in all(&one, &out.bias).iter().zip(all(&other, &same.bias)) {
            assert!((a - b).abs() < 1e-10 * (1.0 + a.abs()), "{seed}: {a} {b}");
        }
    }
}

#[test]
fn a_tank_at_a_point_of_its_table_has_the_coefficients_of_this_point() {
    let mut random = Random::new(5);
    let mut tank = draining_tank(&mut random, 2);
    random.bend_by_fill(&mut tank);
    let u = TankInputs { a: Ramp::held([0.3, -0.2, 2.0]), ..TankInputs::default() };
    for point in [0, 4, POINTS - 1] {
        let with = Tank { liquid_0: tank.fill.liquid[point], ..tank };
        let mut constant = with;
        for n in 0..tank.modes {
            constant.nonlinear_inertia[n] = tank.fill.nonlinear_inertia[n][point];
            constant.nonlinear_stiffness[n] = tank.fill.nonlinear_stiffness[n][point];
        }
        constant.fill.nonlinear_inertia = [[1.0; POINTS]; MODES];
        constant.fill.nonlinear_stiffness = [[1.0; POINTS]; MODES];
        let rates = |tank: Tank| {
            let p = TankParameters { tank, ..TankParameters::default() };
            SloshTank::new(&p, &u, 0.0, 1e-9).unwrap().derivatives(&u)
        };
        assert_eq!(rates(with), rates(constant), "{point}");
        constant.nonlinear_stiffness[1] += 0.1;
        assert_ne!(rates(with), rates(constant), "{point}");
    }
}

/// While the liquid falls from a point of the table with s = 1 to a point with s = -6, the largest valid angle falls until
/// it reaches 20 degrees, the angle of a bob in circular motion.
#[test]
fn a_step_is_refused_if_the_largest_valid_angle_falls_to_the_angle_of_a_bob() {
    let mut tank = Tank { modes: 1, zeta: [0.0; MODES], ..Tank::default() };
    tank.fill.points = 2;
    tank.fill.nonlinear_inertia[0][0] = -6.0;
    (tank.fill.liquid[0], tank.fill.liquid[1], tank.liquid_0) = (300.0, 400.0, 399.0);
    tank.fill.length[0][0] = tank.fill.length[0][1];
    let (sin, cos) = f64::to_radians(20.0).sin_cos();
    tank.p_0[0] = [sin, 0.0, -cos];
    let l = tank.fill.mode(0, tank.liquid_0)[1];
    tank.p_dot_0[0] = [0.0, sin * f64::sqrt(G / l / cos), 0.0];
    let mass_flow = Line { value: 10.0, slope: 0.0 };
    let u = TankInputs { a: Ramp::held([0.0, 0.0, G]), mass_flow, ..TankInputs::default() };
    let p = TankParameters { tank, ..TankParameters::default() };
    assert_eq!(p.problems(), [""; 0]);
    let mut slosh = SloshTank::new(&p, &u, 0.0, 1e-8).unwrap();
    let why = (0..90).find_map(|_| slosh.step(&u, 0.1).err()).unwrap().to_string();
    assert!(
        why.contains("slosh angle of mode 1")
            && why.contains("The table tank.fill gives these coefficients at"),
        "{why}"
    );
    assert!(slosh.continuous_states()[6 * MODES + 1] > 305.0);
    // If the tank starts at the last point of the table, the same initial angle is refused.
    let empty = TankParameters { tank: Tank { liquid_0: 300.0, ..tank }, ..p };
    let said = empty.problems();
    assert!(said.len() == 1 && said[0].contains("exceeds 16.1 degrees"), "{said:?}");
}

/// A draining tank uses `fill.nonlinear_inertia` and `fill.nonlinear_stiffness` instead of the tank's own coefficients.
/// Values out of range are refused with the index of the table's point.
#[test]
fn the_large_wave_coefficients_of_a_fill_table_replace_those_of_the_tank_and_are_checked() {
    let mut p = Parameters { tanks: 1, ..Parameters::default() };
    let tank = &mut p.tank[0];
    tank.fill.points = 3;
    tank.fill.nonlinear_inertia[0][1] = f64::NAN;
    tank.fill.nonlinear_stiffness[0][2] = 2e3;
    let said = p.problems();
    assert!(
        said[0].starts_with("tank[1].fill.nonlinear_inertia[1,2] = NaN (allowed: "),
        "{said:?}"
    );
    assert!(said[1].starts_with("tank[1].fill.nonlinear_stiffness[1,3] = 2000.0 "), "{said:?}");
    let tank = &mut p.tank[0];
    tank.liquid_0 = 100.0;
    (tank.fill.nonlinear_inertia[0][1], tank.fill.nonlinear_stiffness[0][2]) = (1.4, 0.7);
    assert_eq!(p.problems(), [""; 0]);
    let why = p.overridden("tank[].nonlinear_inertia", &[0, 0]).unwrap();
    assert_eq!(why, "tank[1].fill.nonlinear_inertia[1,1] to fill.nonlinear_inertia[1,3]");
    assert_eq!(p.overridden("tank[].nonlinear_inertia", &[0, 1]), None);
    // Values of points and modes that are not in use are not checked.
    p.tank[0].fill.points = 0;
    p.tank[0].fill.nonlinear_inertia[0][0] = f64::NAN;
    assert_eq!(p.problems(), [""; 0]);
    // This craft is heavy enough for the coefficients at the initial fill, but not for those at the point of the table
    // where s is 0.
    let mut p = Parameters { tanks: 1, ..Parameters::default() };
    let tank = &mut p.tank[0];
    (tank.fill.points, tank.liquid_0) = (2, 127.0);
    tank.fill.mass[0][..2].copy_from_slice(&[63.0, 87.0]);
    p.craft.mass = 15.0;
    p.craft.j = Inertia { xx: 90.0, yy: 86.0, zz: 64.0, xy: 0.0, xz: 0.0, yz: 0.0 };
    assert_eq!(p.problems(), [""; 0]);
    p.tank[0].fill.nonlinear_inertia[0][0] = 0.0;
    let said = p.problems();
    assert!(said.len() == 1 && said[0].contains("nonlinear_inertia below 1"), "{said:?}");
}

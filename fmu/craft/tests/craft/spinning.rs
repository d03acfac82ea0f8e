//! Tests of liquid that spins with its tank (`src/spin.rs`).

use craft::{
    Craft, INPUTS, Inertia, Inputs, LimitedBy, MODES, Parameters, Ramp, STATES, TANK_INPUTS,
    TANK_STATES, TANKS, Tank, TankInputs, TankParameters, index,
};
use formulas::limits::SpinLimit;
use nalgebra::Complex;

use super::component::{SloshTank, Spacecraft};
use super::random::{Random, draining_craft};

type C = Complex<f64>;

/// Each row describes a rigid body with a full spheroidal tank about the same centre. First come
/// the body's moments of inertia across its axis and about it, the mass of the liquid, kg, and the
/// tank's semi-axes across the axis and along it, m. Then follow the rates of both nutations in
/// body axes, divided by the rate of spin, as complex numbers. They were computed from Poincare's
/// equations (`fmu/craft/src/spin.rs`).
const SPHEROIDS: [([f64; 5], [[f64; 2]; 2]); 6] = [
    ([60.0, 40.0, 30.0, 0.3, 0.2], [[-0.326391621079, 0.0], [-1.3901790763, 0.0]]),
    ([60.0, 40.0, 30.0, 0.25, 0.25], [[-1.0 / 3.0, 0.0], [-1.0, 0.0]]),
    ([60.0, 40.0, 30.0, 0.2, 0.3], [[-0.343039898263, 0.0], [-0.605776480496, 0.0]]),
    (
        [1.0, 1.0, 100.0, 0.5, 0.75],
        [[-0.443502824859, 0.966048004587], [-0.443502824859, -0.966048004587]],
    ),
    ([0.2, 0.1, 100.0, 0.2, 0.7], [[-0.230218643499, 0.0], [-0.760878565355, 0.0]]),
    ([50.0, 90.0, 80.0, 0.3, 0.4], [[0.783443734998, 0.0], [-0.71017527478, 0.0]]),
];

/// Returns a craft with a full spheroidal tank that rotates about its z axis at `rate`, rad/s. The
/// first five numbers are the craft's moments of inertia across the z axis and about it, the mass
/// of the liquid, and the tank's semi-axes across the z axis and along it. `decay` are the decay
/// rates of the liquid's spin by friction, 1/s.
fn spheroid([across, axial, m, a, c]: [f64; 5], rate: f64, decay: [f64; 2]) -> Parameters {
    let mut p = Parameters::default();
    let j = Inertia { xx: across, yy: across, zz: axial, xy: 0.0, xz: 0.0, yz: 0.0 };
    p.craft = Craft { mass: 100.0, r: [0.0; 3], j };
    let squares = a * a + c * c;
    p.tank[0] = Tank {
        position: [0.0; 3],
        modes: 0,
        m_0: m,
        h_0: 0.0,
        i_0: m * (a * a - c * c).powi(2) / (5.0 * squares),
        i_z: 0.0,
        spin_inertia: 2.0 * m * a * a / 5.0,
        spin_inertia_across: m * squares / 5.0,
        spin_coupling: 2.0 * a * c / squares,
        spin_decay: decay,
        ..Tank::default()
    };
    p.init.omega = [0.0, 0.0, rate];
    p
}

fn roots(a: C, b: C, c: C) -> [C; 2] {
    let root = (b * b - a * c * 4.0).sqrt();
    [(-b + root) / (a * 2.0), (-b - root) / (a * 2.0)]
}

/// Returns the rates lambda of both nutations from the craft's directional derivatives. By symmetry w_x + i w_y and L_x + i
/// L_y fulfil two complex equations.
fn nutations(p: &Parameters) -> [C; 2] {
    let inputs = Inputs::default();
    let mut craft = Spacecraft::new(p, &inputs, 0.0, 1e-9).unwrap();
    let at = [index::OMEGA, index::spin(0)];
    let columns = at.map(|i| {
        let mut dx = [0.0; STATES];
        dx[i] = 1.0;
        let rate = craft.directional_derivative(&inputs, &dx, &[0.0; INPUTS]);
        at.map(|k| C::new(rate[k], rate[k + 1]))
    });
    let [[a, c], [b, d]] = columns;
    let one = C::from(1.0);
    // The motion is proportional to exp(i lambda Omega t).
    roots(one, -(a + d), a * d - b * c).map(|sigma| sigma / C::new(0.0, p.init.omega[2]))
}

fn assert_roots(found: [C; 2], want: [C; 2], what: &str) {
    let off = |k: usize| (found[0] - want[k]).norm() + (found[1] - want[1 - k]).norm();
    assert!(off(0).min(off(1)) < 2e-9, "{what}: {found:?} {want:?}");
}

#[test]
fn craft_with_full_spheroids_nutate_at_the_rates_of_poincare() {
    for (k, (body, want)) in SPHEROIDS.into_iter().enumerate() {
        for rate in [9.0, -0.5] {
            let found = nutations(&spheroid(body, rate, [0.0; 2]));
            assert_roots(found, want.map(|[re, im]| C::new(re, im)), &format!("{k}"));
        }
    }
}

/// Returns the coefficients of lambda^2, lambda and 1 in the equation of the nutation rates lambda:
/// (A A' - F^2) lambda^2 + [(A - C) A' + A C' - F^2] lambda + (A - C) C' = 0. If the liquid has
/// friction, `by_friction` = -i K/Omega is added to C'.
fn closed_form([across, axial, m, a, c]: [f64; 5], by_friction: C) -> [C; 3] {
    let (inner, whole) = (m * (a * a + c * c) / 5.0, 2.0 * m * a * a / 5.0);
    let shared = 2.0 * m * a * c / 5.0;
    let (across, axial) = (across + inner, axial + whole);
    let turning = C::from(whole) + by_friction;
    [
        C::from(across * inner - shared * shared),
        turning * across + (across - axial) * inner - shared * shared,
        turning * (across - axial),
    ]
}

fn random_body(random: &mut Random) -> [f64; 5] {
    let across = random.magnitude(0.2, 60.0);
    let axial = across * random.between(0.3, 1.9);
    let a = random.between(0.2, 0.5);
    [across, axial, random.magnitude(5.0, 300.0), a, a * random.between(0.4, 3.0)]
}

#[test]
fn friction_in_full_spheroids_changes_nutation_as_the_closed_form_says() {
    let mut random = Random::new(1);
    for k in 0..30 {
        let (body, rate) = (random_body(&mut random), random.between(0.5, 9.0));
        let decay = random.magnitude(1e-3, 0.3);
        let inner = body[2] * (body[3] * body[3] + body[4] * body[4]) / 5.0;
        let [a, b, c] = closed_form(body, C::new(0.0, -decay * inner / rate));
        let found = nutations(&spheroid(body, rate, [0.0, decay]));
        assert_roots(found, roots(a, b, c), &format!("{k}"));
    }
}

/// Rumyantsev's criterion says that a spinning craft is stable if the rates of both nutations are real. In
/// an unstable craft a nutation of 1e-7 rad/s at least doubles in the time in which the closed form
/// predicts a growth by a factor of 1,000. In a stable craft its amplitude stays within the beat of
/// the two nutations.
#[test]
fn spinning_craft_are_stable_exactly_where_rumyantsevs_criterion_holds() {
    let mut random = Random::new(2);
    let (mut stable, mut unstable) = (0, 0);
    while stable + unstable < 30 {
        let body = random_body(&mut random);
        let coefficients = closed_form(body, C::from(0.0));
        let [a, b, c] = coefficients.map(|x| x.re);
        let discriminant = b * b - 4.0 * a * c;
        // At the boundary of stability a nutation grows slower than exponentially.
        if discriminant.abs() < 1e-3 * b * b {
            continue;
        }
        let rate = 2.0;
        let growth = f64::max(-discriminant, 0.0).sqrt() / (2.0 * a) * rate;
        let end = if growth > 0.0 { 1000.0_f64.ln() / growth } else { 200.0 };
        let mut p = spheroid(body, rate, [0.0; 2]);
        p.init.omega[0] = 1e-7;
        let mut craft = Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-12).unwrap();
        let mut largest = 0.0_f64;
        for _ in 0..200 {
            craft.step(&Inputs::default(), end / 200.0).unwrap();
            let [x, y, _] = craft.outputs(&Inputs::default()).omega;
            largest = largest.max(x.hypot(y) / 1e-7);
        }
        if discriminant < 0.0 {
            unstable += 1;
            assert!(largest > 30.0, "{body:?}: {largest}");
        } else {
            stable += 1;
            let parts = b.abs().max(1.0) / discriminant.sqrt();
            assert!(largest < 30.0_f64.min(2.0 + 20.0 * parts), "{body:?}: {largest}");
        }
    }
    assert!(stable > 5 && unstable > 5, "{stable} {unstable}");
}

/// Each row describes an upright cylinder with R = 1 m under g = 1 m/s2. First come h/R, Omega^2
/// R/g, and the gyroscopic coefficient C and the stiffness K of the first mode. C and K are fitted
/// to the frequencies of this mode, seen from the tank, in the equations of a rotating liquid. Then
/// follow both frequencies, against the spin and with it, rad/s. The last numbers are the errors of
/// both frequencies, per cent, with the formulas C_0 and K = omega_0^2 instead of the fit.
const CYLINDERS: [([f64; 4], [f64; 2], [f64; 2]); 6] = [
    ([0.25, 0.1, 0.75653, 0.82912], [1.1806962, -0.702227], [0.8, 3.8]),
    ([0.5, 0.1, 0.65208, 1.35843], [1.3898245, -0.9774112], [0.2, 1.4]),
    ([0.5, 0.3, 0.62021, 1.41418], [1.5764628, -0.8970576], [0.2, 5.7]),
    ([1.0, 0.1, 0.48862, 1.76456], [1.4918356, -1.182808], [0.2, 0.62]),
    ([1.0, 0.3, 0.47550, 1.79833], [1.6265190, -1.1056295], [0.3, 2.4]),
    ([2.0, 0.3, 0.41797, 1.90865], [1.6293091, -1.1714488], [1.4, 2.4]),
];

/// Each row contains h/R, Omega^2 R/g, the factor lambda, and the real and the imaginary part of a
/// force, kg: the force of the liquid on the tank divided by the tank's lateral acceleration. The
/// acceleration is proportional to exp(-i l t) with l = (lambda - i/20) Omega. The forces were
/// computed from the equations of a rotating liquid, for the cylinders in [`CYLINDERS`].
const FORCES: [[f64; 5]; 48] = [
    [1.0, 0.1, -3.0, 6.90214, 0.32358],
    [1.0, 0.1, -2.5, 4.98723, 0.11426],
    [1.0, 0.1, -1.5, 3.74869, 0.03300],
    [1.0, 0.1, -0.6, 3.34961, 0.01436],
    [1.0, 0.1, -0.3, 3.27458, 0.01082],
    [1.0, 0.1, -0.1, 3.23545, 0.00877],
    [1.0, 0.1, 0.1, 3.20355, 0.00695],
    [1.0, 0.1, 0.3, 3.17887, 0.00536],
    [1.0, 0.1, 0.6, 3.15369, 0.00304],
    [1.0, 0.1, 1.5, 3.16371, -0.00764],
    [1.0, 0.1, 2.5, 3.35392, -0.01751],
    [1.0, 0.1, 3.0, 3.59557, -0.03272],
    [1.0, 0.3, -3.0, -0.42488, 0.12297],
    [1.0, 0.3, -2.5, -2.90218, 0.51028],
    [1.0, 0.3, -1.5, 6.65054, 0.44482],
    [1.0, 0.3, -0.6, 3.81260, 0.05618],
    [1.0, 0.3, -0.3, 3.54327, 0.03595],
    [1.0, 0.3, -0.1, 3.41878, 0.02646],
    [1.0, 0.3, 0.1, 3.31657, 0.01753],
    [1.0, 0.3, 0.3, 3.24713, 0.01510],
    [1.0, 0.3, 0.6, 3.17629, 0.00856],
    [1.0, 0.3, 1.5, 3.21835, -0.05500],
    [1.0, 0.3, 2.5, 4.38247, -0.20667],
    [1.0, 0.3, 3.0, -6.00988, -13.76161],
    [0.5, 0.1, -3.0, 20.15652, 10.67156],
    [0.5, 0.1, -2.5, 4.63548, 0.32493],
    [0.5, 0.1, -1.5, 2.25611, 0.04337],
    [0.5, 0.1, -0.6, 1.78265, 0.01537],
    [0.5, 0.1, -0.3, 1.70371, 0.01116],
    [0.5, 0.1, -0.1, 1.66383, 0.00878],
    [0.5, 0.1, 0.1, 1.63101, 0.00662],
    [0.5, 0.1, 0.3, 1.60684, 0.00525],
    [0.5, 0.1, 0.6, 1.58236, 0.00294],
    [0.5, 0.1, 1.5, 1.59002, -0.00417],
    [0.5, 0.1, 2.5, 1.78493, -0.01812],
    [0.5, 0.1, 3.0, 2.04550, -0.03684],
    [0.5, 0.3, -3.0, -0.39890, 0.04060],
    [0.5, 0.3, -2.5, -1.03693, 0.10134],
    [0.5, 0.3, -1.5, 10.64858, 3.78803],
    [0.5, 0.3, -0.6, 2.27999, 0.06794],
    [0.5, 0.3, -0.3, 1.97223, 0.03854],
    [0.5, 0.3, -0.1, 1.84365, 0.02583],
    [0.5, 0.3, 0.1, 1.72826, -0.00236],
    [0.5, 0.3, 0.3, 1.66431, 0.01327],
    [0.5, 0.3, 0.6, 1.60102, 0.00763],
    [0.5, 0.3, 1.5, 1.62783, -0.01398],
    [0.5, 0.3, 2.5, 2.88900, -0.24909],
    [0.5, 0.3, 3.0, -4.19429, -2.11511],
];

/// Returns a cylindrical tank of radius R = 1 m whose liquid spins with the tank at the rate Omega,
/// and its inputs. `fill` is the depth h/R, and `beta` is Omega^2 R/g. `c` is the gyroscopic
/// coefficient C of the first mode. `stiffness` is (K - omega_0^2)/Omega^2, the increase of the
/// mode's stiffness K by the spin, where omega_0 is the natural frequency without spin.
fn cylinder(fill: f64, beta: f64, c: f64, stiffness: f64) -> (TankParameters, TankInputs) {
    let mut p = TankParameters::default();
    p.tank = Tank {
        position: [0.0; 3],
        diameter: 2.0,
        depth: fill,
        density: 1.0,
        modes: 1,
        zeta: [0.0; MODES],
        spin_inertia: 0.5 * std::f64::consts::PI * fill * (1.0 + beta / (12.0 * fill)),
        gyroscopic: [c; MODES],
        gyroscopic_stiffness: [stiffness; MODES],
        ..p.tank
    };
    let a = Ramp::held([0.0, 0.0, 1.0]);
    (p, TankInputs { a, omega: [0.0, 0.0, beta.sqrt()], ..TankInputs::default() })
}

/// Returns the coefficients k_0 to k_5 of the lateral motion z = p_x + i p_y of a slosh mass under the acceleration a, and of its
/// force on the tank: z'' = k_0 z + k_1 z' + k_2 a, and force = k_3 z + k_4 z' + k_5 a.
fn lateral(p: &TankParameters, u: &TankInputs) -> [C; 6] {
    let mut tank = SloshTank::new(p, u, 0.0, 1e-9).unwrap();
    let mut at = [C::from(0.0); 6];
    for k in 0..3 {
        let (mut dx, mut du) = ([0.0; TANK_STATES], [0.0; TANK_INPUTS]);
        *if k < 2 { &mut dx[3 * k] } else { &mut du[0] } = 1.0;
        let rate = tank.directional_derivative(u, &dx, &du);
        let force = tank.output_derivatives(u, &dx, &du).tank.force;
        (at[k], at[3 + k]) = (C::new(rate[3], rate[4]), C::new(force[0], force[1]));
    }
    at
}

/// Returns the frequencies l of both waves, against the spin and with it. In a wave the bob's
/// displacement z = p_x + i p_y is proportional to exp(-i l t).
fn waves(p: &TankParameters, u: &TankInputs) -> [f64; 2] {
    let [z, z_d, ..] = lateral(p, u);
    let mut waves = roots(C::from(1.0), -z_d, -z).map(|sigma| {
        let l = sigma * C::i();
        assert!(l.im.abs() < 1e-12, "{l}");
        l.re
    });
    waves.sort_by(|a, b| b.total_cmp(a));
    waves
}

#[test]
fn waves_in_spinning_cylinders_have_the_frequencies_of_the_rotating_liquid() {
    for ([fill, beta, c, k], exact, errors) in CYLINDERS {
        let squared = 1.8411837813 * f64::tanh(1.8411837813 * fill);
        let limit = SpinLimit::new(1.0 / squared, 1.0);
        let c_0 = limit.gyroscopic_coefficient();
        let (p, u) = cylinder(fill, beta, c_0, 0.0);
        let root = (c_0 * c_0 * beta + squared).sqrt();
        let found = waves(&p, &u);
        for (i, formula) in
            [c_0 * beta.sqrt() + root, c_0 * beta.sqrt() - root].into_iter().enumerate()
        {
            assert!((found[i] / formula - 1.0).abs() < 1e-9, "{fill} {beta}: {found:?} {formula}");
            let error = 100.0 * (found[i] / exact[i] - 1.0).abs();
            assert!(error < errors[i] + 0.05, "{fill} {beta}: {found:?} {exact:?}");
        }
        let (p, u) = cylinder(fill, beta, c, (k - squared) / beta);
        let fitted = waves(&p, &u);
        for i in 0..2 {
            // C and K in the table have five digits.
            assert!(
                (fitted[i] / exact[i] - 1.0).abs() < 3e-5,
                "{fill} {beta}: {fitted:?} {exact:?}"
            );
        }
        // A pendulum (C = 1) has the frequencies Omega +- omega_0, because its motion in space does not depend on the spin.
        let (p, u) = cylinder(fill, beta, 1.0, 0.0);
        for (found, sign) in waves(&p, &u).into_iter().zip([1.0, -1.0]) {
            assert!((found - beta.sqrt() - sign * squared.sqrt()).abs() < 1e-9, "{found}");
        }
    }
}

/// Lateral forces of a spinning cylinder that is shaken, computed with the pendulum model, differ from the theory of the
/// rotating liquid by at most 1 % at Omega^2 R/g = 0.1. At 0.3 they differ by at most 3 % up to 1.5 Omega, and by 14 % at
/// higher frequencies. The differences are relative to the force, or to the mass of the liquid if this is larger.
#[test]
fn lateral_forces_of_spinning_cylinders_are_those_of_the_rotating_liquid() {
    for [fill, beta, rate, re, im] in FORCES {
        let fitted = CYLINDERS.iter().find(|(x, ..)| (x[0], x[1]) == (fill, beta));
        let ([.., c, k], ..) = fitted.unwrap();
        let squared = 1.8411837813 * f64::tanh(1.8411837813 * fill);
        let (p, u) = cylinder(fill, beta, *c, (k - squared) / beta);
        let [z, z_d, a, by_z, by_z_d, by_a] = lateral(&p, &u);
        let sigma = C::new(rate, -0.05) * beta.sqrt() * -C::i();
        let response = a / (sigma * sigma - z_d * sigma - z);
        let force = -((by_z + by_z_d * sigma) * response + by_a);
        let exact = C::new(re, im);
        let allowed = match (beta < 0.2, rate.abs() < 2.0) {
            (true, _) => 0.01,
            (_, true) => 0.03,
            _ => 0.14,
        };
        let error = (force - exact).norm() / exact.norm().max(std::f64::consts::PI * fill);
        assert!(error < allowed, "{fill} {beta} {rate}: {force} {exact}");
    }
}

/// At h/R = 1 the gyroscopic coefficient C_0 is 0.496. The tank is therefore out of range above 2
/// Omega/omega_0 = 0.818, which is a spin of 0.541 rad/s here. Only the rate of the liquid's spin
/// matters, not the rate of the tank.
#[test]
fn the_spin_of_the_liquid_and_not_of_its_tank_limits_the_range() {
    let squared = 1.8411837813 * f64::tanh(1.8411837813);
    for (liquid, tank, expected) in [
        (0.5, 0.5, LimitedBy::None),
        (0.5, 9.0, LimitedBy::None),
        (-0.54, 0.0, LimitedBy::None),
        (-0.56, 0.0, LimitedBy::Spin),
        (0.56, 0.5, LimitedBy::Spin),
    ] {
        let (mut p, mut u) = cylinder(1.0, 0.1, 0.5, 0.0);
        u.omega = [0.0, 0.0, tank];
        p.tank.slip_0 = [0.0, 0.0, liquid - tank];
        let out = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap().outputs(&u).tank;
        assert_eq!(out.ranges.limited_by, expected, "{liquid} {tank}");
        assert!((out.spin_ratio / (2.0 * f64::abs(liquid) / squared.sqrt()) - 1.0).abs() < 1e-9);
        assert!((out.spin_number / (liquid * liquid) - 1.0).abs() < 1e-9, "{out:?}");
        // Liquid whose spin is not modelled is assumed to rotate with the tank.
        p.tank.spin_inertia = 0.0;
        let out = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap().outputs(&u).tank;
        assert!((out.spin_number - tank * tank).abs() < 1e-9 * (1.0 + tank * tank), "{out:?}");
    }
}

/// If spin rate and acceleration change by d Omega and da, Omega/omega_0 changes by the relative amount d Omega/Omega - da/(2 a),
/// and Omega^2 l/a by 2 d Omega/Omega - da/a.
#[test]
fn directional_derivatives_of_spin_ratio_and_spin_number_equal_the_closed_form() {
    let (mut p, u) = cylinder(1.0, 0.1, 0.5, 0.0);
    for has_spin in [true, false] {
        let (mut dx, mut du) = ([0.0; TANK_STATES], [0.0; TANK_INPUTS]);
        (du[2], dx[TANK_STATES - 1], du[5]) = (0.3, 0.2, 0.7);
        let turned = if has_spin { 0.2 / p.tank.spin_inertia } else { 0.7 } / u.omega[2];
        let mut tank = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
        let (now, slope) = (tank.outputs(&u).tank, tank.output_derivatives(&u, &dx, &du).tank);
        assert!((slope.spin_ratio / now.spin_ratio - turned + 0.15).abs() < 1e-12, "{slope:?}");
        let share = slope.spin_number / now.spin_number;
        assert!((share - 2.0 * turned + 0.3).abs() < 1e-12, "{slope:?}");
        p.tank.spin_inertia = 0.0;
    }
}

/// The liquid is at rest at first, in a tank that rotates at Omega about its axis. It spins up as Omega (1 - exp(-t decay)),
/// and exerts the torque I Omega decay exp(-t decay) on the tank.
#[test]
fn liquid_spins_up_with_its_tank_at_the_rate_of_its_decay() {
    let mut p = TankParameters::default();
    (p.tank.modes, p.tank.i_z) = (0, 0.0);
    (p.tank.spin_inertia, p.tank.spin_decay, p.tank.slip_0) = (3.0, [0.05, 0.0], [0.0, 0.0, -2.0]);
    let u = TankInputs { omega: [0.0, 0.0, 2.0], ..TankInputs::default() };
    let mut tank = SloshTank::new(&p, &u, 0.0, 1e-12).unwrap();
    for k in 0..40 {
        let left = f64::exp(-0.05 * k as f64);
        let (x, out) = (tank.continuous_states(), tank.outputs(&u));
        assert!((x[x.len() - 1] - 6.0 * (1.0 - left)).abs() < 1e-10, "{k}");
        assert!((out.tank.torque[2] + 0.3 * left).abs() < 1e-10, "{k} {:?}", out.tank.torque);
        assert!((out.dissipated - 6.0 * (1.0 - left * left)).abs() < 1e-9, "{k}");
        tank.step(&u, 1.0).unwrap();
    }
}

fn bits(change: impl Fn(&mut Parameters)) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |x: f64| hash = (hash ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3);
    for seed in 0..12 {
        let mut random = Random::new(seed);
        let (mut p, inputs) = match seed {
            0..10 => (random.parameters(), random.inputs()),
            _ => draining_craft(seed, 2),
        };
        match seed {
            4 | 5 => random.make_all_planar(&mut p),
            6 | 7 => random.bend_all(&mut p),
            8 => p.tank.iter_mut().for_each(|tank| random.follow(tank)),
            _ => (),
        }
        change(&mut p);
        let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-8).unwrap();
        for _ in 0..20 {
            craft.step(&inputs, 0.05).unwrap();
            let out = craft.outputs(&inputs);
            craft.borrow_states()[..index::BALLS + 6 * TANKS].iter().for_each(|x| take(*x));
            out.angular_momentum.into_iter().for_each(&mut take);
            out.omega_dot.into_iter().for_each(&mut take);
            take(out.energy);
        }
    }
    hash
}

#[test]
fn without_spin_inertia_other_spin_parameters_change_no_bit_of_the_motion() {
    let before = bits(|_| ());
    let neutral = |p: &mut Parameters| {
        for tank in &mut p.tank {
            (tank.spin_inertia_across, tank.spin_coupling) = (3.0, 0.5);
            (tank.spin_decay, tank.slip_0) = ([0.1, 0.2], [0.3, 0.4, 0.5]);
            (tank.gyroscopic, tank.gyroscopic_stiffness) = ([0.5; MODES], [0.3; MODES]);
        }
    };
    assert_eq!(bits(neutral), before);
}

#[test]
fn the_spin_of_liquid_is_refused_with_a_too_small_inertia_and_with_options_that_move_the_liquid() {
    let said = |change: &dyn Fn(&mut Tank)| {
        let mut p = Parameters::default();
        p.tank[0].spin_inertia = 3.0;
        change(&mut p.tank[0]);
        Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-9).err().unwrap_or_default().join("; ")
    };
    assert_eq!(said(&|_| ()), "");
    type Case<'a> = (&'a dyn Fn(&mut Tank), &'a str);
    let cases: [Case; 7] = [
        (&|tank| tank.spin_inertia = 1e-12, "tank[1].spin_inertia = 1e-12"),
        (&|tank| tank.spin_inertia_across = -1.0, "tank[1].spin_inertia_across = -1.0"),
        (&|tank| tank.spin_coupling = 1.1, "tank[1].spin_coupling = 1.1"),
        (&|tank| tank.spin_decay[1] = -0.1, "tank[1].spin_decay[2] = -0.1"),
        (&|tank| tank.slip_0[2] = f64::NAN, "tank[1].slip_0[3] = NaN"),
        (
            &|tank| tank.fill.points = 12,
            "tank[1].spin_inertia cannot be combined with tank[1].fill.points",
        ),
        (
            &|tank| tank.ball.travel = 0.6,
            "tank[1].spin_inertia cannot be combined with tank[1].ball.travel",
        ),
    ];
    for (change, why) in cases {
        let said = said(change);
        let has_remedy = said.contains("allowed: ") || said.contains(": set ");
        assert!(said.contains(why) && has_remedy, "{why}: {said}");
    }
    let mut p = Parameters { tanks: 2, ..Parameters::default() };
    (p.tank[0].ball.travel, p.tank[1].spin_inertia) = (0.6, 3.0);
    let said = Spacecraft::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap_err().join("; ");
    let names = "tank[1].ball.travel cannot be combined with tank[2].spin_inertia, because";
    assert!(said.contains(names), "{said}");
    let mut p = Parameters::default();
    assert!(p.overridden("tank[].spin_decay", &[0, 1]).unwrap().contains("spin_inertia = 0"));
    p.tank[0].spin_inertia = 3.0;
    assert_eq!(p.overridden("tank[].spin_decay", &[0, 1]), None);
}

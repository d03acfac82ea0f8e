//! Damping as it is measured, by the decay of free oscillations: in a tank that is held, and in a tank of a craft that is
//! too heavy to move.

use std::f64::consts::TAU;

use craft::{
    Craft, DampingLaw, Inertia, Inputs, MODES, Parameters, Ramp, Ranges, Regime, SloshTank,
    Spacecraft, Tank, TankInputs, TankParameters, index,
};
use nalgebra::Vector3;

type V = Vector3<f64>;

const G: f64 = 9.81;

/// Returns a tank with one pendulum on its axis, released at `angle` rad in the tank's x z plane.
fn tank(angle: f64) -> Tank {
    let mut tank = Tank { position: [0.0; 3], modes: 1, g_ref: G, ..Tank::default() };
    tank.p_0[0] = [angle.sin(), 0.0, -angle.cos()];
    tank
}

/// Returns p_x, the bob's displacement over the pendulum length, and its rate after each of `count`
/// periods of `period` seconds, under the acceleration `g` along the tank. The first list is for
/// the single tank, the second for the tank in a craft of 1e9 kg.
fn moments(tank: &Tank, g: f64, period: f64, count: usize) -> [Vec<[f64; 2]>; 2] {
    let p = TankParameters { tank: *tank, ..TankParameters::default() };
    let motion = TankInputs { a: Ramp::held([0.0, 0.0, g]), ..TankInputs::default() };
    let mut alone = SloshTank::new(&p, &motion, 0.0, 1e-11).unwrap();
    let (mass, j) = (1e9, Inertia { xx: 1e9, yy: 1e9, zz: 1e9, xy: 0.0, xz: 0.0, yz: 0.0 });
    let mut p = Parameters { craft: Craft { mass, r: [0.0; 3], j }, ..Parameters::default() };
    p.tank[0] = *tank;
    let total = mass + tank.m_0 + tank.mass[0];
    let inputs = Inputs { force: Ramp::held([0.0, 0.0, total * g]), ..Inputs::default() };
    let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-11).unwrap();
    let (mut of_alone, mut of_craft) = (Vec::new(), Vec::new());
    for _ in 0..=count {
        let (x, y) = (alone.continuous_states(), craft.continuous_states());
        let at = index::bob(0, 0);
        of_alone.push([x[0], x[3]]);
        of_craft.push([y[at], y[at + 3]]);
        alone.step(&motion, period).unwrap();
        craft.step(&inputs, period).unwrap();
    }
    [of_alone, of_craft]
}

/// The test goes down from 9.81 m/s2 to 1e-6 m/s2, without and with centring stiffness. Depending on the damping law, the damping
/// ratio zeta is proportional to omega^(-1/2), constant, or proportional to omega^-1.
#[test]
fn damping_of_decays_follows_the_frequency_down_to_a_millionth_of_a_metre_per_second_squared() {
    for law in DampingLaw::ALL {
        for k in [0.0, 0.02] {
            for g in [G, G / 10.0, G / 100.0, G / 1000.0, 1e-4, 1e-6] {
                let mut tank = tank(1e-3);
                (tank.damping_law, tank.k[0], tank.zeta[0]) = (law, k, 1e-4);
                // The default g_floor, 1e-4 of 9.81 m/s2, is above the smallest accelerations of this test.
                tank.g_floor = if g < G / 1000.0 { 1e-9 } else { 0.0 };
                let omega = |g: f64| (g / tank.length[0] + k / tank.mass[0]).sqrt();
                let ratio = omega(G) / omega(g);
                let expected = tank.zeta[0]
                    * match law {
                        DampingLaw::Laminar => ratio.sqrt(),
                        DampingLaw::ConstantRatio => 1.0,
                        DampingLaw::Constant => ratio,
                    };
                let w = omega(g);
                for x in moments(&tank, g, TAU / w, 3) {
                    let a2 = |[angle, rate]: [f64; 2]| angle * angle + (rate / w).powi(2);
                    let zeta = -(a2(x[3]) / a2(x[0])).ln() / (2.0 * TAU * 3.0);
                    // At g_ref/1000 the smoothing by a_f adds 0.25 % to a_+ and thereby 0.13 % to c. The formula of the decay
                    // neglects zeta^2 and the square of the angle, 2.5e-7.
                    let allowed = 1.5e-3 + expected * expected;
                    assert!(
                        (zeta / expected - 1.0).abs() < allowed,
                        "{law:?} {k} {g}: {zeta} {expected}"
                    );
                }
            }
        }
    }
}

/// Ratio of the steepness k a of the first mode in an upright cylinder to the slosh angle, 1/rad,
/// with the wave number k = xi/R and the elevation 2 R/(xi^2 - 1) per rad.
const STEEPNESS: f64 = 2.0 * 1.841183781340659 / (1.841183781340659 * 1.841183781340659 - 1.0);

fn rounded(x: f64) -> f64 {
    (x + x.hypot(0.02)) / 2.0
}

/// The amplitude A of a free oscillation decays by A'/A = -omega (zeta + zeta_A A + zeta_b max(0, k a - s_b)), up to 0.3
/// rad. The tolerance of 1 % includes the nonlinearity of the pendulum.
#[test]
fn damping_of_free_oscillations_is_the_sum_of_zeta_amplitude_damping_and_breaking() {
    for (zeta_a, zeta_b, begins) in
        [(0.012, 0.0, 0.0), (0.05, 0.0, 0.0), (0.0, 0.04, 0.3), (0.02, 0.08, 0.0)]
    {
        let mut tank = tank(0.31);
        (tank.zeta[0], tank.zeta_amplitude[0]) = (0.003, zeta_a);
        (tank.zeta_breaking[0], tank.breaking_steepness[0]) = (zeta_b, begins);
        let h = 2e-3;
        for x in moments(&tank, G, h, 10_000) {
            let mut peaks = Vec::new();
            for k in 1..x.len() - 1 {
                let [a, b, c] = [x[k - 1][0], x[k][0], x[k + 1][0]];
                if b > a && b >= c {
                    let (slope, bend) = ((c - a) / 2.0, c - 2.0 * b + a);
                    peaks.push((b - slope * slope / (2.0 * bend)).asin());
                }
            }
            assert!(peaks.len() > 15);
            for pair in peaks.windows(2) {
                let mean = (pair[0] * pair[1]).sqrt();
                let breaking = rounded(STEEPNESS * mean - begins) - rounded(-begins);
                let expected = 0.003 + zeta_a * mean + zeta_b * breaking;
                let off = (pair[0] / pair[1]).ln() / TAU / expected - 1.0;
                assert!(off.abs() < 1e-2, "{zeta_a} {zeta_b} at {mean}: {off:e}");
            }
        }
    }
}

/// Returns the ranges of validity of the tank in a craft under this `thrust`. Asserts that the tank
/// alone, if it is moved like the craft, has the same ranges.
fn ranges_of(tank: Tank, thrust: f64) -> Ranges {
    let mut p = Parameters::default();
    p.tank[0] = tank;
    let inputs = Inputs { force: Ramp::held([0.0, 0.0, thrust]), ..Inputs::default() };
    let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
    let out = craft.outputs(&inputs);
    let motion = TankInputs {
        a: Ramp::held(out.specific_force),
        omega_dot: Ramp::held(out.omega_dot),
        ..TankInputs::default()
    };
    let p = TankParameters { tank, ..TankParameters::default() };
    let mut alone = SloshTank::new(&p, &motion, 0.0, 1e-9).unwrap();
    let seen = [alone.ranges(&motion), alone.ranges_held(), alone.outputs(&motion).tank.ranges];
    assert_eq!(seen, [out.tank[0].ranges; 3]);
    seen[0]
}

fn ranges(k: f64, thrust: f64, angle: f64) -> Ranges {
    ranges_of(Tank { k: [k; MODES], ..tank(angle) }, thrust)
}

/// The wave height divided by the radius is 0.837 times the slosh angle: 0.15 at 0.179 rad, and 0.25 at 0.299 rad.
#[test]
fn regimes_end_at_waves_of_0_15_and_0_25_radii_and_reversed_thrust_is_out_of_range() {
    let seen = [0.0, 0.178, 0.181, 0.297, 0.301, 0.8, 3.0].map(|angle| ranges(0.0, 2000.0, angle));
    use Regime::{Linear, Nonlinear, Transitional};
    let expected = [
        (Linear, true),
        (Linear, true),
        (Transitional, true),
        (Transitional, true),
        (Nonlinear, true),
        (Nonlinear, false),
        (Nonlinear, false),
    ];
    assert_eq!(seen.map(|ranges| (ranges.regime, ranges.is_in_range())), expected);
    // Without thrust the liquid stays at the bottom. Against reversed thrust it stays if the centring stiffness holds it: k
    // l/m > 1.3 m/s2.
    assert!(ranges(0.0, 0.0, 0.1).is_in_range());
    assert!(!ranges(0.0, -2000.0, 0.1).is_in_range());
    assert!(!ranges(500.0, -2000.0, 0.1).is_in_range());
    assert!(ranges(800.0, -2000.0, 0.1).is_in_range());
}

/// The output `regime` depends on the sum of the waves of all modes, relative to the tank's radius
/// R. 0.1 rad of the first mode are a wave of 0.084 R, in the linear range. If the second mode has
/// half this wave height per angle, 0.1 rad of both modes are 0.126 R, and 0.15 rad of both are
/// 0.188 R. If a tank has no wave height per angle, the value of a cylinder is used for the first
/// mode.
#[test]
fn the_regime_follows_from_the_waves_of_all_modes_together() {
    let with = |wave: [f64; MODES], angle: f64| {
        let mut tank = Tank { modes: 2, wave, ..tank(angle) };
        tank.p_0[1] = tank.p_0[0];
        ranges_of(tank, 2000.0).regime
    };
    let two = [0.4, 0.2, 0.0];
    assert_eq!([0.1, 0.15].map(|angle| with(two, angle)), [Regime::Linear, Regime::Transitional]);
    let one = [0.4, 0.0, 0.0];
    assert_eq!([0.1, 0.15].map(|angle| with(one, angle)), [Regime::Linear; 2]);
    let seen = [0.02, 0.178, 0.181, 0.297, 0.301].map(|angle| with([0.0; MODES], angle));
    use Regime::{Linear, Nonlinear, Transitional};
    assert_eq!(seen, [Linear, Linear, Transitional, Transitional, Nonlinear]);
}

/// A pendulum of each tank in turn is within 45 degrees of its tank's axis, or beyond. The check at the end of a step must agree
/// with the ranges in the outputs.
#[test]
fn a_step_ends_out_of_range_if_any_pendulum_passes_45_degrees() {
    let mut found = [0; 2];
    for (tank, mode) in [(0, 0), (0, 1), (1, 0), (1, 1), (3, 0), (3, 1)] {
        for angle in [0.6, 1.0f64] {
            let mut p = Parameters { tanks: 4, ..Parameters::default() };
            for tank in &mut p.tank {
                tank.modes = 2;
            }
            p.tank[tank].p_0[mode] = [angle.sin(), 0.0, -angle.cos()];
            let inputs = Inputs { force: Ramp::held([0.0, 0.0, 2000.0]), ..Inputs::default() };
            let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
            let [held, shown] = [craft.ranges_held(), craft.ranges(&inputs)];
            assert_eq!(held, shown);
            assert_eq!(held[tank].is_in_range(), angle < 0.7);
            assert_eq!(craft.leaves_range(&held), angle > 0.7);
            craft.step(&inputs, 1e-3).unwrap();
            let in_range = craft.outputs(&inputs).tank.map(|tank| tank.ranges.is_in_range());
            let expected: [bool; 4] = std::array::from_fn(|i| i != tank || angle < 0.7);
            assert_eq!(in_range, expected);
            assert_eq!(craft.is_physical(), angle < 0.7, "{tank} {mode} {angle}");
            found[usize::from(craft.is_physical())] += 1;
            // Liquid that may detach is never out of range.
            p.tank[tank].ball.travel = 0.6;
            let craft = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
            assert!(!craft.leaves_range(&craft.ranges_held()) && craft.is_physical());
        }
    }
    assert_eq!(found, [6, 6]);
}

/// The thrust is along the axis of the first tank and opposite to the axis of the second tank.
/// There the liquid stays at the bottom only if the centring stiffness k gives it an acceleration k
/// l/m above 1.3 m/s2.
#[test]
fn the_range_of_each_tank_depends_on_the_acceleration_along_its_own_axis() {
    for (k, holds) in [(500.0, false), (800.0, true)] {
        let mut p = Parameters { tanks: 2, ..Parameters::default() };
        p.tank = [0.0, 0.0, 0.0, 0.0].map(|angle| Tank { k: [k; MODES], ..tank(angle) });
        p.tank[0].k = [0.0; MODES];
        p.tank[1].q = [0.0, 1.0, 0.0, 0.0];
        let inputs = Inputs { force: Ramp::held([0.0, 0.0, 2000.0]), ..Inputs::default() };
        let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
        craft.step(&inputs, 1e-3).unwrap();
        let in_range = craft.outputs(&inputs).tank.map(|tank| tank.ranges.is_in_range());
        assert_eq!((in_range[0], in_range[1], craft.is_physical()), (true, holds, holds), "{k}");
    }
}

/// The drag depends on the acceleration at the hinge, whether the acceleration a, the angular acceleration w' or the angular
/// velocity w causes it. The test compares the contribution of zeta to p'' at 2 m/s2 along the tank.
#[test]
fn drag_follows_the_acceleration_at_the_hinge_from_every_cause() {
    let position = [0.7, -0.4, 0.2];
    let tank = Tank { position, p_dot_0: [[0.5, 0.2, 0.0]; MODES], ..tank(0.1) };
    let hinge = V::new(0.7, -0.4, 0.2 + tank.hinge[0]);
    let drag = |w: V, w_d: V| {
        let made = w_d.cross(&hinge) + w.cross(&w.cross(&hinge));
        assert!(made[2].abs() > 0.5 || made == V::zeros(), "too small a part of 2 m/s2: {made:?}");
        let u = TankInputs {
            a: Ramp::held((V::z() * 2.0 - made).into()),
            omega: w.into(),
            omega_dot: Ramp::held(w_d.into()),
            ..TankInputs::default()
        };
        let [with, without] = [0.05, 0.0].map(|zeta| {
            let mut tank = tank;
            (tank.zeta[0], tank.zeta_amplitude[0]) = (zeta, 0.0);
            let p = TankParameters { tank, ..TankParameters::default() };
            SloshTank::new(&p, &u, 0.0, 1e-9).unwrap().derivatives(&u)
        });
        V::from_row_slice(&with[3..6]) - V::from_row_slice(&without[3..6])
    };
    let still = drag(V::zeros(), V::zeros());
    // The expected value is c/m p'_x under the laminar law. p' is tangential to the sphere at 0.1 rad from the axis.
    let w_ref = (G / tank.length[0]).sqrt();
    let expected = -2.0 * 0.05 * w_ref * (2.0 / G).powf(0.25) * 0.5;
    assert!((still.x / expected - 1.0).abs() < 0.02, "{still} {expected}");
    for (w, w_d) in [(V::zeros(), V::new(1.5, 2.0, 0.0)), (V::new(1.0, -0.5, 1.2), V::zeros())] {
        // The tolerance allows for rounding errors of differences of numbers of about 10 1/s2.
        assert!((drag(w, w_d) - still).norm() < 1e-13, "{} {still}", drag(w, w_d));
    }
}

/// A tank with a fill table can drain, and its equations are written separately from those of a tank that cannot drain. If
/// nothing flows out, both must have the same drag; here the fill table has the values of the default tank at one of its points.
/// This is tested on a pivot and in free flight, under every damping law, with thrust in both directions.
#[test]
fn a_fill_table_without_outflow_does_not_change_the_drag() {
    for (seed, law) in DampingLaw::ALL.into_iter().cycle().take(12).enumerate() {
        let mut random = super::random::Random::new(seed as u64);
        let mut p = Parameters { tanks: 2, ..random.parameters() };
        if seed % 4 == 3 {
            (p.mount, p.init.velocity) = (craft::Mount::Pivot, [0.0; 3]);
        }
        for tank in &mut p.tank[..2] {
            *tank = Tank { position: tank.position, q: tank.q, p_0: tank.p_0, ..Tank::default() };
            tank.p_dot_0 = [[0.3, -0.2, 0.0]; MODES];
            (tank.damping_law, tank.zeta_amplitude) = (law, [0.03; MODES]);
        }
        let inputs = random.inputs();
        let mut plain = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
        p.tank[..2].iter_mut().for_each(|tank| tank.fill.points = craft::POINTS);
        let mut draining = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
        let (a, b) = (plain.derivatives(&inputs), draining.derivatives(&inputs));
        for i in 0..index::LIQUID {
            assert!(
                (a[i] - b[i]).abs() < 1e-11 * (1.0 + a[i].abs()),
                "{seed} [{i}] {} {}",
                a[i],
                b[i]
            );
        }
    }
}

/// The damping ratio follows from the dissipated power 2 zeta m w l^2 rate^2. It must be zeta_A A +
/// zeta_b f(k a) with A^2 = angle^2 + (rate/w)^2 + A_0^2, a function of the slosh angle. With the
/// sine of the angle it would be 8 % smaller at 0.7 rad. Draining tanks and planar modes are tested
/// as well, because they have their own equations.
#[test]
fn amplitude_damping_grows_with_the_slosh_angle_not_with_its_sine() {
    let (zeta_a, zeta_b, begins) = (0.05, 0.04, 0.6);
    for angle in [0.05_f64, 0.4, 0.7] {
        for rate in [1e-3, 3.0] {
            let mut tank = tank(angle);
            tank.p_dot_0[0] = [rate * angle.cos(), 0.0, rate * angle.sin()];
            (tank.zeta[0], tank.zeta_amplitude[0]) = (0.0, zeta_a);
            (tank.zeta_breaking[0], tank.breaking_steepness[0]) = (zeta_b, begins);
            let planar = Tank { direction: [[1.0, 0.0]; MODES], ..tank };
            let mut drains = tank;
            drains.fill.points = craft::POINTS;
            for (tank, what) in [(tank, "plain"), (planar, "planar"), (drains, "drains")] {
                let p = TankParameters { tank, ..TankParameters::default() };
                let u = TankInputs { a: Ramp::held([0.0, 0.0, G]), ..TankInputs::default() };
                let mut alone = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
                let power = alone.derivatives(&u)[6 * MODES];
                let (m, l) = (tank.mass[0], tank.length[0]);
                let w = (G / l).sqrt();
                let amplitude = (angle.powi(2) + (rate / w).powi(2) + 1e-8).sqrt();
                let breaking = rounded(STEEPNESS * amplitude - begins) - rounded(-begins);
                let zeta = zeta_a * amplitude + zeta_b * breaking;
                let want = 2.0 * zeta * m * w * (l * rate).powi(2);
                // The series of the angle has an error of 3e-7 at 0.785 rad, and the table has six digits of m and l.
                assert!((power / want - 1.0).abs() < 3e-6, "{what} {angle} {rate}: {power} {want}");
            }
        }
    }
}

/// Waves below the steepness s_b lose almost no energy by breaking. The dissipated power is never negative, at any angle and
/// rate, in tanks that can drain and in tanks that cannot.
#[test]
fn breaking_only_dissipates_and_only_above_its_steepness() {
    for begins in [0.0, 0.3, 0.66, 10.0] {
        for angle in [0.0_f64, 1e-9, 1e-4, 0.1, 0.4, 1.5] {
            for rate in [1e-9, 1e-3, 1.0] {
                let mut tank = tank(angle);
                tank.p_dot_0[0] = [rate * angle.cos(), 0.0, rate * angle.sin()];
                (tank.zeta[0], tank.zeta_breaking[0]) = (0.0, 0.04);
                tank.breaking_steepness[0] = begins;
                let mut drains = tank;
                drains.fill.points = craft::POINTS;
                for tank in [tank, drains] {
                    let p = TankParameters { tank, ..TankParameters::default() };
                    let u = TankInputs { a: Ramp::held([0.0, 0.0, G]), ..TankInputs::default() };
                    let mut alone = SloshTank::new(&p, &u, 0.0, 1e-9).unwrap();
                    let power = alone.derivatives(&u)[6 * MODES];
                    let (m, l) = (tank.mass[0], tank.length[0]);
                    let w = (G / l).sqrt();
                    let zeta = power / (2.0 * m * w * (l * rate).powi(2));
                    assert!(power >= 0.0, "{begins} {angle} {rate}: {power:e}");
                    let steepness = STEEPNESS * (angle.powi(2) + (rate / w).powi(2)).sqrt();
                    if steepness < begins - 0.1 {
                        // Below s_b the rounded corner of the breaking law leaves the small damping delta^2/(4 d).
                        assert!(zeta < 0.04 * 1.1e-3, "{begins} {angle} {rate}: {zeta:e}");
                    }
                }
            }
        }
    }
}

//! Damping as it is measured: the decay of free oscillations of a tank that somebody holds, and of one in a craft too
//! heavy to be moved.

use std::f64::consts::TAU;

use craft::{
    Craft, DampingLaw, Inertia, Inputs, MODES, Parameters, Ramp, Ranges, Regime, SloshTank,
    Spacecraft, Tank, TankInputs, TankParameters, index,
};

const G: f64 = 9.81;

/// One pendulum on the tank's axis, released at `angle` rad in the tank's x z plane.
fn tank(angle: f64) -> Tank {
    let mut tank = Tank { position: [0.0; 3], modes: 1, g_ref: G, ..Tank::default() };
    tank.p_0[0] = [angle.sin(), 0.0, -angle.cos()];
    tank
}

/// p_x and its rate after each `period`, in the tank alone and in a craft of 1e9 kg, under `g` along the tank.
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

/// From the ground to a millionth of a m/s2, without and with a centring stiffness, zeta goes as omega^(-1/2), stays, or
/// goes as omega^-1.
#[test]
fn damping_of_decays_follows_the_frequency_down_to_a_millionth_of_a_metre_per_second_squared() {
    for law in DampingLaw::ALL {
        for k in [0.0, 0.02] {
            for g in [G, G / 10.0, G / 100.0, G / 1000.0, 1e-4, 1e-6] {
                let mut tank = tank(1e-3);
                (tank.damping_law, tank.k[0], tank.zeta[0]) = (law, k, 1e-4);
                // 1e-4 of 9.81 by default: above the smallest here.
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
                    // The floor adds 0.25 % to a at g_ref/1000, 0.13 % to c; large ratios add their squares, of the
                    // angle there is 2.5e-7.
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

/// A'/A = -omega (zeta + zeta_A A) to 0.3 rad; 1 % is what a pendulum's own nonlinearity may take.
#[test]
fn free_oscillations_lose_zeta_plus_zeta_a_times_amplitude() {
    for zeta_a in [0.012, 0.05] {
        let mut tank = tank(0.31);
        (tank.zeta[0], tank.zeta_amplitude[0]) = (0.003, zeta_a);
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
                let off = (pair[0] / pair[1]).ln() / TAU / (0.003 + zeta_a * mean) - 1.0;
                assert!(off.abs() < 1e-2, "{zeta_a} at {mean}: {off:e}");
            }
        }
    }
}

/// The tank of a craft whose thrust goes from one direction to the other.
fn ranges(k: f64, thrust: f64, angle: f64) -> Ranges {
    let mut p = Parameters::default();
    p.tank[0] = Tank { k: [k; MODES], ..tank(angle) };
    let inputs = Inputs { force: Ramp::held([0.0, 0.0, thrust]), ..Inputs::default() };
    let mut craft = Spacecraft::new(&p, &inputs, 0.0, 1e-9).unwrap();
    craft.outputs(&inputs).tank[0].ranges
}

/// Wave over radius is 0.837 of the angle: 0.15 at 0.179 rad, 0.25 at 0.299.
#[test]
fn regimes_end_at_waves_of_0_15_and_0_25_radii_and_a_pushed_back_tank_is_out_of_range() {
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
    assert_eq!(seen.map(|ranges| (ranges.regime, ranges.in_range)), expected);
    // Without thrust the liquid stays where it is; against it, where centring holds it: k l/m > 1.3 m/s2.
    assert!(ranges(0.0, 0.0, 0.1).in_range);
    assert!(!ranges(0.0, -2000.0, 0.1).in_range);
    assert!(!ranges(500.0, -2000.0, 0.1).in_range);
    assert!(ranges(800.0, -2000.0, 0.1).in_range);
}

/// A point of its table is the default tank: one that could drain, and does not, and one that cannot have the same
/// drag, though the two are written apart. On a pivot and free, under every law, with thrust to both sides.
#[test]
fn a_tank_that_could_drain_has_the_drag_of_one_that_cannot() {
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

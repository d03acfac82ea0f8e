//! Compares the independent bench, which shares no code with the FMU, with the FMU and with closed-form solutions. The
//! identification is tested on its recordings, because they cannot contain errors of the FMU.

use host::fmu::Fmu;
use identify::bench::simulate::Setup;
use identify::engine::Hold;
use identify::input::recording::Recording;
use pack::packed_for_tests;

use crate::bench::{Bearing, Bench, Drive, Liquid};

fn rows(seconds: f64) -> Vec<f64> {
    (0..=(seconds / 0.02) as u32).map(|k| 0.02 * f64::from(k)).collect()
}

fn sweep(amplitude: f64, time: &[f64]) -> Vec<f64> {
    let turn = std::f64::consts::TAU;
    time.iter().map(|t| amplitude * (turn * (1.9 * t + 0.01 * t * t / 2.0)).sin()).collect()
}

/// At a small torque the hub is at rest most of the time; at a large torque the spherical pendulum leaves the
/// plane of the torque.
#[test]
fn the_independent_simulator_gives_the_same_motion_as_the_fmu() {
    let fmu = Fmu::open(packed_for_tests()).unwrap();
    let time = rows(60.0);
    for (liquid, name) in
        [(Liquid::Frozen, "frozen"), (Liquid::Linear, "linear"), (Liquid::Spherical, "spherical")]
    {
        for (amplitude, held, asymmetry) in
            [(0.0125, false, 0.0), (0.1, true, 0.1), (0.25, false, 0.0)]
        {
            let tau = sweep(amplitude, &time);
            let bearing = Bearing { asymmetry, ..Bench::default().bearing };
            let drive = if held { Drive::Held(&time, &tau) } else { Drive::Lines(&time, &tau) };
            let there = Bench { liquid, bearing, ..Bench::default() }.motion(&drive, &time);
            let settings = [
                ("slosh.model", name.to_string()),
                ("slosh.zeta_from_correlation", "false".into()),
                ("slosh.zeta", "0.0029757".into()),
                ("friction.asymmetry", asymmetry.to_string()),
            ];
            let settings = settings.map(|(name, value)| (name.to_string(), value)).to_vec();
            let intersample = if held { Hold::ZeroOrderHold } else { Hold::FirstOrderHold };
            let recording = Recording::of("test", time.clone(), tau.clone(), tau.clone());
            let motion = Setup { settings, intersample }.run(&fmu, &[], &recording, 0.0).unwrap();
            let off = |a: &[f64], b: &[f64]| {
                a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            let (rate, angle) = (off(&motion.rate, &there.rate), off(&motion.angle, &there.angle));
            println!(
                "{name} {amplitude}: rate {rate:.1e}, angle {angle:.1e}, {} stops, slosh {:.3}",
                there.stops, there.slosh
            );
            // the largest difference between the two motions is 7e-11
            assert!(
                rate < 1e-9 && angle < 1e-9,
                "{name} {amplitude}: {rate:.1e} rad/s, {angle:.1e} rad"
            );
            assert!(there.stops > 50, "{name} {amplitude}: {} stops", there.stops);
        }
    }
}

/// A hub with the inertia I is at rest below the torque c + d, so that a ramp k t makes it break away at t₀ = (c + d)/k. While it
/// slips, I ω' = τ − c. Without Stribeck's excess d and viscous friction its rate is then ω = k (t − t₀)²/2I.
#[test]
fn under_a_ramp_of_torque_the_hub_breaks_away_as_in_the_closed_form() {
    let (k, c) = (0.004, 0.006);
    let bearing = Bearing { b: 0.0, c, d: 0.0, omega_s: 1.0, asymmetry: 0.0, eps: None };
    let frozen = Bench { liquid: Liquid::Frozen, bearing, ..Bench::default() };
    let (.., liquid) = frozen.mode();
    let inertia = frozen.hub_inertia + liquid * frozen.arm.powi(2);
    let time = rows(4.0);
    let tau: Vec<f64> = time.iter().map(|t| k * t).collect();
    let there = frozen.motion(&Drive::Lines(&time, &tau), &time);
    for (t, rate) in time.iter().zip(&there.rate) {
        let expected = k * (t - c / k).max(0.0).powi(2) / (2.0 * inertia);
        assert!((rate - expected).abs() < 1e-12, "{t} s: {rate} for {expected}");
    }
}

/// Without friction and damping the transfer function from torque to the hub's rate is (p² + ωₙ²)/(I₀ p (p² + ωₚ²)) with ωₚ² =
/// ωₙ² (1 + m r²/I₀). A step τ₀ causes ω = τ₀/I₀ (q t + (1 − q) sin(ωₚ t)/ωₚ) with q = ωₙ²/ωₚ².
#[test]
fn a_step_of_torque_moves_hub_and_linear_liquid_as_the_closed_form_says() {
    let bearing = Bearing { b: 0.0, c: 0.0, d: 0.0, omega_s: 1.0, asymmetry: 0.0, eps: None };
    let bench = Bench { bearing, zeta: 0.0, ..Bench::default() };
    let (mass, _, natural, fixed) = bench.mode();
    let inertia = bench.hub_inertia + fixed * bench.arm.powi(2);
    let q = 1.0 / (1.0 + mass * bench.arm.powi(2) / inertia);
    let resonance = natural / q.sqrt();
    let time = rows(20.0);
    let there = bench.motion(&Drive::Held(&time, &vec![0.05; time.len()]), &time);
    for (t, rate) in time.iter().zip(&there.rate) {
        let expected = 0.05 / inertia * (q * t + (1.0 - q) * (resonance * t).sin() / resonance);
        assert!((rate - expected).abs() < 1e-10, "{t} s: {rate} for {expected}");
    }
}

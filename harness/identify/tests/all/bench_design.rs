use std::f64::consts::TAU;

use analysis::linear::Linear;
use identify::bench::design::{Multisine, Wheel, d_optimal, merit};
use identify::tuning::LINE_GROUP;

/// The multisine with a period of 100 s from 1.25 to 3.5 Hz contains only odd multiples of 0.01 Hz, and its peak is 0.25
/// N·m within 16 %.
#[test]
fn a_multisine_has_only_odd_lines_and_the_given_peak() {
    let torque = Multisine::new(100.0, (1.25, 3.5), 0.25, 1).unwrap();
    assert!(torque.lines.iter().chain(&torque.detection).all(|k| k % 2 == 1));
    assert!(torque.detection.len() >= torque.lines.len() / LINE_GROUP);
    let largest = (0..20_000).map(|k| torque.at(f64::from(k) * 0.005).abs()).fold(0.0, f64::max);
    // the peak was searched every 0.05 s, which at 3.5 Hz may miss a crest by a factor of cos(π 0.05 3.5)
    assert!((0.2499..0.29).contains(&largest), "{largest}");
    // with odd lines only, the second half of a period is the negative of the first
    assert!((torque.at(13.7) + torque.at(63.7)).abs() < 1e-9);
}

#[test]
fn d_optimal_power_is_near_the_slosh_frequency_and_reduces_uncertainty() {
    let plant = Linear { friction: 0.1, ..Linear::bench_10_cm(0.003) };
    let frequencies: Vec<f64> = (125..350).step_by(2).map(|k| f64::from(k) / 100.0).collect();
    let shares = d_optimal(&plant, &frequencies);
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    let near: f64 = frequencies
        .iter()
        .zip(&shares)
        .filter(|(f, _)| (2.25..2.55).contains(*f))
        .map(|(_, p)| p)
        .sum();
    // 13 % of the lines contain the antiresonance and the resonance
    assert!(near > 0.3, "{near}");
}

#[test]
fn the_mean_relative_deviation_of_a_design_leaves_out_unknowns_whose_expected_value_is_zero() {
    let bound = |value: f64, std: f64| ("name".to_string(), value, std);
    let known = [bound(2.0, 0.02), bound(-1.0, 0.04)];
    let with_zero = [&known[..], &[bound(0.0, 1e-4)]].concat();
    // the geometric mean of 1 % and 4 % is 2 %
    assert!((merit(&known) - 0.02).abs() < 1e-15 && merit(&with_zero) == merit(&known));
}

/// 0.1 N·m for 10 s would change the speed of the wheel by 444 rad/s, but its lowest speed is only 146.6 rad/s away.
#[test]
fn the_torque_of_a_design_is_scaled_down_to_the_limits_of_the_wheel() {
    let rpm = std::f64::consts::TAU / 60.0;
    let wheel =
        Wheel { torque: 0.26, inertia: 2.25e-3, speeds: [1600.0 * rpm, 200.0 * rpm, 3000.0 * rpm] };
    let time: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
    // of the change of speed of 444 rad/s, only 146.6 rad/s are available
    let factor = wheel.factor(&time, &vec![0.1; 1000]);
    assert!((factor - 146.6 / 444.0).abs() < 1e-3, "{factor}");
    let fast: Vec<f64> = time.iter().map(|t| 0.52 * (TAU * 3.0 * t).sin()).collect();
    // crests of the sine lie between rows: (π 3 0.01)²/2 = 0.4 %
    assert!((wheel.factor(&time, &fast) - 0.5).abs() < 3e-3);
}

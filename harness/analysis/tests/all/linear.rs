use analysis::features::Features;
use analysis::linear::Linear;
use analysis::sweep::{Law, Sweep};
use analysis::{BAND, logarithmic_grid};
use analysis::{demodulation, spa};
use std::f64::consts::TAU;

#[test]
fn a_jump_of_the_torque_between_samples_is_not_simulated_as_a_slope() {
    // a free hub: 0.2 N·m for 1 s, 0 for 1 s, -0.2 N·m for 1 s; the jumps are between samples 0.1 s apart
    let hub = Linear { inertia: 0.4, arm: 0.2, ..Linear::default() };
    let torque: Vec<f64> = (0..40)
        .map(|k| match k {
            0..10 => 0.2,
            20..30 => -0.2,
            _ => 0.0,
        })
        .collect();
    let time: Vec<f64> = (0..40).map(|k| 0.1 * f64::from(k)).collect();
    let rates = hub.simulate_ramps(&time, &torque, &[0.0; 40], 0.0);
    for (k, expected) in [(5, 0.25), (10, 0.5), (20, 0.5), (25, 0.25), (30, 0.0), (39, 0.0)] {
        assert!((rates[k] - expected).abs() < 1e-14, "{k}: {}", rates[k]);
    }
    // steps of other lengths, also across the jumps: 0.2 N·m for 0.25 s
    let rates = hub.simulate_ramps(&[0.0, 0.05, 0.25, 1.0], &[0.2, 0.2, 0.0, 0.0], &[0.0; 4], 0.0);
    for (rate, expected) in rates.iter().zip([0.0, 0.025, 0.125, 0.125]) {
        assert!((rate - expected).abs() < 1e-15, "{rates:?}");
    }
}

#[test]
fn the_simulated_response_to_a_sine_has_the_gain_of_the_frequency_response() {
    for stiffness in [0.0, 60.0] {
        let plant = Linear { friction: 2.0, stiffness, ..Linear::bench_10_cm(0.05) };
        let (step, f) = (0.002, 2.2);
        let torque: Vec<f64> = (0..40_000).map(|k| (TAU * f * f64::from(k) * step).sin()).collect();
        let rate = plant.simulate(step, &torque, 0.0);
        let largest = rate[35_000..].iter().fold(0.0f64, |m, y| m.max(y.abs()));
        // after 70 s the transient has decayed; the errors of linear interpolation and of the sampled
        // maximum are (w h)²/8
        assert!((largest / plant.response(f).norm() - 1.0).abs() < 2e-4, "{largest}");
    }
}

/// Integrates the linear bench `plant` by the Runge–Kutta method of fourth order with steps of
/// 2.5 ms, whose phase error over a whole sweep is 2e-5 rad. The torque is sampled at 50 Hz and
/// interpolated linearly. Returns time, torque and rate.
fn swept(plant: &Linear, sweep: &Sweep) -> [Vec<f64>; 3] {
    let mode = plant.modes[0];
    let (w, r) = (TAU * mode.frequency, plant.arm);
    let l = 9.81 / (w * w);
    let slope = |[omega, angle, rate]: [f64; 3], tau: f64| {
        let fluid = r * mode.mass * l * (w * w * angle + 2.0 * mode.damping * w * rate);
        let acceleration = (tau - plant.friction * omega + fluid) / plant.inertia;
        [acceleration, rate, -2.0 * mode.damping * w * rate - w * w * angle - r / l * acceleration]
    };
    let add = |x: [f64; 3], k: [f64; 3], h: f64| [0, 1, 2].map(|i| x[i] + h * k[i]);
    let (step, parts) = (0.02, 8);
    let h = step / parts as f64;
    let mut x = [0.0; 3];
    let mut signals = [vec![], vec![], vec![]];
    for k in 0..=(sweep.duration / step).round() as usize {
        let t = k as f64 * step;
        let tau = sweep.torque(t);
        let chord = (sweep.torque(t + step) - tau) / step;
        for (signal, value) in signals.iter_mut().zip([t, tau, x[0]]) {
            signal.push(value);
        }
        for part in 0..parts {
            let at = |c: f64| tau + chord * h * (part as f64 + c);
            let k1 = slope(x, at(0.0));
            let k2 = slope(add(x, k1, h / 2.0), at(0.5));
            let k3 = slope(add(x, k2, h / 2.0), at(0.5));
            let k4 = slope(add(x, k3, h), at(1.0));
            x = [0, 1, 2].map(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
    }
    signals
}

#[test]
fn a_downward_sweep_finds_the_same_antiresonance_and_a_resonance_shifted_downwards() {
    let grid = logarithmic_grid(BAND, 2000);
    let (f_dip, f_res) = (2.3431981, 2.4566022);
    for law in [Law::Exponential, Law::Linear] {
        let sweep = Sweep { f0: 3.5, f1: 1.25, law, ..Sweep::THESIS };
        let [time, tau, omega] = swept(&Linear::bench_10_cm(0.0029757), &sweep);
        let [lock_in] =
            demodulation::frequency_responses(&sweep, &time, &tau, [&omega], &grid).responses;
        assert_eq!(lock_in.frequency.len(), grid.len());
        let spa = spa::frequency_response(0.02, &tau, &omega, &grid, spa::LAG);
        let (lock_in, spa) = (Features::find(&lock_in), Features::find(&spa));
        // the estimate from the whole record does not depend on the direction of the sweep, so that the limits of
        // the upward sweep hold
        assert!((spa.f_dip.unwrap() - f_dip).abs() < 3e-4, "{law:?}: {spa:?}");
        assert!((spa.f_res.unwrap() - f_res).abs() < 3e-4, "{law:?}: {spa:?}");
        // the sweep passed the resonance 125 s before the antiresonance, where its oscillation still has
        // exp(-0.0525 * 125) of its 2.2 (rad/s)/(N.m); near the antiresonance |H| grows by 1.5 per hertz, so that
        // the shift is 2 mHz
        assert!((lock_in.f_dip.unwrap() - f_dip).abs() < 3e-3, "{law:?}: {lock_in:?}");
        // the shift of the resonance is as large as in the upward sweep, in the opposite direction
        let shift = f_res - lock_in.f_res.unwrap();
        assert!((0.014..0.020).contains(&shift), "{law:?}: {lock_in:?}");
    }
}

#[test]
fn both_estimators_find_the_antiresonance_and_an_upward_sweep_shifts_the_resonance_upwards() {
    let grid = logarithmic_grid(BAND, 2000);
    for (plant, f_dip, f_res) in [
        (Linear::bench_10_cm(0.0029757), 2.3431981, 2.4566022),
        (Linear::bench_5_cm(0.0035842), 2.1329468, 2.2306922),
    ] {
        for law in [Law::Exponential, Law::Linear] {
            let sweep = Sweep { law, ..Sweep::THESIS };
            let [time, tau, omega] = swept(&plant, &sweep);
            let [lock_in] =
                demodulation::frequency_responses(&sweep, &time, &tau, [&omega], &grid).responses;
            let spa = spa::frequency_response(0.02, &tau, &omega, &grid, spa::LAG);
            let (lock_in, spa) = (Features::find(&lock_in), Features::find(&spa));
            // the required accuracy of the antiresonance is 2 mHz; both estimators are several times better
            assert!((lock_in.f_dip.unwrap() - f_dip).abs() < 3e-4, "{law:?}: {lock_in:?}");
            assert!((spa.f_dip.unwrap() - f_dip).abs() < 3e-4, "{law:?}: {spa:?}");
            // the estimate from the whole record does not depend on the sweep rate: the resonance is correct to a
            // fraction of the 5 mHz resolution
            assert!((spa.f_res.unwrap() - f_res).abs() < 3e-4, "{law:?}: {spa:?}");
            // in the lock-in estimate the resonance appears late by about its half-power width, 14 and 15 mHz
            let shift = lock_in.f_res.unwrap() - f_res;
            assert!((0.014..0.020).contains(&shift), "{law:?}: {lock_in:?}");
        }
    }
}

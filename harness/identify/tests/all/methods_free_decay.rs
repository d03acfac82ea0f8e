use std::f64::consts::TAU;

use analysis::free_decay;
use analysis::random::Random;
use identify::input::recording::Recording;
use identify::methods::free_decay::{Details, Found, identify};

fn found(time: Vec<f64>, signal: Vec<f64>) -> Found {
    let torque = vec![0.0; time.len()];
    let recordings = [Recording::of("decay", time, torque, signal)];
    identify("wave_height", 0.0, &recordings, &mut |_| {}).unwrap()
}

/// Integrates an oscillator with linear and quadratic damping and a cubic spring by a Runge–Kutta method, independently of
/// the closed form that the method fits.
fn oscillator(
    zeta: f64,
    quadratic: f64,
    cubic: f64,
    x0: f64,
    seconds: f64,
) -> (Vec<f64>, Vec<f64>) {
    let omega = TAU * 2.3;
    let f = |[x, v]: [f64; 2]| {
        [
            v,
            -omega * omega * x * (1.0 + cubic * x * x)
                - 2.0 * zeta * omega * v
                - quadratic * v * v.abs(),
        ]
    };
    let (h, every) = (1e-3, 20);
    let (mut y, mut time, mut signal) = ([x0, 0.0], Vec::new(), Vec::new());
    for k in 0..(seconds / h) as usize {
        if k % every == 0 {
            time.push(k as f64 * h);
            signal.push(y[0]);
        }
        let add = |y: [f64; 2], d: [f64; 2], by: f64| [y[0] + by * d[0], y[1] + by * d[1]];
        let a = f(y);
        let b = f(add(y, a, h / 2.0));
        let c = f(add(y, b, h / 2.0));
        let d = f(add(y, c, h));
        for i in 0..2 {
            y[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
    }
    (time, signal)
}

#[test]
fn damping_that_grows_with_the_amplitude_is_estimated_as_averaging_theory_predicts() {
    // x'' + ... + q x'|x'|: averaging gives ζ_A = 4 q/(3π) (Nayfeh and Mook 1979, 3.3.3), and a cubic spring gives κ = 3
    // α/8. Both are of first order in the squared amplitude; the error, 0.2² α q, is below 1 %.
    let (q, alpha) = (0.02, -0.05);
    let (time, signal) = oscillator(0.004, q, alpha, 0.3, 60.0);
    let answer = found(time, signal);
    let value = |name: &str| answer.measurement[name].value;
    let expected = 4.0 * q / (3.0 * std::f64::consts::PI);
    assert!((value("frequency") / 2.3 - 1.0).abs() < 2e-5, "{:?}", answer.measurement);
    assert!((value("zeta") / 0.004 - 1.0).abs() < 0.01, "{:?}", answer.measurement);
    assert!((value("zeta_amplitude") / expected - 1.0).abs() < 0.01, "{:?}", answer.measurement);
    assert!(
        (value("hardening") / (3.0 * alpha / 8.0) - 1.0).abs() < 0.02,
        "{:?}",
        answer.measurement
    );
    let Details { residual, residual_constant, .. } = answer.details;
    assert!(residual < 1e-3 * 0.3 && residual_constant > 10.0 * residual);
}

#[test]
fn intervals_contain_the_true_value_in_white_and_in_coloured_noise() {
    // 60 simulated recordings of 25 s each. On average 57 of the 95 % intervals contain the true value, with a standard
    // deviation of 1.7; the limit is three standard deviations lower.
    for (colour, least) in [(0.0, 52), (0.9, 52)] {
        let (mut held, mut fits) = ([0; 3], 0);
        for seed in 0..60 {
            let mut random = Random::new(seed, 3);
            let time: Vec<f64> = (0..625).map(|k| 0.04 * k as f64).collect();
            let clean = free_decay::model(&time, [1.7, 0.006, 0.01, 0.0], [1.0, 0.4, 0.02, 0.0]);
            let mut noise = 0.0;
            let signal = clean.iter().map(|x| {
                noise = colour * noise + 0.02 * random.normal();
                x + noise
            });
            let answer = found(time.clone(), signal.collect());
            fits += usize::from(answer.fits == Some(true));
            let truth = [("frequency", 1.7), ("zeta", 0.006), ("zeta_amplitude", 0.01)];
            for (count, (name, truth)) in held.iter_mut().zip(truth) {
                let [low, high] = answer.measurement[name].interval;
                *count += usize::from((low..=high).contains(&truth));
            }
        }
        println!("colour {colour}: {held:?}, {fits} fit");
        assert!(held.iter().all(|count| *count >= least), "colour {colour}: {held:?}");
        assert!(fits >= 59, "{fits}");
    }
}

use analysis::gauss_markov::Noise;
use analysis::random::Random;
use identify::engine::{Drift, Signal};

const TIME: f64 = 100.0; // s

/// Returns the estimated noise, the residual and the innovations of a simulated residual with white noise and a drift
/// (rad/s). The recorded rate has a standard deviation of 1 rad/s.
fn estimated(white: f64, drift: f64) -> (Noise, Vec<f64>, Vec<f64>) {
    let mut random = Random::new(3, 1);
    let time: Vec<f64> = (0..135_000).map(|k| 0.02 * f64::from(k)).collect();
    let keep = (-0.02 / TIME).exp();
    let mut bias = drift * random.normal();
    let next = |_: &f64| {
        let y = bias + white * random.normal();
        bias = keep * bias + drift * (1.0 - keep * keep).sqrt() * random.normal();
        y
    };
    let residual: Vec<f64> = time.iter().map(next).collect();
    let signal = Signal {
        recording: 0,
        output: 0,
        measured: time.iter().map(|t| 2f64.sqrt() * (10.0 * t).sin()).collect(),
        sampled: vec![true; time.len()],
        white,
        drift: Some(Drift { size: 0.1, time: TIME, width: 1.5 }),
    };
    (signal.noise_of(&time, &residual), time, residual)
}

#[test]
fn the_estimated_noise_is_the_simulated_noise_and_makes_the_innovations_white() {
    let (white, drift) = (4.07e-4, 7.85e-5);
    let (found, time, residual) = estimated(white, drift);
    // the standard error of the white noise is 1/sqrt(2 N) = 0.2 %; with 27 correlation times the standard error of the drift
    // is 20 %; four standard errors are allowed
    assert!((found.white / white - 1.0).abs() < 0.01, "{found:?}");
    assert!((found.drift * found.white / drift).ln().abs() < 0.8, "{found:?}");
    let mut e = residual.clone();
    found.whitening(&time, None).apply(&mut e);
    for lag in [1, 50, 500] {
        let sum: f64 = e.iter().zip(&e[lag..]).map(|(a, b)| a * b).sum();
        assert!((sum / e.len() as f64).abs() < 4.0 / (e.len() as f64).sqrt(), "lag {lag}");
    }
}

#[test]
fn a_residual_as_small_as_solver_errors_gets_the_least_noise() {
    let found = estimated(5e-11, 1e-11).0;
    assert!((found.white / 1e-5 - 1.0).abs() < 1e-3, "{found:?}");
}

use std::f64::consts::TAU;

use analysis::free_decay::{Record, Start, model};
use analysis::random::Random;

#[test]
fn a_free_decay_of_100000_uneven_rows_is_fitted_with_a_single_fourier_transform() {
    // the spacing is 0.6 to 1.4 times the mean step; a direct sum at every frequency, instead of
    // one transform, took minutes
    let mut random = Random::new(5, 0);
    let mut time = vec![0.0];
    for _ in 1..100_000 {
        time.push(time[time.len() - 1] + 0.01 * (1.0 + 0.8 * (random.uniform() - 0.5)));
    }
    let clean = model(&time, [1.7, 0.002, 0.0, 0.0], [1.0, 0.4, 0.0, 0.0]);
    let signal: Vec<f64> = clean.iter().map(|x| x + 0.02 * random.normal()).collect();
    let found = Start::fit(&Record { time: &time, signal: &signal }).unwrap();
    assert!((found.frequency / 1.7 - 1.0).abs() < 1e-4, "{found:?}");
    assert!((found.zeta / 0.002 - 1.0).abs() < 0.05, "{found:?}");
}

#[test]
fn a_free_decay_needs_more_than_four_periods_and_an_oscillation() {
    let time: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k)).collect();
    let signal: Vec<f64> = time.iter().map(|t| (TAU * t).cos()).collect();
    assert!(Start::fit(&Record { time: &time, signal: &signal }).is_none());
    assert!(Start::fit(&Record { time: &time, signal: &[1.0; 200] }).is_none());
}

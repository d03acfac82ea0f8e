use analysis::allan::{FLICKER, Noise, variances};
use analysis::random::Random;

#[test]
fn the_allan_deviation_of_white_noise_falls_with_the_root_of_the_averaging_time() {
    let mut random = Random::new(1, 0);
    let samples: Vec<f64> = (0..100_000).map(|_| 3.0 * random.normal()).collect();
    for point in variances(0.02, &samples) {
        // The mean of n samples has the deviation sigma/sqrt(n). The relative standard error of the variance
        // is about 1/sqrt(1.5 times the number of such intervals); five standard errors are allowed.
        let n = point.tau / 0.02;
        let expected = 3.0 / n.sqrt();
        let error = (2.0 / (1.5 * 100_000.0 / n)).sqrt() / 2.0;
        let found = point.variance.sqrt();
        assert!((found / expected - 1.0).abs() < 5.0 * error, "n = {n}: {found}");
    }
}

#[test]
fn the_allan_deviation_of_a_ramp_rises_with_the_averaging_time() {
    // two neighbouring means of the rate D t differ by D tau, so that the deviation is D tau / sqrt 2
    let samples: Vec<f64> = (0..20_000).map(|k| 0.25 * 0.1 * k as f64).collect();
    let points = variances(0.1, &samples);
    assert!(points.len() > 40 && (points.last().unwrap().tau - 200.0).abs() < 30.0);
    for point in points {
        let expected = 0.25 * point.tau / 2f64.sqrt();
        // sums of 20,000 numbers up to 500 have a relative rounding error of 1e-9
        assert!((point.variance.sqrt() / expected - 1.0).abs() < 1e-7, "{point:?}");
    }
}

#[test]
fn the_allan_deviation_of_an_alternating_signal_is_0_for_averages_of_even_length() {
    // +1, −1, ...: means of an odd number m of samples are ±1/m, of an even number 0
    let samples: Vec<f64> = (0..1000).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
    for point in variances(1.0, &samples) {
        let m = point.tau;
        let expected = if m % 2.0 == 1.0 { 2.0 / (m * m) } else { 0.0 };
        assert!((point.variance - expected).abs() < 1e-12, "{point:?}");
    }
}

#[test]
fn the_allan_deviation_of_a_gauss_markov_bias_has_the_peak_that_the_book_states() {
    let noise = Noise { bias_instability: FLICKER, bias_time: 100.0, ..Noise::default() };
    let deviation = |tau: f64| noise.variance(tau).sqrt();
    let times = (0..10_000).map(|k| f64::from(k) * 0.1 + 1.0);
    let peak = times.max_by(|a, b| deviation(*a).total_cmp(&deviation(*b))).unwrap();
    // 1.8926 and 0.61737 are the position and the value of the maximum, where the derivative is zero: 3 − x −
    // (4 + 2x) e^−x + (1 + x) e^−2x = 0
    assert!((peak / 100.0 - 1.8926).abs() < 1e-3, "{peak}");
    assert!((deviation(peak) - 0.61737).abs() < 1e-4, "{}", deviation(peak));
    // limits of the deviation for small and for large x: sqrt(2x/3) and sqrt(2/x)
    assert!((deviation(0.01) / (2.0 * 1e-4 / 3.0f64).sqrt() - 1.0).abs() < 1e-3);
    assert!((deviation(1e6) / 2e-4f64.sqrt() - 1.0).abs() < 1e-3);
}

#[test]
fn the_allan_variance_of_a_simulated_gauss_markov_bias_equals_the_formula() {
    // 1e6 samples, 50 in each correlation time: 2e4 correlation times
    let (mut random, mut bias) = (Random::new(2, 0), 0.0);
    let keep = (-1.0 / 50.0f64).exp();
    let samples: Vec<f64> = (0..1_000_000)
        .map(|_| {
            bias = keep * bias + (1.0 - keep * keep).sqrt() * random.normal();
            bias
        })
        .collect();
    let noise = Noise { bias_instability: FLICKER, bias_time: 1.0, ..Noise::default() };
    for point in variances(0.02, &samples).iter().filter(|p| (0.2..20.0).contains(&p.tau)) {
        // below 0.2 s the effect of sampling, which the formula neglects, matters; the standard error is at
        // most sqrt(1/(1.5 x 2e4/20)) = 2.6 %, at the longest time
        let ratio = point.variance / noise.variance(point.tau);
        assert!((ratio - 1.0).abs() < 0.1, "{point:?}: {ratio}");
    }
}

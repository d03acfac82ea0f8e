use analysis::random::Random;
use analysis::rest::{Rest, normal_quantile};

#[test]
fn white_normal_noise_on_a_linear_trend_is_recognised() {
    let mut random = Random::new(1, 0);
    let samples: Vec<f64> =
        (0..100_000).map(|k| 1e-3 + 1e-9 * f64::from(k) + 4e-4 * random.normal()).collect();
    let rest = Rest::analyse(0.02, &samples, 100.0, 10.0);
    // standard errors: mean of a line 4e-4/√1e5 = 1.3e-6, slope √12 σ/(n √n h) = 2.2e-9/s
    assert!((rest.mean - 1.05e-3).abs() < 4e-6 && (rest.trend - 5e-8).abs() < 7e-9, "{rest:?}");
    assert!((rest.deviation / 4e-4 - 1.0).abs() < 0.01);
    assert!(rest.skewness.abs() < 0.03 && rest.kurtosis.abs() < 0.06);
    assert_eq!((rest.chunks.len(), rest.autocorrelation.len()), (20, 501));
    // on average 5 % of the 500 lags are outside, with a standard deviation of 1 %
    assert!(rest.outside() < 0.09, "{}", rest.outside());
    // with 20 chunks a standard deviation is known to 1/√40 = 16 %
    let scatter = rest.scatter(rest.chunk_length());
    assert!(scatter.iter().all(|s| (0.5..1.5).contains(s)), "{scatter:?}");
    // quantiles between ±2 are accurate to 5e-3
    let off = rest.quantiles.iter().filter(|(x, _)| x.abs() < 2.0).map(|(x, y)| (x - y).abs());
    assert!(off.fold(0.0, f64::max) < 0.03);
}

/// The samples imitate the gyro of Rubaga's thesis: normal noise of 0.4 mrad/s, rounded to
/// steps of 0.15 mrad/s.
#[test]
fn quantised_normal_noise_is_normal_between_its_levels() {
    let mut random = Random::new(3, 0);
    let step = 1.53e-4;
    let samples: Vec<f64> =
        (0..90_000).map(|_| (4.066e-4 * random.normal() / step).round() * step).collect();
    let rest = Rest::analyse(0.02, &samples, 180.0, 1.0);
    assert!((rest.quantum / step - 1.0).abs() < 1e-9);
    // (σ² + Δ²/12)/(Δ²/12); the simulated noise determines it to √(2/n) = 0.5 %
    let expected = 1.0 + 12.0 * (4.066e-4_f64 / step).powi(2);
    assert!((rest.quantisation_ratio() / expected - 1.0).abs() < 0.02);
    // of 10 chunks with normal noise, at most 1 exceeds the limit with a probability of 0.91, and at most 3 with 0.999
    let [read, between] = rest.not_normal();
    assert!(read == 10 && between <= 3, "{read} {between}: {:?}", rest.chunks);
    // Δ √n/(2σ√(2π)) with n = 9,000, plus a random part below 1
    let jump = 9000f64.sqrt() * step / (2.0 * 4.066e-4 * std::f64::consts::TAU.sqrt());
    assert!(
        rest.chunks.iter().all(|c| (c.kolmogorov - jump).abs() < 1.0),
        "{jump} {:?}",
        rest.chunks
    );
    let sum: f64 = rest.histogram.windows(2).map(|b| (b[1].0 - b[0].0) * b[1].1).sum();
    assert!((sum - 1.0).abs() < 0.01, "{sum}");
    // with an exponential distribution both distances exceed the limit
    let skew: Vec<f64> = samples.iter().map(|x| (x / 4e-4).exp() * 1e-4).collect();
    assert_eq!(Rest::analyse(0.02, &skew, 180.0, 1.0).not_normal(), [10, 10]);
}

#[test]
fn the_autocorrelation_of_sums_of_adjacent_white_samples_is_one_half_at_lag_1() {
    let mut random = Random::new(2, 0);
    let white: Vec<f64> = (0..50_001).map(|_| random.normal()).collect();
    let sums: Vec<f64> = white.windows(2).map(|x| x[0] + x[1]).collect();
    let rest = Rest::analyse(1.0, &sums, 100.0, 3.0);
    // the standard error of an autocorrelation is 1/√5e4 = 4.5e-3
    assert!((rest.autocorrelation[1] - 0.5).abs() < 0.02 && rest.autocorrelation[2].abs() < 0.03);
    assert!(rest.scatter(100)[0] > 1.2);
}

#[test]
fn the_normal_quantiles_equal_those_of_the_tables() {
    for (part, x) in [(0.5, 0.0), (0.975, 1.959_963_984_540_054), (1e-6, -4.753_424_308_822_899)] {
        assert!((normal_quantile(part) - x).abs() < 1e-10, "{part}");
    }
}

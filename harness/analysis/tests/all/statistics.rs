use analysis::statistics::{
    correlation, deviation, mean, median, noise_level, peak, quantile, running_mean, variance,
};

#[test]
fn mean_variance_quantiles_and_correlation_of_four_values_are_exact() {
    let values = [1.0, -4.0, 2.0, 5.0];
    assert_eq!((mean(&values), variance(&values), peak(&values)), (1.0, 10.5, 5.0));
    assert_eq!((median(&values), quantile(&values, 0.2)), (Some(2.0), Some(-4.0)));
    assert!((correlation(&values, &[-1.0, 4.0, -2.0, -5.0]) + 1.0).abs() < 1e-15);
    assert!(median(&[]).is_none() && peak(&[]) == 0.0 && deviation(&values) == 10.5f64.sqrt());
}

#[test]
fn the_noise_level_of_a_signal_excludes_its_motion_at_a_few_hertz() {
    let mut random = analysis::random::Random::new(1, 0);
    let noisy: Vec<f64> =
        (0..15_000).map(|k| 0.02 * (0.3 * f64::from(k)).sin() + 4e-4 * random.normal()).collect();
    let quantised: Vec<f64> = noisy.iter().map(|y| (y / 0.01).round() * 0.01).collect();
    // the median of 15,000 squares has a relative standard error of 2 %; the third difference of the motion is
    // 0.3³ of 20 mrad/s
    let level = noise_level(&noisy);
    assert!((level / 4e-4 - 1.0).abs() < 0.2, "{level}");
    assert!(noise_level(&quantised) >= 0.01 / 12f64.sqrt());
}

#[test]
fn running_means_equal_the_mean_of_each_window() {
    let x: Vec<f64> = (0..50).map(|k| f64::from(k * k % 17)).collect();
    for width in [1, 3, 50] {
        let expected: Vec<f64> = x.windows(width).map(mean).collect();
        let found = running_mean(&x, width);
        assert_eq!(found.len(), expected.len());
        // sums of 50 integers have no rounding error
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{width}");
    }
}

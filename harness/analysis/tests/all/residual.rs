use analysis::residual::skewness_and_kurtosis;

#[test]
fn skewness_and_kurtosis_of_a_sine_and_of_coin_tosses_are_exact() {
    let sine: Vec<f64> =
        (0..1000).map(|k| (std::f64::consts::TAU * k as f64 / 1000.0).sin()).collect();
    let (skewness, kurtosis) = skewness_and_kurtosis(&sine);
    assert!(skewness.abs() < 1e-12 && (kurtosis - 1.5).abs() < 1e-12);
    let coin = [0.0, 0.0, 0.0, 1.0];
    let (skewness, kurtosis) = skewness_and_kurtosis(&coin);
    // a signal with two values, the larger with p = 1/4, q = 1 − p: (1 - 2p)/sqrt(p q) and 3 + (1 -
    // 6 p q)/(p q)
    assert!((skewness - 2.0 / 3f64.sqrt()).abs() < 1e-12);
    assert!((kurtosis - 7.0 / 3.0).abs() < 1e-12);
}

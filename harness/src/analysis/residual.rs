//! What a fitted model leaves of a signal: moments of its distribution (thesis 6.3.5).

/// Skewness and kurtosis of a signal: the means of z³ and z⁴, z the signal less its mean
/// over its standard deviation. A Gaussian has 0 and 3.
pub fn skewness_and_kurtosis(signal: &[f64]) -> (f64, f64) {
    let count = signal.len() as f64;
    let mean = signal.iter().sum::<f64>() / count;
    let moment = |n: i32| signal.iter().map(|x| (x - mean).powi(n)).sum::<f64>() / count;
    let deviation = moment(2).sqrt();
    (moment(3) / deviation.powi(3), moment(4) / deviation.powi(4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_a_sine_and_of_a_coin() {
        let sine: Vec<f64> =
            (0..1000).map(|k| (std::f64::consts::TAU * k as f64 / 1000.0).sin()).collect();
        let (skewness, kurtosis) = skewness_and_kurtosis(&sine);
        assert!(skewness.abs() < 1e-12 && (kurtosis - 1.5).abs() < 1e-12);
        let coin = [0.0, 0.0, 0.0, 1.0];
        let (skewness, kurtosis) = skewness_and_kurtosis(&coin);
        // p = 1/4: (1 - 2p)/sqrt(p q) and 3 + (1 - 6 p q)/(p q)
        assert!((skewness - 2.0 / 3f64.sqrt()).abs() < 1e-12);
        assert!((kurtosis - 7.0 / 3.0).abs() < 1e-12);
    }
}

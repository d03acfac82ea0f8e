use analysis::spa::frequency_response;
use fourier::Complex64;

#[test]
fn the_spectral_estimate_equals_its_definition() {
    // noise through a short filter: 40 samples with lags up to 9 samples, compared with the sums of the definition
    let step = 0.1;
    let u: Vec<f64> = (0..40u32).map(|k| f64::from(k * k * 7919 % 101) / 50.0 - 1.0).collect();
    let y: Vec<f64> = (0..40).map(|k| u[k] - if k > 1 { 0.7 * u[k - 2] } else { 0.0 }).collect();
    let frequencies = [0.3, 1.7, 4.1];
    let found = frequency_response(step, &u, &y, &frequencies, 0.9);
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (mu, my) = (mean(&u), mean(&y));
    for (f, h) in frequencies.iter().zip(&found.response) {
        let sum = |x: &[f64], mx: f64| {
            let mut sum = Complex64::default();
            for lag in -9i32..=9 {
                let inside = |t: i32| (0..40).contains(&(t + lag)).then_some(t);
                let covariance: f64 = (0..40)
                    .filter_map(inside)
                    .map(|t| (x[(t + lag) as usize] - mx) * (u[t as usize] - mu))
                    .sum();
                let weight = (1.0 + (std::f64::consts::PI * f64::from(lag) / 9.0).cos()) / 2.0;
                let angle = -std::f64::consts::TAU * f * step * f64::from(lag);
                sum += covariance * weight * Complex64::cis(angle);
            }
            sum
        };
        let expected = sum(&y, my) / sum(&u, mu);
        assert!((h - expected).norm() < 1e-12 * expected.norm(), "{h} {expected}");
    }
}

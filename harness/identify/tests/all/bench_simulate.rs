use identify::bench::simulate::smooth;

#[test]
fn linear_interpolation_of_corrected_samples_has_the_amplitude_of_the_sine() {
    let h = 0.02;
    for f in [1.25, 2.4, 3.5] {
        let w = std::f64::consts::TAU * f;
        let time: Vec<f64> = (0..5000).map(|k| h * f64::from(k)).collect();
        let sine: Vec<f64> = time.iter().map(|t| (w * t).sin()).collect();
        let amplitude = |x: &[f64]| {
            // amplitude of the linear interpolation: sinc² times the amplitude of the samples
            let half: f64 = 0.5 * w * h;
            let tone = time.iter().zip(x).map(|(t, x)| x * (w * t).sin()).sum::<f64>();
            let whole = sine.iter().map(|s| s * s).sum::<f64>();
            tone / whole * (half.sin() / half).powi(2)
        };
        assert!(amplitude(&sine) < 0.998);
        // the next term of the series is (Ωh)⁶/1600, 5e-6 at 3.5 Hz; the two ends add to it
        assert!((amplitude(&smooth(&time, &sine)) - 1.0).abs() < 2e-5, "{f}");
    }
}

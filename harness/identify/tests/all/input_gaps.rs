use identify::input::gaps::{fill, trial_error};

fn sweep(t: f64) -> f64 {
    0.1 * (std::f64::consts::TAU * (1.5 + 0.005 * t) * t).sin()
}

/// Gaps of 1, 10 and 50 samples in a sweep are predicted within 1e-4 of the amplitude. Gaps in white noise are not filled.
#[test]
fn lost_samples_of_a_sweep_are_predicted_and_lost_samples_of_noise_are_not() {
    let values: Vec<f64> = (0..4000).map(|k| sweep(100.0 + 0.02 * f64::from(k))).collect();
    for lost in [1, 10, 50] {
        let found = fill([&values[1000..1250], &values[1250 + lost..1500 + lost]], lost).unwrap();
        let off = found.iter().zip(&values[1250..]).map(|(a, b)| (a - b).abs());
        let worst = off.fold(0.0, f64::max);
        assert!(worst < 1e-3 * 0.1, "{lost}: {worst:e}");
    }
    assert!(trial_error(&values, &[], 10) < 1e-4);
    // a torque that jumps from row to row is not predictable
    let mut random = analysis::random::Random::new(1, 0);
    let noise: Vec<f64> = (0..4000).map(|_| 0.1 * random.normal()).collect();
    assert!(trial_error(&noise, &[], 10) > 0.1);
}

use identify::bench::effect::{lagged_torque, of_gyro};

/// A lag with the time constant T multiplies the amplitude of a sine with the angular frequency Ω by 1/√(1 + (ΩT)²) and
/// shifts its phase by −atan ΩT.
#[test]
fn a_lag_changes_a_sine_as_its_frequency_response_predicts() {
    let (w, lag, h) = (15.0_f64, 0.03, 0.02);
    let time: Vec<f64> = (0..2000).map(|k| h * f64::from(k)).collect();
    // linear interpolation of a sine reduces its amplitude by sinc²
    let half = 0.5 * w * h;
    let more = (half / half.sin()).powi(2);
    let sine: Vec<f64> = time.iter().map(|t| more * (w * t).sin()).collect();
    let gain = 1.0 / (1.0 + (w * lag).powi(2)).sqrt();
    let expected = |t: f64| gain * (w * t - (w * lag).atan()).sin();
    let read = of_gyro(lag, &time, &sine);
    let (knots, torque) = lagged_torque(lag, &time, &sine, false);
    // after 15 lags the transient has decayed; the end is left out
    for k in 100..1900 {
        // the harmonics of the linear interpolation, 1/(2π/Ωh)² of the sine and more, pass the lag as well
        assert!((read[k] - expected(time[k])).abs() < 1e-3, "{k}");
        assert!((torque[3 * k] - expected(knots[3 * k])).abs() < 1e-3, "{k}");
    }
    // a held command is reached to 1 − 1/e after one lag
    let held = lagged_torque(1.0, &[0.0, 0.5, 1.5], &[0.0, 1.0, 1.0], true);
    let last = held.1[held.1.len() - 1];
    assert!((last - (1.0 - (-1.0_f64).exp())).abs() < 1e-12, "{last}");
}

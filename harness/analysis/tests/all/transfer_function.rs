use analysis::linear::{Linear, Mode};
use analysis::transfer_function::{TransferFunction, fit_time};
use analysis::{BAND, logarithmic_grid};
use std::f64::consts::TAU;

#[test]
fn a_transfer_function_fit_recovers_the_exact_linear_model() {
    // Poles and zeros of the 10 cm bench to 15 digits by an independent calculation.
    let plant = Linear::bench_10_cm(0.002_975_693_092_229);
    let measured = plant.frequency_response(&logarithmic_grid(BAND, 2000));
    let found = TransferFunction::fit(&measured).unwrap();
    assert!(found.fit_frequency(&measured) > 99.9999);
    assert!((found.zero_frequency().unwrap() - 2.343_618_143).abs() < 1e-6, "{found:?}");
    assert!((found.zero_damping().unwrap() - 0.002_975_693).abs() < 1e-7, "{found:?}");
    let (re, im): (f64, f64) = (0.052_474_564_65, 15.431_581_060_83);
    let w = re.hypot(im);
    assert!((found.pole_omega - w).abs() < 1e-5, "{found:?}");
    assert!((found.pole_damping - re / w).abs() < 1e-7, "{found:?}");
    assert!((found.real_pole - 0.088_610_515_2).abs() < 1e-4, "{found:?}");
}

#[test]
fn a_simulated_sine_has_the_gain_of_the_transfer_function() {
    let tf = TransferFunction {
        numerator: [2.0, 0.5, 300.0],
        real_pole: 0.5,
        pole_omega: 15.0,
        pole_damping: 0.05,
    };
    let (step, f) = (0.001, 2.0);
    let input: Vec<f64> = (0..60_000).map(|k| (TAU * f * k as f64 * step).sin()).collect();
    let answer = tf.simulate(step, &input);
    let largest = answer[55_000..].iter().fold(0.0f64, |m, y| m.max(y.abs()));
    // errors of linear interpolation (w h)²/12 = 1.3e-5 and of the sampled maximum (w h)²/8; the transient
    // has decayed by e^(-27)
    assert!((largest / tf.response(f).norm() - 1.0).abs() < 5e-5);
}

#[test]
fn a_narrow_resonance_far_below_the_band_s_middle_is_found() {
    // a spacecraft of 800 kg·m²; without a start at the resonance the fit ended in a wrong minimum
    let grid = logarithmic_grid((0.01, 0.2), 2000);
    for inertia in [780.0, 800.0, 810.0] {
        let slosh = Mode { mass: 120.0, frequency: 0.04177, damping: 0.01 };
        let plant = Linear { inertia, arm: 0.6, modes: vec![slosh], ..Linear::default() };
        let fitted = TransferFunction::fit(&plant.frequency_response(&grid)).unwrap();
        let zero = fitted.zero_frequency().unwrap();
        assert!((zero / slosh.frequency - 1.0).abs() < 1e-3, "{inertia}: {fitted:?}");
    }
}

#[test]
fn a_transfer_function_fit_recovers_a_free_response_from_the_whole_signal() {
    // records of 2700 s: a slowly rotating pole pair with a slow real pole, and a pair of equal real poles
    for (pole_damping, real_pole) in [(2e-5, 1e-4), (1.0, 0.1)] {
        let tf = TransferFunction {
            numerator: [1.0, 2.0, 3.0],
            real_pole,
            pole_omega: 15.0,
            pole_damping,
        };
        let (decay, turn) =
            (pole_damping * 15.0, 15.0 * f64::sqrt(1.0 - pole_damping * pole_damping));
        let free = |k: i32| {
            let t = f64::from(k) * 0.02;
            let second = if turn > 0.0 { (turn * t).sin() } else { t };
            0.3 * (-real_pole * t).exp()
                + (-decay * t).exp() * (0.5 * (turn * t).cos() - 0.2 * second)
        };
        let signal: Vec<f64> = (0..135_001).map(free).collect();
        // the limit is 135,000 rounding errors of 1e-16, all in the same direction
        for (found, given) in tf.free_answer(0.02, &signal).iter().zip(&signal) {
            assert!((found - given).abs() < 2e-11, "{found} instead of {given}");
        }
    }
}

#[test]
fn the_fit_percentage_is_100_for_the_signal_itself_and_0_for_its_mean() {
    let y = [1.0, 2.0, 4.0, 5.0];
    assert_eq!(fit_time(&y, &y), 100.0);
    assert_eq!(fit_time(&y, &[3.0; 4]), 0.0);
}

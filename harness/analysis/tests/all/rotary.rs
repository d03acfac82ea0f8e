use std::f64::consts::PI;

use analysis::FrequencyResponse;
use analysis::rotary::{Rotary, swirl};
use fourier::Complex64;

#[test]
fn the_swirl_number_is_one_for_a_circle_and_zero_for_a_line() {
    let response = |values: &[Complex64]| FrequencyResponse {
        frequency: vec![2.0; values.len()],
        response: values.to_vec(),
    };
    let one = Complex64::new(1.0, 0.0);
    // x = cos φ has the coefficient 1, y = sin φ has −i: a rotation from outwards towards +θ
    let radial = response(&[one, one, one * 1e-4]);
    let tangential = response(&[Complex64::new(0.0, -1.0), one * 0.3, Complex64::new(0.0, 1e-4)]);
    let numbers = swirl(&radial, &tangential, 1.0);
    assert_eq!(numbers, [1.0, 0.0, 0.0]);
    let rotary = Rotary::from_sweep(&[1.0, 2.0, 3.0], &[0.0, 10.0, 20.0], &numbers);
    assert_eq!((rotary.from, rotary.to, rotary.swirl), (Some(1.0), Some(1.0), 1.0));
    assert_eq!(rotary.time, 5.0);
}

#[test]
fn the_swirl_number_of_an_elliptic_motion_follows_from_its_axes() {
    let step = 0.02;
    let run = |a: f64, b: f64| {
        let phase = |i: usize| 2.0 * PI * 2.3 * step * i as f64;
        let radial: Vec<f64> = (0..5000).map(|i| a * phase(i).cos()).collect();
        let tangential: Vec<f64> = (0..5000).map(|i| b * phase(i).sin()).collect();
        Rotary::from_angles(step, 2.3, &radial, &tangential)
    };
    // 100 s contain 22 windows of 218 steps
    let circle = run(0.1, 0.1);
    assert!((circle.swirl - 1.0).abs() < 1e-3, "{circle:?}");
    assert!((circle.time - 22.0 * 218.0 * step).abs() < 1e-9, "{circle:?}");
    let flat = run(0.02, -0.2);
    // the swirl number of an ellipse is 2ab/(a² + b²), negative because the motion is clockwise
    assert!((flat.swirl + 0.198).abs() < 1e-3, "{flat:?}");
    assert_eq!((flat.time, flat.from), (0.0, None));
    assert_eq!(run(0.01, 0.01).swirl, 0.0, "too small");
    assert_eq!(run(0.0, 0.1).swirl, 0.0, "in a plane");
}

use analysis::FrequencyResponse;
use analysis::off_axis::{OffAxis, off_axis_from_rates};
use fourier::Complex64;

#[test]
fn rates_of_a_tenth_about_two_other_axes_give_a_cross_axis_energy_fraction_of_a_fiftieth() {
    let response = |size: f64| FrequencyResponse {
        frequency: vec![1.0; 4],
        response: vec![Complex64::new(0.0, size); 4],
    };
    let (all, x) = (response(2.0), response(0.2));
    let (rate, tenth) = ([1.0, -2.0, -1.0, 2.0], [0.1, 0.2, -0.1, -0.2]);
    let (leakage, found) = off_axis_from_rates(&all, &rate, &[(&x, &tenth), (&x, &tenth)]);
    let found = found.unwrap();
    assert!(
        (found.median - 0.02 / 1.02).abs() < 1e-15 && (found.energy - 0.02 / 1.02).abs() < 1e-15
    );
    assert!(leakage.iter().all(|l| (l - 0.02f64.sqrt()).abs() < 1e-15));
    assert_eq!(off_axis_from_rates(&all, &rate, &[]), (Vec::new(), None));
}

#[test]
fn a_bias_of_up_to_5_deg_s_on_any_axis_does_not_change_the_cross_axis_energy_fraction() {
    let wave = |size: f64, phase: f64| -> Vec<f64> {
        (0..3000).map(|k| size * (0.3 * f64::from(k) + phase).sin()).collect()
    };
    let (rate, x, y) = (wave(0.1, 0.0), wave(0.005, 1.0), wave(0.005, 2.0));
    let none = FrequencyResponse::default();
    let found = |biases: [f64; 3]| {
        let biased = |signal: &[f64], bias: f64| -> Vec<f64> {
            signal.iter().map(|w| w + bias.to_radians()).collect()
        };
        let [rate, x, y] = [(&rate, 0), (&x, 1), (&y, 2)].map(|(w, k)| biased(w, biases[k]));
        off_axis_from_rates(&none, &rate, &[(&none, &x), (&none, &y)]).1.unwrap()
    };
    let without = found([0.0; 3]);
    // 2 · 0.05² divided by the sum of the squares over all three axes
    assert!((without.energy - 0.005 / 1.005).abs() < 1e-4, "{}", without.energy);
    for axis in 0..3 {
        for bias in [-5.0, 0.1, 1.0, 5.0] {
            let mut biases = [0.0; 3];
            biases[axis] = bias;
            let with = found(biases);
            // the bias is 17 times the rate, so that rounding errors are 1e-14
            assert!((with.energy / without.energy - 1.0).abs() < 1e-9, "{biases:?}: {with:?}");
            assert!((with.median / without.median - 1.0).abs() < 1e-9, "{biases:?}: {with:?}");
        }
    }
}

#[test]
fn half_of_a_circling_force_is_off_axis_and_none_of_a_tangential_force() {
    let turn = |k: usize| (k as f64 * std::f64::consts::TAU / 1000.0).sin_cos();
    let (sine, cosine): (Vec<f64>, Vec<f64>) = (0..1000).map(turn).unzip();
    let circle = OffAxis::from_forces(&sine, &cosine, &[3.0, 4.0]);
    // the median is between the fractions of two samples, which differ by 6e-3
    assert!((circle.energy - 0.5).abs() < 1e-12 && (circle.median - 0.5).abs() < 1e-2);
    assert!((circle.leakage - 12.5_f64.sqrt()).abs() < 1e-12);
    let line = OffAxis::from_forces(&[0.0; 1000], &cosine, &[]);
    assert_eq!(line, OffAxis::default());
}

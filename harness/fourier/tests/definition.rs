//! Compares Fourier transforms with the sum that defines them.

use std::f64::consts::TAU;

use fourier::{Complex64, Forward, Inverse};

#[test]
fn a_fourier_transform_equals_its_definition_and_is_inverted() {
    for length in [12, 15] {
        let signal: Vec<f64> = (0..length).map(|n| f64::from(n * n * 7 % 11) - 4.0).collect();
        let spectrum = Forward::new(length as usize).transform(signal.clone());
        assert_eq!(spectrum.len(), length as usize / 2 + 1);
        for (k, line) in spectrum.iter().enumerate() {
            let turn = |n: usize| Complex64::cis(-TAU * (k * n) as f64 / f64::from(length));
            let sum: Complex64 = signal.iter().enumerate().map(|(n, x)| x * turn(n)).sum();
            // the sum has fifteen terms below 7, each with two rounding errors
            assert!((line - sum).norm() < 1e-13, "line {k}: {line} instead of {sum}");
        }
        let back = Inverse::new(length as usize).transform(spectrum);
        for (found, x) in back.iter().zip(&signal) {
            assert!((found / f64::from(length) - x).abs() < 1e-14);
        }
    }
}

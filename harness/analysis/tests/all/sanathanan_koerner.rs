use nalgebra::{DMatrix, DVector};

use analysis::least_squares::smallest;
use analysis::sanathanan_koerner::{Coefficients, Line, fit};
use fourier::Complex64;

#[test]
fn a_transfer_function_is_recovered_from_spectra_that_contain_a_transient() {
    let plant = Coefficients { numerator: [0.4, 0.02, 0.35], denominator: [0.31, 1.1, 0.25] };
    // a transient has the poles of the plant
    let decay = Coefficients { numerator: [0.7, -1.0, 0.2], ..plant };
    let lines = |transient: f64| -> Vec<Line> {
        let line = |k: i32| {
            let s = Complex64::new(0.0, 0.5 + 0.05 * f64::from(k));
            let input = Complex64::from_polar(1.0, f64::from(k * k));
            let output = plant.response(s) * input + transient * decay.response(s);
            Line { s, input, output, scale: 1.0 }
        };
        (0..40).map(line).collect()
    };
    let solve = |a: DMatrix<f64>, b: DVector<f64>| Some((smallest(a, &b, 1e-14)?, ()));
    let error = |transient, fitted| {
        let (found, ()) = fit(&lines(transient), fitted, 10, solve).unwrap();
        let parts = |c: Coefficients| c.numerator.into_iter().chain(c.denominator);
        parts(found).zip(parts(plant)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    // for exact data the error is the rounding error times a condition number of some hundred
    assert!(error(0.0, false) < 1e-12 && error(0.3, true) < 1e-12);
    assert!(error(0.3, false) > 1e-3, "a transient that is left out spoils the fit");
    assert!(fit(&lines(0.0)[..8], true, 10, solve).is_none());
}

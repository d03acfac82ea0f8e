use identify::engine::fit::check_finite;
use identify::engine::minimum::Curvature;
use nalgebra::DMatrix;

#[test]
fn values_that_are_not_finite_are_named_and_no_iteration_hangs() {
    for (entry, words) in [
        (f64::NAN, "derivative by friction.d is NaN in row 4"),
        (f64::INFINITY, "derivative by friction.d is inf in row 4"),
        (f64::NEG_INFINITY, "derivative by friction.d is -inf in row 4"),
        (1e200, "with respect to friction.d are too large"),
    ] {
        let mut bad = DMatrix::from_fn(5, 2, |k, j| if j == 0 { 1.0 } else { k as f64 - 2.0 });
        bad[(3, 1)] = entry;
        let error = check_finite(bad.column(1).as_slice(), "friction.d").unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
        assert!(check_finite(bad.column(0).as_slice(), "hub.I").is_ok());
        let curvature = Curvature::new(&bad, vec![0, 1]);
        assert!(curvature.covariance(2).iter().all(|v| v.is_finite()));
        assert!(curvature.unresolved(&[0.0; 2]).is_empty());
    }
    // the unit of an unknown, and thus the size of its column, has no effect on the result
    for size in [1e-150, 1e-9, 1.0, 1e9, 1e150] {
        let line =
            DMatrix::from_fn(5, 2, |k, j| if j == 0 { size } else { (k as f64 - 2.0) * size });
        assert!(Curvature::new(&line, vec![0, 1]).unresolved(&[0.0, 0.0]).is_empty(), "{size}");
    }
}

#[test]
fn a_straight_line_has_its_textbook_covariance() {
    // y = a + b t at t = -2..2, unit noise: var a = 1/5, var b = 1/10, no correlation
    let line = DMatrix::from_fn(5, 2, |k, j| if j == 0 { 1.0 } else { k as f64 - 2.0 });
    let found = Curvature::new(&line, vec![0, 1]).covariance(2);
    assert!((found[(0, 0)] - 0.2).abs() < 1e-15 && (found[(1, 1)] - 0.1).abs() < 1e-15);
    assert!(found[(0, 1)].abs() < 1e-15);
    // two nearly equal columns determine only the sum, so that both variances must be large
    let alike = DMatrix::from_fn(5, 2, |k, j| 1.0 + if j == 0 { 1e-8 * k as f64 } else { 0.0 });
    let sure = Curvature::new(&alike, vec![0, 1]).covariance(2);
    let honest = Curvature::new(&alike, vec![0, 1]).with_flat(true).covariance(2);
    assert!(sure[(0, 0)] < 1.0 && honest[(0, 0)] > 1e10, "{sure} {honest}");
    let blind = DMatrix::from_fn(5, 2, |_, j| if j == 0 { 1.0 } else { 0.0 });
    let blind = Curvature::new(&blind, vec![0, 1]).with_flat(true).covariance(2);
    assert!((blind[(0, 0)] - 0.2).abs() < 1e-15 && blind[(1, 1)] == 0.0, "{blind}");
    // two equal columns cannot be distinguished
    let same = Curvature::new(&DMatrix::from_element(5, 2, 1.0), vec![0, 1]);
    assert_eq!(same.unresolved(&[0.0; 2]).len(), 1);
}

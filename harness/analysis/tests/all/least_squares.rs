use analysis::least_squares::{differences, minimise};

#[test]
fn the_least_squares_search_finds_the_minimum_of_rosenbrocks_function() {
    let residuals = |x: &[f64]| vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
    let derivatives = |x: &[f64]| Some(differences(&residuals, x, &[1e-5, 1e-5]));
    let found = minimise(&residuals, &derivatives, &[-1.2, 1.0]);
    // the residual at the minimum is 0, so that convergence is quadratic: the last step but one
    // was 1e-9 of x
    assert!(found.converged && (found.x[0] - 1.0).abs() + (found.x[1] - 1.0).abs() < 1e-8);
}

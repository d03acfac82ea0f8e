use identify::bench::verdict::probabilities;

#[test]
fn a_difference_of_10_in_minus_2_ln_l_makes_the_better_model_99_per_cent_probable() {
    let found = probabilities([-1000.0, -990.0].into_iter());
    assert!((found[0] - 1.0 / (1.0 + (-5f64).exp())).abs() < 1e-15 && found[0] > 0.99);
    assert!((found[0] + found[1] - 1.0).abs() < 1e-15);
}

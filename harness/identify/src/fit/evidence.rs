//! Comparison of models of the same recordings by the information criterion.

/// Probabilities of models by their information criterion, all equally probable beforehand (Kass and Raftery 1995):
/// exp(−BIC/2) over the sum.
pub fn probabilities(bic: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    let least = bic.clone().fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = bic.map(|b| (-(b - least) / 2.0).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| w / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_of_ten_in_the_criterion_is_a_probability_of_99_percent() {
        let found = probabilities([-1000.0, -990.0].into_iter());
        assert!((found[0] - 1.0 / (1.0 + (-5f64).exp())).abs() < 1e-15 && found[0] > 0.99);
        assert!((found[0] + found[1] - 1.0).abs() < 1e-15);
    }
}

//! Statistics of a signal's values.

/// Arithmetic mean.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Mean square about the mean.
pub fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64
}

/// Root mean square about the mean.
pub fn deviation(values: &[f64]) -> f64 {
    variance(values).sqrt()
}

/// Coefficient of correlation, −1 to 1.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let product: f64 = a.iter().zip(b).map(|(x, y)| (x - mean_a) * (y - mean_b)).sum();
    product / a.len() as f64 / (deviation(a) * deviation(b))
}

/// Largest magnitude; 0 of no values.
pub fn peak(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, v| largest.max(v.abs()))
}

/// The value below which this part of the values lies; `None` of no values.
pub fn quantile(values: &[f64], part: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((sorted.len() as f64 * part) as usize).copied()
}

/// The middle one of the values, of an even number the upper of two; `None` of no values.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_values_have_their_textbook_statistics() {
        let values = [1.0, -4.0, 2.0, 5.0];
        assert_eq!((mean(&values), variance(&values), peak(&values)), (1.0, 10.5, 5.0));
        assert_eq!((median(&values), quantile(&values, 0.2)), (Some(2.0), Some(-4.0)));
        assert!((correlation(&values, &[-1.0, 4.0, -2.0, -5.0]) + 1.0).abs() < 1e-15);
        assert!(median(&[]).is_none() && peak(&[]) == 0.0 && deviation(&values) == 10.5f64.sqrt());
    }
}

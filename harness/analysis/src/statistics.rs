pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

pub fn about_mean(values: &[f64]) -> Vec<f64> {
    let mean = mean(values);
    values.iter().map(|v| v - mean).collect()
}

pub fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64
}

pub fn deviation(values: &[f64]) -> f64 {
    variance(values).sqrt()
}

pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let product: f64 = a.iter().zip(b).map(|(x, y)| (x - mean_a) * (y - mean_b)).sum();
    product / a.len() as f64 / (deviation(a) * deviation(b))
}

pub fn peak(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, v| largest.max(v.abs()))
}

/// Returns the value below which the fraction `part` of `values` lies, for example the median for
/// 0.5, or `None` without values.
pub fn quantile(values: &[f64], part: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((sorted.len() as f64 * part) as usize).copied()
}

/// Returns the median of `values`, or `None` without values. For an even number of values it is the
/// larger of the two middle values.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// Returns the standard deviation of the white noise in a signal. It is computed from the third
/// differences of the signal, in which a motion of a few hertz almost vanishes. The result is at
/// least step/√12, which is the rounding error for the smallest step between two readings.
pub fn noise_level(signal: &[f64]) -> f64 {
    let third = signal.windows(4).map(|y| y[3] - 3.0 * y[2] + 3.0 * y[1] - y[0]);
    let squares: Vec<f64> = third.map(|d| d * d).collect();
    let steps = signal.windows(2).map(|y| (y[1] - y[0]).abs()).filter(|step| *step > 0.0);
    let smallest = steps.fold(f64::INFINITY, f64::min);
    let rounding = if smallest.is_finite() { smallest / 12f64.sqrt() } else { 0.0 };
    // The median of χ² with one degree of freedom is 0.4549; third differences have the variance 20 σ².
    let white = median(&squares).map_or(0.0, |s| (s / 0.4549 / 20.0).sqrt());
    white.max(rounding)
}

/// Returns the mean of each window of `width` successive values.
pub fn running_mean(x: &[f64], width: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    x.iter().for_each(|x| sums.push(sums[sums.len() - 1] + x));
    (width..sums.len()).map(|end| (sums[end] - sums[end - width]) / width as f64).collect()
}

//! Statistics of a gyro's record at rest: Allan variances, and checks whether the noise is normal, white and stationary, which
//! Allan variances assume (thesis 5.5.3). The checks are quantiles, histogram and Kolmogorov–Smirnov distance compared with
//! the normal distribution, autocorrelation, and statistics of chunks.

use fourier::{Forward, Inverse};

use crate::allan::{self, Fit, Octaves, Point};
use crate::statistics::{deviation, mean, variance};

const QUANTILES: usize = 200;
const CHUNKS: usize = 1000;
/// Range of the histogram to both sides of the mean, and the usual width of its bins, both in
/// standard deviations of the readings.
const BINS: (f64, f64) = (5.0, 0.1);
/// Limit that the Kolmogorov–Smirnov distance of normal noise exceeds with a probability of 5 %
/// (Stephens, J. Am. Stat. Assoc. 69, 1974, table 1A, case 3, in which mean and variance are
/// estimated from the data).
pub const KOLMOGOROV: f64 = 0.895;

/// Statistics of a record of a gyro at rest.
///
/// - `mean`: the gyro's bias, rad/s.
/// - `trend`: slope of the straight line that fits best, rad/s².
/// - `deviation`, `skewness`, `kurtosis`: standard deviation (rad/s), skewness and excess kurtosis
///   of the samples minus this line.
/// - `quantum`: smallest change of the reading, rad/s, which is its quantisation.
/// - `histogram`: centre and density of each bin, for the samples minus the line, divided by their
///   standard deviation.
/// - `quantiles`: pairs of a standard normal quantile and the quantile of these samples for the
///   same probability.
/// - `autocorrelation`: at lags of 0, 1, … steps.
/// - `allan`: Allan variances, (rad/s)².
/// - `noise`: the noise that was fitted to them ([`Octaves::describe`]).
#[derive(Clone, Debug)]
pub struct Rest {
    pub step: f64,
    pub count: usize,
    pub mean: f64,
    pub trend: f64,
    pub deviation: f64,
    pub skewness: f64,
    pub kurtosis: f64,
    pub quantum: f64,
    pub histogram: Vec<(f64, f64)>,
    pub allan: Vec<Point>,
    pub noise: Option<Fit>,
    pub quantiles: Vec<(f64, f64)>,
    pub autocorrelation: Vec<f64>,
    pub chunks: Vec<Chunk>,
}

/// Statistics of a part of the record of a gyro at rest.
///
/// - `kolmogorov`: Kolmogorov–Smirnov distance of the readings from the normal distribution with
///   their mean and variance, multiplied by √n − 0.01 + 0.85/√n for n readings (Stephens).
///   Quantisation with the step Δ raises the distance of normal readings with the standard
///   deviation σ to about Δ √n/(2σ√(2π)).
/// - `between_levels`: Kolmogorov–Smirnov distance as in `kolmogorov`, but evaluated only midway
///   between the levels of the readings, where quantisation has no effect. The variance of the
///   readings is reduced by the variance of the quantisation error, Δ²/12 (Sheppard).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chunk {
    pub from: f64,
    pub mean: f64,
    pub variance: f64,
    pub kolmogorov: f64,
    pub between_levels: f64,
}

impl Rest {
    /// Analyses a record of a gyro at rest. `samples` are rates, rad/s, `step` seconds apart.
    /// Statistics of parts are computed for chunks of `chunk` seconds, and the autocorrelation up
    /// to a lag of `lag` seconds.
    pub fn analyse(step: f64, samples: &[f64], chunk: f64, lag: f64) -> Rest {
        let n = samples.len() as f64;
        let middle = (n - 1.0) / 2.0;
        let level = mean(samples);
        let (mut products, mut squares) = (0.0, 0.0);
        for (k, sample) in samples.iter().enumerate() {
            let t = k as f64 - middle;
            products += t * (sample - level);
            squares += t * t;
        }
        let slope = if squares > 0.0 { products / squares } else { 0.0 };
        let detrended: Vec<f64> = (samples.iter().enumerate())
            .map(|(k, sample)| sample - level - slope * (k as f64 - middle))
            .collect();
        let sigma = deviation(&detrended);
        let moment =
            |power: i32| detrended.iter().map(|x| (x / sigma).powi(power)).sum::<f64>() / n;
        let changes = samples.windows(2).map(|y| (y[1] - y[0]).abs()).filter(|d| *d > 0.0);
        let quantum = changes.fold(f64::INFINITY, f64::min);
        let quantum = if quantum.is_finite() { quantum } else { 0.0 };
        let mut sorted = detrended.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let count = QUANTILES.min(samples.len());
        let quantiles = (0..count)
            .map(|k| {
                let part = (k as f64 + 0.5) / count as f64;
                (normal_quantile(part), sorted[(part * n) as usize] / sigma)
            })
            .collect();
        let length = ((chunk / step).round() as usize).max(2).max(samples.len() / CHUNKS);
        let chunks = (detrended.chunks_exact(length).enumerate())
            .map(|(k, part)| Chunk {
                from: (k * length) as f64 * step,
                mean: mean(part),
                variance: variance(part),
                kolmogorov: kolmogorov(&samples[k * length..(k + 1) * length]),
                between_levels: between_levels(&samples[k * length..(k + 1) * length], quantum),
            })
            .collect();
        let allan = allan::variances(step, samples);
        Rest {
            step,
            count: samples.len(),
            mean: level,
            trend: slope / step,
            deviation: sigma,
            skewness: moment(3),
            kurtosis: moment(4) - 3.0,
            quantum,
            histogram: histogram(&sorted, sigma, quantum),
            noise: Octaves::from_samples(step, samples).describe(),
            allan,
            quantiles,
            autocorrelation: autocorrelation(&detrended, (lag / step).round() as usize),
            chunks,
        }
    }

    /// Returns the variance of the samples divided by the variance of their quantisation error,
    /// Δ²/12 with the quantisation step Δ. It is infinite if the samples are not quantised.
    pub fn quantisation_ratio(&self) -> f64 {
        12.0 * (self.deviation / self.quantum).powi(2)
    }

    /// Counts the chunks whose readings are not normal, because their Kolmogorov–Smirnov distance
    /// exceeds [`KOLMOGOROV`]. The first count uses the distance at all readings, the second the
    /// distance midway between the levels of quantised readings.
    pub fn not_normal(&self) -> [usize; 2] {
        let count =
            |of: fn(&Chunk) -> f64| self.chunks.iter().filter(|c| of(c) > KOLMOGOROV).count();
        [count(|chunk| chunk.kolmogorov), count(|chunk| chunk.between_levels)]
    }

    pub fn white_bound(&self) -> f64 {
        1.96 / (self.count as f64).sqrt()
    }

    /// Returns the fraction of the lags, except lag 0, at which the autocorrelation is outside the
    /// 95 % interval of white noise. For white noise this fraction is about 0.05.
    pub fn outside(&self) -> f64 {
        let rest = &self.autocorrelation[1..];
        let out = rest.iter().filter(|r| r.abs() > self.white_bound()).count();
        out as f64 / rest.len().max(1) as f64
    }

    /// Returns the standard deviation of the means of chunks of `chunk` samples, and the standard
    /// deviation of the variances of these chunks. Each is divided by the value that is expected
    /// for white, stationary, normal noise. A ratio far above 1 therefore shows that the noise is
    /// not white or not stationary.
    pub fn scatter(&self, chunk: usize) -> [f64; 2] {
        let means: Vec<f64> = self.chunks.iter().map(|chunk| chunk.mean).collect();
        let variances: Vec<f64> = self.chunks.iter().map(|chunk| chunk.variance).collect();
        let n = chunk as f64;
        [
            deviation(&means) / (self.deviation / n.sqrt()),
            deviation(&variances) / (self.deviation.powi(2) * (2.0 / n).sqrt()),
        ]
    }

    pub fn chunk_length(&self) -> usize {
        self.chunks.get(1).map_or(self.count, |second| (second.from / self.step).round() as usize)
    }
}

/// Returns the autocorrelation of a signal with zero mean, Σ x_k x_{k+m} / Σ x_k², at lags m from 0
/// to `lags` steps. It is 0 for a signal of zeros.
pub fn autocorrelation(signal: &[f64], lags: usize) -> Vec<f64> {
    let lags = lags.clamp(1, signal.len() - 1);
    let length = (signal.len() + lags + 1).next_power_of_two();
    let mut padded = signal.to_vec();
    padded.resize(length, 0.0);
    let mut spectrum = Forward::new(length).transform(padded);
    for line in &mut spectrum {
        *line = (line.norm_sqr()).into();
    }
    let sums = Inverse::new(length).transform(spectrum);
    let power = sums[0].max(f64::MIN_POSITIVE);
    sums[..=lags].iter().map(|sum| sum / power).collect()
}

fn normal(x: f64) -> f64 {
    0.5 * libm::erfc(-x / std::f64::consts::SQRT_2)
}

fn modified(distance: f64, n: f64) -> f64 {
    distance * (n.sqrt() - 0.01 + 0.85 / n.sqrt())
}

fn kolmogorov(samples: &[f64]) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (n, level, sigma) = (samples.len() as f64, mean(samples), deviation(samples));
    let distance = sorted.iter().enumerate().map(|(k, sample)| {
        let below = normal((sample - level) / sigma);
        (below - k as f64 / n).max((k + 1) as f64 / n - below)
    });
    modified(distance.fold(0.0, f64::max), n)
}

fn between_levels(samples: &[f64], quantum: f64) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (n, level) = (samples.len() as f64, mean(samples));
    let sigma = (variance(samples) - quantum * quantum / 12.0).max(0.0).sqrt();
    let distance =
        sorted.windows(2).enumerate().filter(|(_, pair)| pair[1] > pair[0]).map(|(k, pair)| {
            (normal((0.5 * (pair[0] + pair[1]) - level) / sigma) - (k + 1) as f64 / n).abs()
        });
    modified(distance.fold(0.0, f64::max), n)
}

fn histogram(sorted: &[f64], sigma: f64, quantum: f64) -> Vec<(f64, f64)> {
    let (most, usual) = BINS;
    let step = quantum / sigma;
    let width = if step > 0.01 { step * (usual / step).ceil() } else { usual };
    let bins = (most / width).ceil() as i64;
    let n = sorted.len() as f64;
    let below = |x: f64| sorted.partition_point(|sample| sample / sigma < x) as f64;
    (-bins..=bins)
        .map(|k| {
            let middle = k as f64 * width;
            (middle, (below(middle + 0.5 * width) - below(middle - 0.5 * width)) / n / width)
        })
        .collect()
}

/// Returns the value below which a standard normal variable lies with the probability `part`, which
/// is between 0 and 1. It is computed by Newton's method from the complementary error function.
pub fn normal_quantile(part: f64) -> f64 {
    let mut x = 0.0;
    for _ in 0..60 {
        let error = normal(x) - part;
        let density = (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        // Steps of at most one standard deviation, because the tangent is flat far from the centre.
        let by = (error / density).clamp(-1.0, 1.0);
        x -= by;
        if by.abs() < 1e-14 {
            break;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn white_normal_noise_on_a_linear_trend_is_recognised() {
        let mut random = Random::new(1, 0);
        let samples: Vec<f64> =
            (0..100_000).map(|k| 1e-3 + 1e-9 * f64::from(k) + 4e-4 * random.normal()).collect();
        let rest = Rest::analyse(0.02, &samples, 100.0, 10.0);
        // standard errors: mean of a line 4e-4/√1e5 = 1.3e-6, slope √12 σ/(n √n h) = 2.2e-9/s
        assert!((rest.mean - 1.05e-3).abs() < 4e-6 && (rest.trend - 5e-8).abs() < 7e-9, "{rest:?}");
        assert!((rest.deviation / 4e-4 - 1.0).abs() < 0.01);
        assert!(rest.skewness.abs() < 0.03 && rest.kurtosis.abs() < 0.06);
        assert_eq!((rest.chunks.len(), rest.autocorrelation.len()), (20, 501));
        // on average 5 % of the 500 lags are outside, with a standard deviation of 1 %
        assert!(rest.outside() < 0.09, "{}", rest.outside());
        // with 20 chunks a standard deviation is known to 1/√40 = 16 %
        let scatter = rest.scatter(rest.chunk_length());
        assert!(scatter.iter().all(|s| (0.5..1.5).contains(s)), "{scatter:?}");
        // quantiles between ±2 are accurate to 5e-3
        let off = rest.quantiles.iter().filter(|(x, _)| x.abs() < 2.0).map(|(x, y)| (x - y).abs());
        assert!(off.fold(0.0, f64::max) < 0.03);
    }

    /// The samples imitate the gyro of Rubaga's thesis: normal noise of 0.4 mrad/s, rounded to
    /// steps of 0.15 mrad/s.
    #[test]
    fn quantised_normal_noise_is_normal_between_its_levels() {
        let mut random = Random::new(3, 0);
        let step = 1.53e-4;
        let samples: Vec<f64> =
            (0..90_000).map(|_| (4.066e-4 * random.normal() / step).round() * step).collect();
        let rest = Rest::analyse(0.02, &samples, 180.0, 1.0);
        assert!((rest.quantum / step - 1.0).abs() < 1e-9);
        // (σ² + Δ²/12)/(Δ²/12); the simulated noise determines it to √(2/n) = 0.5 %
        let expected = 1.0 + 12.0 * (4.066e-4_f64 / step).powi(2);
        assert!((rest.quantisation_ratio() / expected - 1.0).abs() < 0.02);
        // of 10 chunks with normal noise, at most 1 exceeds the limit with a probability of 0.91, and at most 3 with 0.999
        let [read, between] = rest.not_normal();
        assert!(read == 10 && between <= 3, "{read} {between}: {:?}", rest.chunks);
        // Δ √n/(2σ√(2π)) with n = 9,000, plus a random part below 1
        let jump = 9000f64.sqrt() * step / (2.0 * 4.066e-4 * std::f64::consts::TAU.sqrt());
        assert!(
            rest.chunks.iter().all(|c| (c.kolmogorov - jump).abs() < 1.0),
            "{jump} {:?}",
            rest.chunks
        );
        let sum: f64 = rest.histogram.windows(2).map(|b| (b[1].0 - b[0].0) * b[1].1).sum();
        assert!((sum - 1.0).abs() < 0.01, "{sum}");
        // with an exponential distribution both distances exceed the limit
        let skew: Vec<f64> = samples.iter().map(|x| (x / 4e-4).exp() * 1e-4).collect();
        assert_eq!(Rest::analyse(0.02, &skew, 180.0, 1.0).not_normal(), [10, 10]);
    }

    #[test]
    fn the_autocorrelation_of_sums_of_adjacent_white_samples_is_one_half_at_lag_1() {
        let mut random = Random::new(2, 0);
        let white: Vec<f64> = (0..50_001).map(|_| random.normal()).collect();
        let sums: Vec<f64> = white.windows(2).map(|x| x[0] + x[1]).collect();
        let rest = Rest::analyse(1.0, &sums, 100.0, 3.0);
        // the standard error of an autocorrelation is 1/√5e4 = 4.5e-3
        assert!(
            (rest.autocorrelation[1] - 0.5).abs() < 0.02 && rest.autocorrelation[2].abs() < 0.03
        );
        assert!(rest.scatter(100)[0] > 1.2);
    }

    #[test]
    fn the_normal_quantiles_equal_those_of_the_tables() {
        for (part, x) in
            [(0.5, 0.0), (0.975, 1.959_963_984_540_054), (1e-6, -4.753_424_308_822_899)]
        {
            assert!((normal_quantile(part) - x).abs() < 1e-10, "{part}");
        }
    }
}

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

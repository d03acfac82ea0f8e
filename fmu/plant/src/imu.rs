//! The rate gyro on the hub: samples the hub's rate, adds white noise, a Gauss-Markov bias, flicker
//! noise and a rate random walk, quantises, and holds the value until the next sample.
//!
//! White noise has the standard deviation sigma = N sqrt(rate) in each sample, where N is the angle random walk (Allan
//! coefficient). The bias is a Gauss-Markov process of first order, with sigma_b = B/0.664 and the correlation time
//! `bias_time` (Rubaga's thesis, section 5.5; IEEE Std 952). The random numbers of sample k depend only on the seed and k,
//! so that a restored state continues with the same noise.
//!
//! Flicker noise is the sum of [`FLICKERS`] Gauss-Markov processes of equal variance sigma², whose correlation times T grow
//! by the factor q = [`RATIO`]. The sum of their one-sided spectra 4 sigma² T/(1 + (2 pi f T)²) is sigma²/(f ln q) with a
//! ripple of 2/cosh(pi²/ln q) = 1.6 %. For sigma² = B² ln q/pi it equals B²/(pi f), the flicker noise of the bias
//! instability B. The rate random walk adds K/sqrt(rate) times a normal random number in each sample.

use crate::parameters::Imu;

/// Fraction of a sampling period by which a sample may be taken early, because communication points match sampling times only
/// up to rounding.
const SLACK: f64 = 1e-6;

pub(crate) const FLICKERS: usize = 8;
const RATIO: f64 = 6.0;
/// Shortest correlation time of the processes that make up the flicker noise, s. Shorter times are not needed, because at 0.1
/// s the white noise of a gyro is far larger than its flicker noise.
const SHORTEST: f64 = 0.1;

/// State of the gyro. `next` is the number of the next sample; sample k is taken k/rate seconds after the start. `held` is
/// the reading until then. The bias, the rate random walk `walk` and the processes of the `flicker` noise have the values
/// for the next sample. All values are in rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gyro {
    pub next: u64,
    pub bias: f64,
    pub held: f64,
    pub walk: f64,
    pub flicker: [f64; FLICKERS],
}

impl Imu {
    pub(crate) fn start(&self) -> Gyro {
        let (spread, _) = normals(self.seed, u64::MAX);
        let bias = self.bias_instability / 0.664 * spread;
        let mut gyro = Gyro { next: 0, bias, held: 0.0, walk: 0.0, flicker: [0.0; FLICKERS] };
        if self.flicker > 0.0 {
            self.each_flicker(&mut gyro.flicker, u64::MAX, |_| 0.0);
        }
        gyro
    }

    /// Takes all samples of the gyro that are due within the next `length` seconds, and returns their number. `since_start`
    /// is the time at the beginning, s since the start of the simulation; `omega` returns the hub's rate at a time after this
    /// beginning. The function stops after one sample more than `allowed`, so that the caller can refuse the step.
    pub(crate) fn follow(
        &self,
        gyro: &mut Gyro,
        since_start: f64,
        length: f64,
        omega: impl Fn(f64) -> f64,
        allowed: usize,
    ) -> usize {
        for taken in 0..=allowed {
            let due = self.due(gyro.next, since_start);
            if due > length {
                return taken;
            }
            self.sample(gyro, omega(due.max(0.0)));
        }
        allowed + 1
    }

    /// Returns the time, s, that is left until sample `k` is due, at the time `since_start` (s since the start). It is
    /// negative if the sample is overdue.
    #[inline(always)]
    pub(crate) fn due(&self, k: u64, since_start: f64) -> f64 {
        k as f64 / self.rate - since_start
    }

    /// Returns true if a sample that is due in `due` seconds can be taken now. A small difference is allowed, because
    /// communication points and time events match sampling times only up to rounding and up to the `resolution` of the
    /// simulation time, s.
    #[inline(always)]
    pub(crate) fn is_due(&self, due: f64, resolution: f64) -> bool {
        due <= SLACK / self.rate + resolution
    }

    pub(crate) fn sample(&self, gyro: &mut Gyro, omega: f64) {
        let (white, drift) = normals(self.seed, gyro.next);
        let mut reading = omega + gyro.bias + self.arw * libm::sqrt(self.rate) * white;
        if self.flicker > 0.0 {
            reading += gyro.flicker.iter().sum::<f64>();
            self.each_flicker(&mut gyro.flicker, gyro.next, |time| {
                libm::exp(-1.0 / (self.rate * time))
            });
        }
        if self.rrw > 0.0 {
            reading += gyro.walk;
            gyro.walk += self.rrw / libm::sqrt(self.rate) * normal_pair(self.seed, 1, gyro.next).0;
        }
        // A quantisation step that is smaller than the rounding error of the reading would have no effect and is not applied.
        let seen = reading.abs() < 1e16 * self.lsb;
        gyro.held = if seen { libm::rint(reading / self.lsb) * self.lsb } else { reading };
        let keep = libm::exp(-1.0 / (self.rate * self.bias_time));
        let spread = self.bias_instability / 0.664 * libm::sqrt(1.0 - keep * keep);
        gyro.bias = keep * gyro.bias + spread * drift;
        gyro.next += 1;
    }

    /// Advances the processes `all`, whose sum is the flicker noise, by one sample, which has the number `k`. `keep`
    /// receives the correlation time of a process, s, and returns the factor by which its value decays in one sampling
    /// period. A new random number then restores the variance of the process.
    fn each_flicker(&self, all: &mut [f64; FLICKERS], k: u64, keep: impl Fn(f64) -> f64) {
        let sigma = self.flicker * libm::sqrt(libm::log(RATIO) / core::f64::consts::PI);
        let mut time = SHORTEST;
        for (pair, stream) in all.as_chunks_mut::<2>().0.iter_mut().zip(2..) {
            let (first, second) = normal_pair(self.seed, stream, k);
            for (process, normal) in pair.iter_mut().zip([first, second]) {
                let keep = keep(time);
                *process = keep * *process + sigma * libm::sqrt(1.0 - keep * keep) * normal;
                time *= RATIO;
            }
        }
    }
}

/// Returns two independent standard normal random numbers for the sample number `k`. They depend only on the seed and on k,
/// so that they are the same for every sequence of steps. The method is the Box–Muller transform of two uniform numbers from
/// the SplitMix64 mixer.
fn normals(seed: i32, k: u64) -> (f64, f64) {
    normal_pair(seed, 0, k)
}

fn normal_pair(seed: i32, stream: u64, k: u64) -> (f64, f64) {
    let stream = mix(seed as u32 as u64 | stream << 32);
    let uniform = |j: u64| {
        let bits = mix(stream ^ mix(k.wrapping_mul(2).wrapping_add(j)));
        ((bits >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    };
    let radius = libm::sqrt(-2.0 * libm::log(uniform(0)));
    let (sin, cos) = libm::sincos(core::f64::consts::TAU * uniform(1));
    (radius * cos, radius * sin)
}

/// Returns the next number of the generator SplitMix64 after the state `x` (Steele, Lea and Flood 2014).
fn mix(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_random_numbers_of_the_gyro_have_unit_variance_and_no_correlation() {
        const COUNT: usize = 200_000;
        let all: Vec<(f64, f64)> = (0..COUNT as u64).map(|k| normals(7, k)).collect();
        let mean = |f: &dyn Fn(usize) -> f64| (0..COUNT).map(f).sum::<f64>() / COUNT as f64;
        // The standard errors are 1/sqrt(COUNT) = 0.0022 for means and correlations, and sqrt(2) times as large for the variance.
        // The test allows five standard errors, which chance practically never exceeds.
        assert!(mean(&|k| all[k].0).abs() < 0.012);
        assert!((mean(&|k| all[k].0 * all[k].0) - 1.0).abs() < 0.016);
        assert!((mean(&|k| all[k].1 * all[k].1) - 1.0).abs() < 0.016);
        assert!(mean(&|k| all[k].0 * all[k].1).abs() < 0.012);
        assert!(mean(&|k| all[k].0 * all[(k + 1) % COUNT].0).abs() < 0.012);
    }

    #[test]
    fn a_gyro_bias_has_the_specified_standard_deviation() {
        let imu = Imu { bias_time: 1.0, arw: 0.0, ..Imu::default() };
        let mut gyro = imu.start();
        let mut sum = 0.0;
        const COUNT: usize = 500_000; // 10,000 correlation times
        for _ in 0..COUNT {
            imu.sample(&mut gyro, 0.0);
            sum += gyro.held * gyro.held;
        }
        let spread = (sum / COUNT as f64).sqrt();
        // The relative standard error of the standard deviation is 1/sqrt(10,000) = 1 %; the test allows four.
        assert!((spread / (imu.bias_instability / 0.664) - 1.0).abs() < 0.04);
    }

    #[test]
    fn gyro_readings_are_multiples_of_the_quantisation_step() {
        let imu = Imu { lsb: 1e-3, ..Imu::default() };
        let mut gyro = imu.start();
        imu.sample(&mut gyro, 0.012_3);
        let steps = gyro.held / imu.lsb;
        assert!((steps - steps.round()).abs() < 1e-9);
        assert!((gyro.held - 0.012_3).abs() < 2.5e-3, "within noise and half a step");
        for lsb in [0.0, 1e-300, f64::from_bits(1)] {
            let fine = Imu { lsb, ..imu };
            let mut gyro = fine.start();
            fine.sample(&mut gyro, 0.012_3);
            assert!((gyro.held - 0.012_3).abs() < 2e-3, "within noise");
        }
    }

    fn clean(rate: f64) -> Imu {
        Imu { rate, arw: 0.0, bias_instability: 0.0, lsb: 0.0, ..Imu::default() }
    }

    /// Returns the Allan variance of the readings of a gyro at rest, for averages of `m` samples, as the mean over `seeds`
    /// seeds.
    fn allan_variance(imu: Imu, seeds: i32, m: usize) -> f64 {
        let mut sum = 0.0;
        for seed in 0..seeds {
            let imu = Imu { seed, ..imu };
            let mut gyro = imu.start();
            let mut mean = || {
                let total: f64 = (0..m)
                    .map(|_| {
                        imu.sample(&mut gyro, 0.0);
                        gyro.held
                    })
                    .sum();
                total / m as f64
            };
            let (first, second) = (mean(), mean());
            sum += (second - first) * (second - first) / 2.0;
        }
        sum / f64::from(seeds)
    }

    #[test]
    #[ignore = "ten seconds of CPU time: .ci/long-tests"]
    fn flicker_noise_has_a_flat_allan_deviation_over_a_thousand_samples() {
        let flicker = Imu { flicker: 1e-3, ..clean(10.0) };
        let flat = 2.0 * core::f64::consts::LN_2 / core::f64::consts::PI * 1e-6;
        let found = allan_variance(flicker, 10_000, 1000);
        assert!((found / flat - 1.0).abs() < 0.07, "{}", found / flat);
    }

    #[test]
    fn flicker_noise_has_a_flat_allan_deviation_and_the_random_walk_a_rising_one() {
        // There is one pair of averages for each of 10,000 seeds, so that the standard error is √(2/10,000) = 1.4 %. The
        // test allows four of them and the ripple.
        let flicker = Imu { flicker: 1e-3, ..clean(10.0) };
        let flat = 2.0 * core::f64::consts::LN_2 / core::f64::consts::PI * 1e-6;
        for m in [10, 100] {
            let found = allan_variance(flicker, 10_000, m);
            assert!((found / flat - 1.0).abs() < 0.07, "{m}: {}", found / flat);
        }
        let walk = Imu { rrw: 1e-3, ..clean(10.0) };
        for m in [10, 100] {
            // The expected variance is K² τ/3, times 1 + 1/(2 m²) because the random walk has steps.
            let expected = 1e-6 * m as f64 * 0.1 / 3.0 * (1.0 + 0.5 / (m * m) as f64);
            let found = allan_variance(walk, 10_000, m);
            assert!((found / expected - 1.0).abs() < 0.06, "{m}: {}", found / expected);
        }
    }

    #[test]
    fn white_noise_and_bias_of_the_gyro_do_not_depend_on_the_rate_random_walk() {
        let imu = Imu { lsb: 0.0, ..Imu::default() };
        let (mut gyro, mut slow) = (imu.start(), Imu { rrw: 1e-9, ..imu }.start());
        for _ in 0..100 {
            imu.sample(&mut gyro, 0.1);
            Imu { rrw: 1e-9, ..imu }.sample(&mut slow, 0.1);
            assert_eq!((gyro.walk, gyro.flicker, gyro.bias), (0.0, [0.0; FLICKERS], slow.bias));
            assert!((gyro.held - slow.held).abs() < 1e-7);
        }
        assert!(slow.walk != 0.0);
    }

    #[test]
    fn white_noise_of_a_sample_is_the_random_walk_times_the_root_of_the_rate() {
        for rate in [50.0, 200.0] {
            let imu = Imu { arw: 1e-3, ..clean(rate) };
            let mut gyro = imu.start();
            let mut sum = 0.0;
            const COUNT: usize = 40_000;
            for _ in 0..COUNT {
                imu.sample(&mut gyro, 2.0);
                sum += (gyro.held - 2.0) * (gyro.held - 2.0);
            }
            let spread = (sum / COUNT as f64).sqrt();
            // The relative standard error is 1/sqrt(2 COUNT) = 0.35 %; the test allows four.
            assert!((spread / (1e-3 * rate.sqrt()) - 1.0).abs() < 0.014, "{rate} {spread}");
        }
    }

    /// At rest a reading consists of the rate, the bias and the noise. The noise is a multiple of the first of the two random
    /// numbers that belong to the seed and the sample; the second number drives the bias.
    #[test]
    fn a_gyro_reading_is_the_sum_of_rate_bias_and_the_noise_of_its_seed() {
        let imu = Imu { arw: 1e-3, bias_instability: 0.664e-3, bias_time: 0.1, ..clean(25.0) };
        let mut gyro = imu.start();
        for k in 0..4 {
            assert_eq!(gyro.next, k);
            let ((white, drift), bias) = (normals(imu.seed, k), gyro.bias);
            imu.sample(&mut gyro, 0.5);
            assert!((gyro.held - 0.5 - bias - 5e-3 * white).abs() < 1e-16, "{k}");
            // The fraction e^(-1/2.5) of the bias remains, and its standard deviation stays 1 mrad/s.
            let keep = libm::exp(-0.4);
            let next = keep * bias + 1e-3 * libm::sqrt(1.0 - keep * keep) * drift;
            assert!((gyro.bias - next).abs() < 1e-17, "{k}");
        }
    }

    #[test]
    fn the_initial_gyro_bias_has_the_specified_standard_deviation_and_correlation_time() {
        const COUNT: i32 = 40_000;
        // One sampling period is one correlation time, so that exp(-1) of the bias remains.
        let imu = Imu { bias_instability: 1e-3, bias_time: 0.1, ..clean(10.0) };
        let (mut first, mut product) = (0.0, 0.0);
        for seed in 0..COUNT {
            let imu = Imu { seed, ..imu };
            let mut gyro = imu.start();
            let start = gyro.bias;
            imu.sample(&mut gyro, 0.0);
            assert_eq!(gyro.held, start, "the reading must contain the bias");
            (first, product) = (first + start * start, product + start * gyro.bias);
        }
        let variance = first / f64::from(COUNT);
        // The test allows four standard errors: sqrt(2/COUNT) for the variance, and 1/sqrt(COUNT) for the correlation.
        assert!((variance / (1e-3 / 0.664f64).powi(2) - 1.0).abs() < 0.028, "{variance}");
        assert!((product / first - (-1.0f64).exp()).abs() < 0.02, "{}", product / first);
    }

    #[test]
    fn the_random_numbers_of_the_gyro_equal_splitmix64() {
        assert_eq!(mix(0), 0xE220_A839_7B1D_CDAF);
        assert_eq!(mix(1_234_567), 6_457_827_717_110_365_317);
        let [(a, b), (c, d)] = [normals(1, 0), normals(-3, 12)];
        let known = [
            0.462_029_024_044_276_5,
            -0.416_131_221_726_402_5,
            1.419_565_558_308_071_5,
            -0.952_311_423_782_375_5,
        ];
        for (got, known) in [a, b, c, d].into_iter().zip(known) {
            assert!((got - known).abs() < 1e-15, "{got} {known}");
        }
    }

    #[test]
    fn gyro_sample_k_is_taken_k_periods_after_the_start() {
        let imu = clean(50.0);
        let mut gyro = imu.start();
        imu.sample(&mut gyro, 0.0);
        // From 13 ms on, 0.1 s contain the samples at 20, 40, ... 100 ms, when the rate is 7, 27, ... 87
        // ms after the beginning.
        assert_eq!(imu.follow(&mut gyro, 0.013, 0.1, |t| 2.0 + t, 9), 5);
        assert_eq!((gyro.next, gyro.held), (6, 2.0 + (0.1 - 0.013)));
        // Within a step no sample is taken early. At the end of a step a sample may be early by a millionth of a period
        // plus the clock's resolution.
        assert_eq!(imu.follow(&mut gyro.clone(), 0.1, 0.02 * (1.0 - 1e-9), |t| t, 9), 0);
        assert!(imu.is_due(0.9e-6 * 0.02, 0.0) && !imu.is_due(1.1e-6 * 0.02, 0.0));
        assert!(imu.is_due(1.1e-6 * 0.02, 0.2e-6 * 0.02) && imu.is_due(-1.0, 0.0));
        // An overdue sample uses the rate at the beginning of the step. At most one sample more than allowed is taken.
        assert_eq!(imu.follow(&mut gyro.clone(), 0.121, 0.01, |t| 3.0 + t, 9), 1);
        let mut late = gyro;
        imu.follow(&mut late, 0.121, 0.01, |t| 3.0 + t, 9);
        assert_eq!(late.held, 3.0);
        assert_eq!(imu.follow(&mut gyro, 0.1, 10.0, |_| 0.0, 7), 8);
        assert_eq!(gyro.next, 6 + 8);
    }

    #[test]
    fn a_gyro_reading_is_rounded_to_the_nearest_quantisation_step() {
        let imu = Imu { lsb: 1e-3, ..clean(50.0) };
        for (rate, steps) in [(0.012_3, 12.0), (0.012_7, 13.0), (-0.012_7, -13.0)] {
            let mut gyro = imu.start();
            imu.sample(&mut gyro, rate);
            assert_eq!(gyro.held, steps * 1e-3);
        }
        // A reading beyond 2^53 quantisation steps cannot be rounded.
        let mut gyro = imu.start();
        imu.sample(&mut gyro, 1.1e13);
        assert_eq!(gyro.held, 1.1e13);
    }
}

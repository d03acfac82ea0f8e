//! The rate gyro on the hub: samples the hub's rate, adds white noise and a Gauss-Markov bias,
//! quantises, and holds the value until the next sample.
//!
//! White noise per sample sigma = N sqrt(rate) (N as an Allan coefficient). The bias is of first
//! order, with sigma_b = B/0.664 and correlation time `bias_time` (thesis 5.5; IEEE Std 952). The
//! noise of sample k is a function of only the seed and k, so a restored state continues with the
//! same noise.

use crate::parameters::Imu;

/// Part of a sampling period by which a sample may be early. Communication points and time events
/// match sampling instants only to the rounding of the host's clock.
pub(crate) const SLACK: f64 = 1e-6;

/// State of the gyro.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gyro {
    /// Index of the next sample; sample k is taken k / rate after the start.
    pub next: u64,
    /// Bias of the next sample, rad/s.
    pub bias: f64,
    /// The value held, rad/s.
    pub held: f64,
}

impl Imu {
    /// Returns the gyro before its first sample, with a bias from its stationary distribution.
    pub(crate) fn start(&self) -> Gyro {
        let (spread, _) = normals(self.seed, u64::MAX);
        Gyro { next: 0, bias: self.bias_instability / 0.664 * spread, held: 0.0 }
    }

    /// Takes the samples that fall due within `length` from `since_start` on, both s, but at most
    /// one more than `allowed`. `omega` is the hub's rate as a function of the time within
    /// `length`. Returns the number of samples.
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
            if !self.falls_within(due, length) {
                return taken;
            }
            self.sample(gyro, omega(due.max(0.0).min(length)));
        }
        allowed + 1
    }

    /// Returns the delay until sample k, s, at `since_start` seconds after the start.
    #[inline(always)]
    pub(crate) fn due(&self, k: u64, since_start: f64) -> f64 {
        k as f64 / self.rate - since_start
    }

    /// Returns true if a sample is due within `length`, s, up to rounding.
    #[inline(always)]
    pub(crate) fn falls_within(&self, due: f64, length: f64) -> bool {
        due <= length + SLACK / self.rate
    }

    /// Takes the next sample of the rate `omega`.
    pub(crate) fn sample(&self, gyro: &mut Gyro, omega: f64) {
        let (white, drift) = normals(self.seed, gyro.next);
        let reading = omega + gyro.bias + self.arw * libm::sqrt(self.rate) * white;
        // Quantisation steps below rounding have no effect.
        let seen = reading.abs() < 1e16 * self.lsb;
        gyro.held = if seen { libm::rint(reading / self.lsb) * self.lsb } else { reading };
        let keep = libm::exp(-1.0 / (self.rate * self.bias_time));
        let spread = self.bias_instability / 0.664 * libm::sqrt(1.0 - keep * keep);
        gyro.bias = keep * gyro.bias + spread * drift;
        gyro.next += 1;
    }
}

/// Returns two independent standard normal numbers for (seed, k): the Box-Muller transform of two
/// uniform numbers from the SplitMix64 mixer.
fn normals(seed: i32, k: u64) -> (f64, f64) {
    let stream = mix(seed as u32 as u64);
    let uniform = |j: u64| {
        let bits = mix(stream ^ mix(k.wrapping_mul(2).wrapping_add(j)));
        ((bits >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    };
    let radius = libm::sqrt(-2.0 * libm::log(uniform(0)));
    let (sin, cos) = libm::sincos(core::f64::consts::TAU * uniform(1));
    (radius * cos, radius * sin)
}

/// Step and finaliser of the SplitMix64 generator (Steele, Lea, Flood 2014).
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
    fn noise_has_the_stated_spread_and_no_correlation() {
        const COUNT: usize = 200_000;
        let all: Vec<(f64, f64)> = (0..COUNT as u64).map(|k| normals(7, k)).collect();
        let mean = |f: &dyn Fn(usize) -> f64| (0..COUNT).map(f).sum::<f64>() / COUNT as f64;
        // Standard errors: 1/sqrt(COUNT) = 0.0022 for means and correlations, sqrt(2) times that
        // for the variance. Five standard errors do not fail by chance.
        assert!(mean(&|k| all[k].0).abs() < 0.012);
        assert!((mean(&|k| all[k].0 * all[k].0) - 1.0).abs() < 0.016);
        assert!((mean(&|k| all[k].1 * all[k].1) - 1.0).abs() < 0.016);
        assert!(mean(&|k| all[k].0 * all[k].1).abs() < 0.012);
        assert!(mean(&|k| all[k].0 * all[(k + 1) % COUNT].0).abs() < 0.012);
    }

    #[test]
    fn bias_drifts_with_its_stationary_spread() {
        let imu = Imu { bias_time: 1.0, arw: 0.0, ..Imu::default() };
        let mut gyro = imu.start();
        let mut sum = 0.0;
        const COUNT: usize = 500_000; // 10,000 correlation times
        for _ in 0..COUNT {
            imu.sample(&mut gyro, 0.0);
            sum += gyro.held * gyro.held;
        }
        let spread = (sum / COUNT as f64).sqrt();
        // Relative standard error of the spread: 1/sqrt(10,000) = 1 %; four of them.
        assert!((spread / (imu.bias_instability / 0.664) - 1.0).abs() < 0.04);
    }

    #[test]
    fn readings_are_multiples_of_the_quantisation_step() {
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

    /// Returns a gyro without noise, bias and quantisation.
    fn clean(rate: f64) -> Imu {
        Imu { rate, arw: 0.0, bias_instability: 0.0, lsb: 0.0, ..Imu::default() }
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
            // Relative standard error 1/sqrt(2 COUNT) = 0.35 %; four of them.
            assert!((spread / (1e-3 * rate.sqrt()) - 1.0).abs() < 0.014, "{rate} {spread}");
        }
    }

    /// The reading is rate plus bias plus a multiple of the normal number of (seed, k). The bias continues with the
    /// other normal number.
    #[test]
    fn a_reading_is_rate_bias_and_the_seed_s_own_noise() {
        let imu = Imu { arw: 1e-3, bias_instability: 0.664e-3, bias_time: 0.1, ..clean(25.0) };
        let mut gyro = imu.start();
        for k in 0..4 {
            assert_eq!(gyro.next, k);
            let ((white, drift), bias) = (normals(imu.seed, k), gyro.bias);
            imu.sample(&mut gyro, 0.5);
            assert!((gyro.held - 0.5 - bias - 5e-3 * white).abs() < 1e-16, "{k}");
            // e^(-1/2.5) of the bias remains, and its standard deviation of 1 mrad/s stays
            let keep = libm::exp(-0.4);
            let next = keep * bias + 1e-3 * libm::sqrt(1.0 - keep * keep) * drift;
            assert!((gyro.bias - next).abs() < 1e-17, "{k}");
        }
    }

    #[test]
    fn bias_is_drawn_from_its_spread_and_keeps_its_correlation_time() {
        const COUNT: i32 = 40_000;
        // One period is one correlation time: exp(-1) of the bias remains.
        let imu = Imu { bias_instability: 1e-3, bias_time: 0.1, ..clean(10.0) };
        let (mut first, mut product) = (0.0, 0.0);
        for seed in 0..COUNT {
            let imu = Imu { seed, ..imu };
            let mut gyro = imu.start();
            let start = gyro.bias;
            imu.sample(&mut gyro, 0.0);
            assert_eq!(gyro.held, start, "the bias is in the reading");
            (first, product) = (first + start * start, product + start * gyro.bias);
        }
        let variance = first / f64::from(COUNT);
        // Four standard errors: sqrt(2/COUNT) of a variance, 1/sqrt(COUNT) of a correlation.
        assert!((variance / (1e-3 / 0.664f64).powi(2) - 1.0).abs() < 0.028, "{variance}");
        assert!((product / first - (-1.0f64).exp()).abs() < 0.02, "{}", product / first);
    }

    /// The generator's published first outputs for the states 0 and 1234567 (Vigna's splitmix64.c), and a fixed noise
    /// for a seed.
    #[test]
    fn numbers_are_those_of_splitmix64_and_the_same_for_good() {
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
    fn sample_k_is_taken_k_periods_after_the_start() {
        let imu = clean(50.0);
        let mut gyro = imu.start();
        imu.sample(&mut gyro, 0.0);
        // From 13 ms on for 0.1 s: samples at 20, 40, ... 100 ms see the rate 7, 27, ... 87 ms
        // after the beginning.
        assert_eq!(imu.follow(&mut gyro, 0.013, 0.1, |t| 2.0 + t, 9), 5);
        assert_eq!((gyro.next, gyro.held), (6, 2.0 + (0.1 - 0.013)));
        // At most a millionth of a period early, with the rate at the end.
        let early = |share: f64| {
            let mut gyro = gyro;
            let length = 0.02 * (1.0 - share);
            (imu.follow(&mut gyro, 0.1, length, |t| t, 9), gyro.held, length)
        };
        let (taken, held, length) = early(0.9e-6);
        assert_eq!((taken, held), (1, length));
        assert_eq!(early(1.1e-6).0, 0);
        // An overdue sample uses the rate at the beginning. At most one sample more than allowed is
        // taken.
        assert_eq!(imu.follow(&mut gyro.clone(), 0.121, 0.01, |t| 3.0 + t, 9), 1);
        let mut late = gyro;
        imu.follow(&mut late, 0.121, 0.01, |t| 3.0 + t, 9);
        assert_eq!(late.held, 3.0);
        assert_eq!(imu.follow(&mut gyro, 0.1, 10.0, |_| 0.0, 7), 8);
        assert_eq!(gyro.next, 6 + 8);
    }

    #[test]
    fn a_reading_is_rounded_to_the_nearest_step() {
        let imu = Imu { lsb: 1e-3, ..clean(50.0) };
        for (rate, steps) in [(0.012_3, 12.0), (0.012_7, 13.0), (-0.012_7, -13.0)] {
            let mut gyro = imu.start();
            imu.sample(&mut gyro, rate);
            assert_eq!(gyro.held, steps * 1e-3);
        }
        // Beyond 2^53 quantisation steps no rounding is possible.
        let mut gyro = imu.start();
        imu.sample(&mut gyro, 1.1e13);
        assert_eq!(gyro.held, 1.1e13);
    }
}

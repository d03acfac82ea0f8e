//! The rate gyro on the hub: samples the hub's rate, adds white noise and a
//! Gauss-Markov bias, quantises, and holds the value until the next sample.
//!
//! White noise per sample sigma = N sqrt(rate) (N as an Allan coefficient); the bias is of
//! first order, with sigma_b = B/0.664 and correlation time
//! `bias_time` (thesis 5.5; IEEE Std 952). The noise of sample k is a function of
//! the seed and k alone, so a restored state continues with the same noise.

use crate::parameters::Imu;

/// Communication points and time events meet sampling instants only to the rounding of the host's
/// clock: a sample is taken early by up to this part of its period.
pub(crate) const SLACK: f64 = 1e-6;

/// The gyro's memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gyro {
    /// Index of the next sample; sample k is taken k / rate after the start.
    pub next: u64,
    /// Bias that the next sample will have, rad/s.
    pub bias: f64,
    /// The value held, rad/s.
    pub held: f64,
}

impl Imu {
    /// The gyro before its first sample: the bias is drawn from its long-term spread.
    pub(crate) fn start(&self) -> Gyro {
        let (spread, _) = normals(self.seed, u64::MAX);
        Gyro { next: 0, bias: self.bias_instability / 0.664 * spread, held: 0.0 }
    }

    /// Takes the samples that fall due within `length` from `since_start` on, both s, but
    /// one more than `allowed` at most; `omega` is the hub's rate as a function of the time
    /// within. Returns their number.
    pub(crate) fn follow(
        &self,
        gyro: &mut Gyro,
        since_start: f64,
        length: f64,
        omega: impl Fn(f64) -> f64,
        allowed: usize,
    ) -> usize {
        for taken in 0..=allowed {
            let due = gyro.next as f64 / self.rate - since_start;
            if due > length + SLACK / self.rate {
                return taken;
            }
            self.sample(gyro, omega(due.max(0.0).min(length)));
        }
        allowed + 1
    }

    /// Takes the next sample of the rate `omega`.
    pub(crate) fn sample(&self, gyro: &mut Gyro, omega: f64) {
        let (white, drift) = normals(self.seed, gyro.next);
        let reading = omega + gyro.bias + self.arw * libm::sqrt(self.rate) * white;
        // Steps too small to be seen change nothing.
        let seen = reading.abs() < 1e16 * self.lsb;
        gyro.held = if seen { libm::rint(reading / self.lsb) * self.lsb } else { reading };
        let keep = libm::exp(-1.0 / (self.rate * self.bias_time));
        let spread = self.bias_instability / 0.664 * libm::sqrt(1.0 - keep * keep);
        gyro.bias = keep * gyro.bias + spread * drift;
        gyro.next += 1;
    }
}

/// Two independent standard normal numbers that belong to (seed, k), by Box and
/// Muller's transform of two uniform numbers from the SplitMix64 mixer.
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

/// The SplitMix64 generator's step and finaliser (Steele, Lea, Flood 2014).
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
        // Standard errors: 1/sqrt(COUNT) = 0.0022 for means and correlations,
        // sqrt(2) times that for the variance; five of them never fail by chance.
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
}

//! Random numbers that are equal on every machine: PCG64 (the crate `rand_pcg` guarantees its
//! values) and functions of `libm`, which do not depend on the platform.

use std::f64::consts::TAU;

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

pub struct Random(Pcg64);

impl Random {
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut generator = Pcg64::new(seed.into(), stream.into());
        // The first numbers are dropped, because seeds and streams that differ in few bits
        // begin with similar numbers.
        for _ in 0..16 {
            generator.next_u64();
        }
        Random(generator)
    }

    /// Returns a uniformly distributed random number from 0 (included) to 1 (excluded).
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.uniform()));
        radius * libm::cos(TAU * self.uniform())
    }
}

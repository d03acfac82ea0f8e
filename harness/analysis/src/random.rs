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

#[cfg(test)]
mod tests {
    use super::Random;

    #[test]
    fn a_seed_gives_the_same_random_numbers_on_every_machine() {
        // the expected numbers were computed from PCG's definition with Python's integers
        let mut random = Random::new(1, 2);
        let bits = [random.uniform(), random.normal()].map(f64::to_bits);
        assert_eq!(bits, [4607160018058674131, 13828960616544136822]);
    }

    #[test]
    fn normal_numbers_have_the_moments_of_a_normal_distribution() {
        let mut random = Random::new(7, 0);
        let drawn: Vec<f64> = (0..100_000).map(|_| random.normal()).collect();
        let moment = |n: i32| drawn.iter().map(|x| x.powi(n)).sum::<f64>() / drawn.len() as f64;
        // five standard errors: sqrt(1, 2, 15, 96 / 100000) for the moments 1 to 4
        for (n, expected, error) in
            [(1, 0.0, 0.0032), (2, 1.0, 0.0045), (3, 0.0, 0.0123), (4, 3.0, 0.031)]
        {
            assert!((moment(n) - expected).abs() < 5.0 * error, "moment {n}: {}", moment(n));
        }
    }

    #[test]
    fn random_streams_of_one_seed_differ() {
        let streams: Vec<Vec<f64>> = (0..4)
            .map(|stream| {
                let mut random = Random::new(1, stream);
                (0..20_000).map(|_| random.normal()).collect()
            })
            .collect();
        for a in 0..4 {
            for b in 0..a {
                let product: f64 = streams[a].iter().zip(&streams[b]).map(|(x, y)| x * y).sum();
                // five standard errors of the correlation of 20,000 independent pairs
                assert!((product / 20_000.0).abs() < 5.0 / 20_000_f64.sqrt(), "{a} and {b}");
            }
        }
    }
}

//! Band-limited coloured noise that is given by a formula, a sum of sines:
//!
//! ```text
//! τ(t) = Σ a_k sin(2π f_k t + φ_k),   a_k² ∝ f_k^exponent,   Σ a_k²/2 = rms²
//! ```
//!
//! The band is divided into [`TONES`] equal cells. The seed determines the frequency f_k within the k-th cell and the
//! phase φ_k. Therefore the noise has a value at any time, is not periodic, and is equal on every machine.

use std::f64::consts::TAU;

use super::shape::{Dwell, Shape};
use analysis::random::Random;

/// Number of sines of the noise. Over the thesis's band they are 4.4 mHz apart, closer than the 5 mHz that `spa`
/// resolves, so that the estimate has no gaps.
pub const TONES: usize = 512;

/// A noise torque in a band, Hz, which may begin at 0, optionally with a sine added. The torque is
/// clipped at ±`limit`, N·m.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    pub(super) sine: Option<Dwell>,
    pub(super) band: (f64, f64),
    pub(super) limit: f64,
    pub(super) tones: Vec<Tone>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tone {
    amplitude: f64,
    rate: f64,
    phase: f64,
}

impl Noise {
    /// Creates the noise. `rms` is the root mean square before clipping, N·m, and the power density is proportional to
    /// f^exponent: 0 is white, −1 pink, −2 brown.
    pub fn new(rms: f64, (f0, f1): (f64, f64), exponent: f64, seed: u64, limit: f64) -> Self {
        let mut random = Random::new(seed, 0);
        let cell = (f1 - f0) / TONES as f64;
        let unit = if f0 > 0.0 { f0 } else { f1 };
        let mut tones: Vec<Tone> = (0..TONES)
            .map(|k| {
                let frequency = f0 + cell * (k as f64 + random.uniform());
                Tone {
                    amplitude: libm::pow(frequency / unit, exponent / 2.0),
                    rate: TAU * frequency,
                    phase: TAU * random.uniform(),
                }
            })
            .collect();
        let power: f64 = tones.iter().map(|tone| tone.amplitude * tone.amplitude / 2.0).sum();
        for tone in &mut tones {
            tone.amplitude *= rms / power.sqrt();
        }
        Noise { sine: None, band: (f0, f1), limit, tones }
    }
}

impl Shape for Noise {
    fn torque_after(&self, t: f64) -> f64 {
        let tone = |tone: &Tone| tone.amplitude * libm::sin(tone.rate * t + tone.phase);
        let sine = self.sine.as_ref().map_or(0.0, |sine| sine.torque_after(t));
        (sine + self.tones.iter().map(tone).sum::<f64>()).clamp(-self.limit, self.limit)
    }

    fn highest(&self, stop: f64) -> f64 {
        self.sine.as_ref().map_or(0.0, |sine| sine.highest(stop)).max(self.band.1)
    }

    /// Returns the excited band, Hz. If the band of the noise begins at 0, the excited band begins with the second
    /// sine, because the frequency of the first one may be close to 0.
    fn band(&self) -> Option<(f64, f64)> {
        let (f0, f1) = self.band;
        Some((if f0 > 0.0 { f0 } else { f1 / TONES as f64 }, f1))
    }
}

#[cfg(test)]
mod tests {
    use super::Noise;
    use crate::profile::Shape;
    use analysis::Complex64;
    use std::f64::consts::TAU;

    fn samples(noise: &Noise, duration: f64, step: f64) -> Vec<f64> {
        (0..(duration / step) as usize).map(|k| noise.torque_after(k as f64 * step)).collect()
    }

    #[test]
    fn noise_from_0_hz_has_the_specified_rms_and_the_sum_with_a_sine_is_clipped_at_the_limit() {
        let text = "sine-noise:amplitude=0.1,frequency=2,rms=0.05,limit=0.2";
        let both = crate::profile::Torque::Profile(text.parse().unwrap());
        let noise = Noise::new(0.05, (0.0, 20.0), 0.0, 1, f64::INFINITY);
        let (mut clipped, mut power) = (0, 0.0);
        for k in 0..60_000 {
            let t = k as f64 * 0.01;
            let sum = 0.1 * (TAU * 2.0 * t).sin() + noise.torque_after(t);
            assert!((both.torque_at(t) - sum.clamp(-0.2, 0.2)).abs() < 1e-15);
            clipped += usize::from(sum.abs() > 0.2);
            power += noise.torque_after(t).powi(2);
        }
        assert!(clipped > 0);
        // a record of 600 s resolves 1.7 mHz, and the sines are 39 mHz apart, so that the power has an error of a
        // fraction of a per cent
        assert!(((power / 60_000.0).sqrt() / 0.05 - 1.0).abs() < 0.01);
        let brown = Noise::new(0.05, (0.0, 20.0), -2.0, 1, 1.0);
        assert!((0..100).all(|k| brown.torque_after(k as f64).is_finite()));
    }

    #[test]
    fn noise_has_the_specified_rms_and_stays_within_the_limit() {
        let noise = Noise::new(0.05, (1.25, 3.5), -1.0, 3, 0.26);
        let tau = samples(&noise, 600.0, 0.05);
        let rms = (tau.iter().map(|v| v * v).sum::<f64>() / tau.len() as f64).sqrt();
        // a record of 600 s resolves 1.7 mHz, and the sines are 4.4 mHz apart on average, so that they overlap little:
        // the error of the root mean square is a few per cent
        assert!((rms / 0.05 - 1.0).abs() < 0.05, "{rms}");
        let loud = Noise::new(0.13, (1.25, 3.5), 0.0, 3, 0.26);
        let tau = samples(&loud, 100.0, 0.05);
        assert!(tau.iter().all(|v| v.abs() <= 0.26) && tau.contains(&0.26));
    }

    #[test]
    fn noise_has_its_power_in_the_band_and_the_specified_colour() {
        let power = |exponent: f64, (from, to): (f64, f64)| {
            let noise = Noise::new(0.05, (1.0, 4.0), exponent, 5, 1.0);
            let step = 0.1;
            let tau = samples(&noise, 400.0, step);
            // spectrum of the record with a Hann window, at every multiple of 1/duration in the range
            let (first, last) = ((from * 400.0) as usize, (to * 400.0) as usize);
            (first..last)
                .map(|bin| {
                    let turn = Complex64::cis(-TAU * bin as f64 / tau.len() as f64);
                    let mut carrier = Complex64::new(1.0, 0.0);
                    let mut sum = Complex64::default();
                    for (k, value) in tau.iter().enumerate() {
                        let hann = 1.0 - (TAU * k as f64 / tau.len() as f64).cos();
                        sum += carrier * (value * hann);
                        carrier *= turn;
                    }
                    sum.norm_sqr()
                })
                .sum::<f64>()
        };
        // from the octave 1 to 2 Hz to the octave 2 to 4 Hz the power of white noise doubles, the power of pink
        // noise is unchanged, and the power of brown noise halves; the frequencies are random within the cells,
        // which causes an error
        for (exponent, ratio) in [(0.0, 2.0), (-1.0, 1.0), (-2.0, 0.5)] {
            let found = power(exponent, (2.0, 3.99)) / power(exponent, (1.01, 2.0));
            assert!((found / ratio - 1.0).abs() < 0.1, "exponent {exponent}: {found}");
        }
        // at a distance of a tenth of a hertz from the band a Hann window leaks 1e-6 or less
        assert!(power(0.0, (0.3, 0.9)) < 1e-6 * power(0.0, (1.0, 2.0)));
    }

    #[test]
    fn noise_depends_on_its_seed() {
        let noise = |seed| Noise::new(0.05, (1.25, 3.5), 0.0, seed, 0.26);
        assert_eq!(noise(1), noise(1));
        let (a, b) = (samples(&noise(1), 10.0, 0.1), samples(&noise(2), 10.0, 0.1));
        assert!(a.iter().zip(&b).all(|(x, y)| x != y));
    }
}

//! Welch's averaged spectra: Hamming windows, half overlapping, means taken off.

use realfft::RealFftPlanner;

use super::{Complex64, FrequencyResponse};

/// Segments of a record, as MATLAB's `mscohere`, `cpsd` and `tfestimate` take them when
/// they are not told otherwise.
pub const SEGMENTS: usize = 8;

/// Averaged auto- and cross-spectra of two signals, in arbitrary but common units.
pub struct Spectra {
    /// Distance of the bins, Hz.
    pub resolution: f64,
    /// |U|² per bin.
    pub input: Vec<f64>,
    /// |Y|² per bin.
    pub output: Vec<f64>,
    /// conj(U) Y per bin.
    pub cross: Vec<Complex64>,
}

impl Spectra {
    /// Of two equally long signals sampled every `step` s.
    pub fn of(step: f64, input: &[f64], output: &[f64]) -> Self {
        // Half overlap: SEGMENTS segments of length L cover (SEGMENTS + 1) L/2.
        let length = (2 * input.len() / (SEGMENTS + 1)).max(2);
        let fft = RealFftPlanner::<f64>::new().plan_fft_forward(length);
        let window: Vec<f64> = (0..length)
            .map(|i| {
                let turn = std::f64::consts::TAU * i as f64 / (length - 1) as f64;
                0.54 - 0.46 * turn.cos()
            })
            .collect();
        let bins = length / 2 + 1;
        let mut all = Spectra {
            resolution: 1.0 / (step * length as f64),
            input: vec![0.0; bins],
            output: vec![0.0; bins],
            cross: vec![Complex64::default(); bins],
        };
        let means = [input, output].map(|s| s.iter().sum::<f64>() / s.len() as f64);
        let spectrum = |signal: &[f64], mean: f64| {
            let mut windowed: Vec<f64> =
                signal.iter().zip(&window).map(|(x, w)| (x - mean) * w).collect();
            let mut spectrum = fft.make_output_vec();
            fft.process(&mut windowed, &mut spectrum).expect("lengths are the plan's");
            spectrum
        };
        let mut from = 0;
        while from + length <= input.len() {
            let u = spectrum(&input[from..from + length], means[0]);
            let y = spectrum(&output[from..from + length], means[1]);
            for k in 0..bins {
                all.input[k] += u[k].norm_sqr();
                all.output[k] += y[k].norm_sqr();
                all.cross[k] += u[k].conj() * y[k];
            }
            from += length / 2;
        }
        all
    }

    /// Magnitude-squared coherence |S_uy|² / (S_uu S_yy), 0 to 1, per bin.
    pub fn coherence(&self) -> Vec<f64> {
        let at = |k: usize| {
            let power = self.input[k] * self.output[k];
            if power > 0.0 { self.cross[k].norm_sqr() / power } else { 0.0 }
        };
        (0..self.cross.len()).map(at).collect()
    }

    /// Mean coherence of the bins between two frequencies, Hz (thesis 6.17).
    pub fn mean_coherence(&self, from: f64, to: f64) -> f64 {
        let (from, to) = (from.min(to), from.max(to));
        let first = (from / self.resolution).ceil() as usize;
        let last = ((to / self.resolution).floor() as usize).min(self.cross.len() - 1);
        let band = &self.coherence()[first.min(last)..=last];
        band.iter().sum::<f64>() / band.len() as f64
    }

    /// Signal-to-noise ratio at a frequency from the coherence γ²: 10 log10(γ²/(1 − γ²)), dB
    /// (thesis 6.19).
    pub fn snr_db(&self, frequency: f64) -> f64 {
        let bin = ((frequency / self.resolution).round() as usize).min(self.cross.len() - 1);
        let power = self.input[bin] * self.output[bin];
        let coherence = self.cross[bin].norm_sqr() / power;
        10.0 * (coherence / (1.0 - coherence)).log10()
    }

    /// The H1 estimate S_uy / S_uu within a band, Hz.
    pub fn h1(&self, (from, to): (f64, f64)) -> FrequencyResponse {
        let mut h1 = FrequencyResponse::default();
        for (k, cross) in self.cross.iter().enumerate() {
            let frequency = k as f64 * self.resolution;
            if (from..=to).contains(&frequency) && self.input[k] > 0.0 {
                h1.frequency.push(frequency);
                h1.response.push(cross / self.input[k]);
            }
        }
        h1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White noise, even in ±1: the multiplicative generator of MINSTD.
    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state * 48271 % 2_147_483_647;
            2.0 * state as f64 / 2_147_483_647.0 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    #[test]
    fn coherence_is_one_through_a_gain_and_one_eighth_between_strangers() {
        let (u, v) = (noise(1, 90_000), noise(77, 90_000));
        let gained: Vec<f64> = u.iter().map(|x| -3.0 * x).collect();
        let through = Spectra::of(0.02, &u, &gained);
        assert!((through.mean_coherence(1.0, 20.0) - 1.0).abs() < 1e-12);
        assert!((through.h1((5.0, 5.1)).response[0].re + 3.0).abs() < 1e-9);
        // K averages of unrelated spectra have the mean coherence 1/K; half-overlapping
        // Hamming segments count as some 7 of 8.
        let strangers = Spectra::of(0.02, &u, &v).mean_coherence(1.0, 20.0);
        assert!((0.11..0.17).contains(&strangers), "{strangers}");
    }

    #[test]
    fn snr_is_the_ratio_of_the_powers() {
        let (u, v) = (noise(5, 900_000), noise(9, 900_000));
        let mixed: Vec<f64> = u.iter().zip(&v).map(|(u, v)| u + v / 10.0).collect();
        let spectra = Spectra::of(0.02, &u, &mixed);
        let bins = (1..200).map(|k| spectra.snr_db(k as f64 * 0.1));
        let mean = bins.sum::<f64>() / 199.0;
        // 20 dB; the mean of a logarithm of few averages lies some 0.7 dB off.
        assert!((mean - 20.0).abs() < 1.5, "{mean}");
    }
}

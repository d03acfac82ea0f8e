//! Welch's averaged spectra: Hamming windows with half overlap, and means removed (thesis 6.3.3).
//!
//! The thesis does not state the length L of the segments, which is decisive for a sweep: a sweep is at each frequency
//! only for a moment. If only one segment contains this moment, nothing is averaged, and the coherence of any two signals
//! is 1. The sweep passes the resolution 1/L of a segment in 1/(L rate), and half-overlapping segments follow each other
//! by L/2, so that 2/(rate L²) segments contain each frequency.
//!
//! * [`SEGMENT`], 20 s, is the length for coherence: six segments at the thesis's 1/1200 Hz/s. The coherence then shows
//!   whether the ratio of the two signals stays the same while the sweep passes 50 mHz.
//! * [`RESPONSE`], a ninth of twice the record (MATLAB's default), is 600 s of the thesis's sweep and resolves the
//!   antiresonance. It is used for the H1 estimate, which needs no average with a sweep, and for the signal-to-noise
//!   ratio: one segment contains the sweep at a frequency, and the others contain only noise.

use fourier::Forward;

use crate::response::FrequencyResponse;
use crate::statistics;
use fourier::Complex64;

/// Default number of segments of a record, as in MATLAB's `mscohere`, `cpsd` and `tfestimate`.
pub const SEGMENTS: usize = 8;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segments {
    /// A length in seconds. It is reduced if the record is shorter than [`SEGMENTS`] segments of
    /// this length.
    Seconds(f64),
    Longest,
}

pub const SEGMENT: f64 = 20.0;

pub const RESPONSE: Segments = Segments::Longest;

/// Factor by which each segment is extended with zeros, so that several frequency bins lie between
/// antiresonance and resonance.
const PADDING: usize = 4;

/// Averaged spectra of an input U and an output Y, for each frequency bin.
///
/// - `resolution`: distance of the bins, Hz.
/// - `length`: length of a segment, s.
/// - `input`, `output`: averages of |U|² and |Y|², in an arbitrary common unit.
/// - `cross`: average of conj(U) Y in this unit.
pub struct Spectra {
    pub resolution: f64,
    pub length: f64,
    pub input: Vec<f64>,
    pub output: Vec<f64>,
    pub cross: Vec<Complex64>,
}

impl Spectra {
    pub fn estimate(step: f64, input: &[f64], output: &[f64], segments: Segments) -> Self {
        // With half overlap, SEGMENTS segments of length L cover (SEGMENTS + 1) L/2.
        let longest = (2 * input.len() / (SEGMENTS + 1)).max(2);
        let length = match segments {
            Segments::Seconds(seconds) => ((seconds / step).round() as usize).clamp(2, longest),
            Segments::Longest => longest,
        };
        let padded = PADDING * length;
        let transform = Forward::new(padded);
        let window: Vec<f64> = (0..length)
            .map(|i| {
                let turn = std::f64::consts::TAU * i as f64 / (length - 1) as f64;
                0.54 - 0.46 * turn.cos()
            })
            .collect();
        let bins = padded / 2 + 1;
        let mut all = Spectra {
            resolution: 1.0 / (step * padded as f64),
            length: step * length as f64,
            input: vec![0.0; bins],
            output: vec![0.0; bins],
            cross: vec![Complex64::default(); bins],
        };
        let means = [input, output].map(statistics::mean);
        let spectrum = |signal: &[f64], mean: f64| {
            let mut windowed: Vec<f64> =
                signal.iter().zip(&window).map(|(x, w)| (x - mean) * w).collect();
            windowed.resize(padded, 0.0);
            transform.transform(windowed)
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

    /// Returns the magnitude-squared coherence of input and output for each frequency bin, from 0
    /// to 1: |S_uy|² / (S_uu S_yy) with the cross-spectrum S_uy and the power spectra S_uu and
    /// S_yy.
    pub fn coherence(&self) -> Vec<f64> {
        let at = |k: usize| {
            let power = self.input[k] * self.output[k];
            if power > 0.0 { self.cross[k].norm_sqr() / power } else { 0.0 }
        };
        (0..self.cross.len()).map(at).collect()
    }

    /// Returns the mean coherence of the frequency bins between `from` and `to`, Hz (Rubaga's
    /// thesis, equation 6.17).
    pub fn mean_coherence(&self, from: f64, to: f64) -> f64 {
        let (from, to) = (from.min(to), from.max(to));
        let first = (from / self.resolution).ceil() as usize;
        let last = ((to / self.resolution).floor() as usize).min(self.cross.len() - 1);
        let band = &self.coherence()[first.min(last)..=last];
        statistics::mean(band)
    }

    /// Returns the signal-to-noise ratio for each frequency bin, dB. It follows from the coherence
    /// γ² as 10 log10(γ²/(1 − γ²)) (Rubaga's thesis, equation 6.19).
    pub fn snr_db(&self) -> Vec<f64> {
        self.coherence().into_iter().map(|c| 10.0 * (c / (1.0 - c)).log10()).collect()
    }

    pub fn value_at(&self, values: &[f64], frequency: f64) -> f64 {
        values[((frequency / self.resolution).round() as usize).min(values.len() - 1)]
    }

    pub fn values_within(&self, (from, to): (f64, f64), values: &[f64]) -> Vec<(f64, f64)> {
        let bins = values.iter().enumerate().map(|(k, v)| (k as f64 * self.resolution, *v));
        bins.filter(|(f, _)| (from..=to).contains(f)).collect()
    }

    /// Returns the H1 estimate of the frequency response within the band `from` to `to`, Hz: the
    /// cross-spectrum divided by the power spectrum of the input. It is unbiased if only the output
    /// has noise.
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

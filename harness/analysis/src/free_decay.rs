//! Free decay: frequency and damping of an undriven oscillation x with the amplitude A and the phase φ, and
//! their dependence on A,
//!
//! ```text
//! A'/A = −ω (ζ + ζ_A A)          ω = 2πf
//! φ'   =  ω (√(1 − ζ²) + κ A²)
//! x    =  x₀ + s t + A cos φ
//! ```
//!
//! ζ_A A is the damping by a friction proportional to the square of the speed (quadratic drag, a baffle), whose decrement
//! is proportional to the amplitude. κ describes a hardening or softening spring. The first equation is a Bernoulli
//! equation; its solution is
//!
//! ```text
//! A = A₀ e^{−ζωt} / (1 + ζ_A A₀ g),   g = (1 − e^{−ζωt})/ζ
//! ```
//!
//! [`Start`] estimates the parameters from the oscillation's phasor over windows of two periods, by linear least
//! squares of its logarithm.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use crate::least_squares::smallest;
use crate::statistics::{deviation, mean};
use fourier::Complex64;

pub const LEAST_PERIODS: f64 = 5.0;

#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    pub time: &'a [f64],
    pub signal: &'a [f64],
}

/// Returns the amplitude of a decaying oscillation at the time `t`, s, if its amplitude at t = 0 is
/// `start`. `frequency` is in Hz, `zeta` is the damping ratio at small amplitudes, and `zeta_a` is
/// the growth of the damping ratio with the amplitude.
pub fn amplitude(t: f64, start: f64, [frequency, zeta, zeta_a]: [f64; 3]) -> f64 {
    let s = TAU * frequency * t;
    let g = if (zeta * s).abs() < 1e-9 { s } else { -(-zeta * s).exp_m1() / zeta };
    start * (-zeta * s).exp() / (1.0 + zeta_a * start * g)
}

/// Evaluates the model of a free decay at the times `time`, s. The first array has the frequency,
/// Hz, the damping ratio ζ, its growth ζ_A with the amplitude, and the coefficient κ of the
/// frequency shift with the squared amplitude. `own` has the values that differ from record to
/// record: amplitude, phase, offset and slope of the signal at `time[0]`.
pub fn model(time: &[f64], [frequency, zeta, zeta_a, kappa]: [f64; 4], own: [f64; 4]) -> Vec<f64> {
    let omega = TAU * frequency;
    let damped = (1.0 - zeta * zeta).max(0.0).sqrt();
    let [start, phase, offset, slope] = own;
    let amplitude = |t: f64| amplitude(t, start, [frequency, zeta, zeta_a]);
    let (mut square, mut before) = (0.0, (0.0, start));
    let values = time.iter().map(|t| {
        let t = t - time[0];
        let a = amplitude(t);
        // Simpson's rule over the step, because the amplitude hardly changes within a step.
        let middle = amplitude((t + before.0) / 2.0);
        square += (t - before.0) / 6.0 * (before.1.powi(2) + 4.0 * middle.powi(2) + a * a);
        before = (t, a);
        offset + slope * t + a * (phase + omega * (damped * t + kappa * square)).cos()
    });
    values.collect()
}

const LINES: usize = 400;

/// Returns frequency, Hz, and amplitude of the largest oscillation in `residual`, which remains
/// after an oscillation with `frequency`, Hz, was fitted and subtracted. The search covers half of
/// `frequency` to ten times `frequency`, but ends at the Nyquist frequency of the mean step.
pub fn largest_other(time: &[f64], residual: &[f64], frequency: f64) -> (f64, f64) {
    let (n, seconds) = (time.len() as f64, time[time.len() - 1] - time[0]);
    let amplitude = |f: f64| {
        let turns = time.iter().map(|t| Complex64::cis(-TAU * f * (t - time[0])));
        2.0 * turns.zip(residual).map(|(z, r)| z * r).sum::<Complex64>().norm() / n
    };
    // the search ends at the Nyquist frequency of the mean step, or at ten times f if that is lower
    let top = (0.5 * n / seconds).min(10.0 * frequency);
    let low = (0.5 * frequency).min(0.5 * top);
    let line = |k: usize| low + (top - low) * (k as f64 + 0.5) / LINES as f64;
    let lines = (0..LINES).map(|k| (line(k), amplitude(line(k))));
    lines.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
}

type Row = (f64, f64, f64, f64, f64);

#[derive(Clone, Copy, Debug)]
pub struct Start {
    pub frequency: f64,
    pub zeta: f64,
    pub zeta_amplitude: f64,
    pub hardening: f64,
    pub amplitude: f64,
    pub phase: f64,
    pub offset: f64,
    pub periods: f64,
}

const FINE: usize = 4;
/// Smallest amplitude that is used, relative to the largest amplitude in the record, because noise
/// dominates smaller amplitudes.
const LEAST_PART: f64 = 0.02;

impl Start {
    /// Estimates start values for a fit of the free-decay [`model`] from the spectrum of `record`
    /// and from the decay of its amplitude. Returns `None` if the record has fewer than
    /// [`LEAST_PERIODS`] periods or does not oscillate.
    pub fn fit(record: &Record) -> Option<Start> {
        let Record { time, signal } = *record;
        let n = time.len();
        let seconds = time[n - 1] - time[0];
        if n < 20 || seconds <= 0.0 {
            return None;
        }
        let offset = mean(signal);
        // The largest line under a Hann window, which suppresses drift.
        let window = |t: f64| 0.5 - 0.5 * (TAU * (t - time[0]) / seconds).cos();
        let weighted: Vec<f64> =
            time.iter().zip(signal).map(|(t, y)| window(*t) * (y - offset)).collect();
        let top = 0.45 * (n - 1) as f64 / seconds;
        let low = 0.8 * LEAST_PERIODS / seconds;
        let power = |f: f64| {
            let sum: Complex64 =
                time.iter().zip(&weighted).map(|(t, y)| Complex64::cis(-TAU * f * t) * y).sum();
            sum.norm_sqr()
        };
        let coarse = largest_line(time, &weighted, low, top)?;
        // The frequency is the vertex of a parabola through the logarithms of the power around the largest line.
        let h = 0.25 / seconds;
        let [a, b, c] = [coarse - h, coarse, coarse + h].map(|f| power(f).max(1e-300).ln());
        let bend = a - 2.0 * b + c;
        let by = if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-2.0, 2.0) } else { 0.0 };
        let frequency = coarse + by * h;
        if frequency * seconds < LEAST_PERIODS || deviation(signal) == 0.0 {
            return None;
        }
        // phasor of the oscillation, computed over Hann windows of two periods
        let half = 1.0 / frequency;
        let windows = ((seconds / half) as usize * 2).clamp(8, 4000);
        let mut points: Vec<(f64, Complex64)> = Vec::new();
        for k in 0..=windows {
            let centre = time[0] + half + (seconds - 2.0 * half) * k as f64 / windows as f64;
            let from = time.partition_point(|t| *t < centre - half);
            let to = time.partition_point(|t| *t <= centre + half);
            let (mut sum, mut weights) = (Complex64::default(), 0.0);
            for i in from..to {
                let w = 1.0 + (std::f64::consts::PI * (time[i] - centre) / half).cos();
                sum += Complex64::cis(-TAU * frequency * (time[i] - time[0]))
                    * (w * (signal[i] - offset));
                weights += w;
            }
            if to - from > 4 && weights > 0.0 {
                points.push((centre - time[0], sum * (2.0 / weights)));
            }
        }
        let largest = points.iter().map(|(_, z)| z.norm()).fold(0.0, f64::max);
        let first = points.iter().position(|(_, z)| z.norm() > 0.5 * largest)?;
        let end = points[first..].iter().position(|(_, z)| z.norm() < LEAST_PART * largest);
        let points = &points[..end.map_or(points.len(), |end| first + end)];
        if points.len() < 6 {
            return None;
        }
        // ln A = ln A₀ − ω (ζ t + ζ_A ∫A), φ = φ₀ + δ t + ω κ ∫A²
        let (mut integral, mut square) = (0.0, 0.0);
        let (mut rows, mut phase) = (Vec::new(), points[0].1.arg());
        for (k, (t, z)) in points.iter().enumerate() {
            let a = z.norm();
            if k > 0 {
                let (before, y) = points[k - 1];
                integral += (t - before) * (a + y.norm()) / 2.0;
                square += (t - before) * (a * a + y.norm_sqr()) / 2.0;
                phase += (z * y.conj()).arg();
            }
            rows.push((*t, integral, square, a, phase));
        }
        let omega = TAU * frequency;
        let fit = |columns: &dyn Fn(&Row) -> [f64; 3], of: &dyn Fn(&Row) -> f64| {
            let matrix = DMatrix::from_fn(rows.len(), 3, |i, j| rows[i].3 * columns(&rows[i])[j]);
            let right = DVector::from_fn(rows.len(), |i, _| rows[i].3 * of(&rows[i]));
            smallest(matrix, &right, 1e-10)
        };
        let decay = fit(&|r| [1.0, -omega * r.0, -omega * r.1], &|r| r.3.ln())?;
        let turning = fit(&|r| [1.0, r.0, omega * r.2], &|r| r.4)?;
        Some(Start {
            frequency: frequency + turning[1] / TAU,
            zeta: decay[1],
            zeta_amplitude: decay[2],
            hardening: turning[2],
            amplitude: decay[0].exp(),
            phase: turning[0],
            offset,
            periods: frequency * seconds,
        })
    }
}

/// Returns the frequency of the largest line in the spectrum of a signal between the frequencies
/// `low` and `top`, Hz. `weighted` are the samples of the signal at the times `time`, s, multiplied
/// by a window. Each sample is assigned to the nearest point of an equally spaced grid, so that one
/// Fourier transform serves samples with any spacing. Below the Nyquist frequency of this grid the
/// error is negligible.
fn largest_line(time: &[f64], weighted: &[f64], low: f64, top: f64) -> Option<f64> {
    let n = time.len();
    let step = (time[n - 1] - time[0]) / (n - 1) as f64;
    let length = (n * FINE).next_power_of_two();
    let mut padded = vec![0.0; length];
    for (t, y) in time.iter().zip(weighted) {
        padded[((t - time[0]) / step).round() as usize] += y;
    }
    let spectrum = fourier::Forward::new(length).transform(padded);
    let frequency = |k: usize| k as f64 / (length as f64 * step);
    let inside = (0..spectrum.len()).filter(|k| (low..=top).contains(&frequency(*k)));
    let best = inside.max_by(|a, b| spectrum[*a].norm_sqr().total_cmp(&spectrum[*b].norm_sqr()))?;
    Some(frequency(best))
}

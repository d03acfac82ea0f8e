//! Start values from the data. The frequency response is fitted with three poles and two zeros, which give the tank, the inertia
//! and the friction ([`translate`]). The tank is the upright cylinder whose first mode has this frequency and mass.

use std::f64::consts::{PI, TAU};

use analysis::features::Features;
use analysis::statistics::{correlation, deviation, mean, median, quantile};
use analysis::transfer_function::TransferFunction;
use analysis::{Complex64, FrequencyResponse};
use anyhow::Result;
use formulas::cylinder::tank_of_first_mode;
use fourier::Forward;

use crate::bench::nominal::{Bench, Nominal, Start};
use crate::bench::problem::DELAY;
use crate::input::plausible;
use crate::input::recording::Recording;
use crate::input::response::{excited_band, response};
use crate::tuning::{DAMPINGS, FREQUENCY_FINENESS};

#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Response {
    pub slosh_frequency: f64,
    pub slosh_damping: f64,
    /// Resonance frequency, Hz: frequency of the complex pole pair of the transfer function.
    pub resonance_frequency: f64,
    pub slosh_mass: f64,
    /// I0, inertia of hub and fixed mass, kg·m².
    pub inertia: f64,
    /// Fraction of the measured response that the fitted transfer function explains, %.
    pub fit: f64,
}

/// Computes a hub with one slosh mode and viscous friction b from the three poles and two zeros that fit a measured response.
///
/// ```text
/// Ω/τ = (b2 s² + b1 s + b0)/(s³ + a2 s² + a1 s + a0),   μ = m r²/I0
/// b2 = 1/I0,  b1/b2 = 2ζω,  b0/b2 = ω²
/// a0 = ω² b/I0,  a1 = ω²(1 + μ) + 2ζω b/I0,  a2 = b/I0 + 2ζω(1 + μ)
/// ```
///
/// (thesis 6.7, corrected). The six coefficients are functions of five unknowns, so that a2 follows from the others. Returns
/// `None` if no such hub has these coefficients, or if the slosh frequency is outside the measured band.
pub fn translate(measured: &FrequencyResponse, bench: Bench) -> Option<Response> {
    let model = TransferFunction::fit(measured)?;
    let ([b2, b1, b0], [_, a1, a0]) = (model.numerator, model.denominator());
    let square = (b2 > 0.0 && b0 > 0.0).then(|| b0 / b2)?;
    let mass_ratio = (a1 - b1 / b2 * a0 / square) / square - 1.0;
    let found = Response {
        slosh_frequency: square.sqrt() / TAU,
        slosh_damping: b1 / b2 / (2.0 * square.sqrt()),
        resonance_frequency: model.pole_frequency(),
        slosh_mass: mass_ratio / b2 / bench.inertia(1.0),
        inertia: 1.0 / b2,
        fit: model.fit_frequency(measured),
    };
    let (low, high) = (measured.frequency[0], *measured.frequency.last()?);
    let within = found.slosh_frequency > low && found.resonance_frequency < high;
    (found.slosh_mass > 0.0 && within).then_some(found)
}

/// Estimates the bench from the frequency response of the recordings, and returns it with start values, the likeliest first. If
/// the response shows no slosh, the bench is `None`, and there is one start. The further starts are used if the first leads to no
/// minimum. They come from the antiresonance and resonance of the response, from the torque balance in parts of the band (because
/// a slew's torque has its power far below the slosh frequency), and from the FMU's settings.
pub fn from_data(
    recordings: &[Recording],
    nominal: &Nominal,
) -> Result<(Option<Response>, Vec<Start>)> {
    let bench = nominal.bench;
    // a recording that excites few frequencies gives no frequency response; the other recordings suffice
    let (measured, failed): (Vec<_>, Vec<_>) =
        recordings.iter().map(response).partition(Result::is_ok);
    if measured.is_empty() {
        failed.into_iter().collect::<Result<Vec<_>>>()?;
    }
    let both = |m: FrequencyResponse| [translate(&m, bench), from_features(&m, bench)];
    let mut responses: Vec<Response> =
        measured.into_iter().flatten().flat_map(both).flatten().collect();
    // a response that is only noise, for example of a step, has an implausible inertia and comes last
    let key = |r: &Response| (!plausible::is_size(r.inertia, nominal.inertia), -r.fit);
    responses.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
    let rough = friction(recordings);
    let whole = balances(recordings, bench, &|r| excited(r).into_iter().collect());
    let Some(first) = whole.into_iter().chain(responses.first().copied()).next() else {
        return Ok((None, vec![rough]));
    };
    let parts = balances(recordings, bench, &|r| {
        excited(r).map_or(Vec::new(), |band| octaves(band.0, 0.4 / r.step()))
    });
    let mut modes: Vec<Response> = Vec::new();
    for mode in [first].into_iter().chain(responses.iter().copied()).chain(parts) {
        if !modes.iter().any(|other| mode.is_near(other)) {
            modes.push(mode);
        }
    }
    let mut all: Vec<Start> = modes.iter().map(|mode| mode.start(bench, rough)).collect();
    let Start { b, c, stribeck, omega_s, .. } = rough;
    all.push(Start { b, c, stribeck, omega_s, ..nominal.start });
    Ok((responses.first().copied().or(Some(first)), all))
}

fn balances(
    recordings: &[Recording],
    bench: Bench,
    bands: &dyn Fn(&Recording) -> Vec<(f64, f64)>,
) -> Vec<Response> {
    let each = |r| bands(r).into_iter().filter_map(move |band| balance(r, bench, band));
    let mut found: Vec<(f64, Response)> = recordings.iter().flat_map(each).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, response)| response).collect()
}

/// Returns the lowest and the highest frequency, Hz, between which the torque of a recording has its power.
fn excited(recording: &Recording) -> Option<(f64, f64)> {
    let (step, torque, rate) = recording.even().ok()?;
    excited_band(step, &torque, &rate)
}

/// Returns frequency bands of two octaves between `low` and `high`, Hz. Each band begins one octave above the band before it.
fn octaves(low: f64, high: f64) -> Vec<(f64, f64)> {
    let count = ((high / low).log2() as u32).saturating_sub(1);
    (0..count).map(|k| low * f64::from(1u32 << k)).map(|f| (f, 4.0 * f)).collect()
}

impl Response {
    pub fn line(&self) -> String {
        format!(
            "frequency response: slosh at {:.4} Hz, damping ratio {:.4}, resonance at {:.4} Hz, slosh mass {:.3} kg, \
             inertia {:.4} kg·m²",
            self.slosh_frequency,
            self.slosh_damping,
            self.resonance_frequency,
            self.slosh_mass,
            self.inertia
        )
    }

    /// Returns true if the two responses are so similar that searches that start from them would
    /// reach the same minimum.
    fn is_near(&self, other: &Response) -> bool {
        let ratio = |a: f64, b: f64| (a / b).ln().abs();
        ratio(self.slosh_frequency, other.slosh_frequency) < 0.05
            && ratio(self.slosh_mass, other.slosh_mass) < 0.5
            && ratio(self.inertia, other.inertia) < 0.5
    }

    /// Returns start values of the fit: the tank whose first mode has the frequency and the mass of this response, and
    /// the rest of the inertia as the inertia of the hub. The parameters of the friction come from `friction`.
    pub fn start(&self, bench: Bench, friction: Start) -> Start {
        let length = bench.gravity / (TAU * self.slosh_frequency).powi(2);
        let (d, h) = tank_of_first_mode(length, self.slosh_mass, bench.density);
        let fixed = bench.liquid(d, h) - self.slosh_mass;
        let hub_inertia = self.inertia - bench.inertia(fixed.max(0.0));
        Start {
            d,
            h,
            zeta: self.slosh_damping.clamp(1e-3, 0.1),
            hub_inertia: hub_inertia.max(0.2 * self.inertia),
            length,
            mass_ratio: bench.inertia(self.slosh_mass) / self.inertia,
            inertia: self.inertia,
            ..friction
        }
    }
}

/// Estimates the slosh mode from the torque balance in the frequency domain, with the spectra T of the torque and W
/// of the *measured* rate:
///
/// ```text
/// T = jΩ I0 W + jΩ m r² G(Ω) W + b W + c S − δ jΩ T,   G = (ω² + 2jζωΩ)/(ω² − Ω² + 2jζωΩ)
/// ```
///
/// S is the spectrum of the rate's sign. δ is a delay, which also absorbs the effect of dry friction on the phase and is not
/// used further. The equation is linear in the unknowns except the slosh frequency ω and the damping ratio ζ, which are taken
/// from a grid. The residual is divided by |jΩ(I0 + m r² G)|, which makes it a rate. Because nothing is simulated, the lines
/// of a multisine cause no false minima. Because the equation contains dry friction, its loss at small amplitudes is not
/// taken for damping of the slosh. Returns the root mean square of the residual divided by the root mean square of the hub's
/// rate, and the bench.
fn balance(recording: &Recording, bench: Bench, band: (f64, f64)) -> Option<(f64, Response)> {
    let (step, torque, rate) = recording.even().ok()?;
    let n = rate.len();
    let mean = mean(&rate);
    let noise = recording.rate_noise();
    let signs: Vec<f64> = rate.iter().map(|w| ((w - mean) / (3.0 * noise)).tanh()).collect();
    let transform = Forward::new(n);
    // Hann window, so that the motion before and after the recording does not leak
    let window = |k: usize| 1.0 - (TAU * k as f64 / n as f64).cos();
    let spectrum = |x: &[f64]| transform.transform((0..n).map(|k| x[k] * window(k)).collect());
    let (t, w, s) = (spectrum(&torque), spectrum(&rate), spectrum(&signs));
    let width = 1.0 / (n as f64 * step);
    let (first, last) = ((0.9 * band.0 / width) as usize, (1.1 * band.1 / width) as usize);
    // only spectral lines above the noise are used
    let floor = 9.0 * noise.powi(2) * 1.5 * n as f64;
    let lines: Vec<usize> =
        (first.max(1)..last.min(w.len() - 1)).filter(|&k| w[k].norm_sqr() > floor).collect();
    if lines.len() < 30 {
        return None;
    }
    // 1500 spectral lines are enough; of more lines, every n-th one is used
    let lines: Vec<usize> = lines.iter().copied().step_by((lines.len() / 1500).max(1)).collect();
    let all: f64 = lines.iter().map(|&k| w[k].norm_sqr()).sum();
    let try_mode = |frequency: f64, damping: f64, before: (f64, f64)| {
        let natural = TAU * frequency;
        let mut normal = nalgebra::Matrix5::<f64>::zeros();
        let mut right = nalgebra::Vector5::<f64>::zeros();
        let mut total = 0.0;
        for &k in &lines {
            let omega = TAU * width * k as f64;
            let j = Complex64::new(0.0, omega);
            let stiff = Complex64::new(natural * natural, 2.0 * damping * natural * omega);
            let g = stiff / (stiff - omega * omega);
            let weight = 1.0 / (j * (before.0 + before.1 * g)).norm_sqr();
            let terms = [j * w[k], j * g * w[k], w[k], s[k], -j * t[k]];
            for a in 0..5 {
                right[a] += weight * (terms[a].conj() * t[k]).re;
                for b in a..5 {
                    normal[(a, b)] += weight * (terms[a].conj() * terms[b]).re;
                }
            }
            total += weight * t[k].norm_sqr();
        }
        normal.fill_lower_triangle_with_upper_triangle();
        let scale = normal.diagonal().map(|d| 1.0 / d.sqrt());
        let scaled = nalgebra::Matrix5::from_fn(|a, b| normal[(a, b)] * scale[a] * scale[b]);
        let found = scaled.cholesky()?.solve(&right.component_mul(&scale)).component_mul(&scale);
        let residual = ((total - found.dot(&right)).max(0.0) / all).sqrt();
        let (inertia, of_mass) = (found[0], found[1]);
        let response = Response {
            slosh_frequency: frequency,
            slosh_damping: damping,
            resonance_frequency: frequency * (1.0 + of_mass / inertia).sqrt(),
            slosh_mass: of_mass / bench.inertia(1.0),
            inertia,
            fit: 0.0,
        };
        (inertia > 0.0 && of_mass > 0.0).then_some((residual, response))
    };
    let steps = ((band.1 / band.0).ln() / FREQUENCY_FINENESS) as u32;
    let grid = |damping: f64, low: f64, fineness: f64, count: u32| {
        (0..count).map(move |k| (low * (fineness * f64::from(k)).exp(), damping))
    };
    let over_band = |damping: &f64| {
        let fineness = (10.0 * damping * FREQUENCY_FINENESS).sqrt().max(FREQUENCY_FINENESS);
        grid(*damping, band.0, fineness, steps).filter(|(f, _)| *f < band.1)
    };
    let mut weights = (1.0, 0.1);
    let mut best: Option<(f64, Response)> = None;
    for _ in 0..3 {
        let candidates: Vec<(f64, f64)> = match best {
            None => DAMPINGS.iter().flat_map(over_band).collect(),
            Some((_, near)) => [0.5, 0.7, 1.0, 1.4, 2.0]
                .iter()
                .flat_map(|z| grid(z * near.slosh_damping, near.slosh_frequency * 0.99, 2e-4, 100))
                .collect(),
        };
        let found = candidates.into_iter().filter_map(|(f, z)| try_mode(f, z, weights));
        let Some(found) = found.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        weights = (found.1.inertia, bench.inertia(found.1.slosh_mass));
        best = Some(found);
    }
    best.filter(|(residual, _)| *residual < 0.3)
}

/// Returns a start from antiresonance, resonance and the inertia at both ends of the band, for recordings that the transfer
/// function does not fit because large amplitudes distort the resonance peak. Without viscous friction, the resonance ω_p and the
/// antiresonance ω satisfy ω_p² = ω²(1 + m r²/I0).
fn from_features(measured: &FrequencyResponse, bench: Bench) -> Option<Response> {
    let features = Features::find(measured);
    let (f, fp) = (features.f_dip?, features.f_res?);
    let ratio = (fp / f).powi(2) - 1.0;
    // far from resonance and antiresonance, Ω/τ = (ω² − Ω²)/(jΩ I0 (ω_p² − Ω²))
    let inertias: Vec<f64> = measured
        .frequency
        .iter()
        .zip(&measured.response)
        .filter(|(g, _)| **g < 0.9 * f || **g > 1.1 * fp)
        .map(|(g, h)| ((f * f - g * g) / (fp * fp - g * g)).abs() / (TAU * g * h.norm()))
        .collect();
    let inertia = median(&inertias)?;
    Some(Response {
        slosh_frequency: f,
        slosh_damping: 0.005,
        resonance_frequency: fp,
        slosh_mass: ratio * inertia / bench.inertia(1.0),
        inertia,
        fit: 0.0,
    })
}

/// Returns a start of the friction from the balance of mean power over windows of 20 s, ⟨τω⟩ = T⟨|ω|⟩ + δ⟨τ'ω⟩, with the friction
/// torque T and a delay δ. The delay is needed because torque and rate are nearly 90° out of phase, so that a small delay looks
/// like power. First δ is estimated by least squares, then T as the median over the windows, because the liquid takes as much
/// power as it gives back in most of them. T is divided into b, c and d for the speeds of the recording.
fn friction(recordings: &[Recording]) -> Start {
    // for each window: mean power and mean of τ'ω, both divided by the mean of |ω|, and this mean
    let mut windows: Vec<[f64; 3]> = Vec::new();
    for r in recordings {
        let width = ((20.0 / r.step()) as usize).max(3);
        for k in (1..r.rate.len().saturating_sub(width)).step_by(width) {
            let mean = |f: &dyn Fn(usize) -> f64| (k..k + width).map(f).sum::<f64>() / width as f64;
            let offset = mean(&|i| r.rate[i]);
            let speed = mean(&|i| (r.rate[i] - offset).abs());
            let power = mean(&|i| r.torque[i] * (r.rate[i] - offset));
            let slope =
                |i: usize| (r.torque[i + 1] - r.torque[i - 1]) / (r.time[i + 1] - r.time[i - 1]);
            let late = mean(&|i| slope(i) * (r.rate[i] - offset));
            if speed > 0.0 {
                windows.push([power / speed, late / speed, speed]);
            }
        }
    }
    let (powers, lates): (Vec<f64>, Vec<f64>) = windows.iter().map(|w| (w[0], w[1])).unzip();
    let slope = correlation(&powers, &lates) * deviation(&powers) / deviation(&lates);
    let delay = if windows.len() > 4 && slope.abs() < DELAY.0 { slope } else { 0.0 };
    let torque = |[power, late, _]: &[f64; 3]| power - delay * late;
    let (torques, speeds): (Vec<f64>, Vec<f64>) =
        windows.iter().map(|w| (torque(w), w[2])).filter(|(torque, _)| *torque > 0.0).unzip();
    let torque = median(&torques).unwrap_or(1e-3);
    let middle = median(&speeds).unwrap_or(1e-2);
    let fastest = quantile(&speeds, 0.99).unwrap_or(1e-2);
    // the peak of a sine is π/2 times its mean absolute value
    let (b, omega_s) = (0.1 * torque / middle, 0.5 * PI * fastest);
    let (c, stribeck) = (0.55 * torque, 0.35 * torque);
    Start { zeta: 0.003, b, c, stribeck, omega_s, ..Start::default() }
}

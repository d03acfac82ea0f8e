//! What a planned experiment will tell: torques made for identification, and the Cramér–Rao bound of
//! each parameter before anything is recorded.

use std::f64::consts::TAU;

use anyhow::{Result, ensure};
use bench::random::Random;
use host::fmi2::Fmu;

use crate::fit::Problem;
use crate::noise::Noise;
use crate::recording::Recording;
use crate::simulate::Setup;
use crate::unknown::Unknown;

/// A random-phase odd multisine with detection lines (Pintelon and Schoukens, System Identification,
/// chapter 4): Σ a_k sin(2π k f_0 t + φ_k) over odd k, one of each group of [`GROUP`] left out at random.
///
/// What the response shows at a left-out odd line is odd nonlinear distortion, at even lines even
/// distortion; between lines (in records of several periods) it is noise.
#[derive(Clone, Debug)]
pub struct Multisine {
    /// Length of a period, s; lines are 1/period apart.
    pub period: f64,
    /// Numbers k of the lines with power.
    pub lines: Vec<u32>,
    /// Odd lines of the band without power.
    pub detection: Vec<u32>,
    /// a, N·m, the same for all lines.
    amplitude: f64,
    phases: Vec<f64>,
}

/// Odd lines in a group, of which one is left out.
pub const GROUP: usize = 4;

impl Multisine {
    /// Lines between two frequencies (Hz), the largest torque being `peak` (N·m). The phases with the
    /// smallest crest factor of 20 draws are taken.
    pub fn new(period: f64, band: (f64, f64), peak: f64, seed: u64) -> Result<Self> {
        ensure!(0.0 < band.0 && band.0 < band.1, "a multisine's band must be 0 < f0 < f1");
        ensure!(peak > 0.0 && period > 0.0, "peak torque and period must be positive");
        let mut random = Random::new(seed, 0);
        let first = (band.0 * period).ceil() as u32 | 1;
        let odd: Vec<u32> = (first..=(band.1 * period).floor() as u32).step_by(2).collect();
        ensure!(
            odd.len() >= 2 * GROUP,
            "period {period} s is too short for the band: too few lines"
        );
        let (mut lines, mut detection) = (Vec::new(), Vec::new());
        for group in odd.chunks(GROUP) {
            let left_out = (random.uniform() * GROUP as f64) as usize;
            for (k, line) in group.iter().enumerate() {
                if k == left_out { detection.push(*line) } else { lines.push(*line) }
            }
        }
        let mut best: Option<(f64, Self)> = None;
        for _ in 0..20 {
            let phases = lines.iter().map(|_| TAU * random.uniform()).collect();
            let one = Multisine {
                period,
                lines: lines.clone(),
                detection: detection.clone(),
                amplitude: 1.0,
                phases,
            };
            let largest =
                (0..2000).map(|k| one.at(period * f64::from(k) / 2000.0).abs()).fold(0.0, f64::max);
            if best.as_ref().is_none_or(|(other, _)| largest < *other) {
                best = Some((largest, one));
            }
        }
        let (largest, one) = best.expect("twenty draws");
        Ok(Multisine { amplitude: peak / largest, ..one })
    }

    /// Torque at `t` (s), N·m.
    pub fn at(&self, t: f64) -> f64 {
        let tones = self.lines.iter().zip(&self.phases);
        let turn = (t / self.period).fract();
        self.amplitude
            * tones.map(|(&k, phase)| (TAU * f64::from(k) * turn + phase).sin()).sum::<f64>()
    }
}

/// Standard deviation that no unbiased estimate can beat, for each unknown at its start, from a torque
/// and a gyro's noise.
pub fn cramer_rao(
    fmu: &Fmu,
    setup: Setup,
    (time, torque): (Vec<f64>, Vec<f64>),
    unknowns: Vec<Unknown>,
    noise: Noise,
) -> Result<Vec<(String, f64, f64)>> {
    let rate = vec![0.0; time.len()];
    let recording = [Recording::of("plan", time, torque, rate)];
    let mut problem = Problem::new(fmu, setup, &recording, unknowns);
    problem.channels[0].noise = noise;
    let x = problem.start();
    let covariance = problem.information(&x)?;
    let deviation = |i: usize| covariance.x[(i, i)].sqrt();
    Ok(problem
        .unknowns
        .iter()
        .enumerate()
        .map(|(i, u)| (u.quantity.name(), u.start, deviation(i) * u.scale.slope(x[i]).abs()))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_multisine_has_odd_lines_alone_and_its_peak() {
        let torque = Multisine::new(100.0, (1.25, 3.5), 0.25, 1).unwrap();
        assert!(torque.lines.iter().chain(&torque.detection).all(|k| k % 2 == 1));
        assert!(torque.detection.len() >= torque.lines.len() / GROUP);
        let largest =
            (0..20_000).map(|k| torque.at(f64::from(k) * 0.005).abs()).fold(0.0, f64::max);
        // the search looks every 0.05 s, at 3.5 Hz within cos(π 0.05 3.5) of a crest
        assert!((0.2499..0.29).contains(&largest), "{largest}");
        // odd lines alone: the second half of a period is the first with the other sign
        assert!((torque.at(13.7) + torque.at(63.7)).abs() < 1e-9);
    }
}

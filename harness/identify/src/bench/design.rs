//! Design of experiments: torques for an identification, and the Cramér–Rao bound of each parameter before the recording.

use std::f64::consts::TAU;

use analysis::linear::Linear;
use analysis::random::Random;
use analysis::statistics::peak;
use anyhow::{Result, bail, ensure};
use files::budget;
use host::fmu::Fmu;
use nalgebra::Matrix5;

use crate::bench::nominal::{Nominal, PARAMETERS};
use crate::bench::options::Options;
use crate::bench::problem;
use crate::bench::simulate::Setup;
use crate::engine::minimum::Minimum;
use crate::engine::{Fit, Hold, Solution};
use crate::input::recording::Recording;
use crate::input::tolerance::Tolerances;
use crate::tuning::{ANGLE_ROUNDS, LINE_GROUP, SPREAD_POWER};
use analysis::gauss_markov::Noise;
use names::hubslosh::{FrictionModel, SloshModel, slosh};

/// A random-phase odd multisine with detection lines (Pintelon and Schoukens, System Identification, chapter 4): Σ a_k sin(2π k
/// f_0 t + φ_k) over odd k. One line of each group of [`LINE_GROUP`] is left out at random.
///
/// In the response, power at an odd line that was left out is odd nonlinear distortion, power at even lines is even distortion,
/// and power between lines (in recordings of several periods) is noise.
#[derive(Clone, Debug)]
pub struct Multisine {
    /// Length of a period, s. Lines are 1/period apart.
    pub period: f64,
    pub lines: Vec<u32>,
    /// Odd lines of the band without power.
    pub detection: Vec<u32>,
    amplitudes: Vec<f64>,
    phases: Vec<f64>,
}

impl Multisine {
    /// Creates a multisine with lines between two frequencies (Hz) and the largest torque `peak` (N·m). Phases are drawn 20
    /// times; those with the smallest crest factor are used, because they give the most power for this peak.
    pub fn new(period: f64, band: (f64, f64), peak: f64, seed: u64) -> Result<Self> {
        let odd = odd_lines(period, band, peak)?;
        let mut random = Random::new(seed, 0);
        let (mut lines, mut detection) = (Vec::new(), Vec::new());
        for group in odd.chunks(LINE_GROUP) {
            let left_out = (random.uniform() * LINE_GROUP as f64) as usize;
            for (k, line) in group.iter().enumerate() {
                if k == left_out { detection.push(*line) } else { lines.push(*line) }
            }
        }
        let amplitudes = vec![1.0; lines.len()];
        let phases = vec![0.0; lines.len()];
        let flat = Multisine { period, lines, detection, amplitudes, phases };
        Ok(flat.drawn(peak, &mut random))
    }

    /// Returns a multisine with the same frequencies and new random phases. `shares` are the fractions of the power at
    /// these frequencies, `peak` is the largest torque, N·m, and `seed` selects the phases.
    pub fn shaped(&self, shares: &[f64], peak: f64, seed: u64) -> Self {
        let amplitudes = shares.iter().map(|p| p.sqrt()).collect();
        Multisine { amplitudes, ..self.clone() }.drawn(peak, &mut Random::new(seed, 1))
    }

    /// Draws phases 20 times, uses those with the smallest crest factor, and scales the largest torque to `peak` (N·m).
    fn drawn(self, peak: f64, random: &mut Random) -> Self {
        let mut best: Option<(f64, Self)> = None;
        for _ in 0..20 {
            let phases = self.lines.iter().map(|_| TAU * random.uniform()).collect();
            let one = Multisine { phases, ..self.clone() };
            let largest = (0..2000)
                .map(|k| one.at(self.period * f64::from(k) / 2000.0).abs())
                .fold(0.0, f64::max);
            if best.as_ref().is_none_or(|(other, _)| largest < *other) {
                best = Some((largest, one));
            }
        }
        let (largest, one) = best.expect("twenty draws");
        one.scaled(peak / largest)
    }

    pub fn scaled(&self, factor: f64) -> Self {
        let amplitudes = self.amplitudes.iter().map(|a| a * factor).collect();
        Multisine { amplitudes, ..self.clone() }
    }

    /// Returns the frequencies of the lines with power, Hz.
    pub fn frequencies(&self) -> Vec<f64> {
        self.lines.iter().map(|&k| f64::from(k) / self.period).collect()
    }

    pub fn at(&self, t: f64) -> f64 {
        let turn = (t / self.period).fract();
        let tones = self.lines.iter().zip(&self.amplitudes).zip(&self.phases);
        tones.map(|((&k, a), phase)| a * (TAU * f64::from(k) * turn + phase).sin()).sum()
    }
}

/// Refuses a multisine with too many lines for `rows` values. It is called before the phases are drawn, because drawing them
/// alone would take seconds.
///
/// # Errors
/// If it is too much work, or [`Multisine::new`] refuses the band, the period or the peak.
pub fn check_rows(period: f64, band: (f64, f64), peak: f64, rows: usize) -> Result<()> {
    let odd = odd_lines(period, band, peak)?.len();
    let lines = odd - odd / LINE_GROUP;
    let sines = (rows as u64).saturating_mul(lines as u64);
    ensure!(
        sines <= budget::SINES,
        "a multisine with {rows} rows and {lines} lines needs {:.1e} values of sines (allowed: at most {:.0e}); choose a shorter record, a narrower band or a shorter period",
        sines as f64,
        budget::SINES as f64
    );
    Ok(())
}

fn odd_lines(period: f64, band: (f64, f64), peak: f64) -> Result<Vec<u32>> {
    ensure!(0.0 < band.0 && band.0 < band.1, "a multisine's band must be 0 < f0 < f1");
    ensure!(
        peak > 0.0 && period > 0.0 && peak.is_finite() && period.is_finite(),
        "peak torque and period must be positive numbers"
    );
    let lines = (band.1 - band.0) * period / 2.0;
    ensure!(
        lines <= budget::LINES as f64 && band.1 * period <= f64::from(u32::MAX),
        "a band from {} to {} Hz has {lines:.1e} odd lines at a period of {period} s (allowed: at \
         most {})",
        band.0,
        band.1,
        budget::LINES
    );
    let first = (band.0 * period).ceil() as u32 | 1;
    let odd: Vec<u32> = (first..=(band.1 * period).floor() as u32).step_by(2).collect();
    ensure!(
        odd.len() >= 2 * LINE_GROUP,
        "period {period} s is too short for the band: too few lines"
    );
    Ok(odd)
}

/// Returns the D-optimal power of lines at these frequencies (Hz): it maximises the determinant of the information matrix of a
/// linear bench's five parameters. A fraction [`SPREAD_POWER`] is spread evenly over all lines.
///
/// ```text
/// maximise ln det Σ p_k A_k,  A_k = Re(J_kᴴ J_k),  J_k = ∂H(f_k)/∂ ln(f, ζ, m, I0, b):
/// p_k ← p_k tr(M⁻¹ A_k)/5
/// ```
///
/// (Titterington's iteration, in which the determinant never decreases; Goodwin & Payne, Dynamic System
/// Identification, 1977, chapter 6.)
pub fn d_optimal(plant: &Linear, frequencies: &[f64]) -> Vec<f64> {
    let moved = |which: usize, by: f64| {
        let mut moved = plant.clone();
        let mode = &mut moved.modes[0];
        let value = match which {
            0 => &mut mode.frequency,
            1 => &mut mode.damping,
            2 => &mut mode.mass,
            3 => &mut moved.inertia,
            _ => &mut moved.friction,
        };
        *value *= 1.0 + by;
        moved
    };
    let step = 1e-5;
    let pairs: Vec<(Linear, Linear)> = (0..5).map(|i| (moved(i, step), moved(i, -step))).collect();
    let information: Vec<Matrix5<f64>> = frequencies
        .iter()
        .map(|&f| {
            let slope: Vec<_> =
                pairs.iter().map(|(a, b)| (a.response(f) - b.response(f)) / (2.0 * step)).collect();
            Matrix5::from_fn(|i, j| (slope[i].conj() * slope[j]).re)
        })
        .collect();
    let count = frequencies.len() as f64;
    let mut shares = vec![1.0 / count; frequencies.len()];
    for _ in 0..300 {
        let total: Matrix5<f64> = information.iter().zip(&shares).map(|(a, p)| a * *p).sum();
        let Some(inverse) = total.try_inverse() else { break };
        for (share, a) in shares.iter_mut().zip(&information) {
            *share *= (inverse * a).trace() / 5.0;
        }
    }
    shares.iter().map(|p| (1.0 - SPREAD_POWER) * p + SPREAD_POWER / count).collect()
}

#[derive(Clone, Copy, Debug)]
pub struct Wheel {
    pub torque: f64,
    pub inertia: f64,
    /// Speed at the start, and smallest and largest allowed speed, rad/s.
    pub speeds: [f64; 3],
}

impl Wheel {
    /// Returns the wheel's smallest and largest speed, rad/s, under a torque τ on the hub. The speed W follows I_w W' = −τ with
    /// the wheel's inertia I_w.
    pub fn range(&self, time: &[f64], torque: &[f64]) -> (f64, f64) {
        let mut speed = self.speeds[0];
        let (mut least, mut largest) = (speed, speed);
        for (t, tau) in time.windows(2).zip(torque.windows(2)) {
            speed -= (tau[0] + tau[1]) / 2.0 * (t[1] - t[0]) / self.inertia;
            (least, largest) = (least.min(speed), largest.max(speed));
        }
        (least, largest)
    }

    /// Returns the largest factor (at most 1) by which a torque can be multiplied so that the wheel stays
    /// within its speed limits.
    pub fn factor(&self, time: &[f64], torque: &[f64]) -> f64 {
        let (least, largest) = self.range(time, torque);
        let [start, low, high] = self.speeds;
        [
            self.torque / peak(torque),
            (start - low) / (start - least),
            (high - start) / (largest - start),
        ]
        .into_iter()
        .filter(|f| f.is_finite())
        .fold(1.0, f64::min)
    }
}

/// Returns the largest slosh angle of the first mode under a torque that begins at rest, rad.
pub fn slosh_angle(fmu: &Fmu, setup: &Setup, time: &[f64], torque: &[f64]) -> Result<f64> {
    let rate = vec![0.0; time.len()];
    let recording = Recording::of("plan", time.to_vec(), torque.to_vec(), rate);
    Ok(peak(&setup.run(fmu, &[], &recording, 0.0)?.slosh_angle))
}

/// Returns the largest factor (at most 1) by which a torque can be multiplied so that the slosh angle stays within `limit`, rad.
pub fn within_angle(
    fmu: &Fmu,
    setup: &Setup,
    time: &[f64],
    torque: &[f64],
    limit: f64,
) -> Result<f64> {
    let angle = |factor: f64| {
        let scaled: Vec<f64> = torque.iter().map(|t| factor * t).collect();
        slosh_angle(fmu, setup, time, &scaled)
    };
    if angle(1.0)? <= limit {
        return Ok(1.0);
    }
    // Bisection, because the angle is not proportional to the torque: dry friction takes the same torque at any amplitude.
    let (mut within, mut beyond) = (0.0, 1.0);
    for _ in 0..ANGLE_ROUNDS {
        let factor = 0.5 * (within + beyond);
        *(if angle(factor)? <= limit { &mut within } else { &mut beyond }) = factor;
    }
    ensure!(within > 0.0, "no torque of this shape keeps the liquid within {limit} rad");
    Ok(within)
}

/// Returns the geometric mean of the relative standard deviations, by which plans are compared: a smaller value means
/// more information. An unknown with the expected value 0, such as a delay or a bias, has no relative standard deviation
/// and is left out.
pub fn merit(bounds: &[(String, f64, f64)]) -> f64 {
    let relative = bounds.iter().filter(|(_, value, _)| *value != 0.0);
    let logarithms: Vec<f64> = relative.map(|(_, value, std)| (std / value.abs()).ln()).collect();
    analysis::statistics::mean(&logarithms).exp()
}

/// Returns the name, expected value and Cramér–Rao bound of each unknown for a planned torque and the noise of a gyro. The bound
/// is the standard deviation that the engine would report at the start values, with its weak priors. With `sensor_errors`, the
/// delay, the gyro's bias and the asymmetry of the friction are unknown as well.
///
/// # Errors
/// If the hub does not turn, some combination of the unknowns has no influence on its rate, or the FMU refuses to run.
pub fn cramer_rao(
    fmu: &Fmu,
    settings: &[(String, String)],
    (time, torque): (Vec<f64>, Vec<f64>),
    sensor_errors: bool,
    noise: Noise,
) -> Result<Vec<(String, f64, f64)>> {
    let largest = peak(&torque);
    let rate = vec![0.0; time.len()];
    let recordings = [Recording::of("plan", time, torque, rate)];
    // a value that is set for an unknown is an expected value, not a known one
    let is_expected =
        |name: &str| PARAMETERS.contains(&name) || name == slosh::ZETA_FROM_CORRELATION;
    let known = settings.iter().filter(|(name, _)| !is_expected(name)).cloned();
    let options = Options {
        settings: known.collect(),
        sensor_errors,
        gyro_scale: 0.0,
        tolerances: Tolerances::NONE,
        intersample: Some(Hold::FirstOrderHold),
        ..Options::default()
    };
    let nominal = Nominal::of(fmu, settings, &[])?;
    let model = settings.iter().find(|(name, _)| name == slosh::MODEL);
    let model = model.map_or(SloshModel::Linear.name(), |(_, model)| model.as_str());
    let pair = (model, FrictionModel::Stribeck.name());
    let (system, unknowns, starts) =
        problem::system(fmu, &recordings, &options, pair, &[nominal.start])?;
    let mut problem = problem::problem(&system, unknowns, starts, &options);
    for signal in &mut problem.signals {
        signal.white = noise.white;
    }
    let values = problem.starts[0].clone();
    let motion =
        problem.system.run(&values, 0, recordings[0].time.len(), problem.holds[0], true)?;
    ensure!(
        motion.outputs[0].iter().any(|rate| *rate != 0.0),
        "the planned torque, up to {largest:.2e} N·m, does not turn the hub: nothing can be estimated. Dry friction holds up to \
         friction.c + friction.d = {:.2e} N·m (allowed: a larger torque).",
        nominal.start.c + nominal.start.stribeck
    );
    problem.signals[0].measured.clone_from(&motion.outputs[0]);
    let mut fit = Fit::new(&problem);
    fit.set(vec![noise], 1.0);
    let point = fit.point(&fit.coordinates(&values), vec![motion]);
    let free = fit.free.clone();
    let mut minimum = Minimum { point, derivatives: None, decrement: 0.0, free };
    let derivatives = fit.derivatives_at(&mut minimum)?;
    let blind =
        (0..fit.free.len()).find(|j| fit.free[*j] && derivatives.matrix.column(*j).norm() == 0.0);
    if let Some(j) = blind {
        bail!("{} has no influence on the rate under this torque", problem.unknowns[j].name);
    }
    let found = Solution::at(fit, minimum).draw(false)?;
    let row = |k: usize| {
        let name = found.names[k].clone();
        let value = match PARAMETERS.contains(&name.as_str()) {
            true => nominal.start.parameter(&name),
            false => found.values[k],
        };
        (name, value, found.std(k))
    };
    Ok((0..found.names.len()).map(row).collect())
}

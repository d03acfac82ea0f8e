//! Three poles and two zeros in the frequency domain, and what they say of tank, liquid and hub, with
//! intervals.
//!
//! ```text
//! Y_k = e^{−sδ} B(s)/A(s) U_k + T(s)/A(s) + V_k,   s = 2πj f_k
//! B = b2 s² + b1 s + b0,   A = s³ + a2 s² + a1 s + a0
//! ```
//!
//! U and Y are the discrete Fourier transforms of the whole record, without a window; T, a polynomial, is what
//! the record's ends leave in them (Pintelon & Schoukens, System Identification, 2nd ed., chapters 6 and 9).
//! V_k are then independent from line to line, of the variance σ²(f) that the residual shows around f, and
//! weighted least squares is maximum likelihood: (JᵀJ)⁻¹ is the estimates' covariance. Noise and whatever
//! is not linear in the plant are both in σ², as long as the latter looks like noise.
//!
//! Back to the bench (thesis 6.7 corrected, μ = m r²/I0):
//!
//! ```text
//! b1/b2 = 2ζω,  b0/b2 = ω²,  b2 = 1/I0
//! a0 = ω² b/I0,  a1 = ω²(1 + μ) + 2ζω b/I0,  a2 = b/I0 + 2ζω(1 + μ)
//! ```
//!
//! Six coefficients, five unknowns: that a2 is what the others say tests the structure.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use analysis::Complex64;
use analysis::transfer_function::TransferFunction;
use anyhow::{Context, Result, ensure};
use nalgebra::DMatrix;
use serde::Serialize;
use signals::fourier::Forward;

use super::{Identified, Method, Needs, Task};
use crate::estimate::Estimated;
use crate::least_squares::{differences, minimise};
use crate::nominal::{Bench, Nominal};
use crate::recording::{self, Recording};
use crate::simulate::Intersample;
use crate::start;
use crate::uncertainty::Covariance;

/// Degree of T. Two are the plant's own; two more take what sampling folds back.
const TRANSIENT: usize = 4;
/// Coefficients of B and A, and the delay.
const PLANT: usize = 7;
/// Lines on each side over which the residual's variance is averaged.
const AROUND: usize = 40;
/// Rounds of weights.
const ROUNDS: usize = 5;
/// Residual over the gyro's noise beyond which the plant is not linear, or something else acts.
const MISFIT: f64 = 1.3;

/// The result: parameters of an upright cylinder; `measurement` is poles, zeros and what they say without a tank's
/// shape.
pub type Found = Identified<Details>;

/// What this method alone has to say.
#[derive(Clone, Debug, Serialize)]
pub struct Details {
    /// Sizes.
    pub fit: Fit,
}

/// Three poles and two zeros.
pub struct Frequency {
    /// What is known of the bench, by FMU name.
    pub settings: Vec<(String, String)>,
    /// What the torque did between rows.
    pub intersample: Intersample,
}

impl Method for Frequency {
    type Details = Details;

    const NEEDS: Needs = Needs { fmu: true, validation: false };

    fn identify(&self, task: &Task, _: &mut dyn FnMut(&str)) -> Result<Found> {
        let nominal = Nominal::of(task.fmu()?, &self.settings, &[])?;
        task.check_size(&nominal)?;
        identify(task.one()?, nominal.bench, self.intersample)
    }

    fn lines(found: &Found) -> Vec<String> {
        let Fit { lines, band, condition, .. } = found.details.fit;
        vec![format!(
            "{lines} lines from {:.3} to {:.3} Hz, condition number {condition:.0}",
            band.0, band.1
        )]
    }
}

/// Sizes of a fit.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Fit {
    /// Lines of the spectrum.
    pub lines: usize,
    /// First and last of them, Hz.
    pub band: (f64, f64),
    /// The residual over the gyro's noise, root mean square over the lines.
    pub over_noise: f64,
    /// a2 less what the other coefficients make of it, in standard deviations.
    pub structure: f64,
    /// Condition number of the sensitivities with columns of unit length.
    pub condition: f64,
}

/// One record's spectra and the fitted coefficients.
struct Problem {
    /// 2πf/unit.
    s: Vec<f64>,
    u: Vec<Complex64>,
    y: Vec<Complex64>,
    /// rad/s: the unit of s.
    unit: f64,
    /// Unit of the delay, s.
    step: f64,
    /// Size of y, the unit of T.
    size: f64,
}

impl Problem {
    fn polynomial(coefficients: &[f64], s: Complex64) -> Complex64 {
        coefficients.iter().fold(Complex64::default(), |sum, c| sum * s + c)
    }

    /// Y_k less the model's.
    fn left(&self, x: &[f64]) -> Vec<Complex64> {
        let delay = x[6] * self.step * self.unit;
        (0..self.s.len())
            .map(|k| {
                let s = Complex64::new(0.0, self.s[k]);
                let a = Self::polynomial(&[1.0, x[3], x[4], x[5]], s);
                let b = Self::polynomial(&x[..3], s) * (-s * delay).exp();
                let t = Self::polynomial(&x[PLANT..], s) * self.size;
                self.y[k] - (b * self.u[k] + t) / a
            })
            .collect()
    }
}

/// Local variance of the residual, |V|² on average over the neighbours, corrected for the coefficients fitted.
fn variances(left: &[Complex64], unknowns: usize) -> Vec<f64> {
    let count = left.len();
    let freedom = 1.0 - unknowns as f64 / (2 * count) as f64;
    let mut sums = vec![0.0];
    for v in left {
        sums.push(sums[sums.len() - 1] + v.norm_sqr());
    }
    (0..count)
        .map(|k| {
            let (from, to) = (k.saturating_sub(AROUND), (k + AROUND + 1).min(count));
            (sums[to] - sums[from]) / (to - from) as f64 / freedom
        })
        .collect()
}

/// Spectra of a signal at the lines `bins`.
fn spectrum(signal: &[f64], bins: &std::ops::RangeInclusive<usize>) -> Vec<Complex64> {
    let mean = signal.iter().sum::<f64>() / signal.len() as f64;
    let spectrum = Forward::new(signal.len()).of(signal.iter().map(|v| v - mean).collect());
    spectrum[bins.clone()].to_vec()
}

/// Fits a recording of a hub with slosh. `between`: what the torque did between rows.
pub fn identify(recording: &Recording, bench: Bench, intersample: Intersample) -> Result<Found> {
    let measured = start::response(recording)?;
    let rough = TransferFunction::fit(&measured).context("no transfer function fits")?;
    let (step, torque, rate) = recording.even();
    let count = torque.len();
    let bin = 1.0 / (step * count as f64);
    let band = (measured.frequency[0], measured.frequency[measured.frequency.len() - 1]);
    let bins = (band.0 / bin).ceil() as usize..=((band.1 / bin) as usize).min(count / 2 - 1);
    ensure!(
        bins.clone().count() > 4 * AROUND,
        "{}: {} lines of its spectrum lie within {:.2} to {:.2} Hz; {} are needed",
        recording.name,
        bins.clone().count(),
        band.0,
        band.1,
        4 * AROUND
    );
    let unit = TAU * (band.0 * band.1).sqrt();
    let s: Vec<f64> = bins.clone().map(|k| TAU * k as f64 * bin / unit).collect();
    // a torque joined by lines has sinc² of its samples' spectrum, one that is held sinc and half a row's delay
    let between = |s: &f64| {
        let half = s * unit * step / 2.0;
        let sinc = half.sin() / half;
        match intersample {
            Intersample::ZeroOrderHold => Complex64::from_polar(sinc, -half),
            Intersample::FirstOrderHold => Complex64::from(sinc * sinc),
            Intersample::BandLimited => Complex64::from(1.0),
        }
    };
    let u = spectrum(&torque, &bins).iter().zip(&s).map(|(u, s)| u * between(s)).collect();
    let y = spectrum(&rate, &bins);
    let size = (y.iter().map(Complex64::norm_sqr).sum::<f64>() / y.len() as f64).sqrt();
    let problem = Problem { s, u, y, unit, step, size };

    let (p, w, z) = (rough.real_pole / unit, rough.pole_omega / unit, rough.pole_damping);
    let [b2, b1, b0] = rough.numerator;
    let mut x = vec![b2 / unit, b1 / unit.powi(2), b0 / unit.powi(3)];
    x.extend([p + 2.0 * z * w, w * w + 2.0 * z * w * p, w * w * p, 0.0]);
    x.extend([0.0; TRANSIENT + 1]);
    let noise = recording::noise_level(&rate).max(crate::noise::FLOOR);
    let mut sigma = vec![noise * (count as f64).sqrt(); problem.s.len()];
    let mut converged = false;
    let mut steps = vec![1e-6; x.len()];
    let weighted = |x: &[f64], sigma: &[f64]| -> Vec<f64> {
        let scaled = problem.left(x).into_iter().zip(sigma).map(|(v, s)| v * (2f64.sqrt() / s));
        scaled.flat_map(|v| [v.re, v.im]).collect()
    };
    for _ in 0..ROUNDS {
        let residuals = |x: &[f64]| weighted(x, &sigma);
        let derivatives = |x: &[f64]| differences(&residuals, x, &steps);
        let minimum = minimise(&residuals, &derivatives, &x);
        converged = minimum.converged;
        x = minimum.x;
        // steps that are small against the standard deviations and large against rounding
        let norms: Vec<f64> = derivatives(&x).column_iter().map(|c| c.norm()).collect();
        steps = norms.iter().map(|n| (0.1 / n).clamp(1e-9, 1e-3)).collect();
        sigma = variances(&problem.left(&x), x.len()).into_iter().map(f64::sqrt).collect();
    }
    let jacobian = differences(&|x| weighted(x, &sigma), &x, &steps);
    let covariance = Covariance::of(&jacobian)
        .with_context(|| format!("{}: poles and zeros are not determined", recording.name))?;

    let names = [
        ("slosh_frequency", "Hz"),
        ("slosh_damping", "1"),
        ("resonance_frequency", "Hz"),
        ("resonance_damping", "1"),
        ("real_pole", "1/s"),
        ("inertia", "kg.m2"),
        ("mass_ratio", "1"),
        ("slosh_mass", "kg"),
        ("friction", "N.m.s"),
        ("delay", "s"),
        ("structure", "1/s"),
        ("tank.d", "m"),
        ("tank.h", "m"),
        ("hub.I", "kg.m2"),
    ];
    let physical = |x: &[f64]| translated(x, unit, step, bench);
    let values = physical(&x).context("the poles and zeros are not those of a hub with slosh")?;
    // the delta method
    let mut slope = DMatrix::zeros(names.len(), x.len());
    for j in 0..PLANT {
        let by = 1e-3 * covariance.x[(j, j)].sqrt();
        let at = |by: f64| {
            let mut moved = x.clone();
            moved[j] += by;
            physical(&moved)
        };
        let (Some(ahead), Some(behind)) = (at(by), at(-by)) else { continue };
        for i in 0..names.len() {
            slope[(i, j)] = (ahead[i] - behind[i]) / (2.0 * by);
        }
    }
    let of_values = &slope * &covariance.x * slope.transpose();
    let estimated = |i: usize| {
        let std = of_values[(i, i)].sqrt();
        let interval = [values[i] - 1.96 * std, values[i] + 1.96 * std];
        Estimated { value: values[i], std, std_noise: std, interval, unit: names[i].1.into() }
    };
    let mut response: BTreeMap<String, Estimated> =
        (0..names.len()).map(|i| (names[i].0.to_string(), estimated(i))).collect();
    let structure = response.remove("structure").map_or(0.0, |p| p.value / p.std);
    let mut parameters = BTreeMap::new();
    for name in ["tank.d", "tank.h", "hub.I"] {
        parameters.extend(response.remove(name).map(|p| (name.to_string(), p)));
    }
    for (name, of) in [("slosh.zeta", "slosh_damping"), ("friction.b", "friction")] {
        parameters.insert(name.into(), response[of].clone());
    }
    let floor = noise * noise * count as f64;
    let over_noise = (sigma.iter().map(|s| s * s / floor).sum::<f64>() / sigma.len() as f64).sqrt();
    let setting = |(name, value): (&str, &str)| (name.to_string(), value.to_string());
    let fit = Fit {
        lines: problem.s.len(),
        band,
        over_noise,
        structure,
        condition: covariance.condition,
    };
    let described = over_noise < MISFIT && structure.abs() < 3.3;
    let verdict = words(&fit, described, converged);
    Ok(Found {
        parameters,
        settings: [
            ("slosh.model", "linear"),
            ("slosh.zeta_from_correlation", "false"),
            ("friction.model", "viscous"),
        ]
        .map(setting)
        .into(),
        measurement: response,
        correlations: (Vec::new(), Vec::new()),
        converged,
        described: Some(described),
        verdict,
        done: Vec::new(),
        residuals: Vec::new(),
        details: Details { fit },
    })
}

/// Coefficients (s in units of `unit`) as the quantities in the order of their names.
fn translated(x: &[f64], unit: f64, step: f64, bench: Bench) -> Option<Vec<f64>> {
    let (b2, b1, b0) = (x[0] * unit, x[1] * unit.powi(2), x[2] * unit.powi(3));
    let (a2, a1, a0) = (x[3] * unit, x[4] * unit.powi(2), x[5] * unit.powi(3));
    if b2 <= 0.0 || b0 <= 0.0 {
        return None;
    }
    let w = (b0 / b2).sqrt();
    let zeta = b1 / b2 / (2.0 * w);
    let inertia = 1.0 / b2;
    let friction = a0 / (w * w) * inertia;
    let ratio = (a1 - 2.0 * zeta * w * friction / inertia) / (w * w) - 1.0;
    let structure = a2 - friction / inertia - 2.0 * zeta * w * (1.0 + ratio);
    // the real root of A by Newton's method from the side where it is slow, then the pair
    let mut root = -a0 / a1;
    for _ in 0..60 {
        let value = ((root + a2) * root + a1) * root + a0;
        root -= value / ((3.0 * root + 2.0 * a2) * root + a1);
    }
    let (sum, product) = (a2 + root, a1 + root * (a2 + root));
    let pair = (product > 0.0).then(|| product.sqrt())?;
    let mass = ratio * inertia / bench.arm.powi(2);
    let (d, h) = if mass > 0.0 { start::tank(w / TAU, mass, bench) } else { (f64::NAN, f64::NAN) };
    let rigid = bench.density * std::f64::consts::PI / 4.0 * d * d * h - mass;
    let hub = inertia - rigid * bench.arm.powi(2);
    Some(vec![
        w / TAU,
        zeta,
        pair / TAU,
        sum / (2.0 * pair),
        -root,
        inertia,
        ratio,
        mass,
        friction,
        x[6] * step,
        structure,
        d,
        h,
        hub,
    ])
}

fn words(fit: &Fit, described: bool, converged: bool) -> Vec<String> {
    let mut words = Vec::new();
    if !converged {
        words.push("The search did not end at a minimum.".to_string());
    }
    words.push(if described {
        format!(
            "Three poles and two zeros describe the record: the residual is {:.2} times the gyro's noise, and the poles \
             are where the zeros, the inertia and the friction say ({:+.1} standard deviations).",
            fit.over_noise, fit.structure
        )
    } else {
        format!(
            "NOT DESCRIBED by three poles and two zeros: the residual is {:.2} times the gyro's noise, and the poles are \
             {:+.1} standard deviations from where zeros, inertia and friction say. Dry friction and large slosh are \
             not linear; the intervals hold for what looks like noise alone. Use the time domain \
             (hubslosh identify without --method).",
            fit.over_noise, fit.structure
        )
    });
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Multisine;
    use analysis::linear::{Linear, Mode};
    use analysis::random::Random;

    const BENCH: Bench = Bench { arm: 0.225, density: 1000.0, gravity: 9.81 };

    /// The bench with 10 cm of water, viscous friction, under two periods of a multisine from rest.
    fn clean() -> Recording {
        let mode = Mode { mass: 0.756_293_271_9, frequency: 2.343_618_143_1, damping: 0.002_975_7 };
        let inertia = 0.322414 + 1.330_431_108_5 * 0.225f64.powi(2);
        let plant = Linear { inertia, friction: 0.03793, arm: 0.225, modes: vec![mode] };
        let torque = Multisine::new(100.0, (1.25, 3.5), 0.1, 1).unwrap();
        let time: Vec<f64> = (0..10_000).map(|k| 0.02 * f64::from(k)).collect();
        let tau: Vec<f64> = time.iter().map(|&t| torque.at(t)).collect();
        let rate = plant.simulate(0.02, &tau, 0.0);
        Recording::of("linear", time, tau, rate)
    }

    #[test]
    fn ninety_five_percent_intervals_hold_the_truth_in_95_percent_of_records() {
        let clean = clean();
        let truth = [
            ("slosh_frequency", 2.343_618_143_1),
            ("slosh_damping", 0.002_975_7),
            ("mass_ratio", 0.756_293_271_9 * 0.225 * 0.225 / 0.389_767_074_9),
            ("inertia", 0.389_767_074_9),
            ("tank.d", 0.163),
            ("tank.h", 0.1),
            ("hub.I", 0.322414),
        ];
        let (seeds, mut inside) = (60, [0; 7]);
        for seed in 0..seeds {
            let mut random = Random::new(seed, 5);
            let mut one = clean.clone();
            one.rate.iter_mut().for_each(|w| *w += 4.07e-4 * random.normal());
            let found = identify(&one, BENCH, Intersample::FirstOrderHold).unwrap();
            assert!(
                found.converged && found.described == Some(true),
                "{seed}: {:?}",
                found.verdict
            );
            for (k, (name, value)) in truth.iter().enumerate() {
                let p = found.measurement.get(*name).or(found.parameters.get(*name)).unwrap();
                inside[k] += u64::from(p.interval[0] <= *value && *value <= p.interval[1]);
                // the tank to better than a percent, or nothing is learnt
                assert!(p.std < 0.05 * value, "{name}: {p:?}");
            }
        }
        // 99.9 % band of the binomial with 60 draws of 0.95: seven bands are looked at
        for (k, (name, _)) in truth.iter().enumerate() {
            assert!((50..=60).contains(&inside[k]), "{name}: {} of {seeds}", inside[k]);
        }
    }
}

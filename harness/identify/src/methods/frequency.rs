//! Three poles and two zeros in the frequency domain, and what they say of tank, liquid and hub, with
//! intervals.
//!
//! ```text
//! Y_k = e^{−sδ} B(s)/A(s) U_k + T(s)/A(s) + V_k,   s = 2πj f_k
//! B = b2 s² + b1 s + b0,   A = s³ + a2 s² + a1 s + a0
//! ```
//!
//! U and Y are the discrete Fourier transforms of the whole record, without a window; T, a polynomial, is the
//! transient of the record's ends (Pintelon & Schoukens, System Identification, 2nd ed., chapters 6 and 9).
//! V_k are then independent from line to line, of the variance σ²(f) that the residual shows around f, and
//! weighted least squares is maximum likelihood: (JᵀJ)⁻¹ is the estimates' covariance. Noise and whatever
//! is not linear in the plant are both in σ², as long as the latter looks like noise.
//!
//! Back to the bench: [`Plant`]. Scales of torque, gyro and clock, and the bench's arm, density and gravity, which no spectrum shows, count
//! with their tolerances: each moves the quantities by its standard deviation at first order.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use analysis::Complex64;
use analysis::statistics::{mean, noise_level};
use analysis::transfer_function::TransferFunction;
use anyhow::{Context, Result, ensure};
use serde::Serialize;
use signals::fourier::{Forward, Inverse};

use super::{Method, Needs, Task};
use crate::estimate::Estimated;
use crate::fit::bench::start::{self, Plant};
use crate::fit::covariance::Covariance;
use crate::input::recording::Recording;
use crate::input::tolerance::Tolerances;
use crate::model::bench::nominal::{self, Bench, Nominal};
use crate::model::bench::simulate::Intersample;
use crate::news::News;
use crate::tuning::{FREQUENCY_MISFIT, VARIANCE_LINES, WEIGHT_ROUNDS};
use crate::words::identified::{Identified, Residual};
use crate::words::page::{RATE, Sections};
use crate::words::verdict::{DOES_NOT_FIT, NO_MINIMUM};
use analysis::least_squares::{differences, minimise};
use names::hubslosh::{FrictionModel, G_AXIAL, SloshModel, fluid, friction, hub, slosh, tank};

/// Degree of T. Two are the plant's own; two more take what sampling folds back.
const TRANSIENT: usize = 4;
/// Coefficients of B and A, and the delay.
const PLANT: usize = 7;

/// The result: parameters of an upright cylinder; `measurement` is poles, zeros and what they say without a tank's
/// shape.
pub type Found = Identified<Details>;

/// Results that only this method has.
#[derive(Clone, Debug, Serialize)]
pub struct Details {
    /// Sizes.
    pub fit: Fit,
}

/// Three poles and two zeros.
pub struct Frequency {
    /// Known parameters of the bench, by FMU name.
    pub settings: Vec<(String, String)>,
    /// Intersample behaviour of the torque.
    pub intersample: Intersample,
    /// Relative standard deviations of what the recording does not show.
    pub tolerances: Tolerances,
    /// Relative standard deviation of the gyro's scale.
    pub gyro_scale: f64,
}

impl Method for Frequency {
    type Details = Details;

    const NEEDS: Needs = Needs { fmu: true, validation: false };

    fn identify(&self, task: &Task, _: &mut dyn FnMut(&News)) -> Result<Found> {
        let nominal = Nominal::of(task.fmu()?, &self.settings, &[])?;
        task.check_size(&nominal)?;
        let mut found = identify(task.one()?, nominal.bench, self)?;
        let assumed =
            nominal::assumed(task.fmu()?, &self.settings, &[tank::R, fluid::RHO, G_AXIAL])?;
        found.verdict.push(format!(
            "tank.d, tank.h and hub.I are those of an upright cylinder with {assumed}."
        ));
        Ok(found)
    }

    fn lines(found: &Found) -> Vec<String> {
        let Fit { lines, band, condition, .. } = found.details.fit;
        vec![format!(
            "{lines} lines from {:.3} to {:.3} Hz, condition number {condition:.0}",
            band.0, band.1
        )]
    }

    fn sections(found: &Found) -> Sections {
        Sections { condition: Some(found.details.fit.condition), ..Sections::default() }
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
    fn residual(&self, x: &[f64]) -> Vec<Complex64> {
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
fn variances(residual: &[Complex64], unknowns: usize) -> Vec<f64> {
    let count = residual.len();
    let freedom = 1.0 - unknowns as f64 / (2 * count) as f64;
    let mut sums = vec![0.0];
    for v in residual {
        sums.push(sums[sums.len() - 1] + v.norm_sqr());
    }
    (0..count)
        .map(|k| {
            let (from, to) =
                (k.saturating_sub(VARIANCE_LINES), (k + VARIANCE_LINES + 1).min(count));
            (sums[to] - sums[from]) / (to - from) as f64 / freedom
        })
        .collect()
}

/// Spectra of a signal at the lines `bins`.
fn spectrum(signal: &[f64], bins: &std::ops::RangeInclusive<usize>) -> Vec<Complex64> {
    let mean = mean(signal);
    let spectrum = Forward::new(signal.len()).of(signal.iter().map(|v| v - mean).collect());
    spectrum[bins.clone()].to_vec()
}

/// The signal of a spectrum that has lines in `bins` alone.
fn signal(lines: &[Complex64], bins: &std::ops::RangeInclusive<usize>, count: usize) -> Vec<f64> {
    let mut all = vec![Complex64::default(); count / 2 + 1];
    all[bins.clone()].copy_from_slice(lines);
    Inverse::new(count).of(all).iter().map(|value| value / count as f64).collect()
}

/// Fits a recording of a hub with slosh.
pub fn identify(recording: &Recording, bench: Bench, asked: &Frequency) -> Result<Found> {
    let Frequency { intersample, tolerances, gyro_scale, .. } = *asked;
    let measured = start::response(recording)?;
    let rough = TransferFunction::fit(&measured).context("no transfer function fits")?;
    let (step, torque, rate) = recording.even()?;
    let count = torque.len();
    let bin = 1.0 / (step * count as f64);
    let band = (measured.frequency[0], measured.frequency[measured.frequency.len() - 1]);
    let bins = (band.0 / bin).ceil() as usize..=((band.1 / bin) as usize).min(count / 2 - 1);
    ensure!(
        bins.clone().count() > 4 * VARIANCE_LINES,
        "{}: {} lines of its spectrum lie within {:.2} to {:.2} Hz; {} are needed",
        recording.name,
        bins.clone().count(),
        band.0,
        band.1,
        4 * VARIANCE_LINES
    );
    let unit = TAU * (band.0 * band.1).sqrt();
    let s: Vec<f64> = bins.clone().map(|k| TAU * k as f64 * bin / unit).collect();
    // first-order hold has sinc² of the samples' spectrum, zero-order hold sinc and half a row's delay
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

    let scaled = |[c2, c1, c0]: [f64; 3]| [c2 / unit, c1 / unit.powi(2), c0 / unit.powi(3)];
    let mut x = [scaled(rough.numerator), scaled(rough.denominator())].concat();
    x.push(0.0);
    x.extend([0.0; TRANSIENT + 1]);
    let noise = noise_level(&rate).max(analysis::gauss_markov::FLOOR);
    let mut sigma = vec![noise * (count as f64).sqrt(); problem.s.len()];
    let mut converged = false;
    let mut steps = vec![1e-6; x.len()];
    let weighted = |x: &[f64], sigma: &[f64]| -> Vec<f64> {
        let scaled = problem.residual(x).into_iter().zip(sigma).map(|(v, s)| v * (2f64.sqrt() / s));
        scaled.flat_map(|v| [v.re, v.im]).collect()
    };
    for _ in 0..WEIGHT_ROUNDS {
        let residuals = |x: &[f64]| weighted(x, &sigma);
        let derivatives = |x: &[f64]| differences(&residuals, x, &steps);
        let minimum = minimise(&residuals, &|x| Some(derivatives(x)), &x);
        converged = minimum.converged;
        x = minimum.x;
        // steps that are small against the standard deviations and large against rounding
        let norms: Vec<f64> = derivatives(&x).column_iter().map(|c| c.norm()).collect();
        steps = norms.iter().map(|n| (0.1 / n).clamp(1e-9, 1e-3)).collect();
        sigma = variances(&problem.residual(&x), x.len()).into_iter().map(f64::sqrt).collect();
    }
    let jacobian = differences(&|x| weighted(x, &sigma), &x, &steps);
    let covariance = Covariance::of(&jacobian, &[])?
        .with_context(|| format!("{}: poles and zeros are not determined", recording.name))?;

    let physical = |x: &[f64]| translated(x, (unit, step), bench, &Exact::default());
    let quantities =
        physical(&x).context("the poles and zeros are not those of a hub with slosh")?;
    // the delta method
    let steps: Vec<f64> =
        covariance.x.diagonal().iter().map(|variance| 1e-3 * variance.sqrt()).collect();
    let values = |x: &[f64]| physical(x).unwrap_or(quantities).map(|(.., value)| value).to_vec();
    let slope = differences(&values, &x, &steps);
    let of_values = &slope * &covariance.x * slope.transpose();
    let moved = Exact::each(&tolerances, gyro_scale).map(|off| {
        let there = translated(&x, (unit, step), bench, &off).unwrap_or(quantities);
        let pairs = there.iter().zip(&quantities);
        pairs.map(|(there, here)| there.2 - here.2).collect::<Vec<f64>>()
    });
    let floor = noise * noise * count as f64;
    let over_noise = (sigma.iter().map(|s| s * s / floor).sum::<f64>() / sigma.len() as f64).sqrt();
    let mut response = BTreeMap::new();
    for (i, (name, unit, value)) in quantities.into_iter().enumerate() {
        let std_noise = of_values[(i, i)].sqrt();
        let std = moved.iter().fold(std_noise, |std, moved| std.hypot(moved[i]));
        let estimated = Estimated { std_noise, ..Estimated::normal(value, std, unit) };
        response.insert(name.to_string(), estimated);
    }
    // a relation between coefficients holds whatever the scales are
    let structure = response.remove("structure").map_or(0.0, |p| p.value / p.std_noise);
    let fits = over_noise < FREQUENCY_MISFIT && structure.abs() < 3.3;
    if !fits {
        for estimated in response.values_mut() {
            estimated.interval = [f64::NAN; 2];
            estimated.determined = false;
        }
    }
    let mut parameters = BTreeMap::new();
    for name in [tank::D, tank::H, hub::I] {
        parameters.extend(response.remove(name).map(|p| (name.to_string(), p)));
    }
    for (name, of) in [(slosh::ZETA, "slosh_damping"), (friction::B, "friction")] {
        parameters.insert(name.into(), response[of].clone());
    }
    let setting = |(name, value): (&str, &str)| (name.to_string(), value.to_string());
    let fit = Fit {
        lines: problem.s.len(),
        band,
        over_noise,
        structure,
        condition: covariance.condition,
    };
    let time = (0..count).map(|k| recording.time[0] + k as f64 * step).collect();
    let residual = Residual {
        name: format!("{}, {:.3} to {:.3} Hz", recording.name, band.0, band.1),
        label: RATE.into(),
        time,
        measured: signal(&problem.y, &bins, count),
        residual: signal(&problem.residual(&x), &bins, count),
        noise: Some(noise),
        torque: Some(torque),
    };
    let verdict = words(&fit, fits, converged);
    Ok(Found {
        parameters,
        settings: [
            (slosh::MODEL, SloshModel::Linear.name()),
            (slosh::ZETA_FROM_CORRELATION, "false"),
            (friction::MODEL, FrictionModel::Viscous.name()),
        ]
        .map(setting)
        .into(),
        measurement: response,
        converged,
        fits: Some(fits),
        verdict,
        residuals: vec![residual],
        ..Found::new(Details { fit })
    })
}

/// A quantity's name, unit and value.
type Named = (&'static str, &'static str, f64);

/// Relative errors of what counts as exact.
#[derive(Clone, Copy, Default)]
struct Exact {
    torque: f64,
    gyro: f64,
    clock: f64,
    bench: [f64; 3],
}

impl Exact {
    /// Returns one error of its standard deviation each.
    fn each(tolerances: &Tolerances, gyro: f64) -> [Exact; 6] {
        let Tolerances { torque, clock, gravity, arm, density } = *tolerances;
        let none = Exact::default();
        [
            Exact { torque, ..none },
            Exact { gyro, ..none },
            Exact { clock, ..none },
            Exact { bench: [arm, 0.0, 0.0], ..none },
            Exact { bench: [0.0, density, 0.0], ..none },
            Exact { bench: [0.0, 0.0, gravity], ..none },
        ]
    }
}

/// Returns the bench's parameters for these coefficients (s in units of `unit`, the delay in `step`), if what counts as exact is off.
fn translated(
    x: &[f64],
    (unit, step): (f64, f64),
    bench: Bench,
    off: &Exact,
) -> Option<[Named; 14]> {
    let (unit, step) = (unit / (1.0 + off.clock), step * (1.0 + off.clock));
    let gain = 1.0 / (1.0 + off.gyro) / (1.0 + off.torque);
    let [arm, density, gravity] = off.bench.map(|part| 1.0 + part);
    let bench = Bench {
        arm: bench.arm * arm,
        density: bench.density * density,
        gravity: bench.gravity * gravity,
    };
    let scaled = |c: &[f64], gain: f64| {
        [c[0] * gain * unit, c[1] * gain * unit.powi(2), c[2] * gain * unit.powi(3)]
    };
    let (numerator, denominator) = (scaled(&x[..3], gain), scaled(&x[3..6], 1.0));
    let plant = Plant::of(numerator, denominator)?;
    // the real root of A by Newton's method from the side where it is slow, then the pair
    let [a2, a1, a0] = denominator;
    let mut root = -a0 / a1;
    for _ in 0..60 {
        let value = ((root + a2) * root + a1) * root + a0;
        root -= value / ((3.0 * root + 2.0 * a2) * root + a1);
    }
    let (sum, product) = (a2 + root, a1 + root * (a2 + root));
    let pair = (product > 0.0).then(|| product.sqrt())?;
    let (frequency, mass) = (plant.omega / TAU, plant.mass(bench));
    let (d, h) =
        if mass > 0.0 { start::tank(frequency, mass, bench) } else { (f64::NAN, f64::NAN) };
    let hub = plant.inertia - bench.inertia(bench.liquid(d, h) - mass);
    Some([
        ("slosh_frequency", "Hz", frequency),
        ("slosh_damping", "1", plant.zeta),
        ("resonance_frequency", "Hz", pair / TAU),
        ("resonance_damping", "1", sum / (2.0 * pair)),
        ("real_pole", "1/s", -root),
        ("inertia", "kg.m2", plant.inertia),
        ("mass_ratio", "1", plant.mass_ratio),
        ("slosh_mass", "kg", mass),
        ("friction", "N.m.s", plant.friction),
        ("delay", "s", x[6] * step),
        ("structure", "1/s", plant.structure),
        (tank::D, "m", d),
        (tank::H, "m", h),
        (hub::I, "kg.m2", hub),
    ])
}

fn words(fit: &Fit, fits: bool, converged: bool) -> Vec<String> {
    let mut words = Vec::new();
    if !converged {
        words.push(format!("{NO_MINIMUM}."));
    }
    words.push(if fits {
        format!(
            "Three poles and two zeros fit the record: the residual is {:.2} times the gyro's noise, and the poles agree with \
             zeros, inertia and friction ({:+.1} standard deviations).",
            fit.over_noise, fit.structure
        )
    } else {
        format!(
            "{DOES_NOT_FIT}: the residual of three poles and two zeros is {:.2} times the gyro's noise, and the poles are \
             {:+.1} standard deviations from those of zeros, inertia and friction. Dry friction and large slosh are not linear: \
             no interval is given. Use the time domain (hubslosh identify without --method).",
            fit.over_noise, fit.structure
        )
    });
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uncertainty::bench::design::Multisine;
    use analysis::linear::Linear;
    use analysis::random::Random;

    const BENCH: Bench = Bench { arm: 0.225, density: 1000.0, gravity: 9.81 };

    /// The bench with 10 cm of water, viscous friction, under two periods of a multisine from rest.
    fn clean() -> Recording {
        let plant = Linear::bench_10_cm(0.002_975_7);
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
            let exact = Frequency {
                settings: Vec::new(),
                intersample: Intersample::FirstOrderHold,
                tolerances: Tolerances::NONE,
                gyro_scale: 0.0,
            };
            let found = identify(&one, BENCH, &exact).unwrap();
            assert!(found.converged && found.fits == Some(true), "{seed}: {:?}", found.verdict);
            if seed == 0 {
                let page = Frequency::page(&found);
                for of in ["Residual over time", "Autocorrelation", "Phase from torque to rate"] {
                    assert!(page.contains(of), "{of}");
                }
            }
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

//! Frequency and damping from free decays ([`analysis::free_decay`]): recordings without torque of a wave height, a force, an
//! angle or a rate, after a tank was shaken once or a hub was pushed.

use analysis::free_decay::{self, LEAST_PERIODS, Record, Start};
use analysis::statistics::noise_level;
use anyhow::{Context, Result};
use serde::Serialize;
use signals::recording::{Quantity, quantity};

use crate::engine::minimum::{Curvature, places};
use crate::engine::search::solve;
use crate::engine::{
    Drift, ENDS, Hold, Motion, Part, Problem, Recorded, Role, Signal, Solution, System, Unknown,
};
use crate::estimate::{Estimated, mean_square};
use crate::input::recording::Recording;
use crate::news::News;
use crate::words::identified::{self, Identified, Report};
use crate::words::verdict::failed;

/// Amplitude of another oscillation in the residual, relative to the decaying oscillation, above which
/// the verdict mentions it.
const NAMED: f64 = 0.02;
/// Prior of the drift of a wave probe. Its width is large because almost nothing is known about this drift.
const DRIFT: Drift = Drift { size: 0.3, time: 1.0, width: 3.0 };

/// Result of a free decay. Its `measurement` contains the frequency f, the damping ratio ζ, the increase ζ_A of ζ with the
/// amplitude, and the hardening κ.
pub type Found = Identified<Details>;

#[derive(Clone, Debug, Serialize)]
pub struct Details {
    pub signal: String,
    pub amplitudes: Vec<[f64; 2]>,
    pub periods: Vec<f64>,
    /// Damping ratio ζ if ζ is assumed not to depend on the amplitude.
    pub zeta_constant: f64,
    pub residual: f64,
    /// Root mean square of the residual if ζ is assumed not to depend on the amplitude, in the signal's unit.
    pub residual_constant: f64,
    pub noise: f64,
}

fn units(signal: &str) -> [&'static str; 3] {
    match quantity(signal) {
        Ok(Quantity::Length) => ["m", "1/m", "1/m2"],
        Ok(Quantity::Force) => ["N", "1/N", "1/N2"],
        Ok(Quantity::Angle) => ["rad", "1/rad", "1/rad2"],
        _ => ["rad/s", "s/rad", "s2/rad2"],
    }
}

/// Unknowns of the oscillation that have the same value in all records of a free decay.
const COMMON: [&str; 4] = ["frequency", "zeta", "zeta_amplitude", "hardening"];
const OWN: [&str; 4] = ["amplitude", "phase", "offset", "slope"];

struct Oscillation<'a>(&'a [Recording]);

impl System for Oscillation<'_> {
    fn run(&self, z: &[f64], recording: usize, rows: usize, _: Hold, _: bool) -> Result<Motion> {
        let four = |from: usize| [z[from], z[from + 1], z[from + 2], z[from + 3]];
        let own = COMMON.len() + OWN.len() * recording;
        let signal = free_decay::model(&self.0[recording].time[..rows], four(0), four(own));
        Ok(Motion { outputs: vec![signal], ..Motion::default() })
    }
}

fn problem<'a>(
    system: &'a Oscillation,
    starts: &[Start],
    [unit, inverse, squared]: [&str; 3],
) -> Problem<'a> {
    let weight: f64 = starts.iter().map(|start| start.periods).sum();
    let average = |of: fn(&Start) -> f64| {
        starts.iter().map(|start| of(start) * start.periods).sum::<f64>() / weight
    };
    let size = starts.iter().map(|start| start.amplitude).fold(0.0, f64::max);
    let longest = starts.iter().map(|start| start.periods).fold(0.0, f64::max);
    // smallest change that is visible over a recording: a fraction of a turn of the phase, or a fraction of the amplitude
    let small = 0.1 / longest;
    let all = Role::Run(None);
    let linear = |name: &str, unit: &str, role, start: (f64, f64)| {
        Unknown::linear(name, unit, role, start, (f64::NEG_INFINITY, f64::INFINITY))
    };
    let f = average(|start| start.frequency);
    let shared = [
        (f, small * f, "Hz"),
        (average(|s| s.zeta), small, "1"),
        (average(|s| s.zeta_amplitude), small / size, inverse),
        (average(|s| s.hardening), small / size.powi(2), squared),
    ];
    let shared = COMMON.into_iter().zip(shared);
    let mut unknowns: Vec<Unknown> = shared
        .map(|(name, (start, reach, unit))| linear(name, unit, all, (start, reach)))
        .collect();
    (unknowns[0].bounds, unknowns[1].bounds) = ((0.5 * f, 2.0 * f), (-0.5, 0.9));
    for (k, start) in starts.iter().enumerate() {
        let (role, span) = (Role::Run(Some(k)), system.0[k].duration());
        let a = start.amplitude;
        unknowns.extend([
            Unknown::positive(OWN[0], unit, role, a, (1e-6 * a, 1e6 * a)),
            linear(OWN[1], "rad", role, (start.phase, 0.3)),
            linear(OWN[2], unit, role, (start.offset, 0.1 * a)),
            linear(OWN[3], unit, role, (0.0, 0.1 * a / span)),
        ]);
    }
    let signal = |(recording, r): (usize, &Recording)| Signal {
        recording,
        output: 0,
        measured: r.rate.clone(),
        sampled: vec![true; r.rate.len()],
        white: noise_level(&r.rate),
        drift: Some(DRIFT),
    };
    let recorded = |r: &Recording| Recorded {
        name: r.name.clone(),
        time: r.time.clone(),
        inputs: Vec::new(),
        step: 0.0,
    };
    let first: Vec<f64> = unknowns.iter().map(|u| u.start).collect();
    let mut constant = first.clone();
    // a second start, whose damping does not depend on the amplitude
    constant[2] = 0.0;
    let recordings = system.0.iter().map(recorded).collect();
    let signals = system.0.iter().enumerate().map(signal).collect();
    Problem::new(system, recordings, signals, unknowns, vec![first, constant])
}

fn residuals(solution: &Solution) -> (f64, Vec<Vec<f64>>) {
    let point = &solution.minimum.point;
    let residuals = solution.fit.residuals(&point.z, &point.motion);
    (mean_square(&residuals.concat()).sqrt(), residuals)
}

/// Fits one decaying oscillation to recordings of `signal`, which [`Recording::rate`] holds. `clock` is the relative standard
/// deviation of the recorder's clock.
///
/// # Errors
/// If a recording cannot be used, or shows no decaying oscillation.
pub fn identify(
    signal: &str,
    clock: f64,
    recordings: &[Recording],
    news: &mut dyn FnMut(&News),
) -> Result<Found> {
    let [unit, inverse, squared] = units(signal);
    for recording in recordings {
        recording.check()?;
    }
    let start = |r: &Recording| Start::fit(&Record { time: &r.time, signal: &r.rate });
    let starts: Option<Vec<Start>> = recordings.iter().map(start).collect();
    let starts = starts.filter(|starts| !starts.is_empty()).with_context(|| {
        format!(
            "{}: no decaying oscillation of at least {LEAST_PERIODS} periods is seen in {}",
            recordings.iter().map(|r| r.name.as_str()).collect::<Vec<_>>().join(", "),
            signal
        )
    })?;
    let system = Oscillation(recordings);
    let free = problem(&system, &starts, [unit, inverse, squared]);
    let mut constant = free.clone();
    constant.unknowns[2].part = Part::Candidate;
    constant.starts.remove(0);
    let constant = solve(&constant, None, f64::INFINITY, news)?;
    let from = constant.fit.values(&constant.minimum.point.z);
    let (residual_constant, zeta_constant) = (residuals(&constant).0, from[1]);
    let from = (from, constant.fit.hold);
    let mut found = solve(&free, Some(from), f64::INFINITY, news)?;
    let z = found.fit.values(&found.minimum.point.z);
    let jacobian = found.fit.derivatives_at(&mut found.minimum)?.matrix;
    let covariance = Curvature::new(&jacobian, places(&found.fit.free)).covariance(z.len());
    let std = |k: usize| covariance[(k, k)].sqrt();
    let own = z[COMMON.len()..].chunks(OWN.len());
    let ends = |(r, own): (&Recording, &[f64])| {
        [own[0], free_decay::amplitude(r.duration(), own[0], [z[0], z[1], z[2]])]
    };
    let amplitudes: Vec<[f64; 2]> = recordings.iter().zip(own).map(ends).collect();
    let (residual, parts) = residuals(&found);
    let noise = found.fit.noise.iter().map(|noise| noise.white).fold(0.0, f64::max);
    let mut answer = Found::new(Details {
        signal: signal.into(),
        amplitudes: amplitudes.clone(),
        periods: starts.iter().map(|start| start.periods).collect(),
        zeta_constant,
        residual,
        residual_constant,
        noise,
    });
    for (k, unit) in [(1, "1"), (2, inverse), (3, squared)] {
        answer.measurement.insert(COMMON[k].into(), Estimated::normal(z[k], std(k), unit));
    }
    // an error of the clock changes f, but not the damping ratio
    let estimated = Estimated::normal(z[0], std(0).hypot(clock * z[0]), "Hz");
    let frequency = Estimated { std_noise: std(0), ..estimated };
    let plus = |e: &Estimated| format!("{:.5} ± {:.5}", e.value, 1.96 * e.std);
    let (f, zeta) = (plus(&frequency), plus(&answer.measurement["zeta"]));
    answer.measurement.insert("frequency".into(), frequency);
    answer.converged = found.minimum.decrement < ENDS.0;
    answer.residuals = identified::residuals(&found, |signal: &Signal| {
        (recordings[signal.recording].name.clone(), format!("{}, {unit}", answer.details.signal))
    });
    let fits = found.is_noise();
    answer.fits = Some(fits);
    let all = amplitudes.iter().flatten();
    let (least, most) = all.fold((f64::MAX, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
    let growth = [z[2], 1.96 * std(2)];
    answer.verdict = vec![
        format!("f = {f} Hz, ζ = {zeta} at vanishing amplitude (95 % intervals)."),
        format!(
            "The interval of f includes the clock's tolerance, {} % (--tolerance clock=…).",
            100.0 * clock
        ),
        if growth[0].abs() > growth[1] {
            format!(
                "Damping depends on the amplitude: ζ_A = {:.4} ± {:.4} {inverse}, so ζ is {:.5} at {least:.3} {unit} and \
                 {:.5} at {most:.3} {unit}, the ends of what was recorded.",
                growth[0],
                growth[1],
                z[1] + growth[0] * least,
                z[1] + growth[0] * most
            )
        } else {
            format!(
                "No dependence of the damping on the amplitude is seen: ζ_A = {:.4} ± {:.4} {inverse}; with ζ_A = 0, ζ = \
                 {:.5}.",
                growth[0], growth[1], zeta_constant
            )
        },
        if fits {
            "One decaying oscillation fits the record: the residual is its noise.".to_string()
        } else {
            let why = found.tests.iter().max_by(|a, b| a.worst().total_cmp(&b.worst()));
            let why = why.map_or(Vec::new(), |tests| failed(tests, "an input")).join(", ");
            format!(
                "One decaying oscillation does not fit the record: the residual is {:.2} times the white noise in it{}.",
                residual / noise,
                if why.is_empty() { why } else { format!("; {why}") }
            )
        },
    ];
    let other = |(r, part): (&Recording, &Vec<f64>)| free_decay::largest_other(&r.time, part, z[0]);
    let others = recordings.iter().zip(&parts).map(other);
    let (at, size) = others.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
    if size > NAMED * most && !fits {
        answer.verdict.push(format!(
            "The residual has an oscillation of {:.0} % at {at:.3} Hz: another mode, or a beat with it.",
            100.0 * size / most
        ));
    }
    Ok(answer)
}

impl Report for Details {
    fn lines(found: &Found) -> Vec<String> {
        let Details { signal, amplitudes, periods, residual, noise, .. } = &found.details;
        let mut lines: Vec<String> = amplitudes
            .iter()
            .zip(periods)
            .map(|([first, last], periods)| {
                format!("{signal}: {periods:.0} periods, amplitude from {first:.4} to {last:.4}")
            })
            .collect();
        lines.push(format!("residual {residual:.2e}, noise {noise:.2e}"));
        lines
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use analysis::random::Random;

    use super::*;

    fn found(time: Vec<f64>, signal: Vec<f64>) -> Found {
        let torque = vec![0.0; time.len()];
        let recordings = [Recording::of("decay", time, torque, signal)];
        identify("wave_height", 0.0, &recordings, &mut |_| {}).unwrap()
    }

    /// Integrates an oscillator with linear and quadratic damping and a cubic spring by a Runge–Kutta method, independently of
    /// the closed form that the method fits.
    fn oscillator(
        zeta: f64,
        quadratic: f64,
        cubic: f64,
        x0: f64,
        seconds: f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let omega = TAU * 2.3;
        let f = |[x, v]: [f64; 2]| {
            [
                v,
                -omega * omega * x * (1.0 + cubic * x * x)
                    - 2.0 * zeta * omega * v
                    - quadratic * v * v.abs(),
            ]
        };
        let (h, every) = (1e-3, 20);
        let (mut y, mut time, mut signal) = ([x0, 0.0], Vec::new(), Vec::new());
        for k in 0..(seconds / h) as usize {
            if k % every == 0 {
                time.push(k as f64 * h);
                signal.push(y[0]);
            }
            let add = |y: [f64; 2], d: [f64; 2], by: f64| [y[0] + by * d[0], y[1] + by * d[1]];
            let a = f(y);
            let b = f(add(y, a, h / 2.0));
            let c = f(add(y, b, h / 2.0));
            let d = f(add(y, c, h));
            for i in 0..2 {
                y[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
            }
        }
        (time, signal)
    }

    #[test]
    fn damping_that_grows_with_the_amplitude_is_estimated_as_averaging_theory_predicts() {
        // x'' + ... + q x'|x'|: averaging gives ζ_A = 4 q/(3π) (Nayfeh and Mook 1979, 3.3.3), and a cubic spring gives κ = 3
        // α/8. Both are of first order in the squared amplitude; the error, 0.2² α q, is below 1 %.
        let (q, alpha) = (0.02, -0.05);
        let (time, signal) = oscillator(0.004, q, alpha, 0.3, 60.0);
        let answer = found(time, signal);
        let value = |name: &str| answer.measurement[name].value;
        let expected = 4.0 * q / (3.0 * std::f64::consts::PI);
        assert!((value("frequency") / 2.3 - 1.0).abs() < 2e-5, "{:?}", answer.measurement);
        assert!((value("zeta") / 0.004 - 1.0).abs() < 0.01, "{:?}", answer.measurement);
        assert!(
            (value("zeta_amplitude") / expected - 1.0).abs() < 0.01,
            "{:?}",
            answer.measurement
        );
        assert!(
            (value("hardening") / (3.0 * alpha / 8.0) - 1.0).abs() < 0.02,
            "{:?}",
            answer.measurement
        );
        let Details { residual, residual_constant, .. } = answer.details;
        assert!(residual < 1e-3 * 0.3 && residual_constant > 10.0 * residual);
    }

    #[test]
    fn intervals_contain_the_true_value_in_white_and_in_coloured_noise() {
        // 60 simulated recordings of 25 s each. On average 57 of the 95 % intervals contain the true value, with a standard
        // deviation of 1.7; the limit is three standard deviations lower.
        for (colour, least) in [(0.0, 52), (0.9, 52)] {
            let (mut held, mut fits) = ([0; 3], 0);
            for seed in 0..60 {
                let mut random = Random::new(seed, 3);
                let time: Vec<f64> = (0..625).map(|k| 0.04 * k as f64).collect();
                let clean =
                    free_decay::model(&time, [1.7, 0.006, 0.01, 0.0], [1.0, 0.4, 0.02, 0.0]);
                let mut noise = 0.0;
                let signal = clean.iter().map(|x| {
                    noise = colour * noise + 0.02 * random.normal();
                    x + noise
                });
                let answer = found(time.clone(), signal.collect());
                fits += usize::from(answer.fits == Some(true));
                let truth = [("frequency", 1.7), ("zeta", 0.006), ("zeta_amplitude", 0.01)];
                for (count, (name, truth)) in held.iter_mut().zip(truth) {
                    let [low, high] = answer.measurement[name].interval;
                    *count += usize::from((low..=high).contains(&truth));
                }
            }
            println!("colour {colour}: {held:?}, {fits} fit");
            assert!(held.iter().all(|count| *count >= least), "colour {colour}: {held:?}");
            assert!(fits >= 59, "{fits}");
        }
    }
}

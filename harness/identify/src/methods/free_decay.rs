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

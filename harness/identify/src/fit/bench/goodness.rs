//! Tests of how well the FMU's answer explains the recordings.

use crate::fit::bench::problem::{Answer, Channel, Problem, Signal};
use crate::tuning::POOR_FIT;
use analysis::innovations::Tests;
use analysis::statistics::mean;

/// Tests for each channel whether the residual of an answer is noise.
pub fn tests(problem: &Problem, answer: &Answer) -> Vec<Tests> {
    tests_of(problem, &problem.innovations(answer))
}

/// Tests for each channel whether its innovations are noise.
pub fn tests_of(problem: &Problem, innovations: &[Vec<f64>]) -> Vec<Tests> {
    let one = |(channel, e): (&Channel, &Vec<f64>)| {
        let recording = &problem.recordings[channel.recording];
        let of = |x: &[f64]| match channel.signal {
            Signal::Rate => recording.of_fresh(x),
            Signal::Angle => recording.of_fresh_angle(x),
        };
        Tests::run(&of(&recording.time), &[&of(&recording.torque)], &of(e), channel.noise.white)
    };
    problem.channels.iter().zip(innovations).map(one).collect()
}

/// Fit of the rates, %: 100 (1 − |y − ŷ|/|y − mean y|).
pub fn fit_pct(problem: &Problem, answer: &Answer) -> f64 {
    let spread: f64 = problem
        .recordings
        .iter()
        .map(|r| {
            let rate = r.of_fresh(&r.rate);
            let mean = mean(&rate);
            rate.iter().map(|y| (y - mean).powi(2)).sum::<f64>()
        })
        .sum();
    let rates = problem.channels.iter().zip(&answer.residual);
    let rates = rates.filter(|(channel, _)| channel.signal == Signal::Rate);
    let fresh = |(c, residual): (&Channel, &Vec<f64>)| {
        problem.recordings[c.recording].of_fresh(residual).iter().map(|e| e * e).sum::<f64>()
    };
    100.0 * (1.0 - (rates.map(fresh).sum::<f64>() / spread).sqrt())
}

/// A fit that neither noise nor a small effect explains.
pub fn is_poor(problem: &Problem, answer: &Answer) -> bool {
    let noise = problem.recordings[0].rate_noise();
    let residual = problem.recordings[0].of_fresh(&answer.residual[0]);
    let rms = (residual.iter().map(|e| e * e).sum::<f64>() / residual.len() as f64).sqrt();
    fit_pct(problem, answer) < POOR_FIT && rms > 2.0 * noise
}

//! Tests whether the residual of each output of any FMU is noise.

use serde::Serialize;

use crate::fit::problem::{Channel, Motion, Problem};
use crate::input::question::Question;
use analysis::innovations::{LIMIT, Tests};
use analysis::statistics::{mean, variance};

/// One output of one recording.
#[derive(Clone, Debug, Serialize)]
pub struct Output {
    /// The recording's name.
    pub recording: String,
    /// The output's.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Rows with a value.
    pub rows: usize,
    /// White noise of a row.
    pub noise_white: f64,
    /// Gauss–Markov bias: standard deviation and correlation time, s.
    pub drift: Option<(f64, f64)>,
    /// 100 (1 − |y − ŷ|/|y − mean y|), %.
    pub fit_percent: f64,
    /// Tests of the residual.
    pub tests: Tests,
    /// Mean over the mean's standard deviation.
    pub mean: f64,
}

impl Output {
    /// Returns true if the residual is noise about 0.
    pub fn passed(&self) -> bool {
        self.tests.passed() && self.mean.abs() < LIMIT
    }
}

/// Tests the residual of each output at a motion.
pub fn outputs(problem: &Problem, motion: &Motion, x: &[f64], question: &Question) -> Vec<Output> {
    let residuals = problem.residuals(motion, x);
    let innovations = problem.innovations(motion, x);
    let one = |((channel, e), residual): ((&Channel, &Vec<f64>), &Vec<f64>)| {
        let record = &problem.records[channel.recording];
        let (time, e) = (channel.picked(&record.time), channel.picked(e));
        let white = channel.noise.white;
        let inputs: Vec<Vec<f64>> =
            record.inputs.iter().map(|input| channel.picked(input)).collect();
        let inputs: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        let tests = Tests::run(&time, &inputs, &e, white);
        let count = e.len() as f64;
        let measured = channel.picked(&record.outputs[channel.output]);
        let squares: f64 = residual.iter().map(|r| r * r).sum();
        let name = &question.outputs[channel.output];
        let description = problem.model.description();
        let unit = description.variable(name).map_or("", |v| description.unit(v));
        Output {
            recording: record.name.clone(),
            name: name.clone(),
            unit: unit.into(),
            rows: e.len(),
            noise_white: white,
            drift: (channel.noise.drift > 0.0)
                .then_some((channel.noise.drift * white, channel.noise.time)),
            fit_percent: 100.0 * (1.0 - (squares / (count * variance(&measured))).sqrt()),
            tests,
            mean: mean(&e) * count.sqrt(),
        }
    };
    problem.channels.iter().zip(&innovations).zip(&residuals).map(one).collect()
}

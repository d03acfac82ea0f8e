use std::collections::BTreeMap;

use analysis::gauss_markov::Noise;
use anyhow::Result;
use maud::Markup;
use serde::Serialize;

use crate::engine::{Signal, Solution};
use crate::estimate::{Combination, Estimated};

/// Result of every method of identification; `D` contains the results that only one method has.
#[derive(Clone, Debug, Serialize)]
pub struct Identified<D> {
    pub parameters: BTreeMap<String, Estimated>,
    /// Estimates other than parameters of the FMU: delay, scale and bias of the gyro, poles and zeros.
    pub measurement: BTreeMap<String, Estimated>,
    pub settings: BTreeMap<String, String>,
    pub correlations: (Vec<String>, Vec<Vec<f64>>),
    pub converged: bool,
    /// True if the model fits, that is, if the residual is noise of the gyro. If false, no interval is valid.
    /// `None` if the method does not test it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fits: Option<bool>,
    pub verdict: Vec<String>,
    pub done: Vec<String>,
    #[serde(skip)]
    pub residuals: Vec<Residual>,
    #[serde(flatten)]
    pub details: D,
}

#[derive(Clone, Debug, Default)]
pub struct Residual {
    pub name: String,
    pub label: String,
    pub time: Vec<f64>,
    pub measured: Vec<f64>,
    pub residual: Vec<f64>,
    /// Standard deviation of the signal's white noise.
    pub noise: f64,
    /// Torque at the times of the signal, N·m, if the signal is the hub's rate under this torque.
    pub torque: Option<Vec<f64>>,
}

/// Returns the residual of each signal in the rows in which the signal was measured. `words` returns the name and the axis label
/// of a signal.
pub(crate) fn residuals(
    solution: &Solution,
    words: impl Fn(&Signal) -> (String, String),
) -> Vec<Residual> {
    let (fit, point) = (&solution.fit, &solution.minimum.point);
    let all = fit.residuals(&point.z, &point.motion);
    let one = |((signal, residual), noise): ((&Signal, &Vec<f64>), &Noise)| {
        let (name, label) = words(signal);
        Residual {
            name,
            label,
            time: signal.picked(&fit.problem.recordings[signal.recording].time),
            measured: signal.picked(&signal.measured),
            residual: signal.picked(residual),
            noise: noise.white,
            torque: None,
        }
    };
    fit.problem.signals.iter().zip(&all).zip(&fit.noise).map(one).collect()
}

/// Sections of the HTML page that only one method has.
#[derive(Default)]
pub struct Sections {
    pub first: Markup,
    pub combinations: Vec<Combination>,
    pub figures: Markup,
    pub condition: Option<f64>,
    pub last: Markup,
}

/// The part of a report that differs from method to method.
pub trait Report: Serialize + Sized {
    /// Returns the lines that a terminal shows below the table of estimates.
    fn lines(found: &Identified<Self>) -> Vec<String>;

    fn sections(_found: &Identified<Self>) -> Sections {
        Sections::default()
    }
}

impl<D: Report> Identified<D> {
    pub fn lines(&self) -> Vec<String> {
        D::lines(self)
    }

    pub(crate) fn new(details: D) -> Self {
        Identified {
            parameters: BTreeMap::new(),
            measurement: BTreeMap::new(),
            settings: BTreeMap::new(),
            correlations: (Vec::new(), Vec::new()),
            converged: true,
            fits: None,
            verdict: Vec::new(),
            done: Vec::new(),
            residuals: Vec::new(),
            details,
        }
    }

    pub fn json(&self) -> Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

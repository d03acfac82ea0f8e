//! Result of an identification, the same for every method.

use std::collections::BTreeMap;

use anyhow::Result;
use serde::Serialize;

use crate::estimate::Estimated;

/// Result of every method; `D` has the results that only this method has.
#[derive(Clone, Debug, Serialize)]
pub struct Identified<D> {
    /// The FMU's parameters, by name.
    pub parameters: BTreeMap<String, Estimated>,
    /// Other estimates: delay, gyro scale and bias, poles and zeros.
    pub measurement: BTreeMap<String, Estimated>,
    /// Settings of the FMU that belong to the parameters.
    pub settings: BTreeMap<String, String>,
    /// Names and matrix of the correlations.
    pub correlations: (Vec<String>, Vec<Vec<f64>>),
    pub converged: bool,
    /// True if the model fits: the residual is the gyro's noise. If false, no interval can be trusted. `None`: the method does
    /// not test it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fits: Option<bool>,
    pub verdict: Vec<String>,
    /// Log of the steps.
    pub done: Vec<String>,
    /// Measured signals and residuals, of methods that fit in the time domain.
    #[serde(skip)]
    pub residuals: Vec<Residual>,
    /// Results that only this method has.
    #[serde(flatten)]
    pub details: D,
}

/// A measured signal of one recording and its residual, for the page.
#[derive(Clone, Debug, Default)]
pub struct Residual {
    pub name: String,
    /// Name and unit of the signal, as on an axis.
    pub label: String,
    /// s.
    pub time: Vec<f64>,
    pub measured: Vec<f64>,
    /// Measured less modelled signal.
    pub residual: Vec<f64>,
    /// Standard deviation of the signal's white noise, if known.
    pub noise: Option<f64>,
    /// Torque at the same times, N·m, if the signal is the rate that answers to it.
    pub torque: Option<Vec<f64>>,
}

impl<D: Serialize> Identified<D> {
    /// A result without parameters and words.
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

    /// Returns the content of `result.json`.
    pub fn json(&self) -> Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}

use std::collections::BTreeMap;

use anyhow::Result;
use serde::Serialize;

use crate::estimate::Estimated;

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
    /// Standard deviation of the signal's white noise, if known.
    pub noise: Option<f64>,
    /// Torque at the times of the signal, N·m, if the signal is the hub's rate under this torque.
    pub torque: Option<Vec<f64>>,
}

impl<D: Serialize> Identified<D> {
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

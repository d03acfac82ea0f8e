//! Methods of identification, one a file: what each is given, what it needs of that, and what all return.

pub mod acceleration;
pub mod black_box;
pub mod free_decay;
pub mod frequency;
pub mod identification;
pub mod multisine;
pub mod output_error;
pub mod page;

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail};
use host::fmu::Fmu;
use serde::Serialize;

use crate::estimate::Estimated;
use crate::news::News;
use crate::nominal::Nominal;
use crate::recording::Recording;
use crate::{plausible, start};
use page::Sections;

/// Input of a method.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// The FMU, for methods that need it.
    pub fmu: Option<&'a Fmu>,
    /// Recordings to fit.
    pub recordings: &'a [Recording],
    /// Recordings to simulate with the result, which are not fitted.
    pub validation: &'a [Recording],
}

impl<'a> Task<'a> {
    fn fmu(&self) -> Result<&'a Fmu> {
        self.fmu.context("this method needs an FMU")
    }

    fn one(&self) -> Result<&'a Recording> {
        match self.recordings {
            [one] => Ok(one),
            _ => bail!(
                "this method takes one uninterrupted recording, not {}",
                self.recordings.len()
            ),
        }
    }

    /// Refuses recordings of another bench than the FMU's: units or inertia are wrong.
    fn check_size(&self, nominal: &Nominal) -> Result<()> {
        match start::from_data(self.recordings, nominal)? {
            (Some(found), _) => plausible::check_size(found.inertia, nominal.inertia),
            (None, _) => Ok(()),
        }
    }
}

/// Inputs that a method needs or can use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs {
    /// The FMU.
    pub fmu: bool,
    /// Recordings that are held back.
    pub validation: bool,
}

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
    /// The search ended at a minimum.
    pub converged: bool,
    /// True if the model fits: the residual is the gyro's noise. If false, no interval can be trusted. `None`: the method does
    /// not test it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fits: Option<bool>,
    /// The answer in words.
    pub verdict: Vec<String>,
    /// Log of the steps.
    pub done: Vec<String>,
    /// Measured signals and residuals, of methods that have them in time.
    #[serde(skip)]
    pub residuals: Vec<Residual>,
    /// Results that only this method has.
    #[serde(flatten)]
    pub details: D,
}

/// A measured signal of one recording and its residual, for the page.
#[derive(Clone, Debug, Default)]
pub struct Residual {
    /// The recording's name.
    pub name: String,
    /// Name and unit of the signal, as on an axis.
    pub label: String,
    /// s.
    pub time: Vec<f64>,
    /// Measured signal.
    pub measured: Vec<f64>,
    /// Measured less modelled signal.
    pub residual: Vec<f64>,
    /// Standard deviation of its white noise, if known.
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

/// A method of identification.
pub trait Method {
    /// Results that only this method has.
    type Details: Serialize;

    /// Parts of a [`Task`] that the method needs.
    const NEEDS: Needs;

    /// Identifies; `progress` receives each message.
    fn identify(
        &self,
        task: &Task,
        progress: &mut dyn FnMut(&News),
    ) -> Result<Identified<Self::Details>>;

    /// Lines for a terminal, below the table of estimates.
    fn lines(found: &Identified<Self::Details>) -> Vec<String>;

    /// Sections of the page that only this method has.
    fn sections(_found: &Identified<Self::Details>) -> Sections {
        Sections::default()
    }

    /// The page, in HTML.
    fn page(found: &Identified<Self::Details>) -> String {
        page::of(found, &Self::sections(found))
    }
}

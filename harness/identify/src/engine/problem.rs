//! The data of a problem: its unknowns, its recordings, and the simulated system.

use anyhow::Result;

/// The course of an input between the rows of a recording (Ljung; Pintelon & Schoukens).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    FirstOrderHold,
    ZeroOrderHold,
    BandLimited,
}

impl Hold {
    pub const ALL: [Hold; 3] = [Hold::FirstOrderHold, Hold::BandLimited, Hold::ZeroOrderHold];

    pub fn words(self) -> &'static str {
        match self {
            Hold::FirstOrderHold => "linear between rows (first-order hold)",
            Hold::ZeroOrderHold => "held from row to row (zero-order hold)",
            Hold::BandLimited => "smooth between rows (band-limited)",
        }
    }
}

/// The place at which an unknown acts; outputs and recordings are given by their index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The unknown changes the simulation of one recording, or of all recordings (`None`), so that its derivatives are
    /// differences between simulations.
    Run(Option<usize>),
    /// Delay of the reading of an output, s. The run takes it into account; its derivative is the derivative of the output by
    /// time.
    Delay(usize),
    /// Added to the reading of an output, in one recording or in all.
    Bias(usize, Option<usize>),
    /// The second output times the unknown is added to the reading of the first. If both are the same output, the unknown is the
    /// error of its scale.
    Gain(usize, usize),
    /// The unknown acts in no reading, but in quantities that [`System::derive`] computes.
    Derived,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Free,
    /// A known value with a prior: held in the search, and joined at the end.
    Tolerance,
    /// An effect that is absent (its start is 0) unless the residual asks for it.
    Candidate,
}

/// One unknown number with its `unit`. The search moves its coordinate z, which is its value or, with `log`, the logarithm of that.
///
/// `start` and `bounds` are values. `prior`, mean and standard deviation of what is known beforehand, and `reach`, the plausible
/// distance from the start, are coordinates. `bent` says that the likelihood along it is no parabola, so that its profile is followed.
#[derive(Clone, Debug)]
pub struct Unknown {
    pub name: String,
    pub unit: String,
    pub role: Role,
    pub part: Part,
    pub start: f64,
    pub bounds: (f64, f64),
    pub log: bool,
    pub prior: Option<(f64, f64)>,
    pub reach: f64,
    pub bent: bool,
}

impl Unknown {
    pub fn positive(name: &str, unit: &str, role: Role, start: f64, bounds: (f64, f64)) -> Self {
        Unknown { log: true, reach: 0.3, ..Unknown::linear(name, unit, role, (start, 0.3), bounds) }
    }

    /// Creates an unknown that is searched in its value; `reach` is the plausible distance from its start.
    pub fn linear(
        name: &str,
        unit: &str,
        role: Role,
        (start, reach): (f64, f64),
        bounds: (f64, f64),
    ) -> Self {
        Unknown {
            name: name.into(),
            unit: unit.into(),
            role,
            part: Part::Free,
            start,
            bounds,
            log: false,
            prior: None,
            reach,
            bent: false,
        }
    }

    /// Returns the unknown with a prior, whose mean and standard deviation are in its coordinate.
    pub fn with_prior(self, mean: f64, std: f64) -> Self {
        Unknown { prior: Some((mean, std)), ..self }
    }

    pub fn coordinate(&self, value: f64) -> f64 {
        if self.log { value.ln() } else { value }
    }

    pub fn value(&self, z: f64) -> f64 {
        if self.log { z.exp() } else { z }
    }

    pub fn ends(&self) -> (f64, f64) {
        let end = |value: f64| match self.log {
            true if value <= 0.0 => f64::NEG_INFINITY,
            _ => self.coordinate(value),
        };
        (end(self.bounds.0), end(self.bounds.1))
    }

    /// Returns true for a known value with a tolerance that has an effect in the recordings.
    pub fn is_held(&self) -> bool {
        self.part == Part::Tolerance && self.role != Role::Derived
    }

    /// Returns true if the unknown has an effect in this recording.
    pub fn is_of(&self, recording: usize) -> bool {
        match self.role {
            Role::Run(of) | Role::Bias(_, of) => of.is_none_or(|of| of == recording),
            Role::Delay(_) | Role::Gain(..) => true,
            Role::Derived => false,
        }
    }
}

/// A recording: `time`, s, and `inputs` at its rows, with which the residual is compared, and the usual time between the samples of
/// the inputs, `step`, s.
#[derive(Clone, Debug)]
pub struct Recorded {
    pub name: String,
    pub time: Vec<f64>,
    pub inputs: Vec<Vec<f64>>,
    pub step: f64,
}

/// An output of a recording as it was measured.
///
/// `recording` and `output` are indices. `measured` has a value in each row; only rows that are `sampled` have a measured one.
/// `white` is the white noise from one row to the next, and `drift` the drift that is expected of the sensor, if it drifts.
#[derive(Clone, Debug)]
pub struct Signal {
    pub recording: usize,
    pub output: usize,
    pub measured: Vec<f64>,
    pub sampled: Vec<bool>,
    pub white: f64,
    pub drift: Option<Drift>,
}

#[derive(Clone, Copy, Debug)]
pub struct Drift {
    /// Size, relative to the white noise of a row.
    pub size: f64,
    /// Correlation time, s.
    pub time: f64,
    /// Standard deviation of the logarithm of the size about its expected value.
    pub width: f64,
}

/// A simulated run at the rows of one recording: each output, its derivative by time if the system computes it, and `others`,
/// quantities that the system needs later and the search does not.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    pub outputs: Vec<Vec<f64>>,
    pub slopes: Vec<Vec<f64>>,
    pub others: Vec<Vec<f64>>,
}

pub trait System: Sync {
    /// Runs through the first `rows` rows of a recording with these values of all unknowns. Slopes are returned where `whole` is
    /// true; the other runs are for differences.
    ///
    /// # Errors
    /// If the system refuses the values.
    fn run(
        &self,
        values: &[f64],
        recording: usize,
        rows: usize,
        hold: Hold,
        whole: bool,
    ) -> Result<Motion>;

    fn derived(&self) -> Vec<(String, String)>;

    /// Returns the quantities that users ask for, such as tank and hub, from values of all unknowns; `None` if no system has these
    /// values.
    fn derive(&self, values: &[f64]) -> Option<Vec<f64>>;
}

/// Recordings that are fitted together, unknowns, and the system.
///
/// `starts` are values of all unknowns, and `holds` possible courses of the inputs between rows, the likeliest first. With
/// `acausal` a reading may come before its cause. If the starts from the data lead to no good fit, `drawn` starts are drawn
/// within the bounds. The outputs of a `rough` system have errors of a solver that jump from one value of an unknown to the next;
/// the steps of differences then have to be so wide that their effect exceeds these errors.
#[derive(Clone)]
pub struct Problem<'a> {
    pub system: &'a dyn System,
    pub recordings: Vec<Recorded>,
    pub signals: Vec<Signal>,
    pub unknowns: Vec<Unknown>,
    pub starts: Vec<Vec<f64>>,
    pub holds: Vec<Hold>,
    pub acausal: bool,
    pub drawn: usize,
    pub rough: bool,
}

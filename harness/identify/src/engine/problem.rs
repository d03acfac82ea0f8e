//! The data of a problem: what is unknown, what was recorded, and the system that answers.

use anyhow::Result;

/// What an input does between the rows of a recording (Ljung; Pintelon & Schoukens).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// A line from row to row.
    FirstOrderHold,
    /// The row's value until the next.
    ZeroOrderHold,
    /// Band-limited interpolation of the samples.
    BandLimited,
}

impl Hold {
    /// All, the likeliest first.
    pub const ALL: [Hold; 3] = [Hold::FirstOrderHold, Hold::BandLimited, Hold::ZeroOrderHold];

    /// Returns the behaviour in words.
    pub fn words(self) -> &'static str {
        match self {
            Hold::FirstOrderHold => "linear between rows (first-order hold)",
            Hold::ZeroOrderHold => "held from row to row (zero-order hold)",
            Hold::BandLimited => "smooth between rows (band-limited)",
        }
    }
}

/// Where an unknown acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// In the system's run, of one recording or of all. Derivatives are differences of runs.
    Run(Option<usize>),
    /// The reading of an output is so much late, s. The run takes it; the derivative is that of the output by time.
    Delay(usize),
    /// Added to the reading of an output, in one recording or in all.
    Bias(usize, Option<usize>),
    /// So many times the second output is added to the reading of the first; of an output itself it is the error of its scale.
    Gain(usize, usize),
    /// In no reading, only in what is derived from the unknowns.
    Derived,
}

/// How an unknown takes part in a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// It is estimated.
    Free,
    /// A known value with a prior: held in the search, and joined at the end.
    Tolerance,
    /// An effect that is absent (its start is 0) unless the residual asks for it.
    Candidate,
}

/// One unknown number. Its coordinate z is its value or the logarithm of that.
#[derive(Clone, Debug)]
pub struct Unknown {
    /// Name in the result.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Where it acts.
    pub role: Role,
    /// How it takes part.
    pub part: Part,
    /// Value at the start.
    pub start: f64,
    /// Least and largest value.
    pub bounds: (f64, f64),
    /// True if its coordinate is the logarithm.
    pub log: bool,
    /// Mean and standard deviation of the coordinate beforehand.
    pub prior: Option<(f64, f64)>,
    /// Plausible distance of the coordinate from the start.
    pub reach: f64,
    /// True if the likelihood along it is no parabola: the profile is followed.
    pub bent: bool,
}

impl Unknown {
    /// A positive unknown in its logarithm.
    pub fn positive(name: &str, unit: &str, role: Role, start: f64, bounds: (f64, f64)) -> Self {
        Unknown { log: true, reach: 0.3, ..Unknown::linear(name, unit, role, (start, 0.3), bounds) }
    }

    /// An unknown in its value, with the distance from its start that is plausible.
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

    /// The same with a prior of the coordinate.
    pub fn with_prior(self, mean: f64, std: f64) -> Self {
        Unknown { prior: Some((mean, std)), ..self }
    }

    /// Returns the coordinate of a value.
    pub fn coordinate(&self, value: f64) -> f64 {
        if self.log { value.ln() } else { value }
    }

    /// Returns the value of a coordinate.
    pub fn value(&self, z: f64) -> f64 {
        if self.log { z.exp() } else { z }
    }

    /// Returns true if it acts in a recording.
    pub fn is_of(&self, recording: usize) -> bool {
        match self.role {
            Role::Run(of) | Role::Bias(_, of) => of.is_none_or(|of| of == recording),
            Role::Delay(_) | Role::Gain(..) => true,
            Role::Derived => false,
        }
    }
}

/// Rows of a recording.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// The recording's name.
    pub name: String,
    /// s.
    pub time: Vec<f64>,
    /// Inputs at the rows, with which the residual is compared.
    pub inputs: Vec<Vec<f64>>,
    /// Usual time between the samples of the inputs, s.
    pub step: f64,
}

/// An output of a recording as it was measured.
#[derive(Clone, Debug)]
pub struct Signal {
    /// Number of the recording.
    pub recording: usize,
    /// Number of the output.
    pub output: usize,
    /// Values at the rows.
    pub measured: Vec<f64>,
    /// Rows that have a value.
    pub sampled: Vec<bool>,
    /// White noise from one row to the next.
    pub white: f64,
    /// Drift of the noise that is expected; `None`: it does not drift.
    pub drift: Option<Drift>,
}

/// A drift that is expected of a kind of sensor.
#[derive(Clone, Copy, Debug)]
pub struct Drift {
    /// Size, relative to the white noise of a row.
    pub size: f64,
    /// Correlation time, s.
    pub time: f64,
    /// Standard deviation of the logarithm of the size about what is expected.
    pub width: f64,
}

/// A system's answer at the rows of one recording.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// Values of each output.
    pub outputs: Vec<Vec<f64>>,
    /// Derivatives of each output by time, if the system has them.
    pub slopes: Vec<Vec<f64>>,
    /// What else the system wants to know of its motion.
    pub others: Vec<Vec<f64>>,
}

/// A simulated system.
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

    /// Names and units of what is derived from the unknowns.
    fn derived(&self) -> Vec<(String, String)>;

    /// Returns what is derived from values of the unknowns; `None` if there is no such system.
    fn derive(&self, values: &[f64]) -> Option<Vec<f64>>;
}

/// Recordings, unknowns and the system.
#[derive(Clone)]
pub struct Problem<'a> {
    /// The system.
    pub system: &'a dyn System,
    /// Recordings, fitted together.
    pub recordings: Vec<Recorded>,
    /// Measured outputs.
    pub signals: Vec<Signal>,
    /// Unknowns.
    pub unknowns: Vec<Unknown>,
    /// Values of the unknowns to start from, the likeliest first.
    pub starts: Vec<Vec<f64>>,
    /// Behaviours between rows that are possible, the first of which is taken at first.
    pub holds: Vec<Hold>,
    /// True if a reading may be early.
    pub acausal: bool,
}

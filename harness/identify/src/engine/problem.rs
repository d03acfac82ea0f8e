//! The data of a problem: its unknowns, its recordings, and the simulated system.

use anyhow::Result;

/// Intersample behaviour: the course of an input between two rows of a recording (Ljung; Pintelon & Schoukens).
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

/// Effect of an unknown on the simulation, the outputs or the priors. The numbers are indices of recordings, outputs and
/// unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The unknown changes the simulation of one recording, or of all recordings (`None`), so that its derivatives are
    /// differences between simulations.
    Run(Option<usize>),
    /// Delay of the measured output with this index, s. The simulation applies it, and its derivative is the time
    /// derivative of the output.
    Delay(usize),
    /// Bias that is added to the output with the first index, in the recording with the second index or
    /// in all recordings (`None`).
    Bias(usize, Option<usize>),
    /// The output with the second index, multiplied by the unknown, is added to the output with the first index. If both
    /// indices are equal, the unknown is the scale error of the sensor.
    Gain(usize, usize),
    /// Error of a stated value. It shifts the mean of a prior: the prior of the unknown with this index.
    Stated(usize),
    /// The unknown changes no output, only quantities that [`System::derive`] computes.
    Derived,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Free,
    /// A known value with a prior. It is fixed during the search, and its prior widens the intervals at the end.
    Tolerance,
    /// An effect that is left out (its value stays at 0) unless the residual shows that it is needed.
    Candidate,
}

/// An unknown that is estimated. The search varies its coordinate z, which is the logarithm of its value if `log` is true,
/// and otherwise the value itself.
///
/// `start` and `bounds` are values. `prior` (mean and standard deviation before the recordings are known) and `reach`
/// (plausible distance from the start) are in the coordinate z. If `bent` is true, −2 ln L (L: likelihood) is not a
/// parabola along the unknown, so that its likelihood profile is followed.
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

    /// Creates an unknown whose coordinate is its value. `reach` is the plausible distance from its start.
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

    /// Returns the unknown with a prior. `mean` and `std` are in the coordinate of the unknown.
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

    /// Returns true for a known value with a tolerance.
    pub fn is_known(&self) -> bool {
        self.part == Part::Tolerance
    }

    /// Returns true for a known value with a tolerance that affects the simulated outputs.
    pub fn is_held(&self) -> bool {
        self.is_known() && self.role != Role::Derived
    }

    /// Returns true if the unknown affects the outputs of this recording.
    pub fn is_of(&self, recording: usize) -> bool {
        match self.role {
            Role::Run(of) | Role::Bias(_, of) => of.is_none_or(|of| of == recording),
            Role::Delay(_) | Role::Gain(..) => true,
            Role::Stated(_) | Role::Derived => false,
        }
    }
}

/// One recording for the fit: `time` (s) of its rows, the `inputs` at these rows, and `step`, the usual time between two samples
/// of the inputs, s. Residuals are computed at these rows.
#[derive(Clone, Debug)]
pub struct Recorded {
    pub name: String,
    pub time: Vec<f64>,
    pub inputs: Vec<Vec<f64>>,
    pub step: f64,
}

/// A measured output of a recording.
///
/// `recording` and `output` are indices. `measured` has a value in each row, which was measured only where `sampled` is true.
/// `white` is the standard deviation of the white noise of one row, and `drift` the drift expected of this sensor, if it drifts.
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
    /// Standard deviation of the drift, relative to the white noise of one row.
    pub size: f64,
    /// Correlation time, s.
    pub time: f64,
    /// Prior standard deviation of the logarithm of `size`.
    pub width: f64,
}

/// A simulation at the rows of one recording: the outputs, their time derivatives (`slopes`) if the system computes them,
/// and `others`, quantities that are not fitted, for example the slosh angle, which the report needs.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    pub outputs: Vec<Vec<f64>>,
    pub slopes: Vec<Vec<f64>>,
    pub others: Vec<Vec<f64>>,
}

pub trait System: Sync {
    /// Simulates the first `rows` rows of a recording with these values of all unknowns. Time derivatives of the outputs are
    /// returned if `whole` is true; simulations for finite differences do without them.
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

    /// Returns the number of quantities that [`System::derive`] computes. They have the names and units of the first unknowns.
    fn derived(&self, unknowns: usize) -> usize {
        unknowns
    }

    /// Returns the quantities that users ask for, such as the tank and the inertia of the hub, from the values of all unknowns;
    /// `None` if the values are impossible.
    fn derive(&self, values: &[f64]) -> Option<Vec<f64>> {
        Some(values.to_vec())
    }
}

/// Recordings that are fitted together, the unknowns, and the simulated system.
///
/// Each element of `starts` holds a start value of every unknown. `holds` are the possible intersample behaviours, the likeliest
/// first. If `acausal` is true, an output may precede its input. If no start from the data leads to a good fit, `drawn` random
/// starts within the bounds are tried. If `rough` is true, the solver's errors jump when an unknown changes, and finite
/// differences take steps so wide that their effect exceeds these errors.
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

impl<'a> Problem<'a> {
    /// Creates a problem with one intersample behaviour, without random starts, and with a system without solver errors.
    /// Outputs may precede their inputs.
    pub fn new(
        system: &'a dyn System,
        recordings: Vec<Recorded>,
        signals: Vec<Signal>,
        unknowns: Vec<Unknown>,
        starts: Vec<Vec<f64>>,
    ) -> Self {
        let holds = vec![Hold::FirstOrderHold];
        let (acausal, drawn, rough) = (true, 0, false);
        Problem { system, recordings, signals, unknowns, starts, holds, acausal, drawn, rough }
    }
}

impl Signal {
    /// Returns the values of the rows in which the signal was measured.
    pub fn picked(&self, values: &[f64]) -> Vec<f64> {
        let there = values.iter().zip(&self.sampled).filter(|(_, sampled)| **sampled);
        there.map(|(value, _)| *value).collect()
    }

    pub fn measured_row_count(&self) -> usize {
        self.sampled.iter().filter(|sampled| **sampled).count()
    }
}

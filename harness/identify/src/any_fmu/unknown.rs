//! Unknowns of a question, with names, units, bounds and priors.

use anyhow::{Context, Result, ensure};
use host::causality::{Causality, Variability};
use host::description::ModelDescription;

use super::question::{Bias, Free, Question, Triad, real};
use super::record::Record;
use crate::unknown::range;

/// Kinds of unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// A Real of the FMU, of one recording or of all.
    Parameter {
        /// Value reference.
        reference: u32,
        /// `None`: of all.
        recording: Option<usize>,
    },
    /// Reading of an output's sensor at 0, in one recording.
    Bias {
        /// The output.
        output: usize,
        /// The recording.
        recording: usize,
    },
    /// Cross-coupling: share of one output in the reading of another.
    Gain {
        /// The output that is read.
        output: usize,
        /// The output that is in it.
        of: usize,
    },
}

/// One unknown.
#[derive(Clone, Debug)]
pub struct Unknown {
    /// Name in the result.
    pub name: String,
    /// Kind.
    pub what: What,
    /// Unit.
    pub unit: String,
    /// Start of the search.
    pub start: f64,
    /// Bounds.
    pub bounds: (f64, f64),
    /// Mean and standard deviation beforehand.
    pub prior: Option<(f64, f64)>,
    /// Plausible distance from the start.
    pub reach: f64,
}

impl Question {
    /// The unknowns, in the result's order.
    ///
    /// # Errors
    /// All that is wrong with names, types, bounds and priors.
    pub fn unknowns(
        &self,
        description: &ModelDescription,
        records: &[Record],
    ) -> Result<Vec<Unknown>> {
        let (mut unknowns, mut problems) = (Vec::new(), Vec::new());
        let mut add = |made: Result<Vec<Unknown>>| match made {
            Ok(made) => unknowns.extend(made),
            Err(error) => problems.push(format!("{error:#}")),
        };
        for free in &self.free {
            add(parameters(free, description, records.len()));
        }
        for triad in &self.triads {
            add(self.gains(triad));
        }
        for bias in &self.biases {
            add(self.bias(bias, description, records));
        }
        for prior in &self.priors {
            let at = unknowns.iter_mut().find(|unknown: &&mut Unknown| unknown.name == prior.name);
            match at {
                Some(unknown) => unknown.prior = Some((prior.mean, prior.std)),
                None => problems.push(format!("--prior {}: it is not free", prior.name)),
            }
        }
        for (k, unknown) in unknowns.iter().enumerate() {
            if unknowns[..k].iter().any(|other| other.name == unknown.name) {
                problems.push(format!("{} is free twice", unknown.name));
            }
            let is_alias = |other: &&Unknown| match (unknown.what, other.what) {
                (
                    What::Parameter { reference: a, recording: of_a },
                    What::Parameter { reference: b, recording: of_b },
                ) => {
                    let together = of_a.is_none() || of_b.is_none() || of_a == of_b;
                    a == b && together && unknown.name != other.name
                }
                _ => false,
            };
            if let Some(other) = unknowns[..k].iter().find(is_alias) {
                problems.push(format!(
                    "{} and {} are the same variable of the FMU (allowed: one of them is free)",
                    other.name, unknown.name
                ));
            }
        }
        for setting in &self.settings {
            if let Some(n) = setting.recording.filter(|n| *n >= records.len()) {
                problems.push(format!(
                    "--set {}@{}: there are {} recordings",
                    setting.name,
                    n + 1,
                    records.len()
                ));
            }
        }
        ensure!(problems.is_empty(), "{}", problems.join("; "));
        ensure!(!unknowns.is_empty(), "nothing is free: name what is estimated with --free");
        Ok(unknowns)
    }

    /// Returns the place of an output in the list.
    fn output(&self, name: &str) -> Result<usize> {
        let found = self.outputs.iter().position(|output| output == name);
        found.with_context(|| {
            format!("{name} is not among the outputs ({})", self.outputs.join(", "))
        })
    }

    fn gains(&self, triad: &Triad) -> Result<Vec<Unknown>> {
        let mut gains = Vec::new();
        for (i, read) in triad.outputs.iter().enumerate() {
            for (j, other) in triad.outputs.iter().enumerate() {
                let (output, of) = (self.output(read)?, self.output(other)?);
                let (name, std) = match i == j {
                    true => (format!("scale({read})"), triad.scale),
                    false => (format!("cross({read},{other})"), triad.angle),
                };
                gains.push(Unknown {
                    name,
                    what: What::Gain { output, of },
                    unit: "1".into(),
                    start: 0.0,
                    bounds: (f64::NEG_INFINITY, f64::INFINITY),
                    prior: Some((0.0, std)),
                    reach: std,
                });
            }
        }
        Ok(gains)
    }

    fn bias(
        &self,
        bias: &Bias,
        description: &ModelDescription,
        records: &[Record],
    ) -> Result<Vec<Unknown>> {
        let output = self.output(&bias.output)?;
        let unit = self.unit(&bias.output, description)?;
        let one = |(recording, record): (usize, &Record)| Unknown {
            name: numbered(&format!("bias({})", bias.output), recording),
            what: What::Bias { output, recording },
            unit: unit.clone(),
            start: 0.0,
            bounds: (f64::NEG_INFINITY, f64::INFINITY),
            prior: bias.std.map(|std| (0.0, std)),
            reach: bias.std.unwrap_or_else(|| record.spread(output)),
        };
        Ok(records.iter().enumerate().map(one).collect())
    }
}

/// The name of what a recording has of its own.
fn numbered(name: &str, recording: usize) -> String {
    format!("{name}@{}", recording + 1)
}

fn parameters(
    free: &Free,
    description: &ModelDescription,
    recordings: usize,
) -> Result<Vec<Unknown>> {
    let variable = real(description, &free.name)?;
    let allowed = [Causality::Parameter, Causality::Output, Causality::Local, Causality::Input];
    ensure!(
        allowed.contains(&variable.causality) && variable.variability != Variability::Constant,
        "{} cannot be free: it is a {} {}",
        free.name,
        variable.variability,
        variable.causality
    );
    let own: (f64, f64) = range(variable).into();
    let (low, high) = free.bounds.unwrap_or(own);
    ensure!(
        own.0 <= low && high <= own.1,
        "{} is free from {low} to {high} (allowed by the FMU: {} to {})",
        free.name,
        own.0,
        own.1
    );
    ensure!(
        (low..=high).contains(&free.start),
        "{} starts at {} (allowed: {low} to {high})",
        free.name,
        free.start
    );
    let reach = match free.bounds {
        Some((low, high)) if (high - low).is_finite() => 0.25 * (high - low),
        _ if free.start != 0.0 => 0.5 * free.start.abs(),
        _ => 1.0,
    };
    let one = |recording: Option<usize>| Unknown {
        name: recording.map_or(free.name.clone(), |k| numbered(&free.name, k)),
        what: What::Parameter { reference: variable.reference, recording },
        unit: description.unit(variable).into(),
        start: free.start,
        bounds: (low, high),
        prior: None,
        reach,
    };
    Ok(match free.each {
        true => (0..recordings).map(|k| one(Some(k))).collect(),
        false => vec![one(None)],
    })
}

//! Unknowns of an identification, with names, units, bounds and priors.

use anyhow::{Context, Result, bail, ensure};
use host::causality::{Causality, Variability};
use host::description::{ModelDescription, Value, Variable};

use crate::engine::{Part, Role, Unknown};
use crate::input::question::{Bias, EACH, Free, Question, Size, Tolerance, Triad, real, scaled};
use crate::input::record::Record;
use crate::tuning::{KNOWN_REACH, SCALE_REACH};

/// Quantity of the simulation that an unknown changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    Parameter(u32),
    /// Relative error x of an input's recorded values: the FMU receives the recorded values times 1 + x.
    Scale(usize),
    /// Relative error x of the recording's clock: true time intervals are the recorded intervals times 1 + x.
    Clock,
    Reading,
}

pub type Targeted = (Unknown, Target);

const FREELY: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

impl Question {
    /// Returns the unknowns in the order of the result.
    ///
    /// # Errors
    /// If a name, type, bound or prior is wrong; the message lists all faults.
    pub fn unknowns(
        &self,
        description: &ModelDescription,
        records: &[Record],
    ) -> Result<Vec<Targeted>> {
        let (mut unknowns, mut problems) = (Vec::new(), Vec::new());
        let mut add = |made: Result<Vec<Targeted>>| match made {
            Ok(made) => unknowns.extend(made),
            Err(error) => problems.push(format!("{error:#}")),
        };
        for free in &self.free {
            add(self.free(free, description, records.len()));
        }
        for triad in &self.triads {
            add(self.gains(triad));
        }
        for bias in &self.biases {
            add(self.bias(bias, description, records));
        }
        for tolerance in &self.tolerances {
            add(self.known(tolerance, description, records.len()).map(|unknown| vec![unknown]));
        }
        for prior in &self.priors {
            let at = unknowns.iter_mut().find(|(u, _): &&mut Targeted| u.name == prior.name);
            match at {
                Some((unknown, _)) => unknown.prior = Some((prior.mean, prior.std)),
                None => problems.push(format!(
                    "--prior {}: this is not an unknown (allowed: names that --free names)",
                    prior.name
                )),
            }
        }
        for (k, (unknown, target)) in unknowns.iter().enumerate() {
            let before = &unknowns[..k];
            if let Some((other, _)) = before.iter().find(|(other, _)| other.name == unknown.name) {
                problems.push(match (unknown.is_known(), other.is_known()) {
                    (true, false) => format!(
                        "--tolerance {}: --free names this value as an unknown (allowed: --prior, with its mean and standard deviation)",
                        unknown.name
                    ),
                    (true, true) => format!("--tolerance names {} twice", unknown.name),
                    _ => format!("--free names {} twice", unknown.name),
                });
            }
            let is_alias = |(other, of): &&Targeted| {
                let alike = matches!(target, Target::Parameter(_)) && of == target;
                let together = match (unknown.role, other.role) {
                    (Role::Run(Some(a)), Role::Run(Some(b))) => a == b,
                    _ => true,
                };
                alike && together && unknown.name != other.name
            };
            if let Some((other, _)) = before.iter().find(is_alias) {
                problems.push(format!(
                    "--free names {} and {}, which are the same variable of the FMU (allowed: one of the two)",
                    other.name, unknown.name
                ));
            }
        }
        for setting in &self.settings {
            if setting.recording.is_some_and(|n| n >= records.len()) {
                let name = setting.named().0;
                problems.push(format!(
                    "--set {name}: there is no recording of this number (there are {} recordings)",
                    records.len()
                ));
            }
        }
        ensure!(problems.is_empty(), "{}", problems.join("; "));
        ensure!(
            !unknowns.is_empty(),
            "no unknown is given: name the parameters to estimate with --free"
        );
        Ok(unknowns)
    }

    fn output(&self, name: &str) -> Result<usize> {
        let found = self.outputs.iter().position(|output| output == name);
        found.with_context(|| {
            format!("{name} is not among the outputs ({})", self.outputs.join(", "))
        })
    }

    fn gains(&self, triad: &Triad) -> Result<Vec<Targeted>> {
        let mut gains = Vec::new();
        for (i, read) in triad.outputs.iter().enumerate() {
            for (j, other) in triad.outputs.iter().enumerate() {
                let (output, of) = (self.output(read)?, self.output(other)?);
                let (name, std) = match i == j {
                    true => (format!("scale({read})"), triad.scale),
                    false => (format!("cross({read},{other})"), triad.angle),
                };
                let role = Role::Gain(output, of);
                let gain = Unknown::linear(&name, "1", role, (0.0, std), FREELY);
                gains.push((gain.with_prior(0.0, std), Target::Reading));
            }
        }
        Ok(gains)
    }

    fn bias(
        &self,
        bias: &Bias,
        description: &ModelDescription,
        records: &[Record],
    ) -> Result<Vec<Targeted>> {
        let output = self.output(&bias.output)?;
        let unit = self.unit(&bias.output, description)?;
        let one = |(recording, record): (usize, &Record)| {
            let name = numbered(&format!("bias({})", bias.output), Some(recording));
            let role = Role::Bias(output, Some(recording));
            let reach = bias.std.unwrap_or_else(|| record.spread(output));
            let unknown = Unknown::linear(&name, &unit, role, (0.0, reach), FREELY);
            (Unknown { prior: bias.std.map(|std| (0.0, std)), ..unknown }, Target::Reading)
        };
        Ok(records.iter().enumerate().map(one).collect())
    }

    fn free(
        &self,
        free: &Free,
        description: &ModelDescription,
        recordings: usize,
    ) -> Result<Vec<Targeted>> {
        let one = |recording: Option<usize>| match scaled(&free.name) {
            Some(of) => {
                let (mut unknown, target) = self.scale(of, recording)?;
                let (low, high) = free.bounds.unwrap_or(unknown.bounds);
                ensure!(
                    low > -1.0,
                    "the lower bound of {} is {low} (allowed: above -1)",
                    free.name
                );
                if (high - low).is_finite() {
                    unknown.reach = 0.25 * (high - low);
                }
                (unknown.start, unknown.bounds) = (free.start, (low, high));
                Ok((unknown, target))
            }
            None => parameter(free, description, recording),
        };
        match free.each {
            true => (0..recordings).map(|k| one(Some(k))).collect(),
            false => Ok(vec![one(None)?]),
        }
    }

    /// Returns the unknown for the relative scale error of an input, an output or the clock.
    fn scale(&self, of: &str, recording: Option<usize>) -> Result<Targeted> {
        let input = self.inputs.iter().position(|name| name == of);
        let output = self.outputs.iter().position(|name| name == of);
        let (role, target) = match (input, output) {
            (Some(input), _) => (Role::Run(recording), Target::Scale(input)),
            (None, Some(output)) => {
                ensure!(
                    recording.is_none(),
                    "scale({of}){EACH}: a sensor has one scale (allowed: scale({of}))"
                );
                (Role::Gain(output, output), Target::Reading)
            }
            (None, None) if of == CLOCK => (Role::Run(recording), Target::Clock),
            (None, None) => {
                let names = self.inputs.iter().chain(&self.outputs).map(String::as_str);
                let names: Vec<&str> = names.chain([CLOCK]).collect();
                bail!(
                    "scale({of}): the scale of {of} cannot be estimated (allowed: {})",
                    names.join(", ")
                )
            }
        };
        let name = numbered(&format!("scale({of})"), recording);
        Ok((Unknown::linear(&name, "1", role, (0.0, SCALE_REACH), FREELY), target))
    }

    fn known(
        &self,
        tolerance: &Tolerance,
        description: &ModelDescription,
        recordings: usize,
    ) -> Result<Targeted> {
        let flag = format!("--tolerance {}", tolerance.name);
        if let Some(of) = scaled(&tolerance.name) {
            let Size::Part(part) = tolerance.size else {
                bail!("{flag}: the tolerance of a scale must be relative, such as 1%")
            };
            let unknown = self.scale(of, None).with_context(|| flag.clone())?;
            return known(unknown, 0.0, part).with_context(|| flag);
        }
        let (name, recording) = match tolerance.name.rsplit_once('@') {
            None => (tolerance.name.as_str(), None),
            Some((name, number)) => {
                let number = number.parse().ok().filter(|n| (1..=recordings).contains(n));
                let number = number.with_context(|| {
                    format!("{flag} (allowed: {name}@RECORDING, from 1 to {recordings})")
                })?;
                (name, Some(number - 1))
            }
        };
        if self.inputs.iter().any(|input| input == name) {
            bail!("{flag}: {name} is a recorded input (allowed: scale({name}))");
        }
        let variable = real(description, name).with_context(|| flag.clone())?;
        let own = (0..recordings).filter(|number| recording.is_none_or(|of| of == *number));
        let values = own.map(|number| self.set_value(variable, description, number));
        let values = values.collect::<Result<Vec<f64>>>().with_context(|| flag.clone())?;
        let value = values[0];
        ensure!(
            values.iter().all(|other| *other == value),
            "{flag}: the recordings have different values of {name} (allowed: {name}@1 to {name}@{recordings})"
        );
        let std = match &tolerance.size {
            Size::Part(part) if value == 0.0 && *part > 0.0 => bail!(
                "{flag}: {name} is 0, so that a range in percent of {name} is empty (allowed: a number with a unit, or ±NUMBER)"
            ),
            Size::Part(part) => part * value.abs(),
            Size::Absolute(text) => deviation(variable, description, text)?,
        };
        let free = Free { name: name.into(), each: false, start: value, bounds: None };
        known(parameter(&free, description, recording)?, value, std).with_context(|| flag)
    }

    /// Returns the value of a variable in a recording: the value from `--set` if it sets the variable, otherwise the
    /// start value in the model description.
    fn set_value(
        &self,
        variable: &Variable,
        description: &ModelDescription,
        number: usize,
    ) -> Result<f64> {
        let of = |name: &str, recording: Option<usize>| {
            name == variable.name && recording.is_none_or(|of| of == number)
        };
        let set = self.settings.iter().rev().find(|setting| of(&setting.name, setting.recording));
        let text = set.map(|setting| &setting.value).or(variable.attributes().start.as_ref());
        let text = text.with_context(|| {
            format!("{} has no start value: give it one with --set", variable.name)
        })?;
        match description.value(variable, text)? {
            Value::Real(value) => Ok(value),
            _ => bail!("{} is not a Real", variable.name),
        }
    }
}

fn known((unknown, target): Targeted, mean: f64, std: f64) -> Result<Targeted> {
    ensure!(std > 0.0 && std.is_finite(), "the tolerance must be above 0");
    let (start, reach, part) = (mean, KNOWN_REACH * std, Part::Tolerance);
    Ok((Unknown { start, reach, part, ..unknown.with_prior(mean, std) }, target))
}

const CLOCK: &str = "time";

/// Returns the smallest and largest value that the model description declares for a variable, infinite
/// if it declares none.
pub fn range(variable: &Variable) -> [f64; 2] {
    let attributes = variable.attributes();
    let number = |text: &Option<String>, otherwise: f64| {
        text.as_ref().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
    };
    [number(&attributes.min, f64::NEG_INFINITY), number(&attributes.max, f64::INFINITY)]
}

fn deviation(variable: &Variable, description: &ModelDescription, text: &str) -> Result<f64> {
    let number = |text: &str| match description.value(variable, text)? {
        Value::Real(number) => Ok(number),
        _ => bail!("{} is not a Real", variable.name),
    };
    let is_of_number = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    // zero in the same unit, because a unit such as °C has an offset
    let zero = format!("0{}", text.trim_start_matches(is_of_number));
    Ok(number(text)? - number(&zero)?)
}

/// Returns the name of an unknown. If it acts in only one recording, the number of the recording is added: `bias(w)@2`.
fn numbered(name: &str, recording: Option<usize>) -> String {
    recording.map_or(name.into(), |k| format!("{name}@{}", k + 1))
}

fn parameter(
    free: &Free,
    description: &ModelDescription,
    recording: Option<usize>,
) -> Result<Targeted> {
    let variable = real(description, &free.name)?;
    let allowed = [Causality::Parameter, Causality::Output, Causality::Local, Causality::Input];
    ensure!(
        allowed.contains(&variable.causality) && variable.variability != Variability::Constant,
        "{} cannot be free: it is a {} {}",
        free.name,
        variable.variability,
        variable.causality
    );
    let [least, largest] = range(variable);
    let (low, high) = free.bounds.unwrap_or((least, largest));
    ensure!(
        least <= low && high <= largest,
        "{} is free from {low} to {high} (allowed by the FMU: {least} to {largest})",
        free.name
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
    let name = numbered(&free.name, recording);
    let (unit, role) = (description.unit(variable), Role::Run(recording));
    let unknown = Unknown::linear(&name, unit, role, (free.start, reach), (low, high));
    Ok((unknown, Target::Parameter(variable.reference)))
}

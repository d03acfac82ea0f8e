use analysis::random::Random;
use anyhow::{Result, bail, ensure};
use host::description::{ModelDescription, Type, Variable};

use super::Named;
use super::problems::Problems;
use crate::profile::Written;

const MOST_DRAWS: usize = 10_000;

#[derive(Clone, Debug)]
pub(super) struct Draws {
    pub runs: usize,
    pub seed: u64,
    pub draw: Vec<Named<Distribution>>,
}

/// Probability distribution of a varied value. Values outside `min` to `max` or outside the bounds of the
/// variable are drawn again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Distribution {
    kind: Kind,
    min: f64,
    max: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Normal {
        mean: f64,
        deviation: f64,
    },
    Uniform {
        from: f64,
        to: f64,
    },
    /// Lognormal distribution; `deviation` is the standard deviation of the natural logarithm of the value.
    Lognormal {
        median: f64,
        deviation: f64,
    },
}

pub(super) struct Family {
    pub name: &'static str,
    pub parameters: [&'static str; 2],
    kind: fn(f64, f64) -> Kind,
    makes_sense: fn(f64, f64) -> bool,
    rule: &'static str,
}

impl Family {
    pub const ALL: [Family; 3] = [
        Family {
            name: "normal",
            parameters: ["mean", "deviation"],
            kind: |mean, deviation| Kind::Normal { mean, deviation },
            makes_sense: |_, deviation| deviation > 0.0,
            rule: "deviation must be positive",
        },
        Family {
            name: "uniform",
            parameters: ["from", "to"],
            kind: |from, to| Kind::Uniform { from, to },
            makes_sense: |from, to| from < to,
            rule: "from must be less than to",
        },
        Family {
            name: "lognormal",
            parameters: ["median", "deviation"],
            kind: |median, deviation| Kind::Lognormal { median, deviation },
            makes_sense: |median, deviation| median > 0.0 && deviation > 0.0,
            rule: "median and deviation must be positive",
        },
    ];

    /// Returns the distribution with these parameters and bounds, or an error that
    /// states the violated condition.
    pub fn distribution(&self, [a, b]: [f64; 2], (min, max): (f64, f64)) -> Result<Distribution> {
        ensure!((self.makes_sense)(a, b), "{}", self.rule);
        ensure!(min < max, "min must be less than max");
        Ok(Distribution { kind: (self.kind)(a, b), min, max })
    }
}

impl Draws {
    /// Returns the random values of draw `number`. Every draw has its own stream of random numbers, so that
    /// its values do not depend on the number of draws.
    pub fn draw(
        &self,
        description: &ModelDescription,
        profile: &Written,
        number: u64,
        problems: &mut Problems,
    ) -> Vec<Named<String>> {
        let mut random = Random::new(self.seed, number);
        let mut values = Vec::with_capacity(self.draw.len());
        for Named { name, value: distribution, lines } in &self.draw {
            let mut draw = || {
                let variable = match name.starts_with("profile.") {
                    true => None,
                    false => Some(description.variable(name)?),
                };
                let whole = match variable {
                    Some(variable) => variable.kind() == Type::Integer,
                    None => name.strip_prefix("profile.").is_some_and(|key| profile.is_whole(key)),
                };
                distribution.draw(&mut random, variable, whole)
            };
            let drawn = draw().map_err(|error| error.context(format!("[random.draw] {name}")));
            let value = problems.take(lines, drawn);
            let (name, lines) = (name.clone(), lines.clone());
            values.extend(value.map(|value| Named { name, value, lines }));
        }
        values
    }
}

impl Distribution {
    fn draw(
        &self,
        random: &mut Random,
        variable: Option<&Variable>,
        whole: bool,
    ) -> Result<String> {
        let bound = |text: Option<&String>| text.and_then(|text| text.parse::<f64>().ok());
        let attributes = variable.map(|variable| variable.attributes());
        let min =
            attributes.and_then(|a| bound(a.min.as_ref())).map_or(self.min, |m| m.max(self.min));
        let max =
            attributes.and_then(|a| bound(a.max.as_ref())).map_or(self.max, |m| m.min(self.max));
        for _ in 0..MOST_DRAWS {
            let value = match self.kind {
                Kind::Normal { mean, deviation } => mean + deviation * random.normal(),
                // whole numbers from `from` to `to`, including both
                Kind::Uniform { from, to } if whole => {
                    from + (random.uniform() * (to - from + 1.0)).floor()
                }
                Kind::Uniform { from, to } => from + (to - from) * random.uniform(),
                Kind::Lognormal { median, deviation } => {
                    median * libm::exp(deviation * random.normal())
                }
            };
            let value = if whole { value.round() } else { value };
            if (min..=max).contains(&value) {
                return Ok(value.to_string());
            }
        }
        bail!(
            "none of {MOST_DRAWS} random values lies within {min} to {max}; change the distribution or the limits"
        )
    }
}

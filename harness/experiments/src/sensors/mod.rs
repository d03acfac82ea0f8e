//! Sensors that are recorded in a run: the quantities that they measure ([`quantity`]), and their errors. A reading is
//!
//! ```text
//! y = quantum · round((scale · x(t − delay) + bias + noise · n)/quantum),   n ~ N(0, 1) in every sample
//! ```
//!
//! x is sampled every 1/rate seconds. A row has a reading if a sample arrives in it; other rows have no value.

pub mod quantity;

use std::collections::BTreeMap;
use std::str::FromStr;

use analysis::random::Random;
use anyhow::{Context, Error, Result, ensure};
use host::description::{ModelDescription, did_you_mean};
use names::hubslosh::{F_TANGENTIAL, THETA};

use self::quantity::{Quantity, Surface};
use crate::profile::{Allowed, Parameter, Written, parameter};
use crate::run;
use signals::table::Table;

/// A kind of sensor, for example a gyro.
///
/// - `description`: the measured quantity, for readers of the help.
/// - `parameters`: parameters that this kind has in addition to [`ERRORS`].
/// - `unit`: unit of the readings; empty if they have the unit of the variable that the sensor reads.
/// - `of`: `None` if the kind measures a computed quantity. `Some(default)` if it reads one variable, which the user
///   selects with `of=NAME`; `default` is the name of the variable otherwise, if there is one.
#[derive(Debug)]
pub struct Kind {
    pub name: &'static str,
    pub description: &'static str,
    pub parameters: &'static [Parameter],
    pub unit: &'static str,
    of: Option<Option<&'static str>>,
}

const ANGLE: Parameter = parameter(
    "angle",
    std::f64::consts::FRAC_PI_2,
    "rad",
    "angle from radial towards tangential",
    Allowed::Any,
);

pub const KINDS: &[Kind] = &[
    Kind {
        name: "gauge",
        description: "wave height at the wall of HubSlosh's tank, m; angle is 0 radially outwards and 90deg in the tangential direction",
        parameters: &[ANGLE],
        unit: "m",
        of: None,
    },
    Kind {
        name: "pressure",
        description: "pressure at the wall of HubSlosh's tank above the pressure of the gas, Pa, at an angle as of a gauge and a height above the bottom",
        parameters: &[
            ANGLE,
            parameter("height", 0.0, "m", "height over the bottom", Allowed::NotNegative),
        ],
        unit: "Pa",
        of: None,
    },
    Kind {
        name: "camera",
        description: "surface in HubSlosh's tank: the plane that fits it best and the amplitude of each mode, as heights at the wall, m",
        parameters: &[],
        unit: "m",
        of: None,
    },
    Kind {
        name: "force",
        description: "output of the FMU that is a force, N; of=NAME names it",
        parameters: &[],
        unit: "N",
        of: Some(Some(F_TANGENTIAL)),
    },
    Kind {
        name: "accelerometer",
        description: "specific force of a point of HubSlosh's hub, m/s²; radius is its distance from the axis on the tank's side, and angle the measured direction",
        parameters: &[
            parameter("radius", 0.225, "m", "distance from the bearing axis", Allowed::Any),
            ANGLE,
        ],
        unit: "m/s2",
        of: None,
    },
    Kind {
        name: "encoder",
        description: "output of the FMU that is an angle, rad; of=NAME names it",
        parameters: &[],
        unit: "rad",
        of: Some(Some(THETA)),
    },
    Kind {
        name: "variable",
        description: "any Real variable of any FMU; of=NAME names it",
        parameters: &[],
        unit: "",
        of: Some(None),
    },
];

const READING: &str = "its unit";

pub const ERRORS: [Parameter; 7] = [
    parameter(
        "rate",
        0.0,
        "Hz",
        "samples per second; 0: one sample in each row",
        Allowed::NotNegative,
    ),
    parameter("noise", 0.0, READING, "standard deviation of a sample", Allowed::NotNegative),
    parameter("bias", 0.0, READING, "reading if the quantity is 0", Allowed::Any),
    parameter("scale", 1.0, "", "reading divided by the quantity", Allowed::NotZero),
    parameter(
        "quantum",
        0.0,
        READING,
        "smallest step of the readings; 0: none",
        Allowed::NotNegative,
    ),
    parameter("delay", 0.0, "s", "time from a sample to its reading", Allowed::NotNegative),
    parameter("seed", 1.0, "", "seed of the noise", Allowed::Whole(9e15)),
];

/// A sensor as given by `NAME=KIND:key=value,…`. NAME is also the name of its column in the table.
#[derive(Clone, Debug)]
pub struct Sensor {
    pub name: String,
    pub text: String,
    kind: &'static Kind,
    of: Option<String>,
    own: Vec<f64>,
    errors: Errors,
}

/// Values of [`ERRORS`]. Noise, bias and quantum are in the sensor's unit. `noise` is the standard deviation of a sample,
/// `scale` the reading divided by the quantity, and `delay` the time from sampling to reading, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    pub rate: f64,
    pub noise: f64,
    pub bias: f64,
    pub scale: f64,
    pub quantum: f64,
    pub delay: f64,
    pub seed: u64,
}

impl FromStr for Sensor {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let allowed = "(allowed: NAME=KIND:key=value,…)";
        let (name, rest) =
            text.split_once('=').with_context(|| format!("sensor \"{text}\" {allowed}"))?;
        Sensor::new(name.trim(), rest)
    }
}

impl Sensor {
    /// Creates a sensor from its text `KIND:key=value,…`. The column of its readings gets the name `name`.
    ///
    /// # Errors
    /// Lists everything that is wrong with it.
    pub fn new(name: &str, text: &str) -> Result<Self> {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
        ensure!(
            name.chars().next().is_some_and(|c| c.is_ascii_alphabetic()) && name.chars().all(plain),
            "sensor \"{name}\": a name has letters, digits, _ and . and begins with a letter"
        );
        let mut written = Written::read("sensor", text.trim())?;
        let kind = KINDS.iter().find(|kind| kind.name == written.name()).with_context(|| {
            let names = KINDS.iter().map(|kind| kind.name);
            let all: Vec<_> = names.clone().collect();
            let hint = did_you_mean(written.name(), names);
            format!(
                "sensor {name}: there is no kind \"{}\" (there are {}){hint}",
                written.name(),
                all.join(", ")
            )
        })?;
        let of = written.take("of");
        let of_kind = |parameter: &Parameter| match parameter.unit {
            READING => Parameter { unit: kind.unit, ..*parameter },
            _ => *parameter,
        };
        let parameters = kind.parameters.iter().chain(&ERRORS).map(of_kind);
        let parameters: Vec<Parameter> = parameters.collect();
        let (mut values, mut problems) = written.values(&parameters);
        match (kind.of, &of) {
            (None, Some(_)) => problems.push(format!(
                "{} does not read a variable, so that of= is not allowed",
                kind.name
            )),
            (Some(None), None) => problems.push("of=NAME is required".into()),
            _ => {}
        }
        ensure!(problems.is_empty(), "sensor {name}: {}", problems.join("; "));
        let errors = values.split_off(kind.parameters.len());
        let [rate, noise, bias, scale, quantum, delay, seed] = std::array::from_fn(|k| errors[k]);
        let errors = Errors { rate, noise, bias, scale, quantum, delay, seed: seed as u64 };
        Ok(Sensor { name: name.into(), text: text.trim().into(), kind, of, own: values, errors })
    }

    pub fn errors(&self) -> &Errors {
        &self.errors
    }

    /// Returns the quantity that the sensor measures in an FMU with these settings.
    ///
    /// # Errors
    /// If the FMU has no such quantity.
    pub fn quantity(
        &self,
        description: &ModelDescription,
        settings: &[(String, String)],
    ) -> Result<Quantity> {
        let parameters = run::parameters(description, settings, &[]);
        let surface = Surface { description, parameters: &parameters };
        let quantity = match (self.kind.name, self.kind.of) {
            ("gauge", _) => Quantity::wave(&surface, self.own[0]),
            ("pressure", _) => Quantity::pressure(&surface, self.own[0], self.own[1]),
            ("camera", _) => Quantity::camera(&surface),
            ("accelerometer", _) => Quantity::acceleration(description, self.own[0], self.own[1]),
            (_, Some(default)) => {
                let name = self.of.as_deref().or(default).unwrap_or_default();
                let unit = Some(self.kind.unit).filter(|unit| !unit.is_empty());
                Quantity::variable(description, name, unit)
            }
            (kind, None) => unreachable!("{kind} has no quantity"),
        };
        quantity.with_context(|| format!("sensor {} ({})", self.name, self.kind.name))
    }

    /// Returns the name of a channel's column: the sensor's name, with `.channel` if there are several.
    pub fn column(&self, channel: &str) -> String {
        match channel {
            "" => self.name.clone(),
            channel => format!("{}.{channel}", self.name),
        }
    }

    pub fn has(&self, column: &str) -> bool {
        let rest = column.strip_prefix(&self.name);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    }

    /// Returns the reading that a value of the quantity gives without noise, delay and
    /// quantisation.
    pub fn expected(&self, value: f64) -> f64 {
        self.errors.scale * value + self.errors.bias
    }

    /// Returns the readings of one channel in the rows of a run, NaN in rows without a reading. A sample is taken in every
    /// `every`-th row, and its reading arrives `late` rows later. The noise is seeded with `stream`, so that channels and
    /// runs have different noise.
    fn readings(&self, truth: &[f64], every: usize, late: usize, stream: &str) -> Vec<f64> {
        let Errors { noise, quantum, seed, .. } = self.errors;
        let mut random = Random::new(seed, fnv(stream));
        let mut readings = vec![f64::NAN; truth.len()];
        for (k, value) in truth.iter().enumerate().step_by(every) {
            let y = self.expected(*value) + noise * random.normal();
            if let Some(reading) = readings.get_mut(k + late) {
                // + 0.0 avoids −0 in a file
                *reading = if quantum > 0.0 { quantum * (y / quantum).round() + 0.0 } else { y };
            }
        }
        readings
    }
}

#[derive(Debug, Default)]
pub struct Sensors(Vec<(Sensor, Quantity)>);

impl Sensors {
    /// Creates the sensors of a run. `settings` are the start values that the run sets, and its rows are `step`
    /// seconds apart.
    ///
    /// # Errors
    /// Lists everything that is wrong with them.
    pub fn new(
        sensors: &[Sensor],
        description: &ModelDescription,
        settings: &[(String, String)],
        step: f64,
    ) -> Result<Self> {
        let (mut problems, mut taken) = (Vec::new(), Vec::<String>::new());
        let mut bound = Vec::new();
        for sensor in sensors {
            if description.variables.iter().any(|v| v.name == sensor.name) || sensor.name == "time"
            {
                problems.push(format!(
                    "sensor {}: the FMU has a variable of this name (allowed: another name)",
                    sensor.name
                ));
            } else if taken.contains(&sensor.name) {
                problems.push(format!(
                    "sensor {}: two sensors have this name (allowed: one)",
                    sensor.name
                ));
            }
            taken.push(sensor.name.clone());
            let rows = sensor.rows(step).map(|_| ());
            match rows.and_then(|()| sensor.quantity(description, settings)) {
                Ok(quantity) => bound.push((sensor.clone(), quantity)),
                Err(error) => problems.push(format!("{error:#}")),
            }
        }
        ensure!(problems.is_empty(), "{}", problems.join("; "));
        Ok(Sensors(bound))
    }

    pub fn required_variables(&self) -> Vec<&str> {
        let mut needs: Vec<&str> = Vec::new();
        for name in self.0.iter().flat_map(|(_, quantity)| &quantity.needs) {
            if !needs.contains(&name.as_str()) {
                needs.push(name);
            }
        }
        needs
    }

    pub fn columns(&self) -> Vec<String> {
        let one = |(sensor, quantity): &(Sensor, Quantity)| {
            let names = quantity.channels.iter().map(|(channel, _)| sensor.column(channel));
            names.collect::<Vec<_>>()
        };
        self.0.iter().flat_map(one).collect()
    }

    /// Returns the table of a run with the readings of the sensors instead of the variables that were recorded only
    /// for them. `kept` is the number of columns that the user has requested; they are the first columns of `table`.
    ///
    /// # Errors
    /// If the table lacks a variable that the sensors need.
    pub fn recorded(&self, table: Table, kept: usize, run: &str, step: f64) -> Result<Table> {
        let names: Vec<String> =
            table.names()[..kept].iter().cloned().chain(self.columns()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        Ok(self.read(table, run, step)?.select(&names))
    }

    /// Adds the readings of all sensors to the table of a run. `run` is the name of the run; runs with the same seed but
    /// different names have different noise.
    ///
    /// # Errors
    /// If the table lacks a variable that the sensors need.
    pub fn read(&self, table: Table, run: &str, step: f64) -> Result<Table> {
        let mut columns = Vec::new();
        for (sensor, quantity) in &self.0 {
            let [every, late] = sensor.rows(step)?;
            let needs: Option<Vec<&[f64]>> =
                quantity.needs.iter().map(|name| table.column(name)).collect();
            let needs = needs.with_context(|| {
                format!(
                    "sensor {}: the run has not recorded {}",
                    sensor.name,
                    quantity.needs.join(", ")
                )
            })?;
            let mut truth = vec![Vec::with_capacity(table.rows()); quantity.channels.len()];
            for row in 0..table.rows() {
                let read: Vec<f64> = needs.iter().map(|column| column[row]).collect();
                let values = quantity.values(&read);
                truth.iter_mut().zip(values).for_each(|(channel, value)| channel.push(value));
            }
            for ((channel, _), truth) in quantity.channels.iter().zip(truth) {
                let column = sensor.column(channel);
                let readings = sensor.readings(&truth, every, late, &format!("{run} {column}"));
                columns.push((column, readings));
            }
        }
        Ok(columns.into_iter().fold(table, |table, (name, column)| table.with_gaps(&name, column)))
    }

    pub fn texts(&self) -> BTreeMap<&str, &str> {
        self.0.iter().map(|(sensor, _)| (sensor.name.as_str(), sensor.text.as_str())).collect()
    }
}

impl Sensor {
    /// Converts times to numbers of rows: from a sample to the next, and from a sample to its reading.
    ///
    /// # Errors
    /// If a time is not a multiple of the step.
    fn rows(&self, step: f64) -> Result<[usize; 2]> {
        let whole = |what: &str, seconds: f64| {
            let rows = seconds / step;
            ensure!(
                (rows - rows.round()).abs() < 1e-6 * rows.max(1.0),
                "sensor {}: {what} {seconds} s is not a multiple of the step, {step} s",
                self.name
            );
            Ok(rows.round() as usize)
        };
        let every = match self.errors.rate {
            0.0 => 1,
            rate => whole("1/rate =", 1.0 / rate)?,
        };
        ensure!(every > 0, "sensor {}: the sampling rate is above one sample per row", self.name);
        Ok([every, whole("delay =", self.errors.delay)?])
    }
}

pub fn help() -> String {
    let written = |parameters: &[Parameter]| {
        let pairs = parameters.iter().map(|p| match p.unit {
            "rad" => format!("{}={}deg", p.name, p.default.to_degrees()),
            _ => format!("{}={}", p.name, p.default),
        });
        pairs.collect::<Vec<_>>().join(",")
    };
    let kinds = KINDS.iter().map(|kind| {
        let own = written(kind.parameters);
        let of = kind.of.map(|default| format!("of={}", default.unwrap_or("NAME")));
        let all: Vec<String> = of.into_iter().chain([own]).filter(|t| !t.is_empty()).collect();
        let colon = if all.is_empty() { "" } else { ":" };
        format!("  {}{colon}{}\n      {}\n", kind.name, all.join(","), kind.description)
    });
    let head = "  every sensor also has:\n".to_string();
    let error = |p: &Parameter| format!("      {}={}: {}\n", p.name, p.default, p.label);
    kinds.chain([head]).chain(ERRORS.iter().map(error)).collect()
}

/// Returns a hash of a text that is the same on every machine (FNV-1a).
fn fnv(text: &str) -> u64 {
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    text.bytes().fold(0xcbf2_9ce4_8422_2325, step)
}

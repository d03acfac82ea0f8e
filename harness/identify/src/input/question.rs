//! The question of an FMU's identification: unknowns, priors, sensors and settings, read from text, with the FMU's own
//! names, units and bounds.

use std::str::FromStr;

use anyhow::{Context, Error, Result, bail, ensure};
use experiments::sensors::Sensor;
use experiments::sensors::quantity::Quantity;
use host::description::{ModelDescription, Type, Variable};

use crate::input::names::list;
use crate::input::tolerance::part;

/// Suffix of the name of an unknown that has a separate value in each recording.
pub const EACH: &str = "@each";

/// `NAME=START[:LOW:HIGH]` or `NAME@each=START[:LOW:HIGH]`: an unknown. It is a Real of the FMU that is set before
/// initialisation, or a scale error, `scale(NAME)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Free {
    pub name: String,
    /// True if the unknown has a separate value in each recording, for example an initial value.
    pub each: bool,
    pub start: f64,
    /// Bounds of the unknown; `None` if the FMU's min and max are its bounds.
    pub bounds: Option<(f64, f64)>,
}

impl FromStr for Free {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, value) = named(text)?;
        let (start, bounds) = match numbers(value).with_context(|| format!("--free {text}"))?[..] {
            [start] => (start, None),
            [start, low, high] if low < high => (start, Some((low, high))),
            _ => {
                bail!("--free {text} (allowed: NAME=START or NAME=START:LOW:HIGH with LOW < HIGH)")
            }
        };
        ensure!(start.is_finite(), "--free {text}: START must be finite");
        let is_inside = bounds.is_none_or(|(low, high)| (low..=high).contains(&start));
        ensure!(is_inside, "--free {text}: START must lie between LOW and HIGH");
        let each = name.ends_with(EACH);
        Ok(Free { name: name.trim_end_matches(EACH).into(), each, start, bounds })
    }
}

/// `NAME=MEAN:STD`: prior of an unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    pub name: String,
    pub mean: f64,
    pub std: f64,
}

impl FromStr for Prior {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, value) = named(text)?;
        match numbers(value).with_context(|| format!("--prior {text}"))?[..] {
            [mean, std] if mean.is_finite() && std.is_finite() && std > 0.0 => {
                Ok(Prior { name: name.into(), mean, std })
            }
            _ => bail!("--prior {text} (allowed: NAME=MEAN:STD with STD above 0)"),
        }
    }
}

/// `NAME=FRACTION`, `NAME=FRACTION%` or `NAME=NUMBER UNIT`: the standard deviation of a value that is known but not exact.
/// FRACTION is relative to the value, NUMBER is in the unit; `±NUMBER` is in the variable's own unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// Name of a variable, for all recordings or for one of them (`NAME@2`), or of a scale (`scale(NAME)`, see [`scaled`]).
    pub name: String,
    pub size: Size,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Size {
    Part(f64),
    /// Tolerance as a number, with a unit if it is not the variable's own.
    Absolute(String),
}

impl FromStr for Tolerance {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, value) = named(text).with_context(|| format!("--tolerance {text}"))?;
        let absolute = value.strip_prefix('±').or_else(|| value.strip_prefix("+-"));
        let size = match absolute {
            Some(number) => Size::Absolute(number.trim().into()),
            None => part(&format!("--tolerance {name}"), value)?
                .map_or_else(|| Size::Absolute(value.into()), Size::Part),
        };
        Ok(Tolerance { name: name.into(), size })
    }
}

/// Returns the NAME of `scale(NAME)`: the input, output or `time` whose scale error is unknown. Returns `None` for other names.
pub fn scaled(name: &str) -> Option<&str> {
    name.strip_prefix("scale(")?.strip_suffix(')')
}

/// `OUTPUT` or `OUTPUT=STD`: a sensor with a bias that differs from recording to recording. STD is the standard deviation of the
/// bias, whose prior mean is 0; without STD the bias has no prior.
#[derive(Clone, Debug, PartialEq)]
pub struct Bias {
    pub output: String,
    /// Standard deviation of the bias, whose prior mean is 0; `None` without a prior.
    pub std: Option<f64>,
}

impl FromStr for Bias {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let Ok((output, value)) = named(text) else {
            return Ok(Bias { output: text.trim().into(), std: None });
        };
        match numbers(value).with_context(|| format!("--bias {text}"))?[..] {
            [std] if std.is_finite() && std > 0.0 => {
                Ok(Bias { output: output.into(), std: Some(std) })
            }
            _ => bail!("--bias {text} (allowed: OUTPUT or OUTPUT=STD with STD above 0)"),
        }
    }
}

/// `A,B,C=SCALE:ANGLE`: three outputs ω_j that are measured by one three-axis instrument with the readings y_i = Σ
/// (δ_ij + M_ij) ω_j. SCALE is the standard deviation of the scale errors M_ii; ANGLE (rad) is the standard deviation
/// of the misalignments M_ij.
#[derive(Clone, Debug, PartialEq)]
pub struct Triad {
    pub outputs: [String; 3],
    pub scale: f64,
    /// Standard deviation of the misalignments, rad.
    pub angle: f64,
}

impl FromStr for Triad {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let allowed =
            || format!("--triad {text} (allowed: OUTPUT,OUTPUT,OUTPUT=SCALE:ANGLE, both above 0)");
        let (names, value) = named(text).with_context(allowed)?;
        let outputs = list(names).map(String::from).collect::<Vec<_>>().try_into();
        match (outputs, &numbers(value).with_context(allowed)?[..]) {
            (Ok(outputs), [scale, angle]) if *scale > 0.0 && *angle > 0.0 => {
                Ok(Triad { outputs, scale: *scale, angle: *angle })
            }
            _ => bail!(allowed()),
        }
    }
}

/// A setting `NAME=VALUE` or, for the second recording only, `NAME@2=VALUE`.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    pub name: String,
    /// Index of the recording; `None` for all recordings.
    pub recording: Option<usize>,
    pub value: String,
}

impl FromStr for Setting {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (name, value) = named(text)?;
        let (name, recording) = match name.rsplit_once('@') {
            None => (name, None),
            Some((name, number)) => {
                let number: usize = number.parse().ok().filter(|n| *n > 0).with_context(|| {
                    format!("--set {text} (allowed: NAME=VALUE or NAME@RECORDING=VALUE, from 1)")
                })?;
                (name, Some(number - 1))
            }
        };
        Ok(Setting { name: name.into(), recording, value: value.into() })
    }
}

impl Setting {
    /// Returns the name and the value. If the setting is for one recording only, the name includes the number
    /// of the recording (`NAME@2`).
    pub fn named(&self) -> (String, String) {
        let name = match self.recording {
            None => self.name.clone(),
            Some(recording) => format!("{}@{}", self.name, recording + 1),
        };
        (name, self.value.clone())
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solver {
    Own,
    /// The host's solver integrates the FMU (Model Exchange) with this relative tolerance.
    Host(f64),
}

#[derive(Clone, Debug)]
pub struct Question {
    pub free: Vec<Free>,
    pub priors: Vec<Prior>,
    /// Tolerances of known values. In the fit these values are unknowns with a prior, but they are not reported as estimates.
    pub tolerances: Vec<Tolerance>,
    pub settings: Vec<Setting>,
    pub inputs: Vec<String>,
    pub held: Vec<String>,
    pub outputs: Vec<String>,
    /// Sensors that measure quantities that are no outputs of the FMU, for example a wave gauge or a camera.
    pub sensors: Vec<Sensor>,
    pub biases: Vec<Bias>,
    pub triads: Vec<Triad>,
    pub drift: bool,
    pub solver: Solver,
    /// Relative tolerance for the FMU's own solver; `None` leaves the choice to the FMU.
    pub tolerance: Option<f64>,
    /// Largest number of start points of the search. The first one is given by the user. If the search from it does not end at a
    /// good fit, further ones are drawn at random within the bounds.
    pub starts: usize,
}

impl Question {
    /// Returns the sensor of a column, its quantity and its channel number; `None` if no sensor has this column.
    ///
    /// # Errors
    /// If the FMU lacks the quantity that the sensor measures.
    pub fn sensor(
        &self,
        column: &str,
        description: &ModelDescription,
    ) -> Result<Option<(&Sensor, Quantity, usize)>> {
        let Some(sensor) = self.sensors.iter().find(|sensor| sensor.has(column)) else {
            return Ok(None);
        };
        let of_all = self.settings.iter().filter(|setting| setting.recording.is_none());
        let settings: Vec<_> = of_all.map(|s| (s.name.clone(), s.value.clone())).collect();
        let quantity = sensor.quantity(description, &settings)?;
        let columns: Vec<String> =
            quantity.channels.iter().map(|(channel, _)| sensor.column(channel)).collect();
        let channel = columns.iter().position(|name| name == column).with_context(|| {
            format!("sensor {} has no column {column} (it has {})", sensor.name, columns.join(", "))
        })?;
        Ok(Some((sensor, quantity, channel)))
    }

    /// Returns the unit of an output of the FMU or of a column of a sensor.
    ///
    /// # Errors
    /// If there is no such output.
    pub fn unit(&self, output: &str, description: &ModelDescription) -> Result<String> {
        Ok(match self.sensor(output, description)? {
            Some((_, quantity, channel)) => quantity.channels[channel].1.clone(),
            None => description.unit(real(description, output)?).into(),
        })
    }
}

pub fn real<'a>(description: &'a ModelDescription, name: &str) -> Result<&'a Variable> {
    let variable = description.variable(name)?;
    ensure!(variable.kind() == Type::Real, "{name} is a {:?} (allowed: Real)", variable.kind());
    Ok(variable)
}

fn named(text: &str) -> Result<(&str, &str)> {
    let (name, value) =
        text.split_once('=').with_context(|| format!("\"{text}\" is not of the form NAME=…"))?;
    Ok((name.trim(), value.trim()))
}

fn numbers(text: &str) -> Result<Vec<f64>> {
    let one = |part: &str| {
        let number: Option<f64> = part.trim().parse().ok().filter(|x: &f64| !x.is_nan());
        number.with_context(|| format!("\"{part}\" is not a number"))
    };
    text.split(':').map(one).collect()
}

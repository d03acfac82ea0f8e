//! Reads files of parameters: TOML with `"name" = value`, the parameter set of SSP (.ssv), or the result of `hubslosh
//! identify` (.json). The command line and the Python package both use this module.

use std::fmt;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};
use files::input;
use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::error::Category;
use toml::de::{DeTable, DeValue};

use crate::description::{BaseUnit, ModelDescription, Type, Value};
use crate::xml::Element;

#[derive(Clone, Debug, Default)]
pub struct ParameterSet {
    pub parameters: Vec<Parameter>,
    pub warnings: Vec<String>,
}

#[derive(Clone, Debug)]
pub struct Parameter {
    pub name: String,
    pub value: Value,
    /// Unit that the file states for the value. A value without a unit is in the unit of the FMU's
    /// variable.
    pub unit: Option<Unit>,
    line: u64,
}

#[derive(Clone, Debug)]
pub struct Unit {
    pub name: String,
    /// Definition of the unit by SI base units, if the file has one. Without it the unit must be the unit of the FMU's
    /// variable or one of its display units.
    pub base: Option<BaseUnit>,
}

impl ParameterSet {
    /// Reads a file of parameters. The ending of its name determines the format: TOML, JSON of
    /// `hubslosh identify`, or SSV.
    ///
    /// # Errors
    ///
    /// If the file is not valid, has no parameters, or sets a parameter twice. The message begins
    /// with the path.
    pub fn read(path: &Path) -> Result<ParameterSet> {
        let shown = path.display();
        let text = input::text(path).with_context(|| format!("the file {shown} cannot be read"))?;
        let read = match path.extension().and_then(|ending| ending.to_str()) {
            Some("toml") => from_toml(&text),
            Some("ssv") => from_ssv(&text),
            Some("json") => from_json(&text),
            _ => bail!("{shown}: the name must end in .toml, .ssv or .json"),
        };
        let found = read.with_context(|| shown.to_string())?;
        ensure!(
            !found.parameters.is_empty(),
            "{shown} contains no parameters (allowed: one or more)"
        );
        Ok(found)
    }
}

impl Parameter {
    pub fn new(name: &str, value: Value, unit: Option<Unit>) -> Parameter {
        Parameter { name: name.into(), value, unit, line: 0 }
    }

    /// Returns the value as a text in the unit of the FMU's variable, as
    /// [`Instance::set`](crate::Instance::set) expects it.
    ///
    /// # Errors
    ///
    /// If the variable has no unit, or the value cannot be converted to it.
    pub fn text(&self, description: &ModelDescription) -> Result<String> {
        let name = &self.name;
        let Some(unit) = &self.unit else { return Ok(text(&self.value)) };
        let convert = || -> Result<f64> {
            let variable = description.variable(name)?;
            ensure!(
                variable.kind() == Type::Real,
                "{name} has the type {:?} and no unit, but the file gives the unit \"{}\"",
                variable.kind(),
                unit.name
            );
            let Value::Real(number) = self.value else {
                bail!("{name} expects a number, not \"{}\"", text(&self.value))
            };
            match &unit.base {
                Some(base) => description.converted(variable, number, &unit.name, base),
                None => match description.value(variable, &format!("{number:?} {}", unit.name))? {
                    Value::Real(value) => Ok(value),
                    _ => Ok(number),
                },
            }
        };
        let converted = match self.line {
            0 => convert()?,
            line => convert().with_context(|| format!("line {line}"))?,
        };
        Ok(format!("{converted:?}"))
    }
}

fn text(value: &Value) -> String {
    match value {
        Value::Real(number) => format!("{number:?}"),
        Value::Integer(number) => number.to_string(),
        Value::Boolean(truth) => truth.to_string(),
        Value::String(text) => text.clone(),
    }
}

fn refuse_duplicates(parameters: Vec<Parameter>) -> Result<ParameterSet> {
    for (k, parameter) in parameters.iter().enumerate() {
        let Parameter { name, line, .. } = parameter;
        if let Some(first) = parameters[..k].iter().find(|other| other.name == *name) {
            bail!(
                "line {line}: {name} is given twice, first in line {} (allowed: once)",
                first.line
            );
        }
    }
    Ok(ParameterSet { parameters, warnings: Vec::new() })
}

fn from_toml(text: &str) -> Result<ParameterSet> {
    fn flatten(
        prefix: &str,
        table: &DeTable,
        text: &str,
        found: &mut Vec<Parameter>,
        wrong: &mut Vec<String>,
    ) {
        for (key, value) in table {
            let own = key.get_ref();
            let name = if prefix.is_empty() { own.to_string() } else { format!("{prefix}.{own}") };
            let line = 1 + text[..key.span().start].matches('\n').count() as u64;
            let digits = |text: &str| text.replace('_', "");
            let value = match value.get_ref() {
                DeValue::Table(inside) => {
                    flatten(&name, inside, text, found, wrong);
                    continue;
                }
                DeValue::Float(number) => digits(number.as_str()).parse().ok().map(Value::Real),
                DeValue::Integer(number) => {
                    i64::from_str_radix(&digits(number.as_str()), number.radix())
                        .ok()
                        .map(Value::Integer)
                }
                DeValue::Boolean(truth) => Some(Value::Boolean(*truth)),
                DeValue::String(text) => Some(Value::String(text.to_string())),
                _ => None,
            };
            match value {
                Some(value) => found.push(Parameter { name, value, unit: None, line }),
                None => wrong.push(format!("line {line}: {name}")),
            }
        }
    }
    let table = DeTable::parse(text)?;
    let (mut found, mut wrong) = (Vec::new(), Vec::new());
    flatten("", table.get_ref(), text, &mut found, &mut wrong);
    ensure!(
        wrong.is_empty(),
        "{} cannot be a value of a parameter (allowed: numbers, true and false, texts)",
        wrong.join("; ")
    );
    refuse_duplicates(found)
}

/// A JSON object as a list of names and values. Unlike a map, which would silently keep the last
/// value, it reports a repeated name as an error.
#[derive(Default)]
struct Entries<T>(Vec<(String, T)>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Entries<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Of<T>(std::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Of<T> {
            type Value = Entries<T>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries<T>, A::Error> {
                let mut all: Vec<(String, T)> = Vec::new();
                while let Some((name, value)) = map.next_entry::<String, T>()? {
                    if all.iter().any(|(other, _)| *other == name) {
                        let words = format!("{name} is given twice (allowed: once)");
                        return Err(serde::de::Error::custom(words));
                    }
                    all.push((name, value));
                }
                Ok(Entries(all))
            }
        }
        deserializer.deserialize_map(Of(std::marker::PhantomData))
    }
}

#[derive(Deserialize)]
struct Identified {
    parameters: Option<Entries<serde_json::Value>>,
    #[serde(default)]
    settings: Entries<serde_json::Value>,
    /// True if the fit was accepted. Files of version 0.2 and earlier have the key `described`
    /// instead.
    #[serde(alias = "described")]
    fits: Option<bool>,
    converged: Option<bool>,
    #[serde(default)]
    decided_by_solver: Vec<serde_json::Value>,
}

/// Reads the result of an identification. The estimates in `parameters` override the `settings` of
/// the file. The initial states of the recordings are not read, because they are not parameters of
/// the FMU.
fn from_json(text: &str) -> Result<ParameterSet> {
    let none = "it is not a result of `hubslosh identify` with parameters of an FMU";
    let found: Identified = serde_json::from_str(text).map_err(|why| match why.classify() {
        Category::Eof => anyhow!("{none}: the file ends too early, in line {}", why.line()),
        // The library's message about wrong types describes types of Rust, which a user does not know.
        Category::Data if why.to_string().contains("expected ") => anyhow!(none),
        _ => anyhow!("{none}: {why}"),
    })?;
    let estimates =
        found.parameters.with_context(|| format!("the file has no \"parameters\": {none}"))?;
    let mut warnings = Vec::new();
    if !found.decided_by_solver.is_empty() {
        warnings.push(
            "errors of the FMU's solver have influenced some of these parameters more than the recording; the \
             verdict in the file names them"
                .into(),
        );
    }
    if found.fits == Some(false) || found.converged == Some(false) {
        warnings.push(
            "with these parameters the FMU does not fit the recording from which they were estimated; the \
             verdict in the file says why"
                .into(),
        );
    }
    let mut parameters = Vec::new();
    let mut add = |name, value| parameters.push(Parameter { name, value, unit: None, line: 0 });
    for (name, value) in found.settings.0 {
        let text = value.as_str().with_context(|| format!("settings: {name} is not a text"))?;
        if !estimates.0.iter().any(|(other, _)| *other == name) {
            add(name, Value::String(text.into()));
        }
    }
    for (name, estimate) in estimates.0 {
        let value = estimate.get("value").and_then(serde_json::Value::as_f64);
        let value = value.with_context(|| format!("parameters: {name} has no number \"value\""))?;
        add(name, Value::Real(value));
    }
    Ok(keep_parameters_of_one_run(ParameterSet { parameters, warnings }))
}

/// Returns the parameters of an identification that one simulation can use. These are the
/// parameters common to all recordings and, if there is only one recording, also its own parameters
/// (`NAME@1`). If there are several recordings, their own parameters are left out, and a warning
/// names them.
fn keep_parameters_of_one_run(found: ParameterSet) -> ParameterSet {
    let recording = |name: &str| -> Option<usize> { name.rsplit_once('@')?.1.parse().ok() };
    let has_others = found.parameters.iter().any(|p| recording(&p.name).is_some_and(|n| n > 1));
    let (mut left_out, mut parameters, mut warnings) = (Vec::new(), Vec::new(), found.warnings);
    for mut parameter in found.parameters {
        if recording(&parameter.name).is_none() {
            parameters.push(parameter);
        } else if has_others {
            left_out.push(parameter.name);
        } else {
            let plain = parameter.name.rsplit_once('@').map_or("", |(plain, _)| plain).into();
            parameter.name = plain;
            parameters.push(parameter);
        }
    }
    if !left_out.is_empty() {
        warnings.push(format!(
            "{} belong to single recordings and are not set; --set NAME=VALUE sets the value for this run",
            left_out.join(", ")
        ));
    }
    ParameterSet { parameters, warnings }
}

fn from_ssv(text: &str) -> Result<ParameterSet> {
    let root = Element::parse(text.as_bytes())?;
    ensure!(root.name == "ParameterSet", "the root element is {}, not ParameterSet", root.name);
    let attribute = |element: &Element, name: &str| {
        element.get(name).map(String::from).with_context(|| {
            format!("line {}: {} has no attribute {name}", element.line, element.name)
        })
    };
    let inside = |group: &'static str, name: &'static str| {
        let groups = root.children.iter().filter(move |element| element.name == group);
        groups.flat_map(|element| &element.children).filter(move |element| element.name == name)
    };
    let mut units = Vec::new();
    for unit in inside("Units", "Unit") {
        let name = attribute(unit, "name")?;
        let base = BaseUnit::from_element(unit).with_context(|| {
            format!(
                "line {}: the unit \"{name}\" has no valid BaseUnit (allowed: whole exponents, a finite offset, and a finite \
                 factor other than 0)",
                unit.line
            )
        })?;
        units.push((name, base));
    }
    let mut parameters = Vec::new();
    for parameter in inside("Parameters", "Parameter") {
        let name = attribute(parameter, "name")?;
        let line = parameter.line;
        let element = parameter
            .children
            .first()
            .with_context(|| format!("line {line}: {name} has no value"))?;
        let text = attribute(element, "value")?;
        let value = match &*element.name {
            "Real" => text.trim().parse().ok().map(Value::Real),
            "Integer" => text.trim().parse().ok().map(Value::Integer),
            "Boolean" => match text.trim() {
                "true" | "1" => Some(Value::Boolean(true)),
                "false" | "0" => Some(Value::Boolean(false)),
                _ => None,
            },
            _ => Some(Value::String(text.clone())),
        };
        let value = value.with_context(|| {
            format!(
                "line {line}: {name} cannot be \"{text}\" (allowed: a value of type {})",
                element.name
            )
        })?;
        let unit = element.get("unit").map(|unit| {
            let base = units.iter().find(|(name, _)| name == unit).map(|(_, base)| *base);
            Unit { name: unit.into(), base }
        });
        parameters.push(Parameter { name, value, unit, line });
    }
    refuse_duplicates(parameters)
}

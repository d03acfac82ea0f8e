//! Files of parameters: `"name" = value` as TOML, SSP 1.0's parameter set (.ssv), or the result of
//! `hubslosh identify` (.json).

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use files::input;
use host::description::{BaseUnit, ModelDescription, Type, Value};
use host::xml::Element;

/// Reads the description of the FMU that the parameters are for: units are converted to its own.
pub type Describe<'a> = &'a dyn Fn() -> Result<ModelDescription>;

/// Names and values of a set file, in its order, by its ending; numbers in the units of the FMU.
pub fn read(path: &Path, description: Describe) -> Result<Vec<(String, String)>> {
    let shown = path.display();
    let text = input::text(path).with_context(|| format!("could not read {shown}"))?;
    let settings = match path.extension().and_then(|ending| ending.to_str()) {
        Some("toml") => from_toml(&text),
        Some("ssv") => from_ssv(&text, description),
        Some("json") => from_json(&text),
        _ => bail!("{shown}: the name must end in .toml, .ssv or .json"),
    };
    let settings = settings.with_context(|| shown.to_string())?;
    ensure!(!settings.is_empty(), "{shown} sets nothing");
    Ok(settings)
}

/// Nested tables are names with dots.
fn from_toml(text: &str) -> Result<Vec<(String, String)>> {
    fn flatten(
        prefix: &str,
        table: &toml::Table,
        settings: &mut Vec<(String, String)>,
        wrong: &mut Vec<String>,
    ) {
        for (key, value) in table {
            let name = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
            let value = match value {
                toml::Value::Table(inside) => {
                    flatten(&name, inside, settings, wrong);
                    continue;
                }
                toml::Value::Float(x) => format!("{x:?}"),
                toml::Value::Integer(n) => n.to_string(),
                toml::Value::Boolean(b) => b.to_string(),
                toml::Value::String(text) => text.clone(),
                other => {
                    wrong.push(format!("{name} is a {}", other.type_str()));
                    continue;
                }
            };
            settings.push((name, value));
        }
    }
    let table: toml::Table = text.parse()?;
    let (mut settings, mut wrong) = (Vec::new(), Vec::new());
    flatten("", &table, &mut settings, &mut wrong);
    ensure!(wrong.is_empty(), "{} (allowed: numbers, true and false, texts)", wrong.join("; "));
    Ok(settings)
}

/// Reads the result of an identification: `settings`, then the estimates of `parameters`. The initial states of the recordings
/// are not parameters of the bench and stand elsewhere in the file.
fn from_json(text: &str) -> Result<Vec<(String, String)>> {
    let root: serde_json::Value = serde_json::from_str(text)?;
    let table = |key: &str| root.get(key).and_then(serde_json::Value::as_object);
    let parameters = table("parameters")
        .context("it has no \"parameters\": it is not a result of hubslosh identify, or one of a --method without any")?;
    let no = |key: &str| root.get(key).and_then(serde_json::Value::as_bool) == Some(false);
    // "described" is what versions until 0.2 wrote
    let decided = root.get("decided_by_solver").and_then(serde_json::Value::as_array);
    if decided.is_some_and(|names| !names.is_empty()) {
        crate::terminal::warn(
            "the errors of the FMU's solver decided some of these parameters; see the verdict in the file",
        );
    }
    if no("fits") || no("described") || no("converged") {
        crate::terminal::warn(
            "these parameters do not fit the recording that they are from; see its verdict",
        );
    }
    let mut settings = Vec::new();
    for (name, value) in table("settings").into_iter().flatten() {
        let text = value.as_str().with_context(|| format!("settings: {name} is not a text"))?;
        settings.push((name.clone(), text.to_string()));
    }
    for (name, estimate) in parameters {
        let value = estimate.get("value").and_then(serde_json::Value::as_f64);
        let value = value.with_context(|| format!("parameters: {name} has no number \"value\""))?;
        settings.push((name.clone(), format!("{value:?}")));
    }
    Ok(of_one_run(settings))
}

/// Returns the settings of a run: those of all recordings, and those of the one recording (`NAME@1`) if there is no other. Otherwise
/// a warning names what belongs to single recordings and is left out.
fn of_one_run(settings: Vec<(String, String)>) -> Vec<(String, String)> {
    let recording = |name: &str| -> Option<usize> { name.rsplit_once('@')?.1.parse().ok() };
    let has_others = settings.iter().any(|(name, _)| recording(name).is_some_and(|n| n > 1));
    let mut left_out = Vec::new();
    let mut kept = Vec::new();
    for (name, value) in settings {
        match (recording(&name), name.rsplit_once('@')) {
            (Some(_), _) if has_others => left_out.push(name),
            (Some(_), Some((plain, _))) => kept.push((plain.to_string(), value)),
            _ => kept.push((name, value)),
        }
    }
    if !left_out.is_empty() {
        crate::terminal::warn(format_args!(
            "{} belong to single recordings and are not set: --set NAME=VALUE sets the one of this run",
            left_out.join(", ")
        ));
    }
    kept
}

/// SSP 1.0 and 2.0, "SystemStructureParameterValues": a value with a `unit` is converted by the unit's definition in the file's
/// `Units`. Without a definition it must be a unit of the FMU.
fn from_ssv(text: &str, description: Describe) -> Result<Vec<(String, String)>> {
    let root = Element::parse(text.as_bytes()).map_err(anyhow::Error::msg)?;
    ensure!(root.name == "ParameterSet", "its root is {}, not ParameterSet", root.name);
    let attribute = |element: &Element, name: &str| {
        element.get(name).map(String::from).with_context(|| {
            format!("line {}: {} has no attribute {name}", element.line, element.name)
        })
    };
    let inside = |group: &'static str, name: &'static str| {
        let groups = root.children.iter().filter(move |element| element.name == group);
        groups.flat_map(|element| &element.children).filter(move |element| element.name == name)
    };
    let mut of_fmu = None;
    let mut settings = Vec::new();
    for parameter in inside("Parameters", "Parameter") {
        let name = attribute(parameter, "name")?;
        let value = parameter
            .children
            .first()
            .with_context(|| format!("line {}: {name} has no value", parameter.line))?;
        let mut text = attribute(value, "value")?;
        if let Some(unit) = value.get("unit") {
            let description: &ModelDescription = match &mut of_fmu {
                Some(description) => description,
                none => none.insert(description()?),
            };
            let at = || format!("line {}", parameter.line);
            let definition =
                inside("Units", "Unit").find(|defined| defined.get("name") == Some(unit));
            text = with_unit(description, &name, &text, unit, definition).with_context(at)?;
        }
        settings.push((name, text));
    }
    Ok(settings)
}

/// A value with a unit as a number in the unit of the FMU's variable.
fn with_unit(
    description: &ModelDescription,
    name: &str,
    text: &str,
    unit: &str,
    definition: Option<&Element>,
) -> Result<String> {
    let variable = description.variable(name)?;
    ensure!(
        variable.kind() == Type::Real,
        "{name} is a {:?} and has no unit, but \"{unit}\" is given",
        variable.kind()
    );
    let number: f64 = text
        .trim()
        .parse()
        .ok()
        .with_context(|| format!("{name} expects a number, not \"{text}\""))?;
    let value = match definition {
        Some(element) => {
            let base = BaseUnit::of(element).with_context(|| {
                format!(
                    "{name}: the file defines \"{unit}\" in line {} without a valid BaseUnit",
                    element.line
                )
            })?;
            description.converted(variable, number, unit, &base)?
        }
        None => match description.value(variable, &format!("{number:?} {unit}"))? {
            Value::Real(value) => value,
            _ => number,
        },
    };
    Ok(format!("{value:?}"))
}

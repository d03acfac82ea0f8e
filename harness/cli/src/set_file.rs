//! Files of parameters: `"name" = value` as TOML, SSP 1.0's parameter set (.ssv), or the result of
//! `hubslosh identify` (.json).

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use host::xml::Element;

/// Names and values of a set file, in its order, by its ending.
pub fn read(path: &Path) -> Result<Vec<(String, String)>> {
    let shown = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("could not read {shown}"))?;
    let parse = match path.extension().and_then(|ending| ending.to_str()) {
        Some("toml") => from_toml,
        Some("ssv") => from_ssv,
        Some("json") => from_json,
        _ => bail!("{shown}: the name must end in .toml, .ssv or .json"),
    };
    let settings = parse(&text).with_context(|| shown.to_string())?;
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

/// What was identified: `settings`, then the estimates of `parameters`. Another initial state of each recording
/// is not a parameter of the bench and stands elsewhere in the file.
fn from_json(text: &str) -> Result<Vec<(String, String)>> {
    let root: serde_json::Value = serde_json::from_str(text)?;
    let table = |key: &str| root.get(key).and_then(serde_json::Value::as_object);
    let parameters = table("parameters")
        .context("it has no \"parameters\": it is not a result of hubslosh identify, or one of a --method without any")?;
    let no = |key: &str| root.get(key).and_then(serde_json::Value::as_bool) == Some(false);
    // "described" is what versions until 0.2 wrote
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
    Ok(settings)
}

fn from_ssv(text: &str) -> Result<Vec<(String, String)>> {
    let root = Element::parse(text.as_bytes()).map_err(anyhow::Error::msg)?;
    ensure!(root.name == "ParameterSet", "its root is {}, not ParameterSet", root.name);
    let groups = root.children.iter().filter(|group| group.name == "Parameters");
    let attribute = |element: &Element, name: &str| {
        let found = element.attributes.iter().find(|(n, _)| n == name);
        found.map(|(_, value)| value.clone()).with_context(|| {
            format!("line {}: {} has no attribute {name}", element.line, element.name)
        })
    };
    let parameter = |parameter: &Element| {
        let name = attribute(parameter, "name")?;
        let value = parameter
            .children
            .first()
            .with_context(|| format!("line {}: {name} has no value", parameter.line))?;
        Ok((name, attribute(value, "value")?))
    };
    groups
        .flat_map(|group| &group.children)
        .filter(|p| p.name == "Parameter")
        .map(parameter)
        .collect()
}

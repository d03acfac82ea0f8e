use std::collections::BTreeSet;
use std::path::PathBuf;

use anyhow::{Result, bail};
use host::description::{ModelDescription, Variable};
use serde_json::{Map, Value, json};

use super::DEFAULT_FMU;
use crate::{fmu, terminal};

/// Lists the variables of an FMU with causality, start value, unit, range and meaning.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh variables\n  hubslosh variables friction\n  \
    hubslosh variables tank --causality parameter\n  \
    hubslosh variables --fmu dist/Spacecraft.fmu --causality input")]
pub struct VariablesArgs {
    /// Text that name or meaning of a variable must contain, in upper or lower case.
    filter: Option<String>,
    /// Lists only variables with this causality: input, output, parameter, calculatedParameter or local.
    #[arg(long, value_name = "NAME")]
    causality: Option<String>,
    /// Prints the variables as JSON, one object for each. The entry `units` lists the units in which a value may be
    /// given; the value in a unit is factor · SI value + offset.
    #[arg(long)]
    json: bool,
    /// FMU: a file, or the name of an FMU of this project (`hubslosh fmus` lists them).
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    pub fmu: PathBuf,
}

/// Largest width of a column of the table, characters. A longer cell is printed in full and moves
/// the rest of its line to the right.
const WIDEST: usize = 80;

const ITEMS: usize = 50;

impl VariablesArgs {
    pub fn run(self) -> Result<()> {
        let fmu = fmu::find(&self.fmu)?;
        let description = &ModelDescription::from_fmu(&fmu)?;
        let filter = self.filter.unwrap_or_default().to_lowercase();
        let wanted = |v: &&Variable| {
            let named = v.name.to_lowercase().contains(&filter);
            (named || v.description.to_lowercase().contains(&filter))
                && self.causality.as_ref().is_none_or(|causality| causality == v.causality.as_str())
        };
        if self.json && description.variables.iter().any(|v| wanted(&v)) {
            let chosen = description.variables.iter().filter(wanted);
            return terminal::print_json(
                &chosen.map(|v| object(description, v)).collect::<Vec<_>>(),
            );
        }
        let rows: Vec<[String; 6]> =
            description.variables.iter().filter(wanted).map(|v| row(description, v)).collect();
        if rows.is_empty() {
            let mut asked = self.causality.map_or(String::new(), |c| format!(" of causality {c}"));
            if !filter.is_empty() {
                asked.push_str(&format!(" with \"{filter}\" in its name or meaning"));
            }
            let there: BTreeSet<&str> =
                description.variables.iter().map(|v| v.causality.as_str()).collect();
            let there: Vec<&str> = there.into_iter().collect();
            bail!(
                "{} has no variable{asked} (causalities of its variables: {})",
                fmu.display(),
                there.join(", ")
            );
        }
        let head = ["name", "causality", "start", "unit", "range", "meaning"].map(String::from);
        let width = |i: usize| {
            let all = rows.iter().chain([&head]).map(|row| row[i].chars().count());
            all.max().unwrap_or(0).min(WIDEST)
        };
        let widths: [usize; 5] = std::array::from_fn(width);
        for row in [&head].into_iter().chain(&rows) {
            let cells: String =
                row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}  ")).collect();
            println!("{cells}{}", row[5]);
        }
        Ok(())
    }
}

fn object(description: &ModelDescription, variable: &Variable) -> Value {
    let attributes = variable.attributes();
    let own = description.unit(variable);
    let own = (!own.is_empty()).then(|| (own.to_string(), json!({ "factor": 1.0, "offset": 0.0 })));
    let shown = description
        .display_units(variable)
        .iter()
        .map(|unit| (unit.name.clone(), json!({ "factor": unit.factor, "offset": unit.offset })));
    // Numbers become JSON numbers; the digits are those in the FMU.
    let value = |text: &Option<String>| {
        let text = text.as_ref()?;
        Some(match description.value(variable, text) {
            Ok(host::description::Value::Real(number)) => json!(number),
            Ok(host::description::Value::Integer(number)) => json!(number),
            Ok(host::description::Value::Boolean(truth)) => json!(truth),
            _ => json!(text),
        })
    };
    let items =
        description.items(variable).iter().map(|item| (item.name.clone(), item.value.into()));
    json!({
        "name": variable.name,
        "type": format!("{:?}", variable.kind()),
        "causality": variable.causality.as_str(),
        "variability": variable.variability.as_str(),
        "start": value(&attributes.start),
        "min": value(&attributes.min),
        "max": value(&attributes.max),
        "units": own.into_iter().chain(shown).collect::<Map<_, _>>(),
        "items": items.collect::<Map<String, Value>>(),
        "meaning": variable.description,
    })
}

fn row(description: &ModelDescription, variable: &Variable) -> [String; 6] {
    let attributes = variable.attributes();
    let items = description.items(variable);
    let text = |value: &Option<String>| value.clone().unwrap_or_default();
    let start = text(&attributes.start);
    let number = start.trim().parse::<i64>().ok();
    let start = match items.iter().find(|item| Some(item.value) == number) {
        Some(item) => item.name.clone(),
        None => start,
    };
    let range = match (&attributes.min, &attributes.max) {
        _ if !items.is_empty() => {
            let more = (items.len() > ITEMS).then_some("…");
            let names = items.iter().take(ITEMS).map(|item| item.name.as_str());
            names.chain(more).collect::<Vec<_>>().join("|")
        }
        (None, None) => String::new(),
        (Some(min), None) => format!(">= {min}"),
        (None, Some(max)) => format!("<= {max}"),
        (Some(min), Some(max)) => format!("{min} to {max}"),
    };
    let causality = variable.causality.to_string();
    let (unit, meaning) = (text(&attributes.unit), variable.description.clone());
    [variable.name.clone(), causality, start, unit, range, meaning]
}

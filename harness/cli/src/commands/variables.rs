//! `hubslosh variables`.

use std::collections::BTreeSet;
use std::path::PathBuf;

use anyhow::{Result, bail};
use host::description::{ModelDescription, Variable};

use super::DEFAULT_FMU;

/// Lists an FMU's variables: name, causality, start, unit, range, meaning.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  hubslosh variables\n  hubslosh variables friction\n  \
    hubslosh variables tank --causality parameter\n  \
    hubslosh variables --fmu dist/Spacecraft.fmu --causality input")]
pub struct VariablesArgs {
    /// Only those whose name or meaning contains this, in upper or lower case.
    filter: Option<String>,
    /// Only those of this causality: input, output, parameter, calculatedParameter, local.
    #[arg(long, value_name = "NAME")]
    causality: Option<String>,
    /// The FMU.
    #[arg(long, value_name = "FILE", default_value = DEFAULT_FMU)]
    fmu: PathBuf,
}

/// Characters to which a column is filled; longer cells push the next ones to the right.
const WIDEST: usize = 80;

/// Items of an enumeration that are listed.
const ITEMS: usize = 50;

impl VariablesArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        let description = &ModelDescription::of_packed(&self.fmu)?;
        let filter = self.filter.unwrap_or_default().to_lowercase();
        let wanted = |v: &&Variable| {
            let named = v.name.to_lowercase().contains(&filter);
            (named || v.description.to_lowercase().contains(&filter))
                && self.causality.as_ref().is_none_or(|causality| *causality == v.causality)
        };
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
                "{} has no variable{asked} (causalities in it: {})",
                self.fmu.display(),
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

/// Name, causality, start, unit, range (of an enumeration its items), meaning.
fn row(description: &ModelDescription, variable: &Variable) -> [String; 6] {
    let attributes = variable.attributes();
    let items = description.items(variable);
    let text = |value: &Option<String>| value.clone().unwrap_or_default();
    let start = text(&attributes.start);
    let number = start.trim().parse::<i32>().ok();
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
    let causality = variable.causality.clone();
    let (unit, meaning) = (text(&attributes.unit), variable.description.clone());
    [variable.name.clone(), causality, start, unit, range, meaning]
}

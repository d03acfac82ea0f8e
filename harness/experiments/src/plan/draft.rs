//! A plan that a command creates from its options.

use anyhow::Result;
use toml::{Table, Value};

use super::{Plan, Recorded};

/// The parts of a plan: settings of every run by FMU name, listed runs, and lists of values that are varied. `step` is in s;
/// `tolerance` is the relative tolerance of the FMU's solver (`None` for the FMU's own).
#[derive(Clone, Debug, Default)]
pub struct Draft {
    pub title: String,
    pub profile: String,
    pub step: Option<f64>,
    pub tolerance: Option<f64>,
    pub set: Vec<(String, String)>,
    pub runs: Vec<Table>,
    pub vary: Vec<(&'static str, Vec<String>)>,
}

impl Draft {
    pub fn run(
        recorded: &Recorded,
        values: impl IntoIterator<Item = (&'static str, Value)>,
    ) -> Table {
        let (file, columns) = (recorded.path.display().to_string(), recorded.columns.to_string());
        let texts = [("recording", file), ("columns", columns)];
        let texts = texts.into_iter().filter(|(_, text)| !text.is_empty());
        let texts = texts.map(|(key, text)| (key, Value::from(text)));
        texts.chain(values).map(|(key, value)| (key.to_string(), value)).collect()
    }

    /// Returns the plan. It is parsed from the text that a user would write; errors have no line numbers, because the user
    /// has not written this text.
    pub fn plan(self) -> Result<Plan> {
        let set = self.set.into_iter().map(|(name, value)| (name, value.into()));
        let vary = self.vary.into_iter().map(|(name, values)| (name.to_string(), values.into()));
        let runs: Vec<Value> = self.runs.into_iter().map(Value::Table).collect();
        let mut table = Table::new();
        table.insert("title".into(), self.title.into());
        table.insert("profile".into(), self.profile.into());
        for (key, number) in [("step", self.step), ("tolerance", self.tolerance)] {
            table.extend(number.map(|number| (key.to_string(), number.into())));
        }
        table.insert("set".into(), set.collect::<Table>().into());
        table.insert("run".into(), runs.into());
        table.insert("vary".into(), vary.collect::<Table>().into());
        table.retain(|_, value| *value != Value::Array(Vec::new()));
        Plan::from_text(&toml::to_string(&table)?, false)
    }
}
